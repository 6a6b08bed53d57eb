"""Static contact problem of a patch: condensed pieces, gap, and load or approach.

In: a `PatchModel` and its condensed pieces (`CondensedPair`). Out: `PressedCases`, the forces and gaps of n cases at the
nodes, and `Patch`, the view of one of them with pressure, gap and compliance.
"""

from collections.abc import Hashable
from dataclasses import dataclass, field, replace
from functools import cached_property
from time import process_time
from typing import Any, NamedTuple

import numpy as np

from ...contact import edges
from ...contact.press import SmoothLayer, press, press_patch
from ...contact.set_table import SetTable
from ...core import Compliance, ContactState, Outcome, PatchfemError, frozen_array
from ...exceptions import UnresolvedTrace
from ...model.patch import PatchModel
from ..results.patch_rows import Arrays, Measures, Values
from . import skin
from .cases import Cases, GapShapes, make_cases, make_gap_shapes
from .condensed import CondensedPair


class Surface(NamedTuple):
    """Pressure and gap at the nodes or points of an interface.

    - x (n,): positions [m].
    - weight (n,): areas [m2].
    - sigma_n (n,): normal stress [Pa].
    - gap (n,): gap under load [m].
    - unloaded_gap: gap without load (n,) [m].
    """

    x: np.ndarray
    weight: np.ndarray
    sigma_n: np.ndarray
    gap: np.ndarray
    unloaded_gap: np.ndarray


class PointSolution(NamedTuple):
    """Contact solution on equally spaced points of a profile, which are finer than the mesh.

    - measures: those of the measures that the points resolve.
    - surface: Surface of the finest refinement level.
    - intervals (k, 2): contact intervals [m].
    """

    measures: Measures
    surface: Surface
    intervals: np.ndarray

    @property
    def spacing(self) -> float:
        """Distance [m] between neighbouring points."""
        return float(self.surface.x[1] - self.surface.x[0])


@dataclass(frozen=True, eq=False)
class Level:
    """Pieces of a group of cases on one mesh, with the asperity layer and the contact sets that the cases share.

    - model: PatchModel of the group; its load and the numbers of its gap shapes do not matter.
    - pair: condensed pieces.
    - gap: gap shapes.
    - tangent (m,): compliance [m/N] of a smooth asperity layer that is linearised; else None.
    """

    model: PatchModel
    pair: CondensedPair
    gap: GapShapes
    tangent: np.ndarray | None = None

    @property
    def x(self) -> np.ndarray:
        """Positions (m,) [m] of the nodes."""
        return self.pair.compliance.interface.x

    @property
    def has_layer(self) -> bool:
        """Whether an asperity layer lies between the pieces."""
        return self.model.interface.skin is not None

    @property
    def is_smooth(self) -> bool:
        """Whether the faces have a nonlinear asperity layer, which transmits pressure across any gap."""
        return self.has_layer and self.model.interface.skin.law != "linear"

    @property
    def area(self) -> np.ndarray:
        """Areas (m,) [m2] of the nodes."""
        return self.pair.compliance.interface.weight

    @cached_property
    def linear_layer(self) -> np.ndarray | None:
        """Compliance (m,) [m/N] of a linear or linearised asperity layer at the nodes; None without such a layer."""
        if self.tangent is not None or not self.has_layer or self.is_smooth:
            return self.tangent
        return 1 / (self.model.interface.skin.normal_stiffness * self.area)

    @property
    def smooth_layer(self) -> SmoothLayer | None:
        """Smooth asperity layer, whose law may depend on the load; None without such a layer."""
        if not self.is_smooth or self.tangent is not None:
            return None
        area = self.area.sum()
        return SmoothLayer(self.area, lambda load: skin.make_skin_law(self.model, load / area))

    def linearise(self, tangent: np.ndarray) -> "Level":
        """Return the pieces with a smooth asperity layer of a tangent compliance (m,) [m/N], without gap shapes."""
        return replace(self, gap=self.gap._replace(shapes=self.gap.shapes[:0]), tangent=tangent)

    @cached_property
    def pieces(self) -> Compliance:
        """Pieces in series with a linear or linearised layer; without a tangential ratio the layer is rigid in shear."""
        pieces = self.pair.compliance
        layer = self.linear_layer
        if layer is None:
            return pieces
        tangential = pieces.tangential
        ratio = self.model.interface.skin.tangential_ratio
        if ratio is not None:
            tangential = frozen_array(tangential + np.diag(layer / ratio))
        return Compliance(
            pieces.interface, frozen_array(pieces.normal + np.diag(layer)), tangential
        )

    @cached_property
    def motions(self) -> np.ndarray:
        """Closing (2, m) of the nodes per unit of approach and rotation."""
        return np.stack([np.ones(self.x.size), self.x])

    @cached_property
    def tables(self) -> tuple[SetTable, SetTable]:
        """Contact sets of the normal compliance, for all columns, and of the shear compliance, for a unit slide.

        The shear compliance of unlike pieces contains the normal one and the coupling of both, and the slide is that at
        fixed approach. A smooth layer is not part of them, because its tangent differs between the cases (`linearise`).
        """
        size = self.x.size
        normal = self.pieces.normal
        shear = self.pieces.tangential
        slide = np.ones((1, size))
        closing = self.pair.closing
        if closing.any():
            shear = np.block([[normal, closing], [closing.T, shear]])
            slide = np.hstack([0 * slide, slide])
        columns = np.concatenate([self.motions, self.gap.shapes])
        return SetTable(normal, columns, size), SetTable(shear, slide, size)

    def limit_sets(self, max_sets: int) -> None:
        """Discard the contact sets if there are more than `max_sets`, because many cases with own sets need much memory."""
        for table in () if self.is_smooth else self.tables:
            if table.n_sets > max_sets:
                table.forget()


class HolderPositions(NamedTuple):
    """Positions of the upper holder in n cases.

    - approach, rotation (n,): approach [m] and rotation [rad].
    - turn (n,): part of the rotation [rad] that the unloaded gap does not contain.
    - can_rotate (n,): whether the rotation is free.
    - spring (n,): stiffness [N m/rad] of the holder against the rotation.
    """

    approach: np.ndarray
    rotation: np.ndarray
    turn: np.ndarray
    can_rotate: np.ndarray
    spring: np.ndarray


@dataclass(frozen=True, eq=False)
class PressedCases:
    """Contact of n cases at the m nodes of a mesh.

    - level: pieces on the mesh.
    - force (n, m): nodal forces [N] >= 0, 0 of a case that failed.
    - gap (n, m): gap under load [m]; with a smooth asperity law the separation of the mean planes.
    - unloaded_gap (n, m): gap of the unloaded surfaces [m].
    - holder: position of the upper holder.
    - layer (n, m): compliance [m/N] of the asperity layer; None without a layer.
    - variants: for a gap with a step at a node: (weights (n,), the cases with this node on the higher side of the
      step), and the same on the lower side; else ().
    """

    level: Level
    force: np.ndarray
    gap: np.ndarray
    unloaded_gap: np.ndarray
    holder: HolderPositions
    layer: np.ndarray | None = None
    variants: "tuple[tuple[np.ndarray, PressedCases], ...]" = ()
    computed: dict[Hashable, Any] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.force)

    @property
    def x(self) -> np.ndarray:
        """Positions (m,) [m] of the nodes."""
        return self.level.x

    @cached_property
    def pressure(self) -> np.ndarray:
        """Pressures (n, m) [Pa]."""
        return self.force / self.level.area

    @cached_property
    def active(self) -> np.ndarray:
        """Contact sets (n, m): nodes that carry pressure, in a smooth layer more than a tiny fraction of the peak."""
        if not self.level.is_smooth:
            return self.force > 0
        peak = self.pressure.max(axis=1, keepdims=True)
        return self.pressure > edges.MIN_CONTACT_PRESSURE_RATIO * peak

    @cached_property
    def contact_pressure(self) -> np.ndarray:
        """Pressures (n, m) [Pa] of the nodes in contact, 0 elsewhere."""
        return np.where(self.active, self.pressure, 0.0)

    @cached_property
    def load(self) -> np.ndarray:
        """Normal loads (n,) [N]."""
        return self.force.sum(axis=1)

    @cached_property
    def moment(self) -> np.ndarray:
        """Moments (n,) [N m] of the pressure about x = 0."""
        return self.force @ self.x

    @cached_property
    def layer_fraction(self) -> np.ndarray | None:
        """Fraction (n, m) of the nodal compliance due to the asperity layer; None without a layer."""
        if self.layer is None:
            return None
        return self.layer / (self.level.pair.compliance.normal.diagonal() + self.layer)


@dataclass(frozen=True, eq=False, slots=True)
class Patch:
    """Contact patch with the solution of its static contact problem.

    Forces, areas and stiffnesses are sums over all contact pairs.

    - model: PatchModel.
    - pair: condensed pieces.
    - pieces: Compliance including the asperity layer of the patch, a nonlinear layer being linearised
      at the operating point.
    - pressure: ContactState.
    - slip_compliance (m, m): tangential compliance [m/N] of nodes that slip one by one: that of
      the asperity layer, that of the pieces if the scene has [contact.shear], and that of the
      holder spring, which is equal in all entries.
    - unloaded_gap (m,): gap of the unloaded surfaces [m].
    - notes: notes on the gap and on the pressure.
    - seconds: CPU seconds by name.
    - averaging: length [m] over which a profile in contact is averaged; None without a profile.
    - pressed: the patch as a case of `PressedCases`, from which its measures follow.
    - points: PointSolution of a patch with a profile; None if the mesh has the finest solution.
    - measures: static measures by name with their errors, of the finest of several meshes
      (`measures.with_static_measures`); None for a patch that was solved on a single mesh.
    - frames: frames of the interface (`Result.fields`); {} before the end of the run.
    """

    model: PatchModel
    pair: CondensedPair
    pieces: Compliance
    pressure: ContactState
    slip_compliance: np.ndarray
    unloaded_gap: np.ndarray
    notes: tuple[str, ...] = ()
    seconds: Values = field(default_factory=dict)
    averaging: float | None = None
    pressed: PressedCases | None = None
    points: PointSolution | None = None
    measures: Measures | None = None
    frames: Arrays = field(default_factory=dict)

    @property
    def x(self) -> np.ndarray:
        """Positions of the interface nodes (m,) [m]."""
        return self.pieces.interface.x

    @property
    def normal_stress(self) -> np.ndarray:
        """Pressure at the nodes (m,) [Pa]."""
        return self.pressure.sigma_n

    @property
    def gap(self) -> np.ndarray:
        """Gap under load at the nodes (m,) [m]."""
        return self.pressure.gap

    @property
    def shear_stress(self) -> np.ndarray | None:
        """Shear stress at the nodes (m,) [Pa] at the end of the run, positive against positive slip.

        It is 0 in a static run, and None if the run does not compute it.
        """
        return self._last_frame("shear_stress")

    @property
    def slip(self) -> np.ndarray | None:
        """Slip at the nodes (m,) [m] at the end of the run, upper minus lower surface.

        It is 0 in a static run, and None if the run does not compute it.
        """
        return self._last_frame("slip")

    def _last_frame(self, name: str) -> np.ndarray | None:
        """Return the values (m,) of a nodal field at the end of the run; None if unknown."""
        if name in self.frames:
            return self.frames[name][-1]
        return np.zeros(self.x.size) if self.model.mesh.is_fine else None

    @property
    def surface(self) -> Surface:
        """Pressure and gap at the nodes of the mesh."""
        weight = self.pieces.interface.weight
        return Surface(self.x, weight, self.normal_stress, self.gap, self.unloaded_gap)

    @property
    def finest_surface(self) -> Surface:
        """Pressure and gap of the finest solution, on the profile points or else on the mesh."""
        return self.surface if self.points is None else self.points.surface

    @property
    def has_skin(self) -> bool:
        """Whether an asperity layer (skin) lies between the pieces."""
        return self.model.interface.skin is not None

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) of bool: whether each node carries pressure."""
        return self.pressure.sigma_n > 0


# A patch on several meshes, from fine to coarse; None for a mesh on which it is not solved.
Patches = tuple[Patch | None, ...]


def solve_patch_contact(patch_model, pair: CondensedPair, worn=None, coarse=None) -> Patch:
    """Solve the contact problem of condensed pieces with the gap and the load of a model.

    Many models can use the same condensed pieces.

    Parameters
    ----------
    patch_model : PatchModel
        Model whose gap, load and asperity layer are used.
    pair : CondensedPair
        Condensed pieces, on whose nodes the contact is solved.
    worn : (m,) ndarray, optional
        Worn depth [m], which is added to the gap.
    coarse : Patch, optional
        Solution on another mesh, from whose contact set the search starts.

    Returns
    -------
    Patch

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh, or if the contact cannot be solved.
    """
    begin = process_time()
    level = make_level(patch_model, pair)
    cases = make_cases(patch_model, 1)
    if worn is not None:
        level, cases = _add_worn_depth(level, cases, worn)
    start = np.zeros((1, level.x.size), bool)
    if coarse is not None:
        start[0] = np.interp(level.x, coarse.x, coarse.pressed.force[0] > 0) > 0.5

    pressed, errors = press_on_level(level, cases, start)
    for error in errors.values():
        raise error
    return make_patch(pressed, process_time() - begin)


def _add_worn_depth(level: Level, cases: Cases, worn) -> tuple[Level, Cases]:
    """Return a level and a single case with a worn depth (m,) [m] added to the gap."""
    has_step = cases.step_changes is not None
    if has_step:
        # The worn depth of the node belongs to a gap at half the height of the step. On the higher side of the step, the
        # node takes the worn depth of its neighbour there, and on the lower side likewise.
        gap = cases.amplitudes[0] @ level.gap.shapes
        node = int(np.argmax(level.gap.shapes[-1]))
        neighbours = sorted((node - 1, node + 1), key=lambda neighbour: gap[neighbour])
        changes = cases.step_changes + worn[neighbours] - worn[node]
        cases = cases._replace(step_changes=changes)
    place = cases.amplitudes.shape[1] - has_step
    cases = cases._replace(amplitudes=np.insert(cases.amplitudes, place, 1.0, axis=1))
    shapes = np.insert(level.gap.shapes, place, worn, axis=0)
    return replace(level, gap=level.gap._replace(shapes=shapes)), cases


def compute_step_weight_shift(pressed: PressedCases, node: int) -> np.ndarray:
    """Return by how much (n,) the weights of the two variants of a step at a node differ from one half.

    `pressed` are the cases with the node at half the height of the step.
    """
    cell = float(np.diff(pressed.x[node - 1 : node + 2]).min())
    shift = edges.compute_edge_offset(cell, cell, 0.0, pressed.level.pair.row) / cell
    if pressed.layer_fraction is None:
        return np.full(len(pressed), shift)
    return shift * (1 - pressed.layer_fraction[:, node])


def make_patch(pressed: PressedCases, seconds: float) -> Patch:
    """Return the Patch of a single case, which was pressed in some CPU seconds."""
    patch_model = pressed.level.model
    pair = pressed.level.pair
    loading = patch_model.loading
    load = float(pressed.load[0])
    contact_state = ContactState(
        frozen_array(pressed.contact_pressure[0]),
        frozen_array(pressed.gap[0]),
        float(pressed.holder.approach[0]),
        float(pressed.holder.rotation[0]),
        load,
        float(pressed.moment[0]),
        Outcome.DONE if load > 0 else Outcome.NO_CONTACT,
    )

    level = pressed.level
    if level.is_smooth:
        level = level.linearise(pressed.layer[0])
    pieces = level.pieces

    # Compliance of a slipping node: that of the pieces, if they shear, of the layer, and of the holder
    slip_compliance = pieces.tangential
    if not patch_model.interface.has_shear:
        slip_compliance = slip_compliance - pair.compliance.tangential
    if loading.tangential_stiffness:
        slip_compliance = slip_compliance + 1 / loading.tangential_stiffness
    slip_compliance.setflags(write=False)
    return Patch(
        patch_model,
        pair,
        pieces,
        contact_state,
        slip_compliance=slip_compliance,
        unloaded_gap=frozen_array(pressed.unloaded_gap[0]),
        notes=level.gap.notes,
        seconds=pair.seconds | level.gap.seconds | {"press": seconds},
        averaging=patch_model.gap.averaging_length(pieces.interface.x, contact_state.sigma_n > 0),
        pressed=pressed,
    )


def make_level(patch_model, pair: CondensedPair) -> Level:
    """Return the pieces and the gap shapes of a group of cases on a mesh.

    Parameters
    ----------
    patch_model : PatchModel
        Patch of all cases.
    pair : CondensedPair
        Pieces, condensed on the mesh.

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    x = pair.compliance.interface.x
    try:
        return Level(patch_model, pair, make_gap_shapes(patch_model, x, pair.end_gap))
    except UnresolvedTrace as error:
        from .trace_split import advise_split

        sentences = [str(error), *advise_split(patch_model, float(np.diff(x).max()))]
        raise PatchfemError("; or ".join(sentences), error.key) from None


def press_on_level(
    level: Level, cases: Cases, start
) -> tuple[PressedCases, dict[int, PatchfemError]]:
    """Press the cases of a group on a mesh.

    Cases whose contact set is not found on the table, and those with a smooth asperity layer, are pressed one by one.

    Parameters
    ----------
    level : Level
        Pieces on the mesh, with the gap shapes of the group.
    cases : Cases
        n cases.
    start : (n, m) bool ndarray
        Contact sets from which the search starts.

    Returns
    -------
    PressedCases
    errors : dict
        Error of each case that cannot be pressed, by its number.
    """
    pressed, errors = _press_gaps(level, cases, start)
    # A step between two nodes, as on a mesh that the scene prescribes, has no variants
    has_step_node = cases.step_changes is not None and level.gap.shapes[-1].any()
    if not has_step_node:
        return pressed, errors
    variants = []
    node = int(np.argmax(level.gap.shapes[-1]))
    shift = compute_step_weight_shift(pressed, node)
    for side, moved in cases.variants:
        part, more_errors = _press_gaps(level, moved, pressed.active)
        errors = more_errors | errors
        variants.append((0.5 - side * shift, part))
    return replace(pressed, variants=tuple(variants)), errors


def _press_gaps(level: Level, cases: Cases, start) -> tuple[PressedCases, dict[int, PatchfemError]]:
    """Press the cases of a group on a mesh, with the nodes at steps at the heights that the amplitudes give.

    The parameters and results are those of `press_on_level`.
    """
    states = press(level.tables[0], cases.holders, cases.amplitudes, start, level.smooth_layer)
    layer = None
    if level.is_smooth:
        # The law is linearised; the compliance of unloaded nodes is limited
        stiffness = np.maximum(states.layer_stiffness * level.area, 1e-300)
        largest = stiffness.max(axis=1, keepdims=True)
        layer = 1 / np.maximum(stiffness, edges.MIN_CONTACT_PRESSURE_RATIO * largest)
    elif level.has_layer:
        layer = np.broadcast_to(level.linear_layer, states.force.shape)

    holders = cases.holders
    positions = HolderPositions(
        states.approach,
        cases.rotation + states.turn,
        states.turn,
        holders.can_rotate,
        holders.spring,
    )
    gap = cases.amplitudes @ level.gap.shapes
    return PressedCases(level, states.force, states.gap, gap, positions, layer), states.errors


def make_contact_force_function(patch_model, pair: CondensedPair):
    """Return a function that computes the contact forces between worn surfaces.

    It maps worn depth (m,) [m], which is added to the gap, and softening (m,) [m/N], which is added
    to the diagonal of the compliance, to nodal forces (m,) [N].

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    level = make_level(patch_model, pair)
    pieces = level.pieces
    cases = make_cases(patch_model, 1)
    gap = cases.amplitudes[0] @ level.gap.shapes
    holder = cases.holders.take(0)
    law = level.smooth_layer and level.smooth_layer.make_law(holder.load)
    active = None

    def compute_forces(worn, softening) -> np.ndarray:
        """Return the contact forces (m,) [N] for a worn depth (m,) [m] and a softening (m,) [m/N]."""
        nonlocal active
        softened = pieces
        if softening.any():
            softened = replace(pieces, normal=pieces.normal + np.diag(softening))
        force = press_patch(softened, gap + worn, holder, law, active).force
        active = force > 0
        return force

    return compute_forces
