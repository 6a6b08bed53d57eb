"""The steady motion of Coulomb interfaces, or of none at all, by the event map; its curve over frequency or level."""

from dataclasses import replace
from functools import cached_property
from time import perf_counter

import numpy as np

from ....core import Outcome, PatchfemError
from ....dynamics.events.histories import simulate, warm_up
from ....dynamics.events.stick_steady import steady
from ....dynamics.periodic import is_stable
from ....response.measures import half_swing
from ....response.spectrum import wave_measures
from ....structure.drive_sizes import largest
from ....structure.response import receptance
from ..pieces import Limits, run_exact
from .curves import SHOWN, Shown, exact_errors, traced, unlasting

OUTCOMES = {"unbounded": Outcome.GROWS, "stuck": Outcome.STUCK}


class Events:
    """Coulomb interfaces, or none at all, by the event map."""

    tries_another = False

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model, self.numerics, self.modes, self.patch, self.say = model, numerics, model.rig.modes, patch, say
        self.groups = Limits(model, numerics, patch).groups
        self.forces = np.array([(one.static, one.kinetic) for one in self.groups]).T
        self.falls = bool(np.any(self.forces[0] > self.forces[1]))

    def _found(self, drive, near):
        """Steady motion by shooting: where friction falls with the first slip there are several, and one starts from
        the state `near`."""
        return steady(self.modes, drive, self.groups, start=near if self.falls else None)

    def point(self, drive, near=None) -> tuple:
        """The steady motion as a run of the exact engine that begins in it, and its start."""
        begin = perf_counter()
        found = self._found(drive, near)
        few = replace(self.numerics, cycles=2.0, window=1)
        here = replace(self.model.rig, drive=drive, start=found.start, levels=())
        raw = run_exact(replace(self.model, rig=here), few, self.patch)
        outcome, regime, message = OUTCOMES.get(found.regime, Outcome.STEADY), found.regime, raw.message
        if not _lasts(found):
            outcome, regime, message = Outcome.NOT_CONVERGED, f"{regime}, unstable", unlasting(found.multipliers)
        extra = {"regime": regime, "multipliers": found.multipliers, "residual": found.residual, "map": "events"}
        return replace(raw, outcome=outcome, message=message, extra=extra,
                       errors=exact_errors(raw.values, found.residual), book=raw.book | {"iterations": 0.0},
                       seconds=perf_counter() - begin), found.start

    def shown(self, drive, near=None) -> Shown:
        """A point of a curve."""
        found = self._found(drive, near)
        size = float(np.abs(found.multipliers).max(initial=0.0))
        one = self._shown(drive, found.regime, size, found.start, 1, found.residual)
        return one if _lasts(found) else one._replace(regime=f"{found.regime}, unstable", stable=False)

    def curve(self, drive) -> tuple:
        """(points of the curve over the frequency, no folds)."""
        warm_up(self.say)
        find = self.shown if any(limit.any() for limit in self.forces) else self._linear
        return traced(self.modes, drive, find), ()

    def _linear(self, drive, near=None) -> Shown:
        """A point of a curve without friction, in closed form; on a resonance that nothing damps as `shown`."""
        modes, gauge = self.modes, self.modes.output if self.modes.gauge is None else self.modes.gauge
        try:
            seen, felt = receptance(modes, drive.omega, [gauge, modes.output], modes.base)[0, :, 0] * modes.mass
        except PatchfemError:
            return self.shown(drive)
        size = drive.acceleration * float(abs(drive.moving + drive.omega**2 * felt))
        values = {SHOWN["amplitude"]: drive.acceleration * float(abs(seen)), SHOWN["acceleration_peak"]: size,
                  **wave_measures(size, 0.0)}
        values = {name: value for name, value in values.items() if value is not None}
        return Shown(drive, values, exact_errors(values, 0.0), "sliding", float(np.exp(self.decay * drive.period)),
                     True, Outcome.STEADY)

    @cached_property
    def decay(self) -> float:
        """Rate [1/s] at which the slowest free motion of the modes alone dies out, <= 0."""
        n = self.modes.omega.size
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(self.modes.omega**2), -self.modes.dampers]])
        return float(np.linalg.eigvals(state).real.max())

    def _shown(self, drive, regime: str, multiplier: float, start, periods: int, residual: float) -> Shown:
        """What a run of the periods after which a motion repeats shows of it; nothing where it is not bounded."""
        outcome = OUTCOMES.get(regime, Outcome.STEADY)
        if regime in ("unbounded", "unsettled"):
            return Shown(drive, {}, {}, regime, multiplier, False, outcome)
        done = simulate(self.modes, drive, self.groups, periods, periods, start=start)
        window, gauge = done.window, self.modes.gauge
        extremes = done.amplitudes
        amplitude = float(extremes[:, 1].max() - extremes[:, 0].min()) / 2 if gauge is None else \
            half_swing(window.time, window.modal @ gauge, window.modal_rate @ gauge)
        values = {SHOWN["amplitude"]: amplitude, SHOWN["acceleration_peak"]: done.acceleration,
                  **wave_measures(*done.reading.waves, largest(drive))}
        values = {name: value for name, value in values.items() if value is not None}
        return Shown(drive, values, exact_errors(values, residual), regime, multiplier, True, outcome, start)


def _lasts(found) -> bool:
    """Whether a Steady lasts as far as its multipliers tell: those of two events at once hold for one order of them."""
    return found.regime == "unbounded" or not found.alone or is_stable(found.multipliers)
