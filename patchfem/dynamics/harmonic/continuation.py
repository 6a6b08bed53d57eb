"""Pseudo-arc-length continuation of solution curves r(x, p) = 0, which can pass folds.

The arc length is measured in scaled unknowns and a scaled parameter, so that both count. At a fold
the parameter reverses; at a crossing the determinant of the bordered system changes
sign, and another branch meets. Method: Keller 1977; Seydel, Practical Bifurcation and Stability
Analysis, 2010, ch. 4.
"""

from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ...core import NotConverged

# Largest relative change of the unknowns in the last Newton step.
NEWTON_TOL = 1e-9
# Largest number of Newton steps per point; if a point needs more, the arc-length step is shortened.
MAX_NEWTON_STEPS = 12
# Smallest arc-length step of the continuation.
MIN_STEP = 1e-7
# Smallest cosine of the angle (45 degrees) between a step and the tangent; a
# larger angle indicates a jump.
MIN_STEP_COSINE = 0.7


@dataclass(frozen=True, eq=False, slots=True)
class CurvePath:
    """Solution curve of r(x, p) = 0: a sequence of points in order of arc length.

    - x, p: (k, N), (k,) solutions and parameters
    - turn, arc: (k,) dp/ds, and arc length s
    - folds: parameters at the folds, from a cubic between neighbouring points
    - crossings: parameters at bifurcations
    - ended: "end"; "start" if the curve returned to the other bound; "points"; "step" if
      no step was short enough
    """

    x: np.ndarray
    p: np.ndarray
    turn: np.ndarray
    arc: np.ndarray
    folds: tuple
    crossings: tuple
    ended: str


class PathSettings(NamedTuple):
    """Numerical settings of arc-length continuation.

    - first_step, max_step: first and longest step of the arc length, in which the width of the bounds and
      the size of the motion count 1
    - max_points: largest number of points
    - tolerance: change of the motion, relative to its size, at which Newton's method ends
    - size: scale of the unknowns; 0 for the larger of that at the start and half of the largest so far
    """

    first_step: float = 0.02
    max_step: float = 0.1
    max_points: int = 2000
    tolerance: float = NEWTON_TOL
    size: float = 0.0


class Scales(NamedTuple):
    """Scales for arc-length continuation: norm of the unknowns, and width of the parameter range."""

    size: float
    width: float


class CorrectedPoint(NamedTuple):
    """Converged point on a solution curve, and the number of Newton steps it took."""

    x: np.ndarray
    p: float
    n_steps: int


class _PathPoint(NamedTuple):
    """Point on a solution curve with its unit tangent (N + 1,) and arc length.

    sign: sign of the determinant of the bordered Jacobian, which changes at a bifurcation.

    """

    x: np.ndarray
    p: float
    tangent: np.ndarray
    arc: float
    sign: float


def follow_curve(
    evaluate, x, p: float, bounds: tuple, forward: bool = True, settings: PathSettings | None = None
) -> CurvePath:
    """Trace a solution curve of r(x, p) = 0 by arc-length continuation within parameter bounds.

    Parameters
    ----------
    evaluate : callable
        evaluate(x, p) -> residual (N,), d/dx (N, N), d/dp (N,).
    x : array_like
    p : float
        Initial guess of the first point, which is corrected first.
    bounds : tuple
        Lowest and highest p; the last point lies on one of them.
    forward : bool, optional
        Whether p increases at first.
    settings : PathSettings, optional

    Returns
    -------
    CurvePath

    Raises
    ------
    NotConverged
        If the first point is not found.
    """
    settings = settings or PathSettings()
    tolerance = settings.tolerance
    x = np.array(x, float)
    scales = Scales(settings.size or float(np.linalg.norm(x)) or 1.0, bounds[1] - bounds[0])
    start = correct_point(
        evaluate, (x, float(p)), _parameter_direction(x), scales, tolerance, float(p)
    )
    if start is None:
        raise NotConverged(
            "accuracy.method: the first point of the curve was not found near the given start"
        )
    last_point = _make_path_point(evaluate, start, 0.0, None, scales)
    if not forward:
        last_point = last_point._replace(tangent=-last_point.tangent, sign=-last_point.sign)
    points = [last_point]
    step = settings.first_step
    ended = "points"
    while len(points) < settings.max_points:
        if not settings.size:
            size = max(scales.size, 0.5 * float(np.linalg.norm(last_point.x)))
            scales = Scales(size, scales.width)
        corrected = _take_step(evaluate, last_point, step, scales, tolerance)
        if corrected is None:
            step /= 2
            if step < MIN_STEP:
                ended = "step"
                break
            continue
        if not bounds[0] <= corrected.p <= bounds[1]:
            bound = bounds[1] if corrected.p > bounds[1] else bounds[0]
            fraction = (bound - last_point.p) / (corrected.p - last_point.p)
            guess = (last_point.x + fraction * (corrected.x - last_point.x), bound)
            last = correct_point(evaluate, guess, _parameter_direction(x), scales, tolerance, bound)
            if last is not None:
                points.append(
                    last_point._replace(x=last.x, p=bound, arc=last_point.arc + fraction * step)
                )
            ended = "end" if (bound == bounds[1]) == forward else "start"
            break
        last_point = _make_path_point(
            evaluate, corrected, last_point.arc + step, last_point.tangent, scales
        )
        points.append(last_point)
        step = min(step * _step_factor(corrected.n_steps), settings.max_step)
    return CurvePath(
        np.array([point.x for point in points]),
        np.array([point.p for point in points]),
        np.array([point.tangent[-1] for point in points]),
        np.array([point.arc for point in points]),
        _find_folds(points, scales.width),
        tuple(0.5 * (a.p + b.p) for a, b in pairwise(points) if a.sign * b.sign < 0),
        ended,
    )


def _parameter_direction(x) -> np.ndarray:
    """Return the unit vector (N + 1,) in the direction of the continuation parameter."""
    return np.append(np.zeros(x.size), 1.0)


def _step_factor(n_newton_steps: int) -> float:
    """Return the factor for the next arc-length step, given the number of Newton steps.

    Few Newton steps show that the curve is nearly straight.

    """
    if n_newton_steps <= 3:
        return 1.5
    return 1.1 if n_newton_steps <= 5 else 0.6


def _take_step(evaluate, point: _PathPoint, step, scales, tolerance) -> CorrectedPoint | None:
    """Take a predictor step along the tangent, and correct the predicted point.

    Returns None if the corrector fails or jumps to another part of the curve.

    """
    t = point.tangent
    guess = (point.x + step * scales.size * t[:-1], point.p + step * scales.width * t[-1])
    corrected = correct_point(evaluate, guess, t, scales, tolerance)
    if corrected is None:
        return None
    scaled_step = np.append(
        (corrected.x - point.x) / scales.size, (corrected.p - point.p) / scales.width
    )
    # A step that does not follow the tangent jumps to another part of the curve.
    if float(scaled_step @ t) <= MIN_STEP_COSINE * float(np.linalg.norm(scaled_step)):
        return None
    return corrected


def _make_bordered_matrix(jacobian, by_p, t, scales: Scales) -> np.ndarray:
    """Return the scaled Jacobian with the tangent as an additional row, (N + 1, N + 1)."""
    n = by_p.size
    matrix = np.empty((n + 1, n + 1))
    matrix[:n, :n] = jacobian
    matrix[:n, n] = by_p * (scales.width / scales.size)
    matrix[n] = t
    return matrix


def correct_point(
    evaluate, guess: tuple, tangent, scales: Scales, tolerance: float, fixed: float | None = None
) -> CorrectedPoint | None:
    """Correct a predicted point by Newton's method in the plane perpendicular to the tangent.

    Parameters
    ----------
    evaluate : callable
        See `follow_curve`.
    guess : tuple
        Solution (N,) and parameter.
    tangent : ndarray
        (N + 1,) unit tangent.
    scales : Scales
    tolerance : float
        Relative change of the unknowns at which the method has converged.
    fixed : float, optional
        Fixed value of the parameter, if it must not change.

    Returns
    -------
    CorrectedPoint or None
        None if the method does not converge.
    """
    x, p = guess
    last_length = np.inf
    for n_steps in range(1, MAX_NEWTON_STEPS + 1):
        residual, jacobian, by_p = evaluate(x, p)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        factors, pivots, _ = dgetrf(_make_bordered_matrix(jacobian, by_p, tangent, scales))
        step = dgetrs(factors, pivots, -np.append(residual / scales.size, 0.0))[0]
        length = float(np.linalg.norm(step))
        if not np.isfinite(length) or (
            fixed is None and (length > 2 * last_length or length > 1.0)
        ):
            return None
        x = x + scales.size * step[:-1]
        p = p + scales.width * step[-1] if fixed is None else fixed
        if length <= tolerance * max(1.0, float(np.linalg.norm(x)) / scales.size):
            return CorrectedPoint(x, p, n_steps)
        last_length = length
    return None


def _make_path_point(
    evaluate, point: CorrectedPoint, arc: float, last_tangent, scales: Scales
) -> _PathPoint:
    """Return a corrected point with its unit tangent and the sign of the bordered determinant.

    last_tangent: tangent at the previous point; None at the first point, where p increases.
    """
    _, jacobian, by_p = evaluate(point.x, point.p)
    parameter_direction = _parameter_direction(point.x)
    border = parameter_direction if last_tangent is None else last_tangent
    factors, pivots, _ = dgetrf(_make_bordered_matrix(jacobian, by_p, border, scales))
    tangent = dgetrs(factors, pivots, parameter_direction)[0]
    tangent /= np.linalg.norm(tangent)
    swaps = np.sum(pivots != np.arange(parameter_direction.size))
    sign = (-1.0) ** (np.sum(np.diag(factors) < 0) + swaps)
    return _PathPoint(point.x, point.p, tangent, arc, sign)


def _find_folds(points: list, width: float) -> tuple:
    """Find the parameter values at folds by cubic interpolation between points.

    A fold is an extremum of p between two points whose dp/ds differ in sign.

    The cubic interpolates values and slopes over the distance along the first tangent, which a step covers
    exactly.
    """
    folds = []
    for first, second in pairwise(points):
        t0 = first.tangent
        t1 = second.tangent
        p0 = first.p
        if t0[-1] * t1[-1] >= 0:
            continue
        h = second.arc - first.arc
        a = t0[-1] * h
        b = t1[-1] * h / max(float(t0 @ t1), 0.1)
        scaled_rise = (second.p - p0) / width
        # The derivative of the cubic is a + 2 s (3 rise - 2 a - b) + 3 s^2 (a + b - 2 rise).
        c = 3 * (a + b - 2 * scaled_rise)
        d = 2 * (3 * scaled_rise - 2 * a - b)
        roots = np.roots([c, d, a]) if abs(c) > 1e-9 * (abs(a) + abs(b)) else np.zeros(0)
        s = next((r.real for r in roots if abs(r.imag) < 1e-9 and 0 <= r.real <= 1), a / (a - b))
        folds.append(
            p0
            + width
            * (a * s + (3 * scaled_rise - 2 * a - b) * s * s + (a + b - 2 * scaled_rise) * s**3)
        )
    return tuple(folds)
