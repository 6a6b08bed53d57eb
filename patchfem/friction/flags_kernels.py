"""Flags of compiled code, and the part of a law that most laws do not have.

Fast-math is limited to what keeps NaN and infinity meaningful.
"""

from math import inf

from numba.core.options import DefaultOptions

from ..compiled.inner import njit

# no counting of references in functions that allocate nothing: 1.3 of the 1.6 us of a step of a march
LEAN = {"_nrt": False} if hasattr(DefaultOptions, "_nrt") else {}
# of functions that compiled code alone calls: their wrappers for Python take most of the time of compiling them
INNER = LEAN | {flag: True for flag in ("no_cpython_wrapper", "no_cfunc_wrapper") if hasattr(DefaultOptions, flag)}
FAST = {"reassoc", "contract", "arcp"}
SET_VALUED = False  # whether a law holds without a stretch


@njit(error_model="numpy", **LEAN)
def middle(num, mem, e, v, dt):
    """The `middle` of laws whose bonds do not grow: 0, as no such law asks for a bond length [m]."""
    return 0.0


@njit(error_model="numpy", **LEAN)
def closed(num, mem, e, free, beta):
    """The `closed` of laws whose step has no closed form: (0 [m], 0 [N], False)."""
    return 0.0, 0.0, False


@njit(error_model="numpy", **LEAN)
def knee(num):
    """The `knee` of laws whose rates have no kink at a speed: 0 [m/s]."""
    return 0.0


@njit(error_model="numpy", **LEAN)
def gives(num, turn):
    """The `gives` of laws that hold nothing without a stretch: they slide."""
    return 1.0


@njit(error_model="numpy", **LEAN)
def longest(num, turn):
    """The `longest` of laws whose rates tell the error of a step: no bound [s]."""
    return inf
