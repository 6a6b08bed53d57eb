"""Compiled run from event to event of one mode behind the elements of one interface, under sines.

The loop of `piecewise.march_kernels` for numbers instead of arrays, four times as fast; that one is its twin. The work
of the drive and the viscous loss of a long piece follow from its ends, by parts.
"""

from math import atan2, cos, pi, sin, sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.drive_kernels import AMPLITUDE, CONSTANT, OMEGA, PHASE
from ..piecewise.march_kernels import AT_ONCE, DONE, FULL, HEAD, MOST_IDLE, PILED, arrive, left_of
from ..piecewise.memory_kernels import carried, give_way, tangent, threshold, turn
from ..piecewise.search_kernels import NOTHING, TURNS, YIELDS, heading
from ..piecewise.series_kernels import (
    _PLACE,
    _WEIGHT,
    EPS,
    NONE,
    REACH,
    first_root,
    points,
    value,
    value_and_slope,
)
from .line_kernels import moved_to, one_series, order_of
from .names_kernels import BASE, DAMPING, FACE, MASS, OUTPUT, SQUARE
from .repeat_kernels import come_back
from .short_kernels import SHORT, short_energies, short_piece
from .whole_kernels import COSINE, RATE, SINE, SPAN, TOP, is_of, one_way, series_of, work_out

LONG = 0.05  # piece times rate from which the energies follow from its ends
APART = 1e-6  # of omega^4: so near its resonance they do not


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
def closes(regime):
    """Whether `by_parts` serves these rates."""
    alpha, beta, _, constant, omega = regime
    far, most = beta - omega * omega, omega * omega
    return constant == 0.0 and beta > 1e-3 * most and alpha * alpha < 16 * beta \
        and far * far + alpha * alpha * most > APART * most * most


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def energies(x, times, regime, ends, top, c, poly, wave):
    """What `by_points` gives, from the ends of a long piece where they tell it.

    times: (span, h, u) with span = u h; regime: damping, stiffness and gain at first over the mass, constant push and
    angular frequency; ends as in `by_parts`.
    """
    (span, h, u), (alpha, beta, gain, constant, omega) = times, regime
    if not (x > LONG and closes(regime)):
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


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def stays(way, went, table, memory):
    """Whether the same elements slip and hold, clear of round-off, while the slide goes on by `went` [m], one way."""
    same = memory.slipping[0] == 0 or way == memory.way[0]
    return same and way * went * (1 + AT_ONCE) < way * (threshold(0, way, table, memory) - memory.place[0])


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def long_piece(left, slowest, state, regime, size, face, table, memory, clock, room):
    """(u, length [s] of which u is the share, its product with the fastest rate, highest power, what ends it, its sign,
    way of the coordinate [m], speed, drive and its quadrature at the end) of any piece; its series stays in room.

    state: coordinate, speed, drive, its quadrature and angle at first; regime as in `energies`.
    """
    (z, v, push, side, theta), (alpha, beta, gain, _, omega), (lines, hulls, wholes) = state, regime, room
    c, rests, parts = lines[0], clock.rest[0] == 1.0, (v, gain, push, side)
    one = wholes[min(memory.slipping[0], wholes.shape[0] - 1)]
    known = memory.slipping[0] < wholes.shape[0] and closes(regime)
    if known and not is_of(one, regime, slowest):
        work_out(one, regime, slowest, lines)
    if known and left > one[0, SPAN]:
        way, went, close = one_way(one, parts, rests)
        if way != 0.0 and stays(way if face > 0.0 else -way, face * went, table, memory):
            p, q = push * one[0, COSINE] + side * one[0, SINE], side * one[0, COSINE] - push * one[0, SINE]
            if push * p < 0.0:
                series_of(one, z, parts, c)
            h = one[0, SPAN]
            return 1.0, h, one[0, RATE] * h, int(one[0, TOP]), NOTHING, 0.0, went, close, p, q
    h, x, near = length(left, slowest, regime, v, side, face, table, memory, rests)
    top = order_of(x)
    if known and h == one[0, SPAN]:
        series_of(one, z, parts, c)
    else:
        one_series(z, v, gain, beta, alpha, push, side, omega * h, h, top, c, lines[3])
    u, what, sign = first_event(top, near, face, c, lines[1], lines[2], hulls, table, memory, rests)
    went, close = moved_to(u, h, top, c)
    if known and x * u <= LONG:  # what goes by points wants the drive too
        one_series(z, v, gain, beta, alpha, push, side, omega * h, h, top, c, lines[3])
    p, q = turned_by(push, side, omega * u * h, theta + omega * u * h, size)
    return u, h, x, top, what, sign, went, close, p, q


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def march(stop, motion, rig, table, memory, clock, books, last, room, rows):
    """Run from the clock's time to `stop` (cycle, offset [s]); all as `piecewise.march_kernels.march` has it but for
    rig (6,), SQUARE to MASS, room: lines (4, w) and hulls, and last (4, t + 2), the state one period before, from where
    on a motion that has settled repeats to the last bit. Segments are sines; the output has no travel.

    Cost: 0.35 us a piece, 0.1 us a short one of many elements.
    """
    lines, now, ledger, used, first = room[0], clock.now, books.ledger, 0, 1.0
    c, poly, wave, output, face = lines[0], lines[1], lines[3], rig[OUTPUT], rig[FACE]
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
        state = z, v, push, side, theta
        h, sign, went, close, p, q = short_piece(left, state, regime, face, table, memory, clock)
        short, u, x, top, what = h > 0.0, 1.0, SHORT, order_of(SHORT), YIELDS
        if not short:
            u, h, x, top, what, sign, went, close, p, q = long_piece(left, slowest, state, regime, size, face, table,
                                                                     memory, clock, room)
        if u > 0.0:
            span = u * h
            if now[1] == 0.0:
                note(output * z, clock, books)
            if rows.shape[0] > 0:
                write(rows[used], z, v, span, theta % (2 * pi), first, spring, share, limit, memory, clock)
                used += 1
            if books.wanted[int(now[0])] == 1.0:
                if short or what == NOTHING:
                    one_series(z, v, gain, beta, rig[DAMPING], push, side, omega * h, h, top, c, wave)
                phasor(x, u, h, output, top, c, clock, books)
            work, lost, passed = short_energies(span, went, regime, (v, push, side), (close, p, q)) if short else \
                energies(x * u, (span, h, u), regime, (v, gain - rig[DAMPING] * v, push, side, close, gain
                         - rig[DAMPING] * close - beta * went + p - push, p, q), top, c, poly, wave)
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
            if fresh and now[1] == 0.0:
                come_back(motion, face, 2 * pi / clock.period[0], memory, clock, last)
            ledger[5] = max(ledger[5], 0.5 * rig[MASS] * (close * close + rig[SQUARE] * motion[0, 0]**2) + begun
                            + memory.worked[0] - memory.lost[0])
            ledger[6] += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * clock.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return PILED, used
        first = 2.0 * (what == TURNS) + (what == YIELDS)
        happens(what, sign, table, memory, clock)
    return DONE, used
