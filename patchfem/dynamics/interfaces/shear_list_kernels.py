"""A contact of lists of bonds behind shear modes, `arrays.ShearedLists` (compiled).

Where the pressure of a point changes, with the load or as it slides over the lower piece, a bond
keeps the pressure under which it formed, and a point that lifts off loses its bonds with all
energy that they store. `march.loop_kernels` calls the functions of every contact.
"""

from ...compiled.jit import njit
from ...friction.bonds.list_kernels import list_step
from ...friction.bonds.list_rows_kernels import CLOCK, LAW, STATUS
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from . import shear_solve_kernels as solver
from .list_kernels import add_list_energies
from .shear_kernels import MEAN_SLIDE, TOTAL_SLIDE
from .shear_lists_kernels import (
    GROWTH_SPEED,
    LAST_SPEED,
    find_pressure,
    has_changing_pressure,
    load_list,
    start_step,
    store_list,
)
from .shear_points_kernels import FORCE, SLIDE

# position in `ShearedLists.flow`: 1 once a list is full
IS_FULL = 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, q, v, dt, c, goal):
    """Solve a step with dq = free - beta force, as `element_kernels.solve_step`.

    Returns
    -------
    dq : float
    force : float
    iterations : int
        Below 0 where it failed.
    """
    start_step(dt, c)
    if beta == 0.0:
        c.y[0, 0] = free
    force, count = solver.minimise(free, beta, 0, False, c, goal)
    return c.y[0, 0], (free - c.y[0, 0]) / beta if beta > 0.0 else force, count


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, q, v, dt, c, goal):
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
    c : arrays.ShearedLists
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Path mean [N].
    is_solved : bool
        Whether it was found.
    """
    start_step(dt, c)
    c.y[0, 0] = dq
    force, count = solver.minimise(dq, 0.0, 0, False, c, goal)
    return force, count >= 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit_step(dq, force, q, v0, v1, dt, c):
    """Move lists and pieces by a solved step; the lists sum up what they dissipate and create.

    Returns
    -------
    work : float
        That is not stored [J].
    has_room : bool
        Whether every list had room.
    """
    points = c.points
    before = stored_energy(c)
    fine = True
    changes = has_changing_pressure(c)
    c.flow[TOTAL_SLIDE] += dq
    for j in range(int(c.count[0])):
        load_list(j, c)
        xi = points[SLIDE, j]
        energy = c.status[STATUS.energy]
        speed = abs(xi) / dt
        fine = list_step(xi, c, speed, speed, dt) and fine
        if changes:
            c.nows[j, CLOCK.displacement] = c.now[CLOCK.displacement]
            if find_pressure(j, c) <= 0.0:
                break_bonds(c.status)
        add_list_energies(points[FORCE, j] * xi, energy, c.weight[j], c)
        store_list(j, c)
        points[GROWTH_SPEED, j] = max(1.5 * speed - 0.5 * points[LAST_SPEED, j], 0.0)
        points[LAST_SPEED, j] = speed
    solver.accept_step(c)
    c.flow[IS_FULL] = 0.0 if fine else 1.0
    return force * dq - (stored_energy(c) - before), fine


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def break_bonds(status):
    """Break all bonds of a list."""
    status[STATUS.head] = status[STATUS.end] = status[STATUS.room_start]
    status[STATUS.n_spread] = status[STATUS.n_after_merge] = 0.0
    status[STATUS.energy] = status[STATUS.force] = status[STATUS.initial_pressure] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stored_energy(c):
    """Return the energy of lists and pieces [J]."""
    energy = 0.0
    for k in range(c.b.size):
        energy += 0.5 * c.kappa[k] * c.b[k] ** 2
    for j in range(int(c.count[0])):
        energy += c.weight[j] * (c.statuses[j, STATUS.energy] - c.statuses[j, STATUS.owed])
    return energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(c, q, v):
    """Return force, stored energy and slip of lists and pieces.

    Parameters
    ----------
    c : arrays.ShearedLists
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
    force = 0.0
    total = 0.0
    slip = c.flow[TOTAL_SLIDE]
    if has_changing_pressure(c):
        slip = 0.0
        for j in range(int(c.count[0])):
            here = c.weight[j] * find_pressure(j, c)
            force += c.weight[j] * c.statuses[j, STATUS.force]
            slip += here * c.nows[j, CLOCK.displacement]
            total += here
        return (
            force,
            stored_energy(c),
            (slip - c.law[LAW.length] * force) / total if total > 0 else q,
        )
    for k in range(c.b.size):
        slip -= c.drag[MEAN_SLIDE, k + 1] * c.b[k]
    for j in range(int(c.count[0])):
        force += c.weight[j] * c.statuses[j, STATUS.force]
        total += c.weight[j]
    return force, stored_energy(c), slip - c.law[LAW.length] * force / total if total > 0 else q
