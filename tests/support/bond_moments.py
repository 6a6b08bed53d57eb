"""Moments of bonds over an increment in NumPy, for tests of the compiled kernels: eq. 2.17 with p = 1, reading="stretch"."""

from math import factorial
from typing import NamedTuple

import numpy as np

# Largest path in bond lengths for which the shape functions are computed by power series
MAX_SERIES_PATH = 0.03
# Largest path in bond lengths for which the integrals of powers are computed by power series
MAX_POWER_SERIES_PATH = 0.5


class ShapeFunctions(NamedTuple):
    """Shape functions f1 = (1 - exp(-x))/x, f2 = (1 - f1)/x and decay = exp(-x).

    x is a path in bond lengths.
    """

    f1: np.ndarray
    f2: np.ndarray
    decay: np.ndarray


class PowerIntegrals(NamedTuple):
    """Integrals of y exp(-y) and y^2 exp(-y) from 0 to x, and the integral of the second one over x."""

    first: np.ndarray
    second: np.ndarray
    second_integral: np.ndarray


class LineIncrement(NamedTuple):
    """Displacement increment along a line.

    - bonds: bonds (3, m) after it
    - mean, slope: path-mean z (m,) [Pa m] and its derivative over the increment (m,) [Pa]
    - damage_integral: integral of s2 dR/eps (m,) [Pa m2], of which mu_s/(2 eps_0) is dissipated
    """

    bonds: np.ndarray
    mean: np.ndarray
    slope: np.ndarray
    damage_integral: np.ndarray


def shape_functions(x) -> ShapeFunctions:
    """Compute the shape functions at paths x >= 0 (array of any shape) without cancellation."""
    x = np.asarray(x, float)
    is_small = x < MAX_SERIES_PATH
    safe = np.where(is_small, 1.0, x)
    f1 = -np.expm1(-safe) / safe
    f2 = (1 - f1) / safe
    series = 1 / 2 - x * (
        1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))
    )
    f2 = np.where(is_small, series, f2)
    f1 = np.where(is_small, 1 - x * f2, f1)
    return ShapeFunctions(f1, f2, np.exp(-x))


def integrate_powers(x, decay) -> PowerIntegrals:
    """Integrate y exp(-y) and y^2 exp(-y) from 0 to x >= 0, given decay = exp(-x)."""
    series = sum((-1) ** k * x**k / (factorial(k) * (k + 4)) for k in range(13))
    closed = 6 - decay * (x**3 + 3 * x * x + 6 * x + 6)
    cubic = np.where(x < MAX_POWER_SERIES_PATH, x**4 * series, closed)
    second = (cubic + x**3 * decay) / 3
    return PowerIntegrals((second + x * x * decay) / 2, second, x * second - cubic)


def advance_bonds(bonds, increment, sigma, eps) -> LineIncrement:
    """Advance the bonds by an increment along a line.

    Parameters
    ----------
    bonds : (3, m) array
        m, z and s2 before.
    increment, eps : float or (m,) array
        Increment and bond length [m].
    sigma : (m,) array
        Pressure [Pa] under which the new bonds form.

    Returns
    -------
    LineIncrement
    """
    m, z, s2 = bonds
    path = np.abs(increment)
    sign = np.sign(increment)
    x = path / eps
    f1, f2, decay = shape_functions(x)
    zeroth = x * f1
    density_deficit = sigma - m
    with np.errstate(over="ignore", invalid="ignore"):
        powers = integrate_powers(x, decay)
    mean = z * f1 + sign * eps * x * (sigma * f2 - density_deficit * (f1 - f2))
    slope = sign * z * (f2 - f1) / eps + sigma * (f1 - f2) - density_deficit * (f2 - x * (f1 - f2))
    # Without motion, the slope is the mean of those for both directions.
    slope = np.where(path > 0, slope, m / 2)
    after = np.stack(
        [
            sigma - density_deficit * decay,
            z * decay + sign * eps * (sigma * zeroth - density_deficit * x * decay),
            decay * (s2 + 2 * sign * z * path + m * path**2) + sigma * eps**2 * powers.second,
        ]
    )
    damage = s2 * zeroth + 2 * sign * z * eps * powers.first
    damage = damage + m * eps**2 * powers.second + sigma * eps**2 * powers.second_integral
    return LineIncrement(after, mean, slope, damage)
