"""Segalman's four-parameter Iwan model of parallel sliders (J. Appl. Mech. 72, 752, 2005).

Sliders of unit stiffness that yield at a stretch phi are spread with the density

    rho(phi) = R phi^chi (0 <= phi < phi_max) + S delta(phi - phi_max)

so that the slip force F_S = int phi rho, the stiffness K_T = int rho, the exponent chi of the micro-slip and beta = S
phi_max^-(chi + 1) (chi + 1)/R, the share of the last slider, determine all four. A small cycle of amplitude u loses
4 R u^(chi + 3)/((chi + 2)(chi + 3)).
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from ...core import frozen_array
from ..protocol import Element
from .elastic_plastic import parallel_element

N_CELLS = 768  # number of cells of the power law, each a Jenkins element; the forces are exact to 1e-6 of the slip force
MIN_CELL_RATIO = 1e-5  # fraction of phi_max of the smallest slider that has a separate cell
LOG_CELL_FRACTION = (
    0.25  # fraction of the cells that are spread evenly over the decades, for small cycles
)


@dataclass(frozen=True, eq=False, slots=True)
class Iwan:
    """Parallel elements of a contact per newton of normal load.

    - stiffness (t,): [1/m]
    - yield_displacement (t,): yield displacement [m]

    All points of a contact have the same relative displacement and the same stretches.
    """

    stiffness: np.ndarray
    yield_displacement: np.ndarray

    def element(self, load: float) -> Element:
        """Return the Element under a constant load [N]: the parallel elements of `elastic_plastic`."""
        return parallel_element(self.stiffness * load, self.yield_displacement)


def max_yield_displacement(force: float, stiffness: float, chi: float, beta: float) -> float:
    """Return phi_max [m], the displacement from which on every slider slips.

    force: slip force F_S [N]; stiffness: K_T [N/m].

    phi_max = F_S (1 + beta)/(K_T (beta + (chi + 1)/(chi + 2))), with -1 < chi the exponent and beta >= 0 the fraction
    of the last slider (Segalman 2005).
    """
    return force * (1 + beta) / (stiffness * (beta + (chi + 1) / (chi + 2)))


def slider_cells(force: float, stiffness: float, chi: float, beta: float) -> tuple:
    """Return stiffness [N/m] and yield displacement [m] of the sliders, each (t,).

    The cells of the power law come first, then the last slider.

    Each cell keeps the stiffness and the slip force of its part of the density, so those of all are exact, as is the
    force of a first loading at every border of a cell. The cells are as narrow as the root of the density asks for, the
    best for a given number of straight pieces.
    """
    k, most = _unit_sliders(chi, beta)
    return stiffness * k, max_yield_displacement(force, stiffness, chi, beta) * most


@lru_cache(32)
def _unit_sliders(chi: float, beta: float) -> tuple:
    """Return the `slider_cells` of unit stiffness and unit phi_max, shared by a sweep of both."""
    low, power = np.log(MIN_CELL_RATIO), 1 / (1 + beta)  # the power law without the last slider
    x = np.concatenate([[0.0], np.exp(np.linspace(low, 0.0, 20 * N_CELLS + 1))])
    share = (1 - LOG_CELL_FRACTION) * x ** (1 + chi / 2) + LOG_CELL_FRACTION * np.clip(
        1 - np.log(np.maximum(x, MIN_CELL_RATIO)) / low, 0.0, 1.0
    )
    edges = np.interp(np.linspace(0.0, 1.0, N_CELLS + 1), share, x)
    k = power * np.diff(edges ** (chi + 1))
    moment = power * (chi + 1) / (chi + 2) * np.diff(edges ** (chi + 2))
    last = [1 - power] if beta > 0 else []
    return frozen_array(np.append(k, last)), frozen_array(
        np.append(moment / k, [1.0] if last else [])
    )


def from_keys(friction, load: float) -> Iwan:
    """Return the Iwan law of a [friction] table under a load [N] of the whole contact.

    The stiffness [N/m] of the table refers to this load; a load of 0 counts as 1 N.
    """
    k, most = slider_cells(
        friction.static, friction.stiffness / (load or 1.0), friction.chi, friction.beta
    )
    return Iwan(k, most)


def loop_from_keys(friction, load: float, slide) -> tuple:
    """Return the force at the reversals [N] and the area [J] of steady loops of the Iwan law.

    slide: displacement amplitudes [m] of any shape. The loops have no cells: they are the curve of first loading
    (Segalman's eq. 22), doubled by Masing's rule.
    """
    chi, force = friction.chi, friction.static * load
    most = max_yield_displacement(force, friction.stiffness, chi, friction.beta)
    scale, r = force / (friction.beta + (chi + 1) / (chi + 2)), np.minimum(slide / most, 1.0)
    tip = scale * ((friction.beta + 1) * r - r ** (chi + 2) / (chi + 2))
    under = (
        scale * most * ((friction.beta + 1) * r**2 / 2 - r ** (chi + 3) / ((chi + 2) * (chi + 3)))
    )
    return tip, 8 * (under + force * np.maximum(slide - most, 0.0)) - 4 * slide * tip
