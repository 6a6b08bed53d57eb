"""What is read off a step: samples, extremes and harmonics of the cycles, and the step itself at some places.

The extension takes three more slopes, so only a step inside which something is read has one (`watch`).
"""

from math import cos, pi, sin

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps
from .arrays import DONE, ENDS, FORCE, MASS, ORIGIN, PARTS, PERIOD, POWER, SAMPLE, STORED, TIME

# of the part of a step in a cycle, for its phasor
PLACES, SHARES = np.polynomial.legendre.leggauss(4)
# its polynomial at ENDS
LAST_BUT_ONE = np.cos(np.pi * (ENDS.size - 2) / (ENDS.size - 1) * np.arange(ENDS.size)[::-1])
# last terms of the force in a part over its largest; least share of a step in a part
SMOOTH = 1e-9
LEAST = 2.0**-14
MOST_PARTS = 64  # of a step, for which there is to be room


@njit(error_model="numpy", **NJIT_INTERNAL)
def state_of(m, y):
    """(slide [m], speed [m/s], force [N], stored energy [J], irreversible slip [m]) of a state."""
    n = m.rows.shape[1]
    q, v = steps.slide_of(m, y)
    for k in range(m.mem.shape[1]):
        m.mem[1, k] = m.mem[0, k]
    law.end_motion(m.num[0], m.mem[1], m.turn, q - m.now[ORIGIN], v, y[2 * n : y.size - 3])
    force, energy, slip = law.read_memory(m.num[0], m.mem[1], q, v)
    return q, v, force, energy, slip


@njit(error_model="numpy", **NJIT_INTERNAL)
def write(m, t, y, row):
    """Write the sample of a state at the time t [s] into a row of `Kept.samples`."""
    n = m.rows.shape[1]
    if law.IS_SET_VALUED:
        steps.slope(m, t, y, m.work[13])
    row[0] = t
    for i in range(2 * n):
        row[1 + i] = y[i]
    row[2 * n + 1], row[2 * n + 2], row[2 * n + 3], row[2 * n + 5], row[2 * n + 4] = state_of(m, y)
    row[2 * n + 6] = y[y.size - 1]


@njit(error_model="numpy", **NJIT_INTERNAL)
def output_of(m, y):
    """(output [m], its rate [m/s]) of a state."""
    x = 0.0
    w = 0.0
    n = m.rows.shape[1]
    for i in range(n):
        x += m.rows[steps.OUTPUT, i] * y[i]
        w += m.rows[steps.OUTPUT, i] * y[n + i]
    return x, w


@njit(error_model="numpy", **NJIT_INTERNAL)
def may_turn(m):
    """Whether the output may turn inside a step: always with several modes; with one it turns where the slide does,
    which ends a step (`loop_kernels.dips`), and else by round-off alone."""
    return m.rows.shape[1] > 1 or output_of(m, m.y)[1] * output_of(m, m.work[steps.TRIAL])[1] < 0


@njit(error_model="numpy", **NJIT_INTERNAL)
def turning(m, k, a, b, rate):
    """Output [m] where its rate, `rate` at the share a of the step, passes zero before the share b."""
    out = 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        steps.between(m, middle, k.workspace, m.y.size - 3)
        out, here = output_of(m, k.workspace)
        if here * rate > 0:
            a = middle
        else:
            b = middle
        if b - a < 1e-8:  # the output is flat here: its error is the square
            break
    return out


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def bounds(m, h, k, parts):
    """Take the step of h [s] into the extremes of its cycles; parts: of it, at whose ends turns are looked for."""
    x, w = output_of(m, m.y)
    low = x
    high = x
    for part in range(1, parts + 1):
        if part < parts:
            steps.between(m, part / parts, k.workspace, m.y.size - 3)
            x1, w1 = output_of(m, k.workspace)
        else:
            x1, w1 = output_of(m, m.work[steps.TRIAL])
        low = min(low, x1)
        high = max(high, x1)
        if w * w1 < 0:
            top = turning(m, k, (part - 1) / parts, part / parts, w)
            low = min(low, top)
            high = max(high, top)
        w = w1
    extremes(k.cycles, k.counters[PERIOD], m.now[TIME] + 0.5 * h, low, high)


@njit(error_model="numpy", **NJIT_INTERNAL)
def extremes(cycles, period, time, x, y):
    """Take two outputs [m] into the extremes of the cycle of a time [s]."""
    cycle = min(max(int(time / period), 0), cycles.shape[1] - 1)
    cycles[0, cycle] = min(cycles[0, cycle], x, y)
    cycles[1, cycle] = max(cycles[1, cycle], x, y)


@njit(error_model="numpy", **NJIT_INTERNAL)
def phasor(cycles, period, t, h, begin, end):
    """Take the step of h [s] from the time t [s] into the parts at the drive's frequency of the cycles that are asked
    for (not NaN); begin, end: output [m], its rate and acceleration there.

    2/T int x exp(-i omega t) dt of the quintic through both, h^6/46080 of its sixth derivative.
    """
    first = int(t / period)
    last = min(int((t + h) / period), cycles.shape[1] - 1)
    for cycle in range(first, last + 1):
        low = max(t, cycle * period)
        high = min(t + h, (cycle + 1) * period)
        if np.isnan(cycles[2, cycle]) or high <= low:
            continue
        p = begin[1] * h
        q = end[1] * h
        a = begin[2] * h * h / 2
        b = end[2] * h * h / 2
        rise = end[0] - begin[0]
        one = rise - p - a
        two = q - p - 2 * a
        three = 2 * (b - a)
        cube = 10 * one - 4 * two + three / 2
        fourth = -15 * one + 7 * two - three
        fifth = 6 * one - 3 * two + three / 2
        for j in range(PLACES.size):
            time = low + 0.5 * (1 + PLACES[j]) * (high - low)
            weight = SHARES[j] * (high - low) / period
            s = (time - t) / h
            turn = 2 * pi * (time / period - cycle)
            x = begin[0] + s * (p + s * (a + s * (cube + s * (fourth + s * fifth))))
            cycles[2, cycle] += weight * x * cos(turn)
            cycles[3, cycle] -= weight * x * sin(turn)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def phasors(m, h, k):
    """Take the step of h [s] into the phasors."""
    n = m.rows.shape[1]
    gain = 0.0
    after = 0.0
    for i in range(n):
        gain += m.rows[steps.OUTPUT, i] * m.work[0, n + i]
        after += m.rows[steps.OUTPUT, i] * m.work[12, n + i]
    x, w = output_of(m, m.y)
    y, v = output_of(m, m.work[steps.TRIAL])
    phasor(k.cycles, k.counters[PERIOD], m.now[TIME], h, (x, w, gain), (y, v, after))


@njit(error_model="numpy", **NJIT_INTERNAL)
def marks(m, h, k):
    """Samples inside the step of h [s], its end included."""
    t = m.now[TIME]
    end = t + h
    while k.counters[SAMPLE] < k.samples.shape[0] and k.samples[int(k.counters[SAMPLE]), 0] <= end:
        j = int(k.counters[SAMPLE])
        steps.between(m, (k.samples[j, 0] - t) / h, k.workspace, m.y.size)
        write(m, k.samples[j, 0], k.workspace, k.samples[j])
        k.counters[SAMPLE] += 1


@njit(error_model="numpy", **NJIT_INTERNAL)
def rough(row, force):
    """Last two Chebyshev terms of the force [N] in a part, its values at ENDS in the column `force` of row."""
    one = 0.0
    two = 0.0
    last = ENDS.size - 1
    for j in range(last + 1):
        weight = (0.5 if j == 0 or j == last else 1.0) * row[j, force]
        one += weight if j % 2 == 0 else -weight
        two += weight * LAST_BUT_ONE[j]
    return (abs(one) + 2 * abs(two)) / last


@njit(error_model="numpy", **NJIT_INTERNAL)
def parted(m, h, k):
    """Write the step of h [s] into `Kept.parts`, in parts in which the force is a polynomial."""
    begin = 0.0
    size = 1.0
    force = 2 * m.rows.shape[1] + 3
    while begin < 1 and k.counters[PARTS] < k.parts.shape[0]:
        row = k.parts[int(k.counters[PARTS])]
        for j in range(ENDS.size):
            at = min(begin + ENDS[j] * size, 1.0)
            steps.between(m, at, k.workspace, m.y.size)
            write(m, m.now[TIME] + at * h, k.workspace, row[j])
            k.counters[FORCE] = max(k.counters[FORCE], abs(row[j, force]))
        if size > LEAST and rough(row, force) > SMOOTH * k.counters[FORCE]:
            size *= 0.5
            continue
        k.counters[PARTS] += 1
        begin += size
        size = min(2 * size, 1 - begin)


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def stored(m, y):
    """Energy of the modes and of the interface [J]."""
    n = m.rows.shape[1]
    out = 0.0
    for i in range(n):
        out += y[n + i] * y[n + i] + m.rows[steps.OMEGA, i] * m.rows[steps.OMEGA, i] * y[i] * y[i]
    return 0.5 * m.now[MASS] * out + state_of(m, y)[3]


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def watch(m, h, k):
    """Take in a step of h [s] before the state moves on."""
    work = m.y.size - 3
    at = int(k.counters[SAMPLE])
    k.counters[POWER] += abs(m.work[steps.TRIAL, work] - m.y[work])
    k.counters[STORED] = max(k.counters[STORED], stored(m, m.work[steps.TRIAL]))
    k.counters[DONE] += 1
    phasors(m, h, k)
    sampled = at < k.samples.shape[0] and k.samples[at, 0] <= m.now[TIME] + h
    whole = k.parts.shape[0] > 0
    if not (whole or sampled or may_turn(m)):
        bounds(m, h, k, 1)
        return
    steps.extended(m, h)
    marks(m, h, k)
    bounds(m, h, k, 1 if m.rows.shape[1] == 1 else 4)
    if whole:
        parted(m, h, k)
