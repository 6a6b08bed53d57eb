"""The friction numbers that act: those of a scene at its surface temperature (2.13) and spread over its pad (2.15)."""

from dataclasses import replace

from .core import PatchfemError


def acting(scene):
    """The scene with the effects that only change numbers of [friction] worked in: rest_growth and slip_growth at
    friction.temperature, static and kinetic times the pad's share of friction.spread. The scene itself where it names
    neither. PatchfemError where a rate leaves the range of numbers."""
    f = scene.friction
    if f is None or (f.temperature is None and f.spread is None):
        return scene
    new = {"temperature": None, "spread": None}
    if f.temperature is not None and f.rest_growth is not None:
        from .friction.temperature import growth_at

        t = f.temperature
        try:
            new["rest_growth"], new["slip_growth"] = growth_at(f.rest_growth, f.slip_growth, t.surface, t.reference,
                                                               t.rest_activation, t.slip_activation)
        except PatchfemError as error:
            raise PatchfemError(f"{scene.where('friction.temperature')}: {error}") from None
    if f.spread is not None:
        from .friction.spread import pad_factor

        share = pad_factor(pad_width(scene), f.spread)
        new |= {"static": f.static * share, "kinetic": None if f.kinetic is None else f.kinetic * share}
    return replace(scene, friction=f.model_copy(update=new))


def pad_width(scene) -> float:
    """Width of the contact across the path [m]; strips share it."""
    return scene.contact.width if scene.contact is not None else scene.normal.width
