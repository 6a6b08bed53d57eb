"""An exponential that a compiler can take for several cases at once. Twin: `math.exp`."""

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

MOST = 36.0  # argument from which 1 - exp(-y) is 1 to the last bit


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def decay(y):
    """exp(-y) to 2e-13 for y from -1 on, beyond MOST its value there, by the 16th power of twelve terms of its series
    in pairs, so that few wait for each other."""
    w = min(max(y, -1.0), MOST) * (-1.0 / 16)
    w2 = w * w
    w4 = w2 * w2
    low = (1 + w) + w2 * (1 / 2 + w / 6) + w4 * ((1 / 24 + w / 120) + w2 * (1 / 720 + w / 5040))
    e = low + w4 * w4 * ((1 / 40320 + w / 362880) + w2 * (1 / 3628800 + w / 39916800))
    e = e * e
    e = e * e
    e = e * e
    return e * e
