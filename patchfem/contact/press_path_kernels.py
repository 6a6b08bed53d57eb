"""Compiled mean of the contact forces along a straight increment of the holder's motion."""

import numpy as np

from ..compiled.jit import njit
from .polygon_kernels import NJIT_NO_REFCOUNT, find_exit, is_inside
from .press_kernels import FASTMATH_MINIMUM, check_set, compute_energy, find_set


@njit(error_model="numpy", fastmath=FASTMATH_MINIMUM, **NJIT_NO_REFCOUNT)
def find_first_failure(sets, k, d, t, dd, dt, force, gap):
    """Return the fraction of an increment of motion at which a node of set k fails first.

    The increment (dd [m], dt [rad]) begins at (d, t).

    force [N], gap [m]: bounds of nodes in contact and of open nodes, from `press_kernels.check_set`.
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
def cross_side(sets, k, side, d, t):
    """Return the slot of the contact set beyond a side of set k; -1 if none is found.

    d [m], t [rad]: motion just beyond the side. side: -1 if the side is not known. The set is stored with the side, so
    the next crossing needs no search.
    """
    if side >= 0:
        following = sets.beside[k, side]
        name = sets.names[k] ^ sets.node[sets.edge[k, side]]
        if following >= 0 and sets.names[following] == name and is_inside(sets, following, d, t):
            return following
        following = find_set(sets, k, d, t)
        if following >= 0 and sets.names[following] == name and following != k:
            sets.beside[k, side] = following
        return following
    return find_set(sets, k, d, t)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def path_mean(sets, k, h, turn, dh, dt, out):
    """Average the slopes of the energy of the preloaded contact along an increment of motion.

    The mean times the increment is the difference of the energies (a discrete gradient), and the mean is
    itself the gradient of a convex function.

    Parameters
    ----------
    sets : press_kernels.SetArrays
    k : int
        Slot of the set at the beginning.
    h, turn, dh, dt : float
        Heave [m] and rotation [rad] at the beginning, and their increments.
    out : (9,) ndarray
        Written: mean slopes (2,), energy, slopes at the end (2,), derivatives of the mean by (dh, dt) (2, 2).

    Returns
    -------
    int
        Slot of the set at the end, -1 if none is found.
    """
    out[:] = 0.0
    at = 0.0
    # fraction of the increment beyond a border at which the next set is determined; it is larger
    # than rounding errors
    small = 1e-10
    # the number of sets is limited, because rounding errors may make a path return to the same sets
    for _ in range(20 * sets.x.size + 100):
        end, side = 1.0, -1
        if not is_inside(sets, k, -(h + dh), turn + dt):
            d, t = -(h + at * dh), turn + at * dt
            share, side = find_exit(sets, k, d, t, -(1 - at) * dh, (1 - at) * dt)
            end = min(at + max(share, 0.0) * (1 - at), 1.0)
            if side < 0:
                good, force, gap = check_set(sets, k, -(h + dh), turn + dt)
                if not good:
                    _, f, g = check_set(sets, k, d, t)
                    share = find_first_failure(sets, k, d, t, -dh, dt, min(force, f), min(gap, g))
                    end = min(at + max(share, 0.0), 1.0)
        _, a1, a2 = compute_energy(sets, k, h + at * dh, turn + at * dt)
        energy, b1, b2 = compute_energy(sets, k, h + end * dh, turn + end * dt)
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
        following = cross_side(sets, k, side, -(h + beyond * dh), turn + beyond * dt)
        if following < 0:
            return following
        # a search that returns the same set is repeated farther on
        small = 10 * small if following == k else 1e-10
        if following == k:
            at = beyond
        k = following
    return -1
