"""Peaks of the response over a swept frequency: frequency, height and half-power width.

The peak is the minimum of a cubic spline of 1/y^2 over f^2, which is a parabola for a single mode without friction. Its
error combines the errors of the cases with the differences from splines of other degrees and from polynomials through
the cases next to the largest one.
"""

from typing import NamedTuple

import numpy as np
from scipy.interpolate import PPoly, make_interp_spline

from .sweep_table import SweepTable

FREQUENCY_KEY = "drive.frequency"
# Measures in which a resonance peak is sought. The first one that a sweep has is used.
HEIGHT_MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak")
MIN_SWEPT_FREQUENCIES = 5  # smallest number of frequencies in which a peak is sought
ERROR_SAFETY_FACTOR = 3.0  # safety factor of the differences between interpolating curves
SPLINE_DEGREES = (3, 2, 4)  # splines through all cases, the best one first
# Numbers of cases below and above the largest one through which a polynomial goes; a kink changes it most.
CASE_COUNTS_AROUND_PEAK = ((1, 1), (2, 1), (1, 2))


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
    """Peak of a measure over a swept frequency, and the first case of its curve, which has the values of the other keys."""

    measure: str
    case: int
    peak: SweptPeak


def find_peaks(table: SweepTable) -> list[PeakOnLine]:
    """Find the peak over a swept drive frequency in a table for each combination of other keys.

    Combinations without a peak between two cases that count have no entry.
    """
    axes = [axis for axis, key in enumerate(table.keys) if key.key == FREQUENCY_KEY]
    names = [name for name in HEIGHT_MEASURES if name in table.measures]
    if not axes or not names or not table.is_grid:
        return []
    column = table.select_trusted(names[0])
    errors = np.nan_to_num(column.errors)

    peaks = []
    for line in table.split_lines(axes[0]):
        frequency = table.keys[axes[0]].values[line]
        line = line[np.argsort(frequency)]
        peak = locate_peak(np.sort(frequency), column.values[line], errors[line])
        if peak is not None:
            peaks.append(PeakOnLine(names[0], int(line[0]), peak))
    return peaks


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
    counts = np.isfinite(height)
    if np.count_nonzero(counts) < MIN_SWEPT_FREQUENCIES:
        return None
    top = int(np.nanargmax(height))
    near = slice(top - 1, top + 2)
    if not 0 < top < frequency.size - 1 or not counts[near].all() or height[top] <= 0:
        return None
    spacing = (frequency[top + 1] - frequency[top - 1]) / 2

    # 1/y^2 over f^2, relative to the largest value: for the displacement of a single linear mode it is a parabola, which
    # every curve below reproduces. The differences between the curves show the error of interpolation.
    square = frequency**2 - frequency[top] ** 2
    inverse = (height[top] / height) ** 2
    curves = [make_interp_spline(square[counts], inverse[counts], k) for k in SPLINE_DEGREES]
    for n_below, n_above in CASE_COUNTS_AROUND_PEAK:
        window = slice(max(top - n_below, 0), top + n_above + 1)
        if counts[window].all() and counts[window].size == n_below + n_above + 1:
            degree = n_below + n_above
            curves.append(make_interp_spline(square[window], inverse[window], degree))

    # Place, height and half-power width of the peak by each curve. The first curve gives the values.
    shapes = [_find_shape(PPoly.from_spline(curve), square[near]) for curve in curves]
    known = np.array(list(filter(None, shapes)) or [_PeakShape(0.0, 1.0, np.nan, np.nan)])
    frequencies = np.sqrt(frequency[top] ** 2 + known[:, [0, 2, 3]])
    heights = height[top] / np.sqrt(known[:, 1])
    widths = frequencies[:, 2] - frequencies[:, 1]

    # Errors by the differences between the curves, and by the errors of the heights
    width = widths[0]
    frequency_error = _estimate_error(frequencies[:, 0])
    height_error = _estimate_error(heights)
    if len(known) < len(shapes):  # a curve through other cases shows no peak here
        frequency_error += spacing
        height_error += heights[0] - height[near].min()
    # The errors of the heights shift each crossing of the half-power level by this fraction of the width.
    slack = np.nanmax(error[near]) / height[top] + height_error / heights[0]
    frequency_error += slack * (width if np.isfinite(width) else spacing)
    width_error = _estimate_error(widths) + 2 * width * slack
    height_error += np.nanmax(error[near])
    return SweptPeak(
        frequencies[0, 0], frequency_error, heights[0], height_error, width, width_error, spacing
    )


def _estimate_error(values: np.ndarray) -> float:
    """Return the error of the first of several estimates (n,): a factor times their largest difference from it.

    It is NaN if the first estimate is not known.
    """
    return ERROR_SAFETY_FACTOR * np.nanmax(np.abs(values - values[0]), initial=0.0) + 0 * values[0]


class _PeakShape(NamedTuple):
    """Minimum of the curve of 1/y^2, where y is the response over its largest value at the frequency f_top.

    - place: f^2 - f_top^2 at the minimum [Hz^2].
    - inverse_square: 1/y^2 at the minimum [1].
    - below, above: f^2 - f_top^2 [Hz^2] at which 1/y^2 is twice as large on either side; NaN if there is no such place.
    """

    place: float
    inverse_square: float
    below: float
    above: float


def _find_shape(curve: PPoly, near: np.ndarray) -> _PeakShape | None:
    """Return the minimum of a curve of 1/y^2, where y is the response over its largest value at the frequency f_top.

    Parameters
    ----------
    curve : PPoly
        1/y^2 as a function of f^2 - f_top^2 [Hz^2].
    near : (3,) array
        f^2 - f_top^2 [Hz^2] of the lower neighbour of the largest value, of this value (0), and of its upper neighbour.

    Returns
    -------
    _PeakShape or None
        None if the curve has no minimum between both neighbours, or is not positive there.
    """
    places = curve.derivative().roots(extrapolate=False)
    places = places[(places > near[0]) & (places < near[2])]
    values = curve(places)
    if not values.size or values.min() <= 0:
        return None
    place = places[values.argmin()]
    inverse_square = values.min()
    crossings = curve.solve(2 * inverse_square, extrapolate=False)
    below = np.max(crossings[crossings < place], initial=-np.inf)
    above = np.min(crossings[crossings > place], initial=np.inf)
    return _PeakShape(
        place, inverse_square, *(end if np.isfinite(end) else np.nan for end in (below, above))
    )
