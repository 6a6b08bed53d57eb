"""Factors of a stiffness: every library against the dense inverse and each other; what the dissection promises."""

from __future__ import annotations

import importlib.util

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import COATED, COATING
from scipy.sparse import csc_matrix
from scipy.spatial import Delaunay
from test_substructure import of_grid

from patchfem.contact import factor, fronts
from patchfem.contact.dissect import LEAF, dissection
from patchfem.contact.factor import BACKENDS, factorise
from patchfem.contact.substructure import assemble, condense
from patchfem.core import Missing, NotConverged, PatchfemError
from patchfem.mesh.tensor import graded_grid

NEEDS = {"cholmod": "sksparse", "pardiso": "pypardiso"}


def usable(name):
    """The name as a test parameter, skipped by name where its extra is not installed."""
    there = name not in NEEDS or importlib.util.find_spec(NEEDS[name]) is not None
    return pytest.param(name, marks=pytest.mark.skipif(not there, reason=f"extra {name} is not installed"))


each_backend = pytest.mark.parametrize("name", [usable(name) for name in BACKENDS])


def scattered(count, seed):
    """Points on the unit square and the edges of their Delaunay triangles."""
    points = np.random.default_rng(seed).random((count, 2))
    cells = Delaunay(points).simplices
    return points, np.unique(np.sort(np.concatenate([cells[:, [0, 1]], cells[:, [1, 2]], cells[:, [2, 0]]])), axis=0)


@each_backend
@pytest.mark.parametrize("size, split", [(5e-4, 0.0), (1e-4, 0.5)])
def test_exact_solutions_and_compliance_are_those_of_the_dense_inverse(name, size, split):
    mesh = of_grid(graded_grid(2e-3, 1e-3, size, COATING), split, seed=4)
    piece = assemble(mesh, COATED, name)
    full = np.linalg.inv(piece.matrix.toarray())
    k = 2 * mesh.interface.size
    assert np.abs(piece.factor.compliance() - full[-k:, -k:]).max() <= 1e-10 * np.abs(full).max()
    load = np.random.default_rng(1).normal(size=(full.shape[0], 3))
    kept = load.copy()
    assert np.abs(piece.factor.solve(load) - full @ load).max() <= 1e-10 * np.abs(full @ load).max()
    assert np.array_equal(load, kept)


@each_backend
def test_exact_all_libraries_give_one_compliance(name):
    mesh = of_grid(graded_grid(12.7e-3, 6.35e-3, 12.7e-3 / 100, COATING), 0.5, seed=2)
    wanted = condense(assemble(mesh, COATED, "fronts"))
    for mine, theirs in zip(condense(assemble(mesh, COATED, name)), wanted):
        assert np.abs(mine - theirs).max() <= 1e-9 * np.abs(theirs).max()


@each_backend
def test_refuses_a_singular_stiffness(name):
    matrix = csc_matrix(np.diag([2.0, 1, 1, 1, 1, 1]) - np.diag([1.0, 0, 0, 0, 0], 1) - np.diag([1.0, 0, 0, 0, 0], -1))
    matrix[0, 0] = 1.0
    with pytest.raises(NotConverged, match="stiffness of the piece"):
        factorise(matrix, [0, 2, 3], name).compliance()


def test_refuses_an_unknown_name_and_a_library_that_is_not_there(monkeypatch, capsys):
    matrix, firsts = csc_matrix(np.eye(4)), [0, 1, 2]

    def broken(matrix, firsts):
        raise ImportError("libcholmod.so.3: cannot open shared object file")

    monkeypatch.setitem(factor.BACKENDS, "cholmod", broken)
    with pytest.raises(Missing, match=r"cholmod cannot be used \(libcholmod.*patchfem\[cholmod\]"):
        factorise(matrix, firsts, "cholmod")
    with pytest.raises(PatchfemError, match="known are fronts, superlu, cholmod, pardiso"):
        factorise(matrix, firsts, "mumps")
    monkeypatch.setenv("PATCHFEM_FACTOR", "cholmod")
    assert isinstance(factorise(matrix, firsts), fronts.Fronts)
    assert "cholmod cannot be used" in capsys.readouterr().err
    monkeypatch.setenv("PATCHFEM_FACTOR", "superlu")
    assert isinstance(factorise(matrix, firsts), factor.SuperLU)


@settings(max_examples=25, deadline=None)
@given(count=st.integers(4, 900), seed=st.integers(0, 99))
def test_always_a_dissection_is_an_order_whose_parts_meet_only_in_later_cuts(count, seed):
    points, pairs = scattered(count, seed)
    order, firsts = dissection(points, pairs)
    assert np.array_equal(np.sort(order), np.arange(count))
    assert firsts[0] == 0 and firsts[-1] == count and np.all(np.diff(firsts) > 0)
    place = np.empty(count, np.int64)
    place[order] = np.arange(count)
    front = np.searchsorted(firsts, place[pairs], side="right") - 1
    low, high = front.min(axis=1), front.max(axis=1)
    if count > LEAF:
        assert firsts.size > 3
    # fronts that touch lie on one branch of the tree: the reach of the lower one grows along its fathers only
    touched = {f: set(high[(low == f) & (high > f)].tolist()) for f in range(firsts.size - 1)}
    for f in range(firsts.size - 1):
        if touched[f]:
            father = min(touched[f])
            touched[father] |= touched[f] - {father}
    assert sum(not fathers for fathers in touched.values()) == 1  # one root: the graph is connected


def test_order_cuts_of_a_square_grid_hold_the_fewest_nodes_and_the_factors_grow_as_n_log_n():
    kept = []
    for n in (32, 64, 128):
        x, y = (part.ravel() for part in np.meshgrid(np.arange(n), np.arange(n), indexing="ij"))
        node = np.arange(n * n).reshape(n, n)
        pairs = np.concatenate([np.stack([node[1:].ravel(), node[:-1].ravel()], 1),
                                np.stack([node[:, 1:].ravel(), node[:, :-1].ravel()], 1)])
        order, firsts = dissection(np.stack([x, y], 1).astype(float), pairs)
        assert np.diff(firsts)[-1] == n  # the first cut is one line of the grid
        # the graph's Laplacian, two unknowns a node
        rows = np.concatenate([pairs[:, 0], pairs[:, 1], np.arange(n * n)])
        columns = np.concatenate([pairs[:, 1], pairs[:, 0], np.arange(n * n)])
        values = np.concatenate([np.full(2 * len(pairs), -1.0), np.full(n * n, 4.1)])
        place = np.empty(n * n, np.int64)
        place[order] = np.arange(n * n)
        both = [(2 * place[rows] + k, 2 * place[columns] + k) for k in (0, 1)]
        matrix = csc_matrix((np.tile(values, 2), (np.concatenate([r for r, _ in both]),
                                                  np.concatenate([c for _, c in both]))))
        kept.append(fronts.factorise(matrix, firsts).entries / (4 * n * n * np.log2(n)))
    assert max(kept) <= 1.2 * 31 / 4  # George 1973: 31/4 n^2 log2 n
