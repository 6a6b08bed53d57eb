"""Curves of solutions r(x, p) = 0 through folds: pseudo-arc-length continuation.

The arc is measured in motion and parameter scaled to the same size, so that neither hides the
other. At a fold the parameter turns; at a crossing the determinant of the bordered system changes
sign, and another branch meets. Method: Keller 1977; Seydel, Practical Bifurcation and Stability
Analysis, 2010, ch. 4.
"""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.linalg.lapack import dgetrf, dgetrs

from ...core import NotConverged

# change of a motion over its size, below which Newton's method ends
NEWTON_TOL = 1e-9


@dataclass(frozen=True, eq=False, slots=True)
class Path:
    """Points of a curve in order.

    - x, p: (k, N), (k,) solutions and parameters
    - turn, arc: (k,) dp/ds, and arc s
    - folds: parameters where the curve turns back, from a cubic through the neighbours
    - crossings: parameters where a branch meets
    - ended: "end"; "start" where it came back through the other bound; "points"; "step" where no
      step was short enough
    """

    x: np.ndarray
    p: np.ndarray
    turn: np.ndarray
    arc: np.ndarray
    folds: tuple
    crossings: tuple
    ended: str


def follow(
    system,
    x,
    p: float,
    bounds: tuple,
    forward: bool = True,
    step: float = 0.02,
    longest: float = 0.1,
    most: int = 2000,
    goal: float = NEWTON_TOL,
    scale: float = 0.0,
) -> Path:
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
    step, longest : float, optional
        First and longest step of the arc, in which the width of the bounds and the size of the
        motion count 1.
    most : int, optional
        Points.
    goal : float, optional
        Change of the motion over its size at which Newton's steps end.
    scale : float, optional
        Size of the motion; 0 for the larger of that at the start and half of the largest so far.

    Returns
    -------
    Path

    Raises
    ------
    NotConverged
        If the first point is not reached.
    """
    width = bounds[1] - bounds[0]
    x = np.array(x, float)
    p = float(p)
    size = scale or float(np.linalg.norm(x)) or 1.0
    x = correct_point(system, x, p, np.zeros(x.size), 1.0, size, width, goal, p)
    if x is None:
        raise NotConverged(
            "accuracy.method: the first point of the curve was not found near the given start"
        )
    p = x[1]
    x = x[0]
    tangent = _find_tangent(system, x, p, None, size, width, forward)
    found = [(x, p, tangent[1], 0.0)]
    signs = [tangent[0]]
    ended = "points"
    arc = 0.0
    while len(found) < most:
        if not scale:
            size = max(size, 0.5 * float(np.linalg.norm(x)))
        t = tangent[1]
        guess = (x + step * size * t[:-1], p + step * width * t[-1])
        new = correct_point(system, *guess, t[:-1], t[-1], size, width, goal)
        if new is not None and not _keeps_direction(new, x, p, t, size, width, step):
            new = None
        if new is None:
            step /= 2
            if step < 1e-7:
                ended = "step"
                break
            continue
        if not bounds[0] <= new[1] <= bounds[1]:
            at = bounds[1] if new[1] > bounds[1] else bounds[0]
            share = (at - p) / (new[1] - p)
            last = correct_point(
                system, x + share * (new[0] - x), at, np.zeros(x.size), 1.0, size, width, goal, at
            )
            if last is not None:
                found.append((last[0], at, t, arc + share * step))
            ended = "end" if (at == bounds[1]) == forward else "start"
            break
        arc += step
        x, p, count = new
        tangent = _find_tangent(system, x, p, t, size, width, forward)
        found.append((x, p, tangent[1], arc))
        signs.append(tangent[0])
        # few iterations: the curve is straight here
        step = min(step * (1.5 if count <= 3 else 1.1 if count <= 5 else 0.6), longest)
    return Path(
        np.array([f[0] for f in found]),
        np.array([f[1] for f in found]),
        np.array([f[2][-1] for f in found]),
        np.array([f[3] for f in found]),
        _find_folds(found, width),
        tuple(
            0.5 * (found[k][1] + found[k + 1][1])
            for k in range(len(signs) - 1)
            if signs[k] * signs[k + 1] < 0
        ),
        ended,
    )


def _border(jacobian, by_p, t, size, width) -> np.ndarray:
    n = by_p.size
    matrix = np.empty((n + 1, n + 1))
    matrix[:n, :n] = jacobian
    matrix[:n, n] = by_p * (width / size)
    matrix[n] = t
    return matrix


def correct_point(system, x, p, tx, tp, size, width, goal, fixed=None):
    """Correct a guess by Newton's method across the tangent.

    Returns x, p and iterations, or None.

    Parameters
    ----------
    system, x, p
        As of `follow`.
    tx, tp : ndarray, float
        Tangent.
    size, width : float
        Of the motion and of the bounds.
    goal : float
    fixed : float, optional
        Value at which the parameter stays.

    Returns
    -------
    tuple or None
    """
    t = np.append(tx, tp)
    before = np.inf
    for count in range(1, 13):
        residual, jacobian, by_p = system(x, p)
        if not (np.isfinite(residual).all() and np.isfinite(jacobian).all()):
            return None
        factors, pivots, _ = dgetrf(_border(jacobian, by_p, t, size, width))
        step = dgetrs(factors, pivots, -np.append(residual / size, 0.0))[0]
        length = float(np.linalg.norm(step))
        if not np.isfinite(length) or (fixed is None and (length > 2 * before or length > 1.0)):
            return None
        x = x + size * step[:-1]
        p = p + width * step[-1] if fixed is None else fixed
        if length <= goal * max(1.0, float(np.linalg.norm(x)) / size):
            return x, p, count
        before = length
    return None


def _find_tangent(system, x, p, last, size, width, forward) -> tuple:
    """Return the sign of the bordered determinant and the unit tangent (N + 1,)."""
    _, jacobian, by_p = system(x, p)
    n = x.size
    guide = np.append(np.zeros(n), 1.0) if last is None else last
    factors, pivots, _ = dgetrf(_border(jacobian, by_p, guide, size, width))
    t = dgetrs(factors, pivots, np.append(np.zeros(n), 1.0))[0]
    t /= np.linalg.norm(t)
    swaps = np.sum(pivots != np.arange(n + 1))
    sign = (-1.0) ** (np.sum(np.diag(factors) < 0) + swaps)
    if last is None and not forward:
        return -sign, -t
    return sign, t


def _keeps_direction(new, x, p, t, size, width, step) -> bool:
    """Return whether a step follows the tangent, instead of jumping to another part of the curve."""
    move = np.append((new[0] - x) / size, (new[1] - p) / width)
    return float(move @ t) > 0.7 * float(np.linalg.norm(move))  # within 45 degrees of the tangent


def _find_folds(found, width) -> tuple:
    """Return the folds: extremes of p between points whose dp/ds differ in sign.

    The cubic takes values and slopes over the way along the first tangent, which a step covers
    exactly.
    """
    out = []
    for (_, p0, t0, s0), (_, p1, t1, s1) in pairwise(found):
        if t0[-1] * t1[-1] >= 0:
            continue
        h = s1 - s0
        a = t0[-1] * h
        b = t1[-1] * h / max(float(t0 @ t1), 0.1)
        rise = (p1 - p0) / width
        # derivative of the cubic: a + 2 s (3 rise - 2 a - b) + 3 s^2 (a + b - 2 rise)
        c = 3 * (a + b - 2 * rise)
        d = 2 * (3 * rise - 2 * a - b)
        roots = np.roots([c, d, a]) if abs(c) > 1e-9 * (abs(a) + abs(b)) else np.zeros(0)
        s = next((r.real for r in roots if abs(r.imag) < 1e-9 and 0 <= r.real <= 1), a / (a - b))
        out.append(
            p0 + width * (a * s + (3 * rise - 2 * a - b) * s * s + (a + b - 2 * rise) * s**3)
        )
    return tuple(out)
