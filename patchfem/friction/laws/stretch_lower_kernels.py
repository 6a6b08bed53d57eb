"""Compiled bonds as in `stretch_kernels` under a pressure that stays on the lower piece.

num: number m of points, the growth (6,), mu_s area/eps_0 of every point [m], room for their pressures, the size p of
the pattern, the places of the points (m,) [m], room (m,), places (p,) [m] and pressures (p,) [Pa] of the pattern; mem:
bond length [m], then m, z, s2, local slide and play of every point, (5, m). What forms under a point in a step has the
mean of the pressures at the ends of its way; where none is left the bonds are lost.
"""

import numpy as np

from ...compiled.jit import njit
from ..bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .stretch_kernels import FREE, GROWTH, WEIGHT, closed, middle

__all__ = ["closed", "commit", "mean", "middle", "state"]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def points(num, mem, e):
    """(weights mu_s area/eps_0 (m,) [m], pressures (m,) [Pa], bonds 5 x (m,)) of element e, as views of its numbers."""
    m, row = int(num[e, 1]), mem[e]
    bonds = (
        row[1 : 1 + m],
        row[1 + m : 1 + 2 * m],
        row[1 + 2 * m : 1 + 3 * m],
        row[1 + 3 * m : 1 + 4 * m],
        row[1 + 4 * m : 1 + 5 * m],
    )
    return num[e, WEIGHT : WEIGHT + m], num[e, WEIGHT + m : WEIGHT + 2 * m], bonds


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pressure_at(place, x, sigma):
    """Pressure [Pa] of the pattern sigma (m,) on x (m,) at one place, linear between nodes, 0 outside."""
    if place < x[0] or place > x[-1]:
        return 0.0
    j = min(np.searchsorted(x, place, side="right") - 1, x.size - 2)
    part = (place - x[j]) / (x[j + 1] - x[j])
    return (1 - part) * sigma[j] + part * sigma[j + 1]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pattern(num, e):
    """(places of the points (m,) [m], pressures they come to (m,) [Pa], places (p,) [m], pressures (p,) [Pa] of the
    pattern)."""
    m = int(num[e, 1])
    p, at = int(num[e, WEIGHT + 2 * m]), WEIGHT + 2 * m + 1
    x = at + 2 * m
    return num[e, at : at + m], num[e, at + m : x], num[e, x : x + p], num[e, x + p : x + 2 * p]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] over an increment dq [m] from the slide q [m], and its slope over dq [N/m] at fixed
    pressures.

    It writes the pressures of the step, which `commit` reads again. Cost: 20 ns per point.
    """
    weight, source, bonds = points(num, mem, e)
    place, end, x, sigma = pattern(num, e)
    force, slope = 0.0, 0.0
    for j in range(weight.size):
        here = place[j] + q
        end[j] = pressure_at(here + dq, x, sigma)
        source[j] = 0.5 * (pressure_at(here, x, sigma) + end[j])
        if num[e, FREE] > 0:
            f, s = loose_mean(
                bonds[0][j], bonds[1][j], bonds[4][j], num[e, FREE] * eps, dq, source[j], eps
            )
        else:
            f, s = bond_mean(bonds[0][j], bonds[1][j], dq, source[j], eps)
        force += weight[j] * f
        slope += weight[j] * s
    return force, slope


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move the bonds under the pressures of the last `mean`; returns the energy that they dissipate or lose [J].

    Where a point comes to a place without pressure its bonds are lost with what they store.
    """
    weight, source, bonds = points(num, mem, e)
    _, end, _, _ = pattern(num, e)
    lost = 0.0
    for j in range(weight.size):
        m, z, s2, play = bonds[0][j], bonds[1][j], bonds[2][j], bonds[4][j]
        if num[e, FREE] > 0:
            m, z, s2, play, part = loose_step(
                m, z, s2, play, num[e, FREE] * eps, dq, source[j], eps
            )
        else:
            m, z, s2, part = bond_step(m, z, s2, dq, source[j], eps)
        lost += weight[j] * part / 2
        bonds[3][j] += dq
        if end[j] <= 0:
            lost += weight[j] * s2 / 2
            m, z, s2 = 0.0, 0.0, 0.0
        bonds[0][j], bonds[1][j], bonds[2][j], bonds[4][j] = m, z, s2, play
    mem[e, 0] = grow(mem[e, 0], v0, v1, abs(dq), dt, num[e, GROWTH:WEIGHT])[0]
    return lost


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) of a contact as it stands at the slide q [m].

    The irreversible part is local slide less mean stretch of the bonds, averaged with mu_s sigma area of the points.
    """
    weight, source, bonds = points(num, mem, e)
    force, energy, slip, total = 0.0, 0.0, 0.0, 0.0
    for j in range(weight.size):
        force += weight[j] * bonds[1][j]
        energy += 0.5 * weight[j] * bonds[2][j]
        share = weight[j] * source[j]
        if bonds[0][j] > 0:
            slip += share * (bonds[3][j] - bonds[1][j] / bonds[0][j])
            total += share
    return force, energy, slip / total if total > 0 else q
