"""Response curves of steady motions over frequency, and their peaks.

In: a finder of steady motions (`shooting.ShootingFinder`). Out: `CurvePoint`s at adaptive frequencies, the columns of the
curve, and the Solution of its largest motion (`solve_peak`).
"""

from bisect import bisect
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from ....core import Measure, NotConverged, Response, SineDrive
from ....formatting import format_quantity
from ....response.errors import compute_absolute_changes
from ....response.measures import Values
from ....response.rows import AMPLITUDE
from ...results.patch_rows import Arrays
from ..evaluation import Solution, replace_output_by_gauge
from ..levels import EXACT_RELATIVE_ERROR

# An error is relative to the value, but at least to this fraction of the largest value of the curve, which may start at 0.
MIN_VALUE_RATIO = 1e-3
# Smallest interval that is halved, relative to its abscissa; it ends the refinement at a jump.
MIN_INTERVAL_RATIO = 1e-6
# Largest relative error of linear interpolation between the points of a response curve.
INTERPOLATION_TOL = 0.01


def sample_adaptively(
    compute: Callable[[float, tuple | None], tuple],
    abscissas,
    tolerance: float = INTERPOLATION_TOL,
    max_points: int = 2000,
) -> list[tuple]:
    """Sample a curve at adaptive points until linear interpolation meets a tolerance.

    Parameters
    ----------
    compute : callable
        compute(abscissa, previous) -> (value, ...), where `previous` is the result at the
        neighbouring point, or None at the first point.
    abscissas : sequence of float
        Initial points in increasing or decreasing order; all of them are kept.
    tolerance : float, optional
        Largest error of linear interpolation between two points, relative to the larger of their values
        or to MIN_VALUE_RATIO of the largest value.
    max_points : int, optional
        Largest number of points.

    Returns
    -------
    list of tuple
        Results in the order of the abscissas. No point is added next to a value that is not finite.
    """
    abscissas = [float(abscissa) for abscissa in abscissas]
    results = []
    for abscissa in abscissas:
        results.append(compute(abscissa, results[-1] if results else None))
    while True:
        values = np.array([result[0] for result in results], float)
        intervals = find_coarse_intervals(np.array(abscissas), values, tolerance)
        if not intervals.size or len(abscissas) >= max_points:
            return results
        # The intervals are split from the last to the first, so that
        # the other indices remain valid.
        for k in intervals[::-1][: max_points - len(abscissas)]:
            middle = 0.5 * (abscissas[k] + abscissas[k + 1])
            abscissas.insert(k + 1, middle)
            results.insert(k + 1, compute(middle, results[k]))


def find_coarse_intervals(abscissas, values, tolerance: float) -> np.ndarray:
    """Return the indices k of the intervals (k, k + 1) that must be halved to resolve the curve.

    Parameters
    ----------
    abscissas, values : ndarray
        (n,); values may be nan.
    tolerance : float
        Largest error of linear interpolation, relative to the larger value or MIN_VALUE_RATIO of the largest one.

    Returns
    -------
    ndarray
    """
    if abscissas.size < 3:
        return np.zeros(0, int)
    h = np.abs(np.diff(abscissas))
    with np.errstate(invalid="ignore"):
        line = (values[:-2] * h[1:] + values[2:] * h[:-1]) / (h[:-1] + h[1:])
        curvature = np.abs(values[1:-1] - line) / (4 * h[:-1] * h[1:])
        largest = np.maximum(np.maximum(values[:-2], values[1:-1]), values[2:])
        floor = MIN_VALUE_RATIO * np.max(values, initial=0.0, where=np.isfinite(values))
        # The factor is 0.75 because, on the steepest flank of a peak, the error of linear
        # interpolation is 1.25 times the estimate.
        max_error = 0.75 * tolerance * np.maximum(largest, floor)
        # Comparisons with nan are false, so no point is added next to nan.
        is_left_coarse = curvature * h[:-1] ** 2 > max_error
        is_right_coarse = curvature * h[1:] ** 2 > max_error
    is_coarse = np.zeros(h.size, bool)
    is_coarse[:-1] |= is_left_coarse
    is_coarse[1:] |= is_right_coarse
    return np.flatnonzero(is_coarse & (h > MIN_INTERVAL_RATIO * np.abs(abscissas[1:])))


# Name of the measure in each column of a response curve.
COLUMN_MEASURES = {
    "amplitude": AMPLITUDE,
    "acceleration_peak": "absolute_acceleration_peak",
    "acceleration_fundamental": "absolute_acceleration_fundamental",
    "acceleration_distortion": "acceleration_distortion",
}
SENSED_COLUMNS = ("amplitude", "acceleration_peak", "acceleration_fundamental")  # what sensors see
# Round-off of the third harmonic of the acceleration relative to the first one.
HARMONIC_ROUND_OFF = 1e-12
# Reasons why a curve ends before the last frequency, by the value of `CurvePath.ended`
REASONS_OF_END = {
    "start": "it turns back to its first frequency",
    "loop": "it is closed",
    "points": "it has too many points",
    "step": "no neighbouring motion was found there",
    "cost": "its motions take too many steps, because a law or a mode is much faster than the drive",
}


class CurvePoint(NamedTuple):
    """Point of a response curve of steady motions.

    - drive: sinusoidal drive.
    - values, errors: measures and their errors by name; {} if no bounded motion exists.
    - regime: name of the motion, such as "stick-slip".
    - multiplier: largest magnitude of the Floquet multipliers; NaN if only some periods of the motion were followed, under
      laws of many elements.
    - stable: whether the motion is stable.
    - guess: initial guess for the motion at a neighbouring drive.
    """

    drive: SineDrive
    values: Values
    errors: Values
    regime: str
    multiplier: float
    stable: bool
    guess: Any = None


class ObservedMotion(NamedTuple):
    """Last cycles of a motion, with the quantities that its sensors measure.

    - window: histories; None if they were not requested.
    - acceleration: peak absolute acceleration [m s-2], as in the measures of a run.
    - displacement: displacement amplitude [m], as in the measures of a run.
    - initial_guess: motion from which that under a similar drive is computed, or None.
    - fundamental: magnitude of the first harmonic of the absolute acceleration [m s-2]; None if it
      must be computed from the window.
    """

    window: Response | None
    acceleration: float
    displacement: float
    initial_guess: Any = None
    fundamental: float | None = None


NO_FOLDS = np.zeros((2, 0))


class ResponseCurve(NamedTuple):
    """Response curve over the drive frequency.

    - points: list of CurvePoint, in order along the curve.
    - folds (2, f): frequencies [Hz] at which the curve turns back, and their errors.
    - notes: sentences on a part of the sweep that the curve does not reach.
    """

    points: list[CurvePoint]
    folds: np.ndarray = NO_FOLDS
    notes: tuple[str, ...] = ()


def describe_instability(multipliers) -> str:
    """Return the message on an unstable steady motion with these Floquet multipliers (m,)."""
    size = np.abs(multipliers).max()
    return (
        f"the steady motion that was found is unstable: a disturbance grows by the factor {size:.3g} per cycle; "
        'use accuracy.method = "march"'
    )


def find_largest_point(points) -> int:
    """Return the index of the stable curve point of largest amplitude.

    If no point is stable, all points are considered.
    """
    sizes = np.array([point.values.get(COLUMN_MEASURES["amplitude"], -1.0) for point in points])
    is_stable = np.array([point.stable for point in points])
    return int(np.argmax(np.where(is_stable | ~is_stable.any(), sizes, -2.0)))


def tabulate_curve(points, folds=NO_FOLDS) -> Arrays:
    """Return the columns of a response curve as a dict; NaN for unbounded motions.

    The columns are frequency [Hz], level [m s-2], regime, multiplier, and each of COLUMN_MEASURES
    with its error. `folds` (2, f) are the frequencies [Hz] at which the curve turns back, and their errors.
    """
    columns = {
        "frequency": np.array([point.drive.omega / (2 * np.pi) for point in points]),
        "level": np.array([point.drive.acceleration for point in points]),
    }
    for column, name in COLUMN_MEASURES.items():
        columns[column] = np.array([point.values.get(name, np.nan) for point in points])
        columns[f"{column}_error"] = np.array([point.errors.get(name, np.nan) for point in points])
    return columns | {
        "regime": np.array([point.regime for point in points]),
        "multiplier": np.array([point.multiplier for point in points]),
        "folds": folds[0],
        "fold_errors": folds[1],
    }


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
            return Measure(None, "Hz", None, 0.0, reason=NO_WIDTH_REASON)

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


def estimate_point_errors(values: Values, relative: float = 0.0) -> Values:
    """Return the errors of the measures of a point of a response curve from the relative error of the motion.

    The ratio of two harmonics has the error of the first.
    """
    scale = EXACT_RELATIVE_ERROR + relative
    errors = {name: scale * abs(value) for name, value in values.items()}
    if "acceleration_distortion" in errors:
        errors["acceleration_distortion"] += HARMONIC_ROUND_OFF + relative
    return errors


def note_end_of_curve(points: list[CurvePoint], ended: str, last: float) -> list[str]:
    """Return a note if a curve ends before the end of the sweep, else an empty list.

    Parameters
    ----------
    points : list of CurvePoint
        Points of the curve.
    ended : str
        Key of REASONS_OF_END, or "end".
    last : float
        Last frequency of the sweep [Hz].
    """
    if ended == "end":
        return []
    frequencies = [point.drive.omega / (2 * np.pi) for point in points]
    reached = min(frequencies, key=lambda frequency: abs(frequency - last))
    return [
        f"the curve of steady motions reaches {format_quantity(reached, 'Hz', 4)} and not the end of the sweep at "
        f"{format_quantity(last, 'Hz', 4)}: {REASONS_OF_END[ended]}; the largest motion is that of this part, so "
        "change drive.from or drive.to"
    ]


MAX_ADDED_POINTS = 40  # Largest number of points that are added to refine a peak.
# Tolerance of the position of a peak, relative to its width: a part of the tolerance of the scene, at least round-off.
POSITION_TOL = 0.1
MIN_POSITION_TOL = 3e-4
WIDTH_HEIGHT_FRACTION = 0.9  # Fraction of the height of a peak at which its width is measured.
# Ratio of the shift of a peak to its width times the relative error of its height. The width is
# measured a tenth below the peak, so that an error of a tenth shifts it by its width.
ERROR_SHIFT_FACTOR = 10.0
HALF_POWER = 2.0  # inverse square of the amplitude at half the power, relative to the peak
MAX_HALF_POWER_POINTS = 4  # largest number of points that are added at each half-power point
NO_WIDTH_REASON = "the curve does not fall to half the power on both sides of its peak"
SHIFT_SAFETY_FACTOR = 2.0  # error of the position of a peak, relative to its last shift
# Relative rise of a peak over a point at the distance of its width
RISE_AT_WIDTH = 1 / WIDTH_HEIGHT_FRACTION - 1
MAX_LOCAL_REACH = 0.05  # distance of a point that confirms a peak, in widths of the peak
MAX_STEP_OUTSIDE = (
    2.0  # longest step beyond the highest point at an end of a curve, in widths of a peak
)
N_VERTEX_POINTS = 4  # points of the polynomial whose vertex is the next estimate of a peak
MAX_SHIFT_RATIO = 0.5  # ratio of two successive shifts above which the larger interval is halved


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
    near = _collect_amplitudes(curve.points[max(best - 1, 0) : best + 2])
    height = curve.points[best].values.get(AMPLITUDE, 0.0)
    if not height > 0:
        return RefinedPeak(curve.points, best, 0.0, 0.0)
    if np.isnan(near).any():
        return RefinedPeak(curve.points, best, np.inf, np.inf)

    # The curve falls from the peak to its neighbours by at least as much as it rises to a peak between them. Of a smooth
    # peak the rise follows from the shift.
    shift = shifts.get(curve.positions[best]) or curve.find_widest_shift(best)
    above = float(np.ptp(near)) if near.size == 3 else 0.0
    above = min(above, RISE_AT_WIDTH * height * (shift.distance / shift.width) ** 2)
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
        return np.where(counts, np.nan_to_num(_collect_amplitudes(self.points)), 0.0)

    def find_widest_shift(self, k: int) -> PeakShift:
        """Return the shift of a peak that lies anywhere between the neighbours of the point with an index."""
        x = np.array(self.positions)
        distance = float(np.abs(x[max(k - 1, 0) : k + 2] - x[k]).max())
        return PeakShift(self.positions[k], distance, distance or 1.0)

    def convert_to_frequency(self, k: int, distance: float) -> float:
        """Return the change of the frequency [Hz] over a distance along the curve from the point with an index."""
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
        last = _Vertex(np.inf, 0.0)
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
                vertex = _find_vertex(np.array(self.positions), self.find_heights(), k)
                distance = tolerance * (vertex.width if vertex else abs(farther - top))
                if abs(farther - top) <= 1.5 * distance or top == farther:
                    return self.find_widest_shift(k)

                # The vertex has stayed at the highest point, which a point nearby confirms, or it moves by less and less.
                shift = abs(vertex.position - last.position) if vertex else np.inf
                is_near = vertex is not None and abs(vertex.position - top) <= distance
                reach = np.sort(np.abs(x - top))[1]
                if is_near and shift <= distance and reach <= MAX_LOCAL_REACH * vertex.width:
                    return PeakShift(top, SHIFT_SAFETY_FACTOR * distance, vertex.width)
                if vertex is not None and not shift > MAX_SHIFT_RATIO * last_shift:
                    local = MAX_LOCAL_REACH * vertex.width
                    side = distance if reach <= local else local
                    side = np.copysign(min(side, abs(farther - top) / 2), farther - top)
                    is_new = np.abs(x - vertex.position).min() > distance
                    added = vertex.position if is_new else top + side
                    last, last_shift = vertex, shift
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
            for _ in range(MAX_HALF_POWER_POINTS):
                top = int(self.find_heights().argmax())
                heights = np.nan_to_num(_collect_amplitudes(self.points))
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
            length = min(max(length, abs(step)), MAX_STEP_OUTSIDE * max(width, abs(step)))
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


class _Vertex(NamedTuple):
    """Vertex of a peak: its position, and the distance at which the curve has fallen to WIDTH_HEIGHT_FRACTION."""

    position: float
    width: float


def _find_vertex(x, y, k: int) -> _Vertex | None:
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
    curve = np.polynomial.Polynomial.fit(
        distance[used] / scale, (y[k] / y[used]) ** 2, used.size - 1
    )
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
    return _Vertex(float(x[k] + scale * place), float(width))


def measure_peak_width(y, distances) -> float:
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
    y = _collect_amplitudes(points)
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

        shift = ERROR_SHIFT_FACTOR * error / height * measure_peak_width(heights, distances)
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
