"""Nonlinear springs with the interface of a friction law (compiled).

The force is k_3 q^3 + k lambda/(2 pi) sin(2 pi q/lambda).

numbers: k_3 [N/m3] of stiffening, k [N/m] and wavelength lambda [m] of interlocking peaks. The
path-mean force is (V(q + dq) - V(q))/dq of the potential V, so the springs neither create nor dissipate energy
for any step size.
"""

from math import cos, pi, sin

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.protocol_kernels import Reading
from ...friction.protocol_kernels import solve_step as solve_step
from ...friction.protocol_kernels import step_bond_length as step_bond_length


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, q, dq, eps, dt):
    """Return the path-mean force of the springs over an increment, and its slope.

    The force is (V(q + dq) - V(q))/dq, evaluated without cancellation.

    Parameters
    ----------
    numbers : ndarray
        (4,) see the top of the module.
    memory : ndarray
        Not used.
    q : float
        Relative displacement [m].
    dq : float
        Increment of the relative displacement [m].
    eps : float
        Not used.
    dt : float
        Not used.

    Returns
    -------
    force : float
        Mean of the force over the path dq [N].
    slope : float
        Derivative with respect to dq [N/m].
    """
    b = q + dq
    cubic = 0.25 * numbers[1]
    stiffness = numbers[2]
    force = cubic * (b + q) * (b * b + q * q)
    slope = cubic * (3 * b * b + 2 * b * q + q * q)
    if stiffness == 0.0:
        return force, slope
    wave_number = 2 * pi / numbers[3]
    half = 0.5 * wave_number * dq
    centre = wave_number * (q + 0.5 * dq)
    # The error of the series is 1e-4^4/120 here, whereas the quotients would lose digits.
    if abs(half) < 1e-4:
        ratio = 1 - half * half / 6
        bend = -half / 3
    else:
        ratio = sin(half) / half
        bend = (cos(half) - ratio) / half
    force += stiffness / wave_number * sin(centre) * ratio
    return force, slope + 0.5 * stiffness * (cos(centre) * ratio + sin(centre) * bend)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, dq, force, v0, v1, dt, eps):
    """Return the dissipated energy of a step, which is 0 for springs.

    Parameters
    ----------
    numbers : ndarray
        Not used.
    memory : ndarray
        Not used.
    dq : float
        Increment of the relative displacement [m].
    force : float
        Mean of the force over the path dq [N].
    v0 : float
        Not used.
    v1 : float
        Not used.
    dt : float
        Not used.
    eps : float
        Not used.

    Returns
    -------
    float
        0 J.
    """
    return 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, q, v):
    """Return the force and the stored energy V(q) of the springs, with the slide as slip.

    Parameters
    ----------
    numbers : ndarray
        (4,) see the top of the module.
    memory : ndarray
        Not used.
    q : float
        Relative displacement [m].
    v : float
        Not used.

    Returns
    -------
    Reading
    """
    force = numbers[1] * q**3
    energy = 0.25 * numbers[1] * q**4
    stiffness = numbers[2]
    if stiffness == 0.0:
        return Reading(force, energy, q)
    wave_number = 2 * pi / numbers[3]
    return Reading(
        force + stiffness / wave_number * sin(wave_number * q),
        energy + 2 * stiffness * (sin(0.5 * wave_number * q) / wave_number) ** 2,
        q,
    )
