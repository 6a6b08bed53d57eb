"""Grids of a patch, refined at contact edges, corners, coatings and waves of the gap.

In: a `PatchModel`. Out: the coarsest grids of its pieces. They depend on the patch alone, so that
plans and runs use the same grids: the contact is searched for on columns that are graded to the
result of the previous search. Every finer grid splits all cells in two, so that the grids for a
small tolerance contain those for a large one. `NestedMeshes` decides how many grids a run uses, and
`plan` predicts their number. Read `make_base_grids` first, then `make_column_layout`.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import chain
from math import copysign
from typing import Any, NamedTuple

import numpy as np

from ...mesh import pieces as piece_meshes
from ...mesh.grading import Layout, RowHeights, divide_into_columns, divide_into_rows
from ...mesh.grid import TensorGrid
from ...model.pieces import estimate_rounded_length, extend_grid, make_piece_meshes
from ..refine import Verdict
from . import store
from .condensed import condense
from .contact_search import (
    MAX_GRADED_CONTACT_ENDS,
    ContactExtent,
    ContactSearch,
    Pairs,
    SolvedContact,
)

# Largest number of columns of the coarsest grid; a layout with more columns is coarsened
# everywhere.
MAX_GRID_COLUMNS = 120
# Smallest ratio of cell length to interface length on the coarsest grid. For an interface of 10 mm this is a cell of 40 pm,
# whose length, a difference of coordinates, still has about 7 digits.
MIN_CELL_LENGTH_RATIO = 4e-9
# Ratio of the cell length at a contact edge to that at a step of the gap.
EDGE_TO_GAP_STEP_CELL_RATIO = 8
# Ratio of the longest cell to the length of the interface if wear may move the contact edges.
MAX_WEAR_CELL_LENGTH_RATIO = 1 / 48
# Number of cells of the coarsest grid per half-width of a pressure maximum.
N_CELLS_PER_PRESSURE_HALF_WIDTH = 4
# Number of cells in a slip zone on the coarsest grid; the third grid has 16, which give the work to
# about 1 %.
N_CELLS_PER_SLIP_ZONE = 4
# Largest ratio of a search cell in a slip zone to the cell of the layout; above it the search is
# repeated.
MAX_SLIP_ZONE_CELL_RATIO = 4.0
# The same ratio for the waves of a surface.
MAX_WAVE_CELL_RATIO = 2.0
# Largest distance from the position of a contact edge, in cells, at which the contact may end: the position lies up to a
# third of a cell inside the last loaded node (`contact.edges`), and the contact ends at the next node at most.
MAX_EDGE_REACH_IN_CELLS = 4 / 3
# Largest number of contact searches; each search uses columns graded to the result of the previous
# one.
MAX_CONTACT_SEARCHES = 8
# The same for many cases: the columns of their grids reach the limit in the second search, and a third one took 4 % of the
# CPU time of 100 loads, tilts and crowns without fewer meshes
MAX_SEARCHES_FOR_MANY = 2
# Smallest number of nested meshes at which the order of convergence is known.
MIN_NESTED_MESHES = 3
# Largest number of interface nodes of meshes that many cases share; a finer mesh slows down every case
MAX_SHARED_NODES = 500
# Number of nested meshes of many cases. The first one has cells twice as long as that of a single run, so that the finest of
# four takes the time of that of three, while errors of limits from four values are half as large
N_SHARED_MESHES = 4
# Largest number of columns of a mesh that has no coarser mesh.
MAX_COLUMNS_WITHOUT_COARSER = 8
# CPU time [s] of condensing a mesh over (number of nodes)^CONDENSING_NODE_EXPONENT
CONDENSING_SECONDS_PER_NODE = 4.2e-6
CONDENSING_NODE_EXPONENT = 1.1

Bands = list[tuple[float, float, float]]  # (from, to, cell length) [m], as in `Layout.bands`


class GridDensity(NamedTuple):
    """How short the cells of a coarsest grid are, and how many nodes its finer grids may have.

    - cell_growth: growth of the cell length with the distance from the contact [1].
    - n_edge_cells: ratio of the contact length to the cell length at the contact edges.
    - max_condensing_seconds: largest predicted CPU time [s] of condensing a mesh; more expensive ones are not tried.
    """

    cell_growth: float
    n_edge_cells: int
    max_condensing_seconds: float


FINE_GRID_DENSITY = GridDensity(0.5, 20, 3.6)
# For a patch in a rig or with wear: every node slows down each time step or jump.
COARSE_GRID_DENSITY = GridDensity(0.9, 10, 0.8)


def choose_density(patch_model) -> GridDensity:
    """Return how dense the grids of a patch are: coarser in a rig or with wear, where each node slows down every step."""
    return FINE_GRID_DENSITY if patch_model.mesh.is_fine else COARSE_GRID_DENSITY


class BaseGrids(NamedTuple):
    """Coarsest grids of the pieces of a patch, graded towards the contact region.

    There is a single grid if the pieces are identical. `contact` is the region to which the grids are graded, None
    without a load.
    """

    bodies: list[TensorGrid]
    contact: ContactExtent | None


def make_base_grids(patch_model) -> BaseGrids:
    """Return the coarsest grids of a `PatchModel`, graded towards its contact region.

    Every grid of a run halves the cells of these ones, so that the choice of the columns and rows
    changes the error of a measure, but not the value to which it converges; the printed error is
    estimated from the halved cells. The result is cached, because the plan of a run and the run
    itself use the same grids.

    Parameters
    ----------
    patch_model : PatchModel
        Its load may be 0; the columns are even then.

    Returns
    -------
    BaseGrids
    """
    key = ("base grids", store.content_key(patch_model))

    def search() -> BaseGrids:
        """Search for the contact region, and grade the grids to it."""
        layout, contact = search_layout([ContactSearch(patch_model, 1)])
        return BaseGrids(make_grids(patch_model, layout), contact)

    return store.get_or_compute(key, search)


def search_layout(searches: Sequence[ContactSearch]) -> tuple[Layout, ContactExtent | None]:
    """Search for the contacts of patches of equal geometry on grids that are graded towards the previous result.

    The contact is solved on a coarse grid, and the columns of the next grid are short at the edges of this
    contact. The search ends when the cells at all edges are short compared to the contact, after
    MAX_CONTACT_SEARCHES or MAX_SEARCHES_FOR_MANY solutions at most.

    If a varying load moves the contact edges, the columns are short wherever the edges lie between
    VARYING_LOAD_FACTORS times the load. If wear moves them, no column is longer than
    MAX_WEAR_CELL_LENGTH_RATIO times the interface.

    Parameters
    ----------
    searches : sequence of ContactSearch
        Patches with the same pieces, steps and mesh settings.

    Returns
    -------
    layout : Layout
        Columns of the coarsest grid; even ones without a load.
    contact : ContactExtent or None
        Contact region of the first solved case; None without a load or a solution.

    Raises
    ------
    PatchfemError
        If there is only one case, and it cannot be solved.
    """
    patch_model = searches[0].patch_model
    has_many = any(search.n_cases > 1 for search in searches)
    layout = make_search_layout(patch_model)
    contact = None
    for _ in range(MAX_SEARCHES_FOR_MANY if has_many else MAX_CONTACT_SEARCHES):
        pair = condense(patch_model, *make_grids(patch_model, layout), keep_factors=False)
        solved = list(chain.from_iterable(search.find_contacts(pair) for search in searches))

        # Without a load there is no contact to search for. The run of a single patch reports its error.
        if not solved:
            if len(searches) == 1 and not has_many and searches[0].error is not None:
                raise searches[0].error
            break
        contact = solved[0].extents[0]
        layout = make_common_layout(solved)

        # The search ends when this grid has resolved all contacts.
        max_ratio = 1 / (choose_density(patch_model).n_edge_cells - 1)
        is_resolved = True
        for case, extents in solved:
            edge_cell_ratio = max(extent.cell / extent.width for extent in extents)
            is_resolved &= edge_cell_ratio <= max_ratio
            is_resolved &= _resolves_contact(case, pair.grid.x, layout, extents[0].slip_zones)
        if is_resolved:
            break
    return layout, contact


def make_common_layout(solved: list[SolvedContact]) -> Layout:
    """Return the columns of the coarsest grid for the contacts of patches of equal geometry."""
    return _merge_layouts([make_column_layout(*one) for one in solved])


def _resolves_span(layout: Layout, x, ratio: float, span: tuple[float, float]) -> bool:
    """Return whether all columns at x (k,) [m] inside a span (start, end) [m] are short enough.

    A column is short enough if its length is at most `ratio` times the cell length that `layout` asks for at its middle.
    """
    inside = (x[1:] > span[0]) & (x[:-1] < span[1])
    middle = (x[1:] + x[:-1])[inside] / 2
    return bool((np.diff(x)[inside] <= ratio * layout.cell_lengths(middle)).all())


def _resolves_contact(patch_model, x, layout: Layout, zones: Pairs) -> bool:
    """Return whether columns at x (k,) [m] resolve the maxima on a wavy surface and the slip zones [m]."""
    has_waves = _max_wave_cell(patch_model) < np.inf and x.size <= MAX_GRID_COLUMNS
    if has_waves and not _resolves_span(layout, x, MAX_WAVE_CELL_RATIO, (x[0], x[-1])):
        return False
    zones = (*zones, *_list_rounded_zones(patch_model, layout))
    return all(_resolves_span(layout, x, MAX_SLIP_ZONE_CELL_RATIO, zone) for zone in zones)


def _list_rounded_zones(patch_model, layout: Layout) -> Pairs:
    """Return the (start, end) [m] of the parts of rounded ends to which a layout is graded."""
    flat = patch_model.pieces.flat_half_length
    return tuple(band[:2] for band in layout.bands if flat in (band[0], -band[1]))


def _max_wave_cell(patch_model) -> float:
    """Return the longest cell [m] that resolves the waves of the gap; inf without waves."""
    # Number of cells per wavelength of the gap, in the search and on the third grid.
    return min(
        patch_model.gap.wave / 16,
        np.inf if patch_model.gap.profile is None else patch_model.uniform_element_size,
    )


def make_search_layout(patch_model) -> Layout:
    """Return the layout of equal columns on which the search for the contact starts."""
    half = patch_model.pieces.length / 2
    # Number of equal columns of the grid on which the search for the contact starts.
    cell = min(patch_model.pieces.length / 96, _max_wave_cell(patch_model))
    return Layout(-half, half, (), cell, 0.0)


def make_column_layout(patch_model, extents: list[ContactExtent]) -> Layout:
    """Return the column layout of the coarsest mesh, graded towards given contact regions.

    The regions are those of one patch under several loads.
    """
    length = patch_model.pieces.length
    half = length / 2
    mesh = patch_model.mesh
    density = choose_density(patch_model)
    span = (min(extent.span[0] for extent in extents), max(extent.span[1] for extent in extents))
    width = min(extent.width for extent in extents)

    coating = _min_coating_thickness(patch_model)
    # The third mesh, whose cells are a quarter as long, has to resolve the waves.
    max_cell = min(length / 12, 4 * _max_wave_cell(patch_model))

    if max(len(extent.places) for extent in extents) > MAX_GRADED_CONTACT_ENDS:
        return Layout(-half, half, (), min(length / 64, max_cell), 0.0)
    if mesh.edge_motion == "wear":
        max_cell = min(max_cell, length * MAX_WEAR_CELL_LENGTH_RATIO)
    max_loaded_cell = min(width / 6, length / 24, max_cell)

    # A contact of one or two nodes is searched for again with shorter cells.
    # Number of cells along a contact of one or two nodes in the next search.
    n_contact_cells = 64
    if np.isfinite(max(extent.cell for extent in extents)):
        n_contact_cells = density.n_edge_cells
    # A band along the path of a moving edge would need many cells, each of which changes the
    # contact set.
    coating_cell = coating / 4 if mesh.edge_motion != "load" else np.inf
    min_cell = max(min(width / n_contact_cells, coating_cell), MIN_CELL_LENGTH_RATIO * length)

    bands = _make_edge_bands([extent.places for extent in extents], min_cell)
    # A node is placed on each step of the gap; the quantities there converge at first order in the
    # cell length.
    step_cell = min_cell / EDGE_TO_GAP_STEP_CELL_RATIO
    bands += _make_point_bands(patch_model.gap.step_edges, step_cell)

    # The contact on a rounded end has as many cells as a slip zone. On longer cells the contact may end before it.
    reach = MAX_EDGE_REACH_IN_CELLS * max(extent.cell for extent in extents)
    flat = patch_model.pieces.flat_half_length
    rounding = estimate_rounded_length(patch_model)
    for side, end in zip((-1, 1), span) if rounding else ():
        rounded = side * end - flat
        if rounded >= -reach:
            rounded = rounded if rounded > 0 else rounding
            low, high = sorted((side * flat, side * (flat + rounded)))
            cell = max(rounded / N_CELLS_PER_SLIP_ZONE, MIN_CELL_LENGTH_RATIO * length)
            bands.append((low, high, min(min_cell, cell)))

    # The half-width of a pressure maximum on a wavy surface, and a slip zone, are divided into at least
    # N_CELLS_PER_PRESSURE_HALF_WIDTH and N_CELLS_PER_SLIP_ZONE cells.
    corner_factor = EDGE_TO_GAP_STEP_CELL_RATIO if patch_model.has_singular_ends else 1
    has_waves = _max_wave_cell(patch_model) < np.inf
    for extent in extents if has_waves else ():
        for place, half_width in extent.crests:
            bands.append(
                (place, place, max(half_width / N_CELLS_PER_PRESSURE_HALF_WIDTH, step_cell))
            )
    for extent in extents:
        for start, stop in extent.slip_zones:
            cell = max((stop - start) / N_CELLS_PER_SLIP_ZONE, MIN_CELL_LENGTH_RATIO * length)
            bands.append((start, stop, cell))

    # At a loaded corner the pressure is singular or, under a coating, changes over its thickness.
    corner_cell = max(
        min(coating / 16, width / density.n_edge_cells / corner_factor),
        MIN_CELL_LENGTH_RATIO * length,
    )
    ends = set(chain.from_iterable(extent.corners for extent in extents))
    bands += _make_point_bands(sorted(ends), corner_cell)
    # The stresses are singular at the far corners, where a free side meets the holder.
    bands += _make_point_bands((-half, half), min(patch_model.pieces.height, length) / 20)
    bands.append((*span, max(max_loaded_cell, min_cell)))
    return Layout(-half, half, tuple(bands), max_cell, density.cell_growth)


def _merge_layouts(layouts: list[Layout]) -> Layout:
    """Merge column layouts of several loads or cases, taking the shortest cell of all of them at each position."""
    if len(layouts) == 1:
        return layouts[0]
    bands = set(chain.from_iterable(layout.bands for layout in layouts))
    bands = sorted(bands, key=lambda band: (band[2], band))
    max_length = min(layout.max_length for layout in layouts)
    slope = min(layout.slope for layout in layouts)
    merged = replace(layouts[0], bands=(), max_length=max_length, slope=slope)
    if not bands:
        return merged

    low, high, _ = np.array(bands).T
    positions = np.linspace(low, high, 5, axis=1)
    # Bands that do not shorten any cell are dropped, because most bands are redundant.
    cell_lengths = merged.cell_lengths(positions)
    needed_bands = []
    for k, band in enumerate(bands):
        if (cell_lengths[k] > band[2] * (1 + 1e-9)).any():
            needed_bands.append(band)
            cell_lengths = np.minimum(
                cell_lengths, replace(merged, bands=(band,)).cell_lengths(positions)
            )
    return replace(merged, bands=tuple(needed_bands))


def _make_point_bands(places, cell: float) -> Bands:
    """Return bands without width, which put a node at each position [m], between cells of a given length [m]."""
    return [(place, place, cell) for place in places]


def _make_edge_bands(edge_positions: list[tuple[float, ...]], min_cell: float) -> Bands:
    """Return the bands of short columns around the contact edges: (start, end, cell length) [m] of each.

    `edge_positions` are the edges [m] under each load. If all loads have equally many edges, each band covers the range
    over which its edge moves; otherwise each position has a band. `min_cell` [m] is the length of the columns.
    """
    if len(set(map(len, edge_positions))) == 1:
        return [(min(sweep), max(sweep), min_cell) for sweep in zip(*edge_positions)]
    return _make_point_bands(chain.from_iterable(edge_positions), min_cell)


def _min_coating_thickness(patch_model) -> float:
    """Return the thickness [m] of the thinner coating, or inf without a coating."""
    thicknesses = (piece.thickness for piece in patch_model.pieces.both)
    return min(filter(None, thicknesses), default=np.inf)


def make_grids(patch_model, layout: Layout) -> list[TensorGrid]:
    """Return the grids of both pieces with the columns of a layout; one grid for identical pieces.

    The columns are coarsened to MAX_GRID_COLUMNS if needed. The rows are as short as the columns at the
    interface, and also short at the inner face of the coating and at the holder.

    Parameters
    ----------
    patch_model : PatchModel
        Patch whose pieces are meshed.
    layout : Layout
        Column layout, from `make_column_layout`.

    Returns
    -------
    list of TensorGrid
    """
    # A node lies at each step, and where a flat part ends: the slope of the pressure is unbounded there.
    flat = patch_model.pieces.flat_half_length
    rounded = _list_rounded_zones(patch_model, layout)
    nodes = {*patch_model.gap.step_edges, *(copysign(flat, low) for low, _ in rounded)}
    x = divide_into_columns(layout, nodes)
    while x.size > MAX_GRID_COLUMNS + 1 and layout.bands:
        layout = layout.scale_cells(x.size / MAX_GRID_COLUMNS)
        x = divide_into_columns(layout, nodes)

    # Both pieces have the same columns, and each has rows of its own.
    first_row = float(np.diff(x).min())
    length = patch_model.pieces.length
    growth = choose_density(patch_model).cell_growth
    pieces = patch_model.pieces.both
    grids = []
    for piece in pieces[:1] if patch_model.pieces.are_alike else pieces:
        # The height of a row is at most a tenth of the length, or 1/24 of the height of a tall
        # piece, and never more than 1/6 of the height.
        rows = RowHeights(
            first=first_row,
            last=min(piece.height, length) / 60,
            coating=max(piece.thickness / 4, first_row),
            largest=min(max(length / 10, piece.height / 24), piece.height / 6),
            growth=growth,
        )
        rows = divide_into_rows(piece.height, piece.thickness, rows)
        grids.append(extend_grid(patch_model, piece, TensorGrid(x, *rows), 1 + growth))
    return grids


def halve_cells(bodies, count: int = 1) -> list:
    """Return the meshes of the pieces with all cells halved `count` times, without the missing one of identical pieces."""
    bodies = [body for body in bodies if body is not None]
    for _ in range(count):
        bodies = [body.refine() for body in bodies]
    return bodies


def predict_condensing_seconds(bodies) -> float:
    """Predict the CPU time [s] of condensing the pieces of a patch, from a fit to grids of 1e3 to 4e4 nodes.

    Parameters
    ----------
    bodies : iterable of TensorGrid, PieceMesh or None
        Meshes of the lower and the upper piece; None for the upper one of identical pieces.
    """
    return sum(
        CONDENSING_SECONDS_PER_NODE * body.n_nodes**CONDENSING_NODE_EXPONENT
        for body in bodies
        if body is not None
    )


def make_given_meshes(patch_model) -> "list[tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]]":
    """Return the meshes of a patch with prescribed element size or mesh file, from fine to coarse.

    The error follows from two coarser grids, or from the unstructured mesh with all edges halved. Meshes with few columns
    have none of them.
    """
    levels = [make_piece_meshes(patch_model)]
    n_levels = 3 if isinstance(levels[0][0], TensorGrid) else 2
    while len(levels) < n_levels and levels[-1][0].x.size > MAX_COLUMNS_WITHOUT_COARSER:
        levels.append(change_elements(levels[-1]))
    return levels


def change_elements(
    bodies: "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]",
) -> "tuple[piece_meshes.Mesh, piece_meshes.Mesh | None]":
    """Return grids with elements twice as long, or unstructured meshes, which have no coarser ones, with halved edges."""
    is_grid = isinstance(bodies[0], TensorGrid)
    lower, upper = (body and (body.coarsen() if is_grid else body.refine()) for body in bodies)
    return lower, upper


class SolvedMeshes(NamedTuple):
    """Solution of one or many patches on nested meshes.

    - n_meshes: number of meshes.
    - meshes: those of both pieces on the finest level.
    - excess: largest ratio of error to allowed error of the patches that go on.
    - solution: solution on all meshes.
    """

    n_meshes: int
    meshes: "Sequence[piece_meshes.Mesh | None]"
    excess: float
    solution: Any


class NestedMeshes:
    """Nested meshes of one or many patches, which `refine` halves until the patches meet their tolerance.

    At least MIN_NESTED_MESHES meshes are solved, because the error follows from the changes between them. The refinement
    ends if the next mesh would exceed the CPU time that is allowed for a patch. `PatchMesh.n_finer` more meshes follow.

    Parameters
    ----------
    patch_model : PatchModel
        Patch, or one of the patches with the same pieces.
    given : sequence
        Finer meshes if the scene prescribes them.
    is_shared : bool
        Whether many patches share the meshes, which are graded to all of their contacts.

    Attributes
    ----------
    n_needed : int
        Number of meshes that the errors need.
    n_finer : int
        Number of meshes that follow that of the static measures.
    """

    def __init__(self, patch_model, given=(), *, is_shared: bool = False):
        self.patch_model = patch_model
        self.given = given
        self.is_shared = is_shared
        self.n_finer = patch_model.mesh.n_finer
        self.n_needed = 1 + len(given)
        if patch_model.mesh.is_automatic:
            self.n_needed = N_SHARED_MESHES if is_shared else MIN_NESTED_MESHES

    def judge(self, done: SolvedMeshes, excesses: list[float]) -> Verdict:
        """Decide whether a finer mesh follows; `excesses` are those of the meshes before."""
        if not self.patch_model.mesh.is_automatic:
            finer = self.given[done.n_meshes - 1 :][:1]
            return Verdict(done.excess, *finer)
        finer = halve_cells(done.meshes)
        is_last = done.excess <= 1
        if done.n_meshes >= self.n_needed:
            is_last |= self.is_shared and finer[0].x.size > MAX_SHARED_NODES
            is_last = is_last or is_too_expensive(self.patch_model, finer)
        if is_last:
            if self.n_finer == 0:
                return Verdict(done.excess)
            self.n_finer -= 1
        return Verdict(done.excess, finer)


def is_too_expensive(patch_model, bodies) -> bool:
    """Return whether condensing the pieces on given meshes takes more CPU time than the finest mesh of a patch may take.

    To condense a piece is to compute its compliance at the interface nodes. `bodies` are the meshes of both pieces.
    """
    return predict_condensing_seconds(bodies) > choose_density(patch_model).max_condensing_seconds
