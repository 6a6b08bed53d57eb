"""Measures of cycles and windows, samples and events, from the dense output of the steps (compiled).

A step, or its part up to an event, is evaluated at the seven points of the Gauss-Lobatto rule of order 12. Integrals are
the sums of this rule; extremes inside are located by parabolas.

`rig` is a `records.Rig` and `state` a `records.State`, whose rows are named by enumerations of `records`: `Clock` for values
of the run such as LENGTH, the duration of the present step [s], `Memory` for each interface, `Probe` for what is observed. A
place in a step is its fraction from 0 to 1.
"""

import numpy as np

from ..kernel_cache.flags_kernels import NJIT_KERNEL
from ..kernel_cache.jit import njit
from .event_kernels import LAST_PROBES, find_root, find_value, find_vertex
from .laws import LAWS
from .motion_kernels import (
    copy_values,
    find_phase,
    find_rates,
    look,
    project,
)
from .records import (
    N_NODES,
    Clock,
    Cycle,
    Extreme,
    Face,
    Integral,
    Memory,
    Mode,
    Piece,
    Probe,
    Setting,
    Window,
)
from .step_kernels import POINT, RATES, read_curve

PRESSED_SPRINGS = LAWS.index("pressed_springs")  # number of the law
# Gauss-Lobatto rule of seven points (N_NODES) on an interval of length 1. Between events, where the motion is smooth, steps
# are long: with five points the third harmonic would have an error of 1e-7.
INNER = np.sqrt(5 / 11 + 2 / 11 * np.sqrt(5 / 3) * np.array([1.0, -1.0])) / 2
NODES = np.array([0.0, *(0.5 - INNER), 0.5, *(0.5 + INNER[::-1]), 1.0])
INNER_WEIGHTS = (124 + 7 * np.sqrt(15) * np.array([-1.0, 1.0])) / 700
WEIGHTS = np.array([1 / 42, *INNER_WEIGHTS, 128 / 525, *INNER_WEIGHTS[::-1], 1 / 42])
N_PARABOLAS = 6  # steps of the search for an extreme
NEAR_EXTREME = 0.2  # extremes of a step that are further from those of the window are not located
# Smallest ratio of the slope at an end of a step and the mean slope near this end at which no extreme lies inside
MIN_END_SLOPE = 0.5
MIN_STICK = 1e-9  # duration of the shortest stick, relative to the period
EXTREME_REACH = (
    1e-3  # distance from a located extreme, as a fraction of a step, within which the velocity is 0
)
EVENT_SLIDE_TOL = 1e-12  # relative difference of slides before and after an event


@njit(**NJIT_KERNEL)
def rises_to_end(state, column, end):
    """Return whether a probe has its extreme at an end of a step, because its slope keeps its sign up to there.

    The slope is that of the parabola through the three points next to this end.

    Parameters
    ----------
    state : State
        Motion.
    column : int
        Column of `State.probes`.
    end : int
        Number of the point: the first or the last one.
    """
    step = 1 if end == 0 else -1
    near = end + step
    far = near + step
    last = (state.probes[near, column] - state.probes[end, column]) / (NODES[near] - NODES[end])
    before = (state.probes[far, column] - state.probes[near, column]) / (NODES[far] - NODES[near])
    change = (last - before) * (NODES[near] - NODES[end]) / (NODES[far] - NODES[end])
    return last != 0 and (last + change) / last > MIN_END_SLOPE


@njit(**NJIT_KERNEL)
def raise_extreme(rig, state, fraction, column, sign, known):
    """Return the largest (sign 1) or smallest (-1) value of a probe so far, and where in the step it lies.

    `known` is the extreme before this step, and the probe is known at a few points of the step. The position is a
    fraction of the step, at which the probes were evaluated last; it is -1 if the extreme does not lie in this step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    fraction : float
        Fraction of the step at which its motion ends.
    column : int
        Column of `State.probes`.
    sign : float
        1 for the largest value, -1 for the smallest.
    known : float
        Value that is known already.
    """
    # The best of the known points. A smooth curve exceeds it by less than the range of the points, so that no search is
    # needed if the extreme so far is larger by more than this range.
    best = worst = 0
    for node in range(1, N_NODES):
        if sign * state.probes[node, column] > sign * state.probes[best, column]:
            best = node
        if sign * state.probes[node, column] < sign * state.probes[worst, column]:
            worst = node
    value = sign * state.probes[best, column]
    rise = value - sign * state.probes[worst, column]
    if value + min(rise, NEAR_EXTREME * abs(known)) <= sign * known:
        return known, -1.0
    if best in (0, N_NODES - 1) and rises_to_end(state, column, best):
        if value <= sign * known:
            return known, -1.0
        find_value(rig, state, fraction * NODES[best], -1, column)
        return sign * value, fraction * NODES[best]

    # Successive parabolas through the best point and its neighbours.
    x = NODES[best]
    width = 0.5 * max(NODES[min(best + 1, N_NODES - 1)] - x, x - NODES[max(best - 1, 0)])
    middle = min(max(x, width), 1 - width)

    for _ in range(N_PARABOLAS):
        a = -sign * find_value(rig, state, fraction * (middle - width), -1, column)
        b = -sign * find_value(rig, state, fraction * middle, -1, column)
        c = -sign * find_value(rig, state, fraction * (middle + width), -1, column)
        vertex = find_vertex(a, b, c)[0]
        if vertex < 0:
            vertex = 0.0 if a < c else 2.0

        # The vertex becomes the middle of a narrower parabola.
        at = middle + (vertex - 1) * width
        found = sign * find_value(rig, state, fraction * at, -1, column)
        gain = found - value
        if gain > 0:
            x = at
            value = found
        if abs(gain) < 1e-12 * abs(value):
            break
        width *= 0.3
        middle = min(max(at, width), 1 - width)
    if value <= sign * known:
        return known, -1.0
    find_value(rig, state, fraction * x, -1, column)
    return sign * value, fraction * x


@njit(**NJIT_KERNEL)
def observe_cycle(rig, state, fraction, cycle):
    """Add the extremes and the first harmonic of the output in a part of a step to those of a cycle.

    Steps are short against the cycle, so that an extreme lies where the velocity changes sign. The harmonic needs no
    stages: the dense output has an error of order 8, so that its integral keeps the order of the step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    fraction : float
        Fraction of the step at which its motion ends.
    cycle : (12,) array
        Row of `records.Record.cycles`.
    """
    n = rig.modes.shape[1]
    y = state.rows[POINT]
    length = fraction * state.clock[Clock.LENGTH]
    for node in range(N_NODES):
        read_curve(state, fraction * NODES[node], y[:n])
        phase = rig.settings[Setting.OMEGA] * (state.clock[Clock.TIME] + length * NODES[node])
        value = length * WEIGHTS[node] * project(rig.modes[Mode.OUTPUT], y[:n])
        cycle[Cycle.COS] += value * np.cos(phase)
        cycle[Cycle.SIN] += value * np.sin(phase)

    before = project(rig.modes[Mode.OUTPUT], state.y[n : 2 * n])
    read_curve(state, fraction, y)
    add_output(rig, y, cycle)
    if before * project(rig.modes[Mode.OUTPUT], y[n : 2 * n]) < 0:
        find_root(rig, state, -1, Probe.SPEED, 0.0, fraction)
        add_output(rig, y, cycle)


@njit(**NJIT_KERNEL)
def add_output(rig, y, cycle):
    """Update the smallest and largest output of a cycle by the output at a state.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    y : (n,) array
        Coordinates, velocities, states of the laws and integrals, in the order of `records.State.y`.
    cycle : (12,) array
        Row of `records.Record.cycles`.
    """
    output = project(rig.modes[Mode.OUTPUT], y[: rig.modes.shape[1]])
    cycle[Cycle.MIN] = min(cycle[Cycle.MIN], output)
    cycle[Cycle.MAX] = max(cycle[Cycle.MAX], output)


@njit(**NJIT_KERNEL)
def observe_window(rig, state, record, cycle, fraction):
    """Add the part of a step up to a fraction to the measures of the window of a cycle.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    cycle : int
        Number of the cycle.
    fraction : float
        Fraction of the step at which its motion ends.
    """
    clock = state.clock
    length = fraction * clock[Clock.LENGTH]
    clock[Clock.SPAN] += length
    for node in range(N_NODES):
        find_value(rig, state, fraction * NODES[node], -1, 0)
        copy_values(state.probes[LAST_PROBES], state.probes[node])

    # First and third harmonics of all quantities.
    for node in range(N_NODES):
        weight = length * WEIGHTS[node]
        phase = rig.settings[Setting.OMEGA] * (clock[Clock.TIME] + length * NODES[node])
        for k in range(record.integrals.shape[0]):
            row = record.integrals[k]
            value = weight * state.probes[node, k]
            row[Integral.COS_1] += value * np.cos(phase)
            row[Integral.SIN_1] += value * np.sin(phase)
            row[Integral.COS_3] += value * np.cos(3 * phase)
            row[Integral.SIN_3] += value * np.sin(3 * phase)

    # Mean and reversals of the first interface in each cycle.
    if rig.faces.shape[0]:
        cycle_row = record.cycles[cycle]
        for node in range(N_NODES):
            slide = state.probes[node, Probe.FACES + Probe.SLIDE]
            cycle_row[Cycle.SLIDE] += length * WEIGHTS[node] * slide
        observe_reversal(rig, state, fraction, cycle_row, -1.0, Cycle.MIN_SLIDE)
        observe_reversal(rig, state, fraction, cycle_row, 1.0, Cycle.MAX_SLIDE)

    for k in range(record.extremes.shape[0]):
        row = record.extremes[k]
        row[Extreme.MIN] = raise_extreme(rig, state, fraction, k, -1.0, row[Extreme.MIN])[0]
        row[Extreme.MAX] = raise_extreme(rig, state, fraction, k, 1.0, row[Extreme.MAX])[0]
    for i in range(rig.faces.shape[0]):
        row = record.faces[i]
        add_stick(rig, state, fraction, i, row)
        if state.memory[i, Memory.CONTACT] < 0:
            row[Window.OPEN] += length


@njit(**NJIT_KERNEL)
def observe_releases(rig, state, record, face):
    """Add the static friction of rigid interfaces that the event of another one has released to the extremes of the window.

    Their forces reach this limit while they jump.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion after the event.
    record : Record
        What the run records.
    face : int
        Number of the interface of the event.
    """
    for i in range(rig.faces.shape[0]):
        memory = state.memory[i]
        if i == face or memory[Memory.RESTED] == 0 or memory[Memory.DIRECTION] == 0:
            continue
        load = look(rig, state, i, state.clock[Clock.TIME], state.y).load
        limit = memory[Memory.DIRECTION] * rig.faces[i, Face.NUMBERS] * load
        row = record.extremes[Probe.FACES + Probe.COUNT * i + Probe.FORCE]
        row[Extreme.MIN] = min(row[Extreme.MIN], limit)
        row[Extreme.MAX] = max(row[Extreme.MAX], limit)


@njit(**NJIT_KERNEL)
def observe_reversal(rig, state, fraction, cycle, sign, column):
    """Update the extreme slide of the first interface in a cycle, and the friction force there.

    A force that jumps at the reversal counts with the mean of both sides.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    fraction : float
        Fraction of the step at which its motion ends.
    cycle : (12,) array
        Row of `records.Record.cycles`.
    sign : float
        1 for the largest value, -1 for the smallest.
    column : int
        Column of the extreme slide in `records.Record.cycles`; its force is in the next column.
    """
    slide = Probe.FACES + Probe.SLIDE
    force = Probe.FACES + Probe.FORCE
    known = cycle[column]
    value, at = raise_extreme(rig, state, fraction, slide, sign, known)
    size = EVENT_SLIDE_TOL * abs(value)
    if abs(state.probes[0, slide] - known) <= size and abs(value - known) <= size:
        cycle[column + 1] = 0.5 * (cycle[column + 1] + state.probes[0, force])
    elif value != known:
        # Values locate an extreme only to the root of round-off, which shows in a force that is steep in the velocity.
        left = max(at - EXTREME_REACH, 0.0)
        right = min(at + EXTREME_REACH, fraction)
        speed = find_value(rig, state, left, -1, Probe.VELOCITY)
        if speed * find_value(rig, state, right, -1, Probe.VELOCITY) < 0:
            find_root(rig, state, -1, Probe.VELOCITY, left, right)
        else:
            find_value(rig, state, at, -1, slide)
        cycle[column] = value
        cycle[column + 1] = state.probes[LAST_PROBES, force]


@njit(**NJIT_KERNEL)
def add_stick(rig, state, fraction, i, row):
    """Add the time that an interface sticks in a part of a step, and the phases at which slip starts.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    fraction : float
        Fraction of the step at which its motion ends.
    i : int
        Number of the interface.
    row : (6,) array
        Row of `records.Record.faces`.
    """
    column = Probe.SLIPPING - i
    h = state.clock[Clock.LENGTH]

    # A reversal without stick is a stick of a duration of round-off, after which slip does not start.
    shortest = MIN_STICK * rig.settings[Setting.PERIOD]
    sticks = state.probes[0, column] < 0
    duration = max(row[Window.STICKS], 0.0)
    if duration > shortest and not sticks:
        add_start(rig, state.clock, state.clock[Clock.TIME], row)

    for node in range(1, N_NODES):
        left = fraction * NODES[node - 1]
        right = fraction * NODES[node]
        sticks_after = state.probes[node, column] < 0
        root = right if sticks else left
        if sticks_after != sticks:
            root = find_root(rig, state, -1, column, left, right)
        part = h * ((root - left) if sticks else (right - root) * sticks_after)
        row[Window.STUCK] += part
        duration = part + (duration if sticks else 0.0)
        if sticks and not sticks_after and duration > shortest:
            add_start(rig, state.clock, state.clock[Clock.TIME] + root * h, row)
        sticks = sticks_after
    row[Window.STICKS] = duration if sticks else -1.0


@njit(**NJIT_KERNEL)
def add_start(rig, clock, t, row):
    """Add the phase of the drive at which slip starts.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    clock : (16,) array
        Row of `records.State.clock`.
    t : float
        Time [s].
    row : (6,) array
        Row of `records.Record.faces`.
    """
    phase = 0.0
    if rig.tones.shape[0]:
        phase = rig.tones[0, 1] * t + rig.tones[0, 2]
    elif rig.pieces.shape[0]:
        piece = rig.pieces[int(clock[Clock.PIECE])]
        phase = find_phase(piece, t - piece[Piece.START])[0]
    row[Window.STARTS] += 1
    row[Window.COS_START] += np.cos(2 * phase)
    row[Window.SIN_START] += np.sin(2 * phase)


@njit(**NJIT_KERNEL)
def write_row(rig, state, t, y, row):
    """Write time, state y, forces [N], loads [N] and directions of the interfaces to a row of the samples or events.

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
    row : array
        Row of `records.Record.samples` or `events` that is written.
    """
    n_faces = rig.faces.shape[0]
    find_rates(rig, state, t, y, state.rows[RATES])
    row[0] = t
    copy_values(y, row[1 : 1 + y.size])
    for i in range(n_faces):
        point = look(rig, state, i, t, y)
        row[1 + y.size + i] = state.memory[i, Memory.FORCE]
        row[1 + y.size + n_faces + i] = max(point.load, 0.0)
    write_directions(rig, state, row)


@njit(**NJIT_KERNEL)
def write_directions(rig, state, row):
    """Write the directions in which the interfaces slip, after an evaluation of their laws, into a sample.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion.
    row : (m,) array
        Sample, which is changed.
    """
    n_faces = state.memory.shape[0]
    for i in range(n_faces):
        # A rigid law keeps its direction while it slips; other laws slip with the irreversible part of the velocity. New
        # springs change the mean stretch of those that stick, so that their law has its direction in its regime.
        direction = state.memory[i, Memory.DIRECTION]
        if rig.faces[i, Face.LAW] == PRESSED_SPRINGS and state.memory[i, Memory.CONTACT] > 0:
            direction = state.memory[i, Memory.FLAG]
        elif rig.faces[i, Face.RIGID] == 0:
            direction = np.sign(state.memory[i, Memory.SLIP_RATE])
        row[1 + state.y.size + 2 * n_faces + i] = direction


@njit(**NJIT_KERNEL)
def write_samples(rig, state, record, fraction):
    """Write the samples whose times lie in a part of a step.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    fraction : float
        Fraction of the step at which its motion ends.
    """
    clock = state.clock
    h = clock[Clock.LENGTH]
    end = clock[Clock.TIME] + fraction * h
    while clock[Clock.SAMPLE] < record.samples.shape[0]:
        row = record.samples[int(clock[Clock.SAMPLE])]
        if row[0] > end:
            return
        x = min(max((row[0] - clock[Clock.TIME]) / h, 0.0), fraction)
        read_curve(state, x, state.rows[POINT])
        write_row(rig, state, row[0], state.rows[POINT], row)
        clock[Clock.SAMPLE] += 1


@njit(**NJIT_KERNEL)
def write_event(rig, state, record, face, which):
    """Write the state at an event, before the regime changes, or after it with the mark `Margin.AFTER`.

    Parameters
    ----------
    rig : Rig
        Arrays of the rig.
    state : State
        Motion, which is updated.
    record : Record
        What the run records.
    face : int
        Number of the interface.
    which : int
        Margin that has vanished, or the mark (`records.Margin`).
    """
    number = int(state.clock[Clock.N_EVENTS])
    if number < record.events.shape[0]:
        row = record.events[number]
        write_row(rig, state, state.clock[Clock.TIME], state.y, row)
        row[-2] = face
        row[-1] = which
    state.clock[Clock.N_EVENTS] += 1
