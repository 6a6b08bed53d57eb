"""Exponential, logarithm and power for the compiled sums over bonds.

`fast_exp` and `fast_log` have no branches: a loop that calls them takes 0.5 ns per exponential and
1 ns per power.
"""

import numpy as np

from ...kernel_cache.flags_kernels import NJIT_NO_REFCOUNT
from ...kernel_cache.jit import njit


@njit(error_model="numpy", fastmath={"contract"}, **NJIT_NO_REFCOUNT)
def fast_exp(x):
    """Return exp(x) to 2.3e-16 relative for x in [-708, 709] (Cody-Waite and Taylor).

    Below this range it is exp(-708).
    """
    # exp(x) = 2^n exp(r) with |r| <= ln(2)/2; ln 2 is subtracted in two parts, so that r keeps its digits
    x = min(max(x, -708.0), 709.0)
    n = np.floor(x * 1.4426950408889634 + 0.5)
    r = (x - n * 0.693145751953125) - n * 1.4286068203094172e-6

    # Taylor series of exp(r), by Horner's rule
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

    # 2^n is the number whose exponent bits are n + 1023
    return p * np.int64((np.int64(n) + 1023) << np.int64(52)).view(np.float64)


@njit(error_model="numpy", fastmath={"contract"}, **NJIT_NO_REFCOUNT)
def fast_log(x):
    """Return the natural logarithm of a normal number x > 0 to 2.3e-16; -709.09 at zero."""
    # x = 2^e m with m in [sqrt(1/2), sqrt 2), from the bits of x
    bits = np.float64(x).view(np.int64)
    e = (bits - np.int64(0x3FE6A09E667F3BCD)) >> np.int64(52)
    m = np.int64(bits - (e << np.int64(52))).view(np.float64)

    # ln m = 2 artanh(s) = 2 s (1 + s^2/3 + s^4/5 + ...)
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


@njit(error_model="numpy", fastmath={"contract"}, forceinline=True, **NJIT_NO_REFCOUNT)
def whole_power(x, p):
    """Return x^p for p = 0, 1 or 2 without a branch."""
    first = min(p, 1.0)
    second = max(p - 1.0, 0.0)
    return (1.0 - first + first * x) * (1.0 - second + second * x)


@njit(error_model="numpy", fastmath={"contract"}, forceinline=True, **NJIT_NO_REFCOUNT)
def power(x, p):
    """Return x^p of x >= 0; fast for the orders 0, 1 and 2."""
    if p == 0.0 or p == 1.0 or p == 2.0:
        return whole_power(x, p)
    return fast_exp(p * fast_log(x))
