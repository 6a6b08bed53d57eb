"""The interfaces of a rig: which law and load acts on each, and whether load or yaw changes with the motion."""

import numpy as np

from ..core import ModalBasis
from .law import Rubbing, acting


def rubbings_of(scene) -> tuple:
    """A Rubbing for every interface of a rig: those of [[structure.interface]], or [friction]; none without either."""
    if scene.structure.interface:
        return tuple(Rubbing(f"structure.interface.{k}", acting(one, None, scene.where), one.load)
                     for k, one in enumerate(scene.structure.interface))
    if scene.friction is None:
        return ()
    return (Rubbing("friction", acting(scene.friction, pad_width(scene), scene.where), None),)


def pad_width(scene) -> float | None:
    """Width of the contact across the path [m]; strips share it."""
    if scene.contact is not None:
        return scene.contact.width
    return scene.normal.width if scene.normal is not None else None


def interface_names(scene) -> list:
    """Names of the interfaces of a rig of masses, "1-2" between the masses 1 and 2; [] of any other."""
    found = [f"{i.between[0]}-{i.between[1]}" for i in scene.structure.interface]
    return [name if found.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(found, 1)]


def yaws(scene) -> bool:
    """Whether strips slide each by themselves: modes that yaw the patch about its normal, over [contact.strips]."""
    strips = scene.contact is not None and scene.contact.strips is not None
    return strips and scene.friction is not None and any(mode.yaw for mode in scene.structure.mode)


def strip_rows(basis: ModalBasis, offsets) -> np.ndarray:
    """(s, n): slide of strips at offsets y (s,) [m] from the middle, slide - y yaw (yaw > 0 turns +x to +y, so a piece
    at +y goes back); a moment about +z on the upper piece is sum y f of the friction f that resists."""
    yaw = np.zeros(basis.slide.size) if basis.yaw is None else basis.yaw
    return basis.slide - np.outer(offsets, yaw)


def acts(scene) -> bool:
    """Whether the load of a rig changes with its motion (modes with normal or pitch) or in time (normal.amplitude)."""
    if scene.friction is None and not scene.structure.interface:
        return False
    varies = scene.normal is not None and bool(scene.normal.amplitude)
    return varies or any(mode.normal or mode.pitch for mode in scene.structure.mode)
