"""Motion of modes with contact points under any law, by steps of order 2 (compiled).

Over a step the modes move exactly under a parabola of the drive and constant port forces F. With the increments
dq = free - C F and the velocities v = free - G F of the ports, and increments db of the shear coordinates of the pieces, a
point slides by ds = dq - d with d = shape . db, behind pieces at the velocity rate ds - lag ds_last. The unknowns F and db
solve

    F = sum over the points of (1 - w) mean + w (f0 + f1)/2,    kappa (b + db) = shapes^T f1

with the path means and the forces f0, f1 at both ends of the laws (`laws_kernels`), the stiffness kappa of the coordinates
and w = |d|/(|ds| + |d|). The pieces are in equilibrium at the end of a step, so that a law of the path alone is exact at the
samples of a monotone stroke, whatever the step. F dq is the work of the laws, sum mean ds, plus the change of the elastic
energy, where the pieces and the points behind them move the same way. Where a point moves against its piece, F dq differs
from this sum by 2 |ds d|/(|ds| + |d|) times (f0 + f1)/2 - mean, of order 3 in the step where the law is smooth.

Newton's method has the Jacobian in the space of ports and coordinates. With lists, and in steps of the last level, a
line search finds the minimum. A step that it does not solve is halved. Loads that follow from the motion (normal
contact under heave and pitch, flanks of grooves, pressure of the lower piece) are iterated with it. On soft pieces the
friction may fall with the slide over the lower piece more steeply than they relax; then there is no equilibrium next to
the last one, and the pieces snap. Steps of the last level take the pressure at their start, so that they always have a
solution and follow the snap. Where a step does not resolve the decay of the velocity of a port by the viscosity V of
its points, x = G V > 1, the weight 1 - 1/x goes to the end of the step, in the force and in the increment of the
points. A vibration on stiff points that the step does not resolve stays undamped, so that comparisons with fewer steps
show its error.

A rigid point (`Law.COULOMB`), the only one on its port, slips under a given force, or its port is held at rest. A step in
which a slipping port would reverse, or a port at rest is released, is halved up to the last level, and so is one in which
a port under the law "tanh" gains energy. At the end of such a step of the last level, the forces of all ports without
velocity decide together which of them rest (`settle`), because one that stops or slips changes the forces that hold the
others. The constant force of a step lets a held port move and come back. The work of this motion is taken from that of the
drive, as friction at rest does none.

`system` is a `march_rows_kernels.System` with `step_rows_kernels.Points`. A step of level k lasts a whole step over 2^k.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_CALL
from ..kernel_cache.jit import njit
from . import flanks_kernels as flanks
from . import laws_kernels as laws
from . import lists_kernels as lists
from . import normal_kernels as normal
from .march_rows_kernels import (
    N_PORT_COLUMNS,
    RESIDUAL,
    Flank,
    Port,
    Sample,
    Shear,
    Total,
)
from .motion_kernels import (
    TINY_LOAD,
    advance_shear,
    find_point_load,
    find_port_residual,
    find_pull,
    find_resultant,
    move_ports,
    pick_load,
    solve_linear,
    store_base,
    subtract_step,
    sum_products,
)
from .step_rows_kernels import VECTOR, WIDTH, Law, Step, Value

MAX_NEWTON_ITERATIONS = 60  # Newton iterations of a step
MAX_LOAD_ITERATIONS = (
    30  # trials of the normal force on a flank, whose change falls by mu times the slope in each
)
MAX_CUTS = 8  # trials of a line search
CUT = 0.3  # factor of a step by a trial of the line search
MAX_STALLS = 4  # iterations that do not halve the smallest residual, after which a step ends
# Largest residual of such a step relative to RESIDUAL, and that of lists, whose means have quadrature errors
STALLED = 1e3
LISTS_STALLED = 1e5
# Residual of lists relative to RESIDUAL: 1e-9 of the force, below the errors by which strips are joined
LISTS_RESIDUAL = 1e3
LIST_CUTS = 30  # trials of a line search for lists
LOAD_RESIDUAL = 1e-11  # change of the loads relative to the resultant
# Largest velocity of a port at rest, relative to the change by its friction in a whole step: ten times that by the largest
# compliance of ports that share a force (`systems.REDUNDANT`)
CREEP = 1e-7
MAX_PIVOTS = 100  # changes of ports between rest and slip at an instant
MAX_OVERLOAD = 1e-9  # relative excess over the static friction that is attributed to round-off
TINY = 1e-150  # m, in place of no path; its square is not zero


@njit(**NJIT_CALL)
def place_block(system, block, move, velocity, step):
    """Write the slides of a block of points and their velocities at the end for an increment of their port.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; the block is changed.
    block : int
        Number of the block.
    move : float
        Increment of the port, along the flank of a groove [m].
    velocity : float
        Velocity of the port at the end [m/s].
    step : Step
        Formula of the velocity.
    """
    points = system.points
    values = points.values[block]
    port = points.blocks.port[block]
    n_lanes = count_lanes(points, block)
    start = points.pieces.shears[port, 0]
    stop = points.pieces.shears[port, 1]
    for j in range(n_lanes):
        values[Value.BENT + j] = 0.0
        values[Value.SLIDE + j] = move
        values[Value.VELOCITY + j] = velocity
    if start == stop:
        return

    # The pieces take a part of the increment by shear.
    at = WIDTH * block
    for k in range(start, stop):
        shape = points.pieces.shapes[k]
        increment = points.pieces.shear[Shear.TRIAL, k]
        for j in range(n_lanes):
            values[Value.BENT + j] += shape[at + j] * increment
    for j in range(n_lanes):
        slide = move - values[Value.BENT + j]
        values[Value.SLIDE + j] = slide
        values[Value.VELOCITY + j] = step.rate * slide - step.lag * values[Value.LAST_SLIDE + j]


@njit(**NJIT_CALL)
def slide_block(system, block, step):
    """Write forces and slopes of a block of points at their slides and loads.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; the block is changed.
    block : int
        Number of the block.
    step : Step
        Duration and formula of the velocity.
    """
    points = system.points
    values = points.values[block]
    numbers = points.numbers[block]
    count = points.blocks.count[block]
    law = points.blocks.law[block]
    if law == Law.LIST:
        lists.slide_lists(system.points.lists, numbers, values, count, step)
    else:
        laws.slide_points(
            law, numbers, points.memory[block], points.trial[block], values, count, step
        )


@njit(**NJIT_CALL)
def weigh_block(points, block, damping, step):
    """Write the mean forces of a block of points on their port, and the slopes of these forces.

    Parameters
    ----------
    points : step_rows_kernels.Points
        Points; the block is changed.
    block : int
        Number of the block.
    damping : float
        Weight of the force at the end in the mean force.
    step : Step
        Formula of the velocity.
    """
    values = points.values[block]
    port = points.blocks.port[block]
    n_lanes = count_lanes(points, block)
    rest = 1 - damping
    if points.pieces.shears[port, 0] == points.pieces.shears[port, 1]:
        for j in range(n_lanes):
            end = damping * values[Value.END + j]
            values[Value.FORCE + j] = end + rest * values[Value.MEAN + j]
            end = damping * values[Value.END_BY_SLIDE + j]
            values[Value.BY_SLIDE + j] = end + rest * values[Value.MEAN_BY_SLIDE + j]
            end = damping * values[Value.END_BY_VELOCITY + j]
            values[Value.BY_VELOCITY + j] = end + rest * values[Value.MEAN_BY_VELOCITY + j]
        return

    # Behind pieces it is the path mean over the part that slides, and the mean of both ends over the part of the pieces.
    for j in range(n_lanes):
        slide = values[Value.SLIDE + j]
        bent = values[Value.BENT + j]
        path = abs(slide) + abs(bent) + TINY
        part = abs(bent) / path
        half = 0.5 * (values[Value.START + j] + values[Value.END + j])
        mean = values[Value.MEAN + j]
        force = damping * values[Value.END + j] + rest * mean + rest * part * (half - mean)
        values[Value.FORCE + j] = force

        # Derivatives by the increment of the port and by that of the pieces. The derivative of `part` is that of
        # |bent| / (|slide| + |bent|), a sign times |slide| or |bent| over the square of the path.
        by_part = rest * (half - mean) / (path * path)
        slide_sign = 1.0 if slide > 0 else -1.0
        bent_sign = 1.0 if bent > 0 else -1.0
        end_slope = values[Value.END_BY_SLIDE + j] + step.rate * values[Value.END_BY_VELOCITY + j]
        slope = values[Value.MEAN_BY_SLIDE + j] + step.rate * values[Value.MEAN_BY_VELOCITY + j]
        slope = rest * (1 - part) * slope + (damping + 0.5 * rest * part) * end_slope
        values[Value.BY_SLIDE + j] = slope - by_part * abs(bent) * slide_sign
        values[Value.BY_SHEAR + j] = (
            by_part * (bent_sign * abs(slide) + slide_sign * abs(bent)) - slope
        )
        values[Value.BY_VELOCITY + j] = 0.0


@njit(**NJIT_CALL)
def place_points(system, level, step):
    """Write increments and velocities of ports and points under the assumed forces and shear increments.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.
    """
    points = system.points
    flank = system.flank
    moves = system.ports.values
    move_ports(system, level)
    for p in range(moves.shape[1]):
        dq = moves[Port.INCREMENT, p]
        damping = moves[Port.DAMPING, p]
        if damping > 0.0:
            dq = (1 - damping) * dq + damping * step.duration * moves[Port.END_VELOCITY, p]
        moves[Port.MOVE, p] = dq
    if flank.size:
        flanks.climb(flank, moves[Port.SLIDE, 0], moves[Port.MOVE, 0], step.duration)

    # The points of a groove slide along its flank.
    for p in range(moves.shape[1]):
        ratio = flank[Flank.RATIO] if flank.size and p == 0 else 1.0
        move = ratio * moves[Port.MOVE, p]
        velocity = ratio * moves[Port.END_VELOCITY, p]
        for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
            place_block(system, block, move, velocity, step)


@njit(**NJIT_CALL)
def write_forces(system, level, step):
    """Compute increments and forces of ports and points under the assumed forces `Port.FORCE` and shear increments.

    Loads that follow from the motion are those of these increments. Where they follow from forces of points, they are those
    of the trial before.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.

    Returns
    -------
    float
        Change of the loads since the trial before, relative to the resultant; -1 without a contact set.
    """
    points = system.points
    moves = system.ports.values
    flank = system.flank
    place_points(system, level, step)
    change = 0.0
    has_places = points.loads.pressure.size and not is_shortest(system, level)
    if system.ports.contact[0] >= 0 or flank.size or has_places:
        change = find_loads(system, 0, 0.0, True)
        if change < 0:
            return change

    for p in range(moves.shape[1]):
        force = 0.0
        by_slide = 0.0
        by_velocity = 0.0
        for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
            if points.blocks.law[block] == Law.COULOMB:
                force = slip_rigidly(system, p, block)
                continue
            slide_block(system, block, step)
            weigh_block(points, block, moves[Port.DAMPING, p], step)
            force += sum_points(points, block, Value.FORCE)
            by_slide += sum_points(points, block, Value.BY_SLIDE)
            by_velocity += sum_points(points, block, Value.BY_VELOCITY)
        moves[Port.SUM, p] = force
        moves[Port.BY_SLIDE, p] = by_slide
        moves[Port.BY_VELOCITY, p] = by_velocity

    if flank.size:
        end = 0.0
        for block in range(points.blocks.first[1]):
            end += sum_points(points, block, Value.END)
        flanks.add_climb(flank, moves, moves[Port.MOVE, 0], step.duration, end)
        moves[Port.BY_VELOCITY, 0] *= flank[Flank.RATIO] ** 2
    if system.structure.path.size:
        moves[Port.FORCE, 0] = moves[Port.SUM, 0]
    # Loads of nodes, and of places on the lower piece, are consistent with the slides of this trial.
    return change if flank.size else 0.0


@njit(**NJIT_CALL)
def slip_rigidly(system, p, block):
    """Return the friction [N] of the rigid point of port p, 0 for a port at rest.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    p : int
        Number of the port.
    block : int
        Number of the block of the point.
    """
    points = system.points
    values = points.values[block]
    if system.structure.path.size:
        points.trial[block, 0] = np.sign(system.ports.values[Port.INCREMENT, p])
    direction = points.trial[block, 0]
    load = 0.5 * (
        pick_load(values, Value.START_LOAD, direction)
        + pick_load(values, Value.END_LOAD, direction)
    )
    values[Value.FORCE] = points.trial[block, 0] * points.numbers[block, WIDTH] * load
    return values[Value.FORCE]


@njit(**NJIT_CALL)
def write_residual(system, level):
    """Compute the residuals [N] of port forces and shear coordinates; return the largest one over its tolerance.

    `ports.newton.residual` receives first the residuals of the ports, then those of the shear coordinates.
    """
    ports = system.ports
    points = system.points
    moves = ports.values
    vector = ports.newton.residual
    n_ports = moves.shape[1]
    size = system.options.scale
    for p in range(n_ports):
        vector[p] = moves[Port.SUM, p] - moves[Port.FORCE, p]
        size = max(size, abs(moves[Port.FORCE, p]))
    if ports.contact[0] >= 0:
        size = max(size, normal.add_residuals(system))

    # A port that is held has the velocity 0 at the end: its residual is the force that would stop it. Ports that one mode
    # holds together share their force by the small compliance `redundant`.
    for p in range(n_ports):
        if moves[Port.HELD, p] > 0:
            vector[p] = moves[Port.END_VELOCITY, p] / ports.compliance[level, 1, p, p]
            vector[p] -= ports.redundant[p] * moves[Port.FORCE, p]
    largest = find_port_residual(system, level, size)

    # kappa (b + db) = shapes^T f1
    shear = points.pieces.shear
    for k in range(points.pieces.stiffness.size):
        residual = shear[Shear.VALUE, k] + shear[Shear.TRIAL, k]
        residual *= points.pieces.stiffness[k]
        for block in range(points.pieces.bent[k, 0], points.pieces.bent[k, 1]):
            residual -= sum_shape(points, k, block, Value.END)
        vector[n_ports + k] = residual
        largest = max(largest, abs(residual) * shear[Shear.SCALE, k] / (RESIDUAL * size))
    return largest


@njit(**NJIT_CALL)
def count_lanes(points, block):
    """Return the number of points of a block, rounded up to whole vectors."""
    return (points.blocks.count[block] + VECTOR - 1) // VECTOR * VECTOR


@njit(**NJIT_CALL)
def sum_points(points, block, row):
    """Return the sum over the points of a block of one of their values.

    Parameters
    ----------
    points : step_rows_kernels.Points
        Points.
    block : int
        Number of the block.
    row : Value
        Row of the values.
    """
    values = points.values[block]
    total = 0.0
    for j in range(count_lanes(points, block)):
        total += values[row + j]
    return total


@njit(**NJIT_CALL)
def sum_shape(points, k, block, row):
    """Return the sum over a block of the shape of shear coordinate k times a row of `Value`.

    Parameters
    ----------
    points : step_rows_kernels.Points
        Points.
    k : int
        Number of the shear coordinate.
    block : int
        Number of the block.
    row : Value
        Row of the values.
    """
    shape = points.pieces.shapes[k]
    values = points.values[block]
    at = WIDTH * block
    n_lanes = count_lanes(points, block)
    total = 0.0
    for j in range(n_lanes):
        total += shape[at + j] * values[row + j]
    return total


@njit(**NJIT_CALL)
def write_matrix(system, level, step):
    """Write the Jacobian of the residuals of a step to `ports.newton.matrix`.

    A force at port k reduces the increment of port p by C_pk and its velocity at the end of the step by G_pk.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.
    """
    ports = system.ports
    points = system.points
    moves = ports.values
    matrix = ports.newton.matrix
    compliance = ports.compliance[level]
    n_ports = moves.shape[1]
    matrix[:] = 0.0
    for k in range(points.pieces.stiffness.size):
        matrix[n_ports + k, n_ports + k] = points.pieces.stiffness[k]
    for p in range(n_ports):
        damping = moves[Port.DAMPING, p]
        start = points.pieces.shears[p, 0]
        stop = points.pieces.shears[p, 1]
        ratio = system.flank[Flank.RATIO] if system.flank.size and p == 0 else 1.0
        if start < stop:
            write_products(points, p, matrix, n_ports, step)
        for k in range(n_ports):
            move = (1 - damping) * compliance[0, p, k]
            move += damping * step.duration * compliance[1, p, k]
            v = compliance[1, p, k]
            matrix[p, k] = -moves[Port.BY_SLIDE, p] * move - moves[Port.BY_VELOCITY, p] * v
            for l in range(start, stop):
                matrix[n_ports + l, k] += ratio * points.pieces.products[l, 0] * move
        for l in range(start, stop):
            matrix[p, n_ports + l] = ratio * points.pieces.products[l, 1]
        matrix[p, p] -= 1.0

    if ports.contact[0] >= 0:
        normal.add_slopes(system, level)

    # Ports that hold have the derivative of their end velocity in place of that of a force. A small compliance of their
    # own makes the forces unique where more ports hold than there are modes.
    for p in range(n_ports):
        if moves[Port.HELD, p] > 0:
            for k in range(n_ports):
                matrix[p, k] = -compliance[1, p, k] / compliance[1, p, p]
            matrix[p, p] -= ports.redundant[p]


@njit(**NJIT_CALL)
def write_products(points, p, matrix, n_ports, step):
    """Add the derivatives of the residuals of the shear coordinates of port p.

    Those by the coordinates are added to `matrix`; those by the increment of the port, and of the port force by the
    coordinates, are written to `points.pieces.products`.

    Parameters
    ----------
    points : step_rows_kernels.Points
        Points; `products` and the row WEIGHTED of the values are overwritten.
    p : int
        Number of the port.
    matrix : (n, n) array
        Jacobian, output.
    n_ports : int
        Number of ports, the first unknowns.
    step : Step
        Formula of the velocity.
    """
    start = points.pieces.shears[p, 0]
    stop = points.pieces.shears[p, 1]
    for k in range(start, stop):
        points.pieces.products[k, 0] = 0.0
        points.pieces.products[k, 1] = 0.0
    for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
        values = points.values[block]
        at = WIDTH * block
        n_lanes = count_lanes(points, block)
        for k in range(start, stop):
            shape = points.pieces.shapes[k]
            by_slide = 0.0
            by_shear = 0.0
            for j in range(n_lanes):
                slope = values[Value.END_BY_SLIDE + j]
                slope += step.rate * values[Value.END_BY_VELOCITY + j]
                weighted = shape[at + j] * slope
                values[Value.WEIGHTED + j] = weighted
                by_slide += weighted
                by_shear += shape[at + j] * values[Value.BY_SHEAR + j]
            points.pieces.products[k, 0] += by_slide
            points.pieces.products[k, 1] += by_shear
            for l in range(start, k + 1):
                other = points.pieces.shapes[l]
                total = 0.0
                for j in range(n_lanes):
                    total += other[at + j] * values[Value.WEIGHTED + j]
                matrix[n_ports + k, n_ports + l] += total
    for k in range(start, stop):
        for l in range(start, k):
            matrix[n_ports + l, n_ports + k] = matrix[n_ports + k, n_ports + l]


@njit(**NJIT_CALL)
def write_balanced_forces(system, level, step):
    """Compute increments and forces, and iterate the normal force on a flank with them.

    On a steep flank the normal force depends on the friction of all points. Newton's Jacobian has no derivative of it.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.

    Returns
    -------
    float
        Change of the loads since the trial before, relative to the resultant; -1 without a contact set.
    """
    change = write_forces(system, level, step)
    if system.flank.size:
        for _ in range(MAX_LOAD_ITERATIONS):
            if change <= LOAD_RESIDUAL:
                break
            change = write_forces(system, level, step)
    return change


@njit(**NJIT_CALL)
def solve_forces(system, level, step):
    """Solve the port forces `Port.FORCE` and shear increments `Shear.TRIAL` by Newton's method; return whether it did.

    It starts from the present values of these rows.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.
    """
    change = write_balanced_forces(system, level, step)
    if change < 0:
        return False
    residual = max(write_residual(system, level), change / LOAD_RESIDUAL)
    smallest = residual
    n_stalls = 0
    has_lists = system.options.has_lists > 0
    has_potential = has_lists or (is_shortest(system, level) and not system.options.has_events)
    stalled = LISTS_STALLED if has_lists else STALLED
    solved = LISTS_RESIDUAL if has_lists else 1.0
    for _ in range(MAX_NEWTON_ITERATIONS):
        if residual <= solved or (n_stalls >= MAX_STALLS and residual <= stalled):
            return True
        system.totals[Total.ITERATIONS] += 1
        if not find_newton_step(system, level, step):
            return False
        descent = -find_potential_slope(system, level)
        if has_potential and descent < 0:
            drop_negative_slopes(system)
            if not find_newton_step(system, level, step):
                return False
            descent = -find_potential_slope(system, level)
        store_base(system)

        # The line search accepts a step that decreases the largest residual, or one not beyond the minimum of the potential
        # of forces that bend at many places: the potential falls, so that no steps repeat.
        fraction = 1.0
        before = residual
        for _ in range(LIST_CUTS if has_potential else MAX_CUTS):
            subtract_step(system, fraction)
            change = write_balanced_forces(system, level, step)
            if change < 0:
                return False
            residual = max(write_residual(system, level), change / LOAD_RESIDUAL)
            if residual <= solved:
                break
            if has_potential:
                slope = find_potential_slope(system, level)
                if descent <= 0 or slope <= 0:
                    break
                fraction *= max(0.1, descent / (slope + descent))  # at least a tenth per trial
            elif residual < before:
                break
            else:
                fraction *= CUT
        n_stalls = n_stalls + 1 if residual >= 0.5 * smallest else 0
        smallest = min(smallest, residual)
    return residual <= stalled


@njit(**NJIT_CALL)
def find_newton_step(system, level, step):
    """Write Newton's step to `ports.newton.step`; return whether the Jacobian is regular.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    step : Step
        Duration and formula of the velocity.
    """
    ports = system.ports
    write_matrix(system, level, step)
    for i in range(ports.newton.residual.size):
        ports.newton.step[i] = ports.newton.residual[i]
    return solve_linear(ports.newton.matrix, ports.newton.step, ports.newton.residual.size)


@njit(**NJIT_CALL)
def find_potential_slope(system, level):
    """Return the directional derivative [J] along Newton's step of the potential that a step of lists minimises.

    The gradient is -C r for the port forces, with the compliance C and the residuals r of these forces, and the residual
    for a shear coordinate.
    """
    ports = system.ports
    compliance = ports.compliance[level]
    n_ports = ports.values.shape[1]
    slope = 0.0
    for p in range(n_ports):
        for k in range(n_ports):
            slope += ports.newton.residual[p] * compliance[0, p, k] * ports.newton.step[k]
    for k in range(n_ports, ports.newton.residual.size):
        slope -= ports.newton.residual[k] * ports.newton.step[k]
    return slope


@njit(**NJIT_CALL)
def drop_negative_slopes(system):
    """Set the slopes of lists whose force falls with the slide to 0, so that the potential falls along Newton's step."""
    points = system.points
    moves = system.ports.values
    for p in range(moves.shape[1]):
        moves[Port.BY_SLIDE, p] = 0.0
        for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
            values = points.values[block]
            for j in range(count_lanes(points, block)):
                slope = max(values[Value.BY_SLIDE + j], 0.0)
                values[Value.BY_SLIDE + j] = slope
                if points.blocks.law[block] == Law.LIST:
                    values[Value.MEAN_BY_SLIDE + j] = slope
                    values[Value.END_BY_SLIDE + j] = max(values[Value.END_BY_SLIDE + j], 0.0)
                    values[Value.BY_SHEAR + j] = -slope
            moves[Port.BY_SLIDE, p] += sum_points(points, block, Value.BY_SLIDE)


@njit(**NJIT_CALL)
def find_loads(system, row, fraction, is_solved):
    """Compute the loads `Value.END_LOAD` [N] at the end of a step; return their largest change, -1 without a contact set.

    The change is relative to the resultant, and 0 for loads that do not follow from the motion.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    row : int
        Number of the whole step.
    fraction : float
        Time at the end of the step, as a fraction of the whole step.
    is_solved : bool
        Whether the motion of the step is known.
    """
    ports = system.ports
    points = system.points
    if ports.contact[0] >= 0:
        resultant = normal.find_resultant(system, points.loads.nodal)
        if resultant < 0:
            return -1.0
    else:
        resultant = find_resultant(system, row, fraction, is_solved)

    change = 0.0
    total = TINY_LOAD
    has_back = points.loads.node.shape[1] > WIDTH
    for block in range(points.blocks.law.size):
        if points.blocks.is_spring[points.blocks.port[block]]:
            continue
        values = points.values[block]
        for j in range(points.blocks.count[block]):
            x = points.loads.place[block, j] + values[Value.TOTAL + j] + values[Value.SLIDE + j]
            load = find_point_load(points, (block, j), x, resultant)
            change = max(change, abs(load - values[Value.END_LOAD + j]))
            values[Value.END_LOAD + j] = load
            if has_back:
                x += points.loads.place[block, WIDTH + j] - points.loads.place[block, j]
                load = find_point_load(points, (block, WIDTH + j), x, resultant)
            values[Value.END_BACK + j] = load
            total += load
    is_prescribed = system.structure.loads.size and ports.contact[0] < 0
    return 0.0 if is_prescribed else change / total


@njit(**NJIT_CALL)
def is_held(memory, points, p):
    """Return whether port p is held at rest by its rigid point, according to the first entry of `memory` of its block."""
    block = points.blocks.first[p]
    is_rigid = block < points.blocks.first[p + 1] and points.blocks.law[block] == Law.COULOMB
    return is_rigid and memory[block, 0] == 0


@njit(**NJIT_CALL)
def is_shortest(system, level):
    """Return whether a step of this level cannot be halved."""
    return level == system.structure.responses.motion.shape[0] - 1


@njit(**NJIT_CALL)
def find_event(system, level, drive):
    """Return whether a rigid point stops or is released within the trial step.

    A step of the last level is not searched again. Its points that stop get the direction 0 here; `settle` then finds which
    ports rest at its end.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    drive : float
        Drive at the end of the step [m s-2].
    """
    points = system.points
    moves = system.ports.values
    duration = system.options.step / (1 << level)
    is_found = False
    is_any_held = False
    for block in range(points.blocks.law.size):
        if points.blocks.law[block] != Law.COULOMB:
            continue
        p = points.blocks.port[block]
        direction = points.memory[block, 0]
        is_any_held = is_any_held or direction == 0

        # Friction gains energy in a step that does not resolve a reversal. Other ports at rest may hold a slipping port too,
        # which then creeps.
        creep = find_creep(system, block)
        round_off = RESIDUAL * find_slide_size(system, p)
        is_reversed = direction * moves[Port.INCREMENT, p] < -creep * duration - round_off
        is_found = is_found or is_reversed or direction * moves[Port.END_VELOCITY, p] < -creep
    if not is_found:
        return is_any_held and find_overload(system, system.state[2], drive) >= 0
    if not is_shortest(system, level):
        return True

    # Ports that creep stop with the port that has reversed, because one motion of the modes may move both.
    for block in range(points.blocks.law.size):
        speed = points.memory[block, 0] * moves[Port.END_VELOCITY, points.blocks.port[block]]
        if points.blocks.law[block] == Law.COULOMB and speed < find_creep(system, block):
            points.trial[block, 0] = 0.0
    return True


@njit(**NJIT_CALL)
def find_slide_size(system, p):
    """Return the size [m] to which the round-off of the slide of port p is relative: the sum of the parts of all modes.

    These parts may cancel, so that the slide itself is much smaller.
    """
    size = abs(system.ports.values[Port.SLIDE, p])
    total = 0.0
    for k in range(system.state.shape[1] // 2):
        total += abs(system.ports.rows[p, k] * system.state[0, k])
    return max(size, total)


@njit(**NJIT_CALL)
def gains_energy(system):
    """Return whether a port under the law "tanh", which stores no energy, gained energy in the trial step as it reversed."""
    points = system.points
    moves = system.ports.values
    for p in range(moves.shape[1]):
        block = points.blocks.first[p]
        if block < points.blocks.first[p + 1] and points.blocks.law[block] == Law.TANH:
            force = moves[Port.FORCE, p]
            if points.pieces.shears[p, 0] == points.pieces.shears[p, 1]:
                size = max(abs(force), system.options.scale) * abs(moves[Port.INCREMENT, p])
                if force * moves[Port.INCREMENT, p] < -RESIDUAL * size:
                    return True
    return False


@njit(**NJIT_CALL)
def find_creep(system, block):
    """Return the largest velocity [m/s] of the rigid point of a block at which its port may be at rest.

    Only ports that share their force with others creep. Any other port would rest again after a release, because a
    shortest step of a fine march gives it a smaller velocity.
    """
    p = system.points.blocks.port[block]
    if system.ports.redundant[p] == 0:
        return 0.0
    force = abs(system.points.values[block, Value.FORCE])
    return CREEP * system.ports.compliance[0, 1, p, p] * force


@njit(**NJIT_CALL)
def find_overload(system, state, drive):
    """Return the port at rest whose friction limit is reached first on the way to the forces that hold it, or -1.

    The forces change in proportion from those of the step before to those at this instant, `Port.HOLD`. Where kinetic is
    below static friction, the order decides which ports slip.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march; the points have their forces at the end of a step.
    state : (2 n,) array
        Modal coordinates and velocities.
    drive : float
        Drive at this instant [m s-2].
    """
    points = system.points
    ports = system.ports
    for p in range(ports.values.shape[1]):
        ports.newton.residual[p] = 0.0
        for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
            if points.blocks.law[block] == Law.COULOMB:
                ports.newton.residual[p] += find_rigid_force(points, block)
            else:
                ports.newton.residual[p] += sum_points(points, block, Value.END)
    normal.find_holds(system, state, drive)
    first = -1
    largest = 0.0
    for p in range(ports.values.shape[1]):
        if ports.values[Port.HELD, p] > 0:
            hold = ports.values[Port.HOLD, p]
            change = abs(hold - ports.values[Port.EARLIER, p]) + TINY_LOAD
            beyond = (abs(hold) - find_static_limit(points, p, hold)) / change
            if beyond > largest:
                first = p
                largest = beyond
    return first


@njit(**NJIT_CALL)
def find_static_limit(points, p, direction):
    """Return the static friction [N] of the rigid point of port p against a slide in a direction."""
    block = points.blocks.first[p]
    return points.numbers[block, 0] * pick_load(points.values[block], Value.END_LOAD, direction)


@njit(**NJIT_CALL)
def settle(system, drive):
    """Find which ports without velocity rest and which slip at the end of a step in which rigid friction changed its regime.

    Rest must not need more than the static friction, and a port that begins to slip must accelerate in the direction of its
    slip. A port that violates its condition changes sides, until none does. With kinetic below static friction several
    states may be possible: those that were released and can rest while the others slip are held again.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    drive : float
        Drive at this instant [m s-2].
    """
    points = system.points
    moves = system.ports.values
    n_released = 0
    for _ in range(MAX_PIVOTS):
        p = find_violation(system, drive)
        if p < 0:
            break
        is_released = moves[Port.RELEASED, p] > 0
        n_released += 0 if is_released else 1
        moves[Port.RELEASED, p] = 0.0 if is_released else 1.0
        direction = 0.0 if is_released else np.sign(moves[Port.HOLD, p])
        points.trial[points.blocks.first[p], 0] = direction

    for p in range(moves.shape[1]):
        if n_released > 1 and moves[Port.RELEASED, p] > 0:
            block = points.blocks.first[p]
            direction = points.trial[block, 0]
            points.trial[block, 0] = 0.0
            if find_violation(system, drive) >= 0:
                points.trial[block, 0] = direction
    for block in range(points.blocks.law.size):
        if points.blocks.law[block] == Law.COULOMB:
            points.memory[block, 0] = points.trial[block, 0]
            points.values[block, Value.START] = find_rigid_force(points, block)
            moves[Port.RELEASED, points.blocks.port[block]] = 0.0


@njit(**NJIT_CALL)
def find_violation(system, drive):
    """Return a port that can neither stay at rest nor begin to slip in its direction, or -1.

    The row `Port.RELEASED` names the ports that begin to slip.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    drive : float
        Drive at this instant [m s-2].
    """
    points = system.points
    ports = system.ports
    moves = ports.values
    state = system.state[0]
    for p in range(moves.shape[1]):
        moves[Port.HELD, p] = 1.0 if is_held(points.trial, points, p) else 0.0
    overload = find_overload(system, state, drive)
    for p in range(moves.shape[1]):
        if p == overload:
            return p
        if moves[Port.RELEASED, p] > 0 and moves[Port.HELD, p] == 0:
            direction = points.trial[points.blocks.first[p], 0]
            push = find_pull(system, state, drive, p)
            push -= sum_products(ports.grip[p], moves[Port.HOLD])
            least = -MAX_OVERLOAD * ports.grip[p, p] * find_static_limit(points, p, direction)
            if direction * push < least:
                return p
    return -1


@njit(**NJIT_CALL)
def find_rigid_force(points, block):
    """Return the friction [N] of the rigid point of a block at the end of a trial step, 0 at rest."""
    direction = points.trial[block, 0]
    load = pick_load(points.values[block], Value.END_LOAD, direction)
    return points.numbers[block, WIDTH] * load * direction


@njit(**NJIT_CALL)
def store_end(points, block):
    """Store memory, loads and forces of a block of points at the end of a step as those at the start of the next one."""
    values = points.values[block]
    for j in range(count_lanes(points, block)):
        values[Value.START_LOAD + j] = values[Value.END_LOAD + j]
        values[Value.START_BACK + j] = values[Value.END_BACK + j]
        values[Value.START + j] = values[Value.END + j]
    for k in range(points.blocks.n_memory[block]):
        points.memory[block, k] = points.trial[block, k]


@njit(**NJIT_CALL)
def commit(system, duration):
    """Advance memories, shear coordinates and loads after an accepted step of a `duration` [s].

    `Port.RETURN` of a port that rested becomes the displacement that is taken back, and `Total.REST` the work of the drive
    on these displacements.
    """
    points = system.points
    moves = system.ports.values
    rest = 0.0
    for block in range(points.blocks.law.size):
        values = points.values[block]
        if points.blocks.law[block] == Law.COULOMB:
            # A port that was at rest before stays at its place.
            p = points.blocks.port[block]
            was_held = moves[Port.HELD, p] > 0 and points.trial[block, 0] == 0
            moves[Port.RETURN, p] = moves[Port.INCREMENT, p] if was_held else 0.0
            values[Value.SLIDE] = moves[Port.INCREMENT, p] - moves[Port.RETURN, p]
            rest += moves[Port.FORCE, p] * moves[Port.RETURN, p]
            values[Value.END] = find_rigid_force(points, block)
        elif points.blocks.law[block] == Law.LIST:
            numbers = points.numbers[block]
            lists.advance_lists(
                system.points.lists, numbers, values, points.blocks.count[block], duration
            )
        n_lanes = count_lanes(points, block)
        for j in range(n_lanes):
            values[Value.TOTAL + j] += values[Value.SLIDE + j]
            values[Value.START_VELOCITY + j] = values[Value.VELOCITY + j]
            values[Value.LAST_SLIDE + j] = values[Value.SLIDE + j]
        store_end(points, block)

    system.totals[Total.REST] = rest
    advance_shear(points, duration)
    points.pieces.clock[0] = duration
    for p in range(moves.shape[1]):
        moves[Port.FIRST, p] = moves[Port.EARLIER, p]
        moves[Port.EARLIER, p] = moves[Port.LAST, p]
        moves[Port.LAST, p] = moves[Port.FORCE, p]


@njit(**NJIT_CALL)
def find_damping(system, level):
    """Write the weights `Port.DAMPING` of the forces at the end of a step of this level."""
    ports = system.ports
    moves = ports.values
    for p in range(moves.shape[1]):
        x = ports.compliance[level, 1, p, p] * moves[Port.VISCOSITY, p]
        moves[Port.DAMPING, p] = 1 - 1 / x if x > 1 else 0.0


@njit(**NJIT_CALL)
def find_order(system):
    """Return the weight, from 0 to 1, of the formula of order 2 in the velocity of points behind pieces.

    The remainder is the weight of the formula of order 1.

    Where the law "tanh" is much faster than a step, the force hardly depends on the velocity, and only the formula of order
    1 keeps points at rest that stick. Where the pieces relax within a few steps, the formula of order 2 overshoots. The
    change of their rates between two steps, relative to the sum of the rates, falls with the step of a smooth motion, so
    that the order of the result is 2.
    """
    points = system.points
    moves = system.ports.values
    shear = points.pieces.shear
    weight = 1.0
    for p in range(moves.shape[1]):
        block = points.blocks.first[p]
        is_tanh = block < points.blocks.first[p + 1] and points.blocks.law[block] == Law.TANH
        if not is_tanh or points.pieces.shears[p, 0] == points.pieces.shears[p, 1]:
            continue
        change = 0.5 * (moves[Port.FREE_VELOCITY, p] - moves[Port.VELOCITY, p])
        change /= points.numbers[block, WIDTH]
        weight = min(weight, 1 / (1 + change * change))

        jump = 0.0
        size = 0.0
        for k in range(points.pieces.shears[p, 0], points.pieces.shears[p, 1]):
            last = shear[Shear.LAST, k] / shear[Shear.SCALE, k]
            earlier = shear[Shear.EARLIER, k] / shear[Shear.SCALE, k]
            jump += abs(last - earlier)
            size += abs(last) + abs(earlier)
        if size > 0:
            weight = min(weight, 1 - jump / size)
    return weight


@njit(**NJIT_CALL)
def add_work(system, sample, first_column, part):
    """Add the mean forces of a part of a step to a sample; return the friction work of this part [J].

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    sample : (k,) array
        Sample, in the rows of `march_rows_kernels.Sample`; output.
    first_column : int
        Column of the mean force of the first port.
    part : float
        Duration of the part over that of the whole step.
    """
    points = system.points
    moves = system.ports.values
    work = 0.0
    for p in range(moves.shape[1]):
        if points.blocks.first[p] == points.blocks.first[p + 1] or points.blocks.is_spring[p]:
            continue
        slide = moves[Port.INCREMENT, p]
        # Rigid friction at rest does no work: the port was moved back.
        if points.blocks.law[points.blocks.first[p]] == Law.COULOMB:
            slide -= moves[Port.RETURN, p]
        work += moves[Port.FORCE, p] * slide
        sample[first_column + N_PORT_COLUMNS * p] += moves[Port.FORCE, p] * part
    return work


@njit(**NJIT_CALL)
def solve_step(system, level, row, end):
    """Solve port forces and shear increments of a step; return whether Newton's method found them.

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    row : int
        Number of the whole step.
    end : float
        End of the step, as a fraction of the whole step.
    """
    points = system.points
    moves = system.ports.values
    duration = system.options.step / (1 << level)
    find_damping(system, level)
    if system.structure.path.size:
        # A prescribed slide has a constant velocity in each step. Lists behind pieces keep their own, by which bonds grow.
        for block in range(points.blocks.law.size):
            port = points.blocks.port[block]
            is_behind = points.pieces.shears[port, 0] < points.pieces.shears[port, 1]
            if is_behind and points.blocks.law[block] == Law.LIST:
                continue
            for j in range(points.blocks.count[block]):
                points.values[block, Value.START_VELOCITY + j] = moves[Port.VELOCITY, 0]

    # Velocity of order 2 from two increments (BDF2), of order 1 in the first step
    last = points.pieces.clock[0]
    ratio = duration / last if last > 0 else 0.0
    part = find_order(system) * ratio / (1 + ratio)
    step = Step(duration, (1 + part) / duration, part * ratio / duration)

    # Forces are extrapolated from the last steps by parabolas.
    for p in range(moves.shape[1]):
        force = 3 * (moves[Port.LAST, p] - moves[Port.EARLIER, p]) + moves[Port.FIRST, p]
        moves[Port.FORCE, p] = force
    if points.loads.pressure.size and is_shortest(system, level):
        # The pressure at the places where the step begins
        for block in range(points.blocks.law.size):
            for j in range(points.blocks.count[block]):
                points.values[block, Value.SLIDE + j] = 0.0
        find_loads(system, row, end, False)
    elif system.options.has_loads and system.structure.loads.size:
        find_loads(system, row, end, False)
    return solve_forces(system, level, step)


@njit(**NJIT_CALL)
def sum_forces(system, p):
    """Return the friction force [N] of the points of port p at the end of the last step."""
    points = system.points
    total = 0.0
    for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
        total += sum_points(points, block, Value.START)
    return total


@njit(**NJIT_CALL)
def press_at_rest(system):
    """Give the points the loads of the present state while they rest; write their forces and energies."""
    points = system.points
    if system.ports.contact[0] >= 0:
        find_loads(system, 0, 0.0, False)
    step = Step(0.0, 0.0, 0.0)
    for block in range(points.blocks.law.size):
        values = points.values[block]
        for j in range(points.blocks.count[block]):
            values[Value.SLIDE + j] = 0.0
        if points.blocks.law[block] == Law.COULOMB:
            load = pick_load(values, Value.END_LOAD, points.memory[block, 0])
            values[Value.END] = points.numbers[block, WIDTH] * load * points.memory[block, 0]
        elif points.blocks.law[block] != Law.LIST:
            slide_block(system, block, step)
        store_end(points, block)


@njit(**NJIT_CALL)
def write_ports(system, sample):
    """Write force and slip of each port to a sample, and add the energies of the points.

    The slip is a mean over the points, weighted by their friction limits (load times the first number of the law).

    Parameters
    ----------
    system : march_rows_kernels.System
        Arrays of the march.
    sample : (k,) array
        Sample, in the rows of `march_rows_kernels.Sample`; output.
    """
    ports = system.ports
    points = system.points
    size = system.state.shape[1]
    for p in range(ports.values.shape[1]):
        force = 0.0
        slip = 0.0
        weights = 0.0
        stored = 0.0
        for block in range(points.blocks.first[p], points.blocks.first[p + 1]):
            values = points.values[block]
            numbers = points.numbers[block]
            n_lanes = count_lanes(points, block)
            for j in range(n_lanes):
                weight = values[Value.END_LOAD + j] * numbers[j]
                force += values[Value.START + j]
                slip += weight * (values[Value.TOTAL + j] - values[Value.STRETCH + j])
                weights += weight
                stored += values[Value.ENERGY + j]

        # A rigid point at rest has no force of its own: it carries the force that holds its port.
        if ports.values[Port.HELD, p] > 0:
            force = min(max(ports.values[Port.HOLD, p], -weights), weights)
        column = size + Sample.PORTS + N_PORT_COLUMNS * p
        sample[column] = force
        # A port whose points are all without load does not stick at all.
        sample[column + 1] = slip / weights if weights > 0 else ports.values[Port.SLIDE, p]
        row = Sample.ENERGY
        if points.blocks.is_spring[p]:
            row = Sample.SPRINGS
            sample[column + 1] = 0.0
        sample[size + row] += stored
