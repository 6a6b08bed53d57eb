"""Choice of the interfaces that stick after an event under Coulomb friction (compiled).

While some interfaces stick, the acceleration is z'' = P a: a is the acceleration without
their friction, and P projects onto the motions in which they stay at rest; the reactions are the
components that the projection removes. Dependent interfaces (1-0, 2-0 and 1-2) carry the reaction
in the distribution of least norm: the motion is unique, the distribution is not. An interface
that this distribution would overload while the others hold it carries its limit, and the others
carry the remainder.

A choice obeys the law if every sticking interface is below its limit, or at it with a decreasing
reaction, and every other one starts to move in the direction of its slip. The first term of the
power series that is not round-off decides. Several choices may obey the law if kinetic friction is
below static friction. `choose_sticks` keeps the guess if it obeys the law. Otherwise it takes the
choice with the fewest slipping interfaces, as long as at most four are at rest. Among more it
exchanges single interfaces by the rule of least index (Murty 1974), starting with the guess; where
that finds none, it tries all choices of up to eight interfaces.
"""

from math import sqrt

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_KERNEL
from .memory_kernels import RIGID_STIFFNESS, find_tangent, interface_force, is_sticking
from .positions_kernels import ConstraintStatus
from .series_kernels import DOUBLE_INTEGRAL_FACTORS, EPS, MotionSeries, MotionStart, expand_motion

# Largest term that is treated as round-off, relative to the sum of the
# magnitudes from which it results.
NOISE_TOL = 64 * EPS
# Factor on NOISE_TOL in a second attempt, which nearly dependent interfaces need.
LOOSE_NOISE_FACTOR = 1e4
# Maximum number of power-series terms that decide between stick and
# slip; later terms are round-off.
MAX_DECIDING_ORDER = 8
# Maximum number of resting interfaces for which all combinations (at most 81) are tried before exchanges.
MAX_ENUMERATED_FIRST = 4
# Maximum number of resting interfaces for which all combinations (at most 6561) are tried.
MAX_ENUMERATED = 8
# Maximum number of exchanges per interface; solvable cases need fewer.
MAX_EXCHANGES_PER_INTERFACE = 8
# Maximum number of sweeps of Jacobi rotations; about five suffice.
MAX_JACOBI_SWEEPS = 40
# Largest length of an orthogonalised row that is linearly dependent, relative to the longest row.
DEPENDENT_TOL = 1e-10
# Largest length of the projected row of an interface, relative to its full row, at which the other
# sticking interfaces prevent its motion.
TIED_TOL = 1e-9


@njit(**NJIT_KERNEL)
def orthogonalise_rows(modal_system, workspace):
    """Orthogonalise the participation rows of the sticking interfaces.

    Return the length of the longest orthogonal row.

    Returns the length of the longest.

    One-sided Jacobi rotations; constraint.basis = matrix interfaces.
    """
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    for f in range(n_interfaces):
        for i in range(n):
            constraint.basis[f, i] = (
                modal_system.interfaces[f, i] if constraint.is_sticking[f] == 1.0 else 0.0
            )
        for g in range(n_interfaces):
            constraint.matrix[f, g] = 1.0 if f == g else 0.0
    for _ in range(
        MAX_JACOBI_SWEEPS if constraint.status[ConstraintStatus.N_STICKING] > 1.0 else 0
    ):
        is_orthogonal = True
        for f in range(n_interfaces):
            for g in range(f + 1, n_interfaces):
                a = 0.0
                b = 0.0
                c = 0.0
                for i in range(n):
                    a += constraint.basis[f, i] ** 2
                    b += constraint.basis[g, i] ** 2
                    c += constraint.basis[f, i] * constraint.basis[g, i]
                if abs(c) <= EPS * sqrt(a * b):
                    continue
                is_orthogonal = False
                cotangent = (b - a) / (2 * c)
                tangent = (1.0 if cotangent >= 0 else -1.0) / (
                    abs(cotangent) + sqrt(1 + cotangent * cotangent)
                )
                cosine = 1 / sqrt(1 + tangent * tangent)
                for i in range(n):
                    p = constraint.basis[f, i]
                    q = constraint.basis[g, i]
                    constraint.basis[f, i] = cosine * (p - tangent * q)
                    constraint.basis[g, i] = cosine * (tangent * p + q)
                for h in range(n_interfaces):
                    p = constraint.matrix[f, h]
                    q = constraint.matrix[g, h]
                    constraint.matrix[f, h] = cosine * (p - tangent * q)
                    constraint.matrix[g, h] = cosine * (tangent * p + q)
        if is_orthogonal:
            break
    max_square = 0.0
    for f in range(n_interfaces):
        size = 0.0
        for i in range(n):
            size += constraint.basis[f, i] ** 2
        max_square = max(max_square, size)
    return sqrt(max_square)


@njit(**NJIT_KERNEL)
def constrain_slides(modal_system, workspace):
    """Build the constraint on the modes by the sticking interfaces.

    It fills basis, inverse, is_tied and status of `modal_system.Constraint`.
    """
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    count = 0.0
    for f in range(n_interfaces):
        count += constraint.is_sticking[f]
        constraint.is_tied[f] = 0.0
        for i in range(n):
            constraint.inverse[f, i] = 0.0
    constraint.status[ConstraintStatus.N_STICKING] = count
    constraint.status[ConstraintStatus.IS_IMMOBILE] = 0.0
    if count == 0.0:
        return
    max_length = orthogonalise_rows(modal_system, workspace)
    for p in range(n_interfaces):
        size = 0.0
        for i in range(n):
            size += constraint.basis[p, i] ** 2
        if sqrt(size) <= DEPENDENT_TOL * max_length:
            for i in range(n):
                constraint.basis[p, i] = 0.0
            continue
        for q in range(n_interfaces):
            if constraint.is_sticking[q] == 1.0:
                for i in range(n):
                    constraint.inverse[q, i] += (
                        constraint.matrix[p, q] * constraint.basis[p, i] / size
                    )
    mobility = 0.0 if count >= n else 1.0
    if count >= n:
        for i in range(n):
            for j in range(n):
                remainder = 1.0 if i == j else 0.0
                for f in range(n_interfaces):
                    remainder -= constraint.inverse[f, i] * modal_system.interfaces[f, j]
                mobility = max(mobility, abs(remainder))
    if mobility < TIED_TOL:
        constraint.status[ConstraintStatus.IS_IMMOBILE] = 1.0
    for f in range(n_interfaces):
        gap = 0.0
        size = 0.0
        for j in range(n):
            remainder = modal_system.interfaces[f, j]
            for g in range(n_interfaces):
                along = 0.0
                for i in range(n):
                    along += modal_system.interfaces[f, i] * constraint.inverse[g, i]
                remainder -= along * modal_system.interfaces[g, j]
            gap += remainder * remainder
            size += modal_system.interfaces[f, j] ** 2
        if constraint.status[ConstraintStatus.IS_IMMOBILE] == 1.0 or gap < TIED_TOL**2 * size:
            constraint.is_tied[f] = 1.0


@njit(**NJIT_KERNEL)
def remove_sticking_rates(rates, modal_system, workspace):
    """Remove the part of modal rates that moves the sticking interfaces.

    Parameters
    ----------
    rates : ndarray
        (n,) modal rates [m/s], which are changed.
    modal_system : ModalSystem
    workspace : Workspace
    """
    constraint = workspace.constraint
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    if constraint.status[ConstraintStatus.IS_IMMOBILE] == 1.0:
        for i in range(n):
            rates[i] = 0.0
        return
    for f in range(n_interfaces):
        constraint.scratch[0, f] = 0.0
        for i in range(n):
            constraint.scratch[0, f] += modal_system.interfaces[f, i] * rates[i]
    for f in range(n_interfaces):
        for i in range(n):
            rates[i] -= constraint.inverse[f, i] * constraint.scratch[0, f]


@njit(**NJIT_KERNEL)
def correct_sticking_slides(run):
    """Remove the round-off motion of sticking interfaces from modal coordinates and rates.

    Parameters
    ----------
    run : RunArrays
    """
    motion = run.motion
    modal_system = run.modal_system
    workspace = run.workspace
    constraint = workspace.constraint
    n_interfaces = len(modal_system.inverse_mass)
    if (
        constraint.status[ConstraintStatus.N_STICKING] == 0.0
        or constraint.status[ConstraintStatus.IS_IMMOBILE] == 1.0
    ):
        return
    n = len(modal_system.omega_squared)
    remove_sticking_rates(motion[1], modal_system, workspace)
    for f in range(n_interfaces):
        constraint.scratch[0, f] = run.memory.slide[f]
        for i in range(n):
            constraint.scratch[0, f] -= modal_system.interfaces[f, i] * motion[0, i]
    for f in range(n_interfaces):
        for i in range(n):
            motion[0, i] += constraint.inverse[f, i] * constraint.scratch[0, f]


@njit(**NJIT_KERNEL)
def estimate_round_off(h, run):
    """Estimate the magnitudes whose round-off limits the terms of motion and reactions.

    Parameters
    ----------
    h : float
        Duration of the piece [s].
    run : RunArrays
        Its choice.motion_sizes (MAX_DECIDING_ORDER + 2, n) and choice.reaction_sizes (i, MAX_DECIDING_ORDER) are
        written.
    """
    motion = run.motion
    springs = run.workspace.stiffness
    modal_system = run.modal_system
    workspace = run.workspace
    choice = workspace.choice
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    interfaces = modal_system.interfaces
    h_squared = h * h
    drive = workspace.drive[0]
    for i in range(n):
        choice.motion_sizes[0, i] = abs(motion[0, i])
        choice.motion_sizes[1, i] = abs(h * motion[1, i])
    for k in range(MAX_DECIDING_ORDER):
        scale = DOUBLE_INTEGRAL_FACTORS[k + 2] * h_squared
        damp = DOUBLE_INTEGRAL_FACTORS[k + 2] * h * (k + 1)
        for f in range(n_interfaces):
            workspace.friction_accel[f] = 0.0
            if springs[f] < RIGID_STIFFNESS and k == 0:
                workspace.friction_accel[f] = abs(run.memory.force[f]) / modal_system.mass
            elif springs[f] < RIGID_STIFFNESS:
                for i in range(n):
                    workspace.friction_accel[f] += (
                        abs(interfaces[f, i])
                        * choice.motion_sizes[k, i]
                        * springs[f]
                        / modal_system.mass
                    )
        for i in range(n):
            size = modal_system.omega_squared[i] * choice.motion_sizes[k, i] + abs(
                modal_system.base[i] * drive[k]
            )
            damped = 0.0
            for f in range(n_interfaces):
                size += abs(interfaces[f, i]) * workspace.friction_accel[f]
            for j in range(n):
                damped += abs(modal_system.damping[i, j]) * choice.motion_sizes[k + 1, j]
            choice.motion_sizes[k + 2, i] = scale * size + damp * damped
        if workspace.constraint.status[ConstraintStatus.N_STICKING] == 0.0:
            continue
        for f in range(n_interfaces):
            choice.reaction_sizes[f, k] = 0.0
            for i in range(n):
                choice.reaction_sizes[f, k] += (
                    abs(workspace.constraint.inverse[f, i]) * choice.motion_sizes[k + 2, i]
                )
        for f in range(n_interfaces):
            for i in range(n):
                choice.motion_sizes[k + 2, i] += abs(interfaces[f, i]) * choice.reaction_sizes[f, k]
            choice.reaction_sizes[f, k] *= modal_system.mass / scale


@njit(**NJIT_KERNEL)
def find_leading_slip_term(interface, sign, noise, modal_system, workspace):
    """Find the first term of the slip velocity of an interface above round-off.

    Parameters
    ----------
    interface : int
    sign : float
        Sign of the slip.
    noise : float
        Fraction of the sum of magnitudes of a term, below which the term is round-off.
    modal_system : ModalSystem
    workspace : Workspace

    Returns
    -------
    order : float
        MAX_DECIDING_ORDER if there is none.
    sign : float
        0 if there is none.
    """
    for k in range(1, MAX_DECIDING_ORDER):
        rate = 0.0
        size = 0.0
        for i in range(len(modal_system.omega_squared)):
            rate += modal_system.interfaces[interface, i] * workspace.coefficients[k + 1, i]
            size += (
                abs(modal_system.interfaces[interface, i]) * workspace.choice.motion_sizes[k + 1, i]
            )
        if abs(rate) > noise * size:
            return float(k), 1.0 if sign * rate > 0 else -1.0
    return float(MAX_DECIDING_ORDER), 0.0


@njit(**NJIT_KERNEL)
def find_leading_margin_term(interface, side, noise, limit, workspace):
    """Find the first term above round-off of the margin between reaction and limit.

    The margin is limit - side times reaction.

    Parameters
    ----------
    interface : int
    side : int
        Sign of the reaction, 1 or -1.
    noise : float
        Fraction of the sum of magnitudes of a term, below which the term is round-off.
    limit : float
        Limit of the reaction [N].
    workspace : Workspace

    Returns
    -------
    order : float
        MAX_DECIDING_ORDER if there is none.
    sign : float
        0 if there is none.
    """
    for k in range(MAX_DECIDING_ORDER):
        gap = -side * workspace.constraint.reactions[interface, k]
        size = workspace.choice.reaction_sizes[interface, k]
        if k == 0:
            gap = gap + limit
            size = size + limit
        if abs(gap) > noise * size:
            return float(k), 1.0 if gap > 0 else -1.0
    return float(MAX_DECIDING_ORDER), 0.0


@njit(**NJIT_KERNEL)
def find_violation(noise, h, run):
    """Return the first interface whose guess violates Coulomb's law, and the kind of violation.

    Interfaces in choice.is_resting have no velocity. The memory, force and stiffness are left as
    they are under the guess, and choice.orders as the search for the next event needs them.

    Returns
    -------
    interface : int
        -1 if all interfaces obey.
    side : int
        1 or -1: overloaded in this direction; 0: it does not move in the direction of its slip.
    """
    motion = run.motion
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    workspace = run.workspace
    choice = workspace.choice
    n_interfaces = len(modal_system.inverse_mass)
    for f in range(n_interfaces):
        workspace.constraint.is_sticking[f] = (
            1.0 if table.static_limit[f] > 0.0 and choice.guess[f] == 0.0 else 0.0
        )
    constrain_slides(modal_system, workspace)
    for f in range(n_interfaces):
        if table.static_limit[f] > 0.0:
            is_held_by_others = (
                choice.guess[f] != 0.0
                and workspace.constraint.is_tied[f] == 1.0
                and choice.is_resting[f] == 1.0
            )
            memory.rigid_state[f] = 2.0 * choice.guess[f] if is_held_by_others else choice.guess[f]
        memory.force[f] = interface_force(f, table, memory)
        workspace.stiffness[f] = find_tangent(f, table, memory).stiffness
        choice.orders[f, 0] = 0.0
        choice.orders[f, 1] = 0.0
    start = MotionStart(motion[0], motion[1], memory.force)
    series = MotionSeries(workspace.drive[0], workspace.coefficients)
    expand_motion(start, series, h, MAX_DECIDING_ORDER + 1, modal_system, workspace)
    estimate_round_off(h, run)
    for f in range(n_interfaces):
        if (
            choice.is_resting[f] == 0.0
            or table.static_limit[f] == 0.0
            or abs(memory.rigid_state[f]) == 2.0
        ):
            continue
        if memory.rigid_state[f] != 0.0:
            order, sign = find_leading_slip_term(
                f, memory.rigid_state[f], noise, modal_system, workspace
            )
            if sign <= 0.0:
                return f, 0
            choice.orders[f, 0] = order
            continue
        for side in (1, -1):
            order, sign = find_leading_margin_term(f, side, noise, table.static_limit[f], workspace)
            if sign < 0.0:
                return f, side
            if sign > 0.0:
                choice.orders[f, (1 - side) // 2] = order
    return -1, 0


@njit(**NJIT_KERNEL)
def choose_by_exchange(noise, h, run):
    """Choose the sticking interfaces by repeatedly exchanging the first that violates Coulomb's law.

    The iteration ends when no interface violates the law.

    This is the rule of least index (Murty, Opsearch 11, 148, 1974). It ends with the only solution
    wherever the complementarity problem has a P-matrix, also over power series in time, which are
    ordered by their first term. That is the case for independent interfaces that break at their
    kinetic limit. Of 1800 random choices among 5 to 16 interfaces at rest, it and
    `choose_by_enumeration` together missed 26, all of more than eight interfaces of fewer modes.

    Parameters
    ----------
    noise : float
        Fraction of the sum of magnitudes of a term, below which the term is round-off.
    h : float
        Duration of the piece [s].
    run : RunArrays

    Returns
    -------
    bool
        Whether a choice was found.
    """
    for _ in range(MAX_EXCHANGES_PER_INTERFACE * len(run.modal_system.inverse_mass)):
        interface, side = find_violation(noise, h, run)
        if interface < 0:
            return True
        run.workspace.choice.guess[interface] = float(side)
    return False


@njit(**NJIT_KERNEL)
def choose_by_enumeration(noise, h, run):
    """Choose the sticking interfaces by trying all combinations, those with few slipping first.

    Parameters
    ----------
    noise : float
        Fraction of the sum of magnitudes of a term, below which the term is round-off.
    h : float
        Duration of the piece [s].
    run : RunArrays

    Returns
    -------
    bool
        Whether one satisfies the law.
    """
    choice = run.workspace.choice
    n_interfaces = len(run.modal_system.inverse_mass)
    n_resting = 0
    n_codes = 1
    for f in range(n_interfaces):
        if choice.is_resting[f] == 1.0:
            n_resting = n_resting + 1
            n_codes = n_codes * 3
    for n_wanted in range(n_resting + 1):
        for code in range(n_codes):
            digits = code
            n_slipping = 0
            for f in range(n_interfaces - 1, -1, -1):
                choice.guess[f] = choice.slip_signs[f]
                if choice.is_resting[f] == 1.0:
                    digit = digits % 3
                    choice.guess[f] = -1.0 if digit == 2 else float(digit)
                    digits = digits // 3
                    n_slipping = n_slipping + (digit > 0)
            if n_slipping == n_wanted and find_violation(noise, h, run)[0] < 0:
                return True
    return False


@njit(**NJIT_KERNEL)
def choose_sticks(h, run):
    """Choose which interfaces stick and which slip just after an event.

    Parameters
    ----------
    h : float
        Duration [s] of the piece whose drive is in workspace.drive[0].
    run : RunArrays

    Returns
    -------
    bool
        Whether a choice was found. The rates of sticking interfaces are removed from the motion.
    """
    modal_system = run.modal_system
    workspace = run.workspace
    choice = workspace.choice
    constraint = workspace.constraint
    n_interfaces = len(modal_system.inverse_mass)
    count = 0
    for f in range(n_interfaces):
        constraint.is_sticking[f] = choice.is_resting[f]
    constrain_slides(modal_system, workspace)
    if constraint.status[ConstraintStatus.N_STICKING] > 0.0:
        remove_sticking_rates(run.motion[1], modal_system, workspace)
    for f in range(n_interfaces):
        if run.table.static_limit[f] > 0.0 and constraint.is_tied[f] == 1.0:
            choice.is_resting[f] = 1.0
        count += int(choice.is_resting[f])
    for noise in (NOISE_TOL, LOOSE_NOISE_FACTOR * NOISE_TOL):
        for f in range(n_interfaces):
            choice.guess[f] = choice.slip_signs[f]
        if find_violation(noise, h, run)[0] < 0:
            return True
        if count > MAX_ENUMERATED_FIRST and choose_by_exchange(noise, h, run):
            return True
        if count <= MAX_ENUMERATED and choose_by_enumeration(noise, h, run):
            return True
    return False


@njit(**NJIT_KERNEL)
def find_resting_interfaces(u, piece, run):
    """Find the interfaces with rigid elements that have no velocity at an instant.

    The instant is the fraction u of a time interval.

    They are those that stick and those whose speed is round-off; choice.is_resting and
    choice.slip_signs are written.

    Parameters
    ----------
    u : float
        Fraction of the piece.
    piece : Piece
    run : RunArrays
    """
    modal_system = run.modal_system
    table = run.table
    memory = run.memory
    workspace = run.workspace
    choice = workspace.choice
    for f in range(len(modal_system.inverse_mass)):
        state = memory.rigid_state[f]
        choice.slip_signs[f] = min(max(state, -1.0), 1.0)
        choice.is_resting[f] = 1.0 if table.static_limit[f] > 0.0 else 0.0
        if is_sticking(f, table, memory) or table.static_limit[f] == 0.0 or abs(state) == 2.0:
            continue
        speed = 0.0
        size = 0.0
        power = 1.0
        for k in range(1, piece.top + 1):
            for i in range(len(modal_system.omega_squared)):
                term = modal_system.interfaces[f, i] * workspace.coefficients[k, i] * (k * power)
                speed += term
                size += abs(term)
            power *= u
        if choice.slip_signs[f] * speed > NOISE_TOL * size:
            choice.is_resting[f] = 0.0
