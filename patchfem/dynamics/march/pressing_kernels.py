"""Varying load in a march: unilateral contact with heave and pitch, or a prescribed load.

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
from ...contact.press_path_kernels import HolderMotion, path_mean
from ...contact.set_arrays import REFERENCE_LOAD, REFERENCE_MOMENT, REFERENCE_STIFFNESS
from ...friction.flags_kernels import NJIT_INTERNAL
from ..interfaces import element_kernels as contact
from ..interfaces.arrays import LoadIndex, SolvedStep, StepStart
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

# Numba omits the branches of flags that are False.
HAS_STOPS = parts.HAS_STOPS
HAS_POINTS = parts.HAS_POINTS
# Tolerance of the friction force in the coupled solution of friction and normal contact, relative
# to the tolerance for friction alone.
COUPLING_TOL_FACTOR = 0.01
# Largest number of friction-force guesses in a search; the bracket closes within 60.
MAX_GUESSES = 80
BISECTION_INTERVAL = 8  # number of secant steps after which one is replaced by a bisection
MAX_ITERATIONS = 100  # largest number of evaluations of the heave and pitch residual in a step
MIN_DECREASE = 0.1  # smallest relative decrease of the residual by a full Newton step
MIN_STEP_FRACTION = 1e-9  # smallest fraction of a Newton step in the line search
ROUND_OFF = 4e-16  # round-off error of a sum, relative to its largest term
# Residual relative to its round-off error at which the line search stops if
# the residual does not decrease.
STALL_FACTOR = 64
SHORT_STALL_FACTOR = 1e3  # same ratio for step fractions below SHORT_STEP_FRACTION
# Largest step fraction for which SHORT_STALL_FACTOR applies.
SHORT_STEP_FRACTION = 0.2


class PressResidual(NamedTuple):
    """Residual of the normal contact for increments of heave and pitch in a step.

    - increments: increments of heave and pitch
    - residual: difference from the increments without contact forces minus the compliance times the mean forces
    - size: size of the residual as a displacement [m]
    - round_off: round-off error of the size [m]
    - end_set: number of the contact set at the end of the step, negative if none fits
    """

    increments: HolderMotion
    residual: HolderMotion
    size: float
    round_off: float
    end_set: int


class PressStep(NamedTuple):
    """Solution of the normal contact for heave and pitch in a step.

    - end_set: number of the contact set at the end of the step, negative if none fits
    - iterations: number of iterations
    - residual: residual as a force [N]
    """

    end_set: int
    iterations: int
    residual: float


class StepData(NamedTuple):
    """Quantities of a step that do not depend on its forces.

    - start: slide and speed at the start, and length of the step
    - table_row: row of the drive table
    - free: increments of heave and pitch in the absence of interface forces
    - load: normal load at the start [N]
    - end_load: prescribed normal load at the end, or the load at the start if none is prescribed [N]
    """

    start: StepStart
    table_row: int
    free: HolderMotion
    load: float
    end_load: float


class Trial(NamedTuple):
    """Solution of a step for an assumed friction force on the normal contact.

    - force: resulting mean friction force [N]
    - increment: increment of the slide [m]
    - end_load: normal load at the end [N]
    - end_set: number of the contact set at the end of the step, negative if none fits
    - iterations: number of iterations
    - is_solved: whether both friction and contact converged
    """

    force: float
    increment: float
    end_load: float
    end_set: int
    iterations: int
    is_solved: bool


class Secant(NamedTuple):
    """Secant iteration for the friction force [N] that is consistent with the normal contact.

    - low, high: bracket of the force
    - guess, residual: last guess and its residual

    """

    low: float
    high: float
    guess: float
    residual: float


class ForceSearch(NamedTuple):
    """Result of the search for the consistent friction force of a step.

    - guess: last assumed friction force [N]
    - trial: solution of the step under it
    - is_consistent: whether the resulting force equals the assumed force
    - iterations: number of iterations of all trials
    """

    guess: float
    trial: Trial
    is_consistent: bool
    iterations: int


@njit(error_model="numpy", **NJIT_INTERNAL)
def start_march(press):
    """Initialise the load and its workspace at the start of a march."""
    press.few[:] = 0.0
    press.few[LoadIndex.LOAD] = press.sets.reference[REFERENCE_LOAD]


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_step(press, free):
    """Solve the heave and pitch of a step by Newton's method with a line search.

    The increments are those in the absence of contact forces minus beta times the mean forces. The forces have a convex
    potential, so the solution is unique; within a single contact set one step finds it. The guess of the increments is
    in press.few, where increments, mean forces and their derivatives are written.

    Parameters
    ----------
    press : interfaces.arrays.VaryingLoad
    free : contact.press_path_kernels.HolderMotion
        Increments in the absence of contact forces.

    Returns
    -------
    PressStep
    """
    increments = HolderMotion(press.few[LoadIndex.GUESS], press.few[LoadIndex.GUESS + 1])
    step = HolderMotion(0.0, 0.0)
    best = PressResidual(increments, step, np.inf, 0.0, press.slot[0])
    point = best
    step_fraction = 1.0
    n_iterations = 0
    is_stalled = False
    is_finished = False
    while not is_finished:
        point = find_press_residual(press, free, increments)
        n_iterations += not is_stalled
        is_finished = is_stalled or not can_improve(point)
        if best.size == np.inf or point.size < best.size * (1 - MIN_DECREASE * step_fraction):
            best = point
            step = find_newton_step(press, point.residual)
            step_fraction = 1.0
        else:
            step_fraction *= 0.5
            is_stalled = is_at_round_off(point, best.size, step_fraction)
        is_stalled = is_stalled or n_iterations == MAX_ITERATIONS
        # After a stall the arrays are those of the best point.
        fraction = 0.0 if is_stalled else step_fraction
        increments = HolderMotion(
            best.increments.heave - fraction * step.heave,
            best.increments.rotation - fraction * step.rotation,
        )
    if not can_improve(point):
        return PressStep(point.end_set, n_iterations, 0.0)
    arm = press.arm[0]
    compliance = (
        press.beta[1, 1]
        + press.beta[2, 2] / (arm * arm)
        + 2 / press.sets.reference[REFERENCE_STIFFNESS]
    )
    return PressStep(point.end_set, n_iterations, point.size / compliance)


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_press_residual(press, free, increments):
    """Compute the residual of increments of heave and pitch in a step.

    The increments, their mean forces and the derivatives of these are written to press.few.

    Parameters
    ----------
    press : interfaces.arrays.VaryingLoad
    free : contact.press_path_kernels.HolderMotion
        Increments in the absence of contact forces.
    increments : contact.press_path_kernels.HolderMotion

    Returns
    -------
    PressResidual
    """
    heave = increments.heave
    pitch = increments.rotation
    start = press.few[LoadIndex.START : LoadIndex.START + 5]
    out = press.few[LoadIndex.OUT : LoadIndex.OUT + 9]
    arm = press.arm[0]
    press.few[LoadIndex.GUESS] = heave
    press.few[LoadIndex.GUESS + 1] = pitch
    end_set = path_mean(press.sets, press.slot[0], start[0], start[1], heave, pitch, out)
    heave_change = press.beta[1, 1] * out[0] + press.beta[1, 2] * out[1]
    pitch_change = press.beta[2, 1] * out[0] + press.beta[2, 2] * out[1]
    residual = HolderMotion(heave - free.heave + heave_change, pitch - free.rotation + pitch_change)
    size = abs(residual.heave) + arm * abs(residual.rotation)
    round_off = ROUND_OFF * (
        abs(heave)
        + abs(free.heave)
        + abs(heave_change)
        + arm * (abs(pitch) + abs(free.rotation) + abs(pitch_change))
    )
    return PressResidual(increments, residual, size, round_off, end_set)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def can_improve(point):
    """Return whether a `PressResidual` exceeds its round-off error and has a contact set."""
    return point.end_set >= 0 and not point.size <= point.round_off


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_newton_step(press, residual):
    """Return the Newton step (HolderMotion) of a residual with the derivatives in press.few."""
    out = press.few[LoadIndex.OUT : LoadIndex.OUT + 9]
    b11 = press.beta[1, 1]
    b12 = press.beta[1, 2]
    b21 = press.beta[2, 1]
    b22 = press.beta[2, 2]
    j11 = 1 + b11 * out[5] + b12 * out[7]
    j12 = b11 * out[6] + b12 * out[8]
    j21 = b21 * out[5] + b22 * out[7]
    j22 = 1 + b21 * out[6] + b22 * out[8]
    det = j11 * j22 - j12 * j21
    heave_step = (j22 * residual.heave - j12 * residual.rotation) / det
    pitch_step = (j11 * residual.rotation - j21 * residual.heave) / det
    return HolderMotion(heave_step, pitch_step)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def is_at_round_off(point, best_size, step_fraction):
    """Return whether a residual that does not decrease is due to round-off.

    Parameters
    ----------
    point : PressResidual
    best_size : float
        Size of the smallest residual [m].
    step_fraction : float
        Next fraction of the Newton step.

    Returns
    -------
    bool
    """
    is_short = step_fraction < SHORT_STEP_FRACTION
    return (
        step_fraction < MIN_STEP_FRACTION
        or point.size <= STALL_FACTOR * point.round_off
        or (is_short and best_size <= SHORT_STALL_FACTOR * point.round_off)
    )


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
def solve_friction_step(data, force, ignores_events, system):
    """Solve the friction of a step under prescribed mean forces on heave and pitch.

    Parameters
    ----------
    data : StepData
    force : (2,) array
        Mean force on the heave [N] and moment on the pitch [N m].
    ignores_events : bool
        Whether stops and releases inside the step are ignored.
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
        free_increment(system.motion, modal_system, 0, system.table, data.table_row)
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
            free_rate(system.motion, modal_system.slide, modal_system, system.table, data.table_row)
            - elements.compliances[ComplianceRow.SPEED, 0, 1] * force[0]
            - elements.compliances[ComplianceRow.SPEED, 0, 2] * force[1]
        )
        if ignores_events:
            _, n_iterations = coupling.solve_coupled_forces(data.start, system)
            elements.contact[ContactIndex.STOPS_KNOWN] = 0.0
        else:
            n_iterations = coupling.solve_step(data.start, data.table_row, system).iterations
        return SolvedStep(
            elements.state[ElementRow.INCREMENT, 0],
            elements.state[ElementRow.FORCE, 0],
            n_iterations,
        )
    else:
        tolerance = COUPLING_TOL_FACTOR * press.goal[0]
        return contact.solve_step(free, beta[0, 0], data.start, system.interface, tolerance)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_under_friction(free, friction, press):
    """Solve the heave and pitch of a step under a prescribed mean friction force.

    Their mean forces are written to press.few.

    Parameters
    ----------
    free : contact.press_path_kernels.HolderMotion
        Increments in the absence of interface forces.
    friction : float
        Mean friction force [N].
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    PressStep
    """
    few = press.few
    free_under_friction = HolderMotion(
        free.heave - press.beta[1, 0] * friction, free.rotation - press.beta[2, 0] * friction
    )
    step = solve_press_step(press, free_under_friction)
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
    return is_bracket and high - low <= ROUND_OFF * (abs(low) + abs(high))


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_secant_step(secant, guess, force, n_guesses):
    """Take a safeguarded secant step for the friction force.

    Every eighth step is a bisection, because secant steps can alternate at a jump.

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
def can_move(press):
    """Return whether the normal contact moves the modes; it does not under a prescribed load."""
    return press.loads.size == 0 and (press.beta[1, 1] != 0 or press.beta[2, 2] != 0)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_trial(guess, ignores_events, data, system):
    """Solve the normal contact under an assumed mean friction force, and then the friction.

    Parameters
    ----------
    guess : float
        Assumed friction force [N].
    ignores_events : bool
        Whether stops and releases inside the step are ignored.
    data : StepData
    system : element_arrays.MarchArrays

    Returns
    -------
    Trial
    """
    press = system.press
    few = press.few
    end_load = data.end_load
    press_step = PressStep(press.slot[0], 0, 0.0)
    if can_move(press):
        press_step = solve_press_under_friction(data.free, guess, press)
        if press_step.end_set < 0:
            return Trial(guess, 0.0, end_load, press_step.end_set, press_step.iterations, False)
        preload = press.sets.reference[REFERENCE_LOAD]
        end_load = 2 * max(preload - few[LoadIndex.OUT], 0.0) - data.load
    set_loads(data.load, end_load, system)
    press_force = few[LoadIndex.MEAN_PRESS : LoadIndex.MEAN_PRESS + 2]
    step = solve_friction_step(data, press_force, ignores_events, system)
    return Trial(
        step.mean_force,
        step.increment,
        end_load,
        press_step.end_set,
        press_step.iterations + abs(step.iterations),
        step.iterations >= 0 and press_step.residual <= press.goal[0],
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_consistent_force(guess, ignores_events, data, system):
    """Find the friction force that is consistent with the normal contact of the step.

    If friction moves heave or pitch, a safeguarded secant method finds it. Otherwise the result does not depend on
    the assumed force.

    Parameters
    ----------
    guess : float
        First assumed friction force [N].
    ignores_events : bool
        Whether stops and releases inside the step are ignored.
    data : StepData
    system : element_arrays.MarchArrays

    Returns
    -------
    ForceSearch
    """
    press = system.press
    is_coupled = can_move(press) and (press.beta[0, 1] != 0 or press.beta[0, 2] != 0)
    tolerance = COUPLING_TOL_FACTOR * press.goal[0]
    secant = Secant(-np.inf, np.inf, 0.0, np.inf)
    n_guesses = 0
    n_iterations = 0
    while True:
        trial = solve_trial(guess, ignores_events, data, system)
        n_guesses += 1
        n_iterations += trial.iterations
        is_consistent = not is_coupled or abs(trial.force - guess) <= tolerance
        if is_consistent or n_guesses == MAX_GUESSES or is_bracket_closed(secant):
            return ForceSearch(guess, trial, is_consistent, n_iterations)
        secant, guess = take_secant_step(secant, guess, trial.force, n_guesses)


@njit(error_model="numpy", **NJIT_INTERNAL)
def is_between_frictions(force, data, end_load, press):
    """Return whether a mean friction force lies between kinetic and static friction.

    Parameters
    ----------
    force : float
        [N].
    data : StepData
    end_load : float
        Normal load at the end of the step [N].
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    bool
    """
    mean_load = 0.5 * (data.load + max(end_load, 0.0))
    return press.force[1] * mean_load <= abs(force) <= press.force[0] * mean_load


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(i, start, table_row, system):
    """Solve the coupled friction and normal contact over a step.

    Each is solved under the mean force of the other, until the resulting friction force equals the assumed one. This
    force jumps where a stop inside the step appears or disappears with the assumed force. If no force is consistent
    then, one between kinetic and static friction means that slip begins in the step; otherwise the mean force over the
    entire step is found, which does not jump between stick and slip at one coefficient. The mean forces on heave and
    pitch are in press.few then.

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
    data = read_step_data(i, start, table_row, system)
    guess = press.mean[0]
    n_iterations = 0
    slips_freely = False
    for ignores_events in (False, True):
        search = find_consistent_force(guess, ignores_events, data, system)
        guess = search.guess
        n_iterations += search.iterations
        if search.is_consistent or not HAS_STOPS:
            break
        slips_freely = is_between_frictions(guess, data, search.trial.end_load, press)
        if slips_freely:
            break
    trial = search.trial
    force = trial.force
    increment = trial.increment
    is_solved = trial.is_solved
    if HAS_STOPS:
        if slips_freely:
            force = guess
            increment = coupling.slide_freely(force, system.elements)
    if not search.is_consistent and not slips_freely:
        is_solved = is_solved and abs(force - guess) <= press.goal[0]
    press.mean[0] = force
    press.slot[0] = trial.end_set
    if can_move(press):
        preload = press.sets.reference[REFERENCE_LOAD]
        press.few[LoadIndex.LOAD] = max(preload - press.few[LoadIndex.OUT + 3], 0.0)
    return SolvedStep(increment, force, n_iterations if is_solved else -n_iterations)


@njit(error_model="numpy", **NJIT_INTERNAL)
def read_step_data(i, start, table_row, system):
    """Return the quantities of a step that do not depend on its forces (`StepData`).

    The nodal loads at the start of the step are those at the end of the previous step.

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
    StepData
    """
    press = system.press
    heave = free_increment(system.motion, system.modal_system, 1, system.table, table_row)
    pitch = free_increment(system.motion, system.modal_system, 2, system.table, table_row)
    load = press.few[LoadIndex.LOAD]
    end_load = load
    if press.loads.size > 0:
        end_load = press.loads[i + 1]
        press.now[0] = end_load
    if HAS_POINTS:
        for k in range(press.now.size):
            system.interface.pressed[0, k] = system.interface.pressed[1, k]
    return StepData(start, table_row, HolderMotion(heave, pitch), load, end_load)
