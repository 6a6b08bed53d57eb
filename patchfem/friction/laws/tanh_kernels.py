"""Rate law F = mu N tanh(v/v_0) (eq. 2.4), compiled.

numbers: mu N [N], 1/v_0 [s/m]. NumPy form: `tanh.TanhLaw`.
"""

from enum import IntEnum
from math import tanh

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit


class TanhNumber(IntEnum):
    """Indices of the parameters of the law; the first one is reserved for the engines."""

    LIMIT = 1
    INVERSE_SPEED = 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_force(numbers, velocity):
    """Return the friction force at a velocity.

    Returns
    -------
    force, slope : float
        Force [N] and its derivative by the velocity [N s/m].
    """
    limit = numbers[TanhNumber.LIMIT]
    inverse_speed = numbers[TanhNumber.INVERSE_SPEED]
    ratio = tanh(velocity * inverse_speed)
    return limit * ratio, limit * (1 - ratio) * (1 + ratio) * inverse_speed
