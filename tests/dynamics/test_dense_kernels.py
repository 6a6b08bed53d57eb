"""Cholesky factorisation and solution of small dense systems against NumPy."""

import numpy as np
import pytest

from patchfem.dynamics.dense_kernels import factorise, solve_factorised


@pytest.mark.parametrize("size", [1, 2, 9])
def test_exact_factor_and_solution_agree_with_numpy(size):
    """The Cholesky factor, the solution and the returned product agree with NumPy within 1e-12."""
    rng = np.random.default_rng(size)
    root = rng.normal(size=(size, size))
    right = rng.normal(size=size)
    matrix = root @ root.T + np.eye(size)
    a = np.tril(matrix)
    x = right.copy()
    expected = np.linalg.solve(matrix, right)
    assert factorise(a)
    assert solve_factorised(a, x) == pytest.approx(right @ expected, rel=1e-12)
    assert x == pytest.approx(expected, rel=1e-12)
    lower = np.linalg.cholesky(matrix)
    assert np.diag(a) == pytest.approx(1 / np.diag(lower), rel=1e-12)
    assert np.tril(a, -1) == pytest.approx(np.tril(lower, -1), rel=1e-12)


def test_refuses_matrix_that_is_not_positive_definite():
    """The factorisation fails for matrices that are not positive definite or contain NaN."""
    for matrix in ([[1.0, 0.0], [2.0, 1.0]], [[0.0]], [[-1.0]], [[float("nan")]]):
        assert not factorise(np.array(matrix))
