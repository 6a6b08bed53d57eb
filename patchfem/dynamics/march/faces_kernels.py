"""Faces beside each other in a step: every element and the contact on port 0 take turns until all agree.

Port p is a row of slides; the contact, where there is one, and the elements each act on one port. Within a step the
path-mean forces F satisfy d = free - beta F together with every law. Turn by turn each law is solved with the others
held (block descent on a convex problem for laws that dissipate); the rest of the forces moves d of the others by beta.
All set-valued elements are one block, followed from stop to release inside the step (`stops_kernels`). The text runs
with any contact and any laws: `hub` makes an instance per set of them. j: `contacts.arrays.Faces`.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws.coulomb_kernels import stick
from ..contacts import element_kernels as contact
from ..contacts import element_solve_kernels as solver
from ..modal_kernels import ended, free_rate, free_slide
from . import alone_kernels as parts
from . import stops_kernels as stops
from . import together_kernels as together
from .stops_kernels import BLOW, DQ, END, FOUND, FREE, HOLDS, MEAN, RATE, START, STATIC, WAY

STOPS = parts.STOPS  # a name of this module, which numba leaves branches out by
TURNS, FEW = 1000, 60  # of all elements in a step before it counts as failed; with stops and releases inside it
ROUND = 4e-15  # of a slide over its give, and of a force: no residual is smaller
EACH = 5  # columns of an element in a row: slide, speed, force, slip, mean force of the step that follows


@njit(error_model="numpy", **LEAN)
def sampled(q, v, motion, row, c, j):
    """(force, energy of friction, slip, energy of springs) at a sample: of the contact, or else of the first element;
    slide, speed, force and slip of every element into its row."""
    n, m = motion.shape[1], 2 * motion.shape[1] + 7
    first, slip, energy, springs = 0.0, q, 0.0, 0.0
    for e in range(j.ports.size):
        here, rate = 0.0, 0.0
        for k in range(n):
            here += j.rows[j.ports[e], k] * motion[0, k]
            rate += j.rows[j.ports[e], k] * motion[1, k]
        force, stock, moved = law.state(j.num, j.mem, e, here, rate)
        j.q[e], j.v[e] = here, rate
        at = m + EACH * e
        row[at], row[at + 1], row[at + 2], row[at + 3] = here, rate, force, moved
        if j.rubs[e]:
            energy += stock
        else:
            springs += stock
        if e == 0 and j.rubs[0]:
            first, slip = force, moved
    if j.there[0]:
        first, stock, slip = contact.state(c, q, v)
        energy += stock
    return first, energy, slip, springs


@njit(error_model="numpy", **LEAN)
def held(motion, plant, drive, force, row, j):
    """Write the forces of the set-valued elements at a sample into their memory and the row: kinetic friction of those
    that slide, of those that rest what leaves them no acceleration. Returns the force [N] of the contact, as it was
    given, or else of the first element; drive [m s-2]."""
    s, m, accel, count = j.stops, 2 * motion.shape[1] + 7, plant.room[0], j.ports.size
    own = force if j.there[0] else 0.0
    for i in range(s.names.size):
        e, way = s.element[i], s.field[WAY, i]
        limit = j.num[e, 1] if abs(way) == 2.0 else j.num[e, 2]
        j.mem[e, 0] = np.sign(way) * limit
        row[m + EACH * e + 2] = j.mem[e, 0]
    for k in range(accel.size):
        accel[k] = j.beside[k] - plant.slide[k] * own / plant.mass
        for e in range(count):
            accel[k] -= j.rows[j.ports[e], k] * row[m + EACH * e + 2] / plant.mass
    for i in range(stops.reactions(motion, plant, drive, accel, plant.room[1:], s)):
        e = s.element[s.names[i]]
        j.mem[e, 0] = min(max(s.field[FOUND, i], -j.num[e, 1]), j.num[e, 1])
        row[m + EACH * e + 2] = j.mem[e, 0]
    return row[m + 2] if j.num[0, 0] == HOLDS and not j.there[0] else force


@njit(error_model="numpy", **LEAN)
def begun(motion, plant, table, at, dt, j):
    """Free slides, and where elements are set-valued free rates, of all ports in the step; the lengths of its bonds."""
    for p in range(j.free.size):
        j.free[p] = free_slide(motion, plant.reach, p, table, at)
        if STOPS:
            j.rate[p] = free_rate(motion, j.rows[p], plant.free, plant.dense, table, at)
    for e in range(j.ports.size):
        j.eps[e] = law.middle(j.num, j.mem, e, j.v[e], dt)


@njit(error_model="numpy", **LEAN)
def elsewhere(mine, port, j):
    """Slide [m] that the forces of all others take from a port; mine: the element, -1 for the contact on port 0."""
    out = 0.0
    for k in range(j.forces.size):
        if k != mine:
            out += j.beta[port, j.ports[k]] * j.forces[k]
    return out + j.beta[port, 0] * j.own[0] if mine >= 0 else out


@njit(error_model="numpy", **LEAN)
def turned(e, turn, j, dt):
    """Solve element e with all others held: (change of its force over its goal [1], iterations).

    turn: from 0; the change is inf where the solve failed.
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
def turned_contact(q, v, dt, c, j):
    """Solve the contact on port 0 with all elements held: (its slide, change of its force over its goal, iterations).
    """
    free = j.free[0] - elsewhere(-1, 0, j)
    dq, _, tries = contact.solve(free, j.beta[0, 0], q, v, dt, c, j.goal[0])
    used = (free - dq) / j.beta[0, 0]
    change = abs(used - j.own[0]) / (j.goal[0] + ROUND * (abs(j.free[0]) / j.beta[0, 0] + abs(used)))
    j.own[0] = used
    return dq, change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **LEAN)
def agreed(q, v, plant, c, j):
    """Forces of contact and elements over a step, in j.own, j.forces and j.dq: (slide of the contact, iterations), < 0
    where they do not agree. Every element takes its turn, a set-valued one by the mean force alone."""
    count, there, dt = j.ports.size, j.there[0], plant.dt
    smooth = j.stops.names.size == 0 and there == 0 and plant.dense.size == 0
    iterations, last_worst, worst, dq = 0, np.inf, 0.0, 0.0
    for turn in range(TURNS):
        worst = 0.0
        if there:
            dq, worst, tries = turned_contact(q, v, dt, c, j)
            iterations += tries
        for e in range(count):
            change, tries = turned(e, turn, j, dt)
            worst = max(worst, change)
            iterations += tries
        if worst <= 1.0 or count + there == 1:
            return dq, iterations if worst < np.inf else -iterations
        if smooth and turn > 1:
            iterations += abs(together.solve_smooth(j, dt))
        elif turn > 4 and not there and worst > 0.2 * last_worst:
            together.newton_turn(j, dt, False)
        last_worst = worst
    return dq, -iterations


@njit(error_model="numpy", **LEAN)
def between(j):
    """Free slides and speeds of the set-valued elements under the forces of all others, into j.stops.field."""
    s = j.stops
    for i in range(s.names.size):
        p = j.ports[s.element[i]]
        slide, speed = j.free[p] - j.beta[p, 0] * j.own[0], j.rate[p] - j.gamma[p, 0] * j.own[0]
        for e in range(j.ports.size):
            if j.num[e, 0] != HOLDS:
                slide -= j.beta[p, j.ports[e]] * j.forces[e]
                speed -= j.gamma[p, j.ports[e]] * j.forces[e]
        s.field[FREE, i], s.field[RATE, i] = slide, speed


@njit(error_model="numpy", **LEAN)
def taken(j):
    """Forces and slides of the set-valued elements into j.forces and j.dq; the largest change of a force over its
    goal."""
    s, worst = j.stops, 0.0
    for i in range(s.names.size):
        e, force = s.element[i], s.field[MEAN, i]
        worst = max(worst, abs(force - j.forces[e]) / (j.goal[1 + e] + ROUND * abs(force)))
        j.forces[e], j.dq[e] = force, s.field[DQ, i]
    return worst


@njit(error_model="numpy", **LEAN)
def still(motion, plant, table, at, j):
    """Whether all set-valued elements rest through the step and at its end, held by static friction."""
    if not stops.stays(j.stops):
        return False
    taken(j)
    end, accel = j.room[:2], plant.room[0]
    pushed(plant, j, accel)
    ended(motion, plant.free, plant.push, plant.dense, table, at, accel, end)
    for i in range(j.stops.names.size):
        e = j.stops.element[i]
        for k in range(accel.size):
            accel[k] += j.rows[j.ports[e], k] * j.forces[e] / plant.mass
    return stops.stays_to_the_end(end, plant, table[at, 8 * accel.size + 2], accel, plant.room[1:], j.stops)


@njit(error_model="numpy", **LEAN)
def passed(q, v, motion, plant, table, at, c, j):
    """As `agreed`, with the stops and releases of the set-valued elements inside the step, and their blows.

    (slide of the contact, iterations, True), False where no such step is found or it would give energy. Which of them
    stop and go is settled in the first turns; then the slides that follow from it are kept.
    """
    s, there, iterations, last_worst, dq, dt = j.stops, j.there[0], 0, np.inf, 0.0, plant.dt
    for i in range(s.names.size):
        s.field[START, i] = j.v[s.element[i]]
    for turn in range(FEW):
        worst = 0.0
        if there:
            dq, worst, tries = turned_contact(q, v, dt, c, j)
            iterations += tries
        for e in range(j.ports.size):
            if j.num[e, 0] != HOLDS:
                change, tries = turned(e, turn, j, dt)
                worst = max(worst, change)
                iterations += tries
        between(j)
        if turn < FEW // 2 and not (still(motion, plant, table, at, j) or stops.watched(dt, s)):
            return dq, iterations, False
        if not stops.met(s):
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
def solved(q, v, motion, plant, table, at, c, j):
    """Forces of contact and elements over a step whose free slides stand in j: (slide of the contact, iterations),
    below 0 where they do not agree. Blows of set-valued elements stand in j.stops, or are left to `blown`."""
    if STOPS:
        dq, tried, found = passed(q, v, motion, plant, table, at, c, j)
        if found:
            j.found[0] = 1.0
            return dq, tried
        dq, iterations = agreed(q, v, plant, c, j)
        j.found[0] = 0.0
        return dq, iterations + tried if iterations >= 0 else iterations - tried
    else:
        return agreed(q, v, plant, c, j)


@njit(error_model="numpy", **LEAN)
def pushed(plant, j, accel):
    """Modal accelerations (n,) [m s-2] of all forces into `accel`."""
    for k in range(accel.size):
        accel[k] = j.beside[k] - plant.slide[k] * j.own[0] / plant.mass if j.there[0] else j.beside[k]
    for e in range(j.ports.size):
        for k in range(accel.size):
            accel[k] -= j.rows[j.ports[e], k] * j.forces[e] / plant.mass


@njit(error_model="numpy", **LEAN)
def worked(dq, row, j):
    """Friction work of the step [J]; its mean forces go into the row of its first sample. dq [m]: slide of the contact.
    """
    m = 2 * j.beside.size + 7
    work = j.own[0] * dq if j.there[0] else 0.0
    row[m - 3] = j.own[0] if j.there[0] else (j.forces[0] if j.rubs[0] else 0.0)
    for e in range(j.ports.size):
        row[m + EACH * e + 4] = j.forces[e]
        if j.rubs[e]:
            work += j.forces[e] * j.dq[e]
    return work


@njit(error_model="numpy", **LEAN)
def blown(motion, mass, j):
    """Strike the modes by the blows of the set-valued elements, in place; the energy that they take [J]. Where no stops
    were found those are brought to rest that did not slide."""
    s = j.stops
    if j.found[0] == 0.0:
        for i in range(s.names.size):
            s.field[DQ, i] = j.dq[s.element[i]]
        stops.brought(motion, s)
    return stops.struck(motion, mass, s)


@njit(error_model="numpy", **LEAN)
def committed(q, v, dq, motion, plant, c, j):
    """Move the memories of contact and elements by the step: (energy dissipated [J], False where one is full)."""
    lost, ok = 0.0, True
    if j.there[0]:
        speed = 0.0
        for k in range(plant.slide.size):
            speed += plant.slide[k] * motion[1, k]
        lost, ok = contact.commit(dq, j.own[0], q, v, speed, plant.dt, c)
        j.own[1] = dq
    for e in range(j.ports.size):
        speed = 0.0
        for k in range(plant.slide.size):
            speed += j.rows[j.ports[e], k] * motion[1, k]
        lost += law.commit(j.num, j.mem, e, j.dq[e], j.forces[e], j.v[e], speed, plant.dt, j.eps[e])
        j.last[e, 1] = j.last[e, 0]
        j.last[e, 0] = j.dq[e]
    return lost, ok


@njit(error_model="numpy", **LEAN)
def limited(load0, load1, mu, j):
    """The set-valued elements under a load that goes from load0 to load1 [N] in the step; mu (2,): static and kinetic
    coefficient."""
    s, load1 = j.stops, max(load1, 0.0)
    for i in range(s.names.size):
        e = s.element[i]
        for k in range(2):
            s.limit[STATIC + k, i], s.limit[STATIC + k + END, i] = mu[k] * load0, mu[k] * load1
            j.num[e, 1 + k] = 0.5 * mu[k] * (load0 + load1)


@njit(error_model="numpy", **LEAN)
def capped(j):
    """No force of a set-valued element at a sample above what its load bears."""
    for i in range(j.stops.names.size):
        e = j.stops.element[i]
        j.mem[e, 0] = min(max(j.mem[e, 0], -j.num[e, 1]), j.num[e, 1])


@njit(error_model="numpy", **LEAN)
def slid(used, j):
    """Let the one set-valued element slide through the step under a mean force [N], without a blow; its slide [m]."""
    f = j.stops.field
    j.forces[0], j.dq[0], j.found[0] = used, j.free[0] - j.beta[0, 0] * used, 1.0
    f[BLOW, 0], f[WAY, 0] = 0.0, 1.0 if used >= 0 else -1.0
    return j.dq[0]
