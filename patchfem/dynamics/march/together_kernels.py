"""Newton's method on all elements of a step, for slow convergence of the block descent.

With y_i what the forces take from coordinate i over the step, the slides are d = free - R y, and y minimises
sum y_i^2/(2 S_i) + sum Psi_e(d_e), where Psi_e' is the path-mean force of element e and S_i the give of a coordinate [m/N].
`solve_smooth` takes Newton's direction and searches along it by the sign of the slope, so it cannot be thrown to and fro
between elements that depend on each other, however many there are. `newton_step` solves the equations of the forces
instead, which laws without a potential have too.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ...friction.laws import plane_kernels as plane
from ..dense_kernels import factorise, solve_by_elimination, solve_factorised
from . import parts_kernels as parts
from .stops_kernels import (
    BETA,
    BOND_LENGTH,
    COORDINATE_GIVE,
    ELEMENT_FORCE,
    ELEMENT_RESIDUAL,
    ELEMENT_SLIDE,
    FORCE_TOL,
    FREE_SLIDE,
    INCREMENT,
    MATE,
    MAX_FORCE,
    MODAL_SCRATCH,
    PORT,
    SET_VALUED,
    SLIDE,
    SLIDES_ON,
)

HAS_PLANES = parts.HAS_PLANES


@njit(error_model="numpy", **NJIT_INTERNAL)
def element_slide(e, y, faces):
    """Return the slide of an element [m] at y.

    Parameters
    ----------
    e : int
        Number of the element.
    y : (n,) array
        What the forces take from the coordinates.
    faces : interfaces.arrays.PortElements

    Returns
    -------
    float
    """
    p = faces.of[PORT, e]
    out = faces.port[FREE_SLIDE, p]
    for i in range(y.size):
        out -= faces.rows[p, i] * y[i]
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def slope_along(t, y, step, trial, faces, dt):
    """Return the slope of the function that is minimised along a step, at y + t step.

    Parameters
    ----------
    t : float
        Factor of the step.
    y : (n,) array
        What the forces take from the coordinates.
    step : (n,) array
    trial : (n,) array
        Space for y + t step.
    faces : interfaces.arrays.PortElements
    dt : float
        Length of the step [s].

    Returns
    -------
    float
    """
    out = 0.0
    for i in range(y.size):
        trial[i] = y[i] + t * step[i]
        out += step[i] * trial[i] / faces.modal[COORDINATE_GIVE, i]
    for e in range(faces.of.shape[1]):
        force = law.mean_force(
            faces.num[e],
            faces.mem[e],
            faces.each[ELEMENT_SLIDE, e],
            element_slide(e, trial, faces),
            faces.each[BOND_LENGTH, e],
            dt,
        )[0]
        for i in range(y.size):
            out -= step[i] * faces.rows[faces.of[PORT, e], i] * force
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def newton_equations(y, step, faces, dt, hess):
    """Write minus the gradient at y into `step`, and the Hessian.

    The forces of the laws are written into faces.each.

    Parameters
    ----------
    y : (n,) array
        What the forces take from the coordinates.
    step : (n,) array
    faces : interfaces.arrays.PortElements
    dt : float
        Length of the step [s].
    hess : (n, n) array
        Hessian; it is written.

    Returns
    -------
    float
        Largest change of a force over its tolerance.
    """
    n = y.size
    worst = 0.0
    for i in range(n):
        step[i] = -y[i] / faces.modal[COORDINATE_GIVE, i]
        for k in range(n):
            hess[i, k] = 0.0
        hess[i, i] = 1 / faces.modal[COORDINATE_GIVE, i]
    for e in range(faces.of.shape[1]):
        p = faces.of[PORT, e]
        force, slope = law.mean_force(
            faces.num[e],
            faces.mem[e],
            faces.each[ELEMENT_SLIDE, e],
            element_slide(e, y, faces),
            faces.each[BOND_LENGTH, e],
            dt,
        )
        worst = max(worst, abs(force - faces.each[ELEMENT_FORCE, e]) / faces.each[FORCE_TOL, e])
        faces.each[ELEMENT_FORCE, e] = force
        slope = max(slope, 0.0)
        for i in range(n):
            step[i] += faces.rows[p, i] * force
            for k in range(i + 1):
                hess[i, k] += slope * faces.rows[p, i] * faces.rows[p, k]
    return worst


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_smooth(faces, dt):
    """Solve the forces of a step by Newton's method.

    Returns the iterations, negative if it fails.
    """
    y = faces.modal[MODAL_SCRATCH]
    step = faces.modal[MODAL_SCRATCH + 1]
    trial = faces.modal[MODAL_SCRATCH + 2]
    hess = faces.hess
    n = y.size
    count = faces.of.shape[1]
    for i in range(n):
        y[i] = 0.0
        for e in range(count):
            y[i] += (
                faces.modal[COORDINATE_GIVE, i]
                * faces.rows[faces.of[PORT, e], i]
                * faces.each[ELEMENT_FORCE, e]
            )
    for turn in range(1, 80):
        worst = newton_equations(y, step, faces, dt, hess)
        if turn > 1 and worst <= 0.1:
            return turn
        if not factorise(hess):
            return -turn
        solve_factorised(hess, step)
        begin = slope_along(0.0, y, step, trial, faces, dt)
        low = 0.0
        high = np.inf
        t = 1.0
        for _ in range(40):
            here = slope_along(t, y, step, trial, faces, dt)
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
def force_equations(faces, dt, known):
    """Write the Newton equations of the residual forces - law(free - beta forces) into faces.system.

    An element that holds has the equation of no slide, with a trace of give where elements that depend on each
    other could share their force in several ways; an element that slips keeps its force.

    Parameters
    ----------
    faces : interfaces.arrays.PortElements
    dt : float
        Length of the step [s].
    known : bool
        Whether the slides of the faces that do not slip all the way are known, in faces.stops.
    """
    count = faces.of.shape[1]
    beta = faces.gives[BETA]
    face = 0
    for e in range(count):
        p = faces.of[PORT, e]
        dq = faces.port[FREE_SLIDE, p]
        own = beta[p, p]
        for k in range(count):
            dq -= beta[p, faces.of[PORT, k]] * faces.each[ELEMENT_FORCE, k]
        if faces.num[e, 0] == SET_VALUED:
            holds = faces.each[INCREMENT, e] == 0.0
            goal = 0.0
            if known:
                holds = faces.stops.field[SLIDES_ON, face] == 0.0
                goal = faces.stops.field[SLIDE, face]
            face += 1
            faces.each[ELEMENT_RESIDUAL, e] = (dq - goal) / own if holds else 0.0
            for k in range(count):
                faces.system[e, k] = beta[p, faces.of[PORT, k]] / own if holds else 0.0
            faces.system[e, e] += 1e-9 if holds else 1.0
            continue
        if HAS_PLANES:
            if faces.of[MATE, e] != e:
                if faces.of[MATE, e] > e:
                    plane_equations(e, faces.of[MATE, e], dq, faces)
                continue
        force, slope = law.mean_force(
            faces.num[e],
            faces.mem[e],
            faces.each[ELEMENT_SLIDE, e],
            dq,
            faces.each[BOND_LENGTH, e],
            dt,
        )
        faces.each[ELEMENT_RESIDUAL, e] = force - faces.each[ELEMENT_FORCE, e]
        for k in range(count):
            faces.system[e, k] = slope * beta[p, faces.of[PORT, k]]
        faces.system[e, e] += 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def plane_equations(e, f, dx, faces):
    """Write the two Newton equations of an element in a plane.

    Parameters
    ----------
    e : int
        Number of the element.
    f : int
        Number of the element of its second direction.
    dx : float
        Increment of the slide of e [m].
    faces : interfaces.arrays.PortElements
    """
    beta = faces.gives[BETA]
    p = faces.of[PORT, e]
    r = faces.of[PORT, f]
    dy = faces.port[FREE_SLIDE, r]
    for k in range(faces.of.shape[1]):
        dy -= beta[r, faces.of[PORT, k]] * faces.each[ELEMENT_FORCE, k]
    slide = plane.advance_straight(
        (faces.num[e, 2], faces.num[e, 3]), (faces.mem[e, 3], faces.mem[f, 3]), (dx, dy)
    )
    faces.each[ELEMENT_RESIDUAL, e] = slide.mean_x - faces.each[ELEMENT_FORCE, e]
    faces.each[ELEMENT_RESIDUAL, f] = slide.mean_y - faces.each[ELEMENT_FORCE, f]
    for k in range(faces.of.shape[1]):
        one = beta[p, faces.of[PORT, k]]
        other = beta[r, faces.of[PORT, k]]
        faces.system[e, k] = slide.slope.xx * one + slide.slope.xy * other
        faces.system[f, k] = slide.slope.yx * one + slide.slope.yy * other
    faces.system[e, e] += 1.0
    faces.system[f, f] += 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def newton_step(faces, dt, known):
    """Take a Newton step on the forces of all elements at once; return whether it succeeds.

    Parameters
    ----------
    faces : interfaces.arrays.PortElements
    dt : float
        Length of the step [s].
    known : bool
        Whether the slides of the faces that do not slip all the way are known, in faces.stops.

    Returns
    -------
    bool
    """
    count = faces.of.shape[1]
    miss = faces.each[ELEMENT_RESIDUAL]
    force_equations(faces, dt, known)
    # no row exchanges are needed: 1 + slope beta dominates its row for laws that resist the slide
    if not solve_by_elimination(faces.system, miss):
        return False
    for e in range(count):
        if not np.isfinite(miss[e]):
            return False
    for e in range(count):
        faces.each[ELEMENT_FORCE, e] += miss[e]
        if faces.num[e, 0] == SET_VALUED:
            limit = faces.num[e, 1] if known else faces.each[MAX_FORCE, e]
            faces.each[ELEMENT_FORCE, e] = min(max(faces.each[ELEMENT_FORCE, e], -limit), limit)
    return True
