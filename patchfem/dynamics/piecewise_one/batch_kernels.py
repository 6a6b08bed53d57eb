"""Compiled runs of one mode behind the elements of one interface, many in one call, each with what its last cycles
show and, where it still changes, the motion that it settles to."""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.drive_kernels import OMEGA
from ..piecewise.march_kernels import DONE
from ..piecewise.memory_kernels import carried, tangent
from .names_kernels import (
    ALIKE,
    BEGUN,
    EVER,
    FACE,
    FINE,
    HELD,
    LOST,
    MASS,
    MOVING,
    REPEATS,
    SEGMENT,
    SLIP_HIGH,
    SLIP_LOW,
    SQUARE,
    STEADY,
    STORED,
    TOLERANCE,
    UNKNOWN,
    V0,
    Z0,
    V,
    Z,
)
from .one_kernels import march
from .steady_kernels import settled, take, take_all
from .window_kernels import SLIPS, window

CHANGES = 1e-2  # share of the tolerance by which windows may differ in a motion that has settled


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def begin(rig, start, segment, sorts, table, motion, memory, clock, books, last):
    """A case at its start: its elements, unstretched, and empty books. sorts: its reach, stiff, limit and twice."""
    motion[0, 0], motion[1, 0] = start[Z0], start[V0]
    most = sorts.shape[1]
    for k in range(most):
        table.reach[0, k], table.stiff[0, k] = sorts[0, k], sorts[1, k]
        table.limit[0, k], table.twice[0, k] = sorts[2, k], sorts[3, k]
    memory.place[0], memory.slipping[0], memory.way[0], memory.depth[0] = rig[FACE] * start[Z0], 0, 0.0, 1
    memory.upto[0, 0], memory.at[0, 0], memory.side[0, 0] = table.count[0], memory.place[0], 0.0
    memory.force[0], memory.slip[0], memory.worked[0], memory.lost[0] = 0.0, 0.0, 0.0, 0.0
    take(clock.segments[0], segment)
    clock.now[:], clock.rest[:] = 0.0, 0.0
    last[0, SEGMENT], last[0, REPEATS] = -1.0, 0.0
    clock.period[0] = 2 * np.pi / segment[OMEGA]
    books.ledger[:], books.phasors[:], books.limits[1] = 0.0, 0.0, 0.0
    books.extremes[:, 0], books.extremes[:, 1] = np.inf, -np.inf


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def stored(rig, motion, table, memory):
    """Energy of the mode and of the elements [J]."""
    return 0.5 * rig[MASS] * (motion[1, 0]**2 + rig[SQUARE] * motion[0, 0]**2) + carried(0, table, memory)[1]


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def still_changes(extremes, cycles, last, tolerance):
    """Whether the amplitudes of the last three windows differ by a share of the tolerance."""
    least, most, end = np.inf, -np.inf, 0.0
    for k in range(3):
        low, high = np.inf, -np.inf
        for j in range(cycles - (k + 1) * last, cycles - k * last):
            low, high = min(low, extremes[j, 0]), max(high, extremes[j, 1])
        least, most = min(least, 0.5 * (high - low)), max(most, 0.5 * (high - low))
        end = 0.5 * (high - low) if k == 0 else end
    return most - least > CHANGES * tolerance * end


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def count_on(end, memory, clock, books, begun):
    """Count the cycles up to `end` as the one before them, bit by bit, of a motion that repeats; begun (10,): ledger,
    work and loss of the elements where that one began."""
    now, ledger = int(clock.now[0]), books.ledger
    many = end - now
    for k in range(ledger.size):
        if k not in (5, 7):  # the largest energy, and whether any slipped
            ledger[k] += many * (ledger[k] - begun[k])
    memory.worked[0] += many * (memory.worked[0] - begun[8])
    memory.lost[0] += many * (memory.lost[0] - begun[9])
    for k in range(now, end):
        take(books.extremes[k], books.extremes[now - 1])
    clock.now[0] = end


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def alike(rows, used, cycles, first, period):
    """Rows (r, w) of `cycles` cycles from the number `first` on, of `used` ones of a single cycle."""
    for k in range(cycles):
        for j in range(used):
            row = rows[k * used + j]
            if k > 0:
                take(row, rows[j])
            row[5] = first + k
            row[0] = row[5] * period + row[6]


@njit(error_model="numpy", cache=True, nogil=True, fastmath=FAST, **LEAN)
def runs(cases, shape, work, answers, codes):
    """Runs from rest or not under one sine each.

    cases: rigs (n, 6) and starts (n, 5) by the places of `names_kernels`, segments (n, 10) of the drives, counts (n,)
    and sorts (n, 4, t + 1) of the elements; shape: (cycles, cycles of the window); work: as `room.work_of` has it.
    answers: extremes of the output per cycle (n, c, 2), its parts at the drive's frequency in the last cycle of last
    windows (n, windows, 2), ledgers (n, 8), numbers (n, NUMBERS) of `window_kernels`, ends (n, 5), steady (n, 3) and
    slope (n, MOST, MOST) as of `settled`; codes (n,).
    """
    rigs, starts, segments, counts, sorts = cases
    cycles, last = shape
    table, motion, memory, clock, books, state, room, rows, more, begun = work
    extremes, phasors, ledgers, numbers, ends, steady, slopes = answers
    for n in range(codes.size):
        rig, segment = rigs[n], segments[n]
        table.count[0] = counts[n]
        begin(rig, starts[n], segment, sorts[n], table, motion, memory, clock, books, state)
        ends[n, BEGUN], codes[n] = stored(rig, motion, table, memory), LOST
        code, settles = DONE, False
        while code == DONE and clock.now[0] < cycles - last and not settles:
            take(begun[:8], books.ledger)
            begun[8], begun[9] = memory.worked[0], memory.lost[0]
            code, _ = march((clock.now[0] + 1, 0.0), motion, rig, table, memory, clock, books, state, room, rows[:0])
            settles = state[0, REPEATS] == 1.0
        if code != DONE:
            continue
        before, skipped = memory.way[0] if tangent(0, table, memory)[1] >= SLIPS else 0.0, int(clock.now[0])
        if settles:
            count_on(cycles - 1, memory, clock, books, begun)
        code, used = march((float(cycles), 0.0), motion, rig, table, memory, clock, books, state, room, rows)
        if code != DONE or (settles and used * last > rows.shape[0]):
            continue
        first = 0
        if settles:
            alike(rows, used, last, cycles - last, clock.period[0])
            first, used = (last - 1) * used, last * used
            for k in range(skipped, cycles - 1):
                take(books.phasors[k], books.phasors[cycles - 1])
        final = (motion[0, 0], motion[1, 0], memory.force[0], memory.slip[0], memory.worked[0])
        window(rows, (used, first, last), final, before, rig, segment, clock, starts[n, MOVING], room, numbers[n])
        numbers[n, ALIKE] = 1.0 if settles else 0.0
        ends[n, Z], ends[n, V], ends[n, EVER] = motion[0, 0], motion[1, 0], memory.lost[0]
        ends[n, STORED] = stored(rig, motion, table, memory)
        take(ledgers[n], books.ledger)
        take_all(extremes[n], books.extremes)
        for k in range(phasors.shape[1]):
            take(phasors[n, phasors.shape[1] - 1 - k], books.phasors[cycles - 1 - k * last])
        codes[n] = FINE
        holds = numbers[n, SLIP_HIGH] - numbers[n, SLIP_LOW] <= 2 * starts[n, HELD]
        if not holds and still_changes(books.extremes, cycles, last, starts[n, TOLERANCE]):
            found = settled(motion, rig, segment, table, memory, clock, room, more, steady[n], slopes[n])
            codes[n] = STEADY if found else UNKNOWN
