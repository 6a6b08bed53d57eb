"""Compiled fit of decaying sinusoids to a signal by variable projection, with fixed columns.

In: times, signal, and initial poles. Out: the best poles and the residual. Each pair of poles,
angular frequency [rad/s] and decay rate [1/s], has two columns, exp(-decay t) cos and sin. The
columns are orthonormalized by the Gram-Schmidt method, applied twice, which makes them
orthogonal to round-off (Giraud, Langou and Rozloznik, 2005). A column that depends linearly on
the others is ignored.
"""

from math import cos, exp, inf, sin, sqrt

from ..compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ..compiled.jit import njit

EPS = 2.0**-52
# Ratio of the norm of a column after projection to its norm; below it the column depends on the others.
MIN_INDEPENDENT_NORM = 1e-12
INITIAL_DAMPING = 1e-3  # Initial Levenberg-Marquardt damping of a fit, divided by ten.
MAX_DAMPING = 1e9  # Levenberg-Marquardt damping above which a fit ends.
# Step, relative to the scale of the poles, that ends a fit if the step lowered the residual.
SUCCESS_STEP_TOL = 1e-13
FAILURE_STEP_TOL = 1e-15  # Same ratio for a step that did not lower the residual.


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def fill_sinusoids(time, poles, columns, first):
    """Fill rows of an array with decaying sinusoids, a cosine and a sine for each pole.

    Parameters
    ----------
    time : (k,)
        Times [s].
    poles : (2 r,)
        Angular frequency [rad/s] and rate of decay [1/s] of each sinusoid.
    columns : (c, k)
        Array that is filled.
    first : int
        Its first row.
    """
    for r in range(poles.size // 2):
        own = poles[2 * r]
        rate = poles[2 * r + 1]
        for j in range(time.size):
            fall = exp(min(max(-rate * time[j], -50.0), 50.0))
            turn = own * time[j]
            columns[first + 2 * r, j] = fall * cos(turn)
            columns[first + 2 * r + 1, j] = fall * sin(turn)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def dot(a, b):
    """Return the scalar product of two arrays (k,)."""
    out = 0.0
    for j in range(a.size):
        out += a[j] * b[j]
    return out


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def subtract_multiple(a, share, b):
    """Subtract a multiple of an array from another one in place.

    Parameters
    ----------
    a : (k,)
        Array that is changed.
    share : float
        Factor of `b`.
    b : (k,)
    """
    for j in range(a.size):
        a[j] -= share * b[j]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def factor_qr(columns, count, basis, corner):
    """Compute the QR factorization of fit columns by repeated Gram-Schmidt orthogonalization.

    Fills the rows of `basis` and the upper triangle `corner` (count, count) with column j = sum
    corner[i, j] basis[i]. A dependent column has zeros as its basis vector.

    Parameters
    ----------
    columns : (c, k)
    count : int
        Number of columns.
    basis : (c, k)
        Orthonormal rows that are filled.
    corner : (c, c)
        Upper triangle that is filled.
    """
    for j in range(count):
        own = basis[j]
        for at in range(own.size):
            own[at] = columns[j, at]
        whole = sqrt(dot(own, own))
        for i in range(j):
            corner[i, j] = 0.0
        for _ in range(2):
            for i in range(j):
                share = dot(basis[i], own)
                corner[i, j] += share
                subtract_multiple(own, share, basis[i])
        left = sqrt(dot(own, own))
        corner[j, j] = left if left > MIN_INDEPENDENT_NORM * whole else 0.0
        for at in range(own.size):
            own[at] = own[at] / left if corner[j, j] > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def project(value, count, basis, inside, left):
    """Project a signal (k,) onto orthonormal basis rows.

    Fills `left` (k,) with the residual and `inside` (count,) with the coefficients.

    Parameters
    ----------
    value : (k,)
        Signal.
    count : int
        Number of rows of the basis.
    basis : (c, k)
        Orthonormal rows.
    inside : (count,)
        Coefficients that are filled.
    left : (k,)
        Residual that is filled.
    """
    for at in range(value.size):
        left[at] = value[at]
    for i in range(count):
        inside[i] = dot(basis[i], left)
        subtract_multiple(left, inside[i], basis[i])
    for i in range(count):  # The second pass removes the round-off of the first.
        share = dot(basis[i], left)
        inside[i] += share
        subtract_multiple(left, share, basis[i])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_upper_triangle(count, corner, inside, numbers):
    """Solve for the coefficients of fit columns by back substitution.

    Parameters
    ----------
    count : int
        Number of columns.
    corner : (c, c)
        Upper triangle of `factor_qr`.
    inside : (count,)
        Coefficients in the basis.
    numbers : (count,)
        Coefficients of the columns that are filled.
    """
    for i in range(count - 1, -1, -1):
        part = inside[i]
        for j in range(i + 1, count):
            part -= corner[i, j] * numbers[j]
        numbers[i] = part / corner[i, i] if corner[i, i] > 0 else 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def compute_residual(time, value, poles, columns, few):
    """Compute the residual of a signal after the fit of decaying sinusoids with given poles.

    Fills the workspace and returns the sum of squares of the residual.

    Parameters
    ----------
    time, value : (k,)
        Times [s] and signal.
    poles : (2 r,)
        As in `fill_sinusoids`.
    columns : (3, c, k)
        Workspace: columns, basis and residual.
    few : (c + 2, c)
        Workspace: upper triangle and coefficients.
    """
    count = few.shape[1]
    fill_sinusoids(time, poles, columns[0], count - poles.size)
    factor_qr(columns[0], count, columns[1], few)
    project(value, count, columns[1], few[count], columns[2, 0])
    solve_upper_triangle(count, few, few[count], few[count + 1])
    return dot(columns[2, 0], columns[2, 0])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def compute_jacobian(time, poles, scale, columns, few, slopes, normal):
    """Compute the Jacobian of the fit residual with respect to scaled poles (Kaufman, 1975).

    Fills `slopes` (2 r, k) with the Jacobian, and `normal` (2 r, 2 r + 1) with the normal matrix
    and, in the last column, the gradient.

    Parameters
    ----------
    time : (k,)
        Times [s].
    poles, scale : (2 r,)
        Poles, and the units in which their steps are measured.
    columns, few
        Workspace that `compute_residual` filled.
    slopes : (2 r, k)
    normal : (2 r, 2 r + 1)
    """
    many = poles.size
    count = few.shape[1]
    first = count - many
    numbers = few[count + 1]
    for r in range(many // 2):
        cosine = columns[0, first + 2 * r]
        sine = columns[0, first + 2 * r + 1]
        a = numbers[first + 2 * r]
        b = numbers[first + 2 * r + 1]
        for at in range(time.size):
            slopes[2 * r, at] = (b * cosine[at] - a * sine[at]) * time[at] * scale[2 * r]
            slopes[2 * r + 1, at] = -(a * cosine[at] + b * sine[at]) * time[at] * scale[2 * r + 1]
    for r in range(many):
        for _ in range(2):
            for i in range(count):
                subtract_multiple(slopes[r], dot(columns[1, i], slopes[r]), columns[1, i])
        for at in range(time.size):
            slopes[r, at] = -slopes[r, at]
    for r in range(many):
        for q in range(r + 1):
            normal[r, q] = normal[q, r] = dot(slopes[r], slopes[q])
        normal[r, many] = dot(slopes[r], columns[2, 0])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def solve_step(normal, damping, step, lower):
    """Compute the Levenberg-Marquardt step in place, and return its product with the gradient.

    The step is -(N + damping diag N)^-1 g, by Cholesky factorization; a dependent direction is left
    out.

    Parameters
    ----------
    normal : (m, m + 1)
        Normal matrix N and, in the last column, the gradient g.
    damping : float
    step : (m,)
        Step that is filled.
    lower : (m, m)
        Workspace.
    """
    many = step.size
    for i in range(many):
        for j in range(i + 1):
            size = sqrt(normal[i, i]) * sqrt(normal[j, j])
            part = (normal[i, j] / size if size > 0 else 0.0) + (damping if i == j else 0.0)
            for k in range(j):
                part -= lower[i, k] * lower[j, k]
            if i == j:
                lower[i, i] = sqrt(part) if part > many * EPS * (1 + damping) else inf
            else:
                lower[i, j] = part / lower[j, j]
    for i in range(many):
        size = sqrt(normal[i, i])
        part = -normal[i, many] / size if size > 0 else 0.0
        for k in range(i):
            part -= lower[i, k] * step[k]
        step[i] = part / lower[i, i]
    gain = 0.0
    for i in range(many - 1, -1, -1):
        part = step[i]
        for k in range(i + 1, many):
            part -= lower[k, i] * step[k]
        step[i] = part / lower[i, i]
    for i in range(many):
        size = sqrt(normal[i, i])
        step[i] = step[i] / size if size > 0 else 0.0
        gain += normal[i, many] * step[i]
    return gain


@njit(error_model="numpy", cache=True, **NJIT_NO_REFCOUNT)
def fit_sinusoids(time, value, poles, scale, ends, room):
    """Fit decaying sinusoids to a signal (k,) by the Levenberg-Marquardt method.

    Parameters
    ----------
    time, value : (k,)
    poles : (2 r,)
        Initial poles; overwritten by the best ones.
    scale : (2 r,)
        Scales of the steps.
    ends : (4,)
        Sum of squares that is round-off; sum of squares with which a fit ends if all its
        frequencies are below the third entry [rad/s]; largest number of steps (0: only evaluate).
    room : tuple
        Workspace: columns (3, c, k) with the columns (of which the first c - 2 r are given), their
        basis, and the residual in the first row of the last; few (c + 2, c) with the triangle of
        the basis, then coefficients in the basis and of the columns; slopes (2 r, k); normal (2 r,
        2 r + 1) as in `compute_jacobian` at the best poles; more (2 r + 2, 2 r). Columns and few are those
        of the last evaluation.

    Returns
    -------
    tuple
        Number of evaluations, and sum of squares of the best residual.
    """
    columns, few, slopes, normal, more = room
    many = poles.size
    damping = 10 * INITIAL_DAMPING
    looked = 0
    largest = 1.0
    size = inf
    lower = more[:many]
    step = more[many]
    tried = more[many + 1]
    for r in range(many):
        tried[r] = poles[r]
    while True:
        new = compute_residual(time, value, tried, columns, few)
        looked += 1
        if new <= size:
            size = new
            damping = damping / 10
            highest = 0.0
            for r in range(many):
                poles[r] = tried[r]
                highest = max(highest, poles[r] if r % 2 == 0 else 0.0)
            if ends[3] == 0:
                break
            compute_jacobian(time, poles, scale, columns, few, slopes, normal)
            if (
                largest < SUCCESS_STEP_TOL
                or size <= ends[0]
                or (size < ends[1] and highest < ends[2])
            ):
                break
        elif damping > MAX_DAMPING or largest < FAILURE_STEP_TOL:
            break
        else:
            damping *= 10
        gain = -solve_step(normal, damping, step, lower)
        # Otherwise round-off would decide whether a step with less gain is taken.
        if looked > ends[3] or gain <= EPS * size:
            break
        largest = 0.0
        for r in range(many):
            tried[r] = poles[r] + scale[r] * step[r]
            largest = max(largest, abs(step[r]))
    return looked, size
