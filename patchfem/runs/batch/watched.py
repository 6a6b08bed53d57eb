"""Motion of a rig at many drives as instruments see it, without errors and events.

In: a model and its patch, then one drive after the other. Out: `ObservedMotion`. It serves searches,
which evaluate a model thousands of times. A steady engine finds the motion directly, and may
start from a motion nearby; any other engine makes its run. Pieces and elements are computed
once for all drives.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from ...core import NotConverged, Outcome, Response
from ...dynamics.events import orbits as event_orbits
from ...dynamics.harmonic import balance as point_balance
from ...dynamics.harmonic import harmonic, point
from ...response import measures
from ...response.measures import measure_half_range
from ..rig import event_driven, march, solve
from ..rig.engines import ENGINES, MARCH, choose_steady_method
from ..rig.numerics import choose_numerics
from ..rig.steady import balance as rig_balance
from ..rig.steady import maps

SAMPLES_PER_CYCLE = 400  # number of samples of a cycle of a motion without friction
UNBOUNDED_OUTCOMES = (
    Outcome.GROWS,
    Outcome.NOT_CONVERGED,
    Outcome.EXCEEDS_TRAVEL,
    Outcome.LEAVES_GROOVES,
)


class ObservedMotion(NamedTuple):
    """Last cycles of the motion of a rig, as its instruments measure it.

    - window: histories; None if the MotionObserver does not need them.
    - acceleration: largest absolute acceleration as a run measures it [m s-2].
    - displacement: displacement amplitude as a run measures it [m].
    - near: initial guess for a motion nearby, or None.
    - fundamental: first harmonic of the absolute acceleration [m s-2]; None if only the window
      contains it.
    """

    window: Response | None
    acceleration: float
    displacement: float
    near: Any = None
    fundamental: complex | None = None


class MotionObserver:
    """Rig model that is evaluated for a sequence of drives.

    A call with a drive (core.SineDrive), and with the `near` of another result, returns ObservedMotion;
    None if no bounded motion is found. Without a start, the result is that of `runs.run.run` to
    round-off.

    Parameters
    ----------
    model : Model
    patch : Patch or None
        None under [normal].
    say : callable, optional
        Callback for a line of text.
    windowed : bool
        Whether histories are needed if the engine can do without them.
    before : MotionObserver, optional
        MotionObserver of another model that is no longer used, whose workspace is reused if it fits.
    """

    def __init__(
        self, model, patch, say=None, windowed: bool = True, before: MotionObserver | None = None
    ):
        self.model = model
        self.patch = patch
        self.say = say
        self.windowed = windowed
        self.numerics = choose_numerics(model)
        steady = ENGINES[self.numerics.engine].finds_periodic_motion
        self.by = ""
        if steady and model.kind == "linear" and not model.rig.springs.is_nonlinear:
            self.by = "line"
        elif steady:
            self.by = choose_steady_method(model).name
        self.made = {}
        self.before = before.made if before is not None else {}

    def __call__(self, drive, near=None) -> ObservedMotion | None:
        """Compute the motion under a drive, starting from a nearby motion or from rest."""
        try:
            return self._with_gauge_displacement(
                {
                    "yields": self._yields,
                    "balance": self._balance,
                    "events": self._events,
                    "line": self._line,
                }.get(self.by, self._run)(drive, near)
            )
        except NotConverged:
            if near is None:
                return None
        return self(drive)

    def _with_gauge_displacement(self, seen: ObservedMotion | None) -> ObservedMotion | None:
        """Replace the displacement of a motion by that of the gauge, if the rig has one."""
        gauge = self.model.rig.modes.gauge
        if seen is None or gauge is None or seen.window is None:
            return seen
        window = seen.window
        return seen._replace(
            displacement=measure_half_range(
                window.time, window.modal @ gauge, window.modal_rate @ gauge
            )
        )

    def _get_or_make(self, name: str, make):
        """Return the helper object of a given name, which is created on the first call."""
        if name not in self.made:
            self.made[name] = make()
        return self.made[name]

    def _line(self, drive, near) -> ObservedMotion | None:
        """Compute the motion of a linear structure without friction in closed form."""
        modes = self.model.rig.modes
        omega = drive.omega
        found = harmonic.make_linear_part(modes, omega, 1)
        if any(k == 1 for k, *_ in found.free):
            return None
        z = found.inverse[1] @ (1j * drive.acceleration * modes.base)
        time = np.linspace(0.0, drive.period, SAMPLES_PER_CYCLE + 1)
        turn = np.exp(1j * omega * time)
        modal, rate = (np.outer(turn, z * factor).real for factor in (1.0, 1j * omega))
        push = drive.values(time)
        none = np.zeros(time.size)
        base, shift = (push, -1j * drive.acceleration) if drive.moving else (none, 0.0)
        gain = np.outer(turn, -(omega**2) * z).real
        window = Response(
            time,
            modal,
            rate,
            modal @ modes.slide,
            rate @ modes.slide,
            modal @ modes.output,
            rate @ modes.output,
            gain @ modes.output + base,
            base,
            none,
            none,
        )
        return ObservedMotion(
            window, float(abs(-(omega**2) * modes.output @ z + shift)), float(abs(modes.output @ z))
        )

    def _yields(self, drive, near) -> ObservedMotion:
        """Compute the motion of elastic-plastic elements by their event map or harmonic balance."""
        orbits = self._get_or_make("yields", self._orbits)
        try:
            seen = orbits(drive, near)
        except NotConverged:
            if near is not None or len(self.model.rig.friction.interfaces) > 1:
                raise
            # an initial guess for harmonic balance does not serve the map of yields
            return self._balance(drive, None)._replace(near=None)
        window = orbits.window(drive, seen.point) if self.windowed else None
        return ObservedMotion(
            window, seen.acceleration, seen.displacement, seen.point, seen.fundamental
        )

    def _orbits(self):
        """Return the search for periodic motions of elastic-plastic elements, made on first use."""
        modes = self.model.rig.modes
        groups = event_driven.YieldingElements(self.model, self.numerics, self.patch).groups
        finder = self.before.pop("yields", None)
        if finder is not None and finder.replace_system(modes, groups):
            return finder
        return event_orbits.PeriodicMotionFinder(modes, groups)

    def _balance(self, drive, near) -> ObservedMotion:
        """Compute the motion by harmonic balance."""
        one = self._get_or_make(
            "balance",
            lambda: rig_balance.BalanceFinder(self.model, self.numerics, self.patch, 0, self.say),
        )
        found = point.find_point(
            one.modes, drive, one.group, one.harmonics, one.tolerance, start=near
        )
        window = point_balance.make_cycle_response(
            found, one.modes, drive, rig_balance.SAMPLES_PER_CYCLE
        )
        return ObservedMotion(
            window,
            measures.compute_acceleration_peak(window),
            found.amplitude(one.modes.output),
            found,
        )

    def _events(self, drive, near) -> ObservedMotion | None:
        """Compute the motion of Coulomb interfaces by the event map."""
        one = self._get_or_make(
            "events", lambda: maps.EventFinder(self.model, self.numerics, self.patch, 0, self.say)
        )
        return _observe_solution(one.point(drive)[0])

    def _run(self, drive, near) -> ObservedMotion | None:
        """Compute the last cycles of the motion by a run from rest."""
        model = replace(self.model, rig=self.model.rig.with_signal(drive))
        # histories from before the evaluated window are not needed
        few = replace(self.numerics, whole=False)
        if ENGINES[self.numerics.engine] is not MARCH:
            return _observe_solution(solve.solve(model, few, self.patch, 0, self.say))

        contact, done, *_ = march.march_without_evaluation(model, few, self.patch, 0, self.say)
        if done.outcome in UNBOUNDED_OUTCOMES:
            return None
        values = march.MarchEvaluator(model, few, self.patch, contact).evaluate_measures(done)
        return _measure_motion(done.window, values)


def _observe_solution(raw) -> ObservedMotion | None:
    """Convert the last cycles of a Solution to an ObservedMotion; None if it is unbounded."""
    return None if raw.outcome in UNBOUNDED_OUTCOMES else _measure_motion(raw.window, raw.values)


def _measure_motion(window: Response, values: dict) -> ObservedMotion:
    """Return the motion in a window with its peak acceleration and displacement amplitude."""
    return ObservedMotion(
        window, values["absolute_acceleration_peak"], values["relative_displacement_amplitude"]
    )
