"""Exact solutions of plane contact problems at the rounded edges of punches.

Lengths [m], pressures and moduli [Pa], loads per metre of width [N/m]; compression > 0, x = 0 in the middle. `modulus`
is E*, 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2. Bodies are half planes in plane strain.
"""

import numpy as np


def require_positive(**values) -> None:
    """Raise ValueError for the first number or array of `values` that is not positive."""
    for name, value in values.items():
        if not np.all(np.asarray(value, float) > 0):
            raise ValueError(f"{name} must be positive, got {value}")


def subtract_sine(x):
    """Compute x - sin x without cancellation."""
    if x < 0.1:
        return x**3 / 6 * (1 - x**2 / 20 * (1 - x**2 / 42 * (1 - x**2 / 72)))
    return x - np.sin(x)


def find_rounded_angle(line_load, flat, radius, modulus) -> float:
    """Return pi/2 - phi_0 of the rounded punch, with sin phi_0 = flat/(contact half width).

    Parameters
    ----------
    line_load : float
        Load P per width [N/m].
    flat : float
        Half width a_f of the flat part [m].
    radius : float
        Radius R of the rounded edges [m].
    modulus : float
        Combined modulus E* [Pa].

    Raises
    ------
    ValueError
        If an argument is not positive, or if the flat part is too short to affect the pressure.
    """
    require_positive(line_load=line_load, flat=flat, radius=radius, modulus=modulus)
    scaled_load = 2 * line_load * radius / (flat**2 * modulus)
    max_angle = np.pi / 2 - 1e-9
    if scaled_load >= _compute_scaled_load(max_angle):
        raise ValueError(
            "under this load the flat part is too short to affect the pressure; use the solution of Hertz"
        )
    from scipy.optimize import brentq

    return brentq(
        lambda angle: _compute_scaled_load(angle) - scaled_load,
        0.0,
        max_angle,
        xtol=1e-18,
        rtol=1e-15,
    )


def _compute_scaled_load(angle) -> float:
    """Return the load 2 P R/(a_f^2 E*), without unit, at which a rounded punch touches over a given angle of its edges.

    `angle` is pi/2 - phi_0 [rad], with phi_0 of `rounded_punch_half_width`.
    """
    return subtract_sine(2 * angle) / (2 * np.cos(angle) ** 2)


def rounded_punch_half_width(line_load, flat, radius, modulus) -> float:
    """Return the contact half width of a flat punch with rounded edges.

    The gap is (|x| - a_f)^2/(2 R) beyond the flat part. The half width b follows from sin phi_0 = a_f/b and
    2 P R/(a_f^2 E*) = (pi - 2 phi_0)/(2 sin^2 phi_0) - cot phi_0 (Ciavarella, Hills and Monno 1998).

    Parameters
    ----------
    line_load : float
        Load P per width [N/m].
    flat : float
        Half width a_f of the flat part [m].
    radius : float
        Radius R of the rounded edges [m].
    modulus : float
        Combined modulus E* [Pa].

    Returns
    -------
    float
        Half width b [m].

    Raises
    ------
    ValueError
        If an argument is not positive, or if the flat part is too short to affect the pressure.
    """
    return float(flat / np.cos(find_rounded_angle(line_load, flat, radius, modulus)))


def rounded_corner_contact(intensity, radius, modulus) -> tuple[float, float]:
    """Return the extent and the peak of the contact on a small rounded edge.

    Away from the edge the pressure is K/sqrt(r), with r from the end of the flat part. This is the limit of
    `rounded_punch_half_width` for a long flat part: e = (3 sqrt(2) pi K R/E*)^(2/3)/2, and the peak 1.7995 K/sqrt(e) lies
    0.305 e beyond the end of the flat part.

    Parameters
    ----------
    intensity : float
        Intensity K of the singular pressure [Pa m^0.5].
    radius : float
        Radius R of the rounded edges [m].
    modulus : float
        Combined modulus E* [Pa].

    Returns
    -------
    extent : float
        Extent e of the contact on the edge [m].
    peak : float
        Largest pressure [Pa].

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    require_positive(intensity=intensity, radius=radius, modulus=modulus)
    extent = (3 * np.sqrt(2) * np.pi * intensity * radius / modulus) ** (2 / 3) / 2
    return float(extent), float(1.7995 * intensity / np.sqrt(extent))
