"""Motion of modes with many contact points, by steps of order 2 (compiled).

Over a step the modes move exactly under a parabola of the drive and constant port forces F, the path means of the laws
(`return_maps_kernels`). With the increments dq = free - C F and the velocities v = free - G F of the ports, F solves

    F_p = sum over the points of port p of f(dq_p - shape . db, v_p),    kappa (b + db/2) = shapes^T f

for the shear coordinates b of the pieces. These are the conditions of the minimum of

    (dq - free)^T C^-1 (dq - free)/2 + sum of the work of the points + kappa (b db + db^2/4),

with the vector free of the increments free_p without forces, the compliances C and G of the modes in a step (`Ports`),
the forces f of the points, and the stiffness kappa and the slides shapes of the points per shear coordinate (`Points`).
Newton's method with a line search finds the minimum. The potential is convex unless the force of a point falls with its
slide. Normal contact acts on the ports of heave and pitch with the path mean of its piecewise linear forces. A changing
load acts half before and half after the slide, and then the pieces relax while the ports rest: a mean over the step would
leave them out of equilibrium, and reverse that in every step. Lists of bonds, whose forces jump, have a weight on the
change of db instead. A port may climb flanks (`flanks_kernels`), and its displacement may be prescribed.

A rigid point slips under a given force, or its port is held at rest. A step in which a slipping port would reverse, or a
point at rest is released, is halved up to the last level. The constant force of a step lets a held port move and come
back. The work of this motion is taken from that of the drive, as friction at rest does none. Friction without memory
(rigid or tanh) would also gain energy where a port reverses and moves back in one step. Such a step is halved too, so
that no law creates energy.

`system` is the `march_rows.System` of all arrays. Their rows are named by enumerations of `march_rows`: `Point` for values
of the points, `Port` for the places where the points act on the modes, `Shear` for the pieces, `Flank` for grooves. A
step of level k lasts a whole step over 2^k.
"""

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL
from ..compiled.jit import njit
from ..contact.set_arrays import PRESENT_SLOT_INDEX
from . import bonds_kernels as bonds
from . import flanks_kernels as flanks
from . import lists_kernels as lists
from . import normal_kernels as normal
from .law_rows import Law, Masing
from .march_rows import LOWER, N_PORT_COLUMNS, RESIDUAL, Flank, Point, Port, Sample, Shear, Total
from .motion_kernels import (
    INCREMENT_ROUND_OFF,
    TINY_LOAD,
    advance_shear,
    find_point_load,
    find_port_residual,
    find_resultant,
    move_ports,
    solve_linear,
    store_base,
    subtract_step,
    sum_products,
    sum_triples,
)
from .return_maps_kernels import (
    Step,
    advance,
    mean_force,
    prepare,
    press,
    read,
)

MAX_NEWTON_ITERATIONS = 200  # Newton iterations of a step
MAX_CUTS = 40  # trials of a line search
MAX_OVERSHOOT = 0.5  # slope beyond the minimum of a line search, relative to that at its start
MAX_STALLS = 4  # iterations that do not halve the smallest residual, after which a step ends
# Largest residual of such a step relative to RESIDUAL, and that of lists, because sums over bonds jump by up to 1e-8
STALLED = 1e3
LISTS_STALLED = 1e5
LIST_DAMPING = 1 / 16  # weight of the change of a shear increment for lists, whose forces jump
MAX_RELAXATIONS = 40  # Newton iterations of the pieces after a step
MAX_LOADS = 60  # repetitions of a step for the loads that follow from its motion
LOAD_RESIDUAL = 1e-11  # change of the loads relative to the resultant


@njit(**NJIT_CALL)
def copy_memory(numbers, source, target):
    """Copy the states of the laws (memory) of all points, without the rows that no stack of reversals uses.

    Parameters
    ----------
    numbers : (k, m) array
        Numbers of the laws of m points. Row 0 is the `Law`.
    source : (l, m) array
        Memory that is copied.
    target : (l, m) array
        Copy (output).
    """
    n_rows = min(source.shape[0], int(Masing.STACK))
    for j in range(source.shape[1]):
        if numbers[0, j] == Law.MASING:
            n_rows = max(n_rows, Masing.STACK + 2 * int(source[Masing.COUNT, j]))
    for k in range(n_rows):
        for j in range(source.shape[1]):
            target[k, j] = source[k, j]


@njit(**NJIT_CALL)
def is_held(points, p):
    """Return whether port p, a displacement of the rig at which points act, is held at rest by a rigid point.

    A rigid point is the only point on its port.
    """
    j = points.first[p]
    is_rigid = j < points.first[p + 1] and points.numbers[0, j] == Law.COULOMB
    return is_rigid and points.memory[0, j] == 0


@njit(**NJIT_CALL)
def prepare_points(system, dt):
    """Set the trial memory of the points for a step of `dt` [s]: loads and bond lengths are those in its middle.

    `Point.LOAD` becomes the mean of the loads at both ends, so that half of a change of load acts before the slide.
    """
    points = system.points
    values = points.values
    options = system.options
    count = points.port.size

    # Trials since the last accepted step may have changed the memory.
    copy_memory(points.numbers, points.memory, points.trial)
    if options.has_loads:
        for j in range(count):
            start = values[Point.START_LOAD, j]
            middle = 0.5 * (start + values[Point.END_LOAD, j])
            values[Point.LOAD, j] = middle
            if points.numbers[0, j] == Law.LIST:
                lists.press_list(system.lists, j, middle)
            elif start != middle and points.node[j] != LOWER:
                press(points.numbers, points.trial, j, start, middle)

    # The length of bonds grows before they carry the force of the step.
    for j in range(count):
        v = system.ports.values[Port.VELOCITY, points.port[j]]
        prepare(points.numbers, points.trial, j, Step(0.0, dt, v, v, 0.0))


@njit(**NJIT_CALL)
def write_forces(system, level, dt):
    """Compute increments and mean forces of ports and points under the assumed port forces `Port.FORCE`.

    SUM, BY_SLIDE and BY_VELOCITY of a port are the forces of its points and their derivatives.
    The forces of rigid points at rest are not known here.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    dt : float
        Duration of the step [s].
    """
    ports = system.ports
    points = system.points
    values = points.values
    moves = ports.values
    flank = system.flank
    count = points.port.size
    n_ports = moves.shape[1]

    move_ports(system, level)
    if flank.size:
        flanks.climb(flank, moves[Port.SLIDE, 0], moves[Port.INCREMENT, 0], dt)

    # Slides of the points: along the flank of a groove, less the shear of the pieces.
    for p in range(n_ports):
        slide = moves[Port.INCREMENT, p]
        slide *= flank[Flank.RATIO] if flank.size and p == 0 else 1.0
        for j in range(points.first[p], points.first[p + 1]):
            values[Point.SLIDE, j] = slide
    slides = values[Point.SLIDE, :count]
    for k in range(points.stiffness.size):
        shape = points.shapes[k]
        increment = points.shear[Shear.TRIAL, k]
        for j in range(slides.size):
            slides[j] -= shape[j] * increment

    write_point_forces(system, level, dt)

    for p in range(n_ports):
        first = points.first[p]
        end = points.first[p + 1]
        moves[Port.SUM, p] = values[Point.FORCE, first:end].sum()
        moves[Port.BY_SLIDE, p] = values[Point.BY_SLIDE, first:end].sum()
        moves[Port.BY_VELOCITY, p] = values[Point.BY_VELOCITY, first:end].sum()

    if flank.size:
        # The force at the end is extrapolated from that at the start and the mean, up to the friction limit.
        limit = points.numbers[1, 0] * flank[Flank.NORMAL]
        end = min(max(2 * moves[Port.SUM, 0] - flank[Flank.FORCE], -limit), limit)
        flanks.add_climb(flank, moves, moves[Port.INCREMENT, 0], dt, end)
        moves[Port.BY_VELOCITY, 0] *= flank[Flank.RATIO]

    if system.structure.path.size:
        moves[Port.FORCE, 0] = moves[Port.SUM, 0]


@njit(**NJIT_CALL)
def write_point_forces(system, level, dt):
    """Compute the mean force FORCE [N] of each point, and its derivatives BY_SLIDE [N/m] and BY_VELOCITY [N s/m].

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    dt : float
        Duration of the step [s].
    """
    ports = system.ports
    points = system.points
    values = points.values
    if system.options.has_only_bonds and bonds.are_paths_short(points):
        bonds.write_means(points)
        return

    for j in range(points.port.size):
        if points.numbers[0, j] == Law.LIST:
            lists.write_list_mean(points.numbers, values, system.lists, j, dt)
            continue

        # The force of a rigid point at rest is unknown until its port is solved.
        p = points.port[j]
        if ports.values[Port.HELD, p] > 0:
            values[Point.FORCE, j] = values[Point.BY_SLIDE, j] = values[Point.BY_VELOCITY, j] = 0.0
            continue

        step = Step(
            values[Point.SLIDE, j],
            dt,
            ports.values[Port.VELOCITY, p],
            ports.values[Port.END_VELOCITY, p],
            ports.compliance[level, 1, p, p],
        )
        mean = mean_force(points.numbers, points.trial, j, values[Point.LOAD, j], step)
        values[Point.FORCE, j] = mean.force
        values[Point.BY_SLIDE, j] = mean.by_increment
        values[Point.BY_VELOCITY, j] = mean.by_velocity


@njit(**NJIT_CALL)
def write_residual(system, level, dt):
    """Compute the residuals [N] of port forces and shear coordinates; return the largest one over its tolerance.

    `ports.vector` receives first the residuals of the ports, then those of the shear coordinates.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    dt : float
        Duration of the step [s].
    """
    ports = system.ports
    points = system.points
    moves = ports.values
    vector = ports.vector
    n_ports = moves.shape[1]
    size = system.options.scale

    # A port force is the sum over its points.
    for p in range(n_ports):
        vector[p] = moves[Port.SUM, p] - moves[Port.FORCE, p]
        size = max(size, abs(moves[Port.FORCE, p]))

    # Heave and pitch also carry the change of load and moment of the contact.
    if ports.contact[0] >= 0:
        size = max(size, normal.add_residuals(system))

    # A port that is held has the velocity 0 at the end: its residual is the force that would stop it. Ports that one mode
    # holds together share their force by the small compliance `redundant`.
    for p in range(n_ports):
        if moves[Port.HELD, p] > 0:
            vector[p] = moves[Port.END_VELOCITY, p] / ports.compliance[level, 1, p, p]
            vector[p] -= ports.redundant[p] * moves[Port.FORCE, p]
    largest = find_port_residual(system, level, size)

    # kappa (b + db/2) = shapes^T f, with a damped change of db.
    shear = points.shear
    damping = LIST_DAMPING * system.options.has_lists
    forces = points.values[Point.FORCE, : points.port.size]
    for k in range(points.stiffness.size):
        increment = shear[Shear.TRIAL, k]
        change = increment - dt * shear[Shear.LAST, k]
        residual = points.stiffness[k] * (shear[Shear.VALUE, k] + 0.5 * increment)
        residual += damping * points.stiffness[k] * change
        residual -= sum_products(points.shapes[k], forces)
        vector[n_ports + k] = residual
        largest = max(largest, abs(residual) * shear[Shear.SCALE, k] / (RESIDUAL * size))
    return largest


@njit(**NJIT_CALL)
def write_matrix(system, level):
    """Write the Jacobian of the residuals of a step of this level to `ports.matrix`.

    A force at port k reduces the slide of port p by C_pk and its velocity at the end of the step by G_pk, the compliances
    of the structure. Entry (p, k) is -(df/dq C_pk + df/dv G_pk), summed over the points of port p, less 1 on the diagonal.
    """
    ports = system.ports
    points = system.points
    moves = ports.values
    matrix = ports.matrix
    compliance = ports.compliance[level]
    n_ports = moves.shape[1]
    n_points = points.port.size

    for p in range(n_ports):
        for k in range(n_ports):
            matrix[p, k] = -moves[Port.BY_SLIDE, p] * compliance[0, p, k]
            matrix[p, k] -= moves[Port.BY_VELOCITY, p] * compliance[1, p, k]
        matrix[p, p] -= 1.0
        for k in range(points.stiffness.size):
            matrix[p, n_ports + k] = 0.0

    if ports.contact[0] >= 0:
        normal.add_slopes(system, level)

    # All points that share shear coordinates act on the port of the first one. The residual of a coordinate has
    # kappa (b + db/2) and the damping of Newton's change of db.
    slopes = points.values[Point.BY_SLIDE, :n_points]
    damping = LIST_DAMPING * system.options.has_lists
    for k in range(points.stiffness.size):
        row = n_ports + k
        p = points.port[0]
        ratio = system.flank[Flank.RATIO] if system.flank.size and p == 0 else 1.0
        slope = sum_products(points.shapes[k], slopes)
        for l in range(k + 1):
            total = sum_triples(points.shapes[k], points.shapes[l], slopes)
            matrix[row, n_ports + l] = matrix[n_ports + l, row] = total
        matrix[row, row] += points.stiffness[k] * (0.5 + damping)
        matrix[p, row] = -ratio * slope
        for q in range(n_ports):
            matrix[row, q] = ratio * slope * compliance[0, p, q]

    # Ports that hold have the derivative of their end velocity in place of that of a force. A small compliance of their
    # own makes the forces unique where more ports hold than there are modes.
    for p in range(n_ports):
        if moves[Port.HELD, p] > 0:
            matrix[p, :] = 0.0
            for k in range(n_ports):
                matrix[p, k] = -compliance[1, p, k] / compliance[1, p, p]
            matrix[p, p] -= ports.redundant[p]


@njit(**NJIT_CALL)
def find_descent(system, level):
    """Return the slope [J] of the potential of the module along Newton's step, which subtracts `ports.step`.

    The derivative of the potential by the port forces is -C r with the residuals r, and that by the shear increments is
    their residual. A step that decreases the potential has a negative slope.
    """
    ports = system.ports
    moves = ports.values
    compliance = ports.compliance[level]
    n_ports = moves.shape[1]
    slope = 0.0
    for p in range(n_ports):
        change = 0.0
        for k in range(n_ports):
            change += compliance[0, p, k] * ports.step[k]
        slope += ports.vector[p] * change
    for k in range(system.points.stiffness.size):
        slope -= ports.vector[n_ports + k] * ports.step[n_ports + k]
    return slope


@njit(**NJIT_CALL)
def find_step(system, level):
    """Write Newton's step to `ports.step`; return the slope of the potential along it, below 0, or 0 without a step.

    If the potential rises along the step, because forces fall with the slide, the step is that without such slopes.
    """
    ports = system.ports
    points = system.points
    n = ports.vector.size
    # Newton's step. A second attempt replaces the slopes of forces that fall with the slide by 0.
    for attempt in range(2):
        write_matrix(system, level)
        for i in range(n):
            ports.step[i] = ports.vector[i]
        if solve_linear(ports.matrix, ports.step, n):
            slope = find_descent(system, level)
            if slope < 0.0:
                return slope
            if slope == 0.0 or attempt > 0:
                return slope
        for p in range(ports.values.shape[1]):
            ports.values[Port.BY_SLIDE, p] = 0.0
        for j in range(points.port.size):
            slope = max(points.values[Point.BY_SLIDE, j], 0.0)
            points.values[Point.BY_SLIDE, j] = slope
            ports.values[Port.BY_SLIDE, points.port[j]] += slope
    return 0.0


@njit(**NJIT_CALL)
def take_step(system, level, dt, fraction):
    """Subtract a fraction of Newton's step from the unknowns (rows BASE); return the residual over its tolerance.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    dt : float
        Duration of the step [s].
    fraction : float
        Fraction of the step of Newton's method.
    """
    subtract_step(system, fraction)
    write_forces(system, level, dt)
    return write_residual(system, level, dt)


@njit(**NJIT_CALL)
def solve_forces(system, level, dt):
    """Solve the port forces `Port.FORCE` and shear increments `Shear.TRIAL` by Newton's method; return whether it did.

    It starts from the present values of these rows.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    dt : float
        Duration of the step [s].
    """
    ports = system.ports
    moves = ports.values
    totals = system.totals
    residual = np.inf
    smallest = np.inf
    n_stalls = 0
    stalled = LISTS_STALLED if system.options.has_lists else STALLED
    for count in range(MAX_NEWTON_ITERATIONS):
        if n_stalls >= MAX_STALLS and residual <= stalled:
            return True
        store_base(system)
        # The first pass evaluates the guess, so that the code of the laws appears only once.
        descent = 0.0
        if count > 0:
            totals[Total.ITERATIONS] += 1
            descent = -find_step(system, level)
        else:
            ports.step[:] = 0.0

        # The line search ends where the potential no longer falls, or rises little.
        low = 0.0
        high = np.inf
        fraction = 1.0
        for _ in range(MAX_CUTS):
            residual = take_step(system, level, dt, fraction)
            slope = find_descent(system, level)
            if residual <= 1.0:
                return True
            if descent <= 0.0 or slope <= MAX_OVERSHOOT * descent:
                break
            high = fraction
            fraction = max(0.1, descent / (slope + descent)) * fraction
            if not low < fraction < high:
                fraction = 0.5 * (low + high)
        n_stalls = n_stalls + 1 if residual >= 0.5 * smallest else 0
        smallest = min(smallest, residual)

        # Between the sides of a jump of a force the equation has no better solution.
        change = 0.0
        size = 0.0
        for p in range(moves.shape[1]):
            size = max(size, abs(moves[Port.FREE, p]))
            part = 0.0
            for k in range(moves.shape[1]):
                part += ports.compliance[level, 0, p, k] * ports.step[k]
            change = max(change, abs(fraction * part))
        if (
            count > 0
            and system.options.has_lists
            and high < np.inf
            and size > 0
            and change <= INCREMENT_ROUND_OFF * size
            and system.points.stiffness.size == 0
        ):
            return True
    return residual <= stalled


@njit(**NJIT_CALL)
def find_loads(system, row, fraction, is_solved):
    """Compute the loads `Point.END_LOAD` [N] at the end of a step; return their largest change, -1 without a contact set.

    The change is relative to the resultant, and 0 for loads that do not follow from the motion.

    Parameters
    ----------
    system : march_rows.System
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
    values = points.values
    if ports.contact[0] >= 0:
        resultant = normal.find_resultant(system, points.nodal)
        if resultant < 0:
            return -1.0
    else:
        resultant = find_resultant(system, row, fraction, is_solved)

    change = 0.0
    total = TINY_LOAD
    for j in range(points.port.size):
        if points.is_spring[j]:
            continue
        x = points.place[j] + values[Point.TOTAL, j] + values[Point.SLIDE, j]
        load = find_point_load(points, j, x, resultant)
        change = max(change, abs(load - values[Point.END_LOAD, j]))
        values[Point.END_LOAD, j] = load
        total += load
    is_prescribed = system.structure.loads.size and ports.contact[0] < 0
    return 0.0 if is_prescribed else change / total


@njit(**NJIT_CALL)
def find_event(system, level, drive):
    """Return whether a rigid point stops or is released, or friction would gain energy, within the trial step.

    A step of the last level is not searched again: a rigid point changes its regime there.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    drive : float
        Drive at the end of the step [m s-2].
    """
    is_shortest = level == system.structure.responses.shape[0] - 1
    ports = system.ports
    points = system.points
    found = False
    is_any_held = False
    for j in range(points.port.size):
        law = points.numbers[0, j]
        if law != Law.COULOMB and law != Law.TANH:
            continue

        # Friction without memory gains energy in a step that does not resolve a reversal.
        p = points.port[j]
        force = points.values[Point.FORCE, j]
        round_off = RESIDUAL * abs(force * ports.values[Port.SLIDE, p])
        if force * ports.values[Port.INCREMENT, p] < -round_off:
            found = True
        if law == Law.TANH:
            continue

        # Row 0 of the memory of a rigid point is its direction of slip, 0 at rest.
        direction = points.memory[0, j]
        is_any_held = is_any_held or direction == 0
        if direction * ports.values[Port.END_VELOCITY, p] < 0:
            found = True
            if is_shortest:
                points.trial[0, j] = 0.0
    if found and not is_shortest:
        return True
    if not is_any_held:
        return False

    # Of the points whose limit is exceeded, that with the largest ratio is released. Row 2 of the state is that at the
    # end of the trial step.
    for p in range(ports.values.shape[1]):
        ports.vector[p] = sum_forces(system, p)
    normal.find_holds(system, system.state[2], drive)
    worst = -1
    largest = 1.0
    for p in range(ports.values.shape[1]):
        if ports.values[Port.HELD, p] == 0:
            continue
        j = points.first[p]
        limit = points.numbers[1, j] * points.values[Point.END_LOAD, j]
        hold = abs(ports.values[Port.HOLD, p])
        if hold > largest * limit:
            worst = p
            largest = hold / limit if limit > 0 else np.inf
    if worst < 0:
        return False
    if is_shortest:
        points.trial[0, points.first[worst]] = np.sign(ports.values[Port.HOLD, worst])
    return not is_shortest


@njit(**NJIT_CALL)
def commit(system, dt):
    """Advance memories, shear coordinates and loads after an accepted step of `dt` [s].

    `Port.RETURN` of a port with a rigid point becomes the displacement that is taken back because the point was at rest,
    and 0 for a port that slips. `Total.REST` becomes the work of the drive on these displacements.
    """
    ports = system.ports
    points = system.points
    values = points.values
    options = system.options
    count = points.port.size

    # Slides and memory of the points. A port that was at rest before stays at its place.
    rest = 0.0
    is_short = options.has_only_bonds and bonds.are_paths_short(points)
    if is_short:
        bonds.advance_all(points)
    for j in range(0 if is_short else count):
        p = points.port[j]
        slide = values[Point.SLIDE, j]
        values[Point.TOTAL, j] += slide
        if points.numbers[0, j] == Law.LIST:
            commit_list(system, j, dt)
        elif points.numbers[0, j] == Law.COULOMB:
            was_held = ports.values[Port.HELD, p] > 0 and points.trial[0, j] == 0
            ports.values[Port.RETURN, p] = slide if was_held else 0.0
            values[Point.TOTAL, j] -= ports.values[Port.RETURN, p]
            rest += ports.values[Port.FORCE, p] * ports.values[Port.RETURN, p]

        else:
            v0 = ports.values[Port.VELOCITY, p]
            v1 = ports.values[Port.END_VELOCITY, p]
            step = Step(slide, dt, v0, v1, 0.0)
            advance(points.numbers, points.trial, j, values[Point.LOAD, j], step)

    # The second half of the change of load acts after the slide.
    for j in range(count if options.has_loads else 0):
        if points.node[j] == LOWER:
            # Bonds keep the pressure under which they formed until their point leaves the pressed area.
            if points.numbers[0, j] == Law.BONDS and values[Point.END_LOAD, j] <= 0.0:
                points.trial[1, j] = points.trial[2, j] = points.trial[3, j] = 0.0
        elif points.numbers[0, j] != Law.LIST:
            middle = values[Point.LOAD, j]
            press(points.numbers, points.trial, j, middle, values[Point.END_LOAD, j])
        values[Point.START_LOAD, j] = values[Point.END_LOAD, j]

    copy_memory(points.numbers, points.trial, points.memory)

    system.totals[Total.REST] = rest

    advance_shear(points, dt)
    if options.has_loads and not options.has_lists and points.stiffness.size:
        relax_pieces(system)


@njit(**NJIT_CALL)
def relax_pieces(system):
    """Bring the pieces into equilibrium with the points while the ports rest; the points slide back and lose energy.

    The increments db solve kappa (b + db) = shapes^T f with the forces f after the slides -shapes^T db, by Newton's
    method. The force after a slide dq is d(dq mean)/d(dq) = mean + dq slope, and changes by about twice the slope.
    """
    points = system.points
    ports = system.ports
    values = points.values
    shear = points.shear
    r = points.stiffness.size
    count = points.port.size
    tolerance = RESIDUAL * system.options.scale

    for j in range(count):
        points.trial[4, j] = points.memory[0, j]
    for k in range(r):
        shear[Shear.TRIAL, k] = 0.0

    # Newton's method for the increments. `gain` is the change of energy of pieces and points without slip.
    gain = 0.0
    for iteration in range(MAX_RELAXATIONS):
        largest = 0.0
        gain = 0.0
        for j in range(count):
            values[Point.TRIAL_SLIDE, j] = -sum_products(points.shapes[:, j], shear[Shear.TRIAL])
            step = Step(values[Point.TRIAL_SLIDE, j], 1.0, 0.0, 0.0, 0.0)
            mean = mean_force(points.numbers, points.trial, j, values[Point.END_LOAD, j], step)
            values[Point.TRIAL_FORCE, j] = mean.end
            values[Point.BY_SLIDE, j] = 2 * mean.by_increment
            gain += mean.force * values[Point.TRIAL_SLIDE, j]

        for k in range(r):
            increment = shear[Shear.TRIAL, k]
            middle = shear[Shear.VALUE, k] + 0.5 * increment
            gain += points.stiffness[k] * middle * increment
            residual = points.stiffness[k] * (middle + 0.5 * increment)
            residual -= sum_products(points.shapes[k], values[Point.TRIAL_FORCE, :count])
            ports.vector[k] = residual
            largest = max(largest, abs(residual) * shear[Shear.SCALE, k])
            for l in range(r):
                ports.matrix[k, l] = sum_triples(
                    points.shapes[k], points.shapes[l], values[Point.BY_SLIDE, :count]
                )
            ports.matrix[k, k] += points.stiffness[k]

        if largest <= tolerance or iteration == MAX_RELAXATIONS - 1:
            break
        if not solve_linear(ports.matrix, ports.vector, r):
            break
        for k in range(r):
            shear[Shear.TRIAL, k] -= ports.vector[k]

    # Where forces fall with the slide the method may fail. The pieces then relax after a later step.
    if gain > 0.0:
        return

    # The points slide back for good, with the loss that follows.
    for j in range(count):
        slide = values[Point.TRIAL_SLIDE, j]
        values[Point.TOTAL, j] += slide
        step = Step(slide, 0.0, 0.0, 0.0, 0.0)
        advance(points.numbers, points.trial, j, values[Point.END_LOAD, j], step)

    copy_memory(points.numbers, points.trial, points.memory)
    for k in range(r):
        shear[Shear.VALUE, k] += shear[Shear.TRIAL, k]


@njit(**NJIT_CALL)
def commit_list(system, j, dt):
    """Advance the list of bonds of a point over an accepted step.

    The growth of bonds needs the velocities v0 and v1 at both ends of the step. Without shear of the pieces they are those
    of the port. With shear, the slide of a point is known only as a mean over the step, so that both are its mean speed.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    j : int
        Number of the point.
    dt : float
        Duration of the step [s].
    """
    points = system.points
    values = points.values
    speed = abs(values[Point.SLIDE, j]) / dt
    v0 = speed
    v1 = speed
    if points.stiffness.size == 0:
        v0 = values[Point.SPEED, j]
        v1 = system.ports.values[Port.END_VELOCITY, points.port[j]]
        values[Point.SPEED, j] = v1
    else:
        # Mean speeds hold in the middle of a step. A line through the last two gives the speed at the end of this one.
        values[Point.SPEED, j] = max(1.5 * speed - 0.5 * values[Point.LAST_SPEED, j], 0.0)
        values[Point.LAST_SPEED, j] = speed
    lists.advance_list(points.numbers, values, system.lists, j, v0, v1, dt)


@njit(**NJIT_CALL)
def read_point(system, j):
    """Return force, energy and stretch of a point under its load at the end of the last step."""
    points = system.points
    load = points.values[Point.END_LOAD, j]
    if points.numbers[0, j] == Law.LIST:
        return lists.read_list(points.numbers, system.lists, j, load)
    return read(points.numbers, points.memory, j, load)


@njit(**NJIT_CALL)
def add_work(system, sample, first_column, part):
    """Add the mean forces of a part of a step to a sample; return the friction work of this part [J].

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    sample : (k,) array
        Sample, in the rows of `march_rows.Sample`; output.
    first_column : int
        Column of the mean force of the first port.
    part : float
        Duration of the part over that of the whole step.
    """
    ports = system.ports
    points = system.points

    # Work is mean force times increment, for points behind shear of the pieces too: their work includes the energy of the
    # pieces. Ports of rigid points at rest are moved back, so that friction at rest does no work.
    work = 0.0
    for j in range(points.port.size):
        if points.is_spring[j]:
            continue
        p = points.port[j]
        force = points.values[Point.FORCE, j]
        slide = ports.values[Port.INCREMENT, p]
        if points.numbers[0, j] == Law.COULOMB:
            force = ports.values[Port.FORCE, p]
            slide -= ports.values[Port.RETURN, p]
        # On a flank the points slide along it by ds = RATIO dq, so that their work f ds is that of the force RATIO f.
        if system.flank.size and p == 0:
            force *= system.flank[Flank.RATIO]
        work += force * slide
        sample[first_column + N_PORT_COLUMNS * p] += force * part

    # The vertical force V lifts the load by dz = SLOPE dq.
    if system.flank.size:
        force = system.flank[Flank.TRIAL_VERTICAL] * system.flank[Flank.SLOPE]
        work += force * ports.values[Port.INCREMENT, 0]
        sample[first_column] += force * part
    return work


@njit(**NJIT_CALL)
def solve_step(system, level, row, end):
    """Solve port forces and shear increments of a step; return whether Newton's method found them.

    Without a contact set the counter `PRESENT_SLOT_INDEX` becomes -1.

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march, changed in place.
    level : int
        Level of the step, which lasts a whole step over 2^level.
    row : int
        Number of the whole step.
    end : float
        End of the step, as a fraction of the whole step.
    """
    points = system.points
    options = system.options
    moves = system.ports.values
    dt = options.step / (1 << level)

    # Behind pieces, forces are extrapolated from the last steps by parabolas.
    if points.stiffness.size and not options.has_lists:
        for p in range(moves.shape[1]):
            force = moves[Port.FORCE, p]
            moves[Port.FORCE, p] = 3 * (force - moves[Port.LAST, p]) + moves[Port.EARLIER, p]
            moves[Port.EARLIER, p] = moves[Port.LAST, p]
            moves[Port.LAST, p] = force
    if options.has_lists and points.stiffness.size == 0:
        for j in range(points.port.size):
            points.values[Point.SPEED, j] = moves[Port.VELOCITY, points.port[j]]

    # Loads that follow from the motion are iterated with it.
    is_solved = False
    for count in range(MAX_LOADS):
        if options.has_loads:
            change = find_loads(system, row, end, count > 0)
            if change < 0:
                system.sets.counters[PRESENT_SLOT_INDEX] = -1
                return False
            if count > 0 and change <= LOAD_RESIDUAL:
                break
        prepare_points(system, dt)
        is_solved = solve_forces(system, level, dt)
        if not options.has_loads:
            break
    return is_solved


@njit(**NJIT_CALL)
def sum_forces(system, p):
    """Return the friction force [N] of the points of port p at the end of the last step."""
    points = system.points
    total = 0.0
    for j in range(points.first[p], points.first[p + 1]):
        total += read_point(system, j).force
    return total


@njit(**NJIT_CALL)
def press_at_rest(system):
    """Give the points the loads of the normal contact at the present state, while they rest."""
    points = system.points
    values = points.values
    if system.ports.contact[0] < 0:
        return
    find_loads(system, 0, 0.0, False)
    for j in range(points.port.size):
        load = values[Point.END_LOAD, j]
        if points.numbers[0, j] == Law.LIST:
            lists.press_list(system.lists, j, load)
        else:
            press(points.numbers, points.memory, j, values[Point.START_LOAD, j], load)
        values[Point.START_LOAD, j] = values[Point.LOAD, j] = load


@njit(**NJIT_CALL)
def find_path(points):
    """Return the displacement [m] of the first point since the start, along its flank."""
    return points.values[Point.TOTAL, 0]


@njit(**NJIT_CALL)
def read_points(system, forces, stretch, loads):
    """Write friction force [N], elastic stretch [m] and load [N] of the points of the first port, all (m,).

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march.
    forces, stretch, loads : (m,) array
        Output.
    """
    for j in range(forces.size):
        state = read_point(system, j)
        forces[j] = state.force
        stretch[j] = state.stretch
        loads[j] = system.points.values[Point.END_LOAD, j]


@njit(**NJIT_CALL)
def write_ports(system, sample):
    """Write force and slip of each port to a sample, and add the energies of the points.

    The slip is a mean over the points, weighted by their friction limits (load times the first number of the law).

    Parameters
    ----------
    system : march_rows.System
        Arrays of the march; `ports.vector` becomes the sum of the weights of each port.
    sample : (k,) array
        Sample, in the rows of `march_rows.Sample`; output.
    """
    ports = system.ports
    points = system.points
    size = system.state.shape[1]
    first = size + Sample.PORTS
    n_ports = ports.values.shape[1]
    for p in range(n_ports):
        sample[first + N_PORT_COLUMNS * p] = 0.0
        sample[first + N_PORT_COLUMNS * p + 1] = 0.0
        ports.vector[p] = 0.0

    if system.options.has_only_bonds:
        for p in range(n_ports):
            sums = bonds.read_port(points, points.first[p], points.first[p + 1])
            sample[first + N_PORT_COLUMNS * p] = sums.force
            sample[first + N_PORT_COLUMNS * p + 1] = sums.slip
            ports.vector[p] = sums.weight
            sample[size + Sample.ENERGY] += sums.energy
    for j in range(0 if system.options.has_only_bonds else points.port.size):
        p = points.port[j]
        state = read_point(system, j)
        force = state.force
        if points.is_spring[j]:
            sample[size + Sample.SPRINGS] += state.energy
            sample[first + N_PORT_COLUMNS * p] += force
            continue
        sample[size + Sample.ENERGY] += state.energy

        # A rigid point at rest has no force of its own: it carries the force that holds its port.
        weight = points.values[Point.END_LOAD, j] * points.numbers[1, j]
        if ports.values[Port.HELD, p] > 0:
            force = min(max(ports.values[Port.HOLD, p], -weight), weight)
        sample[first + N_PORT_COLUMNS * p] += force
        slip = points.values[Point.TOTAL, j] - state.stretch
        sample[first + N_PORT_COLUMNS * p + 1] += weight * slip
        ports.vector[p] += weight

    # A port whose points are all without load does not stick at all.
    for p in range(n_ports):
        if ports.vector[p] > 0:
            sample[first + N_PORT_COLUMNS * p + 1] /= ports.vector[p]
        else:
            sample[first + N_PORT_COLUMNS * p + 1] = ports.values[Port.SLIDE, p]
