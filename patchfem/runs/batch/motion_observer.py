"""Steady motion of a rig for a sequence of drives, without error estimates and events.

In: a model and its patch, then one drive after the other. Out: `ObservedMotion`. Parameter fits evaluate a model
thousands of times in this way. A finder of periodic motions starts from the solution for a similar drive; all other
engines run from rest. Contact models are created once for all drives.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

from ...core import NotConverged
from ..results.result import UNBOUNDED_OUTCOMES
from ..rig.engines import ENGINES, choose_numerics
from ..rig.rig import solve_rig
from ..rig.steady.curves import COLUMN_MEASURES, ObservedMotion
from ..rig.steady.shooting import ShootingFinder


class MotionObserver:
    """Rig model whose motion is computed for a sequence of drives.

    Without an initial guess, the result equals that of `runs.run.run`: to round-off, or within 1e-5 where an interface
    hardly slips and the motion would approach its steady state for hundreds of cycles.

    Parameters
    ----------
    model : Model
    patch : Patch or None
        None under [normal].
    report : callable, optional
        Callback for progress messages.
    needs_histories : bool
        If False, histories are omitted if the engine does not need them.

    Attributes
    ----------
    finds_periodic_motion : bool
        Whether a motion can start from that under a similar drive.
    """

    def __init__(self, model, patch, report=None, needs_histories: bool = True):
        self.model = model
        self.patch = patch
        self.report = report
        self.needs_histories = needs_histories
        self.numerics = choose_numerics(model)
        self.finds_periodic_motion = ENGINES[self.numerics.engine].finds_periodic_motion

    @cached_property
    def finder(self):
        """Solver of periodic motions, created once for all drives."""
        return ShootingFinder(self.model, self.numerics, self.patch, 0, self.report)

    def __call__(self, drive, initial_guess=None) -> ObservedMotion | None:
        """Compute the motion under a drive.

        Parameters
        ----------
        drive : core.SineDrive
            Sine with the amplitude and frequency of the point to be computed.
        initial_guess
            `ObservedMotion.initial_guess` for a similar drive; None: start from rest.

        Returns
        -------
        ObservedMotion or None
            None if no bounded motion is found.
        """
        try:
            if not self.finds_periodic_motion:
                return self._observe_run(drive)
            return self.finder.observe(drive, initial_guess, needs_histories=self.needs_histories)
        except NotConverged:
            if initial_guess is None:
                return None
        return self(drive)

    def _observe_run(self, drive) -> ObservedMotion | None:
        """Compute the last cycles of the motion by a run from rest."""
        model = replace(self.model, rig=self.model.rig.with_signal(drive))
        # Histories before the evaluated window are not needed.
        numerics = replace(self.numerics, whole=False)
        solution = solve_rig(model, numerics, self.patch, 0, self.report)
        if solution.run.outcome in UNBOUNDED_OUTCOMES:
            return None
        peak, amplitude = (
            solution.values[COLUMN_MEASURES[name]] for name in ("acceleration_peak", "amplitude")
        )
        return ObservedMotion(solution.run.window, peak, amplitude)
