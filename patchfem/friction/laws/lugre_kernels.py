"""LuGre law, compiled, in forms that follow from `rate_equation`. Equations: `lugre`.

numbers: static and kinetic force [N], stiffness [N/m], Stribeck velocity v_s [m/s], micro-damping and viscous damping
[N s/m]; memory: stretch z [m]. At the constant velocity of a step, z relaxes towards +-g/stiffness over that length of
path.
"""

from enum import IntEnum
from math import exp

from ...compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ..protocol_kernels import Rates, RelaxedStretch

# Smallest friction limit relative to the static force; z relaxes over limit/stiffness, which must
# not be 0
MIN_LIMIT_RATIO = 1e-9


class LuGreNumber(IntEnum):
    """Indices of the parameters of the law.

    Index 0 is reserved for the engines.

    - STATIC, KINETIC: static and kinetic friction force [N]
    - STIFFNESS: stiffness [N/m]
    - SPEED: Stribeck velocity [m/s]
    - MICRO_DAMPING, VISCOUS: micro-damping and viscous damping [N s/m]
    """

    STATIC = 1
    KINETIC = 2
    STIFFNESS = 3
    SPEED = 4
    MICRO_DAMPING = 5
    VISCOUS = 6


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def relaxation_length(numbers, velocity):
    """Return the path over which the stretch z relaxes to its steady value at a constant velocity.

    This path is g(v)/stiffness, with g(v) = F_k + (F_s - F_k) exp(-(v/v_s)^2), the kinetic and static forces F_k and F_s,
    and the Stribeck velocity v_s.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law, in the order of `LuGreNumber`.
    velocity : float
        Velocity v [m/s].

    Returns
    -------
    (float, float)
        The path [m], and its derivative with respect to the velocity [s].
    """
    stiffness = numbers[LuGreNumber.STIFFNESS]
    kinetic = numbers[LuGreNumber.KINETIC]
    static = numbers[LuGreNumber.STATIC]
    speed = numbers[LuGreNumber.SPEED]

    # The Stribeck curve g(v)
    ratio = velocity / speed
    rise = (static - kinetic) * exp(-ratio * ratio)
    limit = max(kinetic + rise, MIN_LIMIT_RATIO * static)
    return limit / stiffness, -2 * ratio / speed * rise / stiffness


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force at a stretch and a velocity, and dz/dx = 1 - z/(g/stiffness).

    The coordinate x increases along the slip. `numbers` are the parameters of the law (`LuGreNumber`), `stretch` is z
    [m], `velocity` that of the slip [m/s], and `direction` its sign.

    Returns
    -------
    Rates
    """
    stiffness = numbers[LuGreNumber.STIFFNESS]
    micro_damping = numbers[LuGreNumber.MICRO_DAMPING]
    viscous = numbers[LuGreNumber.VISCOUS]
    length, length_derivative = relaxation_length(numbers, velocity)
    stretch_rate = 1 - direction * stretch / length
    length_term = direction * stretch * velocity * length_derivative / (length * length)
    return Rates(
        stiffness * stretch + (micro_damping * stretch_rate + viscous) * velocity,
        stiffness - micro_damping * direction * velocity / length,
        micro_damping * (stretch_rate + length_term) + viscous,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_stretch(numbers, stretch, increment, dt):
    """Return z after an increment at constant velocity, for harmonic balance.

    z relaxes towards +-g/stiffness. If the step takes no time, the limit is the kinetic force. `numbers` are the
    parameters of the law (`LuGreNumber`), `stretch` is z before the increment [m], and `dt` the duration of the
    increment [s], 0 or more.

    Returns
    -------
    RelaxedStretch
    """
    direction = 1.0 if increment > 0 else -1.0
    path = abs(increment)
    limit = max(numbers[LuGreNumber.KINETIC], MIN_LIMIT_RATIO * numbers[LuGreNumber.STATIC])
    length = limit / numbers[LuGreNumber.STIFFNESS]
    length_by_path = 0.0  # derivative of the length with respect to the path
    if dt > 0:
        length, length_by_velocity = relaxation_length(numbers, path / dt)
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
