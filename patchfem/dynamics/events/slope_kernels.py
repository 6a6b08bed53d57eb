"""March from event to event with the derivative of the motion (compiled).

The memory of an interface consists of its reversal displacements. The force is a continuous
function of them, so nothing jumps at a yield or a reversal, and the derivative over a run is the
product of the linear flows of its time intervals. A reversal may shift in time, but the interface is
at rest there, so the derivative of the new reversal displacement is that of the relative displacement.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .march_kernels import (
    apply_event,
    clear_reversal_marks,
    is_before,
    is_idle,
    move_state,
    output_displacement,
    reaches_breakpoint,
    reset_forces,
    start_piece,
    step_to_breakpoint,
    time_to_breakpoint,
    widen_extremes,
)
from .positions_kernels import EVENT_KIND, Time
from .search_kernels import find_next_event
from .series_kernels import MotionSeries, MotionStart, expand_motion


@njit(**NJIT_INLINE)
def move_slopes(u, piece, slopes, reversal_slopes, run, scratch):
    """Propagate derivatives of modal coordinates and rates over part of a time interval.

    Parameters
    ----------
    u : float
        Fraction of the piece.
    piece : Piece
    slopes : ndarray
        (2, n, s) derivatives of coordinates and rates with respect to s numbers.
    reversal_slopes : ndarray
        (i, t + 2, s) derivatives of the reversal displacements.
    run : RunArrays
    scratch : tuple
        Workspace: derivatives with respect to one number (2, n), the force on them (i,), their
        series (terms, n).
    """
    h = piece.duration
    top = piece.top
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    workspace = run.workspace
    slope, force, coefs = scratch
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    for s in range(slopes.shape[2]):
        for i in range(n):
            slope[0, i] = slopes[0, i, s]
            slope[1, i] = slopes[1, i, s]
        for f in range(n_interfaces):
            first = memory.n_slipping[f]
            moved = 0.0
            for i in range(n):
                moved += modal_system.interfaces[f, i] * slope[0, i]
            force[f] = workspace.stiffness[f] * moved
            for k in range(memory.n_groups[f] - 1, -1, -1):
                end = memory.group_end[f, k]
                force[f] -= (
                    table.stiffness_sum[f, end] - table.stiffness_sum[f, first]
                ) * reversal_slopes[f, k, s]
                first = end
        start = MotionStart(slope[0], slope[1], force)
        series = MotionSeries(workspace.drive[1], coefs)
        expand_motion(start, series, h, top, modal_system, workspace)
        for i in range(n):
            value = coefs[top, i]
            rate = top * coefs[top, i]
            for k in range(top - 1, 0, -1):
                value = value * u + coefs[k, i]
                rate = rate * u + k * coefs[k, i]
            slopes[0, i, s] = coefs[0, i] + u * value
            slopes[1, i, s] = rate / h


@njit(**NJIT_INLINE)
def store_reversal_slope(interface, slopes, reversal_slopes, run):
    """Store the derivative of a new reversal displacement of an interface.

    It is the derivative of the relative displacement, because the interface is at rest there.

    Parameters
    ----------
    interface : int
    slopes, reversal_slopes : ndarray
        See `move_slopes`; reversal_slopes is written.
    run : RunArrays
    """
    modal_system = run.modal_system
    for s in range(slopes.shape[2]):
        slope = 0.0
        for i in range(len(modal_system.omega_squared)):
            slope += modal_system.interfaces[interface, i] * slopes[0, i, s]
        reversal_slopes[interface, run.memory.n_groups[interface], s] = slope


@njit(**NJIT_INLINE)
def update_element_counts(memory, counts):
    """Update the maxima of slipping elements and the minima of element groups."""
    for f in range(counts.shape[1]):
        counts[0, f] = max(counts[0, f], memory.n_slipping[f])
        counts[1, f] = min(counts[1, f], memory.n_groups[f])


@njit(cache=True, **NJIT_KERNEL)
def march_with_slopes(stop, run, slopes, reversal_slopes, scratch, counts):
    """March from event to event with the derivative of the motion, without rows and energies.

    Parameters
    ----------
    stop : tuple
        Cycle and offset [s] at which the run ends.
    run : RunArrays
    slopes, reversal_slopes : ndarray
        (2, n, s), (i, t + 2, s) derivatives of the motion and of the reversal displacements with respect
        to s numbers.
    scratch : tuple
        See `move_slopes`.
    counts : ndarray
        (2, i) becomes the largest number of slipping elements and the smallest number of groups.

    Returns
    -------
    int
        Number of pieces, -1 if events follow each other without progress.
    """
    memory = run.memory
    time_state = run.time_state
    now = time_state.now
    no_drive = run.workspace.drive[1]
    pieces = 0
    reset_forces(run)
    for k in range(no_drive.shape[0]):
        no_drive[k] = 0.0
    while is_before(now, stop):
        update_element_counts(memory, counts)
        piece = start_piece(time_to_breakpoint(time_state, stop), run)
        event = find_next_event(piece.top, run)
        u = event.u
        if u > 0:
            if now[Time.OFFSET] == 0.0:
                widen_extremes(output_displacement(run), run)
            move_slopes(u, piece, slopes, reversal_slopes, run, scratch)
            clear_reversal_marks(u, time_state)
            move_state(u, piece, run)
            if reaches_breakpoint(piece, u, now):
                step_to_breakpoint(time_state, stop, piece.remaining)
            else:
                now[Time.OFFSET] += u * piece.duration
            pieces += 1
        if is_idle(u * piece.duration, run):
            return -1
        if event.kind == EVENT_KIND.reversal and memory.n_slipping[event.interface] > 0:
            store_reversal_slope(event.interface, slopes, reversal_slopes, run)
        apply_event(event, run)
    update_element_counts(memory, counts)
    return pieces
