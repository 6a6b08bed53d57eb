"""Merging of neighbouring strips of bonds whose joint width is small for their age.

It bounds the length of the list for runs, strokes and steps of any size. First moments are conserved, so the error falls
with the square of the width.
"""

from math import exp

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_forms_kernels import (
    FORM_MOMENTS,
    FORM_POWER,
    FORM_REPORT,
    FORM_REPORT_GROWING,
    GAUSS_POINT_1,
    GAUSS_POINT_2,
)
from .list_math_kernels import fast_exp, fast_log
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
from .list_sum_kernels import interpolate_start_length

# Largest starting length of fully grown bonds, relative to their present length
MAX_START_LENGTH_RATIO = 1e-8
MAX_GROWTH_SPAN = 0.1  # largest range of the growth J within a merged strip of growing bonds
# Largest relative decrease of the bond length from the first to the last bond of a merged strip
MAX_SHORTENING = 0.1
# Largest mismatch of two ranges that count as the same, relative to their width
MAX_RANGE_MISMATCH = 1e-3
# Largest age in bond lengths at which the merge width still grows; the limit keeps it finite
MAX_AGE = 200.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def merge_strips(bonds, status, path_state, law):
    """Merge neighbouring strips whose joint width is small for their age.

    The largest width is merge_width eps_0 exp(R/(3 eps_0)) at the path R since the bonds formed. Two strips of one pass
    are joined end to end. Strips of several passes over the same range become a spread strip, the oldest first.

    Parameters
    ----------
    bonds : (N_ROWS, capacity) array
        Array of strips, changed in place.
    status, path_state, law : (16,), (6,), (24,) array
        As `STATUS`, `PATH` and `LAW` name them; the status is changed in place.
    """
    head = int(status[STATUS.head])
    n_spread_before = int(status[STATUS.n_spread])
    n_spread = 0
    out = head
    for k in range(head, int(status[STATUS.end])):
        was_spread = k < head + n_spread_before
        if k > head:
            last = out - 1
            is_last_spread = last < head + n_spread
            is_first_unspread = last == head + n_spread
            width = _max_width(k, bonds, path_state, law)
            is_narrow = bonds[STRIP.covered, last] + bonds[STRIP.covered, k] <= width
            if law[LAW.form] == FORM_REPORT_GROWING:
                is_narrow = is_narrow and _have_similar_lengths(bonds, last, k, path_state)
            if is_narrow and law[LAW.form] == FORM_MOMENTS:
                _join_moments(bonds, last, k)
                continue
            can_join_ends = is_narrow and not was_spread and not is_last_spread
            if can_join_ends and _are_end_to_end(bonds, last, k, width, law):
                _join_ends(bonds, last, k, path_state, law)
                continue
            is_uniform = _is_uniformly_weighted(bonds, last, k, path_state, law)
            can_spread = is_narrow and is_uniform and (is_last_spread or is_first_unspread)
            if can_spread and _have_same_range(bonds, last, k, path_state, law, status):
                if is_first_unspread:
                    _spread_strip(bonds, last, law)
                    n_spread += 1
                _join_to_spread_strip(bonds, last, k, was_spread, path_state, law)
                continue
            if (
                is_first_unspread
                and is_uniform
                and _is_narrow_before_reversal(bonds, last, k, width, law)
            ):
                _spread_strip(bonds, last, law)
                n_spread += 1
        if out != k:
            for i in range(bonds.shape[0]):
                bonds[i, out] = bonds[i, k]
        if was_spread and out == head + n_spread:
            n_spread += 1
        out += 1
    status[STATUS.end] = out
    status[STATUS.n_spread] = n_spread
    status[STATUS.n_after_merge] = out - head


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _max_width(k, bonds, path_state, law):
    """Return the largest width [m] of a merged strip that ends with strip k."""
    age = (path_state[PATH.path] - bonds[STRIP.path, k]) / law[LAW.length]
    return law[LAW.merge_width] * law[LAW.length] * exp(min(age / 3, MAX_AGE))


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _signed_width(bonds, k):
    """Return the signed width [m] of a strip."""
    return bonds[STRIP.end, k] - bonds[STRIP.start, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _are_end_to_end(bonds, i, k, width, law):
    """Return whether two strips are adjacent, have the same direction and are similar enough to be joined."""
    form = law[LAW.form]
    if (
        bonds[STRIP.end, i] != bonds[STRIP.start, k]
        or _signed_width(bonds, i) * _signed_width(bonds, k) <= 0
    ):
        return False
    if form == FORM_REPORT and bonds[REPORT_ROW.pressure, i] == bonds[REPORT_ROW.pressure, k]:
        return False
    if form == FORM_REPORT_GROWING or (form == FORM_POWER and law[LAW.order] >= 1.0):
        return True
    return _have_similar_density(bonds, i, k, width, law[LAW.length])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _is_narrow_before_reversal(bonds, i, k, width, law):
    """Return whether strip i is narrow and the motion reverses right after it, in strip k."""
    is_narrow = bonds[STRIP.covered, i] <= 0.5 * width
    return (
        is_narrow
        and law[LAW.form] != FORM_MOMENTS
        and _signed_width(bonds, i) * _signed_width(bonds, k) < 0
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _is_fully_grown(bonds, k, path_state):
    """Return whether the starting lengths of the bonds of a strip no longer matter."""
    start = interpolate_start_length(
        0.0, bonds[GROWING_ROW.length_1, k], bonds[GROWING_ROW.length_2, k]
    )
    scale = exp(path_state[PATH.reference] - path_state[PATH.growth])
    return scale * start <= MAX_START_LENGTH_RATIO * path_state[PATH.length]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _is_uniformly_weighted(bonds, i, k, path_state, law):
    """Return whether the weight of two strips is uniform over them, or too small to matter.

    With a fractional order the weight R^p of young bonds is not uniform. Two strips cover the paths from R = near to
    far and carry (far^(p + 1) - near^(p + 1))/Gamma(p + 1) of the friction limit; if their weight is taken as uniform,
    the fraction (far - near)/far of this force moves.
    """
    p = law[LAW.order]
    form = law[LAW.form]
    if form == FORM_REPORT_GROWING and not _is_fully_grown(bonds, k, path_state):
        return False
    depends_on_path = form == FORM_REPORT or (form == FORM_REPORT_GROWING and p < 1)
    if not depends_on_path or p == 0.0:
        return True
    path_to_end = (path_state[PATH.path] - bonds[STRIP.path, k]) / law[LAW.length]
    joint_path = (bonds[STRIP.covered, i] + bonds[STRIP.covered, k]) / law[LAW.length]
    path_to_start = path_to_end + joint_path
    part = law[LAW.inverse_gamma] * (
        fast_exp((p + 1) * fast_log(path_to_start)) - fast_exp((p + 1) * fast_log(path_to_end))
    )
    return abs(p) * part * joint_path <= law[LAW.merge_width] * law[LAW.merge_width] * path_to_start


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_similar_density(bonds, i, k, width, eps0):
    """Return whether two adjacent strips have nearly the same weight per path.

    Where the bond length changes their weights differ by 1/eps^p. Joining them moves a quarter of the relative
    difference of their weights. With an order below 1 all of it acts once the displacement returns to them, where
    u = 0.
    """
    left = bonds[STRIP.weight, i] * bonds[STRIP.covered, k]
    right = bonds[STRIP.weight, k] * bonds[STRIP.covered, i]
    joint_path = bonds[STRIP.covered, i] + bonds[STRIP.covered, k]
    return abs(left - right) * joint_path * eps0 <= width * width * (left + right)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_similar_lengths(bonds, i, k, path_state):
    """Return whether the growing bonds of two strips have similar lengths or are fully grown."""
    if _is_fully_grown(bonds, k, path_state):
        return True
    young = interpolate_start_length(
        0.0, bonds[GROWING_ROW.length_1, k], bonds[GROWING_ROW.length_2, k]
    )
    old = interpolate_start_length(
        1.0, bonds[GROWING_ROW.length_1, i], bonds[GROWING_ROW.length_2, i]
    )
    scale = exp(path_state[PATH.reference] - path_state[PATH.growth])
    young_length = path_state[PATH.length] - scale * young
    old_length = path_state[PATH.length] - scale * old
    return young <= exp(MAX_GROWTH_SPAN) * old and young_length >= (1 - MAX_SHORTENING) * old_length


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _have_same_range(bonds, i, k, path_state, law, status):
    """Return whether two strips cover nearly the same range, so that both can be distributed over a mean range."""
    low_i = min(bonds[STRIP.start, i], bonds[STRIP.end, i])
    high_i = max(bonds[STRIP.start, i], bonds[STRIP.end, i])
    low_k = min(bonds[STRIP.start, k], bonds[STRIP.end, k])
    high_k = max(bonds[STRIP.start, k], bonds[STRIP.end, k])
    mismatch = abs(low_i - low_k) + abs(high_i - high_k)
    width = max(high_i, high_k) - min(low_i, low_k)
    if mismatch <= MAX_RANGE_MISMATCH * width:
        return True
    joint_path = bonds[STRIP.covered, i] + bonds[STRIP.covered, k]
    merge_width = law[LAW.merge_width]
    age = (path_state[PATH.path] - bonds[STRIP.path, k]) / law[LAW.length]
    cubic = merge_width * merge_width * merge_width * law[LAW.length] * exp(min(age, MAX_AGE))
    if joint_path * mismatch <= cubic * width:
        status[STATUS.n_unlike] += 1
        return True
    return False


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_moments(bonds, i, k):
    """Add strip k to strip i, both given by weight, centre and variance."""
    weight_i = bonds[MOMENT.weight, i]
    weight_k = bonds[MOMENT.weight, k]
    total = weight_i + weight_k
    if total > 0:
        gap = bonds[MOMENT.centre, k] - bonds[MOMENT.centre, i]
        variance_within = (
            weight_i * bonds[MOMENT.variance, i] + weight_k * bonds[MOMENT.variance, k]
        ) / total
        bonds[MOMENT.variance, i] = variance_within + weight_i * weight_k * gap * gap / (
            total * total
        )
        bonds[MOMENT.centre, i] += weight_k / total * gap
    bonds[MOMENT.weight, i] = total
    _extend_strip(bonds, i, k)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _extend_strip(bonds, i, k):
    """Add weight and path of strip k to the older strip i, which takes over its end."""
    bonds[STRIP.age_width, i] += bonds[STRIP.age_width, k]
    bonds[STRIP.weight, i] += bonds[STRIP.weight, k]
    bonds[STRIP.covered, i] += bonds[STRIP.covered, k]
    bonds[STRIP.age_measure, i] = bonds[STRIP.age_measure, k]
    bonds[STRIP.path, i] = bonds[STRIP.path, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_ends(bonds, i, k, path_state, law):
    """Join two adjacent strips that formed in the same pass; their first moments are conserved."""
    form = law[LAW.form]
    if form == FORM_REPORT_GROWING:
        length_1 = _joint_start_length(GAUSS_POINT_1, bonds, i, k, path_state)
        length_2 = _joint_start_length(GAUSS_POINT_2, bonds, i, k, path_state)
    bonds[STRIP.end, i] = bonds[STRIP.end, k]
    _extend_strip(bonds, i, k)
    if form == FORM_REPORT_GROWING:
        bonds[GROWING_ROW.length_1, i] = length_1
        bonds[GROWING_ROW.length_2, i] = length_2
    elif form == FORM_REPORT:
        bonds[REPORT_ROW.pressure, i] = bonds[STRIP.weight, i] / bonds[STRIP.age_width, i]
    else:
        weight = 0.5 * bonds[STRIP.weight, i]
        age_measure = bonds[STRIP.age_measure, i]
        width = bonds[STRIP.age_width, i]
        reference = path_state[PATH.reference]
        bonds[POWER_ROW.weight_1, i] = weight * exp(age_measure - GAUSS_POINT_1 * width - reference)
        bonds[POWER_ROW.weight_2, i] = weight * exp(age_measure - GAUSS_POINT_2 * width - reference)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _joint_start_length(gauss, bonds, i, k, path_state):
    """Return the scaled initial bond length at a Gauss point of the joined strips i and k."""
    if _is_fully_grown(bonds, k, path_state):
        return 0.0
    width_i = bonds[STRIP.age_width, i]
    width_k = bonds[STRIP.age_width, k]
    position = gauss * (width_i + width_k)
    j = k if position <= width_k else i
    fraction = position / width_k if position <= width_k else (position - width_k) / width_i
    return interpolate_start_length(
        fraction, bonds[GROWING_ROW.length_1, j], bonds[GROWING_ROW.length_2, j]
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _spread_strip(bonds, k, law):
    """Convert a strip that formed in a single pass into one distributed over its range of positions."""
    low = min(bonds[STRIP.start, k], bonds[STRIP.end, k])
    high = max(bonds[STRIP.start, k], bonds[STRIP.end, k])
    bonds[STRIP.start, k] = low
    bonds[STRIP.end, k] = high
    if law[LAW.form] == FORM_POWER:
        bonds[POWER_ROW.weight_1, k] += bonds[POWER_ROW.weight_2, k]
        bonds[POWER_ROW.weight_2, k] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_to_spread_strip(bonds, i, k, was_spread, path_state, law):
    """Add strip k to strip i, whose bonds are distributed over its range.

    The range of the sum is the mean of both ranges, weighted by the paths that both cover.
    """
    form = law[LAW.form]
    path_i = bonds[STRIP.covered, i]
    path_k = bonds[STRIP.covered, k]
    total = path_i + path_k
    low = min(bonds[STRIP.start, k], bonds[STRIP.end, k])
    high = max(bonds[STRIP.start, k], bonds[STRIP.end, k])
    bonds[STRIP.start, i] = (path_i * bonds[STRIP.start, i] + path_k * low) / total
    bonds[STRIP.end, i] = (path_i * bonds[STRIP.end, i] + path_k * high) / total
    if form == FORM_POWER:
        second = 0.0 if was_spread else bonds[POWER_ROW.weight_2, k]
        bonds[POWER_ROW.weight_1, i] += bonds[POWER_ROW.weight_1, k] + second
    elif form == FORM_REPORT_GROWING:
        length_1 = _joint_start_length(GAUSS_POINT_1, bonds, i, k, path_state)
        length_2 = _joint_start_length(GAUSS_POINT_2, bonds, i, k, path_state)
        bonds[GROWING_ROW.length_1, i] = length_1
        bonds[GROWING_ROW.length_2, i] = length_2
    _extend_strip(bonds, i, k)
    if form == FORM_REPORT:
        bonds[REPORT_ROW.pressure, i] = bonds[STRIP.weight, i] / bonds[STRIP.age_width, i]
