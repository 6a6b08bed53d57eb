"""Rigid sliding with NumPy laws, sample by sample, for varying pressure or two directions.

In: a `Slide`. Out: `SlideHistories`. This reference implementation of the compiled
engines takes every law and every bench with a rigid slide.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...friction.protocol import Step
from .law import find_rest_ends, make_numpy_law, nodal_pressure
from .ledger import (
    N_BLOCK_SAMPLES,
    Slide,
    SlideHistories,
    elastic_slip,
    local_slip,
    make_ledger,
    split_losses,
)

# Largest number of strip-point products of a direct quadrature; a larger bench is refused.
MAX_STRIP_POINT_PRODUCTS = 2e11


def slide_step_by_step(task: Slide) -> SlideHistories:
    """Compute the histories of rigid sliding sample by sample with a NumPy law.

    The pressure moves with the upper piece, belongs to the lower piece, or changes with the load
    over time.

    Raises
    ------
    Missing
        If the sum over bonds would take too long.
    """
    model = task.model
    law = make_numpy_law(model, task.patch)
    points = _pressed_points(task)
    refuse_expensive_sum(model, law, task.slide.size, points.weight.size, task.slide)
    take_step = _step_under_changing_load if model.load_varies else _step_law
    histories = _evaluate_law(
        task, law, take_step, task.slide[:, None], points, find_rest_ends(model, task.slide)
    )
    frames = task.frame_numbers
    force = histories.force[:, 0]
    tau = histories.tau[:, 0]
    sigma = np.array([points.pressure(sample) for sample in frames]).reshape(tau.shape)
    return SlideHistories(
        force,
        histories.load,
        elastic_slip(model, task.slide, force, histories.load),
        histories.ledger,
        frames,
        tau,
        local_slip(model, task.slide[frames], tau, sigma),
    )


def slide_in_plane(task: Slide) -> tuple[SlideHistories, dict]:
    """Compute the histories of rigid sliding in two directions, from a displacement file.

    The directions are those of the displacement and of `lateral` in slide.file. The pressure of a
    rigid upper piece is constant at every point, and the law is linear in it, so that the traction
    of every point is that of a point under unit pressure times its pressure. yaw_moment [N m] is
    the sum of y f_x - x f_y, the moment about +z of the friction on the upper piece, with f
    positive against its slip; strips have their positions y over the width.

    Returns
    -------
    tuple
        SlideHistories along x, and histories of the lateral direction by name.
    """
    model = task.model
    patch = task.patch
    slide = task.slide
    law = make_numpy_law(model)
    refuse_expensive_sum(model, law, slide.size, 1, slide)
    lateral = np.interp(task.time, model.slide.corners[0], model.slide.across)
    unit_point = _PressedPoints(np.ones(1), lambda sample: np.ones(1))
    unit = _evaluate_law(task, law, _step_law, np.stack([slide, lateral], axis=1), unit_point, {})
    sums = _pressure_sums(model, patch)
    sigma = np.array([sums.load]) if patch is None else patch.pressure.sigma_n
    compliance = law.law.length / law.law.static if law.law.static > 0 else 0.0
    slip = slide - compliance * unit.force[:, 0]
    frames = task.frame_numbers
    histories = SlideHistories(
        sums.load * unit.force[:, 0],
        np.full(slide.size, sums.load),
        slip,
        sums.load * unit.ledger,
        frames,
        np.outer(unit.force[frames, 0], sigma),
        np.where(sigma > 0, slip[frames, None], slide[frames, None]),
    )
    lateral_histories = {"lateral": lateral, "lateral_force": sums.load * unit.force[:, 1]}
    if patch is not None:
        lateral_histories["yaw_moment"] = (
            sums.roll * unit.force[:, 0] - sums.moment * unit.force[:, 1]
        )
    return histories, lateral_histories


class _PressedPoints(NamedTuple):
    """Areas of the interface points and their pressure along the bench path.

    - weight (m,): areas [m2].
    - pressure: function from the index of a sample to the pressure (m,) [Pa].
    """

    weight: np.ndarray
    pressure: Callable


class _LawHistories(NamedTuple):
    """Force, load, energy and traction histories of a friction law in d directions of slip.

    - force (k, d), load (k,): [N].
    - ledger (4, k): energies of `make_ledger` [J].
    - tau (f, d, m): tractions in the frames [Pa].
    """

    force: np.ndarray
    load: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray


def _evaluate_law(
    task: Slide, law, take_step: Callable, path, points: _PressedPoints, breakaways: dict
) -> _LawHistories:
    """Evaluate a friction law along a displacement path, sample by sample.

    Parameters
    ----------
    task : Slide
    law
    take_step : callable
        Function that takes one step of the law.
    path : (k, d)
        Slide in d directions [m].
    points : _Points
    breakaways : dict
        Sign of the motion that starts, by the sample at the end of a rest.
    """
    weight = points.weight
    size, n_directions = path.shape
    frames = set(task.frame_numbers.tolist())
    sigma = points.pressure(0)
    state = law.start(sigma) if n_directions == 1 else law.start(sigma, n_directions)
    force = np.zeros((size, n_directions))
    load = np.zeros(size)
    work = np.zeros(size)
    stored = np.zeros(size)
    losses = np.zeros((size, 2))
    tau = []
    for sample in range(size):
        if sample:
            increment = path[sample] - path[sample - 1]
            before = sigma
            sigma = points.pressure(sample)
            mean, dissipated, state = take_step(
                law,
                state,
                increment if n_directions > 1 else increment[0],
                before,
                sigma,
                task.time[sample] - task.time[sample - 1],
            )
            losses[sample] = split_losses(weight * dissipated)
            work[sample] = work[sample - 1] + increment @ np.atleast_2d(mean) @ weight
        if sample in breakaways:
            traction = law.breakaway_traction(sigma, breakaways[sample])
        else:
            traction = law.traction(state)
        traction = np.atleast_2d(traction)
        force[sample] = traction @ weight
        load[sample] = weight @ sigma
        stored[sample] = weight @ law.stored_energy(state)
        if sample in frames:
            tau.append(traction)
        if sample % N_BLOCK_SAMPLES == 0 or sample == size - 1:
            task.options.report(sample / (size - 1))
    return _LawHistories(
        force,
        load,
        make_ledger(work, stored, losses),
        np.array(tau).reshape(len(tau), n_directions, weight.size),
    )


def refuse_expensive_sum(model, law, samples: int, points: int, slide) -> None:
    """Raise Missing if a direct sum over bonds exceeds the limit of operations.

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


def _pressed_points(task: Slide) -> _PressedPoints:
    """Return the interface points with their pressure along the bench path."""
    model = task.model
    if model.load_varies:
        loads = model.point.evaluate(task.time)
        return _PressedPoints(np.ones(1), lambda sample: loads[sample : sample + 1])
    sigma, weight = nodal_pressure(model, task.patch)
    if task.patch is None or model.side != "lower":
        return _PressedPoints(weight, lambda sample: sigma)
    x = task.patch.x

    def shifted_pressure(sample: int) -> np.ndarray:
        """Return the pressure of the displaced lower piece at the points of the upper piece."""
        return np.interp(x + task.slide[sample], x, sigma, left=0.0, right=0.0)

    return _PressedPoints(weight, shifted_pressure)


def _step_law(law, state, increment: float, before, after, duration: float) -> Step:
    """Compute one step of a friction law at constant or given pressure."""
    return law.step(state, increment, before, after, duration)


def _step_under_changing_load(law, state, increment: float, before, after, duration: float) -> Step:
    """Compute one step of a friction law while the load changes from `before` to `after`.

    Half of the change is applied before the motion and half after it, which is of order 1 if bonds
    are released, else of order 2. A law without stretch takes the change during the motion.
    """
    if increment != 0 and getattr(law, "can_change_load", False):
        return law.step(state, increment, before, after, duration)
    half = (before + after) / 2
    first = law.press(state, before, half)
    step = law.step(first.state, increment, half, half, duration)
    last = law.press(step.state, half, after)
    return Step(step.mean, first.dissipated + step.dissipated + last.dissipated, last.state)


class _PressureSums(NamedTuple):
    """Load [N] of the pressure, and its first moments in x (moment) and y (roll) [N m]."""

    load: float
    moment: float = 0.0
    roll: float = 0.0


def _pressure_sums(model, patch) -> _PressureSums:
    """Return the load [N] and the first moments [N m] of a pressure; 0 about x without strips."""
    if patch is None:
        return _PressureSums(model.point.load)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    roll = 0.0 if patch.strips is None else patch.strips.roll_moment
    return _PressureSums(float(force.sum()), float(force @ patch.x), roll)
