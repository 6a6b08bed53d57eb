"""One coated piece as a graded tensor grid: columns along the interface, rows growing with depth.

Both pieces of a pair share the columns, so their interface nodes match and every shape of the surfaces lives in
the gap g(x), never in the mesh.
"""

from dataclasses import dataclass
from math import ceil, log

import numpy as np

from ..core import PatchfemError, frozen_array
from .grading import tributary_lengths

# height of a row over the one above it; 1.15 limits the compliance to 2e-3, 1.1 to 1e-3
GROWTH = 1.1
COATING_ROWS = 4  # least number of rows through a coating


@dataclass(frozen=True, eq=False, slots=True)
class TensorGrid:
    """A graded tensor grid of one piece.

    x: (nx,) columns [m], 0 in the middle; depth: (ny,) rows [m], 0 at the interface; coating_rows: rows of cells in the
    coating.
    """

    x: np.ndarray
    depth: np.ndarray
    coating_rows: int

    @property
    def length(self) -> float:
        """Extent along the interface [m]."""
        return float(self.x[-1] - self.x[0])

    @property
    def height(self) -> float:
        """Depth of the far face [m]."""
        return float(self.depth[-1])

    @property
    def row(self) -> float:
        """Height of the first row [m]."""
        return float(self.depth[1])

    @property
    def coating(self) -> float:
        """Thickness of the coating [m], 0 without one."""
        return float(self.depth[self.coating_rows])

    def tributary(self) -> np.ndarray:
        """Return the length of interface that belongs to each of its nodes (nx,) [m]."""
        return tributary_lengths(self.x)

    def cell_is_coating(self) -> np.ndarray:
        """Whether each cell is coating, (nx - 1, ny - 1) bool, as columns by rows."""
        row = np.arange(self.depth.size - 1) < self.coating_rows
        return np.broadcast_to(row, (self.x.size - 1, row.size))


def graded_rows(start: float, total: float, growth: float = GROWTH, least: int = 1) -> np.ndarray:
    """Row heights (ny,) that begin near `start`, grow by at most `growth` and add up to `total` [m].

    ValueError unless start and total are positive and growth > 1.
    """
    if not (start > 0 and total > 0 and growth > 1):
        raise ValueError("start and total must be positive and growth above 1")
    start = min(start, total / least)
    count = max(least, ceil(log(1 + total * (growth - 1) / start) / log(growth) - 1e-9))
    if count * start >= total * (1 - 1e-12):
        return np.full(count, total / count)

    # the sum of the rows is convex in their ratio, so Newton's steps from above fall onto it until round-off
    powers, ratio, last = np.arange(count), growth * (1 + 1e-6) + 1e-6, np.inf
    while ratio < last:
        last, rows = ratio, ratio**powers
        ratio -= (start * rows.sum() - total) / (start * (powers[1:] @ rows[:-1]))
    rows = start * last**powers
    return rows * (total / rows.sum())


def graded_depth(
    height: float,
    first: float,
    coating: float = 0.0,
    growth: float = GROWTH,
    least: int = COATING_ROWS,
) -> tuple:
    """Depths (ny,) [m] and the number of rows in the coating: rows from about `first` [m] on.

    At least `least` rows lie in the coating. PatchfemError when the coating fills the height.
    """
    if coating >= height:
        raise PatchfemError(
            f"contact.coating.thickness: {coating:.6g} m leaves no substrate in a piece of height "
            f"{height:.6g} m"
        )
    rows = np.empty(0)
    if coating > 0:
        rows = graded_rows(min(first, coating / least), coating, growth, least)
        first = rows[-1] * growth
    under = graded_rows(first, height - coating, growth, 3)
    depth = np.concatenate([[0.0], np.cumsum(rows), coating + np.cumsum(under)])
    if coating > 0:
        depth[rows.size] = coating
    depth[-1] = height
    return frozen_array(depth), int(rows.size)


def graded_grid(
    length: float, height: float, element_size: float, coating: float = 0.0, growth: float = GROWTH
) -> TensorGrid:
    """Grid of one piece [m]: cells of `element_size` (or just below) along x, at least 4 rows in the coating.

    PatchfemError when element_size exceeds the length or the coating the height.
    """
    if element_size > length * (1 + 1e-12):
        raise PatchfemError(
            f"contact.element_size: {element_size:.6g} m exceeds the length {length:.6g} m"
        )
    cells = max(2, ceil(length / element_size - 1e-9))
    depth, rows = graded_depth(height, length / cells, coating, growth)
    return TensorGrid(frozen_array(np.linspace(-length / 2, length / 2, cells + 1)), depth, rows)


def coarser(grid: TensorGrid) -> TensorGrid:
    """Coarsen a grid: its cells merged two by two in both directions.

    An odd number of cells is merged as evenly as it goes. A single thin row left over at a face would make the coarse
    grid finer there than elsewhere.
    """
    nx, coat = grid.x.size - 1, grid.coating_rows
    if nx % 2:
        x = np.linspace(grid.x[0], grid.x[-1], nx // 2 + 2)
    else:
        x = grid.x[::2]
    coated, under = every_second(grid.depth[: coat + 1]), every_second(grid.depth[coat:])
    return TensorGrid(
        frozen_array(x), frozen_array(np.concatenate([coated, under[1:]])), coated.size - 1
    )


def every_second(levels) -> np.ndarray:
    """Every second one of the levels (k,), first and last kept; evenly spaced between them where k is even."""
    if levels.size % 2:
        return levels[::2]
    return np.interp(
        np.linspace(0, levels.size - 1, levels.size // 2 + 1), np.arange(levels.size), levels
    )


def finer(grid: TensorGrid) -> TensorGrid:
    """Refine a grid: every cell is split in two in both directions, the grading going on smoothly.

    The rows of the coating stay in the coating.
    """
    coat = grid.coating_rows
    coated, under = split(grid.depth[: coat + 1]), split(grid.depth[coat:])
    return TensorGrid(
        frozen_array(split(grid.x)), frozen_array(np.concatenate([coated, under[1:]])), 2 * coat
    )


def split(levels) -> np.ndarray:
    """Levels with one more inside each cell, nearer to the shorter neighbour, so that a geometric series stays one."""
    if levels.size < 2:
        return levels
    cells = np.diff(levels)
    ratio = np.ones(cells.size)
    if cells.size > 1:
        inner = cells[2:] / cells[:-2]
        ratio[1:-1] = np.sqrt(inner)
        ratio[0], ratio[-1] = cells[1] / cells[0], cells[-1] / cells[-2]
    out = np.empty(2 * levels.size - 1)
    out[::2] = levels
    # a jump of the grading by more than four is not continued
    out[1::2] = levels[:-1] + cells / (1 + np.sqrt(np.clip(ratio, 0.25, 4.0)))
    return out
