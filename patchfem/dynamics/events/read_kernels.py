"""Measures of the last cycles of a run from its recorded time intervals (compiled).

Every measure is an integral or an extremum of the series of the pieces; nothing is sampled.
"""

from math import cos, inf, nan, pi, sin, sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .dense_kernels import expand_row
from .memory_kernels import RIGID_STIFFNESS
from .positions_kernels import (
    N_COLUMNS,
    Column,
    ConstraintStatus,
    InterfaceMeasure,
    Row,
    RunMeasure,
    Segment,
)
from .search_kernels import integrate_speed
from .series_kernels import (
    GAUSS_POINTS,
    GAUSS_WEIGHTS,
    bound_modal_rate,
    count_gauss_points,
    evaluate_polynomial,
    find_largest_magnitude,
)

# Smallest slipping fraction of the friction limit at which an interface counts as slipping.
SLIP_FRACTION = 0.5
# Minimum duration of a slip, in cycles; a shorter slip is due to round-off at a stop.
MIN_SLIP_DURATION = 1e-9
# Largest relative velocity of an interface at rest, relative to its maximum.
REST_RATE_RATIO = 1e-9
# Largest displacement in a time interval of an interface at rest, relative to its range.
MIN_MOTION_RATIO = 1e-13
# Maximum time between a reversal and the end of a cycle, in cycles, for which the
# reversal is assigned to that end.
MAX_REVERSAL_DELAY = 0.003


@njit(**NJIT_INLINE)
def interface_column(interface, modal_system):
    """Return the index of the first column of an interface in a row."""
    return Row.MOTION + 2 * len(modal_system.omega_squared) + N_COLUMNS * interface


@njit(**NJIT_INLINE)
def read_slide(row, interface, modal_system):
    """Return the relative displacement [m] of an interface at the start of a time interval.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `Row`.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    return row[interface_column(interface, modal_system) + Column.SLIDE]


@njit(**NJIT_INLINE)
def read_rate(row, interface, modal_system):
    """Return the relative velocity [m/s] of an interface at the start of a time interval.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `Row`.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    n = len(modal_system.omega_squared)
    rate = 0.0
    for i in range(n):
        rate += modal_system.interfaces[interface, i] * row[Row.MOTION + n + i]
    return rate


@njit(**NJIT_INLINE)
def find_end_force(rows, j, interface, modal_system):
    """Return the friction force [N] of a non-sticking interface at the end of a time interval.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    j : int
        Number of the row.
    interface : int
    modal_system : ModalSystem

    Returns
    -------
    float
    """
    at = interface_column(interface, modal_system)
    step = read_slide(rows[j + 1], interface, modal_system) - read_slide(
        rows[j], interface, modal_system
    )
    return rows[j, at + Column.FORCE] + rows[j, at + Column.STIFFNESS] * step


@njit(**NJIT_INLINE)
def find_peak_acceleration(top, h, base_moves, largest, run):
    """Return the peak output acceleration of a time interval [m s-2], or a larger lower bound.

    The series of the acceleration is left in the last but one of workspace.polynomials.

    Parameters
    ----------
    top : int
        Highest power of the series.
    h : float
        Duration of the piece [s].
    base_moves : float
        1 if the base moves, else 0.
    largest : float
        A lower bound of the result [m s-2].
    run : RunArrays

    Returns
    -------
    float
    """
    modal_system = run.modal_system
    workspace = run.workspace
    poly = workspace.polynomials[len(modal_system.inverse_mass) + 1]
    bound = 0.0
    for k in range(top - 1):
        acceleration = 0.0
        for i in range(len(modal_system.omega_squared)):
            acceleration += modal_system.output[i] * workspace.coefficients[k + 2, i]
        poly[k] = acceleration * (k + 1) * (k + 2) / (h * h) + base_moves * workspace.drive[0, k]
        bound += abs(poly[k])
    if bound <= largest:
        return largest
    return find_largest_magnitude(poly, top - 2, largest, workspace.hulls)


@njit(**NJIT_INLINE)
def add_integrals(row, top, border, run, run_values, interface_values):
    """Add the harmonic and mean integrals of a time interval to the measures.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `Row`.
    top : int
        Highest power of the series.
    border : tuple of bool
        Whether the piece lies in the first cycle, and whether it lies in the last.
    run : RunArrays
    run_values : ndarray
        (13,) see `RunMeasure`; they are written.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasure`; they are written.
    """
    h = row[Row.DURATION]
    modal_system = run.modal_system
    time_state = run.time_state
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    omega = 2 * pi / time_state.period[0]
    modal_rate = bound_modal_rate(modal_system, workspace)
    count = count_gauss_points(
        0.5
        * h
        * (max(modal_rate, time_state.segments[int(row[Row.SEGMENT]), Segment.RATE]) + 3 * omega)
    )
    acceleration = workspace.polynomials[n_interfaces + 1]
    for g in range(count):
        u = GAUSS_POINTS[count, g]
        w = h * GAUSS_WEIGHTS[count, g]
        angle = omega * (row[Row.OFFSET] + h * u)
        cosine = cos(angle)
        sine = sin(angle)
        gain = w * evaluate_polynomial(acceleration, 0, top - 2, u)
        run_values[RunMeasure.COS_1] += gain * cosine
        run_values[RunMeasure.SIN_1] += gain * sine
        run_values[RunMeasure.COS_3] += gain * cosine * (4 * cosine * cosine - 3)
        run_values[RunMeasure.SIN_3] += gain * sine * (3 - 4 * sine * sine)
        for f in range(n_interfaces):
            at = interface_column(f, modal_system)
            values = interface_values[f]
            slide = w * read_slide(row, f, modal_system)
            force = 0.0
            if workspace.stiffness[f] == RIGID_STIFFNESS:
                force = w * evaluate_polynomial(workspace.constraint.reactions[f], 0, top - 2, u)
            else:
                step = integrate_speed(workspace.polynomials[f], top, u)
                slide = slide + w * step
                force = w * (row[at + Column.FORCE] + row[at + Column.STIFFNESS] * step)
                values[InterfaceMeasure.PATH_WORK] += (
                    abs(force * evaluate_polynomial(workspace.polynomials[f], 0, top - 1, u)) / h
                )
            values[InterfaceMeasure.SLIDE_COS] += slide * cosine
            values[InterfaceMeasure.SLIDE_SIN] += slide * sine
            values[InterfaceMeasure.FORCE_COS] += force * cosine
            values[InterfaceMeasure.FORCE_SIN] += force * sine
            if border[0]:
                values[InterfaceMeasure.FIRST_SLIDE] += slide
                values[InterfaceMeasure.FIRST_FORCE] += force
            if border[1]:
                values[InterfaceMeasure.LAST_SLIDE] += slide
                values[InterfaceMeasure.LAST_FORCE] += force


@njit(**NJIT_INLINE)
def add_row_state(row, modal_system, run_values, interface_values):
    """Include the state at the start of a time interval in the minima and maxima.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `Row`.
    modal_system : ModalSystem
    run_values : ndarray
        (13,) see `RunMeasure`; they are written.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasure`; they are written.
    """
    output = 0.0
    for i in range(len(modal_system.omega_squared)):
        output += modal_system.output[i] * row[Row.MOTION + i]
        run_values[RunMeasure.MAX_COORDINATE] = max(
            run_values[RunMeasure.MAX_COORDINATE], abs(row[Row.MOTION + i])
        )
    run_values[RunMeasure.MIN_OUTPUT] = min(run_values[RunMeasure.MIN_OUTPUT], output)
    run_values[RunMeasure.MAX_OUTPUT] = max(run_values[RunMeasure.MAX_OUTPUT], output)
    for f in range(len(modal_system.inverse_mass)):
        values = interface_values[f]
        at = interface_column(f, modal_system)
        slide = read_slide(row, f, modal_system)
        values[InterfaceMeasure.MIN_SLIDE] = min(values[InterfaceMeasure.MIN_SLIDE], slide)
        values[InterfaceMeasure.MAX_SLIDE] = max(values[InterfaceMeasure.MAX_SLIDE], slide)
        values[InterfaceMeasure.MIN_SLIP] = min(
            values[InterfaceMeasure.MIN_SLIP], row[at + Column.SLIP]
        )
        values[InterfaceMeasure.MAX_SLIP] = max(
            values[InterfaceMeasure.MAX_SLIP], row[at + Column.SLIP]
        )


@njit(**NJIT_INLINE)
def add_forces(rows, j, top, modal_system, workspace, interface_values):
    """Update maximum forces, stuck times and friction work with a time interval.

    The work is computed from the forces at its ends by the trapezoidal rule.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    j : int
        Number of the row.
    top : int
        Highest power of the series.
    modal_system : ModalSystem
    workspace : Workspace
    interface_values : ndarray
        (i, 21) see `InterfaceMeasure`; they are written.
    """
    for f in range(len(modal_system.inverse_mass)):
        values = interface_values[f]
        at = interface_column(f, modal_system)
        if rows[j, at + Column.SLIPPING] < SLIP_FRACTION:
            values[InterfaceMeasure.STUCK_TIME] += rows[j, Row.DURATION]
        if workspace.stiffness[f] == RIGID_STIFFNESS:
            values[InterfaceMeasure.MAX_FORCE] = find_largest_magnitude(
                workspace.constraint.reactions[f],
                top - 2,
                values[InterfaceMeasure.MAX_FORCE],
                workspace.hulls,
            )
            continue
        force = rows[j, at + Column.FORCE]
        last = find_end_force(rows, j, f, modal_system)
        values[InterfaceMeasure.MAX_FORCE] = max(
            values[InterfaceMeasure.MAX_FORCE], abs(force), abs(last)
        )
        values[InterfaceMeasure.END_WORK] += (
            0.5
            * (force + last)
            * (read_slide(rows[j + 1], f, modal_system) - read_slide(rows[j], f, modal_system))
        )


@njit(**NJIT_INLINE)
def find_reversal_force(rows, j, interface, modal_system, min_motion):
    """Return the friction force of an interface at a reversal [N].

    It is the mean of the forces before and after the rest there.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    j : int
        Number of the row.
    interface : int
    modal_system : ModalSystem
    min_motion : float
        A piece in which the interface moves less [m] is a rest.

    Returns
    -------
    float
        NaN if the force jumps and one of both is unknown.
    """
    n_rows = rows.shape[0] - 1
    row_before = j - 1
    row_after = j
    while (
        row_before >= 0
        and abs(
            read_slide(rows[row_before + 1], interface, modal_system)
            - read_slide(rows[row_before], interface, modal_system)
        )
        <= min_motion
    ):
        row_before -= 1
    while (
        row_after < n_rows
        and abs(
            read_slide(rows[row_after + 1], interface, modal_system)
            - read_slide(rows[row_after], interface, modal_system)
        )
        <= min_motion
    ):
        row_after += 1
    column = interface_column(interface, modal_system)
    if row_before >= 0 and row_after < n_rows:
        return 0.5 * (
            find_end_force(rows, row_before, interface, modal_system)
            + rows[row_after, column + Column.FORCE]
        )
    nearest_row = j
    if row_after < n_rows:
        nearest_row = row_after
    elif row_before >= 0:
        nearest_row = row_before
    stiffness = rows[nearest_row, column + Column.STIFFNESS]
    if stiffness == 0.0 or stiffness == RIGID_STIFFNESS or (row_before < 0 and row_after == n_rows):
        return nan
    if row_after < n_rows:
        return rows[row_after, column + Column.FORCE]
    return find_end_force(rows, row_before, interface, modal_system)


@njit(**NJIT_INLINE)
def find_reversal_near_cycle_end(rows, j, forward, interface, run, rest_rate):
    """Return the row of a reversal near the end of a cycle.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    j : int
        Number of the row at the border.
    forward : bool
        Whether the rows after it are examined, else those before.
    interface : int
    run : RunArrays
    rest_rate : float
        Relative velocity below which the interface is at rest [m/s].

    Returns
    -------
    int
        -1 if there is none.
    """
    k = j
    max_delay = MAX_REVERSAL_DELAY * run.time_state.period[0]
    while 0 <= k < rows.shape[0] and abs(rows[k, Row.TIME] - rows[j, Row.TIME]) <= max_delay:
        if abs(read_rate(rows[k], interface, run.modal_system)) <= rest_rate:
            return k
        k += 1 if forward else -1
    return -1


@njit(**NJIT_INLINE)
def measure_cycles(rows, cycles, interface, run, values):
    """Measure the mean range and the secant stiffness of an interface over the last cycles.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    cycles : int
        Number of cycles.
    interface : int
    run : RunArrays
    values : ndarray
        (21,) see `InterfaceMeasure`; they are written.
    """
    n_rows = rows.shape[0] - 1
    modal_system = run.modal_system
    max_rate = 0.0
    n_secants = 0
    first_row = 0
    start_time = rows[0, Row.TIME]
    for j in range(n_rows + 1):
        max_rate = max(max_rate, abs(read_rate(rows[j], interface, modal_system)))
    min_motion = MIN_MOTION_RATIO * (
        values[InterfaceMeasure.MAX_SLIDE] - values[InterfaceMeasure.MIN_SLIDE]
    )
    for k in range(cycles):
        max_row = first_row
        min_row = first_row
        last_row = first_row
        while (
            last_row < n_rows
            and rows[last_row, Row.TIME] + 0.5 * rows[last_row, Row.DURATION]
            < start_time + (k + 1) * run.time_state.period[0]
        ):
            last_row += 1
            slide = read_slide(rows[last_row], interface, modal_system)
            max_row = (
                last_row if slide > read_slide(rows[max_row], interface, modal_system) else max_row
            )
            min_row = (
                last_row if slide < read_slide(rows[min_row], interface, modal_system) else min_row
            )
        range_of_slide = read_slide(rows[max_row], interface, modal_system) - read_slide(
            rows[min_row], interface, modal_system
        )
        values[InterfaceMeasure.MEAN_RANGE] += range_of_slide / cycles
        if max_row == first_row or max_row == last_row:
            max_row = find_reversal_near_cycle_end(
                rows, max_row, max_row == last_row, interface, run, REST_RATE_RATIO * max_rate
            )
        if min_row == first_row or min_row == last_row:
            min_row = find_reversal_near_cycle_end(
                rows, min_row, min_row == last_row, interface, run, REST_RATE_RATIO * max_rate
            )
        if range_of_slide > 0.0 and max_row >= 0 and min_row >= 0:
            secant = (
                find_reversal_force(rows, max_row, interface, modal_system, min_motion)
                - find_reversal_force(rows, min_row, interface, modal_system, min_motion)
            ) / range_of_slide
            if secant == secant:
                n_secants += 1
                values[InterfaceMeasure.SECANT] += secant
        first_row = last_row
    values[InterfaceMeasure.SECANT] = (
        values[InterfaceMeasure.SECANT] / n_secants if n_secants > 0 else nan
    )


@njit(**NJIT_INLINE)
def measure_ringing(rows, first, last, modal_system, segment, values):
    """Measure the free vibration of a single mode while its interface sticks.

    The measures are the angle by which the vibration turns, and its largest acceleration by the
    rule of `response.ringing`.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    first : int
        First row of the stick.
    last : int
        First row after it.
    modal_system : ModalSystem
    segment : ndarray
        (12,) segment of the drive, see `Segment`.
    values : ndarray
        (13,) see `RunMeasure`; they are written.
    """
    angle = 0.0
    row = rows[first]
    damp = modal_system.damping[0, 0]
    spring = interface_column(0, modal_system) + Column.STIFFNESS
    for j in range(first, last):
        angle += (
            sqrt(
                max(
                    modal_system.omega_squared[0]
                    + rows[j, spring] * modal_system.inverse_mass[0]
                    - 0.25 * damp * damp,
                    0.0,
                )
            )
            * rows[j, Row.DURATION]
        )
    values[RunMeasure.RING_ANGLE] = max(values[RunMeasure.RING_ANGLE], angle)
    beta = modal_system.omega_squared[0] + row[spring] * modal_system.inverse_mass[0]
    omega = segment[Segment.OMEGA]
    modal_rate = beta - 0.25 * damp * damp
    detuning = beta - omega * omega
    damping_term = damp * omega
    square = detuning * detuning + damping_term * damping_term
    if modal_rate <= 0.0 or square <= 1e-18 * beta * beta:
        return
    modal_rate = sqrt(modal_rate)
    drive_amplitude = modal_system.base[0] * segment[Segment.AMPLITUDE]
    force = modal_system.interfaces[0, 0] * row[spring - 1] / modal_system.mass
    sine = -drive_amplitude * sin(row[Row.PHASE])
    cosine = -drive_amplitude * cos(row[Row.PHASE])
    static_term = (
        -modal_system.base[0] * segment[Segment.CONSTANT]
        - modal_system.omega_squared[0] * row[Row.MOTION]
        - force
    )
    z = -static_term / beta - (detuning * sine - damping_term * cosine) / square
    v = row[Row.MOTION + 1] - omega * (detuning * cosine + damping_term * sine) / square
    quadrature = (v + 0.5 * damp * z) / modal_rate
    ratio = modal_rate / omega
    span = rows[last, Row.TIME] - row[Row.TIME]
    damping = 0.5 * damp / sqrt(beta)
    forced = span * omega > 3 * pi and damping < 1e-3 and abs(ratio - round(ratio)) < 1e-2
    if span * modal_rate >= 3 * pi and damping < 0.5 and not forced:
        values[RunMeasure.RING] = max(
            values[RunMeasure.RING],
            abs(modal_system.output[0]) * beta * sqrt(z * z + quadrature * quadrature),
        )


@njit(**NJIT_INLINE)
def measure_sticks_and_releases(rows, run, values):
    """Count the releases of the first interface, and measure the vibration while it sticks.

    Parameters
    ----------
    rows : ndarray
        (k, w) rows of pieces, see `Row`.
    run : RunArrays
    values : ndarray
        (13,) see `RunMeasure`; they are written.
    """
    n_rows = rows.shape[0] - 1
    modal_system = run.modal_system
    time_state = run.time_state
    start_time = rows[0, Row.TIME]
    period = time_state.period[0]
    at = interface_column(0, modal_system)
    is_single = len(modal_system.omega_squared) == 1 and len(modal_system.inverse_mass) == 1
    is_pending = False
    phase = 0.0
    release_time = start_time
    segment = time_state.segments[int(rows[0, Row.SEGMENT])]
    last_direction = (
        rows[0, at + Column.DIRECTION] if rows[0, at + Column.SLIPPING] >= SLIP_FRACTION else 0.0
    )
    stick_row = 0 if last_direction == 0.0 else -1
    for j in range(n_rows + 1):
        direction = last_direction
        if j < n_rows:
            slips = rows[j, at + Column.SLIPPING] >= SLIP_FRACTION
            direction = rows[j, at + Column.DIRECTION] if slips else 0.0
            if direction == last_direction:
                continue
        if is_pending and (
            j == n_rows or rows[j, Row.TIME] - release_time > MIN_SLIP_DURATION * period
        ):
            values[RunMeasure.N_RELEASES] += 1.0
            values[RunMeasure.RELEASE_COS] += cos(2 * phase)
            values[RunMeasure.RELEASE_SIN] += sin(2 * phase)
        is_pending = last_direction == 0.0 and direction != 0.0 and rows[j, Row.TIME] > start_time
        phase = rows[j, Row.PHASE]
        release_time = rows[j, Row.TIME]
        if stick_row >= 0 and (direction != 0.0 or j == n_rows):
            if is_single and rows[stick_row, at + Column.STIFFNESS] < RIGID_STIFFNESS:
                measure_ringing(rows, stick_row, j, modal_system, segment, values)
            stick_row = -1
        elif direction == 0.0 and stick_row < 0:
            stick_row = j
        last_direction = direction


@njit(cache=True, nogil=True, **NJIT_KERNEL)
def read_rows(rows, cycles, base_moves, run, run_values, interface_values):
    """Measure the last cycles of a run from its recorded time intervals.

    Parameters
    ----------
    rows : ndarray
        (k + 1, w) as `march_kernels.march` writes them, and one without duration for the end.
    cycles : int
        Whole cycles among them; each ends with a piece.
    base_moves : float
        1 if the acceleration of the base counts, else 0.
    run : RunArrays
    run_values : ndarray
        (13,) see `RunMeasure`.
    interface_values : ndarray
        (i, 21) see `InterfaceMeasure`.

    Notes
    -----
    Cost: 1 us per piece of one mode.
    """
    modal_system = run.modal_system
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    n_rows = rows.shape[0] - 1
    period = run.time_state.period[0]
    run_values[:] = 0.0
    interface_values[:] = 0.0
    workspace.constraint.status[ConstraintStatus.N_STICKING] = -1.0
    run_values[RunMeasure.MIN_OUTPUT] = inf
    run_values[RunMeasure.MAX_OUTPUT] = -inf
    for f in range(n_interfaces):
        values = interface_values[f]
        at = interface_column(f, modal_system)
        values[InterfaceMeasure.MIN_SLIDE] = inf
        values[InterfaceMeasure.MAX_SLIDE] = -inf
        values[InterfaceMeasure.MIN_SLIP] = inf
        values[InterfaceMeasure.MAX_SLIP] = -inf
        values[InterfaceMeasure.START_SLIDE] = read_slide(rows[0], f, modal_system)
        values[InterfaceMeasure.END_SLIDE] = read_slide(rows[n_rows], f, modal_system)
        values[InterfaceMeasure.WORK] = rows[n_rows, at + Column.WORK] - rows[0, at + Column.WORK]
    for j in range(n_rows + 1):
        add_row_state(rows[j], modal_system, run_values, interface_values)
        h = rows[j, Row.DURATION]
        if j == n_rows or h <= 0.0:
            continue
        top = expand_row(rows[j], h, run)
        run_values[RunMeasure.MAX_ACCELERATION] = find_peak_acceleration(
            top, h, base_moves, run_values[RunMeasure.MAX_ACCELERATION], run
        )
        add_forces(rows, j, top, modal_system, workspace, interface_values)
        middle = rows[j, Row.TIME] + 0.5 * h
        border = middle < rows[0, Row.TIME] + period, middle > rows[n_rows, Row.TIME] - period
        add_integrals(rows[j], top, border, run, run_values, interface_values)
    for f in range(n_interfaces):
        measure_cycles(rows, cycles, f, run, interface_values[f])
    measure_sticks_and_releases(rows, run, run_values)
