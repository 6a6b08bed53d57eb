"""First-loading curve of Segalman's Iwan model, in closed form.

With the force divided by the stiffness and YIELD_LENGTH, the slide w in multiples of YIELD_LENGTH, and
the numbers chi and q of the law,

    g(w) = w (1 - q w^(chi + 1)/(chi + 2)) up to w = 1.

A reference is the engine `dynamics.events` with many elements.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_NO_REFCOUNT
from .rows_kernels import LANES, RowStart

FRACTION = 1  # index of q in the parameters of the law; the first parameter is chi + 1
# Maximum step in multiples of YIELD_LENGTH; no step is too long, because the curve bends little.
MAX_STEP = 1e300
LOOKS_AHEAD = False  # whether `prepare_lookup` has an effect
# Codes for where the curve data are stored; they are equal, because a closed form needs no
# data (see `table_curve_kernels`).
IN_TABLE = 0
PREPARED = 0
AT_START = 0
# 1.5 * 2^52; if this number is added, the last bits of the sum are the nearest integer.
ROUNDING_CONSTANT = 6755399441055744.0


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def power(w, a):
    """Return the power w^a to a relative accuracy of 3e-13.

    It holds for masing_kernels.MIN_ABSCISSA <= w <= 2 and 0 < a <= 1.

    It uses the bits of a number, without a branch or a call, so that a compiler takes several lanes at once: the series of
    the logarithm of the mantissa, then that of the power of two. It is compiled without fast-math, because the rounding
    to a whole number relies on the order of the additions.
    """
    bits = np.float64(w).view(np.int64)
    mantissa = np.int64((bits & 0xFFFFFFFFFFFFF) | 0x3FF0000000000000).view(np.float64)
    is_large = 1.0 if mantissa > 1.4142135623730951 else 0.0
    mantissa = mantissa * (1 - 0.5 * is_large)
    t = (mantissa - 1) / (mantissa + 1)
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
    y = a * (((bits >> 52) - 1023) + is_large + log)
    whole = y + ROUNDING_CONSTANT
    g = 0.6931471805599453 * (y - (whole - ROUNDING_CONSTANT))
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


@njit(**NJIT_INLINE)
def force_and_slope(w, workspace, lane, when):
    """Return force and slope of the first-loading curve at an abscissa w > 0.

    Parameters
    ----------
    w : float
        Abscissa, above 0.
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int
        See `masing_kernels.irreversible_slide`.

    Returns
    -------
    float
        Force.
    float
        Slope.
    """
    exponent = workspace[RowStart.LAW_NUMBERS + lane]
    p = workspace[RowStart.LAW_NUMBERS + FRACTION * LANES + lane] * power(w, exponent)
    return w * (1 - p / (exponent + 1)), 1 - p


@njit(**NJIT_INLINE)
def mean_slip(w, force, workspace, lane, when):
    """Return the mean slip of the sliders, weighted by friction, in scaled form.

    It is the slip at w divided by the stiffness and YIELD_LENGTH.

    Parameters
    ----------
    w, force : float
        Place on the curve, and the force there.
    workspace, lane
        See `rigid_kernels.friction_force`.
    when : int

    Returns
    -------
    float
    """
    exponent = workspace[RowStart.LAW_NUMBERS + lane]
    return exponent / (exponent + 2) * w * (w - force)


@njit(**NJIT_INLINE)
def loading_work(w, force, workspace, lane):
    """Return the integral of the first-loading force up to an abscissa.

    Parameters
    ----------
    w, force, workspace, lane
        See `mean_slip`.

    Returns
    -------
    float
    """
    return w * (w / 2 - (w - force) / (workspace[RowStart.LAW_NUMBERS + lane] + 2))


@njit(**NJIT_INLINE)
def prepare_lookup(workspace, lane):
    """Do nothing, because a power is evaluated without a table."""


@njit(**NJIT_INLINE)
def finish_step(workspace, lane, event):
    """Do nothing, because a power is evaluated without a table.

    Parameters
    ----------
    workspace, lane
        See `rigid_kernels.friction_force`.
    event : bool
        Whether the step has an event.
    """


@njit(**NJIT_INLINE)
def start_lookup(w, workspace, lane):
    """Do nothing, because a power is evaluated without a table.

    Parameters
    ----------
    w : float
        Abscissa at the start of the step.
    workspace, lane
        See `rigid_kernels.friction_force`.
    """
