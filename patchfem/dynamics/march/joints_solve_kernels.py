"""All elements of a step at once, where every law has a slope: a convex problem in the modes that move them.

With y_i what the forces take from coordinate i over the step, the slides are d = free - R y, and y is the minimum of
sum y_i^2/(2 S_i) + sum Psi_e(d_e), Psi_e' the path-mean force of element e, S_i the give of a coordinate [m/N].
Newton's direction with a search along it that follows the sign of the slope: it cannot be thrown to and fro between
elements that depend on each other, however many there are.
"""

import numpy as np
from numba import njit

from ...friction.flags_kernels import LEAN
from .joint_laws_kernels import element_mean
from .step_kernels import cholesky_solve


@njit(error_model="numpy", **LEAN)
def slide_of(e, y, free, rows_of, ports):
    """Slide of element e [m] at y (n,)."""
    out = free[ports[e]]
    for i in range(y.size):
        out -= rows_of[ports[e], i] * y[i]
    return out


@njit(error_model="numpy", **LEAN)
def along(t, y, step, trial, free, rows_of, ports, kinds, num, mem, q, eps, dt, give):
    """Slope of the minimum's function along `step` at y + t step."""
    out = 0.0
    for i in range(y.size):
        trial[i] = y[i] + t * step[i]
        out += step[i] * trial[i] / give[i]
    for e in range(kinds.size):
        force = element_mean(kinds[e], num, mem, e, q[e], slide_of(e, trial, free, rows_of, ports), eps[e], dt)[0]
        for i in range(y.size):
            out -= step[i] * rows_of[ports[e], i] * force
    return out


@njit(error_model="numpy", **LEAN)
def solve_smooth(free, rows_of, ports, kinds, num, mem, q, eps, dt, give, goal, forces, y, step, trial, hess):
    """Forces (e,) of a step in place, from those there are; y, step, trial (n,), hess (n, n): room; goal (e,) [N].

    Returns the iterations, below 0 where the minimum was not reached.
    """
    n, count = y.size, kinds.size
    for i in range(n):
        y[i] = 0.0
        for e in range(count):
            y[i] += give[i] * rows_of[ports[e], i] * forces[e]
    for turn in range(1, 80):
        for i in range(n):
            step[i] = -y[i] / give[i]
            for k in range(n):
                hess[i, k] = 0.0
            hess[i, i] = 1 / give[i]
        worst = 0.0
        for e in range(count):
            force, slope = element_mean(kinds[e], num, mem, e, q[e], slide_of(e, y, free, rows_of, ports), eps[e], dt)
            worst = max(worst, abs(force - forces[e]) / goal[e])
            forces[e] = force
            slope = max(slope, 0.0)
            for i in range(n):
                step[i] += rows_of[ports[e], i] * force
                for k in range(i + 1):
                    hess[i, k] += slope * rows_of[ports[e], i] * rows_of[ports[e], k]
        if turn > 1 and worst <= 0.1:
            return turn
        if not cholesky_solve(hess, step):
            return -turn
        begin = along(0.0, y, step, trial, free, rows_of, ports, kinds, num, mem, q, eps, dt, give)
        low, high, t = 0.0, np.inf, 1.0
        for _ in range(40):
            here = along(t, y, step, trial, free, rows_of, ports, kinds, num, mem, q, eps, dt, give)
            if abs(here) <= 0.1 * abs(begin):
                break
            if here > 0:
                high = t
            else:
                low = t
            t = 0.5 * (low + high) if np.isfinite(high) else 2 * t
        for i in range(n):
            y[i] += t * step[i]
    return -80
