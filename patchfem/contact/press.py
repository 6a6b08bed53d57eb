"""Static contact of a patch, which a rigid holder presses.

The motion q = (delta, -theta) of the holder, or as much of it as is free, closes a node at x by R q with R = (1, x).

Asperities form a compliant layer with the local law P(s) in series with the pieces: a node of area A_i carries
f_i = A_i P(s_i) at the separation s_i = g_i + theta x_i - delta + (C f)_i of the mean planes. P >= 0 decreases with s,
so the solution is unique for every law, gap and control. A linear law, which carries nothing beyond s = 0, adds 1/(k A_i)
to the diagonal of C and is solved like bare pieces (`unilateral.solve`); `asperity_layer` solves the smooth laws.
"""

from typing import NamedTuple

import numpy as np

from ..core import Compliance, PatchfemError
from ..elasticity.lapack import use_one_blas_thread
from ..formatting import format_length
from . import asperity_laws
from .press_cases import MIN_COMPUTABLE_LOAD, Holders
from .unilateral import (
    ContactProblem,
    ContactSolution,
    make_problem,
    refuse_residuals,
    solve,
)

# Largest relative residual with a smooth asperity law; rounding errors of steep laws stay below it
SMOOTH_LAW_RESIDUAL_TOL = 1e-9


class PatchState(NamedTuple):
    """Contact state of a patch of m nodes.

    - force (m,): Nodal forces [N] >= 0.
    - gap (m,): Gap under load [m]; with a smooth asperity law the separation of the mean planes, negative where
      the layer is compressed.
    - approach, turn: Approach [m], and rotation [rad] that the given gap does not contain.
    - layer_stiffness (m,): Stiffness of a smooth asperity layer [Pa/m]; None without such a layer.
    """

    force: np.ndarray
    gap: np.ndarray
    approach: float
    turn: float
    layer_stiffness: np.ndarray | None = None


def press_patch(
    pieces: Compliance,
    gap: np.ndarray,
    holder: Holders,
    asperities: "asperity_laws.SmoothAsperities | None" = None,
    start: np.ndarray | None = None,
) -> PatchState:
    """Solve the contact of a patch that a holder presses.

    The nodal forces f >= 0 and the openings w = g - R q + C f >= 0 satisfy f . w = 0 and balance the loads of the holder.
    The residuals of every solution are computed anew, without any intermediate result of the solver.

    Parameters
    ----------
    pieces : Compliance
        Compliance of the pieces at the m nodes, with a linear layer of asperities; that of rigid pieces, 0, needs a law.
    gap : (m,) ndarray
        Gap [m] with the prescribed rotation.
    holder : Holders
        Loads and prescribed motions, as numbers.
    asperities : ExponentialAsperities or HertzAsperities, optional
        Smooth pressure law of the asperities.
    start : (m,) bool ndarray, optional
        Nodes in contact of a similar state, from which the search for the contact set starts.

    Returns
    -------
    PatchState
        All forces are 0 if nothing touches.

    Raises
    ------
    PatchfemError
        For a load below zero or too small, a moment that no pressure can carry, or values that are not finite.
    NotConverged
        If a residual exceeds 1e-12, with a smooth asperity law 1e-9.
    """
    x = pieces.interface.x
    _refuse_unsolvable(x, gap, holder)
    touching = float(gap.min())
    if holder.load == 0:
        no_force = np.zeros(x.size)
        return PatchState(no_force, gap - touching, touching, 0.0, asperities and no_force)

    # A gap that is measured from a point near the contact loses no digits to a large offset.
    reference = 0.0 if asperities else touching
    if np.isnan(holder.load):
        reference = holder.approach
    problem = make_problem(x, gap - reference, holder)

    with use_one_blas_thread():
        if asperities:
            state = _press_smooth_layer(pieces, problem, asperities)
        else:
            state = _press_bare(pieces.normal, problem, start)
    return state._replace(approach=float(reference + state.approach))


def _press_smooth_layer(pieces: Compliance, problem: ContactProblem, asperities) -> PatchState:
    """Solve a patch with an asperity layer of a smooth law.

    Parameters
    ----------
    pieces : Compliance
        Compliance of the pieces without the layer.
    problem : ContactProblem
        Gap [m], motions and loads of the m nodes.
    asperities : ExponentialAsperities or HertzAsperities
        Pressure law of the layer.

    Returns
    -------
    PatchState
        Its approach is that of the problem.
    """
    from . import asperity_layer

    area = pieces.interface.weight
    layer = asperity_layer.AsperityProblem(asperities, pieces.normal, area, problem)
    solution = asperity_layer.press_with_asperities(layer)
    residuals = asperity_layer.compute_law_residuals(layer, solution)
    remedy = "; make the rough layer softer (raise the decay length or the height deviation), or leave the layer out"
    refuse_residuals(residuals, SMOOTH_LAW_RESIDUAL_TOL, "contact.asperities", remedy)
    stiffness = asperities.stiffness(solution.separation) * (solution.force > 0)
    approach, turn = _read_motion(solution.motion)
    return PatchState(solution.force, solution.separation, approach, turn, stiffness)


def _press_bare(compliance: np.ndarray, problem: ContactProblem, start) -> PatchState:
    """Solve a patch without a smooth asperity layer.

    Parameters
    ----------
    compliance : (m, m) ndarray
        Compliance [m/N] of the nodes.
    problem : ContactProblem
        Gap [m], motions and loads of the m nodes.
    start : (m,) bool ndarray or None
        First contact set of the search.

    Returns
    -------
    PatchState
        Its approach is that of the problem.
    """
    solution = ContactSolution(np.zeros(problem.gap.size), np.zeros(0))
    if problem.target.size or problem.gap.min() < 0:
        solution = solve(compliance, problem, start)
    opening = problem.gap - problem.motions @ solution.motion + compliance @ solution.force
    opening = np.where(solution.force > 0, 0.0, np.maximum(opening, 0.0))
    return PatchState(solution.force, opening, *_read_motion(solution.motion))


def _read_motion(motion: np.ndarray) -> tuple[float, float]:
    """Return approach [m] and rotation [rad] of the free motions (r,) of a holder; 0 for a prescribed one."""
    approach, rotation = np.append(motion, [0.0, 0.0])[:2].tolist()
    return approach, -rotation


def _refuse_unsolvable(x: np.ndarray, gap: np.ndarray, holder: Holders) -> None:
    """Raise PatchfemError for loads and approaches that numbers cannot represent, and for pieces that tip over.

    `gap` (m,) [m] is that of the nodes at `x` (m,) [m] without load, and `holder` has the loads and prescribed motions. The
    load line of a free rotation lies at x = moment/load.
    """
    load = holder.load
    if np.isnan(load) and not np.isnan(holder.approach):
        overlap = holder.approach - gap.min()
        if 0 < overlap < MIN_COMPUTABLE_LOAD:
            raise PatchfemError(
                f"contact.approach: an overlap of {format_length(overlap, 3)} is too small to compute with; for "
                f"pieces that touch without load give {gap.min():.6g} m"
            )
        return
    if not (load == 0 or MIN_COMPUTABLE_LOAD <= load <= 1 / MIN_COMPUTABLE_LOAD):
        raise PatchfemError(
            f"contact.load: {load:.3g} N cannot be computed with; give 0 (touching without load) or a load > 0 of at "
            f"least {MIN_COMPUTABLE_LOAD:.0e} N"
        )

    # A free rotation tips over if the load line lies outside the pieces.
    if load and not (np.isnan(holder.moment) or holder.spring):
        load_line = holder.moment / load
        half_length = np.ptp(x) / 2 * (1 - 1e-13)
        if not abs(load_line - (x[0] + x[-1]) / 2) < half_length:
            raise PatchfemError(
                f"contact.load_line: the load line lies {load_line:.6g} m from the middle, outside the half length "
                f"{half_length:.6g} m: the piece tips over"
            )
