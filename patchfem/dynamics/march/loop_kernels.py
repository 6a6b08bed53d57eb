"""The compiled loop where one interface and the modes meet, and its twin for a slide that is given.

Over a step the modes move exactly under the path mean of the friction force along the straight increment of slide,
which does exactly the work of the law: the sum of all energies never rises by itself. A set-valued contact says too at
what speed the step ends, and what it takes for it is friction work as well. The text runs with any contact: `hub` makes
an instance per contact, of a module with solve, passed, given, commit, state and hold as those named here.
"""

from math import inf

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ..contacts import element_kernels as contact
from ..modal_kernels import (
    accelerations,
    free_rate,
    free_slide,
    move,
    note,
    push_back,
    rate_given,
    sample,
    stored,
    struck,
    tell,
)

SET_VALUED = contact.SET_VALUED  # a name of this module, which numba leaves branches out by


@njit(error_model="numpy", cache=True, **LEAN)
def march(first, steps, motion, plant, table, c, goal, travel, ledger, rows):
    """March `steps` steps, the first by row `first` of the table (in turns); 0.1-0.3 us per step, a few ns per point.

    motion (2, n): coordinates and rates; table: of `propagator.Propagator`; c: Contact of the contact; goal [N];
    ledger (9,): work in, viscous loss, |work in| per step, friction loss, peak stored, iterations, worst iterations,
    steps without convergence, friction work;
    rows (steps + 1, 2 n + 7): z, z', q, q', F, slip, mean force of the step that follows, energy in the interface,
    friction work of the step that follows [J].
    Returns (steps done, status): 0 finished, 1 travel exceeded, 2 memory of the contact full, 3 not finite.
    """
    slide, output, dt, beta = plant.slide, plant.output, plant.dt, plant.beta
    n, around = slide.size, table.shape[0]
    accel, spare = plant.room[0], plant.room[1:]
    gamma, share, speed, count = rate_given(slide, slide, plant.push, plant.dense, plant.mass), 0.0, 0.0, 1
    for k in range(n):
        share += slide[k] * slide[k] / plant.mass
    for i in range(steps + 1):
        q, v, out = sample(rows[i], motion, slide, output)
        force, energy, slip = contact.state(c, q, v)
        status = note(rows[i, :2 * n + 6], force, energy, slip, out, travel,
                      energy + stored(motion, plant.omega, plant.mass), ledger)
        if status:
            return i, status
        if i == steps:
            break
        at = (first + i) % around
        free = free_slide(motion, plant.reach, 0, table, at)
        if SET_VALUED:
            rate = free_rate(motion, slide, plant.free, plant.dense, table, at)
            top = held_force(motion, plant, table, at, free / beta, accel) if abs(v) * dt <= 1e-6 * abs(free) else inf
            dq, speed = contact.passed(free, rate, beta, gamma, share, v, dt, c, top)
        else:
            dq, _, count = contact.solve(free, beta, q, v, dt, c, goal)
        used = (free - dq) / beta
        push_back(used, slide, plant.mass, accel)
        move(motion, plant.free, plant.push, plant.loss, plant.dense, plant.dense_loss, table, at, accel, spare, ledger)
        rows[i, 2 * n + 4] = used
        after = 0.0
        for k in range(n):
            after += slide[k] * motion[1, k]
        lost, ok = contact.commit(dq, used, q, v, after, dt, c)
        work = used * dq
        if SET_VALUED:
            if speed != after:
                blow = struck(motion, slide, speed, after, plant.mass)
                work += blow
                lost += blow
            contact.hold(c, holding(motion, plant, table[at, 8 * n + 2], accel, spare) if speed == 0.0 else 0.0)
        tell(count, work, ledger)
        rows[i, 2 * n + 6] = work
        ledger[3] += lost
        if not ok:
            return i, 2
    return steps, 0


@njit(error_model="numpy", **LEAN)
def holding(motion, plant, drive, accel, spare):
    """Friction force [N] that keeps the slide from accelerating at an instant under the drive [m s-2].

    motion: (2, n); accel, spare: room.
    """
    for k in range(accel.size):
        accel[k] = 0.0
    accelerations(motion, plant.omega, plant.damp, plant.damping, plant.base, drive, accel, spare)
    need, gain = 0.0, 0.0
    for k in range(accel.size):
        need += plant.slide[k] * spare[0, k]
        gain += plant.slide[k] * plant.slide[k] / plant.mass
    return need / gain


@njit(error_model="numpy", **LEAN)
def held_force(motion, plant, table, at, used, rates):
    """As `holding` at the end of a step through which the force `used` [N] has held the slide; rates (n,): room."""
    slide, n, need, across, size = plant.slide, plant.slide.size, 0.0, 0.0, 0.0
    for i in range(n):
        z, v = table[at, i], table[at, n + i]
        if plant.dense.size == 0:
            push = -slide[i] * used / plant.mass
            z += plant.free[0, i] * motion[0, i] + plant.free[1, i] * motion[1, i] + plant.push[0, i] * push
            v += plant.free[2, i] * motion[0, i] + plant.free[3, i] * motion[1, i] + plant.push[1, i] * push
        else:
            for k in range(n):
                push = -slide[k] * used / plant.mass
                z += plant.dense[i, k] * motion[0, k] + plant.dense[i, n + k] * motion[1, k] \
                    + plant.dense[i, 2 * n + k] * push
                v += plant.dense[n + i, k] * motion[0, k] + plant.dense[n + i, n + k] * motion[1, k] \
                    + plant.dense[n + i, 2 * n + k] * push
        rates[i] = v
        across += slide[i] * v
        size += slide[i] * slide[i]
        need -= slide[i] * (plant.base[i] * table[at, 8 * n + 2] + plant.omega[i] * plant.omega[i] * z)
    for i in range(n):
        v = rates[i] - slide[i] * across / size
        if plant.damping.size == 0:
            need -= slide[i] * plant.damp[i] * v
        else:
            for k in range(n):
                need -= slide[k] * plant.damping[k, i] * v
    return need * plant.mass / size


@njit(error_model="numpy", cache=True, **LEAN)
def follow(path, dt, c, goal, lost, forces):
    """Resultant along a slide path (k,) [m] that is given, with steps of dt [s].

    forces (k, 3): force at the sample, at the mean speed of the steps beside it, mean over the step that follows,
    irreversible slip; lost (k, 2): energy dissipated in the step that follows, energy stored at the sample. Returns the
    steps that did not converge or found the memory of the contact full.
    """
    bad, before = 0, 0.0
    for i in range(path.size):
        dq = path[i + 1] - path[i] if i < path.size - 1 else before * dt
        v = dq / dt if dt > 0 else 0.0
        force, energy, slip = contact.state(c, path[i], 0.5 * (before + v) if i else v)
        forces[i, 0], forces[i, 2], lost[i, 1] = force, slip, energy
        if i == path.size - 1:
            break
        mean, good = contact.given(dq, path[i], v, dt, c, goal)
        forces[i, 1] = mean
        lost[i, 0], ok = contact.commit(dq, mean, path[i], v, v, dt, c)
        bad += not (good and ok)
        before = v
    return bad
