"""Worn depth over one jump of many cycles, solved together with the contact pressure.

Archard: a point that slides the path s per cycle under the nodal force f on its area A wears by kappa s f/A per cycle.
Wear takes pressure away from where it goes fast, in a time that falls with the cell length, so an explicit step longer
than `critical_jump` lifts every second node off. Implicit steps solve the contact with its compliance C replaced by
C + diag(rate cycles): the same complementarity problem, better conditioned, stable at any length.
"""

from collections.abc import Callable
from math import ceil

import numpy as np

from ..core import PatchfemError

GAMMA = 1 - np.sqrt(0.5)  # of the L-stable second-order method of two stages; both weights are above zero


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


def explicit_jump(press: Callable, depth, rate, cycles: float) -> tuple:
    """Worn depth (m,) [m] and contact forces (m,) [N] after one explicit Euler step over `cycles`; see `jump`."""
    depth = depth + cycles * rate * press(depth, np.zeros_like(rate))
    return depth, press(depth, np.zeros_like(rate))


def critical_jump(compliance, rate, active, held: str = "load", places=None) -> float:
    """Longest stable explicit jump [cycles]: 2 over the fastest rate at which the pressure evens itself out.

    compliance (m, m) [m/N]; rate (m,) [m/N] of `rates`; active (m,) bool: nodes in contact; held: "load", "moment"
    (load and moment are given, which wants places (m,) [m]) or "approach". inf where nothing wears.
    """
    chosen = np.flatnonzero(np.asarray(active) & (np.asarray(rate) > 0))
    touching = np.flatnonzero(active)
    if not chosen.size:
        return np.inf
    stiff = np.linalg.inv(compliance[np.ix_(touching, touching)])
    if held != "approach":
        rigid = np.ones((touching.size, 1))
        if held == "moment":
            rigid = np.column_stack([rigid, np.asarray(places)[touching]])
        push = stiff @ rigid
        stiff = stiff - push @ np.linalg.solve(rigid.T @ push, push.T)
    root = np.sqrt(np.asarray(rate)[touching])
    fastest = np.linalg.eigvalsh(root[:, None] * stiff * root[None, :])[-1]
    return float(2 / fastest) if fastest > 0 else np.inf


def refuse_explicit(cycles: float, critical: float) -> None:
    """Raise PatchfemError for an explicit jump [cycles] longer than the critical one, with the remedy."""
    if cycles > critical:
        raise PatchfemError(f"a jump of {cycles:.4g} cycles by the explicit scheme is longer than the stability "
                            f"limit of {critical:.4g} cycles, beyond which every second node lifts off; leave "
                            f"wear.scheme out, or take at least {ceil(cycles / critical)} times as many wear.jumps",
                            "wear.scheme")
