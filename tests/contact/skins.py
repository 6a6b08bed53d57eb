"""Asperity layers between two bodies: smooth laws are solved as one strip, the linear law as softer bodies."""

from dataclasses import replace

from patchfem.contact import (
    ExponentialAsperities,
    Holder,
    StripCompliance,
    StripLayout,
    StripModel,
)
from patchfem.contact import press_strips as press_by_holder


def make_strips(c, x, weight, offsets, asperities=None):
    """Return strips with a compliance given as an array, or as a compliance with separate diagonals."""
    compliance = c if isinstance(c, StripCompliance) else StripCompliance(c)
    return StripModel(compliance, StripLayout(x, weight, offsets), asperities)


def press_strips(
    c, x, weight, offsets, gap, roll=0.0, load=None, moment=None, asperities=None, **control
):
    """Return the state of strips under a load and its moments, or by an approach."""
    strips = make_strips(c, x, weight, offsets, asperities)
    return press_by_holder(strips, gap, Holder(load, moment=moment, roll=roll, **control))


def stretch_law(law, factor: float):
    """Return the law P(s/factor), which belongs to fewer peaks with wider height distribution."""
    if isinstance(law, ExponentialAsperities):
        return replace(law, u0=law.u0 * factor)
    return replace(law, deviation=law.deviation * factor, density=law.density * factor**-1.5)
