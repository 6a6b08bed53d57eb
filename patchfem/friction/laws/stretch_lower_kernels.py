"""Bonds as in `stretch_kernels` under a pressure that stays on the lower piece, compiled.

numbers: number m of points, eps_0 [m], the growth (5,), mu_s area/eps_0 (m,) [m] of the points, workspace for their
pressures (m,), number p of nodes of the lower piece, positions of the points (m,) [m], workspace (m,), positions (p,)
[m] and pressures (p,) [Pa] of the nodes; memory: bond length [m], then m, z, s2 and local displacement of every point,
(4, m). Bonds that form under a point in a step have the mean of the pressures at the ends of its path. Where no
pressure is left, the bonds are lost.
"""

from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ..bonds.point_kernels import (
    BondStep,
    bond_mean,
    bond_step,
    grow,
)
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..protocol_kernels import Reading
from .stretch_kernels import (
    FIRST_POINT_INDEX,
    GROWTH_INDEX,
    solve_step,
    step_bond_length,
)


class _Points(NamedTuple):
    """Views of the numbers and the memory of all points, each (m,)."""

    weight: np.ndarray
    source: np.ndarray
    m: np.ndarray
    z: np.ndarray
    s2: np.ndarray
    displacement: np.ndarray


class _Pattern(NamedTuple):
    """Positions and pressures of the points after the step (m,) and of the nodes (p,), as views."""

    position: np.ndarray
    end: np.ndarray
    x: np.ndarray
    sigma: np.ndarray


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _view_points(numbers, memory):
    """Return views of the points in the numbers and the memory of the law."""
    m = int(numbers[1])
    return _Points(
        numbers[FIRST_POINT_INDEX : FIRST_POINT_INDEX + m],
        numbers[FIRST_POINT_INDEX + m : FIRST_POINT_INDEX + 2 * m],
        memory[1 : 1 + m],
        memory[1 + m : 1 + 2 * m],
        memory[1 + 2 * m : 1 + 3 * m],
        memory[1 + 3 * m : 1 + 4 * m],
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _view_pattern(numbers):
    """Return views of the lower piece's pressure pattern, which follows the points in `numbers`."""
    m = int(numbers[1])
    p = int(numbers[FIRST_POINT_INDEX + 2 * m])
    first = FIRST_POINT_INDEX + 2 * m + 1
    nodes = first + 2 * m
    return _Pattern(
        numbers[first : first + m],
        numbers[first + m : nodes],
        numbers[nodes : nodes + p],
        numbers[nodes + p : nodes + 2 * p],
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _pressure_at(position, x, sigma):
    """Return the pressure [Pa] at a position, linear between the nodes x and 0 outside."""
    if position < x[0] or position > x[-1]:
        return 0.0
    j = min(np.searchsorted(x, position, side="right") - 1, x.size - 2)
    fraction = (position - x[j]) / (x[j + 1] - x[j])
    return (1 - fraction) * sigma[j] + fraction * sigma[j + 1]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean_force(numbers, memory, rel_disp, increment, bond_length, dt):
    """Return the path-mean force over an increment, and its slope at fixed pressures.

    It takes 20 ns per point.

    It writes the pressures of the step, which `update_memory` reads.

    Returns
    -------
    force, slope : float
        Path-mean force [N] and its derivative over the increment [N/m].
    """
    points = _view_points(numbers, memory)
    pattern = _view_pattern(numbers)
    force = 0.0
    slope = 0.0
    for j in range(points.weight.size):
        start = pattern.position[j] + rel_disp
        pattern.end[j] = _pressure_at(start + increment, pattern.x, pattern.sigma)
        source = 0.5 * (_pressure_at(start, pattern.x, pattern.sigma) + pattern.end[j])
        points.source[j] = source
        m = points.m[j]
        z = points.z[j]
        mean, bond_slope = bond_mean(m, z, increment, source, bond_length)
        force += points.weight[j] * mean
        slope += points.weight[j] * bond_slope
    return force, slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_memory(numbers, memory, increment, force, v0, v1, dt, bond_length):
    """Advance the bonds by an increment under the pressures that `mean_force` has just computed.

    Where a point reaches a position without pressure, its bonds and their stored energy are lost.

    Returns
    -------
    float
        Energy [J] that the bonds dissipate or lose.
    """
    points = _view_points(numbers, memory)
    end = _view_pattern(numbers).end
    dissipated = 0.0
    for j in range(points.weight.size):
        m = points.m[j]
        z = points.z[j]
        s2 = points.s2[j]
        source = points.source[j]
        bond_increment = bond_step(m, z, s2, increment, source, bond_length)
        dissipated += points.weight[j] * bond_increment.damage_integral / 2
        points.displacement[j] += increment
        if end[j] <= 0:
            dissipated += points.weight[j] * bond_increment.s2 / 2
            bond_increment = BondStep(0.0, 0.0, 0.0, 0.0)
        points.m[j] = bond_increment.m
        points.z[j] = bond_increment.z
        points.s2[j] = bond_increment.s2
    memory[0] = grow(
        memory[0], v0, v1, abs(increment), dt, numbers[GROWTH_INDEX:FIRST_POINT_INDEX]
    )[0]
    return dissipated


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def read_memory(numbers, memory, rel_disp, velocity):
    """Return the force and the energy of the bonds, and the slip of the contact.

    The slip is the relative displacement less the mean stretch, averaged with the friction limits of the points.

    Returns
    -------
    Reading
    """
    points = _view_points(numbers, memory)
    force = 0.0
    energy = 0.0
    weighted = 0.0
    total = 0.0
    for j in range(points.weight.size):
        force += points.weight[j] * points.z[j]
        energy += 0.5 * points.weight[j] * points.s2[j]
        limit = points.weight[j] * points.source[j]
        if points.m[j] > 0:
            weighted += limit * (rel_disp - points.z[j] / points.m[j])
            total += limit
    return Reading(force, energy, weighted / total if total > 0 else rel_disp)
