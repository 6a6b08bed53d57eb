"""Search for the best-fit parameters of a rig from random starts.

A search uses nothing but the training readings.
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
from .computed import ModelReadings

# How a reading flagged U counts in a fit: as a lower bound, not at all, or as any other.
UNSTABLE = ("bound", "out", "read")


@dataclass(frozen=True, eq=False, slots=True)
class BestFit:
    """Best fit of a search from several starts.

    Attributes
    ----------
    fit : Fit
        Values with intervals.
    starts : (s, n) array
        Values at which each start began.
    ends : (s, n) array
        Values at which each start ended; NaN if it failed.
    rms : (s,) array
        Root mean square of the training logarithms at the ends.
    """

    fit: Fit
    starts: np.ndarray
    ends: np.ndarray
    rms: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class SearchSettings:
    """Settings of the search for the best-fit parameters.

    Attributes
    ----------
    starts : int
        Number of random starts.
    seed : int
        Seed of the random starts.
    unstable : str
        How readings flagged U count, one of UNSTABLE.
    access_ends : callable
        Stores the ends of starts: access_ends(name) returns a stored list or None,
        access_ends(name, list) stores it.
    """

    starts: int = 8
    seed: int = 0
    unstable: str = "bound"
    access_ends: Callable = lambda *arguments: None


def make_residual(cells: Readings, computed: ModelReadings, training, unstable: str) -> Callable:
    """Return the function that gives the log ratios of selected readings, by free parameters.

    Parameters
    ----------
    cells : Readings
    computed : ModelReadings
    training : (n,) bool
        Readings of the residual.
    unstable : str
        How a reading flagged U counts. "bound": it is a lower bound, because the motion still grew,
        so only a computed value below it counts; "out": not at all; "read": as any other reading.
    """
    used = training & ~cells.unstable if unstable == "out" else training
    conditions = sorted(set(cells.condition[used].tolist()))
    bound = cells.unstable[used] if unstable == "bound" else np.zeros(int(used.sum()), bool)

    def residual(values):
        """Return the residual for given free parameters (n,)."""
        logs = cells.logs(*computed(values, conditions))[used]
        return np.where(bound, np.minimum(logs, 0.0), logs)

    return residual


class _StoredDescents(DescentStorage):
    """Descents from the starts of a search, which a caller can store as lists.

    Parameters
    ----------
    name : str
        Name of the search.
    access_ends : callable
        As in `SearchSettings`.
    """

    def __init__(self, name: str, access_ends: Callable):
        self.name = name
        self.access_ends = access_ends

    def save(self, start: int, descent: Descent) -> None:
        """Store the descent from a start."""
        stored_cost = descent.cost if np.isfinite(descent.cost) else None
        numbers = [*descent.u.tolist(), stored_cost, descent.rows, bool(descent.is_converged)]
        self.access_ends(f"{self.name}/{start}", numbers)

    def load(self, start: int) -> Descent | None:
        """Return the stored descent from a start, or None."""
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
    name: str = "",
    report: Callable | None = None,
) -> BestFit:
    """Solve a least-squares problem with an expensive residual from random starts.

    Each start begins with motions from rest, so that its result depends only on its starting values
    and on the training readings. The descent with the smallest sum of squares is continued until it
    converges.

    Parameters
    ----------
    problem : Problem
    settings : SearchSettings
    before_descent : callable
        Called before each descent, so that its first motions start from rest.
    interval_kind : str
        As in `Problem.solve`.
    name : str
        Name under which the ends of the starts are stored.
    report : callable, optional
        Called with 1 after each start.

    Returns
    -------
    BestFit

    Raises
    ------
    NotConverged
        If all starts fail.
    """
    space = problem.space
    n = space.low.size
    quick = UnitCubeResidual(problem.residual, space, is_quick=True)
    starts = np.random.default_rng(settings.seed).random((settings.starts, n))
    ends = run_descents(
        quick,
        starts,
        storage=_StoredDescents(name, settings.access_ends),
        before_descent=before_descent,
        report=report,
    )
    rms = np.array([end.rms for end in ends])
    if np.isnan(rms).all():
        raise NotConverged(
            f"fit: all {settings.starts} searches failed; the first failed for this reason: {quick.reason}"
        )
    best = run_descents(
        UnitCubeResidual(problem.residual, space),
        [ends[int(np.nanargmin(rms))].u],
        before_descent=before_descent,
    )
    end_values = []
    for end in ends:
        end_values.append(space.values(end.u) if np.isfinite(end.cost) else np.full(n, np.nan))
    return BestFit(
        fit=assemble_fit(quick, best, interval_kind, ends),
        starts=np.array([space.values(u) for u in starts]),
        ends=np.array(end_values),
        rms=rms,
    )
