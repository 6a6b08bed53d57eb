"""Forces of a velocity-dependent law without memory along a cycle (compiled)."""

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import tanh_kernels as law


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def sample_forces(num, speed, force, slope):
    """Write force and derivative of a velocity-dependent law at given velocities.

    Parameters
    ----------
    num : ndarray
        (1, k) numbers of the law.
    speed : ndarray
        (N,) velocities [m/s].
    force, slope : ndarray
        (N,) force [N] and slope [N s/m], which are written.
    """
    for i in range(speed.size):
        force[i], slope[i] = law.find_force(num[0], speed[i])
