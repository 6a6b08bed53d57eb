"""What the last cycles of a run of one mode show, read off its phases of slip and stick: ranges, loop, peaks.

Plain Python that `batch_kernels` compiles; its twin in arrays is what `sdof` collects of a single run. Within a phase
the motion has one direction, so ranges are those of its ends; integrals take 12 Gauss points per panel of 1.5 rad.

`rig` below: (w, decay, static, kinetic, B, om, share): friction over the mass, push B sin(om t) over the mass, share of
it in the absolute acceleration of a moving base. Numbers are of the coordinate z and over the mass.
"""

from math import ceil, cos, inf, nan, pi, sin, sqrt

import numpy as np

from .keep_kernels import add_phasors
from .slip_kernels import motion, moved, oscillator

X, W = (tuple(map(float, part)) for part in np.polynomial.legendre.leggauss(12))
(LOW, HIGH, WEIGHT, SUM, Z_COS, Z_SIN, COS, SIN, F_COS, F_SIN, POWER, PASSED, A_COS, A_SIN, A3_COS, A3_SIN,
 ACCELERATION, FORCE, FIRST, LAST, STUCK, STARTS, START_COS, START_SIN, RANGE, SECANT, WORK) = range(27)
NUMBERS = 27
TURNS = 512  # turning points of the acceleration that are refined
PEAK = 0.9  # share of the largest sample from which a turning point is refined


def fading(w, decay):
    """Time [s] after which the free motion of a slip is round-off; infinite without damping or spring."""
    slow = decay if w > 0.0 else 0.0
    if slow >= w and w > 0.0:
        slow = w * w / (slow + sqrt((slow - w) * (slow + w))) / 2
    return 40.0 / slow if slow > 0.0 else inf


def place(row, u, o):
    """Coordinate z [m] at u [s] after the start of a phase."""
    if row[3] == 0.0 or u <= 0.0:
        return row[4]
    return row[4] + row[3] * motion(u, row[5], row[6], row[7], row[8], o)[0]


def integrals(row, low, high, rate, rig, o, out):
    """Add to `out` the integrals of the loop, of the first harmonics of slide, force and acceleration and of its third
    over [low, high] [s] of a phase whose fastest motion is `rate` [rad/s]."""
    st, ct, way, b, z0 = sin(row[1]), cos(row[1]), row[3], rig[4], row[4]
    count = max(1, ceil((high - low) * rate / 1.5))
    half = 0.5 * (high - low) / count
    for k in range(count):
        for x, weight in zip(X, W):
            u = low + half * (2 * k + 1 + x)
            w, co, so = half * weight, cos(o[5] * u), sin(o[5] * u)
            cosine, sine = ct * co - st * so, st * co + ct * so
            y, v, a, f = z0, 0.0, 0.0, b * sine - o[0] * z0
            if way != 0.0:
                y, v, a = moved(u, co, so, row[5], row[6], row[7], row[8], o)
                y, v, a, f = z0 + way * y, way * v, way * a, way * rig[3]
            a += rig[6] * b * sine
            c3, s3 = cosine * (4 * cosine * cosine - 3), sine * (3 - 4 * sine * sine)
            out[WEIGHT] += w
            out[SUM] += w * y
            out[Z_COS] += w * y * cosine
            out[Z_SIN] += w * y * sine
            out[COS] += w * cosine
            out[SIN] += w * sine
            out[F_COS] += w * f * cosine
            out[F_SIN] += w * f * sine
            out[POWER] += w * f * v
            out[PASSED] += w * abs(f * v)
            out[A_COS] += w * a * cosine
            out[A_SIN] += w * a * sine
            out[A3_COS] += w * a * c3
            out[A3_SIN] += w * a * s3


def integral(row, low, high, rate, o):
    """Integral of z over [low, high] [s] of a phase."""
    if row[3] == 0.0:
        return row[4] * (high - low)
    count = max(1, ceil((high - low) * rate / 1.5))
    half, out = 0.5 * (high - low) / count, 0.0
    for k in range(count):
        for x, weight in zip(X, W):
            u = low + half * (2 * k + 1 + x)
            out += weight * motion(u, row[5], row[6], row[7], row[8], o)[0]
    return row[4] * (high - low) + row[3] * half * out


def means(rows, first, used, sizes, o, out):
    """Means of z in the first and the last cycle of a window to `out`; sizes: (cycle, window [s], rate [rad/s]).

    The phases are placed by their lengths before the end: in their times, 2e-16 of a long run, two means would differ.
    """
    per, left = sizes[0], 0.0
    for p in range(used - 1, first - 1, -1):
        span = rows[p, 2]
        left += span
        for k in range(2):
            ahead = sizes[1] if k == 0 else per
            a, b = max(left - ahead, 0.0), min(left - ahead + per, span)
            if b > a:
                out[FIRST + k] += integral(rows[p], a, b, sizes[2], o) / per


def acceleration(row, u, rig, o):
    """Absolute acceleration [m s-2] of the coordinate at u [s] after the start of a phase, and its first two rates."""
    turn = row[1] + o[5] * u
    push, rate, second = rig[4] * sin(turn), rig[4] * o[5] * cos(turn), -o[5] * o[5] * rig[4] * sin(turn)
    v, a, jerk, snap = 0.0, 0.0, 0.0, 0.0
    if row[3] != 0.0:
        _, v, a = motion(u, row[5], row[6], row[7], row[8], o)
        v, a = row[3] * v, row[3] * a
        jerk = rate - o[1] * a - o[0] * v
        snap = second - o[1] * jerk - o[0] * a
    return a + rig[6] * push, jerk + rig[6] * rate, snap + rig[6] * second


def peaks(row, low, high, rate, rig, o, turns, found):
    """Samples of the acceleration over [low, high] [s] of a phase, eight per radian of `rate`.

    turns (t, 4): brackets of its turning points: phase at row[9] of `found`, from, to and the first guess; found (3):
    how many there are, the largest sample, the number of the phase.
    """
    count = max(5, ceil((high - low) * rate * 8) + 1)
    before, slope, at = 0.0, 0.0, low
    for k in range(count):
        u = low + (high - low) * k / (count - 1)
        value, turn, _ = acceleration(row, u, rig, o)
        found[1] = max(found[1], abs(value))
        if k > 0 and slope * turn < 0.0 and max(abs(value), abs(before)) >= PEAK * found[1]:
            if found[0] < TURNS:
                one = turns[int(found[0])]
                one[0], one[1], one[2], one[3] = found[2], at, u, at - slope * (u - at) / (turn - slope)
            found[0] += 1.0
        before, slope, at = value, turn, u


def refined(one, row, rig, o):
    """Size of the acceleration at the turning point in a bracket `one` of `peaks`, by Newton's method."""
    u = one[3]
    for _ in range(6):
        _, slope, bend = acceleration(row, u, rig, o)
        if bend != 0.0:
            u = min(max(u - slope / bend, one[1]), one[2])
    return abs(acceleration(row, u, rig, o)[0])


def held(row, low, high, rig, o):
    """Largest force [m s-2] over the mass that holds the interface over [low, high] [s] of a stick."""
    rest, first, last = -o[0] * row[4], row[1] + o[5] * low, row[1] + o[5] * high
    out = max(abs(rest + rig[4] * sin(first)), abs(rest + rig[4] * sin(last)))
    turn = pi * ceil((first - pi / 2) / pi) + pi / 2
    while turn <= last:
        out = max(out, abs(rest + rig[4] * sin(turn)))
        turn += pi
    return out


def noted(best, z, before, after):
    """Widen the range `best` of a cycle to z, between the phases of these numbers."""
    if z < best[0]:
        best[0], best[1], best[2] = z, before, after
    if z > best[3]:
        best[3], best[4], best[5] = z, before, after


def force_beside(rows, number, step, first, used, kinetic):
    """Force over the mass in the slip that is met first from phase `number` on, by steps of 1 or -1; NaN where none is.

    A slip in which nothing moves any more is no slip.
    """
    while first <= number < used:
        if rows[number, 3] != 0.0 and rows[number, 2] > 0.0:
            return rows[number, 3] * kinetic
        number += step
    return nan


def ranges(rows, span, begin, cycles, rig, o, best, out):
    """Mean range of z in a cycle and mean secant stiffness over the mass, of `cycles` cycles of 2 pi/om from `begin`.

    span: (first, last + 1) phase of the window.
    """
    first, used, per, at, seen = span[0], span[1], 2 * pi / rig[5], span[0], 0.0
    for k in range(cycles):
        start, end = begin + k * per, begin + (k + 1) * per
        while at + 1 < used and rows[at + 1, 0] <= start:
            at += 1
        z = place(rows[at], start - rows[at, 0], o)
        best[0], best[1], best[2], best[3], best[4], best[5] = z, at, at, z, at, at
        if k == 0:
            best[1] = best[4] = -1.0
        while at + 1 < used and rows[at + 1, 0] < end:
            at += 1
            noted(best, rows[at, 4], at - 1, at)
        z = place(rows[at], min(end - rows[at, 0], rows[at, 2]), o)
        noted(best, z, at, used if k == cycles - 1 else at)
        out[RANGE] += (best[3] - best[0]) / cycles
        low = 0.5 * (force_beside(rows, int(best[1]), -1, first, used, rig[3])
                     + force_beside(rows, int(best[2]), 1, first, used, rig[3]))
        high = 0.5 * (force_beside(rows, int(best[4]), -1, first, used, rig[3])
                      + force_beside(rows, int(best[5]), 1, first, used, rig[3]))
        if best[3] > best[0] and low == low and high == high:
            out[SECANT] += (high - low) / (best[3] - best[0])
            seen += 1.0
    out[SECANT] = out[SECANT] / seen if seen else nan


def window(rows, used, begin, cycles, rig, room, out):
    """Numbers of the last `cycles` cycles of a run, from `begin` [s] on, to `out` (NUMBERS,).

    rows (r, 10): the last phases of the run as `sdof_kernels.march` writes them, `used` of them; room: (brackets
    (TURNS, 4), numbers (6,)) to work in. False where they do not reach back to `begin` or the acceleration turns too
    often.
    """
    w, decay, om = rig[0], rig[1], rig[5]
    o, gone, per = oscillator(w, decay, om), fading(w, decay), 2 * pi / om
    end, fast, turns, found = begin + cycles * per, max(w, om), room[0], room[1]
    first = used - 1
    while first > 0 and rows[first, 0] > begin:
        first -= 1
    if rows[first, 0] > begin:
        return False
    out[:] = 0.0
    found[:] = 0.0
    out[LOW], out[HIGH] = inf, -inf
    means(rows, first, used, (per, cycles * per, fast), o, out)
    for p in range(first, used):
        row = rows[p]
        low, high = max(row[0], begin) - row[0], min(row[0] + row[2], end) - row[0]
        if high < low or row[0] >= end:
            continue
        z0, z1 = place(row, low, o), place(row, high, o)
        out[LOW], out[HIGH] = min(out[LOW], z0, z1), max(out[HIGH], z0, z1)
        found[2] = p
        if row[3] == 0.0:
            out[STUCK] += high - low
            out[FORCE] = max(out[FORCE], held(row, low, high, rig, o))
            integrals(row, low, high, om, rig, o, out)
            peaks(row, low, high, om, rig, o, turns, found)
        else:
            out[WORK] += row[3] * rig[3] * (z1 - z0)
            out[FORCE] = max(out[FORCE], rig[3])
            middle = min(max(gone, low), high)
            if middle > low:
                integrals(row, low, middle, fast, rig, o, out)
                peaks(row, low, middle, fast, rig, o, turns, found)
            if high > middle:
                integrals(row, middle, high, om, rig, o, out)
                peaks(row, middle, high, om, rig, o, turns, found)
            if p > 0 and rows[p - 1, 3] == 0.0 and rows[p - 1, 2] > 0.0 and row[0] > begin and row[0] < end:
                out[STARTS] += 1.0
                out[START_COS] += cos(2 * row[1])
                out[START_SIN] += sin(2 * row[1])
    out[ACCELERATION] = found[1]
    if found[0] > TURNS:
        return False
    for k in range(int(found[0])):
        row = rows[int(turns[k, 0])]
        out[ACCELERATION] = max(out[ACCELERATION], refined(turns[k], row, rig, o))
    ranges(rows, (first, used), begin, cycles, rig, o, found, out)
    return True


def energy(rows, used, rig):
    """Largest z'^2 + w^2 z^2 [m2 s-2] of `used` phases, by their starts and their middles."""
    o, largest = oscillator(rig[0], rig[1], rig[5]), 0.0
    for k in range(used):
        span, way, z, v, shift, speed = rows[k, 2], rows[k, 3], rows[k, 4], rows[k, 5], 0.0, 0.0
        if way != 0.0:
            shift, speed, _ = motion(0.5 * span, v, rows[k, 6], rows[k, 7], rows[k, 8], o)
        largest = max(largest, v * v + o[0] * z * z, speed * speed + o[0] * (z + way * shift)**2)
    return largest


def cycle_parts(rows, used, picks, rig, phasors):
    """Parts of z at the drive's frequency in some cycles, to phasors (c, 2).

    rows: phases of the run to its end, `used` of them; picks: (last, every, least): cycle `last` and every `every`-th
    before it down to `least`; the other cycles of phasors, zero before, hold what comes by the way.
    """
    o, per, (last, every, least) = oscillator(rig[0], rig[1], rig[5]), 2 * pi / rig[5], picks
    for k in range(used):
        # float: NumPy divides complex numbers in its own way
        span, way, z, position = float(rows[k, 2]), float(rows[k, 3]), float(rows[k, 4]), float(rows[k, 0]) / per
        first = int(position + 1e-12)
        after = max(first, int(position + span / per - 1e-12))
        if after < least or (last - max(first, least)) // every == (last - after - 1) // every:
            continue  # none of the cycles that are asked for
        v, g0, bc, bs = float(rows[k, 5]), float(rows[k, 6]), float(rows[k, 7]), float(rows[k, 8])
        shift, speed = 0.0, 0.0
        if k + 1 < used:
            shift, speed = way * (float(rows[k + 1, 4]) - z), float(rows[k + 1, 5])
        elif way != 0.0:
            shift, speed, _ = motion(span, v, g0, bc, bs, o)
        add_phasors(phasors, position, per, z, way, v, g0, bc, bs, span, shift, speed, o)
