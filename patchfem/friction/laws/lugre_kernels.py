"""LuGre law, compiled, for `points`. Equations: `lugre`.

numbers: static and kinetic force [N], stiffness [N/m], Stribeck velocity v_s [m/s], micro-damping and viscous damping
[N s/m]; memory: stretch z [m]. At the constant velocity of a step, z relaxes towards +-g/stiffness over that length of
path.
"""

from enum import IntEnum
from math import exp

from ...kernel_cache.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...kernel_cache.jit import njit

# Smallest friction limit relative to the static force; z relaxes over limit/stiffness, which must
# not be 0
MIN_LIMIT_RATIO = 1e-9


class LuGreNumber(IntEnum):
    """Indices of the parameters of the law.

    Index 0 has the number of the law (`points.rows.Law`).

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
    float
        The path [m].
    """
    stiffness = numbers[LuGreNumber.STIFFNESS]
    kinetic = numbers[LuGreNumber.KINETIC]
    static = numbers[LuGreNumber.STATIC]
    speed = numbers[LuGreNumber.SPEED]

    # The Stribeck curve g(v)
    ratio = velocity / speed
    rise = (static - kinetic) * exp(-ratio * ratio)
    limit = max(kinetic + rise, MIN_LIMIT_RATIO * static)
    return limit / stiffness


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def find_force(numbers, stretch, velocity):
    """Return the force at a stretch z and a velocity, with dz/dx = 1 - z/(g/stiffness) along the path x of the slip.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law, in the order of `LuGreNumber`.
    stretch, velocity : float
        z [m] and the velocity of the slip [m/s].

    Returns
    -------
    float
        Force [N].
    """
    direction = 1.0 if velocity > 0 else -1.0
    stretch_rate = 1 - direction * stretch / relaxation_length(numbers, velocity)
    damping = numbers[LuGreNumber.MICRO_DAMPING] * stretch_rate + numbers[LuGreNumber.VISCOUS]
    return numbers[LuGreNumber.STIFFNESS] * stretch + damping * velocity
