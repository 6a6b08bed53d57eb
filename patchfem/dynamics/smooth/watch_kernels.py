"""What is read off a step: samples, extremes and harmonics of the cycles, peaks of the last ones.

The extension takes three more slopes, so only a step inside which something is read has one (`inside`).
"""

from math import cos, pi, sin

import numpy as np

from ...compiled.inner import njit
from ...compiled.series_kernels import sine
from ...friction.flags_kernels import INNER
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps

PLACES, SHARES = np.polynomial.legendre.leggauss(4)  # of the part of a step in a cycle, for its phasor
PARTS = 8  # of a step, among which its peaks are looked for
ROUGHLY = 0.15  # of what a number changes by in a step, by which its peak may lie above the parabola
BULGES = 2.0  # times what a parabola through ends and middle rises above them: what its number may
HALVES = 2  # of a step, in each of which sticking may begin or end once
FLAT = 1e-11  # of a peak, that is not looked for
STEEP = 0.25  # of the slope beside the end of a step: where its end is as steep, a peak lies in another step
NEAR = 0.05  # of what a number changes by in a step, by which its peak may lie above the places looked at
NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
ACCELERATION, FORCE, SLIP, SLIP_LEAST, OUTPUT, OUTPUT_LEAST, SLOTS = range(7)  # of the peaks
# of Kept.tally
PEAKS, WAVES, POWER, STORED, LOST, DONE, REFUSED, TURNS, SAMPLE, WANTED, PERIOD = 0, 6, *range(10, 19)
HELD, START, STARTS, SIDE, OUTPUTS, MEANS, BEGIN, END = 19, 20, 22, 23, 24, 28, 30, 31
SHARE = 0.5  # irreversible part of the slide from which an interface slips, as `response.measures` has it
BESIDE = 1e-3  # of a step, over which the share is taken
CROSSED = 1e-9  # of a step, to which the place is known where it begins to slip or ends
STILL = 1e-14  # of the slide, below which it does not slide


@njit(error_model="numpy", **INNER)
def state_of(m, y):
    """(slide [m], speed [m/s], force [N], stored energy [J], irreversible slip [m]) of a state."""
    n = m.rows.shape[1]
    q, v = steps.slide_of(m, y)
    force, energy, slip = law.shown(m.num, m.mem, m.turn, q - m.now[steps.ORIGIN], q, v, y[2 * n:y.size - 3])
    return q, v, force, energy, slip


@njit(error_model="numpy", **INNER)
def write(m, t, y, row):
    """Write the sample of a state at the time t [s] into a row of `Kept.samples`."""
    n = m.rows.shape[1]
    row[0] = t
    for i in range(2 * n):
        row[1 + i] = y[i]
    row[2 * n + 1], row[2 * n + 2], row[2 * n + 3], row[2 * n + 5], row[2 * n + 4] = state_of(m, y)
    row[2 * n + 6] = y[y.size - 1]


@njit(error_model="numpy", **INNER)
def output_of(m, y):
    """(output [m], its rate [m/s]) of a state."""
    x, w, n = 0.0, 0.0, m.rows.shape[1]
    for i in range(n):
        x += m.rows[steps.OUTPUT, i] * y[i]
        w += m.rows[steps.OUTPUT, i] * y[n + i]
    return x, w


@njit(error_model="numpy", **INNER)
def may_turn(m):
    """Whether the output may turn inside a step: always with several modes; with one it turns where the slide does,
    which ends a step (`loop_kernels.dips`), and else by round-off alone."""
    return m.rows.shape[1] > 1 or output_of(m, m.y)[1] * output_of(m, m.work[steps.TRIAL])[1] < 0


@njit(error_model="numpy", **INNER)
def turning(m, k, a, b, rate):
    """Output [m] where its rate, `rate` at the share a of the step, passes zero before the share b."""
    out = 0.0
    for _ in range(60):
        middle = 0.5 * (a + b)
        steps.between(m, middle, k.room[0], m.y.size - 3)
        out, here = output_of(m, k.room[0])
        if here * rate > 0:
            a = middle
        else:
            b = middle
        if b - a < 1e-8:  # the output is flat here: its error is the square
            break
    return out


@njit(error_model="numpy", **INNER)
def bounds(m, h, k, parts):
    """Take the step of h [s] into the extremes of its cycles; parts: of it, at whose ends turns are looked for."""
    x, w = output_of(m, m.y)
    low, high = x, x
    for part in range(1, parts + 1):
        if part < parts:
            steps.between(m, part / parts, k.room[0], m.y.size - 3)
            x1, w1 = output_of(m, k.room[0])
        else:
            x1, w1 = output_of(m, m.work[steps.TRIAL])
        low, high = min(low, x1), max(high, x1)
        if w * w1 < 0:
            top = turning(m, k, (part - 1) / parts, part / parts, w)
            low, high = min(low, top), max(high, top)
        w = w1
    extremes(k.cycles, k.tally[PERIOD], m.now[steps.TIME] + 0.5 * h, low, high)


@njit(error_model="numpy", **INNER)
def extremes(cycles, period, time, x, y):
    """Take two outputs [m] into the extremes of the cycle of a time [s]."""
    cycle = min(max(int(time / period), 0), cycles.shape[1] - 1)
    cycles[0, cycle] = min(cycles[0, cycle], x, y)
    cycles[1, cycle] = max(cycles[1, cycle], x, y)


@njit(error_model="numpy", **INNER)
def phasor(cycles, period, t, h, begin, end):
    """Take the step of h [s] from the time t [s] into the parts at the drive's frequency of the cycles that are asked
    for (not NaN); begin, end: output [m], its rate and acceleration there.

    2/T int x exp(-i omega t) dt of the quintic through both, h^6/46080 of its sixth derivative.
    """
    first, last = int(t / period), min(int((t + h) / period), cycles.shape[1] - 1)
    for cycle in range(first, last + 1):
        low, high = max(t, cycle * period), min(t + h, (cycle + 1) * period)
        if np.isnan(cycles[2, cycle]) or high <= low:
            continue
        p, q, a, b, rise = begin[1] * h, end[1] * h, begin[2] * h * h / 2, end[2] * h * h / 2, end[0] - begin[0]
        one, two, three = rise - p - a, q - p - 2 * a, 2 * (b - a)
        cube, fourth, fifth = 10 * one - 4 * two + three / 2, -15 * one + 7 * two - three, 6 * one - 3 * two + three / 2
        for j in range(PLACES.size):
            time, weight = low + 0.5 * (1 + PLACES[j]) * (high - low), SHARES[j] * (high - low) / period
            s, turn = (time - t) / h, 2 * pi * (time / period - cycle)
            x = begin[0] + s * (p + s * (a + s * (cube + s * (fourth + s * fifth))))
            cycles[2, cycle] += weight * x * sine(turn + pi / 2)
            cycles[3, cycle] -= weight * x * sine(turn)


@njit(error_model="numpy", **INNER)
def phasors(m, h, k):
    """Take the step of h [s] into the phasors."""
    n, gain, after = m.rows.shape[1], 0.0, 0.0
    for i in range(n):
        gain += m.rows[steps.OUTPUT, i] * m.work[0, n + i]
        after += m.rows[steps.OUTPUT, i] * m.work[12, n + i]
    (x, w), (y, v) = output_of(m, m.y), output_of(m, m.work[steps.TRIAL])
    phasor(k.cycles, k.tally[PERIOD], m.now[steps.TIME], h, (x, w, gain), (y, v, after))


@njit(error_model="numpy", **INNER)
def inside(m, h, k):
    """Whether something is to be read inside the step of h [s]: peaks, a sample or a turn."""
    at = int(k.tally[SAMPLE])
    sampled = at < k.samples.shape[0] and k.samples[at, 0] <= m.now[steps.TIME] + h
    return k.tally[WANTED] > 0 or sampled or may_turn(m)


@njit(error_model="numpy", **INNER)
def marks(m, h, k):
    """Samples inside the step of h [s], its end included."""
    t = m.now[steps.TIME]
    end = t + h
    while k.tally[SAMPLE] < k.samples.shape[0] and k.samples[int(k.tally[SAMPLE]), 0] <= end:
        j = int(k.tally[SAMPLE])
        steps.between(m, (k.samples[j, 0] - t) / h, k.room[0], m.y.size)
        write(m, k.samples[j, 0], k.room[0], k.samples[j])
        k.tally[SAMPLE] += 1


@njit(error_model="numpy", **INNER)
def sizes(m, t, y, slopes, out):
    """Write the six numbers whose largest values are `Kept.peaks` of a state with its slopes into out."""
    n = m.rows.shape[1]
    _, _, force, _, slip = state_of(m, y)
    x = output_of(m, y)[0]
    gain = m.now[steps.MOVES] * steps.push(m, t)
    for i in range(n):
        gain += m.rows[steps.OUTPUT, i] * slopes[n + i]
    out[ACCELERATION], out[FORCE], out[SLIP], out[SLIP_LEAST] = abs(gain), abs(force), slip, -slip
    out[OUTPUT], out[OUTPUT_LEAST] = x, -x


@njit(error_model="numpy", **INNER)
def sizes_at(m, h, share, k, out):
    """Write the six numbers at a share of the step of h [s] into out."""
    t = m.now[steps.TIME] + share * h
    steps.between(m, share, k.room[0], m.y.size - 3)
    steps.slope(m, t, k.room[0], k.room[1])
    sizes(m, t, k.room[0], k.room[1], out)


@njit(error_model="numpy", **INNER)
def sharpened(m, h, k, which, at, near):
    """Largest value of one of the six numbers near the share `at` of the step: its place by parabolas through places
    `near` apart, and there the number of a step that ends there."""
    out = k.table[PARTS + 1]
    for _ in range(4):
        a, b, c = 0.0, 0.0, 0.0
        at = min(max(at, near), 1 - near)
        for side in range(-1, 2):
            sizes_at(m, h, at + side * near, k, out)
            a, b, c = b, c, out[which]
        bend = a - 2 * b + c
        shift = 0.5 * (a - c) / bend if bend < 0 else 0.0
        at = min(max(at + min(max(shift, -1.0), 1.0) * near, 0.0), 1.0)
        near /= 6
    steps.reached(m, h, at, k.room[0], k.room[1])
    sizes(m, m.now[steps.TIME] + at * h, k.room[0], k.room[1], out)
    return out[which]


@njit(error_model="numpy", **INNER)
def slots(m):
    """How many of the six numbers may have a peak inside a step: with one mode the output turns at its ends alone."""
    return OUTPUT if m.rows.shape[1] == 1 else SLOTS


@njit(error_model="numpy", **INNER)
def may_peak(m, h, k):
    """Whether one of the six numbers may have its largest value of all inside the step of h [s], by its ends and
    middle; takes in the ends of the others."""
    t = m.now[steps.TIME]
    sizes(m, t, m.y, m.work[0], k.table[0])
    sizes(m, t + h, m.work[steps.TRIAL], m.work[12], k.table[PARTS])
    sizes_at(m, h, 0.5, k, k.table[PARTS // 2])
    for which in range(slots(m), SLOTS):
        k.tally[PEAKS + which] = max(k.tally[PEAKS + which], k.table[0, which], k.table[PARTS, which])
    for which in range(slots(m)):
        a, b, c = k.table[0, which], k.table[PARTS // 2, which], k.table[PARTS, which]
        top, least, bend, lean = max(a, b, c), min(a, b, c), a - 2 * b + c, c - a
        if bend < 0 and abs(lean) < -2 * bend:  # its vertex lies in the step
            top += BULGES * (b - top - 0.125 * lean * lean / bend)
        if not top + ROUGHLY * (top - least) <= k.tally[PEAKS + which] + FLAT * abs(k.tally[PEAKS + which]):
            return True
    return False


@njit(error_model="numpy", **INNER)
def rise(table, at, which):
    """What a number may rise above its highest place `at`: what it changes by beside it; 0 at an end of the step to
    which it rises as steeply as before."""
    if 0 < at < PARTS:
        return table[at, which] - min(table[at - 1, which], table[at + 1, which])
    way = 1 if at == 0 else -1
    last, before = table[at, which] - table[at + way, which], table[at + way, which] - table[at + 2 * way, which]
    return last if 1.5 * last - 0.5 * before < STEEP * last else 0.0


@njit(error_model="numpy", **INNER)
def peaks(m, h, k):
    """Take the step of h [s] into the peaks of the last cycles."""
    if not may_peak(m, h, k):
        return
    for part in range(PARTS + 1):
        if part % (PARTS // 2) != 0:
            sizes_at(m, h, part / PARTS, k, k.table[part])
    for which in range(slots(m)):
        at, least, peak = 0, k.table[0, which], max(k.tally[PEAKS + which], k.table[0, which], k.table[PARTS, which])
        k.tally[PEAKS + which] = peak
        for part in range(1, PARTS + 1):
            least = min(least, k.table[part, which])
            at = part if k.table[part, which] > k.table[at, which] else at
        top = k.table[at, which]
        if top + NEAR * (top - least) >= peak and top + rise(k.table, at, which) > peak + FLAT * abs(peak):
            k.tally[PEAKS + which] = max(peak, sharpened(m, h, k, which, at / PARTS, 1 / PARTS))


@njit(error_model="numpy", **INNER)
def harmonics(m, h, k):
    """Take the step of h [s] into the harmonics of the last cycles."""
    t, n = m.now[steps.TIME], m.rows.shape[1]
    omega, own = 2 * pi / k.tally[PERIOD], m.y.size - 3
    for j in range(NODES.size):
        share, weight = 0.5 * (1 + NODES[j]), 0.5 * h * WEIGHTS[j]
        steps.between(m, share, k.room[0], own)
        q, v = steps.slide_of(m, k.room[0])
        force = law.rate(m.num, m.mem, m.turn, q - m.now[steps.ORIGIN], v, k.room[0][2 * n:own], k.room[1][2 * n:own])
        turn, x = omega * (t + share * h), output_of(m, k.room[0])[0]
        c, s = sine(turn + 0.5 * pi), sine(turn)
        k.tally[WAVES + 0] += weight * q * c
        k.tally[WAVES + 1] -= weight * q * s
        k.tally[WAVES + 2] += weight * force * c
        k.tally[WAVES + 3] -= weight * force * s
        k.tally[OUTPUTS + 0] += weight * x * c
        k.tally[OUTPUTS + 1] -= weight * x * s
        k.tally[OUTPUTS + 2] += weight * x * c * (4 * c * c - 3)
        k.tally[OUTPUTS + 3] -= weight * x * s * (3 - 4 * s * s)


@njit(error_model="numpy", **INNER)
def mean_of(m, h, k, begin, which):
    """Take what of the step of h [s] lies in the cycle from `begin` [s] into an integral of the slide."""
    t = m.now[steps.TIME]
    low, high = max(t, begin), min(t + h, begin + k.tally[PERIOD])
    if high <= low:
        return
    if high - low == h:  # the whole of the extension: integrals of s^a (1 - s)^b
        steps.meant(m, k.room[0], m.rows.shape[1])
        k.tally[which] += h * steps.slide_of(m, k.room[0])[0]
        return
    for j in range(NODES.size):
        steps.between(m, (low + 0.5 * (1 + NODES[j]) * (high - low) - t) / h, k.room[0], m.y.size - 3)
        k.tally[which] += 0.5 * (high - low) * WEIGHTS[j] * steps.slide_of(m, k.room[0])[0]


@njit(error_model="numpy", **INNER)
def slipping(m, k, at):
    """Share of the slide that is irreversible at the share `at` of the step, less SHARE: < 0 where it sticks; NaN where
    it does not slide, as beside a reversal in a step of no length."""
    low = min(max(at - BESIDE, 0.0), 1 - 2 * BESIDE)
    steps.between(m, low, k.room[0], m.y.size - 3)
    q0, _, _, _, slip0 = state_of(m, k.room[0])
    steps.between(m, low + 2 * BESIDE, k.room[0], m.y.size - 3)
    q1, _, _, _, slip1 = state_of(m, k.room[0])
    if abs(q1 - q0) <= STILL * max(abs(q0), abs(q1)):
        return np.nan
    return abs((slip1 - slip0) / (q1 - q0)) - SHARE


@njit(error_model="numpy", **INNER)
def starts(m, k, time):
    """Take in that slip starts at a time [s]; slips that mean the same modulo pi count alike."""
    k.tally[START] += cos(4 * pi * time / k.tally[PERIOD])
    k.tally[START + 1] += sin(4 * pi * time / k.tally[PERIOD])
    k.tally[STARTS] += 1


@njit(error_model="numpy", **INNER)
def crossed(m, k, a, b, before, after):
    """Share of the step between a and b at which `slipping`, of opposite signs there, passes zero: the Pegasus method
    (Dowell and Jarratt 1972)."""
    last = a
    for _ in range(60):
        at = b - after * (b - a) / (after - before)
        value = slipping(m, k, at)
        if np.isnan(value) or abs(at - last) < CROSSED or b - a < CROSSED:
            return at
        if (value < 0) == (after < 0):
            before *= after / (after + value)
            b, after = at, value
        else:
            after *= before / (before + value)
            a, before = at, value
        last = at
    return last


@njit(error_model="numpy", **INNER)
def holds(m, h, k):
    """Take the step of h [s] into the time for which the interface sticks, and into the starts of slip after it."""
    t, before = m.now[steps.TIME], k.tally[SIDE]
    if before == 0 or steps.slide_of(m, m.y)[0] == m.now[steps.ORIGIN]:  # beside a reversal it may jump
        before = slipping(m, k, 0.0)
        if np.isnan(before):
            before = k.tally[SIDE] if k.tally[SIDE] != 0 else -SHARE
        if before >= 0 and k.tally[SIDE] < 0:  # it starts between two steps, where the slide turns
            starts(m, k, t)
    for part in range(1, HALVES + 1):
        after, low, high = slipping(m, k, part / HALVES), (part - 1) / HALVES, part / HALVES
        after = before if np.isnan(after) else after
        if (before < 0) == (after < 0):
            k.tally[HELD] += h / HALVES if after < 0 else 0.0
        else:
            at = crossed(m, k, low, high, before, after)
            k.tally[HELD] += h * (at - low if before < 0 else high - at)
            if after >= 0:
                starts(m, k, t + at * h)
        before = after
    k.tally[SIDE] = before


@njit(error_model="numpy", **INNER)
def stored(m, y):
    """Energy of the modes and of the interface [J]."""
    n, out = m.rows.shape[1], 0.0
    for i in range(n):
        out += y[n + i] * y[n + i] + m.rows[steps.OMEGA, i] * m.rows[steps.OMEGA, i] * y[i] * y[i]
    return 0.5 * m.now[steps.MASS] * out + state_of(m, y)[3]


@njit(error_model="numpy", **INNER)
def watch(m, h, k):
    """Take in a step of h [s] before the state moves on."""
    work = m.y.size - 3
    k.tally[POWER] += abs(m.work[steps.TRIAL, work] - m.y[work])
    k.tally[STORED] = max(k.tally[STORED], stored(m, m.work[steps.TRIAL]))
    k.tally[DONE] += 1
    phasors(m, h, k)
    if not inside(m, h, k):
        bounds(m, h, k, 1)
        return
    steps.extended(m, h)
    marks(m, h, k)
    bounds(m, h, k, 1 if m.rows.shape[1] == 1 else 4)
    if k.tally[WANTED] > 0:
        peaks(m, h, k)
        harmonics(m, h, k)
        mean_of(m, h, k, k.tally[BEGIN], MEANS)
        mean_of(m, h, k, k.tally[END] - k.tally[PERIOD], MEANS + 1)
        holds(m, h, k)
