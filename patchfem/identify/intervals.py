"""95 % confidence intervals of a least-squares fit, from the Jacobian or from the profile.

The profile of the sum of squares is used if the residual is not linear over the interval.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.stats import t as student

from ..core import frozen_array
from .correlation import estimate_effective_rows
from .space import UnitCubeResidual

# Smallest singular value of a determined direction, relative to the largest one of the scaled Jacobian.
MIN_SINGULAR_VALUE = 1e-6
# Smallest change of the residual by a parameter with an effect, relative to the largest residual.
MIN_RESIDUAL_EFFECT = 1e-9
# Largest squared component of a determined parameter in an undetermined direction.
MIN_DIRECTION_COMPONENT = 1e-3
# Largest relative deviation of the sum of squares from a linear model at the ends of an interval; beyond it, the
# profile is used.
MAX_NONLINEARITY = 0.2
# Smallest half-width of an interval above round-off, relative to the range of the parameter.
MIN_INTERVAL = 1e-9
# Ratio of the distance to the bound to the first step of a profile, for a parameter without a linear interval.
N_FIRST_STEPS = 64
# Tolerance of the end of an interval, relative in the square root of the growth of the sum of squares.
PROFILE_TOL = 1e-3
QUICK_PROFILE_TOL = 1e-2  # the same for a residual that is expensive to evaluate


@dataclass(frozen=True, eq=False, slots=True)
class FitIntervals:
    """95 % confidence intervals of fitted parameters, and the parameters left undetermined.

    - ends: ends (n, 2) of the intervals; NaN for an undetermined parameter.
    - methods: "linear", "profile" or "none" for each parameter.
    - open_ends: whether each end (n, 2) is the bound of the parameter.
    - correlation: correlation matrix (n, n); NaN for an undetermined parameter.
    - sensitivity: root mean square change (n,) of the residual per range of each parameter.
    - unknown: undetermined directions (d, n) in parameter space, as relative changes (relative to the
      range if a value is 0).
    - rows: number of independent rows of the residual; NaN without intervals.
    """

    ends: np.ndarray
    methods: tuple
    open_ends: np.ndarray
    correlation: np.ndarray
    sensitivity: np.ndarray
    unknown: np.ndarray
    rows: float


class _FittedPoint(NamedTuple):
    """Minimum of a least-squares fit for which confidence intervals are computed.

    - model: residual as a function on the unit cube.
    - u: minimum (n,) in the unit cube.
    - cost: sum of squares at the minimum.
    - growth: relative growth of the sum of squares at the ends of a 95 % interval.
    - descend: function that minimizes the residual over selected coordinates.
    """

    model: UnitCubeResidual
    u: np.ndarray
    cost: float
    growth: float
    descend: Callable


class _IntervalEnd(NamedTuple):
    """One end of the confidence interval of a fitted parameter.

    - end: coordinate in the unit cube.
    - is_open: whether the end is the bound of the parameter.
    """

    end: float
    is_open: bool


def make_unknown_intervals(n: int) -> FitIntervals:
    """Return intervals of NaN, for a fit without confidence intervals."""
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
    model: UnitCubeResidual, u, cost: float, descend: Callable, *, is_series: bool = False
) -> FitIntervals:
    """Compute the 95 % confidence intervals of the parameters of a least-squares fit.

    In the linear intervals, a parameter on a bound is fixed; its own interval follows from its profile.

    Parameters
    ----------
    model : UnitCubeResidual
    u : (n,) ndarray
        Minimum in the unit cube.
    cost : float
        Sum of squares at the minimum.
    descend : callable
        Function that minimizes over the other parameters of a profile (`least_squares.descend`).
    is_series : bool
        Whether the rows are a time series, in which correlated rows count as fewer.

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
    column_norm = np.sqrt((jacobian**2).sum(axis=0))
    has_effect = column_norm > MIN_RESIDUAL_EFFECT * model.largest * np.sqrt(model.rows)
    free_values = [i for i in range(n) if 0 < u[i] < 1 and has_effect[i]]
    inverse, null_vectors = _invert_normal_matrix(
        jacobian[:, free_values], column_norm[free_values]
    )
    is_unknown = (null_vectors**2 > MIN_DIRECTION_COMPONENT).any(axis=0)
    unknown = set(np.array(free_values, int)[is_unknown].tolist())
    quantile = student.ppf(0.975, dof)
    covariance = np.full((n, n), np.nan)
    covariance[np.ix_(free_values, free_values)] = inverse * cost / dof
    half_width = quantile * np.sqrt(np.diag(covariance))
    fit = _FittedPoint(model, u, cost, quantile**2 / dof, descend)
    ends = np.full((n, 2), np.nan)
    open_ends = np.zeros((n, 2), bool)
    methods = ["none"] * n
    for i in range(n):
        if not has_effect[i] or i in unknown:
            continue
        if i in free_values and _is_linear(fit, i, half_width[i], covariance, free_values):
            methods[i] = "linear"
            ends[i] = u[i] - half_width[i], u[i] + half_width[i]
            continue
        others = [k for k in range(n) if k != i and has_effect[k]]
        profiles = [_find_profile_end(fit, i, sign, half_width[i], others) for sign in (-1.0, 1.0)]
        open_ends[i] = [profile.is_open for profile in profiles]
        if not open_ends[i].all():
            methods[i] = "profile"
            ends[i] = [profile.end for profile in profiles]
    return FitIntervals(
        ends=frozen_array(_convert_ends(model, u, ends)),
        methods=tuple(methods),
        open_ends=frozen_array(open_ends, bool),
        correlation=frozen_array(_compute_correlation(covariance, unknown)),
        sensitivity=frozen_array(column_norm / np.sqrt(model.rows)),
        unknown=frozen_array(
            _list_unknown_directions(model, u, free_values, null_vectors, column_norm)
        ),
        rows=float(rows),
    )


def _convert_ends(model: UnitCubeResidual, u, ends) -> np.ndarray:
    """Return the ends (n, 2) of intervals in the unit cube as parameter values.

    The other coordinates are those of the point u (n,).
    """
    values = ends.copy()
    for i in np.flatnonzero(np.isfinite(ends[:, 0])):
        for side in (0, 1):
            point = u.copy()
            point[i] = ends[i, side]
            values[i, side] = model.space.to_values(point)[i]
    return values


def _invert_normal_matrix(jacobian, column_norm) -> tuple:
    """Invert the normal matrix J^T J in the subspace that the data determine.

    Returns the pseudo-inverse (f, f), and the unit vectors (d, f) of its null space. `column_norm`
    (f,) are the norms of the columns of J.
    """
    if not column_norm.size:
        return np.zeros((0, 0)), np.zeros((0, 0))
    _, values, directions = np.linalg.svd(jacobian / column_norm, full_matrices=True)
    values = np.concatenate([values, np.zeros(directions.shape[0] - values.size)])
    is_known = values > MIN_SINGULAR_VALUE * values[0]
    inverse_root = directions[is_known].T / values[is_known] / column_norm[:, None]
    return inverse_root @ inverse_root.T, directions[~is_known]


def _compute_correlation(covariance, unknown: set) -> np.ndarray:
    """Return the correlation matrix (n, n) of fitted parameters; NaN for undetermined ones."""
    matrix = covariance.copy()
    index = list(unknown)
    matrix[index] = np.nan
    matrix[:, index] = np.nan
    scale = np.sqrt(np.diag(matrix))
    with np.errstate(invalid="ignore", divide="ignore"):
        return matrix / np.outer(scale, scale)


def _list_unknown_directions(
    model: UnitCubeResidual, u, free_values: list, null_vectors, column_norm
) -> np.ndarray:
    """Return the directions in parameter space that the residual does not determine.

    The directions (d, n) are relative changes with a maximum of 1. If a value at the point u is 0, they are
    changes relative to the range.
    """
    values = model.space.to_values(u)
    slope = model.space.derivatives(u)
    scale = values if (values[free_values] != 0).all() else model.space.high - model.space.low
    directions = np.zeros((len(null_vectors), u.size))
    for row, direction in zip(directions, null_vectors):
        row[free_values] = direction / column_norm[free_values] * slope[free_values]
        row[free_values] /= scale[free_values]
        row /= row[np.argmax(np.abs(row))]
        row[np.abs(row) < 1e-3] = 0.0
    return directions


def _is_linear(fit: _FittedPoint, i: int, half_width: float, covariance, free_values: list) -> bool:
    """Return whether the sum of squares at both ends of an interval agrees with a linear model.

    The interval is that of parameter i; the other parameters change according to the covariance (n, n).
    """
    if half_width < MIN_INTERVAL:
        return True
    for sign in (-1.0, 1.0):
        end = fit.u.copy()
        end[free_values] += sign * half_width * covariance[i, free_values] / covariance[i, i]
        if (end < 0).any() or (end > 1).any():
            return False
        residual = fit.model(end)
        if residual is None:
            return False
        growth = residual @ residual / fit.cost - 1
        if abs(growth / fit.growth - 1) > MAX_NONLINEARITY:
            return False
    return True


def _find_profile_end(
    fit: _FittedPoint, i: int, sign: float, half_width: float, others: list
) -> _IntervalEnd:
    """Find one end of a confidence interval from the profile of the sum of squares.

    At the end of the interval of parameter i on the side `sign`, the sum of squares, minimized over the other
    parameters, has grown by `fit.growth`. The square root of the growth is nearly linear, so that a bracketed
    secant method is used.
    """
    max_step = fit.u[i] if sign < 0 else 1 - fit.u[i]
    if max_step <= 0:
        return _IntervalEnd(fit.u[i], True)

    def evaluate(step: float, nearby_point) -> tuple:
        """Return the root of the relative growth minus 1 at a step of parameter i, and the minimum there."""
        point = nearby_point.copy()
        point[i] = fit.u[i] + sign * step
        descent = fit.descend(fit.model, point, others)
        growth = max(descent.cost / fit.cost - 1, 0.0)
        return np.sqrt(growth / fit.growth) - 1, descent.u

    step = max_step / N_FIRST_STEPS
    if np.isfinite(half_width) and half_width > MIN_INTERVAL:
        step = min(half_width, max_step)
    low = 0.0
    excess_low = -1.0
    high = None
    nearby_point = fit.u
    tolerance = QUICK_PROFILE_TOL if fit.model.is_expensive else PROFILE_TOL
    # the step is doubled until the end is bracketed; 40 evaluations are more than sufficient
    for _ in range(40):
        excess, point = evaluate(step, nearby_point)
        if abs(excess) < tolerance:
            break
        if excess < 0:
            low = step
            excess_low = excess
            nearby_point = point
            if step >= max_step:
                return _IntervalEnd(float(fit.u[i] + sign * max_step), True)
        else:
            high = step
            excess_high = excess
        if high is None:
            step = min(2 * step, max_step)
            continue
        fraction = -excess_low / (excess_high - excess_low) if np.isfinite(excess_high) else 0.5
        step = low + (high - low) * min(max(fraction, 0.1), 0.9)
        if high - low < 1e-6 * max(high, 1e-12):
            break
    return _IntervalEnd(float(fit.u[i] + sign * step), False)
