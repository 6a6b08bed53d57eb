"""Compiled list of strips of bonds (eq. 2.17): increment of a point, joined strips, and change of its load.

`bonds` is a `list_rows_kernels.BondList`, which these functions change. `before` and `after` are `PathValues` at the ends
of an increment, and k is the column of a strip.
"""

from math import exp

from ...compiled.flags_kernels import NJIT_NO_REFCOUNT
from ...compiled.jit import njit
from .list_kernels import divide, find_end, find_path, sum_list, target_length, total
from .list_math_kernels import power
from .list_rows_kernels import (
    FORM_GROWING,
    FORM_REPORT,
    FORM_STRETCH,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
    LAW,
    N_ROWS,
    PATH,
    STATUS,
    STRIP,
)
from .list_sum_kernels import PathValues, interpolate_value

# Largest exponent of the scaled values before they are rescaled; exp(709) is the largest
# floating-point number
MAX_SCALE_EXPONENT = 300.0
# Number of strips, in addition to a fifth of the list, by which the list grows before it is merged
# again
MIN_STRIPS_BETWEEN_MERGES = 12
# Largest starting length of fully grown bonds, relative to their present length
MAX_START_LENGTH_RATIO = 1e-8
MAX_GROWTH_SPAN = 0.1  # largest range of the growth J within a joined strip of growing bonds
# Largest relative decrease of the bond length from the first to the last bond of a joined strip
MAX_BOND_SHORTENING = 0.1
# Largest age in bond lengths at which the merge width still grows; the limit keeps it finite
MAX_MERGE_AGE = 200.0


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
    after = find_path(1.0, increment, bonds, v0, v1, dt)

    # The path state is updated first, because the values of the new strips refer to its damage or growth
    now[PATH.displacement] = after.displacement
    now[PATH.path] = after.path
    now[PATH.damage] = after.damage
    now[PATH.growth] = after.growth
    now[PATH.length] = after.length
    _move_reference(bonds)

    # Without pressure no bonds form, but those that exist still grow old
    has_space = True
    if increment != 0:
        if status[STATUS.pressure] > 0:
            has_space = _append_strips(increment, before, after, bonds)
        _drop_old_strips(bonds)
        # A merge visits the whole list, so it waits until the list has grown by a fifth
        n_strips = status[STATUS.end] - status[STATUS.head]
        has_grown = n_strips > 1.2 * status[STATUS.n_after_merge] + MIN_STRIPS_BETWEEN_MERGES
        if bonds.law[LAW.merge_width] > 0 and has_grown:
            _merge_strips(bonds)
    update_sums(bonds)
    return has_space


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def update_sums(bonds):
    """Write force and energy of the present state into the strips and, of the first point, into the status."""
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.first_column])
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
    if age - now[PATH.reference] < MAX_SCALE_EXPONENT:
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

    # Bonds of reading="report" fill one strip; other forms need several strips if the increment is long
    division = divide(path, after.middle_length, after.growth - before.growth, law)
    status[STATUS.n_extra] += division.count - 1
    if not _make_space(int(division.count), bonds):
        return False
    # The pressures of the new bonds stand in the column after the last strip
    new = int(status[STATUS.end])
    if strips.shape[0] == N_ROWS:
        strips[STRIP.pressure, new] = status[STATUS.pressure]

    # Strips follow each other from old to young, so that the head of the list is the oldest one
    for piece in range(int(division.count) - 1, -1, -1):
        column = int(status[STATUS.end])
        low = find_end(piece, division)
        high = find_end(piece + 1, division)
        strips[STRIP.start, column] = after.displacement - high * increment
        if high == 1:
            strips[STRIP.start, column] = before.displacement
        strips[STRIP.end, column] = after.displacement - low * increment
        strips[STRIP.path, column] = after.path - low * path
        strips[STRIP.damage, column] = after.damage - low * damage
        strips[STRIP.covered, column] = (high - low) * path
        for i in range(STRIP.pressure, strips.shape[0]):
            strips[i, column] = strips[i, new]

        # The values at the Gauss points depend on the form of the sum
        if law[LAW.form] == FORM_STRETCH:
            _write_weights((high - low) * damage, after.middle_length, bonds, column)
        elif law[LAW.form] == FORM_GROWING:
            _write_start_lengths(low, high - low, before, after, bonds, column)
        status[STATUS.end] = column + 1
    if law[LAW.form] == FORM_REPORT:
        # The sum is exact for strips of any length, so a strip of equal pressure is extended
        _join_last_strips(bonds)
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _make_space(count, bonds):
    """Move a list to its first column if further strips do not fit at its end; return whether they fit."""
    strips = bonds.bondlist
    status = bonds.status
    # The column after the last strip is that of new bonds
    capacity = min(int(status[STATUS.end_column]), strips.shape[1]) - 1
    head = int(status[STATUS.head])
    end = int(status[STATUS.end])
    if end + count <= capacity:
        return True
    first = int(status[STATUS.first_column]) + 1
    for i in range(strips.shape[0]):
        for k in range(head, end + 1):
            strips[i, k - head + first] = strips[i, k]
    status[STATUS.head] = first
    status[STATUS.end] = end - head + first
    return end - head + first + count <= capacity


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_weights(width, eps, bonds, column):
    """Write the scaled weights of a strip of a given damage along it, for reading="stretch"."""
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    weight = strips[STRIP.covered, column] / power(eps, p)
    age = strips[STRIP.damage, column] - bonds.now[PATH.reference]
    strips[STRIP.value_1, column] = 0.5 * weight * exp(age - GAUSS_POINT_1 * width)
    strips[STRIP.value_2, column] = 0.5 * weight * exp(age - GAUSS_POINT_2 * width)
    strips[STRIP.density, column] = power(eps, p) / eps


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_start_lengths(low, width, before, after, bonds, column):
    """Write the scaled starting lengths of a strip of growing bonds that ends at a fraction `low` of the increment.

    At a Gauss point it is the mature length when its bonds formed, times exp(J - reference) at that time. Later, the
    length of these bonds is that of mature bonds less exp(reference - J) times this number.
    """
    reference = bonds.now[PATH.reference]
    growth = after.growth - before.growth
    target = target_length(before.length, after.length, growth)
    start = (before.length - target) * exp(after.growth - growth - reference)
    for point in range(2):
        fraction = low + width * (GAUSS_POINT_1 if point == 0 else GAUSS_POINT_2)
        length = target * exp(after.growth - fraction * growth - reference) + start
        bonds.bondlist[STRIP.value_1 + point, column] = length


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
        width = law[LAW.merge_width] * law[LAW.length] * exp(min(age / 3, MAX_MERGE_AGE))
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
def _join_strips(bonds, older, younger):
    """Add a strip to an older one if it continues it in the same direction; return whether it does."""
    strips = bonds.bondlist
    form = bonds.law[LAW.form]
    older_width = strips[STRIP.end, older] - strips[STRIP.start, older]
    younger_width = strips[STRIP.end, younger] - strips[STRIP.start, younger]
    if strips[STRIP.end, older] != strips[STRIP.start, younger] or older_width * younger_width <= 0:
        return False
    if form == FORM_GROWING and not _have_similar_lengths(bonds, older, younger):
        return False

    # Two values with the sum and the first moment of the four; positions are measured from the end of the younger strip.
    # The values of growing bonds are lengths, not weights, and count with the length of their strip.
    covered = strips[STRIP.covered, older] + strips[STRIP.covered, younger]
    part = strips[STRIP.covered, younger] / covered
    older_scale = 1 - part if form == FORM_GROWING else 1.0
    younger_scale = part if form == FORM_GROWING else 1.0
    older_1 = older_scale * strips[STRIP.value_1, older]
    older_2 = older_scale * strips[STRIP.value_2, older]
    younger_1 = younger_scale * strips[STRIP.value_1, younger]
    younger_2 = younger_scale * strips[STRIP.value_2, younger]
    moment = (1 - part) * (GAUSS_POINT_1 * older_1 + GAUSS_POINT_2 * older_2)
    moment += part * (older_1 + older_2)
    moment += part * (GAUSS_POINT_1 * younger_1 + GAUSS_POINT_2 * younger_2)
    weight = older_1 + older_2 + younger_1 + younger_2
    value_2 = (moment - GAUSS_POINT_1 * weight) / (GAUSS_POINT_2 - GAUSS_POINT_1)
    value_1 = weight - value_2
    if value_1 < 0 or value_2 < 0:
        return False
    if form == FORM_STRETCH:
        part = (younger_1 + younger_2) / weight

    # The joint pressure conserves the sum of the weights of every point
    strips[STRIP.density, older] += part * (
        strips[STRIP.density, younger] - strips[STRIP.density, older]
    )
    for row in range(STRIP.pressure, strips.shape[0]):
        strips[row, older] += part * (strips[row, younger] - strips[row, older])
    strips[STRIP.end, older] = strips[STRIP.end, younger]
    strips[STRIP.path, older] = strips[STRIP.path, younger]
    strips[STRIP.damage, older] = strips[STRIP.damage, younger]
    strips[STRIP.covered, older] = covered
    strips[STRIP.value_1, older] = value_1
    strips[STRIP.value_2, older] = value_2
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_similar_lengths(bonds, older, younger):
    """Return whether the growing bonds of two strips have similar lengths or are fully grown."""
    strips = bonds.bondlist
    mature = bonds.now[PATH.length]
    scale = exp(bonds.now[PATH.reference] - bonds.now[PATH.growth])
    young = scale * interpolate_value(
        0.0, strips[STRIP.value_1, younger], strips[STRIP.value_2, younger]
    )
    old = scale * interpolate_value(1.0, strips[STRIP.value_1, older], strips[STRIP.value_2, older])
    if young <= MAX_START_LENGTH_RATIO * mature:
        return True
    return young <= exp(MAX_GROWTH_SPAN) * old and mature - young >= (1 - MAX_BOND_SHORTENING) * (
        mature - old
    )


# ---- change of load at rest


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

    # The density of the bonds falls in proportion to the pressure. Those that formed last have the least stretch, so
    # their loss changes the force least.
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
        status[STATUS.head] = status[STATUS.end] = status[STATUS.first_column] + 1
        status[STATUS.n_after_merge] = status[STATUS.energy] = status[STATUS.force] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _scale_pressure(factor, point, bonds):
    """Multiply the pressures of all bonds of a point by a factor."""
    strips = bonds.bondlist
    status = bonds.status
    strips[STRIP.pressure + point, int(status[STATUS.first_column])] *= factor
    for k in range(int(status[STATUS.head]), int(status[STATUS.end])):
        strips[STRIP.pressure + point, k] *= factor
    status[STATUS.initial_pressure] *= factor


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _density(column, point, bonds):
    """Return the density of the surviving bonds of a strip at a point, for reading="stretch"."""
    strips = bonds.bondlist
    pressure = strips[STRIP.pressure + point, column]
    if column == int(bonds.status[STATUS.first_column]):
        return pressure * bonds.law[LAW.initial] * exp(-bonds.now[PATH.damage])
    scale = exp(bonds.now[PATH.reference] - bonds.now[PATH.damage])
    weight = strips[STRIP.value_1, column] + strips[STRIP.value_2, column]
    return pressure * scale * strips[STRIP.density, column] * weight


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _total_density(point, bonds):
    """Return the density of all surviving bonds of a point, for reading="stretch"."""
    result = _density(int(bonds.status[STATUS.first_column]), point, bonds)
    for k in range(int(bonds.status[STATUS.head]), int(bonds.status[STATUS.end])):
        result += _density(k, point, bonds)
    return result


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _release_last_formed(excess, point, bonds):
    """Release the bonds of a point that formed last, up to a density; the bonds of a strip in equal parts."""
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.first_column])
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
    if not _make_space(1, bonds):
        return False
    strips = bonds.bondlist
    now = bonds.now
    column = int(bonds.status[STATUS.end])
    for i in range(strips.shape[0]):
        strips[i, column] = 0.0
    strips[STRIP.start, column] = strips[STRIP.end, column] = now[PATH.displacement]
    strips[STRIP.path, column] = now[PATH.path]
    strips[STRIP.damage, column] = now[PATH.damage]
    # Their length is eps_0
    eps0 = bonds.law[LAW.length]
    strips[STRIP.density, column] = power(eps0, bonds.law[LAW.order]) / eps0
    scale = exp(now[PATH.damage] - now[PATH.reference])
    strips[STRIP.value_1, column] = strips[STRIP.value_2, column] = (
        0.5 * scale / strips[STRIP.density, column]
    )
    bonds.status[STATUS.end] = column + 1
    return True
