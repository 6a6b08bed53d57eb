"""Readings of the instruments of a rig at the measured conditions, by the free values."""

import numpy as np

from ...model.source import locate_errors
from ...response.spectrum import read_instrument
from ...runs.batch.watched import MotionObserver
from ..fits.problem import press_patch
from .asked import READINGS, ConditionModels


class ModelReadings:
    """Readings of the models of a ConditionModels, as a function of values (n,) and conditions.

    A motion starts from the motion of the values before, so that a descent is fast. After `forget`
    it starts from rest, so that the result does not depend on earlier evaluations.

    A call returns the acceleration reading [m s-2] and the displacement amplitude [m], (c,) each:
    NaN at conditions that were not requested, and infinite if no bounded motion is found.
    """

    def __init__(self, asked: ConditionModels, say=None):
        self.asked = asked
        self.say = say
        self.patch = None
        self.near = {}
        self.last = (None, {})
        self.watcher = None
        self.runs = 0
        read_as = asked.read
        self.reading = (
            ("peak", None) if read_as is None else (read_as.reading, read_as.reading_cutoff)
        )
        self.gains = (
            (1.0, 1.0)
            if read_as is None
            else (read_as.acceleration_gain, read_as.displacement_gain)
        )
        keys = [one.key for one in asked.wanted]
        self.free_gains = [keys.index(key) if key in keys else None for key in READINGS]
        self.warm = True

    def forget(self) -> None:
        """Let the next motions start from rest."""
        self.near = {}
        self.last = (None, {})

    def __call__(self, values, conditions) -> tuple:
        count = len(self.asked.rigs)
        inner = tuple(float(values[k]) for k in self.asked.inner)
        known = self.last[1] if self.last[0] == inner else {}
        if any(k not in known for k in conditions):
            known = known | self._run(values, [k for k in conditions if k not in known])
            self.last = inner, known
        out = np.full((2, count), np.nan)
        for k in conditions:
            out[:, k] = known[k]
        for row, gain, free in zip(out, self.gains, self.free_gains):
            row *= gain if free is None else values[free]
        return out

    def _run(self, values, conditions) -> dict:
        """Return, by condition, the acceleration reading without its gain and the displacement."""
        model = self.asked.model(values)
        found = {}
        with locate_errors(model.source):
            patch = self._get_patch(model)
            whole = self.reading[0] not in ("peak", "fundamental")
            watcher = self.watcher = MotionObserver(model, patch, self.say, whole, self.watcher)
            for k in conditions:
                self.runs += 1
                if not watcher.by:
                    watcher = MotionObserver(self.asked.at(model, k), patch, self.say, whole)
                seen = watcher(self.asked.sine(k), self.near.get(k) if self.warm else None)
                if seen is None:
                    self.near.pop(k, None)
                    found[k] = np.inf, np.inf
                    continue
                self.near[k] = seen.near
                found[k] = self._read_accelerometer(seen, self.asked.sine(k)), seen.displacement
        return found

    def _read_accelerometer(self, seen, drive) -> float:
        """Return the reading of the accelerometer [m s-2] without its gain."""
        if self.reading[0] == "fundamental" and seen.fundamental is not None:
            return abs(seen.fundamental)
        return read_instrument(seen.window, drive, seen.acceleration, *self.reading)

    def _get_patch(self, model):
        """Return the pressed patch of a model; None for a [normal] contact.

        It is pressed only once if no free key changes it.
        """
        if model.patch is None:
            return None
        if self.patch is None or self.asked.moves_pieces:
            self.patch = press_patch(model)
        return self.patch
