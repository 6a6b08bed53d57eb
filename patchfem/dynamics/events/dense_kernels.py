"""Motion of an event-driven run at arbitrary times, and its peak acceleration (compiled)."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_KERNEL
from .drive_kernels import Instant, expand_drive
from .memory_kernels import RIGID_STIFFNESS
from .positions_kernels import N_COLUMNS, Column, ConstraintStatus, Row, Segment
from .search_kernels import expand_speed, integrate_speed
from .series_kernels import (
    MotionSeries,
    MotionStart,
    bound_modal_rate,
    evaluate_polynomial,
    expand_motion,
    find_highest_power,
    find_largest_magnitude,
)
from .stick_kernels import constrain_slides


@njit(**NJIT_KERNEL)
def expand_row(row, h, run):
    """Expand the motion of a recorded time interval as power series into the workspace.

    The constraint is built again if other interfaces stick than in the row before;
    constraint.status[ConstraintStatus.N_STICKING] < 0 requests it.

    Parameters
    ----------
    row : ndarray
        (w,) row of a piece, see `Row`.
    h : float
        Duration [s].
    run : RunArrays

    Returns
    -------
    int
        Highest power of the series.
    """
    modal_system = run.modal_system
    time_state = run.time_state
    workspace = run.workspace
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    segment = time_state.segments[int(row[Row.SEGMENT])]
    start = Row.MOTION + 2 * n
    displacement = row[Row.MOTION : Row.MOTION + n]
    speed = row[Row.MOTION + n : start]
    for f in range(n_interfaces):
        workspace.polynomials[n_interfaces, f] = row[start + N_COLUMNS * f + Column.FORCE]
        workspace.stiffness[f] = row[start + N_COLUMNS * f + Column.STIFFNESS]
        is_sticking = 1.0 if workspace.stiffness[f] == RIGID_STIFFNESS else 0.0
        if constraint.is_sticking[f] != is_sticking:
            constraint.is_sticking[f] = is_sticking
            constraint.status[ConstraintStatus.N_STICKING] = -1.0
    if constraint.status[ConstraintStatus.N_STICKING] < 0.0:
        constrain_slides(modal_system, workspace)
    modal_rate = bound_modal_rate(modal_system, workspace)
    top = find_highest_power(max(modal_rate, segment[Segment.RATE]) * h)
    instant = Instant(row[Row.CYCLE], row[Row.OFFSET], time_state.period[0])
    expand_drive(segment, instant, h, top, workspace.drive)
    motion = MotionStart(displacement, speed, workspace.polynomials[n_interfaces])
    series = MotionSeries(workspace.drive[0], workspace.coefficients)
    expand_motion(motion, series, h, top, modal_system, workspace)
    for f in range(n_interfaces):
        expand_speed(
            modal_system.interfaces[f],
            n,
            workspace.coefficients,
            top,
            workspace.polynomials[f],
        )
    return top


@njit(cache=True, **NJIT_KERNEL)
def evaluate_rows(rows, owner, tau, run, out):
    """Evaluate the recorded motion of a run at given times.

    Parameters
    ----------
    rows : ndarray
        (r, w) see `Row`.
    owner, tau : ndarray
        (j,) row of each time, in increasing order, and time since its start [s].
    run : RunArrays
    out : ndarray
        (j, 2 n + 1 + 6 i): modal coordinates, rates, drive [m s-2], then of every interface
        relative displacement [m], its rate [m/s], force [N], slip [m], work and loss [J].
    """
    modal_system = run.modal_system
    workspace = run.workspace
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    last = -1
    top = 0
    h = 1.0
    workspace.constraint.status[ConstraintStatus.N_STICKING] = -1.0
    for j in range(owner.size):
        row = rows[owner[j]]
        if owner[j] != last:
            last = owner[j]
            h = max(row[Row.DURATION], 1e-300)
            top = expand_row(row, h, run)
        u = tau[j] / h
        for i in range(n):
            out[j, i] = evaluate_polynomial(workspace.coefficients[:, i], 0, top, u)
            rate = top * workspace.coefficients[top, i]
            for k in range(top - 1, 0, -1):
                rate = rate * u + k * workspace.coefficients[k, i]
            out[j, n + i] = rate / h
        out[j, 2 * n] = evaluate_polynomial(workspace.drive[0], 0, top, u)
        for f in range(n_interfaces):
            at = Row.MOTION + 2 * n + N_COLUMNS * f
            first = 2 * n + 1 + 6 * f
            if workspace.stiffness[f] == RIGID_STIFFNESS:
                out[j, first] = row[at + Column.SLIDE]
                out[j, first + 1] = 0.0
                out[j, first + 2] = evaluate_polynomial(
                    workspace.constraint.reactions[f], 0, top - 2, u
                )
                out[j, first + 3] = row[at + Column.SLIP]
                out[j, first + 4] = row[at + Column.WORK]
                out[j, first + 5] = row[at + Column.LOSS]
                continue
            step = integrate_speed(workspace.polynomials[f], top, u)
            displacement = 0.0
            for i in range(n):
                displacement += modal_system.interfaces[f, i] * out[j, i]
            out[j, first] = displacement
            out[j, first + 1] = evaluate_polynomial(workspace.polynomials[f], 0, top - 1, u) / h
            out[j, first + 2] = row[at + Column.FORCE] + row[at + Column.STIFFNESS] * step
            out[j, first + 3] = row[at + Column.SLIP] + row[at + Column.SLIPPING] * step
            out[j, first + 4] = (
                row[at + Column.WORK]
                + (row[at + Column.FORCE] + 0.5 * row[at + Column.STIFFNESS] * step) * step
            )
            out[j, first + 5] = row[at + Column.LOSS] + row[at + Column.LIMIT] * abs(step)


@njit(cache=True, **NJIT_KERNEL)
def find_peaks(rows, base_moves, run, reactions):
    """Return the peak output acceleration [m s-2] over recorded time intervals.

    Parameters
    ----------
    rows
    base_moves : float
        1 if the acceleration of the base counts, else 0.
    run : RunArrays
    reactions : ndarray
        (i,) becomes the largest reaction [N] of every interface while its rigid element sticks.

    Returns
    -------
    float
    """
    modal_system = run.modal_system
    workspace = run.workspace
    largest = 0.0
    n_interfaces = len(modal_system.inverse_mass)
    poly = workspace.polynomials[n_interfaces]
    workspace.constraint.status[ConstraintStatus.N_STICKING] = -1.0
    for f in range(n_interfaces):
        reactions[f] = 0.0
    for j in range(rows.shape[0]):
        h = rows[j, Row.DURATION]
        if h <= 0:
            continue
        top = expand_row(rows[j], h, run)
        for k in range(top - 1):
            acceleration = 0.0
            for i in range(len(modal_system.omega_squared)):
                acceleration += modal_system.output[i] * workspace.coefficients[k + 2, i]
            poly[k] = (
                acceleration * (k + 1) * (k + 2) / (h * h) + base_moves * workspace.drive[0, k]
            )
        largest = find_largest_magnitude(poly, top - 2, largest, workspace.hulls)
        for f in range(n_interfaces):
            if workspace.stiffness[f] == RIGID_STIFFNESS:
                reactions[f] = find_largest_magnitude(
                    workspace.constraint.reactions[f], top - 2, reactions[f], workspace.hulls
                )
    return largest
