"""Sparse factors of a stiffness that does not come from a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import block_diag, coo_matrix, csr_matrix, eye_array
from scipy.spatial import Delaunay

from patchfem.core import NotConverged
from patchfem.elasticity import sparse_factor


def random_triangulation(n_points, seed):
    """Return random points on the unit square and the edges of their Delaunay triangles."""
    points = np.random.default_rng(seed).random((n_points, 2))
    cells = Delaunay(points).simplices
    return points, np.unique(
        np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])), axis=0
    )


def random_stiffness(pairs, n_nodes: int, ground_stiffness: float):
    """Return the stiffness (3 n, 3 n) of random springs between pairs of nodes, with grounded nodes."""
    rows = np.random.default_rng(2).normal(size=(len(pairs), 6))
    columns = (3 * pairs[:, :, None] + np.arange(3)).reshape(-1, 6)
    stretch = coo_matrix(
        (rows.ravel(), (np.repeat(np.arange(len(pairs)), 6), columns.ravel())),
        (len(pairs), 3 * n_nodes),
    ).tocsr()
    return stretch.T @ stretch + ground_stiffness * eye_array(3 * n_nodes)


@pytest.mark.parametrize("n_nodes", [1, 20, 700])
def test_exact_sparse_factor_of_permuted_matrix(n_nodes):
    """The factor of a randomly permuted matrix of unconnected blocks solves its equations."""
    pairs = random_triangulation(n_nodes, 3)[1] if n_nodes > 3 else np.zeros((0, 2), int)
    block = random_stiffness(pairs, n_nodes, 0.1)
    matrix = block_diag([block, block, 5.0]).tocsr()
    order = np.random.default_rng(4).permutation(matrix.shape[0])
    matrix = matrix[order][:, order]
    load = np.random.default_rng(1).normal(size=(matrix.shape[0], 3))
    factor = sparse_factor.SparseFactor(matrix)
    for given_load in (load, load[:, 0]):
        np.testing.assert_allclose(matrix @ factor.solve(given_load), given_load, atol=1e-11)


def test_refuses_zero_energy_motion_and_negative_energy():
    """A motion of zero energy and one of negative energy are refused with different exceptions."""
    pairs = random_triangulation(300, 5)[1]
    laplacian = np.zeros((300, 300))
    for i, j in pairs:
        laplacian[[i, j], [i, j]] += 1.0
        laplacian[[i, j], [j, i]] -= 1.0
    with pytest.raises(sparse_factor.ZeroEnergyMotion):
        sparse_factor.SparseFactor(csr_matrix(laplacian), 1e-12)
    laplacian[7, 7] -= 1e-3
    with pytest.raises(NotConverged) as caught:
        sparse_factor.SparseFactor(csr_matrix(laplacian), 1e-12)
    assert not isinstance(caught.value, sparse_factor.ZeroEnergyMotion)
