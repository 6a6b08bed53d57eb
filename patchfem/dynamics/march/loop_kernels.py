"""The compiled hub: the one loop in which the laws of friction and the modes meet, and its twin for a given slide.

Over a step the modes move exactly under the path-mean of the friction force along the straight increment of slide,
which does exactly the work of the law: the sum of all energies never rises by itself. A contact that is a list of bonds
has a loop of its own, so that a scene compiles only what it names.
"""

import numpy as np
from numba import njit

from ...friction.bonds.point_kernels import grow
from ...friction.bonds.slide_kernels import rigid_path
from ...friction.flags_kernels import LEAN
from ..modal_kernels import accelerations, free_slide, move, note, push_back, sample, stored, tell
from .step_kernels import (
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
    scalar_force,
    solve_modes,
)

__all__ = ["COULOMB", "JENKINS", "LIST", "POINTS", "RATE", "Contact", "Modes", "Steps", "Work", "contact_state",
           "follow_path", "march", "march_contact"]


def march(first, steps, state, held, modes, prop, table, mass, kind, follow, c, work, goal, travel, ledger, rows):
    """March `steps` steps, the first by row `first` of the table (in turns); 0.1-0.3 us per step, a few ns per point.

    modes: Modes; prop: Steps; table: of `propagator.Propagator`; state (2, n); held: (1,) last friction force (kind 0);
    ledger (9,): work in, viscous loss, |work in| per step, friction loss, peak stored, iterations, worst iterations,
    steps without convergence, friction work;
    rows (steps + 1, 2 n + 6): z, z', q, q', F, slip, mean force of the step that follows, energy in the interface.
    Returns (steps done, status): 0 finished, 1 travel exceeded, 2 bond list full, 3 not finite.
    """
    if kind == LIST:
        from .bond_list_kernels import march_list

        return march_list(first, steps, state, modes, prop, table, mass, c, work, goal, travel, ledger, rows)
    if kind == JENKINS:
        from .jenkins_kernels import march_jenkins

        return march_jenkins(first, steps, state, modes, prop, table, mass, c.stretch, c.stiffness, c.limit, c.now,
                             work.last[:, 0], c.force[2], goal, travel, ledger, rows)
    if follow:
        from .follow_kernels import march_follow

        return march_follow(first, steps, state, modes, prop, table, mass, c, work, goal, travel, ledger, rows)
    return march_contact(first, steps, state, held, modes, prop, table, mass, kind, c, work, goal, travel, ledger, rows)


@njit(error_model="numpy", cache=True)
def march_contact(first, steps, state, held, modes, prop, table, mass, kind, c, work, goal, travel, ledger,
                  rows):
    """`march` of the kinds without a list."""
    omega, damp, slide, base, output, damping = modes
    free_map, push, dense, reach, loss, dense_loss, dt, beta = prop
    n = slide.size
    around = table.shape[0]
    accel, spare = np.empty(n), np.empty((2, n))
    for i in range(steps + 1):
        q, v, out = sample(rows[i], state, slide, output)
        force, energy, slip = contact_state(kind, c, q, held[0])
        status = note(rows[i], force, energy, slip, out, travel, energy + stored(state, omega, mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        free = free_slide(state, reach, 0, table, at)
        dq, force, count, middle = contact_step(free, beta, v, dt, kind, c, work, goal)
        used = (free - dq) / beta
        tell(count, used * dq, ledger)
        push_back(used, slide, mass, accel)
        move(state, free_map, push, loss, dense, dense_loss, table, at, accel, spare, ledger)
        v1 = 0.0
        for k in range(n):
            v1 += slide[k] * state[1, k]
        held[0] = used
        if kind == RATE:
            held[0] = c.force[0] * np.tanh(v1 / c.force[1])
        rows[i, 2 * n + 4] = used
        if kind == COULOMB and dq == 0.0:
            held[0] = holding(state, omega, damp, damping, base, slide, table[at, 8 * n + 2], mass, c.force[0], accel,
                              spare)
        burnt, ok = commit(dq, used, v, v1, dt, kind, c, work, middle, q, False)
        ledger[3] += burnt
        if not ok:
            return i, 2
    return steps, 0


@njit(error_model="numpy", **LEAN)
def holding(state, omega, damp, damping, base, slide, drive, mass, limit, accel, spare):
    """Friction force [N] within the limit that keeps the slide from accelerating at an instant; drive [m s-2]."""
    for k in range(accel.size):
        accel[k] = 0.0
    accelerations(state, omega, damp, damping, base, drive, accel, spare)
    need, gain = 0.0, 0.0
    for k in range(accel.size):
        need += slide[k] * spare[0, k]
        gain += slide[k] * slide[k] / mass
    return min(max(need / gain, -limit), limit)


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
        from .bond_list_kernels import follow_list

        return follow_list(path, dt, c, burnt, forces)
    return follow_contact(path, dt, kind, c, work, goal, burnt, forces)
