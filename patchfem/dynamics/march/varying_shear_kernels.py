"""Friction of pieces that give way in shear under a load that changes, compiled: the step solve with shear modes.

Point j slides by xi_j = dq - sum_k psi_jk db_k. Over a step the coordinates b follow kappa (b + db/2) = psi^T f, f the
path-mean forces of the points under the mean load: the work of the holder is what the points and the pieces take, so
nothing is created. A changed load leaves the points out of balance with the pieces, which a mean alone would keep and
turn about in every step; so a step ends with the pieces springing back while the holder stands, kappa b = psi^T f at
its end, which only loses energy as long as a force grows with the slide. Both are minima of convex functions: the
slopes of the points are >= 0, and Newton's method with a line search on the slope along the step finds them.
"""

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import bond_mean, bond_step, grow, shape
from ...friction.flags_kernels import FAST, LEAN
from ..contacts.shear_kernels import weighted
from ..modal_kernels import safe_point
from .varying_friction_kernels import PLASTIC, POINTS, held_energy, local_slide, press_springs, spring_mean, spring_step

GRADIENT, STEP, TRIAL = range(3)
TIGHT = 0.001  # share of the goal down to which a residual is brought


@njit(error_model="numpy", **LEAN)
def spring_end(y, springs, sigma, dq, length):
    """(traction/mu [N], slope [N/m]) of one point at the end of the slide dq."""
    y1 = y + springs / length * dq
    if y1 > sigma:
        return sigma, 0.0
    if y1 < -sigma:
        return -sigma, 0.0
    return y1, springs / length


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def bond_end(m, z, dq, sigma, eps):
    """(stretch sum, slope) of one point at the end of the slide dq (z of `bond_step`)."""
    g = 1.0 if dq > 0 else -1.0
    x = abs(dq) / eps
    f1, _, e = shape(x)
    young = sigma - m
    z1 = z * e + g * eps * (sigma * x * f1 - young * x * e)
    return z1, sigma - young * e - g * z1 / eps


@njit(error_model="numpy", **LEAN)
def under_load(rub, ending):
    """Write the points that carry load, at the end of the step or on its mean, into rub.under; how many."""
    count = 0
    for j in range(rub.now.size):
        if rub.now[j] > 0.0 or (not ending and rub.before[j] > 0.0):
            rub.under[count] = j
            count += 1
    return count


@njit(error_model="numpy", **LEAN)
def point_force(j, xi, kind, rub, ending):
    """(force [N], slope [N/m] >= 0) of point j after the slide xi: its path mean under the mean load, or its value at
    the end under the load of the end."""
    mu, length = rub.force[0], rub.force[2]
    memory = rub.memory if ending else rub.half
    load = rub.now[j] if ending else 0.5 * (rub.before[j] + rub.now[j])
    if kind == PLASTIC:
        if ending:
            f, s = spring_end(memory[0, j], memory[1, j], load, xi, length)
        else:
            f, s = spring_mean(memory[0, j], memory[1, j], load, xi, length)
        return mu * f, mu * s
    if ending:
        f, s = bond_end(memory[0, j], memory[1, j], xi, load, rub.eps[0])
    else:
        f, s = bond_mean(memory[0, j], memory[1, j], xi, load, rub.middle[0])
    return mu / length * f, mu / length * max(s, 0.0)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def gradient(y, free, beta, kind, rub, ending, size, out):
    """Residual (1 + r,) at y = (dq, db) and the slopes of the `size` points under load; beta = 0 or `ending`: the slide
    is given. Returns the friction force [N]."""
    psi, kappa, b, r = rub.psi, rub.kappa, rub.b, rub.kappa.size
    part, force = 1.0 if ending else 0.5, 0.0
    for k in range(r):
        out[k + 1] = kappa[k] * (b[k] + part * y[k + 1])
    for i in range(size):
        j = rub.under[i]
        xi = y[0]
        for k in range(r):
            xi -= psi[j, k] * y[k + 1]
        f, s = point_force(j, xi, kind, rub, ending)
        rub.slope[i] = s
        force += f
        for k in range(r):
            out[k + 1] -= psi[j, k] * f
    out[0] = 0.0 if ending or beta == 0.0 else (y[0] - free) / beta + force
    return force


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def hessian(beta, rub, ending, size, hess):
    """Lower half of the Hessian (1 + r, 1 + r) at the slopes of the points."""
    psi, kappa, r = rub.psi, rub.kappa, rub.kappa.size
    given = ending or beta == 0.0
    hess[:] = 0.0
    hess[0, 0] = 1.0 if given else 1 / beta
    for k in range(r):
        hess[k + 1, k + 1] = kappa[k] * (1.0 if ending else 0.5)
    for i in range(size):
        j, s = rub.under[i], rub.slope[i]
        if s == 0.0:
            continue
        if not given:
            hess[0, 0] += s
        for k in range(r):
            sp = s * psi[j, k]
            if not given:
                hess[k + 1, 0] -= sp
            for l in range(k + 1):
                hess[k + 1, l + 1] += sp * psi[j, l]


@njit(error_model="numpy", **LEAN)
def factor(a):
    """Cholesky factor of a small matrix in its lower half, in place. False where it is not positive."""
    n = a.shape[0]
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        if not a[j, j] > 0:
            return False
        a[j, j] = np.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]
    return True


@njit(error_model="numpy", **LEAN)
def back(a, g, p):
    """p = -(a a^T)^-1 g; returns g . p < 0."""
    n = g.size
    for i in range(n):
        p[i] = -g[i]
        for k in range(i):
            p[i] -= a[i, k] * p[k]
        p[i] /= a[i, i]
    fall = 0.0
    for i in range(n - 1, -1, -1):
        fall -= p[i] * p[i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            p[i] -= a[k, i] * p[k]
        p[i] /= a[i, i]
    return fall


@njit(error_model="numpy", **LEAN)
def descend(y, free, beta, kind, rub, ending, goal):
    """Minimum over y in place, from the guess in it. Returns (force [N], iterations), < 0: failed.

    The factor of a Hessian serves all solves of a step of the march, until one with it gains less than a factor of ten.
    """
    g, p, trial = rub.room[GRADIENT], rub.room[STEP], rub.room[TRIAL]
    which = 1 if ending else 0
    hess = rub.hess[which]
    points = under_load(rub, ending)
    force = gradient(y, free, beta, kind, rub, ending, points, g)
    size, least = weighted(g, rub.scale), np.inf
    noise = 4e-16 * abs(free) / beta if beta > 0.0 else 0.0
    stale, stall = True, 0
    for count in range(1, 200):
        if size <= max(TIGHT * goal, noise + 4e-16 * abs(force)):
            return force, count
        if rub.ready[which] == 0.0:
            hessian(beta, rub, ending, points, hess)
            if not factor(hess):
                return force, -count
            rub.ready[which], stale = 1.0, False
        fall = back(hess, g, p)
        part, low, high = 1.0, 0.0, np.inf
        for _ in range(40):
            for i in range(y.size):
                trial[i] = y[i] + part * p[i]
            force = gradient(trial, free, beta, kind, rub, ending, points, g)
            rise = 0.0
            for i in range(y.size):
                rise += g[i] * p[i]
            if rise <= -0.5 * fall:
                break
            high = part
            part = safe_point(low, high, max(0.1, -fall / (rise - fall)) * part)
        for i in range(y.size):
            y[i] = trial[i]
        new = weighted(g, rub.scale)
        if new > 0.1 * size or part < 1.0:
            rub.ready[which] = 0.0
        stall = stall + 1 if new >= 0.5 * least and not stale else 0
        least = min(least, new)
        stale = rub.ready[which] == 1.0
        size = new
        if stall >= 4 and size <= goal:
            return force, count
    return force, -200


@njit(error_model="numpy", **LEAN)
def shear_solve(free, beta, v0, dt, kind, rub, goal):
    """Slide increment with dq = free - beta F and the coordinates of the pieces with it, both left in rub.y. Returns
    (dq, F, iterations), < 0: failed."""
    if kind == POINTS:
        rub.middle[0] = grow(rub.eps[0], v0, v0, abs(v0) * dt / 2, dt / 2, rub.growth)[0]
    y = rub.y
    if beta == 0.0:
        y[0] = free
    force, count = descend(y, free, beta, kind, rub, False, goal)
    if beta > 0.0:
        force = (free - y[0]) / beta
    return y[0], force, count


@njit(error_model="numpy", **LEAN)
def spring_back(kind, rub, goal):
    """Bring pieces and points to balance while the holder stands, after the load of the step. Returns (energy lost [J],
    iterations), < 0: failed."""
    y, length = rub.rest, rub.force[2]
    y[:] = 0.0
    before = held_energy(kind, rub, rub.memory)
    count = descend(y, 0.0, 0.0, kind, rub, True, goal)[1]
    memory = rub.memory
    for j in range(rub.now.size):
        load = rub.now[j]
        if load <= 0.0:
            continue
        xi = local_slide(j, 0.0, rub.psi, y)
        if kind == PLASTIC:
            a, b = spring_step(memory[0, j], memory[1, j], load, xi, length)
            memory[0, j], memory[1, j] = press_springs(a, b, load)
        else:
            memory[0, j], memory[1, j], memory[2, j], _ = bond_step(memory[0, j], memory[1, j], memory[2, j], xi, load,
                                                                    rub.eps[0])
    for k in range(rub.b.size):
        rub.b[k] += y[k + 1]
    return before - held_energy(kind, rub, memory), count
