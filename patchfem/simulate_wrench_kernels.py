"""Compiled step of modes that feel the whole wrench of the contact: normal force, moment and friction.

Heave h (> 0 away) and pitch t (> 0 opens +x) move the upper holder, so d = -h closes it. Over a step the modes move
exactly under constant forces. Those of the normal contact are the path mean of its slopes along the straight increment,
through every contact set on the way, so they do exactly the work E(end) - E(start) (a discrete gradient; McLachlan,
Quispel, Robidoux, Phil. Trans. R. Soc. A 357, 1999). Friction acts with the path mean of its law under the mean load of
the step. So the sum of all energies never rises by itself.
"""

from typing import NamedTuple

import numpy as np
from numba import njit

from .contact.press_kernels import locate, path_mean, press_state, pull
from .dynamics.kernels import note, sample, stored
from .friction.kernels import LEAN
from .simulate_rub_kernels import (
    COULOMB,
    RATE,
    press_all,
    rub_commit,
    rub_solve,
    rub_state,
)


class Body(NamedTuple):
    """omega, damp = 2 zeta omega, base, output (n,); rows (3, n): slide, heave and pitch; beta (3, 3): what a constant
    force in a step takes from them; arm [m]: half the length of the patch."""

    omega: np.ndarray
    damp: np.ndarray
    base: np.ndarray
    output: np.ndarray
    rows: np.ndarray
    beta: np.ndarray
    arm: float


@njit(error_model="numpy", **LEAN)
def free_rows(state, step, rows, s, c, out):
    """Increments of slide, heave and pitch (3,) over a step without forces of the contact."""
    out[:] = 0.0
    for i in range(state.shape[0]):
        move = step[i, 0, 0] * state[i, 0] + step[i, 0, 1] * state[i, 1] + step[i, 0, 3] * s + step[i, 0, 4] * c \
            - state[i, 0]
        for r in range(3):
            out[r] += rows[r, i] * move


@njit(error_model="numpy", **LEAN)
def pushed(rows, i, force, mass):
    """Acceleration of mode i under the forces (3,) on slide, heave and pitch."""
    return -(rows[0, i] * force[0] + rows[1, i] * force[1] + rows[2, i] * force[2]) / mass


@njit(error_model="numpy", **LEAN)
def moved(state, step, rows, mass, force, s, c):
    """Advance the modes in place by one step under constant forces (3,)."""
    for i in range(state.shape[0]):
        f = pushed(rows, i, force, mass)
        z = step[i, 0, 0] * state[i, 0] + step[i, 0, 1] * state[i, 1] + step[i, 0, 2] * f \
            + step[i, 0, 3] * s + step[i, 0, 4] * c
        v = step[i, 1, 0] * state[i, 0] + step[i, 1, 1] * state[i, 1] + step[i, 1, 2] * f \
            + step[i, 1, 3] * s + step[i, 1, 4] * c
        state[i, 0] = z
        state[i, 1] = v


@njit(error_model="numpy", **LEAN)
def spent(state, gauss, body, mass, drive, force, s, c, sines, dt, weights, out):
    """Add to `out` (3,) the work of the base [J], the viscous loss [J] and the integral of |power in| [J]."""
    for k in range(weights.size):
        power, loss = 0.0, 0.0
        for i in range(state.shape[0]):
            v = gauss[k, i, 1, 0] * state[i, 0] + gauss[k, i, 1, 1] * state[i, 1] \
                + gauss[k, i, 1, 2] * pushed(body.rows, i, force, mass) + gauss[k, i, 1, 3] * s + gauss[k, i, 1, 4] * c
            power -= mass * body.base[i] * drive * sines[k] * v
            loss += mass * body.damp[i] * v * v
        share = weights[k] * dt / 2
        out[0] += share * power
        out[1] += share * loss
        out[2] += share * abs(power)


@njit(error_model="numpy", **LEAN)
def place_of(state, rows, r):
    """Slide, heave or pitch of the modes."""
    out = 0.0
    for i in range(state.shape[0]):
        out += rows[r, i] * state[i, 0]
    return out


@njit(error_model="numpy", **LEAN)
def press_step(book, k0, begin, f1, f2, beta, arm, stiff, move, out):
    """Heave and pitch of a step: (dh, dt) = (f1, f2) - beta mean slope, by Newton's method with step halving from the
    free motion. Returns (piece at the end, iterations, residual as a force [N]); `out` as in `path_mean`.

    The slopes have a convex potential, so the answer is unique; inside one piece one step finds it.
    """
    b11, b12, b21, b22 = beta[1, 1], beta[1, 2], beta[2, 1], beta[2, 2]
    dh, dt = move[0], move[1]
    old_h, old_t, step_h, step_t, part, best = dh, dt, 0.0, 0.0, 1.0, np.inf
    k = k0
    for count in range(1, 100):
        k = path_mean(book, k0, begin[0], begin[1], dh, dt, out)
        if k < 0:
            return k, count, np.inf
        p1, p2 = b11 * out[0] + b12 * out[1], b21 * out[0] + b22 * out[1]
        r1, r2 = dh - f1 + p1, dt - f2 + p2
        size = abs(r1) + arm * abs(r2)
        noise = 4e-16 * (abs(dh) + abs(f1) + abs(p1) + arm * (abs(dt) + abs(f2) + abs(p2)))
        move[0], move[1] = dh, dt
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
                move[0], move[1] = old_h, old_t
                k = path_mean(book, k0, begin[0], begin[1], old_h, old_t, out)
                return k, count, best / (b11 + b22 / (arm * arm) + 2 / stiff)
        dh, dt = old_h - part * step_h, old_t - part * step_t
    return k, 100, best / (b11 + b22 / (arm * arm) + 2 / stiff)


@njit(error_model="numpy", cache=True)
def march_wrench(first, steps, state, held, at_piece, body, prop, drive, mass, kind, rub, book, loads, goal, travel,
                 ledger, rows, press):
    """March `steps` steps from step number `first` of the drive.

    held (2,): last friction force, mean force of the step before; at_piece (1,) slot of the present piece; rub:
    `simulate_rub_kernels.Rub`; loads (steps + 1,) [N]: prescribed load at the steps, empty where the contact says it;
    ledger and rows as in `simulate_kernels.march`; press (steps + 1, 5): load, moment, energy of the preloaded contact,
    heave, pitch. Returns (steps done, status): 0 finished, 1 travel exceeded, 3 not finite, 4 no contact set fits.
    """
    step, gauss, sine, sine_gauss, weights, dt, _ = prop
    n = body.omega.size
    around = sine.shape[0] - 1
    free, force, move, out, begin = np.empty(3), np.zeros(3), np.zeros(2), np.zeros(9), np.zeros(5)
    beta = body.beta
    given = loads.size > 0
    apart = given or (beta[1, 1] == 0 and beta[2, 2] == 0)
    mixed = not apart and (beta[0, 1] != 0 or beta[0, 2] != 0)
    stiff, load, k = book.base[4], book.base[0], at_piece[0]
    for i in range(steps + 1):
        q, v, reach = sample(rows[i], state, body.rows[0], body.output)
        begin[0], begin[1] = place_of(state, body.rows, 1), place_of(state, body.rows, 2)
        if given:
            load = loads[i]
            rub.now[0] = load
        else:
            k = locate(book, k, -begin[0], begin[1])
            if k < 0:
                return i, 4
            begin[2], begin[3], begin[4] = pull(book, k, begin[0], begin[1])
            load, moment, _ = press_state(book, k, -begin[0], begin[1], rub.now)
            press[i, 1], press[i, 2] = moment, begin[2]
            load = max(load, 0.0)
        press[i, 0], press[i, 3], press[i, 4] = load, begin[0], begin[1]
        if kind == COULOMB or kind == RATE:
            bound = load * max(rub.force[0], rub.force[1] if kind == COULOMB else 0.0)
            held[0] = min(max(held[0], -bound), bound)
        now, energy, slip = rub_state(kind, rub, q, held[0])
        status = note(rows[i], now, energy, slip, reach, travel,
                      energy + begin[2] + stored(state, body.omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        s, co = sine[at, 0], sine[at, 1]
        free_rows(state, step, body.rows, s, co, free)
        for j in range(rub.now.size):
            rub.before[j] = rub.now[j]
        guess, count, wrong, end = held[1], 0, 0.0, k
        low, high, last_f, last_r = -np.inf, np.inf, 0.0, np.inf
        dq, used = 0.0, 0.0
        bad = False
        for outer in range(1, 81):
            mean, after = load, load
            if given:
                after = loads[i + 1]
                rub.now[0] = after
                mean = 0.5 * (load + after)
            elif not apart:
                end, its, wrong = press_step(book, k, begin, free[1] - beta[1, 0] * guess, free[2] - beta[2, 0] * guess,
                                             beta, body.arm, stiff, move, out)
                if end < 0:
                    return i, 4
                force[1], force[2] = out[0], out[1]
                count += its
                mean = max(book.base[0] - out[0], 0.0)
                if kind != COULOMB and kind != RATE:
                    press_state(book, end, -(begin[0] + move[0]), begin[1] + move[1], rub.now)
            slides = free[0] - beta[0, 1] * force[1] - beta[0, 2] * force[2]
            press_all(kind, rub)
            dq, used, its = rub_solve(slides, beta[0, 0], rows[i, 2 * n + 1], dt, kind, rub, mean, goal, held[1])
            count += abs(its)
            bad = its < 0 or wrong > goal
            miss = used - guess
            if not mixed or abs(miss) <= 0.01 * goal:
                break
            if outer == 80 or (high < np.inf and low > -np.inf and high - low <= 4e-16 * (abs(low) + abs(high))):
                if kind == COULOMB and beta[0, 0] > 0 and rub.force[1] * mean <= abs(guess) <= rub.force[0] * mean:
                    used = guess  # between kinetic and static friction the step starts to slip
                    dq = slides - beta[0, 0] * used
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
        force[0] = used
        ledger[5] += count
        ledger[6] = max(ledger[6], count)
        ledger[7] += 1.0 if bad else 0.0
        ledger[8] += used * dq
        spent(state, gauss, body, mass, drive, force, s, co, sine_gauss[at], dt, weights, ledger)
        moved(state, step, body.rows, mass, force, s, co)
        rows[i, 2 * n + 4] = used
        held[1] = used
        v1 = 0.0
        for j in range(n):
            v1 += body.rows[0, j] * state[j, 1]
        ledger[3] += rub_commit(dq, used, v, v1, dt, kind, rub)
        held[0] = used
        if not given and not apart:
            load = max(book.base[0] - out[3], 0.0)
            k = end
            at_piece[0] = k
        elif given:
            load = loads[i + 1]
        if kind == RATE:
            held[0] = rub.force[0] * load * np.tanh(v1 / rub.force[1])
        elif kind == COULOMB and dq != 0.0:
            held[0] = rub.force[1] * load * (1.0 if dq > 0 else -1.0)
        elif kind == COULOMB:
            held[0] = stuck(state, body, mass, drive, sine[at + 1, 0], out[3] if not apart else 0.0,
                            out[4] if not apart else 0.0)
    return steps, 0


@njit(error_model="numpy", **LEAN)
def stuck(state, body, mass, drive, s, pulled, turned):
    """Friction force at which the slide does not accelerate."""
    need, gain, rows = 0.0, 0.0, body.rows
    for i in range(state.shape[0]):
        free = -body.base[i] * drive * s - body.damp[i] * state[i, 1] - body.omega[i] ** 2 * state[i, 0] \
            - (rows[1, i] * pulled + rows[2, i] * turned) / mass
        need += rows[0, i] * free
        gain += rows[0, i] * rows[0, i] / mass
    return need / gain if gain > 0 else 0.0
