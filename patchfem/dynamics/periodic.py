"""Periodic motions by Newton's method on the map of an engine over a period (shooting).

The numbers x of a motion at phase 0 of the drive repeat where P(x) = x, with P the map over a
period, or over half of one with the sign changed. Newton's step solves (P' - 1) dx = x - P(x),
every number over its size, and is shortened until it leads nearer. Where no fraction of it does,
the run goes on, longer every time, and the search continues from there. The eigenvalues of P' are
Floquet's multipliers: what a period makes of a small disturbance.

An engine gives its map as a `Shooting`. Method: Leine and Nijmeijer, Dynamics and Bifurcations of
Non-Smooth Mechanical Systems, 2004, ch. 7; damping as in Deuflhard 2004.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ..core import NotConverged

# fractions of Newton's step that are tried
STEP_FRACTIONS = 1.0, 0.5, 0.2, 0.05
# steps of Newton's method
MAX_STEPS = 40
# miss of a motion that repeats, over the motion of a free mass under the drive
MAX_MISS = 1e-6
# size of a motion to which a step leads: that of a mode with a damping ratio of 5e-10
MAX_SIZE = 1e9
# periods of each run that shows whether the motion grows
N_GROWTH_PERIODS = 60
# distance of the largest multiplier from 1, below which nothing is damped: a size of MAX_SIZE
UNDAMPED_TOL = 2e-9
# miss that another step would not reduce
MISS_TOL = 1e-14
# excess of a multiplier over 1 that is round-off
UNIT_CIRCLE_TOL = 1e-5


@dataclass(eq=False, slots=True)
class Mapped:
    """A point and its image under the map of a period.

    - point, found: of the engine
    - slope: (m, m) derivative of the numbers at the end with respect to those at the start
    - scale: (m,) sizes of the numbers; gap: (m,) start minus end over them
    - size: of the motion over what the drive moves a free mass by
    - alike: whether start and end have the same numbers; else gap is of those they share, and
      slope gives no step
    - same: whether they are of the same state besides
    - kept: (k,) numbers that no step changes
    - miss: the largest gap
    """

    point: Any
    found: Any
    slope: np.ndarray
    scale: np.ndarray
    gap: np.ndarray
    size: float
    alike: bool = True
    same: bool = True
    kept: np.ndarray | tuple = ()
    miss: float = field(init=False)

    def __post_init__(self):
        self.miss = float(np.abs(self.gap).max())

    def closed(self, tolerance: float) -> bool:
        """Return whether the motion repeats to a tolerance of its size."""
        return (
            self.miss <= tolerance
            and self.miss * self.size <= MAX_MISS
            and self.alike
            and self.same
        )

    def step(self) -> np.ndarray:
        """Return Newton's step (m,), in least squares where an interface may rest anywhere."""
        scale = self.scale
        out = np.zeros(self.scale.size)
        left = (self.slope - np.eye(scale.size)) * scale / scale[:, None]
        if not len(self.kept):
            return solve_linear(left)(self.gap) * scale
        free = self._free()
        out[free] = solve_linear(left[np.ix_(free, free)])(self.gap[free])
        return out * scale

    def multipliers(self) -> np.ndarray:
        """Return the Floquet multipliers of the numbers that a step may change, the largest first."""
        free = self._free()
        return multipliers(self.slope[np.ix_(free, free)])

    def _free(self) -> np.ndarray:
        out = np.ones(self.scale.size, bool)
        out[list(self.kept)] = False
        return out


class Grows(NotConverged):
    """A motion that gains as much in every period, so that none repeats; mapped: the last one."""

    def __init__(self, mapped: Mapped, steps: int):
        super().__init__(
            "dynamics: no periodic motion was found, because the motion grows from period to period"
        )
        self.mapped = mapped
        self.steps = steps


class Shooting:
    """The map of an engine over a period; `repeating` finds its fixed point."""

    def mapped(self, point) -> Mapped:
        """Return the map of a point; NotConverged where the engine does not reach its end."""
        raise NotImplementedError

    def moved(self, mapped: Mapped, step):
        """Return the point that lies a step (m,) from that of a map."""
        raise NotImplementedError

    def after(self, mapped: Mapped, periods: int):
        """Return the point to which a run from the end of a map comes in some periods."""
        raise NotImplementedError

    def grows(self, mapped: Mapped) -> bool:
        """Return whether no disturbance dies out and the motion grows as much in each of two runs."""
        if not mapped.alike or np.abs(mapped.multipliers()).max(initial=0.0) < 1 - UNDAMPED_TOL:
            return False
        sizes = [mapped.size]
        for _ in range(2):
            mapped = self.mapped(self.after(mapped, N_GROWTH_PERIODS))
            sizes.append(mapped.size)
        first, second = np.diff(sizes)
        return bool(first > 1e-6 * sizes[0] and second > 0.99 * first)

    def repeating(self, point, periods: tuple = (10, 160), tolerance: float = 1e-12) -> tuple:
        """Find the motion that repeats, from a point near it.

        Parameters
        ----------
        point
            Of the engine.
        periods : tuple, optional
            Periods of the run where Newton's method leads away, at first and at most.
        tolerance : float, optional
            Of the motion, relative to its size.

        Returns
        -------
        mapped : Mapped
        steps : int
            Newton steps.

        Raises
        ------
        Grows
            If the run grows.
        NotConverged
            If MAX_STEPS steps and the runs between them do not reach it.
        """
        mapped = self.mapped(point)
        for used in range(MAX_STEPS):
            closed = mapped.closed(tolerance)
            if closed and mapped.miss <= MISS_TOL:
                return mapped, used
            better = self._newton(mapped, STEP_FRACTIONS[:1] if closed else STEP_FRACTIONS)
            if closed:  # the last step squares what is left, where it keeps the numbers
                return (better if better is not None and better.alike else mapped), used
            if better is not None:
                mapped = better
                continue
            mapped = self.mapped(self.after(mapped, periods[0]))
            periods = (min(2 * periods[0], periods[1]), periods[1])
            if self.grows(mapped):
                raise Grows(mapped, used + 1)
        raise NotConverged(
            f"dynamics: no periodic motion was found in {MAX_STEPS} steps of Newton's method; start from a "
            'motion closer to the periodic motion, or use accuracy.method = "march"'
        )

    def _newton(self, mapped: Mapped, shares) -> Mapped | None:
        """Return a better Mapped by a fraction of Newton's step, None where there is none."""
        if not mapped.alike:
            return None
        step = mapped.step()
        for share in shares:
            try:
                other = self.mapped(self.moved(mapped, share * step))
            except NotConverged:
                continue
            # what nothing bounds misses ever less of its size, the farther a step leads
            if other.miss < (1 - 0.4 * share) * mapped.miss and other.size <= MAX_SIZE:
                return other
        return None


def solve_linear(matrix):
    """Return a function b -> matrix^-1 b; least squares where the matrix (n, n) is singular.

    It is singular by a mean or a place at rest that nothing holds.
    """
    factors, pivots, _ = dgetrf(matrix)
    sizes = np.abs(factors.diagonal())
    if np.isfinite(sizes).all() and sizes.min(initial=np.inf) > 1e-13 * sizes.max(initial=0.0):
        return lambda b: dgetrs(factors, pivots, b)[0]
    if not np.isfinite(matrix).all():
        return lambda b: np.full(b.shape, np.nan)
    return lambda b: np.linalg.lstsq(matrix, b, rcond=1e-12)[0]


def bound(residual: float, found) -> float:
    """Return the relative error of a motion that closes to a residual.

    It grows as a multiplier in `found` (m,) comes close to 1.
    """
    return residual / max(float(np.abs(1 - np.asarray(found)).min(initial=1.0)), 1e-12)


def multipliers(matrix) -> np.ndarray:
    """Return the Floquet multipliers (s,) of the map of a period (s, s), the largest first."""
    found = np.linalg.eigvals(matrix)
    return found[np.argsort(-np.abs(found))]


def is_stable(found) -> bool:
    """Return whether no multiplier (s,) exceeds 1 in magnitude, but for round-off."""
    return bool(np.abs(found).max(initial=0.0) <= 1 + UNIT_CIRCLE_TOL)
