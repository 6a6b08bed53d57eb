"""Many cases of one mode and one point whose law is linear between events, by exact steps in a compiled loop.

A rigid or elastic-plastic point sticks or slips. The force that keeps a rigid point at rest follows from the drive. In
the other regimes the slide q obeys q'' + c q' + k q = d sin(omega t) + constant, with the stiffness of an elastic point
in k while it sticks, so that a step is in closed form. Events, at which slip begins, stops or turns, are roots of it.
Between two nodes of the grid a velocity that changes its sign twice is found by the root of the acceleration, so that
a motion that only touches its limit is not missed. Errors are those of roots, and of the integrals of the observers.

`case`, `now`, `seen` and `loop` are rows of one case, see `case_rows`.
"""

from enum import IntEnum
from math import asin, cos, exp, nan, pi, sin, sqrt
from typing import NamedTuple

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from .case_observers_kernels import (
    Instant,
    add_piece,
    end_cycle,
    observe_acceleration,
    observe_piece,
    repeat_cycle,
    start_cycle,
    start_window,
)
from .case_rows import SAME_CASE_CYCLE, Now, Number, Seen
from .law_rows import Law

WINDOW_STEPS = 4  # steps of a measured cycle per step of another one
MAX_STEP_PHASE = 1.0  # largest phase of the vibration of a sticking point in a step [rad]
MIN_STEPS = 8  # smallest number of steps per cycle, a power of 2
MAX_STEPS = 1024  # largest number of steps per cycle, a power of 2
MAX_ROOT_STEPS = 60  # Newton steps and bisections for an event
ROOT_TOLERANCE = 1e-13  # error of the instant of an event, relative to the step
# Events in a step after which it is completed without another one: a point at its limit whose events are round-off
MAX_EVENTS = 16
# Time of a slip relative to its step below which it is round-off. The elastic point is then unloaded by this fraction of
# its limit, so that the slip is not tried again.
MIN_SLIP_TIME = 1e-9
# Distance of the lowest velocity of a parabola from 0, relative to its drop, above which a velocity that falls and rises
# again has no root
DIP_MARGIN = 0.3
# Depth of such a fall below 0 that is round-off, relative to the change of the velocity by the acceleration at the end
MIN_DIP = 1e-10
# Stretch of an elastic point at a turn, relative to that at its limit, above which the turn is an event
TURN_STRETCH = 0.8


class Goal(IntEnum):
    """What is 0 at a root: the distance of the slide from a value, the velocity or the acceleration."""

    SLIDE = 0
    VELOCITY = 1
    ACCELERATION = 2


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


class FreeStep(NamedTuple):
    """Slide and velocity after a free vibration, per slide [1], [1/s] and per velocity [s], [1] at its start."""

    slide_by_slide: float
    slide_by_velocity: float
    velocity_by_slide: float
    velocity_by_velocity: float


class State(NamedTuple):
    """Sine and cosine of the phase of the drive, slide [m], velocity [m/s] and acceleration [m s-2] at an instant."""

    sine: float
    cosine: float
    slide: float
    velocity: float
    acceleration: float


class Point(NamedTuple):
    """Law of a case, per unit of its load [N].

    - static, kinetic: friction limits [N]
    - stiffness: during stick [N/m], 0 of a rigid point
    - mobility: acceleration of the slide per friction force [1/kg]
    """

    static: float
    kinetic: float
    stiffness: float
    mobility: float


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
    return FreeStep(c + regime.decay * s, s, -regime.stiffness * s, c - regime.decay * s)


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
def move(regime, rest, start, free, sine, cosine):
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
    sine, cosine : float
        Of the phase of the drive at its end.
    """
    forced = regime.in_phase * start.sine + regime.quadrature * start.cosine
    y = start.slide - rest - forced
    rate = regime.omega * (regime.in_phase * start.cosine - regime.quadrature * start.sine)
    u = start.velocity - rate
    q = rest + regime.in_phase * sine + regime.quadrature * cosine
    q += free.slide_by_slide * y + free.slide_by_velocity * u
    v = regime.omega * (regime.in_phase * cosine - regime.quadrature * sine)
    v += free.velocity_by_slide * y + free.velocity_by_velocity * u
    return complete(regime, rest, sine, cosine, q, v)


@njit(**NJIT_CALL)
def move_for(regime, rest, start, dt):
    """Return the `State` after a time.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    start : State
        Start of the motion.
    dt : float
        The time [s].
    """
    c = cos(regime.omega * dt)
    s = sin(regime.omega * dt)
    sine = start.sine * c + start.cosine * s
    cosine = start.cosine * c - start.sine * s
    return move(regime, rest, start, make_free_step(regime, dt), sine, cosine)


@njit(**NJIT_CALL)
def find_root(regime, rest, start, last, target, kind, sign):
    """Return the time [s] at which slide, velocity or acceleration reach a value, by Newton's method in a bracket.

    Parameters
    ----------
    regime : Regime
    rest : float
        Slide at which the constant forces are in balance [m].
    start : State
        Start of the motion.
    last : float
        Time [s] at which the value lies on the other side.
    target : float
        Value of the slide [m]; velocity and acceleration are 0.
    kind : int
        Goal.SLIDE, VELOCITY or ACCELERATION.
    sign : float
        Sign of the distance from the value just after the start.
    """
    low = 0.0
    high = last
    time = 0.5 * last
    for _ in range(MAX_ROOT_STEPS):
        at = move_for(regime, rest, start, time)
        if kind == Goal.SLIDE:
            distance = at.slide - target
            rate = at.velocity
        elif kind == Goal.VELOCITY:
            distance = at.velocity
            rate = at.acceleration
        else:
            distance = at.acceleration
            rate = regime.drive * regime.omega * at.cosine
            rate -= regime.damping * at.acceleration + regime.stiffness * at.velocity
        if distance * sign > 0:
            low = time
        else:
            high = time
        following = time - distance / rate if rate != 0 else low
        if not low < following < high:
            following = 0.5 * (low + high)
        change = abs(following - time)
        time = following
        if change <= ROOT_TOLERANCE * last:
            break
    return time


@njit(**NJIT_KERNEL)
def find_dip(regime, rest, start, end, dt, sign):
    """Return the time [s] at which a velocity of one sign at both ends of a step falls to 0, or -1.

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
        Sign of the velocity.
    """
    fall = sign * start.acceleration
    if fall >= 0 or sign * end.acceleration <= 0:
        return -1.0
    part = dt * fall / (fall - sign * end.acceleration)
    lowest = sign * start.velocity + 0.5 * (1 + DIP_MARGIN) * fall * part
    if lowest > -MIN_DIP * dt * abs(end.acceleration):
        return -1.0
    part = find_root(regime, rest, start, dt, 0.0, Goal.ACCELERATION, -sign)
    if sign * move_for(regime, rest, start, part).velocity >= 0:
        return -1.0
    return find_root(regime, rest, start, part, 0.0, Goal.VELOCITY, sign)


@njit(**NJIT_KERNEL)
def find_release(regime, start, slide, limit, dt):
    """Return the time [s] at which the drive overcomes the limit of a rigid point at rest in a step of `dt` [s].

    Parameters
    ----------
    regime : Regime
    start : State
        Start of the step, in which the sine of the drive is monotonic.
    slide : float
        Slide of the point [m].
    limit : float
        Static limit per mass [m s-2] with the sign of the force.
    dt : float
        Duration [s].
    """
    sine = min(max((limit + regime.stiffness * slide) / regime.drive, -1.0), 1.0)
    cosine = sqrt(1 - sine * sine)
    half = 0.5 * regime.omega * dt
    if start.cosine * cos(half) < start.sine * sin(half):
        cosine = -cosine
    phase = asin(min(max(sine * start.cosine - cosine * start.sine, -1.0), 1.0))
    return min(max(phase / regime.omega, 0.0), dt)


@njit(**NJIT_KERNEL)
def find_event(regime, point, contact, rest, start, end, dt, is_exact):
    """Return the first `Event` in a step.

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
    is_exact : bool
        Whether each turn of a sticking point is an event.
    """
    # Slip ends where the velocity falls to 0.
    direction = contact.direction
    if direction != 0:
        if direction * end.velocity < 0:
            time = find_root(regime, rest, start, dt, 0.0, Goal.VELOCITY, direction)
        else:
            time = find_dip(regime, rest, start, end, dt, direction)
        return Event(time, 0.0)

    if point.stiffness == 0:
        # The force that keeps a rigid point at rest is monotonic in a step.
        hold = regime.drive * end.sine - regime.stiffness * end.slide
        limit = point.mobility * point.static
        if abs(hold) <= limit:
            return Event(-1.0, 0.0)
        sign = 1.0 if hold > 0 else -1.0
        return Event(find_release(regime, start, end.slide, sign * limit, dt), sign)

    # The slide of a sticking point is monotonic up to its turn.
    limit = point.static / point.stiffness
    turn = -1.0
    last = dt
    farthest = end.slide - contact.centre
    if start.velocity * end.velocity < 0:
        vertex = 0.5 * start.velocity * start.velocity * dt / (start.velocity - end.velocity)
        if is_exact or abs(start.slide + vertex - contact.centre) > TURN_STRETCH * limit:
            sign = 1.0 if start.velocity > 0 else -1.0
            turn = find_root(regime, rest, start, dt, 0.0, Goal.VELOCITY, sign)
    elif is_exact or abs(farthest) > TURN_STRETCH * limit:
        sign = 1.0 if start.velocity + end.velocity > 0 else -1.0
        turn = find_dip(regime, rest, start, end, dt, sign)
    if turn >= 0:
        last = turn
        farthest = move_for(regime, rest, start, turn).slide - contact.centre
    if abs(farthest) > limit:
        sign = 1.0 if farthest > 0 else -1.0
        time = find_root(
            regime, rest, start, last, contact.centre + sign * limit, Goal.SLIDE, -sign
        )
        return Event(time, sign)
    return Event(turn, 0.0)


@njit(**NJIT_KERNEL)
def find_rest(regime, point, contact):
    """Return the slide [m] at which the constant part of the friction force and the springs are in balance.

    Parameters
    ----------
    regime : Regime
    point : Point
    contact : Contact
    """
    if contact.direction == 0:
        return point.mobility * point.stiffness * contact.centre / regime.stiffness
    return -point.mobility * contact.direction * point.kinetic / regime.stiffness


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
def change_contact(regime, point, contact, event, at, is_short):
    """Return the `Contact` after an event.

    Parameters
    ----------
    regime : Regime
        Motion during slip.
    point : Point
    contact : Contact
        State of the point before the event.
    event : Event
        A slip that ends or begins, or the turn of a sticking point.
    at : State
        State at the event.
    is_short : bool
        Whether a slip that ends was as short as round-off.
    """
    direction = contact.direction
    if direction == 0:
        return Contact(event.direction, contact.centre)
    if point.stiffness > 0:
        room = 1 - MIN_SLIP_TIME if is_short else 1.0
        return Contact(0.0, at.slide - direction * room * point.static / point.stiffness)
    hold = (regime.drive * at.sine - regime.stiffness * at.slide) / point.mobility
    if abs(hold) <= point.static:
        return Contact(0.0, at.slide)
    return Contact(1.0 if hold > 0 else -1.0, at.slide)


@njit(**NJIT_KERNEL)
def march_cycle(waves, n_steps, observes, regimes, point, case, now, seen, loop):
    """March a case over a cycle of the drive.

    Parameters
    ----------
    waves : (n + 1, 2) array
        Sines and cosines of a cycle on a grid, of which a step takes every (n/n_steps)-th.
    n_steps : int
        Steps of the cycle, a multiple of 4.
    observes : bool
        Whether the cycle is measured.
    regimes : (Regime, Regime)
        Motion during slip and during stick.
    point : Point
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    slip, stick = regimes
    step = 2 * pi / slip.omega / n_steps
    free_slip = make_free_step(slip, step)
    free_stick = make_free_step(stick, step)
    stride = (waves.shape[0] - 1) // n_steps
    contact = Contact(now[Now.DIRECTION], now[Now.SLIP])
    state = State(0.0, 1.0, now[Now.SLIDE], now[Now.VELOCITY], 0.0)
    is_rigid = point.stiffness == 0
    start_cycle(now, seen, loop)

    for node in range(n_steps):
        sine = waves[(node + 1) * stride, 0]
        cosine = waves[(node + 1) * stride, 1]
        left = step
        n_events = 0
        while left > 0:
            sticks = contact.direction == 0
            regime = stick if sticks else slip
            rest = find_rest(regime, point, contact)
            state = complete(regime, rest, state.sine, state.cosine, state.slide, state.velocity)

            # State at the node as if there were no event
            if sticks and is_rigid:
                end = State(sine, cosine, state.slide, 0.0, 0.0)
            else:
                free = free_stick if sticks else free_slip
                if n_events > 0:
                    free = make_free_step(regime, left)
                end = move(regime, rest, state, free, sine, cosine)
            event = Event(-1.0, 0.0)
            if n_events < MAX_EVENTS:
                event = find_event(regime, point, contact, rest, state, end, left, observes)

            # The piece ends at the event.
            first = make_instant(regime, point, contact, state)
            dt = left
            after = contact
            end_force = nan
            if event.time >= 0:
                dt = min(event.time, left)
                end = move_for(regime, rest, state, dt)
                if sticks and is_rigid:
                    end = State(end.sine, end.cosine, state.slide, 0.0, 0.0)
                elif not (sticks and event.direction != 0):
                    end = State(end.sine, end.cosine, end.slide, 0.0, end.acceleration)
                is_short = dt < MIN_SLIP_TIME * step
                after = change_contact(slip, point, contact, event, end, is_short)
            last = make_instant(regime, point, contact, end)
            if not is_rigid:
                end_force = last.force
            elif not sticks:
                # Rigid friction at rest takes many values; at a reversal it jumps from one sign to the other.
                end_force = last.force if event.time < 0 else 0.0
                if event.time >= 0 and after.direction == 0:
                    end_force = nan

            # Force and slide are proportional in a piece.
            work = 0.5 * (first.force + last.force) * (last.slide - first.slide)
            add_piece(first, last, dt, work, end_force, case, now, loop)
            if observes:
                observe_piece(first, last, dt, work, case, seen)
                observe_acceleration(first, last, dt, case, seen)
                if sticks:
                    seen[Seen.STUCK] += slip.omega * dt
                    if after.direction != 0:
                        seen[Seen.STARTS] += 1
                        c = end.cosine
                        s = end.sine
                        seen[Seen.SLIP_START_PHASE_COS] += c * c - s * s
                        seen[Seen.SLIP_START_PHASE_SIN] += 2 * s * c
            state = end
            contact = after
            n_events += 1
            left -= dt

    # The state at the end of the cycle
    last = make_instant(stick if contact.direction == 0 else slip, point, contact, state)
    now[Now.SLIDE] = state.slide
    now[Now.VELOCITY] = state.velocity
    now[Now.FORCE] = last.force
    now[Now.SLIP] = last.slip
    now[Now.DIRECTION] = contact.direction


@njit(cache=True, **NJIT_KERNEL)
def march_cases(steps, waves, parameters, numbers, nows, seens, histories, loops):
    """March cases over their cycles.

    Parameters
    ----------
    steps : int
        Fewest steps per cycle.
    waves : (MAX_STEPS + 1, 2) array
        Sines and cosines of a cycle.
    parameters : (c, 12) array
        Numbers of the cases, in the order of `case_rows.Number`.
    numbers : (k, c) array
        Numbers of the laws. Row 0 is the `Law`.
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
    for j in range(parameters.shape[0]):
        case = parameters[j]
        now = nows[j]
        seen = seens[j]
        load = case[Number.LOAD]
        mobility = case[Number.MOBILITY]
        limit = numbers[1, j] * load
        if numbers[0, j] == Law.COULOMB:
            point = Point(limit, numbers[2, j] * load, 0.0, mobility)
        else:
            point = Point(limit, limit, limit / numbers[2, j], mobility)
        slip = make_regime(case, 0.0)
        stick = make_regime(case, mobility * point.stiffness)

        # The vibration of a sticking point is resolved. The number of steps divides that of the grid.
        phase = 2 * pi * stick.frequency / slip.omega
        fewest = min(max(float(steps), phase / MAX_STEP_PHASE), MAX_STEPS / WINDOW_STEPS)
        n_steps = MIN_STEPS
        while n_steps < fewest:
            n_steps *= 2

        # Initial state; a rigid point that moves slips in the direction of its velocity.
        now[Now.SLIDE] = now[Now.SLIP] = case[Number.SLIDE]
        now[Now.VELOCITY] = case[Number.VELOCITY]
        if point.stiffness == 0 and now[Now.VELOCITY] != 0:
            now[Now.DIRECTION] = 1.0 if now[Now.VELOCITY] > 0 else -1.0
            now[Now.FORCE] = now[Now.DIRECTION] * point.kinetic
        now[Now.STORED] = 0.5 * (
            now[Now.VELOCITY] ** 2 + case[Number.STIFFNESS] * now[Now.SLIDE] ** 2
        )

        n_cycles = int(case[Number.CYCLES])
        first = n_cycles - int(case[Number.WINDOW])
        cycle = 0
        while cycle < n_cycles:
            observes = cycle >= first
            if cycle == first:
                start_window(now, seen)
            begin = now[Now.SLIDE], now[Now.VELOCITY], now[Now.FORCE]
            sums = now[Now.WORK_IN], now[Now.POWER], now[Now.VISCOUS], now[Now.FRICTION]
            loop = loops[j, max(loops.shape[1] - n_cycles + cycle, 0)]
            count = n_steps * WINDOW_STEPS if observes else n_steps
            march_cycle(waves, count, observes, (slip, stick), point, case, now, seen, loop)
            end_cycle(case, now, seen, loop, histories[j, cycle])
            cycle += 1
            if not observes:
                repeated = repeat_cycle(
                    cycle, SAME_CASE_CYCLE, begin, sums, case, now, histories[j]
                )
                cycle += repeated
                first = cycle if repeated > 0 else first

        if point.stiffness > 0:
            now[Now.ELASTIC] = 0.5 * now[Now.FORCE] * now[Now.FORCE] / point.stiffness
