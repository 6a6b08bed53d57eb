"""Grooves that the load climbs in a march: a pendulum, an independent DOP853 with events, limits of the law, energy."""

import numpy as np
import pytest
from event_run import simulate
from grooves_reference import case_of, flank, forces, run
from modal_bases import basis_of
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from patchfem.core import InitialState, Outcome, PatchfemError, SineDrive
from patchfem.dynamics import start_run
from patchfem.dynamics.grooves.run import make_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Grooves
from patchfem.response import energy_balance
from patchfem.structure.drives import make_levels, make_step


def modes(omega, zeta=0.0, mass=1.0):
    return basis_of(omega, zeta, mass=mass)


def marched(case, cycles: int, steps: int):
    basis = modes(case.omega, case.zeta, case.mass)
    grooves = Grooves(case.wavelength, case.amplitude, case.phase, case.lifted)
    model = make_model(grooves, case.load, case.static, case.kinetic, None, basis)
    return march(
        basis, SineDrive(case.acceleration, case.drive), model, cycles, steps, window=cycles
    )


@pytest.mark.parametrize("angle", [1e-3, 1.0, 3.0])
def test_exact_without_friction_it_is_a_pendulum(angle):
    """A mass in a cosine valley, released at the angle k q: period 4 K(sin^2(angle/2))/w, small motions w^2 = N k^2
    A/m."""
    grooves = Grooves(80e-6, 7.5e-6)
    basis = modes(0.0, mass=1.2)
    place = angle / grooves.wave_number
    period = 4 * ellipk(np.sin(angle / 2) ** 2) / np.sqrt(grooves.stiffness(115.0) / 1.2)
    done = march(
        basis,
        SineDrive(0.0, 2 * np.pi / period),
        make_model(grooves, 115.0, 0.0, 0.0, None, basis),
        3,
        50,
        start=InitialState(np.array([place]), np.zeros(1)),
    )
    assert done.response.slide[-1] == pytest.approx(place, rel=1e-9)
    assert done.response.slide[-26] == pytest.approx(-place, rel=1e-9)  # half a period before
    assert energy_balance(done.ledger) < 1e-9


@pytest.mark.share(0, 2)
@pytest.mark.parametrize(
    "seed", [3, 10, 11, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 4, 5, 7, 8, 12, 13))]
)
def test_exact_a_rig_by_newtons_laws_and_dop853(seed):
    """Slide, speed, force, friction's loss and the drive's work of random cases, by an independent derivation.

    The tenth runs over more than six waves.
    """
    case = case_of(seed)
    done = marched(case, 4, 50)
    seen = done.response
    true, lifted = run(case, seen.time[-1], seen.time)
    assert (
        lifted == np.inf
        and done.outcome is None
        and np.ptp(true[:, 0]) > (5 * case.wavelength if seed == 10 else 0)
    )
    for k, column in enumerate((seen.slide, seen.slide_rate)):
        np.testing.assert_allclose(column, true[:, k], rtol=0, atol=1e-7 * np.abs(true[:, k]).max())
    moves = np.abs(true[:, 1]) > 1e-3 * np.abs(true[:, 1]).max()
    force = [
        forces(case, t, q, v, np.sign(v), case.kinetic)[2]
        for t, (q, v) in zip(seen.time, true[:, :2])
    ]
    np.testing.assert_allclose(
        seen.force[moves], np.array(force)[moves], rtol=0, atol=1e-7 * np.abs(force).max()
    )
    # of the start, which counts as work in
    height = case.load * case.amplitude * (1 - np.cos(case.phase))
    assert done.ledger["friction"] == pytest.approx(true[-1, 2], rel=1e-7)
    assert done.ledger["work_in"] - height == pytest.approx(true[-1, 3], rel=1e-7)
    assert energy_balance(done.ledger) < 1e-9


@pytest.mark.parametrize("seed", [3, 13])
def test_exact_the_vertical_force_and_the_work_against_the_load_by_dop853(seed):
    case = case_of(seed)
    done = marched(case, 4, 50)
    seen = done.response
    true, _ = run(case, seen.time[-1], seen.time)
    moves = np.abs(true[:, 1]) > 1e-3 * np.abs(true[:, 1]).max()
    assert case.lifted > 0
    across = [
        forces(case, t, q, v, np.sign(v), case.kinetic)[1]
        for t, (q, v) in zip(seen.time, true[:, :2])
    ]
    # of the normal force, what stands upwards
    part = [
        np.cos(a) - np.sign(v) * case.kinetic * np.sin(a)
        for a, v in zip(np.arctan([flank(case, q)[0] for q in true[:, 0]]), true[:, 1])
    ]
    np.testing.assert_allclose(
        seen.extra["normal_load"][moves], (np.array(across) * part)[moves], rtol=1e-6
    )
    begin = case.load * case.amplitude * (1 - np.cos(case.phase))
    modal = 0.5 * case.mass * (true[-1, 1] ** 2 + case.omega**2 * true[-1, 0] ** 2)
    rises = 0.5 * case.lifted * (flank(case, true[-1, 0])[0] * true[-1, 1]) ** 2
    assert done.ledger["stored"] == pytest.approx(begin + true[-1, 4] + modal + rises, rel=1e-6)


@pytest.mark.parametrize("place", [0.0, 0.1, -0.2, 0.45])
def test_exact_it_breaks_away_at_the_limits_of_the_flank(place):
    """At rest F lies between N (t - mu)/(1 + mu t) and N (t + mu)/(1 - mu t): a push just below either holds for ever,
    one just beyond moves."""
    grooves = Grooves(80e-6, 5e-6)
    basis = modes(0.0)
    load = 100.0
    mu = 0.3
    q = place * 80e-6
    t = flank(case_of(0)._replace(wavelength=80e-6, amplitude=5e-6, phase=0.0), q)[0]
    for way, limit in ((1, load * (t + mu) / (1 - mu * t)), (-1, load * (t - mu) / (1 + mu * t))):
        for share, moves in ((-1e-6, False), (1e-6, True)):
            push = limit + way * share * load
            model = make_model(grooves, load, mu, mu, None, basis)
            done = march(
                basis,
                make_step(-push, 0.01),
                model,
                1,
                20,
                start=InitialState(np.array([q]), np.zeros(1)),
            )
            assert (done.response.slide[-1] != q) == moves
            assert moves or done.response.force[-1] == pytest.approx(push, rel=1e-9, abs=1e-9)


def test_refuses_a_lifted_mass_that_takes_the_whole_inertia():
    with pytest.raises(PatchfemError, match=r"must be below [\d.]+ kg"):
        make_model(Grooves(80e-6, 8e-6, 0.0, 100.0), 100.0, 0.6, 0.6, None, modes(900.0))


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 6, 9))])
def test_exact_a_lifted_mass_leaves_the_grooves_when_dop853_says(seed):
    """The vertical force falls to zero: the run says so at the sample that follows."""
    case = case_of(seed)
    done = marched(case, 4, 50)
    assert done.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in done.message
    time = done.response.time
    step = 2 * np.pi / case.drive / 50
    lifted = run(case, time[-1] + step, time)[1]
    assert -1e-6 * step < time[-1] - lifted < step


@pytest.mark.parametrize(("frequency", "stays", "leaves"), [(143, 7.75, 8.0), (135, 8.0, 8.25)])
def test_always_a_rig_of_80_um_grooves_runs_away_from_rest_at_8_g(frequency, stays, leaves):
    """26 lbf, mu = .4, slip from 4.2 g, flanks of slope .51 on 80 um that lift the moving mass, yaw at 129 Hz of share
    .0932: beyond 2 mil from rest at 8.0 g and 143 Hz, 8.25 g and 135 Hz, where the rig of the report was unstable."""
    load = 115.65
    g = 9.80665
    mass = 0.4 * load / (4.2 * g)
    basis = basis_of(
        2 * np.pi * np.array([143.0, 129.0]),
        0.003,
        [1.0, 0.0932],
        [1.0, 0.0],
        [1.0, 0.0],
        mass=mass,
    )
    model = make_model(
        Grooves(80e-6, 0.51 * 80e-6 / (2 * np.pi), 0.0, mass), load, 0.4, 0.4, None, basis
    )
    for level, outcome in ((stays, None), (leaves, Outcome.EXCEEDS_TRAVEL)):
        done = march(
            basis, SineDrive(level * g, 2 * np.pi * frequency), model, 200, 50, travel=50.8e-6
        )
        assert done.outcome is outcome
        assert energy_balance(done.ledger) < 1e-9


@pytest.mark.parametrize("lifted", [0.0, 0.4])
def test_exact_a_force_that_follows_the_speed_along_the_flank(lifted):
    """phi = mu tanh(sqrt(1 + t^2) v/v_0), by Newton's laws and DOP853."""
    case = case_of(3)._replace(lifted=lifted)
    speed = 5e-3
    basis = modes(case.omega, case.zeta, case.mass)
    end = 3 * 2 * np.pi / case.drive
    grooves = Grooves(case.wavelength, case.amplitude, case.phase, case.lifted)
    done = march(
        basis,
        SineDrive(case.acceleration, case.drive),
        make_model(grooves, case.load, case.static, case.static, speed, basis),
        3,
        100,
    )

    def slopes(t, x):
        part = case.static * np.tanh(np.hypot(1, flank(case, x[0])[0]) * x[1] / speed)
        return [x[1], forces(case, t, x[0], x[1], 1.0, part)[0]]

    true = solve_ivp(slopes, (0, end), [0.0, 0.0], "DOP853", rtol=1e-11, atol=[1e-16, 1e-13]).y[
        :, -1
    ]
    assert done.response.slide[-1] == pytest.approx(true[0], rel=1e-7)
    assert done.response.slide_rate[-1] == pytest.approx(true[1], rel=1e-6)
    assert energy_balance(done.ledger) < 1e-9


def test_always_a_fork_goes_on_as_the_march_does():
    """A copy of a march goes on under the same drive to the last digit, and a jump of levels is met."""
    case = case_of(3)
    basis = modes(case.omega, case.zeta, case.mass)
    drive = make_levels([case.acceleration, 0.0], case.drive, 2)
    model = make_model(
        Grooves(case.wavelength, case.amplitude, case.phase, case.lifted),
        case.load,
        case.static,
        case.kinetic,
        None,
        basis,
    )
    run = start_run(basis, drive, model, 40)
    run.march_cycle(60, 0, [])
    twin = run.fork(drive)
    rows = [one.march_cycle(100, 0, [])[1] for one in (run, twin)]
    np.testing.assert_array_equal(*rows)
    assert abs(rows[0][-1, 1]) < 1e-9  # at rest on its flank without a drive


@pytest.mark.parametrize("kinetic", [0.4, 0.32])
def test_exact_two_modes_on_flat_grooves_by_the_exact_engine(kinetic):
    """Flanks of a slope of 1e-12: stops, sticks with a mode that goes on swinging, and releases of Coulomb's law."""
    basis = basis_of(
        2 * np.pi * np.array([143.0, 129.0]), 0.003, [1.0, 0.4], [1.0, 0.0], [1.0, 0.0], mass=1.2
    )
    drive = SineDrive(48.0, 2 * np.pi * 143)
    done = march(
        basis,
        drive,
        make_model(Grooves(80e-6, 1e-17), 115.0, 0.4, kinetic, None, basis),
        8,
        100,
        window=4,
    )
    true = simulate(basis, drive, 46.0, 115 * kinetic, 8, 4)
    np.testing.assert_allclose(done.response.modal[-1], true.response.modal[-1], rtol=1e-7)
    np.testing.assert_allclose(
        done.response.modal_rate[-1], true.response.modal_rate[-1], rtol=1e-7
    )
    assert done.ledger["friction"] == pytest.approx(true.ledger["friction"], rel=1e-8)
