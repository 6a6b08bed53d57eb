"""Steady motion of one mode with one interface: printed numbers, long marches, closed forms, disturbed marches."""

from functools import lru_cache
from math import inf, pi

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from patchfem.closed_forms.dynamics import sliding_amplitude, two_stop_amplitude
from patchfem.compiled import load
from patchfem.core import BaseSine, ModalBasis, PatchfemError, Start
from patchfem.dynamics.one_mode import orbit_kernels, sdof, sdof_kernels, slip_kernels
from patchfem.dynamics.one_mode.steady import Regime, jenkins_point, motions, point, response
from patchfem.structure.drives import levels


@lru_cache(maxsize=1)
def events():
    return load("dynamics.one_mode.event_kernels")


@lru_cache(maxsize=1)
def kernels():
    return load("dynamics.one_mode.steady_kernels")


def modes_of(omega=1.0, zeta=0.003, slide=1.0, base=1.0, output=1.0, mass=1.0):
    return ModalBasis(("m",), *(np.array([float(v)]) for v in (omega, zeta, slide, base, output)), mass)


def steady(friction, zeta=0.003, ratio=1.0, kinetic=None, omega=1.0, **kw):
    kinetic = friction if kinetic is None else kinetic
    return point(modes_of(omega, zeta), BaseSine(1.0, ratio), friction, kinetic, **kw)


def marched(table, cycles=3000, last=10):
    """Half peak to peak of the last cycles of runs from rest; table (n, 6): w, decay, static, kinetic, B, om."""
    n = len(table)
    size, books, ends = np.zeros((n, 2)), np.zeros((n, 10)), np.zeros((n, 2))
    room = np.zeros((0, 10)), np.zeros(9), np.zeros((1, 6)), np.zeros((cycles, 2))
    assert events().batch(np.column_stack([table, np.zeros((n, 3))]), float(cycles), last, room, size, books, ends) == 1
    return (size[:, 1] - size[:, 0]) / 2


def table_of(zeta, ratios, frictions):
    return np.array([[1.0, zeta, f, f, -1.0, r] for f in frictions for r in ratios])


def points(table):
    rows = np.column_stack([table, np.zeros((len(table), 2))])
    found, phases = np.zeros((len(table), orbit_kernels.FOUND)), np.full((len(table), orbit_kernels.PHASES), np.nan)
    kernels().points(rows, 4000, np.empty(orbit_kernels.OUT), found, phases)
    return found, phases


# printed numbers

@pytest.mark.parametrize("friction, zeta, amplitude, tolerance", [
    (0.8, 0.003, 0.28704671337871602595, 2e-14), (0.8, 0.0, 0.29943104174842751488, 2e-14),
    (0.79, 0.0, 0.435537658848, 2e-12), (0.8280241345, 0.003, 0.15, 1e-9)])
def test_exact_stick_slip_at_resonance(friction, zeta, amplitude, tolerance):
    found = steady(friction, zeta)
    assert found.regime == Regime.STOPS and found.stops == 2 and found.symmetric
    assert found.amplitude == pytest.approx(amplitude, rel=tolerance)
    assert found.residual < 1e-12


def test_exact_phases_and_sticks():
    found = steady(0.8)
    assert found.starts == pytest.approx([0.538622, 0.538622 + pi], abs=5e-7)
    assert 2 * 2.472613 / (2 * pi) == pytest.approx(1 - found.stick_fraction, abs=2e-7)
    other = steady(0.82802)  # table of the rig, check 9
    assert np.degrees(other.starts[0]) == pytest.approx(42.69, abs=5e-3)
    assert other.stick_fraction == pytest.approx(0.3256, abs=1e-4)


@pytest.mark.parametrize("friction, amplitude", [(0.5, 60.5632260810004979), (2 / 3, 25.1953787788816),
                                                 (4 / 7, 45.4055793050063)])
def test_exact_sliding_at_resonance(friction, amplitude):
    found = steady(friction)
    assert found.regime == Regime.SLIDING and found.stops == 0 and found.stick_fraction == 0
    assert found.amplitude == pytest.approx(amplitude, rel=3e-14)
    assert max(map(abs, found.multipliers)) == pytest.approx(np.exp(-2 * pi * 0.003), rel=2e-6)


@pytest.mark.parametrize("frequency, level", [(135, 1.2466), (143, 1.2792), (150, 1.3108), (155, 1.3337)])
def test_table_check_8_knees(frequency, level):
    """The drive over friction at which the stops disappear."""
    low, high = 1.2, 1.4
    while high - low > 1e-5:
        middle = (low + high) / 2
        stops = steady(1 / middle, ratio=frequency / 143).regime == Regime.STOPS
        low, high = (middle, high) if stops else (low, middle)
    assert low == pytest.approx(level, abs=2e-4)


@pytest.mark.parametrize("friction, zeta, ratio", [(0.3, 0.0, 0.7), (0.5, 0.05, 1.4), (0.2, 0.3, 0.9),
                                                   (0.6, 0.02, 0.9)])
def test_exact_sliding_is_den_hartogs(friction, zeta, ratio):
    found = steady(friction, zeta, ratio)
    assert found.regime == Regime.SLIDING
    assert found.amplitude == pytest.approx(sliding_amplitude(ratio, friction, zeta), rel=1e-12)


@pytest.mark.parametrize("above", [1e-3, 1e-4])
def test_exact_beside_the_bounding_ratio(above):
    found = steady(pi / 4 + above, 0.0)
    assert found.regime == Regime.STOPS
    assert found.amplitude == pytest.approx(two_stop_amplitude(pi / 4 + above), rel=1e-8)
    below = steady(pi / 4 - above, 0.0)
    assert below.regime == Regime.UNBOUNDED and below.amplitude == inf
    assert steady(pi / 4 - above, 1e-6).amplitude == pytest.approx(4 * above / (2 * pi * 1e-6), rel=3e-2)


def test_exact_stuck_and_frictionless():
    assert steady(1.0).regime == steady(1e6).regime == Regime.STUCK
    assert steady(1.0).amplitude == 0 and steady(1.0).stick_fraction == 1
    free = steady(0.0, 0.1, 1.3)
    assert free.amplitude == pytest.approx(1 / abs(1 - 1.69 + 0.26j), rel=1e-13)
    assert steady(0.0, 0.0).regime == Regime.UNBOUNDED


@pytest.mark.parametrize("friction, ratio, stops", [(0.9, 0.5, 2), (0.5, 0.15, 4), (0.5, 0.1, 6), (0.5, 0.07, 8)])
def test_exact_stops_per_cycle(friction, ratio, stops):
    """Slow drives let the mode ring on its spring between sticks; as many sticks as a march counts."""
    found = steady(friction, ratio=ratio)
    assert found.regime == Regime.STOPS and found.stops == stops == len(found.starts)
    state, book, rows = np.zeros(9), np.zeros(10), np.zeros((4000, 10))
    segments = np.array([[0.0, 100 * 2 * pi / ratio, 0.0, -1.0, ratio, 0.0]])
    sdof_kernels.enter(state, segments, 0, 0.0, 0.0, 0.0, 0.0, 1.0, friction, friction, 1.0)
    _, used = sdof_kernels.march((1.0, 0.003), (friction, friction), segments, (2 * pi / ratio, inf, 0.0, 0.0), state,
                                 rows, np.empty((0, 2)), book)
    late = rows[:used][rows[:used, 0] > 99 * 2 * pi / ratio]
    assert np.count_nonzero(late[:, 3] == 0) == stops
    assert np.abs(late[:, 4]).max() == pytest.approx(found.amplitude, rel=1e-12)
    released = late[1:][(late[1:, 3] != 0) & (late[:-1, 3] == 0), 1] % (2 * pi)
    np.testing.assert_allclose(np.sort(released), found.starts[:len(released)] if len(released) == stops else
                               [s for s in found.starts if np.abs(released - s).min() < 1e-6], atol=1e-9)


@pytest.mark.parametrize("friction", [0.1, 0.5, 0.7])
def test_exact_rigid_block(friction):
    found = steady(friction, 0.0, 1.3, omega=0.0)
    if friction < 1 / np.sqrt(1 + pi**2 / 4):
        assert found.regime == Regime.SLIDING
        assert found.amplitude * 1.69 == pytest.approx(np.sqrt(1 - (pi * friction / 2)**2), rel=1e-13)
    else:
        assert found.regime == Regime.STOPS and 0 < found.amplitude * 1.69 < 0.3
    assert max(map(abs, found.multipliers)) == pytest.approx(1.0, abs=1e-12)  # where it stands does not matter


# against marches

def test_exact_frequency_response_against_3000_cycles():
    """20 points in every regime."""
    table = table_of(0.003, np.linspace(0.4, 1.6, 5), (0.4, 0.65, 0.8, 0.9))
    found, _ = points(table)
    assert set(found[:, 0]) == {orbit_kernels.STOPS, orbit_kernels.SLIDING}
    np.testing.assert_allclose(found[:, 2], marched(table), rtol=4e-11)


@pytest.mark.slow
def test_exact_frequency_response_of_301_points():
    table = table_of(0.003, np.linspace(0.3, 1.7, 301), (0.4, 0.65, 0.8, 0.95))
    found, _ = points(table)
    np.testing.assert_allclose(found[:, 2], marched(table), rtol=4e-11)


@settings(max_examples=25)
@given(st.sampled_from([0.003, 0.03, 0.3, 1.0, 2.0]), st.floats(0.05, 0.98), st.floats(-1.8, 1.0).map(np.exp))
def test_always_as_a_march(zeta, friction, ratio):
    table = np.array([[1.0, zeta, friction, friction, -1.0, float(ratio)]])
    found, phases = points(table)
    assert found[0, 2] == pytest.approx(marched(table)[0], rel=4e-11)
    plain = steady(friction, zeta, float(ratio))
    assert plain.amplitude == pytest.approx(found[0, 2], rel=1e-12)
    assert plain.condition == pytest.approx(found[0, 3], rel=1e-7)
    assert [plain.regime, plain.stops] == [tuple(Regime)[int(found[0, 0])], found[0, 1]]
    np.testing.assert_allclose(plain.starts, np.sort(phases[0][~np.isnan(phases[0])]), atol=1e-9)


@pytest.mark.parametrize("friction, kinetic, zeta, ratio, periods, stops", [
    (0.78348258, 0.75015892, 0.05, 1.03988092, 1, 2), (0.2721165, 0.1821656, 0.003, 0.496223, 1, 1),
    (0.2345384, 0.1100844, 0.003, 0.31121007, 25, None), (0.45029613, 0.1698178, 0.003, 0.42124622, 51, None)])
def test_exact_more_static_than_kinetic_friction(friction, kinetic, zeta, ratio, periods, stops):
    """Where static friction is larger, motions that are not symmetric or repeat late only: those a march ends on."""
    row = np.array([[1.0, zeta, friction, kinetic, -1.0, ratio]])
    found, _ = points(row)
    assert found[0, 7] == periods and (stops is None or found[0, 1] == stops)
    assert found[0, 2] == pytest.approx(marched(row, 4000, max(10, periods))[0], rel=1e-10)


# disturbances

@pytest.mark.share(1, 2, 3, 4, 5)
@pytest.mark.parametrize("friction, kinetic, zeta, ratio", [
    (0.8, 0.8, 0.003, 1.0), (0.5, 0.5, 0.003, 1.0), (0.7, 0.7, 0.05, 0.3), (0.3, 0.3, 0.2, 1.7), (0.9, 0.7, 0.05, 1.1),
    (0.4, 0.4, 1.5, 0.8)])
def test_exact_multipliers_of_a_disturbed_march(friction, kinetic, zeta, ratio):
    """The change of (z, v) after a period per small change before it, from the bare event loop; through a stick the
    lost direction keeps nothing."""
    o = slip_kernels.oscillator(1.0, zeta, ratio)
    found, out, phases = steady(friction, zeta, ratio, kinetic), np.empty(24), np.empty(16)
    theta, z, v = 0.0, 0.0, 0.0
    for _ in range(int(60 + 5 / zeta)):
        assert orbit_kernels.flow(theta, z, v, 2 * pi, -1.0, friction, kinetic, o, out, phases)
        z, v = out[0], out[1]

    def after(z, v):
        state, book = np.zeros(9), np.zeros(10)
        segments = np.array([[0.0, 2 * pi / ratio, 0.0, -1.0, ratio, 0.0]])
        sdof_kernels.enter(state, segments, 0, 0.0, 0.0, z, v, 1.0, friction, kinetic, 1.0)
        sdof_kernels.march((1.0, zeta), (friction, kinetic), segments, (2 * pi / ratio, inf, 1.0, 0.0), state,
                           np.empty((0, 10)), np.empty((0, 2)), book)
        return np.array([state[3], state[4]])

    step = 1e-6 * found.amplitude
    columns = [(after(z + step, v) - after(z - step, v)) / (2 * step)]
    columns.append((after(z, v + step) - after(z, v - step)) / (2 * step) if v != 0 else np.zeros(2))
    measured = np.linalg.eigvals(np.array(columns).T)
    np.testing.assert_allclose(np.sort_complex(measured), np.sort_complex(found.multipliers), atol=2e-5)
    if found.regime == Regime.STOPS:
        assert min(map(abs, found.multipliers)) < 1e-12


@pytest.mark.parametrize("friction, kinetic, zeta, ratio", [(0.8, 0.8, 0.003, 1.0), (0.5, 0.5, 0.003, 1.0),
                                                            (0.3, 0.3, 0.1, 0.4), (0.9, 0.7, 0.05, 1.1)])
def test_exact_condition_is_the_slope(friction, kinetic, zeta, ratio):
    high, low = (steady(friction * (1 + e), zeta, ratio, kinetic * (1 + e)).amplitude for e in (1e-6, -1e-6))
    assert steady(friction, zeta, ratio, kinetic).condition == pytest.approx((high - low) / (2e-6 * friction), rel=1e-6)


def test_exact_scales():
    """Units, signs, output and slide factors of a mode with mass."""
    w, a = 2 * pi * 143, 49.0
    modes = modes_of(w, 0.003, -0.5, -0.8, 1.7, 2.5)
    friction = 0.8 * 0.8 * a * 2.5 / 0.5
    found = point(modes, BaseSine(a, w), friction, friction)
    assert found.amplitude == pytest.approx(1.7 * 0.8 * a / w**2 * 0.28704671337871602595, rel=1e-13)
    assert found.condition == pytest.approx(1.7 * steady(0.8).condition, rel=1e-9)
    kernels()
    curve = response(modes, [BaseSine(a, w * r) for r in (0.9, 1.0)], friction, friction)
    assert curve.amplitude[1] == pytest.approx(found.amplitude, rel=1e-13)
    assert list(curve.regime) == [Regime.SLIDING, Regime.STOPS] and curve.multiplier[1] == pytest.approx(
        found.multipliers[0], rel=1e-9)


# the elastic-plastic spring

@pytest.mark.parametrize("stiffness, peak", [(10, 0.249538145), (100, 0.285786312), (1000, 0.288449682)])
def test_exact_jenkins_peaks(stiffness, peak):
    size, multipliers, miss = jenkins_point(modes_of(), BaseSine(1.0, 1.0), 0.8, stiffness)
    assert size == pytest.approx(peak, abs=6e-10)
    assert miss < 1e-12 and np.abs(multipliers).max() < 1 and np.abs(multipliers).min() < 1e-12


@pytest.mark.share(0)
@pytest.mark.parametrize("stiffness, limit, zeta, ratio", [(10.0, 0.5, 0.05, 1.3), (30.0, 0.3, 0.2, 0.5)])
def test_exact_jenkins_against_dop853(stiffness, limit, zeta, ratio):
    def slope(t, y, way):
        return [y[1], -np.sin(ratio * t) - y[0] - 2 * zeta * y[1] - y[2], 0.0 if way else stiffness * y[1]]

    def ends(t, y, way):
        return y[1] * way if way else limit - abs(y[2])

    ends.terminal, ends.direction = True, -1
    t, y, way, end, top = 0.0, np.zeros(3), 0, 40 * 2 * pi / ratio, 0.0
    while t < end:
        done = solve_ivp(slope, (t, end), y, "DOP853", args=(way,), events=ends, rtol=1e-11, atol=1e-13, max_step=0.1)
        t, y = done.t[-1], done.y[:, -1]
        if t > end - 4 * pi / ratio:
            top = max(top, np.abs(done.y[0]).max())
        if done.status == 1:
            way = 0 if way else int(np.sign(y[2]))
            y[1] = y[1] if way else 0.0
    size, _, _ = jenkins_point(modes_of(1.0, zeta), BaseSine(1.0, ratio), limit, stiffness)
    assert size == pytest.approx(top, rel=1e-9)


def test_refuses_other_drives():
    with pytest.raises(PatchfemError, match=r"drive\.waveform"):
        point(modes_of(), levels([1.0, 2.0], 1.0, 5.0), 0.5, 0.5)
    with pytest.raises(PatchfemError, match=r"friction\.kinetic"):
        point(modes_of(), BaseSine(1.0, 1.0), 0.5, 0.6)


def test_exact_a_start_chooses_between_two_motions():
    """Static friction above the drive holds what rests; what slides already goes on."""
    rest = steady(1.1, 0.003, 1.0, 0.5)
    assert rest.regime == Regime.STUCK
    going = steady(1.1, 0.003, 1.0, 0.5, start=Start(np.array([0.0]), np.array([-50.0])))
    assert going.regime == Regime.SLIDING and going.amplitude == pytest.approx(60.5632260810004979, rel=1e-12)


def test_exact_map_is_point_by_point():
    """Levels, frequencies and loads that stick, stop, slide and grow; weakening friction among them."""
    own = modes_of(3.0, 0.01, slide=-0.7, base=0.8, output=1.3, mass=2.0)
    level, omega = np.array([0.5, 3.0])[:, None, None], np.array([1.5, 3.0, 4.0])[:, None]
    load = np.array([0.2, 1.0, 9.0])
    found = motions(own, level, omega, 0.3 * load, 0.2 * load)
    assert found.amplitude.shape == (2, 3, 3) and set(found.regime.ravel()) >= {"stuck", "stops"}
    for i, j, k in np.ndindex(2, 3, 3):
        one = point(own, BaseSine(level[i, 0, 0], omega[j, 0]), 0.3 * load[k], 0.2 * load[k])
        here = (i, j, k)
        assert found.regime[here] == one.regime and found.omega[here] == omega[j, 0]
        got = [getattr(found, name)[here] for name in ("stops", "amplitude", "stick_fraction", "condition")]
        want = [one.stops, one.amplitude, one.stick_fraction, one.condition]
        np.testing.assert_allclose(got, want, rtol=1e-9, atol=1e-12)
        assert abs(found.multiplier[here]) == pytest.approx(abs(one.multipliers[0]), rel=1e-6, abs=1e-9)


def test_refuses_a_map_of_more_kinetic_than_static_friction():
    with pytest.raises(PatchfemError, match=r"friction\.kinetic"):
        motions(modes_of(), 1.0, 1.0, 0.2, 0.3)
    with pytest.raises(PatchfemError, match="structure"):
        motions(modes_of(slide=0.0), 1.0, 1.0, 0.2)


@pytest.mark.parametrize("friction, kinetic, omega", [
    (0.3, 0.3, 0.7), (0.8, 0.8, 1.0), (0.8, 0.8, 0.3), (0.7, 0.5, 0.9)])
def test_exact_the_state_at_phase_0_repeats(friction, kinetic, omega):
    """A run of as many periods from the state that a map gives ends in it and sweeps the map's amplitude."""
    modes = modes_of()
    found = motions(modes, 1.0, omega, friction, kinetic)
    start = Start([float(found.place)], [float(found.rate)])
    drive, periods = BaseSine(1.0, omega), int(found.periods)
    run = sdof.simulate(modes, drive, friction, kinetic, periods, periods, start=start)
    size = float(found.amplitude)
    assert run.response.modal[-1] == pytest.approx(start.z, abs=1e-10 * size)
    assert run.response.modal_rate[-1] == pytest.approx(start.v, abs=1e-10 * size)
    assert np.ptp(run.amplitudes) / 2 == pytest.approx(size, rel=1e-10)
