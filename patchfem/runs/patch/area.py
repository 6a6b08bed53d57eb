"""Pressed face: pressure that varies along x and y, on cells that are halved until the tolerance is met.

In: a `PatchModel` with an area. Out: `AreaPatch`es from fine to coarse, with the names of a `Patch`, whose points are the
cells. A coarser grid also has coarser bricks of the free sides, so that every error that follows from the changes over the
grids, of a static measure as of a motion, contains both.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf
from time import process_time
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ...contact import press_cells as faces
from ...contact.cells import BlockCompliance, CellCompliance, make_block
from ...convergence import convergence_error
from ...core import ContactState, Interface, Outcome, frozen_array
from ...elasticity.sides import BlockShape
from ...model.face import compute_face_gap
from ...model.patch import PatchModel
from ...model.pieces import make_layer_stacks
from ..results.patch_rows import CELLS_SOURCE, Arrays, Measures, Values, make_measure
from . import store
from .measures import (
    MIN_PLANE_STRAIN_WIDTH_RATIO,
    PRESSURE_PEAK_MEASURES,
    list_larger_terms,
    max_mesh_error_ratio,
)
from .press import Surface
from .values import EdgeValues, assemble_static_values

FIRST_CELLS = 64  # cells along the longer side of the coarsest grid
MIN_CELLS_ACROSS = (
    8  # smallest number of cells along the shorter side, which resolves the free sides
)
MIN_GRIDS = 3  # grids after which the order of convergence shows
SIDE_LEVEL = 1  # level of the bricks of the free sides of the finest grid
COARSE_SIDE_LEVEL = 0  # level of the bricks of the free sides of coarser grids
# Order of convergence of a face: an edge of contact follows the sides of cells, so that its position has an error of a part
# of a cell that varies irregularly from grid to grid. A higher order shows by chance.
FACE_ORDER = 1.0
# A boundary of cells counts this part of each of its sides too much (Yastrebov, Anciaux and Molinari, Tribology Letters
# 65, 2017).
BOUNDARY_SIDE_FRACTION = (np.pi - 1 + np.log(2)) / 24
# Smallest error that is stated, relative to a value and to the larger terms whose difference it is; the contact is solved to
# 1e-8 of the displacement
MIN_RELATIVE_ERROR = 1e-7
FREE_EDGE_REASON = "the largest pressure is at a free side of the face, where it converges too slowly over equal cells"
NO_HALF_WIDTH_REASON = "a contact over a face has no half-width; contact_area is its area"


@dataclass(frozen=True, eq=False)
class SoftenedCells:
    """Cells of elastic pieces with a local compliance in series, such as that of a layer of asperities or of wear.

    - cells: compliance of the pieces.
    - local: local compliance [m/Pa], a number or (ny, nx).
    """

    cells: CellCompliance
    local: np.ndarray | float

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells (ny, nx)."""
        return self.cells.shape

    @property
    def cell_area(self) -> float:
        """Area of a cell [m2]."""
        return self.cells.cell_area

    @property
    def x(self) -> np.ndarray:
        """Centres (nx,) [m] of the columns."""
        return self.cells.x

    @property
    def y(self) -> np.ndarray:
        """Centres (ny,) [m] of the rows."""
        return self.cells.y

    @cached_property
    def _mean_cells(self) -> CellCompliance:
        """Cells whose waves all have the mean local compliance, which precondition the solver."""
        return replace(self.cells, waves=self.cells.waves + np.mean(self.local))

    @property
    def self_compliance(self) -> float:
        """Mean displacement of a cell per traction on it alone [m/Pa]."""
        return self._mean_cells.self_compliance

    def product(self, traction: np.ndarray) -> np.ndarray:
        """Return the displacement (ny, nx) [m] under a traction (ny, nx) [Pa]."""
        return self.cells.product(traction) + self.local * traction

    def precondition(self, displacement: np.ndarray) -> np.ndarray:
        """Return about the traction (ny, nx) [Pa] that displaces the cells by (ny, nx) [m]."""
        return self._mean_cells.precondition(displacement)


def soften(cells, local: np.ndarray | float):
    """Return cells with a further local compliance [m/Pa] in series; unchanged if it is 0."""
    if not np.any(local):
        return cells
    if isinstance(cells, SoftenedCells):
        return SoftenedCells(cells.cells, cells.local + local)
    return SoftenedCells(cells, local)


@dataclass(frozen=True, eq=False)
class FaceCompliance:
    """Shear compliance [m/N] of all cells of a face, which multiplies forces as a matrix does.

    - cells: compliance of pieces and asperities; None if only the holder is compliant.
    - holder: compliance of the spring of the holder [m/N].
    - weight: area of a cell, summed over the pairs of pieces [m2].
    - factor: factor of the compliance of cells and holder.
    """

    cells: "CellCompliance | SoftenedCells | None"
    holder: float
    weight: float
    factor: float = 1.0

    def __matmul__(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (m,) [m] of the cells under forces (m,) [N]."""
        common = self.factor * self.holder * force.sum()
        if self.cells is None:
            return np.full(force.size, common)
        traction = (force / self.weight).reshape(self.cells.shape)
        return self.factor * self.cells.product(traction).ravel() + common

    def scale(self, factor: float) -> "FaceCompliance":
        """Return the compliance times a factor."""
        return replace(self, factor=factor * self.factor)


class FacePieces(NamedTuple):
    """Cells of a face as the interface of a patch.

    - interface: its points are the cells; their order is that of an array (ny, nx).
    """

    interface: Interface


@dataclass(frozen=True, eq=False, slots=True)
class AreaPatch:
    """Face with the solution of its static contact, with the names of a `Patch`.

    Arrays (m,) belong to the m = ny nx cells, row by row along y. Forces, areas and stiffnesses are sums over all pairs.

    - model: PatchModel.
    - cells: compliance of the pieces at the cells (normal and shear), without the layer of asperities.
    - pressed: pressure and gap over the cells.
    - unloaded_gap (m,): gap of the unloaded faces [m].
    - slip_compliance: shear compliance with which cells slip one by one.
    - story: notes on the gap, and CPU seconds by name.
    - measures: static measures by name with their errors; None before they are estimated.
    - frames: frames of the interface (`Result.fields`); {} before the end of the run.
    """

    model: PatchModel
    cells: BlockCompliance
    pressed: faces.PressedCells
    unloaded_gap: np.ndarray
    slip_compliance: FaceCompliance
    story: tuple[tuple[str, ...], Values] = ((), MappingProxyType({}))
    measures: Measures | None = None
    frames: Arrays = field(default_factory=dict)

    # What a face has not: profiles at points of their own, averages of traces, meshes
    points = None
    averaging = None
    pair = None

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes on the gap."""
        return self.story[0]

    @property
    def seconds(self) -> Values:
        """CPU seconds by name."""
        return self.story[1]

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells (ny, nx)."""
        return self.pressed.pressure.shape

    @property
    def x(self) -> np.ndarray:
        """Positions (m,) of the cells along the sliding direction [m]."""
        return np.tile(self.cells.normal.x, self.shape[0])

    @property
    def y(self) -> np.ndarray:
        """Positions (m,) of the cells across the sliding direction [m]."""
        return np.repeat(self.cells.normal.y, self.shape[1])

    @property
    def weight(self) -> np.ndarray:
        """Areas (m,) of the cells [m2]."""
        return np.full(self.x.size, self.slip_compliance.weight)

    @property
    def pieces(self) -> FacePieces:
        """Cells as the points of an interface."""
        width = self.model.pieces.width * self.model.pieces.pairs
        return FacePieces(Interface(self.x, self.weight, width))

    @property
    def pressure(self) -> ContactState:
        """Solution of the static contact."""
        pressed = self.pressed
        sigma = pressed.pressure.ravel()
        force = sigma * self.slip_compliance.weight
        load = float(force.sum())
        return ContactState(
            frozen_array(sigma),
            frozen_array(pressed.gap.ravel()),
            pressed.approach,
            self.model.gap.angle + pressed.tilt_x,
            load,
            float(force @ self.x),
            Outcome.DONE if load > 0 else Outcome.NO_CONTACT,
        )

    @property
    def normal_stress(self) -> np.ndarray:
        """Pressure (m,) [Pa] of the cells."""
        return self.pressed.pressure.ravel()

    @property
    def gap(self) -> np.ndarray:
        """Gap (m,) under load [m]."""
        return self.pressed.gap.ravel()

    @property
    def shear_stress(self) -> np.ndarray | None:
        """Shear stress (m,) [Pa] at the end of the run; 0 in a static run, None if the run does not compute it."""
        return self._last_frame("shear_stress")

    @property
    def slip(self) -> np.ndarray | None:
        """Slip (m,) [m] at the end of the run; 0 in a static run, None if the run does not compute it."""
        return self._last_frame("slip")

    def _last_frame(self, name: str) -> np.ndarray | None:
        """Return the values (m,) of a field at the end of the run; None if unknown."""
        if name in self.frames:
            return self.frames[name][-1]
        return np.zeros(self.x.size) if self.model.mesh.is_fine else None

    @property
    def surface(self) -> Surface:
        """Pressure and gap at the cells."""
        return Surface(self.x, self.weight, self.normal_stress, self.gap, self.unloaded_gap)

    @property
    def finest_surface(self) -> Surface:
        """Pressure and gap of the finest solution, which is that at the cells."""
        return self.surface

    @property
    def has_skin(self) -> bool:
        """Whether a layer of asperities lies between the pieces."""
        return self.model.interface.skin is not None

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) of bool: whether each cell carries pressure."""
        return self.normal_stress > 0


def make_cells(
    patch_model: PatchModel, n_cells: int, side_level: int, free_sides: str = "xy"
) -> BlockCompliance:
    """Make the compliance of the cells of a face, without a layer of asperities; equal faces share one.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with an area.
    n_cells : int
        Number of cells along the longer side.
    side_level : int
        Level of the bricks of the free sides.
    free_sides : str
        "xy" for blocks, "x" for plane strain.
    """
    pieces = patch_model.pieces
    counts = _divide_sides(patch_model, n_cells)
    shape = BlockShape(pieces.length, pieces.width, free_sides)
    stacks = make_layer_stacks(patch_model)
    key = ("cells", shape, stacks, counts, side_level)
    return store.get_or_compute(key, lambda: make_block(shape, stacks, counts, side_level))


def _divide_sides(patch_model: PatchModel, n_cells: int) -> tuple[int, int]:
    """Return the numbers of cells along x and y of a face, for their number along the longer side."""
    pieces = patch_model.pieces
    sides = pieces.length, pieces.width
    longer = max(sides)
    n_x, n_y = (max(MIN_CELLS_ACROSS, round(n_cells * side / longer)) for side in sides)
    return n_x, n_y


def press_face(
    patch_model: PatchModel, cells: BlockCompliance, worn=0.0, start: np.ndarray | None = None
) -> AreaPatch:
    """Solve the contact of a face with the gap of a patch.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with an area.
    cells : BlockCompliance
        Compliance of the pieces (`make_cells`).
    worn : (m,) array or float
        Worn depth [m], which is added to the gap.
    start : (ny, nx) ndarray, optional
        Pressure [Pa] of a similar problem.

    Raises
    ------
    PatchfemError
        If a scan does not fit the face.
    NotConverged
        If the contact is not found.
    """
    unloaded, notes, seconds = compute_face_gap(patch_model, cells.normal.x, cells.normal.y)
    worn = np.reshape(worn, np.shape(worn) and unloaded.shape)
    patch = press_gap(patch_model, cells, unloaded + worn, start=start)
    return replace(patch, story=(notes, seconds | patch.seconds))


def press_gap(
    patch_model: PatchModel,
    cells: BlockCompliance,
    unloaded: np.ndarray,
    softening: np.ndarray | float = 0.0,
    start: np.ndarray | None = None,
) -> AreaPatch:
    """Solve the contact of a face for a gap, with the load and the layer of asperities of a patch.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with an area.
    cells : BlockCompliance
        Compliance of the pieces (`make_cells`).
    unloaded : (ny, nx) ndarray
        Gap of the unloaded faces [m].
    softening : (ny, nx) ndarray or float
        Compliance [m/N] that is added to each cell.
    start : (ny, nx) ndarray, optional
        Pressure [Pa] of a similar problem.

    Raises
    ------
    NotConverged
        If the contact is not found.
    """
    begin = process_time()
    weight = cells.normal.cell_area * patch_model.pieces.pairs
    soft = soften(_add_asperities(patch_model, cells).normal, softening * weight)
    pressed = faces.press_cells(soft, unloaded, make_loading(patch_model), start)
    return AreaPatch(
        patch_model,
        cells,
        pressed,
        frozen_array(unloaded.ravel()),
        _make_slip_compliance(patch_model, cells),
        ((), {"press": process_time() - begin}),
    )


def _add_asperities(patch_model: PatchModel, cells: BlockCompliance) -> BlockCompliance:
    """Return the compliance of cells in series with the layer of asperities of a patch.

    Without a tangential ratio the layer is rigid in shear.
    """
    skin = patch_model.interface.skin
    if skin is None:
        return cells
    normal = soften(cells.normal, 1 / skin.normal_stiffness)
    if skin.tangential_ratio is None:
        return BlockCompliance(normal, cells.shear)
    layer_shear = 1 / (skin.normal_stiffness * skin.tangential_ratio)
    return BlockCompliance(normal, soften(cells.shear, layer_shear))


def _make_slip_compliance(patch_model: PatchModel, cells: BlockCompliance) -> FaceCompliance:
    """Make the shear compliance with which the cells of a patch slip one by one."""
    pieces = cells
    if not patch_model.interface.has_shear:
        # Pieces that do not shear leave the layer and the holder as the only compliance
        rigid = replace(cells.shear, waves=np.zeros(cells.shear.shape), sides=None)
        pieces = BlockCompliance(cells.normal, rigid)
    shear = _add_asperities(patch_model, pieces).shear
    is_rigid = shear is pieces.shear and not patch_model.interface.has_shear
    spring = patch_model.loading.tangential_stiffness
    return FaceCompliance(
        cells=None if is_rigid else shear,
        holder=1 / spring if spring else 0.0,
        weight=cells.normal.cell_area * patch_model.pieces.pairs,
    )


def make_loading(patch_model: PatchModel) -> faces.FaceLoading:
    """Return load, load line, springs and hardness of one of the equal pairs of a patch."""
    loading = patch_model.loading
    pairs = patch_model.pieces.pairs
    hardness = patch_model.area.hardness or inf
    if loading.load is None:
        return faces.FaceLoading(approach=loading.approach, hardness=hardness)
    # A spring of the holder lets the piece rotate about both axes under a load line in the middle.
    spring = loading.rotational_stiffness / pairs
    line_x = 0.0 if spring else None
    line_y = 0.0 if spring else None
    if loading.can_rotate:
        line_x = (
            loading.offset if loading.line_moment is None else loading.line_moment / loading.load
        )
    if loading.across is not None:
        line_y = loading.across
    return faces.FaceLoading(
        load=loading.load / pairs,
        line_x=line_x,
        line_y=line_y,
        spring_x=spring,
        spring_y=spring,
        hardness=hardness,
    )


def compute_face_values(patch: AreaPatch) -> Values:
    """Return the values of all static measures of a pressed face by name, in SI units.

    `patch_rows` defines the measures. The fraction in contact is corrected for the sides of the cells at its boundary
    (`BOUNDARY_SIDE_FRACTION`); a contact over a face has no half-width, so that it is nan.
    """
    pieces = patch.model.pieces
    pressure = patch.pressed.pressure
    state = patch.pressure
    active = pressure > 0
    area = pieces.length * pieces.width * pieces.pairs
    n_sides = sum(np.count_nonzero(np.diff(active, axis=axis)) for axis in (0, 1))
    fraction = (active.sum() - BOUNDARY_SIDE_FRACTION * n_sides) / active.size

    def compute_stiffness(cells, motion=1.0) -> float:
        """Return the stiffness of the set in contact against a motion of its cells, of all pairs."""
        if not state.load > 0:
            return 0.0
        return faces.compute_set_stiffness(cells, active, motion) * pieces.pairs

    # What a face has in common with a patch whose pressure varies along x alone
    normal, shear = _add_asperities(patch.model, patch.cells)
    edge_values = EdgeValues(
        length=fraction * pieces.length,
        width=np.nan,
        normal=compute_stiffness(normal),
        tangential=compute_stiffness(shear),
        rotational=compute_stiffness(normal, np.broadcast_to(normal.x, pressure.shape)),
    )
    values = assemble_static_values(
        pieces.length, area, state, estimate_peak(pressure), edge_values
    )

    # What only a face has
    roll_moment = patch.normal_stress * patch.slip_compliance.weight @ patch.y
    values |= {
        "contact_area": fraction * area,
        "pressure_centre_y": roll_moment / state.load if state.load > 0 else 0.0,
        "roll": patch.model.gap.roll + patch.pressed.tilt_y,
        "roll_moment": roll_moment,
        "roll_stiffness": compute_stiffness(
            normal, np.broadcast_to(normal.y[:, None], pressure.shape)
        ),
    }
    if patch.model.area.hardness is not None:
        values["yielded_fraction"] = (pressure >= patch.model.area.hardness).mean()
    return {name: float(value) for name, value in values.items()}


def estimate_peak(pressure: np.ndarray) -> float:
    """Return the largest pressure [Pa] over cells (ny, nx): the vertex of the parabolas through a cell and its neighbours.

    At the boundary of the contact or of the face it is that of the cell.
    """
    row, column = np.unravel_index(int(np.argmax(pressure)), pressure.shape)
    largest = float(pressure[row, column])
    rise = 0.0
    for line, place in ((pressure[:, column], row), (pressure[row], column)):
        if not 0 < place < line.size - 1 or not (line[place - 1] > 0 and line[place + 1] > 0):
            return largest
        bend = line[place - 1] - 2 * largest + line[place + 1]
        slope = (line[place + 1] - line[place - 1]) / 2
        rise += float(-(slope**2) / (2 * bend)) if bend < 0 else 0.0
    return largest + rise


def is_peak_at_side(pressure: np.ndarray) -> bool:
    """Return whether the largest pressure over cells (ny, nx) is in a row or a column at a side of the face."""
    row, column = np.unravel_index(int(np.argmax(pressure)), pressure.shape)
    return row in (0, pressure.shape[0] - 1) or column in (0, pressure.shape[1] - 1)


def with_face_measures(
    patches: "tuple[AreaPatch | None, ...]", tolerance: float
) -> "tuple[AreaPatch | None, ...]":
    """Return a face on successive grids, of which the finest one has its static measures with their errors.

    The errors follow from the changes over the grids, whose order is `FACE_ORDER`. Without a second grid they are None.

    Parameters
    ----------
    patches : tuple of AreaPatch or None
        From fine to coarse.
    tolerance : float
        Relative error, which raises the floors of differences of larger terms.

    Returns
    -------
    tuple
        The patches; the first one is a copy with the measures.
    """
    patch, *coarser = patches
    pieces = patch.model.pieces
    series = [compute_face_values(one) for one in patches if one is not None]
    values = series[0]
    larger_terms = list_larger_terms(values, pieces.length / 2, pieces.width / 2)
    measures = {}
    for name, value in values.items():
        error = None
        larger_term = larger_terms.get(name, 0.0)
        if len(series) > 1:
            changes = -np.diff([row[name] for row in series])
            error = convergence_error(*changes, max_order=FACE_ORDER)
            error = max(error, MIN_RELATIVE_ERROR * max(abs(value), larger_term))
        measure = make_measure(name, value, error, CELLS_SOURCE)
        measures[name] = replace(measure, floor=max(measure.floor, tolerance * larger_term))

    # Measures without a value, for a reason
    reasons = {"contact_half_width": NO_HALF_WIDTH_REASON}
    if is_peak_at_side(patch.pressed.pressure) and not values.get("yielded_fraction"):
        reasons |= dict.fromkeys(PRESSURE_PEAK_MEASURES, FREE_EDGE_REASON)
    for name, reason in reasons.items():
        measures[name] = replace(measures[name], value=None, error=None, reason=reason)
    return replace(patch, measures=measures), *coarser


def list_cell_counts(patch_model: PatchModel) -> tuple[int, ...]:
    """Return the numbers of cells along the longer side of a face, from coarse to fine."""
    area = patch_model.area
    if area.cells is not None:
        return tuple(area.cells // divisor for divisor in (4, 2, 1))
    counts = [min(FIRST_CELLS, area.max_cells // 4)]
    while counts[-1] < area.max_cells:
        counts.append(2 * counts[-1])
    return tuple(counts)


def count_cells(patch_model: PatchModel) -> int:
    """Return the number of cells of the finest grid of a face."""
    return int(np.prod(_divide_sides(patch_model, list_cell_counts(patch_model)[-1])))


def solve_face_on_grids(
    patch_model: PatchModel, tolerance: float, *, with_errors: bool = True
) -> "tuple[AreaPatch | None, ...]":
    """Solve a face on grids of cells that are halved until the static measures meet the tolerance.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with an area.
    tolerance : float
        Relative error that the measures have to meet.
    with_errors : bool
        If False, only the finest of three grids is solved.

    Returns
    -------
    tuple
        Patches from fine to coarse, at least two; None for a grid that is not solved. The first one has the measures.
    """
    counts = list_cell_counts(patch_model)

    def press(count: int, side_level: int, other: AreaPatch | None = None) -> AreaPatch:
        """Press the face on a number of cells, from the pressure on another grid."""
        cells = make_cells(patch_model, count, side_level)
        start = None if other is None else _find_start(other.pressed.pressure, cells)
        return press_face(patch_model, cells, start=start)

    if not with_errors:
        return with_face_measures((press(counts[2], SIDE_LEVEL), None), tolerance)

    coarser = ()
    for count in counts[: MIN_GRIDS - 1]:
        coarser = (press(count, COARSE_SIDE_LEVEL, *coarser[:1]), *coarser)
    for count in counts[MIN_GRIDS - 1 :]:
        patch = press(count, SIDE_LEVEL, coarser[0])
        patches = with_face_measures((patch, *coarser), tolerance)
        is_met = max_mesh_error_ratio(patches[0].measures, tolerance) <= 1
        if is_met or count == counts[-1] or patch.pressure.outcome is Outcome.NO_CONTACT:
            break
        coarser = (press(count, COARSE_SIDE_LEVEL, patch), *coarser)
    return patches


def describe_plane_strain(patch_model: PatchModel | None) -> list[str]:
    """Return a list with a sentence on what plane strain leaves out of two flat blocks with free sides.

    The list is empty for a face, for plane stress, for pieces that are much wider than tall, and for unequal faces, which
    the blocks have not.
    """
    if patch_model is None or patch_model.area is not None or patch_model.mesh.file is not None:
        return []
    pieces = patch_model.pieces
    ratio = pieces.width / max(piece.height for piece in pieces.both)
    is_wide = ratio >= MIN_PLANE_STRAIN_WIDTH_RATIO
    if pieces.plane != "strain" or pieces.has_overhang or is_wide:
        return []
    stiffness = {}
    for free_sides in ("x", "xy"):
        cells = make_cells(patch_model, FIRST_CELLS, SIDE_LEVEL, free_sides)
        everywhere = np.ones(cells.normal.shape, bool)
        stiffness[free_sides] = [faces.compute_set_stiffness(one, everywhere) for one in cells]
    normal, shear = (100 * (plane / block - 1) for plane, block in zip(*stiffness.values()))
    return [
        f"plane strain makes flat pieces {normal:.2g} % stiffer under the load and {shear:.2g} % stiffer in shear than "
        f"blocks {ratio:.2g} times as wide as tall, whose four sides are free; [contact.area] computes the blocks"
    ]


def press_worn(patch: AreaPatch, worn: np.ndarray) -> AreaPatch:
    """Return the face of a patch on its cells with a worn depth (m,) [m] added to its unworn gap."""
    return press_face(patch.model, patch.cells, worn, patch.pressed.pressure)


def make_force_function(patch: AreaPatch):
    """Return a function that computes the contact forces between worn faces.

    It maps worn depth (m,) [m], which is added to the unworn gap, and softening (m,) [m/N], which is added to each cell, to
    forces (m,) [N]. Each contact starts from the one before.
    """
    model = patch.model
    cells = patch.cells
    unworn = compute_face_gap(model, cells.normal.x, cells.normal.y).heights
    latest = [patch.pressed.pressure]

    def compute_forces(worn, softening) -> np.ndarray:
        """Return the contact forces [N] for a worn depth [m] and a softening [m/N]."""
        gap = unworn + np.reshape(worn, unworn.shape)
        soft = np.reshape(softening, unworn.shape) if np.any(softening) else 0.0
        pressed = press_gap(model, cells, gap, soft, latest[0])
        latest[0] = pressed.pressed.pressure
        return pressed.normal_stress * pressed.slip_compliance.weight

    return compute_forces


def transfer_to_grid(values: np.ndarray, patch: AreaPatch, other: AreaPatch) -> np.ndarray:
    """Interpolate values at the cells of a face linearly to those of another grid.

    Parameters
    ----------
    values : (m,) ndarray
        Values at the cells of the face, in any unit.
    patch : AreaPatch
        Face with these m cells.
    other : AreaPatch
        Face with k cells on the same pieces.

    Returns
    -------
    (k,) ndarray
        Values at the cells of the other face.
    """
    rows = values.reshape(patch.shape)
    fine = patch.cells.normal
    coarse = other.cells.normal
    along_x = np.array([np.interp(coarse.x, fine.x, row) for row in rows])
    return np.array([np.interp(coarse.y, fine.y, column) for column in along_x.T]).T.ravel()


def find_nearest_contact(patch: AreaPatch) -> np.ndarray:
    """Return for each cell of a face the index (m,) of the nearest cell in contact; its own without contact."""
    from scipy.ndimage import distance_transform_edt

    active = patch.pressed.pressure > 0
    if not active.any():
        return np.arange(active.size)
    steps = (
        patch.cells.normal.y[1] - patch.cells.normal.y[0],
        patch.cells.normal.x[1] - patch.cells.normal.x[0],
    )
    nearest = distance_transform_edt(
        ~active, sampling=steps, return_distances=False, return_indices=True
    )
    return np.ravel_multi_index(tuple(nearest), active.shape).ravel()


def _find_start(pressure: np.ndarray, cells: BlockCompliance) -> np.ndarray | None:
    """Return a pressure on the same cells, or on cells half as long, from which the solver starts; None on others."""
    factor = cells.normal.shape[0] // len(pressure)
    fine = np.repeat(np.repeat(pressure, factor, axis=0), factor, axis=1)
    return fine if fine.shape == cells.normal.shape else None
