"""Compiled list of strips of bonds (eq. 2.17): mean force over an increment, and the list after it.

Along an increment the strength of a strip is taken as a parabola with a linear variation, and the integrals of its mean sign
or power are exact (`strip_sum_kernels`). For reading = "stretch" the loss of energy is then positive in every step.
"""

from math import ceil, exp, expm1, log1p, sqrt
from typing import NamedTuple

from numba import uint64

from ...compiled.flags_kernels import NJIT_KERNEL
from ...compiled.jit import njit
from .list_math_kernels import fast_exp, fast_log, power
from .point_kernels import grow
from .strip_join_kernels import join_strips
from .strip_rows_kernels import ListLaw, ListState, Strip
from .strip_sum_kernels import (
    CENTRE_SLOPE,
    GAUSS,
    MIN_PATH,
    NJIT_INLINE,
    EndRows,
    ListForce,
    Moved,
    average_powers,
    average_signs,
    average_strength,
    sum_strips,
    write_strengths,
)

# Path in bond lengths over which the length of a part of an increment grows e-fold, and path after which older bonds carry
# nothing
AGE_PER_PART = 6.0
MAX_OLD_PATH = 60.0
# Largest path of the first part of an increment along which strengths are integrated, in bond lengths: this number times
# the root of the width of strips, and where stretches change their sign times its power 2/3; the errors of the strips, of
# Simpson's rule and of a linear strength then fall alike
SMOOTH_PART = 3.0
PART = 1.2
# Largest growth J along a part or a new strip, and largest number of either that it demands: in more of it nearly all bonds
# are mature
MAX_PART_GROWTH = 1.5
MAX_STRIP_GROWTH = 0.25
MAX_GROWTH_PARTS = 16
# Largest force of the strips whose stretches change their sign in the longer parts, relative to the load
MAX_SMOOTH_FORCE = 1e-3
# Parts at least, and the exponent of their ends, for orders whose strength is not smooth at age 0
MIN_STEEP_PARTS = 8
# Increment in bond lengths below which the slope of the mean force is that at this increment
MIN_SLOPE_INCREMENT = 1e-9
MIN_FORCED_WIDTH = 1e-6  # half the first width [bond lengths] that makes room in a full list


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
        Rows of `ListState`.
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
    decay = exp(-fraction * increment.growth)
    length = increment.target + (increment.before - increment.target) * decay
    return Moved(path, path / increment.middle, decay, length)


@njit(**NJIT_INLINE)
def find_end(fraction, covered, scale, reach, order):
    """Return the age [m] at which a fraction of the new strips ends, from young to old.

    Parameters
    ----------
    fraction : float
        Fraction of the number of strips, 0 to 1.
    covered : float
        1 - exp(-reach/scale).
    scale, reach : float
        Age over which widths grow e-fold, and age of the oldest new bonds [m].
    order : float
        Exponent p; below 0 young strips are narrower.
    """
    age = -scale * fast_log(1 - fraction * covered)
    narrow = age * fraction
    return min(narrow if order < 0 else age, reach)


@njit(**NJIT_INLINE)
def find_growth(exponent):
    """Return 1 - exp(-exponent) to 1e-13."""
    series = exponent * (1 - exponent * (1 / 2 - exponent * (1 / 6 - exponent / 24)))
    whole = 1 - fast_exp(-exponent)
    return series if exponent < 1e-3 else whole


@njit(**NJIT_KERNEL)
def write_new_strips(strips, state, law, increment):
    """Write the strips that form on an increment to the columns after the last strip; return their number.

    Their widths are those of the merged list at the age at which it will have them.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    state : (9,) array
        Rows of `ListState`.
    law : (9,) array
        Rows of `ListLaw`.
    increment : Increment
        Increment of the list.
    """
    path = abs(increment.slide)
    load = state[ListState.LOAD]
    if path < MIN_PATH or load <= 0:
        return 0
    first = int(state[ListState.COUNT])
    moved = move(increment, 1.0)

    # exp(-R/age_per_width) falls by the same step from each strip to the next; growth limits their width too.
    unit = min(increment.middle, law[ListLaw.LENGTH])
    reach = min(path, law[ListLaw.CUTOFF])
    age_per_width = law[ListLaw.AGE_PER_WIDTH]
    age_scale = age_per_width * unit
    covered = -expm1(-reach / age_scale)
    count = age_per_width / law[ListLaw.WIDTH] * covered
    if law[ListLaw.IS_STRETCH] == 0:
        count = max(count, min(increment.growth / MAX_STRIP_GROWTH, MAX_GROWTH_PARTS))
    n = int(max(ceil(count), 1.0))
    if law[ListLaw.ORDER] < 0:
        n = max(n, MIN_STEEP_PARTS)
    order = law[ListLaw.ORDER]
    scale = load * law[ListLaw.INVERSE_GAMMA] / law[ListLaw.LENGTH]

    # Young strips are at the end. All strips are independent, so that the loop is vectorised.
    is_stretch = law[ListLaw.IS_STRETCH] > 0
    direction = 1.0 if increment.slide > 0 else -1.0
    per_middle = 1 / increment.middle
    if is_stretch:
        scale /= power(increment.middle, order)
    grows = increment.growth > 0 and not is_stretch
    target = increment.target if grows else 0.0
    mature = moved.length if grows else 0.0
    rate = increment.growth / path
    offset = law[ListLaw.IS_STRETCH] * per_middle
    for k in range(uint64(first), uint64(first + n)):
        j = n - 1.0 - (k - first)
        low = find_end(j / n, covered, age_scale, reach, order)
        high = find_end((j + 1) / n, covered, age_scale, reach, order)
        half = 0.5 * (high - low)
        age = low + half
        strips[Strip.STRETCH, k] = direction * age
        strips[Strip.HALF_WIDTH, k] = direction * half
        strips[Strip.AGE, k] = age
        strips[Strip.HALF_AGE, k] = half
        weight = 2 * half * scale
        damaged = (
            scale * increment.middle * (fast_exp(-low * per_middle) - fast_exp(-high * per_middle))
        )
        strips[Strip.WEIGHT, k] = damaged if is_stretch else weight

        # Bonds start at the length 0, and those of constant length are mature.
        grown_1 = target * find_growth((age - GAUSS * half) * rate)
        grown_2 = target * find_growth((age + GAUSS * half) * rate)
        strips[Strip.SHORT_1, k] = offset + (mature - grown_1)
        strips[Strip.SHORT_2, k] = offset + (mature - grown_2)
    write_strengths(
        strips, Strip.STRENGTH, first, first + n, law, Moved(0.0, 0.0, 1.0, moved.length)
    )
    return n


@njit(**NJIT_KERNEL)
def add_new_force(strips, state, law, increment, force):
    """Return a `ListForce` with the mean and the end of that of the bonds that form on the increment.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    state : (9,) array
        Rows of `ListState`.
    law : (9,) array
        Rows of `ListLaw`.
    increment : Increment
        Increment of the list.
    force : ListForce
        Force of the older bonds.
    """
    first = int(state[ListState.COUNT])
    end = first + write_new_strips(strips, state, law, increment)
    path = abs(increment.slide)
    direction = 1.0 if increment.slide > 0 else -1.0
    mean = 0.0

    # For "report" bonds act from their formation on, for the part 1 - R/path of the increment.
    if law[ListLaw.IS_STRETCH] == 0:
        total = 0.0
        mean_age = 0.0
        for k in range(uint64(first), uint64(end)):
            centre = strips[Strip.STRENGTH + 1, k] * (2 / CENTRE_SLOPE)
            strength = strips[Strip.STRENGTH, k]
            total += strength
            mean_age += strength * (strips[Strip.AGE, k] + centre * strips[Strip.HALF_AGE, k])
        mean = direction * (total - mean_age / max(path, MIN_PATH))
        return ListForce(force.mean + mean, force.end + direction * total, 0.0)

    # For "stretch" the work of a bond is its energy and what damage has dissipated since it formed, the integral of
    # exp(-y) y^(p + 1)/(p + 1) over its path y in bond lengths; `loss` is this integral up to the age of a strip.
    order = law[ListLaw.ORDER]
    scale = state[ListState.LOAD] * law[ListLaw.INVERSE_GAMMA] / law[ListLaw.LENGTH]
    scale *= increment.middle / (order + 1)
    loss = 0.0
    total = 0.0
    x = 0.0
    for k in range(end - 1, first - 1, -1):
        half = strips[Strip.HALF_AGE, k]
        slope = strips[Strip.STRENGTH + 1, k]
        u = strips[Strip.STRETCH, k]
        after = average_powers(u + direction * half * slope / 3, 0.0, half, order)
        if order == 0.0:
            after = average_signs(u, 0.0, direction * half, slope, slope)
        high = x + half / increment.middle
        loss += average_strength(x, high, order + 1, False).mean * (high - x)
        mean += strips[Strip.STRENGTH, k] * after.energy + scale * 2 * half * loss
        x = high + half / increment.middle
        loss += average_strength(high, x, order + 1, False).mean * (x - high)
        total += strips[Strip.STRENGTH, k] * after.end
    # Bonds beyond the cut-off have dissipated all their work.
    mean += scale * (path - x * increment.middle) * loss
    mean = direction * mean / max(path, MIN_PATH)
    return ListForce(force.mean + mean, force.end + total, 0.0)


@njit(**NJIT_KERNEL)
def sum_passed(strips, count, slide):
    """Return the sum of the strengths [N] of the strips that have bonds whose stretch is against a slide.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    count : int
        Number of strips.
    slide : float
        Increment [m].
    """
    direction = 1.0 if slide > 0 else -1.0
    total = 0.0
    for k in range(uint64(0), uint64(count)):
        low = direction * strips[Strip.STRETCH, k] - abs(strips[Strip.HALF_WIDTH, k])
        strength = strips[Strip.STRENGTH, k]
        total += strength if low < 0 else 0.0
    return total


@njit(**NJIT_KERNEL)
def follow_increment(strips, state, law, increment):
    """Return mean and end of the force of a list over an increment, as a `ListForce`.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    state : (9,) array
        Rows of `ListState`.
    law : (9,) array
        Rows of `ListLaw`.
    increment : Increment
        Increment of the list.
    """
    count = int(state[ListState.COUNT])
    path = abs(increment.slide) / increment.middle

    # Parts of the increment. They grow with the path, along which the bonds decay; a force of the fractional power of the
    # path needs short ones at its start.
    order = law[ListLaw.ORDER]
    is_steep = law[ListLaw.IS_STRETCH] == 0 and order < 1 and order != 0
    width = law[ListLaw.WIDTH]
    part = SMOOTH_PART * sqrt(width)
    if sum_passed(strips, count, increment.slide) > MAX_SMOOTH_FORCE * state[ListState.LOAD]:
        part = PART * width ** (2 / 3)
    reach = min(path, MAX_OLD_PATH)
    size = reach / AGE_PER_PART
    covered = -expm1(-size)
    n_parts = AGE_PER_PART / part * covered
    if law[ListLaw.IS_STRETCH] == 0:
        n_parts = max(n_parts, min(increment.growth / MAX_PART_GROWTH, MAX_GROWTH_PARTS))
    n = int(max(ceil(n_parts), 1.0))
    n = max(n, MIN_STEEP_PARTS) if is_steep else n

    before = int(Strip.STRENGTH)
    low = 0.0
    mean = 0.0
    end = 0.0
    for i in range(1, n + 1):
        fraction = -log1p(-i / n * covered) / size if i < n else 1.0
        fraction *= (i / n) ** 3 if is_steep else 1.0
        high = fraction * reach / path if reach < path else fraction
        after = int(Strip.FIRST if i % 2 else Strip.SECOND)
        write_strengths(strips, Strip.MIDDLE, 0, count, law, move(increment, 0.5 * (low + high)))
        write_strengths(strips, after, 0, count, law, move(increment, high))
        if law[ListLaw.IS_STRETCH] == 0 and count > 0 and strips[Strip.HALF_AGE, 0] == 0:
            # The mean strength of the initial bonds, which formed at once, is known; it may be infinite at the start.
            unit = law[ListLaw.LENGTH]
            x = strips[Strip.AGE, 0] / unit
            mean_path = abs(increment.slide) / unit
            exact = average_strength(x + low * mean_path, x + high * mean_path, order, False).mean
            exact *= strips[Strip.WEIGHT, 0]
            ends = strips[before, 0] + strips[after, 0]
            strips[Strip.MIDDLE, 0] = 1.5 * exact - 0.25 * ends
        shift = low * increment.slide
        step = (high - low) * increment.slide
        force = sum_strips(strips, count, law, EndRows(before, after), shift, step)
        mean += (high - low) * force.mean
        end = force.end
        before = after
        low = high
    return add_new_force(strips, state, law, increment, ListForce(mean, end, 0.0))


@njit(**NJIT_KERNEL)
def slide_list(bonds, slide, velocity, dt):
    """Return the force of a list over an increment, which changes only its workspace.

    Parameters
    ----------
    bonds : BondList
        List of a point.
    slide, velocity, dt : float
        Increment [m], velocity [m/s] that determines the growth, and duration [s].

    Returns
    -------
    ListForce
    """
    strips = bonds.strips
    state = bonds.state
    law = bonds.law
    growth = bonds.growth
    # The mean is the integral of the force over the increment, so that its derivative is (end - mean)/increment.
    smallest = MIN_SLOPE_INCREMENT * law[ListLaw.LENGTH]
    probe = slide
    if abs(slide) < smallest:
        probe = smallest if slide >= 0 else -smallest
    increment = make_increment(state, growth, probe, velocity, velocity, dt)
    force = follow_increment(strips, state, law, increment)
    slope = (force.end - force.mean) / probe
    change = slide - probe
    return ListForce(force.mean + change * slope, force.end + 2 * change * slope, slope)


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
    growth = bonds.growth
    slide = slide if abs(slide) >= MIN_PATH else 0.0
    increment = make_increment(state, growth, slide, v_0, v_1, dt)
    moved = move(increment, 1.0)
    count = int(state[ListState.COUNT])
    n_new = write_new_strips(strips, state, law, increment)
    is_stretch = law[ListLaw.IS_STRETCH] > 0
    factor = exp(-moved.damage) if is_stretch else 1.0
    decay = 1.0 if is_stretch else moved.decay
    for k in range(count):
        strips[Strip.STRETCH, k] += slide
        strips[Strip.AGE, k] += moved.path
        strips[Strip.WEIGHT, k] *= factor
        strips[Strip.SHORT_1, k] *= decay
        strips[Strip.SHORT_2, k] *= decay
    state[ListState.LENGTH] = moved.length

    # A list without room is joined to wider strips.
    state[ListState.COUNT] = count + n_new
    width = law[ListLaw.WIDTH] if law[ListLaw.MERGES] > 0 else 0.0
    join_strips(strips, state, law, width, False)
    width = MIN_FORCED_WIDTH
    while state[ListState.COUNT] > strips.shape[1] - law[ListLaw.MAX_NEW]:
        width *= 2
        state[ListState.WIDTH] = max(state[ListState.WIDTH], width)
        join_strips(strips, state, law, width, True)
    state[ListState.LARGEST_COUNT] = max(state[ListState.LARGEST_COUNT], state[ListState.COUNT])
    read_list(strips, state, law)


@njit(**NJIT_KERNEL)
def read_list(strips, state, law):
    """Write strengths, force and energy of the present state of a list.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    state : (9,) array
        Rows of `ListState`.
    law : (9,) array
        Rows of `ListLaw`.
    """
    count = int(state[ListState.COUNT])
    still = Moved(0.0, 0.0, 1.0, state[ListState.LENGTH])
    write_strengths(strips, Strip.STRENGTH, 0, count, law, still)
    write_strengths(strips, Strip.MIDDLE, 0, count, law, still)
    row = int(Strip.STRENGTH)
    present = sum_strips(strips, count, law, EndRows(row, row), 0.0, 0.0)
    state[ListState.FORCE] = present.end
    state[ListState.ENERGY] = present.slope
