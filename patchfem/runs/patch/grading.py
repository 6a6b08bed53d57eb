"""The mesh that a static patch needs: graded to where its own pressure ends, as fine as its tolerance asks for."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ...core import Outcome, frozen_array
from ...mesh.grading import Layout, columns
from ...mesh.nested import finer
from ...mesh.tensor import TensorGrid, graded_depth
from ...model.pieces import outlined, rounded_edges
from .condensed import condensed
from .measures import measures, order
from .press import Patch, pressed

SEARCH_CELLS = 96  # columns of the first search for the contact
MOST_COLUMNS = 400  # of the finest grid
MOST_WORK = 1e11  # floating-point operations of condensing the finest grids, some five seconds
LEAST = 4e-9  # of the length: the shortest cell of the coarsest grid, some tens of picometres
MOST_PLACES = 12  # beyond it the contact is many islands and the columns stay even
GROWTH = 1.25  # of the rows on the coarsest grid
DECISIVE = ("pressure_peak", "contact_fraction", "normal_stiffness", "rotation")


@dataclass(frozen=True, eq=False, slots=True)
class Base:
    """Recipe of the coarsest grids of a patch: the layout of their columns and the growth of their rows."""

    layout: Layout
    growth: float = GROWTH

    def shrunk(self, share: float) -> "Base":
        """The base whose cells are `share` as long in both directions."""
        return Base(self.layout.times(share), self.growth**share)


def solve_graded(asked, tolerance: float, fresh: bool = False) -> tuple:
    """Press a patch on a mesh whose decisive measures have the tolerance, and on two coarser ones.

    Returns the Patch on that mesh, with cells twice as long and four times as long. Three meshes tell by how much their
    cells must shrink. They are halved, or all three are made anew where less is enough. A measure that the largest
    affordable mesh would not bring to the tolerance, such as the singular peak of a step, asks for nothing; a warning
    of the run names it.
    """
    base = _affordable(asked, _base(asked, tolerance))
    series = _series(asked, base, fresh)
    while True:
        share = _share(tolerance, series)
        if share >= 1 or max(share, 0.5) < _reach(_own(series[0])):
            return series
        if share > 0.55:
            base = base.shrunk(share)
            series = _series(asked, base, fresh)
        else:
            base = base.shrunk(0.5)
            series = (_finer(asked, series[0], fresh), *series[:2])


def _series(asked, base: Base, fresh: bool) -> tuple:
    out = [_on(asked, _grids(asked, columns(base.layout), base.growth), fresh)]
    for _ in range(2):
        out.append(_finer(asked, out[-1], fresh))
    return tuple(out[::-1])


def _finer(asked, patch: Patch, fresh: bool) -> Patch:
    return _on(asked, [finer(grid) for grid in _own(patch)], fresh)


def _own(patch: Patch) -> tuple:
    """The grids of a patch, one where the pieces are alike."""
    low, high = patch.pair.grid, patch.pair.upper_grid
    return (low,) if high is low else (low, high)


def _on(asked, grids, fresh: bool = False) -> Patch:
    return pressed(asked, condensed(asked, *grids, fresh=fresh))


def _share(tolerance: float, series) -> float:
    """Factor by which the cells must shrink for the decisive measures that can get the tolerance; 1 where none asks."""
    if series[0].pressure.outcome is Outcome.NO_CONTACT:
        return 1.0
    found, reach, out = measures(*series), _reach(_own(series[0])), 1.0
    orders = order(*series)
    for name in DECISIVE:
        error, wanted = found[name].error, tolerance * abs(found[name].value) + 1e-12
        share = 0.95 * (wanted / error)**(1 / orders[name]) if error > wanted else 1.0
        if share >= reach:
            out = min(out, share)
    return out


def _affordable(asked, base: Base) -> Base:
    """The base, with longer cells where splitting them twice would already take too much work."""
    grids = _grids(asked, columns(base.layout), base.growth)
    return base.shrunk(max(1.0, 4 * _reach(grids)))


def _reach(grids) -> float:
    """Factor by which the cells of a patch can shrink at most before its grids grow too large.

    The work of condensing falls on columns rows^3 and columns^2 rows^2, so it grows by the fourth power.
    """
    work = sum(16.0 * g.x.size * g.depth.size**2 * (3 * g.depth.size + g.x.size) for g in grids)
    return max(grids[0].x.size / MOST_COLUMNS, (work / MOST_WORK)**0.25)


def _base(asked, tolerance: float) -> Base:
    """The coarsest grids, their columns graded to the contact that they find."""
    size = asked.length
    layout = Layout(size, (), (-size / 2, size / 2), size / SEARCH_CELLS, size / SEARCH_CELLS, size / SEARCH_CELLS, 0.0)
    for _ in range(8):
        found = _loaded(_on(asked, _grids(asked, columns(layout), GROWTH)))
        if found is None:
            break
        span, places, cell = found
        known, edge = rounded_edges(asked)
        places += [x for x in known if span[0] - cell <= x <= span[1] + cell]
        layout = _layout(size, span, places, tolerance, edge)
        if cell <= (span[1] - span[0]) / 64:  # the places are known better than the coarsest cells there
            break
    return Base(layout)


def _layout(length: float, span, places, tolerance: float, edge: float | None) -> Layout:
    """Layout of the coarsest columns, with the finest cells where the contact ends.

    An edge of the contact is known to about half a cell of the finest mesh, which is a quarter as long. edge [m]: over
    which the pressure falls off at a rounded end, None where it does not.
    """
    wide = span[1] - span[0]
    if len(places) > MOST_PLACES:
        return Layout(length, (), span, length / 64, length / 64, length / 64, 0.0)
    inside = min(wide / 6, length / 24)
    least = max(min(inside / 64, tolerance * wide), inside / 800)
    least = max(min(least, edge / 4 if edge else least), LEAST * length)
    return Layout(length, tuple(places), tuple(span), least, max(inside, least), length / 12, 0.6)


def _loaded(patch: Patch) -> tuple | None:
    """Extent of the loaded interval: (its span, places where it ends or a corner is loaded, largest cell at such an
    end).

    None where nothing touches. Of a smooth skin the part that bears a thousandth of the largest pressure counts.
    """
    x, sigma = patch.x, patch.pressure.sigma_n
    if not (sigma > 0).any():
        return None
    strips = patch.strips.pressure if patch.strips is not None else sigma[None]
    bears = strips > (1e-3 * strips.max() if patch.skin is not None else 0.0)
    index = np.flatnonzero(bears.any(axis=0))
    if index.size < 4 and index.size < x.size:  # a point of contact between a few nodes: look closer around it
        low, high = x[max(index[0] - 1, 0)], x[min(index[-1] + 1, x.size - 1)]
        return (float(low), float(high)), x[index].tolist(), np.inf
    changes = np.flatnonzero((bears[:, 1:] != bears[:, :-1]).any(axis=0))
    ends, cells = (x[changes] + x[changes + 1]) / 2, np.diff(x)[changes]
    corners = [x[at] for at in (0, -1) if bears[:, at].any()]
    low, high = (x[k] if k in (0, x.size - 1) else place for k, place in ((index[0], ends[:1]), (index[-1], ends[-1:])))
    return (float(np.squeeze(low)), float(np.squeeze(high))), [*corners, *ends.tolist()], float(cells.max(initial=0.0))


def _grids(asked, x, growth: float) -> list:
    pieces = (asked.lower,) if asked.alike else (asked.lower, asked.upper)
    return [outlined(asked, piece, _grid(asked, x, piece, growth), growth) for piece in pieces]


def _grid(asked, x, piece, growth: float) -> TensorGrid:
    depth, rows = graded_depth(piece.height, float(np.diff(x).min()), piece.thickness, growth, 2)
    most = max(asked.length / 4, piece.height / 24) * np.log(growth) / np.log(GROWTH)
    return TensorGrid(frozen_array(x), _no_taller(depth, most), rows)


def _no_taller(depth, most: float) -> np.ndarray:
    """Depths whose rows below the coating are split evenly where taller than `most` [m]: a tall piece bends."""
    parts = [np.linspace(a, b, max(1, int(np.ceil((b - a) / most - 1e-9))) + 1)[1:] for a, b in pairwise(depth)]
    return frozen_array(np.concatenate([depth[:1], *parts]))
