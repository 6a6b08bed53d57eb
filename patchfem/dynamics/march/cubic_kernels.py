"""Compiled spring of restoring force k_3 q^3, with the signature of a law; num: k_3 [N/m3].

The path-mean force is (V(q + dq) - V(q))/dq of its potential V, so it neither makes nor loses energy at any step.
"""

from numba import njit

from ...friction.flags_kernels import LEAN, middle

__all__ = ["commit", "mean", "middle", "state"]


@njit(error_model="numpy", **LEAN)
def mean(num, mem, e, q, dq, eps, dt):
    """Path-mean force [N] and slope [N/m]."""
    b = q + dq
    return 0.25 * num[e, 1] * (b + q) * (b * b + q * q), 0.25 * num[e, 1] * (3 * b * b + 2 * b * q + q * q)


@njit(error_model="numpy", **LEAN)
def commit(num, mem, e, dq, force, v0, v1, dt, eps):
    """Nothing is lost [J]."""
    return 0.0


@njit(error_model="numpy", **LEAN)
def state(num, mem, e, q, v):
    """(force [N], stored energy [J], slide [m])."""
    return num[e, 1] * q ** 3, 0.25 * num[e, 1] * q ** 4, q
