"""The force of a first loading of Segalman's Iwan law, without cells, over the stiffness and the slide LENGTH at which
all slip:

    g(w) = w (1 - q w^(chi + 1)/(chi + 2)), w up to 1

Twin: many elements, from event to event (`dynamics.events`).
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .names_kernels import FIRST_OF_LAW, LANES

EXPONENT, SHARE = range(FIRST_OF_LAW, FIRST_OF_LAW + 2)  # numbers: chi + 1, q
ROOM = 0  # numbers that it has in the state of a case
PART = 1e300  # of LENGTH, over which a step may go: it bends so little that the end of it is found
FORETELLS = False  # its places need not be found
ASKED = FOUND = HERE = 0  # as of `table_curve_kernels`


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def power(w, a):
    """w^a to 3e-13 for LEAST <= w <= 2 and 0 < a <= 1, by the bits of a number: no branch and no call, so that a
    compiler takes several lanes at once; no fast-math, as its roundings are meant."""
    bits = np.float64(w).view(np.int64)
    part = np.int64((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000).view(np.float64)
    more = 1.0 if part > 1.4142135623730951 else 0.0
    part = part * (1 - 0.5 * more)
    t = (part - 1) / (part + 1)
    z = t * t
    log = (
        2.8853900817779268
        * t
        * (
            1
            + z
            * (
                1 / 3
                + z
                * (
                    1 / 5
                    + z
                    * (1 / 7 + z * (1 / 9 + z * (1 / 11 + z * (1 / 13 + z * (1 / 15 + z / 17)))))
                )
            )
        )
    )
    y = a * (((bits >> 52) - 1023) + more + log)
    whole = y + 6755399441055744.0  # 1.5 of 2^52: its last bits are the whole number next to y
    g = 0.6931471805599453 * (y - (whole - 6755399441055744.0))
    e = 1 + g * (
        1
        + g
        * (
            1 / 2
            + g
            * (
                1 / 6
                + g
                * (
                    1 / 24
                    + g
                    * (
                        1 / 120
                        + g
                        * (
                            1 / 720
                            + g * (1 / 5040 + g * (1 / 40320 + g * (1 / 362880 + g / 3628800)))
                        )
                    )
                )
            )
        )
    )
    return np.int64(np.float64(e).view(np.int64) + (np.float64(whole).view(np.int64) << 52)).view(
        np.float64
    )


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def force(w, workspace, i, when):
    """(g, its slope) at w > 0."""
    e, p = (
        workspace[EXPONENT * LANES + i],
        workspace[SHARE * LANES + i] * power(w, workspace[EXPONENT * LANES + i]),
    )
    return w * (1 - p / (e + 1)), 1 - p


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def slipped(w, g, workspace, i, when):
    """Mean slip of the sliders, each by what it carries at most, times that of all, where their force is g."""
    e = workspace[EXPONENT * LANES + i]
    return e / (e + 2) * w * (w - g)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def work(w, g, workspace, i):
    """Integral of the force up to w, where it is g."""
    return w * (w / 2 - (w - g) / (workspace[EXPONENT * LANES + i] + 2))


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find(workspace, i):
    """Find nothing."""


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def go_on(workspace, i, event):
    """Keep nothing."""


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def begin_at(w, workspace, i):
    """Keep nothing."""
