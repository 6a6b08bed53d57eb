"""Coulomb friction on one mode or two masses: closed forms, published values, 40-digit arithmetic
and DOP853."""

from math import pi, sqrt

import mpmath
import numpy as np
import pytest
import vibration_forms
from event_run import combine_signals, make_groups, run_phases, simulate
from modal_bases import make_modal_basis
from vibration_forms import sliding_amplitude

from patchfem.core import DriveSegment, InitialState, PatchfemError, SineDrive
from patchfem.dynamics.events import histories
from patchfem.dynamics.events.histories import evaluate_motion
from patchfem.response import energy_balance
from patchfem.structure import make_release
from patchfem.structure.drives import PiecewiseDrive


def make_mode(omega=1.0, zeta=0.003):
    """Return the basis of a single mode."""
    return make_modal_basis(omega, zeta)


def run_case(
    friction, zeta=0.003, ratio=1.0, cycles=200, omega=1.0, start=None, kinetic=None, window=10
):
    """Return a run under a unit base acceleration at `ratio` times the natural frequency 1."""
    kinetic = friction if kinetic is None else kinetic
    return simulate(
        make_mode(omega, zeta),
        SineDrive(1.0, ratio),
        friction,
        kinetic,
        cycles,
        window,
        start=start,
    )


def half_range(result, last=10):
    """Return half of the range of the displacement over the last cycles."""
    tail = result.extremes[-last:]
    return (tail[:, 1].max() - tail[:, 0].min()) / 2


@pytest.mark.parametrize(
    "friction, zeta, ratio, cycles, amplitude, rel",
    [
        (0.8, 0.003, 1.0, 200, 0.28704671337871602595, 1e-11),
        (0.79, 0.0, 1.0, 200, 0.435537658848, 1e-11),
        (0.5, 0.003, 1.0, 200, 59.1610896, 2e-9),
        (2 / 3, 0.003, 1.0, 1500, 25.1953787788816, 1e-11),
        (4 / 6, 0.003, 135 / 143, 900, 4.83011, 2e-6),
        (4 / 7, 0.003, 150 / 143, 900, 6.21040, 2e-6),
    ],
)
def test_exact_amplitudes_agree_with_published_values(
    friction, zeta, ratio, cycles, amplitude, rel
):
    """Steady amplitudes agree with values of the report and of 40-digit computations. Where the
    block never sticks, they also agree with the closed form of sliding within 1e-12."""
    run = run_case(friction, zeta, ratio, cycles)
    assert half_range(run) == pytest.approx(amplitude, rel=rel)
    if cycles >= 900:
        assert half_range(run) == pytest.approx(sliding_amplitude(ratio, friction, zeta), rel=1e-12)
    assert energy_balance(run.ledger) < 1e-10


@pytest.mark.parametrize("static", [1.000002, 1.2])
def test_exact_no_motion_below_onset_of_slip(static):
    """If the friction limit exceeds the drive, all motions are exactly zero and the friction
    balances the base acceleration."""
    result = run_case(static, cycles=30)
    assert result.log.count == 0 and not result.extremes.any()
    for name in ("modal", "modal_rate", "slide", "slip", "output", "output_rate"):
        assert not getattr(result.response, name).any()
    np.testing.assert_allclose(
        result.window.force, -result.window.base_acceleration, rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(
        result.window.acceleration, result.window.base_acceleration, rtol=0, atol=1e-12
    )


def test_figure_16_stops_of_two_masses():
    """Stops of two unit masses joined by a unit spring agree with figure 16 within 1e-11; sin(1.14
    t) drives the first mass, and friction acts on the second."""
    h = sqrt(0.5)
    modes = make_modal_basis([0.0, sqrt(2)], 0.0, [h, -h], (-h, -h))
    phases = run_phases(modes, SineDrive(1.0, 1.14), 3.0, 3.0, 400.0)
    assert len(phases) == 286
    assert phases[0].span == pytest.approx(8.079711463905416, abs=1e-12)
    exact = [
        (10.00410372419476, 0.8994115234033145),
        (12.96534318337974, -0.5914209838254593),
        (15.73725378200728, 0.8835834423211487),
    ]
    for phase, (time, place) in zip([p for p in phases[1:] if p.direction == 0], exact):
        assert phase.time == pytest.approx(time, abs=1e-11)
        assert combine_signals(phase.modal, modes.slide)(0.0) == pytest.approx(place, abs=1e-11)
    assert combine_signals(phases[-1].modal, modes.slide)(phases[-1].span) == pytest.approx(
        -0.37952939486, abs=1e-10
    )


def test_refuses_interface_that_no_mode_moves():
    """An interface that no mode moves is refused."""
    with pytest.raises(PatchfemError, match="no mode moves the interface"):
        simulate(make_modal_basis(1.0, faces=[0.0]), SineDrive(1.0, 1.0), 1.0, 1.0, 2)


@pytest.mark.parametrize(
    "start, rest, time",
    [
        (11.5, -0.5, 6 * pi),
        (11.0, -1.0, 5 * pi),
        (11 + 1e-9, -0.999999999, 6 * pi),
        (0.9, 0.9, 0.0),
    ],
)
def test_exact_free_decay_agrees_with_closed_form(start, rest, time):
    """Rest position, time of rest and motion of a free decay with friction agree with the closed
    form within 1e-13."""
    begin = InitialState(np.array([start]), np.zeros(1))
    result = simulate(make_mode(zeta=0.0), make_release(2 * pi), 1.0, 1.0, 10, 10, start=begin)
    assert result.window.slide[-1] == pytest.approx(rest, abs=2e-14)
    assert np.ptp(result.window.slide[result.window.time > time + 1e-9]) == 0.0
    late = result.window.time
    np.testing.assert_allclose(
        result.window.slide, vibration_forms.decay(late, start, 1.0, 1.0), atol=1e-13 * start
    )
    assert energy_balance(result.ledger) < 1e-13


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5])
def test_exact_stroke_of_rigid_block_agrees_with_closed_form(friction):
    """A rigid block without a spring, v' = a sin - f sgn(v), has half the stroke sqrt(1 - (pi
    f/2)^2) a/omega^2 for f < a/sqrt(1 + pi^2/4), within 1e-12."""
    result = run_case(friction, 0.0, 1.3, 80, omega=0.0)
    low, high = result.extremes[-1]
    assert (high - low) / 2 * 1.3**2 == pytest.approx(sqrt(1 - (pi * friction / 2) ** 2), rel=1e-12)


@pytest.mark.parametrize("cycles", [10_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_exact_million_cycles_do_not_drift(cycles, monkeypatch):
    """If no cycles are extrapolated, amplitude, number of stops and energy balance are the same
    after a million cycles as in the first ones."""
    monkeypatch.setattr(
        histories._EventRun, "_skip_repeating_cycles", lambda self, *arguments: None
    )
    result = run_case(0.8, cycles=cycles)
    np.testing.assert_allclose(np.abs(result.extremes[100:]), 0.28704671337871602595, rtol=1e-12)
    assert result.log.count == 4 * cycles
    assert energy_balance(result.ledger) < 1e-11


@pytest.mark.parametrize(
    "omega, decay, drive_omega",
    [
        (1.0, 0.003, 1.0),
        (1.0, 0.0, 1.0),
        (1.0, 1e-9, 1 + 1e-7),
        (1.0, 0.3, 0.01),
        (1.0, 1 - 1e-9, 0.7),
        (1.0, 1 + 1e-9, 2.0),
        (1.0, 1.2, 0.5),
        (1.0, 30.0, 1.0),
        (0.0, 0.0, 1.3),
        (1e-6, 0.0, 1.0),
        (1e-3, 1e-5, 2.0),
    ],
)
def test_exact_motion_agrees_with_40_digit_arithmetic(omega, decay, drive_omega):
    """The motion under a sine from an initial speed agrees within 4e-14 with high-precision
    arithmetic over four decades of time. The cases include resonance, no damping, nearly critical
    damping and no spring."""

    def divided_difference(u, rate, order):
        """Return the divided difference of r^order exp(r u) over the given rates."""
        table = [r**order * mpmath.exp(r * u) for r in rate]
        for k in range(1, len(rate)):
            table = [
                (table[i + 1] - table[i]) / (rate[i + k] - rate[i]) for i in range(len(table) - 1)
            ]
        return table[0]

    modes = make_mode(omega, decay / omega if omega else 0.0)
    phase = 0.9
    amplitude = 0.7
    v0 = 0.3
    drive = PiecewiseDrive(
        (DriveSegment(0.0, 0.2, amplitude, drive_omega, phase),), 2 * pi / drive_omega
    )
    times = np.array([1e-3, 0.02, 0.2, 0.29, 0.31, 0.8, 2.0, 5.0]) / max(drive_omega, omega, 0.1)
    motion = evaluate_motion(
        modes,
        drive,
        make_groups(modes, 0.0, 0.0),
        2,
        times,
        InitialState(np.zeros(1), np.array([v0])),
    )
    with mpmath.workdps(120):  # the reference divides by differences of rates of about 1e-27
        w = [mpmath.mpf(decay), mpmath.mpf(omega)]
        root = mpmath.sqrt(w[0] ** 2 - w[1] ** 2)
        rates = [
            -w[0] + root + mpmath.mpf(10) ** -28,
            -w[0] - root - mpmath.mpf(10) ** -28,
            mpmath.mpc(0, drive_omega) + mpmath.mpf(10) ** -29,
            mpmath.mpf(10) ** -27,
        ]
        for k, u in enumerate(map(float, times)):
            exact = []
            for order in range(2):
                out = v0 * divided_difference(u, rates[:2], order) - mpmath.mpf(
                    0.2
                ) * divided_difference(u, [*rates[:2], rates[3]], order)
                out -= (
                    amplitude * mpmath.expj(phase) * divided_difference(u, rates[:3], order)
                ).imag
                exact.append(float(mpmath.re(out)))
            scale = [abs(v0) * u + u * u, abs(v0) + u]
            assert abs(motion.modal[k, 0] - exact[0]) <= 4e-14 * scale[0]
            assert abs(motion.modal_rate[k, 0] - exact[1]) <= 4e-14 * scale[1]


@pytest.mark.parametrize(
    "friction, kinetic, ratio, periods",
    [
        (0.78348258, 0.75015892, 1.03988092, 1),
        (0.2345384, 0.1100844, 0.31121007, 25),
        (0.45029613, 0.1698178, 0.42124622, 51),
    ],
)
def test_exact_long_periods_with_kinetic_below_static_friction(friction, kinetic, ratio, periods):
    """With kinetic below static friction some motions have a period of many drive cycles, and no
    shorter period."""
    result = run_case(friction, 0.05 if friction > 0.7 else 0.003, ratio, 4000, kinetic=kinetic)
    last = result.extremes[-2 * periods - 2 :]
    amplitude = np.abs(result.extremes[-periods:]).max()
    np.testing.assert_allclose(last[periods:], last[:-periods], rtol=0, atol=1e-10 * amplitude)
    for fewer in (k for k in range(1, periods) if periods % k == 0):
        assert np.abs(last[fewer:] - last[:-fewer]).max() > 1e-3 * amplitude
    assert energy_balance(result.ledger) < 1e-11


@pytest.mark.parametrize("zeta, ratio", [(0.003, 1.0), (0.2, 0.31), (0.0, 1.7)])
def test_exact_phasors_without_friction_agree_with_transfer_function(zeta, ratio):
    """A frictionless motion that starts in its steady state has the phasor of the transfer function
    in every cycle, within 1e-11."""
    modes = make_mode(1.0, zeta)
    drive = SineDrive(1.0, ratio)
    phasor = -1 / complex(1 - ratio**2, 2 * zeta * ratio)  # phasor of the response to a sine
    start = InitialState(np.array([phasor.imag]), np.array([ratio * phasor.real]))
    result = simulate(modes, drive, 0.0, 0.0, 50, 1, start=start)
    np.testing.assert_allclose(result.phasors, -1j * phasor, rtol=0, atol=1e-11 * abs(phasor))


@pytest.mark.parametrize("zeta", [0.01])
def test_exact_slow_drive_agrees_with_statics(zeta):
    """A slowly driven spring behind a sliding block agrees with statics within 1e-6.

    The slide lags by the limit over the stiffness, and each cycle loses four times the limit times
    the amplitude.
    """
    result = run_case(0.3, zeta, 1e-4, 3, window=1)
    (loop,) = result.loops
    assert result.extremes[-1] == pytest.approx([-0.7, 0.7], abs=1e-6)
    assert loop.work == pytest.approx(4 * 0.3 * 0.7, rel=1e-6)
    assert energy_balance(result.ledger) < 1e-9
