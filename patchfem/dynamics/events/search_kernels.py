"""Search for the first event in a time interval (compiled).

An event is a yield, the release of an interface that a rigid element holds, or a reversal of
an interface or of the output. Up to the first reversal, which the Bernstein coefficients of
the speed prove, the relative displacement is monotone, so a yield before it is the one root of a
monotone function: no event can be missed.
"""

from math import sqrt
from typing import NamedTuple

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .memory_kernels import is_sticking, next_yield_slide
from .positions_kernels import EVENT_KIND
from .series_kernels import EPS, NO_ROOT, SINGLE_INTEGRAL_FACTORS, find_first_root, refine_root

# Largest term of a speed that is treated as round-off, relative to the sum
# of the magnitudes of all terms.
ACCELERATION_TOL = 1e-14


class NextEvent(NamedTuple):
    """First event in a time interval.

    - u: fraction of the piece; 1 if no event ends the piece, 0 if the elements change before
      anything moves
    - kind: a number of `EventKinds`
    - interface: its number
    - sign: sign of the slip that follows
    """

    u: float
    kind: int
    interface: int
    sign: float


@njit(**NJIT_INLINE)
def find_initial_direction(poly, top, is_at_rest):
    """Return the order and sign of the first term of a velocity series above round-off.

    rests: whether the speed is zero at the start, so that the term of order 0 does not count.

    Parameters
    ----------
    poly : ndarray
        Series of the speed.
    top : int
        Highest power of the series.
    is_at_rest : bool
        Whether the speed is 0 at the start, so that the term of order 0 does not count.

    Returns
    -------
    order : int
    sign : float
        0 if all terms are round-off.
    """
    if not is_at_rest and poly[0] != 0.0:
        return 0, 1.0 if poly[0] > 0 else -1.0
    size = 0.0
    for k in range(top):
        size += abs(poly[k])
    for k in range(1, min(top, 4)):
        if abs(poly[k]) > ACCELERATION_TOL * size:
            return k, 1.0 if poly[k] > 0 else -1.0
    return 0, 0.0


@njit(**NJIT_INLINE)
def expand_speed(row, count, coefs, top, poly):
    """Write the power series of the velocity of an interface or of the output.

    Parameters
    ----------
    row : ndarray
        (n,) displacement per coordinate.
    count : int
        Number n of coordinates.
    coefs : ndarray
        (terms, n) series of the coordinates.
    top : int
        Highest power of the series.
    poly : ndarray
        (top,) series of the speed, which is written.
    """
    for k in range(top):
        term = 0.0
        for i in range(count):
            term += row[i] * coefs[k + 1, i]
        poly[k] = (k + 1) * term


@njit(**NJIT_INLINE)
def integrate_speed(poly, top, u):
    """Return the displacement, the integral of a velocity series from 0 to u.

    Parameters
    ----------
    poly : ndarray
        (top,) series of the speed.
    top : int
        Highest power of the series.
    u : float
        Fraction of the piece.

    Returns
    -------
    float
    """
    out = poly[top - 1] * SINGLE_INTEGRAL_FACTORS[top]
    for k in range(top - 2, -1, -1):
        out = out * u + poly[k] * SINGLE_INTEGRAL_FACTORS[k + 1]
    return out * u


@njit(**NJIT_KERNEL)
def find_crossing(poly, top, distance, limit, scratch):
    """Return the fraction of a time interval at which a given displacement is reached.

    It is NO_ROOT if it is not reached up to `limit`.

    Parameters
    ----------
    poly : ndarray
        (top,) series of the speed; the motion is monotone up to the limit.
    top : int
    distance : float
        With its sign [m].
    limit : float
        Largest u.
    scratch : ndarray
        Workspace for a polynomial.

    Returns
    -------
    float
    """
    end = integrate_speed(poly, top, limit)
    direction = 1.0 if distance > 0 else -1.0
    if direction * end < direction * distance:
        return NO_ROOT
    scratch[0] = direction * distance
    for k in range(top):
        scratch[k + 1] = -direction * poly[k] * SINGLE_INTEGRAL_FACTORS[k + 1]
    start = limit * distance / end
    square = scratch[1] * scratch[1] - 4 * scratch[0] * scratch[2]
    # Newton's method starts from the root of the first three terms.
    if square > 0 and 2 * scratch[0] < limit * (sqrt(square) - scratch[1]):
        start = 2 * scratch[0] / (sqrt(square) - scratch[1])
    return refine_root(scratch, 0, top, 0.0, limit, start)


@njit(**NJIT_KERNEL)
def find_release(interface, top, limit, workspace):
    """Find where the reaction of a sticking interface first exceeds its limit.

    Parameters
    ----------
    interface : int
    top : int
        Highest power of the series.
    limit : float
        Limit of the reaction [N].
    workspace : Workspace

    Returns
    -------
    u : float
        NO_ROOT if it does not.
    sign : float
        Sign of the slip that follows.
    """
    choice = workspace.choice
    reaction = workspace.constraint.reactions[interface]
    scratch = workspace.polynomials[workspace.constraint.inverse.shape[0]]
    size = limit
    for k in range(top - 1):
        size += abs(reaction[k])
    best = NO_ROOT
    release_sign = 0.0
    if (
        size < 2 * limit
        and choice.orders[interface, 0] == 0.0
        and choice.orders[interface, 1] == 0.0
    ):
        return best, release_sign
    for side in (1, -1):
        order = int(choice.orders[interface, (1 - side) // 2])
        for k in range(order, top - 1):
            scratch[k] = -side * reaction[k]
        if order == 0:
            scratch[0] += limit
            if scratch[0] <= 4 * EPS * size:
                scratch[0] = max(scratch[0], 0.0)
        root = NO_ROOT
        if order < top - 1:
            root = find_first_root(scratch, order, top - 2, workspace.hulls)
        if root < best:
            best = root
            release_sign = float(side)
    return best, release_sign


@njit(**NJIT_KERNEL)
def find_speed_root(order, direction, poly, top, workspace):
    """Return the fraction of a time interval at which a velocity first changes its sign.

    It is NO_ROOT if the velocity keeps its sign.

    Parameters
    ----------
    order : int
        Order of the first term that counts; lower terms are round-off.
    direction : float
        Sign of the speed just after the start of the piece.
    poly : ndarray
        (top,) series of the speed.
    top : int
        Highest power of the series of the coordinates.
    workspace : Workspace

    Returns
    -------
    float
    """
    if order >= top:
        return NO_ROOT
    scratch = workspace.polynomials[workspace.constraint.inverse.shape[0]]
    for k in range(order, top):
        scratch[k] = direction * poly[k]
    return find_first_root(scratch, order, top - 1, workspace.hulls)


@njit(**NJIT_KERNEL)
def find_stop(interface, direction, poly, top, workspace):
    """Return the fraction of a time interval at which a rigid slipping element stops.

    It is NO_ROOT if the element does not stop.

    Parameters
    ----------
    interface : int
    direction, poly, top, workspace
        See `find_speed_root`.

    Returns
    -------
    float
    """
    order = int(workspace.choice.orders[interface, 0])
    if order == 0 and direction * poly[0] <= 0.0:
        return 0.0
    return find_speed_root(order, direction, poly, top, workspace)


@njit(**NJIT_INLINE)
def find_output_reversal(event, top, run):
    """Return the reversal of the output or an earlier event.

    Parameters
    ----------
    event : NextEvent
        First event of the interfaces.
    top : int
        Highest power of the series.
    run : RunArrays

    Returns
    -------
    NextEvent
    """
    modal_system = run.modal_system
    workspace = run.workspace
    n_interfaces = len(modal_system.inverse_mass)
    poly = workspace.polynomials[n_interfaces + 1]
    n = len(modal_system.omega_squared)
    expand_speed(modal_system.output, n, workspace.coefficients, top, poly)
    is_at_rest = run.time_state.is_at_reversal[n_interfaces] == 1.0
    order, direction = find_initial_direction(poly, top, is_at_rest)
    if direction == 0.0:
        return event
    root = find_speed_root(order, direction, poly, top, workspace)
    if root < event.u:
        return NextEvent(root, EVENT_KIND.output_reversal, n_interfaces, -direction)
    return event


@njit(**NJIT_KERNEL)
def find_next_event(top, run):
    """Find the first event of all interfaces in a time interval.

    Parameters
    ----------
    top : int
        Highest power of the series.
    run : RunArrays

    Returns
    -------
    NextEvent
    """
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    workspace = run.workspace
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    polynomials = workspace.polynomials
    event = NextEvent(1.0, EVENT_KIND.none, 0, 0.0)
    for f in range(n_interfaces):
        poly = polynomials[f]
        expand_speed(modal_system.interfaces[f], n, workspace.coefficients, top, poly)
        if is_sticking(f, table, memory):
            root, direction = find_release(f, top, table.static_limit[f], workspace)
            if root <= event.u:
                event = NextEvent(root, EVENT_KIND.release, f, direction)
            continue
        if table.static_limit[f] > 0.0:
            direction = memory.rigid_state[f]
            if abs(direction) == 2.0:
                continue
            root = find_stop(f, direction, poly, top, workspace)
            if root <= event.u:
                event = NextEvent(root, EVENT_KIND.reversal, f, -direction)
            if table.n_elements[f] == 0 or event.u == 0.0:
                continue
        else:
            order, direction = find_initial_direction(
                poly, top, run.time_state.is_at_reversal[f] == 1.0
            )
            if direction == 0.0:
                continue
            if memory.n_slipping[f] > 0 and direction != memory.direction[f]:
                return NextEvent(0.0, EVENT_KIND.reversal, f, direction)
            root = find_speed_root(order, direction, poly, top, workspace)
            if root < event.u:
                event = NextEvent(root, EVENT_KIND.reversal, f, -direction)
        gap = next_yield_slide(f, direction, table, memory) - memory.slide[f]
        if direction * gap <= 0:
            return NextEvent(0.0, EVENT_KIND.yielding, f, direction)
        root = find_crossing(poly, top, gap, event.u, polynomials[n_interfaces])
        if root <= event.u:
            event = NextEvent(root, EVENT_KIND.yielding, f, direction)
    if modal_system.output_interface < 0:
        return find_output_reversal(event, top, run)
    return event
