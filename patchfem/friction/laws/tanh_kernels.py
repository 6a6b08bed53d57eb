"""Rate law F = mu N tanh(v/v_0) (eq. 2.4), compiled.

numbers: mu N [N], 1/v_0 [s/m]. NumPy form: `tanh.TanhLaw`.
"""

from math import tanh

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_force(numbers, velocity):
    """Return the friction force at a velocity.

    Returns
    -------
    force, slope : float
        Force [N] and its derivative by the velocity [N s/m].
    """
    ratio = tanh(velocity * numbers[2])
    return numbers[1] * ratio, numbers[1] * (1 - ratio) * (1 + ratio) * numbers[2]
