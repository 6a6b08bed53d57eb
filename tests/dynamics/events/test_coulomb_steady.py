"""Steady motions by shooting on the event map, against published values, long runs, finite
differences and perturbed runs."""

from math import pi, sqrt

import numpy as np
import pytest
from event_run import map_period, simulate, solve_steady
from modal_bases import make_modal_basis, make_random_modal_basis
from vibration_forms import sliding_amplitude, two_stop_amplitude

from patchfem.core import InitialState, PatchfemError, SineDrive
from patchfem.structure import drives


def run_amplitude(modes, drive, static, kinetic, cycles, start=None):
    """Return half the peak-to-peak displacement in the last cycle of a run."""
    low, high = simulate(modes, drive, static, kinetic, cycles, 1, start=start).extremes[-1]
    return (high - low) / 2


@pytest.mark.parametrize(
    "friction, zeta, expected, regime",
    [
        (0.8, 0.003, 0.28704671337871602595, "2 stops"),
        (0.8, 0.0, 0.29943104174842751488, "2 stops"),
        (0.5, 0.003, 60.5632260810004979, "sliding"),
        (0.79, 0.0, 0.435537658848, "2 stops"),
        (1.2, 0.003, 0.0, "stuck"),
        (0.95, 0.0, None, "2 stops"),
        (pi / 4 + 1e-6, 0.0, None, "2 stops"),
        (pi / 4 - 1e-4, 0.0, np.inf, "unbounded"),
    ],
)
def test_exact_resonance_amplitudes_agree_with_published_values(friction, zeta, expected, regime):
    """Amplitudes at resonance agree within 2e-12 with published values, or with the closed form of
    two stops, which is ill-conditioned near pi/4. Below pi/4 the undamped motion is unbounded."""
    motion = solve_steady(make_modal_basis(1.0, zeta), SineDrive(1.0, 1.0), friction, friction)
    assert motion.regime == regime
    if regime == "unbounded":
        return
    rel = 2e-12 if expected is not None else 1e-12 / (friction - pi / 4)
    assert motion.amplitude == pytest.approx(
        two_stop_amplitude(friction) if expected is None else expected, rel=rel
    )
    assert motion.residual < 1e-12 and motion.alone
    if regime != "stuck":
        assert np.abs(motion.multipliers).max() < 1


@pytest.mark.parametrize(
    "hertz, level, amplitude", [(135, 6, 5.22698), (150, 7, 6.66151), (155, 8, 4.29575)]
)
def test_table_check_7_amplitudes_without_damping(hertz, level, amplitude):
    """Amplitudes without damping agree with table check 7 of the report within 2e-6."""
    motion = solve_steady(make_modal_basis(1.0), SineDrive(level / 4, hertz / 143), 1.0, 1.0)
    assert (
        motion.amplitude / (level / 4) == pytest.approx(amplitude, rel=2e-6)
        and motion.regime == "sliding"
    )


@pytest.mark.parametrize(
    "hertz, knee", [(135, 1.2466), (143, 1.2792), (150, 1.3108), (155, 1.3337)]
)
def test_table_check_8_transition_to_sliding(hertz, knee):
    """The last stop vanishes at the ratio of drive to friction in table check 8 of the report,
    within 1e-3."""
    regimes = [
        solve_steady(
            make_modal_basis(1.0, 0.003), SineDrive(knee + offset, hertz / 143), 1.0, 1.0
        ).regime
        for offset in (-1e-3, 1e-3)
    ]
    assert regimes == ["2 stops", "sliding"]


POINTS = [
    (0.4, 2.0),
    (0.6, 1.5),
    (0.8, 1.3),
    (0.9, 1.15),
    (1.0, 1.25),
    (1.05, 1.2),
    (1.1, 1.6),
    (1.3, 3.0),
    (1.7, 1.4),
    (2.5, 2.2),
]


def test_exact_steady_amplitudes_agree_with_runs():
    """Steady amplitudes at ten frequencies and levels agree with runs of 60 cycles within 1e-9."""
    for ratio, level in POINTS:
        modes = make_modal_basis(1.0, 0.08)
        drive = SineDrive(level, ratio)
        motion = solve_steady(modes, drive, 1.0, 1.0)
        expected = run_amplitude(modes, drive, 1.0, 1.0, 60)
        assert motion.amplitude == pytest.approx(expected, rel=1e-9), (ratio, level)


@pytest.mark.share(0)
@pytest.mark.parametrize("level, ratio, n_stops", [(3.0, 0.11, 4), (2.0, 0.06, 8), (2.0, 0.05, 10)])
def test_exact_number_of_stops_below_resonance(level, ratio, n_stops):
    """The steady motion under a slow drive has the same number of stops per cycle and the same
    amplitude as a long run."""
    modes = make_modal_basis(1.0, 0.0005)
    drive = SineDrive(level, ratio)
    motion = solve_steady(modes, drive, 1.0, 1.0)
    result = simulate(modes, drive, 1.0, 1.0, 80, 10)
    stops = np.count_nonzero((result.log.kind == 0) & (result.log.time > 70 * drive.period)) / 10
    assert motion.stops == (stops,) == (n_stops,) and motion.regime == f"{n_stops} stops"
    low, high = result.extremes[-1]
    assert motion.amplitude == pytest.approx((high - low) / 2, rel=1e-10)


def test_exact_stuck_and_sliding_motion_coexist():
    """With kinetic below static friction the rig stays at rest, or slides steadily after an initial
    impulse, at the same drive level."""
    modes = make_modal_basis(1.0, 0.05)
    drive = SineDrive(0.9, 1.0)
    rest = solve_steady(modes, drive, 1.0, 0.3)
    moving = solve_steady(modes, drive, 1.0, 0.3, InitialState(np.zeros(1), np.array([8.0])))
    assert (rest.regime, moving.regime) == ("stuck", "sliding") and rest.amplitude == 0
    expected = 0.9 * sliding_amplitude(1.0, 0.3 / 0.9, 0.05)
    assert moving.amplitude == pytest.approx(expected, rel=1e-11)
    assert np.abs(moving.multipliers).max() < 1


def test_refuses_drive_that_is_not_periodic():
    """A drive of several levels has no steady motion and is refused."""
    with pytest.raises(PatchfemError, match="a single sine without end"):
        solve_steady(make_modal_basis(1.0), drives.make_levels([1.0, 2.0], 1.0, 5), 1.0, 1.0)


def make_two_interface_rig(seed=2, ratio=1.0):
    """Return modes, drive and friction limits of a random rig with two interfaces."""
    rng = np.random.default_rng(seed)
    modes = make_random_modal_basis(rng, 3, 2)
    static = rng.uniform(0.1, 0.3, 2)
    return modes, SineDrive(1.0, 1.2), static, ratio * static


@pytest.mark.share(1)
@pytest.mark.parametrize("seed, ratio", [(2, 1.0), (3, 0.7), (5, 1.0)])
def test_exact_two_interfaces_agree_with_run(seed, ratio):
    """The steady motion of two interfaces has the amplitude of a run of 400 cycles and repeats
    after one cycle."""
    modes, drive, static, kinetic = make_two_interface_rig(seed, ratio)
    motion = solve_steady(modes, drive, static, kinetic)
    assert motion.amplitude == pytest.approx(
        run_amplitude(modes, drive, static, kinetic, 400), rel=1e-8
    )
    window = simulate(modes, drive, static, kinetic, 1, 1, start=motion.start).window
    np.testing.assert_allclose(
        window.modal[-1], motion.start.z, atol=1e-11 * np.abs(window.modal).max()
    )
    np.testing.assert_allclose(
        window.modal_rate[-1], motion.start.v, atol=1e-11 * np.abs(window.modal_rate).max()
    )


@pytest.mark.share(3)
@pytest.mark.parametrize(
    "seed, n_modes, n_interfaces, ratio",
    [(1, 3, 2, 1.0), (2, 3, 2, 0.6), (4, 4, 3, 1.0), (6, 4, 3, 0.7)],
)
def test_exact_derivative_of_map_agrees_with_differences(seed, n_modes, n_interfaces, ratio):
    """The derivative of the event map, with its saltation matrices, agrees with central differences
    within 3e-8."""
    rng = np.random.default_rng(seed)
    modes = make_random_modal_basis(rng, n_modes, n_interfaces)
    static = rng.uniform(0.2, 1.0, n_interfaces)
    x = rng.normal(size=2 * n_modes)
    drive = SineDrive(1.0, 1.2)
    step = 1e-6
    mapped = map_period(modes, drive, static, ratio * static, x)
    for j in range(2 * n_modes):
        direction = np.zeros(2 * n_modes)
        direction[j] = step
        ends = [
            map_period(modes, drive, static, ratio * static, x + s * direction).end for s in (1, -1)
        ]
        np.testing.assert_allclose(mapped.slope[:, j], (ends[0] - ends[1]) / (2 * step), atol=3e-8)


def test_exact_steady_motion_of_figure_16():
    """The steady motion of figure 16 of the report has two stops, and its amplitude agrees with the
    report within 2e-8."""
    h = sqrt(0.5)
    modes = make_modal_basis([0.0, sqrt(2)], 0.0, [[h, -h]], (-h, -h), (h, -h))
    drive = SineDrive(1.0, 1.14)
    motion = solve_steady(modes, drive, 3.0, 3.0, cycles=120)
    assert motion.amplitude == pytest.approx((0.69867878 + 0.39299347) / 2, abs=2e-8)
    assert motion.regime == "2 stops"


def test_exact_simultaneous_events_are_reported():
    """A steady motion reports whether events of two interfaces coincide, which makes the derivative
    of its map invalid."""
    modes = make_modal_basis([1.0, 1.0], 0.05, np.eye(2), (1, 1), (1, 0))
    assert not solve_steady(modes, SineDrive(1.5, 0.9), 0.5, 0.5).alone
    assert solve_steady(modes, SineDrive(1.5, 0.9), [0.5, 0.4], [0.5, 0.4]).alone
