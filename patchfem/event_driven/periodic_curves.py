"""Periodic motions that meet further conditions, and their curves over a parameter of the drive, through their folds.

The state is extended by unknowns without rates, such as a frequency, and the map of a period changes each of them by the
residual of a condition, so that a motion that meets all conditions is a fixed point. The condition of a curve is the value
of its parameter, or a distance along the curve (pseudo-arc-length continuation: Keller 1977; Seydel, Practical Bifurcation
and Stability Analysis, 2010, ch. 4). Derivatives are evaluated once at each point; between two points Broyden's method
updates them (Math. Comp. 19, 577, 1965). The reversal points that the laws remember are unknowns as well.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ..core import NotConverged
from .cases import Case, make_arrays
from .laws import masing
from .periodic import (
    MAX_CHANGE,
    MAX_KINKED_CHANGE,
    MAX_STABLE_MULTIPLIER,
    PeriodicMotion,
    PeriodMap,
    Shooting,
    copy_state,
)
from .records import N_FACE_INTEGRALS, N_INTEGRALS, Face, Memory, Probe, Setting, State
from .runs import run_case

MAX_STEPS = 6e6  # steps of the engine over all periods of a curve, which take about a minute
N_FIRST = 2  # periods in which the laws take the memory of the loop of a motion from another map
MAX_CORRECTION = 0.5  # longest Newton step, as arc length
MIN_STEP_COSINE = 0.7  # smallest cosine between a step and the tangent; a larger angle is a jump


class PathSettings(NamedTuple):
    """Steps of arc-length continuation.

    - first_step, max_step: first and longest step, as arc length [1] of the curve of the scaled parameter and unknowns:
      the parameter over the width of its bounds, and the unknowns over the size of the motion
    - max_points: largest number of points
    """

    first_step: float = 0.02
    max_step: float = 0.1
    max_points: int = 2000


class ExtendedShooting(Shooting, ABC):
    """Map of a period of a state that is extended by unknowns without rates, which stand after the states of the laws.

    A class sets what they mean by `set_extra`, and the conditions that determine them by `find_conditions`. After a period
    the laws remember the loop of this period alone, whose ends are measured. Larger motions of the past would otherwise
    shift the loop for ever, and the map would have a kink at each periodic motion, because its reversals neither exceed
    those of the period before nor fall short of them.

    Parameters
    ----------
    case : Case
        Rig, and the state from which the search begins.
    values, scales : (e,) sequence
        Further unknowns at the start, and their magnitudes.
    odd_laws : sequence of LawNumbers
        Laws of symmetric motions, see `Shooting`.
    """

    measures_periods = True

    def __init__(self, case: Case, values, scales, odd_laws=()):
        place = case.y.size - N_INTEGRALS - N_FACE_INTEGRALS * case.rig.faces.shape[0]
        self.extra = place + np.arange(len(values))
        places = np.full(len(values), place)
        rig = case.rig._replace(scales=np.insert(case.rig.scales, places, scales))
        super().__init__(replace(case, rig=rig, y=np.insert(case.y, places, values)), odd_laws)

    @abstractmethod
    def set_extra(self, values) -> None:
        """Give the rig of the next period the further unknowns (e,)."""

    @abstractmethod
    def find_conditions(self, before: State) -> np.ndarray:
        """Return the residuals (e,) of the conditions in the period from a state, as changes of the further unknowns."""

    def advance(self, state: State) -> State:
        """Return the state a period after another one, its further unknowns corrected by the conditions."""
        self.set_extra(state.y[self.extra])
        before = self.load_loops(state)
        before.y[self.extra[-1] + 1 :] = 0.0
        end = super().advance(before)
        end.y[self.extra] += self.find_conditions(before)

        slides = self.find_slides(end)
        ranges = self.find_ranges()
        for i in self.loops:
            numbers = self.case.rig.faces[i, Face.NUMBERS :]
            masing.remember_loop(numbers, end.memory[i], ranges[i], slides[i])
        return end

    def has_same_regime(self, before: State) -> bool:
        """Return whether the laws are in the regimes of another state; a symmetric loop begins at either of its ends."""
        columns = [Memory.DIRECTION, Memory.CONTACT]
        return np.array_equal(self.state.memory[:, columns], before.memory[:, columns])

    def find_ranges(self) -> np.ndarray:
        """Return the smallest and largest slide (i, 2) of the interfaces in the last period [m]."""
        return self.record.get_face_extremes(Probe.SLIDE)

    def pack(self, state: State) -> np.ndarray:
        """Return the n states of the motion and the reversal points in one array (k,), the last of them at its end."""
        return np.append(state.y[: self.n], _align(state.memory, 1)[:, Memory.STACK :])

    def unpack(self, state: State, packed) -> State:
        """Return a copy of a state with the values of `pack`."""
        aligned = state._replace(memory=_align(state.memory, 1))
        state = super().unpack(aligned, packed)
        return state._replace(memory=_align(state.memory, -1))

    def find_usable(self, before: State) -> np.ndarray:
        """Return which entries (k,) of the packed state may be unknowns: all displacements at the ends of a loop.

        The forces there follow from the displacements beside them.
        """
        is_used = _find_used(before) & _find_used(self.state)
        is_used &= _align(before.memory, 1)[:, Memory.STACK :] != 0
        is_used[:, 1::2] = False
        return np.append(np.ones(self.n, bool), is_used)

    def find_unknowns(self, before: State) -> np.ndarray:
        """Return the indices of the unknowns in the packed state: what a period changes, and all points of a loop.

        A periodic motion leaves the reversal points of its loop as they were, but they move with it.
        """
        is_unknown = self.find_usable(before)
        is_unknown[: self.n] = self.state.y[: self.n] != before.y[: self.n]
        is_unknown[: 2 * self.case.rig.modes.shape[1]] = True
        is_unknown[self.extra] = True
        return np.flatnonzero(is_unknown)

    def find_change(self, state: State, end) -> np.ndarray:
        """Return the change of the packed state after a period from that of another motion, `end`.

        A reversal point that only one of both motions remembers does not count, because it is not passed again.
        """
        after = self.advance(state)
        change = self.pack(after) - end
        change[self.n :][~_find_used(after).ravel()] = 0.0
        return change

    def load_loops(self, state: State) -> State:
        """Return a copy of a state with the forces that belong to the reversal points of its loops."""
        state = copy_state(state)
        slides = self.find_slides(state)
        for i in self.loops:
            numbers = self.case.rig.faces[i, Face.NUMBERS :]
            masing.load_reversals(numbers, state.memory[i], slides[i])
        return state

    def find_motion_multipliers(self, known: PeriodMap) -> np.ndarray:
        """Return the eigenvalues of the derivatives of a period with given further unknowns."""
        is_motion = ~np.isin(known.columns, self.extra)
        slopes = known.slopes[np.ix_(is_motion, is_motion)]
        return np.linalg.eigvals(slopes) if np.isfinite(slopes).all() else np.full(1, np.nan)


def _align(memory, direction: int) -> np.ndarray:
    """Return memories (M, k) whose last reversal points are in the last columns (direction 1), or as they were (-1)."""
    aligned = memory.copy()
    stacks = aligned[:, Memory.STACK :]
    for row, stack in zip(memory, stacks):
        stack[:] = np.roll(stack, -2 * direction * int(row[Memory.COUNT]))
    return aligned


def _find_used(state: State) -> np.ndarray:
    """Return which entries (M, k) of the aligned stacks the motion depends on.

    It does not depend on the first of more than two reversal points, where it would meet the curve of first loading again.
    """
    count = state.memory[:, Memory.COUNT, None]
    size = state.memory.shape[1] - Memory.STACK
    return np.arange(size) >= size - 2 * count + 2 * (count > 2)


class PathPoint(NamedTuple):
    """Point of a curve.

    - w: (N + 1,) scaled unknowns, and the parameter
    - motion: periodic motion with its stability
    - state: extended state at its start
    - map: derivatives of the extended map of a period
    """

    w: np.ndarray
    motion: PeriodicMotion
    state: State
    map: PeriodMap


@dataclass(frozen=True, eq=False, slots=True)
class CurvePath:
    """Curve of periodic motions.

    - points: list of PathPoint in order of arc length
    - folds, fold_errors: parameters at the folds, from a cubic between neighbouring points, and their errors
    - ended: "end" at the bound in the first direction; "start" if the curve returned to the other bound; "loop" if it has
      closed; "points" after the largest number of points; "step" if no step was short enough; "cost" if its motions have
      taken too many steps
    """

    points: list[PathPoint]
    folds: tuple[float, ...]
    fold_errors: tuple[float, ...]
    ended: str


class MotionCurve(ExtendedShooting):
    """Periodic motions of a rig over a parameter of its drive, which is an unknown of the map of a period.

    Parameters
    ----------
    make_case : callable
        Function of the parameter that returns the `Case` of a period.
    start : State
        State at the start of a period near the first point. The size of this motion is the unit of the unknowns.
    parameter : float
        Frequency [rad/s] or level [m s-2] of the drive there.
    has_kinks : bool
        Whether a law has many elements, see `periodic.find_periodic_motion`.
    """

    def __init__(
        self, make_case: Callable[[float], Case], start: State, parameter: float, *, has_kinks: bool
    ):
        self.make_case = make_case
        self.plain = make_case(parameter)
        self.width = abs(parameter) or 1.0
        super().__init__(self.plain, [parameter], [self.width])
        self.limit_steps(MAX_STEPS)
        self.tolerance = MAX_CHANGE * float(self.case.rig.settings[Setting.RTOL])
        if has_kinks:
            self.tolerance = max(self.tolerance, MAX_KINKED_CHANGE)

        # The laws take the memory of the loop from periods with the given parameter, which no condition changes.
        self.state.y[: self.n - 1] = start.y[: self.n - 1]
        self.state.memory[:] = start.memory
        self.aimed = self.normal = np.zeros(self.pack(self.state).size)
        self.relax(N_FIRST)
        self.size = np.append(self.scales()[:-1], 1.0)

    def set_extra(self, values) -> None:
        """Give the rig of the next period its parameter (1,)."""
        self.plain = self.make_case(float(values[0]))
        old = self.case.rig
        settings = self.plain.rig.settings.copy()
        settings[Setting.MAX_STEPS] = old.settings[Setting.MAX_STEPS]
        self.period = float(settings[Setting.PERIOD])
        rig = self.plain.rig._replace(settings=settings, scales=old.scales)
        self.case = replace(self.case, rig=rig, ends=np.array([self.period]))

    def find_conditions(self, before: State) -> np.ndarray:
        """Return the negative distance (1,) of a state from the plane of its search, as a change of the parameter."""
        return np.array([-self.width * float(self.normal @ (self.pack(before) - self.aimed))])

    def find_excess(self, step, start) -> float:
        """Return the arc length of a Newton step, relative to MAX_CORRECTION."""
        return float(np.linalg.norm(step[: self.n] / self.size / self.unit)) / MAX_CORRECTION

    def read_w(self, state: State) -> np.ndarray:
        """Return the scaled unknowns and the parameter (N + 1,) of a state."""
        return state.y[: self.n] / self.size

    def make_normal(self, direction, unit) -> np.ndarray:
        """Return a direction (N + 1,) in units (N + 1,) of w as the normal (K,) of a plane of packed states."""
        normal = np.zeros(self.aimed.size)
        normal[: self.n] = direction / unit / self.size
        return normal

    def find_tangent(self, point: PathPoint, direction, unit) -> np.ndarray:
        """Return the change of the packed state along a curve per arc length.

        Parameters
        ----------
        point : PathPoint
            Point of the curve.
        direction : (N + 1,) array
            Scaled direction to which the tangent points.
        unit : (N + 1,) array
            Sizes by which differences of w are divided.
        """
        known = point.map
        matrix = np.eye(known.columns.size) - known.slopes
        place = int(np.searchsorted(known.columns, self.extra[0]))
        matrix[place] = self.make_normal(direction, unit)[known.columns] * known.scale
        right_side = np.eye(known.columns.size)[place]
        # Singular values of a singular matrix are below it, relative to the largest
        scaled = np.linalg.lstsq(matrix, right_side, rcond=1e-12)[0]
        tangent = np.zeros(self.aimed.size)
        tangent[known.columns] = known.scale * scaled
        return tangent / np.linalg.norm(tangent[: self.n] / self.size / unit)

    def differentiate(self, before: State) -> tuple[PeriodMap, np.ndarray]:
        """Return the derivatives of the map of a period, those of its condition exactly, and the change over the period."""
        known, change = super().differentiate(before)
        place = int(np.searchsorted(known.columns, self.extra[0]))
        slopes = known.slopes.copy()
        slopes[place] = -self.normal[known.columns] * known.scale * self.width / known.scale[place]
        slopes[place, place] += 1.0
        self.map = known._replace(slopes=slopes)
        return self.map, change

    def describe(self, before: State) -> PathPoint:
        """Return the point of the curve whose motion begins at a state, with its Floquet multipliers."""
        self.state = self.advance(before)
        self.map = None
        known, change = self.differentiate(before)
        multipliers = self.find_motion_multipliers(known)
        if np.abs(multipliers).max(initial=0.0) >= MAX_STABLE_MULTIPLIER:
            # Differences in the other direction do not pass the same kink of a law.
            self.difference *= -1
            self.map = None
            other = self.find_motion_multipliers(self.differentiate(before)[0])
            self.difference *= -1
            multipliers = min(multipliers, other, key=lambda found: np.abs(found).max())
        self.map = known
        error = self.find_multipliers(before)[1]

        # The measures are those of a period without the further unknown.
        self.set_extra(before.y[self.extra])
        start = make_arrays(self.plain)[0]
        loops = self.load_loops(before)
        start.y[: self.n - 1] = before.y[: self.n - 1]
        start.memory[:] = loops.memory
        motion = PeriodicMotion(
            run_case(self.plain, start=start),
            float(np.abs(change).max(initial=0.0)),
            error,
            self.tolerance,
            multipliers[np.argsort(-np.abs(multipliers))],
            self.n_periods,
        )
        return PathPoint(self.read_w(before), motion, before, known)

    def _find_point(self, guess, near: PathPoint, direction, unit) -> tuple[PathPoint, int] | None:
        """Return the point of a curve in a plane, and the number of periods of its search; None without convergence.

        Parameters
        ----------
        guess : (K,) array
            Packed state in the plane, from which the search begins.
        near : PathPoint
            Point whose regimes and derivatives are used first.
        direction, unit : (N + 1,) array
            Normal of the plane in units of w: the tangent of the curve, or the parameter, which then keeps its value.
        """
        self.state = self.unpack(near.state, guess)
        self.aimed = guess
        self.normal = self.make_normal(direction, unit)
        self.unit = unit
        self.map = near.map
        with np.errstate(invalid="ignore", over="ignore"):
            found = self.find_fixed_point(self.tolerance)
        return None if found is None else (self.describe(found[0]), found[1])

    def _find_crossing(self, w, near: PathPoint) -> PathPoint | None:
        """Return the point with the parameter of a guess w (N + 1,), from another point; None if it is not found."""
        guess = self.pack(near.state)
        guess[: self.n] = w * self.size
        unit = np.full(w.size, float(np.linalg.norm(w[:-1])) or 1.0)
        unit[-1] = self.width
        found = self._find_point(guess, near, np.eye(w.size)[-1], unit)
        return None if found is None else found[0]

    def follow(
        self, bounds: tuple[float, float], settings: PathSettings, *, forward: bool = True
    ) -> CurvePath:
        """Follow the curve from its start.

        Parameters
        ----------
        bounds : tuple
            Lowest and highest value of the parameter; the last point lies on one of them.
        settings : PathSettings
            Steps along the curve.
        forward : bool
            Whether the parameter increases at first.

        Raises
        ------
        NotConverged
            If the first point is not found.
        """
        low, high = bounds
        w = self.read_w(self.state)
        first = self._find_crossing(w, PathPoint(w, None, self.state, None))
        if first is None:
            raise NotConverged(
                "accuracy.method: the first point of the curve was not found near the given start; "
                'use accuracy.method = "march"'
            )
        points = [first]
        unit = np.full(w.size, float(np.linalg.norm(w[:-1])) or 1.0)
        unit[-1] = high - low
        direction = np.append(np.zeros(w.size - 1), 1.0 if forward else -1.0)
        folds: list[tuple[float, float]] = []
        step = settings.first_step
        ended = "points"

        # A step without a solution is halved. The points found so far are a curve also if the next one costs too much.
        try:
            while len(points) < settings.max_points:
                # The unit of the unknowns rises with their norm, so that steps have the same relative length.
                point = points[-1]
                unit[:-1] = max(unit[0], 0.5 * float(np.linalg.norm(point.w[:-1])))
                tangent = self.find_tangent(point, direction, unit)
                direction = tangent[: self.n] / self.size / unit
                guess = self.pack(point.state) + step * tangent
                taken = self._find_point(guess, point, direction, unit)
                if taken is None or not _is_along(point, taken[0], direction, unit):
                    step /= 2
                    # Smallest step of the arc length
                    if step < 1e-7:
                        ended = "step"
                        break
                    continue

                # The last point lies on the bound that the step passes.
                after, n_periods = taken
                if not low <= after.w[-1] <= high:
                    bound = high if after.w[-1] > high else low
                    last = self._find_crossing(_interpolate(point, after, bound), point)
                    points += [last] * (last is not None)
                    ended = "end" if (bound == high) == forward else "start"
                    break

                is_closed = _is_on_curve(after, points, direction, unit)
                points.append(after)
                tangent = self.find_tangent(after, direction, unit)
                tangents = (direction, tangent[: self.n] / self.size / unit)
                folds += _find_folds(points[-2:], tangents, unit, step)
                if is_closed:
                    ended = "loop"
                    break
                step = min(step * _step_factor(n_periods), settings.max_step)
        except NotConverged:
            ended = "cost"
        values, errors = tuple(zip(*folds)) or ((), ())
        return CurvePath(points, values, errors, ended)

    def find_between(
        self, first: PathPoint, second: PathPoint, fraction: float, width: float
    ) -> PathPoint | None:
        """Return the point of a curve at a fraction of the step between two points, or None if it is not found.

        The linear interpolation is corrected perpendicularly to the step, so that folds are no obstacle.

        Parameters
        ----------
        first, second : PathPoint
            Points at the ends of the step.
        fraction : float
            Fraction of the step.
        width : float
            Change of the parameter that counts as 1.
        """
        self.n_steps = 0.0
        unit = find_unit(first, second, width)
        step = (second.w - first.w) / unit
        guess = self.pack(first.state)
        guess[: self.n] = (first.w + fraction * (second.w - first.w)) * self.size
        found = self._find_point(guess, first, step / np.linalg.norm(step), unit)
        return None if found is None else found[0]

    def list_crossings(self, path: CurvePath, parameter: float) -> list[PathPoint]:
        """Return the points at which a path passes a value of the parameter, in their order."""
        found = []
        for first, second in zip(path.points[:-1], path.points[1:]):
            if (first.w[-1] > parameter) != (second.w[-1] > parameter):
                self.n_steps = 0.0
                point = self._find_crossing(_interpolate(first, second, parameter), first)
                found += [point] * (point is not None)
        return found


def _interpolate(first: PathPoint, second: PathPoint, parameter: float) -> np.ndarray:
    """Return the point w (N + 1,) of the line through two points that has a parameter."""
    fraction = (parameter - first.w[-1]) / (second.w[-1] - first.w[-1])
    return np.append((first.w + fraction * (second.w - first.w))[:-1], parameter)


def _step_factor(n_periods: int) -> float:
    """Return the ratio of the next step to the last one, above 1 if the search took few periods."""
    if n_periods <= 5:
        return 1.5
    return 1.1 if n_periods <= 7 else 0.6


def _is_along(point: PathPoint, after: PathPoint, direction, unit) -> bool:
    """Return whether a step between two points follows a direction (N + 1,) in units (N + 1,) of w; else it is a jump."""
    taken = (after.w - point.w) / unit
    return float(taken @ direction) > MIN_STEP_COSINE * float(np.linalg.norm(taken))


def _is_on_curve(point: PathPoint, points: list[PathPoint], direction, unit) -> bool:
    """Return whether a point lies on an earlier step of the curve, so that the curve has closed and would be followed again.

    `points` are those of the curve in their order, `direction` (N + 1,) is that of the last step, and the distances are
    scaled by `unit` (N + 1,).
    """
    places = np.array([other.w for other in points]) / unit
    starts = places[:-2]
    steps = np.diff(places[:-1], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    to_point = point.w / unit - starts
    along = np.sum(to_point * steps, axis=1) / lengths
    across = np.linalg.norm(to_point - (along / lengths)[:, None] * steps, axis=1)
    # Distance from an earlier step, relative to its length, at which a curve has closed
    is_between = (along >= 0) & (along <= lengths) & (across < 0.05 * lengths)
    is_parallel = steps @ direction > MIN_STEP_COSINE * lengths
    return bool((is_between & is_parallel).any())


def _find_folds(
    points: list[PathPoint], tangents, unit, length: float
) -> list[tuple[float, float]]:
    """Return the parameter at a fold between two points that follow each other, and its error, [] without a fold.

    The parameter is a cubic of the distance along the tangent at the first point, and a fold is its extreme. The error is
    the largest distance from the extremes of the parabolas that have one of the points and both slopes.

    Parameters
    ----------
    points : list of PathPoint
        Both points.
    tangents : (2, N + 1) array
        Unit tangents there in units of w.
    unit : (N + 1,) array
        Sizes by which differences of w are divided.
    length : float
        Scaled arc length between the points.
    """
    slopes = np.array([tangents[0][-1], tangents[1][-1]])
    if slopes[0] * slopes[1] >= 0:
        return []
    # Smallest cosine between two tangents in the cubic through a fold
    slopes[1] /= max(float(tangents[0] @ tangents[1]), 0.1)
    slopes *= unit[-1]
    parameters = np.array([point.w[-1] for point in points])
    curve = CubicHermiteSpline([0.0, length], parameters, slopes)
    places = curve.derivative().roots(extrapolate=False)
    extremes = parameters + 0.5 * slopes * np.array([1, -1]) * length * slopes / np.ptp(slopes)
    if not places.size:
        return []
    fold = float(curve(places[0]))
    return [(fold, float(np.abs(extremes - fold).max()))]


def find_unit(first: PathPoint, second: PathPoint, width: float) -> np.ndarray:
    """Return the sizes (N + 1,) by which the difference of two points of a curve is divided.

    Parameters
    ----------
    first, second : PathPoint
        Points of the curve.
    width : float
        Change of the parameter that counts as 1.
    """
    size = max(float(np.linalg.norm(point.w[:-1])) for point in (first, second)) or 1.0
    return np.append(np.full(first.w.size - 1, size), width)


def measure_distance(first: PathPoint, second: PathPoint, width: float) -> float:
    """Return the distance between two points of a curve in scaled unknowns and parameter.

    Parameters
    ----------
    first, second : PathPoint
        Points of the curve.
    width : float
        Change of the parameter that counts as 1.
    """
    return float(np.linalg.norm((second.w - first.w) / find_unit(first, second, width)))
