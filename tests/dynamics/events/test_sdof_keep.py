"""What a run of one mode keeps of its phases: the compiled pass, plain and in arrays, against quadrature of the motion,
closed forms and the general engine."""

from functools import lru_cache
from math import inf, pi

import event_run
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from patchfem.compiled import load
from patchfem.core import BaseSine, ModalBasis, Segment, Start
from patchfem.dynamics.one_mode import keep_kernels, sdof_keep, sdof_kernels, sdof_samples
from patchfem.dynamics.one_mode.sdof import scene_of, simulate
from patchfem.structure.drives import Piecewise


@lru_cache(maxsize=1)
def compiled():
    return load("dynamics.one_mode.event_kernels")


def modes_of(omega, zeta, slide=1.0):
    return ModalBasis(("m",), *(np.array([float(v)]) for v in (omega, zeta, slide, 1.0, 1.0)), 1.0)


def phases(block, per, z=0.0, v=0.0):
    """The rows of a whole run of a OneMode."""
    state, book, rows = np.zeros(9), np.zeros(10), np.zeros((3000, 10))
    sdof_kernels.enter(state, block.segments, 0, 0.0, 0.0, z, v, 1.0, *block.friction, block.w**2)
    code, used = sdof_kernels.march((block.w, block.decay), block.friction, block.segments, (per, inf, 0.0, 0.0), state,
                                    rows, np.empty((0, 2)), book)
    assert code == sdof_kernels.DONE
    return rows[:used]


def kept(keep, rows, block, per, count, room=1000, v=0.0, parts=1):
    phasors, events, memo = np.zeros((count, 2)), np.zeros((room, 5)), np.array([0.0, np.sign(v), 0.0, 0.0])
    for part in np.array_split(rows, parts):
        keep(part, (block.w, block.decay), block.segments, (per, block.slide, block.friction[0]), phasors, events, memo)
    return phasors, events, memo


DRIVES = st.sampled_from([
    BaseSine(1.0, 1.0), BaseSine(1.0, 0.13), BaseSine(1.0, 2.9),
    Piecewise((Segment(0.0, 0.0, 1.0, 1.0), Segment(9.0, 0.6), Segment(20.0, 0.3, 1.5, 1.0, 2.0)), 2 * pi),
    Piecewise((Segment(0.0, 0.4, 1.0, 2.3, 1.0), Segment(11.0, -0.2, 0.8, 0.7)), 2 * pi)])


@settings(max_examples=12, deadline=None)
@given(DRIVES, st.sampled_from([0.0, 0.003, 0.3, 1.0, 4.0]), st.sampled_from([0.0, 0.05, 0.6]), st.floats(0.3, 1.0),
       st.floats(-2, 2), st.sampled_from([1.0, -2.0]))
def test_exact_the_three_ways_to_keep_agree_with_quadrature(drive, zeta, friction, ratio, v, slide):
    cycles, per = 6, drive.period
    block = scene_of(modes_of(1.0, zeta, slide), drive, friction, ratio * friction, cycles * per)
    rows = phases(block, per, 0.1, v)
    found = [kept(keep, rows, block, per, cycles, v=v, parts=parts) for keep, parts in (
        (keep_kernels.keep, 1), (sdof_keep.keep, 3), (compiled().keep, 2))]
    grid = np.unique(np.concatenate([np.arange(cycles + 1) * per, np.clip(rows[:, 0], 0, cycles * per)]))
    owner, at, weight = sdof_samples.panels(grid[:-1], grid[1:], 3.0)
    assert owner.size == at.size
    mine = np.clip(np.searchsorted(rows[:, 0], at, side="right") - 1, 0, len(rows) - 1)
    z, rate, _ = sdof_samples.states(at - rows[mine, 0], rows, mine, block)
    wanted = np.zeros(cycles, complex)
    np.add.at(wanted, (at / per).astype(int), weight * z * np.exp(-2j * pi * at / per) * (2 / per))
    size = np.abs(z).max()
    for phasors, events, memo in found:
        np.testing.assert_allclose(phasors[:, 0] + 1j * phasors[:, 1], wanted, rtol=0, atol=3e-11 * size)
        np.testing.assert_array_equal(events, found[0][1])
        np.testing.assert_allclose(memo, found[0][2], rtol=1e-12)
        assert memo[3] >= (rate**2 + z**2).max() * 0.5


@pytest.mark.parametrize("zeta, ratio", [(0.003, 1.0), (0.2, 0.31), (0.0, 1.7)])
def test_exact_phasor_of_free_sliding_is_its_closed_form(zeta, ratio):
    """Started in the steady motion, every cycle has the transfer function's phasor; also 1e5 cycles on."""
    modes, drive = modes_of(1.0, zeta), BaseSine(1.0, ratio)
    size = -1 / complex(1 - ratio**2, 2 * zeta * ratio)  # of sin
    start = Start(np.array([size.imag]), np.array([ratio * size.real]))
    done = simulate(modes, drive, 0.0, 0.0, 50, start=start)
    np.testing.assert_allclose(done.phasors, -1j * size, rtol=0, atol=1e-11 * abs(size))


def test_always_compiled_keeps_what_plain_keeps():
    modes, drive = modes_of(1.0, 0.003), BaseSine(1.0, 1.0)
    compiled()
    one, two = (simulate(modes, drive, 0.8, 0.6, 300, compiled=fast) for fast in (False, True))
    np.testing.assert_allclose(two.phasors, one.phasors, rtol=0, atol=1e-11)
    np.testing.assert_allclose(two.amplitudes, one.amplitudes, rtol=0, atol=1e-11)
    assert two.ledger["peak_stored"] == pytest.approx(one.ledger["peak_stored"], rel=1e-12)
    np.testing.assert_array_equal(two.log.what, one.log.what)
    np.testing.assert_allclose(two.log.slide, one.log.slide, rtol=0, atol=1e-11)


@pytest.mark.share(0, 2, 5)
@pytest.mark.parametrize("zeta, friction", [(0.0, 0.3), (0.003, 0.8), (0.9, 0.1), (1, 0.05), (1.7, 0.02), (40.0, 0.3)])
def test_exact_compiled_and_plain_have_the_same_bits(zeta, friction):
    """Extremes of all cycles, and the phasors of the last five windows, which tell the steady motion."""
    compiled()
    for ratio in np.random.default_rng(3).uniform(0.02, 1.9, 4).tolist():
        one, two = (simulate(modes_of(1.1, zeta), BaseSine(1.3, ratio), friction, 0.9 * friction, 30, 3, compiled=fast)
                    for fast in (False, True))
        np.testing.assert_array_equal(one.amplitudes, two.amplitudes)
        np.testing.assert_array_equal(one.phasors[-13:][::3], two.phasors[-13:][::3])


def test_always_the_oldest_events_make_room():
    drive = BaseSine(1.0, 1.0)
    block = scene_of(modes_of(1.0, 0.003), drive, 0.8, 0.8, 40 * drive.period)
    rows = phases(block, drive.period)
    whole = kept(keep_kernels.keep, rows, block, drive.period, 40)
    for keep in (keep_kernels.keep, sdof_keep.keep, compiled().keep):
        _, events, memo = kept(keep, rows, block, drive.period, 40, room=7, parts=30)
        count = int(memo[0])
        assert count == whole[2][0] > 100
        np.testing.assert_array_equal(events[np.arange(count - 7, count) % 7], whole[1][count - 7:count])


def test_exact_general_engine_has_the_same_phasors():
    modes, drive = modes_of(1.3, 0.01), BaseSine(1.0, 0.9)
    one, two = (run(modes, drive, 0.5, 0.4, 7, 1) for run in (simulate, event_run.simulate))
    np.testing.assert_allclose(one.phasors, two.phasors, rtol=0, atol=1e-12)


def test_exact_harmonics_of_the_acceleration():
    """Against trapezoids between samples, and of a mode that never slips: the base alone."""
    modes, drive = modes_of(1.3, 0.01), BaseSine(1.0, 0.9)
    one = simulate(modes, drive, 0.5, 0.4, 9)
    assert abs(one.waves[1]) > 0.01
    w = one.window
    gaps, smooth = np.diff(w.time), (w.acceleration[1:] + w.acceleration[:-1]) / 2  # trapezoids between the samples
    for n, wave in zip((1, 3), one.waves):
        turn = np.exp(-1j * n * 0.9 * (w.time[1:] + w.time[:-1]) / 2)
        assert abs(np.sum(gaps * smooth * turn) * 2 / gaps.sum() - wave) < 1e-4
    stuck = simulate(modes, drive, 2.0, 2.0, 9)
    np.testing.assert_allclose(stuck.waves, [-1j, 0], rtol=0, atol=1e-13)


def test_exact_means_of_the_slide():
    modes, drive = modes_of(1.3, 0.01, -2.0), Piecewise((Segment(0.0, 0.1, 1.0, 0.9, 0.2),), 2 * pi / 0.9)
    one = simulate(modes, drive, 0.2, 0.15, 12, 4)
    for mean, begin in zip(one.means, (8, 11)):
        t = np.linspace(begin, begin + 1, 200_001) * drive.period
        mine = np.interp(t, one.response.time, one.response.slide)
        assert mine[:-1].mean() == pytest.approx(mean, abs=1e-4)


@pytest.mark.slow
def test_always_the_memory_of_a_run_does_not_grow_with_its_cycles():
    import tracemalloc

    compiled()
    sizes = []
    for cycles in (200_000, 400_000):
        tracemalloc.start()
        simulate(modes_of(1.0, 0.003), BaseSine(1.0, 1.0), 0.8, 0.8, cycles, compiled=True)
        sizes.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert sizes[1] - sizes[0] < 200_000 * 10 * 8  # extremes and phasor of every cycle
