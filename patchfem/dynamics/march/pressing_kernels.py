"""A load that changes: the normal force and the moment of the contact on the modes, or a load prescribed in time.

Heave h (> 0 away) and pitch t (> 0 opens +x) move the upper holder, so d = -h closes it. Over a step the modes move
exactly under constant forces. Those of the normal contact are the path mean of its slopes along the straight increment,
through every contact set on the way, so they do exactly the work E(end) - E(start) (a discrete gradient; McLachlan,
Quispel, Robidoux, Phil. Trans. R. Soc. A 357, 1999). Friction acts with the path mean of its law under the mean load of
the step; Coulomb's stops and goes inside it, under a load that changes linearly (`stops_kernels`). So the sum of all
energies never rises by itself. n: `contacts.arrays.Pressing`, c: the contact that rubs, j: Faces of the set-valued one.
"""

import numpy as np

from ...compiled.jit import njit
from ...contact.press_kernels import compute_energy, find_set, press_state
from ...contact.press_path_kernels import path_mean
from ...contact.set_arrays import REFERENCE_LOAD, REFERENCE_MOMENT, REFERENCE_STIFFNESS
from ...friction.flags_kernels import NJIT_INTERNAL
from ..interfaces import element_kernels as contact
from ..modal_kernels import free_rate, free_slide
from . import faces_kernels as faces
from . import parts_kernels as parts
from .stops_kernels import BESIDE, FREE, GAMMA, KNOWN, PULL, RATE, STEP

STOPS, POINTED = parts.STOPS, parts.POINTED
TIGHT = 0.01  # of the goal, to which friction and normal contact agree
MOST = 80  # guesses of the force that friction and normal contact agree on; the bracket of the secant shuts within 60


@njit(error_model="numpy", **NJIT_INTERNAL)
def place_of(motion, rows, r):
    """Slide, heave or pitch of the modes."""
    out = 0.0
    for i in range(motion.shape[1]):
        out += rows[r, i] * motion[0, i]
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def press_step(n, k0, begin, f1, f2, turn, out):
    """Heave and pitch of a step: (dh, dt) = (f1, f2) - beta mean slope, by Newton's method with step halving from the
    guess in `turn` (2,). Returns (set at the end, iterations, residual as a force [N]); `out` as in `path_mean`.

    The slopes have a convex potential, so the answer is unique; inside one set one step finds it.
    """
    sets = n.sets
    beta = n.beta
    arm = n.arm[0]
    b11 = beta[1, 1]
    b12 = beta[1, 2]
    b21 = beta[2, 1]
    b22 = beta[2, 2]
    softness = b11 + b22 / (arm * arm) + 2 / sets.reference[REFERENCE_STIFFNESS]
    dh = turn[0]
    dt = turn[1]
    old_h = dh
    old_t = dt
    step_h = 0.0
    step_t = 0.0
    part = 1.0
    best = np.inf
    k = k0
    for count in range(1, 100):
        k = path_mean(sets, k0, begin[0], begin[1], dh, dt, out)
        if k < 0:
            return k, count, np.inf
        p1 = b11 * out[0] + b12 * out[1]
        p2 = b21 * out[0] + b22 * out[1]
        r1 = dh - f1 + p1
        r2 = dt - f2 + p2
        size = abs(r1) + arm * abs(r2)
        noise = 4e-16 * (abs(dh) + abs(f1) + abs(p1) + arm * (abs(dt) + abs(f2) + abs(p2)))
        turn[0] = dh
        turn[1] = dt
        if size <= noise:
            return k, count, 0.0
        if size < best * (1 - 0.1 * part) or best == np.inf:
            best = size
            part = 1.0
            old_h = dh
            old_t = dt
            j11 = 1 + b11 * out[5] + b12 * out[7]
            j12 = b11 * out[6] + b12 * out[8]
            j21 = b21 * out[5] + b22 * out[7]
            j22 = 1 + b21 * out[6] + b22 * out[8]
            det = j11 * j22 - j12 * j21
            step_h = (j22 * r1 - j12 * r2) / det
            step_t = (j11 * r2 - j21 * r1) / det
        else:
            part *= 0.5
            if part < 1e-9 or size <= 64 * noise or (part < 0.2 and best <= 1e3 * noise):
                turn[0] = old_h
                turn[1] = old_t
                k = path_mean(sets, k0, begin[0], begin[1], old_h, old_t, out)
                return k, count, best / softness
        dh = old_h - part * step_h
        dt = old_t - part * step_t
    return k, 100, best / softness


@njit(error_model="numpy", **NJIT_INTERNAL)
def pressed(i, last, motion, mass, c, j, n, row):
    """Load [N], moment [N m], energy [J] of the preloaded contact, heave and pitch at sample i into the last columns of
    its row; what rubs knows its load. The energy [J]; n.slot < 0 where no contact set fits."""
    begin = n.few[17:22]
    load = n.few[0]
    moment = n.sets.reference[REFERENCE_MOMENT]
    m = row.size - 5
    begin[0], begin[1] = place_of(motion, n.rows, 1), place_of(motion, n.rows, 2)
    begin[2] = 0.0
    begin[3] = 0.0
    begin[4] = 0.0
    if n.loads.size > 0:
        load = n.loads[i]
        n.now[0] = load
    else:
        n.slot[0] = find_set(n.sets, n.slot[0], -begin[0], begin[1])
        if n.slot[0] < 0:
            return 0.0
        begin[2], begin[3], begin[4] = compute_energy(n.sets, n.slot[0], begin[0], begin[1])
        load = max(n.sets.reference[REFERENCE_LOAD] - begin[3], 0.0)
        moment = moment - begin[4]
        if POINTED or last:
            press_state(n.sets, n.slot[0], -begin[0], begin[1], n.now)
    n.few[0] = load
    row[m] = load
    row[m + 1] = moment
    row[m + 2] = begin[2]
    row[m + 3] = begin[0]
    row[m + 4] = begin[1]
    weigh(load, load, c, j, n)
    if STOPS:
        faces.capped(j)
        pushes(begin[3], begin[4], mass, n, j.modal[BESIDE])
    return begin[2]


@njit(error_model="numpy", **NJIT_INTERNAL)
def weigh(before, after, c, j, n):
    """Tell what rubs its load at both ends of a step [N]; the nodal forces of points at the later one stand in n.now."""
    if POINTED:
        for i in range(n.now.size):
            c.pressed[1, i] = n.now[i]
    elif STOPS:
        faces.limited(before, after, n.force, j)
    else:
        c.num[0, 1] = n.force[0] * 0.5 * (before + after)
        c.bound[0] = c.num[0, 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def pushes(heave, pitch, mass, n, accel):
    """Modal accelerations (n,) under forces that resist heave [N] and pitch [N m]."""
    for i in range(accel.size):
        accel[i] = -(n.rows[1, i] * heave + n.rows[2, i] * pitch) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def pushed(n, mass, accel):
    """Add the modal accelerations of the mean forces of a step on heave and pitch, n.few[3:5], to accel (n,)."""
    for i in range(accel.size):
        accel[i] -= (n.rows[1, i] * n.few[3] + n.rows[2, i] * n.few[4]) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_step(q, v, force, whole, motion, modal_system, table, at, c, j, n):
    """(slide dq [m], mean friction force [N], iterations) of a step under the mean forces force (2,) on heave and
    pitch; iterations < 0 where it failed. whole: no stop or release inside the step."""
    free = (
        free_slide(motion, modal_system.reach, 0, table, at)
        - n.beta[0, 1] * force[0]
        - n.beta[0, 2] * force[1]
    )
    if STOPS:
        pushes(force[0], force[1], modal_system.mass, n, j.modal[BESIDE])
        j.port[FREE, 0] = free
        if n.beta[0, 0] == 0.0:  # nothing slides
            return faces.slide_freely(0.0, j), 0.0, 1
        j.port[RATE, 0] = (
            free_rate(motion, modal_system.slide, modal_system.free, modal_system.dense, table, at)
            - j.gives[GAMMA, 0, 1] * force[0]
            - j.gives[GAMMA, 0, 2] * force[1]
        )
        if whole:
            _, count = faces.solve_coupled_forces(q, v, modal_system, c, j)
            j.own[KNOWN] = 0.0
        else:
            _, count = faces.solved(q, v, motion, modal_system, table, at, c, j)
        return j.each[STEP, 0], j.each[PULL, 0], count
    else:
        return contact.solve(free, n.beta[0, 0], q, v, modal_system.dt, c, TIGHT * n.goal[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(i, q, v, motion, modal_system, table, at, c, j, n):
    """Friction and normal contact over a step from sample i, each under the mean force of the other: (dq [m], mean
    friction force [N], iterations, < 0 where they disagree); n.slot < 0 where no contact set fits. The mean forces on
    heave and pitch stand in n.few[3:5].

    Where friction moves heave and pitch too the secant, kept inside its bracket, finds the force that both agree on.
    The force jumps where a stop inside the step comes or goes with the guess; where none is its own answer, the mean
    force of the whole step, which does not jump between stick and slip at one coefficient, is sought in turn.
    """
    few = n.few
    beta = n.beta
    load = n.few[0]
    goal = n.goal[0]
    force = few[3:5]
    turn = few[6:8]
    out = few[8:17]
    begin = few[17:22]
    given = n.loads.size > 0
    coupled = beta[0, 1] != 0 or beta[0, 2] != 0
    moves = not given and (beta[1, 1] != 0 or beta[2, 2] != 0)
    heave = free_slide(motion, modal_system.reach, 1, table, at)
    pitch = free_slide(motion, modal_system.reach, 2, table, at)
    guess = n.mean[0]
    count = 0
    wrong = 0.0
    end = n.slot[0]
    bad = False
    low = -np.inf
    high = np.inf
    last_f = 0.0
    last_r = np.inf
    dq = 0.0
    used = 0.0
    after = load
    whole = False
    last = MOST
    if given:
        after = n.loads[i + 1]
        n.now[0] = after
    if POINTED:
        for k in range(n.now.size):
            c.pressed[0, k] = c.pressed[1, k]
    for outer in range(1, 2 * MOST + 1):
        if moves:
            end, its, wrong = press_step(
                n,
                n.slot[0],
                begin,
                heave - beta[1, 0] * guess,
                pitch - beta[2, 0] * guess,
                turn,
                out,
            )
            if end < 0:
                n.slot[0] = end
                return dq, used, count
            force[0] = out[0]
            force[1] = out[1]
            count += its
            after = 2 * max(n.sets.reference[REFERENCE_LOAD] - out[0], 0.0) - load
            if POINTED:
                press_state(n.sets, end, -(begin[0] + turn[0]), begin[1] + turn[1], n.now)
        weigh(load, after, c, j, n)
        dq, used, its = solve_step(q, v, force, whole, motion, modal_system, table, at, c, j, n)
        count += abs(its)
        bad = its < 0 or wrong > goal
        miss = used - guess
        if not (moves and coupled) or abs(miss) <= TIGHT * goal:
            break
        if outer == last or (
            high < np.inf and low > -np.inf and high - low <= 4e-16 * (abs(low) + abs(high))
        ):
            if STOPS:
                mean = 0.5 * (load + max(after, 0.0))
                if n.force[1] * mean <= abs(guess) <= n.force[0] * mean:
                    used = guess  # between kinetic and static friction the step starts to slip
                    dq = faces.slide_freely(used, j)
                    break
                if not whole:
                    whole = True
                    last = outer + MOST
                    low = -np.inf
                    high = np.inf
                    last_r = np.inf
                    continue
            bad = bad or abs(miss) > goal
            break
        if miss > 0:
            low = guess
        else:
            high = guess
        following = used
        if last_r < np.inf and miss != last_r:
            following = guess - miss * (guess - last_f) / (miss - last_r)
        last_f = guess
        last_r = miss
        if not (low < following < high) or outer % 8 == 0:
            following = 0.5 * (low + high) if low > -np.inf and high < np.inf else used
        guess = following
    n.mean[0] = used
    n.slot[0] = end
    if moves:
        few[0] = max(n.sets.reference[REFERENCE_LOAD] - out[3], 0.0)
    return dq, used, -count if bad else count
