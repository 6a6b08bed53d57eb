"""Periodic stretch of a friction law with one state along a cycle (compiled).

From one node of the cycle to the next the slide changes linearly; the force is evaluated at the nodes.
"""

from math import inf

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from ...friction.laws import stretch_kernels as law

MAX_STRETCH_CYCLES = 60  # largest number of cycles until the stretch is periodic
CLOSED_RATIO = 1e-14  # change over a cycle, relative to the stretch, that is round-off
MIN_FADING = 1e-9  # smallest part of a stretch that fades in a cycle for Newton's method


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def solve_cycle(numbers, q, velocity, dt, stretch, steps, force, slopes):
    """Find the periodic stretch that a cycle from an unstretched contact reaches.

    From the second cycle on, Newton's method corrects the stretch at the first node, if it fades within a cycle.

    Parameters
    ----------
    numbers : (k,) array
        Numbers of the law.
    q, velocity, dt : (M,) array
        Slides [m], velocities [m/s] and times to the next node [s].
    stretch : (M,) array
        It is written [m].
    steps : (3, M) array
        Derivatives of the next stretch by stretch, slide and time, which are written.
    force, slopes : (M,), (2, M) array
        Force [N] and its derivatives by stretch and velocity, which are written.
    """
    n = q.size
    start = law.relax_stretch(numbers, 0.0, q[0], dt.sum()).stretch
    last = inf
    for cycle in range(MAX_STRETCH_CYCLES):
        now = start
        kept = 1.0
        largest = abs(start)
        for i in range(n):
            stretch[i] = now
            now, steps[0, i], steps[1, i], steps[2, i] = law.relax_stretch(
                numbers, now, q[(i + 1) % n] - q[i], dt[i]
            )
            kept *= steps[0, i]
            largest = max(largest, abs(now))

        # The cycle is closed if the gap is small beside the part of the stretch that fades in a cycle.
        gap = abs(now - start)
        is_closed = gap <= CLOSED_RATIO * largest * min(1 - kept, 1.0)
        if is_closed or (cycle > 2 and gap > 0.5 * last):
            break

        last = gap
        # Newton step of end(start) - start, with the derivative `kept` of end.
        fades = cycle > 0 and kept < 1 - MIN_FADING
        start += (now - start) / (1 - kept) if fades else now - start

    for i in range(n):
        rates = law.rate_equation(
            numbers, stretch[i], velocity[i], 1.0 if velocity[i] > 0 else -1.0
        )
        force[i] = rates.force
        slopes[0, i] = rates.force_by_stretch
        slopes[1, i] = rates.force_by_velocity
