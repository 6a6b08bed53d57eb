"""Least squares of a residual within bounds: values, 95 % intervals, and what the rows do not determine.

The search runs in the unit cube of the bounds (logarithms where they are positive and wide) from several starts, the
same every time. The intervals are those of the linearised problem (Student t with rows - values degrees of freedom,
rows in an order counted by what they tell, `correlation`);
where the residual is not linear over them, and at a bound, they come from the profile of the sum of squares.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares

from ..core import NotConverged, Outcome, frozen_array
from .intervals import FitIntervals, intervals, nothing
from .space import Counted, space, spread_points

QUICK = 1e-4  # change of the sum of squares by a step at which the descent of a quick model ends
MOST = 100  # evaluations of one descent, Jacobians not counted
EXACT = 1e-9  # of the largest residual seen: an answer this good needs no other start
VALLEY = 1.02  # times the least sum of squares, 1 % of the score: descents that end below it found one valley
NEAR = 1e-3  # of the range: a value this close to a bound is tried on it


@dataclass(frozen=True, eq=False, slots=True)
class Fit:
    """A least-squares answer.

    values: (n,); intervals: (n, 2) of 95 %, NaN where the rows do not determine a value; methods: (n,) "linear",
    "profile" or "none"; open_ends: (n, 2) whether an end is only the bound; correlation: (n, n), NaN likewise; rms:
    root mean square of the residual; sensitivity: (n,) rms change of the residual per range of a value; at_bound: (n,)
    "low", "high" or ""; unknown: (d, n) directions of relative change (of change over range where a value is 0) that
    leave the residual as it is; rows: independent ones that the intervals count, NaN without intervals; failures and
    reason: evaluations that failed, and the first cause; agreed: descents that ended at the same sum of squares.
    outcome: done where the best descent settled, or another one ended in the same valley; a residual that is rough in
    its last digits never lets a step settle to 1e-10.
    """

    values: np.ndarray
    intervals: np.ndarray
    methods: tuple
    open_ends: np.ndarray
    correlation: np.ndarray
    rms: float
    sensitivity: np.ndarray
    at_bound: tuple
    unknown: np.ndarray
    rows: float
    evaluations: int
    failures: int
    reason: str
    agreed: int
    outcome: Outcome


def fit(
    residual: Callable, low, high, log=None, start=None, starts: int = 3, bars: str = "rows"
) -> Fit:
    """Minimise the sum of squares of residual(values (n,)) -> (r,) within [low, high] (n,).

    log: (n,) flags, None decides (see `space`); start: (n,) values tried first; starts: descents at most, 1 from
    `start` alone where it works; bars: "rows" takes rows as independent, "series" counts neighbours that correlate as
    fewer, "" leaves the intervals NaN and looks for no bound or unknown, "bounds" for no unknown. A residual that
    raises a PatchfemError or is not finite is a failed evaluation, counted and passed over. ValueError for bad bounds
    or fewer rows than values, NotConverged where every start fails.
    """
    box = space(low, high, log)
    model, n = Counted(residual, box), box.low.size
    begins = starting_points(model, None if start is None else box.unit(start), starts)
    if model.rows < n:
        raise ValueError(f"{model.rows} rows of data cannot determine {n} values")
    return answered(model, descents(model, begins, every=False), bars)


class Descent(NamedTuple):
    """Where a descent ended: point u (n,) of the unit cube, sum of squares (inf where its start failed), whether it
    settled, rows of the residual."""

    u: np.ndarray
    cost: float
    done: bool
    rows: int

    @property
    def rms(self) -> float:
        """Root mean square of the residual; NaN where the start failed."""
        return float(np.sqrt(self.cost / self.rows)) if np.isfinite(self.cost) else np.nan


def descents(
    model: Counted,
    begins,
    every: bool = True,
    kept: Callable = lambda *given: None,
    before=None,
    tell=None,
) -> list:
    """The Descent from each of some points of the unit cube, (s, n).

    every: without it an answer to round-off ends the search. kept(k) -> the Descent from point k of an earlier search,
    or None; kept(k, descent) keeps it. before: called before each descent; tell: called with 1 after it.
    """
    found = []
    for k, begin in enumerate(begins):
        known = kept(k)
        if known is None:
            if before is not None:
                before()
            known = Descent(*descend(model, begin, range(len(begin))), model.rows)
            kept(k, known)
        found.append(known)
        if tell is not None:
            tell(1)
        if not every and known.cost <= (EXACT * model.largest) ** 2 * model.rows:
            break
    return found


def answered(model: Counted, found: list, bars: str = "rows", starts=None) -> Fit:
    """The Fit of the best of some Descents; bars as in `fit`; starts: the Descents that tell whether
    others found its valley, where `found` follows the best of them."""
    u, cost, done, _ = min(found, key=lambda one: one.cost)
    agreed = sum(
        abs(other.cost - cost) <= 1e-6 * cost + 1e-20 * model.largest**2 * model.rows
        for other in found
    )
    if bars:
        u, cost = _onto_bounds(model, u, cost)
    answer = (
        nothing(u.size)
        if bars in ("", "bounds")
        else intervals(model, u, cost, descend, bars == "series")
    )
    rms = float(np.sqrt(cost / model.rows))
    alike = sum(one.cost <= VALLEY * cost for one in starts or found)
    return _frozen(
        model, u, answer, rms, agreed, Outcome.DONE if done or alike > 1 else Outcome.NOT_CONVERGED
    )


def _frozen(
    model: Counted, u, answer: FitIntervals, rms: float, agreed: int, outcome: Outcome
) -> Fit:
    sides = tuple("low" if x <= 0 else "high" if x >= 1 else "" for x in u)
    return Fit(
        frozen_array(model.space.values(u)),
        frozen_array(answer.ends),
        answer.methods,
        frozen_array(answer.open_ends, bool),
        frozen_array(answer.correlation),
        rms,
        frozen_array(answer.sensitivity),
        sides,
        frozen_array(answer.unknown),
        answer.rows,
        model.evaluations,
        model.failures,
        model.reason,
        agreed,
        outcome,
    )


def starting_points(model: Counted, own, count: int, tries: int = 0) -> list:
    """Points (n,) of the unit cube to begin at, `count` at most: the own one (n,), or None, where it works, then the
    best of some `tries`, 8 n unless given, that fill the cube. NotConverged where all of them fail."""
    n = model.space.low.size
    if count == 1 and own is not None and model(own) is not None:
        return [own]
    scored = []
    for u in spread_points(tries or 8 * n, n):
        r = model(u)
        if r is not None:
            scored.append((float(r @ r), len(scored), u))
    best = [u for _, _, u in sorted(scored, key=lambda one: one[:2])]
    if own is not None and model(own) is not None:
        best = [own, *best]
    if not best:
        raise NotConverged(
            f"the model failed at all {model.evaluations} starting points of the search: {model.reason}"
        )
    return best[: max(1, count)]


def descend(model: Counted, u, free) -> tuple:
    """Descend from u (n,) in the unit cube along the coordinates `free` alone: (u, sum of squares, whether it settled).

    SciPy's trust-region reflective method, which ends where a step changes the sum of squares by 1e-10 of it, or by
    QUICK of a quick model. The end is never worse than u; where u itself fails, the sum is inf.
    """
    u, free = np.array(u, float), list(free)
    here = model(u)
    if not free or here is None:
        return u, np.inf if here is None else float(here @ here), here is not None

    def whole(part):
        out = u.copy()
        out[free] = part
        return out

    begin = np.clip(u[free], 1e-3, 1 - 1e-3)  # the trust region begins inside its bounds
    if model(whole(begin)) is None:
        begin = np.clip(u[free], 1e-9, 1 - 1e-9)
        if model(whole(begin)) is None:
            return u, float(here @ here), False
    size = max(float(np.abs(model.penalised(whole(begin))).max()), 1e-300)
    share = QUICK if model.quick else 1e-10
    found = least_squares(
        lambda p: model.penalised(whole(p)) / size,
        begin,
        bounds=(0, 1),
        method="trf",
        jac=lambda p: model.jacobian(whole(p), free) / size,
        ftol=share,
        xtol=10 * share,
        gtol=1e-15,
        max_nfev=MOST,
    )
    end = whole(found.x)
    last = model(end)
    if last is None or last @ last > here @ here:
        return u, float(here @ here), found.status > 0
    return end, float(last @ last), found.status > 0


def _onto_bounds(model: Counted, u, cost: float) -> tuple:
    """Put values that press against a bound on it and settle the others once more, where that is no worse."""
    r = model(u)
    pull = model.jacobian(u, range(u.size)).T @ r
    near = [
        i
        for i in range(u.size)
        if (u[i] < NEAR and pull[i] > 0) or (u[i] > 1 - NEAR and pull[i] < 0)
    ]
    if not near:
        return u, cost
    on = u.copy()
    on[near] = np.round(u[near])
    on, settled, _ = descend(model, on, [i for i in range(u.size) if i not in near])
    return (on, settled) if settled <= cost * (1 + 1e-9) else (u, cost)
