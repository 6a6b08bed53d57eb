"""Matched sinusoidal grooves of two surfaces; the contact rides up their flanks as it slides.

The height is z = A (1 - cos(k q - phase)) and the slope of the flank t = dz/dq = A k sin(k q - phase).

Let R be the force normal to the flank and f the friction along it, against the motion. On a flank of angle a, t = tan a,
the tangential force F against the motion and the vertical force V are

    F = R sin a + f cos a,    V = R cos a - f sin a,    so  F/V = (t + phi)/(1 - phi t)  with  phi = f/R.

The vertical force carries the load N and accelerates the lifted mass m: V = N + m (t q'' + t' q'^2), t' = dt/dq. Hence
F = V t + f sqrt(1 + t^2). The work F dq consists of V dz, which is stored in the height of the load and the velocity of
the lifted mass, and of f ds, which friction dissipates along the flank, ds = sqrt(1 + t^2) dq. Coulomb's law limits f to
mu R in magnitude. So F lies between V (t - mu)/(1 + mu t) and V (t + mu)/(1 - mu t) at rest, and is one of both in
motion. A flank with mu t >= 1 locks: no force moves the load over it.
"""

from dataclasses import dataclass, replace
from math import inf, pi

import numpy as np

from ..exceptions import PatchfemError

N_SLOPE_TERMS = 18  # number of terms of this series; 0.1^18 is below round-off


@dataclass(frozen=True, slots=True)
class Grooves:
    """Sinusoidal grooves that match those of the opposite surface.

    - wavelength, amplitude [m]: the amplitude is half the height from bottom to crest
    - phase [rad]: the bottom is at the relative displacement q = phase/k
    - lifted_mass [kg]: mass that moves up and down with the load
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

    def describe_lift(self, time: float) -> str:
        """Return the sentence on a lifted mass that leaves the grooves at a time [s]."""
        return (
            f"the lifted mass of {self.lifted_mass:.3g} kg leaves the grooves at {time:.6g} s: the inertia of this "
            f"mass takes all of the load; lower {self.key}.lifted_mass or the drive, or raise the load"
        )

    def check_lifted_mass(self, static: float, sliding_mass: float) -> None:
        """Raise PatchfemError if friction due to the lifted mass exceeds the inertia of the sliding mass [kg].

        That is the case where 1 + m s t (t - mu)/(1 + mu t) <= 0 on some flank, with the acceleration s of the relative
        displacement per newton [1/kg]; `static` is the coefficient of friction mu.
        """
        friction_mass = -self.lifted_mass * self.min_mass_ratio(static)
        if friction_mass < sliding_mass:
            return
        raise PatchfemError(
            f"a lifted mass of {self.lifted_mass:.6g} kg presses so hard on the downward flank that "
            f"friction exceeds the inertia of the sliding mass of {sliding_mass:.6g} kg, and the motion is then "
            "not determined; the lifted mass must be below "
            f"{sliding_mass / -self.min_mass_ratio(static):.6g} kg",
            f"{self.key}.lifted_mass",
        )

    def after_wear(self, depth: float, upper_share: float) -> "Grooves | None":
        """Return the grooves after wear of both pieces, or None if they have become flat.

        Both pieces carry the grooves. A point of a piece wears in proportion to its height above the valleys, so the
        piece keeps a cosine with the same valleys. Above the valleys it has the volume A per area, so a mean worn depth
        h reduces its amplitude to A - h. The load climbs the lower crests of both pieces.

        Parameters
        ----------
        depth : float
            Mean worn depth [m] of both pieces together.
        upper_share : float
            Fraction of this depth that the upper piece lost.

        Returns
        -------
        Grooves or None
        """
        amplitude = self.amplitude - max(upper_share, 1 - upper_share) * depth
        return replace(self, amplitude=amplitude) if amplitude > 0 else None

    def _angle(self, q):
        """Return the phase angle k q - phase [rad] at relative displacements q [m]."""
        return self.wave_number * np.asarray(q, float) - self.phase

    def height(self, q):
        """Return the height z = A (1 - cos(k q - phase)) [m] at relative displacements q [m]."""
        return 2 * self.amplitude * np.sin(0.5 * self._angle(q)) ** 2

    def slope(self, q):
        """Return the slope t = A k sin(k q - phase) [1] at relative displacements q [m]."""
        return self.max_slope * np.sin(self._angle(q))

    def slope_derivative(self, q):
        """Return the slope derivative t' = A k^2 cos(k q - phase) [1/m] at displacements q [m]."""
        return self.max_slope * self.wave_number * np.cos(self._angle(q))

    def find_lift(self, q, velocity, acceleration):
        """Return the vertical acceleration t q'' + t' q'^2 [m s-2] of what the grooves lift.

        Parameters
        ----------
        q, velocity, acceleration : float or array
            Relative displacement [m], velocity [m/s] and acceleration [m s-2].
        """
        return self.slope(q) * acceleration + self.slope_derivative(q) * velocity**2

    def force_ratio(self, q, direction, friction: float):
        """Return the ratio of tangential to vertical force, (t + phi)/(1 - phi t), at q [m].

        Parameters
        ----------
        q : float or array
            Relative displacement [m].
        direction : float or array
            Sign of the motion; 0 where the interface rests on the flank without friction.
        friction : float
            Coefficient mu [1]; phi is the direction times mu.

        Returns
        -------
        float or array
            Ratio [1].
        """
        slope = self.slope(q)
        phi = np.asarray(direction) * friction
        return (slope + phi) / (1 - phi * slope)

    def stiffness(self, load: float) -> float:
        """Return the stiffness N k^2 A [N/m] of small oscillations under a load N [N]."""
        return load * self.wave_number**2 * self.amplitude

    def max_force(self, load: float, friction: float) -> float:
        """Return the largest tangential force N (A k + mu)/(1 - mu A k) [N], or inf if the flanks lock.

        The steepest flank carries it under a load N [N]; `friction` is the coefficient mu [1].
        """
        if friction * self.max_slope >= 1:
            return inf
        return load * (self.max_slope + friction) / (1 - friction * self.max_slope)

    def height_difference(self, q0, q1):
        """Return the height difference [m] between q0 and q1 [m], computed without cancellation."""
        half_difference = 0.5 * self.wave_number * (q1 - q0)
        mean_angle = 0.5 * self.wave_number * (q1 + q0) - self.phase
        return 2 * self.amplitude * np.sin(mean_angle) * np.sin(half_difference)

    def friction_loss(self, q0, q1, friction: float):
        """Return the energy [J/N] that friction dissipates from q0 to q1 [m], per vertical force.

        It is the integral of mu (1 + t^2)/(1 - mu t sgn dq) |dq|, for either direction.

        Parameters
        ----------
        q0, q1 : float or array
            Relative displacements [m] at the ends.
        friction : float
            Coefficient mu [1].

        Returns
        -------
        float or array
            Energy per vertical force [J/N].
        """
        q0 = np.asarray(q0, float)
        q1 = np.asarray(q1, float)
        signed_friction = np.sign(q1 - q0) * friction
        # Largest product of friction coefficient and slope for which the friction loss is computed
        # as a power series; the closed form suffers from cancellation there
        if friction * self.max_slope < 0.1:
            loss = self._integrate_series(self._angle(q0), self._angle(q1), signed_friction)
        else:
            loss = self._integrate_loss(self._angle(q0), self._angle(q1), signed_friction)
        return loss / self.wave_number

    def _integrate_series(self, start, end, signed_friction):
        """Integrate the friction loss mu (1 + t^2)/(1 - mu t) over angles as a power series, for small mu A k.

        `start` and `end` are angles k q - phase [rad], and `signed_friction` is mu times the sign of the motion. They
        are floats or arrays.
        """
        powers = _integrate_sine_powers(start, end, N_SLOPE_TERMS + 2)
        b = signed_friction * self.max_slope
        total = 0.0
        for j in range(N_SLOPE_TERMS):
            total = total + b**j * (powers[j] + self.max_slope**2 * powers[j + 2])
        return signed_friction * total

    def _integrate_loss(self, start, end, signed_friction):
        """Integrate the friction loss mu (1 + t^2)/(1 - mu t) over angles in closed form.

        `start` and `end` are angles k q - phase [rad], and `signed_friction` is mu times the sign of the motion. They
        are floats or arrays.
        """
        has_friction = signed_friction != 0
        mu = np.where(has_friction, signed_friction, 1.0)
        b = signed_friction * self.max_slope
        root = np.sqrt(1 - b * b)
        angle = end - start
        n_turns = np.trunc(angle / (2 * pi))
        half = 0.5 * (angle - 2 * pi * n_turns)
        middle = 0.5 * (start + end) - pi * n_turns
        # This is half the integral of root/(1 - b sin theta), by the tangent half-angle
        # substitution.
        arc = np.arctan2(root * np.sin(half), np.cos(half) - b * np.sin(middle)) + pi * n_turns
        sine_integral = 2 * np.sin(0.5 * angle) * np.sin(0.5 * (start + end))
        total = (
            -self.max_slope * sine_integral / mu - angle / mu**2 + (1 + 1 / mu**2) * 2 / root * arc
        )
        return np.where(has_friction, mu * total, 0.0)

    def min_mass_ratio(self, friction: float) -> float:
        """Return the minimum of t (t - mu)/(1 + mu t) over the slopes t of the flanks.

        Where it is negative, its product with the lifted mass reduces the mass that the interface moves.
        """
        # The derivative is zero where mu t^2 + 2 t - mu = 0.
        slope = (np.sqrt(1 + friction**2) - 1) / friction if friction > 0 else 0.0
        slope = min(slope, self.max_slope)
        return slope * (slope - friction) / (1 + friction * slope)


def _integrate_sine_powers(start, end, count: int) -> list[np.ndarray]:
    """Return the integrals of sin^j from start to end (k,) [rad] for j < count, by partial integration."""
    integrals = [end - start, 2 * np.sin(0.5 * (end - start)) * np.sin(0.5 * (end + start))]
    for j in range(2, count):
        boundary = np.cos(start) * np.sin(start) ** (j - 1) - np.cos(end) * np.sin(end) ** (j - 1)
        integrals.append((boundary + (j - 1) * integrals[j - 2]) / j)
    return integrals
