"""Contact functions of bond lists coupled by shear modes (compiled).

The arrays are `arrays.ShearedLists`. Where the pressure of a point varies, with the load or as it
slides over the lower piece, a bond keeps the pressure under which it formed, and a point that lifts
off loses its bonds with all energy that they store. `march.loop_kernels` calls the functions of
every contact.
"""

from ...compiled.jit import njit
from ...friction.bonds.list_rows_kernels import LAW, PATH, STATUS
from ...friction.bonds.list_step_kernels import break_bonds
from ...friction.bonds.points_kernels import ListStep, advance, point_list
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from . import shear_solve_kernels as solver
from .arrays import FullSlipRow, ListPointRow, PointRow, SlipStateIndex, SolvedStep, StepProblem
from .list_kernels import add_list_energies
from .shear_lists_kernels import (
    find_pressure,
    has_changing_pressure,
    start_step,
)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(free, beta, start, contact, goal):
    """Solve the slide increment and mean friction force of a step.

    Parameters are those of `element_kernels.solve_step`.

    Returns
    -------
    arrays.SolvedStep
    """
    start_step(start.dt, contact)
    if beta == 0.0:
        contact.y[0, 0] = free
    force, count = solver.minimise(StepProblem(free, beta, 0, False), contact, goal)
    if beta > 0.0:
        force = (free - contact.y[0, 0]) / beta
    return SolvedStep(contact.y[0, 0], force, count)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_increment(dq, start, contact, goal):
    """Return the mean friction force over a prescribed increment without updating the lists.

    Parameters
    ----------
    dq : float
        Increment of the relative displacement [m].
    start : arrays.StepStart
    contact : arrays.ShearedLists
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
    """Update the lists of bonds and the pieces after a converged step.

    The lists accumulate their dissipated and created energies.

    Returns
    -------
    work : float
        Work that is not stored [J].
    has_room : bool
        Whether the capacity of every list sufficed.
    """
    points = contact.points
    before = stored_energy(contact)
    has_room = True
    changes = has_changing_pressure(contact)
    contact.slip_state[SlipStateIndex.TOTAL_SLIDE] += dq
    for j in range(int(contact.count[0])):
        bonds = point_list(contact, j)
        xi = points[PointRow.SLIDE, j]
        energy = bonds.status[STATUS.energy]
        speed = abs(xi) / start.dt
        step = ListStep(xi, start.dt, speed, speed)
        has_room = advance(contact, j, bonds.status[STATUS.pressure], step) and has_room
        if changes and find_pressure(j, contact) <= 0.0:
            break_bonds(0, bonds)
        work = points[PointRow.FORCE, j] * xi
        add_list_energies(work, energy, contact.weight[j], contact.law, bonds.status)
        points[ListPointRow.GROWTH_SPEED, j] = max(
            1.5 * speed - 0.5 * points[ListPointRow.LAST_SPEED, j], 0.0
        )
        points[ListPointRow.LAST_SPEED, j] = speed
    solver.accept_step(contact)
    contact.slip_state[SlipStateIndex.IS_FULL] = 0.0 if has_room else 1.0
    return force * dq - (stored_energy(contact) - before), has_room


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stored_energy(contact):
    """Return the energy [J] stored in the lists of bonds and the shear modes of the pieces."""
    energy = 0.0
    for k in range(contact.b.size):
        energy += 0.5 * contact.kappa[k] * contact.b[k] ** 2
    for j in range(int(contact.count[0])):
        energy += contact.weight[j] * (
            contact.statuses[j, STATUS.energy] - contact.statuses[j, STATUS.owed]
        )
    return energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_state(contact, rel_disp, velocity):
    """Return friction force, stored energy and slip of lists and pieces.

    Parameters
    ----------
    contact : arrays.ShearedLists
    rel_disp : float
        Relative displacement [m].
    velocity : float
        Relative velocity [m/s].

    Returns
    -------
    friction.protocol_kernels.Reading
    """
    force = 0.0
    total = 0.0
    slip = 0.0
    if has_changing_pressure(contact):
        for j in range(int(contact.count[0])):
            load = contact.weight[j] * find_pressure(j, contact)
            force += contact.weight[j] * contact.statuses[j, STATUS.force]
            slip += load * contact.nows[j, PATH.displacement]
            total += load
        slip = (slip - contact.law[LAW.length] * force) / total if total > 0 else rel_disp
        return Reading(force, stored_energy(contact), slip)
    slip = contact.slip_state[SlipStateIndex.TOTAL_SLIDE]
    for k in range(contact.b.size):
        slip -= contact.full_slip[FullSlipRow.MEAN_SLIDE, k + 1] * contact.b[k]
    for j in range(int(contact.count[0])):
        force += contact.weight[j] * contact.statuses[j, STATUS.force]
        total += contact.weight[j]
    slip = slip - contact.law[LAW.length] * force / total if total > 0 else rel_disp
    return Reading(force, stored_energy(contact), slip)
