"""Compliance of equal cells that cover the face of two pressed blocks.

u = H p + S p: H multiplies each cosine wave of the traction by its closed form (`waves`), which takes two cosine
transforms along each axis; S is the smooth change by the free sides (`elasticity.sides`). Arrays over the cells are
(ny, nx): rows along y, columns along x. A profile that does not vary across the width is a single row, ny = 1.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..elasticity.sides import BlockShape, LayerStack


@dataclass(frozen=True, eq=False)
class CellCompliance:
    """Compliance of (ny, nx) cells under uniform tractions.

    - length, width: Lengths of the face along x and y [m].
    - waves (ny, nx): Compliance [m/Pa] for a traction cos(j pi x/length) cos(i pi y/width).
    - sides: Terms of the free sides; empty between guides.
    """

    length: float
    width: float
    waves: np.ndarray
    sides: tuple = ()

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells (ny, nx)."""
        return self.waves.shape

    @property
    def cell_area(self) -> float:
        """Area of a cell [m2]."""
        raise NotImplementedError

    @property
    def x(self) -> np.ndarray:
        """Centres (nx,) [m] of the columns; 0 in the middle of the face."""
        raise NotImplementedError

    @property
    def y(self) -> np.ndarray:
        """Centres (ny,) [m] of the rows; 0 in the middle of the face."""
        raise NotImplementedError

    @property
    def self_compliance(self) -> float:
        """Mean displacement of a cell per traction on it alone [m/Pa]."""
        raise NotImplementedError

    def product(self, traction: np.ndarray) -> np.ndarray:
        """Return the displacement (ny, nx) [m] of the cells under a traction (ny, nx) [Pa]."""
        raise NotImplementedError

    def precondition(self, displacement: np.ndarray) -> np.ndarray:
        """Return the traction (ny, nx) [Pa] that displaces all cells of a guided block by (ny, nx) [m]."""
        raise NotImplementedError


class BlockCompliance(NamedTuple):
    """Compliance of the cells of two pressed blocks.

    - normal: Under normal tractions.
    - shear: Under shear tractions along x, without their coupling to normal displacements; exact for equal pieces.
    """

    normal: CellCompliance
    shear: CellCompliance


def make_block(
    shape: BlockShape,
    stacks: tuple[LayerStack, LayerStack],
    cells: tuple[int, int],
    side_level: int = 1,
) -> BlockCompliance:
    """Make the compliance of the cells between two coated blocks.

    Parameters
    ----------
    shape : BlockShape
        Length and width of the face [m] and the sides that are free.
    stacks : tuple of LayerStack
        Layers of the upper and of the lower block, from the face to the far face.
    cells : tuple of int
        Number of cells (nx, ny); ny = 1 for a face that does not vary across its width.
    side_level : int
        Refinement of the elements of the free sides (`elasticity.sides.compute_side_change`).

    Returns
    -------
    BlockCompliance
    """
    raise NotImplementedError
