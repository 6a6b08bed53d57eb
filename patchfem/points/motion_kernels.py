"""Pieces of the motion of a case: steps that end where the law turns, slips or meets a corner (compiled).

The motion goes on from an instant by `reach`, which is exact for laws that are linear between events, and a Runge-Kutta step
of order 4 for smooth ones, whose force follows the path of the step exactly (`law_kernels`). A piece of the motion ends at
the first of three events, which are found as roots of what `reach` returns:

- a turn, where the velocity changes its sign, also twice in a step,
- a corner of the law: an elastic point begins to slip, parallel sliders slip as a whole, unloading ends,
- the release of a rigid point at rest, at a known phase of the drive.

`case` is a row of one case in the order of `rows.Number`.
"""

from enum import IntEnum
from math import atan2, cos, exp, inf, nan, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..friction.laws.lugre_kernels import LuGreNumber
from ..kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..kernel_cache.jit import njit
from .law_kernels import (
    Branch,
    Step,
    find_branch,
    find_first_tangent,
    find_force,
    find_share,
)
from .rows import Law, LawNumber, Memory, Number, PointLaw

STEP_ROUND_OFF = 1e-9  # remainder of a cycle relative to a step that belongs to the step
# Velocity that is round-off, relative to its change by the acceleration at the end of a step
STOP_ROUND_OFF = 1e-10
MAX_STEP_PHASE = 1.0  # largest phase of the vibration of a sticking point in an exact step [rad]
MAX_EXACT_STEPS = 256  # largest number of exact steps per cycle
MAX_ROOT_STEPS = 60  # secants and bisections for an event
# Product of the last two changes of the instant of an event, relative to the step, by about which the next secant would
# change it: round-off, and for a smooth law less than the error of the step
ROOT_TOLERANCE = 1e-14
SMOOTH_ROOT_TOLERANCE = 1e-5
# Steps per cycle at which the shortest step is a radian of the vibration above a stiff law, or the time of its relaxation
REFERENCE_STEPS = 16.0
# Velocity relative to the speed of a law above which its force changes by less than 2e-5
FLAT_SPEED = 6.0
# Part of the way there that a step may take, so that it does not pass it if the acceleration grows
APPROACH = 0.7


class Goal(IntEnum):
    """Quantity that is 0 at an event.

    - VELOCITY, ACCELERATION: of the slide
    - PATH: from the start of the piece, beyond a level
    - SHARE: irreversible part of the motion, beyond a level
    """

    VELOCITY = 0
    ACCELERATION = 1
    PATH = 2
    SHARE = 3


class Instant(NamedTuple):
    """State of a case at an instant; at a jump, the values on the side of the piece.

    - phase: exp(i w t) of the drive
    - slide, velocity, acceleration: relative displacement [m] and its rates [m/s], [m s-2]
    - force: friction force [N]
    - slip: irreversible part of the slide [m]; of a smooth law known at the ends of pieces
    - work: friction work since the start of the piece [J]
    """

    phase: complex
    slide: float
    velocity: float
    acceleration: float
    force: float
    slip: float
    work: float


class Regime(NamedTuple):
    """Motion of the slide of a law that is linear between events, during slip or stick.

    - stiffness: squared circular frequency [1/s2]
    - root: -decay [1/s] + i frequency [rad/s] of the free vibration
    - gain: forced motion is that of gain exp(i w t) by its imaginary part [m]
    - turn, growth: factors of exp(i w t) and of the free vibration in a step
    """

    stiffness: float
    root: complex
    gain: complex
    turn: complex
    growth: complex


class Body(NamedTuple):
    """A case.

    - case (12,): numbers of the case, in the order of `rows.Number`
    - law: numbers and memory of its law
    - stiffness: of an elastic point that is linear between events, during stick [N/m]; else 0
    - slip, stick: motion in both regimes of such a law
    - step: longest step [s]
    - grade: length of the steps of a smooth law relative to that with REFERENCE_STEPS per cycle
    """

    case: np.ndarray
    law: PointLaw
    stiffness: float
    slip: Regime
    stick: Regime
    step: float
    grade: float


class Piece(NamedTuple):
    """Piece of a motion.

    - first, last: its ends
    - duration: [s]
    - branch: curve of the law
    - direction: direction of slip after it of a law that is linear between events, 0 during stick
    - tangent: change of the force of a smooth law per slide [N/m]
    - end_force: friction force [N] that counts if the slide is an extreme at the end, NaN if it is unknown
    - has_event: whether an event ends it
    """

    first: Instant
    last: Instant
    duration: float
    branch: Branch
    direction: float
    tangent: float
    end_force: float
    has_event: bool


@njit(**NJIT_KERNEL)
def is_linear(body):
    """Return whether the law of a `Body` is linear between events."""
    return body.law.numbers[LawNumber.LAW] <= Law.JENKINS


@njit(**NJIT_KERNEL)
def rotate(angle):
    """Return exp(i angle), of an angle [rad]."""
    return complex(cos(angle), sin(angle))


@njit(**NJIT_CALL)
def grow(root, dt):
    """Return the factor exp(root dt) of a free vibration with a complex `root` [1/s] in a time `dt` [s]."""
    return exp(root.real * dt) * rotate(root.imag * dt)


@njit(**NJIT_KERNEL)
def make_regime(case, added, dt):
    """Return the `Regime` of a case.

    Parameters
    ----------
    case : (12,) array
    added : float
        Stiffness per mass in addition to that of the mode [1/s2].
    dt : float
        Step [s].
    """
    omega = case[Number.OMEGA]
    decay = 0.5 * case[Number.DAMPING]
    stiffness = case[Number.STIFFNESS] + added
    root = complex(-decay, sqrt(max(stiffness - decay * decay, 0.0)))
    detuning = stiffness - omega * omega
    viscous = case[Number.DAMPING] * omega
    size = case[Number.DRIVE] / (detuning * detuning + viscous * viscous)
    gain = complex(size * detuning, -size * viscous)
    return Regime(stiffness, root, gain, rotate(omega * dt), grow(root, dt))


@njit(**NJIT_KERNEL)
def make_body(case, law, steps):
    """Return the `Body` of a case.

    Parameters
    ----------
    case : (12,) array
    law : PointLaw
    steps : float
        Fewest steps per cycle.
    """
    numbers = law.numbers
    stiffness = 0.0
    if numbers[LawNumber.LAW] == Law.JENKINS:
        stiffness = numbers[LawNumber.LIMIT] / numbers[LawNumber.LENGTH]
    added = case[Number.MOBILITY] * stiffness
    count = steps
    if numbers[LawNumber.LAW] <= Law.JENKINS:
        # More steps resolve the vibration of a sticking point.
        ratio = sqrt(case[Number.STIFFNESS] + added) / case[Number.OMEGA]
        count = min(max(steps, 2 * pi * ratio / MAX_STEP_PHASE), MAX_EXACT_STEPS)
    step = 2 * pi / case[Number.OMEGA] / count
    slip = make_regime(case, 0.0, step)
    stick = make_regime(case, added, step)
    return Body(case, law, stiffness, slip, stick, step, REFERENCE_STEPS / steps)


@njit(**NJIT_KERNEL)
def make_instant(phase, q, v, force, case):
    """Return the `Instant` of a case by its equation of motion, without slip and work.

    Parameters
    ----------
    phase : complex
        exp(i w t) of the drive.
    q, v, force : float
        Slide [m], velocity [m/s] and friction force [N].
    case : (12,) array
    """
    a = case[Number.DRIVE] * phase.imag - case[Number.DAMPING] * v - case[Number.STIFFNESS] * q
    return Instant(phase, q, v, a - case[Number.MOBILITY] * force, force, q, 0.0)


@njit(**NJIT_KERNEL)
def find_rest(body, direction, slip):
    """Return the slide [m] at which the constant forces of a linear regime are in balance.

    Parameters
    ----------
    body : Body
    direction : float
        Direction of slip, 0 during stick.
    slip : float
        Irreversible slide [m].
    """
    mobility = body.case[Number.MOBILITY]
    if direction == 0:
        return mobility * body.stiffness * slip / body.stick.stiffness
    return -mobility * direction * find_kinetic(body) / body.slip.stiffness


@njit(**NJIT_KERNEL)
def find_kinetic(body):
    """Return the friction force [N] during slip of a `Body` whose law is linear between events."""
    numbers = body.law.numbers
    is_rigid = numbers[LawNumber.LAW] == Law.COULOMB
    return numbers[LawNumber.KINETIC] if is_rigid else numbers[LawNumber.LIMIT]


@njit(**NJIT_KERNEL)
def find_hold(body, phase, q):
    """Return the force [N] that keeps a point at rest.

    Parameters
    ----------
    body : Body
    phase : complex
        exp(i w t) of the drive.
    q : float
        Slide [m].
    """
    case = body.case
    return (case[Number.DRIVE] * phase.imag - case[Number.STIFFNESS] * q) / case[Number.MOBILITY]


@njit(**NJIT_KERNEL)
def finish(body, direction, first, at, dt, commits):
    """Return an `Instant` with the force of the law there.

    Parameters
    ----------
    body : Body
    direction : float
        Direction of slip of a law that is linear between events, 0 during stick.
    first : Instant
        Start of the piece.
    at : Instant
        Phase, slide, velocity and work.
    dt : float
        Time since the start [s].
    commits : bool
        Whether the memory of a smooth law goes on. Only then is its slip known.
    """
    q = at.slide
    slip = first.slip
    work = at.work
    if not is_linear(body):
        step = Step(q - first.slide, dt, first.velocity, at.velocity)
        force = find_force(body.law, step, commits)
        slip = q - body.law.memory[Memory.STRETCH]
    else:
        if direction != 0:
            force = direction * find_kinetic(body)
            slip = q - force / body.stiffness if body.stiffness > 0 else q
        elif body.stiffness > 0:
            force = body.stiffness * (q - slip)
        else:
            force = find_hold(body, at.phase, q)
        # Force and slide are proportional in a piece.
        work = 0.5 * (first.force + force) * (q - first.slide)
    ended = make_instant(at.phase, q, at.velocity, force, body.case)
    return Instant(at.phase, q, at.velocity, ended.acceleration, force, slip, work)


@njit(**NJIT_KERNEL)
def move(body, direction, first, dt):
    """Return the `Instant` after an exact step of a linear regime, without its force.

    Parameters
    ----------
    body : Body
    direction : float
        Direction of slip, 0 during stick.
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    """
    case = body.case
    regime = body.stick if direction == 0 else body.slip
    turn = regime.turn
    growth = regime.growth
    if dt != body.step:
        turn = rotate(case[Number.OMEGA] * dt)
        growth = grow(regime.root, dt)
    phase = first.phase * turn
    if direction == 0 and body.stiffness == 0:
        return make_instant(phase, first.slide, 0.0, 0.0, case)

    # The free vibration is the distance from the forced motion.
    rest = find_rest(body, direction, first.slip)
    forced = regime.gain * first.phase
    y = first.slide - rest - forced.imag
    u = first.velocity - case[Number.OMEGA] * forced.real
    free = complex(y, (regime.root.real * y - u) / regime.root.imag) * growth
    forced = regime.gain * phase
    q = rest + forced.imag + free.real
    v = case[Number.OMEGA] * forced.real + (regime.root * free).real
    return make_instant(phase, q, v, 0.0, case)


@njit(**NJIT_CALL)
def take_step(case, law, first, dt):
    """Return the `Instant` after a step of order 4 by the method of Runge, Kutta and Nystroem, with force of its last stage.

    Parameters
    ----------
    case : (12,) array
    law : PointLaw
    first : Instant
        Start of the step.
    dt : float
        Duration [s].
    """
    kind = law.numbers[LawNumber.LAW]
    half = 0.5 * dt
    turn = rotate(case[Number.OMEGA] * half)
    middle = first.phase * turn
    phase = middle * turn

    # Two estimates of the middle; the force differs if it follows the velocity.
    v = first.velocity
    a = first.acceleration
    rise = half * v + 0.5 * half * half * a
    v_1 = v + half * a
    force_1 = find_force(law, Step(rise, half, v, v_1), False)
    a_1 = make_instant(middle, first.slide + rise, v_1, force_1, case).acceleration
    v_2 = v + half * a_1
    force_2 = force_1
    if kind == Law.TANH or kind == Law.LUGRE:
        force_2 = find_force(law, Step(rise, half, v, v_2), False)
    a_2 = make_instant(middle, first.slide + rise, v_2, force_2, case).acceleration

    # An estimate of the end, and the end
    rise = dt * v + half * dt * a_2
    v_3 = v + dt * a_2
    force_3 = find_force(law, Step(rise, dt, v, v_3), False)
    a_3 = make_instant(phase, first.slide + rise, v_3, force_3, case).acceleration
    slide = first.slide + dt * v + dt * dt / 6 * (a + a_1 + a_2)
    velocity = v + dt / 6 * (a + 2 * a_1 + 2 * a_2 + a_3)
    power = first.force * v + 2 * force_1 * v_1 + 2 * force_2 * v_2 + force_3 * v_3
    return Instant(phase, slide, velocity, a_3, force_3, slide, dt / 6 * power)


@njit(**NJIT_KERNEL)
def reach(body, direction, first, dt):
    """Return the `Instant` at a time after another one on the same curve of the law.

    Force and acceleration of a smooth law are those of the last stage of the step. `finish` computes those at its end.

    Parameters
    ----------
    body : Body
    direction : float
        Direction of slip of a law that is linear between events, 0 during stick.
    first : Instant
        Start.
    dt : float
        The time [s].
    """
    if is_linear(body):
        return finish(body, direction, first, move(body, direction, first, dt), dt, False)
    return take_step(body.case, body.law, first, dt)


@njit(**NJIT_CALL)
def sample(body, direction, ends, dt, time):
    """Return the `Instant` at a time after the start of a piece, with the force of the law.

    The slide of a smooth law is the polynomial of order 5 through slide, velocity and acceleration at both ends.

    Parameters
    ----------
    body : Body
        With the memory of its law at the start of the piece.
    direction : float
        Direction of slip of a law that is linear between events, 0 during stick.
    ends : (Instant, Instant)
        Ends of the piece.
    dt : float
        Duration of the piece [s].
    time : float
        Time since its start [s].
    """
    first, last = ends
    if is_linear(body):
        return reach(body, direction, first, time)
    # Distances of slide, velocity and acceleration at the end from the parabola at the start, times powers of dt
    part = time / dt
    v = first.velocity * dt
    bend = 0.5 * first.acceleration * dt * dt
    rise = last.slide - first.slide - v - bend
    slope = last.velocity * dt - v - 2 * bend
    turn = last.acceleration * dt * dt - 2 * bend
    c_3 = 10 * rise - 4 * slope + 0.5 * turn
    c_4 = -15 * rise + 7 * slope - turn
    c_5 = 6 * rise - 3 * slope + 0.5 * turn
    q = part * (v + part * (bend + part * (c_3 + part * (c_4 + part * c_5))))
    rate = v + part * (2 * bend + part * (3 * c_3 + part * (4 * c_4 + part * 5 * c_5)))
    phase = first.phase * rotate(body.case[Number.OMEGA] * time)
    at = make_instant(phase, first.slide + q, rate / dt, 0.0, body.case)
    return finish(body, direction, first, at, time, False)


@njit(**NJIT_KERNEL)
def read(body, branch, at, goal, level):
    """Return the quantity of an `Instant` that is 0 at an event.

    Parameters
    ----------
    body : Body
    branch : Branch
    at : Instant
    goal : Goal
    level : float
        Path or part that is subtracted.
    """
    if goal == Goal.VELOCITY:
        return at.velocity
    if goal == Goal.ACCELERATION:
        return at.acceleration
    if goal == Goal.PATH:
        return abs(at.slide - branch.start) - level
    return find_share(at, branch, body.law.numbers) - level


@njit(**NJIT_CALL)
def locate(body, branch, ends, dt, goal, level):
    """Return the time [s] since the start of a piece at which a quantity is 0, by secants in a bracket.

    Parameters
    ----------
    body : Body
    branch : Branch
    ends : (Instant, Instant)
        Ends of the piece, of which the last one is behind the event.
    dt : float
        Duration of the piece [s].
    goal : Goal
        The quantity, as in `read`.
    level : float
        Its level, as in `read`.
    """
    first, last = ends
    tolerance = ROOT_TOLERANCE if is_linear(body) else SMOOTH_ROOT_TOLERANCE
    low = 0.0
    high = before = dt
    end = miss_before = read(body, branch, last, goal, level)
    start = read(body, branch, first, goal, level)
    # A velocity that is 0 at the start grows first.
    time = 0.5 * dt
    if start * end < 0:
        time = dt * start / (start - end)
    for _ in range(MAX_ROOT_STEPS):
        if goal == Goal.SHARE:
            at = sample(body, branch.direction, ends, dt, time)
        else:
            at = reach(body, branch.direction, first, time)
        miss = read(body, branch, at, goal, level)
        if miss * end < 0:
            low = time
        else:
            high = time
        following = low
        if miss != miss_before:
            following = time - miss * (time - before) / (miss - miss_before)
        if miss == 0:
            break
        if abs(following - time) * abs(time - before) <= tolerance * dt * dt:
            return min(max(following, low), high)
        before = time
        miss_before = miss
        time = following if low < following < high else 0.5 * (low + high)
    return time


@njit(**NJIT_KERNEL)
def find_passing(phase, level):
    """Return the phase [rad] until the sine of a `phase` exp(i w t) rises through a `level`; inf if it does not."""
    if abs(level) >= 1:
        return inf
    turn = complex(sqrt(1 - level * level), level) * phase.conjugate()
    angle = atan2(turn.imag, turn.real)
    return angle if angle >= 0 else angle + 2 * pi


@njit(**NJIT_KERNEL)
def find_release(body, at):
    """Return the time [s] after an `Instant` at which the drive overcomes the limit of a rigid point at rest."""
    case = body.case
    drive = case[Number.DRIVE]
    limit = case[Number.MOBILITY] * body.law.numbers[LawNumber.LIMIT]
    spring = case[Number.STIFFNESS] * at.slide
    if abs(drive * at.phase.imag - spring) > limit:
        return 0.0
    # The force d sin(w t) - k q leaves its range at the upper limit, and its negative at the lower one.
    side = 1.0 if drive > 0 else -1.0
    angle = find_passing(side * at.phase, (limit + spring) / abs(drive))
    angle = min(angle, find_passing(-side * at.phase, (limit - spring) / abs(drive)))
    return angle / case[Number.OMEGA]


@njit(**NJIT_KERNEL)
def find_longest_step(first, tangent, body):
    """Return the longest step [s] that resolves a smooth law at an instant.

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
def choose_step(body, first, tangent, left):
    """Return the duration [s] of the next step.

    Parameters
    ----------
    body : Body
    first : Instant
        Start of the step.
    tangent : float
        Change of the force of a smooth law per slide in the step before [N/m].
    left : float
        Time to the end of the cycle [s].
    """
    dt = body.step
    if not is_linear(body):
        dt = min(dt, find_longest_step(first, tangent, body))
    if left < (1 + STEP_ROUND_OFF) * dt:
        return left
    # Steps of smooth laws are not fitted to a grid, so that the motion changes smoothly with their number.
    return 0.5 * left if left < 2 * dt and not is_linear(body) else dt


@njit(**NJIT_KERNEL)
def change_direction(body, at, direction):
    """Return the direction of slip, 0 during stick, after the turn of a point that is linear between events.

    Parameters
    ----------
    body : Body
    at : Instant
        The turn.
    direction : float
        Direction of slip before, 0 during stick.
    """
    if direction == 0 or body.stiffness > 0:
        return 0.0
    hold = find_hold(body, at.phase, at.slide)
    if abs(hold) <= body.law.numbers[LawNumber.LIMIT]:
        return 0.0
    return 1.0 if hold > 0 else -1.0


@njit(**NJIT_KERNEL)
def start(body):
    """Return the `Instant` at the start of a run; a rigid point that moves slips in the direction of its velocity."""
    case = body.case
    v = case[Number.VELOCITY]
    at = make_instant(complex(1.0, 0.0), case[Number.SLIDE], v, 0.0, case)
    return finish(body, find_first_direction(body), at, at, 0.0, False)


@njit(**NJIT_KERNEL)
def find_first_direction(body):
    """Return the direction of slip at the start of a run, 0 during stick."""
    v = body.case[Number.VELOCITY]
    if body.stiffness > 0 or v == 0:
        return 0.0
    return 1.0 if v > 0 else -1.0


@njit(**NJIT_KERNEL)
def advance(body, at, before, left, finds_events, commits):
    """Return the next `Piece` of a motion.

    Parameters
    ----------
    body : Body
    at : Instant
        Start of the piece.
    before : (float, float)
        Direction of slip of a law that is linear between events, 0 during stick, and the change of the force of a smooth
        law per slide in the piece before [N/m].
    left : float
        Time to the end of the cycle [s].
    finds_events : bool
        Whether the piece ends at an event.
    commits : bool
        Whether the memory of a smooth law goes on to the end of the piece.
    """
    direction, tangent = before
    first = Instant(at.phase, at.slide, at.velocity, at.acceleration, at.force, at.slip, 0.0)
    if is_linear(body):
        first = finish(body, direction, at, at, 0.0, False)
    dt = choose_step(body, first, tangent, left)

    # A rigid point rests up to its release.
    if is_linear(body) and direction == 0 and body.stiffness == 0:
        release = find_release(body, first) if finds_events else inf
        branch = Branch(first.slide, 0.0, 0.0, 1.0, inf)
        last = reach(body, 0.0, first, min(release, dt))
        after = 0.0
        if release < dt:
            after = 1.0 if last.force > 0 else -1.0
        return Piece(first, last, min(release, dt), branch, after, 0.0, nan, release < dt)

    last = reach(body, direction, first, dt)
    branch = find_branch(first, last, body.law, direction)
    sign = branch.sign
    after = direction
    turns = passes = False
    if finds_events:
        # A velocity that falls and rises again may turn on the way.
        falls = sign * first.acceleration < 0 and sign * last.acceleration > 0
        if falls and sign * last.velocity > 0:
            part = locate(body, branch, (first, last), dt, Goal.ACCELERATION, 0.0)
            lowest = reach(body, direction, first, part)
            if sign * lowest.velocity < -STOP_ROUND_OFF * dt * abs(last.acceleration):
                dt = part
                last = lowest
        turns = sign * last.velocity < 0
        if turns:
            dt = locate(body, branch, (first, last), dt, Goal.VELOCITY, 0.0)
            at = reach(body, direction, first, dt)
            at = Instant(at.phase, at.slide, 0.0, 0.0, 0.0, at.slip, at.work)
            last = finish(body, direction, first, at, dt, False) if is_linear(body) else at
            after = change_direction(body, last, direction)
        passes = abs(last.slide - first.slide) > branch.path
        if passes:
            dt = locate(body, branch, (first, last), dt, Goal.PATH, branch.path)
            last = reach(body, direction, first, dt)
            after = sign

    if not is_linear(body):
        last = finish(body, direction, first, last, dt, commits)

    # At a reversal the force of a rigid point jumps from one sign to the other, or takes many values.
    turns = turns and not passes
    end_force = last.force
    if turns and is_linear(body) and body.stiffness == 0:
        end_force = nan if after == 0 else 0.0
    dq = last.slide - first.slide
    if turns or dq == 0:
        tangent = find_first_tangent(body.law.numbers)
    else:
        tangent = abs((last.force - first.force) / dq)
    return Piece(first, last, dt, branch, after, tangent, end_force, turns or passes)


@njit(**NJIT_KERNEL)
def commit(body, piece):
    """Return the last `Instant` of a `Piece`, to which the memory of a smooth law goes on."""
    if is_linear(body):
        return piece.last
    return finish(body, 0.0, piece.first, piece.last, piece.duration, True)
