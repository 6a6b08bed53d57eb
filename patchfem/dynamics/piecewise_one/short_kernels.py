"""Compiled short way from one yield to the next: ten derivatives of the motion in place of a series of any length.

Behind many elements most pieces are a hundredth of a radian long and end with the yield that is next. The motion from
the yield before is then known by its derivatives to round-off, the time of the next yield by two of Newton's steps, and
what the drive works and the damping takes on the way by Hermite's rule of both ends with three derivatives each.
"""

from math import sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.memory_kernels import threshold

SHORT = 0.1  # of a piece times the fastest rate: x^10/10! is then 3e-17 of the motion
TURNED = 0.45  # share of the speed that all beyond the acceleration may take from it: the way is monotone
CLOSE = 3e-9  # of the time: Newton's step that leaves its square


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rates_of(v, a, push, side, regime):
    """Derivatives three and four of the coordinate, from the speed v, the acceleration a, the drive and its
    quadrature."""
    alpha, beta, _, _, omega = regime
    third = omega * side - alpha * a - beta * v
    return third, -omega * omega * push - alpha * third - beta * a


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def turned(push, side, angle):
    """The drive and its quadrature an angle of SHORT at most later."""
    square = angle * angle
    sine = angle * (1 - square / 6 * (1 - square / 20 * (1 - square / 42)))
    less = square / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56)))
    return push + (side * sine - push * less), side - (push * sine + side * less)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def to_yield(went, v, push, side, regime, left):
    """(time [s], speed, drive and quadrature then) at which the coordinate has gone on by `went` [m], signed; time 0
    where that is not a short way that is monotone and ends within `left` [s].

    v [m/s], push, side [m s-2]: at first; regime: damping, stiffness and gain at first over the mass, constant push
    and angular frequency.
    """
    alpha, beta, gain, _, omega = regime
    a, square = gain - alpha * v, omega * omega
    inside = v * v + 2 * a * went
    if not (v * went > 0.0 and inside > 0.25 * v * v):
        return 0.0, v, push, side
    end = sqrt(inside)
    t = 2 * went / (v + (end if v > 0.0 else -end))
    if not (t < left and t * t * max(2 * (alpha * alpha + beta), square) < SHORT * SHORT):
        return 0.0, v, push, side
    d3, d4 = rates_of(v, a, push, side, regime)
    cubed, fourth = square * omega * side, square * square
    d5 = -cubed - alpha * d4 - beta * d3
    d6 = fourth * push - alpha * d5 - beta * d4
    d7 = square * cubed - alpha * d6 - beta * d5
    d8 = -square * fourth * push - alpha * d7 - beta * d6
    d9 = -fourth * cubed - alpha * d8 - beta * d7
    d10 = fourth * fourth * push - alpha * d9 - beta * d8
    s2, s3, s4, s5, s6 = a, d3 / 2, d4 / 6, d5 / 24, d6 / 120
    s7, s8, s9, s10 = d7 / 720, d8 / 5040, d9 / 40320, d10 / 362880
    rest = t * t * (abs(s3) + t * (abs(s4) + t * (abs(s5) + t * (abs(s6) + t * (abs(s7) + t * (
        abs(s8) + t * (abs(s9) + t * abs(s10))))))))
    if rest > TURNED * abs(v):
        return 0.0, v, push, side
    t -= s3 * t * t * t / (3 * (v + a * t))
    for _ in range(6):
        q = t * t
        p = t * ((v + q * (s3 / 3 + q * (s5 / 5 + q * (s7 / 7 + q * (s9 / 9)))))
                 + t * (s2 / 2 + q * (s4 / 4 + q * (s6 / 6 + q * (s8 / 8 + q * (s10 / 10))))))
        speed = (v + q * (s3 + q * (s5 + q * (s7 + q * s9)))) + t * (s2 + q * (s4 + q * (s6 + q * (s8 + q * s10))))
        step = (p - went) / speed
        t -= step
        if abs(step) <= CLOSE * t:
            if not 0.0 < t < left:
                break
            later, other = turned(push, side, omega * t)
            return t, speed - step * (gain - alpha * speed - beta * went + later - push), later, other
    return 0.0, v, push, side


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def hermite(span, first, last):
    """Integral over a span [s] from value and three derivatives at both ends, exact for powers up to seven."""
    (f0, f1, f2, f3), (g0, g1, g2, g3) = first, last
    return span * (0.5 * (f0 + g0) + span * (3 / 28 * (f1 - g1) + span * ((f2 + g2) / 84 + span * (f3 - g3) / 1680)))


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def powers_of(v, push, side, regime, a):
    """(power of the drive, square of the speed), each with three derivatives in time, over the mass."""
    _, _, _, constant, omega = regime
    third, fourth = rates_of(v, a, push, side, regime)
    p, p1, p2, p3 = push + constant, omega * side, -omega * omega * push, -omega * omega * omega * side
    change = p3 * v + 3 * p2 * a + 3 * p1 * third + p * fourth
    return (p * v, p1 * v + p * a, p2 * v + 2 * p1 * a + p * third, change), \
        (v * v, 2 * v * a, 2 * (a * a + v * third), 6 * a * third + 2 * v * fourth)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def short_energies(span, went, regime, first, last):
    """(work of the drive, viscous loss, integral of the drive's |power|) over the mass of a short piece that goes one
    way by `went` [m]; first, last: speed, drive and quadrature at its ends. The sign of the drive stays."""
    alpha, beta, gain, _, _ = regime
    (v0, p0, q0), (v1, p1, q1) = first, last
    power, square = powers_of(v0, p0, q0, regime, gain - alpha * v0)
    close, squared = powers_of(v1, p1, q1, regime, gain - alpha * v1 - beta * went + p1 - p0)
    work = hermite(span, power, close)
    return work, alpha * hermite(span, square, squared), abs(work)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def short_piece(left, state, regime, face, table, memory, clock):
    """(length [s], way of the next yield, way of the coordinate [m], speed, drive and its quadrature at the end) of a
    short piece up to the next yield, of length 0 where it is none; state and regime as of
    `one_kernels.long_piece`."""
    _, v, push, side, _ = state
    way = 1.0 if face * v > 0.0 else -1.0
    went = (threshold(0, way, table, memory) - memory.place[0]) / face
    if clock.rest[0] == 1.0 or (memory.slipping[0] > 0 and way != memory.way[0]):
        return 0.0, way, went, v, push, side
    span, close, p, q = to_yield(went, v, push, side, regime, left)
    if (push + regime[3]) * (p + regime[3]) < 0.0:  # the drive turns its sign
        span = 0.0
    return span, way, went, close, p, q
