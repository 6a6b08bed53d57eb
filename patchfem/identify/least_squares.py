"""Least squares with bounds: fitted parameters, 95 % intervals, and undetermined directions.

The parameters are mapped to the unit cube, on a logarithmic scale if the bounds are positive and wide. Local
searches (descents) start from several points, the same in every call. The confidence intervals are those of
the linearized problem, with Student's t distribution for (rows - parameters) degrees of freedom. In a time
series, only the independent rows count (`correlation`). If the residual is not linear over an interval, or
the parameter lies on a bound, the interval follows from the profile of the sum of squares.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum

import numpy as np

from ..core import NotConverged, Outcome
from .descent import Descent, descend
from .intervals import FitIntervals, compute_intervals
from .space import (
    SearchCounts,
    UnitCubeResidual,
    make_search_space,
    make_space_filling_points,
)

# Largest root mean square residual of an exact fit, relative to the largest residual of the search.
EXACT_FIT_RATIO = 1e-9
# A descent has reached the best minimum if the ratio of its residual to the smallest one is at most this value.
SAME_MINIMUM_RATIO = 1.01
# Largest distance from a bound at which a parameter is tried on the bound, relative to its range.
NEAR_BOUND_FRACTION = 1e-3
# Number of trial points per parameter for the choice of the starting points.
N_TRIALS_PER_VALUE = 8


class IntervalKind(StrEnum):
    """Assumption on the errors of the data from which confidence intervals are computed.

    - ROWS: the rows are independent.
    - SERIES: the rows are a time series, in which correlated neighbours count as fewer rows.
    - NONE: no intervals are computed, and no parameter is tried on a bound.
    """

    ROWS = "rows"
    SERIES = "series"
    NONE = ""


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """Result of a least-squares fit of n parameters.

    - values: fitted parameters (n,).
    - at_bound: "low", "high" or "" for each parameter.
    - intervals: 95 % intervals, and undetermined directions; None if they were not asked for.
    - rms: root mean square of the residual.
    - counts: number of evaluations of the residual.
    - outcome: DONE if the best descent converged, or if another one reached the same minimum. With
      round-off noise in the residual, a descent may not converge formally.
    - descent_rms: root mean square (s,) of the residual at the end of each descent, infinite if the descent failed.
    """

    values: np.ndarray
    at_bound: tuple[str, ...]
    intervals: FitIntervals | None
    rms: float
    counts: SearchCounts
    outcome: Outcome
    descent_rms: np.ndarray

    @property
    def n_best(self) -> int:
        """Number of descents that ended within 1 % of the smallest residual."""
        return _count_best(self.descent_rms, self.descent_rms.min())

    def count_earlier_search(self, earlier: "Fit") -> "Fit":
        """Return this fit with evaluations and descents of an earlier search, which gave its only start."""
        counts = earlier.counts.add(self.counts)
        return replace(self, counts=counts, descent_rms=earlier.descent_rms)

    def widen(self, changes, bounds) -> "Fit":
        """Return this fit with intervals that contain the effect of numerical errors of the model.

        An error that changes the residual by d shifts the parameters as in linear least squares, by (J^T J)^-1 J^T d. Both
        ends of an interval move outwards by the sum of the shifts.

        Parameters
        ----------
        changes : (m, r) array_like
            Change of the residual by each of m errors, whose signs are not known.
        bounds : sequence of (low, high)
            Bounds of the n parameters.
        """
        intervals = self.intervals
        sizes = np.abs(intervals.shifts @ np.transpose(changes)).sum(axis=1)
        ends = np.clip(intervals.ends + sizes[:, None] * [-1, 1], *np.transpose(bounds)[:, :, None])
        open_ends = intervals.open_ends | (ends == bounds)

        # Data that exclude neither bound do not determine the parameter.
        is_unknown = open_ends.all(axis=1)
        ends[is_unknown] = np.nan
        methods = tuple(np.where(is_unknown, "none", intervals.methods).tolist())
        widened = replace(intervals, ends=ends, open_ends=open_ends, methods=methods)
        return replace(self, intervals=widened)


@dataclass(frozen=True, slots=True)
class Search:
    """Starting points of a search, and what accompanies its descents.

    - starts: number of descents. With one, only that from the start of the problem, unless the evaluation there fails.
    - seed: seed of random starting points, for a residual that is expensive to evaluate: derivatives are one-sided
      differences, and the best descent is continued with central ones. None: the start of the problem and the best of
      some trial points.
    - before_descent, report: called before and after each descent.
    """

    starts: int
    seed: int | None = None
    before_descent: Callable[[], None] = lambda: None
    report: Callable[[], None] = lambda: None


@dataclass(frozen=True, eq=False, slots=True)
class Problem:
    """Least-squares problem whose residual is a function of n bounded parameters.

    - residual: function of the parameters (n,) that returns the residual (r,), each row divided by its
      standard deviation. An evaluation fails if it raises a PatchfemError or is not finite.
    - low, high: bounds (n,).
    - start: parameters (n,) from which the first descent starts, NaN for the middle of a range; None without them.
    """

    residual: Callable[[np.ndarray], np.ndarray]
    low: Sequence
    high: Sequence
    start: Sequence | None = None

    def solve(self, max_descents: int = 3, interval_kind: str = IntervalKind.ROWS) -> Fit:
        """Minimize the sum of squares from the start of the problem and the best of some trial points.

        `max_descents` is the largest number of descents; the rest is as in `search`.
        """
        return self.search(Search(max_descents), interval_kind)

    def search(self, search: Search, interval_kind: str = IntervalKind.ROWS) -> Fit:
        """Minimize the sum of squares of the residual within the bounds.

        Parameters
        ----------
        search : Search
            Starting points and callbacks of the search.
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
        n = len(self.low)
        is_random = search.seed is not None
        space = make_search_space(self.low, self.high)
        model = UnitCubeResidual(self.residual, space, is_expensive=is_random)
        if is_random:
            starts = list(np.random.default_rng(search.seed).random((search.starts, n)))
        else:
            starts = self._choose_starts(model, search.starts)
            if model.rows < n:
                raise ValueError(f"{model.rows} rows of data cannot determine {n} values")

        ends = []
        for start in starts:
            search.before_descent()
            end = descend(model, start, range(n))
            ends.append(end)
            search.report()
            # a fit that is exact to round-off is not repeated
            if not is_random and end.cost <= (EXACT_FIT_RATIO * model.largest) ** 2 * model.rows:
                break
        best = min(ends, key=lambda end: end.cost)
        if not np.isfinite(best.cost):
            raise NotConverged(
                f"fit: all {len(ends)} searches failed; the first failed for this reason: {model.counts.reason}"
            )
        descent_rms = np.sqrt([end.cost / max(end.rows, 1) for end in ends])
        if is_random:
            # the best descent is continued with central differences
            search.before_descent()
            model.is_expensive = False
            best = descend(model, best.u, range(n))
            model.is_expensive = True
        return _assemble_fit(model, best, descent_rms, interval_kind)

    def _choose_starts(self, model: UnitCubeResidual, max_points: int) -> list[np.ndarray]:
        """Return the starting points (n,) in the unit cube: that of the problem, then the best of some trial points."""
        n = len(self.low)
        given_points = []
        if self.start is not None:
            given_points = [model.space.to_unit_cube(self.start)]
            if not np.isfinite(model.sum_of_squares(given_points[0])):
                given_points = []
        trials = []
        if max_points > 1 or not given_points:
            trials = list(make_space_filling_points(N_TRIALS_PER_VALUE * n, n))
        costs = np.array([model.sum_of_squares(point) for point in trials])
        order = np.argsort(costs, kind="stable")
        points = given_points + [trials[k] for k in order if np.isfinite(costs[k])]
        if not points:
            raise NotConverged(
                f"the model failed at all {model.counts.evaluations} starting points of the search: {model.counts.reason}"
            )
        return points[: max(1, max_points)]


def _count_best(descent_rms: np.ndarray, smallest: float) -> int:
    """Return the number of descents within 1 % of the smallest root mean square."""
    return int(np.count_nonzero(descent_rms <= SAME_MINIMUM_RATIO * smallest))


def _assemble_fit(
    model: UnitCubeResidual, best: Descent, descent_rms: np.ndarray, kind: str
) -> Fit:
    """Return the result of a fit from its best descent.

    `best` is the descent with the smallest sum of squares, `descent_rms` the root mean square of the residual after each
    descent, and `kind` a value of `IntervalKind`.
    """
    u = best.u
    cost = best.cost
    intervals = None
    if kind != IntervalKind.NONE:
        u, cost = _move_onto_bounds(model, u, cost)
        is_series = kind == IntervalKind.SERIES
        intervals = compute_intervals(model, u, cost, is_series=is_series)
    rms = np.sqrt(cost / best.rows)
    is_converged = best.is_converged or _count_best(descent_rms, rms) > 1
    return Fit(
        values=model.space.to_values(u),
        at_bound=tuple(np.where(u <= 0, "low", np.where(u >= 1, "high", "")).tolist()),
        intervals=intervals,
        rms=rms,
        counts=model.counts,
        outcome=Outcome.DONE if is_converged else Outcome.NOT_CONVERGED,
        descent_rms=descent_rms,
    )


def _move_onto_bounds(model: UnitCubeResidual, u, cost: float) -> tuple[np.ndarray, float]:
    """Move parameters that are near a bound onto it, and fit the others again, unless the sum of squares increases.

    A parameter is moved only if the sum of squares decreases towards the bound. `u` (n,) is a point in the unit cube,
    and `cost` its sum of squares. Returned are both after the move.
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
