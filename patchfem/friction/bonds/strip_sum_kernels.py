"""Compiled sums over the strips of a list of bonds (eq. 2.17): strengths, and mean signs and powers of stretches.

A strip has bonds of stretches from u - h to u + h and acts with the force A S. Its strength A is the weight times

- exp(-damage) for reading = "stretch"
- the mean of x^p exp(-x) over the bonds of the strip for reading = "report", with x = path/bond length of each bond

and S is the mean of |u|^s sgn u over its stretches, with s = p for "stretch" and s = 0 for "report".
"""

from math import exp, sqrt
from typing import NamedTuple

from numba import uint64

from ...compiled.flags_kernels import NJIT_KERNEL
from ...compiled.jit import njit
from .list_math_kernels import fast_exp, power, whole_power
from .strip_rows_kernels import ListLaw, Strip

# Options of functions inside of loops that are vectorised
NJIT_INLINE = NJIT_KERNEL | {"forceinline": True}
GAUSS = 1 / sqrt(3)  # position of a Gauss point of a strip, in half widths from its middle
# Slope of a linear distribution per place of its centre: from the middle to the end, per width of the strip
CENTRE_SLOPE = 6.0
# Relative difference of two arguments below which their mean power is that of the larger one
NARROW = 1e-6
MIN_BOND_RATIO = 1e-9  # smallest length of a bond relative to that of mature ones
# Ratio of the stretch to an increment above which Simpson's rule integrates a power of the stretch to round-off, and of an
# increment to the half width of a strip below which it does
FAR_RATIO = 30.0
TINY_RATIO = 1e-4
AGE_ROUND_OFF = 1e-15  # round-off of the age of the youngest bonds of a strip relative to that of the oldest ones
MIN_PATH = 1e-300  # path [m] below which a point rests


class Moved(NamedTuple):
    """Change of bonds along an increment.

    - path: path [m]
    - damage: path over bond length [1], for reading = "stretch"
    - decay: factor of the differences from the mature length
    - length: length of mature bonds [m]
    """

    path: float
    damage: float
    decay: float
    length: float


class EndRows(NamedTuple):
    """Rows of the strengths of strips at the start and at the end of a step."""

    before: int
    after: int


class Strength(NamedTuple):
    """Mean strength of the bonds of a strip, and the place of its centre from the middle, in widths towards old bonds."""

    mean: float
    centre: float


class StretchMeans(NamedTuple):
    """Mean S of |u|^s sgn u over the stretches of a strip, along an increment.

    - end: at its end
    - mean: mean along the increment
    - slant: mean of (t - 1/2) S, with the fraction t of the increment
    - energy: mean of |u|^(s + 1)/(s + 1) over the stretches, at the end
    """

    end: float
    mean: float
    slant: float
    energy: float


class ListForce(NamedTuple):
    """Force of a list over mu_s [N]: mean over the path of an increment, force at its end, and slope of the mean [N/m]."""

    mean: float
    end: float
    slope: float


@njit(**NJIT_KERNEL)
def is_whole_order(order):
    """Return whether an order is 0, 1 or 2, whose powers need no logarithm."""
    return order == 0.0 or order == 1.0 or order == 2.0


@njit(**NJIT_INLINE)
def average_strength(x_0, x_1, order, is_whole):
    """Return the mean of x^p exp(-x) from x_0 to x_1 >= 0.

    One Gauss point for the weight x^p is exact for any order at age 0; the variance of x corrects it to the third order.

    Parameters
    ----------
    x_0, x_1 : float
        Paths of the youngest and of the oldest bonds in bond lengths.
    order : float
        Exponent p.
    is_whole : bool
        Whether p is 0, 1 or 2.

    Returns
    -------
    Strength
    """
    # Moments of x^p; both sides of each choice have a value, so that the loop over strips is vectorised.
    width = x_1 - x_0
    middle = 0.5 * (x_0 + x_1)
    is_wide = abs(width) > NARROW * middle
    last = whole_power(x_1, order) if is_whole else power(x_1, order)
    low = x_0 * (whole_power(x_0, order) if is_whole else power(x_0, order))
    high = last * x_1
    moment_0 = (high - low) * (1 / (order + 1))
    moment_1 = (high * x_1 - low * x_0) * (1 / (order + 2))
    moment_2 = (high * x_1 * x_1 - low * x_0 * x_0) * (1 / (order + 3))
    divisor = width if is_wide else 1.0
    weight = moment_0 if is_wide else 1.0
    per_width = 1.0 / divisor
    per_weight = 1.0 / weight
    mean_power = moment_0 * per_width
    mean_power = mean_power if is_wide else last
    centre = moment_1 * per_weight
    centre = centre if is_wide else middle
    variance = moment_2 * per_weight - centre * centre
    variance = variance if is_wide else 0.0
    mean = mean_power * fast_exp(-centre) * (1 + 0.5 * variance)
    return Strength(mean, (centre - variance - middle) * per_width)


@njit(**NJIT_INLINE)
def find_strength(strips, k, law, moved, is_whole):
    """Return the strength of a strip for reading = "report", without its weight.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    k : int
        Column of the strip.
    law : (9,) array
        Rows of `ListLaw`.
    moved : Moved
        Change of the bonds since the start of the step.
    is_whole : bool
        Whether the order is 0, 1 or 2.

    Returns
    -------
    Strength
    """
    half = strips[Strip.HALF_AGE, k]
    age = strips[Strip.AGE, k] + moved.path

    # Growing bonds have the length of mature ones less what decays; the initial bonds keep the length eps_0.
    shortest = MIN_BOND_RATIO * moved.length
    length_1 = max(moved.length - moved.decay * strips[Strip.SHORT_1, k], shortest)
    length_2 = max(moved.length - moved.decay * strips[Strip.SHORT_2, k], shortest)
    first_length = law[ListLaw.LENGTH]
    length_1 = length_1 if half > 0 else first_length
    length_2 = length_2 if half > 0 else first_length

    # x is linear between its values at the Gauss points.
    x_1 = (age - GAUSS * half) / length_1
    x_2 = (age + GAUSS * half) / length_2
    middle = 0.5 * (x_1 + x_2)
    reach = (0.5 / GAUSS) * (x_2 - x_1)
    old = max(middle + reach, 0.0)
    # Orders near -1 are sensitive to the round-off of an age of 0.
    young = middle - reach
    young = young if young > AGE_ROUND_OFF * old else 0.0
    return average_strength(young, old, law[ListLaw.ORDER], is_whole)


@njit(**NJIT_KERNEL)
def write_strengths(strips, row, first, end, law, moved):
    """Write the strengths [N] of the strips from `first` to `end` - 1 after bonds have `moved` to a row.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point.
    row : int
        Row of `Strip` that receives the strengths.
    first, end : int
        First strip, and last strip + 1.
    law : (9,) array
        Rows of `ListLaw`.
    moved : Moved
        Change of the bonds since the start of the step.
    """
    if law[ListLaw.IS_STRETCH] > 0:
        factor = exp(-moved.damage)
        for k in range(uint64(first), uint64(end)):
            strips[row, k] = factor * strips[Strip.WEIGHT, k]
            strips[row + 1, k] = -strips[Strip.HALF_AGE, k] * strips[Strip.SHORT_1, k]
        return
    if is_whole_order(law[ListLaw.ORDER]):
        for k in range(uint64(first), uint64(end)):
            strength = find_strength(strips, k, law, moved, True)
            strips[row, k] = strips[Strip.WEIGHT, k] * strength.mean
            strips[row + 1, k] = CENTRE_SLOPE * strength.centre
        return
    for k in range(uint64(first), uint64(end)):
        strength = find_strength(strips, k, law, moved, False)
        strips[row, k] = strips[Strip.WEIGHT, k] * strength.mean
        strips[row + 1, k] = CENTRE_SLOPE * strength.centre


@njit(**NJIT_INLINE)
def average_signs(u, step, half_width, slope, end_slope):
    """Return the `StretchMeans` for s = 0, where S is the mean sign of the stretches.

    Parameters
    ----------
    u, step : float
        Mean stretch at the start, and increment [m].
    half_width : float
        Half width [m], negative for bonds of a slide to -x.
    slope, end_slope : float
        Relative change of the strength of the bonds from the middle to the oldest ones, in the middle of the increment and
        at its end.
    """
    half = abs(half_width)
    per_half = 1 / half
    v = u + step
    inner_u = min(max(u, -half), half)
    inner_v = min(max(v, -half), half)
    outer_u = abs(u) - abs(inner_u)
    outer_v = abs(v) - abs(inner_v)
    start = inner_u * per_half
    end = inner_v * per_half

    # S is linear unless the increment passes an end of the strip; otherwise its primitives V and W are used.
    is_linear = ((outer_u > 0) == (outer_v > 0)) & ((outer_u == 0) | (u * v > 0))
    divisor = 1.0 if is_linear else step
    per_step = 1 / divisor
    energy_u = outer_u + 0.5 * (inner_u * start + half)
    energy = outer_v + 0.5 * (inner_v * end + half)
    third_u = inner_u * (inner_u * start / 6 + 0.5 * half) + 0.5 * (u - inner_u) * (abs(u) + half)
    third_v = inner_v * (inner_v * end / 6 + 0.5 * half) + 0.5 * (v - inner_v) * (abs(v) + half)
    mean = (energy - energy_u) * per_step
    slant = (0.5 * (energy + energy_u) - (third_v - third_u) * per_step) * per_step
    linear_mean = 0.5 * (start + end)
    linear_slant = (end - start) / 12
    mean = linear_mean if is_linear else mean
    slant = linear_slant if is_linear else slant

    # A strength with the slope b has the mean sign b (1 - y^2)/2 in addition, y = u/half; older bonds of a slide to +x have
    # the larger stretch.
    direction = half_width * per_half
    bent_u = inner_u - inner_u * start * start / 3
    bent_v = inner_v - inner_v * end * end / 3
    bent = (bent_v - bent_u) * per_step
    linear_bent = 1 - (start * start + start * end + end * end) / 3
    bent = linear_bent if is_linear else bent
    mean += 0.5 * direction * slope * bent
    end += 0.5 * direction * end_slope * (1 - end * end)
    energy += 0.5 * direction * end_slope * bent_v
    return StretchMeans(end, mean, slant, energy)


@njit(**NJIT_KERNEL)
def average_powers(u, step, half, s):
    """Return the `StretchMeans` for an exponent s > 0 by primitives of the power, or by Simpson's rule where it is exact.

    Parameters
    ----------
    u, step, half, s : float
        Mean stretch at the start, increment and half width [m], exponent.
    """
    v = u + step
    divisor = 2 * half * (s + 1)
    start = mid = end = energy_u = energy = third = 0.0
    for side in (1.0, -1.0):
        a = u + side * half
        b = u + 0.5 * step + side * half
        c = v + side * half
        power_a = side * power(abs(a), s) * abs(a) / divisor
        power_b = side * power(abs(b), s) * abs(b) / divisor
        power_c = side * power(abs(c), s) * abs(c) / divisor
        start += power_a
        mid += power_b
        end += power_c
        energy_u += power_a * a / (s + 2)
        energy += power_c * c / (s + 2)
        third += (power_c * c * c - power_a * a * a) / ((s + 2) * (s + 3))

    size = abs(step)
    is_far = u * v > 0 and min(abs(u), abs(v)) > FAR_RATIO * size + half
    if is_far or size <= TINY_RATIO * half:
        return StretchMeans(end, (start + 4 * mid + end) / 6, (end - start) / 12, energy)
    slant = 0.5 * (energy + energy_u) - third / step
    return StretchMeans(end, (energy - energy_u) / step, slant / step, energy)


@njit(**NJIT_KERNEL)
def sum_strips(strips, count, law, rows, shift, step):
    """Return mean and end of the force [N] of strips whose stretches increase by a step, from `shift` [m] on.

    Parameters
    ----------
    strips : (15, capacity) array
        Strips of a point, with their strengths in the middle of the step in row `Strip.MIDDLE`.
    count : int
        Number of strips.
    law : (9,) array
        Rows of `ListLaw`.
    rows : EndRows
        Rows of their strengths at the ends of the step.
    shift, step : float
        Increase of the stretches before the step, and in it [m].

    Returns
    -------
    ListForce
        Its slope is the stored energy [J] at the end.
    """
    before = rows.before
    after = rows.after
    mean = 0.0
    force = 0.0
    energy = 0.0
    s = law[ListLaw.ORDER] * law[ListLaw.IS_STRETCH]
    if s == 0.0:
        for k in range(uint64(0), uint64(count)):
            u = strips[Strip.STRETCH, k] + shift
            slope = strips[Strip.MIDDLE + 1, k]
            end_slope = strips[after + 1, k]
            part = average_signs(u, step, strips[Strip.HALF_WIDTH, k], slope, end_slope)
            low = strips[before, k]
            high = strips[after, k]
            mean += (low + 4 * strips[Strip.MIDDLE, k] + high) / 6 * part.mean
            mean += (high - low) * part.slant
            force += high * part.end
            energy += high * part.energy
        return ListForce(mean, force, energy)
    for k in range(uint64(0), uint64(count)):
        u = strips[Strip.STRETCH, k] + shift
        # The mean stretch is that of the younger bonds, because older ones are weaker.
        half = strips[Strip.HALF_WIDTH, k]
        u += half * strips[after + 1, k] / 3
        part = average_powers(u, step, abs(half), s)
        low = strips[before, k]
        high = strips[after, k]
        mean += (low + 4 * strips[Strip.MIDDLE, k] + high) / 6 * part.mean
        mean += (high - low) * part.slant
        force += high * part.end
        energy += high * part.energy
    return ListForce(mean, force, energy)
