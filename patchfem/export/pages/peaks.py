"""Peaks of the response as a function of a swept frequency: frequency, height and half-power width.

There is one peak for each combination of the values of the other keys.
"""

from collections.abc import Callable
from html import escape
from typing import NamedTuple

import numpy as np

from ...formatting import format_number, format_value
from ..written import measure_label
from . import document
from .key_lines import group_cases_along_key, is_varied, key_formatter
from .sentences import format_zero, measure_link

KEYS = ("drive.frequency",)
HEIGHTS = ("relative_displacement_amplitude", "absolute_acceleration_peak")
MIN_FREQUENCIES = 5  # smallest number of frequencies in which a peak is sought
# Safety factor by which the differences between interpolating polynomials are multiplied.
ERROR_FACTOR = 3.0
# Number of Newton steps to a maximum or a crossing of the interpolating polynomial.
N_NEWTON_STEPS = 30
OPEN = "not resolved by these cases"
# Largest relative error at which a steady-state estimate is used as the height of the curve.
MAX_STEADY_ERROR = 0.01


class Estimate(NamedTuple):
    """Value with its error; the value is NaN if it is unknown."""

    value: float
    error: float

    def is_known(self) -> bool:
        """Return whether there is a value."""
        return bool(np.isfinite(self.value))


UNKNOWN = Estimate(np.nan, np.nan)


class SweptPeak(NamedTuple):
    """Peak of a response curve along one line of cases.

    Attributes
    ----------
    frequency : Estimate
        [Hz]; unknown if the cases next to the largest value do not count.
    case_spacing : float
        Mean distance to the two neighbouring cases [Hz].
    height : Estimate
        In SI.
    half_power_width : Estimate
        [Hz]; unknown if the curve stays above peak/sqrt(2) on one side, or falls too fast for these
        cases.
    falls_unresolved : bool
        Whether the curve falls to peak/sqrt(2) on both sides, but so fast that the cases do not
        show its width.
    """

    frequency: Estimate
    case_spacing: float
    height: Estimate
    half_power_width: Estimate
    falls_unresolved: bool


class Peak(NamedTuple):
    """Peak of a response curve with its measure, its unit and the values of the other keys."""

    name: str
    fixed_values: str
    unit: str
    swept: SweptPeak


def find_peaks(keys: list, measures: dict, trusted: dict, grid: bool) -> list:
    """Find the peak of each response curve as a function of a swept frequency.

    Parameters
    ----------
    keys : list of dict
    measures : dict
    trusted : dict
    grid : bool
        All as for `limits.find_limits`.

    Returns
    -------
    list of Peak
    """
    key = next(
        (candidate for candidate in keys if candidate["name"] in KEYS and not candidate["words"]),
        None,
    )
    name = next((candidate for candidate in HEIGHTS if candidate in measures), None)
    if key is None or name is None or (len(keys) > 1 and not grid):
        return []
    other_keys = [candidate for candidate in keys if candidate is not key and is_varied(candidate)]
    formatters = [_case_formatter(other) for other in other_keys]
    height, error = _peak_heights(name, measures, trusted)
    peaks = []
    for line in group_cases_along_key(key, other_keys):
        swept_peak = _find_swept_peak(
            np.asarray(key["values"], float)[line], height[line], error[line]
        )
        if swept_peak is not None:
            other_values = ", ".join(
                f"{other['name']} {format_case(line[0])}"
                for other, format_case in zip(other_keys, formatters)
            )
            peaks.append(Peak(name, other_values, measures[name][2], swept_peak))
    return peaks


def _case_formatter(key: dict) -> Callable[[int], str]:
    """Return a function that formats the value of a key in a case."""
    if key["words"]:
        return lambda case: str(key["texts"][case])
    return key_formatter(key)


def _peak_heights(name: str, measures: dict, trusted: dict) -> tuple:
    """Return the values (n,) of a measure in the cases, with their errors, as heights of a peak.

    For a case that did not settle it is the steady estimate, if its relative error is at most
    MAX_STEADY_ERROR; else NaN.
    """
    (value, error, _), steady = measures[name], measures.get(f"{name}_steady")
    value = np.asarray(value, float)
    error = np.nan_to_num(np.asarray(error, float))
    if steady is None:
        return np.where(trusted[name], value, np.nan), error
    is_estimated = np.asarray(steady[1], float) <= MAX_STEADY_ERROR * np.abs(steady[0])
    return (
        np.where(trusted[name], value, np.where(is_estimated, steady[0], np.nan)),
        np.where(trusted[name], error, np.asarray(steady[1], float)),
    )


def _find_swept_peak(
    frequency: np.ndarray, height: np.ndarray, error: np.ndarray
) -> SweptPeak | None:
    """Find the peak of a response curve; None if its largest value is at an end of the frequency range.

    The peak is that of the parabola of 1/y^2 over f^2, which is exact for a single mode, through
    the largest value and its neighbours. Its error combines those of the cases with the differences
    from polynomials through more cases.

    Parameters
    ----------
    frequency : (m,) array
        Increasing [Hz].
    height, error : (m,) array
        In SI; NaN if a case does not count.
    """
    is_valid = np.isfinite(height) & (height > 0)
    x = frequency[is_valid]
    y = height[is_valid]
    peak_index = int(np.argmax(y)) if y.size >= MIN_FREQUENCIES else 0
    if not 0 < peak_index < y.size - 1:
        return None
    if not is_valid[np.flatnonzero(is_valid)[peak_index] + np.array([-1, 1])].all():
        return SweptPeak(UNKNOWN, np.nan, UNKNOWN, UNKNOWN, False)
    spacing = float(x[peak_index + 1] - x[peak_index - 1]) / 2
    case_error = float(np.nanmax(error[is_valid][peak_index - 1 : peak_index + 2]) / y[peak_index])
    square = x**2 - x[peak_index] ** 2
    g = (y[peak_index] / y) ** 2
    at, minimum = _find_minimum(square, g, peak_index, peak_index - 1, peak_index + 2) or (0.0, 1.0)
    windows = (
        (peak_index - 2, peak_index + 2),
        (peak_index - 1, peak_index + 3),
        (peak_index - 2, peak_index + 3),
    )
    other_estimates = [
        _find_minimum(square, g, peak_index, low, high)
        for low, high in windows
        if low >= 0 and high <= y.size
    ]
    agreeing = [result for result in other_estimates if result]
    peak_squares = np.sqrt(x[peak_index] ** 2 + np.array([at, *(place for place, _ in agreeing)]))
    heights = y[peak_index] * np.array([minimum, *(value for _, value in agreeing)]) ** -0.5
    # A polynomial through other cases has no maximum in this interval.
    unchecked = len(agreeing) < len(other_estimates) or not other_estimates
    peak = float(heights[0])
    height_error = ERROR_FACTOR * float(np.ptp(heights))
    frequency_error = ERROR_FACTOR * float(np.ptp(peak_squares))
    if unchecked:
        height_error += peak * (1 - (y[peak_index - 1 : peak_index + 2] / peak).min())
        frequency_error += spacing
    below, above = (
        _find_crossing(
            square[peak_index::step],
            g[peak_index::step],
            x[peak_index],
            (y[peak_index] / peak) ** 2,
        )
        for step in (-1, 1)
    )
    width = float(above.value - below.value)
    fallen = frequency[height <= peak / 2**0.5]
    falls = bool(np.isnan(width) and fallen.size and fallen.min() < x[peak_index] < fallen.max())
    # The errors of the heights shift each crossing by this fraction of the width.
    slack = case_error + height_error / peak
    frequency_error += slack * (width if np.isfinite(width) else spacing)
    return SweptPeak(
        frequency=Estimate(float(peak_squares[0]), frequency_error),
        case_spacing=spacing,
        height=Estimate(peak, height_error + case_error * peak),
        half_power_width=Estimate(width, below.error + above.error + 2 * width * slack),
        falls_unresolved=falls,
    )


def _find_minimum(
    square: np.ndarray, g: np.ndarray, peak_index: int, low: int, high: int
) -> tuple | None:
    """Find the minimum of the polynomial that interpolates 1/y^2 against f^2 in some cases.

    Parameters
    ----------
    square : (m,) array
        Squares of the frequencies minus that of the case `peak_index` [Hz2].
    g : (m,) array
        (y_top / y)^2.
    peak_index : int
        Index of the largest value.
    low, high : int
        The polynomial goes through the cases from `low` to `high` - 1.

    Returns
    -------
    tuple or None
        Position and value of the minimum; None if there is no minimum above 0 between the
        neighbours of `peak_index`.
    """
    polynomial = np.polynomial.Polynomial.fit(square[low:high], g[low:high], high - low - 1)
    slope = polynomial.deriv()
    curvature = polynomial.deriv(2)
    position = 0.0
    for _ in range(N_NEWTON_STEPS):
        position = (
            float(
                np.clip(
                    position - slope(position) / curvature(position),
                    square[peak_index - 1],
                    square[peak_index + 1],
                )
            )
            if curvature(position) > 0
            else 0.0
        )
    inside = (
        curvature(position) > 0
        and square[peak_index - 1] < position < square[peak_index + 1]
        and polynomial(position) > 0
    )
    return (position, float(polynomial(position))) if inside else None


def _find_crossing(
    square: np.ndarray, g: np.ndarray, peak_frequency: float, minimum: float
) -> Estimate:
    """Find the frequency at which 1/y^2 first reaches twice its minimum.

    It comes from parabolas through the interval and a case on either side, whose difference gives
    the error. Unknown if 1/y^2 stays below.

    Parameters
    ----------
    square : (m,) array
        Squares of the frequencies minus that of the peak case [Hz2], from the peak outwards.
    g : (m,) array
        (y_top / y)^2.
    peak_frequency : float
        Frequency of the peak case [Hz].
    minimum : float
        Minimum of g.
    """
    above = np.flatnonzero(g >= 2 * minimum)
    if not above.size or above[0] == 0:
        return UNKNOWN
    first_above = above[0]
    level = 2 * minimum
    crossings = []
    linear_crossing = square[first_above - 1] + (level - g[first_above - 1]) / (
        g[first_above] - g[first_above - 1]
    ) * (square[first_above] - square[first_above - 1])
    for window in (
        slice(max(first_above - 2, 0), first_above + 1),
        slice(first_above - 1, first_above + 2),
    ):
        if square[window].size == 3:
            curve = np.polynomial.Polynomial.fit(square[window], g[window], 2) - level
            position = linear_crossing
            for _ in range(N_NEWTON_STEPS):
                position -= curve(position) / curve.deriv()(position)
            crossings += (
                [position]
                if (position - square[first_above - 1]) * (position - square[first_above]) <= 0
                else []
            )
    position = np.sqrt(
        np.array([*crossings, linear_crossing] if len(crossings) < 2 else crossings)
        + peak_frequency**2
    )
    return Estimate(float(position[0]), ERROR_FACTOR * float(np.ptp(position)))


def peaks_sentence(peaks: list) -> str:
    """State the frequency of the peak, or how it changes over the cases; return "" if there are no peaks."""
    known_peaks, unknown_peaks = (
        [peak for peak in peaks if peak.swept.height.is_known() == is_known]
        for is_known in (True, False)
    )
    return "; ".join(
        sentence
        for sentence in (
            _known_peaks_sentence(known_peaks).rstrip("." if unknown_peaks else ""),
            _unknown_peaks(unknown_peaks, bool(known_peaks)),
        )
        if sentence
    )


def _unknown_peaks(peaks: list, some_are_known: bool) -> str:
    """State for which lines of cases the peak is unknown.

    some_are_known: whether it is known for some.
    """
    if not peaks:
        return ""
    number_of_others = (
        f" and {len(peaks) - 1} other{'s' * (len(peaks) > 2)}" if len(peaks) > 1 else ""
    )
    line_text = f" with {peaks[0].fixed_values}{number_of_others}" if peaks[0].fixed_values else ""
    where = "where it" if some_are_known else f"Where {measure_label(peaks[0].name)}"
    return (
        f"{where} peaks{line_text} is not known: cases next to the largest value have not settled or miss the "
        "tolerance; raise drive.cycles so that these cases settle."
    )


def _known_peaks_sentence(peaks: list) -> str:
    """State the first and the last known peak of a sweep."""
    if not peaks:
        return ""
    first = peaks[0]
    last = peaks[-1]
    head = f"{measure_label(first.name).capitalize()} peaks at {_format_frequency(first)}"
    if len(peaks) == 1:
        return f"{head}, {_format_height(first)}{_format_width(first)}."
    return (
        f"{head} with {first.fixed_values} ({_format_height(first)}{_format_width(first)}) "
        f"and at {_format_frequency(last)} with {last.fixed_values} "
        f"({_format_height(last)}{_format_width(last)})."
    )


def _format_frequency(peak: Peak) -> str:
    """Format the frequency of a peak with its error."""
    spacing = format_number(peak.swept.case_spacing, 2)
    return f"{format_value(*peak.swept.frequency, unit='Hz')} (cases lie {spacing} Hz apart)"


def _format_height(peak: Peak) -> str:
    """Format the height of a peak with its error."""
    return format_value(*peak.swept.height, format_zero(peak.name), peak.unit)


def _format_width(peak: Peak) -> str:
    """Format the half-power width of a peak as a clause."""
    if peak.swept.half_power_width.is_known():
        return f", half-power width {format_value(*peak.swept.half_power_width, unit='Hz')}"
    return f", half-power width {OPEN}" if peak.swept.falls_unresolved else ""


def peaks_table(peaks: list) -> str:
    """Return the peaks of a sweep as an HTML table, or "" if there are none."""
    if not peaks:
        return ""
    rows = [[escape(peak.fixed_values), *_peak_cells(peak)] for peak in peaks]
    return (
        f"<p class=soft>The largest {measure_link(measure_label(peaks[0].name), peaks[0].name)} of each curve is found "
        "from a "
        "parabola of 1/y&sup2; against f&sup2; through the case with the largest value and its two neighbours in "
        "frequency. The stated errors combine the errors of these cases with the differences between this parabola "
        "and polynomials through more cases. For an unsettled case the "
        "estimate of the steady value is used if the error of this estimate is at most 1 %; otherwise the case is "
        "left out. A half-power width is given if the curve falls to its peak/&radic;2 on both sides within the "
        "swept range.</p>"
        + document.table_html(("case", ">at", ">height", ">half-power width"), rows, "wide")
    )


def _peak_cells(peak: Peak) -> list:
    """Format frequency, height and half-power width of a peak as table cells."""
    swept = peak.swept
    if not swept.height.is_known():
        return ["not known", "not known", "&ndash;"]
    if swept.half_power_width.is_known():
        width = format_value(*swept.half_power_width, unit="Hz")
    elif swept.falls_unresolved:
        width = f"{OPEN}; add cases near {format_number(swept.frequency.value, 4)} Hz"
    else:
        width = "reaches beyond the swept frequencies"
    return [format_value(*swept.frequency, unit="Hz"), _format_height(peak), width]
