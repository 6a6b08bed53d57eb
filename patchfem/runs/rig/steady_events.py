"""The steady motion of Coulomb interfaces, or of none at all, by the event map; its curve over frequency or level."""

from dataclasses import replace
from functools import cached_property
from time import perf_counter

import numpy as np

from ...compiled import load
from ...core import Outcome, PatchfemError
from ...dynamics.events.steady_events import steady
from ...dynamics.one_mode.steady import response
from ...structure.response import receptance
from .exact import forces_of, run_exact
from .solution import traced


class Events:
    """Coulomb interfaces, or none at all, by the event map."""

    def __init__(self, model, numerics, patch, say):
        self.model, self.numerics, self.modes, self.patch, self.say = model, numerics, model.rig.modes, patch, say
        self.forces = forces_of(model, patch)

    def found(self, drive, start=None):
        """Steady motion by shooting, from `start` on."""
        return steady(self.modes, drive, *self.forces, start=start)

    def point(self, drive, near=None) -> tuple:
        """The steady motion, found from the start `near`, as a run of the exact engine that begins in it."""
        begin = perf_counter()
        found = self.found(drive, near)
        few = replace(self.numerics, cycles=2.0, window=1)
        here = replace(self.model.rig, drive=drive, start=found.start, levels=())
        raw = run_exact(replace(self.model, rig=here), few, self.patch)
        outcome = {"unbounded": Outcome.GROWS, "stuck": Outcome.STUCK}.get(found.regime, Outcome.STEADY)
        extra = {"regime": found.regime, "multipliers": found.multipliers, "residual": found.residual,
                 "map": "events"}
        raw = replace(raw, outcome=outcome, book=raw.book | {"iterations": 0.0}, seconds=perf_counter() - begin)
        return raw, {name: abs(v) * (1e-9 + found.residual) for name, v in raw.values.items()}, extra

    def curve(self, drive) -> tuple:
        """Curve as arrays by name, and the sine of its largest amplitude; None: the motion there is the only one."""
        alone = self.modes.omega.size == 1 and len(self.modes.interfaces) == 1
        if not any(limit.any() for limit in self.forces):
            row = self._linear
        elif alone:
            load("dynamics.one_mode.steady_kernels", self.say)
            row = self._single
        else:
            row = self._row
        curve, best, _ = traced(self.modes, drive, lambda sine, _: (row(sine), None))
        return curve, best, None

    def _linear(self, drive) -> tuple:
        """A point of a curve without friction, in closed form; on a resonance that nothing damps as `_row`."""
        modes = self.modes
        try:
            seen = receptance(modes, drive.omega, modes.output, modes.base)[0, 0, 0] * modes.mass
        except PatchfemError:
            return self._row(drive)
        return drive.omega / (2 * np.pi), drive.acceleration, drive.acceleration * abs(seen), "sliding", \
            float(np.exp(self.decay * drive.period))

    @cached_property
    def decay(self) -> float:
        """Rate [1/s] at which the slowest free motion of the modes alone dies out, <= 0."""
        n = self.modes.omega.size
        state = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(self.modes.omega**2), -self.modes.dampers]])
        return float(np.linalg.eigvals(state).real.max())

    def _single(self, drive) -> tuple:
        """A point of the curve of one mode by its own map, compiled."""
        found = response(self.modes, [drive], float(self.forces[0][0]), float(self.forces[1][0]))
        regime, stops = str(found.regime[0]), float(found.stops[0])
        return (float(found.omega[0]) / (2 * np.pi), drive.acceleration, float(found.amplitude[0]),
                f"{stops:g} stops" if regime == "stops" else regime, float(np.abs(found.multiplier[0])))

    def _row(self, drive) -> tuple:
        found = self.found(drive)
        bounded = found.regime != "unbounded"
        return (drive.omega / (2 * np.pi), drive.acceleration, found.amplitude if bounded else np.nan, found.regime,
                float(np.abs(found.multipliers).max(initial=0.0)))
