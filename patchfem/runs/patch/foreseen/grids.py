"""The grids that a patch will be solved on: their columns and rows, and how often their cells will be halved."""

from typing import NamedTuple

import numpy as np

from ....elasticity.grid_fronts import predicted_bytes, predicted_seconds
from ....mesh.nested import plan_of
from ....mesh.tensor import graded_grid
from ..grading import Found, columns_of, grid_on, layout_of
from ..ladder import LEAST_LEVELS, OTHER, SPENT
from .contact import bearing

# levels beyond the least, by the tolerance, of 200 random patches where a contact ends inside the interface
FINE, COARSE = 2e-3, 5e-3  # tolerances between those of 1e-3, 3e-3 and 1e-2
STILL, CURVED = 1.0, 0.5  # at FINE: 3 to 5 levels; of a crown alone, whose two edges are alike: 3 or 4
MOVING, MOVING_CURVED = 1.5, 1.0  # of a coarser first grid: at FINE 4 or 5 levels; of a crown at COARSE 4
ROWS = 33  # of nodes of a mesh in a file
UPRIGHT = 3.0  # where a smooth skin lies over a jump, at which the pressure rises ever higher
SOFTENED = 1.0  # fewer where a skin takes the edge off the pressure


class Sizes(NamedTuple):
    """Grids of a patch.

    finest: (columns, rows) of nodes of the finest grid of each piece, one where they are alike; levels: solved ones,
    1/2 where it may be either; even: they are their own mirror images; outlined: they reach beyond the interface; ends:
    how often the contact ends inside the interface.
    """

    finest: tuple
    levels: float
    even: bool
    outlined: bool
    ends: int = 0

    @property
    def points(self) -> int:
        """Nodes of the interface."""
        return round(max(columns for columns, _ in self.finest))

    @property
    def nodes(self) -> float:
        """Nodes of the finest grids."""
        return float(sum(columns * rows for columns, rows in self.finest))


def sizes(asked, tolerance: float) -> Sizes:
    """What the grids of a `PatchModel` will be; a mesh file counts as one that is as fine as the automatic one."""
    pieces = (asked.lower,) if asked.alike else (asked.lower, asked.upper)
    if asked.mesh is not None:  # the file has not been read
        points = round(asked.length / asked.size) + 1
        return Sizes(tuple((points, ROWS) for _ in pieces), LEAST_LEVELS, False, True)
    if asked.meshes is not None:
        bodies = [body for body in asked.meshes.levels[0] if body is not None]
        grids = [plan_of(body) or body for body in bodies]
        return Sizes(tuple((grid.x.size, _rows(grid)) for grid in grids), LEAST_LEVELS, False, asked.outlined)
    if not asked.chosen:
        grids = [graded_grid(asked.length, piece.height, asked.size, piece.thickness) for piece in pieces]
        return Sizes(tuple((grid.x.size, grid.depth.size) for grid in grids), LEAST_LEVELS, True, asked.outlined)
    seen = found_by_bars(asked)
    x = columns_of(asked, layout_of(asked, [seen]))
    even = bool(np.abs(x + x[::-1]).max() <= 1e-9 * asked.length)
    base = [(x.size - 1, grid_on(asked, x, piece).depth.size - 1) for piece in pieces]
    levels = LEAST_LEVELS + _more(asked, bool(seen.places), tolerance)
    while True:
        finest = tuple(_halved(cells, levels) for cells in base)
        if levels <= LEAST_LEVELS or _seconds(finest, even, asked.outlined) <= SPENT[asked.still]:
            return Sizes(finest, levels, even, asked.outlined, len(seen.places))
        levels -= 0.5


def _rows(grid) -> int:
    depth = getattr(grid, "depth", None)
    return depth.size if depth is not None else max(3, round(len(grid.points) / grid.x.size))


def found_by_bars(asked) -> Found:
    """The contact of springs beside each other, as a search of the meshes finds one."""
    x, bears = bearing(asked)
    index, change = np.flatnonzero(bears), np.flatnonzero(bears[1:] != bears[:-1])
    places = tuple(((x[change] + x[change + 1]) / 2).tolist())
    corners = tuple(float(x[at]) for at in (0, -1) if bears[at])
    low = places[0] if index[0] else float(x[0])
    high = places[-1] if index[-1] < x.size - 1 else float(x[-1])
    return Found((low, high), places, corners, 0.0)


def _more(asked, ends: bool, tolerance: float) -> float:
    """Levels beyond the least that the tolerance takes where a contact ends inside, or moves over a jump of the gap."""
    names, jumps = [name for name, _ in asked.gap.shapes], bool(asked.gap.jumps)
    if jumps and "crown" not in names and asked.skin is not None and asked.skin.law != "linear":
        return UPRIGHT
    more = 0.0
    if asked.still and ends and tolerance < FINE:
        more = CURVED if names == ["crown"] and not asked.offset else STILL
    elif not asked.still and tolerance < COARSE and (ends or jumps):
        more = MOVING if tolerance < FINE else MOVING_CURVED if "crown" in names else 0.0
    return max(0.0, more - (SOFTENED if asked.skin is not None else 0.0))


def _halved(cells: tuple, levels: float) -> tuple:
    """Nodes of grids of so many cells along either side, which are halved from level 1 on."""
    return tuple(round(each * 2**(levels - 1)) + 1 for each in cells)


def _seconds(grids, even: bool, outlined: bool) -> float:
    """Predicted seconds of condensing grids (columns, rows)."""
    return sum((OTHER if outlined else 1.0) * predicted_seconds(*grid, even and not outlined) for grid in grids)


def work(found: Sizes) -> tuple:
    """(seconds, bytes) of condensing all levels, predicted."""
    seconds, last = 0.0, found.levels - 1
    for below in range(int(np.ceil(found.levels))):
        grids = [tuple(max(3, round((n - 1) / 2**below) + 1) for n in grid) for grid in found.finest]
        seconds += min(1.0, last - below + 1) * _seconds(grids, found.even, found.outlined)
    return seconds, sum(predicted_bytes(*grid, found.even and not found.outlined) for grid in found.finest)
