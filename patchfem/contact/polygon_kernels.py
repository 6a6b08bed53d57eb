"""Compiled polygons of the contact sets: a set holds where none of its few sides is passed.

Every node of a set bounds by a line the motions (d, t) at which the set holds. Few of these lines are sides of the
polygon that they enclose. `sets` is a `press_kernels.SetArrays`.
"""

import numpy as np
from numba.core.options import DefaultOptions

from ..compiled.jit import njit

NJIT_NO_REFCOUNT = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
NOISE = 1e-13  # of the largest term: what counts as nothing
# most sides of a polygon; half its largest width, in the closing of the reference state
SIDES, BOX = (
    16,
    100.0,
)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def units(sets):
    """Scales of the polygons: of a closing [m], as of the reference state, and of a turn [rad], that over the arm."""
    arm = max(abs(sets.x[0]), abs(sets.x[-1]))
    return sets.base[3], sets.base[3] / arm if arm > 0 else 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def outline(sets, slot):
    """Work out the polygon of the set in a slot: a box, cut by the line of every node (Sutherland, Hodgman 1974).

    The nodes at the ends of the contact cut first, because they leave little to the others. A set of too many sides
    gets none.
    """
    unit_d, unit_t = units(sets)
    r0, r1, r2, on = sets.rows[slot, 0], sets.rows[slot, 1], sets.rows[slot, 2], sets.on[slot]
    top = 0.0
    for i in range(on.size):
        if on[i]:
            top = max(top, abs(r0[i]) + abs(r1[i]) * unit_d + abs(r2[i]) * unit_t)
    sets.limit[slot, 0], sets.limit[slot, 1] = -4 * NOISE * top, -4 * NOISE * unit_d
    old, new = sets.corner[0], sets.corner[1]
    count = 4
    for k in range(4):  # corner k: place, and the node whose line leads on to the next corner
        old[0, k], old[1, k], old[2, k] = (
            BOX * (-1 if k in (0, 3) else 1),
            BOX * (-1 if k < 2 else 1),
            -1.0,
        )
    sets.sides[slot] = 0
    for turn in range(2 * on.size):
        i = turn % on.size
        edge = i == 0 or i == on.size - 1 or on[i] != on[i - 1] or on[i] != on[i + 1]
        if edge != (turn < on.size):
            continue
        c0 = r0[i] - (sets.limit[slot, 0] if on[i] else sets.limit[slot, 1])
        c1, c2 = r1[i] * unit_d, r2[i] * unit_t
        least = np.inf
        for k in range(count):
            least = min(least, c0 + c1 * old[0, k] + c2 * old[1, k])
        if least >= 0:
            continue
        many = 0
        for k in range(count):
            follower = k + 1 if k + 1 < count else 0
            a = c0 + c1 * old[0, k] + c2 * old[1, k]
            b = c0 + c1 * old[0, follower] + c2 * old[1, follower]
            if many + 2 > new.shape[1]:
                return
            if a >= 0:
                new[0, many], new[1, many], new[2, many] = old[0, k], old[1, k], old[2, k]
                many += 1
            if (a >= 0) != (b >= 0):
                part = a / (a - b)
                new[0, many] = old[0, k] + part * (old[0, follower] - old[0, k])
                new[1, many] = old[1, k] + part * (old[1, follower] - old[1, k])
                new[2, many] = i if a >= 0 else old[2, k]
                many += 1
        old, new, count = new, old, many
        if count == 0:
            return
    sides = 0
    for k in range(count):
        if old[2, k] >= 0:
            if sides == SIDES:
                return
            sets.edge[slot, sides], sets.beside[slot, sides] = int(old[2, k]), -1
            sides += 1
    sets.sides[slot] = sides


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def boxed(sets, d, t):
    """Whether a motion (d [m], t [rad]) lies in the box in which polygons are drawn, BOX units to each side."""
    unit_d, unit_t = units(sets)
    return abs(d) <= BOX * unit_d and abs(t) <= BOX * unit_t


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def margin(sets, k, side, d, t):
    """How far the node of a side of set k is from failing: force [N] where it touches, else gap [m].

    d [m], t [rad]: the motion at which it is asked.
    """
    i = sets.edge[k, side]
    least = sets.limit[k, 0] if sets.on[k, i] else sets.limit[k, 1]
    return sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t - least


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def within(sets, k, d, t):
    """Whether the polygon of set k says that the set holds at (d [m], t [rad]); False also where it has no polygon.

    Cost: a few multiplications per side, instead of one pass over the nodes.
    """
    if sets.sides[k] == 0 or not boxed(sets, d, t):
        return False
    for side in range(sets.sides[k]):
        if margin(sets, k, side, d, t) < 0:
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def way_out(sets, k, d, t, dd, dt):
    """Share [1] of the increment (dd [m], dt [rad]) from (d, t) after which set k ends, and the side where it does.

    Where no polygon can say, the share is inf and the side -1.
    """
    out, found = np.inf, -1
    if sets.sides[k] == 0 or not (boxed(sets, d, t) and boxed(sets, d + dd, t + dt)):
        return out, found
    for side in range(sets.sides[k]):
        here = margin(sets, k, side, d, t)
        rate = margin(sets, k, side, d + dd, t + dt) - here
        if rate < 0 and max(here, 0.0) < -rate * out:
            out, found = max(here, 0.0) / -rate, side
    return out, found
