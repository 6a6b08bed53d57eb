"""Static contact problem of a patch: condensed pieces, gap, and load or approach.

In: a `PatchModel` and its condensed pieces (`CondensedPair`). Out: a `Patch` with pressure, gap and
compliance.
"""

from dataclasses import dataclass, field, replace
from time import process_time
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...contact.press import (
    Holder,
    StripLayout,
    StripModel,
    StripsState,
    press_strips,
    split_into_strips,
)
from ...contact.strip_compliance import StripCompliance
from ...core import Compliance, ContactState, PatchfemError, frozen_array
from ...exceptions import UnresolvedTrace
from ...model.patch import PatchModel
from ..results.patch_rows import Arrays, Measures, Values
from .condensed import CondensedPair
from .skin import make_skin_law


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


@dataclass(frozen=True, eq=False, slots=True)
class Patch:
    """Contact patch with the solution of its static contact problem.

    Forces, areas and stiffnesses are sums over all contact pairs.

    - model: PatchModel.
    - pair: condensed pieces.
    - pieces: Compliance including the asperity layer of the patch, a nonlinear layer being linearised
      at the operating point.
    - pressure: ContactState.
    - state: StripsState of a single strip.
    - slip_compliance (m, m): tangential compliance [m/N] of nodes that slip one by one: that of
      the asperity layer, that of the pieces if the scene has [contact.shear], and that of the
      holder spring, which is equal in all entries.
    - unloaded_gap (m,): gap of the unloaded surfaces [m].
    - notes: notes on the gap and on the pressure.
    - seconds: CPU seconds by name.
    - averaging: length [m] over which a profile in contact is averaged; None without a profile.
    - step_variants: for a gap with a step at a node: (weight, Patch) with this node on the higher
      side of the step, and the same on the lower side; else ().
    - points: PointSolution of a patch with a profile; None if the mesh has the finest solution.
    - measures: static measures by name with their errors, of the finest of several meshes
      (`measures.with_static_measures`); None for a patch that was solved on a single mesh.
    - frames: frames of the interface (`Result.fields`); {} before the end of the run.
    """

    model: PatchModel
    pair: CondensedPair
    pieces: Compliance
    pressure: ContactState
    state: StripsState
    slip_compliance: np.ndarray
    unloaded_gap: np.ndarray
    notes: tuple[str, ...] = ()
    seconds: Values = field(default_factory=dict)
    averaging: float | None = None
    step_variants: "tuple[tuple[float, Patch], ...]" = ()
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
    def has_smooth_skin(self) -> bool:
        """Whether the pieces carry pressure at every separation, through a nonlinear asperity layer."""
        return self.has_skin and self.model.interface.skin.law != "linear"

    @property
    def layer_compliance(self) -> np.ndarray | None:
        """Compliance (s, m) [m/N] of the asperity layer at the nodes of each strip; None without a layer."""
        if not self.has_skin:
            return None
        return compute_layer_compliance(self.model.interface.skin, self.state)

    @property
    def skin_fraction(self) -> np.ndarray | None:
        """Fraction (m,) of the nodal compliance due to the asperity layer; None without a layer."""
        if not self.has_skin:
            return None
        bare = np.diag(self.pair.compliance.normal) * len(self.state.force)
        layer = self.layer_compliance.min(axis=0)
        return layer / (bare + layer)

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
    worn : (m,) or (s, m), optional
        Worn depth [m], which is added to the gap.
    coarse : Patch, optional
        Solution on another mesh, from whose contact set the search starts.

    Returns
    -------
    Patch

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    x = pair.compliance.interface.x
    try:
        heights, notes, seconds = patch_model.gap.evaluate(x)
    except UnresolvedTrace as error:
        from .trace_split import advise_split

        sentences = [str(error), *advise_split(patch_model, float(np.diff(x).max()))]
        raise PatchfemError("; or ".join(sentences), error.key) from None
    unworn_gap = heights + pair.end_gap
    worn = np.zeros(x.size) if worn is None else worn

    start = None
    if coarse is not None:
        rows = [np.interp(x, coarse.x, row > 0) for row in coarse.state.force]
        start = np.array(rows) > 0.5

    def solve_gap(gap) -> Patch:
        """Solve the contact problem for an unloaded gap (m,) or (s, m) [m]."""
        begin = process_time()
        state = press_pieces(patch_model, pair.compliance, gap, start=start)
        patch = _make_patch(patch_model, pair, gap, state)
        times = pair.seconds | seconds | {"press": process_time() - begin}
        return replace(patch, notes=notes, seconds=times)

    patch = solve_gap(unworn_gap + worn)
    half_steps = patch_model.gap.half_step_heights(x)
    if not half_steps.any():
        return patch
    # A contact set ends less than half a cell beyond its last node. The solutions with and without
    # the node at the step are weighted such that the mean contact edge is at the step.
    node = int(np.argmax(half_steps))
    bare_fraction = 1.0 if patch.skin_fraction is None else 1 - float(patch.skin_fraction[node])
    cell = float(np.diff(x[node - 1 : node + 2]).min())
    weight_shift = bare_fraction * edges.compute_edge_offset(cell, cell, 0.0, pair.row) / cell

    # The worn depth of the node belongs to a gap at half the height of the step. On the higher side of the step, the
    # node takes the worn depth of its neighbour there, and on the lower side likewise.
    higher = node + 1
    lower = node - 1
    if unworn_gap[lower] < unworn_gap[higher]:
        higher, lower = lower, higher
    variants = []
    for side, neighbour in ((-1, higher), (1, lower)):
        moved = unworn_gap + side * half_steps + worn
        moved[..., node] += worn[..., neighbour] - worn[..., node]
        variants.append((0.5 - side * weight_shift, solve_gap(moved)))
    return replace(patch, step_variants=tuple(variants))


def _make_patch(patch_model, pair: CondensedPair, gap, state: StripsState) -> Patch:
    """Return the Patch of a solved contact.

    Parameters
    ----------
    patch_model : PatchModel
        Model that was solved.
    pair : CondensedPair
        Condensed pieces of the solution.
    gap : (m,) or (s, m)
        Unloaded gap [m].
    state : StripsState
        Solution on the nodes of the pieces.
    """
    loading = patch_model.loading
    interface = patch_model.interface
    skin = interface.skin

    # A smooth law never reaches 0; what is set to 0 is smaller than the residual of the load balance.
    pressure = state.pressure
    if skin is not None and skin.law != "linear":
        pressure = np.where(
            pressure > edges.MIN_CONTACT_PRESSURE_RATIO * pressure.max(), pressure, 0.0
        )

    # The patch is a single strip.
    mean_state = ContactState(
        frozen_array(pressure.mean(axis=0)),
        frozen_array(state.gap.min(axis=0)),
        state.position.delta,
        state.position.theta,
        state.load,
        state.moment,
        state.outcome,
        state.iterations,
        state.residuals,
    )

    # The layer can be part of the compliance. Without a tangential ratio it is rigid in shear.
    pieces = pair.compliance
    layer_shear = 0.0
    if skin is not None:
        layer = np.diag(compute_layer_compliance(skin, state)[0])
        if skin.tangential_ratio is not None:
            layer_shear = layer / skin.tangential_ratio
        normal = frozen_array(pieces.normal + layer)
        pieces = Compliance(pieces.interface, normal, frozen_array(pieces.tangential + layer_shear))

    slip_compliance = pieces.tangential
    if not interface.has_shear:
        slip_compliance = slip_compliance - pair.compliance.tangential
    if loading.tangential_stiffness:
        slip_compliance = slip_compliance + 1 / loading.tangential_stiffness
    slip_compliance.setflags(write=False)
    return Patch(
        patch_model,
        pair,
        pieces,
        mean_state,
        state,
        slip_compliance=slip_compliance,
        unloaded_gap=frozen_array(gap),
        averaging=patch_model.gap.averaging_length(pieces.interface.x, mean_state.sigma_n > 0),
    )


def make_contact_force_function(patch_model, pair: CondensedPair):
    """Return a function that computes the contact forces between worn surfaces.

    It maps worn depth (m,) [m], which is added to the gap, and softening (m,) [m/N], which is added
    to the diagonal of the compliance, to nodal forces (m,) [N].

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    pieces = pair.compliance
    gap = patch_model.gap.evaluate(pieces.interface.x).heights + pair.end_gap

    def compute_forces(worn, softening) -> np.ndarray:
        """Return the contact forces [N] for a worn depth [m] and a softening [m/N]."""
        added = np.atleast_2d(softening) if softening.any() else None
        state = press_pieces(patch_model, pieces, gap + worn, added)
        return state.force.reshape(np.shape(worn))

    return compute_forces


def press_pieces(patch_model, pieces: Compliance, gap, added=None, start=None) -> StripsState:
    """Solve the contact of condensed pieces with the asperity layer, load and holder of a model.

    The patch is the only strip of `contact.press`.

    Parameters
    ----------
    patch_model : PatchModel
        Model whose asperity layer, load and holder are used.
    pieces : Compliance
        Compliance of the pieces without asperity layer.
    gap : (m,) or (s, m)
        Unloaded gap [m].
    added : (s, m) ndarray, optional
        What each strip adds to the diagonal of its compliance [m/N].
    start : (s, m) ndarray of bool, optional
        Nodes in contact of a similar solution, from which the search starts.

    Returns
    -------
    StripsState
    """
    loading = patch_model.loading
    strip = split_into_strips(pieces, 1)
    offsets = np.zeros(1)

    strips = StripModel(
        StripCompliance(strip.normal, added),
        StripLayout(pieces.interface.x, strip.weight, offsets),
        None if patch_model.interface.skin is None else make_skin_law(patch_model),
    )

    # Under a prescribed approach, at which no piece rotates, the load follows from the solution.
    holder = Holder(
        load=loading.load,
        approach=loading.approach,
        moment=loading.moment,
        spring=loading.rotational_stiffness,
        rotation=patch_model.gap.angle,
    )
    return press_strips(strips, gap, holder, start)


def compute_layer_compliance(skin, state: StripsState) -> np.ndarray:
    """Return the compliance (s, m) [m/N] of an asperity layer at the nodes of each strip of a contact state.

    A nonlinear law is linearised; the compliance of unloaded nodes is limited.
    """
    if skin.law == "linear":
        return np.broadcast_to(1 / (skin.normal_stiffness * state.layout.weight), state.force.shape)
    stiffness = np.maximum(state.stiffness * state.layout.weight, 1e-300)
    return 1 / np.maximum(stiffness, edges.MIN_CONTACT_PRESSURE_RATIO * stiffness.max())
