"""Modes of matrices compared with closed forms, and refusals."""

import numpy as np
import pytest

from patchfem.core import PatchfemError
from patchfem.structure import masses, matrices


def chain_stiffness(n, is_fixed=True, k=1.0):
    """Return the stiffness matrix of a chain of n masses, fixed at its first mass or free."""
    K = k * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[-1, -1] = k
    if not is_fixed:
        K[0, 0] = k
    return K


@pytest.mark.parametrize("n", [3, 12])
def test_exact_free_chain_frequencies_agree_with_closed_form(n):
    """The frequencies of a free chain are 2 sqrt(k/m) sin(r pi/(2n)), with exactly one zero.

    The stiffness of 7e9 N/m shows that the scale does not matter.
    """
    basis = matrices.build_basis(
        3e-3 * np.eye(n), chain_stiffness(n, is_fixed=False, k=7e9), faces=np.eye(n)[-1]
    )
    expected = 2 * np.sqrt(7e9 / 3e-3) * np.sin(np.arange(n) * np.pi / (2 * n))
    assert basis.omega[0] == 0.0
    np.testing.assert_allclose(basis.omega[1:], expected[1:], rtol=1e-12)
    np.testing.assert_allclose(basis.shapes[:, 0], 1 / np.sqrt(n * 3e-3), rtol=1e-10)


def test_exact_base_participation_sums_to_total_mass():
    """The squared participation factors of the base add up to the total mass, and Phi base = 1."""
    m = [0.5, 2.0, 1.25]
    basis = masses.build_basis(m, [((1, 0), 5.0), ((2, 1), 3.0), ((3, 2), 1.0)], [], [(3, 0)], 3)
    assert np.sum(basis.base**2) == pytest.approx(sum(m), rel=1e-13)
    np.testing.assert_allclose(basis.shapes @ basis.base, 1.0, rtol=1e-13)
    np.testing.assert_allclose(basis.output, basis.shapes[2], rtol=0, atol=0)


def test_exact_repeated_modes_are_chosen_uncoupled_by_damping():
    """The shapes of two equal frequencies are chosen such that the damper between the masses does not couple them."""
    basis = masses.build_basis(
        [1.0, 1.0], [((1, 0), 4.0), ((2, 0), 4.0)], [((1, 2), 0.1)], [(1, 2)], 1
    )
    assert basis.damping is None
    np.testing.assert_allclose(basis.omega, 2.0, rtol=1e-14)
    np.testing.assert_allclose(np.sort(basis.zeta), [0.0, 0.05], atol=1e-15)
    np.testing.assert_allclose(basis.shapes.T @ basis.shapes, np.eye(2), atol=1e-14)


def test_exact_damper_on_rigid_mode_is_preserved():
    """A damper on a rigid mode is preserved in the damping matrix, as its damping ratio is undefined."""
    basis = masses.build_basis([2.0], [], [((1, 0), 3.0)], [(1, 0)], 1)
    assert basis.omega[0] == 0.0 and basis.zeta[0] == 0.0
    np.testing.assert_allclose(basis.damping, [[1.5]], rtol=1e-15)


M2, K2 = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]])


@pytest.mark.parametrize("M, K, C, message", [
    (np.diag([1.0, 0.0]), K2, None, "M is not positive definite: every coordinate needs mass (coordinate 2 has none)"),
    (np.array([[1.0, 1.0], [1.0, 1.0]]), K2, None, "M is not positive definite"),
    (M2, np.array([[2.0, -1.0], [-0.9, 1.0]]), None, "K is not symmetric"),
    (M2, np.diag([1.0, -1e-6]), None, "K is not positive semidefinite"),
    (M2, K2, np.array([[0.0, 1.0], [-1.0, 0.0]]), "C is not symmetric"),
    (M2, K2, np.diag([1.0, -0.1]), "C adds energy"),
    (M2, np.eye(3), None, "K is 3 x 3 but M is 2 x 2"),
    (M2, np.ones((2, 3)), None, "K must be square"),
    (M2, [["a", "b"], ["c", "d"]], None, "K is not a matrix of real numbers"),
    (M2, K2 * (1 + 0.2j), None, "K is complex (imaginary parts are up to 0.2 times the real parts); motion in time "
                                "needs real matrices; for a loss factor eta (here about 0.2) give K without the loss "
                                "factor, and the damping matrix C = eta K/omega [N s/m]"),
    (1e-300 * np.eye(2), 1e20 * np.eye(2), None, "K/M is too large to compute; check that K and M are in SI units"),
])  # fmt: skip
def test_refuses_invalid_matrices(M, K, C, message):
    """Matrices that are not symmetric, not positive, complex, misshapen or out of range are refused."""
    with pytest.raises(PatchfemError) as caught:
        matrices.build_basis(M, K, C)
    assert message in str(caught.value)
