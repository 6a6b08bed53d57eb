"""A contact of points under a load that changes in time, `arrays.PressedPoints` (compiled).

The points are elastic-plastic or bonds.

A step is half of the change of load, the slide under the mean load, and the other half, as on a
bench. So a changing load alone never gives energy, and no point keeps more than mu times its load.
The changing load leaves the points out of balance with pieces that deform in shear; a mean alone
would keep that and reverse it in every step. So a step ends with the pieces springing back while
the holder stands. The caller writes the nodal forces at both ends of the step into `pressed`.
`march.loop_kernels` calls the functions whose names do not begin with `rub_`.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, grow, press_point
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws.elastic_plastic_kernels import press_springs, spring_step
from ...friction.protocol_kernels import Reading
from .arrays import PointRow, PressedPlace, SolvedStep, StepProblem
from .shear_points_kernels import PLASTIC, POINTS, write_forces
from .shear_solve_kernels import accept_step, minimise, set_middle_length, set_slides

# residual over the goal, to which pieces that deform in shear are solved; their loss is a small difference
GOAL_FRACTION = 0.01


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def gather_loaded_points(part, contact):
    """Gather the points under load at a fraction of the step, their loads and their modes."""
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
    """Put the points under the load at the middle of the step, and write their memory there."""
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
                contact.force[PressedPlace.INITIAL_DENSITY],
                contact.force[PressedPlace.BOND_LENGTH],
            )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_friction_force(dq, kind, contact):
    """Return the path-mean friction force and its slope for a rigid increment.

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
        [N].
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
    """Solve a step with dq = free - beta force under the mean load; dq = free for beta = 0.

    Returns
    -------
    arrays.SolvedStep
    """
    kind = int(contact.force[PressedPlace.LAW_KIND])
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
    """Return the mean force over a prescribed increment; the memory stays as it is.

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
        Path mean [N].
    is_solved : bool
        Whether it was found.
    """
    solution = solve_step(dq, 0.0, start, contact, goal)
    return solution.mean_force, solution.iterations >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Move points and pieces by a solved step.

    Returns
    -------
    lost : float
        Energy dissipated [J], that of the changing load and of the springing back included.
    is_solved : bool
        Whether the pieces came to balance.
    """
    kind = int(contact.force[PressedPlace.LAW_KIND])
    lost = commit_points(dq, force, start, end_velocity, kind, contact)
    if contact.b.size == 0:
        return lost, True
    more, count = relax_pieces(kind, contact, contact.force[PressedPlace.RESIDUAL_GOAL])
    return lost + more, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return force, stored energy and slip of points and pieces.

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
    return read_points(int(contact.force[PressedPlace.LAW_KIND]), contact, rel_disp)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_points(dq, force, start, end_velocity, kind, contact):
    """Move the memory of the points by a solved step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Path-mean force over dq [N].
    start : arrays.StepStart
    end_velocity : float
        Relative velocity at the end of the step [m/s].
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    contact : arrays.PressedPoints

    Returns
    -------
    float
        Energy dissipated [J], that of the changing load included.
    """
    length = contact.force[PressedPlace.BOND_LENGTH]
    memory = contact.memory
    points = contact.points
    lost = force * dq + elastic_energy(kind, contact) if kind == PLASTIC else 0.0
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
            lost += 0.5 * contact.weight[i] * (memory[2, j] - points[PointRow.SQUARED_STRETCH, i])
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
                contact.force[PressedPlace.INITIAL_DENSITY],
                length,
            )
            lost += 0.5 * contact.weight[i] * (part + s2 - memory[2, j])
    accept_step(contact)
    if kind == PLASTIC:
        return lost - elastic_energy(kind, contact)
    contact.eps[0] = grow(
        contact.eps[0], start.velocity, end_velocity, abs(dq), start.dt, contact.growth
    )[0]
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_pieces(kind, contact, goal):
    """Bring pieces and points to balance while the holder stands.

    The load is that at the end of the step.

    Returns
    -------
    lost : float
        Energy [J].
    iterations : int
        Below 0 where it failed.
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
                memory[0, j], memory[1, j], load, xi, contact.force[PressedPlace.BOND_LENGTH]
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
    """Return the elastic energy of memory and pieces [J]."""
    out = 0.0
    mu = contact.force[PressedPlace.MU_STATIC]
    length = contact.force[PressedPlace.BOND_LENGTH]
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
    mu = contact.force[PressedPlace.MU_STATIC]
    length = contact.force[PressedPlace.BOND_LENGTH]
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
