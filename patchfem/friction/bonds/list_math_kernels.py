"""Exponential, logarithm and incomplete gamma function for the compiled sums over bonds.

`fast_exp` and `fast_log` have no branches: a loop that calls them takes 0.5 ns per exponential and
1 ns per power.
"""

from math import exp, lgamma, log

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_forms_kernels import N_TABLE_STEPS

MAX_TABLE_ARGUMENT = 1e6  # smallest argument x at which P(p + 1, x) is set to 1 for every order


@njit(error_model="numpy", fastmath={"contract"}, **NJIT_NO_REFCOUNT)
def fast_exp(x):
    """Return exp(x) to 2.3e-16 relative for x in [-708, 709] (Cody-Waite and Taylor).

    Below this range it is exp(-708).
    """
    x = min(max(x, -708.0), 709.0)
    n = np.floor(x * 1.4426950408889634 + 0.5)
    r = (x - n * 0.693145751953125) - n * 1.4286068203094172e-6
    p = 1 / 479001600.0 + r * (1 / 6227020800.0)
    p = 1 / 39916800.0 + r * p
    p = 1 / 3628800.0 + r * p
    p = 1 / 362880.0 + r * p
    p = 1 / 40320.0 + r * p
    p = 1 / 5040.0 + r * p
    p = 1 / 720.0 + r * p
    p = 1 / 120.0 + r * p
    p = 1 / 24.0 + r * p
    p = 1 / 6.0 + r * p
    p = 0.5 + r * p
    p = 1 + r * (1 + r * p)
    return p * np.int64((np.int64(n) + 1023) << np.int64(52)).view(np.float64)


@njit(error_model="numpy", fastmath={"contract"}, **NJIT_NO_REFCOUNT)
def fast_log(x):
    """Return the natural logarithm of a normal number x > 0 to 2.3e-16; -709.09 at zero."""
    bits = np.float64(x).view(np.int64)
    e = (bits - np.int64(0x3FE6A09E667F3BCD)) >> np.int64(52)
    m = np.int64(bits - (e << np.int64(52))).view(np.float64)
    s = (m - 1) / (m + 1)
    z = s * s
    p = 1 / 19.0 + z * (1 / 21.0)
    p = 1 / 17.0 + z * p
    p = 1 / 15.0 + z * p
    p = 1 / 13.0 + z * p
    p = 1 / 11.0 + z * p
    p = 1 / 9.0 + z * p
    p = 1 / 7.0 + z * p
    p = 1 / 5.0 + z * p
    p = 1 / 3.0 + z * p
    return np.float64(e) * 0.6931471805599453 + 2 * s * (1 + z * p)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def gammainc(a, x):
    """Return the regularised lower incomplete gamma function P(a, x), a > 0, to 1e-14.

    Compare `scipy.special.gammainc`.
    """
    if x <= 0:
        return 0.0
    front = exp(a * log(x) - x - lgamma(a))
    if x < a + 1:
        term = 1 / a
        total = term
        for n in range(1, 500):
            term *= x / (a + n)
            total += term
            if term < 1e-17 * total:
                break
        return front * total
    b = x + 1 - a
    c = 1e300
    d = 1 / b
    h = d
    for n in range(1, 500):
        an = -n * (n - a)
        b += 2
        d = an * d + b
        d = 1e-300 if d == 0 else d
        c = b + an / c
        c = 1e-300 if c == 0 else c
        d = 1 / d
        h *= d * c
        if abs(d * c - 1) < 1e-16:
            break
    return 1 - front * h


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def bond_gammainc(p, x):
    """Return P(p + 1, x) to 1e-15, the fraction of the limit that the last x bond lengths carry.

    It has a closed form for p = 0, 1 and 2. NumPy form: `scipy.special.gammainc(p + 1, x)`.
    """
    if x <= 0:
        return 0.0
    if p == 0.0 or p == 1.0 or p == 2.0:
        return 1 - (1 + min(p, 1.0) * x * (1 + max(p - 1, 0.0) * 0.5 * x)) * fast_exp(-x)
    return gammainc(p + 1, x)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def interpolate_gammainc(p, x, table, inverse_gamma):
    """Return P(p + 1, x) to 1e-10 by a cubic between two entries of a table; exact for x < 1.

    The slopes of the cubic are x^p exp(-x)/Gamma(p + 1). It takes 4 ns.

    Parameters
    ----------
    p, x : float
        Order and argument.
    table : (k,) array
        P(p + 1, x) at multiples of 1/32 (`list_numbers.gamma_table`).
    inverse_gamma : float
        1/Gamma(p + 1).

    Returns
    -------
    float
    """
    if x < 1 or p == 1.0 or p == 2.0 or p == 0.0:
        return bond_gammainc(p, x)
    index = int(x * N_TABLE_STEPS) if x < MAX_TABLE_ARGUMENT else table.size
    if index + 1 >= table.size:
        return 1.0
    width = 1.0 / N_TABLE_STEPS
    low = index * width
    high = (index + 1) * width
    slope_low = inverse_gamma * fast_exp(p * fast_log(low) - low) * width
    slope_high = inverse_gamma * fast_exp(p * fast_log(high) - high) * width
    start = table[index]
    change = table[index + 1] - start
    t = x * N_TABLE_STEPS - index
    cubic = slope_low + slope_high - 2 * change
    return start + t * (slope_low + t * (3 * change - 2 * slope_low - slope_high + t * cubic))
