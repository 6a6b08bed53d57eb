"""Compiled sums over a list of strips of bonds (eq. 2.17): force and stored energy.

In a strip u is the relative displacement since a bond formed, and R the path since then. Per friction limit a bond carries
(|u|/eps)^p exp(-damage) for reading="stretch", and (R/eps)^p exp(-R/eps) for reading="report", along u/|u|. The arrays
are described in `list_rows_kernels`.

Every strip gets its force and energy for unit pressure (`sum_strips`). Two Gauss points suffice, except near u = 0, where
the force has a kink or jumps, and near R = 0, where a fractional power of R is steep. Such a strip is divided into pieces
on which the density of bonds is taken as linear; the power is then integrated exactly (`_average_power`). A constant bond
length has a closed form (`_sum_report`).
"""

from math import ceil, exp
from typing import NamedTuple

import numpy as np
from numba import uint64

from ...compiled.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from .list_math_kernels import bond_gammainc, fast_exp, fast_log, power, whole_power
from .list_rows_kernels import (
    FORM_REPORT,
    FORM_STRETCH,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
    LAW,
    PATH,
    STATUS,
    STRIP,
)

# Largest displacement, relative to the path, at which the initial bonds count as unstressed
UNSTRESSED_TOL = 1e-14
# Smallest length of a growing bond relative to that of mature bonds; it keeps R/length finite
MIN_BOND_RATIO = 1e-9
PATH_ROUND_OFF = 1e-15  # largest difference of two equal paths, relative to the whole path
MIN_POSITIVE = 1e-300  # smallest path [m] or value whose logarithm is taken
# Distance of u = 0 from the middle of a strip, in half lengths of the strip, from which two Gauss points suffice
KINK_REACH = 1.0  # for whole orders: the strip does not contain u = 0
SINGULAR_REACH = 5.0  # for fractional powers of u
# Ratio of R to the length of a strip above which two Gauss points suffice for a fractional power of R
STEEP_REACH = 3.0
# Ratio of the last to the first bond length of a strip above which its bonds grew at rest, not along the strip
MIN_RESTING_RATIO = 0.05
# Largest damage along a piece, and largest number of pieces; with them the linear density of a piece changes the force
# by less than 2e-6 of the friction limit
MAX_PIECE_DAMAGE = 0.07
MAX_STRIP_PIECES = 4
# Ratio of u to the length of a piece from which two Gauss points are more exact than a difference of powers
FAR_RATIO = 30.0


class BondSum(NamedTuple):
    """Sums of force [1] and stored energy [m] over bonds, per friction limit."""

    force: float
    energy: float


class PathValues(NamedTuple):
    """State of the path of a list of bonds after an increment.

    - displacement: relative displacement [m]
    - path: length of the path [m]
    - damage: integral of dR/eps along the path [1], for reading="stretch"
    - growth: exponent J of the growth of bonds [1]
    - length: bond length [m]
    - middle_length: bond length in the middle of the increment [m]
    """

    displacement: float
    path: float
    damage: float
    growth: float
    length: float
    middle_length: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_strips(after, bonds):
    """Write force [1] and stored energy [m] of every strip for unit pressure.

    Parameters
    ----------
    after : PathValues
        State of the path for which the sum is taken.
    bonds : BondList
        Its rows `STRIP.force` and `STRIP.energy` receive the sums.
    """
    law = bonds.law
    form = law[LAW.form]
    if form == FORM_REPORT:
        _sum_report(after, bonds)
        return

    strips = bonds.bondlist
    scale = _value_scale(after, bonds)
    # Force and energy of a strip are integrals over its bonds of |f| and |f u|, times these factors. A bond of
    # reading="stretch" stores f u/(p + 1), because its force is proportional to |u|^p. One of reading="report" stores f u,
    # because its force depends on the path alone, and so stays while the stretch goes to 0.
    p = law[LAW.order]
    force_factor = law[LAW.inverse_gamma] / law[LAW.length]
    energy_factor = force_factor
    if form == FORM_STRETCH:
        force_factor *= scale
        energy_factor = force_factor / (p + 1)

    # Two Gauss points sum all strips in a loop without branches. Strips for which this is not exact enough are then
    # integrated again.
    if form == FORM_STRETCH:
        _sum_gauss_stretch(after, force_factor, energy_factor, bonds)
    else:
        _sum_gauss_growing(after, scale, force_factor, bonds)
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end])):
        if not _suits_gauss(after, bonds, k, p, form):
            exact = _integrate_strip(after, scale, bonds, k)
            strips[STRIP.force, k] = force_factor * exact.force
            strips[STRIP.energy, k] = energy_factor * exact.energy


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _value_scale(after, bonds):
    """Return the factor by which the stored values of the strips are multiplied to get those after an increment.

    The values are stored relative to a reference (`list_rows_kernels`), so that an increment need not change all of
    them.
    """
    reference = bonds.now[PATH.reference]
    if bonds.law[LAW.form] == FORM_STRETCH:
        return exp(reference - after.damage)
    return exp(reference - after.growth)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _suits_gauss(after, bonds, column, p, form):
    """Return whether two Gauss points sum a strip exactly enough.

    They do not near u = 0, where the force has a kink or is singular, nor among young growing bonds of an order that is no
    whole number.

    Parameters
    ----------
    after : PathValues
        Path state at which the strip is summed.
    bonds : list_rows_kernels.BondList
        List of bonds.
    column : int
        Column of the strip.
    p : float
        Order of the law.
    form : float
        FORM_STRETCH or FORM_GROWING.
    """
    strips = bonds.bondlist
    start = strips[STRIP.start, column]
    end = strips[STRIP.end, column]
    distance = abs(2 * after.displacement - start - end)
    if form == FORM_STRETCH:
        if p == 1.0 or p == 3.0:
            return True
        reach = KINK_REACH if p == 0.0 or p == 2.0 else SINGULAR_REACH
        return distance > reach * abs(end - start)
    is_steep = p < 2 and p != np.floor(p)
    is_young = (
        after.path - strips[STRIP.path, column] <= STEEP_REACH * strips[STRIP.covered, column]
    )
    return distance > KINK_REACH * abs(end - start) and not (is_steep and is_young)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _sum_gauss_stretch(after, force_factor, energy_factor, bonds):
    """Write force and energy of all strips for reading="stretch" by two Gauss points each.

    With the stretch u_g = q - q_g of the bonds that formed at the Gauss point q_g, when the displacement is q, and their
    weights w_g (the values of the strip),

        force = force_factor sum_g w_g |u_g|^p sgn u_g,    energy = energy_factor sum_g w_g |u_g|^(p + 1).

    Parameters
    ----------
    after : PathValues
        Path state at which the strips are summed.
    force_factor, energy_factor : float
        Factors of the sums, which include the scale of the values of the strips.
    bonds : list_rows_kernels.BondList
        List of bonds, whose forces and energies are overwritten.
    """
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    is_whole = p == 0.0 or p == 1.0 or p == 2.0
    for k in range(uint64(bonds.status[STATUS.head]), uint64(bonds.status[STATUS.end])):
        end = strips[STRIP.end, k]
        step = end - strips[STRIP.start, k]
        u_1 = after.displacement - end + GAUSS_POINT_1 * step
        u_2 = after.displacement - end + GAUSS_POINT_2 * step
        if is_whole:
            power_1 = whole_power(abs(u_1), p)
            power_2 = whole_power(abs(u_2), p)
        else:
            power_1 = fast_exp(p * fast_log(abs(u_1)))
            power_2 = fast_exp(p * fast_log(abs(u_2)))
        force_1 = strips[STRIP.value_1, k] * power_1
        force_2 = strips[STRIP.value_2, k] * power_2
        force = np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
        strips[STRIP.force, k] = force_factor * force
        strips[STRIP.energy, k] = energy_factor * (force_1 * abs(u_1) + force_2 * abs(u_2))


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def _sum_gauss_growing(after, scale, factor, bonds):
    """Write force and energy of all strips of growing bonds by two Gauss points each.

    Parameters
    ----------
    after : PathValues
        Path state at which the strips are summed.
    scale : float
        Factor that undoes the scale of the values of the strips (`_value_scale`).
    factor : float
        Factor of forces and energies, 1/(Gamma(p + 1) eps_0) [1/m].
    bonds : list_rows_kernels.BondList
        List of bonds, whose forces and energies are overwritten.
    """
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    is_whole = p == 0.0 or p == 1.0 or p == 2.0
    min_length = MIN_BOND_RATIO * after.length
    for k in range(uint64(bonds.status[STATUS.head]), uint64(bonds.status[STATUS.end])):
        # Stretch u and path R of the bonds at both Gauss points
        end = strips[STRIP.end, k]
        step = end - strips[STRIP.start, k]
        u_1 = after.displacement - end + GAUSS_POINT_1 * step
        u_2 = after.displacement - end + GAUSS_POINT_2 * step
        covered = strips[STRIP.covered, k]
        path = after.path - strips[STRIP.path, k]

        # Their length is that of mature bonds, less the part of their initial difference from it that growth has not
        # removed yet (eq. 2.10)
        length_1 = max(after.length - scale * strips[STRIP.value_1, k], min_length)
        length_2 = max(after.length - scale * strips[STRIP.value_2, k], min_length)
        x_1 = max(path + GAUSS_POINT_1 * covered, MIN_POSITIVE) / length_1
        x_2 = max(path + GAUSS_POINT_2 * covered, MIN_POSITIVE) / length_2

        # A bond acts with (R/eps)^p exp(-R/eps) in the direction of its stretch, as eq. 2.17 is printed
        if is_whole:
            force_1 = whole_power(x_1, p) * fast_exp(-x_1)
            force_2 = whole_power(x_2, p) * fast_exp(-x_2)
        else:
            force_1 = fast_exp(p * fast_log(x_1) - x_1)
            force_2 = fast_exp(p * fast_log(x_2) - x_2)
        force = np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
        weight = 0.5 * factor * covered
        strips[STRIP.force, k] = weight * force
        strips[STRIP.energy, k] = weight * (force_1 * abs(u_1) + force_2 * abs(u_2))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def interpolate_value(fraction, value_1, value_2):
    """Interpolate between the values at both Gauss points of a strip, log-linearly where both are positive.

    Parameters
    ----------
    fraction : float
        Position as a fraction of the strip, measured from its end.
    value_1, value_2 : float
        Values at the Gauss points, >= 0.

    Returns
    -------
    float
    """
    if value_1 > MIN_POSITIVE and value_2 > MIN_POSITIVE:
        rise = (fraction - GAUSS_POINT_1) / (GAUSS_POINT_2 - GAUSS_POINT_1)
        return value_1 * exp(rise * (fast_log(value_2) - fast_log(value_1)))
    return max(value_1, value_2)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_strip(after, scale, bonds, column):
    """Integrate a strip on each side of u = 0, in pieces of linear density.

    `after` is the path state at which the strip is summed, and `column` its column in the list `bonds`. `scale` is the
    factor that undoes the scale of the values of the strips (`_value_scale`).
    """
    strips = bonds.bondlist
    start = strips[STRIP.start, column]
    end = strips[STRIP.end, column]
    is_stretch = bonds.law[LAW.form] == FORM_STRETCH

    # The power |u|^p is not smooth at u = 0, so a strip that contains it is divided there
    zero_position = 0.0
    if end != start:
        zero_position = min(max((end - after.displacement) / (end - start), 0.0), 1.0)

    # The density exp(damage) is close to linear on a piece along which the damage is small
    n_pieces = 1
    if is_stretch:
        ratio = max(strips[STRIP.value_1, column], MIN_POSITIVE) / max(
            strips[STRIP.value_2, column], MIN_POSITIVE
        )
        damage = fast_log(ratio) / (GAUSS_POINT_2 - GAUSS_POINT_1)
        n_pieces = min(max(ceil(abs(damage) / MAX_PIECE_DAMAGE), 1), MAX_STRIP_PIECES)

    force = 0.0
    energy = 0.0
    for side in range(2):
        low = 0.0 if side == 0 else zero_position
        high = zero_position if side == 0 else 1.0
        if high <= low:
            continue
        for piece in range(n_pieces):
            piece_low = low + (high - low) * piece / n_pieces
            piece_high = low + (high - low) * (piece + 1) / n_pieces
            if is_stretch:
                part = _integrate_stretch_piece(after, bonds, column, piece_low, piece_high)
            else:
                part = _integrate_growing_piece(after, scale, bonds, column, piece_low, piece_high)
            force += part.force
            energy += part.energy
    return BondSum(force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_stretch_piece(after, bonds, column, low, high):
    """Integrate c |u|^p sgn u and c |u|^(p + 1) over a part of a strip, with the stretch u and the weight c of its bonds.

    Parameters
    ----------
    after : PathValues
        Path state at which the strip is summed.
    bonds : list_rows_kernels.BondList
        List of bonds.
    column : int
        Column of the strip.
    low, high : float
        Ends of the part, as fractions of the length of the strip from its end.

    Returns
    -------
    BondSum
    """
    strips = bonds.bondlist
    value_1 = strips[STRIP.value_1, column]
    value_2 = strips[STRIP.value_2, column]
    width = high - low
    weight_1 = value_1
    weight_2 = value_2
    if width < 1:
        weight_1 = width * interpolate_value(low + GAUSS_POINT_1 * width, value_1, value_2)
        weight_2 = width * interpolate_value(low + GAUSS_POINT_2 * width, value_1, value_2)
    step = strips[STRIP.end, column] - strips[STRIP.start, column]
    u_low = after.displacement - strips[STRIP.end, column] + low * step
    u_high = after.displacement - strips[STRIP.end, column] + high * step
    p = bonds.law[LAW.order]
    return _average_power(u_low, u_high, weight_1, weight_2, p)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_growing_piece(after, scale, bonds, column, low, high):
    """Integrate (R/eps)^p exp(-R/eps) sgn u, and this times |u|, over a part of a strip on one side of u = 0.

    Young bonds that grew along the strip have a length proportional to R, so (R/eps)^p is smooth. Where they grew at
    rest instead, R^p is integrated exactly and the rest is taken as linear.

    Parameters
    ----------
    after : PathValues
        Path state at which the strip is summed.
    scale : float
        Factor that undoes the scale of the values of the strips.
    bonds : list_rows_kernels.BondList
        List of bonds.
    column : int
        Column of the strip.
    low, high : float
        Ends of the part, as fractions of the length of the strip from its end.

    Returns
    -------
    BondSum
    """
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    value_1 = strips[STRIP.value_1, column]
    value_2 = strips[STRIP.value_2, column]
    covered = strips[STRIP.covered, column]
    path = max(after.path - strips[STRIP.path, column], 0.0)
    step = strips[STRIP.end, column] - strips[STRIP.start, column]

    # Where bonds grew while the strip formed, the last ones to form have a length near 0. Otherwise (R/eps)^p is not
    # smooth at R = 0, and R^p is integrated exactly.
    last = _bond_length(0.0, after, scale, value_1, value_2)
    first = _bond_length(1.0, after, scale, value_1, value_2)
    is_steep = p < 2 and p != np.floor(p) and last > MIN_RESTING_RATIO * first
    steep_power = p if is_steep else 0.0

    # The density without R^steep_power at both Gauss points, and the same times |u|
    width = high - low
    force_1 = force_2 = 0.0
    energy_1 = energy_2 = 0.0
    sign = 1.0
    for point in range(2):
        fraction = low + (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2) * width
        length = _bond_length(fraction, after, scale, value_1, value_2)
        distance = max(path + fraction * covered, MIN_POSITIVE)
        u = after.displacement - strips[STRIP.end, column] + fraction * step
        density = fast_exp(-distance / length)
        if is_steep:
            density *= power(1 / length, p)
        else:
            density *= power(distance / length, p)
        density *= 0.5 * width * covered

        # The stretch u has the same sign at both points, because the piece lies on one side of u = 0
        sign = np.copysign(1.0, u)
        if point == 0:
            force_1 = density
            energy_1 = density * abs(u)
        else:
            force_2 = density
            energy_2 = density * abs(u)

    r_low = path + low * covered
    r_high = path + high * covered
    force = _average_power(r_low, r_high, force_1, force_2, steep_power).force
    energy = _average_power(r_low, r_high, energy_1, energy_2, steep_power).force
    return BondSum(sign * force, energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _bond_length(fraction, after, scale, value_1, value_2):
    """Return the length [m] of growing bonds at a position within a strip.

    Parameters
    ----------
    fraction : float
        Position, as a fraction of the length of the strip from its end.
    after : PathValues
        Path state, with the length of mature bonds.
    scale : float
        Factor that undoes the scale of the values of the strips.
    value_1, value_2 : float
        Values of the strip at its Gauss points.
    """
    start = interpolate_value(fraction, value_1, value_2)
    return max(after.length - scale * start, MIN_BOND_RATIO * after.length)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _average_power(u_low, u_high, weight_1, weight_2, p):
    """Integrate w |u|^p sgn u and w |u|^(p + 1) over a piece whose density is linear along it.

    Parameters
    ----------
    u_low, u_high : float
        u at both ends of the piece; the density is linear in u.
    weight_1, weight_2 : float
        Weights at the Gauss points, measured from `u_low`; their sum is the weight of the piece.
    p : float
        Exponent.

    Returns
    -------
    BondSum
    """
    width = u_high - u_low

    # Far from u = 0 the power is smooth, and the difference of powers below would cancel
    if abs(u_low + u_high) > FAR_RATIO * abs(width):
        u_1 = u_low + GAUSS_POINT_1 * width
        u_2 = u_low + GAUSS_POINT_2 * width
        force_1 = weight_1 * power(abs(u_1), p)
        force_2 = weight_2 * power(abs(u_2), p)
        force = np.copysign(force_1, u_1) + np.copysign(force_2, u_2)
        return BondSum(force, force_1 * abs(u_1) + force_2 * abs(u_2))
    if width == 0:
        return BondSum(0.0, 0.0)

    # Averages of |u|^p sgn u, |u|^(p + 1) and |u|^(p + 1) u over the piece
    power_low = power(abs(u_low), p) * abs(u_low)
    power_high = power(abs(u_high), p) * abs(u_high)
    odd = (power_high - power_low) / ((p + 1) * width)
    even = (power_high * u_high - power_low * u_low) / ((p + 2) * width)
    third = (power_high * u_high * u_high - power_low * u_low * u_low) / ((p + 3) * width)
    slope = 2 * (weight_2 - weight_1) / ((GAUSS_POINT_2 - GAUSS_POINT_1) * width)
    middle = weight_1 + weight_2 - slope * 0.5 * (u_low + u_high)
    return BondSum(middle * odd + slope * even, middle * even + slope * third)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_report(after, bonds):
    """Write force and energy of all strips for reading="report" at a constant bond length.

    They are differences of P(p + 1, R/eps_0); a strip is split where u changes its sign. The lever int y phi(y) dy =
    (p + 1) P(p + 1, x) - x phi(x) gives the energy.
    """
    strips = bonds.bondlist
    eps0 = bonds.law[LAW.length]
    # The values at the start of a strip are those at the end of the preceding one, which is visited next
    known_path = -1.0
    older = BondSum(0.0, 0.0)
    for k in range(int(bonds.status[STATUS.end]) - 1, int(bonds.status[STATUS.head]) - 1, -1):
        end = strips[STRIP.end, k]
        step = end - strips[STRIP.start, k]
        direction = np.copysign(1.0, step)
        path = after.path - strips[STRIP.path, k]
        zero = min(max(direction * (end - after.displacement), 0.0), abs(step))

        is_known = abs(path - known_path) <= PATH_ROUND_OFF * after.path
        younger = older if is_known else _sum_youngest(path / eps0, bonds)
        known_path = path + abs(step)
        older = _sum_youngest(known_path / eps0, bonds)
        if zero == 0:
            middle = younger
        elif zero == abs(step):
            middle = older
        else:
            middle = _sum_youngest((path + zero) / eps0, bonds)
        signed = older.force - 2 * middle.force + younger.force
        lever = older.energy - 2 * middle.energy + younger.energy
        offset = direction * (after.displacement - end) - path
        strips[STRIP.force, k] = direction * signed
        strips[STRIP.energy, k] = offset * signed + eps0 * lever


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_youngest(x, bonds):
    """Return the force and the lever of the bonds younger than x, for reading="report".

    With phi(y) = y^p exp(-y)/Gamma(p + 1) these are the integrals of phi(y) and of y phi(y) from 0 to x. The first one is
    the regularized incomplete gamma function P(p + 1, x), the second one (p + 1) P(p + 1, x) - x phi(x).

    Parameters
    ----------
    x : float
        Age R/eps_0 of the oldest bonds, where R is the path since they formed [1].
    bonds : list_rows_kernels.BondList
        List of bonds, with the parameters of its law.

    Returns
    -------
    BondSum
        Both integrals [1].
    """
    if x <= 0:
        return BondSum(0.0, 0.0)
    p = bonds.law[LAW.order]
    inverse_gamma = bonds.law[LAW.inverse_gamma]
    density = inverse_gamma * x * power(x, p) * fast_exp(-x)
    total = bond_gammainc(p, x, density, inverse_gamma, bonds.table)
    return BondSum(total, (p + 1) * total - density)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_initial(after, bonds):
    """Return force and energy of the initial bonds for unit pressure: density m_0, unstressed at displacement 0.

    Their force may jump at displacement 0, to the round-off of the path; there it is 0, the mean of both sides. If the
    law distributes them over a width, they store nothing at displacement 0.

    Parameters
    ----------
    after : PathValues
        State of the path for which the sum is taken.
    bonds : BondList
        Its law has the density, the width and the cut-off of the initial bonds.

    Returns
    -------
    BondSum
    """
    law = bonds.law
    p = law[LAW.order]
    eps0 = law[LAW.length]
    half_width = law[LAW.half_width]
    displacement = after.displacement
    weight = law[LAW.initial] * law[LAW.inverse_gamma]
    is_at_place = half_width == 0 and abs(displacement) <= UNSTRESSED_TOL * after.path
    age = PATH.damage if law[LAW.form] == FORM_STRETCH else PATH.path
    is_old = bonds.now[age] > law[LAW.cutoff]
    if weight == 0 or after.path == 0 or is_at_place or is_old:
        return BondSum(0.0, 0.0)

    # (|u|/eps_0)^p exp(-damage) for reading="stretch", (R/eps_0)^p exp(-R/eps_0) for reading="report"
    stretch_power = 0.0
    if law[LAW.form] == FORM_STRETCH:
        stretch_power = p
        weight *= fast_exp(-after.damage) / power(eps0, p)
    else:
        weight *= power(max(after.path / eps0, MIN_POSITIVE), p) * fast_exp(-after.path / eps0)

    # The bonds are unstretched at displacements from -half_width to half_width. The energy that they would store at
    # displacement 0 is subtracted, so that a contact that has not moved stores nothing.
    low = displacement - half_width
    high = displacement + half_width
    total = _average_power(low, high, 0.5 * weight, 0.5 * weight, stretch_power)
    at_rest = 0.0
    if half_width > 0:
        at_rest = weight * power(half_width, stretch_power) * half_width / (stretch_power + 2)
    return BondSum(total.force, (total.energy - at_rest) / (stretch_power + 1))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def average_initial(increment, bonds):
    """Return the mean force of the initial bonds over an increment for unit pressure and reading="report".

    The force is phi(x) = x^p exp(-x)/Gamma(p + 1) of the path x in bond lengths, in the direction of the displacement. It
    jumps at displacement 0, for which the mean is exact, or rises from -phi to phi over the width over which the bonds
    are distributed; there phi is replaced by its mean over the width.

    Parameters
    ----------
    increment : float
        Increment [m] from the present state.
    bonds : BondList
        Its law has the density, the width and the cut-off of the initial bonds.

    Returns
    -------
    float
        Path-mean force [1] per friction limit.
    """
    law = bonds.law
    eps0 = law[LAW.length]
    half_width = law[LAW.half_width]
    if law[LAW.initial] == 0 or bonds.now[PATH.path] > law[LAW.cutoff]:
        return 0.0
    size = abs(increment)
    path = bonds.now[PATH.path]
    direction = np.copysign(1.0, increment)
    along = direction * bonds.now[PATH.displacement]

    # Lengths of the increment before it enters and before it leaves the range of the bonds
    to_entry = min(max(-along - half_width, 0.0), size)
    to_exit = min(max(-along + half_width, 0.0), size)
    at_start = _sum_youngest(path / eps0, bonds).force
    at_entry = at_start
    if to_entry > 0:
        at_entry = _sum_youngest((path + to_entry) / eps0, bonds).force
    at_exit = at_entry
    if to_exit > to_entry:
        at_exit = _sum_youngest((path + to_exit) / eps0, bonds).force

    # The force is -phi before the entry and phi beyond the exit; the integral of phi(R/eps_0) over each part is a
    # difference of P(p + 1, R/eps_0)
    total = _sum_youngest((path + size) / eps0, bonds).force - at_exit - (at_entry - at_start)
    if to_exit > to_entry:
        middle = along + 0.5 * (to_entry + to_exit)
        total += (at_exit - at_entry) * middle / half_width
    return direction * law[LAW.initial] * total * eps0 / size


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_formed(path, eps, bonds):
    """Return force and energy of the bonds that form on a straight increment, for unit pressure.

    Parameters
    ----------
    path, eps : float
        Length of the increment and bond length [m].
    bonds : BondList
        Its law has the order p and the bond length eps_0.

    Returns
    -------
    BondSum
    """
    law = bonds.law
    youngest = _sum_youngest(path / eps, bonds)
    ratio = eps / law[LAW.length]
    # The energy is that of reading="stretch", where R = |u|: f u/(p + 1)
    return BondSum(ratio * youngest.force, ratio * eps * youngest.energy / (law[LAW.order] + 1))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def average_formed(increment, eps, bonds):
    """Return the exact mean force, over an increment, of the bonds that form on it, for unit pressure.

    With x = |increment|/eps it is (1/x) int P(p + 1, y) dy = P(p + 1, x) - (1/x) int y phi(y) dy from 0 to x.

    Parameters
    ----------
    increment, eps : float
        Increment and bond length [m].
    bonds : BondList
        Its law has the order p and the bond length eps_0.

    Returns
    -------
    float
        Path-mean force [1] per friction limit.
    """
    x = abs(increment) / eps
    youngest = _sum_youngest(x, bonds)
    mean = eps / bonds.law[LAW.length] * (youngest.force - youngest.energy / x)
    return np.copysign(mean, increment)
