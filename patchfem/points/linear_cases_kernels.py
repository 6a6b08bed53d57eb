"""Exact steps of a case whose law is linear between events (compiled).

A rigid or elastic-plastic point sticks or slips. The force that keeps a rigid point at rest follows from the drive. In
the other regimes the slide q obeys q'' + c q' + k q = d sin(omega t) + constant, with the stiffness of an elastic point
in k while it sticks, so that a step is in closed form. Events, at which slip begins, stops or turns, are roots of it.
In a step whose velocity changes its sign twice it is found by the root of the acceleration, so that a motion that only
touches its limit is not missed. Errors are those of roots, and of the integrals of the observers.

`case` and `now` are rows of one case, see `case_rows`.
"""

from math import atan2, cos, exp, inf, nan, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from .case_observers_kernels import (
    STEP_ROUND_OFF,
    Instant,
    Motion,
    Piece,
    observe_motion,
    observe_piece,
    store_instant,
)
from .case_rows import MAX_STEP_PHASE, MAX_STEPS, Now, Number
from .law_rows import Law, LawNumber
from .smooth_laws_kernels import Branch, PointLaw

MAX_ROOT_STEPS = 60  # Newton steps and bisections for an event
ROOT_TOLERANCE = 1e-13  # error of the instant of an event, relative to the step
# Steps in a row with an event, after which one has none: a point at its limit whose events are round-off
MAX_EVENTS = 16
# Time of a slip relative to its step below which it is round-off. The elastic point is then unloaded by this fraction of
# its limit, so that the slip is not tried again.
MIN_SLIP_TIME = 1e-9
# Distance of the lowest velocity of a parabola from 0, relative to its drop, above which a velocity that falls and rises
# again has no root
DIP_MARGIN = 0.3
# Velocity that is round-off, relative to its change by the acceleration at the end of a step
STOP_ROUND_OFF = 1e-10


class Goal(NamedTuple):
    """Sum that is 0 at an event: of slide, velocity and acceleration by their weights, less a value."""

    slide: float
    velocity: float
    acceleration: float
    value: float


class FreeStep(NamedTuple):
    """Response over a time.

    - sine, cosine: of the phase of the drive that passes
    - slide_by_slide, slide_by_velocity, velocity_by_slide, velocity_by_velocity: slide and velocity after a free
      vibration, per slide [1], [1/s] and per velocity [s], [1] at its start
    """

    sine: float
    cosine: float
    slide_by_slide: float
    slide_by_velocity: float
    velocity_by_slide: float
    velocity_by_velocity: float


class Regime(NamedTuple):
    """Motion of the slide during slip or stick.

    - decay, frequency: of the free vibration [1/s], [rad/s]
    - stiffness: squared circular frequency [1/s2]
    - in_phase, quadrature: forced motion by the sine and the cosine of the drive [m]
    - damping: [1/s]
    - drive, omega: amplitude [m s-2] and circular frequency [rad/s] of the drive
    """

    decay: float
    frequency: float
    stiffness: float
    in_phase: float
    quadrature: float
    damping: float
    drive: float
    omega: float


class Point(NamedTuple):
    """Law of a case.

    - static, kinetic: friction limits [N]
    - stiffness: during stick [N/m], 0 of a rigid point
    - mobility: acceleration of the slide per friction force [1/kg]
    """

    static: float
    kinetic: float
    stiffness: float
    mobility: float


class Block(NamedTuple):
    """A case.

    - case (12,): numbers of the case, in the order of `case_rows.Number`
    - law, point: its law
    - slip, stick: motion in both regimes
    - step: longest step [s]
    - slip_step, stick_step: response over it in both regimes
    """

    case: np.ndarray
    law: PointLaw
    point: Point
    slip: Regime
    stick: Regime
    step: float
    slip_step: FreeStep
    stick_step: FreeStep


class State(NamedTuple):
    """Sine and cosine of the phase of the drive, slide [m], velocity [m/s] and acceleration [m s-2] at an instant."""

    sine: float
    cosine: float
    slide: float
    velocity: float
    acceleration: float


class Contact(NamedTuple):
    """State of the point: direction of slip, 0 during stick, and the slide without stretch [m]."""

    direction: float
    centre: float


class Event(NamedTuple):
    """First event in a step: time since its start [s], negative without one, and direction of slip after it."""

    time: float
    direction: float


@njit(**NJIT_KERNEL)
def make_regime(case, added):
    """Return the `Regime` of a case with a stiffness per mass `added` [1/s2] to that of its mode."""
    decay = 0.5 * case[Number.DAMPING]
    stiffness = case[Number.STIFFNESS] + added
    omega = case[Number.OMEGA]
    drive = case[Number.DRIVE]
    detuning = stiffness - omega * omega
    viscous = case[Number.DAMPING] * omega
    size = drive / (detuning * detuning + viscous * viscous)
    return Regime(
        decay,
        sqrt(stiffness - decay * decay),
        stiffness,
        size * detuning,
        -size * viscous,
        case[Number.DAMPING],
        drive,
        omega,
    )


@njit(**NJIT_CALL)
def make_free_step(regime, dt):
    """Return the `FreeStep` of a time `dt` [s] in a `Regime`."""
    size = exp(-regime.decay * dt)
    c = size * cos(regime.frequency * dt)
    s = size * sin(regime.frequency * dt) / regime.frequency
    return FreeStep(
        sin(regime.omega * dt),
        cos(regime.omega * dt),
        c + regime.decay * s,
        s,
        -regime.stiffness * s,
        c - regime.decay * s,
    )


@njit(**NJIT_KERNEL)
def make_point(case, numbers):
    """Return the `Point` of a case.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    numbers : (k,) array
        Numbers of the law.
    """
    limit = numbers[LawNumber.LIMIT]
    if numbers[LawNumber.LAW] == Law.COULOMB:
        return Point(limit, numbers[LawNumber.KINETIC], 0.0, case[Number.MOBILITY])
    return Point(limit, limit, limit / numbers[LawNumber.LENGTH], case[Number.MOBILITY])


@njit(**NJIT_KERNEL)
def make_block(case, law, steps, refinement):
    """Return the `Block` of a case.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    law : PointLaw
    steps : float
        Fewest steps per cycle. More of them resolve the vibration of a sticking point.
    refinement : float
        Factor of the number of steps.
    """
    point = make_point(case, law.numbers)
    slip = make_regime(case, 0.0)
    stick = make_regime(case, point.mobility * point.stiffness)
    period = 2 * pi / slip.omega
    needed = max(steps, period * stick.frequency / MAX_STEP_PHASE)
    step = period / min(needed, MAX_STEPS) / refinement
    slip_step = make_free_step(slip, step)
    return Block(case, law, point, slip, stick, step, slip_step, make_free_step(stick, step))


@njit(**NJIT_KERNEL)
def complete(regime, rest, sine, cosine, q, v):
    """Return a `State` with the acceleration that follows from slide and velocity.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    sine, cosine : float
        Of the phase of the drive.
    q, v : float
        Slide [m] and velocity [m/s].
    """
    a = regime.drive * sine - regime.damping * v - regime.stiffness * (q - rest)
    return State(sine, cosine, q, v, a)


@njit(**NJIT_KERNEL)
def move(regime, rest, start, free):
    """Return the `State` after a step of the motion about the slide `rest`.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    start : State
        Start of the step.
    free : FreeStep
        Response over the duration of the step.
    """
    sine = start.sine * free.cosine + start.cosine * free.sine
    cosine = start.cosine * free.cosine - start.sine * free.sine

    # The free vibration is the distance from the forced motion.
    y = start.slide - rest - regime.in_phase * start.sine - regime.quadrature * start.cosine
    rate = regime.omega * (regime.in_phase * start.cosine - regime.quadrature * start.sine)
    u = start.velocity - rate
    q = rest + regime.in_phase * sine + regime.quadrature * cosine
    q += free.slide_by_slide * y + free.slide_by_velocity * u
    v = regime.omega * (regime.in_phase * cosine - regime.quadrature * sine)
    v += free.velocity_by_slide * y + free.velocity_by_velocity * u
    return complete(regime, rest, sine, cosine, q, v)


@njit(**NJIT_KERNEL)
def find_jerk(regime, state):
    """Return the rate of the acceleration of the slide [m s-3] in a `State` of a `Regime`."""
    jerk = regime.drive * regime.omega * state.cosine
    return jerk - regime.damping * state.acceleration - regime.stiffness * state.velocity


@njit(**NJIT_CALL)
def find_root(regime, rest, start, last, goal, sign):
    """Return the time [s] at which the sum of a `Goal` is 0, by Newton's method in a bracket.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    start : State
        Start of the motion.
    last : float
        Time [s] at which the sum has the other sign.
    goal : Goal
    sign : float
        Sign of the sum just after the start.
    """
    low = 0.0
    high = last
    time = 0.5 * last
    for _ in range(MAX_ROOT_STEPS):
        at = move(regime, rest, start, make_free_step(regime, time))
        miss = goal.slide * at.slide + goal.velocity * at.velocity
        miss += goal.acceleration * at.acceleration - goal.value
        rate = goal.slide * at.velocity + goal.velocity * at.acceleration
        rate += goal.acceleration * find_jerk(regime, at)
        if miss * sign > 0:
            low = time
        else:
            high = time
        following = time - miss / rate if rate != 0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        change = abs(following - time)
        time = following
        if change <= ROOT_TOLERANCE * last:
            break
    return time


@njit(**NJIT_KERNEL)
def find_stop(regime, rest, start, end, dt, sign):
    """Return the time [s] at which the velocity is 0 in a step, also if it has one sign at both ends; -1 if never.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    start, end : State
        Ends of the step.
    dt : float
        Duration [s].
    sign : float
        Sign of the velocity just after the start.
    """
    stop = Goal(0.0, 1.0, 0.0, 0.0)
    round_off = STOP_ROUND_OFF * dt * abs(end.acceleration)
    if sign * end.velocity <= round_off:
        return find_root(regime, rest, start, dt, stop, sign)

    # A velocity that falls and rises again may be 0 on the way.
    fall = sign * start.acceleration
    if fall >= 0 or sign * end.acceleration <= 0:
        return -1.0
    part = dt * fall / (fall - sign * end.acceleration)
    lowest = sign * start.velocity + 0.5 * (1 + DIP_MARGIN) * fall * part
    if lowest > -round_off:
        return -1.0
    part = find_root(regime, rest, start, dt, Goal(0.0, 0.0, 1.0, 0.0), -sign)
    if sign * move(regime, rest, start, make_free_step(regime, part)).velocity >= 0:
        return -1.0
    return find_root(regime, rest, start, part, stop, sign)


@njit(**NJIT_KERNEL)
def find_passing(sine, cosine, level, omega):
    """Return the time [s] until the sine of a phase rises through a level; inf if it does not.

    Parameters
    ----------
    sine, cosine : float
        Of the phase now.
    level : float
        The level.
    omega : float
        Circular frequency [rad/s].
    """
    if abs(level) >= 1:
        return inf
    high = sqrt(1 - level * level)
    turn = atan2(level * cosine - high * sine, high * cosine + level * sine)
    return (turn if turn >= 0 else turn + 2 * pi) / omega


@njit(**NJIT_KERNEL)
def find_release(regime, point, start, end, dt):
    """Return the first `Event` in a step in which a rigid point is at rest: the drive overcomes the static limit.

    Parameters
    ----------
    regime : Regime
    point : Point
    start, end : State
        Ends of the step; only their phases matter.
    dt : float
        Duration [s].
    """
    first = Event(-1.0, 0.0)
    time = dt
    limit = point.mobility * point.static
    turn = regime.omega * dt
    spring = regime.stiffness * start.slide
    hold = max(abs(regime.drive * start.sine - spring), abs(regime.drive * end.sine - spring))
    # Between the ends a sine rises above them by at most the square of half the phase over 2.
    if hold + 0.125 * turn * turn * abs(regime.drive) < limit:
        return first

    # The force d sin(omega t) - k q leaves its range at the upper limit, and its negative at the lower one.
    for sign in (1.0, -1.0):
        drive = sign * regime.drive
        level = (limit + sign * spring) / drive
        side = 1.0 if drive > 0 else -1.0
        passing = find_passing(side * start.sine, side * start.cosine, side * level, regime.omega)
        if passing < time:
            time = passing
            first = Event(passing, sign)
    return first


@njit(**NJIT_KERNEL)
def find_event(regime, point, contact, rest, start, end, dt):
    """Return the first `Event` in a step of a point that is not rigid at rest.

    Parameters
    ----------
    regime : Regime
    point : Point
    contact : Contact
        State of the point in the step.
    rest : float
        Slide at which the constant forces are in balance [m].
    start, end : State
        Ends of the step without an event.
    dt : float
        Duration [s].
    """
    # Slip ends where the velocity falls to 0.
    if contact.direction != 0:
        return Event(find_stop(regime, rest, start, end, dt, contact.direction), 0.0)

    # The slide of a sticking point is monotonic up to its turn, which is an event too.
    rate = start.velocity if start.velocity != 0 else start.acceleration
    turn = find_stop(regime, rest, start, end, dt, 1.0 if rate > 0 else -1.0)
    last = dt
    farthest = end.slide - contact.centre
    if turn >= 0:
        last = turn
        at = move(regime, rest, start, make_free_step(regime, turn))
        farthest = at.slide - contact.centre
    limit = point.static / point.stiffness
    if abs(farthest) <= limit:
        return Event(turn, 0.0)
    sign = 1.0 if farthest > 0 else -1.0
    yields = Goal(1.0, 0.0, 0.0, contact.centre + sign * limit)
    return Event(find_root(regime, rest, start, last, yields, -sign), sign)


@njit(**NJIT_KERNEL)
def make_instant(regime, point, contact, state):
    """Return the `Instant` of a `State`.

    Parameters
    ----------
    regime : Regime
    point : Point
    contact : Contact
    state : State
    """
    force = contact.direction * point.kinetic
    acceleration = state.acceleration
    slip = state.slide
    if point.stiffness > 0:
        if contact.direction == 0:
            force = point.stiffness * (state.slide - contact.centre)
            slip = contact.centre
        else:
            slip -= force / point.stiffness
    elif contact.direction == 0:
        force = (regime.drive * state.sine - regime.stiffness * state.slide) / point.mobility
        acceleration = 0.0
    return Instant(state.sine, state.cosine, state.slide, state.velocity, acceleration, force, slip)


@njit(**NJIT_KERNEL)
def change_contact(block, contact, event, at, is_short):
    """Return the `Contact` after an event.

    Parameters
    ----------
    block : Block
    contact : Contact
        State of the point before the event.
    event : Event
        A slip that ends or begins, or the turn of a sticking point.
    at : State
        State at the event.
    is_short : bool
        Whether a slip that ends was as short as round-off.
    """
    point = block.point
    slip = block.slip
    direction = contact.direction
    if direction == 0:
        return Contact(event.direction, contact.centre)
    if point.stiffness > 0:
        room = 1 - MIN_SLIP_TIME if is_short else 1.0
        return Contact(0.0, at.slide - direction * room * point.static / point.stiffness)
    hold = (slip.drive * at.sine - slip.stiffness * at.slide) / point.mobility
    if abs(hold) <= point.static:
        return Contact(0.0, at.slide)
    return Contact(1.0 if hold > 0 else -1.0, at.slide)


@njit(**NJIT_KERNEL)
def start(block, now):
    """Set the state of a case at the start in `now`, whose slide and velocity are known.

    A rigid point that moves slips in the direction of its velocity.
    """
    now[Now.SLIP] = now[Now.SLIDE]
    if block.point.stiffness == 0 and now[Now.VELOCITY] != 0:
        now[Now.DIRECTION] = 1.0 if now[Now.VELOCITY] > 0 else -1.0
        now[Now.FORCE] = now[Now.DIRECTION] * block.point.kinetic


@njit(**NJIT_KERNEL)
def advance(block, left, n_events, observes, now, seen):
    """Advance a case by a step, or up to the event in it, and return the `Piece`.

    Parameters
    ----------
    block : Block
    left : float
        Time to the end of the cycle [s].
    n_events : int
        Number of steps in a row that ended with an event.
    observes : bool
        Whether the step belongs to the window.
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    point = block.point
    contact = Contact(now[Now.DIRECTION], now[Now.SLIP])
    sticks = contact.direction == 0
    is_held = sticks and point.stiffness == 0
    regime = block.stick if sticks else block.slip
    if sticks:
        rest = point.mobility * point.stiffness * contact.centre / regime.stiffness
    else:
        rest = -point.mobility * contact.direction * point.kinetic / regime.stiffness
    q = now[Now.SLIDE]
    begin = complete(regime, rest, now[Now.SINE], now[Now.COSINE], q, now[Now.VELOCITY])

    # State after the step as if there were no event
    dt = block.step
    free = block.stick_step if sticks else block.slip_step
    if left < (1 + STEP_ROUND_OFF) * dt:
        dt = left
        free = make_free_step(regime, dt)
    end = move(regime, rest, begin, free)
    event = Event(-1.0, 0.0)
    if n_events < MAX_EVENTS:
        if is_held:
            event = find_release(regime, point, begin, end, dt)
        else:
            event = find_event(regime, point, contact, rest, begin, end, dt)

    # The piece ends at the event.
    after = contact
    if event.time >= 0:
        dt = min(event.time, dt)
        end = move(regime, rest, begin, make_free_step(regime, dt))
        if not (sticks and event.direction != 0):
            end = State(end.sine, end.cosine, end.slide, 0.0, end.acceleration)
        is_short = dt < MIN_SLIP_TIME * block.step
        after = change_contact(block, contact, event, end, is_short)
    if is_held:
        end = State(end.sine, end.cosine, q, 0.0, 0.0)
    first = make_instant(regime, point, contact, begin)
    last = make_instant(regime, point, contact, end)

    end_force = last.force
    if is_held:
        # Rigid friction at rest takes many values.
        end_force = nan
    elif point.stiffness == 0 and event.time >= 0:
        # At a reversal it jumps from one sign to the other.
        end_force = nan if after.direction == 0 else 0.0

    # Force and slide are proportional in a piece.
    work = 0.5 * (first.force + last.force) * (last.slide - first.slide)
    piece = Piece(first, last, dt, work, end_force)
    if observes:
        case = block.case
        observe_piece(piece, case, seen)
        motion = Motion(case, block.law, Branch(q, contact.direction, 1.0, inf))
        observe_motion(piece, motion, 0.0 if is_held else case[Number.OUTPUT], seen)
    store_instant(last, now)
    now[Now.DIRECTION] = after.direction
    if after.direction == 0:
        now[Now.SLIP] = after.centre
    return piece
