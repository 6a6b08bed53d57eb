"""Many cases of one mode and one point with a smooth law, by Runge-Kutta steps of order 4 in a compiled loop.

A law follows its path exactly (`return_maps_kernels`), so that its force is a smooth function of slide and velocity up
to the next turn. A step that contains a turn ends there. After it the stiffness of the law is largest; steps are short
where the law is stiff, and grow up to those of the grid. A motion that repeats is not computed again.

Kernels get the rows of one case, see `case_rows`; `numbers[:, j]` and `memory[:, j]` are those of its law.
"""

from math import cos, inf, pi, sin, sqrt, tanh
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from ..friction.bonds.point_kernels import shape_functions
from ..friction.laws.lugre_kernels import LuGreNumber, relaxation_length
from .case_observers_kernels import (
    Instant,
    add_piece,
    end_cycle,
    observe_piece,
    repeat_cycle,
    start_cycle,
    start_window,
)
from .case_rows import SAME_SMOOTH_CYCLE, Now, Number, Seen
from .law_rows import Masing
from .return_maps_kernels import (
    Law,
    Step,
    advance,
    mean_force,
    prepare,
    read,
    slip_share,
)

MAX_END_STEPS = 8  # Newton steps for the instant of a turn, or of a corner of the law
# Velocity at a turn relative to its change in the step, or path to a corner relative to the whole path to it
END_TOLERANCE = 1e-6
CORNER_TOLERANCE = 1e-5  # smallest path to a corner relative to that of its branch
# Steps per cycle at which the shortest step is a radian of the vibration above a stiff law, or the time of its relaxation
REFERENCE_STEPS = 16.0
MIN_HALF_PATH = 0.1  # shortest path of the bristles in half of a step, or in the other, relative to that of the step
MAX_LEVEL_STEPS = (
    12  # steps of the Illinois method for the instant at which slip begins, ends or turns
)
LEVEL_TOLERANCE = 1e-4  # tolerance of this instant relative to the step
TURN_SPEED = (
    1e-9  # velocity just beside a turn relative to that in the step, which gives the direction
)
N_PARABOLAS = 4  # parabolas in a step that contains an extreme of force or acceleration


class Body(NamedTuple):
    """A case and its law.

    - case (12,): numbers of the case, in the order of `case_rows.Number`
    - numbers (k, m), memory (l, m): numbers and memory of the laws of m points
    - column: that of the case
    """

    case: np.ndarray
    numbers: np.ndarray
    memory: np.ndarray
    column: int


class Taken(NamedTuple):
    """End of a Runge-Kutta step, without the force of the law there.

    - sine, cosine: of the phase of the drive
    - slide, velocity: [m], [m/s]
    - acceleration: that of the last stage [m s-2]
    - work: friction work of the step [J]
    """

    sine: float
    cosine: float
    slide: float
    velocity: float
    acceleration: float
    work: float


class Bristles(NamedTuple):
    """Stretch [m] and friction force [N] of the law "lugre"."""

    stretch: float
    force: float


class Probe(NamedTuple):
    """State within a step, irreversible part of the motion [1], and acceleration of the output [m s-2]."""

    last: Instant
    share: float
    acceleration: float


@njit(**NJIT_KERNEL)
def make_instant(sine, cosine, q, v, force, slip, case):
    """Return the `Instant` of a case by its equation of motion.

    Parameters
    ----------
    sine, cosine : float
        Of the phase of the drive.
    q, v, force, slip : float
        Slide [m], velocity [m/s], friction force [N] and irreversible slide [m].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    """
    a = case[Number.DRIVE] * sine - case[Number.DAMPING] * v - case[Number.STIFFNESS] * q
    return Instant(sine, cosine, q, v, a - case[Number.MOBILITY] * force, force, slip)


@njit(**NJIT_CALL)
def follow_bristles(step, body):
    """Return the `Bristles` of the law "lugre" at the end of a `Step`.

    The stretch z relaxes to the steady one, d l(v) in the direction d of slip, as dz/dx = d l - z over a path x with dx =
    |v|/l dt. The path is integrated by Simpson's rule. With l quadratic in it the relaxation is exact.
    """
    numbers = body.numbers
    j = body.column
    law = numbers[:, j]
    dt = step.duration
    direction = 1.0 if step.increment > 0 else -1.0
    first = step.start_velocity
    last = step.end_velocity
    # By Simpson's rule the velocities at both ends and in the middle have the mean increment / duration.
    middle = 1.5 * step.increment / dt - 0.25 * (first + last)
    begin = relaxation_length(law, first)
    centre = relaxation_length(law, middle)
    end = relaxation_length(law, last)
    rates = abs(first) / begin, abs(middle) / centre, abs(last) / end
    path = dt / 6 * (rates[0] + 4 * rates[1] + rates[2])
    half = dt / 24 * (5 * rates[0] + 8 * rates[1] - rates[2])

    # l = begin + tilt s + bend s^2 at the part s of the path; the middle of the time is at the part m.
    change = end - begin
    bend = 0.0
    if MIN_HALF_PATH * path < half < (1 - MIN_HALF_PATH) * path:
        m = half / path
        bend = (change * m - (centre - begin)) / (m * (1 - m))
    shapes = shape_functions(path)
    steady = begin * (1 - shapes.decay) + (change - bend) * (1 - shapes.f1)
    steady += bend * (1 - 2 * shapes.f2)
    stretch = body.memory[0, j] * shapes.decay + direction * steady

    sign = 1.0 if last > 0 else -1.0
    damping = law[LuGreNumber.MICRO_DAMPING] * (1 - sign * stretch / end)
    force = law[LuGreNumber.STIFFNESS] * stretch + (damping + law[LuGreNumber.VISCOUS]) * last
    return Bristles(stretch, body.case[Number.LOAD] * force)


@njit(**NJIT_CALL)
def find_force(step, body):
    """Return the friction force [N] of a body at the end of a `Step`."""
    case = body.case
    numbers = body.numbers
    memory = body.memory
    j = body.column
    load = case[Number.LOAD]
    if numbers[0, j] == Law.TANH:
        return numbers[1, j] * load * tanh(step.end_velocity / numbers[2, j])
    if numbers[0, j] == Law.LUGRE:
        return follow_bristles(step, body).force
    return mean_force(numbers, memory, j, load, step).end


@njit(**NJIT_KERNEL)
def find_half_turn(dt, case):
    """Return cosine and sine of half the phase of the drive that passes in a step of `dt` [s]."""
    half = 0.5 * case[Number.OMEGA] * dt
    return cos(half), sin(half)


@njit(**NJIT_CALL)
def take_step(first, dt, half_turn, body):
    """Return the step of order 4 `Taken` from an `Instant`, by the method of Runge, Kutta and Nystroem.

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    half_turn : (float, float)
        Cosine and sine of half the phase of the drive that passes.
    body : Body
    """
    case = body.case
    numbers = body.numbers
    j = body.column
    c, s = half_turn
    sine = first.sine * c + first.cosine * s
    cosine = first.cosine * c - first.sine * s
    last_sine = sine * c + cosine * s
    last_cosine = cosine * c - sine * s

    # Two estimates of the middle; the force differs if it follows the velocity.
    v = first.velocity
    a = first.acceleration
    half = 0.5 * dt
    rise = half * v + 0.5 * half * half * a
    v_1 = v + half * a
    force_1 = find_force(Step(rise, half, v, v_1, 0.0), body)
    a_1 = make_instant(sine, cosine, first.slide + rise, v_1, force_1, 0.0, case).acceleration
    v_2 = v + half * a_1
    force_2 = force_1
    if numbers[0, j] == Law.TANH or numbers[0, j] == Law.LUGRE:
        force_2 = find_force(Step(rise, half, v, v_2, 0.0), body)
    a_2 = make_instant(sine, cosine, first.slide + rise, v_2, force_2, 0.0, case).acceleration

    # An estimate of the end, and the end
    rise = dt * v + half * dt * a_2
    v_3 = v + dt * a_2
    force_3 = find_force(Step(rise, dt, v, v_3, 0.0), body)
    q_3 = first.slide + rise
    a_3 = make_instant(last_sine, last_cosine, q_3, v_3, force_3, 0.0, case).acceleration
    slide = first.slide + dt * v + dt * dt / 6 * (a + a_1 + a_2)
    velocity = v + dt / 6 * (a + 2 * a_1 + 2 * a_2 + a_3)
    power = first.force * v + 2 * force_1 * v_1 + 2 * force_2 * v_2 + force_3 * v_3
    return Taken(last_sine, last_cosine, slide, velocity, a_3, dt / 6 * power)


@njit(**NJIT_KERNEL)
def find_corner(first, body):
    """Return the path [m] from an instant to the slide at which all sliders of a body slip; inf without sliders."""
    numbers = body.numbers
    memory = body.memory
    j = body.column
    if numbers[0, j] != Law.MASING:
        return inf
    n = int(memory[Masing.COUNT, j])
    rate = first.velocity if first.velocity != 0 else first.acceleration
    direction = 1.0 if rate > 0 else -1.0
    turns = direction * memory[Masing.DIRECTION, j] < 0
    if n == 0 and memory[Masing.VIRGIN, j] < 0 and not turns:
        return inf
    # A branch after a turn is twice as long as the first loading.
    length = numbers[2, j] if n == 0 and not turns else 2 * numbers[2, j]
    start = memory[Masing.STACK + 2 * n - 2, j] if n > 0 else 0.0
    if turns:
        start = memory[Masing.SLIDE, j]
    path = length - direction * (memory[Masing.SLIDE, j] - start)
    return path if path > CORNER_TOLERANCE * length else inf


@njit(**NJIT_CALL)
def locate_end(first, taken, dt, corner, turns, body):
    """Return duration [s] and `Taken` of a step that is cut at its turn or at a corner of the law, by Newton's method.

    Parameters
    ----------
    first : Instant
        Start of the step.
    taken : Taken
        The whole step.
    dt : float
        Its duration [s].
    corner : float
        Path to the corner [m].
    turns : bool
        Whether the step ends at a turn.
    body : Body
    """
    case = body.case
    change = abs(first.velocity - taken.velocity)
    time = dt * corner / abs(taken.slide - first.slide)
    if turns:
        time = dt * abs(first.velocity) / change
    for _ in range(MAX_END_STEPS):
        taken = take_step(first, time, find_half_turn(time, case), body)
        if turns:
            miss = taken.velocity
            rate = taken.acceleration
            is_near = abs(miss) <= END_TOLERANCE * change
        else:
            miss = abs(taken.slide - first.slide) - (1 - END_TOLERANCE) * corner
            rate = abs(taken.velocity)
            is_near = abs(miss) <= 0.5 * END_TOLERANCE * corner
        if is_near or rate == 0:
            break
        time = min(max(time - miss / rate, 0.1 * time), dt)
    return time, taken


@njit(**NJIT_KERNEL)
def find_longest_step(first, stiffness, grade, body):
    """Return the longest step [s] that resolves the law at an instant.

    Parameters
    ----------
    first : Instant
        Start of the step.
    stiffness : float
        Change of the force per slide in the step before [N/m].
    grade : float
        Length of the steps relative to that with REFERENCE_STEPS.
    body : Body
    """
    case = body.case
    numbers = body.numbers
    j = body.column
    law = numbers[0, j]
    mobility = case[Number.MOBILITY]
    if law != Law.TANH:
        dt = grade / sqrt(mobility * stiffness + case[Number.STIFFNESS] + case[Number.OMEGA] ** 2)
        if law != Law.LUGRE:
            return dt
        speed = numbers[4, j]
    else:
        # The velocity relaxes at this rate to the one that the drive keeps up.
        speed = numbers[2, j]
        limit = numbers[1, j] * case[Number.LOAD]
        rate = mobility * limit / speed * (1 - (first.force / limit) ** 2)
        dt = 2 * grade / (rate + case[Number.OMEGA])
    change = abs(first.acceleration)
    return min(dt, grade * (abs(first.velocity) + speed) / change) if change > 0 else dt


@njit(**NJIT_KERNEL)
def find_first_stiffness(body):
    """Return the stiffness [N/m] of the law of a body after a turn."""
    numbers = body.numbers
    j = body.column
    load = body.case[Number.LOAD]
    law = numbers[0, j]
    if law == Law.TANH:
        return 0.0
    if law == Law.LUGRE:
        return load * numbers[3, j]
    if law == Law.MASING:
        # Slope of Segalman's first loading at 0
        order = numbers[3, j]
        return (
            numbers[1, j]
            / numbers[2, j]
            * (numbers[4, j] + 1)
            / (numbers[4, j] + order / (order + 1))
        )
    return numbers[1, j] * load / numbers[2, j]


@njit(**NJIT_KERNEL)
def find_parabola_extreme(first, middle, last):
    """Return the largest magnitude of the parabola through values at the start, in the middle and at the end of a step.

    Parameters
    ----------
    first : float
        Value at the start.
    middle : float
        Value in the middle.
    last : float
        Value at the end.
    """
    largest = max(abs(first), abs(last))
    bend = first - 2 * middle + last
    tilt = last - first
    if abs(tilt) < 2 * abs(bend):
        largest = max(largest, abs(middle - tilt * tilt / (8 * bend)))
    return largest


@njit(**NJIT_CALL)
def commit(first, taken, dt, end, body):
    """Advance the memory of the law over a step, and return the `Instant` at its end.

    Parameters
    ----------
    first : Instant
        Start of the step.
    taken : Taken
        The step.
    dt : float
        Duration [s].
    end : float
        Velocity at its end [m/s].
    body : Body
        Its memory is that (changed in place).
    """
    case = body.case
    numbers = body.numbers
    memory = body.memory
    j = body.column
    dq = taken.slide - first.slide
    load = case[Number.LOAD]
    step = Step(dq, dt, first.velocity, end, 0.0)
    if numbers[0, j] == Law.LUGRE:
        bristles = follow_bristles(step, body)
        memory[0, j] = bristles.stretch
        memory[1, j] = bristles.force
    else:
        advance(numbers, memory, j, load, step)
    state = read(numbers, memory, j, load)
    slip = taken.slide - state.stretch
    return make_instant(taken.sine, taken.cosine, taken.slide, end, state.force, slip, case)


@njit(**NJIT_CALL)
def probe(first, dt, body):
    """Return the `Probe` after a time `dt` [s] within a step, whose memory is kept.

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Time since the start [s].
    body : Body
    """
    case = body.case
    numbers = body.numbers
    memory = body.memory
    j = body.column
    # Only rows before the stack of parallel sliders change, and the entries that a branch writes in any case.
    has_stack = memory.shape[0] > Masing.STRETCH
    kept = memory[0, j], memory[1, j], memory[2, j], memory[3, j], memory[4, j], memory[5, j]
    stretch = memory[Masing.STRETCH, j] if has_stack else 0.0
    taken = take_step(first, dt, find_half_turn(dt, case), body)
    last = commit(first, taken, dt, taken.velocity, body)
    # At a turn the direction is that of the step.
    direction = first.velocity + last.velocity
    velocity = last.velocity if direction * last.velocity > 0 else TURN_SPEED * direction
    share = slip_share(numbers, memory, j, case[Number.LOAD], velocity)
    for row in range(6):
        memory[row, j] = kept[row]
    if has_stack:
        memory[Masing.STRETCH, j] = stretch
    output = case[Number.OUTPUT] * last.acceleration + case[Number.BASE] * last.sine
    return Probe(last, share, output)


@njit(**NJIT_KERNEL)
def find_level(level, begin, end, first, dt, body):
    """Return the time [s] in a step at which the irreversible part of the motion reaches a level, by the Illinois method.

    Parameters
    ----------
    level : float
        Level between `begin` and `end`.
    begin, end : float
        Irreversible part of the motion at both ends of the step.
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    body : Body
    """
    low = 0.0
    high = dt
    below = begin - level
    above = end - level
    for _ in range(MAX_LEVEL_STEPS):
        time = high - above * (high - low) / (above - below)
        miss = probe(first, time, body).share - level
        if miss * above < 0:
            low = high
            below = above
        else:
            below *= 0.5
        high = time
        above = miss
        if abs(high - low) <= LEVEL_TOLERANCE * dt or miss == 0:
            break
    return high


@njit(**NJIT_KERNEL)
def add_stick(level, begin, end, phases, crossing, seen):
    """Add the phase that passes between the levels -0.5 and 0.5 of the irreversible part to `Seen.STUCK`.

    A point sticks while less than half of its motion is irreversible. After a turn the irreversible part may be
    negative. Where it rises above 0.5 slip starts.

    Parameters
    ----------
    level : float
        One of the levels.
    begin, end : float
        Irreversible part of the motion at both ends of a step.
    phases : (float, float)
        Phase of the drive at the start of the step, and that which passes in it [rad].
    crossing : float
        Fraction of the step at which the level is crossed.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    phase, turn = phases
    time = 1.0 if begin > level else 0.0
    if (begin > level) != (end > level):
        time = crossing if begin > level else 1 - crossing
        if level > 0 and end > level:
            start = 2 * (phase + crossing * turn)
            seen[Seen.STARTS] += 1
            seen[Seen.SLIP_START_PHASE_COS] += cos(start)
            seen[Seen.SLIP_START_PHASE_SIN] += sin(start)
    seen[Seen.STUCK] += time * turn * (1.0 if level < 0 else -1.0)


@njit(**NJIT_KERNEL)
def has_extreme(first, middle, last):
    """Return whether the parabola through three equally spaced values has an extreme between them.

    Parameters
    ----------
    first, middle, last : float
        The values.
    """
    return abs(last - first) < 2 * abs(first - 2 * middle + last)


@njit(**NJIT_KERNEL)
def observe_step(phase, first, taken, dt, body, seen):
    """Add a step of the window to `seen`.

    Parameters
    ----------
    phase : float
        Phase of the drive at the start of the step [rad].
    first : Instant
        Start of the step.
    taken : Taken
        The step.
    dt : float
        Duration [s].
    body : Body
        Its memory is that at the start of the step.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    case = body.case
    numbers = body.numbers
    j = body.column
    end = probe(first, dt, body)
    observe_piece(first, end.last, dt, taken.work, case, seen)

    # Stick ends and slip turns where the irreversible part of the motion passes a level.
    begin = seen[Seen.SHARE]
    turn = case[Number.OMEGA] * dt
    for level in (-0.5, 0.0, 0.5):
        time = 0.0
        if (begin > level) != (end.share > level):
            time = find_level(level, begin, end.share, first, dt, body)
        if level != 0:
            add_stick(level, begin, end.share, (phase, turn), time / dt, seen)
        elif time > 0:
            slip = probe(first, time, body).last.slip
            seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], slip)
            seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], slip)
    seen[Seen.SHARE] = end.share

    # Extremes of force and acceleration between the ends are those of parabolas through shorter steps.
    start = case[Number.OUTPUT] * first.acceleration + case[Number.BASE] * first.sine
    peak = max(abs(start), abs(end.acceleration))
    force = 0.0
    middle = probe(first, 0.5 * dt, body)
    if has_extreme(start, middle.acceleration, end.acceleration) or has_extreme(
        first.force, middle.last.force, end.last.force
    ):
        before = Probe(first, begin, start)
        for k in range(N_PARABOLAS):
            middle = probe(first, (k + 0.5) / N_PARABOLAS * dt, body)
            after = probe(first, (k + 1) / N_PARABOLAS * dt, body)
            value = find_parabola_extreme(
                before.acceleration, middle.acceleration, after.acceleration
            )
            peak = max(peak, value)
            if numbers[0, j] == Law.TANH or numbers[0, j] == Law.LUGRE:
                value = find_parabola_extreme(
                    before.last.force, middle.last.force, after.last.force
                )
                force = max(force, value)
            before = after
    seen[Seen.MAX_ACCELERATION] = max(seen[Seen.MAX_ACCELERATION], peak)
    seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], force)


@njit(**NJIT_KERNEL)
def march_cycle(steps, observes, body, now, seen, loop):
    """March a case over a cycle.

    Parameters
    ----------
    steps : int
        Longest steps per cycle.
    observes : bool
        Whether the cycle is measured.
    body : Body
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    case = body.case
    numbers = body.numbers
    memory = body.memory
    j = body.column
    omega = case[Number.OMEGA]
    load = case[Number.LOAD]
    node = 2 * pi / omega / steps
    grade = REFERENCE_STEPS / steps
    stiffness = find_first_stiffness(body)
    first_stiffness = stiffness
    start_cycle(now, seen, loop)
    node_turn = find_half_turn(node, case)
    first = make_instant(
        0.0, 1.0, now[Now.SLIDE], now[Now.VELOCITY], now[Now.FORCE], now[Now.SLIP], case
    )
    for k in range(steps):
        left = node
        while left > 0:
            dt = find_longest_step(first, stiffness, grade, body)
            dt = left if dt > 0.8 * left else min(dt, 0.5 * left)
            half_turn = node_turn if dt == node else find_half_turn(dt, case)
            taken = take_step(first, dt, half_turn, body)

            # The step ends at a turn, after which the law is stiff again, or at the corner of the law before it.
            turns = first.velocity * taken.velocity < 0
            corner = find_corner(first, body)
            passes = abs(taken.slide - first.slide) > corner
            turns = turns and not passes
            if turns or passes:
                dt, taken = locate_end(first, taken, dt, corner, turns, body)
            phase = omega * ((k + 1) * node - left)
            if observes:
                observe_step(phase, first, taken, dt, body, seen)
            end = 0.0 if turns else taken.velocity
            last = commit(first, taken, dt, end, body)
            add_piece(first, last, dt, taken.work, last.force, case, now, loop)
            if observes and (turns or passes):
                # The irreversible part of the motion jumps.
                after = 1.0
                if turns:
                    after = slip_share(numbers, memory, j, load, -TURN_SPEED * first.velocity)
                share = seen[Seen.SHARE]
                add_stick(0.5, share, after, (phase + omega * dt, 0.0), 0.0, seen)
                seen[Seen.SHARE] = after

            dq = last.slide - first.slide
            stiffness = abs((last.force - first.force) / dq) if dq != 0 else first_stiffness
            if turns:
                stiffness = first_stiffness
            first = last
            left -= dt
    now[Now.SLIDE] = first.slide
    now[Now.VELOCITY] = first.velocity
    now[Now.FORCE] = first.force
    now[Now.SLIP] = first.slip


@njit(cache=True, **NJIT_KERNEL)
def march_cases(steps, parameters, numbers, memory, nows, seens, histories, loops):
    """March cases over their cycles.

    Parameters
    ----------
    steps : int
        Longest steps per cycle.
    parameters : (c, 12) array
        Numbers of the cases, in the order of `case_rows.Number`.
    numbers : (k, c) array
        Numbers of the laws. Row 0 is the `Law`.
    memory : (l, c) array
        Memory of the laws (changed in place).
    nows : (c, 15) array
        States of the cases, in the order of `case_rows.Now` (output).
    seens : (c, 20) array
        What was observed, in the order of `case_rows.Seen` (output).
    histories : (c, n, 4) array
        Extremes and phasor of every cycle (output).
    loops : (c, 1 + w, 5) array
        Cycles of the window, in the order of `case_rows.Loop`, after a row for those before it. Cycles that are not
        measured keep their values (output).
    """
    same = SAME_SMOOTH_CYCLE / steps**3
    for j in range(parameters.shape[0]):
        case = parameters[j]
        now = nows[j]
        seen = seens[j]
        n_cycles = int(case[Number.CYCLES])
        first = n_cycles - int(case[Number.WINDOW])

        now[Now.SLIDE] = case[Number.SLIDE]
        now[Now.VELOCITY] = case[Number.VELOCITY]
        prepare(numbers, memory, j, Step(0.0, 0.0, 0.0, 0.0, 0.0))
        state = read(numbers, memory, j, case[Number.LOAD])
        now[Now.FORCE] = state.force
        now[Now.SLIP] = now[Now.SLIDE] - state.stretch
        now[Now.STORED] = 0.5 * (
            now[Now.VELOCITY] ** 2 + case[Number.STIFFNESS] * now[Now.SLIDE] ** 2
        )

        cycle = 0
        while cycle < n_cycles:
            observes = cycle >= first
            if cycle == first:
                start_window(now, seen)
                seen[Seen.SHARE] = slip_share(
                    numbers, memory, j, case[Number.LOAD], now[Now.VELOCITY]
                )
            begin = now[Now.SLIDE], now[Now.VELOCITY], now[Now.FORCE]
            sums = now[Now.WORK_IN], now[Now.POWER], now[Now.VISCOUS], now[Now.FRICTION]
            loop = loops[j, max(loops.shape[1] - n_cycles + cycle, 0)]
            march_cycle(steps, observes, Body(case, numbers, memory, j), now, seen, loop)
            end_cycle(case, now, seen, loop, histories[j, cycle])
            cycle += 1
            if not observes:
                repeated = repeat_cycle(cycle, same, begin, sums, case, now, histories[j])
                cycle += repeated
                first = cycle if repeated > 0 else first

        now[Now.ELASTIC] = read(numbers, memory, j, case[Number.LOAD]).energy
