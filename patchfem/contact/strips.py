"""Strips side by side over the width of a patch, pressed by one rigid holder that may roll.

Strip j, at y_j from the middle, has the gap g(x) + roll y_j (or one of its own) and the compliance C. The shear between
strips is neglected. The motion q = (delta, -theta, -roll) of the holder, or as much of it as is free, is common to all
strips: strip j closes by R_j q with R_j = (1, x, y_j).

Asperities form a compliant layer with the local law P(s) in series with the pieces: a node of area A_i carries
f_i = A_i P(s_i) at the separation s_i = g_i + theta x_i - delta + (C f)_i of the mean planes. P >= 0 decreases with s,
so the solution is unique for every law, gap and control. A linear law adds 1/(k A_i) to the diagonal of C, and bare
contact follows (`unilateral.solve`); `asperity_layer` solves the other laws. A patch with asperities is one strip.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..core import Compliance, NotConverged, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import use_one_blas_thread
from .active_set import ContactProblem
from .asperity_laws import ExponentialAsperities, LinearAsperities, SmoothAsperities
from .asperity_layer import (
    MIN_LOG_PRESSURE,
    AsperityProblem,
    AsperitySolution,
    solve_asperity_layer,
    solve_at_motion,
    solve_tangent,
)
from .strip_compliance import StripCompliance
from .unilateral import (
    INDEFINITE_MESSAGE,
    ContactSolution,
    compute_balances,
    compute_residuals,
    explain_singular_set,
    refuse_residuals,
    refuse_tipping,
    solve,
)

# Largest relative residual of a solved contact of strips; rounding errors of steep asperity laws
# stay below it
STRIP_RESIDUAL_TOL = 1e-9
# Smallest total force [N] in a divisor; it keeps quotients of an unloaded interface finite
MIN_TOTAL_FORCE = 1e-150
# Smallest force of a loaded node relative to the largest force; smaller forces are rounding errors
MIN_RELATIVE_FORCE = 1e-12
NEGLECTED_SHEAR_NOTE = (
    "the shear between neighbouring strips is neglected; fields and pictures show the mean over the strips, "
    "unless their captions name strips; result.nc contains every strip"
)

LOOSE_ROLL_MESSAGE = (
    "contact.strips: the nodes that touch do not determine the rotation about x; raise "
    "contact.strips.count or prescribe contact.strips.roll"
)


class StripLayout(NamedTuple):
    """Positions and areas of the nodes of equal strips.

    - x (m,): Positions [m] along each strip.
    - weight (m,): Nodal areas [m2] of one strip.
    - offsets (s,): Distances y [m] of the strips from the middle.
    """

    x: np.ndarray
    weight: np.ndarray
    offsets: np.ndarray


class HolderLoads(NamedTuple):
    """Load and moments on the holder; each is None if the corresponding motion is prescribed instead.

    - load: Normal load [N] of all strips, or None under an approach.
    - moment: Moment sum f x [N m] of a free rotation about y, or None.
    - roll_moment: Moment sum f y [N m] of a free roll, or None.
    - spring: Stiffness [N m/rad] of the holder against the rotation about y.
    """

    load: float | None = None
    moment: float | None = None
    roll_moment: float | None = None
    spring: float = 0.0


class HolderPosition(NamedTuple):
    """Approach delta [m] and rotations theta about y and roll about x [rad] of the holder."""

    delta: float
    theta: float = 0.0
    roll: float = 0.0


class StripModel(NamedTuple):
    """Model of equal strips that are pressed by one rigid holder.

    - compliance: Compliance [m/N] of each strip; rigid pieces (0) need asperities.
    - layout: Nodes of the strips.
    - asperities: Pressure law of the asperities; None if the pieces are bare.
    """

    compliance: StripCompliance
    layout: StripLayout
    asperities: LinearAsperities | SmoothAsperities | None = None


@dataclass(frozen=True, eq=False, slots=True)
class StripsState:
    """Contact state of s strips of m nodes that are pressed by one rigid holder.

    - force (s, m): Nodal forces [N] >= 0.
    - gap (s, m): Gap under load [m]; with asperities the separation of the mean planes, negative where
      their layer is compressed.
    - stiffness (s, m): Stiffness of the asperity layer [Pa/m], None without asperities.
    - layout: Nodes of the strips.
    - position: Approach and rotations of the holder.
    - outcome: Whether the strips touch.
    - iterations: Number of contact sets or Newton steps.
    - residuals: Relative residuals of the independent check.
    """

    force: np.ndarray
    gap: np.ndarray
    stiffness: np.ndarray | None
    layout: StripLayout
    position: HolderPosition
    outcome: Outcome
    iterations: int
    residuals: MappingProxyType

    @property
    def pressure(self) -> np.ndarray:
        """Pressure (s, m) [Pa]."""
        return frozen_array(self.force / self.layout.weight)

    @property
    def offsets(self) -> np.ndarray:
        """Transverse positions y (s,) [m] of the strips."""
        return self.layout.offsets

    @property
    def delta(self) -> float:
        """Approach of the holder [m]."""
        return self.position.delta

    @property
    def theta(self) -> float:
        """Rotation of the holder about y [rad]."""
        return self.position.theta

    @property
    def roll(self) -> float:
        """Rotation of the holder about x [rad]."""
        return self.position.roll

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

    @property
    def fraction(self) -> float:
        """Fraction [1] of the area that carries load."""
        weight = self.layout.weight
        return float(((self.force > 0) * weight).sum() / (weight.sum() * self.offsets.size))

    @property
    def note(self) -> str:
        """Sentence for users about the neglected shear between strips."""
        return NEGLECTED_SHEAR_NOTE

    def yaw_moment(self, friction: float) -> float:
        """Return the yaw moment [N m] of friction on an upper piece that slides towards +x.

        friction: coefficient of friction mu.
        """
        return friction * self.roll_moment


def strip_offsets(width: float, count: int) -> np.ndarray:
    """Return the centres y (count,) [m] of equal strips that divide the width [m] of a pair of pieces.

    y is 0 in the middle of the width. PatchfemError for less than one strip or no width.
    """
    if not (count >= 1 and width > 0):
        raise PatchfemError(
            f"contact.strips.count: {count} strips over {width:.6g} m; at least one is needed"
        )
    return (np.arange(count) + 0.5) * (width / count) - width / 2


class StripProperties(NamedTuple):
    """Compliances (m, m) [m/N] and nodal areas (m,) [m2] of one strip."""

    normal: np.ndarray
    tangential: np.ndarray
    weight: np.ndarray


def split_into_strips(pieces: Compliance, count: int) -> StripProperties:
    """Return the compliance and the nodal areas of one strip if a patch is split into equal strips.

    A strip is `count` times as compliant as the whole width.
    """
    return StripProperties(
        pieces.normal * count, pieces.tangential * count, pieces.interface.weight / count
    )


def compute_law_residuals(
    asperities: SmoothAsperities, area, problem: ContactProblem, solution: AsperitySolution
) -> dict:
    """Compute the relative residuals of the contact conditions for strips with a smooth asperity layer.

    The mismatch of the law is relative to the largest force and to 1e-5 of what the law gains over the depth of the gap;
    pressures that count as none are left out.

    Parameters
    ----------
    asperities : SmoothAsperities
    area : (n,) ndarray
        Nodal areas [m2].
    problem : ContactProblem
    solution : AsperitySolution
        Its separations are those of the geometry.

    Returns
    -------
    dict of float
        tension, law, and the balances of `unilateral.compute_balances`.
    """
    force = solution.force
    opening = solution.separation
    depth = np.ptp(problem.gap) + np.abs(opening - problem.gap).max() + MIN_TOTAL_FORCE
    largest = max(force.max(), np.exp(MIN_LOG_PRESSURE))
    mismatch = np.abs(force - area * asperities.pressure(opening))
    mismatch -= area * np.exp(MIN_LOG_PRESSURE)
    gain = 1e-5 * depth * (area * asperities.stiffness(opening)).max()
    return {
        "tension": float(max(0.0, -force.min()) / largest),
        "law": float(max(0.0, mismatch.max()) / (largest + gain)),
        **compute_balances(problem, solution),
    }


def press_strips(
    strips: StripModel,
    gap: np.ndarray,
    loads: HolderLoads,
    approach: float | None = None,
    rotation: float = 0.0,
    roll: float = 0.0,
) -> StripsState:
    """Solve the contact of strips that one holder presses, under a load or an approach.

    If nothing touches, the outcome is no_contact.

    Parameters
    ----------
    strips : StripModel
    gap : (m,) or (s, m) ndarray
        Gap [m] with the prescribed rotation about y.
    loads : HolderLoads
        Its spring is unloaded at `rotation`. A roll under a moment is free from `roll` on.
    approach : float, optional
        Approach [m] in place of a load, at prescribed rotations.
    rotation : float
        Rotation [rad] about y that is already contained in the gap.
    roll : float
        Rotation [rad] about x; a positive one opens the gap at +y.

    Returns
    -------
    StripsState

    Raises
    ------
    PatchfemError
        For other combinations of controls, a moment that no pressure can carry, or an exponential law without
        reference under an approach.
    NotConverged
        If a residual exceeds 1e-9.
    """
    offsets = strips.layout.offsets
    gap = np.broadcast_to(gap, (offsets.size, strips.layout.x.size)) + roll * offsets[:, None]
    _refuse_controls(strips, gap, loads, approach)
    _refuse_roll(offsets, loads)
    if loads.load == 0:
        position = HolderPosition(float(gap.min()), rotation, roll)
        return _make_state(strips, np.zeros(gap.shape), gap - gap.min(), position)
    asperities = strips.asperities
    if isinstance(asperities, ExponentialAsperities) and asperities.reference is None:
        mean_pressure = loads.load / (strips.layout.weight.sum() * offsets.size)
        strips = strips._replace(asperities=replace(asperities, reference=mean_pressure))
    compliance, layout, asperities = strips
    is_smooth = isinstance(asperities, SmoothAsperities)
    if asperities is not None and not is_smooth:
        compliance = compliance.add_to_diagonal(1 / (asperities.k * layout.weight))
        compliance = replace(compliance, warm_start=strips.compliance.warm_start)
    problem = _holder_problem(layout, gap - (approach or 0.0), loads)
    with use_one_blas_thread():
        if is_smooth:
            area = np.tile(layout.weight, offsets.size)
            solution = _press_with_asperities(asperities, compliance, area, problem)
        else:
            solution = _press_bare(compliance, problem)
    opening = problem.gap - problem.motions @ solution.motion + compliance.product(solution.force)
    if is_smooth:
        geometric = solution._replace(separation=opening)
        residuals = compute_law_residuals(asperities, area, problem, geometric)
        opening = solution.separation
    else:
        residuals = compute_residuals(compliance, problem, solution)
    force = solution.force.reshape(gap.shape)
    # A single strip may be in contact at one node; `unilateral.solve` then chooses the rotation.
    if not is_smooth and offsets.size > 1:
        _refuse_loose_holder(force, loads)
    _refuse_strip_residuals(asperities, residuals)
    opening = opening.reshape(gap.shape)
    if not is_smooth:
        compressed = 0.0 if asperities is None else -force / (asperities.k * layout.weight)
        opening = np.where(force > 0, compressed, np.maximum(opening, 0.0))
    position = _holder_position(solution.motion, loads, approach)
    position = HolderPosition(position.delta, rotation + position.theta, roll + position.roll)
    return _make_state(strips, force, opening, position, solution.n_iterations, residuals)


def _holder_problem(layout: StripLayout, gap, loads: HolderLoads) -> ContactProblem:
    """Formulate the contact problem of all strips, with an unknown motion for each given load."""
    n_strips = layout.offsets.size
    motions = (
        (loads.load, np.ones(gap.size), 0.0),
        (loads.moment, np.tile(layout.x, n_strips), loads.spring),
        (loads.roll_moment, np.repeat(layout.offsets, layout.x.size), 0.0),
    )
    free = [motion for motion in motions if motion[0] is not None]
    return ContactProblem(
        gap.ravel(),
        np.array([column for _, column, _ in free]).reshape(len(free), gap.size).T,
        np.array([target for target, _, _ in free], float),
        np.array([spring for _, _, spring in free]),
    )


def _holder_position(motion, loads: HolderLoads, approach: float | None) -> HolderPosition:
    """Convert the approach and the released rotations (r,) to the position of the holder."""
    theta = -float(motion[1]) if loads.moment is not None else 0.0
    roll = -float(motion[-1]) if loads.roll_moment is not None else 0.0
    return HolderPosition(float(motion[0] if approach is None else approach), theta, roll)


def _press_bare(compliance: StripCompliance, problem: ContactProblem) -> ContactSolution:
    """Solve strips that have no asperity layer, or a linear one that the compliance contains."""
    if not problem.target.size:
        if problem.gap.min() < 0:
            return solve(compliance, problem)
        return ContactSolution(np.zeros(problem.gap.size), np.zeros(0), 0.0, 0)
    warm_start = compliance.warm_start
    touch_approach = problem.gap.min()
    start = None
    if warm_start is not None and warm_start.contact_set is not None:
        start = np.asarray(warm_start.contact_set).ravel()
    try:
        solution = solve(compliance, problem._replace(gap=problem.gap - touch_approach), start)
    except np.linalg.LinAlgError:
        message = explain_singular_set(compliance.common, problem)
        # The column of the roll is the last one, and it is the only one that is constant along a
        # strip.
        rolls = np.ptp(problem.motions[: len(compliance.common), -1]) == 0
        if rolls and problem.target.size > 1 and message != INDEFINITE_MESSAGE:
            message = LOOSE_ROLL_MESSAGE
        raise NotConverged(message) from None
    if warm_start is not None:
        warm_start.contact_set = solution.force > 0
    solution.motion[0] += touch_approach
    return solution


def _press_with_asperities(
    asperities: SmoothAsperities, compliance: StripCompliance, area, problem: ContactProblem
) -> AsperitySolution:
    """Solve strips with an asperity layer of a smooth pressure law.

    Each motion is scaled: the largest closing of a node per unit of motion becomes 1, and load and moments become
    comparable.
    """
    if not problem.target.size:
        layer = AsperityProblem(asperities, compliance, area, problem)
        return solve_at_motion(layer, np.zeros(0))
    scale = 1 / np.abs(problem.motions).max(axis=0)
    scaled = problem._replace(
        motions=problem.motions * scale,
        target=problem.target * scale,
        springs=problem.springs * scale**2,
    )
    solution = solve_asperity_layer(AsperityProblem(asperities, compliance, area, scaled))
    return solution._replace(motion=solution.motion * scale)


def _refuse_controls(strips: StripModel, gap, loads: HolderLoads, approach) -> None:
    """Raise PatchfemError for prescribed loads and motions for which there is no solution."""
    asperities = strips.asperities
    load = loads.load
    moment = loads.moment
    if (load is None) == (approach is None) or (moment is not None and load is None):
        raise PatchfemError("contact: give a load, a load and a moment, or an approach")
    control = load if approach is None else approach
    if not (np.isfinite(gap).all() and np.isfinite(control) and (load or 0.0) >= 0):
        raise PatchfemError(
            "contact.load: the load must be >= 0, and load, approach and gap must be finite"
        )
    if load and moment is not None and not loads.spring:
        refuse_tipping(moment / load, 0.0, np.ptp(strips.layout.x) / 2)
    if (
        load is None
        and isinstance(asperities, ExponentialAsperities)
        and asperities.reference is None
    ):
        raise PatchfemError(
            'contact.approach with contact.asperities.law = "exponential": this law has no first touch '
            "from which an approach could be measured; give contact.load, or another law"
        )


def _refuse_roll(offsets, loads: HolderLoads) -> None:
    """Raise PatchfemError if the strips cannot balance the moment about a released roll.

    This is a roll without load or second strip, or with a load line beyond the strips.
    """
    load = loads.load
    roll_moment = loads.roll_moment
    if roll_moment is None:
        return
    if load is None or offsets.size < 2:
        raise PatchfemError(
            "contact.strips.roll: a holder that is free to rotate about x needs a load and at least "
            "two strips"
        )
    if load > 0 and not offsets.min() < roll_moment / load < offsets.max():
        raise PatchfemError(
            f"contact.strips.offset: the load line at {roll_moment / load:.6g} m lies beyond the middle of "
            f"the outermost strips at {offsets.max():.6g} m, where no pressure can balance it; raise "
            "contact.strips.count or lower the offset"
        )


def _refuse_loose_holder(force, loads: HolderLoads) -> None:
    """Raise NotConverged if the nodes in contact do not determine a released rotation."""
    is_loaded = force > MIN_RELATIVE_FORCE * force.max()
    is_rotation_free = loads.moment is not None and loads.spring == 0
    if is_rotation_free and is_loaded.any(axis=0).sum() < 2:
        raise NotConverged(
            "contact.strips: the nodes that touch do not determine the rotation of the piece; lower "
            "contact.element_size or set contact.holder.rotational_stiffness"
        )
    if loads.roll_moment is not None and is_loaded.any(axis=1).sum() < 2:
        raise NotConverged(LOOSE_ROLL_MESSAGE)


def _refuse_strip_residuals(asperities, residuals) -> None:
    """Raise NotConverged if a residual is too large; the message has the remedy for this pressure law."""
    if isinstance(asperities, SmoothAsperities):
        place = "contact.asperities"
        remedy = (
            "; make the rough layer softer (raise the decay length or the height deviation), or "
            "leave the layer out"
        )
    else:
        place = "contact.strips"
        remedy = "; lower contact.strips.roll or raise the load"
    refuse_residuals(residuals, STRIP_RESIDUAL_TOL, place, remedy)


def _make_state(
    strips: StripModel,
    force,
    opening,
    position: HolderPosition,
    n_iterations: int = 0,
    residuals=(),
) -> StripsState:
    """Assemble the contact state of strips from a solution."""
    _, layout, asperities = strips
    is_pressed = force.sum() > 0
    stiffness = None
    if asperities is not None:
        stiffness = asperities.stiffness(opening) * (force > 0) if is_pressed else force
    return StripsState(
        force=frozen_array(force),
        gap=frozen_array(opening),
        stiffness=None if stiffness is None else frozen_array(stiffness),
        layout=layout._replace(offsets=frozen_array(layout.offsets)),
        position=position,
        outcome=Outcome.DONE if is_pressed else Outcome.NO_CONTACT,
        iterations=n_iterations,
        residuals=MappingProxyType(dict(residuals)),
    )


def strips_stiffness(
    c: np.ndarray, weight: np.ndarray, state: StripsState, ratio: float = 1.0
) -> float:
    """Return the stiffness of all strips together, with asperity layer and pieces in series.

    Parameters
    ----------
    c : (m, m) ndarray
        Compliance of one strip [m/N]: the normal one for dN/d(approach) at fixed rotation and roll, the tangential one
        for dT/d(relative displacement) in full stick without yaw.
    weight : (m,) ndarray
        Nodal areas of one strip [m2].
    state : StripsState
    ratio : float
        Tangential over normal stiffness of the asperity layer, inf if the layer is rigid in shear.

    Returns
    -------
    float
        Stiffness [N/m].
    """
    if not state.load:
        return 0.0
    compliance = StripCompliance(c)
    with use_one_blas_thread():
        if state.stiffness is None or np.isinf(ratio):
            active = (state.force > 0).ravel()
            uniform = np.ones((np.count_nonzero(active), 1))
            return float(compliance.solver(active)(uniform).sum())
        slope = (ratio * weight * state.stiffness).ravel()
        return float(solve_tangent(compliance, np.ones((slope.size, 1)), slope, slope)[1][0, 0])
