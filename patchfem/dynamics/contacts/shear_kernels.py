"""A contact, `arrays.Sheared`, of bond points behind the shear modes of the pieces: xi_j = dq - sum_k psi_kj db_k.

The functions are those that `march.loop_kernels` asks of every contact.
"""

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from ...friction.flags_kernels import FAST, LEAN

SET_VALUED = False


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def point_mean(c, j, dq, eps):
    """Path-mean stretch [Pa m] of point j and its slope [Pa]."""
    if c.bonds.shape[0] > 4:
        return loose_mean(c.bonds[0, j], c.bonds[1, j], c.bonds[4, j], c.growth[5] * eps, dq, c.source[j], eps)
    return bond_mean(c.bonds[0, j], c.bonds[1, j], dq, c.source[j], eps)


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def residual(y, free, beta, c, eps, out, points):
    """Residual (1 + r,) of the step with shear modes, y = (dq, db), and the slope points[0] of every point [N/m];
    points (3, m). Loops run over the points, which lie side by side.

    beta = 0: the slide is given, dq = free. Returns the friction force [N].
    """
    weight, psi, kappa, b = c.weight, c.psi, c.kappa, c.b
    m, r = weight.size, kappa.size
    for j in range(m):
        points[1, j] = y[0]
    for k in range(r):
        moved = y[k + 1]
        for j in range(m):
            points[1, j] -= psi[k, j] * moved
    force = 0.0
    for j in range(m):
        mean, gain = point_mean(c, j, points[1, j], eps)
        points[0, j] = weight[j] * gain
        points[2, j] = weight[j] * mean
        force += points[2, j]
    for k in range(r):
        pull = 0.0
        for j in range(m):
            pull += psi[k, j] * points[2, j]
        out[k + 1] = kappa[k] * (b[k] + 0.5 * y[k + 1]) - pull
    out[0] = (y[0] - free) / beta + force if beta > 0 else 0.0
    return force


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def hessian(beta, c, points, hess):
    """Lower half of the Hessian (1 + r, 1 + r) at the slopes points[0] (m,); beta = 0: the slide is given."""
    psi, kappa = c.psi, c.kappa
    m, r = c.weight.size, kappa.size
    total = 0.0
    for j in range(m):
        total += points[0, j]
    hess[0, 0] = 1 / beta + total if beta > 0 else 1.0
    for k in range(r):
        total = 0.0
        for j in range(m):
            points[1, j] = points[0, j] * psi[k, j]
            total += points[1, j]
        hess[k + 1, 0] = -total if beta > 0 else 0.0
        for l in range(k + 1):
            dot = 0.0
            for j in range(m):
                dot += points[1, j] * psi[l, j]
            hess[k + 1, l + 1] = dot
        hess[k + 1, k + 1] += 0.5 * kappa[k]


@njit(error_model="numpy", **LEAN)
def cholesky_solve(a, b):
    """Solve a x = b in place for a small symmetric positive definite a (lower part used); x replaces b."""
    n = b.size
    for j in range(n):
        for k in range(j):
            a[j, j] -= a[j, k] * a[j, k]
        if a[j, j] <= 0:
            return False
        a[j, j] = np.sqrt(a[j, j])
        for i in range(j + 1, n):
            for k in range(j):
                a[i, j] -= a[i, k] * a[j, k]
            a[i, j] /= a[j, j]
    for i in range(n):
        for k in range(i):
            b[i] -= a[i, k] * b[k]
        b[i] /= a[i, i]
    for i in range(n - 1, -1, -1):
        for k in range(i + 1, n):
            b[i] -= a[k, i] * b[k]
        b[i] /= a[i, i]
    return True


@njit(error_model="numpy", **LEAN)
def weighted(out, scale):
    """Largest residual in force units: modal residuals are multiplied by the slide they stand for."""
    worst = abs(out[0])
    for k in range(1, out.size):
        worst = max(worst, abs(out[k]) * scale[k])
    return worst


@njit(error_model="numpy", **LEAN)
def descend(free, beta, c, goal):
    """Newton with step halving on y = (dq, db) in place. Returns (F, iterations), iterations < 0 when it failed."""
    y, out, hess, trial, other, scale, eps = c.y, c.out, c.hess, c.trial, c.other, c.scale, c.eps[1]
    force = residual(y, free, beta, c, eps, out, c.points)
    size = weighted(out, scale)
    for count in range(1, 60):
        if size <= goal:
            return force, count
        hessian(beta, c, c.points, hess)
        if not cholesky_solve(hess, out):
            return force, -count
        part = 1.0
        for _ in range(30):
            for i in range(y.size):
                trial[i] = y[i] - part * out[i]
            force = residual(trial, free, beta, c, eps, other, c.points)
            new = weighted(other, scale)
            if new < (1 - 0.1 * part) * size or new <= goal:
                break
            part *= 0.5
        for i in range(y.size):
            y[i] = trial[i]
            out[i] = other[i]
        if new >= size and part < 1e-8:
            return force, count if new <= 100 * goal else -count
        size = new
    return force, -60


@njit(error_model="numpy", **LEAN)
def expect(c, v, dt):
    """The guess of a step: its bond length and increments as the last two went on."""
    c.eps[1] = grow(c.eps[0], v, v, abs(v) * dt / 2, dt / 2, c.growth)[0]
    for i in range(c.y.size):
        c.y[i] = 2 * c.last[0, i] - c.last[1, i]


@njit(error_model="numpy", **LEAN)
def solve(free, beta, q, v, dt, c, goal):
    """(dq, path-mean force, iterations) of a step with dq = free - beta force; iterations < 0 when it failed."""
    expect(c, v, dt)
    force, count = descend(free, beta, c, goal)
    if count < 0:
        c.y[:] = 0.0
        c.y[0] = free
        force, count = descend(free, beta, c, goal)
    return c.y[0], force, count


@njit(error_model="numpy", **LEAN)
def given(dq, q, v, dt, c, goal):
    """(path-mean force, whether it was found) over a slide increment that is prescribed."""
    expect(c, v, dt)
    c.y[0] = dq
    force, count = descend(dq, 0.0, c, goal)
    return force, count >= 0


@njit(error_model="numpy", **LEAN)
def commit(dq, force, q, v0, v1, dt, c):
    """Move points and pieces by the solved step; (energy dissipated [J], True)."""
    y, weight, bonds, psi, b, lost = c.y, c.weight, c.bonds, c.psi, c.b, 0.0
    for i in range(y.size):
        c.last[1, i] = c.last[0, i]
        c.last[0, i] = y[i]
    for j in range(weight.size):
        xi = dq
        for k in range(b.size):
            xi -= psi[k, j] * y[k + 1]
        if bonds.shape[0] > 4:
            bonds[0, j], bonds[1, j], bonds[2, j], bonds[4, j], part = loose_step(
                bonds[0, j], bonds[1, j], bonds[2, j], bonds[4, j], c.growth[5] * c.eps[1], xi, c.source[j], c.eps[1])
        else:
            bonds[0, j], bonds[1, j], bonds[2, j], part = bond_step(bonds[0, j], bonds[1, j], bonds[2, j], xi,
                                                                    c.source[j], c.eps[1])
        lost += weight[j] * part / 2
        bonds[3, j] += xi
    for k in range(b.size):
        b[k] += y[k + 1]
    c.eps[0] = grow(c.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
    return lost, True


@njit(error_model="numpy", **LEAN)
def state(c, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) of points and pieces as they stand."""
    weight, bonds, source, kappa, b = c.weight, c.bonds, c.source, c.kappa, c.b
    force, energy, slip, total = 0.0, 0.0, 0.0, 0.0
    for j in range(weight.size):
        force += weight[j] * bonds[1, j]
        energy += 0.5 * weight[j] * bonds[2, j]
        share = weight[j] * source[j]
        if bonds[0, j] > 0:
            slip += share * (bonds[3, j] - bonds[1, j] / bonds[0, j])
            total += share
    for k in range(b.size):
        energy += 0.5 * kappa[k] * b[k] ** 2
    return force, energy, slip / total if total > 0 else q


@njit(error_model="numpy", **LEAN)
def hold(c, force):
    """Nothing: what holds is in the points."""
