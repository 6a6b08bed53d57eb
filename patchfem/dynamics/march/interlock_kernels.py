"""Compiled spring k lambda/(2 pi) sin(2 pi q/lambda) of interlocking peaks, with the signature of a law; num: k [N/m],
wavelength lambda [m].

The path-mean force is (V(q + dq) - V(q))/dq of its potential V, so it neither makes nor loses energy at any step.
"""

from math import cos, pi, sin

from numba import njit

from ...friction.flags_kernels import LEAN, middle

__all__ = ["commit", "mean", "middle", "state"]


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] and slope [N/m]."""
    turn = 2 * pi / num[e, 2]
    half, centre = 0.5 * turn * dq, turn * (q + 0.5 * dq)
    if abs(half) < 1e-4:
        ratio, bend = 1 - half * half / 6, -half / 3
    else:
        ratio = sin(half) / half
        bend = (cos(half) - ratio) / half
    force = num[e, 1] / turn * sin(centre) * ratio
    return force, 0.5 * num[e, 1] * (cos(centre) * ratio + sin(centre) * bend)


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Nothing is lost [J]."""
    return 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], slide [m])."""
    turn = 2 * pi / num[e, 2]
    return num[e, 1] / turn * sin(turn * q), 2 * num[e, 1] * (sin(0.5 * turn * q) / turn) ** 2, q
