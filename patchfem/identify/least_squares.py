"""Least squares with bounds: fitted parameters, 95 % intervals, and undetermined directions.

Descents start from several points, the same in every call, and end where an earlier one has ended. If evaluations are
expensive, they use one-sided differences and secants. The confidence intervals (`intervals`) use Student's t distribution
for (rows - parameters) degrees of freedom.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..core import NotConverged, Outcome
from .descent import Descent, SearchCounts, UnitCubeResidual, descend, make_search_space
from .intervals import FitIntervals, IntervalKind, compute_intervals

# A descent has reached the best minimum if the ratio of its residual to the smallest one is at most this value.
SAME_MINIMUM_RATIO = 1.01


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
        return np.count_nonzero(self.descent_rms <= SAME_MINIMUM_RATIO * self.descent_rms.min())

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


class Problem:
    """Least-squares problem whose residual is a function of n bounded parameters.

    Parameters
    ----------
    residual : callable
        Function of the parameters (n,) that returns the residual (r,). An evaluation fails if it raises a PatchfemError or
        is not finite.
    low, high : sequence of float
        Bounds (n,).
    start : sequence of float or Fit, optional
        Parameters (n,) from which the first descent starts, NaN for the middle of a range; or the result of an earlier
        search, whose descents and evaluations count in the result.
    before_start : callable, optional
        Called before each starting point and each descent.
    is_expensive : bool
        Whether descents use a looser tolerance, one-sided differences and secants.
    """

    def __init__(
        self,
        residual: Callable[[np.ndarray], np.ndarray],
        low: Sequence,
        high: Sequence,
        start: Sequence | Fit | None = None,
        before_start: Callable[[], None] = lambda: None,
        *,
        is_expensive: bool = False,
    ):
        space = make_search_space(low, high)
        self.model = UnitCubeResidual(residual, space, is_expensive=is_expensive)
        self.start = start
        self.earlier_rms = None
        if isinstance(start, Fit):
            self.start = start.values
            self.earlier_rms = start.descent_rms
            self.model.counts = start.counts
        self.before_start = before_start

    def solve(self, max_descents: int = 3, interval_kind: str = IntervalKind.ROWS) -> Fit:
        """Minimize the sum of squares of the residual (`search`), and compute intervals (`add_intervals`)."""
        return self.add_intervals(self.search(max_descents), interval_kind)

    def search(self, max_descents: int, report: Callable[[], None] = lambda: None) -> Fit:
        """Minimize the sum of squares from the start of the problem and the best of some trial points.

        Parameters
        ----------
        max_descents : int
            Largest number of descents. With one, only that from the start of the problem, unless the evaluation there
            fails.
        report : callable
            Called after each descent.

        Returns
        -------
        Fit
            Without intervals.

        Raises
        ------
        ValueError
            If there are fewer rows than parameters.
        NotConverged
            If the evaluations at all starting points fail.
        """
        model = self.model
        starts = self._choose_starts(max_descents)
        n = starts[0].size
        if model.rows < n:
            raise ValueError(
                f"{model.rows} rows of data cannot determine {n} values; "
                "free fewer keys, or give more data"
            )

        ends: list[Descent] = []
        for start in starts:
            self.before_start()
            ends.append(descend(model, start, ends))
            report()
        best = min(ends, key=lambda end: end.cost)
        descent_rms = np.sqrt([end.cost / end.rows for end in ends])
        rms = np.sqrt(best.cost / best.rows)
        n_confirming = np.count_nonzero(descent_rms <= SAME_MINIMUM_RATIO * rms)
        is_done = best.is_converged or n_confirming > 1
        if self.earlier_rms is not None:
            descent_rms = self.earlier_rms
        return Fit(
            values=model.space.to_values(best.u),
            at_bound=tuple(
                np.where(best.u <= 0, "low", np.where(best.u >= 1, "high", "")).tolist()
            ),
            intervals=None,
            rms=rms,
            counts=model.counts,
            outcome=Outcome.DONE if is_done else Outcome.NOT_CONVERGED,
            descent_rms=descent_rms,
        )

    def add_intervals(self, fit: Fit, kind: str) -> Fit:
        """Return a fit of this problem with the 95 % intervals of its values, under an `IntervalKind`."""
        intervals = compute_intervals(self.model, self.model.space.to_unit_cube(fit.values), kind)
        return replace(fit, intervals=intervals, counts=self.model.counts)

    def _choose_starts(self, max_points: int) -> list[np.ndarray]:
        """Return the starting points (n,) in the unit cube: that of the problem, then the best of some trial points."""
        space = self.model.space
        n = space.low.size
        given = [] if self.start is None else [space.to_unit_cube(self.start)]
        points = [point for point in given if np.isfinite(self._try_point(point))]
        trials = []
        if max_points > len(points):
            # Trial points per parameter, or per start of an expensive residual
            count = 3 * max_points if self.model.is_expensive else 8 * n
            trials = make_space_filling_points(count, n)
            costs = np.array([self._try_point(point) for point in trials])
            order = np.argsort(costs, kind="stable")
            points += [trials[k] for k in order if np.isfinite(costs[k])]
        if not points:
            raise NotConverged(
                f"the model failed at all {len(given) + len(trials)} starting points of the search: "
                f"{self.model.counts.reason}"
            )
        return points[: max(1, max_points)]

    def _try_point(self, point: np.ndarray) -> float:
        """Return the sum of squares at a starting point (n,) in the unit cube; infinite if the evaluation fails."""
        self.before_start()
        return self.model.sum_of_squares(point)


def make_space_filling_points(count: int, n: int) -> np.ndarray:
    """Return points (count, n) of the unit cube with low discrepancy, the same in every call.

    The points are an additive recurrence with the root of x^(n + 1) = x + 1 (Roberts 2018).
    """
    root = 2.0
    for _ in range(60):
        root = (1 + root) ** (1 / (n + 1))
    return (0.5 + np.outer(np.arange(1, count + 1), root ** -np.arange(1.0, n + 1))) % 1.0
