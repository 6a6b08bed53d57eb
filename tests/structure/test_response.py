"""Frequency response of a basis compared with a direct solve of its matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses, matrices


@given(st.integers(0, 10**6), st.booleans())
def test_always_receptance_equals_direct_solve(seed, proportional):
    """The receptance equals a direct solve, is symmetric, and dissipates energy at every coordinate."""
    rng = np.random.default_rng(seed)
    n = 4
    A, B = rng.normal(size=(2, n, n))
    L = rng.normal(size=(n, n)) + 3 * np.eye(n)
    M = L @ L.T
    K = A @ A.T + 0.1 * np.eye(n)
    C = 0.2 * M + 0.01 * K if proportional else B @ B.T
    basis = matrices.build_basis(M, K, C, faces=np.eye(n)[1])
    assert (basis.damping is None) == proportional
    omega = rng.uniform(0.01, 3, 5)
    receptance = compute_receptance(basis, omega, basis.shapes, basis.shapes)
    for k, w in enumerate(omega):
        direct = np.linalg.inv(K + 1j * w * C - w * w * M)
        np.testing.assert_allclose(
            receptance[k], direct, rtol=1e-8, atol=1e-10 * np.abs(direct).max()
        )
        np.testing.assert_allclose(
            receptance[k], receptance[k].T, atol=1e-10 * np.abs(direct).max()
        )
        # -2 times the power of a unit force; a passive structure takes energy at every coordinate
        power = w * receptance[k].imag
        assert np.linalg.eigvalsh((power + power.T) / 2).max() <= 1e-10 * np.abs(direct).max()


def test_refuses_infinite_response():
    """A frequency at which the response is infinite is refused."""
    free = masses.build_basis([1.0], [], [], [], 1)
    supported = masses.build_basis([1.0], [((1, 0), 4.0)], [], [], 1)
    damped = masses.build_basis([1.0, 1.0], [((1, 2), 4.0)], [((1, 0), 1.0)], [], 1)
    for basis, omega in ((free, 0.0), (supported, 2.0), (damped, 0.0)):
        with pytest.raises(PatchfemError, match="is infinite"):
            compute_receptance(basis, omega, basis.output, basis.output)
