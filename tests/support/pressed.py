"""Single patches pressed by a holder, as records of nodal stresses."""

from typing import NamedTuple

import numpy as np

from patchfem.contact import Holder, press_patch
from patchfem.contact.unilateral import make_problem, solve
from patchfem.core import Compliance, Outcome


class PressedPatch(NamedTuple):
    """Pressed patch: pressures (m,) [Pa], gap (m,) [m], motion and loads of the holder, and the check of the solution."""

    sigma_n: np.ndarray
    gap: np.ndarray
    approach: float
    rotation: float
    load: float
    moment: float
    outcome: Outcome
    iterations: int
    residuals: dict


def press_by_holder(pieces: Compliance, gap, holder: Holder) -> PressedPatch:
    """Press two bare pieces by a holder."""
    state = press_patch(pieces, gap, holder)
    return PressedPatch(
        state.force / pieces.interface.weight,
        state.gap,
        state.approach,
        state.rotation,
        state.load,
        float(state.force @ pieces.interface.x),
        state.outcome,
        state.n_iterations,
        state.residuals,
    )


def press(pieces, gap, load, moment=None, rotation=0.0, spring=0.0) -> PressedPatch:
    """Press two bare pieces under a load, and a moment about a free rotation."""
    holder = Holder(load, moment=moment, rotation=rotation, spring=spring)
    return press_by_holder(pieces, gap, holder)


def press_to_approach(pieces, gap, approach) -> PressedPatch:
    """Press two bare pieces to a prescribed approach."""
    return press_by_holder(pieces, gap, Holder(approach=approach))


class PlainSolution(NamedTuple):
    """Contact solution of a patch as NumPy arrays, with the number of iterations."""

    force: np.ndarray
    motion: np.ndarray
    n_iterations: int


def solve_forces(c, x, gap, target) -> PlainSolution:
    """Solve the contact problem of a patch that is given as NumPy arrays.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance [m/N].
    x, gap : (m,) ndarray
        Positions [m] and gap [m].
    target : (0,), (1,) or (2,) ndarray
        Nothing with the approach contained in the gap, load [N], or load and moment [N m].

    Returns
    -------
    PlainSolution
    """
    touch_approach = gap.min() if target.size else 0.0
    problem = make_problem(x, gap - touch_approach, *map(float, target))
    solution = solve(c, problem)
    solution.motion[:1] += touch_approach
    return PlainSolution(solution.force, solution.motion, solution.n_iterations)
