"""One mode with one interface in closed form, plain and compiled: printed numbers, 40-digit arithmetic, the general
engine, closed forms of decay and sliding, conservation of energy."""

from functools import lru_cache
from math import asin, cos, inf, pi, sin, sqrt

import event_run
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from patchfem import closed_forms
from patchfem.closed_forms.dynamics import sliding_amplitude, two_stop_amplitude
from patchfem.compiled import load
from patchfem.core import G_N, BaseSine, ModalBasis, NotConverged, Outcome, PatchfemError, Segment, Start
from patchfem.dynamics.one_mode import orbit_kernels, sdof_kernels, slip_kernels
from patchfem.dynamics.one_mode.sdof import _check, simulate
from patchfem.dynamics.one_mode.sdof import events as event_list
from patchfem.dynamics.one_mode.sdof_samples import OneMode, states
from patchfem.response.measures import energy_balance
from patchfem.structure.drives import Piecewise, Recorded, levels, release

W = 2 * pi * 143
PEAK = 0.28704671337871602595  # amplitude over a/omega^2 at resonance, damping 0.003, friction 0.8 of the drive


@lru_cache(maxsize=1)
def events():
    return load("dynamics.one_mode.event_kernels")


def modes_of(omega=1.0, zeta=0.003, slide=1.0, base=1.0, output=1.0, mass=1.0):
    return ModalBasis(("m",), *(np.array([float(v)]) for v in (omega, zeta, slide, base, output)), mass)


def driven(friction, zeta=0.003, ratio=1.0, cycles=200, compiled=False, kinetic=None, omega=1.0, **kw):
    """A run under a unit base acceleration at `ratio` times the natural frequency 1."""
    if compiled:
        events()
    kinetic = friction if kinetic is None else kinetic
    return simulate(modes_of(omega, zeta), BaseSine(1.0, ratio), friction, kinetic, cycles, compiled=compiled, **kw)


def swing(result, last=10):
    tail = result.amplitudes[-last:]
    return (tail[:, 1].max() - tail[:, 0].min()) / 2


def march(engine, friction, zeta=0.003, ratio=1.0, cycles=200, kinetic=None, z=0.0, v=0.0, omega=1.0, rows=4000):
    """(code, rows, extremes, book, state) of the bare event loop under -sin(ratio t)."""
    kinetic = friction if kinetic is None else kinetic
    per, state, book = 2 * pi / ratio, np.zeros(9), np.zeros(10)
    segments = np.array([[0.0, cycles * per, 0.0, -1.0, ratio, 0.0]])
    table, extremes = np.zeros((rows, 10)), np.tile([inf, -inf], (cycles, 1))
    engine.enter(state, segments, 0, 0.0, 0.0, z, v, 1.0, friction, kinetic, omega**2)
    clock = (per, inf, 0.0 if rows else 1.0, 1.0)
    code, used = engine.march((omega, zeta * omega), (friction, kinetic), segments, clock, state, table, extremes, book)
    return code, table[:min(used, rows)], extremes, book, state


both = pytest.mark.parametrize("compiled", [False, True])


# printed numbers

@both
def test_exact_stick_slip_at_resonance(compiled):
    result = driven(0.8, compiled=compiled)
    assert swing(result) == pytest.approx(PEAK, rel=2e-14)
    assert result.events == 801
    assert energy_balance(result.ledger) < 1e-13
    assert result.starts == pytest.approx([0.538622] * len(result.starts), abs=5e-7)
    assert result.stick / (20 * pi) == pytest.approx(0.213, abs=5e-4)


@pytest.mark.share(0, 3, 6, 9)
@both
@pytest.mark.parametrize("friction, zeta, cycles, peak", [
    (0.5, 0.003, 200, 59.1676969670915519), (0.5, 0.0, 200, 228.347458854389), (0.78, 0.0, 200, 4.712429928746),
    (0.78, 0.0, 400, 9.030960646705), (0.78, 0.0, 800, 17.668022082624)])
def test_exact_growing_motion(friction, zeta, cycles, peak, compiled):
    result = driven(friction, zeta, cycles=cycles, compiled=compiled)
    assert np.abs(result.amplitudes).max() == pytest.approx(peak, rel=1e-12)
    assert energy_balance(result.ledger) < 1e-12


@both
def test_exact_no_damping(compiled):
    assert swing(driven(0.8, 0.0, compiled=compiled)) == pytest.approx(0.29943104174842751488, rel=1e-13)
    for cycles in (200, 400):
        assert swing(driven(0.79, 0.0, cycles=cycles, compiled=compiled)) == pytest.approx(0.435537658848, abs=1e-12)


@pytest.mark.share(0)
@pytest.mark.parametrize("above", [1e-3, 3e-4])
def test_exact_beside_the_bounding_ratio(above):
    """Above pi/4 the motion settles on the closed form of two stops, below it grows by pi - 4 D a cycle."""
    ratio = pi / 4 + above
    assert swing(driven(ratio, 0.0, cycles=1500, compiled=True)) == pytest.approx(
        two_stop_amplitude(ratio), rel=1e-6)
    top = np.abs(driven(pi / 4 - above, 0.0, cycles=20_000, compiled=True).amplitudes).max(axis=1)
    assert (top[-1] - top[-5001]) / 5000 == pytest.approx(4 * above, rel=2e-3)


@pytest.mark.parametrize("omega, decay, om", [
    (1.0, 0.003, 1.0), (1.0, 0.0, 1.0), (1.0, 1e-9, 1 + 1e-7), (1.0, 0.0, 1 + 1e-4), (1.0, 0.3, 0.01), (1.0, 0.0, 50.0),
    (1.0, 1.0, 0.7), (1.0, 1 - 1e-9, 0.7), (1.0, 1 + 1e-9, 2.0), (1.0, 1.2, 0.5), (1.0, 30.0, 1.0), (0.0, 0.0, 1.3),
    (0.0, 0.4, 1.3), (1e-6, 0.0, 1.0), (1e-3, 1e-5, 2.0)])
def test_exact_motion_in_40_digits(omega, decay, om):
    """Shift, speed and acceleration over four decades of time, at resonance, without damping, near critical damping,
    without spring; and the same in arrays."""
    mpmath.mp.dps = 120  # the reference divides by the gaps of rates that it parts by 1e-27
    root = mpmath.sqrt(mpmath.mpf(decay)**2 - mpmath.mpf(omega)**2)
    rates = [-mpmath.mpf(decay) + root + mpmath.mpf(10)**-28, -mpmath.mpf(decay) - root - mpmath.mpf(10)**-28,
             mpmath.mpc(0, om) + mpmath.mpf(10)**-29, mpmath.mpf(10)**-27]

    def divided(u, rate, order):  # of r^order exp(r u)
        table = [r**order * mpmath.exp(r * u) for r in rate]
        for k in range(1, len(rate)):
            table = [(table[i + 1] - table[i]) / (rate[i + k] - rate[i]) for i in range(len(table) - 1)]
        return table[0]

    o, v0, g0, bc, bs = slip_kernels.oscillator(omega, decay, om), 0.3, -0.2, 0.7, 0.9
    times = np.array([1e-3, 0.02, 0.2, 0.29, 0.31, 0.8, 2.0, 5.0]) / max(om, omega, 0.1)
    push, sine = g0 - bs, complex(bs, -bc)
    for u in map(float, times):
        exact = []
        for order in range(3):
            out = v0 * divided(u, rates[:2], order) + push * divided(u, [*rates[:2], rates[3]], order)
            out += sine * divided(u, rates[:3], order)
            exact.append(float(out.real))
        found = slip_kernels.motion(u, v0, g0, bc, bs, o)
        size = [abs(v0) * u + u * u, abs(v0) + u, abs(v0) * 2 * decay + 1]
        assert np.all(np.abs(np.array(found) - exact) <= 2e-14 * np.array(size))
        rows = np.array([[0.0, 0.0, u, 1.0, 0.0, v0, g0, bc, bs, 0.0]])
        scene = OneMode(None, omega, decay, (1.0, 1.0), np.array([[0.0, 9e9, 0.0, 1.0, om, 0.0]]), 1.0, 1.0, None)
        many = states(np.array([u]), rows, np.array([0]), scene)[:, 0]
        assert np.all(np.abs(many - exact) <= 2e-14 * np.array(size))


def test_exact_first_slip_at_a_grazing_onset():
    """40-digit arithmetic on the same friction; no digit is lost down to 1 - D = 1e-10."""
    mpmath.mp.dps = 40
    xi, tops = mpmath.mpf(0.003), {}
    own = mpmath.sqrt(1 - xi**2)
    for short in (1e-2, 1e-4, 1e-6, 1e-8, 1e-10):
        d = mpmath.mpf(1 - short)
        t0 = mpmath.asin(d)

        # q'' + 2 xi q' + q = sin(t) - D, q = q' = 0 at t0; particular -D - cos(t)/(2 xi)
        def state(s, t0=t0, d=d):
            a = d + mpmath.cos(t0) / (2 * xi)
            b = (-mpmath.sin(t0) / (2 * xi) + xi * a) / own
            e, c, n = mpmath.exp(-xi * s), mpmath.cos(own * s), mpmath.sin(own * s)
            return (e * (a * c + b * n) - d - mpmath.cos(t0 + s) / (2 * xi),
                    e * ((own * b - xi * a) * c - (xi * b + own * a) * n) + mpmath.sin(t0 + s) / (2 * xi))

        span = mpmath.findroot(lambda s: state(s)[1] / s**2, 3 * mpmath.cos(t0) * mpmath.mpf("0.99"))
        for engine in (sdof_kernels, events()):
            _, rows, extremes, _, _ = march(engine, 1 - short, cycles=30)
            tops[short] = np.abs(extremes[-1]).max()
            assert rows[1, 2] == pytest.approx(float(span), rel=1e-14)
            assert abs(rows[2, 4]) == pytest.approx(float(state(span)[0]), rel=1e-12)
        assert float(state(span)[0]) == pytest.approx(4.5 * short**2, rel=2 * short**0.5)
    assert tops[1e-2] == pytest.approx(2.32402008463e-4, rel=1e-11)
    assert tops[1e-4] == pytest.approx(4.38443200739e-8, rel=1e-11)


@pytest.mark.parametrize("start, rest, time", [(11.5, -0.5, 6 * pi), (11.0, -1.0, 5 * pi),
                                               (11 + 1e-9, -0.999999999, 6 * pi), (0.9, 0.9, 0.0)])
@both
def test_exact_free_decay(start, rest, time, compiled):
    begin = Start(np.array([start]), np.zeros(1))
    result = simulate(modes_of(zeta=0.0), release(2 * pi), 1.0, 1.0, 10, 10, start=begin, compiled=compiled)
    assert result.window.slide[-1] == pytest.approx(rest, abs=2e-14)
    assert np.ptp(result.window.slide[result.window.time > time + 1e-9]) == 0.0
    late = result.window.time
    np.testing.assert_allclose(result.window.slide, closed_forms.decay(late, start, 1.0, 1.0), atol=1e-13 * start)
    assert energy_balance(result.ledger) < 1e-13


# levels, steps, starts

def test_exact_levels_that_do_not_change_are_a_sine():
    one = driven(0.8, cycles=30)
    many = simulate(modes_of(), levels([1.0] * 6, 1.0, 5.0), 0.8, 0.8, 30)
    np.testing.assert_allclose(many.amplitudes, one.amplitudes, rtol=0, atol=1e-13)
    np.testing.assert_allclose(many.phasors, one.phasors, rtol=0, atol=1e-13)


@both
def test_exact_rest_after_the_drive_is_switched_off(compiled):
    """A level of no amplitude is a free decay from where the sine left the mode."""
    drive = levels([1.0, 0.0], 0.8, 7.25)
    result = simulate(modes_of(zeta=0.0), drive, 0.3, 0.3, 30, 30, compiled=compiled)
    off = 7.25 * drive.period
    k = np.searchsorted(result.window.time, off)
    peak = np.sqrt(result.window.slide[k]**2 + result.window.slide_rate[k]**2)
    assert peak > 0.5
    z, v, friction, t = result.window.slide[k], result.window.slide_rate[k], 0.3, result.window.time[k]
    way = np.sign(v)
    size, lead = np.hypot(z + way * friction, v), np.arctan2(v, z + way * friction)
    first = t + (lead if lead > 0 else lead + pi)  # z + way f = size cos(t - lead'), at its next extreme
    after = result.window.time > first
    turned = way * size - way * friction
    expected = closed_forms.decay(result.window.time[after] - first, turned, friction, 1.0)
    np.testing.assert_allclose(result.window.slide[after], expected, atol=1e-11)
    assert energy_balance(result.ledger) < 1e-12


def test_exact_step_of_the_base():
    """A constant acceleration below friction holds for ever; above it the mode swings to a/w^2 - f sgn and stops."""
    held = simulate(modes_of(zeta=0.0), Piecewise((Segment(0.0, 0.5),), 2 * pi), 0.6, 0.6, 5)
    assert not held.window.slide.any()
    moved = simulate(modes_of(zeta=0.0), Piecewise((Segment(0.0, 1.0),), 2 * pi), 0.6, 0.6, 5)
    assert moved.window.slide[-1] == pytest.approx(-2 * (1.0 - 0.6), abs=1e-14)


@pytest.mark.parametrize("z, v", [(3.0, 0.0), (-2.0, 1.5), (0.0, -4.0)])
def test_exact_start_against_dop853(z, v):
    def slope(t, y, way):
        return [y[1], -np.sin(0.7 * t) - y[0] - 0.1 * y[1] - 0.4 * way]

    def stops(t, y, way):
        return y[1] * way

    stops.terminal, stops.direction = True, -1
    way = np.sign(v) if v else -np.sign(z)
    done = solve_ivp(slope, (0, 30), [z, v], "DOP853", args=(way,), events=stops, rtol=1e-12, atol=1e-14)
    run = driven(0.4, 0.05, 0.7, 5, start=Start(np.array([z]), np.array([v])))
    rows = run.response.time > 0
    times = run.response.time[rows]
    t = float(done.t_events[0][0])
    assert np.abs(times - t).min() < 1e-10
    k = int(np.argmin(np.abs(times - t)))
    assert run.response.slide[rows][k] == pytest.approx(done.y_events[0][0][0], abs=1e-11)


def by_dop853(drive, zeta, static, kinetic, end):
    """Times at which slips and sticks begin, what begins, and the states there, for a unit mode from rest."""
    def need(t, y, part):
        return -(part.constant + part.amplitude * np.sin(part.omega * (t - part.start) + part.phase)) - y[0] \
            - 2 * zeta * y[1]

    def up(t, y, way, part):
        return static - need(t, y, part)

    def down(t, y, way, part):
        return static + need(t, y, part)

    def speed(t, y, way, part):
        return way * y[1]

    for event in (up, down, speed):
        event.terminal, event.direction = True, -1
    t, y, way, out = 0.0, np.zeros(2), 0, []
    for part, after in zip(drive.segments, [*(s.start for s in drive.segments[1:]), end]):
        if y[1] == 0:
            way = 0 if abs(need(t, y, part)) <= static else int(np.sign(need(t, y, part)))
        while t < after:
            out.append((t, way, *y))
            done = solve_ivp(lambda t, y, way, part: [y[1], way and need(t, y, part) - way * kinetic], (t, after), y,
                             "DOP853", args=(way, part), events=[speed] if way else [up, down], rtol=1e-12, atol=1e-14,
                             max_step=0.1)
            t, y = done.t[-1], done.y[:, -1].copy()
            if done.status == 0:
                t = after
                break
            if way:
                y[1] = 0.0
                way = 0 if abs(need(t, y, part)) <= static else int(np.sign(need(t, y, part)))
            else:
                way = int(np.sign(need(t, y, part)))
    return np.array(out)


@both
@pytest.mark.parametrize("drive, zeta, static, kinetic", [
    (levels([0.9, 1.3, 0.2], 0.9, 2.3), 0.02, 0.6, 0.6), (levels([1.0, 0.4], 1.4, 3.0), 0.1, 0.5, 0.35),
    (Piecewise((Segment(0.0, 0.2, 1.0, 0.7, 0.3), Segment(9.0, -0.1, 0.5, 1.1, 0.0), Segment(20.0, -0.7)), 2 * pi,
               False), 0.05, 0.4, 0.4)])
def test_exact_drives_in_segments_against_dop853(drive, zeta, static, kinetic, compiled):
    cycles = 6 if drive.segments[-1].amplitude else 4.5
    expected = by_dop853(drive, zeta, static, kinetic, cycles * drive.period)
    found = event_list(modes_of(zeta=zeta), drive, static, kinetic, cycles, compiled=compiled)
    assert len(found) == len(expected) > 6
    np.testing.assert_array_equal(found[:, 4], expected[:, 1])
    np.testing.assert_allclose(found[:, [0, 2, 3]], expected[:, [0, 2, 3]], rtol=0, atol=3e-11)
    run = simulate(modes_of(zeta=zeta), drive, static, kinetic, cycles, 20, compiled=compiled)
    assert energy_balance(run.ledger) < 1e-12
    k = np.searchsorted(run.window.time, found[1:, 0])
    np.testing.assert_allclose(run.window.slide[k], found[1:, 2], rtol=0, atol=1e-12)
    top = np.abs(run.window.acceleration).max()
    assert top * (1 - 1e-12) <= run.acceleration <= top * (1 + 1e-3)


# long runs, extremes of the parameters

@pytest.mark.parametrize("cycles", [100_000, pytest.param(1_000_000, marks=pytest.mark.slow)])
def test_exact_a_million_cycles_without_drift(cycles):
    found = np.zeros(orbit_kernels.FOUND)
    orbit_kernels.point(1.0, 0.003, 0.8, 0.8, -1.0, 1.0, 0.0, 0.0, 100, np.empty(24), np.empty(16), found)
    _, _, extremes, book, state = march(events(), 0.8, cycles=cycles, rows=0)
    assert found[2] == pytest.approx(PEAK, rel=1e-13)
    np.testing.assert_allclose(np.abs(extremes[100:]), found[2], rtol=1e-12)
    assert book[4] == 4 * cycles + 1
    assert book[0] == pytest.approx(book[1] + book[3] + (state[3]**2 + state[4]**2) / 2, rel=1e-11)


@pytest.mark.parametrize("friction", [1e6, 1.0, 1 + 1e-12])
def test_exact_stuck_does_not_move(friction):
    start = Start(np.array([-0.25 * min(friction - 1, 1.0)]), np.zeros(1))
    result = driven(friction, cycles=300, start=start)
    assert np.ptp(result.window.slide) == 0.0 and not result.window.slide_rate.any()
    assert result.stick == pytest.approx(20 * pi, rel=1e-14)


@pytest.mark.parametrize("zeta", [0.05, 0.7])
def test_exact_slight_friction(zeta):
    """Friction 1e-9 of the drive is felt, and by the amount of the closed form."""
    alone = swing(driven(0.0, zeta, 0.9, 120))
    assert alone == pytest.approx(1 / abs(1 - 0.81 + 1.8j * zeta), rel=1e-13)
    found = swing(driven(1e-9, zeta, 0.9, 120))
    assert found == pytest.approx(sliding_amplitude(0.9, 1e-9, zeta), rel=1e-13)
    assert 0.5e-9 < 1 - found / alone < 2e-9


@pytest.mark.parametrize("friction", [0.1, 0.3, 0.5])
def test_exact_rigid_block_that_slides(friction):
    """No spring: v' = a sin - f sgn(v), half stroke sqrt(1 - (pi f/2)^2) a/omega^2 while f < a/sqrt(1 + pi^2/4)."""
    result = driven(friction, 0.0, 1.3, 80, omega=0.0)
    low, high = result.amplitudes[-1]
    assert (high - low) / 2 * 1.3**2 == pytest.approx(sqrt(1 - (pi * friction / 2)**2), rel=1e-12)


@pytest.mark.share(0, 4)
@pytest.mark.parametrize("zeta", [0.0, 0.02, 1.0, 3.0, 200.0])
def test_exact_energy_balance(zeta):
    for friction, ratio in ((0.3, 0.4), (0.6, 1.0), (0.9, 2.0)):
        result = driven(friction, zeta, ratio, 40, kinetic=0.8 * friction)
        assert energy_balance(result.ledger) < 1e-11
        _, weight, _, _, _ = result.loop
        span = result.window.time[-1] - result.window.time[0]
        assert weight.sum() == pytest.approx(span, rel=1e-13)


def test_exact_ledger_by_parts_is_that_of_gauss_points():
    """Work and loss of one slip: integrated by parts against 40-point quadrature of the speed."""
    x, w = np.polynomial.legendre.leggauss(40)
    rng = np.random.default_rng(3)
    for _ in range(40):
        o = slip_kernels.oscillator(1.0, float(rng.choice([0.01, 0.3, 1.0, 2.0])), float(rng.uniform(0.3, 3.0)))
        v0, g0, bc, bs = (float(u) for u in rng.uniform(0.1, 1.0, 4))
        span = float(rng.uniform(0.1, 2.0))
        u = 0.5 * span * (1 + x)
        v = np.array([slip_kernels.motion(t, v0, g0, bc, bs, o)[1] for t in u])
        pull = bs * np.cos(o[5] * u) + bc * np.sin(o[5] * u)
        shift, v1, a1 = slip_kernels.motion(span, v0, g0, bc, bs, o)
        co, so = cos(o[5] * span), sin(o[5] * span)
        work, loss = sdof_kernels.closed_books(span, v0, g0 - o[1] * v0, bs, bc, v1, a1, bs * co + bc * so,
                                               bc * co - bs * so, o)
        assert work == pytest.approx(0.5 * span * w @ (pull * v), abs=1e-11)
        assert loss == pytest.approx(0.5 * span * o[1] * (w @ (v * v)), abs=1e-11)
        assert shift == pytest.approx(0.5 * span * w @ v, abs=1e-12)


# against the general engine and itself

parameters = st.tuples(
    st.sampled_from([0.0, 0.003, 0.3, 1.0, 3.0]) | st.floats(0.0, 1.2), st.floats(-1.0, 1.0).map(np.exp),
    st.sampled_from([0.0]) | st.floats(1e-3, 1.05), st.sampled_from([1.0]) | st.floats(0.3, 1.0),
    st.sampled_from([0.0, 1.0, 1.0, 1.0]), st.sampled_from([1.0, -0.7]), st.sampled_from([1.0, -0.8]))


@settings(max_examples=10)
@given(parameters)
def test_always_as_the_general_engine(case):
    zeta, ratio, share, kinetic, omega, slide, base = case
    modes = modes_of(omega * W, zeta * omega, slide, base, 0.9, 2.5)
    drive = BaseSine(5 * G_N, float(ratio) * W)
    static = share * abs(base / slide) * 2.5 * drive.acceleration
    if abs(share - 1) < 1e-7 or (zeta < 1e-3 and 0 < abs(ratio - 1) < 1e-3):
        return  # there the engine to compare with may keep fewer digits; see the 40-digit motion above
    a = event_run.simulate(modes, drive, static, kinetic * static, 6, 4)
    b = simulate(modes, drive, static, kinetic * static, 6, 4)
    size = max(np.abs(a.amplitudes).max(), 1e-4 * drive.acceleration / drive.omega**2)  # rounding beside it
    assert a.log.what.tolist() == b.log.what.tolist()
    np.testing.assert_allclose(b.amplitudes, a.amplitudes, rtol=0, atol=1e-10 * size)
    np.testing.assert_allclose(b.phasors[[1, 5]], a.phasors[[1, 5]], rtol=0, atol=1e-9 * size)
    found = event_run.starts(a)
    assert len(found) == len(b.starts) and np.allclose(np.sin(2 * found), np.sin(2 * b.starts), atol=1e-7)
    assert b.acceleration == pytest.approx(a.acceleration, rel=1e-9)
    assert energy_balance(b.ledger) < 1e-10
    if a.window.time.shape == b.window.time.shape:
        for name in ("slide", "output", "force", "base_acceleration"):
            one, other = getattr(a.window, name), getattr(b.window, name)
            floor = size if name in ("slide", "output") else 0.0
            np.testing.assert_allclose(other, one, rtol=0, atol=1e-7 * max(np.abs(one).max(), floor), err_msg=name)
    energy = 1e-13 * 2.5 * drive.acceleration * size
    assert b.ledger["peak_stored"] >= b.ledger["stored"]
    for name in ("work_in", "viscous", "friction", "stored"):
        assert b.ledger[name] == pytest.approx(a.ledger[name], abs=1e-9 * a.ledger["power"] + energy), name


@settings(max_examples=15)
@given(parameters, st.floats(-3, 3), st.floats(-3, 3))
def test_always_plain_is_compiled(case, z, v):
    zeta, ratio, share, kinetic, omega, _, _ = case
    one, other = (march(engine, share, zeta * omega, float(ratio), 8, kinetic * share, z, v, omega)
                  for engine in (sdof_kernels, events()))
    assert one[0] == other[0] == 1 and len(one[1]) == len(other[1])
    scale = max(1.0, np.abs(one[2]).max())
    np.testing.assert_allclose(other[1][:, [0, 2, 3, 4]], one[1][:, [0, 2, 3, 4]], rtol=0, atol=1e-9 * scale)
    np.testing.assert_allclose(other[2], one[2], rtol=0, atol=1e-10 * scale)
    np.testing.assert_allclose(other[3][:5], one[3][:5], rtol=1e-9, atol=1e-10 * scale**2)


def test_exact_batch_is_its_runs():
    rng = np.random.default_rng(1)
    table = np.column_stack([np.ones(20), rng.uniform(0, 1.2, 20), rng.uniform(0, 1, 20), np.zeros(20), -np.ones(20),
                             rng.uniform(0.4, 2, 20), np.zeros(20), rng.uniform(-1, 1, 20), rng.uniform(-1, 1, 20)])
    table[:, 3] = table[:, 2]
    size, books, ends = np.zeros((20, 2)), np.zeros((20, 10)), np.zeros((20, 2))
    room = np.zeros((0, 10)), np.zeros(9), np.zeros((1, 6)), np.zeros((20, 2))
    assert events().batch(table, 20.0, 5, room, size, books, ends) == 1
    for row, found, book, end in zip(table, size, books, ends):
        _, _, extremes, own, state = march(sdof_kernels, row[2], row[1], row[5], 20, z=row[7], v=row[8])
        assert found == pytest.approx([extremes[-5:, 0].min(), extremes[-5:, 1].max()], abs=1e-10)
        assert book[:5] == pytest.approx(own[:5], rel=1e-9, abs=1e-9)
        assert end == pytest.approx([state[3], state[4]], abs=1e-9)


@settings(max_examples=120)
@given(st.floats(0, 0.5), st.floats(0, 1), st.floats(-1, 1), st.floats(-1, 1), st.floats(0.0, 3.0),
       st.floats(0.2, 4.0))
def test_always_the_first_stop(v0, g0, bc, bs, zeta, om):
    """Nowhere before the stop that is found is the speed below zero, and there it is zero."""
    o = slip_kernels.oscillator(1.0, zeta, om)
    if v0 < 1e-6:
        v0 = 0.0
        g0, bc = (0.0, abs(bc)) if g0 < 1e-6 else (g0, bc)
        if g0 == 0.0 and bc < 1e-6:
            return
    end, shift, gain = slip_kernels.stop(v0, g0, bc, bs, o, 12.0)
    grid = np.linspace(0, 12.0 if end < 0 else end, 400)[1:-1]
    speed = np.array([slip_kernels.motion(float(t), v0, g0, bc, bs, o)[1] for t in grid])
    assert end != -2 and speed.min() > -1e-13
    if end >= 0:
        there = slip_kernels.motion(end, v0, g0, bc, bs, o)
        assert np.abs(np.array(there) - [shift, 0.0, gain]).max() < 1e-12 * (1 + end)


@pytest.mark.parametrize("over", [1e-3, 1e-6, 1e-9, 1e-12, -1e-12, -1e-9, -1e-6, -1e-3])
def test_exact_a_dip_of_the_speed_is_not_missed(over):
    """A rigid block whose speed v0 - (1 - cos om u) b/om comes down to `over` at om u = pi and goes up again."""
    om, b = 1.3, 0.7
    end = slip_kernels.stop(2 * b / om + over, 0.0, -b, 0.0, slip_kernels.oscillator(0.0, 0.0, om), 20.0)[0]
    if over > 0:
        assert end == -1.0
    else:
        assert end * om == pytest.approx(2 * asin(sqrt(1 + over * om / (2 * b))), abs=1e-15 / sqrt(-over))


@pytest.mark.parametrize("base", [1.0, -1.0])
@pytest.mark.parametrize("stop", [1e-4, 1.1e-4, 1.2e-4])
def test_always_the_longest_travel_ends_the_run(base, stop):
    modes, drive = modes_of(W, 0.003, base=base), BaseSine(8 * G_N, W)
    a = event_run.simulate(modes, drive, 39.0, 39.0, 100, 10, stop)
    b = simulate(modes, drive, 39.0, 39.0, 100, 10, stop)
    assert a.outcome == b.outcome == Outcome.EXCEEDS_TRAVEL
    assert b.cycles_done == pytest.approx(a.cycles_done, rel=1e-10)
    assert abs(b.window.output[-1]) == pytest.approx(stop, rel=1e-10)


def test_refuses_what_it_is_not_for():
    two = ModalBasis(("a", "b"), *(np.ones(2) for _ in range(5)), 1.0)
    with pytest.raises(PatchfemError, match="one mode"):
        simulate(two, BaseSine(1.0, 1.0), 0.1, 0.1, 5)
    with pytest.raises(PatchfemError, match=r"friction\.kinetic"):
        simulate(modes_of(), BaseSine(1.0, 1.0), 0.1, 0.2, 5)
    with pytest.raises(PatchfemError, match=r"drive\.waveform"):
        simulate(modes_of(), Recorded(np.array([0.0, 1.0]), np.zeros(2), 1.0), 0.1, 0.1, 5)
    with pytest.raises(PatchfemError, match="slide"):
        simulate(modes_of(slide=0.0), BaseSine(1.0, 1.0), 0.1, 0.1, 5)
    with pytest.raises(PatchfemError, match="travel"):
        simulate(modes_of(), BaseSine(1.0, 1.0), 0.1, 0.1, 5, travel=1.0, start=Start(np.array([2.0]), np.zeros(1)))


@pytest.mark.parametrize("friction, kinetic, ratio", [(0.3, 0.3, 0.5), (0.6, 0.6, 1.0), (0.5, 0.4, 1.6)])
def test_exact_power_changes_its_sign(friction, kinetic, ratio):
    """The integral of |power in| against fine samples; with and without damping to divide by."""
    for zeta in (0.0, 0.05):
        result = driven(friction, zeta, ratio, 4, kinetic=kinetic, window=4)
        fine = np.linspace(0, result.window.time[-1], 400_001)
        power = np.abs(np.sin(ratio * fine) * np.interp(fine, result.window.time, result.window.slide_rate))
        assert result.ledger["power"] == pytest.approx(power.mean() * fine[-1], rel=1e-4)  # samples 1/400 cycle apart


def test_exact_release_at_rounding_from_its_phase():
    """A stick that begins a rounding error past the release lets go at once, not a cycle later; one that begins where
    the limit is just no longer passed waits for the other direction."""
    for sign in (1.0, -1.0):
        here = asin(0.8) + (0.0 if sign > 0 else pi)
        assert sdof_kernels.release(0.0, sign, here + 1e-15, 0.8)[:2] == (0.0, 1.0)
        wait, way, _, _ = sdof_kernels.release(0.0, sign, here + pi - 2 * asin(0.8) - 1e-15, 0.8)
        assert way == -1.0 and wait == pytest.approx(2 * asin(0.8), abs=1e-12)


def test_exact_release_phase_is_the_arcsine_of_the_need():
    _, rows, _, _, _ = march(sdof_kernels, 0.8, cycles=1)
    assert rows[1, 1] == pytest.approx(asin(0.8), rel=1e-15) and rows[1, 6] == 0.0


def test_refuses_events_that_pile_up_with_the_key_and_what_to_use_instead():
    with pytest.raises(NotConverged, match=r'pile up at t = 0.5 s; .*use method = "march"') as caught:
        _check(sdof_kernels.PILED, 0.5)
    assert caught.value.key == "accuracy.method"
