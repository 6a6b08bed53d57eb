"""Rigid sliding of a law as an object, sample by sample, for varying pressure.

In: a `SlideTask`. Out: `SlideHistories`. The load varies in time, or the pressure is fixed to the lower piece.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

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


def slide_step_by_step(task: SlideTask) -> SlideHistories:
    """Compute the friction histories of rigid sliding with a law as an object, sample by sample.

    The pressure moves with the upper piece, is fixed to the lower piece, or varies with the load.
    """
    model = task.model
    slide = task.slide
    law = make_numpy_law(model, task.patch, task.engine.choice)
    points = _make_pressed_points(task)
    take_step = _step_under_changing_load if model.load_varies else _step_law
    histories = _evaluate_law(task, law, take_step, points, find_rest_ends(model, slide))
    frames = task.frame_indices
    sigma = np.array([points.pressure(sample) for sample in frames]).reshape(histories.tau.shape)
    return SlideHistories(
        histories.force,
        histories.load,
        compute_interface_slip(model, slide, histories.force, histories.load),
        histories.ledger,
        frames,
        histories.tau,
        compute_local_slip(model, slide[frames], histories.tau, sigma),
    )


class _PressedPoints(NamedTuple):
    """Areas of the interface points, and their pressure at each sample.

    - weight (m,): areas [m2].
    - pressure: function of the sample index that returns the pressures (m,) [Pa].
    """

    weight: np.ndarray
    pressure: Callable


class _LawHistories(NamedTuple):
    """Histories of a friction law at k samples.

    - force, load (k,): friction force and normal load [N].
    - ledger (4, k): energies [J], see `stack_energies`.
    - tau (f, m): tractions in each frame [Pa].
    """

    force: np.ndarray
    load: np.ndarray
    ledger: np.ndarray
    tau: np.ndarray


def _evaluate_law(
    task: SlideTask, law, take_step: Callable, points: _PressedPoints, rest_ends: dict
) -> _LawHistories:
    """Evaluate a friction law along the displacement of a task, sample by sample.

    Parameters
    ----------
    task : SlideTask
    law
    take_step : callable
        Function that computes one step of the law.
    points : _PressedPoints
    rest_ends : dict
        Sign of the velocity after each rest, by the sample at which the rest ends.
    """
    weight = points.weight
    slide = task.slide
    size = slide.size
    frames = set(task.frame_indices.tolist())
    sigma = points.pressure(0)
    state = law.initial_state(sigma)
    force, load, work, stored = np.zeros((4, size))
    losses = np.zeros((size, 2))
    tau = []
    for sample in range(size):
        if sample:
            increment = slide[sample] - slide[sample - 1]
            before = sigma
            sigma = points.pressure(sample)
            duration = task.time[sample] - task.time[sample - 1]
            mean, dissipated, state = take_step(law, state, increment, before, sigma, duration)
            losses[sample] = sum_losses_by_sign(weight * dissipated)
            work[sample] = work[sample - 1] + increment * (mean @ weight)

        # the traction at the end of a rest is that of the motion that begins there
        if sample in rest_ends:
            traction = law.static_traction(sigma, rest_ends[sample])
        else:
            traction = law.traction(state)
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
        np.array(tau).reshape(len(tau), weight.size),
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
