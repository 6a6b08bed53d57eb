"""Compliance of equal cells that cover the face of two pressed blocks.

u = H p + S p: H multiplies each cosine wave of the traction by its closed form (`waves`), which takes two cosine
transforms; S is the smooth change by the free sides (`elasticity.sides`). Arrays over the cells are (ny, nx): rows along y,
columns along x. A profile that does not vary across the width is a single row, ny = 1.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.fft import dctn, idctn

from ..elasticity import sides
from ..elasticity.sides import BlockShape, LayerStack
from .waves import compute_wave_compliance


class SideCompliance(NamedTuple):
    """Change of the compliance of the cells by free sides: u = sum of N E N^T p over even and odd loads.

    - along_x (nx, 2 m_x), along_y (ny, p m_y): Integrals [m] of the splines over columns and rows, the even ones
      first; p is 1 for loads that do not vary along y, else 2.
    - change (2, p, m_x m_y, m_x m_y): Compliance E [m/N] of the splines.
    """

    along_x: np.ndarray
    along_y: np.ndarray
    change: np.ndarray

    def product(self, traction: np.ndarray, cell_area: float) -> np.ndarray:
        """Return the mean displacement (ny, nx) [m] of cells of an area [m2] under a traction (ny, nx) [Pa]."""
        # A quarter of the block carries a quarter of the forces of each parity
        force = self.along_y.T @ traction @ self.along_x / 4
        n_x, n_y, n_nodes, _ = self.change.shape
        parts = force.reshape(n_y, len(force) // n_y, n_x, -1).transpose(2, 0, 3, 1)
        moved = self.change @ parts.reshape(n_x, n_y, n_nodes, 1)
        nodal = moved.reshape(parts.shape).transpose(1, 3, 0, 2).reshape(force.shape)
        return self.along_y @ nodal @ self.along_x.T / cell_area


@dataclass(frozen=True, eq=False)
class CellCompliance:
    """Compliance of (ny, nx) cells under uniform tractions.

    - length, width: Lengths of the face along x and y [m].
    - waves (ny, nx): Compliance [m/Pa] for a traction cos(j pi x/length) cos(i pi y/width).
    - sides: Change by free sides; None between guides.
    - local: Compliance [m/Pa] in series with each cell, (ny, nx) or a number, such as that of bonds.
    - pairs: Number of equal faces that share the forces.
    """

    length: float
    width: float
    waves: np.ndarray
    sides: SideCompliance | None = None
    local: np.ndarray | float = 0.0
    pairs: int = 1

    @property
    def shape(self) -> tuple[int, int]:
        """Number of cells (ny, nx)."""
        return self.waves.shape

    @property
    def cell_area(self) -> float:
        """Area of a cell [m2], summed over the pairs."""
        return self.length * self.width * self.pairs / self.waves.size

    @cached_property
    def x(self) -> np.ndarray:
        """Centres (nx,) [m] of the columns; 0 in the middle of the face."""
        return _find_centres(self.length, self.shape[1])

    @cached_property
    def y(self) -> np.ndarray:
        """Centres (ny,) [m] of the rows; 0 in the middle of the face."""
        return _find_centres(self.width, self.shape[0])

    @property
    def is_rigid(self) -> bool:
        """Whether no cell moves relative to another."""
        return not self.waves.ravel()[1:].any() and not np.any(self.local)

    @cached_property
    def self_compliance(self) -> float:
        """Mean displacement of a cell per traction on it alone [m/Pa], without the free sides."""
        return float(self.waves.mean() + np.mean(self.local))

    @cached_property
    def _typical_local(self) -> float:
        """Local compliance [m/Pa] of a typical cell: the harmonic mean, because weakly loaded bonds are very soft."""
        is_soft = np.greater(self.local, 0)
        return 1 / float(np.mean(1 / np.asarray(self.local)[is_soft])) if is_soft.any() else 0.0

    @cached_property
    def _stiffness(self) -> np.ndarray:
        """Traction per displacement (ny, nx) [Pa/m] of each wave, with a typical local compliance; 0 for rigid waves."""
        compliance = self.waves + self._typical_local
        return np.divide(1, compliance, out=np.zeros(self.shape), where=compliance > 0)

    @cached_property
    def _softness_factor(self) -> np.ndarray | float:
        """Square root of the own compliance of a typical cell over that of each cell; 1 for rigid cells."""
        own = self.waves.mean()
        typical = self._typical_local
        if own + typical == 0:
            return 1.0
        return np.sqrt((own + typical) / (own + np.where(self.local, self.local, typical)))

    def product(self, traction: np.ndarray) -> np.ndarray:
        """Return the displacement (ny, nx) [m] of the cells under a traction (ny, nx) [Pa]."""
        displacement = _multiply_waves(self.waves, traction) + self.local * traction
        if self.sides is not None:
            displacement += self.sides.product(traction, self.cell_area / self.pairs)
        return displacement

    def precondition(self, displacement: np.ndarray) -> np.ndarray:
        """Return about the traction (ny, nx) [Pa] that displaces all cells of a guided block by (ny, nx) [m]."""
        factor = self._softness_factor
        return factor * _multiply_waves(self._stiffness, factor * displacement)

    def __matmul__(self, force: np.ndarray) -> np.ndarray:
        """Return the displacement (m,) [m] under forces (m,) [N] on the m = ny nx cells, as a matrix does."""
        return self.product(np.reshape(force / self.cell_area, self.shape)).ravel()

    def diagonal(self) -> np.ndarray:
        """Return the displacement (m,) [m/N] of each cell under a force on it alone, without the free sides."""
        own = self.waves.mean() + np.broadcast_to(self.local, self.shape)
        return own.ravel() / self.cell_area

    def soften(self, local: np.ndarray | float) -> "CellCompliance":
        """Return the cells with a further local compliance [m/Pa] in series, (ny, nx) or a number."""
        return replace(self, local=self.local + local)

    def add_spring(self, compliance: float) -> "CellCompliance":
        """Return the cells in series with a spring [m/N] that carries the force on all of them.

        The spring moves all cells by its compliance times the sum of the forces, as the wave that does not vary.
        """
        waves = self.waves.copy()
        waves[0, 0] += compliance * self.cell_area * waves.size
        return replace(self, waves=waves)

    def scale(self, factor: float) -> "CellCompliance":
        """Return the compliance times a factor."""
        sides = self.sides and self.sides._replace(change=factor * self.sides.change)
        return replace(self, waves=factor * self.waves, sides=sides, local=factor * self.local)


def _find_centres(length: float, count: int) -> np.ndarray:
    """Return the centres (count,) [m] of equal cells of a length whose middle is 0."""
    return ((np.arange(count) + 0.5) / count - 0.5) * length


def _multiply_waves(factors: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Multiply the cosine waves of cell values (ny, nx) by factors (ny, nx)."""
    axes = (0, 1) if len(values) > 1 else (1,)
    waves = dctn(values, axes=axes, norm="ortho")
    waves *= factors
    return idctn(waves, axes=axes, norm="ortho", overwrite_x=True)


class BlockCompliance(NamedTuple):
    """Compliance of two pressed blocks at the cells of their face.

    - normal: Displacement towards each other under normal tractions.
    - shear: Displacement along x under shear tractions along x, without their coupling to normal displacements, which is 0
      for equal blocks.
    """

    normal: CellCompliance
    shear: CellCompliance


def make_block(
    shape: BlockShape,
    stacks: tuple[LayerStack, LayerStack],
    cells: tuple[int, int],
    side_level: int | None = 1,
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
    side_level : int, optional
        Refinement of the bricks of the free sides (`elasticity.sides.compute_side_change`); None for guides at all
        sides.

    Returns
    -------
    BlockCompliance
    """
    # Waves between guides, and the change by free sides; equal pieces count twice
    n_x, n_y = cells
    k_x = np.arange(n_x) * np.pi / shape.length
    k_y = np.arange(n_y)[:, None] * np.pi / shape.width
    k = np.hypot(k_x, k_y)
    along_fraction = np.divide(k_x**2, k**2, out=np.ones(k.shape), where=k > 0)
    normal = 0.0
    shear = 0.0
    normal_change = 0.0
    shear_change = 0.0
    change = None
    for stack in dict.fromkeys(stacks):
        multiplicity = stacks.count(stack)
        waves = compute_wave_compliance(k, stack)
        normal = normal + multiplicity * waves.normal
        shear = shear + multiplicity * (
            waves.across + along_fraction * (waves.along - waves.across)
        )
        if side_level is not None:
            change = sides.compute_side_change(stack, shape, side_level)
            normal_change = normal_change + multiplicity * change.normal
            shear_change = shear_change + multiplicity * change.shear

    normal = CellCompliance(shape.length, shape.width, normal, pairs=shape.pairs)
    shear = CellCompliance(shape.length, shape.width, shear, pairs=shape.pairs)
    if change is None:
        return BlockCompliance(normal, shear)

    # The splines along both axes do not depend on the layers
    x_edges = np.linspace(-shape.length / 2, shape.length / 2, n_x + 1)
    y_edges = np.linspace(-shape.width / 2, shape.width / 2, n_y + 1)
    integrals = (change.x.integrate(x_edges), change.y.integrate(y_edges))
    return BlockCompliance(
        replace(normal, sides=SideCompliance(*integrals, normal_change)),
        replace(shear, sides=SideCompliance(*integrals, shear_change)),
    )
