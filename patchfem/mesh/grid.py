"""A coated piece as a structured grid of columns and of rows that grow with the distance from both faces.

Both pieces of a pair have the same columns over the interface, so their interface nodes match. The columns of a longer
piece go on beyond the interface. At chamfered or rounded ends every column is lowered by the drop of the face: the
coating by the whole drop, because a layer that is sprayed from above has the same thickness along the spray, the
substrate by a fraction that decreases to zero at the far face. Other shapes of the surfaces are described by the gap
g(x), never by the mesh.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from math import ceil, log

import numpy as np

from ..core import frozen_array
from .ends import SHARP_END, End
from .grading import Layout, RowHeights, divide_interval, divide_into_rows, tributary_lengths

# Number of equal columns beyond which the rows become shorter with the columns; with fewer columns
# the rows stay as short, which costs little
N_REFERENCE_COLUMNS = 32
# Growth of the rows with the distance from a face, for N_REFERENCE_COLUMNS columns; with 0.2 there
# are a fifth more rows for the same error of the compliance
ROW_HEIGHT_GROWTH = 0.3
MIN_PIECE_ROWS = 6  # smallest number of rows of a piece


@dataclass(frozen=True, eq=False)
class TensorGrid:
    """Graded structured grid of one piece; node j * ny + i is in column j and row i.

    - ``x``: (m,) columns of nodes over the interface [m], 0 in the middle
    - ``depth``: (ny,) rows of nodes [m], 0 at the flat face
    - ``coating_rows``: number of rows of cells in the coating
    - ``outer``: (k,) distances [m] of the columns beyond either end of the interface, the first 0
    - ``end``: shape of both ends of the piece
    """

    x: np.ndarray
    depth: np.ndarray
    coating_rows: int
    outer: np.ndarray = field(default_factory=lambda: np.zeros(1))
    end: End = SHARP_END

    @property
    def length(self) -> float:
        """Extent of the interface [m]."""
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
    def piece_length(self) -> float:
        """Length of the piece [m]."""
        return self.length + 2 * float(self.outer[-1])

    @property
    def half_flat_length(self) -> float:
        """Half the length [m] of the flat face between both ends."""
        return self.piece_length / 2 - self.end.size

    @cached_property
    def columns(self) -> np.ndarray:
        """Positions (nx,) [m] of all columns of nodes."""
        beyond = self.x[-1] + self.outer[1:]
        return frozen_array(np.concatenate([-beyond[::-1], self.x, beyond]))

    @property
    def shape(self) -> tuple[int, int]:
        """Number of columns and number of rows of nodes."""
        return self.columns.size, self.depth.size

    @property
    def n_nodes(self) -> int:
        """Number of nodes, known without the arrays of a grid that may be too large for the memory."""
        return self.columns.size * self.depth.size

    @property
    def interface(self) -> np.ndarray:
        """Nodes (m,) of the interface by increasing x."""
        return (np.arange(self.x.size) + self.outer.size - 1) * self.depth.size

    @property
    def pressure_nodes(self) -> np.ndarray:
        """Nodes (m,) between which the pressure is linear: those of the interface."""
        return self.interface

    @property
    def far(self) -> np.ndarray:
        """Fixed nodes (nx,) of the far face."""
        return np.arange(1, self.columns.size + 1) * self.depth.size - 1

    @property
    def interface_depths(self) -> np.ndarray:
        """Depth of the interface nodes (m,) [m], >= 0, which is added to the gap at rounded ends."""
        return self.end.face_depth(self.x, self.piece_length)

    @cached_property
    def points(self) -> np.ndarray:
        """Nodes (nx * ny, 2) as x and depth [m]."""
        nx, ny = self.shape
        out = np.stack([np.repeat(self.columns, ny), np.tile(self.depth, nx)], axis=1)
        lowering = np.minimum(
            1.0, (self.height - self.depth) / (self.height - self.coating_thickness)
        )
        drop = self.end.face_depth(self.columns, self.piece_length)
        out[:, 1] += np.outer(drop, lowering).ravel()
        return frozen_array(out)

    @property
    def blocks(self) -> dict[str, np.ndarray]:
        """Cells (t, 4) by the name of their element; cells are numbered down each column."""
        nx, ny = self.shape
        node = np.arange(nx * ny).reshape(nx, ny)
        corners = (node[:-1, :-1], node[1:, :-1], node[1:, 1:], node[:-1, 1:])
        return {"quad": np.stack([corner.ravel() for corner in corners], axis=1)}

    @property
    def is_coating(self) -> np.ndarray:
        """Whether each cell (t,) belongs to the coating."""
        nx, ny = self.shape
        return np.tile(np.arange(ny - 1) < self.coating_rows, nx - 1)

    @property
    def cell_positions(self) -> np.ndarray:
        """Column and row (t, 2) of each cell, by which condensation to the interface halves the grid into parts."""
        nx, ny = self.shape
        return np.indices((nx - 1, ny - 1)).reshape(2, -1).T

    def tributary_lengths(self) -> np.ndarray:
        """Return the tributary length (m,) [m] of each interface node."""
        return tributary_lengths(self.x)

    def coarsen(self) -> "TensorGrid":
        """Return the grid after its cells are merged two by two in both directions.

        An odd number of columns is merged into columns of equal width. A single thin column at an
        end would make the coarse grid finer there than elsewhere.
        """
        x = self.x[::2]
        if self.x.size % 2 == 0:
            x = np.linspace(self.x[0], self.x[-1], self.x.size // 2 + 1)
        return self._change_grid_lines(x, merge_grid_lines)

    def refine(self) -> "TensorGrid":
        """Return the grid after every cell is split in two in both directions with smooth grading.

        The rows of the coating stay in the coating, and the nodes of the face follow its shape.
        """
        return self._change_grid_lines(split_grid_lines(self.x), split_grid_lines)

    def _change_grid_lines(self, x, change) -> "TensorGrid":
        """Return the grid with the columns x [m], after `change` is applied to its rows and outer columns.

        `change` takes and returns ascending grid lines (k,) [m]. It is applied to coating and substrate separately, so
        that a grid line stays between them.
        """
        coating_depth = change(self.depth[: self.coating_rows + 1])
        substrate_depth = change(self.depth[self.coating_rows :])
        depth = np.concatenate([coating_depth, substrate_depth[1:]])
        return replace(
            self,
            x=frozen_array(x),
            depth=frozen_array(depth),
            coating_rows=coating_depth.size - 1,
            outer=frozen_array(change(self.outer)),
        )

    def extend(self, length: float, end: End, growth: float = 1.1) -> "TensorGrid":
        """Return the grid of a piece of which this one is the part over the interface.

        The interface lies in the middle of the piece. The first column beyond the interface is as long
        as the last column over it. A column of nodes lies where a chamfer or a rounding begins.

        Parameters
        ----------
        length : float
            Length of the piece [m].
        end : End
            Shape of both ends of the piece.
        growth : float
            Ratio of the lengths of successive columns beyond the interface.

        Returns
        -------
        TensorGrid
        """
        cell = float(self.x[-1] - self.x[-2])
        slope = log(growth)
        outer = np.zeros(1)
        for half_length in sorted({length / 2 - end.size, length / 2}):
            start = outer[-1]
            stop = half_length - float(self.x[-1])
            if stop > start + 1e-12 * self.x[-1]:
                # Between lines at equal steps of the integral of 1/length, the first column has the length `cell`
                bands = ((start, start, cell * slope / (growth - 1)),)
                layout = Layout(start, stop, bands, np.inf, slope)
                outer = np.append(outer, divide_interval(layout)[1:])
                cell = (outer[-1] - outer[-2]) * growth
        return replace(self, outer=frozen_array(outer), end=end)


def make_graded_grid(
    length: float, height: float, element_size: float, coating_thickness: float = 0.0
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
    coating_thickness : float
        Thickness of the coating [m].

    Returns
    -------
    TensorGrid
    """
    # Rows for N_REFERENCE_COLUMNS columns, which are then scaled with the columns.
    n_columns = max(2, ceil(length / element_size - 1e-9))
    scale = compute_row_scale(n_columns)
    reference_cell = length / n_columns / scale

    # The stress is singular at the ends of the far face, so that the rows are short there as well.
    rows = RowHeights(
        first=scale * reference_cell,
        last=scale * reference_cell,
        coating=scale * min(reference_cell, coating_thickness / 4),  # four rows at its inner face
        largest=scale * height / MIN_PIECE_ROWS,
        growth=scale * ROW_HEIGHT_GROWTH,
    )
    x = np.linspace(-length / 2, length / 2, n_columns + 1)
    return TensorGrid(frozen_array(x), *divide_into_rows(height, coating_thickness, rows))


def compute_row_scale(n_columns: int) -> float:
    """Return the height of the rows of a grid with equal columns, divided by that with N_REFERENCE_COLUMNS columns.

    It is at most 1: with fewer columns the rows stay as short.
    """
    return min(1.0, N_REFERENCE_COLUMNS / n_columns)


def merge_grid_lines(grid_lines) -> np.ndarray:
    """Return every second of the grid lines `grid_lines` (k,) [m], including the first and the last.

    With an odd number of cells the lines are interpolated in their number instead.
    """
    if grid_lines.size % 2:
        return grid_lines[::2]
    position = np.linspace(0, grid_lines.size - 1, grid_lines.size // 2 + 1)
    return np.interp(position, np.arange(grid_lines.size), grid_lines)


def split_grid_lines(grid_lines) -> np.ndarray:
    """Insert a grid line into each cell so that geometric growth of the cells is preserved.

    `grid_lines` (k,) [m] are ascending grid lines. The result has 2 k - 1 of them.
    """
    if grid_lines.size < 2:
        return grid_lines
    cells = np.diff(grid_lines)
    ratio = np.ones(cells.size)
    if cells.size > 1:
        ratio[1:-1] = np.sqrt(cells[2:] / cells[:-2])
        ratio[0] = cells[1] / cells[0]
        ratio[-1] = cells[-1] / cells[-2]
    out = np.empty(2 * grid_lines.size - 1)
    out[::2] = grid_lines
    # A ratio above four is a jump of the cell size where two gradings meet; the limit keeps the
    # halves of a cell beside the jump within a factor of two of each other.
    out[1::2] = grid_lines[:-1] + cells / (1 + np.sqrt(np.clip(ratio, 0.25, 4.0)))
    return out
