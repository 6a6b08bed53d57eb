"""Periodic state of a friction law with one memory variable along a cycle (compiled).

The samples and the reversals between them are the nodes of the cycle. From one node to the
next the slide changes linearly; forces are evaluated at the nodes, with the velocity there.
"""

from math import inf

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import stretch_kernels as law

# Largest number of cycles in the iteration to a periodic memory.
MAX_CYCLES = 60


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def solve_cycle(num, q, speed, dt, z, steps, force, slopes):
    """Solve for the periodic state of a friction law with one memory variable over a cycle.

    The first cycle starts from a virgin contact; Newton steps on the memory at the first node
    follow if the memory fades within a cycle.

    Parameters
    ----------
    num : ndarray
        (1, k) numbers of the law.
    q, speed, dt : ndarray
        (M,) slides [m], velocities [m/s] and times [s] to the next node.
    z : ndarray
        (M,) becomes the memory.
    steps : ndarray
        (3, M) becomes the derivatives of the next z with respect to z, slide and time.
    force : ndarray
        (M,) becomes the force [N].
    slopes : ndarray
        (2, M) becomes the derivatives of the force with respect to z and velocity.
    """
    n = q.size
    duration = 0.0
    for i in range(n):
        duration += dt[i]
    start = law.relax_stretch(num[0], 0.0, q[0], duration).stretch
    last = inf
    for cycle in range(MAX_CYCLES):
        now = start
        kept = 1.0
        largest = abs(start)
        for i in range(n):
            z[i] = now
            now, steps[0, i], steps[1, i], steps[2, i] = law.relax_stretch(
                num[0], now, q[(i + 1) % n] - q[i], dt[i]
            )
            kept *= steps[0, i]
            largest = max(largest, abs(now))
        mismatch = abs(now - start)
        # The iteration ends when the periodicity error has reached
        # round-off or no longer decreases.
        if mismatch <= 1e-14 * largest * min(1 - kept, 1.0) or (
            cycle > 2 and mismatch > 0.5 * last
        ):
            break
        last = mismatch
        start += (now - start) / (1 - kept) if cycle and kept < 1 - 1e-9 else now - start
    for i in range(n):
        direction = 1.0 if speed[i] > 0 else -1.0
        rates = law.rate_equation(num[0], z[i], speed[i], direction)
        force[i] = rates.force
        slopes[0, i] = rates.force_by_stretch
        slopes[1, i] = rates.force_by_velocity


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def solve_tangents(steps, out):
    """Solve for the derivatives (M, p) of the periodic memory with respect to p parameters.

    out: on entry the derivative of the slide increment of every step, in the last
    column that of the time increment; on return the derivatives of the memory.
    """
    n, p = out.shape
    for k in range(p):
        by = 2 if k == p - 1 else 1
        kept = 1.0
        now = 0.0
        for i in range(n):
            now = steps[0, i] * now + steps[by, i] * out[i, k]
            kept *= steps[0, i]
        now = now / (1 - kept) if kept < 1 - 1e-12 else 0.0
        for i in range(n):
            taken = out[i, k]
            out[i, k] = now
            now = steps[0, i] * now + steps[by, i] * taken
