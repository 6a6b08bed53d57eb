"""Smooth pressure laws of the compliant layer of asperities between rough surfaces.

The pressure P decreases with the separation s of the mean planes and is positive at every s. It is computed by its
logarithm, which neither overflows nor vanishes.
"""

from dataclasses import dataclass

import numpy as np

# Nodes of the trapezoidal rule; its error is below 1e-15 because the integrand is even and analytic
TRAPEZOID_NODES = 0.1 * np.arange(1, 70)


class SmoothAsperities:
    """Base class of pressure laws that are positive and smooth at every separation.

    Each law has `log_pressure` and `separation`.
    """

    __slots__ = ()

    def pressure(self, s: np.ndarray) -> np.ndarray:
        """Return the pressure P (m,) [Pa] at the separations s (m,) [m].

        P is limited to exp(700) Pa, because larger numbers overflow.
        """
        return np.exp(np.minimum(self.log_pressure(np.asarray(s, float))[0], 700.0))

    def stiffness(self, s: np.ndarray) -> np.ndarray:
        """Stiffness -dP/ds (m,) [Pa/m] at the separations s (m,) [m]: P times the decay rate of log P."""
        return self.pressure(s) * self.log_pressure(np.asarray(s, float))[1]


@dataclass(frozen=True, eq=False, slots=True)
class ExponentialAsperities(SmoothAsperities):
    """Exponential law of the asperity layer: P = reference exp(-s/u0) at the separation s [m] of the mean planes.

    u0 [m] > 0 is the decay length, reference [Pa] the pressure at s = 0, which shifts the approach and nothing else. If it
    is the mean pressure, flat aligned pieces have s = 0, and the approach is the closing of the bodies alone.
    """

    u0: float
    reference: float

    def log_pressure(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return log P (m,) and its decay rate (m,) [1/m] at separations s (m,) [m]."""
        return np.log(self.reference) - s / self.u0, np.full(np.shape(s), 1 / self.u0)

    def separation(self, pressure: np.ndarray) -> np.ndarray:
        """Separation s = -u0 log(P/reference) [m] at which the law gives `pressure` [Pa] > 0."""
        return -self.u0 * np.log(pressure / self.reference)


@dataclass(frozen=True, eq=False, slots=True)
class HertzAsperities(SmoothAsperities):
    """Asperity layer whose Hertzian peaks have Gaussian heights (Greenwood and Williamson 1966).

    P = 4/3 E* sqrt(R) eta int_s^inf (z - s)^3/2 phi(z) dz with peaks of mean height 0. The relative error of P is below
    1e-13 at any s. All numbers are above 0:

    - radius: radius R of a peak [m].
    - density: number eta of peaks per area [1/m2].
    - deviation: standard deviation of the peak heights [m].
    - modulus: E* of the pair [Pa], 1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2.
    """

    radius: float
    density: float
    deviation: float
    modulus: float

    @property
    def _log_pressure_factor(self) -> float:
        """Logarithm of the factor [Pa] before the integral over z/deviation."""
        return np.log(4 / 3 * self.modulus * self.density * self.radius**0.5 * self.deviation**1.5)

    def log_pressure(self, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return log P (m,), P in Pa, and its decay rate (m,) [1/m] at s (m,) [m].

        The decay rate is -d(log P)/ds.
        """
        log, decay_rate = peak_integral(np.asarray(s, float) / self.deviation)
        return self._log_pressure_factor + log, decay_rate / self.deviation

    def separation(self, pressure: np.ndarray) -> np.ndarray:
        """Separation s [m] at which the law gives `pressure` [Pa] > 0.

        Newton's method on the concave log P; it starts from the steep side, so it is monotone.
        """
        log_target = np.log(np.asarray(pressure, float)) - self._log_pressure_factor
        h = np.where(
            log_target < 0,
            np.sqrt(np.maximum(0.0, -2 * log_target)),
            -np.exp(np.clip(log_target, 0, 400) / 1.5),
        )
        for _ in range(80):
            log, decay_rate = peak_integral(h)
            h = h + (log - log_target) / decay_rate
            if np.all(np.abs(log - log_target) <= 1e-14 * (1 + np.abs(log_target))):
                break
        return h * self.deviation


def peak_integral(h: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the logarithm of the integral over asperity heights, and its decay rate.

    F(h) = int_h^inf (z - h)^3/2 phi(z) dz with the unit normal density phi. It is computed as F = phi(h) 2 int_0^inf
    v^4 exp(-h v^2 - v^4/2) dv by the trapezoidal rule, and the moment series of (z - h)^3/2 below h = -8, which is
    short of it by exp(-32). Error of log F 2e-14 + 1e-16 h^2, of the decay rate 3e-13.

    Parameters
    ----------
    h : ndarray
        Separation of the mean planes in standard deviations of the asperity heights [1], of any shape.

    Returns
    -------
    log_integral : ndarray
        ln F(h) [1], of the shape of h.
    decay_rate : ndarray
        -d ln F/dh [1] > 0, of the same shape.
    """
    # Trapezoidal rule in v, whose width is scaled so that the integrand decays alike at every h. The decay rate is
    # 3/2 of the ratio of the integrals of (z - h)^1/2 and (z - h)^3/2.
    h = np.asarray(h, float)
    clipped_height = np.maximum(h, -8.0).reshape(-1, 1)
    scale = 1 + np.maximum(clipped_height, 0.0)
    square = TRAPEZOID_NODES**2 / scale
    weight = np.exp(-clipped_height * square - square**2 / 2) * square
    low = weight.sum(axis=1)
    high = (weight * square).sum(axis=1)
    log = -(clipped_height[:, 0] ** 2) / 2 + np.log(0.2 * high / np.sqrt(2 * np.pi * scale[:, 0]))
    log = log.reshape(h.shape)
    decay_rate = (1.5 * low / high).reshape(h.shape)

    # Below h = -8 the series of the moments
    depth = np.where(h < -8, -h, 8.0)
    moment_3_2 = _compute_moment(1.5, depth)
    moment_1_2 = _compute_moment(0.5, depth)
    return np.where(h < -8, 1.5 * np.log(depth) + np.log(moment_3_2), log), np.where(
        h < -8, 1.5 * moment_1_2 / moment_3_2 / depth, decay_rate
    )


def _compute_moment(power: float, distance: np.ndarray) -> np.ndarray:
    """Return the expectation of (1 + z/distance)^power for a standard normal variable z and a large distance [1].

    It is the sum of binom(power, 2k) (2k - 1)!! distance^-2k.
    """
    out = np.zeros_like(distance)
    term = np.ones_like(distance)
    for k in range(0, 24, 2):
        out += term
        term = term * ((power - k) * (power - k - 1) / (k + 2)) / distance**2
    return out
