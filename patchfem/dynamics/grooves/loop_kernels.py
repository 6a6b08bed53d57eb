"""From stop to release over grooves: steps whose length the error chooses, with the samples of a march.

A slip ends where the slide stops, a stick where the force that holds it leaves what the flank holds. Both ends are
found by taking the step anew, so they are as exact as the step itself.
"""

from math import sqrt

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ..modal_kernels import note, sample
from ..modal_kernels import stored as of_modes
from ..smooth.step_kernels import PIECE
from .step_kernels import (
    CREST,
    CREST_SPEED,
    FORCE,
    LENGTH,
    NORMAL,
    PACE,
    RAISED,
    SPEED,
    START,
    STICKS,
    SWING,
    TRIAL,
    WAY,
    WORK,
    holds,
    missed,
    slide_of,
    slope,
    step,
    stored,
)

LIFTS = 5  # how a call ends, besides those of `march.loop_kernels`
MOST = 10_000  # steps between two samples
EVENTS = 50  # stops and releases between two samples
QUICK = 0.2  # radians of a load that swings in a step: what sticks has no error that would tell of it
FORGET = 1e-3  # of the largest coordinate and rate, per step


@njit(error_model="numpy", **LEAN)
def beyond(m, t, y, slopes):
    """How far a state at the time t [s] is past the end of its stick or slip, below zero before it; its slopes and
    forces are written.

    Of a slip the speed against its way [m/s]; of a stick the force [N] that holds the slide beyond what the flank does.
    """
    m.flags[FORCE], m.flags[NORMAL] = slope(m, t, y, slopes)
    q, v = slide_of(m, y)
    if m.flags[STICKS] == 0.0:
        return -m.flags[WAY] * v
    low, high = holds(m.num, q, t)
    return max(m.flags[FORCE] - high, low - m.flags[FORCE])


@njit(error_model="numpy", **LEAN)
def tried(m, t, h):
    """Take the step of h [s] from m.work[START] at the time t [s]; how far its end is past the end of stick or slip."""
    step(m, t, m.work[START], h)
    return beyond(m, t + h, m.work[TRIAL], m.work[6])


@njit(error_model="numpy", **LEAN)
def dips(m, h):
    """Share [1] of a slip of h [s] at which its speed, along its way at both ends, has a least value against it."""
    way, before, after, p, r, n = m.flags[WAY], 0.0, 0.0, 0.0, 0.0, m.slide.size
    for i in range(n):
        before += way * m.slide[i] * m.work[START, n + i]
        after += way * m.slide[i] * m.work[TRIAL, n + i]
        p += way * h * m.slide[i] * m.work[0, n + i]
        r += way * h * m.slide[i] * m.work[6, n + i]
    if p >= 0 or r <= 0 or before <= 0:
        return 0.0
    big, mid = 2 * (before - after) + p + r, 3 * (after - before) - 2 * p - r  # v = before + p s + mid s^2 + big s^3
    root = mid * mid - 3 * big * p
    if root <= 0 or mid + sqrt(root) == 0:
        return 0.0
    s = -p / (mid + sqrt(root))
    return s if 0 < s < 1 and before + s * (p + s * (mid + s * big)) < 0 else 0.0


@njit(error_model="numpy", **LEAN)
def located(m, t, h, past):
    """Length [s] of the step at whose end stick or slip ends, on the far side, within a step of h [s] whose end is
    `past` it; the state there is in m.work[TRIAL]. Regula falsi with halved ends (Illinois), then halving."""
    low, high, below, above = 0.0, h, min(beyond(m, t, m.work[START], m.work[0]), 0.0), past
    for turn in range(80):
        if high - low <= 1e-15 * (t + high) or high - low <= 1e-13 * h:
            break
        at = low + (high - low) * (-below / (above - below)) if turn < 25 and above > below else 0.5 * (low + high)
        at = min(max(at, low + 1e-3 * (high - low)), high - 1e-3 * (high - low)) if turn < 4 else at
        if not low < at < high:
            at = 0.5 * (low + high)
        value = tried(m, t, at)
        if value > 0:
            high, above, below = at, value, 0.5 * below
        else:
            low, below, above = at, value, 0.5 * above
    tried(m, t, high)
    return high


@njit(error_model="numpy", **LEAN)
def begin(m, t, y, v):
    """Stick or slip of a state at the time t [s] that slides at v [m/s]: set the flags, and the slopes in m.work[0]."""
    if m.num[SPEED] > 0:  # a law of the speed never sticks
        m.flags[STICKS], m.flags[WAY] = 0.0, 1.0
    elif v != 0.0:
        m.flags[STICKS], m.flags[WAY] = 0.0, 1.0 if v > 0 else -1.0
    else:
        m.flags[STICKS] = 1.0
        m.flags[FORCE] = slope(m, t, y, m.work[0])[0]
        low, high = holds(m.num, slide_of(m, y)[0], t)
        if m.flags[FORCE] > high or m.flags[FORCE] < low:
            m.flags[STICKS], m.flags[WAY] = 0.0, 1.0 if m.flags[FORCE] > high else -1.0
    m.flags[FORCE], m.flags[NORMAL] = slope(m, t, y, m.work[0])


@njit(error_model="numpy", **LEAN)
def rest(m, y):
    """Take the last digits of the slide's speed from the rates of a state that has stopped."""
    n, v, size = m.slide.size, slide_of(m, y)[1], 0.0
    for i in range(n):
        size += m.slide[i] * m.slide[i]
    for i in range(n):
        y[n + i] = 0.0 if n == 1 else y[n + i] - m.slide[i] * v / size


@njit(error_model="numpy", **LEAN)
def taken(m, t, end, tolerance):
    """One step from m.work[START] at the time t [s] to `end` [s] at most, whose error meets the tolerance: (its length,
    0 where there is none, whether stick or slip ends there). m.work[0] holds the slopes at the start."""
    h = min(m.flags[LENGTH], end - t) if m.flags[LENGTH] > 0 else end - t
    if m.num[SWING] != 0.0:
        h = min(h, QUICK / m.num[PACE])
    for _ in range(60):
        past = tried(m, t, h)
        error = missed(m, m.work[START], h, tolerance)
        if error <= 1:
            dip = dips(m, h) if m.flags[STICKS] == 0.0 and m.num[SPEED] == 0.0 and past <= 0 else 0.0
            if dip == 0.0:
                grow = min(max(0.9 * error**-0.2, 0.2), 5.0) if error > 0 else 5.0
                m.flags[LENGTH] = max(h * grow, m.flags[LENGTH] if h >= end - t else 0.0)
                break
            h *= dip
        else:
            h *= max(0.9 * error**-0.2, 0.1) if np.isfinite(error) else 0.1
    else:
        return 0.0, False
    if past <= 0 or m.num[SPEED] > 0:
        return h, False
    return located(m, t, h, past), True


@njit(error_model="numpy", **LEAN)
def advance(m, t, end, tolerance, ledger):
    """Move m.work[START] on from the time t [s] to `end` [s]: True where it came there."""
    y, n, events = m.work[START], m.slide.size, 0
    for _ in range(MOST):
        if t >= end:
            return True
        h, ends = taken(m, t, end, tolerance)
        if h <= 0.0:
            return False
        ledger[5] += 1.0
        for c in range(y.size):
            y[c] = m.work[TRIAL, c]
            m.work[0, c] = m.work[6, c]
        t = end if h >= end - t else t + h
        for i in range(n):
            m.flags[CREST] = max((1 - FORGET) * m.flags[CREST], abs(y[i]))
            m.flags[CREST_SPEED] = max((1 - FORGET) * m.flags[CREST_SPEED], abs(y[n + i]))
        if not m.flags[NORMAL] > 0:
            return True
        if m.flags[STICKS] == 1.0:
            rest(m, y)
        if not ends:
            continue
        events += 1
        if m.flags[STICKS] == 1.0:  # it lets go the way it is pulled
            low, high = holds(m.num, slide_of(m, y)[0], t)
            m.flags[STICKS], m.flags[WAY] = 0.0, 1.0 if m.flags[FORCE] > 0.5 * (low + high) else -1.0
            m.flags[FORCE], m.flags[NORMAL] = slope(m, t, y, m.work[0])
        else:
            rest(m, y)
            begin(m, t, y, 0.0)
        if events > EVENTS:
            return False
    return False


@njit(error_model="numpy", cache=True, **LEAN)
def march(m, ends, first, steps, dt, motion, tolerance, travel, ledger, rows):
    """March `steps` samples of dt [s] from number `first`; about 1 us per sample and mode.

    m: Climb; ends (p,) [s] of the pieces of the drive; motion (2, n): coordinates and rates; tolerance: relative, of a
    step; travel [m] of the output; ledger (9,) as of `march.loop_kernels`, with steps for iterations; rows (steps + 1,
    2 n + 9): as there z, z', q, q', F, slip, mean force of the step that follows, energy of the grooves, work of the
    slide in it [J], then friction's own loss in it [J] and the vertical force [N]. Returns (samples done, status): 0
    finished, 1 travel exceeded, 3 not finite, 5 the vertical force fell to zero.
    """
    n, y = m.slide.size, m.work[START]
    for i in range(steps + 1):
        t = (first + i) * dt
        q, v, out = sample(rows[i], motion, m.slide, m.output)
        for k in range(n):
            y[k], y[n + k] = motion[0, k], motion[1, k]
        if first + i == 0:
            begin(m, t, y, v)
        while t >= ends[int(m.now[PIECE])]:
            m.now[PIECE] += 1
        m.flags[FORCE], m.flags[NORMAL] = slope(m, t, y, m.work[0])
        height = stored(m, q, v)
        status = note(rows[i, :2 * n + 6], m.flags[FORCE], height, q, out, travel,
                      height + of_modes(motion, m.omega, m.mass[0]), ledger)
        rows[i, 2 * n + 8] = m.flags[NORMAL]
        if status == 0 and not m.flags[NORMAL] > 0:
            status = LIFTS
        if status:
            return i, status
        if i == steps:
            break
        for k in range(WORK):  # of this sample alone, so that they keep their digits
            y[2 * n + k] = 0.0
        until = (first + i + 1) * dt
        fine = True
        while fine and t < until and m.flags[NORMAL] > 0:
            edge = min(until, ends[int(m.now[PIECE])])
            fine = advance(m, t, edge, tolerance, ledger)
            t = edge
            if t < until:
                m.now[PIECE] += 1
                m.flags[FORCE], m.flags[NORMAL] = slope(m, t, y, m.work[0])
        ledger[7] += 0.0 if fine else 1.0
        for k in range(n):
            motion[0, k], motion[1, k] = y[k], y[n + k]
        work, dq = y[2 * n + 2], slide_of(m, y)[0] - q
        rows[i, 2 * n + 4] = work / dq if dq != 0.0 else rows[i, 2 * n + 2]
        rows[i, 2 * n + 6], rows[i, 2 * n + 7] = work, y[2 * n + 3]
        ledger[0] += y[2 * n]
        ledger[1] += y[2 * n + 1]
        ledger[2] += abs(y[2 * n])
        ledger[3] += y[2 * n + 3]
        ledger[8] += work
        m.flags[RAISED] += y[2 * n + 4]
    return steps, 0
