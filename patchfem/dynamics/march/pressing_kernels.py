"""Varying load in a march: unilateral contact under heave and pitch, or a prescribed load.

Heave h (positive away) and pitch t (positive if it opens +x) move the upper holder, so the approach d = -h closes it. Over
a step the modes move exactly under constant forces. Those of the normal contact are the path mean of its forces along the
straight increment, through every contact set on the way, so they do exactly the work E(end) - E(start): a discrete gradient
(McLachlan, Quispel, Robidoux, Phil. Trans. R. Soc. A 357, 1999). Friction acts with the path mean of its law under the mean
load of the step; Coulomb friction stops and is released inside it, under a load that changes linearly (`stops_kernels`). So
the sum of all energies never grows by itself.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...contact.press_kernels import compute_energy, find_set, press_state
from ...contact.press_path_kernels import path_mean
from ...contact.set_arrays import REFERENCE_LOAD, REFERENCE_MOMENT, REFERENCE_STIFFNESS
from ...friction.flags_kernels import NJIT_INTERNAL
from ..interfaces import element_kernels as contact
from ..interfaces.arrays import LoadIndex, SolvedStep
from ..modal_kernels import free_increment, free_rate, project_modes
from . import faces_kernels as coupling
from . import parts_kernels as parts
from .element_arrays import (
    N_LOAD_COLUMNS,
    ComplianceRow,
    ContactIndex,
    ElementRow,
    LoadColumn,
    ModalRow,
    PortRow,
)

# Numba leaves out the branches of flags that are False.
HAS_STOPS = parts.HAS_STOPS
HAS_POINTS = parts.HAS_POINTS
# Tolerance of the friction force in the coupled solution of friction and normal contact, over that of friction alone.
COUPLING_TOL_FACTOR = 0.01
# Largest number of secant steps for this force; the bracket closes within 60.
MAX_GUESSES = 80
BISECTION_INTERVAL = 8  # number of secant steps after which one is replaced by a bisection
BRACKET_TOL = 4e-16  # relative width below which a bracket is closed
MAX_ITERATIONS = 100  # largest number of Newton steps for heave and pitch
MIN_STEP_FRACTION = 1e-9  # smallest fraction of a Newton step in the line search
ROUND_OFF = 4e-16  # relative round-off error of a sum, over its largest term


class Secant(NamedTuple):
    """Secant iteration for the friction force [N] that is consistent with the normal contact.

    - low, high: bracket of the force
    - guess, residual: last guess and its residual

    """

    low: float
    high: float
    guess: float
    residual: float


class PressStep(NamedTuple):
    """Solution of the normal contact for heave and pitch in a step.

    - end_set: number of the contact set at the end of the step, negative if none fits
    - iterations: number of iterations
    - residual: residual as a force [N]
    """

    end_set: int
    iterations: int
    residual: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_march(press):
    """Initialise the load and its workspace at the start of a march."""
    press.few[:] = 0.0
    press.few[LoadIndex.LOAD] = press.sets.reference[REFERENCE_LOAD]


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_step(press, free_heave, free_pitch):
    """Solve the heave and pitch of a step by Newton's method with a line search.

    The increments are those without contact forces minus beta times the mean forces. The forces have a convex
    potential, so the solution is unique; within a single contact set one step finds it. The guess of the increments is
    in press.few, where increments, mean forces and their derivatives are written.

    Parameters
    ----------
    press : interfaces.arrays.VaryingLoad
    free_heave : float
        Increment of the heave without contact forces [m].
    free_pitch : float
        Increment of the pitch without contact forces [rad].

    Returns
    -------
    PressStep
    """
    start = press.few[LoadIndex.START : LoadIndex.START + 5]
    increments = press.few[LoadIndex.GUESS : LoadIndex.GUESS + 2]
    out = press.few[LoadIndex.OUT : LoadIndex.OUT + 9]
    arm = press.arm[0]
    b11 = press.beta[1, 1]
    b12 = press.beta[1, 2]
    b21 = press.beta[2, 1]
    b22 = press.beta[2, 2]
    heave = increments[0]
    pitch = increments[1]
    best_heave = heave
    best_pitch = pitch
    heave_step = 0.0
    pitch_step = 0.0
    step_fraction = 1.0
    smallest = np.inf
    end_set = press.slot[0]
    n_iterations = MAX_ITERATIONS
    for count in range(1, MAX_ITERATIONS):
        end_set = path_mean(press.sets, press.slot[0], start[0], start[1], heave, pitch, out)
        if end_set < 0:
            return PressStep(end_set, count, np.inf)
        heave_change = b11 * out[0] + b12 * out[1]
        pitch_change = b21 * out[0] + b22 * out[1]
        r1 = heave - free_heave + heave_change
        r2 = pitch - free_pitch + pitch_change
        residual = abs(r1) + arm * abs(r2)
        noise = ROUND_OFF * (
            abs(heave)
            + abs(free_heave)
            + abs(heave_change)
            + arm * (abs(pitch) + abs(free_pitch) + abs(pitch_change))
        )
        increments[0] = heave
        increments[1] = pitch
        if residual <= noise:
            return PressStep(end_set, count, 0.0)
        if residual < smallest * (1 - 0.1 * step_fraction) or smallest == np.inf:
            smallest = residual
            step_fraction = 1.0
            best_heave = heave
            best_pitch = pitch
            j11 = 1 + b11 * out[5] + b12 * out[7]
            j12 = b11 * out[6] + b12 * out[8]
            j21 = b21 * out[5] + b22 * out[7]
            j22 = 1 + b21 * out[6] + b22 * out[8]
            det = j11 * j22 - j12 * j21
            heave_step = (j22 * r1 - j12 * r2) / det
            pitch_step = (j11 * r2 - j21 * r1) / det
        else:
            step_fraction *= 0.5
            is_stalled = step_fraction < 0.2 and smallest <= 1e3 * noise
            if step_fraction < MIN_STEP_FRACTION or residual <= 64 * noise or is_stalled:
                increments[0] = best_heave
                increments[1] = best_pitch
                end_set = path_mean(
                    press.sets, press.slot[0], start[0], start[1], best_heave, best_pitch, out
                )
                n_iterations = count
                break
        heave = best_heave - step_fraction * heave_step
        pitch = best_pitch - step_fraction * pitch_step
    compliance = b11 + b22 / (arm * arm) + 2 / press.sets.reference[REFERENCE_STIFFNESS]
    return PressStep(end_set, n_iterations, smallest / compliance)


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_load(i, is_last, system, row):
    """Write load, moment, contact energy, heave and pitch into a sample row of a march.

    system.press.slot is negative if no contact set fits.

    Parameters
    ----------
    i : int
        Number of the sample.
    is_last : bool
        Whether it is the last sample.
    system : element_arrays.MarchArrays
    row : (k,) array
        Sample row of `loop_kernels.march`; output.

    Returns
    -------
    float
        Energy of the preloaded contact [J].
    """
    press = system.press
    sets = press.sets
    start = press.few[LoadIndex.START : LoadIndex.START + 5]
    load = press.few[LoadIndex.LOAD]
    moment = sets.reference[REFERENCE_MOMENT]
    heave = project_modes(press.rows[1], system.motion[0])
    pitch = project_modes(press.rows[2], system.motion[0])
    start[0] = heave
    start[1] = pitch
    start[2] = 0.0
    start[3] = 0.0
    start[4] = 0.0
    if press.loads.size > 0:
        load = press.loads[i]
        press.now[0] = load
    else:
        press.slot[0] = find_set(sets, press.slot[0], -heave, pitch)
        if press.slot[0] < 0:
            return 0.0
        start[2], start[3], start[4] = compute_energy(sets, press.slot[0], heave, pitch)
        load = max(sets.reference[REFERENCE_LOAD] - start[3], 0.0)
        moment = moment - start[4]
        if HAS_POINTS or is_last:
            press_state(sets, press.slot[0], -heave, pitch, press.now)
    press.few[LoadIndex.LOAD] = load
    first_column = row.size - N_LOAD_COLUMNS
    row[first_column + LoadColumn.LOAD] = load
    row[first_column + LoadColumn.MOMENT] = moment
    row[first_column + LoadColumn.ENERGY] = start[2]
    row[first_column + LoadColumn.HEAVE] = heave
    row[first_column + LoadColumn.PITCH] = pitch
    set_loads(load, load, system)
    if HAS_STOPS:
        elements = system.elements
        coupling.limit_sampled_forces(elements)
        accel = elements.modal[ModalRow.OTHER_ACCELERATION]
        set_press_accelerations(start[3:5], system.modal_system.mass, press, accel)
    return start[2]


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_loads(start_load, end_load, system):
    """Set the normal loads of the friction law at both ends of a step.

    The loads of the points at the end of the step are in press.now.

    Parameters
    ----------
    start_load : float
        Load at the start of the step [N].
    end_load : float
        Load at the end of the step [N].
    system : element_arrays.MarchArrays
    """
    press = system.press
    interface = system.interface
    if HAS_POINTS:
        for i in range(press.now.size):
            interface.pressed[1, i] = press.now[i]
    elif HAS_STOPS:
        coupling.set_limits(start_load, end_load, press.force, system.elements)
    else:
        interface.num[0, 1] = press.force[0] * 0.5 * (start_load + end_load)
        interface.bound[0] = interface.num[0, 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_press_accelerations(force, mass, press, accel):
    """Write the modal accelerations (n,) due to contact forces on heave and pitch.

    Parameters
    ----------
    force : (2,) array
        Force on the heave [N] and moment on the pitch [N m].
    mass : float
        [kg]
    press : interfaces.arrays.VaryingLoad
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    """
    for i in range(accel.size):
        accel[i] = -(press.rows[1, i] * force[0] + press.rows[2, i] * force[1]) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def add_press_accelerations(press, mass, accel):
    """Add the modal accelerations (n,) due to the mean contact forces of a step.

    Parameters
    ----------
    press : interfaces.arrays.VaryingLoad
    mass : float
        [kg]
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    """
    for i in range(accel.size):
        accel[i] -= (
            press.rows[1, i] * press.few[LoadIndex.MEAN_PRESS]
            + press.rows[2, i] * press.few[LoadIndex.MEAN_PRESS + 1]
        ) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_friction_step(start, force, ignores_events, table_row, system):
    """Solve the friction of a step under prescribed mean forces on heave and pitch.

    Parameters
    ----------
    start : interfaces.arrays.StepStart
    force : (2,) array
        Mean force on the heave [N] and moment on the pitch [N m].
    ignores_events : bool
        Whether stops and releases inside the step are ignored.
    table_row : int
        Row of the drive table for this step.
    system : element_arrays.MarchArrays

    Returns
    -------
    interfaces.arrays.SolvedStep
    """
    press = system.press
    modal_system = system.modal_system
    elements = system.elements
    beta = press.beta
    free = (
        free_increment(system.motion, modal_system, 0, system.table, table_row)
        - beta[0, 1] * force[0]
        - beta[0, 2] * force[1]
    )
    if HAS_STOPS:
        accel = elements.modal[ModalRow.OTHER_ACCELERATION]
        set_press_accelerations(force, modal_system.mass, press, accel)
        elements.port[PortRow.FREE_SLIDE, 0] = free
        if beta[0, 0] == 0.0:  # no mode moves the interface tangentially
            return SolvedStep(coupling.slide_freely(0.0, elements), 0.0, 1)
        elements.port[PortRow.FREE_SPEED, 0] = (
            free_rate(system.motion, modal_system.slide, modal_system, system.table, table_row)
            - elements.compliances[ComplianceRow.SPEED, 0, 1] * force[0]
            - elements.compliances[ComplianceRow.SPEED, 0, 2] * force[1]
        )
        if ignores_events:
            _, n_iterations = coupling.solve_coupled_forces(start, system)
            elements.contact[ContactIndex.STOPS_KNOWN] = 0.0
        else:
            n_iterations = coupling.solve_step(start, table_row, system).iterations
        return SolvedStep(
            elements.state[ElementRow.INCREMENT, 0],
            elements.state[ElementRow.FORCE, 0],
            n_iterations,
        )
    else:
        tolerance = COUPLING_TOL_FACTOR * press.goal[0]
        return contact.solve_step(free, beta[0, 0], start, system.interface, tolerance)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_under_friction(heave, pitch, friction, press):
    """Solve the heave and pitch of a step under a prescribed mean friction force.

    Their mean forces are written to press.few.

    Parameters
    ----------
    heave, pitch : float
        Increments without interface forces [m], [rad].
    friction : float
        Mean friction force [N].
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    PressStep
    """
    few = press.few
    free_heave = heave - press.beta[1, 0] * friction
    free_pitch = pitch - press.beta[2, 0] * friction
    step = solve_press_step(press, free_heave, free_pitch)
    if step.end_set >= 0:
        few[LoadIndex.MEAN_PRESS] = few[LoadIndex.OUT]
        few[LoadIndex.MEAN_PRESS + 1] = few[LoadIndex.OUT + 1]
        if HAS_POINTS:
            approach = -(few[LoadIndex.START] + few[LoadIndex.GUESS])
            tilt = few[LoadIndex.START + 1] + few[LoadIndex.GUESS + 1]
            press_state(press.sets, step.end_set, approach, tilt, press.now)
    return step


@njit(error_model="numpy", **NJIT_INTERNAL)
def is_bracket_closed(secant):
    """Return whether the bracket of the secant iteration is closed to round-off."""
    low = secant.low
    high = secant.high
    is_bracket = high < np.inf and low > -np.inf
    return is_bracket and high - low <= BRACKET_TOL * (abs(low) + abs(high))


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_secant_step(secant, guess, force, n_guesses):
    """Take a safeguarded secant step for the friction force.

    Every eighth step is a bisection, because jumps can make the secant steps alternate.

    Parameters
    ----------
    secant : Secant
    guess, force : float
        Assumed force, and the force that results from it [N].
    n_guesses : int
        Number of the guess, from 1.

    Returns
    -------
    Secant
    float
        Next guess [N].
    """
    residual = force - guess
    low = secant.low
    high = secant.high
    if residual > 0:
        low = guess
    else:
        high = guess
    following = force
    if secant.residual < np.inf and residual != secant.residual:
        following = guess - residual * (guess - secant.guess) / (residual - secant.residual)
    if not (low < following < high) or n_guesses % BISECTION_INTERVAL == 0:
        is_bracket = low > -np.inf and high < np.inf
        following = 0.5 * (low + high) if is_bracket else force
    return Secant(low, high, guess, residual), following


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(i, start, table_row, system):
    """Solve the coupled friction and normal contact over a step.

    Each is solved under the mean force of the other. If friction also moves heave or pitch, a safeguarded secant method
    finds the consistent force. The
    force jumps where a stop inside the step appears or disappears with the guess. If no force is consistent then,
    the mean force over the entire step is found instead, which does not jump between stick and slip at one
    coefficient. The mean forces on heave and pitch are in press.few then.

    Parameters
    ----------
    i : int
        Number of the sample at which the step starts.
    start : interfaces.arrays.StepStart
    table_row : int
        Row of the drive table for this step.
    system : element_arrays.MarchArrays

    Returns
    -------
    interfaces.arrays.SolvedStep
        The iterations are negative if friction and contact do not agree.
    """
    press = system.press
    few = press.few
    beta = press.beta
    load = few[LoadIndex.LOAD]
    preload = press.sets.reference[REFERENCE_LOAD]
    goal = press.goal[0]
    is_prescribed = press.loads.size > 0
    moves = not is_prescribed and (beta[1, 1] != 0 or beta[2, 2] != 0)
    is_coupled = moves and (beta[0, 1] != 0 or beta[0, 2] != 0)
    heave = free_increment(system.motion, system.modal_system, 1, system.table, table_row)
    pitch = free_increment(system.motion, system.modal_system, 2, system.table, table_row)
    end_load = load
    if is_prescribed:
        end_load = press.loads[i + 1]
        press.now[0] = end_load
    if HAS_POINTS:
        for k in range(press.now.size):
            system.interface.pressed[0, k] = system.interface.pressed[1, k]
    guess = press.mean[0]
    secant = Secant(-np.inf, np.inf, 0.0, np.inf)
    end_set = press.slot[0]
    n_iterations = 0
    press_residual = 0.0
    increment = 0.0
    force = 0.0
    is_bad = False
    is_whole = False
    last_turn = MAX_GUESSES
    for n_guesses in range(1, 2 * MAX_GUESSES + 1):
        if moves:
            press_step = solve_press_under_friction(heave, pitch, guess, press)
            end_set = press_step.end_set
            if end_set < 0:
                press.slot[0] = end_set
                return SolvedStep(increment, force, n_iterations)
            press_residual = press_step.residual
            n_iterations += press_step.iterations
            end_load = 2 * max(preload - few[LoadIndex.OUT], 0.0) - load
        set_loads(load, end_load, system)
        press_force = few[LoadIndex.MEAN_PRESS : LoadIndex.MEAN_PRESS + 2]
        step = solve_friction_step(start, press_force, is_whole, table_row, system)
        increment = step.increment
        force = step.mean_force
        n_iterations += abs(step.iterations)
        is_bad = step.iterations < 0 or press_residual > goal
        residual = force - guess
        if not is_coupled or abs(residual) <= COUPLING_TOL_FACTOR * goal:
            break
        if n_guesses < last_turn and not is_bracket_closed(secant):
            secant, guess = take_secant_step(secant, guess, force, n_guesses)
            continue
        if HAS_STOPS:
            mean_load = 0.5 * (load + max(end_load, 0.0))
            if press.force[1] * mean_load <= abs(guess) <= press.force[0] * mean_load:
                # The force lies between kinetic and static friction, so slip begins in this step.
                force = guess
                increment = coupling.slide_freely(force, system.elements)
                break
            if not is_whole:
                is_whole = True
                last_turn = n_guesses + MAX_GUESSES
                secant = Secant(-np.inf, np.inf, 0.0, np.inf)
                continue
        is_bad = is_bad or abs(residual) > goal
        break
    press.mean[0] = force
    press.slot[0] = end_set
    if moves:
        few[LoadIndex.LOAD] = max(preload - few[LoadIndex.OUT + 3], 0.0)
    return SolvedStep(increment, force, -n_iterations if is_bad else n_iterations)
