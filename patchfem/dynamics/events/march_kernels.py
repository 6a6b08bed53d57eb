"""March from event to event of modes behind rigid and elastic-plastic elements (compiled).

The loop `march` does five things for every piece: it chooses the length of the piece, expands the
motion, searches for the first event, moves the state to it, and changes the elements as the event
asks. An event is a yield, the release of an interface that a rigid element holds, a turning point
of an interface or of the output (`search_kernels`), or a border of the drive.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import drive_phase, drive_value, expand_drive, fastest_drive_rate
from .memory_kernels import (
    find_force_and_energy,
    find_tangent,
    interface_force,
    is_held,
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
from .search_kernels import displacement_at, expand_speed, find_crossing, find_next_event
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
from .slow_kernels import find_slow_rate, shorten_series
from .stick_kernels import MAX_ORDER, choose_sticks, correct_held_slides, find_resting_slides
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
# [fraction of a cycle] progress below which an event counts as idle
MIN_PROGRESS = 1e-13


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
    """Move the time to the border that is `remaining` [s] away.

    Returns whether the drive changes there.

    The drive changes from one sine to another, or by a jump.
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
    if drive_changes:
        now[TIME.n_quiet] = 0.0
    return drive_changes


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def write_row(row, motion, duration, theta, begin, modal_system, table, memory, time_state):
    """Write the row of a piece as it begins.

    Parameters
    ----------
    row : ndarray
        (w,) see `RowColumns` and `InterfaceColumns`.
    motion, modal_system, table, memory, time_state
    duration : float
        [s].
    theta : float
        Phase of the drive [rad].
    begin : float
        A number of `RowBegins`.
    """
    n = len(modal_system.omega_squared)
    now = time_state.now
    row[ROW.time] = now[TIME.cycle] * time_state.period[0] + now[TIME.offset]
    row[ROW.duration] = duration
    row[ROW.phase] = theta
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
    """Move coordinates, interfaces and elements to u, and add their energies."""
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    coefs = workspace.coefficients
    ledger = run_sums.ledger
    for f in range(n_interfaces):
        if is_held(f, table, memory):
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
        if is_held(f, table, memory):
            continue
        place = 0.0
        for i in range(n):
            place += modal_system.interfaces[f, i] * motion[0, i]
        memory.slide[f] = place
    correct_held_slides(motion, modal_system, memory, workspace)
    widen_extremes(out, time_state, run_sums)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def widen_extremes(out, time_state, run_sums):
    """Widen the extremes of the present cycle by an output [m]."""
    cycle = int(time_state.now[TIME.cycle])
    run_sums.extremes[cycle, 0] = min(run_sums.extremes[cycle, 0], out)
    run_sums.extremes[cycle, 1] = max(run_sums.extremes[cycle, 1], out)


@njit(
    error_model="numpy", cache=True, forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT
)
def stored_energy(motion, modal_system, table, memory):
    """Return the energy [J] of the modes and of the elements."""
    out = 0.0
    for i in range(len(modal_system.omega_squared)):
        out += motion[1, i] ** 2 + modal_system.omega_squared[i] * motion[0, i] ** 2
    out *= 0.5 * modal_system.mass
    for f in range(len(modal_system.inverse_mass)):
        out += find_force_and_energy(f, table, memory)[1]
    return out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def choose_sticks_here(motion, modal_system, table, memory, time_state, workspace):
    """Choose which interfaces stick from here on; returns whether a choice was found.

    workspace.choice holds the guess and which interfaces are at rest.
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
    """Choose which interfaces stick at the start of a run; returns whether a choice was found.

    The guess is that a rigid element sticks where its interface is at rest.
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
    return choose_sticks_here(motion, modal_system, table, memory, time_state, workspace)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def estimate_time_to_yield(motion, modal_system, table, memory):
    """Estimate the time [s] to the next yield from the present speeds."""
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
def apply_event(kind, interface, sign, modal_system, table, memory, time_state):
    """Apply an event to the elements, and record which interfaces are at rest."""
    if kind != EVENT.none and kind != EVENT.output_reversal:
        time_state.now[TIME.n_quiet] = 0.0
    if kind == EVENT.yielding:
        release_next_element(interface, sign, table, memory)
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
def expand_piece(h, rate, slow_rate, motion, force, modal_system, time_state, workspace):
    """Expand the motion over a piece of h [s]; returns the highest power.

    rate: fastest rate [1/s]; slow_rate: as of `find_slow_rate`, whose series is in the workspace
    where it is not 0.
    """
    top = find_highest_power(rate * h)
    now = time_state.now
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    if slow_rate > 0.0:
        shorten_series(
            slow_rate * h / MAX_RATE_TIME, top, len(modal_system.inverse_mass), workspace
        )
    else:
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
    """Return u at which the output passes +-travel [m]; NO_ROOT if it does not.

    The output is monotone up to u.
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
    """Return the duration [s] of the next piece, at most `remaining`; rate: fastest rate [1/s].

    It ends just after the next yield that the present speeds predict, but is at least MIN_FRACTION of
    the longest piece.
    """
    to_yield = rate * estimate_time_to_yield(motion, modal_system, table, memory)
    return min(MAX_RATE_TIME / rate * min(1.0, max(to_yield, MIN_FRACTION)), remaining)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def start_piece(remaining, motion, modal_system, table, memory, time_state, workspace):
    """Choose the length of the next piece and expand the motion over it.

    Returns
    -------
    h : float
        Duration [s], at most `remaining`.
    rate : float
        Fastest rate [1/s] by which it was chosen.
    top : int
        Highest power of the series.
    """
    n_interfaces = len(modal_system.inverse_mass)
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    for f in range(n_interfaces):
        workspace.stiffness[f] = find_tangent(f, table, memory).stiffness
    modal_rate = bound_modal_rate(modal_system, workspace)
    slow_rate = 0.0
    if modal_rate > 0.0:
        slow_rate = find_slow_rate(motion, memory.force, modal_system, time_state, workspace)
    rate = slow_rate
    if slow_rate == 0.0:
        rate = max(modal_rate, fastest_drive_rate(segment, time_state.period[0]))
    h = choose_length(rate, remaining, motion, modal_system, table, memory)
    top = expand_piece(
        h, rate, slow_rate, motion, memory.force, modal_system, time_state, workspace
    )
    for f in range(n_interfaces):
        if is_held(f, table, memory):
            memory.force[f] = workspace.constraint.reactions[f, 0]
    return h, rate, top


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def cross_border(kind, remaining, stop, motion, modal_system, table, memory, previous, time_state):
    """Pass the end of a cycle or of a segment.

    Returns whether the drive changes, and whether the motion repeats.
    """
    drive_changes = step_to_border(time_state, stop, remaining)
    repeats = False
    if time_state.now[TIME.offset] == 0.0 and kind == EVENT.none:
        repeats = detect_repeat(motion, modal_system, memory, time_state, previous)
    elif time_state.now[TIME.offset] == 0.0:
        forget_previous(previous)
    for f in range(
        len(modal_system.inverse_mass)
    ):  # cleared at every border, so that a run in parts gives the same result as a single run
        memory.force[f] = interface_force(f, table, memory)
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
    """Count the events without progress [s] in time.

    Returns whether there are too many in a row.
    """
    if progress < MIN_PROGRESS * time_state.period[0]:
        run_sums.limits[LIMIT.n_idle] += 1
    else:
        run_sums.limits[LIMIT.n_idle] = 0.0
    return run_sums.limits[LIMIT.n_idle] > MAX_IDLE_EVENTS


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def next_begin(kind, changes_stick, drive_changes):
    """Return what begins the next row, a number of `RowBegins`, after an event of some kind."""
    if changes_stick:
        return float(BEGIN.stick_or_slip)
    if drive_changes:
        return float(BEGIN.drive_border)
    if kind == EVENT.yielding:
        return float(BEGIN.yielding)
    if kind == EVENT.reversal or kind == EVENT.output_reversal:
        return float(BEGIN.reversal)
    return float(BEGIN.none)


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
    n_interfaces = len(modal_system.inverse_mass)
    begin = max(now[TIME.begin], float(BEGIN.yielding))
    now[TIME.begin] = 0.0
    if choice.orders[0, 0] < 0.0 and not choose_initial_sticks(
        motion, modal_system, table, memory, time_state, workspace
    ):
        return STATUS.undetermined, used
    if now[TIME.is_paused] == 0.0:
        for f in range(n_interfaces):
            memory.force[f] = interface_force(f, table, memory)
    now[TIME.is_paused] = 0.0
    while is_before(now, stop):
        if used == rows.shape[0] and used > 0:
            # the forces continue unchanged
            now[TIME.begin] = begin
            now[TIME.is_paused] = 1.0
            return STATUS.full, used
        remaining = time_to_border(time_state, stop)
        segment = time_state.segments[int(now[TIME.segment])]
        theta = drive_phase(segment, now[TIME.cycle], now[TIME.offset], time_state.period[0])
        h, rate, top = start_piece(
            remaining, motion, modal_system, table, memory, time_state, workspace
        )
        is_to_border = h == remaining
        u, kind, interface, sign = find_next_event(
            top, modal_system, table, memory, time_state, workspace
        )
        if run_sums.limits[LIMIT.travel] < 1e300 and u > 0:
            travel = run_sums.limits[LIMIT.travel]
            root = find_travel_crossing(top, modal_system, motion, workspace, travel, u)
            if root <= u:
                u = root
                kind = EVENT.travel
        changes_stick = False
        if kind == EVENT.reversal or kind == EVENT.release:
            changes_stick = table.static_limit[interface] > 0.0
        drive_changes = False
        if changes_stick or is_to_border:
            find_resting_slides(u, h, top, modal_system, table, memory, workspace)
        if u > 0:
            if now[TIME.offset] == 0.0:
                widen_extremes(output_displacement(motion, modal_system), time_state, run_sums)
            if rows.shape[0] > 0:
                write_row(
                    rows[used], motion, u * h, theta, begin, modal_system, table, memory, time_state
                )
                used += 1
            add_piece_sums(rate * h, u, h, top, modal_system, time_state, run_sums, workspace)
            clear_rests(u, time_state)
            choice.orders[:] = 0.0
            move_state(
                u, h, top, motion, modal_system, table, memory, time_state, run_sums, workspace
            )
            # an event within round-off of the border
            if is_to_border and (
                u == 1.0 or now[TIME.offset] + u * h >= now[TIME.offset] + remaining
            ):
                drive_changes, repeats = cross_border(
                    kind, remaining, stop, motion, modal_system, table, memory, previous, time_state
                )
            else:
                now[TIME.offset] += u * h
            run_sums.ledger[LEDGER.max_stored] = max(
                run_sums.ledger[LEDGER.max_stored],
                stored_energy(motion, modal_system, table, memory),
            )
            run_sums.ledger[LEDGER.n_pieces] += 1
        if is_idle(u * h, time_state, run_sums):
            return STATUS.idle, used
        begin = next_begin(kind, changes_stick, drive_changes)
        apply_event(kind, interface, sign, modal_system, table, memory, time_state)
        if changes_stick:
            choice.is_resting[interface] = 1.0
            choice.slip_signs[interface] = sign if kind == EVENT.release else 0.0
        if (changes_stick or drive_changes) and not choose_sticks_here(
            motion, modal_system, table, memory, time_state, workspace
        ):
            return STATUS.undetermined, used
        if kind == EVENT.travel:
            now[TIME.begin] = 0.0
            return STATUS.travel, used
        if repeats:
            now[TIME.begin] = begin
            return STATUS.repeats, used
    now[TIME.begin] = begin
    return STATUS.done, used
