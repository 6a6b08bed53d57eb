"""Step solution of a contact and several elements by block descent on their forces.

A port is a row of slides. The contact, if there is one, acts on port 0, and every element on its own port. Over a step the
path-mean forces F satisfy d = free - beta F together with every law. Each law is solved in turn under the forces of the
others, which is block descent on a convex problem for laws that dissipate. All set-valued elements are one block, which is
followed from stop to release inside the step (`stops_kernels`). If that fails, `solve_coupled_forces` finds mean forces over
the entire step, which always exist. Where the sweeps converge slowly, a Newton step on all forces takes over
(`together_kernels`). The text runs with any contact and any laws; `instances` makes an instance of it.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws.coulomb_kernels import solve_coulomb_step
from ...friction.protocol_kernels import Reading
from ..interfaces import element_kernels as contact
from ..interfaces import element_solve_kernels as solver
from ..interfaces.arrays import LawStep, SolvedStep
from ..ledger import N_SAMPLE_COLUMNS, SampleColumn
from ..modal_kernels import free_increment, free_rate, project_modes, write_end_state
from . import parts_kernels as parts
from . import stops_kernels as stop_kernels
from . import together_kernels as together
from .element_arrays import (
    N_ELEMENT_COLUMNS,
    ComplianceRow,
    ContactIndex,
    ElementRow,
    FaceRow,
    LimitRow,
    LinkRow,
    ModalRow,
    PortRow,
)
from .stops_kernels import SET_VALUED

# Numba omits the branches of flags that are False.
HAS_STOPS = parts.HAS_STOPS
HAS_SLOPES = parts.HAS_SLOPES
HAS_CONTACT = parts.HAS_CONTACT
IS_COUPLED = parts.IS_COUPLED
# Largest number of sweeps of the block descent over all elements; it has then failed.
MAX_SWEEPS = 1000
# Largest number of sweeps if stops and releases lie inside the step; the
# first half determines these events.
MAX_EVENT_SWEEPS = 60
# Tolerance of an element solution within a sweep, relative to the
# tolerance of the element in the step.
FORCE_GOAL_FRACTION = 0.1
# Ratio of the force changes in two successive sweeps above which the convergence is slow.
SLOW_CONVERGENCE_RATIO = 0.2
# Number of sweeps before the first Newton step on all forces; up to this number,
# sweeps cost less than that step.
FIRST_NEWTON_SWEEP = 5
# Smallest attainable residual due to round-off, relative to the force and to the free
# slide divided by its compliance.
ROUND_OFF = 4e-15


class NewtonSchedule(NamedTuple):
    """Schedule of the Newton steps on all forces within the block descent.

    - next_turn: sweep of the next Newton step
    - pause: number of sweeps between two Newton steps
    - worst: largest force change, relative to its tolerance, before the last Newton step
    """

    next_turn: int
    pause: int
    worst: float


class ContactSolution(NamedTuple):
    """Solution of the contact in a sweep of the block descent.

    - increment: increment of the slide of the contact [m]
    - change: force change relative to the tolerance, infinite if the solution fails
    - iterations: number of iterations
    """

    increment: float
    change: float
    iterations: int


class EventStep(NamedTuple):
    """Solution of a step with stops and releases of set-valued elements inside it.

    - increment: increment of the slide of the contact [m]
    - iterations: number of iterations
    - is_solved: false if no solution is found, or if it would create energy
    """

    increment: float
    iterations: int
    is_solved: bool


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_elements(modal, system, row):
    """Write the state of all elements into a sample row; return that of the first interface.

    Force and slip are those of the contact, or of the first element if there is no contact.

    Parameters
    ----------
    modal : modal_kernels.ModalSample
    system : element_arrays.MarchArrays
    row : (k,) array
        Sample row of `loop_kernels.march`; output.

    Returns
    -------
    friction.protocol_kernels.Reading
        Force, friction energy and slip.
    float
        Energy of the springs [J].
    """
    elements = system.elements
    first_column = find_element_columns(system.motion)
    force = 0.0
    slip = modal.slide
    friction_energy = 0.0
    spring_energy = 0.0
    for e in range(elements.links.shape[1]):
        port = elements.links[LinkRow.PORT, e]
        slide = project_modes(elements.rows[port], system.motion[0])
        speed = project_modes(elements.rows[port], system.motion[1])
        reading = law.read_memory(elements.num[e], elements.mem[e], slide, speed)
        elements.state[ElementRow.SLIDE, e] = slide
        elements.state[ElementRow.SPEED, e] = speed
        column = first_column + N_ELEMENT_COLUMNS * e
        row[column + SampleColumn.SLIDE] = slide
        row[column + SampleColumn.SPEED] = speed
        row[column + SampleColumn.FORCE] = reading.force
        row[column + SampleColumn.SLIP] = reading.slip
        if elements.links[LinkRow.IS_FRICTION, e]:
            friction_energy += reading.stored_energy
        else:
            spring_energy += reading.stored_energy
        if e == 0 and elements.links[LinkRow.IS_FRICTION, 0]:
            force = reading.force
            slip = reading.slip
    if HAS_CONTACT:
        reading = contact.read_state(system.interface, modal.slide, modal.speed)
        force = reading.force
        slip = reading.slip
        friction_energy += reading.stored_energy
        elements.contact[ContactIndex.SAMPLE_FORCE] = force
    return Reading(force, friction_energy, slip), spring_energy


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_element_columns(motion):
    """Return the column at which the elements begin in a sample row of a march."""
    return 2 * motion.shape[1] + N_SAMPLE_COLUMNS


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_set_valued(drive, force, system, row):
    """Write the sampled forces of the set-valued elements into their memory and the sample row.

    A sliding element has its kinetic friction, a resting element the force that keeps its acceleration at zero.

    Parameters
    ----------
    drive : float
        Acceleration of the base [m s-2].
    force : float
        Force of the contact [N].
    system : element_arrays.MarchArrays
    row : (k,) array
        Sample row of `loop_kernels.march`; output.

    Returns
    -------
    float
        Force of the first element if it is set-valued and there is no contact, otherwise `force`.
    """
    elements = system.elements
    modal_system = system.modal_system
    stops = elements.stops
    force_column = find_element_columns(system.motion) + SampleColumn.FORCE
    accel = modal_system.workspace[0]
    for i in range(stops.names.size):
        e = stops.element[i]
        slip_state = stops.field[FaceRow.SLIP_STATE, i]
        limit = elements.num[e, 1] if abs(slip_state) == 2.0 else elements.num[e, 2]
        elements.mem[e, 0] = np.sign(slip_state) * limit
        row[force_column + N_ELEMENT_COLUMNS * e] = elements.mem[e, 0]
    contact_force = elements.contact[ContactIndex.SAMPLE_FORCE]
    for k in range(accel.size):
        accel[k] = (
            elements.modal[ModalRow.OTHER_ACCELERATION, k]
            - modal_system.slide[k] * contact_force / modal_system.mass
        )
        for e in range(elements.links.shape[1]):
            accel[k] -= (
                elements.rows[elements.links[LinkRow.PORT, e], k]
                * row[force_column + N_ELEMENT_COLUMNS * e]
                / modal_system.mass
            )
    n_reactions = stop_kernels.find_reactions(system.motion, modal_system, drive, accel, stops)
    for i in range(n_reactions):
        e = stops.element[stops.names[i]]
        limit = elements.num[e, 1]
        elements.mem[e, 0] = min(max(stops.field[FaceRow.SOLUTION, i], -limit), limit)
        row[force_column + N_ELEMENT_COLUMNS * e] = elements.mem[e, 0]
    if HAS_CONTACT:
        return force
    else:
        return row[force_column] if elements.num[0, 0] == SET_VALUED else force


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def prepare_step(table_row, system):
    """Prepare a step: write the free slides and speeds of all ports, and the bond lengths.

    Parameters
    ----------
    table_row : int
        Row of the drive table for the step.
    system : element_arrays.MarchArrays
    """
    elements = system.elements
    motion = system.motion
    modal_system = system.modal_system
    table = system.table
    for p in range(elements.port.shape[1]):
        elements.port[PortRow.FREE_SLIDE, p] = free_increment(
            motion, modal_system, p, table, table_row
        )
        if HAS_STOPS:
            elements.port[PortRow.FREE_SPEED, p] = free_rate(
                motion, elements.rows[p], modal_system, table, table_row
            )
    for e in range(elements.links.shape[1]):
        elements.state[ElementRow.BOND_LENGTH, e] = law.step_bond_length(
            elements.num[e], elements.mem[e], elements.state[ElementRow.SPEED, e], modal_system.dt
        )


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_slide_by_others(element, port, elements):
    """Return the slide reduction [m] of a port due to the forces of all other elements.

    Parameters
    ----------
    element : int
        Number of the element, -1 for the contact.
    port : int
    elements : element_arrays.PortElements

    Returns
    -------
    float
    """
    compliances = elements.compliances[ComplianceRow.SLIDE, port]
    reduction = 0.0
    for k in range(elements.links.shape[1]):
        if k != element:
            other_port = elements.links[LinkRow.PORT, k]
            reduction += compliances[other_port] * elements.state[ElementRow.FORCE, k]
    if element >= 0:
        reduction += compliances[0] * elements.contact[ContactIndex.FORCE]
    return reduction


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_element(e, sweep, elements, dt):
    """Solve the step of one element under fixed forces of all others.

    Parameters
    ----------
    e : int
        Number of the element.
    sweep : int
        Number of the sweep, from 0.
    elements : element_arrays.PortElements
    dt : float
        Length of the step [s].

    Returns
    -------
    float
        Force change relative to the tolerance, infinite if the solution fails.
    int
        Number of iterations.
    """
    p = elements.links[LinkRow.PORT, e]
    beta = elements.compliances[ComplianceRow.SLIDE, p, p]
    state = elements.state
    increment = state[ElementRow.INCREMENT, e]
    iterations = 1
    free = elements.port[PortRow.FREE_SLIDE, p] - find_slide_by_others(e, p, elements)
    if HAS_STOPS:
        if elements.num[e, 0] == SET_VALUED:
            limit = state[ElementRow.MAX_FORCE, e]
            increment = solve_coulomb_step(free, beta, limit, limit)[0]
    if HAS_SLOPES:
        if elements.num[e, 0] != SET_VALUED:
            if sweep == 0:
                increment = extrapolate_increment(e, elements)
            step = LawStep(
                elements.num[e],
                elements.mem[e],
                state[ElementRow.SLIDE, e],
                state[ElementRow.BOND_LENGTH, e],
                dt,
            )
            goal = FORCE_GOAL_FRACTION * state[ElementRow.FORCE_TOL, e]
            limit = state[ElementRow.MAX_FORCE, e]
            solution = solver.solve_element(free, beta, step, increment, limit, goal)
            increment = solution.increment
            iterations = solution.iterations
    force = (free - increment) / beta
    change = find_force_change(force, state[ElementRow.FORCE, e], abs(free) / beta, e, elements)
    state[ElementRow.INCREMENT, e] = increment
    state[ElementRow.FORCE, e] = force
    return change if iterations >= 0 else np.inf, abs(iterations)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def extrapolate_increment(e, elements):
    """Return the slide increment of an element by linear extrapolation from its last two steps."""
    last = elements.state[ElementRow.LAST_INCREMENT, e]
    return 2 * last - elements.state[ElementRow.INCREMENT_BEFORE, e]


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def find_force_change(force, last_force, free_force, e, elements):
    """Return the change of an element force in a sweep, relative to its tolerance.

    Parameters
    ----------
    force, last_force : float
        Force in this sweep and in the last one [N].
    free_force : float
        Force that would hold the element [N].
    e : int
        Number of the element whose tolerance applies.
    elements : element_arrays.PortElements

    Returns
    -------
    float
    """
    tolerance = elements.state[ElementRow.FORCE_TOL, e] + ROUND_OFF * (free_force + abs(force))
    return abs(force - last_force) / tolerance


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_contact(start, system):
    """Solve the step of the contact on port 0 under fixed forces of all elements.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    system : element_arrays.MarchArrays

    Returns
    -------
    ContactSolution
    """
    elements = system.elements
    free_slide = elements.port[PortRow.FREE_SLIDE, 0]
    free = free_slide - find_slide_by_others(-1, 0, elements)
    beta = elements.compliances[ComplianceRow.SLIDE, 0, 0]
    tolerance = elements.contact[ContactIndex.FORCE_TOL]
    step = contact.solve_step(free, beta, start, system.interface, tolerance)
    force = (free - step.increment) / beta
    change = abs(force - elements.contact[ContactIndex.FORCE]) / (
        tolerance + ROUND_OFF * (abs(free_slide) / beta + abs(force))
    )
    elements.contact[ContactIndex.FORCE] = force
    change = change if step.iterations >= 0 else np.inf
    return ContactSolution(step.increment, change, abs(step.iterations))


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(start, system):
    """Solve contact and elements over a step by block descent on their mean forces.

    Each is solved in turn under the forces of the others; the results are written to elements.contact and
    elements.state. A Newton step on all forces accelerates slow convergence.

    With one friction limit per set-valued element the problem is convex, and block descent converges. So each of
    them begins with its static friction; those that slip under it are limited to their kinetic friction, and the
    descent continues. No element returns to its static friction, so there are at most as many releases as elements. In
    the end an element at rest carries at most its static friction, and one that slips has its kinetic friction.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    system : element_arrays.MarchArrays

    Returns
    -------
    float
        Increment of the slide of the contact [m].
    int
        Number of iterations, negative if the forces do not converge.
    """
    elements = system.elements
    n_iterations = 0
    last_max_change = np.inf
    schedule = NewtonSchedule(FIRST_NEWTON_SWEEP, 1, np.inf)
    increment = 0.0
    if HAS_STOPS:
        set_static_limits(elements)
    for sweep in range(MAX_SWEEPS):
        max_change = 0.0
        if HAS_CONTACT:
            solution = solve_contact(start, system)
            increment = solution.increment
            max_change = solution.change
            n_iterations += solution.iterations
        for e in range(elements.links.shape[1]):
            change, count = solve_element(e, sweep, elements, start.dt)
            max_change = max(max_change, change)
            n_iterations += count
        if not IS_COUPLED:
            if max_change == np.inf:
                return increment, -n_iterations
            max_change = 0.0
        if max_change <= 1.0:
            if HAS_STOPS:
                if release_slipping(elements):
                    last_max_change = np.inf
                    continue
            return increment, n_iterations
        if sweep > 1:
            schedule, count = accelerate_sweeps(
                sweep, max_change, last_max_change, schedule, system.modal_system, elements
            )
            n_iterations += count
        last_max_change = max_change
    return increment, -n_iterations


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_static_limits(elements):
    """Limit the forces of all set-valued elements to their static friction."""
    for i in range(elements.stops.names.size):
        e = elements.stops.element[i]
        elements.state[ElementRow.MAX_FORCE, e] = elements.num[e, 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def release_slipping(elements):
    """Limit the forces of slipping set-valued elements to their kinetic friction.

    Returns whether a limit was reduced.
    """
    is_released = False
    for i in range(elements.stops.names.size):
        e = elements.stops.element[i]
        if (
            elements.state[ElementRow.INCREMENT, e] != 0.0
            and elements.state[ElementRow.MAX_FORCE, e] > elements.num[e, 2]
        ):
            elements.state[ElementRow.MAX_FORCE, e] = elements.num[e, 2]
            is_released = True
    return is_released


@njit(error_model="numpy", **NJIT_INTERNAL)
def accelerate_sweeps(sweep, max_change, last_max_change, schedule, modal_system, elements):
    """Take a Newton step on the forces of all elements if the block descent converges slowly.

    This is done only if there is no contact. Laws with a slope are solved to the minimum of their potential; others
    take a Newton step if the sweeps converge slowly. Newton's method can cycle between two states if laws are steep. So
    the pause doubles after each Newton step that did not reduce the change of the forces, and the sweeps between
    two steps converge.

    Parameters
    ----------
    sweep : int
        Number of the sweep, from 0.
    max_change : float
        Largest change of a force in the sweep, relative to its tolerance.
    last_max_change : float
        Largest change of a force in the previous sweep, relative to its tolerance.
    schedule : NewtonSchedule
    modal_system : interfaces.arrays.ModalArrays
    elements : element_arrays.PortElements

    Returns
    -------
    NewtonSchedule
    int
        Number of iterations.
    """
    if HAS_CONTACT:
        return schedule, 0
    elif HAS_SLOPES:
        if elements.stops.names.size == 0 and modal_system.dense.size == 0:
            return schedule, abs(together.solve_smooth(elements, modal_system.dt))
    if sweep >= schedule.next_turn and max_change > SLOW_CONVERGENCE_RATIO * last_max_change:
        together.take_newton_step(elements, modal_system.dt, False)
        pause = schedule.pause if max_change < schedule.worst else 2 * schedule.pause
        return NewtonSchedule(sweep + pause, pause, max_change), 0
    return schedule, 0


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def set_free_motion(elements):
    """Write the slides and speeds that the set-valued elements would have without their own forces.

    The forces of the contact and of all other elements act. The result is in the field of `elements.stops`.
    """
    stops = elements.stops
    for i in range(stops.names.size):
        p = elements.links[LinkRow.PORT, stops.element[i]]
        slide = (
            elements.port[PortRow.FREE_SLIDE, p]
            - elements.compliances[ComplianceRow.SLIDE, p, 0] * elements.contact[ContactIndex.FORCE]
        )
        speed = (
            elements.port[PortRow.FREE_SPEED, p]
            - elements.compliances[ComplianceRow.SPEED, p, 0] * elements.contact[ContactIndex.FORCE]
        )
        for e in range(elements.links.shape[1]):
            if elements.num[e, 0] != SET_VALUED:
                slide -= (
                    elements.compliances[ComplianceRow.SLIDE, p, elements.links[LinkRow.PORT, e]]
                    * elements.state[ElementRow.FORCE, e]
                )
                speed -= (
                    elements.compliances[ComplianceRow.SPEED, p, elements.links[LinkRow.PORT, e]]
                    * elements.state[ElementRow.FORCE, e]
                )
        stops.field[FaceRow.FREE_SLIDE, i] = slide
        stops.field[FaceRow.FREE_SPEED, i] = speed


@njit(error_model="numpy", **NJIT_INTERNAL)
def copy_set_valued_forces(elements):
    """Copy the mean forces of the set-valued elements from the event solution to elements.state.

    Returns the largest force change relative to the tolerance.
    """
    stops = elements.stops
    max_change = 0.0
    for i in range(stops.names.size):
        e = stops.element[i]
        force = stops.field[FaceRow.MEAN_FORCE, i]
        max_change = max(
            max_change,
            abs(force - elements.state[ElementRow.FORCE, e])
            / (elements.state[ElementRow.FORCE_TOL, e] + ROUND_OFF * abs(force)),
        )
        elements.state[ElementRow.FORCE, e] = force
        elements.state[ElementRow.INCREMENT, e] = stops.field[FaceRow.INCREMENT, i]
    return max_change


@njit(error_model="numpy", **NJIT_INTERNAL)
def rests_in_step(table_row, system):
    """Return whether static friction holds all set-valued elements throughout a step.

    Parameters
    ----------
    table_row : int
        Row of the drive table for the step.
    system : element_arrays.MarchArrays

    Returns
    -------
    bool
    """
    elements = system.elements
    modal_system = system.modal_system
    stops = elements.stops
    if not stop_kernels.rests_through_step(stops):
        return False
    end = elements.modal[ModalRow.SCRATCH : ModalRow.SCRATCH + 2]
    accel = modal_system.workspace[0]
    set_accelerations(modal_system, elements, accel)
    for i in range(stops.names.size):
        e = stops.element[i]
        change = stops.field[FaceRow.MEAN_FORCE, i] - elements.state[ElementRow.FORCE, e]
        for k in range(accel.size):
            row_entry = elements.rows[elements.links[LinkRow.PORT, e], k]
            accel[k] -= row_entry * change / modal_system.mass
    write_end_state(system.motion, modal_system, system.table, table_row, accel, end)
    for i in range(stops.names.size):
        e = stops.element[i]
        force = stops.field[FaceRow.MEAN_FORCE, i]
        for k in range(accel.size):
            row_entry = elements.rows[elements.links[LinkRow.PORT, e], k]
            accel[k] += row_entry * force / modal_system.mass
    drive = system.table[table_row, 8 * accel.size + 2]
    return stop_kernels.rests_at_end(end, modal_system, drive, accel, stops)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_with_events(start, table_row, system):
    """Solve a step with stops and releases of set-valued elements inside it.

    The impulses at the end of the step are also determined. The first half of the sweeps determines which elements stop
    and slip. The other half keeps their slides and finds the forces of the other elements.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    table_row : int
        Row of the drive table for the step.
    system : element_arrays.MarchArrays

    Returns
    -------
    EventStep
    """
    elements = system.elements
    stops = elements.stops
    n_iterations = 0
    last_max_change = np.inf
    increment = 0.0
    for i in range(stops.names.size):
        stops.field[FaceRow.START_SPEED, i] = elements.state[ElementRow.SPEED, stops.element[i]]
    for sweep in range(MAX_EVENT_SWEEPS):
        max_change = 0.0
        if HAS_CONTACT:
            solution = solve_contact(start, system)
            increment = solution.increment
            max_change = solution.change
            n_iterations += solution.iterations
        if HAS_SLOPES:
            for e in range(elements.links.shape[1]):
                if elements.num[e, 0] != SET_VALUED:
                    change, count = solve_element(e, sweep, elements, start.dt)
                    max_change = max(max_change, change)
                    n_iterations += count
        set_free_motion(elements)
        if sweep < MAX_EVENT_SWEEPS // 2:
            if not (
                rests_in_step(table_row, system) or stop_kernels.follow_step_events(start.dt, stops)
            ):
                break
        if not stop_kernels.match_mean_forces(stops):
            break
        max_change = max(max_change, copy_set_valued_forces(elements))
        n_iterations += 1
        if max_change <= 1.0 or is_all_set_valued(elements):
            loses_energy = stop_kernels.find_impulses(stops) >= 0.0
            return EventStep(increment, n_iterations, loses_energy)
        if IS_COUPLED:
            if sweep > 4 and max_change > SLOW_CONVERGENCE_RATIO * last_max_change:
                take_newton_step_with_stops(elements, start.dt)
        last_max_change = max_change
    return EventStep(increment, n_iterations, False)


@njit(error_model="numpy", **NJIT_INTERNAL)
def is_all_set_valued(elements):
    """Return whether all elements are set-valued, so that one solution suffices."""
    if HAS_CONTACT:
        return False
    else:
        return elements.stops.names.size == elements.links.shape[1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_newton_step_with_stops(elements, dt):
    """Take a Newton step on the forces of all elements with fixed stops of the set-valued ones.

    It does nothing if the rig has a contact that can open.
    """
    if HAS_SLOPES:
        if HAS_CONTACT:
            return
        else:
            together.take_newton_step(elements, dt, True)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_step(start, table_row, system):
    """Solve the contact and all elements over a prepared step.

    The free slides are taken from elements.port. Impulses of set-valued elements are written to elements.stops, or are
    found later by `apply_end_impulses`.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    table_row : int
        Row of the drive table for the step.
    system : element_arrays.MarchArrays

    Returns
    -------
    interfaces.arrays.SolvedStep
        Increment and mean force of the contact.
    """
    elements = system.elements
    n_event_iterations = 0
    if HAS_STOPS:
        step = solve_with_events(start, table_row, system)
        if step.is_solved:
            elements.contact[ContactIndex.STOPS_KNOWN] = 1.0
            force = elements.contact[ContactIndex.FORCE]
            return SolvedStep(step.increment, force, step.iterations)
        n_event_iterations = step.iterations
        elements.contact[ContactIndex.STOPS_KNOWN] = 0.0
    increment, n_iterations = solve_coupled_forces(start, system)
    total = n_iterations + n_event_iterations
    if n_iterations < 0:
        total = n_iterations - n_event_iterations
    return SolvedStep(increment, elements.contact[ContactIndex.FORCE], total)


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_accelerations(modal_system, elements, accel):
    """Write the modal accelerations (n,) [m s-2] due to the forces of contact and elements.

    Parameters
    ----------
    modal_system : interfaces.arrays.ModalArrays
    elements : element_arrays.PortElements
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    """
    for k in range(accel.size):
        accel[k] = (
            elements.modal[ModalRow.OTHER_ACCELERATION, k]
            - modal_system.slide[k] * elements.contact[ContactIndex.FORCE] / modal_system.mass
        )
    for e in range(elements.links.shape[1]):
        for k in range(accel.size):
            accel[k] -= (
                elements.rows[elements.links[LinkRow.PORT, e], k]
                * elements.state[ElementRow.FORCE, e]
                / modal_system.mass
            )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def write_mean_forces(increment, row, elements):
    """Write the mean forces of a step into its sample row; return its friction work [J].

    Parameters
    ----------
    increment : float
        Increment of the slide of the contact [m].
    row : (k,) array
        Sample row of `loop_kernels.march`; output.
    elements : element_arrays.PortElements

    Returns
    -------
    float
    """
    state = elements.state
    first_column = find_element_columns(elements.modal)
    work = elements.contact[ContactIndex.FORCE] * increment
    first_force = state[ElementRow.FORCE, 0] if elements.links[LinkRow.IS_FRICTION, 0] else 0.0
    if HAS_CONTACT:
        first_force = elements.contact[ContactIndex.FORCE]
    row[2 * elements.modal.shape[1] + SampleColumn.MEAN_FORCE] = first_force
    for e in range(elements.links.shape[1]):
        row[first_column + N_ELEMENT_COLUMNS * e + SampleColumn.MEAN_FORCE] = state[
            ElementRow.FORCE, e
        ]
        if elements.links[LinkRow.IS_FRICTION, e]:
            work += state[ElementRow.FORCE, e] * state[ElementRow.INCREMENT, e]
    return work


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def apply_end_impulses(motion, mass, elements):
    """Apply the impulses of set-valued elements to the modes; return the dissipated energy [J].

    If the stops are not known, the impulses bring the elements that do not slide to rest.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    mass : float
        [kg]
    elements : element_arrays.PortElements

    Returns
    -------
    float
    """
    stops = elements.stops
    if elements.contact[ContactIndex.STOPS_KNOWN] == 0.0:
        for i in range(stops.names.size):
            stops.field[FaceRow.INCREMENT, i] = elements.state[
                ElementRow.INCREMENT, stops.element[i]
            ]
        stop_kernels.find_stopping_impulses(motion, stops)
    return stop_kernels.apply_impulses(motion, mass, stops)


@njit(error_model="numpy", **NJIT_INTERNAL)
def commit_step(start, increment, system):
    """Update the memory of the contact and of all elements after a converged step.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    increment : float
        Increment of the slide of the contact [m].
    system : element_arrays.MarchArrays

    Returns
    -------
    float
        Dissipated energy [J].
    bool
        False if a memory is full.
    """
    elements = system.elements
    state = elements.state
    rates = system.motion[1]
    loss = 0.0
    has_room = True
    if HAS_CONTACT:
        loss, has_room = contact.commit_step(
            increment,
            elements.contact[ContactIndex.FORCE],
            start,
            project_modes(system.modal_system.slide, rates),
            system.interface,
        )
        elements.contact[ContactIndex.INCREMENT] = increment
    for e in range(elements.links.shape[1]):
        loss += law.update_memory(
            elements.num[e],
            elements.mem[e],
            state[ElementRow.INCREMENT, e],
            state[ElementRow.FORCE, e],
            state[ElementRow.SPEED, e],
            project_modes(elements.rows[elements.links[LinkRow.PORT, e]], rates),
            start.dt,
            state[ElementRow.BOND_LENGTH, e],
        )
        state[ElementRow.INCREMENT_BEFORE, e] = state[ElementRow.LAST_INCREMENT, e]
        state[ElementRow.LAST_INCREMENT, e] = state[ElementRow.INCREMENT, e]
    return loss, has_room


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_limits(load0, load1, mu, elements):
    """Set the friction limits of the set-valued elements under a load linear over the step.

    Parameters
    ----------
    load0 : float
        Load at the start of the step [N].
    load1 : float
        Load at the end of the step [N].
    mu : (2,) array
        Static and kinetic coefficient of friction.
    elements : element_arrays.PortElements
    """
    stops = elements.stops
    load1 = max(load1, 0.0)
    for i in range(stops.names.size):
        e = stops.element[i]
        for k in range(2):
            stops.limit[LimitRow.STATIC + k, i] = mu[k] * load0
            stops.limit[LimitRow.STATIC + k + LimitRow.AT_END, i] = mu[k] * load1
            elements.num[e, 1 + k] = 0.5 * mu[k] * (load0 + load1)


@njit(error_model="numpy", **NJIT_INTERNAL)
def limit_sampled_forces(elements):
    """Limit the sampled forces of the set-valued elements to their static friction."""
    for i in range(elements.stops.names.size):
        e = elements.stops.element[i]
        elements.mem[e, 0] = min(max(elements.mem[e, 0], -elements.num[e, 1]), elements.num[e, 1])


@njit(error_model="numpy", **NJIT_INTERNAL)
def slide_freely(mean_force, elements):
    """Move the only set-valued element through a step under a prescribed mean force.

    Returns the slide of the element.
    """
    f = elements.stops.field
    elements.state[ElementRow.FORCE, 0] = mean_force
    elements.state[ElementRow.INCREMENT, 0] = (
        elements.port[PortRow.FREE_SLIDE, 0]
        - elements.compliances[ComplianceRow.SLIDE, 0, 0] * mean_force
    )
    elements.contact[ContactIndex.STOPS_KNOWN] = 1.0
    f[FaceRow.IMPULSE, 0] = 0.0
    f[FaceRow.SLIP_STATE, 0] = 1.0 if mean_force >= 0 else -1.0
    return elements.state[ElementRow.INCREMENT, 0]
