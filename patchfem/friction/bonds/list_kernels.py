"""Compiled list of strips of bonds (eq. 2.17): force after an increment, and mean force over it.

The list sums eq. 2.17 along a line for every order and reading. Two numbers of `list_numbers.law_numbers` bound its
length: a cut-off beyond which old strips are dropped, and a width up to which neighbouring strips are joined.

`bonds` is a `list_rows_kernels.BondList`. Forces [1] and stored energies [m] are divided by the friction limit mu_s N.
`increment` is a straight increment [m] from the present state, `v0` the velocity [m/s] at its start and `dt` its duration
[s]; both determine the growth of bonds. A bond acts with (|u|/eps)^p exp(-damage) for reading="stretch", with its stretch u
and the damage int dR/eps since it formed, and with (R/eps)^p exp(-R/eps) for reading="report", with the path R since then.
"""

from math import expm1, log1p
from typing import NamedTuple

import numpy as np
from numba import uint64

from ...compiled.flags_kernels import NJIT_KERNEL, NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from .list_math_kernels import LONG_RULE, MAX_SHORT_PANEL, SHORT_RULE, fast_exp, power
from .list_rows_kernels import (
    FORM_GROWING,
    FORM_REPORT,
    FORM_STRETCH,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
    LAW,
    MAX_STRIP_LENGTH,
    PATH,
    STATUS,
    STRIP,
)
from .list_sum_kernels import (
    MIN_BOND_RATIO,
    MIN_POSITIVE,
    BondSum,
    PathValues,
    average_formed,
    average_initial,
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
# Largest number of strips into which growth alone divides an increment. The growth J along an increment that takes a long
# time has no bound, but with a large J nearly all of its bonds are mature.
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
# Largest increment in bond lengths for which Simpson's rule has a weight in the mean force: the force bends over a bond
# length, so that the rule with three points has an error of about x^4/2880 there
MAX_SIMPSON_STEP = 0.1
MAX_SIMPSON_STEP_STEEP = (
    0.03  # the same limit for an order below 1, whose force starts with an infinite slope
)
MAX_PANEL_LENGTH = 0.5  # largest length of the first panel of Gauss points, in bond lengths
# Increment [bond lengths] at which the slope of the force at rest is the mean of both directions
SLOPE_INCREMENT_RATIO = 1e-9


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
    """Friction force / mu_s of a bond list over an increment, in the unit of its pressures (or loads).

    - mean: mean over the path of the increment
    - slope: its derivative by the increment [per m]
    """

    mean: float
    slope: float


# ---- sums after an increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_path(fraction, increment, bonds, v0, v1, dt):
    """Return the path state of a bond list after a fraction of an increment at velocities from v0 to v1.

    The damage has the bond length in the middle of the whole increment.

    Parameters
    ----------
    fraction : float
        Fraction of the increment, 0 to 1.
    increment : float
        Straight increment [m] from the present state.
    bonds : BondList
        The path state before the increment and the growth of the bonds are read.
    v0, v1, dt : float
        Velocities [m/s] at the ends of the increment, and its duration [s].

    Returns
    -------
    PathValues
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

    They go to the rows `STRIP.force` [1] and `STRIP.energy` [m] for unit pressure; the row `STRIP.pressure` has the factor
    of each strip, and `total` sums the products. Each bond stores the work of its force when its stretch goes to zero at
    constant damage. For reading="report" the energy excludes the bonds that form on the increment.

    Parameters
    ----------
    fraction : float
        Fraction of the increment, 0 to 1.
    increment : float
        Straight increment [m] from the present state.
    bonds : BondList
        Its rows `STRIP.force` and `STRIP.energy` receive the sums.
    v0, dt : float
        Velocity [m/s], taken as constant along the increment, and its duration [s].
    """
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.first_column])
    end = int(status[STATUS.end])

    # The strips that exist, then the two columns that are no strips: initial bonds and new bonds
    after = find_path(fraction, increment, bonds, v0, v0, dt)
    sum_strips(after, bonds)
    initial = sum_initial(after, bonds)
    strips[STRIP.force, first] = initial.force
    strips[STRIP.energy, first] = initial.energy
    new = _sum_new(fraction * abs(increment), after, bonds)
    strips[STRIP.force, end] = np.copysign(new.force, increment)
    strips[STRIP.energy, end] = new.energy

    # Bonds keep the pressure under which they formed: the initial ones that of the start, new ones the present one.
    strips[STRIP.pressure, first] = status[STATUS.initial_pressure]
    strips[STRIP.pressure, end] = status[STATUS.pressure]


@njit(**NJIT_KERNEL)
def total(row, bonds):
    """Return the sum of a row over all bonds, times their pressures.

    Parameters
    ----------
    row : int
        Row of `STRIP`, such as `STRIP.force`.
    bonds : BondList
        Strips with the values of the row for unit pressure.

    Returns
    -------
    float
        Force [1] or stored energy [m] per friction limit, as the row.
    """
    strips = bonds.bondlist
    first = int(bonds.status[STATUS.first_column])
    result = strips[STRIP.pressure, first] * strips[row, first]
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end]) + 1):
        result += strips[STRIP.pressure, k] * strips[row, k]
    return result


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_new(path, after, bonds):
    """Return force and stored energy of the bonds that form on a path [m], for unit pressure.

    `after` is the path state at the end of the path, and `bonds` the list of bonds before it, with the law.
    """
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
    """Return the force [1] of the growing bonds that form on an increment at full pressure.

    `path` is the length of the increment [m], `after` the path state at its end, and `bonds` the list before it, with
    the law.
    """
    law = bonds.law
    before = bonds.now
    growth = after.growth - before[PATH.growth]
    target = target_length(before[PATH.length], after.length, growth)
    division = divide(path, after.middle_length, growth, law)

    # Two Gauss points per strip sum (R/eps)^p exp(-R/eps) over the path R since the bonds formed
    result = 0.0
    for piece in range(int(division.count)):
        low = find_end(piece, division)
        width = find_end(piece + 1, division) - low
        for point in range(2):
            # New bonds start at length 0 and relax to the target of eq. 2.10
            fraction = low + width * (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)
            length = max(-target * expm1(-fraction * growth), MIN_BOND_RATIO * after.length)
            x = fraction * path / length
            result += width * power(x, law[LAW.order]) * fast_exp(-x)
    return result * law[LAW.inverse_gamma] * path / (2 * law[LAW.length])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def target_length(before, after, exponent):
    """Return the length to which eq. 2.10 relaxes by exp(-exponent) in a step.

    Parameters
    ----------
    before, after, exponent : float
        Bond lengths [m] at the ends of the step, growth J in it.

    Returns
    -------
    float
        Target [m]; without growth it is the length itself.
    """
    fraction = -expm1(-exponent)
    return after if fraction == 0 else before + (after - before) / fraction


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def divide(path, eps, growth, law):
    """Divide an increment into strips, so that two Gauss points sum each of them accurately.

    Their length increases with exp(R/(AGE_PER_WIDTH eps)), so that old strips, which carry less, are longer.

    Parameters
    ----------
    path, eps, growth : float
        Length of the increment [m], bond length [m] in its middle, and growth J [1] along it.
    law : (8,) array
        Parameters of the law, in the order of `LAW`.

    Returns
    -------
    Division
    """
    form = law[LAW.form]
    if form == FORM_REPORT:
        return Division(1.0, 1.0, 1.0, True)

    # Strip j ends at bonds of the age R_j, which is their path since they formed. Strips are longer at higher ages, where
    # bonds carry less: exp(-R_j/(AGE_PER_WIDTH eps)) falls by the same step from each strip to the next.
    x = path / eps
    cutoff = law[LAW.cutoff] if form == FORM_STRETCH else law[LAW.cutoff] / eps
    cutoff = min(cutoff, MAX_NEW_AGE)
    covered = -expm1(-min(x, cutoff) / AGE_PER_WIDTH)
    count = AGE_PER_WIDTH / MAX_STRIP_LENGTH * covered

    # Growing bonds also need strips so short that the growth J in each stays small. Bonds that form on an increment
    # carry about (path/eps_0)^(1 + min(p, 0)) of the friction limit. The exponent is below 1 for p < 0, as young bonds
    # then carry more. The error of n strips is at most this over n^4, so that never more than (limit/NEW_BOND_TOL)^0.25
    # are needed.
    if form == FORM_GROWING:
        limit = (path / law[LAW.length]) ** (1 + min(law[LAW.order], 0.0))
        min_count = (limit / NEW_BOND_TOL) ** 0.25
        count = max(count, min(growth / MAX_STRIP_GROWTH, MAX_GROWTH_STRIPS, min_count))
    count = max(np.ceil(count), 1.0)
    return Division(count, covered / count, AGE_PER_WIDTH / x, x <= cutoff)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_end(piece, division):
    """Return the end of strip number `piece` of an increment, as a fraction of the increment, measured from its end."""
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
    increment : float
        Straight increment [m] from the present state.
    bonds : BondList
        The rows of its sums are overwritten; the present state stays.
    v0, dt : float
        Velocity [m/s], taken as constant along the increment, and its duration [s].

    Returns
    -------
    MeanForce
    """
    mean = list_mean(increment, bonds, v0, dt)

    # The mean is (1/dq) int F dq, so its derivative is (F - mean)/dq. Near 0 it is F'/2, here from the forces at a tiny
    # increment to either side, because the slopes of both directions differ.
    small = SLOPE_INCREMENT_RATIO * bonds.law[LAW.length]
    if abs(increment) > small:
        return MeanForce(mean, (total(STRIP.force, bonds) - mean) / increment)
    sum_list(1.0, small, bonds, v0, dt)
    forward = total(STRIP.force, bonds)
    sum_list(1.0, -small, bonds, v0, dt)
    return MeanForce(mean, (forward - total(STRIP.force, bonds)) / (4 * small))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_mean(increment, bonds, v0, dt):
    """Return the force [1] of a bond list, averaged over the path of an increment.

    For reading="stretch" it comes from the energy balance, so that no step creates energy: damage dissipates the
    fraction dR/eps of the stored energy, and the mean force is this loss plus the gain in stored energy, per increment.
    For reading="report" it is the mean of the force; the part of the initial bonds has a closed form.

    The row `STRIP.mean` receives the part of every strip, and the rows of the sum those at the end of the increment.

    Parameters
    ----------
    increment : float
        Straight increment [m] from the present state.
    bonds : BondList
        The rows of its sums are overwritten; the present state stays.
    v0, dt : float
        Velocity [m/s], taken as constant along the increment, and its duration [s].

    Returns
    -------
    float
        Path-mean force [1] per friction limit.
    """
    if abs(increment) < MIN_POSITIVE:
        return bonds.status[STATUS.force]
    strips = bonds.bondlist
    first = int(bonds.status[STATUS.first_column])

    # Energy balance divided by the increment: damage dissipates the fraction dR/eps of the mean energy, and the stored
    # energy rises from its present value to that at the end
    is_stretch = bonds.law[LAW.form] == FORM_STRETCH
    has_balance = is_stretch and _needs_energy_balance(increment, bonds)
    row = STRIP.energy if has_balance else STRIP.force
    present_row = STRIP.present_energy if has_balance else STRIP.present_force
    loss = 1.0
    gain = 0.0
    after = find_path(1.0, increment, bonds, v0, v0, dt)
    if has_balance:
        loss = np.copysign(1 / after.middle_length, increment)
        gain = 1 / increment

    # Numerical integration over the increment. Short increments use Simpson's rule, with the weights 1/6, 4/6 and 1/6 at
    # start, middle and end. Long ones use Gauss's rule on several panels. In between, the mean is a mixture of both.
    strips[STRIP.mean, first] = 0.0
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end]) + 1):
        strips[STRIP.mean, k] = 0.0
    simpson_fraction = _find_simpson_fraction(increment, bonds)
    if simpson_fraction > 0:
        _add_to_mean(simpson_fraction * loss / 6, present_row, bonds)
        sum_list(0.5, increment, bonds, v0, dt)
        _add_to_mean(4 * simpson_fraction * loss / 6, row, bonds)
    if simpson_fraction < 1:
        _integrate_panels((1 - simpson_fraction) * loss, row, increment, bonds, v0, dt)
    if gain != 0:
        _add_to_mean(-gain, present_row, bonds)
    sum_list(1.0, increment, bonds, v0, dt)
    end_weight = gain + simpson_fraction * loss / 6
    if end_weight != 0:
        _add_to_mean(end_weight, row, bonds)
    _write_exact_means(increment, after.middle_length, bonds)
    return total(STRIP.mean, bonds)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_exact_means(increment, eps, bonds):
    """Replace mean forces that a rule of integration gave by those in closed form, of the new or of the initial bonds.

    There is none for the new bonds of reading="report": their steep force at the start of the increment cancels that of
    the strip before. eps: bond length [m] in the middle of the increment.
    """
    strips = bonds.bondlist
    if bonds.law[LAW.form] == FORM_STRETCH:
        new = int(bonds.status[STATUS.end])
        strips[STRIP.mean, new] = average_formed(increment, eps, bonds)
    else:
        first = int(bonds.status[STATUS.first_column])
        strips[STRIP.mean, first] = average_initial(increment, bonds)


@njit(**NJIT_KERNEL)
def _add_to_mean(weight, row, bonds):
    """Add a row of all bonds, times a weight, to the row of the mean force."""
    first = uint64(bonds.status[STATUS.first_column])
    mean = bonds.bondlist[STRIP.mean]
    values = bonds.bondlist[row]
    mean[first] += weight * values[first]
    for k in range(uint64(bonds.status[STATUS.head]), uint64(bonds.status[STATUS.end] + 1)):
        mean[k] += weight * values[k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_panels(weight, row, increment, bonds, v0, dt):
    """Add the average of a row of the strips over an increment, by panels of Gauss points, to the row of the mean force.

    Each panel is twice as long as the one before. The last one may be short, so that the mean force depends continuously
    on the increment.

    Parameters
    ----------
    weight : float
        Factor of the average.
    row : int
        Row of the strips that is averaged (`StripRows`).
    increment : float
        Increment from the present state [m].
    bonds : list_rows_kernels.BondList
        List of bonds, which is changed.
    v0 : float
        Velocity at the start of the increment [m/s].
    dt : float
        Duration of the increment [s].
    """
    path = abs(increment) / bonds.now[PATH.length]

    low = 0.0
    high = min(MAX_PANEL_LENGTH / path, 1.0)
    while low < 1:
        is_short = path * (high - low) <= MAX_SHORT_PANEL and bonds.law[LAW.order] > 0
        rule = SHORT_RULE if is_short else LONG_RULE
        for point, point_weight in zip(rule[0], rule[1]):
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
def _find_simpson_fraction(increment, bonds):
    """Return the weight of Simpson's rule in the mean of an increment; Gauss's rule on panels has the remaining weight.

    It is 1 for increments of up to half a limit (MAX_SIMPSON_STEP, in bond lengths) with a smooth force, and falls
    linearly to 0 at the limit, so that the mean depends continuously on the increment. For distributed initial bonds it
    must not depend on their position.
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
