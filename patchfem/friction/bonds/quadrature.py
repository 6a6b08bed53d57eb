"""Direct sum over all bonds along the path of a point (eq. 2.17).

Each step of the path leaves one strip of bonds, which formed under the mean pressure of the step (`strips`). In
rigid sliding all points have the same path, so a strip has scalars of the path and one pressure per point.

The two readings of eq. 2.17 (`Bonds.reading`):

- "report": eqs. 2.14 to 2.17 as printed. A bond carries (R/eps)^p exp(-R/eps) along u/|u|, and its length grows from
  zero (eq. 2.10). The path element is |v| dt in place of the signed dX1 of the report.
- "stretch": a bond carries (|u|/eps)^p exp(-D) along u/|u|, with D the damage, the integral of dR/eps along the path. The
  bond length in the power is that at which the bond formed. On a path without reversal this is "report". It never
  creates energy for p >= 0.

A bond stores the energy that it gives back when its stretch goes to zero without further damage: f u/(p + 1) for
"stretch", and f u for "report", whose force f does not depend on the stretch. A step dissipates its work less the gain
in stored energy. For "report" this may be negative: energy is created.

Bonds whose path or damage exceeds a cut-off are left out. The compiled sum along a line is `list_kernels`.
"""

from dataclasses import dataclass, replace
from functools import cache, lru_cache
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from ..protocol import Step
from .list_numbers import cutoff_age
from .parameters import Bonds, grow, growth_exponents, split_elastic
from .recursion import BondState, move_bonds, press_bonds
from .strips import PathState, Strip, Strips, strip_weights, surviving_density

N_POINTS = 5  # number of Gauss points in a panel of a step
N_SHORT_POINTS = 2  # the same in a step of at most SHORT_STEP bond lengths, exact to 1e-6
SHORT_STEP = 0.25
# Ends of the panels of a step in bond lengths; the force changes most in the first bond length
PANEL_ENDS = (0, 1, 2, 4, 8, 16, 32)
# Smallest number of strips, in addition to half of all strips, that the cut-off removes at once;
# removing fewer costs more time than it saves
MIN_DROPPED = 64


class _DamagingPart(NamedTuple):
    """Part of a displacement increment in which bonds form and break.

    - length: its length [m]
    - direction: its sign
    - play: play after the increment, as in `parameters.split_elastic`
    """

    length: float
    direction: float
    play: float


class _StepIntegrals(NamedTuple):
    """Mean traction (m,) [Pa] over an increment, and energy (m,) [J/m2] that damage dissipates."""

    mean: np.ndarray
    dissipated: np.ndarray


class _Release(NamedTuple):
    """Change of the bonds at all points when the pressure changes at rest.

    - kept: factor on the bonds of the strips, (k, m) or (m,)
    - formed: density (m,) [Pa] of an unstretched cohort that is added
    """

    kept: np.ndarray
    formed: np.ndarray


@dataclass(frozen=True, slots=True)
class Quadrature:
    """Friction law that evaluates the sum over bonds (eq. 2.17) by quadrature.

    - law: parameters of the bonds
    - tail: largest fraction of the friction limit that the cut-off may leave out; 0 keeps every bond

    Tractions (m,) [Pa] are positive against slip.
    """

    law: Bonds
    tail: float = 1e-9

    def initial_state(self, sigma) -> Strips:
        """Return the initial state: unstretched and fully grown bonds of a given density.

        Parameters
        ----------
        sigma : (m,) array
            Pressure [Pa].

        Returns
        -------
        Strips
        """
        zero = np.zeros(1)
        length = np.full(1, self.law.length)
        cohort = Strip(
            end=PathState(zero, zero, zero, zero, length),
            direction=zero,
            length=zero,
            bond_length=length,
            growth=zero,
            mature_gain=zero,
        )
        return Strips(
            strips=cohort,
            pressure=self.law.initial * np.array(sigma, float)[None],
            now=PathState(0.0, 0.0, 0.0, 0.0, self.law.length),
            first_active=np.zeros(len(sigma), np.int64),
        )

    def step(self, state: Strips, dq, s0, s1, dt: float) -> Step:
        """Advance the bonds by an increment; return mean traction and dissipated energy.

        The mean traction is exact for reading="stretch" and p = 1, and else comes from Gauss points. For
        reading="stretch" it comes from the energy balance, so no step creates energy.

        Parameters
        ----------
        state : Strips
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures [Pa] at the ends.
        dt : float
            Duration [s].

        Returns
        -------
        Step
        """
        after = self.advance(state, dq, s0, s1, dt)
        # Bonds that were lost have no pressure any more, so that all of a point act, or none.
        after = replace(
            after, pressure=_active_pressure(after), first_active=0 * after.first_active
        )
        stored = self.stored_energy(state)
        energy_gain = self.stored_energy(after) - stored
        if not dq:
            return Step(self.traction(after), -energy_gain, after)
        if self._has_moments:
            mean = self._mean_from_moments(state, dq, (s0 + s1) / 2, dt)
        elif self.law.reading == "report":
            mean = self._integrate_step(state, dq, s0, s1, dt).mean
        else:
            gain_before_loss = energy_gain
            if not (s1 > 0).all():
                # Bonds that are lost at the end of the step still act during the step.
                positive_pressure = np.maximum(s1, np.finfo(float).tiny)
                before_loss = self.advance(
                    state, dq, s0, positive_pressure, dt, forming=(s0 + s1) / 2
                )
                gain_before_loss = self.stored_energy(before_loss) - stored
            mean = self._mean_from_energy(state, gain_before_loss, dq, s0, s1, dt)
        return Step(mean, dq * mean - energy_gain, after)

    def _mean_from_moments(self, state: Strips, dq, sigma, dt: float) -> np.ndarray:
        """Compute the mean traction (m,) [Pa] by the closed form in `recursion`."""
        middle = self._middle_length(state, dq, dt)
        bonds = BondState(self._moments(state), middle, state.play)
        mean = move_bonds(self.law, bonds, dq, sigma, middle).mean
        return self.law.static / self.law.length * mean

    def _mean_from_energy(self, state: Strips, energy_gain, dq, s0, s1, dt: float) -> np.ndarray:
        """Compute the mean traction (m,) [Pa] in an increment from the energy balance."""
        return (self._integrate_step(state, dq, s0, s1, dt).dissipated + energy_gain) / dq

    def _integrate_step(self, state: Strips, dq, s0, s1, dt: float) -> _StepIntegrals:
        """Integrate traction and dissipation over an increment, divided into panels with Gauss points.

        The dissipation holds for reading="stretch", where damage takes the fraction dR/eps of the stored energy.
        """
        if self.law.reading == "report":
            elastic = 0.0
            damage = 1.0
            panel_ends = np.array([0.0, 1.0])
        else:
            middle = self._middle_length(state, dq, dt)
            path = abs(dq)
            damage = self._damaging_part(state, dq, middle).length / middle
            elastic = 1 - damage * middle / path
            panel_ends = np.unique(np.append(np.minimum(PANEL_ENDS, damage), damage))
        points, weights = _gauss_points(N_SHORT_POINTS if damage <= SHORT_STEP else N_POINTS)
        mean, dissipated = np.zeros((2, len(s0)))
        for low, high in pairwise(panel_ends):
            for point, weight in zip(
                (low + high + (high - low) * points) / 2, (high - low) / 2 * weights
            ):
                fraction = elastic + (1 - elastic) * point / damage
                point_state = self.advance(
                    state,
                    fraction * dq,
                    s0,
                    s0 + fraction * (s1 - s0),
                    fraction * dt,
                    forming=(s0 + s1) / 2,
                )
                sums = self.law.static * self._sums(point_state)
                mean = mean + weight / damage * sums[0]
                dissipated = dissipated + weight * sums[-1]
        return _StepIntegrals(mean, dissipated)

    def press(self, state: Strips, s0, s1) -> Step:
        """Change the pressure linearly while the points are at rest.

        For reading="report" a bond keeps the pressure at which it formed, and none forms at rest. For reading="stretch"
        and p = 1 the rule is that of `recursion.press_bonds`; with another order, the last-formed bonds are lost first.

        Parameters
        ----------
        state : Strips
        s0, s1 : (m,) array
            Pressures [Pa] before and after.

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        first_active = np.where(s1 > 0, state.first_active, len(state.strips.length))
        after = replace(state, first_active=first_active)
        if self.law.reading == "stretch":
            release = self._release_by_moments if self._has_moments else self._release_last_formed
            kept_fraction, formed_pressure = release(after, s0, s1)
            now = state.now
            cohort = Strip(now, 0.0, 0.0, now.mature_length, 0.0, 0.0)
            pressure = np.vstack(
                [state.pressure * kept_fraction, np.where(s1 > 0, formed_pressure, 0.0)]
            )
            after = replace(after, strips=state.strips.append(cohort), pressure=pressure)
        return Step(
            self.traction(after), self.stored_energy(state) - self.stored_energy(after), after
        )

    def _release_by_moments(self, state: Strips, s0, s1) -> _Release:
        """Compute the change of the bonds at rest from the closed-form solution for their moments.

        A negative density removes unstretched bonds.
        """
        before = self._moments(state)
        m, _, s2 = before
        density, _, s2_after = press_bonds(self.law, before, s0, s1)
        kept_fraction = np.divide(s2_after, s2, out=np.ones_like(s2), where=s2 > 0)
        return _Release(kept_fraction, density - kept_fraction * m)

    def _release_last_formed(self, state: Strips, s0, s1) -> _Release:
        """Compute the change of the bonds at rest; if the pressure falls, the last-formed bonds break first.

        Bonds form unstretched where the pressure rises, or where the remaining ones would carry more than mu_s sigma.
        """
        density = _active_pressure(state) * surviving_density(state)[:, None]
        is_falling = s1 < s0
        total = density.sum(axis=0)
        lost_fraction = 1 - s1 / np.where(s0 > 0, s0, 1.0)
        excess = np.where(is_falling & (s0 > 0), total * lost_fraction, 0.0)
        younger = np.cumsum(density[::-1], axis=0)[::-1] - density
        released = np.clip(excess - younger, 0.0, density)
        kept_fraction = 1 - np.divide(
            released, density, out=np.zeros_like(density), where=density > 0
        )
        carried_pressure = np.abs(
            self.weights(state)[:, 0] @ (_active_pressure(state) * kept_fraction)
        )
        is_over_limit = is_falling & (carried_pressure > s1)
        factor = np.where(
            is_over_limit, s1 / np.where(carried_pressure > 0, carried_pressure, 1.0), 1.0
        )
        re_formed = (1 - factor) * (density * kept_fraction).sum(axis=0)
        newly_formed = self.law.initial * np.maximum(s1 - s0, 0.0)
        return _Release(kept_fraction * factor, np.where(is_falling, re_formed, newly_formed))

    @property
    def _has_moments(self) -> bool:
        """Return whether the sum can be computed from the moments m, z and s2 of `recursion`."""
        return self.law.order == 1 and self.law.reading == "stretch"

    def _moments(self, state: Strips) -> np.ndarray:
        """Return the moments m, z and s2 of `recursion` as an array (3, m)."""
        moments = self._sums(state) * self.law.length
        moments[-1] *= 2
        return np.vstack([_sum_strips(state, surviving_density(state)[:, None]), moments])

    def advance(self, state: Strips, dq, s0, s1, dt: float, forming=None) -> Strips:
        """Advance the bonds by an increment, but compute no traction and energy.

        This takes at most a tenth of the time of `step`.

        Parameters
        ----------
        state, dq, s0, s1, dt
            As in `step`.
        forming : (m,) array, optional
            Pressure [Pa] at which new bonds form; by default the mean of s0 and s1.

        Returns
        -------
        Strips
        """
        law = self.law
        now = state.now
        path = abs(dq)
        speed = path / dt if dt > 0 else 0.0
        middle = self._middle_length(state, dq, dt)
        part = self._damaging_part(state, dq, middle)
        growth = sum(growth_exponents(law, speed, speed, path, dt)) if law.has_growth else 0.0
        end = PathState(
            displacement=now.displacement + dq,
            path=now.path + part.length,
            damage=now.damage + part.length / middle,
            growth=now.growth + growth,
            mature_length=grow(law, now.mature_length, speed, speed, path, dt),
        )
        # Bonds are lost where the pressure vanishes.
        n_strips = len(state.strips.length) + (part.length != 0)
        first_active = np.where(s1 > 0, state.first_active, n_strips)
        after = replace(state, now=end, play=part.play, first_active=first_active)
        if part.length == 0:
            return after
        length_gain = end.mature_length - now.mature_length
        strip = Strip(end, part.direction, part.length, middle, growth, length_gain)
        sigma = (s0 + s1) / 2 if forming is None else forming
        strips = state.strips.append(strip)
        pressure = np.vstack([state.pressure, sigma])
        return self._drop_old_strips(replace(after, strips=strips, pressure=pressure))

    def _damaging_part(self, state: Strips, dq, middle: float) -> _DamagingPart:
        """Return the part of an increment in which bonds form and break, for a bond length [m]."""
        _, damaging, play = split_elastic(self.law, state.play, float(dq), middle)
        return _DamagingPart(abs(damaging), np.sign(damaging), play)

    def _middle_length(self, state: Strips, dq, dt: float) -> float:
        """Return the bond length [m] in the middle of an increment, which is assigned to new bonds."""
        half = abs(dq) / 2
        speed = 2 * half / dt if dt > 0 else 0.0
        return grow(self.law, state.now.mature_length, speed, speed, half, dt / 2)

    def _drop_old_strips(self, state: Strips) -> Strips:
        """Remove the strips older than the cut-off age once they are at least half of all strips."""
        if self.tail <= 0:
            return state
        if self.law.reading == "stretch":
            age = state.strips.end.damage
            now = state.now.damage
        else:
            age = state.strips.end.path / self.law.length
            now = state.now.path / self.law.length
        first = int(np.searchsorted(age, now - cutoff_age(self.law.order, self.tail)))
        if first < max(MIN_DROPPED, len(age) // 2):
            return state
        return replace(
            state,
            strips=state.strips.select(slice(first, None)),
            pressure=state.pressure[first:],
            first_active=np.maximum(state.first_active - first, 0),
            n_dropped=state.n_dropped + first,
        )

    def weights(self, state: Strips) -> np.ndarray:
        """Return the signed force [1] and the stored energy [m] of each strip, (k, 2).

        The traction is mu_s times the sum of force times pressure, and so is the stored energy per area.
        """
        return strip_weights(state, self.law)

    def _sums(self, state: Strips) -> np.ndarray:
        """Return traction / mu_s [Pa] and stored energy / mu_s [J/m2] as an array (2, m)."""
        return _sum_law(state, self.law)

    def traction(self, state: Strips) -> np.ndarray:
        """Return the traction (m,) [Pa], positive against slip."""
        return self.law.static * self._sums(state)[0]

    def stored_energy(self, state: Strips) -> np.ndarray:
        """Return the elastic energy per area (m,) [J/m2] with the present damage of the bonds."""
        return self.law.static * self._sums(state)[-1]


@lru_cache(4)
def _sum_law(state: Strips, law: Bonds) -> np.ndarray:
    """Return the sums of a state, which traction, energy and the next step need again."""
    return _sum_strips(state, strip_weights(state, law))


@cache
def _gauss_points(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the Gauss points of a panel in (-1, 1), and their weights."""
    return np.polynomial.legendre.leggauss(count)


def _active_pressure(state: Strips) -> np.ndarray:
    """Return the pressure (k, m) [Pa] at which bonds formed, or 0 for bonds that no longer act."""
    return state.pressure * (np.arange(len(state.pressure))[:, None] >= state.first_active)


def _sum_strips(state: Strips, weights) -> np.ndarray:
    """Sum products of weights (k, c) and pressures over the strips of bonds that still act, (c, m)."""
    count = len(state.pressure)
    if ((state.first_active > 0) & (state.first_active < count)).any():
        return weights.T @ _active_pressure(state)
    return (weights.T @ state.pressure) * (state.first_active < count)
