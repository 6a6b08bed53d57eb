"""The grids of a patch: graded to where its own pressure ends, to its corners, its coating and the waves of its gap.

The coarsest grid follows from the patch alone: its contact is searched on columns that are graded to what the search
before found; a plan searches in the same way. Every next grid splits all cells in two, so the grids of a tighter
tolerance are those of a wider one and more. How far the ladder is climbed a run decides in `ladder`, a plan expects in
`plan`. Read `base_grids` first, then `layout_of`.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ...core import frozen_array
from ...elasticity.grid_fronts import predict_seconds
from ...mesh.grading import Layout, divide_into_columns, divide_into_rows
from ...mesh.tensor import TensorGrid
from ...model.pieces import extend_grid, rounded_edges
from . import slip_zones, store
from .condensed import Pair, condensed, without_factors
from .press import Patch, pressed
from .values import contact_ends

SEARCH_CELLS = 96  # columns of the first search for the contact
# columns of the coarsest grid; a layout that wants more is made coarser everywhere
MAX_COLUMNS = 120
# The tables with two entries are for a patch that stays (True) and for one whose motion takes longer with more nodes.
SLOPE = {True: 0.5, False: 0.9}  # growth of the cells of the coarsest grid per distance
EDGE_CELLS = {True: 20, False: 10}  # length of a contact over the coarsest cells at its edges
MIN_CELL = 4e-9  # shortest cell of the coarsest grid over the length: some tens of picometres, near round-off
STEP_CELLS = 8  # cells at a step of the gap are so many times shorter than those at an edge
MAX_PLACES = 12  # ends of a contact; one with more is many islands, for which the columns stay even
SWING = (0.5, 1.5)  # multiples of the mean load between which a load that varies is expected
# coarsest cell over the length of the interface where wear may move the edges anywhere
WEAR_CELL = 1 / 48
NODE_CELLS = 64  # cells along a contact of a node or two in the search that follows
WAVE_CELLS = 16  # cells in a wave of the gap, in the search and in the third grid
CREST = 0.3  # cells are graded to the crests of the pressure above this fraction of the largest pressure
CREST_CELLS = 4  # the half-width of a crest has so many cells of the coarsest grid
# cells of the coarsest grid in a slip zone; 16 of the third grid show the work to about 1 %
SLIP_CELLS = 4
MAX_SEARCH_CELL = 4.0  # cell of the search over the wanted one in a slip zone; above it the zone is searched again
MAX_SEARCHES = 8  # each search has columns that are graded to what the one before found
MIN_LEVELS = 3  # fewer nested meshes do not show an order of convergence
# predicted seconds of condensing, above which a finer mesh is not tried
MAX_SECONDS = {
    True: 3.0,
    False: 0.4,
}
OTHER_FACTOR = 4.0  # condensing a mesh that is not a tensor grid takes so many times as long


@dataclass(frozen=True, eq=False, slots=True)
class ContactExtent:
    """What a search finds of a contact.

    span: (from, to) [m] of the loaded stretch; places: where the pressure ends inside the interface, or the nodes of a
    contact too small to tell; corners: ends of the interface that bear; cell: longest cell [m] in which it ends;
    crests: (place, half-width) [m] of the largest pressures inside it; slip_zones: (from, to) [m] of the stretches that
    a prescribed slide lets slip.
    """

    span: tuple
    places: tuple
    corners: tuple
    cell: float
    crests: tuple = ()
    slip_zones: tuple = ()

    @property
    def wide(self) -> float:
        """Length of the loaded stretch [m]."""
        return self.span[1] - self.span[0]


def search_pair(asked) -> Pair:
    """Return the pieces on the columns of the first search for a contact, shared by the patches of a geometry."""
    layout = search_layout(asked)
    key = (
        "search",
        layout,
        asked.pieces.lower,
        asked.pieces.upper,
        asked.pieces.plane,
        asked.pieces.width * asked.pieces.pairs,
        asked.mesh.is_static,
        asked.gap.jumps,
    )
    return store.reuse(key, lambda: without_factors(condensed(asked, *grids_of(asked, layout))))


class BaseGrids(NamedTuple):
    """The coarsest grids of a patch, one where its pieces are alike, and the contact that they are graded to.

    contact: None without a load.
    """

    bodies: list
    contact: ContactExtent | None


def base_grids(asked) -> BaseGrids:
    """Return the coarsest grids of a `PatchModel`, graded to the contact that is found on them.

    Where a load that varies moves the edges of the contact, the columns are fine over the bands that they sweep between
    SWING of the load; where wear does, no column is longer than WEAR_CELL of the interface.
    """
    sweep = [
        asked.with_loading(load=share * asked.loading.load)
        for share in SWING
        if asked.mesh.edge_motion == "load" and asked.loading.load is not None
    ]
    layout, contact = search_layout(asked), None
    # without a load there is no contact
    for search in range(MAX_SEARCHES if asked.nominal_load > 0 else 0):
        pair = condensed(asked, *grids_of(asked, layout)) if search else search_pair(asked)
        x = pair.grid.x
        seen = [contact_extent(pressed(each, pair), asked.mesh.slip) for each in (asked, *sweep)]
        layout, contact = layout_of(asked, seen), seen[0]
        cells = max(one.cell / one.wide for one in seen)
        shows = _shows_crests(asked, x, layout) and _shows_slip(contact.slip_zones, x, layout)
        if cells <= 1 / (EDGE_CELLS[asked.mesh.is_static] - 1) and shows:
            break
    return BaseGrids(grids_of(asked, layout), contact)


def _shows_slip(zones: tuple, x, layout: Layout) -> bool:
    """Whether the cells of columns x (k,) [m] in the slip zones are not much longer than a layout wants them."""
    middle, long = (x[1:] + x[:-1]) / 2, np.diff(x)
    for low, high in zones:
        inside = (x[1:] > low) & (x[:-1] < high)
        if (long[inside] > MAX_SEARCH_CELL * layout.cell_lengths(middle[inside])).any():
            return False
    return True


def _shows_crests(asked, x, layout: Layout) -> bool:
    """Whether columns x (k,) [m] are no longer than a layout wants them at the crests of a pressure on waves."""
    if _longest(asked) == np.inf or x.size > MAX_COLUMNS:
        return True
    return bool((np.diff(x) <= 2 * layout.cell_lengths((x[1:] + x[:-1]) / 2)).all())


def _longest(asked) -> float:
    """Longest cell [m] that shows the waves of the gap, those of a profile and of its shapes; infinite without any."""
    return min(
        asked.gap.wave / WAVE_CELLS,
        np.inf if asked.gap.profile is None else asked.even_element_size,
    )


def search_layout(asked) -> Layout:
    """Even columns on which a contact is looked for."""
    half, cell = asked.pieces.length / 2, min(asked.pieces.length / SEARCH_CELLS, _longest(asked))
    return Layout(-half, half, (), (-half, half), cell, cell, 0.0)


def layout_of(asked, seen: list) -> Layout:
    """Layout of the coarsest columns for the contacts `seen`, finest where one ends."""
    length = asked.pieces.length
    half = length / 2
    span = (min(one.span[0] for one in seen), max(one.span[1] for one in seen))
    wide, thick = min(one.wide for one in seen), _coating(asked)
    # the third mesh has cells a quarter as long
    most = min(length / 12, 4 * _longest(asked))
    if max(len(one.places) for one in seen) > MAX_PLACES:
        return Layout(-half, half, (), span, *(2 * [min(length / 64, most)]), 0.0)
    if asked.mesh.edge_motion == "wear":
        most = min(most, length * WEAR_CELL)
    inside = min(wide / 6, length / 24, most)
    # a point of contact is looked at closer and closer
    along = NODE_CELLS
    if np.isfinite(max(one.cell for one in seen)):
        along = EDGE_CELLS[asked.mesh.is_static]
    # cells of a band that an edge sweeps are many, and every one is a contact set of its own
    fine = thick / 4 if thick and asked.mesh.edge_motion != "load" else np.inf
    least = max(min(wide / along, fine), MIN_CELL * length)
    bands = _bands([one.places for one in seen], least)
    # a jump of the gap is a node of its own: what depends on it falls with the first power of its cell
    bands += tuple((place, place, least / STEP_CELLS) for place in asked.gap.jumps)
    known, fall = rounded_edges(asked)
    near = [place for place in known if span[0] - least <= place <= span[1] + least]
    bands += tuple((place, place, min(least, fall / 4)) for place in near)
    sharp = STEP_CELLS if asked.has_singular_ends else 1
    if _longest(asked) < np.inf:
        crests = [crest for contact in seen for crest in contact.crests]
        bands += tuple(
            (place, place, max(half / CREST_CELLS, least / STEP_CELLS)) for place, half in crests
        )
    bands += tuple(
        (low, high, max((high - low) / SLIP_CELLS, MIN_CELL * length))
        for one in seen
        for low, high in one.slip_zones
    )
    corner = max(
        min(thick / 16 if thick else np.inf, wide / EDGE_CELLS[asked.mesh.is_static] / sharp),
        MIN_CELL * length,
    )
    ends = {place for one in seen for place in one.corners}
    bands += tuple((place, place, corner) for place in sorted(ends))
    # the far corners, where a free side meets the holder
    bands += tuple(
        (side * half, side * half, min(asked.pieces.height, length) / 20) for side in (-1, 1)
    )
    return Layout(-half, half, bands, span, max(inside, least), most, SLOPE[asked.mesh.is_static])


def _bands(places: list, least: float) -> tuple:
    """Bands of the edges: each spans what it sweeps from one contact to the next, where their number stays."""
    if len({len(each) for each in places}) == 1:
        return tuple((min(sweep), max(sweep), least) for sweep in zip(*places, strict=True))
    return tuple((place, place, least) for each in places for place in each)


def _coating(asked) -> float:
    """Thickness [m] of the thinner coating, 0 where neither piece has one."""
    return min(
        (piece.thickness for piece in (asked.pieces.lower, asked.pieces.upper) if piece.thickness),
        default=0.0,
    )


def contact_extent(patch: Patch, slip=None) -> ContactExtent:
    """Extent of the contact of a patch; where nothing touches, the cells around the narrowest gap.

    slip: the `PrescribedSlip` of the holders, None where nothing slips part by part.

    Of a smooth skin the part that bears a thousandth of the largest pressure counts.
    """
    x, sigma = patch.x, patch.pressure.sigma_n
    if not (sigma > 0).any():
        least = int(np.argmin(patch.pressure.gap))
        low, high = float(x[max(least - 1, 0)]), float(x[min(least + 1, x.size - 1)])
        return ContactExtent((low, high), (float(x[least]),), (), np.inf)
    strips = patch.strips.pressure if patch.strips is not None else sigma[None]
    bears = strips > (1e-3 * strips.max() if patch.skin is not None else 0.0)
    index = np.flatnonzero(bears.any(axis=0))
    low, high = x[max(index[0] - 1, 0)], x[min(index[-1] + 1, x.size - 1)]
    # a point of contact between a few nodes: look closer around it
    if index.size < 4 and index.size < x.size:
        return ContactExtent((float(low), float(high)), tuple(x[index].tolist()), (), np.inf)
    changes = np.flatnonzero((bears[:, 1:] != bears[:, :-1]).any(axis=0))
    places, cells = (x[changes] + x[changes + 1]) / 2, np.diff(x)[changes]
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
    """(place, half-width) [m] of the largest pressures (m,) [Pa] inside a contact: of the parabola through three nodes."""
    top = np.flatnonzero(
        (sigma[1:-1] > CREST * sigma.max())
        & (sigma[1:-1] > sigma[:-2])
        & (sigma[1:-1] >= sigma[2:])
    )
    rise = np.diff(sigma) / np.diff(x)
    bend = -2 * np.diff(rise)[top] / (x[top + 2] - x[top])
    wide = np.sqrt(2 * sigma[top + 1] / bend)
    return tuple(zip(x[top + 1].tolist(), wide.tolist())) if top.size <= MAX_PLACES else ()


def grids_of(asked, layout: Layout) -> list:
    """Grids of the pieces, one where they are alike, with the columns of a layout, MAX_COLUMNS at most."""
    pieces = (asked.pieces.lower, asked.pieces.upper)
    if asked.pieces.are_alike:
        pieces = pieces[:1]
    x = columns_of(asked, layout)
    return [
        extend_grid(asked, piece, grid_on(asked, x, piece), 1 + SLOPE[asked.mesh.is_static])
        for piece in pieces
    ]


def columns_of(asked, layout: Layout) -> np.ndarray:
    """Columns (k,) [m] of a layout, MAX_COLUMNS at most."""
    x = divide_into_columns(layout, asked.gap.jumps)
    while x.size > MAX_COLUMNS + 1 and layout.bands:
        layout = layout.scale_cells(x.size / MAX_COLUMNS)
        x = divide_into_columns(layout, asked.gap.jumps)
    return x


def grid_on(asked, x, piece) -> TensorGrid:
    """Grid of one piece: rows as fine as the columns at the interface, at the coating's own face and at the holder."""
    thick, height = piece.thickness, piece.height
    top = float(np.diff(x).min())
    # a row is at most a tenth of the length; in a piece taller than that it may be a twenty-fourth of the height, and
    # never more than a sixth of it
    cap = min(max(asked.pieces.length / 10, height / 24), height / 6)
    bands = [(0.0, 0.0, top), (height, height, min(height, asked.pieces.length) / 60)]
    if thick:
        bands.append((thick, thick, max(thick / 4, top)))
    layout = Layout(0.0, height, tuple(bands), (0.0, height), cap, cap, SLOPE[asked.mesh.is_static])
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


def seconds_of(bodies) -> float:
    """Return the predicted seconds of condensing the bodies of a patch, (lower, upper or None) or one alike piece."""
    total = 0.0
    for body in bodies:
        if body is not None:
            factor = 1.0 if body.base_grid is body else OTHER_FACTOR
            total += factor * predict_seconds(*node_counts(body), is_mirrored(body))
    return total
