"""Run from event to event that carries its derivative along (compiled).

An interface remembers where its relative displacement turned. The force is continuous in those
places, so nothing jumps at a yield or a turning point, and the derivative over a run is the
product of the linear flows of its pieces. A turning point may shift in time, but the interface is
at rest there, so the derivative of the new turning place is that of the relative displacement.
"""

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .drive_kernels import fastest_drive_rate
from .march_kernels import (
    Piece,
    apply_event,
    choose_length,
    clear_rests,
    expand_piece,
    is_before,
    is_idle,
    move_state,
    output_displacement,
    reaches_border,
    reset_forces,
    step_to_border,
    time_to_border,
    widen_extremes,
)
from .memory_kernels import find_tangent
from .positions_kernels import EVENT, TIME
from .search_kernels import find_next_event
from .series_kernels import bound_fastest_rate, expand_motion


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def move_slopes(u, h, top, slopes, turning_slopes, modal_system, table, memory, workspace, scratch):
    """Move the derivatives of coordinates and rates over a piece up to u.

    Parameters
    ----------
    u, h, top
        Fraction and duration [s] of the piece, and highest power.
    slopes : ndarray
        (2, n, s) derivatives of coordinates and rates with respect to s numbers.
    turning_slopes : ndarray
        (i, t + 2, s) derivatives of the turning places.
    modal_system, table, memory, workspace
    scratch : tuple
        Workspace: derivatives with respect to one number (2, n), the force on them (i,), their
        series (terms, n).
    """
    slope, force, coefs = scratch
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    no_drive = workspace.drive[1]
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
                ) * turning_slopes[f, k, s]
                first = end
        expand_motion(
            slope[0],
            slope[1],
            force,
            workspace.stiffness,
            modal_system,
            no_drive,
            h,
            top,
            coefs,
            workspace,
        )
        for i in range(n):
            place = coefs[top, i]
            rate = top * coefs[top, i]
            for k in range(top - 1, 0, -1):
                place = place * u + coefs[k, i]
                rate = rate * u + k * coefs[k, i]
            slopes[0, i, s] = coefs[0, i] + u * place
            slopes[1, i, s] = rate / h


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def store_turning_slope(interface, slopes, turning_slopes, modal_system, memory):
    """Write the derivative of a new turning place of an interface, which is that of its slide.

    Parameters
    ----------
    interface : int
    slopes, turning_slopes : ndarray
        See `move_slopes`; turning_slopes is written.
    modal_system : ModalSystem
    memory : Memory
    """
    for s in range(slopes.shape[2]):
        slope = 0.0
        for i in range(len(modal_system.omega_squared)):
            slope += modal_system.interfaces[interface, i] * slopes[0, i, s]
        turning_slopes[interface, memory.n_groups[interface], s] = slope


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def count_elements(memory, counts):
    """Update the largest numbers of slipping elements and the smallest numbers of groups."""
    for f in range(counts.shape[1]):
        counts[0, f] = max(counts[0, f], memory.n_slipping[f])
        counts[1, f] = min(counts[1, f], memory.n_groups[f])


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def march_with_slopes(
    stop,
    motion,
    slopes,
    turning_slopes,
    modal_system,
    table,
    memory,
    time_state,
    run_sums,
    workspace,
    scratch,
    counts,
):
    """March from event to event without rows and energies, and carry the derivative along.

    Parameters
    ----------
    stop : tuple
        Cycle and offset [s] at which the run ends.
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    slopes, turning_slopes : ndarray
        (2, n, s), (i, t + 2, s) derivatives of the motion and of the turning places with respect
        to s numbers.
    modal_system, table, memory, time_state, run_sums, workspace
    scratch : tuple
        See `move_slopes`.
    counts : ndarray
        (2, i) becomes the largest number of slipping elements and the smallest number of groups.

    Returns
    -------
    int
        Number of pieces, -1 where events follow each other without progress.
    """
    n_interfaces = len(modal_system.inverse_mass)
    reset_forces(modal_system, table, memory)
    now = time_state.now
    pieces = 0
    for k in range(workspace.drive.shape[1]):
        workspace.drive[1, k] = 0.0
    while is_before(now, stop):
        count_elements(memory, counts)
        segment = time_state.segments[int(now[TIME.segment])]
        for f in range(n_interfaces):
            workspace.stiffness[f] = find_tangent(f, table, memory).stiffness
        rate = max(
            bound_fastest_rate(modal_system, workspace.stiffness),
            fastest_drive_rate(segment, time_state.period[0]),
        )
        remaining = time_to_border(time_state, stop)
        h = choose_length(rate, remaining, motion, modal_system, table, memory)
        top = expand_piece(h, rate, motion, memory.force, modal_system, time_state, workspace)
        piece = Piece(h, rate, top, remaining)
        event = find_next_event(top, modal_system, table, memory, time_state, workspace)
        u = event.u
        if u > 0:
            if now[TIME.offset] == 0.0:
                widen_extremes(output_displacement(motion, modal_system), time_state, run_sums)
            move_slopes(
                u, h, top, slopes, turning_slopes, modal_system, table, memory, workspace, scratch
            )
            clear_rests(u, time_state)
            move_state(
                u, h, top, motion, modal_system, table, memory, time_state, run_sums, workspace
            )
            if reaches_border(piece, u, now):
                step_to_border(time_state, stop, remaining)
            else:
                now[TIME.offset] += u * h
            pieces += 1
        if is_idle(u * h, time_state, run_sums):
            return -1
        if event.kind == EVENT.reversal and memory.n_slipping[event.interface] > 0:
            store_turning_slope(event.interface, slopes, turning_slopes, modal_system, memory)
        apply_event(event, modal_system, table, memory, time_state)
    count_elements(memory, counts)
    return pieces
