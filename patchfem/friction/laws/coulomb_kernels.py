"""Compiled set-valued Coulomb friction: the loops ask `stick` for its step, as it has no slope.

Twin: `coulomb.Coulomb`. num: static, kinetic force [N]; mem: the last force [N].
"""

import numpy as np
from numba import njit

from ..flags_kernels import LEAN, middle

__all__ = ["at_end", "commit", "mean", "middle", "state"]


@njit(error_model="numpy", **LEAN)
def stick(free, beta, static, kinetic):
    """(dq [m], path-mean force [N]) with dq = free - beta force: no slide up to the static force, else kinetic."""
    if abs(free) <= beta * static:
        return 0.0, free / beta
    force = kinetic if free > 0 else -kinetic
    return free - beta * force, force


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Kinetic force [N] against a slide that is known; no slope."""
    if dq == 0.0:
        return mem[e, 0], 0.0
    return num[e, 2] if dq > 0 else -num[e, 2], 0.0


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """All work of the step is dissipated [J]."""
    mem[e, 0] = force
    return force * dq


@njit(error_model="numpy", **LEAN)
def at_end(num, e, before, speed, travel):
    """(kinetic force [N] against a speed [m/s], no slopes)."""
    return num[e, 2] * np.sign(speed), 0.0, 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], irreversible slip [m]): the force of the last step."""
    return mem[e, 0], 0.0, q
