"""Cycles of bonds behind shear modes of which no sample is kept: what they add up to is folded as they pass.

The steps are those of `loop_kernels.march` with `contacts.shear_kernels`, its twin. Where all points drag the friction
stays, and the modes of the pieces swing about their place from one step to the next, forth and back; what is left of
such a step are the modes of the rig. Cost of it: 25 ns of 150.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..interfaces import shear_kernels as contact
from ..interfaces.shear_kernels import PULL, REACH, SLID, WAY
from ..modal_kernels import free_slide, move, note, push_back, sample, stored, tell

WORK, LOST, CREATED, SAMPLED, PASSED = range(5)  # of `sums` [J]
# of `trace`: output and its rate at the samples, the waves of the drive there
OUT, RATE, COS, SIN = range(4)
LOW, HIGH, RE, IM = range(4)  # of `seen`: extremes and phasor of the output in a cycle [m]
# of `workspace`, at the steps of a block; as many to waste
POWER, DAMPED, SLIDE, SPEED, PLACE, PACE, STORED = range(7)
BLOCK = 32  # steps of a drag that are tried at once
REST = 1e-12  # of the square of the largest rate of a cycle, as of `dynamics.cycles`


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def folded(work, rise, q, after, mean, limit, sums):
    """Add a step from the slide q to `after` [m] to the sums: its work and the rise of the interface's energy [J], the
    mean of the forces at its ends [N]."""
    lost = work - rise
    noise = limit * (1e-12 * abs(after - q) + 1e-15 * abs(q))
    sums[WORK] += work
    sums[LOST] += lost if lost > -noise else 0.0
    sums[CREATED] -= lost if lost < -noise else 0.0
    sums[SAMPLED] += mean * (after - q)
    sums[PASSED] += abs(work)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def reached(row, number, totals, sums, far, far_at):
    """Keep the sample of this number in `far`, as `Run.cycles` books it, where its slide is the largest so far."""
    n = row.size - 7
    if not abs(row[n]) > abs(far[n]):
        return
    for k in range(n + 6):
        far[k] = row[k]
    for k in range(3):
        far[n + 6 + k] = totals[k] + sums[k]
    far[n + 9] = 0.0
    far_at[0] = number


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def swung(c, did, slides):
    """Move the modes of the pieces by `did` steps of a drag, forth and back; the next guess is as `went_on` leaves it.

    slides (did,): increments of the slide [m].
    """
    way = c.flow[WAY]
    last = c.last
    for k in range(c.y.shape[1]):
        swing = 2 * (way * c.drag[PULL, k] / c.kappa[k - 1] - c.b[k - 1]) if k > 0 else 0.0
        for m in range(max(0, did - 3), did):
            here = slides[m] if k == 0 else swing if m % 2 == 0 else -swing
            c.y[0, k] = 3 * (here - last[0, k]) + last[1, k]
            last[1, k] = last[0, k]
            last[0, k] = here
        if k > 0 and did % 2:
            c.b[k - 1] += swing
    c.ready[:] = 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def flown(k, count, motion, modal_system, table, at, accel, workspace):
    """Move a mode by `count` steps of a force that stays, by row `at` of the table on; what it shows and takes is added
    to `workspace`."""
    n = motion.shape[1]
    z = motion[0, k]
    v = motion[1, k]
    zz = modal_system.free[0, k]
    zv = modal_system.free[1, k]
    vz = modal_system.free[2, k]
    vv = modal_system.free[3, k]
    by_z = modal_system.push[0, k] * accel
    by_v = modal_system.push[1, k] * accel
    slide = modal_system.slide[k]
    output = modal_system.output[k]
    square = modal_system.omega[k] * modal_system.omega[k]
    a = modal_system.loss[0, k]
    b = modal_system.loss[1, k]
    d = modal_system.loss[2, k]
    e = modal_system.loss[3, k] * accel
    f = modal_system.loss[4, k] * accel
    g = modal_system.loss[5, k] * accel * accel
    for s in range(count):
        row = at + s
        workspace[POWER, s] += (
            table[row, 2 * n + k] * z + table[row, 3 * n + k] * v + table[row, 4 * n + k] * accel
        )
        workspace[DAMPED, s] += (
            (table[row, 5 * n + k] + a * z + b * v + e) * z
            + (table[row, 6 * n + k] + d * v + f) * v
            + table[row, 7 * n + k] * accel
            + g
        )
        z, v = zz * z + zv * v + by_z + table[row, k], vz * z + vv * v + by_v + table[row, n + k]
        workspace[SLIDE, s] += slide * z
        workspace[SPEED, s] += slide * v
        workspace[PLACE, s] += output * z
        workspace[PACE, s] += output * v
        workspace[STORED, s] += v * v + square * z * z
    motion[0, k] = z
    motion[1, k] = v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def dragged_on(
    first,
    count,
    i,
    q,
    motion,
    modal_system,
    table,
    c,
    travel,
    limit,
    ledger,
    sums,
    trace,
    workspace,
):
    """Move on from the sample i of a cycle, at the slide q, by up to `count` steps in which all points drag; how many
    they are.

    The sample at the end of the last of them is not read; none between is as far. Modes go over a BLOCK of steps one
    after the other, and once more over those before the drag ends in it.
    """
    way = c.flow[WAY]
    n = motion.shape[1]
    size = 2 * motion.shape[1]
    at = first % table.shape[0]
    force = way * c.drag[PULL, 0]
    accel = modal_system.workspace[0]
    begun = modal_system.workspace[1:]
    least = 0.0
    taken = 0.0
    energy = c.eps[0] * c.drag[PULL, 0]
    swing = 0.0
    for k in range(c.b.size):
        y = 2 * (way * c.drag[PULL, k + 1] / c.kappa[k] - c.b[k])
        least += c.drag[REACH, k + 1] * abs(y)
        taken += way * c.drag[PULL, k + 1] * y
        energy += 0.5 * c.kappa[k] * c.b[k] * c.b[k]
        swing += c.kappa[k] * y * (c.b[k] + 0.5 * y)
    push_back(force, modal_system.slide, modal_system.mass, accel)
    block = min(count, workspace.shape[1], table.shape[0] - at)
    for part in range(7):
        for s in range(block):
            workspace[part, s] = 0.0
    for k in range(n):
        begun[0, k] = motion[0, k]
        begun[1, k] = motion[1, k]
        flown(k, block, motion, modal_system, table, at, accel[k], workspace)
    did = 0
    for s in range(block):
        after = workspace[SLIDE, s]
        dq = after - q
        if way * dq <= least:
            break
        # forth, then back
        did = s + 1
        swings = 1.0 if s % 2 == 0 else -1.0
        odd = 0.5 * (1.0 + swings)
        power = workspace[POWER, s] + table[at + s, 4 * size]
        folded(force * dq, swings * swing, q, after, force, limit, sums)
        ledger[0] += power
        ledger[1] += workspace[DAMPED, s] + table[at + s, 4 * size + 1]
        ledger[2] += abs(power)
        ledger[3] += force * dq - swings * taken
        ledger[4] = max(
            ledger[4], energy + odd * swing + 0.5 * modal_system.mass * workspace[STORED, s]
        )
        ledger[8] += force * dq
        trace[OUT, i + did] = workspace[PLACE, s]
        trace[RATE, i + did] = workspace[PACE, s]
        q = after
        workspace[SLIDE, s] = dq
        c.flow[SLID] += dq
        if not (abs(workspace[PLACE, s]) <= travel and np.isfinite(q + workspace[SPEED, s])):
            break
    if did < block:
        for k in range(n):
            motion[0, k] = begun[0, k]
            motion[1, k] = begun[1, k]
            flown(k, did, motion, modal_system, table, at, accel[k], workspace[7:])
    if did:
        swung(c, did, workspace[SLIDE])
    return did


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def through(
    first,
    motion,
    modal_system,
    table,
    c,
    goal,
    limit,
    travel,
    ledger,
    sums,
    totals,
    trace,
    row,
    far,
    far_at,
    workspace,
):
    """March a cycle of samples as of `trace`, the first step by row `first` of the table (in turns); (steps done,
    status) as of `loop_kernels.march`."""
    count = trace.shape[1] - 1
    n = motion.shape[1]
    size = 2 * motion.shape[1]
    dt = modal_system.dt
    around = table.shape[0]
    accel = modal_system.workspace[0]
    scratch = modal_system.workspace[1:]
    i = 0
    open_step = False
    work = 0.0
    q0 = 0.0
    force0 = 0.0
    energy0 = 0.0
    while True:
        q, v, out = sample(row, motion, modal_system.slide, modal_system.output)
        force, energy, slip = contact.state(c, q, v)
        status = note(
            row[: size + 6],
            force,
            energy,
            slip,
            out,
            travel,
            energy + stored(motion, modal_system.omega, modal_system.mass),
            ledger,
        )
        if open_step:
            folded(work, energy - energy0, q0, q, 0.5 * (force0 + force), limit, sums)
        rate = 0.0
        for k in range(n):
            rate += modal_system.output[k] * motion[1, k]
        trace[OUT, i] = out
        trace[RATE, i] = rate
        reached(row, first + i, totals, sums, far, far_at)
        if status or i == count:
            return i, status
        if c.flow[WAY] != 0.0 and modal_system.dense.size == 0:
            did = dragged_on(
                first + i,
                count - i,
                i,
                q,
                motion,
                modal_system,
                table,
                c,
                travel,
                limit,
                ledger,
                sums,
                trace,
                workspace,
            )
            if did:
                i = i + did
                open_step = False
                continue
        at = (first + i) % around
        free = free_slide(motion, modal_system.reach, 0, table, at)
        dq, _, turns = contact.solve(free, modal_system.beta, q, v, dt, c, goal)
        used = (free - dq) / modal_system.beta
        push_back(used, modal_system.slide, modal_system.mass, accel)
        work = used * dq
        move(
            motion,
            modal_system.free,
            modal_system.push,
            modal_system.loss,
            modal_system.dense,
            modal_system.dense_loss,
            table,
            at,
            accel,
            scratch,
            ledger,
        )
        tell(turns, work, ledger)
        after = 0.0
        for k in range(n):
            after += modal_system.slide[k] * motion[1, k]
        lost, _ = contact.commit(dq, used, q, v, after, dt, c)
        ledger[3] += lost
        q0 = q
        force0 = force
        energy0 = energy
        open_step = True
        i = i + 1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def shown(trace, dt, seen):
    """Extremes of the output between the samples of a cycle, by the cubic through values and rates as
    `cycles.hermite_extremes` has it, and its phasor, into seen (4,)."""
    count = trace.shape[1] - 1
    low = np.inf
    high = -np.inf
    re = 0.0
    im = 0.0
    fastest = 0.0
    for i in range(count + 1):
        low = min(low, trace[OUT, i])
        high = max(high, trace[OUT, i])
        fastest = max(fastest, abs(trace[RATE, i]))
    for i in range(count):
        re += trace[OUT, i] * trace[COS, i]
        im -= trace[OUT, i] * trace[SIN, i]
    for i in range(count):
        if not trace[RATE, i] * trace[RATE, i + 1] < -REST * fastest * fastest:
            continue
        a = trace[OUT, i]
        b = trace[OUT, i + 1]
        p = trace[RATE, i] * dt
        r = trace[RATE, i + 1] * dt
        big = 2 * (a - b) + p + r
        mid = 3 * (b - a) - 2 * p - r
        root = np.sqrt(max(mid * mid - 3 * big * p, 0.0))
        for sign in (1.0, -1.0):
            s = -p / (mid + sign * root)
            if 0.0 <= s <= 1.0:
                value = a + p * s + mid * s * s + big * s * s * s
                low = min(low, value)
                high = max(high, value)
    seen[LOW] = low
    seen[HIGH] = high
    seen[RE] = 2 * re / count
    seen[IM] = 2 * im / count


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def passing(
    first,
    sums,
    trace,
    seen,
    motion,
    modal_system,
    table,
    c,
    goal,
    limit,
    travel,
    ledger,
    totals,
    row,
    far,
    far_at,
    workspace,
):
    """March cycles (k,) of as many samples as `trace` has, of which rows of `seen` (k, 4) are left, the first step by
    row `first` of the table (in turns).

    motion, modal_system, table, c, travel, ledger: as of `loop_kernels.march`; goal [N]: of a step; limit [N]: of friction;
    sums (5,) [J]: friction work, what was dissipated and created, the work off the samples and the sizes of the works,
    which grow; totals (3,): the first three before; far (2 n + 10,), far_at (1,): the sample of the largest slide and
    its number from the first step; row (2 n + 7,), workspace (14, BLOCK): room. Returns (steps done, status) as of the
    march.
    """
    count = trace.shape[1] - 1
    for cycle in range(seen.shape[0]):
        did, status = through(
            first + cycle * count,
            motion,
            modal_system,
            table,
            c,
            goal,
            limit,
            travel,
            ledger,
            sums,
            totals,
            trace,
            row,
            far,
            far_at,
            workspace,
        )
        if status:
            return cycle * count + did, status
        shown(trace, modal_system.dt, seen[cycle])
    return seen.shape[0] * count, 0
