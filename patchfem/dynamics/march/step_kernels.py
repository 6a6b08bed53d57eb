"""One step of a contact, compiled: its memory, the solve for the slide increment and the commit.

A contact is one of five kinds, chosen by an integer outside the point loop:
0 rigid Coulomb (set-valued), 1 parallel Jenkins elements, 2 bond points with shear modes (possibly none),
3 one shared bond list, whose steps stand in `dynamics.march.bond_list_kernels`,
4 a force that follows the speed (eq. 2.4). Over a
step the modes move exactly under the path-mean of the friction force along the straight increment of slide, which does
exactly the work of the law: the sum of all energies never rises by itself.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step, rigid_mean, rigid_step
from ...friction.flags_kernels import FAST, LEAN
from ...friction.laws.elastic_plastic_kernels import jenkins_mean, jenkins_step
from ..modal_kernels import safe_point

COULOMB, JENKINS, POINTS, LIST, RATE = 0, 1, 2, 3, 4


class Contact(NamedTuple):
    """Memory and numbers of a contact; a kind leaves the arrays it does not use empty.

    force: (static or scale, kinetic, bound) [N]; of a rate law (limit [N], v_0 [m/s], limit). Jenkins: stretch,
    stiffness, limit (t,), now (3,) = force, energy, mean stretch. Points: weight (m,) = mu_s area/eps_0, bonds (4, m)
    = m, z, s2, local slide, and play (5, m) where bonds stretch freely over the share growth[5] of their length;
    source (m,), shear modes psi (r, m), kappa (r,), b (r,).
    List: bondlist (10, capacity), now (6,), tally (12,), law (24,), table (k,) as in friction.bonds.bond_kernels.
    growth of eq. 2.10.
    Pressure that stays on the lower piece: place (m,), x, sigma.
    """

    force: np.ndarray
    stretch: np.ndarray
    stiffness: np.ndarray
    limit: np.ndarray
    weight: np.ndarray
    bonds: np.ndarray
    source: np.ndarray
    psi: np.ndarray
    kappa: np.ndarray
    b: np.ndarray
    bondlist: np.ndarray
    now: np.ndarray
    tally: np.ndarray
    law: np.ndarray
    table: np.ndarray
    growth: np.ndarray
    place: np.ndarray
    x: np.ndarray
    sigma: np.ndarray


class Work(NamedTuple):
    """Scratch of the step solve: y = (dq, db), residual, Hessian, points (3, m), trial point, scales, last two steps,
    eps."""

    y: np.ndarray
    out: np.ndarray
    hess: np.ndarray
    points: np.ndarray
    trial: np.ndarray
    other: np.ndarray
    scale: np.ndarray
    last: np.ndarray
    eps: np.ndarray


class Modes(NamedTuple):
    """omega, damp = 2 zeta omega, slide, base, output: (n,); damping (n, n) where it couples, else (0, 0)."""

    omega: np.ndarray
    damp: np.ndarray
    slide: np.ndarray
    base: np.ndarray
    output: np.ndarray
    damping: np.ndarray


class Steps(NamedTuple):
    """Arrays of `dynamics.propagator.Propagator`, dt [s] and the beta [m/N] of one interface."""

    free: np.ndarray
    push: np.ndarray
    dense: np.ndarray
    reach: np.ndarray
    loss: np.ndarray
    dense_loss: np.ndarray
    dt: float
    beta: float


@njit(error_model="numpy", **LEAN)
def pressure_at(place, x, sigma):
    """Pressure [Pa] of the pattern sigma (m,) on x (m,) at one place, linear between nodes, 0 outside."""
    if place < x[0] or place > x[-1]:
        return 0.0
    j = min(np.searchsorted(x, place, side="right") - 1, x.size - 2)
    part = (place - x[j]) / (x[j + 1] - x[j])
    return (1 - part) * sigma[j] + part * sigma[j + 1]


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def point_mean(c, j, dq, eps):
    """Path-mean stretch [Pa m] of point j and its slope [Pa]."""
    if c.bonds.shape[0] > 4:
        return loose_mean(c.bonds[0, j], c.bonds[1, j], c.bonds[4, j], c.growth[5] * eps, dq, c.source[j], eps)
    return bond_mean(c.bonds[0, j], c.bonds[1, j], dq, c.source[j], eps)


@njit(error_model="numpy", **LEAN)
def scalar_force(dq, kind, c, eps, dt):
    """Path-mean friction force [N] and slope [N/m] for a rigid slide increment; `c` is the contact tuple."""
    if kind == JENKINS:
        return jenkins_mean(dq, c.stretch, c.stiffness, c.limit)
    if kind == RATE:
        part = np.tanh(dq / (dt * c.force[1]))
        return c.force[0] * part, c.force[0] * (1 - part * part) / (dt * c.force[1])
    force, slope = 0.0, 0.0
    weight = c.weight
    if c.bonds.shape[0] == 4:
        return rigid_mean(dq, weight, c.bonds, c.source, eps)
    for j in range(weight.size):
        mean, s = point_mean(c, j, dq, eps)
        force += weight[j] * mean
        slope += weight[j] * s
    return force, slope


@njit(error_model="numpy", **LEAN)
def solve_scalar(free, beta, guess, kind, c, eps, dt, goal):
    """Slide increment with dq = free - beta F(dq). Returns (dq, F, iterations), iterations < 0 when it failed.

    Newton from the guess; where it wanders, Newton inside a bracket that is widened until it holds the root.
    """
    dq = guess
    force, slope = scalar_force(dq, kind, c, eps, dt)
    for count in range(1, 9):
        miss = dq - free + beta * force
        if abs(miss) <= goal * beta:
            return dq, force, count
        dq -= miss / (1 + beta * max(slope, 0.0))
        force, slope = scalar_force(dq, kind, c, eps, dt)
    low, high = free - beta * c.force[2], free + beta * c.force[2]
    for _ in range(60):
        if low - free + beta * scalar_force(low, kind, c, eps, dt)[0] <= 0:
            break
        low -= beta * c.force[2]
    for _ in range(60):
        if high - free + beta * scalar_force(high, kind, c, eps, dt)[0] >= 0:
            break
        high += beta * c.force[2]
    dq = safe_point(low, high, dq)
    for count in range(9, 300):
        force, slope = scalar_force(dq, kind, c, eps, dt)
        miss = dq - free + beta * force
        if abs(miss) <= goal * beta or high - low <= 4e-16 * (abs(free) + beta * c.force[2]):
            return dq, force, count
        if miss > 0:
            high = dq
        else:
            low = dq
        dq = safe_point(low, high, dq - miss / (1 + beta * max(slope, 0.0)))
        if count > 40 and count % 2:
            dq = 0.5 * (low + high)
    return dq, force, -count


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
def solve_modes(y, free, beta, c, eps, goal, work):
    """Newton with step halving on y = (dq, db) in place. Returns (F, iterations), iterations < 0 when it failed."""
    out, hess, trial, other, scale = work.out, work.hess, work.trial, work.other, work.scale
    force = residual(y, free, beta, c, eps, out, work.points)
    size = weighted(out, scale)
    for count in range(1, 60):
        if size <= goal:
            return force, count
        hessian(beta, c, work.points, hess)
        if not cholesky_solve(hess, out):
            return force, -count
        part = 1.0
        for _ in range(30):
            for i in range(y.size):
                trial[i] = y[i] - part * out[i]
            force = residual(trial, free, beta, c, eps, other, work.points)
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
def contact_step(free, beta, v0, dt, kind, c, work, goal):
    """Solve one step of the contact, leave its memory untouched. Returns (dq, path-mean force, iterations, eps).

    work: (y, out, hess, trial, other, scale, last (2, 1 + r), eps (1,)).
    """
    eps = work.eps[0]
    middle = grow(eps, v0, v0, abs(v0) * dt / 2, dt / 2, c.growth)[0] if kind == POINTS else eps
    if kind == COULOMB:
        static, kinetic = c.force[0], c.force[1]
        if abs(free) <= beta * static:
            return 0.0, free / beta, 1, middle
        force = kinetic if free > 0 else -kinetic
        return free - beta * force, force, 1, middle
    last = work.last
    y = work.y
    for i in range(y.size):
        y[i] = 2 * last[0, i] - last[1, i]
    if y.size == 1:
        dq, force, count = solve_scalar(free, beta, y[0], kind, c, middle, dt, goal)
        y[0] = dq
        return dq, force, count, middle
    force, count = solve_modes(y, free, beta, c, middle, goal, work)
    if count < 0:
        y[:] = 0.0
        y[0] = free
        force, count = solve_modes(y, free, beta, c, middle, goal, work)
    return y[0], force, count, middle


@njit(error_model="numpy", **LEAN)
def commit(dq, force, v0, v1, dt, kind, c, work, middle, q0, follow):
    """Move the memory of the contact by the solved step. Returns (energy dissipated [J], ok)."""
    y, last = work.y, work.last
    for i in range(y.size):
        last[1, i] = last[0, i]
        last[0, i] = y[i]
    if kind == COULOMB or kind == RATE:
        return force * dq, True
    if kind == JENKINS:
        return jenkins_step(dq, c.stretch, c.stiffness, c.limit, c.now), True
    weight, bonds, source, psi, b = c.weight, c.bonds, c.source, c.psi, c.b
    if b.size == 0 and bonds.shape[0] == 4 and not follow:
        burnt = rigid_step(dq, weight, bonds, source, middle)
        work.eps[0] = grow(work.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
        return burnt, True
    burnt = 0.0
    for j in range(weight.size):
        xi = dq
        for k in range(b.size):
            xi -= psi[k, j] * y[k + 1]
        if bonds.shape[0] > 4:
            m, z, s2, play, part = loose_step(bonds[0, j], bonds[1, j], bonds[2, j], bonds[4, j], c.growth[5] * middle,
                                              xi, source[j], middle)
            bonds[4, j] = play
        else:
            m, z, s2, part = bond_step(bonds[0, j], bonds[1, j], bonds[2, j], xi, source[j], middle)
        burnt += weight[j] * part / 2
        if follow and pressure_at(c.place[j] + q0 + dq, c.x, c.sigma) <= 0:
            burnt += weight[j] * s2 / 2
            m, z, s2 = 0.0, 0.0, 0.0
        bonds[0, j], bonds[1, j], bonds[2, j] = m, z, s2
        bonds[3, j] += xi
    for k in range(b.size):
        b[k] += y[k + 1]
    work.eps[0] = grow(work.eps[0], v0, v1, abs(dq), dt, c.growth)[0]
    return burnt, True


@njit(error_model="numpy", cache=True, **LEAN)
def contact_state(kind, c, q, held):
    """(friction force [N], stored energy [J], irreversible slip [m]) of the contact as it stands."""
    if kind == COULOMB or kind == RATE:
        return held, 0.0, q
    if kind == JENKINS:
        return c.now[0], c.now[1], q - c.now[2]
    if kind == LIST:
        force = c.force[0] * c.tally[5]
        return force, c.force[0] * c.tally[4], q - force * c.law[2] / c.force[0] if c.force[0] > 0 else q
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
