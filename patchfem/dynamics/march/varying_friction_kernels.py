"""Friction of a rigid slide under a load that changes in time, compiled: its force in a step, its memory.

Kinds: 0 Coulomb, 4 a force that follows the speed, on the resultant load; 1 elastic-plastic and 2 bonds of the stretch
reading with p = 1, point by point under the nodal force. As on a bench: half of the change of load, the slide under
the mean load, the other half. A changing load alone never gives energy, and no point keeps more than mu times its load.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import bond_mean, bond_step, grow
from ...friction.flags_kernels import LEAN
from ..modal_kernels import safe_point

COULOMB, PLASTIC, POINTS, RATE = 0, 1, 2, 4


class Rub(NamedTuple):
    """force (4,): mu_s, mu_k (v_0 of a rate law), bond length [m], initial density m_0; memory (3, m): elastic-plastic
    traction/mu and springs [N]; bonds m, z, s2 [N, N m, N m2]; half (3, m): the same after half of the change of load;
    before, now (m,): nodal forces at the ends of the step [N]; middle, eps (1,): bond length in the step and at its
    start; growth (6,) of eq. 2.10. Pieces that give way in shear: psi (m, r), kappa (r,) [N/m], b (r,) their
    coordinates, none of rigid ones; y (1 + r,) increments of slide and coordinates, the scratch of their solve."""

    force: np.ndarray
    memory: np.ndarray
    half: np.ndarray
    before: np.ndarray
    now: np.ndarray
    middle: np.ndarray
    eps: np.ndarray
    growth: np.ndarray
    psi: np.ndarray
    kappa: np.ndarray
    b: np.ndarray
    y: np.ndarray
    last: np.ndarray
    rest: np.ndarray
    room: np.ndarray
    hess: np.ndarray
    ready: np.ndarray
    slope: np.ndarray
    under: np.ndarray
    scale: np.ndarray


@njit(error_model="numpy", **LEAN)
def local_slide(j, dq, psi, y):
    """Slide [m] of point j where the holder slides by dq and the pieces give way by y[1:]."""
    for k in range(psi.shape[1]):
        dq -= psi[j, k] * y[k + 1]
    return dq


@njit(error_model="numpy", **LEAN)
def press_point(m, z, s2, s0, s1, initial, length):
    """Bonds of one point after a change of its load at rest (twin: `recursion.pressed`)."""
    if s1 >= s0:
        return m + initial * (s1 - s0), z, s2
    left = m * s1 / s0
    least = z * z / s2 if s2 > 0 else 0.0
    keep = left / least if least > left else 1.0
    bound = length * s1
    if keep * abs(z) > bound:
        keep = bound / abs(z)
    return left, z * keep, s2 * keep


@njit(error_model="numpy", **LEAN)
def press_springs(y, springs, sigma):
    """(traction/mu, springs) of one point under another load (twin: `local.ElasticPlastic`)."""
    return min(max(y, -sigma), sigma), max(springs, sigma) if sigma > 0 else 0.0


@njit(error_model="numpy", **LEAN)
def spring_mean(y, springs, sigma, dq, length):
    """(path-mean traction/mu [N], its slope [N/m]) of one point."""
    rate = springs / length
    y1 = y + rate * dq
    bound = min(max(y1, -sigma), sigma)
    if bound == y1:
        return 0.5 * (y + y1), 0.5 * rate
    part = (bound - y) / (rate * dq)
    return part * 0.5 * (y + bound) + (1 - part) * bound, 0.5 * rate * part * part


@njit(error_model="numpy", **LEAN)
def spring_step(y, springs, sigma, dq, length):
    """(traction/mu, springs) of one point after the slide dq under `sigma`."""
    move = springs * dq / length
    y1 = y + move
    bound = min(max(y1, -sigma), sigma)
    part = 1.0 if bound == y1 else (bound - y) / move
    left = min(sigma, springs)
    return bound, left + (springs - left) * np.exp(-(1 - part) * abs(dq) / length)


@njit(error_model="numpy", **LEAN)
def press_all(kind, rub):
    """The memory after half of the change of load, in `half`."""
    if kind == PLASTIC:
        for j in range(rub.now.size):
            rub.half[0, j], rub.half[1, j] = press_springs(rub.memory[0, j], rub.memory[1, j],
                                                           0.5 * (rub.before[j] + rub.now[j]))
    elif kind == POINTS:
        for j in range(rub.now.size):
            rub.half[0, j], rub.half[1, j], rub.half[2, j] = press_point(
                rub.memory[0, j], rub.memory[1, j], rub.memory[2, j], rub.before[j],
                0.5 * (rub.before[j] + rub.now[j]), rub.force[3], rub.force[2])


@njit(error_model="numpy", **LEAN)
def rub_force(dq, kind, rub, mean, dt):
    """Path-mean friction force [N] and slope [N/m] of a rigid slide increment."""
    mu, length = rub.force[0], rub.force[2]
    if kind == RATE:
        part = np.tanh(dq / (dt * rub.force[1]))
        return mu * mean * part, mu * mean * (1 - part * part) / (dt * rub.force[1])
    force, slope = 0.0, 0.0
    if kind == PLASTIC:
        for j in range(rub.now.size):
            load = 0.5 * (rub.before[j] + rub.now[j])
            if load > 0:
                f, s = spring_mean(rub.half[0, j], rub.half[1, j], load, dq, length)
                force += mu * f
                slope += mu * s
        return force, slope
    for j in range(rub.now.size):
        load = 0.5 * (rub.before[j] + rub.now[j])
        if load > 0:
            f, s = bond_mean(rub.half[0, j], rub.half[1, j], dq, load, rub.middle[0])
            force += mu / length * f
            slope += mu / length * s
    return force, slope


@njit(error_model="numpy", **LEAN)
def rub_solve(free, beta, v0, dt, kind, rub, mean, goal, guess):
    """Slide increment with dq = free - beta F(dq) under the mean load. Returns (dq, F, iterations), < 0: failed."""
    if kind == POINTS:
        rub.middle[0] = grow(rub.eps[0], v0, v0, abs(v0) * dt / 2, dt / 2, rub.growth)[0]
    if beta == 0.0:
        return free, rub_force(free, kind, rub, mean, dt)[0] if kind != COULOMB else 0.0, 1
    if kind == COULOMB:
        if abs(free) <= beta * rub.force[0] * mean:
            return 0.0, free / beta, 1
        force = rub.force[1] * mean * (1.0 if free > 0 else -1.0)
        return free - beta * force, force, 1
    dq = free - beta * guess
    force, slope = rub_force(dq, kind, rub, mean, dt)
    low, high = -np.inf, np.inf
    for count in range(1, 200):
        miss = dq - free + beta * force
        if abs(miss) <= 1e-3 * goal * beta or abs(miss) <= 4e-16 * (abs(free) + beta * abs(force)):
            return dq, (free - dq) / beta, count
        if miss > 0:
            high = dq
        else:
            low = dq
        dq -= miss / (1 + beta * max(slope, 0.0))
        if count > 8:
            bound = beta * (1.5 * rub.force[0] * mean + abs(force))
            dq = safe_point(max(low, free - bound), min(high, free + bound), dq)
            if count > 40 and count % 2:
                dq = 0.5 * (max(low, free - bound) + min(high, free + bound))
            if high - low <= 4e-16 * (abs(free) + bound):
                return dq, (free - dq) / beta, count if abs(miss) <= goal * beta else -count
        force, slope = rub_force(dq, kind, rub, mean, dt)
    return dq, (free - dq) / beta, -200


@njit(error_model="numpy", **LEAN)
def give_way(rub):
    """Move the coordinates of the pieces by the solved step and leave the next guess in y."""
    y, last = rub.y, rub.last
    for k in range(rub.b.size):
        rub.b[k] += y[k + 1]
    for k in range(y.size):
        here = y[k]
        y[k] = 2 * here - last[k]
        last[k] = here
    rub.ready[:] = 0.0


@njit(error_model="numpy", **LEAN)
def rub_commit(dq, used, v0, v1, dt, kind, rub):
    """Move the memory by the solved step; returns the energy dissipated [J], that of the changing load included."""
    if kind == COULOMB or kind == RATE:
        return used * dq
    mu, length, memory, half = rub.force[0], rub.force[2], rub.memory, rub.half
    before = held_energy(kind, rub, memory)
    if kind == PLASTIC:
        for j in range(rub.now.size):
            load = 0.5 * (rub.before[j] + rub.now[j])
            y, springs = half[0, j], half[1, j]
            if load > 0:
                y, springs = spring_step(y, springs, load, local_slide(j, dq, rub.psi, rub.y), length)
            memory[0, j], memory[1, j] = press_springs(y, springs, rub.now[j])
        give_way(rub)
        return used * dq + before - held_energy(kind, rub, memory)
    dissipated = before - held_energy(kind, rub, half)
    for j in range(rub.now.size):
        load = 0.5 * (rub.before[j] + rub.now[j])
        m, z, s2 = half[0, j], half[1, j], half[2, j]
        if load > 0:
            m, z, s2, part = bond_step(m, z, s2, local_slide(j, dq, rub.psi, rub.y), load, rub.middle[0])
            dissipated += 0.5 * mu / length * part
        memory[0, j], memory[1, j], memory[2, j] = press_point(m, z, s2, load, rub.now[j], rub.force[3], length)
        dissipated += 0.5 * mu / length * (s2 - memory[2, j])
    give_way(rub)
    rub.eps[0] = grow(rub.eps[0], v0, v1, abs(dq), dt, rub.growth)[0]
    return dissipated


@njit(error_model="numpy", **LEAN)
def held_energy(kind, rub, memory):
    """Elastic energy of a memory and of the pieces [J]."""
    out, mu, length = 0.0, rub.force[0], rub.force[2]
    for k in range(rub.b.size):
        out += 0.5 * rub.kappa[k] * rub.b[k] * rub.b[k]
    for j in range(memory.shape[1]):
        if kind == PLASTIC:
            if memory[1, j] > 0:
                out += 0.5 * mu * length * memory[0, j] * memory[0, j] / memory[1, j]
        else:
            out += 0.5 * mu / length * memory[2, j]
    return out


@njit(error_model="numpy", **LEAN)
def bend(j, rub):
    """Slide [m] of point j that the pieces take."""
    out = 0.0
    for k in range(rub.b.size):
        out += rub.psi[j, k] * rub.b[k]
    return out


@njit(error_model="numpy", **LEAN)
def rub_state(kind, rub, q, held):
    """(friction force [N], stored energy [J], irreversible slip [m]) as they stand."""
    if kind == COULOMB or kind == RATE:
        return held, 0.0, q
    mu, length, memory = rub.force[0], rub.force[2], rub.memory
    force, slip, total = 0.0, 0.0, 0.0
    for j in range(memory.shape[1]):
        if kind == PLASTIC:
            force += mu * memory[0, j]
            stretch = length * memory[0, j] / memory[1, j] if memory[1, j] > 0 else 0.0
        else:
            force += mu / length * memory[1, j]
            stretch = memory[1, j] / memory[0, j] if memory[0, j] > 0 else 0.0
        if rub.now[j] > 0:
            slip += rub.now[j] * (q - stretch - bend(j, rub))
            total += rub.now[j]
    return force, held_energy(kind, rub, memory), slip / total if total > 0 else q
