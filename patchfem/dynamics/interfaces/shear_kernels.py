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
from .shear_points_kernels import (
    DENSITY,
    LOAD,
    PLAY,
    POINTS,
    SLIDE,
    SQUARED_STRETCH,
    STRETCH,
    are_slides_short,
)
from .shear_solve_kernels import accept_step, minimise, set_middle_length

# rows of `ShearedPoints.drag`: force, largest slide of a point per coordinate, mean slide of the points
DRAG_FORCE = 0
MAX_MODE_SLIDE = 1
MEAN_SLIDE = 2
# positions in `ShearedPoints.flow`: direction of the drag, and slide of the holder
DRAG_DIRECTION = 0
TOTAL_SLIDE = 1
# difference of the bonds of a point from those of a drag, over the latter; that of their energy is 100 times as large
DRAG_TOL = 2e-15


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def solve_step(free, beta, q, v, dt, contact, goal):
    """Solve a step with dq = free - beta force, like `element_kernels.solve_step`.

    Returns
    -------
    dq : float
    force : float
    iterations : int
        0 where all points drag, below 0 where it failed.
    """
    if contact.flow[DRAG_DIRECTION] != 0.0 and solve_dragging_step(free, beta, contact):
        return contact.y[0, 0], contact.flow[DRAG_DIRECTION] * contact.drag[DRAG_FORCE, 0], 0
    contact.flow[DRAG_DIRECTION] = 0.0
    set_middle_length(v, dt, contact)
    force, count = minimise(free, beta, POINTS, False, contact, goal)
    return contact.y[0, 0], force, count


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
    way = contact.flow[DRAG_DIRECTION]
    y = contact.y[0]
    least = 0.0
    dq = free - beta * way * contact.drag[DRAG_FORCE, 0]
    for k in range(contact.b.size):
        y[k + 1] = 2 * (way * contact.drag[DRAG_FORCE, k + 1] / contact.kappa[k] - contact.b[k])
        least += contact.drag[MAX_MODE_SLIDE, k + 1] * abs(y[k + 1])
    if way * dq <= least:
        return False
    y[0] = dq
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, q, v, dt, contact, goal):
    """Return the mean force over a prescribed increment; the memory stays as it is.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].
    dt : float
        Duration of the step [s].
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
    contact.flow[DRAG_DIRECTION] = 0.0
    set_middle_length(v, dt, contact)
    contact.y[0, 0] = dq
    force, count = minimise(dq, 0.0, POINTS, False, contact, goal)
    return force, count >= 0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def commit_step(dq, force, q, v0, v1, dt, contact):
    """Move points and pieces by a solved step.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    force : float
        Path mean over dq [N].
    q : float
        Relative displacement [m].
    v0 : float
        Velocity at the start of the step [m/s].
    v1 : float
        Velocity at the end of the step [m/s].
    dt : float
        Duration of the step [s].
    contact : arrays.ShearedPoints

    Returns
    -------
    loss : float
        Energy dissipated [J].
    is_solved : bool
        Always true.
    """
    way = contact.flow[DRAG_DIRECTION]
    length = contact.eps[1]
    lost = 0.0
    contact.flow[TOTAL_SLIDE] += dq
    if way != 0.0:
        for k in range(contact.y.shape[1]):
            lost += way * contact.drag[DRAG_FORCE, k] * contact.y[0, k] * (1.0 if k == 0 else -1.0)
        accept_step(contact)
        return lost, True
    loose = contact.growth[5] * length
    lost = (
        move_points_short(contact, length)
        if loose == 0.0 and are_slides_short(contact, length)
        else move_points(contact, loose, length)
    )
    accept_step(contact)
    contact.eps[0] = grow(contact.eps[0], v0, v1, abs(dq), dt, contact.growth)[0]
    if contact.growth[0] < 0.0 and loose == 0.0:
        contact.flow[DRAG_DIRECTION] = find_drag_direction(1.0 if dq > 0.0 else -1.0, contact)
    return lost / 2, True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_drag_direction(way, contact):
    """Return the direction if all points drag in it, else 0."""
    points = contact.points
    length = contact.eps[0]
    for j in range(contact.weight.size):
        load = points[LOAD, j]
        if not (
            abs(points[STRETCH, j] - way * length * load) <= DRAG_TOL * length * load
            and abs(points[DENSITY, j] - load) <= DRAG_TOL * load
            and abs(points[SQUARED_STRETCH, j] - 2 * length * length * load)
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
        xi = points[SLIDE, j]
        points[DENSITY, j], points[STRETCH, j], points[SQUARED_STRETCH, j], part = short_bond_step(
            points[DENSITY, j],
            points[STRETCH, j],
            points[SQUARED_STRETCH, j],
            xi,
            points[LOAD, j],
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
        m = points[DENSITY, j]
        z = points[STRETCH, j]
        s2 = points[SQUARED_STRETCH, j]
        xi = points[SLIDE, j]
        if loose > 0.0:
            (m, z, s2, part), points[PLAY, j] = elastic_bond_step(
                m, z, s2, points[PLAY, j], loose, xi, points[LOAD, j], length
            )
        else:
            m, z, s2, part = bond_step(m, z, s2, xi, points[LOAD, j], length)
        points[DENSITY, j] = m
        points[STRETCH, j] = z
        points[SQUARED_STRETCH, j] = s2
        lost += contact.weight[j] * part
    return lost


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def read_state(contact, q, v):
    """Return force, stored energy and slip of points and pieces.

    Parameters
    ----------
    contact : arrays.ShearedPoints
    q : float
        Relative displacement [m].
    v : float
        Relative velocity at the start of the step [m/s].

    Returns
    -------
    force : float
        [N].
    energy : float
        Stored energy [J].
    slip : float
        [m].
    """
    way = contact.flow[DRAG_DIRECTION]
    energy = 0.0
    slip = contact.flow[TOTAL_SLIDE]
    for k in range(contact.b.size):
        energy += 0.5 * contact.kappa[k] * contact.b[k] ** 2
        slip -= contact.drag[MEAN_SLIDE, k + 1] * contact.b[k]
    if way != 0.0:
        return (
            way * contact.drag[DRAG_FORCE, 0],
            energy + contact.eps[0] * contact.drag[DRAG_FORCE, 0],
            slip - way * contact.eps[0],
        )
    force, stored, stretch, total = sum_bonds(contact)
    return force, energy + stored, slip - stretch / total if total > 0 else q


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sum_bonds(contact):
    """Return the sums of force [N], energy [J], stretch [N m] and load [N] of the points.

    The stretch counts times the load.
    """
    points = contact.points
    force = 0.0
    energy = 0.0
    stretch = 0.0
    total = 0.0
    for j in range(contact.weight.size):
        m = points[DENSITY, j]
        z = points[STRETCH, j]
        share = contact.weight[j] * points[LOAD, j]
        force += contact.weight[j] * z
        energy += 0.5 * contact.weight[j] * points[SQUARED_STRETCH, j]
        stretch += share * (z / m) if m > 0.0 else 0.0
        total += share if m > 0.0 else 0.0
    return force, energy, stretch, total
