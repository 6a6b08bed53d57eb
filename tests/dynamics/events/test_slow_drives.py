"""Drives far below the modes: long pieces and long leaps agree with short ones, their number does not grow with the
cycles of the mode, and the limit of slow motion is that of statics."""

from itertools import islice

import numpy as np
import pytest
from event_reference import basis_of, random_basis
from hypothesis import given, settings
from hypothesis import strategies as st

from patchfem.core import BaseSine, Segment
from patchfem.dynamics.events import histories
from patchfem.dynamics.events.engine import Engine
from patchfem.dynamics.events.following import Follower, Forced
from patchfem.dynamics.one_mode import sdof, slip_kernels
from patchfem.response.measures import energy_balance
from patchfem.structure.drives import Piecewise


def short(monkeypatch, *arguments):
    """A run in short pieces alone."""
    with monkeypatch.context() as patch:
        patch.setattr(Follower, "useful", False)
        return histories.simulate(*arguments)


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


@pytest.mark.share(0, 3)
@pytest.mark.parametrize("ratio, friction", [(1.0, 0.3), (0.7, 0.3), (1.0, 5.0), (1.0, 0.0)])
def test_exact_long_pieces_are_the_short_ones(monkeypatch, ratio, friction):
    modes = basis_of([1.0, 1.7], [0.05, 0.04], [[1.0, 0.5]], [1.0, 0.2], [1.0, -0.4])
    given = modes, BaseSine(1.0, 0.01), friction, ratio * friction, 2, 1
    same(histories.simulate(*given), short(monkeypatch, *given), 1e-9)


def test_exact_long_pieces_of_two_faces_and_of_segments(monkeypatch):
    modes = random_basis(np.random.default_rng(5), 3, 2)
    drive = Piecewise((Segment(0.0, 0.3, 1.0, 0.004, 0.2), Segment(900.0, -0.2, 0.7, 0.006, 1.0)), 2000.0)
    given = modes, drive, np.array([0.3, 0.5]), np.array([0.3, 0.5]), 1, 1
    same(histories.simulate(*given), short(monkeypatch, *given), 1e-8)


def test_always_pieces_do_not_grow_with_the_cycles_of_the_mode():
    modes, counts = basis_of([1.0, 1.7], [0.05, 0.04], [[1.0, 0.5]]), []
    for omega in (1e-4, 1e-6, 1e-8):
        engine = Engine(modes, BaseSine(1.0, omega), 0.3, 0.3, 2, None, True)
        counts.append(len(list(islice(engine.pieces(), 60_000))))
    assert max(counts) < 4000, counts


def test_exact_forced_motion_solves_the_equation_of_motion():
    """Its series has the acceleration that the projected pull gives, at every order that counts."""
    modes = random_basis(np.random.default_rng(2), 4, 2)
    engine = Engine(modes, BaseSine(1.0, 0.7), 50.0, 50.0, 1)
    engine._enter(engine.signs, [0, 1])
    forced = Forced(engine.system, engine.flow, 0.7)
    held, push = np.array([0.2, -0.1]), np.array([0.3, 0.1, -0.2, 0.5])
    coefs = forced.coefs(push, held, 1.3, 0.4, 1.0)
    for u in (0.0, 0.5, 1.0):
        k = np.arange(len(coefs))
        z, v = u**k @ coefs, (k[1:] * u**k[:-1]) @ coefs[1:]
        a = (k[2:] * k[1:-1] * u**k[:-2]) @ coefs[2:]
        pull = push - engine.system.square * z - engine.system.dampers @ v - modes.base * 1.3 * np.sin(0.4 + 0.7 * u)
        np.testing.assert_allclose(a, engine.flow.project @ pull, rtol=0, atol=1e-12)
        np.testing.assert_allclose(engine.faces @ z, held, rtol=0, atol=1e-12)
    assert forced.left(coefs[0], coefs[1], push, held, 1.3, 0.4) < 1e-13


def test_always_what_does_not_die_out_is_not_left_out():
    undamped, rigid = basis_of([1.0, 2.0], 0.0, [[1.0, 1.0]]), basis_of([0.0, 2.0], 0.1, [[1.0, 1.0]])
    for modes in (undamped, rigid):
        engine = Engine(modes, BaseSine(1.0, 1e-3), 0.0, 0.0, 1)
        engine._enter((), [])
        assert not Forced(engine.system, engine.flow, 1e-3).dies


# one mode

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
    general = histories.simulate(basis_of(1.0, zeta), BaseSine(1.0, 1e-7), 0.3, 0.3, 3, 1)
    same(done, general, 1e-2)  # of 2e8 s
    assert done.stick == pytest.approx(general.stick, rel=1e-9)
