"""Compiled list of strips of bonds (eq. 2.17): force, mean force, increment and change of load of a point.

The list sums eq. 2.17 along a line for every order and reading. Two numbers of `list_numbers.law_numbers` bound its
length: a cut-off beyond which old strips are dropped, and a width up to which neighbouring strips are joined.

`bonds` is a `list_rows_kernels.BondList`. Forces [1] and stored energies [m] are divided by the friction limit mu_s N.
`increment` is a straight increment [m] from the present state, `v0` the velocity [m/s] at its start and `dt` its duration
[s]; both determine the growth of bonds.
"""

from math import exp, expm1, log1p
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import NJIT_KERNEL, NJIT_NO_REFCOUNT
from .list_math_kernels import fast_exp, power
from .list_rows_kernels import (
    FORM_GROWING,
    FORM_REPORT,
    FORM_STRETCH,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
    LAW,
    MAX_STRIP_LENGTH,
    N_ROWS,
    PATH,
    STATUS,
    STRIP,
)
from .list_sum_kernels import (
    MIN_LENGTH_RATIO,
    BondSum,
    PathValues,
    average_formed,
    average_initial,
    interpolate_value,
    sum_formed,
    sum_initial,
    sum_strips,
)
from .point_kernels import grow

# Path in bond lengths over which the length of the strips of an increment, from young to old, grows e-fold
AGE_PER_WIDTH = 6.0
# Age in bond lengths beyond which the bonds of an increment carry less than round-off
MAX_NEW_AGE = 40.0
# Largest growth J within a strip of growing bonds; with it, two Gauss points per strip sum growing
# bonds to 1e-6 (test_exact_direct_growing_bonds_equal_hand_sum)
MAX_STRIP_GROWTH = 0.5
# Largest number of strips into which growth alone divides an increment; J has no bound after a long
# rest
MAX_GROWTH_STRIPS = 16
# Largest error, relative to the friction limit, of the growing bonds that form on an increment; it
# falls with the fourth power of the number of strips
NEW_BOND_TOL = 1e-9
# Largest distance of an increment from displacement 0, relative to the length of the increment, at
# which it still counts as passing the kink of the initial bonds
TOUCH_TOL = 1e-6
# Smallest increment in bond lengths for which the mean force is computed from energies; for smaller
# increments their difference is less accurate than the force
MIN_ENERGY_STEP = 1e-3
# The same limit for distributed initial bonds, because solvers rely on a force without jumps
MIN_ENERGY_STEP_SPREAD = 1e-6
# Largest increment in bond lengths for which Simpson's rule is accurate enough
MAX_SIMPSON_STEP = 0.1
MAX_SIMPSON_STEP_STEEP = 0.03  # the same limit for an order below 1
MAX_PANEL_LENGTH = 0.5  # largest length of the first panel of five Gauss points, in bond lengths
# Largest exponent of the scaled values before they are rescaled; exp(709) is the largest
# floating-point number
MAX_EXPONENT = 300.0
# Number of strips, in addition to a fifth of the list, by which the list grows before it is merged
# again
MIN_STRIPS_BETWEEN_MERGES = 12
# Increment [bond lengths] at which the slope of the force at rest is the mean of both directions
SLOPE_INCREMENT_RATIO = 1e-9
# Largest starting length of fully grown bonds, relative to their present length
MAX_START_LENGTH_RATIO = 1e-8
MAX_GROWTH_SPAN = 0.1  # largest range of the growth J within a joined strip of growing bonds
# Largest relative decrease of the bond length from the first to the last bond of a joined strip
MAX_SHORTENING = 0.1
# Largest age in bond lengths at which the merge width still grows; the limit keeps it finite
MAX_AGE = 200.0

GAUSS_RULE_5 = (  # five Gauss points in (-1, 1), each with its weight
    (-0.906179845938664, 0.23692688505618908),
    (-0.5384693101056831, 0.47862867049936647),
    (0.0, 0.5688888888888889),
    (0.5384693101056831, 0.47862867049936647),
    (0.906179845938664, 0.23692688505618908),
)


class Division(NamedTuple):
    """Division of an increment into strips.

    - count: number of strips; strips beyond the cut-off are left out
    - step: increase of 1 - exp(-R/(AGE_PER_WIDTH eps)) per strip, with the path R to its end
    - scale: AGE_PER_WIDTH bond lengths / path
    - is_whole: whether the strips cover the whole increment
    """

    count: float
    step: float
    scale: float
    is_whole: bool


class MeanForce(NamedTuple):
    """Path-mean force [1] of an increment, and its derivative with respect to the increment [1/m]."""

    mean: float
    slope: float


# ---- sums after an increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _find_path(fraction, increment, bonds, v0, v1, dt):
    """Return the path state of a bond list after a fraction of an increment at velocities from v0 to v1.

    The damage has the bond length in the middle of the whole increment.
    """
    now = bonds.now
    path = abs(increment)
    before = now[PATH.length]
    length, exponent = grow(before, v0, v1, fraction * path, fraction * dt, bonds.growth)
    middle, _ = grow(before, v0, (v0 + v1) / 2, path / 2, dt / 2, bonds.growth)
    return PathValues(
        now[PATH.displacement] + fraction * increment,
        now[PATH.path] + fraction * path,
        now[PATH.damage] + fraction * path / middle,
        now[PATH.growth] + exponent,
        length,
        middle,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_list(fraction, increment, bonds, v0, dt):
    """Write force and stored energy of all strips, of the initial and of the new bonds after a fraction of an increment.

    For reading="report" the energy excludes the bonds that form on the increment. Each bond stores the work of its force
    when its stretch goes to zero at constant damage.

    Parameters
    ----------
    fraction : float
        Fraction of the increment, 0 to 1.
    increment, bonds, v0, dt : float, BondList, float, float
        As in the docstring of the module.
    """
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.room_start])
    end = int(status[STATUS.end])
    after = _find_path(fraction, increment, bonds, v0, v0, dt)
    sum_strips(after, bonds)
    initial = sum_initial(after, bonds)
    strips[STRIP.force, first] = initial.force
    strips[STRIP.energy, first] = initial.energy
    new = _sum_new(fraction * abs(increment), after, bonds)
    strips[STRIP.force, end] = np.copysign(new.force, increment)
    strips[STRIP.energy, end] = new.energy
    if strips.shape[0] == N_ROWS:
        strips[STRIP.pressure, first] = status[STATUS.initial_pressure]
        strips[STRIP.pressure, end] = status[STATUS.pressure]


@njit(**NJIT_KERNEL)
def total(row, point, bonds):
    """Return the sum of a row over all bonds, times their pressures at a point.

    Parameters
    ----------
    row : int
        Row of `STRIP`, such as `STRIP.force`.
    point : int
        Number of the point, 0 for the list of a single point.
    bonds : BondList

    Returns
    -------
    float
    """
    strips = bonds.bondlist
    pressure = STRIP.pressure + point
    first = int(bonds.status[STATUS.room_start])
    result = strips[pressure, first] * strips[row, first]
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end]) + 1):
        result += strips[pressure, k] * strips[row, k]
    return result


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_new(path, after, bonds):
    """Return force and stored energy of the bonds that form on a path [m], for unit pressure."""
    if path == 0:
        return BondSum(0.0, 0.0)
    form = bonds.law[LAW.form]
    if form == FORM_GROWING:
        return BondSum(_formed_growing_force(path, after, bonds), 0.0)
    if form == FORM_REPORT:
        return BondSum(sum_formed(path, bonds.law[LAW.length], bonds).force, 0.0)
    return sum_formed(path, after.middle_length, bonds)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _formed_growing_force(path, after, bonds):
    """Return the force [1] of the growing bonds that form on an increment at full pressure."""
    law = bonds.law
    before = bonds.now
    growth = after.growth - before[PATH.growth]
    target = _target_length(before[PATH.length], after.length, growth)
    division = _divide(path, after.middle_length, growth, law)
    result = 0.0
    for piece in range(int(division.count)):
        low = _find_end(piece, division)
        width = _find_end(piece + 1, division) - low
        for point in range(2):
            # New bonds start at length 0 and relax to the target of eq. 2.10
            fraction = low + width * (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)
            length = max(-target * expm1(-fraction * growth), MIN_LENGTH_RATIO * after.length)
            x = fraction * path / length
            result += width * power(x, law[LAW.order]) * fast_exp(-x)
    return result * law[LAW.inverse_gamma] * path / (2 * law[LAW.length])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _target_length(before, after, exponent):
    """Return the length [m] to which eq. 2.10 relaxes by exp(-exponent) in a step, from both lengths at its ends."""
    fraction = -expm1(-exponent)
    return after if fraction == 0 else before + (after - before) / fraction


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _divide(path, eps, growth, law):
    """Divide an increment with a path [m], bond length eps [m] and growth J into strips.

    Their length increases with exp(R/(AGE_PER_WIDTH eps)), which gives all of them the same error.
    """
    form = law[LAW.form]
    if form == FORM_REPORT:
        return Division(1.0, 1.0, 1.0, True)
    x = path / eps
    cutoff = law[LAW.cutoff] if form == FORM_STRETCH else law[LAW.cutoff] / eps
    cutoff = min(cutoff, MAX_NEW_AGE)
    covered = -expm1(-min(x, cutoff) / AGE_PER_WIDTH)
    count = AGE_PER_WIDTH / MAX_STRIP_LENGTH * covered
    if form == FORM_GROWING:
        limit = (path / law[LAW.length]) ** (1 + min(law[LAW.order], 0.0))
        min_count = (limit / NEW_BOND_TOL) ** 0.25
        count = max(count, min(growth / MAX_STRIP_GROWTH, MAX_GROWTH_STRIPS, min_count))
    count = max(np.ceil(count), 1.0)
    return Division(count, covered / count, AGE_PER_WIDTH / x, x <= cutoff)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _find_end(piece, division):
    """Return the position of the end of a strip in an increment, as a fraction from the end of the increment."""
    if piece == division.count and division.is_whole:
        return 1.0
    return -log1p(-piece * division.step) * division.scale


# ---- mean force over an increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_mean_and_slope(increment, bonds, v0, dt):
    """Return the path-mean force of a bond list over an increment, and its derivative by the increment.

    The slope assumes that the force depends on the displacement alone; it may be negative.

    Parameters
    ----------
    increment, bonds, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    MeanForce
    """
    mean = list_mean(increment, bonds, v0, dt)
    small = SLOPE_INCREMENT_RATIO * bonds.law[LAW.length]
    if abs(increment) > small:
        sum_list(1.0, increment, bonds, v0, dt)
        return MeanForce(mean, (total(STRIP.force, 0, bonds) - mean) / increment)
    sum_list(1.0, small, bonds, v0, dt)
    forward = total(STRIP.force, 0, bonds)
    sum_list(1.0, -small, bonds, v0, dt)
    return MeanForce(mean, (forward - total(STRIP.force, 0, bonds)) / (4 * small))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_mean(increment, bonds, v0, dt):
    """Return the force [1] of a bond list, averaged over the path of an increment.

    For reading="stretch" it comes from the energy balance, so that no step creates energy: damage dissipates the
    fraction dR/eps of the stored energy, and the mean force is this loss plus the gain in stored energy, per increment.
    For reading="report" it is the mean of the force; the part of the initial bonds has a closed form.

    The row `STRIP.mean` receives the part of every strip.

    Parameters
    ----------
    increment, bonds, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    float
    """
    if increment == 0:
        return bonds.status[STATUS.force]
    strips = bonds.bondlist
    first = int(bonds.status[STATUS.room_start])
    is_stretch = bonds.law[LAW.form] == FORM_STRETCH
    has_balance = is_stretch and _needs_energy_balance(increment, bonds)
    row = STRIP.energy if has_balance else STRIP.force
    present_row = STRIP.present_energy if has_balance else STRIP.present_force
    loss = 1.0
    gain = 0.0
    after = _find_path(1.0, increment, bonds, v0, v0, dt)
    if has_balance:
        loss = np.copysign(1 / after.middle_length, increment)
        gain = 1 / increment

    # The mean is a weighted sum of the values at the start, inside and at the end of the increment
    strips[STRIP.mean, first] = 0.0
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end]) + 1):
        strips[STRIP.mean, k] = 0.0
    share = _find_simpson_share(increment, bonds)
    if share > 0:
        _add_to_mean(share * loss / 6, present_row, bonds)
        sum_list(0.5, increment, bonds, v0, dt)
        _add_to_mean(4 * share * loss / 6, row, bonds)
    if share < 1:
        _integrate_panels((1 - share) * loss, row, increment, bonds, v0, dt)
    _add_to_mean(-gain, present_row, bonds)
    end_weight = gain + share * loss / 6
    if end_weight != 0:
        sum_list(1.0, increment, bonds, v0, dt)
        _add_to_mean(end_weight, row, bonds)

    # Where it has a closed form, it replaces the rule
    if not is_stretch:
        strips[STRIP.mean, first] = average_initial(increment, bonds)
    if bonds.law[LAW.form] != FORM_GROWING:
        eps = after.middle_length if is_stretch else bonds.law[LAW.length]
        strips[STRIP.mean, int(bonds.status[STATUS.end])] = average_formed(increment, eps, bonds)
    return total(STRIP.mean, 0, bonds)


@njit(**NJIT_KERNEL)
def _add_to_mean(weight, row, bonds):
    """Add a row of all bonds, times a weight, to the row of the mean force."""
    strips = bonds.bondlist
    first = int(bonds.status[STATUS.room_start])
    strips[STRIP.mean, first] += weight * strips[row, first]
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end]) + 1):
        strips[STRIP.mean, k] += weight * strips[row, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_panels(weight, row, increment, bonds, v0, dt):
    """Add a row, averaged over an increment by panels of five Gauss points, to the row of the mean force.

    Each panel is twice as long as the one before. The last one may be short, so that the mean force depends continuously
    on the increment.
    """
    path = abs(increment) / bonds.now[PATH.length]
    low = 0.0
    high = min(MAX_PANEL_LENGTH / path, 1.0)
    while low < 1:
        for point, point_weight in GAUSS_RULE_5:
            fraction = low + (high - low) * (1 + point) / 2
            sum_list(fraction, increment, bonds, v0, dt)
            _add_to_mean(weight * (high - low) * point_weight / 2, row, bonds)
        low = high
        high = min(2 * high, 1.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _passes_kink(increment, bonds):
    """Return whether an increment reaches a displacement at which many bonds are unstretched.

    It is 0 for the initial bonds, and the position of a strip of length 0. The force may jump there.
    """
    strips = bonds.bondlist
    start = bonds.now[PATH.displacement]
    margin = TOUCH_TOL * abs(increment)
    low = min(start, start + increment) - margin
    high = max(start, start + increment) + margin
    if low <= 0 <= high and bonds.law[LAW.half_width] == 0:
        return True
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end])):
        if strips[STRIP.covered, k] == 0 and low <= strips[STRIP.end, k] <= high:
            return True
    return False


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _needs_energy_balance(increment, bonds):
    """Return whether the mean force is computed from the energy balance.

    Round-off forbids it for a tiny increment, unless the increment crosses a jump of the force.
    """
    law = bonds.law
    min_step = MIN_ENERGY_STEP if law[LAW.half_width] == 0 else MIN_ENERGY_STEP_SPREAD
    return abs(increment) / bonds.now[PATH.length] > min_step or _passes_kink(increment, bonds)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _find_simpson_share(increment, bonds):
    """Return the share of Simpson's rule in the mean of an increment; the remainder is that of panels of Gauss points.

    It is 1 for increments of up to half a limit with a smooth force and falls to 0 at the limit, so that the mean depends
    continuously on the increment. For distributed initial bonds it must not depend on their position.
    """
    law = bonds.law
    p = law[LAW.order]
    is_stretch = law[LAW.form] == FORM_STRETCH
    has_steep_range = law[LAW.half_width] > 0 and p < 1
    is_empty = bonds.status[STATUS.end] == bonds.status[STATUS.head]
    if is_empty or has_steep_range or p < 0 or (is_stretch and _passes_kink(increment, bonds)):
        return 0.0
    limit = MAX_SIMPSON_STEP if p >= 1 else MAX_SIMPSON_STEP_STEEP
    return min(max(2 - 2 * abs(increment) / (limit * bonds.now[PATH.length]), 0.0), 1.0)


# ---- increment of the list


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_step(increment, bonds, v0, v1, dt):
    """Advance a list of bond strips by an increment: append new strips, drop the oldest and join others.

    Force and energy after the step are written into the status.

    Parameters
    ----------
    increment : float
        Increment [m].
    bonds : BondList
        Changed in place.
    v0, v1, dt : float
        Velocities [m/s] at the ends of the step, and its duration [s].

    Returns
    -------
    bool
        False if the array of strips is full.
    """
    status = bonds.status
    now = bonds.now
    before = PathValues(
        now[PATH.displacement],
        now[PATH.path],
        now[PATH.damage],
        now[PATH.growth],
        now[PATH.length],
        0.0,
    )
    after = _find_path(1.0, increment, bonds, v0, v1, dt)
    now[PATH.displacement] = after.displacement
    now[PATH.path] = after.path
    now[PATH.damage] = after.damage
    now[PATH.growth] = after.growth
    now[PATH.length] = after.length
    _move_reference(bonds)
    has_room = True
    if increment != 0:
        if status[STATUS.pressure] > 0:
            has_room = _append_strips(increment, before, after, bonds)
        _drop_old_strips(bonds)
        # A merge visits the whole list, so it waits until the list has grown by a fifth
        n_strips = status[STATUS.end] - status[STATUS.head]
        has_grown = n_strips > 1.2 * status[STATUS.n_after_merge] + MIN_STRIPS_BETWEEN_MERGES
        if bonds.law[LAW.merge_width] > 0 and has_grown:
            _merge_strips(bonds)
    update_sums(bonds)
    return has_room


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_sums(bonds):
    """Write force and energy of the present state into the strips and, of the first point, into the status."""
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.room_start])
    sum_list(0.0, 0.0, bonds, 0.0, 0.0)
    strips[STRIP.present_force, first] = strips[STRIP.force, first]
    strips[STRIP.present_energy, first] = strips[STRIP.energy, first]
    for k in range(int(status[STATUS.head]), int(status[STATUS.end]) + 1):
        strips[STRIP.present_force, k] = strips[STRIP.force, k]
        strips[STRIP.present_energy, k] = strips[STRIP.energy, k]
    status[STATUS.force] = total(STRIP.force, 0, bonds)
    status[STATUS.energy] = total(STRIP.energy, 0, bonds)
    n_strips = status[STATUS.end] - status[STATUS.head]
    status[STATUS.max_strips] = max(status[STATUS.max_strips], n_strips)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _move_reference(bonds):
    """Move the reference of the scaled values to the present damage or growth before they overflow."""
    now = bonds.now
    is_stretch = bonds.law[LAW.form] == FORM_STRETCH
    age = now[PATH.damage] if is_stretch else now[PATH.growth]
    if age - now[PATH.reference] < MAX_EXPONENT:
        return
    factor = exp(now[PATH.reference] - age)
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end])):
        bonds.bondlist[STRIP.value_1, k] *= factor
        bonds.bondlist[STRIP.value_2, k] *= factor
    now[PATH.reference] = age


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _append_strips(increment, before, after, bonds):
    """Append the strips of bonds that an increment forms; return False if the list is full."""
    strips = bonds.bondlist
    status = bonds.status
    law = bonds.law
    path = abs(increment)
    damage = after.damage - before.damage
    division = _divide(path, after.middle_length, after.growth - before.growth, law)
    status[STATUS.n_extra] += division.count - 1
    if not _make_room(int(division.count), bonds):
        return False
    # The pressures of the new bonds stand in the column after the last strip
    new = int(status[STATUS.end])
    if strips.shape[0] == N_ROWS:
        strips[STRIP.pressure, new] = status[STATUS.pressure]
    for piece in range(int(division.count) - 1, -1, -1):
        k = int(status[STATUS.end])
        low = _find_end(piece, division)
        high = _find_end(piece + 1, division)
        strips[STRIP.start, k] = after.displacement - high * increment
        if high == 1:
            strips[STRIP.start, k] = before.displacement
        strips[STRIP.end, k] = after.displacement - low * increment
        strips[STRIP.path, k] = after.path - low * path
        strips[STRIP.damage, k] = after.damage - low * damage
        strips[STRIP.covered, k] = (high - low) * path
        for i in range(STRIP.pressure, strips.shape[0]):
            strips[i, k] = strips[i, new]
        if law[LAW.form] == FORM_STRETCH:
            _write_weights((high - low) * damage, after.middle_length, bonds, k)
        elif law[LAW.form] == FORM_GROWING:
            _write_start_lengths(low, high - low, before, after, bonds, k)
        status[STATUS.end] = k + 1
    if law[LAW.form] == FORM_REPORT:
        # The sum is exact for strips of any length, so a strip of equal pressure is extended
        _join_last_strips(bonds)
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _make_room(count, bonds):
    """Make room for further strips at the end of a list, by moving it to its first column; return whether there is room."""
    strips = bonds.bondlist
    status = bonds.status
    # The column after the last strip is that of new bonds
    capacity = min(int(status[STATUS.room_end]), strips.shape[1]) - 1
    head = int(status[STATUS.head])
    end = int(status[STATUS.end])
    if end + count <= capacity:
        return True
    first = int(status[STATUS.room_start]) + 1
    for i in range(strips.shape[0]):
        for k in range(head, end + 1):
            strips[i, k - head + first] = strips[i, k]
    status[STATUS.head] = first
    status[STATUS.end] = end - head + first
    return end - head + first + count <= capacity


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_weights(width, eps, bonds, k):
    """Write the scaled weights of a strip of a given damage along it, for reading="stretch"."""
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    weight = strips[STRIP.covered, k] / power(eps, p)
    age = strips[STRIP.damage, k] - bonds.now[PATH.reference]
    strips[STRIP.value_1, k] = 0.5 * weight * exp(age - GAUSS_POINT_1 * width)
    strips[STRIP.value_2, k] = 0.5 * weight * exp(age - GAUSS_POINT_2 * width)
    strips[STRIP.density, k] = power(eps, p) / eps


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_start_lengths(low, width, before, after, bonds, k):
    """Write the scaled starting lengths of a strip of growing bonds that ends at a fraction `low` of the increment.

    At a Gauss point it is the mature length when its bonds formed, times exp(J - reference) at that time. Later, the
    length of these bonds is that of mature bonds less exp(reference - J) times this number.
    """
    reference = bonds.now[PATH.reference]
    growth = after.growth - before.growth
    target = _target_length(before.length, after.length, growth)
    start = (before.length - target) * exp(after.growth - growth - reference)
    for point in range(2):
        fraction = low + width * (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)
        length = target * exp(after.growth - fraction * growth - reference) + start
        bonds.bondlist[STRIP.value_1 + point, k] = length


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _drop_old_strips(bonds):
    """Advance the head of the list beyond the strips that are older than the cut-off."""
    status = bonds.status
    row = STRIP.path
    now = bonds.now[PATH.path]
    if bonds.law[LAW.form] == FORM_STRETCH:
        row = STRIP.damage
        now = bonds.now[PATH.damage]
    head = int(status[STATUS.head])
    while head < status[STATUS.end] and now - bonds.bondlist[row, head] > bonds.law[LAW.cutoff]:
        head += 1
    status[STATUS.head] = head


# ---- merging


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _merge_strips(bonds):
    """Join neighbouring strips of one direction whose joint width is small for their age.

    The largest width is merge_width eps_0 exp(R/(3 eps_0)) at the path R since the bonds formed. First moments are
    conserved, so the error falls with the square of the width.
    """
    strips = bonds.bondlist
    status = bonds.status
    law = bonds.law
    head = int(status[STATUS.head])
    last = head
    for k in range(head + 1, int(status[STATUS.end])):
        age = (bonds.now[PATH.path] - strips[STRIP.path, k]) / law[LAW.length]
        width = law[LAW.merge_width] * law[LAW.length] * exp(min(age / 3, MAX_AGE))
        is_narrow = strips[STRIP.covered, last] + strips[STRIP.covered, k] <= width
        if is_narrow and _join_strips(bonds, last, k):
            continue
        last += 1
        if last != k:
            for i in range(strips.shape[0]):
                strips[i, last] = strips[i, k]
    status[STATUS.end] = last + 1
    status[STATUS.n_after_merge] = last + 1 - head


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_last_strips(bonds):
    """Join the last two strips of a list if their pressures are equal."""
    strips = bonds.bondlist
    k = int(bonds.status[STATUS.end]) - 1
    if k <= bonds.status[STATUS.head]:
        return
    for i in range(STRIP.pressure, strips.shape[0]):
        if strips[i, k - 1] != strips[i, k]:
            return
    if _join_strips(bonds, k - 1, k):
        bonds.status[STATUS.end] = k


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_strips(bonds, i, k):
    """Add strip k to strip i if it continues it in the same direction; return whether it does."""
    strips = bonds.bondlist
    form = bonds.law[LAW.form]
    width_i = strips[STRIP.end, i] - strips[STRIP.start, i]
    width_k = strips[STRIP.end, k] - strips[STRIP.start, k]
    if strips[STRIP.end, i] != strips[STRIP.start, k] or width_i * width_k <= 0:
        return False
    if form == FORM_GROWING and not _have_similar_lengths(bonds, i, k):
        return False

    # Two values with the sum and the first moment of the four; positions are measured from the end of k. The values of
    # growing bonds are lengths, not weights, and count with the length of their strip.
    covered = strips[STRIP.covered, i] + strips[STRIP.covered, k]
    part = strips[STRIP.covered, k] / covered
    scale_i = 1 - part if form == FORM_GROWING else 1.0
    scale_k = part if form == FORM_GROWING else 1.0
    i_1, i_2 = scale_i * strips[STRIP.value_1, i], scale_i * strips[STRIP.value_2, i]
    k_1, k_2 = scale_k * strips[STRIP.value_1, k], scale_k * strips[STRIP.value_2, k]
    moment = (1 - part) * (GAUSS_POINT_1 * i_1 + GAUSS_POINT_2 * i_2) + part * (i_1 + i_2)
    moment += part * (GAUSS_POINT_1 * k_1 + GAUSS_POINT_2 * k_2)
    weight = i_1 + i_2 + k_1 + k_2
    value_2 = (moment - GAUSS_POINT_1 * weight) / (GAUSS_POINT_2 - GAUSS_POINT_1)
    value_1 = weight - value_2
    if value_1 < 0 or value_2 < 0:
        return False
    if form == FORM_STRETCH:
        part = (k_1 + k_2) / weight

    # The joint pressure conserves the sum of the weights of every point
    strips[STRIP.density, i] += part * (strips[STRIP.density, k] - strips[STRIP.density, i])
    for row in range(STRIP.pressure, strips.shape[0]):
        strips[row, i] += part * (strips[row, k] - strips[row, i])
    strips[STRIP.end, i] = strips[STRIP.end, k]
    strips[STRIP.path, i] = strips[STRIP.path, k]
    strips[STRIP.damage, i] = strips[STRIP.damage, k]
    strips[STRIP.covered, i] = covered
    strips[STRIP.value_1, i] = value_1
    strips[STRIP.value_2, i] = value_2
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_similar_lengths(bonds, i, k):
    """Return whether the growing bonds of two strips have similar lengths or are fully grown."""
    strips = bonds.bondlist
    mature = bonds.now[PATH.length]
    scale = exp(bonds.now[PATH.reference] - bonds.now[PATH.growth])
    young = scale * interpolate_value(0.0, strips[STRIP.value_1, k], strips[STRIP.value_2, k])
    old = scale * interpolate_value(1.0, strips[STRIP.value_1, i], strips[STRIP.value_2, i])
    if young <= MAX_START_LENGTH_RATIO * mature:
        return True
    return young <= exp(MAX_GROWTH_SPAN) * old and mature - young >= (1 - MAX_SHORTENING) * (
        mature - old
    )


# ---- change of load at rest


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press(before, after, bonds):
    """Change the relative pressure of a point with a list of its own at rest (`release`).

    Parameters
    ----------
    before, after : float
        Relative pressure before and after.
    bonds : BondList
        Changed in place.

    Returns
    -------
    bool
        False if the array of strips is full.
    """
    formed = release(before, after, 0, bonds)
    has_room = formed == 0 or append_unstretched(bonds)
    if has_room and formed > 0:
        bonds.bondlist[STRIP.pressure, int(bonds.status[STATUS.end]) - 1] = formed
    update_sums(bonds)
    return has_room


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def release(before, after, point, bonds):
    """Change the pressures of the bonds of a point as its relative pressure changes at rest.

    Without pressure all bonds are lost. Else, for reading="report" a bond keeps the pressure under which it formed, and
    none forms at rest. For reading="stretch" the bonds that formed last are lost first where the pressure falls; bonds
    that carry more than the new limit form again without stretch. Where it rises, unstretched bonds of density m_0 form.

    Parameters
    ----------
    before, after : float
        Relative pressure before and after.
    point : int
        Number of the point in the list.
    bonds : BondList
        Changed in place.

    Returns
    -------
    float
        Density of unstretched bonds that form.
    """
    if after <= 0:
        break_bonds(point, bonds)
        return 0.0
    if bonds.law[LAW.form] != FORM_STRETCH or after == before:
        return 0.0
    if after > before:
        return bonds.law[LAW.initial] * (after - before)
    _release_last_formed(_total_density(point, bonds) * (1 - after / before), point, bonds)
    carried = abs(total(STRIP.present_force, point, bonds))
    if carried <= after:
        return 0.0
    formed = (1 - after / carried) * _total_density(point, bonds)
    _scale_pressure(after / carried, point, bonds)
    return formed


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def break_bonds(point, bonds):
    """Break all bonds of a point, as when it lifts off."""
    status = bonds.status
    _scale_pressure(0.0, point, bonds)
    if bonds.bondlist.shape[0] == N_ROWS:
        status[STATUS.head] = status[STATUS.end] = status[STATUS.room_start] + 1
        status[STATUS.n_after_merge] = status[STATUS.energy] = status[STATUS.force] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _scale_pressure(factor, point, bonds):
    """Multiply the pressures of all bonds of a point by a factor."""
    strips = bonds.bondlist
    status = bonds.status
    strips[STRIP.pressure + point, int(status[STATUS.room_start])] *= factor
    for k in range(int(status[STATUS.head]), int(status[STATUS.end])):
        strips[STRIP.pressure + point, k] *= factor
    status[STATUS.initial_pressure] *= factor


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _density(k, point, bonds):
    """Return the density of the surviving bonds of a strip at a point, for reading="stretch"."""
    strips = bonds.bondlist
    pressure = strips[STRIP.pressure + point, k]
    if k == int(bonds.status[STATUS.room_start]):
        return pressure * bonds.law[LAW.initial] * exp(-bonds.now[PATH.damage])
    scale = exp(bonds.now[PATH.reference] - bonds.now[PATH.damage])
    weight = strips[STRIP.value_1, k] + strips[STRIP.value_2, k]
    return pressure * scale * strips[STRIP.density, k] * weight


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _total_density(point, bonds):
    """Return the density of all surviving bonds of a point, for reading="stretch"."""
    result = _density(int(bonds.status[STATUS.room_start]), point, bonds)
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end])):
        result += _density(k, point, bonds)
    return result


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _release_last_formed(excess, point, bonds):
    """Release the bonds of a point that formed last, up to a density; the bonds of a strip in equal parts."""
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.room_start])
    head = int(status[STATUS.head])
    for k in range(int(status[STATUS.end]) - 1, head - 2, -1):
        column = first if k < head else k
        density = _density(column, point, bonds)
        released = min(excess, density)
        if released > 0:
            strips[STRIP.pressure + point, column] *= 1 - released / density
        excess -= released
    if strips.shape[0] == N_ROWS:
        status[STATUS.initial_pressure] = strips[STRIP.pressure, first]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def append_unstretched(bonds):
    """Append a strip of length 0 without pressure: fully grown bonds at the present displacement, of unit density.

    Returns
    -------
    bool
        False if the array of strips is full.
    """
    if not _make_room(1, bonds):
        return False
    strips = bonds.bondlist
    now = bonds.now
    k = int(bonds.status[STATUS.end])
    for i in range(strips.shape[0]):
        strips[i, k] = 0.0
    strips[STRIP.start, k] = strips[STRIP.end, k] = now[PATH.displacement]
    strips[STRIP.path, k] = now[PATH.path]
    strips[STRIP.damage, k] = now[PATH.damage]
    # Their length is eps_0
    eps0 = bonds.law[LAW.length]
    strips[STRIP.density, k] = power(eps0, bonds.law[LAW.order]) / eps0
    scale = exp(now[PATH.damage] - now[PATH.reference])
    strips[STRIP.value_1, k] = strips[STRIP.value_2, k] = 0.5 * scale / strips[STRIP.density, k]
    bonds.status[STATUS.end] = k + 1
    return True
