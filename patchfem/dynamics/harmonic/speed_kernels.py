"""A compiled law without memory along the samples of a cycle; the text runs with any law of the speed."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import tanh_kernels as law


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def along(num, speed, force, slope):
    """Force [N] and slope [N s/m] at speeds (N,) [m/s] of the law with the numbers num (1, k)."""
    for i in range(speed.size):
        force[i], slope[i] = law.mean_force(num[0], num[0], 0.0, speed[i], 0.0, 1.0)
