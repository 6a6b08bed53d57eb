"""Least squares of an expensive model with a corrected cheap model (manifold mapping).

A cheap model that is scaled to the value of the expensive model at a point still has other derivatives there.
Its minimum differs from that of the expensive model unless the residual is zero. If the difference of the
derivatives is added to the cheap model, a fixed point of the search is a minimum of the expensive model
(Echeverria and Hemker 2005).
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from ..core import PatchfemError
from .least_squares import Problem

MAX_CORRECTIONS = 8  # largest number of corrections of the cheap model in one search
MAX_MINIMA = 3  # largest number of minima of the cheap model that are refined
MIN_DISTANCE = 0.03  # smallest distance between two different minima in the unit cube
# Largest root mean square residual of a minimum of the cheap model that is refined, relative to the smallest one.
MAX_RMS_RATIO = 3.0
DIFFERENCE_STEP = 1e-4  # step of the differences of the expensive model in the unit cube
MIN_IMPROVEMENT = (
    1e-4  # smallest relative decrease of the sum of squares with which a search continues
)


class MappedMinimum(NamedTuple):
    """Minimum of the expensive model.

    - sum_of_squares: that of the residual of the expensive model.
    - values: parameters (n,).
    - model: cheap model with the value and the derivatives of the expensive one there; None if the search did not
      converge.
    """

    sum_of_squares: float
    values: np.ndarray
    model: Callable | None = None


@dataclass(frozen=True, eq=False, slots=True)
class TwoModels:
    """Cheap and expensive models of the same data, and the residual to minimize.

    - cheap, expensive: functions of the parameters (n,) that return an array, or raise a PatchfemError
      on failure.
    - residual: function of such an array that returns the residual (r,).
    - problem: bounds of the parameters, and one starting point; its residual is not used.
    """

    cheap: Callable
    expensive: Callable
    residual: Callable
    problem: Problem

    def search(self, n_starts: int) -> MappedMinimum:
        """Minimize the sum of squares of the expensive model from the best minima of the cheap one.

        Parameters
        ----------
        n_starts : int
            Number of starting points of the search with the cheap model.

        Raises
        ------
        PatchfemError
            If the expensive model fails at all minima of the cheap one.
        NotConverged
            If the cheap model fails at all starting points.
        """
        descents = self._solve(self.cheap, self.problem.start, n_starts).descents
        to_unit_cube = self.problem.search_space.to_unit_cube
        minima = []
        for k in np.argsort(descents.rms):
            is_good = descents.rms[k] <= MAX_RMS_RATIO * np.nanmin(descents.rms)
            u = to_unit_cube(descents.ends[k])
            distances = [np.abs(u - to_unit_cube(minimum)).max() for minimum in minima]
            if is_good and min(distances, default=1.0) >= MIN_DISTANCE:
                minima.append(descents.ends[k])
        found = []
        errors = []
        for values in minima[:MAX_MINIMA]:
            try:
                found.append(self._minimize(values))
            except PatchfemError as error:
                errors.append(error)
        if not found:
            raise errors[0]
        return min(found, key=lambda minimum: minimum.sum_of_squares)

    def _solve(self, model: Callable, start, n_starts: int = 1):
        """Return the Fit of a model from a starting point (n,)."""
        problem = replace(self.problem, residual=lambda v: self.residual(model(v)), start=start)
        return problem.solve(n_starts, "")

    def _minimize(self, values) -> MappedMinimum:
        """Minimize the cheap model with the value and the derivatives of the expensive one, in turn from values (n,).

        Returns the best point, without a model if the sum of squares does not converge. Raises PatchfemError if the
        expensive model fails at the first point.
        """
        data = self.expensive(values)
        best = MappedMinimum(float(np.square(self.residual(data)).sum()), values)
        for _ in range(MAX_CORRECTIONS):
            try:
                model = self.correct_cheap_model(best.values, data)
                values = self._solve(model, best.values).values
                data = self.expensive(values)
            except PatchfemError:
                break
            sum_of_squares = float(np.square(self.residual(data)).sum())
            change = sum_of_squares / max(best.sum_of_squares, 1e-300) - 1
            if change > -MIN_IMPROVEMENT:
                return best._replace(model=model if change < MIN_IMPROVEMENT else None)
            best = MappedMinimum(sum_of_squares, values)
        return best

    def correct_cheap_model(self, values, data) -> Callable:
        """Return the cheap model with the value and the derivatives of the expensive one at a point.

        Parameters
        ----------
        values : (n,) ndarray
        data : ndarray
            Value of the expensive model there.

        Returns
        -------
        callable
            Function of the parameters (n,).
        """
        space = self.problem.search_space
        here = space.to_unit_cube(values)
        cheap = self.cheap(values)
        ratio = np.divide(data, cheap, out=np.ones_like(data), where=cheap != 0)

        # difference of the derivatives by one-sided differences towards the middle of the range
        slopes = []
        for k in range(here.size):
            neighbour = here.copy()
            neighbour[k] += -DIFFERENCE_STEP if here[k] > 0.5 else DIFFERENCE_STEP
            moved = space.to_values(neighbour)
            change = self.expensive(moved) - data - ratio * (self.cheap(moved) - cheap)
            slopes.append(change / (neighbour[k] - here[k]))
        slopes = np.stack(slopes, axis=-1)
        return lambda at: (
            data + ratio * (self.cheap(at) - cheap) + slopes @ (space.to_unit_cube(at) - here)
        )
