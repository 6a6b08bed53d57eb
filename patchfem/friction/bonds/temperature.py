"""Growth of bonds on a warm surface (report, 2.13) and how far friction warms it.

a_s = a_0 exp(-T_a/T_s), l_k = l_0 exp(T_l/T_s), stated about a reference at which a_s and l_k are known, so that a
surface at the reference changes nothing:

    a_s = a_ref exp(T_a (1/T_ref - 1/T_s)),   l_k = l_ref exp(T_l (1/T_s - 1/T_ref)).

The print is the limit of an infinite reference. Temperatures are absolute, in kelvin. Points of different temperature
are a law whose two rates are arrays (m,): `recursion.Recursion` then keeps a bond length per point.
"""

from math import pi, sqrt

import numpy as np

from ...core import PatchfemError


def growth_at_temperature(
    rest: float,
    slip: float,
    surface,
    reference: float,
    rest_activation: float | None,
    slip_activation: float | None,
) -> tuple:
    """Return a_s [m s-2] and l_k [m] at a surface temperature from those at a reference.

    surface [K]: a number, or one per point (m,); reference [K]: temperature of the values `rest` and `slip`. An
    activation [K] of None or 0 leaves its rate as it is. PatchfemError for a temperature that is not above 0 K and for
    a rate that leaves the range of floating-point numbers.
    """
    surface = np.asarray(surface, float)
    if not (surface > 0).all() or not np.isfinite(surface).all() or not reference > 0:
        worst = float(surface.min()) if reference > 0 else reference
        raise PatchfemError(
            f"a temperature of {worst:g} K is not possible; temperatures must be above 0 K"
        )
    cold = 1 / reference - 1 / surface
    return (
        _scale_rate("rest_growth", rest, (rest_activation or 0.0) * cold, "rest_activation"),
        _scale_rate("slip_growth", slip, -(slip_activation or 0.0) * cold, "slip_activation"),
    )


def _scale_rate(name: str, value: float, exponent, key: str):
    total = np.log(value) + exponent
    if not ((total < np.log(np.finfo(float).max)) & (total > np.log(np.finfo(float).tiny))).all():
        worst = float(np.asarray(total).flat[np.argmax(np.abs(total))]) / np.log(10)
        raise PatchfemError(
            f"at the surface temperature {name} would be about 1e{worst:.0f}; a computer cannot "
            f"represent such a number; lower temperature.{key}, or bring temperature.surface closer to "
            "temperature.reference"
        )
    out = value * np.exp(exponent) if (np.abs(exponent) < 600).all() else np.exp(total)
    return float(out) if np.ndim(out) == 0 else out


def surface_temperature_rise(
    flux: float, time: float, conductivity: float, capacity: float
) -> float:
    """Return the temperature rise [K] of the surface of a half-space under a constant heat flux.

    It is 2 q sqrt(t/(pi k rho c)) for a flux q [W/m2] from time 0 on. conductivity k [W m-1 K-1], capacity rho c [J m-3
    K-1] (Carslaw and Jaeger, 2.9). One-dimensional: an upper bound for a patch that is small against sqrt(k t/(rho c)).
    """
    return 2 * flux * sqrt(time / (pi * conductivity * capacity))
