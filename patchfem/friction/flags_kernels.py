"""Flags of compiled code, and the part of a law that most laws do not have.

Fast-math is limited to what keeps NaN and infinity meaningful.
"""

from math import inf

from ..compiled.jit import NJIT_INTERNAL, NJIT_NO_REFCOUNT, njit

FASTMATH_FLAGS = {"reassoc", "contract", "arcp"}
SET_VALUED = False  # whether a law holds without a stretch
# of a law in lanes: whether its slope has a kink at no stretch; whether its stretch follows the slide alone, `after`;
# whether its force changes within a layer of the speed, `layer`
BENDS = FOLLOWS = LAYERS = False


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def middle(num, mem, e, v, dt):
    """The `middle` of laws whose bonds do not grow: 0, as no such law asks for a bond length [m]."""
    return 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def closed(num, mem, e, free, beta):
    """The `closed` of laws whose step has no closed form: (0 [m], 0 [N], False)."""
    return 0.0, 0.0, False


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def knee(num):
    """The `knee` of laws whose rates have no kink at a speed: 0 [m/s]."""
    return 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def gives(num, turn):
    """The `gives` of laws that hold nothing without a stretch: they slide."""
    return 1.0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def after(k, z, square, dx, way):
    """The `after` of laws whose rate alone is known: nothing."""
    return z, square, 0.0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def layer(k, h):
    """The `layer` of laws whose force changes with no speed: none."""
    return 0.0, 0.0, inf


__all__ = [
    "BENDS",
    "FASTMATH_FLAGS",
    "FOLLOWS",
    "LAYERS",
    "NJIT_INTERNAL",
    "NJIT_NO_REFCOUNT",
    "SET_VALUED",
    "after",
    "closed",
    "gives",
    "knee",
    "layer",
    "middle",
]
