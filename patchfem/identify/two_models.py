"""Least squares of an expensive model with a corrected cheap model (manifold mapping).

A cheap model that is scaled to the value of the expensive model at a point still has other derivatives there.
Its minimum differs from that of the expensive model unless the residual is zero. If the difference of the
derivatives is added to the cheap model, a fixed point of the search is a minimum of the expensive model
(Echeverria and Hemker 2005).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from .least_squares import choose_starting_points, descend
from .space import SearchSpace, UnitCubeResidual

MAX_CORRECTIONS = 8  # largest number of corrections of the cheap model in one search
# Number of trial points per parameter, at which the cheap model is evaluated to choose the starting points.
N_TRIALS_PER_VALUE = 24
MAX_MINIMA = 3  # largest number of minima of the cheap model that are refined
# Smallest distance in the unit cube between two different minima.
MIN_MINIMUM_DISTANCE = 0.03
# Largest sum of squares of a minimum of the cheap model that is refined, relative to the smallest one.
MAX_COST_RATIO = 10.0
# Step of the finite differences of the expensive model in the unit cube.
DIFFERENCE_STEP = 1e-4
MIN_IMPROVEMENT = (
    1e-4  # smallest relative decrease of the sum of squares for which the search continues
)


class _SearchPoint(NamedTuple):
    """Result of a search with a cheap and an expensive model.

    - sum_of_squares: sum of squares of the residual of the expensive model.
    - u: point (n,) in the unit cube.
    - model: cheap model with the value and the derivatives of the expensive one at u, or None.
    """

    sum_of_squares: float
    u: np.ndarray
    model: Callable | None = None


@dataclass(frozen=True, eq=False, slots=True)
class TwoModels:
    """Cheap and expensive models of the same data, and the residual to minimize.

    - cheap, expensive: functions of the parameters (n,) that return an array, or raise a PatchfemError
      on failure.
    - residual: function of such an array that returns the residual (r,).
    - space: bounds of the parameters.
    """

    cheap: Callable
    expensive: Callable
    residual: Callable
    space: SearchSpace

    def search(self, given_values, n_starts: int) -> tuple:
        """Minimize the sum of squares of the expensive model with the help of the cheap one.

        Parameters
        ----------
        given_values : (n,) array_like
            Parameters (n,) of one starting point.
        n_starts : int
            Number of starting points of the search with the cheap model.

        Returns
        -------
        model : callable or None
            Cheap model with the value and the derivatives of the expensive one at the result; None if
            the search did not converge.
        values : (n,) ndarray
            Parameters of the best point.

        Raises
        ------
        PatchfemError
            If the expensive model fails at all minima of the cheap one.
        NotConverged
            If the cheap model fails at all starting points.
        """
        cheap = UnitCubeResidual(lambda values: self.residual(self.cheap(values)), self.space)
        n_trials = N_TRIALS_PER_VALUE * len(given_values)
        start = self.space.to_unit_cube(given_values)
        ends = [
            descend(cheap, u, range(u.size))
            for u in choose_starting_points(cheap, start, n_starts, n_trials)
        ]
        points = []
        errors = []
        for u in _choose_minima(ends):
            try:
                points.append(self._minimize(u))
            except PatchfemError as error:
                errors.append(error)
        if not points:
            raise errors[0]
        best = min(points, key=lambda point: point.sum_of_squares)
        return best.model, self.space.to_values(best.u)

    def correct_cheap_model(self, u, expensive_value, slopes=None) -> Callable:
        """Return the cheap model, corrected to agree with the expensive one at a point.

        Parameters
        ----------
        u : (n,) ndarray
        expensive_value : ndarray
            Value of the expensive model at u.
        slopes : (..., n) ndarray, optional
            Difference of the derivatives with respect to u, expensive model minus corrected cheap model.

        Returns
        -------
        callable
            Function of the parameters (n,).
        """
        cheap_value = self.cheap(self.space.to_values(u))
        ratio = np.divide(
            expensive_value, cheap_value, out=np.ones_like(expensive_value), where=cheap_value != 0
        )

        def corrected_model(values) -> np.ndarray:
            """Return the corrected cheap model at given parameters."""
            out = expensive_value + ratio * (self.cheap(values) - cheap_value)
            return out if slopes is None else out + slopes @ (self.space.to_unit_cube(values) - u)

        return corrected_model

    def _minimize(self, u) -> _SearchPoint:
        """Minimize the cheap model with the value and the derivatives of the expensive one, in turn from u (n,).

        Returns the best point, without a model if the sum of squares does not converge. Raises PatchfemError if the
        expensive model fails at u.
        """
        value = self.expensive(self.space.to_values(u))
        point = _SearchPoint(self._sum_of_squares(value), u)
        for _ in range(MAX_CORRECTIONS):
            try:
                model = self._make_tangent_model(point.u, value)
                u = self._descend(model, point.u)
                value = self.expensive(self.space.to_values(u))
            except PatchfemError:
                break
            change = self._sum_of_squares(value) / max(point.sum_of_squares, 1e-300) - 1
            if change > -MIN_IMPROVEMENT:
                return point._replace(model=model if change < MIN_IMPROVEMENT else None)
            point = _SearchPoint(self._sum_of_squares(value), u)
        return point

    def _make_tangent_model(self, u, expensive_value) -> Callable:
        """Return the cheap model with the value and the derivatives of the expensive one at u (n,).

        The derivatives are approximated by one-sided differences.
        """
        value_corrected_model = self.correct_cheap_model(u, expensive_value)
        slopes = []
        for i in range(u.size):
            neighbour = u.copy()
            neighbour[i] += -DIFFERENCE_STEP if u[i] > 0.5 else DIFFERENCE_STEP
            values = self.space.to_values(neighbour)
            slopes.append(
                (self.expensive(values) - value_corrected_model(values)) / (neighbour[i] - u[i])
            )
        return self.correct_cheap_model(u, expensive_value, np.stack(slopes, axis=-1))

    def _descend(self, model: Callable, u) -> np.ndarray:
        """Return the minimum (n,) of a local search with a model from u (n,)."""
        cube_residual = UnitCubeResidual(lambda values: self.residual(model(values)), self.space)
        return descend(cube_residual, u, range(u.size)).u

    def _sum_of_squares(self, data) -> float:
        """Return the sum of squares of the residual for the output of a model."""
        return float(np.square(self.residual(data)).sum())


def _choose_minima(ends: list) -> list:
    """Return the minima (n,) of the best local searches that are not close to each other.

    The points are sorted by their sum of squares.
    """
    ends = sorted((end for end in ends if np.isfinite(end.cost)), key=lambda end: end.cost)
    minima = []
    for end in ends:
        distances = [np.abs(end.u - minimum).max() for minimum in minima]
        if (
            end.cost <= MAX_COST_RATIO * ends[0].cost
            and min(distances, default=1.0) >= MIN_MINIMUM_DISTANCE
        ):
            minima.append(end.u)
    return minima[:MAX_MINIMA]
