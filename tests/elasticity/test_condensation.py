"""Compliance of condensed pieces compared with scikit-fem, and the patch test on every kind of element."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest
from any_mesh_cases import mesh_of_grid
from pieces import COATED
from scipy.sparse.linalg import splu
from skfem import (
    Basis,
    BilinearForm,
    ElementQuad1,
    ElementQuad2,
    ElementQuadS2,
    ElementTriP1,
    ElementTriP2,
    ElementVector,
    MeshQuad,
    MeshTri,
)
from skfem.helpers import ddot, eye, sym_grad, trace

from patchfem.elasticity import (
    Layers,
    Piece,
    compute_displacement,
    compute_interface_compliance,
    get_cells,
    make_points,
)
from patchfem.elasticity.elasticity import compute_stress
from patchfem.mesh import make_graded_grid
from patchfem.mesh.pieces import PieceMesh, raise_order

GRID = make_graded_grid(2e-3, 1e-3, 2.5e-4, 1e-4)
FORMS = {
    "triangle": (MeshTri, ElementTriP1),
    "quad": (MeshQuad, ElementQuad1),
    "triangle6": (MeshTri, ElementTriP2),
    "quad8": (MeshQuad, ElementQuadS2),
    "quad9": (MeshQuad, ElementQuad2),
}


def make_mesh(kind: str) -> PieceMesh:
    """Return the grid as a mesh of one kind of elements with random numbers of its nodes."""
    mesh = mesh_of_grid(GRID, 1.0 if kind.startswith("triangle") else 0.0, seed=3)
    if kind in ("triangle", "quad"):
        return PieceMesh(mesh.points, mesh.blocks, mesh.is_coating, mesh.interface, mesh.far)
    tagged = [np.isin(np.arange(len(mesh.points)), part) for part in (mesh.interface, mesh.far)]
    points, blocks, (on_interface, is_far) = raise_order(
        mesh.points, mesh.blocks, tagged, dict.fromkeys(mesh.blocks, kind)
    )
    interface = np.flatnonzero(on_interface)
    interface = interface[np.argsort(points[interface, 0])]
    return PieceMesh(points, blocks, mesh.is_coating, interface, np.flatnonzero(is_far))


@BilinearForm
def elasticity(u, v, w):
    """Weak form of plane elasticity."""
    strain = sym_grad(u)
    return ddot(w.lam * eye(trace(strain), 2) + 2 * w.mu * strain, sym_grad(v))


def solve_by_skfem(mesh, kind: str, layers, shear, normal):
    """Return the displacements (m, 2) of the interface nodes under nodal forces (m,), computed by scikit-fem."""
    mesh_class, element = FORMS[kind]
    n = 3 if kind.startswith("triangle") else 4
    cells = mesh.blocks[kind][:, :n]
    nodes, corners = np.unique(cells, return_inverse=True)
    skfem_mesh = mesh_class(
        np.ascontiguousarray(mesh.points[nodes].T), np.ascontiguousarray(corners.reshape(-1, n).T)
    )
    basis = Basis(skfem_mesh, ElementVector(element()), intorder=2 if n == 3 else 5)
    lam, mu = layers.lame_constants(mesh.is_coating)[..., None] * np.ones(basis.dx.shape)
    stiffness = elasticity.assemble(basis, lam=lam, mu=mu).tocsc()
    # Unknowns of both are matched by their positions.
    places = basis.doflocs.T[::2]
    order = [int(np.argmin(np.hypot(*(places - mesh.points[k]).T))) for k in mesh.interface]
    load = np.zeros(stiffness.shape[0])
    load[2 * np.array(order)] = shear
    load[2 * np.array(order) + 1] = normal
    free = basis.doflocs[1] < mesh.points[:, 1].max() - 1e-12
    u = np.zeros(load.size)
    u[free] = splu(stiffness[free][:, free]).solve(load[free])
    return u.reshape(-1, 2)[order]


@pytest.mark.parametrize("kind", FORMS)
def test_exact_displacements_equal_those_of_skfem(kind):
    """The displacements under nodal forces equal those of scikit-fem on the same mesh for every element."""
    mesh = make_mesh(kind)
    piece = Piece(mesh, COATED)
    shear, normal = np.random.default_rng(1).normal(size=(2, mesh.interface.size))
    load = np.zeros((len(mesh.points), 2, 1))
    load[mesh.interface] = np.stack([shear, normal], axis=1)[..., None]
    u = piece.factor.solve(load)[mesh.interface, :, 0]
    expected = solve_by_skfem(mesh, kind, COATED, shear, normal)
    assert np.abs(u - expected).max() <= 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("kind", FORMS)
@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_patch_test(kind, plane):
    """Under uniform pressure on a laterally free block without Poisson's ratio all stresses are uniform to 1e-10."""
    layers = Layers((200e9, 0.0), (200e9, 0.0), plane)
    mesh = make_mesh(kind)
    # Inner nodes of first-order meshes are moved at random.
    if kind in ("triangle", "quad"):
        points = mesh.points.copy()
        inner = (np.abs(points[:, 0]) < 0.99e-3) & (points[:, 1] > 1e-6) & (points[:, 1] < 0.99e-3)
        points[inner] += np.random.default_rng(5).uniform(-1e-5, 1e-5, (inner.sum(), 2))
        mesh = PieceMesh(points, mesh.blocks, mesh.is_coating, mesh.interface, mesh.far)
    piece = Piece(mesh, layers)
    pressure = 1e7 * mesh.tributary_lengths()
    u = compute_displacement(piece, 0 * pressure, pressure)[0]
    cells = get_cells(piece)
    for points, nodes in zip(make_points(cells, "gauss"), cells.groups.values()):
        strain = points.strain(u[nodes])
        stress = compute_stress(strain, np.zeros(strain.shape[1:], bool), layers)
        assert np.abs(stress - [0, -1e7, 0, 0]).max() <= 1e-10 * 1e7 * 1e3
        assert np.abs(stress[..., 1] / -1e7 - 1).max() <= 1e-10
    nn = compute_interface_compliance(piece).nn
    assert nn @ pressure == pytest.approx(1e7 / 200e9 * 1e-3, rel=1e-10)


def test_exact_compliance_without_factors_needs_half_the_memory():
    """A piece that does not keep its factors has the same compliance; it holds none and needs at most 2.5 kB per node."""
    mesh = make_graded_grid(2e-3, 1e-3, 2e-5)
    layers = Layers((200e9, 0.3), (200e9, 0.3), "strain")
    pieces = [Piece(mesh, layers) for _ in range(2)]
    tracemalloc.start()
    compliance = compute_interface_compliance(pieces[0], keep_factor=False)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert "factor" not in pieces[0].computed and peak <= 2500 * mesh.n_nodes
    np.testing.assert_array_equal(compliance.tt, compute_interface_compliance(pieces[1]).tt)
