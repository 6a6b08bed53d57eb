"""The largest acceleration, force and slip inside a step of one mode, where the step is a polynomial in time.

A polynomial on 0..1 lies within the range of its Bernstein coefficients: where none is above what is known, it has no
larger value, and halves of the step whose coefficients stay below are left out until the largest value is left. Source:
Lane and Riesenfeld, IEEE Transactions on Pattern Analysis and Machine Intelligence 3 (1981) 35.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import INNER
from . import polynomial_kernels as steps
from . import watch_kernels as reading
from .lane_step import TERMS

# TERMS of acceleration and force over the share of the step: those of the series, and one that meets the end
BEGIN, WIDTH = TERMS, TERMS + 1  # of a row of room: the part of the step that it stands for
FORCE, GAIN, FIRST = 0, 1, 2  # rows of room: coefficients, then the parts still to be looked at
HALVINGS = 26  # of a step: a share of 1e-8, whose square is round-off
PARTS = 20 * HALVINGS  # looked at: one or two of each size hold a crest, and of round-off alone there would be no end
ROWS = FIRST + HALVINGS + 2


@njit(error_model="numpy", **INNER)
def value_of(terms, share):
    """Value of a polynomial at a share of the step."""
    value = 0.0
    for power in range(TERMS - 1, -1, -1):
        value = value * share + terms[power]
    return value


@njit(error_model="numpy", **INNER)
def bernstein(terms):
    """Turn the coefficients of a polynomial on 0..1 into those of Bernstein, b_i = sum_k C(i, k)/C(n, k) a_k."""
    n, choices = TERMS - 1, 1.0
    for k in range(1, TERMS):
        choices *= (n + 1 - k) / k
        terms[k] /= choices
    for k in range(1, TERMS):
        for i in range(n, k - 1, -1):
            terms[i] += terms[i - 1]


@njit(error_model="numpy", **INNER)
def highest(known, room):
    """Share of the step at which a polynomial is largest, < 0 where it does not rise above `known` >= 0 by more than
    `reading.FLAT` of it; its Bernstein coefficients are room[FIRST], which is used up with all rows below."""
    at, waiting, n = -1.0, 1, TERMS - 1
    room[FIRST, BEGIN], room[FIRST, WIDTH] = 0.0, 1.0
    for _ in range(PARTS):
        part = room[FIRST + waiting - 1]
        begin, width, top = part[BEGIN], part[WIDTH], part[0]
        for i in range(1, TERMS):
            top = max(top, part[i])
        if part[0] > known:
            at, known = begin, part[0]
        if part[n] > known:
            at, known = begin + width, part[n]
        if top > known * (1 + reading.FLAT) and width > 0.5**HALVINGS:
            left = room[FIRST + waiting]
            for i in range(TERMS):  # de Casteljau: first numbers of its rows are the left half, the last row the right
                left[i] = part[0]
                for j in range(n - i):
                    part[j] = 0.5 * (part[j] + part[j + 1])
            left[BEGIN], left[WIDTH] = begin, 0.5 * width
            part[BEGIN], part[WIDTH] = begin + 0.5 * width, 0.5 * width
            waiting += 1
        else:
            waiting -= 1
        if waiting == 0:
            break
    return at


@njit(error_model="numpy", **INNER)
def gains(m, h, out):
    """Write the coefficients of the absolute acceleration [m s-2] of the output in the step of h [s] into out, but for
    the last one."""
    share, row = m.rows[steps.OUTPUT, 0] / h, m.pieces[int(m.now[steps.PIECE])]
    for k in range(TERMS - 1):
        out[k] = share * (k + 1) * m.work[steps.row(k + 1), 1]
    if m.now[steps.MOVES] != 0:
        turn, power = row[3] * (m.now[steps.TIME] - row[0]) + row[4], row[2]
        wave = (np.sin(turn), np.cos(turn))
        out[0] += row[1]
        for k in range(TERMS - 1):
            out[k] += power * (wave[k % 2] if k % 4 < 2 else -wave[k % 2])
            power *= row[3] * h / (k + 1)


@njit(error_model="numpy", **INNER)
def met(terms, end):
    """Add the term that makes a polynomial meet a value at the end of the step: there the terms left out show most."""
    terms[TERMS - 1] = 0.0
    terms[TERMS - 1] = end - value_of(terms, 1.0)


@njit(error_model="numpy", **INNER)
def passed_zero(terms):
    """Share of the step at which a polynomial of opposite signs at its ends passes zero."""
    low, high = 0.0, 1.0
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        if (value_of(terms, middle) > 0) == (terms[0] > 0):
            low = middle
        else:
            high = middle
    return high


@njit(error_model="numpy", **INNER)
def taken_in(m, h, k, share):
    """Take the numbers at a share of the step of h [s] into the peaks."""
    reading.sizes_at(m, h, share, k, k.table[0])
    for which in range(reading.SLOTS):
        k.tally[reading.PEAKS + which] = max(k.tally[reading.PEAKS + which], k.table[0, which])


@njit(error_model="numpy", **INNER)
def peaks(m, h, k, room):
    """Take the step of h [s] into the peaks of the last cycles.

    room (ROWS, TERMS + 2): the coefficients of the force [N] stand in its row FORCE, all but the last one. The output
    turns at the ends of steps; the slip there and where the force passes zero.
    """
    t = m.now[steps.TIME]
    reading.sizes(m, t, m.y, m.work[0], k.table[0])
    reading.sizes(m, t + h, m.work[steps.TRIAL], m.work[12], k.table[1])
    for which in range(reading.SLOTS):
        k.tally[reading.PEAKS + which] = max(k.tally[reading.PEAKS + which], k.table[0, which], k.table[1, which])
    gains(m, h, room[GAIN])
    met(room[GAIN], m.rows[steps.OUTPUT, 0] * m.work[12, 1] + m.now[steps.MOVES] * steps.push(m, t + h))
    met(room[FORCE], reading.state_of(m, m.work[steps.TRIAL])[2])
    if room[FORCE, 0] * value_of(room[FORCE], 1.0) < 0:
        taken_in(m, h, k, passed_zero(room[FORCE]))
    for terms, which in ((FORCE, reading.FORCE), (GAIN, reading.ACCELERATION)):
        bernstein(room[terms])
        for way in (1.0, -1.0):
            for i in range(TERMS):
                room[FIRST, i] = way * room[terms, i]
            at = highest(k.tally[reading.PEAKS + which], room)
            if at >= 0:
                taken_in(m, h, k, at)
