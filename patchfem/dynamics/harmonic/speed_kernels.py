"""Forces of a velocity-dependent law without memory along a cycle (compiled)."""

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ...friction.laws import tanh_kernels as law


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def solve_cycle(numbers, q, velocity, dt, stretch, steps, force, slopes):
    """Write the force and its derivatives; a law without memory has no stretch.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law.
    q, velocity, dt : (M,) array
        Slides [m], velocities [m/s] and times to the next node [s].
    stretch : (M,) array
        It is written [m].
    steps : (3, M) array
        Derivatives of the next stretch by stretch, slide and time, which are written.
    force, slopes : (M,), (2, M) array
        Force [N] and its derivatives by stretch and velocity, which are written.
    """
    stretch[:] = 0.0
    steps[:] = 0.0
    slopes[0] = 0.0
    for i in range(velocity.size):
        force[i], slopes[1, i] = law.find_force(numbers, velocity[i])
