"""Least squares with bounds: fitted parameters, 95 % intervals, and undetermined directions.

The parameters are mapped to the unit cube, on a logarithmic scale if the bounds are positive and wide. Local
searches (descents) start from several points, the same in every call. The confidence intervals are those of
the linearized problem, with Student's t distribution for (rows - parameters) degrees of freedom. In a time
series, only the independent rows count (`correlation`). If the residual is not linear over an interval, or
the parameter lies on a bound, the interval follows from the profile of the sum of squares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..core import NotConverged, Outcome, frozen_array
from .intervals import FitIntervals, compute_intervals, make_unknown_intervals
from .space import SearchSpace, UnitCubeResidual, make_search_space, make_space_filling_points

COST_TOL = 1e-10  # relative change of the sum of squares per step at convergence
QUICK_COST_TOL = 1e-4  # COST_TOL of a residual that is expensive to evaluate
MAX_EVALUATIONS = 100  # largest number of evaluations in one descent, without Jacobians
# Largest root mean square residual of an exact fit, relative to the largest residual of the search.
EXACT_FIT_RATIO = 1e-9
# A descent has reached the best minimum if the ratio of its sum of squares to the smallest one is
# at most this value.
SAME_MINIMUM_RATIO = 1.02
SAME_RESULT_TOL = 1e-6  # relative difference between the sums of squares of equal results
# Largest distance from a bound at which a parameter is tried on the bound, relative to its range.
NEAR_BOUND_FRACTION = 1e-3
# Number of trial points per parameter for the choice of the starting points.
N_TRIALS_PER_VALUE = 8


class IntervalKind(StrEnum):
    """Assumption on the errors of the data from which confidence intervals are computed.

    - ROWS: the rows are independent.
    - SERIES: the rows are a time series, in which correlated neighbours count as fewer rows.
    - BOUNDS: no intervals are computed (NaN), but parameters near a bound are tried on it.
    - NONE: no intervals are computed, and no parameter is tried on a bound.
    """

    ROWS = "rows"
    SERIES = "series"
    BOUNDS = "bounds"
    NONE = ""


class DescentStorage:
    """Storage of finished descents, with which an interrupted search continues; this one stores nothing."""

    def load(self, start: int) -> "Descent | None":
        """Return the stored descent from a starting point, or None."""
        return None

    def save(self, start: int, descent: "Descent") -> None:
        """Store the descent from a starting point."""


class SearchCounts(NamedTuple):
    """Number of residual evaluations of a search, and of failures.

    - evaluations: number of evaluations.
    - failures: number of failed evaluations.
    - reason: reason of the first failure; "" if none failed.
    """

    evaluations: int
    failures: int
    reason: str


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """Result of a least-squares fit of n parameters.

    - values: fitted parameters (n,).
    - at_bound: "low", "high" or "" for each parameter.
    - intervals: 95 % intervals, and undetermined directions.
    - rms: root mean square of the residual.
    - agreed: number of descents with the same final sum of squares.
    - counts: number of evaluations of the residual.
    - outcome: DONE if the best descent converged, or if another one reached the same minimum. With
      round-off noise in the residual, a descent may not converge formally.
    """

    values: np.ndarray
    at_bound: tuple
    intervals: FitIntervals
    rms: float
    agreed: int
    counts: SearchCounts
    outcome: Outcome


class Descent(NamedTuple):
    """Result of a local least-squares search (descent).

    - u: final point (n,) in the unit cube.
    - cost: final sum of squares; infinite if the evaluation at the start failed.
    - is_converged: whether the descent converged.
    - rows: number of rows of the residual.
    """

    u: np.ndarray
    cost: float
    is_converged: bool
    rows: int

    @property
    def rms(self) -> float:
        """Root mean square of the residual; NaN if the evaluation at the start failed."""
        return float(np.sqrt(self.cost / self.rows)) if np.isfinite(self.cost) else np.nan


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Least-squares problem whose residual is a function of n bounded parameters.

    - residual: function of the parameters (n,) that returns the residual (r,), each row divided by its
      standard deviation. An evaluation fails if it raises a PatchfemError or is not finite.
    - low, high: bounds (n,).
    - start: parameters (n,) from which the first descent starts, or None.
    """

    residual: Callable
    low: Sequence
    high: Sequence
    start: Sequence | None = None

    @property
    def search_space(self) -> SearchSpace:
        """Mapping of the bounded parameters to the unit cube."""
        return make_search_space(self.low, self.high)

    def solve(self, max_descents: int = 3, interval_kind: str = IntervalKind.ROWS) -> Fit:
        """Minimize the sum of squares of the residual within the bounds.

        Parameters
        ----------
        max_descents : int
            Largest number of descents; if 1, only that from `start`, unless the evaluation there fails.
        interval_kind : str
            Value of `IntervalKind`.

        Returns
        -------
        Fit

        Raises
        ------
        ValueError
            If the bounds are invalid, or if there are fewer rows than parameters.
        NotConverged
            If the evaluations at all starting points fail.
        """
        space = self.search_space
        model = UnitCubeResidual(self.residual, space)
        n = space.low.size
        start = None if self.start is None else space.to_unit_cube(self.start)
        starting_points = choose_starting_points(model, start, max_descents)
        if model.rows < n:
            raise ValueError(f"{model.rows} rows of data cannot determine {n} values")
        ends = run_descents(model, starting_points, stops_when_exact=True)
        return assemble_fit(model, ends, interval_kind)


def run_descents(
    model: UnitCubeResidual,
    starting_points,
    *,
    stops_when_exact: bool = False,
    storage: DescentStorage | None = None,
    before_descent: Callable | None = None,
    report: Callable | None = None,
) -> list:
    """Minimize the residual by local searches from several points of the unit cube.

    Parameters
    ----------
    model : UnitCubeResidual
    starting_points : sequence of (n,) ndarray
        Points from which the descents start.
    stops_when_exact : bool
        Whether the search ends after a fit that is exact to round-off.
    storage : DescentStorage, optional
        Stored descents, which are not repeated; new descents are added. Default: no storage.
    before_descent : callable, optional
        Called before each descent.
    report : callable, optional
        Called with 1 after each descent.

    Returns
    -------
    list of Descent
    """
    storage = storage or DescentStorage()
    ends = []
    for k, starting_point in enumerate(starting_points):
        end = storage.load(k)
        if end is None:
            if before_descent is not None:
                before_descent()
            end = descend(model, starting_point, range(len(starting_point)))
            storage.save(k, end)
        ends.append(end)
        if report is not None:
            report(1)
        if stops_when_exact and end.cost <= (EXACT_FIT_RATIO * model.largest) ** 2 * model.rows:
            break
    return ends


def assemble_fit(
    model: UnitCubeResidual, ends: list, interval_kind: str = IntervalKind.ROWS, first_descents=None
) -> Fit:
    """Return the result of a least-squares fit from its descents.

    Parameters
    ----------
    model : UnitCubeResidual
    ends : list of Descent
    interval_kind : str
        Value of `IntervalKind`.
    first_descents : list of Descent, optional
        Descents from all starting points, if `ends` continues the best of them; they show whether several
        reached the same minimum.

    Returns
    -------
    Fit
    """
    best = min(ends, key=lambda end: end.cost)
    max_difference = SAME_RESULT_TOL * best.cost + 1e-20 * model.largest**2 * model.rows
    agreed = sum(abs(end.cost - best.cost) <= max_difference for end in ends)
    u = best.u
    cost = best.cost
    if interval_kind != IntervalKind.NONE:
        u, cost = _move_onto_bounds(model, u, cost)
    intervals = make_unknown_intervals(u.size)
    if interval_kind in (IntervalKind.ROWS, IntervalKind.SERIES):
        is_series = interval_kind == IntervalKind.SERIES
        intervals = compute_intervals(model, u, cost, descend, is_series=is_series)
    n_same_minimum = sum(end.cost <= SAME_MINIMUM_RATIO * cost for end in first_descents or ends)
    is_converged = best.is_converged or n_same_minimum > 1
    at_bound = np.where(u <= 0, "low", np.where(u >= 1, "high", ""))
    return Fit(
        values=frozen_array(model.space.to_values(u)),
        at_bound=tuple(at_bound.tolist()),
        intervals=intervals,
        rms=float(np.sqrt(cost / model.rows)),
        agreed=agreed,
        counts=SearchCounts(model.evaluations, model.failures, model.reason),
        outcome=Outcome.DONE if is_converged else Outcome.NOT_CONVERGED,
    )


def choose_starting_points(
    model: UnitCubeResidual, given_start, max_points: int, n_trials: int = 0
) -> list:
    """Return the points of the unit cube from which the local minimisations start.

    Parameters
    ----------
    model : UnitCubeResidual
    given_start : (n,) ndarray or None
        First starting point, unless the evaluation there fails.
    max_points : int
        Largest number of points.
    n_trials : int
        Number of space-filling trial points, of which the best are chosen; 0 for the default of
        N_TRIALS_PER_VALUE per parameter.

    Returns
    -------
    list of (n,) ndarray

    Raises
    ------
    NotConverged
        If the evaluations at all trial points fail.
    """
    n = model.space.low.size
    if max_points == 1 and given_start is not None and model(given_start) is not None:
        return [given_start]
    costs = []
    points = []
    for u in make_space_filling_points(n_trials or N_TRIALS_PER_VALUE * n, n):
        residual = model(u)
        if residual is not None:
            costs.append(float(residual @ residual))
            points.append(u)
    starting_points = [points[k] for k in np.argsort(costs, kind="stable")]
    if given_start is not None and model(given_start) is not None:
        starting_points = [given_start, *starting_points]
    if not starting_points:
        raise NotConverged(
            f"the model failed at all {model.evaluations} starting points of the search: {model.reason}"
        )
    return starting_points[: max(1, max_points)]


class _CubeSlice(NamedTuple):
    """Residual as a function of the free coordinates of the unit cube, with the others fixed.

    - model: residual on the whole unit cube.
    - u: point (n,) with the fixed coordinates.
    - free: indices of the free coordinates (f,).
    """

    model: UnitCubeResidual
    u: np.ndarray
    free: list

    def full_point(self, free_coordinates) -> np.ndarray:
        """Return the point (n,) of the unit cube with given free coordinates (f,)."""
        point = self.u.copy()
        point[self.free] = free_coordinates
        return point

    def residual(self, free_coordinates) -> np.ndarray:
        """Return the residual (r,), or a penalty if the evaluation fails."""
        return self.model.with_penalty(self.full_point(free_coordinates))

    def jacobian(self, free_coordinates) -> np.ndarray:
        """Return the derivatives (r, f) of the residual with respect to the free coordinates."""
        return self.model.jacobian(self.full_point(free_coordinates), self.free)


def descend(model: UnitCubeResidual, u, free) -> Descent:
    """Minimize a residual locally from a point of the unit cube (trust-region reflective method).

    The final sum of squares is never larger than that at the start.

    Parameters
    ----------
    model : UnitCubeResidual
    u : (n,) array_like
        Starting point.
    free : sequence of int
        Indices of the free coordinates.

    Returns
    -------
    Descent
    """
    u = np.array(u, float)
    free = list(free)
    start_residual = model(u)
    if start_residual is None:
        return Descent(u, np.inf, False, model.rows)
    start = Descent(u, float(start_residual @ start_residual), True, model.rows)
    if not free:
        return start

    slice_of_cube = _CubeSlice(model, u, free)
    # the trust-region method needs a start inside the bounds
    for margin in (1e-3, 1e-9):
        inner_start = np.clip(u[free], margin, 1 - margin)
        if model(slice_of_cube.full_point(inner_start)) is not None:
            break
    else:
        return start._replace(is_converged=False)
    residual_scale = max(float(np.abs(slice_of_cube.residual(inner_start)).max()), 1e-300)
    ftol = QUICK_COST_TOL if model.is_expensive else COST_TOL
    result = least_squares(
        lambda part: slice_of_cube.residual(part) / residual_scale,
        inner_start,
        bounds=(0, 1),
        method="trf",
        jac=lambda part: slice_of_cube.jacobian(part) / residual_scale,
        ftol=ftol,
        xtol=10 * ftol,
        gtol=1e-15,
        max_nfev=MAX_EVALUATIONS,
    )
    end = slice_of_cube.full_point(result.x)
    residual = model(end)
    is_converged = result.status > 0
    if residual is None or residual @ residual > start.cost:
        return start._replace(is_converged=is_converged)
    return Descent(end, float(residual @ residual), is_converged, model.rows)


def _move_onto_bounds(model: UnitCubeResidual, u, cost: float) -> tuple:
    """Move parameters near a bound onto it, unless the sum of squares increases.

    A parameter is moved only if the sum of squares decreases towards the bound. The other parameters are
    fitted again. Returns the point u (n,) and the sum of squares.
    """
    gradient = model.jacobian(u, range(u.size)).T @ model(u)
    belongs_on_low = (u < NEAR_BOUND_FRACTION) & (gradient > 0)
    belongs_on_high = (u > 1 - NEAR_BOUND_FRACTION) & (gradient < 0)
    belongs_on_bound = belongs_on_low | belongs_on_high
    if not belongs_on_bound.any():
        return u, cost
    end = descend(
        model, np.where(belongs_on_bound, np.round(u), u), np.flatnonzero(~belongs_on_bound)
    )
    return (end.u, end.cost) if end.cost <= cost * (1 + 1e-9) else (u, cost)
