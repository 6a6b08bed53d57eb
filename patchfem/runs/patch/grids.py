"""Grids of a patch, refined at ends of contact, corners, coating and waves of the gap.

In: a `PatchModel`. Out: the coarsest grids of its pieces. They follow from the patch alone: the
contact is searched on columns that are graded to the result of the previous search, in plans
and runs alike. Every further grid splits all cells in two, so that the grids of a tighter
tolerance contain those of a wider one. `ladder` decides how many grids a run takes, `plan`
predicts it. Read `make_base_grids` first, then `make_layout`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ...elasticity.grid_fronts import predict_seconds
from ...mesh.grading import Layout, divide_into_columns, divide_into_rows
from ...mesh.tensor import TensorGrid
from ...model.pieces import extend_grid, find_rounded_edges
from . import slip_zones, store
from .condensed import CondensedPair, condense, delete_matrix_factors
from .press import Patch, solve_patch_contact
from .values import contact_ends

# Number of equal columns of the grid with which the search for the contact starts.
N_SEARCH_COLUMNS = 96
# Largest number of columns of the coarsest grid; a finer layout is coarsened everywhere.
MAX_COLUMNS = 120
# Each dict has a value for a static patch (True) and for a patch in motion (False), which gets
# fewer nodes because they lengthen every time step.
CELL_GROWTH = {
    True: 0.5,
    False: 0.9,
}  # Growth of the cell length with distance on the coarsest grid [1].
# Contact length divided by the length of the coarsest cell at its edges.
EDGE_CELLS = {True: 20, False: 10}
# Shortest cell of the coarsest grid over the length: some tens of picometres, near round-off.
MIN_CELL_RATIO = 4e-9
# Factor by which cells at a step of the gap are shorter than cells at a contact edge.
STEP_CELL_FACTOR = 8
# Largest number of contact ends; with more, the contact consists of islands and gets equal columns.
MAX_CONTACT_ENDS = 12
# Smallest and largest load over the mean load that are expected under a varying load.
LOAD_RANGE_FACTORS = (0.5, 1.5)
# Longest cell over the length of the interface if wear may move the contact edges anywhere.
MAX_WEAR_CELL_RATIO = 1 / 48
# Number of cells along a contact of one or two nodes in the next search.
N_CELLS_PER_SMALL_CONTACT = 64
# Number of cells per wavelength of the gap, in the search and in the third grid.
N_CELLS_PER_WAVE = 16
# Smallest local pressure maximum, relative to the largest pressure, around which the mesh is refined.
MIN_PEAK_RATIO = 0.3
N_CELLS_PER_PEAK = 4  # Number of cells of the coarsest grid per half-width of a pressure maximum.
# Number of coarsest cells in a slip zone; the third grid has 16, which give the work to about 1 %.
N_CELLS_PER_SLIP_ZONE = 4
# Largest search cell over the layout cell in a slip zone; above it the search is repeated.
MAX_SEARCH_CELL_RATIO = 4.0
# Largest number of searches; the columns of each are graded to the previous result.
MAX_SEARCHES = 8
# Change of a band over its cell length below which the search ends, because the next search would
# have the same columns.
BAND_CHANGE_TOL = 0.1
MIN_LEVELS = 3  # Smallest number of nested meshes from which an order of convergence is seen.
# Largest predicted CPU time [s] of condensing a mesh that is still tried, by whether the patch is static.
MAX_CONDENSING_SECONDS = {True: 3.0, False: 0.4}
# Ratio of the CPU times of condensing an unstructured mesh and a tensor grid.
UNSTRUCTURED_COST_FACTOR = 4.0


@dataclass(frozen=True, eq=False, slots=True)
class ContactExtent:
    """Region of contact with its edges, corners, pressure maxima and slip zones.

    - span: (start, end) [m] of the loaded part of the interface.
    - places: positions [m] at which the pressure ends inside the interface, or the nodes of a
      contact that is too small to resolve.
    - corners: ends of the interface that carry pressure [m].
    - cell: longest cell [m] in which the contact ends; inf if it is not resolved.
    - crests: (position, half-width) [m] of the largest maxima of the pressure.
    - slip_zones: (start, end) [m] of the parts in which a prescribed slide causes slip.
    """

    span: tuple
    places: tuple
    corners: tuple
    cell: float
    crests: tuple = ()
    slip_zones: tuple = ()

    @property
    def width(self) -> float:
        """Length [m] of the loaded part of the interface."""
        return self.span[1] - self.span[0]


def condense_on_search_grid(patch_model) -> CondensedPair:
    """Return the pieces condensed on equal columns, on which the contact search starts.

    Patches of the same geometry share them.
    """
    layout = make_search_layout(patch_model)
    key = (
        "search",
        layout,
        patch_model.pieces.lower,
        patch_model.pieces.upper,
        patch_model.pieces.plane,
        patch_model.pieces.width * patch_model.pieces.pairs,
        patch_model.mesh.is_static,
        patch_model.gap.jumps,
    )
    return store.get_or_compute(
        key, lambda: delete_matrix_factors(condense(patch_model, *make_grids(patch_model, layout)))
    )


class BaseGrids(NamedTuple):
    """Coarsest grids of a patch, graded to its contact.

    There is a single grid if the pieces are alike.

    contact: ContactExtent to which the grids are graded; None without a load.
    """

    bodies: list
    contact: ContactExtent | None


def make_base_grids(patch_model) -> BaseGrids:
    """Return the coarsest grids of a `PatchModel`, graded to its contact region.

    The result is cached, because the plan of a run and the run itself need the same grids.
    """
    has_files = patch_model.mesh.file is not None or patch_model.gap.profile is not None
    key = ("base grids", patch_model if has_files else store.content_key(patch_model))
    return store.get_or_compute(key, lambda: _search_contact(patch_model))


def _search_contact(patch_model) -> BaseGrids:
    """Find the contact region on grids that are graded anew in every iteration.

    If a varying load moves the edges of the contact, the columns are fine wherever the edges lie
    between LOAD_RANGE_FACTORS times the load; if wear moves them, no column is longer than MAX_WEAR_CELL_RATIO of the
    interface.
    """
    sweep = []
    if patch_model.mesh.edge_motion == "load" and patch_model.loading.load is not None:
        sweep = [
            patch_model.with_loading(load=share * patch_model.loading.load)
            for share in LOAD_RANGE_FACTORS
        ]
    layout = make_search_layout(patch_model)
    contact = None
    # Without a load there is no contact to search for.
    for search in range(MAX_SEARCHES if patch_model.nominal_load > 0 else 0):
        if search == 0:
            pair = condense_on_search_grid(patch_model)
        else:
            pair = condense(patch_model, *make_grids(patch_model, layout))
        x = pair.grid.x
        extents = []
        for loaded_model in (patch_model, *sweep):
            patch = solve_patch_contact(loaded_model, pair)
            extents.append(contact_extent(patch, patch_model.mesh.slip))
        contact = extents[0]
        last = layout
        layout = make_layout(patch_model, extents)
        cells = max(extent.cell / extent.width for extent in extents)
        shows = _resolves_waves(patch_model, x, layout) and _resolves_slip_zones(
            contact.slip_zones, x, layout
        )
        if cells <= 1 / (EDGE_CELLS[patch_model.mesh.is_static] - 1) and shows:
            break
        if _have_bands_converged(layout, last):
            break
    return BaseGrids(make_grids(patch_model, layout), contact)


def _have_bands_converged(layout: Layout, last: Layout) -> bool:
    """Return whether the graded bands of two successive column layouts agree."""
    if len(layout.bands) != len(last.bands):
        return False
    bands = np.reshape(layout.bands, (-1, 3))
    last_bands = np.reshape(last.bands, (-1, 3))
    cells = np.minimum(bands[:, 2:], last_bands[:, 2:])
    return bool((np.abs(bands - last_bands) <= BAND_CHANGE_TOL * cells).all())


def _resolves_slip_zones(zones: tuple, x, layout: Layout) -> bool:
    """Return whether columns at x (k,) [m] resolve the slip zones of a patch.

    Their cells are at most MAX_SEARCH_CELL_RATIO times those of a layout.
    """
    midpoint = (x[1:] + x[:-1]) / 2
    long = np.diff(x)
    for low, high in zones:
        inside = (x[1:] > low) & (x[:-1] < high)
        if (long[inside] > MAX_SEARCH_CELL_RATIO * layout.cell_lengths(midpoint[inside])).any():
            return False
    return True


def _resolves_waves(patch_model, x, layout: Layout) -> bool:
    """Return whether columns at x (k,) [m] resolve the pressure maxima on a wavy surface.

    The limit is twice the cells of a layout.
    """
    if _max_wave_cell(patch_model) == np.inf or x.size > MAX_COLUMNS:
        return True
    return bool((np.diff(x) <= 2 * layout.cell_lengths((x[1:] + x[:-1]) / 2)).all())


def _max_wave_cell(patch_model) -> float:
    """Return the longest cell [m] that resolves the waves of the gap; inf without waves."""
    return min(
        patch_model.gap.wave / N_CELLS_PER_WAVE,
        np.inf if patch_model.gap.profile is None else patch_model.uniform_element_size,
    )


def make_search_layout(patch_model) -> Layout:
    """Return the layout of equal columns on which the search for the contact starts."""
    half = patch_model.pieces.length / 2
    cell = min(patch_model.pieces.length / N_SEARCH_COLUMNS, _max_wave_cell(patch_model))
    return Layout(-half, half, (), (-half, half), cell, cell, 0.0)


def make_layout(patch_model, extents: list) -> Layout:
    """Return the column layout of the coarsest mesh, graded towards the ends of given contacts.

    extents: ContactExtents, of one patch under several loads or of several patches.
    """
    length = patch_model.pieces.length
    half = length / 2
    span = (min(extent.span[0] for extent in extents), max(extent.span[1] for extent in extents))
    width = min(extent.width for extent in extents)
    thick = _thinner_coating(patch_model)
    # The third mesh, whose cells are a quarter as long, has to resolve the waves.
    max_cell = min(length / 12, 4 * _max_wave_cell(patch_model))
    if max(len(extent.places) for extent in extents) > MAX_CONTACT_ENDS:
        return Layout(-half, half, (), span, *(2 * [min(length / 64, max_cell)]), 0.0)
    if patch_model.mesh.edge_motion == "wear":
        max_cell = min(max_cell, length * MAX_WEAR_CELL_RATIO)
    inside = min(width / 6, length / 24, max_cell)
    # A contact of one or two nodes is searched for again with shorter cells.
    along = N_CELLS_PER_SMALL_CONTACT
    if np.isfinite(max(extent.cell for extent in extents)):
        along = EDGE_CELLS[patch_model.mesh.is_static]
    # A band along the path of a moving edge would need many cells, and each of them changes the
    # contact set.
    fine = thick / 4 if thick and patch_model.mesh.edge_motion != "load" else np.inf
    min_cell = max(min(width / along, fine), MIN_CELL_RATIO * length)
    bands = _make_edge_bands([extent.places for extent in extents], min_cell)
    # A jump of the gap lies on a node; quantities that depend on it converge at first order in the
    # cell length.
    bands += tuple((place, place, min_cell / STEP_CELL_FACTOR) for place in patch_model.gap.jumps)
    known, fall = find_rounded_edges(patch_model)
    near = [place for place in known if span[0] - min_cell <= place <= span[1] + min_cell]
    bands += tuple((place, place, min(min_cell, fall / 4)) for place in near)
    sharp = STEP_CELL_FACTOR if patch_model.has_singular_ends else 1
    if _max_wave_cell(patch_model) < np.inf:
        crests = [crest for extent in extents for crest in extent.crests]
        bands += tuple(
            (place, place, max(half / N_CELLS_PER_PEAK, min_cell / STEP_CELL_FACTOR))
            for place, half in crests
        )
    bands += tuple(
        (low, high, max((high - low) / N_CELLS_PER_SLIP_ZONE, MIN_CELL_RATIO * length))
        for extent in extents
        for low, high in extent.slip_zones
    )
    corner = max(
        min(
            thick / 16 if thick else np.inf, width / EDGE_CELLS[patch_model.mesh.is_static] / sharp
        ),
        MIN_CELL_RATIO * length,
    )
    ends = {place for extent in extents for place in extent.corners}
    bands += tuple((place, place, corner) for place in sorted(ends))
    # At the far corners, where a free side meets the holder, the stresses are singular.
    bands += tuple(
        (side * half, side * half, min(patch_model.pieces.height, length) / 20) for side in (-1, 1)
    )
    return Layout(
        -half,
        half,
        bands,
        span,
        max(inside, min_cell),
        max_cell,
        CELL_GROWTH[patch_model.mesh.is_static],
    )


def _make_edge_bands(edge_positions: list, min_cell: float) -> tuple:
    """Return the bands of fine columns around the contact edges.

    If the number of edges is the same in all contacts, a band covers the range that its edge
    sweeps.
    """
    if len({len(positions) for positions in edge_positions}) == 1:
        return tuple(
            (min(sweep), max(sweep), min_cell) for sweep in zip(*edge_positions, strict=True)
        )
    return tuple((place, place, min_cell) for positions in edge_positions for place in positions)


def _thinner_coating(patch_model) -> float:
    """Return the thickness [m] of the thinner of the coatings; 0 without a coating."""
    return min(
        (
            piece.thickness
            for piece in (patch_model.pieces.lower, patch_model.pieces.upper)
            if piece.thickness
        ),
        default=0.0,
    )


def contact_extent(patch: Patch, slip=None) -> ContactExtent:
    """Return the contact region of a patch, or without contact the cells at its smallest gap.

    A smooth skin carries pressure everywhere; the part with a thousandth of the largest pressure
    counts.

    Parameters
    ----------
    patch : Patch
    slip : PrescribedSlip, optional
        Slide of the holders; None if nothing slips in part.
    """
    x = patch.x
    sigma = patch.pressure.sigma_n
    if not (sigma > 0).any():
        least = int(np.argmin(patch.pressure.gap))
        low = float(x[max(least - 1, 0)])
        high = float(x[min(least + 1, x.size - 1)])
        return ContactExtent((low, high), (float(x[least]),), (), np.inf)
    strips = patch.strips.pressure if patch.strips is not None else sigma[None]
    bears = strips > (1e-3 * strips.max() if patch.skin is not None else 0.0)
    index = np.flatnonzero(bears.any(axis=0))
    low = x[max(index[0] - 1, 0)]
    high = x[min(index[-1] + 1, x.size - 1)]
    # For a contact of few nodes, the next search has shorter cells around it.
    if index.size < 4 and index.size < x.size:
        return ContactExtent((float(low), float(high)), tuple(x[index].tolist()), (), np.inf)
    changes = np.flatnonzero((bears[:, 1:] != bears[:, :-1]).any(axis=0))
    places = (x[changes] + x[changes + 1]) / 2
    cells = np.diff(x)[changes]
    found = contact_ends(patch)
    if len(found) == changes.size:
        places = np.array([end.position for end in found])
    corners = tuple(float(x[at]) for at in (0, -1) if bears[:, at].any())
    low = places[0] if index[0] else x[0]
    high = places[-1] if index[-1] < x.size - 1 else x[-1]
    return ContactExtent(
        (float(low), float(high)),
        tuple(places.tolist()),
        corners,
        float(cells.max(initial=0.0)),
        _pressure_peaks(x, sigma),
        slip_zones.slip_zones(patch, slip, found) if slip is not None else (),
    )


def _pressure_peaks(x, sigma) -> tuple:
    """Return (position, half-width) [m] of the maxima of the pressures (m,) [Pa] in a contact.

    Both follow from the parabola through three nodes.
    """
    peak_node = np.flatnonzero(
        (sigma[1:-1] > MIN_PEAK_RATIO * sigma.max())
        & (sigma[1:-1] > sigma[:-2])
        & (sigma[1:-1] >= sigma[2:])
    )
    increase = np.diff(sigma) / np.diff(x)
    bend = -2 * np.diff(increase)[peak_node] / (x[peak_node + 2] - x[peak_node])
    half_width = np.sqrt(2 * sigma[peak_node + 1] / bend)
    if peak_node.size > MAX_CONTACT_ENDS:
        return ()
    return tuple(zip(x[peak_node + 1].tolist(), half_width.tolist()))


def make_grids(patch_model, layout: Layout) -> list:
    """Return the grids of both pieces with the columns of a layout; one grid if they are alike."""
    pieces = (patch_model.pieces.lower, patch_model.pieces.upper)
    if patch_model.pieces.are_alike:
        pieces = pieces[:1]
    x = make_columns(patch_model, layout)
    return [
        extend_grid(
            patch_model,
            piece,
            make_grid(patch_model, x, piece),
            1 + CELL_GROWTH[patch_model.mesh.is_static],
        )
        for piece in pieces
    ]


def make_columns(patch_model, layout: Layout) -> np.ndarray:
    """Return the node positions (k,) [m] of a column layout with at most MAX_COLUMNS columns."""
    x = divide_into_columns(layout, patch_model.gap.jumps)
    while x.size > MAX_COLUMNS + 1 and layout.bands:
        layout = layout.scale_cells(x.size / MAX_COLUMNS)
        x = divide_into_columns(layout, patch_model.gap.jumps)
    return x


def make_grid(patch_model, x, piece) -> TensorGrid:
    """Return the tensor grid of a piece.

    Its rows are as fine as the columns at the interface, at the inner face of the coating and at
    the holder.

    Parameters
    ----------
    patch_model : PatchModel
    x : (k,)
        Positions of the nodes along the interface [m].
    piece : PatchPiece
    """
    thick = piece.thickness
    height = piece.height
    first_row = float(np.diff(x).min())
    # A row is at most a tenth of the length, in a tall piece at most 1/24 of the height, and never
    # more than 1/6 of the height.
    cap = min(max(patch_model.pieces.length / 10, height / 24), height / 6)
    bands = [(0.0, 0.0, first_row), (height, height, min(height, patch_model.pieces.length) / 60)]
    if thick:
        bands.append((thick, thick, max(thick / 4, first_row)))
    layout = Layout(
        0.0, height, tuple(bands), (0.0, height), cap, cap, CELL_GROWTH[patch_model.mesh.is_static]
    )
    depth, coated = divide_into_rows(layout, thick)
    return TensorGrid(frozen_array(x), depth, coated)


def count_nodes(body) -> tuple:
    """Return the numbers of node columns and node rows of a body."""
    plan = body.base_grid
    if plan is None:
        return body.x.size, max(3, round(len(body.points) / body.x.size))
    return (plan.x.size if plan is body else len(body.points) // plan.depth.size), plan.depth.size


def is_mirrored(body) -> bool:
    """Return whether a body is a plain tensor grid that is its own mirror image."""
    return body.base_grid is body and bool(
        np.abs(body.x + body.x[::-1]).max() <= 1e-12 * body.length
    )


def predict_condensing_seconds(bodies) -> float:
    """Predict the CPU time [s] of condensing the bodies of a patch.

    bodies: (lower, upper or None), or a single one for alike pieces.
    """
    total = 0.0
    for body in bodies:
        if body is not None:
            factor = 1.0 if body.base_grid is body else UNSTRUCTURED_COST_FACTOR
            total += factor * predict_seconds(*count_nodes(body), is_mirrored(body))
    return total
