"""The steady motion behind elastic-plastic elements by the map from yield to yield; its curve over frequency or level.

Nothing is left open but round-off: what the elements do is proved from event to event, and the period closes to the
residual that is stated.
"""

from dataclasses import replace
from time import perf_counter

import numpy as np

from ....core import Outcome
from ....dynamics.events import histories
from ....dynamics.events.elements import books_begin
from ....dynamics.events.steady import steady
from ....dynamics.periodic import is_stable
from ....response.measures import half_swing
from ....response.spectrum import wave_measures
from ..pieces import Interfaces, Pieces
from .curves import SHOWN, Shown, exact_errors, traced, unlasting


class Yields:
    """Elastic-plastic elements, by the map from yield to yield."""

    def __init__(self, model, numerics, patch, frames: int = 0, say=None):
        self.model, self.numerics, self.modes, self.patch = model, numerics, model.rig.modes, patch
        self.frames, self.tries_another = frames, len(model.rig.interfaces) == 1
        histories.warm_up(say)
        self.found = Interfaces(model, numerics, patch)

    def point(self, drive, near=None) -> tuple:
        """The steady motion, from the Point `near` it or from rest, as a run of two cycles that begins in it; and its
        own Point."""
        begin = perf_counter()
        one = steady(self.modes, drive, self.found.groups, near)
        done = histories.simulate(self.modes, drive, self.found.groups, 2.0, 1, np.inf, self.frames, None, one.start,
                                  books_begin(one.memory))
        few = replace(self.numerics, cycles=2.0, window=1)
        raw = Pieces(self.model, few, self.patch, self.found).solution(done, perf_counter() - begin, drive)
        extra = {"regime": _regime(one), "multipliers": one.multipliers, "residual": one.residual, "map": "yields"}
        if not _stable(one):
            raw = replace(raw, outcome=Outcome.NOT_CONVERGED, message=unlasting(one.multipliers))
        return replace(raw, outcome=raw.outcome or Outcome.STEADY, steady=(None, None), extra=extra,
                       errors=exact_errors(raw.values, one.error),
                       book=raw.book | {"iterations": float(one.iterations)}), one.point

    def shown(self, drive, near=None) -> Shown:
        """A point of a curve."""
        one = steady(self.modes, drive, self.found.groups, near)
        done = histories.simulate(self.modes, drive, self.found.groups, 1.0, 1, np.inf, 0, None, one.start, one.memory)
        window, gauge = done.window, self.modes.gauge
        amplitude = one.amplitude if gauge is None else \
            half_swing(window.time, window.modal @ gauge, window.modal_rate @ gauge)
        values = {SHOWN["amplitude"]: amplitude, SHOWN["acceleration_peak"]: done.acceleration,
                  **wave_measures(*map(float, done.reading.waves))}
        values = {name: value for name, value in values.items() if value is not None}
        holds = Pieces(self.model, self.numerics, self.patch, self.found).sticks(done)
        outcome = Outcome.STUCK if holds else Outcome.STEADY
        return Shown(drive, values, exact_errors(values, one.error), _regime(one), _largest(one), _stable(one), outcome,
                     one.point)

    def curve(self, drive) -> tuple:
        """(points of the curve over the frequency, each found from the one before it, no folds)."""
        return traced(self.modes, drive, self.shown), ()


def _largest(one) -> float:
    return float(np.abs(one.multipliers).max(initial=0.0))


def _stable(one) -> bool:
    return is_stable(one.multipliers)


def _regime(one) -> str:
    return one.regime if _stable(one) else f"{one.regime}, unstable"
