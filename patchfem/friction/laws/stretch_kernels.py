"""Compiled bonds of eq. 2.17 in the stretch reading with p = 1, at m points that all slide alike.

Twin: `friction.bonds.recursion.Recursion`. num: m, the growth (6,) of eq. 2.10 and of the breakaway share, mu_s
area/eps_0 of every point [m], its pressure [Pa]; mem: bond length [m], then m, z, s2, local slide and play of every
point, (5, m).
"""

from math import exp

from numba import njit

from ..bonds.point_kernels import bond_mean, grow, loose_mean, loose_step, rigid_step
from ..flags_kernels import FAST, LEAN

GROWTH, WEIGHT = 2, 8  # of num: where the growth and the weights begin
FREE = 7  # of num: share of the bond length that stretches without damage


@njit(error_model="numpy", **LEAN)
def middle(num, mem, e, v, dt):
    """Bond length [m] in the middle of a step of dt [s] at the speed v [m/s] (eq. 2.10), which the solve of the step
    uses."""
    return grow(mem[e, 0], v, v, abs(v) * dt / 2, dt / 2, num[e, GROWTH:WEIGHT])[0]


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def points(num, mem, e):
    """(weights mu_s area/eps_0 (m,) [m], pressures (m,) [Pa], bonds (5, m)) of element e, as views of its numbers."""
    m = int(num[e, 1])
    return num[e, WEIGHT:WEIGHT + m], num[e, WEIGHT + m:WEIGHT + 2 * m], mem[e, 1:1 + 5 * m].reshape((5, m))


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of eq. 2.17 (stretch, p = 1) over an increment dq [m], and its slope over dq [N/m].

    eps: bond length of the step [m]. Cost: 0.3 ns per point, as all bonds together move like one point; with a
    breakaway share every point is stepped by itself.
    """
    if num[e, FREE] == 0:
        row, past, m = num[e], mem[e], int(num[e, 1])
        density, stretch, pressure = 0.0, 0.0, 0.0
        for j in range(m):
            density += row[WEIGHT + j] * past[1 + j]
            stretch += row[WEIGHT + j] * past[1 + m + j]
            pressure += row[WEIGHT + j] * row[WEIGHT + m + j]
        return bond_mean(density, stretch, dq, pressure, eps)
    weight, source, bonds = points(num, mem, e)
    force, slope = 0.0, 0.0
    for j in range(weight.size):
        f, s = loose_mean(bonds[0, j], bonds[1, j], bonds[4, j], num[e, FREE] * eps, dq, source[j], eps)
        force += weight[j] * f
        slope += weight[j] * s
    return force, slope


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move the bonds over the increment dq [m] and let them grow; returns the energy that they dissipate [J].

    v0, v1: speeds [m/s] at the ends of the step of dt [s]; eps: bond length of its middle [m].
    """
    weight, source, bonds = points(num, mem, e)
    lost = 0.0
    if num[e, FREE] == 0:
        lost = rigid_step(dq, weight, bonds, source, eps)
    else:
        for j in range(weight.size):
            bonds[0, j], bonds[1, j], bonds[2, j], bonds[4, j], part = loose_step(
                bonds[0, j], bonds[1, j], bonds[2, j], bonds[4, j], num[e, FREE] * eps, dq, source[j], eps)
            bonds[3, j] += dq
            lost += weight[j] * part / 2
    mem[e, 0] = grow(mem[e, 0], v0, v1, abs(dq), dt, num[e, GROWTH:WEIGHT])[0]
    return lost


@njit(error_model="numpy", **LEAN)
def flow(num, e, z, dq, dt):
    """(stretch z [m] of full-grown bonds after a slide dq [m], its slopes over z, dq [1] and dt [m/s]), for harmonic
    balance.

    Holds at constant bond length eps: z relaxes towards eps sgn dq over the path eps. The law knows no time.
    """
    length = num[e, GROWTH + 3]
    end = length if dq > 0 else -length
    kept = exp(-abs(dq) / length)
    return end + (z - end) * kept, kept, (1 - z / end) * kept, 0.0


@njit(error_model="numpy", **LEAN)
def pull(num, e, z, v):
    """(force [N] of full-grown bonds stretched by z [m], its slopes over z [N/m] and over the speed, 0)."""
    m, stiffness = int(num[e, 1]), 0.0
    for j in range(m):
        stiffness += num[e, WEIGHT + j] * num[e, WEIGHT + m + j]
    return stiffness * z, stiffness, 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) of a contact as it stands at the slide q [m].

    The irreversible part is local slide less mean stretch of the bonds, averaged with mu_s sigma area of the points.
    """
    weight, source, bonds = points(num, mem, e)
    force, energy, slip, total = 0.0, 0.0, 0.0, 0.0
    for j in range(weight.size):
        force += weight[j] * bonds[1, j]
        energy += 0.5 * weight[j] * bonds[2, j]
        share = weight[j] * source[j]
        if bonds[0, j] > 0:
            slip += share * (bonds[3, j] - bonds[1, j] / bonds[0, j])
            total += share
    return force, energy, slip / total if total > 0 else q
