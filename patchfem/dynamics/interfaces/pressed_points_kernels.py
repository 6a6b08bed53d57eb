"""Contact functions of points under a time-varying normal load (compiled).

The arrays are `arrays.PressedPoints`; the points are elastic-plastic or bonds.

A step consists of half the change of load, the slide under the mean load, and the other half (as in
Strang splitting). So a changing load alone never creates energy, and no point carries more than mu times its load.
The changing load leaves the points out of equilibrium with pieces that deform in shear; a mean force alone
would retain this imbalance and reverse it in every step. So a step ends with the relaxation of the pieces while
the holder is at rest. The caller writes the nodal forces at both ends of the step into `pressed`.
`march.loop_kernels` calls the functions whose names do not begin with `rub_`.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, grow, press_point
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws.elastic_plastic_kernels import press_springs, spring_step
from ...friction.protocol_kernels import Reading
from .arrays import PointRow, PressedIndex, SolvedStep, StepProblem
from .shear_points_kernels import PLASTIC, POINTS, write_forces
from .shear_solve_kernels import accept_step, minimise, set_middle_length, set_slides

# Tolerance for pieces that deform in shear, relative to that of the step; their energy loss is a
# small difference of large terms.
GOAL_FRACTION = 0.01


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def gather_loaded_points(part, contact):
    """Gather the loads and shear modes of the points under load at a fraction of the step."""
    count = 0
    under = contact.under
    same = True
    for j in range(contact.pressed.shape[1]):
        load = (1 - part) * contact.pressed[0, j] + part * contact.pressed[1, j]
        if load > 0.0:
            same = same and under[count] == j
            under[count] = j
            contact.points[PointRow.LOAD, count] = load
            count += 1
    if not same or contact.count[0] < count:
        for k in range(contact.kappa.size):
            for i in range(count):
                contact.psi[k, i] = contact.modes[k, under[i]]
    contact.count[0] = count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_points(kind, contact):
    """Set the load of the points to that at mid-step, and update their memory for it."""
    gather_loaded_points(0.5, contact)
    memory = contact.memory
    points = contact.points
    for i in range(contact.count[0]):
        j = contact.under[i]
        if kind == PLASTIC:
            points[PointRow.DENSITY, i], points[PointRow.STRETCH, i] = press_springs(
                memory[0, j], memory[1, j], points[PointRow.LOAD, i]
            )
        else:
            (
                points[PointRow.DENSITY, i],
                points[PointRow.STRETCH, i],
                points[PointRow.SQUARED_STRETCH, i],
            ) = press_point(
                (memory[0, j], memory[1, j], memory[2, j]),
                contact.pressed[0, j],
                points[PointRow.LOAD, i],
                contact.force[PressedIndex.INITIAL_DENSITY],
                contact.force[PressedIndex.BOND_LENGTH],
            )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_friction_force(dq, kind, contact):
    """Return the path-mean friction force and its slope for a common increment of all points.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    contact : arrays.PressedPoints

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    slope : float
        [N/m].
    """
    set_slides(dq, contact.b, contact)
    force = write_forces(kind, False, contact)
    slope = 0.0
    for i in range(contact.count[0]):
        slope += contact.points[PointRow.SLOPE, i]
    return force, slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve the slide increment and mean friction force of a step under the mean load.

    The equation is dq = free - beta force, with dq = free for beta = 0.

    Returns
    -------
    arrays.SolvedStep
    """
    kind = int(contact.force[PressedIndex.LAW_KIND])
    if kind == POINTS:
        set_middle_length(start.velocity, start.dt, contact)
    press_points(kind, contact)
    if beta == 0.0:
        contact.y[0, 0] = free
    force, count = minimise(StepProblem(free, beta, kind, False), contact, GOAL_FRACTION * goal)
    if beta > 0.0:
        force = (free - contact.y[0, 0]) / beta
    return SolvedStep(contact.y[0, 0], force, count)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean friction force over a prescribed increment without updating the memory.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.PressedPoints
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    is_solved : bool
        Whether the solution converged.
    """
    solution = solve_step(dq, 0.0, start, contact, goal)
    return solution.mean_force, solution.iterations >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Update the points and relax the pieces after a converged step.

    Returns
    -------
    lost : float
        Energy dissipated [J], including that of the changing load and of the relaxation.
    is_solved : bool
        Whether the relaxation converged.
    """
    kind = int(contact.force[PressedIndex.LAW_KIND])
    dissipated = commit_points(dq, force, start, end_velocity, kind, contact)
    if contact.b.size == 0:
        return dissipated, True
    relaxation_loss, count = relax_pieces(kind, contact, contact.force[PressedIndex.RESIDUAL_GOAL])
    return dissipated + relaxation_loss, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return friction force, stored energy and slip of points and pieces.

    Parameters
    ----------
    contact : arrays.PressedPoints
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    return read_points(int(contact.force[PressedIndex.LAW_KIND]), contact, rel_disp)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_points(dq, force, start, end_velocity, kind, contact):
    """Update the memory of the points after a converged step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Mean of the force over the path dq [N].
    start : arrays.StepStart
    end_velocity : float
        Relative velocity at the end of the step [m/s].
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    contact : arrays.PressedPoints

    Returns
    -------
    float
        Energy dissipated [J], including that of the changing load.
    """
    length = contact.force[PressedIndex.BOND_LENGTH]
    memory = contact.memory
    points = contact.points
    dissipated = force * dq + elastic_energy(kind, contact) if kind == PLASTIC else 0.0
    for i in range(contact.count[0]):
        j = contact.under[i]
        load = points[PointRow.LOAD, i]
        xi = points[PointRow.SLIDE, i]
        if kind == PLASTIC:
            y, springs = spring_step(
                points[PointRow.DENSITY, i], points[PointRow.STRETCH, i], load, xi, length
            )
            memory[0, j], memory[1, j] = press_springs(y, springs, contact.pressed[1, j])
        else:
            dissipated += (
                0.5 * contact.weight[i] * (memory[2, j] - points[PointRow.SQUARED_STRETCH, i])
            )
            m, z, s2, part = bond_step(
                points[PointRow.DENSITY, i],
                points[PointRow.STRETCH, i],
                points[PointRow.SQUARED_STRETCH, i],
                xi,
                load,
                contact.eps[1],
            )
            memory[0, j], memory[1, j], memory[2, j] = press_point(
                (m, z, s2),
                load,
                contact.pressed[1, j],
                contact.force[PressedIndex.INITIAL_DENSITY],
                length,
            )
            dissipated += 0.5 * contact.weight[i] * (part + s2 - memory[2, j])
    accept_step(contact)
    if kind == PLASTIC:
        return dissipated - elastic_energy(kind, contact)
    contact.eps[0] = grow(
        contact.eps[0], start.velocity, end_velocity, abs(dq), start.dt, contact.growth
    )[0]
    return dissipated


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_pieces(kind, contact, goal):
    """Relax the pieces to equilibrium with the points while the holder is at rest.

    The load is that at the end of the step.

    Returns
    -------
    lost : float
        Energy dissipated [J].
    iterations : int
        Number of iterations, below 0 if the relaxation failed.
    """
    memory = contact.memory
    points = contact.points
    y = contact.y[1]
    gather_loaded_points(1.0, contact)
    before = elastic_energy(kind, contact)
    for i in range(contact.count[0]):
        points[PointRow.DENSITY, i] = memory[0, contact.under[i]]
        points[PointRow.STRETCH, i] = memory[1, contact.under[i]]
    y[:] = 0.0
    problem = StepProblem(0.0, 0.0, kind, True)
    _, count = minimise(problem, contact, GOAL_FRACTION * goal)
    for i in range(contact.count[0]):
        j = contact.under[i]
        load = points[PointRow.LOAD, i]
        xi = points[PointRow.SLIDE, i]
        if kind == PLASTIC:
            a, b = spring_step(
                memory[0, j], memory[1, j], load, xi, contact.force[PressedIndex.BOND_LENGTH]
            )
            memory[0, j], memory[1, j] = press_springs(a, b, load)
        else:
            memory[0, j], memory[1, j], memory[2, j], _ = bond_step(
                memory[0, j], memory[1, j], memory[2, j], xi, load, contact.eps[0]
            )
    for k in range(contact.b.size):
        contact.b[k] += y[k + 1]
    return before - elastic_energy(kind, contact), count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def elastic_energy(kind, contact):
    """Return the elastic energy [J] of the points and the shear modes of the pieces."""
    out = 0.0
    mu = contact.force[PressedIndex.MU_STATIC]
    length = contact.force[PressedIndex.BOND_LENGTH]
    memory = contact.memory
    for k in range(contact.b.size):
        out += 0.5 * contact.kappa[k] * contact.b[k] * contact.b[k]
    for i in range(contact.count[0]):
        j = contact.under[i]
        if kind == PLASTIC:
            if memory[1, j] > 0:
                out += 0.5 * mu * length * memory[0, j] * memory[0, j] / memory[1, j]
        else:
            out += 0.5 * mu / length * memory[2, j]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_points(kind, contact, rel_disp):
    """Return friction force, stored energy and slip of points and pieces.

    Parameters
    ----------
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    contact : arrays.PressedPoints
    rel_disp : float
        Relative displacement [m].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    mu = contact.force[PressedIndex.MU_STATIC]
    length = contact.force[PressedIndex.BOND_LENGTH]
    memory = contact.memory
    points = contact.points
    force = 0.0
    slip = 0.0
    total = 0.0
    gather_loaded_points(1.0, contact)
    set_slides(rel_disp, contact.b, contact)
    for i in range(contact.count[0]):
        j = contact.under[i]
        if kind == PLASTIC:
            force += mu * memory[0, j]
            stretch = length * memory[0, j] / memory[1, j] if memory[1, j] > 0 else 0.0
        else:
            force += mu / length * memory[1, j]
            stretch = memory[1, j] / memory[0, j] if memory[0, j] > 0 else 0.0
        slip += points[PointRow.LOAD, i] * (points[PointRow.SLIDE, i] - stretch)
        total += points[PointRow.LOAD, i]
    slip = slip / total if total > 0 else rel_disp
    return Reading(force, elastic_energy(kind, contact), slip)
