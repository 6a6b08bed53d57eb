"""A piece that reaches beyond the interface, or whose ends are chamfered or rounded: a tensor grid, moved.

The columns stay upright. Over the interface they are those of the other piece; beyond it they grow to the end of the
piece. Every column is lowered by the drop of the face there: the coating by all of it, as a layer sprayed from above
has the same thickness along the spray, the substrate by a share that falls to nothing at the far face.
"""

from dataclasses import dataclass

import numpy as np

from ..core import frozen_array
from . import tensor
from .anymesh import PieceMesh
from .ends import End
from .pairs import as_piece
from .tensor import GROWTH, TensorGrid, graded_rows


@dataclass(frozen=True, eq=False, slots=True)
class ShapedGrid(PieceMesh):
    """The piece as a mesh of quads, with the plan that it is made from.

    inner: the grid over the interface; outer: (k,) distances [m] of the columns beyond either end of the interface, 0
    first, (1,) where there are none; end: the shape of both ends.
    """

    inner: TensorGrid
    outer: np.ndarray
    end: End

    @property
    def depth(self) -> np.ndarray:
        """Rows (ny,) [m] below the flat of the face."""
        return self.inner.depth

    @property
    def coating(self) -> float:
        """Thickness of the coating [m], 0 without one."""
        return self.inner.coating

    @property
    def flat(self) -> float:
        """Half the length [m] of the face before its ends begin."""
        return self._whole / 2 - self.end.size

    def finer(self) -> "ShapedGrid":
        """Every cell split in two in both directions; the face follows its shape anew."""
        return _made(tensor.finer(self.inner), tensor.split(self.outer), self._whole, self.end)

    def coarser(self) -> "ShapedGrid":
        """The cells merged two by two in both directions."""
        return _made(
            tensor.coarser(self.inner), tensor.every_second(self.outer), self._whole, self.end
        )

    @property
    def _whole(self) -> float:
        return 2 * float(self.inner.x[-1] + self.outer[-1])


def shaped_grid(inner: TensorGrid, length: float, end: End, growth: float = GROWTH) -> ShapedGrid:
    """A piece of `length` [m] from its grid over the interface, which lies in the middle of it.

    Columns beyond the interface begin as long as its last cell and grow by `growth`; one stands where a chamfer or a
    rounding begins.
    """
    reach, cell = float(inner.x[-1]), float(inner.x[-1] - inner.x[-2])
    stops = sorted(
        {place for place in (length / 2 - end.size, length / 2) if place > reach * (1 + 1e-12)}
    )
    outer = [np.zeros(1)]
    for stop in stops:
        begun = reach + outer[-1][-1]
        rows = graded_rows(cell, stop - begun, growth)
        outer.append(outer[-1][-1] + np.cumsum(rows))
        cell = rows[-1] * growth
    return _made(inner, np.concatenate(outer), length, end)


def _made(inner: TensorGrid, outer, length: float, end: End) -> ShapedGrid:
    beyond = inner.x[-1] + outer[1:]
    if beyond.size:
        beyond[-1] = length / 2
    x = np.concatenate([-beyond[::-1], inner.x, beyond])
    flat = as_piece(TensorGrid(x, inner.depth, inner.coating_rows))
    thick, height = inner.coating, inner.height
    share = np.minimum(1.0, (height - inner.depth) / (height - thick))
    points = flat.points.copy()
    points[:, 1] += np.outer(end.drop(x, length), share).ravel()
    first = beyond.size
    return ShapedGrid(
        frozen_array(points),
        flat.triangles,
        flat.quads,
        flat.is_coating,
        flat.interface[first : first + inner.x.size],
        flat.far,
        inner,
        frozen_array(outer),
        end,
    )
