"""Periodic motions by the shooting method: Newton's method on the map of a state over one period.

A motion with the numbers x at phase 0 of the drive is periodic where P(x) = x, with the map P over
a period, or over half a period with the sign changed. Newton's step solves (P' - 1) dx = x - P(x)
with every number divided by its size, and is shortened until the residual decreases. Where no fraction
of the step reduces it, the engine integrates the motion further, longer every time, and the search continues from the end
of the run. The eigenvalues of P' are the Floquet multipliers: the factors by which a period
multiplies a small disturbance.

An engine gives its map as a `Shooting`. Method: Leine and Nijmeijer, Dynamics and Bifurcations of
Non-Smooth Mechanical Systems, 2004, ch. 7; damping as in Deuflhard 2004.
"""

from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ..core import NotConverged

# Fractions of the Newton step that are tried in turn until the residual decreases.
STEP_FRACTIONS = 1.0, 0.5, 0.2, 0.05
# Largest number of Newton steps.
MAX_STEPS = 40
# Largest residual of a periodic motion, relative to the motion of a free mass under the drive.
MAX_FREE_MASS_RESIDUAL = 1e-6
# Largest motion that a step may lead to, relative to that of a free mass; it is a resonance
# with a damping ratio of 5e-10.
MAX_SIZE = 1e9
# Number of periods of each of the two runs that test whether the motion grows.
N_GROWTH_PERIODS = 60
# Largest distance of the largest multiplier from 1 at which the motion
# counts as undamped (cf. MAX_SIZE).
UNDAMPED_TOL = 2e-9
# Residual at round-off level, which a further step would not reduce.
ROUND_OFF_RESIDUAL = 1e-14
# Largest excess of the magnitude of a multiplier over 1 that is attributed to round-off.
UNIT_CIRCLE_TOL = 1e-5


@dataclass(eq=False, slots=True)
class MappedPoint:
    """State of a motion and the state to which the map over one period takes it.

    - point, image: state at the start and at the end of the period, of the class that the engine uses
    - slope: (m, m) derivative of the numbers at the end with respect to those at the start
    - scale: (m,) sizes of the numbers
    - residual: (m,) numbers at the start minus those at the end, over `scale`
    - size: size of the motion, relative to that of a free mass under the drive
    - has_same_numbers: whether start and end have the same numbers; if not, `residual` belongs to
      the common numbers, and `slope` gives no Newton step
    - has_same_elements: whether start and end also have the same state of their elements
    - fixed: (k,) indices of the numbers that a Newton step must not change
    - max_residual: largest magnitude of `residual`
    """

    point: Any
    image: Any
    slope: np.ndarray
    scale: np.ndarray
    residual: np.ndarray
    size: float
    has_same_numbers: bool = True
    has_same_elements: bool = True
    fixed: np.ndarray | tuple = ()
    max_residual: float = field(init=False)

    def __post_init__(self):
        self.max_residual = float(np.abs(self.residual).max())

    def is_periodic(self, tolerance: float) -> bool:
        """Return whether the motion is periodic within a tolerance, relative to its size."""
        return (
            self.max_residual <= tolerance
            and self.max_residual * self.size <= MAX_FREE_MASS_RESIDUAL
            and self.has_same_numbers
            and self.has_same_elements
        )

    def newton_step(self) -> np.ndarray:
        """Return the Newton step (m,) towards the fixed point of the map.

        It is a least-squares step if the rest position of an interface is not unique.

        """
        scale = self.scale
        step = np.zeros(scale.size)
        matrix = (self.slope - np.eye(scale.size)) * scale / scale[:, None]
        if not len(self.fixed):
            return solve_linear(matrix)(self.residual) * scale
        is_free = self._find_free_numbers()
        step[is_free] = solve_linear(matrix[np.ix_(is_free, is_free)])(self.residual[is_free])
        return step * scale

    def multipliers(self) -> np.ndarray:
        """Return the Floquet multipliers of the state in decreasing order of magnitude."""
        is_free = self._find_free_numbers()
        return find_multipliers(self.slope[np.ix_(is_free, is_free)])

    def _find_free_numbers(self) -> np.ndarray:
        is_free = np.ones(self.scale.size, bool)
        is_free[list(self.fixed)] = False
        return is_free


class MotionGrows(NotConverged):
    """Error: the motion grows by the same amount in every period, so it never becomes periodic.

    - mapped_point: last MappedPoint of the search
    - n_steps: number of Newton steps
    """

    def __init__(self, mapped_point: MappedPoint, n_steps: int):
        super().__init__(
            "dynamics: no periodic motion was found, because the motion grows from period to period"
        )
        self.mapped_point = mapped_point
        self.n_steps = n_steps


class PeriodicPoint(NamedTuple):
    """State of a periodic motion found by shooting, and the number of Newton steps."""

    mapped_point: MappedPoint
    n_steps: int


class Shooting:
    """Shooting method for periodic motions, based on a solver that maps a state over one period."""

    def map_point(self, point) -> MappedPoint:
        """Integrate a state over one period; return the state, its image and the derivative of the map.

        Raises NotConverged if the engine does not reach the end of the period.

        """
        raise NotImplementedError

    def move_by_newton_step(self, mapped_point: MappedPoint, step):
        """Return the state that is reached from a mapped point by a Newton step (m,)."""
        raise NotImplementedError

    def march_periods(self, mapped_point: MappedPoint, n_periods: int):
        """Integrate over several periods, beginning at the image of a mapped point; return the state."""
        raise NotImplementedError

    def is_growing(self, mapped_point: MappedPoint) -> bool:
        """Return whether the motion grows without bound.

        This is the case if no perturbation decays and two runs increase the motion by the same amount.

        """
        if not mapped_point.has_same_numbers:
            return False
        if np.abs(mapped_point.multipliers()).max(initial=0.0) < 1 - UNDAMPED_TOL:
            return False
        sizes = [mapped_point.size]
        for _ in range(2):
            mapped_point = self.map_point(self.march_periods(mapped_point, N_GROWTH_PERIODS))
            sizes.append(mapped_point.size)
        first, second = np.diff(sizes)
        return bool(first > 1e-6 * sizes[0] and second > 0.99 * first)

    def find_periodic_point(
        self, point, n_periods: tuple = (10, 160), tolerance: float = 1e-12
    ) -> PeriodicPoint:
        """Find the periodic motion close to a given state by damped Newton iteration.

        Parameters
        ----------
        point
            Initial guess of the state.
        n_periods : tuple, optional
            Number of periods of the first and of the longest integration after a failed Newton step.
        tolerance : float, optional
            Largest residual relative to the size of the motion.

        Returns
        -------
        PeriodicPoint

        Raises
        ------
        MotionGrows
            If the motion grows from period to period.
        NotConverged
            If MAX_STEPS steps and the runs between them do not reach a periodic motion.
        """
        mapped_point = self.map_point(point)
        for n_steps in range(MAX_STEPS):
            is_periodic = mapped_point.is_periodic(tolerance)
            if is_periodic and mapped_point.max_residual <= ROUND_OFF_RESIDUAL:
                return PeriodicPoint(mapped_point, n_steps)
            fractions = STEP_FRACTIONS[:1] if is_periodic else STEP_FRACTIONS
            better = self._damped_newton_step(mapped_point, fractions)
            # A last full step squares the residual, unless it changes the set of numbers.
            if is_periodic:
                if better is None or not better.has_same_numbers:
                    better = mapped_point
                return PeriodicPoint(better, n_steps)
            if better is not None:
                mapped_point = better
                continue
            mapped_point = self.map_point(self.march_periods(mapped_point, n_periods[0]))
            n_periods = (min(2 * n_periods[0], n_periods[1]), n_periods[1])
            if self.is_growing(mapped_point):
                raise MotionGrows(mapped_point, n_steps + 1)
        raise NotConverged(
            f"dynamics: no periodic motion was found in {MAX_STEPS} steps of Newton's method; start from a "
            'motion closer to the periodic motion, or use accuracy.method = "march"'
        )

    def _damped_newton_step(self, mapped_point: MappedPoint, fractions) -> MappedPoint | None:
        """Take the largest of several fractions of a Newton step that reduces the residual.

        The result is None if no fraction does.

        """
        if not mapped_point.has_same_numbers:
            return None
        step = mapped_point.newton_step()
        for fraction in fractions:
            try:
                trial = self.map_point(self.move_by_newton_step(mapped_point, fraction * step))
            except NotConverged:
                continue
            # The relative residual of an unbounded motion decreases as the step
            # grows, so the size is limited.
            max_residual = (1 - 0.4 * fraction) * mapped_point.max_residual
            if trial.max_residual < max_residual and trial.size <= MAX_SIZE:
                return trial
        return None


def solve_linear(matrix):
    """Return a function that solves the linear system with a matrix (n, n) for a right-hand side b.

    The least-squares solution is returned if the matrix is singular, for example if nothing determines a mean
    displacement or a rest position.
    """
    factors, pivots, _ = dgetrf(matrix)
    sizes = np.abs(factors.diagonal())
    if np.isfinite(sizes).all() and sizes.min(initial=np.inf) > 1e-13 * sizes.max(initial=0.0):
        return lambda b: dgetrs(factors, pivots, b)[0]
    if not np.isfinite(matrix).all():
        return lambda b: np.full(b.shape, np.nan)
    return lambda b: np.linalg.lstsq(matrix, b, rcond=1e-12)[0]


def bound_error(residual: float, multipliers) -> float:
    """Return an upper bound of the relative error of a periodic motion, given its residual.

    It grows as one of the Floquet multipliers (m,) approaches 1.
    """
    distance = float(np.abs(1 - np.asarray(multipliers)).min(initial=1.0))
    return residual / max(distance, 1e-12)


def find_multipliers(matrix) -> np.ndarray:
    """Return the Floquet multipliers (s,) of a monodromy matrix in order of decreasing magnitude."""
    multipliers = np.linalg.eigvals(matrix)
    return multipliers[np.argsort(-np.abs(multipliers))]


def is_stable(multipliers) -> bool:
    """Return whether a motion is stable, that is, no Floquet multiplier (s,) exceeds 1 in magnitude."""
    return bool(np.abs(multipliers).max(initial=0.0) <= 1 + UNIT_CIRCLE_TOL)
