"""Compiled sums over a list of strips of bonds (eq. 2.17): force and stored energy.

Each form of the sum has a function: `sum_moments` and `sum_powers` for reading="stretch", `sum_report` and
`sum_growing` for reading="report"; `sum_initial` adds the bonds that were there at the start. The arrays are described
in `list_rows_kernels`. In a strip u is the relative displacement since a bond formed, R the path since then.
"""

from math import exp
from typing import NamedTuple

import numpy as np
from numba import uint64

from ...compiled.jit import njit
from ..flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from .list_forms_kernels import FORM_POWER, GAUSS_POINT_1, GAUSS_POINT_2
from .list_math_kernels import (
    bond_gammainc,
    fast_exp,
    fast_log,
    interpolate_gammainc,
)
from .list_rows_kernels import GROWING_ROW, LAW, MOMENT, POWER_ROW, REPORT_ROW, STRIP

# Smallest ratio of the last to the first bond length of a strip that can contain fully grown bonds
MIN_GROWING_RATIO = 0.05
# Largest displacement, relative to the path, at which the initial bonds count as unstressed
UNSTRESSED_TOL = 1e-14
# Smallest length of a growing bond relative to that of mature bonds; it keeps R/length finite
MIN_LENGTH_RATIO = 1e-9
MIN_PATH = 1e-300  # smallest path [m] since a bond formed; it keeps the logarithm finite
# Smallest width of a spread strip, relative to its distance from the present position, that is not
# neglected
MIN_SPREAD_RATIO = 1e-4


class BondSum(NamedTuple):
    """Sums of force and stored energy over bonds; the units depend on the form of the sum."""

    force: float
    energy: float


class Moments(NamedTuple):
    """Sums of weight, weight times u and weight times u^2 over bonds (eq. 2.17 with p = 1)."""

    m: float
    z: float
    s2: float


class MatureBonds(NamedTuple):
    """Present length [m] of mature (fully grown) bonds, and factor exp(reference - J) of scaled starting lengths."""

    length: float
    scale: float


class StripRange(NamedTuple):
    """Range of indices of the strips of a bond list.

    Spread strips are those from `head` to `first`, and strips of a single pass those from `first` to `end`.
    """

    head: int
    first: int
    end: int


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def sum_moments(displacement, scale, bonds, strips):
    """Sum the moments of strips in the form FORM_MOMENTS; 0.3 ns per strip.

    Parameters
    ----------
    displacement : float
        Present relative displacement [m].
    scale : float
        exp(reference - damage), which undoes the scale of the weights.
    bonds : (N_ROWS, capacity) array
        Array of strips.
    strips : Range
        Strips that are summed.

    Returns
    -------
    Moments
        Sums [m], [m2], [m3] of weights without the factor 1/eps_0.
    """
    m = 0.0
    z = 0.0
    s2 = 0.0
    for k in range(uint64(strips.head), uint64(strips.end)):
        u = displacement - bonds[MOMENT.centre, k]
        weight = bonds[MOMENT.weight, k]
        m += weight
        z += weight * u
        s2 += weight * (u * u + bonds[MOMENT.variance, k])
    return Moments(m * scale, z * scale, s2 * scale)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def _gauss_stretches(displacement, bonds, k):
    """Return the stretch u [m] of the bonds at both Gauss points of a strip."""
    end = bonds[STRIP.end, k]
    step = end - bonds[STRIP.start, k]
    at_end = displacement - end
    return at_end + GAUSS_POINT_1 * step, at_end + GAUSS_POINT_2 * step


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _sum_gauss_powers(displacement, bonds, first, end, p):
    """Sum w |u|^p sgn u and w |u|^(p + 1) over both Gauss points of strips that formed in a single pass."""
    force = 0.0
    energy = 0.0
    if p == 0.0:
        for k in range(uint64(first), uint64(end)):
            u_1, u_2 = _gauss_stretches(displacement, bonds, k)
            weight_1 = bonds[POWER_ROW.weight_1, k]
            weight_2 = bonds[POWER_ROW.weight_2, k]
            force += np.copysign(weight_1, u_1) + np.copysign(weight_2, u_2)
            energy += weight_1 * abs(u_1) + weight_2 * abs(u_2)
    elif p == 2.0:
        for k in range(uint64(first), uint64(end)):
            u_1, u_2 = _gauss_stretches(displacement, bonds, k)
            force_1 = bonds[POWER_ROW.weight_1, k] * u_1 * u_1
            force_2 = bonds[POWER_ROW.weight_2, k] * u_2 * u_2
            force += np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
            energy += force_1 * abs(u_1) + force_2 * abs(u_2)
    else:
        for k in range(uint64(first), uint64(end)):
            u_1, u_2 = _gauss_stretches(displacement, bonds, k)
            force_1 = bonds[POWER_ROW.weight_1, k] * fast_exp(p * fast_log(abs(u_1)))
            force_2 = bonds[POWER_ROW.weight_2, k] * fast_exp(p * fast_log(abs(u_2)))
            force += np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
            energy += force_1 * abs(u_1) + force_2 * abs(u_2)
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_jacobi(size, slope, nodes, p):
    """Integrate t^p exp(slope t) from 0 to size by four Gauss-Jacobi points with the weight t^p."""
    if size <= 0:
        return 0.0
    total = 0.0
    for i in range(4):
        total += nodes[4 + i] * fast_exp(slope * size * nodes[i])
    return total * fast_exp((p + 1) * fast_log(size))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_power_strip(displacement, bonds, k, p, nodes, is_force):
    """Integrate |u|^p over a strip near u = 0.

    Each side is a difference of two integrals that begin at u = 0.
    """
    start = bonds[STRIP.start, k]
    end = bonds[STRIP.end, k]
    step = end - start
    slope = bonds[STRIP.age_width, k] / step
    low = min(start, end)
    high = max(start, end)
    integral_below = _integrate_jacobi(displacement - low, -slope, nodes, p)
    integral_below -= _integrate_jacobi(displacement - high, -slope, nodes, p)
    integral_above = _integrate_jacobi(high - displacement, slope, nodes, p)
    integral_above -= _integrate_jacobi(low - displacement, slope, nodes, p)
    density = 2 * bonds[POWER_ROW.weight_1, k] / abs(step)
    density *= exp(slope * (displacement - end + GAUSS_POINT_1 * step))
    return density * (
        integral_below - integral_above if is_force else integral_below + integral_above
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def average_spread(displacement, low, high, p):
    """Average |u|^p sgn u and |u|^(p + 1) over bonds that are distributed uniformly over a range.

    Parameters
    ----------
    displacement, low, high : float
        Present relative displacement and ends of the range [m], low < high.
    p : float
        Exponent.

    Returns
    -------
    BondSum
    """
    width = high - low
    middle = displacement - (low + high) / 2
    if p == 0.0:
        distance = abs(middle)
        if 2 * distance >= width:
            return BondSum(np.sign(middle), distance)
        return BondSum(2 * middle / width, width / 4 + middle * middle / width)
    if width < MIN_SPREAD_RATIO * abs(middle) or width == 0:
        power = fast_exp(p * fast_log(abs(middle)))
        return BondSum(power * np.sign(middle), power * abs(middle))
    u = displacement - low
    v = displacement - high
    power_u = fast_exp((p + 1) * fast_log(abs(u)))
    power_v = fast_exp((p + 1) * fast_log(abs(v)))
    force = (power_u - power_v) / ((p + 1) * width)
    return BondSum(force, (power_u * u - power_v * v) / ((p + 2) * width))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_linear_density(displacement, start, end, weights, p):
    """Sum w |u|^p sgn u and w |u|^(p + 1) over a strip whose density is linear along it.

    Where u has one sign the sums for p = 0 are those of the Gauss points, so nothing jumps as the displacement
    reaches the strip.

    Parameters
    ----------
    displacement, start, end : float
        Present relative displacement and ends of the strip [m].
    weights : (float, float)
        Weights at both Gauss points.
    p : float
        Exponent.

    Returns
    -------
    BondSum
    """
    weight_1, weight_2 = weights
    step = end - start
    u = displacement - end
    v = displacement - start
    power_u = fast_exp((p + 1) * fast_log(abs(u)))
    power_v = fast_exp((p + 1) * fast_log(abs(v)))
    # These are averages of |u|^p sgn u, |u|^(p + 1) and |u|^(p + 1) u over the strip.
    odd = (power_v - power_u) / ((p + 1) * step)
    even = (power_v * v - power_u * u) / ((p + 2) * step)
    third = (power_v * v * v - power_u * u * u) / ((p + 3) * step)
    slope = 2 * (weight_2 - weight_1) / ((GAUSS_POINT_2 - GAUSS_POINT_1) * step)
    middle = (weight_1 + weight_2) - slope * 0.5 * (u + v)
    return BondSum(middle * odd + slope * even, middle * even + slope * third)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_powers(displacement, damage, bonds, strips, law):
    """Sum the forces and energies of bonds over strips in the form FORM_POWER (eq. 2.17).

    Two Gauss points per strip are exact enough away from u = 0. A strip near u = 0 is integrated from there; if it is
    as narrow for its age as a merged strip, its density is taken as linear.

    Parameters
    ----------
    displacement, damage : float
        Present relative displacement [m] and damage [1].
    bonds, strips : array, Range
        Array of strips, and those that are summed.
    law : (24,) array
        Numbers of `LAW`.

    Returns
    -------
    BondSum
        Scaled sums of w |u|^p sgn u and of w |u|^(p + 1).
    """
    p = law[LAW.order]
    merge_width = law[LAW.merge_width] * law[LAW.length]
    nodes = law[LAW.nodes :]
    total = _sum_gauss_powers(displacement, bonds, strips.first, strips.end, p)
    force = total.force
    energy = total.energy
    is_polynomial = p == 3.0
    # Fractional powers are singular at u = 0, which also affects Gauss points in strips nearby.
    reach = 1.0 if p == 0.0 or p == 2.0 else 5.0
    for k in range(strips.end if is_polynomial else strips.first, strips.end):
        start = bonds[STRIP.start, k]
        end = bonds[STRIP.end, k]
        width = abs(end - start)
        if abs(2 * displacement - start - end) > reach * width:
            continue
        is_narrow = width <= merge_width * fast_exp((damage - bonds[STRIP.age_measure, k]) / 3)
        if is_narrow and p >= 1:
            continue
        gauss = _sum_gauss_powers(displacement, bonds, k, k + 1, p)
        if is_narrow:
            weights = (bonds[POWER_ROW.weight_1, k], bonds[POWER_ROW.weight_2, k])
            exact = sum_linear_density(displacement, start, end, weights, p)
        else:
            exact = BondSum(
                _integrate_power_strip(displacement, bonds, k, p, nodes, True),
                _integrate_power_strip(displacement, bonds, k, p + 1, nodes[8:], False),
            )
        force += exact.force - gauss.force
        energy += exact.energy - gauss.energy
    for k in range(strips.head, strips.first):
        average = average_spread(displacement, bonds[STRIP.start, k], bonds[STRIP.end, k], p)
        force += bonds[POWER_ROW.weight_1, k] * average.force
        energy += bonds[POWER_ROW.weight_1, k] * average.energy
    return BondSum(force, energy)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _sum_report_closed(displacement, path, bonds, strips, law):
    """Sum strips for friction.reading = "report" for p = 0, 1 or 2, where P(p + 1, x) is elementary.

    The bond length is constant, and each strip has been passed only once.

    With S(x) = 1 - P(p + 1, x) the integral of y phi(y) from 0 to x is (p + 1) (1 - S(x)) - x phi(x).
    """
    p = law[LAW.order]
    eps0 = law[LAW.length]
    force = 0.0
    energy = 0.0
    # These are the coefficients of S(x) = (1 + linear x (1 + quadratic x)) exp(-x) and of x phi(x).
    linear = min(p, 1.0)
    quadratic = max(p - 1, 0.0) * 0.5
    phi_0 = 1.0 - linear
    phi_1 = linear * (1.0 if p == 1.0 else 0.0)
    phi_2 = quadratic
    for k in range(uint64(strips.first), uint64(strips.end)):
        end = bonds[STRIP.end, k]
        step = end - bonds[STRIP.start, k]
        direction = np.copysign(1.0, step)
        path_to_end = path - bonds[STRIP.age_measure, k]
        zero_position = min(max(direction * (end - displacement), 0.0), abs(step))
        # The path in bond lengths since bonds formed is x at the end of the strip, y at u = 0 and z
        # at the start.
        x = path_to_end / eps0
        y = (path_to_end + zero_position) / eps0
        z = (path_to_end + abs(step)) / eps0
        exp_x = fast_exp(-x)
        exp_y = fast_exp(-y)
        exp_z = fast_exp(-z)
        s_x = (1 + linear * x * (1 + quadratic * x)) * exp_x
        s_y = (1 + linear * y * (1 + quadratic * y)) * exp_y
        s_z = (1 + linear * z * (1 + quadratic * z)) * exp_z
        signed = 2 * s_y - s_x - s_z
        pressure = bonds[REPORT_ROW.pressure, k]
        density_x = exp_x * x * (phi_0 + x * (phi_1 + x * phi_2))
        density_y = exp_y * y * (phi_0 + y * (phi_1 + y * phi_2))
        density_z = exp_z * z * (phi_0 + z * (phi_1 + z * phi_2))
        lever = (p + 1) * signed + 2 * density_y - density_x - density_z
        offset = direction * (displacement - end - direction * path_to_end)
        force += pressure * (direction * signed)
        energy += pressure * (offset * signed + eps0 * lever)
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_report_table(displacement, path, bonds, strips, law, table):
    """Sum strips for friction.reading = "report" at a constant bond length, with a table of P(p + 1, x).

    It holds for any order p and strips that have been passed only once.
    """
    p = law[LAW.order]
    eps0 = law[LAW.length]
    inverse_gamma = law[LAW.inverse_gamma]
    force = 0.0
    energy = 0.0
    # The values at the start of a strip are those at the end of the preceding one, which is visited
    # next.
    last = -1.0
    last_lever = 0.0
    for k in range(strips.end - 1, strips.first - 1, -1):
        end = bonds[STRIP.end, k]
        step = end - bonds[STRIP.start, k]
        direction = np.copysign(1.0, step)
        path_to_end = path - bonds[STRIP.age_measure, k]
        zero_position = min(max(direction * (end - displacement), 0.0), abs(step))
        x = path_to_end / eps0
        z = (path_to_end + abs(step)) / eps0
        if last < 0:
            last = interpolate_gammainc(p, x, table, inverse_gamma)
            last_lever = _integrate_lever(p, x, last, inverse_gamma)
        p_x = last
        lever_x = last_lever
        last = interpolate_gammainc(p, z, table, inverse_gamma)
        last_lever = _integrate_lever(p, z, last, inverse_gamma)
        p_y = p_x if zero_position == 0 else last
        lever_y = lever_x if zero_position == 0 else last_lever
        if 0 < zero_position < abs(step):
            y = (path_to_end + zero_position) / eps0
            p_y = interpolate_gammainc(p, y, table, inverse_gamma)
            lever_y = _integrate_lever(p, y, p_y, inverse_gamma)
        signed = last - 2 * p_y + p_x
        lever = last_lever - 2 * lever_y + lever_x
        pressure = bonds[REPORT_ROW.pressure, k]
        offset = direction * (displacement - end - direction * path_to_end)
        force += pressure * (direction * signed)
        energy += pressure * (offset * signed + eps0 * lever)
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_report(displacement, path, bonds, strips, law, table):
    """Compute the exact sum of strips for friction.reading = "report" at a constant bond length (eq. 2.17).

    A strip of one pass is split where u changes its sign.

    Parameters
    ----------
    displacement, path : float
        Present relative displacement and path [m].
    bonds, strips : array, Range
        Array of strips, and those that are summed.
    law : (24,) array
        Numbers of `LAW`.
    table : (k,) array
        As `list_math_kernels.interpolate_gammainc` takes it.

    Returns
    -------
    BondSum
        Force [1] and energy [m] per friction limit.
    """
    p = law[LAW.order]
    eps0 = law[LAW.length]
    inverse_gamma = law[LAW.inverse_gamma]
    if p == 0.0 or p == 1.0 or p == 2.0:
        total = _sum_report_closed(displacement, path, bonds, strips, law)
    else:
        total = _sum_report_table(displacement, path, bonds, strips, law, table)
    force = total.force
    energy = total.energy
    for k in range(strips.head, strips.first):
        path_to_end = path - bonds[STRIP.age_measure, k]
        average = average_spread(displacement, bonds[STRIP.start, k], bonds[STRIP.end, k], 0.0)
        older = interpolate_gammainc(
            p, (path_to_end + bonds[STRIP.age_width, k]) / eps0, table, inverse_gamma
        )
        younger = interpolate_gammainc(p, path_to_end / eps0, table, inverse_gamma)
        full_force = bonds[REPORT_ROW.pressure, k] * (older - younger)
        force += average.force * full_force
        energy += average.energy * full_force
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_lever(p, x, gamma_p, inverse_gamma):
    """Return the integral of y phi(y) from 0 to x: (p + 1) P(p + 1, x) - x phi(x).

    gamma_p is P(p + 1, x).
    """
    if x <= 0:
        return 0.0
    return (p + 1) * gamma_p - inverse_gamma * fast_exp((p + 1) * fast_log(x) - x)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def _gauss_path_ratios(path, mature, bonds, k):
    """Return the path / bond length R/eps of growing bonds at both Gauss points of a strip."""
    path_to_end = path - bonds[STRIP.age_measure, k]
    width = bonds[STRIP.age_width, k]
    min_length = MIN_LENGTH_RATIO * mature.length
    length_1 = max(mature.length - mature.scale * bonds[GROWING_ROW.length_1, k], min_length)
    length_2 = max(mature.length - mature.scale * bonds[GROWING_ROW.length_2, k], min_length)
    path_1 = max(path_to_end + GAUSS_POINT_1 * width, MIN_PATH)
    path_2 = max(path_to_end + GAUSS_POINT_2 * width, MIN_PATH)
    return path_1 / length_1, path_2 / length_2


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _sum_gauss_growing(displacement, path, mature, bonds, strips, p):
    """Sum W/2 f(R/eps) sgn u, and this times |u|, over both Gauss points of growing strips."""
    force = 0.0
    energy = 0.0
    if p == 1.0:
        for k in range(uint64(strips.first), uint64(strips.end)):
            u_1, u_2 = _gauss_stretches(displacement, bonds, k)
            x_1, x_2 = _gauss_path_ratios(path, mature, bonds, k)
            force_1 = bonds[STRIP.weight, k] * x_1 * fast_exp(-x_1)
            force_2 = bonds[STRIP.weight, k] * x_2 * fast_exp(-x_2)
            force += np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
            energy += force_1 * abs(u_1) + force_2 * abs(u_2)
    else:
        for k in range(uint64(strips.first), uint64(strips.end)):
            u_1, u_2 = _gauss_stretches(displacement, bonds, k)
            x_1, x_2 = _gauss_path_ratios(path, mature, bonds, k)
            force_1 = bonds[STRIP.weight, k] * fast_exp(p * fast_log(x_1) - x_1)
            force_2 = bonds[STRIP.weight, k] * fast_exp(p * fast_log(x_2) - x_2)
            force += np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
            energy += force_1 * abs(u_1) + force_2 * abs(u_2)
    return BondSum(0.5 * force, 0.5 * energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def interpolate_start_length(fraction, length_1, length_2):
    """Interpolate the scaled starting length of bonds log-linearly between the Gauss points.

    Parameters
    ----------
    fraction : float
        Position as a fraction of the strip, measured from its end.
    length_1, length_2 : float
        Values at the Gauss points, 0 once nothing is left of them.

    Returns
    -------
    float
    """
    if length_1 > MIN_PATH and length_2 > MIN_PATH:
        rise = (fraction - GAUSS_POINT_1) / (GAUSS_POINT_2 - GAUSS_POINT_1)
        return length_1 * exp(rise * (fast_log(length_2) - fast_log(length_1)))
    return max(length_1, length_2)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _bond_length(fraction, mature, bonds, k):
    """Return the bond length [m] at a position within a strip; it approaches the length of fully grown bonds."""
    start = interpolate_start_length(
        fraction, bonds[GROWING_ROW.length_1, k], bonds[GROWING_ROW.length_2, k]
    )
    return max(mature.length - mature.scale * start, MIN_LENGTH_RATIO * mature.length)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _is_steep(p):
    """Return whether R^p is so steep near R = 0 that two Gauss points do not suffice."""
    return p < 2 and p != np.floor(p)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_growing_strip(displacement, path, mature, bonds, k, p):
    """Integrate a strip of growing bonds on each side of u = 0 by two Gauss points.

    The length of a young bond is proportional to R, so (R/length)^p is smooth and the points are those of R. Where the
    bonds grew at rest instead, R^p is steep towards R = 0; the points are then those of R^(p + 1), which is exact.
    """
    start = bonds[STRIP.start, k]
    end = bonds[STRIP.end, k]
    width = bonds[STRIP.age_width, k]
    step = end - start
    path_to_end = max(path - bonds[STRIP.age_measure, k], 0.0)
    force = 0.0
    energy = 0.0
    zero_position = min(max((end - displacement) / step, 0.0), 1.0)
    is_steep = False
    if _is_steep(p):
        last = _bond_length(0.0, mature, bonds, k)
        first = _bond_length(1.0, mature, bonds, k)
        grew_at_rest = last > MIN_GROWING_RATIO * first
        is_steep = grew_at_rest and path_to_end * first < 0.5 * (path_to_end + width) * last
    for side in range(2):
        low = 0.0 if side == 0 else zero_position
        high = zero_position if side == 0 else 1.0
        if high <= low:
            continue
        for point in range(2):
            gauss = GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2
            fraction = low + gauss * (high - low)
            weight = 0.5 * (high - low) * width
            if is_steep:
                power_low = (path_to_end + low * width) ** (p + 1)
                power_high = (path_to_end + high * width) ** (p + 1)
                position = (power_low + gauss * (power_high - power_low)) ** (1 / (p + 1))
                fraction = (position - path_to_end) / width
                weight = 0.5 * (power_high - power_low) / (p + 1) * position ** (-p)
            x = max(path_to_end + fraction * width, MIN_PATH) / _bond_length(
                fraction, mature, bonds, k
            )
            point_force = weight * fast_exp(p * fast_log(x) - x)
            u = displacement - end + fraction * step
            force += np.copysign(point_force, u)
            energy += point_force * abs(u)
    density = bonds[STRIP.weight, k] / width
    return BondSum(density * force, density * energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _spread_growing_strip(displacement, path, mature, bonds, k, p):
    """Sum a strip of growing bonds that are distributed uniformly over its range; each bond keeps its age."""
    low = min(bonds[STRIP.start, k], bonds[STRIP.end, k])
    high = max(bonds[STRIP.start, k], bonds[STRIP.end, k])
    average = average_spread(displacement, low, high, 0.0)
    # At a position outside the strip all bonds pull in one direction, so their sum there is the
    # force that they can carry.
    beyond = high + bonds[STRIP.age_width, k]
    full_force = _sum_gauss_growing(beyond, path, mature, bonds, StripRange(k, k, k + 1), p).force
    return BondSum(average.force * full_force, average.energy * full_force)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_growing(displacement, path, mature, bonds, strips, law):
    """Sum strips for friction.reading = "report" with growing bonds (eqs. 2.10 and 2.17).

    Parameters
    ----------
    displacement, path : float
        Present relative displacement and path [m].
    mature : MatureBonds
        Length of mature bonds, and factor that undoes the scale of the starting lengths.
    bonds, strips : array, Range
        Array of strips, and those that are summed.
    law : (24,) array
        Numbers of `LAW`.

    Returns
    -------
    BondSum
        Force [m] and energy [m2], without the factor 1/(eps_0 Gamma(p + 1)).
    """
    p = law[LAW.order]
    merge_width = law[LAW.merge_width] * law[LAW.length]
    total = _sum_gauss_growing(displacement, path, mature, bonds, strips, p)
    force = total.force
    energy = total.energy
    for k in range(strips.first, strips.end):
        from_start = displacement - bonds[STRIP.start, k]
        from_end = displacement - bonds[STRIP.end, k]
        path_to_end = path - bonds[STRIP.age_measure, k]
        width = bonds[STRIP.age_width, k]
        is_young = _is_steep(p) and path_to_end <= 3 * width
        if from_start * from_end >= 0 and not is_young:
            continue
        strip = StripRange(k, k, k + 1)
        gauss = _sum_gauss_growing(displacement, path, mature, bonds, strip, p)
        is_narrow = width <= merge_width * fast_exp(path_to_end / (3 * mature.length))
        if not is_young and is_narrow and path_to_end > mature.length:
            exact = _spread_growing_strip(displacement, path, mature, bonds, k, p)
        else:
            exact = _integrate_growing_strip(displacement, path, mature, bonds, k, p)
        force += exact.force - gauss.force
        energy += exact.energy - gauss.energy
    for k in range(strips.head, strips.first):
        x_1, x_2 = _gauss_path_ratios(path, mature, bonds, k)
        full_force = fast_exp(p * fast_log(x_1) - x_1) + fast_exp(p * fast_log(x_2) - x_2)
        full_force *= 0.5 * bonds[STRIP.weight, k]
        average = average_spread(displacement, bonds[STRIP.start, k], bonds[STRIP.end, k], 0.0)
        force += average.force * full_force
        energy += average.energy * full_force
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_initial(displacement, path, damage, law):
    """Return force and energy of the initial bonds: density m_0, unstressed at displacement 0.

    Their force may jump at displacement 0, to the round-off of the path; there it is 0, the mean of both sides. If the
    law distributes them over a width, they store nothing at displacement 0.

    Parameters
    ----------
    displacement, path, damage : float
        Present relative displacement [m], path [m] and damage [1].
    law : (24,) array
        Numbers of `LAW`.

    Returns
    -------
    BondSum
        Force [1] and energy [m] per friction limit.
    """
    p = law[LAW.order]
    eps0 = law[LAW.length]
    initial = law[LAW.initial]
    half_width = law[LAW.half_width]
    is_at_place = half_width == 0 and abs(displacement) <= UNSTRESSED_TOL * path
    if initial == 0 or is_at_place:
        return BondSum(0.0, 0.0)
    if law[LAW.form] <= FORM_POWER:
        weight = (
            initial * law[LAW.inverse_gamma] * fast_exp(-damage) * fast_exp(-p * fast_log(eps0))
        )
        if half_width > 0:
            average = average_spread(displacement, -half_width, half_width, p)
            at_rest = fast_exp((p + 1) * fast_log(half_width)) / (p + 2)
            energy = weight * (average.energy - at_rest) / (p + 1)
            return BondSum(weight * average.force, energy)
        force = weight * fast_exp(p * fast_log(abs(displacement)))
        return BondSum(force * np.sign(displacement), force * abs(displacement) / (p + 1))
    force = initial * law[LAW.inverse_gamma] * fast_exp(p * fast_log(path / eps0) - path / eps0)
    if half_width > abs(displacement):
        energy = force * displacement * displacement / (2 * half_width)
        return BondSum(force * displacement / half_width, energy)
    return BondSum(force * np.sign(displacement), force * (abs(displacement) - half_width / 2))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def average_initial(increment, displacement, path, law):
    """Return the exact mean force of the initial bonds over an increment, for friction.reading = "report".

    The force jumps at displacement 0, or changes its sign over the width over which the bonds are distributed.

    Parameters
    ----------
    increment, displacement, path : float
        Increment [m]; relative displacement and path [m] before it.
    law : (24,) array
        Numbers of `LAW`.

    Returns
    -------
    float
        Path-mean force [1] per friction limit.
    """
    p = law[LAW.order]
    eps0 = law[LAW.length]
    half_width = law[LAW.half_width]
    size = abs(increment)
    if law[LAW.initial] == 0:
        return 0.0
    direction = np.copysign(1.0, increment)
    # These are the lengths of the increment before it enters and before it leaves the range of the
    # bonds.
    path_to_entry = min(max(-direction * displacement - half_width, 0.0), size)
    path_to_exit = min(max(-direction * displacement + half_width, 0.0), size)
    p_start = bond_gammainc(p, path / eps0)
    p_entry = bond_gammainc(p, (path + path_to_entry) / eps0)
    p_exit = bond_gammainc(p, (path + path_to_exit) / eps0)
    total = bond_gammainc(p, (path + size) / eps0) - p_exit - (p_entry - p_start)
    if path_to_exit > path_to_entry:
        middle = 0.5 * (
            direction * displacement + path_to_entry + (direction * displacement + path_to_exit)
        )
        total += (p_exit - p_entry) * middle / half_width
    return direction * law[LAW.initial] * total * eps0 / size


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def formed_force(path, eps, law):
    """Return the force [1] of the bonds that form on a straight increment / friction limit.

    Parameters
    ----------
    path, eps : float
        Length of the increment, bond length [m].
    law : (24,) array
        Numbers of `LAW`.

    Returns
    -------
    float
    """
    return eps / law[LAW.length] * bond_gammainc(law[LAW.order], path / eps)
