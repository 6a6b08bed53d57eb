"""What is observed of a case of one mode and one point, piece by piece of its motion (compiled).

A piece lies between two instants, at which slide, velocity and acceleration are known. The slide between them is the
polynomial of order 5 through them, whose integrals have errors of order 6 in the length of the piece. A piece ends where
the velocity changes its sign, or where the acceleration jumps.

`case`, `now`, `seen` and `loop` are rows of one case, see `case_rows`.
"""

from math import cos, nan, pi, sin
from typing import NamedTuple

import numpy as np

from ..compiled.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..compiled.jit import njit
from .case_rows import Loop, Now, Number, Seen
from .law_rows import Law, LawNumber
from .smooth_laws_kernels import Branch, PointLaw, Step, find_force, find_share

N_READ = 2  # measured cycles of a motion that repeats
STEP_ROUND_OFF = 1e-9  # remainder of a cycle relative to a step that belongs to the step
N_PARABOLAS = 3  # further parabolas for an extreme of force or acceleration, each four times as narrow as the last
SAME_SLIDE = 1e-12  # relative difference of slides that is round-off
STICK_SHARE = 0.5  # irreversible part of the motion from which a point slips
# Steps of the Illinois method for the instant at which slip begins, ends or turns
MAX_LEVEL_STEPS = 12
LEVEL_TOLERANCE = 1e-4  # tolerance of this instant relative to the piece


class Instant(NamedTuple):
    """State of a case at an instant; at a jump, the values on the side of the piece.

    - sine, cosine: of the phase of the drive
    - slide, velocity, acceleration: relative displacement [m] and its rates [m/s], [m s-2]
    - force: friction force [N]
    - slip: irreversible part of the slide [m]
    """

    sine: float
    cosine: float
    slide: float
    velocity: float
    acceleration: float
    force: float
    slip: float


class Piece(NamedTuple):
    """Piece of a motion.

    - first, last: its ends
    - duration: [s]
    - work: friction work [J]
    - end_force: friction force [N] that counts if the slide is an extreme at the end, NaN if it is unknown
    """

    first: Instant
    last: Instant
    duration: float
    work: float
    end_force: float


class Motion(NamedTuple):
    """Motion of a case in a piece.

    - case (12,): numbers of the case, in the order of `case_rows.Number`
    - law: numbers of its law, and its memory at the start of the piece
    - branch: curve of the law in the piece
    """

    case: np.ndarray
    law: PointLaw
    branch: Branch


class Vertex(NamedTuple):
    """Extreme of a parabola through three equally spaced values.

    - is_between: whether it lies between them
    - offset: its distance from the middle, relative to the spacing
    - largest: largest magnitude of the parabola between the outer values
    """

    is_between: bool
    offset: float
    largest: float


class Weights(NamedTuple):
    """Contribution of an instant to the integral of slide times exp(-i w t), by exp(-i w t) there [m s]."""

    real: float
    imaginary: float


@njit(**NJIT_KERNEL)
def store_instant(instant, now):
    """Store an `Instant` in the state of a case, `now` (18,) in the order of `case_rows.Now`."""
    now[Now.SINE] = instant.sine
    now[Now.COSINE] = instant.cosine
    now[Now.SLIDE] = instant.slide
    now[Now.VELOCITY] = instant.velocity
    now[Now.FORCE] = instant.force
    now[Now.SLIP] = instant.slip


@njit(**NJIT_KERNEL)
def turn_phase(instant, turn):
    """Return sine and cosine of the phase of the drive at an angle `turn` [rad] after an `Instant`."""
    c = cos(turn)
    s = sin(turn)
    return instant.sine * c + instant.cosine * s, instant.cosine * c - instant.sine * s


@njit(**NJIT_KERNEL)
def find_vertex(before, middle, after):
    """Return the `Vertex` of a parabola.

    Parameters
    ----------
    before, middle, after : float
        Three equally spaced values.
    """
    largest = max(abs(before), abs(middle), abs(after))
    bend = before - 2 * middle + after
    tilt = after - before
    if abs(tilt) >= 2 * abs(bend):
        return Vertex(False, 0.0, largest)
    return Vertex(True, -0.5 * tilt / bend, max(largest, abs(middle - tilt * tilt / (8 * bend))))


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
def probe(piece, part, motion):
    """Return the `Instant` within a piece, whose slip is not known.

    Slide and velocity are those of the polynomial of order 5, and force and acceleration those that follow from them.

    Parameters
    ----------
    piece : Piece
    part : float
        Time since the start relative to the duration.
    motion : Motion
    """
    first = piece.first
    last = piece.last
    dt = piece.duration
    law = motion.law

    # Changes of slide, velocity and acceleration beyond those at constant acceleration, as displacements [m]
    velocity = dt * first.velocity
    acceleration = dt * dt * first.acceleration
    change = last.slide - first.slide
    slide_change = change - velocity - 0.5 * acceleration
    velocity_change = dt * last.velocity - velocity - acceleration
    half_change = 0.5 * (dt * dt * last.acceleration - acceleration)
    cubic = 10 * slide_change - 4 * velocity_change + half_change
    quartic = 7 * velocity_change - 15 * slide_change - 2 * half_change
    quintic = 6 * slide_change - 3 * velocity_change + half_change
    bend = part * (cubic + part * (quartic + part * quintic))
    dq = part * (velocity + part * (0.5 * acceleration + bend))
    slope = part * (3 * cubic + part * (4 * quartic + part * 5 * quintic))
    v = (velocity + part * (acceleration + slope)) / dt

    # The force of a law that is linear between events is linear in the slide.
    if law.numbers[LawNumber.LAW] <= Law.JENKINS:
        force = first.force
        if change != 0:
            force += (last.force - first.force) * dq / change
    else:
        force = find_force(law, Step(dq, part * dt, first.velocity, v), False)
    sine, cosine = turn_phase(first, motion.case[Number.OMEGA] * part * dt)
    return make_instant(sine, cosine, first.slide + dq, v, force, 0.0, motion.case)


@njit(**NJIT_KERNEL)
def find_level(level, shares, piece, motion):
    """Return the fraction of a piece at which the irreversible part of the motion passes a level, by the Illinois method.

    Parameters
    ----------
    level : float
        The level.
    shares : (float, float)
        Irreversible part of the motion at both ends of the piece.
    piece : Piece
    motion : Motion

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
        at = probe(piece, part, motion)
        miss = find_share(at, motion.branch, motion.law.numbers) - level
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
def read_signal(at, weights):
    """Return the sum of force [N], acceleration of the slide and sine of the drive at an `Instant` by their weights."""
    return weights[0] * at.force + weights[1] * at.acceleration + weights[2] * at.sine


@njit(**NJIT_KERNEL)
def find_peak(piece, weights, motion):
    """Return the largest magnitude in a piece of a sum of force, acceleration of the slide and sine of the drive.

    The parabola through the middle shows an extreme between the ends.

    Parameters
    ----------
    piece : Piece
    weights : (float, float, float)
        Weights of force, acceleration and sine.
    motion : Motion
    """
    before = read_signal(piece.first, weights)
    after = read_signal(piece.last, weights)
    peak = max(abs(before), abs(after))
    half = 0.5
    centre = half
    vertex = find_vertex(before, read_signal(probe(piece, centre, motion), weights), after)
    if not vertex.is_between:
        return peak

    for _ in range(N_PARABOLAS):
        centre += half * vertex.offset
        half *= 0.25
        centre = min(max(centre, (1 + STEP_ROUND_OFF) * half), 1 - half)
        before = read_signal(probe(piece, centre - half, motion), weights)
        middle = read_signal(probe(piece, centre, motion), weights)
        after = read_signal(probe(piece, centre + half, motion), weights)
        vertex = find_vertex(before, middle, after)
    return max(peak, vertex.largest)


@njit(**NJIT_KERNEL)
def weigh(instant, rest, dt, omega):
    """Return the `Weights` of an end of a piece, by the rule that is exact for polynomials of order 5.

    Parameters
    ----------
    instant : Instant
        The end.
    rest : float
        Slide beyond which the slide is integrated [m].
    dt : float
        Duration of the piece [s], negative at its last instant.
    omega : float
        Circular frequency w [rad/s]; with 0 the integral is that of the slide.
    """
    size = abs(dt)
    half = 0.5 * size
    tilt = size * dt / 10
    bend = size * dt * dt / 120
    q = instant.slide - rest
    v = instant.velocity
    real = half * q + tilt * v + bend * (instant.acceleration - omega * omega * q)
    return Weights(real, -omega * (tilt * q + 2 * bend * v))


@njit(**NJIT_KERNEL)
def observe_extreme(q, force, is_turn, now, loop):
    """Update the extremes of the slide in the cycle.

    Parameters
    ----------
    q, force : float
        A slide [m], and the friction force there [N].
    is_turn : bool
        Whether the motion turns there. The force is then that of the extreme also if a slide just before was the same up
        to round-off.
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    margin = SAME_SLIDE * abs(q) if is_turn else 0.0
    if q > now[Now.MAX] - margin:
        now[Now.MAX] = max(q, now[Now.MAX])
        loop[Loop.FORCE_AT_MAX] = force
    if q < now[Now.MIN] + margin:
        now[Now.MIN] = min(q, now[Now.MIN])
        loop[Loop.FORCE_AT_MIN] = force


@njit(**NJIT_KERNEL)
def add_piece(piece, case, now, loop):
    """Add a piece to energies, phasor and extremes of a case in `now`, and to the forces at the extremes in `loop`.

    Parameters
    ----------
    piece : Piece
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    first = piece.first
    last = piece.last
    dt = piece.duration
    # Energies of damper, by Simpson's rule, friction and mode; that of the drive follows from the phasor of the cycle. The
    # velocity of a piece has one sign, and is 0 at both ends of a short slip.
    v = first.velocity
    end = last.velocity
    slide = last.slide - first.slide
    middle = 1.5 * slide / dt - 0.25 * (v + end) if dt > 0 else 0.0
    squares = (v * v + 4 * middle * middle + end * end) / 6
    now[Now.VISCOUS] += case[Number.DAMPING] * dt * squares
    now[Now.FRICTION] += case[Number.MOBILITY] * piece.work
    energy = 0.5 * (end * end + case[Number.STIFFNESS] * last.slide * last.slide)
    now[Now.STORED] = max(now[Now.STORED], energy)
    power = abs(case[Number.DRIVE]) * (abs(first.sine) + abs(last.sine))
    now[Now.POWER] += 0.5 * power * abs(slide)

    # Phasor and extremes. The integral of a slide at rest is exact, so that it does no work.
    omega = case[Number.OMEGA]
    rest = first.slide
    begin = weigh(first, rest, dt, omega)
    stop = weigh(last, rest, -dt, omega)
    now[Now.COS] += rest * (last.sine - first.sine) / omega
    now[Now.SIN] -= rest * (last.cosine - first.cosine) / omega
    now[Now.COS] += begin.real * first.cosine + begin.imaginary * first.sine
    now[Now.COS] += stop.real * last.cosine + stop.imaginary * last.sine
    now[Now.SIN] += begin.real * first.sine - begin.imaginary * first.cosine
    now[Now.SIN] += stop.real * last.sine - stop.imaginary * last.cosine
    observe_extreme(last.slide, piece.end_force, end == 0, now, loop)


@njit(**NJIT_KERNEL)
def add_third_harmonic(instant, dt, omega, seen):
    """Add the part of an end of a piece to the integrals of slide, and of slide times cos and sin of 3 omega t, in `seen`.

    Parameters
    ----------
    instant : Instant
        The end.
    dt : float
        Duration of the piece [s], negative at its last instant.
    omega : float
        Circular frequency of the drive [rad/s].
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    c = instant.cosine
    s = instant.sine
    cosine = c * (4 * c * c - 3)
    sine = s * (3 - 4 * s * s)
    part = weigh(instant, 0.0, dt, 3 * omega)
    seen[Seen.COS_3] += part.real * cosine + part.imaginary * sine
    seen[Seen.SIN_3] += part.real * sine - part.imaginary * cosine
    seen[Seen.SLIDE] += weigh(instant, 0.0, dt, 0.0).real


@njit(**NJIT_KERNEL)
def observe_piece(piece, case, seen):
    """Add a piece of the window to `seen`: third harmonic, mean slide, work, and extremes of force and slip at its ends.

    Parameters
    ----------
    piece : Piece
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    first = piece.first
    last = piece.last
    add_third_harmonic(first, piece.duration, case[Number.OMEGA], seen)
    add_third_harmonic(last, -piece.duration, case[Number.OMEGA], seen)
    seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], abs(first.force), abs(last.force))
    seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], last.slip)
    seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], last.slip)

    # The work check compares the exact work with the trapezoidal rule over the pieces, relative to the work that passed
    # through the point in either direction.
    seen[Seen.WORK] += piece.work
    seen[Seen.SAMPLED] += 0.5 * (first.force + last.force) * (last.slide - first.slide)
    seen[Seen.PASSED] += abs(piece.work)


@njit(**NJIT_KERNEL)
def find_time_above(level, shares, crossing):
    """Return the fraction of a piece in which the irreversible part of the motion is above a level.

    Parameters
    ----------
    level : float
        The level.
    shares : (float, float)
        Irreversible part at both ends of the piece.
    crossing : float
        Fraction of the piece after which it passes the level, if it does.
    """
    begin, end = shares
    if (begin > level) == (end > level):
        return 1.0 if begin > level else 0.0
    return crossing if begin > level else 1 - crossing


@njit(**NJIT_KERNEL)
def observe_stick(first, shares, crossings, turn, seen):
    """Add the phase that passes in a piece during stick, and the phase at which slip starts, to `seen`.

    A point sticks while the irreversible part of its motion lies between -STICK_SHARE and STICK_SHARE; after a turn it may
    be negative. Slip starts where it rises above this level, in a piece or by a jump between two pieces.

    Parameters
    ----------
    first : Instant
        Start of the piece.
    shares : (float, float)
        Irreversible part of the motion at both ends of the piece.
    crossings : (float, float)
        Fractions of the piece after which it passes -STICK_SHARE and STICK_SHARE, if it does.
    turn : float
        Phase of the drive that passes [rad].
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    begin, end = shares
    stuck = find_time_above(-STICK_SHARE, shares, crossings[0])
    stuck -= find_time_above(STICK_SHARE, shares, crossings[1])
    seen[Seen.STUCK] += stuck * turn

    jumps = seen[Seen.SHARE] <= STICK_SHARE < begin
    if jumps or begin <= STICK_SHARE < end:
        sine, cosine = turn_phase(first, 0.0 if jumps else crossings[1] * turn)
        seen[Seen.STARTS] += 1
        seen[Seen.SLIP_START_PHASE_COS] += cosine * cosine - sine * sine
        seen[Seen.SLIP_START_PHASE_SIN] += 2 * sine * cosine
    seen[Seen.SHARE] = end


@njit(**NJIT_KERNEL)
def observe_motion(piece, motion, output, seen):
    """Add a piece of the window to `seen`: its stick, turns of the slip, and extremes of acceleration and force inside.

    Parameters
    ----------
    piece : Piece
    motion : Motion
    output : float
        Acceleration of the output per that of the slide, 0 while a rigid point is at rest.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    first = piece.first
    case = motion.case
    numbers = motion.law.numbers
    dt = piece.duration
    if dt == 0:
        return

    # Stick ends and slip turns where the irreversible part of the motion passes a level.
    begin = find_share(first, motion.branch, numbers)
    shares = begin, find_share(piece.last, motion.branch, numbers)
    low = find_level(-STICK_SHARE, shares, piece, motion)
    high = find_level(STICK_SHARE, shares, piece, motion)
    observe_stick(first, shares, (low, high), case[Number.OMEGA] * dt, seen)
    if begin < 0:
        # The irreversible slide turns where there is no force, and so no stretch.
        turn = find_level(0.0, shares, piece, motion)
        if turn >= 0:
            slip = probe(piece, turn, motion).slide
            seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], slip)
            seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], slip)

    peak = find_peak(piece, (0.0, output, case[Number.BASE]), motion)
    seen[Seen.MAX_ACCELERATION] = max(seen[Seen.MAX_ACCELERATION], peak)
    # Forces of other laws have their extremes at the ends of pieces.
    if numbers[LawNumber.LAW] == Law.TANH or numbers[LawNumber.LAW] == Law.LUGRE:
        peak = find_peak(piece, (1.0, 0.0, 0.0), motion)
        seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], peak)


@njit(**NJIT_KERNEL)
def start_cycle(now, seen, loop):
    """Reset what is observed over a cycle. An extreme at the border of two cycles has no force of its own.

    Parameters
    ----------
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    now[Now.SINE] = 0.0
    now[Now.COSINE] = 1.0
    now[Now.MIN] = now[Now.MAX] = now[Now.SLIDE]
    now[Now.COS] = now[Now.SIN] = 0.0
    loop[Loop.FORCE_AT_MIN] = loop[Loop.FORCE_AT_MAX] = nan
    seen[Seen.SLIDE] = 0.0


@njit(**NJIT_KERNEL)
def start_window(now, seen):
    """Reset `seen`, what is observed of a case, at the start of the last cycles, over which its measures are taken."""
    seen[:] = 0.0
    seen[Seen.MIN_SLIP] = seen[Seen.MAX_SLIP] = now[Now.SLIP]
    seen[Seen.START_SLIDE] = now[Now.SLIDE]
    seen[Seen.START_VELOCITY] = now[Now.VELOCITY]
    seen[Seen.SHARE] = 1.0  # A slip that begins with the window has no start in it.


@njit(**NJIT_KERNEL)
def end_cycle(case, now, seen, loop, history):
    """Record extremes and phasor of a cycle, and the extremes and the mean of one that is measured.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (18,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    history : (4,) array
        Smallest and largest slide [m] and the integrals for its phasor (output).
    """
    # Over a cycle the work of the drive is -omega times its amplitude times the cosine integral (integration by parts).
    now[Now.WORK_IN] -= case[Number.DRIVE] * case[Number.OMEGA] * now[Now.COS]
    seen[Seen.COS_1] += now[Now.COS]
    seen[Seen.SIN_1] += now[Now.SIN]
    seen[Seen.SPAN] += 2 * pi / case[Number.OMEGA]
    loop[Loop.SLIDE] = seen[Seen.SLIDE]
    history[0] = loop[Loop.MIN_SLIDE] = now[Now.MIN]
    history[1] = loop[Loop.MAX_SLIDE] = now[Now.MAX]
    history[2] = now[Now.COS]
    history[3] = now[Now.SIN]
    if now[Now.SLIDE] == now[Now.MAX] and now[Now.VELOCITY] > 0:
        loop[Loop.FORCE_AT_MAX] = nan  # the slide still grows: no reversal
    if now[Now.SLIDE] == now[Now.MIN] and now[Now.VELOCITY] < 0:
        loop[Loop.FORCE_AT_MIN] = nan
