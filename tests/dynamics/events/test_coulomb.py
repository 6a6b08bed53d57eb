"""Events and one-step maps against printed numbers, closed forms, 40-digit arithmetic and DOP853."""

from functools import lru_cache
from math import asin, cos, pi, sin, sqrt

import mpmath
import numpy as np
import pytest
from event_run import combine, run, simulate, starts
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from vibration_forms import sliding_amplitude, two_stop_amplitude

from patchfem.core import G_N, BaseSine, ModalBasis, Outcome, PatchfemError
from patchfem.response.measures import energy_balance

W = 2 * pi * 143
LOAD = 98.0665  # on 1 kg: friction coefficient 0.4 is an onset at 4 g
H = sqrt(0.5)


def modes_of(omega, zeta, slide=(1.0,), base=None, output=None, mass=1.0):
    column = [np.atleast_1d(np.asarray(v, float)) for v in (omega, zeta, slide, slide if base is None else base,
                                                            slide if output is None else output)]
    return ModalBasis(tuple(f"m{i}" for i in range(column[0].size)), *column, mass)


@lru_cache(maxsize=32)
def driven(static=0.4, kinetic=None, zeta=0.003, frequency=143.0, level=5.0, cycles=200, window=10):
    drive = BaseSine(level * G_N, 2 * pi * frequency)
    kinetic = static if kinetic is None else kinetic
    return simulate(modes_of(W, zeta), drive, static * LOAD, kinetic * LOAD, cycles, window)


def half_swing(result, level=5.0, window=10):
    """Half peak-to-peak of the last `window` cycles over a/omega_n^2."""
    tail = result.amplitudes[-window:]
    return (tail[:, 1].max() - tail[:, 0].min()) / 2 * W**2 / (level * G_N)


def largest(result, level=5.0):
    return np.abs(result.amplitudes).max() * W**2 / (level * G_N)


def phases_of(modes, drive, static, kinetic, cycles):
    return list(run(modes, drive, static, kinetic, cycles * drive.period))


def slide_of(phase, modes, tau):
    return combine(phase.modal, modes.slide)(tau)


def reference(modes, drive, static, kinetic, cycles):
    """Phases (start, direction) and modal states (z, v) at the starts, by DOP853 with events in units of 1/omega_d."""
    n, unit = modes.omega.size, drive.omega
    w, zeta, s, base = modes.omega / unit, modes.zeta, modes.slide, modes.base
    square, push = float(s @ s), 1 / (modes.mass * drive.acceleration)
    up, down = static * push, kinetic * push

    def pull(t, y):
        return -base * np.sin(t) - w * w * y[:n] - 2 * zeta * w * y[n:]

    def need(t, y):
        return s @ pull(t, y) / square

    def slope(t, y, direction):
        force = need(t, y) if direction == 0 else direction * down
        return np.concatenate([y[n:], pull(t, y) - s * force])

    def crossing(function, sense):
        function.terminal, function.direction = True, sense
        return function

    t, y, direction, end = 0.0, np.zeros(2 * n), 0, cycles * 2 * pi
    starts, states = [], []
    while t < end:
        starts.append((t / unit, direction))
        states.append(y.copy())
        stops = ([crossing(lambda t, y, *_: up - need(t, y), -1), crossing(lambda t, y, *_: up + need(t, y), -1)]
                 if direction == 0 else [crossing(lambda t, y, d: d * (s @ y[n:]), -1)])
        done = solve_ivp(slope, (t, end), y, "DOP853", args=(direction,), events=stops, rtol=1e-12, atol=1e-15,
                         max_step=0.1)
        t, y = done.t[-1], done.y[:, -1]
        if done.status == 0:
            break
        if direction == 0:
            direction = 1 if need(t, y) > 0 else -1
        else:
            y[n:] -= s * (s @ y[n:]) / square
            direction = 0 if abs(need(t, y)) <= up else int(np.sign(need(t, y)))
    starts.append((end / unit, direction))
    states.append(y.copy())
    return starts, np.array(states) * drive.acceleration / unit**2


def agree(modes, drive, static, kinetic, cycles, tolerance):
    """The phases of the engine are those of the reference; returns the largest error of the modes at their starts."""
    mine = phases_of(modes, drive, static, kinetic, cycles)
    starts, states = reference(modes, drive, static, kinetic, cycles)
    assert [p.direction for p in mine] == [d for _, d in starts[:-1]]
    np.testing.assert_allclose([p.time for p in mine], [t for t, _ in starts[:-1]], rtol=0,
                               atol=tolerance * drive.period)
    z = np.array([[signal(0.0) for signal in p.modal] for p in mine] + [[s(mine[-1].span) for s in mine[-1].modal]])
    exact = states[:, :modes.omega.size]
    np.testing.assert_allclose(z, exact, rtol=0, atol=tolerance * np.abs(exact).max())
    return mine


# one mode, printed numbers

def test_exact_stick_slip_at_resonance():
    result = driven()
    assert half_swing(result) == pytest.approx(0.28704671337871602595, rel=1e-11)
    assert result.log.count == 800
    assert energy_balance(result.ledger) < 1e-10


def test_exact_release_phase_and_slip_duration():
    drive = BaseSine(5 * G_N, W)
    last = phases_of(modes_of(W, 0.003), drive, 0.4 * LOAD, 0.4 * LOAD, 200)[-5:-1]
    slips = [p for p in last if p.direction]
    assert len(slips) == 2
    for phase in slips:
        assert phase.theta % pi == pytest.approx(0.538622, abs=5e-7)
        assert phase.span * W == pytest.approx(2.472613, abs=5e-7)
    assert starts(driven()) == pytest.approx([0.538622] * len(starts(driven())), abs=5e-7)
    stuck = sum(p.span for p in last if p.direction == 0) / sum(p.span for p in last)
    assert stuck == pytest.approx(0.213, abs=5e-4)
    assert driven().loops[0].stuck / (10 * drive.period) == pytest.approx(stuck, rel=1e-12)


def test_exact_growing_motion_after_200_cycles():
    result = driven(static=0.25)
    assert half_swing(result) == pytest.approx(59.1610896, abs=1e-7)
    assert largest(result) == pytest.approx(59.1676969670915519, rel=1e-11)
    assert energy_balance(result.ledger) < 1e-10


def test_exact_without_damping():
    result = driven(zeta=0.0)
    assert half_swing(result) == pytest.approx(0.29943104174842751488, rel=1e-11)
    assert half_swing(result) == pytest.approx(two_stop_amplitude(0.8), rel=1e-7)
    assert largest(driven(static=0.25, zeta=0.0)) == pytest.approx(228.347458854389, rel=1e-11)


@pytest.mark.share(0)
@pytest.mark.parametrize("cycles, peak", [(200, 4.712429928746), (400, 9.030960646705), (800, 17.668022082624)])
def test_exact_below_the_bounding_ratio(cycles, peak):
    assert largest(driven(static=0.39, zeta=0.0, cycles=cycles)) == pytest.approx(peak, rel=1e-11)


@pytest.mark.parametrize("cycles", [200, 400])
def test_exact_above_the_bounding_ratio(cycles):
    assert half_swing(driven(static=0.395, zeta=0.0, cycles=cycles)) == pytest.approx(0.435537658848, abs=1e-12)


@pytest.mark.parametrize("ratio, amplitude", [(0.8, 0.287047), (0.828, 0.150075), (0.888889, 0.041904)])
def test_table_check_3_stick_slip_amplitudes(ratio, amplitude):
    assert half_swing(driven(static=ratio / 2)) == pytest.approx(amplitude, abs=2e-5)


@pytest.mark.parametrize("frequency, onset, mil", [(150, 4.0, 0.49384), (155, 4.0, 0.41491), (135, 4.2, 0.36939)])
def test_table_check_4_other_frequencies(frequency, onset, mil):
    result = driven(static=onset / 10, frequency=frequency)
    assert half_swing(result) * 5 * G_N / W**2 == pytest.approx(mil * 25.4e-6, rel=2e-5)


@pytest.mark.share(1)
@pytest.mark.parametrize("level, amplitude", [(8.0, 60.5632260810004979), (6.0, 25.1953787788816),
                                              (7.0, 45.4055793050063), (5.5, 12.3343)])
def test_table_check_6_sliding_at_resonance(level, amplitude):
    found = half_swing(driven(level=level, cycles=1500), level)
    assert found == pytest.approx(amplitude, rel=4e-6 if level == 5.5 else 1e-11)
    assert found == pytest.approx(sliding_amplitude(1.0, 4 / level, 0.003), rel=1e-10)


@pytest.mark.share(1)
@pytest.mark.parametrize("frequency, level, amplitude", [(135, 6, 4.83011), (150, 7, 6.21040), (155, 8, 4.15965)])
def test_table_check_7_sliding_beside_resonance(frequency, level, amplitude):
    found = half_swing(driven(frequency=frequency, level=level, cycles=900), level)
    assert found == pytest.approx(amplitude, abs=1e-5)
    assert found == pytest.approx(sliding_amplitude(frequency / 143, 4 / level, 0.003), rel=1e-10)


def test_exact_first_slip_just_above_the_onset():
    """40-digit arithmetic; to leading order the first slip is 9/2 (1 - D)^2."""
    mpmath.mp.dps = 40
    xi, own = mpmath.mpf("0.003"), mpmath.sqrt(1 - mpmath.mpf("0.003")**2)
    for ratio in (0.99, 0.9999, 0.999999):
        static = ratio / 2 * LOAD
        d = mpmath.mpf(static) / mpmath.mpf(5 * G_N)
        t0 = mpmath.asin(d)

        # q'' + 2 xi q' + q = D - sin(t), q = q' = 0 at t0; particular D + cos(t)/(2 xi)
        def rate(s, t0=t0, d=d):
            a = -d - mpmath.cos(t0) / (2 * xi)
            b = (mpmath.sin(t0) / (2 * xi) + xi * a) / own
            e, c, n = mpmath.exp(-xi * s), mpmath.cos(own * s), mpmath.sin(own * s)
            free = e * ((-xi * a + own * b) * c - (xi * b + own * a) * n)
            return free - mpmath.sin(t0 + s) / (2 * xi), d + mpmath.cos(t0 + s) / (2 * xi) + e * (a * c + b * n)

        stop = mpmath.findroot(lambda s: rate(s)[0], 3 * mpmath.sqrt(2 * (1 - d)))
        wanted = float(abs(rate(stop)[1]))
        drive = BaseSine(5 * G_N, W)
        stick, slip, rest = phases_of(modes_of(W, 0.003), drive, static, static, 0.45)[:3]
        assert (stick.direction, slip.direction, rest.direction) == (0, -1, 0)
        found = abs(rest.modal[0](0.0)) * W**2 / (5 * G_N)
        # the instant of a release is known to sqrt(eps/(1 - D)) of the slip it starts
        assert found == pytest.approx(wanted, rel=max(1e-9, 1e-10 / (1 - ratio)))
        assert found == pytest.approx(4.5 * (1 - ratio)**2, rel=10 * (1 - ratio) + 0.02 * sqrt(1 - ratio))


# stick

@pytest.mark.parametrize("static", [0.500001, 0.6])
def test_exact_stuck_below_the_onset(static):
    result = driven(static=static, cycles=30)
    assert result.log.count == 0
    for name in ("modal", "modal_rate", "slide", "slip", "output", "output_rate"):
        assert not getattr(result.response, name).any()
    assert not result.amplitudes.any()
    np.testing.assert_allclose(result.window.force, -result.window.base_acceleration, rtol=0, atol=1e-12 * LOAD)
    np.testing.assert_allclose(result.window.acceleration, result.window.base_acceleration, rtol=0, atol=1e-12 * LOAD)


AXIAL = modes_of(W, 0.003)
WITH_YAW = modes_of([W, 2 * pi * 129], [0.003, 0.003], (1.0, 0.095), (1.0, 0.0), (1.0, 0.0))


@pytest.mark.parametrize("modes", [AXIAL, WITH_YAW], ids=["axial", "with yaw"])
def test_exact_no_drift_while_stuck(modes):
    drive = BaseSine(5 * G_N, W)
    held = 0
    for phase in phases_of(modes, drive, 0.4 * LOAD, 0.4 * LOAD, 40):
        if phase.direction == 0:
            held += 1
            tau = np.linspace(0, phase.span, 50)
            slide = combine(phase.modal, modes.slide).many(tau)
            size = max(np.abs(signal.many(tau)).max() for signal in phase.modal)
            assert np.ptp(slide) <= (0.0 if len(phase.modal) == 1 else 1e-13 * size)
            assert np.abs(phase.force.many(tau)).max() <= 0.4 * LOAD * (1 + 1e-12)
    assert held > 50


# other laws of motion

@pytest.mark.share(0, 3, 6, 9, 11, 14, 17, 20)
@pytest.mark.parametrize("frequency, zeta", [(0, 0.0), (0, 0.5), (60, 0.0), (143, 0.0), (143, 1.0), (143, 1.5),
                                             (300, 0.9999999999)])
@pytest.mark.parametrize("static, kinetic", [(0.4, 0.4), (0.4, 0.15), (0.0, 0.0)])
def test_always_energy_balance(frequency, zeta, static, kinetic):
    result = simulate(modes_of(2 * pi * frequency, zeta), BaseSine(5 * G_N, W), static * LOAD, kinetic * LOAD, 40, 5)
    book = result.ledger
    assert book["power"] > 0 and (book["friction"] > 0) == (kinetic > 0)
    assert energy_balance(book) < 1e-10


def test_exact_rigid_block_on_a_shaking_base():
    """Between stops v = (a/omega)(cos - cos_0) + f t: the first slip by hand."""
    drive, f, a = BaseSine(5 * G_N, W), 0.4 * G_N * 10, 5 * G_N
    start = asin(f / a)
    stop = brentq(lambda th: a * (cos(th) - cos(start)) + f * (th - start), start + 0.5, start + 2 * pi - 0.1,
                  xtol=1e-15)
    moved = (a * (sin(stop) - sin(start) - cos(start) * (stop - start)) + f * (stop - start)**2 / 2) / W**2
    _, slip, rest = phases_of(modes_of(0.0, 0.0), drive, f, f, 2)[:3]
    assert slip.time * W == pytest.approx(start, abs=1e-13)
    assert rest.time * W == pytest.approx(stop, abs=1e-13)
    assert rest.modal[0](0.0) == pytest.approx(moved, rel=1e-12)


def test_exact_undamped_resonance_without_friction():
    result = simulate(modes_of(W, 0.0), BaseSine(5 * G_N, W), 0.0, 0.0, 100, 3)
    t = result.response.time
    exact = -5 * G_N / (2 * W**2) * (np.sin(W * t) - W * t * np.cos(W * t))
    np.testing.assert_allclose(result.response.slide, exact, rtol=0, atol=1e-12 * np.abs(exact).max())
    assert largest(result) == pytest.approx(100 * pi, rel=1e-12)
    assert half_swing(result) == pytest.approx(99.75 * pi, rel=1e-12)
    assert energy_balance(result.ledger) < 1e-12


@pytest.mark.parametrize("zeta", [0.01, 0.0])
def test_exact_damped_response_without_friction(zeta):
    """Steady amplitude a/|w^2 - om^2 + 2 i zeta w om| once the free motion is gone; without damping both stay."""
    om, a = 2 * pi * 120, 5 * G_N
    t = np.linspace(0, 200 * 2 * pi / om, 2001)
    result = simulate(modes_of(W, zeta), BaseSine(a, om), 0.0, 0.0, 200, 200)
    if zeta:
        tail = result.amplitudes[-20:]
        wanted = a / abs(W**2 - om**2 + 2j * zeta * W * om)
        assert (tail[:, 1].max() - tail[:, 0].min()) / 2 == pytest.approx(wanted, rel=1e-4)
    else:
        exact = -a / (W**2 - om**2) * (np.sin(om * t) - om / W * np.sin(W * t))
        found = np.interp(t, result.response.time, result.response.slide)
        np.testing.assert_allclose(found, exact, rtol=0, atol=2e-4 * np.abs(exact).max())


def test_exact_travel_stop():
    a, travel = 5 * G_N, 0.4e-3

    def motion(t):
        return -a / (2 * W**2) * (sin(W * t) - W * t * cos(W * t))

    result = simulate(modes_of(W, 0.0), BaseSine(a, W), 0.0, 0.0, 100, 3, travel)
    assert result.outcome is Outcome.EXCEEDS_TRAVEL
    t = np.linspace(0, 30 * 2 * pi / W, 300_001)
    first = int(np.argmax(np.abs([motion(x) for x in t]) > travel))
    exact = brentq(lambda x: abs(motion(x)) - travel, t[first - 1], t[first], xtol=1e-18)
    assert result.response.time[-1] == pytest.approx(exact, abs=1e-12 * 2 * pi / W * 100)
    assert abs(result.response.output[-1]) == pytest.approx(travel, rel=1e-11)
    assert result.cycles_done == pytest.approx(exact * W / (2 * pi), rel=1e-11)


def test_exact_travel_stop_with_friction():
    full = driven(static=0.25, cycles=40)
    travel = 0.6 * np.abs(full.amplitudes).max()
    result = simulate(modes_of(W, 0.003), BaseSine(5 * G_N, W), 0.25 * LOAD, 0.25 * LOAD, 40, 10, travel)
    assert result.outcome is Outcome.EXCEEDS_TRAVEL
    assert abs(result.response.output[-1]) == pytest.approx(travel, rel=1e-11)
    assert np.abs(result.response.output[:-1]).max() <= travel * (1 + 1e-12)
    assert energy_balance(result.ledger) < 1e-10


def test_exact_harder_to_start_than_to_keep_sliding():
    drive = BaseSine(5 * G_N, 2 * pi * 120)
    mine = agree(modes_of(W, 0.003), drive, 0.45 * LOAD, 0.3 * LOAD, 30, 1e-9)
    assert {p.direction for p in mine} == {-1, 0, 1} and len(mine) > 60


def test_exact_one_mode_against_dop853():
    agree(modes_of(W, 0.003), BaseSine(5 * G_N, W), 0.4 * LOAD, 0.4 * LOAD, 30, 1e-9)


@pytest.mark.share(1)
@pytest.mark.parametrize("static, kinetic", [(0.4, 0.4), (0.42, 0.3)])
def test_exact_two_modes_against_dop853(static, kinetic):
    mine = agree(WITH_YAW, BaseSine(5 * G_N, W), static * LOAD, kinetic * LOAD, 30, 1e-8)
    assert len(mine) > 60


def test_exact_two_strongly_coupled_modes_against_dop853():
    modes = modes_of([W, 2.3 * W], [0.02, 0.05], (0.8, -0.6), (0.7, 0.4), (1.0, 0.3), 1.0)
    agree(modes, BaseSine(5 * G_N, 0.9 * W), 0.2 * LOAD, 0.2 * LOAD, 15, 1e-8)


def two_masses(c=0.0):
    """Two unit masses joined by a unit spring, the first one driven by sin(1.14 t), the second one rubbing."""
    return modes_of([0.0, sqrt(2)], [0.0, c / sqrt(2)], (H, -H), (-H, -H)), BaseSine(1.0, 1.14)


def test_figure_16_two_masses():
    modes, drive = two_masses()
    mine = phases_of(modes, drive, 3.0, 3.0, 400.0 / drive.period)
    assert len(mine) == 286
    assert mine[0].span == pytest.approx(8.079711463905416, abs=1e-12)
    tau = np.linspace(0, mine[0].span, 400)
    assert np.abs(combine(mine[0].modal, modes.slide).many(tau)).max() < 1e-14
    exact = [(10.00410372419476, 0.8994115234033145), (12.96534318337974, -0.5914209838254593),
             (15.73725378200728, 0.8835834423211487)]
    for phase, (time, place) in zip([p for p in mine[1:] if p.direction == 0], exact):
        assert phase.time == pytest.approx(time, abs=1e-11)
        assert slide_of(phase, modes, 0.0) == pytest.approx(place, abs=1e-11)
    assert slide_of(mine[-1], modes, mine[-1].span) == pytest.approx(-0.37952939486, abs=1e-10)


def test_figure_16_with_a_damper():
    modes, drive = two_masses(0.04)
    found = [(p.time, slide_of(p, modes, 0.0)) for p in phases_of(modes, drive, 3.0, 3.0, 17 / drive.period)]
    assert found[1][0] == pytest.approx(8.1230, abs=5e-5)
    printed = [(9.8012, 0.4767), (12.8606, -0.5774), (15.6575, 0.4251)]
    np.testing.assert_allclose(np.array(found)[[2, 4, 6]], printed, rtol=0, atol=6e-5)
    assert energy_balance(simulate(modes, drive, 3.0, 3.0, 30, 5).ledger) < 1e-10


def test_refuses_friction_that_moves_nothing():
    with pytest.raises(PatchfemError, match="no mode moves the interface"):
        simulate(modes_of(W, 0.003, (0.0,), (1.0,), (1.0,)), BaseSine(5 * G_N, W), 1.0, 1.0, 2)


