"""Pressed face: pressure that varies along x and y, on cells that are halved until the tolerance is met.

In: a `PatchModel` with an area. Out: `AreaPatch`es from fine to coarse, with the names of a `Patch`, whose points are the
cells. From grid to grid the bricks of the free sides become finer as well, so that every error that follows from the
changes over the grids, of a static measure as of a motion, contains both.
"""

from dataclasses import dataclass, replace
from functools import partial
from math import inf
from time import process_time

import numpy as np

from ...contact import cell_edges
from ...contact.cells import CellCompliance, make_block
from ...contact.press_cells import FaceLoading, PressedCells, press_cells
from ...core import Compliance, ContactState, Interface, Outcome, frozen_array
from ...elasticity.sides import BlockShape
from ...measures.errors import edge_errors, estimate_convergence_errors
from ...model.face import compute_face_gap
from ...model.patch import PatchModel
from ...model.pieces import make_layer_stacks
from ..refine import NO_LIMIT, Verdict, refine
from ..results.patch_rows import CELLS_SOURCE, Values, make_measure
from . import store
from .measures import (
    MIN_CONTACT_EDGE_ERROR_IN_CELLS,
    MIN_PLANE_STRAIN_WIDTH_RATIO,
    PRESSURE_PEAK_MEASURES,
    list_larger_terms,
    max_mesh_error_ratio,
)
from .press import Patch
from .values import AcrossValues, EdgeValues, assemble_static_values, estimate_face_peak

FIRST_CELLS = 64  # cells along the longer side of the coarsest grid
MIN_CELLS_ACROSS = (
    8  # smallest number of cells along the shorter side, which resolves the free sides
)
MIN_GRIDS = 3  # grids after which the order of convergence shows
# Factor in the estimate of the pressure at a free side (`may_peak_at_side`); on flat blocks of nine pairs of layers, whose
# shear moduli have ratios of 1 to 110, 64 cells needed up to 1
MAX_SIDE_RISE = 1.25
FREE_SIDE_REASON = "the largest pressure may be at a free side of the face, which only a run without [contact.area] resolves"
# Measures that follow the edge of contact, whose place between the cells has an irregular error of order 1. The pressure
# vanishes there, so that other measures hardly follow it. With the order that the changes show, 2 to 9 % of the errors of
# each stiffness did not hold on 33 blocks.
EDGE_MEASURES = (
    "normal_stiffness",
    "tangential_stiffness",
    "rotational_stiffness",
    "roll_stiffness",
)
NO_HALF_WIDTH_REASON = "a contact over a face has no half-width; contact_area is its area"


@dataclass(frozen=True, eq=False, slots=True)
class AreaPatch(Patch):
    """Patch whose pressure varies over a face.

    Its m = ny nx nodes are the cells, row by row along y. There are no meshes, and `pieces` and `slip_compliance` have
    operators over the cells (`contact.cells.CellCompliance`) in place of matrices; `pressed` is a `PressedCells`.
    """

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells (ny, nx)."""
        return self.pieces.normal.shape

    @property
    def y(self) -> np.ndarray:
        """Positions (m,) of the cells across the sliding direction [m]."""
        return np.repeat(self.pieces.normal.y, self.shape[1])


def make_cells(
    patch_model: PatchModel, n_cells: int, side_level: int, free_sides: str = "xy"
) -> Compliance:
    """Make the compliance of the cells of a face, with its layer of asperities; equal faces share one.

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

    Returns
    -------
    Compliance
        Its matrices are `CellCompliance`.
    """
    pieces = patch_model.pieces
    counts = _divide_sides(patch_model, n_cells)
    shape = BlockShape(pieces.length, pieces.width, free_sides, pieces.pairs)
    stacks = make_layer_stacks(patch_model)
    key = ("cells", shape, stacks, counts, side_level)
    normal, shear = store.get_or_compute(key, lambda: make_block(shape, stacks, counts, side_level))
    x = frozen_array(np.tile(normal.x, counts[1]))
    weight = frozen_array(np.full(x.size, normal.cell_area))
    interface = Interface(x, weight, pieces.width * pieces.pairs)
    layer, layer_shear = _compute_layer(patch_model)
    return Compliance(interface, normal.soften(layer), shear.soften(layer_shear))


def _compute_layer(patch_model: PatchModel) -> tuple[float, float]:
    """Return the normal and the shear compliance [m/Pa] of the layer of asperities of a patch; 0 without one.

    Without a tangential ratio the layer is rigid in shear.
    """
    skin = patch_model.interface.skin
    if skin is None:
        return 0.0, 0.0
    normal = 1 / skin.normal_stiffness
    return normal, normal / skin.tangential_ratio if skin.tangential_ratio else 0.0


def _divide_sides(patch_model: PatchModel, n_cells: int) -> tuple[int, int]:
    """Return the numbers of cells along x and y of a face, for their number along the longer side."""
    pieces = patch_model.pieces
    sides = pieces.length, pieces.width
    longer = max(sides)
    n_x, n_y = (max(MIN_CELLS_ACROSS, round(n_cells * side / longer)) for side in sides)
    return n_x, n_y


def press_face(
    patch_model: PatchModel, pieces: Compliance, worn=0.0, start: np.ndarray | None = None
) -> AreaPatch:
    """Solve the contact of a face with the gap of a patch.

    Parameters
    ----------
    patch_model : PatchModel
        Patch with an area.
    pieces : Compliance
        Compliance of the cells (`make_cells`).
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
    begin = process_time()
    normal = pieces.normal
    unworn, notes, seconds = compute_face_gap(patch_model, normal.x, normal.y)
    unloaded = unworn + np.reshape(worn, np.shape(worn) and normal.shape)
    pressed = press_cells(normal, unloaded, make_loading(patch_model), start)
    return AreaPatch(
        model=patch_model,
        pair=None,
        pieces=pieces,
        pressure=make_contact_state(pressed, normal, patch_model.gap.angle),
        slip_compliance=_make_slip_compliance(patch_model, pieces.tangential),
        unloaded_gap=frozen_array(unloaded.ravel()),
        notes=notes,
        seconds=seconds | {"press": process_time() - begin - sum(seconds.values())},
        pressed=pressed,
    )


def make_contact_state(pressed: PressedCells, normal: CellCompliance, angle: float) -> ContactState:
    """Return the contact of flattened cells, with resultants over all pairs.

    Parameters
    ----------
    pressed : PressedCells
    normal : CellCompliance
        Compliance of the cells.
    angle : float
        Tilt along x that the gap contains [rad].
    """
    force = pressed.pressure * normal.cell_area
    load = float(force.sum())
    return ContactState(
        sigma_n=frozen_array(pressed.pressure.ravel()),
        gap=frozen_array(pressed.gap.ravel()),
        approach=pressed.approach,
        rotation=angle + pressed.tilt_x,
        load=load,
        moment=float(force.sum(axis=0) @ normal.x),
        outcome=Outcome.DONE if load > 0 else Outcome.NO_CONTACT,
    )


def _make_slip_compliance(patch_model: PatchModel, shear: CellCompliance) -> CellCompliance:
    """Return the compliance with which cells slip one by one: of pieces that shear, asperities and holder."""
    if not patch_model.interface.has_shear:
        shear = replace(shear, waves=np.zeros(shear.shape), sides=None)
    spring = patch_model.loading.tangential_stiffness
    return shear.add_spring(1 / spring) if spring else shear


def make_loading(patch_model: PatchModel) -> FaceLoading:
    """Return load, load line, springs and hardness of a patch on cells."""
    loading = patch_model.loading
    face = patch_model.area
    hardness = (face and face.hardness) or inf
    if loading.load is None:
        return FaceLoading(approach=loading.approach, hardness=hardness)
    moment = loading.moment
    # A spring of the holder lets the piece rotate about both axes under a load line in the middle.
    spring = loading.rotational_stiffness
    line_y = 0.0 if face and spring and loading.across is None else loading.across
    return FaceLoading(
        load=loading.load,
        line_x=None if moment is None else moment / loading.load,
        line_y=line_y,
        spring_x=spring,
        spring_y=spring,
        hardness=hardness,
    )


def compute_face_values(patch: AreaPatch) -> Values:
    """Return the values of all static measures of a pressed face by name, in SI units.

    `patch_rows` defines the measures. A contact over a face has no half-width, so that it is nan.
    """
    pieces = patch.model.pieces
    pressure = patch.pressed.pressure
    state = patch.pressure
    active = pressure > 0
    area = pieces.length * pieces.width * pieces.pairs
    normal = patch.pieces.normal
    edges = cell_edges.find_face_edges(normal, pressure, patch.pressed.gap)
    compute_stiffness = partial(
        cell_edges.compute_contact_stiffness, active=active, shift=edges.shift
    )

    # What a face has in common with a patch whose pressure varies along x alone
    edge_values = EdgeValues(
        length=edges.fraction * pieces.length,
        width=np.nan,
        normal=compute_stiffness(normal),
        tangential=compute_stiffness(patch.pieces.tangential),
        rotational=compute_stiffness(normal, motion=normal.x),
    )
    # What only a face has
    hardness = patch.model.area.hardness
    across = AcrossValues(
        roll=patch.model.gap.roll + patch.pressed.tilt_y,
        moment=patch.normal_stress * patch.pieces.interface.weight @ patch.y,
        stiffness=compute_stiffness(normal, motion=normal.y[:, None]),
        yielded_fraction=None if hardness is None else (pressure >= hardness).mean(),
    )
    peak = min(estimate_face_peak(normal.x, normal.y, pressure), hardness or inf)
    values = assemble_static_values(pieces.length, area, state, peak, edge_values, across)
    return {name: float(value) for name, value in values.items()}


def may_peak_at_side(patch: AreaPatch) -> bool:
    """Return whether the largest pressure may be at a free side of the face.

    Under a stiff coating the pressure rises towards a side, over about the thickness of the coating, which may be less than
    a cell. Its estimate is the largest pressure of the outer cells times `MAX_SIDE_RISE` times the root of the shear modulus
    of the coating over that of the substrate. This rule bounds the rise that was measured on flat blocks of nine pairs of
    layers.
    """
    pressure = patch.pressed.pressure
    largest_inside = pressure[1:-1, 1:-1].max()
    at_side = max(part.max() for part in (pressure[[0, -1]], pressure[:, [0, -1]]))
    stacks = make_layer_stacks(patch.model)
    rigidity = max(stack.moduli[0][1] / stack.moduli[-1][1] for stack in stacks)
    return bool(at_side * MAX_SIDE_RISE * np.sqrt(max(rigidity, 1.0)) >= largest_inside)


def may_open_between_cells(pressure: np.ndarray) -> bool:
    """Return whether a face in full contact may be open in a region smaller than a square of four cells.

    `pressure` (ny, nx) [Pa] is that of the cells. The region may exist where the pressure falls to its lowest value by more
    than this value from one cell to the next, so that it reaches 0 within another cell.
    """
    row, column = np.unravel_index(np.argmin(pressure), pressure.shape)
    around = pressure[max(row - 1, 0) : row + 2, max(column - 1, 0) : column + 2]
    return bool(around.max() > 2 * around.min() > 0)


def with_face_measures(
    patches: "tuple[AreaPatch | None, ...]", tolerance: float
) -> "tuple[AreaPatch | None, ...]":
    """Return a face on successive grids, of which the finest one has its static measures with their errors.

    The errors follow from the changes over the grids (`estimate_convergence_errors`). Without a second grid they are None.

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
    active = patch.pressed.pressure > 0
    n_edge_sides = sum(np.count_nonzero(np.diff(active, axis=axis)) for axis in (0, 1))
    errors = estimate_convergence_errors(*series) if len(series) > 1 else {}
    if errors and n_edge_sides:
        by_edge = edge_errors(*series)
        errors |= {name: by_edge[name] for name in EDGE_MEASURES}

    # An edge of contact is known to a part of a cell, and no difference to less than its terms.
    larger_terms = list_larger_terms(values, pieces.length / 2, pieces.width / 2)
    edge_error = MIN_CONTACT_EDGE_ERROR_IN_CELLS * n_edge_sides / active.size
    if may_open_between_cells(patch.pressed.pressure):
        edge_error += 4 / active.size
    area = pieces.length * pieces.width * pieces.pairs
    min_errors = {"contact_fraction": edge_error, "contact_area": edge_error * area}
    measures = {}
    for name, value in values.items():
        larger_term = larger_terms.get(name, 0.0)
        error = errors.get(name)
        if errors:
            # Smallest error that is stated, relative to a value and to the larger terms whose
            # difference it is; the contact is solved to 1e-8 of the displacement
            min_error = 1e-7 * max(abs(value), larger_term)
            error = max(error, min_error, min_errors.get(name, 0.0))
        measure = make_measure(name, value, error, CELLS_SOURCE)
        measures[name] = replace(measure, floor=max(measure.floor, tolerance * larger_term))

    # Measures without a value, for a reason
    reasons = {"contact_half_width": NO_HALF_WIDTH_REASON}
    if may_peak_at_side(patch) and not values.get("yielded_fraction"):
        reasons |= dict.fromkeys(PRESSURE_PEAK_MEASURES, FREE_SIDE_REASON)
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

    def press(level: int, coarser: "tuple[AreaPatch, ...] | None") -> "tuple[AreaPatch, ...]":
        """Press the face on the cells and bricks of a level, from the pressure on the grid before."""
        # Level of the finest bricks of the free sides, which grids from the third on have; the next
        # one takes four times as long
        pieces = make_cells(patch_model, counts[level], min(level, 2))
        if not coarser:
            return (press_face(patch_model, pieces),)
        start = _find_start(coarser[0].pressed.pressure, pieces.normal.shape)
        patches = (press_face(patch_model, pieces, start=start), *coarser)
        return with_face_measures(patches, tolerance) if level >= MIN_GRIDS - 1 else patches

    def judge(patches: "tuple[AreaPatch, ...]", _) -> Verdict:
        """Return the next level as long as measures miss the tolerance."""
        level = len(patches)
        if level < MIN_GRIDS:
            return Verdict(inf, level)
        excess = max_mesh_error_ratio(patches[0].measures, tolerance)
        has_contact = patches[0].pressure.outcome is not Outcome.NO_CONTACT
        is_finer = excess > 1 and has_contact and level < len(counts)
        return Verdict(excess, level if is_finer else None)

    if not with_errors:
        return with_face_measures((*press(MIN_GRIDS - 1, None), None), tolerance)
    return refine(press, 0, judge, NO_LIMIT)[0]


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
        cells = make_cells(patch_model, FIRST_CELLS, 1, free_sides)
        everywhere = np.ones(cells.normal.shape, bool)
        stiffness[free_sides] = [
            cell_edges.compute_contact_stiffness(part, everywhere)
            for part in (cells.normal, cells.tangential)
        ]
    normal, shear = (100 * (plane / block - 1) for plane, block in zip(*stiffness.values()))
    return [
        f"plane strain makes flat pieces {normal:.2g} % stiffer under the load and {shear:.2g} % stiffer in shear than "
        f"blocks {ratio:.2g} times as wide as tall, whose four sides are free; [contact.area] computes the blocks"
    ]


def press_worn(patch: AreaPatch, worn: np.ndarray) -> AreaPatch:
    """Return the face of a patch on its cells with a worn depth (m,) [m] added to its unworn gap."""
    return press_face(patch.model, patch.pieces, worn, patch.pressed.pressure)


def make_force_function(patch: AreaPatch):
    """Return a function that computes the contact forces between worn faces.

    It maps worn depth (m,) [m], which is added to the unworn gap, and softening (m,) [m/N], which is added to each cell, to
    forces (m,) [N]. Each contact starts from the one before.
    """
    normal = patch.pieces.normal
    unworn = compute_face_gap(patch.model, normal.x, normal.y).heights
    loading = make_loading(patch.model)
    latest = [patch.pressed.pressure]

    def compute_forces(worn, softening) -> np.ndarray:
        """Return the contact forces [N] for a worn depth [m] and a softening [m/N]."""
        local = np.reshape(softening, np.shape(softening) and normal.shape) * normal.cell_area
        gap = unworn + np.reshape(worn, normal.shape)
        latest[0] = press_cells(normal.soften(local), gap, loading, latest[0]).pressure
        return latest[0].ravel() * normal.cell_area

    return compute_forces


def _find_start(pressure: np.ndarray, shape: tuple[int, int]) -> np.ndarray | None:
    """Return a pressure on as many cells, or on cells half as long, from which the solver starts; None on others."""
    factor = shape[0] // len(pressure)
    fine = np.repeat(np.repeat(pressure, factor, axis=0), factor, axis=1)
    return fine if fine.shape == shape else None
