"""Worn depth after one jump over many cycles, solved together with the contact pressure.

Archard's law: a node that slips over the path s per cycle under the force f on its area A wears by kappa s f/A per cycle.
Where a node wears fast it loses pressure, within a time that falls with the length of a cell. A long explicit step would
therefore lift off every second node. An implicit step solves the contact problem with its compliance C replaced by
C + diag(rate cycles). This is the same complementarity problem, better conditioned, and stable at any length.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

# `press(worn, softening)` returns the contact forces (m,) [N] of the pieces with the depth `worn` (m,) [m] added to
# their gap and `softening` (m,) [m/N] to the diagonal of their compliance
Press = Callable[[np.ndarray, np.ndarray], np.ndarray]
# Coefficient of the L-stable method of two stages; both of its weights are positive
STAGE_COEFFICIENT = 1 - np.sqrt(0.5)


class JumpEnd(NamedTuple):
    """State at the end of a jump over cycles.

    - depth: (m,) worn depth [m]
    - force: (m,) contact forces [N]
    """

    depth: np.ndarray
    force: np.ndarray


def wear_rates(coefficient: float, path, area) -> np.ndarray:
    """Return the worn depth per force and cycle at the nodes of an interface.

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


def solve_jump(press: Press, depth, rate, cycles: float) -> JumpEnd:
    """Return the worn depth and the contact forces after a jump over many cycles.

    The method is the singly diagonally implicit Runge-Kutta method of two stages and order two (Alexander, SIAM J.
    Numer. Anal. 14, 1006, 1977). The worn volume is the sum of rate times cycles times area times force over the nodes,
    to round-off.

    Parameters
    ----------
    press : callable
        Contact forces of the worn pieces (`Press`).
    depth : (m,) array
        Worn depth [m] at the start of the jump.
    rate : (m,) array
        Rates [m/N] of `wear_rates`, constant in the jump.
    cycles : float
        Length of the jump.

    Returns
    -------
    JumpEnd
    """
    softening = STAGE_COEFFICIENT * cycles * rate
    first = cycles * rate * press(depth, softening)
    force = press(depth + (1 - STAGE_COEFFICIENT) * first, softening)
    return JumpEnd(depth + (1 - STAGE_COEFFICIENT) * first + softening * force, force)
