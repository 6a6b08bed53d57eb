"""The step solve of points behind shear modes of the pieces: xi_j = dq - sum_k psi_kj db_k.

Over a step the coordinates b follow kappa (b + db/2) = psi^T f, f the path-mean forces of the points: the work of the
holder is what the points and the pieces take, so nothing is created. A force that jumps would leave b turning about
the balance in every step; where a law jumps, kappa CALM (db - db of the step before) stands beside it, which takes two
thirds of that in a step and changes a smooth motion to second order. `ending`: the pieces spring back while the holder
stands, kappa (b + db) = psi^T f with the forces f after it, which only loses energy as long as a force grows with the
slide. Both are minima of convex functions where no slope of a point is below 0, and Newton's method with a line search
on the slope along the step finds them. The forces of a law that FALLS may fall as its points slide, and then minima
stand beside each other: what is found lies downhill from where the last steps lead, to which pieces without a mass
would jump. c: `arrays.Sheared`, or a tuple with its fields from `weight` on. `law` says what the points answer;
`march.instances` has an instance of this text for points that are lists of bonds.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import grow
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..dense_kernels import factor, solve
from ..modal_kernels import safe_point
from . import shear_points_kernels as law

FORCE = law.FORCE
SLIDE = law.SLIDE
SLOPE = law.SLOPE
GRADIENT, STEP, TRIAL = range(3)
NEAR = 4e-6  # half its square is below the goal of a march, 1e-11
# times the goal: a residual that round-off keeps from falling further is taken below it
SLACK = law.SLACK
FALLS = law.FALLS
CALM = law.CALM
# iterations: points that turn to and fro about one place take up to 100
MOST = 1000 if FALLS else 200


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def halfway(v, dt, c):
    """The bond length in the middle of a step that begins with the speed v [m/s]."""
    c.eps[1] = grow(c.eps[0], v, v, abs(v) * dt / 2, dt / 2, c.growth)[0]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def set_slides(q, moved, c):
    """Write the slides [m] of the points where the holder slides by q and the coordinates move by `moved` (r,)."""
    psi = c.psi
    points = c.points
    count = int(c.count[0])
    r = moved.size
    for j in range(count):
        points[SLIDE, j] = q
    for k in range(0, r - 3, 4):  # four modes in one pass: a pass reads and writes every point
        one = moved[k]
        two = moved[k + 1]
        three = moved[k + 2]
        four = moved[k + 3]
        for j in range(count):
            points[SLIDE, j] -= (
                psi[k, j] * one + psi[k + 1, j] * two + psi[k + 2, j] * three + psi[k + 3, j] * four
            )
    for k in range(r - r % 4, r):
        part = moved[k]
        for j in range(count):
            points[SLIDE, j] -= psi[k, j] * part


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def pulled(row, psi, points, count, out):
    """Write psi^T of a row of the points, (r,), into out (1 + r,) from its second place on."""
    r = psi.shape[0]
    for k in range(0, r - 3, 4):
        one = 0.0
        two = 0.0
        three = 0.0
        four = 0.0
        for j in range(count):
            value = points[row, j]
            one += psi[k, j] * value
            two += psi[k + 1, j] * value
            three += psi[k + 2, j] * value
            four += psi[k + 3, j] * value
        out[k + 1] = one
        out[k + 2] = two
        out[k + 3] = three
        out[k + 4] = four
    for k in range(r - r % 4, r):
        total = 0.0
        for j in range(count):
            total += psi[k, j] * points[row, j]
        out[k + 1] = total


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def gradient(y, free, beta, kind, ending, c, out):
    """Residual (1 + r,) at y = (dq, db); beta = 0 or `ending`: the slide is given. Returns the friction force [N]."""
    part = 1.0 if ending else 0.5
    calm = 0.0 if ending else CALM
    set_slides(y[0], y[1:], c)
    force = law.respond(kind, ending, c)
    pulled(FORCE, c.psi, c.points, int(c.count[0]), out)
    for k in range(c.kappa.size):
        out[k + 1] = (
            c.kappa[k] * (c.b[k] + part * y[k + 1] + calm * (y[k + 1] - c.last[0, k + 1]))
            - out[k + 1]
        )
    out[0] = 0.0 if ending or beta == 0.0 else (y[0] - free) / beta + force
    return force


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def hessian(beta, ending, c, hess):
    """Lower half of the Hessian (1 + r, 1 + r) at the slopes of the points, over their forces."""
    psi = c.psi
    points = c.points
    count = int(c.count[0])
    given = ending or beta == 0.0
    total = 0.0
    for j in range(count):
        total += points[SLOPE, j]
    pulled(SLOPE, psi, points, count, hess[0])
    for k in range(c.kappa.size):
        hess[k + 1, 0] = 0.0 if given else -hess[0, k + 1]
        for j in range(count):
            points[FORCE, j] = points[SLOPE, j] * psi[k, j]
        last = (k + 1) % 4
        for l in range(0, k + 1 - last, 4):
            one = 0.0
            two = 0.0
            three = 0.0
            four = 0.0
            for j in range(count):
                value = points[FORCE, j]
                one += value * psi[l, j]
                two += value * psi[l + 1, j]
                three += value * psi[l + 2, j]
                four += value * psi[l + 3, j]
            hess[k + 1, l + 1] = one
            hess[k + 1, l + 2] = two
            hess[k + 1, l + 3] = three
            hess[k + 1, l + 4] = four
        for l in range(k + 1 - last, k + 1):
            dot = 0.0
            for j in range(count):
                dot += points[FORCE, j] * psi[l, j]
            hess[k + 1, l + 1] = dot
        hess[k + 1, k + 1] += c.kappa[k] * (1.0 if ending else 0.5 + CALM)
    hess[0, 0] = 1.0 if given else 1 / beta + total


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def weighted(out, scale):
    """Largest residual in force units: modal residuals are multiplied by the slide they stand for."""
    worst = abs(out[0])
    for k in range(1, out.size):
        worst = max(worst, abs(out[k]) * scale[k])
    return worst


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def near(p, c):
    """Whether a Newton step p (1 + r,) moves no point under a load that stays by more than NEAR bond lengths.

    The mean of a bond bends by less than its limit over the length squared, so half of NEAR^2 of the limit is left.
    """
    way = abs(p[0])
    for k in range(1, p.size):
        way += c.drag[1, k] * abs(p[k])
    return way <= NEAR * c.eps[1] and c.drag[0, 0] > 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def descend(free, beta, kind, ending, c, goal):
    """Minimum over c.y[ending] = (dq, db) in place, from the guess in it, where dq = free - beta force, dq = free for
    beta = 0. goal [N]: of the residual. Returns (force [N], iterations), < 0: failed.

    The factor of a Hessian serves all solves of a step of the march, until one with it gains less than a factor of ten.
    A Newton step that is short enough is the last one, and no residual is asked for after it.
    """
    which = 1 if ending else 0
    y = c.y[which]
    hess = c.hess[which]
    g = c.workspace[GRADIENT]
    p = c.workspace[STEP]
    trial = c.workspace[TRIAL]
    noise = 4e-16 * abs(free) / beta if beta > 0.0 else 0.0
    size = np.inf
    least = np.inf
    fall = 0.0
    force = 0.0
    stale = True
    stall = 0
    for i in range(y.size):
        p[i] = 0.0
    for count in range(
        MOST
    ):  # the first is the guess: one place of the gradient in the code, of two that run it
        if count > 0:
            if c.ready[which] == 0.0:
                hessian(beta, ending, c, hess)
                if not factor(hess):
                    if not FALLS:
                        return force, -count
                    for j in range(int(c.count[0])):
                        c.points[SLOPE, j] = max(c.points[SLOPE, j], 0.0)
                    hessian(beta, ending, c, hess)
                    if not factor(hess):
                        return force, -count
                c.ready[which] = 1.0
                stale = False
            for i in range(y.size):
                p[i] = -g[i]
            fall = -solve(hess, p)
            if not stale and not ending and beta > 0.0 and near(p, c):
                for i in range(y.size):
                    y[i] += p[i]
                set_slides(y[0], y[1:], c)
                return (free - y[0]) / beta, count
        part = 1.0
        low = 0.0
        high = np.inf
        for _ in range(40):
            for i in range(y.size):
                trial[i] = y[i] + part * p[i]
            force = gradient(trial, free, beta, kind, ending, c, g)
            rise = 0.0
            for i in range(y.size):
                rise += g[i] * p[i]
            if count == 0 or rise <= -0.5 * fall:
                break
            high = part
            part = safe_point(low, high, max(0.1, -fall / (rise - fall)) * part)
        for i in range(y.size):
            y[i] = trial[i]
        new = weighted(g, c.scale)
        if new <= max(goal, noise + 4e-16 * abs(force)):
            return force, count + 1
        if count > 0:
            if new > 0.1 * size or part < 1.0:
                c.ready[which] = 0.0
            stall = stall + 1 if new >= 0.5 * least and not stale else 0
            stale = c.ready[which] == 1.0
            if stall >= 4 and new <= SLACK * goal:
                return force, count
        size = new
        least = min(least, new)
    return force, -MOST


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def went_on(c):
    """Move the coordinates of the pieces by the solved step and leave the next guess, as the last three went on."""
    y = c.y[0]
    last = c.last
    for k in range(c.b.size):
        c.b[k] += y[k + 1]
    for k in range(y.size):
        here = y[k]
        y[k] = 3 * (here - last[0, k]) + last[1, k]
        last[1, k] = last[0, k]
        last[0, k] = here
    c.ready[:] = 0.0
