"""The compiled hub: the one loop in which the laws of friction and the modes meet, and its twin for a given slide.

Over a step the modes move exactly under the path-mean of the friction force along the straight increment of slide,
which does exactly the work of the law: the sum of all energies never rises by itself. A contact that is a list of bonds
has a loop of its own, so that a scene compiles only what it names.
"""

import numpy as np
from numba import njit

from .dynamics.kernels import accelerations, free_slide, move, note, sample, step_energy, stored, tell
from .friction.kernels import LEAN, grow
from .friction.slide_kernels import rigid_path
from .simulate_step_kernels import (
    COULOMB,
    JENKINS,
    LIST,
    POINTS,
    RATE,
    Contact,
    Modes,
    Steps,
    Work,
    commit,
    contact_state,
    contact_step,
    pressure_at,
    scalar_force,
    solve_modes,
)

__all__ = ["COULOMB", "JENKINS", "LIST", "POINTS", "RATE", "Contact", "Modes", "Steps", "Work", "contact_state",
           "follow_path", "march", "march_contact"]


@njit(error_model="numpy", **LEAN)
def sources(kind, c, q0, dq):
    """Pressure under the new bonds when it stays on the lower piece: mean of the places at the ends of the step."""
    for j in range(c.source.size):
        here = c.place[j] + q0
        c.source[j] = 0.5 * (pressure_at(here, c.x, c.sigma) + pressure_at(here + dq, c.x, c.sigma))


def march(first, steps, state, held, modes, prop, drive, mass, kind, follow, c, work, goal, travel, ledger, rows):
    """March `steps` steps from step number `first` of the drive; 0.2-0.5 us per step and a few ns per point.

    modes: (omega, 2 zeta omega, slide, base, output); prop: (step, gauss, sine, sine_gauss, weights, dt, beta);
    held: (1,) last friction force (kind 0); ledger (9,): work in, viscous loss, |power in|, friction loss, peak stored,
    iterations, worst iterations, steps without convergence, friction work;
    rows (steps + 1, 2 n + 6): z, z', q, q', F, slip, mean force of the step that follows, energy in the interface.
    Returns (steps done, status): 0 finished, 1 travel exceeded, 2 bond list full, 3 not finite.
    """
    if kind == LIST:
        from .simulate_list_kernels import march_list

        return march_list(first, steps, state, modes, prop, drive, mass, c, work, goal, travel, ledger, rows)
    return march_contact(first, steps, state, held, modes, prop, drive, mass, kind, follow, c, work, goal, travel,
                         ledger, rows)


@njit(error_model="numpy", cache=True)
def march_contact(first, steps, state, held, modes, prop, drive, mass, kind, follow, c, work, goal, travel, ledger,
                  rows):
    """`march` of the kinds without a list."""
    omega, damp, slide, base, output = modes
    step, gauss, sine, sine_gauss, weights, dt, beta = prop
    n = omega.size
    around = sine.shape[0] - 1
    accel = np.empty(n)
    for i in range(steps + 1):
        q, v, out = sample(rows[i], state, slide, output)
        force, energy, slip = contact_state(kind, c, q, held[0])
        status = note(rows[i], force, energy, slip, out, travel, energy + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        s, co = sine[at, 0], sine[at, 1]
        free = free_slide(state, step, slide, s, co)
        if follow:
            sources(kind, c, q, free if abs(free) < 1e-3 else 0.0)
        dq, force, count, middle = contact_step(free, beta, v, dt, kind, c, work, goal)
        if follow:
            for _ in range(20):
                guess = dq
                sources(kind, c, q, dq)
                dq, force, count, middle = contact_step(free, beta, v, dt, kind, c, work, goal)
                if abs(dq - guess) <= 1e-12 * (abs(dq) + 1e-12):
                    break
        used = (free - dq) / beta
        tell(count, used * dq, ledger)
        step_energy(state, gauss, slide, base, damp, mass, drive, used, s, co, sine_gauss[at], dt, weights, ledger)
        v1 = move(state, step, slide, mass, used, s, co)
        held[0] = used
        if kind == RATE:
            held[0] = c.force[0] * np.tanh(v1 / c.force[1])
        rows[i, 2 * n + 4] = used
        if kind == COULOMB and dq == 0.0:
            accelerations(state, omega, damp, slide, base, mass, drive, 0.0, sine[at + 1, 0], accel)
            need, gain = 0.0, 0.0
            for k in range(n):
                need += slide[k] * accel[k]
                gain += slide[k] * slide[k] / mass
            held[0] = min(max(need / gain, -c.force[0]), c.force[0])
        burnt, ok = commit(dq, used, v, v1, dt, kind, c, work, middle, q, follow)
        ledger[3] += burnt
        if not ok:
            return i, 2
    return steps, 0


@njit(error_model="numpy", cache=True)
def follow_contact(path, dt, kind, c, work, goal, burnt, forces):
    """`follow_path` of the kinds without a list."""
    bad = 0
    if kind == POINTS and c.b.size == 0:
        rigid_path(path, dt, c.weight, c.bonds, c.source, c.growth, work.eps, burnt, forces)
        return bad
    for i in range(path.size):
        force, energy, slip = contact_state(kind, c, path[i], 0.0)
        forces[i, 0], forces[i, 2], burnt[i, 1] = force, slip, energy
        if i == path.size - 1:
            break
        dq = path[i + 1] - path[i]
        v = dq / dt if dt > 0 else 0.0
        y, last = work.y, work.last
        for k in range(y.size):
            y[k] = 2 * last[0, k] - last[1, k]
        y[0] = dq
        middle = work.eps[0]
        if kind == POINTS:
            middle = grow(middle, v, v, abs(dq) / 2, dt / 2, c.growth)[0]
        if y.size == 1:
            mean, count = scalar_force(dq, kind, c, middle, dt)[0], 1
        else:
            mean, count = solve_modes(y, dq, 0.0, c, middle, goal, work)
        bad += count < 0
        forces[i, 1] = mean
        burnt[i, 0] = commit(dq, mean, v, v, dt, kind, c, work, middle, path[i], False)[0]
    return bad


def follow_path(path, dt, kind, c, work, goal, burnt, forces):
    """Resultant along a prescribed slide path (k,) [m] with steps of dt [s].

    forces (k, 3): force at the sample, mean over the step that follows, irreversible slip; burnt (k, 2): energy
    dissipated in the step that follows, energy stored at the sample. Returns the steps that did not converge or found
    the list of bonds full.
    """
    if kind == LIST:
        from .simulate_list_kernels import follow_list

        return follow_list(path, dt, c, burnt, forces)
    return follow_contact(path, dt, kind, c, work, goal, burnt, forces)
