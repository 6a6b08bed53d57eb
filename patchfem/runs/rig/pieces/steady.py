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
from ..solution import traced
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
        def find(sine, near):
            one = steady(self.modes, sine, self.found.groups, near)
            largest = np.abs(one.multipliers).max(initial=0.0)
            regime = one.regime if largest <= 1 else f"{one.regime}, unstable"
            return (sine.omega / (2 * np.pi), sine.acceleration, one.amplitude, regime, largest), one.point

        return traced(self.modes, drive, find)
