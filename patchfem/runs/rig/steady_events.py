"""The steady motion of Coulomb interfaces, or of none at all, by the event map; its curve over frequency or level."""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ...compiled import load
from ...core import Outcome
from ...dynamics.events.steady_events import steady
from ...dynamics.one_mode.steady import response
from .exact import forces_of, run_exact
from .solution import drives_of, largest_of


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
        drives = drives_of(drive)
        if self.modes.omega.size == 1 and len(self.modes.interfaces) == 1:
            curve = self._single(drives)
        else:
            names = ("frequency", "level", "amplitude", "regime", "multiplier")
            rows = [self._row(one) for one in drives]
            curve = {name: np.array(column) for name, column in zip(names, zip(*rows))}
        return curve, drives[largest_of(curve["amplitude"])], None

    def _single(self, drives) -> dict:
        """The curve of one mode by its own map, compiled."""
        load("dynamics.one_mode.steady_kernels", self.say)
        found = response(self.modes, drives, float(self.forces[0][0]), float(self.forces[1][0]))
        names = [f"{stops:g} stops" if str(regime) == "stops" else str(regime)
                 for regime, stops in zip(found.regime, found.stops)]
        return {"frequency": found.omega / (2 * np.pi), "level": np.array([one.acceleration for one in drives]),
                "amplitude": found.amplitude, "regime": np.array(names), "multiplier": np.abs(found.multiplier)}

    def _row(self, drive) -> tuple:
        found = self.found(drive)
        bounded = found.regime != "unbounded"
        return (drive.omega / (2 * np.pi), drive.acceleration, found.amplitude if bounded else np.nan, found.regime,
                float(np.abs(found.multipliers).max(initial=0.0)))
