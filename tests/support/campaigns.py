"""Rows of random campaigns: stated errors beside the differences from references.

A stated error *holds* if it is at least as large as the difference from the reference.
"""

from typing import NamedTuple

import numpy as np

FLOOR_FRACTION = 1e-3  # Smaller differences, relative to the floor of a measure, do not count.
ROUND_OFF = 1e-9  # Smaller differences, relative to the value, do not count.


class Row(NamedTuple):
    """Measure of a scene beside its reference value; `doubt` is the uncertainty of the reference itself."""

    name: str
    value: float
    error: float
    floor: float
    truth: float
    doubt: float

    @property
    def true_error(self) -> float:
        """Absolute difference from the reference; a phase is compared modulo pi."""
        gap = abs(self.truth - self.value)
        if self.name == "slip_start_phase":
            return min(gap, abs(np.pi - gap))
        return gap

    @property
    def holds(self) -> bool:
        """Whether the stated error is at least the true error minus the uncertainty of the reference."""
        ignored = max(FLOOR_FRACTION * self.floor, ROUND_OFF * abs(self.value))
        return self.true_error <= self.error + self.doubt + ignored


def measure_rows(measures, truths: dict, doubts: dict) -> list[Row]:
    """Return a row for each measure of a result that has a value, an error and a reference value.

    Parameters
    ----------
    measures : mapping of name to Measure
    truths, doubts : dict
        Reference values and their own uncertainties by name.
    """
    return [
        Row(name, measure.value, measure.error, measure.floor, truths[name], doubts.get(name, 0.0))
        for name, measure in measures.items()
        if name in truths and None not in (measure.value, measure.error)
    ]


def strip_number(name: str) -> str:
    """Return the name of a measure without the number of its interface."""
    head, _, number = name.rpartition("_")
    return head if number.isdigit() else name
