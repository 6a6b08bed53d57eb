"""The law of every interface with its numbers as they act: at a surface temperature (2.13) and over a pad (2.15)."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from ..core import PatchfemError
from ..effects import either, module_of
from ..friction.bonds import parameters, spread
from . import patch as patch_model

if TYPE_CHECKING:
    from .patch import PatchModel


@dataclass(frozen=True, eq=False, slots=True)
class InterfaceLaw:
    """One interface that rubs, with its law.

    key: of its table, for messages; numbers: keys of the law as they act; load: normal load [N] of an interface between
    masses, None where the patch or the point of the model carries it; patch: that bears this load, None of a point;
    lateral: name of the pair of its second direction where it slides in a plane, "" where it does not.
    """

    key: str
    numbers: object
    load: float | None
    patch: PatchModel | None = None
    lateral: str = ""

    @property
    def soft(self) -> str:
        """What lets its patch slip part by part, as the scene writes it; "" where nothing does."""
        return self.patch.interface.partial_slip if self.patch is not None else ""

    def limits(self, load: float) -> tuple:
        """Static and kinetic friction force [N], >= 0, of the interface under a load [N]."""
        return limits_of(self.numbers, load)


def limits_of(f, load: float) -> tuple:
    """Static and kinetic friction force [N] of the keys of a law under a load [N]."""
    return f.static * load, (f.kinetic if f.kinetic is not None else f.static) * load


def acting(f, width: float | None, where, load: float | None = None):
    """The keys of a law after the effects that only change its numbers.

    rest_growth and slip_growth are those at friction.temperature; static and kinetic are multiplied by the pad's share
    of friction.spread; of a stiffness follows the bond length, as `stretching` has it. width [m]: of the contact across
    the path; where(key) -> place of a key; load [N] of the contact. PatchfemError where a rate leaves the range of
    numbers.
    """
    if f is None or (f.temperature is None and f.spread is None):
        return stretching(f, load)
    new = {"temperature": None, "spread": None}
    if f.temperature is not None and f.rest_growth is not None:
        t, growth_at = f.temperature, module_of("friction.temperature").growth_at
        try:
            new["rest_growth"], new["slip_growth"] = growth_at(
                f.rest_growth,
                f.slip_growth,
                t.surface,
                t.reference,
                t.rest_activation,
                t.slip_activation,
            )
        except PatchfemError as error:
            raise PatchfemError(f"{where('friction.temperature')}: {error}") from None
    if f.spread is not None:
        share = spread.pad_factor(width, f.spread)
        new |= {
            "static": f.static * share,
            "kinetic": None if f.kinetic is None else f.kinetic * share,
        }
    return stretching(f.model_copy(update=new), load)


def stretching(f, load):
    """The keys of a law with the bond length [m] that makes its stiffness under a load [N], of which 0 counts as 1 N,
    where the law is given one in place of the other; numbers or columns of them."""
    if f is None or f.stiffness is None or not either(f.law):
        return f
    return f.model_copy(
        update={"bond_length": f.static * (load if np.ndim(load) else load or 1.0) / f.stiffness}
    )


def bonds_of(f, speed: float, least: float = 0.0):
    """The friction.bonds.parameters.Bonds of the keys of a law.

    The floor v_h of the speed defaults to 1e-3 of the peak speed [m/s], but not below `least`.
    """
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return parameters.Bonds(
        f.static,
        f.bond_length,
        f.order,
        f.reading,
        ratio,
        f.rest_growth,
        f.slip_growth,
        f.rest_speed or max(1e-3 * speed, least),
        f.initial_bonds,
        f.breakaway,
    )


def interface_laws_of(scene) -> tuple:
    """An InterfaceLaw for every interface of a rig: those of [[structure.interface]], or the one of [friction].

    None, as an empty tuple, without either. PatchfemError where a rate of growth leaves the range of numbers.
    """
    if scene.structure.interface:
        return tuple(
            InterfaceLaw(
                f"structure.interface.{k}",
                acting(one, None, scene.where, one.pressing),
                one.pressing,
                _patch_of(scene, k, one),
                "-".join(map(str, one.lateral or ())),
            )
            for k, one in enumerate(scene.structure.interface)
        )
    if scene.friction is None:
        return ()
    return (
        InterfaceLaw(
            "friction", acting(scene.friction, pad_width(scene), scene.where, load_of(scene)), None
        ),
    )


def _patch_of(scene, number: int, one) -> PatchModel | None:
    """The patch of an interface, None of one without; PatchfemError with the key of a file at fault."""
    if one.contact is None:
        return None
    try:
        patch = patch_model.build_patch(one.contact, scene.kind, scene.beside)
    except PatchfemError as error:
        error.key = error.key and f"structure.interface.{number}.{error.key}"
        raise
    return replace(patch, interface=replace(patch.interface, partial_slip=one.gives_way))


def load_of(scene) -> float | None:
    """Load [N] that a scene gives for the contact of [friction], its mean where it changes; None of an approach."""
    return (
        scene.contact.load
        if scene.contact is not None
        else scene.normal.load
        if scene.normal is not None
        else None
    )


def pad_width(scene) -> float | None:
    """Width of the contact across the path [m], which strips share; None where the scene names none."""
    if scene.contact is not None:
        return scene.contact.width
    return scene.normal.width if scene.normal is not None else None


def interface_names(structure) -> list:
    """Names of the interfaces of a rig of masses, "1-2" between the masses 1 and 2; [] of any other."""
    found = [f"{i.between[0]}-{i.between[1]}" for i in structure.interface]
    return [name if found.count(name) == 1 else f"{name} ({k})" for k, name in enumerate(found, 1)]
