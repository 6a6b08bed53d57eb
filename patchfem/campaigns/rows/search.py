"""Search for the values of a rig that fit some readings best, from random starts.

A search uses nothing but the training readings.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core import NotConverged
from ...identify.least_squares import Descent, Fit, assemble_fit, run_descents
from ...identify.space import CubeResidual, make_space
from .cells import Readings
from .computed import ModelReadings

# how a reading flagged U counts in a fit: as a lower bound, not at all, or as any other
UNSTABLE = ("bound", "out", "read")


@dataclass(frozen=True, eq=False, slots=True)
class BestFit:
    """The best fit of several starts.

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
    """Settings of the search for the best values.

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
    access_ends: Callable = lambda *given: None


def make_residual(cells: Readings, computed: ModelReadings, training, unstable: str) -> Callable:
    """Return the residual ln(computed/measured) of some readings, as a function of the values.

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
        """Return the residual at values (n,) of the free keys."""
        logs = cells.logs(*computed(values, conditions))[used]
        return np.where(bound, np.minimum(logs, 0.0), logs)

    return residual


def fit_readings(
    cells: Readings,
    computed: ModelReadings,
    training,
    how: SearchSettings,
    bars: str = "rows",
    name: str = "",
    tell: Callable | None = None,
) -> BestFit:
    """Fit the free values to some readings within their ranges.

    Each start begins with motions from rest, so that its result depends only on its starting values
    and on the training readings. The descent with the smallest training residual is continued until
    it converges.

    Parameters
    ----------
    cells : Readings
    computed : ModelReadings
    training : (n,) bool
        Readings of the fit.
    how : SearchSettings
    bars : str
        Kind of intervals, as in `identify.least_squares.fit`.
    name : str
        Name under which the ends of the starts are stored.
    tell : callable, optional
        Called after each start.

    Returns
    -------
    BestFit

    Raises
    ------
    NotConverged
        If all starts fail.
    """
    wanted = computed.asked.wanted
    box = make_space([one.low for one in wanted], [one.high for one in wanted])
    residual = make_residual(cells, computed, training, how.unstable)
    n = len(wanted)
    quick = CubeResidual(residual, box, is_quick=True)
    begins = np.random.default_rng(how.seed).random((how.starts, n))

    def access_descent(k, *one):
        """Store a Descent as a list that a file can contain, or return the stored one."""
        if one:
            u, cost, done, rows = one[0]
            how.access_ends(
                f"{name}/{k}", [*u.tolist(), cost if np.isfinite(cost) else None, rows, bool(done)]
            )
            return None
        known = how.access_ends(f"{name}/{k}")
        return known and Descent(
            np.array(known[:n]),
            np.inf if known[n] is None else known[n],
            known[n + 2],
            known[n + 1],
        )

    ends = run_descents(
        quick, begins, saved=access_descent, before_descent=computed.forget, report=tell
    )
    rms = np.array([one.rms for one in ends])
    if np.isnan(rms).all():
        raise NotConverged(
            f"fit: all {how.starts} searches failed; the first failed for this reason: {quick.reason}"
        )
    best = run_descents(
        CubeResidual(residual, box),
        [ends[int(np.nanargmin(rms))].u],
        before_descent=computed.forget,
    )
    found = assemble_fit(quick, best, bars, ends)
    values = np.array(
        [box.values(one.u) if np.isfinite(one.cost) else np.full(n, np.nan) for one in ends]
    )
    return BestFit(found, np.array([box.values(u) for u in begins]), values, rms)
