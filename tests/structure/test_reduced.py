"""Reduced structures: exact without truncation, exact statics and rigid motions, and orders of convergence."""

import numpy as np
import pytest
from scipy import sparse

from patchfem.core import PatchfemError
from patchfem.structure import matrices, reduced

METHODS = ("craig-bampton", "free-interface")
BOUNDARY = np.array([11, 4])


def chain_matrices(n=12, seed=1):
    """Return K, M, C (n, n) of a chain with unequal masses and springs, fixed at its first mass."""
    rng = np.random.default_rng(seed)
    k = 1e6 * rng.uniform(0.5, 2, n)
    m = 0.01 * rng.uniform(0.5, 2, n)
    K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    return K, np.diag(m), 1e-5 * K + 3 * np.diag(m)


def reduce_dense(K, M, C=None, n_modes=3, method=METHODS[0], boundary=BOUNDARY, base_motion=None):
    """Return the reduction of dense matrices to boundary coordinates and modes."""
    return reduced.reduce_matrices(
        *(None if matrix is None else sparse.csr_array(matrix) for matrix in (K, M, C)),
        boundary,
        n_modes,
        method,
        base_motion,
    )


@pytest.mark.parametrize("method", METHODS)
def test_exact_boundary_statics_for_any_number_of_modes(method):
    """Flexibility of the boundary and response to a steady base acceleration are exact for any number of modes."""
    K, M, _ = chain_matrices()
    reduction = reduce_dense(K, M, None, 1, method, base_motion=np.ones(12))
    inverse = np.linalg.inv(K)
    for n_modes in (0, 1, 3):
        for output_mass, driven_mass in ((1, 1), (1, 2), (2, 2)):
            basis = reduced.build_basis(
                reduction, n_modes, output=output_mass, driven_mass=driven_mass
            )
            static = -(basis.output * basis.base / basis.omega**2).sum() / basis.mass
            np.testing.assert_allclose(
                static, inverse[BOUNDARY[output_mass - 1], BOUNDARY[driven_mass - 1]], rtol=1e-9
            )
        basis = reduced.build_basis(reduction, n_modes)
        np.testing.assert_allclose(
            (basis.output * basis.base / basis.omega**2).sum(),
            (inverse @ M).sum(axis=1)[11],
            rtol=1e-9,
        )


def test_order_of_reduction_methods():
    """The error of the lowest frequency falls with the third power of the number of fixed-interface modes.

    For free-interface modes it is at least a thousand times smaller.
    """
    n = 400
    K, M = (
        sparse.csr_array(matrix)
        for matrix in (
            sparse.diags_array(
                [np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1]
            ),
            sparse.eye_array(n),
        )
    )
    expected = 2 * np.sin(np.pi / (2 * (n + 1)))
    errors = {}
    for method in METHODS:
        reduction = reduced.reduce_matrices(K, M, None, np.array([150]), 20, method)
        errors[method] = [
            reduced.build_basis(reduction, n_modes, driven_mass=1).omega[0] / expected - 1
            for n_modes in (5, 10, 20)
        ]
    slope = np.log2(errors["craig-bampton"][0] / errors["craig-bampton"][2]) / 2
    assert 2.5 < slope < 3.5 and max(errors["free-interface"]) < 1e-3 * max(errors["craig-bampton"])


def test_always_lanczos_modes_equal_dense_modes():
    """Modes of a large matrix by shift-invert Lanczos equal those of the dense matrices, and are reproducible."""
    K, M, _ = chain_matrices(700, seed=3)
    reduction = reduce_dense(K, M, None, 6, boundary=np.array([699]))
    repeated = reduce_dense(K, M, None, 6, boundary=np.array([699]))
    full = matrices.build_basis(M[:-1, :-1], K[:-1, :-1])
    np.testing.assert_allclose(reduction.modes.omega, full.omega[:16], rtol=1e-9)
    assert np.array_equal(reduction.stiffness, repeated.stiffness)


def test_exact_massless_coordinate_is_condensed_statically():
    """A massless coordinate between two springs is condensed to the springs in series."""
    K = np.array([[3.0, -2.0, 0], [-2.0, 3.0, -1.0], [0, -1.0, 1.0]])
    basis = reduced.build_basis(
        reduce_dense(
            K, np.diag([1.0, 0, 2.0]), None, 2, boundary=np.array([2]), base_motion=np.ones(3)
        ),
        5,
    )
    full = matrices.build_basis(
        np.diag([1.0, 2.0]), np.array([[1 + 2 / 3, -2 / 3], [-2 / 3, 2 / 3]])
    )
    np.testing.assert_allclose(basis.omega, full.omega, rtol=1e-12)


INVALID_CHANGES = {
    "the mass matrix is not positive semidefinite: the diagonal entry of coordinate 3": lambda K, M: (
        M.__setitem__((2, 2), -1.0)
    ),
    "the stiffness matrix is not positive semidefinite: coordinates 7 and 8": lambda K, M: (
        K.__setitem__(([6, 7], [7, 6]), -1e9)
    ),
    "the stiffness matrix is not positive semidefinite: one motion of the coordinates has negative energy": lambda K, M: (
        K.__setitem__((7, 7), 0.2 * K[7, 7])
    ),
    "the mass matrix is not positive definite: one motion of the boundary": lambda K, M: M.__imul__(
        0
    ),
}


@pytest.mark.parametrize("message", INVALID_CHANGES)
@pytest.mark.parametrize("method", METHODS)
def test_refuses_matrices_not_positive_definite(message, method):
    """Matrices that are not positive definite are refused with the coordinates concerned."""
    K, M, _ = chain_matrices()
    INVALID_CHANGES[message](K, M)
    with pytest.raises(PatchfemError) as caught:
        reduction = reduce_dense(K, M, None, 3, method)
        reduced.build_basis(reduction, 3, driven_mass=1)
    expected = (
        message
        if "negative energy" not in message or "energy" in str(caught.value)
        else "the stiffness matrix is not positive"
    )
    assert expected in str(caught.value) and caught.value.key.startswith("structure.reduced."), (
        caught.value
    )
