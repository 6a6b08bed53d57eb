"""The step solve of points behind shear modes of the pieces: xi_j = dq - sum_k psi_kj db_k.

Over a step the coordinates b follow kappa (b + db/2) = psi^T f, f the path-mean forces of the points: the work of the
holder is what the points and the pieces take, so nothing is created. `ending`: the pieces spring back while the holder
stands, kappa (b + db) = psi^T f with the forces f after it, which only loses energy as long as a force grows with the
slide. Both are minima of convex functions: the slopes of the points are >= 0, and Newton's method with a line search on
the slope along the step finds them. c: `arrays.Sheared`, or a tuple with its fields from `weight` on.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.bonds.point_kernels import grow
from ...friction.flags_kernels import FAST, LEAN
from ..dense_kernels import factor, solve
from ..modal_kernels import safe_point
from .shear_points_kernels import FORCE, SLIDE, SLOPE, respond

GRADIENT, STEP, TRIAL = range(3)
SLACK = 100.0  # times the goal: a residual that round-off keeps from falling further is taken below it


@njit(error_model="numpy", **LEAN)
def halfway(v, dt, c):
    """The bond length in the middle of a step that begins with the speed v [m/s]."""
    c.eps[1] = grow(c.eps[0], v, v, abs(v) * dt / 2, dt / 2, c.growth)[0]


@njit(error_model="numpy", fastmath=FAST, forceinline=True, **LEAN)
def slid(q, moved, c):
    """Write the slides [m] of the points where the holder slides by q and the coordinates move by `moved` (r,)."""
    psi, points, count = c.psi, c.points, int(c.count[0])
    for j in range(count):
        points[SLIDE, j] = q
    for k in range(moved.size):
        part = moved[k]
        for j in range(count):
            points[SLIDE, j] -= psi[k, j] * part


@njit(error_model="numpy", fastmath=FAST, forceinline=True, **LEAN)
def gradient(y, free, beta, kind, ending, c, out):
    """Residual (1 + r,) at y = (dq, db); beta = 0 or `ending`: the slide is given. Returns the friction force [N]."""
    psi, points, count, part = c.psi, c.points, int(c.count[0]), 1.0 if ending else 0.5
    slid(y[0], y[1:], c)
    force = respond(kind, ending, c)
    for k in range(c.kappa.size):
        pull = 0.0
        for j in range(count):
            pull += psi[k, j] * points[FORCE, j]
        out[k + 1] = c.kappa[k] * (c.b[k] + part * y[k + 1]) - pull
    out[0] = 0.0 if ending or beta == 0.0 else (y[0] - free) / beta + force
    return force


@njit(error_model="numpy", fastmath=FAST, forceinline=True, **LEAN)
def hessian(beta, ending, c, hess):
    """Lower half of the Hessian (1 + r, 1 + r) at the slopes of the points, over their forces."""
    psi, points, count, given, total = c.psi, c.points, int(c.count[0]), ending or beta == 0.0, 0.0
    for j in range(count):
        total += points[SLOPE, j]
    hess[0, 0] = 1.0 if given else 1 / beta + total
    for k in range(c.kappa.size):
        total = 0.0
        for j in range(count):
            points[FORCE, j] = points[SLOPE, j] * psi[k, j]
            total += points[FORCE, j]
        hess[k + 1, 0] = 0.0 if given else -total
        for l in range(k + 1):
            dot = 0.0
            for j in range(count):
                dot += points[FORCE, j] * psi[l, j]
            hess[k + 1, l + 1] = dot
        hess[k + 1, k + 1] += c.kappa[k] * (1.0 if ending else 0.5)


@njit(error_model="numpy", **LEAN)
def weighted(out, scale):
    """Largest residual in force units: modal residuals are multiplied by the slide they stand for."""
    worst = abs(out[0])
    for k in range(1, out.size):
        worst = max(worst, abs(out[k]) * scale[k])
    return worst


@njit(error_model="numpy", **LEAN)
def descend(free, beta, kind, ending, c, goal):
    """Minimum over c.y[ending] = (dq, db) in place, from the guess in it, where dq = free - beta force, dq = free for
    beta = 0. goal [N]: of the residual. Returns (force [N], iterations), < 0: failed.

    The factor of a Hessian serves all solves of a step of the march, until one with it gains less than a factor of ten.
    """
    which = 1 if ending else 0
    y, hess, g, p, trial = c.y[which], c.hess[which], c.room[GRADIENT], c.room[STEP], c.room[TRIAL]
    force = gradient(y, free, beta, kind, ending, c, g)
    size, least = weighted(g, c.scale), np.inf
    noise = 4e-16 * abs(free) / beta if beta > 0.0 else 0.0
    stale, stall = True, 0
    for count in range(1, 200):
        if size <= max(goal, noise + 4e-16 * abs(force)):
            return force, count
        if c.ready[which] == 0.0:
            hessian(beta, ending, c, hess)
            if not factor(hess):
                return force, -count
            c.ready[which], stale = 1.0, False
        for i in range(y.size):
            p[i] = -g[i]
        fall = -solve(hess, p)
        part, low, high = 1.0, 0.0, np.inf
        for _ in range(40):
            for i in range(y.size):
                trial[i] = y[i] + part * p[i]
            force = gradient(trial, free, beta, kind, ending, c, g)
            rise = 0.0
            for i in range(y.size):
                rise += g[i] * p[i]
            if rise <= -0.5 * fall:
                break
            high = part
            part = safe_point(low, high, max(0.1, -fall / (rise - fall)) * part)
        for i in range(y.size):
            y[i] = trial[i]
        new = weighted(g, c.scale)
        if new > 0.1 * size or part < 1.0:
            c.ready[which] = 0.0
        stall = stall + 1 if new >= 0.5 * least and not stale else 0
        least = min(least, new)
        stale = c.ready[which] == 1.0
        size = new
        if stall >= 4 and size <= SLACK * goal:
            return force, count
    return force, -200


@njit(error_model="numpy", **LEAN)
def went_on(c):
    """Move the coordinates of the pieces by the solved step and leave the next guess, as the last two went on."""
    y, last = c.y[0], c.last
    for k in range(c.b.size):
        c.b[k] += y[k + 1]
    for k in range(y.size):
        here = y[k]
        y[k] = 2 * here - last[k]
        last[k] = here
    c.ready[:] = 0.0
