"""95 % intervals of a least-squares fit, from the Jacobian or from the profile.

The profile is used if the residual is not linear.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from ..core import frozen_array
from .correlation import estimate_effective_rows
from .space import CubeResidual

# fraction of the largest singular value of the scaled Jacobian; smaller ones are undetermined directions
MIN_SINGULAR_VALUE = 1e-6
# fraction of the largest residual; a value that changes the residual by less has no effect
MIN_RESIDUAL_EFFECT = 1e-9
# squared component of an undetermined direction; a value with a smaller one is determined
MIN_DIRECTION_COMPONENT = 1e-3
# relative error of the linear growth of the sum of squares at an interval's ends
MAX_NONLINEARITY = 0.2
MIN_INTERVAL = 1e-9  # fraction of the range of a parameter; a smaller interval is round-off and treated as linear
# distance to the bound / first step of a profile, for a parameter without a linear interval
N_FIRST_STEPS = 64
# relative error of the growth of the sum of squares at the end of a profile, also for quick models
PROFILE_TOL = 1e-3
QUICK_PROFILE_TOL = 1e-2


@dataclass(frozen=True, eq=False, slots=True)
class FitIntervals:
    """95 % intervals of a fit of n values, read-only.

    - ends: ends (n, 2) of the intervals, NaN for a value that the rows do not determine.
    - methods: "linear", "profile" or "none" for each value.
    - open_ends: whether each end (n, 2) is only the bound.
    - correlation: correlation matrix (n, n), NaN for a value that the rows do not determine.
    - sensitivity: root mean square change (n,) of the residual per range of a value.
    - unknown: directions (d, n) of relative change, or of change over the range if a value is 0, that
      leave the residual as it is.
    - rows: number of independent rows, NaN without intervals.
    """

    ends: np.ndarray
    methods: tuple
    open_ends: np.ndarray
    correlation: np.ndarray
    sensitivity: np.ndarray
    unknown: np.ndarray
    rows: float


class _LeastSquares(NamedTuple):
    """Result of a fit whose intervals are computed.

    - model: residual over the unit cube.
    - u: point (n,) of the cube.
    - cost: sum of squares there.
    - growth: relative growth of the sum of squares at the end of an interval of 95 %.
    - descend: function that minimizes the residual over some coordinates.
    """

    model: CubeResidual
    u: np.ndarray
    cost: float
    growth: float
    descend: Callable


class _IntervalEnd(NamedTuple):
    """End of an interval in the unit cube, and whether it is only the bound."""

    end: float
    is_open: bool


def make_unknown_intervals(n: int) -> FitIntervals:
    """Return NaN intervals for a fit of n values whose intervals were not requested."""
    return FitIntervals(
        ends=frozen_array(np.full((n, 2), np.nan)),
        methods=("none",) * n,
        open_ends=frozen_array(np.zeros((n, 2)), bool),
        correlation=frozen_array(np.full((n, n), np.nan)),
        sensitivity=frozen_array(np.full(n, np.nan)),
        unknown=frozen_array(np.zeros((0, n))),
        rows=np.nan,
    )


def compute_intervals(
    model: CubeResidual, u, cost: float, descend: Callable, *, is_series: bool = False
) -> FitIntervals:
    """Compute the intervals of a least-squares fit.

    A value on a bound is constant in the linear intervals of the others, and has a profile of its own.

    Parameters
    ----------
    model : CubeResidual
    u : (n,) ndarray
        Least squares in the unit cube.
    cost : float
        Sum of squares there.
    descend : callable
        `least_squares.descend`, for the other values of a profile.
    is_series : bool
        Whether the rows are a series in time, so that correlated ones count as fewer.

    Returns
    -------
    FitIntervals
    """
    residual = model(u) if is_series else None
    rows = model.rows if residual is None else estimate_effective_rows(residual)
    n = u.size
    dof = max(rows - n, 1)
    cost = max(cost, (1e-15 * model.largest) ** 2 * model.rows, 1e-300)
    jacobian = model.jacobian(u, range(n))
    size = np.sqrt((jacobian**2).sum(axis=0))
    has_effect = size > MIN_RESIDUAL_EFFECT * model.largest * np.sqrt(model.rows)
    inner = [i for i in range(n) if 0 < u[i] < 1 and has_effect[i]]
    inverse, null = _invert_normal_matrix(jacobian[:, inner], size[inner])
    is_unknown = (null**2 > MIN_DIRECTION_COMPONENT).any(axis=0)
    unknown = set(np.array(inner, int)[is_unknown].tolist())
    quantile = student.ppf(0.975, dof)
    covariance = np.full((n, n), np.nan)
    covariance[np.ix_(inner, inner)] = inverse * cost / dof
    half = quantile * np.sqrt(np.diag(covariance))
    fit = _LeastSquares(model, u, cost, quantile**2 / dof, descend)
    ends = np.full((n, 2), np.nan)
    open_ends = np.zeros((n, 2), bool)
    methods = ["none"] * n
    for i in range(n):
        if not has_effect[i] or i in unknown:
            continue
        if i in inner and _is_linear(fit, i, half[i], covariance, inner):
            methods[i] = "linear"
            ends[i] = u[i] - half[i], u[i] + half[i]
            continue
        others = [k for k in range(n) if k != i and has_effect[k]]
        profiles = [_follow_profile(fit, i, sign, half[i], others) for sign in (-1.0, 1.0)]
        open_ends[i] = [profile.is_open for profile in profiles]
        if not open_ends[i].all():
            methods[i] = "profile"
            ends[i] = [profile.end for profile in profiles]
    return FitIntervals(
        ends=frozen_array(_convert_ends(model, u, ends)),
        methods=tuple(methods),
        open_ends=frozen_array(open_ends, bool),
        correlation=frozen_array(_compute_correlation(covariance, unknown)),
        sensitivity=frozen_array(size / np.sqrt(model.rows)),
        unknown=frozen_array(_list_unknown_directions(model, u, inner, null, size)),
        rows=float(rows),
    )


def _convert_ends(model: CubeResidual, u, ends) -> np.ndarray:
    """Convert ends (n, 2) of intervals about a point u of the unit cube to values."""
    values = ends.copy()
    for i in np.flatnonzero(np.isfinite(ends[:, 0])):
        for side in (0, 1):
            point = u.copy()
            point[i] = ends[i, side]
            values[i, side] = model.space.values(point)[i]
    return values


def _invert_normal_matrix(jacobian, size) -> tuple:
    """Invert J^T J over the directions that the rows determine.

    Returns the inverse (f, f), and the unit directions (d, f) that they do not determine. `size` (f,) are
    the norms of the columns.
    """
    if not size.size:
        return np.zeros((0, 0)), np.zeros((0, 0))
    _, values, directions = np.linalg.svd(jacobian / size, full_matrices=True)
    values = np.concatenate([values, np.zeros(directions.shape[0] - values.size)])
    is_known = values > MIN_SINGULAR_VALUE * values[0]
    root = directions[is_known].T / values[is_known] / size[:, None]
    return root @ root.T, directions[~is_known]


def _compute_correlation(covariance, unknown: set) -> np.ndarray:
    """Return the correlation matrix (n, n), NaN for unknown values."""
    matrix = covariance.copy()
    index = list(unknown)
    matrix[index] = np.nan
    matrix[:, index] = np.nan
    scale = np.sqrt(np.diag(matrix))
    with np.errstate(invalid="ignore", divide="ignore"):
        return matrix / np.outer(scale, scale)


def _list_unknown_directions(model: CubeResidual, u, inner: list, null, size) -> np.ndarray:
    """Return the undetermined directions (d, n) as relative changes, scaled to a maximum of 1.

    If a value at the point u of the cube is 0, they are changes over the range.
    """
    values = model.space.values(u)
    slope = model.space.slope(u)
    scale = values if (values[inner] != 0).all() else model.space.high - model.space.low
    directions = np.zeros((len(null), u.size))
    for row, direction in zip(directions, null):
        row[inner] = direction / size[inner] * slope[inner]
        row[inner] /= scale[inner]
        row /= row[np.argmax(np.abs(row))]
        row[np.abs(row) < 1e-3] = 0.0
    return directions


def _is_linear(fit: _LeastSquares, i: int, half: float, covariance, inner: list) -> bool:
    """Return whether the sum of squares grows at both ends of a linear interval as predicted.

    The other values follow their covariance (n, n) with value i.
    """
    if half < MIN_INTERVAL:
        return True
    for sign in (-1.0, 1.0):
        end = fit.u.copy()
        end[inner] += sign * half * covariance[i, inner] / covariance[i, i]
        if (end < 0).any() or (end > 1).any():
            return False
        residual = fit.model(end)
        if residual is None:
            return False
        growth = residual @ residual / fit.cost - 1
        if abs(growth / fit.growth - 1) > MAX_NONLINEARITY:
            return False
    return True


def _follow_profile(
    fit: _LeastSquares, i: int, sign: float, half: float, others: list
) -> _IntervalEnd:
    """Find the end of the interval of value i by the profile of the sum of squares.

    There the sum of squares, minimized over the other values, has grown by `fit.growth`. The root of the
    growth is nearly linear, so that a secant step inside a bracket finds it.
    """
    room = fit.u[i] if sign < 0 else 1 - fit.u[i]
    if room <= 0:
        return _IntervalEnd(fit.u[i], True)

    def evaluate(step: float, near) -> tuple:
        point = near.copy()
        point[i] = fit.u[i] + sign * step
        descent = fit.descend(fit.model, point, others)
        growth = max(descent.cost / fit.cost - 1, 0.0)
        return np.sqrt(growth / fit.growth) - 1, descent.u

    step = room / N_FIRST_STEPS
    if np.isfinite(half) and half > MIN_INTERVAL:
        step = min(half, room)
    low = 0.0
    f_low = -1.0
    high = None
    near = fit.u
    tolerance = QUICK_PROFILE_TOL if fit.model.is_quick else PROFILE_TOL
    # the step doubles until the end is bracketed; bracketing and the secant method need fewer than 40 evaluations
    for _ in range(40):
        f, point = evaluate(step, near)
        if abs(f) < tolerance:
            break
        if f < 0:
            low = step
            f_low = f
            near = point
            if step >= room:
                return _IntervalEnd(float(fit.u[i] + sign * room), True)
        else:
            high = step
            f_high = f
        if high is None:
            step = min(2 * step, room)
            continue
        fraction = -f_low / (f_high - f_low) if np.isfinite(f_high) else 0.5
        step = low + (high - low) * min(max(fraction, 0.1), 0.9)
        if high - low < 1e-6 * max(high, 1e-12):
            break
    return _IntervalEnd(float(fit.u[i] + sign * step), False)
