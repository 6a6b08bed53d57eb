"""A patch in strips over its width: one holder presses them all, and may roll."""

import numpy as np

from ...contact.skin_laws import LinearSkin
from ...contact.strips import one_strip, press_strips, strip_offsets, strips_tangent
from ...contact.strips_solve import smooth
from ...core import Compliance, Pressure, frozen_array
from ...slip import shear_modes
from .skin import borne, skin_law


def in_strips(asked, pieces: Compliance, gap, angle: float, moment, spring: float) -> tuple:
    """Press a pair in strips: (Compliance of all strips, Pressure of their means over the width, skin or None,
    StripsState).

    The Compliance is what the pieces would have in full contact over the width; stiffnesses are those of the strips.
    """
    (count, roll), interface = asked.strips, pieces.interface
    skin = skin_of(asked)
    by = asked.approach
    one, _, weight = one_strip(pieces, count)
    state = press_strips(one, interface.x, weight, strip_offsets(asked.width, count), gap, roll,
                         asked.load if by is None else None, moment if by is None else None, by, angle,
                         spring if by is None else 0.0, skin)
    mean = (borne(state.pressure) if smooth(skin) else state.pressure).mean(axis=0)
    answer = Pressure(frozen_array(mean), frozen_array(state.gap.min(axis=0)), state.delta, state.theta, state.load,
                      state.moment, state.outcome, state.iterations, state.residuals)
    return pieces, answer, skin if smooth(skin) else None, state


def skin_of(asked):
    """The skin between the strips, None where they are bare."""
    if asked.skin is None:
        return None
    if asked.skin.law == "linear":
        return LinearSkin(asked.skin.normal_stiffness)

    return skin_law(asked)


def rotational_stiffness(state, c, x, weight) -> float:
    """Rotational stiffness -dM/d(rotation) [N m/rad] of all strips at fixed approach and contact set.

    c: (m, m) [m/N] and weight: (m,) [m2] of one strip.
    """
    out = 0.0
    for strip, force in enumerate(state.force):
        stiff = None if state.stiffness is None else state.stiffness[strip] * weight
        active = force > 0 if stiff is None else stiff > 1e-12 * (state.stiffness.max() * weight.max())
        if active.any():
            skin = 0.0 if stiff is None else np.diag(1 / np.where(active, stiff, 1.0))
            out += shear_modes.rotational_stiffness(c + skin, x, active)
    return out


def strip_values(patch, peak_of) -> dict:
    """Values of the measures that strips change, by name.

    These are the peak of any strip, the share of the area, the stiffnesses, and the lateral place of the pressure with
    its roll moment. peak_of: largest pressure of one strip from (x, pressure).
    """
    state, pieces = patch.strips, patch.pair.compliance
    count = len(state.offsets)
    weight = pieces.interface.weight / count
    pressed = borne(state.pressure) if smooth(patch.skin) else state.pressure
    fraction = float((pressed > 0).mean(axis=0) @ weight / weight.sum())
    out = {"contact_fraction": fraction, "pressure_centre_lateral": state.centre_y,
           "roll_moment": state.roll_moment}
    out["pressure_peak"] = max(peak_of(patch.x, row) for row in state.pressure)
    if not state.load > 0:
        return out | {"loaded_fraction": 0.0, "normal_stiffness": 0.0, "tangential_stiffness": 0.0,
                      "rotational_stiffness": 0.0}
    out["loaded_fraction"] = state.load / (count * weight.sum() * out["pressure_peak"])
    ratio = patch.tangential_ratio if patch.tangential_ratio is not None else np.inf
    out["normal_stiffness"] = strips_tangent(pieces.normal * count, weight, state)
    out["rotational_stiffness"] = rotational_stiffness(state, pieces.normal * count, patch.x, weight)
    out["tangential_stiffness"] = strips_tangent(pieces.tangential * count, weight, state, ratio)
    return out
