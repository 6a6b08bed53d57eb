"""Static contact of a patch, which a rigid holder presses.

The motion q = (delta, -theta) of the holder, or as much of it as is free, closes a node at x by R q with R = (1, x).

Asperities form a compliant layer with the local law P(s) in series with the pieces: a node of area A_i carries
f_i = A_i P(s_i) at the separation s_i = g_i + theta x_i - delta + (C f)_i of the mean planes. P >= 0 decreases with s,
so the solution is unique for every law, gap and control. A linear law adds 1/(k A_i) to the diagonal of C, and bare
contact follows (`unilateral.solve`); `asperity_layer` solves the other laws.
"""

from dataclasses import replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..core import Compliance, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import use_one_blas_thread
from ..formatting import format_length
from . import asperity_laws
from .unilateral import (
    CONTACT_RESIDUAL_TOL,
    ContactProblem,
    ContactSolution,
    compute_residuals,
    make_problem,
    refuse_residuals,
    solve,
)

# Largest relative residual with a smooth asperity law; rounding errors of steep laws stay below it
SMOOTH_LAW_RESIDUAL_TOL = 1e-9
# Smallest load [N] or overlap [m] for which the products in the check of the solution do not underflow
MIN_COMPUTABLE_LOAD = 1e-200


class Holder(NamedTuple):
    """Loads and prescribed motions of the rigid holder.

    - load: Normal load [N]; None under a prescribed approach.
    - approach: Approach [m] in place of a load, at a prescribed rotation.
    - moment: Moment sum f x [N m] of a free rotation, or None if the rotation is prescribed.
    - spring: Stiffness [N m/rad] against the rotation, unloaded at `rotation`.
    - rotation: Rotation [rad] that the gap already contains.
    """

    load: float | None = None
    approach: float | None = None
    moment: float | None = None
    spring: float = 0.0
    rotation: float = 0.0


class PatchState(NamedTuple):
    """Contact state of a patch of m nodes.

    - force (m,): Nodal forces [N] >= 0.
    - gap (m,): Gap under load [m]; with a smooth asperity law the separation of the mean planes, negative where
      the layer is compressed.
    - layer_stiffness (m,): Stiffness of a smooth asperity layer [Pa/m]; None without such a layer.
    - approach, rotation: Approach [m] and rotation [rad] of the holder.
    - residuals: Relative residuals of the independent check, by name; none without contact.
    - n_iterations: Number of contact sets or Newton steps.
    """

    force: np.ndarray
    gap: np.ndarray
    layer_stiffness: np.ndarray | None
    approach: float
    rotation: float
    residuals: MappingProxyType = MappingProxyType({})
    n_iterations: int = 0

    @property
    def load(self) -> float:
        """Normal load [N]."""
        return float(self.force.sum())

    @property
    def outcome(self) -> Outcome:
        """Whether the pieces touch."""
        return Outcome.DONE if self.load > 0 else Outcome.NO_CONTACT


def press_patch(
    pieces: Compliance,
    gap: np.ndarray,
    holder: Holder,
    asperities: "asperity_laws.LinearAsperities | asperity_laws.SmoothAsperities | None" = None,
    start: np.ndarray | None = None,
) -> PatchState:
    """Solve the contact of a patch that a holder presses.

    The nodal forces f >= 0 and the openings w = g - R q + C f >= 0 satisfy f . w = 0 and balance the loads of the holder.
    The residuals of every solution are computed anew, without any intermediate result of the solver. If nothing
    touches, the outcome is no_contact.

    Parameters
    ----------
    pieces : Compliance
        Compliance of the pieces at the m nodes, without asperities; that of rigid pieces, 0, needs asperities.
    gap : (m,) ndarray
        Gap [m] with the prescribed rotation.
    holder : Holder
        Loads and prescribed motions.
    asperities : LinearAsperities, ExponentialAsperities or HertzAsperities, optional
        Pressure law of the asperities; None if the pieces are bare.
    start : (m,) bool ndarray, optional
        Nodes in contact of a similar state, from which the search for the contact set starts.

    Returns
    -------
    PatchState

    Raises
    ------
    PatchfemError
        For a load below zero or too small, a moment that no pressure can carry, or values that are not finite.
    NotConverged
        If a residual exceeds 1e-12, with a smooth asperity law 1e-9.
    """
    is_smooth = asperities is not None and asperities.is_smooth
    x = pieces.interface.x
    _refuse_unsolvable(x, gap, holder)
    if holder.load == 0:
        no_force = frozen_array(np.zeros(x.size))
        opening = frozen_array(gap - gap.min())
        stiffness = no_force if is_smooth else None
        return PatchState(no_force, opening, stiffness, float(gap.min()), holder.rotation)

    # A gap that is measured from a point near the contact loses no digits to a large offset.
    reference = holder.approach or 0.0
    if holder.approach is None and not is_smooth:
        reference = float(gap.min())
    problem = make_problem(x, gap - reference, holder.load, holder.moment, holder.spring)

    # A linear layer is a compliance in series with the pieces; smooth laws need Newton's method
    with use_one_blas_thread():
        if is_smooth:
            state = _press_smooth_layer(pieces, problem, asperities)
        else:
            compliance = pieces.normal
            if asperities is not None:
                compliance = compliance + np.diag(1 / (asperities.k * pieces.interface.weight))
            state = _press_bare(compliance, problem, start)

    # The motion is measured from the gap that was given
    return state._replace(
        approach=reference + state.approach, rotation=holder.rotation + state.rotation
    )


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
        Its motion is that of the problem.
    """
    from . import asperity_layer

    # An exponential law without a reference takes the mean pressure of the load (`ExponentialAsperities`)
    area = pieces.interface.weight
    if asperities.needs_load:
        asperities = replace(asperities, reference=problem.target[0] / area.sum())
    layer = asperity_layer.AsperityProblem(asperities, pieces.normal, area, problem)
    solution = asperity_layer.press_with_asperities(layer)
    residuals = asperity_layer.compute_law_residuals(layer, solution)
    remedy = "; make the rough layer softer (raise the decay length or the height deviation), or leave the layer out"
    refuse_residuals(residuals, SMOOTH_LAW_RESIDUAL_TOL, "contact.asperities", remedy)
    stiffness = asperities.stiffness(solution.separation) * (solution.force > 0)
    return _make_state(solution, solution.separation, residuals, stiffness)


def _press_bare(compliance: np.ndarray, problem: ContactProblem, start) -> PatchState:
    """Solve a patch that has no asperity layer, or a linear one that the compliance contains.

    Parameters
    ----------
    compliance : (m, m) ndarray
        Compliance [m/N] of the nodes.
    problem : ContactProblem
        Gap [m], motions and loads of the m nodes.
    start : (m,) bool ndarray or None
        Guess of the nodes in contact.

    Returns
    -------
    PatchState
        Its motion is that of the problem.

    Raises
    ------
    NotConverged
        With a remedy, if the contact set does not determine the motion or a residual is too large.
    """
    if not problem.target.size and problem.gap.min() >= 0:
        solution = ContactSolution(np.zeros(problem.gap.size), np.zeros(0), 0)
    else:
        solution = solve(compliance, problem, start)
    residuals = compute_residuals(compliance, problem, solution)
    refuse_residuals(residuals, CONTACT_RESIDUAL_TOL)
    opening = problem.gap - problem.motions @ solution.motion + compliance @ solution.force
    opening = np.where(solution.force > 0, 0.0, np.maximum(opening, 0.0))
    return _make_state(solution, opening, residuals)


def _make_state(
    solution, opening: np.ndarray, residuals: dict[str, float], stiffness: np.ndarray | None = None
) -> PatchState:
    """Return the state of a patch from its solution.

    Parameters
    ----------
    solution : ContactSolution or AsperitySolution
        Forces (m,) [N] and motion (r,) of the free motions.
    opening : (m,) ndarray
        Gap under load [m].
    residuals : dict of float
        Residuals of the solution by name.
    stiffness : (m,) ndarray, optional
        Stiffness of a smooth asperity layer [Pa/m].
    """
    motion = np.zeros(2)
    motion[: solution.motion.size] = solution.motion
    return PatchState(
        frozen_array(solution.force),
        frozen_array(opening),
        stiffness if stiffness is None else frozen_array(stiffness),
        approach=float(motion[0]),
        rotation=-float(motion[1]),
        residuals=MappingProxyType(residuals),
        n_iterations=solution.n_iterations,
    )


def _refuse_unsolvable(x: np.ndarray, gap: np.ndarray, holder: Holder) -> None:
    """Raise PatchfemError for loads and approaches that numbers cannot represent, and for pieces that tip over.

    `gap` (m,) [m] is that of the nodes at `x` (m,) [m] without load, and `holder` has the loads and prescribed motions. The
    load line of a free rotation lies at x = moment/load.
    """
    load = holder.load
    if load is None:
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
    if load and holder.moment is not None and not holder.spring:
        load_line = holder.moment / load
        half_length = np.ptp(x) / 2 * (1 - 1e-13)
        if not abs(load_line - (x[0] + x[-1]) / 2) < half_length:
            raise PatchfemError(
                f"contact.load_line: the load line lies {load_line:.6g} m from the middle, outside the half length "
                f"{half_length:.6g} m: the piece tips over"
            )
