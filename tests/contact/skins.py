"""Asperity layers between two bodies: smooth laws are solved as one strip, the linear law as softer bodies."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from pressed import press, press_to_approach

from patchfem.contact import (
    ExponentialAsperities,
    Holder,
    LinearAsperities,
    StripCompliance,
    StripLayout,
    StripModel,
)
from patchfem.contact import press_strips as press_by_holder
from patchfem.core import Compliance, Interface, Outcome


class LayerState(NamedTuple):
    """Pressed asperity layer: arrays (m,) and scalars as in `strips.StripsState`; `separation` is its gap."""

    force: np.ndarray
    pressure: np.ndarray
    separation: np.ndarray
    stiffness: np.ndarray
    delta: float
    theta: float
    load: float
    moment: float
    iterations: int
    outcome: Outcome
    residuals: dict


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


def press_layer(
    law, c, x, weight, gap, load=None, moment=None, approach=None, rotation=0.0, spring=0.0
):
    """Return the LayerState of two bodies pressed through an asperity layer of any law."""
    if not isinstance(law, LinearAsperities):
        state = press_strips(
            c,
            x,
            weight,
            np.zeros(1),
            gap,
            load=load,
            moment=moment,
            approach=approach,
            rotation=rotation,
            spring=spring,
            asperities=law,
        )
        return LayerState(
            state.force[0],
            state.pressure[0],
            state.gap[0],
            state.stiffness[0],
            state.position.delta,
            state.position.theta,
            state.load,
            state.moment,
            state.iterations,
            state.outcome,
            state.residuals,
        )
    soft = Compliance(Interface(x, weight, 1.0), c + np.diag(1 / (law.k * weight)), c)
    solution = (
        press(soft, gap, load, moment, rotation, spring=spring)
        if approach is None
        else press_to_approach(soft, gap, approach, rotation)
    )
    force = solution.sigma_n * weight
    free = gap + (solution.rotation - rotation) * x - solution.approach + c @ force
    return LayerState(
        force,
        solution.sigma_n,
        np.where(force > 0, -solution.sigma_n / law.k, free),
        np.where(force > 0, law.k, 0.0),
        solution.approach,
        solution.rotation,
        solution.load,
        solution.moment,
        solution.iterations,
        solution.outcome,
        solution.residuals,
    )


def stretch_law(law, factor: float):
    """Return the law P(s/factor), which belongs to fewer peaks with wider height distribution."""
    if isinstance(law, ExponentialAsperities):
        return replace(law, u0=law.u0 * factor)
    return replace(law, deviation=law.deviation * factor, density=law.density * factor**-1.5)
