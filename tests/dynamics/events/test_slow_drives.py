"""Drives far below the modes: long leaps agree with short ones, their number does not grow with the cycles of the mode,
and the limit of slow motion is that of statics."""

import event_run
import numpy as np
import pytest
from event_reference import basis_of
from hypothesis import given, settings
from hypothesis import strategies as st

from patchfem.core import BaseSine, Segment
from patchfem.dynamics.one_mode import sdof, slip_kernels
from patchfem.response.measures import energy_balance
from patchfem.structure.drives import Piecewise


def same(one, two, time):
    size = np.abs(two.amplitudes).max()
    np.testing.assert_allclose(one.amplitudes, two.amplitudes, rtol=0, atol=1e-12 * size)
    np.testing.assert_allclose(one.phasors, two.phasors, rtol=0, atol=1e-11 * size)
    np.testing.assert_array_equal(one.log.what, two.log.what)
    np.testing.assert_allclose(one.log.time, two.log.time, rtol=0, atol=time)
    np.testing.assert_array_equal(one.log.interface, two.log.interface)
    for name in ("work_in", "viscous", "friction", "stored"):
        assert one.ledger[name] == pytest.approx(two.ledger[name], rel=1e-10, abs=1e-11 * two.ledger["power"]), name
    assert one.acceleration == pytest.approx(two.acceleration, rel=1e-11)
    np.testing.assert_allclose(one.force_peaks, two.force_peaks, rtol=1e-11)
    assert energy_balance(one.ledger) < 1e-11


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(st.sampled_from([0.003, 0.05, 0.6, 1.0, 1.0001, 3.0]), st.sampled_from([0.02, 0.004]), st.floats(0.1, 0.95),
       st.sampled_from([1.0, 0.9, 0.4]), st.floats(-1, 1))
def test_exact_long_leaps_are_the_short_steps(zeta, omega, friction, ratio, constant):
    modes = basis_of(1.0, zeta)
    drive = Piecewise((Segment(0.0, constant, 1.0, omega, 0.3),), 2 * np.pi / omega)
    runs, before = [], slip_kernels.LATE
    try:
        for late in (before, 0.0):
            slip_kernels.LATE = late
            runs.append(sdof.simulate(modes, drive, friction, ratio * friction, 2, 1))
    finally:
        slip_kernels.LATE = before
    same(*runs, 1e-8)


def test_always_steps_do_not_grow_with_the_cycles_of_the_mode(monkeypatch):
    calls, moved = [], slip_kernels.moved
    monkeypatch.setattr(slip_kernels, "moved", lambda *given: calls.append(1) or moved(*given))
    for zeta in (0.003, 0.5, 1.0, 4.0):
        counts = []
        for omega in (1e-4, 1e-7):
            calls.clear()
            done = sdof.events(basis_of(1.0, zeta), BaseSine(1.0, omega), 0.3, 0.3, 2)
            counts.append(len(calls))
        assert len(done) > 6 and max(counts) < 3000, (zeta, counts)


@pytest.mark.parametrize("zeta", [0.01, 1.0, 5.0])
def test_exact_the_limit_of_slow_motion_is_statics(zeta):
    """A spring behind a sliding block: the slide lags by the limit over the stiffness, each cycle loses four times the
    limit times the slide's amplitude."""
    done = sdof.simulate(basis_of(1.0, zeta), BaseSine(1.0, 1e-7), 0.3, 0.3, 3, 1)
    assert done.amplitudes[-1] == pytest.approx([-0.7, 0.7], abs=1e-5)
    _, weight, _, rate, force = done.loop
    assert weight @ (force * rate) == pytest.approx(4 * 0.3 * 0.7, rel=1e-5)
    assert weight.sum() == pytest.approx(2e7 * np.pi, rel=1e-12)
    assert energy_balance(done.ledger) < 1e-12


@pytest.mark.parametrize("zeta", [0.01, 1.0, 5.0])
def test_exact_the_limit_of_slow_motion_is_statics_for_any_modes(zeta):
    """The same by the loop of pieces; the block sticks while the drive falls from its peak by twice the limit."""
    omega = 1e-4
    done = event_run.simulate(basis_of(1.0, zeta), BaseSine(1.0, omega), 0.3, 0.3, 3, 1)
    (loop,) = done.loops
    assert done.amplitudes[-1] == pytest.approx([-0.7, 0.7], abs=1e-5)
    assert loop.work == pytest.approx(4 * 0.3 * 0.7, rel=1e-5) and loop.force == pytest.approx(0.3, rel=1e-12)
    assert loop.stuck == pytest.approx(2 * np.arccos(1 - 2 * 0.3) / omega, rel=4 * (zeta + 0.1) * omega)
    assert energy_balance(done.ledger) < 1e-11
