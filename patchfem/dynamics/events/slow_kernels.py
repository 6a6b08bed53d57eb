"""Series of a motion that follows a slow drive quasi-statically (compiled).

After an event the modes vibrate freely; once that has decayed, the motion varies as slowly as the
drive. Its series solves K c_k = -base a_k - D (k + 1) c_(k+1)/h - (k + 1)(k + 2) c_(k+2)/h^2 from
the highest power down, with K of the modes and of the springs at the interfaces. The piece is many
radians of every mode long, so the higher powers add little. Cost: a quasi-static cycle of 10 Hz
under modes of 20 kHz takes a tenth of the time of short pieces.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from .drive_kernels import expand_drive, fastest_drive_rate
from .memory_kernels import RIGID_STIFFNESS
from .positions_kernels import TIME
from .series_kernels import EPS, MAX_RATE_TIME, find_highest_power

# free vibration over the size of the motion, below which it is round-off
RINGING_TOL = 64 * EPS
# number of short pieces after which the march checks again whether the free vibration has decayed
MIN_SHORT_PIECES = 16.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def factorise_compliance(springs, modal_system, workspace):
    """Factorise the compliance at the interfaces into constraint.matrix (i, i).

    The compliance is row omega^-2 row^T/mass + 1/spring.

    Parameters
    ----------
    springs : ndarray
        (i,) stiffness of the interfaces [N/m].
    modal_system : ModalSystem
    workspace : Workspace
        Its constraint.basis becomes the rows: those of sticking interfaces as `constrain_slides`
        leaves them, 0 without force.
    """
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    for f in range(n_interfaces):
        size = 0.0
        for i in range(n):
            if springs[f] < RIGID_STIFFNESS:
                constraint.basis[f, i] = modal_system.interfaces[f, i] if springs[f] > 0.0 else 0.0
            size += constraint.basis[f, i] ** 2
        for g in range(f + 1):
            part = 0.0
            for i in range(n):
                part += (
                    constraint.basis[f, i] * constraint.basis[g, i] / modal_system.omega_squared[i]
                )
            constraint.matrix[f, g] = part / modal_system.mass
        constraint.matrix[f, f] = constraint.matrix[f, f] + 1 / springs[f] if size > 0.0 else 1.0
    factorise(constraint.matrix)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_imbalance(force, coordinates, springs, modal_system, imbalance):
    """Write a force minus that of modes and springs into `imbalance`.

    Parameters
    ----------
    force : ndarray
        (n,) modal accelerations [m s-2].
    coordinates : ndarray
        (n,) [m].
    springs : ndarray
        (i,) stiffness of the interfaces [N/m].
    modal_system : ModalSystem
    imbalance : ndarray
        (n,) [m s-2], which is written.
    """
    n = len(modal_system.omega_squared)
    for i in range(n):
        imbalance[i] = force[i] - modal_system.omega_squared[i] * coordinates[i]
    for f in range(len(modal_system.inverse_mass)):
        pull = 0.0
        for i in range(n):
            pull += modal_system.interfaces[f, i] * coordinates[i]
        pull = pull * springs[f] / modal_system.mass if springs[f] < RIGID_STIFFNESS else 0.0
        for i in range(n):
            imbalance[i] -= modal_system.interfaces[f, i] * pull


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def solve_equilibrium(force, coordinates, springs, modal_system, imbalance, workspace):
    """Solve the static equilibrium under a force, in which sticking interfaces do not move.

    Parameters
    ----------
    force, springs, modal_system
        See `find_imbalance`.
    coordinates : ndarray
        (n,) [m], which become K^-1 force.
    imbalance : ndarray
        (n,) [m s-2], which becomes the part that the sticking interfaces carry.
    workspace : Workspace
        As `factorise_compliance` leaves it.
    """
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    for i in range(n):
        coordinates[i] = 0.0
    for _ in range(2):  # the second pass removes the round-off of the first
        find_imbalance(force, coordinates, springs, modal_system, imbalance)
        for f in range(n_interfaces):
            constraint.scratch[1, f] = 0.0
            for i in range(n):
                off = coordinates[i] if springs[f] == RIGID_STIFFNESS else 0.0
                constraint.scratch[1, f] += constraint.basis[f, i] * (
                    imbalance[i] / modal_system.omega_squared[i] + off
                )
        solve_factorised(constraint.matrix, constraint.scratch[1])
        for i in range(n):
            for f in range(n_interfaces):
                imbalance[i] -= (
                    constraint.basis[f, i] * constraint.scratch[1, f] / modal_system.mass
                )
            coordinates[i] += imbalance[i] / modal_system.omega_squared[i]
    find_imbalance(force, coordinates, springs, modal_system, imbalance)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def expand_slow_motion(coordinates, rate, force, springs, modal_system, h, top, workspace):
    """Write the series of a motion that follows the drive.

    Parameters
    ----------
    coordinates, rate : ndarray
        (n,) coordinates [m] and rates [m/s] at the start.
    force, springs, modal_system, h, top, workspace
        See `expand_motion`; workspace.drive[0] is the series of the drive.

    Returns
    -------
    float
        Free vibration over the motion.
    """
    choice = workspace.choice
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    coefs = workspace.coefficients
    drive = workspace.drive[0]
    pull = choice.motion_sizes[0]
    factorise_compliance(springs, modal_system, workspace)
    for i in range(n):
        coefs[top + 1, i] = 0.0
        coefs[top + 2, i] = 0.0
    for k in range(top, -1, -1):
        for i in range(n):
            pull[i] = -modal_system.base[i] * drive[k] - (k + 1) * (k + 2) * coefs[k + 2, i] / (
                h * h
            )
            for j in range(n):
                pull[i] -= modal_system.damping[i, j] * (k + 1) * coefs[k + 1, j] / h
            if k == 0:
                pull[i] -= modal_system.omega_squared[i] * coordinates[i]
                for f in range(n_interfaces):
                    pull[i] -= (
                        modal_system.interfaces[f, i] * force[f] / modal_system.mass
                        if springs[f] < RIGID_STIFFNESS
                        else 0.0
                    )
        solve_equilibrium(pull, coefs[k], springs, modal_system, choice.motion_sizes[1], workspace)
        for f in range(n_interfaces):
            constraint.reactions[f, k] = 0.0
            for i in range(n):
                constraint.reactions[f, k] += (
                    modal_system.mass * constraint.inverse[f, i] * choice.motion_sizes[1, i]
                )
    ringing = 0.0
    following = 0.0
    for i in range(n):
        size = (
            abs(coordinates[i])
            + abs(modal_system.base[i] * drive[0]) / modal_system.omega_squared[i]
        )
        for k in range(1, top + 1):
            size += abs(coefs[k, i])
        for f in range(n_interfaces):
            size += (
                abs(modal_system.interfaces[f, i] * force[f])
                / modal_system.mass
                / modal_system.omega_squared[i]
                if springs[f] < RIGID_STIFFNESS
                else 0.0
            )
        ringing += (
            modal_system.omega_squared[i] * coefs[0, i] ** 2 + (coefs[1, i] / h - rate[i]) ** 2
        )
        following += modal_system.omega_squared[i] * size**2
        coefs[0, i] = coordinates[i]
    return sqrt(ringing / max(following, 1e-300))


@njit(error_model="numpy", cache=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def expand_slow_piece(
    segment, cycle, offset, period, coordinates, rate, force, modal_system, workspace
):
    """Expand a slow motion over the longest piece that the rate of the drive allows.

    It is compiled once for all callers, because it runs rarely.

    Parameters
    ----------
    segment, cycle, offset, period
        See `drive_kernels.expand_drive`.
    coordinates, rate, force, modal_system, workspace
        See `expand_slow_motion`.

    Returns
    -------
    float
        Free vibration over the motion.
    """
    h = MAX_RATE_TIME / fastest_drive_rate(segment, period)
    top = find_highest_power(MAX_RATE_TIME)
    expand_drive(segment, cycle, offset, period, h, top, workspace.drive)
    return expand_slow_motion(
        coordinates, rate, force, workspace.stiffness, modal_system, h, top, workspace
    )


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_slow_rate(motion, force, modal_system, time_state, workspace):
    """Return the rate of the drive [1/s] where the motion follows it quasi-statically.

    The series is then in the workspace as `expand_slow_piece` leaves it.

    Parameters
    ----------
    motion : ndarray
        (2, n) modal coordinates [m] and rates [m/s].
    force : ndarray
        (i,) forces at the start [N].
    modal_system : ModalSystem
    time_state : TimeState
    workspace : Workspace

    Returns
    -------
    float
        0 where it does not.
    """
    now = time_state.now
    segment = time_state.segments[int(time_state.now[TIME.segment])]
    period = time_state.period[0]
    if fastest_drive_rate(segment, period) > modal_system.slow_rate:
        return 0.0
    now[TIME.n_quiet] += 1
    if now[TIME.n_quiet] < MIN_SHORT_PIECES:
        return 0.0
    if (
        expand_slow_piece(
            segment,
            now[TIME.cycle],
            now[TIME.offset],
            period,
            motion[0],
            motion[1],
            force,
            modal_system,
            workspace,
        )
        <= RINGING_TOL
    ):
        return fastest_drive_rate(segment, period)
    now[TIME.n_quiet] = 0.0
    return 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def shorten_series(fraction, top, n_interfaces, workspace):
    """Rescale the series of a piece in the workspace to a fraction of the piece.

    Parameters
    ----------
    fraction : float
        New duration over the old one.
    top : int
        Highest power of the series.
    n_interfaces : int
    workspace : Workspace
    """
    power = 1.0
    for k in range(top + 1):
        for i in range(workspace.coefficients.shape[1]):
            workspace.coefficients[k, i] *= power
        workspace.drive[0, k] *= power
        for f in range(n_interfaces):
            workspace.constraint.reactions[f, k] *= power
        power *= fraction
