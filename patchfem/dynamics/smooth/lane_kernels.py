"""Motions of one mode under a sine, eight at a time, each with its own steps, from reversal to reversal.

A round takes one step of all eight; each is then judged by itself. So what a motion does hangs on no other, and one
alone moves as one of many, to the last bit. The rules are those of `loop_kernels`, with a series for the step: its last
terms give the length beforehand, and the reversal is a zero of its polynomial. What is done after every step takes the
numbers of a lane alone; a reversal, the end of a motion and what is read inside a step take its Moving and Kept.
"""

from math import pi

import numpy as np

from ...compiled.inner import njit
from ...compiled.series_kernels import sine
from ...friction.flags_kernels import INNER, LEAN
from ...friction.laws import stretch_kernels as law
from . import creep_kernels as creep
from . import crest_kernels as crests
from . import lane_step as at
from . import lane_step as stepping
from . import loop_kernels as loop
from . import polynomial_kernels as polynomial
from . import step_kernels as steps
from . import watch_kernels as reading
from . import watch_kernels as watching
from .aim_kernels import (
    A1,
    ALLOWED,
    ASTRAY,
    CAP,
    CREEPS,
    CREST,
    DAMP,
    DONE,
    ENDLESS,
    F0,
    FADE,
    FAST,
    FINISHED,
    FRESH,
    FULL,
    GAIN,
    GO,
    GOING,
    IDLE,
    LAYER,
    LONGEST,
    LOSS,
    LOST,
    MASS,
    MODE,
    MOTION,
    N0,
    N1,
    N2,
    N3,
    ORIGIN,
    OUTPUT,
    PACE,
    PASSED,
    PERIOD,
    PHASE,
    POWER,
    PUSH,
    REFUSED,
    ROUGH,
    ROUND,
    RUB,
    RUBBED,
    SLIDE,
    STEADY,
    STIFF,
    STOP,
    STORED,
    STRIDE,
    TRIES,
    TURNED,
    TURNS,
    UNIT,
    UNTIL,
    V1,
    VEND,
    WAIT,
    WAY,
    WORK,
    WORKED,
    Z1,
    H,
    T,
    V,
    Z,
    aimed,
    judged,
)
from .arrays import Kept, Moving

TURN, NEARER = 1.2, 0.8  # longest step over the time of the fastest motion, for its energies; where it is read
MARKS, SHARES = np.polynomial.legendre.leggauss(8)  # of the part of a step in a cycle, for its phasor


@njit(error_model="numpy", **INNER)
def one(many, kept, j):
    """(Moving, Kept) of one of many motions."""
    return (Moving(many.rows[j], many.damping, many.pieces[j], many.num[j], many.mem[j], many.turn[j], many.y[j],
                   many.work, many.now[j]),
            Kept(kept.cycles[j], kept.samples[j], kept.turns[j], kept.tally[j], kept.room, kept.table))


@njit(error_model="numpy", **INNER)
def laid(m, k, rows, own, lane):
    """Lay a motion into a lane as it stands: its numbers and its state."""
    piece, base, slide, time = m.pieces[int(m.now[steps.PIECE])], m.rows[steps.BASE, 0], m.rows[steps.SLIDE, 0], \
        m.now[steps.TIME]
    rows[STIFF + lane], rows[DAMP + lane] = m.rows[steps.OMEGA, 0]**2, m.rows[steps.DAMP, 0]
    rows[GAIN + lane], rows[SLIDE + lane] = slide / m.now[steps.MASS], slide
    rows[STEADY + lane], rows[PUSH + lane] = base * piece[1], base * piece[2]
    rows[PACE + lane], rows[PHASE + lane] = piece[3], piece[4] - piece[3] * piece[0]
    rows[ORIGIN + lane] = m.now[steps.ORIGIN]
    rows[N0 + lane], rows[N1 + lane], rows[N2 + lane], rows[N3 + lane] = law.ahead(m.num, m.mem, m.turn[0])
    rows[ROUGH + lane] = slide * slide * m.now[steps.STIFF] / m.now[steps.MASS]
    rows[T + lane], rows[Z + lane], rows[V + lane] = time, m.y[0], m.y[1]
    rows[CREST + lane], rows[FAST + lane] = m.now[steps.CREST], m.now[steps.CREST_SPEED]
    rows[UNIT + lane], own[TURNED], own[WAY] = m.now[steps.STEP], m.now[steps.TURNED], m.turn[0] * slide
    own[LAYER], own[OUTPUT], own[MASS] = law.layer(m.num), m.rows[steps.OUTPUT, 0], m.now[steps.MASS]
    own[PERIOD], own[ROUND] = k.tally[watching.PERIOD], m.now[steps.PACE]
    own[LONGEST] = (NEARER if k.tally[watching.WANTED] > 0 else TURN) / m.now[steps.PACE]
    own[FADE], own[CAP], own[TRIES] = 1 / (loop.FORGET * own[PERIOD]), np.inf, 0
    own[WORKED:REFUSED + 1], own[STRIDE], own[CREEPS] = 0.0, m.now[steps.STRIDE], 0.0


@njit(error_model="numpy", **INNER)
def put_back(m, k, rows, own, lane):
    """Write what has become of a motion in a lane back to its Moving and Kept."""
    m.now[steps.TIME], m.y[0], m.y[1] = rows[T + lane], rows[Z + lane], rows[V + lane]
    m.now[steps.CREST], m.now[steps.CREST_SPEED] = rows[CREST + lane], rows[FAST + lane]
    m.now[steps.STEP], m.now[steps.TURNED], m.now[steps.STRIDE] = rows[UNIT + lane], own[TURNED], own[STRIDE]
    m.y[2] += own[WORKED]
    m.y[3] += own[LOST]
    m.y[4] += own[RUBBED]
    k.tally[watching.POWER] += own[POWER]
    k.tally[watching.STORED] = max(k.tally[watching.STORED], own[STORED], watching.stored(m, m.y))
    k.tally[watching.DONE] += own[DONE]
    k.tally[watching.REFUSED] += own[REFUSED]
    own[WORKED:REFUSED + 1], own[STRIDE], own[CREEPS] = 0.0, m.now[steps.STRIDE], 0.0


@njit(error_model="numpy", **INNER)
def output_at(rows, own, lane, share):
    """Output [m] of the series in a lane at a share of its step."""
    c, value = share * rows[H + lane] / rows[UNIT + lane], 0.0
    for k in range(at.ORDER, 0, -1):
        value = value * c + rows[V1 + at.LANES * (k - 1) + lane] / (k + 1)
    return own[OUTPUT] * (rows[Z + lane] + share * rows[H + lane] * (rows[V + lane] + value * c))


@njit(error_model="numpy", **INNER)
def cycled(rows, own, lane, cycles):
    """Take the step in a lane into the extremes of its cycles, and into the phasors of those that are asked for (not
    NaN): 2/T int x exp(-i omega t) dt."""
    period, t, h = own[PERIOD], rows[T + lane], rows[H + lane]
    last, before = cycles.shape[1] - 1, own[OUTPUT] * rows[Z + lane]
    first, final = min(int(t / period), last), min(int((t + h) / period), last)
    for cycle in range(first, final + 1):
        low, high = max(t, cycle * period), min(t + h, (cycle + 1) * period) if cycle < last else t + h
        if high <= low:
            continue
        after = own[OUTPUT] * rows[Z1 + lane] if cycle == final else output_at(rows, own, lane, (high - t) / h)
        cycles[0, cycle] = min(cycles[0, cycle], before, after)
        cycles[1, cycle] = max(cycles[1, cycle], before, after)
        before = after
        if np.isnan(cycles[2, cycle]):
            continue
        for j in range(MARKS.size):
            time, weight = low + 0.5 * (1 + MARKS[j]) * (high - low), SHARES[j] * (high - low) / period
            x, turn = output_at(rows, own, lane, (time - t) / h), 2 * pi * (time / period - cycle)
            cycles[2, cycle] += weight * x * sine(turn + pi / 2)
            cycles[3, cycle] -= weight * x * sine(turn)


@njit(error_model="numpy", **INNER)
def shown(m, k, rows, lane, room):
    """Read what is asked for inside the step in a lane: samples, and the numbers of the last cycles."""
    h, sample = rows[H + lane], int(k.tally[watching.SAMPLE])
    marked = sample < k.samples.shape[0] and k.samples[sample, 0] <= rows[T + lane] + h
    if not marked and not k.tally[watching.WANTED] > 0:
        return
    m.now[steps.TIME], m.y[0], m.y[1] = rows[T + lane], rows[Z + lane], rows[V + lane]
    c, power, work = h / rows[UNIT + lane], 1.0, m.work
    work[0, 1], work[12, 1] = rows[V1 + lane] / rows[UNIT + lane], rows[A1 + lane]
    work[steps.TRIAL, 0], work[steps.TRIAL, 1] = rows[Z1 + lane], rows[VEND + lane]
    for j in range(at.ORDER + 1):
        row, passed = polynomial.row(j + 1), 0.0
        rate = rows[V1 + at.LANES * (j - 1) + lane] if j > 0 else rows[V + lane]
        work[row, 0] = h * power * rate / (j + 1)
        if marked and j < at.ORDER:
            passed = rows[F0 + at.LANES * j + lane] * rows[V + lane]
            for i in range(j):
                passed += rows[F0 + at.LANES * i + lane] * rows[V1 + at.LANES * (j - i - 1) + lane]
        work[row, 4] = h * power * rows[SLIDE + lane] * passed / (j + 1)
        power *= c
        if j < at.ORDER:
            work[row, 1] = power * rows[V1 + at.LANES * j + lane]
        else:
            work[row, 1] = 0.0
    reading.marks(m, h, k)
    if k.tally[watching.WANTED] > 0:
        for j in range(at.ORDER):
            room[crests.FORCE, j] = rows[F0 + at.LANES * j + lane] * c**j
        crests.peaks(m, h, k, room)
        reading.harmonics(m, h, k)
        reading.mean_of(m, h, k, k.tally[watching.BEGIN], watching.MEANS)
        reading.mean_of(m, h, k, k.tally[watching.END] - k.tally[watching.PERIOD], watching.MEANS + 1)
        reading.holds(m, h, k)


@njit(error_model="numpy", **INNER)
def accepted(rows, own, lane, cycles):
    """Move a motion on by the step in its lane and take in what the ends of steps show."""
    h, time, room = rows[H + lane], rows[T + lane], own[UNTIL] - rows[T + lane]
    fade, z, v = 1 - min(h * own[FADE], 1.0), rows[Z1 + lane], rows[VEND + lane]
    rows[CREST + lane] = max(fade * rows[CREST + lane], abs(z))
    rows[FAST + lane] = max(fade * rows[FAST + lane], abs(v))
    cycled(rows, own, lane, cycles)
    own[WORKED] += own[MASS] * rows[WORK + lane]
    own[LOST] += own[MASS] * rows[LOSS + lane]
    own[RUBBED] += rows[RUB + lane]
    own[POWER] += own[MASS] * rows[PASSED + lane]
    own[STORED] = max(own[STORED], 0.5 * own[MASS] * (v * v + rows[STIFF + lane] * z * z))
    own[DONE] += 1
    if own[FRESH] == loop.STANDS:
        own[TURNED] = h
    own[FRESH], own[TRIES], own[CAP] = 0, 0, np.inf
    rows[Z + lane], rows[V + lane], rows[T + lane] = z, v, own[UNTIL] if h == room else time + h
    rows[UNIT + lane] = max(h, 0.1 * rows[UNIT + lane]) if h < room else rows[UNIT + lane]


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
    elif code == FINISHED:
        loop.sampled(m, k)
    m.now[steps.STOOD] = -1.0  # whoever goes on takes the slopes anew
    return code


@njit(error_model="numpy", **INNER)
def taken(many, kept, rows, own, lane, room):
    """Take the step in a lane, or refuse it: GOING, or TURNS at a reversal."""
    if not judged(rows, own, lane):
        return ENDLESS if own[TRIES] > 60 else GOING
    stops = own[MODE] == STOP
    if stops:
        rows[VEND + lane] = 0.0  # to the last digit
    j = int(own[MOTION])
    if kept.samples.shape[1] > 0 or kept.tally[j, watching.WANTED] > 0:
        m, k = one(many, kept, j)
        shown(m, k, rows, lane, room)
        accepted(rows, own, lane, k.cycles)
        put_back(m, k, rows, own, lane)
    else:
        accepted(rows, own, lane, kept.cycles[j])
    return TURNS if stops else GOING


@njit(error_model="numpy", **INNER)
def begun(many, kept, rows, own, lane, ahead, until, tolerance):
    """Lay the motion `ahead` into a lane."""
    own[MOTION], own[UNTIL], rows[ALLOWED + lane] = ahead, until[ahead], tolerance[ahead]
    m, k = one(many, kept, ahead)
    loop.sampled(m, k)
    own[FRESH], own[MODE] = loop.went_on(m), WAIT
    laid(m, k, rows, own, lane)


@njit(error_model="numpy", **INNER)
def followed(many, kept, rows, own, lane, code, ahead, until, tolerance, codes):
    """What comes after a step in a lane that has met `code`: the motion goes on, or the motion `ahead` takes its place.

    Whoever is in the lane then waits for a series of its own; without another motion the lane is idle. Returns the
    motion that is ahead now.
    """
    code, rows[H + lane] = gone_on(many, kept, rows, own, lane, code), 0.0
    if code == GOING:
        laid(*one(many, kept, int(own[MOTION])), rows, own, lane)
        own[MODE] = WAIT
        return ahead
    codes[int(own[MOTION])] = code
    if ahead == until.size:
        own[MODE] = IDLE
        return ahead
    begun(many, kept, rows, own, lane, ahead, until, tolerance)
    return ahead + 1


@njit(error_model="numpy", cache=True, nogil=True, **LEAN)
def advance(many, kept, rows, lanes, room, nodes, until, tolerance, codes):
    """Move n motions that have begun on to the times `until` (n,) [s]; codes (n,): how each ended, as `loop_kernels`.

    many, kept: as Moving and Kept with one more dimension of n in front, but for damping, work, room and table; rows
    (SIZE,), lanes (LANES, NUMBERS), room (ROWS, TERMS + 2) of `crest_kernels`, nodes (ROOM, NODES) of `creep_kernels`:
    to work in; tolerance (n,): of a step,
    relative. FULL: the room for reversals is used up, and the motion can go on from there. Returns the rounds.
    """
    ahead, rounds = min(at.LANES, until.size), 0
    busy, lanes[:, MODE] = ahead, IDLE
    for lane in range(ahead):
        begun(many, kept, rows, lanes[lane], lane, lane, until, tolerance)
    while busy > 0:
        stepping.series(rows)
        for lane in range(at.LANES):
            own = lanes[lane]
            if own[MODE] == IDLE:
                continue
            own[CREEPS] = own[LAYER] > 0 and creep.crept(rows, own, lane, nodes)
            code = aimed(rows, own, lane)
            if code != GOING:
                ahead = followed(many, kept, rows, own, lane, code, ahead, until, tolerance, codes)
                busy -= own[MODE] == IDLE
        stepping.moved(rows)
        rounds += 1
        for lane in range(at.LANES):
            own = lanes[lane]
            if own[MODE] < GO:
                continue
            code = taken(many, kept, rows, own, lane, room)
            if code != GOING:
                ahead = followed(many, kept, rows, own, lane, code, ahead, until, tolerance, codes)
                busy -= own[MODE] == IDLE
    return rounds
