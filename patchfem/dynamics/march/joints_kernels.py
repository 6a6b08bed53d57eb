"""The loop of several interfaces and nonlinear springs: every element and the patch take turns until all agree.

Port p is a row of slides; the patch, where there is one, and the elements each act on one port. Within a step the path-
mean forces F satisfy d = free - beta F together with every law. Turn by turn each law is solved with the others held
(block descent on a convex problem for laws that dissipate); the rest of the forces moves d of the others by beta. All
set-valued elements are one block, followed from stop to release inside the step (`joints_stops_kernels`). The text runs
with any patch and any laws: `joints` makes an instance per set of them.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws.coulomb_kernels import stick
from ..contacts import coulomb_kernels as patch
from ..contacts import element_solve_kernels as solver
from ..modal_kernels import free_rate, free_slide, move, note, sample, stored, tell
from . import joints_solve_kernels as together
from . import joints_stops_kernels as stops
from .joints_forces_kernels import ROUND, beside, elsewhere, held, pushed, taken
from .joints_shares_kernels import DQ, HOLDS, START

TURNS, FEW = 1000, 60  # of all elements in a step before it counts as failed; with stops and releases inside it


@njit(error_model="numpy", **LEAN)
def sampled(i, motion, j, rows):
    """(force, slip of the first element, energy of friction, of springs) at a sample; slide, speed, force and slip of
    every element in its row."""
    n, m = motion.shape[1], 2 * motion.shape[1] + 7
    first, moved, energy, springs = 0.0, 0.0, 0.0, 0.0
    for e in range(j.ports.size):
        q, v = 0.0, 0.0
        for k in range(n):
            q += j.rows[j.ports[e], k] * motion[0, k]
            v += j.rows[j.ports[e], k] * motion[1, k]
        force, stock, slip = law.state(j.num, j.mem, e, q, v)
        j.q[e], j.v[e] = q, v
        at = m + 4 * e
        rows[i, at], rows[i, at + 1], rows[i, at + 2], rows[i, at + 3] = q, v, force, slip
        if j.rubs[e]:
            energy += stock
        else:
            springs += stock
        if e == 0:
            first, moved = force, slip
    return first, moved, energy, springs


@njit(error_model="numpy", **LEAN)
def turned(e, turn, j, dt):
    """Solve element e with all others held: (change of its force over its goal [1], iterations).

    turn: from 0; j: arrays.Joints; the change is inf where the solve failed.
    """
    p = j.ports[e]
    beta = j.beta[p, p]
    mine = j.free[p] - elsewhere(e, p, j)
    if j.num[e, 0] == HOLDS:
        j.dq[e], used = stick(mine, beta, j.num[e, 1], j.num[e, 2])
        tries = 1
    else:
        guess = 2 * j.last[e, 0] - j.last[e, 1] if turn == 0 else j.dq[e]
        j.dq[e], used, tries = solver.solve_element(mine, beta, j.num, j.mem, e, j.q[e], j.eps[e], dt, guess,
                                                    j.bound[e], 0.1 * j.goal[1 + e])
    used = (mine - j.dq[e]) / beta
    change = abs(used - j.forces[e]) / (j.goal[1 + e] + ROUND * (abs(mine) / beta + abs(used)))
    j.forces[e] = used
    return change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **LEAN)
def patched(q, v, dt, c, j):
    """Solve the patch with all elements held: (its slide, change of its force over its goal, iterations)."""
    free = j.free[0] - elsewhere(-1, 0, j)
    dq, _, tries = patch.solve(free, j.beta[0, 0], q, v, dt, c, j.goal[0])
    used = (free - dq) / j.beta[0, 0]
    change = abs(used - j.own[0]) / (j.goal[0] + ROUND * (abs(j.free[0]) / j.beta[0, 0] + abs(used)))
    j.own[0] = used
    return dq, change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **LEAN)
def agreed(there, smooth, q, v, dt, c, j):
    """Forces of patch and elements over a step, in j.own, j.forces and j.dq: (slide of the patch, iterations), < 0
    where they do not agree. Every element takes its turn, a set-valued one by the mean force alone."""
    count, iterations, last_worst, worst, dq = j.ports.size, 0, np.inf, 0.0, 0.0
    for turn in range(TURNS):
        worst = 0.0
        if there:
            dq, worst, tries = patched(q, v, dt, c, j)
            iterations += tries
        for e in range(count):
            change, tries = turned(e, turn, j, dt)
            worst = max(worst, change)
            iterations += tries
        if worst <= 1.0 or count + there == 1:
            return dq, iterations
        if smooth and turn > 1:
            iterations += abs(together.solve_smooth(j, dt))
        elif turn > 4 and not there and worst > 0.2 * last_worst:
            together.newton_turn(j, dt, False)
        last_worst = worst
    return dq, -iterations


@njit(error_model="numpy", **LEAN)
def passed(there, q, v, dt, c, j):
    """As `agreed`, with the stops and releases of the set-valued elements inside the step, and their blows.

    (slide of the patch, iterations, True), False where no such step is found or it would give energy. Which of them
    stop and go is settled in the first turns; then the slides that follow from it are kept.
    """
    s, iterations, last_worst, dq = j.stops, 0, np.inf, 0.0
    for i in range(s.names.size):
        s.field[START, i] = j.v[s.element[i]]
    for turn in range(FEW):
        worst = 0.0
        if there:
            dq, worst, tries = patched(q, v, dt, c, j)
            iterations += tries
        for e in range(j.ports.size):
            if j.num[e, 0] != HOLDS:
                change, tries = turned(e, turn, j, dt)
                worst = max(worst, change)
                iterations += tries
        beside(j)
        if (turn < FEW // 2 and not stops.watched(dt, s)) or not stops.met(s):
            return dq, iterations, False
        worst = max(worst, taken(j))
        iterations += 1
        if worst <= 1.0 or (s.names.size == j.ports.size and not there):
            return dq, iterations, stops.blows(s) >= 0.0
        if turn > 4 and not there and worst > 0.2 * last_worst:
            together.newton_turn(j, dt, True)
        last_worst = worst
    return dq, iterations, False


@njit(error_model="numpy", **LEAN)
def blown(found, motion, mass, j):
    """Strike the modes by the blows of the set-valued elements, in place; the energy that they take [J].

    found: whether they are known, else they bring to rest what did not slide.
    """
    s = j.stops
    if not found:
        for i in range(s.names.size):
            s.field[DQ, i] = j.dq[s.element[i]]
        stops.brought(motion, s)
    return stops.struck(motion, mass, s)


@njit(error_model="numpy", **LEAN)
def committed(there, q, v, dq, motion, plant, c, j):
    """Move the memories of patch and elements by the step: (energy dissipated [J], False where one is full)."""
    lost, ok = 0.0, True
    if there:
        speed = 0.0
        for k in range(plant.slide.size):
            speed += plant.slide[k] * motion[1, k]
        lost, ok = patch.commit(dq, j.own[0], q, v, speed, plant.dt, c)
        j.own[1] = dq
    for e in range(j.ports.size):
        speed = 0.0
        for k in range(plant.slide.size):
            speed += j.rows[j.ports[e], k] * motion[1, k]
        lost += law.commit(j.num, j.mem, e, j.dq[e], j.forces[e], j.v[e], speed, plant.dt, j.eps[e])
        j.last[e, 1] = j.last[e, 0]
        j.last[e, 0] = j.dq[e]
    return lost, ok


@njit(error_model="numpy", cache=True, **LEAN)
def march(first, steps, motion, plant, table, c, j, travel, ledger, rows):
    """March `steps` steps; arguments as `loop_kernels.march`.

    j: `arrays.Joints`, c: arrays of the patch on port 0, where there is one. rows as of `march`, for the patch or
    else the first element, then the friction work of the step that follows [J], then slide, speed, force and slip of
    every element; the energy in them is that of the friction alone. Returns (steps done, status).
    """
    n, around, dt, mass, there = plant.slide.size, table.shape[0], plant.dt, plant.mass, j.there[0] == 1
    accel, spare, some = plant.room[0], plant.room[1:], j.stops.names.size > 0
    smooth = not some and not there and plant.dense.size == 0
    for i in range(steps + 1):
        q, v, out = sample(rows[i], motion, plant.slide, plant.output)
        force, slip, energy, springs = sampled(i, motion, j, rows)
        if there:
            force, stock, slip = patch.state(c, q, v)
            energy += stock
        elif not j.rubs[0]:
            force, slip = 0.0, q
        status = note(rows[i, :2 * n + 6], force, energy, slip, out, travel,
                      energy + springs + stored(motion, plant.omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        for p in range(j.free.size):
            j.free[p] = free_slide(motion, plant.reach, p, table, at)
            if some:
                j.rate[p] = free_rate(motion, j.rows[p], plant.free, plant.dense, table, at)
        for e in range(j.ports.size):
            j.eps[e] = law.middle(j.num, j.mem, e, j.v[e], dt)
        found, tried, iterations = False, 0, 0
        if some:
            dq, tried, found = passed(there, q, v, dt, c, j)
        if not found:
            dq, iterations = agreed(there, smooth, q, v, dt, c, j)
        iterations = tried if found else (iterations + tried if iterations >= 0 else iterations - tried)
        held(i, there, j, rows)
        work = pushed(there, dq, plant, j, accel)
        tell(iterations, work, ledger)
        move(motion, plant.free, plant.push, plant.loss, plant.dense, plant.dense_loss, table, at, accel, spare, ledger)
        rows[i, 2 * n + 4] = j.own[0] if there else (j.forces[0] if j.rubs[0] else 0.0)
        if some:
            blow = blown(found, motion, mass, j)
            work += blow
            ledger[3] += blow
            ledger[8] += blow
        rows[i, 2 * n + 6] = work
        lost, ok = committed(there, q, v, dq, motion, plant, c, j)
        ledger[3] += lost
        if not ok:
            return i, 2
    return steps, 0
