"""Elements with one slide each, as rows of one table: friction of an interface, springs that are not linear.

kinds as of a contact (COULOMB, JENKINS, POINTS with a single point, RATE), and CUBIC, SINE: springs with a potential V,
whose path-mean force is (V(q + dq) - V(q))/dq, so that they neither make nor lose energy at any step.
num (e, NUMBERS): COULOMB static, kinetic [N]; JENKINS limit [N], stiffness [N/m], limit [m]; POINTS limit [N], weight,
pressure, then growth (6,); RATE limit [N], v_0 [m/s]; CUBIC k_3 [N/m3]; SINE k [N/m], wavelength [m].
mem (e, MEMORY): stretch of JENKINS; m, z, s2, play, bond length of POINTS; last two slide increments; last force.
"""

from math import cos, pi, sin

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from ...friction.flags_kernels import LEAN
from ..modal_kernels import safe_point
from .step_kernels import COULOMB, JENKINS, POINTS, RATE

CUBIC, SINE = 5, 6
NUMBERS, MEMORY = 9, 8


@njit(error_model="numpy", **LEAN)
def element_mean(kind, num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] over an increment dq from the slide q, and its slope [N/m]; not for COULOMB."""
    if kind == JENKINS:
        start, k, most = mem[e, 0], num[e, 1], num[e, 2]
        end = start + dq
        bound = min(max(end, -most), most)
        if bound == end:
            return 0.5 * k * (start + end), 0.5 * k
        part = (bound - start) / dq
        return k * (0.5 * part * (start + bound) + (1 - part) * bound), 0.5 * k * part * part
    if kind == POINTS:
        scale, sigma = num[e, 1], num[e, 2]
        if num[e, 8] > 0:
            mean, slope = loose_mean(mem[e, 0], mem[e, 1], mem[e, 3], num[e, 8] * eps, dq, sigma, eps)
        else:
            mean, slope = bond_mean(mem[e, 0], mem[e, 1], dq, sigma, eps)
        return scale * mean, scale * slope
    if kind == RATE:
        part = np.tanh(dq / (dt * num[e, 1]))
        return num[e, 0] * part, num[e, 0] * (1 - part * part) / (dt * num[e, 1])
    if kind == CUBIC:
        b = q + dq
        return 0.25 * num[e, 0] * (b + q) * (b * b + q * q), 0.25 * num[e, 0] * (3 * b * b + 2 * b * q + q * q)
    turn = 2 * pi / num[e, 1]
    half, middle = 0.5 * turn * dq, turn * (q + 0.5 * dq)
    if abs(half) < 1e-4:
        ratio, bend = 1 - half * half / 6, -half / 3
    else:
        ratio = sin(half) / half
        bend = (cos(half) - ratio) / half
    size = num[e, 0] / turn
    return size * sin(middle) * ratio, 0.5 * num[e, 0] * (cos(middle) * ratio + sin(middle) * bend)


@njit(error_model="numpy", **LEAN)
def element_middle(kind, num, mem, e, v, dt, growth):
    """Bond length in the middle of the step [m], as of the solve; growth (6,): room."""
    if kind != POINTS:
        return 0.0
    for k in range(6):
        growth[k] = num[e, 3 + k]
    return grow(mem[e, 4], v, v, abs(v) * dt / 2, dt / 2, growth)[0]


@njit(error_model="numpy", **LEAN)
def element_solve(free, beta, kind, num, mem, e, q, eps, dt, guess, goal):
    """(dq, mean force, iterations) with dq = free - beta F(dq), iterations < 0 when it failed."""
    if kind == COULOMB:
        if abs(free) <= beta * num[e, 0]:
            return 0.0, free / beta, 1
        force = num[e, 1] if free > 0 else -num[e, 1]
        return free - beta * force, force, 1
    low, high, dq = -np.inf, np.inf, guess
    for count in range(1, 200):
        force, slope = element_mean(kind, num, mem, e, q, dq, eps, dt)
        miss = dq - free + beta * force
        if abs(miss) <= goal * beta + 4e-16 * (abs(free) + abs(dq)):  # the last digit of the slide
            return dq, force, count
        if miss > 0:
            high = min(high, dq)
        else:
            low = max(low, dq)
        if np.isfinite(low) and np.isfinite(high) and high - low <= 4e-16 * (abs(high) + abs(low)):
            return dq, force, count
        new = dq - miss / max(1 + beta * slope, 0.1)
        if np.isfinite(low) and np.isfinite(high):
            new = safe_point(low, high, new)
            if count > 40 and count % 2:
                new = 0.5 * (low + high)
        dq = new
    return dq, force, -200


@njit(error_model="numpy", **LEAN)
def element_commit(kind, num, mem, e, dq, force, v0, v1, dt, eps, growth):
    """Move the memory by the solved step; energy dissipated [J]."""
    mem[e, 6], mem[e, 5] = mem[e, 5], dq
    mem[e, 7] = force
    if kind == COULOMB or kind == RATE:
        return force * dq
    if kind == JENKINS:
        end = mem[e, 0] + dq
        mem[e, 0] = min(max(end, -num[e, 2]), num[e, 2])
        return num[e, 1] * mem[e, 0] * (end - mem[e, 0])
    if kind != POINTS:
        return 0.0
    sigma, burnt = num[e, 2], 0.0
    if num[e, 8] > 0:
        m, z, s2, mem[e, 3], burnt = loose_step(mem[e, 0], mem[e, 1], mem[e, 2], mem[e, 3], num[e, 8] * eps, dq, sigma,
                                                eps)
    else:
        m, z, s2, burnt = bond_step(mem[e, 0], mem[e, 1], mem[e, 2], dq, sigma, eps)
    mem[e, 0], mem[e, 1], mem[e, 2] = m, z, s2
    for k in range(6):
        growth[k] = num[e, 3 + k]
    mem[e, 4] = grow(mem[e, 4], v0, v1, abs(dq), dt, growth)[0]
    return num[e, 1] * burnt / 2


@njit(error_model="numpy", **LEAN)
def element_state(kind, num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) as the element stands at slide q, speed v."""
    if kind == COULOMB:
        return mem[e, 7], 0.0, q
    if kind == RATE:
        return num[e, 0] * np.tanh(v / num[e, 1]), 0.0, q
    if kind == JENKINS:
        return num[e, 1] * mem[e, 0], 0.5 * num[e, 1] * mem[e, 0] ** 2, q - mem[e, 0]
    if kind == POINTS:
        back = mem[e, 1] / mem[e, 0] if mem[e, 0] > 0 else 0.0
        return num[e, 1] * mem[e, 1], 0.5 * num[e, 1] * mem[e, 2], q - back
    if kind == CUBIC:
        return num[e, 0] * q ** 3, 0.25 * num[e, 0] * q ** 4, q
    turn = 2 * pi / num[e, 1]
    return num[e, 0] / turn * sin(turn * q), 2 * num[e, 0] * (sin(0.5 * turn * q) / turn) ** 2, q
