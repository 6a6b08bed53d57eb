"""Compiled reading of the last cycles of a run of one mode off its rows: ranges, loop, harmonics, peaks, releases.

The twin in arrays is what `piecewise.histories` and `runs.rig.pieces` collect of a single run.
"""

from math import cos, inf, nan, pi, sin, sqrt

from ...compiled.inner import njit
from ...friction.flags_kernels import FAST, LEAN
from ..piecewise.drive_kernels import AMPLITUDE, CONSTANT, OMEGA
from ..piecewise.march_kernels import HEAD
from ..piecewise.series_kernels import _PLACE, _WEIGHT, largest, points, value_and_slope
from .line_kernels import one_series, order_of
from .names_kernels import (
    A3_COS,
    A3_SIN,
    A_COS,
    A_SIN,
    ACCELERATION,
    BASE,
    DAMPING,
    EDGE,
    F_COS,
    F_FIRST,
    F_LAST,
    F_SIN,
    FACE,
    FIRST,
    FORCE,
    HIGH,
    LAST,
    LOW,
    MASS,
    OUT_HIGH,
    OUT_LOW,
    OUTPUT,
    PASSED,
    POWER,
    Q_COS,
    Q_SIN,
    RANGE,
    REACH,
    RING,
    SECANT,
    SLIP_HIGH,
    SLIP_LOW,
    SQUARE,
    START_COS,
    START_SIN,
    STARTS,
    STUCK,
    SWING,
    TURNED,
    WORK,
)

SLIPS = 0.5  # share of the slide that is irreversible from which an interface slips
LASTS = 1e-9  # of a period: a shorter slip is none
RESTS = 1e-9  # of the largest rate: slower is at rest
NEAR = 0.003  # of a period: more than a sample of 400 in it
FACES = HEAD + 2  # column of the force
# what every cycle adds to
SUMMED = (STUCK, WORK, TURNED, POWER, PASSED, Q_COS, Q_SIN, F_COS, F_SIN, A_COS, A_SIN, A3_COS, A3_SIN)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def sums(cycle, cycles, begin, h, top, c, springs, drive, rig, out):
    """Add to `out` the integrals over a piece in this cycle; begin: number of the window's first cycle, springs: (force
    and place at first, stiffness), drive: (angle at first, omega, amplitude, constant, moving)."""
    force, place, spring = springs
    theta, omega, size, constant, moving = drive
    rate = max(sqrt(rig[SQUARE] + spring * rig[FACE] * rig[FACE] / rig[MASS]) + rig[DAMPING], omega)
    count, first = points(0.5 * (rate + 3 * omega) * h), place * rig[FACE]
    for g in range(count):
        u, w = _PLACE[count, g], h * _WEIGHT[count, g]
        z, v = value_and_slope(c, 0, top, u)
        v /= h
        turn = theta + omega * h * u
        cosine, sine = cos(turn), sin(turn)
        slide, push = rig[FACE] * z, size * sine + constant
        pull = force + spring * (slide - first)
        gain = -rig[BASE] * push - rig[DAMPING] * v - rig[SQUARE] * z - rig[FACE] * pull / rig[MASS]
        gain = rig[OUTPUT] * gain + moving * push
        power = w * pull * rig[FACE] * v
        out[POWER] += power
        out[PASSED] += abs(power)
        out[Q_COS] += w * slide * cosine
        out[Q_SIN] += w * slide * sine
        out[F_COS] += w * pull * cosine
        out[F_SIN] += w * pull * sine
        out[A_COS] += w * gain * cosine
        out[A_SIN] += w * gain * sine
        out[A3_COS] += w * gain * cosine * (4 * cosine * cosine - 3)
        out[A3_SIN] += w * gain * sine * (3 - 4 * sine * sine)
        if cycle == begin:
            out[FIRST] += w * slide
            out[F_FIRST] += w * pull
        if cycle == begin + cycles - 1:
            out[LAST] += w * slide
            out[F_LAST] += w * pull


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def peak(h, top, c, wave, constant, moving, base, output, poly, hulls, best):
    """The larger of `best` and the largest |absolute acceleration| of the output over a piece."""
    whole = 0.0
    for k in range(top - 1):
        poly[k] = output * c[k + 2] * (k + 1) * (k + 2) / (h * h) - moving * wave[k] / base
        poly[k] += moving * constant if k == 0 else 0.0
        whole += abs(poly[k])
    return best if whole <= best else largest(poly, top - 2, best, hulls)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def cycle_range(rows, low, high, end, turns, limits, out):
    """Take the slide's range in the cycle of rows low to high - 1 into `out`, and the force at its ends.

    end: (slide, force, rate) where the cycle ends; turns: (phase of the last turn before the cycle, of the first one
    after it) [1 of a period away]; limits: (face, largest rate, whether it is the first, the last cycle of all). Where
    the slide turns beyond a border, but near, EDGE is set: a single run interpolates there.
    """
    face, most, is_first, is_last = limits
    best, least, top, bottom = -inf, inf, -1, -1
    for j in range(low, high):
        slide = face * rows[j, HEAD]
        if slide > best:
            best, top = slide, j
        if slide < least:
            least, bottom = slide, j
    if end[0] > best:
        best, top = end[0], high
    if end[0] < least:
        least, bottom = end[0], high
    out[RANGE] += best - least
    total, known = 0.0, True
    for k in range(2):
        at = top if k == 0 else bottom
        force = end[1] if at == high else rows[at, FACES]
        if at == high or at == low:
            rate = end[2] if at == high else face * rows[at, HEAD + 1]
            if abs(rate) > RESTS * most:
                known = False
                if not ((at == low and is_first) or (at == high and is_last)) and turns[1 if at == high else 0] < NEAR:
                    out[EDGE] = 1.0
        total += force if k == 0 else -force
    if known and best > least:
        out[SECANT] += total / (best - least)
        return 1.0
    return 0.0


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def free_part(row, omega, size, constant, rig):
    """(largest free acceleration [m s-2] of the coordinate from the start of a row on, its frequency [rad/s], its
    damping ratio); zeros where nothing rings."""
    spring, alpha = row[FACES + 1], rig[DAMPING]
    beta = rig[SQUARE] + spring * rig[FACE] * rig[FACE] / rig[MASS]
    own = beta - 0.25 * alpha * alpha
    far, side = beta - omega * omega, alpha * omega
    whole = far * far + side * side
    if own <= 0.0 or whole <= 1e-18 * beta * beta:
        return 0.0, 0.0, 0.0
    own = sqrt(own)
    sine, cosine = -rig[BASE] * size * sin(row[2]), -rig[BASE] * size * cos(row[2])
    rest = -rig[BASE] * constant - rig[SQUARE] * row[HEAD] - rig[FACE] * row[FACES] / rig[MASS]
    z = -rest / beta - (far * sine - side * cosine) / whole
    v = row[HEAD + 1] - omega * (far * cosine + side * sine) / whole
    other = (v + 0.5 * alpha * z) / own
    return beta * sqrt(z * z + other * other), own, 0.5 * alpha / sqrt(beta)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def rung(row, span, omega, size, constant, rig, out):
    """Note what rings over `span` [s] from the start of a row on: the rule of `response.ringing`."""
    amplitude, own, damping = free_part(row, omega, size, constant, rig)
    ratio = own / omega
    forced = span * omega > 3 * pi and damping < 1e-3 and abs(ratio - round(ratio)) < 1e-2
    if span * own >= 3 * pi and damping < 0.5 and not forced:
        out[RING] = max(out[RING], abs(rig[OUTPUT]) * amplitude)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def swung(rows, first, last, rig):
    """Angle [rad] by which free motion turns over the rows first to last - 1, each with its stiffness."""
    out = 0.0
    for j in range(first, last):
        own = rig[SQUARE] + rows[j, FACES + 1] * rig[FACE] * rig[FACE] / rig[MASS] - 0.25 * rig[DAMPING] * rig[DAMPING]
        out += sqrt(max(own, 0.0)) * rows[j, 1]
    return out


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def changes(rows, used, before, period, drive, rig, out):
    """Releases and sticks of the rows to `out`; before: the way of the slip before them; drive: (omega, amplitude,
    constant)."""
    begun, end = rows[0, 0], rows[used - 1, 0] + rows[used - 1, 1]
    held, waits, phase, last, begun_at = 0 if before == 0.0 else -1, False, 0.0, before, begun
    for j in range(used):
        way, time = rows[j, FACES + 7] if rows[j, FACES + 2] >= SLIPS else 0.0, rows[j, 0]
        if way == last:
            continue
        if waits and time - begun_at > LASTS * period:
            out[STARTS] += 1.0
            out[START_COS] += cos(2 * phase)
            out[START_SIN] += sin(2 * phase)
        waits = way != 0.0 and time > begun
        phase, begun_at = rows[j, 2], time
        if way == 0.0:
            held = j
        elif held >= 0:
            rung(rows[held], time - rows[held, 0], *drive, rig, out)
            out[SWING] = max(out[SWING], swung(rows, held, j, rig))
            held = -1
        last = way
    if waits:
        out[STARTS] += 1.0
        out[START_COS] += cos(2 * phase)
        out[START_SIN] += sin(2 * phase)
    if held >= 0:
        rung(rows[held], end - rows[held, 0], *drive, rig, out)
        out[SWING] = max(out[SWING], swung(rows, held, used, rig))


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def window(rows, counts, final, before, rig, segment, clock, moving, room, out):
    """Numbers of the last cycles to `out` (NUMBERS,).

    rows (r, w): all of them and no more; counts: (used rows, first one that is summed, cycles): 0, or where all cycles
    are alike that of the last one, which then stands for all; final (5,): z, v, force, slip, work at the end; before:
    way of the slip before them; segment: of the drive; clock; moving: 1 where the base moves; room as of
    `one_kernels.march`.
    """
    (lines, hulls, _), period, face, (used, first, cycles) = room, clock.period[0], rig[FACE], counts
    c, poly, wave = lines[0], lines[1], lines[3]
    omega, size, constant = segment[OMEGA], segment[AMPLITUDE], segment[CONSTANT]
    out[:] = 0.0
    out[LOW], out[HIGH], out[SLIP_LOW], out[SLIP_HIGH], out[OUT_LOW], out[OUT_HIGH] = inf, -inf, inf, -inf, inf, -inf
    begin, fastest = rows[0, 5], abs(face * final[1])
    for j in range(first, used + 1):
        here = j < used
        z, force = (rows[j, HEAD], rows[j, FACES]) if here else (final[0], final[2])
        slip = rows[j, FACES + 4] if here else final[3]
        out[LOW], out[HIGH] = min(out[LOW], face * z), max(out[HIGH], face * z)
        out[OUT_LOW], out[OUT_HIGH] = min(out[OUT_LOW], rig[OUTPUT] * z), max(out[OUT_HIGH], rig[OUTPUT] * z)
        out[SLIP_LOW], out[SLIP_HIGH] = min(out[SLIP_LOW], slip), max(out[SLIP_HIGH], slip)
        out[FORCE], out[REACH] = max(out[FORCE], abs(force)), max(out[REACH], abs(z))
        if j > first:
            out[TURNED] += 0.5 * (force + rows[j - 1, FACES]) * face * (z - rows[j - 1, HEAD])
        if not here:
            break
        h, v, spring, theta = rows[j, 1], rows[j, HEAD + 1], rows[j, FACES + 1], rows[j, 2]
        fastest = max(fastest, abs(face * v))
        if rows[j, FACES + 2] < SLIPS:
            out[STUCK] += h
        beta = rig[SQUARE] + spring * face * face / rig[MASS]
        rate = max(0.5 * rig[DAMPING] + sqrt(0.25 * rig[DAMPING]**2 + beta), omega)
        top = order_of(rate * h)
        push = -rig[BASE] * size * sin(theta)
        gain = push - rig[BASE] * constant - rig[SQUARE] * z - face * force / rig[MASS]
        one_series(z, v, gain, beta, rig[DAMPING], push, -rig[BASE] * size * cos(theta), omega * h, h, top, c, wave)
        sums(rows[j, 5], cycles, begin, h, top, c, (force, z, spring), (theta, omega, size, constant, moving), rig, out)
        out[ACCELERATION] = peak(h, top, c, wave, constant, moving, rig[BASE], rig[OUTPUT], poly, hulls,
                                 out[ACCELERATION])
    out[WORK] = final[4] - rows[first, FACES + 5]
    if first > 0:
        for k in SUMMED:
            out[k] *= cycles
        out[FIRST], out[F_FIRST] = out[LAST], out[F_LAST]
    changes(rows, used, before, period, (omega, size, constant), rig, out)
    end = face * final[0], final[2], face * final[1]
    out[SECANT] = secants(rows, used, cycles, end, face, fastest, period, out)


@njit(error_model="numpy", forceinline=True, fastmath=FAST, **LEAN)
def secants(rows, used, cycles, end, face, fastest, period, out):
    """Mean secant stiffness [N/m] of the cycles that show it, NaN where none does; their mean range to RANGE."""
    seen, low, begin = 0.0, 0, rows[0, 5]
    for k in range(cycles):
        high = low
        while high < used and rows[high, 5] == begin + k:
            high += 1
        close = end
        if high < used:
            close = face * rows[high, HEAD], rows[high, FACES], face * rows[high, HEAD + 1]
        back, on = low - 1, high
        while back >= 0 and rows[back, 4] != 2.0:
            back -= 1
        while on < used and rows[on, 4] != 2.0:
            on += 1
        turns = ((rows[low, 0] - rows[back, 0]) / period if back >= 0 else inf,
                 (rows[on, 0] - (begin + k + 1) * period) / period if on < used else inf)
        seen += cycle_range(rows, low, high, close, turns, (face, fastest, k == 0, k == cycles - 1), out)
        low = high
    out[RANGE] /= cycles
    return out[SECANT] / seen if seen > 0 else nan


@njit(error_model="numpy", cache=True, fastmath=FAST, **LEAN)
def rings(rows, before, period, drive, rig, out):
    """What `window` tells of releases and ringing alone, of rows (r, w)."""
    changes(rows, rows.shape[0], before, period, drive, rig, out)
