"""A rigid slide with the NumPy laws, sample by sample: where the pressure of a point changes on the way, or in two
directions.

The twin of the compiled engines: it takes every law and every bench with a rigid slide.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing
from .law import ends_of_rest, law_for, pressure_of
from .ledger import (
    BLOCK,
    Slid,
    Watch,
    elastic_slip,
    frame_numbers,
    gains_and_losses,
    ledger_of,
    local_slip,
)

MOST_WORK = 2e11  # strip-point products of a direct quadrature beyond which a bench is refused


def stepped(model, patch, time, slide, frames: int, watch: Watch) -> Slid:
    """Slide every point along the samples time [s], slide [m] (k,); the pressure rides on the upper piece or stays on
    the lower one, or the load changes in time. Missing where the sum over bonds would take too long."""
    law, (weight, pressure) = law_for(model, patch), _pressures(model, patch, time, slide)
    refuse_long_sum(model, law, time.size, weight.size, slide)
    peaks, at = ends_of_rest(model, slide), frame_numbers(time.size, frames)
    found = _walked(
        (law, _under_load if model.load_varies else _along),
        (time, slide[:, None]),
        (weight, pressure),
        at,
        peaks,
        watch,
    )
    force, tau = found.force[:, 0], found.tau[:, 0]
    return Slid(
        force,
        found.load,
        elastic_slip(model, slide, force, found.load),
        found.ledger,
        at,
        tau,
        local_slip(model, slide[at], tau, np.array([pressure(k) for k in at]).reshape(tau.shape)),
    )


def run_plane(model, patch, time, slide, frames: int, watch: Watch) -> tuple:
    """(Slid along x, histories of the other direction by name; `pairs` are the (slide, force) of that direction) of a
    slide in two directions: the `lateral` column of slide.file beside its displacement.

    Pressure that rides on a rigid mover is constant at every point and the law is linear in it, so every point has the
    traction of one point under unit pressure times its own. yaw_moment [N m]: sum of y f_x - x f_y, about +z of the
    friction on the upper piece, f positive against its slip; strips have their places y over the width.
    """
    law = law_for(model)
    refuse_long_sum(model, law, time.size, 1, slide)
    across, one = np.interp(time, model.slide.corners[0], model.slide.across), np.ones(1)
    at = frame_numbers(time.size, frames)
    found = _walked(
        (law, _along),
        (time, np.stack([slide, across], axis=1)),
        (one, lambda k: one),
        at,
        {},
        watch,
    )
    load, moment, roll = _moments(model, patch)
    sigma = patch.pressure.sigma_n if patch is not None else np.array([load])
    unit, give = found.force, law.law.length / law.law.static if law.law.static > 0 else 0.0
    slip = slide - give * unit[:, 0]
    local = np.where(sigma > 0, slip[at, None], slide[at, None])
    more = {
        "lateral": across,
        "lateral_force": load * unit[:, 1],
        "pairs": [(across, load * unit[:, 1])],
    }
    if patch is not None:
        more["yaw_moment"] = roll * unit[:, 0] - moment * unit[:, 1]
    return Slid(
        load * unit[:, 0],
        np.full(time.size, load),
        slip,
        load * found.ledger,
        at,
        np.outer(unit[at, 0], sigma),
        local,
    ), more


class _Walked(NamedTuple):
    """Histories of k samples in d directions: force (k, d) and load (k,) [N], ledger of `ledger_of` [J], tau (f, d, m)
    [Pa] of the frames."""

    force: np.ndarray
    load: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray


def _walked(laws: tuple, path: tuple, points: tuple, at, peaks: dict, watch: Watch) -> _Walked:
    """Step a law along a path. laws: (the law, how it takes a step); path: (time (k,) [s], slide (k, d) [m]); points:
    (weights (m,) [m2], function from the number of a sample to the pressure (m,) [Pa] there); at: numbers of the
    frames; peaks: sample -> sign of the motion that a rest ends with."""
    (law, move), (time, slide), (weight, pressure) = laws, path, points
    size, width = slide.shape
    s0, pick = pressure(0), set(at.tolist())
    state = law.start(s0) if width == 1 else law.start(s0, width)
    force, load, work, stored = (
        np.zeros((size, width)),
        np.zeros(size),
        np.zeros(size),
        np.zeros(size),
    )
    losses, tau = np.zeros((size, 2)), []
    for k in range(size):
        if k:
            dq, s1 = slide[k] - slide[k - 1], pressure(k)
            mean, lost, state = move(
                law, state, dq if width > 1 else dq[0], s0, s1, time[k] - time[k - 1]
            )
            s0, losses[k] = s1, gains_and_losses(weight * lost)
            work[k] = work[k - 1] + dq @ np.atleast_2d(mean) @ weight
        here = np.atleast_2d(law.breaking(s0, peaks[k]) if k in peaks else law.traction(state))
        force[k], load[k], stored[k] = here @ weight, weight @ s0, weight @ law.stored(state)
        if k in pick:
            tau.append(here)
        if k % BLOCK == 0 or k == size - 1:
            watch.tell(k / (size - 1))
    return _Walked(
        force,
        load,
        ledger_of(work, stored, losses),
        np.array(tau).reshape(len(tau), width, weight.size),
    )


def refuse_long_sum(model, law, samples: int, points: int, slide) -> None:
    """Raise Missing where the NumPy sum over bonds would form more strip-point products than MOST_WORK.

    slide: (k,) [m]; bonds older than 25 lengths are taken as cut off.
    """
    if not hasattr(law, "weights"):
        return
    reach = 25 * model.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(samples, 2 * reach / per_step + 64)
    if 6 * strips * samples * points > MOST_WORK:
        raise Missing(
            f"the direct sum over bonds would need {6 * strips * samples * points:.1e} multiplications, more "
            f"than the limit of {MOST_WORK:.0e}; lower accuracy.steps_per_cycle or slide.cycles",
            "",
        )


def _pressures(model, patch, time, slide) -> tuple:
    """(weights (m,) [m2], function from the number of a sample to the pressure (m,) [Pa] there)."""
    if model.load_varies:
        loads = model.point.at(time)
        return np.ones(1), lambda k: loads[k : k + 1]
    sigma, weight = pressure_of(model, patch)
    if patch is None or model.side != "lower":
        return weight, lambda k: sigma
    return weight, lambda k: np.interp(patch.x + slide[k], patch.x, sigma, left=0.0, right=0.0)


def _along(law, state, dq: float, s0, s1, dt: float) -> tuple:
    return law.step(state, dq, s0, s1, dt)


def _under_load(law, state, dq: float, s0, s1, dt: float) -> tuple:
    """One step while the load goes from s0 to s1: half of its change before the motion, half after (order 1 where
    bonds are let go, else 2). A law without stretch takes the change along with the motion."""
    if dq != 0 and getattr(law, "at_once", False):
        return law.step(state, dq, s0, s1, dt)
    half = (s0 + s1) / 2
    before = law.press(state, s0, half)
    step = law.step(before.state, dq, half, half, dt)
    after = law.press(step.state, half, s1)
    return step.mean, before.dissipated + step.dissipated + after.dissipated, after.state


def _moments(model, patch) -> tuple:
    """(load [N], sum f x, sum f y [N m]) of the pressure; y from the strips, 0 without them."""
    if patch is None:
        return model.point.load, 0.0, 0.0
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    roll = patch.strips.roll_moment if patch.strips is not None else 0.0
    return float(force.sum()), float(force @ patch.x), roll
