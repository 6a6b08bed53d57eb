"""March of coupled bond points that stores sums instead of samples (compiled).

Extremes, phasors and energies of the cycles are accumulated in the march.

The steps are those of `loop_kernels.march` with the contact `interfaces.shear_kernels`; a test compares both. While all
points slip in one direction the friction is constant, and the modes of the pieces alternate about their mean from one
step to the next. Such a step only advances the modes of the rig, in 25 ns instead of 150.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..interfaces import shear_kernels as contact
from ..interfaces.arrays import FullSlipRow, SlipStateIndex, StepStart
from ..ledger import N_SAMPLE_COLUMNS, Ledger, SampleColumn
from ..modal_kernels import (
    count_iterations,
    free_increment,
    modal_energy,
    move_modes,
    project_modes,
    write_friction_accelerations,
    write_interface_sample,
    write_modal_sample,
)
from .cycle_sum_arrays import N_BLOCK_ROWS, BlockRow, CycleColumn, SumIndex, TraceRow

# Largest product of two successive rates, relative to the square of the largest rate, that is
# attributed to round-off; it occurs at a stop without a reversal.
RATE_TOL = 1e-12


class PieceStep(NamedTuple):
    """Change of the shear modes of the pieces in a step of full slip.

    - min_increment: smallest slide increment at which all points continue to slip [m].
    - taken: work of the point forces on the modes of the pieces [J].
    - energy: energy of the interface at the start of the step [J].
    - rise: energy increase of the modes of the pieces in the step [J].
    """

    min_increment: float
    taken: float
    energy: float
    rise: float


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def add_step_energies(work, energy_increase, start_slide, end_slide, mean_force, record):
    """Add the friction energies of a step to the sums of the cycle.

    Parameters
    ----------
    work : float
        Work of the step [J].
    energy_increase : float
        Increase of the energy of the interface [J].
    start_slide : float
        Slide at the start of the step [m].
    end_slide : float
        Slide at the end of the step [m].
    mean_force : float
        Mean of the friction forces at both ends [N].
    record : cycle_sum_arrays.CycleSums
    """
    sums = record.sums
    dissipated = work - energy_increase
    noise = record.bounds.force * (1e-12 * abs(end_slide - start_slide) + 1e-15 * abs(start_slide))
    sums[SumIndex.WORK] += work
    sums[SumIndex.LOSS] += dissipated if dissipated > -noise else 0.0
    sums[SumIndex.CREATED] -= dissipated if dissipated < -noise else 0.0
    sums[SumIndex.SAMPLED_WORK] += mean_force * (end_slide - start_slide)
    sums[SumIndex.WORK_SIZE] += abs(work)


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def store_largest_slide(number, record):
    """Store the present sample if its slide is the largest so far.

    Parameters
    ----------
    number : int
        Number of the sample.
    record : cycle_sum_arrays.CycleSums
    """
    row = record.largest.row
    stored = record.largest.kept
    n = row.size - N_SAMPLE_COLUMNS
    if not abs(row[n]) > abs(stored[n]):
        return
    n_copied = n + SampleColumn.STEP_WORK
    for k in range(n_copied):
        stored[k] = row[k]
    for k in range(3):
        stored[n_copied + k] = record.totals[k] + record.sums[k]
    stored[n_copied + 3] = 0.0
    record.largest.number[0] = number


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def advance_piece_modes(interface, n_steps, slides):
    """Advance the shear modes of the pieces over steps of full slip in one direction.

    The forces of the points are then constant. Each mode coordinate jumps in every step to the mirror image about its
    equilibrium, so its increments are equal with alternating sign. `interface.last` gets the increments of the last two
    steps, `interface.y` the guess of the next ones that `shear_solve_kernels` extrapolates from three steps, and
    `interface.ready` marks the factorised Hessian as out of date.

    Parameters
    ----------
    interface : interfaces.arrays.ShearedPoints
    n_steps : int
        Number of steps.
    slides : (n_steps,) array
        Increments of the slide [m].
    """
    direction = interface.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    last = interface.last
    for k in range(interface.y.shape[1]):
        mode_increment = 0.0
        if k > 0:
            equilibrium = (
                direction * interface.full_slip[FullSlipRow.FORCE, k] / interface.kappa[k - 1]
            )
            mode_increment = 2 * (equilibrium - interface.b[k - 1])
        for m in range(max(0, n_steps - 3), n_steps):
            if k == 0:
                increment = slides[m]
            else:
                increment = mode_increment if m % 2 == 0 else -mode_increment
            interface.y[0, k] = 3 * (increment - last[0, k]) + last[1, k]
            last[1, k] = last[0, k]
            last[0, k] = increment
        if k > 0 and n_steps % 2:
            interface.b[k - 1] += mode_increment
    interface.ready[:] = 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_mode(k, count, table_row, accel, system, workspace):
    """Advance a rig mode over steps under a constant friction force.

    Its slide, output and energies are added to the workspace.

    Parameters
    ----------
    k : int
        Number of the mode.
    count : int
        Number of steps.
    table_row : int
        Row of the drive table for the first step.
    accel : float
        Modal acceleration of the friction [m s-2].
    system : cycle_sum_arrays.CycleSumMarch
    workspace : (7, k) array
        Rows of `cycle_sum_arrays.BlockRow`, to which the steps are added.
    """
    motion = system.motion
    modal_system = system.modal_system
    table = system.table
    n = motion.shape[1]
    z = motion[0, k]
    v = motion[1, k]
    zz = modal_system.free[0, k]
    zv = modal_system.free[1, k]
    vz = modal_system.free[2, k]
    vv = modal_system.free[3, k]
    by_z = modal_system.force_response[0, k] * accel
    by_v = modal_system.force_response[1, k] * accel
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
        row = table_row + s
        workspace[BlockRow.DRIVE_WORK, s] += (
            table[row, 2 * n + k] * z + table[row, 3 * n + k] * v + table[row, 4 * n + k] * accel
        )
        workspace[BlockRow.VISCOUS_LOSS, s] += (
            (table[row, 5 * n + k] + a * z + b * v + e) * z
            + (table[row, 6 * n + k] + d * v + f) * v
            + table[row, 7 * n + k] * accel
            + g
        )
        next_z = zz * z + zv * v + by_z + table[row, k]
        v = vz * z + vv * v + by_v + table[row, n + k]
        z = next_z
        workspace[BlockRow.SLIDE, s] += slide * z
        workspace[BlockRow.SPEED, s] += slide * v
        workspace[BlockRow.OUTPUT, s] += output * z
        workspace[BlockRow.RATE, s] += output * v
        workspace[BlockRow.SQUARES, s] += v * v + square * z * z
    motion[0, k] = z
    motion[1, k] = v


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_piece_step(interface):
    """Return the change of the shear modes of the pieces in the next step of full slip."""
    direction = interface.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    min_increment = 0.0
    work = 0.0
    energy = interface.eps[0] * interface.full_slip[FullSlipRow.FORCE, 0]
    energy_increase = 0.0
    for k in range(interface.b.size):
        y = 2 * (
            direction * interface.full_slip[FullSlipRow.FORCE, k + 1] / interface.kappa[k]
            - interface.b[k]
        )
        min_increment += interface.full_slip[FullSlipRow.MAX_SLIDE, k + 1] * abs(y)
        work += direction * interface.full_slip[FullSlipRow.FORCE, k + 1] * y
        energy += 0.5 * interface.kappa[k] * interface.b[k] * interface.b[k]
        energy_increase += interface.kappa[k] * y * (interface.b[k] + 0.5 * y)
    return PieceStep(min_increment, work, energy, energy_increase)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def record_full_slip_steps(n_block, first_sample, slide, table_row, force, system):
    """Record the steps of a block in full slip, until some point no longer slips.

    The steps are added to ledger, sums and output trace; row SLIDE of the workspace then has the slide increments.

    Parameters
    ----------
    n_block : int
        Number of steps in the workspace.
    first_sample : int
        Number of the sample in the cycle at the start.
    slide : float
        Slide at the start of the step [m].
    table_row : int
        Row of the drive table for the first step.
    force : float
        Friction force [N].
    system : cycle_sum_arrays.CycleSumMarch

    Returns
    -------
    int
        Number of steps.
    """
    interface = system.interface
    table = system.table
    record = system.record
    direction = interface.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
    size = 2 * system.motion.shape[1]
    ledger = record.ledger
    workspace = record.workspace
    pieces = find_piece_step(interface)
    n_steps = 0
    for s in range(n_block):
        end_slide = workspace[BlockRow.SLIDE, s]
        increment = end_slide - slide
        if direction * increment <= pieces.min_increment:
            break
        # The modes of the pieces move forward in one step and back in the next.
        n_steps = s + 1
        sign = 1.0 if s % 2 == 0 else -1.0
        is_forward = 0.5 * (1.0 + sign)
        power = workspace[BlockRow.DRIVE_WORK, s] + table[table_row + s, 4 * size]
        add_step_energies(force * increment, sign * pieces.rise, slide, end_slide, force, record)
        ledger[Ledger.DRIVE_WORK] += power
        ledger[Ledger.VISCOUS_LOSS] += (
            workspace[BlockRow.VISCOUS_LOSS, s] + table[table_row + s, 4 * size + 1]
        )
        ledger[Ledger.DRIVE_POWER] += abs(power)
        ledger[Ledger.FRICTION_LOSS] += force * increment - sign * pieces.taken
        energy_of_modes = 0.5 * system.modal_system.mass * workspace[BlockRow.SQUARES, s]
        ledger[Ledger.MAX_STORED] = max(
            ledger[Ledger.MAX_STORED], pieces.energy + is_forward * pieces.rise + energy_of_modes
        )
        ledger[Ledger.FRICTION_WORK] += force * increment
        record.trace[TraceRow.OUTPUT, first_sample + n_steps] = workspace[BlockRow.OUTPUT, s]
        record.trace[TraceRow.RATE, first_sample + n_steps] = workspace[BlockRow.RATE, s]
        slide = end_slide
        workspace[BlockRow.SLIDE, s] = increment
        interface.slip_state[SlipStateIndex.TOTAL_SLIDE] += increment
        is_finite = np.isfinite(slide + workspace[BlockRow.SPEED, s])
        if not (abs(workspace[BlockRow.OUTPUT, s]) <= record.bounds.travel and is_finite):
            break
    return n_steps


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march_full_slip(first, count, first_sample, slide, system):
    """March as long as all points slip in the same direction (full slip).

    The sample after the last step is not recorded; no sample before it has a larger slide in its direction.
    Each mode advances over a block of steps at once, and again over the steps before full slip ends in
    the block.

    Parameters
    ----------
    first : int
        Row of the drive table for the first step; the rows repeat cyclically.
    count : int
        Number of steps.
    first_sample : int
        Number of the sample in the cycle at the start.
    slide : float
        Slide at the start of the step [m].
    system : cycle_sum_arrays.CycleSumMarch

    Returns
    -------
    int
        Number of steps.
    """
    motion = system.motion
    modal_system = system.modal_system
    interface = system.interface
    workspace = system.record.workspace
    n = motion.shape[1]
    at = first % system.table.shape[0]
    force = (
        interface.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION]
        * interface.full_slip[FullSlipRow.FORCE, 0]
    )
    accel = modal_system.workspace[0]
    start = modal_system.workspace[1:]
    write_friction_accelerations(force, modal_system.slide, modal_system.mass, accel)
    block = min(count, workspace.shape[1], system.table.shape[0] - at)
    for row in range(N_BLOCK_ROWS):
        for s in range(block):
            workspace[row, s] = 0.0
    for k in range(n):
        start[0, k] = motion[0, k]
        start[1, k] = motion[1, k]
        move_mode(k, block, at, accel[k], system, workspace)
    n_steps = record_full_slip_steps(block, first_sample, slide, at, force, system)
    if n_steps < block:
        for k in range(n):
            motion[0, k] = start[0, k]
            motion[1, k] = start[1, k]
            move_mode(k, n_steps, at, accel[k], system, workspace[N_BLOCK_ROWS:])
    if n_steps:
        advance_piece_modes(interface, n_steps, workspace[BlockRow.SLIDE])
    return n_steps


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def march_step(table_row, start, system):
    """March one step in which points may stick or slip; return the friction work [J].

    Parameters
    ----------
    table_row : int
        Row of the drive table for this step.
    start : interfaces.arrays.StepStart
    system : cycle_sum_arrays.CycleSumMarch

    Returns
    -------
    float
    """
    motion = system.motion
    modal_system = system.modal_system
    record = system.record
    accel = modal_system.workspace[0]
    free = free_increment(motion, modal_system, 0, system.table, table_row)
    step = contact.solve_step(free, modal_system.beta, start, system.interface, record.bounds.goal)
    force = (free - step.increment) / modal_system.beta
    write_friction_accelerations(force, modal_system.slide, modal_system.mass, accel)
    work = force * step.increment
    move_modes(motion, modal_system, system.table, table_row, accel, record.ledger)
    count_iterations(step.iterations, work, record.ledger)
    end_velocity = project_modes(modal_system.slide, motion[1])
    loss, _ = contact.commit_step(step.increment, force, start, end_velocity, system.interface)
    record.ledger[Ledger.FRICTION_LOSS] += loss
    return work


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def march_cycle_with_sums(first, system):
    """March one cycle and accumulate its energies and output.

    Parameters
    ----------
    first : int
        Row of the drive table for the first step; the rows repeat cyclically.
    system : cycle_sum_arrays.CycleSumMarch

    Returns
    -------
    int
        Number of completed steps.
    int
        Status, as in `loop_kernels`.
    """
    motion = system.motion
    modal_system = system.modal_system
    interface = system.interface
    record = system.record
    trace = record.trace
    row = record.largest.row
    count = trace.shape[1] - 1
    n = motion.shape[1]
    i = 0
    is_step_open = False
    work = 0.0
    start_slide = 0.0
    start_force = 0.0
    start_energy = 0.0
    while True:
        modal = write_modal_sample(row, motion, modal_system)
        reading = contact.read_state(interface, modal.slide, modal.speed)
        stored = reading.stored_energy + modal_energy(motion, modal_system)
        status = write_interface_sample(
            row[: 2 * n + SampleColumn.STEP_WORK],
            reading,
            modal.output,
            record.bounds.travel,
            stored,
            record.ledger,
        )
        if is_step_open:
            rise = reading.stored_energy - start_energy
            mean_force = 0.5 * (start_force + reading.force)
            add_step_energies(work, rise, start_slide, modal.slide, mean_force, record)
        trace[TraceRow.OUTPUT, i] = modal.output
        trace[TraceRow.RATE, i] = project_modes(modal_system.output, motion[1])
        store_largest_slide(first + i, record)
        if status or i == count:
            return i, status
        if (
            interface.slip_state[SlipStateIndex.FULL_SLIP_DIRECTION] != 0.0
            and modal_system.dense.size == 0
        ):
            n_steps = march_full_slip(first + i, count - i, i, modal.slide, system)
            if n_steps:
                i = i + n_steps
                is_step_open = False
                continue
        at = (first + i) % system.table.shape[0]
        start = StepStart(modal.slide, modal.speed, modal_system.dt)
        work = march_step(at, start, system)
        start_slide = modal.slide
        start_force = reading.force
        start_energy = reading.stored_energy
        is_step_open = True
        i = i + 1


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_cycle_output(trace, dt, cycles):
    """Compute the extremes and the phasor of the output of a cycle from its samples.

    The output is interpolated by cubics through values and rates, as in `cycles.find_hermite_extremes`.

    Parameters
    ----------
    trace : (4, s + 1) array
        Samples of the output, and cosine and sine of the drive, see `cycle_sum_arrays.TraceRow`.
    dt : float
        Length of a step [s].
    cycles : (4,) array
        Extremes and phasor; output.
    """
    count = trace.shape[1] - 1
    low = np.inf
    high = -np.inf
    re = 0.0
    im = 0.0
    fastest = 0.0
    for i in range(count + 1):
        low = min(low, trace[TraceRow.OUTPUT, i])
        high = max(high, trace[TraceRow.OUTPUT, i])
        fastest = max(fastest, abs(trace[TraceRow.RATE, i]))
    for i in range(count):
        re += trace[TraceRow.OUTPUT, i] * trace[TraceRow.DRIVE_COS, i]
        im -= trace[TraceRow.OUTPUT, i] * trace[TraceRow.DRIVE_SIN, i]
    for i in range(count):
        if (
            not trace[TraceRow.RATE, i] * trace[TraceRow.RATE, i + 1]
            < -RATE_TOL * fastest * fastest
        ):
            continue
        a = trace[TraceRow.OUTPUT, i]
        b = trace[TraceRow.OUTPUT, i + 1]
        p = trace[TraceRow.RATE, i] * dt
        r = trace[TraceRow.RATE, i + 1] * dt
        big = 2 * (a - b) + p + r
        mid = 3 * (b - a) - 2 * p - r
        root = np.sqrt(max(mid * mid - 3 * big * p, 0.0))
        for sign in (1.0, -1.0):
            s = -p / (mid + sign * root)
            if 0.0 <= s <= 1.0:
                value = a + p * s + mid * s * s + big * s * s * s
                low = min(low, value)
                high = max(high, value)
    cycles[CycleColumn.MIN_OUTPUT] = low
    cycles[CycleColumn.MAX_OUTPUT] = high
    cycles[CycleColumn.PHASOR_REAL] = 2 * re / count
    cycles[CycleColumn.PHASOR_IMAG] = 2 * im / count


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def march_cycles_with_sums(first, cycles, system):
    """March cycles and store their extremes, phasors and energy sums instead of samples.

    Parameters
    ----------
    first : int
        Row of the drive table for the first step; the rows repeat cyclically.
    cycles : (k, 4) array
        Extremes and phasors of the cycles; output.
    system : cycle_sum_arrays.CycleSumMarch

    Returns
    -------
    int
        Number of completed steps.
    int
        Status, as in `loop_kernels`.
    """
    trace = system.record.trace
    count = trace.shape[1] - 1
    for cycle in range(cycles.shape[0]):
        n_steps, status = march_cycle_with_sums(first + cycle * count, system)
        if status:
            return cycle * count + n_steps, status
        find_cycle_output(trace, system.modal_system.dt, cycles[cycle])
    return cycles.shape[0] * count, 0
