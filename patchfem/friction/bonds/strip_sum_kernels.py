"""Compiled forces of a strip of bonds (eq. 2.17).

Along a strip, the age x of the bonds in bond lengths and their stretch u are linear. For reading = "report" and for order 0
the force is the integral of the strength times sgn u. With the integral P of the strength it is K (s_2 P_2 - s_1 P_1 -
(s_2 - s_1) P_0): K is weight over change of x, s and P belong to both ends, and P_0 to the bonds without stretch. Its mean
over an increment, along which x changes linearly, is exact. For reading = "stretch" the force is the integral of
|u|^p sgn u exp(-x), which is the same integral over the stretch.
"""

from math import copysign, sqrt
from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_KERNEL
from ...kernel_cache.jit import njit
from .decay_kernels import (
    MIN_AGE,
    NJIT_INLINE,
    Decay,
    average_integral,
    average_strength,
    find_decay,
    find_moment,
)
from .list_math_kernels import fast_exp, power
from .strip_rows_kernels import ListLaw

GAUSS = 1 / sqrt(3)  # position of a Gauss point of a strip, in half widths from its middle
MIN_BOND_RATIO = 1e-9  # smallest length of a bond relative to that of mature ones
# Relative change of x along a strip below which its bonds are taken as equally old: differences of integrals lose digits
MIN_SPREAD = 1e-5
# Largest relative change of this spread along an increment; in a larger one, the bonds are taken as equally old too, because
# weight over spread may have a pole
MAX_SPREAD_CHANGE = 0.5


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


class Ages(NamedTuple):
    """Ages of the first and of the last bonds of a strip in bond lengths."""

    first: float
    last: float


class Ends(NamedTuple):
    """`Decay` of the first and of the last bonds of a strip."""

    first: Decay
    last: Decay


class Stretches(NamedTuple):
    """Stretches [m] of the first and of the last bonds of a strip."""

    first: float
    last: float


class Pull(NamedTuple):
    """Force [N] and stored energy [J] of a strip over mu_s, and the slope of the force at constant bond lengths [N/m]."""

    force: float
    energy: float
    slope: float


class Term(NamedTuple):
    """Term K P of a force [N]: the scale K, and the `Decay` with P.

    For a narrow strip K is the place along the strip, from -1/2 to 1/2, times the weight, and P the strength.
    """

    scale: float
    decay: Decay


@njit(**NJIT_INLINE)
def mix(first, last, fraction):
    """Interpolate linearly between two values.

    Parameters
    ----------
    first, last : float
        Values at the fractions 0 and 1.
    fraction : float
        Fraction at which the result is the value.
    """
    return first + fraction * (last - first)


@njit(**NJIT_KERNEL)
def find_ages(strip, law, moved):
    """Return the `Ages` of the bonds of a strip that have moved.

    Parameters
    ----------
    strip : Strip
        Strip of a list.
    law : (k,) array
        Entries of `ListLaw`.
    moved : Moved
        Motion since the last step.
    """
    if law[ListLaw.IS_STRETCH] > 0:
        return Ages(strip.age_1 + moved.damage, strip.age_2 + moved.damage)

    # Mature bonds have one length; the initial bonds keep eps_0.
    age_1 = strip.age_1 + moved.path
    age_2 = strip.age_2 + moved.path
    length = moved.length if strip.range > 0 else law[ListLaw.LENGTH]
    if strip.short_1 == 0.0 and strip.short_2 == 0.0:
        return Ages(age_1 / length, age_2 / length)

    # x is linear between its values at the Gauss points.
    shortest = MIN_BOND_RATIO * length
    outer = 0.5 * (1 - GAUSS)
    x_1 = mix(age_1, age_2, outer) / max(length - moved.decay * strip.short_1, shortest)
    x_2 = mix(age_2, age_1, outer) / max(length - moved.decay * strip.short_2, shortest)
    beyond = outer / GAUSS
    return Ages(max(mix(x_1, x_2, -beyond), 0.0), max(mix(x_2, x_1, -beyond), 0.0))


@njit(**NJIT_INLINE)
def find_ends(strip, law, moved):
    """Return the `Ends` of the bonds of a strip that have moved.

    Parameters
    ----------
    strip : Strip
        Strip of a list.
    law : (k,) array
        Entries of `ListLaw`.
    moved : Moved
        Motion since the last step.
    """
    ages = find_ages(strip, law, moved)
    return Ends(find_decay(ages.first, law), find_decay(ages.last, law))


@njit(**NJIT_INLINE)
def is_narrow(ends):
    """Return whether the bonds of a strip with given `Ends` are taken as equally old."""
    spread = abs(ends.last.age - ends.first.age)
    return spread <= MIN_SPREAD * max(ends.last.age, ends.first.age)


# ---- bonds that act with the signs of their stretches


@njit(**NJIT_KERNEL)
def pull_signs(ends, weight, stretches, law, rate):
    """Return the `Pull` of a strip whose bonds act with the signs of their stretches.

    Parameters
    ----------
    ends : Ends
        Ends of the strip.
    weight : float
        Weight [N] of the strip.
    stretches : Stretches
        Stretches of its ends.
    law : (k,) array
        Entries of `ListLaw`.
    rate : float
        Change of the ages by the slide [1/m], negative for a slide to -x.
    """
    u_1 = stretches.first
    u_2 = stretches.last
    span = u_2 - u_1
    order = law[ListLaw.ORDER]
    if span == 0:
        return Pull(0.0, 0.0, 0.0)  # a path within round-off has formed no bonds
    sign_1 = copysign(1.0, u_1)
    sign_2 = copysign(1.0, u_2)
    if is_narrow(ends):
        # The strength x^p exp(-x) changes by p/x - 1 of it.
        scale = 0.5 * weight * (ends.first.strength + ends.last.strength) / span
        force = scale * (abs(u_2) - abs(u_1))
        energy = 0.5 * scale * (u_2 * abs(u_2) - u_1 * abs(u_1))
        change = rate * (order / max(ends.last.age, MIN_AGE) - 1)
        return Pull(force, energy, scale * (sign_2 - sign_1) + force * change)

    # The stretch is linear in the age, so that the energy is an integral of the strength and of its moment.
    first = ends.first
    last = ends.last
    scale = weight / (last.age - first.age)
    slope = span / (last.age - first.age)
    offset = u_1 - slope * first.age
    force = sign_2 * last.integral - sign_1 * first.integral
    change = rate * (sign_2 * last.strength - sign_1 * first.strength)
    moment = sign_2 * find_moment(last, order) - sign_1 * find_moment(first, order)
    if sign_1 != sign_2:
        middle = find_decay(max(-offset / slope, 0.0), law)
        force -= (sign_2 - sign_1) * middle.integral
        moment -= (sign_2 - sign_1) * find_moment(middle, order)
        change -= (sign_2 - sign_1) * middle.strength * (rate - 1 / slope)
    return Pull(scale * force, scale * (offset * force + slope * moment), scale * change)


@njit(**NJIT_INLINE)
def average_term(a, b, order, narrow):
    """Return the mean of a term [N] between two instants, between which age and scale are linear.

    Parameters
    ----------
    a, b : Term
        Terms at the instants.
    order : float
        Exponent p.
    narrow : bool
        Whether the strip is narrow.
    """
    if narrow:
        return 0.5 * (a.scale + b.scale) * average_strength(a.decay, b.decay)
    return a.scale * average_integral(a.decay, b.decay, order)


@njit(**NJIT_KERNEL)
def slide_signs(a, b, weight, before, after, law):
    """Return the mean force [N] over mu_s of a strip whose bonds act with the signs of their stretches.

    The ages are linear in the path, and the stretches of the ends keep their signs.

    Parameters
    ----------
    a, b : Ends
        Ends of the strip at the start and at the end of a slide.
    weight : float
        Weight [N] of the strip.
    before, after : Stretches
        Stretches of its ends at these instants.
    law : (k,) array
        Entries of `ListLaw`.
    """
    order = law[ListLaw.ORDER]
    spread = 0.5 * (a.last.age - a.first.age + b.last.age - b.first.age)
    change = abs(b.last.age - b.first.age - spread)
    narrow = change > MAX_SPREAD_CHANGE * abs(spread) or is_narrow(a) or is_narrow(b)
    scale_1 = -0.5 * weight if narrow else weight / spread
    scale_2 = abs(scale_1) if narrow else scale_1
    sign_1 = copysign(1.0, before.first + after.first)
    sign_2 = copysign(1.0, before.last + after.last)
    mean = sign_2 * average_term(Term(scale_2, a.last), Term(scale_2, b.last), order, narrow)
    mean -= sign_1 * average_term(Term(scale_1, a.first), Term(scale_1, b.first), order, narrow)
    if sign_1 == sign_2:
        return mean

    # Between ends of opposite signs one bond has no stretch. The sum over the bonds is split at this bond.
    span = before.last - before.first
    place = min(max(-before.first / span, 0.0), 1.0)
    age = mix(a.first.age, a.last.age, place)
    start = Term(mix(scale_1, scale_2, place), find_decay(age, law))
    place = min(max(-after.first / span, 0.0), 1.0)
    age = mix(b.first.age, b.last.age, place)
    finish = Term(mix(scale_1, scale_2, place), find_decay(age, law))
    return mean - (sign_2 - sign_1) * average_term(start, finish, order, narrow)


# ---- bonds that act with a power of their stretches


@njit(**NJIT_KERNEL)
def pull_powers(ages, weight, stretches, law, rate):
    """Return the `Pull` of a strip of reading = "stretch", whose bonds act with a power of their stretches.

    Parameters
    ----------
    ages : Ages
        Damages of its first and of its last bonds [1].
    weight : float
        Weight [N m^-p] of the strip.
    stretches : Stretches
        Stretches [m] of its ends.
    law : (k,) array
        Entries of `ListLaw`.
    rate : float
        Change of the damages by the slide [1/m], negative for a slide to -x.
    """
    order = law[ListLaw.ORDER]
    u_1 = stretches.first
    u_2 = stretches.last
    if u_1 == u_2:
        return Pull(0.0, 0.0, 0.0)  # a path within round-off has formed no bonds
    spread = ages.last - ages.first
    gradient = spread / (u_2 - u_1)

    # Bonds that are equally damaged, or whose power exceeds the table
    if spread <= MIN_SPREAD or gradient * u_1 < law[ListLaw.TABLE]:
        power_1 = copysign(power(abs(u_1), order), u_1)
        power_2 = copysign(power(abs(u_2), order), u_2)
        scale = weight * law[ListLaw.INVERSE_GAMMA] * fast_exp(-0.5 * (ages.first + ages.last))
        scale /= (u_2 - u_1) * (order + 1)
        force = scale * (power_2 * u_2 - power_1 * u_1)
        energy = scale * (power_2 * u_2 * u_2 - power_1 * u_1 * u_1) / (order + 2)
        return Pull(force, energy, scale * (order + 1) * (power_2 - power_1) - rate * force)

    # The damage is linear in the stretch, so that both are integrals over its gradient times the stretch.
    first = find_decay(gradient * u_1, law)
    last = find_decay(gradient * u_2, law)
    scale = weight / spread * fast_exp(first.age - ages.first) / power(abs(gradient), order)
    change = last.integral - first.integral
    energy = change - (last.age * last.strength - first.age * first.strength) / (order + 1)
    force = scale * change * copysign(1.0, gradient)
    slope = scale * abs(gradient) * (last.strength - first.strength) + (gradient - rate) * force
    return Pull(force, scale * energy / abs(gradient), slope)
