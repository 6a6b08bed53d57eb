"""The loop of several interfaces and nonlinear springs: every element and the patch take turns until all agree.

Port p is a row of slides; the patch, where there is one, and the elements each act on one port. Within a step the path-
mean forces F satisfy d = free - beta F together with every law. Turn by turn each law is solved with the others held
(block descent on a convex problem for laws that dissipate); the rest of the forces moves d of the others by beta.
"""

import numpy as np
from numba import njit

from ...friction.flags_kernels import LEAN
from ..modal_kernels import free_slide, move, note, sample, stored, tell
from .joint_laws_kernels import CUBIC, element_commit, element_mean, element_middle, element_solve, element_state
from .joints_solve_kernels import solve_smooth
from .step_kernels import COULOMB, RATE, commit, contact_state, contact_step

TURNS = 1000  # of all elements in a step before it counts as failed
ROUND = 4e-15  # of a slide over its give, and of a force: no residual is smaller
NOBODY = -1  # kind of a patch that is not there


@njit(error_model="numpy", **LEAN)
def elsewhere(mine, port, ports, forces, own, beta):
    """Slide [m] that the forces of all others take from a port; own: force of the patch on port 0, mine -1 for it."""
    out = 0.0
    for k in range(forces.size):
        if k != mine:
            out += beta[port, ports[k]] * forces[k]
    return out + beta[port, 0] * own if mine >= 0 else out


@njit(error_model="numpy", **LEAN)
def newton_turn(free, ports, kinds, num, mem, q, eps, dt, beta, forces, mean, system):
    """One Newton step on the forces of all elements at once, without a patch; False where it fails.

    forces (e,) in place; the residual is forces - law(free - beta forces). A Coulomb element that holds asks for no
    slide, with a trace of give where elements that depend on each other share their force in more ways than one; one
    that slips keeps its force.
    """
    count = forces.size
    for e in range(count):
        dq, own = free[ports[e]], beta[ports[e], ports[e]]
        for k in range(count):
            dq -= beta[ports[e], ports[k]] * forces[k]
        if kinds[e] == COULOMB:
            holds = abs(forces[e]) < num[e, 0] * (1 - 1e-12) and abs(forces[e]) != num[e, 1]
            mean[e] = dq / own if holds else 0.0
            for k in range(count):
                system[e, k] = beta[ports[e], ports[k]] / own if holds else 0.0
            system[e, e] += 1e-9 if holds else 1.0
            continue
        force, slope = element_mean(kinds[e], num, mem, e, q[e], dq, eps[e], dt)
        mean[e] = force - forces[e]
        for k in range(count):
            system[e, k] = slope * beta[ports[e], ports[k]]
        system[e, e] += 1.0
    for i in range(count):  # elimination with the pivots in place: 1 + slope beta leads its row for laws that resist
        if abs(system[i, i]) < 1e-12:
            return False
        for j in range(i + 1, count):
            part = system[j, i] / system[i, i]
            for k in range(i + 1, count):
                system[j, k] -= part * system[i, k]
            mean[j] -= part * mean[i]
    for i in range(count - 1, -1, -1):
        for k in range(i + 1, count):
            mean[i] -= system[i, k] * mean[k]
        mean[i] /= system[i, i]
    for e in range(count):
        if not np.isfinite(mean[e]):
            return False
    for e in range(count):
        forces[e] += mean[e]
        if kinds[e] == COULOMB:
            forces[e] = min(max(forces[e], -num[e, 0]), num[e, 0])
    return True


@njit(error_model="numpy", cache=True)
def march_slots(first, steps, state, held, modes, prop, beta, table, mass, kind, c, work, rows_of, ports, kinds, num,
                mem, goal, travel, ledger, rows, more):
    """March `steps` steps; arguments as `dynamics.march.loop_kernels.march`, beta (p, p), rows_of (p, n): the ports.

    kind: of the patch on port 0, NOBODY: none; ports, kinds (e,), num, mem (e, ...): the elements; goal (1 + e,): their
    residual [N]; more (steps + 1, e, 4): slide, speed, force, slip of every element. rows as of `march`, for the patch
    or else the first element, and a last column: friction work of the step that follows [J]; the energy in them is that
    of the friction alone. Returns (steps done, status).
    """
    omega, _, slide, _, output, _ = modes
    free_map, push, dense, reach, loss, dense_loss, dt, _ = prop
    n, count, many = slide.size, kinds.size, rows_of.shape[0]
    around, there = table.shape[0], kind != NOBODY
    accel, spare, growth = np.empty(n), np.empty((2, n)), np.empty(6)
    free, forces, dqs = np.empty(many), mem[:, 7].copy(), np.zeros(count)
    q, v, eps = np.empty(count), np.empty(count), np.empty(count)
    mean, system, v1 = np.empty(count), np.empty((count, count)), np.empty(count)
    own, dq, middle, iterations = held[0], 0.0, 0.0, 0
    give, room, hess, smooth = np.empty(n), np.empty((3, n)), np.empty((n, n)), not there and dense.size == 0
    for k in range(n):
        give[k] = push[0, k] / mass
    for e in range(count):
        smooth = smooth and kinds[e] != COULOMB
    for i in range(steps + 1):
        slide_now, speed_now, out = sample(rows[i], state, slide, output)
        force, energy, slip, springs = 0.0, 0.0, slide_now, 0.0
        if there:
            force, energy, slip = contact_state(kind, c, slide_now, held[0])
        for e in range(count):
            q[e], v[e] = 0.0, 0.0
            for k in range(n):
                q[e] += rows_of[ports[e], k] * state[0, k]
                v[e] += rows_of[ports[e], k] * state[1, k]
            f, stock, moved = element_state(kinds[e], num, mem, e, q[e], v[e])
            more[i, e, 0], more[i, e, 1], more[i, e, 2], more[i, e, 3] = q[e], v[e], f, moved
            if e == 0 and not there and kinds[e] < CUBIC:
                force, slip = f, moved
            if kinds[e] < CUBIC:
                energy += stock
            else:
                springs += stock
        status = note(rows[i, :2 * n + 6], force, energy, slip, out, travel,
                      energy + springs + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        for p in range(many):
            free[p] = free_slide(state, reach, p, table, at)
        for e in range(count):
            eps[e] = element_middle(kinds[e], num, mem, e, v[e], dt, growth)
        iterations, last_worst = 0, np.inf
        for turn in range(TURNS):
            worst = 0.0
            if there:
                dq, used, tries, middle = contact_step(free[0] - elsewhere(-1, 0, ports, forces, 0.0, beta), beta[0, 0],
                                                       speed_now, dt, kind, c, work, goal[0])
                used = (free[0] - elsewhere(-1, 0, ports, forces, 0.0, beta) - dq) / beta[0, 0]
                worst = abs(used - own) / (goal[0] + ROUND * (abs(free[0]) / beta[0, 0] + abs(used)))
                own = used
                iterations += abs(tries)
                if tries < 0:
                    worst = np.inf
            for e in range(count):
                p = ports[e]
                mine = free[p] - elsewhere(e, p, ports, forces, own if there else 0.0, beta)
                dqs[e], used, tries = element_solve(mine, beta[p, p], kinds[e], num, mem, e, q[e], eps[e], dt,
                                                    2 * mem[e, 5] - mem[e, 6] if turn == 0 else dqs[e],
                                                    0.1 * goal[1 + e])
                used = (mine - dqs[e]) / beta[p, p]
                noise = ROUND * (abs(mine) / beta[p, p] + abs(used))
                worst = max(worst, abs(used - forces[e]) / (goal[1 + e] + noise))
                forces[e] = used
                iterations += abs(tries)
                if tries < 0:
                    worst = np.inf
            if worst <= 1.0 or count + there == 1:
                break
            if smooth and turn > 1:
                iterations += abs(solve_smooth(free, rows_of, ports, kinds, num, mem, q, eps, dt, give, goal[1:],
                                               forces, room[0], room[1], room[2], hess))
            elif turn > 4 and not there and worst > 0.2 * last_worst:
                newton_turn(free, ports, kinds, num, mem, q, eps, dt, beta, forces, mean, system)
            last_worst = worst
        failed = worst > 1.0 and count + there > 1
        for e in range(count):
            if kinds[e] == COULOMB:  # at the sample: between two steps of stick the mean of both
                more[i, e, 2] = 0.5 * (mem[e, 7] + forces[e]) if dqs[e] == 0.0 and mem[e, 5] == 0.0 else forces[e]
        if there and kind == COULOMB:
            rows[i, 2 * n + 2] = 0.5 * (held[0] + own) if dq == 0.0 and work.last[0, 0] == 0.0 else own
        elif not there and kinds[0] == COULOMB:
            rows[i, 2 * n + 2] = more[i, 0, 2]
        work_done = own * dq if there else 0.0
        for k in range(n):
            accel[k] = -slide[k] * own / mass if there else 0.0
        for e in range(count):
            for k in range(n):
                accel[k] -= rows_of[ports[e], k] * forces[e] / mass
            if kinds[e] < CUBIC:
                work_done += forces[e] * dqs[e]
        tell(-iterations if failed else iterations, work_done, ledger)
        move(state, free_map, push, loss, dense, dense_loss, table, at, accel, spare, ledger)
        speed = 0.0
        for k in range(n):
            speed += slide[k] * state[1, k]
        for e in range(count):
            v1[e] = 0.0
            for k in range(n):
                v1[e] += rows_of[ports[e], k] * state[1, k]
        rows[i, 2 * n + 4] = own if there else (forces[0] if kinds[0] < CUBIC else 0.0)
        rows[i, 2 * n + 6] = work_done
        if there:
            held[0] = c.force[0] * np.tanh(speed / c.force[1]) if kind == RATE else own
            burnt, ok = commit(dq, own, speed_now, speed, dt, kind, c, work, middle, slide_now, False)
            ledger[3] += burnt
            if not ok:
                return i, 2
        for e in range(count):
            ledger[3] += element_commit(kinds[e], num, mem, e, dqs[e], forces[e], v[e], v1[e], dt, eps[e], growth)
    return steps, 0

