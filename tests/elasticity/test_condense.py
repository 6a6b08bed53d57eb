"""The block-tridiagonal sweep against a dense inverse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pieces import COATED, COATING
from scipy.sparse import csr_matrix

from patchfem.elasticity.condense import mirrored_sweep, sweep
from patchfem.elasticity.elasticity import assemble
from patchfem.mesh.tensor import graded_grid


def interface_block(inverse, columns):
    """Rows and columns of the first two unknowns of every column."""
    size = inverse.shape[0] // columns
    index = (np.arange(columns)[:, None] * size + [0, 1]).ravel()
    return inverse[np.ix_(index, index)]


@pytest.mark.parametrize("cells", [2, 3, 24])
def test_exact_sweep_of_a_piece_is_the_dense_inverse(cells):
    grid = graded_grid(6e-3, 3e-3, 6e-3 / cells, COATING)
    matrix = assemble(grid.x, grid.depth, grid.coating_rows, COATED).matrix
    wanted = interface_block(np.linalg.inv(matrix.toarray()), cells + 1)
    assert np.abs(sweep(matrix, cells + 1) - wanted).max() <= 1e-9 * np.abs(wanted).max()


@pytest.mark.parametrize("cells", [2, 3, 4, 5, 30, 31])
def test_exact_halves_of_a_mirrored_piece_give_the_whole(cells):
    grid = graded_grid(6e-3, 3e-3, 6e-3 / cells, COATING)
    matrix = assemble(grid.x, grid.depth, grid.coating_rows, COATED).matrix
    whole, halves = sweep(matrix, cells + 1), mirrored_sweep(matrix, cells + 1)
    assert np.abs(whole - halves).max() <= 1e-11 * np.abs(whole).max()
    assert np.array_equal(halves, halves.T)


@settings(max_examples=40, deadline=None)
@given(columns=st.integers(1, 7), size=st.integers(2, 6), seed=st.integers(0, 2**32 - 1))
def test_exact_sweep_of_any_positive_definite_chain_is_the_dense_inverse(columns, size, seed):
    rng = np.random.default_rng(seed)
    factor = np.zeros((columns * size, columns * size))
    for j in range(columns):
        here = slice(j * size, (j + 1) * size)
        factor[here, here] = rng.normal(size=(size, size)) + 4 * np.eye(size)
        if j:
            factor[here, (j - 1) * size:j * size] = rng.normal(size=(size, size))
    dense = factor @ factor.T
    found = sweep(csr_matrix(dense), columns)
    wanted = interface_block(np.linalg.inv(dense), columns)
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max() * max(1, np.linalg.cond(dense) * 1e-7)
    assert np.array_equal(found, found.T)


def test_refuses_a_matrix_that_is_not_positive_definite():
    grid = graded_grid(6e-3, 3e-3, 1e-3)
    matrix = assemble(grid.x, grid.depth, 0, COATED).matrix
    with pytest.raises(np.linalg.LinAlgError):
        sweep(-matrix, grid.x.size)
