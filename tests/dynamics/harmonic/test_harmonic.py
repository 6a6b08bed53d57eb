"""Harmonic balance against closed forms, time integration, dense linear algebra and energy
balances."""

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

from patchfem.core import NotConverged, PatchfemError, SineDrive
from patchfem.dynamics import (
    LawGroup,
    Spring,
    find_cycle_energies,
    find_steady_motion,
    make_cycle_response,
)
from patchfem.dynamics.harmonic.equations import HarmonicBalance
from patchfem.dynamics.harmonic.laws import Jenkins
from patchfem.dynamics.harmonic.series import evaluate_series, pack_harmonics, unpack_harmonics
from patchfem.dynamics.harmonic.slides import make_slides
from patchfem.friction import Bonds, Coulomb
from patchfem.friction.laws.elastic_plastic import parallel_element

DRIVE = SineDrive(1.0, 1.0)
GROWING = Bonds(0.3, 1e-6, ratio=0.5, rest_growth=1.0, slip_growth=1e-7)
RIGID_AND_UNDAMPED = make_modal_basis([0.0, 1.0], 0.0, [1.0, 0.6], np.ones(2), np.ones(2), mass=1.5)
# peaks by stiffness, for friction limit 0.8 and damping ratio 0.003; DOP853 at 1e-12
PEAKS = {
    10: 0.249538145,
    100: 0.285786312,
    1000: 0.288449682,
}


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
    """Rigid modes and undamped modes at their natural frequency have no receptance of their own. The balance
    agrees with the linear response within 1e-10."""
    modes = RIGID_AND_UNDAMPED
    for omega in (0.8, 1.0):
        point = find_steady_motion(modes, SineDrive(1.0, omega), Spring(2.0), harmonics=3)
        assert point.modal[1] == pytest.approx(
            solve_linear_modes(modes, omega, 1.0, 2.0), rel=1e-10
        )
        assert np.abs(point.modal[0]).max() < 1e-12


def test_exact_jacobian_of_balance_agrees_with_differences():
    """The derivatives of the residual with respect to the coefficients, frequency and level agree
    with central differences within 1e-7."""
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
        balance = HarmonicBalance(modes, group, 1024)
        x = np.random.default_rng(4).normal(size=14) * 0.5
        result = balance.evaluate(x, 1.1, 0.7)

        def residual(v, omega=1.1, level=0.7, balance=balance):
            return balance.evaluate(v, omega, level).residual

        eps = 1e-6
        expected = np.stack(
            [(residual(x + d) - residual(x - d)) / (2 * eps) for d in eps * np.eye(x.size)], axis=1
        )
        assert result.jacobian == pytest.approx(expected, abs=1e-7)
        assert result.by_omega == pytest.approx(
            (residual(x, 1.1 + eps) - residual(x, 1.1 - eps)) / (2 * eps), abs=1e-7
        )
        assert result.by_level == pytest.approx(
            (residual(x, level=0.8) - residual(x, level=0.6)) / 0.2, abs=1e-9
        )


# ---- comparison with the equation of motion and time integration


@pytest.mark.share(2, 3)
@pytest.mark.parametrize(
    "stiffness, tolerance, max_error",
    [(10, 1e-3, 1e-3), (100, 1e-3, 1e-3), (10, 1e-5, 1e-5), (100, 1e-5, 1e-5), (1000, 1e-4, 1e-4)],
)
def test_exact_peaks_at_resonance_agree_with_dop853(stiffness, tolerance, max_error):
    """Peaks at resonance agree with values by DOP853 within the tolerance, and the stated error
    covers the difference."""
    point = find_steady_motion(
        make_sdof(), DRIVE, Jenkins([stiffness], [0.8 / stiffness]), tolerance=tolerance
    )
    error = abs(point.amplitude([1.0]) / PEAKS[stiffness] - 1)
    assert error < max_error and error < point.error < tolerance


def test_always_work_of_drive_equals_losses():
    """The work of the base per cycle equals the viscous loss plus the area of the loop, within
    2e-4, from three independent sums."""
    modes, (k, w), drive = make_five_modes(), make_elements(), SineDrive(1.5, 1.0)
    point = find_steady_motion(modes, drive, Jenkins(k, w), harmonics=15)
    response = make_cycle_response(point, modes, drive, 2000)
    dt = drive.period / 2000
    base = (
        -modes.mass
        * dt
        * np.sum((response.modal_rate @ modes.base * drive.values(response.time))[:-1])
    )
    viscous = (
        modes.mass
        * dt
        * np.einsum(
            "ti,ij,tj->", response.modal_rate[:-1], modes.damping_matrix, response.modal_rate[:-1]
        )
    )
    slip = np.sum((response.force * response.slide_rate)[:-1]) * dt
    assert slip > 0.05 * base and base == pytest.approx(viscous + slip, rel=2e-4)
    energies = find_cycle_energies(point, modes)
    assert [energies[n] for n in ("work_in", "viscous", "friction")] == pytest.approx(
        [base, viscous, slip], rel=2e-4
    )
    assert energies["balance"] < 1e-9


def test_order_of_truncation_error():
    """The truncation error falls exponentially for a smooth law. For elements, where the harmonics
    of the slide fall like k^-4, it falls like H^-3 or faster."""
    modes = make_sdof(0.05)
    drive = SineDrive(1.0, 0.5)
    reference = find_steady_motion(modes, drive, Spring(0.5, 3.0), harmonics=41).amplitude([1.0])
    errors = [
        abs(
            find_steady_motion(modes, drive, Spring(0.5, 3.0), harmonics=h).amplitude([1.0])
            / reference
            - 1
        )
        for h in (3, 9, 15)
    ]
    assert errors[0] > 1e-4 and errors[1] < 1e-2 * errors[0] and errors[2] < 1e-2 * errors[1]
    balance = HarmonicBalance(modes, LawGroup(modes, Jenkins([2.0], [0.3])), 8192)

    def solve(h):
        """Return samples of the slide of a balance with h harmonics."""
        x = balance.solve(balance.solve_stuck(drive.omega, drive.acceleration, h), 0.5, 1.0)[0]
        return evaluate_series(balance.unpack_slides(x)[0], 1024)

    y = solve(255)
    errors = [np.abs(solve(h) - y).max() for h in (9, 19, 39, 79)]
    order = -np.polyfit(np.log([9, 19, 39, 79]), np.log(errors), 1)[0]
    assert 2.7 < order < 4.5


BALANCED = {  # Modes, drive, law, and tolerance of the truncation.
    "bonds": (make_sdof(0.05), SineDrive(1.0, 1.2), make_bond_law(0.8, 0.05), 1e-5),
    "speed": (make_sdof(0.05), SineDrive(1.0, 1.2), make_speed_law(0.4, 0.05), 1e-5),
    "interlock": (make_sdof(0.05), SineDrive(1.0, 1.2), Spring(1.0, wavelength=0.5), 1e-7),
    "rigid and undamped": (RIGID_AND_UNDAMPED, DRIVE, Jenkins([0.5, 3.0], [1e9, 0.4]), 1e-4),
    "five modes": (
        make_five_modes(),
        SineDrive(1.5, 1.2),
        parallel_element(*make_elements()),
        1e-4,
    ),
}


@pytest.mark.parametrize("name", BALANCED)
def test_exact_balance_satisfies_equation_of_motion(name):
    """Ten harmonics of the residual of the modal equations vanish to 1e-6 of the accelerations, all of them to 1e-2.

    The force is that of the law at each instant, of which the balance has a finite number of harmonics.
    """
    modes, drive, law, tolerance = BALANCED[name]
    point = find_steady_motion(modes, drive, law, tolerance=tolerance)
    response = make_cycle_response(point, modes, drive, 512)
    k = np.arange(point.modal.shape[0])[:, None]
    accelerations = evaluate_series((-((drive.omega * k) ** 2) * point.modal).T, 512).T
    springs = response.modal * modes.omega**2 + response.modal_rate @ modes.damping_matrix.T
    loads = np.outer(drive.values(response.time), modes.base)
    loads += np.outer(response.force, modes.slide) / modes.mass
    residual = (accelerations + (springs + loads)[:-1]) / np.abs(accelerations).max()
    assert np.abs(residual).max() < 1e-2
    assert np.abs(np.fft.rfft(residual, axis=0)[:10]).max() / 256 < 1e-6


# ---- refusals


def test_refuses_laws_that_cannot_be_balanced():
    """Rigid friction, bonds without a closed form and groups without a law or a motion are refused with a message."""
    modes = make_sdof()
    with pytest.raises(PatchfemError, match="rigid friction"):
        find_steady_motion(modes, DRIVE, Coulomb(1.0, 1.0).element(1.0))
    with pytest.raises(PatchfemError, match="a constant bond length"):
        find_steady_motion(modes, DRIVE, GROWING.element(1.0))
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
    drive = SineDrive(scale, float(modes.omega[modes.omega > 0].min()) * 0.9)
    slides = find_steady_motion(modes, drive, LawGroup(modes, laws), 9).slides
    np.testing.assert_allclose(
        slides[2], 2 * slides[0] + slides[1], rtol=0, atol=1e-11 * np.abs(slides).max()
    )


def test_refuses_motion_that_does_not_converge():
    """Newton's method raises an error if it does not converge in the given number of steps."""
    modes = make_sdof()
    balance = HarmonicBalance(modes, LawGroup(modes, Jenkins([10.0], [0.08])), 256)
    with pytest.raises(NotConverged, match="did not converge in"):
        balance.solve(np.full(15, 3.0), 1.0, 1.0, max_steps=2)


@pytest.mark.parametrize("harmonics", [64, 129, 150, 300])
def test_exact_given_number_of_harmonics_has_enough_samples(harmonics):
    """A balance with any number of harmonics is solved; the amplitude is that of 31 harmonics within the stated error."""
    modes, law = make_five_modes(), Jenkins(*make_elements())
    drive = SineDrive(1.5, 1.0)
    rough, fine = (find_steady_motion(modes, drive, law, harmonics=h) for h in (31, harmonics))
    amplitudes = [motion.amplitude(modes.output) for motion in (rough, fine)]
    assert fine.harmonics == harmonics
    assert amplitudes[1] == pytest.approx(amplitudes[0], rel=1e-3)
