"""Measures of the last cycles of a run, from its pieces (compiled).

Every measure is an integral or an extremum of the series of the pieces; nothing is sampled.
"""

from math import cos, inf, nan, pi, sin, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .dense_kernels import expand_row
from .memory_kernels import RIGID_STIFFNESS
from .positions_kernels import COLUMN, CONSTRAINT, INTERFACE, N_COLUMNS, ROW, RUN, SEGMENT
from .search_kernels import displacement_at
from .series_kernels import (
    GAUSS_POINTS,
    GAUSS_WEIGHTS,
    bound_modal_rate,
    count_gauss_points,
    evaluate_polynomial,
    find_largest_magnitude,
)

# fraction of the friction limit; where more of it slips, the interface slips
SLIP_FRACTION = 0.5
# fraction of a cycle; a shorter slip is not counted, because it is round-off of a stop
MIN_SLIP_DURATION = 1e-9
# fraction of the largest rate of an interface, below which it is at rest
REST_RATE_RATIO = 1e-9
# fraction of the range of an interface, below which its motion in a piece counts as rest
MIN_MOTION_RATIO = 1e-13
# fraction of a cycle after its border within which a reversal still counts as at the border
MAX_TURN_DELAY = 0.003


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def force_column(interface, modal_system):
    """Return the first column of an interface in a row."""
    return ROW.motion + 2 * len(modal_system.omega_squared) + N_COLUMNS * interface


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def read_slide(row, interface, modal_system):
    """Return the relative displacement [m] of an interface where a row begins.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `RowColumns`.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    return row[force_column(interface, modal_system) + COLUMN.slide]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def read_rate(row, interface, modal_system):
    """Return the relative velocity [m/s] of an interface where a row begins.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `RowColumns`.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    n = len(modal_system.omega_squared)
    rate = 0.0
    for i in range(n):
        rate += modal_system.interfaces[interface, i] * row[ROW.motion + n + i]
    return rate


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_end_force(rows, j, interface, modal_system):
    """Return the force [N] of a free interface at the end of row j.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    j : int
        Number of the row.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    at = force_column(interface, modal_system)
    step = read_slide(rows[j + 1], interface, modal_system) - read_slide(
        rows[j], interface, modal_system
    )
    return rows[j, at + COLUMN.force] + rows[j, at + COLUMN.stiffness] * step


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_peak_acceleration(top, h, modal_system, base_moves, workspace, largest):
    """Return the larger of a bound and the peak acceleration of the output in a piece [m s-2].

    The series of the acceleration is left in the last but one of workspace.polynomials.

    Parameters
    ----------
    top : int
        Highest power of the series.
    h : float
        Duration of the piece [s].
    modal_system : ModalSystem
    base_moves : float
        1 where the base moves, else 0.
    workspace : Workspace
    largest : float
        A lower bound of the result [m s-2].

    Returns
    -------
    float
    """
    poly = workspace.polynomials[len(modal_system.inverse_mass) + 1]
    bound = 0.0
    for k in range(top - 1):
        part = 0.0
        for i in range(len(modal_system.omega_squared)):
            part += modal_system.output[i] * workspace.coefficients[k + 2, i]
        poly[k] = part * (k + 1) * (k + 2) / (h * h) + base_moves * workspace.drive[0, k]
        bound += abs(poly[k])
    return (
        largest
        if bound <= largest
        else find_largest_magnitude(poly, top - 2, largest, workspace.hulls)
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_integrals(
    row, h, top, border, modal_system, time_state, workspace, run_values, interface_values
):
    """Add the integrals over the piece in the workspace to the measures.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `RowColumns`.
    h : float
        Duration of the piece [s].
    top : int
        Highest power of the series.
    border : tuple of bool
        Whether the piece lies in the first cycle, and whether it lies in the last.
    modal_system : ModalSystem
    time_state : TimeState
    workspace : Workspace
    run_values : ndarray
        (13,) see `RunMeasures`; they are written.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasures`; they are written.
    """
    n_interfaces = len(modal_system.inverse_mass)
    omega = 2 * pi / time_state.period[0]
    modal_rate = bound_modal_rate(modal_system, workspace)
    count = count_gauss_points(
        0.5
        * h
        * (max(modal_rate, time_state.segments[int(row[ROW.segment]), SEGMENT.rate]) + 3 * omega)
    )
    acceleration = workspace.polynomials[n_interfaces + 1]
    for g in range(count):
        u = GAUSS_POINTS[count, g]
        w = h * GAUSS_WEIGHTS[count, g]
        angle = omega * (row[ROW.offset] + h * u)
        cosine = cos(angle)
        sine = sin(angle)
        gain = w * evaluate_polynomial(acceleration, 0, top - 2, u)
        run_values[RUN.cos_1] += gain * cosine
        run_values[RUN.sin_1] += gain * sine
        run_values[RUN.cos_3] += gain * cosine * (4 * cosine * cosine - 3)
        run_values[RUN.sin_3] += gain * sine * (3 - 4 * sine * sine)
        for f in range(n_interfaces):
            at = force_column(f, modal_system)
            values = interface_values[f]
            slide = w * read_slide(row, f, modal_system)
            force = 0.0
            if workspace.stiffness[f] == RIGID_STIFFNESS:
                force = w * evaluate_polynomial(workspace.constraint.reactions[f], 0, top - 2, u)
            else:
                step = displacement_at(workspace.polynomials[f], top, u)
                slide = slide + w * step
                force = w * (row[at + COLUMN.force] + row[at + COLUMN.stiffness] * step)
                values[INTERFACE.path_work] += (
                    abs(force * evaluate_polynomial(workspace.polynomials[f], 0, top - 1, u)) / h
                )
            values[INTERFACE.slide_cos] += slide * cosine
            values[INTERFACE.slide_sin] += slide * sine
            values[INTERFACE.force_cos] += force * cosine
            values[INTERFACE.force_sin] += force * sine
            if border[0]:
                values[INTERFACE.first_slide] += slide
                values[INTERFACE.first_force] += force
            if border[1]:
                values[INTERFACE.last_slide] += slide
                values[INTERFACE.last_force] += force


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_row_state(row, modal_system, run_values, interface_values):
    """Include the state at the start of a row in the ranges of the measures.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `RowColumns`.
    modal_system : ModalSystem
    run_values : ndarray
        (13,) see `RunMeasures`; they are written.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasures`; they are written.
    """
    output = 0.0
    for i in range(len(modal_system.omega_squared)):
        output += modal_system.output[i] * row[ROW.motion + i]
        run_values[RUN.max_coordinate] = max(
            run_values[RUN.max_coordinate], abs(row[ROW.motion + i])
        )
    run_values[RUN.min_output] = min(run_values[RUN.min_output], output)
    run_values[RUN.max_output] = max(run_values[RUN.max_output], output)
    for f in range(len(modal_system.inverse_mass)):
        values = interface_values[f]
        at = force_column(f, modal_system)
        slide = read_slide(row, f, modal_system)
        values[INTERFACE.min_slide] = min(values[INTERFACE.min_slide], slide)
        values[INTERFACE.max_slide] = max(values[INTERFACE.max_slide], slide)
        values[INTERFACE.min_slip] = min(values[INTERFACE.min_slip], row[at + COLUMN.slip])
        values[INTERFACE.max_slip] = max(values[INTERFACE.max_slip], row[at + COLUMN.slip])


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def add_forces(rows, j, top, modal_system, workspace, interface_values):
    """Update the largest forces with the piece of a row, and add its work by the trapezoidal rule.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    j : int
        Number of the row.
    top : int
        Highest power of the series.
    modal_system : ModalSystem
    workspace : Workspace
    interface_values : ndarray
        (i, 21) see `InterfaceMeasures`; they are written.
    """
    for f in range(len(modal_system.inverse_mass)):
        values = interface_values[f]
        at = force_column(f, modal_system)
        if rows[j, at + COLUMN.slipping] < SLIP_FRACTION:
            values[INTERFACE.stuck_time] += rows[j, ROW.duration]
        if workspace.stiffness[f] == RIGID_STIFFNESS:
            values[INTERFACE.max_force] = find_largest_magnitude(
                workspace.constraint.reactions[f],
                top - 2,
                values[INTERFACE.max_force],
                workspace.hulls,
            )
            continue
        force = rows[j, at + COLUMN.force]
        last = find_end_force(rows, j, f, modal_system)
        values[INTERFACE.max_force] = max(values[INTERFACE.max_force], abs(force), abs(last))
        values[INTERFACE.end_work] += (
            0.5
            * (force + last)
            * (read_slide(rows[j + 1], f, modal_system) - read_slide(rows[j], f, modal_system))
        )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_turning_force(rows, j, n_rows, interface, modal_system, min_motion):
    """Return the force of an interface at a reversal where a row begins [N].

    It is the mean of the forces before and after the rest there.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    j : int
        Number of the row.
    n_rows : int
        Number of rows but the last one.
    interface : int
    modal_system : ModalSystem
    min_motion : float
        A piece in which the interface moves less [m] is a rest.

    Returns
    -------
    float
        NaN where the force jumps and one of both is unknown.
    """
    back = j - 1
    on = j
    while (
        back >= 0
        and abs(
            read_slide(rows[back + 1], interface, modal_system)
            - read_slide(rows[back], interface, modal_system)
        )
        <= min_motion
    ):
        back -= 1
    while (
        on < n_rows
        and abs(
            read_slide(rows[on + 1], interface, modal_system)
            - read_slide(rows[on], interface, modal_system)
        )
        <= min_motion
    ):
        on += 1
    at = force_column(interface, modal_system)
    if back >= 0 and on < n_rows:
        return 0.5 * (
            find_end_force(rows, back, interface, modal_system) + rows[on, at + COLUMN.force]
        )
    near = j
    if on < n_rows:
        near = on
    elif back >= 0:
        near = back
    here = rows[near, at + COLUMN.stiffness]
    if here == 0.0 or here == RIGID_STIFFNESS or (back < 0 and on == n_rows):
        return nan
    if on < n_rows:
        return rows[on, at + COLUMN.force]
    return find_end_force(rows, back, interface, modal_system)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_turn_near_border(rows, j, n_rows, forward, interface, modal_system, period, rest_rate):
    """Return the row near a border of a cycle at which an interface reverses.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    j : int
        Number of the row at the border.
    n_rows : int
        Number of rows but the last one.
    forward : bool
        Whether the rows after it are examined, else those before.
    interface : int
    modal_system : ModalSystem
    period : float
        Duration of a cycle [s].
    rest_rate : float
        Relative velocity below which the interface is at rest [m/s].

    Returns
    -------
    int
        -1 if there is none.
    """
    k = j
    while (
        0 <= k <= n_rows and abs(rows[k, ROW.time] - rows[j, ROW.time]) <= MAX_TURN_DELAY * period
    ):
        if abs(read_rate(rows[k], interface, modal_system)) <= rest_rate:
            return k
        k += 1 if forward else -1
    return -1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def measure_cycles(rows, n_rows, cycles, interface, modal_system, period, values):
    """Measure the mean range [m] and secant stiffness [N/m] of the cycles of an interface.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    n_rows : int
        Number of rows but the last one.
    cycles : int
        Number of cycles.
    interface : int
    modal_system : ModalSystem
    period : float
        Duration of a cycle [s].
    values : ndarray
        (21,) see `InterfaceMeasures`; they are written.
    """
    fast = 0.0
    n_secants = 0
    low = 0
    begun = rows[0, ROW.time]
    for j in range(n_rows + 1):
        fast = max(fast, abs(read_rate(rows[j], interface, modal_system)))
    min_motion = MIN_MOTION_RATIO * (values[INTERFACE.max_slide] - values[INTERFACE.min_slide])
    for k in range(cycles):
        top = low
        bottom = low
        high = low
        while (
            high < n_rows
            and rows[high, ROW.time] + 0.5 * rows[high, ROW.duration] < begun + (k + 1) * period
        ):
            high += 1
            slide = read_slide(rows[high], interface, modal_system)
            top = high if slide > read_slide(rows[top], interface, modal_system) else top
            bottom = high if slide < read_slide(rows[bottom], interface, modal_system) else bottom
        size = read_slide(rows[top], interface, modal_system) - read_slide(
            rows[bottom], interface, modal_system
        )
        values[INTERFACE.mean_range] += size / cycles
        if top == low or top == high:
            top = find_turn_near_border(
                rows,
                top,
                n_rows,
                top == high,
                interface,
                modal_system,
                period,
                REST_RATE_RATIO * fast,
            )
        if bottom == low or bottom == high:
            bottom = find_turn_near_border(
                rows,
                bottom,
                n_rows,
                bottom == high,
                interface,
                modal_system,
                period,
                REST_RATE_RATIO * fast,
            )
        if size > 0.0 and top >= 0 and bottom >= 0:
            secant = (
                find_turning_force(rows, top, n_rows, interface, modal_system, min_motion)
                - find_turning_force(rows, bottom, n_rows, interface, modal_system, min_motion)
            ) / size
            if secant == secant:
                n_secants += 1
                values[INTERFACE.secant] += secant
        low = high
    values[INTERFACE.secant] = values[INTERFACE.secant] / n_secants if n_secants > 0 else nan


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def measure_ringing(rows, first, last, modal_system, segment, values):
    """Measure the free vibration in a stick of a single mode.

    The measures are the angle by which the vibration turns, and its largest acceleration by the
    rule of `response.ringing`.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    first : int
        First row of the stick.
    last : int
        First row after it.
    modal_system : ModalSystem
    segment : ndarray
        (12,) segment of the drive, see `SegmentColumns`.
    values : ndarray
        (13,) see `RunMeasures`; they are written.
    """
    swing = 0.0
    row = rows[first]
    damp = modal_system.damping[0, 0]
    spring = force_column(0, modal_system) + COLUMN.stiffness
    for j in range(first, last):
        swing += (
            sqrt(
                max(
                    modal_system.omega_squared[0]
                    + rows[j, spring] * modal_system.inverse_mass[0]
                    - 0.25 * damp * damp,
                    0.0,
                )
            )
            * rows[j, ROW.duration]
        )
    values[RUN.ring_angle] = max(values[RUN.ring_angle], swing)
    beta = modal_system.omega_squared[0] + row[spring] * modal_system.inverse_mass[0]
    omega = segment[SEGMENT.omega]
    modal_rate = beta - 0.25 * damp * damp
    far = beta - omega * omega
    side = damp * omega
    bound = far * far + side * side
    if modal_rate <= 0.0 or bound <= 1e-18 * beta * beta:
        return
    modal_rate = sqrt(modal_rate)
    push = modal_system.base[0] * segment[SEGMENT.amplitude]
    force = modal_system.interfaces[0, 0] * row[spring - 1] / modal_system.mass
    sine = -push * sin(row[ROW.phase])
    cosine = -push * cos(row[ROW.phase])
    rest = (
        -modal_system.base[0] * segment[SEGMENT.constant]
        - modal_system.omega_squared[0] * row[ROW.motion]
        - force
    )
    z = -rest / beta - (far * sine - side * cosine) / bound
    v = row[ROW.motion + 1] - omega * (far * cosine + side * sine) / bound
    other = (v + 0.5 * damp * z) / modal_rate
    ratio = modal_rate / omega
    span = rows[last, ROW.time] - row[ROW.time]
    damping = 0.5 * damp / sqrt(beta)
    forced = span * omega > 3 * pi and damping < 1e-3 and abs(ratio - round(ratio)) < 1e-2
    if span * modal_rate >= 3 * pi and damping < 0.5 and not forced:
        values[RUN.ring] = max(
            values[RUN.ring], abs(modal_system.output[0]) * beta * sqrt(z * z + other * other)
        )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def measure_sticks_and_releases(rows, n_rows, modal_system, time_state, values):
    """Count the releases of the first interface, and measure the vibration in its sticks.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `RowColumns`.
    n_rows : int
        Number of rows but the last one.
    modal_system : ModalSystem
    time_state : TimeState
    values : ndarray
        (13,) see `RunMeasures`; they are written.
    """
    begun = rows[0, ROW.time]
    period = time_state.period[0]
    at = force_column(0, modal_system)
    is_single = len(modal_system.omega_squared) == 1 and len(modal_system.inverse_mass) == 1
    waits = False
    phase = 0.0
    begun_at = begun
    segment = time_state.segments[int(rows[0, ROW.segment])]
    last = rows[0, at + COLUMN.direction] if rows[0, at + COLUMN.slipping] >= SLIP_FRACTION else 0.0
    held = 0 if last == 0.0 else -1
    for j in range(n_rows + 1):
        direction = last
        if j < n_rows:
            slips = rows[j, at + COLUMN.slipping] >= SLIP_FRACTION
            direction = rows[j, at + COLUMN.direction] if slips else 0.0
            if direction == last:
                continue
        if waits and (j == n_rows or rows[j, ROW.time] - begun_at > MIN_SLIP_DURATION * period):
            values[RUN.n_releases] += 1.0
            values[RUN.release_cos] += cos(2 * phase)
            values[RUN.release_sin] += sin(2 * phase)
        waits = last == 0.0 and direction != 0.0 and rows[j, ROW.time] > begun
        phase = rows[j, ROW.phase]
        begun_at = rows[j, ROW.time]
        if held >= 0 and (direction != 0.0 or j == n_rows):
            if is_single and rows[held, at + COLUMN.stiffness] < RIGID_STIFFNESS:
                measure_ringing(rows, held, j, modal_system, segment, values)
            held = -1
        elif direction == 0.0 and held < 0:
            held = j
        last = direction


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def read_rows(
    rows, cycles, modal_system, time_state, base_moves, workspace, run_values, interface_values
):
    """Measure the last cycles of a run.

    Parameters
    ----------
    rows : ndarray
        (k + 1, w) as `march_kernels.march` writes them, and one without duration for the end.
    cycles : int
        Whole cycles among them; each ends with a piece.
    modal_system, time_state, workspace
    base_moves : float
        1 where the acceleration of the base counts, else 0.
    run_values : ndarray
        (13,) see `RunMeasures`.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasures`.

    Notes
    -----
    Cost: 1 us per piece of one mode.
    """
    n_interfaces = len(modal_system.inverse_mass)
    n_rows = rows.shape[0] - 1
    period = time_state.period[0]
    run_values[:] = 0.0
    interface_values[:] = 0.0
    workspace.constraint.status[CONSTRAINT.n_sticking] = -1.0
    run_values[RUN.min_output] = inf
    run_values[RUN.max_output] = -inf
    for f in range(n_interfaces):
        values = interface_values[f]
        at = force_column(f, modal_system)
        values[INTERFACE.min_slide] = inf
        values[INTERFACE.max_slide] = -inf
        values[INTERFACE.min_slip] = inf
        values[INTERFACE.max_slip] = -inf
        values[INTERFACE.start_slide] = read_slide(rows[0], f, modal_system)
        values[INTERFACE.end_slide] = read_slide(rows[n_rows], f, modal_system)
        values[INTERFACE.work] = rows[n_rows, at + COLUMN.work] - rows[0, at + COLUMN.work]
    for j in range(n_rows + 1):
        add_row_state(rows[j], modal_system, run_values, interface_values)
        h = rows[j, ROW.duration]
        if j == n_rows or h <= 0.0:
            continue
        top = expand_row(rows[j], h, modal_system, time_state, workspace)
        run_values[RUN.max_acceleration] = find_peak_acceleration(
            top, h, modal_system, base_moves, workspace, run_values[RUN.max_acceleration]
        )
        add_forces(rows, j, top, modal_system, workspace, interface_values)
        middle = rows[j, ROW.time] + 0.5 * h
        border = middle < rows[0, ROW.time] + period, middle > rows[n_rows, ROW.time] - period
        add_integrals(
            rows[j],
            h,
            top,
            border,
            modal_system,
            time_state,
            workspace,
            run_values,
            interface_values,
        )
    for f in range(n_interfaces):
        measure_cycles(rows, n_rows, cycles, f, modal_system, period, interface_values[f])
    measure_sticks_and_releases(rows, n_rows, modal_system, time_state, run_values)
