"""Reduced structures: exact where no mode is left out, statics and rigid motions always, orders of the rest."""

import mpmath
import numpy as np
import pytest
from scipy import sparse

from patchfem.core import PatchfemError
from patchfem.structure import matrices, reduced

METHODS = ("craig-bampton", "free-interface")
BOUNDARY = np.array([11, 4])


def chain(n=12, held=True, seed=1):
    """K, M, C (n, n) of a chain with unequal masses and springs, held at its first mass or loose."""
    rng = np.random.default_rng(seed)
    k = 1e6 * rng.uniform(0.5, 2, n)
    m = 0.01 * rng.uniform(0.5, 2, n)
    K = np.diag(k + np.append(k[1:], 0)) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    K[0, 0] -= 0 if held else k[0]
    return K, np.diag(m), 1e-5 * K + 3 * np.diag(m)


def made(K, M, C=None, modes=3, method=METHODS[0], boundary=BOUNDARY, moved=None):
    return reduced.reduce_matrices(
        *(None if one is None else sparse.csr_array(one) for one in (K, M, C)),
        boundary,
        modes,
        method,
        moved,
    )


@pytest.mark.parametrize("held", [True, False])
@pytest.mark.parametrize("method", METHODS)
def test_exact_where_no_mode_is_left_out(method, held):
    """Frequencies, participation, output and slides are those of the full matrices, dampers and rigid motion too."""
    K, M, C = chain(held=held)
    ones = np.ones(12)
    found = made(K, M, C, 5, method, moved=ones)
    assert found.modes.is_complete
    small = reduced.build_basis(found, found.modes.omega.size, [(1, 0), (1, 2)])
    row = np.zeros((2, 12))
    row[:, 11] = 1
    row[1, 4] = -1
    full = matrices.build_basis(M, K, C, faces=row, output=row[0], base=ones)
    scale = full.omega[-1]
    np.testing.assert_allclose(small.omega, full.omega, atol=1e-10 * scale)
    assert (small.omega[0] == 0) == (not held)
    for name in ("base", "output", "faces", "damping_matrix"):
        true = getattr(full, name)
        np.testing.assert_allclose(
            getattr(small, name), true, atol=1e-7 * np.abs(true).max(), err_msg=name
        )


@pytest.mark.parametrize("method", METHODS)
def test_exact_statics_of_the_boundary_however_few_the_modes(method):
    """Flexibilities between boundary coordinates, and what a steady acceleration of the base moves them by."""
    K, M, _ = chain()
    found = made(K, M, None, 1, method, moved=np.ones(12))
    inverse = np.linalg.inv(K)
    for modes in (0, 1, 3):
        for out, at in ((1, 1), (1, 2), (2, 2)):
            one = reduced.build_basis(found, modes, output=out, driven_mass=at)
            static = -(one.output * one.base / one.omega**2).sum() / one.mass
            np.testing.assert_allclose(
                static, inverse[BOUNDARY[out - 1], BOUNDARY[at - 1]], rtol=1e-9
            )
        one = reduced.build_basis(found, modes)
        np.testing.assert_allclose(
            (one.output * one.base / one.omega**2).sum(), (inverse @ M).sum(axis=1)[11], rtol=1e-9
        )


@pytest.mark.parametrize("method", METHODS)
def test_exact_rigid_motion_takes_the_whole_mass(method):
    K, M, _ = chain(held=False)
    one = reduced.build_basis(made(K, M, None, 2, method, moved=np.ones(12)), 2)
    assert one.omega[0] == 0 and (one.omega[1:] > 0).all()
    np.testing.assert_allclose(one.base[0] ** 2, M.sum(), rtol=1e-9)


@pytest.mark.parametrize("method", METHODS)
def test_always_fewer_modes_are_the_reduction_to_fewer(method):
    """What `kept` takes out of more modes is what a reduction to so many finds itself; Ritz values fall."""
    K, M, _ = chain(30)
    many, few = (
        made(K, M, None, modes, method, np.array([29, 10]), np.ones(30)) for modes in (6, 1)
    )
    ours, own = (reduced.build_basis(one, 1) for one in (many, few))
    np.testing.assert_allclose(ours.omega, own.omega, rtol=1e-8)
    omegas = np.array([reduced.build_basis(many, modes).omega[:3] for modes in (2, 4, 8, 16)])
    full = matrices.build_basis(M, K).omega[:3]
    assert (np.diff(omegas, axis=0) <= 1e-9 * full).all() and (omegas >= full * (1 - 1e-9)).all()


@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("links", [40, 12])
def test_exact_frequencies_of_a_slender_beam_keep_their_digits(method, links):
    """A beam of rigid links and equal hinges, by 40 digits; its frequencies span a factor of 260 or 3000. Eigenvalues
    of both reduced matrices erred by 5e-10 behind free modes."""
    n = links
    D = np.eye(n) - 2 * np.eye(n, k=-1) + np.eye(n, k=-2)
    K = D.T @ D
    M = np.diag(np.random.default_rng(4).integers(1, 9, n) / 4.0)
    with mpmath.workdps(40):
        root = mpmath.diag([1 / mpmath.sqrt(one) for one in np.diag(M)])
        square = mpmath.eigsy(root * mpmath.matrix(K.tolist()) * root, eigvals_only=True)
        true = np.array([float(mpmath.sqrt(one)) for one in square])
    small = reduced.build_basis(made(K, M, None, n, method, np.array([n - 1, 4])), n, driven_mass=1)
    np.testing.assert_allclose(small.omega, true, rtol=2e-16 * (true[-1] / true[0]) ** 1.5)


def test_order_of_a_free_interface_reduction_is_that_of_its_residuals():
    """Of a string of many masses the lowest frequency errs by the fourth power of the modes and more, against the
    third of fixed-interface modes behind an end that is free."""
    n = 400
    K, M = (
        sparse.csr_array(one)
        for one in (
            sparse.diags_array(
                [np.full(n, 2.0), np.full(n - 1, -1.0), np.full(n - 1, -1.0)], offsets=[0, 1, -1]
            ),
            sparse.eye_array(n),
        )
    )
    true = 2 * np.sin(np.pi / (2 * (n + 1)))
    errors = {}
    for method in METHODS:
        found = reduced.reduce_matrices(K, M, None, np.array([150]), 20, method)
        errors[method] = [
            reduced.build_basis(found, modes, driven_mass=1).omega[0] / true - 1
            for modes in (5, 10, 20)
        ]
    slope = np.log2(errors["craig-bampton"][0] / errors["craig-bampton"][2]) / 2
    assert 2.5 < slope < 3.5 and max(errors["free-interface"]) < 1e-3 * max(errors["craig-bampton"])


def test_always_modes_of_large_matrices_are_those_of_full_ones():
    """Shifted and inverted Lanczos steps against full matrices, and the same answer again."""
    K, M, _ = chain(700, seed=3)
    found = made(K, M, None, 6, boundary=np.array([699]))
    again = made(K, M, None, 6, boundary=np.array([699]))
    full = matrices.build_basis(M[:-1, :-1], K[:-1, :-1])
    np.testing.assert_allclose(found.modes.omega, full.omega[:16], rtol=1e-9)
    assert np.array_equal(found.stiffness, again.stiffness)


def test_exact_massless_coordinates_are_carried_statically():
    """A coordinate without mass between two springs is their sum in series."""
    K = np.array([[3.0, -2.0, 0], [-2.0, 3.0, -1.0], [0, -1.0, 1.0]])
    one = reduced.build_basis(
        made(K, np.diag([1.0, 0, 2.0]), None, 2, boundary=np.array([2]), moved=np.ones(3)), 5
    )
    full = matrices.build_basis(
        np.diag([1.0, 2.0]), np.array([[1 + 2 / 3, -2 / 3], [-2 / 3, 2 / 3]])
    )
    np.testing.assert_allclose(one.omega, full.omega, rtol=1e-12)


def test_exact_ratio_is_that_of_every_mode():
    K, M, _ = chain(held=False)
    one = reduced.build_basis(made(K, M, moved=np.ones(12)), 3, ratio=0.02)
    assert one.damping is None and one.zeta[0] == 0 and (one.zeta[1:] == 0.02).all()


REFUSED = {
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


@pytest.mark.parametrize("says", REFUSED)
@pytest.mark.parametrize("method", METHODS)
def test_refuses_matrices_that_are_not_positive(says, method):
    K, M, _ = chain()
    REFUSED[says](K, M)
    with pytest.raises(PatchfemError) as caught:
        found = made(K, M, None, 3, method)
        reduced.build_basis(found, 3, driven_mass=1)
    wanted = (
        says
        if "negative energy" not in says or "energy" in str(caught.value)
        else "the stiffness matrix is not positive"
    )
    assert wanted in str(caught.value) and caught.value.key.startswith("structure.reduced."), (
        caught.value
    )


def test_refuses_a_part_that_moves_beside_a_held_boundary():
    """A loose part takes no strain; free-interface modes take it as a rigid motion."""
    K, M, _ = chain()
    K[6, 6] += K[6, 7]
    K[7, 7] += K[6, 7]
    K[6, 7] = K[7, 6] = 0
    with pytest.raises(PatchfemError, match="add a coordinate of each loose part"):
        made(K, M, boundary=np.array([4]))
    one = reduced.build_basis(
        made(K, M, None, 4, "free-interface", np.array([4])), 4, driven_mass=1
    )
    assert (one.omega == 0).sum() == 1


def test_refuses_attachment_modes_of_a_boundary_that_moves_as_one():
    """A spring 1e10 times as stiff as the others joins the boundary coordinates: their shapes are equal."""
    spring = np.full(12, 1e6)
    spring[-1] *= 1e10
    stiffness = (
        np.diag(spring + np.append(spring[1:], 0))
        - np.diag(spring[1:], 1)
        - np.diag(spring[1:], -1)
    )
    mass = sparse.csr_array(0.01 * np.eye(12))
    found = reduced.reduce_matrices(
        sparse.csr_array(stiffness), mass, None, np.array([10, 11]), 2, "free-interface"
    )
    with pytest.raises(PatchfemError, match="use method = 'craig-bampton'") as refusal:
        reduced.build_basis(found, 2)
    assert refusal.value.key == "structure.reduced.modes"
