"""Pseudo-arc-length continuation of solution curves r(x, p) = 0, which can pass folds.

The arc length is measured in scaled unknowns and a scaled parameter, so that both count. At a fold the parameter
reverses. Method: Keller 1977; Seydel, Practical Bifurcation and Stability Analysis, 2010, ch. 4.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ...core import NotConverged
from .equations import factor

NEWTON_TOL = 1e-9  # change of the unknowns, relative to their size, at which Newton's method ends
MAX_NEWTON_STEPS = 12  # largest number of Newton steps to a point of the curve
MIN_ARC_STEP = 1e-7  # smallest step of the arc length
MIN_STEP_COSINE = 0.7  # smallest cosine between a step and the tangent; a larger angle is a jump
MIN_TANGENT_COSINE = 0.1  # smallest cosine between two tangents in the cubic through a fold


@dataclass(frozen=True, eq=False, slots=True)
class CurvePath:
    """Solution curve of r(x, p) = 0: points in order of arc length.

    - x, p: (k, N), (k,) solutions and parameters
    - folds: parameters at the folds, from a cubic between neighbouring points
    - ended: "end" at the bound in the first direction; "start" if the curve returned to the other bound; "points" after the
      largest number of points; "step" if no step was short enough
    """

    x: np.ndarray
    p: np.ndarray
    folds: tuple[float, ...]
    ended: str


class PathEquations(NamedTuple):
    """Equations r(x, p) = 0 of a curve at one point.

    - residual: (N,) r
    - jacobian: (N, N) derivatives of r by the unknowns x
    - by_parameter: (N,) derivatives of r by the parameter p
    """

    residual: np.ndarray
    jacobian: np.ndarray
    by_parameter: np.ndarray


class PathSettings(NamedTuple):
    """Numerical settings of arc-length continuation.

    - first_step, max_step: first and longest step, as arc length [1] of the curve of the scaled parameter and unknowns:
      the parameter over the width of its bounds, and the unknowns over the size of the motion
    - max_points: largest number of points
    - tolerance: change of the motion, relative to its size, at which Newton's method ends
    """

    first_step: float = 0.02
    max_step: float = 0.1
    max_points: int = 2000
    tolerance: float = NEWTON_TOL


class _PathPoint(NamedTuple):
    """Point w = (x, p) of a curve with its unit tangent in scaled units, (N + 1,) each."""

    w: np.ndarray
    tangent: np.ndarray


def follow_curve(
    evaluate,
    x,
    p: float,
    bounds: tuple[float, float],
    forward: bool = True,
    settings: PathSettings | None = None,
) -> CurvePath:
    """Trace a solution curve of r(x, p) = 0 within bounds of the parameter.

    Parameters
    ----------
    evaluate : callable
        evaluate(x, p) -> PathEquations.
    x : array_like
        Initial guess of the unknowns (N,).
    p : float
        Initial guess of the first point, which is corrected first.
    bounds : tuple
        Lowest and highest p; the last point lies on one of them.
    forward : bool, optional
        Whether p increases at first.
    settings : PathSettings, optional
        Tolerance and steps along the curve.

    Raises
    ------
    NotConverged
        If the first point is not found.
    """
    settings = settings or PathSettings()
    low, high = bounds
    w = np.append(np.asarray(x, float), float(p))
    unit = np.full(w.size, float(np.linalg.norm(x)) or 1.0)
    unit[-1] = high - low
    along = np.append(np.zeros(w.size - 1), 1.0)
    first = correct_point(evaluate, w, along, unit, settings.tolerance, is_fixed=True)
    if first is None:
        raise NotConverged(
            "accuracy.method: the first point of the curve was not found near the given start"
        )

    point = _make_point(evaluate, first[0], along if forward else -along, unit)
    points = [point]
    folds = []
    step = settings.first_step
    ended = "points"

    # A step without a solution is halved.
    while len(points) < settings.max_points:
        # The scale of the unknowns rises with their size.
        unit[:-1] = max(unit[0], 0.5 * float(np.linalg.norm(point.w[:-1])))
        taken = _take_step(evaluate, point, step, unit, settings.tolerance)
        if taken is None:
            step /= 2
            if step < MIN_ARC_STEP:
                ended = "step"
                break
            continue

        # The last point lies on the bound that the step passes.
        w, n_newton = taken
        if not low <= w[-1] <= high:
            bound = high if w[-1] > high else low
            guess = point.w + (bound - point.w[-1]) / (w[-1] - point.w[-1]) * (w - point.w)
            last = correct_point(evaluate, guess, along, unit, settings.tolerance, is_fixed=True)
            if last is not None:
                points.append(point._replace(w=np.append(last[0][:-1], bound)))
            ended = "end" if (bound == high) == forward else "start"
            break

        previous = point
        point = _make_point(evaluate, w, point.tangent, unit)
        points.append(point)
        folds += _find_folds(previous, point, step, unit[-1])
        step = min(step * _step_factor(n_newton), settings.max_step)

    path = np.array([point.w for point in points])
    return CurvePath(path[:, :-1], path[:, -1], tuple(folds), ended)


def _step_factor(n_newton: int) -> float:
    """Return the factor for the next step; few Newton steps show that the curve is nearly straight."""
    if n_newton <= 3:
        return 1.5
    return 1.1 if n_newton <= 5 else 0.6


def _make_border(evaluate, w, row, unit) -> tuple[np.ndarray, np.ndarray]:
    """Return the scaled residual (N,), and the scaled Jacobian with a further row, (N + 1, N + 1).

    Parameters
    ----------
    evaluate : callable
        Function of x and p that returns `PathEquations`.
    w : (N + 1,) array
        Point (x, p) of the curve.
    row : (N + 1,) array
        Last row, which selects a point or a direction.
    unit : (N + 1,) array
        Sizes by which the entries of `w` are scaled.
    """
    residual, jacobian, by_p = evaluate(w[:-1], w[-1])
    matrix = np.empty((w.size, w.size))
    matrix[:-1, :-1] = jacobian
    matrix[:-1, -1] = by_p * (unit[-1] / unit[0])
    matrix[-1] = row
    return residual / unit[0], matrix


def correct_point(evaluate, w, tangent, unit, tolerance: float, *, is_fixed: bool = False):
    """Correct a point by Newton's method in the plane perpendicular to the tangent.

    Parameters
    ----------
    evaluate : callable
        evaluate(x, p) -> PathEquations.
    w : (N + 1,) array
        Unknowns and parameter.
    tangent : (N + 1,) array
        Unit tangent in scaled units.
    unit : (N + 1,) array
        Scale of each entry of w.
    tolerance : float
        Relative change of the unknowns at which the method has converged.
    is_fixed : bool
        Whether the tangent is that of the parameter, which then keeps its value; steps of any length are taken.

    Returns
    -------
    tuple or None
        Corrected point (N + 1,), and number of Newton steps; None without convergence.
    """
    last = np.inf
    for count in range(1, MAX_NEWTON_STEPS + 1):
        residual, matrix = _make_border(evaluate, w, tangent, unit)
        if not (np.isfinite(residual).all() and np.isfinite(matrix).all()):
            return None
        step = factor(matrix)(-np.append(residual, 0.0))
        length = float(np.linalg.norm(step))
        if not np.isfinite(length) or (not is_fixed and length > min(2 * last, 1.0)):
            return None
        w = w + unit * step
        if length <= tolerance * max(1.0, float(np.linalg.norm(w[:-1])) / unit[0]):
            return w, count
        last = length
    return None


def _take_step(evaluate, point: _PathPoint, step: float, unit, tolerance: float):
    """Return the point after a step along the curve as `correct_point` does, or None if it fails or jumps.

    Parameters
    ----------
    evaluate : callable
        Function of x and p that returns `PathEquations`.
    point : _PathPoint
        Start of the step, with its tangent.
    step : float
        Arc length of the step in scaled units.
    unit : (N + 1,) array
        Sizes by which unknowns and parameter are scaled.
    tolerance : float
        Relative change of the motion at which Newton's method ends.
    """
    corrected = correct_point(
        evaluate, point.w + step * unit * point.tangent, point.tangent, unit, tolerance
    )
    if corrected is None:
        return None
    taken = (corrected[0] - point.w) / unit
    is_along = float(taken @ point.tangent) > MIN_STEP_COSINE * float(np.linalg.norm(taken))
    return corrected if is_along else None


def _make_point(evaluate, w, direction, unit) -> _PathPoint:
    """Return a point of the curve with its tangent, which points in a direction (N + 1,).

    `evaluate` is a function of x and p that returns `PathEquations`. `w` is the point (x, p), and `unit` has the sizes
    by which its entries are scaled, (N + 1,) each.
    """
    _, matrix = _make_border(evaluate, w, direction, unit)
    tangent = factor(matrix)(np.append(np.zeros(w.size - 1), 1.0))
    return _PathPoint(w, tangent / np.linalg.norm(tangent))


def _find_folds(first: _PathPoint, second: _PathPoint, length: float, width: float) -> list[float]:
    """Return the parameter at a fold between two points at a distance along the first tangent, [] without a fold.

    The parameter is a cubic of the distance along the first tangent, and a fold is its extreme. The points follow each
    other on the curve, `length` is the arc length between them in scaled units, and `width` the unit of the parameter.
    """
    slopes = np.array([first.tangent[-1], second.tangent[-1]])
    if slopes[0] * slopes[1] >= 0:
        return []
    slopes[1] /= max(float(first.tangent @ second.tangent), MIN_TANGENT_COSINE)
    curve = CubicHermiteSpline([0.0, length], [first.w[-1], second.w[-1]], slopes * width)
    places = curve.derivative().roots(extrapolate=False)
    return [float(curve(place)) for place in places[:1]]
