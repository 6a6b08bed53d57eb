"""March of bonds behind shear modes without stored samples.

Extremes, phasors and energies of the cycles are accumulated in the march.

The steps are those of `loop_kernels.march` with the contact `interfaces.shear_kernels`; a test compares both. While all
points slip one way the friction is constant, and the modes of the pieces alternate about their mean from one step to the
next. What is left of such a step are the modes of the rig, at 25 ns in place of 150.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..interfaces import shear_kernels as contact
from ..interfaces.shear_kernels import DRAG_DIRECTION, DRAG_FORCE, MAX_MODE_SLIDE, TOTAL_SLIDE
from ..ledger import LEDGER
from ..modal_kernels import (
    count_iterations,
    free_increment,
    modal_energy,
    move_modes,
    write_friction_accelerations,
    write_interface,
    write_modes,
)

# Places in `sums` of `interfaces.arrays.FoldedCycles` [J].
WORK_SUM = 0  # friction work
LOSS_SUM = 1  # dissipated energy
CREATED_SUM = 2  # created energy
SAMPLED_SUM = 3  # friction work from the samples alone
WORK_SIZE_SUM = 4  # sum of the absolute works of the steps
# Rows of `trace`, at the samples of a cycle: output and its rate, cosine and sine of the drive.
OUTPUT = 0
OUTPUT_RATE = 1
DRIVE_COS = 2
DRIVE_SIN = 3
# Columns of `cycles`: extremes and phasor of the output in a cycle [m].
MIN_OUTPUT = 0
MAX_OUTPUT = 1
PHASOR_REAL = 2
PHASOR_IMAG = 3
# Rows of `workspace`, at the steps of a block. As many rows again receive results that are not used.
DRIVE_WORK = 0
VISCOUS_LOSS = 1
SLIDE_ROW = 2
SPEED_ROW = 3
OUTPUT_ROW = 4
RATE_ROW = 5
ENERGY_ROW = 6
N_BLOCK_ROWS = 7
BLOCK = 32  # number of steps of a drag that are tried at once
RATE_TOL = 1e-12  # product of two rates over the square of the largest one above which they have the same sign


class PieceSwing(NamedTuple):
    """Shear modes of the pieces in the next step of a drag.

    - min_increment: increment of the slide that all points need to slip on [m].
    - taken: work that the points do on the modes [J].
    - energy: energy of the interface at the start of the step [J].
    - rise: increase of the energy of the modes [J].
    """

    min_increment: float
    taken: float
    energy: float
    rise: float


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def add_step(work, rise, q, after, mean, folded):
    """Add a step to the sums.

    Parameters
    ----------
    work : float
        Work of the step [J].
    rise : float
        Increase of the energy of the interface [J].
    q : float
        Slide at the start [m].
    after : float
        Slide at the end [m].
    mean : float
        Mean of the forces at both ends [N].
    folded : interfaces.arrays.FoldedCycles
    """
    sums = folded.sums
    lost = work - rise
    noise = folded.bounds.force * (1e-12 * abs(after - q) + 1e-15 * abs(q))
    sums[WORK_SUM] += work
    sums[LOSS_SUM] += lost if lost > -noise else 0.0
    sums[CREATED_SUM] -= lost if lost < -noise else 0.0
    sums[SAMPLED_SUM] += mean * (after - q)
    sums[WORK_SIZE_SUM] += abs(work)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def keep_largest(number, folded):
    """Keep the present sample, in the form of `Run.cycles`, if its slide is the largest so far.

    Parameters
    ----------
    number : int
        Number of the sample.
    folded : interfaces.arrays.FoldedCycles
    """
    row = folded.largest.row
    kept = folded.largest.kept
    n = row.size - 7
    if not abs(row[n]) > abs(kept[n]):
        return
    for k in range(n + 6):
        kept[k] = row[k]
    for k in range(3):
        kept[n + 6 + k] = folded.totals[k] + folded.sums[k]
    kept[n + 9] = 0.0
    folded.largest.number[0] = number


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def swing_pieces(interface, did, slides):
    """Advance the shear modes of the pieces over steps in which all points slip in one direction.

    The forces of the points are then constant. Each mode coordinate jumps in every step to the mirror image about its
    equilibrium, so its increments are equal with alternating sign. `interface.last` gets the increments of the last two
    steps, `interface.y` the guess of the next ones that `shear_solve_kernels` extrapolates from three steps, and
    `interface.ready` marks the factorised Hessian as out of date.

    Parameters
    ----------
    interface : interfaces.arrays.ShearedPoints
    did : int
        Number of steps.
    slides : (did,) array
        Increments of the slide [m].
    """
    way = interface.flow[DRAG_DIRECTION]
    last = interface.last
    for k in range(interface.y.shape[1]):
        swing = 0.0
        if k > 0:
            middle = way * interface.drag[DRAG_FORCE, k] / interface.kappa[k - 1]
            swing = 2 * (middle - interface.b[k - 1])
        for m in range(max(0, did - 3), did):
            if k == 0:
                here = slides[m]
            else:
                here = swing if m % 2 == 0 else -swing
            interface.y[0, k] = 3 * (here - last[0, k]) + last[1, k]
            last[1, k] = last[0, k]
            last[0, k] = here
        if k > 0 and did % 2:
            interface.b[k - 1] += swing
    interface.ready[:] = 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_mode(k, count, motion, modal_system, table, at, accel, workspace):
    """Move a mode by steps under a constant force, and add its outputs and energies to the workspace.

    Parameters
    ----------
    k : int
        Number of the mode.
    count : int
        Number of steps.
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    at : int
        Row of the table for this step.
    accel : float
        Modal acceleration of the friction [m s-2].
    workspace : (14, BLOCK) array
        Space for a block of steps.
    """
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
        workspace[DRIVE_WORK, s] += (
            table[row, 2 * n + k] * z + table[row, 3 * n + k] * v + table[row, 4 * n + k] * accel
        )
        workspace[VISCOUS_LOSS, s] += (
            (table[row, 5 * n + k] + a * z + b * v + e) * z
            + (table[row, 6 * n + k] + d * v + f) * v
            + table[row, 7 * n + k] * accel
            + g
        )
        z, v = zz * z + zv * v + by_z + table[row, k], vz * z + vv * v + by_v + table[row, n + k]
        workspace[SLIDE_ROW, s] += slide * z
        workspace[SPEED_ROW, s] += slide * v
        workspace[OUTPUT_ROW, s] += output * z
        workspace[RATE_ROW, s] += output * v
        workspace[ENERGY_ROW, s] += v * v + square * z * z
    motion[0, k] = z
    motion[1, k] = v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def compute_piece_swing(interface):
    """Return the `PieceSwing` of the next step in which all points slip in one direction."""
    way = interface.flow[DRAG_DIRECTION]
    min_increment = 0.0
    taken = 0.0
    energy = interface.eps[0] * interface.drag[DRAG_FORCE, 0]
    rise = 0.0
    for k in range(interface.b.size):
        y = 2 * (way * interface.drag[DRAG_FORCE, k + 1] / interface.kappa[k] - interface.b[k])
        min_increment += interface.drag[MAX_MODE_SLIDE, k + 1] * abs(y)
        taken += way * interface.drag[DRAG_FORCE, k + 1] * y
        energy += 0.5 * interface.kappa[k] * interface.b[k] * interface.b[k]
        rise += interface.kappa[k] * y * (interface.b[k] + 0.5 * y)
    return PieceSwing(min_increment, taken, energy, rise)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_drag_steps(block, i, q, at, force, modal_system, table, interface, folded):
    """Add the steps of a block to ledger, sums and trace until the points no longer all slip.

    The row SLIDE_ROW of the workspace then has the increments of the slide in these steps.

    Parameters
    ----------
    block : int
        Number of steps in the workspace.
    i : int
        Number of the sample in the cycle.
    q : float
        Slide at the start [m].
    at : int
        Row of the table for the first step.
    force : float
        Friction force [N].
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    interface : interfaces.arrays.ShearedPoints
    folded : interfaces.arrays.FoldedCycles

    Returns
    -------
    int
        Number of steps.
    """
    way = interface.flow[DRAG_DIRECTION]
    size = 2 * modal_system.slide.size
    ledger = folded.ledger
    workspace = folded.workspace
    pieces = compute_piece_swing(interface)
    did = 0
    for s in range(block):
        after = workspace[SLIDE_ROW, s]
        dq = after - q
        if way * dq <= pieces.min_increment:
            break
        # the modes of the pieces move forward in one step and back in the next one
        did = s + 1
        sign = 1.0 if s % 2 == 0 else -1.0
        is_forward = 0.5 * (1.0 + sign)
        power = workspace[DRIVE_WORK, s] + table[at + s, 4 * size]
        add_step(force * dq, sign * pieces.rise, q, after, force, folded)
        ledger[LEDGER.drive_work] += power
        ledger[LEDGER.viscous_loss] += workspace[VISCOUS_LOSS, s] + table[at + s, 4 * size + 1]
        ledger[LEDGER.drive_power] += abs(power)
        ledger[LEDGER.friction_loss] += force * dq - sign * pieces.taken
        modal_energy = 0.5 * modal_system.mass * workspace[ENERGY_ROW, s]
        ledger[LEDGER.max_stored] = max(
            ledger[LEDGER.max_stored], pieces.energy + is_forward * pieces.rise + modal_energy
        )
        ledger[LEDGER.friction_work] += force * dq
        folded.trace[OUTPUT, i + did] = workspace[OUTPUT_ROW, s]
        folded.trace[OUTPUT_RATE, i + did] = workspace[RATE_ROW, s]
        q = after
        workspace[SLIDE_ROW, s] = dq
        interface.flow[TOTAL_SLIDE] += dq
        is_finite = np.isfinite(q + workspace[SPEED_ROW, s])
        if not (abs(workspace[OUTPUT_ROW, s]) <= folded.bounds.travel and is_finite):
            break
    return did


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march_drag(first, count, i, q, motion, modal_system, table, interface, folded):
    """March as long as all points slip in the same direction.

    The sample at the end of the last step is not read; no sample before it has a larger slide in its direction.
    The modes go over a block of steps one after the other, and once more over the steps before the drag ends in
    the block.

    Parameters
    ----------
    first : int
        Row of the table for the first step; the rows are used in turns.
    count : int
        Number of steps.
    i : int
        Number of the sample in the cycle.
    q : float
        Slide at the start [m].
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    interface : interfaces.arrays.ShearedPoints
    folded : interfaces.arrays.FoldedCycles

    Returns
    -------
    int
        Number of steps.
    """
    workspace = folded.workspace
    n = motion.shape[1]
    at = first % table.shape[0]
    force = interface.flow[DRAG_DIRECTION] * interface.drag[DRAG_FORCE, 0]
    accel = modal_system.workspace[0]
    start = modal_system.workspace[1:]
    write_friction_accelerations(force, modal_system.slide, modal_system.mass, accel)
    block = min(count, workspace.shape[1], table.shape[0] - at)
    for row in range(N_BLOCK_ROWS):
        for s in range(block):
            workspace[row, s] = 0.0
    for k in range(n):
        start[0, k] = motion[0, k]
        start[1, k] = motion[1, k]
        move_mode(k, block, motion, modal_system, table, at, accel[k], workspace)
    did = add_drag_steps(block, i, q, at, force, modal_system, table, interface, folded)
    if did < block:
        for k in range(n):
            motion[0, k] = start[0, k]
            motion[1, k] = start[1, k]
            move_mode(k, did, motion, modal_system, table, at, accel[k], workspace[N_BLOCK_ROWS:])
    if did:
        swing_pieces(interface, did, workspace[SLIDE_ROW])
    return did


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def march_step(at, q, v, motion, modal_system, table, interface, folded):
    """March a step in which points may stick or slip; return the friction work [J].

    Parameters
    ----------
    at : int
        Row of the table for this step.
    q : float
        Slide at the start [m].
    v : float
        Its speed [m/s].
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    interface : interfaces.arrays.ShearedPoints
    folded : interfaces.arrays.FoldedCycles

    Returns
    -------
    float
    """
    beta = modal_system.beta
    dt = modal_system.dt
    accel = modal_system.workspace[0]
    free = free_increment(motion, modal_system, 0, table, at)
    dq, _, turns = contact.solve_step(free, beta, q, v, dt, interface, folded.bounds.goal)
    used = (free - dq) / beta
    write_friction_accelerations(used, modal_system.slide, modal_system.mass, accel)
    work = used * dq
    scratch = modal_system.workspace[1:]
    move_modes(motion, modal_system, table, at, accel, scratch, folded.ledger)
    count_iterations(turns, work, folded.ledger)
    speed = 0.0
    for k in range(modal_system.slide.size):
        speed += modal_system.slide[k] * motion[1, k]
    lost, _ = contact.commit_step(dq, used, q, v, speed, dt, interface)
    folded.ledger[LEDGER.friction_loss] += lost
    return work


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def march_folded_cycle(first, motion, modal_system, table, interface, folded):
    """March a cycle.

    Parameters
    ----------
    first : int
        Row of the table for the first step; the rows are used in turns.
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    interface : interfaces.arrays.ShearedPoints
    folded : interfaces.arrays.FoldedCycles

    Returns
    -------
    int
        Number of steps that are done.
    int
        Status of `loop_kernels`.
    """
    trace = folded.trace
    row = folded.largest.row
    count = trace.shape[1] - 1
    n = motion.shape[1]
    i = 0
    is_step_open = False
    work = 0.0
    q0 = 0.0
    force0 = 0.0
    energy0 = 0.0
    while True:
        q, v, out = write_modes(row, motion, modal_system)
        force, energy, slip = contact.read_state(interface, q, v)
        status = write_interface(
            row[: 2 * n + 6],
            force,
            energy,
            slip,
            out,
            folded.bounds.travel,
            energy + modal_energy(motion, modal_system),
            folded.ledger,
        )
        if is_step_open:
            add_step(work, energy - energy0, q0, q, 0.5 * (force0 + force), folded)
        rate = 0.0
        for k in range(n):
            rate += modal_system.output[k] * motion[1, k]
        trace[OUTPUT, i] = out
        trace[OUTPUT_RATE, i] = rate
        keep_largest(first + i, folded)
        if status or i == count:
            return i, status
        if interface.flow[DRAG_DIRECTION] != 0.0 and modal_system.dense.size == 0:
            did = march_drag(
                first + i, count - i, i, q, motion, modal_system, table, interface, folded
            )
            if did:
                i = i + did
                is_step_open = False
                continue
        at = (first + i) % table.shape[0]
        work = march_step(at, q, v, motion, modal_system, table, interface, folded)
        q0 = q
        force0 = force
        energy0 = energy
        is_step_open = True
        i = i + 1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_cycle(trace, dt, cycles):
    """Compute the extremes of the output between the samples of a cycle, and its phasor.

    The output is a cubic through values and rates, as in `cycles.find_hermite_extremes`.

    Parameters
    ----------
    trace : (4, s + 1) array
        Samples of the output and waves of the drive, named at the top of the module.
    dt : float
        Length of a step [s].
    cycles : (4,) array
        Extremes and phasor, which are written.
    """
    count = trace.shape[1] - 1
    low = np.inf
    high = -np.inf
    re = 0.0
    im = 0.0
    fastest = 0.0
    for i in range(count + 1):
        low = min(low, trace[OUTPUT, i])
        high = max(high, trace[OUTPUT, i])
        fastest = max(fastest, abs(trace[OUTPUT_RATE, i]))
    for i in range(count):
        re += trace[OUTPUT, i] * trace[DRIVE_COS, i]
        im -= trace[OUTPUT, i] * trace[DRIVE_SIN, i]
    for i in range(count):
        if not trace[OUTPUT_RATE, i] * trace[OUTPUT_RATE, i + 1] < -RATE_TOL * fastest * fastest:
            continue
        a = trace[OUTPUT, i]
        b = trace[OUTPUT, i + 1]
        p = trace[OUTPUT_RATE, i] * dt
        r = trace[OUTPUT_RATE, i + 1] * dt
        big = 2 * (a - b) + p + r
        mid = 3 * (b - a) - 2 * p - r
        root = np.sqrt(max(mid * mid - 3 * big * p, 0.0))
        for sign in (1.0, -1.0):
            s = -p / (mid + sign * root)
            if 0.0 <= s <= 1.0:
                value = a + p * s + mid * s * s + big * s * s * s
                low = min(low, value)
                high = max(high, value)
    cycles[MIN_OUTPUT] = low
    cycles[MAX_OUTPUT] = high
    cycles[PHASOR_REAL] = 2 * re / count
    cycles[PHASOR_IMAG] = 2 * im / count


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def march_folded_cycles(first, cycles, motion, modal_system, table, interface, folded):
    """March cycles of which the extremes, phasors and sums are kept.

    Parameters
    ----------
    first : int
        Row of the table for the first step; the rows are used in turns.
    cycles : (k, 4) array
        Extremes and phasors of the cycles, which are written.
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    interface : interfaces.arrays.ShearedPoints
    folded : interfaces.arrays.FoldedCycles

    Returns
    -------
    int
        Number of steps that are done.
    int
        Status of `loop_kernels`.
    """
    count = folded.trace.shape[1] - 1
    for cycle in range(cycles.shape[0]):
        did, status = march_folded_cycle(
            first + cycle * count, motion, modal_system, table, interface, folded
        )
        if status:
            return cycle * count + did, status
        read_cycle(folded.trace, modal_system.dt, cycles[cycle])
    return cycles.shape[0] * count, 0
