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


class Descents(NamedTuple):
    """Descents of a search with an expensive residual.

    starts, ends: parameters (s, n) at the starting and at the final points, NaN if a descent failed; rms: (s,) root mean
    square of the residual at the ends.
    """

    starts: np.ndarray
    ends: np.ndarray
    rms: np.ndarray


@dataclass(frozen=True, slots=True)
class Search:
    """Search from random starting points, for a residual that is expensive to evaluate.

    Derivatives are one-sided differences; the best descent is continued with central ones.

    - starts, seed: number of starting points, and seed of the random numbers.
    - load, save: functions of the number of a start that return the stored descent or None, and store one.
    - before_descent: called before each descent.
    - report: called with 1 after each descent.
    """

    starts: int
    seed: int = 0
    load: Callable = lambda start: None
    save: Callable = lambda start, descent: None
    before_descent: Callable = lambda: None
    report: Callable = lambda count: None


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
        ends = []
        for point in choose_starting_points(model, start, max_descents):
            if model.rows < n:
                raise ValueError(f"{model.rows} rows of data cannot determine {n} values")
            ends.append(descend(model, point, range(n)))
            # a fit that is exact to round-off is not repeated
            if ends[-1].cost <= (EXACT_FIT_RATIO * model.largest) ** 2 * model.rows:
                break
        return _assemble_fit(model, min(ends, key=lambda end: end.cost), ends, interval_kind)

    def search(
        self, search: Search, interval_kind: str = IntervalKind.ROWS
    ) -> tuple[Fit, Descents]:
        """Minimize the sum of squares of an expensive residual from random starting points.

        Raises NotConverged if all descents fail.
        """
        space = self.search_space
        n = space.low.size
        model = UnitCubeResidual(self.residual, space, is_expensive=True)
        starts = np.random.default_rng(search.seed).random((search.starts, n))
        ends = []
        for k, start in enumerate(starts):
            end = search.load(k)
            if end is None:
                search.before_descent()
                end = descend(model, start, range(n))
                search.save(k, end)
            ends.append(end)
            search.report(1)
        best = min(ends, key=lambda end: end.cost)
        if not np.isfinite(best.cost):
            raise NotConverged(
                f"fit: all {search.starts} searches failed; the first failed for this reason: {model.reason}"
            )
        search.before_descent()
        best = descend(UnitCubeResidual(self.residual, space), best.u, range(n))
        final = [
            space.to_values(end.u) if np.isfinite(end.cost) else np.full(n, np.nan) for end in ends
        ]
        descents = Descents(
            starts=np.array([space.to_values(start) for start in starts]),
            ends=np.array(final),
            rms=np.array([end.rms for end in ends]),
        )
        return _assemble_fit(model, best, ends, interval_kind), descents


def _assemble_fit(
    model: UnitCubeResidual, best: Descent, ends: list[Descent], interval_kind: str
) -> Fit:
    """Return the result of a fit from its best descent and the descents from all starting points."""
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

    # with round-off noise in the residual a descent may not converge formally
    n_same_minimum = sum(end.cost <= SAME_MINIMUM_RATIO * cost for end in ends)
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
