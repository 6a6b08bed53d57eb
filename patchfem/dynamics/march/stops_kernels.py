"""Stops and releases of set-valued faces inside a step: which rest, slide or carry, and the forces they need for it.

A march moves the modes under mean forces, so a stop or a release inside the step would be off by up to a step, and a
slide that holds would keep a speed. Here the forces h(x) that would hold all faces change linearly over the step, 0 <=
x <= 1, and a slide accelerates by what they differ from the friction: every stop and every release is the root of a
line or a parabola. From event to event some faces rest and some slide. Those that rest share what the others and the
modes ask of them; dependent ones share by least squares, and one that this share would overload while the others hold
it carries its static friction. The limits may change linearly over the step, as under a load that changes.

The step then needs slides and speeds at its end: mean forces give the slides, blows at its end the speeds. Both are of
second order in the step. `blows` says what work friction takes in all; the loop steps by the mean forces alone where it
would give some. s: `contacts.arrays.Stops`. Read `watched` first.

Stiff elastic-plastic faces do not replace this text. They have one coefficient of friction, so a kinetic coefficient
below the static one cannot be given to them. With equal coefficients, on 119 random rigs, 98 % of the
errors hold with set-valued faces; with elastic-plastic ones 50 %, 74 % and 81 % hold for bond lengths of 0.1, 0.01 and
0.001 of the tolerance times the friction force over the stiffness of the mode, and 72 %, 88 % and 91 % of the values
are within the tolerance, where all set-valued ones are.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL, NJIT_NO_REFCOUNT
from ..dense_kernels import factor, solve
from ..modal_kernels import accelerations

HOLDS = 0  # of num: the law that holds without a stretch
# of arrays.Faces: rows of `of` and of `modal`, places of `own`, rows of `each`
PORT, RUBS, MATE = range(3)
GIVE, BESIDE, ROOM = range(3)
FORCE_OWN, STEP_OWN, NOW_OWN, AIM, KNOWN = range(5)
PULL, PLACE, PACE, EPS, STEP, LACK, MOST, CLOSE, WENT, WENT_BEFORE = range(10)
TRACE = 1e-10  # of the diagonal: give of dependent faces, which leaves their share free
TIED = 1e-7  # of the diagonal: what is left of a face's own give where others hold it
BETA, GAMMA, TUG = range(3)  # of `gives`
# of `limit`: at the start of the step, and END rows further on at its end
STATIC, KINETIC, END = range(3)
# rows of `field`: free slide and speed, speed at the start, whether it rests there; holding force at both ends; slide
# and speed so far, mean force; force now and its slope; way (0 rest, +-1 slides, +-2 carries), whether it slides all
# the way; right side, solution, residual; slide of the step, blow
(
    FREE,
    RATE,
    START,
    REST,
    FIRST,
    LAST,
    SLIDE,
    SPEED,
    MEAN,
    FORCE,
    SLOPE,
    WAY,
    SLIDES,
    RIGHT,
    FOUND,
    MISS,
    DQ,
    BLOW,
) = range(18)


@njit(error_model="numpy", **NJIT_INTERNAL)
def bound(which, e, x, s):
    """Static or kinetic friction [N] of face e at the place x of the step."""
    return s.limit[which, e] + x * (s.limit[which + END, e] - s.limit[which, e])


@njit(error_model="numpy", **NJIT_INTERNAL)
def shared(which, count, s):
    """Put the solution x of A x = b into row FOUND of s.field, b in row RIGHT, A = s.gives[which] of the faces
    s.names[:count].

    b and x are in the order of the names. Of dependent faces it is the smallest x. False where A has no positive
    diagonal.
    """
    a = s.system[:count, :count]
    b = s.field[RIGHT]
    x = s.field[FOUND]
    r = s.field[MISS]
    names = s.names
    if count == 1:
        give = s.gives[which, names[0], names[0]]
        x[0] = b[0] / give
        return give > 0.0
    for i in range(count):
        for k in range(count):
            a[i, k] = s.gives[which, names[i], names[k]]
        a[i, i] *= 1 + TRACE
        x[i] = 0.0
    if not factor(a):
        return False
    for _ in range(2):  # the second takes the trace out of what depends on no other
        for i in range(count):
            r[i] = b[i]
            for k in range(count):
                r[i] -= s.gives[which, names[i], names[k]] * x[k]
        solve(a, r[:count])
        for i in range(count):
            x[i] += r[i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def resting(s):
    """Numbers of the faces that rest into s.names; how many."""
    count = 0
    for e in range(s.names.size):
        if s.field[WAY, e] == 0.0:
            s.names[count] = e
            count += 1
    return count


@njit(error_model="numpy", **NJIT_INTERNAL)
def forces_at(x, s):
    """Forces of all faces at the place x of the step and their slopes, into s.field; False where there are none."""
    f = s.field
    count = resting(s)
    for e in range(s.names.size):
        which = STATIC if abs(f[WAY, e]) == 2.0 else KINETIC
        way = np.sign(f[WAY, e])
        f[FORCE, e] = way * bound(which, e, x, s)
        f[SLOPE, e] = way * (s.limit[which + END, e] - s.limit[which, e])
    for part in range(2):
        for i in range(count):
            f[RIGHT, i] = 0.0
            for e in range(s.names.size):
                if f[WAY, e] != 0.0:
                    rise = f[LAST, e] - f[FIRST, e]
                    beyond = (
                        f[FIRST, e] + rise * x - f[FORCE, e] if part == 0 else rise - f[SLOPE, e]
                    )
                    f[RIGHT, i] += s.gives[TUG, s.names[i], e] * beyond
        if count and not shared(TUG, count, s):
            return False
        for i in range(count):
            e = s.names[i]
            rise = f[LAST, e] - f[FIRST, e]
            if part == 0:
                f[FORCE, e] = f[FIRST, e] + rise * x + f[FOUND, i]
            else:
                f[SLOPE, e] = rise + f[FOUND, i]
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def let_go(e, way, s):
    """Let face e slide along way, or carry its static friction where the others that rest hold it."""
    f = s.field
    # no more among those that rest
    f[WAY, e] = way
    f[SLIDES, e] = 0.0
    count = resting(s)
    for i in range(count):
        f[RIGHT, i] = s.gives[TUG, s.names[i], e]
    if count == 0 or not shared(TUG, count, s):
        return
    left = s.gives[TUG, e, e]
    for i in range(count):
        left -= s.gives[TUG, e, s.names[i]] * f[FOUND, i]
    if left <= TIED * s.gives[TUG, e, e]:
        f[WAY, e] = 2 * way


@njit(error_model="numpy", **NJIT_INTERNAL)
def settled(x, s):
    """Which faces rest, slide or carry at the place x, and their forces; False where no choice is found."""
    f = s.field
    for e in range(s.names.size):
        if abs(f[WAY, e]) == 2.0:
            f[WAY, e] = 0.0
    for _ in range(2 * s.names.size + 2):
        if not forces_at(x, s):
            return False
        worst = 1e-9
        who = -1
        for e in range(s.names.size):
            over = abs(f[FORCE, e]) / max(bound(STATIC, e, x, s), 1e-300) - 1
            if f[WAY, e] == 0.0 and over > worst:
                worst = over
                who = e
        if who < 0:
            return True
        let_go(who, 1.0 if f[FORCE, who] > 0 else -1.0, s)
    return False


@njit(error_model="numpy", **NJIT_INTERNAL)
def passes_zero(speed, start, bend):
    """Where speed + start y + bend y^2 falls to 0, infinite where it does not; speed >= 0, start >= 0 where it is 0."""
    if speed == 0.0:
        return -start / bend if bend < 0 else np.inf
    root = start * start - 4 * bend * speed
    if root < 0:
        return np.inf
    below = np.sqrt(root) - start
    return 2 * speed / below if below > 0 else np.inf


@njit(error_model="numpy", **NJIT_INTERNAL)
def pulls(e, x, dt, s):
    """(change of speed [m/s] of face e per length of the step at the place x, half of the slope of that)."""
    start = 0.0
    bend = 0.0
    f = s.field
    for k in range(s.names.size):
        g = dt * s.gives[TUG, e, k]
        rise = f[LAST, k] - f[FIRST, k]
        start += g * (f[FIRST, k] + rise * x - f[FORCE, k])
        bend += 0.5 * g * (rise - f[SLOPE, k])
    if f[SPEED, e] == 0.0:  # just let go: forward but for round-off
        start = f[WAY, e] * max(f[WAY, e] * start, 0.0)
    return start, bend


@njit(error_model="numpy", **NJIT_INTERNAL)
def next_event(x, dt, s):
    """(how far from the place x the next face stops or goes, which, the way it goes or 0)."""
    f = s.field
    y = 1.0 - x
    who = -1
    way = 0.0
    for e in range(s.names.size):
        if abs(f[WAY, e]) == 1.0:
            start, bend = pulls(e, x, dt, s)
            at = passes_zero(f[WAY, e] * f[SPEED, e], f[WAY, e] * start, f[WAY, e] * bend)
            if at < y:
                y = at
                who = e
                way = 0.0
        elif f[WAY, e] == 0.0:
            for sign in (1.0, -1.0):
                rise = sign * f[SLOPE, e] - (s.limit[STATIC + END, e] - s.limit[STATIC, e])
                if rise > 0:
                    at = max((bound(STATIC, e, x, s) - sign * f[FORCE, e]) / rise, 0.0)
                    if at < y:
                        y = at
                        who = e
                        way = sign
    return y, who, way


@njit(error_model="numpy", **NJIT_INTERNAL)
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
            last = abs(f[SPEED, e])
            f[SPEED, e] = f[MISS, e]
            least = 1e-12 * last if last > 0.0 else -1.0  # alike faces stop at once
            if (
                e == who
                or (who < 0 and f[WAY, e] * f[SPEED, e] <= 0)
                or f[WAY, e] * f[SPEED, e] <= least
            ):
                f[SPEED, e] = 0.0
                f[WAY, e] = 0.0
                f[SLIDES, e] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
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


@njit(error_model="numpy", **NJIT_INTERNAL)
def slides_on(s):
    """Whether all faces slide the way they do to the end of the step; ways and speeds stand in s.field then."""
    f = s.field
    count = s.names.size
    for e in range(count):
        f[WAY, e] = np.sign(f[START, e])
        f[SLIDES, e] = 1.0
        if f[START, e] == 0.0:
            return False
    for e in range(count):
        dq = f[FREE, e]
        end = f[RATE, e]
        for k in range(count):
            force = f[WAY, k] * bound(KINETIC, k, 0.5, s)
            dq -= s.gives[BETA, e, k] * force
            end -= s.gives[GAMMA, e, k] * force
        if f[WAY, e] * dq < 0 or f[WAY, e] * end <= 0:
            return False
        f[SPEED, e] = end
    return True


@njit(error_model="numpy", **NJIT_INTERNAL)
def asked(dt, s):
    """Forces that would hold the faces at the ends of the step, rows FIRST and LAST of s.field; False: none found.

    First of all faces at once. Those that rest are held by what the step itself asks of them beside those that slide:
    the others' accelerations are right to the first order in the step alone, which would place a release anywhere.
    """
    f = s.field
    faces = s.names.size
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
                f[RIGHT, i] = (
                    f[FREE, e] - f[START, e] * dt if part == 0 else f[RATE, e] - f[START, e]
                )
                for k in range(faces if stage == 1 else 0):
                    if f[WAY, k] != 0.0:
                        mean = f[FORCE, k] + f[SLOPE, k] * (1 / 3 if part == 0 else 1 / 2)
                        f[RIGHT, i] -= s.gives[which, e, k] * mean
            if not shared(which, count, s):
                return False
            for i in range(count):
                e = s.names[i]
                found = f[FOUND, i]
                if part == 0:
                    f[MEAN, e] = found
                else:
                    first = 3 * f[MEAN, e] - 2 * found
                    last = 4 * found - 3 * f[MEAN, e]
                    f[FIRST, e] = first if stage == 0 else f[FIRST, e] + first - f[FORCE, e]
                    f[LAST, e] = (
                        last if stage == 0 else f[LAST, e] + last - f[FORCE, e] - f[SLOPE, e]
                    )
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def watched(dt, s):
    """Follow the faces from event to event; False where it fails. The ways, slides and speeds stand in s.field.

    Rows FREE, RATE, START and REST are given. Where modes swing within the step nothing inside it can be told.
    """
    f = s.field
    resolved = True
    for e in range(s.names.size):
        give = dt * s.gives[TUG, e, e]
        resolved = (
            resolved
            and s.gives[BETA, e, e] > 0.25 * give * dt
            and s.gives[GAMMA, e, e] > 0.5 * give
        )
        f[START, e] = 0.0 if f[REST, e] == 1.0 else f[START, e]
    if slides_on(s):
        return True
    if not resolved or not asked(dt, s):
        return False
    for e in range(s.names.size):
        f[SPEED, e] = f[START, e]
        f[WAY, e] = np.sign(f[START, e])
        f[SLIDE, e] = 0.0
        f[MEAN, e] = 0.0
        f[SLIDES, e] = abs(f[WAY, e])
    return followed(dt, s)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def met(s):
    """Mean forces of all faces, row MEAN, that give the slides that were found, and their slides, row DQ; False where
    none are found."""
    f = s.field
    count = 0
    for e in range(s.names.size):
        if f[SLIDES, e] == 1.0:
            f[MEAN, e] = f[WAY, e] * bound(KINETIC, e, 0.5, s)
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
        most = max(s.limit[STATIC, e], s.limit[STATIC + END, e])
        f[MEAN, e] = min(max(f[MEAN, e] + f[FOUND, i], -most), most)
    for e in range(s.names.size):
        f[DQ, e] = f[FREE, e]
        size = abs(f[FREE, e])
        for k in range(s.names.size):
            part = s.gives[BETA, e, k] * f[MEAN, k]
            f[DQ, e] -= part
            size += abs(part)
        if f[SLIDE, e] == 0.0 and f[SLIDES, e] == 0.0 and abs(f[DQ, e]) <= 1e-14 * size:
            f[DQ, e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def blows(s):
    """Blows, row BLOW [N s], that bring every face that stopped, went, turned or rests to its speed; work that all
    friction takes in the step [J]."""
    f = s.field
    count = 0
    work = 0.0
    for e in range(s.names.size):
        f[BLOW, e] = 0.0
        work += f[MEAN, e] * f[DQ, e]
        for k in range(s.names.size):
            f[RATE, e] -= s.gives[GAMMA, e, k] * f[MEAN, k]
        turned = f[SLIDES, e] == 0.0 or f[WAY, e] * f[RATE, e] <= 0.0
        if turned and abs(f[WAY, e]) != 2.0:
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


@njit(error_model="numpy", **NJIT_INTERNAL)
def brought(motion, s):
    """After a step by mean forces alone: blows that bring the faces without a slide to rest, as the modes move."""
    f = s.field
    count = 0
    for e in range(s.names.size):
        f[BLOW, e] = 0.0
        f[WAY, e] = np.sign(f[DQ, e])
        if f[DQ, e] == 0.0:
            f[RIGHT, count] = speed_of(motion, e, s)
            s.names[count] = e
            count += 1
    if count and shared(TUG, count, s):
        for i in range(count):
            f[BLOW, s.names[i]] = f[FOUND, i]


@njit(error_model="numpy", **NJIT_INTERNAL)
def speed_of(motion, e, s):
    """Speed [m/s] of face e as the modes move."""
    out = 0.0
    for k in range(motion.shape[1]):
        out += s.rows[e, k] * motion[1, k]
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def struck(motion, mass, s):
    """Strike the modes by the blows, in place; energy that they take [J]. Faces at rest are noted in row REST."""
    f = s.field
    lost = 0.0
    for k in range(motion.shape[1]):
        change = 0.0
        for e in range(s.names.size):
            change -= s.rows[e, k] * f[BLOW, e] / mass
        lost -= mass * change * (motion[1, k] + 0.5 * change)
        motion[1, k] += change
    for e in range(s.names.size):
        f[REST, e] = 0.0 if abs(f[WAY, e]) == 1.0 else 1.0
    return lost


@njit(error_model="numpy", **NJIT_INTERNAL)
def reactions(motion, modal_system, drive, accel, scratch, s):
    """Forces that leave the faces at rest, row WAY of s.field, no acceleration at an instant, into row FOUND in the
    order of s.names; how many they are, 0 where none are found.

    accel (n,): modal accelerations [m/s2] of all other forces; drive [m/s2]; scratch (2, n): room.
    """
    accelerations(
        motion,
        modal_system.omega,
        modal_system.damp,
        modal_system.damping,
        modal_system.base,
        drive,
        accel,
        scratch,
    )
    count = resting(s)
    for i in range(count):
        s.field[RIGHT, i] = 0.0
        for k in range(accel.size):
            s.field[RIGHT, i] += s.rows[s.names[i], k] * scratch[0, k]
    return count if count and shared(TUG, count, s) else 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stays(s):
    """Whether all faces rest at the start of the step, and mean forces below their static friction hold them, row MEAN;
    ways, slides and speeds stand in s.field then."""
    f = s.field
    faces = s.names.size
    for e in range(faces):
        if f[REST, e] == 0.0 and f[START, e] != 0.0:
            return False
        s.names[e] = e
        f[RIGHT, e] = f[FREE, e]
    if not shared(BETA, faces, s):
        return False
    for e in range(faces):
        if abs(f[FOUND, e]) > min(s.limit[STATIC, e], s.limit[STATIC + END, e]):
            return False
        f[MEAN, e] = f[FOUND, e]
        f[WAY, e] = 0.0
        f[SLIDES, e] = 0.0
        f[SLIDE, e] = 0.0
        f[SPEED, e] = 0.0
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stays_to_the_end(motion, modal_system, drive, accel, scratch, s):
    """Whether static friction holds all faces at the end of a step through which they rest: a line of the holding
    forces would pass above a crest of them.

    motion (2, n): at the end of the step; it is changed; the other arguments are those of `reactions`.
    """
    faces = s.names.size
    for e in range(faces):
        s.field[RIGHT, e] = speed_of(motion, e, s)
        s.names[e] = e
    if not shared(TUG, faces, s):
        return False
    for k in range(accel.size):
        for e in range(faces):
            motion[1, k] -= s.rows[e, k] * s.field[FOUND, e] / modal_system.mass
    if reactions(motion, modal_system, drive, accel, scratch, s) < faces:
        return False
    for i in range(faces):
        if abs(s.field[FOUND, i]) > s.limit[STATIC + END, s.names[i]]:
            return False
    return True
