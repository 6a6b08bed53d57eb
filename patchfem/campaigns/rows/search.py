"""Residual of a fit to rows, and the settings of its search from random starting points."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .cells import Readings
from .checkpoint import SearchCheckpoint
from .model_readings import ModelReadings

# Treatments of a reading flagged U (unstable): as a lower bound, excluded, or as any other.
UNSTABLE = ("bound", "out", "read")


@dataclass(frozen=True, eq=False, slots=True)
class SearchSettings:
    """Settings of a search from random starting points.

    Attributes
    ----------
    starts : int
        Number of random starting points.
    seed : int
        Seed of the random numbers.
    unstable : str
        Treatment of readings flagged U, one of UNSTABLE.
    checkpoint : SearchCheckpoint or None
        Finished descents, which are not repeated.
    """

    starts: int = 8
    seed: int = 0
    unstable: str = "bound"
    checkpoint: SearchCheckpoint | None = None


def make_residual(
    readings: Readings, model_readings: ModelReadings, training, unstable: str
) -> Callable:
    """Return the function that computes the log ratios of selected readings from free parameters.

    Parameters
    ----------
    readings : Readings
    model_readings : ModelReadings
    training : (n,) bool
        Mask of the readings in the residual.
    unstable : str
        Treatment of readings flagged U. "bound": such a reading is a lower bound, because the
        motion was still growing, so that only a smaller computed value gives a residual; "out":
        the reading is excluded; "read": it is treated like any other reading.
    """
    is_used = training & ~readings.unstable if unstable == "out" else training
    conditions = sorted(set(readings.condition[is_used].tolist()))
    is_lower_bound = (
        readings.unstable[is_used] if unstable == "bound" else np.zeros(int(is_used.sum()), bool)
    )

    def residual(values):
        """Return the log ratios (r,) of computed to measured readings for parameters (n,)."""
        logs = readings.compute_log_ratios(*model_readings(values, conditions))[is_used]
        return np.where(is_lower_bound, np.minimum(logs, 0.0), logs)

    return residual
