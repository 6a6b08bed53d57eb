"""Rate law F = mu N tanh(v/v_0) (eq. 2.4), compiled.

numbers: mu N [N], 1/v_0 [s/m]; there is no memory. NumPy form: `tanh.TanhLaw`.
"""

from math import inf, nan, tanh

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..protocol_kernels import (
    Reading,
    solve_step,
    step_bond_length,
)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, rel_disp, increment, bond_length, dt):
    """Return the friction force at the mean velocity of a time step.

    Returns
    -------
    force, slope : float
        Path-mean force [N] and its derivative over the increment [N/m].
    """
    ratio = tanh(increment / dt * numbers[2])
    return numbers[1] * ratio, numbers[1] * (1 - ratio) * (1 + ratio) * numbers[2] / dt


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, increment, force, v0, v1, dt, bond_length):
    """Return the work of the force, which is all dissipated; there is no memory.

    Returns
    -------
    float
        Dissipated energy [J].
    """
    return force * increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, rel_disp, velocity):
    """Return the force at a velocity; nothing is stored, and all of the displacement is slip.

    Returns
    -------
    Reading
    """
    return Reading(numbers[1] * tanh(velocity * numbers[2]), 0.0, rel_disp)
