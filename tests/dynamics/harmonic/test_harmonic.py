"""Harmonic balance against closed forms, differences and dense linear algebra."""

import numpy as np
import pytest
from bond_moments import advance_bonds
from harmonic_cases import (
    make_bond_law,
    make_elements,
    make_five_modes,
    make_lugre_law,
    make_sdof,
    make_speed_law,
)
from hypothesis import given, settings
from hypothesis import strategies as st
from modal_bases import make_modal_basis
from yielding_points import jenkins_forces

from patchfem.core import NotConverged, PatchfemError
from patchfem.dynamics import LawGroup, Spring, find_free_motions, make_free_balance
from patchfem.dynamics.harmonic.backbone import FreeBalance
from patchfem.dynamics.harmonic.equations import HarmonicBalance
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.series import evaluate_series, pack_harmonics, unpack_harmonics
from patchfem.dynamics.harmonic.slides import make_slides
from patchfem.friction import Bonds, Coulomb

GROWING = Bonds(0.3, 1e-6, ratio=0.5, rest_growth=1.0, slip_growth=1e-7)


def random_harmonics(seed, count, scale=1.0):
    """Return random Fourier coefficients of a slide with a dominant first harmonic."""
    rng = np.random.default_rng(seed)
    x = (rng.normal(size=count + 1) + 1j * rng.normal(size=count + 1)) * 0.3 * scale
    x[0] = 0.1 * scale * rng.normal()
    x[1] *= 3
    return x


# ---- laws along a periodic slide


@settings(settings.get_profile("costly"))
@given(st.integers(0, 10**6), st.integers(1, 6), st.floats(0.05, 3.0))
def test_always_elements_agree_with_sequential_loop(seed, count, scale):
    """Sampled forces of parallel elements agree within 1e-12 with a loop over samples and reversals
    in order, one element at a time."""
    k, w = make_elements(17, 3.0, 1.0)
    slides = make_slides(random_harmonics(seed, count, scale)[None], 1.0, 64)
    cycle = slides.q[0]
    forces = jenkins_forces(np.tile(cycle, 2), k, w)[0][cycle.size :]
    assert Jenkins(k, w).evaluate(slides, 0).force == pytest.approx(forces, abs=1e-12)
    fine = evaluate_series(slides.harmonics[0], 65536)
    turns = slides.reversals[0]
    assert turns.size >= 2 and np.sum(slides.is_sample) == 64
    assert cycle[turns].max() == pytest.approx(fine.max(), abs=1e-6 * np.ptp(fine))
    assert cycle[turns].min() == pytest.approx(fine.min(), abs=1e-6 * np.ptp(fine))


@settings(settings.get_profile("costly"))
@given(st.integers(0, 10**6), st.integers(1, 5), st.floats(0.05, 3.0))
def test_always_bonds_agree_with_recursion(seed, count, scale):
    """Sampled forces of bonds agree within 1e-10 with the recursion of friction.bonds, repeated
    until it is periodic."""
    slides = make_slides(random_harmonics(seed, count, scale)[None], 1.0, 32)
    cycle = slides.q[0]
    law = Bonds(0.3, 0.4)
    state = np.array([[1.0], [0.0], [0.0]])
    previous = cycle[-1]
    for _ in range(int(10 / np.abs(np.diff(cycle)).sum()) + 3):
        forces = []
        for q in cycle:
            state = advance_bonds(state, np.array([q - previous]), np.ones(1), law.length)[0]
            previous = q
            forces.append(law.static / law.length * state[1, 0])
    force = make_bond_law(0.3, 0.4).evaluate(slides, 0).force
    assert force == pytest.approx(np.array(forces), abs=1e-10)


@pytest.mark.parametrize(
    "law",
    [
        Jenkins([10.0, 3.0], [0.08, 0.2]),
        make_bond_law(0.8, 0.1),
        Spring(2.0, 5.0),
        Spring(3.0, wavelength=0.5),
        make_speed_law(0.8, 0.3),
        make_lugre_law(),
    ],
    ids=["Jenkins", "Bonds", "Spring", "interlocking", "SpeedLaw", "LuGre"],
)
def test_exact_derivatives_of_forces_agree_with_differences(law):
    """The derivatives of the forces with respect to the slide and the frequency agree with central
    differences within 1e-7."""
    group = LawGroup(make_sdof(), law)
    q = random_harmonics(3, 5)[None]
    result = group.compute_harmonics(q, 1.3, 16384)
    v = pack_harmonics(random_harmonics(3, 5)[None])
    eps = 1e-6

    def force(x, omega=1.3):
        return group.compute_harmonics(unpack_harmonics(x, 1), omega, 16384).force[0]

    expected = np.stack(
        [(force(v + d) - force(v - d)) / (2 * eps) for d in eps * np.eye(v.size)], axis=1
    )
    assert result.slope[0] == pytest.approx(expected, abs=1e-7)
    assert result.by_omega[0] == pytest.approx(
        (force(v, 1.3 + eps) - force(v, 1.3 - eps)) / (2 * eps), abs=1e-8
    )


# ---- harmonic balance


def solve_linear_modes(modes, omega, level, spring):
    """Return the modal phasors of the linear structure with a spring at the interface."""
    a = (
        np.diag(modes.omega**2)
        - omega**2 * np.eye(modes.omega.size)
        + 1j * omega * modes.damping_matrix
        + np.outer(modes.slide, modes.slide) * spring / modes.mass
    )
    return np.linalg.solve(a, 1j * level * modes.base)


def test_exact_rigid_and_undamped_modes_agree_with_linear_response():
    """Rigid modes and undamped modes at their natural frequency have no receptance of their own. The motion that follows
    from the slides of the linear response is this response within 1e-10."""
    ones = np.ones(2)
    modes = make_modal_basis([0.0, 1.0], 0.0, [1.0, 0.6], ones, ones, mass=1.5)
    balance = HarmonicBalance(modes, LawGroup(modes, Spring(2.0)), 256)
    exciting = np.zeros((4, 2), complex)
    exciting[1] = 1j * modes.base
    for omega in (0.8, 1.0):
        expected = solve_linear_modes(modes, omega, 1.0, 2.0)
        slides = np.zeros((1, 4), complex)
        slides[0, 1] = modes.slide @ expected
        motion = balance.find_motion(pack_harmonics(slides), omega, exciting)
        assert motion.modal[1] == pytest.approx(expected, rel=1e-10)
        assert np.abs(motion.modal[0]).max() < 1e-12


def test_exact_jacobian_of_balance_agrees_with_differences():
    """The derivatives of the residual of free motions by slides, frequency, damping ratio and amplitude agree with central
    differences within 1e-7."""
    ones = np.ones(3)
    c = 0.1 * np.eye(3) + 0.05
    interfaces = np.array([[1.0, 0.5, -0.3], [0.2, -1.0, 0.4]])
    for damping in (None, c):
        modes = make_modal_basis(
            [0.0, 1.0, 3.0], 0.02, interfaces, ones, ones, mass=1.3, damping=damping
        )
        group = LawGroup(
            modes,
            [(0, make_speed_law(0.4, 0.3)), (1, Spring(0.3, 0.8)), (0, make_bond_law(0.5, 0.4))],
        )
        equations = FreeBalance(HarmonicBalance(modes, group, 1024), 1, 3)
        x = np.random.default_rng(4).normal(size=14) * 0.5
        x = np.append(x, [0.8, 0.1, 0.6])
        jacobian = equations.evaluate(x, 0.7).jacobian

        def residual(v, equations=equations):
            return equations.evaluate(v, 0.7).residual

        eps = 1e-6
        expected = np.stack(
            [(residual(x + d) - residual(x - d)) / (2 * eps) for d in eps * np.eye(x.size)], axis=1
        )
        assert jacobian == pytest.approx(expected, abs=1e-7)


# ---- refusals


def test_refuses_laws_that_cannot_be_balanced():
    """Rigid friction, bonds without a closed form and groups without a law or a motion are refused with a message."""
    modes = make_sdof()
    with pytest.raises(PatchfemError, match="rigid friction"):
        LawGroup(modes, Coulomb(1.0, 1.0).element(1.0))
    with pytest.raises(PatchfemError, match="a constant bond length"):
        LawGroup(modes, GROWING.element(1.0))
    with pytest.raises(PatchfemError, match="on at least one interface"):
        LawGroup(modes, [])
    with pytest.raises(PatchfemError, match="no mode moves"):
        HarmonicBalance(modes, LawGroup(modes, (np.zeros(1), Spring(1.0))), 256)


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_exact_dependent_interfaces_keep_their_dependence(scale):
    """The slide of an interface that depends on two others is that of their rows within 1e-11, at any scale of slides."""
    rows = np.array([[1.0, 0.5, 0, 0, 0.2], [0, 1.0, 0.1, 0, 0], [2.0, 2.0, 0.1, 0, 0.4]])
    modes = make_five_modes()
    laws = [(row, Jenkins([2.0], [0.3 * scale])) for row in rows]
    equations = make_free_balance(modes, LawGroup(modes, laws), 0, scale, 9)
    slides = find_free_motions(equations, [scale])[0].motion.slides
    np.testing.assert_allclose(
        slides[2], 2 * slides[0] + slides[1], rtol=0, atol=1e-11 * np.abs(slides).max()
    )


def test_refuses_motion_that_does_not_converge():
    """Newton's method raises an error if it does not converge in the given number of steps."""
    modes = make_sdof()
    equations = make_free_balance(modes, LawGroup(modes, Jenkins([10.0], [0.08])), 0, 1.0, 7)
    start = equations.start(*equations.stuck_mode, 1.0)
    with pytest.raises(NotConverged, match="no free motion with the amplitude"):
        equations.solve(start, 1.0, max_steps=2)
