"""Power series of a linear motion in a short time interval, and polynomial roots (compiled).

Over u = t/h in [0, 1] every coordinate is sum c_k u^k. If h is at most MAX_RATE_TIME over the
fastest rate of the system, the terms decrease as MAX_RATE_TIME^k/k!, so a few dozen are exact to
round-off for any rates: rigid, overdamped, coupled or equal. A polynomial whose Bernstein
coefficients are all positive has no root; if their sign changes once, it has exactly one root
(Descartes).
"""

from math import comb, factorial, sqrt
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ...friction.flags_kernels import NJIT_INLINE, NJIT_KERNEL
from .memory_kernels import RIGID_STIFFNESS
from .positions_kernels import ConstraintStatus

# Maximum product of the duration and the fastest rate of the system; 28
# powers are then exact to round-off.
MAX_RATE_TIME = 2.0
# Highest power of a series.
MAX_POWER = 28
# Unit round-off of double precision.
EPS = 2.0**-52
# Code for a polynomial without a root in [0, 1]; any value above 1 serves.
NO_ROOT = 2.0
# Maximum number of halvings in the search for a root; the last interval is as short as
# the round-off of its position.
MAX_HALVINGS = 52
# Number of columns for the Bernstein coefficients of an interval; the
# last column is 1 in a right half.
N_HULL_COLUMNS = MAX_POWER + 5
# Highest power in the first search for a root.
FIRST_SEARCH_POWER = 9
# Maximum number of Gauss points in a time interval.
MAX_GAUSS_POINTS = 16
# Relative error of the integral of a squared motion by Gauss quadrature.
GAUSS_TOL = 1e-13

# Largest product of rate and duration for which the powers up to k suffice; the
# last term is then below EPS/4.
_RATE_TIME_LIMITS = np.array(
    [0.0, 0.0] + [(EPS / 4 * factorial(k)) ** (1 / k) for k in range(2, MAX_POWER + 1)]
)
# Factors of u^k in the second integral of u^(k - 2).
DOUBLE_INTEGRAL_FACTORS = np.array(
    [0.0, 0.0] + [1 / (k * (k - 1)) for k in range(2, MAX_POWER + 2)]
)
SINGLE_INTEGRAL_FACTORS = np.array([0.0] + [1 / k for k in range(1, MAX_POWER + 3)])
# Factors of u^k in the first integral of u^(k - 1).


def _bernstein_row(degree: int, power: int) -> list:
    """Return the Bernstein coefficients of u^power for a polynomial degree, padded with zeros."""
    row = [0.0] * (MAX_POWER + 4)
    for i in range(power, degree + 1):
        row[i] = comb(i, power) / comb(degree, power)
    return row


# Coefficient i of u^k in the Bernstein basis of degree d, with indices [d, k, i].
_BERNSTEIN = np.array(
    [[_bernstein_row(d, k) for k in range(MAX_POWER + 1)] for d in range(MAX_POWER + 1)]
)


def _gauss_limit(n_points: int) -> float:
    """Return the largest rate times duration for which Gauss points integrate to GAUSS_TOL."""
    constant = (2 * n_points + 1) * factorial(2 * n_points) ** 3 / factorial(n_points) ** 4
    return 0.5 * (GAUSS_TOL * constant) ** (1 / (2 * n_points))


_GAUSS_RATE_TIME_LIMITS = np.array(
    [0.0] + [_gauss_limit(g) for g in range(1, MAX_GAUSS_POINTS + 1)]
)
# Nodes and weights on [0, 1] of the Gauss rules with g points, with indices [g, point].
GAUSS_POINTS, GAUSS_WEIGHTS = np.zeros((2, MAX_GAUSS_POINTS + 1, MAX_GAUSS_POINTS))
for _g in range(1, MAX_GAUSS_POINTS + 1):
    _points, _weights = np.polynomial.legendre.leggauss(_g)
    GAUSS_POINTS[_g, :_g] = (1 + _points) / 2
    GAUSS_WEIGHTS[_g, :_g] = _weights / 2


class MotionStart(NamedTuple):
    """State of a linear motion at the start of a time interval.

    - coordinates, rate: (n,) modal coordinates [m] and rates [m/s]
    - force: (i,) friction forces of the interfaces [N]
    """

    coordinates: np.ndarray
    rate: np.ndarray
    force: np.ndarray


class MotionSeries(NamedTuple):
    """Power series of drive and motion over a time interval.

    - drive: (> top,) acceleration of the drive [m s-2]
    - coefficients: (> top, n) modal coordinates [m]
    """

    drive: np.ndarray
    coefficients: np.ndarray


@njit(**NJIT_KERNEL)
def find_highest_power(x):
    """Return the highest power that a series over a time interval needs.

    x is the duration times the fastest rate.
    """
    k = 4
    while k < MAX_POWER and _RATE_TIME_LIMITS[k] < x:
        k += 1
    return k


@njit(**NJIT_INLINE)
def count_gauss_points(x):
    """Return the number of Gauss points that integrate squares of the motion accurately.

    x: duration of the piece times the fastest rate.
    """
    g = 2
    while g < MAX_GAUSS_POINTS and _GAUSS_RATE_TIME_LIMITS[g] < x:
        g += 1
    return g


@njit(**NJIT_KERNEL)
def bound_fastest_rate(modal_system, springs):
    """Return an upper bound [1/s] of the rates of modes with springs (i,) [N/m] at interfaces.

    Sticking interfaces only remove motions, so they do not count.
    """
    square = modal_system.max_omega_squared
    for f in range(len(modal_system.inverse_mass)):
        if springs[f] < RIGID_STIFFNESS:
            square += springs[f] * modal_system.inverse_mass[f]
    return 0.5 * modal_system.damping_norm + sqrt(0.25 * modal_system.damping_norm**2 + square)


@njit(**NJIT_INLINE)
def bound_modal_rate(modal_system, workspace):
    """Return an upper bound [1/s] of the present modal rates.

    It is that of `bound_fastest_rate` for workspace.stiffness, and 0 if the sticking
    interfaces leave no motion.
    """
    if workspace.constraint.status[ConstraintStatus.IS_IMMOBILE] == 1.0:
        return 0.0
    return bound_fastest_rate(modal_system, workspace.stiffness)


@njit(**NJIT_INLINE)
def expand_single_mode(start, series, h, top, modal_system, spring):
    """Expand the motion of one mode with one interface as a power series.

    It is the special case of `expand_motion`.

    It takes a third of the time.

    Parameters
    ----------
    start, series, h, top, modal_system
        See `expand_motion`.
    spring : float
        Stiffness of the interface [N/m].
    """
    drive, coefs = series
    friction = modal_system.interfaces[0, 0] / modal_system.mass * start.force[0]
    h_squared = h * h
    base = modal_system.base[0]
    stiff = h_squared * (modal_system.omega_squared[0] + spring * modal_system.inverse_mass[0])
    damp = h * modal_system.damping[0, 0]
    # These are the coefficients k and k + 1 of the series.
    present = start.coordinates[0]
    following = h * start.rate[0]
    coefs[0, 0] = present
    coefs[1, 0] = following
    forces = modal_system.omega_squared[0] * present + base * drive[0] + friction
    new = -0.5 * (h_squared * forces + damp * following)
    present = following
    following = new
    coefs[2, 0] = following
    for k in range(1, top - 1):
        forces = stiff * present + h_squared * base * drive[k] + damp * (k + 1) * following
        present = following
        following = -DOUBLE_INTEGRAL_FACTORS[k + 2] * forces
        coefs[k + 2, 0] = following


@njit(**NJIT_INLINE)
def expand_two_modes(start, series, h, top, modal_system, spring):
    """Expand the motion of two uncoupled modes with one interface as power series.

    It is the special case of `expand_motion`.

    Parameters
    ----------
    start, series, h, top, modal_system
        See `expand_motion`.
    spring : float
        Stiffness of the interface [N/m].
    """
    drive, coefs = series
    h_squared = h * h
    face_1 = modal_system.interfaces[0, 0]
    face_2 = modal_system.interfaces[0, 1]
    base_1 = modal_system.base[0]
    base_2 = modal_system.base[1]
    # A constant index would not compile for one mode, for which this code is never reached.
    second = len(modal_system.omega_squared) - 1
    stiff_1 = h_squared * modal_system.omega_squared[0]
    stiff_2 = h_squared * modal_system.omega_squared[second]
    stiff = h_squared * spring / modal_system.mass
    damp_1 = h * modal_system.damping[0, 0]
    damp_2 = h * modal_system.damping[1, 1]
    friction = h_squared * start.force[0] / modal_system.mass
    present_1 = start.coordinates[0]
    present_2 = start.coordinates[1]
    following_1 = h * start.rate[0]
    following_2 = h * start.rate[1]
    coefs[0, 0] = present_1
    coefs[0, 1] = present_2
    coefs[1, 0] = following_1
    coefs[1, 1] = following_2
    for k in range(top - 1):
        base_term = h_squared * drive[k]
        count = k + 1
        new_1 = -DOUBLE_INTEGRAL_FACTORS[k + 2] * (
            stiff_1 * present_1
            + base_1 * base_term
            + face_1 * friction
            + damp_1 * count * following_1
        )
        new_2 = -DOUBLE_INTEGRAL_FACTORS[k + 2] * (
            stiff_2 * present_2
            + base_2 * base_term
            + face_2 * friction
            + damp_2 * count * following_2
        )
        friction = stiff * (face_1 * following_1 + face_2 * following_2)
        present_1 = following_1
        present_2 = following_2
        following_1 = new_1
        following_2 = new_2
        coefs[k + 2, 0] = new_1
        coefs[k + 2, 1] = new_2


@njit(**NJIT_KERNEL)
def expand_immobile(start, series, top, modal_system, workspace):
    """Expand reactions as power series if the sticking interfaces prevent all motion.

    Only the reactions depend on time.

    Parameters
    ----------
    start, series, top, modal_system, workspace
        See `expand_motion`.
    """
    drive, coefs = series
    coordinates = start.coordinates
    constraint = workspace.constraint
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    for k in range(top + 1):
        for i in range(n):
            coefs[k, i] = coordinates[i] if k == 0 else 0.0
    for f in range(n_interfaces):
        static_reaction = 0.0
        drive_reaction = 0.0
        for i in range(n):
            modal_force = modal_system.omega_squared[i] * coordinates[i]
            for g in range(n_interfaces):
                if workspace.stiffness[g] < RIGID_STIFFNESS:
                    modal_force += (
                        modal_system.interfaces[g, i] * start.force[g] / modal_system.mass
                    )
            static_reaction -= constraint.inverse[f, i] * modal_force
            drive_reaction -= constraint.inverse[f, i] * modal_system.base[i]
        for k in range(top - 1):
            constraint.reactions[f, k] = modal_system.mass * drive_reaction * drive[k]
        constraint.reactions[f, 0] += modal_system.mass * static_reaction


@njit(**NJIT_KERNEL)
def remove_sticking_motion(k, scale, modal_system, coefs, workspace):
    """Remove the motion of sticking interfaces from one power of the series.

    The coefficients are those of power k + 2; the reactions are stored.

    The remaining acceleration is a - interfaces^T r/mass with r = mass (interfaces interfaces^T)^+
    interfaces a.

    Parameters
    ----------
    k : int
        Power of the acceleration.
    scale : float
        Ratio of the coefficient to the acceleration [s2].
    modal_system, workspace
        See `expand_motion`.
    coefs : ndarray
        (>= top + 1, n) coefficients of the motion.
    """
    constraint = workspace.constraint
    n = len(modal_system.omega_squared)
    n_interfaces = len(modal_system.inverse_mass)
    for f in range(n_interfaces):
        reaction = 0.0
        for i in range(n):
            reaction += constraint.inverse[f, i] * coefs[k + 2, i]
        constraint.reactions[f, k] = reaction
    for f in range(n_interfaces):
        for i in range(n):
            coefs[k + 2, i] -= modal_system.interfaces[f, i] * constraint.reactions[f, k]
        constraint.reactions[f, k] *= modal_system.mass / scale


@njit(**NJIT_KERNEL)
def expand_motion(start, series, h, top, modal_system, workspace):
    """Expand the modal motion and the reactions of sticking interfaces as power series.

    The equation is z'' = -D z' - omega^2 z - base a - interfaces^T (force + springs slide)/mass.
    Interfaces with infinite springs are fixed; workspace.constraint.reactions (i, >= top - 1) are
    the forces [N] that hold them.

    Parameters
    ----------
    start : MotionStart
    series : MotionSeries
        Its coefficients are written.
    h : float
        Duration of the piece [s].
    top : int
        Highest power.
    modal_system : ModalSystem
    workspace : Workspace
        Its constraint is as `stick_kernels.constrain_slides` leaves it, and its stiffness that of
        the interfaces.
    """
    n_interfaces = len(modal_system.inverse_mass)
    n = len(modal_system.omega_squared)
    interfaces = modal_system.interfaces
    drive, coefs = series
    springs = workspace.stiffness
    h_squared = h * h
    friction_accel = workspace.friction_accel
    has_sticking = workspace.constraint.status[ConstraintStatus.N_STICKING] > 0.0
    if workspace.constraint.status[ConstraintStatus.IS_IMMOBILE] == 1.0:
        expand_immobile(start, series, top, modal_system, workspace)
        return
    if n == 1 and n_interfaces == 1:
        expand_single_mode(start, series, h, top, modal_system, springs[0])
        return
    if n == 2 and n_interfaces == 1 and not modal_system.is_coupled and not has_sticking:
        expand_two_modes(start, series, h, top, modal_system, springs[0])
        return
    for i in range(n):
        coefs[0, i] = start.coordinates[i]
        coefs[1, i] = h * start.rate[i]
    for f in range(n_interfaces):
        is_free = springs[f] < RIGID_STIFFNESS
        friction_accel[f] = start.force[f] / modal_system.mass if is_free else 0.0
    for k in range(top - 1):
        scale = DOUBLE_INTEGRAL_FACTORS[k + 2] * h_squared
        damp = DOUBLE_INTEGRAL_FACTORS[k + 2] * h * (k + 1)
        if k > 0:
            for f in range(n_interfaces):
                term = 0.0
                for i in range(n):
                    term += interfaces[f, i] * coefs[k, i]
                is_free = springs[f] < RIGID_STIFFNESS
                friction_accel[f] = term * springs[f] / modal_system.mass if is_free else 0.0
        for i in range(n):
            term = -modal_system.omega_squared[i] * coefs[k, i] - modal_system.base[i] * drive[k]
            for f in range(n_interfaces):
                term -= interfaces[f, i] * friction_accel[f]
            damped = 0.0
            if modal_system.is_coupled:
                for j in range(n):
                    damped += modal_system.damping[i, j] * coefs[k + 1, j]
            else:
                damped = modal_system.damping[i, i] * coefs[k + 1, i]
            coefs[k + 2, i] = scale * term - damp * damped
        if has_sticking:
            remove_sticking_motion(k, scale, modal_system, coefs, workspace)


@njit(**NJIT_INLINE)
def evaluate_polynomial(poly, low, top, u):
    """Evaluate the polynomial sum of poly[k] u^(k - low), k = low .. top.

    Terms with even and with odd powers are added separately, which halves the length of the
    dependency chain.

    Parameters
    ----------
    poly : ndarray
        Coefficients of the polynomial.
    low : int
        Index of the lowest coefficient.
    top : int
        Index of the highest coefficient.
    u : float
        Argument.

    Returns
    -------
    float
    """
    # The processor evaluates two independent sums of half the length at the same time.
    square = u * u
    even = poly[top]
    odd = 0.0
    k = top - 1
    while k > low:
        odd = odd * square + poly[k]
        even = even * square + poly[k - 1]
        k -= 2
    return even + u * odd if k < low else even * u + odd * square + poly[low]


@njit(**NJIT_INLINE)
def evaluate_with_slope(poly, low, top, u):
    """Evaluate a polynomial and its derivative.

    For the polynomial see `evaluate_polynomial`.

    Parameters
    ----------
    poly, low, top, u
        See `evaluate_polynomial`.

    Returns
    -------
    value : float
    slope : float
        Its derivative.
    """
    square = u * u
    k = top - 1
    # These are the derivatives with respect to u^2.
    even = poly[top]
    odd = 0.0
    even_slope = 0.0
    odd_slope = 0.0
    while k > low:
        odd_slope = odd_slope * square + odd
        odd = odd * square + poly[k]
        even_slope = even_slope * square + even
        even = even * square + poly[k - 1]
        k -= 2
    if k < low:
        return even + u * odd, odd + 2 * u * (even_slope + u * odd_slope)
    odd_slope = odd_slope * square + odd
    odd = odd * square + poly[low]
    return odd + u * even, even + 2 * u * (odd_slope + u * even_slope)


@njit(**NJIT_INLINE)
def refine_root(poly, low, top, left, right, u):
    """Return the root of a polynomial in an interval in which it decreases through zero.

    Newton's method is guarded by bisection.

    Parameters
    ----------
    poly, low, top
        See `evaluate_polynomial`.
    left, right : float
        Interval of the root.
    u : float
        Start of Newton's method.

    Returns
    -------
    float
    """
    last = right - left
    for _ in range(100):
        value, slope = evaluate_with_slope(poly, low, top, u)
        if value > 0:
            left = u
        elif value < 0:
            right = u
        else:
            return u
        new = u - value / slope if slope < 0 else left
        if not left < new < right:
            new = 0.5 * (left + right)
        step = abs(new - u)
        # Newton steps shrink quadratically, so the next one would be step (step/last)^2.
        if step <= 2 * EPS * u or (
            step < 0.01 * last and step * (step / last) ** 2 <= 0.1 * EPS * u
        ):
            return new
        u = new
        last = step
    return u


@njit(**NJIT_INLINE)
def fill_bernstein(poly, low, top, hull):
    """Write the Bernstein coefficients of a polynomial on [0, 1].

    Parameters
    ----------
    poly, low, top
        See `evaluate_polynomial`.
    hull : ndarray
        Bernstein coefficients on [0, 1], which are written.
    """
    # The length is padded to complete vector registers of four numbers.
    degree = top - low
    n_padded = (top - low) // 4 * 4 + 4
    for i in range(n_padded):
        hull[i] = poly[low]
    for k in range(1, degree + 1):
        coefficient = poly[low + k]
        for i in range(n_padded):
            hull[i] += coefficient * _BERNSTEIN[degree, k, i]


@njit(**NJIT_INLINE)
def find_possible_root(poly, low, top, hull):
    """Estimate the position of the first root of a polynomial in [0, 1].

    The Bernstein coefficients of the first terms are compared with the sum of the magnitudes of the
    other terms.

    Parameters
    ----------
    poly, low, top
        See `evaluate_polynomial`.
    hull : ndarray
        Workspace.

    Returns
    -------
    float
        NO_ROOT if there is none.
    """
    remainder = 0.0
    n_padded = FIRST_SEARCH_POWER // 4 * 4 + 4
    for k in range(low + FIRST_SEARCH_POWER + 1, top + 1):
        remainder += abs(poly[k])
    for i in range(n_padded):
        hull[i] = poly[low]
    for k in range(1, FIRST_SEARCH_POWER + 1):
        coefficient = poly[low + k]
        for i in range(n_padded):
            hull[i] += coefficient * _BERNSTEIN[FIRST_SEARCH_POWER, k, i]
    for i in range(FIRST_SEARCH_POWER + 1):
        if hull[i] <= remainder:
            return (
                i - hull[i] / (hull[i] - hull[i - 1]) if 0 < i and hull[i] < hull[i - 1] else i
            ) / FIRST_SEARCH_POWER
    return NO_ROOT


@njit(**NJIT_INLINE)
def prove_first_root(poly, low, top, u, workspace):
    """Return a root of a polynomial if it is proved to be the first, else NO_ROOT.

    Newton's method finds the root r. The polynomial p(r s) is (1 - s) q(s), and the coefficients of
    q are sums of the last coefficients of p(r s). If q has no root in [0, 1], then p has none
    before r.

    Parameters
    ----------
    poly, low, top
        See `evaluate_polynomial`.
    u : float
        Start of Newton's method.
    workspace : ndarray
        Two rows.

    Returns
    -------
    float
    """
    last = 1.0
    for _ in range(9):
        value, slope = evaluate_with_slope(poly, low, top, u)
        if not slope < 0.0:
            return NO_ROOT
        step = value / slope
        u -= step
        step = abs(step)
        if not 0.0 < u <= 1.0:
            return NO_ROOT
        # The convergence criterion is that of `refine_root`.
        has_converged = step <= 2 * EPS * u or (
            step < 0.01 * last and step * (step / last) ** 2 <= 0.1 * EPS * u
        )
        last = step
        if has_converged:
            power = 1.0
            rows = workspace[0]
            total = 0.0
            for k in range(low, top + 1):
                rows[k - low] = power * poly[k]
                power *= u
            for k in range(top - low, 0, -1):
                total -= rows[k]
                rows[k] = total
            for k in range(top - low):
                rows[k] = rows[k + 1]
            if find_possible_root(rows, 0, top - low - 1, workspace[1]) == NO_ROOT:
                return u
            return NO_ROOT
    return NO_ROOT


@njit(**NJIT_KERNEL)
def find_first_root(poly, low, top, hulls):
    """Return the first position in (0, 1] at which a polynomial is no longer positive.

    It is positive just after 0.

    A dip below zero of the size of round-off is ignored.

    Parameters
    ----------
    poly : ndarray
    low, top : int
        The polynomial is the sum of poly[k] u^(k - low) for k from low to top.
    hulls : ndarray
        (MAX_HALVINGS + 2, N_HULL_COLUMNS) workspace.

    Returns
    -------
    float
        NO_ROOT if there is none.
    """
    # The mask tells the compiler that no index is negative.
    remainder = 0.0
    low = low & 31
    top = top & 31
    for k in range(low + 1, top + 1):
        remainder += abs(poly[k])
    if poly[low] > remainder:
        return NO_ROOT
    if top - low > FIRST_SEARCH_POWER + 2:
        u = find_possible_root(poly, low, top, hulls[0])
        if u < NO_ROOT:
            u = prove_first_root(poly, low, top, u, hulls)
        else:
            return NO_ROOT
        if u < NO_ROOT:
            return u
    noise = 4 * EPS * (remainder + abs(poly[low]))
    degree = top - low
    fill_bernstein(poly, low, top, hulls[0])
    left = 0.0
    width = 1.0
    depth = 0
    while True:
        hull = hulls[depth]
        lowest = 0.0
        changes = 0
        k_change = 0
        for k in range(degree + 1):
            lowest = min(lowest, hull[k])
            if k > 0 and (hull[k] < 0) != (hull[k - 1] < 0):
                changes += 1
                k_change = k
        # The interval has no root, so the search continues in the next part on its right.
        if lowest >= -noise:
            left += width
            depth, width = _take_right_half(hulls, depth, width, degree)
            if depth == 0:
                return NO_ROOT
            continue
        if hull[0] > 0 and changes == 1:
            fraction = (
                k_change - 1 + hull[k_change - 1] / (hull[k_change - 1] - hull[k_change])
            ) / degree
            return refine_root(poly, low, top, left, left + width, left + width * fraction)
        if depth == MAX_HALVINGS:
            return left
        _halve_interval(hull, hulls[depth + 1], degree, True)
        depth = depth + 1
        width = width / 2
        hulls[depth, N_HULL_COLUMNS - 1] = 0.0


@njit(**NJIT_INLINE)
def _halve_interval(hull, half, degree, first):
    """Write the Bernstein coefficients of one half of an interval (de Casteljau's algorithm)."""
    for k in range(degree + 1):
        half[k] = hull[k]
    if first:
        for j in range(1, degree + 1):
            for k in range(degree, j - 1, -1):
                half[k] = 0.5 * (half[k] + half[k - 1])
    else:
        for j in range(1, degree + 1):
            for k in range(degree - j + 1):
                half[k] = 0.5 * (half[k] + half[k + 1])


@njit(**NJIT_INLINE)
def _take_right_half(hulls, depth, width, degree):
    """Return depth and width of the next right half of the search for a root.

    The depth is 0 if no half remains.
    """
    while depth > 0 and hulls[depth, N_HULL_COLUMNS - 1] == 1.0:
        depth -= 1
        width *= 2
    if depth > 0:
        _halve_interval(hulls[depth - 1], hulls[depth], degree, False)
        hulls[depth, N_HULL_COLUMNS - 1] = 1.0
    return depth, width


@njit(cache=True, **NJIT_KERNEL)
def find_largest_magnitude(poly, top, best, hulls):
    """Return the largest magnitude of a polynomial on [0, 1], or a larger lower bound.

    The relative error is 1e-14. Intervals are halved until their Bernstein coefficients do not
    exceed the best value, or show at most one extremum, which Newton's method finds.

    Parameters
    ----------
    poly : ndarray
        Coefficients of u^0 to u^top.
    top : int
    best : float
        A lower bound of the result.
    hulls : ndarray
        (MAX_HALVINGS + 2, N_HULL_COLUMNS) workspace.

    Returns
    -------
    float
    """
    best = max(best, abs(poly[0]), abs(evaluate_polynomial(poly, 0, top, 1.0)))
    fill_bernstein(poly, 0, top, hulls[0])
    depth = 0
    left = 0.0
    width = 1.0
    rate = hulls[MAX_HALVINGS + 1]
    while True:
        hull = hulls[depth]
        largest = abs(hulls[depth, 0])
        n_extrema = 0
        at = 0
        for k in range(1, top + 1):
            largest = max(largest, abs(hull[k]))
            if k > 1 and (hull[k] < hull[k - 1]) != (hull[k - 1] < hull[k - 2]):
                n_extrema += 1
                at = k
        known = largest <= best * (1 + 1e-14) or depth == MAX_HALVINGS
        # By Descartes' rule there is at most one extremum, and the ends have been checked.
        if not known and n_extrema < 2:
            if n_extrema == 1:
                sense = 1.0 if hull[1] > hull[0] else -1.0
                before = hull[at - 1] - hull[at - 2]
                after = hull[at] - hull[at - 1]
                for k in range(top):
                    rate[k] = sense * (k + 1) * poly[k + 1]
                fraction = (at - 2 + before / (before - after)) / (top - 1)
                u = refine_root(rate, 0, top - 1, left, left + width, left + width * fraction)
                best = max(best, abs(evaluate_polynomial(poly, 0, top, u)))
            known = True
        if known:
            left += width
            depth, width = _take_right_half(hulls, depth, width, top)
            if depth == 0:
                return best
            continue
        _halve_interval(hull, hulls[depth + 1], top, True)
        depth = depth + 1
        width = width / 2
        hulls[depth, N_HULL_COLUMNS - 1] = 0.0
        best = max(best, abs(hulls[depth, top]))
