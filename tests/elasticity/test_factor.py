"""Factors of a stiffness against the dense inverse, and the properties of the dissection of a mesh."""

from __future__ import annotations

import numpy as np
import pytest
from any_mesh_cases import of_grid
from hypothesis import given
from hypothesis import strategies as st
from pieces import COATED, COATING
from scipy.sparse import block_diag, coo_matrix, csc_matrix, csr_matrix, eye_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import Delaunay
from stiffness import free_stiffness

from patchfem.core import NotConverged
from patchfem.elasticity import Substructure, fronts
from patchfem.elasticity.dissect import MAX_LEAF_NODES, dissect_nodes
from patchfem.mesh import graded_grid


def scattered(count, seed):
    """Points on the unit square and the edges of their Delaunay triangles."""
    points = np.random.default_rng(seed).random((count, 2))
    cells = Delaunay(points).simplices
    return points, np.unique(
        np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])), axis=0
    )


@pytest.mark.parametrize("size, split", [(5e-4, 0.0), (1e-4, 0.5)])
def test_exact_solutions_and_compliance_are_those_of_the_dense_inverse(size, split):
    mesh = of_grid(graded_grid(2e-3, 1e-3, size, COATING), split, seed=4)
    piece = Substructure(mesh, COATED)
    full = np.linalg.inv(free_stiffness(piece).toarray())
    k = 2 * mesh.interface.size
    assert np.abs(piece.factor.compliance() - full[-k:, -k:]).max() <= 1e-10 * np.abs(full).max()
    load = np.random.default_rng(1).normal(size=(full.shape[0], 3))
    kept = load.copy()
    assert np.abs(piece.factor.solve(load) - full @ load).max() <= 1e-10 * np.abs(full @ load).max()
    assert np.array_equal(load, kept)


def test_refuses_a_singular_stiffness():
    matrix = csc_matrix(
        np.diag([2.0, 1, 1, 1, 1, 1])
        - np.diag([1.0, 0, 0, 0, 0], 1)
        - np.diag([1.0, 0, 0, 0, 0], -1)
    )
    matrix[0, 0] = 1.0
    with pytest.raises(NotConverged, match="stiffness of the piece"):
        fronts.factorise(matrix, np.array([0, 2, 3])).compliance()


@given(count=st.integers(4, 900), seed=st.integers(0, 99))
def test_always_a_dissection_is_an_order_whose_last_cut_parts_the_mesh_in_halves(count, seed):
    points, pairs = scattered(count, seed)
    order, firsts = dissect_nodes(points, pairs)
    assert np.array_equal(np.sort(order), np.arange(count))
    assert firsts[0] == 0 and firsts[-1] == count and np.all(np.diff(firsts) > 0)
    if count <= MAX_LEAF_NODES:
        return
    cut = order[firsts[-2] :]
    left = ~np.isin(pairs, cut).any(axis=1)
    graph = coo_matrix((np.ones(left.sum()), pairs[left].T), shape=(count, count))
    label = connected_components(graph, False)[1]
    # the last cut parts the halves
    assert np.bincount(np.delete(label, cut)).max() <= count / 2 + 1
    assert cut.size <= 3 * np.sqrt(count)


def grounded(pairs, count: int, ground: float):
    """Stiffness (3 count, 3 count) of springs along random rows between pairs (e, 2) of nodes, each held besides."""
    rows = np.random.default_rng(2).normal(size=(len(pairs), 6))
    columns = (3 * pairs[:, :, None] + np.arange(3)).reshape(-1, 6)
    stretch = coo_matrix(
        (rows.ravel(), (np.repeat(np.arange(len(pairs)), 6), columns.ravel())),
        (len(pairs), 3 * count),
    ).tocsr()
    return stretch.T @ stretch + ground * eye_array(3 * count)


@pytest.mark.parametrize("count", [1, 20, 700])
def test_exact_factor_of_a_matrix_of_which_only_the_entries_are_known(count):
    """Whatever the order of its unknowns, in parts without a path between them."""
    pairs = scattered(count, 3)[1] if count > 3 else np.zeros((0, 2), int)
    one = grounded(pairs, count, 0.1)
    whole = block_diag([one, one, 5.0]).tocsr()
    order = np.random.default_rng(4).permutation(whole.shape[0])
    whole = whole[order][:, order]
    load = np.random.default_rng(1).normal(size=(whole.shape[0], 3))
    found = fronts.SparseFactor(whole)
    for given_load in (load, load[:, 0]):
        np.testing.assert_allclose(whole @ found.solve(given_load), given_load, atol=1e-11)
    assert found.fronts.n_entries < whole.shape[0] ** 2 / (6 if count > 500 else 1)


def test_refuses_a_motion_without_strain_and_one_that_gives_energy_back_by_their_names():
    pairs = scattered(300, 5)[1]
    laplacian = np.zeros((300, 300))
    for i, j in pairs:
        laplacian[[i, j], [i, j]] += 1.0
        laplacian[[i, j], [j, i]] -= 1.0
    with pytest.raises(fronts.ZeroEnergyMotion):
        fronts.SparseFactor(csr_matrix(laplacian), 1e-12)
    laplacian[7, 7] -= 1e-3
    with pytest.raises(NotConverged) as caught:
        fronts.SparseFactor(csr_matrix(laplacian), 1e-12)
    assert not isinstance(caught.value, fronts.ZeroEnergyMotion)
