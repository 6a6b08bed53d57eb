"""Growth of bonds at an elevated surface temperature (eq. 2.13).

The report states a_s = a_0 exp(-T_a/T_s) and l_k = l_0 exp(T_l/T_s). Here both are referred to a temperature T_ref at
which a_s and l_k are known, so that a surface at this temperature changes nothing:

    a_s = a_ref exp(T_a (1/T_ref - 1/T_s)),   l_k = l_ref exp(T_l (1/T_s - 1/T_ref)).

Eq. 2.13 is the limit of an infinite T_ref. Temperatures are absolute, in kelvin. Points of different temperature are a
law whose two rates are arrays (m,).
"""

from typing import NamedTuple

import numpy as np

from ...core import PatchfemError


class GrowthRates(NamedTuple):
    """Growth parameters of bonds in eq. 2.10, as floats or arrays (m,).

    - rest_growth: a_s [m s-2], growth at rest
    - slip_growth: l_k [m], growth by slip
    """

    rest_growth: float | np.ndarray
    slip_growth: float | np.ndarray


def growth_at_temperature(
    rest_growth: float,
    slip_growth: float,
    surface,
    reference: float,
    rest_activation: float | None,
    slip_activation: float | None,
) -> GrowthRates:
    """Convert the growth parameters at a reference temperature to those at a surface temperature.

    Parameters
    ----------
    rest_growth, slip_growth : float
        a_s [m s-2] and l_k [m] at the reference temperature.
    surface : float or (m,) array
        Surface temperature T_s [K].
    reference : float
        Reference temperature T_ref [K].
    rest_activation, slip_activation : float or None
        T_a and T_l [K]; None or 0 for a rate that does not depend on the temperature.

    Returns
    -------
    GrowthRates

    Raises
    ------
    PatchfemError
        If a temperature is not above 0 K, or a rate exceeds the range of floating-point numbers.
    """
    surface = np.asarray(surface, float)
    if not (surface > 0).all() or not np.isfinite(surface).all() or not reference > 0:
        invalid_temperature = float(surface.min()) if reference > 0 else reference
        raise PatchfemError(
            f"a temperature of {invalid_temperature:g} K is not possible; temperatures must be above 0 K"
        )
    difference = 1 / reference - 1 / surface
    rest_exponent = (rest_activation or 0.0) * difference
    slip_exponent = -(slip_activation or 0.0) * difference
    return GrowthRates(
        _scale_rate("rest_growth", rest_growth, rest_exponent, "rest_activation"),
        _scale_rate("slip_growth", slip_growth, slip_exponent, "slip_activation"),
    )


def _scale_rate(name: str, value: float, exponent, key: str):
    """Return a rate times exp(exponent), and refuse a result that a computer cannot represent.

    `value` is the rate at the reference temperature, in SI units. `exponent`, a float or (m,), is the logarithm of the
    change by the temperature. The error message cites the scene keys `name`, of the rate, and `key`, of its activation
    temperature.
    """
    total = np.log(value) + exponent
    limits = np.finfo(float)
    if not ((total < np.log(limits.max)) & (total > np.log(limits.tiny))).all():
        decimal_exponent = float(np.asarray(total).flat[np.argmax(np.abs(total))]) / np.log(10)
        raise PatchfemError(
            f"at the surface temperature {name} would be about 1e{decimal_exponent:.0f}; a computer cannot "
            f"represent such a number; lower temperature.{key}, or bring temperature.surface closer to "
            "temperature.reference"
        )
    # Largest argument at which exp neither overflows nor underflows, for both signs
    if (np.abs(exponent) < 600.0).all():
        rate = value * np.exp(exponent)
    else:
        rate = np.exp(total)
    return float(rate) if np.ndim(rate) == 0 else rate
