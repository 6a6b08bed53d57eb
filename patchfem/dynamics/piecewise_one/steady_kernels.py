"""Compiled search for the motion that a run of one mode settles to: Newton's method on the map over a period.

The algorithm of `piecewise.steady.settled` for numbers instead of arrays, without its way back to more of the run:
where Newton's step leads away, the caller goes there. Numbers of a point: coordinate, rate, and the turning places that
the elements remember.
"""

from math import cos, sin

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.drive_kernels import AMPLITUDE, CONSTANT, OMEGA, PHASE
from ..piecewise.march_kernels import AT_ONCE, MOST_IDLE
from ..piecewise.memory_kernels import carried, give_way, tangent, turn
from ..piecewise.search_kernels import TURNS, YIELDS
from .line_kernels import moved_to, one_series, order_of
from .names_kernels import AMOUNT, BASE, DAMPING, FACE, LOWEST, MASS, MOST, OUTPUT, RESIDUAL, SQUARE
from .one_kernels import first_event, length

STEPS = 40  # of Newton's method
FAR, GROWN, CLOSED = 1e9, 1e-6, 1e-12  # as in `piecewise.steady`
SINGULAR = 1e-13  # of the largest number in a row


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def take(to, given):
    """Fill a row with another."""
    for k in range(to.size):
        to[k] = given[k]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def take_all(to, given):
    """Fill rows with others."""
    for k in range(to.shape[0]):
        take(to[k], given[k])


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def copy(memory, other):
    """Make `other` the same memory."""
    other.place[0], other.slipping[0], other.way[0] = memory.place[0], memory.slipping[0], memory.way[0]
    other.depth[0] = memory.depth[0]
    for k in range(memory.depth[0]):
        other.upto[0, k], other.at[0, k], other.side[0, k] = memory.upto[0, k], memory.at[0, k], memory.side[0, k]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def first_turned(memory):
    """Number of the first group that has slipped."""
    return 1 if memory.depth[0] > 0 and memory.side[0, 0] == 0.0 else 0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def carry(u, h, top, beta, spring, size, rig, table, memory, slopes, marks, c, wave):
    """Move the slopes (2, s) of coordinate and rate over a piece up to u; marks (t, s): those of the turning places."""
    for s in range(size):
        z, v, first = slopes[0, s], slopes[1, s], memory.slipping[0]
        force = spring * rig[FACE] * z
        for k in range(memory.depth[0] - 1, -1, -1):
            end = memory.upto[0, k]
            force -= (table.stiff[0, end] - table.stiff[0, first]) * marks[k, s]
            first = end
        gain = -rig[SQUARE] * z - rig[FACE] * force / rig[MASS]
        one_series(z, v, gain, beta, rig[DAMPING], 0.0, 0.0, 0.0, h, top, c, wave)
        went, slopes[1, s] = moved_to(u, h, top, c)
        slopes[0, s] = z + went


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def period(point, rig, segment, table, memory, room, slopes, marks, clock, out):
    """Run one period from the point (z, v), memory in place, with slopes (2, s) of its numbers and marks (MOST, s).

    point moves along; out: least and largest output, smallest depth. False where events pile up or too many turning
    places are remembered.
    """
    lines, hulls, _ = room
    c, poly, spare, wave = lines[0], lines[1], lines[2], lines[3]
    alpha, face, base, output, omega = rig[DAMPING], rig[FACE], rig[BASE], rig[OUTPUT], segment[OMEGA]
    size = 2 + memory.depth[0] - first_turned(memory)
    if size > MOST:
        return False
    slopes[:], marks[:] = 0.0, 0.0
    slopes[0, 0], slopes[1, 1] = 1.0, 1.0
    for k in range(2, size):
        marks[k - 2 + first_turned(memory), k] = 1.0
    z, v, time, idle, rests = point[0], point[1], 0.0, 0, False
    memory.place[0] = face * z
    force = carried(0, table, memory)[0]
    out[0], out[1], out[2] = output * z, output * z, memory.depth[0]
    slowest, whole = 1 / clock.period[0], clock.period[0]
    while time < whole:
        theta, left = segment[PHASE] + omega * time, whole - time
        push, side = -base * segment[AMPLITUDE] * sin(theta), -base * segment[AMPLITUDE] * cos(theta)
        spring, _, _ = tangent(0, table, memory)
        beta, constant = rig[SQUARE] + spring * face * face / rig[MASS], -base * segment[CONSTANT]
        gain = push + constant - rig[SQUARE] * z - face * force / rig[MASS]
        h, x, near = length(left, slowest, (alpha, beta, gain, constant, omega), v, side, face, table, memory, rests)
        top = order_of(x)
        one_series(z, v, gain, beta, alpha, push, side, omega * h, h, top, c, wave)
        u, what, sign = first_event(top, near, face, c, poly, spare, hulls, table, memory, rests)
        if u > 0.0:
            went, v = moved_to(u, h, top, c)
            z += went
            carry(u, h, top, beta, spring, size, rig, table, memory, slopes, marks, poly, spare)
            rests = rests and u <= AT_ONCE
            force += spring * face * went
            memory.place[0] = face * z
            time = whole if u == 1.0 and h == left else time + u * h
            out[0], out[1] = min(out[0], output * z), max(out[1], output * z)
        idle = idle + 1 if u * h < 1e-13 * whole else 0
        if idle > MOST_IDLE:
            return False
        if what == YIELDS:
            give_way(0, sign, table, memory)
        elif what == TURNS:
            if memory.slipping[0] > 0:
                if memory.depth[0] == MOST:
                    return False
                for s in range(size):
                    marks[memory.depth[0], s] = face * slopes[0, s]
            turn(0, memory)
            rests = True
            force = carried(0, table, memory)[0]
        out[2] = min(out[2], float(memory.depth[0]))
    point[0], point[1] = z, v
    return True


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def equal(some, others, count):
    """Whether the first numbers of two rows are the same."""
    for k in range(count):
        if some[0, k] != others[0, k]:
            return False
    return True


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def alike(one, other):
    """Whether two memories have turning places of the same kind."""
    return one.depth[0] == other.depth[0] and equal(one.side, other.side, one.depth[0])


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def same(one, other):
    """Whether two memories that are alike hold the same elements in every group, and let the same ones slip."""
    slips = one.slipping[0] == other.slipping[0] and one.way[0] == other.way[0]
    return slips and equal(one.upto, other.upto, one.depth[0])


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def missed(point, memory, end, after, face, omega):
    """(largest difference of two points over the size of the motion, that size [m]), of the motions alone where the
    memories are not alike."""
    size = max(abs(point[0]), abs(end[0]), abs(point[1]) / omega, abs(end[1]) / omega, 1e-300)
    out = max(abs(end[0] - point[0]) / size, abs(end[1] - point[1]) / (size * omega))
    if alike(memory, after):
        for k in range(first_turned(memory), memory.depth[0]):
            out = max(out, abs(after.at[0, k] - memory.at[0, k]) / (size * abs(face)))
    return out, size


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def direction(point, memory, end, after, least, slopes, marks, size, scales, matrix, step):
    """Newton's step (size,) of a point whose end is alike, by elimination; False where it has none."""
    first = first_turned(memory)
    for i in range(size):
        here = point[i] if i < 2 else memory.at[0, i - 2 + first]
        there = end[i] if i < 2 else after.at[0, i - 2 + first]
        fixed = i >= 2 and i - 2 + first < least
        for j in range(size):
            part = slopes[i, j] if i < 2 else marks[i - 2 + first, j]
            kept = fixed or (j >= 2 and j - 2 + first < least)
            matrix[i, j] = (1.0 if i == j else 0.0) if kept else \
                (part - (1.0 if i == j else 0.0)) * scales[j] / scales[i]
        step[i] = 0.0 if fixed else (here - there) / scales[i]
    for k in range(size):
        best = k
        for i in range(k + 1, size):
            if abs(matrix[i, k]) > abs(matrix[best, k]):
                best = i
        if abs(matrix[best, k]) < SINGULAR:
            return False
        for j in range(size):
            matrix[k, j], matrix[best, j] = matrix[best, j], matrix[k, j]
        step[k], step[best] = step[best], step[k]
        for i in range(k + 1, size):
            share = matrix[i, k] / matrix[k, k]
            for j in range(k, size):
                matrix[i, j] -= share * matrix[k, j]
            step[i] -= share * step[k]
    for k in range(size - 1, -1, -1):
        for j in range(k + 1, size):
            step[k] -= matrix[k, j] * step[j]
        step[k] /= matrix[k, k]
    for i in range(size):
        step[i] *= scales[i]
    return True


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def shifted(point, memory, step, size, share, trial, other):
    """Move the numbers of a point by a share of a step, to `trial` and the memory `other` of its end."""
    first = first_turned(memory)
    trial[0], trial[1] = point[0] + share * step[0], point[1] + share * step[1]
    for i in range(2, size):
        other.at[0, i - 2 + first] = memory.at[0, i - 2 + first] + share * step[i]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def told(point, memory, end, after, found, slopes, marks, rig, omega, answer, slope):
    """Fill answer and slope of a point and its map, as `settled` has them."""
    first, size = first_turned(memory), 2 + memory.depth[0] - first_turned(memory)
    answer[AMOUNT], answer[LOWEST] = 0.5 * (found[1] - found[0]), found[2]
    answer[RESIDUAL] = missed(point, memory, end, after, rig[FACE], omega)[0]
    slope[:] = 0.0
    for i in range(size):
        for j in range(size):
            if (i < 2 or i - 2 + first >= found[2]) and (j < 2 or j - 2 + first >= found[2]):
                slope[i, j] = slopes[i, j] if i < 2 else marks[i - 2 + first, j]


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def settled(motion, rig, segment, table, memory, clock, room, more, answer, slope):
    """Find the periodic motion that a run settles to, from motion (2, 1) and memory at phase 0 of a sine.

    more: four memories, numbers (8, MOST) and matrices (5, 2 MOST, 2 MOST) to work in. answer (3,): amplitude [m],
    residual and smallest depth; slope (MOST, MOST): derivative over a period of the numbers that change, zeros beside
    it. Returns whether it was found.
    """
    (here, after, other, beyond), lists, matrices = more
    point, end, trial, close, step, scales, found, next_found = (lists[0], lists[1], lists[2], lists[3], lists[4],
                                                                 lists[5], lists[6], lists[7])
    slopes, marks, next_slopes, next_marks, matrix = (matrices[0], matrices[1], matrices[2], matrices[3], matrices[4])
    omega, face = segment[OMEGA], rig[FACE]
    moved = max(abs(segment[AMPLITUDE] * rig[BASE]) / (omega * omega), 1e-300)
    point[0], point[1] = motion[0, 0], motion[1, 0]
    end[0], end[1] = point[0], point[1]
    copy(memory, here)
    copy(memory, after)
    if memory.depth[0] > MOST or not period(end, rig, segment, table, after, room, slopes, marks, clock, found):
        return False
    for _ in range(STEPS):
        miss, most = missed(point, here, end, after, face, omega)
        if most / moved > FAR:
            return False
        size, better = 2 + here.depth[0] - first_turned(here), False
        for i in range(size):
            scales[i] = most if i == 0 else most * omega if i == 1 else most * abs(face)
        if alike(here, after) and direction(point, here, end, after, found[2], slopes, marks, size, scales, matrix,
                                            step):
            share = 1.0
            while share > 0.04 and not better:
                copy(after, other)
                shifted(point, here, step, size, share, trial, other)
                copy(other, beyond)
                close[0], close[1] = trial[0], trial[1]
                better = period(close, rig, segment, table, beyond, room, next_slopes, next_marks, clock, next_found) \
                    and missed(trial, other, close, beyond, face, omega)[0] < (1 - 0.4 * share) * miss
                share = share * 0.5 if share == 1.0 else share * 0.4 if share == 0.5 else share * 0.25
        if miss <= CLOSED and miss * most / moved <= GROWN and alike(here, after) and same(here, after):
            if better and alike(other, beyond):
                told(trial, other, close, beyond, next_found, next_slopes, next_marks, rig, omega, answer, slope)
            else:
                told(point, here, end, after, found, slopes, marks, rig, omega, answer, slope)
            return True
        if not better:
            return False
        copy(other, here)
        copy(beyond, after)
        take(point, trial)
        take(end, close)
        take(found, next_found)
        take_all(slopes, next_slopes)
        take_all(marks, next_marks)
    return False
