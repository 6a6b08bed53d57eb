"""Peak of a response curve, which is refined until its neighbours bound it closely.

In: points of a response curve and a finder. Out: the Solution of the largest motion, with the
errors of its amplitude and frequency.

Where a curve is concave, it lies below the extrapolated chords of the neighbouring intervals, so
these bound its maximum. A new point is added where the bound is largest. The bound is sharp at a
kink; at a smooth peak it converges with the square of the spacing.
"""

from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....core import NotConverged
from ....response.errors import absolute_change
from ....response.measures import Values
from ....response.rows import AMPLITUDE
from ..solution import Solution, replace_output_by_gauge
from .curves import CurvePoint, ResponseCurve, find_largest_point, tabulate_curve

MAX_ADDED_POINTS = 40  # Largest number of points that are added to refine a peak.
# Smallest fraction of the peak at which a resonance curve is assumed concave; that of a single mode
# is concave above 0.816.
MIN_CONCAVE_FRACTION = 0.8
# Error of the position of a peak due to round-off, relative to its width.
POSITION_TOL = 3e-4
# Largest distance, relative to the length of the curve, at which two points count as identical.
IDENTICAL_POINT_TOL = 1e-9
WIDTH_HEIGHT_FRACTION = 0.9  # Fraction of the height of a peak at which its width is measured.
# Ratio of the shift of a peak to its width times the relative error of its height. The width is
# measured a tenth below the peak, so that an error of a tenth shifts it by its width.
ERROR_SHIFT_FACTOR = 10.0


class RefinedPeak(NamedTuple):
    """Response curve with points added around its peak.

    - points: points of the curve, including the added ones.
    - best: index of the stable point of largest amplitude.
    - above: largest amount by which the peak may exceed this point [m]; inf if a neighbour has no
      bounded motion.
    """

    points: list[CurvePoint]
    best: int
    above: float


def refine_peak(points: list[CurvePoint], finder, tolerance: float) -> RefinedPeak:
    """Add points to a response curve around its peak.

    Parameters
    ----------
    points : list of CurvePoint
        Points of the curve in order.
    finder
        Has the methods measure_curve_distance(a, b) and compute_point_between(a, b, fraction) of CurvePoints, and
        `peak_tolerances`, the ratios of the remaining errors of the peak to the tolerance: that of the
        amplitude, and that of the position relative to the width.
    tolerance : float
        Relative tolerance of the scene.

    Returns
    -------
    RefinedPeak
        Refined curve with at most MAX_ADDED_POINTS added points.
    """
    points = list(points)
    for remaining in range(MAX_ADDED_POINTS, -1, -1):
        s = np.cumsum([0.0, *(finder.measure_curve_distance(a, b) for a, b in pairwise(points))])
        y = _collect_amplitudes(points)
        is_stable = np.array([point.stable for point in points])

        best = find_largest_point(points)
        bounds, fractions = bound_concave_curve(s, y)
        if not y[best] > 0 or not bounds.size:
            return RefinedPeak(points, best, 0.0)
        if is_stable.any():
            bounds[~(is_stable[:-1] | is_stable[1:])] = 0.0
            fractions[is_stable[:-1] != is_stable[1:]] = (
                0.5  # The limit of stability between two points is found by bisection.
            )
        if not np.isfinite(y[max(best - 1, 0) : best + 2]).all():
            return RefinedPeak(points, best, np.inf)

        above = max(float(bounds.max()) - y[best], 0.0)
        bounds[np.diff(s) <= IDENTICAL_POINT_TOL * s[-1]] = 0.0
        interval = int(np.argmax(bounds))
        if bounds[interval] <= y[best] * (1 + finder.peak_tolerances[0] * tolerance):
            share = max(finder.peak_tolerances[1] * tolerance, POSITION_TOL)
            added = _choose_added_point(s, y, best, share)
            interval = -1
            if added is not None:
                interval, fractions[interval] = added

        if not remaining or interval < 0:
            return RefinedPeak(points, best, above)
        try:
            points.insert(
                interval + 1,
                finder.compute_point_between(
                    points[interval],
                    points[interval + 1],
                    float(np.clip(fractions[interval], 0.05, 0.95)),
                ),
            )
        except NotConverged:
            return RefinedPeak(points, best, above)


def _choose_added_point(s, y, best: int, min_fraction: float) -> tuple | None:
    """Choose the position of a new point next to the largest point of a curve.

    The new point is the vertex of the parabola through the largest point and its neighbours, or a
    tenth of the way to the farther neighbour if the vertex is close to the largest point. The
    result is the index of the interval and the fraction of it. It is None if both neighbours are
    closer than `min_fraction` times the width of the peak, or if the largest point is at an end.

    The arguments s and y (n,) are the positions along the curve and its values.
    """
    if not 0 < best < len(s) - 1:
        return None
    max_distance = min_fraction * min(
        _measure_peak_width(y[best:], s[best:] - s[best]),
        _measure_peak_width(y[best::-1], s[best] - s[best::-1]),
    )
    before = s[best] - s[best - 1]
    after = s[best + 1] - s[best]
    if max(before, after) <= max_distance:
        return None
    slopes = (y[best] - y[best - 1]) / before, (y[best + 1] - y[best]) / after
    gap = slopes[0] - slopes[1]
    off = (slopes[0] * after + slopes[1] * before) / (2 * gap) if gap > 0 else 0.0
    if abs(off) <= 0.1 * (after if off > 0 else before):
        size = max(0.1 * max(before, after), min(0.8 * max_distance, before, after), 2 * abs(off))
        off = size if after > before else -size
    return (best, off / after) if off > 0 else (best - 1, 1 + off / before)


def _measure_peak_width(y, distances) -> float:
    """Return the distance from a peak at which the curve has fallen to WIDTH_HEIGHT_FRACTION of it.

    `distances` (k,) are the distances of the values y (k,) from the peak.
    """
    low = ~(y >= WIDTH_HEIGHT_FRACTION * y[0])
    return float(distances[: (int(np.argmax(low)) if low.any() else y.size - 1) + 1].max())


def _collect_amplitudes(points) -> np.ndarray:
    """Return the amplitudes [m] of the points of a curve; NaN for unbounded motions."""
    return np.array([point.values.get(AMPLITUDE, np.nan) for point in points])


def bound_concave_curve(s, y) -> tuple:
    """Return upper bounds of a concave curve between its points, by extrapolated chords.

    A chord with a point below MIN_CONCAVE_FRACTION of the larger end of the interval is not used,
    because the curve may be convex there. Without any chord, the bound is the larger end divided by
    MIN_CONCAVE_FRACTION.

    Parameters
    ----------
    s : (n,)
        Positions along the curve.
    y : (n,)
        Values of the curve; an interval with NaN at an end has the bound 0.

    Returns
    -------
    tuple
        Bounds (n - 1,), and their positions (n - 1,) as fractions of the intervals.
    """
    h = np.diff(s)
    ends = np.maximum(y[:-1], y[1:])
    with np.errstate(all="ignore"):
        slope = np.diff(y) / h
        # Slopes of the chords to the left and to the right of each interval.
        rise, fall = np.full((2, h.size), np.nan)
        rise[1:] = np.where(y[:-2] >= MIN_CONCAVE_FRACTION * ends[1:], slope[:-1], np.nan)
        fall[:-1] = np.where(y[2:] >= MIN_CONCAVE_FRACTION * ends[:-1], slope[1:], np.nan)
        left = y[:-1] + rise * h
        right = y[1:] - fall * h
        # Both extrapolated chords intersect at this fraction of the interval.
        intersection = (right - y[:-1]) / (rise - fall) / h
        inside = (intersection > 0) & (intersection < 1)
        bounds = np.where(inside, y[:-1] + rise * intersection * h, ends)
        alone = np.isnan(rise) != np.isnan(fall)
        bounds = np.where(
            alone,
            np.fmax(left, right),
            np.where(np.isnan(rise) & np.isnan(fall), ends / MIN_CONCAVE_FRACTION, bounds),
        )
        bounds = np.where(np.isnan(ends), 0.0, np.fmax(bounds, ends))
    return bounds, np.where(inside, intersection, 0.5)


def solve_peak(curve: ResponseCurve, finder) -> Solution:
    """Compute the steady motion at the peak of a response curve, with its error estimates.

    The errors include those due to the position of the peak.

    Parameters
    ----------
    curve : ResponseCurve
        Points in order along the curve, its folds and notes.
    finder
        Solver for steady motions that has traced the curve.
    """
    points, best, above = refine_peak(curve.points, finder, finder.model.accuracy.tolerance)
    peak_point = points[best]
    solution = finder.compute_steady_motion(peak_point.drive, peak_point.guess)[0]
    errors = dict(solution.errors or {})
    solution = replace(
        solution,
        notes=(*solution.notes, *curve.notes),
        extra=solution.extra | {"curve": tabulate_curve(points, curve.folds)},
        drive=peak_point.drive,
    )
    height = peak_point.values.get(AMPLITUDE, 0.0)
    y = _collect_amplitudes(points)
    if not height > 0 or AMPLITUDE not in solution.values:
        return replace(solution, peak_error=np.inf if height == 0 else 0.0)
    # The curve point was computed with fewer samples, which adds this error.
    missed = abs(replace_output_by_gauge(finder.model, solution).values[AMPLITUDE] - height)
    error = min(missed + errors.get(AMPLITUDE, 0.0), height)

    # The position is uncertain by the distance within which the error of the height hides the fall of the curve.
    frequencies = np.array([point.drive.omega for point in points]) / (2 * np.pi)
    max_position_error = 0.0
    position_errors = dict.fromkeys(solution.values, 0.0)
    for direction in (-1, 1):
        heights = y[best::direction]
        distances = np.abs(frequencies[best::direction] - frequencies[best])
        if heights.size < 2:
            continue
        # At these points the curve is certainly below its maximum.
        low = ~(heights >= height - min(above, height) - 2 * error)
        number = int(np.argmax(low)) if low.any() else heights.size - 1
        far = float(distances[: number + 1].max())

        position_error = min(
            far,
            float(distances[1])
            + ERROR_SHIFT_FACTOR * error / height * _measure_peak_width(heights, distances),
        )
        max_position_error = max(max_position_error, position_error)
        for name, difference in _compute_neighbour_differences(
            finder, points[best + direction * number], solution
        ).items():
            position_errors[name] = max(
                position_errors[name], difference * position_error / far if far else difference
            )

    position_errors[AMPLITUDE] = min(above, solution.values[AMPLITUDE]) + missed
    errors = {name: error + position_errors.get(name, 0.0) for name, error in errors.items()}
    return replace(solution, errors=errors, peak_error=float(max_position_error))


def _compute_neighbour_differences(finder, neighbour, solution: Solution) -> Values:
    """Return the differences of all measures between a curve point and a Solution."""
    try:
        other = finder.compute_steady_motion(neighbour.drive, neighbour.guess)[0]
    except NotConverged:
        return {}
    return absolute_change(solution.values, other.values)
