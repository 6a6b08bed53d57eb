"""Peaks of the response over a swept frequency: frequency, height and half-power width.

The peak is that of a spline of 1/y^2 over f^2, which is exact for a single mode without friction. Its error combines
the errors of the largest cases with the differences from splines of other degrees.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly, make_interp_spline

from .sweep_table import SweepTable

FREQUENCY_KEY = "drive.frequency"
HEIGHT_MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak")
MIN_FREQUENCIES = 5  # smallest number of frequencies in which a peak is sought
DEGREES = (3, 2, 4, 5)  # degrees of the splines, of which the first gives the peak
DIFFERENCE_FACTOR = 3.0  # safety factor of the differences between the splines
MAX_STEADY_ERROR = 0.01  # largest relative error of a steady estimate that counts as a height


class SweptPeak(NamedTuple):
    """Peak of a response curve, with errors; the width is NaN if the cases do not show it.

    Attributes
    ----------
    frequency, frequency_error : float
        [Hz]
    height, height_error : float
        In the unit of the measure.
    width, width_error : float
        Half-power width [Hz].
    spacing : float
        Mean distance to the neighbouring cases [Hz].
    """

    frequency: float
    frequency_error: float
    height: float
    height_error: float
    width: float
    width_error: float
    spacing: float


class PeakOnLine(NamedTuple):
    """Peak of a measure, and the first case of its curve, which has the values of the other keys."""

    measure: str
    case: int
    peak: SweptPeak


def find_peaks(table: SweepTable) -> list[PeakOnLine]:
    """Find the peak over a swept drive frequency for each combination of the other keys.

    Combinations without a peak between two cases that count have no entry.
    """
    axes = [axis for axis, key in enumerate(table.keys) if key.key == FREQUENCY_KEY]
    names = [name for name in HEIGHT_MEASURES if name in table.measures]
    if not axes or not names or not table.is_grid:
        return []
    heights, errors = _find_heights(table, names[0])

    peaks = []
    for line in table.split_lines(axes[0]):
        frequency = table.keys[axes[0]].values[line]
        line = line[np.argsort(frequency)]
        peak = locate_peak(np.sort(frequency), heights[line], errors[line])
        if peak is not None:
            peaks.append(PeakOnLine(names[0], int(line[0]), peak))
    return peaks


def _find_heights(table: SweepTable, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the heights (n,) of a response with their errors (n,); NaN where a case does not count.

    For a case that did not settle it is the steady estimate if that is exact enough.
    """
    heights = table.select_trusted(name)
    errors = np.nan_to_num(table.measures[name].errors)
    steady = table.measures.get(f"{name}_steady")
    if steady is None:
        return heights, errors
    is_used = np.isnan(heights) & (steady.errors <= MAX_STEADY_ERROR * np.abs(steady.values))
    return np.where(is_used, steady.values, heights), np.where(is_used, steady.errors, errors)


def locate_peak(frequency: np.ndarray, height: np.ndarray, error: np.ndarray) -> SweptPeak | None:
    """Locate the peak of a response curve.

    Parameters
    ----------
    frequency : (m,) array
        Increasing [Hz].
    height, error : (m,) array
        Response and its error; NaN for a case that does not count.

    Returns
    -------
    SweptPeak or None
        None if the largest value is at an end, or if a neighbour of it does not count.
    """
    known = height > 0
    if known.sum() < MIN_FREQUENCIES:
        return None
    top = int(np.nanargmax(height))
    near = slice(top - 1, top + 2)
    if not 0 < top < frequency.size - 1 or not known[near].all():
        return None
    spacing = float(frequency[top + 1] - frequency[top - 1]) / 2

    # splines of 1/y^2 over f^2 - f_top^2
    square = frequency**2 - frequency[top] ** 2
    inverse = (height[top] / height[known]) ** 2
    rows = [(0.0, 1.0, np.nan, np.nan)]
    degrees = [degree for degree in DEGREES if degree < known.sum()]
    for degree in degrees:
        spline = PPoly.from_spline(make_interp_spline(square[known], inverse, degree))
        rows += _read_minimum(spline, square[top - 1], square[top + 1])
    if len(rows) > 1:
        del rows[0]
    place, minimum, below, above = np.array(rows).T
    frequencies = np.sqrt(frequency[top] ** 2 + place)
    heights = height[top] / np.sqrt(minimum)
    widths = np.sqrt(frequency[top] ** 2 + above) - np.sqrt(frequency[top] ** 2 + below)
    errors = [DIFFERENCE_FACTOR * np.ptp(values) for values in (frequencies, heights, widths)]
    if len(rows) < len(degrees):  # a spline shows no peak here
        errors[0] += spacing
        errors[1] += heights[0] - height[near].min()

    # The errors of the heights shift each half-power frequency by this fraction of the width.
    largest_error = np.max(error[near])
    slack = largest_error / height[top] + errors[1] / heights[0]
    errors[0] += slack * (widths[0] if np.isfinite(widths[0]) else spacing)
    errors[1] += largest_error
    errors[2] += 2 * widths[0] * slack
    numbers = np.stack([(frequencies[0], heights[0], widths[0]), errors], axis=1)
    return SweptPeak(*numbers.ravel().tolist(), spacing)


def _read_minimum(spline: PPoly, low: float, high: float) -> list[tuple]:
    """Return the minimum of a spline between two places, and the places beside it with twice its value.

    Returns
    -------
    list of tuple
        A tuple (place, minimum, below, above), whose last ones are NaN where the spline does not rise that far; empty
        without a minimum above 0.
    """
    roots = spline.derivative().roots(extrapolate=False)
    roots = roots[(roots > low) & (roots < high)]
    minimum = spline(roots).min(initial=np.inf)
    if not 0 < minimum < np.inf:
        return []
    place = roots[spline(roots).argmin()]
    crossings = spline.solve(2 * minimum, extrapolate=False)
    below = crossings[crossings < place].max(initial=-np.inf)
    above = crossings[crossings > place].min(initial=np.inf)
    ends = (end if np.isfinite(end) else np.nan for end in (below, above))
    return [(place, minimum, *ends)]
