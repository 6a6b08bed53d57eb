"""Pseudo-arc-length continuation of solution curves r(x, p) = 0, which can pass folds.

The arc length is measured in scaled unknowns and a scaled parameter, so that both count. At a fold the parameter
reverses. Derivatives are evaluated once at each point; between two points Broyden's method updates them. Methods: Keller
1977; Seydel, Practical Bifurcation and Stability Analysis, 2010, ch. 4; Broyden, Math. Comp. 19, 577, 1965.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from scipy.interpolate import CubicHermiteSpline

from ..core import NotConverged

NEWTON_TOL = 1e-9  # change of the unknowns, relative to their size, at which a correction ends
MAX_NEWTON_STEPS = 12  # largest number of steps of a correction
MAX_CORRECTIONS = 3  # largest number of corrections, each with new derivatives
RESIDUAL_FACTOR = 10.0  # largest residual at a point, relative to the tolerance of a correction
MIN_ARC_STEP = 1e-7  # smallest step of the arc length
MIN_STEP_COSINE = 0.7  # smallest cosine between a step and the tangent; a larger angle is a jump
MIN_TANGENT_COSINE = 0.1  # smallest cosine between two tangents in the cubic through a fold
SAME_CURVE_TOL = (
    0.05  # distance from an earlier step, relative to its length, at which a curve has closed
)
RANK_TOL = 1e-12  # singular values of a singular matrix are below it, relative to the largest


class PathSettings(NamedTuple):
    """Numerical settings of arc-length continuation.

    - first_step, max_step: first and longest step, as arc length [1] of the curve of the scaled parameter and unknowns:
      the parameter over the width of its bounds, and the unknowns over the size of the motion
    - max_points: largest number of points
    - tolerance: change of the motion, relative to its size, at which a correction ends
    """

    first_step: float = 0.02
    max_step: float = 0.1
    max_points: int = 2000
    tolerance: float = NEWTON_TOL


class PathEquations(NamedTuple):
    """Equations r(x, p) = 0 of a curve at one point.

    - jacobian: (N, N) derivatives of r by the unknowns x
    - by_parameter: (N,) derivatives of r by the parameter p
    - details: further results at this point
    - residual: largest part of the residual there, relative to the unknowns, and of that of unknowns that were eliminated
    - memory: what the equations remember there, for `Curve.restart`
    """

    jacobian: np.ndarray
    by_parameter: np.ndarray
    details: Any = None
    residual: float = 0.0
    memory: Any = None


class Curve(NamedTuple):
    """Equations of a solution curve.

    - find_residual: function of x (N,) and p that returns r (N,)
    - differentiate: function of x (N,) and p that returns `PathEquations`
    - restart: function of a `PathPoint` after a failed step, for equations that remember where they were evaluated
    """

    find_residual: Callable[[np.ndarray, float], np.ndarray]
    differentiate: Callable[[np.ndarray, float], PathEquations]
    restart: Callable[["PathPoint"], None] | None = None


class PathPoint(NamedTuple):
    """Point w = (x, p) of a curve.

    - w: (N + 1,) unknowns and parameter
    - equations: `PathEquations` there
    """

    w: np.ndarray
    equations: PathEquations

    def border(self, row, unit) -> np.ndarray:
        """Return the derivatives of the equations by scaled unknowns and parameter with a further row, (N + 1, N + 1).

        Parameters
        ----------
        row : (N + 1,) array
            Last row, which selects a point or a direction.
        unit : (N + 1,) array
            Sizes by which the entries of w are scaled.
        """
        by_parameter = self.equations.by_parameter * (unit[-1] / unit[0])
        return np.vstack([np.column_stack([self.equations.jacobian, by_parameter]), row])

    def find_tangent(self, direction, unit) -> np.ndarray:
        """Return the unit tangent (N + 1,) in scaled units that points in a direction (N + 1,); unit as in `border`."""
        tangent = _solve(self.border(direction, unit), np.append(np.zeros(direction.size - 1), 1.0))
        return tangent / np.linalg.norm(tangent)


@dataclass(frozen=True, eq=False, slots=True)
class CurvePath:
    """Solution curve of r(x, p) = 0: points in order of arc length.

    - points: list of PathPoint
    - folds: parameters at the folds, from a cubic between neighbouring points
    - ended: "end" at the bound in the first direction; "start" if the curve returned to the other bound; "loop" if it has
      closed; "points" after the largest number of points; "step" if no step was short enough; "cost" if the equations
      raised NotConverged, because they have been evaluated for too long
    """

    points: list[PathPoint]
    folds: tuple[float, ...]
    ended: str


def _solve(matrix, right_side) -> np.ndarray:
    """Return the least-squares solution of a linear system, which may be singular."""
    return np.linalg.lstsq(matrix, right_side, rcond=RANK_TOL)[0]


def follow_curve(
    curve: Curve,
    x,
    p: float,
    bounds: tuple[float, float],
    settings: PathSettings | None = None,
    *,
    forward: bool = True,
) -> CurvePath:
    """Trace a solution curve of r(x, p) = 0 within bounds of the parameter.

    Parameters
    ----------
    curve : Curve
        Equations of the curve.
    x : array_like
        Initial guess of the unknowns (N,).
    p : float
        Parameter of the first point, whose unknowns are corrected first.
    bounds : tuple
        Lowest and highest p; the last point lies on one of them.
    settings : PathSettings, optional
        Tolerance and steps along the curve.
    forward : bool, optional
        Whether p increases at first.

    Raises
    ------
    NotConverged
        If the first point is not found.
    """
    settings = settings or PathSettings()
    low, high = bounds
    # A point w has the unknowns x, then the parameter p. `unit` has the scale of each entry, `along` the direction of p.
    w = np.append(np.asarray(x, float), float(p))
    unit = np.full(w.size, float(np.linalg.norm(x)) or 1.0)
    unit[-1] = high - low
    along = np.append(np.zeros(w.size - 1), 1.0)
    first = find_point(curve, PathPoint(w, curve.differentiate(w[:-1], p)), w, settings.tolerance)
    if first is None:
        raise NotConverged(
            "accuracy.method: the first point of the curve was not found near the given start"
        )

    points = [first]
    tangent = first.find_tangent(along if forward else -along, unit)
    folds = []
    step = settings.first_step
    ended = "points"

    # A step without a solution is halved. The points found so far are a curve also if the next one costs too much.
    try:
        while len(points) < settings.max_points:
            # The unit of the unknowns rises with their norm, so that steps have the same relative length.
            point = points[-1]
            unit[:-1] = max(unit[0], 0.5 * float(np.linalg.norm(point.w[:-1])))
            tangent = point.find_tangent(tangent, unit)
            taken = _take_step(curve, point, step * tangent, unit, settings.tolerance)
            if taken is None:
                if curve.restart is not None:
                    curve.restart(point)
                step /= 2
                if step < MIN_ARC_STEP:
                    ended = "step"
                    break
                continue

            # The last point lies on the bound that the step passes.
            after, n_steps = taken
            w = after.w
            if not low <= w[-1] <= high:
                bound = high if w[-1] > high else low
                guess = point.w + (bound - point.w[-1]) / (w[-1] - point.w[-1]) * (w - point.w)
                last = find_point(curve, point, np.append(guess[:-1], bound), settings.tolerance)
                points += [last] * (last is not None)
                ended = "end" if (bound == high) == forward else "start"
                break

            is_closed = _is_on_curve(after, points, tangent, unit)
            points.append(after)
            folds += _find_folds(points[-2:], tangent, unit, step)
            if is_closed:
                ended = "loop"
                break
            step = min(step * _step_factor(n_steps), settings.max_step)
    except NotConverged:
        ended = "cost"
    return CurvePath(points, tuple(folds), ended)


def _step_factor(n_steps: int) -> float:
    """Return the ratio of the next step to the last one, whose correction took `n_steps` steps of Broyden's method.

    It is above 1 for a few steps, because the curve is nearly straight then.
    """
    if n_steps <= 5:
        return 1.5
    return 1.1 if n_steps <= 7 else 0.6


class Guess(NamedTuple):
    """Guess of a point of a curve.

    - w (N + 1,): guess of unknowns and parameter
    - row (N + 1,): direction in scaled units in which no correction goes: the tangent, or the parameter, which then keeps
      its value
    - unit (N + 1,): scale of each entry of w
    """

    w: np.ndarray
    row: np.ndarray
    unit: np.ndarray


def correct_point(
    curve: Curve, point: PathPoint, guess: Guess, tolerance: float, *, max_step: float = np.inf
) -> tuple[PathPoint, int] | None:
    """Move a guess onto the curve by Broyden's method, and repeat this with new derivatives until the residual has vanished.

    Beyond a kink of the curve, the derivatives at `point` may lead to a place where the equations do not hold. If they
    lead nowhere, the correction begins again with the derivatives at the guess.

    Parameters
    ----------
    curve : Curve
        Equations of the curve.
    point : PathPoint
        Point near the guess, whose derivatives are used first.
    guess : Guess
        Guess that is corrected.
    tolerance : float
        Relative change of the unknowns at which the method has converged.
    max_step : float
        Longest scaled step, and the steps may then not grow; without it steps of any length are taken.

    Returns
    -------
    tuple or None
        Corrected point, and number of steps; None without convergence.
    """
    for _ in range(MAX_CORRECTIONS):
        matrix = point.border(guess.row, guess.unit)
        found = _correct_by_broyden(curve, matrix, guess, tolerance, max_step)
        if found is not None:
            guess = guess._replace(w=found[0])
        point = PathPoint(guess.w, curve.differentiate(guess.w[:-1], guess.w[-1]))
        if found is not None and point.equations.residual <= RESIDUAL_FACTOR * tolerance:
            return point, found[1]
    return None


def _correct_by_broyden(
    curve: Curve, matrix, guess: Guess, tolerance: float, max_step: float
) -> tuple[np.ndarray, int] | None:
    """Return the corrected guess (N + 1,) and the number of steps of Broyden's method, or None without convergence.

    `matrix` (N + 1, N + 1) are the scaled derivatives with which it begins; the others are as in `correct_point`.
    """
    w = guess.w
    unit = guess.unit
    step = None
    for count in range(1, MAX_NEWTON_STEPS + 1):
        residual = np.append(curve.find_residual(w[:-1], w[-1]) / unit[0], 0.0)
        if not (np.isfinite(residual).all() and np.isfinite(matrix).all()):
            return None

        # The derivatives along the last step are those that would have predicted this residual.
        longest = max_step
        if step is not None:
            matrix = matrix + np.outer(residual, step) / (step @ step)
            longest = min(max_step, 2 * np.linalg.norm(step)) if max_step < np.inf else np.inf
        step = _solve(matrix, -residual)
        length = float(np.linalg.norm(step))
        if not length <= longest:
            return None
        w = w + unit * step
        if length <= tolerance * max(1.0, float(np.linalg.norm(w[:-1])) / unit[0]):
            return w, count
    return None


def find_point(curve: Curve, point: PathPoint, w, tolerance: float) -> PathPoint | None:
    """Return the point of a curve with the parameter of a guess, or None without convergence.

    Parameters
    ----------
    curve : Curve
        Equations of the curve.
    point : PathPoint
        Point near the guess.
    w : (N + 1,) array
        Guess of the unknowns, and the parameter.
    tolerance : float
        Relative change of the unknowns at which the correction ends.
    """
    along = np.append(np.zeros(w.size - 1), 1.0)
    unit = np.append(np.full(w.size - 1, float(np.linalg.norm(w[:-1])) or 1.0), abs(w[-1]) or 1.0)
    corrected = correct_point(curve, point, Guess(w, along, unit), tolerance)
    if corrected is None:
        return None
    found = corrected[0]
    return found._replace(w=np.append(found.w[:-1], w[-1]))


def _take_step(
    curve: Curve, point: PathPoint, step, unit, tolerance: float
) -> tuple[PathPoint, int] | None:
    """Return the corrected point after a step along the curve, and the number of corrections.

    The result is None if the correction fails or moves the point away from the direction of the step.

    Parameters
    ----------
    curve : Curve
        Equations of the curve.
    point : PathPoint
        Start of the step.
    step : (N + 1,) array
        Step along the tangent in scaled units.
    unit : (N + 1,) array
        Sizes by which unknowns and parameter are scaled.
    tolerance : float
        Relative change of the motion at which a correction ends.
    """
    tangent = step / np.linalg.norm(step)
    guess = Guess(point.w + unit * step, tangent, unit)
    corrected = correct_point(curve, point, guess, tolerance, max_step=1.0)
    if corrected is None:
        return None
    taken = (corrected[0].w - point.w) / unit
    is_along = float(taken @ tangent) > MIN_STEP_COSINE * float(np.linalg.norm(taken))
    return corrected if is_along else None


def _is_on_curve(point: PathPoint, points: list[PathPoint], direction, unit) -> bool:
    """Return whether a point lies on an earlier step of the curve, so that the curve has closed and would be followed again.

    `points` are those of the curve in their order, `direction` (N + 1,) is that of the last step, and the distances are
    scaled by `unit` (N + 1,).
    """
    places = np.array([other.w for other in points]) / unit
    starts = places[:-2]
    steps = np.diff(places[:-1], axis=0)
    lengths = np.linalg.norm(steps, axis=1)
    to_point = point.w / unit - starts
    along = np.sum(to_point * steps, axis=1) / lengths
    across = np.linalg.norm(to_point - (along / lengths)[:, None] * steps, axis=1)
    is_between = (along >= 0) & (along <= lengths) & (across < SAME_CURVE_TOL * lengths)
    is_parallel = steps @ direction > MIN_STEP_COSINE * lengths
    return bool((is_between & is_parallel).any())


def _find_folds(points: list[PathPoint], tangent, unit, length: float) -> list[float]:
    """Return the parameter at a fold between two points that follow each other, [] without a fold.

    The parameter is a cubic of the distance along the tangent at the first point, and a fold is its extreme.

    Parameters
    ----------
    points : list of PathPoint
        Both points.
    tangent : (N + 1,) array
        Unit tangent at the first one in scaled units.
    unit : (N + 1,) array
        Sizes by which unknowns and parameter are scaled.
    length : float
        Scaled arc length between the points.
    """
    other = points[1].find_tangent(tangent, unit)
    slopes = np.array([tangent[-1], other[-1]])
    if slopes[0] * slopes[1] >= 0:
        return []
    slopes[1] /= max(float(tangent @ other), MIN_TANGENT_COSINE)
    parameters = [point.w[-1] for point in points]
    curve = CubicHermiteSpline([0.0, length], parameters, slopes * unit[-1])
    places = curve.derivative().roots(extrapolate=False)
    return [float(curve(place)) for place in places[:1]]
