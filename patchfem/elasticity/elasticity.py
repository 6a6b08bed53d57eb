"""Plane elasticity of one piece on its tensor grid (bilinear quads, scikit-fem) and the recovery of its inside.

The unknowns of a node are (along x, into the piece), so both pieces of a pair obey the same matrix.
"""

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementQuad1, MeshQuad

from ..core import frozen_array
from .condense import mirrored_sweep, sweep
from .stiffness import stiffness


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
    """An assembled piece on its tensor grid.

    x: (nx,), depth: (ny,) [m]; matrix: free unknowns column by column, row by row, two per node (along x, inward),
    without those of the far face; cells: (t, 4) node numbers column * ny + row; is_coating: (t,); layers: its Layers.
    """

    x: np.ndarray
    depth: np.ndarray
    matrix: csr_matrix
    cells: np.ndarray
    is_coating: np.ndarray
    layers: Layers


def assemble(x, depth, coating_rows: int, layers: Layers) -> Piece:
    """Assemble one piece held at its far face, with bilinear quadrilaterals on its tensor grid.

    x: (nx,), depth: (ny,) [m]; coating_rows: rows of cells in the coating; layers: its Layers. The stiffness is per
    unit width [N/m per m].
    """
    nx, ny = x.size, depth.size
    mesh = MeshQuad.init_tensor(np.asarray(x), np.asarray(depth))
    middle = mesh.p[:, mesh.t].mean(axis=1)[1]
    coat = middle < depth[coating_rows] if coating_rows else np.zeros(mesh.t.shape[1], bool)
    lam, mu = np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)])[coat.astype(int)].T
    basis = Basis(mesh, ElementQuad1(), intorder=2)
    # scikit-fem numbers vertices its own way; ours is column by column, without the far face
    column = np.searchsorted(x, mesh.p[0] - 1e-12 * np.ptp(x))  # round-off of the places
    row = np.searchsorted(depth, mesh.p[1] - 1e-12 * depth[-1])
    place = np.empty(nx * ny, dtype=np.int64)
    place[basis.nodal_dofs[0]] = np.where(row < ny - 1, column * (ny - 1) + row, -1)
    matrix = stiffness([(basis, lam, mu, place)], nx * (ny - 1))
    cells = _counter_clockwise((column * ny + row)[mesh.t].T, ny)
    column_by_column = np.argsort(cells[:, 0])
    return Piece(x, depth, matrix, cells[column_by_column], coat[column_by_column], layers)


def _counter_clockwise(cells, ny: int) -> np.ndarray:
    """Every quad as (column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1) in depth coordinates."""
    first = cells.min(axis=1)
    return np.stack([first, first + ny, first + ny + 1, first + 1], axis=1)


def displacement(piece: Piece, shear: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Displacements of a piece under nodal interface forces per unit width [N/m].

    Returns (frames, nx*ny, 2) [m], along x and inward. shear, normal: (frames, nx) acting on the piece along +x and
    inward. One sparse factorisation serves all frames.
    """
    nx, ny = piece.x.size, piece.depth.size
    frames = np.atleast_2d(normal).shape[0]
    load = np.zeros((nx, ny - 1, 2, frames))
    load[:, 0, 0] = np.atleast_2d(shear).T
    load[:, 0, 1] = np.atleast_2d(normal).T
    factor = splu(piece.matrix.tocsc(), permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0,
                  options={"SymmetricMode": True})
    u = factor.solve(load.reshape(-1, frames)).reshape(nx, ny - 1, 2, frames)
    out = np.zeros((frames, nx, ny, 2))
    out[:, :, :-1] = np.moveaxis(u, 3, 0)
    return out.reshape(frames, nx * ny, 2)


def cell_stress(piece: Piece, u: np.ndarray) -> tuple:
    """Stress at the middles of the cells, tension > 0.

    Returns (frames, t, 4) as xx, yy, zz, xy [Pa] and von Mises (frames, t) [Pa]. u: (frames, nodes, 2) [m]. The inward
    axis is kept, so xy changes sign for the piece drawn at y < 0. The middle of a bilinear quad is its superconvergent
    point.
    """
    corner = u[:, piece.cells]
    nodes = np.stack([np.repeat(piece.x, piece.depth.size), np.tile(piece.depth, piece.x.size)], axis=1)[piece.cells]
    dx = (nodes[:, 1, 0] - nodes[:, 0, 0])[:, None]
    dy = (nodes[:, 3, 1] - nodes[:, 0, 1])[:, None]
    along = (corner[:, :, 1] + corner[:, :, 2] - corner[:, :, 0] - corner[:, :, 3]) / (2 * dx)
    inward = (corner[:, :, 3] + corner[:, :, 2] - corner[:, :, 0] - corner[:, :, 1]) / (2 * dy)
    exx, eyy, exy = along[..., 0], inward[..., 1], (along[..., 1] + inward[..., 0]) / 2
    return hooke(exx, eyy, exy, piece.is_coating, piece.layers)


def hooke(exx, eyy, exy, is_coating, layers: Layers) -> tuple:
    """Stresses (..., t, 4) as xx, yy, zz, xy [Pa] of plane strains by Hooke's law, and von Mises (..., t) [Pa].

    Tension > 0. exx, eyy, exy: (..., t) [1], exy half the engineering shear; is_coating: (t,) bool; layers: the two
    materials. zz is nu (xx + yy) in plane strain, 0 in plane stress.
    """
    pick = is_coating.astype(int)
    lam, mu = np.array([lame(*layers.substrate, layers.plane), lame(*layers.coating, layers.plane)])[pick].T
    poisson = np.array([layers.substrate[1], layers.coating[1]])[pick]
    sxx = lam * (exx + eyy) + 2 * mu * exx
    syy = lam * (exx + eyy) + 2 * mu * eyy
    szz = poisson * (sxx + syy) if layers.plane == "strain" else np.zeros_like(sxx)
    stress = np.stack([sxx, syy, szz, 2 * mu * exy], axis=-1)
    return stress, von_mises(stress)


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Von Mises stress (...,) [Pa] of stresses (..., 4) [Pa] as xx, yy, zz, xy."""
    xx, yy, zz, xy = np.moveaxis(stress, -1, 0)
    return np.sqrt(((xx - yy)**2 + (yy - zz)**2 + (zz - xx)**2) / 2 + 3 * xy**2)


def interface_compliance(piece: Piece) -> tuple:
    """Compliance of one piece at its interface per unit width: (nn, tt, nt), each (nx, nx) [m2/N], read-only.

    nn: inward motion per inward force; tt: motion along x per force along x; nt: inward motion per force along x. A
    piece that is its own mirror image costs half (`condense.mirrored_sweep`). LinAlgError where the stiffness is not
    positive definite.
    """
    mirrored = np.abs(piece.x + piece.x[::-1]).max() <= 1e-13 * np.ptp(piece.x)  # round-off of x
    both = (mirrored_sweep if mirrored else sweep)(piece.matrix, piece.x.size)
    return tuple(frozen_array(part) for part in (both[1::2, 1::2], both[0::2, 0::2], both[1::2, 0::2]))
