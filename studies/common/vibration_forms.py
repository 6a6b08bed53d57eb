"""Exact answers for one mode with Coulomb friction: bounds, sliding and two-stop motions, free decay.

Vibration is written for one mode under a base acceleration a sin: r = drive over natural frequency, friction force f
and input a in the same unit (an acceleration, or a force over the same mass), motions as a multiple of a/omega_n^2.
"""

import numpy as np
from scipy.integrate import quad
from scipy.optimize import brentq

from patchfem.closed_forms.contact import require_positive

COULOMB_RESONANCE = np.pi / 4  # least f/a that bounds an undamped mode driven at its own frequency


def decay_rest(start, friction, omega) -> tuple:
    """Return time [s] and place [m] at which a released Coulomb oscillator comes to rest (eq. 3.11).

    ValueError as in `decay`.

    Parameters
    ----------
    start : float
        x_0 [m].
    friction : float
        F/k [m].
    omega : float
        [rad/s]
    """
    require_positive(omega=omega, friction=friction)
    # number of half cycles until rest
    count = max(0, int(np.ceil((abs(start) / friction - 1) / 2)))
    sign = 1.0 if start >= 0 else -1.0
    return np.pi * count / omega, sign * (-1.0) ** count * (abs(start) - 2 * count * friction)


def decay(time, start, friction, omega):
    """Return the displacement [m] of an undamped Coulomb oscillator released at rest (eq. 3.11).

    N_0 is rounded up. ValueError for a negative time, and unless friction and omega are positive.

    Parameters
    ----------
    time : (k,) array
        >= 0 [s].
    start : float
        x_0 [m].
    friction : float
        F/k [m].
    omega : float
        [rad/s]
    """
    time = np.asarray(time, float)
    if np.any(time < 0):
        raise ValueError("time must not be negative")
    stop, place = decay_rest(start, friction, omega)
    count = np.floor(omega * time / np.pi)
    turn = np.where(count % 2 == 0, 1.0, -1.0)
    moving = (abs(start) - (2 * count + 1) * friction) * np.cos(omega * time) + turn * friction
    return np.where(time < stop, (1.0 if start >= 0 else -1.0) * moving, place)


def sliding_amplitude(r, friction, damping=0.0) -> float:
    """Return the amplitude, relative to a/omega_n^2, of a steady motion that slides without a stop (Den Hartog 1931).

    Without damping it is sqrt(V^2 - (U f/a)^2), V = 1/(1 - r^2), U = sin(pi/r)/(r (1 + cos(pi/r))).
    ValueError where no such motion exists (the block stops on the way: below the knee), and without damping at r = 1.

    Between two reversals the motion is f + e^(-xi T)(A cos w T + B sin w T) + particular, T = omega_n t. It is
    antisymmetric over half a drive period, which gives A and B; the amplitude of the particular solution is
    1/|1 - r^2 + 2 i xi r|.

    Parameters
    ----------
    r : float
        Drive / natural frequency > 0.
    friction : float
        f/a >= 0.
    damping : float
        Damping ratio xi, 0 <= xi < 1.
    """
    require_positive(r=r)
    if friction < 0 or not 0 <= damping < 1:
        raise ValueError(
            f"friction must be >= 0 and damping must lie in [0, 1), got friction = {friction} and damping "
            f"= {damping}"
        )
    if damping == 0 and r == 1:
        raise ValueError("without damping no steady sliding motion exists at resonance")
    half = np.pi / r
    w = np.sqrt(1 - damping**2)

    def basis(t):
        e = np.exp(-damping * t)
        c = np.cos(w * t)
        s = np.sin(w * t)
        return e * np.array([c, s]), e * np.array([-damping * c - w * s, -damping * s + w * c])

    (x0, v0), (x1, v1) = basis(0.0), basis(half)
    try:
        free = np.linalg.solve(np.stack([x0 + x1, v0 + v1]), [-2 * friction, 0.0])
    except np.linalg.LinAlgError:
        raise ValueError(
            f"without damping no isolated sliding motion exists at the frequency ratio r = {r}"
        ) from None
    size2 = 1 / ((1 - r * r) ** 2 + (2 * damping * r) ** 2)
    sine = v0 @ free / r
    if size2 < sine**2:
        raise ValueError(
            f"no motion that slides without stops exists at the frequency ratio r = {r} with f/a = "
            f"{friction}"
        )
    cosine = np.sqrt(size2 - sine**2)
    t = half * (np.arange(2000) + 0.5) / 2000
    speed = np.array([basis(at)[1] @ free for at in t]) - r * (
        cosine * np.sin(r * t) + sine * np.cos(r * t)
    )
    if speed.max() > 0:
        raise ValueError(
            f"the block stops during the cycle at the frequency ratio r = {r} with f/a = {friction}"
        )
    return float(friction + x0 @ free + cosine)


def two_stop_relation(slip):
    """Return (f/a, amplitude over a/omega_n^2) of the undamped steady motion with two stops per cycle at resonance.

    slip in (0, pi): drive phase [rad] during which the block slides in each half cycle; release at the phase t_0, tan
    t_0 = s sin s/(sin s - s cos s). f/a runs from 1 (s = 0) to pi/4 (s = pi), the amplitude from 0 to pi/4. ValueError
    for a slip outside (0, pi).
    """
    s = np.asarray(slip, float)
    if np.any(s <= 0) or np.any(s >= np.pi):
        raise ValueError("slip must lie between 0 and pi")
    start = np.arctan2(s * np.sin(s), np.sin(s) - s * np.cos(s))
    ratio = 0.5 * (
        np.sin(start) * (1 + np.cos(s))
        + 0.5 * np.cos(start) * np.sin(s)
        - s / 2 * np.cos(start + s)
    )
    return ratio, ratio - np.sin(start)


def two_stop_amplitude(friction) -> float:
    """Return the amplitude over a/omega_n^2 of the undamped motion at resonance for f/a.

    This is the inverse of `two_stop_relation` within 1e-7.
    """
    if friction >= 1:
        return 0.0
    if friction < COULOMB_RESONANCE:
        return float("inf")
    miss = 1 - friction
    if miss < 1e-4:
        return 2.25 * miss**2 * (1 + 2.9 * miss)
    low = 0.04
    high = np.pi * (1 - 1e-9)
    if two_stop_relation(high)[0] >= friction:
        return float(COULOMB_RESONANCE)
    slip = brentq(
        lambda s: float(two_stop_relation(s)[0]) - friction, low, high, xtol=1e-15, rtol=1e-14
    )
    return float(two_stop_relation(slip)[1])


def shaken_rms(omega: float, zeta: float, level: float, band: tuple) -> tuple:
    """Return the rms of relative displacement [m] and of acceleration [m/s^2] of an oscillator under random base motion.

    With u = f/f_0 both are integrals of 1/((1 - u^2)^2 + (2 zeta u)^2), that of the acceleration with 1 + (2 zeta u)^2
    above it. Source: Crandall and Mark, Random Vibration in Mechanical Systems, ch. 2.

    Parameters
    ----------
    omega : float
        [rad/s]
    zeta : float
        Damping ratio < 1.
    level : float
        One-sided spectral density of the base acceleration [m^2/s^3].
    band : tuple of float
        Lower and upper frequency [Hz], with the natural frequency between them.
    """

    def displacement(ratio):
        return 1 / ((1 - ratio**2) ** 2 + (2 * zeta * ratio) ** 2)

    def acceleration(ratio):
        return displacement(ratio) * (1 + (2 * zeta * ratio) ** 2)

    frequency = omega / (2 * np.pi)
    low, high = (end / frequency for end in band)
    squares = [
        quad(density, low, high, points=[1.0], limit=400, epsabs=0, epsrel=1e-11)[0]
        for density in (displacement, acceleration)
    ]
    rms = np.sqrt(level * frequency * np.array(squares))
    return float(rms[0] / omega**2), float(rms[1])
