"""The loop of parallel Jenkins elements: nothing of the other contacts is carried along, so a step is twice as fast."""

import numpy as np
from numba import njit

from ...friction.flags_kernels import LEAN
from ...friction.laws.elastic_plastic_kernels import jenkins_mean, jenkins_step
from ..modal_kernels import free_slide, move, note, push_back, safe_point, sample, stored, tell


@njit(error_model="numpy", **LEAN)
def solve_jenkins(free, beta, guess, stretch, stiffness, limit, bound, goal):
    """(dq, mean force, iterations) with dq = free - beta F(dq), |F| <= bound [N]: Newton's steps kept in a bracket;
    iterations < 0 when it failed."""
    low, high = free - beta * bound, free + beta * bound
    dq, force = min(max(guess, low), high), 0.0
    for count in range(1, 200):
        force, slope = jenkins_mean(dq, stretch, stiffness, limit)
        miss = dq - free + beta * force
        if abs(miss) <= goal * beta or high - low <= 4e-16 * (abs(free) + beta * bound):
            return dq, force, count
        if miss > 0:
            high = dq
        else:
            low = dq
        dq = safe_point(low, high, dq - miss / (1 + beta * slope))
    return dq, force, -200


@njit(error_model="numpy", cache=True)
def march_jenkins(first, steps, state, modes, prop, table, mass, stretch, stiffness, limit, now, last, bound, goal,
                  travel, ledger, rows):
    """`loop_kernels.march` of elements (t,); now (3,): force, energy and mean stretch; last (2,): slides moved."""
    omega, _, slide, _, output, _ = modes
    free_map, push, dense, reach, loss, dense_loss, _, beta = prop
    n, around = slide.size, table.shape[0]
    accel, spare = np.empty(n), np.empty((2, n))
    for i in range(steps + 1):
        q, _, out = sample(rows[i], state, slide, output)
        status = note(rows[i], now[0], now[1], q - now[2], out, travel, now[1] + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        free = free_slide(state, reach, 0, table, at)
        dq, _, count = solve_jenkins(free, beta, 2 * last[0] - last[1], stretch, stiffness, limit, bound, goal)
        last[1], last[0] = last[0], dq
        used = (free - dq) / beta
        tell(count, used * dq, ledger)
        push_back(used, slide, mass, accel)
        move(state, free_map, push, loss, dense, dense_loss, table, at, accel, spare, ledger)
        rows[i, 2 * n + 4] = used
        ledger[3] += jenkins_step(dq, stretch, stiffness, limit, now)
    return steps, 0
