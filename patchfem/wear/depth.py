"""Worn depth over one jump of many cycles, solved together with the contact pressure.

Archard: a point that slides the path s per cycle under the nodal force f on its area A wears by kappa s f/A per cycle.
Wear takes pressure away from where it goes fast, in a time that falls with the cell length, so a long explicit
step lifts every second node off. Implicit steps solve the contact with its compliance C replaced by
C + diag(rate cycles): the same complementarity problem, better conditioned, stable at any length.
"""

from collections.abc import Callable

import numpy as np

# of the L-stable second-order method of two stages; both weights are above zero
GAMMA = 1 - np.sqrt(0.5)


def rates(coefficient: float, path, area) -> np.ndarray:
    """Depth per force and cycle (m,) [m/N] at the nodes of an interface.

    coefficient [m2/N]: volume worn per load and slip path; path (m,) [m]: slip path of one cycle; area (m,) [m2].
    """
    return coefficient * np.asarray(path) / area


def jump(press: Callable, depth, rate, cycles: float) -> tuple:
    """Worn depth (m,) [m] and contact forces (m,) [N] after a jump over `cycles`, by an implicit method of order two.

    press(worn (m,) [m], softening (m,) [m/N]) -> contact forces (m,) [N] of the pieces with `worn` added to their gap
    and `softening` to the diagonal of their compliance; depth (m,) [m]: at the start of the jump; rate (m,) [m/N]: of
    `rates`, held through the jump. The worn volume is the sum of rate cycles area times the load, to round-off.
    Alexander, SIAM J. Numer. Anal. 14 (1977) 1006: the singly diagonal Runge-Kutta method of two stages.
    """
    soft = GAMMA * cycles * rate
    first = cycles * rate * press(depth, soft)
    force = press(depth + (1 - GAMMA) * first, soft)
    return depth + (1 - GAMMA) * first + soft * force, force
