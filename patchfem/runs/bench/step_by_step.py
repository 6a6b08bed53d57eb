"""Rigid sliding with NumPy laws, sample by sample, for varying pressure or two directions.

In: a `SlideTask`. Out: `SlideHistories`. This implementation accepts every law and every bench run with
rigid sliding; it is the reference for the compiled engines.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ...core import Missing
from ...friction.protocol import Step
from .law import find_rest_ends, make_numpy_law, nodal_pressure
from .ledger import (
    N_BLOCK_SAMPLES,
    SlideHistories,
    SlideTask,
    compute_interface_slip,
    compute_local_slip,
    stack_energies,
    sum_losses_by_sign,
)

# Largest number of operations (strips x samples x points) of a direct sum over bonds.
MAX_STRIP_POINT_PRODUCTS = 2e11


def slide_step_by_step(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of rigid sliding with a NumPy law, sample by sample.

    The pressure moves with the upper piece, is fixed to the lower piece, or varies with the load.

    Raises
    ------
    Missing
        If the sum over bonds would take too long.
    """
    model = task.model
    slide = task.slide
    law = make_numpy_law(model, task.patch)
    points = _make_pressed_points(task)
    refuse_expensive_sum(model, law, slide.size, points.weight.size, slide)
    take_step = _step_under_changing_load if model.load_varies else _step_law
    histories = _evaluate_law(
        task, law, take_step, slide[:, None], points, find_rest_ends(model, slide)
    )
    frames = task.frame_indices
    force = histories.force[:, 0]
    tau = histories.tau[:, 0]
    sigma = np.array([points.pressure(sample) for sample in frames]).reshape(tau.shape)
    return SlideHistories(
        force,
        histories.load,
        compute_interface_slip(model, slide, force, histories.load),
        histories.ledger,
        frames,
        tau,
        compute_local_slip(model, slide[frames], tau, sigma),
    )


def slide_in_plane(task: SlideTask) -> tuple[SlideHistories, dict]:
    """Compute the friction histories of rigid sliding in two directions.

    The file of `slide.file` gives the displacements along x and in the lateral direction. The law
    is linear in the pressure, which is constant at every point of the upper piece. Therefore, the
    law is evaluated once at unit pressure, and the traction of each point is the result times its
    pressure. The yaw moment [N m] is the sum of y f_x - x f_y over the points, where f is the
    resistance to slip of the upper piece. Strips have lateral positions y.

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
    sums = _sum_pressure(model, patch)
    sigma = np.array([sums.load]) if patch is None else patch.pressure.sigma_n
    compliance = law.law.length / law.law.static if law.law.static > 0 else 0.0
    slip = slide - compliance * unit.force[:, 0]
    frames = task.frame_indices
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
    """Areas of the interface points, and their pressure at each sample.

    - weight (m,): areas [m2].
    - pressure: function of the sample index that returns the pressures (m,) [Pa].
    """

    weight: np.ndarray
    pressure: Callable


class _LawHistories(NamedTuple):
    """Histories of a friction law for slip in d directions, at k samples.

    - force (k, d), load (k,): friction force and normal load [N].
    - ledger (4, k): energies [J], see `stack_energies`.
    - tau (f, d, m): tractions in each frame [Pa].
    """

    force: np.ndarray
    load: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray


def _evaluate_law(
    task: SlideTask, law, take_step: Callable, path, points: _PressedPoints, breakaways: dict
) -> _LawHistories:
    """Evaluate a friction law along a displacement path, sample by sample.

    Parameters
    ----------
    task : SlideTask
    law
    take_step : callable
        Function that computes one step of the law.
    path : (k, d)
        Relative displacement in d directions [m].
    points : _PressedPoints
    breakaways : dict
        Sign of the velocity after each rest, by the sample at which the rest ends.
    """
    weight = points.weight
    size, n_directions = path.shape
    frames = set(task.frame_indices.tolist())
    sigma = points.pressure(0)
    if n_directions == 1:
        state = law.initial_state(sigma)
    else:
        state = law.initial_state(sigma, n_directions)
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
            losses[sample] = sum_losses_by_sign(weight * dissipated)
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
        stack_energies(work, stored, losses),
        np.array(tau).reshape(len(tau), n_directions, weight.size),
    )


def refuse_expensive_sum(model, law, n_samples: int, n_points: int, slide) -> None:
    """Raise Missing if a direct sum over bonds needs too many operations.

    Bonds are assumed to be neglected after a path of 25 bond lengths.

    Parameters
    ----------
    model : Model
    law
        Friction law; a law that does not sum over bonds is never refused.
    n_samples, n_points : int
        Number of samples and of points.
    slide : (k,)
        Relative displacement of the samples [m].
    """
    if not hasattr(law, "weights"):
        return
    reach = 25 * model.friction.bond_length
    per_step = max(float(np.abs(np.diff(slide)).mean()), 1e-300)
    strips = min(n_samples, 2 * reach / per_step + 64)
    if 6 * strips * n_samples * n_points > MAX_STRIP_POINT_PRODUCTS:
        raise Missing(
            f"the direct sum over bonds would need {6 * strips * n_samples * n_points:.1e} multiplications, more "
            f"than the limit of {MAX_STRIP_POINT_PRODUCTS:.0e}; lower accuracy.steps_per_cycle or slide.cycles",
            "",
        )


def _make_pressed_points(task: SlideTask) -> _PressedPoints:
    """Return the interface points with their pressure at each sample."""
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
    """Compute one step of a friction law under the pressure at its end."""
    return law.step(state, increment, before, after, duration)


def _step_under_changing_load(law, state, increment: float, before, after, duration: float) -> Step:
    """Compute one step of a friction law while the pressure changes from `before` to `after`.

    Half of the change is applied before the motion and half after it (Strang splitting). The method
    is of second order, and of first order if bonds are released. A law that can change its load
    during the motion takes the whole change itself.
    """
    if increment != 0 and getattr(law, "can_change_load", False):
        return law.step(state, increment, before, after, duration)
    half = (before + after) / 2
    first = law.press(state, before, half)
    step = law.step(first.state, increment, half, half, duration)
    last = law.press(step.state, half, after)
    return Step(step.mean, first.dissipated + step.dissipated + last.dissipated, last.state)


class _PressureSums(NamedTuple):
    """Resultant of the pressure [N] and its first moments in x (moment) and y (roll) [N m]."""

    load: float
    moment: float = 0.0
    roll: float = 0.0


def _sum_pressure(model, patch) -> _PressureSums:
    """Return the resultant [N] and the first moments [N m] of the pressure.

    The moment in y is 0 without strips.
    """
    if patch is None:
        return _PressureSums(model.point.load)
    force = patch.pressure.sigma_n * patch.pieces.interface.weight
    roll = 0.0 if patch.strips is None else patch.strips.roll_moment
    return _PressureSums(float(force.sum()), float(force @ patch.x), roll)
