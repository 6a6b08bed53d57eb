"""Change of the compliance of a block by its free sides, by bricks of order 4.

A block between guides without friction responds to cosine waves in closed form (`contact.waves`). Free sides change its
compliance by a smooth function, which is computed on a quarter of the block, for loads that are even or odd along each
axis. The stiffness of the quarter is a sum of Kronecker products of matrices along x, y and z.
"""

from typing import NamedTuple

import numpy as np

from .elasticity import Layers


class LayerStack(NamedTuple):
    """Elastic layers of a piece from the face down.

    - thicknesses (n,): Thickness of each layer [m].
    - moduli (n, 2): Lame's constants lambda and mu [Pa] of each layer.
    - base: Lame's constants [Pa] of a half-space below the layers; None for a rigid base.
    """

    thicknesses: tuple[float, ...]
    moduli: tuple[tuple[float, float], ...]
    base: tuple[float, float] | None = None

    @property
    def height(self) -> float:
        """Sum of the thicknesses [m]."""
        return sum(self.thicknesses)


def make_stack(height: float, thickness: float, layers: Layers) -> LayerStack:
    """Return the layers of a coated piece whose far face is held.

    Parameters
    ----------
    height : float
        Height of the piece with its coating [m].
    thickness : float
        Thickness of the coating [m]; 0 for none.
    layers : Layers
        Elastic constants of coating and substrate.
    """
    raise NotImplementedError


class BlockShape(NamedTuple):
    """Face of a block and the sides that are free.

    - length, width: Lengths of the face along x and y [m].
    - free_sides: "xy" for four free sides; "x" for free sides at both ends of x and guides along y (plane strain).
    """

    length: float
    width: float
    free_sides: str = "xy"


class SideChange(NamedTuple):
    """Change of the compliance of a face by free sides, in polynomials on elements of a quarter of the face.

    - edges_x, edges_y: Edges [m] of the elements from the middle of the face to its sides.
    - normal, shear: Change [m/N] of the compliance of normal tractions and of shear tractions along x, (4, m, m): for
      loads even along both axes, odd along y, odd along x, and odd along both. The m = m_x m_y nodes are ordered by x,
      then y.
    """

    edges_x: np.ndarray
    edges_y: np.ndarray
    normal: np.ndarray
    shear: np.ndarray


def compute_side_change(stack: LayerStack, shape: BlockShape, level: int = 1) -> SideChange:
    """Compute the change of compliance by free sides, or read it from the user's cache.

    Parameters
    ----------
    stack : LayerStack
        Layers of the block on a rigid base.
    shape : BlockShape
        Face of the block and its free sides.
    level : int
        Refinement of the elements; the error of the measures is about a quarter of that of the level before.

    Returns
    -------
    SideChange
    """
    raise NotImplementedError
