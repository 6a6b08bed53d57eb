"""Compiled set-valued Coulomb friction: the loops ask `stick` for its step, as it has no slope.

Twin: `coulomb.Coulomb`. num: static, kinetic force [N]; mem: the last force [N].
"""

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT, closed, middle

__all__ = ["at_end", "closed", "commit", "mean", "middle", "state"]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def stick(free, beta, static, kinetic):
    """(slide dq [m], path-mean force [N]) of one step of Coulomb's law, with dq = free - beta force.

    free [m]: slide of the step without friction; beta [m/N] > 0: slide that one newton of friction takes away; static,
    kinetic: forces [N] >= 0. No slide while |free| <= beta static; beyond it the kinetic force resists.
    """
    if abs(free) <= beta * static:
        return 0.0, free / beta
    force = kinetic if free > 0 else -kinetic
    return free - beta * force, force


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def mean(num, mem, e, q, dq, eps, dt):
    """Kinetic force [N] against a slide dq [m] that is known, the last force at dq = 0; the slope [N/m] is 0."""
    if dq == 0.0:
        return mem[e, 0], 0.0
    return num[e, 2] if dq > 0 else -num[e, 2], 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Keep the force [N] of the step; returns the energy dissipated [J], all work of the increment dq [m]."""
    mem[e, 0] = force
    return force * dq


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def at_end(num, e, before, speed, travel):
    """(kinetic force [N] against a speed [m/s], its slopes over speed and travel, both 0); before and travel are not
    used."""
    return num[e, 2] * np.sign(speed), 0.0, 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def state(num, mem, e, q, v):
    """(force of the last step [N], stored energy 0 [J], irreversible part of the slide [m], all of q)."""
    return mem[e, 0], 0.0, q
