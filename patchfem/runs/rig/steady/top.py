"""The largest amplitude on a curve of steady motions: points are put in until those beside it leave little open.

Between two points a curve that bends downwards lies below the straight lines through the points beyond them on either
side, so the lines bound what it may reach there. Each new point lies where they reach highest. Where a curve has a kink
the lines meet in it; a smooth peak is closed in as the square of the spacing.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....core import NotConverged
from ....response.errors import change
from ..solution import Solution, gauged
from .curves import SHOWN, curve_columns, largest_of

AMPLITUDE = SHOWN["amplitude"]
MOST = 40  # points that are put in
CAP = 0.8  # of the largest amplitude: above it one mode's curve bends downwards (from 0.816 on)
CLOSE = 3e-4  # of the width of a peak: what round-off leaves to be told of its place
NEAREST = 1e-9  # of the way along the whole curve: points closer together are one
TENTH = 0.9  # of a peak, down to which its width counts
SHIFT = 10.0  # times that width over the relative error of the heights, by which the error moves the place of a peak:
# errors that tilt a ridge take it a tenth of its height down its flank


class Top(NamedTuple):
    """points: those of the curve and those put in; best: number of the largest that lasts; above: how far the largest
    amplitude may lie above it [m], infinite where a neighbour has no bounded motion."""

    points: list
    best: int
    above: float


def highest(points: list, finder, tolerance: float) -> Top:
    """The largest amplitude of a curve, its neighbourhood refined by motions that `finder` finds between its points.

    points: Shown, along the curve; finder: apart(Shown, Shown) -> way between two, between(Shown, Shown, share) ->
    Shown, and `leaves`: shares of the tolerance that may be left open of the amplitude and of its place, over the
    width of the peak. It ends there, or after MOST points.
    """
    points = list(points)
    for left in range(MOST, -1, -1):
        s = np.cumsum([0.0, *(finder.apart(a, b) for a, b in pairwise(points))])
        y, lasting = _heights(points), np.array([one.stable for one in points])
        best, (reach, at) = largest_of(points), ceilings(s, y)
        if not y[best] > 0 or not reach.size:
            return Top(points, best, 0.0)
        if lasting.any():
            reach[~(lasting[:-1] | lasting[1:])] = 0.0
            at[lasting[:-1] != lasting[1:]] = 0.5  # where it ceases to last is met by halving
        if not np.isfinite(y[max(best - 1, 0) : best + 2]).all():
            return Top(points, best, np.inf)
        above = max(float(reach.max()) - y[best], 0.0)
        reach[np.diff(s) <= NEAREST * s[-1]] = 0.0
        k = int(np.argmax(reach))
        if reach[k] <= y[best] * (1 + finder.leaves[0] * tolerance):
            k, at[k] = _closer(s, y, best, max(finder.leaves[1] * tolerance, CLOSE)) or (-1, 0.0)
        if not left or k < 0:
            return Top(points, best, above)
        try:
            points.insert(
                k + 1, finder.between(points[k], points[k + 1], float(np.clip(at[k], 0.05, 0.95)))
            )
        except NotConverged:
            return Top(points, best, above)


def _closer(s, y, best: int, share: float) -> tuple | None:
    """(number of the interval, share of it) of a point that brings a neighbour of the largest value closer to it than
    `share` of the width of the peak; None where both are, or the largest stands at an end.

    It is the vertex of the parabola through the three, or a tenth of the way to the farther neighbour.
    """
    if not 0 < best < len(s) - 1:
        return None
    want = share * min(
        _width(y[best:], s[best:] - s[best]), _width(y[best::-1], s[best] - s[best::-1])
    )
    before, after = s[best] - s[best - 1], s[best + 1] - s[best]
    if max(before, after) <= want:
        return None
    slopes = (y[best] - y[best - 1]) / before, (y[best + 1] - y[best]) / after
    gap = slopes[0] - slopes[1]
    off = (slopes[0] * after + slopes[1] * before) / (2 * gap) if gap > 0 else 0.0
    if abs(off) <= 0.1 * (after if off > 0 else before):
        size = max(0.1 * max(before, after), min(0.8 * want, before, after), 2 * abs(off))
        off = size if after > before else -size
    return (best, off / after) if off > 0 else (best - 1, 1 + off / before)


def _width(y, away) -> float:
    """Distance (k,) `away` of the first value that is below TENTH of the first one, else of the last."""
    low = ~(y >= TENTH * y[0])
    return float(away[: (int(np.argmax(low)) if low.any() else y.size - 1) + 1].max())


def _heights(points) -> np.ndarray:
    return np.array([one.values.get(AMPLITUDE, np.nan) for one in points])


def ceilings(s, y) -> tuple:
    """What a curve that bends downwards may reach in each interval of the places s (n,), and where in it, as its share:
    (n - 1,) each; y (n,): its values, an interval beside nan reaches 0.

    Of the points beyond an interval those below CAP of its larger end tell nothing, as a curve may bend upwards there;
    where none tells, a CAP-th more than that end is left open.
    """
    h, ends = np.diff(s), np.maximum(y[:-1], y[1:])
    with np.errstate(all="ignore"):
        slope = np.diff(y) / h
        rise, fall = np.full((2, h.size), np.nan)  # of the lines from the left and from the right
        rise[1:] = np.where(y[:-2] >= CAP * ends[1:], slope[:-1], np.nan)
        fall[:-1] = np.where(y[2:] >= CAP * ends[:-1], slope[1:], np.nan)
        left, right = y[:-1] + rise * h, y[1:] - fall * h
        meet = (right - y[:-1]) / (rise - fall) / h  # as a share of the interval
        inside = (meet > 0) & (meet < 1)
        reach = np.where(inside, y[:-1] + rise * meet * h, ends)
        alone = np.isnan(rise) != np.isnan(fall)
        reach = np.where(
            alone,
            np.fmax(left, right),
            np.where(np.isnan(rise) & np.isnan(fall), ends / CAP, reach),
        )
        reach = np.where(np.isnan(ends), 0.0, np.fmax(reach, ends))
    return reach, np.where(inside, meet, 0.5)


def at_the_top(points: list, folds, finder) -> Solution:
    """The Solution of the largest motion on a curve, its errors with what its place leaves open, and the curve."""
    points, best, above = highest(points, finder, finder.model.accuracy.tolerance)
    top = points[best]
    raw = finder.point(top.drive, top.near)[0]
    errors, extra = dict(raw.errors or {}), {"curve": curve_columns(points, folds), "at": top.drive}
    height, y = top.values.get(AMPLITUDE, 0.0), _heights(points)
    if not height > 0 or AMPLITUDE not in raw.values:
        # None: no peak
        return replace(raw, extra=raw.extra | extra | {"at_error": None if height == 0 else 0.0})
    # by the curve, whose points are cheaper
    missed = abs(gauged(finder.model, raw).values[AMPLITUDE] - height)
    error = min(missed + errors.get(AMPLITUDE, 0.0), height)
    places, off = np.array([one.drive.omega for one in points]) / (2 * np.pi), 0.0
    open_ones = dict.fromkeys(raw.values, 0.0)
    for way in (-1, 1):
        heights, away = y[best::way], np.abs(places[best::way] - places[best])
        if heights.size < 2:
            continue
        low = ~(heights >= height - min(above, height) - 2 * error)  # the largest cannot lie there
        number = int(np.argmax(low)) if low.any() else heights.size - 1
        far = float(away[: number + 1].max())
        near = min(far, float(away[1]) + SHIFT * error / height * _width(heights, away))
        off = max(off, near)
        for name, gap in _gaps(finder, points[best + way * number], raw).items():
            open_ones[name] = max(open_ones[name], gap * near / far if far else gap)
    open_ones[AMPLITUDE] = min(above, raw.values[AMPLITUDE]) + missed
    errors = {name: error + open_ones.get(name, 0.0) for name, error in errors.items()}
    return replace(raw, errors=errors, extra=raw.extra | extra | {"at_error": float(off)})


def _gaps(finder, beside, raw: Solution) -> dict:
    """Differences by name of the measures of a motion of a curve to those of a Solution."""
    try:
        other = finder.point(beside.drive, beside.near)[0]
    except NotConverged:
        return {}
    return change(raw.values, other.values)
