"""Numbers of the last cycles of many motions off their samples and reversals: compiled twins of `response`'s.

A row is time [s], coordinate, its rate, slide [m], its speed [m/s], force [N], irreversible slip [m], energy in the
interface and friction work [J], as the smooth engine writes them (one mode).
"""

from math import inf, nan, sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import INNER, LEAN

TIME, COORDINATE, RATE, SLIDE, SPEED, FORCE, SLIP, STORE, WORK = range(9)
(RANGE, SECANT, RANGE_HALF, SECANT_HALF, SAMPLED, BOOKED, PASSED, FRICTION, DISSIPATED, CREATED, SLIPPED, LARGEST,
 REST) = range(13)
NUMBERS = 13
CLOSE, RESTS = 1e-9, 1e-9  # as `response.loops` has them
STICK = 1e-2  # of the peak slip speed of a cycle, below which an interface sticks (`core.STICK`)


@njit(error_model="numpy", **INNER)
def copied(rows, j, out, k):
    """Copy what is read of a row."""
    out[k, TIME], out[k, SLIDE], out[k, SPEED] = rows[j, TIME], rows[j, SLIDE], rows[j, SPEED]
    out[k, FORCE], out[k, WORK] = rows[j, FORCE], rows[j, WORK]


@njit(error_model="numpy", **INNER)
def merged(rows, turns, count, near, out):
    """Write samples and the reversals among them into out in order, without those nearer than `near` [s] to the one
    before; column 9 is the number of a sample, -1 of a reversal. Returns their number."""
    at, size, end, n, last = 0, 0, rows[-1, TIME], rows.shape[0], -inf
    while at < count and turns[at, TIME] <= rows[0, TIME]:
        at += 1
    for j in range(n):
        while at < count and turns[at, TIME] < rows[j, TIME] and turns[at, TIME] < end:
            if turns[at, TIME] - last > near:
                copied(turns, at, out, size)
                out[size, 9] = -1.0
                size += 1
            last = turns[at, TIME]
            at += 1
        if rows[j, TIME] - last > near:
            copied(rows, j, out, size)
            out[size, 9] = j
            size += 1
        last = rows[j, TIME]
    return size


@njit(error_model="numpy", **INNER)
def halved(rows, size, samples):
    """Leave out every second sample, counted from the last; reversals stay. Returns how many rows are left."""
    left = 0
    for j in range(size):
        if rows[j, 9] < 0 or int(rows[j, 9]) % 2 == (samples - 1) % 2:
            copied(rows, j, rows, left)
            rows[left, 9] = rows[j, 9]
            left += 1
    return left


@njit(error_model="numpy", **INNER)
def place(rows, size, time):
    """Number of the first row not before a time [s]."""
    low, high = 0, size
    while low < high:
        middle = (low + high) // 2
        if rows[middle, TIME] < time:
            low = middle + 1
        else:
            high = middle
    return low


@njit(error_model="numpy", **INNER)
def turn(rows, first, last, way, near):
    """(largest way times slide [m] of the rows first to last - 1, number of the row before it, share of the way to the
    next), as `response.loops.turns_of`."""
    top = first
    for j in range(first, last):
        if way * rows[j, SLIDE] > way * rows[top, SLIDE]:
            top = j
    best, at, share = way * rows[top, SLIDE], top, 0.0
    for k in range(max(top - 1, first), min(top + 1, last - 1)):
        h = rows[k + 1, TIME] - rows[k, TIME]
        if h <= near or way * rows[k, SPEED] <= 0 or way * rows[k + 1, SPEED] >= 0:
            continue
        a, p, q = way * rows[k, SLIDE], way * rows[k, SPEED] * h, way * rows[k + 1, SPEED] * h
        rise = way * rows[k + 1, SLIDE] - a
        mid, big = 3 * rise - 2 * p - q, p + q - 2 * rise
        root = sqrt(max(mid * mid - 3 * big * p, 0.0))
        s = p / (root - mid) if root > mid else 0.0
        value = a + s * (p + s * (mid + s * big))
        if 0 <= s <= 1 and value > best:
            best, at, share = value, k, s
    return best, at, share


@njit(error_model="numpy", **INNER)
def force_at(rows, size, first, last, way, at, share, fastest):
    """Force [N] at a turn that `turn` found; nan where the slide goes on beyond the border of the cycle."""
    if share == 0.0 and (at == first or at == last - 1) and abs(rows[at, SPEED]) > RESTS * fastest:
        k = at - 1 if at == first else at
        before = way * rows[k, SPEED] if 0 <= k < size - 1 else 0.0
        after = way * rows[k + 1, SPEED] if 0 <= k < size - 1 else 0.0
        if not (before > 0 and after <= 0):
            return nan
        at, share = k, before / (before - after)
    return rows[at, FORCE] + share * (rows[min(at + 1, size - 1), FORCE] - rows[at, FORCE])


@njit(error_model="numpy", **INNER)
def cycles_of(rows, size, period, window, out):
    """Write range of the slide [m] and secant stiffness [N/m] (nan for none) into out (2,)."""
    end, fastest = rows[size - 1, TIME], 0.0
    for j in range(size):
        fastest = max(fastest, abs(rows[j, SPEED]))
    reach, stiff, found, near = 0.0, 0.0, 0, CLOSE * period
    for cycle in range(window):
        low = place(rows, size, end - (window - cycle) * period - near)
        high = place(rows, size, end - (window - cycle - 1) * period + near)
        bottom, at, share = turn(rows, low, high, -1.0, near)
        under = force_at(rows, size, low, high, -1.0, at, share, fastest)
        top, at, share = turn(rows, low, high, 1.0, near)
        over = force_at(rows, size, low, high, 1.0, at, share, fastest)
        wide = top + bottom
        reach += wide
        if wide > 0 and not np.isnan(under) and not np.isnan(over):
            stiff += (over - under) / wide
            found += 1
    out[0], out[1] = reach / window, stiff / found if found > 0 else nan


@njit(error_model="numpy", **INNER)
def sums(rows, turns, count, stored, size, kept, out):
    """Write the books of energy: of the `size` rows of `kept` (samples and reversals) into SAMPLED to PASSED, of all
    reversals before the samples and the samples into FRICTION to CREATED."""
    for j in range(size - 1):
        work = kept[j + 1, WORK] - kept[j, WORK]
        out[SAMPLED] += (kept[j, FORCE] + kept[j + 1, FORCE]) * (kept[j + 1, SLIDE] - kept[j, SLIDE]) / 2
        out[BOOKED] += work
        out[PASSED] += abs(work)
    most = 0.0
    for j in range(count):
        most = max(most, abs(turns[j, WORK])) if turns[j, TIME] < rows[0, TIME] else most
    for j in range(rows.shape[0]):
        most = max(most, abs(rows[j, WORK]))
    noise, before = 1e-8 * max(stored, most), 0.0
    for j in range(count + rows.shape[0]):
        if j < count and turns[j, TIME] >= rows[0, TIME]:
            continue
        row = turns[j] if j < count else rows[j - count]
        lost, before = row[WORK] - row[STORE] - before, row[WORK] - row[STORE]
        out[DISSIPATED] += max(lost, 0.0)
        out[CREATED] += -lost if lost < -noise else 0.0
    out[FRICTION] = rows[-1, WORK]


@njit(error_model="numpy", **INNER)
def longest_rest(rows, per_cycle):
    """Most samples in a row between which an interface slips slower than STICK of its peak in the cycle."""
    n, longest, rest = rows.shape[0] - 1, 0, 0
    for first in range(0, n, per_cycle):
        peak = 0.0
        for j in range(first, min(first + per_cycle, n)):
            peak = max(peak, abs((rows[j + 1, SLIP] - rows[j, SLIP]) / (rows[j + 1, TIME] - rows[j, TIME])))
        for j in range(first, min(first + per_cycle, n)):
            rate = abs((rows[j + 1, SLIP] - rows[j, SLIP]) / (rows[j + 1, TIME] - rows[j, TIME]))
            rest = rest + 1 if rate < 1.0001 * STICK * peak or peak == 0 else 0
            longest = max(longest, rest)
    return longest


@njit(error_model="numpy", cache=True, nogil=True, **LEAN)
def read(samples, turns, counts, periods, window, stored, room, out):
    """Numbers of the last `window` cycles of n motions into out (n, NUMBERS), zeros before.

    samples (n, s, 9), the first and the last row at the ends of the window; turns (n, r, 9), the first counts (n,) of
    them there; periods (n,) [s]; stored (n,) largest stored energy [J]; room (s + r, 10). RANGE and SECANT and their
    _HALF twins at every second sample, books of energy [J], range of the slip [m], largest coordinate [m], and the
    samples of the longest rest, as `longest_rest`.
    """
    for n in range(samples.shape[0]):
        rows, count, number = samples[n], int(counts[n]), out[n]
        size = merged(rows, turns[n], count, CLOSE * periods[n], room)
        cycles_of(room, size, periods[n], window, number[RANGE:SECANT + 1])
        sums(rows, turns[n], count, stored[n], size, room, number)
        size = halved(room, size, rows.shape[0])
        cycles_of(room, size, periods[n], window, number[RANGE_HALF:SECANT_HALF + 1])
        low, high = inf, -inf
        for j in range(rows.shape[0]):
            low, high = min(low, rows[j, SLIP]), max(high, rows[j, SLIP])
            number[LARGEST] = max(number[LARGEST], abs(rows[j, COORDINATE]))
        number[SLIPPED] = high - low
        number[REST] = longest_rest(rows, (rows.shape[0] - 1) // window)
