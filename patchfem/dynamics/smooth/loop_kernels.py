"""Steps whose length the error chooses, from one reversal of the slide to the next.

A step ends where the slide stops, where the law has a kink along its path or at a speed, and where the output passes
its travel. Such an end is found by Newton's method on the length of the step, which is taken anew each time: it is as
exact as the step itself and needs no extension.
"""

from math import sqrt

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ...friction.laws import stretch_kernels as law
from . import step_kernels as steps
from . import watch_kernels as watching
from .arrays import (
    BEGUN,
    CREST,
    CREST_SPEED,
    DONE,
    KNEE_VELOCITY,
    LEFT,
    LOST,
    ORIGIN,
    PACE,
    PARTS,
    PERIOD,
    PIECE,
    REFUSED,
    RELEASE_DIRECTION,
    SAMPLE,
    STEP,
    STOOD,
    STORED,
    TIME,
    TURNED,
    TURNS,
)

NOTHING, STOP, KINK, KNEE, TRAVEL, RELEASE, LIFT = range(7)  # what ends a step
FINISHED, TRAVELLED, FULL, WILD, ENDLESS, PAUSED, LIFTED = range(7)  # how a call ends
# bounds of the change of a step
SLOWER = 0.2
FASTER = 8.0
TURNING = 2.0  # of now[BEGUN]: the motion was left at a reversal
FORGET = 3.0  # cycles over which a largest value is forgotten
CALL = 50_000  # tries of a call, a tenth of a second: no signal is heard inside compiled code
GETS_ON = 1e-3  # of the time of the fastest motion: what CALL tries must come on by at least
INSTANT = 1e-13  # of a period: what lies nearer together happens at once
STUCK = 0.02  # of a period: longest step of what holds, as nothing else tells when it lets go
# of a motion that has not moved on from a stop: it is there, it was found to go the other way
STANDS = 1
FLIPPED = 2


@njit(error_model="numpy", **NJIT_INTERNAL)
def left(m, what, y, slopes, travel):
    """(what is left until an end, > 0 before it; its rate [1/s]; its round-off) in a state with its slopes."""
    n = m.rows.shape[1]
    way = m.turn[0]
    q, v = steps.slide_of(m, y)
    gain = 0.0
    for i in range(n):
        gain += m.rows[steps.SLIDE, i] * slopes[n + i]
    if what == STOP:
        return way * v, way * gain, still(m)
    if what == KINK:
        path = way * (q - m.now[ORIGIN])
        return m.turn[1] - path, -way * v, 1e-15 * (m.now[CREST] + m.turn[1])
    if what == KNEE:
        side = 1.0 if m.turn[2] > 0 else -1.0
        floor = m.turn[KNEE_VELOCITY]
        return side * (way * v - floor), side * way * gain, 1e-12 * floor
    # a law that holds writes what is left of its hold and of the load behind its loss
    if what >= RELEASE:
        return slopes[2 * n + what - RELEASE + 1], 0.0, 0.0
    x, w = watching.output_of(m, y)
    return travel - abs(x), -w if x > 0 else w, 1e-13 * travel


@njit(error_model="numpy", **NJIT_INTERNAL)
def possible(m, what, travel):
    """Whether a motion can meet such an end at all."""
    if what == KINK:
        return m.turn[1] < np.inf
    if what == KNEE:
        return m.turn[KNEE_VELOCITY] > 0
    if what >= RELEASE:
        return law.IS_SET_VALUED and (what == LIFT or m.turn[0] == 0)
    return m.turn[0] != 0 if what == STOP else travel < np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def first_end(m, h, travel, skip):
    """(what ends the step of h [s] first, guess of the share of it) by cubics through both ends; NOTHING, 1."""
    found = NOTHING
    where = 1.0
    for what in range(STOP, LIFT + 1 if law.IS_SET_VALUED else TRAVEL + 1):
        if what == skip or not possible(m, what, travel):
            continue
        b, rate_b, noise = left(m, what, m.work[steps.TRIAL], m.work[12], travel)
        if b >= -noise:
            continue
        a, rate_a, _ = left(m, what, m.y, m.work[0], travel)
        a = max(a, 0.0)
        low = 0.0
        high = 1.0
        p = rate_a * h
        r = rate_b * h
        if a == 0:
            low = high = back_of(p, b, r)
        for _ in range(40 if a > 0 else 0):
            s = 0.5 * (low + high)
            rest = 1 - s
            value = rest * rest * (a * (1 + 2 * s) + p * s) + s * s * (b * (3 - 2 * s) - r * rest)
            if value > 0:
                low = s
            else:
                high = s
        if found == NOTHING or high < where:
            found = what
            where = high
    return found, where


@njit(error_model="numpy", **NJIT_INTERNAL)
def back_of(p, b, r):
    """Share of a step at which a cubic from 0 to b < 0 comes back to zero from above; 0 where it is nowhere above.

    p, r: its slopes at the ends over the step. Less the zero at the start it is p + mid s + big s^2; of the two
    zeros of that it is the one where it falls.
    """
    mid = 3 * b - 2 * p - r
    big = p + r - 2 * b
    root = mid * mid - 4 * big * p
    if root < 0:
        return 0.0
    root = sqrt(root)
    s = -(mid + root) / (2 * big) if mid > 0 else 2 * p / (root - mid) if root > mid else 0.0
    return s if 0 < s < 1 else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def located(m, h, what, share, travel):
    """Length [s] of the step that ends there, within a step of h [s]; m.work[steps.TRIAL] is the state at its end."""
    low = 0.0
    high = h
    at = max(share, 1e-12) * h
    for turn in range(60):
        steps.step(m, at)
        value, rate, noise = left(m, what, m.work[steps.TRIAL], m.work[12], travel)
        if value > 0:
            low = at
        else:
            high = at
        new = at - value / rate if rate < 0 else 0.5 * (low + high)
        # what leaves its rest is within round-off of it too, but does not end there: it would stand for ever
        there = abs(value) <= noise and rate < 0
        if there or abs(new - at) <= 2e-16 * (m.now[TIME] + at) or high - low <= 1e-15 * h:
            break
        at = new if low < new < high and turn < 20 else 0.5 * (low + high)
    return at


@njit(error_model="numpy", **NJIT_INTERNAL)
def let_go(m, h, what, travel):
    """Length [s] of the step that ends just beyond where a hold or a load is used up, within a step of h [s] whose end
    is beyond it; m.work[steps.TRIAL] is the state at its end. Regula falsi with halved ends (Illinois), then halving.
    """
    a = max(left(m, what, m.y, m.work[0], travel)[0], 0.0)
    b = left(m, what, m.work[steps.TRIAL], m.work[12], travel)[0]
    low = 0.0
    high = h
    for turn in range(80):
        if high - low <= 1e-15 * (m.now[TIME] + high) or high - low <= 1e-13 * h:
            break
        at = low + (high - low) * a / (a - b) if turn < 25 and a > b else 0.5 * (low + high)
        at = min(max(at, low + 1e-3 * (high - low)), high - 1e-3 * (high - low)) if turn < 4 else at
        if not low < at < high:
            at = 0.5 * (low + high)
        steps.step(m, at)
        value = left(m, what, m.work[steps.TRIAL], m.work[12], travel)[0]
        if value < 0:
            high = at
            b = value
            a = 0.5 * a
        else:
            low = at
            a = value
            b = 0.5 * b
    steps.step(m, high)
    return high


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def dips(m, h):
    """Share [1] of the step of h [s] at which the speed, > 0 at both ends, may have a least value below zero; 0 for
    none."""
    if m.turn[0] == 0:
        return 0.0
    a, p, _ = left(m, STOP, m.y, m.work[0], np.inf)
    b, r, _ = left(m, STOP, m.work[steps.TRIAL], m.work[12], np.inf)
    return dip_of(a, p * h, b, r * h)


@njit(error_model="numpy", **NJIT_INTERNAL)
def dip_of(a, p, b, r):
    """Share of a step at which a cubic from a to b, both > 0, has a least value below zero or so near to it that the
    speed it stands for may have one; 0 for none.

    p, r: its slopes at the ends over the step. What it errs by is s^2 (1 - s)^2 of the fourth derivative/24.
    """
    if p >= 0 or r <= 0 or a <= 0 or b <= 0:
        return 0.0
    # a + p s + mid s^2 + big s^3
    big = 2 * (a - b) + p + r
    mid = 3 * (b - a) - 2 * p - r
    root = mid * mid - 3 * big * p
    if root <= 0:
        return 0.0
    s = -p / (mid + sqrt(root)) if mid + sqrt(root) != 0 else 0.0
    if s <= 0 or s >= 1:
        return 0.0
    near = (s * (1 - s)) ** 2 * (0.25 * abs(big) + 0.1 * abs(mid))
    return s if a + s * (p + s * (mid + s * big)) < near else 0.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def still(m):
    """Round-off [m/s] of the speed of the slide, below which it rests."""
    return 4e-16 * (m.now[CREST_SPEED] + m.now[PACE] * m.now[CREST])


@njit(error_model="numpy", **NJIT_INTERNAL)
def enter(m, way):
    """Begin a motion in the direction `way` from the state as it stands: the law's states, and the slopes there."""
    n = m.rows.shape[1]
    q, v = steps.slide_of(m, m.y)
    m.now[ORIGIN] = q
    m.turn[0] = way
    states = m.y[2 * n : m.y.size - 3]
    m.turn[1], floor = law.start_motion(m.num[0], m.mem[0], way, states)
    m.turn[2] = 1.0 if way * v > floor else 0.0
    m.turn[KNEE_VELOCITY] = floor
    steps.slope(m, m.now[TIME], m.y, m.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def leave(m, k):
    """End the motion in one direction: move the memory of the law and book what it dissipated."""
    n = m.rows.shape[1]
    size = m.y.size
    q, v, _, before, _ = watching.state_of(m, m.y)
    lost = law.end_motion(m.num[0], m.mem[0], m.turn, q - m.now[ORIGIN], v, m.y[2 * n : size - 3])
    if np.isnan(lost):
        lost = m.y[size - 1] - m.now[LEFT] - before
        m.now[LEFT] = m.y[size - 1] - before
    k.counters[LOST] += lost


@njit(error_model="numpy", **NJIT_INTERNAL)
def heading(m):
    """Direction of a motion that starts: that of its speed, of its acceleration at rest, or of what comes next."""
    n = m.rows.shape[1]
    t = m.now[TIME]
    v = steps.slide_of(m, m.y)[1]
    if v != 0:
        return 1.0 if v > 0 else -1.0
    if law.IS_SET_VALUED:
        return lets_go(m)
    steps.slope(m, t, m.y, m.work[0])
    for look in range(2):
        gain = 0.0
        for i in range(n):
            gain += m.rows[steps.SLIDE, i] * m.work[look, n + i]
        if gain != 0:
            return 1.0 if gain > 0 else -1.0
        if look == 0:
            steps.slope(m, t + m.now[STEP], m.y, m.work[1])
    return 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def lets_go(m):
    """Direction in which a law that holds lets go of the slide at rest, as the motion stands; 0 where it holds."""
    m.turn[0] = 0.0
    steps.slope(m, m.now[TIME], m.y, m.work[0])
    return m.turn[RELEASE_DIRECTION]


@njit(error_model="numpy", **NJIT_INTERNAL)
def rest(m):
    """Take the last digits of the speed of a slide that has stopped from the rates."""
    n = m.rows.shape[1]
    v = steps.slide_of(m, m.y)[1]
    size = 0.0
    for i in range(n):
        size += m.rows[steps.SLIDE, i] * m.rows[steps.SLIDE, i]
    for i in range(n):
        m.y[n + i] = 0.0 if n == 1 else m.y[n + i] - m.rows[steps.SLIDE, i] * v / size


@njit(error_model="numpy", **NJIT_INTERNAL)
def turns_around(m, period):
    """Begin the motion after a stop: whether it turns, else it goes on as before.

    Where speed and acceleration vanish together the next derivative decides: the motion has the direction of its speed
    an INSTANT of the period [s] after the stop, v + a t + j t^2/2. What is opposed to that ends within the instant.
    """
    n = m.rows.shape[1]
    t = m.now[TIME]
    way = -m.turn[0]
    enter(m, way)
    ahead = INSTANT * period
    near = 1e-3 * m.now[STEP]
    gain = 0.0
    later = 0.0
    for c in range(m.y.size):
        m.work[steps.TRIAL, c] = m.y[c] + near * m.work[0, c]
    steps.slope(m, t + near, m.work[steps.TRIAL], m.work[1])
    for i in range(n):
        gain += m.rows[steps.SLIDE, i] * m.work[0, n + i]
        later += m.rows[steps.SLIDE, i] * m.work[1, n + i]
    v = steps.slide_of(m, m.y)[1]
    jerk = (later - gain) / near
    if way * (v + ahead * (gain + 0.5 * ahead * jerk)) >= 0:
        return True
    enter(m, -way)
    return False


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def accept(m, h, k):
    """Move on by the step of h [s] that stands in m.work[steps.TRIAL]."""
    n = m.rows.shape[1]
    fade = 1 - min(h / (FORGET * k.counters[PERIOD]), 1.0)
    m.now[CREST] *= fade
    m.now[CREST_SPEED] *= fade
    for c in range(m.y.size):
        m.y[c] = m.work[steps.TRIAL, c]
        m.work[0, c] = m.work[12, c]
    if law.IS_SET_VALUED and m.turn[0] == 0:
        rest(m)
    for i in range(n):
        m.now[CREST] = max(m.now[CREST], abs(m.y[i]))
        m.now[CREST_SPEED] = max(m.now[CREST_SPEED], abs(m.y[n + i]))
    m.now[TIME] += h


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def try_step(m, h, tolerance, k):
    """Take a step of at most h [s] whose error meets the tolerance: (its length, the next length)."""
    if law.IS_SET_VALUED:
        h = min(h, STUCK * k.counters[PERIOD] if m.turn[0] == 0 else np.inf)
    for _ in range(60):
        steps.step(m, h)
        error = steps.missed(m, h, tolerance)
        if error <= 1:
            dip = dips(m, h)
            if dip == 0:
                grow = FASTER if error == 0 else min(max(0.9 * error**-0.125, SLOWER), FASTER)
                return h, h * grow
            h *= dip
        else:
            h *= max(0.9 * error**-0.125, SLOWER) if np.isfinite(error) else SLOWER
        k.counters[REFUSED] += 1
    return 0.0, 0.0


@njit(error_model="numpy", forceinline=True, **NJIT_INTERNAL)
def pass_end(m, k, what):
    """Go on beyond the end of a step: turn around, or into the next part of the law."""
    n = m.rows.shape[1]
    if law.IS_SET_VALUED and what in (STOP, RELEASE):
        rest(m)
        leave(m, k)
        way = lets_go(m)
        enter(m, way)
        if way != 0 or what == STOP:
            watching.write(m, m.now[TIME], m.y, k.turns[int(k.counters[TURNS])])
            k.counters[TURNS] += 1
    elif what == STOP:
        if n == 1:
            m.y[1] = 0.0  # to the last digit
        leave(m, k)
        if turns_around(m, k.counters[PERIOD]):
            watching.write(m, m.now[TIME], m.y, k.turns[int(k.counters[TURNS])])
            k.counters[TURNS] += 1
    elif what == KINK:
        leave(m, k)
        enter(m, m.turn[0])
    elif what == KNEE:
        m.turn[2] = 1 - m.turn[2]
        steps.slope(m, m.now[TIME], m.y, m.work[0])


@njit(error_model="numpy", **NJIT_INTERNAL)
def begin(m, k):
    """Begin a motion from the state as it stands."""
    n = m.rows.shape[1]
    for i in range(n):
        m.now[CREST] = max(m.now[CREST], abs(m.y[i]))
        m.now[CREST_SPEED] = max(m.now[CREST_SPEED], abs(m.y[n + i]))
    enter(m, heading(m))
    k.counters[STORED] = watching.stored(m, m.y)
    m.now[LEFT] = m.y[m.y.size - 1] - watching.state_of(m, m.y)[3]
    m.now[BEGUN] = 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def sampled(m, k):
    """Take the samples that are asked for at the time as it stands."""
    at = int(k.counters[SAMPLE])
    while at < k.samples.shape[0] and k.samples[at, 0] <= m.now[TIME]:
        watching.write(m, m.now[TIME], m.y, k.samples[at])
        at += 1
    k.counters[SAMPLE] = at


@njit(error_model="numpy", **NJIT_INTERNAL)
def went_on(m):
    """STANDS where a motion was left at a reversal, for lack of room, else 0: it goes on as if it had not been left."""
    fresh = STANDS if m.now[BEGUN] == TURNING else 0
    m.now[BEGUN] = 1.0
    return fresh


@njit(error_model="numpy", **NJIT_INTERNAL)
def first_of_ends(m, taken, what, share, travel):
    """(length [s] of the step that was tried up to the first end in it, what ends it); NOTHING as it is."""
    while what != NOTHING:
        taken = (
            located(m, taken, what, share, travel)
            if what < RELEASE
            else let_go(m, taken, what, travel)
        )
        other, share = first_end(m, taken, travel, what)
        if other == NOTHING:
            break
        what = other
    return taken, what


@njit(error_model="numpy", cache=True, nogil=True, **NJIT_NO_REFCOUNT)
def advance(m, k, until, edge, tolerance, travel):
    """Move on to the time `until` [s], or to the edge [s] of the piece of the drive: how it ended.

    tolerance: of a step, relative; travel [m] of the output. FULL: the room for reversals or parts is used up; PAUSED:
    CALL tries are made. The motion goes on from either to the last bit as if it had not been left.
    """
    if m.now[BEGUN] == 0:
        begin(m, k)
    end = min(until, edge)
    fresh = went_on(m)
    if m.now[STOOD] != m.now[PIECE]:  # the drive has changed
        steps.slope(m, m.now[TIME], m.y, m.work[0])
        m.now[STOOD] = m.now[PIECE]
    sampled(m, k)
    begun = m.now[TIME]
    tried = k.counters[DONE] + k.counters[REFUSED]
    while m.now[TIME] < end:
        full = (
            k.counters[TURNS] >= k.turns.shape[0]
            or 0 < k.parts.shape[0] < k.counters[PARTS] + watching.MOST_PARTS
        )
        spent = k.counters[DONE] + k.counters[REFUSED] - tried > CALL and fresh != FLIPPED
        if spent and m.now[TIME] - begun < GETS_ON / m.now[PACE]:
            return ENDLESS
        if full or spent:
            m.now[BEGUN] = TURNING if fresh > 0 else 1.0
            return FULL if full else PAUSED
        remaining = end - m.now[TIME]
        whole = m.now[STEP] >= remaining * (1 - 1e-9)
        h, wanted = try_step(m, remaining if whole else m.now[STEP], tolerance, k)
        if h <= 1e-16 * end:
            return ENDLESS
        taken = h
        what, share = first_end(m, h, travel, NOTHING)
        if what == STOP and fresh > 0 and share * h < INSTANT * k.counters[PERIOD]:
            if fresh == FLIPPED:  # neither way: no motion of a law that is smooth does so
                return ENDLESS
            enter(m, -m.turn[0])
            fresh = FLIPPED
            continue
        taken, what = first_of_ends(m, taken, what, share, travel)
        # the stages of the step that was tried may have passed by what bends beside its end
        if what != NOTHING:
            error = steps.missed(m, taken, tolerance)
            if error > 1:
                m.now[STEP] = taken * max(0.9 * error**-0.125, SLOWER)
                k.counters[REFUSED] += 1
                continue
        watching.watch(m, taken, k)
        accept(m, taken, k)
        if whole and taken == remaining:
            m.now[TIME] = end
        m.now[STEP] = max(wanted, m.now[STEP]) if whole and h == remaining else wanted
        if fresh == STANDS:
            m.now[TURNED] = wanted
        fresh = 0
        if not np.isfinite(m.y[0]):
            return WILD
        if what == TRAVEL or what == LIFT:
            return TRAVELLED if what == TRAVEL else LIFTED
        if what != NOTHING:
            pass_end(m, k, what)
            if what == STOP or what == RELEASE:
                fresh = STANDS
                m.now[STEP] = min(m.now[TURNED], m.now[STEP])
    sampled(m, k)
    return FINISHED


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def settled(m, k, row):
    """Energy of modes and interface [J] as the motion stands; writes its sample into row, and moves the memory of the
    law to there: for a copy of the motion."""
    out = watching.stored(m, m.y)
    watching.write(m, m.now[TIME], m.y, row)
    leave(m, k)
    return out
