"""Compiled mean of the contact forces along a straight increment of the holder's motion, from set to set."""

import numpy as np

from ..compiled.jit import njit
from .polygon_kernels import NJIT_NO_REFCOUNT, way_out, within
from .press_kernels import LEAST, holds, locate, pull


@njit(error_model="numpy", fastmath=LEAST, **NJIT_NO_REFCOUNT)
def reach(sets, k, d, t, dd, dt, force, gap):
    """Share [1] of the increment (dd [m], dt [rad]) from (d, t) at which the first node of set k falls to its bound.

    force [N], gap [m]: the bounds of touching and of open nodes, <= 0, as `press_kernels.holds` gives them.
    """
    r0, r1, r2, on = sets.rows[k, 0], sets.rows[k, 1], sets.rows[k, 2], sets.on[k]
    out = np.inf
    for i in range(on.size):
        rate = r1[i] * dd + r2[i] * dt
        here = r0[i] + r1[i] * d + r2[i] * t - (force if on[i] else gap)
        if rate < 0:
            out = min(out, max(here, 0.0) / -rate)
    return out


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def across(sets, k, side, d, t):
    """Slot of the contact set beyond a side of set k at (d [m], t [rad]), -1 where none was found; side -1: any side.

    The set found is noted beside the side, so that the next crossing costs no search.
    """
    if side >= 0:
        following = sets.beside[k, side]
        name = sets.names[k] ^ sets.node[sets.edge[k, side]]
        if following >= 0 and sets.names[following] == name and within(sets, following, d, t):
            return following
        following = locate(sets, k, d, t)
        if following >= 0 and sets.names[following] == name and following != k:
            sets.beside[k, side] = following
        return following
    return locate(sets, k, d, t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def path_mean(sets, k, h, turn, dh, dt, out):
    """Mean slopes of the energy of the preloaded contact along a straight increment (dh, dt) of heave and turn from set
    k on.

    Returns the slot at the end, -1 where none was found. out (9,): mean slopes (2,), energy and slopes (2,) at the end,
    derivatives of the mean by (dh, dt) (2, 2). The mean times the increment is the difference of the energies (a
    discrete gradient), and it is itself the gradient of a convex function.
    """
    out[:] = 0.0
    # share by which the next set is looked up beyond a border, above its round-off
    at, small = (
        0.0,
        1e-10,
    )
    for _ in range(20 * sets.x.size + 100):  # guard against a path that goes round in circles
        end, side = 1.0, -1
        if not within(sets, k, -(h + dh), turn + dt):
            d, t = -(h + at * dh), turn + at * dt
            share, side = way_out(sets, k, d, t, -(1 - at) * dh, (1 - at) * dt)
            end = min(at + max(share, 0.0) * (1 - at), 1.0)
            if side < 0:
                good, force, gap = holds(sets, k, -(h + dh), turn + dt)
                if not good:
                    _, f, g = holds(sets, k, d, t)
                    share = reach(sets, k, d, t, -dh, dt, min(force, f), min(gap, g))
                    end = min(at + max(share, 0.0), 1.0)
        _, a1, a2 = pull(sets, k, h + at * dh, turn + at * dt)
        energy, b1, b2 = pull(sets, k, h + end * dh, turn + end * dt)
        q, part, bend = sets.energy[k], 0.5 * (end - at), 0.5 * (end * end - at * at)
        out[0] += part * (a1 + b1)
        out[1] += part * (a2 + b2)
        out[5] += bend * q[3]
        out[6] -= bend * q[4]
        out[8] += bend * q[5]
        at = end
        if at >= 1.0:
            out[2], out[3], out[4], out[7] = energy, b1, b2, out[6]
            return k
        beyond = min(at + small, 1.0)
        following = across(sets, k, side, -(h + beyond * dh), turn + beyond * dt)
        if following < 0:
            return following
        small = 10 * small if following == k else 1e-10  # the same set again: step farther
        if following == k:
            at = beyond
        k = following
    return -1
