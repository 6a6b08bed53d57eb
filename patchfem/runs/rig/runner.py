"""Runs of a rig with several numerical settings, and their progress.

In: the inputs of a run. Out: the Solution for given settings, and error estimates from coarse runs.
Each coarse run is solved only once.
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
from .solve import solve_rig
from .steady import curves

# Largest relative difference between the peaks of a run and its coarse run at which they count as
# the same peak.
OTHER_PEAK_RATIO = 0.1


class Runner:
    """Solver of a rig with several numerical settings, which stores the solutions of coarse runs.

    Parameters
    ----------
    inputs : RunInputs
    numerics : Numerics
        Settings of the first run.

    Attributes
    ----------
    solutions : dict
        Solution of each coarse run by its Numerics.
    error_seconds : float
        CPU time of the coarse runs [s].
    cpu_seconds : dict
        CPU time of each run [s] by its Numerics.
    """

    def __init__(self, inputs: RunInputs, numerics: Numerics):
        self.inputs = inputs
        self.model = inputs.plan.model
        self.solutions: dict = {}
        self.error_seconds = 0.0
        self.cpu_seconds: dict = {}
        self.progress = RunProgress(inputs.progress, _estimate_total_steps(inputs, numerics))

    def solve(self, numerics: Numerics, coarser_model=None) -> Solution:
        """Solve the rig with the given settings.

        Parameters
        ----------
        numerics : Numerics
        coarser_model : Model, optional
            Model of a coarse run, which needs no fields; default: the model of the run itself.
        """
        model = coarser_model or self.model
        frames = 0
        say = None
        if coarser_model is None:
            say = self.inputs.say
            has_fields = self.inputs.patch is not None and not model.patch.mesh.can_gather_points
            if has_fields or model.rig.friction.has_partial_slip:
                frames = N_FRAMES
        patch = self.inputs.patch
        if numerics.coarse_patch:
            patch = self.inputs.coarse[0]
        if numerics.stiffer_joint:
            stiffer_model, (patch, *_) = self.inputs.stiffer[:2]
            model = replace(stiffer_model, rig=replace(stiffer_model.rig, drive=model.rig.drive))
        report = self.progress.make_callback(numerics.steps)
        begin = process_time()
        solution = solve_rig(model, numerics, patch, frames, say, report)
        self.cpu_seconds[replace(numerics, whole=False)] = process_time() - begin
        self.progress.done += numerics.steps
        return solution

    def estimate_errors(self, coarser_runs: list, solution: Solution) -> list:
        """Estimate the errors of a run from coarse runs (`response.coarser.estimate_errors`)."""
        errors, seconds = estimate_errors(
            lambda numerics: self._solve_coarse_run(numerics, solution),
            solution.values,
            coarser_runs,
            self.solutions,
        )
        self.error_seconds += seconds
        return errors

    def list_step_runs(self, numerics: Numerics, solution: Solution, coarser_runs: list) -> list:
        """Return a StepRun of the run and of each run with fewer steps, from fine to coarse.

        If no coarse run has fewer steps, the list contains only the run itself.

        Parameters
        ----------
        numerics : Numerics
            Settings of the run.
        solution : Solution
        coarser_runs : list of CoarserRuns
            Coarse runs, which are already solved; those with fewer steps come first.

        Returns
        -------
        list of StepRun
        """
        pairs = [(numerics, solution)]
        if coarser_runs and coarser_runs[0].source == "steps":
            pairs += [(run, self.solutions[run]) for run in coarser_runs[0].runs]
        step_runs = []
        for settings, run in pairs:
            seconds = self.cpu_seconds.get(replace(settings, whole=False), run.seconds)
            step_runs.append(StepRun(settings.steps, seconds, run.values))
        steps = [run.steps for run in step_runs]
        # A method with a step tolerance has the same number of steps in all runs.
        return step_runs if steps == sorted(set(steps), reverse=True) else step_runs[:1]

    def _solve_coarse_run(self, numerics: Numerics, fine: Solution) -> Solution:
        """Solve the rig with coarser settings."""
        model = self.model
        if numerics.other_rig is not None:
            model = replace(model, rig=model.rig.structure.other_rigs[numerics.other_rig])
        # The decay curve and some measures need histories from the start of the run.
        needs_whole = self.model.rig.drive.kind == "free" or bool(ROWS_NEEDING_RUN)
        numerics = replace(numerics, whole=needs_whole)
        return self._solve_around_peak(model, numerics, fine) or self.solve(numerics, model)

    def _solve_around_peak(self, model, numerics: Numerics, fine: Solution) -> Solution | None:
        """Compute the response curve of a coarse run only in the neighbourhood of its own peak.

        The result is None if the run is not a response curve, or if the coarse run has its peak
        elsewhere.
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
        ):  # The complete curve may start at a frequency at which the solver converges.
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
    """Completed fraction of a run and its coarse runs, weighted by their steps per cycle.

    Parameters
    ----------
    callback : callable or None
        Function that is called with the completed fraction.
    expected_steps : float
        Expected sum of the steps per cycle of all runs.

    Attributes
    ----------
    done : float
        Sum of the steps per cycle of the completed runs.
    """

    def __init__(self, callback, expected_steps: float):
        self.callback = callback
        self.expected_steps = expected_steps
        self.done = 0.0
        self.shown = 0.0

    def make_callback(self, steps: float):
        """Return the progress callback for one run with the given steps per cycle; None without one.

        It is None without a callback for all runs. The reported fraction never decreases.
        """
        if self.callback is None:
            return None

        def report(fraction: float) -> None:
            """Convert the completed fraction of one run to that of all runs, and report it."""
            expected = max(self.expected_steps, self.done + steps)
            self.shown = max(self.shown, (self.done + fraction * steps) / expected)
            self.callback(self.shown)

        return report


def _estimate_total_steps(inputs: RunInputs, numerics: Numerics) -> float:
    """Return the expected sum of the steps per cycle of a run and its coarse runs.

    A run on a coarser mesh is counted with the smallest of these numbers.
    """
    if not inputs.estimate:
        return numerics.steps
    model = inputs.plan.model
    engine = ENGINES[numerics.engine]
    steps = {numerics: numerics.steps}
    for kind in [
        *engine.coarser_in_time(model, numerics),
        *engine.list_runs_with_other_modes(model, numerics),
    ]:
        steps |= {run: run.steps for run in kind.runs}
    n_meshes = int(inputs.coarse[0] is not None and bool(model.partial_slip))
    if model.rig.friction.has_partial_slip:
        n_meshes += len(faces.group_interfaces_with_coarse_mesh(model))
    return sum(steps.values()) + n_meshes * min(steps.values())
