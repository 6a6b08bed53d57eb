"""Rate law F = mu N tanh(v/v_0) (eq. 2.4), compiled.

numbers: mu N [N], 1/v_0 [s/m]; there is no memory. NumPy form: `tanh.TanhLaw`.
"""

from math import inf, nan, tanh

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..protocol_kernels import (
    HAS_ZERO_KINK,
    IS_RATE_INDEPENDENT,
    IS_SET_VALUED,
    Rates,
    Reading,
    integrate_stretch,
    solve_step,
    step_bond_length,
)

NUMBER_UNITS = "N s/m"  # units of `numbers`, for batches that scale time and force
HAS_SPEED_LAYER = True  # whether the force changes steeply at speeds of the order of v_0
MAX_TANH_ARGUMENT = 15.0  # largest argument of tanh; beyond it, tanh is 1 to within 2e-13


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def tanh_fit(y):
    """Approximate tanh(y) within 2e-13 without branches, so that loops vectorize.

    The value is y times a ratio of polynomials of y^2 with the smallest maximum error (Remez). Their terms are added
    in pairs, so that few operations wait for each other. It takes half the time of an exponential.
    """
    w = min(max(y, -MAX_TANH_ARGUMENT), MAX_TANH_ARGUMENT)
    t = w * w
    t2 = t * t
    t4 = t2 * t2
    numerator = (
        (0.99999999999983938 + 0.14765069666848572 * t)
        + t2 * (5.3617127395154138e-3 + 7.1381616734550472e-5 * t)
        + t4
        * (
            (3.8743037097684462e-7 + 8.1917070824978973e-10 * t)
            + t2 * (5.336448026556409e-13 + 4.6032156550180916e-17 * t)
        )
    )
    denominator = (
        (1.0 + 0.48098402999999239 * t)
        + t2 * (3.235638940960437e-2 + 6.9389471871154182e-4 * t)
        + t4
        * (
            (5.8801663929329921e-6 + 2.021903780186637e-8 * t)
            + t2 * (2.4883560503357008e-11 + 7.2047408725043925e-15 * t)
        )
    )
    return w * numerator / denominator


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force at a velocity and its derivative; there is no stretch.

    Returns
    -------
    Rates
    """
    ratio = tanh_fit(velocity * numbers[2])
    slope = numbers[1] * numbers[2] * (1 - ratio) * (1 + ratio)
    return Rates(numbers[1] * ratio, 0.0, 0.0, slope)


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
