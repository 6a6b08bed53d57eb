"""Faces beside each other in a step: every element and the contact on port 0 take turns until all agree.

Port p is a row of slides; the contact, where there is one, and the elements each act on one port. Within a step the
path-mean forces F satisfy d = free - beta F together with every law. Turn by turn each law is solved with the others
held (block descent on a convex problem for laws that dissipate); the rest of the forces moves d of the others by beta.
All set-valued elements are one block, followed from stop to release inside the step (`stops_kernels`). The text runs
with any contact and any laws: `instances` makes an instance per set of them. j: `contacts.arrays.Faces`.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws import plane_kernels as plane
from ...friction.laws.coulomb_kernels import solve_coulomb_step
from ..interfaces import element_kernels as contact
from ..interfaces import element_solve_kernels as solver
from ..modal_kernels import ended, free_rate, free_slide
from . import parts_kernels as parts
from . import stops_kernels as stops
from . import together_kernels as together
from .stops_kernels import (
    AIM,
    BESIDE,
    BETA,
    BLOW,
    CLOSE,
    DQ,
    END,
    EPS,
    FORCE_OWN,
    FOUND,
    FREE,
    GAMMA,
    HOLDS,
    KNOWN,
    MATE,
    MEAN,
    MOST,
    NOW_OWN,
    PACE,
    PLACE,
    PORT,
    PULL,
    RATE,
    ROOM,
    RUBS,
    START,
    STATIC,
    STEP,
    STEP_OWN,
    WAY,
    WENT,
    WENT_BEFORE,
)

# by which branches are left out
STOPS, SMOOTH, THERE, SEVERAL = (
    parts.STOPS,
    parts.SMOOTH,
    parts.THERE,
    parts.SEVERAL,
)
PLANE = parts.PLANE
# of all elements in a step before it counts as failed; with stops and releases inside it
TURNS, FEW = (
    1000,
    60,
)
ROUND = 4e-15  # of a slide over its give, and of a force: no residual is smaller
EACH = 5  # columns of an element in a row: slide, speed, force, slip, mean force of the step that follows


@njit(error_model="numpy", **NJIT_INTERNAL)
def sampled(q, v, motion, row, c, j):
    """(force, energy of friction, slip, energy of springs) at a sample: of the contact, or else of the first element;
    slide, speed, force and slip of every element into its row."""
    n = motion.shape[1]
    m = 2 * motion.shape[1] + 7
    first = 0.0
    slip = q
    energy = 0.0
    springs = 0.0
    for e in range(j.of.shape[1]):
        here = 0.0
        rate = 0.0
        for k in range(n):
            here += j.rows[j.of[PORT, e], k] * motion[0, k]
            rate += j.rows[j.of[PORT, e], k] * motion[1, k]
        force, stock, moved = law.read_memory(j.num[e], j.mem[e], here, rate)
        j.each[PLACE, e] = here
        j.each[PACE, e] = rate
        at = m + EACH * e
        row[at] = here
        row[at + 1] = rate
        row[at + 2] = force
        row[at + 3] = moved
        if j.of[RUBS, e]:
            energy += stock
        else:
            springs += stock
        if e == 0 and j.of[RUBS, 0]:
            first = force
            slip = moved
    if THERE:
        first, stock, slip = contact.state(c, q, v)
        energy += stock
        j.own[NOW_OWN] = first
    return first, energy, slip, springs


@njit(error_model="numpy", **NJIT_INTERNAL)
def held(motion, modal_system, drive, force, row, j):
    """Write the forces of the set-valued elements at a sample into their memory and the row: kinetic friction of those
    that slide, of those that rest what leaves them no acceleration. Returns the force [N] of the first element where it
    is one of them and no contact is there, else `force`; drive [m s-2]."""
    s = j.stops
    m = 2 * motion.shape[1] + 7
    accel = modal_system.workspace[0]
    count = j.of.shape[1]
    for i in range(s.names.size):
        e = s.element[i]
        way = s.field[WAY, i]
        limit = j.num[e, 1] if abs(way) == 2.0 else j.num[e, 2]
        j.mem[e, 0] = np.sign(way) * limit
        row[m + EACH * e + 2] = j.mem[e, 0]
    for k in range(accel.size):
        accel[k] = j.modal[BESIDE, k] - modal_system.slide[k] * j.own[NOW_OWN] / modal_system.mass
        for e in range(count):
            accel[k] -= j.rows[j.of[PORT, e], k] * row[m + EACH * e + 2] / modal_system.mass
    for i in range(
        stops.reactions(motion, modal_system, drive, accel, modal_system.workspace[1:], s)
    ):
        e = s.element[s.names[i]]
        j.mem[e, 0] = min(max(s.field[FOUND, i], -j.num[e, 1]), j.num[e, 1])
        row[m + EACH * e + 2] = j.mem[e, 0]
    if THERE:
        return force
    else:
        return row[m + 2] if j.num[0, 0] == HOLDS else force


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def begun(motion, modal_system, table, at, dt, j):
    """Free slides, and where elements are set-valued free rates, of all ports in the step; the lengths of its bonds."""
    for p in range(j.port.shape[1]):
        j.port[FREE, p] = free_slide(motion, modal_system.reach, p, table, at)
        if STOPS:
            j.port[RATE, p] = free_rate(
                motion, j.rows[p], modal_system.free, modal_system.dense, table, at
            )
    for e in range(j.of.shape[1]):
        j.each[EPS, e] = law.step_bond_length(j.num[e], j.mem[e], j.each[PACE, e], dt)


@njit(error_model="numpy", **NJIT_INTERNAL)
def elsewhere(mine, port, j):
    """Slide [m] that the forces of all others take from a port; mine: the element, -1 for the contact on port 0."""
    out = 0.0
    for k in range(j.of.shape[1]):
        if k != mine:
            out += j.gives[BETA, port, j.of[PORT, k]] * j.each[PULL, k]
    return out + j.gives[BETA, port, 0] * j.own[FORCE_OWN] if mine >= 0 else out


@njit(error_model="numpy", **NJIT_INTERNAL)
def turned(e, turn, j, dt):
    """Solve element e with all others held: (change of its force over its goal [1], iterations).

    turn: from 0; the change is inf where the solve failed. The first direction of an element in a plane has both.
    """
    if PLANE:
        if j.of[MATE, e] != e:
            return turned_in_plane(e, turn, j) if j.of[MATE, e] > e else (0.0, 0)
    p = j.of[PORT, e]
    beta = j.gives[BETA, p, p]
    dq = j.each[STEP, e]
    tries = 1
    mine = j.port[FREE, p] - elsewhere(e, p, j)
    if STOPS:
        if j.num[e, 0] == HOLDS:
            dq = solve_coulomb_step(mine, beta, j.num[e, 1], j.num[e, 2])[0]
    if SMOOTH:
        if j.num[e, 0] != HOLDS:
            guess = 2 * j.each[WENT, e] - j.each[WENT_BEFORE, e] if turn == 0 else dq
            dq, _, tries = solver.solve_element(
                mine,
                beta,
                j.num[e],
                j.mem[e],
                j.each[PLACE, e],
                j.each[EPS, e],
                dt,
                guess,
                j.each[MOST, e],
                0.1 * j.each[CLOSE, e],
            )
    used = (mine - dq) / beta
    change = abs(used - j.each[PULL, e]) / (
        j.each[CLOSE, e] + ROUND * (abs(mine) / beta + abs(used))
    )
    j.each[STEP, e] = dq
    j.each[PULL, e] = used
    return change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def turned_in_plane(e, turn, j):
    """`turned` of both directions of the element whose first one is e."""
    f = j.of[MATE, e]
    p = j.of[PORT, e]
    r = j.of[PORT, f]
    xx = j.gives[BETA, p, p]
    xy = j.gives[BETA, p, r]
    yy = j.gives[BETA, r, r]
    x = j.port[FREE, p] - elsewhere(e, p, j) + xy * j.each[PULL, f]
    y = j.port[FREE, r] - elsewhere(f, r, j) + xy * j.each[PULL, e]
    dx = j.each[STEP, e]
    dy = j.each[STEP, f]
    if turn == 0:
        dx = 2 * j.each[WENT, e] - j.each[WENT_BEFORE, e]
        dy = 2 * j.each[WENT, f] - j.each[WENT_BEFORE, f]
    dx, dy, pull, across, tries = plane.solve_plane_step(
        (x, y),
        (xx, xy, yy),
        (j.num[e, 2], j.num[e, 3]),
        (j.mem[e, 3], j.mem[f, 3]),
        (dx, dy),
        0.1 * j.each[CLOSE, e],
    )
    change = max(
        abs(pull - j.each[PULL, e]) / (j.each[CLOSE, e] + ROUND * (abs(x) / xx + abs(pull))),
        abs(across - j.each[PULL, f]) / (j.each[CLOSE, e] + ROUND * (abs(y) / yy + abs(across))),
    )
    j.each[STEP, e] = dx
    j.each[STEP, f] = dy
    j.each[PULL, e] = pull
    j.each[PULL, f] = across
    return change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def turned_contact(q, v, dt, c, j):
    """Solve the contact on port 0 with all elements held: (its slide, change of its force over its goal, iterations)."""
    free = j.port[FREE, 0] - elsewhere(-1, 0, j)
    beta = j.gives[BETA, 0, 0]
    dq, _, tries = contact.solve(free, beta, q, v, dt, c, j.own[AIM])
    used = (free - dq) / beta
    change = abs(used - j.own[FORCE_OWN]) / (
        j.own[AIM] + ROUND * (abs(j.port[FREE, 0]) / beta + abs(used))
    )
    j.own[FORCE_OWN] = used
    return dq, change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(q, v, modal_system, c, j):
    """Forces of contact and elements over a step, in j.own and j.each: (slide of the contact, iterations), < 0
    where they do not agree. Every element takes its turn, a set-valued one by the mean force alone."""
    count = j.of.shape[1]
    dt = modal_system.dt
    iterations = 0
    last_worst = np.inf
    dq = 0.0
    for turn in range(TURNS):
        worst = 0.0
        if THERE:
            dq, worst, tries = turned_contact(q, v, dt, c, j)
            iterations += tries
        for e in range(count):
            change, tries = turned(e, turn, j, dt)
            worst = max(worst, change)
            iterations += tries
        if worst <= 1.0:
            return dq, iterations
        if SEVERAL:
            if turn > 1:
                iterations += together_now(turn, worst, last_worst, modal_system, j)
        else:
            return dq, iterations if worst < np.inf else -iterations
        last_worst = worst
    return dq, -iterations


@njit(error_model="numpy", **NJIT_INTERNAL)
def together_now(turn, worst, last_worst, modal_system, j):
    """A step on the forces of all elements at once, where there is no contact: of laws with a slope to their minimum,
    of others where the turns get there too slowly. Iterations."""
    if THERE:
        return 0
    elif SMOOTH:
        if PLANE:  # its force has no potential
            pass
        elif j.stops.names.size == 0 and modal_system.dense.size == 0:
            return abs(together.solve_smooth(j, modal_system.dt))
    if turn > 4 and worst > 0.2 * last_worst:
        together.newton_turn(j, modal_system.dt, False)
    return 0


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def between(j):
    """Free slides and speeds of the set-valued elements under the forces of all others, into j.stops.field."""
    s = j.stops
    for i in range(s.names.size):
        p = j.of[PORT, s.element[i]]
        slide = j.port[FREE, p] - j.gives[BETA, p, 0] * j.own[FORCE_OWN]
        speed = j.port[RATE, p] - j.gives[GAMMA, p, 0] * j.own[FORCE_OWN]
        for e in range(j.of.shape[1]):
            if j.num[e, 0] != HOLDS:
                slide -= j.gives[BETA, p, j.of[PORT, e]] * j.each[PULL, e]
                speed -= j.gives[GAMMA, p, j.of[PORT, e]] * j.each[PULL, e]
        s.field[FREE, i] = slide
        s.field[RATE, i] = speed


@njit(error_model="numpy", **NJIT_INTERNAL)
def taken(j):
    """Forces and slides of the set-valued elements into j.each; the largest change of a force over its
    goal."""
    s = j.stops
    worst = 0.0
    for i in range(s.names.size):
        e = s.element[i]
        force = s.field[MEAN, i]
        worst = max(worst, abs(force - j.each[PULL, e]) / (j.each[CLOSE, e] + ROUND * abs(force)))
        j.each[PULL, e] = force
        j.each[STEP, e] = s.field[DQ, i]
    return worst


@njit(error_model="numpy", **NJIT_INTERNAL)
def still(motion, modal_system, table, at, j):
    """Whether all set-valued elements rest through the step and at its end, held by static friction."""
    if not stops.stays(j.stops):
        return False
    end = j.modal[ROOM : ROOM + 2]
    accel = modal_system.workspace[0]
    pushed(modal_system, j, accel)
    for i in range(j.stops.names.size):
        e = j.stops.element[i]
        for k in range(accel.size):
            accel[k] -= (
                j.rows[j.of[PORT, e], k]
                * (j.stops.field[MEAN, i] - j.each[PULL, e])
                / modal_system.mass
            )
    ended(motion, modal_system.free, modal_system.push, modal_system.dense, table, at, accel, end)
    for i in range(j.stops.names.size):
        e = j.stops.element[i]
        for k in range(accel.size):
            accel[k] += j.rows[j.of[PORT, e], k] * j.stops.field[MEAN, i] / modal_system.mass
    return stops.stays_to_the_end(
        end, modal_system, table[at, 8 * accel.size + 2], accel, modal_system.workspace[1:], j.stops
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def passed(q, v, motion, modal_system, table, at, c, j):
    """As `solve_coupled_forces`, with the stops and releases of the set-valued elements inside the
    step, and their blows.

    (slide of the contact, iterations, True), False where no such step is found or it would give energy. Which of them
    stop and go is settled in the first turns; then the slides that follow from it are kept.
    """
    s = j.stops
    iterations = 0
    last_worst = np.inf
    dq = 0.0
    dt = modal_system.dt
    for i in range(s.names.size):
        s.field[START, i] = j.each[PACE, s.element[i]]
    for turn in range(FEW):
        worst = 0.0
        if THERE:
            dq, worst, tries = turned_contact(q, v, dt, c, j)
            iterations += tries
        if SMOOTH:
            for e in range(j.of.shape[1]):
                if j.num[e, 0] != HOLDS:
                    change, tries = turned(e, turn, j, dt)
                    worst = max(worst, change)
                    iterations += tries
        between(j)
        if turn < FEW // 2 and not (
            still(motion, modal_system, table, at, j) or stops.watched(dt, s)
        ):
            return dq, iterations, False
        if not stops.met(s):
            return dq, iterations, False
        worst = max(worst, taken(j))
        iterations += 1
        if worst <= 1.0 or settles_at_once(j):
            return dq, iterations, stops.blows(s) >= 0.0
        if SEVERAL:
            if turn > 4 and worst > 0.2 * last_worst:
                newton_of_stops(j, dt)
        last_worst = worst
    return dq, iterations, False


@njit(error_model="numpy", **NJIT_INTERNAL)
def settles_at_once(j):
    """Whether all that rubs is set-valued, which is solved as one."""
    if THERE:
        return False
    else:
        return j.stops.names.size == j.of.shape[1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def newton_of_stops(j, dt):
    """A Newton step on the forces of all elements beside the stops that are known, where there is no contact."""
    if SMOOTH:
        if THERE:
            return
        else:
            together.newton_turn(j, dt, True)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solved(q, v, motion, modal_system, table, at, c, j):
    """Forces of contact and elements over a step whose free slides stand in j: (slide of the contact, iterations),
    below 0 where they do not agree. Blows of set-valued elements stand in j.stops, or are left to `blown`."""
    if STOPS:
        dq, tried, found = passed(q, v, motion, modal_system, table, at, c, j)
        if found:
            j.own[KNOWN] = 1.0
            return dq, tried
        dq, iterations = solve_coupled_forces(q, v, modal_system, c, j)
        j.own[KNOWN] = 0.0
        return dq, iterations + tried if iterations >= 0 else iterations - tried
    else:
        return solve_coupled_forces(q, v, modal_system, c, j)


@njit(error_model="numpy", **NJIT_INTERNAL)
def pushed(modal_system, j, accel):
    """Modal accelerations (n,) [m s-2] of all forces into `accel`."""
    for k in range(accel.size):
        accel[k] = j.modal[BESIDE, k] - modal_system.slide[k] * j.own[FORCE_OWN] / modal_system.mass
    for e in range(j.of.shape[1]):
        for k in range(accel.size):
            accel[k] -= j.rows[j.of[PORT, e], k] * j.each[PULL, e] / modal_system.mass


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def worked(dq, row, j):
    """Friction work of the step [J]; its mean forces go into the row of its first sample. dq [m]: slide of the contact."""
    m = 2 * j.modal.shape[1] + 7
    work = j.own[FORCE_OWN] * dq
    row[m - 3] = j.each[PULL, 0] if j.of[RUBS, 0] else 0.0
    if THERE:
        row[m - 3] = j.own[FORCE_OWN]
    for e in range(j.of.shape[1]):
        row[m + EACH * e + 4] = j.each[PULL, e]
        if j.of[RUBS, e]:
            work += j.each[PULL, e] * j.each[STEP, e]
    return work


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def blown(motion, mass, j):
    """Strike the modes by the blows of the set-valued elements, in place; the energy that they take [J]. Where no stops
    were found those are brought to rest that did not slide."""
    s = j.stops
    if j.own[KNOWN] == 0.0:
        for i in range(s.names.size):
            s.field[DQ, i] = j.each[STEP, s.element[i]]
        stops.brought(motion, s)
    return stops.struck(motion, mass, s)


@njit(error_model="numpy", **NJIT_INTERNAL)
def committed(q, v, dq, motion, modal_system, c, j):
    """Move the memories of contact and elements by the step: (energy dissipated [J], False where one is full)."""
    lost = 0.0
    ok = True
    if THERE:
        speed = 0.0
        for k in range(modal_system.slide.size):
            speed += modal_system.slide[k] * motion[1, k]
        lost, ok = contact.commit(dq, j.own[FORCE_OWN], q, v, speed, modal_system.dt, c)
        j.own[STEP_OWN] = dq
    for e in range(j.of.shape[1]):
        speed = 0.0
        for k in range(modal_system.slide.size):
            speed += j.rows[j.of[PORT, e], k] * motion[1, k]
        if PLANE:
            if j.of[MATE, e] == e:
                lost += law.update_memory(
                    j.num[e],
                    j.mem[e],
                    j.each[STEP, e],
                    j.each[PULL, e],
                    j.each[PACE, e],
                    speed,
                    modal_system.dt,
                    j.each[EPS, e],
                )
            elif j.of[MATE, e] > e:
                lost += plane.update_plane_memory(
                    j.num[e],
                    j.mem[e],
                    j.mem[j.of[MATE, e]],
                    (j.each[STEP, e], j.each[STEP, j.of[MATE, e]]),
                )
        else:
            lost += law.update_memory(
                j.num[e],
                j.mem[e],
                j.each[STEP, e],
                j.each[PULL, e],
                j.each[PACE, e],
                speed,
                modal_system.dt,
                j.each[EPS, e],
            )
        j.each[WENT_BEFORE, e] = j.each[WENT, e]
        j.each[WENT, e] = j.each[STEP, e]
    return lost, ok


@njit(error_model="numpy", **NJIT_INTERNAL)
def limited(load0, load1, mu, j):
    """The set-valued elements under a load that goes from load0 to load1 [N] in the step; mu (2,): static and kinetic
    coefficient."""
    s = j.stops
    load1 = max(load1, 0.0)
    for i in range(s.names.size):
        e = s.element[i]
        for k in range(2):
            s.limit[STATIC + k, i] = mu[k] * load0
            s.limit[STATIC + k + END, i] = mu[k] * load1
            j.num[e, 1 + k] = 0.5 * mu[k] * (load0 + load1)


@njit(error_model="numpy", **NJIT_INTERNAL)
def capped(j):
    """No force of a set-valued element at a sample above what its load bears."""
    for i in range(j.stops.names.size):
        e = j.stops.element[i]
        j.mem[e, 0] = min(max(j.mem[e, 0], -j.num[e, 1]), j.num[e, 1])


@njit(error_model="numpy", **NJIT_INTERNAL)
def slide_freely(used, j):
    """Let the one set-valued element slide through the step under a mean force [N], without a blow; its slide [m]."""
    f = j.stops.field
    j.each[PULL, 0] = used
    j.each[STEP, 0] = j.port[FREE, 0] - j.gives[BETA, 0, 0] * used
    j.own[KNOWN] = 1.0
    f[BLOW, 0] = 0.0
    f[WAY, 0] = 1.0 if used >= 0 else -1.0
    return j.each[STEP, 0]
