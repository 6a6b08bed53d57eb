"""The loop of a shared list of bonds: force, solve without a slope, commit, energy book."""

import numpy as np
from numba import njit

from ...friction.bonds.bond_kernels import list_mean, list_slope, list_step
from ...friction.bonds.bond_sum_kernels import MOMENTS
from ...friction.flags_kernels import LEAN
from ..modal_kernels import free_slide, move, note, push_back, sample, stored, tell


@njit(error_model="numpy", **LEAN)
def list_scalar(dq, c, v0, dt):
    """Path-mean force [N] and slope [N/m] of a bond list; a slope of zero stands for an unknown one."""
    scale = c.force[0]
    if c.law[1] == MOMENTS:
        force, slope = list_slope(dq, c.bondlist, c.tally, c.now, c.law, c.growth, v0, dt)
        return scale * force, scale * slope
    return scale * list_mean(dq, c.bondlist, c.tally, c.now, c.law, c.growth, c.table, v0, dt), 0.0


@njit(error_model="numpy", **LEAN)
def solve_list(free, beta, guess, c, v0, dt, goal):
    """Slide increment with dq = free - beta F(dq) without a slope: secants, then inside a bracket that is widened until
    it holds the root. Returns (dq, F, iterations), iterations < 0 when it failed."""
    force = list_scalar(guess, c, v0, dt)[0]
    here, miss = guess, guess - free + beta * force
    if abs(miss) <= goal * beta:
        return here, force, 1
    last, last_miss = here, miss
    low, high = (-np.inf, last) if miss > 0 else (last, np.inf)
    here -= miss / (1 + beta * c.force[0] / c.law[2])
    for count in range(2, 300):
        force = list_scalar(here, c, v0, dt)[0]
        new = here - free + beta * force
        if abs(new) <= goal * beta or high - low <= 4e-16 * (abs(free) + beta * c.force[2]):
            return here, force, count
        slope = (new - last_miss) / (here - last) if here != last else 1.0
        last, last_miss, miss = here, new, new
        if miss > 0:
            high = here
        else:
            low = here
        step = here - miss / slope if slope > 0.1 else here - miss
        if count > 8 and not np.isfinite(low):
            step = min(step, high - beta * c.force[2] * 2.0 ** min(count - 8, 60))
        if count > 8 and not np.isfinite(high):
            step = max(step, low + beta * c.force[2] * 2.0 ** min(count - 8, 60))
        if np.isfinite(low) and np.isfinite(high) and (not low < step < high or (count > 8 and count % 2)):
            step = 0.5 * (low + high)
        here = step
    return here, force, -300


@njit(error_model="numpy", **LEAN)
def commit_list(dq, force, v0, v1, dt, c):
    """Move the list by the solved step. Returns (work that is not stored [J], ok).

    That work is dissipated where positive; the printed law also creates energy, and both are summed apart.
    """
    before = c.tally[4]
    ok = list_step(dq, c.bondlist, c.tally, c.now, c.law, c.growth, c.table, v0, v1, dt)
    net = force * dq - c.force[0] * (c.tally[4] - before)
    if net < 0:
        c.tally[6] -= net
    else:
        c.tally[7] += net
    return net, ok


@njit(error_model="numpy", **LEAN)
def list_status(c, q):
    """(friction force [N], stored energy [J], irreversible slip [m]) of the list as it stands."""
    force = c.force[0] * c.tally[5]
    return force, c.force[0] * c.tally[4], q - force * c.law[2] / c.force[0] if c.force[0] > 0 else q


@njit(error_model="numpy", cache=True)
def march_list(first, steps, state, modes, prop, table, mass, c, work, goal, travel, ledger, rows):
    """`dynamics.march.loop_kernels.march` of a list."""
    omega, _, slide, _, output, _ = modes
    free_map, push, dense, reach, loss, dense_loss, dt, beta = prop
    last, around, n = work.last, table.shape[0], slide.size
    accel, spare = np.empty(n), np.empty((2, n))
    for i in range(steps + 1):
        q, v, out = sample(rows[i], state, slide, output)
        force, energy, slip = list_status(c, q)
        status = note(rows[i], force, energy, slip, out, travel, energy + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        free = free_slide(state, reach, 0, table, at)
        dq, force, count = solve_list(free, beta, 2 * last[0, 0] - last[1, 0], c, v, dt, goal)
        last[1, 0], last[0, 0] = last[0, 0], dq
        used = (free - dq) / beta
        tell(count, used * dq, ledger)
        push_back(used, slide, mass, accel)
        move(state, free_map, push, loss, dense, dense_loss, table, at, accel, spare, ledger)
        v1 = 0.0
        for k in range(n):
            v1 += slide[k] * state[1, k]
        rows[i, rows.shape[1] - 2] = used
        burnt, ok = commit_list(dq, used, v, v1, dt, c)
        ledger[3] += burnt
        if not ok:
            return i, 2
    return steps, 0


@njit(error_model="numpy", cache=True)
def follow_list(path, dt, c, burnt, forces):
    """`dynamics.march.loop_kernels.follow_path` of a list."""
    bad = 0
    for i in range(path.size):
        forces[i, 0], burnt[i, 1], forces[i, 2] = list_status(c, path[i])
        if i == path.size - 1:
            break
        dq = path[i + 1] - path[i]
        v = dq / dt if dt > 0 else 0.0
        mean = list_scalar(dq, c, v, dt)[0]
        forces[i, 1] = mean
        burnt[i, 0], ok = commit_list(dq, mean, v, v, dt, c)
        bad += not ok
    return bad
