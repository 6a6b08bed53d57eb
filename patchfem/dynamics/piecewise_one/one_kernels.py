"""Compiled run from event to event of one mode behind the elements of one interface, under sines.

The loop of `piecewise.march_kernels` for numbers instead of arrays, four times as fast; that one is its twin. The work
of the drive and the viscous loss of a long piece follow from its ends, by parts.
"""

from math import atan2, cos, pi, sin, sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.drive_kernels import AMPLITUDE, CONSTANT, OMEGA, PHASE
from ..piecewise.march_kernels import AT_ONCE, DONE, FULL, HEAD, MOST_IDLE, PILED, arrive, left_of
from ..piecewise.memory_kernels import carried, give_way, tangent, threshold, turn
from ..piecewise.search_kernels import NOTHING, TURNS, YIELDS, heading
from ..piecewise.series_kernels import (
    _PLACE,
    _ROOM,
    _WEIGHT,
    EPS,
    MOST,
    NONE,
    REACH,
    first_root,
    points,
    value,
    value_and_slope,
)
from .names_kernels import BASE, DAMPING, FACE, MASS, OUTPUT, SQUARE

FINE = 64  # places of a table of orders per unit of piece times rate
# highest power for a piece of x times the fastest rate, at x FINE rounded up
_TOPS = np.array([next((k for k in range(4, MOST) if _ROOM[k] >= x / FINE), MOST)
                  for x in range(int(REACH * FINE) + 2)])
TWICE = np.array([0.0, 0.0] + [1 / (k * (k - 1)) for k in range(2, MOST + 6)])  # of two integrations
OVER = np.array([0.0] + [1 / k for k in range(1, MOST + 6)])  # of one integration
LONG = 0.05  # piece times rate from which the energies follow from its ends
APART = 1e-6  # of omega^4: so near its resonance they do not


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def order_of(x):
    """Highest power that a piece of x times the fastest rate needs."""
    return _TOPS[min(int(x * FINE) + 1, _TOPS.size - 1)]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def one_series(z, v, gain, beta, alpha, push, side, turned, h, top, c, wave):
    """Fill c (top + 1,) with the series over u = t/h of z'' = gain - alpha z' - beta (z - z0) + the drive's change, and
    wave with that of the drive, both beyond the first terms.

    gain: z'' [m s-2] at first but for the damping; push, side: the drive [m s-2] and its quadrature there, turned: its
    angle in h.
    """
    squared, damp, turn = h * h, alpha * h, turned * turned
    stiff, here, after = squared * beta, h * v, 0.5 * squared * (gain - alpha * v)
    even, odd = -0.5 * turn * push, turned * side
    c[0], c[1], c[2], wave[0] = z, here, after, push
    for k in range(1, top, 2):
        wave[k], wave[k + 1] = odd, even
        # in this order what comes from the last term but one is ready when the last term is
        here, after = after, TWICE[k + 2] * (squared * odd - stiff * here) - damp * OVER[k + 2] * after
        c[k + 2] = after
        here, after = after, TWICE[k + 3] * (squared * even - stiff * here) - damp * OVER[k + 3] * after
        c[k + 3] = after
        odd, even = -odd * turn * TWICE[k + 2], -even * turn * TWICE[k + 3]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def reach_of(gap, v, gain):
    """Time [s] to a place `gap` [m] ahead at the speed v [m/s] and this acceleration, endless where it is not reached;
    gap > 0, all signed by the way."""
    inside = v * v + 2 * gain * gap
    far = v + sqrt(inside) if inside > 0.0 else 0.0
    return 2 * gap / far if far > 0.0 else 1e300


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def by_parts(span, alpha, beta, omega, ends):
    """(work of the drive, viscous loss) over the mass of a piece from its ends; the first equation of motion's rate
    times drive, quadrature, speed and acceleration, each integrated by parts.

    ends: speed, acceleration, drive p and quadrature q at first, then at the end; p' = omega q.
    """
    v0, a0, p0, q0, v1, a1, p1, q1 = ends
    far, side = beta - omega * omega, alpha * omega
    size, vp, vq, vv = far * far + side * side, v1 * p1 - v0 * p0, v1 * q1 - v0 * q0, 0.5 * (v1 * v1 - v0 * v0)
    first = 0.5 * (p1 * p1 - p0 * p0) - (a1 * p1 - a0 * p0) + omega * vq - alpha * vp
    second = 0.5 * (omega * span * (p0 * p0 + q0 * q0) + p1 * q1 - p0 * q0) - (a1 * q1 - a0 * q0) - omega * vp \
        - alpha * vq
    work, other = (far * first + side * second) / size, (far * second - side * first) / size
    lost = alpha * (omega * other - (v1 * a1 - v0 * a0) - alpha * vv) + omega * (vq + omega * work) \
        - 0.5 * (a1 * a1 - a0 * a0) - beta * vv
    return work, lost / beta


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def by_points(x, h, u, alpha, constant, top, poly, wave):
    """(work of the drive, viscous loss, integral of the drive's |power|) over the mass of a piece of x times the
    fastest rate up to u, by Gauss points; constant: part of the drive [m s-2], poly: series of the speed over u."""
    work, lost, passed, count = 0.0, 0.0, 0.0, points(x)
    for g in range(count):
        place, weight = u * _PLACE[count, g], u * _WEIGHT[count, g]
        rate, push = poly[top - 1], wave[top - 1]
        for k in range(top - 2, -1, -1):
            rate = rate * place + poly[k]
            push = push * place + wave[k]
        power = weight * (push + constant) * rate
        work += power
        passed += abs(power)
        lost += weight * rate * rate
    return work, alpha * lost / h, passed


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def energies(x, times, regime, ends, top, c, poly, wave):
    """What `by_points` gives, from the ends of a long piece where they tell it.

    times: (span, h, u) with span = u h; regime: damping, stiffness and gain at first over the mass, constant push and
    angular frequency; ends as in `by_parts`.
    """
    (span, h, u), (alpha, beta, gain, constant, omega) = times, regime
    far, most = beta - omega * omega, omega * omega
    closed = x > LONG and constant == 0.0 and beta > 1e-3 * most and alpha * alpha < 16 * beta \
        and far * far + alpha * alpha * most > APART * most * most
    if not closed:
        return by_points(x, h, u, alpha, constant, top, poly, wave)
    work, lost = by_parts(span, alpha, beta, omega, ends)
    passed = abs(work)
    if ends[2] * ends[6] < 0.0:  # the drive turns its sign
        until = atan2(abs(ends[2]), abs(ends[3])) / omega
        if ends[2] * ends[3] > 0.0:
            until = pi / omega - until
        went, v = moved_to(until / h, h, top, c)
        size = sqrt(ends[2] * ends[2] + ends[3] * ends[3])
        middle = (ends[0], ends[1], ends[2], ends[3], v, gain - alpha * v - beta * went - ends[2], 0.0,
                  size if ends[6] > ends[2] else -size)
        part = by_parts(until, alpha, beta, omega, middle)[0]
        passed = abs(part) + abs(work - part)
    return work, lost, passed


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def moved_to(u, h, top, c):
    """(way [m] from the start of a piece to u, speed [m/s] there)."""
    went, slope = value_and_slope(c, 1, top, u)
    return u * went, (went + u * slope) / h


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def phasor(x, u, h, output, top, c, clock, books):
    """Add the output's part at the cycle's frequency of a piece of x times the fastest rate up to u."""
    cycle, period, count = int(clock.now[0]), clock.period[0], points(x * u)
    for g in range(count):
        share = u * _PLACE[count, g]
        out = 2 * u * h * _WEIGHT[count, g] / period * output * value(c, 0, top, share)
        angle = 2 * pi * (clock.now[1] + h * share) / period
        books.phasors[cycle, 0] += out * cos(angle)
        books.phasors[cycle, 1] -= out * sin(angle)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def note(place, clock, books):
    """Take an output [m] into the extremes of its cycle."""
    cycle = int(clock.now[0])
    books.extremes[cycle, 0] = min(books.extremes[cycle, 0], place)
    books.extremes[cycle, 1] = max(books.extremes[cycle, 1], place)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def write(row, z, v, span, theta, first, spring, share, limit, memory, clock):
    """A row as `march_kernels.write` has it."""
    now = clock.now
    row[0] = now[0] * clock.period[0] + now[1]
    row[1], row[2], row[3], row[4], row[5], row[6] = span, theta, now[2], first, now[0], now[1]
    row[HEAD], row[HEAD + 1], row[HEAD + 2] = z, v, memory.force[0]
    row[HEAD + 3], row[HEAD + 4], row[HEAD + 5] = spring, share, limit
    row[HEAD + 6], row[HEAD + 7], row[HEAD + 8] = memory.slip[0], memory.worked[0], memory.lost[0]
    row[HEAD + 9] = memory.way[0]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def reached(gap, face, top, c, limit, near, bend):
    """u in (0, limit] at which the slide, monotone there, has moved by `gap` [m], signed; NONE where it does not.

    near: a guess, or 0; bend: sum of the sizes of the second derivatives of the slide over the speed at first.
    """
    went, slope = value_and_slope(c, 1, top, limit)
    if face * went * limit / gap < 1.0:
        return NONE
    wanted, left, right, last = gap / face, 0.0, limit, limit
    u = near if 0.0 < near < limit else limit * wanted / (went * limit)
    for _ in range(100):
        went, slope = value_and_slope(c, 1, top, u)
        miss, slope = u * went - wanted, went + u * slope
        if miss * wanted > 0.0:
            right = u
        elif miss == 0.0:
            return u
        else:
            left = u
        new = u - miss / slope if slope != 0.0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
        step = abs(new - u)
        # what Newton's method leaves is the square of its step times half the bend over the slope
        if step <= 2 * EPS * u or (step < 0.01 * last and step * min(step * bend, (step / last)**2) <= 0.1 * EPS * u):
            return new
        u, last = new, step
    return u


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def first_event(top, near, face, c, poly, spare, hulls, table, memory, rests):
    """(u, what, sign) of the first event of a piece, as `search_kernels.next_event` has it; poly: gets the speed;
    near: a guess of the u of a yield, or 0."""
    for k in range(top):
        poly[k] = (k + 1) * c[k + 1]
    order, way = heading(poly, top, rests)
    if way == 0.0:
        return 1.0, NOTHING, 0.0
    sense = way
    way = way if face > 0.0 else -way
    if memory.slipping[0] > 0 and way != memory.way[0]:
        return 0.0, TURNS, way
    gap = threshold(0, way, table, memory) - memory.place[0]
    if way * gap <= 0.0:
        return 0.0, YIELDS, way
    u, what, sign, rest, bend = 1.0, NOTHING, 0.0, 0.0, 0.0
    for k in range(order + 1, top):
        rest += abs(poly[k])
        bend += k * abs(poly[k])
    if abs(poly[order]) <= rest:
        for k in range(order, top):
            spare[k] = sense * poly[k]
        root = first_root(spare, order, top - 1, hulls)
        if root < u:
            u, what, sign = root, TURNS, -way
    if way * gap > abs(face) * (abs(poly[order]) + rest):
        return u, what, sign
    sure = order == 0 and abs(poly[0]) > 2 * rest  # the speed stays above half of its first
    root = reached(gap, face, top, c, u, near, bend / abs(poly[0]) if sure else 1e300)
    return (root, YIELDS, way) if root <= u else (u, what, sign)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def turned_by(push, side, angle, theta, size):
    """The drive and its quadrature an angle later, at theta; of a short one by its series, so that a cycle of many
    pieces keeps them to round-off of each."""
    if abs(angle) > 0.1:
        return size * sin(theta), size * cos(theta)
    square = angle * angle
    sine = angle * (1 - square / 6 * (1 - square / 20 * (1 - square / 42 * (1 - square / 72))))
    less = square / 2 * (1 - square / 12 * (1 - square / 30 * (1 - square / 56)))
    return push + (side * sine - push * less), side - (push * sine + side * less)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def length(left, slowest, regime, v, side, face, table, memory, rests):
    """(length [s] of the next piece, its product with the fastest rate, u at which to look for a yield, or 0): the
    length is a little more than the next yield wants.

    left [s]: to a border; slowest [1/s]: least rate; regime as in `energies`; side: quadrature of the drive; rests: the
    slide stands still at a turn.
    """
    alpha, beta, gain, _, omega = regime
    rate = max(0.5 * alpha + sqrt(0.25 * alpha * alpha + beta), omega, slowest)
    way = 1.0 if face * (gain if rests else v) > 0.0 else -1.0
    gap = way * (threshold(0, way, table, memory) - memory.place[0])
    wait = reach_of(gap, way * face * v, way * face * (gain - alpha * v)) if gap < 1e290 else 1e300
    h = min(REACH / rate * min(1.0, max(1.1 / REACH * rate * wait, 0.01)), left)
    near, speed = wait / h, v + (gain - alpha * v) * wait
    if near < 1.0 and speed != 0.0:  # the third derivative's share, by one step of Newton's method
        jerk = omega * side - alpha * (gain - alpha * v) - beta * v
        near -= jerk * wait * wait * wait / (6 * speed * h)
    return h, rate * h, near if near < 1.0 and rate * h < 0.5 else 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def book(step, spring, share, limit, memory, ledger):
    """Move the elements by a step [m] of the slide, with the energies that they take."""
    part, lost = (memory.force[0] + 0.5 * spring * step) * step, limit * abs(step)
    memory.worked[0] += part
    memory.lost[0] += lost
    memory.slip[0] += share * step
    memory.force[0] += spring * step
    ledger[3] += part
    ledger[4] += lost


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def happens(what, sign, table, memory, clock):
    """Change the elements as an event asks."""
    if what == YIELDS:
        give_way(0, sign, table, memory)
    elif what == TURNS:
        turn(0, memory)
        clock.rest[0] = 1.0
        memory.force[0] = carried(0, table, memory)[0]


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def march(stop, motion, rig, table, memory, clock, books, room, rows):
    """Run from the clock's time to `stop` (cycle, offset [s]); all as `piecewise.march_kernels.march` has it but for
    rig (6,), SQUARE to MASS, and room: lines (4, w) and hulls. Segments are sines; the output has no travel.

    Cost: 0.35 us a piece, 0.2 us one of many elements.
    """
    (lines, hulls), now, ledger, used, first = room, clock.now, books.ledger, 0, 1.0
    c, poly, spare, wave, output, face = lines[0], lines[1], lines[2], lines[3], rig[OUTPUT], rig[FACE]
    push, side, fresh, soft, slowest = now[3], now[4], now[5] == 0.0, face * face / rig[MASS], 1 / clock.period[0]
    begun, now[5] = carried(0, table, memory)[1] + memory.lost[0] - memory.worked[0], 0.0
    while now[0] < stop[0] or (now[0] == stop[0] and now[1] < stop[1]):
        if used == rows.shape[0] and used > 0:
            now[3], now[4], now[5] = push, side, 0.0 if fresh else 1.0  # it goes on as if it had not stopped
            return FULL, used
        left, segment, z, v = left_of(clock, stop), clock.segments[int(now[2])], motion[0, 0], motion[1, 0]
        size, constant, omega = -rig[BASE] * segment[AMPLITUDE], -rig[BASE] * segment[CONSTANT], segment[OMEGA]
        theta = segment[PHASE] + omega * now[1]
        if fresh:  # at every border, so that a run in parts is the run
            push, side = size * sin(theta), size * cos(theta)
            memory.force[0] = carried(0, table, memory)[0]
        spring, share, limit = tangent(0, table, memory)
        ledger[7] = 1.0 if share >= 0.5 else ledger[7]
        beta, gain = rig[SQUARE] + spring * soft, push + constant - rig[SQUARE] * z - face * memory.force[0] / rig[MASS]
        regime = rig[DAMPING], beta, gain, constant, omega
        h, x, near = length(left, slowest, regime, v, side, face, table, memory, clock.rest[0] == 1.0)
        top = order_of(x)
        one_series(z, v, gain, beta, rig[DAMPING], push, side, omega * h, h, top, c, wave)
        u, what, sign = first_event(top, near, face, c, poly, spare, hulls, table, memory,
                                    clock.rest[0] == 1.0)
        if u > 0.0:
            span = u * h
            if now[1] == 0.0:
                note(output * z, clock, books)
            if rows.shape[0] > 0:
                write(rows[used], z, v, span, theta % (2 * pi), first, spring, share, limit, memory, clock)
                used += 1
            if books.wanted[int(now[0])] == 1.0:
                phasor(x, u, h, output, top, c, clock, books)
            went, close = moved_to(u, h, top, c)
            p, q = turned_by(push, side, omega * span, theta + omega * span, size)
            ends = (v, gain - rig[DAMPING] * v, push, side,
                    close, gain - rig[DAMPING] * close - beta * went + p - push, p, q)
            work, lost, passed = energies(x * u, (span, h, u), regime, ends, top, c, poly, wave)
            ledger[0] += rig[MASS] * work
            ledger[1] += rig[MASS] * lost
            ledger[2] += rig[MASS] * passed
            book(face * went, spring, share, limit, memory, ledger)
            clock.rest[0] = 0.0 if u > AT_ONCE else clock.rest[0]
            motion[0, 0], motion[1, 0], memory.place[0] = z + went, close, face * (z + went)
            note(output * (z + went), clock, books)
            push, side, fresh = p, q, h == left and u == 1.0
            if fresh:
                arrive(clock, stop, left)
            else:
                now[1] += span
            ledger[5] = max(ledger[5], 0.5 * rig[MASS] * (close * close + rig[SQUARE] * motion[0, 0]**2) + begun
                            + memory.worked[0] - memory.lost[0])
            ledger[6] += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * clock.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return PILED, used
        first = 2.0 * (what == TURNS) + (what == YIELDS)
        happens(what, sign, table, memory, clock)
    return DONE, used
