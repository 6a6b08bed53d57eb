"""March from event to event of modes behind rigid and elastic-plastic elements (compiled).

The loop `march` does five things for every piece: it chooses the length of the piece, expands the
motion, searches for the first event, moves the state to it, and changes the elements as the event
asks. An event is a yield, the release of an interface that a rigid element holds, a turning point
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
    store_turning_point,
)
from .positions_kernels import (
    BEGIN,
    EVENT,
    KIND,
    N_COLUMNS,
    STATUS,
    Column,
    Ledger,
    Limit,
    Row,
    Segment,
    Time,
)
from .repeat_kernels import detect_repeat, forget_previous
from .search_kernels import (
    NextEvent,
    displacement_at,
    expand_speed,
    find_crossing,
    find_next_event,
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
    MAX_ORDER,
    choose_sticks,
    correct_sticking_slides,
    find_resting_interfaces,
)
from .sum_kernels import add_piece_sums

# fraction of a piece within which an interface that was at rest at a turning point still rests, so that no second
# reversal is found there
MIN_MOVING_FRACTION = 1e-12
# largest number of successive events without progress in time; more count as an endless sequence
MAX_IDLE_EVENTS = 1000.0
# a piece is longer by this factor than the predicted time to the next yield, which should lie in it
YIELD_MARGIN = 1.3
# fraction of the longest piece that a piece takes at least where a yield is near
MIN_FRACTION = 0.02
# fraction of the sum of magnitudes of a velocity, below which it is round-off
REST_TOL = 64 * EPS
# progress in time as a fraction of a cycle, below which an event counts as idle
MIN_PROGRESS = 1e-13


class Piece(NamedTuple):
    """A piece of the motion, whose series is in the workspace.

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
def time_to_border(time_state, stop):
    """Return the time [s] to the next border.

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
def step_to_border(time_state, stop, remaining):
    """Move the time to the next border.

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
    before = int(time_state.now[Time.SEGMENT])
    cycle = time_state.now[Time.CYCLE]
    offset = time_state.now[Time.OFFSET] + remaining
    drive_changes = False
    now = time_state.now
    period = time_state.period[0]
    k = int(now[Time.SEGMENT]) + 1
    after = (
        k < time_state.segments.shape[0]
        and time_state.segments[k, Segment.CYCLE] == now[Time.CYCLE]
        and time_state.segments[k, Segment.OFFSET] - now[Time.OFFSET] <= remaining
    )
    if after:
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
    if int(now[Time.SEGMENT]) != before:
        segment = time_state.segments[int(now[Time.SEGMENT])]
        old = drive_value(time_state.segments[before], Instant(cycle, offset, period))
        new = drive_value(segment, present_instant(time_state))
        drive_changes = (
            segment[Segment.KIND] == KIND.sine
            and time_state.segments[before, Segment.KIND] == KIND.sine
        ) or abs(new - old) > 1e-12 * max(abs(old), abs(new))
    return drive_changes


@njit(**NJIT_INLINE)
def write_row(row, duration, phase, begin, run):
    """Write the row of a piece as it begins.

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
        at = Row.MOTION + 2 * n + N_COLUMNS * f
        tangent = find_tangent(f, table, memory)
        row[at + Column.FORCE] = memory.force[f]
        row[at + Column.STIFFNESS] = tangent.stiffness
        row[at + Column.SLIPPING] = tangent.slipping
        row[at + Column.LIMIT] = tangent.limit
        row[at + Column.SLIP] = memory.slip[f]
        row[at + Column.WORK] = memory.work[f]
        row[at + Column.LOSS] = memory.loss[f]
        direction = memory.direction[f]
        if table.static_limit[f] > 0.0:
            direction = memory.rigid_state[f] if abs(memory.rigid_state[f]) < 2.0 else 0.0
        row[at + Column.DIRECTION] = direction
        row[at + Column.SLIDE] = memory.slide[f]


@njit(**NJIT_INLINE)
def move_state(u, piece, run):
    """Move coordinates, interfaces and elements over a piece up to u, and add their energies.

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
        step = displacement_at(workspace.polynomials[f], top, u)
        work = (memory.force[f] + 0.5 * stiffness * step) * step
        memory.work[f] += work
        memory.loss[f] += limit * abs(step)
        memory.slip[f] += slipping * step
        memory.force[f] += stiffness * step
        ledger[Ledger.FRICTION_WORK] += work
        ledger[Ledger.FRICTION_LOSS] += limit * abs(step)
        if slipping >= 0.5:
            ledger[Ledger.HAS_SLIPPED] = 1.0
    out = 0.0
    for i in range(n):
        place = coefs[top, i]
        rate = top * coefs[top, i]
        for k in range(top - 1, 0, -1):
            place = place * u + coefs[k, i]
            rate = rate * u + k * coefs[k, i]
        motion[0, i] += u * place
        motion[1, i] = rate / piece.duration
        out += modal_system.output[i] * motion[0, i]
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            continue
        place = 0.0
        for i in range(n):
            place += modal_system.interfaces[f, i] * motion[0, i]
        memory.slide[f] = place
    correct_sticking_slides(run)
    widen_extremes(out, run)


@njit(**NJIT_INLINE)
def widen_extremes(out, run):
    """Include a value of the output in the extremes of the present cycle.

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
    """Return the energy of the modes and of the elements [J].

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
    out = 0.0
    for i in range(len(modal_system.omega_squared)):
        out += motion[1, i] ** 2 + modal_system.omega_squared[i] * motion[0, i] ** 2
    out *= 0.5 * modal_system.mass
    for f in range(len(modal_system.inverse_mass)):
        out += find_force_and_energy(f, table, memory)[1]
    return out


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
    expand_drive(segment, present_instant(time_state), h, MAX_ORDER + 1, workspace.drive)
    return choose_sticks(h, run)


@njit(**NJIT_KERNEL)
def choose_initial_sticks(run):
    """Choose which interfaces stick at the start of a run.

    The guess is that a rigid element sticks where its interface is at rest.

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
    """Estimate the time to the next yield [s] from the present speeds.

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
    return YIELD_MARGIN / MAX_RATE_TIME * time


@njit(**NJIT_INLINE)
def output_displacement(run):
    """Return the displacement of the output [m]."""
    modal_system = run.modal_system
    out = 0.0
    for i in range(len(modal_system.omega_squared)):
        out += modal_system.output[i] * run.motion[0, i]
    return out


@njit(**NJIT_INLINE)
def apply_event(event, run):
    """Apply an event to the elements, and record which interfaces are at rest.

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
    if kind == EVENT.yielding:
        release_next_element(interface, event.sign, table, memory)
    elif kind == EVENT.reversal:
        store_turning_point(interface, memory)
        time_state.is_at_turn[interface] = 1.0
        if modal_system.output_interface == interface:
            time_state.is_at_turn[len(modal_system.inverse_mass)] = 1.0
    elif kind == EVENT.output_reversal:
        time_state.is_at_turn[interface] = 1.0
    if (kind == EVENT.yielding or kind == EVENT.reversal) and table.static_limit[interface] == 0.0:
        memory.force[interface] = find_force_and_energy(interface, table, memory)[0]


@njit(**NJIT_INLINE)
def expand_piece(h, rate, run):
    """Expand the motion over a piece.

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
    """Return the fraction of a piece at which the output passes +-travel.

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
    here = output_displacement(run)
    step = displacement_at(poly, top, u)
    if abs(here + step) <= travel or step == 0.0:
        return NO_ROOT
    return find_crossing(
        poly, top, (travel if step > 0 else -travel) - here, u, workspace.polynomials[n_interfaces]
    )


@njit(**NJIT_INLINE)
def choose_length(rate, remaining, run):
    """Return the duration of the next piece [s].

    The piece ends just after the next yield that the present speeds predict, but lasts at least
    MIN_FRACTION of the longest piece.

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
    return min(MAX_RATE_TIME / rate * min(1.0, max(to_yield, MIN_FRACTION)), remaining)


@njit(**NJIT_INLINE)
def start_piece(remaining, run):
    """Choose the length of the next piece and expand the motion over it.

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
    h = choose_length(rate, remaining, run)
    top = expand_piece(h, rate, run)
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            memory.force[f] = workspace.constraint.reactions[f, 0]
    return Piece(h, rate, top, remaining)


@njit(**NJIT_INLINE)
def find_piece_end(top, run):
    """Find the first event of a piece, including the end of the travel of the output.

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
            return NextEvent(root, EVENT.travel, event.interface, event.sign)
    return event


@njit(**NJIT_INLINE)
def reaches_border(piece, u, now):
    """Return whether a motion up to u of a piece reaches the border, to round-off.

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
    """Compute the forces of all interfaces from their memory, without accumulated round-off.

    Parameters
    ----------
    run : RunArrays
    """
    memory = run.memory
    for f in range(len(run.modal_system.inverse_mass)):
        memory.force[f] = interface_force(f, run.table, memory)


@njit(**NJIT_INLINE)
def cross_border(kind, remaining, stop, run):
    """Pass the end of a cycle or of a segment of the drive.

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
    drive_changes = step_to_border(time_state, stop, remaining)
    repeats = False
    if time_state.now[Time.OFFSET] == 0.0 and kind == EVENT.none:
        repeats = detect_repeat(run)
    elif time_state.now[Time.OFFSET] == 0.0:
        forget_previous(run.previous)
    # at every border, so that a run in parts gives the same result as a single run
    reset_forces(run)
    return drive_changes, repeats


@njit(**NJIT_INLINE)
def clear_rests(u, time_state):
    """Clear the marks of interfaces that rested at a turning point, after a motion up to u."""
    if u > MIN_MOVING_FRACTION:
        time_state.is_at_turn[:] = 0.0


@njit(**NJIT_INLINE)
def is_before(now, stop):
    """Return whether the time lies before `stop` (cycle, offset [s])."""
    if now[Time.CYCLE] == stop[0]:
        return now[Time.OFFSET] < stop[1]
    return now[Time.CYCLE] < stop[0]


@njit(**NJIT_INLINE)
def is_idle(progress, run):
    """Count events without progress in time, and return whether there are too many.

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
def next_begin(kind, changes_stick, drive_changes):
    """Return the reason for which a row begins after an event.

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
        return float(BEGIN.stick_or_slip)
    if drive_changes:
        return float(BEGIN.drive_border)
    if kind == EVENT.yielding:
        return float(BEGIN.yielding)
    if kind == EVENT.reversal or kind == EVENT.output_reversal:
        return float(BEGIN.reversal)
    return float(BEGIN.none)


@njit(**NJIT_INLINE)
def move_over_piece(piece, event, stop, run):
    """Move motion, time and sums over a piece up to its event.

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
    clear_rests(u, time_state)
    run.workspace.choice.orders[:] = 0.0
    move_state(u, piece, run)
    if reaches_border(piece, u, now):
        drive_changes, repeats = cross_border(event.kind, piece.remaining, stop, run)
    else:
        now[Time.OFFSET] += u * h
    ledger = run.sums.ledger
    energy = stored_energy(run.motion, run.modal_system, run.table, run.memory)
    ledger[Ledger.MAX_STORED] = max(ledger[Ledger.MAX_STORED], energy)
    ledger[Ledger.N_PIECES] += 1
    return drive_changes, repeats


@njit(cache=True, **NJIT_KERNEL)
def march(stop, run, rows):
    """March from the present time to `stop` (cycle, offset [s]).

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
    used = 0
    now = time_state.now
    repeats = False
    begin = max(now[Time.BEGIN], float(BEGIN.yielding))
    now[Time.BEGIN] = 0.0
    if choice.orders[0, 0] < 0.0 and not choose_initial_sticks(run):
        return STATUS.undetermined, used
    if now[Time.IS_PAUSED] == 0.0:
        reset_forces(run)
    now[Time.IS_PAUSED] = 0.0
    while is_before(now, stop):
        if used == rows.shape[0] and used > 0:
            # the forces continue unchanged
            now[Time.BEGIN] = begin
            now[Time.IS_PAUSED] = 1.0
            return STATUS.full, used
        segment = time_state.segments[int(now[Time.SEGMENT])]
        phase = drive_phase(segment, present_instant(time_state))
        remaining = time_to_border(time_state, stop)
        piece = start_piece(remaining, run)
        event = find_piece_end(piece.top, run)
        changes_stick = False
        if event.kind == EVENT.reversal or event.kind == EVENT.release:
            changes_stick = run.table.static_limit[event.interface] > 0.0
        drive_changes = False
        if changes_stick or piece.duration == remaining:
            find_resting_interfaces(event.u, piece, run)
        if event.u > 0:
            if now[Time.OFFSET] == 0.0:
                widen_extremes(output_displacement(run), run)
            if rows.shape[0] > 0:
                duration = event.u * piece.duration
                write_row(rows[used], duration, phase, begin, run)
                used += 1
            drive_changes, repeats = move_over_piece(piece, event, stop, run)
        if is_idle(event.u * piece.duration, run):
            return STATUS.idle, used
        begin = next_begin(event.kind, changes_stick, drive_changes)
        apply_event(event, run)
        if changes_stick:
            choice.is_resting[event.interface] = 1.0
            choice.slip_signs[event.interface] = event.sign if event.kind == EVENT.release else 0.0
        if (changes_stick or drive_changes) and not choose_current_sticks(run):
            return STATUS.undetermined, used
        if event.kind == EVENT.travel:
            now[Time.BEGIN] = 0.0
            return STATUS.travel, used
        if repeats:
            now[Time.BEGIN] = begin
            return STATUS.repeats, used
    now[Time.BEGIN] = begin
    return STATUS.done, used
