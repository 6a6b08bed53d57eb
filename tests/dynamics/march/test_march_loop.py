"""The compiled march: prescribed paths, forced motion and free decay against other computations."""

import numpy as np
import pytest
from bond_moments import advance_bonds
from friction_paths import march_path, random_walk, upper_pressure
from march_paths import OMEGA, follow_path, make_one_mode
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics import jenkins_model, points_model, start_run
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, FirstOrderBonds
from patchfem.slip.shear_modes import shear_modes
from patchfem.structure import drives

GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


def half_plane_compliance(count, scale=1.0):
    """Return a tangential compliance (m, m) with the logarithm of a half-plane, and the positions
    (m,)."""
    x = (np.arange(count) + 0.5) / count - 0.5
    gap = np.abs(x[:, None] - x)
    return scale * (np.log(2.5 / np.where(gap > 0, gap, 0.3 / count))), x


# ---- prescribed paths


@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_points_on_path_agree_with_recursion(growth):
    """Forces and energies of points along a prescribed path agree with the NumPy recursion within
    1e-12."""
    law = Bonds(0.4, 1.0, initial=0.7, **growth)
    area = np.array([0.5, 1.0, 0.25])
    sigma = np.array([2.0, 1.0, 3.0])
    path = random_walk(2, 80, 0.6)
    forces, energies, failed, _ = follow_path(points_model(law, area, sigma), path)
    run = march_path(FirstOrderBonds(law), path, upper_pressure(sigma), 0.3)
    assert failed == 0
    assert forces[1:, 0] == pytest.approx(run.traction @ area, abs=1e-12)
    assert forces[:-1, 1] == pytest.approx(run.mean @ area, abs=1e-12)
    assert energies[:-1, 0] == pytest.approx(run.dissipated @ area, abs=1e-12)
    assert energies[1:, 1] == pytest.approx(run.stored @ area, abs=1e-12)


def march_nodal_deflections(law, compliance, area, sigma, path):
    """Return the forces and losses of each step and the final deflections, without shear modes.

    The nodal deflections satisfy (d_0 + d_1)/2 = C f, where f are the mean nodal forces of a step.
    """
    m = area.size
    bonds = np.stack([law.initial * sigma, np.zeros(m), np.zeros(m)])
    d = np.zeros(m)
    weight = law.static * area / law.length
    results = []
    for dq in np.diff(path):
        end = d.copy()
        for _ in range(80):
            _, mean, slope, _ = advance_bonds(bonds, dq - (end - d), sigma, law.length)
            residual = (d + end) / 2 - compliance @ (weight * mean)
            if np.abs(residual).max() < 1e-15:
                break
            change = np.linalg.solve(np.eye(m) / 2 + compliance * (weight * slope), residual)
            fraction = 1.0
            while fraction > 1e-6:
                trial = end - fraction * change
                trial_mean = advance_bonds(bonds, dq - (trial - d), sigma, law.length)[1]
                if (
                    np.abs((d + trial) / 2 - compliance @ (weight * trial_mean)).max()
                    < np.abs(residual).max()
                ):
                    break
                fraction /= 2
            end = end - fraction * change
        bonds, mean, _, dissipated = advance_bonds(bonds, dq - (end - d), sigma, law.length)
        d = end
        results.append((weight @ mean, weight @ bonds[1], weight @ dissipated / 2))
    return np.array(results), d


@pytest.mark.parametrize("stiffness, step", [(1.0, 0.8), (1.0, 0.2)])
def test_exact_shear_modes_agree_with_nodal_deflections(stiffness, step):
    """With all shear modes forces and losses agree within 1e-9 with Newton's method for the nodal
    deflections. The steps are up to two bond lengths long, or up to half of one, where all points
    use the code without branches."""
    law = Bonds(0.4, 1.0)
    compliance, x = half_plane_compliance(24, stiffness)
    area = np.full(24, 1 / 24)
    sigma = 1 + 0.8 * x
    modes = shear_modes(compliance, law.static * area * sigma, law.length, 24)
    path = random_walk(11, 60, step)
    forces, energies, failed, contact = follow_path(points_model(law, area, sigma, modes), path)
    expected, deflection = march_nodal_deflections(law, compliance, area, sigma, path)
    assert failed == 0
    assert forces[:-1, 1] == pytest.approx(expected[:, 0], abs=1e-10)
    assert forces[1:, 0] == pytest.approx(expected[:, 1], abs=1e-9)
    assert energies[:-1, 0] == pytest.approx(expected[:, 2], abs=1e-9)
    assert contact.b @ contact.psi[:, :24] == pytest.approx(deflection, abs=1e-9)
    # the padding of the lanes has no effect
    assert not contact.psi[:, 24:].any() and not contact.weight[24:].any()


@pytest.mark.parametrize("level", [30.0])
def test_exact_gross_slip_in_closed_form_agrees_with_iteration(level):
    """Steps of gross slip that use a closed form agree within 2e-9 with steps that solve for all
    points."""
    law, compliance, x = Bonds(0.4, 1e-6), *half_plane_compliance(24, 1e-10)
    area = np.full(24, 1 / 24)
    sigma = 50 * (1 + 0.8 * x)
    model = points_model(
        law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, 8)
    )
    modes = make_one_mode(OMEGA, 0.05, 1.0)
    drive = SineDrive(level * 9.80665, OMEGA)
    fast, general = (start_run(modes, drive, model, 200) for _ in range(2))
    rows = fast.march_cycle(600, 0, [])[1]
    n_closed_form = 0
    expected = []
    for _ in range(600):
        general.contact.slip_state[0] = 0.0
        expected.append(general.march_cycle(1, 0, [])[1][0])
        n_closed_form += general.contact.slip_state[0] != 0.0
    assert n_closed_form > 100 and fast.ledger[5] < general.ledger[5] - n_closed_form / 2
    scale = np.abs(rows).max(axis=0)
    np.testing.assert_allclose(
        rows[:-1, :6] / scale[:6], np.array(expected)[:, :6] / scale[:6], atol=2e-9
    )
    assert fast.ledger[[0, 1, 3, 8]] == pytest.approx(general.ledger[[0, 1, 3, 8]], rel=1e-9)


# ---- forced motion


@pytest.mark.parametrize(
    "growth",
    [{}, {"ratio": 0.7, "rest_growth": 10.0, "slip_growth": 0.2e-6, "rest_speed": 1e-3}],
    ids=["constant length", "growing length"],
)
def test_order_two_against_integrated_rate_equations(growth):
    """Slide and force of bonds of constant or growing length converge with order two to a solution
    of the rate equations by LSODA. The rig has 143 Hz, damping 0.003, 1 kg, 39 N, a bond length of
    1 um and a drive of 5 g."""
    length = 1e-6
    limit = 0.4 * 98.0665
    drive = 5 * 9.80665
    law = Bonds(0.4, length, **growth)

    def state_derivative(t, y):
        q, v, z, eps = y
        grows = 0.0
        if growth:
            grows = 10.0 / max(abs(v), 1e-3) * (length - eps) + abs(v) / 0.2e-6 * (
                0.7 * length - eps
            )
        return [
            v,
            -2 * 0.003 * OMEGA * v - OMEGA**2 * q - drive * np.sin(OMEGA * t) - limit * z,
            v / length - abs(v) * z / eps,
            grows,
        ]

    times = np.arange(2 * 50 + 1) / 50 / 143
    reference = solve_ivp(
        state_derivative,
        (0, times[-1]),
        [0.0, 0.0, 0.0, length],
        method="LSODA",
        rtol=1e-10,
        atol=[1e-16, 1e-13, 1e-11, 1e-17],
        t_eval=times,
        max_step=1 / 143 / 800,
    )
    errors = []
    for steps in (100, 800, 6400):
        result = march(
            make_one_mode(OMEGA, 0.003, 1.0),
            SineDrive(drive, OMEGA),
            points_model(law, [1e-4], [98.0665e4]),
            2,
            steps,
            window=2,
        )
        errors.append(
            [
                np.abs(result.window.slide[:: steps // 50] - reference.y[0]).max() / length,
                np.abs(result.window.force[:: steps // 50] / limit - reference.y[2]).max(),
            ]
        )
    assert (reference.y[3].min() < 0.701 * length) == bool(growth) and np.ptp(reference.y[0]) > 5e-6
    slides, forces = np.array(errors).T
    assert slides[0] > slides[1] > slides[2] and slides[2] < 1e-4 and (growth or forces[2] < 2e-5)
    assert np.log2(slides[0] / slides[2]) / 6 == pytest.approx(2, abs=0.15)
    assert growth or np.log2(forces[0] / forces[2]) / 6 == pytest.approx(2, abs=0.1)


def test_exact_march_under_moving_pressure_agrees_with_numpy_law():
    """The NumPy law along the computed slide, under the pressure that moves with the lower body,
    gives the force of the march within 1e-9."""
    law = Bonds(0.4, 2e-6)
    x = np.linspace(-30e-6, 30e-6, 61)
    sigma = 1e6 * np.maximum(0.0, 0.3 + np.sin(x / 4e-6))
    area = np.full(61, 1e-4 / 61)
    limit = 0.4 * area @ sigma
    result = march(
        make_one_mode(OMEGA, 0.01, 1.0),
        SineDrive(1.5 * limit, OMEGA),
        points_model(law, area, sigma, pattern=(x, sigma)),
        2,
        100,
        window=2,
    )
    path = result.window.slide
    run = march_path(
        FirstOrderBonds(law), path, lambda q: np.interp(x + q, x, sigma, left=0.0, right=0.0)
    )
    assert np.ptp(path) > 5e-6 and (run.traction == 0).any()
    assert result.window.force[1:] == pytest.approx(run.traction @ area, abs=1e-9 * limit)


def test_always_unresolved_pressure_waves_are_reported():
    """Steps longer than the waves of the pressure give the outcome NOT_CONVERGED with a message;
    shorter steps converge."""
    x = np.linspace(-30e-6, 30e-6, 1201)
    sigma = 1e6 * np.maximum(0.0, 0.3 + np.sin(x / 1e-6))
    area = np.full(1201, 1e-4 / 1201)
    drive = SineDrive(1.5 * 0.4 * area @ sigma, OMEGA)
    coarse, fine = (
        march(
            make_one_mode(OMEGA, 0.01, 1.0),
            drive,
            points_model(Bonds(0.4, 2e-6), area, sigma, pattern=(x, sigma)),
            2,
            steps,
            window=2,
        )
        for steps in (12, 100)
    )
    assert (
        coarse.outcome is Outcome.NOT_CONVERGED
        and "time steps have an error of the friction" in coarse.message
    )
    assert fine.outcome is None and fine.message == ""


@pytest.mark.parametrize("cycles, travel", [(40.3, np.inf), (40, 0.8)])
def test_exact_last_cycles_are_the_same_without_histories(cycles, travel):
    """A march that keeps no histories has the same last cycles, amplitudes and energies, also if it
    ends at the travel limit."""
    model = jenkins_model([2e5, 1e5], [1e-6, 2e-6])
    drive = SineDrive(49.0, OMEGA)
    if np.isfinite(travel):  # the travel is given as a fraction of the amplitude
        travel *= march(
            make_one_mode(OMEGA, 0.003, 1.0), drive, model, cycles, 40, 2
        ).extremes.max()
    complete, condensed = (
        march(
            make_one_mode(OMEGA, 0.003, 1.0),
            drive,
            model,
            cycles,
            40,
            2,
            travel,
            keeps_samples=keep,
        )
        for keep in (True, False)
    )
    assert (
        complete.outcome
        is condensed.outcome
        is (Outcome.EXCEEDS_TRAVEL if np.isfinite(travel) else None)
    )
    assert (10 < complete.cycles_done < 40) or not np.isfinite(travel)
    assert complete.cycles_done == condensed.cycles_done
    for name in ("time", "slide", "force", "output", "acceleration"):
        assert np.array_equal(getattr(complete.window, name), getattr(condensed.window, name))
    assert np.array_equal(complete.step_force, condensed.step_force)
    assert np.array_equal(complete.extremes[-2:], condensed.extremes[-2:])
    assert condensed.window_work == pytest.approx(complete.window_work, rel=1e-12)
    assert condensed.ledger == pytest.approx(complete.ledger, rel=1e-12)
    assert condensed.response.extra["ledger"][:, -1] == pytest.approx(
        complete.response.extra["ledger"][:, -1], rel=1e-12
    )


# ---- free decay


@pytest.mark.parametrize("steps_per_cycle", [7])
@pytest.mark.parametrize("shear", [True, False])
def test_always_energy_falls_in_free_decay(shear, steps_per_cycle):
    """In a free decay of six modes the energy never rises, and its loss equals the dissipation
    within 1e-8. The period of the fastest mode is shorter than a step."""
    law = Bonds(0.4, 2e-6)
    area, (compliance, x) = np.full(40, 1e-4 / 40), half_plane_compliance(40, 1e-8)
    sigma = 98.1e4 * (1 + 1.6 * x)
    modes = shear_modes(compliance, law.static * area * sigma, law.length, 10) if shear else None
    omega = OMEGA * np.array([1.0, 1.7, 3.1, 5.3, 8.9, 14.2])
    slide = np.array([1.0, -0.6, 0.5, 0.4, -0.3, 0.2])
    basis = make_modal_basis(omega, 0.0, slide)
    start = InitialState(1e-4 * np.array([1.0, -0.3, 0.1, 0.02, -0.01, 0.005]), np.zeros(6))
    result = march(
        basis,
        drives.make_release(1 / 143),
        points_model(law, area, sigma, modes),
        15,
        steps_per_cycle,
        15,
        start=start,
    )
    response = result.response
    _, stored, dissipated, created = response.extra["ledger"]
    energy = (
        0.5 * basis.mass * np.sum(response.modal_rate**2 + (omega * response.modal) ** 2, axis=1)
        + stored
    )
    assert result.outcome is None and created[-1] == 0.0
    assert np.diff(energy).max() <= 1e-8 * energy[0]
    assert energy[0] - energy[-1] == pytest.approx(dissipated[-1], rel=1e-8)
    assert energy[-1] < 0.5 * energy[0]
