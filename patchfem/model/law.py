"""The friction numbers that act: those of a scene at its surface temperature (2.13) and spread over its pad (2.15)."""

from dataclasses import replace

from ..core import PatchfemError
from ..friction.bonds.parameters import Bonds
from .slide import peak_speed


def acting(scene):
    """The scene with the effects that only change numbers of [friction] worked in: rest_growth and slip_growth at
    friction.temperature, static and kinetic times the pad's share of friction.spread. The scene itself where it names
    neither. PatchfemError where a rate leaves the range of numbers."""
    f = scene.friction
    if f is None or (f.temperature is None and f.spread is None):
        return scene
    new = {"temperature": None, "spread": None}
    if f.temperature is not None and f.rest_growth is not None:
        from ..friction.bonds.temperature import growth_at

        t = f.temperature
        try:
            new["rest_growth"], new["slip_growth"] = growth_at(f.rest_growth, f.slip_growth, t.surface, t.reference,
                                                               t.rest_activation, t.slip_activation)
        except PatchfemError as error:
            raise PatchfemError(f"{scene.where('friction.temperature')}: {error}") from None
    if f.spread is not None:
        from ..friction.bonds.spread import pad_factor

        share = pad_factor(pad_width(scene), f.spread)
        new |= {"static": f.static * share, "kinetic": None if f.kinetic is None else f.kinetic * share}
    return replace(scene, friction=f.model_copy(update=new))


def pad_width(scene) -> float:
    """Width of the contact across the path [m]; strips share it."""
    return scene.contact.width if scene.contact is not None else scene.normal.width


def bonds_of(scene) -> Bonds:
    """Bond parameters of a bench scene; v_h defaults to 1e-3 of the peak speed."""
    f = acting(scene).friction
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return Bonds(f.static, f.bond_length, f.order, f.reading, ratio, f.rest_growth, f.slip_growth,
                 f.rest_speed or 1e-3 * peak_speed(scene), f.initial_bonds, f.breakaway)


def law_of(scene, speed: float) -> Bonds:
    """Bond law of [friction]; `speed` [m/s] sets the default floor v_h = 1e-3 of the peak speed."""
    f = acting(scene).friction
    ratio = f.kinetic / f.static if f.static > 0 else 1.0
    return Bonds(f.static, f.bond_length, f.order, f.reading, ratio, f.rest_growth, f.slip_growth,
                 f.rest_speed or max(1e-3 * speed, 1e-12), f.initial_bonds, f.breakaway)
