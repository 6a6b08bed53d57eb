"""Bond law for friction.reading = "stretch" and p = 1, summed exactly by its moments.

With k = exp(-int dR/eps) the surviving fraction of a bond, u its stretch and 1/eps frozen when it forms, the sums over
all bonds

    m = sum sigma k dL/eps,   z = sum sigma k u dL/eps,   s2 = sum sigma k u^2 dL/eps        [Pa, Pa m, Pa m2]

obey, per unit of path in the direction e = +-1, m' = (sigma - m)/eps, z' = m e - z/eps, s2' = 2 z e - s2/eps; the
traction is mu_s z/eps_0. A step is exact for a bond length that is constant in it. Stored energy mu_s s2/(2 eps_0) and
dissipation mu_s s2/(2 eps_0 eps) per path are never negative: passive for every path, pressure and bond length, and for
every part of the path that is counted as damaging.

Bonds are arrays (3, m) of m, z and s2.

Breakaway. The path counts only where the displacement moves its elastic range along
(`parameters.split_elastic`); inside it z' = m e and s2' = 2 z e. With a fraction b of the bond length, an oscillation of
the force by less than 2 b mu_s sigma from end to end drifts in its first cycle only; b = 0 is Dahl's law, and b -> 1
the elastic-plastic one.

Load. Where the load falls at rest, the bonds without stretch, which formed last, are released first: the force stays as
long as a population with the moments (m, z, s2) exists, m >= z^2/s2. Beyond that all stretches shrink, and no point
keeps more than mu_s sigma. Where it rises, unstressed bonds of density m_0 form. Neither adds energy.

Compiled for one point of a line: `point_kernels`.
"""

from dataclasses import dataclass
from math import factorial
from typing import NamedTuple

import numpy as np

from ..protocol import Step
from .parameters import Bonds, grow, split_elastic

# Largest path in bond lengths for which the shape functions are computed by power series
MAX_SERIES_PATH = 0.03
# Largest path in bond lengths for which the integrals of powers are computed by power series
MAX_POWER_SERIES_PATH = 0.5
MIN_DIVISOR = 1e-300  # smallest divisor; it keeps quotients finite where no bonds are left


class BondState(NamedTuple):
    """State of the bonds at all points.

    - bonds: m [Pa], z [Pa m] and s2 [Pa m2], (3, m)
    - eps: bond length [m], common or per point (m,)
    - play: position in the elastic range [1], see `parameters.split_elastic`
    """

    bonds: np.ndarray
    eps: float | np.ndarray
    play: float | np.ndarray = 0.0


class ShapeFunctions(NamedTuple):
    """Shape functions f1 = (1 - exp(-x))/x, f2 = (1 - f1)/x and decay = exp(-x).

    x is a path in bond lengths.
    """

    f1: np.ndarray
    f2: np.ndarray
    decay: np.ndarray


class PowerIntegrals(NamedTuple):
    """Integrals of y exp(-y) and y^2 exp(-y) from 0 to x, and the integral of the second one over x."""

    first: np.ndarray
    second: np.ndarray
    second_integral: np.ndarray


class LineIncrement(NamedTuple):
    """Displacement increment along a line.

    - bonds: bonds (3, m) after it
    - mean, slope: path-mean z (m,) [Pa m] and its derivative over the increment (m,) [Pa]
    - damage_integral: integral of s2 dR/eps (m,) [Pa m2], of which mu_s/(2 eps_0) is dissipated
    """

    bonds: np.ndarray
    mean: np.ndarray
    slope: np.ndarray
    damage_integral: np.ndarray


class BondIncrement(NamedTuple):
    """Displacement increment: as in `LineIncrement`, and the play after it."""

    bonds: np.ndarray
    mean: np.ndarray
    damage_integral: np.ndarray
    play: float | np.ndarray


def shape_functions(x) -> ShapeFunctions:
    """Compute the shape functions at paths x >= 0 (array of any shape) without cancellation."""
    x = np.asarray(x, float)
    is_small = x < MAX_SERIES_PATH
    safe = np.where(is_small, 1.0, x)
    f1 = -np.expm1(-safe) / safe
    f2 = (1 - f1) / safe
    series = 1 / 2 - x * (
        1 / 6 - x * (1 / 24 - x * (1 / 120 - x * (1 / 720 - x * (1 / 5040 - x / 40320))))
    )
    f2 = np.where(is_small, series, f2)
    f1 = np.where(is_small, 1 - x * f2, f1)
    return ShapeFunctions(f1, f2, np.exp(-x))


def integrate_powers(x, decay) -> PowerIntegrals:
    """Integrate y exp(-y) and y^2 exp(-y) from 0 to x >= 0, given decay = exp(-x)."""
    series = sum((-1) ** k * x**k / (factorial(k) * (k + 4)) for k in range(13))
    closed = 6 - decay * (x**3 + 3 * x * x + 6 * x + 6)
    cubic = np.where(x < MAX_POWER_SERIES_PATH, x**4 * series, closed)
    second = (cubic + x**3 * decay) / 3
    return PowerIntegrals((second + x * x * decay) / 2, second, x * second - cubic)


def advance_bonds(bonds, increment, sigma, eps) -> LineIncrement:
    """Advance the bonds by an increment along a line.

    Parameters
    ----------
    bonds : (3, m) array
        m, z and s2 before.
    increment, eps : float or (m,) array
        Increment and bond length [m].
    sigma : (m,) array
        Pressure [Pa] under which the new bonds form.

    Returns
    -------
    LineIncrement
    """
    m, z, s2 = bonds
    path = np.abs(increment)
    sign = np.sign(increment)
    x = path / eps
    f1, f2, decay = shape_functions(x)
    zeroth = x * f1
    density_deficit = sigma - m
    with np.errstate(over="ignore", invalid="ignore"):
        powers = integrate_powers(x, decay)
    mean = z * f1 + sign * eps * x * (sigma * f2 - density_deficit * (f1 - f2))
    slope = sign * z * (f2 - f1) / eps + sigma * (f1 - f2) - density_deficit * (f2 - x * (f1 - f2))
    # Without motion, the slope is the mean of those for both directions.
    slope = np.where(path > 0, slope, m / 2)
    after = np.stack(
        [
            sigma - density_deficit * decay,
            z * decay + sign * eps * (sigma * zeroth - density_deficit * x * decay),
            decay * (s2 + 2 * sign * z * path + m * path**2) + sigma * eps**2 * powers.second,
        ]
    )
    damage = s2 * zeroth + 2 * sign * z * eps * powers.first
    damage = damage + m * eps**2 * powers.second + sigma * eps**2 * powers.second_integral
    return LineIncrement(after, mean, slope, damage)


def stretch_bonds(bonds, increment):
    """Stretch all bonds (3, m) by an increment [m] along a line; no bond breaks or forms."""
    m, z, s2 = bonds
    return np.stack([m, z + m * increment, s2 + increment * (2 * z + m * increment)])


def move_bonds(law: Bonds, state: BondState, increment, sigma, eps) -> BondIncrement:
    """Advance the bonds by an increment; the elastic range of the law comes first.

    Parameters
    ----------
    law : Bonds
    state : BondState
        Bonds before; its bond length is not used.
    increment : float
        Increment [m].
    sigma : (m,) array
        Pressure [Pa] under which the new bonds form.
    eps : float or (m,) array
        Bond length [m] of the increment.

    Returns
    -------
    BondIncrement
    """
    bonds = state.bonds
    elastic, damaging, play = split_elastic(law, state.play, increment, eps)
    stretched = stretch_bonds(bonds, elastic)
    line_increment = advance_bonds(stretched, damaging, sigma, eps)
    mean = line_increment.mean
    if np.any(elastic):
        elastic_mean = (bonds[1] + stretched[1]) / 2
        mean = elastic / increment * elastic_mean + damaging / increment * mean
    return BondIncrement(line_increment.bonds, mean, line_increment.damage_integral, play)


def press_bonds(law: Bonds, bonds, s0, s1):
    """Return the bonds after the pressure has changed at rest; the stored energy never increases.

    Where the pressure falls, bonds without stretch are released first, as long as m >= z^2/s2; beyond that all
    stretches shrink. Where it rises, unstressed bonds of density m_0 (s1 - s0) form.

    Parameters
    ----------
    law : Bonds
    bonds : (3, m) array
    s0, s1 : (m,) array
        Pressures before and after [Pa].

    Returns
    -------
    (3, m) array
    """
    m, z, s2 = bonds
    is_falling = s1 < s0
    remaining = np.divide(m * s1, s0, out=np.zeros_like(m), where=s0 > 0)
    density = np.where(is_falling, remaining, m + law.initial * (s1 - s0))
    min_density = np.divide(z * z, s2, out=np.zeros_like(m), where=s2 > 0)
    must_shrink = is_falling & (min_density > remaining)
    factor = np.where(must_shrink, remaining / np.maximum(min_density, MIN_DIVISOR), 1.0)
    bound = law.length * s1
    stretched = factor * np.abs(z)
    factor *= np.where(
        is_falling & (stretched > bound), bound / np.maximum(stretched, MIN_DIVISOR), 1.0
    )
    return np.stack([density, z * factor, s2 * factor])


@dataclass(frozen=True, slots=True)
class FirstOrderBonds:
    """Bonds of order p = 1 for friction.reading = "stretch", updated incrementally.

    The pressure may vary within an increment and from one increment to the next.

    Tractions (m,) [Pa] are positive against slip. If the rates of growth of `law` are arrays (m,), every point has a bond
    length of its own.
    """

    law: Bonds

    def initial_state(self, sigma) -> BondState:
        """Return unstressed bonds of density m_0 under a pressure (m,) [Pa]."""
        bonds = np.zeros((3, np.size(sigma)))
        bonds[0] = self.law.initial * sigma
        return BondState(bonds, self.law.length)

    def step(self, state: BondState, dq, s0, s1, dt: float) -> Step:
        """Advance the bonds by a step; new bonds form at the mean pressure of the step.

        All bonds are lost where the step ends without pressure.

        Parameters
        ----------
        state : BondState
        dq : float
            Increment [m].
        s0, s1 : (m,) array
            Pressures at the ends [Pa].
        dt : float
            Duration [s].

        Returns
        -------
        Step
        """
        law = self.law
        path = abs(dq)
        speed = path / dt if dt > 0 else 0.0
        middle = grow(law, state.eps, speed, speed, path / 2, dt / 2)
        bond_increment = move_bonds(law, state, dq, (s0 + s1) / 2, middle)
        bonds = bond_increment.bonds
        scale = law.static / law.length
        dissipated = scale * bond_increment.damage_integral / 2
        is_lost = (s1 <= 0) & (np.abs(bonds).sum(axis=0) > 0)
        if is_lost.any():
            dissipated = dissipated + np.where(is_lost, scale * bonds[-1] / 2, 0.0)
            bonds = np.where(is_lost, 0.0, bonds)
        end = grow(law, state.eps, speed, speed, path, dt)
        return Step(
            scale * bond_increment.mean, dissipated, BondState(bonds, end, bond_increment.play)
        )

    def press(self, state: BondState, s0, s1) -> Step:
        """Change the pressure linearly while the points are at rest, by the rule in `press_bonds`.

        Energy that is no longer stored is lost.

        Parameters
        ----------
        state : BondState
        s0, s1 : (m,) array
            Pressures before and after [Pa].

        Returns
        -------
        Step
            Its mean is the traction after the change.
        """
        bonds = press_bonds(self.law, state.bonds, s0, s1)
        scale = self.law.static / self.law.length
        released = scale / 2 * (state.bonds[2] - bonds[2])
        return Step(scale * bonds[1], released, state._replace(bonds=bonds))

    def traction(self, state: BondState):
        """Return the traction mu_s z/eps_0 (m,) [Pa], positive against slip."""
        return self.law.static / self.law.length * state.bonds[1]

    def stored_energy(self, state: BondState):
        """Return the elastic energy per area mu_s s2/(2 eps_0) (m,) [J/m2]."""
        return self.law.static / (2 * self.law.length) * state.bonds[-1]
