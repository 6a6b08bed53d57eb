"""Runs of one rig at several numerical settings, with the fraction that is completed.

In: the inputs of a run. Out: the Solution at given settings, and errors from coarser runs, each of
which is solved once.
"""

from dataclasses import replace
from time import process_time

import numpy as np

from ...core import NotConverged
from ...response.coarser import StepRun, estimate_errors
from ...response.rows import ROWS_NEEDING_RUN
from ..patch import faces
from ..results.result import N_FRAMES, RunInputs
from . import motion_warnings
from .engines import ENGINES
from .numerics import Numerics
from .solution import Solution
from .solve import solve
from .steady import curves

# largest relative difference between the peak amplitudes of a run and its coarser run; above it, the
# coarser run may have found another peak
OTHER_PEAK_RATIO = 0.1


class Runner:
    """Solver of a rig at several numerical settings, which stores all coarser solutions.

    Parameters
    ----------
    inputs : RunInputs
    numerics : Numerics
        Settings of the first run.

    Attributes
    ----------
    solutions : dict
        Solution of each coarser run by its Numerics.
    error_seconds : float
        CPU seconds of the coarser runs.
    cpu_seconds : dict
        CPU seconds of each run by its Numerics.
    """

    def __init__(self, inputs: RunInputs, numerics: Numerics):
        self.inputs = inputs
        self.model = inputs.plan.model
        self.solutions: dict = {}
        self.error_seconds = 0.0
        self.cpu_seconds: dict = {}
        self.progress = RunProgress(inputs.progress, _expected_steps(inputs, numerics))

    def solve(self, numerics: Numerics, coarser_model=None) -> Solution:
        """Solve the rig with given settings.

        Parameters
        ----------
        numerics : Numerics
        coarser_model : Model, optional
            Model of a coarser run, which needs no fields; None: the run itself.
        """
        model = coarser_model or self.model
        frames = 0
        say = None
        if coarser_model is None:
            say = self.inputs.say
            has_fields = self.inputs.patch is not None and not model.patch.mesh.can_gather_points
            if has_fields or model.rig.friction.has_partial_slip:
                frames = N_FRAMES
        patch = self.inputs.coarse[0] if numerics.coarse_patch else self.inputs.patch
        report = self.progress.make_callback(numerics.steps)
        begin = process_time()
        solution = solve(model, numerics, patch, frames, say, report)
        self.cpu_seconds[replace(numerics, whole=False)] = process_time() - begin
        self.progress.done += numerics.steps
        return solution

    def estimate(self, coarser_runs: list, solution: Solution) -> list:
        """Estimate the errors of a run (see `coarser.estimate_errors`)."""
        errors, seconds = estimate_errors(
            lambda numerics: self._solve_coarser(numerics, solution),
            solution.values,
            coarser_runs,
            self.solutions,
        )
        self.error_seconds += seconds
        return errors

    def list_step_runs(self, numerics: Numerics, solution: Solution, coarser_runs: list) -> list:
        """Return the StepRuns of a run and of its coarser runs in time, fine to coarse.

        The list has only the run itself if none is coarser in its steps.

        Parameters
        ----------
        numerics : Numerics
            Settings of the run.
        solution : Solution
        coarser_runs : list of CoarserRuns
            Those of the run, which are solved already; runs that are coarser in time come first.

        Returns
        -------
        list of StepRun
        """
        pairs = [(numerics, solution)]
        if coarser_runs and coarser_runs[0].of == "steps":
            pairs += [(run, self.solutions[run]) for run in coarser_runs[0].runs]
        step_runs = []
        for settings, run in pairs:
            seconds = self.cpu_seconds.get(replace(settings, whole=False), run.seconds)
            step_runs.append(StepRun(settings.steps, seconds, run.values))
        steps = [run.steps for run in step_runs]
        # a method with a step tolerance has the same number of steps in all runs
        return step_runs if steps == sorted(set(steps), reverse=True) else step_runs[:1]

    def _solve_coarser(self, numerics: Numerics, fine: Solution) -> Solution:
        """Solve the rig with coarser settings."""
        model = self.model
        if numerics.richer:
            model = replace(model, rig=model.rig.structure.richer_rig)
        # the decay curve and some measures need histories from the start of the run
        needs_whole = self.model.rig.drive.kind == "free" or bool(ROWS_NEEDING_RUN)
        numerics = replace(numerics, whole=needs_whole)
        return self._solve_around_peak(model, numerics, fine) or self.solve(numerics, model)

    def _solve_around_peak(self, model, numerics: Numerics, fine: Solution) -> Solution | None:
        """Solve a curve with coarser settings, only around its largest amplitude.

        The result is None if there is no curve, or if its largest amplitude is elsewhere.
        """
        rig = model.rig
        if "at_error" not in fine.extra or rig.drive.levels.amplitudes or rig.springs.is_nonlinear:
            return None
        drive = curves.sweep_around_peak(
            rig.drive.signal, fine.extra["curve"], fine.extra["at"].omega / (2 * np.pi)
        )
        if drive is None:
            return None
        try:
            solution = self.solve(numerics, replace(model, rig=rig.with_signal(drive)))
        except (
            NotConverged
        ):  # the complete curve may start at a frequency at which a motion is found
            return None
        name = "relative_displacement_amplitude"
        if "at" not in solution.extra or name not in solution.values:
            return None
        peak_frequency = solution.extra["at"].omega / (2 * np.pi)
        if motion_warnings.find_sweep_end(peak_frequency, drive.low, drive.high) is not None:
            return None
        change = abs(solution.values[name] / fine.values[name] - 1)
        return solution if change <= OTHER_PEAK_RATIO else None


class RunProgress:
    """Completed fraction of the work of a run and its coarser runs, weighted by their steps.

    Parameters
    ----------
    callback : callable or None
        Called with the completed fraction.
    expected_steps : float
        Expected steps per cycle of all runs together.

    Attributes
    ----------
    done : float
        Steps per cycle of the completed runs.
    """

    def __init__(self, callback, expected_steps: float):
        self.callback = callback
        self.expected_steps = expected_steps
        self.done = 0.0
        self.shown = 0.0

    def make_callback(self, steps: float):
        """Return the progress callback of one run with a given number of steps per cycle.

        It is None if the caller gave no callback. The reported fraction never decreases.
        """
        if self.callback is None:
            return None

        def report(fraction: float) -> None:
            """Convert the completed fraction of one run to that of all runs, and report it."""
            expected = max(self.expected_steps, self.done + steps)
            self.shown = max(self.shown, (self.done + fraction * steps) / expected)
            self.callback(self.shown)

        return report


def _expected_steps(inputs: RunInputs, numerics: Numerics) -> float:
    """Return the expected steps per cycle of a run plus those of its coarser runs.

    A run on a coarser mesh has the smallest number of steps.
    """
    if not inputs.estimate:
        return numerics.steps
    model = inputs.plan.model
    engine = ENGINES[numerics.engine]
    steps = {numerics: numerics.steps}
    for kind in [
        *engine.coarser_in_time(model, numerics),
        *engine.richer_in_modes(model, numerics),
    ]:
        steps |= {run: run.steps for run in kind.runs}
    n_meshes = int(inputs.coarse[0] is not None and bool(model.partial_slip))
    if model.rig.friction.has_partial_slip:
        n_meshes += len(faces.group_interfaces_with_coarse_mesh(model))
    return sum(steps.values()) + n_meshes * min(steps.values())
