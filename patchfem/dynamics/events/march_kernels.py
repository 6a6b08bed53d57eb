"""March from event to event of modes with rigid and elastic-plastic friction (compiled).

The loop `march` does five things for every piece: it chooses the length of the piece, expands the
motion, searches for the first event, moves the state to it, and changes the elements as the event
asks. An event is a yield, the release of an interface that a rigid element holds, a reversal
of an interface or of the output (`search_kernels`), or a border of the drive.
"""

from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .drive_kernels import (
    Instant,
    drive_phase,
    drive_value,
    expand_drive,
    fastest_drive_rate,
    present_instant,
)
from .memory_kernels import (
    find_force_and_energy,
    find_tangent,
    interface_force,
    is_sticking,
    next_yield_slide,
    release_next_element,
    store_reversal,
)
from .positions_kernels import (
    EVENT_KIND,
    MARCH_STATUS,
    N_COLUMNS,
    ROW_BEGIN,
    SEGMENT_KIND,
    Column,
    Ledger,
    Limit,
    Row,
    Segment,
    Time,
)
from .repeat_kernels import clear_previous_cycle, detect_repeat
from .search_kernels import (
    NextEvent,
    expand_speed,
    find_crossing,
    find_next_event,
    integrate_speed,
)
from .series_kernels import (
    EPS,
    MAX_RATE_TIME,
    NO_ROOT,
    MotionSeries,
    MotionStart,
    bound_fastest_rate,
    bound_modal_rate,
    evaluate_polynomial,
    expand_motion,
    find_highest_power,
)
from .stick_kernels import (
    MAX_DECIDING_ORDER,
    choose_sticks,
    correct_sticking_slides,
    find_resting_interfaces,
)
from .sum_kernels import add_piece_sums

# Largest fraction of a time interval after which an interface that rested at a reversal still
# counts as resting; it prevents a second reversal at the same instant.
MIN_MOVING_FRACTION = 1e-12
# Maximum number of successive events without progress in time; a larger number
# indicates an endless sequence.
MAX_IDLE_EVENTS = 1000.0
# Ratio of a time interval to the predicted time until the next yield; with the margin of 30 % the
# interval usually contains the yield.
YIELD_MARGIN_FACTOR = 1.3
# Minimum duration of a time interval near a yield, relative to the longest possible interval.
MIN_DURATION_FRACTION = 0.02
# Largest velocity that is treated as round-off, relative to the sum of the magnitudes of its terms.
REST_TOL = 64 * EPS
# Minimum progress in time per event, in cycles; an event with less progress is idle.
MIN_PROGRESS = 1e-13


class Piece(NamedTuple):
    """Time interval of the march, over which the workspace holds the power series of the motion.

    - duration: [s]
    - rate: fastest rate [1/s], by which the duration was chosen
    - top: highest power of the series
    - remaining: time from its start to the next border [s]
    """

    duration: float
    rate: float
    top: int
    remaining: float


@njit(**NJIT_INLINE)
def time_to_breakpoint(time_state, stop):
    """Return the time [s] to the next end of a cycle, of a drive segment or of the march.

    `stop` is the cycle and the offset [s] at which the march ends.

    Borders are the end of the cycle, the next segment of the drive, and `stop` (cycle, offset).
    """
    now = time_state.now
    period = time_state.period[0]
    remaining = period - now[Time.OFFSET]
    if stop[0] == now[Time.CYCLE]:
        remaining = min(remaining, stop[1] - now[Time.OFFSET])
    k = int(now[Time.SEGMENT]) + 1
    if (
        k < time_state.segments.shape[0]
        and time_state.segments[k, Segment.CYCLE] == now[Time.CYCLE]
    ):
        remaining = min(remaining, time_state.segments[k, Segment.OFFSET] - now[Time.OFFSET])
    return max(remaining, 0.0)


@njit(**NJIT_KERNEL)
def step_to_breakpoint(time_state, stop, remaining):
    """Advance the time to the next end of a cycle, of a drive segment or of the march.

    Parameters
    ----------
    time_state : TimeState
    stop : tuple
        Cycle and offset [s] at which the march stops.
    remaining : float
        Time to the border [s].

    Returns
    -------
    bool
        Whether the drive changes there, from one sine to another or by a jump.
    """
    segment_before = int(time_state.now[Time.SEGMENT])
    cycle = time_state.now[Time.CYCLE]
    offset = time_state.now[Time.OFFSET] + remaining
    drive_changes = False
    now = time_state.now
    period = time_state.period[0]
    k = int(now[Time.SEGMENT]) + 1
    enters_segment = (
        k < time_state.segments.shape[0]
        and time_state.segments[k, Segment.CYCLE] == now[Time.CYCLE]
        and time_state.segments[k, Segment.OFFSET] - now[Time.OFFSET] <= remaining
    )
    if enters_segment:
        now[Time.OFFSET] = time_state.segments[k, Segment.OFFSET]
        now[Time.SEGMENT] = k
    elif stop[0] == now[Time.CYCLE] and stop[1] - now[Time.OFFSET] <= remaining:
        now[Time.OFFSET] = stop[1]
    else:
        now[Time.CYCLE] = now[Time.CYCLE] + 1
        now[Time.OFFSET] = 0.0
    if now[Time.OFFSET] >= period:
        now[Time.CYCLE] = now[Time.CYCLE] + 1
        now[Time.OFFSET] = 0.0
    k = int(now[Time.SEGMENT]) + 1
    if (
        k < time_state.segments.shape[0]
        and time_state.segments[k, Segment.CYCLE] == now[Time.CYCLE]
        and time_state.segments[k, Segment.OFFSET] <= now[Time.OFFSET]
    ):
        now[Time.SEGMENT] = k
    if int(now[Time.SEGMENT]) != segment_before:
        segment = time_state.segments[int(now[Time.SEGMENT])]
        old_acceleration = drive_value(
            time_state.segments[segment_before], Instant(cycle, offset, period)
        )
        new_acceleration = drive_value(segment, present_instant(time_state))
        drive_changes = (
            segment[Segment.KIND] == SEGMENT_KIND.sine
            and time_state.segments[segment_before, Segment.KIND] == SEGMENT_KIND.sine
        ) or abs(new_acceleration - old_acceleration) > 1e-12 * max(
            abs(old_acceleration), abs(new_acceleration)
        )
    return drive_changes


@njit(**NJIT_INLINE)
def write_row(row, duration, phase, begin, run):
    """Write the state at the start of a time interval into its row.

    Parameters
    ----------
    row : ndarray
        (w,) see `Row` and `Column`.
    duration : float
        [s].
    phase : float
        Phase of the drive [rad].
    begin : float
        A number of `RowBegins`.
    run : RunArrays
    """
    motion = run.motion
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    time_state = run.time_state
    n = len(modal_system.omega_squared)
    now = time_state.now
    row[Row.TIME] = now[Time.CYCLE] * time_state.period[0] + now[Time.OFFSET]
    row[Row.DURATION] = duration
    row[Row.PHASE] = phase
    row[Row.SEGMENT] = now[Time.SEGMENT]
    row[Row.BEGIN] = begin
    row[Row.CYCLE] = now[Time.CYCLE]
    row[Row.OFFSET] = now[Time.OFFSET]
    for i in range(n):
        row[Row.MOTION + i] = motion[0, i]
        row[Row.MOTION + n + i] = motion[1, i]
    for f in range(len(modal_system.inverse_mass)):
        column = Row.MOTION + 2 * n + N_COLUMNS * f
        tangent = find_tangent(f, table, memory)
        row[column + Column.FORCE] = memory.force[f]
        row[column + Column.STIFFNESS] = tangent.stiffness
        row[column + Column.SLIPPING] = tangent.slipping
        row[column + Column.LIMIT] = tangent.limit
        row[column + Column.SLIP] = memory.slip[f]
        row[column + Column.WORK] = memory.work[f]
        row[column + Column.LOSS] = memory.loss[f]
        direction = memory.direction[f]
        if table.static_limit[f] > 0.0:
            direction = memory.rigid_state[f] if abs(memory.rigid_state[f]) < 2.0 else 0.0
        row[column + Column.DIRECTION] = direction
        row[column + Column.SLIDE] = memory.slide[f]


@njit(**NJIT_INLINE)
def move_state(u, piece, run):
    """Advance modes, interfaces and friction elements over part of a time interval.

    Their energies are added to the sums of the run.

    Parameters
    ----------
    u : float
        Fraction of the piece.
    piece : Piece
    run : RunArrays
    """
    top = piece.top
    motion = run.motion
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    coefs = workspace.coefficients
    ledger = run.sums.ledger
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            memory.force[f] = evaluate_polynomial(workspace.constraint.reactions[f], 0, top - 2, u)
            continue
        stiffness, slipping, limit = find_tangent(f, table, memory)
        step = integrate_speed(workspace.polynomials[f], top, u)
        work = (memory.force[f] + 0.5 * stiffness * step) * step
        memory.work[f] += work
        memory.loss[f] += limit * abs(step)
        memory.slip[f] += slipping * step
        memory.force[f] += stiffness * step
        ledger[Ledger.FRICTION_WORK] += work
        ledger[Ledger.FRICTION_LOSS] += limit * abs(step)
        if slipping >= 0.5:
            ledger[Ledger.HAS_SLIPPED] = 1.0
    output = 0.0
    for i in range(n):
        displacement = coefs[top, i]
        rate = top * coefs[top, i]
        for k in range(top - 1, 0, -1):
            displacement = displacement * u + coefs[k, i]
            rate = rate * u + k * coefs[k, i]
        motion[0, i] += u * displacement
        motion[1, i] = rate / piece.duration
        output += modal_system.output[i] * motion[0, i]
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            continue
        displacement = 0.0
        for i in range(n):
            displacement += modal_system.interfaces[f, i] * motion[0, i]
        memory.slide[f] = displacement
    correct_sticking_slides(run)
    widen_extremes(output, run)


@njit(**NJIT_INLINE)
def widen_extremes(out, run):
    """Include an output displacement in the extremes of the present cycle.

    Parameters
    ----------
    out : float
        Displacement of the output [m].
    run : RunArrays
    """
    run_sums = run.sums
    cycle = int(run.time_state.now[Time.CYCLE])
    run_sums.extremes[cycle, 0] = min(run_sums.extremes[cycle, 0], out)
    run_sums.extremes[cycle, 1] = max(run_sums.extremes[cycle, 1], out)


@njit(cache=True, **NJIT_INLINE)
def stored_energy(motion, modal_system, table, memory):
    """Return the energy stored in the modes and in the friction elements [J].

    Parameters
    ----------
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory

    Returns
    -------
    float
    """
    energy = 0.0
    for i in range(len(modal_system.omega_squared)):
        energy += motion[1, i] ** 2 + modal_system.omega_squared[i] * motion[0, i] ** 2
    energy *= 0.5 * modal_system.mass
    for f in range(len(modal_system.inverse_mass)):
        energy += find_force_and_energy(f, table, memory)[1]
    return energy


@njit(**NJIT_KERNEL)
def choose_current_sticks(run):
    """Choose which interfaces stick from the present time on.

    Parameters
    ----------
    run : RunArrays

    Returns
    -------
    bool
        Whether a choice was found.
    """
    modal_system = run.modal_system
    table = run.table
    time_state = run.time_state
    workspace = run.workspace
    segment = time_state.segments[int(time_state.now[Time.SEGMENT])]
    for f in range(len(modal_system.inverse_mass)):
        workspace.stiffness[f] = find_tangent(f, table, run.memory).stiffness
        if table.static_limit[f] > 0.0 and workspace.choice.is_resting[f] == 1.0:
            workspace.stiffness[f] = 0.0
    h = MAX_RATE_TIME / max(
        bound_fastest_rate(modal_system, workspace.stiffness),
        fastest_drive_rate(time_state),
    )
    expand_drive(segment, present_instant(time_state), h, MAX_DECIDING_ORDER + 1, workspace.drive)
    return choose_sticks(h, run)


@njit(**NJIT_KERNEL)
def choose_initial_sticks(run):
    """Choose which interfaces stick at the start of a run.

    The guess is that a rigid element sticks if its interface is at rest.

    Parameters
    ----------
    run : RunArrays

    Returns
    -------
    bool
        Whether a choice was found.
    """
    modal_system = run.modal_system
    choice = run.workspace.choice
    has_rigid = False
    for f in range(len(modal_system.inverse_mass)):
        speed = 0.0
        size = 0.0
        for i in range(len(modal_system.omega_squared)):
            term = modal_system.interfaces[f, i] * run.motion[1, i]
            speed += term
            size += abs(term)
        moves = abs(speed) > REST_TOL * size
        choice.slip_signs[f] = 0.0
        choice.is_resting[f] = 0.0
        choice.orders[f, 0] = 0.0
        choice.orders[f, 1] = 0.0
        if run.table.static_limit[f] == 0.0:
            continue
        has_rigid = True
        if moves:
            choice.slip_signs[f] = 1.0 if speed > 0 else -1.0
        else:
            choice.is_resting[f] = 1.0
        run.memory.rigid_state[f] = choice.slip_signs[f]
    if not has_rigid:
        return True
    return choose_current_sticks(run)


@njit(**NJIT_INLINE)
def estimate_time_to_yield(run):
    """Estimate the time until the next friction element yields, from the present velocities.

    The estimate is a time [s] multiplied by YIELD_MARGIN_FACTOR/MAX_RATE_TIME.

    Parameters
    ----------
    run : RunArrays

    Returns
    -------
    float
    """
    modal_system = run.modal_system
    memory = run.memory
    time = 1e300
    for f in range(len(modal_system.inverse_mass)):
        speed = 0.0
        for i in range(len(modal_system.omega_squared)):
            speed += modal_system.interfaces[f, i] * run.motion[1, i]
        gap = next_yield_slide(f, 1.0 if speed > 0 else -1.0, run.table, memory) - memory.slide[f]
        if speed * gap > 0:
            time = min(time, gap / speed)
    return YIELD_MARGIN_FACTOR / MAX_RATE_TIME * time


@njit(**NJIT_INLINE)
def output_displacement(run):
    """Return the present displacement of the output [m]."""
    modal_system = run.modal_system
    displacement = 0.0
    for i in range(len(modal_system.omega_squared)):
        displacement += modal_system.output[i] * run.motion[0, i]
    return displacement


@njit(**NJIT_INLINE)
def apply_event(event, run):
    """Update the friction elements after an event, and mark the interfaces that are at rest.

    Parameters
    ----------
    event : NextEvent
    run : RunArrays
    """
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    time_state = run.time_state
    kind = event.kind
    interface = event.interface
    if kind == EVENT_KIND.yielding:
        release_next_element(interface, event.sign, table, memory)
    elif kind == EVENT_KIND.reversal:
        store_reversal(interface, memory)
        time_state.is_at_reversal[interface] = 1.0
        if modal_system.output_interface == interface:
            time_state.is_at_reversal[len(modal_system.inverse_mass)] = 1.0
    elif kind == EVENT_KIND.output_reversal:
        time_state.is_at_reversal[interface] = 1.0
    if (kind == EVENT_KIND.yielding or kind == EVENT_KIND.reversal) and table.static_limit[
        interface
    ] == 0.0:
        memory.force[interface] = find_force_and_energy(interface, table, memory)[0]


@njit(**NJIT_INLINE)
def expand_piece(h, rate, run):
    """Expand the motion over a time interval as a power series in time.

    Parameters
    ----------
    h : float
        Duration of the piece [s].
    rate : float
        Fastest rate [1/s].
    run : RunArrays

    Returns
    -------
    int
        Highest power of the series.
    """
    time_state = run.time_state
    workspace = run.workspace
    top = find_highest_power(rate * h)
    segment = time_state.segments[int(time_state.now[Time.SEGMENT])]
    expand_drive(segment, present_instant(time_state), h, top, workspace.drive)
    start = MotionStart(run.motion[0], run.motion[1], run.memory.force)
    series = MotionSeries(workspace.drive[0], workspace.coefficients)
    expand_motion(start, series, h, top, run.modal_system, workspace)
    return top


@njit(**NJIT_INLINE)
def find_travel_crossing(travel, u, top, run):
    """Return the fraction of a time interval at which the output reaches its travel limit.

    Parameters
    ----------
    travel : float
        Travel of the output [m].
    u : float
        Fraction of the piece up to which the output is monotone.
    top : int
        Highest power of the series.
    run : RunArrays

    Returns
    -------
    float
        NO_ROOT if it does not.
    """
    modal_system = run.modal_system
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    poly = workspace.polynomials[n_interfaces + 1]
    expand_speed(
        modal_system.output, len(modal_system.omega_squared), workspace.coefficients, top, poly
    )
    present_output = output_displacement(run)
    step = integrate_speed(poly, top, u)
    if abs(present_output + step) <= travel or step == 0.0:
        return NO_ROOT
    return find_crossing(
        poly,
        top,
        (travel if step > 0 else -travel) - present_output,
        u,
        workspace.polynomials[n_interfaces],
    )


@njit(**NJIT_INLINE)
def choose_duration(rate, remaining, run):
    """Return the duration of the next time interval of the march [s].

    The interval ends just after the next yield predicted from the present speeds, but lasts at least
    MIN_DURATION_FRACTION of the longest interval.

    Parameters
    ----------
    rate : float
        Fastest rate [1/s].
    remaining : float
        Time to the next border [s], the largest duration.
    run : RunArrays

    Returns
    -------
    float
    """
    to_yield = rate * estimate_time_to_yield(run)
    return min(MAX_RATE_TIME / rate * min(1.0, max(to_yield, MIN_DURATION_FRACTION)), remaining)


@njit(**NJIT_INLINE)
def start_piece(remaining, run):
    """Choose the duration of the next time interval and expand the motion over it.

    Parameters
    ----------
    remaining : float
        Time to the next border [s].
    run : RunArrays

    Returns
    -------
    Piece
    """
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    time_state = run.time_state
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    for f in range(n_interfaces):
        workspace.stiffness[f] = find_tangent(f, table, memory).stiffness
    modal_rate = bound_modal_rate(modal_system, workspace)
    rate = max(modal_rate, fastest_drive_rate(time_state))
    h = choose_duration(rate, remaining, run)
    top = expand_piece(h, rate, run)
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            memory.force[f] = workspace.constraint.reactions[f, 0]
    return Piece(h, rate, top, remaining)


@njit(**NJIT_INLINE)
def find_piece_end(top, run):
    """Find the first event in a time interval, including the travel limit of the output.

    Parameters
    ----------
    top : int
        Highest power of the series.
    run : RunArrays

    Returns
    -------
    NextEvent
    """
    event = find_next_event(top, run)
    travel = run.sums.limits[Limit.TRAVEL]
    if travel < 1e300 and event.u > 0:
        root = find_travel_crossing(travel, event.u, top, run)
        if root <= event.u:
            return NextEvent(root, EVENT_KIND.travel, event.interface, event.sign)
    return event


@njit(**NJIT_INLINE)
def reaches_breakpoint(piece, u, now):
    """Return whether the end of a cycle, drive segment or march is reached, within round-off.

    Parameters
    ----------
    piece : Piece
    u : float
        Fraction of the piece.
    now : ndarray
        `TimeState.now` at the start of the piece.

    Returns
    -------
    bool
    """
    if piece.duration != piece.remaining:
        return False
    offset = now[Time.OFFSET]
    return u == 1.0 or offset + u * piece.duration >= offset + piece.remaining


@njit(**NJIT_INLINE)
def reset_forces(run):
    """Recompute all friction forces from the memory of the elements, to remove round-off.

    Parameters
    ----------
    run : RunArrays
    """
    memory = run.memory
    for f in range(len(run.modal_system.inverse_mass)):
        memory.force[f] = interface_force(f, run.table, memory)


@njit(**NJIT_INLINE)
def cross_breakpoint(kind, remaining, stop, run):
    """Pass the end of a cycle, of a drive segment or of the march.

    Parameters
    ----------
    kind : int
        Kind of the event there.
    remaining : float
        Time to the border [s].
    stop : tuple
        Cycle and offset [s] at which the march stops.
    run : RunArrays

    Returns
    -------
    drive_changes : bool
    repeats : bool
        Whether the motion repeats from here on.
    """
    time_state = run.time_state
    drive_changes = step_to_breakpoint(time_state, stop, remaining)
    repeats = False
    if time_state.now[Time.OFFSET] == 0.0 and kind == EVENT_KIND.none:
        repeats = detect_repeat(run)
    elif time_state.now[Time.OFFSET] == 0.0:
        clear_previous_cycle(run.previous)
    # The forces are reset at the end of every cycle, so that a run in several calls gives
    # the same result as a single call.
    reset_forces(run)
    return drive_changes, repeats


@njit(**NJIT_INLINE)
def clear_reversal_marks(u, time_state):
    """Clear the marks of resting interfaces once the motion has left the reversal.

    It has left it after more than MIN_MOVING_FRACTION of the time interval; u is the fraction
    that has passed.
    """
    if u > MIN_MOVING_FRACTION:
        time_state.is_at_reversal[:] = 0.0


@njit(**NJIT_INLINE)
def is_before(now, stop):
    """Return whether the present time lies before a stop time (cycle, offset [s])."""
    if now[Time.CYCLE] == stop[0]:
        return now[Time.OFFSET] < stop[1]
    return now[Time.CYCLE] < stop[0]


@njit(**NJIT_INLINE)
def is_idle(progress, run):
    """Count successive events without progress in time; return whether there are too many.

    Parameters
    ----------
    progress : float
        Time from the event before [s].
    run : RunArrays

    Returns
    -------
    bool
        Whether there are too many in a row.
    """
    run_sums = run.sums
    if progress < MIN_PROGRESS * run.time_state.period[0]:
        run_sums.limits[Limit.N_IDLE] += 1
    else:
        run_sums.limits[Limit.N_IDLE] = 0.0
    return run_sums.limits[Limit.N_IDLE] > MAX_IDLE_EVENTS


@njit(**NJIT_INLINE)
def choose_row_begin(kind, changes_stick, drive_changes):
    """Return the code that states why a time interval begins after an event.

    Parameters
    ----------
    kind : int
        Kind of the event, a number of `EventKinds`.
    changes_stick : bool
        Whether an interface stops or is released.
    drive_changes : bool
        Whether the drive changes there.

    Returns
    -------
    float
        A number of `RowBegins`.
    """
    if changes_stick:
        return float(ROW_BEGIN.stick_or_slip)
    if drive_changes:
        return float(ROW_BEGIN.drive_change)
    if kind == EVENT_KIND.yielding:
        return float(ROW_BEGIN.yielding)
    if kind == EVENT_KIND.reversal or kind == EVENT_KIND.output_reversal:
        return float(ROW_BEGIN.reversal)
    return float(ROW_BEGIN.none)


@njit(**NJIT_INLINE)
def move_over_piece(piece, event, stop, run):
    """Advance motion, time and sums over a time interval up to its event.

    Parameters
    ----------
    piece : Piece
    event : NextEvent
    stop
        See `march`.
    run : RunArrays

    Returns
    -------
    drive_changes : bool
        Whether the drive changes at the end of the piece.
    repeats : bool
        Whether the motion repeats from there on.
    """
    time_state = run.time_state
    now = time_state.now
    h = piece.duration
    u = event.u
    drive_changes = False
    repeats = False
    add_piece_sums(u, piece, run)
    clear_reversal_marks(u, time_state)
    run.workspace.choice.orders[:] = 0.0
    move_state(u, piece, run)
    if reaches_breakpoint(piece, u, now):
        drive_changes, repeats = cross_breakpoint(event.kind, piece.remaining, stop, run)
    else:
        now[Time.OFFSET] += u * h
    ledger = run.sums.ledger
    energy = stored_energy(run.motion, run.modal_system, run.table, run.memory)
    ledger[Ledger.MAX_STORED] = max(ledger[Ledger.MAX_STORED], energy)
    ledger[Ledger.N_PIECES] += 1
    return drive_changes, repeats


@njit(cache=True, **NJIT_KERNEL)
def march(stop, run, rows):
    """March the motion from the present time to a stop time (cycle, offset [s]).

    Parameters
    ----------
    stop : tuple
    run : RunArrays
    rows : ndarray
        (r, w) becomes one row per piece, see `Row`; none is written where r = 0.

    Returns
    -------
    status : int
        A number of `MarchStatus`.
    n_rows : int
        Rows written.

    Notes
    -----
    A run that is made in parts is the same bit by bit. Cost: 0.2 to 0.5 us per piece of one mode.
    """
    time_state = run.time_state
    choice = run.workspace.choice
    n_rows = 0
    now = time_state.now
    repeats = False
    begin = max(now[Time.BEGIN], float(ROW_BEGIN.yielding))
    now[Time.BEGIN] = 0.0
    if choice.orders[0, 0] < 0.0 and not choose_initial_sticks(run):
        return MARCH_STATUS.undetermined, n_rows
    if now[Time.IS_PAUSED] == 0.0:
        reset_forces(run)
    now[Time.IS_PAUSED] = 0.0
    while is_before(now, stop):
        if n_rows == rows.shape[0] and n_rows > 0:
            # The forces are not reset after a pause, because they continue unchanged.
            now[Time.BEGIN] = begin
            now[Time.IS_PAUSED] = 1.0
            return MARCH_STATUS.full, n_rows
        segment = time_state.segments[int(now[Time.SEGMENT])]
        phase = drive_phase(segment, present_instant(time_state))
        remaining = time_to_breakpoint(time_state, stop)
        piece = start_piece(remaining, run)
        event = find_piece_end(piece.top, run)
        changes_stick = False
        if event.kind == EVENT_KIND.reversal or event.kind == EVENT_KIND.release:
            changes_stick = run.table.static_limit[event.interface] > 0.0
        drive_changes = False
        if changes_stick or piece.duration == remaining:
            find_resting_interfaces(event.u, piece, run)
        if event.u > 0:
            if now[Time.OFFSET] == 0.0:
                widen_extremes(output_displacement(run), run)
            if rows.shape[0] > 0:
                duration = event.u * piece.duration
                write_row(rows[n_rows], duration, phase, begin, run)
                n_rows += 1
            drive_changes, repeats = move_over_piece(piece, event, stop, run)
        if is_idle(event.u * piece.duration, run):
            return MARCH_STATUS.idle, n_rows
        begin = choose_row_begin(event.kind, changes_stick, drive_changes)
        apply_event(event, run)
        if changes_stick:
            choice.is_resting[event.interface] = 1.0
            choice.slip_signs[event.interface] = (
                event.sign if event.kind == EVENT_KIND.release else 0.0
            )
        if (changes_stick or drive_changes) and not choose_current_sticks(run):
            return MARCH_STATUS.undetermined, n_rows
        if event.kind == EVENT_KIND.travel:
            now[Time.BEGIN] = 0.0
            return MARCH_STATUS.travel, n_rows
        if repeats:
            now[Time.BEGIN] = begin
            return MARCH_STATUS.repeats, n_rows
    now[Time.BEGIN] = begin
    return MARCH_STATUS.done, n_rows
