"""Sparse factors of a stiffness that does not come from a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix
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
