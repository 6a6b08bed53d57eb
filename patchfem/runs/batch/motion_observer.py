"""Steady motion of a rig for a sequence of drives, without error estimates and events.

In: a model and its patch, then one drive after the other. Out: `ObservedMotion`. Parameter fits
evaluate a model thousands of times in this way. Engines for periodic motions start from the
solution for a similar drive; all other engines run from rest. Contact models are created once for
all drives.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...core import NotConverged, Outcome, Response
from ...dynamics.harmonic.equations import has_undamped_resonance
from ...dynamics.harmonic.motion import make_cycle_response
from ...dynamics.harmonic.steady import find_steady_motion
from ...response import measures
from ...response.measures import measure_half_range
from ..rig import march, solve
from ..rig.engines import ENGINES, MARCH, choose_steady_method
from ..rig.numerics import choose_numerics
from ..rig.steady import balance as rig_balance
from ..rig.steady import shooting

SAMPLES_PER_CYCLE = 400  # samples per cycle of a motion without friction
UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.NOT_CONVERGED,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
)


class ObservedMotion(NamedTuple):
    """Last cycles of the motion of a rig, with the quantities that its sensors measure.

    - window: histories; None if they were not requested.
    - acceleration: peak absolute acceleration [m s-2], as in the measures of a run.
    - displacement: displacement amplitude [m], as in the measures of a run.
    - initial_guess: solution as initial guess for a similar drive, or None.
    - fundamental: first harmonic of the absolute acceleration [m s-2]; None if it must be computed
      from the window.
    """

    window: Response | None
    acceleration: float
    displacement: float
    initial_guess: Any = None
    fundamental: complex | None = None


class MotionObserver:
    """Rig model whose motion is computed for a sequence of drives.

    Without an initial guess, the result equals that of `runs.run.run` to round-off.

    Parameters
    ----------
    model : Model
    patch : Patch or None
        None under [normal].
    report : callable, optional
        Callback for progress messages.
    needs_histories : bool
        If False, histories are omitted if the engine does not need them.
    previous : MotionObserver, optional
        Observer of another model that is no longer used; its workspace is reused if it fits.
    """

    def __init__(
        self,
        model,
        patch,
        report=None,
        needs_histories: bool = True,
        previous: MotionObserver | None = None,
    ):
        self.model = model
        self.patch = patch
        self.report = report
        self.needs_histories = needs_histories
        self.numerics = choose_numerics(model)
        finds_periodic_motion = ENGINES[self.numerics.engine].finds_periodic_motion
        self.method = ""
        if finds_periodic_motion and model.kind == "linear" and not model.rig.springs.is_nonlinear:
            self.method = "line"
        elif finds_periodic_motion:
            self.method = choose_steady_method(model).name
        self.objects = {}
        self.previous_objects = previous.objects if previous is not None else {}

    def __call__(self, drive, initial_guess=None) -> ObservedMotion | None:
        """Compute the motion under a drive.

        Parameters
        ----------
        drive : core.SineDrive
        initial_guess
            `ObservedMotion.initial_guess` for a similar drive; None: start from rest.

        Returns
        -------
        ObservedMotion or None
            None if no bounded motion is found.
        """
        try:
            return self._with_gauge_displacement(
                {
                    "shooting": self._compute_by_shooting,
                    "balance": self._compute_by_balance,
                    "line": self._compute_linear,
                }.get(self.method, self._compute_by_run)(drive, initial_guess)
            )
        except NotConverged:
            if initial_guess is None:
                return None
        return self(drive)

    def _with_gauge_displacement(self, motion: ObservedMotion | None) -> ObservedMotion | None:
        """Return a motion with the displacement of the gauge, if the rig has one."""
        gauge = self.model.rig.modes.gauge
        if motion is None or gauge is None or motion.window is None:
            return motion
        window = motion.window
        return motion._replace(
            displacement=measure_half_range(
                window.time, window.modal @ gauge, window.modal_rate @ gauge
            )
        )

    def _get_or_create(self, name: str, create):
        """Return the object of a given name, which is created on the first call."""
        if name not in self.objects:
            self.objects[name] = create()
        return self.objects[name]

    def _compute_linear(self, drive, initial_guess) -> ObservedMotion | None:
        """Compute the motion of a linear structure without friction in closed form."""
        modes = self.model.rig.modes
        omega = drive.omega
        stiffness = np.diag(modes.omega**2 - omega**2) + 1j * omega * modes.damping_matrix
        if has_undamped_resonance(modes, omega):
            return None
        z = np.linalg.solve(stiffness, 1j * drive.acceleration * modes.base)
        time = np.linspace(0.0, drive.period, SAMPLES_PER_CYCLE + 1)
        phase_factor = np.exp(1j * omega * time)
        modal, rate = (np.outer(phase_factor, z * factor).real for factor in (1.0, 1j * omega))
        drive_values = drive.values(time)
        zeros = np.zeros(time.size)
        base, base_phasor = (
            (drive_values, -1j * drive.acceleration) if drive.moving else (zeros, 0.0)
        )
        relative_acceleration = np.outer(phase_factor, -(omega**2) * z).real
        window = Response(
            time,
            modal,
            rate,
            modal @ modes.slide,
            rate @ modes.slide,
            modal @ modes.output,
            rate @ modes.output,
            relative_acceleration @ modes.output + base,
            base,
            zeros,
            zeros,
        )
        return ObservedMotion(
            window,
            float(abs(-(omega**2) * modes.output @ z + base_phasor)),
            float(abs(modes.output @ z)),
        )

    def _compute_by_shooting(self, drive, initial_guess) -> ObservedMotion | None:
        """Compute the motion by Newton's method on the map of a period."""
        finder = self._get_or_create(
            "shooting",
            lambda: shooting.ShootingFinder(self.model, self.numerics, self.patch, 0, self.report),
        )
        seen = finder.observe(drive, initial_guess, needs_histories=self.needs_histories)
        return None if seen is None else ObservedMotion(*seen)

    def _compute_by_balance(self, drive, initial_guess) -> ObservedMotion:
        """Compute the motion by harmonic balance."""
        solver = self._get_or_create(
            "balance",
            lambda: rig_balance.BalanceFinder(
                self.model, self.numerics, self.patch, 0, self.report
            ),
        )
        solution = find_steady_motion(
            solver.modes,
            drive,
            solver.group,
            solver.harmonics,
            solver.tolerance,
            start=initial_guess,
        )
        window = make_cycle_response(solution, solver.modes, drive, rig_balance.SAMPLES_PER_CYCLE)
        return ObservedMotion(
            window,
            measures.compute_peak(window.acceleration),
            solution.amplitude(solver.modes.output),
            solution,
        )

    def _compute_by_run(self, drive, initial_guess) -> ObservedMotion | None:
        """Compute the last cycles of the motion by a run from rest."""
        model = replace(self.model, rig=self.model.rig.with_signal(drive))
        # histories before the evaluated window are not needed
        numerics = replace(self.numerics, whole=False)
        if ENGINES[self.numerics.engine] is not MARCH:
            return _observe_solution(solve.solve_rig(model, numerics, self.patch, 0, self.report))

        contact, run, *_ = march.integrate_without_postprocessing(
            model, numerics, self.patch, 0, self.report
        )
        if run.outcome in UNBOUNDED_OUTCOMES:
            return None
        values = march.MarchEvaluator(model, numerics, self.patch, contact).evaluate_measures(run)
        return _measure_motion(run.window, values)


def _observe_solution(solution) -> ObservedMotion | None:
    """Return the last cycles of a Solution, or None if its motion is unbounded."""
    is_unbounded = solution.outcome in UNBOUNDED_OUTCOMES
    return None if is_unbounded else _measure_motion(solution.window, solution.values)


def _measure_motion(window: Response, values: dict) -> ObservedMotion:
    """Return an ObservedMotion with its amplitudes from the measures of a run."""
    return ObservedMotion(
        window, values["absolute_acceleration_peak"], values["relative_displacement_amplitude"]
    )
