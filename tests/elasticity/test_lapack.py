"""LAPACK without the package of SciPy that holds it, against that package."""

import sys

import numpy as np
import pytest
import scipy.linalg

from patchfem.elasticity import lapack


def test_exact_functions_are_those_of_scipy():
    rng = np.random.default_rng(3)
    root, right = rng.normal(size=(7, 7)), rng.normal(size=(7, 2))
    matrix = root @ root.T + np.eye(7)
    low = lapack.cho_factor(matrix)
    assert np.tril(low) == pytest.approx(np.linalg.cholesky(matrix), rel=1e-13, abs=1e-13)
    want = scipy.linalg.cho_solve(scipy.linalg.cho_factor(matrix, lower=True), right)
    assert lapack.cho_solve(low, right) == pytest.approx(want, rel=1e-13, abs=1e-13)  # BLAS rounds by where arrays lie
    assert lapack.cho_solve(low, right[:, 0]) == pytest.approx(np.linalg.solve(matrix, right[:, 0]), rel=1e-11)


@pytest.mark.parametrize("matrix", [-np.eye(2), [[1.0, 2.0], [2.0, 1.0]], np.full((2, 2), np.nan)])
def test_refuses_a_matrix_that_is_not_positive_definite(matrix):
    with pytest.raises(np.linalg.LinAlgError):
        lapack.cho_factor(matrix)


def test_exact_where_the_files_cannot_be_loaded_the_package_is_imported(monkeypatch):
    monkeypatch.setattr(lapack, "find_spec", lambda name: None)
    assert lapack._module("_flapack") is sys.modules["scipy.linalg._flapack"]
