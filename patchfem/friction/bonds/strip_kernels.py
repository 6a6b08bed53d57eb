"""Compiled list of strips of bonds (eq. 2.17): mean force over an increment, and the list after it.

An increment adds a strip, or several if bonds grow along it. For a bond length that does not change, forces, means and
energies are exact.
"""

from math import ceil, exp, expm1, log, sqrt
from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_KERNEL
from ...kernel_cache.jit import njit
from .decay_kernels import Decay, average_strength, find_moment
from .list_math_kernels import power
from .point_kernels import grow
from .strip_join_kernels import join_strips, read_strip, write_strip
from .strip_rows_kernels import MAX_NEW_STRIPS, N_STRIP_ENTRIES, ListLaw, ListState, Strip
from .strip_sum_kernels import (
    GAUSS,
    MIN_BOND_RATIO,
    Ends,
    Moved,
    Stretches,
    find_ages,
    find_ends,
    is_narrow,
    mix,
    pull_powers,
    pull_signs,
    slide_signs,
)

MIN_SLIP_PATH = 1e-300  # path [m] below which a point rests
# Largest growth J along a new strip: in more of it nearly all bonds are mature
MAX_STRIP_GROWTH = 0.25
# Largest changes of the age, and of the damage where powers of stretches act, and largest growth, along a part of an
# increment that is integrated by three Gauss points; largest number of these parts
MAX_PART_AGE = 2.0
MAX_PART_DAMAGE = 0.6
MAX_PART_GROWTH = 3.0
MAX_GAUSS_PARTS = 128
OUTER_GAUSS = sqrt(0.6)  # place of the outer points in half lengths of a part
MATURE_CHANGE = 2e-4  # relative change of the length of bonds that is as good as linear in the path
# Parts at the end of an increment that are shorter than this fraction of the others are left out
MIN_LAST_PART = 1e-9
# Increment in bond lengths below which the slope of the mean force is that at this increment
MIN_SLOPE_INCREMENT = 1e-9
# First error of a join, relative to the load, that makes room in a full list, and fraction of its room that is then filled
MIN_FORCED_ERROR = 1e-9
MAX_FILLED_FRACTION = 0.75


class ListForce(NamedTuple):
    """Force of a list over mu_s [N]: mean over the path of an increment and force at its end, with their slopes [N/m].

    The slope of the end is that of a constant bond length.
    """

    mean: float
    end: float
    mean_slope: float
    end_slope: float


class Increment(NamedTuple):
    """Increment of a list with the growth of its bonds.

    - slide: increment [m]
    - before, target: length of mature bonds at its start, and the length to which it relaxes [m]
    - middle: length of mature bonds in the middle of the increment [m]
    - growth: exponent J of the growth along it
    """

    slide: float
    before: float
    target: float
    middle: float
    growth: float


@njit(**NJIT_KERNEL)
def make_increment(state, growth, slide, v_0, v_1, dt):
    """Return the `Increment` of a list by a slide [m].

    Parameters
    ----------
    state : (9,) array
        Entries of `ListState`.
    growth : (5,) array
        Parameters of eq. 2.10.
    slide : float
        Increment [m].
    v_0, v_1, dt : float
        Velocities [m/s] at the ends, and duration [s].
    """
    before = state[ListState.LENGTH]
    path = abs(slide)
    grown = grow(before, v_0, v_1, path, dt, growth)
    middle = grow(before, v_0, 0.5 * (v_0 + v_1), 0.5 * path, 0.5 * dt, growth)
    fraction = -expm1(-grown.exponent)
    target = before + (grown.length - before) / fraction if fraction > 0 else before
    return Increment(slide, before, target, middle.length, grown.exponent)


@njit(**NJIT_KERNEL)
def move(increment, fraction):
    """Return how bonds have `Moved` after a fraction of an increment."""
    path = fraction * abs(increment.slide)
    decay = exp(-fraction * increment.growth) if increment.growth > 0 else 1.0
    length = increment.target + (increment.before - increment.target) * decay
    return Moved(path, path / increment.middle, decay, length)


@njit(**NJIT_KERNEL)
def count_parts(n):
    """Return the number of whole parts into which `find_part_end` divides an increment."""
    return max(ceil(n - MIN_LAST_PART), 1)


@njit(**NJIT_KERNEL)
def find_part_end(i, n):
    """Return the fraction of an increment at which part i ends.

    The last part is shorter if the number n >= 1 of parts is not whole, so that sums over parts are continuous in n.
    """
    return (i + 1) / n if i + 1 < count_parts(n) else 1.0


# ---- bonds that form on an increment


@njit(**NJIT_KERNEL)
def find_new_strips(state, law, increment):
    """Return how many strips form on an increment, 0 or a real number >= 1.

    Parameters
    ----------
    state : (9,) array
        Entries of `ListState`.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Part of a slide.
    """
    if abs(increment.slide) < MIN_SLIP_PATH or state[ListState.LOAD] <= 0:
        return 0.0
    if increment.growth == 0 or law[ListLaw.IS_STRETCH] > 0:
        return 1.0
    return min(max(increment.growth / MAX_STRIP_GROWTH, 1.0), MAX_NEW_STRIPS)


@njit(**NJIT_KERNEL)
def make_new_strip(i, n, state, law, increment):
    """Return a `Strip` that forms on an increment.

    Parameters
    ----------
    i : int
        Number of the strip, from young to old. Young ones, whose bonds still grow, are short.
    n : float
        Number of all new strips.
    state : (9,) array
        Entries of `ListState`.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Increment of the list.
    """
    path = abs(increment.slide)
    low = path * (i / n) ** 2
    high = path * find_part_end(i, n) ** 2
    direction = 1.0 if increment.slide > 0 else -1.0
    weight = state[ListState.LOAD] * (high - low) / law[ListLaw.LENGTH]

    # Damage and power of the stretch need the length at which a bond formed.
    unit = 1.0
    if law[ListLaw.IS_STRETCH] > 0:
        unit = increment.middle
        weight /= power(unit, law[ListLaw.ORDER])
    short_1 = 0.0
    short_2 = 0.0
    if increment.growth > 0 and law[ListLaw.IS_STRETCH] == 0:
        # Bonds start at the length 0 and grow to the same target as mature ones.
        length = move(increment, 1.0).length
        rate = increment.growth / path
        outer = 0.5 * (1 - GAUSS)
        short_1 = length + increment.target * expm1(-mix(low, high, outer) * rate)
        short_2 = length + increment.target * expm1(-mix(high, low, outer) * rate)
    return Strip(
        direction * low,
        direction * high,
        low / unit,
        high / unit,
        (high - low) / unit,
        weight,
        short_1,
        short_2,
    )


@njit(**NJIT_KERNEL)
def pull_new_strips(state, law, increment):
    """Return mean and end of the force [N] over mu_s of the bonds that form on an increment, as a `ListForce`.

    The strength of these bonds is a function of their age. One of the age R acts on the last part 1 - R/path of it.

    Parameters
    ----------
    state : (9,) array
        Entries of `ListState`.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Increment of the list.
    """
    order = law[ListLaw.ORDER]
    moved = move(increment, 1.0)
    still = Moved(0.0, 0.0, 1.0, moved.length)
    path = moved.path
    scale = 1.0 if increment.slide > 0 else -1.0
    if law[ListLaw.IS_STRETCH] > 0:
        path = moved.damage
        scale *= power(increment.middle, order)
    mean = 0.0
    end = 0.0
    slope = 0.0
    n = find_new_strips(state, law, increment)
    for i in range(count_parts(n) if n > 0 else 0):
        strip = make_new_strip(i, n, state, law, increment)
        ends = find_ends(strip, law, still)
        young = ends.first
        old = ends.last
        weight = scale * strip.weight
        slope = state[ListState.LOAD] / law[ListLaw.LENGTH] * old.strength  # of the oldest bonds
        if is_narrow(ends):
            force = weight * average_strength(young, old)
            end += force
            mean += force * (1 - 0.5 * (strip.age_1 + strip.age_2) / path)
            continue

        # R is linear in x.
        spread = old.age - young.age
        per_age = (strip.age_2 - strip.age_1) / spread
        force = weight * (old.integral - young.integral) / spread
        moment = weight * (find_moment(old, order) - find_moment(young, order)) / spread
        end += force
        mean += force - ((strip.age_1 - per_age * young.age) * force + per_age * moment) / path
    return ListForce(mean, end, 0.0, slope)


# ---- bonds that formed before


@njit(**NJIT_KERNEL)
def read_ends(strips, k):
    """Return the `Ends` of the strip of number k before the next increment, from the array `strips` (capacity, 14)."""
    row = strips[k]
    i = N_STRIP_ENTRIES
    return Ends(Decay(row[i], row[i + 1], row[i + 2]), Decay(row[i + 3], row[i + 4], row[i + 5]))


@njit(**NJIT_KERNEL)
def write_ends(strips, k, ends):
    """Write the `Ends` of a strip before the next increment to a list.

    Parameters
    ----------
    strips : (capacity, 14) array
        List, changed in place.
    k : int
        Number of the strip.
    ends : Ends
        Decay of its first and of its last bonds.
    """
    for i in range(3):
        strips[k, N_STRIP_ENTRIES + i] = ends.first[i]
        strips[k, N_STRIP_ENTRIES + 3 + i] = ends.last[i]


@njit(**NJIT_KERNEL)
def slide_strip(strip, law, increment, start, ends):
    """Return the mean force [N] over mu_s of a `Strip` over an increment.

    Parameters
    ----------
    strip : Strip
        Strip at the start of the increment.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Increment of the list.
    start, ends : Ends
        Ends of the strip before and after the increment; not used if its bonds act with powers of their stretches.
    """
    # The force is smooth between the instants at which the stretches of the ends vanish. The ages of mature bonds are
    # linear, so that their mean is exact.
    grown = find_mature_fraction(strip, law, increment)
    first = find_passage(strip.stretch_1, increment.slide)
    last = find_passage(strip.stretch_2, increment.slide)
    mean = 0.0
    low = 0.0
    before = start
    place = 0.0  # fraction of the increment to which `before` belongs
    for high in (min(first, last), max(first, last), 1.0):
        middle = min(max(grown, low), high)
        if middle > low:
            mean += (middle - low) * average_pull(strip, law, increment, low, middle)
        if high > middle:
            if middle > place:
                before = find_ends(strip, law, move(increment, middle))
            after = ends if high == 1.0 else find_ends(strip, law, move(increment, high))
            begin = find_stretches(strip, middle * increment.slide)
            stop = find_stretches(strip, high * increment.slide)
            force = slide_signs(before, after, strip.weight, begin, stop, law)
            mean += (high - middle) * force
            before = after
            place = high
        low = high
    return mean


@njit(**NJIT_KERNEL)
def find_stretches(strip, path):
    """Return the `Stretches` of a strip after a signed path [m]."""
    return Stretches(strip.stretch_1 + path, strip.stretch_2 + path)


@njit(**NJIT_KERNEL)
def find_passage(stretch, slide):
    """Return the fraction of a `slide` [m] at which a `stretch` [m] that increases by it vanishes; 1 if it does not."""
    return 1.0 if stretch * slide >= 0 else min(-stretch / slide, 1.0)


@njit(**NJIT_KERNEL)
def find_mature_fraction(strip, law, increment):
    """Return the fraction of an increment after which the ages of a strip are linear; 1 for powers of stretches.

    Parameters
    ----------
    strip : Strip
        Strip at the start of the increment.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Increment of the list.
    """
    if law[ListLaw.IS_STRETCH] > 0:
        return 1.0 if law[ListLaw.ORDER] != 0 else 0.0
    short = max(strip.short_1, strip.short_2)
    missing = abs(increment.target - increment.before) + short
    length = max(increment.before - short, MIN_BOND_RATIO * increment.before)
    change = missing / length * min(increment.growth, 1.0)
    if change <= MATURE_CHANGE:
        return 0.0
    return min(log(change / MATURE_CHANGE) / max(increment.growth, 1.0), 1.0)


@njit(**NJIT_KERNEL)
def average_pull(strip, law, increment, low, high):
    """Return the mean force [N] over mu_s of a strip between two fractions of an increment, by Gauss quadrature.

    Parameters
    ----------
    strip : Strip
        Strip at the start of the increment.
    law : (k,) array
        Entries of `ListLaw`.
    increment : Increment
        Increment of the list.
    low, high : float
        Fractions, between which the force is smooth.
    """
    before = find_ages(strip, law, move(increment, low))
    after = find_ages(strip, law, move(increment, high))
    change = max(abs(after.first - before.first), abs(after.last - before.last))
    n = change / (MAX_PART_DAMAGE if law[ListLaw.IS_STRETCH] > 0 else MAX_PART_AGE)
    if law[ListLaw.ORDER] < 0:
        youngest = min(min(before.first, before.last), min(after.first, after.last))
        n = max(n, change / max(youngest, MIN_SLIP_PATH))
    if law[ListLaw.IS_STRETCH] == 0:
        n = max(n, increment.growth * (high - low) / MAX_PART_GROWTH)
    n = min(max(n, 1.0), MAX_GAUSS_PARTS)
    mean = 0.0
    begin = 0.0
    for i in range(count_parts(n)):
        end = find_part_end(i, n)
        middle = mix(low, high, 0.5 * (begin + end))
        outer = 0.5 * (end - begin) * (high - low) * OUTER_GAUSS
        force = 8 * pull_strip(strip, law, move(increment, middle), increment.slide).force
        for place in (middle - outer, middle + outer):
            force += 5 * pull_strip(strip, law, move(increment, place), increment.slide).force
        mean += (end - begin) * force / 18
        begin = end
    return mean


@njit(**NJIT_KERNEL)
def pull_strip(strip, law, moved, slide):
    """Return the `Pull` of a strip after its bonds have moved.

    Parameters
    ----------
    strip : Strip
        Strip at the start of the increment.
    law : (k,) array
        Entries of `ListLaw`.
    moved : Moved
        Change of the bonds.
    slide : float
        Value with the sign of the increment.
    """
    stretches = find_stretches(strip, moved.path if slide > 0 else -moved.path)
    rate = find_rate(law, moved, slide)
    if law[ListLaw.IS_STRETCH] * law[ListLaw.ORDER] != 0.0:
        return pull_powers(find_ages(strip, law, moved), strip.weight, stretches, law, rate)
    return pull_signs(find_ends(strip, law, moved), strip.weight, stretches, law, rate)


@njit(**NJIT_KERNEL)
def find_rate(law, moved, slide):
    """Return the change of the ages [bond lengths], or damages, of bonds by the slide [1/m], at a constant bond length.

    Parameters
    ----------
    law : (k,) array
        Entries of `ListLaw`.
    moved : Moved
        Change of the bonds.
    slide : float
        Value with the sign of the increment.
    """
    length = moved.length
    if law[ListLaw.IS_STRETCH] > 0 and moved.path > 0:
        length = moved.path / moved.damage
    return 1 / length if slide > 0 else -1 / length


@njit(**NJIT_KERNEL)
def slide_list(bonds, slide, v_0, v_1, dt):
    """Return the `ListForce` of a list over an increment, without changing the list.

    Parameters
    ----------
    bonds : BondList
        List of a point.
    slide, v_0, v_1, dt : float
        Increment [m], velocities [m/s] at the ends, and duration [s].
    """
    strips = bonds.strips
    state = bonds.state
    law = bonds.law
    # The mean is the integral of the force over the increment, so that its derivative is (end - mean)/increment.
    smallest = MIN_SLOPE_INCREMENT * law[ListLaw.LENGTH]
    probe = slide
    if abs(slide) < smallest:
        probe = smallest if slide >= 0 else -smallest
    increment = make_increment(state, bonds.growth, probe, v_0, v_1, dt)
    last = move(increment, 1.0)
    new = pull_new_strips(state, law, increment)
    mean = new.mean
    end = new.end
    slope = new.end_slope
    rate = find_rate(law, last, probe)
    has_powers = law[ListLaw.IS_STRETCH] * law[ListLaw.ORDER] != 0.0
    ends = find_ends(read_strip(strips, 0), law, last)
    for k in range(int(state[ListState.COUNT])):
        strip = read_strip(strips, k)
        if has_powers:
            pull = pull_strip(strip, law, last, probe)
        else:
            ends = find_ends(strip, law, last)
            pull = pull_signs(ends, strip.weight, find_stretches(strip, probe), law, rate)
        end += pull.force
        slope += pull.slope
        mean += slide_strip(strip, law, increment, read_ends(strips, k), ends)
    # Bonds that grow change the force without a slide too.
    mean_slope = 0.5 * slope if increment.growth > 0 else (end - mean) / probe
    change = slide - probe
    return ListForce(mean + change * mean_slope, end + change * slope, mean_slope, slope)


# ---- the list after an increment


@njit(**NJIT_KERNEL)
def advance_list(bonds, slide, v_0, v_1, dt):
    """Advance a list by an increment: bonds age, old ones are dropped, new ones form and neighbours are joined.

    Parameters
    ----------
    bonds : BondList
        List of a point, changed in place.
    slide : float
        Increment [m].
    v_0, v_1, dt : float
        Velocities [m/s] at the ends, and duration [s].
    """
    strips = bonds.strips
    state = bonds.state
    law = bonds.law
    slide = slide if abs(slide) >= MIN_SLIP_PATH else 0.0
    increment = make_increment(state, bonds.growth, slide, v_0, v_1, dt)
    moved = move(increment, 1.0)
    older = moved.damage if law[ListLaw.IS_STRETCH] > 0 else moved.path
    count = int(state[ListState.COUNT])
    for k in range(count):
        strips[k, 0] += slide
        strips[k, 1] += slide
        strips[k, 2] += older
        strips[k, 3] += older
        strips[k, 6] *= moved.decay
        strips[k, 7] *= moved.decay
    n = find_new_strips(state, law, increment)
    n_new = count_parts(n) if n > 0 else 0
    for i in range(n_new):
        new = make_new_strip(n_new - 1 - i, n, state, law, increment)
        write_strip(strips, count + i, new)
    state[ListState.COUNT] = count + n_new
    state[ListState.LENGTH] = moved.length

    # A list without room joins strips with larger errors.
    error = law[ListLaw.JOIN_ERROR]
    join_strips(strips, state, law, error)
    room = strips.shape[0] - MAX_NEW_STRIPS
    if state[ListState.COUNT] > room:
        error = max(error, MIN_FORCED_ERROR)
        while state[ListState.COUNT] > MAX_FILLED_FRACTION * room:
            error *= 2
            join_strips(strips, state, law, error)
        state[ListState.JOIN_ERROR] = max(state[ListState.JOIN_ERROR], error)
    state[ListState.LARGEST_COUNT] = max(state[ListState.LARGEST_COUNT], state[ListState.COUNT])

    # Force and energy of the present state
    still = Moved(0.0, 0.0, 1.0, moved.length)
    force = 0.0
    energy = 0.0
    has_powers = law[ListLaw.IS_STRETCH] * law[ListLaw.ORDER] != 0.0
    for k in range(int(state[ListState.COUNT])):
        strip = read_strip(strips, k)
        if has_powers:
            pull = pull_strip(strip, law, still, 1.0)
        else:
            ends = find_ends(strip, law, still)
            rate = find_rate(law, still, 1.0)
            pull = pull_signs(ends, strip.weight, find_stretches(strip, 0.0), law, rate)
            write_ends(strips, k, ends)
        force += pull.force
        energy += pull.energy
    state[ListState.FORCE] = force
    state[ListState.ENERGY] = energy
