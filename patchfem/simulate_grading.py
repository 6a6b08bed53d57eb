"""The mesh that a static patch needs: graded to where its own pressure ends, split until the tolerance is met."""

import numpy as np

from .mesh.grading import Layout, columns
from .mesh.tensor import TensorGrid, finer, graded_depth
from .simulate_bodies import condensed, piece_of, unlike
from .simulate_measures import edge_cells, measures
from .simulate_patch import Patch, pressed

SEARCH_CELLS = 96  # columns of the first search for the contact
MOST_COLUMNS = 400  # of the finest grid
MOST_PLACES = 12  # beyond it the contact is many islands and the columns stay even
GROWTH = 1.25  # of the rows on the coarsest grid
DECISIVE = ("pressure_peak", "contact_fraction", "normal_stiffness", "rotation")


def solve_graded(scene, fresh: bool = False) -> tuple:
    """(Patch, on the mesh with cells twice as long, four times as long): split until every decisive measure has the
    tolerance or the grid has grown too large; what then misses it is named by a warning of the run."""
    grids = _base(scene)
    series = [_on(scene, grids, fresh)]
    while True:
        grids = [finer(grid) for grid in grids]
        series.append(_on(scene, grids, fresh))
        if len(series) < 3:
            continue
        fine, coarse, coarsest = series[:-4:-1]
        if 2 * fine.x.size > MOST_COLUMNS or _met(scene, measures(fine, coarse, coarsest)):
            return fine, coarse, coarsest


def _on(scene, grids, fresh: bool = False) -> Patch:
    return pressed(scene, condensed(scene, *grids, fresh=fresh))


def _met(scene, found: dict) -> bool:
    tolerance = scene.accuracy.tolerance
    return all(found[name].error <= tolerance * abs(found[name].value) + 1e-12 for name in DECISIVE)


def _base(scene) -> list:
    """Coarsest grids of the pieces (one where they are alike), their columns graded to the contact that they find."""
    size = scene.contact.length
    x = np.linspace(-size / 2, size / 2, SEARCH_CELLS + 1)
    for _ in range(8):
        grids = _grids(scene, x)
        found = _loaded(_on(scene, grids))
        if found is None:
            return grids
        span, places, cell = found
        x = columns(_layout(size, span, places))
        if cell <= (span[1] - span[0]) / 64:  # the places are known better than the coarsest cells there
            break
    return _grids(scene, x)


def _layout(length: float, span, places) -> Layout:
    wide = span[1] - span[0]
    if len(places) > MOST_PLACES:
        return Layout(length, (), span, length / 64, length / 64, length / 64, 0.0)
    inside = min(wide / 6, length / 24)
    return Layout(length, tuple(places), tuple(span), inside / 64, inside, length / 12, 0.6)


def _loaded(patch: Patch) -> tuple | None:
    """(span of the loaded interval, places where it ends or a corner is loaded, largest cell at such an end), None
    where nothing touches. Of a smooth skin the part that bears a thousandth of the largest pressure counts."""
    x, sigma = patch.x, patch.pressure.sigma_n
    if not (sigma > 0).any():
        return None
    bears = sigma > (1e-3 * sigma.max() if patch.skin is not None else 0.0)
    index = np.flatnonzero(bears)
    ends = (x[:-1] + x[1:])[bears[1:] != bears[:-1]] / 2
    cells = edge_cells(x, bears)
    low = x[0] if bears[0] else ends[0]
    high = x[-1] if bears[-1] else ends[-1]
    corners = [corner for corner, at in ((x[0], 0), (x[-1], -1)) if bears[at]]
    if index.size < 4:  # a point of contact between a few nodes: look closer around it
        cell = float(np.diff(x).max())
        return (low - cell, high + cell), [float((low + high) / 2)], 2 * cell
    return (float(low), float(high)), [*corners, *ends.tolist()], float(cells.max(initial=0.0))


def _grids(scene, x) -> list:
    return [_grid(scene, x, side) for side in (("lower", "upper") if unlike(scene.contact) else ("lower",))]


def _grid(scene, x, side: str) -> TensorGrid:
    height, _, coating = piece_of(scene.contact, side)
    depth, rows = graded_depth(height, float(np.diff(x).min()), coating.thickness if coating else 0.0, GROWTH, 2)
    return TensorGrid(np.asarray(x), depth, rows)
