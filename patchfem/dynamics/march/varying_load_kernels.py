"""Compiled step of modes that feel the normal force, the moment and the friction of the contact.

Heave h (> 0 away) and pitch t (> 0 opens +x) move the upper holder, so d = -h closes it. Over a step the modes move
exactly under constant forces. Those of the normal contact are the path mean of its slopes along the straight increment,
through every contact set on the way, so they do exactly the work E(end) - E(start) (a discrete gradient; McLachlan,
Quispel, Robidoux, Phil. Trans. R. Soc. A 357, 1999). Friction acts with the path mean of its law under the mean load of
the step; Coulomb's stops and goes inside it, under a load that changes linearly (`contacts.stop_kernels`). So the sum
of all energies never rises by itself.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.inner import njit
from ...contact.press_kernels import locate, press_state, pull
from ...contact.press_path_kernels import path_mean
from ...friction.flags_kernels import LEAN
from ..contacts.stop_kernels import through
from ..modal_kernels import (
    accelerations,
    free_rate,
    free_slide,
    move,
    note,
    rate_given,
    sample,
    stored,
    struck,
)
from .varying_friction_kernels import COULOMB, RATE, press_all, rub_commit, rub_solve, rub_state, spring_back


class Ports(NamedTuple):
    """rows (3, n): slide, heave and pitch per coordinate; beta (3, 3): what constant forces in a step take from them;
    arm [m]: half the length of the patch."""

    rows: np.ndarray
    beta: np.ndarray
    arm: float


@njit(error_model="numpy", **LEAN)
def place_of(state, rows, r):
    """Slide, heave or pitch of the modes."""
    out = 0.0
    for i in range(state.shape[1]):
        out += rows[r, i] * state[0, i]
    return out


@njit(error_model="numpy", **LEAN)
def pushed(rows, force, mass, accel):
    """Modal accelerations (n,) under the forces (3,) that resist slide, heave and pitch."""
    for i in range(accel.size):
        accel[i] = -(rows[0, i] * force[0] + rows[1, i] * force[1] + rows[2, i] * force[2]) / mass


@njit(error_model="numpy", **LEAN)
def press_step(sets, k0, begin, f1, f2, beta, arm, turn, out):
    """Heave and pitch of a step: (dh, dt) = (f1, f2) - beta mean slope, by Newton's method with step halving from the
    guess in `turn` (2,). Returns (set at the end, iterations, residual as a force [N]); `out` as in `path_mean`.

    The slopes have a convex potential, so the answer is unique; inside one set one step finds it.
    """
    b11, b12, b21, b22 = beta[1, 1], beta[1, 2], beta[2, 1], beta[2, 2]
    dh, dt = turn[0], turn[1]
    old_h, old_t, step_h, step_t, part, best = dh, dt, 0.0, 0.0, 1.0, np.inf
    k = k0
    for count in range(1, 100):
        k = path_mean(sets, k0, begin[0], begin[1], dh, dt, out)
        if k < 0:
            return k, count, np.inf
        p1, p2 = b11 * out[0] + b12 * out[1], b21 * out[0] + b22 * out[1]
        r1, r2 = dh - f1 + p1, dt - f2 + p2
        size = abs(r1) + arm * abs(r2)
        noise = 4e-16 * (abs(dh) + abs(f1) + abs(p1) + arm * (abs(dt) + abs(f2) + abs(p2)))
        turn[0], turn[1] = dh, dt
        if size <= noise:
            return k, count, 0.0
        if size < best * (1 - 0.1 * part) or best == np.inf:
            best, part, old_h, old_t = size, 1.0, dh, dt
            j11, j12 = 1 + b11 * out[5] + b12 * out[7], b11 * out[6] + b12 * out[8]
            j21, j22 = b21 * out[5] + b22 * out[7], 1 + b21 * out[6] + b22 * out[8]
            det = j11 * j22 - j12 * j21
            step_h, step_t = (j22 * r1 - j12 * r2) / det, (j11 * r2 - j21 * r1) / det
        else:
            part *= 0.5
            if part < 1e-9 or size <= 64 * noise or (part < 0.2 and best <= 1e3 * noise):
                turn[0], turn[1] = old_h, old_t
                k = path_mean(sets, k0, begin[0], begin[1], old_h, old_t, out)
                return k, count, best / (b11 + b22 / (arm * arm) + 2 / sets.base[4])
        dh, dt = old_h - part * step_h, old_t - part * step_t
    return k, 100, best / (b11 + b22 / (arm * arm) + 2 / sets.base[4])


@njit(error_model="numpy", **LEAN)
def pressed(begin, k, load, pointed, sets, rub):
    """Contact at a sample whose heave and pitch stand in begin (5,): (set, load [N], moment [N m]); the energy and
    the pull of the preloaded contact into the rest of `begin`. The load stays where no contact set fits: set < 0."""
    k = locate(sets, k, -begin[0], begin[1])
    if k < 0:
        return k, load, sets.base[1]
    begin[2], begin[3], begin[4] = pull(sets, k, begin[0], begin[1])
    if pointed:
        press_state(sets, k, -begin[0], begin[1], rub.now)
    return k, max(sets.base[0] - begin[3], 0.0), sets.base[1] - begin[4]


@njit(error_model="numpy", **LEAN)
def slid_on(free, force, load, mean, v, dt, beta, rub, ends):
    """(slide dq [m], mean friction force [N]) of a step of Coulomb's law under a load that goes from `load` to 2 mean -
    load [N]; its speed at the end and whether it rests there into `ends`, as of `agreed`."""
    after = max(2 * mean - load, 0.0)
    rate = ends[0] - ends[2] * force[1] - ends[3] * force[2]
    dq, ends[5], rests = through(free, rate, beta, ends[1], ends[4], v, dt, rub.force[0] * load, rub.force[0] * after,
                                 rub.force[1] * load, rub.force[1] * after, v == 0.0 or ends[6] == 1.0, np.inf)
    ends[7] = 1.0 if rests else 0.0
    return dq, (free - dq) / beta


@njit(error_model="numpy", **LEAN)
def agreed(free, k, load, after, v, held, begin, coupling, dt, kind, ports, rub, sets, goal, force, turn, out,
           ends):
    """Friction and normal contact over a step, each under the mean force of the other: (dq [m], mean friction force
    [N], set at its end, iterations, True where they disagree); set < 0 where no contact set fits.

    after [N]: load at the end, NaN where the contact says it; coupling: 0 where the load does not follow the motion, 1
    where it follows heave and pitch alone, 2 where friction moves them too. Then the secant, kept inside its bracket,
    finds the friction force that both agree on. ends (8,): slide speed at the end without forces; what forces on slide,
    heave and pitch take from it [m/(s N)]; acceleration per friction [1/kg]; of Coulomb's law the speed at the end,
    whether it rests at the start and at the end of the step.
    """
    beta, pointed = ports.beta, not (kind == COULOMB or kind == RATE)
    guess, count, wrong, end, bad = held[1], 0, 0.0, k, False
    low, high, last_f, last_r = -np.inf, np.inf, 0.0, np.inf
    dq, used = 0.0, 0.0
    for outer in range(1, 81):
        mean = load
        if not np.isnan(after):
            rub.now[0] = after
            mean = 0.5 * (load + after)
        elif coupling > 0:
            end, its, wrong = press_step(sets, k, begin, free[1] - beta[1, 0] * guess, free[2] - beta[2, 0] * guess,
                                         beta, ports.arm, turn, out)
            if end < 0:
                return dq, used, end, count, True
            force[1], force[2] = out[0], out[1]
            count += its
            mean = max(sets.base[0] - out[0], 0.0)
            if pointed:
                press_state(sets, end, -(begin[0] + turn[0]), begin[1] + turn[1], rub.now)
        slides = free[0] - beta[0, 1] * force[1] - beta[0, 2] * force[2]
        press_all(kind, rub)
        if kind == COULOMB and beta[0, 0] > 0.0:
            (dq, used), its = slid_on(slides, force, load, mean, v, dt, beta[0, 0], rub, ends), 1
        else:
            dq, used, its = rub_solve(slides, beta[0, 0], v, dt, kind, rub, mean, goal, held[1])
        count += abs(its)
        bad = its < 0 or wrong > goal
        miss = used - guess
        if coupling < 2 or abs(miss) <= 0.01 * goal:
            break
        if outer == 80 or (high < np.inf and low > -np.inf and high - low <= 4e-16 * (abs(low) + abs(high))):
            if kind == COULOMB and beta[0, 0] > 0 and rub.force[1] * mean <= abs(guess) <= rub.force[0] * mean:
                used = guess  # between kinetic and static friction the step starts to slip
                dq = slides - beta[0, 0] * used
                ends[5], ends[7] = ends[0] - ends[2] * force[1] - ends[3] * force[2] - ends[1] * used, 0.0
            else:
                bad = bad or abs(miss) > goal
            break
        if miss > 0:
            low = guess
        else:
            high = guess
        following = used
        if last_r < np.inf and miss != last_r:
            following = guess - miss * (guess - last_f) / (miss - last_r)
        last_f, last_r = guess, miss
        if not (low < following < high) or outer % 8 == 0:
            following = 0.5 * (low + high) if low > -np.inf and high < np.inf else used
        guess = following
    return dq, used, end, count, bad


@njit(error_model="numpy", **LEAN)
def last_force(used, v1, load, state, kind, plant, rub, ports, force, at, table, accel, spare, rests):
    """Friction force [N] at the end of a step: of the speed, of the slip, or what keeps a contact at rest there."""
    if kind == RATE:
        return rub.force[0] * load * np.tanh(v1 / rub.force[1])
    if kind != COULOMB:
        return used
    if not rests:
        return rub.force[1] * load * (1.0 if v1 > 0 else -1.0)
    force[0] = 0.0
    pushed(ports.rows, force, plant.mass, accel)
    base = table[at, 8 * accel.size + 2]
    accelerations(state, plant.omega, plant.damp, plant.damping, plant.base, base, accel, spare)
    need, gain = 0.0, 0.0
    for j in range(accel.size):
        need += plant.slide[j] * spare[0, j]
        gain += plant.slide[j] * plant.slide[j] / plant.mass
    return need / gain if gain > 0 else 0.0


@njit(error_model="numpy", cache=True, **LEAN)
def march(first, steps, state, held, at_set, plant, ports, table, kind, rub, sets, loads, goal, travel, room,
          ledger, rows):
    """March `steps` steps from row `first` of the table of the drive.

    held (3,): last friction force, mean force of the step before, 1 while Coulomb friction holds; at_set (1,): slot of
    the present set; rub: `dynamics.contacts.arrays.Rub`; loads (steps + 1,) [N]: prescribed load at the
    steps, empty where the contact says it; room: (numbers (30,), (3, n)) to work in;
    ledger as in `dynamics.march.loop_kernels.march`; rows (steps + 1, 2 n + 12) as there, then load, moment, energy of
    the preloaded contact, heave, pitch. Returns (steps done, status): 0 finished, 1 travel exceeded, 3 not finite, 4 no
    contact set fits.
    """
    slide, mass, n, around, beta = plant.slide, plant.mass, plant.omega.size, table.shape[0], ports.beta
    few, accel, spare = room[0], room[1][0], room[1][1:]
    free, force, turn, out, begin, ends = few[:3], few[3:6], few[6:8], few[8:17], few[17:22], few[22:]
    few[:] = 0.0
    for r in range(3):
        ends[1 + r] = rate_given(ports.rows[0], ports.rows[r], plant.push, plant.dense, mass)
    for j in range(n):
        ends[4] += slide[j] * slide[j] / mass
    ends[6] = held[2]
    given, pointed = loads.size > 0, not (kind == COULOMB or kind == RATE)
    apart = given or (beta[1, 1] == 0 and beta[2, 2] == 0)
    coupling = 0 if apart else (2 if beta[0, 1] != 0 or beta[0, 2] != 0 else 1)
    load, k = sets.base[0], at_set[0]
    for i in range(steps + 1):
        q, v, stroke = sample(rows[i], state, slide, plant.output)
        begin[0], begin[1] = place_of(state, ports.rows, 1), place_of(state, ports.rows, 2)
        moment = sets.base[1]
        if given:
            load = loads[i]
            rub.now[0] = load
        else:
            k, load, moment = pressed(begin, k, load, pointed or i == steps, sets, rub)
            if k < 0:
                return i, 4
        at_set[0] = k
        rows[i, 2 * n + 7], rows[i, 2 * n + 8], rows[i, 2 * n + 9] = load, moment, begin[2]
        rows[i, 2 * n + 10], rows[i, 2 * n + 11] = begin[0], begin[1]
        bound = load * (np.inf if pointed else rub.force[0]) if load > 0 else 0.0
        held[0] = min(max(held[0], -bound), bound)
        now, energy, slip = rub_state(kind, rub, q, held[0])
        status = note(rows[i, :2 * n + 6], now, energy, slip, stroke, travel, energy + begin[2]
                      + stored(state, plant.omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        for r in range(3):
            free[r] = free_slide(state, plant.reach, r, table, at)
        ends[0] = free_rate(state, slide, plant.free, plant.dense, table, at) if kind == COULOMB else 0.0
        for j in range(rub.now.size if pointed else 0):
            rub.before[j] = rub.now[j]
        dq, used, end, count, bad = agreed(free, k, load, loads[i + 1] if given else np.nan, v, held, begin, coupling,
                                           plant.dt, kind, ports, rub, sets, goal, force, turn, out, ends)
        if end < 0:
            return i, 4
        force[0] = used
        ledger[5] += count
        ledger[6] = max(ledger[6], count)
        ledger[7] += 1.0 if bad else 0.0
        pushed(ports.rows, force, mass, accel)
        move(state, plant.free, plant.push, plant.loss, plant.dense, plant.dense_loss, table, at, accel, spare, ledger)
        rows[i, 2 * n + 4], work = used, used * dq
        held[1], k, v1 = used, end, 0.0
        for j in range(n):
            v1 += slide[j] * state[1, j]
        if kind == COULOMB and beta[0, 0] > 0.0 and ends[5] != v1:
            blow = struck(state, slide, ends[5], v1, mass)
            work, v1 = work + blow, ends[5]
            ledger[3] += blow
        rows[i, 2 * n + 6] = work
        ledger[8] += work
        ends[6] = ends[7]
        held[2] = ends[6]
        ledger[3] += rub_commit(dq, used, v, v1, plant.dt, kind, rub)
        if rub.b.size:
            lost, its = spring_back(kind, rub, goal)
            ledger[3] += lost
            ledger[5] += abs(its)
            ledger[7] += 1.0 if its < 0 and not bad else 0.0
        if given:
            load = loads[i + 1]
        elif not apart:
            load = max(sets.base[0] - out[3], 0.0)
            force[1], force[2] = out[3], out[4]
        held[0] = last_force(used, v1, load, state, kind, plant, rub, ports, force, at, table, accel, spare,
                             ends[7] == 1.0)
    return steps, 0
