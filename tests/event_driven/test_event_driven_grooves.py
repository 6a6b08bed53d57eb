"""Friction on the flanks of grooves: a pendulum, an independent solution by DOP853, limits of the friction law, energy."""

from types import SimpleNamespace

import numpy as np
import pytest
from event_driven_cases import make_modes
from grooves_reference import draw_case, flank_slope, integrate_case, sliding_forces
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from patchfem.core import PatchfemError
from patchfem.event_driven import cases, drives, runs
from patchfem.event_driven.laws.grooves import make_grooves
from patchfem.event_driven.measures import compute_energies
from patchfem.event_driven.records import Status
from patchfem.friction import Grooves

RTOL = 1e-11


def run_on_grooves(case, tones, period, cycles, *, speed=None, position=0.0, force=0.0, times=()):
    """Run a mode of a `GrooveCase`; `force` [N] is constant, `speed` [m/s] is that of law "tanh"."""
    modes = make_modes(case.omega, case.zeta)
    modes = type(modes)(**{**{f: getattr(modes, f) for f in modes.__slots__}, "mass": case.mass})
    shape = Grooves(case.wavelength, case.amplitude, case.phase, case.lifted)
    keys = SimpleNamespace(static=case.static, kinetic=case.kinetic, reference_speed=speed)
    law = make_grooves(keys, shape)
    signal = drives.make_tones(tones, period)
    if force:
        signal = drives.make_record(
            np.array([0.0, 2 * cycles * period]), np.full(2, -force / case.mass), period
        )
    interface = cases.Interface(law, cases.Load(case.load), np.ones(1))
    options = cases.Options(moves_base=True, rtol=RTOL)
    sizes = case.wavelength, 2 * np.pi * case.wavelength / period
    rig = cases.make_rig(modes, signal, [interface], sizes, options)
    start = cases.make_start(rig, [interface], SimpleNamespace(z=[position], v=[0.0]))
    schedule = cases.make_schedule(cycles, period, 1)
    made = cases.Case(rig, start, *schedule, np.asarray(times, float), 1)
    return runs.run_case(made)


def run_drawn_case(case, cycles, **options):
    """Run a drawn case under its sine."""
    period = 2 * np.pi / case.drive
    return run_on_grooves(case, [(case.acceleration, case.drive, 0.0)], period, cycles, **options)


@pytest.mark.parametrize("angle", [1e-3, 3.0])
def test_exact_motion_without_friction_is_a_pendulum(angle):
    """A mass in a cosine valley without friction moves like a pendulum, within 1e-9: its period is 4 K(sin^2(angle/2))/w
    with w^2 = N k^2 A/m."""
    case = draw_case(0)._replace(
        mass=1.2, omega=0.0, zeta=0.0, load=115.0, wavelength=80e-6, amplitude=7.5e-6, phase=0.0, lifted=0.0,
        static=0.0, kinetic=0.0,
    )  # fmt: skip
    grooves = Grooves(80e-6, 7.5e-6)
    position = angle / grooves.wave_number
    period = 4 * ellipk(np.sin(angle / 2) ** 2) / np.sqrt(grooves.stiffness(115.0) / 1.2)
    times = [period / 2, period]
    motion = run_on_grooves(case, [], period, 1, position=position, times=times)
    slides = [motion.rows[np.abs(motion.rows[:, 0] - t).argmin(), 1] for t in times]
    assert slides == pytest.approx([-position, position], rel=1e-8)


@pytest.mark.share(0, 1, 2)
@pytest.mark.parametrize("seed", [3, 10, 11, 2, 4, 5, 7, 8, 12, 13])
def test_exact_random_rigs_agree_with_dop853(seed):
    """Slide, speed, friction loss and work of the drive of random rigs agree within 1e-7 with an independent derivation,
    integrated by DOP853. The rig with seed 10 slides over more than five waves."""
    case = draw_case(seed)
    times = np.linspace(0, 4 * 2 * np.pi / case.drive, 201)
    expected, lift_off_time = integrate_case(case, times[-1], times)
    motion = run_drawn_case(case, 4, times=times)
    assert lift_off_time == np.inf and motion.status == Status.DONE
    assert np.ptp(expected[:, 0]) > (5 * case.wavelength if seed == 10 else 0)
    at = np.searchsorted(motion.rows[:, 0], times * (1 - 1e-12))
    for column in (0, 1):
        scale = np.abs(expected[:, column]).max()
        np.testing.assert_allclose(
            motion.rows[at, 1 + column], expected[:, column], rtol=0, atol=1e-7 * scale
        )
    energies = compute_energies(motion.case, motion.final)
    assert energies["friction"] == pytest.approx(expected[-1, 2], rel=1e-7)
    assert energies["work_in"] == pytest.approx(expected[-1, 3], rel=1e-7)
    assert motion.values["energy_balance"] < 1e-9


@pytest.mark.parametrize("position", [0.0, -0.2])
def test_exact_breakaway_at_force_limits_of_flank(position):
    """A force just below N (t + mu)/(1 - mu t) or just above N (t - mu)/(1 + mu t) leaves the mass at rest, and a force
    just outside these limits moves it."""
    case = draw_case(0)._replace(
        mass=1.0, omega=0.0, zeta=0.0, load=100.0, wavelength=80e-6, amplitude=5e-6, phase=0.0, lifted=0.0,
        static=0.3, kinetic=0.3,
    )  # fmt: skip
    q = position * case.wavelength
    t = flank_slope(case, q)[0]
    for direction, limit in (
        (1, 100 * (t + 0.3) / (1 - 0.3 * t)),
        (-1, 100 * (t - 0.3) / (1 + 0.3 * t)),
    ):
        for excess, moves in ((-1e-6, False), (1e-6, True)):
            force = limit + direction * excess * case.load
            motion = run_on_grooves(case, [], 0.01, 1, position=q, force=force, times=[0.01])
            assert (abs(motion.rows[-1, 1] - q) > 1e-15) == moves


def test_refuses_too_large_lifted_mass():
    """A lifted mass that exceeds the inertia of the mode is refused, with its largest permitted value."""
    with pytest.raises(PatchfemError, match=r"must be below [\d.]+ kg"):
        Grooves(80e-6, 8e-6, 0.0, 100.0).check_lifted_mass(0.6, 1.0)


@pytest.mark.share(0, 1)
@pytest.mark.parametrize("seed", [0, 9, 1, 6])
def test_exact_time_of_lift_off_agrees_with_dop853(seed):
    """The run ends where the vertical force vanishes in the independent solution by DOP853."""
    case = draw_case(seed)
    motion = run_drawn_case(case, 4)
    assert motion.status == Status.LEAVES_GROOVES and "leaves the grooves" in motion.message
    period = 2 * np.pi / case.drive
    lift_off_time = integrate_case(case, 4 * period, np.linspace(0, motion.time, 5))[1]
    assert motion.time == pytest.approx(lift_off_time, rel=1e-7)


def test_exact_tanh_law_on_grooves_agrees_with_dop853():
    """With the friction coefficient mu tanh(sqrt(1 + t^2) v/v_0) slide, speed and loss agree with DOP853 to 1e-6."""
    case = draw_case(3)._replace(lifted=0.4)
    speed = 5e-3
    duration = 3 * 2 * np.pi / case.drive
    motion = run_drawn_case(case, 3, speed=speed, times=[duration])

    def differentiate(t, x):
        """Return the rates of slide, speed and friction loss."""
        stretch = np.hypot(1, flank_slope(case, x[0])[0])
        friction = case.static * np.tanh(stretch * x[1] / speed)
        acceleration, normal_force, _ = sliding_forces(case, t, x[0], x[1], 1.0, friction)
        return [x[1], acceleration, friction * normal_force * stretch * x[1]]

    expected = solve_ivp(
        differentiate, (0, duration), np.zeros(3), "DOP853", rtol=1e-11, atol=[1e-16, 1e-13, 1e-13]
    ).y[:, -1]
    assert motion.rows[-1, 1:3] == pytest.approx(expected[:2], rel=1e-6)
    assert motion.values["energy_dissipated"] == pytest.approx(expected[2], rel=1e-6)
    assert motion.values["energy_balance"] < 1e-9


def test_exact_lift_off_with_tanh_law_agrees_with_dop853():
    """With a reference speed the run ends where the normal force vanishes in the solution by DOP853, within 2e-5."""
    case, speed = draw_case(9), 1e-3

    def find_forces(t, x):
        friction = case.static * np.tanh(np.hypot(1, flank_slope(case, x[0])[0]) * x[1] / speed)
        return sliding_forces(case, t, x[0], x[1], 1.0, friction)

    def find_normal_force(t, x):
        return find_forces(t, x)[1]

    find_normal_force.terminal = True
    expected = solve_ivp(
        lambda t, x: [x[1], find_forces(t, x)[0]], (0.0, 0.01), [0.0, 0.0], "DOP853", events=find_normal_force,
        rtol=1e-11, atol=1e-14, max_step=1e-5,
    )  # fmt: skip
    motion = run_drawn_case(case, 4, speed=speed)
    assert motion.status == Status.LEAVES_GROOVES
    assert motion.time == pytest.approx(expected.t_events[0][0], rel=2e-5)
