"""The steady motion behind elastic-plastic elements by the map from yield to yield; its curve over frequency or level.

Nothing is left open but round-off: what the elements do is proved from event to event, and the period closes to the
residual that is stated.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....core import Outcome
from ....dynamics.piecewise import histories
from ....dynamics.piecewise.elements import books_begin
from ....dynamics.piecewise.steady import steady
from ..solution import drives_of, largest_of
from .run import Interfaces, solution_of


class Yields:
    """Elastic-plastic elements, by the map from yield to yield."""

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model, self.numerics, self.modes, self.patch = model, numerics, model.rig.modes, patch
        self.frames = frames
        histories.warm_up(say)
        self.found = Interfaces(model, numerics, patch)

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the one `near` it or from rest, as a run of two cycles that begins in it."""
        begin = perf_counter()
        one = steady(self.modes, drive, self.found.groups, near)
        done = histories.simulate(self.modes, drive, self.found.groups, 2.0, 1, np.inf, self.frames, None, one.start,
                                  books_begin(one.memory))
        few = replace(self.numerics, cycles=2.0, window=1)
        raw = solution_of(self.model, few, self.patch, drive, self.found, done, perf_counter() - begin)
        stable = np.abs(one.multipliers).max(initial=0.0) <= 1
        extra = {"regime": one.regime if stable else f"{one.regime}, unstable", "multipliers": one.multipliers,
                 "residual": one.residual, "map": "yields"}
        raw = replace(raw, outcome=raw.outcome or Outcome.STEADY, steady=(None, None),
                      book=raw.book | {"iterations": float(one.iterations)})
        return raw, {name: abs(v) * (1e-9 + one.error) for name, v in raw.values.items() if v is not None}, extra

    def curve(self, drive) -> tuple:
        """Curve as arrays by name, the sine of its largest amplitude, and the Point of the motion there."""
        drives, found, near = drives_of(drive), [], None
        for sine in drives:
            found.append(steady(self.modes, sine, self.found.groups, near))
            near = found[-1].point
        best = largest_of([one.amplitude for one in found])
        largest = np.array([np.abs(one.multipliers).max(initial=0.0) for one in found])
        curve = {"frequency": np.array([one.omega / (2 * np.pi) for one in drives]),
                 "level": np.array([one.acceleration for one in drives]),
                 "amplitude": np.array([one.amplitude for one in found]),
                 "regime": np.array([one.regime if size <= 1 else f"{one.regime}, unstable"
                                     for one, size in zip(found, largest)]), "multiplier": largest}
        return curve, drives[best], found[best].point
