"""Grids of a patch, refined at ends of contact, corners, coating and waves of the gap.

In: a `PatchModel`. Out: the coarsest grids of its pieces. They follow from the patch alone: the
contact is searched on columns that are graded to the result of the previous search, in plans
and runs alike. Every further grid splits all cells in two, so that the grids of a tighter
tolerance contain those of a wider one. `ladder` decides how many grids a run takes, `plan`
predicts it. Read `base_grids` first, then `find_layout`.
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
from .condensed import Pair, condense, delete_factors
from .press import Patch, press_patch
from .values import contact_ends

SEARCH_CELLS = 96  # columns of the first search for the contact
# most columns of the coarsest grid; a layout with more is made coarser everywhere
MAX_COLUMNS = 120
# Each dict has a value for a patch at rest (True) and a value for a patch that moves (False), which
# gets fewer nodes because every time step takes longer with more of them.
SLOPE = {True: 0.5, False: 0.9}  # growth of the cells of the coarsest grid per distance [1]
EDGE_CELLS = {True: 20, False: 10}  # length of a contact over the coarsest cells at its edges
# shortest cell of the coarsest grid over the length: some tens of picometres, near round-off
MIN_CELL = 4e-9
STEP_CELLS = 8  # cells at a step of the gap are this many times shorter than those at an edge
# most ends of a contact; one with more consists of many islands and gets equal columns
MAX_PLACES = 12
SWING = (0.5, 1.5)  # multiples of the mean load between which a varying load is expected
# coarsest cell over the length of the interface if wear may move the edges anywhere
WEAR_CELL = 1 / 48
NODE_CELLS = 64  # cells along a contact of one or two nodes in the next search
WAVE_CELLS = 16  # cells per wave of the gap, in the search and in the third grid
# cells are graded to those maxima of the pressure that exceed this fraction of the largest
CREST = 0.3
CREST_CELLS = 4  # cells of the coarsest grid in the half-width of a maximum of the pressure
# cells of the coarsest grid in a slip zone; the third grid has 16, which give the work to about 1 %
SLIP_CELLS = 4
# cell of the search over the cell of the layout in a slip zone; above it the search is repeated
MAX_SEARCH_CELL = 4.0
# most searches; each one has columns that are graded to the result of the previous one
MAX_SEARCHES = 8
# The search ends when no band of the layout moves or changes by more than this fraction of its
# cell, because the next search would have the same columns.
SETTLED_FRACTION = 0.1
MIN_LEVELS = 3  # fewer nested meshes do not show an order of convergence
# predicted CPU seconds of condensing, above which a finer mesh is not tried
MAX_SECONDS = {
    True: 3.0,
    False: 0.4,
}
OTHER_FACTOR = 4.0  # condensing a mesh that is not a tensor grid takes this many times as long


@dataclass(frozen=True, eq=False, slots=True)
class ContactExtent:
    """Extent of a contact, found by a search.

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
        """Length of the loaded part [m]."""
        return self.span[1] - self.span[0]


def search_pair(patch_model) -> Pair:
    """Return the pieces on the columns of the first search for a contact.

    Patches of the same geometry share them.
    """
    layout = search_layout(patch_model)
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
    return store.reuse(
        key, lambda: delete_factors(condense(patch_model, *make_grids(patch_model, layout)))
    )


class BaseGrids(NamedTuple):
    """Coarsest grids of a patch, a single one if its pieces are alike, and its contact.

    contact: ContactExtent that they are graded to; None without a load.
    """

    bodies: list
    contact: ContactExtent | None


def base_grids(patch_model) -> BaseGrids:
    """Return the coarsest grids of a `PatchModel`, graded to the contact that is found on them.

    The result is kept, because the plan of a run and the run itself need the same grids.
    """
    has_files = patch_model.mesh.file is not None or patch_model.gap.profile is not None
    key = ("base grids", patch_model if has_files else store.content_key(patch_model))
    return store.reuse(key, lambda: _search_grids(patch_model))


def _search_grids(patch_model) -> BaseGrids:
    """Search for the contact of a `PatchModel` on columns graded to the result of the last search.

    If a varying load moves the edges of the contact, the columns are fine wherever the edges lie
    between SWING times the load; if wear moves them, no column is longer than WEAR_CELL of the
    interface.
    """
    sweep = []
    if patch_model.mesh.edge_motion == "load" and patch_model.loading.load is not None:
        sweep = [patch_model.with_loading(load=share * patch_model.loading.load) for share in SWING]
    layout = search_layout(patch_model)
    contact = None
    # without a load there is no contact to search for
    for search in range(MAX_SEARCHES if patch_model.nominal_load > 0 else 0):
        if search == 0:
            pair = search_pair(patch_model)
        else:
            pair = condense(patch_model, *make_grids(patch_model, layout))
        x = pair.grid.x
        extents = []
        for loaded_model in (patch_model, *sweep):
            patch = press_patch(loaded_model, pair)
            extents.append(contact_extent(patch, patch_model.mesh.slip))
        contact = extents[0]
        last = layout
        layout = find_layout(patch_model, extents)
        cells = max(extent.cell / extent.width for extent in extents)
        shows = _shows_crests(patch_model, x, layout) and _shows_slip(contact.slip_zones, x, layout)
        if cells <= 1 / (EDGE_CELLS[patch_model.mesh.is_static] - 1) and shows:
            break
        if _is_settled(layout, last):
            break
    return BaseGrids(make_grids(patch_model, layout), contact)


def _is_settled(layout: Layout, last: Layout) -> bool:
    """Return whether the bands of two layouts differ by at most SETTLED_FRACTION of their cells."""
    if len(layout.bands) != len(last.bands):
        return False
    bands = np.reshape(layout.bands, (-1, 3))
    last_bands = np.reshape(last.bands, (-1, 3))
    cells = np.minimum(bands[:, 2:], last_bands[:, 2:])
    return bool((np.abs(bands - last_bands) <= SETTLED_FRACTION * cells).all())


def _shows_slip(zones: tuple, x, layout: Layout) -> bool:
    """Return whether columns x (k,) [m] resolve the slip zones.

    Their cells are at most MAX_SEARCH_CELL times those of a layout.
    """
    middle = (x[1:] + x[:-1]) / 2
    long = np.diff(x)
    for low, high in zones:
        inside = (x[1:] > low) & (x[:-1] < high)
        if (long[inside] > MAX_SEARCH_CELL * layout.cell_lengths(middle[inside])).any():
            return False
    return True


def _shows_crests(patch_model, x, layout: Layout) -> bool:
    """Return whether columns x (k,) [m] are short enough for a pressure over waves.

    The limit is twice the cells of a layout.
    """
    if _longest(patch_model) == np.inf or x.size > MAX_COLUMNS:
        return True
    return bool((np.diff(x) <= 2 * layout.cell_lengths((x[1:] + x[:-1]) / 2)).all())


def _longest(patch_model) -> float:
    """Return the longest cell [m] that resolves the waves of profile and shapes; else inf."""
    return min(
        patch_model.gap.wave / WAVE_CELLS,
        np.inf if patch_model.gap.profile is None else patch_model.uniform_element_size,
    )


def search_layout(patch_model) -> Layout:
    """Return equal columns on which a contact is searched for."""
    half = patch_model.pieces.length / 2
    cell = min(patch_model.pieces.length / SEARCH_CELLS, _longest(patch_model))
    return Layout(-half, half, (), (-half, half), cell, cell, 0.0)


def find_layout(patch_model, extents: list) -> Layout:
    """Return the columns of the coarsest mesh, graded towards the ends of some contacts.

    extents: ContactExtents, of one patch under several loads or of several patches.
    """
    length = patch_model.pieces.length
    half = length / 2
    span = (min(extent.span[0] for extent in extents), max(extent.span[1] for extent in extents))
    width = min(extent.width for extent in extents)
    thick = _coating(patch_model)
    # the third mesh, whose cells are a quarter as long, has to resolve the waves
    most = min(length / 12, 4 * _longest(patch_model))
    if max(len(extent.places) for extent in extents) > MAX_PLACES:
        return Layout(-half, half, (), span, *(2 * [min(length / 64, most)]), 0.0)
    if patch_model.mesh.edge_motion == "wear":
        most = min(most, length * WEAR_CELL)
    inside = min(width / 6, length / 24, most)
    # a contact of one or two nodes is searched again with shorter cells
    along = NODE_CELLS
    if np.isfinite(max(extent.cell for extent in extents)):
        along = EDGE_CELLS[patch_model.mesh.is_static]
    # a band that an edge sweeps would have many cells, and each is a different contact set
    fine = thick / 4 if thick and patch_model.mesh.edge_motion != "load" else np.inf
    least = max(min(width / along, fine), MIN_CELL * length)
    bands = _bands([extent.places for extent in extents], least)
    # a jump of the gap is a node; quantities that depend on it converge with the first power of its
    # cell
    bands += tuple((place, place, least / STEP_CELLS) for place in patch_model.gap.jumps)
    known, fall = find_rounded_edges(patch_model)
    near = [place for place in known if span[0] - least <= place <= span[1] + least]
    bands += tuple((place, place, min(least, fall / 4)) for place in near)
    sharp = STEP_CELLS if patch_model.has_singular_ends else 1
    if _longest(patch_model) < np.inf:
        crests = [crest for extent in extents for crest in extent.crests]
        bands += tuple(
            (place, place, max(half / CREST_CELLS, least / STEP_CELLS)) for place, half in crests
        )
    bands += tuple(
        (low, high, max((high - low) / SLIP_CELLS, MIN_CELL * length))
        for extent in extents
        for low, high in extent.slip_zones
    )
    corner = max(
        min(
            thick / 16 if thick else np.inf, width / EDGE_CELLS[patch_model.mesh.is_static] / sharp
        ),
        MIN_CELL * length,
    )
    ends = {place for extent in extents for place in extent.corners}
    bands += tuple((place, place, corner) for place in sorted(ends))
    # the far corners, where a free side meets the holder, have singular stresses
    bands += tuple(
        (side * half, side * half, min(patch_model.pieces.height, length) / 20) for side in (-1, 1)
    )
    return Layout(
        -half, half, bands, span, max(inside, least), most, SLOPE[patch_model.mesh.is_static]
    )


def _bands(places: list, least: float) -> tuple:
    """Return the bands of the edges, each with cells of at most `least` [m].

    If the number of edges is the same in all contacts, a band covers the range that its edge
    sweeps.
    """
    if len({len(each) for each in places}) == 1:
        return tuple((min(sweep), max(sweep), least) for sweep in zip(*places, strict=True))
    return tuple((place, place, least) for each in places for place in each)


def _coating(patch_model) -> float:
    """Return the thickness [m] of the thinner coating; 0 without a coating."""
    return min(
        (
            piece.thickness
            for piece in (patch_model.pieces.lower, patch_model.pieces.upper)
            if piece.thickness
        ),
        default=0.0,
    )


def contact_extent(patch: Patch, slip=None) -> ContactExtent:
    """Return the extent of the contact of a patch, or the cells around its smallest gap.

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
    # a contact of few nodes: the next search has shorter cells around it
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
        _crests(x, sigma),
        slip_zones.slip_zones(patch, slip, found) if slip is not None else (),
    )


def _crests(x, sigma) -> tuple:
    """Return (position, half-width) [m] of the maxima of pressures (m,) [Pa] inside a contact.

    Both are those of the parabola through three nodes.
    """
    top = np.flatnonzero(
        (sigma[1:-1] > CREST * sigma.max())
        & (sigma[1:-1] > sigma[:-2])
        & (sigma[1:-1] >= sigma[2:])
    )
    rise = np.diff(sigma) / np.diff(x)
    bend = -2 * np.diff(rise)[top] / (x[top + 2] - x[top])
    wide = np.sqrt(2 * sigma[top + 1] / bend)
    return tuple(zip(x[top + 1].tolist(), wide.tolist())) if top.size <= MAX_PLACES else ()


def make_grids(patch_model, layout: Layout) -> list:
    """Return the grids of the pieces with the columns of a layout; one grid if they are alike."""
    pieces = (patch_model.pieces.lower, patch_model.pieces.upper)
    if patch_model.pieces.are_alike:
        pieces = pieces[:1]
    x = make_columns(patch_model, layout)
    return [
        extend_grid(
            patch_model,
            piece,
            grid_on(patch_model, x, piece),
            1 + SLOPE[patch_model.mesh.is_static],
        )
        for piece in pieces
    ]


def make_columns(patch_model, layout: Layout) -> np.ndarray:
    """Return the columns (k,) [m] of a layout, at most MAX_COLUMNS."""
    x = divide_into_columns(layout, patch_model.gap.jumps)
    while x.size > MAX_COLUMNS + 1 and layout.bands:
        layout = layout.scale_cells(x.size / MAX_COLUMNS)
        x = divide_into_columns(layout, patch_model.gap.jumps)
    return x


def grid_on(patch_model, x, piece) -> TensorGrid:
    """Return the grid of one piece on columns x (k,) [m].

    Its rows are as fine as the columns at the interface, at the inner face of the coating and at
    the holder.
    """
    thick = piece.thickness
    height = piece.height
    top = float(np.diff(x).min())
    # a row is at most a tenth of the length; in a piece taller than this it may be 1/24 of the
    # height, and never more than 1/6 of it
    cap = min(max(patch_model.pieces.length / 10, height / 24), height / 6)
    bands = [(0.0, 0.0, top), (height, height, min(height, patch_model.pieces.length) / 60)]
    if thick:
        bands.append((thick, thick, max(thick / 4, top)))
    layout = Layout(
        0.0, height, tuple(bands), (0.0, height), cap, cap, SLOPE[patch_model.mesh.is_static]
    )
    depth, coated = divide_into_rows(layout, thick)
    return TensorGrid(frozen_array(x), depth, coated)


def node_counts(body) -> tuple:
    """Return the (columns, rows) of nodes of a whole body."""
    plan = body.base_grid
    if plan is None:
        return body.x.size, max(3, round(len(body.points) / body.x.size))
    return (plan.x.size if plan is body else len(body.points) // plan.depth.size), plan.depth.size


def is_mirrored(body) -> bool:
    """Whether a body is a plain grid that is its own mirror image."""
    return body.base_grid is body and bool(
        np.abs(body.x + body.x[::-1]).max() <= 1e-12 * body.length
    )


def predict_condensing_seconds(bodies) -> float:
    """Return the predicted CPU seconds of condensing the bodies of a patch.

    bodies: (lower, upper or None), or a single one for alike pieces.
    """
    total = 0.0
    for body in bodies:
        if body is not None:
            factor = 1.0 if body.base_grid is body else OTHER_FACTOR
            total += factor * predict_seconds(*node_counts(body), is_mirrored(body))
    return total
