"""Compiled polygons of contact sets: the motions (d, t) of the holder at which a set holds.

Each node of a set limits these motions to one side of a line. The lines enclose a convex polygon, of which only a few
are sides, so comparing a motion with the sides is faster than checking all nodes. `sets` is a
`press_kernels.SetArrays`.
"""

import numpy as np
from numba.core.options import DefaultOptions

from ..compiled.jit import njit

NJIT_NO_REFCOUNT = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
ROUND_OFF = 1e-13  # rounding error of a force or gap over the largest of its terms
MAX_SIDES = 16  # sides of a polygon; sets with more are checked node by node
# half width of the box in which polygons are computed, over the openings of the reference state
BOX_HALF_WIDTH = 100.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def polygon_units(sets):
    """Return the units of d [m] and of t [rad] in which polygons are computed.

    They are the size of the openings of the reference state, and this size over the largest |x|.
    """
    arm = max(abs(sets.x[0]), abs(sets.x[-1]))
    return sets.base[3], sets.base[3] / arm if arm > 0 else 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def write_polygon(sets, slot):
    """Compute the polygon of motions at which the contact set in a storage slot holds.

    It is a box of motions, clipped by one line for each node: that of the motions at which the node would enter or
    leave the contact. Clipping is that of Sutherland and Hodgman (Comm. ACM 17, 32, 1974). Nodes at the ends of the
    contact come first, because they cut off most. A set with too many sides gets no polygon.
    """
    unit_d, unit_t = polygon_units(sets)
    r0, r1, r2, on = sets.rows[slot, 0], sets.rows[slot, 1], sets.rows[slot, 2], sets.on[slot]
    top = 0.0
    for i in range(on.size):
        if on[i]:
            top = max(top, abs(r0[i]) + abs(r1[i]) * unit_d + abs(r2[i]) * unit_t)
    sets.limit[slot, 0], sets.limit[slot, 1] = -4 * ROUND_OFF * top, -4 * ROUND_OFF * unit_d
    old, new = sets.corner[0], sets.corner[1]
    count = 4
    # a corner has two coordinates and the node whose line leads to the next corner, -1 for the box
    for k in range(4):
        old[0, k], old[1, k], old[2, k] = (
            BOX_HALF_WIDTH * (-1 if k in (0, 3) else 1),
            BOX_HALF_WIDTH * (-1 if k < 2 else 1),
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
            if sides == MAX_SIDES:
                return
            sets.edge[slot, sides], sets.beside[slot, sides] = int(old[2, k]), -1
            sides += 1
    sets.sides[slot] = sides


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def is_in_box(sets, d, t):
    """Return whether a motion (d [m], t [rad]) lies in the box in which polygons are computed."""
    unit_d, unit_t = polygon_units(sets)
    return abs(d) <= BOX_HALF_WIDTH * unit_d and abs(t) <= BOX_HALF_WIDTH * unit_t


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def side_margin(sets, k, side, d, t):
    """Return how far the force [N] or gap [m] of the node of a side is above its limit.

    k: slot of the set; d [m], t [rad]: motion of the holder.
    """
    i = sets.edge[k, side]
    least = sets.limit[k, 0] if sets.on[k, i] else sets.limit[k, 1]
    return sets.rows[k, 0, i] + sets.rows[k, 1, i] * d + sets.rows[k, 2, i] * t - least


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def is_inside(sets, k, d, t):
    """Return whether a motion (d [m], t [rad]) lies in the polygon of set k.

    A set without polygon contains no motion.

    Cost: a few multiplications per side, instead of one pass over the nodes.
    """
    if sets.sides[k] == 0 or not is_in_box(sets, d, t):
        return False
    for side in range(sets.sides[k]):
        if side_margin(sets, k, side, d, t) < 0:
            return False
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_exit(sets, k, d, t, dd, dt):
    """Return the fraction of an increment of motion at which it leaves set k, and the side.

    The increment (dd, dt) begins at (d, t). d, dd [m]; t, dt [rad]. The fraction is inf and the side -1 if the
    increment stays inside or the set has no polygon.
    """
    out, found = np.inf, -1
    if sets.sides[k] == 0 or not (is_in_box(sets, d, t) and is_in_box(sets, d + dd, t + dt)):
        return out, found
    for side in range(sets.sides[k]):
        here = side_margin(sets, k, side, d, t)
        rate = side_margin(sets, k, side, d + dd, t + dt) - here
        if rate < 0 and max(here, 0.0) < -rate * out:
            out, found = max(here, 0.0) / -rate, side
    return out, found
