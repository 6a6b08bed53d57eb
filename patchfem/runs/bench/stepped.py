"""A rigid slide with the NumPy laws, sample by sample: where the pressure of a point changes on the way.

The twin of the compiled engines: it takes every law and every bench with a rigid slide.
"""

import numpy as np

from ...core import Missing
from .law import ends_of_rest, law_for, pressed
from .ledger import Slid, elastic_slip, frame_numbers, ledger_of, local_slip, split
from .watch import BLOCK, Watch

MOST_WORK = 2e11  # strip-point products of a direct quadrature beyond which a bench is refused


def stepped(model, patch, time, slide, frames: int, watch: Watch) -> Slid:
    """Slide every point along the samples time [s], slide [m] (k,); the pressure rides on the upper piece or stays on
    the lower one, or the load changes in time. Missing where the sum over bonds would take too long."""
    law, (weight, pressure) = law_for(model, patch), _pressures(model, patch, time, slide)
    refuse_costly(model, law, time.size, weight.size, slide)
    move = _under_load if model.load_varies else _along
    s0 = pressure(0)
    state, at = law.start(s0), frame_numbers(time.size, frames)
    force, load, work, stored = (np.zeros(time.size) for _ in range(4))
    losses, pick, tau, under = np.zeros((time.size, 2)), set(at.tolist()), [], []
    peaks = ends_of_rest(model, slide)
    for k in range(time.size):
        if k:
            dq, s1 = slide[k] - slide[k - 1], pressure(k)
            mean, lost, state = move(law, state, dq, s0, s1, time[k] - time[k - 1])
            s0, losses[k] = s1, split(weight * lost)
            work[k] = work[k - 1] + weight @ mean * dq
        here = law.breaking(s0, peaks[k]) if k in peaks else law.traction(state)
        force[k], load[k], stored[k] = weight @ here, weight @ s0, weight @ law.stored(state)
        if k in pick:
            tau.append(here)
            under.append(s0)
        if k % BLOCK == 0 or k == time.size - 1:
            watch.tell(k / (time.size - 1))
    return Slid(force, load, elastic_slip(model, slide, force, load), ledger_of(work, stored, losses), at,
                np.array(tau), local_slip(model, slide[at], np.array(tau), np.array(under)))


def refuse_costly(model, law, samples: int, points: int, slide) -> None:
    """Raise Missing where the NumPy sum over bonds would form more strip-point products than MOST_WORK.

    slide: (k,) [m]; bonds older than 25 lengths are taken as cut off.
    """
    if not hasattr(law, "weights"):
        return
    reach = 25 * model.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(samples, 2 * reach / per_step + 64)
    if 6 * strips * samples * points > MOST_WORK:
        raise Missing(f"the direct quadrature would form {6 * strips * samples * points:.1e} products, "
                      f"more than {MOST_WORK:.0e}; lower accuracy.steps_per_cycle or slide.cycles", "")


def _pressures(model, patch, time, slide) -> tuple:
    """(weights (m,) [m2], function from the number of a sample to the pressure (m,) [Pa] there)."""
    if model.load_varies:
        loads = model.point.at(time)
        return np.ones(1), lambda k: loads[k:k + 1]
    sigma, weight = pressed(model, patch)
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

