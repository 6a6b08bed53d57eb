"""Motion of modes and ports in a step, whatever the laws of the points (compiled).

`system` is a `march_rows_kernels.System`; a step of level k lasts a whole step over 2^k.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from . import flanks_kernels as flanks
from .march_rows_kernels import LOWER, RESIDUAL, Flank, Port, Shear, Total
from .step_rows_kernels import Value

INCREMENT_ROUND_OFF = 4e-16  # round-off error of an increment relative to its size
# Weight of the residuals of normal contact, which loses no energy, so that they would add up over the steps
CONTACT_WEIGHT = 10.0
TINY_LOAD = 1e-300  # N, in place of no load


@njit(**NJIT_CALL)
def solve_linear(matrix, vector, n):
    """Solve a dense system in place by Gauss-Jordan elimination with partial pivoting; return whether it is regular.

    Parameters
    ----------
    matrix : (k, k) array
        Matrix; overwritten.
    vector : (k,) array
        Right side, and the solution afterwards.
    n : int
        Number of unknowns, the first of the arrays.
    """
    # Elimination; the pivot is the largest entry of the column.
    for k in range(n):
        best = k
        for i in range(k + 1, n):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if matrix[best, k] == 0.0:
            return False
        if best != k:
            for c in range(k, n):
                matrix[k, c], matrix[best, c] = matrix[best, c], matrix[k, c]
            vector[k], vector[best] = vector[best], vector[k]

        for i in range(n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0 and i != k:
                for c in range(k + 1, n):
                    matrix[i, c] -= factor * matrix[k, c]
                vector[i] -= factor * vector[k]

    for k in range(n):
        vector[k] /= matrix[k, k]
    return True


@njit(**NJIT_CALL)
def sum_products(first, second):
    """Return the sum of the products of the entries of two arrays."""
    total = 0.0
    for j in range(second.size):
        total += first[j] * second[j]
    return total


@njit(**NJIT_CALL)
def move_freely(system, level, drive, row, fraction):
    """Compute the motion in a step as if no interface acted: row 1 of `system.state`, and four rows of `Port`.

    SLIDE and VELOCITY are those of a port at the start of the step, FREE its increment [m] and FREE_VELOCITY its
    velocity [m/s] at the end without forces. If the displacement of port 0 is prescribed, these are the prescribed
    ones.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    drive : tuple of float
        Value, slope and second derivative of the drive at the start of the step [m s-2], per second and per second
        squared.
    row : int
        Number of the whole step.
    fraction : float
        Time at the start of the step, as a fraction of the whole step.
    """
    response = system.structure.responses.motion[level]
    state = system.state
    size = state.shape[1]
    n = size // 2
    values = system.ports.values

    path = system.structure.path
    if path.size:
        # The displacement of port 0 is prescribed, at a constant velocity in a step.
        slope = path[row + 1] - path[row]
        values[Port.SLIDE, 0] = path[row] + fraction * slope
        values[Port.FREE, 0] = slope / (1 << level)
        values[Port.VELOCITY, 0] = values[Port.FREE_VELOCITY, 0] = slope / system.options.step
        return
    inputs = system.structure.inputs
    for i in range(size):
        inputs[i] = state[0, i]
    for i in range(3):
        inputs[size + i] = drive[i]
    for i in range(size):
        state[1, i] = sum_products(response[i], inputs[: size + 3])

    rows = system.ports.rows
    for p in range(rows.shape[0]):
        values[Port.SLIDE, p] = sum_products(rows[p], state[0, :n])
        values[Port.VELOCITY, p] = sum_products(rows[p], state[0, n:])
        values[Port.FREE_VELOCITY, p] = sum_products(rows[p], state[1, n:])
        free = 0.0
        for i in range(n):
            free += rows[p, i] * (state[1, i] - state[0, i])
        values[Port.FREE, p] = free


@njit(**NJIT_CALL)
def write_trial(system, level):
    """Write the state at the end of the step under the port forces to row 2 of `system.state`.

    Modes are linear, so it is that without forces plus the responses to the modal forces, which complete the inputs of
    the step (`Structure.inputs`).
    """
    response = system.structure.responses.motion[level]
    inputs = system.structure.inputs
    state = system.state
    ports = system.ports
    size = state.shape[1]
    for k in range(size // 2):
        force = 0.0
        for p in range(ports.rows.shape[0]):
            force -= ports.rows[p, k] * ports.values[Port.FORCE, p]
        inputs[size + 3 + k] = force / system.options.mass
    for i in range(size):
        state[2, i] = state[1, i] + sum_products(response[i, size + 3 :], inputs[size + 3 :])


@njit(**NJIT_CALL)
def find_modal_energy(system):
    """Return the energy of the modes [J]."""
    state = system.state[0]
    n = state.size // 2
    energy = 0.0
    for i in range(n):
        energy += state[n + i] ** 2 + system.structure.modes[0, i] * state[i] ** 2
    return 0.5 * system.options.mass * energy


@njit(**NJIT_CALL)
def add_energies(system, level):
    """Add the work of the drive and the viscous loss of a step, and update the largest energy of the modes.

    Both are forms of `system.structure.inputs`: 2 n modal coordinates and velocities at the start of the step, value, slope
    and second derivative of the drive there, and n modal forces per mass. `Total.POWER` adds up |work| [J], the size to
    which the error of the energy balance is compared.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    """
    structure = system.structure
    totals = system.totals
    inputs = structure.inputs
    size = system.state.shape[1]

    # Work is bilinear in drive and inputs, loss quadratic in the inputs.
    work = 0.0
    for i in range(3):
        work += inputs[size + i] * sum_products(structure.responses.work[level, i], inputs)
    loss = 0.0
    for i in range(inputs.size):
        loss += inputs[i] * sum_products(structure.responses.loss[level, i], inputs)

    work -= totals[Total.REST]
    totals[Total.WORK_IN] += work
    totals[Total.POWER] += abs(work)
    totals[Total.VISCOUS] += loss
    totals[Total.STORED] = max(totals[Total.STORED], find_modal_energy(system))


@njit(**NJIT_CALL)
def interpolate_pressure(x, pattern):
    """Return the relative pressure of the lower piece at x [m]; 0 outside its nodes."""
    last = pattern.shape[1] - 1
    if x < pattern[0, 0] or x > pattern[0, last]:
        return 0.0
    high = min(max(np.searchsorted(pattern[0], x), 1), last)
    low = high - 1
    part = (x - pattern[0, low]) / (pattern[0, high] - pattern[0, low])
    return (1 - part) * pattern[1, low] + part * pattern[1, high]


@njit(**NJIT_CALL)
def move_ports(system, level):
    """Write increment and end velocity of the ports under the assumed forces `Port.FORCE`.

    With the compliances C and G the port p moves by INCREMENT = FREE_p - sum_k C_pk F_k, and ends with the velocity
    FREE_VELOCITY_p - sum_k G_pk F_k.
    """
    moves = system.ports.values
    compliance = system.ports.compliance[level]
    n_ports = moves.shape[1]
    for p in range(n_ports):
        dq = moves[Port.FREE, p]
        v = moves[Port.FREE_VELOCITY, p]
        for k in range(n_ports):
            dq -= compliance[0, p, k] * moves[Port.FORCE, k]
            v -= compliance[1, p, k] * moves[Port.FORCE, k]
        moves[Port.INCREMENT, p] = dq
        moves[Port.END_VELOCITY, p] = v


@njit(**NJIT_CALL)
def find_port_residual(system, level, size):
    """Return the largest residual of the ports over its tolerance.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; `ports.newton.residual` has the residuals [N].
    level : int
        Level of the step, which lasts a whole step over 2^level.
    size : float
        Largest force of a port [N].
    """
    ports = system.ports
    moves = ports.values
    heave = int(ports.contact[0])
    largest = 0.0
    for p in range(moves.shape[1]):
        own = ports.compliance[level, 0, p, p]
        noise = INCREMENT_ROUND_OFF * abs(moves[Port.FREE, p]) / own if own > 0 else 0.0
        weight = CONTACT_WEIGHT if p >= heave >= 0 else 1.0
        if own > 0 or p != 0 or not system.structure.path.size:
            largest = max(
                largest, weight * abs(ports.newton.residual[p]) / (RESIDUAL * size + noise)
            )
    return largest


@njit(**NJIT_CALL)
def subtract_step(system, fraction):
    """Subtract a fraction of Newton's step from port forces and shear increments, from their rows BASE."""
    ports = system.ports
    shear = system.points.pieces.shear
    n_ports = ports.values.shape[1]
    for p in range(n_ports):
        ports.values[Port.FORCE, p] = ports.values[Port.BASE, p] - fraction * ports.newton.step[p]
    for k in range(system.points.pieces.stiffness.size):
        shear[Shear.TRIAL, k] = shear[Shear.BASE, k] - fraction * ports.newton.step[n_ports + k]


@njit(**NJIT_CALL)
def store_base(system):
    """Copy port forces and shear increments to their rows BASE, from which a line search starts."""
    shear = system.points.pieces.shear
    moves = system.ports.values
    for p in range(moves.shape[1]):
        moves[Port.BASE, p] = moves[Port.FORCE, p]
    for k in range(system.points.pieces.stiffness.size):
        shear[Shear.BASE, k] = shear[Shear.TRIAL, k]


@njit(**NJIT_CALL)
def extrapolate_shear(points, dt):
    """Extrapolate the increments of the pieces in a step of `dt` [s] by a parabola through the last three steps."""
    shear = points.pieces.shear
    for k in range(points.pieces.stiffness.size):
        rate = 3 * (shear[Shear.LAST, k] - shear[Shear.EARLIER, k]) + shear[Shear.FIRST, k]
        shear[Shear.TRIAL, k] = dt * rate


@njit(**NJIT_CALL)
def advance_shear(points, dt):
    """Advance the shear coordinates by their increments in a step of `dt` [s], and store their mean rates."""
    shear = points.pieces.shear
    for k in range(points.pieces.stiffness.size):
        shear[Shear.VALUE, k] += shear[Shear.TRIAL, k]
        shear[Shear.FIRST, k] = shear[Shear.EARLIER, k]
        shear[Shear.EARLIER, k] = shear[Shear.LAST, k]
        shear[Shear.LAST, k] = shear[Shear.TRIAL, k] / dt


@njit(**NJIT_CALL)
def find_resultant(system, row, fraction, is_solved):
    """Return the load [N] at the end of a step that follows from a flank or from a prescribed history; 1 without one.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; the normal force of the flank is changed.
    row : int
        Number of the whole step.
    fraction : float
        Time at the end of the step, as a fraction of the whole step.
    is_solved : bool
        Whether the motion of the step is known.
    """
    flank = system.flank
    loads = system.structure.loads
    moves = system.ports.values
    if flank.size:
        if is_solved:
            q = moves[Port.SLIDE, 0] + moves[Port.INCREMENT, 0]
            flank[Flank.NORMAL] = flanks.find_normal(flank, q)
        return flank[Flank.NORMAL]
    return loads[row] + fraction * (loads[row + 1] - loads[row]) if loads.size else 1.0


@njit(**NJIT_CALL)
def find_point_load(points, index, x, resultant):
    """Return the load [N] of a point: its share of the resultant, its nodal force or the pressure of the lower piece.

    Parameters
    ----------
    points : Points
        Points of one of the marches.
    index : int or tuple of int
        Position of the point in the arrays `node` and `share`.
    x : float
        Place of the point [m].
    resultant : float
        Resultant [N].
    """
    node = points.loads.node[index]
    if node >= points.loads.nodal.size:
        return points.loads.averaged[node - points.loads.nodal.size]
    if node >= 0:
        return points.loads.nodal[node]
    if node == LOWER:
        return points.loads.share[index] * interpolate_pressure(x, points.loads.pressure)
    return points.loads.share[index] * resultant


@njit(**NJIT_CALL)
def pick_load(values, row, direction):
    """Return the load [N] of a rigid point that limits friction in a direction.

    Parameters
    ----------
    values : (k,) array
        Values of the block of the point.
    row : Value
        START_LOAD or END_LOAD.
    direction : float
        Sign of the motion.
    """
    return values[row + Value.START_BACK] if direction < 0 else values[row]


@njit(**NJIT_CALL)
def solve_holds(system, state, drive):
    """Write the forces that hold ports at rest at an instant to `Port.HOLD` [N].

    `ports.newton.residual` has the forces of the other ports.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    state : (2 n,) array
        Modal coordinates and velocities.
    drive : float
        Drive at this instant [m s-2].
    """
    ports = system.ports
    n_ports = ports.values.shape[1]

    # Ports at rest have no acceleration: grip . hold = acceleration without their forces.
    for p in range(n_ports):
        if ports.values[Port.HELD, p] > 0:
            ports.newton.residual[p] = find_pull(system, state, drive, p)

    solve_held(system)
    for p in range(n_ports):
        ports.values[Port.HOLD, p] = ports.newton.residual[p]


@njit(**NJIT_CALL)
def find_pull(system, state, drive, p):
    """Return the acceleration [m s-2] of port p without the forces on ports.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march.
    state : (2 n,) array
        Modal coordinates and velocities.
    drive : float
        Drive at this instant [m s-2].
    p : int
        Number of the port.
    """
    structure = system.structure
    n = structure.modes.shape[1]
    total = 0.0
    for i in range(n):
        acceleration = -structure.modes[1, i] * drive - structure.modes[0, i] * state[i]
        acceleration -= sum_products(structure.damping[i], state[n:])
        total += system.ports.rows[p, i] * acceleration
    return total


@njit(**NJIT_CALL)
def solve_held(system):
    """Solve grip . x = vector for the ports at rest, in place in `ports.newton.residual`.

    `grip` is the acceleration of ports per force. The entries of the other ports are given values of x.
    """
    ports = system.ports
    n_ports = ports.values.shape[1]
    for p in range(n_ports):
        is_held = ports.values[Port.HELD, p] > 0
        for k in range(n_ports):
            ports.newton.matrix[p, k] = ports.grip[p, k] if is_held else 0.0
        if is_held:
            ports.newton.matrix[p, p] *= 1 + ports.redundant[p]
        else:
            ports.newton.matrix[p, p] = 1.0
    solve_linear(ports.newton.matrix, ports.newton.residual, n_ports)


@njit(**NJIT_CALL)
def return_ports(system):
    """Bring ports at rest back to their places and to rest, by the smallest change of the modes.

    A constant force over the step only makes their velocity vanish at its end. `Port.RETURN` has their displacements.
    """
    ports = system.ports
    state = system.state[0]
    n = state.size // 2
    n_ports = ports.rows.shape[0]

    # Places and then velocities: grip . change = the deviation of the ports that hold.
    for first in (0, n):
        for p in range(n_ports):
            ports.newton.residual[p] = 0.0
            if ports.values[Port.HELD, p] > 0:
                ports.newton.residual[p] = ports.values[Port.RETURN, p]
                if first > 0:
                    ports.newton.residual[p] = sum_products(ports.rows[p], state[n:])

        solve_held(system)
        for p in range(n_ports):
            for i in range(n):
                change = ports.rows[p, i] * ports.newton.residual[p] / system.options.mass
                state[first + i] -= change
