"""LuGre law, compiled, in forms that follow from `rate_equation`. Equations: `lugre`.

numbers: stiffness [N/m], kinetic and static force [N], Stribeck velocity v_s [m/s], micro-damping and viscous damping
[N s/m]; memory: stretch z [m]. At the constant velocity of a step, z relaxes towards +-g/stiffness over that length of
path.
"""

from math import exp

from ...compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ..protocol_kernels import Rates, RelaxedStretch

# Smallest friction limit relative to the static force; z relaxes over limit/stiffness, which must
# not be 0
MIN_LIMIT_RATIO = 1e-9


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def _relaxation_length(numbers, velocity):
    """Return the length g/stiffness [m] over which z relaxes, and its velocity derivative [s]."""
    ratio = velocity / numbers[4]
    rise = (numbers[3] - numbers[2]) * exp(-ratio * ratio)
    limit = max(numbers[2] + rise, MIN_LIMIT_RATIO * numbers[3])
    return limit / numbers[1], -2 * ratio / numbers[4] * rise / numbers[1]


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force at a stretch and a velocity, and dz/dx = 1 - z/(g/stiffness).

    x increases along the slip.

    Returns
    -------
    Rates
    """
    length, length_derivative = _relaxation_length(numbers, velocity)
    stretch_rate = 1 - direction * stretch / length
    length_term = direction * stretch * velocity * length_derivative / (length * length)
    return Rates(
        numbers[1] * stretch + (numbers[5] * stretch_rate + numbers[6]) * velocity,
        numbers[1] - numbers[5] * direction * velocity / length,
        numbers[5] * (stretch_rate + length_term) + numbers[6],
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_stretch(numbers, stretch, increment, dt):
    """Return z after an increment at constant velocity, for harmonic balance.

    z relaxes towards +-g/stiffness. If the step takes no time, the limit is the kinetic force.

    Returns
    -------
    RelaxedStretch
    """
    direction = 1.0 if increment > 0 else -1.0
    path = abs(increment)
    length = max(numbers[2], MIN_LIMIT_RATIO * numbers[3]) / numbers[1]
    length_by_path = 0.0  # derivative of the length with respect to the path
    if dt > 0:
        length, length_by_velocity = _relaxation_length(numbers, path / dt)
        length_by_path = length_by_velocity / dt
    x = path / length
    decay = exp(-x)
    end = direction * length
    deviation = stretch - end

    # The length changes with the velocity path/dt, so also with the time of the step.
    x_by_path = (1 - x * length_by_path) / length
    by_path = direction * length_by_path * (1 - decay) - deviation * decay * x_by_path
    by_time = 0.0
    if dt > 0:
        length_by_time = -length_by_path * path / dt
        by_time = direction * length_by_time * (1 - decay)
        by_time += deviation * decay * x / length * length_by_time
    return RelaxedStretch(end + deviation * decay, decay, direction * by_path, by_time)
