"""Runs of a rig with several numerical settings, and their progress.

In: the inputs of a run. Out: the Solution for given settings, and error estimates from coarse runs.
Each coarse run is solved only once.
"""

from dataclasses import replace
from time import process_time

from ...response.coarser import ComparisonRuns, StepRun, estimate_errors
from ..results.result import N_FRAMES, RunInputs
from .numerics import Numerics
from .solution import Solution
from .solve import solve_rig

# Expected ratio of the steps of a run and its coarse runs to those of the run.
COARSE_RUNS_RATIO = 2.0


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
        self.solutions: dict[Numerics, Solution] = {}
        self.error_seconds = 0.0
        self.cpu_seconds: dict[Numerics, float] = {}
        # Steps per cycle of all runs: expected and completed ones; and the largest reported fraction.
        self._expected_steps = numerics.steps * (COARSE_RUNS_RATIO if inputs.estimate else 1.0)
        self._steps_done = 0.0
        self._shown = 0.0

    def solve(self, numerics: Numerics, coarser_model=None) -> Solution:
        """Solve the rig with the given settings.

        Parameters
        ----------
        numerics : Numerics
            Settings of this run.
        coarser_model : Model, optional
            Model of a coarse run, which needs no fields; default: the model of the run itself.
        """
        model = coarser_model or self.model
        frames = 0
        say = None
        if coarser_model is None:
            say = self.inputs.say
            if self.inputs.patch is not None or model.rig.friction.has_partial_slip:
                frames = N_FRAMES
        patch = self.inputs.patch
        if numerics.coarse_patch:
            patch = self.inputs.coarse[0]
        if numerics.stiffer_joint:
            stiffer_model, (patch, *_) = self.inputs.stiffer[:2]
            model = replace(stiffer_model, rig=replace(stiffer_model.rig, drive=model.rig.drive))
        report = self._make_callback(numerics.steps)
        begin = process_time()
        solution = solve_rig(model, numerics, patch, frames, say, report)
        self.cpu_seconds[replace(numerics, whole=False)] = process_time() - begin
        self._steps_done += numerics.steps
        return solution

    def estimate_errors(self, coarser_runs: ComparisonRuns, solution: Solution) -> list:
        """Estimate the errors of a run from coarse runs (`response.coarser.estimate_errors`)."""
        errors, seconds = estimate_errors(
            self._solve_coarse_run,
            solution.values,
            coarser_runs,
            self.solutions,
        )
        self.error_seconds += seconds
        return errors

    def list_step_runs(
        self, numerics: Numerics, solution: Solution, coarser_runs: ComparisonRuns
    ) -> list[StepRun]:
        """Return a StepRun of the run and of each run with fewer steps, from fine to coarse.

        If no coarse run has fewer steps, the list contains only the run itself.

        Parameters
        ----------
        numerics : Numerics
            Settings of the run.
        solution : Solution
            Solution of the run.
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

    def _solve_coarse_run(self, numerics: Numerics) -> Solution:
        """Solve the rig with coarser settings."""
        model = self.model
        if numerics.other_rig is not None:
            model = replace(model, rig=model.rig.structure.other_rigs[numerics.other_rig])
        # The decay curve needs histories from the start of the run.
        needs_whole = self.model.rig.drive.kind == "free"
        return self.solve(replace(numerics, whole=needs_whole), model)

    def _make_callback(self, steps: float):
        """Return the progress callback of a run with given steps per cycle; None without one for all runs.

        The completed fraction of all runs is weighted by their steps and never decreases.
        """
        if self.inputs.progress is None:
            return None

        def report(fraction: float) -> None:
            """Convert the completed fraction of one run to that of all runs, and report it."""
            expected = max(self._expected_steps, self._steps_done + steps)
            self._shown = max(self._shown, (self._steps_done + fraction * steps) / expected)
            self.inputs.progress(self._shown)

        return report
