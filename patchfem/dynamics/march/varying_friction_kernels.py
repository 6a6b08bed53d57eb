"""Friction of a rigid slide under a load that changes in time, compiled: its force in a step, its memory.

Kinds: 0 Coulomb, 4 a force that follows the speed, on the resultant load; 1 elastic-plastic and 2 bonds of the stretch
reading with p = 1, point by point under the nodal force. As on a bench: half of the change of load, the slide under
the mean load, the other half. A changing load alone never gives energy, and no point keeps more than mu times its load.
It leaves the points out of balance with pieces that give way in shear, which a mean alone would keep and turn about in
every step; so a step ends with the pieces springing back while the holder stands.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.bonds.point_kernels import bond_step, grow
from ...friction.flags_kernels import LEAN
from ..contacts.shear_points_kernels import DENSITY, LOAD, PLASTIC, POINTS, SLIDE, SLOPE, SQUARE, STRETCH, respond
from ..contacts.shear_solve_kernels import descend, halfway, slid, went_on
from ..modal_kernels import safe_point

COULOMB, RATE = 0, 4
TIGHT = 0.01  # share of the goal down to which pieces that give way are solved: their loss is a small difference


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
def spring_step(y, springs, sigma, dq, length):
    """(traction/mu, springs) of one point after the slide dq under `sigma`."""
    move = springs * dq / length
    y1 = y + move
    bound = min(max(y1, -sigma), sigma)
    part = 1.0 if bound == y1 else (bound - y) / move
    left = min(sigma, springs)
    return bound, left + (springs - left) * np.exp(-(1 - part) * abs(dq) / length)


@njit(error_model="numpy", **LEAN)
def load_points(part, rub):
    """Gather the points under load that share of the way through the step, their loads and the modes there."""
    count, under, same = 0, rub.under, True
    for j in range(rub.now.size):
        load = (1 - part) * rub.before[j] + part * rub.now[j]
        if load > 0.0:
            same = same and under[count] == j
            under[count] = j
            rub.points[LOAD, count] = load
            count += 1
    if not same or rub.count[0] < count:
        for k in range(rub.kappa.size):
            for i in range(count):
                rub.psi[k, i] = rub.modes[k, under[i]]
    rub.count[0] = count


@njit(error_model="numpy", **LEAN)
def press_all(kind, rub):
    """The memory after half of the change of load, and the mean load, in the points."""
    if kind == COULOMB or kind == RATE:
        return
    load_points(0.5, rub)
    memory, points = rub.memory, rub.points
    for i in range(rub.count[0]):
        j = rub.under[i]
        if kind == PLASTIC:
            points[DENSITY, i], points[STRETCH, i] = press_springs(memory[0, j], memory[1, j], points[LOAD, i])
        else:
            points[DENSITY, i], points[STRETCH, i], points[SQUARE, i] = press_point(
                memory[0, j], memory[1, j], memory[2, j], rub.before[j], points[LOAD, i], rub.force[3], rub.force[2])


@njit(error_model="numpy", **LEAN)
def rub_force(dq, kind, rub, mean, dt):
    """Path-mean friction force [N] and slope [N/m] of a rigid slide increment."""
    if kind == RATE:
        mu, part = rub.force[0], np.tanh(dq / (dt * rub.force[1]))
        return mu * mean * part, mu * mean * (1 - part * part) / (dt * rub.force[1])
    slid(dq, rub.b, rub)
    force, slope = respond(kind, False, rub), 0.0
    for i in range(rub.count[0]):
        slope += rub.points[SLOPE, i]
    return force, slope


@njit(error_model="numpy", **LEAN)
def rub_solve(free, beta, v0, dt, kind, rub, mean, goal, guess):
    """Slide increment with dq = free - beta F(dq) under the mean load. Returns (dq, F, iterations), < 0: failed."""
    if kind == POINTS:
        halfway(v0, dt, rub)
    if rub.b.size:
        if beta == 0.0:
            rub.y[0, 0] = free
        force, count = descend(free, beta, kind, False, rub, TIGHT * goal)
        return rub.y[0, 0], (free - rub.y[0, 0]) / beta if beta > 0.0 else force, count
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
def rub_commit(dq, used, v0, v1, dt, kind, rub):
    """Move the memory by the solved step; returns the energy dissipated [J], that of the changing load included."""
    if kind == COULOMB or kind == RATE:
        return used * dq
    length, memory, points = rub.force[2], rub.memory, rub.points
    lost = used * dq + held_energy(kind, rub) if kind == PLASTIC else 0.0
    for i in range(rub.count[0]):
        j, load, xi = rub.under[i], points[LOAD, i], points[SLIDE, i]
        if kind == PLASTIC:
            y, springs = spring_step(points[DENSITY, i], points[STRETCH, i], load, xi, length)
            memory[0, j], memory[1, j] = press_springs(y, springs, rub.now[j])
        else:
            lost += 0.5 * rub.weight[i] * (memory[2, j] - points[SQUARE, i])
            m, z, s2, part = bond_step(points[DENSITY, i], points[STRETCH, i], points[SQUARE, i], xi, load, rub.eps[1])
            memory[0, j], memory[1, j], memory[2, j] = press_point(m, z, s2, load, rub.now[j], rub.force[3], length)
            lost += 0.5 * rub.weight[i] * (part + s2 - memory[2, j])
    went_on(rub)
    if kind == PLASTIC:
        return lost - held_energy(kind, rub)
    rub.eps[0] = grow(rub.eps[0], v0, v1, abs(dq), dt, rub.growth)[0]
    return lost


@njit(error_model="numpy", **LEAN)
def spring_back(kind, rub, goal):
    """Bring pieces and points to balance while the holder stands, after the load of the step. Returns (energy lost [J],
    iterations), < 0: failed."""
    memory, points, y = rub.memory, rub.points, rub.y[1]
    load_points(1.0, rub)
    before = held_energy(kind, rub)
    for i in range(rub.count[0]):
        points[DENSITY, i], points[STRETCH, i] = memory[0, rub.under[i]], memory[1, rub.under[i]]
    y[:] = 0.0
    count = descend(0.0, 0.0, kind, True, rub, TIGHT * goal)[1]
    for i in range(rub.count[0]):
        j, load, xi = rub.under[i], points[LOAD, i], points[SLIDE, i]
        if kind == PLASTIC:
            a, b = spring_step(memory[0, j], memory[1, j], load, xi, rub.force[2])
            memory[0, j], memory[1, j] = press_springs(a, b, load)
        else:
            memory[0, j], memory[1, j], memory[2, j], _ = bond_step(memory[0, j], memory[1, j], memory[2, j], xi, load,
                                                                    rub.eps[0])
    for k in range(rub.b.size):
        rub.b[k] += y[k + 1]
    return before - held_energy(kind, rub), count


@njit(error_model="numpy", **LEAN)
def held_energy(kind, rub):
    """Elastic energy of the memory and of the pieces [J]."""
    out, mu, length, memory = 0.0, rub.force[0], rub.force[2], rub.memory
    for k in range(rub.b.size):
        out += 0.5 * rub.kappa[k] * rub.b[k] * rub.b[k]
    for i in range(rub.count[0]):
        j = rub.under[i]
        if kind == PLASTIC:
            if memory[1, j] > 0:
                out += 0.5 * mu * length * memory[0, j] * memory[0, j] / memory[1, j]
        else:
            out += 0.5 * mu / length * memory[2, j]
    return out


@njit(error_model="numpy", **LEAN)
def rub_state(kind, rub, q, held):
    """(friction force [N], stored energy [J], irreversible slip [m]) as they stand."""
    if kind == COULOMB or kind == RATE:
        return held, 0.0, q
    mu, length, memory, points = rub.force[0], rub.force[2], rub.memory, rub.points
    force, slip, total = 0.0, 0.0, 0.0
    load_points(1.0, rub)
    slid(q, rub.b, rub)
    for i in range(rub.count[0]):
        j = rub.under[i]
        if kind == PLASTIC:
            force += mu * memory[0, j]
            stretch = length * memory[0, j] / memory[1, j] if memory[1, j] > 0 else 0.0
        else:
            force += mu / length * memory[1, j]
            stretch = memory[1, j] / memory[0, j] if memory[0, j] > 0 else 0.0
        slip += points[LOAD, i] * (points[SLIDE, i] - stretch)
        total += points[LOAD, i]
    return force, held_energy(kind, rub), slip / total if total > 0 else q
