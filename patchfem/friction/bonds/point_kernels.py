"""Bonds of one point on a line for friction.reading = "stretch" and p = 1, summed exactly by their moments (compiled).

With k = exp(-int dR/eps) the surviving fraction of a bond, u its stretch and 1/eps frozen when it forms, the sums over all
bonds m = sum sigma k dL/eps [Pa], z = sum sigma k u dL/eps [Pa m] and s2 = sum sigma k u^2 dL/eps [Pa m2] obey, per unit
of path in the direction e = 1 or -1 (eq. 2.17 with p = 1),

    m' = (sigma - m)/eps,   z' = m e - z/eps,   s2' = 2 z e - s2/eps,

which the functions solve exactly over an increment, with x = |increment|/eps and a bond length eps [m] that is constant in
it; sigma [Pa] is the pressure under which new bonds form. The traction is mu_s z/eps_0. Stored energy mu_s s2/(2 eps_0)
and dissipation mu_s s2/(2 eps_0 eps) per path are never negative: passive for every path, pressure and bond length.

Load. Where the load falls at rest, the bonds without stretch, which formed last, are released first: the force stays as
long as a population with the moments (m, z, s2) exists, m >= z^2/s2. Beyond that all stretches shrink, and no point
keeps more than mu_s sigma. Where it rises, unstretched bonds of density m_0 form. Neither adds energy.

All arrays are C-ordered float64.
"""

from math import exp, factorial, log
from typing import NamedTuple

import numpy as np

from ...kernel_cache.flags_kernels import FASTMATH_FLAGS, NJIT_NO_REFCOUNT
from ...kernel_cache.jit import njit
from .point_rows_kernels import GROWTH

# Largest path in bond lengths for which the power series SHAPE_SERIES is used; it is exact to round-off there
MAX_SERIES_PATH = 1.0
# Coefficients of the series of (1 - x + x^2/2 - exp(-x))/x^3 in powers of -x
SHAPE_SERIES = np.array([1 / factorial(k + 3) for k in range(16)])
MAX_GROWTH_EXPONENT = 1e100  # exponent of growth from which the bond length no longer changes
# Largest relative difference of the speeds at the ends of a step for which their mean determines the growth; it avoids
# cancellation
GROWTH_SPEED_TOL = 1e-6


class ShapeFunctions(NamedTuple):
    """Shape functions of a path x in bond lengths.

    - f1, f2: (1 - exp(-x))/x and (1 - f1)/x
    - decay: exp(-x)
    - square: integral of y^2 exp(-y) from 0 to x
    """

    f1: float
    f2: float
    decay: float
    square: float


class MeanStretch(NamedTuple):
    """Mean of the stretch z of a point, weighted by pressure, over an increment.

    - mean: path mean of z [Pa m]
    - slope: its derivative by the increment [Pa]
    """

    mean: float
    slope: float


class BondMoments(NamedTuple):
    """Sums over the bonds of a point: m [Pa], z [Pa m] and s2 [Pa m2]; N replaces Pa where a load replaces the pressure."""

    m: float
    z: float
    s2: float


class GrownLength(NamedTuple):
    """Bond length [m] after a step, whose distance to its target has decayed by exp(-exponent)."""

    length: float
    exponent: float


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def shape_series(x):
    """Return the shape functions of a path x from 0 to `MAX_SERIES_PATH` in bond lengths, without cancellation."""
    # With f3 = (1/2 - f2)/x by Horner's rule, the other functions follow without a division.
    f3 = 0.0
    for k in range(SHAPE_SERIES.size - 1, -1, -1):
        f3 = SHAPE_SERIES[k] - x * f3
    f2 = 0.5 - x * f3
    f1 = 1 - x * f2
    return ShapeFunctions(f1, f2, 1 - x * f1, x * x * x * (f3 * (2 + 2 * x + x * x) - 0.5 * x))


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, **NJIT_NO_REFCOUNT)
def shape_functions(x):
    """Return the shape functions of a path x >= 0 in bond lengths, without cancellation."""
    if x < MAX_SERIES_PATH:
        return shape_series(x)
    decay = exp(-x)
    f1 = (1 - decay) / x
    return ShapeFunctions(f1, (1 - f1) / x, decay, 2 - decay * (x * x + 2 * x + 2))


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def bond_mean(m, z, increment, sigma, eps, shapes):
    """Return the stretch of the bonds of a point, averaged over the path of an increment.

    Parameters
    ----------
    m, z : float
        Sums over the bonds before the increment [Pa], [Pa m].
    increment, sigma, eps : float
        Increment [m], pressure [Pa] under which new bonds form, and bond length [m].
    shapes : ShapeFunctions
        Shape functions of the path |increment|/eps.

    Returns
    -------
    MeanStretch
    """
    x = abs(increment) / eps
    f1 = shapes.f1
    f2 = shapes.f2
    direction = 1.0 if increment > 0 else -1.0
    density_deficit = sigma - m
    mean = z * f1 + increment * (sigma * f2 - density_deficit * (f1 - f2))
    slope = (
        direction * z * (f2 - f1) / eps + sigma * (f1 - f2) - density_deficit * (f2 - x * (f1 - f2))
    )
    return MeanStretch(mean, slope)


@njit(error_model="numpy", fastmath=FASTMATH_FLAGS, forceinline=True, **NJIT_NO_REFCOUNT)
def bond_step(bonds, increment, sigma, eps, shapes):
    """Advance the bonds of a contact point by an increment of displacement.

    Parameters
    ----------
    bonds : (float, float, float)
        Sums m [Pa], z [Pa m] and s2 [Pa m2] over the bonds before the increment.
    increment, sigma, eps : float
        Increment [m], pressure [Pa] under which new bonds form, and bond length [m].
    shapes : ShapeFunctions
        Shape functions of the path |increment|/eps.

    Returns
    -------
    BondMoments
    """
    m, z, s2 = bonds
    decay = shapes.decay
    density_deficit = sigma - m
    stretched = s2 + 2 * z * increment + m * increment * increment
    return BondMoments(
        sigma - density_deficit * decay,
        z * decay + increment * (sigma * shapes.f1 - density_deficit * decay),
        decay * stretched + sigma * eps * eps * shapes.square,
    )


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def grow(eps, v0, v1, path, dt, growth):
    """Return the length of growing bonds after a time step (eq. 2.10 of the 1985 report).

    Parameters
    ----------
    eps : float
        Bond length before [m].
    v0, v1, path, dt : float
        Speeds [m/s] at the ends, path [m] and duration [s] of the step.
    growth : (5,) array
        Parameters a_s, l_k, v_h, eps_0 and eps_k in the order of `GROWTH`.

    Returns
    -------
    GrownLength
    """
    a_s = growth[GROWTH.rest_growth]
    min_speed = growth[GROWTH.rest_speed]
    if a_s < 0:
        return GrownLength(eps, 0.0)

    # Healing is the integral of a_s dt/max(|v|, v_h) at a speed that changes linearly
    if max(abs(v0), abs(v1)) < min_speed:
        healing = a_s * dt / min_speed
    elif abs(v1 - v0) > GROWTH_SPEED_TOL * (abs(v0) + abs(v1)):
        healing = _integrate_slowness(v1, min_speed) - _integrate_slowness(v0, min_speed)
        healing = a_s * dt * healing / (v1 - v0)
    else:
        healing = a_s * dt / max(abs(v0 + v1) / 2, min_speed)
    healing = min(healing, MAX_GROWTH_EXPONENT)
    weakening = min(path / growth[GROWTH.slip_growth], MAX_GROWTH_EXPONENT)
    total = healing + weakening
    if total == 0:
        return GrownLength(eps, 0.0)

    # Healing draws the length towards eps_0 and weakening towards eps_k; it relaxes to their weighted mean
    lengths = healing * growth[GROWTH.rest_length] + weakening * growth[GROWTH.slip_length]
    target = lengths / total
    return GrownLength(target + (eps - target) * exp(-total), total)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def _integrate_slowness(v, min_speed):
    """Return the integral of 1/max(|v|, min_speed) from 0 to v."""
    if abs(v) < min_speed:
        return v / min_speed
    return (1 + log(abs(v) / min_speed)) * (1.0 if v > 0 else -1.0)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def press_point(bonds, s0, s1, initial, length):
    """Change the normal load on the bonds of a contact point at rest; the stored energy never increases.

    m, z and s2 are sums over the bonds: of their loads, and of these times the stretch and times its square.

    Parameters
    ----------
    bonds : (float, float, float)
        m [N], z [N m] and s2 [N m2] under the load s0.
    s0, s1 : float
        Loads before and after [N].
    initial, length : float
        Density m_0 [1] of the bonds that a rising load forms, and bond length eps_0 [m].

    Returns
    -------
    BondMoments
    """
    m, z, s2 = bonds
    if s1 >= s0:
        return BondMoments(m + initial * (s1 - s0), z, s2)

    # m falls in proportion to the load, and z and s2 stay as long as the remaining bonds can carry them.
    remaining = m * s1 / s0
    factor = find_cut(BondMoments(remaining, z, s2), length * s1)
    return BondMoments(remaining, z * factor, s2 * factor)


@njit(error_model="numpy", **NJIT_NO_REFCOUNT)
def find_cut(bonds, bound):
    """Return the factor, at most 1, of z and s2 by which bonds lose stretch as the load of a point falls.

    The bonds that formed last, without stretch, are released first. By the Cauchy-Schwarz inequality no bonds have
    m < z^2/s2. Beyond that z and s2 fall by the same factor, so that z^2/s2 falls to m. The force mu_s z/eps_0 may not
    exceed the limit either.

    Parameters
    ----------
    bonds : BondMoments
        m [N] under the new load, z [N m] and s2 [N m2].
    bound : float
        Largest z, the bond length eps_0 times the new load [N m].
    """
    min_density = bonds.z * bonds.z / bonds.s2 if bonds.s2 > 0 else 0.0
    factor = bonds.m / min_density if min_density > bonds.m else 1.0
    return bound / abs(bonds.z) if factor * abs(bonds.z) > bound else factor
