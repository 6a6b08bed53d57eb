"""Static contact of strips side by side, which one rigid holder presses; a patch is one strip.

Strip j, at y_j from the middle of the width, has the gap g(x) + roll y_j (or one of its own) and the compliance C. The
shear between strips is neglected. The motion q = (delta, -theta, -roll) of the holder, or as much of it as is free, is
common to all strips: strip j closes by R_j q with R_j = (1, x, y_j).

Asperities form a compliant layer with the local law P(s) in series with the pieces: a node of area A_i carries
f_i = A_i P(s_i) at the separation s_i = g_i + theta x_i - delta + (C f)_i of the mean planes. P >= 0 decreases with s,
so the solution is unique for every law, gap and control. A linear law adds 1/(k A_i) to the diagonal of C, and bare
contact follows (`unilateral.solve`); `asperity_layer` solves the other laws.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..core import Compliance, NotConverged, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import use_one_blas_thread
from ..formatting import format_length
from . import asperity_laws
from .active_set import ContactProblem
from .strip_compliance import StripCompliance
from .unilateral import (
    CONTACT_RESIDUAL_TOL,
    INDEFINITE_COMPLIANCE_MESSAGE,
    ContactSolution,
    compute_residuals,
    explain_singular_set,
    refuse_residuals,
    solve,
)

# Largest relative residual of strips and of smooth asperity laws; rounding errors of steep laws stay below it
STRIP_RESIDUAL_TOL = 1e-9
# Smallest force of a loaded node relative to the largest force; smaller forces are rounding errors
MIN_LOADED_FORCE_RATIO = 1e-12
# Smallest load [N] or overlap [m] for which the products in the check of the solution do not underflow
MIN_COMPUTABLE_LOAD = 1e-200
# Note on what strips neglect
NEGLECTED_SHEAR_NOTE = (
    "the shear between neighbouring strips is neglected; fields and pictures show the mean over the strips, "
    "unless their captions name strips; result.nc contains every strip"
)
# Message about a roll that the contact does not determine
LOOSE_ROLL_MESSAGE = (
    "contact.strips: the nodes that touch do not determine the rotation about x; raise "
    "contact.strips.count or prescribe contact.strips.roll"
)
# Ends of the messages about a residual, by whether the pieces have a smooth asperity layer
RESIDUAL_KEY_AND_REMEDY = {
    True: (
        "contact.asperities",
        "; make the rough layer softer (raise the decay length or the height deviation), or leave the layer out",
    ),
    False: ("contact", ""),
}


class StripLayout(NamedTuple):
    """Positions and areas of the nodes of equal strips.

    - x (m,): Positions [m] along each strip.
    - weight (m,): Nodal areas [m2] of one strip.
    - offsets (s,): Distances y [m] of the strips from the middle.
    """

    x: np.ndarray
    weight: np.ndarray
    offsets: np.ndarray


class Holder(NamedTuple):
    """Loads and prescribed motions of the rigid holder.

    - load: Normal load [N] of all strips; None under a prescribed approach.
    - approach: Approach [m] in place of a load, at prescribed rotations.
    - moment: Moment sum f x [N m] of a free rotation about y, or None if this rotation is prescribed.
    - roll_moment: Moment sum f y [N m] of a free roll about x, or None.
    - spring: Stiffness [N m/rad] against the rotation about y, unloaded at `rotation`.
    - rotation: Rotation [rad] about y that the gap already contains.
    - roll: Rotation [rad] about x, from which a free roll starts; a positive one opens the gap at +y.
    """

    load: float | None = None
    approach: float | None = None
    moment: float | None = None
    roll_moment: float | None = None
    spring: float = 0.0
    rotation: float = 0.0
    roll: float = 0.0


class HolderPosition(NamedTuple):
    """Approach delta [m] and rotations theta about y and roll about x [rad] of the holder."""

    delta: float
    theta: float
    roll: float


class StripModel(NamedTuple):
    """Model of equal strips that are pressed by one rigid holder.

    - compliance: Compliance [m/N] of the pieces at the nodes of each strip; that of rigid pieces, 0, needs asperities.
    - layout: Nodes of the strips.
    - asperities: Pressure law of the asperities (`asperity_laws`); None if the pieces are bare.
    """

    compliance: StripCompliance
    layout: StripLayout
    asperities: "asperity_laws.LinearAsperities | asperity_laws.SmoothAsperities | None" = None

    @property
    def is_smooth(self) -> bool:
        """Whether an asperity layer carries pressure at every separation."""
        return getattr(self.asperities, "is_smooth", False)


@dataclass(frozen=True, eq=False, slots=True)
class StripsState:
    """Contact state of s strips of m nodes that are pressed by one rigid holder.

    - force (s, m): Nodal forces [N] >= 0.
    - gap (s, m): Gap under load [m]; with a smooth asperity law the separation of the mean planes, negative where
      the layer is compressed.
    - stiffness (s, m): Stiffness of the asperity layer [Pa/m], None without asperities.
    - layout: Nodes of the strips.
    - position: Approach and rotations of the holder.
    - residuals: Relative residuals of the independent check.
    - iterations: Number of contact sets or Newton steps.
    """

    force: np.ndarray
    gap: np.ndarray
    stiffness: np.ndarray | None
    layout: StripLayout
    position: HolderPosition
    residuals: MappingProxyType
    iterations: int

    @property
    def pressure(self) -> np.ndarray:
        """Pressure (s, m) [Pa]."""
        return frozen_array(self.force / self.layout.weight)

    @property
    def offsets(self) -> np.ndarray:
        """Transverse positions y (s,) [m] of the strips."""
        return self.layout.offsets

    @property
    def outcome(self) -> Outcome:
        """Whether the pieces touch."""
        return Outcome.DONE if self.load > 0 else Outcome.NO_CONTACT

    @property
    def load(self) -> float:
        """Normal load [N]."""
        return float(self.force.sum())

    @property
    def moment(self) -> float:
        """Moment sum f x [N m]."""
        return float((self.force @ self.layout.x).sum())

    @property
    def roll_moment(self) -> float:
        """Moment sum f y [N m]."""
        return float(self.force.sum(axis=1) @ self.offsets)

    @property
    def centre_y(self) -> float:
        """Transverse position [m] of the resultant of the pressure, or 0 if there is no load."""
        return self.roll_moment / self.load if self.load else 0.0


class StripProperties(NamedTuple):
    """Properties of one strip with m nodes.

    - normal, tangential (m, m): normal and shear compliance [m/N].
    - weight (m,): nodal areas [m2].
    """

    normal: np.ndarray
    tangential: np.ndarray
    weight: np.ndarray


def split_into_strips(pieces: Compliance, count: int) -> StripProperties:
    """Return compliance [m/N] and nodal areas [m2] of one of `count` equal strips of a patch.

    `pieces` are those of the whole width. A strip is `count` times as compliant and has 1/`count` of the area.
    """
    normal = pieces.normal
    tangential = pieces.tangential
    # A copy of a large matrix takes as long as the solution of a case of a sweep.
    if count > 1:
        normal = normal * count
        tangential = tangential * count
    return StripProperties(normal, tangential, pieces.interface.weight / count)


def press_strips(strips: StripModel, gap, holder: Holder, start=None) -> StripsState:
    """Solve the contact of strips that one holder presses.

    The nodal forces f >= 0 and the openings w = g - R q + C f >= 0 satisfy f . w = 0 and balance the loads of the holder.
    The residuals of every solution are computed anew, without any intermediate result of the solver. If nothing
    touches, the outcome is no_contact.

    Parameters
    ----------
    strips : StripModel
        Compliance, nodes and pressure law.
    gap : (m,) or (s, m) ndarray
        Gap [m] with the prescribed rotation about y.
    holder : Holder
        Loads and prescribed motions.
    start : (s, m) bool ndarray, optional
        Nodes in contact of a similar state, from which the search for the contact set starts.

    Returns
    -------
    StripsState

    Raises
    ------
    PatchfemError
        For a load below zero or too small, a moment that no pressure can carry, values that are not finite, or an
        exponential law without reference under an approach.
    NotConverged
        If a residual exceeds 1e-12 (one strip that is bare or has a linear layer) or 1e-9.
    """
    compliance, layout, asperities = strips
    offsets = layout.offsets
    gap = np.broadcast_to(gap, (offsets.size, layout.x.size)) + holder.roll * offsets[:, None]
    _refuse_unsolvable(strips, gap, holder)
    if holder.load == 0:
        closed = gap.min(keepdims=True).ravel()
        return _make_state(strips, np.zeros(gap.shape), gap - closed, closed, holder)

    # An exponential law without a reference takes the mean pressure of the load (`ExponentialAsperities`)
    if strips.is_smooth and asperities.needs_load:
        mean_pressure = holder.load / (layout.weight.sum() * offsets.size)
        asperities = replace(asperities, reference=mean_pressure)
        strips = strips._replace(asperities=asperities)

    # A gap that is measured from a point near the contact loses no digits to a large offset.
    reference = holder.approach or 0.0
    if holder.approach is None and not strips.is_smooth:
        reference = float(gap.min())
    problem = _holder_problem(layout, gap - reference, holder)

    # A linear layer is a compliance in series with the pieces; smooth laws need Newton's method
    with use_one_blas_thread():
        if strips.is_smooth:
            from .asperity_layer import press_with_asperities

            solution, residuals = press_with_asperities(strips, problem)
            opening = solution.separation
        else:
            if asperities is not None:
                compliance = compliance.add_to_diagonal(1 / (asperities.k * layout.weight))
            solution = _press_bare(compliance, problem, start)
            opening = problem.gap - problem.motions @ solution.motion
            opening = opening + compliance.product(solution.force)
            residuals = compute_residuals(compliance, problem, solution)
            opening = np.where(solution.force > 0, 0.0, np.maximum(opening, 0.0))

    # A solution with large residuals is refused, and one whose nodes in contact leave a rotation undetermined
    is_strict = offsets.size == 1 and not strips.is_smooth
    place, remedy = RESIDUAL_KEY_AND_REMEDY[strips.is_smooth]
    tolerance = CONTACT_RESIDUAL_TOL if is_strict else STRIP_RESIDUAL_TOL
    refuse_residuals(residuals, tolerance, place, remedy)
    force = solution.force.reshape(gap.shape)
    if offsets.size > 1 and not strips.is_smooth:
        _refuse_loose_holder(force, holder)

    # The approach is measured from the gap that was given
    motion = np.zeros(max(1, solution.motion.size))
    motion[: solution.motion.size] = solution.motion
    motion[0] += reference
    opening = opening.reshape(gap.shape)
    return _make_state(
        strips, force, opening, motion, holder, solution.n_iterations, residuals=residuals
    )


def _holder_problem(layout: StripLayout, gap, holder: Holder) -> ContactProblem:
    """Formulate the contact problem of all strips, with an unknown motion for each load of the holder.

    `layout` has the nodes of the strips, and `gap` (s, m) [m] is their gap without load. The n = s m nodes of the
    problem are numbered strip after strip.
    """
    n_strips = layout.offsets.size
    motions = (
        (holder.load, np.ones(gap.size), 0.0),
        (holder.moment, np.tile(layout.x, n_strips), holder.spring),
        (holder.roll_moment, np.repeat(layout.offsets, layout.x.size), 0.0),
    )
    free = [motion for motion in motions if motion[0] is not None]
    return ContactProblem(
        gap.ravel(),
        np.array([column for _, column, _ in free]).reshape(len(free), gap.size).T,
        np.array([target for target, _, _ in free], float),
        np.array([spring for _, _, spring in free]),
    )


def _press_bare(compliance: StripCompliance, problem: ContactProblem, start) -> ContactSolution:
    """Solve strips that have no asperity layer, or a linear one that the compliance contains.

    `start` (s, m) or (n,) of bool is a guess of the nodes in contact, or None. Raises NotConverged, with a remedy, if
    the contact set of the `problem` does not determine the motion.
    """
    if not problem.target.size and problem.gap.min() >= 0:
        return ContactSolution(np.zeros(problem.gap.size), np.zeros(0), 0)
    try:
        return solve(compliance, problem, None if start is None else np.ravel(start))
    except np.linalg.LinAlgError:
        message = explain_singular_set(compliance.common, problem)
        # The column of the roll is the last one, and it is the only one that is constant along a strip.
        rolls = np.ptp(problem.motions[: len(compliance.common), -1:]) == 0
        if rolls and problem.target.size > 1 and message != INDEFINITE_COMPLIANCE_MESSAGE:
            message = LOOSE_ROLL_MESSAGE
        raise NotConverged(message) from None


def _refuse_unsolvable(strips: StripModel, gap, holder: Holder) -> None:
    """Raise PatchfemError for loads and approaches that numbers cannot represent, and for pieces that tip over.

    `gap` (s, m) [m] is that of the nodes of the `strips` without load, and `holder` has the loads and prescribed
    motions. The load line of a free rotation lies at x = moment/load.
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
        x = strips.layout.x
        load_line = holder.moment / load
        half_length = np.ptp(x) / 2 * (1 - 1e-13)
        if not abs(load_line - (x[0] + x[-1]) / 2) < half_length:
            raise PatchfemError(
                f"contact.load_line: the load line lies {load_line:.6g} m from the middle, outside the half length "
                f"{half_length:.6g} m: the piece tips over"
            )


def _refuse_loose_holder(force, holder: Holder) -> None:
    """Raise NotConverged if the nodes in contact do not determine a released rotation.

    `force` (s, m) [N] are the nodal forces of the strips. A rotation of the `holder` is released if it has a moment
    but no spring.
    """
    is_loaded = force > MIN_LOADED_FORCE_RATIO * force.max()
    is_rotation_free = holder.moment is not None and holder.spring == 0
    if is_rotation_free and is_loaded.any(axis=0).sum() < 2:
        raise NotConverged(
            "contact: the nodes that touch do not determine the rotation of the piece; lower "
            "contact.element_size or set contact.holder.rotational_stiffness"
        )
    if holder.roll_moment is not None and is_loaded.any(axis=1).sum() < 2:
        raise NotConverged(LOOSE_ROLL_MESSAGE)


def _make_state(
    strips: StripModel, force, opening, motion, holder: Holder, n_iterations: int = 0, residuals=()
) -> StripsState:
    """Assemble the contact state of s strips of m nodes from a solution.

    Parameters
    ----------
    strips : StripModel
        Compliance, layout and asperity layer of the strips.
    force : (s, m) array
        Normal forces of the nodes [N].
    opening : (s, m) array
        Gap of the interface under load [m].
    motion : (r,) array
        Free motions of the holder: approach [m], then its free rotations with the opposite sign [rad].
    holder : Holder
        Prescribed load, moments and rotations.
    n_iterations : int
        Number of iterations of the solver.
    residuals : dict or sequence of pairs
        Residuals of the solution by name.

    Returns
    -------
    StripsState
        Its position of the holder includes the prescribed rotations.
    """
    _, layout, asperities = strips
    stiffness = None
    if asperities is not None:
        # A linear layer is compressed where it carries load, though the gap there is 0.
        separation = opening if strips.is_smooth else -force
        stiffness = asperities.stiffness(separation) * (force > 0) if force.any() else force
        stiffness = frozen_array(stiffness)
    has_moments = holder.load != 0
    theta = -float(motion[1]) if has_moments and holder.moment is not None else 0.0
    roll = -float(motion[-1]) if has_moments and holder.roll_moment is not None else 0.0
    return StripsState(
        force=frozen_array(force),
        gap=frozen_array(opening),
        stiffness=stiffness,
        layout=layout._replace(offsets=frozen_array(layout.offsets)),
        position=HolderPosition(float(motion[0]), holder.rotation + theta, holder.roll + roll),
        residuals=MappingProxyType(dict(residuals)),
        iterations=n_iterations,
    )
