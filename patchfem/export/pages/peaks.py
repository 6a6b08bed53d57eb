"""Where a swept frequency has its peak: its place, height and half-power width for each value of the other keys."""

from html import escape
from math import sqrt
from typing import NamedTuple

import numpy as np

from ...scales import plain, short
from ..written import label
from . import document
from .changes import lines_of, shown_of
from .words import linked, zero_below

KEYS = ("drive.frequency",)
HEIGHTS = ("relative_displacement_amplitude", "absolute_acceleration_peak")
LEAST = 5  # frequencies that show a peak
KNOWN = 0.01  # of a steady estimate, up to which it tells the height of a peak


class Peak(NamedTuple):
    """The peak along one line of cases: name of the measure; what the other keys are; frequency [Hz], its distance to
    the next cases [Hz], height [SI], NaN where cases beside the largest do not count; half-power width [Hz], NaN where
    a side stays above it; unit of the height."""

    name: str
    held: str
    frequency: float
    between: float
    height: float
    width: float
    unit: str


def found(keys: list, measures: dict, trusted: dict, grid: bool) -> list:
    """The Peak of each line of cases over a swept frequency, none without one; arguments as of `allowed.allowed`."""
    key = next((one for one in keys if one["name"] in KEYS and not one["words"]), None)
    name = next((one for one in HEIGHTS if one in measures), None)
    if key is None or name is None or (len(keys) > 1 and not grid):
        return []
    others = [one for one in keys if one is not key and len(set(one["texts"])) > 1]
    shown = {one["name"]: str if one["words"] else shown_of(one) for one in others}
    out, height = [], _heights(name, measures, trusted)
    for line in lines_of(key, others):
        peak = _peak(np.asarray(key["values"], float)[line], height[line])
        if peak is not None:
            held = ", ".join(f"{one['name']} {one['texts'][line[0]] if one['words'] else shown[one['name']](line[0])}"
                             for one in others)
            out.append(Peak(name, held, *peak, measures[name][2]))
    return out


def _heights(name: str, measures: dict, trusted: dict) -> np.ndarray:
    """The measure of every case that settled, the steady estimate of one that has not where it is KNOWN, else NaN."""
    values, steady = np.asarray(measures[name][0], float), measures.get(f"{name}_steady")
    if steady is None:
        return np.where(trusted[name], values, np.nan)
    estimate = np.where(np.asarray(steady[1], float) <= KNOWN * np.abs(steady[0]), steady[0], np.nan)
    return np.where(trusted[name], values, estimate)


def _peak(frequency: np.ndarray, height: np.ndarray) -> tuple | None:
    """(frequency, distance of the cases there, height, half-power width) of the largest value inside the range, NaN
    where a case beside it has none, None where it stands at an end: by the parabola of 1/y^2 over f^2 through it and
    its neighbours, which one mode has."""
    there = np.isfinite(height) & (height > 0)
    x, y = frequency[there], height[there]
    top = int(np.argmax(y)) if y.size >= LEAST else 0
    if not 0 < top < y.size - 1:
        return None
    if not there[np.flatnonzero(there)[top] + np.array([-1, 1])].all():
        return (np.nan,) * 4
    part, square = slice(top - 1, top + 2), x**2 - x[top]**2
    a, b, c = np.polyfit(square[part], y[part]**-2.0, 2)
    at = float(np.clip(-b / (2 * a), square[top - 1], square[top + 1])) if a > 0 else 0.0
    least = a * at**2 + b * at + c
    at, high = (at, float(least**-0.5)) if least > 0 else (0.0, float(y[top]))
    ends = [_crossing(x[top::step], y[top::step], high / sqrt(2)) for step in (-1, 1)]
    return float(np.sqrt(x[top]**2 + at)), float((x[top + 1] - x[top - 1]) / 2), high, ends[1] - ends[0]


def _crossing(x: np.ndarray, y: np.ndarray, level: float) -> float:
    """Where a curve first falls to a level, by a straight line between its points; NaN where it stays above."""
    below = np.flatnonzero(y <= level)
    if not below.size or below[0] == 0:
        return np.nan
    k = below[0]
    return float(x[k - 1] + (y[k - 1] - level) / (y[k - 1] - y[k]) * (x[k] - x[k - 1]))


def sentence(peaks: list) -> str:
    """Where the peak is, or from where to where it moves; "" without one."""
    known, lost = ([one for one in peaks if np.isfinite(one.height) == there] for there in (True, False))
    return " ".join(said for said in (_known(known), _lost(lost, bool(known))) if said)


def _lost(peaks: list, others: bool) -> str:
    """For which lines the peak is not known; others: whether it is for some."""
    if not peaks:
        return ""
    more = f" and {len(peaks) - 1} other{'s' * (len(peaks) > 2)}" if len(peaks) > 1 else ""
    held = f" with {peaks[0].held}{more}" if peaks[0].held else ""
    what = "it" if others else label(peaks[0].name)
    return (f"Where {what} peaks{held} is not known: cases beside the largest have not settled or miss the "
            "tolerance; more drive.cycles may cure that.")


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
    return f"{plain(one.frequency, 5)} Hz (cases lie {plain(one.between, 2)} Hz apart)"


def _high(one: Peak) -> str:
    return short(one.height, one.unit, 3, zero_below(one.name))


def _width(one: Peak) -> str:
    return f", half-power width {plain(one.width, 2)} Hz" if np.isfinite(one.width) else ""


def table(peaks: list) -> str:
    """The peaks as a table; "" without any."""
    if not peaks:
        return ""
    told = [(plain(one.frequency, 5), _high(one)) if np.isfinite(one.height) else ("not known",) * 2 for one in peaks]
    rows = [[escape(one.held), *cells, plain(one.width, 2) if np.isfinite(one.width) else "&ndash;"]
            for one, cells in zip(peaks, told)]
    return (f"<p class=soft>The largest {linked(label(peaks[0].name), peaks[0].name)} of each curve, by a parabola "
            "of 1/y&sup2; over f&sup2; through the largest case and its neighbours. An unsettled case counts by "
            "its steady estimate if that is known to 1 %, else it is left out. "
            "A width is given where the curve falls to its peak/&radic;2 on both sides within the swept range.</p>"
            + document.table(("", ">at [Hz]", ">height", ">half-power width [Hz]"), rows, "wide"))
