"""Merging a list of strips: neighbours join while they stay narrow for their age, so that the list stays short however
long the run, small the strokes or fine the steps. First moments stay, the error falls with the square of the width."""

from math import exp

from ...compiled.jit import njit
from ..flags_kernels import NJIT_NO_REFCOUNT
from .list_math_kernels import fexp, flog
from .list_sum_kernels import AGED, FIRST, MOMENTS, POWER, SECOND, SHARES, start_length

GONE = 1e-8  # share of a bond length that was there when a bond formed
MOST_AGED = 0.1  # widest growth J across one strip of growing bonds
MOST_YOUNGER = 0.1  # share that the last bond of a strip may be shorter than its first


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def merge(bonds, status, now, law):
    """Join neighbours while they stay narrower than delta eps_0 exp(R/3 eps_0): of one pass of the slide end to end,
    or of several passes over the same places, taken as spread evenly over them and, of those, oldest first."""
    head, end = int(status[0]), int(status[1])
    many, out, delta, eps0 = 0, head, law[5], law[2]
    old_many = int(status[2])
    for k in range(head, end):
        age = (now[1] - bonds[9, k]) / eps0
        limit = delta * eps0 * exp(min(age / 3, 200.0))
        spread = k < head + old_many
        if k > head:
            last = out - 1
            joint = bonds[8, last] + bonds[8, k]
            narrow = joint <= limit and (law[1] != AGED or _evenly_aged(bonds, last, k, now))
            if narrow and law[1] == MOMENTS:
                _join_moments(bonds, last, k)
                continue
            if (
                narrow
                and not spread
                and last >= head + many
                and bonds[1, last] == bonds[0, k]
                and (bonds[1, last] - bonds[0, last]) * (bonds[1, k] - bonds[0, k]) > 0
                and (law[1] != SHARES or bonds[5, last] != bonds[5, k])
                and (
                    law[1] == AGED
                    or (law[1] == POWER and law[0] >= 1.0)
                    or _as_dense(bonds, last, k, limit, eps0)
                )
            ):
                _join_ends(bonds, last, k, now, law)
                continue
            grown = law[1] != AGED or _gone(bonds, k, now)
            if law[1] == SHARES or (law[1] == AGED and law[0] < 1):
                grown = grown and _even(bonds, last, k, now, law)
            if (
                narrow
                and grown
                and last <= head + many
                and _alike(
                    bonds, last, k, delta * delta * delta * eps0 * exp(min(age, 200.0)), status
                )
            ):
                if last == head + many:
                    _spread(bonds, last, law)
                    many += 1
                _join_spread(bonds, last, k, spread, now, law)
                continue
            if (
                last == head + many
                and bonds[8, last] <= 0.5 * limit
                and grown
                and (bonds[1, last] - bonds[0, last]) * (bonds[1, k] - bonds[0, k]) < 0
                and law[1] != MOMENTS
            ):
                _spread(bonds, last, law)
                many += 1
        if out != k:
            for i in range(bonds.shape[0]):
                bonds[i, out] = bonds[i, k]
        if spread and out == head + many:
            many += 1
        out += 1
    status[1], status[2], status[3] = out, many, out - head


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _gone(bonds, k, now):
    """Whether nothing is left of the starting lengths of a strip."""
    return exp(now[5] - now[3]) * start_length(0.0, bonds[5, k], bonds[6, k]) <= GONE * now[4]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _even(bonds, i, k, now, law):
    """Whether the bonds of two strips together weigh alike over them, or so little that it does not matter.

    Of a fractional order the weight R^p of young bonds is far from even, of full length or not: taken as even, it moves
    the share joint/(near + joint) of their part ((near + joint)^(p + 1) - near^(p + 1))/Gamma(p + 1) of the friction
    limit.
    """
    p, near, joint = law[0], (now[1] - bonds[9, k]) / law[2], (bonds[8, i] + bonds[8, k]) / law[2]
    if p == 0.0:
        return True
    far = near + joint
    part = law[4] * (fexp((p + 1) * flog(far)) - fexp((p + 1) * flog(near)))
    return abs(p) * part * joint <= law[5] * law[5] * far


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _as_dense(bonds, i, k, limit, eps0):
    """Whether two strips that lie end to end weigh nearly alike per path.

    Where the bond length changes they do not, by 1/eps^p: joined, the share |more - less|/4 of their weight moves over,
    and of an order below 1 that counts in full once the slide is back among them, at u = 0.
    """
    left, right = bonds[4, i] * bonds[8, k], bonds[4, k] * bonds[8, i]
    return abs(left - right) * (bonds[8, i] + bonds[8, k]) * eps0 <= limit * limit * (left + right)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _evenly_aged(bonds, i, k, now):
    """Whether the starting lengths of two strips together are gone, or span less than MOST_AGED e-folds while the bonds
    themselves differ by less than the share MOST_YOUNGER in length."""
    if _gone(bonds, k, now):
        return True
    young, old = (
        start_length(0.0, bonds[5, k], bonds[6, k]),
        start_length(1.0, bonds[5, i], bonds[6, i]),
    )
    left = exp(now[5] - now[3])
    return young <= exp(MOST_AGED) * old and now[4] - left * young >= (1 - MOST_YOUNGER) * (
        now[4] - left * old
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _alike(bonds, i, k, most, status):
    """Whether two strips cover the same places closely enough to be spread over their mean range."""
    low, high = min(bonds[0, i], bonds[1, i]), max(bonds[0, i], bonds[1, i])
    low2, high2 = min(bonds[0, k], bonds[1, k]), max(bonds[0, k], bonds[1, k])
    miss = abs(low - low2) + abs(high - high2)
    wide = max(high, high2) - min(low, low2)
    joint = bonds[8, i] + bonds[8, k]
    if miss <= 1e-3 * wide:
        return True
    if joint * miss <= most * wide:
        status[9] += 1
        return True
    return False


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_moments(bonds, i, k):
    a, b = bonds[5, i], bonds[5, k]
    total = a + b
    if total > 0:
        gap = bonds[0, k] - bonds[0, i]
        bonds[1, i] = (a * bonds[1, i] + b * bonds[1, k]) / total + a * b * gap * gap / (
            total * total
        )
        bonds[0, i] += b / total * gap
    bonds[5, i] = total
    _join_clock(bonds, i, k)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_clock(bonds, i, k):
    bonds[3, i] += bonds[3, k]
    bonds[4, i] += bonds[4, k]
    bonds[8, i] += bonds[8, k]
    bonds[2, i], bonds[9, i] = bonds[2, k], bonds[9, k]


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_ends(bonds, i, k, now, law):
    """Two strips of one pass, end to end; their first moments stay."""
    left, right = bonds[3, i], bonds[3, k]
    if law[1] == AGED:
        c0 = _aged_at(FIRST * (left + right), left, right, bonds, i, k, now)
        c1 = _aged_at(SECOND * (left + right), left, right, bonds, i, k, now)
    bonds[1, i] = bonds[1, k]
    _join_clock(bonds, i, k)
    if law[1] == AGED:
        bonds[5, i], bonds[6, i] = c0, c1
    elif law[1] == SHARES:
        bonds[5, i] = bonds[4, i] / bonds[3, i]
    else:
        for half in range(2):
            part = FIRST if half == 0 else SECOND
            bonds[5 + half, i] = 0.5 * bonds[4, i] * exp(bonds[2, i] - part * bonds[3, i] - now[5])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _aged_at(back, left, right, bonds, i, k, now):
    """Scaled starting length at `back` [m] from the end of two strips, zero once it is gone from both."""
    if _gone(bonds, k, now):
        return 0.0
    j, part = (k, back / right) if back <= right else (i, (back - right) / left)
    return start_length(part, bonds[5, j], bonds[6, j])


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _spread(bonds, k, law):
    """Take a strip of one pass as spread evenly over its places."""
    low, high = min(bonds[0, k], bonds[1, k]), max(bonds[0, k], bonds[1, k])
    bonds[0, k], bonds[1, k], bonds[7, k] = low, high, 0.0
    if law[1] == POWER:
        bonds[5, k] += bonds[6, k]
        bonds[6, k] = 0.0


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _join_spread(bonds, i, k, spread, now, law):
    """Add strip k to the spread strip i: mean range by the path covered."""
    a, b = bonds[8, i], bonds[8, k]
    low, high = min(bonds[0, k], bonds[1, k]), max(bonds[0, k], bonds[1, k])
    bonds[0, i] = (a * bonds[0, i] + b * low) / (a + b)
    bonds[1, i] = (a * bonds[1, i] + b * high) / (a + b)
    if law[1] == POWER:
        bonds[5, i] += bonds[5, k] + (0.0 if spread else bonds[6, k])
    elif law[1] == AGED:
        left, right = bonds[3, i], bonds[3, k]
        c0 = _aged_at(FIRST * (left + right), left, right, bonds, i, k, now)
        bonds[6, i] = _aged_at(SECOND * (left + right), left, right, bonds, i, k, now)
        bonds[5, i] = c0
    _join_clock(bonds, i, k)
    if law[1] == SHARES:
        bonds[5, i] = bonds[4, i] / bonds[3, i]
