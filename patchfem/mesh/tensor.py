"""A coated piece as a tensor grid of columns and of rows that grow with the distance from both faces.

Both pieces of a pair have the same columns, so their interface nodes match. The shapes of the
surfaces are described by the gap g(x), never by the mesh.
"""

from dataclasses import dataclass
from math import ceil, log

import numpy as np

from ..core import PatchfemError, frozen_array
from .grading import Layout, divide_into_rows, tributary_lengths

ROW_GROWTH = 1.1  # ratio of the lengths of successive cells, unless another one is given
# Number of equal columns beyond which the rows become shorter with the columns; with fewer columns
# the rows stay as short, which costs little
N_REFERENCE_COLUMNS = 32
# Growth of the rows with the distance from a face, for N_REFERENCE_COLUMNS columns; with 0.2 there
# are a fifth more rows for the same error of the compliance
ROW_SLOPE = 0.3
COATING_ROWS = 4  # ratio of the thickness of a coating to the rows at its inner face
MIN_ROWS = 6  # smallest number of rows of a piece


@dataclass(frozen=True, eq=False, slots=True)
class TensorGrid:
    """Graded tensor grid of one piece.

    - ``x``: (nx,) columns of nodes [m], 0 in the middle
    - ``depth``: (ny,) rows of nodes [m], 0 at the interface
    - ``coating_rows``: number of rows of cells in the coating
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
    def first_row_height(self) -> float:
        """Height of the first row of cells [m]."""
        return float(self.depth[1])

    @property
    def coating_thickness(self) -> float:
        """Thickness of the coating [m], or 0 if there is no coating."""
        return float(self.depth[self.coating_rows])

    @property
    def base_grid(self) -> "TensorGrid":
        """Tensor grid that spans the interface, which for this class is the grid itself."""
        return self

    def tributary_lengths(self) -> np.ndarray:
        """Return the tributary length (nx,) [m] of each interface node."""
        return tributary_lengths(self.x)

    def is_coating_cell(self) -> np.ndarray:
        """Return whether each cell (column, row) belongs to the coating, as bool (nx - 1, ny - 1)."""
        row = np.arange(self.depth.size - 1) < self.coating_rows
        return np.broadcast_to(row, (self.x.size - 1, row.size))

    def coarsen(self) -> "TensorGrid":
        """Return the grid after its cells are merged two by two in both directions.

        An odd number of columns is merged into columns of equal width. A single thin column at an
        end would make the coarse grid finer there than elsewhere.
        """
        x = self.x[::2]
        if self.x.size % 2 == 0:
            x = np.linspace(self.x[0], self.x[-1], self.x.size // 2 + 1)
        return self._with_rows(x, merge_levels)

    def refine(self) -> "TensorGrid":
        """Return the grid after every cell is split in two in both directions with smooth grading.

        The rows of the coating stay in the coating.
        """
        return self._with_rows(split_levels(self.x), split_levels)

    def _with_rows(self, x, change) -> "TensorGrid":
        """Return the grid with given columns, and with rows to which a function is applied in each layer."""
        coating_depth = change(self.depth[: self.coating_rows + 1])
        substrate_depth = change(self.depth[self.coating_rows :])
        depth = np.concatenate([coating_depth, substrate_depth[1:]])
        return TensorGrid(frozen_array(x), frozen_array(depth), coating_depth.size - 1)


def graded_rows(
    start: float, total: float, growth: float = ROW_GROWTH, min_rows: int = 1
) -> np.ndarray:
    """Compute heights of rows that grow with a constant ratio and add up to a total.

    Parameters
    ----------
    start : float
        Height of the first row [m], or a little less.
    total : float
        Sum of the heights [m].
    growth : float
        Largest ratio of successive heights.
    min_rows : int
        Minimum number of rows.

    Returns
    -------
    (ny,) ndarray [m]

    Raises
    ------
    ValueError
        Unless start and total are positive and growth is above 1.
    """
    if not (start > 0 and total > 0 and growth > 1):
        raise ValueError("start and total must be positive and growth above 1")
    start = min(start, total / min_rows)
    n_rows = max(min_rows, ceil(log(1 + total * (growth - 1) / start) / log(growth) - 1e-9))
    if n_rows * start >= total * (1 - 1e-12):
        return np.full(n_rows, total / n_rows)
    # The sum is convex in the ratio, so Newton steps from above decrease until round-off.
    powers = np.arange(n_rows)
    next_ratio = growth * (1 + 1e-6) + 1e-6
    ratio = np.inf
    while next_ratio < ratio:
        ratio = next_ratio
        rows = ratio**powers
        derivative = start * (powers[1:] @ rows[:-1])
        next_ratio = ratio - (start * rows.sum() - total) / derivative
    rows = start * ratio**powers
    return rows * (total / rows.sum())


def graded_grid(
    length: float, height: float, element_size: float, coating: float = 0.0
) -> TensorGrid:
    """Make the grid of a piece with equal columns, whose rows grow with the distance from both faces.

    With more than N_REFERENCE_COLUMNS columns all rows are shorter in the same ratio as the columns, so
    that half the element size halves every cell in both directions.

    Parameters
    ----------
    length, height : float
        Size of the piece [m].
    element_size : float
        Width of the columns [m], or a little more.
    coating : float
        Thickness of the coating [m].

    Returns
    -------
    TensorGrid

    Raises
    ------
    PatchfemError
        If element_size exceeds the length, or the coating fills the height.
    """
    if element_size > length * (1 + 1e-12):
        raise PatchfemError(
            f"contact.element_size: {element_size:.6g} m exceeds the length {length:.6g} m"
        )
    if coating >= height:
        raise PatchfemError(
            f"contact.coating.thickness: {coating:.6g} m leaves no substrate in a piece of height "
            f"{height:.6g} m"
        )
    n_columns = max(2, ceil(length / element_size - 1e-9))
    scale = row_scale(n_columns)
    reference_cell = length / n_columns / scale

    # The stress is singular at the ends of the far face, so that the rows are short there as well.
    bands = [(0.0, 0.0, reference_cell), (height, height, reference_cell)]
    if coating > 0:
        bands.append((coating, coating, min(reference_cell, coating / COATING_ROWS)))
    max_row = height / MIN_ROWS
    rows = Layout(
        0.0, height, tuple(bands), (0.0, height), max_row, max_row, ROW_SLOPE
    ).scale_cells(scale)

    x = np.linspace(-length / 2, length / 2, n_columns + 1)
    return TensorGrid(frozen_array(x), *divide_into_rows(rows, coating))


def row_scale(n_columns: int) -> float:
    """Return the ratio of the rows of a grid with equal columns to those with N_REFERENCE_COLUMNS columns."""
    return min(1.0, N_REFERENCE_COLUMNS / n_columns)


def merge_levels(levels) -> np.ndarray:
    """Return every second grid line, including the first and the last."""
    if levels.size % 2:
        return levels[::2]
    position = np.linspace(0, levels.size - 1, levels.size // 2 + 1)
    return np.interp(position, np.arange(levels.size), levels)


def split_levels(levels) -> np.ndarray:
    """Insert a grid line into each cell so that geometric growth of the cells is preserved."""
    if levels.size < 2:
        return levels
    cells = np.diff(levels)
    ratio = np.ones(cells.size)
    if cells.size > 1:
        ratio[1:-1] = np.sqrt(cells[2:] / cells[:-2])
        ratio[0] = cells[1] / cells[0]
        ratio[-1] = cells[-1] / cells[-2]
    out = np.empty(2 * levels.size - 1)
    out[::2] = levels
    # A ratio above four is a jump of the cell size where two gradings meet; the limit keeps the
    # halves of a cell beside the jump within a factor of two of each other.
    out[1::2] = levels[:-1] + cells / (1 + np.sqrt(np.clip(ratio, 0.25, 4.0)))
    return out
