"""Pieces longer than the interface or with chamfered or rounded ends, as deformed grids.

The columns stay vertical. Over the interface they are those of the other piece; beyond it they grow
towards the end of the piece. Every column is lowered by the drop of the face: the coating by the
whole drop, because a layer that is sprayed from above has the same thickness along the spray, the
substrate by a fraction that decreases to zero at the far face.
"""

from dataclasses import dataclass

import numpy as np

from ..core import frozen_array
from .anymesh import PieceMesh
from .ends import End
from .pairs import convert_to_piece_mesh
from .tensor import ROW_GROWTH, TensorGrid, graded_rows, merge_levels, split_levels


@dataclass(frozen=True, eq=False, slots=True)
class ShapedGrid(PieceMesh):
    """Piece as a mesh of quads, and the grid from which the mesh is made.

    - ``inner``: tensor grid over the interface
    - ``outer``: (k,) distances [m] of the columns beyond either end of the interface, the first 0
    - ``end``: shape of both ends
    """

    inner: TensorGrid
    outer: np.ndarray
    end: End

    @property
    def coating_thickness(self) -> float:
        """Thickness of the coating [m], or 0 if there is no coating."""
        return self.inner.coating_thickness

    @property
    def half_flat_length(self) -> float:
        """Half the length [m] of the flat face between both ends."""
        return self._piece_length() / 2 - self.end.size

    @property
    def base_grid(self) -> TensorGrid:
        """Tensor grid over the interface."""
        return self.inner

    def refine(self) -> "ShapedGrid":
        """Return the piece after every cell is split in two in both directions.

        The nodes of the face follow its shape.
        """
        return _move_columns(
            self.inner.refine(), split_levels(self.outer), self._piece_length(), self.end
        )

    def coarsen(self) -> "ShapedGrid":
        """Return the piece after its cells are merged two by two in both directions."""
        return _move_columns(
            self.inner.coarsen(), merge_levels(self.outer), self._piece_length(), self.end
        )

    def _piece_length(self) -> float:
        return 2 * float(self.inner.x[-1] + self.outer[-1])


def shaped_grid(
    inner: TensorGrid, length: float, end: End, growth: float = ROW_GROWTH
) -> ShapedGrid:
    """Make a piece with shaped ends from the grid over the interface.

    The interface lies in the middle of the piece. The first column beyond the interface is as long
    as the last column over it. A column of nodes lies where a chamfer or a rounding begins.

    Parameters
    ----------
    inner : TensorGrid
    length : float
        Length of the piece [m].
    end : End
    growth : float
        Ratio of the lengths of successive columns beyond the interface.

    Returns
    -------
    ShapedGrid
    """
    half_interface = float(inner.x[-1])
    cell = float(inner.x[-1] - inner.x[-2])
    stops = {length / 2 - end.size, length / 2}
    outer = [np.zeros(1)]
    for stop in sorted(stop for stop in stops if stop > half_interface * (1 + 1e-12)):
        outer_length = outer[-1][-1]
        columns = graded_rows(cell, stop - (half_interface + outer_length), growth)
        outer.append(outer_length + np.cumsum(columns))
        cell = columns[-1] * growth
    return _move_columns(inner, np.concatenate(outer), length, end)


def _move_columns(inner: TensorGrid, outer, length: float, end: End) -> ShapedGrid:
    """Extend a grid beyond the interface and move its nodes to the curved face of the piece."""
    beyond = inner.x[-1] + outer[1:]
    if beyond.size:
        beyond[-1] = length / 2
    x = np.concatenate([-beyond[::-1], inner.x, beyond])
    grid = convert_to_piece_mesh(TensorGrid(x, inner.depth, inner.coating_rows))
    substrate_height = inner.height - inner.coating_thickness
    fraction = np.minimum(1.0, (inner.height - inner.depth) / substrate_height)
    points = grid.points.copy()
    points[:, 1] += np.outer(end.face_depth(x, length), fraction).ravel()
    return ShapedGrid(
        frozen_array(points),
        grid.triangles,
        grid.quads,
        grid.is_coating,
        grid.interface[beyond.size : beyond.size + inner.x.size],
        grid.far,
        inner,
        frozen_array(outer),
        end,
    )
