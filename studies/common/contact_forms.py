"""Exact solutions of plane contact problems, from crowns and waves to tilted pads, for tests and studies.

Lengths [m], pressures and moduli [Pa], loads per metre of width [N/m]; compression > 0, x = 0 in the middle. `modulus`
is E* of `combined_modulus`; a rigid partner is one of infinite Young's modulus. Bodies are half planes in plane
strain unless a foundation is named. Signs of the project: a rotation > 0 opens the gap at +x, so a load line at
+x (offset > 0) belongs to a rotation < 0.
"""

from typing import NamedTuple

import numpy as np

from patchfem.closed_forms.contact import find_rounded_angle, require_positive, subtract_sine


class WedgeContact(NamedTuple):
    """Contact of a tilted rigid pad.

    - fraction: fraction of the pad in contact.
    - centre: centre of pressure [m], from the middle.
    - min_pressure, max_pressure: smallest and largest pressure on the part in contact [Pa].
    """

    fraction: float
    centre: float
    min_pressure: float
    max_pressure: float


def combined_modulus(young, poisson, young_lower=None, poisson_lower=None) -> float:
    """Return the modulus E* of two bodies in plane strain.

    1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2.

    Parameters
    ----------
    young, poisson : float
        Young's modulus [Pa] and Poisson's ratio of the upper body.
    young_lower, poisson_lower : float, optional
        Those of the lower body. Default: those of the upper one.

    Returns
    -------
    float
        E* [Pa].

    Raises
    ------
    ValueError
        If a modulus is not positive.
    """
    young_lower = young if young_lower is None else young_lower
    poisson_lower = poisson if poisson_lower is None else poisson_lower
    require_positive(young=young, young_lower=young_lower)
    return 1 / ((1 - poisson**2) / young + (1 - poisson_lower**2) / young_lower)


def hertz_half_width(line_load, radius, modulus):
    """Return the half width of the line contact of a crown (Hertz 1882).

    The gap is x^2/(2 R), and a = sqrt(4 P R/(pi E*)). The bodies are thick compared with a.

    Parameters
    ----------
    line_load : float
        Load P per width [N/m].
    radius : float
        Radius R of the crown [m].
    modulus : float
        Combined modulus E* [Pa] of `combined_modulus`.

    Returns
    -------
    float
        Half width a [m].

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    require_positive(line_load=line_load, radius=radius, modulus=modulus)
    return np.sqrt(4 * line_load * radius / (np.pi * modulus))


def hertz_peak(line_load, radius, modulus):
    """Return the largest pressure of the line contact of a crown (Hertz 1882).

    It is p_0 = 2 P/(pi a).

    Parameters
    ----------
    line_load : float
        Load P per width [N/m].
    radius : float
        Radius R of the crown [m].
    modulus : float
        Combined modulus E* [Pa] of `combined_modulus`.

    Returns
    -------
    float
        Pressure p_0 [Pa].

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    return 2 * line_load / (np.pi * hertz_half_width(line_load, radius, modulus))


def rounded_punch_pressure(x, line_load, flat, radius, modulus):
    """Return the pressure under a flat punch with rounded edges, which is finite everywhere.

    With x = b sin phi: (2 P/(pi b))/(pi - 2 phi_0 - sin 2 phi_0) {(pi - 2 phi_0) cos phi + sin phi
    ln|sin(phi + phi_0)/sin(phi - phi_0)| + sin phi_0 ln|tan((phi + phi_0)/2) tan((phi - phi_0)/2)|}; b and phi_0 are those
    of `rounded_punch_half_width`. The logarithms are regrouped here so that each meets a factor that vanishes with its
    argument.

    Parameters
    ----------
    x : array_like
        Positions [m], from the middle.
    line_load : float
        Load P per width [N/m].
    flat : float
        Half width a_f of the flat part [m].
    radius : float
        Radius R of the rounded edges [m].
    modulus : float
        Combined modulus E* [Pa] of `combined_modulus`.

    Returns
    -------
    ndarray
        Pressure [Pa].

    Raises
    ------
    ValueError
        As in `rounded_punch_half_width`.
    """
    from scipy.special import xlogy

    small = find_rounded_angle(line_load, flat, radius, modulus)
    half = flat / np.cos(small)
    edge = np.pi / 2 - small
    x = np.asarray(x, float)
    phi = np.arcsin(np.clip(x / half, -1, 1))
    sine = np.sin(phi)
    edge_sine = np.cos(small)
    logarithms = (
        xlogy(sine + edge_sine, np.abs(np.sin(phi + edge)))
        + xlogy(edge_sine - sine, np.abs(np.sin(phi - edge)))
        - 2 * edge_sine * np.log(np.cos(phi) + np.sin(small))
    )
    scale = 2 * line_load / (np.pi * half * subtract_sine(2 * small))
    p = scale * (2 * small * np.cos(phi) + logarithms)
    return np.where(np.abs(x) < half, p, 0.0)[()]


def westergaard_full_pressure(wavelength, amplitude, modulus):
    """Return the mean pressure that closes a wavy gap completely (Westergaard 1939).

    The gap is A (1 - cos(2 pi x/lambda)), and p* = pi E* A/lambda.

    Parameters
    ----------
    wavelength : float
        Wavelength lambda [m].
    amplitude : float
        Amplitude A [m], half of valley to peak.
    modulus : float
        Combined modulus E* [Pa] of `combined_modulus`.

    Returns
    -------
    float
        Pressure p* [Pa].

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    require_positive(wavelength=wavelength, amplitude=amplitude, modulus=modulus)
    return np.pi * modulus * amplitude / wavelength


def westergaard_half_width(mean, wavelength, amplitude, modulus):
    """Return the contact half width of each crest of a wavy gap.

    It is (lambda/pi) asin sqrt(p/p*), and lambda/2 from full contact on.

    Parameters
    ----------
    mean : array_like
        Pressure p [Pa] averaged over a wavelength.
    wavelength : float
        Wavelength lambda [m].
    amplitude : float
        Amplitude A [m], half of valley to peak.
    modulus : float
        Combined modulus E* [Pa] of `combined_modulus`.

    Returns
    -------
    ndarray
        Half width [m].

    Raises
    ------
    ValueError
        If the wavelength, the amplitude or the modulus is not positive.
    """
    full = westergaard_full_pressure(wavelength, amplitude, modulus)
    fraction = np.minimum(np.asarray(mean) / full, 1)
    return wavelength / np.pi * np.arcsin(np.sqrt(fraction))


def layered_compliance(k, coating, substrate, thickness):
    """Return the surface displacement of a coated half plane per pressure cos(k x), in plane strain.

    The coating is bonded to the substrate. With q = k h, g = mu_1/mu_2, L = 1 - 4 (1 - nu_1)/(1 + g (3 - 4 nu_2)) and
    K = (g - 1)/(g + 3 - 4 nu_1), it is
    2 (1 - nu_1^2)/(E_1 k) (1 + 4 q K e^-2q - L K e^-4q)/(1 - (L + K + 4 q^2 K) e^-2q + L K e^-4q).
    Two bodies have the sum of their compliances.

    Parameters
    ----------
    k : array_like
        Wave number [1/m].
    coating, substrate : tuple of float
        Young's modulus [Pa] and Poisson's ratio.
    thickness : float
        Thickness h of the coating [m], >= 0.

    Returns
    -------
    ndarray
        Displacement per pressure [m/Pa].

    Raises
    ------
    ValueError
        If k or a modulus is not positive, or if h is negative.
    """
    e1, nu1 = coating
    e2, nu2 = substrate
    require_positive(k=k, coating=e1, substrate=e2)
    if thickness < 0:
        raise ValueError(f"thickness must not be negative, got {thickness}")
    k = np.asarray(k, float)
    modulus_ratio = e1 * (1 + nu2) / (e2 * (1 + nu1))
    l_constant = 1 - 4 * (1 - nu1) / (1 + modulus_ratio * (3 - 4 * nu2))
    k_constant = (modulus_ratio - 1) / (modulus_ratio + 3 - 4 * nu1)
    q = k * thickness
    decay = np.exp(-2 * q)
    product = l_constant * k_constant * decay
    numerator = 1 + (4 * q * k_constant - product) * decay
    denominator = 1 - (l_constant + k_constant + 4 * q**2 * k_constant - product) * decay
    return 2 * (1 - nu1**2) / (e1 * k) * numerator / denominator


def wedge_opening_tilt(load, length, width, stiffness):
    """Return the tilt at which a rigid pad on a linear foundation begins to open.

    It is 2 p/(k_n L) with p = N/(L b).

    Parameters
    ----------
    load : float
        Normal load N [N].
    length : float
        Length L of the pad across the wedge [m].
    width : float
        Width b of the pad along the wedge [m].
    stiffness : float
        Stiffness k_n of the foundation [Pa/m].

    Returns
    -------
    float
        Tilt [rad].

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    require_positive(load=load, length=length, width=width, stiffness=stiffness)
    return 2 * load / (stiffness * length**2 * width)


def wedge_on_linear_foundation(rotation, load, length, width, stiffness) -> WedgeContact:
    """Return the contact of a tilted rigid pad on a linear foundation.

    Above the tilt of `wedge_opening_tilt`, the fraction in contact is sqrt(2 N/(k_n |theta| b))/L = f and the centre of
    pressure lies L/2 - f L/3 from the middle. Below it the pressure is linear over the whole pad, with the centre
    k_n |theta| L^2/(12 p).

    Parameters
    ----------
    rotation : float
        Rotation theta [rad] of either sign; theta > 0 opens +x, so the centre is then < 0.
    load : float
        Normal load N [N].
    length : float
        Length L of the pad across the wedge [m].
    width : float
        Width b of the pad along the wedge [m].
    stiffness : float
        Stiffness k_n of the foundation [Pa/m].

    Returns
    -------
    WedgeContact

    Raises
    ------
    ValueError
        If an argument is not positive.
    """
    tilt = abs(rotation)
    closed_side = -np.sign(rotation)
    opening_tilt = wedge_opening_tilt(load, length, width, stiffness)
    mean = load / (length * width)
    if tilt <= opening_tilt:
        difference = stiffness * tilt * length / 2
        centre = closed_side * difference * length / (6 * mean)
        return WedgeContact(1.0, centre, max(mean - difference, 0.0), mean + difference)
    fraction = np.sqrt(2 * load / (stiffness * tilt * width)) / length
    centre = closed_side * length * (1 / 2 - fraction / 3)
    return WedgeContact(fraction, centre, 0.0, 2 * mean / fraction)


def wedge_on_asperities(rotation, length, decay) -> tuple[np.ndarray, np.ndarray]:
    """Return the contact of a tilted rigid pad on a layer of asperities, p ~ exp(-gap/u_0).

    With B = |theta| L/u_0 the ratio is (1 - e^-B)/B, and the centre lies L (1/2 - 1/B + 1/(e^B - 1)) towards the closed
    edge. Neither depends on the load.

    Parameters
    ----------
    rotation : array_like
        Rotation theta [rad].
    length : float
        Length L of the pad across the wedge [m].
    decay : float
        Decay length u_0 of the asperities [m].

    Returns
    -------
    ratio : ndarray
        Mean pressure / largest pressure.
    centre : ndarray
        Centre of pressure [m].

    Raises
    ------
    ValueError
        If L or u_0 is not positive.
    """
    require_positive(length=length, decay=decay)
    b = np.abs(np.asarray(rotation, float)) * length / decay
    ratio = np.where(b > 0, -np.expm1(-b) / np.where(b > 0, b, 1), 1.0)
    clipped_b = np.maximum(b, 0.05)  # the closed form suffers from cancellation below this value
    closed_form = 1 / 2 - 1 / clipped_b - np.exp(-clipped_b) / np.expm1(-clipped_b)
    series = b / 12 * (1 - b**2 / 60 * (1 - b**2 / 42))
    centre = np.where(b > 0.05, closed_form, series)
    return ratio[()], (-np.sign(rotation) * length * centre)[()]
