"""Strength x^p exp(-x)/p! of bonds over their age x, and its integrals (compiled).

Both are known for x < 0 too, where the strength is -|x|^p exp(-x)/p!: the stretch of a bond over its length takes the place
of x for reading = "stretch". The integral is x |x|^p times a smooth function, of which a table of polynomials is kept.
"""

from typing import NamedTuple

from ...kernel_cache.flags_kernels import NJIT_KERNEL
from ...kernel_cache.jit import njit
from .list_math_kernels import fast_exp, power
from .strip_rows_kernels import N_CELLS_PER_AGE, N_COEFFICIENTS, ListLaw

# Options of functions inside of loops
NJIT_INLINE = NJIT_KERNEL | {"forceinline": True}
MIN_AGE = 1e-300  # smallest age, at which the strength is finite for orders below 0
# Largest relative difference of two ages between which a mean follows from the values at the ends: the errors of this rule
# and of a difference of integrals are then 1e-13
SHORT_STEP = 1e-3


class Decay(NamedTuple):
    """Age x of a bond with its strength and the integral of the strength from 0 to x."""

    age: float
    strength: float
    integral: float


@njit(**NJIT_INLINE)
def find_decay(age, law):
    """Return the `Decay` at an age in bond lengths.

    Parameters
    ----------
    age : float
        Age [bond lengths].
    law : (k,) array
        Entries of `ListLaw`, and the table, whose first entry is the age at which it starts.
    """
    # Beyond the end of the table the strength is 0 to round-off.
    start = law[ListLaw.TABLE]
    n_cells = int(law[ListLaw.N_CELLS])
    place = min(max((age - start) * N_CELLS_PER_AGE, 0.0), float(n_cells))
    cell = min(int(place), n_cells - 1)
    t = 2 * (place - cell) - 1
    square = t * t
    first = ListLaw.TABLE + 1 + N_COEFFICIENTS * cell
    even = law[first + N_COEFFICIENTS - 1]
    odd = 0.0
    for j in range(N_COEFFICIENTS - 3, -1, -2):
        even = law[first + j] + square * even
        odd = law[first + j + 1] + square * odd
    smooth = even + t * odd

    size = min(max(abs(age), MIN_AGE), start + n_cells / N_CELLS_PER_AGE)
    powers = power(size, law[ListLaw.ORDER])
    strength = powers * fast_exp(-age) * law[ListLaw.INVERSE_GAMMA]
    return Decay(age, strength if age >= 0 else -strength, powers * size * smooth)


@njit(**NJIT_INLINE)
def average_integral(a, b, order):
    """Return the mean of the integral of the strength between two ages.

    Parameters
    ----------
    a, b : Decay
        Decays at the ages.
    order : float
        Exponent p.
    """
    step = b.age - a.age
    if abs(step) <= SHORT_STEP * max(abs(a.age), abs(b.age)):
        return 0.5 * (a.integral + b.integral) - step * (b.strength - a.strength) / 12
    change = (b.age - order - 1) * b.integral + b.age * b.strength
    change -= (a.age - order - 1) * a.integral + a.age * a.strength
    return change / step


@njit(**NJIT_INLINE)
def average_strength(first, last):
    """Return the mean of the strength between two ages, given their `Decay`."""
    step = last.age - first.age
    if abs(step) <= SHORT_STEP * max(abs(first.age), abs(last.age)):
        return 0.5 * (first.strength + last.strength)
    return (last.integral - first.integral) / step


@njit(**NJIT_INLINE)
def find_moment(end, order):
    """Return the integral of the strength times the age from 0 to an age, given its `Decay`."""
    return (order + 1) * end.integral - end.age * end.strength
