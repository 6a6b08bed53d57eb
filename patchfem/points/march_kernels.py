"""Motion of modes with many contact points, by steps of order 2 (compiled).

Over a step the modes move exactly under a parabola of the drive and constant port forces F, the path means of the laws
(`return_maps_kernels`). With the increments dq = free - C F and the velocities v = free - G F of the ports, F solves

    F_p = sum over the points of port p of f(dq_p - shape . db, v_p),    kappa (b + db/2) = shapes^T f

for the shear coordinates b of the pieces, by Newton's method. Normal contact acts on the ports of heave and pitch with
the path mean of its piecewise linear forces. A changing load acts half before and half after the slide.

A rigid point slips under a given force, or its port is held at rest. A step in which the velocity of a port with
friction changes its sign, or a rigid point is released, is halved up to the last level.
"""

import numpy as np

from ..compiled.jit import njit
from ..contact.press_kernels import compute_energy, find_set, press_state
from ..contact.press_path_kernels import path_mean
from ..contact.set_arrays import REFERENCE_LOAD, REFERENCE_MOMENT
from ..friction.bonds.point_kernels import MAX_SHORT_PATH
from ..friction.flags_kernels import NJIT_KERNEL
from .march_rows import N_PORT_COLUMNS, Point, Port, Sample, Total
from .return_maps_kernels import (
    Law,
    Step,
    advance,
    advance_bonds,
    find_rest_limit,
    mean_force,
    prepare,
    press,
    read,
    write_bond_means,
)

MAX_ITERATIONS = 80  # Newton iterations of a step
MAX_LOADS = 40  # repetitions of a step for the loads that follow from its motion
RESIDUAL = 1e-11  # residual of forces relative to the largest one
LOAD_RESIDUAL = 1e-10  # change of the loads relative to the resultant
SHEAR_DAMPING = (
    0.25  # weight of the change of a shear increment, which damps oscillations of the pieces
)
DONE = 0
EXCEEDS_TRAVEL = 1
NOT_FINITE = 2
NO_CONTACT_SET = 3


@njit(**NJIT_KERNEL)
def solve_linear(matrix, vector, n):
    """Solve a dense system in place by Gaussian elimination with partial pivoting."""
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
        for i in range(k + 1, n):
            factor = matrix[i, k] / matrix[k, k]
            if factor != 0.0:
                for c in range(k + 1, n):
                    matrix[i, c] -= factor * matrix[k, c]
                vector[i] -= factor * vector[k]
    for k in range(n - 1, -1, -1):
        total = vector[k]
        for c in range(k + 1, n):
            total -= matrix[k, c] * vector[c]
        vector[k] = total / matrix[k, k]
    return True


@njit(**NJIT_KERNEL)
def move_freely(system, level, drive):
    """Write the motion at the end of a step without interface forces, and that of the ports."""
    response = system.structure.responses[level]
    state = system.state
    size = state.shape[1]
    n = size // 2
    for i in range(size):
        total = response[i, size] * drive[0] + response[i, size + 1] * drive[1]
        total += response[i, size + 2] * drive[2]
        for k in range(size):
            total += response[i, k] * state[0, k]
        state[1, i] = total
    ports = system.ports
    for p in range(ports.rows.shape[0]):
        slide = 0.0
        velocity = 0.0
        free = 0.0
        free_velocity = 0.0
        for i in range(n):
            row = ports.rows[p, i]
            slide += row * state[0, i]
            velocity += row * state[0, n + i]
            free += row * (state[1, i] - state[0, i])
            free_velocity += row * state[1, n + i]
        ports.values[Port.SLIDE, p] = slide
        ports.values[Port.VELOCITY, p] = velocity
        ports.values[Port.FREE, p] = free
        ports.values[Port.FREE_VELOCITY, p] = free_velocity


@njit(**NJIT_KERNEL)
def prepare_points(system, h):
    """Copy the memory of the points and press them to the loads in the middle of the step."""
    points = system.points
    values = points.values
    for k in range(points.memory.shape[0]):
        for j in range(points.port.size):
            points.trial[k, j] = points.memory[k, j]
    for j in range(points.port.size):
        values[Point.LOAD, j] = 0.5 * (values[Point.START_LOAD, j] + values[Point.END_LOAD, j])
    for j in range(points.port.size):
        if values[Point.START_LOAD, j] != values[Point.END_LOAD, j]:
            press(
                points.numbers, points.trial, j, values[Point.START_LOAD, j], values[Point.LOAD, j]
            )
        v = system.ports.values[Port.VELOCITY, points.port[j]]
        prepare(points.numbers, points.trial, j, Step(0.0, h, v, v, 0.0))


@njit(**NJIT_KERNEL)
def write_system(system, level, h):
    """Write residuals and Jacobian of the port forces and shear increments; return the size of the residual and of F."""
    ports = system.ports
    points = system.points
    n_ports = ports.rows.shape[0]
    n_shear = points.stiffness.size
    compliance = ports.compliance[level]
    matrix = ports.matrix
    vector = ports.vector
    values = points.values
    matrix[:] = 0.0
    vector[:] = 0.0

    # Motion of the ports and slides of the points under the assumed forces.
    for p in range(n_ports):
        dq = ports.values[Port.FREE, p]
        v = ports.values[Port.FREE_VELOCITY, p]
        for k in range(n_ports):
            dq -= compliance[0, p, k] * ports.values[Port.FORCE, k]
            v -= compliance[1, p, k] * ports.values[Port.FORCE, k]
        ports.values[Port.INCREMENT, p] = dq
        ports.values[Port.END_VELOCITY, p] = v
        vector[p] = -ports.values[Port.FORCE, p]
        matrix[p, p] = -1.0
    for j in range(points.port.size):
        values[Point.SLIDE, j] = ports.values[Port.INCREMENT, points.port[j]]
    for k in range(n_shear):
        increment = points.shear[2, k]
        for j in range(points.port.size):
            values[Point.SLIDE, j] -= points.shapes[k, j] * increment

    # Entry (p, k) of the Jacobian is -(df/dq C_pk + df/dv G_pk), summed over the points of port p.
    for p in range(n_ports):
        ports.values[Port.BY_SLIDE, p] = 0.0
        ports.values[Port.BY_VELOCITY, p] = 0.0
    write_forces(system, level, h)
    for j in range(points.port.size):
        p = points.port[j]
        vector[p] += values[Point.FORCE, j]
        ports.values[Port.BY_SLIDE, p] += values[Point.BY_SLIDE, j]
        ports.values[Port.BY_VELOCITY, p] += values[Point.BY_VELOCITY, j]
    for p in range(n_ports):
        for k in range(n_ports):
            matrix[p, k] -= ports.values[Port.BY_SLIDE, p] * compliance[0, p, k]
            matrix[p, k] -= ports.values[Port.BY_VELOCITY, p] * compliance[1, p, k]
    size = add_contact(system, level)
    for p in range(n_ports):
        size = max(size, abs(ports.values[Port.FORCE, p]))
    add_shear(system, level, h)
    hold_ports(system, level)
    residual = 0.0
    for p in range(vector.size):
        residual = max(residual, abs(vector[p]))
    return residual, size


@njit(**NJIT_KERNEL)
def write_forces(system, level, h):
    """Write the mean forces of the points and their slopes; those of rigid points at rest are not known here."""
    ports = system.ports
    points = system.points
    values = points.values
    count = points.port.size
    if points.numbers[0, 0] == Law.BONDS and points.stiffness.size > 0:
        # Only points of one law share shear coordinates.
        is_short = write_bond_means(
            points.numbers,
            points.trial,
            values[Point.LOAD, :count],
            values[Point.SLIDE, :count],
            values[Point.FORCE, :count],
            values[Point.BY_SLIDE, :count],
        )
        if is_short:
            return
    for j in range(count):
        p = points.port[j]
        if find_rest_limit(points.numbers, points.trial, j, 1.0) < np.inf:
            values[Point.FORCE, j] = values[Point.BY_SLIDE, j] = values[Point.BY_VELOCITY, j] = 0.0
            continue
        step = Step(
            values[Point.SLIDE, j],
            h,
            ports.values[Port.VELOCITY, p],
            ports.values[Port.END_VELOCITY, p],
            ports.compliance[level, 1, p, p],
        )
        mean = mean_force(points.numbers, points.trial, j, values[Point.LOAD, j], step)
        values[Point.FORCE, j] = mean.force
        values[Point.BY_SLIDE, j] = mean.by_increment
        values[Point.BY_VELOCITY, j] = mean.by_velocity


@njit(**NJIT_KERNEL)
def add_contact(system, level):
    """Add the normal contact to the equations of heave and pitch; return the size of its forces."""
    ports = system.ports
    contact = ports.contact
    heave = int(contact[0])
    if heave < 0:
        return 0.0
    pitch = int(contact[1])
    out = contact[2:11]
    increments = ports.values[Port.INCREMENT]
    slides = ports.values[Port.SLIDE]
    slot = int(system.totals[Total.SLOT])
    path_mean(
        system.sets, slot, slides[heave], slides[pitch], increments[heave], increments[pitch], out
    )
    for i in range(2):
        p = heave if i == 0 else pitch
        ports.vector[p] += out[i]
        for k in range(ports.rows.shape[0]):
            change = out[5 + 2 * i] * ports.compliance[level, 0, heave, k]
            change += out[6 + 2 * i] * ports.compliance[level, 0, pitch, k]
            ports.matrix[p, k] -= change
    return abs(out[0])


@njit(**NJIT_KERNEL)
def add_shear(system, level, h):
    """Add the equations of the shear coordinates and their effect on the ports."""
    ports = system.ports
    points = system.points
    values = points.values
    n_ports = ports.rows.shape[0]
    for k in range(points.stiffness.size):
        row = n_ports + k
        increment = points.shear[2, k]
        change = increment - h * points.shear[1, k]
        stiffness = points.stiffness[k]
        residual = stiffness * (points.shear[0, k] + 0.5 * increment + SHEAR_DAMPING * change)
        slope = 0.0
        for j in range(points.port.size):
            residual -= points.shapes[k, j] * values[Point.FORCE, j]
            slope += points.shapes[k, j] * values[Point.BY_SLIDE, j]
        ports.vector[row] = residual
        for l in range(k + 1):
            total = 0.0
            for j in range(points.port.size):
                total += points.shapes[k, j] * points.shapes[l, j] * values[Point.BY_SLIDE, j]
            ports.matrix[row, n_ports + l] = ports.matrix[n_ports + l, row] = total
        ports.matrix[row, row] += stiffness * (0.5 + SHEAR_DAMPING)

        # All points that share shear coordinates act on the port of the first one.
        p = points.port[0]
        ports.matrix[p, row] = -slope
        for q in range(n_ports):
            ports.matrix[row, q] = slope * ports.compliance[level, 0, p, q]


@njit(**NJIT_KERNEL)
def hold_ports(system, level):
    """Replace the equations of the ports of rigid points at rest by v = 0 at the end of the step."""
    ports = system.ports
    points = system.points
    for j in range(points.port.size):
        if find_rest_limit(points.numbers, points.trial, j, 1.0) == np.inf:
            continue
        p = points.port[j]
        mobility = ports.compliance[level, 1, p, p]
        ports.vector[p] = ports.values[Port.END_VELOCITY, p] / mobility
        ports.matrix[p, :] = 0.0
        for k in range(ports.rows.shape[0]):
            ports.matrix[p, k] = -ports.compliance[level, 1, p, k] / mobility


@njit(**NJIT_KERNEL)
def solve_forces(system, level, h):
    """Solve the port forces and shear increments by Newton's method; return whether it converged."""
    ports = system.ports
    points = system.points
    n_ports = ports.rows.shape[0]
    n = ports.vector.size
    last = np.inf
    for count in range(MAX_ITERATIONS):
        residual, size = write_system(system, level, h)
        if residual <= RESIDUAL * size or residual == 0.0:
            return True
        system.totals[Total.ITERATIONS] += 1
        system.totals[Total.WORST] = max(system.totals[Total.WORST], count)
        # A law with corners may make Newton's method alternate; shorter steps end that.
        fraction = 0.5 if residual > 0.9 * last and count > 8 else 1.0
        last = residual
        if not solve_linear(ports.matrix, ports.vector, n):
            return False
        for p in range(n_ports):
            ports.values[Port.FORCE, p] -= fraction * ports.vector[p]
        for k in range(n - n_ports):
            points.shear[2, k] -= fraction * ports.vector[n_ports + k]
    return residual <= 1e3 * RESIDUAL * size


@njit(**NJIT_KERNEL)
def find_loads(system, row, fraction):
    """Write the loads of the points at the end of a step; return their largest change, -1 without a contact set."""
    ports = system.ports
    points = system.points
    loads = system.structure.loads
    values = points.values
    totals = system.totals
    heave = int(ports.contact[0])
    if heave < 0 and loads.size == 0:
        return 0.0
    resultant = 0.0
    if heave >= 0:
        pitch = int(ports.contact[1])
        h = ports.values[Port.SLIDE, heave] + ports.values[Port.INCREMENT, heave]
        t = ports.values[Port.SLIDE, pitch] + ports.values[Port.INCREMENT, pitch]
        slot = find_set(system.sets, int(totals[Total.SLOT]), -h, t)
        if slot < 0:
            return -1.0
        press_state(system.sets, slot, -h, t, values[Point.NODE_FORCE, : system.sets.x.size])
        resultant = max(
            system.sets.reference[REFERENCE_LOAD] - compute_energy(system.sets, slot, h, t)[1], 0.0
        )
    else:
        resultant = loads[row] + fraction * (loads[row + 1] - loads[row])
    change = 0.0
    for j in range(points.port.size):
        if points.is_spring[j]:
            continue
        load = points.share[j] * resultant
        if points.node[j] >= 0:
            load = values[Point.NODE_FORCE, points.node[j]]
        change = max(change, abs(load - values[Point.END_LOAD, j]))
        values[Point.END_LOAD, j] = load
    return change / (resultant + 1e-300) if heave >= 0 else 0.0


@njit(**NJIT_KERNEL)
def write_trial(system, level):
    """Write the state at the end of the step under the port forces."""
    response = system.structure.responses[level]
    state = system.state
    ports = system.ports
    size = state.shape[1]
    n = size // 2
    mass = system.structure.numbers[0]
    for i in range(size):
        state[2, i] = state[1, i]
    for k in range(n):
        force = 0.0
        for p in range(ports.rows.shape[0]):
            force -= ports.rows[p, k] * ports.values[Port.FORCE, p]
        force /= mass
        for i in range(size):
            state[2, i] += response[i, size + 3 + k] * force


@njit(**NJIT_KERNEL)
def find_holds(system, state, drive):
    """Write the forces of the ports at an instant that hold rigid points at rest, if there are any."""
    ports = system.ports
    points = system.points
    structure = system.structure
    n = structure.modes.shape[1]
    n_ports = ports.rows.shape[0]
    values = ports.values
    is_held = False
    for j in range(points.port.size):
        is_held = is_held or find_rest_limit(points.numbers, points.memory, j, 1.0) < np.inf
    if not is_held:
        return
    for p in range(n_ports):
        values[Port.HOLD, p] = 0.0
        ports.vector[p] = 1.0
    for j in range(points.port.size):
        if find_rest_limit(points.numbers, points.memory, j, 1.0) < np.inf:
            ports.vector[points.port[j]] = 0.0
        else:
            force = read(points.numbers, points.memory, j, points.values[Point.END_LOAD, j]).force
            values[Port.HOLD, points.port[j]] += force
    heave = int(ports.contact[0])
    if heave >= 0:
        energy = compute_energy(
            system.sets,
            int(system.totals[Total.SLOT]),
            project(ports.rows[heave], state),
            project(ports.rows[int(ports.contact[1])], state),
        )
        values[Port.HOLD, heave] += energy[1]
        values[Port.HOLD, int(ports.contact[1])] += energy[2]

    # Ports at rest have no acceleration: grip . hold = acceleration without their forces.
    for p in range(n_ports):
        free = ports.vector[p] > 0
        ports.matrix[p, :] = 0.0
        ports.matrix[p, p] = 1.0
        if free:
            ports.vector[p] = values[Port.HOLD, p]
            continue
        total = 0.0
        for i in range(n):
            acceleration = -structure.modes[1, i] * drive - structure.modes[0, i] * state[i]
            for k in range(n):
                acceleration -= structure.damping[i, k] * state[n + k]
            total += ports.rows[p, i] * acceleration
        ports.vector[p] = total
        for k in range(n_ports):
            ports.matrix[p, k] = ports.grip[p, k]
    solve_linear(ports.matrix, ports.vector, n_ports)
    for p in range(n_ports):
        values[Port.HOLD, p] = ports.vector[p]


@njit(**NJIT_KERNEL)
def project(row, state):
    """Return the displacement of a port."""
    total = 0.0
    for i in range(row.size):
        total += row[i] * state[i]
    return total


@njit(**NJIT_KERNEL)
def find_event(system, drive, is_shortest):
    """Return whether the trial step contains an event; at the last level, change the regime of rigid points instead."""
    ports = system.ports
    points = system.points
    found = False
    holds_needed = False
    for j in range(points.port.size):
        p = points.port[j]
        if points.is_spring[j]:
            continue
        start = ports.values[Port.VELOCITY, p]
        end = ports.values[Port.END_VELOCITY, p]
        if points.numbers[0, j] == Law.COULOMB:
            if points.memory[0, j] == 0:
                holds_needed = True
            elif points.memory[0, j] * end < 0:
                found = True
                if is_shortest:
                    points.trial[0, j] = 0.0
        elif start * end < 0 and not is_shortest:
            found = True
        if found and not is_shortest:
            return True
    if holds_needed:
        find_holds(system, system.state[2], drive)
        for j in range(points.port.size):
            limit = find_rest_limit(
                points.numbers, points.memory, j, points.values[Point.END_LOAD, j]
            )
            hold = ports.values[Port.HOLD, points.port[j]]
            if limit < np.inf and abs(hold) > limit:
                found = True
                if is_shortest:
                    points.trial[0, j] = 1.0 if hold > 0 else -1.0
    return found and not is_shortest


@njit(**NJIT_KERNEL)
def commit(system, h):
    """Advance memories, shear coordinates and loads after an accepted step; bring held ports to rest."""
    ports = system.ports
    points = system.points
    values = points.values
    count = points.port.size
    has_bonds = points.numbers[0, 0] == Law.BONDS and points.stiffness.size > 0
    has_bonds = has_bonds and points.numbers[3, 0] < 0
    if has_bonds:
        for j in range(count):
            has_bonds = (
                has_bonds and abs(values[Point.SLIDE, j]) <= MAX_SHORT_PATH * points.trial[4, j]
            )
    if has_bonds:
        advance_bonds(points.trial, values[Point.LOAD, :count], values[Point.SLIDE, :count])
    for j in range(count):
        p = points.port[j]
        if not has_bonds:
            step = Step(
                values[Point.SLIDE, j],
                h,
                ports.values[Port.VELOCITY, p],
                ports.values[Port.END_VELOCITY, p],
                0.0,
            )
            advance(points.numbers, points.trial, j, values[Point.LOAD, j], step)
        if values[Point.START_LOAD, j] != values[Point.END_LOAD, j]:
            press(points.numbers, points.trial, j, values[Point.LOAD, j], values[Point.END_LOAD, j])
            values[Point.START_LOAD, j] = values[Point.END_LOAD, j]
    for j in range(count):
        p = points.port[j]
        if points.numbers[0, j] == Law.COULOMB:
            # A port that was at rest before stays at its place.
            was_held = points.memory[0, j] == 0 and points.trial[0, j] == 0
            ports.values[Port.FREE, p] = ports.values[Port.INCREMENT, p] if was_held else 0.0
    for k in range(points.memory.shape[0]):
        for j in range(count):
            points.memory[k, j] = points.trial[k, j]
    for k in range(points.stiffness.size):
        points.shear[0, k] += points.shear[2, k]
        points.shear[1, k] = points.shear[2, k] / h
    for i in range(system.state.shape[1]):
        system.state[0, i] = system.state[2, i]
    heave = int(ports.contact[0])
    if heave >= 0:
        totals = system.totals
        h = project(ports.rows[heave], system.state[0])
        t = project(ports.rows[int(ports.contact[1])], system.state[0])
        totals[Total.SLOT] = find_set(system.sets, int(totals[Total.SLOT]), -h, t)
    rest_ports(system)


@njit(**NJIT_KERNEL)
def rest_ports(system):
    """Bring the ports of rigid points at rest back to their places and to rest, by the smallest change of the modes.

    A constant force over the step only makes their velocity vanish at its end. `Port.FREE` has their displacements.
    """
    ports = system.ports
    points = system.points
    state = system.state[0]
    n = state.size // 2
    n_ports = ports.rows.shape[0]
    is_held = False
    for j in range(points.port.size):
        is_held = is_held or find_rest_limit(points.numbers, points.memory, j, 1.0) < np.inf
    if not is_held:
        return
    for first in (0, n):
        for p in range(n_ports):
            ports.matrix[p, :] = 0.0
            ports.matrix[p, p] = 1.0
            ports.vector[p] = 0.0
        for j in range(points.port.size):
            if find_rest_limit(points.numbers, points.memory, j, 1.0) < np.inf:
                p = points.port[j]
                ports.vector[p] = ports.values[Port.FREE, p]
                if first > 0:
                    ports.vector[p] = project(ports.rows[p], state[n:])
                for k in range(n_ports):
                    ports.matrix[p, k] = ports.grip[p, k]
        solve_linear(ports.matrix, ports.vector, n_ports)
        for p in range(n_ports):
            for i in range(n):
                change = ports.rows[p, i] * ports.vector[p] / system.structure.numbers[0]
                state[first + i] -= change


@njit(**NJIT_KERNEL)
def try_step(system, level, row, fraction, drive):
    """Advance by a step of a level; return False if it contains an event; without a contact set SLOT becomes -1.

    `row` and `fraction` are the time at the end of the step in whole steps; `drive` is its parabola at the start.
    """
    points = system.points
    levels = system.structure.responses.shape[0]
    h = system.structure.numbers[1] / (1 << level)
    move_freely(system, level, drive)
    for k in range(points.stiffness.size):
        points.shear[2, k] = h * points.shear[1, k]
    find_loads(system, row, fraction)
    is_solved = False
    for _ in range(MAX_LOADS):
        prepare_points(system, h)
        is_solved = solve_forces(system, level, h)
        change = find_loads(system, row, fraction)
        if change < 0:
            system.totals[Total.SLOT] = -1
            return True
        if change <= LOAD_RESIDUAL:
            break
    write_trial(system, level)
    end = drive[0] + h * (drive[1] + 0.5 * h * drive[2])
    if find_event(system, end, level == levels - 1):
        return False
    if not is_solved:
        system.totals[Total.UNSOLVED] += 1
    for i in range(system.state.shape[1]):
        system.state[1, i] = system.state[0, i]
    commit(system, h)
    add_energies(system, h, drive)
    return True


@njit(**NJIT_KERNEL)
def add_energies(system, h, drive):
    """Add the energies of a step from the state before it, in `state[1]`; integrals of velocities by Simpson's rule."""
    structure = system.structure
    totals = system.totals
    before = system.state[1]
    after = system.state[0]
    n = after.size // 2
    mass = structure.numbers[0]
    middle_drive = drive[0] + 0.5 * h * (drive[1] + 0.25 * h * drive[2])
    end_drive = drive[0] + h * (drive[1] + 0.5 * h * drive[2])
    work = 0.0
    loss = 0.0
    stored = 0.0
    for i in range(n):
        start = before[n + i]
        end = after[n + i]
        middle = 1.5 * (after[i] - before[i]) / h - 0.25 * (start + end)
        work -= structure.modes[1, i] * (
            drive[0] * start + 4 * middle_drive * middle + end_drive * end
        )
        for k in range(n):
            if structure.damping[i, k] != 0.0:
                other = 1.5 * (after[k] - before[k]) / h - 0.25 * (before[n + k] + after[n + k])
                squares = start * before[n + k] + 4 * middle * other + end * after[n + k]
                loss += structure.damping[i, k] * squares
        stored += end * end + structure.modes[0, i] * after[i] * after[i]
    work *= mass * h / 6
    totals[Total.WORK_IN] += work
    totals[Total.POWER] += abs(work)
    totals[Total.VISCOUS] += mass * h / 6 * loss
    totals[Total.STORED] = max(totals[Total.STORED], 0.5 * mass * stored)


@njit(**NJIT_KERNEL)
def write_sample(system, drive, sample):
    """Write a sample of forces and energies at the present state."""
    ports = system.ports
    points = system.points
    totals = system.totals
    size = system.state.shape[1]
    find_holds(system, system.state[0], drive)
    energy = 0.0
    first = size + Sample.PORTS
    for p in range(ports.rows.shape[0]):
        slide = project(ports.rows[p], system.state[0])
        ports.values[Port.SLIDE, p] = slide
        sample[first + N_PORT_COLUMNS * p] = 0.0
        sample[first + N_PORT_COLUMNS * p + 1] = 0.0
        ports.vector[p] = 0.0
    for k in range(points.stiffness.size):
        energy += 0.5 * points.stiffness[k] * points.shear[0, k] ** 2
    for j in range(points.port.size):
        p = points.port[j]
        load = points.values[Point.END_LOAD, j]
        state = read(points.numbers, points.memory, j, load)
        energy += state.energy
        force = state.force
        if find_rest_limit(points.numbers, points.memory, j, 1.0) < np.inf:
            limit = find_rest_limit(points.numbers, points.memory, j, load)
            force = min(max(ports.values[Port.HOLD, p], -limit), limit)
        if points.is_spring[j]:
            continue
        slide = ports.values[Port.SLIDE, p]
        for k in range(points.stiffness.size):
            slide -= points.shapes[k, j] * points.shear[0, k]
        weight = load * points.numbers[1, j]
        sample[first + N_PORT_COLUMNS * p] += force
        sample[first + N_PORT_COLUMNS * p + 1] += weight * (slide - state.stretch)
        ports.vector[p] += weight
    for p in range(ports.rows.shape[0]):
        if ports.vector[p] > 0:
            sample[first + N_PORT_COLUMNS * p + 1] /= ports.vector[p]
        else:
            sample[first + N_PORT_COLUMNS * p + 1] = ports.values[Port.SLIDE, p]
    sample[size + Sample.ENERGY] = energy
    heave = int(ports.contact[0])
    sample[size + Sample.LOAD] = system.structure.loads[0] if system.structure.loads.size else 0.0
    if heave >= 0:
        h = ports.values[Port.SLIDE, heave]
        t = ports.values[Port.SLIDE, int(ports.contact[1])]
        contact = compute_energy(system.sets, int(totals[Total.SLOT]), h, t)
        reference = system.sets.reference
        sample[size + Sample.LOAD] = max(reference[REFERENCE_LOAD] - contact[1], 0.0)
        sample[size + Sample.MOMENT] = reference[REFERENCE_MOMENT] - contact[2]
        sample[size + Sample.CONTACT_ENERGY] = contact[0]
        sample[size + Sample.HEAVE] = h
        sample[size + Sample.PITCH] = t


@njit(cache=True, **NJIT_KERNEL)
def march(system, steps, stride, samples):
    """March over a number of whole steps.

    Parameters
    ----------
    system : march_rows.System
        Changed in place.
    steps, stride : int
        Number of steps, and steps between samples with more than the motion.
    samples : (steps + 1, k) array
        Samples before each step and at the end; output.

    Returns
    -------
    int
        Number of steps done.
    int
        Status, named at the top of the module.
    """
    structure = system.structure
    ports = system.ports
    points = system.points
    size = system.state.shape[1]
    ticks = 1 << (structure.responses.shape[0] - 1)
    h = structure.numbers[1]
    level = 0
    for i in range(steps + 1):
        if i % stride == 0 or i == steps:
            write_sample(system, structure.drive[i, 0], samples[i])
        for k in range(size):
            samples[i, k] = system.state[0, k]
        if structure.loads.size:
            samples[i, size + Sample.LOAD] = structure.loads[i]
        output = project(structure.modes[2], system.state[0])
        if not abs(output) <= structure.numbers[2]:
            return i, EXCEEDS_TRAVEL if output == output else NOT_FINITE
        if i == steps:
            break

        first_column = size + Sample.PORTS + 2
        for p in range(ports.rows.shape[0]):
            samples[i, first_column + N_PORT_COLUMNS * p] = 0.0
        work = 0.0
        tick = 0
        while tick < ticks:
            part = ticks >> level
            tau = h * tick / ticks
            coefficients = structure.drive[i]
            drive = (
                coefficients[0] + tau * (coefficients[1] + 0.5 * tau * coefficients[2]),
                coefficients[1] + tau * coefficients[2],
                coefficients[2],
            )
            if not try_step(system, level, i, (tick + part) / ticks, drive):
                level += 1
                continue
            if system.totals[Total.SLOT] < 0:
                return i, NO_CONTACT_SET

            # Mean forces and work of the friction in the whole step.
            for j in range(points.port.size):
                if not points.is_spring[j]:
                    p = points.port[j]
                    force = points.values[Point.FORCE, j]
                    slide = ports.values[Port.INCREMENT, p]
                    if points.numbers[0, j] == Law.COULOMB:
                        force = ports.values[Port.FORCE, p]
                        slide -= ports.values[Port.FREE, p]
                    work += force * slide
                    samples[i, first_column + N_PORT_COLUMNS * p] += force * part / ticks
            tick += part
            if level > 0 and tick % (2 * part) == 0:
                level -= 1
        samples[i, size + Sample.WORK] = work
        system.totals[Total.FRICTION] += work
    return steps, DONE
