"""The best values of a rig for some readings, from random starts that see nothing but these readings."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from ...core import NotConverged
from ...identify.least_squares import Descent, Fit, assemble_fit, descents
from ...identify.space import CubeResidual, space
from .cells import Cells
from .computed import Computed

UNSTABLE = ("bound", "out", "read")  # what a reading flagged U counts as in a fit


@dataclass(frozen=True, eq=False, slots=True)
class Found:
    """The best of some starts. fit: its values with intervals; starts: (s, n) values at which each began; ends: (s, n)
    at which each ended, NaN where it failed; rms: (s,) root mean square of the training logarithms there."""

    fit: Fit
    starts: np.ndarray
    ends: np.ndarray
    rms: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Search:
    """How values are looked for: number of random starts, their seed, what readings flagged U count as (UNSTABLE), and
    what keeps the ends of starts: kept(name) -> a list or None, kept(name, list) keeps it."""

    starts: int = 8
    seed: int = 0
    unstable: str = "bound"
    kept: Callable = lambda *given: None


def residual_of(cells: Cells, computed: Computed, training, unstable: str) -> Callable:
    """The residual(values) of the readings `training` (n,) bool: ln(computed/measured).

    unstable: a reading flagged U is a lower bound of a motion that still grew, so that only what lies below it counts
    ("bound"), is left out ("out"), or is a reading as any other ("read").
    """
    used = training & ~cells.unstable if unstable == "out" else training
    conditions = sorted(set(cells.condition[used].tolist()))
    bound = cells.unstable[used] if unstable == "bound" else np.zeros(int(used.sum()), bool)

    def residual(values):
        logs = cells.logs(*computed(values, conditions))[used]
        return np.where(bound, np.minimum(logs, 0.0), logs)

    return residual


def searched(
    cells: Cells,
    computed: Computed,
    training,
    how: Search,
    bars: str = "rows",
    name: str = "",
    tell: Callable | None = None,
) -> Found:
    """The Found of the readings `training` (n,) bool within the ranges that are asked for.

    Every start begins with motions from rest, so that nothing but its own place and the training readings matters. The
    one with the least training residual is followed to its end; bars as in `identify.least_squares.fit`. tell: called
    after each start. NotConverged where every start fails.
    """
    wanted = computed.asked.wanted
    box = space([one.low for one in wanted], [one.high for one in wanted])
    residual, n = residual_of(cells, computed, training, how.unstable), len(wanted)
    quick = CubeResidual(residual, box, quick=True)
    begins = np.random.default_rng(how.seed).random((how.starts, n))

    def kept(k, *one):
        """Keep a Descent as a list that a file can hold, or give it back."""
        if one:
            u, cost, done, rows = one[0]
            how.kept(
                f"{name}/{k}", [*u.tolist(), cost if np.isfinite(cost) else None, rows, bool(done)]
            )
            return None
        known = how.kept(f"{name}/{k}")
        return known and Descent(
            np.array(known[:n]),
            np.inf if known[n] is None else known[n],
            known[n + 2],
            known[n + 1],
        )

    ends = descents(quick, begins, stored=kept, before=computed.forget, report=tell)
    rms = np.array([one.rms for one in ends])
    if np.isnan(rms).all():
        raise NotConverged(
            f"fit: all {how.starts} searches failed; the first failed for this reason: {quick.reason}"
        )
    best = descents(
        CubeResidual(residual, box), [ends[int(np.nanargmin(rms))].u], before=computed.forget
    )
    found = assemble_fit(quick, best, bars, ends)
    values = np.array(
        [box.values(one.u) if np.isfinite(one.cost) else np.full(n, np.nan) for one in ends]
    )
    return Found(found, np.array([box.values(u) for u in begins]), values, rms)
