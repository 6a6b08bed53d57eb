"""Solvers of all elements of a step at once, for where one element after the other gets there too slowly.

With y_i what the forces take from coordinate i over the step, the slides are d = free - R y, and y is the minimum of
sum y_i^2/(2 S_i) + sum Psi_e(d_e), Psi_e' the path-mean force of element e, S_i the give of a coordinate [m/N].
Newton's direction with a search along it that follows the sign of the slope: it cannot be thrown to and fro between
elements that depend on each other, however many there are.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws import plane_kernels as plane
from ..dense_kernels import eliminate, factor, solve
from . import parts_kernels as parts
from .stops_kernels import (
    BETA,
    CLOSE,
    EPS,
    FREE,
    GIVE,
    HOLDS,
    LACK,
    MATE,
    PLACE,
    PORT,
    PULL,
    ROOM,
    SLIDE,
    SLIDES,
)

PLANE = parts.PLANE


@njit(error_model="numpy", **NJIT_INTERNAL)
def slide_of(e, y, j):
    """Slide of element e [m] at y (n,)."""
    p = j.of[PORT, e]
    out = j.port[FREE, p]
    for i in range(y.size):
        out -= j.rows[p, i] * y[i]
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def along(t, y, step, trial, j, dt):
    """Slope of the minimum's function along `step` at y + t step."""
    out = 0.0
    for i in range(y.size):
        trial[i] = y[i] + t * step[i]
        out += step[i] * trial[i] / j.modal[GIVE, i]
    for e in range(j.of.shape[1]):
        force = law.mean_force(
            j.num[e], j.mem[e], j.each[PLACE, e], slide_of(e, trial, j), j.each[EPS, e], dt
        )[0]
        for i in range(y.size):
            out -= step[i] * j.rows[j.of[PORT, e], i] * force
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def slope_at(y, step, j, dt, hess):
    """Newton's equations at y (n,): minus the slope in `step`, the Hessian, the forces of the laws; the largest change
    of a force over its goal."""
    n = y.size
    worst = 0.0
    for i in range(n):
        step[i] = -y[i] / j.modal[GIVE, i]
        for k in range(n):
            hess[i, k] = 0.0
        hess[i, i] = 1 / j.modal[GIVE, i]
    for e in range(j.of.shape[1]):
        p = j.of[PORT, e]
        force, slope = law.mean_force(
            j.num[e], j.mem[e], j.each[PLACE, e], slide_of(e, y, j), j.each[EPS, e], dt
        )
        worst = max(worst, abs(force - j.each[PULL, e]) / j.each[CLOSE, e])
        j.each[PULL, e] = force
        slope = max(slope, 0.0)
        for i in range(n):
            step[i] += j.rows[p, i] * force
            for k in range(i + 1):
                hess[i, k] += slope * j.rows[p, i] * j.rows[p, k]
    return worst


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_smooth(j, dt):
    """Forces of a step in place, from those there are, where every law has a slope.

    Returns the iterations, below 0 where the minimum was not reached.
    """
    y = j.modal[ROOM]
    step = j.modal[ROOM + 1]
    trial = j.modal[ROOM + 2]
    hess = j.hess
    n = y.size
    count = j.of.shape[1]
    for i in range(n):
        y[i] = 0.0
        for e in range(count):
            y[i] += j.modal[GIVE, i] * j.rows[j.of[PORT, e], i] * j.each[PULL, e]
    for turn in range(1, 80):
        worst = slope_at(y, step, j, dt, hess)
        if turn > 1 and worst <= 0.1:
            return turn
        if not factor(hess):
            return -turn
        solve(hess, step)
        begin = along(0.0, y, step, trial, j, dt)
        low = 0.0
        high = np.inf
        t = 1.0
        for _ in range(40):
            here = along(t, y, step, trial, j, dt)
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


@njit(error_model="numpy", **NJIT_INTERNAL)
def equations(j, dt, known):
    """Newton's equations j.system (e, e), row LACK of j.each on the forces of all elements, residual forces -
    law(free - beta forces).

    An element that holds asks for no slide, with a trace of give where elements that depend on each other share their
    force in more ways than one; one that slips keeps its force. known: the slides of those that do not slip all the way
    stand in j.stops instead (`stops_kernels`).
    """
    count = j.of.shape[1]
    beta = j.gives[BETA]
    face = 0
    for e in range(count):
        p = j.of[PORT, e]
        dq = j.port[FREE, p]
        own = beta[p, p]
        for k in range(count):
            dq -= beta[p, j.of[PORT, k]] * j.each[PULL, k]
        if j.num[e, 0] == HOLDS:
            holds = (
                abs(j.each[PULL, e]) < j.num[e, 1] * (1 - 1e-12)
                and abs(j.each[PULL, e]) != j.num[e, 2]
            )
            goal = 0.0
            if known:
                holds = j.stops.field[SLIDES, face] == 0.0
                goal = j.stops.field[SLIDE, face]
            face += 1
            j.each[LACK, e] = (dq - goal) / own if holds else 0.0
            for k in range(count):
                j.system[e, k] = beta[p, j.of[PORT, k]] / own if holds else 0.0
            j.system[e, e] += 1e-9 if holds else 1.0
            continue
        if PLANE:
            if j.of[MATE, e] != e:
                if j.of[MATE, e] > e:
                    in_plane(e, j.of[MATE, e], dq, j)
                continue
        force, slope = law.mean_force(j.num[e], j.mem[e], j.each[PLACE, e], dq, j.each[EPS, e], dt)
        j.each[LACK, e] = force - j.each[PULL, e]
        for k in range(count):
            j.system[e, k] = slope * beta[p, j.of[PORT, k]]
        j.system[e, e] += 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def in_plane(e, f, dx, j):
    """The two of Newton's equations of an element whose directions are e and f; dx [m]: slide of e."""
    beta = j.gives[BETA]
    p = j.of[PORT, e]
    r = j.of[PORT, f]
    dy = j.port[FREE, r]
    for k in range(j.of.shape[1]):
        dy -= beta[r, j.of[PORT, k]] * j.each[PULL, k]
    slide = plane.advance_straight((j.num[e, 2], j.num[e, 3]), (j.mem[e, 3], j.mem[f, 3]), (dx, dy))
    j.each[LACK, e] = slide.mean_x - j.each[PULL, e]
    j.each[LACK, f] = slide.mean_y - j.each[PULL, f]
    for k in range(j.of.shape[1]):
        one = beta[p, j.of[PORT, k]]
        other = beta[r, j.of[PORT, k]]
        j.system[e, k] = slide.slope.xx * one + slide.slope.xy * other
        j.system[f, k] = slide.slope.yx * one + slide.slope.yy * other
    j.system[e, e] += 1.0
    j.system[f, f] += 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def newton_turn(j, dt, known):
    """One Newton step on the forces of all elements at once, without a patch; False where it fails. known: as of
    `equations`."""
    count = j.of.shape[1]
    miss = j.each[LACK]
    equations(j, dt, known)
    # pivots in place: 1 + slope beta leads its row for laws that resist
    if not eliminate(j.system, miss):
        return False
    for e in range(count):
        if not np.isfinite(miss[e]):
            return False
    for e in range(count):
        j.each[PULL, e] += miss[e]
        if j.num[e, 0] == HOLDS:
            j.each[PULL, e] = min(max(j.each[PULL, e], -j.num[e, 1]), j.num[e, 1])
    return True
