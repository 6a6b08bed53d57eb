"""Curves of periodic motions over frequency or level of the drive, through their folds.

A point of a curve is a fixed point of the map of a period (`periodic`). The unknowns are the modes and the states of the
laws at phase 0. The reversal points that the laws remember there follow from them over a period, so that they are
eliminated.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from .cases import Case
from .continuation import (
    Curve,
    CurvePath,
    Guess,
    PathEquations,
    PathPoint,
    PathSettings,
    correct_point,
    find_point,
    follow_curve,
)
from .laws import masing
from .periodic import (
    MASING,
    MAX_CHANGE,
    MAX_KINKED_CHANGE,
    MAX_STABLE_MULTIPLIER,
    PeriodicMotion,
    Shooting,
    copy_state,
)
from .records import Face, Memory, Probe, Setting, State
from .runs import run_case

MAX_STEPS = 6e6  # steps of the engine over all periods of a curve, which take about a minute
N_FIRST = 2  # periods in which the laws take the memory of the loop of a motion from another map


class CurveStart(NamedTuple):
    """Motion from which a curve is followed.

    - state: state at the start of a period
    - parameter: frequency [rad/s] or level [m s-2] of the drive
    """

    state: State
    parameter: float


class LoopShooting(Shooting):
    """Map of a period after which the laws remember the loop of this period alone.

    Larger motions of the past would otherwise shift the loop for ever, and the map would have a kink at each periodic
    motion, because its reversals neither exceed those of the period before nor fall short of them. The ends of this loop
    are measured.
    """

    measures_periods = True

    def advance(self, state: State) -> State:
        """Return the state a period after another one, whose clock starts at 0."""
        faces = self.case.rig.faces
        n_modes = self.case.rig.modes.shape[1]
        end = super().advance(self.load_loops(state))
        slides = self.case.rig.rows[0] @ end.y[:n_modes]
        ranges = self.find_ranges()
        for i in np.flatnonzero(faces[:, Face.LAW] == MASING):
            masing.remember_loop(faces[i, Face.NUMBERS :], end.memory[i], ranges[i], slides[i])
        return end

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

    def find_unknowns(self, before: State) -> np.ndarray:
        """Return the indices of the unknowns in the packed state: what a period changes, and all points of a loop.

        A periodic motion leaves the reversal points of its loop as they were, but they move with it.
        """
        start = self.pack(before)
        is_unknown = self.pack(self.state) != start
        is_unknown[: 2 * self.case.rig.modes.shape[1]] = True
        is_used = _find_used(before) & _find_used(self.state)
        is_unknown[self.n :] = is_used.ravel() & (start[self.n :] != 0)
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
        faces = self.case.rig.faces
        slides = self.case.rig.rows[0] @ state.y[: self.case.rig.modes.shape[1]]
        for i in np.flatnonzero(faces[:, Face.LAW] == MASING):
            masing.load_reversals(faces[i, Face.NUMBERS :], state.memory[i], slides[i])
        return state


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


class Reversals(NamedTuple):
    """Reversal points of the laws at phase 0, which follow from the unknowns of a curve.

    - columns: (m,) their places in the memory
    - gain: (N, m) change of the residual per change of the reversal points over a period
    - own: (m, m) negative correction of the reversal points per change over a period
    - by_motion: (m, N + 1) derivatives by unknowns and parameter
    - w: (N + 1,) unknowns and parameter of the last period
    - change: (m,) change of the reversal points over it
    """

    columns: np.ndarray
    gain: np.ndarray
    own: np.ndarray
    by_motion: np.ndarray
    w: np.ndarray
    change: np.ndarray

    def predict(self, w) -> np.ndarray:
        """Return the change (m,) of the reversal points to unknowns and parameter w (N + 1,)."""
        return self.by_motion @ (w - self.w) - self.own @ self.change


class PeriodEquations:
    """Equations of the periodic motions of a rig over a parameter of its drive.

    Parameters
    ----------
    make_case : callable
        Function of the parameter that returns the `Case` of a period.
    start : CurveStart
        Motion near the first point. Its size is the unit of the unknowns.
    has_kinks : bool
        Whether a law has many elements, see `periodic.find_periodic_motion`.
    """

    def __init__(self, make_case: Callable[[float], Case], start: CurveStart, *, has_kinks: bool):
        self.make_case = make_case
        self.start = start
        self.n_steps = 0.0
        shooting = self._make_shooting(start.parameter)
        shooting.state = start.state
        shooting.relax(N_FIRST)
        self.n = shooting.n
        self.scale = shooting.scales()
        self.before = shooting.state
        self.reversals: Reversals | None = None
        self.tolerance = MAX_CHANGE * float(shooting.case.rig.settings[Setting.RTOL])
        if has_kinks:
            self.tolerance = max(self.tolerance, MAX_KINKED_CHANGE)

    @property
    def curve(self) -> Curve:
        """Equations for the continuation."""
        return Curve(self.find_residual, self.differentiate, self.restart)

    def _make_shooting(self, parameter: float) -> LoopShooting:
        """Return the map of a period at a value of the parameter."""
        shooting = LoopShooting(self.make_case(float(parameter)))
        shooting.limit_steps(MAX_STEPS)
        shooting.n_steps = self.n_steps
        return shooting

    def _advance(self, x, parameter: float) -> tuple[LoopShooting, State]:
        """Return the map with the state after a period, and the state before it, with the memory that belongs to it.

        `x` (N,) are the unknowns, divided by their scale, and `parameter` is that of the drive.
        """
        shooting = self._make_shooting(parameter)
        w = np.append(x, parameter)
        packed = shooting.pack(self.before)
        packed[: self.n] = x * self.scale
        if self.reversals is not None:
            packed[self.reversals.columns] += self.reversals.predict(w)
        before = shooting.unpack(self.before, packed)
        shooting.state = shooting.advance(before)
        self.n_steps = shooting.n_steps

        # In another regime the reversal points are those that the period has left.
        regime = [Memory.DIRECTION, Memory.CONTACT]
        is_same = np.array_equal(shooting.state.memory[:, regime], before.memory[:, regime])
        if self.reversals is not None and is_same:
            change = shooting.pack(shooting.state) - packed
            change[self.n :][~_find_used(shooting.state).ravel()] = 0.0
            change = change[self.reversals.columns]
            self.reversals = self.reversals._replace(w=w, change=change)
            self.before = before
        else:
            self.reversals = None
            self.before = copy_state(shooting.state)
        return shooting, before

    def find_residual(self, x, parameter: float) -> np.ndarray:
        """Return the change (N,) of the unknowns over a period, in units of their scale; arguments as `_advance`."""
        shooting, before = self._advance(x, parameter)
        residual = (shooting.state.y - before.y)[: self.n] / self.scale
        if self.reversals is not None:
            residual += self.reversals.gain @ self.reversals.change
        return residual

    def differentiate(self, x, parameter: float) -> PathEquations:
        """Return the derivatives of the change over a period, and the `PeriodicMotion` as their details.

        They are NaN far from any motion, where that of the next period is not finite.
        """
        shooting, before = self._advance(x, parameter)
        linear, change = shooting.differentiate(before)
        columns = linear.columns
        is_motion = columns < self.n

        # Derivatives by the parameter, all in units of the curve.
        step = shooting.difference * parameter
        end = shooting.pack(shooting.state)
        other = self._make_shooting(parameter + step).find_change(before, end)
        by_parameter = other[columns] / linear.scale / step
        unit = linear.scale.copy()
        unit[is_motion] /= self.scale[columns[is_motion]]
        slopes = unit[:, None] * (linear.slopes - np.eye(columns.size)) / unit
        matrix = np.column_stack([slopes, unit * by_parameter])

        # The reversal points m follow from the unknowns: (M - 1) dm + ... = -change.
        is_kept = np.append(is_motion, True)
        own = matrix[~is_motion][:, ~is_kept]
        own = np.linalg.pinv(own) if np.isfinite(own).all() else np.nan * own.T
        gain = -matrix[is_motion][:, ~is_kept] @ own
        reduced = matrix[is_motion][:, is_kept] + gain @ matrix[~is_motion][:, is_kept]

        # A state that a period does not change keeps its value.
        places = columns[is_motion]
        jacobian = -np.eye(self.n)
        jacobian[np.ix_(places, places)] = reduced[:, :-1]
        slope = np.zeros(self.n)
        slope[places] = reduced[:, -1]

        by_motion = np.zeros((own.shape[0], self.n + 1))
        by_motion[:, np.append(places, self.n)] = -own @ matrix[~is_motion][:, is_kept]
        whole_gain = np.zeros((self.n, own.shape[0]))
        whole_gain[places] = gain
        left = (end - shooting.pack(before))[columns[~is_motion]]
        self.before = before
        self.reversals = Reversals(
            columns[~is_motion], whole_gain, own, by_motion, np.append(x, parameter), left
        )
        motion = self._describe(shooting, before, change)
        self.n_steps = shooting.n_steps
        memory = (self.before, self.reversals)
        return PathEquations(jacobian, slope, motion, motion.change, memory)

    def _describe(self, shooting: LoopShooting, before: State, change) -> PeriodicMotion:
        """Return the motion over the period from a point of the curve, with its Floquet multipliers.

        Parameters
        ----------
        shooting : Shooting
            Map of a period with its derivatives and the state after a period.
        before : State
            State at the start of the period.
        change : (k,) array
            Change over the period in the unknowns of the map.
        """
        multipliers, error = shooting.find_multipliers(before)
        if np.abs(multipliers).max(initial=0.0) >= MAX_STABLE_MULTIPLIER:
            # Differences in the other direction do not pass the same kink of a law.
            shooting.difference *= -1
            shooting.map = None
            other = shooting.find_multipliers(before)[0]
            multipliers = min(multipliers, other, key=lambda found: np.abs(found).max())
        return PeriodicMotion(
            run_case(shooting.case, start=shooting.load_loops(before)),
            float(np.abs(change).max(initial=0.0)),
            error,
            self.tolerance,
            multipliers[np.argsort(-np.abs(multipliers))],
            shooting.n_periods,
        )

    def follow(
        self, bounds: tuple[float, float], settings: PathSettings, *, forward: bool = True
    ) -> CurvePath:
        """Follow the curve from its start. The details of a point are its `PeriodicMotion`.

        Parameters
        ----------
        bounds : tuple
            Lowest and highest value of the parameter.
        settings : PathSettings
            Steps along the curve; its tolerance is replaced by that of the map.
        forward : bool
            Whether the parameter increases at first.
        """
        settings = settings._replace(tolerance=self.tolerance)
        x = self.before.y[: self.n] / self.scale
        return follow_curve(self.curve, x, self.start.parameter, bounds, settings, forward=forward)

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
        unit = find_unit(first, second, width)
        step = (second.w - first.w) / unit
        tangent = step / np.linalg.norm(step)
        guess = Guess(first.w + fraction * (second.w - first.w), tangent, unit)
        self.n_steps = 0.0
        self.restart(first)
        found = correct_point(self.curve, first, guess, self.tolerance)
        return None if found is None else found[0]

    def restart(self, point: PathPoint) -> None:
        """Begin the next correction at a point of the curve."""
        self.before = point.equations.memory[0]
        self.reversals = point.equations.memory[1]

    def list_crossings(self, path: CurvePath, parameter: float) -> list[PathPoint]:
        """Return the points at which a path passes a value of the parameter, in their order."""
        found = []
        for first, second in zip(path.points[:-1], path.points[1:]):
            before = first.w[-1]
            after = second.w[-1]
            if (before > parameter) == (after > parameter):
                continue
            guess = first.w + (parameter - before) / (after - before) * (second.w - first.w)
            guess[-1] = parameter
            self.n_steps = 0.0
            self.restart(first)
            point = find_point(self.curve, first, guess, self.tolerance)
            found += [point] * (point is not None)
        return found


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
