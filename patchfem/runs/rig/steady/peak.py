"""Peak of a response curve, located by Brent's method.

In: points of a response curve and a finder. Out: the Solution of the largest motion, with the
errors of its amplitude and frequency.

The points of the curve bracket each of its highest maxima. Brent's method finds the maximum of a bracket by points that
it adds (Brent, Algorithms for Minimization without Derivatives, 1973, ch. 5). It also converges to a kink, and to the
last stable motion, because an unstable one counts as 0.
"""

from bisect import bisect
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize_scalar

from ....core import NotConverged
from ....response.errors import absolute_change
from ....response.measures import Values
from ....response.rows import AMPLITUDE
from ..solution import Solution, replace_output_by_gauge
from .curves import (
    INTERPOLATION_TOL,
    CurvePoint,
    ResponseCurve,
    find_largest_point,
    tabulate_curve,
)

MAX_ADDED_POINTS = 40  # Largest number of points that are added to refine a peak.
# Tolerance of the position of a peak, relative to its width: a part of the tolerance of the scene, at least round-off.
POSITION_TOL = 0.1
MIN_POSITION_TOL = 3e-4
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
        Has the methods measure_curve_distance(a, b) and compute_point_between(a, b, fraction) of CurvePoints.
    tolerance : float
        Relative tolerance of the scene.

    Returns
    -------
    RefinedPeak
        Refined curve with at most MAX_ADDED_POINTS added points at each of its highest maxima.
    """
    curve = CurveInProgress(list(points), finder)
    heights = curve.find_heights()
    # The curve between the points may be higher than they are by the tolerance of its interpolation.
    high = np.flatnonzero(heights >= (1 - INTERPOLATION_TOL) * max(heights.max(), 1e-300))
    is_maximum = [heights[k] == heights[max(k - 1, 0) : k + 2].max() for k in high]
    for place in np.array(curve.positions)[high[is_maximum]].tolist():
        curve.refine_maximum(place, max(POSITION_TOL * tolerance, MIN_POSITION_TOL))

    # The curve falls from the peak to its neighbours by at least as much as it rises to a peak between them. The largest
    # motion of a curve that rises up to its end is at this end.
    best = find_largest_point(curve.points)
    near = _collect_amplitudes(curve.points[max(best - 1, 0) : best + 2])
    is_at_rest = not curve.points[best].values.get(AMPLITUDE, 0.0) > 0
    if np.isnan(near).any() and not is_at_rest:
        return RefinedPeak(curve.points, best, np.inf)
    is_inside = near.size == 3 and not is_at_rest
    return RefinedPeak(curve.points, best, float(np.ptp(near)) if is_inside else 0.0)


class CurveInProgress:
    """Response curve to which points are added.

    `points` are those of the curve in its order, and `positions` their distances along it, as `finder` measures them.
    """

    def __init__(self, points: list[CurvePoint], finder):
        self.points = points
        self.finder = finder
        distances = [finder.measure_curve_distance(a, b) for a, b in pairwise(points)]
        self.positions = np.cumsum([0.0, *distances]).tolist()
        self.has_stable = any(point.stable for point in points)

    def find_heights(self) -> np.ndarray:
        """Return the amplitudes (n,) [m]; 0 for unbounded motions, and for unstable ones beside stable ones."""
        counts = [point.stable or not self.has_stable for point in self.points]
        return np.where(counts, np.nan_to_num(_collect_amplitudes(self.points)), 0.0)

    def refine_maximum(self, place: float, tolerance: float) -> None:
        """Add points until the maximum next to a point of the curve is known within a fraction of its width.

        `place` is the position of the point along the curve, and `tolerance` the fraction [1].
        """
        heights = self.find_heights()
        positions = np.array(self.positions)
        k = self.positions.index(place)
        width = min(
            _measure_peak_width(heights[k:], positions[k:] - place),
            _measure_peak_width(heights[k::-1], place - positions[k::-1]),
        ) or np.ptp(positions)
        bounds = positions[max(k - 1, 0)], positions[min(k + 1, positions.size - 1)]
        options = {"xatol": tolerance * width, "maxiter": MAX_ADDED_POINTS}
        try:
            minimize_scalar(self._compute_depth, bounds=bounds, method="bounded", options=options)
        except NotConverged:
            # The points that have been added remain.
            return

    def _compute_depth(self, position: float) -> float:
        """Add the point at a position along the curve; return its negative amplitude [m], which Brent's method minimizes."""
        k = min(max(bisect(self.positions, position), 1), len(self.points) - 1)
        begin, end = self.positions[k - 1 : k + 1]
        fraction = (position - begin) / (end - begin)
        point = self.finder.compute_point_between(self.points[k - 1], self.points[k], fraction)
        self.points.insert(k, point)
        self.positions.insert(k, position)
        return -self.find_heights()[k]


def _measure_peak_width(y, distances) -> float:
    """Return the distance from a peak at which the curve has fallen to WIDTH_HEIGHT_FRACTION of it.

    `distances` (k,) are the distances of the values y (k,) from the peak.
    """
    low = ~(y >= WIDTH_HEIGHT_FRACTION * y[0])
    return float(distances[: (int(np.argmax(low)) if low.any() else y.size - 1) + 1].max())


def _collect_amplitudes(points) -> np.ndarray:
    """Return the amplitudes [m] of the points of a curve; NaN for unbounded motions."""
    return np.array([point.values.get(AMPLITUDE, np.nan) for point in points])


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
    solution = finder.compute_steady_motion(peak_point.drive, peak_point.guess)
    errors = dict(solution.errors or {})
    solution = replace(
        solution,
        notes=(*solution.notes, *curve.notes),
        periodic=solution.periodic._replace(curve=tabulate_curve(points, curve.folds)),
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
    """Return the differences of all measures between a curve point and a Solution.

    `finder` computes steady motions, `neighbour` is the curve point with drive and first guess, and `solution` the
    motion at the peak. The result is {} if the point has no steady motion.
    """
    try:
        other = finder.compute_steady_motion(neighbour.drive, neighbour.guess)
    except NotConverged:
        return {}
    return absolute_change(solution.values, other.values)
