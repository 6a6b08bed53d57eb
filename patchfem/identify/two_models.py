"""Least squares of an expensive model with a cheap model that is corrected to agree with it.

A cheap model that is multiplied so that it has the value of the expensive one at a point still has other
slopes. A search with it ends where the residual is orthogonal to the wrong slopes, which is not the least
squares of the expensive model unless the residual is zero. With the difference of the slopes added, the cheap
model has both, and a point where its search does not move any more is the least squares of the expensive model
(manifold mapping: Echeverria and Hemker 2005).
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from .least_squares import choose_starting_points, descend, run_descents
from .space import CubeResidual, SearchSpace

MAX_CORRECTIONS = 4  # largest number of corrections of the cheap model in one search
MAX_RESIDUAL_CHANGE = 1e-3  # largest difference of the residuals of two models that agree
# number of points per value at which the cheap model is computed to choose the starting points
N_TRIALS_PER_VALUE = 24
MAX_MINIMA = 3  # largest number of minima of the cheap model from which the search continues
# smallest distance in the unit cube between two minima from which the search continues
MIN_MINIMUM_DISTANCE = 0.03
# sum of squares / the smallest one; a minimum with a larger ratio is left out
MAX_COST_RATIO = 10.0
# sum of squares / the smallest one; points below it are refined with derivatives of the expensive model
MAX_RIVAL_COST_RATIO = 1.5
# fraction of the edge of the unit cube; step of difference quotients of the expensive model
DIFFERENCE_STEP = 1e-4
MIN_IMPROVEMENT = 1e-4  # relative decrease of the sum of squares below which the search ends


class _SearchPoint(NamedTuple):
    """Point of a search.

    - sum_of_squares: of the expensive model.
    - u: point (n,) of the unit cube.
    - model: corrected cheap model with the value and the slopes of the expensive one there, or None.
    """

    sum_of_squares: float
    u: np.ndarray
    model: Callable | None = None


@dataclass(frozen=True, eq=False, slots=True)
class TwoModels:
    """A cheap and an expensive model of the same data.

    - cheap, expensive: functions of values (n,) that return an array; a PatchfemError is a failure.
    - residual: function of such an array that returns the residual (r,).
    - space: bounds of the values.
    """

    cheap: Callable
    expensive: Callable
    residual: Callable
    space: SearchSpace

    def search(self, own, starts: int) -> tuple:
        """Minimize the sum of squares of the expensive model.

        Parameters
        ----------
        own : (n,) array_like
            Values from which the search starts, besides others.
        starts : int
            Starts of the search with the cheap model.

        Returns
        -------
        model : callable or None
            Cheap model with the value and the slopes of the expensive one at the result, None if the
            search did not converge.
        values : (n,) ndarray

        Raises
        ------
        PatchfemError
            If the expensive model fails at all ends of the search with the cheap one.
        NotConverged
            If the cheap model fails at all starts.
        """
        cheap = CubeResidual(lambda values: self.residual(self.cheap(values)), self.space)
        trials = N_TRIALS_PER_VALUE * len(own)
        begins = choose_starting_points(cheap, self.space.unit(own), starts, trials)
        points = []
        errors = []
        for u in _choose_minima(run_descents(cheap, begins)):
            try:
                points.append(self._search_with_value(u))
            except PatchfemError as error:
                errors.append(error)
        if not points:
            raise errors[0]
        limit = MAX_RIVAL_COST_RATIO * min(point.sum_of_squares for point in points)
        rivals = [point for point in points if point.sum_of_squares <= limit]
        refined = list(map(self._search_with_slopes, rivals))
        best = min(refined, key=lambda point: point.sum_of_squares)
        return best.model, self.space.values(best.u)

    def correct_cheap_model(self, u, expensive, slopes=None) -> Callable:
        """Correct the cheap model at a point of the unit cube.

        Parameters
        ----------
        u : (n,) ndarray
        expensive : ndarray
            Value of the expensive model at u.
        slopes : (..., n) ndarray, optional
            Differences of the slopes of the models over u.

        Returns
        -------
        callable
            Function of values (n,).
        """
        here = self.cheap(self.space.values(u))
        ratio = np.divide(expensive, here, out=np.ones_like(expensive), where=here != 0)

        def model(values) -> np.ndarray:
            out = expensive + ratio * (self.cheap(values) - here)
            return out if slopes is None else out + slopes @ (self.space.unit(values) - u)

        return model

    def _search_with_value(self, u) -> _SearchPoint:
        """Minimize with the cheap model, corrected to the expensive one at the last minimum.

        Both steps are repeated from u (n,) until the models agree. Returns the best point.
        """
        expensive = self.expensive(self.space.values(u))
        best = _SearchPoint(self._sum_of_squares(expensive), u)
        for _ in range(MAX_CORRECTIONS):
            model = self.correct_cheap_model(u, expensive)
            u = self._descend(model, u)
            values = self.space.values(u)
            try:
                expensive = self.expensive(values)
            except PatchfemError:
                break
            sum_of_squares = self._sum_of_squares(expensive)
            if sum_of_squares < best.sum_of_squares:
                best = _SearchPoint(sum_of_squares, u)
            change = np.abs(self.residual(expensive) - self.residual(model(values))).max()
            if change < MAX_RESIDUAL_CHANGE:
                break
        return best

    def _search_with_slopes(self, point: _SearchPoint) -> _SearchPoint:
        """Minimize with the cheap model, corrected to value and derivatives of the expensive one.

        Returns the best point, without a model if the sum of squares does not converge.
        """
        sum_of_squares = point.sum_of_squares
        u = point.u
        for _ in range(MAX_CORRECTIONS):
            try:
                model = self._tangent_model(u)
                new_u = self._descend(model, u)
                new_sum = self._sum_of_squares(self.expensive(self.space.values(new_u)))
            except PatchfemError:
                break
            if new_sum > sum_of_squares * (1 - MIN_IMPROVEMENT):
                is_converged = new_sum < sum_of_squares * (1 + MIN_IMPROVEMENT)
                return _SearchPoint(sum_of_squares, u, model if is_converged else None)
            sum_of_squares = new_sum
            u = new_u
        return _SearchPoint(sum_of_squares, u)

    def _tangent_model(self, u) -> Callable:
        """Correct the cheap model to the value and derivatives of the expensive one at u (n,).

        The derivatives are one-sided difference quotients.
        """
        expensive = self.expensive(self.space.values(u))
        plain = self.correct_cheap_model(u, expensive)
        slopes = []
        for i in range(u.size):
            neighbour = u.copy()
            neighbour[i] += -DIFFERENCE_STEP if u[i] > 0.5 else DIFFERENCE_STEP
            values = self.space.values(neighbour)
            slopes.append((self.expensive(values) - plain(values)) / (neighbour[i] - u[i]))
        return self.correct_cheap_model(u, expensive, np.stack(slopes, axis=-1))

    def _descend(self, model: Callable, u) -> np.ndarray:
        """Return the point (n,) of the unit cube at which a descent with a model from u (n,) ends."""
        cube_residual = CubeResidual(lambda values: self.residual(model(values)), self.space)
        return descend(cube_residual, u, range(u.size)).u

    def _sum_of_squares(self, data) -> float:
        """Return the sum of squares of the residual of computed data."""
        return float(np.square(self.residual(data)).sum())


def _choose_minima(ends: list) -> list:
    """Return the points (n,) of the best descents that are far enough apart, best first."""
    ends = sorted((end for end in ends if np.isfinite(end.cost)), key=lambda end: end.cost)
    valleys = []
    for end in ends:
        distances = [np.abs(end.u - valley).max() for valley in valleys]
        if (
            end.cost <= MAX_COST_RATIO * ends[0].cost
            and min(distances, default=1.0) >= MIN_MINIMUM_DISTANCE
        ):
            valleys.append(end.u)
    return valleys[:MAX_MINIMA]
