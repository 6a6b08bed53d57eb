"""Step solution of points coupled by shear modes of the pieces, by minimisation (compiled).

The slide of point j in a step is xi_j = dq - sum_k psi_kj db_k, and the coordinates b follow kappa
(b + db/2) = psi^T f with the path-mean forces f, so the work of the holder equals the energy of points and
pieces. A force that jumps would leave b oscillating about equilibrium; for such laws kappa
STEP_DAMPING (db - db of the step before) is added, which removes two thirds of the oscillation in a step and
changes a smooth motion to second order. With `problem.relaxes` the pieces relax while the holder
is at rest: kappa (b + db) = psi^T f with the forces after the slide, which dissipates energy as long
as the force increases with the slide.

Both are minima of convex functions if no slope of a point is below 0; Newton's method with a
line search finds them. The forces of some laws may decrease as their points slide, and then several
minima exist: the descent from the extrapolated last steps selects the one to which massless pieces
would jump. `contact` is an `arrays.ShearedPoints`, or a tuple with its fields from `weight` on. `law`
is the module of the point forces; `march.instances` compiles this source for each.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import grow
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..modal_kernels import choose_point_in_bracket
from . import shear_points_kernels as law
from .arrays import FullSlipRow, PointRow, WorkRow

# Largest last Newton step [bond lengths]; half its square is below the tolerance of a march, 1e-11.
LAST_STEP_RATIO = 4e-6
ROUND_OFF = 4e-16  # round-off error of a sum, relative to its largest term
GOAL_SLACK = law.GOAL_SLACK
FORCE_MAY_FALL = law.FORCE_MAY_FALL
STEP_DAMPING = law.STEP_DAMPING
# Largest number of iterations; points that oscillate about one position take up to 100.
MAX_ITERATIONS = 1000 if FORCE_MAY_FALL else 200


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def set_middle_length(v, dt, contact):
    """Set the bond length at the middle of a step from the velocity at its start.

    Parameters
    ----------
    v : float
        Relative velocity at the start of the step [m/s].
    dt : float
        Duration of the step [s].
    contact : arrays.ShearedPoints
    """
    contact.eps[1] = grow(contact.eps[0], v, v, abs(v) * dt / 2, dt / 2, contact.growth)[0]


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def set_slides(q, increments, contact):
    """Compute the slides [m] of the points from those of the holder and the shear modes.

    Parameters
    ----------
    q : float
        Slide of the holder [m].
    increments : ndarray
        (r,) increments of the shear-mode coordinates [m].
    contact : arrays.ShearedPoints
    """
    psi = contact.psi
    points = contact.points
    count = int(contact.count[0])
    r = increments.size
    for j in range(count):
        points[PointRow.SLIDE, j] = q
    # Four modes are processed in one pass, because each pass reads and writes every point.
    for k in range(0, r - 3, 4):
        first = increments[k]
        second = increments[k + 1]
        third = increments[k + 2]
        fourth = increments[k + 3]
        for j in range(count):
            points[PointRow.SLIDE, j] -= (
                psi[k, j] * first
                + psi[k + 1, j] * second
                + psi[k + 2, j] * third
                + psi[k + 3, j] * fourth
            )
    for k in range(r - r % 4, r):
        part = increments[k]
        for j in range(count):
            points[PointRow.SLIDE, j] -= psi[k, j] * part


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def project_onto_modes(row, psi, points, count, out):
    """Project a row of point values onto the shear modes.

    Parameters
    ----------
    row : int
        Row of the point array.
    psi : ndarray
        (r, m) shear modes.
    points : ndarray
        (8, m) see `shear_points_kernels`.
    count : int
        Number of points under load.
    out : ndarray
        (1 + r,) output; the entries from the second on are written.
    """
    r = psi.shape[0]
    for k in range(0, r - 3, 4):
        first = 0.0
        second = 0.0
        third = 0.0
        fourth = 0.0
        for j in range(count):
            value = points[row, j]
            first += psi[k, j] * value
            second += psi[k + 1, j] * value
            third += psi[k + 2, j] * value
            fourth += psi[k + 3, j] * value
        out[k + 1] = first
        out[k + 2] = second
        out[k + 3] = third
        out[k + 4] = fourth
    for k in range(r - r % 4, r):
        total = 0.0
        for j in range(count):
            total += psi[k, j] * points[row, j]
        out[k + 1] = total


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def is_prescribed(problem):
    """Return whether the increment of the holder is prescribed."""
    return problem.relaxes or problem.compliance == 0.0


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def write_gradient(y, problem, contact, out):
    """Write the residual of a step, the gradient of its minimised potential.

    The slide of the holder may be prescribed.

    Parameters
    ----------
    y : ndarray
        (1 + r,) trial solution (dq, db) [m].
    problem : arrays.StepProblem
    contact : arrays.ShearedPoints
    out : ndarray
        (1 + r,) residual [N]; output.

    Returns
    -------
    float
        Friction force [N].
    """
    end_fraction = 1.0 if problem.relaxes else 0.5
    damping = 0.0 if problem.relaxes else STEP_DAMPING
    set_slides(y[0], y[1:], contact)
    force = law.write_forces(problem.law_kind, problem.relaxes, contact)
    project_onto_modes(PointRow.FORCE, contact.psi, contact.points, int(contact.count[0]), out)
    for k in range(contact.kappa.size):
        out[k + 1] = (
            contact.kappa[k]
            * (
                contact.b[k]
                + end_fraction * y[k + 1]
                + damping * (y[k + 1] - contact.last[0, k + 1])
            )
            - out[k + 1]
        )
    out[0] = 0.0
    if not is_prescribed(problem):
        out[0] = (y[0] - problem.free) / problem.compliance + force
    return force


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def write_hessian(problem, contact, hess):
    """Write the Hessian of the minimised potential from the force slopes of the points.

    The forces of the points are overwritten.

    Parameters
    ----------
    problem : arrays.StepProblem
    contact : arrays.ShearedPoints
    hess : ndarray
        (1 + r, 1 + r) output, lower triangle only.
    """
    psi = contact.psi
    points = contact.points
    count = int(contact.count[0])
    is_given = is_prescribed(problem)
    total = 0.0
    for j in range(count):
        total += points[PointRow.SLOPE, j]
    project_onto_modes(PointRow.SLOPE, psi, points, count, hess[0])
    for k in range(contact.kappa.size):
        hess[k + 1, 0] = 0.0 if is_given else -hess[0, k + 1]
        for j in range(count):
            points[PointRow.FORCE, j] = points[PointRow.SLOPE, j] * psi[k, j]
        last = (k + 1) % 4
        for l in range(0, k + 1 - last, 4):
            first = 0.0
            second = 0.0
            third = 0.0
            fourth = 0.0
            for j in range(count):
                value = points[PointRow.FORCE, j]
                first += value * psi[l, j]
                second += value * psi[l + 1, j]
                third += value * psi[l + 2, j]
                fourth += value * psi[l + 3, j]
            hess[k + 1, l + 1] = first
            hess[k + 1, l + 2] = second
            hess[k + 1, l + 3] = third
            hess[k + 1, l + 4] = fourth
        for l in range(k + 1 - last, k + 1):
            dot = 0.0
            for j in range(count):
                dot += points[PointRow.FORCE, j] * psi[l, j]
            hess[k + 1, l + 1] = dot
        hess[k + 1, k + 1] += contact.kappa[k] * (1.0 if problem.relaxes else 0.5 + STEP_DAMPING)
    hess[0, 0] = 1.0 if is_given else 1 / problem.compliance + total


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def find_largest_residual(out, scale):
    """Return the largest residual of the step equations as a force [N].

    The residuals of the shear modes are scaled by the slide per coordinate.
    """
    largest = abs(out[0])
    for k in range(1, out.size):
        largest = max(largest, abs(out[k]) * scale[k])
    return largest


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def is_last_step(p, contact):
    """Return whether a Newton step (1 + r,) changes every slide by less than a limit.

    The limit is LAST_STEP_RATIO bond lengths.

    The curvature of the mean bond force is below its limit over the bond length squared, so a residual of half
    LAST_STEP_RATIO^2 of the limit remains.
    """
    max_slide = abs(p[0])
    for k in range(1, p.size):
        max_slide += contact.full_slip[FullSlipRow.MAX_SLIDE, k] * abs(p[k])
    return (
        max_slide <= LAST_STEP_RATIO * contact.eps[1]
        and contact.full_slip[FullSlipRow.FORCE, 0] > 0.0
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def minimise(problem, contact, goal):
    """Minimise the potential of a step by Newton's method with a line search.

    The potential is the work of the points over their slides xi_j, plus the energy of the pieces,
    sum_k kappa_k (b_k db_k + db_k^2/4), plus (free - dq)^2/(2 compliance) of the holder. Its gradient
    (`write_gradient`) is the equilibrium of holder and pieces in the docstring of the module. It is
    convex if no force of a point decreases with its slide; the minimum is then the only solution.

    The unknowns contact.y = (dq, db) hold the initial guess and the solution. A factorised Hessian
    is reused within a step of the march, until an iteration with it reduces the residual by less
    than a factor of ten. No residual is computed after a Newton step that is short enough.

    Parameters
    ----------
    problem : arrays.StepProblem
        Row 1 of contact.y has the solution of a relaxation, row 0 that of a step.
    contact : arrays.ShearedPoints
    goal : float
        Tolerance of the residual [N].

    Returns
    -------
    force : float
        Friction force [N].
    iterations : int
        Number of iterations, below 0 if the iteration failed.
    """
    which = 1 if problem.relaxes else 0
    compliance = problem.compliance
    y = contact.y[which]
    hess = contact.hess[which]
    gradient = contact.workspace[WorkRow.GRADIENT]
    step = contact.workspace[WorkRow.STEP]
    trial = contact.workspace[WorkRow.TRIAL]
    noise = ROUND_OFF * abs(problem.free) / compliance if compliance > 0.0 else 0.0
    last_residual = np.inf
    smallest = np.inf
    descent = 0.0
    force = 0.0
    is_stale = True
    n_stalled = 0
    for i in range(y.size):
        step[i] = 0.0
    # The first pass evaluates the guess, so that the gradient code appears only once.
    for count in range(MAX_ITERATIONS):
        if count > 0:
            if contact.ready[which] == 0.0:
                write_hessian(problem, contact, hess)
                if not factorise(hess):
                    if not FORCE_MAY_FALL:
                        return force, -count
                    for j in range(int(contact.count[0])):
                        contact.points[PointRow.SLOPE, j] = max(
                            contact.points[PointRow.SLOPE, j], 0.0
                        )
                    write_hessian(problem, contact, hess)
                    if not factorise(hess):
                        return force, -count
                contact.ready[which] = 1.0
                is_stale = False
            for i in range(y.size):
                step[i] = -gradient[i]
            descent = -solve_factorised(hess, step)
            if not is_stale and not is_prescribed(problem) and is_last_step(step, contact):
                for i in range(y.size):
                    y[i] += step[i]
                set_slides(y[0], y[1:], contact)
                return (problem.free - y[0]) / compliance, count
        fraction = 1.0
        low = 0.0
        high = np.inf
        for _ in range(40):
            for i in range(y.size):
                trial[i] = y[i] + fraction * step[i]
            force = write_gradient(trial, problem, contact, gradient)
            slope = 0.0
            for i in range(y.size):
                slope += gradient[i] * step[i]
            if count == 0 or slope <= -0.5 * descent:
                break
            high = fraction
            fraction = choose_point_in_bracket(
                low, high, max(0.1, -descent / (slope - descent)) * fraction
            )
        for i in range(y.size):
            y[i] = trial[i]
        residual = find_largest_residual(gradient, contact.scale)
        if residual <= max(goal, noise + ROUND_OFF * abs(force)):
            return force, count + 1
        if count > 0:
            if residual > 0.1 * last_residual or fraction < 1.0:
                contact.ready[which] = 0.0
            has_stalled = residual >= 0.5 * smallest and not is_stale
            n_stalled = n_stalled + 1 if has_stalled else 0
            is_stale = contact.ready[which] == 1.0
            if n_stalled >= 4 and residual <= GOAL_SLACK * goal:
                return force, count
        last_residual = residual
        smallest = min(smallest, residual)
    return force, -MAX_ITERATIONS


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def accept_step(contact):
    """Update the shear modes after a converged step, and extrapolate the next initial guess."""
    y = contact.y[0]
    last = contact.last
    for k in range(contact.b.size):
        contact.b[k] += y[k + 1]
    for k in range(y.size):
        increment = y[k]
        y[k] = 3 * (increment - last[0, k]) + last[1, k]
        last[1, k] = last[0, k]
        last[0, k] = increment
    contact.ready[:] = 0.0
