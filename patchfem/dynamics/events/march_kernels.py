"""March from event to event of modes behind rigid and elastic-plastic elements (compiled).

The loop `march` does five things for every piece: it chooses the length of the piece, expands the
motion, searches for the first event, moves the state to it, and changes the elements as the event
asks. An event is a yield, the release of an interface that a rigid element holds, a turning point
of an interface or of the output (`search_kernels`), or a border of the drive.
"""

from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import drive_phase, drive_value, expand_drive, fastest_drive_rate
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
    COLUMN,
    EVENT,
    KIND,
    LEDGER,
    LIMIT,
    N_COLUMNS,
    ROW,
    SEGMENT,
    STATUS,
    TIME,
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


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def time_to_border(time_state, stop):
    """Return the time [s] to the next border.

    Borders are the end of the cycle, the next segment of the drive, and `stop` (cycle, offset).
    """
    now = time_state.now
    period = time_state.period[0]
    remaining = period - now[TIME.offset]
    if stop[0] == now[TIME.cycle]:
        remaining = min(remaining, stop[1] - now[TIME.offset])
    k = int(now[TIME.segment]) + 1
    if (
        k < time_state.segments.shape[0]
        and time_state.segments[k, SEGMENT.cycle] == now[TIME.cycle]
    ):
        remaining = min(remaining, time_state.segments[k, SEGMENT.offset] - now[TIME.offset])
    return max(remaining, 0.0)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
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
    before = int(time_state.now[TIME.segment])
    cycle = time_state.now[TIME.cycle]
    offset = time_state.now[TIME.offset] + remaining
    drive_changes = False
    now = time_state.now
    period = time_state.period[0]
    k = int(now[TIME.segment]) + 1
    after = (
        k < time_state.segments.shape[0]
        and time_state.segments[k, SEGMENT.cycle] == now[TIME.cycle]
        and time_state.segments[k, SEGMENT.offset] - now[TIME.offset] <= remaining
    )
    if after:
        now[TIME.offset] = time_state.segments[k, SEGMENT.offset]
        now[TIME.segment] = k
    elif stop[0] == now[TIME.cycle] and stop[1] - now[TIME.offset] <= remaining:
        now[TIME.offset] = stop[1]
    else:
        now[TIME.cycle] = now[TIME.cycle] + 1
        now[TIME.offset] = 0.0
    if now[TIME.offset] >= period:
        now[TIME.cycle] = now[TIME.cycle] + 1
        now[TIME.offset] = 0.0
    k = int(now[TIME.segment]) + 1
    if (
        k < time_state.segments.shape[0]
        and time_state.segments[k, SEGMENT.cycle] == now[TIME.cycle]
        and time_state.segments[k, SEGMENT.offset] <= now[TIME.offset]
    ):
        now[TIME.segment] = k
    if int(now[TIME.segment]) != before:
        segment = time_state.segments[int(now[TIME.segment])]
        old = drive_value(time_state.segments[before], cycle, offset, period)
        new = drive_value(segment, now[TIME.cycle], now[TIME.offset], period)
        drive_changes = (
            segment[SEGMENT.kind] == KIND.sine
            and time_state.segments[before, SEGMENT.kind] == KIND.sine
        ) or abs(new - old) > 1e-12 * max(abs(old), abs(new))
    return drive_changes


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_row(row, motion, duration, phase, begin, modal_system, table, memory, time_state):
    """Write the row of a piece as it begins.

    Parameters
    ----------
    row : ndarray
        (w,) see `RowColumns` and `InterfaceColumns`.
    motion, modal_system, table, memory, time_state
    duration : float
        [s].
    phase : float
        Phase of the drive [rad].
    begin : float
        A number of `RowBegins`.
    """
    n = len(modal_system.omega_squared)
    now = time_state.now
    row[ROW.time] = now[TIME.cycle] * time_state.period[0] + now[TIME.offset]
    row[ROW.duration] = duration
    row[ROW.phase] = phase
    row[ROW.segment] = now[TIME.segment]
    row[ROW.begin] = begin
    row[ROW.cycle] = now[TIME.cycle]
    row[ROW.offset] = now[TIME.offset]
    for i in range(n):
        row[ROW.motion + i] = motion[0, i]
        row[ROW.motion + n + i] = motion[1, i]
    for f in range(len(modal_system.inverse_mass)):
        at = ROW.motion + 2 * n + N_COLUMNS * f
        tangent = find_tangent(f, table, memory)
        row[at + COLUMN.force] = memory.force[f]
        row[at + COLUMN.stiffness] = tangent.stiffness
        row[at + COLUMN.slipping] = tangent.slipping
        row[at + COLUMN.limit] = tangent.limit
        row[at + COLUMN.slip] = memory.slip[f]
        row[at + COLUMN.work] = memory.work[f]
        row[at + COLUMN.loss] = memory.loss[f]
        direction = memory.direction[f]
        if table.static_limit[f] > 0.0:
            direction = memory.rigid_state[f] if abs(memory.rigid_state[f]) < 2.0 else 0.0
        row[at + COLUMN.direction] = direction
        row[at + COLUMN.slide] = memory.slide[f]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_state(u, h, top, motion, modal_system, table, memory, time_state, run_sums, workspace):
    """Move coordinates, interfaces and elements over a piece up to u, and add their energies.

    Parameters
    ----------
    u : float
        Fraction of the piece.
    h : float
        Duration of the piece [s].
    top : int
        Highest power of the series.
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    run_sums : RunSums
    workspace : Workspace
    """
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    coefs = workspace.coefficients
    ledger = run_sums.ledger
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
        ledger[LEDGER.friction_work] += work
        ledger[LEDGER.friction_loss] += limit * abs(step)
        if slipping >= 0.5:
            ledger[LEDGER.has_slipped] = 1.0
    out = 0.0
    for i in range(n):
        place = coefs[top, i]
        rate = top * coefs[top, i]
        for k in range(top - 1, 0, -1):
            place = place * u + coefs[k, i]
            rate = rate * u + k * coefs[k, i]
        motion[0, i] += u * place
        motion[1, i] = rate / h
        out += modal_system.output[i] * motion[0, i]
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            continue
        place = 0.0
        for i in range(n):
            place += modal_system.interfaces[f, i] * motion[0, i]
        memory.slide[f] = place
    correct_sticking_slides(motion, modal_system, memory, workspace)
    widen_extremes(out, time_state, run_sums)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def widen_extremes(out, time_state, run_sums):
    """Include a value of the output in the extremes of the present cycle.

    Parameters
    ----------
    out : float
        Displacement of the output [m].
    time_state : TimeState
    run_sums : RunSums
    """
    cycle = int(time_state.now[TIME.cycle])
    run_sums.extremes[cycle, 0] = min(run_sums.extremes[cycle, 0], out)
    run_sums.extremes[cycle, 1] = max(run_sums.extremes[cycle, 1], out)


@njit(
    error_model="numpy", cache=True, forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT
)
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


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def choose_current_sticks(motion, modal_system, table, memory, time_state, workspace):
    """Choose which interfaces stick from the present time on.

    Parameters
    ----------
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    workspace : Workspace
        Its `choice` holds the guess and which interfaces are at rest.

    Returns
    -------
    bool
        Whether a choice was found.
    """
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    now = time_state.now
    for f in range(len(modal_system.inverse_mass)):
        stiffness = find_tangent(f, table, memory).stiffness
        workspace.stiffness[f] = (
            0.0
            if table.static_limit[f] > 0.0 and workspace.choice.is_resting[f] == 1.0
            else stiffness
        )
    h = MAX_RATE_TIME / max(
        bound_fastest_rate(modal_system, workspace.stiffness),
        fastest_drive_rate(segment, time_state.period[0]),
    )
    expand_drive(
        segment,
        now[TIME.cycle],
        now[TIME.offset],
        time_state.period[0],
        h,
        MAX_ORDER + 1,
        workspace.drive,
    )
    return choose_sticks(motion, modal_system, table, memory, h, workspace)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def choose_initial_sticks(motion, modal_system, table, memory, time_state, workspace):
    """Choose which interfaces stick at the start of a run.

    The guess is that a rigid element sticks where its interface is at rest.

    Parameters
    ----------
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    workspace : Workspace

    Returns
    -------
    bool
        Whether a choice was found.
    """
    choice = workspace.choice
    has_rigid = False
    for f in range(len(modal_system.inverse_mass)):
        speed = 0.0
        size = 0.0
        for i in range(len(modal_system.omega_squared)):
            part = modal_system.interfaces[f, i] * motion[1, i]
            speed += part
            size += abs(part)
        moves = abs(speed) > REST_TOL * size
        choice.slip_signs[f] = 0.0
        choice.is_resting[f] = 0.0
        choice.orders[f, 0] = 0.0
        choice.orders[f, 1] = 0.0
        if table.static_limit[f] == 0.0:
            continue
        has_rigid = True
        if moves:
            choice.slip_signs[f] = 1.0 if speed > 0 else -1.0
        else:
            choice.is_resting[f] = 1.0
        memory.rigid_state[f] = choice.slip_signs[f]
    if not has_rigid:
        return True
    return choose_current_sticks(motion, modal_system, table, memory, time_state, workspace)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def estimate_time_to_yield(motion, modal_system, table, memory):
    """Estimate the time to the next yield [s] from the present speeds.

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
    time = 1e300
    for f in range(len(modal_system.inverse_mass)):
        speed = 0.0
        for i in range(len(modal_system.omega_squared)):
            speed += modal_system.interfaces[f, i] * motion[1, i]
        gap = next_yield_slide(f, 1.0 if speed > 0 else -1.0, table, memory) - memory.slide[f]
        if speed * gap > 0:
            time = min(time, gap / speed)
    return YIELD_MARGIN / MAX_RATE_TIME * time


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def output_displacement(motion, modal_system):
    """Return the displacement of the output [m]."""
    out = 0.0
    for i in range(len(modal_system.omega_squared)):
        out += modal_system.output[i] * motion[0, i]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def apply_event(event, modal_system, table, memory, time_state):
    """Apply an event to the elements, and record which interfaces are at rest.

    Parameters
    ----------
    event : NextEvent
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    """
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


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def expand_piece(h, rate, motion, force, modal_system, time_state, workspace):
    """Expand the motion over a piece.

    Parameters
    ----------
    h : float
        Duration of the piece [s].
    rate : float
        Fastest rate [1/s].
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    force : ndarray
        (i,) forces at the start [N].
    modal_system : ModalSystem
    time_state : TimeState
    workspace : Workspace

    Returns
    -------
    int
        Highest power of the series.
    """
    top = find_highest_power(rate * h)
    now = time_state.now
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    expand_drive(
        segment,
        now[TIME.cycle],
        now[TIME.offset],
        time_state.period[0],
        h,
        top,
        workspace.drive,
    )
    expand_motion(
        motion[0],
        motion[1],
        force,
        workspace.stiffness,
        modal_system,
        workspace.drive[0],
        h,
        top,
        workspace.coefficients,
        workspace,
    )
    return top


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_travel_crossing(top, modal_system, motion, workspace, travel, u):
    """Return the fraction of a piece at which the output passes +-travel.

    Parameters
    ----------
    top : int
        Highest power of the series.
    modal_system : ModalSystem
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    workspace : Workspace
    travel : float
        Travel of the output [m].
    u : float
        Fraction of the piece up to which the output is monotone.

    Returns
    -------
    float
        NO_ROOT if it does not.
    """
    n_interfaces = len(modal_system.inverse_mass)
    poly = workspace.polynomials[n_interfaces + 1]
    expand_speed(
        modal_system.output, len(modal_system.omega_squared), workspace.coefficients, top, poly
    )
    here = output_displacement(motion, modal_system)
    step = displacement_at(poly, top, u)
    if abs(here + step) <= travel or step == 0.0:
        return NO_ROOT
    return find_crossing(
        poly, top, (travel if step > 0 else -travel) - here, u, workspace.polynomials[n_interfaces]
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def choose_length(rate, remaining, motion, modal_system, table, memory):
    """Return the duration of the next piece [s].

    The piece ends just after the next yield that the present speeds predict, but lasts at least
    MIN_FRACTION of the longest piece.

    Parameters
    ----------
    rate : float
        Fastest rate [1/s].
    remaining : float
        Time to the next border [s], the largest duration.
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory

    Returns
    -------
    float
    """
    to_yield = rate * estimate_time_to_yield(motion, modal_system, table, memory)
    return min(MAX_RATE_TIME / rate * min(1.0, max(to_yield, MIN_FRACTION)), remaining)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def start_piece(remaining, motion, modal_system, table, memory, time_state, workspace):
    """Choose the length of the next piece and expand the motion over it.

    Parameters
    ----------
    remaining : float
        Time to the next border [s].
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    workspace : Workspace

    Returns
    -------
    Piece
    """
    n_interfaces = len(modal_system.inverse_mass)
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    for f in range(n_interfaces):
        workspace.stiffness[f] = find_tangent(f, table, memory).stiffness
    modal_rate = bound_modal_rate(modal_system, workspace)
    rate = max(modal_rate, fastest_drive_rate(segment, time_state.period[0]))
    h = choose_length(rate, remaining, motion, modal_system, table, memory)
    top = expand_piece(h, rate, motion, memory.force, modal_system, time_state, workspace)
    for f in range(n_interfaces):
        if is_sticking(f, table, memory):
            memory.force[f] = workspace.constraint.reactions[f, 0]
    return Piece(h, rate, top, remaining)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_piece_end(top, motion, modal_system, table, memory, time_state, run_sums, workspace):
    """Find the first event of a piece, including the end of the travel of the output.

    Parameters
    ----------
    top : int
        Highest power of the series.
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    time_state : TimeState
    run_sums : RunSums
    workspace : Workspace

    Returns
    -------
    NextEvent
    """
    event = find_next_event(top, modal_system, table, memory, time_state, workspace)
    travel = run_sums.limits[LIMIT.travel]
    if travel < 1e300 and event.u > 0:
        root = find_travel_crossing(top, modal_system, motion, workspace, travel, event.u)
        if root <= event.u:
            return NextEvent(root, EVENT.travel, event.interface, event.sign)
    return event


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
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
    offset = now[TIME.offset]
    return u == 1.0 or offset + u * piece.duration >= offset + piece.remaining


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def reset_forces(modal_system, table, memory):
    """Compute the forces of all interfaces from their memory, without accumulated round-off.

    Parameters
    ----------
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
        Its forces are written.
    """
    for f in range(len(modal_system.inverse_mass)):
        memory.force[f] = interface_force(f, table, memory)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cross_border(kind, remaining, stop, motion, modal_system, table, memory, previous, time_state):
    """Pass the end of a cycle or of a segment of the drive.

    Parameters
    ----------
    kind : int
        Kind of the event there.
    remaining : float
        Time to the border [s].
    stop : tuple
        Cycle and offset [s] at which the march stops.
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    modal_system : ModalSystem
    table : ElementTable
    memory : Memory
    previous : PreviousCycle
        State at the end of the cycle before.
    time_state : TimeState

    Returns
    -------
    drive_changes : bool
    repeats : bool
        Whether the motion repeats from here on.
    """
    drive_changes = step_to_border(time_state, stop, remaining)
    repeats = False
    if time_state.now[TIME.offset] == 0.0 and kind == EVENT.none:
        repeats = detect_repeat(motion, modal_system, memory, time_state, previous)
    elif time_state.now[TIME.offset] == 0.0:
        forget_previous(previous)
    # at every border, so that a run in parts gives the same result as a single run
    reset_forces(modal_system, table, memory)
    return drive_changes, repeats


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def clear_rests(u, time_state):
    """Clear the marks of interfaces that rested at a turning point, after a motion up to u."""
    if u > MIN_MOVING_FRACTION:
        time_state.is_at_turn[:] = 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def is_before(now, stop):
    """Return whether the time lies before `stop` (cycle, offset [s])."""
    if now[TIME.cycle] == stop[0]:
        return now[TIME.offset] < stop[1]
    return now[TIME.cycle] < stop[0]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def is_idle(progress, time_state, run_sums):
    """Count events without progress in time, and return whether there are too many.

    Parameters
    ----------
    progress : float
        Time from the event before [s].
    time_state : TimeState
    run_sums : RunSums

    Returns
    -------
    bool
        Whether there are too many in a row.
    """
    if progress < MIN_PROGRESS * time_state.period[0]:
        run_sums.limits[LIMIT.n_idle] += 1
    else:
        run_sums.limits[LIMIT.n_idle] = 0.0
    return run_sums.limits[LIMIT.n_idle] > MAX_IDLE_EVENTS


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
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


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_over_piece(
    piece,
    event,
    stop,
    motion,
    modal_system,
    table,
    memory,
    previous,
    time_state,
    run_sums,
    workspace,
):
    """Move motion, time and sums over a piece up to its event.

    Parameters
    ----------
    piece : Piece
    event : NextEvent
    stop, motion, modal_system, table, memory, previous, time_state, run_sums, workspace
        See `march`.

    Returns
    -------
    drive_changes : bool
        Whether the drive changes at the end of the piece.
    repeats : bool
        Whether the motion repeats from there on.
    """
    now = time_state.now
    h = piece.duration
    u = event.u
    drive_changes = False
    repeats = False
    add_piece_sums(piece.rate * h, u, h, piece.top, modal_system, time_state, run_sums, workspace)
    clear_rests(u, time_state)
    workspace.choice.orders[:] = 0.0
    move_state(
        u, h, piece.top, motion, modal_system, table, memory, time_state, run_sums, workspace
    )
    if reaches_border(piece, u, now):
        drive_changes, repeats = cross_border(
            event.kind,
            piece.remaining,
            stop,
            motion,
            modal_system,
            table,
            memory,
            previous,
            time_state,
        )
    else:
        now[TIME.offset] += u * h
    ledger = run_sums.ledger
    energy = stored_energy(motion, modal_system, table, memory)
    ledger[LEDGER.max_stored] = max(ledger[LEDGER.max_stored], energy)
    ledger[LEDGER.n_pieces] += 1
    return drive_changes, repeats


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march(
    stop, motion, modal_system, table, memory, previous, time_state, run_sums, workspace, rows
):
    """March from the present time to `stop` (cycle, offset [s]).

    Parameters
    ----------
    stop : tuple
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s]; they move along, as do memory, time_state and
        run_sums.
    modal_system, table, memory
    previous : PreviousCycle
        State at the end of the cycle before, for `repeat_kernels`.
    time_state, run_sums, workspace
    rows : ndarray
        (r, w) becomes one row per piece, see `RowColumns`; none is written where r = 0.

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
    choice = workspace.choice
    used = 0
    now = time_state.now
    repeats = False
    begin = max(now[TIME.begin], float(BEGIN.yielding))
    now[TIME.begin] = 0.0
    if choice.orders[0, 0] < 0.0 and not choose_initial_sticks(
        motion, modal_system, table, memory, time_state, workspace
    ):
        return STATUS.undetermined, used
    if now[TIME.is_paused] == 0.0:
        reset_forces(modal_system, table, memory)
    now[TIME.is_paused] = 0.0
    while is_before(now, stop):
        if used == rows.shape[0] and used > 0:
            # the forces continue unchanged
            now[TIME.begin] = begin
            now[TIME.is_paused] = 1.0
            return STATUS.full, used
        segment = time_state.segments[int(now[TIME.segment])]
        phase = drive_phase(segment, now[TIME.cycle], now[TIME.offset], time_state.period[0])
        remaining = time_to_border(time_state, stop)
        piece = start_piece(remaining, motion, modal_system, table, memory, time_state, workspace)
        event = find_piece_end(
            piece.top, motion, modal_system, table, memory, time_state, run_sums, workspace
        )
        changes_stick = False
        if event.kind == EVENT.reversal or event.kind == EVENT.release:
            changes_stick = table.static_limit[event.interface] > 0.0
        drive_changes = False
        if changes_stick or piece.duration == remaining:
            find_resting_interfaces(
                event.u, piece.duration, piece.top, modal_system, table, memory, workspace
            )
        if event.u > 0:
            if now[TIME.offset] == 0.0:
                widen_extremes(output_displacement(motion, modal_system), time_state, run_sums)
            if rows.shape[0] > 0:
                duration = event.u * piece.duration
                write_row(
                    rows[used],
                    motion,
                    duration,
                    phase,
                    begin,
                    modal_system,
                    table,
                    memory,
                    time_state,
                )
                used += 1
            drive_changes, repeats = move_over_piece(
                piece,
                event,
                stop,
                motion,
                modal_system,
                table,
                memory,
                previous,
                time_state,
                run_sums,
                workspace,
            )
        if is_idle(event.u * piece.duration, time_state, run_sums):
            return STATUS.idle, used
        begin = next_begin(event.kind, changes_stick, drive_changes)
        apply_event(event, modal_system, table, memory, time_state)
        if changes_stick:
            choice.is_resting[event.interface] = 1.0
            choice.slip_signs[event.interface] = event.sign if event.kind == EVENT.release else 0.0
        if (changes_stick or drive_changes) and not choose_current_sticks(
            motion, modal_system, table, memory, time_state, workspace
        ):
            return STATUS.undetermined, used
        if event.kind == EVENT.travel:
            now[TIME.begin] = 0.0
            return STATUS.travel, used
        if repeats:
            now[TIME.begin] = begin
            return STATUS.repeats, used
    now[TIME.begin] = begin
    return STATUS.done, used
