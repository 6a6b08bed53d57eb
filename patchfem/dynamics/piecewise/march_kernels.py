"""Compiled run from event to event of modes behind elastic-plastic elements.

An event is a yield, a turning point of a slide or of the output, or a border of the drive. Up to the first turning
point of a slide, whose speed is proved free of roots before it, the slide is monotone, so a yield before it is one root
of a monotone function: no event can be missed.
"""

from math import cos, pi, sin

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from .drive_kernels import RATE, drive_series, phase_of
from .memory_kernels import carried, give_way, tangent, threshold, turn
from .series_kernels import (
    _PLACE,
    _WEIGHT,
    EPS,
    NONE,
    OVER,
    REACH,
    fastest,
    first_root,
    motion_series,
    points,
    polish,
    powers,
    value,
)

DONE, FULL, TRAVEL, PILED = 0, 1, 2, 3  # how `march` returns
NOTHING, YIELDS, TURNS, OUTPUT_TURNS, STOPS = 0, 1, 2, 3, 4  # what ends a piece
HEAD, EACH = 8, 8  # columns of a row: of the piece, then of every interface behind z and v
TINY = 1e-14  # of the terms of a speed: below it a slide at a turning point has no acceleration
AT_ONCE = 1e-12  # share of a piece in which what stood still stands still: two turning points at one place
MOST_IDLE = 1000.0  # events in a row without progress


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def left_of(clock, stop):
    """Time [s] to the next border: of the drive's segments, of the cycle, or `stop` (cycle, offset)."""
    now, period = clock.now, clock.period[0]
    left = period - now[1]
    if stop[0] == now[0]:
        left = min(left, stop[1] - now[1])
    k = int(now[2]) + 1
    if k < clock.segments.shape[0] and clock.segments[k, 0] == now[0]:
        left = min(left, clock.segments[k, 1] - now[1])
    return max(left, 0.0)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def arrive(clock, stop, left):
    """Step onto the border `left` [s] away."""
    now, period = clock.now, clock.period[0]
    k = int(now[2]) + 1
    after = k < clock.segments.shape[0] and clock.segments[k, 0] == now[0] and clock.segments[k, 1] - now[1] <= left
    if after:
        now[1], now[2] = clock.segments[k, 1], k
    elif stop[0] == now[0] and stop[1] - now[1] <= left:
        now[1] = stop[1]
    else:
        now[0], now[1] = now[0] + 1, 0.0
    if now[1] >= period:
        now[0], now[1] = now[0] + 1, 0.0
    k = int(now[2]) + 1
    if k < clock.segments.shape[0] and clock.segments[k, 0] == now[0] and clock.segments[k, 1] <= now[1]:
        now[2] = k


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def heading(poly, top, rests):
    """(order of the first term of a speed that counts, its sign); poly: its series; rests: it is zero at first."""
    if not rests and poly[0] != 0.0:
        return 0, 1.0 if poly[0] > 0 else -1.0
    size = 0.0
    for k in range(top):
        size += abs(poly[k])
    for k in range(1, min(top, 4)):
        if abs(poly[k]) > TINY * size:
            return k, 1.0 if poly[k] > 0 else -1.0
    return 0, 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def speed_series(row, coefs, top, poly):
    """Fill poly (top,) with the series of the rate over u of row (n,) times the coordinates."""
    for k in range(top):
        part = 0.0
        for i in range(row.size):
            part += row[i] * coefs[k + 1, i]
        poly[k] = (k + 1) * part


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def moved(poly, top, u):
    """Integral from 0 to u of a speed whose series is poly (top,)."""
    out = poly[top - 1] * OVER[top]
    for k in range(top - 2, -1, -1):
        out = out * u + poly[k] * OVER[k + 1]
    return out * u


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def crossing(poly, top, room, limit, spare):
    """u in (0, limit] at which a slide of speed series poly, monotone there, has moved by `room` the way it goes; NONE
    if it does not. room > 0 [m], signed; spare: room for a polynomial."""
    end = moved(poly, top, limit)
    way = 1.0 if room > 0 else -1.0
    if way * end < way * room:
        return NONE
    spare[0] = way * room
    for k in range(top):
        spare[k + 1] = -way * poly[k] * OVER[k + 1]
    return polish(spare, 0, top, 0.0, limit, limit * room / end)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def next_event(top, plant, table, memory, clock, room):
    """(u, what, face, sign) of the first event of a piece; u = 1 and NOTHING where none ends it.

    u = 0: the state changes before anything moves.
    """
    faces, polys = plant.faces.shape[0], room.polys
    u, what, face, sign = 1.0, NOTHING, 0, 0.0
    for f in range(faces):
        poly = polys[f]
        speed_series(plant.faces[f], room.coefs, top, poly)
        order, way = heading(poly, top, clock.rest[f] == 1.0)
        if way == 0.0:
            continue
        if memory.slipping[f] > 0 and way != memory.way[f]:
            return 0.0, TURNS, f, way
        spare = polys[faces]
        for k in range(order, top):
            spare[k] = way * poly[k]
        root = first_root(spare, order, top - 1, room.hulls)
        if root < u:
            u, what, face, sign = root, TURNS, f, -way
        gap = threshold(f, way, table, memory) - memory.place[f]
        if way * gap <= 0:
            return 0.0, YIELDS, f, way
        root = crossing(poly, top, gap, u, polys[faces])
        if root <= u:
            u, what, face, sign = root, YIELDS, f, way
    if plant.along < 0:
        poly, spare = polys[faces + 1], polys[faces]
        speed_series(plant.output, room.coefs, top, poly)
        order, way = heading(poly, top, clock.rest[faces] == 1.0)
        for k in range(order, top):
            spare[k] = way * poly[k]
        root = first_root(spare, order, top - 1, room.hulls) if way != 0.0 else NONE
        if root < u:
            u, what, face, sign = root, OUTPUT_TURNS, faces, -way
    return u, what, face, sign


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def at_four(poly, low, top, u):
    """Values of a polynomial as in `value` at four places."""
    a = b = c = d = poly[top]
    for k in range(top - 1, low - 1, -1):
        part = poly[k]
        a, b, c, d = a * u[0] + part, b * u[1] + part, c * u[2] + part, d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rates_at_four(coefs, i, top, u):
    """Rates over u of the coordinate i at four places."""
    a = b = c = d = top * coefs[top, i]
    for k in range(top - 1, 0, -1):
        part = k * coefs[k, i]
        a, b, c, d = a * u[0] + part, b * u[1] + part, c * u[2] + part, d * u[3] + part
    return a, b, c, d


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def sums(x, u, h, top, plant, clock, books, room):
    """Add the work of the drive, the viscous loss and the phasor of a piece up to u to the books, by Gauss points."""
    n, count, ledger, nodes = plant.square.size, points(x * u), books.ledger, room.nodes
    work, lost, passed_by = 0.0, 0.0, 0.0
    for g in range(0, count, 4):  # four points at a time in registers
        place = (u * _PLACE[count, g], u * _PLACE[count, g + 1], u * _PLACE[count, g + 2], u * _PLACE[count, g + 3])
        weight = _WEIGHT[count, g:g + 4]
        wave = at_four(room.waves[0], 0, top, place)
        push = (0.0, 0.0, 0.0, 0.0)
        for i in range(n):
            rate = rates_at_four(room.coefs, i, top, place)
            push = (push[0] - plant.base[i] * rate[0], push[1] - plant.base[i] * rate[1],
                    push[2] - plant.base[i] * rate[2], push[3] - plant.base[i] * rate[3])
            nodes[i, 0], nodes[i, 1], nodes[i, 2], nodes[i, 3] = rate
            if not plant.coupled:
                lost += plant.damping[i, i] * (weight[0] * rate[0]**2 + weight[1] * rate[1]**2 + weight[2] * rate[2]**2
                                               + weight[3] * rate[3]**2)
        if plant.coupled:
            for i in range(n):
                for j in range(n):
                    for k in range(4):
                        lost += weight[k] * nodes[i, k] * plant.damping[i, j] * nodes[j, k]
        power = (weight[0] * push[0] * wave[0], weight[1] * push[1] * wave[1], weight[2] * push[2] * wave[2],
                 weight[3] * push[3] * wave[3])
        work += power[0] + power[1] + power[2] + power[3]
        passed_by += abs(power[0]) + abs(power[1]) + abs(power[2]) + abs(power[3])
    ledger[0] += plant.mass * u * work
    ledger[1] += plant.mass * u * lost / h
    ledger[2] += plant.mass * u * passed_by
    cycle = int(clock.now[0])
    if books.wanted[cycle] == 1.0:
        for g in range(count):
            share = u * _PLACE[count, g]
            at = clock.now[1] + h * share
            out, angle = 0.0, 2 * pi * at / clock.period[0]
            for i in range(n):
                out += plant.output[i] * value(room.coefs[:, i], 0, top, share)
            out *= 2 * u * h * _WEIGHT[count, g] / clock.period[0]
            books.phasors[cycle, 0] += out * cos(angle)
            books.phasors[cycle, 1] -= out * sin(angle)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def write(row, motion, span, theta, first, plant, table, memory, clock):
    """A row of a piece as it begins: time, span, phase, segment, what begins it, cycle, then z, v, then of every
    interface force, springs, share that slips, its limit, slip, work, loss, direction."""
    n = plant.square.size
    row[0] = clock.now[0] * clock.period[0] + clock.now[1]
    row[1], row[2], row[3], row[4], row[5], row[6] = span, theta, clock.now[2], first, clock.now[0], clock.now[1]
    for i in range(n):
        row[HEAD + i], row[HEAD + n + i] = motion[0, i], motion[1, i]
    for f in range(plant.faces.shape[0]):
        at = HEAD + 2 * n + EACH * f
        row[at] = memory.force[f]
        row[at + 1], row[at + 2], row[at + 3] = tangent(f, table, memory)
        row[at + 4], row[at + 5], row[at + 6] = memory.slip[f], memory.worked[f], memory.lost[f]
        row[at + 7] = memory.way[f]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def advance(u, h, top, motion, plant, table, memory, clock, books, room):
    """Move coordinates, slides and elements to u, with the energies that the elements take; whether the output passes
    the travel."""
    n, coefs, ledger = plant.square.size, room.coefs, books.ledger
    for f in range(plant.faces.shape[0]):
        stiff, share, limit = tangent(f, table, memory)
        step = moved(room.polys[f], top, u)
        work = (memory.force[f] + 0.5 * stiff * step) * step
        memory.worked[f] += work
        memory.lost[f] += limit * abs(step)
        memory.slip[f] += share * step
        memory.force[f] += stiff * step
        ledger[3] += work
        ledger[4] += limit * abs(step)
    out = 0.0
    for i in range(n):
        place, rate = coefs[top, i], top * coefs[top, i]
        for k in range(top - 1, 0, -1):
            place = place * u + coefs[k, i]
            rate = rate * u + k * coefs[k, i]
        motion[0, i] += u * place
        motion[1, i] = rate / h
        out += plant.output[i] * motion[0, i]
    for f in range(plant.faces.shape[0]):
        place = 0.0
        for i in range(n):
            place += plant.faces[f, i] * motion[0, i]
        memory.place[f] = place
    widen(out, clock, books)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def widen(out, clock, books):
    """Take an output [m] into the extremes of its cycle."""
    cycle = int(clock.now[0])
    books.extremes[cycle, 0] = min(books.extremes[cycle, 0], out)
    books.extremes[cycle, 1] = max(books.extremes[cycle, 1], out)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def stored(motion, plant, table, memory):
    """Energy of the modes and of the elements [J]."""
    out = 0.0
    for i in range(plant.square.size):
        out += motion[1, i]**2 + plant.square[i] * motion[0, i]**2
    out *= 0.5 * plant.mass
    for f in range(plant.faces.shape[0]):
        out += carried(f, table, memory)[1]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def wait(motion, plant, table, memory):
    """A little longer [s] than until the next element yields, by the speeds of the slides."""
    out = 1e300
    for f in range(plant.faces.shape[0]):
        speed = 0.0
        for i in range(plant.square.size):
            speed += plant.faces[f, i] * motion[1, i]
        gap = threshold(f, 1.0 if speed > 0 else -1.0, table, memory) - memory.place[f]
        if speed * gap > 0:
            out = min(out, gap / speed)
    return 1.3 / REACH * out


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def output_of(motion, plant):
    """Motion of the output [m]."""
    out = 0.0
    for i in range(plant.square.size):
        out += plant.output[i] * motion[0, i]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def happen(what, face, sign, plant, table, memory, clock):
    """Change the elements, and note what stands still, as the event asks."""
    if what == YIELDS:
        give_way(face, sign, table, memory)
    elif what == TURNS:
        turn(face, memory)
        clock.rest[face] = 1.0
        if plant.along == face:
            clock.rest[plant.faces.shape[0]] = 1.0
    elif what == OUTPUT_TURNS:
        clock.rest[face] = 1.0
    if what == YIELDS or what == TURNS:
        memory.force[face] = carried(face, table, memory)[0]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def passed(top, plant, motion, room, travel, u):
    """u at which the output, monotone up to `u`, passes +-travel [m]; NONE if it does not."""
    faces = plant.faces.shape[0]
    poly = room.polys[faces + 1]
    speed_series(plant.output, room.coefs, top, poly)
    here, step = output_of(motion, plant), moved(poly, top, u)
    if abs(here + step) <= travel or step == 0.0:
        return NONE
    return crossing(poly, top, (travel if step > 0 else -travel) - here, u, room.polys[faces])


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def march(stop, motion, plant, table, memory, clock, books, room, rows):
    """Run from the clock's time to `stop` (cycle, offset [s]).

    motion (2, n), memory, clock and books move along; rows (r, HEAD + 2 n + EACH i): one per piece, none are written
    where r = 0. Returns (DONE, FULL, TRAVEL or PILED, rows used). Cost: 0.2 to 0.5 us a piece of one mode.
    """
    used, first, now = 0, 1.0, clock.now
    faces = plant.faces.shape[0]
    for f in range(faces):
        memory.force[f] = carried(f, table, memory)[0]
    while now[0] < stop[0] or (now[0] == stop[0] and now[1] < stop[1]):
        if used == rows.shape[0] and used > 0:
            return FULL, used
        left, segment = left_of(clock, stop), clock.segments[int(now[2])]
        theta = phase_of(segment, now[0], now[1], clock.period[0])
        for f in range(faces):
            room.springs[f] = tangent(f, table, memory)[0]
        rate = max(fastest(plant, room.springs), segment[RATE], 1 / clock.period[0])
        h = min(REACH / rate * min(1.0, max(rate * wait(motion, plant, table, memory), 0.02)), left)
        whole = h == left
        top = powers(rate * h)
        drive_series(segment, now[0], now[1], clock.period[0], h, top, room.waves)
        motion_series(motion, memory.force, room.springs, plant, room.waves[0], h, top, room.coefs, room.pull)
        u, what, face, sign = next_event(top, plant, table, memory, clock, room)
        if books.limits[0] < 1e300 and u > 0:
            root = passed(top, plant, motion, room, books.limits[0], u)
            if root <= u:
                u, what = root, STOPS
        if u > 0:
            if now[1] == 0.0:
                widen(output_of(motion, plant), clock, books)
            if rows.shape[0] > 0:
                write(rows[used], motion, u * h, theta, first, plant, table, memory, clock)
                used += 1
            sums(rate * h, u, h, top, plant, clock, books, room)
            if u > AT_ONCE:
                for f in range(faces + 1):
                    clock.rest[f] = 0.0
            if whole and u == 1.0:
                advance(u, h, top, motion, plant, table, memory, clock, books, room)
                arrive(clock, stop, left)
            else:
                advance(u, h, top, motion, plant, table, memory, clock, books, room)
                now[1] += u * h
            books.ledger[5] = max(books.ledger[5], stored(motion, plant, table, memory))
            books.ledger[6] += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * clock.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return PILED, used
        first = 2.0 * (what == TURNS or what == OUTPUT_TURNS) + (what == YIELDS)
        happen(what, face, sign, plant, table, memory, clock)
        if what == STOPS:
            return TRAVEL, used
    return DONE, used


__all__ = ["DONE", "EACH", "EPS", "FULL", "HEAD", "PILED", "TRAVEL", "march"]
