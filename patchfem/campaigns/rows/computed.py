"""Computed instrument readings of a rig at measured conditions, by free parameters."""

import numpy as np

from ...model.source import locate_errors
from ...response.spectrum import read_instrument
from ...runs.batch.watched import MotionObserver
from ..fits.problem import press_patch
from .condition_models import GAIN_KEYS, ConditionModels


class ModelReadings:
    """Function that computes instrument readings of a rig for given free parameters.

    It starts a motion from that of the previous parameters, so that a descent is fast. After
    `forget` it starts from rest, so that the result does not depend on earlier evaluations.

    A call returns the acceleration reading [m s-2] and the displacement amplitude [m], (c,) each:
    NaN at conditions that were not requested, and infinite if no bounded motion is found.
    """

    def __init__(self, models: ConditionModels, say=None):
        self.models = models
        self.say = say
        self.patch = None
        self.last_motions = {}
        self.last_readings = (None, {})
        self.observer = None
        self.n_motions = 0
        instrument = models.read
        self.reading = ("peak", None)
        self.gains = (1.0, 1.0)
        if instrument is not None:
            self.reading = (instrument.reading, instrument.reading_cutoff)
            self.gains = (instrument.acceleration_gain, instrument.displacement_gain)
        keys = [bound.key for bound in models.ranges]
        self.free_gains = [keys.index(key) if key in keys else None for key in GAIN_KEYS]

    def forget(self) -> None:
        """Start the next motions from rest."""
        self.last_motions = {}
        self.last_readings = (None, {})

    def __call__(self, values, conditions) -> tuple:
        inner = tuple(float(values[k]) for k in self.models.inner)
        last_values, last_readings = self.last_readings
        readings = last_readings if last_values == inner else {}
        missing = [k for k in conditions if k not in readings]
        if missing:
            readings = readings | self._run(values, missing)
            self.last_readings = inner, readings
        out = np.full((2, len(self.models.rigs)), np.nan)
        for k in conditions:
            out[:, k] = readings[k]
        for row, gain, free in zip(out, self.gains, self.free_gains):
            row *= gain if free is None else values[free]
        return out

    def _run(self, values, conditions) -> dict:
        """Return acceleration reading without gain and displacement, by condition."""
        model = self.models.model(values)
        readings = {}
        with locate_errors(model.source):
            patch = self._get_patch(model)
            needs_cycle = self.reading[0] not in ("peak", "fundamental")
            observer = MotionObserver(model, patch, self.say, needs_cycle, self.observer)
            self.observer = observer
            for k in conditions:
                self.n_motions += 1
                if not observer.by:
                    model_at_k = self.models.at(model, k)
                    observer = MotionObserver(model_at_k, patch, self.say, needs_cycle)
                drive = self.models.sine(k)
                motion = observer(drive, self.last_motions.get(k))
                if motion is None:
                    self.last_motions.pop(k, None)
                    readings[k] = np.inf, np.inf
                    continue
                self.last_motions[k] = motion.near
                readings[k] = self._read_accelerometer(motion, drive), motion.displacement
        return readings

    def _read_accelerometer(self, motion, drive) -> float:
        """Return the accelerometer reading of a motion [m s-2] without its gain."""
        if self.reading[0] == "fundamental" and motion.fundamental is not None:
            return abs(motion.fundamental)
        return read_instrument(motion.window, drive, motion.acceleration, *self.reading)

    def _get_patch(self, model):
        """Return the solved contact patch of a model; None for a [normal] contact.

        It is pressed only once if no free key changes it.
        """
        if model.patch is None:
            return None
        if self.patch is None or self.models.moves_pieces:
            self.patch = press_patch(model)
        return self.patch
