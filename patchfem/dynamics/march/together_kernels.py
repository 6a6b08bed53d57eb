"""Newton's method on the forces of all elements in a step, for slow block descent.

With y_i the reduction of coordinate i by the forces over the step, the slides are d = free - R y, and y minimises
sum y_i^2/(2 S_i) + sum Psi_e(d_e), where Psi_e' is the path-mean force of element e and S_i the compliance of a
coordinate [m/N]. `solve_smooth` takes the Newton direction and a line search by the sign of the slope, so it cannot
oscillate between elements that depend on each other, however many there are. `take_newton_step` solves the equations of the
forces instead, which laws without a potential have too.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INTERNAL
from ...friction.laws import elastic_plastic_kernels as law
from ..dense_kernels import factorise, solve_by_elimination, solve_factorised
from .element_arrays import ComplianceRow, ElementRow, FaceRow, LinkRow, ModalRow, PortRow
from .stops_kernels import SET_VALUED


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_element_slide(e, y, elements):
    """Return the slide increment of an element [m] for given coordinate reductions.

    Parameters
    ----------
    e : int
        Number of the element.
    y : (n,) array
        Reductions of the modal coordinates by the forces.
    elements : element_arrays.PortElements

    Returns
    -------
    float
    """
    p = elements.links[LinkRow.PORT, e]
    out = elements.port[PortRow.FREE_SLIDE, p]
    for i in range(y.size):
        out -= elements.rows[p, i] * y[i]
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def find_slope_along_step(t, y, step, trial, elements, dt):
    """Return the slope of the minimised potential along a Newton step.

    It is evaluated at y + t step.

    Parameters
    ----------
    t : float
        Fraction of the step.
    y : (n,) array
        Reductions of the modal coordinates by the forces.
    step : (n,) array
    trial : (n,) array
        Workspace for y + t step.
    elements : element_arrays.PortElements
    dt : float
        Length of the step [s].

    Returns
    -------
    float
    """
    out = 0.0
    for i in range(y.size):
        trial[i] = y[i] + t * step[i]
        out += step[i] * trial[i] / elements.modal[ModalRow.COMPLIANCE, i]
    for e in range(elements.links.shape[1]):
        force = law.mean_force(
            elements.num[e],
            elements.mem[e],
            elements.state[ElementRow.SLIDE, e],
            find_element_slide(e, trial, elements),
            elements.state[ElementRow.BOND_LENGTH, e],
            dt,
        )[0]
        for i in range(y.size):
            out -= step[i] * elements.rows[elements.links[LinkRow.PORT, e], i] * force
    return out


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_newton_equations(y, step, elements, dt, hess):
    """Write the Newton equations of the potential: negative gradient and Hessian at y.

    The forces of the laws are written into elements.state.

    Parameters
    ----------
    y : (n,) array
        Reductions of the modal coordinates by the forces.
    step : (n,) array
    elements : element_arrays.PortElements
    dt : float
        Length of the step [s].
    hess : (n, n) array
        Hessian; it is written.

    Returns
    -------
    float
        Largest change of a force relative to its tolerance.
    """
    n = y.size
    worst = 0.0
    for i in range(n):
        step[i] = -y[i] / elements.modal[ModalRow.COMPLIANCE, i]
        for k in range(n):
            hess[i, k] = 0.0
        hess[i, i] = 1 / elements.modal[ModalRow.COMPLIANCE, i]
    for e in range(elements.links.shape[1]):
        p = elements.links[LinkRow.PORT, e]
        force, slope = law.mean_force(
            elements.num[e],
            elements.mem[e],
            elements.state[ElementRow.SLIDE, e],
            find_element_slide(e, y, elements),
            elements.state[ElementRow.BOND_LENGTH, e],
            dt,
        )
        worst = max(
            worst,
            abs(force - elements.state[ElementRow.FORCE, e])
            / elements.state[ElementRow.FORCE_TOL, e],
        )
        elements.state[ElementRow.FORCE, e] = force
        slope = max(slope, 0.0)
        for i in range(n):
            step[i] += elements.rows[p, i] * force
            for k in range(i + 1):
                hess[i, k] += slope * elements.rows[p, i] * elements.rows[p, k]
    return worst


@njit(error_model="numpy", **NJIT_INTERNAL)
def solve_smooth(elements, dt):
    """Solve the forces of all elements in a step by Newton's method with a line search.

    Returns the number of iterations, negative if it fails.
    """
    y = elements.modal[ModalRow.SCRATCH]
    step = elements.modal[ModalRow.SCRATCH + 1]
    trial = elements.modal[ModalRow.SCRATCH + 2]
    hess = elements.hess
    n = y.size
    count = elements.links.shape[1]
    for i in range(n):
        y[i] = 0.0
        for e in range(count):
            y[i] += (
                elements.modal[ModalRow.COMPLIANCE, i]
                * elements.rows[elements.links[LinkRow.PORT, e], i]
                * elements.state[ElementRow.FORCE, e]
            )
    for n_iterations in range(1, 80):
        worst = write_newton_equations(y, step, elements, dt, hess)
        if n_iterations > 1 and worst <= 0.1:
            return n_iterations
        if not factorise(hess):
            return -n_iterations
        solve_factorised(hess, step)
        start = find_slope_along_step(0.0, y, step, trial, elements, dt)
        low = 0.0
        high = np.inf
        t = 1.0
        for _ in range(40):
            slope = find_slope_along_step(t, y, step, trial, elements, dt)
            if abs(slope) <= 0.1 * abs(start):
                break
            if slope > 0:
                high = t
            else:
                low = t
            t = 0.5 * (low + high) if np.isfinite(high) else 2 * t
        for i in range(n):
            y[i] += t * step[i]
    return -80


@njit(error_model="numpy", **NJIT_INTERNAL)
def write_force_equations(elements, dt, known):
    """Write the Newton equations for the forces of all elements.

    The residual is forces - law(free - beta forces); the matrix is elements.system.
    A resting element has the equation of zero slide, with a small compliance where dependent elements
    could share their force in several ways; a slipping element keeps its force.

    Parameters
    ----------
    elements : element_arrays.PortElements
    dt : float
        Length of the step [s].
    known : bool
        Whether elements.stops has the slides of the faces that stop or rest in the step.
    """
    count = elements.links.shape[1]
    beta = elements.compliances[ComplianceRow.SLIDE]
    face = 0
    for e in range(count):
        p = elements.links[LinkRow.PORT, e]
        dq = elements.port[PortRow.FREE_SLIDE, p]
        own = beta[p, p]
        for k in range(count):
            dq -= beta[p, elements.links[LinkRow.PORT, k]] * elements.state[ElementRow.FORCE, k]
        if elements.num[e, 0] == SET_VALUED:
            holds = elements.state[ElementRow.INCREMENT, e] == 0.0
            goal = 0.0
            if known:
                holds = elements.stops.field[FaceRow.SLIDES_ON, face] == 0.0
                goal = elements.stops.field[FaceRow.SLIDE, face]
            face += 1
            elements.state[ElementRow.RESIDUAL, e] = (dq - goal) / own if holds else 0.0
            for k in range(count):
                elements.system[e, k] = (
                    beta[p, elements.links[LinkRow.PORT, k]] / own if holds else 0.0
                )
            elements.system[e, e] += 1e-9 if holds else 1.0
            continue
        force, slope = law.mean_force(
            elements.num[e],
            elements.mem[e],
            elements.state[ElementRow.SLIDE, e],
            dq,
            elements.state[ElementRow.BOND_LENGTH, e],
            dt,
        )
        elements.state[ElementRow.RESIDUAL, e] = force - elements.state[ElementRow.FORCE, e]
        for k in range(count):
            elements.system[e, k] = slope * beta[p, elements.links[LinkRow.PORT, k]]
        elements.system[e, e] += 1.0


@njit(error_model="numpy", **NJIT_INTERNAL)
def take_newton_step(elements, dt, known):
    """Take a Newton step on the forces of all elements; return whether it succeeds.

    Parameters
    ----------
    elements : element_arrays.PortElements
    dt : float
        Length of the step [s].
    known : bool
        Whether elements.stops has the slides of the faces that stop or rest in the step.

    Returns
    -------
    bool
    """
    force = elements.state[ElementRow.FORCE]
    count = elements.links.shape[1]
    residual = elements.state[ElementRow.RESIDUAL]
    write_force_equations(elements, dt, known)
    # No pivoting is needed, because 1 + slope beta is diagonally dominant
    # for laws that resist the slide.
    if not solve_by_elimination(elements.system, residual):
        return False
    for e in range(count):
        if not np.isfinite(residual[e]):
            return False
    for e in range(count):
        force[e] += residual[e]
        if elements.num[e, 0] == SET_VALUED:
            limit = elements.num[e, 1] if known else elements.state[ElementRow.MAX_FORCE, e]
            force[e] = min(max(force[e], -limit), limit)
    return True
