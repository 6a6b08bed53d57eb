"""Stops and releases of several set-valued interfaces inside a step, which feel each other through the modes.

As `contacts.stop_kernels` has it for one interface: the forces h(x) that would hold all of them change linearly over
the step, 0 <= x <= 1. From event to event some faces rest and some slide (`joints_shares_kernels`). The step then needs
slides and speeds at its end: mean forces give the slides, blows at its end the speeds. `blows` says what work friction
takes in all; the loop steps by the mean forces alone where it would give some.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ..contacts.stop_kernels import stops
from .joints_shares_kernels import (
    BETA,
    BLOW,
    DQ,
    FIRST,
    FORCE,
    FOUND,
    FREE,
    GAMMA,
    KINETIC,
    LAST,
    MEAN,
    MISS,
    RATE,
    REST,
    RIGHT,
    SLIDE,
    SLIDES,
    SLOPE,
    SPEED,
    START,
    STATIC,
    TUG,
    WAY,
    forces_at,
    let_go,
    resting,
    settled,
    shared,
)


@njit(error_model="numpy", **LEAN)
def pulls(e, x, dt, s):
    """(change of speed [m/s] of face e per length of the step at the place x, half of the slope of that)."""
    start, bend, f = 0.0, 0.0, s.field
    for k in range(s.names.size):
        g, rise = dt * s.gives[TUG, e, k], f[LAST, k] - f[FIRST, k]
        start += g * (f[FIRST, k] + rise * x - f[FORCE, k])
        bend += 0.5 * g * (rise - f[SLOPE, k])
    if f[SPEED, e] == 0.0:  # just let go: forward but for round-off
        start = f[WAY, e] * max(f[WAY, e] * start, 0.0)
    return start, bend


@njit(error_model="numpy", **LEAN)
def next_event(x, dt, s):
    """(how far from the place x the next face stops or goes, which, the way it goes or 0)."""
    f, y, who, way = s.field, 1.0 - x, -1, 0.0
    for e in range(s.names.size):
        if abs(f[WAY, e]) == 1.0:
            start, bend = pulls(e, x, dt, s)
            at = stops(f[WAY, e] * f[SPEED, e], f[WAY, e] * start, f[WAY, e] * bend)
            if at < y:
                y, who, way = at, e, 0.0
        elif f[WAY, e] == 0.0 and f[SLOPE, e] != 0.0:
            sign = 1.0 if f[SLOPE, e] > 0 else -1.0
            at = max((s.limit[STATIC, e] - sign * f[FORCE, e]) / abs(f[SLOPE, e]), 0.0)
            if at < y:
                y, who, way = at, e, sign
    return y, who, way


@njit(error_model="numpy", **LEAN)
def moved(x, y, who, dt, s):
    """Move all faces on by y from the place x, where face `who` stops if it slides."""
    f = s.field
    for e in range(s.names.size):
        f[MEAN, e] += y * (f[FORCE, e] + 0.5 * y * f[SLOPE, e])
        if abs(f[WAY, e]) == 1.0:
            start, bend = pulls(e, x, dt, s)
            f[SLIDE, e] += y * dt * (f[SPEED, e] + y * (0.5 * start + y * bend / 3))
            f[MISS, e] = f[SPEED, e] + y * (start + y * bend)
    for e in range(s.names.size):
        if abs(f[WAY, e]) == 1.0:
            last, f[SPEED, e] = abs(f[SPEED, e]), f[MISS, e]
            least = 1e-12 * last if last > 0.0 else -1.0  # alike faces stop at once
            if e == who or (who < 0 and f[WAY, e] * f[SPEED, e] <= 0) or f[WAY, e] * f[SPEED, e] <= least:
                f[SPEED, e], f[WAY, e], f[SLIDES, e] = 0.0, 0.0, 0.0


@njit(error_model="numpy", **LEAN)
def followed(dt, s):
    """Follow all faces through the step: slides, speeds, ways and mean forces in s.field; False where it fails."""
    x = 0.0
    for _ in range(6 * s.names.size + 12):
        if not settled(x, s):
            return False
        y, who, way = next_event(x, dt, s)
        moved(x, y, who, dt, s)
        if who < 0:
            return True
        x += y
        if way != 0.0:
            let_go(who, way, s)
    return False


@njit(error_model="numpy", **LEAN)
def slides_on(s):
    """Whether all faces slide the way they do to the end of the step; ways and speeds stand in s.field then."""
    f, count = s.field, s.names.size
    for e in range(count):
        f[WAY, e], f[SLIDES, e] = np.sign(f[START, e]), 1.0
        if f[START, e] == 0.0:
            return False
    for e in range(count):
        dq, end = f[FREE, e], f[RATE, e]
        for k in range(count):
            force = f[WAY, k] * s.limit[KINETIC, k]
            dq -= s.gives[BETA, e, k] * force
            end -= s.gives[GAMMA, e, k] * force
        if f[WAY, e] * dq < 0 or f[WAY, e] * end <= 0:
            return False
        f[SPEED, e] = end
    return True


@njit(error_model="numpy", **LEAN)
def asked(dt, s):
    """Forces that would hold the faces at the ends of the step, rows FIRST and LAST of s.field; False: none found.

    First of all faces at once. Those that rest are held by what the step itself asks of them beside those that slide:
    the others' accelerations are right to the first order in the step alone, which would place a release anywhere.
    """
    f, faces = s.field, s.names.size
    for stage in range(2):
        count = faces
        if stage == 0:
            for e in range(faces):
                s.names[e] = e
        else:
            count = resting(s)
            if count == 0 or count == faces:
                return True
            if not forces_at(0.0, s):
                return False
        for part in range(2):
            which = BETA if part == 0 else GAMMA
            for i in range(count):
                e = s.names[i]
                f[RIGHT, i] = f[FREE, e] - f[START, e] * dt if part == 0 else f[RATE, e] - f[START, e]
                for k in range(faces if stage == 1 else 0):
                    if f[WAY, k] != 0.0:
                        f[RIGHT, i] -= s.gives[which, e, k] * f[FORCE, k]
            if not shared(which, count, s):
                return False
            for i in range(count):
                e, found = s.names[i], f[FOUND, i]
                if part == 0:
                    f[MEAN, e] = found
                else:
                    first, last = 3 * f[MEAN, e] - 2 * found, 4 * found - 3 * f[MEAN, e]
                    f[FIRST, e] = first if stage == 0 else f[FIRST, e] + first - f[FORCE, e]
                    f[LAST, e] = last if stage == 0 else f[LAST, e] + last - f[FORCE, e] - f[SLOPE, e]
    return True


@njit(error_model="numpy", **LEAN)
def watched(dt, s):
    """Follow the faces from event to event; False where it fails. The ways, slides and speeds stand in s.field.

    Rows FREE, RATE, START and REST are given. Where modes swing within the step nothing inside it can be told.
    """
    f, resolved = s.field, True
    for e in range(s.names.size):
        give = dt * s.gives[TUG, e, e]
        resolved = resolved and s.gives[BETA, e, e] > 0.25 * give * dt and s.gives[GAMMA, e, e] > 0.5 * give
        f[START, e] = 0.0 if f[REST, e] == 1.0 else f[START, e]
    if slides_on(s):
        return True
    if not resolved or not asked(dt, s):
        return False
    for e in range(s.names.size):
        f[SPEED, e], f[WAY, e], f[SLIDE, e], f[MEAN, e] = f[START, e], np.sign(f[START, e]), 0.0, 0.0
        f[SLIDES, e] = abs(f[WAY, e])
    return followed(dt, s)


@njit(error_model="numpy", **LEAN)
def met(s):
    """Mean forces of all faces, row MEAN, that give the slides that were found, and their slides, row DQ; False where
    none are found."""
    f, count = s.field, 0
    for e in range(s.names.size):
        if f[SLIDES, e] == 1.0:
            f[MEAN, e] = f[WAY, e] * s.limit[KINETIC, e]
        else:
            s.names[count] = e
            count += 1
    for i in range(count):
        e = s.names[i]
        f[RIGHT, i] = f[FREE, e] - f[SLIDE, e]
        for k in range(s.names.size):
            f[RIGHT, i] -= s.gives[BETA, e, k] * f[MEAN, k]
    if count and not shared(BETA, count, s):
        return False
    for i in range(count):
        e = s.names[i]
        f[MEAN, e] = min(max(f[MEAN, e] + f[FOUND, i], -s.limit[STATIC, e]), s.limit[STATIC, e])
    for e in range(s.names.size):
        f[DQ, e], size = f[FREE, e], abs(f[FREE, e])
        for k in range(s.names.size):
            part = s.gives[BETA, e, k] * f[MEAN, k]
            f[DQ, e] -= part
            size += abs(part)
        if f[SLIDE, e] == 0.0 and f[SLIDES, e] == 0.0 and abs(f[DQ, e]) <= 1e-14 * size:
            f[DQ, e] = 0.0
    return True


@njit(error_model="numpy", **LEAN)
def blows(s):
    """Blows, row BLOW [N s], that bring every face that stopped, went or rests to its speed; work that all friction
    takes in the step [J]."""
    f, count, work = s.field, 0, 0.0
    for e in range(s.names.size):
        f[BLOW, e] = 0.0
        work += f[MEAN, e] * f[DQ, e]
        for k in range(s.names.size):
            f[RATE, e] -= s.gives[GAMMA, e, k] * f[MEAN, k]
        if f[SLIDES, e] == 0.0 and abs(f[WAY, e]) != 2.0:
            s.names[count] = e
            count += 1
    for i in range(count):
        f[RIGHT, i] = f[RATE, s.names[i]] - f[SPEED, s.names[i]]
    if count and not shared(TUG, count, s):
        return -np.inf
    for i in range(count):
        e = s.names[i]
        f[BLOW, e] = f[FOUND, i]
        work += 0.5 * f[FOUND, i] * (f[RATE, e] + f[SPEED, e])
    return work


@njit(error_model="numpy", **LEAN)
def brought(motion, s):
    """After a step by mean forces alone: blows that bring the faces without a slide to rest, as the modes move."""
    f, count = s.field, 0
    for e in range(s.names.size):
        f[BLOW, e], f[WAY, e] = 0.0, np.sign(f[DQ, e])
        if f[DQ, e] == 0.0:
            f[RIGHT, count] = 0.0
            for k in range(motion.shape[1]):
                f[RIGHT, count] += s.rows[e, k] * motion[1, k]
            s.names[count] = e
            count += 1
    if count and shared(TUG, count, s):
        for i in range(count):
            f[BLOW, s.names[i]] = f[FOUND, i]


@njit(error_model="numpy", **LEAN)
def struck(motion, mass, s):
    """Strike the modes by the blows, in place; energy that they take [J]. Faces at rest are noted in row REST."""
    f, lost = s.field, 0.0
    for k in range(motion.shape[1]):
        change = 0.0
        for e in range(s.names.size):
            change -= s.rows[e, k] * f[BLOW, e] / mass
        lost -= mass * change * (motion[1, k] + 0.5 * change)
        motion[1, k] += change
    for e in range(s.names.size):
        f[REST, e] = 0.0 if abs(f[WAY, e]) == 1.0 else 1.0
    return lost
