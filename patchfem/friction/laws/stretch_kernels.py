"""Bonds of eq. 2.17 with reading="stretch" and p = 1 for points that move alike, compiled.

Every point moves in proportion to its pressure, so one point under 1 Pa stands for all of them. Equations:
`friction.bonds.point_kernels`.

numbers: sum of mu_s area pressure/eps_0 over the points [N/m], eps_0 [m], the growth (5,) of eq. 2.10, the pressures
[Pa]; memory: bond length [m], then m, z, s2 and local displacement. At a constant bond length the bonds are exponentials
of the path between two reversals, and the rate form has no states. Where the bond length grows, its states are
(eps, m, z, s2).
"""

from math import exp, expm1, inf, nan

from ...compiled.jit import njit
from ..bonds.point_kernels import bond_mean, bond_step, grow
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..protocol_kernels import (
    Rates,
    Reading,
    RelaxedStretch,
    solve_step,
)

# Index in `numbers` of the first growth parameter: a_s, l_k, v_h, eps_0, eps_k
GROWTH_INDEX = 3
FIRST_POINT_INDEX = 8  # index of the first number of the points


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def step_bond_length(numbers, memory, velocity, dt):
    """Return the bond length [m] in the middle of a step at constant velocity (eq. 2.10).

    Returns
    -------
    float
    """
    half = dt / 2
    growth = numbers[GROWTH_INDEX:FIRST_POINT_INDEX]
    return grow(memory[0], velocity, velocity, abs(velocity) * half, half, growth)[0]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, rel_disp, increment, bond_length, dt):
    """Return the path-mean force of the bonds over an increment.

    Returns
    -------
    force, slope : float
        Path-mean force [N] and its derivative over the increment [N/m].
    """
    force, slope = bond_mean(memory[1], memory[2], increment, 1.0, bond_length)
    return numbers[1] * force, numbers[1] * slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, increment, force, v0, v1, dt, bond_length):
    """Advance the bonds by an increment, including their growth.

    Returns
    -------
    float
        Dissipated energy [J].
    """
    bond_increment = bond_step(memory[1], memory[2], memory[3], increment, 1.0, bond_length)
    memory[1] = bond_increment.m
    memory[2] = bond_increment.z
    memory[3] = bond_increment.s2
    memory[4] += increment
    memory[0] = grow(
        memory[0], v0, v1, abs(increment), dt, numbers[GROWTH_INDEX:FIRST_POINT_INDEX]
    )[0]
    return numbers[1] * bond_increment.damage_integral / 2


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def relax_stretch(numbers, stretch, increment, dt):
    """Return the stretch of mature bonds after an increment, for harmonic balance.

    It relaxes over the bond length.

    Returns
    -------
    RelaxedStretch
    """
    length = numbers[2]
    end = length if increment > 0 else -length
    decay = exp(-abs(increment) / length)
    # With expm1, increments far below the bond length keep their digits.
    after = stretch * decay - end * expm1(-abs(increment) / length)
    return RelaxedStretch(after, decay, (1 - stretch / end) * decay, 0.0)


@njit(error_model="numpy", forceinline=True, fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def rate_equation(numbers, stretch, velocity, direction):
    """Return the force of mature bonds of constant length at a stretch.

    Returns
    -------
    Rates
    """
    return Rates(numbers[1] * stretch, numbers[1], 0.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, rel_disp, velocity):
    """Return the force, the energy of the bonds, and the slip: displacement minus mean stretch.

    Returns
    -------
    Reading
    """
    weight = numbers[1]
    m = memory[1]
    z = memory[2]
    slip = rel_disp - z / m if weight * m > 0 else rel_disp
    return Reading(weight * z, 0.5 * weight * memory[3], slip)
