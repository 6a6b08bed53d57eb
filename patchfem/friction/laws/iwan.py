"""Segalman's four-parameter Iwan model of parallel sliders (J. Appl. Mech. 72, 752, 2005).

Sliders of unit stiffness that yield at a stretch phi are distributed with the density

    rho(phi) = R phi^chi (0 <= phi < phi_max) + S delta(phi - phi_max)

The slip force F_S = int phi rho, the stiffness K_T = int rho, the exponent chi of the micro-slip and the ratio
beta = S phi_max^-(chi + 1) (chi + 1)/R, which weighs the last slider, determine R, S, chi and phi_max. A small cycle of
amplitude u dissipates 4 R u^(chi + 3)/((chi + 2)(chi + 3)).
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ..protocol import SteadyLoop

# Number of cells of the power law, each a Jenkins element; the force of first loading is exact to 1e-6 of F_S for
# chi >= -0.5, and to 5e-6 for chi >= -0.99
N_SLIDER_CELLS = 768
# Smallest yield displacement of a slider with a cell of its own, relative to phi_max
MIN_SLIDER_RATIO = 1e-5
# Fraction of the cells that is spaced uniformly in log(phi), for small cycles
LOG_CELL_FRACTION = 0.25


class Sliders(NamedTuple):
    """Parallel sliders.

    - stiffness: (t,) [N/m]
    - yield_displacement: (t,) displacements at which they slip [m]
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Iwan:
    """Iwan model of a contact, whose forces are per newton of normal load.

    All points of a contact have the same relative displacement and the same stretches.

    - static: slip force F_S [1]
    - stiffness: K_T [1/m]
    - chi, beta: exponent of the micro-slip, and weight of the last slider
    """

    static: float
    stiffness: float
    chi: float
    beta: float

    @property
    def phi_max(self) -> float:
        """Displacement [m] at which all sliders slip."""
        return max_yield_displacement(self.static, self.stiffness, self.chi, self.beta)

    @property
    def length(self) -> float:
        """Slip force over stiffness [m], the stretch before slip of one spring in place of the sliders."""
        return self.static / self.stiffness

    def elements(self, load: float) -> Sliders:
        """Return the sliders under a load [N] that represent the density."""
        return slider_cells(self.static * load, self.stiffness * load, self.chi, self.beta)

    def steady_loop(self, load: float, amplitude) -> SteadyLoop:
        """Return the steady loops of the continuous density under a load [N] at amplitudes [m], by Masing's rule.

        The curve of first loading is Segalman's eq. 22.
        """
        limit = self.static * load
        phi_max = self.phi_max
        order = self.chi + 1
        scale = limit / (self.beta + order / (order + 1))
        x = np.minimum(amplitude / phi_max, 1.0)
        force = scale * ((self.beta + 1) * x - x ** (order + 1) / (order + 1))

        # By Masing's rule, a loop has 8 times the work of first loading, minus the area of its diagonal.
        work = (self.beta + 1) * x**2 / 2 - x ** (order + 2) / ((order + 1) * (order + 2))
        work = scale * phi_max * work + limit * np.maximum(amplitude - phi_max, 0.0)
        return SteadyLoop(force, 8 * work - 4 * amplitude * force)


def max_yield_displacement(force: float, stiffness: float, chi: float, beta: float) -> float:
    """Return phi_max = F_S (1 + beta)/(K_T (beta + (chi + 1)/(chi + 2))), at which all sliders slip.

    Parameters
    ----------
    force, stiffness : float
        F_S [N] and K_T [N/m].
    chi, beta : float
        Exponent > -1 and weight >= 0 of the last slider.

    Returns
    -------
    float
        phi_max [m].
    """
    return force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))


def slider_cells(
    force: float, stiffness: float, chi: float, beta: float, n_cells: int = N_SLIDER_CELLS
) -> Sliders:
    """Return the spring-slider elements of an Iwan model: one per cell of its power law, and the one that yields last.

    Each cell keeps the stiffness and the slip force of its part of the density, so the sums over all cells are exact, as
    is the force of first loading at every border of a cell. The width of the cells follows the square root of the
    density, which is optimal for a given number of linear pieces.

    Parameters
    ----------
    force, stiffness : float
        Slip force F_S [N] and stiffness K_T [N/m].
    chi, beta : float
        Exponent > -1 of the micro-slip, and weight >= 0 of the last slider.
    n_cells : int
        Number of cells of the power law.

    Returns
    -------
    Sliders
    """
    unit = _unit_sliders(chi, beta, n_cells)
    phi_max = max_yield_displacement(force, stiffness, chi, beta)
    return Sliders(stiffness * unit.stiffness, phi_max * unit.yield_displacement)


@lru_cache(32)
def _unit_sliders(chi: float, beta: float, n_cells: int) -> Sliders:
    """Return the `slider_cells` for a unit stiffness and phi_max = 1."""
    power_law_fraction = 1 / (1 + beta)
    log_min = np.log(MIN_SLIDER_RATIO)

    # Borders of the cells at equal steps of a cell fraction: most of it follows the square root of the density
    # phi^chi, the remainder is uniform in log(phi)
    x = np.concatenate([[0.0], np.exp(np.linspace(log_min, 0.0, 20 * N_SLIDER_CELLS + 1))])
    log_part = np.clip(1 - np.log(np.maximum(x, MIN_SLIDER_RATIO)) / log_min, 0.0, 1.0)
    cell_fraction = (1 - LOG_CELL_FRACTION) * x ** (1 + chi / 2) + LOG_CELL_FRACTION * log_part
    edges = np.interp(np.linspace(0.0, 1.0, n_cells + 1), cell_fraction, x)

    # Integrals of rho and of phi rho over each cell
    stiffness = power_law_fraction * np.diff(edges ** (chi + 1))
    force = power_law_fraction * (chi + 1) / (chi + 2) * np.diff(edges ** (chi + 2))
    yield_displacement = force / stiffness
    if beta > 0:
        stiffness = np.append(stiffness, 1 - power_law_fraction)
        yield_displacement = np.append(yield_displacement, 1.0)
    return Sliders(frozen_array(stiffness), frozen_array(yield_displacement))


def from_keys(friction, load: float) -> Iwan:
    """Return the Iwan law defined by a [friction] table, for a load N [N] on the whole contact.

    The stiffness [N/m] of the table is that under this load.
    """
    return Iwan(friction.static, friction.stiffness / load, friction.chi, friction.beta)
