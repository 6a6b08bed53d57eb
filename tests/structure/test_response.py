"""Frequency response of a basis against a direct solve of its matrices."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses, matrices


@given(st.integers(0, 10**6), st.booleans())
def test_always_equals_the_direct_solve_and_is_reciprocal(seed, proportional):
    rng = np.random.default_rng(seed)
    n = 4
    A, B = rng.normal(size=(2, n, n))
    L = rng.normal(size=(n, n)) + 3 * np.eye(n)
    M = L @ L.T
    K = A @ A.T + 0.1 * np.eye(n)
    C = 0.2 * M + 0.01 * K if proportional else B @ B.T
    found = matrices.build_basis(M, K, C, faces=np.eye(n)[1])
    assert (found.damping is None) == proportional
    omega = rng.uniform(0.01, 3, 5)
    ours = compute_receptance(found, omega, found.shapes, found.shapes)
    for k, w in enumerate(omega):
        direct = np.linalg.inv(K + 1j * w * C - w * w * M)
        np.testing.assert_allclose(ours[k], direct, rtol=1e-8, atol=1e-10 * np.abs(direct).max())
        np.testing.assert_allclose(ours[k], ours[k].T, atol=1e-10 * np.abs(direct).max())
        # of a unit force, -2 |F|^2: a passive rig takes energy at every place
        power = w * ours[k].imag
        assert np.linalg.eigvalsh((power + power.T) / 2).max() <= 1e-10 * np.abs(direct).max()


def test_exact_base_drive_of_a_free_structure():
    """Nothing ties the masses to the base: each stays in space, so relative to the base it moves by -X."""
    found = masses.build_basis([1.0, 3.0], [((1, 2), 5.0)], [], [(2, 0)], 1)
    w = 1.7
    # base X = 1, acceleration -w^2
    moved = compute_receptance(found, w, found.shapes, -w * w * found.base)
    np.testing.assert_allclose(-moved[0, :, 0], -1.0, rtol=1e-12)


def test_refuses_an_infinite_response():
    free = masses.build_basis([1.0], [], [], [], 1)
    held = masses.build_basis([1.0], [((1, 0), 4.0)], [], [], 1)
    damped = masses.build_basis([1.0, 1.0], [((1, 2), 4.0)], [((1, 0), 1.0)], [], 1)
    for basis, at in ((free, 0.0), (held, 2.0), (damped, 0.0)):
        with pytest.raises(PatchfemError, match="is infinite"):
            compute_receptance(basis, at, basis.output, basis.output)
