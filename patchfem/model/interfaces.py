"""The interfaces of a rig: which law and load acts on each, and whether load or yaw changes with the motion."""

from dataclasses import replace

import numpy as np

from ..core import ModalBasis
from ..scene.tables import Normal
from .load import varies


def viewed(scene, number: int = 0):
    """The scene as one interface sees it: the law and load of [[structure.interface]] `number` as [friction] and
    [normal]; the scene itself where it names none."""
    if scene.structure is None or not scene.structure.interface:
        return scene
    one = scene.structure.interface[number]
    return replace(scene, friction=one, normal=Normal.model_construct(load=one.load, amplitude=None, frequency=None,
                                                                      phase=None, width=None))


def loads_of(scene) -> list:
    """Normal load of every interface of a scene without [contact] [N]."""
    if scene.structure.interface:
        return [one.load for one in scene.structure.interface]
    return [scene.normal.load] if scene.normal is not None else []


def yaws(scene) -> bool:
    """Whether strips slide each by themselves: modes that yaw the patch about its normal, over [contact.strips]."""
    strips = scene.contact is not None and scene.contact.strips is not None
    return strips and scene.friction is not None and any(mode.yaw for mode in scene.structure.mode)


def strip_rows(basis: ModalBasis, offsets) -> np.ndarray:
    """(s, n): slide of strips at offsets y (s,) [m] from the middle, slide - y yaw (yaw > 0 turns +x to +y, so a piece
    at +y goes back); a moment about +z on the upper piece is sum y f of the friction f that resists."""
    yaw = np.zeros(basis.slide.size) if basis.yaw is None else basis.yaw
    return basis.slide - np.outer(offsets, yaw)


def limits(scene, number: int, load: float) -> tuple:
    """(static, kinetic) friction force [N] of a Coulomb interface."""
    from .law import acting

    f = acting(viewed(scene, number)).friction
    return f.static * load, (f.kinetic if f.kinetic is not None else f.static) * load


def acts(scene) -> bool:
    """Whether the load of a rig changes with its motion (modes with normal or pitch) or in time (normal.amplitude)."""
    if scene.structure is None or scene.friction is None:
        return False
    return varies(scene) or any(mode.normal or mode.pitch for mode in scene.structure.mode)
