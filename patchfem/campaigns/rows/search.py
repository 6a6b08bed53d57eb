"""Search for the best-fit parameters of a rig from random starting points.

The search uses the training readings only.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core import NotConverged
from ...identify.least_squares import (
    Descent,
    DescentStorage,
    Fit,
    Problem,
    assemble_fit,
    run_descents,
)
from ...identify.space import UnitCubeResidual
from .cells import Readings
from .model_readings import ModelReadings

# Treatments of a reading flagged U (unstable): as a lower bound, excluded, or as any other.
UNSTABLE = ("bound", "out", "read")


@dataclass(frozen=True, eq=False, slots=True)
class BestFit:
    """Best fit of a search from several starting points.

    Attributes
    ----------
    fit : Fit
        Fitted parameters with confidence intervals.
    starts : (s, n) array
        Parameters at the starting point of each descent.
    ends : (s, n) array
        Parameters at the end of each descent; NaN if it failed.
    rms : (s,) array
        Root mean square log ratio of the training readings at the end of each descent.
    """

    fit: Fit
    starts: np.ndarray
    ends: np.ndarray
    rms: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class SearchSettings:
    """Settings of a search from random starting points.

    Attributes
    ----------
    starts : int
        Number of random starting points.
    seed : int
        Seed of the random numbers.
    unstable : str
        Treatment of readings flagged U, one of UNSTABLE.
    access_ends : callable
        Access to a checkpoint of the finished descents: access_ends(name) returns the stored
        list of numbers or None, access_ends(name, numbers) stores it.
    """

    starts: int = 8
    seed: int = 0
    unstable: str = "bound"
    access_ends: Callable = lambda *arguments: None


def make_residual(
    readings: Readings, model_readings: ModelReadings, training, unstable: str
) -> Callable:
    """Return the function that computes the log ratios of selected readings from free parameters.

    Parameters
    ----------
    readings : Readings
    model_readings : ModelReadings
    training : (n,) bool
        Mask of the readings in the residual.
    unstable : str
        Treatment of readings flagged U. "bound": such a reading is a lower bound, because the
        motion was still growing, so that only a smaller computed value gives a residual; "out":
        the reading is excluded; "read": it is treated like any other reading.
    """
    is_used = training & ~readings.unstable if unstable == "out" else training
    conditions = sorted(set(readings.condition[is_used].tolist()))
    is_lower_bound = (
        readings.unstable[is_used] if unstable == "bound" else np.zeros(int(is_used.sum()), bool)
    )

    def residual(values):
        """Return the log ratios (r,) of computed to measured readings for parameters (n,)."""
        logs = readings.compute_log_ratios(*model_readings(values, conditions))[is_used]
        return np.where(is_lower_bound, np.minimum(logs, 0.0), logs)

    return residual


class _StoredDescents(DescentStorage):
    """Local minimisations of a search, stored as lists of numbers in a checkpoint of the caller.

    Parameters
    ----------
    name : str
        Name of the search.
    access_ends : callable
        As in `SearchSettings`.
    """

    def __init__(self, search_name: str, access_ends: Callable):
        self.name = search_name
        self.access_ends = access_ends

    def save(self, start: int, descent: Descent) -> None:
        """Store the descent from a starting point."""
        stored_cost = descent.cost if np.isfinite(descent.cost) else None
        numbers = [*descent.u.tolist(), stored_cost, descent.rows, bool(descent.is_converged)]
        self.access_ends(f"{self.name}/{start}", numbers)

    def load(self, start: int) -> Descent | None:
        """Return the stored descent from a starting point; None if there is none."""
        stored = self.access_ends(f"{self.name}/{start}")
        if not stored:
            return None
        *u, cost, rows, is_converged = stored
        return Descent(np.array(u), np.inf if cost is None else cost, is_converged, rows)


def search_random_starts(
    problem: Problem,
    settings: SearchSettings,
    before_descent: Callable,
    interval_kind: str = "rows",
    search_name: str = "",
    report: Callable | None = None,
) -> BestFit:
    """Solve a least-squares problem with an expensive residual from random starting points.

    The first motions of each descent start from rest, so that its result depends only on its
    starting point and on the training readings. The descent with the smallest sum of squares is
    continued until it converges.

    Parameters
    ----------
    problem : Problem
    settings : SearchSettings
    before_descent : callable
        Called before each descent to make its first motions start from rest.
    interval_kind : str
        As in `Problem.solve`.
    search_name : str
        Name under which the finished descents are stored.
    report : callable, optional
        Called with 1 after each descent.

    Returns
    -------
    BestFit

    Raises
    ------
    NotConverged
        If all descents fail.
    """
    space = problem.search_space
    n = space.low.size
    quick_residual = UnitCubeResidual(problem.residual, space, is_expensive=True)
    starts = np.random.default_rng(settings.seed).random((settings.starts, n))
    ends = run_descents(
        quick_residual,
        starts,
        storage=_StoredDescents(search_name, settings.access_ends),
        before_descent=before_descent,
        report=report,
    )
    rms = np.array([end.rms for end in ends])
    if np.isnan(rms).all():
        raise NotConverged(
            f"fit: all {settings.starts} searches failed; the first failed for this reason: {quick_residual.reason}"
        )
    best = run_descents(
        UnitCubeResidual(problem.residual, space),
        [ends[int(np.nanargmin(rms))].u],
        before_descent=before_descent,
    )
    end_values = []
    for end in ends:
        end_values.append(space.to_values(end.u) if np.isfinite(end.cost) else np.full(n, np.nan))
    return BestFit(
        fit=assemble_fit(quick_residual, best, interval_kind, ends),
        starts=np.array([space.to_values(u) for u in starts]),
        ends=np.array(end_values),
        rms=rms,
    )
