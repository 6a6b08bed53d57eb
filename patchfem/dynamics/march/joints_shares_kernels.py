"""Which set-valued faces rest, slide or carry at an instant inside a step, and the forces that they need for it.

The faces feel each other through the modes: those that rest share what the others and the modes ask of them, those that
slide bring their kinetic friction. Dependent faces share by least squares; one that this share would overload while the
others hold it carries its static friction. Read `joints_stops_kernels` first, which follows them through the step.
"""

import numpy as np

from ...compiled.inner import njit
from ...friction.flags_kernels import LEAN
from ..dense_kernels import factor, solve

HOLDS = 0  # of num: the law that holds without a stretch
TRACE = 1e-10  # of the diagonal: give of dependent faces, which leaves their share free
TIED = 1e-7  # of the diagonal: what is left of a face's own give where others hold it
BETA, GAMMA, TUG = range(3)  # of `gives`
STATIC, KINETIC = range(2)  # of `limit`
# rows of `field`: free slide and speed, speed at the start, whether it rests there; holding force at both ends; slide
# and speed so far, mean force; force now and its slope; way (0 rest, +-1 slides, +-2 carries), whether it slides all
# the way; right side, solution, residual; slide of the step, blow
(FREE, RATE, START, REST, FIRST, LAST, SLIDE, SPEED, MEAN, FORCE, SLOPE, WAY, SLIDES, RIGHT, FOUND, MISS, DQ,
 BLOW) = range(18)


@njit(error_model="numpy", **LEAN)
def shared(which, count, s):
    """Put the solution x of A x = b into row FOUND of s.field, b in row RIGHT, A = s.gives[which] of the faces
    s.names[:count].

    b and x are in the order of the names. Of dependent faces it is the smallest x. False where A has no positive
    diagonal.
    """
    a, b, x, r, names = s.system[:count, :count], s.field[RIGHT], s.field[FOUND], s.field[MISS], s.names
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


@njit(error_model="numpy", **LEAN)
def resting(s):
    """Numbers of the faces that rest into s.names; how many."""
    count = 0
    for e in range(s.names.size):
        if s.field[WAY, e] == 0.0:
            s.names[count] = e
            count += 1
    return count


@njit(error_model="numpy", **LEAN)
def forces_at(x, s):
    """Forces of all faces at the place x of the step and their slopes, into s.field; False where there are none."""
    f, count = s.field, resting(s)
    for e in range(s.names.size):
        f[FORCE, e] = np.sign(f[WAY, e]) * s.limit[STATIC if abs(f[WAY, e]) == 2.0 else KINETIC, e]
        f[SLOPE, e] = 0.0
    for part in range(2):
        for i in range(count):
            f[RIGHT, i] = 0.0
            for e in range(s.names.size):
                if f[WAY, e] != 0.0:
                    h = f[LAST, e] - f[FIRST, e]
                    h = f[FIRST, e] + h * x - f[FORCE, e] if part == 0 else h
                    f[RIGHT, i] += s.gives[TUG, s.names[i], e] * h
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


@njit(error_model="numpy", **LEAN)
def let_go(e, way, s):
    """Let face e slide along way, or carry its static friction where the others that rest hold it."""
    f = s.field
    f[WAY, e], f[SLIDES, e] = way, 0.0  # no more among those that rest
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


@njit(error_model="numpy", **LEAN)
def settled(x, s):
    """Which faces rest, slide or carry at the place x, and their forces; False where no choice is found."""
    f = s.field
    for e in range(s.names.size):
        if abs(f[WAY, e]) == 2.0:
            f[WAY, e] = 0.0
    for _ in range(2 * s.names.size + 2):
        if not forces_at(x, s):
            return False
        worst, who = 1e-9, -1
        for e in range(s.names.size):
            over = abs(f[FORCE, e]) / max(s.limit[STATIC, e], 1e-300) - 1
            if f[WAY, e] == 0.0 and over > worst:
                worst, who = over, e
        if who < 0:
            return True
        let_go(who, 1.0 if f[FORCE, who] > 0 else -1.0, s)
    return False
