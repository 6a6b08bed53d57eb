"""A contact of bond points behind shear modes, `arrays.ShearedPoints` (compiled).

The load is constant.

For most of a cycle of gross slip all points drag: their bonds are those of a slide without end,
and a further slide in the same direction has the force weight length load at every point, whatever
its size. Such a step has a closed form in the modes alone (`solve_dragging_step`). The slide of a
point is that of the holder minus psi^T b at all times. `march.loop_kernels` calls the functions of
every contact.
"""

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import bond_step, elastic_bond_step, grow, short_bond_step
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from .arrays import BondSums, DragRow, FlowPlace, PointRow, SolvedStep, StepProblem
from .shear_points_kernels import POINTS, are_slides_short
from .shear_solve_kernels import accept_step, minimise, set_middle_length

# difference of the bonds of a point from those of a drag, over the latter; that of their energy is 100 times as large
DRAG_TOL = 2e-15


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve a step with dq = free - beta force, like `element_kernels.solve_step`.

    Returns
    -------
    arrays.SolvedStep
        No iterations where all points drag.
    """
    if contact.flow[FlowPlace.DRAG_DIRECTION] != 0.0 and solve_dragging_step(free, beta, contact):
        force = contact.flow[FlowPlace.DRAG_DIRECTION] * contact.drag[DragRow.FORCE, 0]
        return SolvedStep(contact.y[0, 0], force, 0)
    contact.flow[FlowPlace.DRAG_DIRECTION] = 0.0
    set_middle_length(start.velocity, start.dt, contact)
    force, count = minimise(StepProblem(free, beta, POINTS, False), contact, goal)
    return SolvedStep(contact.y[0, 0], force, count)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_dragging_step(free, beta, contact):
    """Solve a step in which all points drag.

    The solution is that of kappa (b + db/2) = psi^T f.

    Parameters
    ----------
    free : float
        Increment without friction [m].
    beta : float
        Compliance of the modes in the step [m/N].
    contact : arrays.ShearedPoints

    Returns
    -------
    bool
        Whether all points drag on in this step; contact.y[0] is then its solution.
    """
    way = contact.flow[FlowPlace.DRAG_DIRECTION]
    y = contact.y[0]
    least = 0.0
    dq = free - beta * way * contact.drag[DragRow.FORCE, 0]
    for k in range(contact.b.size):
        y[k + 1] = 2 * (way * contact.drag[DragRow.FORCE, k + 1] / contact.kappa[k] - contact.b[k])
        least += contact.drag[DragRow.MAX_SLIDE, k + 1] * abs(y[k + 1])
    if way * dq <= least:
        return False
    y[0] = dq
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean force over a prescribed increment; the memory stays as it is.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.ShearedPoints
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Path mean [N].
    is_solved : bool
        Whether it was found.
    """
    contact.flow[FlowPlace.DRAG_DIRECTION] = 0.0
    contact.y[0, 0] = dq
    solution = solve_step(dq, 0.0, start, contact, goal)
    return solution.mean_force, solution.iterations >= 0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def commit_step(dq, force, start, end_velocity, contact):
    """Move points and pieces by a solved step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Path mean over dq [N].
    start : arrays.StepStart
    end_velocity : float
        Relative velocity at the end of the step [m/s].
    contact : arrays.ShearedPoints

    Returns
    -------
    loss : float
        Energy dissipated [J].
    is_solved : bool
        Always true.
    """
    way = contact.flow[FlowPlace.DRAG_DIRECTION]
    length = contact.eps[1]
    lost = 0.0
    contact.flow[FlowPlace.TOTAL_SLIDE] += dq
    if way != 0.0:
        for k in range(contact.y.shape[1]):
            lost += (
                way * contact.drag[DragRow.FORCE, k] * contact.y[0, k] * (1.0 if k == 0 else -1.0)
            )
        accept_step(contact)
        return lost, True
    loose = contact.growth[5] * length
    if loose == 0.0 and are_slides_short(contact, length):
        lost = move_points_short(contact, length)
    else:
        lost = move_points(contact, loose, length)
    accept_step(contact)
    contact.eps[0] = grow(
        contact.eps[0], start.velocity, end_velocity, abs(dq), start.dt, contact.growth
    )[0]
    if contact.growth[0] < 0.0 and loose == 0.0:
        contact.flow[FlowPlace.DRAG_DIRECTION] = find_drag_direction(
            1.0 if dq > 0.0 else -1.0, contact
        )
    return lost / 2, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_drag_direction(way, contact):
    """Return the direction if all points drag in it, else 0."""
    points = contact.points
    length = contact.eps[0]
    for j in range(contact.weight.size):
        load = points[PointRow.LOAD, j]
        if not (
            abs(points[PointRow.STRETCH, j] - way * length * load) <= DRAG_TOL * length * load
            and abs(points[PointRow.DENSITY, j] - load) <= DRAG_TOL * load
            and abs(points[PointRow.SQUARED_STRETCH, j] - 2 * length * length * load)
            <= 100 * DRAG_TOL * length * length * load
        ):
            return 0.0
    return way


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def move_points_short(contact, length):
    """Move all points by slides below MAX_SHORT_PATH bond lengths.

    Returns twice the energy dissipated [J].
    """
    points = contact.points
    lost = 0.0
    for j in range(contact.weight.size):
        xi = points[PointRow.SLIDE, j]
        (
            points[PointRow.DENSITY, j],
            points[PointRow.STRETCH, j],
            points[PointRow.SQUARED_STRETCH, j],
            part,
        ) = short_bond_step(
            points[PointRow.DENSITY, j],
            points[PointRow.STRETCH, j],
            points[PointRow.SQUARED_STRETCH, j],
            xi,
            points[PointRow.LOAD, j],
            length,
        )
        lost += contact.weight[j] * part
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def move_points(contact, loose, length):
    """Move all points by slides of any size.

    Parameters
    ----------
    contact : arrays.ShearedPoints
    loose : float
        Half the elastic range of the bonds [m].
    length : float
        Bond length [m].

    Returns
    -------
    float
        Twice the energy dissipated [J].
    """
    points = contact.points
    lost = 0.0
    for j in range(contact.weight.size):
        m = points[PointRow.DENSITY, j]
        z = points[PointRow.STRETCH, j]
        s2 = points[PointRow.SQUARED_STRETCH, j]
        xi = points[PointRow.SLIDE, j]
        if loose > 0.0:
            (m, z, s2, part), points[PointRow.PLAY, j] = elastic_bond_step(
                m, z, s2, points[PointRow.PLAY, j], loose, xi, points[PointRow.LOAD, j], length
            )
        else:
            m, z, s2, part = bond_step(m, z, s2, xi, points[PointRow.LOAD, j], length)
        points[PointRow.DENSITY, j] = m
        points[PointRow.STRETCH, j] = z
        points[PointRow.SQUARED_STRETCH, j] = s2
        lost += contact.weight[j] * part
    return lost


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return force, stored energy and slip of points and pieces.

    Parameters
    ----------
    contact : arrays.ShearedPoints
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    way = contact.flow[FlowPlace.DRAG_DIRECTION]
    energy = 0.0
    slip = contact.flow[FlowPlace.TOTAL_SLIDE]
    for k in range(contact.b.size):
        energy += 0.5 * contact.kappa[k] * contact.b[k] ** 2
        slip -= contact.drag[DragRow.MEAN_SLIDE, k + 1] * contact.b[k]
    if way != 0.0:
        limit = contact.drag[DragRow.FORCE, 0]
        energy += contact.eps[0] * limit
        return Reading(way * limit, energy, slip - way * contact.eps[0])
    sums = sum_bonds(contact)
    slip = slip - sums.stretch / sums.load if sums.load > 0 else rel_disp
    return Reading(sums.force, energy + sums.energy, slip)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sum_bonds(contact):
    """Return the `BondSums` of the points."""
    points = contact.points
    force = 0.0
    energy = 0.0
    stretch = 0.0
    total = 0.0
    for j in range(contact.weight.size):
        m = points[PointRow.DENSITY, j]
        z = points[PointRow.STRETCH, j]
        share = contact.weight[j] * points[PointRow.LOAD, j]
        force += contact.weight[j] * z
        energy += 0.5 * contact.weight[j] * points[PointRow.SQUARED_STRETCH, j]
        stretch += share * (z / m) if m > 0.0 else 0.0
        total += share if m > 0.0 else 0.0
    return BondSums(force, energy, stretch, total)
