"""Compiled way over a whole piece: what a piece of full length does is linear in the numbers that it starts with.

Between events the motion of one mode is linear in its speed, its acceleration, the drive and its quadrature, and most
pieces are as long as their series reach. What each of the four does in such a piece is worked out once for the elements
that hold: the way, the speed at the end, the Bernstein form of the speed, the series. A piece without an event then
costs a few dozen products, which are done side by side, in place of a recurrence of 24 terms.
"""

from math import cos, sin, sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.series_kernels import _HULL, FEW, REACH
from .line_kernels import one_series, order_of

ALPHA, BETA, OMEGA, SLOWEST, SPAN, RATE, TOP, COSINE, SINE = range(9)  # of the first line
ENDS, HULL, LATER, SERIES, LINES = 1, 2, 6, 10, 14  # lines, four each but for the ends
WAY, SPEED, REST, REST_LATER = 0, 4, 8, 12  # in the line of the ends
WIDE, LONG = 16, 32  # columns of a hull, of a line


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def hull_of(lines, low, top, hull):
    """Bernstein form (WIDE,) of the speed of the series lines[0], over its power `low`, to FEW, the last one repeated;
    what its higher powers add at most."""
    c, rest = lines[0], 0.0
    for i in range(WIDE):
        hull[i] = (low + 1) * c[low + 1]
        for k in range(1, FEW + 1):
            hull[i] += (low + k + 1) * c[low + k + 1] * _HULL[FEW, k, min(i, FEW)]
    for k in range(low + FEW + 1, top):
        rest += (k + 1) * abs(c[k + 1])
    return rest


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def work_out(one, regime, slowest, lines):
    """Fill one (LINES, LONG) for a piece of these rates.

    regime: damping, stiffness, any, any and angular frequency; slowest [1/s]: least rate; lines: room of a march.
    """
    alpha, beta, _, _, omega = regime
    rate = max(0.5 * alpha + sqrt(0.25 * alpha * alpha + beta), omega, slowest)
    h = REACH / rate
    top, turned, c = order_of(rate * h), omega * h, lines[0]
    about = one[0]
    about[ALPHA], about[BETA], about[OMEGA], about[SLOWEST], about[SPAN] = alpha, beta, omega, slowest, h
    about[RATE], about[TOP], about[COSINE], about[SINE] = rate, top, cos(turned), sin(turned)
    for j in range(4):
        unit = 1.0 if j == 0 else 0.0, 1.0 if j == 1 else 0.0, 1.0 if j == 2 else 0.0, 1.0 if j == 3 else 0.0
        one_series(0.0, unit[0], unit[1], beta, alpha, unit[2], unit[3], turned, h, top, c, lines[3])
        way, speed = 0.0, 0.0
        for k in range(top, 0, -1):
            way += c[k]
            speed += k * c[k]
        one[ENDS, WAY + j], one[ENDS, SPEED + j] = way, speed / h
        one[ENDS, REST + j] = hull_of(lines, 0, top, one[HULL + j])
        one[ENDS, REST_LATER + j] = hull_of(lines, 1, top, one[LATER + j])
        for k in range(LONG):
            one[SERIES + j, k] = c[k] if k <= top else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def is_of(one, regime, slowest):
    """Whether a table is that of these rates."""
    about = one[0]
    return about[ALPHA] == regime[0] and about[BETA] == regime[1] and about[OMEGA] == regime[4] \
        and about[SLOWEST] == slowest


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def series_of(one, z, parts, c):
    """Fill c (LONG,) with the series that `line_kernels.one_series` gives for a whole piece from z.

    parts: speed, acceleration but for the damping, drive, quadrature.
    """
    v, gain, push, side = parts
    for k in range(LONG):
        c[k] = v * one[SERIES, k] + gain * one[SERIES + 1, k] + push * one[SERIES + 2, k] + side * one[SERIES + 3, k]
    c[0] = z


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def one_way(one, parts, rests):
    """(sign of the speed all through a whole piece, way [m], speed [m/s] at its end); sign 0 where it is not sure.

    parts as of `series_of`; rests: the speed is zero at first.
    """
    v, gain, push, side = parts
    at, tail = (LATER, REST_LATER) if rests else (HULL, REST)
    ends, failed = one[ENDS], 0
    start = v * one[at, 0] + gain * one[at + 1, 0] + push * one[at + 2, 0] + side * one[at + 3, 0]
    sign = 1.0 if start > 0.0 else -1.0
    rest = abs(v) * ends[tail] + abs(gain) * ends[tail + 1] + abs(push) * ends[tail + 2] + abs(side) * ends[tail + 3]
    for i in range(WIDE):
        here = v * one[at, i] + gain * one[at + 1, i] + push * one[at + 2, i] + side * one[at + 3, i]
        failed += 1 if sign * here <= rest else 0
    went = v * ends[WAY] + gain * ends[WAY + 1] + push * ends[WAY + 2] + side * ends[WAY + 3]
    close = v * ends[SPEED] + gain * ends[SPEED + 1] + push * ends[SPEED + 2] + side * ends[SPEED + 3]
    return 0.0 if failed > 0 else sign, went, close
