"""Compiled list of strips of bonds (eq. 2.17): force, mean force and step of an increment.

The list sums eq. 2.17 along a line for every order and reading. Two numbers of `list_numbers.law_numbers` distinguish
the engines of the key accuracy.quadrature: a cut-off beyond which old strips are dropped (`truncated`), and a width up
to which `list_merge_kernels` joins neighbouring strips (`merged`). Without both the list keeps every bond (`direct`).

`bond_list` is a named tuple with the arrays of a list, such as `dynamics.interfaces.arrays.BondList`: the arrays
`bondlist` (N_ROWS, capacity), `law` (24,), `now` (6,) and `status` (16,), whose indices `list_rows_kernels` names, the
`growth` (6,) of eq. 2.10 and the `table` (k,) of `list_numbers.gamma_table`. Forces [1] and stored energies [m] are
divided by the friction limit mu_s N. `increment` is a straight increment [m] from the present state, `v0` the velocity
[m/s] at its start and `dt` its duration [s]; both determine the growth of bonds.
"""

from math import exp, expm1
from typing import NamedTuple

import numpy as np

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_forms_kernels import (
    FORM_MOMENTS,
    FORM_POWER,
    FORM_REPORT,
    FORM_REPORT_GROWING,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
    GAUSS_RULE_5,
    MAX_STRIP_LENGTH,
)
from .list_math_kernels import bond_gammainc, fast_exp, fast_log
from .list_merge_kernels import merge_strips
from .list_rows_kernels import (
    GROWING_ROW,
    LAW,
    MOMENT,
    PATH,
    POWER_ROW,
    REPORT_ROW,
    STATUS,
    STRIP,
)
from .list_sum_kernels import (
    MIN_LENGTH_RATIO,
    BondSum,
    MatureBonds,
    StripRange,
    average_initial,
    formed_force,
    sum_growing,
    sum_initial,
    sum_moments,
    sum_powers,
    sum_report,
)
from .point_kernels import bond_mean, grow

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
MAX_SIMPSON_STEP_FRACTIONAL = 0.03  # the same limit for an order below 1
MAX_PANEL_LENGTH = 0.5  # largest length of the first panel of five Gauss points, in bond lengths
# Largest exponent of the scaled numbers before they are rescaled; exp(709) is the largest
# floating-point number
MAX_EXPONENT = 300.0
# Largest path in bond lengths for which the moments of new bonds are computed by power series
MAX_SERIES_PATH = 1e-2
# Number of strips, in addition to a fifth of the list, by which the list grows before it is merged
# again
MIN_STRIPS_BETWEEN_MERGES = 12


class PathValues(NamedTuple):
    """Path state of a list after an increment, and the bond length [m] in the middle of it."""

    displacement: float
    path: float
    damage: float
    growth: float
    length: float
    middle_length: float


class Formation(NamedTuple):
    """Straight increment on which bonds form.

    - increment: [m]
    - before, after: path state at its ends
    - pressure: relative pressure
    - reference: reference of the scaled numbers
    """

    increment: float
    before: PathValues
    after: PathValues
    pressure: float
    reference: float


class StripCount(NamedTuple):
    """Number of strips of equal length in an increment, and number of those within the cut-off."""

    count: float
    kept: float


class MeanForce(NamedTuple):
    """Path-mean force [1] of an increment, and its derivative with respect to the increment [1/m]."""

    mean: float
    slope: float


class StripMoments(NamedTuple):
    """Moments of the bonds of a strip in bond lengths: weight, distance of the centre from the end, variance."""

    weight: float
    distance: float
    variance: float


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _advance_path_state(increment, path_state, growth, v0, v1, dt):
    """Return the path state of a bond list after an increment at velocities from v0 to v1."""
    path = abs(increment)
    before = path_state[PATH.length]
    length, exponent = grow(before, v0, v1, path, dt, growth)
    middle, _ = grow(before, v0, (v0 + v1) / 2, path / 2, dt / 2, growth)
    return PathValues(
        path_state[PATH.displacement] + increment,
        path_state[PATH.path] + path,
        path_state[PATH.damage] + path / middle,
        path_state[PATH.growth] + exponent,
        length,
        middle,
    )


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
    """
    fraction = -expm1(-exponent)
    return after if fraction == 0 else before + (after - before) / fraction


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _count_strips(path, eps, growth, law):
    """Return the number of strips of an increment with a path [m], bond length eps [m] and growth J."""
    count = max(1.0, path / (MAX_STRIP_LENGTH * eps))
    if law[LAW.form] == FORM_REPORT_GROWING:
        limit = (path / law[LAW.length]) ** (1 + min(law[LAW.order], 0.0))
        min_count = (limit / NEW_BOND_TOL) ** 0.25
        count = max(count, min(growth / MAX_STRIP_GROWTH, MAX_GROWTH_STRIPS, min_count))
    count = np.ceil(count)
    age_measure = path / eps if law[LAW.form] < FORM_REPORT else path
    return StripCount(count, min(count, 1 + np.ceil(count * (law[LAW.cutoff] / age_measure))))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _formed_growing_force(path, before, after, law):
    """Return the force [1] of the growing bonds that form on an increment between two path states."""
    growth = after.growth - before[PATH.growth]
    target = target_length(before[PATH.length], after.length, growth)
    pieces = _count_strips(path, after.middle_length, growth, law)
    total = 0.0
    for piece in range(int(pieces.kept)):
        for point in range(2):
            fraction = (piece + (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)) / pieces.count
            length = max(-target * expm1(-fraction * growth), MIN_LENGTH_RATIO * after.length)
            x = fraction * path / length
            total += fast_exp(law[LAW.order] * fast_log(x) - x)
    return total * law[LAW.inverse_gamma] * path / (2 * pieces.count * law[LAW.length])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def sum_list(increment, bond_list, v0, dt):
    """Return force and stored energy of all bonds of a list after an increment.

    The energy excludes the bonds that form on the increment. Each bond stores the work of its force when its stretch
    goes to zero at constant damage.

    Parameters
    ----------
    increment, bond_list, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    BondSum
        Force [1] and energy [m] per friction limit.
    """
    after = _advance_path_state(increment, bond_list.now, bond_list.growth, v0, v0, dt)
    initial = sum_initial(after.displacement, after.path, after.damage, bond_list.law)
    formed_sum = _sum_strips(increment, bond_list, v0, dt)
    pressure = bond_list.status[STATUS.initial_pressure]
    return BondSum(
        pressure * initial.force + formed_sum.force, pressure * initial.energy + formed_sum.energy
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _sum_strips(increment, bond_list, v0, dt):
    """Return force and stored energy of a bond list, excluding its initial bonds."""
    bonds = bond_list.bondlist
    status = bond_list.status
    path_state = bond_list.now
    law = bond_list.law
    form = law[LAW.form]
    after = _advance_path_state(increment, path_state, bond_list.growth, v0, v0, dt)
    head = int(status[STATUS.head])
    strips = StripRange(head, head + int(status[STATUS.n_spread]), int(status[STATUS.end]))
    eps0 = law[LAW.length]
    reference = path_state[PATH.reference]
    force = 0.0
    energy = 0.0
    if form == FORM_MOMENTS:
        scale = exp(reference - after.damage)
        moments = sum_moments(after.displacement, scale, bonds, strips)
        force += moments.z / eps0
        energy += moments.s2 / (2 * eps0)
    elif form == FORM_POWER:
        total = sum_powers(after.displacement, after.damage, bonds, strips, law)
        factor = law[LAW.inverse_gamma] / eps0 * exp(reference - after.damage)
        force += factor * total.force
        energy += factor * total.energy / (law[LAW.order] + 1)
    elif form == FORM_REPORT:
        total = sum_report(after.displacement, after.path, bonds, strips, law, bond_list.table)
        force += total.force
        energy += total.energy
    else:
        mature = MatureBonds(after.length, exp(reference - after.growth))
        total = sum_growing(after.displacement, after.path, mature, bonds, strips, law)
        factor = law[LAW.inverse_gamma] / eps0
        force += factor * total.force
        energy += factor * total.energy
    path = abs(increment)
    new_bond_force = 0.0
    if path > 0:
        if form == FORM_REPORT_GROWING:
            new_bond_force = _formed_growing_force(path, path_state, after, law)
        else:
            new_bond_force = formed_force(
                path, after.middle_length if form <= FORM_POWER else eps0, law
            )
    return BondSum(force + np.copysign(status[STATUS.pressure] * new_bond_force, increment), energy)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_force(increment, bond_list, v0, dt):
    """Return the force [1] of a bond list after an increment, relative to the friction limit.

    Twin: `quadrature.Quadrature`.

    Parameters
    ----------
    increment, bond_list, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    float
    """
    return sum_list(increment, bond_list, v0, dt).force


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_energy(increment, bond_list, v0, dt):
    """Return the ratio of the stored energy of a bond list to the friction limit [m].

    The bonds that form on the increment are included. The law must have friction.reading = "stretch".

    Parameters
    ----------
    increment, bond_list, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    float
    """
    law = bond_list.law
    eps = _advance_path_state(increment, bond_list.now, bond_list.growth, v0, v0, dt).middle_length
    new_bond_energy = (
        eps * eps / law[LAW.length] * bond_gammainc(law[LAW.order] + 1, abs(increment) / eps)
    )
    return (
        bond_list.status[STATUS.pressure] * new_bond_energy
        + sum_list(increment, bond_list, v0, dt).energy
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrand(is_energy, increment, bond_list, v0, dt):
    """Return energy or force of a bond list after an increment, for averaging over it.

    For reading="report" the force excludes the initial bonds, whose mean has a closed form.
    """
    if is_energy:
        return list_energy(increment, bond_list, v0, dt)
    if bond_list.law[LAW.form] >= FORM_REPORT:
        return _sum_strips(increment, bond_list, v0, dt).force
    return list_force(increment, bond_list, v0, dt)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_mean(increment, bond_list, v0, dt):
    """Return the force [1] of a bond list, averaged over the path of an increment.

    - reading="stretch", p = 1: closed form, `list_slope`.
    - reading="stretch", other orders: from the energy balance, so that no step creates energy. Damage dissipates the
      fraction dR/eps of the stored energy; the mean force is this loss plus the gain in stored energy, per increment.
    - reading="report": mean of the force; the part of the initial bonds has a closed form.

    Parameters
    ----------
    increment, bond_list, v0, dt : float, BondList, float, float
        As in the docstring of the module.

    Returns
    -------
    float
    """
    status = bond_list.status
    path_state = bond_list.now
    law = bond_list.law
    form = law[LAW.form]
    if increment == 0:
        return status[STATUS.force]
    if form == FORM_MOMENTS:
        return list_slope(increment, bond_list, v0, dt).mean
    is_short = _suits_simpson(increment, bond_list)
    if form == FORM_POWER and _needs_energy_balance(increment, bond_list):
        return _mean_from_energy(is_short, increment, bond_list, v0, dt)
    if is_short:
        last = _integrand(False, increment, bond_list, v0, dt)
        mean = _average_by_simpson(False, last, increment, bond_list, v0, dt)
    else:
        mean = _average_by_gauss(False, increment, bond_list, v0, dt)
    if form == FORM_POWER:
        return mean
    initial = average_initial(increment, path_state[PATH.displacement], path_state[PATH.path], law)
    return mean + status[STATUS.initial_pressure] * initial


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _suits_simpson(increment, bond_list):
    """Return whether Simpson's rule is accurate enough for an increment.

    The increment must be short, with a smooth force and a known first value. At displacement 0 the force of the initial
    bonds may jump, and its value there is that of neither side.
    """
    status = bond_list.status
    path_state = bond_list.now
    law = bond_list.law
    p = law[LAW.order]
    start = path_state[PATH.displacement]
    low = min(start, start + increment)
    high = max(start, start + increment)
    margin = TOUCH_TOL * abs(increment)
    touches_zero = low <= margin and high >= -margin
    has_jump = law[LAW.form] < FORM_REPORT
    has_steep_range = law[LAW.half_width] > 0 and p < 1
    limit = MAX_SIMPSON_STEP if p >= 1 else MAX_SIMPSON_STEP_FRACTIONAL
    return (
        status[STATUS.end] > status[STATUS.head]
        and abs(increment) / path_state[PATH.length] <= limit
        and p >= 0
        # The choice of the rule must not depend on the position of distributed bonds.
        and not ((touches_zero and has_jump) or has_steep_range)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _needs_energy_balance(increment, bond_list):
    """Return whether the mean force is computed from the energy balance.

    Round-off forbids it for a tiny increment, unless the increment crosses a jump of the initial bonds.
    """
    path_state = bond_list.now
    law = bond_list.law
    start = path_state[PATH.displacement]
    end = start + increment
    crosses_zero = min(start, end) <= 0.0 <= max(start, end)
    has_jump = law[LAW.initial] > 0 and law[LAW.order] < 1
    min_step = MIN_ENERGY_STEP if law[LAW.half_width] == 0 else MIN_ENERGY_STEP_SPREAD
    is_large = abs(increment) / path_state[PATH.length] > min_step
    return is_large or (crosses_zero and has_jump)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _mean_from_energy(is_short, increment, bond_list, v0, dt):
    """Return the path-mean force of a bond list from its energy balance."""
    last = list_energy(increment, bond_list, v0, dt)
    energy_gain = last - bond_list.status[STATUS.energy]
    eps = _advance_path_state(increment, bond_list.now, bond_list.growth, v0, v0, dt).middle_length
    if is_short:
        stored = _average_by_simpson(True, last, increment, bond_list, v0, dt)
    else:
        stored = _average_by_gauss(True, increment, bond_list, v0, dt)
    return (stored * abs(increment) / eps + energy_gain) / increment


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _average_by_simpson(is_energy, last, increment, bond_list, v0, dt):
    """Average energy or force of a bond list over an increment by Simpson's rule."""
    first = _first_integrand(is_energy, bond_list)
    middle = _integrand(is_energy, 0.5 * increment, bond_list, v0, 0.5 * dt)
    return (first + 4 * middle + last) / 6


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _average_by_gauss(is_energy, increment, bond_list, v0, dt):
    """Average energy or force of a bond list over an increment by panels of Gauss points."""
    path = abs(increment) / bond_list.now[PATH.length]
    if path <= MAX_PANEL_LENGTH:
        return _integrate_panel(is_energy, (0.0, 1.0), increment, bond_list, v0, dt)
    low = 0.0
    high = MAX_PANEL_LENGTH / path
    total = 0.0
    while low < 1:
        # The last two panels are merged into one, so that no panel is much shorter than the others.
        high = 1.0 if high > 0.75 else high
        total += _integrate_panel(is_energy, (low, high), increment, bond_list, v0, dt)
        low = high
        high = 2 * high
    return total


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _first_integrand(is_energy, bond_list):
    """Return the energy or force of a bond list in its present state."""
    status = bond_list.status
    path_state = bond_list.now
    if is_energy:
        return status[STATUS.energy]
    if bond_list.law[LAW.form] < FORM_REPORT:
        return status[STATUS.force]
    initial = sum_initial(
        path_state[PATH.displacement], path_state[PATH.path], path_state[PATH.damage], bond_list.law
    )
    return status[STATUS.force] - status[STATUS.initial_pressure] * initial.force


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_panel(is_energy, span, increment, bond_list, v0, dt):
    """Integrate by five Gauss points between two fractions of an increment."""
    low, high = span
    total = 0.0
    for point, weight in GAUSS_RULE_5:
        fraction = low + (high - low) * (1 + point) / 2
        value = _integrand(is_energy, fraction * increment, bond_list, v0, fraction * dt)
        total += weight / 2 * value
    return (high - low) * total


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_slope(increment, bond_list, v0, dt):
    """Return the path-mean force and its derivative with respect to the increment, in the form FORM_MOMENTS.

    Parameters
    ----------
    increment : float
        Increment of the relative displacement [m].
    bond_list : BondList
    v0 : float
        Velocity at the start of the increment [m/s].
    dt : float
        Duration of the increment [s].

    Returns
    -------
    MeanForce
    """
    status = bond_list.status
    path_state = bond_list.now
    law = bond_list.law
    displacement = path_state[PATH.displacement]
    damage = path_state[PATH.damage]
    head = int(status[STATUS.head])
    strips = StripRange(head, head, int(status[STATUS.end]))
    scale = exp(path_state[PATH.reference] - damage)
    moments = sum_moments(displacement, scale, bond_list.bondlist, strips)
    initial = status[STATUS.initial_pressure] * law[LAW.initial] * exp(-damage)
    path = abs(increment)
    middle, _ = grow(path_state[PATH.length], v0, v0, path / 2, dt / 2, bond_list.growth)
    mean, slope = bond_mean(
        moments.m + initial,
        moments.z + initial * displacement,
        increment,
        status[STATUS.pressure],
        middle,
    )
    return MeanForce(mean / law[LAW.length], slope / law[LAW.length])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def list_step(increment, bond_list, v0, v1, dt):
    """Advance a list of bond strips by an increment: append new strips and drop the oldest.

    The strips are merged from time to time.

    Force and energy after the step are written into the status.

    Parameters
    ----------
    increment : float
        Increment [m].
    bond_list : BondList
        As in the docstring of the module, changed in place.
    v0, v1, dt : float
        Velocities [m/s] at the ends of the step, and its duration [s].

    Returns
    -------
    bool
        False if the array of strips is full.
    """
    bonds = bond_list.bondlist
    status = bond_list.status
    path_state = bond_list.now
    law = bond_list.law
    before = PathValues(
        path_state[PATH.displacement],
        path_state[PATH.path],
        path_state[PATH.damage],
        path_state[PATH.growth],
        path_state[PATH.length],
        0.0,
    )
    after = _advance_path_state(increment, path_state, bond_list.growth, v0, v1, dt)
    path_state[PATH.displacement] = after.displacement
    path_state[PATH.path] = after.path
    path_state[PATH.damage] = after.damage
    path_state[PATH.growth] = after.growth
    path_state[PATH.length] = after.length
    _move_reference(bonds, status, path_state, law)
    has_room = True
    if increment != 0 and status[STATUS.pressure] > 0:
        formation = Formation(
            increment, before, after, status[STATUS.pressure], path_state[PATH.reference]
        )
        has_room = _append_strip(formation, bond_list)
    if increment != 0:
        _drop_old_strips(bonds, status, path_state, law)
        n_strips = status[STATUS.end] - status[STATUS.head]
        # A merge visits the whole list, so it waits until the list has grown by a fifth.
        has_grown = n_strips > 1.2 * status[STATUS.n_after_merge] + MIN_STRIPS_BETWEEN_MERGES
        if law[LAW.merge_width] > 0 and has_grown:
            merge_strips(bonds, status, path_state, law)
    total = sum_list(0.0, bond_list, 0.0, 0.0)
    status[STATUS.force] = total.force
    status[STATUS.energy] = total.energy
    n_strips = status[STATUS.end] - status[STATUS.head]
    status[STATUS.max_strips] = max(status[STATUS.max_strips], n_strips)
    return has_room


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _move_reference(bonds, status, path_state, law):
    """Move the reference of the scaled numbers to the present damage or growth before they overflow."""
    form = law[LAW.form]
    if form == FORM_REPORT:
        return
    age_measure = (
        path_state[PATH.growth] if form == FORM_REPORT_GROWING else path_state[PATH.damage]
    )
    if age_measure - path_state[PATH.reference] < MAX_EXPONENT:
        return
    factor = exp(path_state[PATH.reference] - age_measure)
    for k in range(int(status[STATUS.head]), int(status[STATUS.end])):
        if form == FORM_MOMENTS:
            bonds[MOMENT.weight, k] *= factor
        elif form == FORM_POWER:
            bonds[POWER_ROW.weight_1, k] *= factor
            bonds[POWER_ROW.weight_2, k] *= factor
        else:
            bonds[GROWING_ROW.length_1, k] *= factor
            bonds[GROWING_ROW.length_2, k] *= factor
    path_state[PATH.reference] = age_measure


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _append_strip(formation, bond_list):
    """Append the strips of bonds that an increment forms; return False if the list is full."""
    increment, before, after, pressure, _ = formation
    bonds = bond_list.bondlist
    status = bond_list.status
    law = bond_list.law
    form = law[LAW.form]
    path = abs(increment)
    if form == FORM_REPORT and _extend_last_strip(formation, bonds, status):
        return True
    pieces = StripCount(1.0, 1.0)
    if form == FORM_POWER or form == FORM_REPORT_GROWING:
        pieces = _count_strips(path, after.middle_length, after.growth - before.growth, law)
    count = pieces.count
    status[STATUS.n_extra] += count - 1
    end = int(status[STATUS.end])
    capacity = min(int(status[STATUS.room_end]), bonds.shape[1])
    if end + pieces.kept > capacity:
        end = _pack_strips(bonds, status)
        if end + pieces.kept > capacity:
            return False
    for piece in range(int(pieces.kept) - 1, -1, -1):
        end_fraction = piece / count
        start_fraction = (piece + 1) / count
        bonds[STRIP.start, end] = after.displacement - start_fraction * increment
        bonds[STRIP.end, end] = after.displacement - end_fraction * increment
        bonds[STRIP.covered, end] = path / count
        bonds[STRIP.path, end] = after.path - end_fraction * path
        bonds[STRIP.age_measure, end] = bonds[STRIP.path, end]
        bonds[STRIP.age_width, end] = bonds[STRIP.covered, end]
        bonds[STRIP.weight, end] = pressure * bonds[STRIP.covered, end]
        if form == FORM_MOMENTS:
            _write_moments(formation, bonds, end)
        elif form == FORM_POWER:
            _write_powers(end_fraction, count, formation, law[LAW.order], bonds, end)
        elif form == FORM_REPORT:
            bonds[REPORT_ROW.pressure, end] = pressure
        else:
            _write_start_lengths(piece, count, formation, bonds, end)
        end += 1
    status[STATUS.end] = end
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _extend_last_strip(formation, bonds, status):
    """Extend the last strip by an increment; return whether this was possible.

    Direction and pressure of both must agree. In the form FORM_REPORT the sum is exact for strips of any length.
    """
    increment, before, after, pressure, _ = formation
    k = int(status[STATUS.end]) - 1
    if k < status[STATUS.head] + status[STATUS.n_spread]:
        return False
    has_same_direction = (bonds[STRIP.end, k] - bonds[STRIP.start, k]) * increment > 0
    is_adjacent = bonds[STRIP.path, k] == before.path
    if not (has_same_direction and is_adjacent and bonds[REPORT_ROW.pressure, k] == pressure):
        return False
    bonds[STRIP.end, k] = after.displacement
    bonds[STRIP.age_measure, k] = after.path
    bonds[STRIP.path, k] = after.path
    bonds[STRIP.age_width, k] += abs(increment)
    bonds[STRIP.covered, k] = bonds[STRIP.age_width, k]
    bonds[STRIP.weight, k] = pressure * bonds[STRIP.age_width, k]
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_powers(end_fraction, count, formation, p, bonds, k):
    """Write the damage and the scaled weights of a strip in the form FORM_POWER.

    end_fraction: fraction of the increment at which the strip ends.
    """
    increment, before, after, pressure, reference = formation
    damage = after.damage - before.damage
    age_measure = after.damage - end_fraction * damage
    width = damage / count
    weight = pressure * (abs(increment) / count * after.middle_length ** (-p))
    bonds[STRIP.age_measure, k] = age_measure
    bonds[STRIP.age_width, k] = width
    bonds[STRIP.weight, k] = weight
    bonds[POWER_ROW.weight_1, k] = (
        0.5 * weight * exp(age_measure - GAUSS_POINT_1 * width - reference)
    )
    bonds[POWER_ROW.weight_2, k] = (
        0.5 * weight * exp(age_measure - GAUSS_POINT_2 * width - reference)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_start_lengths(piece, count, formation, bonds, k):
    """Write the scaled starting lengths of a strip of growing bonds.

    At a Gauss point it is the mature length when its bonds formed, times exp(J - reference) at that time. Later, the
    length of these bonds is that of mature bonds less exp(reference - J) times this number.
    """
    before = formation.before
    after = formation.after
    reference = formation.reference
    growth = after.growth - before.growth
    target = target_length(before.length, after.length, growth)
    start = (before.length - target) * exp(after.growth - growth - reference)
    for point in range(2):
        fraction = (piece + (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)) / count
        length = target * exp(after.growth - fraction * growth - reference) + start
        bonds[GROWING_ROW.length_1 + point, k] = length


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_moments(formation, bonds, k):
    """Write centre, variance and scaled weight of the bonds that form on an increment and survive it."""
    increment, _, after, pressure, reference = formation
    eps = after.middle_length
    direction = np.copysign(1.0, increment)
    moments = _surviving_moments(abs(increment) / eps)
    bonds[MOMENT.centre, k] = after.displacement - direction * eps * moments.distance
    bonds[MOMENT.variance, k] = eps * eps * moments.variance
    bonds[MOMENT.weight, k] = moments.weight * exp(after.damage - reference) * pressure


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _surviving_moments(x):
    """Return the moments of the bonds that form on a path of x bond lengths and survive it."""
    if x < MAX_SERIES_PATH:
        return StripMoments(
            x * (1 - x / 2 * (1 - x / 3 * (1 - x / 4 * (1 - x / 5)))),
            x * (1 / 2 - x / 12 * (1 - x * x / 60)),
            x * x / 12 * (1 - x * x / 20),
        )
    decay = exp(-x)
    weight = -expm1(-x)
    return StripMoments(
        weight, 1 - x * decay / weight, max(1 - x * x * decay / (weight * weight), 0.0)
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _drop_old_strips(bonds, status, path_state, law):
    """Advance the head of the list beyond the strips that are older than the cut-off."""
    form = law[LAW.form]
    head = int(status[STATUS.head])
    end = int(status[STATUS.end])
    while head < end:
        path = path_state[PATH.path] - bonds[STRIP.path, head]
        if form == FORM_MOMENTS:
            age = path / law[LAW.length]
        elif form == FORM_POWER:
            age = path_state[PATH.damage] - bonds[STRIP.age_measure, head]
        else:
            age = path
        if age <= law[LAW.cutoff]:
            break
        head += 1
        status[STATUS.n_spread] = max(status[STATUS.n_spread] - 1, 0.0)
    status[STATUS.head] = head


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _pack_strips(bonds, status):
    """Move the list to the start of the array; return the index after its last strip."""
    head = int(status[STATUS.head])
    end = int(status[STATUS.end])
    room_start = int(status[STATUS.room_start])
    for i in range(bonds.shape[0]):
        for k in range(head, end):
            bonds[i, k - head + room_start] = bonds[i, k]
    status[STATUS.head] = room_start
    status[STATUS.end] = end - head + room_start
    return end - head + room_start
