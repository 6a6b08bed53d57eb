"""Compiled rate law of eq. 2.4. Twin: `tanh.Rate`.

num: limit [N], v_0 [m/s]; no memory.
"""

from math import tanh

from numba import njit

from ..flags_kernels import LEAN, middle

__all__ = ["at_end", "commit", "mean", "middle", "state"]


@njit(error_model="numpy", **LEAN)
def creep(speed, limit, reference):
    """(force [N], slope [N s/m]) of the law at a speed [m/s]."""
    part = tanh(speed / reference)
    return limit * part, limit * (1 - part) * (1 + part) / reference


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] and slope [N/m]: the law at the mean speed of the step."""
    force, slope = creep(dq / dt, num[e, 1], num[e, 2])
    return force, slope / dt


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """All work of the step is dissipated [J]."""
    return force * dq


@njit(error_model="numpy", **LEAN)
def at_end(num, e, before, speed, travel):
    """(force [N], its slope over the speed [N s/m], over the travel [N/m]) at a speed [m/s]."""
    force, slope = creep(speed, num[e, 1], num[e, 2])
    return force, slope, 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible slip [m]) at a speed [m/s]."""
    return creep(v, num[e, 1], num[e, 2])[0], 0.0, q
