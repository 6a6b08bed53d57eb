"""Compiled list of strips of bonds (eq. 2.17): old bonds are dropped and neighbours joined."""

from math import inf, sqrt
from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_KERNEL
from ...kernel_cache.jit import njit
from .decay_kernels import find_decay
from .list_math_kernels import fast_exp
from .strip_rows_kernels import EXACT_JOIN, N_STRIP_ENTRIES, ListLaw, ListState, Strip
from .strip_sum_kernels import GAUSS, Moved, find_ages, mix

CONTIGUOUS_TOL = 1e-9  # round-off of the ends of two strips that formed one after the other, relative to their length
MAX_YOUNG_RANGE = 0.25  # largest range of ages of growing bonds relative to the youngest one, for an order below 0
MIN_DIVISOR_LOAD = 1e-300  # smallest load [N] by which a weight is divided
MIN_MISFIT_AGE = 1e-12  # smallest age [bond lengths] at which the strength of bonds of a fractional order is compared


class Joint(NamedTuple):
    """Strip that replaces two, and the error of its force relative to theirs."""

    strip: Strip
    misfit: float


@njit(**NJIT_KERNEL)
def read_strip(strips, k):
    """Return the `Strip` of number k from its row in the array `strips` (capacity, 14)."""
    row = strips[k]
    return Strip(row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7])


@njit(**NJIT_KERNEL)
def write_strip(strips, k, strip):
    """Write a strip to a list.

    Parameters
    ----------
    strips : (capacity, 14) array
        List, changed in place.
    k : int
        Number of the strip.
    strip : Strip
        Strip to be written.
    """
    for i in range(N_STRIP_ENTRIES):
        strips[k, i] = strip[i]


@njit(**NJIT_KERNEL)
def join_strips(strips, state, law, error):
    """Drop bonds beyond the cut-off, and join neighbours while the error of the force is below a limit for their age.

    The limit is the given error times exp(x/c) at the age x of the younger strip, with `ListLaw.JOIN_AGE` c.

    Parameters
    ----------
    strips : (capacity, 14) array
        Strips of a point, changed in place.
    state : (9,) array
        Entries of `ListState`, changed in place.
    law : (k,) array
        Entries of `ListLaw`.
    error : float
        Limit at the age 0, relative to the load.
    """
    last = -1
    still = Moved(0.0, 0.0, 1.0, state[ListState.LENGTH])
    per_load = law[ListLaw.LENGTH] ** (law[ListLaw.ORDER] * law[ListLaw.IS_STRETCH])
    per_load /= max(state[ListState.LOAD], MIN_DIVISOR_LOAD)
    older = read_strip(strips, 0)
    for k in range(int(state[ListState.COUNT])):
        strip = drop_old_bonds(read_strip(strips, k), law[ListLaw.CUTOFF])
        if strip.age_1 > law[ListLaw.CUTOFF]:
            continue
        if last >= 0 and older.range > 0:
            joint = join(older, strip, law, still)

            # The errors of many joins add up as independent ones do: with its share of all bonds, the square of each stays
            # below the square of the limit. A strip that collects many small ones adds an error each time.
            misfit = joint.misfit * sqrt(min(joint.strip.weight * per_load, 1.0))
            limit = fast_exp(find_ages(strip, law, still).first / law[ListLaw.JOIN_AGE])
            limit *= error * min(strip.weight / joint.strip.weight, 1.0)
            if misfit <= max(limit, EXACT_JOIN):
                last -= 1
                strip = joint.strip
        last += 1
        write_strip(strips, last, strip)
        older = strip
    state[ListState.COUNT] = last + 1


@njit(**NJIT_KERNEL)
def drop_old_bonds(strip, cutoff):
    """Return a `Strip` without its bonds whose age is beyond a cut-off, in its unit, unless all are."""
    if strip.age_2 <= cutoff or strip.age_1 > cutoff:
        return strip
    kept = (cutoff - strip.age_1) / (strip.age_2 - strip.age_1)
    # The Gauss points move too; the missing lengths are linear between them.
    slope = (strip.short_2 - strip.short_1) / (2 * GAUSS)
    short = strip.short_1 - (1 - GAUSS) * slope
    return Strip(
        strip.stretch_1,
        mix(strip.stretch_1, strip.stretch_2, kept),
        strip.age_1,
        cutoff,
        kept * strip.range,
        kept * strip.weight,
        max(short + kept * (1 - GAUSS) * slope, 0.0),
        max(short + kept * (1 + GAUSS) * slope, 0.0),
    )


@njit(**NJIT_KERNEL)
def join(older, younger, law, still):
    """Return the `Joint` of two neighbours.

    Parameters
    ----------
    older, younger : Strip
        Strips of a list.
    law : (k,) array
        Entries of `ListLaw`.
    still : Moved
        Present length of mature bonds.
    """
    span = older.stretch_2 - younger.stretch_1
    gap = abs(older.stretch_1 - younger.stretch_2)
    whole = older.range + younger.range
    age_gap = abs(older.age_2 - younger.age_1 - whole)
    is_one_way = (older.stretch_2 - older.stretch_1) * (younger.stretch_2 - younger.stretch_1) > 0
    if is_one_way and gap <= CONTIGUOUS_TOL * abs(span) and age_gap <= CONTIGUOUS_TOL * whole:
        joint = join_stroke(older, younger, law, still)
    else:
        joint = join_strokes(older, younger, law, still)

    # Young bonds of an order below 0 are strong, and their ages are not linear while they grow.
    if law[ListLaw.ORDER] >= 0:
        return joint
    strip = joint.strip
    if strip.short_2 > 0 and strip.range > MAX_YOUNG_RANGE * strip.age_1:
        return Joint(strip, inf)
    strength = find_decay(find_ages(younger, law, still).last, law).strength
    return Joint(strip, joint.misfit * max(strength, 1.0))


@njit(**NJIT_KERNEL)
def find_misfit(exact, joint, order):
    """Return the relative error of the strength of bonds that are taken as older or younger than they are.

    Parameters
    ----------
    exact, joint : float
        Age before and after strips are joined [bond lengths].
    order : float
        Exponent p of the law.
    """
    return abs(joint - exact) * (1 + abs(order) / max(exact, MIN_MISFIT_AGE))


@njit(**NJIT_KERNEL)
def join_stroke(older, younger, law, still):
    """Return the `Joint` of two strips that formed one after the other in the same stroke.

    Parameters
    ----------
    older, younger : Strip
        Strips of a list.
    law : (k,) array
        Entries of `ListLaw`.
    still : Moved
        Present length of mature bonds.
    """
    # Line of the missing lengths with their mean and their first moment
    along = (younger.stretch_2 - younger.stretch_1) / (older.stretch_2 - younger.stretch_1)
    rest = 1 - along
    mean_0 = 0.5 * (older.short_1 + older.short_2)
    mean_1 = 0.5 * (younger.short_1 + younger.short_2)
    rise = rest * rest * (older.short_2 - mean_0) + along * along * (younger.short_2 - mean_1)
    rise += (mean_0 - mean_1) * along * rest * 3 * GAUSS
    mean = mix(mean_0, mean_1, along)
    strip = Strip(
        younger.stretch_1,
        older.stretch_2,
        younger.age_1,
        older.age_2,
        older.range + younger.range,
        older.weight + younger.weight,
        max(mean - rise, 0.0),
        max(mean + rise, 0.0),
    )

    # Largest difference of the distributions of weight over the stretch, and of the ages at the ends and at the border
    order = law[ListLaw.ORDER]
    old = find_ages(older, law, still)
    young = find_ages(younger, law, still)
    ages = find_ages(strip, law, still)
    border = mix(young.last, old.first, 0.5)
    misfit = find_misfit(border, mix(ages.first, ages.last, along), order)
    misfit = max(misfit, find_misfit(young.first, ages.first, order))
    misfit = max(misfit, find_misfit(old.last, ages.last, order))
    return Joint(strip, misfit + abs(younger.weight / strip.weight - along))


@njit(**NJIT_KERNEL)
def join_strokes(older, younger, law, still):
    """Return the `Joint` of strips of several strokes, which keeps weight, mean and variance of the stretch, and mean age.

    Parameters
    ----------
    older, younger : Strip
        Strips of a list.
    law : (k,) array
        Entries of `ListLaw`.
    still : Moved
        Present length of mature bonds.
    """
    weight = older.weight + younger.weight
    part = younger.weight / weight
    rest = 1 - part

    # A uniform distribution of the half width h has the variance h^2/3.
    u_0 = 0.5 * (older.stretch_1 + older.stretch_2)
    u_1 = 0.5 * (younger.stretch_1 + younger.stretch_2)
    half_0 = abs(older.stretch_2 - u_0)
    half_1 = abs(younger.stretch_2 - u_1)
    u = mix(u_0, u_1, part)
    variance = rest * half_0**2 + part * half_1**2
    half = sqrt(variance + 3 * part * rest * (u_0 - u_1) ** 2)
    age_0 = 0.5 * (older.age_1 + older.age_2)
    age_1 = 0.5 * (younger.age_1 + younger.age_2)
    age = mix(age_0, age_1, part)
    oldest = max(age_0 + 0.5 * older.range, age_1 + 0.5 * younger.range)
    youngest = min(age_0 - 0.5 * older.range, age_1 - 0.5 * younger.range)
    short = mix(older.short_1 + older.short_2, younger.short_1 + younger.short_2, part)
    strip = Strip(u - half, u + half, age, age, oldest - youngest, weight, 0.5 * short, 0.5 * short)

    # Difference of the ends of the distributions of the stretch
    low = min(u_0 - half_0, u_1 - half_1)
    high = max(u_0 + half_0, u_1 + half_1)
    misfit = max(abs(u - half - low), abs(u + half - high)) / (high - low)

    # Deviation of the ages from their mean: its effect is of the second order where both strips have bonds
    old = find_ages(older, law, still)
    young = find_ages(younger, law, still)
    x_0 = 0.5 * (old.first + old.last)
    x_1 = 0.5 * (young.first + young.last)
    per_age = mix(x_0, x_1, part) / age
    lost = (rest * older.range**2 + part * younger.range**2) / 12 * per_age**2
    lost += part * rest * (x_0 - x_1) ** 2
    order = law[ListLaw.ORDER]
    x = max(min(x_0, x_1), MIN_MISFIT_AGE)
    misfit += 0.5 * lost * (1 + abs(order * (order - 1)) / x**2)
    apart = (abs(u_0 - u_1) + abs(half_0 - half_1)) / (high - low)
    return Joint(strip, misfit + 0.5 * apart * sqrt(lost) * (1 + abs(order) / x))
