"""The loop of bond points whose pressure stays on the lower piece: what forms under them depends on where they are."""

import numpy as np
from numba import njit

from ...friction.flags_kernels import LEAN
from ..modal_kernels import free_slide, move, note, push_back, sample, stored, tell
from .step_kernels import POINTS, commit, contact_state, contact_step, pressure_at


@njit(error_model="numpy", **LEAN)
def sources(c, q0, dq):
    """Pressure under the new bonds when it stays on the lower piece: mean of the places at the ends of the step."""
    for j in range(c.source.size):
        here = c.place[j] + q0
        c.source[j] = 0.5 * (pressure_at(here, c.x, c.sigma) + pressure_at(here + dq, c.x, c.sigma))


@njit(error_model="numpy", cache=True)
def march_follow(first, steps, state, modes, prop, table, mass, c, work, goal, travel, ledger, rows):
    """`dynamics.march.loop_kernels.march` of bond points that slide under a pressure on the lower piece."""
    omega, _, slide, _, output, _ = modes
    free_map, push, dense, reach, loss, dense_loss, dt, beta = prop
    n = slide.size
    around = table.shape[0]
    accel, spare = np.empty(n), np.empty((2, n))
    for i in range(steps + 1):
        q, v, out = sample(rows[i], state, slide, output)
        force, energy, slip = contact_state(POINTS, c, q, 0.0)
        status = note(rows[i], force, energy, slip, out, travel, energy + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        free = free_slide(state, reach, 0, table, at)
        dq, force, count, middle, change = 0.0, 0.0, 0, 0.0, 0.0
        guess = free if abs(free) < 1e-3 else 0.0
        for _ in range(21):
            sources(c, q, guess)
            dq, force, count, middle = contact_step(free, beta, v, dt, POINTS, c, work, goal)
            change = abs(dq - guess)
            guess = dq
            if change <= 1e-12 * (abs(dq) + 1e-12):
                break
        if change > max(1e-12 * (abs(dq) + 1e-12), beta * goal):
            count = -abs(count)  # place and pressure still disagree: booked as a missed step
        used = (free - dq) / beta
        tell(count, used * dq, ledger)
        push_back(used, slide, mass, accel)
        move(state, free_map, push, loss, dense, dense_loss, table, at, accel, spare, ledger)
        v1 = 0.0
        for k in range(n):
            v1 += slide[k] * state[1, k]
        rows[i, 2 * n + 4] = used
        burnt, ok = commit(dq, used, v, v1, dt, POINTS, c, work, middle, q, True)
        ledger[3] += burnt
        if not ok:
            return i, 2
    return steps, 0
