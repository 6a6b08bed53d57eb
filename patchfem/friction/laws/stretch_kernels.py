"""Compiled bonds of eq. 2.17 in the stretch reading with p = 1, at points that all slide alike.

Every point moves in proportion to its pressure, so one point under 1 Pa stands for all of them. Twin:
`friction.bonds.recursion.Recursion`. num: 1, the growth (6,) of eq. 2.10 and of the breakaway share, the sum of
mu_s area pressure/eps_0 over the points [N/m], the pressures [Pa]; mem: bond length [m], then m, z, s2, local slide and
play.
"""

from math import exp

from numba import njit

from ..bonds.point_kernels import bond_mean, bond_step, grow, loose_mean, loose_step
from ..flags_kernels import LEAN, closed

__all__ = ["closed", "commit", "flow", "mean", "middle", "pull", "state"]

GROWTH, WEIGHT = 2, 8  # of num: where the growth and the weights begin
FREE = 7  # of num: share of the bond length that stretches without damage


@njit(error_model="numpy", **LEAN)
def middle(num, mem, e, v, dt):
    """Bond length [m] in the middle of a step of dt [s] at the speed v [m/s] (eq. 2.10), which the solve of the step
    uses."""
    return grow(mem[e, 0], v, v, abs(v) * dt / 2, dt / 2, num[e, GROWTH:WEIGHT])[0]


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of eq. 2.17 (stretch, p = 1) over an increment dq [m], and its slope over dq [N/m]; 10 ns.

    eps: bond length of the step [m].
    """
    if num[e, FREE] > 0:
        force, slope = loose_mean(mem[e, 1], mem[e, 2], mem[e, 5], num[e, FREE] * eps, dq, 1.0, eps)
    else:
        force, slope = bond_mean(mem[e, 1], mem[e, 2], dq, 1.0, eps)
    return num[e, WEIGHT] * force, num[e, WEIGHT] * slope


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Move the bonds over the increment dq [m] and let them grow; returns the energy that they dissipate [J].

    v0, v1: speeds [m/s] at the ends of the step of dt [s]; eps: bond length of its middle [m].
    """
    if num[e, FREE] > 0:
        mem[e, 1], mem[e, 2], mem[e, 3], mem[e, 5], lost = loose_step(
            mem[e, 1], mem[e, 2], mem[e, 3], mem[e, 5], num[e, FREE] * eps, dq, 1.0, eps)
    else:
        mem[e, 1], mem[e, 2], mem[e, 3], lost = bond_step(mem[e, 1], mem[e, 2], mem[e, 3], dq, 1.0, eps)
    mem[e, 4] += dq
    mem[e, 0] = grow(mem[e, 0], v0, v1, abs(dq), dt, num[e, GROWTH:WEIGHT])[0]
    return num[e, WEIGHT] * lost / 2


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
    return num[e, WEIGHT] * z, num[e, WEIGHT], 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible part of the slide [m]) of a contact as it stands at the slide q [m].

    The irreversible part is local slide less mean stretch of the bonds.
    """
    weight, m, z = num[e, WEIGHT], mem[e, 1], mem[e, 2]
    return weight * z, 0.5 * weight * mem[e, 3], mem[e, 4] - z / m if weight * m > 0 else q
