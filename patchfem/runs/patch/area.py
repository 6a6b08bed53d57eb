"""Pressed face: pressure that varies along x and y, on cells that are halved until the tolerance is met.

In: a `PatchModel` with an area. Out: `AreaPatch`es from fine to coarse, with the names of a `Patch`, whose points are the
cells. The errors of the static measures follow from two axes of resolution: the cells, and the bricks of the free sides.
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
from ...elasticity.sides import BlockShape, make_stack
from ...model.face import compute_face_gap
from ...model.patch import PatchModel
from ...model.pieces import make_elastic_layers
from ..results.patch_rows import CELLS_SOURCE, Arrays, Measures, Values, make_measure
from . import store
from .measures import (
    MIN_PLANE_STRAIN_WIDTH_RATIO,
    PRESSURE_PEAK_MEASURES,
    max_mesh_error_ratio,
)
from .press import Surface

FIRST_CELLS = 64  # cells along the longer side of the coarsest grid
MIN_CELLS_ACROSS = (
    8  # smallest number of cells along the shorter side, which resolves the free sides
)
MIN_GRIDS = 3  # grids after which the order of convergence shows
SIDE_LEVEL = 1  # level of the bricks of the free sides; the level before gives their error
# A boundary of cells counts this part of each of its sides too much (Yastrebov, Anciaux and Molinari, Tribology Letters
# 65, 2017).
BOUNDARY_SIDE_FRACTION = (np.pi - 1 + np.log(2)) / 24
MIN_RELATIVE_ERROR = 1e-7  # smallest relative error that is stated; the contact is solved to 1e-8
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
    - cells: compliance of the cells (normal and shear), with the layer of asperities.
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
    stacks = []
    for piece in (pieces.upper, pieces.lower):
        layers = make_elastic_layers(patch_model, piece)
        stacks.append(make_stack(piece.height, piece.thickness, layers))
    key = ("cells", shape, tuple(stacks), counts, side_level)
    return store.get_or_compute(key, lambda: make_block(shape, tuple(stacks), counts, side_level))


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
    shape = cells.normal.shape
    pairs = patch_model.pieces.pairs
    weight = cells.normal.cell_area * pairs

    # A layer of asperities is in series with the pieces; without a tangential ratio it is rigid in shear.
    skin = patch_model.interface.skin
    normal = cells.normal
    shear = cells.shear
    layer_shear = 0.0
    if skin is not None:
        normal = soften(normal, 1 / skin.normal_stiffness)
        if skin.tangential_ratio is not None:
            layer_shear = 1 / (skin.normal_stiffness * skin.tangential_ratio)
            shear = soften(shear, layer_shear)
    soft = soften(normal, softening * weight)
    pressed = faces.press_cells(soft, unloaded, make_loading(patch_model), start)

    # Pieces that do not shear leave the layer and the holder as the only compliance of slip.
    slip_cells = shear
    if not patch_model.interface.has_shear:
        rigid = replace(cells.shear, waves=np.zeros(shape), sides=None)
        slip_cells = SoftenedCells(rigid, layer_shear) if layer_shear else None
    spring = patch_model.loading.tangential_stiffness
    slip_compliance = FaceCompliance(slip_cells, 1 / spring if spring else 0.0, weight)
    return AreaPatch(
        patch_model,
        BlockCompliance(normal, shear),
        pressed,
        frozen_array(unloaded.ravel()),
        slip_compliance,
        ((), {"press": process_time() - begin}),
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

    The fraction in contact is corrected for the sides of the cells at its boundary (`BOUNDARY_SIDE_FRACTION`).
    """
    pieces = patch.model.pieces
    pressure = patch.pressed.pressure
    state = patch.pressure
    active = pressure > 0
    area = pieces.length * pieces.width * pieces.pairs
    load = state.load
    roll_moment = float(patch.normal_stress * patch.slip_compliance.weight @ patch.y)
    n_sides = sum(np.count_nonzero(np.diff(active, axis=axis)) for axis in (0, 1))
    fraction = float(active.sum() - BOUNDARY_SIDE_FRACTION * n_sides) / active.size
    peak = estimate_peak(pressure)
    values = {
        "normal_load": load,
        "contact_fraction": fraction,
        "contact_area": fraction * area,
        "pressure_peak": peak,
        "moment": state.moment,
        "rotation": state.rotation,
        "approach": state.approach,
        "pressure_centre": state.moment / load if load > 0 else 0.0,
        "pressure_centre_y": roll_moment / load if load > 0 else 0.0,
        "roll": patch.model.gap.roll + patch.pressed.tilt_y,
        "roll_moment": roll_moment,
        "loaded_fraction": load / (area * peak) if load > 0 else 0.0,
    }
    if patch.model.area.hardness is not None:
        values["yielded_fraction"] = float((pressure >= patch.model.area.hardness).mean())

    # Stiffness of the set in contact under an approach, a slide and two rotations, of all pairs.
    normal, shear = patch.cells
    motions = {
        "normal_stiffness": (normal, 1.0),
        "tangential_stiffness": (shear, 1.0),
        "rotational_stiffness": (normal, np.broadcast_to(normal.x, pressure.shape)),
        "roll_stiffness": (normal, np.broadcast_to(normal.y[:, None], pressure.shape)),
    }
    for name, (cells, motion) in motions.items():
        stiffness = faces.compute_set_stiffness(cells, active, motion) if load > 0 else 0.0
        values[name] = stiffness * pieces.pairs
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

    The error is that of the cells, from the changes over the grids, plus that of the free sides, from the change on the
    second grid when their bricks are refined. Without a second grid the errors are None.

    Parameters
    ----------
    patches : tuple of AreaPatch or None
        From fine to coarse.
    tolerance : float
        Relative error, which raises the floors of differences of larger terms.
    """
    patch, *others = patches
    coarser = [other for other in others if other is not None]
    series = [compute_face_values(one) for one in (patch, *coarser)]
    sides = {}
    if coarser:
        # The bricks change the compliance smoothly, so that the second grid shows their error.
        grid = coarser[0]
        model = grid.model
        cells = make_cells(model, max(grid.shape), SIDE_LEVEL - 1)
        gap = grid.unloaded_gap.reshape(grid.shape)
        other_sides = compute_face_values(press_gap(model, cells, gap, 0.0, grid.pressed.pressure))
        sides = {name: value - other_sides[name] for name, value in series[1].items()}
    measures = {}
    values = series[0]
    for name, value in values.items():
        error = None
        if sides:
            changes = -np.diff([row[name] for row in series])
            error = float(convergence_error(*changes)) + float(convergence_error(sides[name]))
            error = max(error, MIN_RELATIVE_ERROR * abs(value))
        measures[name] = make_measure(name, value, error, CELLS_SOURCE)
    half_width = make_measure("contact_half_width", 0.0, None, CELLS_SOURCE)
    measures["contact_half_width"] = replace(half_width, value=None, reason=NO_HALF_WIDTH_REASON)
    has_side_peak = is_peak_at_side(patch.pressed.pressure) and not values.get("yielded_fraction")
    for name in PRESSURE_PEAK_MEASURES if has_side_peak else ():
        measures[name] = replace(measures[name], value=None, error=None, reason=FREE_EDGE_REASON)
    return replace(patch, measures=_raise_floors(measures, patch.model, tolerance)), *others


def _raise_floors(measures: Measures, patch_model: PatchModel, tolerance: float) -> Measures:
    """Return measures whose floors cover differences of larger terms, as those of a plane patch do.

    These are the tolerance times half the length or half the width for the pressure centre, times the load for the
    moments, and times the rotations for the approach.
    """
    out = dict(measures)
    load = measures["normal_load"].value
    along = patch_model.pieces.length / 2
    across = patch_model.pieces.width / 2
    terms = {
        "pressure_centre": along,
        "pressure_centre_y": across,
        "moment": load * along,
        "roll_moment": load * across,
        "approach": abs(measures["rotation"].value) * along + abs(measures["roll"].value) * across,
    }
    for name, size in terms.items():
        out[name] = replace(out[name], floor=max(out[name].floor, tolerance * size))
    return out


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
    if not with_errors:
        patch = press_face(patch_model, make_cells(patch_model, counts[2], SIDE_LEVEL))
        return with_face_measures((patch, None), tolerance)

    patches = ()
    for count in counts:
        cells = make_cells(patch_model, count, SIDE_LEVEL)
        start = _double_cells(patches[0].pressed.pressure, cells) if patches else None
        patches = (press_face(patch_model, cells, start=start), *patches)
        if len(patches) < MIN_GRIDS:
            continue
        patches = with_face_measures(patches, tolerance)
        is_met = max_mesh_error_ratio(patches[0].measures, tolerance) <= 1
        if is_met or patches[0].pressure.outcome is Outcome.NO_CONTACT:
            break
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
    cells = make_cells(patch.model, max(patch.shape), SIDE_LEVEL)
    return press_face(patch.model, cells, worn, patch.pressed.pressure)


def make_force_function(patch: AreaPatch):
    """Return a function that computes the contact forces between worn faces.

    It maps worn depth (m,) [m], which is added to the unworn gap, and softening (m,) [m/N], which is added to each cell, to
    forces (m,) [N]. Each contact starts from the one before.
    """
    model = patch.model
    cells = make_cells(model, max(patch.shape), SIDE_LEVEL)
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


def _double_cells(pressure: np.ndarray, cells: BlockCompliance) -> np.ndarray | None:
    """Return a pressure on cells half as long, from which the solver starts; None if the grid is not doubled."""
    doubled = np.repeat(np.repeat(pressure, 2, axis=0), 2, axis=1)
    return doubled if doubled.shape == cells.normal.shape else None
