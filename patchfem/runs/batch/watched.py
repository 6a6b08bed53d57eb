"""What instruments see of a rig at many drives: its motion alone, without errors, multipliers or events.

For searches, which ask a model thousands of times. A steady engine goes straight to its motion and may start from one
nearby; any other engine makes its run. Pieces and elements are made once for all drives.
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
from ...response.measures import half_swing
from ..rig import march, pieces
from ..rig.engines import ENGINES, MARCH, steady_by
from ..rig.numerics import choose
from ..rig.steady import balance as rig_balance
from ..rig.steady import maps

SAMPLES = 400  # of a cycle without friction
UNBOUNDED = Outcome.GROWS, Outcome.NOT_CONVERGED, Outcome.EXCEEDS_TRAVEL, Outcome.LEAVES_GROOVES


class Watched(NamedTuple):
    """The last cycle or cycles of a rig: window with its histories, None where a Watcher is not asked for it; largest
    absolute acceleration [m s-2] and displacement amplitude [m] as a run measures them; near: a start for a motion
    nearby, None where there is none; fundamental: first harmonic [m s-2] of the absolute acceleration, None where only
    the window has it."""

    window: Response | None
    acceleration: float
    displacement: float
    near: Any = None
    fundamental: complex | None = None


class Watcher:
    """A model of kind rig or linear, asked at one drive after another.

    patch: the solved Patch, or None under [normal]. A call with a drive (core.SineDrive) and the `near` of another
    answer gives Watched, or None where no bounded motion is found; the answer is that of `runs.run.run` to round-off
    where no start is given. windowed: whether histories are wanted where the engine can do without them; before: a
    Watcher of another model that is no longer asked, whose room serves this one where it fits.
    """

    def __init__(
        self, model, patch, say=None, windowed: bool = True, before: Watcher | None = None
    ):
        self.model, self.patch, self.say, self.windowed = model, patch, say, windowed
        self.numerics = choose(model)
        steady = ENGINES[self.numerics.engine].steady
        line = model.kind == "linear" and not model.rig.springs.is_nonlinear
        self.by = "" if not steady else "line" if line else steady_by(model).name
        self.made, self.before = {}, before.made if before is not None else {}

    def __call__(self, drive, near=None) -> Watched | None:
        try:
            return self._gauged(
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

    def _gauged(self, seen: Watched | None) -> Watched | None:
        """The displacement at the gauge, where it moves otherwise than the accelerometer."""
        gauge = self.model.rig.modes.gauge
        if seen is None or gauge is None or seen.window is None:
            return seen
        window = seen.window
        return seen._replace(
            displacement=half_swing(window.time, window.modal @ gauge, window.modal_rate @ gauge)
        )

    def _once(self, name: str, make):
        if name not in self.made:
            self.made[name] = make()
        return self.made[name]

    def _line(self, drive, near) -> Watched | None:
        """Without friction: z = (Omega^2 - omega^2 + i omega D)^-1 (i a base)."""
        modes, omega = self.model.rig.modes, drive.omega
        found = harmonic.linear_part(modes, omega, 1)
        if any(k == 1 for k, *_ in found.free):
            return None
        z = found.inverse[1] @ (1j * drive.acceleration * modes.base)
        time = np.linspace(0.0, drive.period, SAMPLES + 1)
        turn = np.exp(1j * omega * time)
        modal, rate = (np.outer(turn, z * factor).real for factor in (1.0, 1j * omega))
        push, none = drive.values(time), np.zeros(time.size)
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
        return Watched(
            window, float(abs(-(omega**2) * modes.output @ z + shift)), float(abs(modes.output @ z))
        )

    def _yields(self, drive, near) -> Watched:
        orbits = self._once("yields", self._orbits)
        try:
            seen = orbits(drive, near)
        except NotConverged:
            if near is not None or len(self.model.rig.friction.interfaces) > 1:
                raise
            # a start for a balance is none for a map of yields
            return self._balance(drive, None)._replace(near=None)
        window = orbits.window(drive, seen.point) if self.windowed else None
        return Watched(window, seen.acceleration, seen.displacement, seen.point, seen.fundamental)

    def _orbits(self):
        modes, groups = (
            self.model.rig.modes,
            pieces.YieldingElements(self.model, self.numerics, self.patch).groups,
        )
        found = self.before.pop("yields", None)
        return (
            found
            if found is not None and found.renewed(modes, groups)
            else event_orbits.Orbits(modes, groups)
        )

    def _balance(self, drive, near) -> Watched:
        one = self._once(
            "balance",
            lambda: rig_balance.BalanceFinder(self.model, self.numerics, self.patch, 0, self.say),
        )
        found = point.point(one.modes, drive, one.group, one.harmonics, one.tolerance, start=near)
        window = point_balance.periodic_response(found, one.modes, drive, rig_balance.SAMPLES)
        return Watched(
            window, measures.acceleration_peak(window), found.amplitude(one.modes.output), found
        )

    def _events(self, drive, near) -> Watched | None:
        one = self._once(
            "events", lambda: maps.EventFinder(self.model, self.numerics, self.patch, 0, self.say)
        )
        return _seen(one.point(drive)[0])

    def _run(self, drive, near) -> Watched | None:
        model = replace(self.model, rig=self.model.rig.with_signal(drive))
        # what is before the window is neither kept nor measured
        few = replace(self.numerics, whole=False)
        if ENGINES[self.numerics.engine] is not MARCH:
            return _seen(
                ENGINES[self.numerics.engine].run(model, few, self.patch, 0, self.say, None)
            )

        contact, done, *_ = march.marched(model, few, self.patch, 0, self.say)
        if done.outcome in UNBOUNDED:
            return None
        values = march.MarchReader(model, few, self.patch, contact).values(done)
        return _measured(done.window, values)


def _seen(raw) -> Watched | None:
    """What a Solution shows; None where the motion grows, leaves its travel or was not found."""
    return None if raw.outcome in UNBOUNDED else _measured(raw.window, raw.values)


def _measured(window: Response, values: dict) -> Watched:
    return Watched(
        window, values["absolute_acceleration_peak"], values["relative_displacement_amplitude"]
    )
