"""Bonds of eq. 2.17 with reading="stretch" and p = 1 for points that move alike, compiled.

The forces of the points are proportional to their pressures, so one point carries the whole load. Equations:
`friction.bonds.point_kernels`.

numbers: 0, mu_s load/eps_0 [N/m], eps_0 [m], the growth (5,) of eq. 2.10. At a constant bond length the bonds are
exponentials of the path between two reversals.
"""

from enum import IntEnum
from math import exp, expm1

from ...compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ..protocol_kernels import Rates, RelaxedStretch


class StretchNumber(IntEnum):
    """Indices of the parameters of the law: stiffness and bond length.

    The parameter 0 is reserved for the engines, and those of the growth of bonds follow.
    """

    STIFFNESS = 1
    LENGTH = 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_stretch(numbers, stretch, increment, dt):
    """Return the stretch of mature bonds after an increment, for harmonic balance.

    It relaxes over the bond length. `numbers` are the parameters of the law (`StretchNumber`), and `stretch` [m] is the
    stretch before the increment [m]. The result does not depend on the duration `dt` [s].

    Returns
    -------
    RelaxedStretch
        Stretch [m] after the increment, and its derivatives.
    """
    length = numbers[StretchNumber.LENGTH]
    end = length if increment > 0 else -length
    decay = exp(-abs(increment) / length)
    # With expm1, increments far below the bond length keep their digits.
    after = stretch * decay - end * expm1(-abs(increment) / length)
    return RelaxedStretch(after, decay, (1 - stretch / end) * decay, 0.0)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force of mature bonds of constant length at a stretch.

    `numbers` are the parameters of the law (`StretchNumber`), and `stretch` is in [m]. The force does not depend on the
    `velocity` of the slip [m/s] and its sign, `direction`.

    Returns
    -------
    Rates
    """
    stiffness = numbers[StretchNumber.STIFFNESS]
    return Rates(stiffness * stretch, stiffness, 0.0)
