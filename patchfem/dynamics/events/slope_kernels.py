"""Compiled run from event to event that carries its derivative along.

What an interface remembers is where its slide turned. The force is continuous in those places and in the slide, so at a
yield or a turning point nothing jumps, and the derivative over a run is the product of the linear flows of its pieces
alone. A turning point may shift in time, but the slide is at rest there, so the derivative of the new turning place is
that of the slide.
"""

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from .drive_kernels import drive_series, rate_of
from .march_kernels import AT_ONCE, MOST_IDLE, advance, arrive, happen, left_of, output_of, wait, widen
from .memory_kernels import pulled, tangent
from .search_kernels import TURNS, next_event
from .series_kernels import REACH, fastest, motion_series, powers


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def carry(u, h, top, slopes, marks, plant, table, memory, room, spare):
    """Move slopes (2, n, s) of coordinates and rates over a piece up to u; marks (i, t + 2, s): those of the turning
    places.

    spare: the slopes of one number (2, n), the force on them (i,), their series (terms, n).
    """
    one, force, coefs = spare
    n, faces, zero = len(plant.square), len(plant.reach), room.waves[1]
    for s in range(slopes.shape[2]):
        for i in range(n):
            one[0, i], one[1, i] = slopes[0, i, s], slopes[1, i, s]
        for f in range(faces):
            first, moved = memory.slipping[f], 0.0
            for i in range(n):
                moved += plant.faces[f, i] * one[0, i]
            force[f] = room.springs[f] * moved
            for k in range(memory.depth[f] - 1, -1, -1):
                end = memory.upto[f, k]
                force[f] -= (table.stiff[f, end] - table.stiff[f, first]) * marks[f, k, s]
                first = end
        motion_series(one[0], one[1], force, room.springs, plant, zero, h, top, coefs, room)
        for i in range(n):
            place, rate = coefs[top, i], top * coefs[top, i]
            for k in range(top - 1, 0, -1):
                place = place * u + coefs[k, i]
                rate = rate * u + k * coefs[k, i]
            slopes[0, i, s] = coefs[0, i] + u * place
            slopes[1, i, s] = rate / h


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def follow(stop, motion, slopes, marks, plant, table, memory, clock, books, room, spare, seen):
    """`march_kernels.march` without rows and energies, with the derivative: pieces, -1 where events pile up.

    slopes (2, n, s) of the motion and marks (i, t + 2, s) of the memory's turning places, to s numbers, move along;
    spare: room as `carry` has it; seen (2, i): most elements that slip, fewest groups that stay.
    """
    for f in range(len(plant.reach)):
        memory.force[f] = pulled(f, table, memory)
    now, faces, n, pieces = clock.now, len(plant.reach), len(plant.square), 0
    for k in range(room.waves.shape[1]):
        room.waves[1, k] = 0.0
    while now[0] < stop[0] or (now[0] == stop[0] and now[1] < stop[1]):
        left, segment = left_of(clock, stop), clock.segments[int(now[2])]
        for f in range(faces):
            room.springs[f] = tangent(f, table, memory)[0]
            seen[0, f] = max(seen[0, f], memory.slipping[f])
            seen[1, f] = min(seen[1, f], memory.depth[f])
        rate = max(fastest(plant, room.springs), rate_of(segment, clock.period[0]))
        h = min(REACH / rate * min(1.0, max(rate * wait(motion, plant, table, memory), 0.02)), left)
        whole = h == left
        top = powers(rate * h)
        drive_series(segment, now[0], now[1], clock.period[0], h, top, room.waves)
        motion_series(motion[0], motion[1], memory.force, room.springs, plant, room.waves[0], h, top, room.coefs, room)
        u, what, face, sign = next_event(top, plant, table, memory, clock, room)
        if u > 0:
            if now[1] == 0.0:
                widen(output_of(motion, plant), clock, books)
            carry(u, h, top, slopes, marks, plant, table, memory, room, spare)
            if u > AT_ONCE:
                for f in range(faces + 1):
                    clock.rest[f] = 0.0
            advance(u, h, top, motion, plant, table, memory, clock, books, room)
            if whole and (u == 1.0 or now[1] + u * h >= now[1] + left):
                arrive(clock, stop, left)
            else:
                now[1] += u * h
            pieces += 1
        books.limits[1] = books.limits[1] + 1 if u * h < 1e-13 * clock.period[0] else 0.0
        if books.limits[1] > MOST_IDLE:
            return -1
        if what == TURNS and memory.slipping[face] > 0:
            for s in range(slopes.shape[2]):
                moved = 0.0
                for i in range(n):
                    moved += plant.faces[face, i] * slopes[0, i, s]
                marks[face, memory.depth[face], s] = moved
        happen(what, face, sign, plant, table, memory, clock)
    for f in range(faces):
        seen[0, f] = max(seen[0, f], memory.slipping[f])
        seen[1, f] = min(seen[1, f], memory.depth[f])
    return pieces


