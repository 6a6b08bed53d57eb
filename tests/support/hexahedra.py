"""Stiffness of a block that a rigid stamp displaces, by hexahedra of order 2 of scikit-fem: no waves, no splines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy.sparse.linalg import splu
from skfem import Basis, BilinearForm, ElementHex2, ElementVector, MeshHex
from skfem.helpers import ddot, sym_grad, trace

from patchfem.elasticity import LayerStack

RATIO = 0.4  # of neighbouring elements


class Block(NamedTuple):
    """Pair of equal blocks on rigid holders.

    - length, width: of the face [m].
    - stack: layers of a block.
    """

    length: float
    width: float
    stack: LayerStack


def _shrink(length: float, count: int) -> np.ndarray:
    """Return edges from 0 to a length that become denser towards it."""
    return length * (1 - np.append(RATIO ** np.arange(count), 0.0))


def _make_mesh(block: Block, count: int, end: float | None) -> MeshHex:
    """Return the quarter x, y > 0 of a block; with the end of a stamp along y, the half x > 0."""
    x = _shrink(block.length / 2, count)
    y = _shrink(block.width / 2, count)
    if end is not None:
        depth = 0.45 * (end + block.width / 2)
        near = end + depth * np.array([-1, -0.5, -0.25, -0.12, 0, 0.12, 0.25, 0.5, 1.0])
        far = np.concatenate([-y, y])
        y = np.unique(np.concatenate([near, far[np.abs(far - end) > depth]]).round(12))
    height = sum(block.stack.thicknesses)
    powers = RATIO ** np.arange(1, count + 1)
    z = height * np.unique(np.concatenate([[0, 1], powers, 1 - powers[:-1]]))
    for thickness in block.stack.thicknesses[:-1]:
        z = z[(z == 0) | (z > 1.5 * thickness)]
        z = np.sort(np.append(z, [thickness / 2, thickness]))
    return MeshHex.init_tensor(x, y, z)


@BilinearForm
def _energy(u, v, w):
    """Return the density of the virtual work."""
    return w.lam * trace(sym_grad(u)) * trace(sym_grad(v)) + 2 * w.mu * ddot(
        sym_grad(u), sym_grad(v)
    )


def compute_stamp_stiffness(
    block: Block, direction: str, count: int, end: float | None = None
) -> float:
    """Return the stiffness [N/m] of a pair of blocks whose faces a stamp displaces, free of friction across it.

    Parameters
    ----------
    block : Block
    direction : {"normal", "shear"}
        Displacement into the block, or along x.
    count : int
        Elements over half a side.
    end : float, optional
        The stamp covers y < end; all of the face without it.
    """
    mesh = _make_mesh(block, count, end)
    basis = Basis(mesh, ElementVector(ElementHex2()), intorder=5)
    depth = mesh.p[2][mesh.t].mean(axis=0)
    moduli = np.array(block.stack.moduli)
    layer = np.searchsorted(np.cumsum(block.stack.thicknesses), depth)
    points = np.ones(basis.dx.shape[1])
    lam, mu = moduli[layer].T[..., None] * points
    stiffness = _energy.assemble(basis, lam=lam, mu=mu)

    component = np.empty(basis.N, int)
    for dofs in (basis.nodal_dofs, basis.edge_dofs, basis.facet_dofs, basis.interior_dofs):
        for axis in range(3):
            component[dofs[axis]] = axis
    x, y, z = basis.doflocs
    # The far face is held; on planes of symmetry, the displacement across them or those along them
    is_normal = direction == "normal"
    is_held = np.isclose(z, mesh.p[2].max(), rtol=1e-9)
    is_held |= (np.abs(x) < 1e-9) & ((component == 0) == is_normal)
    if end is None:
        is_held |= (np.abs(y) < 1e-9) & (component == 1)
    is_moved = (np.abs(z) < 1e-9) & (component == (2 if is_normal else 0))
    if end is not None:
        is_moved &= y < end + 1e-9

    displacement = is_moved.astype(float)
    free = np.flatnonzero(~(is_held | is_moved))
    factor = splu(
        stiffness[free][:, free].tocsc(),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    displacement[free] = factor.solve(-(stiffness @ displacement)[free])
    n_parts = 4 if end is None else 2
    return float(n_parts * displacement @ (stiffness @ displacement)) / 2
