"""Exact solutions of plane contact problems, from crowns and punches to tilted pads.

Lengths [m], pressures and moduli [Pa], loads per metre of width [N/m]; compression > 0, x = 0 in the middle. `modulus`
is E* of `combined_modulus`; a rigid partner is one of infinite Young's modulus. Bodies are half planes in plane
strain unless a foundation is named. Signs of the project: a rotation > 0 opens the gap at +x, so a load line at
+x (offset > 0) belongs to a rotation < 0.
"""

import numpy as np


def require_positive(**values) -> None:
    """Raise ValueError for the first number or array of `values` that is not positive."""
    for name, value in values.items():
        if not np.all(np.asarray(value, float) > 0):
            raise ValueError(f"{name} must be positive, got {value}")


def combined_modulus(young, poisson, young_lower=None, poisson_lower=None) -> float:
    """E* [Pa] of two bodies in plane strain, 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2.

    young [Pa], poisson [1] of the upper body; young_lower, poisson_lower of the lower one, alike where left out.
    ValueError unless both moduli are positive.
    """
    young_lower = young if young_lower is None else young_lower
    poisson_lower = poisson if poisson_lower is None else poisson_lower
    require_positive(young=young, young_lower=young_lower)
    return 1 / ((1 - poisson**2) / young + (1 - poisson_lower**2) / young_lower)


def hertz_half_width(line_load, radius, modulus):
    """Half width a [m] of the line contact of a crown (Hertz 1882).

    The gap is x^2/(2 R), and a = sqrt(4 P R/(pi E*)). line_load P [N/m], radius R [m], modulus E* [Pa] of
    `combined_modulus`; bodies thick against a. ValueError unless all are positive.
    """
    require_positive(line_load=line_load, radius=radius, modulus=modulus)
    return np.sqrt(4 * line_load * radius / (np.pi * modulus))


def hertz_peak(line_load, radius, modulus):
    """Largest pressure p_0 = 2 P/(pi a) [Pa] of the line contact of a crown (Hertz 1882).

    The arguments are those of `hertz_half_width`.
    """
    return 2 * line_load / (np.pi * hertz_half_width(line_load, radius, modulus))


def hertz_pressure(x, line_load, radius, modulus):
    """Pressure [Pa] of the line contact of a crown at x [m] from the middle.

    It is p_0 sqrt(1 - x^2/a^2), and 0 outside the contact. The other arguments are those of `hertz_half_width`.
    """
    half = hertz_half_width(line_load, radius, modulus)
    return hertz_peak(line_load, radius, modulus) * np.sqrt(
        np.maximum(1 - (np.asarray(x) / half) ** 2, 0)
    )


# ---- rigid punches


def _check_offset(offset, half) -> None:
    require_positive(half=half)
    if not abs(offset) < half:
        raise ValueError(
            f"the load line at {offset} lies outside the punch of half width {half}: the punch tips over"
        )


def punch_contact(half, offset=0.0) -> tuple:
    """Ends (left, right) [m] of the contact of a flat rigid punch under a load at x = offset [m].

    The whole punch, |x| <= half, touches while |offset| <= half/2; beyond it a length 4 (half - |offset|) does, up to
    the loaded corner. ValueError unless half is positive and |offset| < half.
    """
    _check_offset(offset, half)
    length = min(2 * half, 4 * (half - abs(offset)))
    return (half - length, half) if offset > 0 else (-half, length - half)


def punch_rotation(line_load, half, modulus, offset=0.0) -> float:
    """Rotation [rad] of the flat rigid punch, > 0 opens +x (Johnson 1985, 2.8; Muskhelishvili).

    Full contact: -4 P e/(pi E* b^2); partial: -2 P/(pi E* c) sign(e), c = 2 (b - |e|). line_load P [N/m], half b [m],
    modulus E* [Pa], offset e [m]. ValueError as in `punch_contact` and unless P and E* are positive.
    """
    require_positive(line_load=line_load, modulus=modulus)
    left, right = punch_contact(half, offset)
    if abs(offset) <= half / 2:
        return -4 * line_load * offset / (np.pi * modulus * half**2)
    return -np.sign(offset) * 4 * line_load / (np.pi * modulus * (right - left))


def punch_pressure(x, line_load, half, offset=0.0):
    """Pressure [Pa] at x [m] under a flat rigid punch.

    It does not depend on the modulus and is infinite at the loaded corners.

    Full contact: P/pi (1 + 2 e x/b^2)/sqrt(b^2 - x^2). Partial, over 2 c with xi from its middle towards the corner:
    P/(pi c) sqrt((c + xi)/(c - xi)). 0 outside. Arguments and refusals as in `punch_rotation`.
    """
    require_positive(line_load=line_load)
    left, right = punch_contact(half, offset)
    x = np.asarray(x, float)
    inside = (x >= left) & (x <= right)
    with np.errstate(divide="ignore", invalid="ignore"):
        if abs(offset) <= half / 2:
            p = line_load / np.pi * (1 + 2 * offset * x / half**2) / np.sqrt(half**2 - x**2)
            if abs(offset) == half / 2:  # 0/0 at the corner that begins to lift off
                p = np.where(x == -2 * offset, 0.0, p)
        else:
            near, far = (right - x, x - left) if offset > 0 else (x - left, right - x)
            p = 2 * line_load / (np.pi * (right - left)) * np.sqrt(far / near)
    return np.where(inside, p, 0.0)[()]


def _subtract_sine(x):
    """Compute x - sin x without cancellation."""
    return (
        x**3 / 6 * (1 - x**2 / 20 * (1 - x**2 / 42 * (1 - x**2 / 72))) if x < 0.1 else x - np.sin(x)
    )


def _rounded_angle(line_load, flat, radius, modulus) -> float:
    """pi/2 - phi_0 of the rounded punch, sin phi_0 = flat/(contact half width)."""
    require_positive(line_load=line_load, flat=flat, radius=radius, modulus=modulus)
    want = 2 * line_load * radius / (flat**2 * modulus)
    top = np.pi / 2 - 1e-9
    if want >= _subtract_sine(2 * top) / (2 * np.cos(top) ** 2):
        raise ValueError(
            "under this load the flat part is too short to affect the pressure; use hertz_pressure"
        )
    from scipy.optimize import brentq

    return brentq(
        lambda t: _subtract_sine(2 * t) / (2 * np.cos(t) ** 2) - want,
        0.0,
        top,
        xtol=1e-18,
        rtol=1e-15,
    )


def rounded_punch_half_width(line_load, flat, radius, modulus) -> float:
    """Contact half width b [m] of a flat punch with rounded edges of radius R [m].

    `flat` a_f [m] is the half width of its flat part.

    Gap (|x| - a_f)^2/(2 R) beyond the flat; sin phi_0 = a_f/b and
    2 P R/(a_f^2 E*) = (pi - 2 phi_0)/(2 sin^2 phi_0) - cot phi_0 (Ciavarella, Hills and Monno 1998).
    line_load P [N/m], modulus E* [Pa]. ValueError unless all are positive.
    """
    return float(flat / np.cos(_rounded_angle(line_load, flat, radius, modulus)))


def rounded_punch_pressure(x, line_load, flat, radius, modulus):
    """Pressure [Pa] at x [m] under the punch of `rounded_punch_half_width`, finite everywhere.

    With x = b sin phi: (2 P/(pi b))/(pi - 2 phi_0 - sin 2 phi_0) {(pi - 2 phi_0) cos phi + sin phi
    ln|sin(phi + phi_0)/sin(phi - phi_0)| + sin phi_0 ln|tan((phi + phi_0)/2) tan((phi - phi_0)/2)|}; the logarithms
    are regrouped here so that each meets a factor that vanishes with its argument.
    """
    from scipy.special import xlogy

    small = _rounded_angle(line_load, flat, radius, modulus)
    half, edge = flat / np.cos(small), np.pi / 2 - small
    x = np.asarray(x, float)
    phi = np.arcsin(np.clip(x / half, -1, 1))
    sine, first = np.sin(phi), np.cos(small)
    logs = (
        xlogy(sine + first, np.abs(np.sin(phi + edge)))
        + xlogy(first - sine, np.abs(np.sin(phi - edge)))
        - 2 * first * np.log(np.cos(phi) + np.sin(small))
    )
    p = (
        2
        * line_load
        / (np.pi * half * _subtract_sine(2 * small))
        * (2 * small * np.cos(phi) + logs)
    )
    return np.where(np.abs(x) < half, p, 0.0)[()]


def rounded_corner(intensity, radius, modulus) -> tuple:
    """Extent [m] of the contact on a small rounded edge of radius R [m], and its peak [Pa].

    Away from it the pressure is K/sqrt(r), r from the end of the flat: intensity K [Pa m^0.5]; modulus E* [Pa]. The
    limit of `rounded_punch_half_width` for a long flat: e = (3 sqrt(2) pi K R/E*)^(2/3)/2, peak 1.7995 K/sqrt(e), 0.305
    e beyond the end of the flat. ValueError unless all are positive.
    """
    require_positive(intensity=intensity, radius=radius, modulus=modulus)
    reach = (3 * np.sqrt(2) * np.pi * intensity * radius / modulus) ** (2 / 3) / 2
    return float(reach), float(1.7995 * intensity / np.sqrt(reach))


# ---- waves and layers


def westergaard_full_pressure(wavelength, amplitude, modulus):
    """Mean pressure p* [Pa] that closes a wavy gap completely.

    The gap is A (1 - cos(2 pi x/lambda)), and p* = pi E* A/lambda. wavelength lambda [m], amplitude A [m] (half of
    valley to peak), modulus E* [Pa] (Westergaard 1939). ValueError unless all are positive.
    """
    require_positive(wavelength=wavelength, amplitude=amplitude, modulus=modulus)
    return np.pi * modulus * amplitude / wavelength


def _find_load_fraction(mean, wavelength, amplitude, modulus):
    require_positive(mean=mean)
    return np.asarray(mean, float) / westergaard_full_pressure(wavelength, amplitude, modulus)


def westergaard_half_width(mean, wavelength, amplitude, modulus):
    """Contact half width [m] of each crest of a wavy gap.

    It is (lambda/pi) asin sqrt(p/p*), and lambda/2 from full contact on. mean p [Pa] averaged over a wavelength;
    the rest as in `westergaard_full_pressure`.
    """
    share = _find_load_fraction(mean, wavelength, amplitude, modulus)
    return wavelength / np.pi * np.arcsin(np.sqrt(np.minimum(share, 1)))


def westergaard_pressure(x, mean, wavelength, amplitude, modulus):
    """Pressure [Pa] at x [m] in a wavy gap with crests at whole wavelengths.

    `mean` [Pa] is a number.

    With s = sin(pi a/lambda): 2 p cos(pi x/lambda)/s^2 sqrt(s^2 - sin^2(pi x/lambda)), 0 outside the contact; above
    full contact p + p* cos(2 pi x/lambda). Arguments as in `westergaard_half_width`.
    """
    share = float(_find_load_fraction(mean, wavelength, amplitude, modulus))
    angle = np.pi * np.asarray(x, float) / wavelength
    if share >= 1:
        return mean + mean / share * np.cos(2 * angle)
    return (
        2
        * mean
        / share
        * np.abs(np.cos(angle))
        * np.sqrt(np.maximum(share - np.sin(angle) ** 2, 0))
    )


def westergaard_approach(mean, wavelength, amplitude, modulus):
    """Approach [m] of two wavy bodies: the mean gap that the mean pressure closes.

    It is A f (1 - ln f) with f = p/p*, and A from full contact on. Arguments and errors as in `westergaard_half_width`.
    """
    share = np.minimum(_find_load_fraction(mean, wavelength, amplitude, modulus), 1)
    return amplitude * share * (1 - np.log(share))


def westergaard_stiffness(mean, wavelength, amplitude, modulus):
    """Contact stiffness dp/d(approach) [Pa/m] of two wavy bodies.

    It is pi E*/(lambda ln(p*/p)), and infinite from full contact on. Arguments and errors as in
    `westergaard_half_width`.
    """
    share = np.minimum(_find_load_fraction(mean, wavelength, amplitude, modulus), 1)
    with np.errstate(divide="ignore"):
        return np.pi * modulus / (wavelength * np.log(1 / share))


def layered_compliance(k, coating, substrate, thickness):
    """Surface displacement of a coated half plane per pressure cos(k x) [m/Pa] in plane strain.

    The coating is bonded to the substrate.

    k [1/m] > 0 of any shape; coating, substrate: (Young's modulus [Pa], Poisson's ratio); thickness h [m] >= 0.
    With q = k h, g = mu_1/mu_2, L = 1 - 4 (1 - nu_1)/(1 + g (3 - 4 nu_2)), K = (g - 1)/(g + 3 - 4 nu_1):
    2 (1 - nu_1^2)/(E_1 k) (1 + 4 q K e^-2q - L K e^-4q)/(1 - (L + K + 4 q^2 K) e^-2q + L K e^-4q).
    A pair of bodies has the sum of the two. ValueError unless k and the moduli are positive and h >= 0.
    """
    (e1, nu1), (e2, nu2) = coating, substrate
    require_positive(k=k, coating=e1, substrate=e2)
    if thickness < 0:
        raise ValueError(f"thickness must not be negative, got {thickness}")
    k = np.asarray(k, float)
    g = e1 * (1 + nu2) / (e2 * (1 + nu1))
    far = 1 - 4 * (1 - nu1) / (1 + g * (3 - 4 * nu2))
    near = (g - 1) / (g + 3 - 4 * nu1)
    q = k * thickness
    fade = np.exp(-2 * q)
    layer = 1 + (4 * q * near - far * near * fade) * fade
    return (
        2
        * (1 - nu1**2)
        / (e1 * k)
        * layer
        / (1 - (far + near + 4 * q**2 * near - far * near * fade) * fade)
    )


# ---- shear of a crown


def cattaneo_stick_half_width(shear_load, line_load, radius, modulus, friction):
    """Half width c [m] of the stick zone of a sheared crown (Cattaneo 1938, Mindlin 1949).

    It is a sqrt(1 - |Q|/(mu P)).

    shear_load Q [N/m] of either sign, after the normal load P [N/m]; friction mu; alike bodies. Others as in
    `hertz_half_width`. ValueError where |Q| exceeds mu P.
    """
    require_positive(friction=friction)
    half = hertz_half_width(line_load, radius, modulus)
    share = np.abs(shear_load) / (friction * line_load)
    if np.any(share > 1):
        raise ValueError(
            f"shear_load {shear_load} exceeds friction times the normal load, {friction * line_load}: the "
            "whole contact slides"
        )
    return half * np.sqrt(1 - share)


def cattaneo_shear(x, shear_load, line_load, radius, modulus, friction):
    """Shear traction [Pa] at x [m] of a sheared crown, of the sign of Q.

    It is mu p_0 [sqrt(1 - x^2/a^2) - (c/a) sqrt(1 - x^2/c^2)].

    Arguments as in `cattaneo_stick_half_width`, shear_load a number.
    """
    half = hertz_half_width(line_load, radius, modulus)
    stick = cattaneo_stick_half_width(shear_load, line_load, radius, modulus, friction)
    square = np.asarray(x, float) ** 2
    outer, inner = (np.sqrt(np.maximum(end**2 - square, 0)) / half for end in (half, stick))
    return np.sign(shear_load) * friction * hertz_peak(line_load, radius, modulus) * (outer - inner)


# ---- tilted rigid pads on a foundation


def wedge_opening(load, length, width, stiffness):
    """Tilt 2 p/(k_n L) [rad] at which a rigid pad begins to open; p = N/(L b).

    load N [N], length L across the wedge and width b along it [m], stiffness k_n [Pa/m] of a linear foundation.
    ValueError unless all are positive.
    """
    require_positive(load=load, length=length, width=width, stiffness=stiffness)
    return 2 * load / (stiffness * length**2 * width)


def wedge_linear(rotation, load, length, width, stiffness) -> tuple:
    """Contact of a tilted rigid pad on a linear foundation.

    Returns (fraction in contact, centre of pressure [m], least and largest pressure on the contact [Pa]). rotation
    theta [rad] a number of either sign; theta > 0 opens +x, so the centre is then < 0. Above `wedge_opening` f = sqrt(2
    N/(k_n |theta| b))/L and the centre lies L/2 - f L/3 from the middle. Below it the pressure is linear over the whole
    pad, centre k_n |theta| L^2/(12 p). Arguments as in `wedge_opening`.
    """
    tilt, mean = abs(rotation), load / (length * width)
    if tilt <= wedge_opening(load, length, width, stiffness):
        half = stiffness * tilt * length / 2
        return (
            1.0,
            -np.sign(rotation) * half * length / (6 * mean),
            max(mean - half, 0.0),
            mean + half,
        )
    fraction = np.sqrt(2 * load / (stiffness * tilt * width)) / length
    return fraction, -np.sign(rotation) * length * (1 / 2 - fraction / 3), 0.0, 2 * mean / fraction


def wedge_skin(rotation, length, decay) -> tuple:
    """Contact of a tilted rigid pad on a layer of asperities, p ~ exp(-gap/u_0).

    Returns (mean over largest pressure, centre of pressure [m]). With B = |theta| L/u_0: f = (1 - e^-B)/B, centre L
    (1/2 - 1/B + 1/(e^B - 1)) towards the closed edge. Neither depends on the load. rotation (any shape) [rad], length L
    [m], decay u_0 [m]. ValueError unless L, u_0 > 0.
    """
    require_positive(length=length, decay=decay)
    b = np.abs(np.asarray(rotation, float)) * length / decay
    safe = np.maximum(b, 0.05)
    fraction = np.where(b > 0, -np.expm1(-b) / np.where(b > 0, b, 1), 1.0)
    series = b / 12 * (1 - b**2 / 60 * (1 - b**2 / 42))
    centre = np.where(b > 0.05, 1 / 2 - 1 / safe - np.exp(-safe) / np.expm1(-safe), series)
    return fraction[()], (-np.sign(rotation) * length * centre)[()]


def wedge_loop(amplitude, friction, tangential, area, least, largest):
    """Area [J] of the friction loop of a pad under a linear pressure distribution.

    The pressure falls from `largest` to `least` [Pa].

    amplitude U [m] half peak to peak; friction mu; tangential k_t [Pa/m] of the part in contact, whose area is `area`
    [m2]. Each strip is an elastic-plastic element that slips at u = mu p/k_t, u spread evenly between u_1 and u_2:
    4 k_t A/(u_2 - u_1) times the integral of u (U - u) up to min(U, u_2). For least = 0 this is
    4 mu N (U - 2 u_2/3) above u_2 and 4 k_t A U^3/(6 u_2) below; for least = largest `jenkins_loop`.
    ValueError unless the first four and `largest` are positive and 0 <= least <= largest.
    """
    require_positive(
        amplitude=amplitude, friction=friction, tangential=tangential, area=area, largest=largest
    )
    if not 0 <= least <= largest:
        raise ValueError(f"'least' must lie between 0 and 'largest', got {least} and {largest}")
    amplitude = np.asarray(amplitude, float)
    low, high = friction * least / tangential, friction * largest / tangential
    slip = np.clip(amplitude, low, high)
    share = (slip - low) / (high - low) if high > low else (amplitude >= low).astype(float)
    inner = amplitude * (slip + low) / 2 - (slip**2 + slip * low + low**2) / 3
    return 4 * tangential * area * share * inner


def kern_fraction(offset, length):
    """Contact fraction of a pad on a linear foundation whose load line is off its middle.

    The pad is free to rotate, and `offset` [m] is the distance of the load line. The fraction is 1 up to L/6 (the
    kern), then 3 (1/2 - |e|/L). ValueError unless length is positive and |e| < L/2 throughout.
    """
    require_positive(length=length)
    share = np.abs(np.asarray(offset, float)) / length
    if np.any(share >= 1 / 2):
        raise ValueError(
            f"the load line at {offset} lies outside the pad of length {length}: the pad tips over"
        )
    return np.minimum(1, 3 * (1 / 2 - share))
