"""Where a swept frequency has its peak: its place, height and half-power width for each value of the other keys."""

from html import escape
from typing import NamedTuple

import numpy as np

from ...scales import plain, told
from ..written import label
from . import document
from .key_lines import lines_of, shown_of, varies
from .words import linked, zero_below

KEYS = ("drive.frequency",)
HEIGHTS = ("relative_displacement_amplitude", "absolute_acceleration_peak")
LEAST = 5  # frequencies that show a peak
SURE = 3.0  # times what polynomials differ by
NEWTON = 30  # steps from a vertex, or a straight line's crossing
OPEN = "not resolved by these cases"
KNOWN = 0.01  # of a steady estimate, up to which it tells the height of a peak


class Peak(NamedTuple):
    """The peak along one line of cases: name of the measure; what the other keys are; frequency [Hz], its distance to
    the next cases [Hz], height [SI], half-power width [Hz], NaN where a side stays above it, each with its error, NaN
    where cases beside the largest do not count; unit of the height; open: the curve falls to
    peak/sqrt2 on both sides, but so fast that the cases do not tell its width."""

    name: str
    held: str
    frequency: tuple
    between: float
    height: tuple
    width: tuple
    unit: str
    open: bool = False


def found(keys: list, measures: dict, trusted: dict, grid: bool) -> list:
    """The Peak of each line of cases over a swept frequency, none without one; arguments as of `allowed.allowed`."""
    key = next((one for one in keys if one["name"] in KEYS and not one["words"]), None)
    name = next((one for one in HEIGHTS if one in measures), None)
    if key is None or name is None or (len(keys) > 1 and not grid):
        return []
    others = [one for one in keys if one is not key and varies(one)]
    shown = {one["name"]: str if one["words"] else shown_of(one) for one in others}
    out, (height, error) = [], _heights(name, measures, trusted)
    for line in lines_of(key, others):
        peak = _peak(np.asarray(key["values"], float)[line], height[line], error[line])
        if peak is not None:
            held = ", ".join(f"{one['name']} {one['texts'][line[0]] if one['words'] else shown[one['name']](line[0])}"
                             for one in others)
            *known, falls = peak
            out.append(Peak(name, held, *known, measures[name][2], falls))
    return out


def _heights(name: str, measures: dict, trusted: dict) -> tuple:
    """The measure of every case that settled, the steady estimate of one that has not where it is KNOWN, else NaN; its
    error."""
    (value, error, _), steady = measures[name], measures.get(f"{name}_steady")
    value, error = np.asarray(value, float), np.nan_to_num(np.asarray(error, float))
    if steady is None:
        return np.where(trusted[name], value, np.nan), error
    known = np.asarray(steady[1], float) <= KNOWN * np.abs(steady[0])
    return (np.where(trusted[name], value, np.where(known, steady[0], np.nan)),
            np.where(trusted[name], error, np.asarray(steady[1], float)))


def _peak(frequency: np.ndarray, height: np.ndarray, error: np.ndarray) -> tuple | None:
    """((frequency, its error), distance of the cases there, (height, its error), (half-power width, its error), whether
    the cases fall that far on both sides, though they do not tell it) of the largest value inside the range, NaN where
    a case beside it has none, None where it stands at an end.

    By the parabola of 1/y^2 over f^2 through it and its neighbours, which one mode has. What polynomials through more
    cases, or those on one side, tell otherwise is its error, beside that of the cases.
    """
    there = np.isfinite(height) & (height > 0)
    x, y = frequency[there], height[there]
    top = int(np.argmax(y)) if y.size >= LEAST else 0
    if not 0 < top < y.size - 1:
        return None
    nowhere = (np.nan, np.nan)
    if not there[np.flatnonzero(there)[top] + np.array([-1, 1])].all():
        return nowhere, np.nan, nowhere, nowhere, False
    between, off = float(x[top + 1] - x[top - 1]) / 2, float(np.nanmax(error[there][top - 1:top + 2]) / y[top])
    square, g = x**2 - x[top]**2, (y[top] / y)**2
    at, least = _lowest(square, g, top, top - 1, top + 2) or (0.0, 1.0)
    others = [_lowest(square, g, top, low, high) for low, high in
              ((top - 2, top + 2), (top - 1, top + 3), (top - 2, top + 3)) if low >= 0 and high <= y.size]
    places = np.sqrt(x[top]**2 + np.array([at, *(one[0] for one in others if one)]))
    heights = y[top] * np.array([least, *(one[1] for one in others if one)])**-0.5
    lost = len(places) < len(others) + 1 or not others  # one has no top here
    place, high = float(places[0]), float(heights[0])
    apart = SURE * float(np.ptp(heights)) + (high * (1 - (y[top - 1:top + 2] / high).min()) if lost else 0.0)
    ends = [_crossing(square[top::step], g[top::step], x[top], (y[top] / high)**2) for step in (-1, 1)]
    width, deep = float(ends[1][0] - ends[0][0]), frequency[height <= high / 2**0.5]
    falls = bool(np.isnan(width) and deep.size and deep.min() < x[top] < deep.max())
    slack = off + apart / high  # of the height: a crossing moves by as much of the width on each side
    wide = (width, ends[0][1] + ends[1][1] + 2 * width * slack)
    moved = SURE * float(np.ptp(places)) + (between if lost else 0.0)
    moved += slack * (width if np.isfinite(width) else between)
    return (place, moved), between, (high, apart + off * high), wide, falls


def _lowest(square: np.ndarray, g: np.ndarray, top: int, low: int, high: int) -> tuple | None:
    """(place, value) of the least of the polynomial through g at the cases from low to high over the squares of their
    frequencies less that of `top`, between the neighbours of that; None where it has none above 0 there."""
    line = np.polynomial.Polynomial.fit(square[low:high], g[low:high], high - low - 1)
    slope, bend, at = line.deriv(), line.deriv(2), 0.0
    for _ in range(NEWTON):
        at = float(np.clip(at - slope(at) / bend(at), square[top - 1], square[top + 1])) if bend(at) > 0 else 0.0
    inside = bend(at) > 0 and square[top - 1] < at < square[top + 1] and line(at) > 0
    return (at, float(line(at))) if inside else None


def _crossing(square: np.ndarray, g: np.ndarray, top: float, least: float) -> tuple:
    """(frequency where 1/y^2 first rises to twice its least, its error): by parabolas through the interval and a
    case on either side of it, which differ by the error; NaN where it stays below."""
    above = np.flatnonzero(g >= 2 * least)
    if not above.size or above[0] == 0:
        return np.nan, np.nan
    k, level, found = above[0], 2 * least, []
    line = square[k - 1] + (level - g[k - 1]) / (g[k] - g[k - 1]) * (square[k] - square[k - 1])
    for part in (slice(max(k - 2, 0), k + 1), slice(k - 1, k + 2)):
        if square[part].size == 3:
            curve, at = np.polynomial.Polynomial.fit(square[part], g[part], 2) - level, line
            for _ in range(NEWTON):
                at -= curve(at) / curve.deriv()(at)
            found += [at] if (at - square[k - 1]) * (at - square[k]) <= 0 else []
    at = np.sqrt(np.array([*found, line] if len(found) < 2 else found) + top**2)
    return float(at[0]), SURE * float(np.ptp(at))


def sentence(peaks: list) -> str:
    """Where the peak is, or from where to where it moves; "" without one."""
    known, lost = ([one for one in peaks if np.isfinite(one.height[0]) == there] for there in (True, False))
    return "; ".join(said for said in (_known(known).rstrip("." if lost else ""), _lost(lost, bool(known))) if said)


def _lost(peaks: list, others: bool) -> str:
    """For which lines the peak is not known; others: whether it is for some."""
    if not peaks:
        return ""
    more = f" and {len(peaks) - 1} other{'s' * (len(peaks) > 2)}" if len(peaks) > 1 else ""
    held = f" with {peaks[0].held}{more}" if peaks[0].held else ""
    where = "where it" if others else f"Where {label(peaks[0].name)}"
    return (f"{where} peaks{held} is not known: cases next to the largest value have not settled or miss the "
            "tolerance; raise drive.cycles so that these cases settle.")


def _known(peaks: list) -> str:
    if not peaks:
        return ""
    first, last = peaks[0], peaks[-1]
    head = f"{label(first.name).capitalize()} peaks at {_at(first)}"
    if len(peaks) == 1:
        return f"{head}, {_high(first)}{_width(first)}."
    return (f"{head} with {first.held} ({_high(first)}{_width(first)}) and at {_at(last)} with {last.held} "
            f"({_high(last)}{_width(last)}).")


def _at(one: Peak) -> str:
    return f"{told(*one.frequency, unit='Hz')} (cases lie {plain(one.between, 2)} Hz apart)"


def _high(one: Peak) -> str:
    return told(*one.height, zero_below(one.name), one.unit)


def _width(one: Peak) -> str:
    if np.isfinite(one.width[0]):
        return f", half-power width {told(*one.width, unit='Hz')}"
    return f", half-power width {OPEN}" if one.open else ""


def table(peaks: list) -> str:
    """The peaks as a table; "" without any."""
    if not peaks:
        return ""
    cells_of = [(told(*one.frequency, unit="Hz"), _high(one)) if np.isfinite(one.height[0]) else ("not known",) * 2
            for one in peaks]
    rows = [[escape(one.held), *cells, told(*one.width, unit="Hz") if np.isfinite(one.width[0]) else
             f"{OPEN}; add cases near {plain(one.frequency[0], 4)} Hz" if one.open else
             "reaches beyond the swept frequencies" if np.isfinite(one.height[0]) else "&ndash;"]
            for one, cells in zip(peaks, cells_of)]
    return (f"<p class=soft>The largest {linked(label(peaks[0].name), peaks[0].name)} of each curve is found from a "
            "parabola of 1/y&sup2; against f&sup2; through the case with the largest value and its two neighbours in "
            "frequency. The stated errors combine the errors of these cases with the differences between this parabola "
            "and polynomials through more cases. For an unsettled case the "
            "estimate of the steady value is used if the error of this estimate is at most 1 %; otherwise the case is "
            "left out. A half-power width is given if the curve falls to its peak/&radic;2 on both sides within the "
            "swept range.</p>"
            + document.table(("case", ">at", ">height", ">half-power width"), rows, "wide"))
