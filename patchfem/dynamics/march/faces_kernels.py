"""Solution of a contact and several elements over a step, by block descent on their forces.

Port p is a row of slides. The contact, if there is one, acts on port 0, and every element on its own port. Over a step the
path-mean forces F satisfy d = free - beta F together with every law. Each law is solved in turn under the forces of the
others, which is block descent on a convex problem for laws that dissipate. All set-valued elements are one block, which is
followed from stop to release inside the step (`stops_kernels`). If that fails, `solve_coupled_forces` finds mean forces of
the whole step, which always exist. Where the turns converge slowly, a Newton step on all forces takes over
(`together_kernels`). The text runs with any contact and any laws; `instances` makes an instance of it.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws import plane_kernels as plane
from ...friction.laws.coulomb_kernels import solve_coulomb_step
from ..interfaces import element_kernels as contact
from ..interfaces import element_solve_kernels as solver
from ..modal_kernels import free_increment, free_rate, write_end_state
from . import parts_kernels as parts
from . import stops_kernels as stop_kernels
from . import together_kernels as together
from .stops_kernels import (
    AT_END,
    BETA,
    BLOW,
    BOND_LENGTH,
    CONTACT_FORCE,
    CONTACT_INCREMENT,
    CONTACT_SAMPLE,
    CONTACT_TOL,
    ELEMENT_FORCE,
    ELEMENT_SLIDE,
    ELEMENT_SPEED,
    FACE_INCREMENT,
    FORCE_TOL,
    FREE_SLIDE,
    FREE_SPEED,
    GAMMA,
    INCREMENT,
    INCREMENT_BEFORE,
    IS_FRICTION,
    LAST_INCREMENT,
    MATE,
    MAX_FORCE,
    MEAN_FORCE,
    MODAL_SCRATCH,
    OTHER_ACCELERATION,
    PORT,
    SET_VALUED,
    SLIP_STATE,
    SOLUTION,
    START_SPEED,
    STATIC,
    STOPS_KNOWN,
)

# Numba leaves out the branches of flags that are False.
HAS_STOPS = parts.HAS_STOPS
HAS_SLOPES = parts.HAS_SLOPES
HAS_CONTACT = parts.HAS_CONTACT
IS_COUPLED = parts.IS_COUPLED
HAS_PLANES = parts.HAS_PLANES
MAX_TURNS = 1000  # block descent has failed after this number of turns over all elements
# Largest number of turns if stops and releases lie inside the step; the first half of the turns decides which.
MAX_EVENT_TURNS = 60
FIRST_NEWTON_TURN = 5  # turn after which a Newton step on all forces is worth its cost
# Round-off limits the residual to this fraction of a force and of a free slide over its compliance.
ROUND_OFF = 4e-15
# A row has these columns of an element: slide, speed, force, slip, and mean force of the step that follows.
ELEMENT_COLUMNS = 5


class NewtonPace(NamedTuple):
    """Turn of the next Newton step on all forces, pause between two, and change before the last one.

    The pause is a number of turns. The change is the largest one of a force, over its tolerance.
    """

    next_turn: int
    pause: int
    worst: float


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_elements(q, v, motion, row, interface, faces):
    """Write the state of all elements into the row, and return that of the interface.

    Force and slip are those of the contact, or without a contact those of the first element.

    Parameters
    ----------
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    motion : (2, n) array
        Coordinates and rates of the modes.
    row : (k,) array
        Row of samples of `loop_kernels.march`; it is written.
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    tuple
        Force [N], friction energy [J], slip [m] and energy of the springs [J].
    """
    n = motion.shape[1]
    m = 2 * motion.shape[1] + 7
    first = 0.0
    slip = q
    energy = 0.0
    springs = 0.0
    for e in range(faces.of.shape[1]):
        here = 0.0
        rate = 0.0
        for k in range(n):
            here += faces.rows[faces.of[PORT, e], k] * motion[0, k]
            rate += faces.rows[faces.of[PORT, e], k] * motion[1, k]
        force, stock, moved = law.read_memory(faces.num[e], faces.mem[e], here, rate)
        faces.each[ELEMENT_SLIDE, e] = here
        faces.each[ELEMENT_SPEED, e] = rate
        at = m + ELEMENT_COLUMNS * e
        row[at] = here
        row[at + 1] = rate
        row[at + 2] = force
        row[at + 3] = moved
        if faces.of[IS_FRICTION, e]:
            energy += stock
        else:
            springs += stock
        if e == 0 and faces.of[IS_FRICTION, 0]:
            first = force
            slip = moved
    if HAS_CONTACT:
        first, stock, slip = contact.read_state(interface, q, v)
        energy += stock
        faces.own[CONTACT_SAMPLE] = first
    return first, energy, slip, springs


@njit(error_model="numpy", **NJIT_INTERNAL)
def sample_set_valued(motion, modal_system, drive, force, row, faces):
    """Write the forces of the set-valued elements at a sample into their memory and the row.

    Elements that slide have their kinetic friction, those that rest the force that leaves them no acceleration.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    drive : float
        Acceleration of the base [m s-2].
    force : float
        Force of the contact [N].
    row : (k,) array
        Row of samples of `loop_kernels.march`; it is written.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
        Force of the first element if it is set-valued and there is no contact, otherwise `force`.
    """
    stops = faces.stops
    m = 2 * motion.shape[1] + 7
    accel = modal_system.workspace[0]
    count = faces.of.shape[1]
    for i in range(stops.names.size):
        e = stops.element[i]
        way = stops.field[SLIP_STATE, i]
        limit = faces.num[e, 1] if abs(way) == 2.0 else faces.num[e, 2]
        faces.mem[e, 0] = np.sign(way) * limit
        row[m + ELEMENT_COLUMNS * e + 2] = faces.mem[e, 0]
    for k in range(accel.size):
        accel[k] = (
            faces.modal[OTHER_ACCELERATION, k]
            - modal_system.slide[k] * faces.own[CONTACT_SAMPLE] / modal_system.mass
        )
        for e in range(count):
            accel[k] -= (
                faces.rows[faces.of[PORT, e], k]
                * row[m + ELEMENT_COLUMNS * e + 2]
                / modal_system.mass
            )
    for i in range(
        stop_kernels.find_reactions(
            motion, modal_system, drive, accel, modal_system.workspace[1:], stops
        )
    ):
        e = stops.element[stops.names[i]]
        faces.mem[e, 0] = min(max(stops.field[SOLUTION, i], -faces.num[e, 1]), faces.num[e, 1])
        row[m + ELEMENT_COLUMNS * e + 2] = faces.mem[e, 0]
    if HAS_CONTACT:
        return force
    else:
        return row[m + 2] if faces.num[0, 0] == SET_VALUED else force


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def prepare_step(motion, modal_system, table, at, dt, faces):
    """Write the free slides and speeds of all ports and the bond lengths of the step.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    at : int
        Row of the table for this step.
    dt : float
        Length of the step [s].
    faces : interfaces.arrays.PortElements
    """
    for p in range(faces.port.shape[1]):
        faces.port[FREE_SLIDE, p] = free_increment(motion, modal_system, p, table, at)
        if HAS_STOPS:
            faces.port[FREE_SPEED, p] = free_rate(motion, faces.rows[p], modal_system, table, at)
    for e in range(faces.of.shape[1]):
        faces.each[BOND_LENGTH, e] = law.step_bond_length(
            faces.num[e], faces.mem[e], faces.each[ELEMENT_SPEED, e], dt
        )


@njit(error_model="numpy", **NJIT_INTERNAL)
def slide_by_others(mine, port, faces):
    """Return the reduction [m] of the slide of a port due to the forces of all other elements.

    Parameters
    ----------
    mine : int
        Number of the element, -1 for the contact.
    port : int
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
    """
    out = 0.0
    for k in range(faces.of.shape[1]):
        if k != mine:
            out += faces.gives[BETA, port, faces.of[PORT, k]] * faces.each[ELEMENT_FORCE, k]
    return out + faces.gives[BETA, port, 0] * faces.own[CONTACT_FORCE] if mine >= 0 else out


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_one_element(e, turn, faces, dt):
    """Solve an element under the forces of all others.

    The first direction of an element in a plane is solved together with its second one.

    Parameters
    ----------
    e : int
        Number of the element.
    turn : int
        Number of the turn, from 0.
    faces : interfaces.arrays.PortElements
    dt : float
        Length of the step [s].

    Returns
    -------
    float
        Change of its force over the tolerance, infinite if the solution fails.
    int
        Number of iterations.
    """
    if HAS_PLANES:
        if faces.of[MATE, e] != e:
            return solve_plane_element(e, turn, faces) if faces.of[MATE, e] > e else (0.0, 0)
    p = faces.of[PORT, e]
    beta = faces.gives[BETA, p, p]
    dq = faces.each[INCREMENT, e]
    tries = 1
    mine = faces.port[FREE_SLIDE, p] - slide_by_others(e, p, faces)
    if HAS_STOPS:
        if faces.num[e, 0] == SET_VALUED:
            limit = faces.each[MAX_FORCE, e]
            dq = solve_coulomb_step(mine, beta, limit, limit)[0]
    if HAS_SLOPES:
        if faces.num[e, 0] != SET_VALUED:
            guess = (
                2 * faces.each[LAST_INCREMENT, e] - faces.each[INCREMENT_BEFORE, e]
                if turn == 0
                else dq
            )
            dq, _, tries = solver.solve_element(
                mine,
                beta,
                faces.num[e],
                faces.mem[e],
                faces.each[ELEMENT_SLIDE, e],
                faces.each[BOND_LENGTH, e],
                dt,
                guess,
                faces.each[MAX_FORCE, e],
                0.1 * faces.each[FORCE_TOL, e],
            )
    used = (mine - dq) / beta
    change = abs(used - faces.each[ELEMENT_FORCE, e]) / (
        faces.each[FORCE_TOL, e] + ROUND_OFF * (abs(mine) / beta + abs(used))
    )
    faces.each[INCREMENT, e] = dq
    faces.each[ELEMENT_FORCE, e] = used
    return change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_plane_element(e, turn, faces):
    """Solve both directions of an element in a plane, like `solve_one_element`.

    Parameters
    ----------
    e : int
        Number of the element.
    turn : int
        Number of the turn, from 0.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
    int
    """
    f = faces.of[MATE, e]
    p = faces.of[PORT, e]
    r = faces.of[PORT, f]
    xx = faces.gives[BETA, p, p]
    xy = faces.gives[BETA, p, r]
    yy = faces.gives[BETA, r, r]
    x = faces.port[FREE_SLIDE, p] - slide_by_others(e, p, faces) + xy * faces.each[ELEMENT_FORCE, f]
    y = faces.port[FREE_SLIDE, r] - slide_by_others(f, r, faces) + xy * faces.each[ELEMENT_FORCE, e]
    dx = faces.each[INCREMENT, e]
    dy = faces.each[INCREMENT, f]
    if turn == 0:
        dx = 2 * faces.each[LAST_INCREMENT, e] - faces.each[INCREMENT_BEFORE, e]
        dy = 2 * faces.each[LAST_INCREMENT, f] - faces.each[INCREMENT_BEFORE, f]
    dx, dy, pull, across, tries = plane.solve_plane_step(
        (x, y),
        (xx, xy, yy),
        (faces.num[e, 2], faces.num[e, 3]),
        (faces.mem[e, 3], faces.mem[f, 3]),
        (dx, dy),
        0.1 * faces.each[FORCE_TOL, e],
    )
    change = max(
        abs(pull - faces.each[ELEMENT_FORCE, e])
        / (faces.each[FORCE_TOL, e] + ROUND_OFF * (abs(x) / xx + abs(pull))),
        abs(across - faces.each[ELEMENT_FORCE, f])
        / (faces.each[FORCE_TOL, e] + ROUND_OFF * (abs(y) / yy + abs(across))),
    )
    faces.each[INCREMENT, e] = dx
    faces.each[INCREMENT, f] = dy
    faces.each[ELEMENT_FORCE, e] = pull
    faces.each[ELEMENT_FORCE, f] = across
    return change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_contact(q, v, dt, interface, faces):
    """Solve the contact on port 0 under the forces of all elements.

    Parameters
    ----------
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    dt : float
        Length of the step [s].
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
        Increment of its slide [m].
    float
        Change of its force over the tolerance.
    int
        Number of iterations.
    """
    free = faces.port[FREE_SLIDE, 0] - slide_by_others(-1, 0, faces)
    beta = faces.gives[BETA, 0, 0]
    dq, _, tries = contact.solve_step(free, beta, q, v, dt, interface, faces.own[CONTACT_TOL])
    used = (free - dq) / beta
    change = abs(used - faces.own[CONTACT_FORCE]) / (
        faces.own[CONTACT_TOL] + ROUND_OFF * (abs(faces.port[FREE_SLIDE, 0]) / beta + abs(used))
    )
    faces.own[CONTACT_FORCE] = used
    return dq, change if tries >= 0 else np.inf, abs(tries)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_coupled_forces(q, v, modal_system, interface, faces):
    """Solve contact and elements over a step by block descent, with mean forces alone.

    Each is solved in turn under the forces of the others, into faces.own and faces.each. A Newton step on all
    forces speeds up turns that converge slowly.

    With one friction limit per set-valued element the problem is convex, and block descent converges. So each of
    them begins with its static friction; those that slip under it are released to their kinetic friction, and the
    turns go on. No element gets its static friction back, so there are at most as many releases as elements. In
    the end an element at rest carries at most its static friction, and one that slips has its kinetic friction.

    Parameters
    ----------
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    modal_system : interfaces.arrays.ModalArrays
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
        Increment of the slide of the contact [m].
    int
        Number of iterations, negative if the forces do not converge.
    """
    dt = modal_system.dt
    iterations = 0
    last_worst = np.inf
    pace = NewtonPace(FIRST_NEWTON_TURN, 1, np.inf)
    dq = 0.0
    if HAS_STOPS:
        set_static_limits(faces)
    for turn in range(MAX_TURNS):
        worst = 0.0
        if HAS_CONTACT:
            dq, worst, tries = solve_contact(q, v, dt, interface, faces)
            iterations += tries
        for e in range(faces.of.shape[1]):
            change, tries = solve_one_element(e, turn, faces, dt)
            worst = max(worst, change)
            iterations += tries
        if not IS_COUPLED:
            if worst == np.inf:
                return dq, -iterations
            worst = 0.0
        if worst <= 1.0:
            if HAS_STOPS:
                if release_slipping(faces):
                    last_worst = np.inf
                    continue
            return dq, iterations
        if turn > 1:
            pace, tries = speed_up_turns(turn, worst, last_worst, pace, modal_system, faces)
            iterations += tries
        last_worst = worst
    return dq, -iterations


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_static_limits(faces):
    """Let every set-valued element carry up to its static friction."""
    for i in range(faces.stops.names.size):
        e = faces.stops.element[i]
        faces.each[MAX_FORCE, e] = faces.num[e, 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def release_slipping(faces):
    """Limit the forces of set-valued elements that slip to their kinetic friction.

    Returns whether one of them had a higher limit.
    """
    is_released = False
    for i in range(faces.stops.names.size):
        e = faces.stops.element[i]
        if faces.each[INCREMENT, e] != 0.0 and faces.each[MAX_FORCE, e] > faces.num[e, 2]:
            faces.each[MAX_FORCE, e] = faces.num[e, 2]
            is_released = True
    return is_released


@njit(error_model="numpy", **NJIT_INTERNAL)
def speed_up_turns(turn, worst, last_worst, pace, modal_system, faces):
    """Take a Newton step on the forces of all elements at once.

    This is done only without a contact. Laws with a slope are solved to the minimum of their potential; others
    take a Newton step if the turns are slow. Newton's method can cycle between two states where laws are steep. So
    the pause doubles after each Newton step that did not reduce the change of the forces, and the turns between
    two steps converge.

    Parameters
    ----------
    turn : int
        Number of the turn, from 0.
    worst : float
        Largest change of a force in the turn, over its tolerance.
    last_worst : float
        The same of the turn before.
    pace : NewtonPace
    modal_system : interfaces.arrays.ModalArrays
    faces : interfaces.arrays.PortElements

    Returns
    -------
    NewtonPace
    int
        Number of iterations.
    """
    if HAS_CONTACT:
        return pace, 0
    elif HAS_SLOPES:
        if HAS_PLANES:  # the force of an element in a plane has no potential
            pass
        elif faces.stops.names.size == 0 and modal_system.dense.size == 0:
            return pace, abs(together.solve_smooth(faces, modal_system.dt))
    if turn >= pace.next_turn and worst > 0.2 * last_worst:
        together.newton_step(faces, modal_system.dt, False)
        pause = pace.pause if worst < pace.worst else 2 * pace.pause
        return NewtonPace(turn + pause, pause, worst), 0
    return pace, 0


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def set_free_motion(faces):
    """Write the slides and speeds of set-valued elements without their forces into the field.

    The forces of the contact and of all other elements act.
    """
    stops = faces.stops
    for i in range(stops.names.size):
        p = faces.of[PORT, stops.element[i]]
        slide = faces.port[FREE_SLIDE, p] - faces.gives[BETA, p, 0] * faces.own[CONTACT_FORCE]
        speed = faces.port[FREE_SPEED, p] - faces.gives[GAMMA, p, 0] * faces.own[CONTACT_FORCE]
        for e in range(faces.of.shape[1]):
            if faces.num[e, 0] != SET_VALUED:
                slide -= faces.gives[BETA, p, faces.of[PORT, e]] * faces.each[ELEMENT_FORCE, e]
                speed -= faces.gives[GAMMA, p, faces.of[PORT, e]] * faces.each[ELEMENT_FORCE, e]
        stops.field[FREE_SLIDE, i] = slide
        stops.field[FREE_SPEED, i] = speed


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_stop_forces(faces):
    """Copy the mean forces of the set-valued elements into faces.each.

    Returns their largest change over the tolerance.
    """
    stops = faces.stops
    worst = 0.0
    for i in range(stops.names.size):
        e = stops.element[i]
        force = stops.field[MEAN_FORCE, i]
        worst = max(
            worst,
            abs(force - faces.each[ELEMENT_FORCE, e])
            / (faces.each[FORCE_TOL, e] + ROUND_OFF * abs(force)),
        )
        faces.each[ELEMENT_FORCE, e] = force
        faces.each[INCREMENT, e] = stops.field[FACE_INCREMENT, i]
    return worst


@njit(error_model="numpy", **NJIT_INTERNAL)
def rests_in_step(motion, modal_system, table, at, faces):
    """Return whether static friction holds all set-valued elements through the step and at its end.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    table : (s, k) array
        Table of `propagator.Propagator`.
    at : int
        Row of the table for this step.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    bool
    """
    if not stop_kernels.rests_through_step(faces.stops):
        return False
    end = faces.modal[MODAL_SCRATCH : MODAL_SCRATCH + 2]
    accel = modal_system.workspace[0]
    set_accelerations(modal_system, faces, accel)
    for i in range(faces.stops.names.size):
        e = faces.stops.element[i]
        for k in range(accel.size):
            accel[k] -= (
                faces.rows[faces.of[PORT, e], k]
                * (faces.stops.field[MEAN_FORCE, i] - faces.each[ELEMENT_FORCE, e])
                / modal_system.mass
            )
    write_end_state(motion, modal_system, table, at, accel, end)
    for i in range(faces.stops.names.size):
        e = faces.stops.element[i]
        for k in range(accel.size):
            accel[k] += (
                faces.rows[faces.of[PORT, e], k]
                * faces.stops.field[MEAN_FORCE, i]
                / modal_system.mass
            )
    return stop_kernels.rests_at_end(
        end,
        modal_system,
        table[at, 8 * accel.size + 2],
        accel,
        modal_system.workspace[1:],
        faces.stops,
    )


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_with_events(q, v, motion, modal_system, table, at, interface, faces):
    """Solve the step with the stops and releases of the set-valued elements inside it, and their blows.

    The first half of the turns decides which elements stop and slip. The other half keeps their slides and finds
    the forces of the other elements.

    Parameters
    ----------
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

    Returns
    -------
    float
        Increment of the slide of the contact [m].
    int
        Number of iterations.
    bool
        False if no such step is found, or if it would create energy.
    """
    stops = faces.stops
    iterations = 0
    last_worst = np.inf
    dq = 0.0
    dt = modal_system.dt
    for i in range(stops.names.size):
        stops.field[START_SPEED, i] = faces.each[ELEMENT_SPEED, stops.element[i]]
    for turn in range(MAX_EVENT_TURNS):
        worst = 0.0
        if HAS_CONTACT:
            dq, worst, tries = solve_contact(q, v, dt, interface, faces)
            iterations += tries
        if HAS_SLOPES:
            for e in range(faces.of.shape[1]):
                if faces.num[e, 0] != SET_VALUED:
                    change, tries = solve_one_element(e, turn, faces, dt)
                    worst = max(worst, change)
                    iterations += tries
        set_free_motion(faces)
        if turn < MAX_EVENT_TURNS // 2 and not (
            rests_in_step(motion, modal_system, table, at, faces)
            or stop_kernels.follow_step(dt, stops)
        ):
            return dq, iterations, False
        if not stop_kernels.match_mean_forces(stops):
            return dq, iterations, False
        worst = max(worst, take_stop_forces(faces))
        iterations += 1
        if worst <= 1.0 or is_all_set_valued(faces):
            return dq, iterations, stop_kernels.find_blows(stops) >= 0.0
        if IS_COUPLED:
            if turn > 4 and worst > 0.2 * last_worst:
                newton_with_stops(faces, dt)
        last_worst = worst
    return dq, iterations, False


@njit(error_model="numpy", **NJIT_INTERNAL)
def is_all_set_valued(faces):
    """Return whether all elements are set-valued, so that they are solved at once."""
    if HAS_CONTACT:
        return False
    else:
        return faces.stops.names.size == faces.of.shape[1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def newton_with_stops(faces, dt):
    """Take a step of Newton's method on the forces of the elements, which keep their stops.

    It does nothing if the rig has a contact that can open.
    """
    if HAS_SLOPES:
        if HAS_CONTACT:
            return
        else:
            together.newton_step(faces, dt, True)


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_step(q, v, motion, modal_system, table, at, interface, faces):
    """Solve contact and elements over a step whose free slides are in faces.port.

    Blows of set-valued elements are in faces.stops then, or are left to `strike_modes`.

    Parameters
    ----------
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

    Returns
    -------
    float
        Increment of the slide of the contact [m].
    int
        Number of iterations, negative if the forces do not converge.
    """
    if HAS_STOPS:
        dq, tried, found = solve_with_events(
            q, v, motion, modal_system, table, at, interface, faces
        )
        if found:
            faces.own[STOPS_KNOWN] = 1.0
            return dq, tried
        dq, iterations = solve_coupled_forces(q, v, modal_system, interface, faces)
        faces.own[STOPS_KNOWN] = 0.0
        return dq, iterations + tried if iterations >= 0 else iterations - tried
    else:
        return solve_coupled_forces(q, v, modal_system, interface, faces)


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_accelerations(modal_system, faces, accel):
    """Write the modal accelerations of all forces [m s-2] into accel (n,).

    Parameters
    ----------
    modal_system : interfaces.arrays.ModalArrays
    faces : interfaces.arrays.PortElements
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    """
    for k in range(accel.size):
        accel[k] = (
            faces.modal[OTHER_ACCELERATION, k]
            - modal_system.slide[k] * faces.own[CONTACT_FORCE] / modal_system.mass
        )
    for e in range(faces.of.shape[1]):
        for k in range(accel.size):
            accel[k] -= (
                faces.rows[faces.of[PORT, e], k] * faces.each[ELEMENT_FORCE, e] / modal_system.mass
            )


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def friction_work(dq, row, faces):
    """Write the mean forces of the step into the row of its start; return its friction work [J].

    Parameters
    ----------
    dq : float
        Increment of the slide of the contact [m].
    row : (k,) array
        Row of samples of `loop_kernels.march`; it is written.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
    """
    m = 2 * faces.modal.shape[1] + 7
    work = faces.own[CONTACT_FORCE] * dq
    row[m - 3] = faces.each[ELEMENT_FORCE, 0] if faces.of[IS_FRICTION, 0] else 0.0
    if HAS_CONTACT:
        row[m - 3] = faces.own[CONTACT_FORCE]
    for e in range(faces.of.shape[1]):
        row[m + ELEMENT_COLUMNS * e + 4] = faces.each[ELEMENT_FORCE, e]
        if faces.of[IS_FRICTION, e]:
            work += faces.each[ELEMENT_FORCE, e] * faces.each[INCREMENT, e]
    return work


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def strike_modes(motion, mass, faces):
    """Change the speeds of the modes by the blows of set-valued elements; return the energy lost [J].

    If no stops are known, the blows bring the elements that do not slide to rest.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    mass : float
        [kg]
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
    """
    stops = faces.stops
    if faces.own[STOPS_KNOWN] == 0.0:
        for i in range(stops.names.size):
            stops.field[FACE_INCREMENT, i] = faces.each[INCREMENT, stops.element[i]]
        stop_kernels.find_stopping_blows(motion, stops)
    return stop_kernels.apply_blows(motion, mass, stops)


@njit(error_model="numpy", **NJIT_INTERNAL)
def commit_step(q, v, dq, motion, modal_system, interface, faces):
    """Move the memories of contact and elements by the step.

    Parameters
    ----------
    q : float
        Slide of the contact at the start of the step [m].
    v : float
        Its speed [m/s].
    dq : float
        Increment of the slide of the contact [m].
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    interface : tuple
        Arrays of the contact on port 0, in `interfaces.arrays`.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
        Dissipated energy [J].
    bool
        False if a memory is full.
    """
    lost = 0.0
    ok = True
    if HAS_CONTACT:
        speed = 0.0
        for k in range(modal_system.slide.size):
            speed += modal_system.slide[k] * motion[1, k]
        lost, ok = contact.commit_step(
            dq, faces.own[CONTACT_FORCE], q, v, speed, modal_system.dt, interface
        )
        faces.own[CONTACT_INCREMENT] = dq
    for e in range(faces.of.shape[1]):
        speed = 0.0
        for k in range(modal_system.slide.size):
            speed += faces.rows[faces.of[PORT, e], k] * motion[1, k]
        if HAS_PLANES:
            if faces.of[MATE, e] == e:
                lost += law.update_memory(
                    faces.num[e],
                    faces.mem[e],
                    faces.each[INCREMENT, e],
                    faces.each[ELEMENT_FORCE, e],
                    faces.each[ELEMENT_SPEED, e],
                    speed,
                    modal_system.dt,
                    faces.each[BOND_LENGTH, e],
                )
            elif faces.of[MATE, e] > e:
                lost += plane.update_plane_memory(
                    faces.num[e],
                    faces.mem[e],
                    faces.mem[faces.of[MATE, e]],
                    (faces.each[INCREMENT, e], faces.each[INCREMENT, faces.of[MATE, e]]),
                )
        else:
            lost += law.update_memory(
                faces.num[e],
                faces.mem[e],
                faces.each[INCREMENT, e],
                faces.each[ELEMENT_FORCE, e],
                faces.each[ELEMENT_SPEED, e],
                speed,
                modal_system.dt,
                faces.each[BOND_LENGTH, e],
            )
        faces.each[INCREMENT_BEFORE, e] = faces.each[LAST_INCREMENT, e]
        faces.each[LAST_INCREMENT, e] = faces.each[INCREMENT, e]
    return lost, ok


@njit(error_model="numpy", **NJIT_INTERNAL)
def set_limits(load0, load1, mu, faces):
    """Set the limits of the set-valued elements under a load that changes linearly in the step.

    Parameters
    ----------
    load0 : float
        Load at the start of the step [N].
    load1 : float
        Load at its end [N].
    mu : (2,) array
        Static and kinetic coefficient.
    faces : interfaces.arrays.PortElements
    """
    stops = faces.stops
    load1 = max(load1, 0.0)
    for i in range(stops.names.size):
        e = stops.element[i]
        for k in range(2):
            stops.limit[STATIC + k, i] = mu[k] * load0
            stops.limit[STATIC + k + AT_END, i] = mu[k] * load1
            faces.num[e, 1 + k] = 0.5 * mu[k] * (load0 + load1)


@njit(error_model="numpy", **NJIT_INTERNAL)
def cap_forces(faces):
    """Limit the forces of the set-valued elements at a sample to their static friction."""
    for i in range(faces.stops.names.size):
        e = faces.stops.element[i]
        faces.mem[e, 0] = min(max(faces.mem[e, 0], -faces.num[e, 1]), faces.num[e, 1])


@njit(error_model="numpy", **NJIT_INTERNAL)
def slide_freely(used, faces):
    """Let the only set-valued element slide through the step under a mean force.

    Returns its slide.
    """
    f = faces.stops.field
    faces.each[ELEMENT_FORCE, 0] = used
    faces.each[INCREMENT, 0] = faces.port[FREE_SLIDE, 0] - faces.gives[BETA, 0, 0] * used
    faces.own[STOPS_KNOWN] = 1.0
    f[BLOW, 0] = 0.0
    f[SLIP_STATE, 0] = 1.0 if used >= 0 else -1.0
    return faces.each[INCREMENT, 0]
