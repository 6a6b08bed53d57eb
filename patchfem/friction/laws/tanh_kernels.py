"""Compiled rate law of eq. 2.4. Twin: `tanh.Rate`.

num: limit [N], v_0 [m/s]; no memory.
"""

from math import copysign, inf, nan, tanh

from ...compiled.inner import njit
from ...compiled.series_kernels import gone
from ..flags_kernels import LEAN, closed, knee, middle

__all__ = ["ahead", "along", "at_end", "begin", "closed", "commit", "finish", "knee", "layer", "mean", "middle",
           "rate", "share", "shown", "state"]

GROWS, OF_SPEED, MIXED = (1.0, 0.0, -1.0), True, False  # of `share`, as `protocol` has it


@njit(error_model="numpy", **LEAN)
def creep(speed, limit, reference):
    """(force [N], slope over the speed [N s/m]) of eq. 2.4 at a speed [m/s]; limit [N], reference: v_0 [m/s]."""
    part = tanh(speed / reference)
    return limit * part, limit * (1 - part) * (1 + part) / reference


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] of eq. 2.4 at the mean speed of a step dq [m] in dt > 0 [s], and its slope over dq [N/m]."""
    force, slope = creep(dq / dt, num[e, 1], num[e, 2])
    return force, slope / dt


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Energy dissipated [J] over the increment dq [m]: all work of the force [N]; there is no memory to move."""
    return force * dq


@njit(error_model="numpy", **LEAN)
def at_end(num, e, before, speed, travel):
    """(force [N], its slope over the speed [N s/m], over the travel [N/m]) at a speed [m/s]."""
    force, slope = creep(speed, num[e, 1], num[e, 2])
    return force, slope, 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force at the speed v [m/s] [N], stored energy 0 [J], irreversible part of the slide [m], all of q)."""
    return creep(v, num[e, 1], num[e, 2])[0], 0.0, q


@njit(error_model="numpy", **LEAN)
def begin(num, mem, way, y):
    """Nothing to set; the path [m] to the next kink is infinite."""
    return inf


@njit(error_model="numpy", **LEAN)
def rate(num, mem, turn, dq, v, y, out):
    """Force [N] of eq. 2.4 at the speed v [m/s]; there are no states."""
    return creep(v, num[0, 1], num[0, 2])[0]


@njit(error_model="numpy", **LEAN)
def shown(num, mem, turn, dq, q, v, y):
    """(force at the speed v [m/s] [N], stored energy 0 [J], irreversible part of the slide [m], all of q)."""
    return creep(v, num[0, 1], num[0, 2])[0], 0.0, q


@njit(error_model="numpy", **LEAN)
def finish(num, mem, turn, dq, v, y):
    """There is no memory; nan, as only the work tells what is dissipated."""
    return nan


@njit(error_model="numpy", **LEAN)
def layer(num):
    """Speed [m/s] over which the force turns with the slide: v_0."""
    return num[0, 2]


@njit(error_model="numpy", **LEAN)
def ahead(num, mem, way):
    """The four numbers of `along`: 1/v_0 [s/m], no constant force, limit [N], nothing mixed."""
    return 1 / num[0, 2], 0.0, num[0, 1], 0.0


@njit(error_model="numpy", fastmath={"contract"}, **LEAN)
def share(y):
    """tanh y without branches: g/(2 - g) with g = 1 - exp(-2 |y|)."""
    g = gone(2 * abs(y))
    return copysign(g / (2 - g), y)


@njit(error_model="numpy", fastmath={"contract"}, **LEAN)
def along(scale, none, limit, nothing, dq, v):
    """Force [N] of eq. 2.4 at the speed v [m/s] without branches."""
    return limit * share(scale * v)
