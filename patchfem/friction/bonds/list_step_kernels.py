"""Compiled list of strips of bonds (eq. 2.17): increment of a point, joined strips, and lift-off.

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
    PATH,
    STATUS,
    STRIP,
)
from .list_sum_kernels import MIN_POSITIVE, PathValues, interpolate_value

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
    # The width of a strip of a shorter path would underflow
    if abs(increment) < MIN_POSITIVE:
        increment = 0.0
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
    """Write force [1] and energy [m] of the present state into the rows of `STRIP` for it, and into the status."""
    strips = bonds.bondlist
    status = bonds.status
    first = int(status[STATUS.first_column])
    sum_list(0.0, 0.0, bonds, 0.0, 0.0)
    strips[STRIP.present_force, first] = strips[STRIP.force, first]
    strips[STRIP.present_energy, first] = strips[STRIP.energy, first]
    for k in range(int(status[STATUS.head]), int(status[STATUS.end]) + 1):
        strips[STRIP.present_force, k] = strips[STRIP.force, k]
        strips[STRIP.present_energy, k] = strips[STRIP.energy, k]
    status[STATUS.force] = total(STRIP.force, bonds)
    status[STATUS.energy] = total(STRIP.energy, bonds)
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
    """Append the strips of bonds that an increment forms, and return False if the list is full.

    `increment` is the signed displacement [m], `before` and `after` are the path states at its ends, and `bonds` is the
    list.
    """
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
        strips[STRIP.pressure, column] = status[STATUS.pressure]

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
    """Write the scaled weights of a strip at its Gauss points to `STRIP.value_1` and `value_2`, for reading="stretch".

    They are covered/(2 eps^p) exp(damage at formation - reference), half of the strip each.

    Parameters
    ----------
    width : float
        Damage along the strip [1].
    eps : float
        Bond length when the bonds of the strip formed [m].
    bonds : list_rows_kernels.BondList
        List of bonds, which is changed.
    column : int
        Column of the strip.
    """
    strips = bonds.bondlist
    p = bonds.law[LAW.order]
    weight = strips[STRIP.covered, column] / power(eps, p)
    age = strips[STRIP.damage, column] - bonds.now[PATH.reference]
    strips[STRIP.value_1, column] = 0.5 * weight * exp(age - GAUSS_POINT_1 * width)
    strips[STRIP.value_2, column] = 0.5 * weight * exp(age - GAUSS_POINT_2 * width)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _write_start_lengths(low, width, before, after, bonds, column):
    """Write the scaled starting lengths [m] of a strip of growing bonds to `STRIP.value_1` and `value_2`.

    At a Gauss point it is the mature length when its bonds formed, times exp(J - reference) at that time. Later, the
    length of these bonds is that of mature bonds less exp(reference - J) times this number.

    Parameters
    ----------
    low, width : float
        End and length of the strip, as fractions of the increment from its end.
    before, after : PathValues
        Path states before and after the increment.
    bonds : list_rows_kernels.BondList
        List of bonds, which is changed.
    column : int
        Column of the strip.
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
    if strips[STRIP.pressure, k - 1] != strips[STRIP.pressure, k]:
        return
    if _join_strips(bonds, k - 1, k):
        bonds.status[STATUS.end] = k


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_strips(bonds, older, younger):
    """Add a strip to an older one if it continues it in the same direction, and return whether it does.

    `bonds` is the list, which is changed, and `older` and `younger` are the columns of both strips.
    """
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

    # The joint pressure conserves the sum of the weights
    pressure_change = strips[STRIP.pressure, younger] - strips[STRIP.pressure, older]
    strips[STRIP.pressure, older] += part * pressure_change
    strips[STRIP.end, older] = strips[STRIP.end, younger]
    strips[STRIP.path, older] = strips[STRIP.path, younger]
    strips[STRIP.damage, older] = strips[STRIP.damage, younger]
    strips[STRIP.covered, older] = covered
    strips[STRIP.value_1, older] = value_1
    strips[STRIP.value_2, older] = value_2
    return True


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_similar_lengths(bonds, older, younger):
    """Return whether the growing bonds of two strips have similar lengths or are fully grown.

    `bonds` is the list, and `older` and `younger` are the columns of both strips.
    """
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


# ---- lift-off


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def break_bonds(bonds):
    """Break all bonds of a point, as when it lifts off."""
    strips = bonds.bondlist
    status = bonds.status
    strips[STRIP.pressure, int(status[STATUS.first_column])] = 0.0
    status[STATUS.initial_pressure] = 0.0
    status[STATUS.head] = status[STATUS.end] = status[STATUS.first_column] + 1
    status[STATUS.n_after_merge] = status[STATUS.energy] = status[STATUS.force] = 0.0
