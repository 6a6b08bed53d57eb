"""Periodic motions by Newton's method on the map of an engine over a period (shooting).

A motion with the numbers x at phase 0 of the drive is periodic where P(x) = x, with the map P over
a period, or over half a period with the sign changed. Newton's step solves (P' - 1) dx = x - P(x)
with every number over its size, and is shortened until the residual decreases. Where no fraction
of the step reduces it, the engine runs on, longer every time, and the search continues from the end
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

# fractions of Newton's step that are tried
STEP_FRACTIONS = 1.0, 0.5, 0.2, 0.05
# largest number of steps of Newton's method
MAX_STEPS = 40
# largest residual of a periodic motion, over the motion of a free mass under the drive
MAX_FREE_MASS_RESIDUAL = 1e-6
# largest size of a motion to which a step may lead: that of a mode with a damping ratio of 5e-10
MAX_SIZE = 1e9
# periods of each run that shows whether the motion grows
N_GROWTH_PERIODS = 60
# distance of the largest multiplier from 1, below which nothing is damped: a size of MAX_SIZE
UNDAMPED_TOL = 2e-9
# residual that a further step would not reduce
ROUND_OFF_RESIDUAL = 1e-14
# excess of a multiplier over 1 that is round-off
UNIT_CIRCLE_TOL = 1e-5


@dataclass(eq=False, slots=True)
class MappedPoint:
    """A point and its image under the map of a period.

    - point, image: of the kind that the engine uses
    - slope: (m, m) derivative of the numbers at the end with respect to those at the start
    - scale: (m,) sizes of the numbers
    - residual: (m,) start minus end, over `scale`
    - size: size of the motion over the motion of a free mass under the drive
    - has_same_numbers: whether start and end have the same numbers; if not, `residual` belongs to
      the numbers that they share, and no Newton step follows from `slope`
    - has_same_elements: whether start and end also have the same state of their elements
    - fixed: (k,) indices of the numbers that no step changes
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
        """Return whether the motion repeats to a tolerance of its size."""
        return (
            self.max_residual <= tolerance
            and self.max_residual * self.size <= MAX_FREE_MASS_RESIDUAL
            and self.has_same_numbers
            and self.has_same_elements
        )

    def newton_step(self) -> np.ndarray:
        """Return Newton's step (m,), in least squares where an interface may rest anywhere."""
        scale = self.scale
        step = np.zeros(scale.size)
        matrix = (self.slope - np.eye(scale.size)) * scale / scale[:, None]
        if not len(self.fixed):
            return solve_linear(matrix)(self.residual) * scale
        is_free = self._find_free_numbers()
        step[is_free] = solve_linear(matrix[np.ix_(is_free, is_free)])(self.residual[is_free])
        return step * scale

    def multipliers(self) -> np.ndarray:
        """Return the Floquet multipliers of the free numbers in decreasing order of magnitude."""
        is_free = self._find_free_numbers()
        return find_multipliers(self.slope[np.ix_(is_free, is_free)])

    def _find_free_numbers(self) -> np.ndarray:
        is_free = np.ones(self.scale.size, bool)
        is_free[list(self.fixed)] = False
        return is_free


class MotionGrows(NotConverged):
    """Error: the motion gains as much in every period, so that it never becomes periodic.

    - mapped_point: the last MappedPoint
    - n_steps: number of Newton steps
    """

    def __init__(self, mapped_point: MappedPoint, n_steps: int):
        super().__init__(
            "dynamics: no periodic motion was found, because the motion grows from period to period"
        )
        self.mapped_point = mapped_point
        self.n_steps = n_steps


class PeriodicPoint(NamedTuple):
    """A periodic motion and the number of Newton steps that led to it."""

    mapped_point: MappedPoint
    n_steps: int


class Shooting:
    """Map of an engine over a period; `find_periodic_point` finds its fixed point."""

    def map_point(self, point) -> MappedPoint:
        """Map a point; raise NotConverged where the engine does not reach the end of the period."""
        raise NotImplementedError

    def step_from(self, mapped_point: MappedPoint, step):
        """Return the point that lies a step (m,) away from a mapped point."""
        raise NotImplementedError

    def run_from(self, mapped_point: MappedPoint, n_periods: int):
        """Return the point that a run from the end of a map reaches after some periods."""
        raise NotImplementedError

    def is_growing(self, mapped_point: MappedPoint) -> bool:
        """Return whether no disturbance decays and two runs add the same size to the motion."""
        if not mapped_point.has_same_numbers:
            return False
        if np.abs(mapped_point.multipliers()).max(initial=0.0) < 1 - UNDAMPED_TOL:
            return False
        sizes = [mapped_point.size]
        for _ in range(2):
            mapped_point = self.map_point(self.run_from(mapped_point, N_GROWTH_PERIODS))
            sizes.append(mapped_point.size)
        first, second = np.diff(sizes)
        return bool(first > 1e-6 * sizes[0] and second > 0.99 * first)

    def find_periodic_point(
        self, point, n_periods: tuple = (10, 160), tolerance: float = 1e-12
    ) -> PeriodicPoint:
        """Find the periodic motion near a point.

        Parameters
        ----------
        point
            Start of the search.
        n_periods : tuple, optional
            Periods of the first run, and of the longest run, where Newton's method leads away.
        tolerance : float, optional
            Residual over the size of the motion.

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
            if is_periodic:  # the last step squares the residual, where it keeps the numbers
                if better is None or not better.has_same_numbers:
                    better = mapped_point
                return PeriodicPoint(better, n_steps)
            if better is not None:
                mapped_point = better
                continue
            mapped_point = self.map_point(self.run_from(mapped_point, n_periods[0]))
            n_periods = (min(2 * n_periods[0], n_periods[1]), n_periods[1])
            if self.is_growing(mapped_point):
                raise MotionGrows(mapped_point, n_steps + 1)
        raise NotConverged(
            f"dynamics: no periodic motion was found in {MAX_STEPS} steps of Newton's method; start from a "
            'motion closer to the periodic motion, or use accuracy.method = "march"'
        )

    def _damped_newton_step(self, mapped_point: MappedPoint, fractions) -> MappedPoint | None:
        """Return a better point by a fraction of Newton's step, None where no fraction leads to one."""
        if not mapped_point.has_same_numbers:
            return None
        step = mapped_point.newton_step()
        for fraction in fractions:
            try:
                trial = self.map_point(self.step_from(mapped_point, fraction * step))
            except NotConverged:
                continue
            # the relative residual of an unbounded motion decreases as a step leads farther, so the
            # size is limited
            max_residual = (1 - 0.4 * fraction) * mapped_point.max_residual
            if trial.max_residual < max_residual and trial.size <= MAX_SIZE:
                return trial
        return None


def solve_linear(matrix):
    """Return a function b -> matrix^-1 b; least squares where the matrix (n, n) is singular.

    The matrix is singular where nothing determines a mean displacement or a position at rest.
    """
    factors, pivots, _ = dgetrf(matrix)
    sizes = np.abs(factors.diagonal())
    if np.isfinite(sizes).all() and sizes.min(initial=np.inf) > 1e-13 * sizes.max(initial=0.0):
        return lambda b: dgetrs(factors, pivots, b)[0]
    if not np.isfinite(matrix).all():
        return lambda b: np.full(b.shape, np.nan)
    return lambda b: np.linalg.lstsq(matrix, b, rcond=1e-12)[0]


def bound_error(residual: float, multipliers) -> float:
    """Return the relative error that a residual leaves in a periodic motion.

    It grows as one of the multipliers (m,) approaches 1.
    """
    distance = float(np.abs(1 - np.asarray(multipliers)).min(initial=1.0))
    return residual / max(distance, 1e-12)


def find_multipliers(matrix) -> np.ndarray:
    """Return the Floquet multipliers (s,) of the map of a period (s, s) in decreasing magnitude."""
    multipliers = np.linalg.eigvals(matrix)
    return multipliers[np.argsort(-np.abs(multipliers))]


def is_stable(multipliers) -> bool:
    """Return whether no multiplier (s,) exceeds 1 in magnitude, apart from round-off."""
    return bool(np.abs(multipliers).max(initial=0.0) <= 1 + UNIT_CIRCLE_TOL)
