"""Curves of solutions r(x, p) = 0 through folds: pseudo-arc-length continuation.

The arc is measured in motion and parameter scaled to the same size, so that both count. At a fold
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

# change of a motion over its size, below which Newton's method ends
NEWTON_TOL = 1e-9
# largest number of Newton steps of a point
MAX_NEWTON_STEPS = 12
# step of the arc below which the curve is given up
MIN_STEP = 1e-7
# cosine of the largest angle between a step and the tangent, 45 degrees
MIN_STEP_COSINE = 0.7


@dataclass(frozen=True, eq=False, slots=True)
class CurvePath:
    """Points of a curve in order.

    - x, p: (k, N), (k,) solutions and parameters
    - turn, arc: (k,) dp/ds, and arc s
    - folds: parameters where the curve turns back, from a cubic through the neighbours
    - crossings: parameters where a branch meets
    - ended: "end"; "start" where the curve came back through the other bound; "points"; "step" where
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
    """Numerical settings of a path.

    - first_step, max_step: first and longest step of the arc, in which the width of the bounds and
      the size of the motion count 1
    - max_points: largest number of points
    - tolerance: change of the motion over its size at which Newton's method ends
    - size: size of the motion; 0 for the larger of that at the start and half of the largest so far
    """

    first_step: float = 0.02
    max_step: float = 0.1
    max_points: int = 2000
    tolerance: float = NEWTON_TOL
    size: float = 0.0


class Scales(NamedTuple):
    """Size of the motion, and width of the bounds of the parameter."""

    size: float
    width: float


class CorrectedPoint(NamedTuple):
    """A point of a curve, and the Newton steps that led to it."""

    x: np.ndarray
    p: float
    n_steps: int


class _PathPoint(NamedTuple):
    """A point of a path: solution, parameter, unit tangent (N + 1,), arc, sign of the determinant."""

    x: np.ndarray
    p: float
    tangent: np.ndarray
    arc: float
    sign: float


def follow_curve(
    system, x, p: float, bounds: tuple, forward: bool = True, settings: PathSettings | None = None
) -> CurvePath:
    """Follow the curve through (x, p) until p leaves the bounds.

    Parameters
    ----------
    system : callable
        system(x, p) -> residual (N,), d/dx (N, N), d/dp (N,).
    x : array_like
    p : float
        Start, which is corrected first.
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
        If the first point is not reached.
    """
    settings = settings or PathSettings()
    tolerance = settings.tolerance
    x = np.array(x, float)
    scales = Scales(settings.size or float(np.linalg.norm(x)) or 1.0, bounds[1] - bounds[0])
    start = correct_point(
        system, (x, float(p)), _parameter_direction(x), scales, tolerance, float(p)
    )
    if start is None:
        raise NotConverged(
            "accuracy.method: the first point of the curve was not found near the given start"
        )
    here = _make_path_point(system, start, 0.0, None, scales)
    if not forward:
        here = here._replace(tangent=-here.tangent, sign=-here.sign)
    points = [here]
    step = settings.first_step
    ended = "points"
    while len(points) < settings.max_points:
        if not settings.size:
            size = max(scales.size, 0.5 * float(np.linalg.norm(here.x)))
            scales = Scales(size, scales.width)
        new = _take_step(system, here, step, scales, tolerance)
        if new is None:
            step /= 2
            if step < MIN_STEP:
                ended = "step"
                break
            continue
        if not bounds[0] <= new.p <= bounds[1]:
            bound = bounds[1] if new.p > bounds[1] else bounds[0]
            fraction = (bound - here.p) / (new.p - here.p)
            guess = (here.x + fraction * (new.x - here.x), bound)
            last = correct_point(system, guess, _parameter_direction(x), scales, tolerance, bound)
            if last is not None:
                points.append(here._replace(x=last.x, p=bound, arc=here.arc + fraction * step))
            ended = "end" if (bound == bounds[1]) == forward else "start"
            break
        here = _make_path_point(system, new, here.arc + step, here.tangent, scales)
        points.append(here)
        step = min(step * _step_factor(new.n_steps), settings.max_step)
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
    """Return the unit vector (N + 1,) of the parameter."""
    return np.append(np.zeros(x.size), 1.0)


def _step_factor(n_newton_steps: int) -> float:
    """Return the factor of the next step; few Newton steps show that the curve is straight here."""
    if n_newton_steps <= 3:
        return 1.5
    return 1.1 if n_newton_steps <= 5 else 0.6


def _take_step(system, here: _PathPoint, step, scales, tolerance) -> CorrectedPoint | None:
    """Return the point at a step along the tangent, None where it is not found on this curve."""
    t = here.tangent
    guess = (here.x + step * scales.size * t[:-1], here.p + step * scales.width * t[-1])
    new = correct_point(system, guess, t, scales, tolerance)
    if new is None:
        return None
    move = np.append((new.x - here.x) / scales.size, (new.p - here.p) / scales.width)
    # a step that does not follow the tangent jumps to another part of the curve
    if float(move @ t) <= MIN_STEP_COSINE * float(np.linalg.norm(move)):
        return None
    return new


def _make_bordered_matrix(jacobian, by_p, t, scales: Scales) -> np.ndarray:
    """Return the matrix (N + 1, N + 1) of the scaled system and of a step across the tangent."""
    n = by_p.size
    matrix = np.empty((n + 1, n + 1))
    matrix[:n, :n] = jacobian
    matrix[:n, n] = by_p * (scales.width / scales.size)
    matrix[n] = t
    return matrix


def correct_point(
    system, guess: tuple, tangent, scales: Scales, tolerance: float, fixed: float | None = None
) -> CorrectedPoint | None:
    """Correct a guess by Newton's method across the tangent.

    Parameters
    ----------
    system : callable
        See `follow_curve`.
    guess : tuple
        Solution (N,) and parameter.
    tangent : ndarray
        (N + 1,) unit tangent.
    scales : Scales
    tolerance : float
        Change of the motion over its size at which the steps end.
    fixed : float, optional
        Value at which the parameter stays.

    Returns
    -------
    CorrectedPoint or None
        None where the method does not converge.
    """
    x, p = guess
    before = np.inf
    for n_steps in range(1, MAX_NEWTON_STEPS + 1):
        residual, jacobian, by_p = system(x, p)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        factors, pivots, _ = dgetrf(_make_bordered_matrix(jacobian, by_p, tangent, scales))
        step = dgetrs(factors, pivots, -np.append(residual / scales.size, 0.0))[0]
        length = float(np.linalg.norm(step))
        if not np.isfinite(length) or (fixed is None and (length > 2 * before or length > 1.0)):
            return None
        x = x + scales.size * step[:-1]
        p = p + scales.width * step[-1] if fixed is None else fixed
        if length <= tolerance * max(1.0, float(np.linalg.norm(x)) / scales.size):
            return CorrectedPoint(x, p, n_steps)
        before = length
    return None


def _make_path_point(
    system, point: CorrectedPoint, arc: float, last_tangent, scales: Scales
) -> _PathPoint:
    """Return a point with its unit tangent and the sign of the bordered determinant.

    last_tangent: tangent at the point before, None at the first point, where p increases.
    """
    _, jacobian, by_p = system(point.x, point.p)
    upright = _parameter_direction(point.x)
    border = upright if last_tangent is None else last_tangent
    factors, pivots, _ = dgetrf(_make_bordered_matrix(jacobian, by_p, border, scales))
    tangent = dgetrs(factors, pivots, upright)[0]
    tangent /= np.linalg.norm(tangent)
    swaps = np.sum(pivots != np.arange(upright.size))
    sign = (-1.0) ** (np.sum(np.diag(factors) < 0) + swaps)
    return _PathPoint(point.x, point.p, tangent, arc, sign)


def _find_folds(points: list, width: float) -> tuple:
    """Return the folds: extremes of p between points whose dp/ds differ in sign.

    The cubic takes values and slopes over the way along the first tangent, which a step covers
    exactly.
    """
    out = []
    for first, second in pairwise(points):
        t0 = first.tangent
        t1 = second.tangent
        p0 = first.p
        if t0[-1] * t1[-1] >= 0:
            continue
        h = second.arc - first.arc
        a = t0[-1] * h
        b = t1[-1] * h / max(float(t0 @ t1), 0.1)
        rise = (second.p - p0) / width
        # derivative of the cubic: a + 2 s (3 rise - 2 a - b) + 3 s^2 (a + b - 2 rise)
        c = 3 * (a + b - 2 * rise)
        d = 2 * (3 * rise - 2 * a - b)
        roots = np.roots([c, d, a]) if abs(c) > 1e-9 * (abs(a) + abs(b)) else np.zeros(0)
        s = next((r.real for r in roots if abs(r.imag) < 1e-9 and 0 <= r.real <= 1), a / (a - b))
        out.append(
            p0 + width * (a * s + (3 * rise - 2 * a - b) * s * s + (a + b - 2 * rise) * s**3)
        )
    return tuple(out)
