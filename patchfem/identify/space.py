"""Mapping of bounded parameters to the unit cube, and the residual as a function on this cube."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ..core import Missing, PatchfemError

DIFFERENCE_STEP = 1e-5  # step of finite differences, relative to the range of a parameter
# Largest ratio of upper to lower bound for a linear scale.
MIN_BOUND_RATIO_FOR_LOG = 10
PENALTY_FACTOR = 1e3  # residual of a failed evaluation, relative to the largest residual


@dataclass(frozen=True, eq=False, slots=True)
class SearchSpace:
    """Mapping of n bounded parameters to the unit cube, u in [0, 1]^n.

    - low, high: bounds (n,), low < high.
    - is_log: whether each parameter has a logarithmic scale (n,).
    """

    low: np.ndarray
    high: np.ndarray
    is_log: np.ndarray

    def to_values(self, u) -> np.ndarray:
        """Return the parameters (n,) of a point u of the unit cube, exactly at the bounds."""
        u = np.asarray(u, float)
        inside = np.where(
            self.is_log, self.low * self._ratio**u, self.low + (self.high - self.low) * u
        )
        return np.where(u <= 0, self.low, np.where(u >= 1, self.high, inside))

    def to_unit_cube(self, values) -> np.ndarray:
        """Return the point of the unit cube nearest to given parameters (n,)."""
        values = np.asarray(values, float)
        u = (values - self.low) / (self.high - self.low)
        logs = self.is_log
        u[logs] = np.log(np.maximum(values, self.low)[logs] / self.low[logs])
        u[logs] /= np.log(self._ratio[logs])
        return np.clip(u, 0.0, 1.0)

    @property
    def _ratio(self) -> np.ndarray:
        """Ratio (n,) of the bounds of the parameters with a logarithmic scale; 1 for the others."""
        return np.divide(self.high, self.low, out=np.ones(self.low.size), where=self.is_log)

    def derivatives(self, u) -> np.ndarray:
        """Return the derivatives (n,) of the parameters with respect to the coordinates u."""
        logs = self.to_values(u) * np.log(self._ratio)
        return np.where(self.is_log, logs, self.high - self.low)


def make_search_space(low, high) -> SearchSpace:
    """Return the mapping of bounded parameters to the unit cube.

    Positive parameters with a wide range have a logarithmic scale.

    Parameters
    ----------
    low, high : (n,) array_like

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
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise ValueError("bounds must be finite with low < high")
    return SearchSpace(low, high, (low > 0) & (high > MIN_BOUND_RATIO_FOR_LOG * low))


class UnitCubeResidual:
    """Residual as a function of a point u of the unit cube, with a count of evaluations.

    An evaluation fails if it raises a PatchfemError or an arithmetic error, or if the residual is not finite.
    `reason` describes the first failure. An error of type Missing is not caught.

    Parameters
    ----------
    residual : callable
        Function of the parameters (n,) that returns the residual (r,).
    space : SearchSpace
    is_expensive : bool
        Whether evaluations are expensive. Derivatives are then one-sided differences of first order, and
        profile intervals are accurate to 1 %.
    """

    def __init__(self, residual: Callable, space: SearchSpace, *, is_expensive: bool = False):
        self.residual = residual
        self.space = space
        self.is_expensive = is_expensive
        self.evaluations = 0
        self.failures = 0
        self.reason = ""
        self.largest = 0.0
        self.rows = 0
        self._last_point = None
        self._last_residual = None

    def __call__(self, u) -> np.ndarray | None:
        """Return the residual (r,) at u (n,), or None if the evaluation fails."""
        if self._last_point is None or not np.array_equal(self._last_point, u):
            self._cache_residual(u, self._evaluate(u))
        return self._last_residual

    def _cache_residual(self, u, residual) -> None:
        """Store the residual at u (n,), because it is often evaluated there again."""
        self._last_point = np.array(u)
        self._last_residual = residual

    def _evaluate(self, u) -> np.ndarray | None:
        """Evaluate the residual at u (n,), and count evaluations and failures."""
        self.evaluations += 1
        reason = ""
        try:
            residual = np.asarray(self.residual(self.space.to_values(u)), float)
            if not np.isfinite(residual).all():
                reason = "the residual is not finite"
        except Missing:
            raise
        except (PatchfemError, ArithmeticError, np.linalg.LinAlgError) as error:
            reason = str(error)
        if reason:
            self.failures += 1
            self.reason = self.reason or reason
            return None
        self.rows = residual.size
        self.largest = max(self.largest, float(np.abs(residual).max(initial=0.0)))
        return residual

    def with_penalty(self, u) -> np.ndarray:
        """Return the residual (r,) at u (n,), or a penalty if the evaluation fails.

        The penalty is larger than all previous residuals.
        """
        residual = self(u)
        if residual is None:
            return np.full(self.rows, PENALTY_FACTOR * max(self.largest, 1e-300))
        return residual

    def jacobian(self, u, free) -> np.ndarray:
        """Compute the derivatives (r, f) of the residual along selected coordinates by finite differences.

        The differences are central. They are one-sided at a bound, next to a failed evaluation, and for an
        expensive residual.

        Parameters
        ----------
        u : (n,) array_like
        free : sequence of int
            Indices of the f coordinates that vary.
        """
        residual_at_u = self(u)
        columns = [self._differentiate(u, i, residual_at_u) for i in free]
        self._cache_residual(u, residual_at_u)
        return np.column_stack(columns) if columns else np.zeros((self.rows, 0))

    def _differentiate(self, u, i: int, here: np.ndarray) -> np.ndarray:
        """Return the derivative (r,) along coordinate i at u with the residual `here`; 0 if no neighbour is known."""
        near = {}
        for k in (1, -1):
            if not (self.is_expensive and near):
                residual = self._evaluate_neighbour(u, i, k)
                near |= {} if residual is None else {k: residual}
        if len(near) == 2:
            return (near[1] - near[-1]) / (2 * DIFFERENCE_STEP)
        for k, residual in near.items():
            far = None if self.is_expensive else self._evaluate_neighbour(u, i, 2 * k)
            if far is None:
                return k * (residual - here) / DIFFERENCE_STEP
            return k * (4 * residual - 3 * here - far) / (2 * DIFFERENCE_STEP)
        return np.zeros_like(here)

    def _evaluate_neighbour(self, u, i: int, n_steps: int) -> np.ndarray | None:
        """Return the residual (r,) some difference steps along coordinate i; None outside the cube or if it fails."""
        point = np.array(u, float)
        point[i] += n_steps * DIFFERENCE_STEP
        return self(point) if 0 <= point[i] <= 1 else None


def make_space_filling_points(count: int, n: int) -> np.ndarray:
    """Return points (count, n) of the unit cube with low discrepancy, the same in every call.

    The points are an additive recurrence with the root of x^(n + 1) = x + 1 (Roberts 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (n + 1))
    return (0.5 + np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, n + 1))) % 1.0
