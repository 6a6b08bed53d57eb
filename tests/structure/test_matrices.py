"""Modes of matrices against closed forms, the physical energies and the first-order eigenvalues of the damped rig."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import eigh

from patchfem.core import PatchfemError
from patchfem.structure import compute_receptance, masses, matrices


def chain(n, held=True, k=1.0):
    K = k * (2 * np.eye(n) - np.eye(n, k=1) - np.eye(n, k=-1))
    K[-1, -1] = k
    if not held:
        K[0, 0] = k
    return K


def some(seed, n, dampers=True):
    """M, K, C of random masses on random springs and dampers, K positive definite."""
    rng = np.random.default_rng(seed)
    A, B = rng.normal(size=(2, n, n))
    L = rng.normal(size=(n, n)) + 3 * np.eye(n)
    return L @ L.T, A @ A.T + 0.1 * np.eye(n), (B @ B.T if dampers else None), rng


@pytest.mark.parametrize("n", [2, 3, 12])
def test_exact_free_chain_has_one_rigid_mode(n):
    """omega_r = 2 sqrt(k/m) sin(r pi / (2n)), r = 0 exactly zero; k far from 1 to show the scale does not matter."""
    found = matrices.build_basis(3e-3 * np.eye(n), chain(n, held=False, k=7e9), faces=np.eye(n)[-1])
    want = 2 * np.sqrt(7e9 / 3e-3) * np.sin(np.arange(n) * np.pi / (2 * n))
    assert found.omega[0] == 0.0
    np.testing.assert_allclose(found.omega[1:], want[1:], rtol=1e-12)
    np.testing.assert_allclose(found.shapes[:, 0], 1 / np.sqrt(n * 3e-3), rtol=1e-10)


def test_exact_figure_16():
    """Two masses, one spring: a rigid mode and sqrt(2); a force on mass 1, friction on mass 2."""
    found = masses.build_basis([1.0, 1.0], [((1, 2), 1.0)], [], [(2, 0)], 2, driven_mass=1)
    np.testing.assert_allclose(found.omega, [0.0, np.sqrt(2)], rtol=1e-14)
    np.testing.assert_allclose(found.shapes, np.array([[1, -1], [1, 1]]) / np.sqrt(2), rtol=1e-14)
    np.testing.assert_allclose(found.base, -found.shapes[0], rtol=1e-14)
    np.testing.assert_allclose(found.slide, found.shapes[1], rtol=1e-14)
    assert found.omega[0] == 0.0 and found.names == ("1", "2") and found.damping is None


def test_exact_base_moves_every_mass():
    """The shares of the base give back M r: their squares add up to the whole mass, and Phi base = r."""
    m = [0.5, 2.0, 1.25]
    found = masses.build_basis(m, [((1, 0), 5.0), ((2, 1), 3.0), ((3, 2), 1.0)], [], [(3, 0)], 3)
    assert np.sum(found.base**2) == pytest.approx(sum(m), rel=1e-13)
    np.testing.assert_allclose(found.shapes @ found.base, 1.0, rtol=1e-13)
    np.testing.assert_allclose(found.output, found.shapes[2], rtol=0, atol=0)


def test_exact_soft_mode_beside_a_stiff_link():
    """A flexure of 1 N/m under two masses tied by 1e14 N/m: omega = sqrt(1/2) to round-off, not 1e-2."""
    found = masses.build_basis([1.0, 1.0], [((1, 0), 1.0), ((1, 2), 1e14)], [], [(2, 0)], 1)
    assert found.omega[0] == pytest.approx(np.sqrt(0.5), rel=1e-7)
    assert found.omega[1] == pytest.approx(np.sqrt(2e14), rel=1e-12)


@given(st.integers(0, 10**6), st.integers(2, 6))
def test_always_springs_one_by_one_are_their_matrix(seed, n):
    """The same net of springs by its single springs (singular values) and by its K (eigenvalues), free or held."""
    rng = np.random.default_rng(seed)
    pairs = [(i + 1, int(rng.integers(0, i + 1))) for i in range(n)][int(rng.integers(0, 2)) :]
    springs = [(pair, k) for pair, k in zip(pairs, rng.uniform(0.5, 2, n))]
    m = rng.uniform(0.5, 2, n)
    rows = masses.make_slide_rows(pairs, n)
    ours = masses.build_basis(m, springs, [], [(1, 0)], n)
    want = matrices.build_basis(
        np.diag(m),
        rows.T @ np.diag([k for _, k in springs]) @ rows,
        faces=masses.make_slide_rows([(1, 0)], n),
    )
    np.testing.assert_allclose(ours.omega, want.omega, atol=1e-12)
    assert (ours.omega == 0).sum() == (want.omega == 0).sum() == n - len(springs)
    w = np.array([0.37])
    np.testing.assert_allclose(
        *(compute_receptance(one, w, one.slide, one.base) for one in (ours, want)), rtol=1e-8
    )


@given(st.integers(0, 10**6), st.integers(2, 6))
def test_always_dampers_one_by_one_are_their_matrix(seed, n):
    """The same net of dampers by its single dampers and by its C: zeta and damping to round-off of the largest."""
    rng = np.random.default_rng(seed)
    pairs = [(i + 1, int(rng.integers(0, i + 1))) for i in range(n)]
    springs, dampers = (
        [(pair, k) for pair, k in zip(pairs, rng.uniform(0.5, 2, n))] for _ in range(2)
    )
    m = rng.uniform(0.5, 2, n)
    dash = masses.make_slide_rows(pairs, n) * np.sqrt([[c] for _, c in dampers])
    ours = masses.build_basis(m, springs, dampers, [(1, 0)], n)
    stretch = masses.make_slide_rows(pairs, n) * np.sqrt([[k] for _, k in springs])
    want = matrices.build_basis(
        np.diag(m),
        C=dash.T @ dash,
        faces=masses.make_slide_rows([(1, 0)], n),
        output=np.eye(n)[n - 1],
        spring_rows=stretch,
    )
    np.testing.assert_allclose(
        ours.damping_matrix, want.damping_matrix, atol=1e-12 * np.abs(want.damping_matrix).max()
    )
    np.testing.assert_allclose(ours.zeta, want.zeta, rtol=1e-10)


@given(st.integers(0, 10**6), st.integers(1, 6))
def test_always_modal_energy_is_physical_energy(seed, n):
    """Kinetic, strain and dissipated energy of any motion are the same in masses and in modes; work of the face too."""
    M, K, C, rng = some(seed, n)
    face = rng.normal(size=(2, n))
    found = matrices.build_basis(M, K, C, faces=face, base=rng.normal(size=n))
    z, v = rng.normal(size=(2, n))
    x = found.shapes @ z
    u = found.shapes @ v
    assert v @ v == pytest.approx(u @ M @ u, rel=1e-9)
    assert z @ (found.omega**2 * z) == pytest.approx(x @ K @ x, rel=1e-9)
    assert v @ found.damping_matrix @ v == pytest.approx(u @ C @ u, rel=1e-9)
    np.testing.assert_allclose(found.interfaces @ z, face @ x, rtol=1e-9, atol=1e-9)


def test_exact_proportional_damping_stays_in_the_modes():
    M, K, _, _ = some(3, 5)
    found = matrices.build_basis(M, K, 0.3 * M + 0.02 * K)
    assert found.damping is None
    np.testing.assert_allclose(
        2 * found.zeta * found.omega, 0.3 + 0.02 * found.omega**2, rtol=1e-11
    )
    np.testing.assert_allclose(found.omega**2, eigh(K, M, eigvals_only=True), rtol=1e-10)


def test_exact_equal_frequencies_are_turned_to_uncouple_the_dampers():
    """Two equal oscillators with a damper between them: sum and difference, 0 and 2c/m; taken singly they couple."""
    found = masses.build_basis(
        [1.0, 1.0], [((1, 0), 4.0), ((2, 0), 4.0)], [((1, 2), 0.1)], [(1, 2)], 1
    )
    assert found.damping is None
    np.testing.assert_allclose(found.omega, 2.0, rtol=1e-14)
    np.testing.assert_allclose(np.sort(found.zeta), [0.0, 0.05], atol=1e-15)
    np.testing.assert_allclose(found.shapes.T @ found.shapes, np.eye(2), atol=1e-14)


def test_exact_damper_on_a_rigid_mode_is_kept():
    found = masses.build_basis([2.0], [], [((1, 0), 3.0)], [(1, 0)], 1)
    assert found.omega[0] == 0.0 and found.zeta[0] == 0.0
    np.testing.assert_allclose(found.damping, [[1.5]], rtol=1e-15)


def test_exact_motions_of_the_patch_are_rows_times_shapes():
    M, K, _, rng = some(11, 4)
    rows = {key: rng.normal(size=4) for key in ("normal", "pitch", "yaw")}
    found = matrices.build_basis(M, K, output=[0, 0, 1, 0], lateral=np.zeros(4), **rows)
    for key, row in rows.items():
        np.testing.assert_allclose(getattr(found, key), row @ found.shapes, rtol=1e-13)
    assert (
        found.lateral is None
        and found.interfaces.shape == (0, 4)
        and (found.slide == found.output).all()
    )
    assert np.all(found.output >= 0)


M2, K2 = np.eye(2), np.array([[2.0, -1.0], [-1.0, 1.0]])


@pytest.mark.parametrize("M, K, C, says", [
    (np.diag([1.0, 0.0]), K2, None, "M is not positive definite: every coordinate needs mass (coordinate 2 has none)"),
    (np.diag([1.0, -1.0]), K2, None, "M is not positive definite"),
    (np.array([[1.0, 1.0], [1.0, 1.0]]), K2, None, "M is not positive definite"),
    (M2, np.array([[2.0, -1.0], [-0.9, 1.0]]), None, "K is not symmetric"),
    (M2, -K2, None, "K is not positive semidefinite"),
    (M2, np.diag([1.0, -1e-6]), None, "K is not positive semidefinite"),
    (M2, K2, np.array([[0.0, 1.0], [-1.0, 0.0]]), "C is not symmetric"),
    (M2, K2, np.diag([1.0, -0.1]), "C adds energy"),
    (M2, np.eye(3), None, "K is 3 x 3 but M is 2 x 2"),
    (M2, np.ones((2, 3)), None, "K must be square"),
    (M2 * np.nan, K2, None, "M contains values that are not finite"),
    (M2, [["a", "b"], ["c", "d"]], None, "K is not a matrix of real numbers"),
    (M2, K2 * (1 + 0.2j), None, "K is complex (imaginary parts are up to 0.2 times the real parts); motion in time "
                                "needs real matrices; for a loss factor eta (here about 0.2) give K without the loss "
                                "factor, and the damping matrix C = eta K/omega [N s/m]"),
    (M2 * (1 + 1e-9j), K2, None, "M is complex (imaginary parts are up to 1e-09 times the real parts)"),
    (M2, K2, 1j * K2, "C is complex"), (M2, [[1.0, 2.0], [3.0]], None, "K is not a matrix of real numbers"),
    (1e-300 * np.eye(2), 1e20 * np.eye(2), None, "K/M is too large to compute; check that K and M are in SI units"),
])  # fmt: skip
def test_refuses_matrices_without_modes(M, K, C, says):
    with pytest.raises(PatchfemError) as caught:
        matrices.build_basis(M, K, C)
    assert says in str(caught.value)


def test_refuses_springs_too_stiff_for_their_masses():
    with pytest.raises(PatchfemError, match="K/M is too large to compute"):
        masses.build_basis([1e-320], [((1, 0), 1e300)], [], [(1, 0)], 1)


def test_exact_matrices_stored_as_complex_numbers_are_their_real_parts():
    real, stored = (
        matrices.build_basis(M2 * one, K2 * one, 0.1 * K2 * one, faces=np.ones(2) * one)
        for one in (1.0, 1 + 0j)
    )
    assert np.array_equal(real.omega, stored.omega) and np.array_equal(real.slide, stored.slide)
    assert np.array_equal(real.zeta, stored.zeta)


@pytest.mark.parametrize("rows, says", [
    ({"faces": np.ones(3)}, "slide has shape (3,), but M has 2"), ({"base": [1.0]}, "base has shape (1,)"),
    ({"output": [1.0, np.inf]}, "output contains values that are not finite"),
    ({"normal": ["x", "y"]}, "normal does not contain real numbers"), ({"faces": np.full(2, 1j)}, "slide is complex"),
])  # fmt: skip
def test_refuses_rows_of_another_size(rows, says):
    with pytest.raises(PatchfemError) as caught:
        matrices.build_basis(M2, K2, **rows)
    assert says in str(caught.value)
