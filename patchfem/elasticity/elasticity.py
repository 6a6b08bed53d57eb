"""Plane elasticity of one piece on a tensor grid of bilinear quadrilaterals.

The unknowns of a node are its displacements along x and into the piece, so both pieces of a pair
obey the same equations. The functions of compliance and displacement also serve a piece on an
unstructured mesh (`substructure`).
"""

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from ..core import NotConverged, frozen_array
from ..formatting import format_length
from ..mesh.tensor import TensorGrid
from .condense import CondensedGrid, condense
from .lapack import use_one_blas_thread
from .tensor_stiffness import tensor_stencil


@dataclass(frozen=True, eq=False, slots=True)
class Layers:
    """Elastic constants of the substrate and the coating of a piece.

    - ``coating``, ``substrate``: Young's modulus [Pa] and Poisson ratio of each material
    - ``plane``: "strain" or "stress"
    """

    coating: tuple[float, float]
    substrate: tuple[float, float]
    plane: str

    def lame(self, is_coating) -> np.ndarray:
        """Return lambda and mu (2, ...) [Pa] of cells; `is_coating` (...) marks those of the coating."""
        constants = [lame(*pair, self.plane) for pair in (self.substrate, self.coating)]
        return np.moveaxis(np.array(constants)[np.asarray(is_coating, int)], -1, 0)


def lame(young: float, poisson: float, plane: str) -> tuple[float, float]:
    """Return the Lame constants lambda and mu of a plane problem.

    In plane stress lambda is E nu / (1 - nu^2), with which the equations of plane stress have the
    form of those of plane strain.

    Parameters
    ----------
    young : float
        Young's modulus [Pa].
    poisson : float
        Poisson ratio [1].
    plane : {"strain", "stress"}

    Returns
    -------
    lam, mu : float [Pa]
    """
    mu = young / (2 * (1 + poisson))
    if plane == "stress":
        return young * poisson / (1 - poisson**2), mu
    return young * poisson / ((1 + poisson) * (1 - 2 * poisson)), mu


@dataclass(frozen=True, eq=False, slots=True)
class Piece:
    """Piece on a tensor grid of bilinear quadrilaterals, whose far face is fixed.

    The stiffness is assembled and factorised on first use: a piece whose compliance is in the disk
    cache is often never assembled.

    - ``grid``: columns and rows of nodes
    - ``layers``: the materials
    - ``computed``: cached results by name: factor
    """

    grid: TensorGrid
    layers: Layers
    computed: dict = field(default_factory=dict)

    @property
    def stencil(self) -> np.ndarray:
        """Stiffness per unit width (nx, ny - 1, 3, 3, 2, 2) [N/m per m] (`tensor_stiffness`)."""
        lam, mu = self.layers.lame(self.grid.is_coating_cell()[0])
        return tensor_stencil(self.grid.x, self.grid.depth, lam, mu)

    @property
    def round_off_error(self) -> float:
        """Relative round-off error of the compliance [1], which is 0 before the piece is factorised."""
        return self.computed["factor"].round_off_error if "factor" in self.computed else 0.0

    @property
    def factor(self) -> CondensedGrid:
        """Stiffness of the piece after condensation to its interface.

        NotConverged, with a remedy, if the stiffness cannot be factorised.
        """
        if "factor" not in self.computed:
            x = self.grid.x
            is_mirrored = np.abs(x + x[::-1]).max() <= 1e-13 * self.grid.length
            try:
                self.computed["factor"] = condense(self.stencil, bool(is_mirrored))
            except NotConverged as error:
                min_length = min(np.diff(x).min(), np.diff(self.grid.depth).min())
                size = (self.grid.length, self.grid.height)
                remedy = describe_remedy(
                    self.layers, min_length, size, has_coating=self.grid.coating_rows > 0
                )
                raise NotConverged(f"{error}; {remedy}") from None
        return self.computed["factor"]

    def solve(self, load) -> np.ndarray:
        """Return displacements (frames, nx * ny, 2) [m] under loads (nx, 2, frames) [N/m]."""
        nx, _, frames = load.shape
        out = np.zeros((frames, nx, self.grid.depth.size, 2))
        out[:, :, :-1] = np.moveaxis(self.factor.displacement(load), 3, 0)
        return out.reshape(frames, -1, 2)


def describe_remedy(layers: Layers, min_length: float, size, *, has_coating: bool) -> str:
    """Return a sentence that says what to change if the stiffness of a piece is singular.

    Parameters
    ----------
    layers : Layers
    min_length : float
        Length of the shortest side of a cell [m].
    size : (2,) sequence
        Length and height of the piece [m].
    has_coating : bool
        Whether the piece has cells of a coating.

    Returns
    -------
    str
    """
    ratio = layers.coating[0] / layers.substrate[0]
    if has_coating and not 1e-3 < ratio < 1e3:
        return (
            f"the Young's moduli of coating and substrate differ by a factor of {max(ratio, 1 / ratio):.2g}: bring "
            "the moduli closer together, make the coating thicker, or leave the coating out"
        )
    return (
        f"the shortest cell is {format_length(min_length, 3)} in a piece of "
        f"{format_length(size[0], 3)} x {format_length(size[1], 3)}: use longer "
        "cells (contact.element_size, or the cells of contact.mesh)"
    )


def compute_displacement(piece, shear: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Compute the displacements of a piece under forces on its interface.

    The factors of the stiffness are computed once and reused.

    Parameters
    ----------
    piece : Piece or substructure.Substructure
    shear, normal : (frames, m) ndarray
        Nodal forces per unit width [N/m] that act on the piece along +x and inward.

    Returns
    -------
    (frames, nodes, 2) ndarray [m]
        Along x and inward.

    Raises
    ------
    NotConverged
        If the stiffness of the piece cannot be factorised.
    """
    load = np.stack([np.atleast_2d(shear).T, np.atleast_2d(normal).T], axis=1)
    return piece.solve(load.astype(float))


def hooke(strain, is_coating, layers: Layers) -> np.ndarray:
    """Compute the stresses for given plane strains by Hooke's law.

    Parameters
    ----------
    strain : (3, ..., t) array_like
        exx, eyy and exy [1], exy half the engineering shear strain.
    is_coating : (t,) ndarray of bool
    layers : Layers

    Returns
    -------
    (..., t, 4) ndarray
        xx, yy, zz, xy [Pa], positive in tension. zz is nu (xx + yy) in plane strain and 0 in plane
        stress.
    """
    exx, eyy, exy = strain
    lam, mu = layers.lame(is_coating)
    sxx = lam * (exx + eyy) + 2 * mu * exx
    syy = lam * (exx + eyy) + 2 * mu * eyy
    szz = np.zeros_like(sxx)
    if layers.plane == "strain":
        poisson = np.where(is_coating, layers.coating[1], layers.substrate[1])
        szz = poisson * (sxx + syy)
    return np.stack([sxx, syy, szz, 2 * mu * exy], axis=-1)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Return the von Mises stress (...) [Pa] of stresses (..., 4) [Pa] given as xx, yy, zz, xy."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2) / 2 + 3 * xy**2)


class InterfaceCompliance(NamedTuple):
    """Compliances of interface nodes per unit width, each (m, m) and read-only [m2/N].

    - ``nn``: inward displacement per inward force
    - ``tt``: displacement along x per force along x
    - ``nt``: inward displacement per force along x
    """

    nn: np.ndarray
    tt: np.ndarray
    nt: np.ndarray


def interface_compliance(piece) -> InterfaceCompliance:
    """Compute the compliances of a piece at its interface, per unit width.

    They are the inverse of the Schur complement of the stiffness at the nodes of the interface, with
    bilinear quadrilaterals (and linear triangles), a fixed far face and free ends. The order in which
    the inner nodes are eliminated does not enter. Every factorisation is checked with an irregular
    load: `round_off_error` of the piece is the change of its solution by one step of iterative
    refinement.

    Parameters
    ----------
    piece : Piece or substructure.Substructure
        It is factorised if it is not yet.

    Returns
    -------
    InterfaceCompliance
        Symmetric nn and tt, positive definite [m2/N].

    Raises
    ------
    NotConverged
        If the stiffness of the piece cannot be factorised.
    """
    with use_one_blas_thread():
        both = piece.factor.compliance()
    along = slice(0, None, 2)
    inward = slice(1, None, 2)
    blocks = (both[inward, inward], both[along, along], both[inward, along])
    return InterfaceCompliance(*(frozen_array(block) for block in blocks))
