"""Stops and releases of set-valued faces inside a step, and the forces on the faces.

A march moves the modes under mean forces, so a stop or a release inside the step would be off by up to a step, and a slide
that is held would keep a speed. Here the forces h(x) that would hold all faces change linearly over the step, 0 <= x <= 1,
and a slide accelerates by the difference between h and the friction. So every stop and every release is the root of a line
or a parabola. Between events some faces rest and the others slide. Faces that rest share the force that the others and the
modes ask of them; dependent ones share it by least squares, and one that would be overloaded while the others hold it
carries its static friction. The limits may change linearly over the step, as under a load that varies.

The step then needs slides and speeds at its end. Mean forces give the slides, and blows at the end give the speeds; both
are of second order in the step. `find_blows` computes the work of all friction. If the friction would do work on the modes,
the loop steps by mean forces alone. Read `follow_step` first.

Stiff elastic-plastic faces do not replace this module, because they have one coefficient of friction: a kinetic
coefficient below the static one cannot be given to them. With equal coefficients, on 119 random rigs, 98 % of the errors
hold with set-valued faces; with elastic-plastic ones 50 %, 74 % and 81 % hold for bond lengths of 0.1, 0.01 and 0.001 of
the tolerance times the friction force over the stiffness of the mode, and 72 %, 88 % and 91 % of the values are within the
tolerance, where all set-valued ones are.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..modal_kernels import write_accelerations

# Number of the law in `num` of an element that holds without a stretch; it is set-valued.
SET_VALUED = 0
# Rows of `interfaces.arrays.PortElements`. `of`: port of an element, whether it is friction, and the element of the other
# direction of a slide in a plane.
PORT = 0
IS_FRICTION = 1
MATE = 2
# `modal`: compliance of the coordinates [m/N], accelerations by other forces [m s-2], and the first row of scratch space.
COORDINATE_GIVE = 0
OTHER_ACCELERATION = 1
MODAL_SCRATCH = 2
N_MODAL_ROWS = 5
# `own`: of the contact its mean force, increment of slide, force at the sample and tolerance of the force; then 1 if the
# stops of the step are known.
CONTACT_FORCE = 0
CONTACT_INCREMENT = 1
CONTACT_SAMPLE = 2
CONTACT_TOL = 3
STOPS_KNOWN = 4
N_OWN = 5
# `each`: of an element its mean force [N], slide, speed, bond length, increment of slide, residual, largest force (if
# it is set-valued, of a step by mean forces alone), tolerance of the force, and increments of the last two steps.
ELEMENT_FORCE = 0
ELEMENT_SLIDE = 1
ELEMENT_SPEED = 2
BOND_LENGTH = 3
INCREMENT = 4
ELEMENT_RESIDUAL = 5
MAX_FORCE = 6
FORCE_TOL = 7
LAST_INCREMENT = 8
INCREMENT_BEFORE = 9
N_ELEMENT_ROWS = 10
# `gives`: reduction of slides [m/N], speeds [m/(s N)] and accelerations [1/kg] in a step per constant force.
BETA = 0
GAMMA = 1
ACCELERANCE = 2
# `limit`: static and kinetic friction at the start of the step, and AT_END rows further on at its end.
STATIC = 0
KINETIC = 1
AT_END = 2
# `field`, of a face in the step:
FREE_SLIDE = 0  # increment of slide without its forces [m]
FREE_SPEED = 1  # speed at the end without its forces [m/s]
START_SPEED = 2  # speed at the start [m/s]
WAS_RESTING = 3  # 1 if it rests at the start
HOLDING_START = 4  # force that would hold it, at the start [N]
HOLDING_END = 5  # force that would hold it, at the end [N]
SLIDE = 6  # slide since the start [m]
SPEED = 7  # speed now [m/s]
MEAN_FORCE = 8  # mean force so far [N]
FORCE_NOW = 9  # force now [N]
FORCE_SLOPE = 10  # slope of the force over the step [N]
# A face rests (0), slides (+-1), or carries its static friction while others hold it (+-2).
SLIP_STATE = 11
SLIDES_ON = 12  # 1 if it slides in one direction through the whole step
RIGHT_SIDE = 13  # right-hand side of the equations that are solved
SOLUTION = 14  # solution of these equations
RESIDUAL = 15  # their residual, also scratch space
FACE_INCREMENT = 16  # increment of slide of the step [m]
BLOW = 17  # impulse at the end of the step [N s]
N_FIELDS = 18

# Relative shift of the diagonal, which makes the equations of dependent faces regular.
DIAGONAL_SHIFT = 1e-10
# compliance of a face while the others are held, over its compliance; below it the others hold the face
DEPENDENT_TOL = 1e-7
OVERLOAD_TOL = 1e-9  # fraction by which a force may exceed the static friction
SAME_TIME_TOL = 1e-12  # fraction of a speed below which equal faces stop at once
ZERO_SLIDE_TOL = 1e-14  # fraction of its terms below which an increment of slide is zero
TINY = 1e-300  # keeps a divisor above 0


@njit(error_model="numpy", **NJIT_INTERNAL)
def friction_bound(which, e, x, stops):
    """Return the static or kinetic friction [N] of a face at a fraction of the step.

    Parameters
    ----------
    which : int
        STATIC or KINETIC.
    e : int
        Number of the face.
    x : float
        Place in the step, from 0 at its start to 1.
    stops : interfaces.arrays.Stops

    Returns
    -------
    float
    """
    return stops.limit[which, e] + x * (stops.limit[which + AT_END, e] - stops.limit[which, e])


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_shared_forces(which, count, stops):
    """Solve A x = b for the forces x that the faces `stops.names[:count]` share.

    A is stops.gives[which] of these faces, b their row RIGHT_SIDE of stops.field, and x is written into the row
    SOLUTION, both in the order of the names. Of forces that depend on each other the smallest x is found: a shift
    of the diagonal makes A regular, and one step of iterative refinement removes the shift where it has no
    effect.

    Parameters
    ----------
    which : int
        BETA, GAMMA or ACCELERANCE.
    count : int
        Number of faces.
    stops : interfaces.arrays.Stops

    Returns
    -------
    bool
        Whether A has a positive diagonal.
    """
    a = stops.system[:count, :count]
    b = stops.field[RIGHT_SIDE]
    x = stops.field[SOLUTION]
    r = stops.field[RESIDUAL]
    names = stops.names
    if count == 1:
        give = stops.gives[which, names[0], names[0]]
        x[0] = b[0] / give
        return give > 0.0
    for i in range(count):
        for k in range(count):
            a[i, k] = stops.gives[which, names[i], names[k]]
        a[i, i] *= 1 + DIAGONAL_SHIFT
        x[i] = 0.0
    if not factorise(a):
        return False
    # the second pass removes the effect of the diagonal shift from independent faces
    for _ in range(2):
        for i in range(count):
            r[i] = b[i]
            for k in range(count):
                r[i] -= stops.gives[which, names[i], names[k]] * x[k]
        solve_factorised(a, r[:count])
        for i in range(count):
            x[i] += r[i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def list_resting(stops):
    """Write the numbers of the faces that rest into stops.names; return how many."""
    count = 0
    for e in range(stops.names.size):
        if stops.field[SLIP_STATE, e] == 0.0:
            stops.names[count] = e
            count += 1
    return count


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_forces(x, stops):
    """Write the forces of all faces and their slopes into stops.field.

    Returns whether they exist.
    """
    f = stops.field
    count = list_resting(stops)
    for e in range(stops.names.size):
        which = STATIC if abs(f[SLIP_STATE, e]) == 2.0 else KINETIC
        way = np.sign(f[SLIP_STATE, e])
        f[FORCE_NOW, e] = way * friction_bound(which, e, x, stops)
        f[FORCE_SLOPE, e] = way * (stops.limit[which + AT_END, e] - stops.limit[which, e])
    for part in range(2):
        for i in range(count):
            f[RIGHT_SIDE, i] = 0.0
            for e in range(stops.names.size):
                if f[SLIP_STATE, e] != 0.0:
                    rise = f[HOLDING_END, e] - f[HOLDING_START, e]
                    beyond = (
                        f[HOLDING_START, e] + rise * x - f[FORCE_NOW, e]
                        if part == 0
                        else rise - f[FORCE_SLOPE, e]
                    )
                    f[RIGHT_SIDE, i] += stops.gives[ACCELERANCE, stops.names[i], e] * beyond
        if count and not solve_shared_forces(ACCELERANCE, count, stops):
            return False
        for i in range(count):
            e = stops.names[i]
            rise = f[HOLDING_END, e] - f[HOLDING_START, e]
            if part == 0:
                f[FORCE_NOW, e] = f[HOLDING_START, e] + rise * x + f[SOLUTION, i]
            else:
                f[FORCE_SLOPE, e] = rise + f[SOLUTION, i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def release_face(e, way, stops):
    """Let a face slide, or carry its static friction if the other resting faces hold it.

    Parameters
    ----------
    e : int
        Number of the face.
    way : float
        Sign of the slide.
    stops : interfaces.arrays.Stops
    """
    f = stops.field
    # the face no longer belongs to the resting ones
    f[SLIP_STATE, e] = way
    f[SLIDES_ON, e] = 0.0
    count = list_resting(stops)
    for i in range(count):
        f[RIGHT_SIDE, i] = stops.gives[ACCELERANCE, stops.names[i], e]
    if count == 0 or not solve_shared_forces(ACCELERANCE, count, stops):
        return
    left = stops.gives[ACCELERANCE, e, e]
    for i in range(count):
        left -= stops.gives[ACCELERANCE, e, stops.names[i]] * f[SOLUTION, i]
    if left <= DEPENDENT_TOL * stops.gives[ACCELERANCE, e, e]:
        f[SLIP_STATE, e] = 2 * way


@njit(error_model="numpy", **NJIT_INTERNAL)
def choose_states(x, stops):
    """Choose which faces rest, slide or carry at a fraction of the step.

    Returns whether it succeeds.
    """
    f = stops.field
    for e in range(stops.names.size):
        if abs(f[SLIP_STATE, e]) == 2.0:
            f[SLIP_STATE, e] = 0.0
    for _ in range(2 * stops.names.size + 2):
        if not find_forces(x, stops):
            return False
        worst = OVERLOAD_TOL
        who = -1
        for e in range(stops.names.size):
            over = abs(f[FORCE_NOW, e]) / max(friction_bound(STATIC, e, x, stops), TINY) - 1
            if f[SLIP_STATE, e] == 0.0 and over > worst:
                worst = over
                who = e
        if who < 0:
            return True
        release_face(who, 1.0 if f[FORCE_NOW, who] > 0 else -1.0, stops)
    return False


@njit(error_model="numpy", **NJIT_INTERNAL)
def first_zero(speed, start, bend):
    """Return the first y >= 0 at which speed + start y + bend y^2 falls to 0, infinite if it does not.

    The speed must not be negative, and `start` not negative where the speed is 0.

    Parameters
    ----------
    speed : float
    start : float
    bend : float

    Returns
    -------
    float
    """
    if speed == 0.0:
        return -start / bend if bend < 0 else np.inf
    root = start * start - 4 * bend * speed
    if root < 0:
        return np.inf
    below = np.sqrt(root) - start
    return 2 * speed / below if below > 0 else np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def speed_rates(e, x, dt, stops):
    """Return the change of the speed of a face per length of the step, and half of its slope.

    Parameters
    ----------
    e : int
        Number of the face.
    x : float
        Place in the step, from 0 at its start to 1.
    dt : float
        Length of the step [s].
    stops : interfaces.arrays.Stops

    Returns
    -------
    float
        [m/s]
    float
        [m/s]
    """
    start = 0.0
    bend = 0.0
    f = stops.field
    for k in range(stops.names.size):
        g = dt * stops.gives[ACCELERANCE, e, k]
        rise = f[HOLDING_END, k] - f[HOLDING_START, k]
        start += g * (f[HOLDING_START, k] + rise * x - f[FORCE_NOW, k])
        bend += 0.5 * g * (rise - f[FORCE_SLOPE, k])
    if f[SPEED, e] == 0.0:  # a face that was just released slides forward, up to round-off
        start = f[SLIP_STATE, e] * max(f[SLIP_STATE, e] * start, 0.0)
    return start, bend


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_next_event(x, dt, stops):
    """Find the next stop or release after a fraction of the step.

    Parameters
    ----------
    x : float
        Place in the step, from 0 at its start to 1.
    dt : float
        Length of the step [s].
    stops : interfaces.arrays.Stops

    Returns
    -------
    float
        Distance to the event, in lengths of the step.
    int
        Number of the face, -1 for no event.
    float
        Sign of the slide after a release, 0 for a stop.
    """
    f = stops.field
    y = 1.0 - x
    who = -1
    way = 0.0
    for e in range(stops.names.size):
        if abs(f[SLIP_STATE, e]) == 1.0:
            start, bend = speed_rates(e, x, dt, stops)
            at = first_zero(
                f[SLIP_STATE, e] * f[SPEED, e], f[SLIP_STATE, e] * start, f[SLIP_STATE, e] * bend
            )
            if at < y:
                y = at
                who = e
                way = 0.0
        elif f[SLIP_STATE, e] == 0.0:
            for sign in (1.0, -1.0):
                rise = sign * f[FORCE_SLOPE, e] - (
                    stops.limit[STATIC + AT_END, e] - stops.limit[STATIC, e]
                )
                if rise > 0:
                    at = max(
                        (friction_bound(STATIC, e, x, stops) - sign * f[FORCE_NOW, e]) / rise, 0.0
                    )
                    if at < y:
                        y = at
                        who = e
                        way = sign
    return y, who, way


@njit(error_model="numpy", **NJIT_INTERNAL)
def advance_faces(x, y, who, dt, stops):
    """Move all faces on from a fraction of the step up to an event.

    Parameters
    ----------
    x : float
        Place in the step, from 0 at its start to 1.
    y : float
        Distance in lengths of the step.
    who : int
        Number of the face that has the event, -1 for none; it stops if it slides.
    dt : float
        Length of the step [s].
    stops : interfaces.arrays.Stops
    """
    f = stops.field
    for e in range(stops.names.size):
        f[MEAN_FORCE, e] += y * (f[FORCE_NOW, e] + 0.5 * y * f[FORCE_SLOPE, e])
        if abs(f[SLIP_STATE, e]) == 1.0:
            start, bend = speed_rates(e, x, dt, stops)
            f[SLIDE, e] += y * dt * (f[SPEED, e] + y * (0.5 * start + y * bend / 3))
            f[RESIDUAL, e] = f[SPEED, e] + y * (start + y * bend)
    for e in range(stops.names.size):
        if abs(f[SLIP_STATE, e]) == 1.0:
            last = abs(f[SPEED, e])
            f[SPEED, e] = f[RESIDUAL, e]
            # equal faces stop at the same time
            least = SAME_TIME_TOL * last if last > 0.0 else -1.0
            if (
                e == who
                or (who < 0 and f[SLIP_STATE, e] * f[SPEED, e] <= 0)
                or f[SLIP_STATE, e] * f[SPEED, e] <= least
            ):
                f[SPEED, e] = 0.0
                f[SLIP_STATE, e] = 0.0
                f[SLIDES_ON, e] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def follow_events(dt, stops):
    """Follow the faces from event to event into stops.field; return whether that succeeds."""
    x = 0.0
    for _ in range(6 * stops.names.size + 12):
        if not choose_states(x, stops):
            return False
        y, who, way = find_next_event(x, dt, stops)
        advance_faces(x, y, who, dt, stops)
        if who < 0:
            return True
        x += y
        if way != 0.0:
            release_face(who, way, stops)
    return False


@njit(error_model="numpy", **NJIT_INTERNAL)
def check_all_slide(stops):
    """Return whether all faces slide on to the end of the step.

    If so, stops.field gets their speeds.
    """
    f = stops.field
    count = stops.names.size
    for e in range(count):
        f[SLIP_STATE, e] = np.sign(f[START_SPEED, e])
        f[SLIDES_ON, e] = 1.0
        if f[START_SPEED, e] == 0.0:
            return False
    for e in range(count):
        dq = f[FREE_SLIDE, e]
        end = f[FREE_SPEED, e]
        for k in range(count):
            force = f[SLIP_STATE, k] * friction_bound(KINETIC, k, 0.5, stops)
            dq -= stops.gives[BETA, e, k] * force
            end -= stops.gives[GAMMA, e, k] * force
        if f[SLIP_STATE, e] * dq < 0 or f[SLIP_STATE, e] * end <= 0:
            return False
        f[SPEED, e] = end
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_holding_forces(dt, stops):
    """Find the forces that would hold the faces at both ends of the step.

    Returns whether they exist.

    They are found for all faces at once, and then for the resting ones as the step itself asks of them beside
    those that slide: accelerations are known to the first order of the step only, which would place a release
    anywhere.
    """
    f = stops.field
    coupling = stops.names.size
    for stage in range(2):
        count = coupling
        if stage == 0:
            for e in range(coupling):
                stops.names[e] = e
        else:
            count = list_resting(stops)
            if count == 0 or count == coupling:
                return True
            if not find_forces(0.0, stops):
                return False
        for part in range(2):
            which = BETA if part == 0 else GAMMA
            for i in range(count):
                e = stops.names[i]
                f[RIGHT_SIDE, i] = (
                    f[FREE_SLIDE, e] - f[START_SPEED, e] * dt
                    if part == 0
                    else f[FREE_SPEED, e] - f[START_SPEED, e]
                )
                for k in range(coupling if stage == 1 else 0):
                    if f[SLIP_STATE, k] != 0.0:
                        mean = f[FORCE_NOW, k] + f[FORCE_SLOPE, k] * (1 / 3 if part == 0 else 1 / 2)
                        f[RIGHT_SIDE, i] -= stops.gives[which, e, k] * mean
            if not solve_shared_forces(which, count, stops):
                return False
            for i in range(count):
                e = stops.names[i]
                found = f[SOLUTION, i]
                if part == 0:
                    f[MEAN_FORCE, e] = found
                else:
                    first = 3 * f[MEAN_FORCE, e] - 2 * found
                    last = 4 * found - 3 * f[MEAN_FORCE, e]
                    f[HOLDING_START, e] = (
                        first if stage == 0 else f[HOLDING_START, e] + first - f[FORCE_NOW, e]
                    )
                    f[HOLDING_END, e] = (
                        last
                        if stage == 0
                        else f[HOLDING_END, e] + last - f[FORCE_NOW, e] - f[FORCE_SLOPE, e]
                    )
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def follow_step(dt, stops):
    """Follow the faces through a step into stops.field; return whether that succeeds."""
    f = stops.field
    resolved = True
    for e in range(stops.names.size):
        give = dt * stops.gives[ACCELERANCE, e, e]
        resolved = (
            resolved
            and stops.gives[BETA, e, e] > 0.25 * give * dt
            and stops.gives[GAMMA, e, e] > 0.5 * give
        )
        f[START_SPEED, e] = 0.0 if f[WAS_RESTING, e] == 1.0 else f[START_SPEED, e]
    if check_all_slide(stops):
        return True
    if not resolved or not find_holding_forces(dt, stops):
        return False
    for e in range(stops.names.size):
        f[SPEED, e] = f[START_SPEED, e]
        f[SLIP_STATE, e] = np.sign(f[START_SPEED, e])
        f[SLIDE, e] = 0.0
        f[MEAN_FORCE, e] = 0.0
        f[SLIDES_ON, e] = abs(f[SLIP_STATE, e])
    return follow_events(dt, stops)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def match_mean_forces(stops):
    """Find mean forces of all faces that cause the slides in stops.field.

    Returns whether they exist.
    """
    f = stops.field
    count = 0
    for e in range(stops.names.size):
        if f[SLIDES_ON, e] == 1.0:
            f[MEAN_FORCE, e] = f[SLIP_STATE, e] * friction_bound(KINETIC, e, 0.5, stops)
        else:
            stops.names[count] = e
            count += 1
    for i in range(count):
        e = stops.names[i]
        f[RIGHT_SIDE, i] = f[FREE_SLIDE, e] - f[SLIDE, e]
        for k in range(stops.names.size):
            f[RIGHT_SIDE, i] -= stops.gives[BETA, e, k] * f[MEAN_FORCE, k]
    if count and not solve_shared_forces(BETA, count, stops):
        return False
    for i in range(count):
        e = stops.names[i]
        most = max(stops.limit[STATIC, e], stops.limit[STATIC + AT_END, e])
        f[MEAN_FORCE, e] = min(max(f[MEAN_FORCE, e] + f[SOLUTION, i], -most), most)
    for e in range(stops.names.size):
        f[FACE_INCREMENT, e] = f[FREE_SLIDE, e]
        size = abs(f[FREE_SLIDE, e])
        for k in range(stops.names.size):
            part = stops.gives[BETA, e, k] * f[MEAN_FORCE, k]
            f[FACE_INCREMENT, e] -= part
            size += abs(part)
        if (
            f[SLIDE, e] == 0.0
            and f[SLIDES_ON, e] == 0.0
            and abs(f[FACE_INCREMENT, e]) <= ZERO_SLIDE_TOL * size
        ):
            f[FACE_INCREMENT, e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_blows(stops):
    """Find the impulses that cause the speeds of the faces; return the friction work [J]."""
    f = stops.field
    count = 0
    work = 0.0
    for e in range(stops.names.size):
        f[BLOW, e] = 0.0
        work += f[MEAN_FORCE, e] * f[FACE_INCREMENT, e]
        for k in range(stops.names.size):
            f[FREE_SPEED, e] -= stops.gives[GAMMA, e, k] * f[MEAN_FORCE, k]
        turned = f[SLIDES_ON, e] == 0.0 or f[SLIP_STATE, e] * f[FREE_SPEED, e] <= 0.0
        if turned and abs(f[SLIP_STATE, e]) != 2.0:
            stops.names[count] = e
            count += 1
    for i in range(count):
        f[RIGHT_SIDE, i] = f[FREE_SPEED, stops.names[i]] - f[SPEED, stops.names[i]]
    if count and not solve_shared_forces(ACCELERANCE, count, stops):
        return -np.inf
    for i in range(count):
        e = stops.names[i]
        f[BLOW, e] = f[SOLUTION, i]
        work += 0.5 * f[SOLUTION, i] * (f[FREE_SPEED, e] + f[SPEED, e])
    return work


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_stopping_blows(motion, stops):
    """Find the blows that stop the faces without a slide, after a step by mean forces alone."""
    f = stops.field
    count = 0
    for e in range(stops.names.size):
        f[BLOW, e] = 0.0
        f[SLIP_STATE, e] = np.sign(f[FACE_INCREMENT, e])
        if f[FACE_INCREMENT, e] == 0.0:
            f[RIGHT_SIDE, count] = face_speed(motion, e, stops)
            stops.names[count] = e
            count += 1
    if count and solve_shared_forces(ACCELERANCE, count, stops):
        for i in range(count):
            f[BLOW, stops.names[i]] = f[SOLUTION, i]


@njit(error_model="numpy", **NJIT_INTERNAL)
def face_speed(motion, e, stops):
    """Return the speed of a face [m/s].

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    e : int
        Number of the face.
    stops : interfaces.arrays.Stops
    """
    out = 0.0
    for k in range(motion.shape[1]):
        out += stops.rows[e, k] * motion[1, k]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def apply_blows(motion, mass, stops):
    """Strike the modes by the blows; return the energy that the blows take [J].

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    mass : float
        [kg]
    stops : interfaces.arrays.Stops

    Returns
    -------
    float
    """
    f = stops.field
    lost = 0.0
    for k in range(motion.shape[1]):
        change = 0.0
        for e in range(stops.names.size):
            change -= stops.rows[e, k] * f[BLOW, e] / mass
        lost -= mass * change * (motion[1, k] + 0.5 * change)
        motion[1, k] += change
    for e in range(stops.names.size):
        f[WAS_RESTING, e] = 0.0 if abs(f[SLIP_STATE, e]) == 1.0 else 1.0
    return lost


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_reactions(motion, modal_system, drive, accel, scratch, stops):
    """Find the forces on the resting faces that leave them no acceleration at an instant.

    They are written into the row SOLUTION of stops.field, in the order of stops.names.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates of the modes.
    modal_system : interfaces.arrays.ModalArrays
    drive : float
        Acceleration of the base [m s-2].
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    scratch : (2, n) array
        Space for results.
    stops : interfaces.arrays.Stops

    Returns
    -------
    int
        Number of the forces, 0 if none are found.
    """
    write_accelerations(motion, modal_system, drive, accel, scratch)
    count = list_resting(stops)
    for i in range(count):
        stops.field[RIGHT_SIDE, i] = 0.0
        for k in range(accel.size):
            stops.field[RIGHT_SIDE, i] += stops.rows[stops.names[i], k] * scratch[0, k]
    return count if count and solve_shared_forces(ACCELERANCE, count, stops) else 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rests_through_step(stops):
    """Return whether all faces rest through the step under mean forces below their static friction."""
    f = stops.field
    coupling = stops.names.size
    for e in range(coupling):
        if f[WAS_RESTING, e] == 0.0 and f[START_SPEED, e] != 0.0:
            return False
        stops.names[e] = e
        f[RIGHT_SIDE, e] = f[FREE_SLIDE, e]
    if not solve_shared_forces(BETA, coupling, stops):
        return False
    for e in range(coupling):
        if abs(f[SOLUTION, e]) > min(stops.limit[STATIC, e], stops.limit[STATIC + AT_END, e]):
            return False
        f[MEAN_FORCE, e] = f[SOLUTION, e]
        f[SLIP_STATE, e] = 0.0
        f[SLIDES_ON, e] = 0.0
        f[SLIDE, e] = 0.0
        f[SPEED, e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def rests_at_end(motion, modal_system, drive, accel, scratch, stops):
    """Return whether static friction holds the faces at the end of a step through which they rest.

    A straight line between the holding forces at both ends would miss a peak of them beyond the end.

    Parameters
    ----------
    motion : (2, n) array
        Coordinates and rates at the end of the step; they are changed.
    modal_system : interfaces.arrays.ModalArrays
    drive : float
        Acceleration of the base [m s-2].
    accel : (n,) array
        Modal accelerations of the forces [m s-2].
    scratch : (2, n) array
        Space for results.
    stops : interfaces.arrays.Stops

    Returns
    -------
    bool
    """
    coupling = stops.names.size
    for e in range(coupling):
        stops.field[RIGHT_SIDE, e] = face_speed(motion, e, stops)
        stops.names[e] = e
    if not solve_shared_forces(ACCELERANCE, coupling, stops):
        return False
    for k in range(accel.size):
        for e in range(coupling):
            motion[1, k] -= stops.rows[e, k] * stops.field[SOLUTION, e] / modal_system.mass
    if find_reactions(motion, modal_system, drive, accel, scratch, stops) < coupling:
        return False
    for i in range(coupling):
        if abs(stops.field[SOLUTION, i]) > stops.limit[STATIC + AT_END, stops.names[i]]:
            return False
    return True
