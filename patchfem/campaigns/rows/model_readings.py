"""Instrument readings that a rig model predicts at the measured conditions."""

import numpy as np

from ...model.source import locate_errors
from ...response.spectrum import read_instrument
from ...runs.batch.motion_observer import MotionObserver
from ...runs.joint import solve_without_joint
from ..fits.problem import solve_contact
from .condition_models import GAIN_KEYS, ConditionModels


class ModelReadings:
    """Callable that computes the instrument readings of a rig for given free parameters.

    Each motion is continued from the motion for the previous parameters, which makes a descent
    fast. After `reset_motions` it starts from rest, so that the result does not depend on earlier
    evaluations.

    A call returns the acceleration reading [m s-2] and the displacement amplitude [m], (c,) each.
    They are NaN at conditions that were not requested, and infinite if no bounded motion exists.
    """

    def __init__(self, models: ConditionModels, say=None):
        self.models = models
        self.say = say
        self.patch = None
        self.last_motions = {}
        self.last_readings = (None, {})
        self.n_motions = 0
        instrument = models.instrument
        self.reading = ("peak", None)
        self.gains = (1.0, 1.0)
        if instrument is not None:
            self.reading = (instrument.reading, instrument.reading_cutoff)
            self.gains = (instrument.acceleration_gain, instrument.displacement_gain)
        keys = [bound.key for bound in models.ranges]
        self.free_gains = [keys.index(key) if key in keys else None for key in GAIN_KEYS]

    def reset_motions(self) -> None:
        """Discard the stored motions, so that the next computations start from rest."""
        self.last_motions = {}
        self.last_readings = (None, {})

    def predict(self, values, conditions) -> np.ndarray:
        """Predict the readings (2, c) with motions that start from rest."""
        self.reset_motions()
        return self(values, conditions)

    def __call__(self, values, conditions) -> np.ndarray:
        key_values = tuple(float(values[k]) for k in self.models.model_parameters)
        last_values, last_readings = self.last_readings
        readings = last_readings if last_values == key_values else {}
        missing = [k for k in conditions if k not in readings]
        if missing:
            readings = readings | self._compute_readings(values, missing)
            self.last_readings = key_values, readings
        out = np.full((2, len(self.models.rigs)), np.nan)
        for k in conditions:
            out[:, k] = readings[k]
        for row, gain, free in zip(out, self.gains, self.free_gains):
            row *= gain if free is None else values[free]
        return out

    def _compute_readings(self, values, conditions) -> dict:
        """Return the acceleration reading without gain and the displacement for each condition."""
        model = self.models.build_model(values)
        readings = {}
        with locate_errors(model.source):
            model, patch = self._solve_contact(model)
            needs_cycle = self.reading[0] not in ("peak", "fundamental")
            observer = MotionObserver(model, patch, self.say, needs_cycle)
            for k in conditions:
                self.n_motions += 1
                if not observer.finds_periodic_motion:
                    model_at_k = self.models.with_condition_drive(model, k)
                    observer = MotionObserver(model_at_k, patch, self.say, needs_cycle)
                drive = self.models.sine_drive(k)
                motion = observer(drive, self.last_motions.get(k))
                if motion is None:
                    self.last_motions.pop(k, None)
                    readings[k] = np.inf, np.inf
                    continue
                self.last_motions[k] = motion.initial_guess
                readings[k] = self._read_accelerometer(motion, drive), motion.displacement
        return readings

    def _read_accelerometer(self, motion, drive) -> float:
        """Return the accelerometer reading of a motion before its gain is applied [m s-2]."""
        if self.reading[0] == "fundamental" and motion.fundamental is not None:
            return abs(motion.fundamental)
        return read_instrument(motion.window, drive, motion.acceleration, *self.reading)

    def _solve_contact(self, model) -> tuple:
        """Return a model without the joint of bolted modes, and its solved patch; None for a [normal] contact.

        The contact is solved again only if a free parameter changes it.
        """
        if model.has_bolted_patch:
            model, patches, _ = solve_without_joint(model)
            return model, patches[0]
        return model, self._get_solved_patch(model)

    def _get_solved_patch(self, model):
        """Return the solved patch of a model whose modes are those without the joint."""
        if model.patch is None:
            return None
        if self.patch is None or self.models.changes_contact:
            self.patch = solve_contact(model)
        return self.patch
