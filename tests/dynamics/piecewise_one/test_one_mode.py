"""The loop of one mode against the loop of any modes, and the motion that a run settles to."""

import numpy as np
import pytest

from patchfem.compiled import load
from patchfem.core import BaseSine, ModalBasis, Start
from patchfem.dynamics.piecewise import histories
from patchfem.dynamics.piecewise.elements import elements_of, table_of, virgin
from patchfem.dynamics.piecewise.plant import clock_of
from patchfem.dynamics.piecewise.steady import settled
from patchfem.dynamics.piecewise_one import names_kernels as names
from patchfem.dynamics.piecewise_one import room
from patchfem.dynamics.piecewise_one.steady import settled_alone
from patchfem.response.measures import energy_balance
from patchfem.response.run_events import rings
from patchfem.structure.drives import levels, release, step


def basis(omega, zeta, slide=1.0, base=1.0, output=1.0, mass=1.0):
    return ModalBasis(("one",), *(np.array([one], float) for one in (omega, zeta, slide, base, output)), mass)


def random_run(seed: int) -> tuple:
    """(modes, drive, stiffness, yield slide): rigid, undamped and overdamped modes, below and above resonance."""
    r = np.random.default_rng(seed)
    count, omega = int(np.exp(r.uniform(0, np.log(40)))), r.choice([0.0, 1.0, np.exp(r.uniform(-1, 2))])
    zeta = float(r.choice([0.0, 0.003, 0.1, 1.0, 2.5]))
    modes = basis(omega, zeta, *(r.uniform(0.3, 1.5, 3) * r.choice([-1, 1], 3)), float(np.exp(r.uniform(-1, 1))))
    y, k = np.exp(r.uniform(-3, 0, count)), np.exp(r.uniform(-1, 2, count))
    k *= modes.mass * np.exp(r.uniform(-2, 0.3)) / (k @ y)
    return modes, BaseSine(1.0, float(np.exp(r.uniform(-1, 1)))), k, y


def both(modes, drive, groups, cycles=13, **more):
    """PieceRuns of the same by the loop of one mode and by that of any."""
    alone = histories.simulate(modes, drive, groups, cycles, window=4, **more)
    serves, histories.one.serves = histories.one.serves, lambda *given: False
    try:
        return alone, histories.simulate(modes, drive, groups, cycles, window=4, **more)
    finally:
        histories.one.serves = serves


def same(modes, drive, groups, **more):
    alone, any_modes = both(modes, drive, groups, **more)
    size = np.abs(any_modes.response.modal).max()
    np.testing.assert_allclose(alone.end[0].z, any_modes.end[0].z, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose(alone.amplitudes, any_modes.amplitudes, rtol=0, atol=1e-11 * size)
    np.testing.assert_allclose(alone.phasors, any_modes.phasors, rtol=0, atol=1e-11 * size)
    energy = any_modes.ledger["power"] + any_modes.ledger["peak_stored"]
    for name in ("work_in", "viscous", "friction", "stored", "peak_stored"):
        assert alone.ledger[name] == pytest.approx(any_modes.ledger[name], rel=0, abs=1e-10 * energy), name
    assert alone.ledger["power"] == pytest.approx(any_modes.ledger["power"], rel=0.1)  # the twin's are a few points
    assert energy_balance(alone.ledger) <= 1e-11
    for one, other in zip(alone.loops[0], any_modes.loops[0]):
        assert one == pytest.approx(other, rel=1e-9, abs=1e-9 * max(size, energy, alone.loops[0].force))
    assert len(alone.log.time) == len(any_modes.log.time)


@pytest.mark.parametrize("seed", range(6))
def test_exact_one_mode_as_any_modes(seed):
    modes, drive, k, y = random_run(seed)
    same(modes, drive, [elements_of(k, y)])


def test_exact_a_run_that_stops_for_want_of_rows_is_the_run(monkeypatch):
    """Extremes to the last bit, wherever the rows are full: a batch holds them all."""
    for seed in (1, 3, 5):
        modes, drive, k, y = random_run(seed)
        whole = histories.simulate(modes, drive, [elements_of(k, y)], 13, window=4)
        for rows in (3, 7, 64):
            monkeypatch.setattr(histories, "CHUNK", rows)
            parts = histories.simulate(modes, drive, [elements_of(k, y)], 13, window=4)
            np.testing.assert_array_equal(parts.amplitudes, whole.amplitudes)
            np.testing.assert_array_equal(parts.phasors, whole.phasors)
        monkeypatch.undo()


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(100, 180))
def test_exact_one_mode_as_any_modes_many(seed):
    modes, drive, k, y = random_run(seed)
    same(modes, drive, [elements_of(k, y)], start=Start(np.array([0.3]), np.array([-0.2])))


SETTLING = [(1, 0.3), (24, 0.3), (1, 1.3)]  # elements and frequency of runs that settle within 60 cycles


def settling(count: int, omega: float) -> tuple:
    """(modes, drive, Elements) of a damped mode behind elements that slip."""
    y = np.linspace(0.1, 0.5, count)
    return basis(1.0, 0.1), BaseSine(1.5, omega), [elements_of(np.full(count, 2.0 / count), y)]


@pytest.mark.parametrize(("count", "omega"), SETTLING)
def test_exact_a_motion_that_has_settled_repeats_to_the_last_bit(count, omega):
    """Cycle after cycle is the same, and still that of the loop which never lets it repeat; a push that grows ends
    it."""
    modes, drive, groups = settling(count, omega)
    alone, any_modes = both(modes, drive, groups, 80)
    last = alone.amplitudes[-10:]
    np.testing.assert_array_equal(last, np.repeat(last[:1], 10, axis=0))
    size = np.abs(last).max()
    np.testing.assert_allclose(alone.amplitudes, any_modes.amplitudes, rtol=0, atol=1e-13 * size)
    np.testing.assert_allclose(alone.end[0].z, any_modes.end[0].z, rtol=0, atol=1e-13 * size)
    for name in ("work_in", "viscous", "friction", "stored"):
        assert alone.ledger[name] == pytest.approx(any_modes.ledger[name], rel=1e-12, abs=1e-13)
    assert energy_balance(alone.ledger) <= 1e-13
    grown, other = both(modes, levels([1.5, 1.5 * (1 + 1e-9)], omega, 60, True), groups, 120)
    assert np.all(np.ptp(grown.amplitudes[55:60], axis=0) == 0) and np.ptp(grown.amplitudes[58:], axis=0).max() > 0
    np.testing.assert_allclose(grown.amplitudes, other.amplitudes, rtol=0, atol=1e-13 * size)


def test_exact_states_a_last_digit_apart_are_one_and_others_not():
    """By the distance of a state from that a period before, and by how fast it fell; so does a turning place."""
    come_back = load("dynamics.piecewise_one.repeat_kernels").come_back
    table = table_of([elements_of([1.0, 2.0], [0.1, 0.3])])
    for apart, fell, place, same in ((1e-15, 50, 0.0, True), (1e-15, 50, 1e-13, False), (1e-13, 50, 0.0, False),
                                     (1e-15, 120, 0.0, False), (1e-15, 50, 1e-15, True)):
        memory, clock = virgin(table, np.array([0.5])), clock_of(BaseSine(1.0, 1.0), 1)
        last, motion = room.last_of(3), np.array([[1.0], [0.3]])
        come_back(motion, 1.0, 1.0, memory, clock, last)  # the first state of all
        assert last[0, names.REPEATS] == 0
        clock.now[0], motion[0, 0] = fell, 1 + apart
        memory.at[0, 0] += place
        come_back(motion, 1.0, 1.0, memory, clock, last)
        assert last[0, names.REPEATS] == same and (motion[0, 0] == 1.0) == same
        assert memory.place[0] == (1.0 if same else 0.5) and (memory.at[0, 0] == 0.5) == (same or place == 0.0)


@pytest.mark.share(0, 4, 7)
@pytest.mark.parametrize("seed", range(8))
def test_exact_short_way_to_a_yield_is_the_closed_form(seed):
    """Time, speed and drive where the coordinate has gone a way, and the energies until then, beside the sum of free
    and forced motion; no short way where the coordinate turns first, where it is long, or beyond a border."""
    short, rng, node = load("dynamics.piecewise_one.short_kernels"), np.random.default_rng(seed), np.polynomial.legendre
    place, weight = node.leggauss(20)
    alpha, omega, beta, phase = rng.uniform(0, 0.3), rng.uniform(0.2, 1), rng.uniform(1, 4), rng.uniform(0.2, 2.9)
    gain, v, constant = rng.uniform(-1, 1), rng.choice([-1, 1]) * rng.uniform(1, 2), rng.uniform(0, 0.5)
    own, drive = np.sqrt(beta - alpha**2 / 4), np.exp(1j * phase)
    response, rest = drive / (beta - omega**2 + 1j * alpha * omega), (gain - drive.imag) / beta
    first = -rest - response.imag
    second = (v - (1j * omega * response).imag + alpha / 2 * first) / own

    def motion(t):
        forced, turn = response * np.exp(1j * omega * t), np.exp((1j * own - alpha / 2) * t) * (first - 1j * second)
        return (rest + forced.imag + turn.real, (1j * omega * forced).imag + ((1j * own - alpha / 2) * turn).real)

    span = rng.uniform(0.005, 0.045) / np.sqrt(beta)
    regime, went = (alpha, beta, gain, constant, omega), motion(span)[0]
    push, side = drive.imag, drive.real
    told = short.to_yield(went, v, push, side, regime, 1.0)
    later = np.exp(1j * (phase + omega * span))
    assert told == pytest.approx((span, motion(span)[1], later.imag, later.real), rel=2e-13)
    assert short.to_yield(went, v, push, side, regime, 0.99 * span)[0] == 0.0
    assert short.to_yield(-went, v, push, side, regime, 1.0)[0] == 0.0
    assert short.to_yield(v / np.sqrt(beta), v, push, side, regime, 10.0)[0] == 0.0
    time = span * (1 + place) / 2
    speed, power = motion(time)[1], np.sin(phase + omega * time) + constant
    work, lost = (span / 2 * float(weight @ part) for part in (power * speed, alpha * speed**2))
    found = short.short_energies(span, went, regime, (v, push, side), (told[1], told[2], told[3]))
    assert found == pytest.approx((work, lost, abs(work)), rel=1e-12)


def test_exact_a_push_that_stays_and_levels_one_after_the_other():
    modes, groups = basis(1.3, 0.01), [elements_of([3.0, 1.0], [0.1, 0.4])]
    same(modes, step(0.7, 2 * np.pi), groups)
    same(modes, levels([0.5, 1.0, 0.3], 1.1, 4, True), groups)
    same(modes, release(2 * np.pi), groups, start=Start(np.array([2.0]), np.array([0.0])))


@pytest.mark.parametrize("omega", [2.0, 1.3, 2.9])
def test_exact_power_of_a_drive_of_two_signs(omega):
    """Elements that never yield are a spring, so the power is that of a linear oscillator from rest: in resonance at
    2.0, where it keeps its sign, and beside it, where it does not."""
    modes = basis(1.0, 0.05, base=-1.0)
    done = histories.simulate(modes, BaseSine(1.0, omega), [elements_of([3.0], [1e3])], 6, window=2)
    own = np.sqrt(4.0 - 0.05**2)
    time = np.linspace(0, 12 * np.pi / omega, 400_001)
    gain = 1 / (4.0 - omega**2 + 0.1j * omega)
    forced = (gain * np.exp(1j * omega * time)).imag, (1j * omega * gain * np.exp(1j * omega * time)).imag
    a, b = -forced[0][0], (-forced[1][0] - 0.05 * forced[0][0]) / own
    v = forced[1] + np.exp(-0.05 * time) * ((own * b - 0.05 * a) * np.cos(own * time)
                                            - (own * a + 0.05 * b) * np.sin(own * time))
    assert done.ledger["power"] == pytest.approx(np.trapezoid(np.abs(np.sin(omega * time) * v), time), rel=1e-7)


def test_exact_settled_as_the_map_of_any_modes():
    """Many elements may turn where they turned a period before, within round-off: the map has two slopes there."""
    alike = 0
    for seed in range(41, 52):
        modes, drive, k, y = random_run(seed)
        groups = [elements_of(k, y)]
        done = histories.simulate(modes, drive, groups, 12, window=4)
        one = settled_alone(modes, drive, groups, *done.end)
        if one is None:
            continue
        other = settled(modes, drive, groups, *done.end)
        assert one[0] == pytest.approx(other.amplitude, rel=1e-10)
        largest = [np.abs(each).max(initial=0.0) for each in (one[2], other.multipliers)]
        assert (largest[0] < 1) == (largest[1] < 1)
        alike += largest[0] == pytest.approx(largest[1], rel=1e-6, abs=1e-8)
    assert alike >= 5


def test_exact_a_last_step_that_forgets_a_turn_ends_the_search():
    """Newton's last step may leave a turning place that the period behind it slips past: the point before it counts."""
    modes, drive, k, y = random_run(1068)
    groups = [elements_of(k, y)]
    done = histories.simulate(modes, drive, groups, 40, window=4)
    one = settled(modes, drive, groups, *done.end)
    on = histories.simulate(modes, drive, groups, 2, window=1, start=one.start, memory=one.memory)
    assert one.amplitude == pytest.approx(on.swing, rel=1e-9)
    np.testing.assert_allclose([on.end[0].z, on.end[0].v], [one.start.z, one.start.v], atol=1e-9 * on.swing)


def test_exact_ring_of_an_element_that_holds():
    """In closed form, as a fit to the samples finds it, at the frequency of mode and element together."""
    modes, drive = basis(1.0, 0.02), BaseSine(1.0, 0.31)
    done = histories.simulate(modes, drive, [elements_of([60.0], [0.02])], 20, window=4)
    amplitude, own, damping = done.ring
    assert own == pytest.approx(np.sqrt(61.0 - 0.02**2)) and damping == pytest.approx(0.02 / np.sqrt(61.0))
    assert amplitude > 1e-5
    fitted, errors = rings(done.window, modes, drive, done.log)
    assert fitted["ring_frequency"] == pytest.approx(own / (2 * np.pi), abs=errors["ring_frequency"] + 1e-9)
    assert fitted["ring_damping"] == pytest.approx(damping, abs=errors["ring_damping"] + 1e-8)


def test_exact_nothing_rings_where_sticks_are_short():
    done = histories.simulate(basis(1.0, 0.02), BaseSine(1.0, 1.0), [elements_of([3.0], [0.1])], 20, window=4)
    assert done.ring[0] == 0.0


@pytest.mark.parametrize("push", [0.8, 8.0])
def test_exact_angle_of_what_rings_among_elements_that_yield(push):
    """The sum of own frequency times length over the pieces of a stick, which decides whether its samples have to tell
    a ring: by hand from the rows, and no ring is found where it says none."""
    modes, drive = basis(1.0, 0.02), BaseSine(push, 0.31)
    stiff, limit = np.array([30.0, 15.0, 10.0, 5.0]), np.array([0.003, 0.004, 0.005, 0.006])
    groups = [elements_of(stiff, limit)]
    run = histories._Run(modes, drive, groups, 20, 4, np.inf, None, None)
    run.until(16, False)
    before = float(run.before[0])
    rows = np.concatenate(run.until(20, True))
    out = np.zeros(room.NUMBERS)
    load("dynamics.piecewise_one.window_kernels").rings(rows, before, drive.period, (0.31, push, 0.0), run.alone, out)
    own = np.sqrt(1.0 + rows[:, run._at(0, 1)] - 0.02**2) * rows[:, 1]
    held = rows[:, run._at(0, 2)] < 0.5
    parts = np.split(own, np.flatnonzero(np.diff(held)) + 1)
    sticks = [part.sum() for part, still in zip(parts, np.split(held, np.flatnonzero(np.diff(held)) + 1)) if still[0]]
    assert out[room.SWING] == pytest.approx(max(sticks), rel=1e-12)
    done = histories.simulate(modes, drive, groups, 20, window=4)
    assert (done.ring is None) == (max(sticks) >= room.RINGS)
    if done.ring is not None:
        assert done.ring[0] == 0.0 and rings(done.window, modes, drive, done.log) == ({}, {})
