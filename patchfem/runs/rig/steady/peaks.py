"""Peak of a response curve: points added around it, its half-power width, and the motion at it.

In: a `ResponseCurve` and the finder that drew it (`shooting.ShootingFinder`). Out: the Solution at the peak, whose errors
include those of the position of the peak.
"""

from bisect import bisect
from dataclasses import replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ....core import Measure, NotConverged, max_abs
from ....measures.errors import compute_absolute_changes
from ....measures.rows import AMPLITUDE
from ...results.patch_rows import Arrays
from ..evaluation import Solution, replace_output_by_gauge
from .curves import (
    INTERPOLATION_TOL,
    MIN_VALUE_RATIO,
    CurvePoint,
    ResponseCurve,
    collect_amplitudes,
    find_largest_point,
    tabulate_curve,
)

MAX_ADDED_POINTS = 40  # Largest number of points that are added to refine a peak.
# Tolerance of the position of a peak, relative to its width: a part of the tolerance of the scene, at least round-off.
POSITION_TOL = 0.1
MIN_POSITION_TOL = 3e-4
WIDTH_HEIGHT_FRACTION = 0.9  # Fraction of the height of a peak at which its width is measured.
HALF_POWER = 2.0  # inverse square of the amplitude at half the power, relative to the peak
MAX_LOCAL_REACH = 0.05  # distance of a point that confirms a peak, in widths of the peak
N_VERTEX_POINTS = 4  # points of the polynomial whose vertex is the next estimate of a peak


class RefinedPeak(NamedTuple):
    """Response curve with points added around its peak.

    - points: points of the curve, including the added ones.
    - best: index of the stable point of largest amplitude.
    - above: largest amount by which the peak may exceed this point [m]; inf if a neighbour has no
      bounded motion.
    - shift: largest distance of the peak from this point [Hz], apart from the errors of the heights.
    """

    points: list[CurvePoint]
    best: int
    above: float
    shift: float


def refine_peak(points: list[CurvePoint], finder, tolerance: float) -> RefinedPeak:
    """Add points to a response curve around its peak.

    Parameters
    ----------
    points : list of CurvePoint
        Points of the curve in order: two at least.
    finder
        Has the methods measure_curve_distance(a, b), measure_missing_ends(points) and
        compute_point_between(a, b, fraction) of CurvePoints; of a curve that it draws, the half-power points are refined.
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
    shifts = {}
    for place in np.array(curve.positions)[high[is_maximum]].tolist():
        shift = curve.refine_maximum(place, max(POSITION_TOL * tolerance, MIN_POSITION_TOL))
        shifts[shift.position] = shift

    if finder.draws_curve:
        curve.refine_half_power_points(max(POSITION_TOL * tolerance, MIN_POSITION_TOL))

    # A curve that rises up to its end has its largest motion there.
    best = find_largest_point(curve.points)
    near = collect_amplitudes(curve.points[max(best - 1, 0) : best + 2])
    height = curve.points[best].values.get(AMPLITUDE, 0.0)
    if not height > 0:
        return RefinedPeak(curve.points, best, 0.0, 0.0)
    if np.isnan(near).any():
        return RefinedPeak(curve.points, best, np.inf, np.inf)

    # The curve falls from the peak to its neighbours by at least as much as it rises to a peak between them. Of a smooth
    # peak the rise follows from the shift, as it is known at the distance of the width; to a kink the curve rises linearly.
    shift = shifts.get(curve.positions[best]) or curve.find_widest_shift(best)
    above = float(np.ptp(near)) if near.size == 3 else 0.0
    rise = (1 / WIDTH_HEIGHT_FRACTION - 1) * height * (shift.distance / shift.width) ** 2
    above = min(above, rise + curve.measure_kink(best) * shift.distance)
    return RefinedPeak(curve.points, best, above, curve.convert_to_frequency(best, shift.distance))


class PeakShift(NamedTuple):
    """Largest distance of a peak from a point of a curve, and width of this peak, as distances along the curve.

    - position: of the point.
    - distance: largest distance of the peak from it.
    - width: distance at which the curve has fallen to WIDTH_HEIGHT_FRACTION.
    """

    position: float
    distance: float
    width: float


class CurveInProgress:
    """Response curve to which points are added.

    `points` are those of the curve in its order, and `positions` their distances along it, as `finder` measures them.
    """

    def __init__(self, points: list[CurvePoint], finder):
        self.points = points
        self.finder = finder
        distances = [finder.measure_curve_distance(a, b) for a, b in pairwise(points)]
        self.positions = np.cumsum([0.0, *distances]).tolist()
        before, after = finder.measure_missing_ends(points)
        self.ends = (-before, self.positions[-1] + after)
        self.has_stable = any(point.stable for point in points)

    def find_heights(self) -> np.ndarray:
        """Return the amplitudes (n,) [m]; 0 for unbounded motions, and for unstable ones beside stable ones."""
        counts = [point.stable or not self.has_stable for point in self.points]
        return np.where(counts, np.nan_to_num(collect_amplitudes(self.points)), 0.0)

    def find_widest_shift(self, k: int) -> PeakShift:
        """Return the shift of a peak that lies anywhere between the neighbours of the point `k`."""
        x = np.array(self.positions)
        distance = max_abs(x[max(k - 1, 0) : k + 2] - x[k])
        return PeakShift(self.positions[k], distance, distance or 1.0)

    def measure_kink(self, k: int) -> float:
        """Return the difference of the slopes [m] of the curve on both sides of the point `k`; 0 at an end of the curve.

        The slopes are those of parabolas through the inverse squares of the amplitudes of the point and the next two on its
        side, which are exact for a linear resonance. A side with one further point has the curvature of the other side.
        """
        if k in (0, len(self.points) - 1):
            return 0.0
        height = self.points[k].values[AMPLITUDE]
        squares = (height / collect_amplitudes(self.points)) ** 2 - 1
        distance = np.array(self.positions) - self.positions[k]
        slopes = np.zeros(2)
        bends = np.full(2, np.nan)
        places = np.zeros(2)
        for i, side in enumerate((-1, 1)):
            places[i] = distance[k + side]
            slopes[i] = squares[k + side] / places[i]
            if 0 <= k + 2 * side < len(self.points):
                far = k + 2 * side
                bends[i] = (squares[far] / distance[far] - slopes[i]) / (distance[far] - places[i])
        bends = np.where(np.isnan(bends), np.nan_to_num(bends[::-1]), bends)
        return float(height / 2 * abs(np.diff(slopes - bends * places)[0]))

    def convert_to_frequency(self, k: int, distance: float) -> float:
        """Return the change of the frequency [Hz] over a distance along the curve from the point `k`."""
        omega = np.array([point.drive.omega for point in self.points[max(k - 1, 0) : k + 2]])
        steps = np.diff(self.positions[max(k - 1, 0) : k + 2])
        slope = np.abs(np.diff(omega) / steps).max(initial=0.0, where=steps > 0)
        return float(slope * distance / (2 * np.pi))

    def refine_maximum(self, place: float, tolerance: float) -> PeakShift:
        """Add points until the maximum next to a point of the curve is known within a fraction of its width.

        Each point is at the vertex of the parabola through the highest point and its neighbours, as long as the vertices
        converge; else the larger interval is halved. The search ends where the vertex stays.

        Parameters
        ----------
        place : float
            Position of the point along the curve.
        tolerance : float
            Fraction of the width [1].
        """
        k = self.positions.index(place)
        last = Vertex(np.inf, 0.0)
        last_shift = np.inf
        for _ in range(MAX_ADDED_POINTS):
            # The highest point and its neighbours, of which the one that is farther away is approached
            first = max(k - 1, 0)
            x = np.array(self.positions[first : k + 2])
            top = self.positions[k]
            farther = float(x[np.abs(x - top).argmax()])
            added = self._find_place_outside(k)
            if added is None:
                added = (top + farther) / 2
                vertex = find_vertex(np.array(self.positions), self.find_heights(), k)
                distance = tolerance * (vertex.width if vertex else abs(farther - top))
                if abs(farther - top) <= 1.5 * distance or top == farther:
                    return self.find_widest_shift(k)

                # The vertex has stayed at the highest point, which a point nearby confirms, or it moves by less and less.
                shift = abs(vertex.position - last.position) if vertex else np.inf
                is_near = vertex is not None and abs(vertex.position - top) <= distance
                reach = np.sort(np.abs(x - top))[1]
                if is_near and shift <= distance and reach <= MAX_LOCAL_REACH * vertex.width:
                    # Error of the position of a peak, relative to its last shift
                    return PeakShift(top, 2.0 * distance, vertex.width)
                # Ratio of two successive shifts above which the larger interval is halved
                if vertex is not None and not shift > 0.5 * last_shift:
                    local = MAX_LOCAL_REACH * vertex.width
                    side = distance if reach <= local else local
                    side = np.copysign(min(side, abs(farther - top) / 2), farther - top)
                    is_new = np.abs(x - vertex.position).min() > distance
                    added = vertex.position if is_new else top + side
                    last = vertex
                    last_shift = shift
                else:
                    last_shift = np.inf
            try:
                self._add_point(float(added))
            except NotConverged:
                # The points that have been added remain.
                break
            first = max(first - (added < self.positions[first]), 0)
            heights = self.find_heights()[first : k + 3]
            k = first + int(heights.argmax())
        return self.find_widest_shift(k)

    def refine_half_power_points(self, tolerance: float) -> None:
        """Add points where the curve falls to half the power of its peak, until they stay within a part of the width [1]."""
        for direction in (-1, 1):
            # Largest number of points that are added at each half-power point
            for _ in range(4):
                top = int(self.find_heights().argmax())
                heights = np.nan_to_num(collect_amplitudes(self.points))
                x = np.array(self.positions)[top::direction]
                low = np.flatnonzero(heights[top::direction] < heights[top] / np.sqrt(HALF_POWER))
                near = slice(low[0] - 1, low[0] + 1) if low.size else slice(0)
                y = heights[top::direction][near]
                if y.size < 2 or not (y > 0).all():
                    break
                place = float(np.interp(HALF_POWER, (heights[top] / y) ** 2, x[near]))
                if np.abs(x[near] - place).min() <= tolerance * abs(place - x[0]):
                    break
                try:
                    self._add_point(place)
                except NotConverged:
                    break

    def _find_place_outside(self, k: int) -> float | None:
        """Return the next position beyond an end of the curve if the highest point `k` is there and the curve goes on.

        It is the vertex of the parabola through this point and its neighbour that has the estimated width of the peak.
        """
        for end, inner, limit in ((0, 1, self.ends[0]), (len(self.points) - 1, -2, self.ends[1])):
            if k != end or self.positions[k] == limit:
                continue
            step = self.positions[k] - self.positions[inner]
            width = self.finder.estimated_width
            height, beside = self.find_heights()[[k, inner]]
            rise = (height / max(beside, MIN_VALUE_RATIO * height)) ** 2 - 1
            length = (
                0.5 * rise / abs(step) * width**2 / (WIDTH_HEIGHT_FRACTION**-2 - 1) - abs(step) / 2
            )
            # Longest step beyond the highest point at an end of a curve, in widths of a peak
            length = min(max(length, 2.0 * abs(step)), 2.0 * max(width, abs(step)))
            return float(np.clip(self.positions[k] + np.copysign(length, step), *self.ends))
        return None

    def _add_point(self, position: float) -> None:
        """Compute the point at a position along the curve and add it."""
        place = bisect(self.positions, position)
        k = min(max(place, 1), len(self.points) - 1)
        begin, end = self.positions[k - 1 : k + 1]
        fraction = (position - begin) / (end - begin)
        point = self.finder.compute_point_between(self.points[k - 1], self.points[k], fraction)
        self.points.insert(place, point)
        self.positions.insert(place, position)


class Vertex(NamedTuple):
    """Vertex of a peak: its position, and the distance at which the curve has fallen to WIDTH_HEIGHT_FRACTION."""

    position: float
    width: float


def find_vertex(x, y, k: int) -> Vertex | None:
    """Return the vertex near the highest of several values y, by the polynomial through their inverse squares.

    A parabola is exact for a linear resonance. The polynomial goes through the N_VERTEX_POINTS points nearest to the
    highest one, which lies between two of them; else there is no vertex.

    Parameters
    ----------
    x, y : (n,) array
        Increasing positions, and values above 0.
    k : int
        Index of the highest value.
    """
    near = slice(max(k - 1, 0), k + 2)
    if k in (0, x.size - 1) or not (y[near] > 0).all():
        return None

    distance = x - x[k]
    scale = np.abs(distance[near]).max()
    nearest = np.argsort(np.where(y > 0, np.abs(distance), np.inf))[:N_VERTEX_POINTS]
    used = np.union1d(np.arange(k - 1, k + 2), nearest)[: N_VERTEX_POINTS + 1]
    used = used[y[used] > 0]

    # Points that nearly coincide do not determine all coefficients; the fit then has the smallest ones, which is no defect.
    curve, _ = np.polynomial.Polynomial.fit(
        distance[used] / scale, (y[k] / y[used]) ** 2, used.size - 1, full=True
    )

    # The vertex is the lowest minimum of the inverse squares between the neighbours of the highest point.
    roots = curve.deriv().roots()
    places = roots[np.isreal(roots)].real
    low, high = distance[near][[0, -1]] / scale
    places = places[(places > low) & (places < high)]
    if not places.size:
        return None
    place = places[curve(places).argmin()]
    bend = 0.5 * curve.deriv(2)(place)
    if not bend > 0:
        return None
    width = scale * np.sqrt((WIDTH_HEIGHT_FRACTION**-2 - 1) / bend)
    return Vertex(float(x[k] + scale * place), float(width))


def measure_peak_width(y, distances) -> float:
    """Return the distance from a peak at which the curve has fallen to WIDTH_HEIGHT_FRACTION of it.

    `distances` (k,) are the distances of the values y (k,) from the peak.
    """
    low = ~(y >= WIDTH_HEIGHT_FRACTION * y[0])
    return float(distances[: (int(np.argmax(low)) if low.any() else y.size - 1) + 1].max())


def measure_half_power_width(curve: Arrays) -> Measure:
    """Return the width [Hz] of the highest peak of a drawn response curve, between both half-power points.

    The inverse square of the amplitude is interpolated over the frequency. The error is the difference of a parabola from a
    line, and that by the errors of the amplitudes.

    Parameters
    ----------
    curve : dict
        Columns of `tabulate_curve`.
    """
    amplitude = curve["amplitude"]
    top = int(np.nanargmax(amplitude))
    ends = []
    error = 0.0
    for direction in (-1, 1):
        inverse = (amplitude[top] / amplitude[top::direction]) ** 2
        frequency = curve["frequency"][top::direction]
        relative = (curve["amplitude_error"] / amplitude)[top::direction]
        low = np.flatnonzero(~(inverse < HALF_POWER))
        if not low.size or not np.isfinite(inverse[low[0]]):
            reason = "the curve does not fall to half the power on both sides of its peak"
            return Measure(None, "Hz", None, 0.0, reason=reason)

        # A line between the last point above half the power and the first one below it, corrected by the parabola
        first = low[0] - 1
        slope = np.diff(frequency)[first] / np.diff(inverse)[first]
        place = frequency[first] + (HALF_POWER - inverse[first]) * slope
        near = slice(max(first - 1, 0), first + 2)
        scaled = frequency[near] - place
        bent = np.polynomial.Polynomial.fit(scaled, inverse[near], scaled.size - 1)
        shift = (HALF_POWER - bent(0.0)) * slope
        ends.append(place + shift)
        error += abs(shift)
        error += 2 * HALF_POWER * abs(slope) * float(relative[near].max() + relative[0])
    return Measure(abs(ends[1] - ends[0]), "Hz", error, 0.0)


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
    peak = refine_peak(curve.points, finder, finder.model.accuracy.tolerance)
    points, best, above = peak[:3]
    peak_point = points[best]
    solution = finder.compute_steady_motion(peak_point.drive, peak_point.guess)
    columns = tabulate_curve(points, curve.folds)
    width = measure_half_power_width(columns) if finder.draws_curve else None
    height = peak_point.values.get(AMPLITUDE, 0.0)
    steady = replace(
        solution.steady,
        data=solution.steady.data._replace(curve=columns, width=width),
        notes=(*solution.steady.notes, *curve.notes),
        drive=peak_point.drive,
        peak_error=np.inf if height == 0 else 0.0,
    )
    errors = steady.errors
    y = collect_amplitudes(points)
    if not height > 0 or AMPLITUDE not in solution.values:
        return replace(solution, steady=steady)
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

        # Ratio of the shift of a peak to its width times the relative error of its height. The
        # width is measured a tenth below the peak, so that an error of a tenth shifts it by its
        # width.
        shift = 10.0 * error / height * measure_peak_width(heights, distances)
        position_error = min(far, peak.shift + shift)
        max_position_error = max(max_position_error, position_error)
        neighbour = finder.compute_point_values(points[best + direction * number])
        for name, difference in compute_absolute_changes(solution.values, neighbour).items():
            position_errors[name] = max(
                position_errors[name], difference * position_error / far if far else difference
            )

    position_errors[AMPLITUDE] = min(above, solution.values[AMPLITUDE]) + missed
    errors = {name: error + position_errors.get(name, 0.0) for name, error in errors.items()}
    steady = replace(steady, errors=errors, peak_error=float(max_position_error))
    return replace(solution, steady=steady)
