"""Rigid slide with the NumPy laws, sample by sample, for varying pressure or two directions.

In: a model, its patch and a path. Out: `SlideHistories`. This reference implementation of the compiled
engines takes every law and every bench with a rigid slide.
"""

from typing import NamedTuple

import numpy as np

from ...core import Missing
from .law import ends_of_rest, law_for, nodal_pressure
from .ledger import (
    BLOCK,
    PassOptions,
    SlideHistories,
    elastic_slip,
    frame_numbers,
    gains_and_losses,
    local_slip,
    make_ledger,
)

MAX_STRIP_POINT_PRODUCTS = (
    2e11  # most strip-point products of a direct quadrature; a bench with more is refused
)


def slide_step_by_step(
    model, patch, time, slide, frames: int, watch: PassOptions
) -> SlideHistories:
    """Slide every point along samples of time and slide.

    The pressure moves with the upper piece, belongs to the lower one, or the load changes with
    time.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    time, slide : (k,)
        [s], [m].
    frames : int
        Number of frames of the tractions.
    watch : PassOptions

    Returns
    -------
    SlideHistories

    Raises
    ------
    Missing
        If the sum over bonds would take too long.
    """
    law, (weight, pressure) = law_for(model, patch), _pressures(model, patch, time, slide)
    refuse_long_sum(model, law, time.size, weight.size, slide)
    peaks = ends_of_rest(model, slide)
    at = frame_numbers(time.size, frames)
    found = _evaluate_law(
        (law, _step_under_changing_load if model.load_varies else _step_law),
        (time, slide[:, None]),
        (weight, pressure),
        at,
        peaks,
        watch,
    )
    force = found.force[:, 0]
    tau = found.tau[:, 0]
    return SlideHistories(
        force,
        found.load,
        elastic_slip(model, slide, force, found.load),
        found.ledger,
        at,
        tau,
        local_slip(model, slide[at], tau, np.array([pressure(k) for k in at]).reshape(tau.shape)),
    )


def run_plane(model, patch, time, slide, frames: int, watch: PassOptions) -> tuple:
    """Slide an interface in two directions, along the displacement and `lateral` of slide.file.

    The pressure of a rigid upper piece is constant at every point, and the law is linear in it, so
    that the traction of every point is that of a point under unit pressure times its pressure.
    yaw_moment [N m] is the sum of y f_x - x f_y, the moment about +z of the friction on the upper
    piece, with f positive against its slip; strips have their positions y over the width.

    Parameters
    ----------
    model : Model
    patch : Patch or None
    time, slide : (k,)
        [s], [m].
    frames : int
        Number of frames of the tractions.
    watch : PassOptions

    Returns
    -------
    tuple
        SlideHistories along x, and histories of the lateral direction by name; `pairs` are (slide, force) in
        this direction.
    """
    law = law_for(model)
    refuse_long_sum(model, law, time.size, 1, slide)
    across = np.interp(time, model.slide.corners[0], model.slide.across)
    one = np.ones(1)
    at = frame_numbers(time.size, frames)
    found = _evaluate_law(
        (law, _step_law),
        (time, np.stack([slide, across], axis=1)),
        (one, lambda k: one),
        at,
        {},
        watch,
    )
    load, moment, roll = _moments(model, patch)
    sigma = patch.pressure.sigma_n if patch is not None else np.array([load])
    unit = found.force
    give = law.law.length / law.law.static if law.law.static > 0 else 0.0
    slip = slide - give * unit[:, 0]
    local = np.where(sigma > 0, slip[at, None], slide[at, None])
    more = {
        "lateral": across,
        "lateral_force": load * unit[:, 1],
        "pairs": [(across, load * unit[:, 1])],
    }
    if patch is not None:
        more["yaw_moment"] = roll * unit[:, 0] - moment * unit[:, 1]
    return SlideHistories(
        load * unit[:, 0],
        np.full(time.size, load),
        slip,
        load * found.ledger,
        at,
        np.outer(unit[at, 0], sigma),
        local,
    ), more


class _LawHistories(NamedTuple):
    """Histories of k samples in d directions.

    - force (k, d), load (k,): [N].
    - ledger (4, k): energies of `make_ledger` [J].
    - tau (f, d, m): tractions in the frames [Pa].
    """

    force: np.ndarray
    load: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray


def _evaluate_law(
    laws: tuple, path: tuple, points: tuple, at, peaks: dict, watch: PassOptions
) -> _LawHistories:
    """Evaluate a law along a path, sample by sample.

    Parameters
    ----------
    laws : tuple
        Law, and function that takes one step of it.
    path : tuple
        time (k,) [s] and slide (k, d) [m].
    points : tuple
        Weights (m,) [m2], and function from the index of a sample to the pressure (m,) [Pa].
    at : (f,)
        Samples of the frames.
    peaks : dict
        Sign of the motion that starts, by the sample at the end of a rest.
    watch : PassOptions
    """
    (law, move), (time, slide), (weight, pressure) = laws, path, points
    size, width = slide.shape
    s0 = pressure(0)
    pick = set(at.tolist())
    state = law.start(s0) if width == 1 else law.start(s0, width)
    force = np.zeros((size, width))
    load = np.zeros(size)
    work = np.zeros(size)
    stored = np.zeros(size)
    losses = np.zeros((size, 2))
    tau = []
    for k in range(size):
        if k:
            dq = slide[k] - slide[k - 1]
            s1 = pressure(k)
            mean, lost, state = move(
                law, state, dq if width > 1 else dq[0], s0, s1, time[k] - time[k - 1]
            )
            s0 = s1
            losses[k] = gains_and_losses(weight * lost)
            work[k] = work[k - 1] + dq @ np.atleast_2d(mean) @ weight
        here = np.atleast_2d(
            law.breakaway_traction(s0, peaks[k]) if k in peaks else law.traction(state)
        )
        force[k], load[k], stored[k] = here @ weight, weight @ s0, weight @ law.stored_energy(state)
        if k in pick:
            tau.append(here)
        if k % BLOCK == 0 or k == size - 1:
            watch.tell(k / (size - 1))
    return _LawHistories(
        force,
        load,
        make_ledger(work, stored, losses),
        np.array(tau).reshape(len(tau), width, weight.size),
    )


def refuse_long_sum(model, law, samples: int, points: int, slide) -> None:
    """Raise Missing if the NumPy sum over bonds needs more than MAX_STRIP_POINT_PRODUCTS strip-point products.

    Bonds older than 25 bond lengths count as cut off.

    Parameters
    ----------
    model : Model
    law
    samples, points : int
        Numbers of samples and points.
    slide : (k,)
        [m].
    """
    if not hasattr(law, "weights"):
        return
    reach = 25 * model.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(samples, 2 * reach / per_step + 64)
    if 6 * strips * samples * points > MAX_STRIP_POINT_PRODUCTS:
        raise Missing(
            f"the direct sum over bonds would need {6 * strips * samples * points:.1e} multiplications, more "
            f"than the limit of {MAX_STRIP_POINT_PRODUCTS:.0e}; lower accuracy.steps_per_cycle or slide.cycles",
            "",
        )


def _pressures(model, patch, time, slide) -> tuple:
    """Return weights (m,) [m2], and a function from a sample index to the pressure (m,) [Pa]."""
    if model.load_varies:
        loads = model.point.evaluate(time)
        return np.ones(1), lambda k: loads[k : k + 1]
    sigma, weight = nodal_pressure(model, patch)
    if patch is None or model.side != "lower":
        return weight, lambda k: sigma
    return weight, lambda k: np.interp(patch.x + slide[k], patch.x, sigma, left=0.0, right=0.0)


def _step_law(law, state, dq: float, s0, s1, dt: float) -> tuple:
    """Take one step of a law at constant or given pressure."""
    return law.step(state, dq, s0, s1, dt)


def _step_under_changing_load(law, state, dq: float, s0, s1, dt: float) -> tuple:
    """Take one step of a law while the load changes from s0 to s1.

    Half of the change is applied before the motion, half after it (order 1 if bonds are released,
    else 2). A law without stretch takes the change during the motion.
    """
    if dq != 0 and getattr(law, "can_change_load", False):
        return law.step(state, dq, s0, s1, dt)
    half = (s0 + s1) / 2
    before = law.press(state, s0, half)
    step = law.step(before.state, dq, half, half, dt)
    after = law.press(step.state, half, s1)
    return step.mean, before.dissipated + step.dissipated + after.dissipated, after.state


def _moments(model, patch) -> tuple:
    """Return load [N], sum f x and sum f y [N m] of the pressure; y from the strips, else 0."""
    if patch is None:
        return model.point.load, 0.0, 0.0
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    roll = patch.strips.roll_moment if patch.strips is not None else 0.0
    return float(force.sum()), float(force @ patch.x), roll
