"""What points behind shear modes answer to their slides where each is a list of bonds: any order and reading of 2.17.

Every point has a path, a damage and, where bonds grow, a bond length of its own, at its own speed. Its weight is its
friction limit [N]. Rows of `points` besides SLIDE, FORCE, SLOPE: the speed [m/s] that its bonds grow at in the step,
the mean speed of the last one, slide and force of the trial before, nan before the first. Twin:
`friction.bonds.quadrature.Quadrature`, point by point.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.list_rows_kernels import CLOCK, STATUS
from ...friction.flags_kernels import NJIT_NO_REFCOUNT
from .list_kernels import answer
from .shear_points_kernels import FORCE, LOAD, SLIDE, SLOPE

# sums change their rule with the length of a step, by 1e-8 and less
SLACK = 1e4
FALLS = True
CALM = 1 / 16
PACE, WENT, TRIED, PULLED = range(4)  # of `points`

__all__ = ["CALM", "FALLS", "FORCE", "SLACK", "SLIDE", "SLOPE", "respond"]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def look_at(j, c):
    """Copy the numbers of the list of point j to `now` and `status`."""
    for i in range(c.now.size):
        c.now[i] = c.nows[j, i]
    for i in range(c.status.size):
        c.status[i] = c.statuses[j, i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def keep(j, c):
    """Copy `now` and `status` to the numbers of the list of point j."""
    for i in range(c.now.size):
        c.nows[j, i] = c.now[i]
    for i in range(c.status.size):
        c.statuses[j, i] = c.status[i]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def pressure_at(x, pattern):
    """Pressure of the lower piece at the place x [m], linear between the places of its pattern (2, k), 0 beyond."""
    last = pattern.shape[1] - 1
    if x < pattern[0, 0] or x > pattern[0, last]:
        return 0.0
    low = 0
    high = last
    while high - low > 1:
        middle = (low + high) // 2
        if pattern[0, middle] > x:
            high = middle
        else:
            low = middle
    part = (x - pattern[0, low]) / (pattern[0, high] - pattern[0, low])
    return (1 - part) * pattern[1, low] + part * pattern[1, high]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def varies(c):
    """Whether the pressure of a point changes in a run."""
    return c.pressed.shape[1] + c.pattern.shape[1] > 0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def borne(j, c):
    """Pressure of point j as it stands, after the step where the load changes."""
    if c.pattern.shape[1] > 0:
        return pressure_at(c.places[j] + c.nows[j, CLOCK.displacement], c.pattern)
    return c.pressed[1, j] / c.points[LOAD, j] if c.pressed.shape[1] > 0 else 1.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def begin(dt, c):
    """Begin the solve of a step of dt [s]: its bonds form under the mean pressure of both its ends, on the lower piece
    that half way along the slide of the step before."""
    c.time[0] = dt
    for j in range(c.points.shape[1]):
        c.points[TRIED, j] = np.nan
    if c.pattern.shape[1] > 0:
        for j in range(int(c.count[0])):
            c.statuses[j, STATUS.pressure] = pressure_at(
                c.places[j] + c.nows[j, CLOCK.displacement] + 0.5 * c.points[SLIDE, j], c.pattern
            )
    elif c.pressed.shape[1] > 0:
        for j in range(int(c.count[0])):
            c.statuses[j, STATUS.pressure] = (
                0.5 * (c.pressed[0, j] + c.pressed[1, j]) / c.points[LOAD, j]
            )


@njit(
    error_model="numpy", forceinline=False, **NJIT_NO_REFCOUNT
)  # else that of its caller goes on to all that it calls
def respond(kind, ending, c):
    """Write path-mean force [N] and slope [N/m] of every point at its slide; returns the friction force [N]."""
    points = c.points
    dt = c.time[0]
    force = 0.0
    for j in range(int(c.count[0])):
        xi = points[SLIDE, j]
        status = c.statuses[j]
        is_empty = status[STATUS.head] == status[STATUS.end]
        is_unpressed = status[STATUS.pressure] == 0.0 and status[STATUS.initial_pressure] == 0.0
        if is_empty and is_unpressed:
            points[FORCE, j] = points[SLOPE, j] = 0.0
            continue
        look_at(j, c)
        f, s = answer(xi, c, points[PACE, j], dt)
        # many bonds at one place: a mean that ends among them is steeper than s tells
        if xi != points[TRIED, j]:
            steep = (f - points[PULLED, j]) / (xi - points[TRIED, j])
            s = steep if steep > s else s
        points[TRIED, j] = xi
        points[PULLED, j] = f
        points[FORCE, j] = c.weight[j] * f
        points[SLOPE, j] = c.weight[j] * s
        force += points[FORCE, j]
    return force
