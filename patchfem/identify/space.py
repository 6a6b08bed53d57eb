"""Mapping of bounded parameters to the unit cube, and the residual as a function on this cube."""

from collections.abc import Callable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ..core import Missing, PatchfemError

FINITE_DIFFERENCE_STEP = 1e-5  # step of finite differences, relative to the range of a parameter
MIN_BOUND_RATIO_FOR_LOG = 10  # largest ratio of upper to lower bound of a linear scale
FAILED_RESIDUAL_FACTOR = 1e3  # residual of a failed evaluation, relative to the largest residual
# Number of the last residuals that are kept: a search returns to its neighbours
N_CACHED_RESIDUALS = 32


class SearchSpace(NamedTuple):
    """Mapping of n bounded parameters to the unit cube, u in [0, 1]^n.

    - low, high: bounds (n,), low < high.
    - is_log: whether each parameter has a logarithmic scale (n,).
    """

    low: np.ndarray
    high: np.ndarray
    is_log: np.ndarray

    def _scale(self, values) -> np.ndarray:
        """Return the parameters (n,), or their logarithms where the scale is logarithmic."""
        scaled = np.array(values, float)
        return np.log(scaled, out=scaled, where=self.is_log)

    @property
    def _span(self) -> np.ndarray:
        """Length (n,) of the ranges on their scales."""
        return self._scale(self.high) - self._scale(self.low)

    def to_values(self, u) -> np.ndarray:
        """Return the parameters (n,) of a point u of the unit cube, exactly at the bounds."""
        u = np.asarray(u, float)
        inside = self._scale(self.low) + self._span * u
        np.exp(inside, out=inside, where=self.is_log)
        return np.where(u <= 0, self.low, np.where(u >= 1, self.high, inside))

    def to_unit_cube(self, values) -> np.ndarray:
        """Return the point of the unit cube nearest to given parameters (n,), in the middle where they are NaN."""
        inside = np.clip(np.asarray(values, float), self.low, self.high)
        u = np.clip((self._scale(inside) - self._scale(self.low)) / self._span, 0.0, 1.0)
        return np.where(np.isnan(u), 0.5, u)

    def derivatives(self, u) -> np.ndarray:
        """Return the derivatives (n,) of the parameters with respect to the coordinates u."""
        return self._span * np.where(self.is_log, self.to_values(u), 1.0)


def make_search_space(low, high) -> SearchSpace:
    """Return the mapping of bounded parameters to the unit cube.

    Positive parameters with a wide range have a logarithmic scale.

    Parameters
    ----------
    low, high : (n,) array_like
        Bounds.

    Returns
    -------
    SearchSpace

    Raises
    ------
    ValueError
        If the bounds are not finite, or not low < high.
    """
    low = np.array(low, float)
    high = np.array(high, float)
    if low.ndim != 1 or low.shape != high.shape or not low.size:
        raise ValueError(
            f"'low' and 'high' must be one-dimensional and of the same length, got shapes {low.shape} and "
            f"{high.shape}"
        )
    if not (np.isfinite([low, high]).all() and (low < high).all()):
        raise ValueError("bounds must be finite with low < high")
    return SearchSpace(low, high, (low > 0) & (high > MIN_BOUND_RATIO_FOR_LOG * low))


class SearchCounts(NamedTuple):
    """Number of residual evaluations of a search and of failures, and the reason of the first failure or ""."""

    evaluations: int
    failures: int
    reason: str

    def add(self, later: "SearchCounts") -> "SearchCounts":
        """Return the counts of this search and a later one together."""
        return SearchCounts(
            self.evaluations + later.evaluations,
            self.failures + later.failures,
            self.reason or later.reason,
        )


class UnitCubeResidual:
    """Residual as a function of a point u of the unit cube, with a count of evaluations.

    An evaluation fails if it raises a PatchfemError or an arithmetic error, or if the residual is not finite. An error of
    type Missing is not caught.

    Parameters
    ----------
    residual : callable
        Function of the parameters (n,) that returns the residual (r,).
    space : SearchSpace
    is_expensive : bool
        Whether derivatives are one-sided differences.
    """

    def __init__(
        self,
        residual: Callable[[np.ndarray], np.ndarray],
        space: SearchSpace,
        *,
        is_expensive: bool = False,
    ):
        self.residual = residual
        self.space = space
        self.is_expensive = is_expensive
        self.counts = SearchCounts(0, 0, "")
        self.largest = 0.0
        self.rows = 0
        self._evaluate_once = lru_cache(N_CACHED_RESIDUALS)(self._evaluate)

    def __call__(self, u) -> np.ndarray | None:
        """Return the residual (r,) at u (n,), or None if the evaluation fails."""
        return self._evaluate_once(tuple(np.asarray(u, float).tolist()))

    def sum_of_squares(self, u) -> float:
        """Return the sum of squares of the residual at u (n,); infinite if the evaluation fails."""
        residual = self(u)
        return np.inf if residual is None else residual @ residual

    def evaluate_or_penalize(self, u) -> np.ndarray:
        """Return the residual (r,) at u (n,), or, if the evaluation fails, rows larger than any residual before."""
        residual = self(u)
        if residual is None:
            return np.full(self.rows, FAILED_RESIDUAL_FACTOR * max(self.largest, 1e-300))
        return residual

    def _evaluate(self, u: tuple[float, ...]) -> np.ndarray | None:
        """Evaluate the residual at u (n,), and count evaluations and failures."""
        reason = "the residual is not finite"
        try:
            residual = np.asarray(self.residual(self.space.to_values(u)), float)
            if np.isfinite(residual).all():
                self.rows = residual.size
                self.largest = max(self.largest, np.abs(residual).max(initial=0.0))
                self.counts = self.counts.add(SearchCounts(1, 0, ""))
                return residual
        except Missing:
            raise
        except (PatchfemError, ArithmeticError, np.linalg.LinAlgError) as error:
            reason = str(error)
        self.counts = self.counts.add(SearchCounts(1, 1, reason))
        return None

    def jacobian(self, u, free) -> np.ndarray:
        """Compute the derivatives (r, f) of the residual along selected coordinates by finite differences.

        The differences are central, or one-sided at a bound, beside a failed evaluation and for an expensive residual.

        Parameters
        ----------
        u : (n,) array_like
            Point of the unit cube.
        free : sequence of int
            Indices of the f coordinates that vary.
        """
        columns = np.zeros((len(free), self.rows))
        for column, coordinate in zip(columns, free):
            evaluated = []
            for step in (FINITE_DIFFERENCE_STEP, -FINITE_DIFFERENCE_STEP, 0.0):
                point = np.array(u, float)
                point[coordinate] += step
                is_wanted = len(evaluated) < 2 and not (self.is_expensive and evaluated and step)
                if is_wanted and 0 <= point[coordinate] <= 1:
                    residual = self(point)
                    if residual is not None:
                        evaluated.append((point[coordinate], residual))
            if len(evaluated) == 2:
                (place, residual), (other_place, other) = evaluated
                column[:] = (residual - other) / (place - other_place)
        return columns.T


def make_space_filling_points(count: int, n: int) -> np.ndarray:
    """Return points (count, n) of the unit cube with low discrepancy, the same in every call.

    The points are an additive recurrence with the root of x^(n + 1) = x + 1 (Roberts 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (n + 1))
    return (0.5 + np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, n + 1))) % 1.0
