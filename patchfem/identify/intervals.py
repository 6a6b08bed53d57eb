"""95 % confidence intervals of a least-squares fit.

An end of an interval is where the sum of squares, minimized over the other parameters, has grown by t^2 times the variance
of a row. Steps with the linearized residual find it (Venzon and Moolgavkar, Applied Statistics 37, 87, 1988); the first of
them leads to the end of the linear interval, which counts if the sum of squares grows nearly as expected on this way.
"""

from copy import copy
from dataclasses import dataclass
from enum import StrEnum
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import brentq, lsq_linear
from scipy.special import stdtrit

from .descent import LinearModel, UnitCubeResidual

# Smallest singular value of a determined direction, relative to the largest one of the scaled Jacobian.
MIN_SINGULAR_VALUE = 1e-6
PROFILE_END_TOL = 1e-3  # tolerance of the end of a profile, relative to its half-width


class IntervalKind(StrEnum):
    """Assumption on the errors of the data from which confidence intervals are computed.

    - ROWS: the rows are independent.
    - SERIES: the rows are a time series, in which correlated neighbours count as fewer rows.
    - KNOWN: each row is divided by its standard deviation, which is known.
    """

    ROWS = "rows"
    SERIES = "series"
    KNOWN = "known"


@dataclass(frozen=True, eq=False, slots=True)
class FitIntervals:
    """95 % confidence intervals of fitted parameters, and the parameters left undetermined.

    - ends: ends (n, 2) of the intervals; NaN for an undetermined parameter.
    - methods: "linear", "profile" or "none" for each parameter.
    - open_ends: whether each end (n, 2) is the bound of the parameter.
    - correlation: correlation matrix (n, n); NaN for an undetermined parameter.
    - sensitivity: root mean square change (n,) of the residual per range of each parameter.
    - shifts: change (n, r) of each parameter, to first order, per change of each row of the residual. For a parameter on a
      bound it is that of the minimum beyond the bound; 0 for a parameter without effect.
    - unknown: undetermined directions (d, n) in parameter space, as relative changes (relative to the
      range if a value is 0).
    - rows: number of independent rows of the residual; NaN without intervals.
    """

    ends: np.ndarray
    methods: tuple[str, ...]
    open_ends: np.ndarray
    correlation: np.ndarray
    sensitivity: np.ndarray
    shifts: np.ndarray
    unknown: np.ndarray
    rows: float

    @property
    def effects(self) -> np.ndarray:
        """Change (r, n) of each row of the residual, in standard deviations, per standard deviation of each parameter."""
        # The covariance of the parameters is shifts shifts^T times the variance of the rows.
        scale = np.linalg.norm(self.shifts, axis=1, keepdims=True)
        return np.linalg.pinv(self.shifts / np.maximum(scale, 1e-300))


class _End(NamedTuple):
    """End of an interval: distance from the minimum in the unit cube, infinite at a bound; whether it is the linear one."""

    distance: float
    is_linear: bool


def _find_end(start: LinearModel, k: int, sign: float, growth: float, tolerance: float) -> _End:
    """Find one end of the confidence interval of a parameter.

    Parameters
    ----------
    start : LinearModel
        Residual near the minimum, whose free coordinates are those with an effect.
    k : int
        Coordinate.
    sign : float
        Side, -1 or 1.
    growth : float
        Growth of the sum of squares at the end.
    tolerance : float
        Largest relative deviation of the growth at the first step from that of a linear model, at which it is the end.
    """
    minimum = start.u
    end = minimum[k] if sign < 0 else 1 - minimum[k]
    if not end:
        return _End(np.inf, False)
    linear = copy(start)
    cost = start.cost
    trust = 1.0
    # Steps to the end of a profile; about four suffice
    for count in range(60):
        point, predicted = _predict_end(linear, k, sign, cost + growth, trust)
        step = sign * (point[k] - linear.u[k])
        distance = sign * (point[k] - minimum[k])
        is_at_bound = point[k] in (0.0, 1.0)

        # a bound ends the search if the sum of squares is smaller there than at the end of an interval
        if (
            abs(step) <= PROFILE_END_TOL * distance
            and count
            and np.abs(point - linear.u).max() < trust
        ):
            is_open = is_at_bound and linear.cost < cost + growth * (1 - PROFILE_END_TOL)
            return _End(np.inf if is_open else distance, False)
        residual = linear.model(point)
        deviation = np.inf
        if residual is not None:
            deviation = abs(residual @ residual - predicted) / growth
        is_inside = ((point > 0) & (point < 1)).all()
        if not count and is_inside and deviation <= tolerance:
            return _End(distance, True)
        # Largest deviation of the growth from the predicted one, relative to that at the end, of a
        # step that is taken
        if deviation > 0.5:
            trust = np.abs(point - linear.u).max() / 2
            if not linear.is_fresh:
                linear.differentiate()
            continue
        linear.move(point, residual)
        trust *= 2
    return _End(sign * (linear.u[k] - minimum[k]), False)


def _predict_end(
    linear: LinearModel, k: int, sign: float, target: float, trust: float
) -> tuple[np.ndarray, float]:
    """Return the point (n,) of a linear model at which its profile of a coordinate has a given value, and this value.

    The profile is the sum of squares, minimized over the other coordinates. Where it stays below the value, the point is
    the last one in the direction.

    Parameters
    ----------
    linear : LinearModel
    k : int
        Coordinate.
    sign : float
        Direction, -1 or 1.
    target : float
        Value of the profile.
    trust : float
        Largest change of a coordinate.
    """
    factor = linear.compress()
    place = linear.free.index(k)
    bounds = linear.limit(trust)
    others = np.delete(factor[:, :-1], place, axis=1)
    other_bounds = np.delete(bounds, place, axis=1)
    step = np.zeros(len(linear.free))

    def profile(change: float) -> float:
        """Return the excess of the profile over its value at the end, after a change of the coordinate."""
        step[place] = change
        column = factor[:, -1] + factor[:, place] * change
        if not others.size:
            return column @ column - target
        found = lsq_linear(others, -column, other_bounds, method="bvls")
        step[np.arange(step.size) != place] = found.x
        return 2 * found.cost - target

    # the profile of a linear model is convex; its smallest value is that over all coordinates
    lowest = lsq_linear(factor[:, :-1], -factor[:, -1], bounds, method="bvls").x[place]
    last = bounds[1, place] if sign > 0 else bounds[0, place]
    change = last
    if profile(lowest) >= 0:
        change = lowest
    elif profile(last) > 0:
        change = brentq(profile, lowest, last, rtol=1e-9)
    excess = profile(change)
    return linear.propose(step), target + excess


def compute_intervals(
    model: UnitCubeResidual, u: np.ndarray, kind: str = IntervalKind.ROWS
) -> FitIntervals:
    """Compute the 95 % confidence intervals of the parameters of a least-squares fit.

    In the linear intervals, a parameter on a bound is fixed; its own interval follows from its profile.

    Parameters
    ----------
    model : UnitCubeResidual
        Residual as a function on the unit cube.
    u : (n,) ndarray
        Minimum in the unit cube.
    kind : str
        Value of `IntervalKind`.

    Returns
    -------
    FitIntervals
    """
    n = u.size
    linear = LinearModel(model, u, range(n))
    rows = estimate_effective_rows(linear.residual) if kind == IntervalKind.SERIES else model.rows
    dof = max(rows - n, 1)
    # An exact fit has the cost of its round-off, so that variances are not zero.
    variance = max(linear.cost, model.floor) / dof
    if kind == IntervalKind.KNOWN:
        dof = np.inf
        variance = 1.0
    growth = stdtrit(dof, 0.975) ** 2 * variance

    # Shifts (J^T J)^-1 J^T of the parameters that have an effect and lie on no bound. A parameter is unknown if a direction
    # without effect on the residual contains it.
    jacobian = np.nan_to_num(linear.jacobian)
    norms = np.linalg.norm(jacobian, axis=0)
    # Smallest change of the residual by a parameter with an effect, relative to the largest
    # residual.
    has_effect = norms > 1e-9 * model.largest * np.sqrt(model.rows)
    on_bound = (u <= 0) | (u >= 1)
    free = np.flatnonzero(~on_bound & has_effect)
    scaled = jacobian[:, free] / norms[free]
    null_vectors = np.zeros((0, free.size))
    shifts = np.zeros((n, model.rows))
    if free.size:
        null_vectors = null_space(scaled, rcond=MIN_SINGULAR_VALUE).T
        shifts[free] = np.linalg.pinv(scaled, rcond=MIN_SINGULAR_VALUE) / norms[free, None]
    covariance = np.full((n, n), np.nan)
    covariance[np.ix_(free, free)] = shifts[free] @ shifts[free].T * variance
    is_unknown = np.zeros(n, bool)
    # Largest squared component of a determined parameter in an undetermined direction.
    is_unknown[free] = (null_vectors**2 > 1e-3).any(axis=0)
    covariance[is_unknown] = covariance[:, is_unknown] = np.nan
    deviation = np.sqrt(np.diag(covariance))

    # A parameter on a bound is shifted as if it were free: e / |e|^2 with the part e of its column that the free parameters
    # do not compensate.
    for k in np.flatnonzero(on_bound & has_effect):
        effect = jacobian[:, k] - jacobian[:, free] @ (shifts[free] @ jacobian[:, k])
        size = np.linalg.norm(effect)
        if size > MIN_SINGULAR_VALUE * norms[k]:
            shifts[k] = effect / size**2

    # Known errors are stated by their ends, which only the profile reproduces. Data that exclude neither bound do not
    # determine a parameter.
    ends = np.full((n, 2), np.nan)
    open_ends = np.zeros((n, 2), bool)
    methods = np.full(n, "none", object)
    linear.free = np.flatnonzero(has_effect).tolist()
    linear.jacobian = linear.jacobian[:, has_effect]
    for k in np.flatnonzero(has_effect & ~is_unknown):
        half_width = np.sqrt(growth / variance) * deviation[k]
        found = [_End(half_width, True)] * 2
        # Smallest half-width of an interval above round-off, relative to the range of the
        # parameter.
        if not half_width < 1e-9:
            is_exact = on_bound[k] or kind == IntervalKind.KNOWN
            # Largest relative deviation of the growth of the sum of squares from that of a linear model at the end of an
            # interval, whose half-width then deviates by half of it; beyond it, the profile is followed.
            tolerance = 0.0 if is_exact else 0.05
            found = [_find_end(linear, k, sign, growth, tolerance) for sign in (-1.0, 1.0)]
        distances = np.array([one.distance for one in found])
        open_ends[k] = ~np.isfinite(distances)
        if open_ends[k].all():
            continue
        methods[k] = "linear" if all(one.is_linear for one in found) else "profile"
        for side, distance in enumerate(np.minimum(distances, [u[k], 1 - u[k]])):
            point = u.copy()
            point[k] += (-distance, distance)[side]
            ends[k, side] = model.space.to_values(point)[k]

    # Correlations cov_ij/sqrt(cov_ii cov_jj), without the parameters that the data do not determine
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(deviation, deviation)

    # Undetermined directions, relative to the values or, if one of these is 0, to the ranges, with a largest component of 1
    values = model.space.to_values(u)
    slopes = model.space.derivatives(u)
    scale = values if values[free].all() else model.space.high - model.space.low
    unknown = np.zeros((len(null_vectors), n))
    unknown[:, free] = null_vectors / norms[free] * slopes[free] / scale[free]
    for row in unknown:
        row /= row[np.argmax(np.abs(row))]
        row[np.abs(row) < 1e-3] = 0.0
    return FitIntervals(
        ends=ends,
        methods=tuple(methods),
        open_ends=open_ends,
        correlation=correlation,
        sensitivity=norms / np.sqrt(model.rows),
        shifts=shifts * slopes[:, None],
        unknown=unknown,
        rows=rows,
    )


def estimate_effective_rows(residual) -> float:
    """Estimate the effective number of independent rows of a residual.

    The number is n/tau, with tau = 1 + 2 sum rho_k over the lags k up to the first zero of the correlation
    (Geyer, Statistical Science 7, 473, 1992). If m cycles have the same error, so that the correlation rho at
    a later lag is large, they count as m/(1 + (m - 1) rho) cycles.

    Parameters
    ----------
    residual : (n,) array_like
        Rows in the order of measurement.

    Returns
    -------
    float
        Number between 1 and n; n for few rows, or if neighbouring rows are not correlated.
    """
    r = np.asarray(residual, float)
    n = r.size
    r = r - r.mean()
    # Smallest number of rows for a significant correlation
    if n < 20 or not np.ptp(r) > 0:
        return float(n)

    # autocorrelation with all lags divided by n (biased estimate), which limits their sum
    spectrum = np.fft.rfft(r, 2 * n)
    rho = np.fft.irfft(spectrum * spectrum.conj())[:n]
    rho /= rho[0]
    # Largest correlation that is attributed to chance, in standard deviations 1/sqrt(rows) of
    # independent rows.
    if rho[1] <= 2.0 / np.sqrt(n):
        return float(n)
    # a lag without correlation exists, because the sum over all lags is -1/2
    first_lag = int(np.flatnonzero(rho[1:] <= 0)[0]) + 1
    count = n / (1 + 2 * rho[1:first_lag].sum())

    # cycles with the same error, from the unbiased estimate: there are n - lag products at each lag
    lags = np.arange(first_lag + 1, n // 2 + 1)
    if lags.size > 2:
        correlation = rho[lags] / (1 - lags / n)
        best = int(np.argmax(correlation))
        # Smallest correlation between cycles at which they count as repetitions of the same error.
        if correlation[best] >= 0.5:
            count /= 1 + (n / lags[best] - 1) * min(correlation[best], 1.0)
    return float(np.clip(count, 1.0, n))
