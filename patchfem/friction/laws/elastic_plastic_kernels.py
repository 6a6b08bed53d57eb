"""Compiled parallel Jenkins elements (3.12 with its reversal). Twin: `elastic_plastic.ElasticPlastic`."""

from numba import njit

from ..flags_kernels import FAST, LEAN


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def jenkins_mean(dq, stretch, stiffness, limit):
    """Path-mean force [N] and slope [N/m] of parallel elements (t,); 0.4 ns per element.

    What an element cannot stretch, `rest`, is exactly zero where it only stretches: no difference of large numbers.
    """
    force, slope = 0.0, 0.0
    if abs(dq) < 1e-290:
        for j in range(stretch.size):
            force += stiffness[j] * stretch[j]
            slope += 0.5 * stiffness[j]
        return force, slope
    for j in range(stretch.size):
        s0 = stretch[j]
        s1 = s0 + dq
        bound = min(max(s1, -limit[j]), limit[j])
        rest = s1 - bound
        elastic = dq - rest
        force += stiffness[j] * (elastic * (s0 + bound) * 0.5 + rest * bound)
        slope += stiffness[j] * elastic * elastic
    return force / dq, 0.5 * slope / dq / dq


@njit(error_model="numpy", fastmath=FAST, **LEAN)
def jenkins_step(dq, stretch, stiffness, limit, now):
    """Move the elements (t,) in place; returns the energy they dissipate [J]. now (3,): force [N], stored energy [J]
    and stretch [m] averaged with stiffness * limit, all after the step."""
    burnt, force, energy, shared, total = 0.0, 0.0, 0.0, 0.0, 0.0
    for j in range(stretch.size):
        s1 = stretch[j] + dq
        bound = min(max(s1, -limit[j]), limit[j])
        pull = stiffness[j] * bound
        burnt += pull * (s1 - bound)
        force += pull
        energy += pull * bound
        shared += limit[j] * pull
        total += limit[j] * stiffness[j]
        stretch[j] = bound
    now[0], now[1], now[2] = force, 0.5 * energy, shared / total if total > 0 else 0.0
    return burnt
