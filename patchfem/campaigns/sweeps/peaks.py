"""Peaks of the response over a swept frequency: frequency, height and half-power width.

The peak is that of the parabola of 1/y^2 over f^2 through the largest value and its two neighbours,
which is exact for a single mode without friction. Its error combines the errors of these cases with
the differences from polynomials through more cases.
"""

from typing import NamedTuple

import numpy as np
from numpy.polynomial import Polynomial

from .sweep_table import SweepTable

FREQUENCY_KEY = "drive.frequency"
HEIGHT_MEASURES = ("relative_displacement_amplitude", "absolute_acceleration_peak")
MIN_FREQUENCIES = 5  # smallest number of frequencies in which a peak is sought
DIFFERENCE_FACTOR = 3.0  # safety factor of the differences between interpolating polynomials
N_NEWTON_STEPS = 3  # number of steps from a root that eigenvalues give to round-off
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
    if not np.isfinite(height).any() or frequency.size < MIN_FREQUENCIES:
        return None
    top = int(np.nanargmax(height))
    near = slice(top - 1, top + 2)
    if not 0 < top < frequency.size - 1 or np.isnan(height[near]).any() or height[top] <= 0:
        return None
    spacing = float(frequency[top + 1] - frequency[top - 1]) / 2

    # Parabola of 1/y^2 over f^2, and polynomials through more cases.
    square = frequency**2 - frequency[top] ** 2
    inverse = (height[top] / height) ** 2
    windows = [(1, 2), (2, 2), (1, 3), (2, 3)]
    minima = [_find_minimum(square, inverse, top, *window) for window in windows]
    known = np.array([minimum for minimum in minima if minimum is not None])
    if minima[0] is None:
        known = np.vstack([[0.0, 1.0], known.reshape(-1, 2)])
    frequencies = np.sqrt(frequency[top] ** 2 + known[:, 0])
    heights = height[top] / np.sqrt(known[:, 1])
    frequency_error = DIFFERENCE_FACTOR * np.ptp(frequencies)
    height_error = DIFFERENCE_FACTOR * np.ptp(heights)
    if len(known) < len(windows):  # a polynomial through other cases shows no peak here
        frequency_error += spacing
        height_error += heights[0] - height[near].min()

    # Frequencies at which the response falls to 1/sqrt(2) of the peak.
    level = 2 * known[0, 1]
    below = _find_crossing(square[top::-1], inverse[top::-1], level, frequency[top])
    above = _find_crossing(square[top:], inverse[top:], level, frequency[top])
    width = above[0] - below[0]
    # The errors of the heights shift each crossing by this fraction of the width.
    slack = np.nanmax(error[near]) / height[top] + height_error / heights[0]
    frequency_error += slack * (width if np.isfinite(width) else spacing)
    width_error = above[1] + below[1] + 2 * width * slack
    height_error += np.nanmax(error[near])
    numbers = (frequencies[0], frequency_error, heights[0], height_error, width, width_error)
    return SweptPeak(*map(float, numbers), spacing)


def _find_minimum(
    square: np.ndarray, inverse: np.ndarray, top: int, n_below: int, n_above: int
) -> tuple[float, float] | None:
    """Return place and value of the minimum of the polynomial through cases around the largest value.

    It is None if there are too few cases, or no minimum above 0 between the neighbours of `top`.

    Parameters
    ----------
    square : (m,) array
        Squares of the frequencies minus that of the case `top` [Hz^2].
    inverse : (m,) array
        (y_top / y)^2.
    top : int
        Index of the largest value.
    n_below, n_above : int
        The polynomial goes through the cases top - n_below to top + n_above - 1.
    """
    low = top - n_below
    window = slice(low, top + n_above)
    if low < 0 or top + n_above > square.size or np.isnan(inverse[window]).any():
        return None
    polynomial = Polynomial.fit(square[window], inverse[window], n_below + n_above - 1)
    slope = polynomial.deriv()
    roots = slope.roots()
    roots = roots[np.isreal(roots)].real
    for _ in range(
        N_NEWTON_STEPS
    ):  # eigenvalues are inexact where the highest coefficient is small
        roots = roots - slope(roots) / slope.deriv()(roots)
    roots = roots[(roots > square[top - 1]) & (roots < square[top + 1])]
    values = polynomial(roots)
    if not values.size or values.min() <= 0:
        return None
    return float(roots[values.argmin()]), float(values.min())


def _find_crossing(
    square: np.ndarray, inverse: np.ndarray, level: float, peak_frequency: float
) -> tuple[float, float]:
    """Return the frequency [Hz] at which 1/y^2 first reaches a level, and its error; NaN if it does not.

    It is the crossing of a parabola through both ends of the interval and a third case; the error comes
    from a second parabola, or from the straight line.

    Parameters
    ----------
    square : (m,) array
        Squares of the frequencies minus that of the peak case [Hz^2], from the peak outwards.
    inverse : (m,) array
        (y_top / y)^2.
    level : float
    peak_frequency : float
        Frequency of the peak case [Hz].
    """
    known = np.isfinite(inverse)
    square = square[known]
    inverse = inverse[known]
    above = np.flatnonzero(inverse >= level)
    if not above.size or above[0] == 0:
        return np.nan, np.nan
    k = int(above[0])
    ends = np.sort(square[k - 1 : k + 1])
    linear = np.interp(level, inverse[k - 1 : k + 1], square[k - 1 : k + 1])
    crossings = []
    for window in (slice(max(k - 2, 0), k + 1), slice(k - 1, k + 2)):
        if square[window].size == 3:
            roots = (Polynomial.fit(square[window], inverse[window], 2) - level).roots()
            roots = roots[np.isreal(roots)].real
            crossings += roots[(roots >= ends[0]) & (roots <= ends[1])].tolist()
    if len(crossings) < 2:
        crossings.append(float(linear))
    frequencies = np.sqrt(np.array(crossings) + peak_frequency**2)
    return float(frequencies[0]), DIFFERENCE_FACTOR * float(np.ptp(frequencies))
