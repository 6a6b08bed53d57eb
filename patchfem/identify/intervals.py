"""95 % confidence intervals of a least-squares fit, from the Jacobian or from the profile.

The profile of the sum of squares is used if the residual is not linear over the interval.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space
from scipy.optimize import brentq
from scipy.special import stdtrit

from .correlation import estimate_effective_rows
from .descent import descend
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
MIN_INTERVAL_HALF_WIDTH = 1e-9
# Ratio of the distance to the bound to the first step of a profile, for a parameter without a linear interval.
N_FIRST_STEPS_TO_BOUND = 64
PROFILE_END_TOL = 1e-3  # tolerance of the end of a profile interval, relative to its half-width
# Growth at a point without a residual, relative to that at the end of the interval
MAX_SQUARES_GROWTH_RATIO = 1e6


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


class _Minimum(NamedTuple):
    """Minimum of a least-squares fit for which confidence intervals are computed.

    - model: residual as a function on the unit cube.
    - u: minimum (n,) in the unit cube.
    - cost: sum of squares at the minimum.
    - growth: growth of the sum of squares at the ends of a 95 % interval.
    """

    model: UnitCubeResidual
    u: np.ndarray
    cost: float
    growth: float

    def is_linear(self, direction) -> bool:
        """Return whether the sum of squares at u - direction and u + direction is that of a linear model.

        `direction` (n,) is a step in the unit cube to the end of a linear interval.
        """
        for end in (self.u - direction, self.u + direction):
            if (end < 0).any() or (end > 1).any():
                return False
            growth = self.model.sum_of_squares(end) - self.cost
            if not abs(growth / self.growth - 1) <= MAX_NONLINEARITY:
                return False
        return True

    def find_profile_end(self, k: int, sign: float, step: float, others: Sequence[int]) -> float:
        """Find one end of the confidence interval of parameter k.

        There the sum of squares, minimized over the `others`, has grown by `growth`. The root of the growth is nearly
        linear. Returns infinity if the interval reaches the bound.

        Parameters
        ----------
        k : int
            Number of the parameter.
        sign : float
            Side, -1 or 1.
        step : float
            First step in the unit cube.
        others : sequence of int
            Parameters that have an effect.
        """
        nearby = self.u
        max_step = self.u[k] if sign < 0 else 1 - self.u[k]

        # A value is kept, because the descent from another point may end in another minimum, so that the ends of the bracket
        # would have equal signs.
        @cache
        def compute_excess(step: float) -> float:
            """Return the root of the relative growth minus 1 at a step of parameter k."""
            nonlocal nearby
            point = nearby.copy()
            point[k] = self.u[k] + sign * step
            descent = descend(self.model, point, others)
            if descent.cost < np.inf:
                nearby = descent.u
            growth = max(descent.cost - self.cost, 0.0) / self.growth
            return np.sqrt(min(growth, MAX_SQUARES_GROWTH_RATIO)) - 1

        # the step is doubled until the end is bracketed
        low = 0.0
        high = min(step, max_step)
        while not max_step or compute_excess(high) < 0:
            if high >= max_step:
                return np.inf
            low = high
            high = min(2 * high, max_step)
        if not low:
            nearby = self.u
        return brentq(compute_excess, low, high, xtol=PROFILE_END_TOL * (low or high / 4))


def compute_intervals(
    model: UnitCubeResidual, u: np.ndarray, cost: float, kind: str
) -> FitIntervals:
    """Compute the 95 % confidence intervals of the parameters of a least-squares fit.

    In the linear intervals, a parameter on a bound is fixed; its own interval follows from its profile.

    Parameters
    ----------
    model : UnitCubeResidual
        Residual as a function on the unit cube.
    u : (n,) ndarray
        Minimum in the unit cube.
    cost : float
        Sum of squares at the minimum.
    kind : str
        Value of `IntervalKind`.

    Returns
    -------
    FitIntervals
    """
    n = u.size
    rows = estimate_effective_rows(model(u)) if kind == IntervalKind.SERIES else model.rows
    dof = max(rows - n, 1)
    # An exact fit has the cost of its round-off, so that variances are not zero.
    cost = max(cost, (1e-15 * model.largest) ** 2 * model.rows, 1e-300)
    variance = cost / dof
    if kind == IntervalKind.KNOWN:
        dof = np.inf
        variance = 1.0
    quantile = stdtrit(dof, 0.975)
    minimum = _Minimum(model, u, cost, quantile**2 * variance)

    # Covariance (J^T J)^-1 times the variance of a row, of the parameters that have an effect and lie on no bound. A
    # parameter is unknown if a direction without effect on the residual contains it.
    jacobian = model.jacobian(u, range(n))
    norms = np.linalg.norm(jacobian, axis=0)
    has_effect = norms > MIN_RESIDUAL_EFFECT * model.largest * np.sqrt(model.rows)
    free = np.flatnonzero((u > 0) & (u < 1) & has_effect)
    inverse, null_vectors = _invert_normal_matrix(jacobian[:, free], norms[free])
    covariance = np.full((n, n), np.nan)
    covariance[np.ix_(free, free)] = inverse * variance
    is_unknown = np.zeros(n, bool)
    is_unknown[free] = (null_vectors**2 > MIN_DIRECTION_COMPONENT).any(axis=0)

    # Shift (J^T J)^-1 J^T of the parameters by a change of each row, from the unit cube to their units
    shifts = np.zeros((n, model.rows))
    shifts[free] = inverse @ jacobian[:, free].T

    # A parameter on a bound is shifted as if it were free: e / |e|^2 with the part e of its column that the free parameters
    # do not compensate.
    for k in np.flatnonzero(((u <= 0) | (u >= 1)) & has_effect):
        effect = jacobian[:, k] - jacobian[:, free] @ (shifts[free] @ jacobian[:, k])
        size = np.linalg.norm(effect)
        if size > MIN_SINGULAR_VALUE * norms[k]:
            shifts[k] = effect / size**2
    shifts *= model.space.derivatives(u)[:, None]

    # Linear interval u_k +- t sqrt(cov_kk). To its end the other free parameters change by the multiple cov_ik/cov_kk of
    # u_k; if the sum of squares does not grow as expected on this line, or if u_k is on a bound, its profile is followed.
    half_width = quantile * np.sqrt(np.diag(covariance))
    offsets = np.full((2, n), np.nan)
    open_ends = np.zeros((n, 2), bool)
    methods = np.full(n, "none", object)
    for k in np.flatnonzero(has_effect & ~is_unknown):
        steps = np.full(2, half_width[k])
        methods[k] = "linear"
        direction = np.zeros(n)
        if k in free:
            direction[free] = half_width[k] * covariance[k, free] / covariance[k, k]
        # known errors are stated by their ends, which only the profile reproduces
        if k not in free or (
            half_width[k] >= MIN_INTERVAL_HALF_WIDTH
            and (kind == IntervalKind.KNOWN or not minimum.is_linear(direction))
        ):
            methods[k] = "profile"
            others = [other for other in np.flatnonzero(has_effect) if other != k]
            bounds = np.array([u[k], 1 - u[k]])
            first = half_width[k] if half_width[k] > MIN_INTERVAL_HALF_WIDTH else 0.0
            for side, sign in enumerate((-1.0, 1.0)):
                step = first or bounds[side] / N_FIRST_STEPS_TO_BOUND
                steps[side] = minimum.find_profile_end(k, sign, step, others)
            open_ends[k] = ~np.isfinite(steps)
            steps = np.minimum(steps, bounds)

        # data that exclude neither bound do not determine the parameter
        if open_ends[k].all():
            methods[k] = "none"
            continue
        offsets[:, k] = steps
    ends = [model.space.to_values(u - offsets[0]), model.space.to_values(u + offsets[1])]

    # Correlations cov_ij/sqrt(cov_ii cov_jj), without the parameters that the data do not determine
    covariance[is_unknown] = np.nan
    covariance[:, is_unknown] = np.nan
    scale = np.sqrt(np.diag(covariance))
    with np.errstate(invalid="ignore", divide="ignore"):
        correlation = covariance / np.outer(scale, scale)
    return FitIntervals(
        ends=np.transpose(ends),
        methods=tuple(methods),
        open_ends=open_ends,
        correlation=correlation,
        sensitivity=norms / np.sqrt(model.rows),
        shifts=shifts,
        unknown=_list_unknown_directions(model, u, free, null_vectors / norms[free]),
        rows=rows,
    )


def _invert_normal_matrix(jacobian, norms) -> tuple[np.ndarray, np.ndarray]:
    """Invert the normal matrix J^T J in the subspace that the data determine.

    Returns the pseudo-inverse (f, f), and the unit vectors (d, f) of its null space. `norms`
    (f,) are the norms of the columns of J.
    """
    if not norms.size:
        return np.zeros((0, 0)), np.zeros((0, 0))
    scaled = jacobian / norms
    inverse_root = np.linalg.pinv(scaled, rcond=MIN_SINGULAR_VALUE) / norms[:, None]
    return inverse_root @ inverse_root.T, null_space(scaled, rcond=MIN_SINGULAR_VALUE).T


def _list_unknown_directions(model: UnitCubeResidual, u, free, changes) -> np.ndarray:
    """Return the directions in parameter space that the residual does not determine.

    The directions (d, n) are relative changes with a maximum of 1. If a value at the point u is 0, they are changes
    relative to the range. `u` (n,) is a point in the unit cube, `free` (f,) are the indices of its coordinates inside
    the bounds that have an effect, and `changes` (d, f) are the undetermined changes of these.
    """
    values = model.space.to_values(u)
    scale = values if values[free].all() else model.space.high - model.space.low
    directions = np.zeros((len(changes), u.size))
    directions[:, free] = changes * model.space.derivatives(u)[free] / scale[free]
    for row in directions:
        row /= row[np.argmax(np.abs(row))]
        row[np.abs(row) < 1e-3] = 0.0
    return directions
