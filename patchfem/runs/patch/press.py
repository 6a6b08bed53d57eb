"""Solution of the static contact of a patch: condensed pieces, gap, and load or approach.

In: a `PatchModel` and its condensed pieces (`Pair`). Out: a `Patch` with pressure, gap and
compliance.
"""

from dataclasses import dataclass, field, replace
from functools import partial
from time import perf_counter
from typing import NamedTuple

import numpy as np

from ...contact import edges
from ...contact.strip_compliance import WarmStart
from ...contact.unilateral import press, press_to_approach
from ...core import Compliance, ContactState, PatchfemError, frozen_array
from ...exceptions import UnresolvedTrace
from . import skin as skin_press
from . import strips as strip_press
from .approach import press_to_approach_with_rotation
from .condensed import Pair, condense

# Smallest ripple of the pressure over its peak, on pieces with non-matching nodes, that a note
# states.
MIN_RIPPLE = 1e-2


class Surface(NamedTuple):
    """Pressure and gap at the points of an interface.

    - x (n,): positions [m].
    - weight (n,): areas [m2].
    - sigma_n (n,): normal stress [Pa].
    - gap (n,): gap under load [m].
    - unloaded_gap: gap without load (n,), or (s, n) of strips [m].
    """

    x: np.ndarray
    weight: np.ndarray
    sigma_n: np.ndarray
    gap: np.ndarray
    unloaded_gap: np.ndarray


class PointSolution(NamedTuple):
    """Contact solution on equally spaced points of a profile, finer than the mesh.

    - measures: `measures.Estimate` by name; only those that these points resolve.
    - surface: Surface on the finest points.
    - intervals (k, 2): parts in contact on these points [m].
    """

    measures: dict
    surface: Surface
    intervals: np.ndarray

    @property
    def spacing(self) -> float:
        """Distance [m] between the points."""
        return float(self.surface.x[1] - self.surface.x[0])


class SolvedContact(NamedTuple):
    """Contact solution of two pieces for a given unloaded gap.

    - pieces: Compliance with its skin; a smooth skin is linearised at the operating point.
    - pressure: ContactState; of a patch in strips, the means over the width.
    - skin: StripsState with a single strip of a smooth skin, else None.
    - strips: StripsState of a patch in strips, else None.
    """

    pieces: Compliance
    pressure: ContactState
    skin: object = None
    strips: object = None


@dataclass(frozen=True, eq=False, slots=True, weakref_slot=True)
class Patch:
    """Contact patch with the solution of its static contact problem.

    Forces, areas and stiffnesses are those of all pairs together.

    - model: PatchModel.
    - pair: condensed pieces.
    - pieces, pressure, skin, strips: see `SolvedContact`.
    - giving (m, m): tangential compliance [m/N] by which the patch slips in part: that of the skin,
      of the pieces with [contact.shear], and of the spring of the holder, which is equal in all
      entries.
    - unloaded_gap (m,): gap of the unloaded surfaces [m]; (s, m) for worn strips.
    - notes: sentences for the warnings.
    - seconds: CPU seconds by name.
    - averaging: length [m] over which a profile in contact is averaged; None without a profile.
    - either: if a step of the gap is at a node, which belongs half to each side: (weight, Patch)
      with the whole node on the higher side, and the same on the lower side; else ().
    - points: PointSolution of a patch under a profile; None if the mesh is the finest solution.
    - frames: frames of the interface in a run (`Result.fields`); {} before its end.
    """

    model: object
    pair: Pair
    pieces: Compliance
    pressure: ContactState
    skin: object
    strips: object
    giving: np.ndarray
    unloaded_gap: np.ndarray
    notes: tuple
    seconds: dict
    averaging: float | None = None
    either: tuple = ()
    points: PointSolution | None = None
    frames: dict = field(default_factory=dict)

    @property
    def x(self) -> np.ndarray:
        """Positions of the interface nodes (m,) [m]."""
        return self.pieces.interface.x

    @property
    def normal_stress(self) -> np.ndarray:
        """Pressure at the nodes (m,) [Pa], averaged over the strips."""
        return self.pressure.sigma_n

    @property
    def gap(self) -> np.ndarray:
        """Gap under load at the nodes (m,) [m]; the smallest of all strips."""
        return self.pressure.gap

    @property
    def shear_stress(self) -> np.ndarray | None:
        """Shear stress at the nodes (m,) [Pa] at the end of the run, opposed to slip.

        It is 0 in a static run, and None if the run has no traction on the nodes.
        """
        return self._last_frame("shear_stress")

    @property
    def slip(self) -> np.ndarray | None:
        """Slip of the nodes (m,) [m] at the end of the run, upper minus lower surface.

        It is 0 in a static run, and None if the run has no slip of the nodes.
        """
        return self._last_frame("slip")

    def _last_frame(self, name: str) -> np.ndarray | None:
        """Return the last stored values (m,) of a nodal field; 0 in a static run, None if unknown."""
        if name in self.frames:
            return self.frames[name][-1]
        return np.zeros(self.x.size) if self.model.mesh.is_static else None

    @property
    def surface(self) -> Surface:
        """Pressure and gap at the nodes of the mesh."""
        weight = self.pieces.interface.weight
        return Surface(self.x, weight, self.normal_stress, self.gap, self.unloaded_gap)

    @property
    def finest_surface(self) -> Surface:
        """Pressure and gap of the finest solution, on profile points or else on the mesh."""
        return self.surface if self.points is None else self.points.surface

    @property
    def has_skin(self) -> bool:
        """Whether an asperity layer (skin) lies between the pieces."""
        return self.model.interface.skin is not None

    @property
    def skin_fraction(self) -> np.ndarray | None:
        """Fraction (m,) [1] of the nodal compliance due to the asperity layer; None without layer."""
        if not self.has_skin:
            return None
        bare = np.diag(self.pair.compliance.normal)
        if self.strips is None:
            return 1 - bare / np.diag(self.pieces.normal)
        stiffness = self.strips.stiffness.max(axis=0) * self.pieces.interface.weight
        return 1 / (1 + bare * stiffness)

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) of bool: True for nodes that carry pressure."""
        return self.pressure.sigma_n > 0


def solve(patch_model, grid, upper_grid=None, fresh: bool = False) -> Patch:
    """Assemble and condense the pieces of a `PatchModel`, and solve its contact.

    Parameters
    ----------
    patch_model : PatchModel
    grid, upper_grid : TensorGrid or PieceMesh
        Meshes from `make_piece_meshes`; the upper one is None if the pieces are alike.
    fresh : bool
        Whether to ignore operators kept on disk.

    Returns
    -------
    Patch

    Raises
    ------
    PatchfemError
        As in `press_patch`, and by the contact solver.
    """
    return press_patch(patch_model, condense(patch_model, grid, upper_grid, fresh))


def press_patch(patch_model, pair: Pair, worn=None) -> Patch:
    """Solve the contact of condensed pieces (Pair) under the shapes and the load of a model.

    The same Pair serves any number of models.

    Parameters
    ----------
    patch_model : PatchModel
    pair : Pair
    worn : (m,) or (s, m), optional
        Depth [m] that wear has added to the gap, of strips (s, m).

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

        advice = "".join(f"; or {text}" for text in advise_split(patch_model))
        raise PatchfemError(f"{error}{advice}", error.key) from None
    gap = heights + pair.rise if worn is None else heights + pair.rise + worn

    def press_gap(unloaded_gap) -> Patch:
        """Solve the contact for an unloaded gap (m,) [m]."""
        begin = perf_counter()
        contact = solve_contact(patch_model, pair.compliance, unloaded_gap)
        times = seconds | {"press": perf_counter() - begin}
        return make_patch(patch_model, pair, unloaded_gap, contact, notes, times)

    patch = press_gap(gap)
    has_ripple = (
        pair.joint is not None
        and pair.joint.ripple > MIN_RIPPLE
        and pressure_ripple(x, patch.normal_stress) > MIN_RIPPLE
    )
    if has_ripple:
        patch = replace(patch, notes=(*notes, f"contact.mesh: {pair.joint.reason}"))
    half_steps = patch_model.gap.half_step_heights(x)
    if not half_steps.any():
        return patch
    # A contact set ends less than half a cell beyond its last node. The two sets, with and without
    # the node at the step, are weighted such that the mean end is the step.
    node = int(np.argmax(half_steps))
    bare_fraction = 1.0 if patch.skin_fraction is None else 1 - float(patch.skin_fraction[node])
    cell = float(np.diff(x[node - 1 : node + 2]).min())
    row_over_cell = 1.0 if pair.row is None else pair.row / cell
    lean = bare_fraction * edges.edge_offset_fraction(row_over_cell)
    shifts = _gap_changes_at_step(node, gap if worn is None else gap - worn, half_steps, worn)
    parts = [(0.5 - side * lean, press_gap(gap + shift)) for side, shift in zip((-1, 1), shifts)]
    return replace(patch, either=tuple(parts))


def _gap_changes_at_step(node: int, gap, half_steps, worn) -> tuple:
    """Return the gap changes (m,) [m] that move a node on a step to either side of it.

    The worn depth of the node belongs to a gap at half the height of the step. If the node carries
    pressure, it has worn like its neighbour on the higher side of the step, else like the one on
    the lower side.
    """
    if worn is None:
        return -half_steps, half_steps
    higher = node + 1
    lower = node - 1
    if np.mean(gap[..., lower]) < np.mean(gap[..., higher]):
        higher, lower = lower, higher
    shifts = []
    for side, neighbour in ((-1, higher), (1, lower)):
        shift = np.broadcast_to(side * half_steps, worn.shape).copy()
        shift[..., node] += worn[..., neighbour] - worn[..., node]
        shifts.append(shift)
    return tuple(shifts)


def pressure_ripple(x, sigma) -> float:
    """Return the largest ripple of nodal pressures (m,) [Pa] relative to their peak [1].

    Three loaded nodes in sequence lie above, below and above the lines through their neighbours, or
    the other way round. The ripple is half the smallest distance from these lines.
    """
    fraction = np.diff(x)[:-1] / (x[2:] - x[:-2])
    distance = sigma[1:-1] - (1 - fraction) * sigma[:-2] - fraction * sigma[2:]
    three = np.stack([distance[:-2], -distance[1:-1], distance[2:]])
    five = [sigma[k : sigma.size - 4 + k] for k in range(5)]
    is_loaded = np.min(five, axis=0, initial=np.inf) > 0
    is_zigzag = is_loaded & ((three > 0).all(axis=0) | (three < 0).all(axis=0))
    smallest = np.abs(three[:, is_zigzag]).min(axis=0)
    return float(smallest.max(initial=0.0) / 2 / sigma.max(initial=1e-300))


def make_patch(
    patch_model, pair: Pair, gap, contact: SolvedContact, notes: tuple, seconds: dict
) -> Patch:
    """Assemble the Patch record of a solved contact.

    Parameters
    ----------
    patch_model : PatchModel
    pair : Pair
    gap : (m,)
        Unloaded gap [m].
    contact : SolvedContact
    notes : tuple
    seconds : dict
        CPU seconds by name.

    Returns
    -------
    Patch
    """
    giving = contact.pieces.tangential
    if not patch_model.interface.has_shear:
        giving = frozen_array(giving - pair.compliance.tangential)
    if patch_model.loading.tangential_stiffness:
        giving = frozen_array(giving + 1 / patch_model.loading.tangential_stiffness)
    x = contact.pieces.interface.x
    averaging = patch_model.gap.averaging_length(x, contact.pressure.sigma_n > 0)
    return Patch(
        patch_model,
        pair,
        *contact,
        giving=giving,
        unloaded_gap=frozen_array(gap),
        notes=notes,
        seconds=pair.seconds | seconds,
        averaging=averaging,
    )


def nodal_areas(patch_model, interface) -> np.ndarray:
    """Return the nodal areas (m,) [m2] of an interface; (s, m) for a patch in strips."""
    if patch_model.interface.strips is None:
        return interface.weight
    count = patch_model.interface.strips.count
    return np.repeat(interface.weight[None] / count, count, axis=0)


def make_force_function(patch_model, pair: Pair):
    """Return a function that computes the contact forces between worn surfaces.

    It maps worn depth (m,) [m], which is added to the gap, and softening (m,) [m/N], which is added
    to the diagonal of the compliance, to forces (m,) [N]; all are (s, m) for strips. Everything
    that the calls have in common is computed once.

    Raises
    ------
    PatchfemError
        If a profile does not fit the mesh.
    """
    bare = pair.compliance
    gap = patch_model.gap.evaluate(bare.interface.x).heights + pair.rise
    if patch_model.interface.strips is not None:
        return PressedStrips(patch_model, bare, gap)

    def compute_forces(worn, softening):
        """Return the contact forces (m,) [N] for worn depth (m,) [m] and softening (m,) [m/N]."""
        soft = replace(bare, normal=bare.normal + np.diag(softening)) if softening.any() else bare
        return solve_contact(patch_model, soft, gap + worn).pressure.sigma_n * bare.interface.weight

    return compute_forces


@dataclass(eq=False, slots=True)
class PressedStrips:
    """Contact solver of worn strips, which starts each time from the previous contact set.

    `begin` sets the contact set of the start, so that a run that continues after an interruption
    gives the same bits.

    - model: PatchModel.
    - bare: compliance of the pieces without skin.
    - gap (m,): unloaded gap [m].
    - warm_start: contact set and factors of the last solution.
    """

    model: object
    bare: Compliance
    gap: np.ndarray
    warm_start: WarmStart = field(default_factory=WarmStart)

    def begin(self, force) -> None:
        """Set the contact set from which the next solution starts to the loaded nodes."""
        self.warm_start.contact_set = np.asarray(force) > 0

    def __call__(self, worn, softening) -> np.ndarray:
        """Return the contact forces (s, m) [N] for worn depth [m] and softening [m/N], (s, m) each."""
        added = softening if softening.any() else None
        gap = self.gap + worn
        return solve_contact(self.model, self.bare, gap, added, self.warm_start).strips.force


def solve_contact(
    patch_model, pieces: Compliance, gap, added=None, warm_start=None
) -> SolvedContact:
    """Solve the contact of condensed pieces with the asperity layer, load and holder of a model.

    Parameters
    ----------
    patch_model : PatchModel
    pieces : Compliance
        Pieces without skin.
    gap : (m,) or (s, m)
        Unloaded gap [m].
    added, warm_start
        Parameters of `StripCompliance`, for strips only.

    Returns
    -------
    SolvedContact
    """
    loading = patch_model.loading
    skin = patch_model.interface.skin
    can_rotate = loading.can_rotate or loading.rotational_stiffness > 0
    if loading.approach is not None and can_rotate:
        # A search finds the load that gives the prescribed approach.
        under_load = partial(solve_contact, added=added, warm_start=warm_start)
        stiff = with_linear_skin(skin, pieces)
        return press_to_approach_with_rotation(patch_model, pieces, gap, under_load, stiff)
    if patch_model.interface.strips is not None:
        return SolvedContact(
            pieces, *strip_press.solve_strip_contact(patch_model, pieces, gap, added, warm_start)
        )
    if skin is not None and skin.law != "linear":
        return SolvedContact(*skin_press.press_through_asperities(patch_model, pieces, gap))
    pieces = with_linear_skin(skin, pieces)
    angle = patch_model.gap.angle
    if loading.approach is not None:
        return SolvedContact(pieces, press_to_approach(pieces, gap, loading.approach, angle))
    spring = loading.rotational_stiffness
    pressure = press(pieces, gap, loading.load, loading.moment, angle, spring=spring)
    return SolvedContact(pieces, pressure)


def with_linear_skin(skin, pieces: Compliance) -> Compliance:
    """Add the compliance of a linear asperity layer to that of the pieces.

    Without a layer, or with another law, these are the pieces themselves. A layer without a
    tangential ratio is rigid in shear.
    """
    if skin is None or skin.law != "linear":
        return pieces
    crush = 1 / (skin.normal_stiffness * pieces.interface.weight)
    tangential = pieces.tangential
    if skin.tangential_ratio is not None:
        tangential = tangential + np.diag(crush / skin.tangential_ratio)
    return Compliance(
        pieces.interface, frozen_array(pieces.normal + np.diag(crush)), frozen_array(tangential)
    )
