"""Plane elasticity of one piece on its grid of bilinear quads, and the recovery of its inside.

The unknowns of a node are (along x, into the piece), so both pieces of a pair obey the same matrix.
"""

from dataclasses import dataclass, field

import numpy as np

from ..core import NotConverged, frozen_array, say
from .condense import Condensed, condense
from .lapack import one_thread
from .tensor_stiffness import tensor_stencil


@dataclass(frozen=True, eq=False, slots=True)
class Layers:
    """Elastic constants of a coated piece: Young's modulus [Pa] and Poisson ratio of coating and of substrate.

    plane: "strain" or "stress".
    """

    coating: tuple
    substrate: tuple
    plane: str


def lame(young: float, poisson: float, plane: str) -> tuple:
    """Lame pair (lambda, mu) [Pa] of the plane problem, plane "strain" or "stress".

    young [Pa], poisson [1]. In plane stress lambda is E nu/(1 - nu^2), which makes the plane forms of both problems
    alike.
    """
    mu = young / (2 * (1 + poisson))
    if plane == "stress":
        return young * poisson / (1 - poisson**2), mu
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """A piece on a tensor grid, fixed at its far face; assembled and factorised when first needed.

    A piece whose compliance is kept on disk is often never assembled.

    - x : (nx,) [m], interface nodes
    - depth : (ny,) [m], rows of nodes
    - nodes : (nx * ny, 2) [m], x and depth of node number column * ny + row
    - cells : (t, 4), nodes of the cells, column by column
    - is_coating : (t,) bool
    - layers : Layers
    - made : dict of what has been computed, by name
    """

    x: np.ndarray
    depth: np.ndarray
    nodes: np.ndarray
    cells: np.ndarray
    is_coating: np.ndarray
    layers: Layers
    made: dict = field(default_factory=dict)

    @property
    def mirrored(self) -> bool:
        """Whether the piece is its own mirror image in x, to round-off of its nodes."""
        grid = self.nodes.reshape(self.x.size, -1, 2)
        return bool(np.abs(grid * [-1, 1] - grid[::-1]).max() <= 1e-13 * np.ptp(self.x))

    @property
    def stencil(self) -> np.ndarray:
        """Stiffness per unit width (nx, ny - 1, 3, 3, 2, 2) [N/m per m], as `tensor_stiffness` describes it."""
        if "stencil" not in self.made:
            layers = self.layers
            coating = lame(*layers.coating, layers.plane)
            substrate = lame(*layers.substrate, layers.plane)
            is_coating = self.is_coating[: self.depth.size - 1]
            lam = np.where(is_coating, coating[0], substrate[0])
            mu = np.where(is_coating, coating[1], substrate[1])
            self.made["stencil"] = tensor_stencil(self.x, self.depth, lam, mu)
        return self.made["stencil"]

    @property
    def rounding(self) -> float:
        """Relative error of the compliance by round-off [1], as far as it is known: 0 before anything is factorised."""
        return self.made["factor"].rounding if "factor" in self.made else 0.0

    @property
    def factor(self) -> Condensed:
        """The piece condensed to its interface, made once for compliance and fields.

        NotConverged where the stiffness cannot be factorised, with what to change.
        """
        if "factor" not in self.made:
            try:
                self.made["factor"] = condense(self.stencil, self.mirrored)
            except NotConverged as error:
                raise NotConverged(f"{error}; {_remedy(self)}") from None
        return self.made["factor"]

    def displaced(self, load) -> np.ndarray:
        """Return displacements (frames, nx * ny, 2) [m] under interface loads (nx, 2, frames) [N/m]."""
        nx, frames = self.x.size, load.shape[-1]
        out = np.zeros((frames, nx, self.depth.size, 2))
        out[:, :, :-1] = np.moveaxis(self.factor.displacement(load), 3, 0)
        return out.reshape(frames, -1, 2)


def _remedy(piece: Piece) -> str:
    least = min(np.diff(piece.x).min(), np.diff(piece.depth).min())
    return remedy(piece.layers, piece.is_coating.any(), least, (np.ptp(piece.x), piece.depth[-1]))


def remedy(layers: Layers, coated: bool, least: float, size: tuple) -> str:
    """What to change where the stiffness of a piece cannot be factorised.

    coated: whether it has cells of a coating; least: its shortest cell [m]; size: its length and height [m].
    """
    ratio = layers.coating[0] / layers.substrate[0]
    if coated and not 1e-3 < ratio < 1e3:
        return (
            f"the Young's moduli of coating and substrate differ by a factor of {max(ratio, 1 / ratio):.2g}: bring "
            "the moduli closer together, make the coating thicker, or leave the coating out"
        )
    return (
        f"the shortest cell is {say(least, 3)} in a piece of {say(size[0], 3)} x {say(size[1], 3)}: use longer "
        "cells (contact.element_size, or the cells of contact.mesh)"
    )


def assemble(x, depth, coating_rows: int, layers: Layers) -> Piece:
    """Return one piece on a tensor grid, whose stiffness is assembled when it is first needed.

    Parameters
    ----------
    x : (nx,) ndarray [m]
    depth : (ny,) ndarray [m]
    coating_rows : int
        Number of rows of cells in the coating.
    layers : Layers

    Returns
    -------
    Piece
    """
    nodes = np.stack(np.broadcast_arrays(np.asarray(x)[:, None], depth), axis=-1).reshape(-1, 2)
    cells, is_coating = grid_cells(x.size, depth.size, coating_rows)
    return Piece(x, depth, nodes, cells, is_coating, layers)


def grid_cells(columns: int, rows: int, coating_rows: int) -> tuple:
    """Cells (t, 4) of a grid of nodes column * rows + row, column by column, and which are coating (t,).

    A cell is (column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1).
    """
    first = (np.arange(columns - 1)[:, None] * rows + np.arange(rows - 1)).ravel()
    return np.stack(
        [first, first + rows, first + rows + 1, first + 1], axis=1
    ), first % rows < coating_rows


def displacement(piece, shear: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return displacements (frames, nodes, 2) [m] of a piece, along x and inward, under forces on its interface.

    The factors of the piece are used again.

    Parameters
    ----------
    piece : Piece or substructure.Substructure
    shear, normal : (frames, m) ndarray
        Nodal forces per unit width [N/m] that act on the piece along +x and inward.

    Raises
    ------
    NotConverged
        If the stiffness of the piece cannot be factorised.
    """
    return piece.displaced(
        np.stack([np.atleast_2d(shear).T, np.atleast_2d(normal).T], axis=1).astype(float)
    )


def hooke(exx, eyy, exy, is_coating, layers: Layers) -> np.ndarray:
    """Stresses (..., t, 4) as xx, yy, zz, xy [Pa] of plane strains by Hooke's law.

    Tension > 0. exx, eyy, exy: (..., t) [1], exy half the engineering shear; is_coating: (t,) bool; layers: the two
    materials. zz is nu (xx + yy) in plane strain, 0 in plane stress.
    """
    pick = is_coating.astype(int)
    lam, mu = np.array(
        [lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)]
    )[pick].T
    poisson = np.array([layers.substrate[1], layers.coating[1]])[pick]
    sxx = lam * (exx + eyy) + 2 * mu * exx
    syy = lam * (exx + eyy) + 2 * mu * eyy
    szz = poisson * (sxx + syy) if layers.plane == "strain" else np.zeros_like(sxx)
    return np.stack([sxx, syy, szz, 2 * mu * exy], axis=-1)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (...,) [Pa] of stresses (..., 4) [Pa] as xx, yy, zz, xy."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy**2)


def interface_compliance(piece) -> tuple:
    """Return the compliances (nn, tt, nt) of a piece at its interface per unit width, each (m, m) [m2/N], read-only.

    nn: inward motion per inward force; tt: motion along x per force along x; nt: inward motion per force along x. A
    piece on a grid that is its own mirror image costs half.

    Parameters
    ----------
    piece : Piece or substructure.Substructure

    Raises
    ------
    NotConverged
        If the stiffness of the piece cannot be factorised.
    """
    with one_thread():
        both = piece.factor.compliance()
    both = (both + both.T) / 2
    return tuple(
        frozen_array(part) for part in (both[1::2, 1::2], both[0::2, 0::2], both[1::2, 0::2])
    )
