"""Runge-Kutta steps of order 4 of a case with a smooth law (compiled).

A law follows its path exactly (`smooth_laws_kernels`), so that its force is a smooth function of slide and velocity up
to the next turn. A step that contains a turn ends there. After it the stiffness of the law is largest; steps are short
where the law is stiff. They are not fitted to a grid, so that the motion changes smoothly with their number.

`case` and `now` are rows of one case, see `case_rows`.
"""

from math import cos, inf, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from ..friction.laws.lugre_kernels import LuGreNumber
from .case_observers_kernels import (
    STEP_ROUND_OFF,
    Motion,
    Piece,
    make_instant,
    observe_motion,
    observe_piece,
    store_instant,
)
from .case_rows import Now, Number
from .law_rows import Law, LawNumber, Memory
from .smooth_laws_kernels import (
    PointLaw,
    Step,
    find_branch,
    find_first_tangent,
    find_force,
)

MAX_END_STEPS = 8  # Newton steps for the instant of a turn, or of a corner of the law
# Velocity at a turn relative to its change in the step, or path to a corner relative to the whole path to it
END_TOLERANCE = 1e-6
# Steps per cycle at which the shortest step is a radian of the vibration above a stiff law, or the time of its relaxation
REFERENCE_STEPS = 16.0
# Velocity relative to the speed of a law above which its force changes by less than 2e-5
FLAT_SPEED = 6.0
# Part of the way there that a step may take, so that it does not pass it if the acceleration grows
APPROACH = 0.7


class Body(NamedTuple):
    """A case and its law.

    - case (12,): numbers of the case, in the order of `case_rows.Number`
    - law: numbers and memory of its law
    - grade: length of the steps relative to that with REFERENCE_STEPS per cycle
    - step: longest step [s]
    """

    case: np.ndarray
    law: PointLaw
    grade: float
    step: float


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


@njit(**NJIT_KERNEL)
def make_body(case, law, steps):
    """Return the `Body` of a case.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    law : PointLaw
    steps : float
        Fewest steps per cycle.
    """
    return Body(case, law, REFERENCE_STEPS / steps, 2 * pi / steps / case[Number.OMEGA])


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
    law = body.law
    kind = law.numbers[LawNumber.LAW]
    half = 0.5 * dt
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
    force_1 = find_force(law, Step(rise, half, v, v_1), False)
    a_1 = make_instant(sine, cosine, first.slide + rise, v_1, force_1, 0.0, case).acceleration
    v_2 = v + half * a_1
    force_2 = force_1
    if kind == Law.TANH or kind == Law.LUGRE:
        force_2 = find_force(law, Step(rise, half, v, v_2), False)
    a_2 = make_instant(sine, cosine, first.slide + rise, v_2, force_2, 0.0, case).acceleration

    # An estimate of the end, and the end
    rise = dt * v + half * dt * a_2
    v_3 = v + dt * a_2
    force_3 = find_force(law, Step(rise, dt, v, v_3), False)
    q_3 = first.slide + rise
    a_3 = make_instant(last_sine, last_cosine, q_3, v_3, force_3, 0.0, case).acceleration
    slide = first.slide + dt * v + dt * dt / 6 * (a + a_1 + a_2)
    velocity = v + dt / 6 * (a + 2 * a_1 + 2 * a_2 + a_3)
    power = first.force * v + 2 * force_1 * v_1 + 2 * force_2 * v_2 + force_3 * v_3
    return Taken(last_sine, last_cosine, slide, velocity, a_3, dt / 6 * power)


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
    v = 0.0 if turns else taken.velocity
    q = taken.slide
    return time, Taken(taken.sine, taken.cosine, q, v, taken.acceleration, taken.work)


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
    numbers = body.law.numbers
    grade = body.grade
    law = numbers[LawNumber.LAW]
    mobility = case[Number.MOBILITY]
    if law != Law.TANH:
        dt = grade / sqrt(mobility * tangent + case[Number.STIFFNESS] + case[Number.OMEGA] ** 2)
        if law != Law.LUGRE:
            # The force of a law of the path changes by a part of its limit.
            path = grade * numbers[LawNumber.LIMIT] / tangent
            root = sqrt(first.velocity**2 + 2 * path * abs(first.acceleration))
            return min(dt, 2 * path / (abs(first.velocity) + root))
        speed = numbers[LuGreNumber.SPEED]
    else:
        # The velocity relaxes at this rate to the one that the drive keeps up.
        limit = numbers[LawNumber.LIMIT]
        speed = numbers[LawNumber.SPEED]
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
def finish_step(first, taken, dt, commits, body):
    """Return the `Instant` at the end of a step.

    Parameters
    ----------
    first : Instant
        Start of the step.
    taken : Taken
        The step.
    dt : float
        Duration [s].
    commits : bool
        Whether the memory of the law goes on to the end. Only then is the slip of the result that at the end.
    body : Body
    """
    law = body.law
    q = taken.slide
    v = taken.velocity
    force = find_force(law, Step(q - first.slide, dt, first.velocity, v), commits)
    slip = q - law.memory[Memory.STRETCH]
    return make_instant(taken.sine, taken.cosine, q, v, force, slip, body.case)


@njit(**NJIT_KERNEL)
def start(body, now):
    """Set the state of a case at the start in `now`, whose slide and velocity are known."""
    law = body.law
    v = now[Now.VELOCITY]
    now[Now.FORCE] = find_force(law, Step(0.0, 0.0, v, v), False)
    now[Now.SLIP] = now[Now.SLIDE]
    now[Now.TANGENT] = find_first_tangent(law.numbers)


@njit(**NJIT_KERNEL)
def advance(body, left, observes, now, seen):
    """Advance a case by a step, or up to the turn or the corner of the law in it, and return the `Piece`.

    Parameters
    ----------
    body : Body
        The memory of its law goes on to the end of the step (changed in place).
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

    # A velocity that falls and rises again may turn on the way.
    falls = first.velocity * first.acceleration < 0
    if falls and first.velocity * taken.velocity > 0 and taken.velocity * taken.acceleration > 0:
        part = first.acceleration / (first.acceleration - taken.acceleration)
        lowest = take_step(first, part * dt, body)
        if first.velocity * lowest.velocity < 0:
            dt *= part
            taken = lowest

    # The step ends at a turn, after which the law is stiff again, or at the corner of the law before it.
    turns = first.velocity * taken.velocity < 0
    branch = find_branch(first, body.law)
    passes = abs(taken.slide - first.slide) > branch.path
    turns = turns and not passes
    if turns or passes:
        dt, taken = locate_end(first, taken, dt, branch.path, turns, body)
    if observes:
        # Within the step the law follows from its memory at the start.
        last = finish_step(first, taken, dt, False, body)
        piece = Piece(first, last, dt, taken.work, last.force)
        motion = Motion(body.case, body.law, branch)
        observe_motion(piece, motion, body.case[Number.OUTPUT], seen)
    last = finish_step(first, taken, dt, True, body)
    piece = Piece(first, last, dt, taken.work, last.force)
    if observes:
        observe_piece(piece, body.case, seen)

    dq = last.slide - first.slide
    if turns or dq == 0:
        now[Now.TANGENT] = find_first_tangent(body.law.numbers)
    else:
        now[Now.TANGENT] = abs((last.force - first.force) / dq)
    store_instant(last, now)
    return piece
