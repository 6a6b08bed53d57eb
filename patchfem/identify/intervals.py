"""95 % intervals of a least-squares answer: from the Jacobian, and from the profile where that is not enough."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student

from .correlation import effective_rows
from .space import Counted

# of the largest singular value of the scaled Jacobian: below it a direction is unknown
SINGULAR = 1e-6
# of the largest residual seen: a value that changes it less over its range has no effect
FLAT = 1e-9
BENT = 0.2  # relative miss of the linear growth of the sum of squares beyond which the profile is asked
SHARP = 1e-9  # of the range: intervals below it are at round-off, and linear


@dataclass(frozen=True, eq=False, slots=True)
class FitIntervals:
    """Intervals of a fit: ends (n, 2), methods, open_ends (n, 2), correlation (n, n), sensitivity (n,), unknown (d, n),
    rows.

    They mean what they mean in `Fit`.
    """

    ends: np.ndarray
    methods: tuple
    open_ends: np.ndarray
    correlation: np.ndarray
    sensitivity: np.ndarray
    unknown: np.ndarray
    rows: float


def nothing(n: int) -> FitIntervals:
    """The Answer of a fit of n values whose intervals were not asked for: NaN throughout, method "none"."""
    nan = np.full((n, n), np.nan)
    return FitIntervals(
        np.full((n, 2), np.nan),
        ("none",) * n,
        np.zeros((n, 2), bool),
        nan,
        np.full(n, np.nan),
        np.zeros((0, n)),
        np.nan,
    )


def intervals(
    model: Counted, u, cost: float, descend: Callable, ordered: bool = False
) -> FitIntervals:
    """The Answer at the least squares u (n,) of sum of squares `cost`; descend settles the other values of a profile.

    A value on a bound is held there in the linear intervals of the others and has a profile of its own. ordered: the
    rows follow one another, and those that correlate count as fewer (`correlation.effective_rows`).
    """
    here = model(u) if ordered else None
    rows = model.rows if here is None else effective_rows(here)
    n, dof = u.size, max(rows - u.size, 1)
    cost = max(cost, (1e-15 * model.largest) ** 2 * model.rows, 1e-300)
    jac = model.jacobian(u, range(n))
    size = np.sqrt((jac**2).sum(axis=0))
    flat = size <= FLAT * model.largest * np.sqrt(model.rows)
    inner = [i for i in range(n) if 0 < u[i] < 1 and not flat[i]]
    covariance, null = _covariance(jac[:, inner], size[inner])
    # a value with less than 1e-3 of an unknown direction, in squares, is still known
    lost = {inner[k] for row in null for k in np.flatnonzero(row**2 > 1e-3)}
    reach = student.ppf(0.975, dof)
    spread = np.full((n, n), np.nan)
    spread[np.ix_(inner, inner)] = covariance * cost / dof
    half = reach * np.sqrt(np.diag(spread))
    ends, open_ends, methods = np.full((n, 2), np.nan), np.zeros((n, 2), bool), ["none"] * n
    for i in range(n):
        if flat[i] or i in lost:
            continue
        linear = i in inner and _is_linear(
            model, u, cost, i, half[i], spread, reach**2 / dof, inner
        )
        methods[i] = "linear" if linear else "profile"
        if linear:
            ends[i] = u[i] - half[i], u[i] + half[i]
        else:
            others = [k for k in range(n) if k != i and not flat[k]]
            for side, sign in ((0, -1.0), (1, 1.0)):
                ends[i, side], open_ends[i, side] = _profile(
                    model, u, cost, i, sign, half[i], reach**2 / dof, others, descend
                )
            if open_ends[i].all():
                ends[i], methods[i] = np.nan, "none"
    for i in np.flatnonzero(np.isfinite(ends[:, 0])):
        for side in (0, 1):
            probe = u.copy()
            probe[i] = ends[i, side]
            ends[i, side] = model.space.values(probe)[i]
    return FitIntervals(
        ends,
        tuple(methods),
        open_ends,
        _correlation(spread, lost),
        size / np.sqrt(model.rows),
        _directions(model, u, n, inner, null, size),
        float(rows),
    )


def _covariance(jac, size) -> tuple:
    """Inverse (f, f) of J^T J over the directions that the rows see, and the unit directions (d, f) that they do not
    see."""
    if not size.size:
        return np.zeros((0, 0)), np.zeros((0, 0))
    _, s, vt = np.linalg.svd(jac / size, full_matrices=True)
    s = np.concatenate([s, np.zeros(vt.shape[0] - s.size)])
    seen = s > SINGULAR * s[0]
    half = vt[seen].T / s[seen] / size[:, None]
    return half @ half.T, vt[~seen]


def _correlation(spread, lost) -> np.ndarray:
    out = spread.copy()
    gone = list(lost)
    out[gone], out[:, gone] = np.nan, np.nan
    scale = np.sqrt(np.diag(out))
    with np.errstate(invalid="ignore", divide="ignore"):
        return out / np.outer(scale, scale)


def _directions(model: Counted, u, n: int, inner, null, size) -> np.ndarray:
    """Unknown directions (d, n) as relative changes of the values, the largest 1."""
    values, slope = model.space.values(u), model.space.slope(u)
    out = np.zeros((len(null), n))
    for row, one in zip(out, null):
        row[inner] = one / size[inner] * slope[inner]
        scale = values if (values[inner] != 0).all() else model.space.high - model.space.low
        row[inner] /= scale[inner]
        row /= row[np.argmax(np.abs(row))]
        row[np.abs(row) < 1e-3] = 0.0
    return out


def _is_linear(model, u, cost, i, half, spread, growth, inner) -> bool:
    """Whether the sum of squares grows at both ends of an interval as the linear answer says, the other values
    following it."""
    if half < SHARP:
        return True
    for sign in (-1.0, 1.0):
        probe = u.copy()
        probe[inner] += sign * half * spread[i, inner] / spread[i, i]
        if (probe < 0).any() or (probe > 1).any():
            return False
        r = model(probe)
        if r is None or abs((r @ r / cost - 1) / growth - 1) > BENT:
            return False
    return True


def _profile(model, u, cost, i, sign, half, growth, others, descend) -> tuple:
    """End of an interval in the cube by the profile of the sum of squares, and whether it is only the bound.

    There the sum of squares, least over the other values, has grown by the share `growth`. The root of the growth is
    nearly linear, so a secant inside a bracket finds it.
    """
    room = u[i] if sign < 0 else 1 - u[i]
    if room <= 0:
        return u[i], True

    def miss(step, near):
        probe = near.copy()
        probe[i] = u[i] + sign * step
        probe, least, _ = descend(model, probe, others)
        return np.sqrt(max(least / cost - 1, 0.0) / growth) - 1, probe

    step = min(half, room) if np.isfinite(half) and half > SHARP else room / 64
    low, f_low, high, near = 0.0, -1.0, None, u
    enough = 1e-2 if model.quick else 1e-3
    for _ in range(40):  # doublings to the bound, then the secant, which `enough` ends long before
        f, probe = miss(step, near)
        if abs(f) < enough:
            break
        if f < 0:
            low, f_low, near = step, f, probe
            if step >= room:
                return float(u[i] + sign * room), True
        else:
            high, f_high = step, f
        step = (
            min(2 * step, room)
            if high is None
            else low
            + (high - low)
            * min(max(-f_low / (f_high - f_low) if np.isfinite(f_high) else 0.5, 0.1), 0.9)
        )
        if high is not None and high - low < 1e-6 * max(high, 1e-12):
            break
    return float(u[i] + sign * step), False
