"""Largest amplitude of a curve of steady motions, refined until its neighbours bound it.

In: points of a curve and a finder. Out: the Solution of the largest motion with the errors of
its amplitude and frequency. Between two points, a curve that is concave lies below the lines
through the points on either side, so that these lines bound its largest value. Each new point
is added where this bound is largest. At a kink of a curve the lines meet; a smooth peak
converges with the square of the spacing.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....core import NotConverged
from ....response.errors import absolute_change
from ..solution import Solution, replace_output_by_gauge
from .curves import COLUMN_MEASURES, find_largest_point, tabulate_curve

AMPLITUDE = COLUMN_MEASURES["amplitude"]
MAX_ADDED_POINTS = 40  # largest number of points that refine a peak
# Fraction of the largest amplitude above which a resonance curve is assumed concave; that of a single mode is
# concave from 0.816 on.
MIN_CONCAVE_FRACTION = 0.8
# Error of the position of a peak due to round-off, relative to the width of the peak.
POSITION_TOL = 3e-4
# Distance relative to the length of the curve, below which two points are identical.
IDENTICAL_POINT_TOL = 1e-9
WIDTH_HEIGHT_FRACTION = 0.9  # fraction of the height of a peak at which its width is measured
# Ratio of the shift of a peak to (its width times the relative error of its height): the width is measured a tenth of
# the height below the peak, so that an error of a tenth shifts the peak by its width.
ERROR_SHIFT_FACTOR = 10.0


class RefinedPeak(NamedTuple):
    """Curve of steady motions with points added around its largest amplitude.

    - points: those of the curve and those added.
    - best: index of the largest stable point.
    - above: how far the largest amplitude may exceed it [m]; inf if a neighbour has no bounded
      motion.
    """

    points: list
    best: int
    above: float


def refine_peak(points: list, finder, tolerance: float) -> RefinedPeak:
    """Add points to a curve of steady motions around its largest amplitude.

    Parameters
    ----------
    points : list of CurvePoint
        Points along the curve.
    finder
        Has curve_distance(CurvePoint, CurvePoint), point_between(CurvePoint, CurvePoint, fraction) ->
        CurvePoint, and `leaves`: fractions of the tolerance that may remain as the error of the
        amplitude, and of its position over the width of the peak.
    tolerance : float

    Returns
    -------
    RefinedPeak
        At the latest after MAX_ADDED_POINTS points.
    """
    points = list(points)
    for left in range(MAX_ADDED_POINTS, -1, -1):
        s = np.cumsum([0.0, *(finder.curve_distance(a, b) for a, b in pairwise(points))])
        y = _point_amplitudes(points)
        lasting = np.array([point.stable for point in points])
        best = find_largest_point(points)
        reach, at = bound_concave_curve(s, y)
        if not y[best] > 0 or not reach.size:
            return RefinedPeak(points, best, 0.0)
        if lasting.any():
            reach[~(lasting[:-1] | lasting[1:])] = 0.0
            at[lasting[:-1] != lasting[1:]] = (
                0.5  # the limit of stability between two points is found by bisection
            )
        if not np.isfinite(y[max(best - 1, 0) : best + 2]).all():
            return RefinedPeak(points, best, np.inf)
        above = max(float(reach.max()) - y[best], 0.0)
        reach[np.diff(s) <= IDENTICAL_POINT_TOL * s[-1]] = 0.0
        k = int(np.argmax(reach))
        if reach[k] <= y[best] * (1 + finder.leaves[0] * tolerance):
            share = max(finder.leaves[1] * tolerance, POSITION_TOL)
            added = _choose_added_point(s, y, best, share)
            k = -1
            if added is not None:
                k, at[k] = added
        if not left or k < 0:
            return RefinedPeak(points, best, above)
        try:
            points.insert(
                k + 1,
                finder.point_between(points[k], points[k + 1], float(np.clip(at[k], 0.05, 0.95))),
            )
        except NotConverged:
            return RefinedPeak(points, best, above)


def _choose_added_point(s, y, best: int, share: float) -> tuple | None:
    """Choose the position of a new point next to the largest point of a curve.

    The result is None if both neighbours are closer than `share` times the width of the peak, or if the
    largest value is at an end. The point is the vertex of the parabola through the three points, or a tenth
    of the way to the farther neighbour.

    Returns the index of the interval and the fraction of it. s, y: positions along the curve, and
    values (n,).
    """
    if not 0 < best < len(s) - 1:
        return None
    want = share * min(
        _peak_width(y[best:], s[best:] - s[best]), _peak_width(y[best::-1], s[best] - s[best::-1])
    )
    before = s[best] - s[best - 1]
    after = s[best + 1] - s[best]
    if max(before, after) <= want:
        return None
    slopes = (y[best] - y[best - 1]) / before, (y[best + 1] - y[best]) / after
    gap = slopes[0] - slopes[1]
    off = (slopes[0] * after + slopes[1] * before) / (2 * gap) if gap > 0 else 0.0
    if abs(off) <= 0.1 * (after if off > 0 else before):
        size = max(0.1 * max(before, after), min(0.8 * want, before, after), 2 * abs(off))
        off = size if after > before else -size
    return (best, off / after) if off > 0 else (best - 1, 1 + off / before)


def _peak_width(y, away) -> float:
    """Return the distance from a peak at which a curve has fallen to a given fraction.

    away: distances (k,) of the values y (k,).
    """
    low = ~(y >= WIDTH_HEIGHT_FRACTION * y[0])
    return float(away[: (int(np.argmax(low)) if low.any() else y.size - 1) + 1].max())


def _point_amplitudes(points) -> np.ndarray:
    """Return the amplitudes [m] of the points of a curve; NaN for unbounded motions."""
    return np.array([point.values.get(AMPLITUDE, np.nan) for point in points])


def bound_concave_curve(s, y) -> tuple:
    """Return upper bounds of a concave curve between its points, by extrapolated chords.

    A line from points below MIN_CONCAVE_FRACTION of the larger end is not used, because a curve may be convex there;
    without any line, the bound is the larger end divided by MIN_CONCAVE_FRACTION.

    Parameters
    ----------
    s : (n,)
        Positions along the curve.
    y : (n,)
        Values; an interval next to NaN has the bound 0.

    Returns
    -------
    tuple
        Bounds and fractions, (n - 1,) each.
    """
    h = np.diff(s)
    ends = np.maximum(y[:-1], y[1:])
    with np.errstate(all="ignore"):
        slope = np.diff(y) / h
        # the lines through the two points on the left and on the right have these slopes
        rise, fall = np.full((2, h.size), np.nan)
        rise[1:] = np.where(y[:-2] >= MIN_CONCAVE_FRACTION * ends[1:], slope[:-1], np.nan)
        fall[:-1] = np.where(y[2:] >= MIN_CONCAVE_FRACTION * ends[:-1], slope[1:], np.nan)
        left = y[:-1] + rise * h
        right = y[1:] - fall * h
        # both lines intersect at this fraction of the interval
        meet = (right - y[:-1]) / (rise - fall) / h
        inside = (meet > 0) & (meet < 1)
        reach = np.where(inside, y[:-1] + rise * meet * h, ends)
        alone = np.isnan(rise) != np.isnan(fall)
        reach = np.where(
            alone,
            np.fmax(left, right),
            np.where(np.isnan(rise) & np.isnan(fall), ends / MIN_CONCAVE_FRACTION, reach),
        )
        reach = np.where(np.isnan(ends), 0.0, np.fmax(reach, ends))
    return reach, np.where(inside, meet, 0.5)


def solve_peak(points: list, folds, finder) -> Solution:
    """Find the steady motion of largest amplitude on a curve, with the error of its position.

    Its errors include those by the position of the peak.

    Parameters
    ----------
    points : list of CurvePoint
    folds : sequence of float
        Frequencies [Hz] at which the curve turns back.
    finder
        See `refine_peak`.
    """
    points, best, above = refine_peak(points, finder, finder.model.accuracy.tolerance)
    top = points[best]
    raw = finder.point(top.drive, top.near)[0]
    errors = dict(raw.errors or {})
    extra = {"curve": tabulate_curve(points, folds), "at": top.drive}
    height = top.values.get(AMPLITUDE, 0.0)
    y = _point_amplitudes(points)
    if not height > 0 or AMPLITUDE not in raw.values:
        # the error None means that the curve has no peak
        return replace(raw, extra=raw.extra | extra | {"at_error": None if height == 0 else 0.0})
    # the point of the curve was computed with fewer samples, which adds this error
    missed = abs(replace_output_by_gauge(finder.model, raw).values[AMPLITUDE] - height)
    error = min(missed + errors.get(AMPLITUDE, 0.0), height)
    places = np.array([point.drive.omega for point in points]) / (2 * np.pi)
    off = 0.0
    open_ones = dict.fromkeys(raw.values, 0.0)
    for direction in (-1, 1):
        heights = y[best::direction]
        away = np.abs(places[best::direction] - places[best])
        if heights.size < 2:
            continue
        # at these points the curve is certainly below its largest amplitude
        low = ~(heights >= height - min(above, height) - 2 * error)
        number = int(np.argmax(low)) if low.any() else heights.size - 1
        far = float(away[: number + 1].max())
        near = min(
            far, float(away[1]) + ERROR_SHIFT_FACTOR * error / height * _peak_width(heights, away)
        )
        off = max(off, near)
        for name, gap in _compute_neighbour_differences(
            finder, points[best + direction * number], raw
        ).items():
            open_ones[name] = max(open_ones[name], gap * near / far if far else gap)
    open_ones[AMPLITUDE] = min(above, raw.values[AMPLITUDE]) + missed
    errors = {name: error + open_ones.get(name, 0.0) for name, error in errors.items()}
    return replace(raw, errors=errors, extra=raw.extra | extra | {"at_error": float(off)})


def _compute_neighbour_differences(finder, beside, raw: Solution) -> dict:
    """Return the differences of all measures between a curve point and a Solution."""
    try:
        other = finder.point(beside.drive, beside.near)[0]
    except NotConverged:
        return {}
    return absolute_change(raw.values, other.values)
