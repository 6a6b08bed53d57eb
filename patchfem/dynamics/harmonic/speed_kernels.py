"""Forces of a velocity-dependent law without memory along a cycle (compiled)."""

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ...friction.laws import tanh_kernels as law


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def sample_forces(numbers, velocity, force, slope):
    """Write force and derivative of a law at given velocities.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law.
    velocity : (M,) array
        [m/s].
    force, slope : (M,) array
        Force [N] and slope [N s/m], which are written.
    """
    for i in range(velocity.size):
        force[i], slope[i] = law.find_force(numbers, velocity[i])
