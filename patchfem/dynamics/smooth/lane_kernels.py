"""Motions of one mode under a sine, eight at a time, each with its own steps, from reversal to reversal.

A round takes one step of all eight, the try of one, the refused try or the search for the reversal of another; each is
then judged by itself. So what a motion does hangs on no other, and one alone moves as one of many, to the last bit. The
rules are those of `loop_kernels`; nothing is read inside a step. What is done after every step takes the numbers of a
lane alone; a reversal and the end of a motion take its Moving and Kept.
"""

from math import log, sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import INNER, LEAN
from ...friction.laws import stretch_kernels as law
from . import lane_step as at
from . import loop_kernels as loop
from . import step_kernels as stepping
from . import step_kernels as steps
from . import watch_kernels as watching
from .arrays import Kept, Moving

GOING, FINISHED, FULL, ENDLESS, TURNS, ASTRAY = -1, 0, 2, 4, 5, 6  # what follows a step; 0 to 4 as a call ends
IDLE, WAIT, TRY, LOCATE = range(4)  # what a lane does
# numbers of a lane beside those of the step
(MODE, MOTION, FRESH, TRIES, LOW, HIGH, WANTED, FIRST, UNTIL, NEXT, TURNED, WAY, LAYER, FADE, OUTPUT, MASS, PERIOD,
 ROUND, WORKED, LOST, RUBBED, POWER, STORED, DONE, REFUSED) = range(25)
EASY = 8.0  # share of the distance to the singularity of tanh in a step, over tolerance^(1/8)
POLE = 2.5  # (pi/2)^2, its square from the real axis
NEAR = 1e-6  # of a step: so near, a state is moved to its reversal by its Taylor series, to 1e-12 of the speed
(STIFF, DAMP, GAIN, PUSH, STEADY, PACE, PHASE, SLIDE, ORIGIN, N0, N1, N2, N3, T, H, Z, V, A, D, F, CREST, FAST, ALLOWED,
 Z1, V1, A1, D1, F1, WORK, LOSS, RUB, ERROR, CHANGE) = at.LANES * np.arange(33)  # rows of `lane_step`


@njit(error_model="numpy", **INNER)
def one(many, kept, j):
    """(Moving, Kept) of one of many motions."""
    return (Moving(many.rows[j], many.damping, many.pieces[j], many.num[j], many.mem[j], many.turn[j], many.y[j],
                   many.work, many.now[j]),
            Kept(kept.cycles[j], kept.samples, kept.turns[j], kept.tally[j], kept.room, kept.table))


@njit(error_model="numpy", **INNER)
def laid(m, k, rows, own, lane):
    """Lay a motion into a lane as it stands: its numbers, its state and the slopes there."""
    piece, base, slide, time = m.pieces[int(m.now[steps.PIECE])], m.rows[steps.BASE, 0], m.rows[steps.SLIDE, 0], \
        m.now[steps.TIME]
    rows[STIFF + lane], rows[DAMP + lane] = m.rows[steps.OMEGA, 0]**2, m.rows[steps.DAMP, 0]
    rows[GAIN + lane], rows[SLIDE + lane] = slide / m.now[steps.MASS], slide
    rows[STEADY + lane], rows[PUSH + lane] = base * piece[1], base * piece[2]
    rows[PACE + lane], rows[PHASE + lane] = piece[3], piece[4] - piece[3] * piece[0]
    rows[ORIGIN + lane] = m.now[steps.ORIGIN]
    rows[N0 + lane], rows[N1 + lane], rows[N2 + lane], rows[N3 + lane] = law.ahead(m.num, m.mem, m.turn[0])
    steps.slope(m, time, m.y, m.work[0])
    rows[T + lane], rows[Z + lane], rows[V + lane], rows[A + lane] = time, m.y[0], m.y[1], m.work[0, 1]
    rows[D + lane] = base * steps.push(m, time)
    rows[F + lane] = law.rate(m.num, m.mem, m.turn, slide * m.y[0] - m.now[steps.ORIGIN], slide * m.y[1], m.y[2:2],
                              m.work[1, 2:2])
    rows[CREST + lane], rows[FAST + lane] = m.now[steps.CREST], m.now[steps.CREST_SPEED]
    own[NEXT], own[TURNED], own[WAY] = m.now[steps.STEP], m.now[steps.TURNED], m.turn[0] * slide
    own[LAYER], own[OUTPUT], own[MASS] = law.layer(m.num), m.rows[steps.OUTPUT, 0], m.now[steps.MASS]
    own[PERIOD], own[ROUND] = k.tally[watching.PERIOD], m.now[steps.PACE]
    own[FADE] = 1 / (loop.FORGET * own[PERIOD])
    own[WORKED:REFUSED + 1] = 0.0


@njit(error_model="numpy", **INNER)
def put_back(m, k, rows, own, lane):
    """Write what has become of a motion in a lane back to its Moving and Kept."""
    m.now[steps.TIME], m.y[0], m.y[1] = rows[T + lane], rows[Z + lane], rows[V + lane]
    m.now[steps.CREST], m.now[steps.CREST_SPEED] = rows[CREST + lane], rows[FAST + lane]
    m.now[steps.STEP], m.now[steps.TURNED] = own[NEXT], own[TURNED]
    m.y[2] += own[WORKED]
    m.y[3] += own[LOST]
    m.y[4] += own[RUBBED]
    k.tally[watching.POWER] += own[POWER]
    k.tally[watching.STORED] = max(k.tally[watching.STORED], own[STORED], watching.stored(m, m.y))
    k.tally[watching.DONE] += own[DONE]
    k.tally[watching.REFUSED] += own[REFUSED]


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

    That turns over a speed w, like tanh(v/w): farther off than some w a step may go to there, then by shares of the
    distance to the singularity of tanh, as the steps do that lead away. Else every such turn has five refused tries.
    """
    brake = -own[WAY] * rows[A + lane]
    if brake <= 0:
        return np.inf
    u, unit, tolerance = own[WAY] * rows[V + lane] / own[LAYER], own[LAYER] / brake, rows[ALLOWED + lane]
    share = EASY * sqrt(sqrt(sqrt(tolerance)))
    return max(u + 0.4 * log(tolerance), share * sqrt(u * u + POLE)) * unit


@njit(error_model="numpy", **INNER)
def next_try(rows, own, lane):
    """Lay out the next try: GOING, FINISHED where the motion has arrived."""
    room = own[UNTIL] - rows[T + lane]
    if room <= 0:
        return FINISHED
    if own[LAYER] > 0:
        own[NEXT] = min(own[NEXT], eased(rows, own, lane))
    rows[H + lane] = room if own[NEXT] >= room * (1 - 1e-9) else own[NEXT]
    own[MODE], own[TRIES] = TRY, 0
    return GOING if rows[H + lane] > 1e-16 * own[UNTIL] else ENDLESS


@njit(error_model="numpy", **INNER)
def accepted(rows, own, lane, cycles):
    """Move a motion on by the step in its lane and take in what the ends of steps show."""
    h, time, room = rows[H + lane], rows[T + lane], own[UNTIL] - rows[T + lane]
    fade, x, z, v = 1 - min(h * own[FADE], 1.0), own[OUTPUT], rows[Z1 + lane], rows[V1 + lane]
    rows[CREST + lane] = max(fade * rows[CREST + lane], abs(z))
    rows[FAST + lane] = max(fade * rows[FAST + lane], abs(v))
    watching.extremes(cycles, own[PERIOD], time + 0.5 * h, x * rows[Z + lane], x * z)
    watching.phasor(cycles, own[PERIOD], time, h, (x * rows[Z + lane], x * rows[V + lane], x * rows[A + lane]),
                    (x * z, x * v, x * rows[A1 + lane]))
    work = own[MASS] * rows[WORK + lane]
    own[WORKED] += work
    own[LOST] += own[MASS] * rows[LOSS + lane]
    own[RUBBED] += rows[RUB + lane]
    own[POWER] += abs(work)
    own[STORED] = max(own[STORED], 0.5 * own[MASS] * (v * v + rows[STIFF + lane] * z * z))
    own[DONE] += 1
    at_end = h == room
    own[NEXT] = max(own[WANTED], own[NEXT]) if own[FIRST] == room else own[WANTED]
    if own[FRESH] == loop.STANDS:
        own[TURNED] = own[WANTED]
    own[FRESH] = 0
    for of in range(5):
        rows[Z + of * at.LANES + lane] = rows[Z1 + of * at.LANES + lane]
    rows[T + lane] = own[UNTIL] if at_end else time + h


@njit(error_model="numpy", **INNER)
def judged(rows, own, lane, cycles):
    """Judge the try in a lane: GOING, ASTRAY where it began the other way, or how the motion ends."""
    h, error, low = rows[H + lane], rows[ERROR + lane], 0.0
    begin, end = own[WAY] * rows[V + lane], own[WAY] * rows[V1 + lane]
    gain, after = own[WAY] * rows[A + lane] * h, own[WAY] * rows[A1 + lane] * h
    if error <= 1:
        low = loop.dip_of(begin, gain, end, after)
    change = min(max(rows[CHANGE + lane], loop.SLOWER), loop.FASTER) if error >= 0 else loop.SLOWER
    if not error <= 1 or low > 0:
        own[TRIES] += 1
        own[REFUSED] += 1
        rows[H + lane] = h * (low if low > 0 else change)
        return ENDLESS if own[TRIES] > 60 else GOING
    own[WANTED], own[FIRST] = h * change, h
    if end >= -still(rows, own, lane):
        accepted(rows, own, lane, cycles)
        return next_try(rows, own, lane)
    share = first_zero(max(begin, 0.0), gain, end, after)
    if own[FRESH] > 0 and share * h < loop.INSTANT * own[PERIOD]:
        return ASTRAY if own[FRESH] == loop.STANDS else ENDLESS
    own[MODE], own[LOW], own[HIGH], own[TRIES] = LOCATE, 0.0, h, 0
    rows[H + lane] = max(share, 1e-12) * h
    return GOING


@njit(error_model="numpy", **INNER)
def searched(rows, own, lane, cycles):
    """Take in a step that looks for a reversal, by Newton's method on its length: TURNS where it is there, else as
    `next_try`."""
    h, full = rows[H + lane], own[FIRST]
    value, rate = own[WAY] * rows[V1 + lane], own[WAY] * rows[A1 + lane]
    if value > 0:
        own[LOW] = h
    else:
        own[HIGH] = h
    new = h - value / rate if rate < 0 else 0.5 * (own[LOW] + own[HIGH])
    inside, rest, found = own[LOW] < new < own[HIGH], new - h, abs(value) <= still(rows, own, lane)
    if not found and inside and abs(rest) <= NEAR * full:
        rows[Z1 + lane] += rest * (rows[V1 + lane] + 0.5 * rest * rows[A1 + lane])
        rows[H + lane], found = new, True
    found |= own[HIGH] - own[LOW] <= 1e-15 * full or abs(rest) <= 2e-16 * (rows[T + lane] + h) or own[TRIES] >= 60
    if found and rows[ERROR + lane] > 1:  # the stages of the first try may have passed by what bends beside the end
        own[NEXT], own[REFUSED] = h * max(rows[CHANGE + lane], loop.SLOWER), own[REFUSED] + 1
        return next_try(rows, own, lane)
    if found:
        rows[V1 + lane] = 0.0  # to the last digit
        accepted(rows, own, lane, cycles)
        return TURNS
    own[TRIES] += 1
    rows[H + lane] = new if inside and own[TRIES] < 20 else 0.5 * (own[LOW] + own[HIGH])
    return GOING


@njit(error_model="numpy", **INNER)
def gone_on(many, kept, rows, own, lane, code):
    """What a motion does at a reversal, or at a start the other way, before it goes on: GOING, or how it ends."""
    m, k = one(many, kept, int(own[MOTION]))
    put_back(m, k, rows, own, lane)
    if code == ASTRAY:
        loop.enter(m, -m.turn[0])
        own[FRESH], code = loop.FLIPPED, GOING
    elif code == TURNS:
        loop.pass_end(m, k, loop.STOP)
        own[FRESH], code = loop.STANDS, GOING
        m.now[steps.STEP] = min(m.now[steps.TURNED], m.now[steps.STEP])
        if k.tally[watching.TURNS] == k.turns.shape[0]:
            code, m.now[steps.BEGUN] = FULL, loop.TURNING
    m.now[steps.STOOD] = -1.0  # whoever goes on takes the slopes anew
    return code


@njit(error_model="numpy", cache=True, nogil=True, **LEAN)
def advance(many, kept, rows, lanes, until, tolerance, codes):
    """Move n motions that have begun on to the times `until` (n,) [s]; codes (n,): how each ended, as `loop_kernels`.

    many, kept: as Moving and Kept with one more dimension of n in front, but for damping, work, samples, room and
    table; rows (SIZE,), lanes (LANES, 25): room to work in; tolerance (n,): of a step, relative. FULL: the room for
    reversals is used up, and the motion can go on from there. Returns the rounds.
    """
    ahead, busy, rounds = 0, at.LANES, 0
    lanes[:, MODE] = WAIT
    while busy > 0:
        stepping.step(rows)
        rounds += 1
        for lane in range(at.LANES):
            own, code = lanes[lane], FINISHED
            if own[MODE] == IDLE:
                continue
            if own[MODE] != WAIT:
                cycles = kept.cycles[int(own[MOTION])]
                code = judged(rows, own, lane, cycles) if own[MODE] == TRY else searched(rows, own, lane, cycles)
                if code == GOING:
                    continue
                code = gone_on(many, kept, rows, own, lane, code)
                codes[int(own[MOTION])] = code
            while True:
                if code != GOING:
                    if ahead == until.size:
                        own[MODE], rows[H + lane], busy = IDLE, 0.0, busy - 1
                        break
                    own[MOTION], own[UNTIL] = ahead, until[ahead]
                    rows[ALLOWED + lane] = tolerance[ahead]
                    ahead += 1
                m, k = one(many, kept, int(own[MOTION]))
                if code != GOING:
                    own[FRESH] = loop.went_on(m)
                laid(m, k, rows, own, lane)
                code = next_try(rows, own, lane)
                if code == GOING:
                    break
                codes[int(own[MOTION])] = code
    return rounds
