"""Runs of a rig with several numerical settings, and their progress.

In: the inputs of a run. Out: the Solution for given settings, and error estimates from coarse runs.
Each coarse run is solved only once.
"""

from dataclasses import replace

from ...response.coarser import ComparisonRuns, SourceErrors, estimate_errors
from ..results.result import N_INTERFACE_FRAMES, RunInputs
from . import event_to_event, march
from .numerics import Numerics
from .solution import Solution, replace_output_by_gauge
from .steady import steady


def solve_rig(model, numerics, patch, frames: int = 0, say=None, progress=None) -> Solution:
    """Compute the motion of a rig with the engine of its settings; the output is that of the gauge.

    Parameters
    ----------
    model : Model
        Rig, drive and friction laws.
    numerics : Numerics
        Numerical settings, including the name of the engine.
    patch : Patch or None
        None under [normal] and between masses.
    frames : int
        Number of snapshots of the interface in the last cycle.
    say, progress : callable, optional
        Callbacks for a line of text and for the completed fraction.
    """
    # Only the module of this engine is loaded.
    if numerics.engine == "hybrid":
        run = event_to_event.run_from_event_to_event
    elif numerics.engine == "march":
        run = march.march_in_time
    else:
        run = steady.solve_steady_motion
    return replace_output_by_gauge(model, run(model, numerics, patch, frames, say, progress))


class Runner:
    """Solver of a rig with several numerical settings, which stores the solutions of coarse runs.

    Parameters
    ----------
    inputs : RunInputs
        Plan, Patch with its coarser mesh, and callbacks of the run.

    Attributes
    ----------
    solutions : dict
        Solution of each coarse run by its Numerics.
    """

    def __init__(self, inputs: RunInputs):
        self.inputs = inputs
        self.model = inputs.plan.model
        self.solutions: dict[Numerics, Solution] = {}
        self._done = 0.0  # reported fraction of all runs

    def solve(self, numerics: Numerics) -> Solution:
        """Solve the rig on its finest meshes, and store the frames of the interface that its result shows."""
        has_fields = self.inputs.patch is not None or self.model.rig.friction.has_partial_slip
        return self._solve(
            self.model,
            numerics,
            self.inputs.patch,
            N_INTERFACE_FRAMES * has_fields,
            self.inputs.say,
        )

    def _solve_coarse_run(self, numerics: Numerics) -> Solution:
        """Solve the rig with the settings of a comparison run, without frames of the interface.

        The settings say what is coarser: the mesh, the modes of a reduced structure, or a joint whose stiffness differs.
        """
        model = self.model
        patch = self.inputs.patches[numerics.coarse_patch]
        if numerics.other_rig is not None:
            model = replace(model, rig=model.rig.structure.other_rigs[numerics.other_rig])
        if numerics.stiffer_joint:
            stiffer, (patch, *_) = self.inputs.stiffer[:2]
            model = replace(stiffer, rig=replace(stiffer.rig, drive=model.rig.drive))
        # The decay curve needs histories from the start of the run.
        needs_whole = model.rig.drive.kind == "free"
        return self._solve(model, replace(numerics, whole=needs_whole), patch)

    def _solve(self, model, numerics: Numerics, patch, frames: int = 0, say=None) -> Solution:
        """Solve a rig, and report the completed fraction of all runs.

        Parameters
        ----------
        model : Model
            Model of the rig.
        numerics : Numerics
            Cycles, steps and other settings of the run.
        patch : Patch or None
            Solved patch.
        frames : int
            Number of frames of the fields in the last cycle.
        say : callable, optional
            Function that takes a line of text on the progress.
        """
        # Each run is a half of what is left, because the number of coarse runs is not known.
        left = 1 - self._done
        share = left / 2 if self.inputs.estimate else left

        def report(fraction: float) -> None:
            """Report the completed fraction of all runs, given that of the present run."""
            if self.inputs.progress is not None:
                self.inputs.progress(1 - left + share * fraction)

        solution = solve_rig(model, numerics, patch, frames, say, report)
        self._done += share
        return solution

    def estimate_errors(self, runs: ComparisonRuns, solution: Solution) -> list[SourceErrors]:
        """Estimate the errors of a run from coarse runs (`response.coarser.estimate_errors`)."""
        return estimate_errors(self._solve_coarse_run, solution.values, runs, self.solutions)
