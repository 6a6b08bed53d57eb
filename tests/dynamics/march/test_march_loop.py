"""The compiled loop where laws and modes meet: prescribed paths, marches and free decay against other computations."""

import numpy as np
import pytest
from friction_paths import random_walk, upper_pressure, walk
from march_paths import OMEGA, follow, one_mode
from modal_bases import basis_of
from scipy.integrate import solve_ivp

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics import bond_list_model, jenkins_model, points_model, start_run
from patchfem.dynamics.march.march import march
from patchfem.friction import Bonds, FirstOrderBonds, Quadrature
from patchfem.friction.bonds.recursion import advance_bonds
from patchfem.slip.shear_modes import shear_modes
from patchfem.structure import drives

GROWTH = {"ratio": 0.6, "rest_growth": 0.3, "slip_growth": 0.4, "rest_speed": 1e-2}


def half_plane(count, scale=1.0):
    """A symmetric positive definite tangential compliance (m, m) with the logarithm of a half plane, and places."""
    x = (np.arange(count) + 0.5) / count - 0.5
    gap = np.abs(x[:, None] - x)
    return scale * (np.log(2.5 / np.where(gap > 0, gap, 0.3 / count))), x


# ---- prescribed paths


@pytest.mark.parametrize("growth", [{}, GROWTH])
def test_exact_prescribed_path_of_points_is_the_recursion(growth):
    law = Bonds(0.4, 1.0, initial=0.7, **growth)
    area = np.array([0.5, 1.0, 0.25])
    sigma = np.array([2.0, 1.0, 3.0])
    path = random_walk(2, 80, 0.6)
    forces, energies, bad, _ = follow(points_model(law, area, sigma), path)
    run = walk(FirstOrderBonds(law), path, upper_pressure(sigma), 0.3)
    assert bad == 0
    assert forces[1:, 0] == pytest.approx(run.traction @ area, abs=1e-12)
    assert forces[:-1, 1] == pytest.approx(run.mean @ area, abs=1e-12)
    assert energies[:-1, 0] == pytest.approx(run.dissipated @ area, abs=1e-12)
    assert energies[1:, 1] == pytest.approx(run.stored @ area, abs=1e-12)


@pytest.mark.share(0)
@pytest.mark.parametrize("order", [0.0, 1.0])
def test_exact_prescribed_path_of_a_list_is_the_quadrature(order):
    law = Bonds(0.4, 1.0, order, "report", initial=0.0)
    path = random_walk(2, 40, 0.6)
    forces, _, _, _ = follow(bond_list_model(law, 0.4 * 3.0, 1e9, 0.0), path)
    run = walk(Quadrature(law, tail=0.0), path, upper_pressure([3.0]), 0.3)
    assert forces[1:, 0] == pytest.approx(run.traction[:, 0], abs=1e-10)
    fine = np.interp(np.linspace(0, 40, 321), np.arange(41), path)
    means = (
        walk(Quadrature(law, tail=0.0), fine, upper_pressure([3.0]), 0.3 / 8)
        .mean.reshape(40, 8)
        .mean(axis=1)
    )
    # where a bond's sign turns inside a step
    assert forces[:-1, 1] == pytest.approx(means, abs=1e-2)
    assert np.median(np.abs(forces[:-1, 1] - means)) < 1e-3


def dense_steps(law, compliance, area, sigma, path):
    """The same step without modes: nodal deflections d with (d_0 + d_1)/2 = C f, f the step-mean nodal forces."""
    m = area.size
    bonds = np.stack([law.initial * sigma, np.zeros(m), np.zeros(m)])
    d = np.zeros(m)
    weight = law.static * area / law.length
    rows = []
    for dq in np.diff(path):
        new = d.copy()
        for _ in range(80):
            _, mean, slope, _ = advance_bonds(bonds, dq - (new - d), sigma, law.length)
            miss = (d + new) / 2 - compliance @ (weight * mean)
            if np.abs(miss).max() < 1e-15:
                break
            change = np.linalg.solve(np.eye(m) / 2 + compliance * (weight * slope), miss)
            part = 1.0
            while part > 1e-6:
                trial = new - part * change
                other = advance_bonds(bonds, dq - (trial - d), sigma, law.length)[1]
                if (
                    np.abs((d + trial) / 2 - compliance @ (weight * other)).max()
                    < np.abs(miss).max()
                ):
                    break
                part /= 2
            new = new - part * change
        bonds, mean, _, dissipated = advance_bonds(bonds, dq - (new - d), sigma, law.length)
        d = new
        rows.append((weight @ mean, weight @ bonds[1], weight @ dissipated / 2))
    return np.array(rows), d


@pytest.mark.parametrize("stiffness, step", [(0.05, 0.8), (1.0, 0.8), (1.0, 0.2)])
def test_exact_shear_modes_are_the_full_tangential_compliance(stiffness, step):
    """All modes of D^1/2 C D^1/2 against a dense Newton on nodal deflections; slide steps up to two bond lengths, and
    up to half of one, where all points take the way without a branch."""
    law = Bonds(0.4, 1.0)
    compliance, x = half_plane(24, stiffness)
    area = np.full(24, 1 / 24)
    sigma = 1 + 0.8 * x
    modes = shear_modes(compliance, law.static * area * sigma, law.length, 24)
    path = random_walk(11, 60, step)
    forces, energies, bad, contact = follow(points_model(law, area, sigma, modes), path)
    want, deflection = dense_steps(law, compliance, area, sigma, path)
    assert bad == 0
    assert forces[:-1, 1] == pytest.approx(want[:, 0], abs=1e-10)
    assert forces[1:, 0] == pytest.approx(want[:, 1], abs=1e-9)
    assert energies[:-1, 0] == pytest.approx(want[:, 2], abs=1e-9)
    assert contact.b @ contact.psi[:, :24] == pytest.approx(deflection, abs=1e-9)
    # what fills up the lanes moves nothing
    assert not contact.psi[:, 24:].any() and not contact.weight[24:].any()


@pytest.mark.parametrize("size", [3.0, 30.0])
def test_exact_points_that_drag_move_as_their_bonds_say(size):
    """A march whose steps drag in closed form, beside the same steps by the solve of all points: gross slip of many
    bond lengths a step, and a few."""
    law, compliance, x = Bonds(0.4, 1e-6), *half_plane(24, 1e-10)
    area = np.full(24, 1 / 24)
    sigma = 50 * (1 + 0.8 * x)
    model = points_model(
        law, area, sigma, shear_modes(compliance, law.static * area * sigma, law.length, 8)
    )
    modes = one_mode(OMEGA, 0.05, 1.0)
    drive = SineDrive(size * 9.80665, OMEGA)
    quick, plain = (start_run(modes, drive, model, 200) for _ in range(2))
    rows = quick.march_cycle(600, 0, [])[1]
    dragged = 0
    every = []
    for _ in range(600):
        plain.contact.flow[0] = 0.0
        every.append(plain.march_cycle(1, 0, [])[1][0])
        dragged += plain.contact.flow[0] != 0.0
    assert dragged > 100 and quick.ledger[5] < plain.ledger[5] - dragged / 2
    scale = np.abs(rows).max(axis=0)
    np.testing.assert_allclose(
        rows[:-1, :6] / scale[:6], np.array(every)[:, :6] / scale[:6], atol=2e-9
    )
    assert quick.ledger[[0, 1, 3, 8]] == pytest.approx(plain.ledger[[0, 1, 3, 8]], rel=1e-9)


# ---- marches


@pytest.mark.parametrize(
    "growth",
    [{}, {"ratio": 0.7, "rest_growth": 10.0, "slip_growth": 0.2e-6, "rest_speed": 1e-3}],
    ids=["constant length", "growing length"],
)
def test_order_of_the_march_against_integrated_bonds(growth):
    """143 Hz, damping 0.003, 1 kg, 39 N, bond length 1 um and 5 g: the rate equations by LSODA; order two."""
    length = 1e-6
    limit = 0.4 * 98.0665
    drive = 5 * 9.80665
    law = Bonds(0.4, length, **growth)

    def rhs(t, y):
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
    run = solve_ivp(
        rhs,
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
        got = march(
            one_mode(OMEGA, 0.003, 1.0),
            SineDrive(drive, OMEGA),
            points_model(law, [1e-4], [98.0665e4]),
            2,
            steps,
            window=2,
        )
        errors.append(
            [
                np.abs(got.window.slide[:: steps // 50] - run.y[0]).max() / length,
                np.abs(got.window.force[:: steps // 50] / limit - run.y[2]).max(),
            ]
        )
    assert (run.y[3].min() < 0.701 * length) == bool(growth) and np.ptp(run.y[0]) > 5e-6
    slides, forces = np.array(errors).T
    assert slides[0] > slides[1] > slides[2] and slides[2] < 1e-4 and (growth or forces[2] < 2e-5)
    assert np.log2(slides[0] / slides[2]) / 6 == pytest.approx(2, abs=0.15)
    assert growth or np.log2(forces[0] / forces[2]) / 6 == pytest.approx(2, abs=0.1)


@pytest.mark.share(0)
@pytest.mark.parametrize("stiffness, want", [(10, 0.249538145), (100, 0.285786312)])
def test_order_and_steady_amplitude_of_a_jenkins_oscillator(stiffness, want):
    """Unit oscillator, damping 0.003, at resonance, limit 0.8 of the drive: steady peaks known from DOP853.

    The step in which an element yields falls where it likes, so single halvings scatter about order two.
    """
    rows = []
    for steps in (400, 3200, 6400):
        got = march(
            one_mode(1.0, 0.003, 1.0),
            SineDrive(1.0, 1.0),
            jenkins_model([stiffness], [0.8 / stiffness]),
            80,
            steps,
            window=2,
        )
        low, high = got.amplitudes[-1]
        rows.append((high - low) / 2)
    errors = np.abs(np.array(rows) - want)
    assert np.log2(errors[0] / errors[2]) / 4 == pytest.approx(2, abs=0.2) and errors[2] < 3e-6
    assert rows[2] + (rows[2] - rows[1]) / 3 == pytest.approx(want, abs=2e-7)


def test_always_a_stiff_element_takes_one_evaluation_a_step():
    """Newton's method across its kinks took up to 30 where the element is far stiffer than the structure."""
    model = jenkins_model([1e6 * OMEGA**2], [40.0 / (1e6 * OMEGA**2)])
    done = march(one_mode(OMEGA, 0.003, 1.0), SineDrive(50.0, OMEGA), model, 4, 200)
    assert (
        done.ledger["iterations"] == 800
        and done.ledger["worst_iterations"] == 1
        and not done.message
    )
    assert done.ledger["friction"] > 0


def test_exact_march_with_a_pressure_on_the_lower_piece_replayed():
    """The marched slide, walked again by the NumPy law under the shifted pattern, gives the marched force."""
    law = Bonds(0.4, 2e-6)
    x = np.linspace(-30e-6, 30e-6, 61)
    sigma = 1e6 * np.maximum(0.0, 0.3 + np.sin(x / 4e-6))
    area = np.full(61, 1e-4 / 61)
    limit = 0.4 * area @ sigma
    got = march(
        one_mode(OMEGA, 0.01, 1.0),
        SineDrive(1.5 * limit, OMEGA),
        points_model(law, area, sigma, pattern=(x, sigma)),
        2,
        100,
        window=2,
    )
    path = got.window.slide
    run = walk(
        FirstOrderBonds(law), path, lambda q: np.interp(x + q, x, sigma, left=0.0, right=0.0)
    )
    assert np.ptp(path) > 5e-6 and (run.traction == 0).any()
    assert got.window.force[1:] == pytest.approx(run.traction @ area, abs=1e-9 * limit)


def test_hard_a_step_whose_place_and_pressure_disagree_is_booked():
    """Steps longer than the waves of the pressure: where the new bonds' pressure and the slide do not settle, it is
    said; steps that follow the waves settle all."""
    x = np.linspace(-30e-6, 30e-6, 1201)
    sigma = 1e6 * np.maximum(0.0, 0.3 + np.sin(x / 1e-6))
    area = np.full(1201, 1e-4 / 1201)
    drive = SineDrive(1.5 * 0.4 * area @ sigma, OMEGA)
    coarse, fine = (
        march(
            one_mode(OMEGA, 0.01, 1.0),
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


@pytest.mark.parametrize("cycles, travel", [(40.3, np.inf), (3, np.inf), (40, 0.8)])
def test_exact_a_run_without_histories_has_the_same_last_cycles(cycles, travel):
    """Long pieces of which nothing is kept, also where the flexure's stop at a share of the way ends one of them."""
    model = jenkins_model([2e5, 1e5], [1e-6, 2e-6])
    drive = SineDrive(49.0, OMEGA)
    if np.isfinite(travel):  # of the amplitude that the run would reach
        travel *= march(one_mode(OMEGA, 0.003, 1.0), drive, model, cycles, 40, 2).amplitudes.max()
    one, other = (
        march(one_mode(OMEGA, 0.003, 1.0), drive, model, cycles, 40, 2, travel, keeps_samples=whole)
        for whole in (True, False)
    )
    assert one.outcome is other.outcome is (Outcome.EXCEEDS_TRAVEL if np.isfinite(travel) else None)
    assert (10 < one.cycles_done < 40) or not np.isfinite(travel)
    assert one.cycles_done == other.cycles_done
    for name in ("time", "slide", "force", "output", "acceleration"):
        assert np.array_equal(getattr(one.window, name), getattr(other.window, name))
    assert np.array_equal(one.step_force, other.step_force)
    assert np.array_equal(one.amplitudes[-2:], other.amplitudes[-2:])
    assert other.window_work == pytest.approx(one.window_work, rel=1e-12)
    assert other.ledger == pytest.approx(one.ledger, rel=1e-12)
    assert other.response.extra["ledger"][:, -1] == pytest.approx(
        one.response.extra["ledger"][:, -1], rel=1e-12
    )


# ---- free decay


@pytest.mark.parametrize("steps_per_cycle", [20, 7])
@pytest.mark.parametrize("shear", [True, False])
def test_always_free_decay_never_gains_energy(shear, steps_per_cycle):
    """Six modes, of which the fastest turns within a step, on forty points with and without shear modes."""
    law = Bonds(0.4, 2e-6)
    area, (compliance, x) = np.full(40, 1e-4 / 40), half_plane(40, 1e-8)
    sigma = 98.1e4 * (1 + 1.6 * x)
    modes = shear_modes(compliance, law.static * area * sigma, law.length, 10) if shear else None
    omega = OMEGA * np.array([1.0, 1.7, 3.1, 5.3, 8.9, 14.2])
    slide = np.array([1.0, -0.6, 0.5, 0.4, -0.3, 0.2])
    basis = basis_of(omega, 0.0, slide)
    start = InitialState(1e-4 * np.array([1.0, -0.3, 0.1, 0.02, -0.01, 0.005]), np.zeros(6))
    done = march(
        basis,
        drives.make_release(1 / 143),
        points_model(law, area, sigma, modes),
        15,
        steps_per_cycle,
        15,
        start=start,
    )
    r = done.response
    _, held, lost, created = r.extra["ledger"]
    energy = 0.5 * basis.mass * np.sum(r.modal_rate**2 + (omega * r.modal) ** 2, axis=1) + held
    assert done.outcome is None and created[-1] == 0.0
    assert np.diff(energy).max() <= 1e-8 * energy[0]
    assert energy[0] - energy[-1] == pytest.approx(lost[-1], rel=1e-8)
    assert energy[-1] < 0.5 * energy[0]
