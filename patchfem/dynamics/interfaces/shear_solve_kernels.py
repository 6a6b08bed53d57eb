"""Step of points behind shear modes of the pieces, by a minimisation (compiled).

The slide of point j in a step is xi_j = dq - sum_k psi_kj db_k, and the coordinates b follow kappa
(b + db/2) = psi^T f with the path-mean forces f, so the work of the holder is what points and
pieces take. A force that jumps would leave b oscillating about the balance; for such laws kappa
STEP_DAMPING (db - db of the step before) is added, which removes two thirds of it in a step and
changes a smooth motion to second order. With `ending` the pieces spring back while the holder
stands: kappa (b + db) = psi^T f with the forces after the slide, which only loses energy as long
as a force grows with the slide.

Both are minima of convex functions where no slope of a point is below 0; Newton's method with a
line search finds them. The forces of some laws may decrease as their points slide, and then several
minima exist: the one found lies downhill from where the last steps lead, to which pieces without
mass would jump. `contact` is an `arrays.ShearedPoints`, or a tuple with its fields from `weight` on. `law`
has the forces of the points; `march.instances` compiles this text for each.
"""

import numpy as np

from ...compiled.jit import njit
from ...friction.bonds.point_kernels import grow
from ...friction.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..dense_kernels import factorise, solve_factorised
from ..modal_kernels import safe_point
from . import shear_points_kernels as law

FORCE = law.FORCE
SLIDE = law.SLIDE
SLOPE = law.SLOPE
# rows of `ShearedPoints.workspace`
GRADIENT = 0
STEP = 1
TRIAL = 2
# step over the bond length, below which Newton's method ends: half its square is below the goal of a march, 1e-11
LAST_STEP_RATIO = 4e-6
GOAL_SLACK = law.GOAL_SLACK
FORCE_MAY_FALL = law.FORCE_MAY_FALL
STEP_DAMPING = law.STEP_DAMPING
# largest number of iterations; points that oscillate about one position take up to 100
MAX_ITERATIONS = 1000 if FORCE_MAY_FALL else 200


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def set_middle_length(v, dt, contact):
    """Set the bond length in the middle of a step.

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
def set_slides(q, moved, contact):
    """Write the slides of the points [m].

    Parameters
    ----------
    q : float
        Slide of the holder [m].
    moved : ndarray
        (r,) increments of the coordinates [m].
    contact : arrays.ShearedPoints
    """
    psi = contact.psi
    points = contact.points
    count = int(contact.count[0])
    r = moved.size
    for j in range(count):
        points[SLIDE, j] = q
    for k in range(0, r - 3, 4):  # four modes in one pass: a pass reads and writes every point
        one = moved[k]
        two = moved[k + 1]
        three = moved[k + 2]
        four = moved[k + 3]
        for j in range(count):
            points[SLIDE, j] -= (
                psi[k, j] * one + psi[k + 1, j] * two + psi[k + 2, j] * three + psi[k + 3, j] * four
            )
    for k in range(r - r % 4, r):
        part = moved[k]
        for j in range(count):
            points[SLIDE, j] -= psi[k, j] * part


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def project_onto_modes(row, psi, points, count, out):
    """Write psi^T of a row of the points.

    Parameters
    ----------
    row : int
        Row of the points.
    psi : ndarray
        (r, m) shear modes.
    points : ndarray
        (8, m) see `shear_points_kernels`.
    count : int
        Number of points under load.
    out : ndarray
        (1 + r,); the entries from the second on are written.
    """
    r = psi.shape[0]
    for k in range(0, r - 3, 4):
        one = 0.0
        two = 0.0
        three = 0.0
        four = 0.0
        for j in range(count):
            value = points[row, j]
            one += psi[k, j] * value
            two += psi[k + 1, j] * value
            three += psi[k + 2, j] * value
            four += psi[k + 3, j] * value
        out[k + 1] = one
        out[k + 2] = two
        out[k + 3] = three
        out[k + 4] = four
    for k in range(r - r % 4, r):
        total = 0.0
        for j in range(count):
            total += psi[k, j] * points[row, j]
        out[k + 1] = total


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def write_gradient(y, free, beta, kind, ending, contact, out):
    """Write the gradient of the function that a step minimises: the residual of the step.

    With beta = 0 or `ending` the slide of the holder is prescribed.

    Parameters
    ----------
    y : ndarray
        (1 + r,) trial solution (dq, db) [m].
    free : float
        Increment without friction [m].
    beta : float
        Compliance of the modes in the step [m/N].
    kind : int
        Kind of the law of the points, PLASTIC or POINTS.
    ending : bool
        Whether the pieces spring back while the holder stands.
    contact : arrays.ShearedPoints
    out : ndarray
        (1 + r,) residual [N], which is written.

    Returns
    -------
    float
        Friction force [N].
    """
    part = 1.0 if ending else 0.5
    calm = 0.0 if ending else STEP_DAMPING
    set_slides(y[0], y[1:], contact)
    force = law.write_forces(kind, ending, contact)
    project_onto_modes(FORCE, contact.psi, contact.points, int(contact.count[0]), out)
    for k in range(contact.kappa.size):
        out[k + 1] = (
            contact.kappa[k]
            * (contact.b[k] + part * y[k + 1] + calm * (y[k + 1] - contact.last[0, k + 1]))
            - out[k + 1]
        )
    out[0] = 0.0 if ending or beta == 0.0 else (y[0] - free) / beta + force
    return force


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def write_hessian(beta, ending, contact, hess):
    """Write the Hessian of a step from the slopes of the points.

    It overwrites the forces of the points.

    Parameters
    ----------
    beta : float
        Compliance of the modes in the step [m/N].
    ending : bool
        Whether the pieces spring back while the holder stands.
    contact : arrays.ShearedPoints
    hess : ndarray
        (1 + r, 1 + r), of which the lower triangle is written.
    """
    psi = contact.psi
    points = contact.points
    count = int(contact.count[0])
    given = ending or beta == 0.0
    total = 0.0
    for j in range(count):
        total += points[SLOPE, j]
    project_onto_modes(SLOPE, psi, points, count, hess[0])
    for k in range(contact.kappa.size):
        hess[k + 1, 0] = 0.0 if given else -hess[0, k + 1]
        for j in range(count):
            points[FORCE, j] = points[SLOPE, j] * psi[k, j]
        last = (k + 1) % 4
        for l in range(0, k + 1 - last, 4):
            one = 0.0
            two = 0.0
            three = 0.0
            four = 0.0
            for j in range(count):
                value = points[FORCE, j]
                one += value * psi[l, j]
                two += value * psi[l + 1, j]
                three += value * psi[l + 2, j]
                four += value * psi[l + 3, j]
            hess[k + 1, l + 1] = one
            hess[k + 1, l + 2] = two
            hess[k + 1, l + 3] = three
            hess[k + 1, l + 4] = four
        for l in range(k + 1 - last, k + 1):
            dot = 0.0
            for j in range(count):
                dot += points[FORCE, j] * psi[l, j]
            hess[k + 1, l + 1] = dot
        hess[k + 1, k + 1] += contact.kappa[k] * (1.0 if ending else 0.5 + STEP_DAMPING)
    hess[0, 0] = 1.0 if given else 1 / beta + total


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def find_largest_residual(out, scale):
    """Return the largest residual as a force [N].

    Modal residuals are multiplied by the slide they stand for.
    """
    worst = abs(out[0])
    for k in range(1, out.size):
        worst = max(worst, abs(out[k]) * scale[k])
    return worst


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def is_last_step(p, contact):
    """Return whether a Newton step (1 + r,) moves all points by very little.

    The limit is LAST_STEP_RATIO bond lengths.

    The curvature of the mean of a bond is below its limit over the length squared, so half of
    LAST_STEP_RATIO^2 of the limit is left.
    """
    way = abs(p[0])
    for k in range(1, p.size):
        way += contact.drag[1, k] * abs(p[k])
    return way <= LAST_STEP_RATIO * contact.eps[1] and contact.drag[0, 0] > 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def minimise(free, beta, kind, ending, contact, goal):
    """Minimise over contact.y[ending] = (dq, db) in place, from the guess in it.

    The factor of a Hessian serves all solves of a step of the march, until an iteration with it
    gains less than a factor of ten. No residual is computed after a Newton step that is short
    enough.

    Parameters
    ----------
    free, beta : float
        dq = free - beta force; dq = free for beta = 0.
    kind : int
        Of the law of the points.
    ending : bool
        Whether the pieces spring back while the holder stands.
    contact : arrays.ShearedPoints
    goal : float
        Of the residual [N].

    Returns
    -------
    force : float
        [N].
    iterations : int
        Below 0 where it failed.
    """
    which = 1 if ending else 0
    y = contact.y[which]
    hess = contact.hess[which]
    g = contact.workspace[GRADIENT]
    p = contact.workspace[STEP]
    trial = contact.workspace[TRIAL]
    noise = 4e-16 * abs(free) / beta if beta > 0.0 else 0.0
    size = np.inf
    least = np.inf
    fall = 0.0
    force = 0.0
    stale = True
    stall = 0
    for i in range(y.size):
        p[i] = 0.0
    for count in range(
        MAX_ITERATIONS
    ):  # the first pass evaluates the guess, so that the code contains the gradient once
        if count > 0:
            if contact.ready[which] == 0.0:
                write_hessian(beta, ending, contact, hess)
                if not factorise(hess):
                    if not FORCE_MAY_FALL:
                        return force, -count
                    for j in range(int(contact.count[0])):
                        contact.points[SLOPE, j] = max(contact.points[SLOPE, j], 0.0)
                    write_hessian(beta, ending, contact, hess)
                    if not factorise(hess):
                        return force, -count
                contact.ready[which] = 1.0
                stale = False
            for i in range(y.size):
                p[i] = -g[i]
            fall = -solve_factorised(hess, p)
            if not stale and not ending and beta > 0.0 and is_last_step(p, contact):
                for i in range(y.size):
                    y[i] += p[i]
                set_slides(y[0], y[1:], contact)
                return (free - y[0]) / beta, count
        part = 1.0
        low = 0.0
        high = np.inf
        for _ in range(40):
            for i in range(y.size):
                trial[i] = y[i] + part * p[i]
            force = write_gradient(trial, free, beta, kind, ending, contact, g)
            rise = 0.0
            for i in range(y.size):
                rise += g[i] * p[i]
            if count == 0 or rise <= -0.5 * fall:
                break
            high = part
            part = safe_point(low, high, max(0.1, -fall / (rise - fall)) * part)
        for i in range(y.size):
            y[i] = trial[i]
        new = find_largest_residual(g, contact.scale)
        if new <= max(goal, noise + 4e-16 * abs(force)):
            return force, count + 1
        if count > 0:
            if new > 0.1 * size or part < 1.0:
                contact.ready[which] = 0.0
            stall = stall + 1 if new >= 0.5 * least and not stale else 0
            stale = contact.ready[which] == 1.0
            if stall >= 4 and new <= GOAL_SLACK * goal:
                return force, count
        size = new
        least = min(least, new)
    return force, -MAX_ITERATIONS


@njit(error_model="numpy", forceinline=True, **NJIT_NO_REFCOUNT)
def accept_step(contact):
    """Move the pieces by a solved step, and extrapolate the next guess from three steps."""
    y = contact.y[0]
    last = contact.last
    for k in range(contact.b.size):
        contact.b[k] += y[k + 1]
    for k in range(y.size):
        here = y[k]
        y[k] = 3 * (here - last[0, k]) + last[1, k]
        last[1, k] = last[0, k]
        last[0, k] = here
    contact.ready[:] = 0.0
