"""What is observed of a case of one mode and one point, piece by piece of its motion (compiled).

Integrals of the slide over a piece of a law that is linear between events are exact. Those of a smooth law are the rule of
two points that is exact for polynomials of order 5, from slide, velocity and acceleration at both ends. A piece ends where
the velocity changes its sign, or where the acceleration jumps. What lies between the ends is found by `sample`.

`case`, `energies`, `seen` and `loop` are rows of one case, see `rows`.
"""

from math import nan
from typing import NamedTuple

from ..kernel_cache.flags_kernels import NJIT_CALL, NJIT_KERNEL
from ..kernel_cache.jit import njit
from ..motion_measures import STICKING_SLIP_FRACTION
from .law_kernels import find_share
from .motion_kernels import Goal, find_rest, is_linear, locate, rotate, sample
from .rows import Energy, Law, LawNumber, Loop, Number, Seen

STEP_ROUND_OFF = 1e-9  # distance of a parabola from the ends of a piece relative to its width
N_NARROWER_PARABOLAS = 5  # further parabolas for an extreme of force or acceleration, each four times as narrow as the last
# Distance of a vertex from the middle of three points, relative to their spacing, up to which it is searched
MAX_VERTEX_OFFSET = 1.5
SAME_SLIDE = 1e-12  # relative difference of slides that is round-off


class Vertex(NamedTuple):
    """Extreme of a parabola through three equally spaced values.

    - is_near: whether it lies between them, or not far beyond, where the curve may have an extreme that is between them
    - offset: its distance from the middle, relative to the spacing
    - largest: largest magnitude of the parabola between the outer values
    """

    is_near: bool
    offset: float
    largest: float


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
    if abs(tilt) >= 2 * MAX_VERTEX_OFFSET * abs(bend):
        return Vertex(False, 0.0, largest)
    if abs(tilt) < 2 * abs(bend):
        largest = max(largest, abs(middle - tilt * tilt / (8 * bend)))
    return Vertex(True, -0.5 * tilt / bend, largest)


@njit(**NJIT_KERNEL)
def raise_wave(phase, n):
    """Return exp(i n w t) of a whole number `n` from the `phase` exp(i w t) of the drive."""
    wave = complex(1.0, 0.0)
    for _ in range(abs(n)):
        wave *= phase
    return wave if n >= 0 else wave.conjugate()


@njit(**NJIT_KERNEL)
def integrate_wave(piece, n, turn):
    """Return the integral of exp(i n w t) over the phase of the drive in a piece [rad].

    Parameters
    ----------
    piece : Piece
    n : int
        Whole number.
    turn : float
        Phase that passes [rad].
    """
    if n == 0:
        return complex(turn, 0.0)
    change = raise_wave(piece.last.phase, n) - raise_wave(piece.first.phase, n)
    return complex(change.imag / n, -change.real / n)


@njit(**NJIT_KERNEL)
def weigh(at, rest, rate, dt):
    """Return the part of an end of a piece in the integral of slide times exp(-i n w t), by exp(-i n w t) there [m s].

    Parameters
    ----------
    at : Instant
        The end.
    rest : float
        Slide beyond which the slide is integrated [m].
    rate : complex
        i n w [1/s].
    dt : float
        Duration of the piece [s], negative at its last instant.
    """
    y = at.slide - rest
    slope = at.velocity - rate * y
    bend = at.acceleration - 2 * rate * at.velocity + rate * rate * y
    return 0.5 * dt * y + dt * dt / 10 * slope + dt * dt * dt / 120 * bend


@njit(**NJIT_KERNEL)
def integrate(body, piece, n):
    """Return the integral of slide times exp(-i n w t) over a piece [m s].

    The slide y beyond the place of rest of a linear regime obeys y'' + c y' + k y = d sin(w t). The integral of each side
    times exp(-i n w t) follows by parts from the ends.

    Parameters
    ----------
    body : Body
    piece : Piece
    n : int
        0, 1 or 3.
    """
    case = body.case
    first = piece.first
    last = piece.last
    omega = case[Number.OMEGA]
    dt = piece.duration
    turn = omega * dt
    rate = complex(0.0, n * omega)
    begin = raise_wave(first.phase, -n)
    end = raise_wave(last.phase, -n)

    # The integral of a slide at rest is exact, so that it does no work.
    plain = integrate_wave(piece, -n, turn) * (1 / omega)
    direction = piece.branch.direction
    rest = first.slide
    if not is_linear(body):
        change = begin * weigh(first, rest, rate, dt) - end * weigh(last, rest, rate, -dt)
        return rest * plain + change
    if direction == 0 and body.stiffness == 0:
        return rest * plain

    rest = find_rest(body, direction, first.slip)
    stiffness = body.stick.stiffness if direction == 0 else body.slip.stiffness
    damping = case[Number.DAMPING]
    waves = integrate_wave(piece, 1 - n, turn) - integrate_wave(piece, -1 - n, turn)
    push = case[Number.DRIVE] / (2 * omega) * complex(waves.imag, -waves.real)
    push -= end * (last.velocity + (rate + damping) * (last.slide - rest))
    push += begin * (first.velocity + (rate + damping) * (first.slide - rest))
    resistance = complex(stiffness - n * n * omega * omega, n * omega * damping)
    size = resistance.real**2 + resistance.imag**2
    return push * resistance.conjugate() * (1 / size) + rest * plain


@njit(**NJIT_KERNEL)
def observe_extreme(q, force, is_turn, loop):
    """Update the extremes of the slide in the cycle.

    Parameters
    ----------
    q, force : float
        A slide [m], and the friction force there [N].
    is_turn : bool
        Whether the motion turns there. The force is then that of the extreme also if a slide just before was the same up
        to round-off.
    loop : (5,) array
        The cycle, in the order of `rows.Loop` (changed in place).
    """
    margin = SAME_SLIDE * abs(q) if is_turn else 0.0
    if q > loop[Loop.MAX_SLIDE] - margin:
        loop[Loop.MAX_SLIDE] = max(q, loop[Loop.MAX_SLIDE])
        loop[Loop.FORCE_AT_MAX] = force
    if q < loop[Loop.MIN_SLIDE] + margin:
        loop[Loop.MIN_SLIDE] = min(q, loop[Loop.MIN_SLIDE])
        loop[Loop.FORCE_AT_MIN] = force


@njit(**NJIT_KERNEL)
def observe_piece(body, piece, energies, loop):
    """Add a piece to the energies of a case and to the extremes of a cycle, and return its part of the phasor [m s].

    Parameters
    ----------
    body : Body
    piece : Piece
    energies : (6,) array
        In the order of `rows.Energy` (changed in place).
    loop : (5,) array
        The cycle, in the order of `rows.Loop` (changed in place).
    """
    case = body.case
    first = piece.first
    last = piece.last
    dt = piece.duration
    slide = last.slide - first.slide

    # Energies of damper, by Simpson's rule, friction, mode and drive. The velocity of a piece has one sign, and is 0 at
    # both ends of a short slip. By parts, the work of the drive follows from the phasor.
    v = first.velocity
    end = last.velocity
    middle = 1.5 * slide / dt - 0.25 * (v + end) if dt > 0 else 0.0
    squares = (v * v + 4 * middle * middle + end * end) / 6
    energies[Energy.VISCOUS] += case[Number.DAMPING] * dt * squares
    energies[Energy.FRICTION] += case[Number.MOBILITY] * last.work
    energy = 0.5 * (end * end + case[Number.STIFFNESS] * last.slide * last.slide)
    energies[Energy.STORED] = max(energies[Energy.STORED], energy)
    power = 0.5 * abs(case[Number.DRIVE]) * (abs(first.phase.imag) + abs(last.phase.imag))
    energies[Energy.POWER] += power * abs(slide)
    observe_extreme(last.slide, piece.end_force, end == 0, loop)
    return integrate(body, piece, 1)


@njit(**NJIT_KERNEL)
def observe_ends(piece, last, seen):
    """Add work, force and slip of a piece of the window to `seen`.

    The work check compares the work with the trapezoidal rule over the pieces, relative to the work that passed through the
    point in either direction.

    Parameters
    ----------
    piece : Piece
    last : Instant
        Its last instant, with the slip there.
    seen : (19,) array
        What was observed, in the order of `rows.Seen` (changed in place).
    """
    first = piece.first
    seen[Seen.MAX_FORCE] = max(seen[Seen.MAX_FORCE], abs(first.force), abs(last.force))
    seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], last.slip)
    seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], last.slip)
    seen[Seen.WORK] += piece.last.work
    seen[Seen.SAMPLED] += 0.5 * (first.force + last.force) * (last.slide - first.slide)
    seen[Seen.PASSED] += abs(piece.last.work)


@njit(**NJIT_KERNEL)
def read_signal(body, piece, part, weights):
    """Return the sum of force [N], acceleration of the slide and sine of the drive in a piece by their weights.

    Parameters
    ----------
    body : Body
    piece : Piece
    part : float
        Time since the start relative to the duration.
    weights : (float, float, float)
        Weights of force, acceleration and sine.
    """
    at = piece.first if part == 0 else piece.last
    if 0 < part < 1:
        ends = piece.first, piece.last
        dt = piece.duration
        at = sample(body, piece.branch.direction, ends, dt, part * dt)
    return weights[0] * at.force + weights[1] * at.acceleration + weights[2] * at.phase.imag


@njit(**NJIT_CALL)
def find_peak(body, piece, weights, known):
    """Return the largest magnitude so far of a sum of force, acceleration of the slide and sine of the drive.

    The parabola through both ends and the middle of a piece shows an extreme between them. An extreme that cannot be the
    largest one is not searched: one that exceeds the parabola by less than the range of its three values.

    Parameters
    ----------
    body : Body
    piece : Piece
    weights : (float, float, float)
        Weights of force, acceleration and sine.
    known : float
        Largest magnitude before the piece.
    """
    centre = 0.5
    half = 0.5
    peak = known
    for _ in range(1 + N_NARROWER_PARABOLAS):
        before = read_signal(body, piece, centre - half, weights)
        middle = read_signal(body, piece, centre, weights)
        after = read_signal(body, piece, centre + half, weights)
        vertex = find_vertex(before, middle, after)
        if half == 0.5:
            peak = max(known, abs(before), abs(after))
            spread = max(before, middle, after) - min(before, middle, after)
            if not vertex.is_near or vertex.largest + spread < known:
                return peak
        centre += half * vertex.offset
        half *= 0.25
        centre = min(max(centre, (1 + STEP_ROUND_OFF) * half), 1 - half)
    return max(peak, vertex.largest)


@njit(**NJIT_KERNEL)
def find_crossing(body, piece, shares, level):
    """Return the part of a piece after which the irreversible part of the motion passes a level; -1 if it does not.

    Parameters
    ----------
    body : Body
    piece : Piece
    shares : (float, float)
        Irreversible part at both ends of the piece.
    level : float
        The level.
    """
    if (shares[0] > level) == (shares[1] > level):
        return -1.0
    ends = piece.first, piece.last
    return locate(body, piece.branch, ends, piece.duration, Goal.SHARE, level) / piece.duration


@njit(**NJIT_KERNEL)
def find_time_above(begin, level, crossing):
    """Return the part of a piece in which the irreversible part of the motion is above a level.

    Parameters
    ----------
    begin : float
        Irreversible part at the start of the piece.
    level : float
        The level.
    crossing : float
        Part of the piece after which it passes the level; -1 if it does not.
    """
    if crossing < 0:
        return 1.0 if begin > level else 0.0
    return crossing if begin > level else 1 - crossing


@njit(**NJIT_CALL)
def observe_motion(body, piece, seen):
    """Add a piece of the window to `seen`: its stick, turns of the slip, and extremes of acceleration and force inside.

    A point sticks while the magnitude of the irreversible part of its motion is at most STICKING_SLIP_FRACTION; after a turn
    this part may be negative. Slip starts where it rises above this level, in a piece or by a jump between two pieces.

    Parameters
    ----------
    body : Body
    piece : Piece
    seen : (19,) array
        What was observed, in the order of `rows.Seen` (changed in place).
    """
    case = body.case
    numbers = body.law.numbers
    first = piece.first
    direction = piece.branch.direction
    dt = piece.duration
    if dt == 0:
        return

    # Stick and starts of slip
    level = STICKING_SLIP_FRACTION
    turn = case[Number.OMEGA] * dt
    begin = find_share(first, piece.branch, numbers)
    end = find_share(piece.last, piece.branch, numbers)
    shares = begin, end
    low = find_crossing(body, piece, shares, -level)
    high = find_crossing(body, piece, shares, level)
    stuck = find_time_above(begin, -level, low) - find_time_above(begin, level, high)
    seen[Seen.STUCK] += stuck * turn
    jumps = seen[Seen.SHARE] <= level < begin
    if jumps or begin <= level < end:
        phase = first.phase * rotate(0.0 if jumps else high * turn)
        seen[Seen.STARTS] += 1
        seen[Seen.COS_START] += phase.real**2 - phase.imag**2
        seen[Seen.SIN_START] += 2 * phase.real * phase.imag
    seen[Seen.SHARE] = end

    # The irreversible slide turns where there is no force, and so no stretch.
    zero = find_crossing(body, piece, shares, 0.0) if begin < 0 else -1.0
    if zero >= 0:
        slip = sample(body, direction, (first, piece.last), dt, zero * dt).slide
        seen[Seen.MIN_SLIP] = min(seen[Seen.MIN_SLIP], slip)
        seen[Seen.MAX_SLIP] = max(seen[Seen.MAX_SLIP], slip)

    # Forces of other laws have their extremes at the ends of pieces, except the one that holds a rigid point.
    output = case[Number.OUTPUT]
    weights = 0.0, output, case[Number.BASE]
    seen[Seen.MAX_ACCELERATION] = find_peak(body, piece, weights, seen[Seen.MAX_ACCELERATION])
    law = numbers[LawNumber.LAW]
    is_held = law == Law.COULOMB and direction == 0
    if is_held or law == Law.TANH or law == Law.LUGRE:
        weights = 1.0, 0.0, 0.0
        seen[Seen.MAX_FORCE] = find_peak(body, piece, weights, seen[Seen.MAX_FORCE])


@njit(**NJIT_KERNEL)
def start_cycle(at, loop):
    """Reset what is observed over a cycle. An extreme at the border of two cycles has no force of its own.

    Parameters
    ----------
    at : Instant
        Start of the cycle.
    loop : (5,) array
        The cycle, in the order of `rows.Loop` (changed in place).
    """
    loop[Loop.SLIDE] = nan
    loop[Loop.MIN_SLIDE] = loop[Loop.MAX_SLIDE] = at.slide
    loop[Loop.FORCE_AT_MIN] = loop[Loop.FORCE_AT_MAX] = nan


@njit(**NJIT_KERNEL)
def start_window(at, seen):
    """Set `seen`, what is observed of a case, at the start of the last cycles, over which its measures are taken.

    Parameters
    ----------
    at : Instant
        Start of the window.
    seen : (19,) array
        In the order of `rows.Seen` (changed in place).
    """
    seen[Seen.MIN_SLIP] = seen[Seen.MAX_SLIP] = at.slip
    seen[Seen.START_SLIDE] = at.slide
    seen[Seen.START_VELOCITY] = at.velocity
    seen[Seen.SHARE] = 1.0  # A slip that begins with the window has no start in it.
