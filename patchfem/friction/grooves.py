"""Matched grooves, whose flanks the load climbs.

The height is z = A (1 - cos(k q - phase)), the slope t = dz/dq = A k sin(k q - phase).

Let R be the force normal to the flank and f the friction along it, against the slide. On a flank of angle a, t = tan a,
the force against the slide and the vertical one are

    F = R sin a + f cos a,    V = R cos a - f sin a,    so  F/V = (t + phi)/(1 - phi t)  with  phi = f/R.

The vertical force carries the load N and what rises with the height, V = N + m (t q'' + t' q'^2), t' = dt/dq. Hence
F = V t + f sqrt(1 + t^2): the work F dq is V dz, which is stored in the height of the load and the speed of what
rises, and f ds, which is friction's own along the flank ds = sqrt(1 + t^2) dq. Coulomb's law holds f between -mu R and
mu R, so F lies between V (t - mu)/(1 + mu t) and V (t + mu)/(1 - mu t) at rest and is one of them in motion. A flank
with mu t >= 1 locks: no force moves the load over it.
"""

from dataclasses import dataclass, replace
from math import pi

import numpy as np

MAX_SERIES_SLOPE = 0.1  # mu t below which the friction work is a series, because the closed form suffers from cancellation
N_SERIES_TERMS = 18  # number of terms of this series; 0.1^18 is round-off


@dataclass(frozen=True, slots=True)
class Grooves:
    """Sinusoidal grooves that match those of the other piece.

    - wavelength, amplitude [m]: the amplitude is half the height from bottom to crest
    - phase [rad]: the bottom is at the relative displacement q = phase/k
    - lifted_mass [kg]: mass that rises with the load
    - key: key of the table of the grooves in the scene
    """

    wavelength: float
    amplitude: float
    phase: float = 0.0
    lifted_mass: float = 0.0
    key: str = "normal.grooves"

    @property
    def wave_number(self) -> float:
        """Wave number k = 2 pi/wavelength [rad/m]."""
        return 2 * pi / self.wavelength

    @property
    def max_slope(self) -> float:
        """Largest slope A k of the flanks [1]."""
        return self.amplitude * self.wave_number

    def after_wear(self, depth: float, upper_share: float) -> "Grooves | None":
        """Return the grooves after a mean worn depth [m] of both pieces; None once they are flat.

        The upper piece lost the fraction `upper_share` of this depth.

        Assumed: both pieces carry the grooves; what is worn off a piece comes from above its valleys in proportion to
        the height there, so it keeps a cosine of the same valleys. Above them a piece has the volume A per area, so one
        that lost the mean depth h has the amplitude A - h; the climb is that of the shallower piece, whose crests are
        all that stands in the way.
        """
        left = self.amplitude - max(upper_share, 1 - upper_share) * depth
        return replace(self, amplitude=left) if left > 0 else None

    def height(self, q):
        """Return the height z = A (1 - cos(k q - phase)) [m] at relative displacements q [m]."""
        return (
            2
            * self.amplitude
            * np.sin(0.5 * (self.wave_number * np.asarray(q, float) - self.phase)) ** 2
        )

    def slope(self, q):
        """Return the slope t = A k sin(k q - phase) [1] at relative displacements q [m]."""
        return self.max_slope * np.sin(self.wave_number * np.asarray(q, float) - self.phase)

    def slope_derivative(self, q):
        """Return the derivative t' = A k^2 cos(k q - phase) [1/m] of the slope at q [m]."""
        return (
            self.max_slope
            * self.wave_number
            * np.cos(self.wave_number * np.asarray(q, float) - self.phase)
        )

    def force_ratio(self, q, way, friction: float):
        """Return tangential / vertical force (t + way mu)/(1 - way mu t) [1] at q [m].

        way: sign of the motion, 0 for a slide held by the flank alone; friction: coefficient mu [1].
        """
        t, part = self.slope(q), np.asarray(way) * friction
        return (t + part) / (1 - part * t)

    def stiffness(self, load: float) -> float:
        """Return the stiffness N k^2 A [N/m] of small motions about the bottom under a load [N]."""
        return load * self.wave_number**2 * self.amplitude

    def max_force(self, load: float, friction: float) -> float:
        """Return the largest force [N] that the steepest flank holds under a load N [N].

        It is N (A k + mu)/(1 - mu A k), or infinite if the flank locks.
        """
        locks = friction * self.max_slope >= 1
        return (
            float("inf")
            if locks
            else load * (self.max_slope + friction) / (1 - friction * self.max_slope)
        )

    def height_difference(self, q0, q1):
        """Return the height difference [m] between q0 and q1 [m] without cancellation."""
        half, middle = (
            0.5 * self.wave_number * (q1 - q0),
            0.5 * self.wave_number * (q1 + q0) - self.phase,
        )
        return 2 * self.amplitude * np.sin(middle) * np.sin(half)

    def friction_loss(self, q0, q1, friction: float):
        """Return the energy / vertical force [J/N] that friction dissipates from q0 to q1 [m].

        It is the integral of mu (1 + t^2)/(1 - way mu t) |dq| in closed form, for either direction.
        """
        q0, q1 = np.asarray(q0, float), np.asarray(q1, float)
        way = np.sign(q1 - q0)
        turn, start, end = (
            self.wave_number,
            self.wave_number * q0 - self.phase,
            self.wave_number * q1 - self.phase,
        )
        span, c = end - start, way * friction
        if friction * self.max_slope < MAX_SERIES_SLOPE:
            parts = _integrate_sine_powers(start, end, N_SERIES_TERMS + 2)
            total = sum(
                (c * self.max_slope) ** j * (parts[j] + self.max_slope**2 * parts[j + 2])
                for j in range(N_SERIES_TERMS)
            )
            return c * total / turn
        b = c * self.max_slope
        root = np.sqrt(1 - b * b)
        whole = np.trunc(span / (2 * pi))
        half = 0.5 * (span - 2 * pi * whole)
        middle = 0.5 * (start + end) - pi * whole
        # int d theta/(1 - b sin theta)
        arc = np.arctan2(root * np.sin(half), np.cos(half) - b * np.sin(middle))
        c = np.where(way == 0, 1.0, c)
        total = (
            -self.max_slope * 2 * np.sin(0.5 * span) * np.sin(0.5 * (start + end)) / c
            - span / c**2
            + (1 + 1 / c**2) * 2 / root * (arc + pi * whole)
        )
        return np.where(way == 0, 0.0, c * total / turn)

    def min_mass_ratio(self, friction: float) -> float:
        """Return the minimum of t (t - mu)/(1 + mu t) [1] over the slopes t of the flanks.

        Where it is negative, its product with the lifted mass reduces the mass that the interface moves.
        """
        # the derivative is zero where mu t^2 + 2 t - mu = 0
        flank = (np.sqrt(1 + friction**2) - 1) / friction if friction > 0 else 0.0
        flank = min(flank, self.max_slope)
        return flank * (flank - friction) / (1 + friction * flank)


def _integrate_sine_powers(start, end, count: int) -> list:
    """Integrals of sin^j over the angles from start to end (k,) [rad], j = 0 .. count - 1."""
    out = [end - start, 2 * np.sin(0.5 * (end - start)) * np.sin(0.5 * (end + start))]
    for j in range(2, count):
        edge = np.cos(start) * np.sin(start) ** (j - 1) - np.cos(end) * np.sin(end) ** (j - 1)
        out.append((edge + (j - 1) * out[j - 2]) / j)
    return out
