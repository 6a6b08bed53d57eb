"""Friction laws of the interfaces with their effective numbers.

The effective numbers follow from the surface temperature (2.13), the spread over a pad (2.15) and the
stiffness of the law.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

from .. import friction
from ..core import PatchfemError, array_dataclass
from ..effects import import_effect
from . import patch as patch_models
from .source import name_key

if TYPE_CHECKING:
    from ..scene.keys.tables import Friction
    from ..scene.scene import Scene
    from .patch import PatchModel

# Default rest speed of bonds (2.10) as a fraction of the peak speed.
REST_SPEED_FRACTION = 1e-3


class FrictionLimits(NamedTuple):
    """Static and kinetic friction limit [N]."""

    static: float
    kinetic: float


@array_dataclass
class InterfaceLaw:
    """Interface of a rig with its friction law.

    - key: key of its table, for messages.
    - numbers: effective keys of the law.
    - load: normal load [N] of an interface between masses, an estimate until a patch with a prescribed approach is
      pressed; None if the patch or the point of the model carries it.
    - patch: patch that carries `load`; None for a point.
    - spread_share: fraction of the friction force that acts on the pad (2.15); None without spread.
    """

    key: str
    numbers: Friction
    load: float | None
    patch: PatchModel | None = None
    spread_share: float | None = None

    @property
    def partial_slip(self) -> str:
        """Name of the key that enables partial slip of the patch, or "" if it slips as a whole."""
        return self.patch.interface.partial_slip if self.patch is not None else ""

    def friction_limits(self, load: float) -> FrictionLimits:
        """Return the static and the kinetic friction limit [N] under a normal load [N]."""
        law = self.numbers
        kinetic = law.kinetic if law.kinetic is not None else law.static
        return FrictionLimits(law.static * load, kinetic * load)


def find_spread_share(law: Friction, width: float | None) -> float | None:
    """Return the fraction of the friction force that acts on a pad of a width [m] across the path; None without spread."""
    if law.spread is None:
        return None
    return friction.bonds.spread.carried_fraction(width, law.spread)


def make_effective_law(law: Friction, spread_share: float | None) -> Friction:
    """Return the keys of a friction law after applying the effects that change its parameters.

    `rest_growth` and `slip_growth` are taken at the surface temperature; `static` and `kinetic` are
    multiplied by the factor of the pad.

    Parameters
    ----------
    law : Friction
        Keys of the friction law.
    spread_share : float or None
        Factor of the pad (`find_spread_share`).

    Returns
    -------
    Friction

    Raises
    ------
    PatchfemError
        If a rate of growth leaves the range of floating-point numbers.
    """
    if law.temperature is None and spread_share is None:
        return law
    changes = {"temperature": None, "spread": None}
    if law.temperature is not None and law.rest_growth is not None:
        rest_growth, slip_growth = _scale_growth_rates(law)
        changes |= {"rest_growth": rest_growth, "slip_growth": slip_growth}
    if spread_share is not None:
        changes["static"] = law.static * spread_share
        changes["kinetic"] = None if law.kinetic is None else law.kinetic * spread_share
    return law.model_copy(update=changes)


def _scale_growth_rates(law: Friction) -> tuple[float, float]:
    """Return the growth of bonds at rest [m s-2] and during slip [m] at the surface temperature of a law."""
    heat = law.temperature
    with name_key("friction.temperature"):
        return import_effect("friction.temperature").growth_at_temperature(
            law.rest_growth,
            law.slip_growth,
            heat.surface,
            heat.reference,
            heat.rest_activation,
            heat.slip_activation,
        )


def make_bond_parameters(law: Friction, peak_speed: float, min_rest_speed: float = 0.0):
    """Return the bond parameters of the law 'nonlocal'.

    Parameters
    ----------
    law : Friction
        Keys of the friction law.
    peak_speed : float
        Expected peak speed [m/s]; the default of the rest speed follows.
    min_rest_speed : float
        Smallest default of the rest speed [m/s].

    Returns
    -------
    friction.bonds.parameters.Bonds
    """
    growth = None
    if law.rest_growth is not None:
        rest_speed = law.rest_speed or max(REST_SPEED_FRACTION * peak_speed, min_rest_speed)
        growth = friction.bonds.parameters.BondGrowth(law.rest_growth, law.slip_growth, rest_speed)
    return friction.bonds.parameters.Bonds(
        law.static,
        law.bond_length,
        law.order,
        law.reading,
        law.kinetic / law.static if law.static > 0 else 1.0,
        growth,
        law.initial_bonds,
    )


def build_interface_laws(scene: Scene) -> tuple[InterfaceLaw, ...]:
    """Build the friction laws of all interfaces of a rig.

    They come from [[structure.interface]], or from [friction] for the only interface.

    Parameters
    ----------
    scene : Scene
        Checked scene of a rig or of a bench.

    Returns
    -------
    tuple of InterfaceLaw
        Empty without friction.
    """
    tables = () if scene.structure is None else scene.structure.interface
    if tables:
        return tuple(_build_interface(scene, number) for number in range(len(tables)))
    if scene.friction is None:
        return ()
    contact = scene.contact or scene.normal
    share = find_spread_share(scene.friction, contact and contact.width)
    law = make_effective_law(scene.friction, share)
    return (InterfaceLaw("friction", law, None, spread_share=share),)


def _build_interface(scene: Scene, number: int) -> InterfaceLaw:
    """Build the interface that table `number`, from 0, of [[structure.interface]] in a scene describes."""
    table = scene.structure.interface[number]
    patch = _build_interface_patch(scene, number)
    load = table.normal_load
    if load is None:
        load = patch.nominal_load
    share = find_spread_share(table, table.contact and table.contact.width)
    law = make_effective_law(table, share)
    return InterfaceLaw(f"structure.interface.{number}", law, load, patch, share)


def _build_interface_patch(scene: Scene, number: int) -> PatchModel | None:
    """Build the patch of interface `number`, from 0, of a scene, or None for an interface without one.

    A PatchfemError names the key of the file that cannot be used.
    """
    table = scene.structure.interface[number]
    if table.contact is None:
        return None
    try:
        patch = patch_models.build_patch(table.contact, scene.resolve_path)
    except PatchfemError as error:
        error.key = error.key and f"structure.interface.{number}.{error.key}"
        raise
    partial_slip = table.compliance_key if table.static else ""
    return replace(patch, interface=replace(patch.interface, partial_slip=partial_slip))


def find_normal_load(scene: Scene) -> float | None:
    """Return the (mean) normal load [N] of a scene, or None if the approach is prescribed."""
    contact = scene.contact or scene.normal
    return contact.load if contact is not None else None


def make_interface_names(structure) -> list[str]:
    """Return the names of the interfaces of [structure] between masses, such as "1-2".

    Several interfaces between the same masses get a number, as in "1-2 (2)". It is [] if there are no masses.
    """
    names = ["-".join(map(str, interface.between)) for interface in structure.interface]
    return [
        name if names.count(name) == 1 else f"{name} ({number})"
        for number, name in enumerate(names, 1)
    ]
