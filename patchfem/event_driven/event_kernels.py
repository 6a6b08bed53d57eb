"""Values and roots within a step, its first event, and the change of regime there (compiled).

The margins are evaluated on the dense output at N_CHECKS points of a step, and at the vertex of the parabola through
three of them where a margin nearly vanishes between two points.
"""

from typing import NamedTuple

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from ..motion_measures import STICKING_SLIP_FRACTION
from .motion_kernels import (
    copy_values,
    find_drive,
    find_integrals,
    find_rates,
    look,
    project,
    rests,
    update_grip,
)
from .records import (
    N_FACE_INTEGRALS,
    N_NODES,
    Clock,
    Face,
    Margin,
    Memory,
    Mode,
    Probe,
    Setting,
)
from .step_kernels import POINT, RATES, read_curve
from .table_kernels import switch_law, write_law_margins


class StepEvent(NamedTuple):
    """First event of a step.

    - fraction: of the step, 0 to 1, at the event
    - face: number of its interface, or -1 without an event
    - which: `Margin` that vanishes there
    """

    fraction: float
    face: int
    which: int


N_CHECKS = 3  # points of a step at which margins are evaluated, besides its start
N_MARGINS = 5
LAST_PROBES = N_NODES  # row of `State.probes` of the last evaluation
LAST_MARGINS = 4  # row of `State.margins` of the last evaluation
MARGIN_TOL = 1e-11  # margins are relative; above minus this they count as positive
MAX_PIVOTS = 100
N_ORDERED_PIVOTS = (
    20  # pivots by the order in which limits are reached; then by number, which always ends
)
N_HALVINGS = 40  # halvings of the change of the forces
MAX_OVERLOAD = 1e-9  # relative excess over the static friction that is attributed to round-off
SAME_SPEED_TOL = 1e-12  # relative velocity below which an interface stops together with another one
VERTEX_FRACTION = (
    0.2  # a vertex is evaluated if it lies below this fraction of the margins beside it
)
ROOT_TOL = 1e-14  # error of the time of an event, relative to the length of its step
MAX_ROOT_STEPS = 60  # iterations of the search for the time of an event
FIRST_LOOK = 1e-5  # fraction of an interval, behind a margin that starts at 0


@njit(**NJIT_KERNEL)
def write_margins(rig, state, t, y, margins):
    """Write the margins of all interfaces at a state.

    A margin is a function of the state whose zero ends the present regime of a law, such as the distance of the force from
    the friction limit in stick. Margins of rigid laws need the accelerations.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    t : float
        Time [s].
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    margins : (M, 5) array
        Margins of the M interfaces, in the order of `records.Margin`, which are written.
    """
    n = rig.modes.shape[1]
    if rig.settings[Setting.HAS_RIGID] > 0:
        find_rates(rig, state, t, y, state.rows[RATES])
    for i in range(rig.faces.shape[0]):
        face = rig.faces[i]
        first = 2 * n + int(face[Face.FIRST_STATE])
        margins[i, :] = np.inf
        point = look(rig, state, i, t, y)
        write_law_margins(
            int(face[Face.LAW]),
            face[Face.NUMBERS :],
            state.memory[i],
            point,
            y[first : first + int(face[Face.N_STATES])],
            margins[i],
        )


@njit(**NJIT_KERNEL)
def copy_margins(state, row):
    """Copy a row of `State.margins` (rows, M, 5), the margins of M interfaces, to row 0, the start of the next step."""
    for i in range(state.margins.shape[1]):
        copy_values(state.margins[row, i], state.margins[0, i])


@njit(**NJIT_KERNEL)
def write_margins_inside(rig, state, x, row):
    """Write the margins at the fraction x of a step into a row of `State.margins`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    x : float
        Fraction of the step.
    row : int
        Row of `State.margins` that is written.
    """
    y = state.rows[POINT, : find_integrals(rig)]
    read_curve(state, x, y)
    t = state.clock[Clock.TIME] + x * state.clock[Clock.LENGTH]
    write_margins(rig, state, t, y, state.margins[row])


@njit(**NJIT_KERNEL)
def write_probes(rig, state, t, y, probes):
    """Write the scalars of a state that cycles and windows observe, such as slides and forces.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    t : float
        Time [s].
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    probes : (p,) array
        Scalars in the order of `records.Probe`, which are written.
    """
    n = rig.modes.shape[1]
    find_rates(rig, state, t, y, state.rows[RATES])
    acceleration = state.rows[RATES, n : 2 * n]

    # Motion of the points that are measured; the base moves an accelerometer too.
    output = rig.modes[Mode.OUTPUT]
    probes[Probe.SPEED] = project(output, y[n : 2 * n])
    probes[Probe.TRAVEL] = rig.settings[Setting.TRAVEL] - abs(project(output, y[:n]))
    probes[Probe.GAUGE] = project(rig.modes[Mode.GAUGE], y[:n])
    probes[Probe.ACCELERATION] = project(output, acceleration)
    if rig.settings[Setting.BASE_MOVES] > 0:
        probes[Probe.ACCELERATION] += find_drive(rig, state.clock, t)[0]

    # A sliding interface that others hold has a velocity of round-off.
    slowest = 0.0
    for i in range(rig.faces.shape[0]):
        if rests(state.memory[i]):
            slowest = SAME_SPEED_TOL

    # Every interface; a law slips where the irreversible part of its velocity exceeds the elastic one.
    integrals = find_integrals(rig)
    for i in range(rig.faces.shape[0]):
        point = look(rig, state, i, t, y)
        memory = state.memory[i]
        first = Probe.FACES + Probe.COUNT * i
        probes[first + Probe.FORCE] = memory[Memory.FORCE]
        probes[first + Probe.SLIP] = y[integrals + N_FACE_INTEGRALS * i + 1]
        probes[first + Probe.SLIDE] = point.slide
        probes[first + Probe.LOAD] = max(point.load, 0.0)
        if i == 0:
            probes[Probe.VELOCITY] = point.velocity
        sticking_rate = STICKING_SLIP_FRACTION * abs(point.velocity)
        slipping = abs(memory[Memory.SLIP_RATE]) - sticking_rate
        is_still = rests(memory) or abs(point.velocity) <= slowest * point.speed_scale
        probes[Probe.SLIPPING - i] = -1.0 if is_still else slipping


@njit(**NJIT_KERNEL)
def find_value(rig, state, x, i, k):
    """Return a value at the fraction x of the present step: a margin of interface i, or a probe if i < 0.

    A margin is a function of the state that is positive in the present regime of a law. A probe is a scalar that is
    observed, such as a slide or a force.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    x : float
        Fraction of the step.
    i : int
        Number of the interface, or -1.
    k : int
        Number of the margin (`records.Margin`), or column of the probes (`records.Probe`).
    """
    if i >= 0:
        write_margins_inside(rig, state, x, LAST_MARGINS)
        return state.margins[LAST_MARGINS, i, k]
    y = state.rows[POINT]
    read_curve(state, x, y)
    t = state.clock[Clock.TIME] + x * state.clock[Clock.LENGTH]
    write_probes(rig, state, t, y, state.probes[LAST_PROBES])
    return state.probes[LAST_PROBES, k]


@njit(**NJIT_KERNEL)
def find_margin_root(rig, state, i, k, left, right):
    """Return the fraction of a step at which a margin vanishes, so that the regime of a law ends.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    i : int
        Number of the interface.
    k : int
        Number of the margin (`records.Margin`).
    left : float
        Fraction of the step before the root.
    right : float
        Fraction of the step after the root.
    """
    f_left = find_value(rig, state, left, i, k)
    if f_left < -MARGIN_TOL:
        return left
    start = left
    if f_left <= MARGIN_TOL:
        # A margin that starts at 0, or at a round-off above it, may first increase.
        inside = FIRST_LOOK
        while inside <= 1 and find_value(rig, state, left + inside * (right - left), i, k) <= 0:
            inside *= 4
        if inside <= 1:
            start = left + inside * (right - left)
        elif f_left <= 0:
            return left
    return find_root(rig, state, i, k, start, right)


@njit(**NJIT_KERNEL)
def find_root(rig, state, i, k, left, right):
    """Return the fraction of a step at which a value changes its sign between two fractions (Illinois rule).

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    i : int
        Number of the interface, or -1.
    k : int
        Number of the margin, or column of the probes.
    left : float
        Fraction of the step before the root.
    right : float
        Fraction of the step after the root.
    """
    f_left = find_value(rig, state, left, i, k)
    f_right = find_value(rig, state, right, i, k)
    for _ in range(MAX_ROOT_STEPS):
        middle = (left * f_right - right * f_left) / (f_right - f_left)
        f_middle = find_value(rig, state, middle, i, k)
        if f_middle * f_right < 0:
            left = right
            f_left = f_right
        else:
            f_left *= 0.5
        right = middle
        f_right = f_middle
        if f_middle == 0 or abs(right - left) < ROOT_TOL:
            break
    return right


@njit(**NJIT_KERNEL)
def find_vertex(a, b, c):
    """Return the position in [0, 2] of the minimum of a parabola through (0, a), (1, b), (2, c), and its value.

    The position is -1 without a minimum inside.

    Parameters
    ----------
    a : float
        Value at 0.
    b : float
        Value at 1.
    c : float
        Value at 2.
    """
    bend = a - 2 * b + c
    slope = 0.5 * (c - a)
    if not bend > 0 or abs(slope) >= bend:
        return -1.0, 0.0
    return 1 - slope / bend, b - 0.5 * slope * slope / bend


@njit(**NJIT_KERNEL)
def find_event(rig, state, undecided):
    """Return the first event of a step: the fraction at which a margin first becomes negative, with its interface.

    Row 0 of the margins is that of the start of the step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    undecided : int
        Number of an interface that stays in its regime of motion for this step, or -1.
    """
    event = StepEvent(1.0, -1, -1)
    n_faces = rig.faces.shape[0]

    # Margins that are negative at a point, or at the vertex of the parabola through three points.
    for check in range(1, N_CHECKS + 1):
        write_margins_inside(rig, state, check / N_CHECKS, check)
        for i in range(n_faces):
            for k in range(N_MARGINS):
                left = (check - 1) / N_CHECKS
                right = check / N_CHECKS
                is_negative = state.margins[check, i, k] < -MARGIN_TOL
                if check > 1 and not is_negative:
                    # A short excursion below 0 between the points shows as a minimum close to 0.
                    a = state.margins[check - 2, i, k]
                    b = state.margins[check - 1, i, k]
                    c = state.margins[check, i, k]
                    vertex, value = find_vertex(a, b, c)
                    if vertex >= 0 and value < VERTEX_FRACTION * max(a, c):
                        right = (check - 2 + vertex) / N_CHECKS
                        left = (check - 2 + int(vertex)) / N_CHECKS
                        is_negative = find_value(rig, state, right, i, k) < -MARGIN_TOL

                stays = i == undecided and k == Margin.MOTION
                if is_negative and not stays and left < event.fraction:
                    root = find_margin_root(rig, state, i, k, left, right)
                    if event.face < 0 or root < event.fraction:
                        event = StepEvent(root, i, k)
        if event.face >= 0:
            break
    return find_event_before(rig, state, undecided, event) if event.face >= 0 else event


@njit(**NJIT_KERNEL)
def find_event_before(rig, state, undecided, event):
    """Return the first event of a step: a given one, or another one whose margin is already negative there.

    A margin that follows the slide is smallest where the slide reverses, and may be positive at all points of the step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    undecided : int
        Number of an interface that stays in its regime of motion for this step, or -1.
    event : StepEvent
        First event of those whose margins are negative at a point of the step.
    """
    first = event
    left = int(event.fraction * N_CHECKS) / N_CHECKS
    write_margins_inside(rig, state, event.fraction, N_CHECKS)
    for i in range(rig.faces.shape[0]):
        for k in range(N_MARGINS):
            stays = i == undecided and k == Margin.MOTION
            is_event = i == event.face and k == event.which
            if stays or is_event or state.margins[N_CHECKS, i, k] >= -MARGIN_TOL:
                continue
            root = find_margin_root(rig, state, i, k, left, event.fraction)
            if root < first.fraction:
                first = StepEvent(root, i, k)
    return first


@njit(**NJIT_KERNEL)
def change_regime(rig, state, i, which):
    """Switch the regime of an interface at an event; return whether the run ends.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    i : int
        Number of the interface.
    which : int
        Margin that has vanished (`records.Margin`).
    """
    n = rig.modes.shape[1]
    face = rig.faces[i]
    t = state.clock[Clock.TIME]
    first = 2 * n + int(face[Face.FIRST_STATE])
    find_rates(rig, state, t, state.y, state.rows[RATES])
    for k in range(rig.faces.shape[0]):
        state.memory[k, Memory.RESTED] = 1.0 if rests(state.memory[k]) else 0.0
    point = look(rig, state, i, t, state.y)
    ends = switch_law(
        int(face[Face.LAW]),
        face[Face.NUMBERS :],
        state.memory[i],
        point,
        state.y[first : first + int(face[Face.N_STATES])],
        which,
    )
    is_rigid = face[Face.RIGID] > 0
    if not is_rigid or rests(state.memory[i]):
        stop_together(rig, state, is_rigid)
    hold_or_release(rig, state)
    return ends


@njit(**NJIT_KERNEL)
def stop_together(rig, state, has_stopped):
    """Bring rigid interfaces without velocity to rest; the modes lose the round-off of these velocities.

    If one of them `has_stopped`, all do. Where another interface turns back, those do that turn back with it, because the
    forces before this event (`RATES`) slow them down; the others have just been released.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    has_stopped : bool
        Whether the event is the stop of a rigid interface.
    """
    n = rig.modes.shape[1]
    v = state.y[n : 2 * n]
    for i in range(rig.faces.shape[0]):
        row = rig.rows[0, i]
        velocity = project(row, v)
        is_stopping = abs(velocity) < SAME_SPEED_TOL * state.memory[i, Memory.SPEED]
        if not has_stopped:
            slowing = state.memory[i, Memory.DIRECTION] * project(row, state.rows[RATES, n : 2 * n])
            is_stopping = is_stopping and slowing < 0
        if rig.faces[i, Face.RIGID] and state.memory[i, Memory.CONTACT] > 0 and is_stopping:
            state.memory[i, Memory.DIRECTION] = 0.0
        if rests(state.memory[i]):
            square = project(row, row)
            for j in range(n):
                v[j] -= row[j] * velocity / square


@njit(**NJIT_KERNEL)
def hold_or_release(rig, state):
    """Find which rigid interfaces without velocity rest and which slip (Murty's principal pivoting).

    Rest must not need more than the static friction, and an interface that begins to slip must accelerate in the
    direction of its slip. An interface that violates its condition changes sides, until none does.

    With kinetic below static friction several states may be possible. Among interfaces at rest, the one is released
    whose limit is reached first while the forces change from those before the event; afterwards those are held again that
    can rest while the others slip.
    """
    n_faces = rig.faces.shape[0]
    for i in range(n_faces):
        state.memory[i, Memory.BEFORE] = state.memory[i, Memory.FORCE]

    # Each pass moves one interface from rest to slip or back.
    n_released = 0
    for pivot in range(MAX_PIVOTS):
        update_grip(rig, state)
        write_margins(rig, state, state.clock[Clock.TIME], state.y, state.margins[LAST_MARGINS])
        i = find_violation(rig, state)
        if i < 0:
            break
        if pivot < N_ORDERED_PIVOTS and rests(state.memory[i]):
            i = find_first_overload(rig, state, i)

        # The interface changes sides, in the direction of the force that held it.
        memory = state.memory[i]
        memory[Memory.RELEASED] = 0.0
        if rests(memory):
            n_released += 1
            memory[Memory.RELEASED] = 1.0
            memory[Memory.DIRECTION] = 1.0 if memory[Memory.FORCE] > 0 else -1.0
        else:
            memory[Memory.DIRECTION] = 0.0

    # The first interface that was released may rest again after others have begun to slip.
    if n_released > 1:
        hold_again(rig, state)
    for i in range(n_faces):
        state.memory[i, Memory.RELEASED] = 0.0
    copy_margins(state, LAST_MARGINS)


@njit(**NJIT_KERNEL)
def hold_again(rig, state):
    """Hold the interfaces that were released and can rest while the others slip.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    """
    for i in range(rig.faces.shape[0]):
        memory = state.memory[i]
        if memory[Memory.RELEASED] == 0:
            continue
        direction = memory[Memory.DIRECTION]
        memory[Memory.DIRECTION] = 0.0
        update_grip(rig, state)
        write_margins(rig, state, state.clock[Clock.TIME], state.y, state.margins[LAST_MARGINS])
        if find_violation(rig, state) >= 0:
            memory[Memory.DIRECTION] = direction
    update_grip(rig, state)
    write_margins(rig, state, state.clock[Clock.TIME], state.y, state.margins[LAST_MARGINS])


@njit(**NJIT_KERNEL)
def find_violation(rig, state):
    """Return the first rigid interface that can neither stay at rest nor begin to slip as it does, or -1."""
    n = rig.modes.shape[1]
    for i in range(rig.faces.shape[0]):
        memory = state.memory[i]
        if not rig.faces[i, Face.RIGID] or memory[Memory.CONTACT] < 0:
            continue
        if rests(memory):
            if state.margins[LAST_MARGINS, i, Margin.MOTION] < -MAX_OVERLOAD:
                return i
        elif rig.settings[Setting.IS_BENCH] == 0:
            row = rig.rows[0, i]
            velocity = project(row, state.y[n : 2 * n])
            inertia = rig.settings[Setting.MASS] / project(row, row)
            push = memory[Memory.DIRECTION] * project(row, state.rows[RATES, n : 2 * n]) * inertia
            is_still = abs(velocity) < SAME_SPEED_TOL * memory[Memory.SPEED]
            if is_still and push < -MAX_OVERLOAD * rig.faces[i, Face.LOAD]:
                return i
    return -1


@njit(**NJIT_KERNEL)
def find_overload(rig, state, fraction):
    """Return the first interface at rest that is beyond its static friction at a fraction of the change of forces, or -1.

    The forces change from those before the event to those that hold the interfaces.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, whose forces are kept.
    fraction : float
        From 0 to 1.
    """
    n = rig.modes.shape[1]
    for i in range(rig.faces.shape[0]):
        face = rig.faces[i]
        memory = state.memory[i]
        if not face[Face.RIGID] or not rests(memory):
            continue
        held = memory[Memory.FORCE]
        memory[Memory.FORCE] = memory[Memory.BEFORE] + fraction * (held - memory[Memory.BEFORE])
        point = look(rig, state, i, state.clock[Clock.TIME], state.y)
        memory[Memory.FORCE] = held
        first = 2 * n + int(face[Face.FIRST_STATE])
        states = state.y[first : first + int(face[Face.N_STATES])]
        margins = state.margins[0, i]
        write_law_margins(int(face[Face.LAW]), face[Face.NUMBERS :], memory, point, states, margins)
        if margins[Margin.MOTION] < -MAX_OVERLOAD:
            return i
    return -1


@njit(**NJIT_KERNEL)
def find_first_overload(rig, state, last):
    """Return the interface at rest whose static friction is reached first while the forces change (bisection).

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion.
    last : int
        An interface that is beyond its static friction in the end.
    """
    left = 0.0
    right = 1.0
    for _ in range(N_HALVINGS):
        middle = 0.5 * (left + right)
        i = find_overload(rig, state, middle)
        if i < 0:
            left = middle
        else:
            right = middle
            last = i
    return last


@njit(**NJIT_KERNEL)
def start_directions(rig, state):
    """Set the directions of motion at the start of a run; a law keeps a direction that it has.

    A new law has that of the velocity, or of the acceleration if there is no velocity. A rigid interface without a
    velocity is at rest. A bench prescribes the slide, so that its interface always moves.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion at its start. The memory of each interface is updated: `Memory.DIRECTION` is 1, -1 or, at rest, 0, and
        `Memory.CONTACT` is -1 where the surfaces are apart.
    """
    n = rig.modes.shape[1]
    t = state.clock[Clock.TIME]
    acceleration = state.rows[RATES, n : 2 * n]
    is_bench = rig.settings[Setting.IS_BENCH] > 0
    for i in range(rig.faces.shape[0]):
        point = look(rig, state, i, t, state.y)
        velocity = point.velocity
        is_new = state.memory[i, Memory.DIRECTION] == 0
        if is_new and point.load < 0:
            state.memory[i, Memory.CONTACT] = -1.0
        if is_new:
            state.memory[i, Memory.ORIGIN] = point.slide
        if is_new and (is_bench or abs(velocity) > SAME_SPEED_TOL * point.speed_scale):
            state.memory[i, Memory.DIRECTION] = 1.0 if velocity >= 0 else -1.0
        elif is_new and not rig.faces[i, Face.RIGID]:
            # The acceleration under all other forces, because a law has no force without a motion.
            state.memory[i, Memory.DIRECTION] = 1.0
            find_rates(rig, state, t, state.y, state.rows[RATES])
            if project(rig.rows[0, i], acceleration) < 0:
                state.memory[i, Memory.DIRECTION] = -1.0
    hold_or_release(rig, state)
