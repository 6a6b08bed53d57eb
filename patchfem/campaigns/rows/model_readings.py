"""Instrument readings that a rig model predicts at the measured conditions."""

from collections.abc import Callable, Iterable, Sequence

import numpy as np

from ...measures.spectrum import read_instrument
from ...model.model import Model
from ...model.source import locate_errors
from ...runs.batch.motion_observer import MotionObserver
from ...runs.joint import solve_without_joint
from ..free_keys import solve_contact
from .condition_models import GAIN_KEYS, ConditionModels


class ModelReadings:
    """Instrument readings (2, c) of a rig as a function of the values of its free keys.

    A call returns the acceleration reading [m s-2] and the displacement amplitude [m] at each condition. They are NaN at
    conditions that were not requested, and infinite if no bounded motion exists. Each motion is continued from the motion
    for the previous values, which makes a descent fast. After `reset_motions` it starts from rest, so that the result does
    not depend on earlier evaluations.

    Parameters
    ----------
    models : ConditionModels
        Models of the rig at the measured conditions.
    say : callable, optional
        Called with a line of text before code is compiled.
    """

    def __init__(self, models: ConditionModels, say: Callable | None = None):
        self.models = models
        self.say = say
        self.patch = None
        self.n_motions = 0
        self.reset_motions()
        instrument = models.base.scene.measured
        self.reading = ("peak", None)
        self.gains = (1.0, 1.0)
        if instrument is not None:
            self.reading = (instrument.reading, instrument.reading_cutoff)
            self.gains = (instrument.acceleration_gain, instrument.displacement_gain)
        keys = [bound.key for bound in models.ranges]
        self.free_gains = [keys.index(key) if key in keys else None for key in GAIN_KEYS]

    def reset_motions(self) -> None:
        """Discard the stored motions, so that the next computations start from rest."""
        self.last_motions: dict[int, object] = {}
        self.last_values: tuple[float, ...] = ()
        self.last_readings: dict[int, tuple[float, float]] = {}

    def __call__(self, values: Sequence[float], conditions: Iterable[int]) -> np.ndarray:
        """Return acceleration [m s-2] and displacement [m] readings (2, c) for values of the free keys.

        `conditions` are the indices of those that are computed, and the others are NaN. Readings of the last values are
        kept.
        """
        # the gains do not change the motion
        key_values = tuple(float(values[k]) for k in self.models.model_parameters)
        if key_values != self.last_values:
            self.last_values = key_values
            self.last_readings = {}
        missing = [k for k in conditions if k not in self.last_readings]
        if missing:
            self.last_readings |= self._compute_readings(values, missing)
        out = np.full((2, len(self.models.rigs)), np.nan)
        for k in conditions:
            out[:, k] = self.last_readings[k]
        for row, gain, free in zip(out, self.gains, self.free_gains):
            row *= gain if free is None else values[free]
        return out

    def _compute_readings(self, values, conditions) -> dict[int, tuple[float, float]]:
        """Return the acceleration reading without gain [m s-2] and the displacement [m] by condition.

        `values` are those of the free keys, and `conditions` the indices of the conditions. A motion that is not
        bounded has infinite readings.
        """
        model = self.models.build_model(values)
        needs_cycle = self.reading[0] not in ("peak", "fundamental")
        readings = {}
        with locate_errors(model.source):
            model, patch = self._solve_contact(model)
            observer = MotionObserver(model, patch, self.say, needs_cycle)
            for k in conditions:
                self.n_motions += 1
                if not observer.finds_periodic_motion:
                    driven = self.models.with_condition_drive(model, k)
                    observer = MotionObserver(driven, patch, self.say, needs_cycle)

                # a motion begins at the last one under the same drive; without a bounded one the readings are infinite
                drive = self.models.rigs[k].drive.signal
                motion = observer(drive, self.last_motions.get(k))
                if motion is None:
                    self.last_motions.pop(k, None)
                    readings[k] = np.inf, np.inf
                    continue
                self.last_motions[k] = motion.initial_guess
                acceleration = motion.fundamental
                if self.reading[0] != "fundamental" or acceleration is None:
                    acceleration = read_instrument(
                        motion.window, drive, motion.acceleration, *self.reading
                    )
                readings[k] = acceleration, motion.displacement
        return readings

    def _solve_contact(self, model: Model) -> tuple[Model, object]:
        """Return a model without the joint of bolted modes, and its solved patch; None for a [normal] contact.

        The contact is solved again only if a free key changes it.
        """
        if model.has_bolted_patch:
            model, patches, _ = solve_without_joint(model)
            return model, patches[0]
        if model.patch is not None and (self.patch is None or self.models.changes_contact):
            self.patch = solve_contact(model)
        return model, self.patch
