"""How far a motion in a lane goes in its next step, by the series of its rate, and whether the step holds.

All numbers of a lane stand in `rows`, as `lane_step` has them, and in its row `own`.
"""

from math import log, sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import INNER
from . import lane_step as at
from . import loop_kernels as loop

GOING, FINISHED, FULL, ENDLESS, TURNS, ASTRAY = -1, 0, 2, 4, 5, 6  # what follows a step; 0 to 4 as a call ends
IDLE, WAIT, GO, STOP = range(4)  # what a lane does: STOP ends its step at a reversal
NUMBERS = 24  # of a lane beside those of the step
(MODE, MOTION, FRESH, TRIES, CAP, UNTIL, LONGEST, TURNED, WAY, LAYER, FADE, OUTPUT, MASS, PERIOD, ROUND, WORKED, LOST,
 RUBBED, POWER, STORED, DONE, REFUSED, STRIDE, CREEPS) = range(NUMBERS)
EASY = 8.0  # share of the distance to the singularity of tanh in a step, over tolerance^(1/8)
POLE = 2.5  # (pi/2)^2, its square from the real axis
SHORTER, FASTER = 0.9, 8.0  # of the length at which the last terms make up the bound; most change of a step
BEYOND = 50.0  # bounds by which a step may miss the slope at its end: the terms left out make up some twenty
CLEAR = 0.5  # of the larger rate at the ends: a cubic between them that stays above it passes no zero
(STIFF, DAMP, GAIN, PUSH, STEADY, PACE, PHASE, SLIDE, ORIGIN, N0, N1, N2, N3, ROUGH, T, H, UNIT, Z, V, CREST, FAST,
 ALLOWED) = at.LANES * np.arange(22)  # rows of `lane_step`
V1, F0 = at.LANES * 22, at.LANES * (22 + at.ORDER)
(BOUND, CHANGE, Z1, VEND, A1, WORK, PASSED, LOSS, RUB, LEAST, MOST,
 DEFECT) = at.LANES * (22 + 2 * at.ORDER + np.arange(12))


@njit(error_model="numpy", **INNER)
def first_zero(a, p, b, r):
    """Share of a step at which a cubic from a >= 0 to b < 0 passes zero; p, r: its slopes at the ends over the step."""
    if a == 0:
        return loop.back_of(p, b, r)
    low, high, s = 0.0, 1.0, a / (a - b)
    for _ in range(60):
        rest = 1 - s
        value = rest * rest * (a * (1 + 2 * s) + p * s) + s * s * (b * (3 - 2 * s) - r * rest)
        slope = 6 * s * rest * (b - a) + p * rest * (1 - 3 * s) + r * s * (3 * s - 2)
        if value > 0:
            low = s
        else:
            high = s
        new = s - value / slope if slope < 0 else low
        new = new if low < new < high else 0.5 * (low + high)
        if abs(new - s) < 1e-6:
            return new
        s = new
    return s


@njit(error_model="numpy", **INNER)
def still(rows, own, lane):
    """As `loop_kernels.still`."""
    return 4e-16 * (rows[FAST + lane] + own[ROUND] * rows[CREST + lane])


@njit(error_model="numpy", **INNER)
def eased(rows, own, lane):
    """Longest step [s] of a motion that slows down towards a turn of a force that is all of the speed.

    That turns over a speed w, like tanh(v/w), of which a series farther off than some w knows nothing: up to there a
    step may go, then by shares of the distance to the singularity of tanh.
    """
    brake = -own[WAY] * rows[V1 + lane] / rows[UNIT + lane]
    if not brake > 0:
        return np.inf
    u, unit, tolerance = own[WAY] * rows[V + lane] / own[LAYER], own[LAYER] / brake, rows[ALLOWED + lane]
    share = EASY * sqrt(sqrt(sqrt(tolerance)))
    return max(u + 0.4 * log(tolerance), share * sqrt(u * u + POLE)) * unit


@njit(error_model="numpy", **INNER)
def speed_at(rows, lane, c):
    """(rate [m/s], its slope over c) of the series in a lane at a time of c units."""
    v, slope = 0.0, 0.0
    for k in range(at.ORDER - 1, -1, -1):
        slope = slope * c + v
        v = v * c + rows[V1 + at.LANES * k + lane]
    return rows[V + lane] + c * v, v + c * slope


@njit(error_model="numpy", **INNER)
def zero_of(rows, own, lane, c, high):
    """Time [units] at which the rate of the series in a lane, > 0 in its direction before, passes zero before `high`;
    c: a guess."""
    low = 0.0
    for turn in range(60):
        value, rate = speed_at(rows, lane, c)
        value, rate = own[WAY] * value, own[WAY] * rate
        if value > 0:
            low = c
        else:
            high = c
        new = c - value / rate if rate < 0 else 0.5 * (low + high)
        if (abs(value) <= still(rows, own, lane) and rate < 0) or abs(new - c) <= 2e-16 * c:
            return c
        c = new if low < new < high and turn < 20 else 0.5 * (low + high)
        if high - low <= 1e-15 * high:
            return c
    return c


@njit(error_model="numpy", **INNER)
def lowest(rows, own, lane, c, begin, gain, end, after):
    """Time [units] within c at which the rate of the series in a lane has a least value below zero between two above; 0
    for none.

    It is looked for from that of the cubic through both ends, where that comes near to zero.
    """
    big, mid = 2 * (begin - end) + gain + after, 3 * (end - begin) - 2 * gain - after
    root = mid * mid - 3 * big * gain
    if after <= 0 or end <= 0 or root <= 0:
        return 0.0
    s = -gain / (mid + sqrt(root)) if mid + sqrt(root) != 0 else 0.0
    if s <= 0 or s >= 1 or begin + s * (gain + s * (mid + s * big)) > CLEAR * max(begin, end):
        return 0.0
    s *= c
    for _ in range(20):
        v, slope, bend = 0.0, 0.0, 0.0
        for k in range(at.ORDER - 1, -1, -1):
            bend = bend * s + 2 * slope
            slope = slope * s + v
            v = v * s + rows[V1 + at.LANES * k + lane]
        bend = s * bend + 2 * slope
        slope = v + s * slope
        new = s - slope / bend if own[WAY] * bend > 0 else 0.0
        if new <= 0 or new >= c or abs(new - s) < 1e-9 * c:
            break
        s = new
    return s if own[WAY] * speed_at(rows, lane, s)[0] < 0 else 0.0


@njit(error_model="numpy", **INNER)
def aimed(rows, own, lane):
    """Choose the length of the step whose series is in a lane: GOING, FINISHED where the motion has arrived, ASTRAY
    where it began the other way, ENDLESS where no step gets on."""
    room, unit, way = own[UNTIL] - rows[T + lane], rows[UNIT + lane], own[WAY]
    if room <= 0:
        return FINISHED
    change = rows[CHANGE + lane]
    if own[CREEPS] > 0:
        h = unit
    else:
        h = unit * (min(SHORTER * change, FASTER) if change > 1e-4 else 1e-4)
        h = min(h, own[LONGEST], own[CAP])
        if own[LAYER] > 0:
            h = min(h, eased(rows, own, lane))
    h = room if h >= room * (1 - 1e-9) else h
    own[MODE], begin = GO, way * rows[V + lane]
    for _ in range(2):
        c = h / unit
        end, after = speed_at(rows, lane, c)
        end, after, gain = way * end, way * after * c, way * rows[V1 + lane] * c
        low = lowest(rows, own, lane, c, begin, gain, end, after)
        if low == 0:
            break
        h = low * unit
    if h < 1e-16 * own[UNTIL]:
        return ENDLESS
    rows[H + lane] = h
    if not end < -still(rows, own, lane):
        return GOING
    share = first_zero(max(begin, 0.0), gain, end, after)
    if own[FRESH] > 0 and share * h < loop.INSTANT * own[PERIOD]:
        return ASTRAY if own[FRESH] == loop.STANDS else ENDLESS
    own[MODE], rows[H + lane] = STOP, unit * zero_of(rows, own, lane, max(share, 1e-12) * c, c)
    return GOING


@njit(error_model="numpy", **INNER)
def judged(rows, own, lane):
    """Whether the step in a lane is to be taken; else it is to be tried again, half as long."""
    back = own[MODE] == GO and own[WAY] * rows[VEND + lane] >= 0  # then it is so all the way
    least = own[WAY] * rows[LEAST + lane] if own[WAY] > 0 else own[WAY] * rows[MOST + lane]
    holds = rows[DEFECT + lane] <= BEYOND or own[CREEPS] > 0  # which is judged by its polynomial
    if holds and not (back and least < -still(rows, own, lane)):
        return True
    own[TRIES] += 1
    own[REFUSED] += 1
    own[CAP] = rows[UNIT + lane] = 0.5 * rows[H + lane]
    return False
