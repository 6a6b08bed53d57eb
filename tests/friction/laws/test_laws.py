"""Coulomb and elastic-plastic points: closed loops, exact means, no energy from a changing pressure."""

import numpy as np
import pytest
from friction_forms import jenkins_loop
from friction_paths import triangle, upper_pressure, walk
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import Coulomb, TanhLaw
from patchfem.friction.laws.elastic_plastic import ElasticPlastic

ONE = upper_pressure([1.0, 0.5])
PRESSURE = st.just(0.0) | st.floats(1e-6, 4)
ROWS = st.lists(st.tuples(st.floats(-3, 3), PRESSURE, PRESSURE), min_size=1, max_size=40)


@pytest.mark.parametrize("amplitude, length", [(1.0, 0.2), (3.0, 1.0), (0.5, 0.2), (0.5, 2.0)])
@pytest.mark.parametrize("per_stroke", [2, 6, 34])
def test_exact_elastic_plastic_loop(amplitude, length, per_stroke):
    """W = 4 mu N (A - eps), whatever the steps: A = 1, eps = 0.2 gives 3.2."""
    path = triangle(amplitude, 2, per_stroke)
    run = walk(ElasticPlastic(0.3, length), path, ONE)
    cycle = slice(-2 * per_stroke, None)
    work = run.mean[cycle].T @ np.diff(path)[cycle]
    area, end = jenkins_loop(amplitude, length, 0.3)
    assert work == pytest.approx(area * np.array([1.0, 0.5]), abs=1e-13)
    assert run.dissipated[cycle].sum(axis=0) == pytest.approx(work, abs=1e-13)
    assert run.traction[-1] == pytest.approx(-end * np.array([1.0, 0.5]), rel=1e-12)


@given(ROWS, st.floats(0.01, 10))
def test_always_elastic_plastic_creates_no_energy(rows, length):
    """Pressure rising, falling and vanishing between and along the steps: the ledger closes, no loss is negative."""
    law = ElasticPlastic(0.4, length)
    state = law.start(np.array([rows[0][1]]))
    work = 0.0
    total = 0.0
    spent = 0.0
    for dq, s0, s1 in rows:
        step = law.step(state, dq, np.array([s0]), np.array([s1]), 1.0)
        state = step.state
        assert step.dissipated[0] >= -1e-15 and abs(law.traction(state)[0]) <= 0.4 * (
            s0 + s1
        ) / 2 * (1 + 1e-12)
        work = work + step.mean[0] * dq
        spent = spent + step.dissipated[0]
        total += abs(step.mean[0] * dq)
    assert work - spent - law.stored_energy(state)[0] == pytest.approx(
        0, abs=1e-12 * max(total, 1e-3)
    )


def test_exact_falling_pressure_takes_energy_at_rest():
    """Springs of 1 stretched by 0.8: under half the pressure the limit 0.5 is left, with 0.5^2/2 of the 0.8^2/2."""
    law = ElasticPlastic(1.0, 1.0)
    one = np.ones(1)
    state = law.step(law.start(one), 0.8, one, one, 1.0).state
    for step in (law.step(state, 0.0, one / 2, one / 2, 1.0), law.press(state, one, one / 2)):
        assert law.traction(step.state)[0] == pytest.approx(0.5)
        assert step.dissipated[0] == pytest.approx(0.32 - 0.125) and law.stored_energy(step.state)[
            0
        ] == pytest.approx(0.125)
    light = law.press(state, one, 0.9 * one)
    assert law.traction(light.state)[0] == 0.8 and light.dissipated[0] == 0.0


def test_exact_rising_pressure_brings_unstressed_springs_and_slip_breaks_those_in_excess():
    law = ElasticPlastic(1.0, 1.0)
    one = np.ones(1)
    state = law.step(law.start(one), 0.8, one, one, 1.0).state
    state = law.press(state, one, 2 * one).state
    assert law.traction(state)[0] == 0.8 and law.stored_energy(state)[0] == pytest.approx(
        0.8**2 / 4
    )
    # stiffness 2
    assert law.step(state, 0.1, 2 * one, 2 * one, 1.0).mean[0] == pytest.approx(0.8 + 0.1)
    state = law.press(state, 2 * one, one).state
    # 0.1 up to the limit, then three lengths of slip
    slip_path = law.step(state, 0.1 + 3.0, one, one, 1.0)
    assert law.stored_energy(slip_path.state)[0] == pytest.approx(1 / (2 * (1 + np.exp(-3.0))))
    assert slip_path.dissipated[0] == pytest.approx(
        3.0 + 0.09 + 0.8**2 / 4 - law.stored_energy(slip_path.state)[0]
    )


@pytest.mark.parametrize("law, share", [(Coulomb(0.3), 0.3), (TanhLaw(0.3, 1.0), 0.3)])
def test_exact_a_held_traction_follows_a_falling_pressure_only(law, share):
    one = np.ones(1)
    state = law.step(law.start(one), 50.0, one, one, 1.0).state
    assert law.press(state, one, 2 * one).mean[0] == pytest.approx(share)
    assert law.press(state, one, one / 3).mean[0] == pytest.approx(share / 3)
    assert law.traction(law.press(state, one, 0 * one).state)[0] == 0


@given(ROWS)
def test_always_coulomb_dissipates_its_whole_work(rows):
    law = Coulomb(0.3)
    state = law.start(np.array([rows[0][1]]))
    for dq, s0, s1 in rows:
        step = law.step(state, dq, np.array([s0]), np.array([s1]), 1.0)
        state = step.state
        assert step.dissipated[0] == pytest.approx(0.3 * (s0 + s1) / 2 * abs(dq), abs=1e-15)
        assert law.stored_energy(state)[0] == 0
        if dq:
            assert step.mean[0] == pytest.approx(0.3 * (s0 + s1) / 2 * np.sign(dq))
            assert law.traction(state)[0] == pytest.approx(0.3 * s1 * np.sign(dq))


@pytest.mark.parametrize("law", [Coulomb(0.3), ElasticPlastic(0.3, 1.0)])
def test_exact_steps_leave_the_state_they_start_from(law):
    state = law.start(np.ones(2))
    before = np.array(state)
    law.step(state, 0.7, np.ones(2), np.ones(2), 1.0)
    assert np.array_equal(before, np.array(state))
    run = walk(law, np.array([0.0, 1e6, 0.0, 0.0]), upper_pressure([1.0, 0.0]))
    assert np.isfinite(np.concatenate([run.mean, run.traction, run.dissipated])).all()
    assert run.traction[1] == pytest.approx([-0.3, 0.0]) and run.mean[1] == pytest.approx(
        [-0.3, 0.0], rel=1e-5
    )
