"""What is observed of a case of one mode and one point, piece by piece of its motion (compiled).

A piece lies between two instants, at which slide, velocity and acceleration are known. The slide between them is the
polynomial of order 5 through them, whose integrals and extremes have errors of order 6 in the length of the piece. A piece
ends where the velocity changes its sign, or where the acceleration jumps.

`case`, `now`, `seen` and `loop` are rows of one case, see `case_rows`.
"""

from math import cos, nan, sin
from typing import NamedTuple

from ..compiled.flags_kernels import NJIT_KERNEL
from ..compiled.jit import njit
from .case_rows import Loop, Now, Number, Seen

N_ROOT_STEPS = 4  # Newton steps for an extreme of a polynomial, from that of a parabola
N_READ = 2  # measured cycles of a motion that repeats


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


class Polynomial(NamedTuple):
    """Slide of a piece [m] by the powers 1 to 5 of the elapsed fraction, beyond the slide at its start."""

    first: float
    second: float
    third: float
    fourth: float
    fifth: float


class Rise(NamedTuple):
    """Slide beyond that at the start of a piece [m], and its first and second derivative by the fraction of the time [m]."""

    rise: float
    rate: float
    bend: float


class Weights(NamedTuple):
    """Contribution of an instant to the integral of slide times exp(-i w t), by exp(-i w t) there [m s]."""

    real: float
    imaginary: float


@njit(**NJIT_KERNEL)
def interpolate(first, last, dt):
    """Return the `Polynomial` of a piece.

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    """
    rate = dt * first.velocity
    bend = 0.5 * dt * dt * first.acceleration
    slide = last.slide - first.slide - rate - bend
    velocity = dt * last.velocity - rate - 2 * bend
    acceleration = dt * dt * last.acceleration - 2 * bend
    return Polynomial(
        rate,
        bend,
        10 * slide - 4 * velocity + 0.5 * acceleration,
        -15 * slide + 7 * velocity - acceleration,
        6 * slide - 3 * velocity + 0.5 * acceleration,
    )


@njit(**NJIT_KERNEL)
def evaluate(first, last, dt, part):
    """Return `Rise` within a piece.

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    part : float
        Fraction of the duration.
    """
    p = interpolate(first, last, dt)
    rest = p.third + part * (p.fourth + part * p.fifth)
    rise = part * (p.first + part * (p.second + part * rest))
    slope = 3 * p.third + part * (4 * p.fourth + part * 5 * p.fifth)
    rate = p.first + part * (2 * p.second + part * slope)
    bend = 2 * p.second + part * (6 * p.third + part * (12 * p.fourth + part * 20 * p.fifth))
    return Rise(rise, rate, bend)


@njit(**NJIT_KERNEL)
def find_turn(first, last, dt):
    """Return the fraction of a piece after which its velocity changes the sign.

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    """
    part = first.velocity / (first.velocity - last.velocity)
    for _ in range(N_ROOT_STEPS):
        at = evaluate(first, last, dt, part)
        if at.bend != 0:
            part = min(max(part - at.rate / at.bend, 0.0), 1.0)
    return part


@njit(**NJIT_KERNEL)
def weigh(instant, dt, omega):
    """Return the `Weights` of an end of a piece, by the rule that is exact for polynomials of order 5.

    Parameters
    ----------
    instant : Instant
        The end.
    dt : float
        Duration of the piece [s], negative at its last instant.
    omega : float
        Circular frequency w [rad/s]; with 0 the integral is that of the slide.
    """
    size = abs(dt)
    half = 0.5 * size
    tilt = size * dt / 10
    bend = size * dt * dt / 120
    q = instant.slide
    v = instant.velocity
    real = half * q + tilt * v + bend * (instant.acceleration - omega * omega * q)
    return Weights(real, -omega * (tilt * q + 2 * bend * v))


@njit(**NJIT_KERNEL)
def observe_extreme(q, force, now, loop):
    """Update the extremes of the slide in the cycle.

    Parameters
    ----------
    q, force : float
        A slide [m], and the friction force there [N].
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    if q > now[Now.MAX]:
        now[Now.MAX] = q
        loop[Loop.FORCE_AT_MAX] = force
    if q < now[Now.MIN]:
        now[Now.MIN] = q
        loop[Loop.FORCE_AT_MIN] = force


@njit(**NJIT_KERNEL)
def add_piece(first, last, dt, work, end_force, case, now, loop):
    """Add a piece to energies, phasor and extremes of a case in `now`, and to the forces at the extremes in `loop`.

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    work : float
        Friction work of the piece [J].
    end_force : float
        Friction force [N] that counts if the slide is an extreme at the end of the piece, NaN if it is unknown.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
    # Energies of damper, friction and mode; that of the drive follows from the phasor of the cycle.
    v = first.velocity
    end = last.velocity
    squares = 0.5 * (v * v + end * end)
    squares += dt / 6 * (v * first.acceleration - end * last.acceleration)
    now[Now.VISCOUS] += case[Number.DAMPING] * dt * squares
    now[Now.FRICTION] += case[Number.MOBILITY] * work
    energy = 0.5 * (end * end + case[Number.STIFFNESS] * last.slide * last.slide)
    now[Now.STORED] = max(now[Now.STORED], energy)
    power = abs(first.sine * v) + abs(last.sine * end)
    now[Now.POWER] += 0.5 * dt * abs(case[Number.DRIVE]) * power

    # Phasor and extremes
    begin = weigh(first, dt, case[Number.OMEGA])
    stop = weigh(last, -dt, case[Number.OMEGA])
    now[Now.COS] += begin.real * first.cosine + begin.imaginary * first.sine
    now[Now.COS] += stop.real * last.cosine + stop.imaginary * last.sine
    now[Now.SIN] += begin.real * first.sine - begin.imaginary * first.cosine
    now[Now.SIN] += stop.real * last.sine - stop.imaginary * last.cosine
    if v * end < 0:
        # Measured pieces end at a turn, so that its force is not needed.
        turn = evaluate(first, last, dt, find_turn(first, last, dt))
        observe_extreme(first.slide + turn.rise, nan, now, loop)
    observe_extreme(last.slide, end_force, now, loop)


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
    part = weigh(instant, dt, 3 * omega)
    seen[Seen.COS_3] += part.real * cosine + part.imaginary * sine
    seen[Seen.SIN_3] += part.real * sine - part.imaginary * cosine
    seen[Seen.SLIDE] += weigh(instant, dt, 0.0).real


@njit(**NJIT_KERNEL)
def observe_piece(first, last, dt, work, case, seen):
    """Add a piece of the window to `seen`: third harmonic, mean slide, work, and extremes of force and slip at its ends.

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    work : float
        Friction work of the piece [J].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    add_third_harmonic(first, dt, case[Number.OMEGA], seen)
    add_third_harmonic(last, -dt, case[Number.OMEGA], seen)
    seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], abs(first.force), abs(last.force))
    seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], last.slip)
    seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], last.slip)

    # The work check compares the exact work with the trapezoidal rule over the pieces, relative to the work that passed
    # through the point in either direction.
    seen[Seen.WORK] += work
    seen[Seen.SAMPLED] += 0.5 * (first.force + last.force) * (last.slide - first.slide)
    seen[Seen.PASSED] += abs(work)


@njit(**NJIT_KERNEL)
def observe_acceleration(first, last, dt, case, seen):
    """Update the largest acceleration of the output, that of the base included, `Seen.MAX_ACCELERATION` [m s-2].

    Parameters
    ----------
    first, last : Instant
        Ends of the piece.
    dt : float
        Duration [s].
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    """
    base = case[Number.BASE]
    output = case[Number.OUTPUT]
    omega = case[Number.OMEGA]
    peak = max(
        abs(output * first.acceleration + base * first.sine),
        abs(output * last.acceleration + base * last.sine),
    )

    # Between the ends the acceleration has an extreme where its rate per fraction of the piece changes the sign.
    p = interpolate(first, last, dt)
    scale = output / (dt * dt)
    turn = omega * dt
    begin = 6 * scale * p.third + base * turn * first.cosine
    end = scale * (6 * p.third + 24 * p.fourth + 60 * p.fifth) + base * turn * last.cosine
    if begin * end < 0:
        part = begin / (begin - end)
        for _ in range(N_ROOT_STEPS):
            c = cos(part * turn)
            s = sin(part * turn)
            sine = first.sine * c + first.cosine * s
            cosine = first.cosine * c - first.sine * s
            value = 2 * p.second + part * (
                6 * p.third + part * (12 * p.fourth + part * 20 * p.fifth)
            )
            peak = max(peak, abs(scale * value + base * sine))
            rate = scale * (6 * p.third + part * (24 * p.fourth + part * 60 * p.fifth))
            rate += base * turn * cosine
            slope = scale * (24 * p.fourth + part * 120 * p.fifth) - base * turn * turn * sine
            if slope != 0:
                part = min(max(part - rate / slope, 0.0), 1.0)
    seen[Seen.MAX_ACCELERATION] = max(seen[Seen.MAX_ACCELERATION], peak)


@njit(**NJIT_KERNEL)
def start_cycle(now, seen, loop):
    """Reset what is observed over a cycle. An extreme at the border of two cycles has no force of its own.

    Parameters
    ----------
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    seen : (20,) array
        What was observed, in the order of `case_rows.Seen` (changed in place).
    loop : (5,) array
        The cycle, in the order of `case_rows.Loop` (changed in place).
    """
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


@njit(**NJIT_KERNEL)
def end_cycle(case, now, seen, loop, history):
    """Record extremes and phasor of a cycle, and the extremes and the mean of one that is measured.

    Parameters
    ----------
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (15,) array
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
    seen[Seen.SPAN] += 6.283185307179586 / case[Number.OMEGA]
    loop[Loop.SLIDE] = seen[Seen.SLIDE]
    history[0] = loop[Loop.MIN_SLIDE] = now[Now.MIN]
    history[1] = loop[Loop.MAX_SLIDE] = now[Now.MAX]
    history[2] = now[Now.COS]
    history[3] = now[Now.SIN]
    if now[Now.SLIDE] == now[Now.MAX] and now[Now.VELOCITY] > 0:
        loop[Loop.FORCE_AT_MAX] = nan  # the slide still grows: no reversal
    if now[Now.SLIDE] == now[Now.MIN] and now[Now.VELOCITY] < 0:
        loop[Loop.FORCE_AT_MIN] = nan


@njit(**NJIT_KERNEL)
def repeat_cycle(cycle, same, begin, sums, case, now, history):
    """Return the number of cycles after one that ends as it began which repeat it, without being computed.

    The last N_READ cycles are computed, because the measures are taken over them.

    Parameters
    ----------
    cycle : int
        Number of cycles that are computed.
    same : float
        Change of the cycle relative to the range of the motion, below which it repeats.
    begin : tuple of float
        Slide [m], velocity [m/s] and force [N] at the start of the last cycle.
    sums : tuple of float
        The rows WORK_IN, POWER, VISCOUS and FRICTION of `now` there.
    case : (12,) array
        Numbers of the case, in the order of `case_rows.Number`.
    now : (15,) array
        State of the case, in the order of `case_rows.Now` (changed in place).
    history : (n, 4) array
        Extremes and phasor of every cycle (changed in place).
    """
    size = same * (now[Now.MAX] - now[Now.MIN])
    force = abs(case[Number.DRIVE]) / case[Number.MOBILITY]
    n_repeated = int(case[Number.CYCLES]) - N_READ - cycle
    if (
        n_repeated <= 0
        or abs(now[Now.SLIDE] - begin[0]) > size
        or abs(now[Now.VELOCITY] - begin[1]) > case[Number.OMEGA] * size
        or abs(now[Now.FORCE] - begin[2]) > same * force
    ):
        return 0
    for k in range(cycle, cycle + n_repeated):
        for column in range(4):
            history[k, column] = history[cycle - 1, column]
    for k in range(4):
        now[Now.WORK_IN + k] += n_repeated * (now[Now.WORK_IN + k] - sums[k])
    return n_repeated
