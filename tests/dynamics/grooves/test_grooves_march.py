"""Grooves in time integration: a pendulum, an independent solution by DOP853, limits of the
friction law, energy."""

import numpy as np
import pytest
from event_run import simulate
from grooves_reference import draw_case, flank_slope, integrate_case, sliding_forces
from modal_bases import make_modal_basis
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from patchfem.core import InitialState, Outcome, PatchfemError, SineDrive
from patchfem.dynamics.grooves.run import make_model
from patchfem.dynamics.march.march import march
from patchfem.friction import Grooves
from patchfem.response import energy_balance
from patchfem.structure.drives import make_step


def make_mode(omega, zeta=0.0, mass=1.0):
    """Return the basis of a single mode."""
    return make_modal_basis(omega, zeta, mass=mass)


def march_case(case, cycles: int, steps: int):
    """Return the march of a random case from grooves_reference."""
    basis = make_mode(case.omega, case.zeta, case.mass)
    grooves = Grooves(case.wavelength, case.amplitude, case.phase, case.lifted)
    model = make_model(grooves, case.load, case.static, case.kinetic, None, basis)
    return march(
        basis, SineDrive(case.acceleration, case.drive), model, cycles, steps, window=cycles
    )


@pytest.mark.parametrize("angle", [1e-3, 3.0])
def test_exact_motion_without_friction_is_a_pendulum(angle):
    """A mass in a cosine valley without friction moves like a pendulum, within 1e-9: its period is
    4 K(sin^2(angle/2))/w with w^2 = N k^2 A/m."""
    grooves = Grooves(80e-6, 7.5e-6)
    basis = make_mode(0.0, mass=1.2)
    position = angle / grooves.wave_number
    period = 4 * ellipk(np.sin(angle / 2) ** 2) / np.sqrt(grooves.stiffness(115.0) / 1.2)
    result = march(
        basis,
        SineDrive(0.0, 2 * np.pi / period),
        make_model(grooves, 115.0, 0.0, 0.0, None, basis),
        3,
        50,
        start=InitialState(np.array([position]), np.zeros(1)),
    )
    assert result.response.slide[-1] == pytest.approx(position, rel=1e-9)
    assert result.response.slide[-26] == pytest.approx(-position, rel=1e-9)  # half a period before
    assert energy_balance(result.ledger) < 1e-9


@pytest.mark.share(2)
@pytest.mark.parametrize(
    "seed", [3, 10, 11, *(pytest.param(k, marks=pytest.mark.slow) for k in (2, 4, 5, 7, 8, 12, 13))]
)
def test_exact_random_rigs_agree_with_dop853(seed):
    """Slide, speed, force, friction loss and work of the drive of random rigs agree within 1e-7
    with an independent derivation, integrated by DOP853. The rig with seed 10 slides over more than
    five waves."""
    case = draw_case(seed)
    result = march_case(case, 4, 50)
    response = result.response
    expected, lift_off_time = integrate_case(case, response.time[-1], response.time)
    assert (
        lift_off_time == np.inf
        and result.outcome is None
        and np.ptp(expected[:, 0]) > (5 * case.wavelength if seed == 10 else 0)
    )
    for k, column in enumerate((response.slide, response.slide_rate)):
        np.testing.assert_allclose(
            column, expected[:, k], rtol=0, atol=1e-7 * np.abs(expected[:, k]).max()
        )
    is_moving = np.abs(expected[:, 1]) > 1e-3 * np.abs(expected[:, 1]).max()
    force = [
        sliding_forces(case, t, q, v, np.sign(v), case.kinetic)[2]
        for t, (q, v) in zip(response.time, expected[:, :2])
    ]
    np.testing.assert_allclose(
        response.force[is_moving],
        np.array(force)[is_moving],
        rtol=0,
        atol=1e-7 * np.abs(force).max(),
    )
    # potential energy of the start, which the ledger counts as work of the drive
    height = case.load * case.amplitude * (1 - np.cos(case.phase))
    assert result.ledger["friction"] == pytest.approx(expected[-1, 2], rel=1e-7)
    assert result.ledger["work_in"] - height == pytest.approx(expected[-1, 3], rel=1e-7)
    assert energy_balance(result.ledger) < 1e-9


@pytest.mark.parametrize("seed", [3])
def test_exact_normal_load_and_stored_energy_agree_with_dop853(seed):
    """The vertical force and the stored energy, which includes the work against the load, agree
    within 1e-6 with the independent solution by DOP853."""
    case = draw_case(seed)
    result = march_case(case, 4, 50)
    response = result.response
    expected, _ = integrate_case(case, response.time[-1], response.time)
    is_moving = np.abs(expected[:, 1]) > 1e-3 * np.abs(expected[:, 1]).max()
    assert case.lifted > 0
    normal_force = [
        sliding_forces(case, t, q, v, np.sign(v), case.kinetic)[1]
        for t, (q, v) in zip(response.time, expected[:, :2])
    ]
    # vertical fraction of the normal force
    vertical_fraction = [
        np.cos(a) - np.sign(v) * case.kinetic * np.sin(a)
        for a, v in zip(
            np.arctan([flank_slope(case, q)[0] for q in expected[:, 0]]), expected[:, 1]
        )
    ]
    np.testing.assert_allclose(
        response.extra["normal_load"][is_moving],
        (np.array(normal_force) * vertical_fraction)[is_moving],
        rtol=1e-6,
    )
    start_energy = case.load * case.amplitude * (1 - np.cos(case.phase))
    modal = 0.5 * case.mass * (expected[-1, 1] ** 2 + case.omega**2 * expected[-1, 0] ** 2)
    lift_energy = 0.5 * case.lifted * (flank_slope(case, expected[-1, 0])[0] * expected[-1, 1]) ** 2
    assert result.ledger["stored"] == pytest.approx(
        start_energy + expected[-1, 4] + modal + lift_energy, rel=1e-6
    )


@pytest.mark.parametrize("position", [0.0, -0.2])
def test_exact_breakaway_at_force_limits_of_flank(position):
    """A force just below N (t + mu)/(1 - mu t) or just above N (t - mu)/(1 + mu t) leaves the mass
    at rest, and a force just outside these limits moves it."""
    grooves = Grooves(80e-6, 5e-6)
    basis = make_mode(0.0)
    load = 100.0
    mu = 0.3
    q = position * 80e-6
    t = flank_slope(draw_case(0)._replace(wavelength=80e-6, amplitude=5e-6, phase=0.0), q)[0]
    for direction, limit in (
        (1, load * (t + mu) / (1 - mu * t)),
        (-1, load * (t - mu) / (1 + mu * t)),
    ):
        for excess, moves in ((-1e-6, False), (1e-6, True)):
            force = limit + direction * excess * load
            model = make_model(grooves, load, mu, mu, None, basis)
            done = march(
                basis,
                make_step(-force, 0.01),
                model,
                1,
                20,
                start=InitialState(np.array([q]), np.zeros(1)),
            )
            assert (abs(done.response.slide[-1] - q) > 1e-12 * 80e-6) == moves
            assert moves or done.response.force[-1] == pytest.approx(force, rel=1e-9, abs=1e-9)


def test_refuses_too_large_lifted_mass():
    """A lifted mass that exceeds the inertia of the mode is refused, with its largest permitted
    value."""
    with pytest.raises(PatchfemError, match=r"must be below [\d.]+ kg"):
        make_model(Grooves(80e-6, 8e-6, 0.0, 100.0), 100.0, 0.6, 0.6, None, make_mode(900.0))


@pytest.mark.parametrize("seed", [1, *(pytest.param(k, marks=pytest.mark.slow) for k in (0, 6, 9))])
def test_exact_time_of_lift_off_agrees_with_dop853(seed):
    """The run ends at the first sample after the vertical force vanishes in the independent
    solution by DOP853."""
    case = draw_case(seed)
    result = march_case(case, 4, 50)
    assert result.outcome is Outcome.LEAVES_GROOVES and "leaves the grooves" in result.message
    time = result.response.time
    step = 2 * np.pi / case.drive / 50
    lift_off_time = integrate_case(case, time[-1] + step, time)[1]
    assert -1e-6 * step < time[-1] - lift_off_time < step


@pytest.mark.parametrize(
    ("frequency", "stable_level", "unstable_level"), [(143, 7.75, 8.0), (135, 8.0, 8.25)]
)
def test_always_rig_on_grooves_exceeds_travel_near_8_g(frequency, stable_level, unstable_level):
    """A rig on grooves of 80 um exceeds a travel of 2 mil at 8.0 g and 143 Hz and at 8.25 g and 135
    Hz, where the rig of the report became unstable. The load is 26 lbf, mu is 0.4, slip starts at
    4.2 g, and the flanks have a slope of 0.51."""
    load = 115.65
    g = 9.80665
    mass = 0.4 * load / (4.2 * g)
    basis = make_modal_basis(
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
    for level, outcome in ((stable_level, None), (unstable_level, Outcome.EXCEEDS_TRAVEL)):
        result = march(
            basis, SineDrive(level * g, 2 * np.pi * frequency), model, 200, 50, travel=50.8e-6
        )
        assert result.outcome is outcome
        assert energy_balance(result.ledger) < 1e-9


@pytest.mark.parametrize("lifted", [0.4])
def test_exact_tanh_law_on_grooves_agrees_with_dop853(lifted):
    """With the friction coefficient mu tanh(sqrt(1 + t^2) v/v_0) slide and speed agree with DOP853
    within 1e-6."""
    case = draw_case(3)._replace(lifted=lifted)
    speed = 5e-3
    basis = make_mode(case.omega, case.zeta, case.mass)
    duration = 3 * 2 * np.pi / case.drive
    grooves = Grooves(case.wavelength, case.amplitude, case.phase, case.lifted)
    result = march(
        basis,
        SineDrive(case.acceleration, case.drive),
        make_model(grooves, case.load, case.static, case.static, speed, basis),
        3,
        100,
    )

    def state_derivative(t, x):
        friction = case.static * np.tanh(np.hypot(1, flank_slope(case, x[0])[0]) * x[1] / speed)
        return [x[1], sliding_forces(case, t, x[0], x[1], 1.0, friction)[0]]

    expected = solve_ivp(
        state_derivative, (0, duration), [0.0, 0.0], "DOP853", rtol=1e-11, atol=[1e-16, 1e-13]
    ).y[:, -1]
    assert result.response.slide[-1] == pytest.approx(expected[0], rel=1e-7)
    assert result.response.slide_rate[-1] == pytest.approx(expected[1], rel=1e-6)
    assert energy_balance(result.ledger) < 1e-9


@pytest.mark.parametrize("kinetic", [0.4, 0.32])
def test_exact_flat_grooves_agree_with_event_engine(kinetic):
    """Two modes on grooves with a slope of 1e-12 agree within 1e-7 with the event engine for
    Coulomb friction."""
    basis = make_modal_basis(
        2 * np.pi * np.array([143.0, 129.0]), 0.003, [1.0, 0.4], [1.0, 0.0], [1.0, 0.0], mass=1.2
    )
    drive = SineDrive(48.0, 2 * np.pi * 143)
    result = march(
        basis,
        drive,
        make_model(Grooves(80e-6, 1e-17), 115.0, 0.4, kinetic, None, basis),
        8,
        100,
        window=4,
    )
    expected = simulate(basis, drive, 46.0, 115 * kinetic, 8, 4)
    np.testing.assert_allclose(result.response.modal[-1], expected.response.modal[-1], rtol=1e-7)
    np.testing.assert_allclose(
        result.response.modal_rate[-1], expected.response.modal_rate[-1], rtol=1e-7
    )
    assert result.ledger["friction"] == pytest.approx(expected.ledger["friction"], rel=1e-8)
