"""An exponential without a branch, so that loops over cases vectorise. Compare `math.exp`."""

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT

MAX_EXP_ARGUMENT = 36.0  # argument y from which 1 - exp(-y) rounds to 1


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def exp_minus(y):
    """Approximate exp(-y) within 2e-13 for y >= -1.

    It is the 16th power of twelve terms of the Taylor series of exp(-y/16). The terms are added in pairs, so that few
    operations wait for each other.
    """
    w = min(max(y, -1.0), MAX_EXP_ARGUMENT) * (-1.0 / 16)
    w2 = w * w
    w4 = w2 * w2
    low = (1 + w) + w2 * (1 / 2 + w / 6) + w4 * ((1 / 24 + w / 120) + w2 * (1 / 720 + w / 5040))
    power = low + w4 * w4 * ((1 / 40320 + w / 362880) + w2 * (1 / 3628800 + w / 39916800))
    for _ in range(4):
        power = power * power
    return power
