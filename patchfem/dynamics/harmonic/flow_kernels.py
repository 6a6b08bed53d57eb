"""A compiled law whose memory is one number z along the samples of a cycle; the text runs with any such law.

The samples and the turning points between them are the nodes of the cycle. To the next one the slide moves straight,
at the speed of the step; forces are those at the nodes, at their speed.
"""

from math import inf

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from ...friction.laws import stretch_kernels as law

TURNS = 60  # of the cycle until its end meets its start


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def cycle(num, q, speed, dt, z, steps, force, slopes):
    """Periodic state of the law with numbers num (1, k) along slides q [m] and speeds [m/s] of M nodes, each dt (M,)
    [s] before the next.

    Out: z (M,), slopes of the step that follows every node over z, over its slide and over its time, steps (3, M);
    force (M,) [N] and its slopes over z and the speed (2, M). The first cycle is that of a virgin contact; Newton's
    steps on the memory at the first node follow, where a cycle forgets any of it.
    """
    n = q.size
    whole = 0.0
    for i in range(n):
        whole += dt[i]
    start = law.relax_stretch(num[0], 0.0, q[0], whole).stretch
    last = inf
    for turn in range(TURNS):
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
        miss = abs(now - start)
        # round-off
        if miss <= 1e-14 * largest * min(1 - kept, 1.0) or (turn > 2 and miss > 0.5 * last):
            break
        last = miss
        start += (now - start) / (1 - kept) if turn and kept < 1 - 1e-9 else now - start
    for i in range(n):
        direction = 1.0 if speed[i] > 0 else -1.0
        rates = law.rate_equation(num[0], z[i], speed[i], direction)
        force[i] = rates.force
        slopes[0, i] = rates.force_by_stretch
        slopes[1, i] = rates.force_by_velocity


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def tangents(steps, out):
    """Derivatives (M, p) of z at the nodes of the periodic state to p parameters, in place of what every step takes of
    them: the increment of the slide, in the last column that of the time; steps as of `cycle`."""
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
