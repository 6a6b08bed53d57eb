"""Runge-Kutta steps of order 4 of a case with a smooth law (compiled).

A law follows its path exactly (`return_maps_kernels`), so that its force is a smooth function of slide and velocity up
to the next turn. A step that contains a turn ends there. After it the stiffness of the law is largest; steps are short
where the law is stiff. They are not fitted to a grid, so that the motion changes smoothly with their number.

`case` and `now` are rows of one case, see `case_rows`; `numbers[:, j]` and `memory[:, j]` are those of its law.
"""

from math import cos, exp, inf, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from ..friction.bonds.point_kernels import shape_functions
from ..friction.laws.lugre_kernels import LuGreNumber, relaxation_length
from .case_observers_kernels import (
    N_PARABOLAS,
    STEP_ROUND_OFF,
    STICK_SHARE,
    Instant,
    Piece,
    find_vertex,
    observe_piece,
    observe_stick,
    store_instant,
)
from .case_rows import Now, Number, Seen
from .law_rows import Masing
from .return_maps_kernels import Law, Step, mean_force, prepare, read
from .return_maps_kernels import advance as advance_law

MAX_END_STEPS = 8  # Newton steps for the instant of a turn, or of a corner of the law
# Velocity at a turn relative to its change in the step, or path to a corner relative to the whole path to it
END_TOLERANCE = 1e-6
CORNER_TOLERANCE = 1e-5  # smallest path to a corner relative to that of its branch
MAX_LEVEL_STEPS = (
    12  # steps of the Illinois method for the instant at which slip begins, ends or turns
)
LEVEL_TOLERANCE = 1e-4  # tolerance of this instant relative to the step
# Steps per cycle at which the shortest step is a radian of the vibration above a stiff law, or the time of its relaxation
REFERENCE_STEPS = 16.0
FLAT_SPEED = (
    6.0  # velocity relative to the speed of a law above which its force changes by less than 2e-5
)
APPROACH = 0.7  # part of the way there that a step may take, so that it does not pass it if the acceleration grows
MIN_HALF_PATH = 0.1  # shortest path of the bristles in half of a step, or in the other, relative to that of the step


class Body(NamedTuple):
    """A case and its law.

    - case (12,): numbers of the case, in the order of `case_rows.Number`
    - numbers (k, m), memory (l, m): numbers and memory of the laws of m points
    - column: that of the case
    - grade: length of the steps relative to that with REFERENCE_STEPS per cycle
    - step: longest step [s]
    - half_turn: cosine and sine of half the phase of the drive that passes in it
    """

    case: np.ndarray
    numbers: np.ndarray
    memory: np.ndarray
    column: int
    grade: float
    step: float
    half_turn: tuple[float, float]


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
    """Within a step: slide [m], force [N], acceleration of the output [m s-2], irreversible part of the motion [1]."""

    slide: float
    force: float
    output: float
    share: float


class Branch(NamedTuple):
    """Curve of the force between two turns.

    - start: slide at the start of the step [m]
    - direction: of the motion, 1 or -1
    - length, path: slide from the start of the branch, and from that of the step, to the corner at which all sliders
      slip [m]; the path is inf without such a corner
    """

    start: float
    direction: float
    length: float
    path: float


@njit(**NJIT_KERNEL)
def make_body(case, law, j, steps):
    """Return the `Body` of a case.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    law : ((k, c) array, (l, c) array)
        Numbers and memory of the laws.
    j : int
        Number of the case.
    steps : float
        Fewest steps per cycle.
    """
    half = pi / steps
    step = 2 * half / case[Number.OMEGA]
    grade = REFERENCE_STEPS / steps
    return Body(case, law[0], law[1], j, grade, step, (cos(half), sin(half)))


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
    law = body.numbers[:, body.column]
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
    stretch = body.memory[0, body.column] * shapes.decay + direction * steady

    sign = 1.0 if last > 0 else -1.0
    damping = law[LuGreNumber.MICRO_DAMPING] * (1 - sign * stretch / end)
    force = law[LuGreNumber.STIFFNESS] * stretch + (damping + law[LuGreNumber.VISCOUS]) * last
    return Bristles(stretch, body.case[Number.LOAD] * force)


@njit(**NJIT_CALL)
def find_force(step, body):
    """Return the friction force [N] of a body at the end of a `Step`."""
    numbers = body.numbers
    j = body.column
    load = body.case[Number.LOAD]
    if numbers[0, j] == Law.TANH:
        # tanh x = 1 - 2/(exp(2 x) + 1), in two thirds of the time and to the same fraction of the limit
        growth = exp(2 * step.end_velocity / numbers[2, j])
        return numbers[1, j] * load * (1 - 2 / (growth + 1))
    if numbers[0, j] == Law.LUGRE:
        return follow_bristles(step, body).force
    return mean_force(numbers, body.memory, j, load, step).end


@njit(**NJIT_CALL)
def take_step(first, dt, body):
    """Return the step of order 4 `Taken` from an `Instant`, by the method of Runge, Kutta and Nystroem.

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    body : Body
    """
    case = body.case
    law = body.numbers[0, body.column]
    half = 0.5 * dt
    c, s = body.half_turn
    if dt != body.step:
        c = cos(case[Number.OMEGA] * half)
        s = sin(case[Number.OMEGA] * half)
    sine = first.sine * c + first.cosine * s
    cosine = first.cosine * c - first.sine * s
    last_sine = sine * c + cosine * s
    last_cosine = cosine * c - sine * s

    # Two estimates of the middle; the force differs if it follows the velocity.
    v = first.velocity
    a = first.acceleration
    rise = half * v + 0.5 * half * half * a
    v_1 = v + half * a
    force_1 = find_force(Step(rise, half, v, v_1, 0.0), body)
    a_1 = make_instant(sine, cosine, first.slide + rise, v_1, force_1, 0.0, case).acceleration
    v_2 = v + half * a_1
    force_2 = force_1
    if law == Law.TANH or law == Law.LUGRE:
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
def find_branch(first, body):
    """Return the `Branch` of the law of a body on which the motion goes on from an `Instant`."""
    numbers = body.numbers
    memory = body.memory
    j = body.column
    rate = first.velocity if first.velocity != 0 else first.acceleration
    direction = 1.0 if rate > 0 else -1.0
    if numbers[0, j] != Law.MASING:
        return Branch(first.slide, direction, 1.0, inf)
    n = int(memory[Masing.COUNT, j])
    turns = direction * memory[Masing.DIRECTION, j] < 0
    if n == 0 and memory[Masing.VIRGIN, j] < 0 and not turns:
        return Branch(first.slide, direction, 1.0, inf)

    # A branch after a turn is twice as long as the first loading.
    length = numbers[2, j] if n == 0 and not turns else 2 * numbers[2, j]
    start = memory[Masing.STACK + 2 * n - 2, j] if n > 0 else 0.0
    if turns:
        start = memory[Masing.SLIDE, j]
    path = length - direction * (memory[Masing.SLIDE, j] - start)
    return Branch(first.slide, direction, length, path if path > CORNER_TOLERANCE * length else inf)


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
    change = abs(first.velocity - taken.velocity)
    time = dt * corner / abs(taken.slide - first.slide)
    if turns:
        time = dt * abs(first.velocity) / change
    for _ in range(MAX_END_STEPS):
        taken = take_step(first, time, body)
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
def find_longest_step(first, tangent, body):
    """Return the longest step [s] that resolves the law at an instant.

    Parameters
    ----------
    first : Instant
        Start of the step.
    tangent : float
        Change of the force per slide in the step before [N/m].
    body : Body
    """
    case = body.case
    numbers = body.numbers
    j = body.column
    grade = body.grade
    law = numbers[0, j]
    mobility = case[Number.MOBILITY]
    if law != Law.TANH:
        dt = grade / sqrt(mobility * tangent + case[Number.STIFFNESS] + case[Number.OMEGA] ** 2)
        if law != Law.LUGRE:
            return dt
        speed = numbers[LuGreNumber.SPEED, j]
    else:
        # The velocity relaxes at this rate to the one that the drive keeps up.
        speed = numbers[2, j]
        limit = numbers[1, j] * case[Number.LOAD]
        rate = mobility * limit / speed * (1 - (first.force / limit) ** 2)
        dt = 2 * grade / (rate + case[Number.OMEGA])
    # A law of the velocity is flat far above its speed, down to which the velocity may fall in a few steps.
    change = abs(first.acceleration)
    if change == 0:
        return dt
    velocity = abs(first.velocity)
    room = velocity - FLAT_SPEED * speed
    resolved = grade * (velocity + speed)
    if room > 0:
        approach = APPROACH * room
        resolved = max(resolved, approach) if first.velocity * first.acceleration < 0 else inf
    return min(dt, resolved / change)


@njit(**NJIT_KERNEL)
def find_first_tangent(body):
    """Return the stiffness [N/m] of the law of a body after a turn."""
    numbers = body.numbers
    j = body.column
    load = body.case[Number.LOAD]
    law = numbers[0, j]
    if law == Law.TANH:
        return 0.0
    if law == Law.LUGRE:
        return load * numbers[LuGreNumber.STIFFNESS, j]
    if law == Law.MASING:
        # Slope of Segalman's first loading at 0
        order = numbers[3, j]
        weight = (numbers[4, j] + 1) / (numbers[4, j] + order / (order + 1))
        return numbers[1, j] / numbers[2, j] * weight
    return numbers[1, j] * load / numbers[2, j]


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
    numbers = body.numbers
    memory = body.memory
    j = body.column
    load = body.case[Number.LOAD]
    step = Step(taken.slide - first.slide, dt, first.velocity, end, 0.0)
    if numbers[0, j] == Law.LUGRE:
        bristles = follow_bristles(step, body)
        memory[0, j] = bristles.stretch
        memory[1, j] = bristles.force
    elif numbers[0, j] == Law.TANH:
        memory[0, j] = find_force(step, body)
    else:
        advance_law(numbers, memory, j, load, step)
    state = read(numbers, memory, j, load)
    slip = taken.slide - state.stretch
    return make_instant(taken.sine, taken.cosine, taken.slide, end, state.force, slip, body.case)


@njit(**NJIT_KERNEL)
def start(body, now):
    """Set the state of a case at the start in `now`, whose slide and velocity are known."""
    load = body.case[Number.LOAD]
    prepare(body.numbers, body.memory, body.column, Step(0.0, 0.0, 0.0, 0.0, 0.0))
    state = read(body.numbers, body.memory, body.column, load)
    now[Now.FORCE] = state.force
    now[Now.SLIP] = now[Now.SLIDE] - state.stretch
    now[Now.TANGENT] = find_first_tangent(body)


@njit(**NJIT_KERNEL)
def find_share(slide, velocity, force, branch, body):
    """Return the irreversible part of the motion in a step, d(slide - stretch)/d(slide).

    Parameters
    ----------
    slide, velocity, force : float
        Slide [m], velocity [m/s] and friction force [N].
    branch : Branch
    body : Body
    """
    numbers = body.numbers
    j = body.column
    law = numbers[0, j]
    load = body.case[Number.LOAD]
    if law == Law.TANH:
        return 1.0

    # The sliders that slip carry B - x B' of the limit, with the force B of first loading at the displacement x.
    if law == Law.MASING:
        ratio = 1 - (branch.path - abs(slide - branch.start)) / branch.length
        if branch.path == inf or ratio >= 1:
            return 1.0
        order = numbers[3, j]
        return max(ratio, 0.0) ** (order + 1) * order / (numbers[4, j] * (order + 1) + order)

    # Stretch of the bristles relative to that in steady slip
    if law == Law.LUGRE:
        length = relaxation_length(numbers[:, j], velocity)
        damping = numbers[LuGreNumber.MICRO_DAMPING, j]
        elastic = force / load - (damping + numbers[LuGreNumber.VISCOUS, j]) * velocity
        stiffness = numbers[LuGreNumber.STIFFNESS, j] * length - damping * abs(velocity)
        return branch.direction * elastic / stiffness

    # Bonds: force relative to the limit; Bouc-Wen: its power
    ratio = branch.direction * force / (numbers[1, j] * load)
    if law == Law.BONDS:
        return ratio
    share = abs(ratio) ** numbers[3, j]
    return share if ratio > 0 else (1 - 2 * numbers[4, j]) * share


@njit(**NJIT_CALL)
def probe(first, dt, branch, body):
    """Return the `Probe` at an instant within a step.

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Time since the start [s].
    branch : Branch
    body : Body
        Its memory is that at the start of the step.
    """
    case = body.case
    taken = take_step(first, dt, body)
    q = taken.slide
    v = taken.velocity
    force = find_force(Step(q - first.slide, dt, first.velocity, v, 0.0), body)
    at = make_instant(taken.sine, taken.cosine, q, v, force, q, case)
    output = case[Number.OUTPUT] * at.acceleration + case[Number.BASE] * at.sine
    return Probe(q, force, output, find_share(q, v, force, branch, body))


@njit(**NJIT_KERNEL)
def find_level(level, shares, first, dt, branch, body):
    """Return the fraction of a step at which the irreversible part of the motion passes a level, by the Illinois method.

    Parameters
    ----------
    level : float
        The level.
    shares : (float, float)
        Irreversible part of the motion at both ends of the step.
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    branch : Branch
    body : Body
        Its memory is that at the start of the step.

    Returns
    -------
    float
        -1 if both ends are on the same side of the level.
    """
    below = shares[0] - level
    above = shares[1] - level
    if (below > 0) == (above > 0):
        return -1.0
    low = 0.0
    high = 1.0
    for _ in range(MAX_LEVEL_STEPS):
        part = high - above * (high - low) / (above - below)
        miss = probe(first, part * dt, branch, body).share - level
        if miss * above < 0:
            low = high
            below = above
        else:
            below *= 0.5
        high = part
        above = miss
        if abs(high - low) <= LEVEL_TOLERANCE or miss == 0:
            break
    return high


@njit(**NJIT_KERNEL)
def find_peak(first, dt, offset, of_force, branch, body):
    """Return the largest magnitude near an extreme in a step of the force [N], or of the acceleration of the output [m s-2].

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    offset : float
        Distance of the extreme from the middle of the step, relative to half of it.
    of_force : bool
        Whether the force is meant.
    branch : Branch
    body : Body
        Its memory is that at the start of the step.
    """
    half = 0.5 * dt
    centre = half * (1 + offset)
    peak = 0.0
    for _ in range(N_PARABOLAS):
        half *= 0.25
        centre = min(max(centre, (1 + STEP_ROUND_OFF) * half), dt - half)
        before = probe(first, centre - half, branch, body)
        middle = probe(first, centre, branch, body)
        after = probe(first, centre + half, branch, body)
        if of_force:
            vertex = find_vertex(before.force, middle.force, after.force)
        else:
            vertex = find_vertex(before.output, middle.output, after.output)
        peak = vertex.largest
        centre += half * vertex.offset
    return peak


@njit(**NJIT_KERNEL)
def observe_step(first, dt, branch, body, seen):
    """Add a step of the window to `seen`.

    Parameters
    ----------
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    branch : Branch
    body : Body
        Its memory is that at the start of the step.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    case = body.case
    law = body.numbers[0, body.column]

    # Stick ends and slip turns where the irreversible part of the motion passes a level.
    begin = find_share(first.slide, first.velocity, first.force, branch, body)
    end = probe(first, dt, branch, body)
    shares = begin, end.share
    low = find_level(-STICK_SHARE, shares, first, dt, branch, body)
    high = find_level(STICK_SHARE, shares, first, dt, branch, body)
    observe_stick(first, shares, (low, high), case[Number.OMEGA] * dt, seen)
    if begin < 0:
        # The irreversible slide turns where there is no force, and so no stretch.
        turn = find_level(0.0, shares, first, dt, branch, body)
        if turn >= 0:
            slip = probe(first, turn * dt, branch, body).slide
            seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], slip)
            seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], slip)

    # The parabola through the middle shows an extreme between the ends.
    output = case[Number.OUTPUT] * first.acceleration + case[Number.BASE] * first.sine
    middle = probe(first, 0.5 * dt, branch, body)
    vertex = find_vertex(output, middle.output, end.output)
    peak = max(abs(output), abs(end.output))
    if vertex.is_between:
        peak = max(peak, find_peak(first, dt, vertex.offset, False, branch, body))
    seen[Seen.MAX_ACCELERATION] = max(seen[Seen.MAX_ACCELERATION], peak)
    # Forces of other laws have their extremes at turns.
    vertex = find_vertex(first.force, middle.force, end.force)
    if vertex.is_between and (law == Law.TANH or law == Law.LUGRE):
        peak = find_peak(first, dt, vertex.offset, True, branch, body)
        seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], peak)


@njit(**NJIT_KERNEL)
def advance(body, left, observes, now, seen):
    """Advance a case by a step, or up to the turn or the corner of the law in it, and return the `Piece`.

    Parameters
    ----------
    body : Body
        Its memory is that (changed in place).
    left : float
        Time to the end of the cycle [s].
    observes : bool
        Whether the step belongs to the window.
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    first = make_instant(
        now[Now.SINE],
        now[Now.COSINE],
        now[Now.SLIDE],
        now[Now.VELOCITY],
        now[Now.FORCE],
        now[Now.SLIP],
        body.case,
    )
    dt = min(find_longest_step(first, now[Now.TANGENT], body), body.step)
    if left < (1 + STEP_ROUND_OFF) * dt:
        dt = left
    elif left < 2 * dt:
        dt = 0.5 * left
    taken = take_step(first, dt, body)

    # The step ends at a turn, after which the law is stiff again, or at the corner of the law before it.
    turns = first.velocity * taken.velocity < 0
    branch = find_branch(first, body)
    passes = abs(taken.slide - first.slide) > branch.path
    turns = turns and not passes
    if turns or passes:
        dt, taken = locate_end(first, taken, dt, branch.path, turns, body)
    end = 0.0 if turns else taken.velocity
    if observes:
        observe_step(first, dt, branch, body, seen)
    last = commit(first, taken, dt, end, body)
    piece = Piece(first, last, dt, taken.work, last.force)
    if observes:
        observe_piece(piece, body.case, seen)

    dq = last.slide - first.slide
    if turns or dq == 0:
        now[Now.TANGENT] = find_first_tangent(body)
    else:
        now[Now.TANGENT] = abs((last.force - first.force) / dq)
    store_instant(last, now)
    return piece
