"""Residual of bounded parameters on the unit cube, and its local minimum by bounded linear steps (descent).

Each step solves min |r + J d| within the bounds and a trust region. Positive parameters with a wide range have a
logarithmic scale.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import qr
from scipy.optimize import lsq_linear

from ..core import Missing, PatchfemError

FINITE_DIFFERENCE_STEP = 1e-5  # step of finite differences, relative to the range of a parameter
MAX_DESCENT_EVALUATIONS = 100  # largest number of evaluations in one descent, without Jacobians
# Ratio of the decrease of the sum of squares to the predicted one, below which the next steps are shorter
MIN_DECREASE_RATIO = 0.25
# Largest distance of a point from a known minimum that a descent has reached, relative to the ranges, and largest relative
# difference of the sums of squares
SAME_POINT_DISTANCE = 0.02


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
    """Return the mapping of parameters between bounds (n,) to the unit cube.

    Raises ValueError if the bounds are not finite, or not low < high.
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
    # Largest ratio of upper to lower bound of a linear scale
    return SearchSpace(low, high, (low > 0) & (high > 10 * low))


class SearchCounts(NamedTuple):
    """Number of residual evaluations of a search and of failures, and the reason of the first failure or ""."""

    evaluations: int
    failures: int
    reason: str


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
        Whether derivatives are one-sided differences, and secants near a computed Jacobian.
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
        # Number of the last residuals that are kept: a search returns to its neighbours
        self._evaluate_once = lru_cache(32)(self._evaluate)

    def __call__(self, u) -> np.ndarray | None:
        """Return the residual (r,) at u (n,), or None if the evaluation fails."""
        return self._evaluate_once(tuple(np.asarray(u, float).tolist()))

    def sum_of_squares(self, u) -> float:
        """Return the sum of squares of the residual at u (n,); infinite if the evaluation fails."""
        residual = self(u)
        return np.inf if residual is None else float(residual @ residual)

    @property
    def floor(self) -> float:
        """Sum of squares of the round-off of the residual."""
        return max((1e-15 * self.largest) ** 2 * self.rows, 1e-300)

    def _evaluate(self, u: tuple[float, ...]) -> np.ndarray | None:
        """Evaluate the residual at u (n,), and count evaluations and failures."""
        counts = self.counts
        self.counts = counts._replace(evaluations=counts.evaluations + 1)
        reason = "the residual is not finite"
        try:
            residual = np.asarray(self.residual(self.space.to_values(u)), float)
            if np.isfinite(residual).all():
                self.rows = residual.size
                self.largest = max(self.largest, np.abs(residual).max(initial=0.0))
                return residual
        except Missing:
            raise
        except (PatchfemError, ArithmeticError, np.linalg.LinAlgError) as error:
            reason = str(error)
        self.counts = self.counts._replace(
            failures=counts.failures + 1, reason=counts.reason or reason
        )
        return None

    def jacobian(self, u, free: Sequence[int]) -> np.ndarray:
        """Compute the derivatives (r, f) of the residual along selected coordinates by finite differences.

        The differences are central, or one-sided at a bound, beside a failed evaluation and for an expensive residual. They
        are NaN beside two failed evaluations.

        Parameters
        ----------
        u : (n,) array_like
            Point of the unit cube.
        free : sequence of int
            Indices of the f coordinates that vary.
        """
        columns = np.full((len(free), self.rows), np.nan)
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


class LinearModel:
    """Residual r + J d near a point u of the unit cube, with coordinates that move within the cube.

    Parameters
    ----------
    model : UnitCubeResidual
    point : (n,) array
        Point u at which the residual is known.
    free : sequence of int
        Indices of the f coordinates that move.
    """

    def __init__(self, model: UnitCubeResidual, point: np.ndarray, free: Sequence[int]):
        self.model = model
        self.free = list(free)
        self.u = np.array(point, float)
        self.residual = model(self.u)
        self.is_fresh = False
        self.differentiate()

    def differentiate(self) -> None:
        """Compute the Jacobian at the point."""
        if not self.is_fresh:
            self.jacobian = self.model.jacobian(self.u, self.free)
        self.is_fresh = True

    @property
    def cost(self) -> float:
        """Sum of squares at the point."""
        return float(self.residual @ self.residual)

    def compress(self) -> np.ndarray:
        """Return the triangular factor (f + 1, f + 1) of the columns of J and r, whose columns have the same products."""
        columns = np.column_stack([np.nan_to_num(self.jacobian), self.residual])
        return qr(columns, mode="r")[0][: columns.shape[1]]

    def limit(self, trust: float) -> np.ndarray:
        """Return the bounds (2, f) of a step within the unit cube and a trust region, which contain more than one point."""
        u = self.u[self.free]
        return np.array([np.maximum(-u, -trust), np.minimum(1 - u, trust)])

    def propose(self, step: np.ndarray) -> np.ndarray:
        """Return the point (n,) after a step (f,), exactly within the unit cube."""
        point = self.u.copy()
        point[self.free] = np.clip(point[self.free] + step, 0.0, 1.0)
        return point

    def move(self, point: np.ndarray, residual: np.ndarray) -> None:
        """Move to a point (n,) with a known residual; the Jacobian of an expensive residual becomes a secant there.

        The update of rank one is that of Broyden (1965).
        """
        step = (point - self.u)[self.free]
        if self.model.is_expensive and step @ step:
            missing = residual - self.residual - self.jacobian @ step
            self.jacobian = self.jacobian + np.outer(missing, step) / (step @ step)
        self.u = point
        self.residual = residual
        self.is_fresh = False
        if not self.model.is_expensive:
            self.differentiate()


class Descent(NamedTuple):
    """Result of a local least-squares search (descent).

    - u: final point (n,) in the unit cube, to which the ranges of the parameters are mapped.
    - cost: final sum of squares; infinite if the evaluation at the start failed.
    - is_converged: whether the descent converged.
    - rows: number of rows of the residual.
    """

    u: np.ndarray
    cost: float
    is_converged: bool
    rows: int


def descend(model: UnitCubeResidual, u, known: Sequence[Descent] = ()) -> Descent:
    """Minimize a residual locally from a point of the unit cube (Gauss-Newton steps in a trust region).

    The final sum of squares is never larger than that at the start.

    Parameters
    ----------
    model : UnitCubeResidual
        Residual as a function on the unit cube.
    u : (n,) array_like
        Starting point.
    known : sequence of Descent
        Minima that were found before; the search ends where the next step leads to one of them.

    Returns
    -------
    Descent
    """
    u = np.array(u, float)
    if model(u) is None:
        return Descent(u, np.inf, False, model.rows)
    # Predicted relative decrease of the sum of squares below which a descent has converged: about the errors of an expensive
    # residual, and above the round-off of differences
    tolerance = 1e-5 if model.is_expensive else 1e-10
    linear = LinearModel(model, u, range(u.size))
    # Largest change of a parameter in the first step, relative to its range
    trust = 0.3
    is_converged = False
    for _ in range(MAX_DESCENT_EVALUATIONS):
        # the bounded linear problem predicts the sum of squares after the step
        factor = linear.compress()
        found = lsq_linear(factor[:, :-1], -factor[:, -1], linear.limit(trust), method="bvls")
        predicted = 2 * found.cost
        point = linear.propose(found.x)
        expected = linear.cost - predicted
        size = np.abs(point - linear.u).max()
        for end in known if size < trust else ():
            distance = np.abs([*(end.u - point), end.cost / max(predicted, 1e-300) - 1]).max()
            if end.is_converged and distance <= SAME_POINT_DISTANCE:
                return end
        # Smallest step above round-off, relative to the range of a parameter
        if linear.cost <= model.floor or expected <= tolerance * linear.cost or size < 1e-12:
            is_converged = bool(np.isfinite(linear.jacobian).all())
            if linear.is_fresh or linear.cost <= model.floor:
                # Steps converge linearly where the residual is large, so that the last one still counts.
                cost = model.sum_of_squares(point) if size < SAME_POINT_DISTANCE else np.inf
                if cost < linear.cost:
                    return Descent(point, cost, is_converged, model.rows)
                break
            linear.differentiate()
            continue

        # a step that is not as good as predicted asks for a new Jacobian, then for a smaller region
        residual = model(point)
        cost = np.inf if residual is None else residual @ residual
        ratio = (linear.cost - cost) / expected
        is_fresh = linear.is_fresh
        if cost < linear.cost:
            linear.move(point, residual)
        if ratio < MIN_DECREASE_RATIO and is_fresh:
            trust = size / 4
        elif ratio > 1 - MIN_DECREASE_RATIO and size >= 0.99 * trust:
            trust *= 2
        # Ratio of this kind below which the Jacobian of an expensive residual is computed again
        if ratio < 0.5:
            linear.differentiate()
    return Descent(linear.u, linear.cost, is_converged, model.rows)
