"""Varying load: normal force and moment of the contact, or a load prescribed in time.

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
from ..modal_kernels import free_increment, free_rate
from . import faces_kernels as coupling
from . import parts_kernels as parts
from .stops_kernels import (
    ELEMENT_FORCE,
    FREE_SLIDE,
    FREE_SPEED,
    GAMMA,
    INCREMENT,
    OTHER_ACCELERATION,
    STOPS_KNOWN,
)

# Numba leaves out the branches of flags that are False.
HAS_STOPS = parts.HAS_STOPS
HAS_POINTS = parts.HAS_POINTS
# Tolerance of the force on which friction and normal contact agree, over the tolerance of the friction.
COUPLING_FACTOR = 0.01
# Largest number of guesses of this force; the bracket of the secant closes within 60.
MAX_GUESSES = 80
BISECT_EVERY = 8  # guesses after which the secant method takes the middle of its bracket
BRACKET_TOL = 4e-16  # width of a bracket over its ends below which it is closed
MAX_ITERATIONS = 100  # Newton steps for heave and pitch
# Places in `few` of `interfaces.arrays.VaryingLoad`.
LOAD = 0  # load now [N]
MEAN_PRESS = 3  # mean forces of the step on heave [N] and pitch [N m]
PRESS_GUESS = 6  # increments of heave and pitch of the step before, the guess of this one
PRESS_OUT = 8  # results of `path_mean` (9,)
PRESS_START = 17  # heave, pitch, energy and forces at the start of the step (5,)


class Secant(NamedTuple):
    """Bracket of the force on which friction and normal contact agree; last guess and residual [N]."""

    low: float
    high: float
    guess: float
    miss: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def port_motion(motion, rows, r):
    """Return the slide, heave or pitch of the modes.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    rows : (p, n) array
        Slides of the ports per coordinate.
    r : int
        Number of the port.

    Returns
    -------
    float
    """
    out = 0.0
    for i in range(motion.shape[1]):
        out += rows[r, i] * motion[0, i]
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_step(press, k0, begin, f1, f2, turn, out):
    """Solve heave and pitch of a step by Newton's method with step halving.

    The increments are (f1, f2) - beta * mean force. The forces have a convex potential, so the solution is
    unique; inside a single contact set one step finds it.

    Parameters
    ----------
    press : interfaces.arrays.VaryingLoad
    k0 : int
        Contact set at the start.
    begin : (5,) array
        Heave, pitch, energy and forces at the start of the step.
    f1 : float
        Increment of the heave without contact forces [m].
    f2 : float
        Increment of the pitch without contact forces [rad].
    turn : (2,) array
        Guess of the increments; the solution is written.
    out : (9,) array
        Mean forces and slopes, as `path_mean` writes them.

    Returns
    -------
    int
        Contact set at the end of the step, negative if none fits.
    int
        Number of iterations.
    float
        Residual as a force [N].
    """
    sets = press.sets
    beta = press.beta
    arm = press.arm[0]
    b11 = beta[1, 1]
    b12 = beta[1, 2]
    b21 = beta[2, 1]
    b22 = beta[2, 2]
    softness = b11 + b22 / (arm * arm) + 2 / sets.reference[REFERENCE_STIFFNESS]
    dh = turn[0]
    dt = turn[1]
    old_h = dh
    old_t = dt
    step_h = 0.0
    step_t = 0.0
    part = 1.0
    best = np.inf
    k = k0
    for count in range(1, MAX_ITERATIONS):
        k = path_mean(sets, k0, begin[0], begin[1], dh, dt, out)
        if k < 0:
            return k, count, np.inf
        p1 = b11 * out[0] + b12 * out[1]
        p2 = b21 * out[0] + b22 * out[1]
        r1 = dh - f1 + p1
        r2 = dt - f2 + p2
        size = abs(r1) + arm * abs(r2)
        noise = 4e-16 * (abs(dh) + abs(f1) + abs(p1) + arm * (abs(dt) + abs(f2) + abs(p2)))
        turn[0] = dh
        turn[1] = dt
        if size <= noise:
            return k, count, 0.0
        if size < best * (1 - 0.1 * part) or best == np.inf:
            best = size
            part = 1.0
            old_h = dh
            old_t = dt
            j11 = 1 + b11 * out[5] + b12 * out[7]
            j12 = b11 * out[6] + b12 * out[8]
            j21 = b21 * out[5] + b22 * out[7]
            j22 = 1 + b21 * out[6] + b22 * out[8]
            det = j11 * j22 - j12 * j21
            step_h = (j22 * r1 - j12 * r2) / det
            step_t = (j11 * r2 - j21 * r1) / det
        else:
            part *= 0.5
            if part < 1e-9 or size <= 64 * noise or (part < 0.2 and best <= 1e3 * noise):
                turn[0] = old_h
                turn[1] = old_t
                k = path_mean(sets, k0, begin[0], begin[1], old_h, old_t, out)
                return k, count, best / softness
        dh = old_h - part * step_h
        dt = old_t - part * step_t
    return k, MAX_ITERATIONS, best / softness


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_load(i, last, motion, mass, interface, faces, press, row):
    """Write load, moment, contact energy, heave and pitch of a sample into the row.

    press.slot is negative if no contact set fits.

    Parameters
    ----------
    i : int
        Number of the sample.
    last : bool
        Whether it is the last sample.
    motion : (2, n) array
        Coordinates and rates of the modes.
    mass : float
        [kg]
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements
    press : interfaces.arrays.VaryingLoad
    row : (k,) array
        Row of samples of `loop_kernels.march`; it is written.

    Returns
    -------
    float
        Energy of the preloaded contact [J].
    """
    begin = press.few[PRESS_START : PRESS_START + 5]
    load = press.few[LOAD]
    moment = press.sets.reference[REFERENCE_MOMENT]
    m = row.size - 5
    begin[0], begin[1] = port_motion(motion, press.rows, 1), port_motion(motion, press.rows, 2)
    begin[2] = 0.0
    begin[3] = 0.0
    begin[4] = 0.0
    if press.loads.size > 0:
        load = press.loads[i]
        press.now[0] = load
    else:
        press.slot[0] = find_set(press.sets, press.slot[0], -begin[0], begin[1])
        if press.slot[0] < 0:
            return 0.0
        begin[2], begin[3], begin[4] = compute_energy(press.sets, press.slot[0], begin[0], begin[1])
        load = max(press.sets.reference[REFERENCE_LOAD] - begin[3], 0.0)
        moment = moment - begin[4]
        if HAS_POINTS or last:
            press_state(press.sets, press.slot[0], -begin[0], begin[1], press.now)
    press.few[LOAD] = load
    row[m] = load
    row[m + 1] = moment
    row[m + 2] = begin[2]
    row[m + 3] = begin[0]
    row[m + 4] = begin[1]
    set_loads(load, load, interface, faces, press)
    if HAS_STOPS:
        coupling.cap_forces(faces)
        set_press_accelerations(begin[3], begin[4], mass, press, faces.modal[OTHER_ACCELERATION])
    return begin[2]


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_loads(before, after, interface, faces, press):
    """Set the loads of friction at both ends of a step.

    The loads of points at the end of the step are in press.now.

    Parameters
    ----------
    before : float
        Load at the start of the step [N].
    after : float
        Load at its end [N].
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements
    press : interfaces.arrays.VaryingLoad
    """
    if HAS_POINTS:
        for i in range(press.now.size):
            interface.pressed[1, i] = press.now[i]
    elif HAS_STOPS:
        coupling.set_limits(before, after, press.force, faces)
    else:
        interface.num[0, 1] = press.force[0] * 0.5 * (before + after)
        interface.bound[0] = interface.num[0, 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_press_accelerations(heave, pitch, mass, press, accel):
    """Write the modal accelerations under forces that resist heave and pitch into accel (n,).

    Parameters
    ----------
    heave : float
        Force that resists the heave [N].
    pitch : float
        Moment that resists the pitch [N m].
    mass : float
        [kg]
    press : interfaces.arrays.VaryingLoad
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    """
    for i in range(accel.size):
        accel[i] = -(press.rows[1, i] * heave + press.rows[2, i] * pitch) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def add_press_accelerations(press, mass, accel):
    """Add the modal accelerations of the mean forces of a step on heave and pitch to accel (n,).

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
            press.rows[1, i] * press.few[MEAN_PRESS] + press.rows[2, i] * press.few[MEAN_PRESS + 1]
        ) / mass


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_friction_step(
    q, v, force, whole, motion, modal_system, table, at, interface, faces, press
):
    """Solve the friction of a step under given mean forces on heave and pitch.

    Parameters
    ----------
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    force : (2,) array
        Mean force on the heave [N] and moment on the pitch [N m].
    whole : bool
        Whether stops and releases inside the step are left out.
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    at : int
        Row of the table for this step.
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    float
        Increment of the slide [m].
    float
        Mean friction force [N].
    int
        Number of iterations, negative if the solution fails.
    """
    free = (
        free_increment(motion, modal_system, 0, table, at)
        - press.beta[0, 1] * force[0]
        - press.beta[0, 2] * force[1]
    )
    if HAS_STOPS:
        set_press_accelerations(
            force[0], force[1], modal_system.mass, press, faces.modal[OTHER_ACCELERATION]
        )
        faces.port[FREE_SLIDE, 0] = free
        if press.beta[0, 0] == 0.0:  # no interface slides
            return coupling.slide_freely(0.0, faces), 0.0, 1
        faces.port[FREE_SPEED, 0] = (
            free_rate(motion, modal_system.slide, modal_system, table, at)
            - faces.gives[GAMMA, 0, 1] * force[0]
            - faces.gives[GAMMA, 0, 2] * force[1]
        )
        if whole:
            _, count = coupling.solve_coupled_forces(q, v, modal_system, interface, faces)
            faces.own[STOPS_KNOWN] = 0.0
        else:
            _, count = coupling.solve_step(q, v, motion, modal_system, table, at, interface, faces)
        return faces.each[INCREMENT, 0], faces.each[ELEMENT_FORCE, 0], count
    else:
        return contact.solve_step(
            free,
            press.beta[0, 0],
            q,
            v,
            modal_system.dt,
            interface,
            COUPLING_FACTOR * press.goal[0],
        )


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_press_part(heave, pitch, friction, press):
    """Solve heave and pitch of a step under a mean friction force, and keep their mean forces in press.few.

    Parameters
    ----------
    heave, pitch : float
        Increments without interface forces [m], [rad].
    friction : float
        [N]
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    int
        Contact set at the end of the step, negative if none fits.
    int
        Number of iterations.
    float
        Residual as a force [N].
    """
    few = press.few
    beta = press.beta
    increments = few[PRESS_GUESS : PRESS_GUESS + 2]
    out = few[PRESS_OUT : PRESS_OUT + 9]
    start = few[PRESS_START : PRESS_START + 5]
    end, iterations, residual = solve_press_step(
        press,
        press.slot[0],
        start,
        heave - beta[1, 0] * friction,
        pitch - beta[2, 0] * friction,
        increments,
        out,
    )
    if end >= 0:
        few[MEAN_PRESS] = out[0]
        few[MEAN_PRESS + 1] = out[1]
        if HAS_POINTS:
            approach = -(start[0] + increments[0])
            press_state(press.sets, end, approach, start[1] + increments[1], press.now)
    return end, iterations, residual


@njit(error_model="numpy", **NJIT_INTERNAL)
def is_closed(secant):
    """Return whether the bracket is closed to round-off."""
    low = secant.low
    high = secant.high
    is_bracket = high < np.inf and low > -np.inf
    return is_bracket and high - low <= BRACKET_TOL * (abs(low) + abs(high))


@njit(error_model="numpy", **NJIT_INTERNAL)
def next_guess(secant, guess, used, turn):
    """Take a secant step inside the bracket.

    Every eighth step is a bisection, because jumps can make the secant steps alternate.

    Parameters
    ----------
    secant : Secant
    guess, used : float
        Force that was assumed, and the one that followed from it [N].
    turn : int
        Number of the guess, from 1.

    Returns
    -------
    Secant
    float
        Next guess [N].
    """
    miss = used - guess
    low = secant.low
    high = secant.high
    if miss > 0:
        low = guess
    else:
        high = guess
    following = used
    if secant.miss < np.inf and miss != secant.miss:
        following = guess - miss * (guess - secant.guess) / (miss - secant.miss)
    if not (low < following < high) or turn % BISECT_EVERY == 0:
        is_bracket = low > -np.inf and high < np.inf
        following = 0.5 * (low + high) if is_bracket else used
    return Secant(low, high, guess, miss), following


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(i, q, v, motion, modal_system, table, at, interface, faces, press):
    """Solve friction and normal contact over a step, each under the mean force of the other.

    If friction moves heave or pitch too, the secant method in a bracket finds the force on which both agree. The
    force jumps where a stop inside the step comes or goes with the guess. If no force agrees with itself then,
    the mean force of the whole step is found instead, which does not jump between stick and slip at one
    coefficient. The mean forces on heave and pitch are in press.few then.

    Parameters
    ----------
    i : int
        Number of the sample at which the step starts.
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    at : int
        Row of the table for this step.
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements
    press : interfaces.arrays.VaryingLoad

    Returns
    -------
    float
        Increment of the slide [m].
    float
        Mean friction force [N].
    int
        Number of iterations, negative if they do not agree.
    """
    beta = press.beta
    load = press.few[LOAD]
    goal = press.goal[0]
    is_given = press.loads.size > 0
    moves = not is_given and (beta[1, 1] != 0 or beta[2, 2] != 0)
    is_coupled = moves and (beta[0, 1] != 0 or beta[0, 2] != 0)
    heave = free_increment(motion, modal_system, 1, table, at)
    pitch = free_increment(motion, modal_system, 2, table, at)
    after = load
    if is_given:
        after = press.loads[i + 1]
        press.now[0] = after
    if HAS_POINTS:
        for k in range(press.now.size):
            interface.pressed[0, k] = interface.pressed[1, k]
    guess = press.mean[0]
    secant = Secant(-np.inf, np.inf, 0.0, np.inf)
    end = press.slot[0]
    count = 0
    wrong = 0.0
    dq = 0.0
    used = 0.0
    is_bad = False
    is_whole = False
    last_turn = MAX_GUESSES
    for turn in range(1, 2 * MAX_GUESSES + 1):
        if moves:
            end, iterations, wrong = solve_press_part(heave, pitch, guess, press)
            if end < 0:
                press.slot[0] = end
                return dq, used, count
            count += iterations
            after = 2 * max(press.sets.reference[REFERENCE_LOAD] - press.few[PRESS_OUT], 0.0) - load
        set_loads(load, after, interface, faces, press)
        dq, used, iterations = solve_friction_step(
            q,
            v,
            press.few[MEAN_PRESS : MEAN_PRESS + 2],
            is_whole,
            motion,
            modal_system,
            table,
            at,
            interface,
            faces,
            press,
        )
        count += abs(iterations)
        is_bad = iterations < 0 or wrong > goal
        miss = used - guess
        if not is_coupled or abs(miss) <= COUPLING_FACTOR * goal:
            break
        if turn < last_turn and not is_closed(secant):
            secant, guess = next_guess(secant, guess, used, turn)
            continue
        if HAS_STOPS:
            mean_load = 0.5 * (load + max(after, 0.0))
            if press.force[1] * mean_load <= abs(guess) <= press.force[0] * mean_load:
                # A force between kinetic and static friction: the step starts to slip.
                used = guess
                dq = coupling.slide_freely(used, faces)
                break
            if not is_whole:
                is_whole = True
                last_turn = turn + MAX_GUESSES
                secant = Secant(-np.inf, np.inf, 0.0, np.inf)
                continue
        is_bad = is_bad or abs(miss) > goal
        break
    press.mean[0] = used
    press.slot[0] = end
    if moves:
        press.few[LOAD] = max(press.sets.reference[REFERENCE_LOAD] - press.few[PRESS_OUT + 3], 0.0)
    return dq, used, -count if is_bad else count
