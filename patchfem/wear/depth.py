"""Worn depth over one jump of many cycles, solved together with the contact pressure.

Archard's law: a point that slides the path s per cycle under the nodal force f on its area A wears by kappa s f/A per
cycle. Wear takes pressure away from where it is fast, in a time that falls with the length of a cell, so a long
explicit step lifts every second node off. An implicit step solves the contact with its compliance C replaced by
C + diag(rate cycles): the same complementarity problem, better conditioned and stable at any length.
"""

from collections.abc import Callable

import numpy as np

GAMMA = 1 - np.sqrt(
    0.5
)  # coefficient of the L-stable two-stage method; both of its weights are positive


def wear_rates(coefficient: float, path, area) -> np.ndarray:
    """Return the depth per force and cycle at the nodes of an interface.

    Parameters
    ----------
    coefficient : float
        Worn volume per load and slip path [m2/N].
    path, area : (m,) array
        Slip path of one cycle [m] and areas [m2] of the nodes.

    Returns
    -------
    (m,) array
        Rates [m/N].
    """
    return coefficient * np.asarray(path) / area


def solve_jump(press: Callable, depth, rate, cycles: float) -> tuple:
    """Solve a jump over many cycles by an implicit method of order two.

    The method is the singly diagonal Runge-Kutta method of two stages (Alexander, SIAM J. Numer. Anal. 14, 1006, 1977).
    The worn volume is the sum of rate cycles area times the load, to round-off.

    Parameters
    ----------
    press : callable
        `press(worn, softening)` returns the contact forces (m,) [N] of the pieces with the depth `worn` (m,) [m] added
        to their gap and `softening` (m,) [m/N] to the diagonal of their compliance.
    depth : (m,) array
        Worn depth [m] at the start of the jump.
    rate : (m,) array
        Rates [m/N] of `wear_rates`, constant in the jump.
    cycles : float
        Length of the jump.

    Returns
    -------
    depth, force : (m,) array
        Worn depth [m] and contact forces [N] at the end of the jump.
    """
    softening = GAMMA * cycles * rate
    first = cycles * rate * press(depth, softening)
    force = press(depth + (1 - GAMMA) * first, softening)
    return depth + (1 - GAMMA) * first + softening * force, force
