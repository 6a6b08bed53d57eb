"""Coulomb friction, compiled.

The engines call `solve_coulomb_step` for a step, because a set-valued law has no slope.

numbers: static and kinetic force [N]; memory: force of the last step [N]. NumPy form: `coulomb.Coulomb`.
"""

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from ..protocol_kernels import Reading, solve_step, step_bond_length


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_coulomb_step(free, compliance, static, kinetic):
    """Solve a step of Coulomb's law: it sticks if the static force suffices, or else slips.

    Parameters
    ----------
    free : float
        Increment [m] without friction.
    compliance : float
        What one newton of friction takes off the increment [m/N], above 0.
    static, kinetic : float
        Friction limit at rest, and friction force in motion [N].

    Returns
    -------
    increment, mean_force : float
        Increment [m] and path-mean force [N].
    """
    if abs(free) <= compliance * static:
        return 0.0, free / compliance
    force = kinetic if free > 0 else -kinetic
    return free - compliance * force, force


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, rel_disp, increment, bond_length, dt):
    """Return the kinetic force against an increment (at rest, the last force) and slope 0.

    Returns
    -------
    force, slope : float
        Path-mean force [N] and its derivative over the increment [N/m].
    """
    if increment == 0.0:
        return memory[0], 0.0
    return numbers[2] if increment > 0 else -numbers[2], 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, increment, force, v0, v1, dt, bond_length):
    """Store the friction force of the step, whose work is all dissipated.

    Returns
    -------
    float
        Dissipated energy [J].
    """
    memory[0] = force
    return force * increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, rel_disp, velocity):
    """Return the force of the last step; nothing is stored, and all of the displacement is slip.

    Returns
    -------
    Reading
    """
    return Reading(memory[0], 0.0, rel_disp)
