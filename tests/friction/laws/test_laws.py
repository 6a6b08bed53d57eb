"""Coulomb and elastic-plastic points: closed loops, exact step means, and energy under a varying pressure."""

import numpy as np
import pytest
from friction_forms import jenkins_loop
from friction_paths import march_path, triangle_path, upper_pressure
from hypothesis import given
from hypothesis import strategies as st

from patchfem.friction import Coulomb
from patchfem.friction.laws.elastic_plastic import ElasticPlastic
from patchfem.friction.laws.tanh import TanhLaw

TWO_PRESSURES = upper_pressure([1.0, 0.5])
PRESSURE = st.just(0.0) | st.floats(1e-6, 4)
ROWS = st.lists(st.tuples(st.floats(-3, 3), PRESSURE, PRESSURE), min_size=1, max_size=40)


@pytest.mark.parametrize("amplitude, length", [(1.0, 0.2), (3.0, 1.0), (0.5, 0.2), (0.5, 2.0)])
@pytest.mark.parametrize("per_stroke", [2, 34])
def test_exact_elastic_plastic_loop_agrees_with_closed_form(amplitude, length, per_stroke):
    """The loop area 4 mu N (A - eps) and the reversal force are exact for any number of steps per stroke."""
    path = triangle_path(amplitude, 2, per_stroke)
    run = march_path(ElasticPlastic(0.3, length), path, TWO_PRESSURES)
    cycle = slice(-2 * per_stroke, None)
    work = run.mean[cycle].T @ np.diff(path)[cycle]
    area, end = jenkins_loop(amplitude, length, 0.3)
    assert work == pytest.approx(area * np.array([1.0, 0.5]), abs=1e-13)
    assert run.dissipated[cycle].sum(axis=0) == pytest.approx(work, abs=1e-13)
    assert run.traction[-1] == pytest.approx(-end * np.array([1.0, 0.5]), rel=1e-12)


@given(ROWS, st.floats(0.01, 10))
def test_always_elastic_plastic_energy_balance_closes(rows, length):
    """The energy balance of an elastic-plastic point closes under varying pressure, and no dissipation is negative."""
    law = ElasticPlastic(0.4, length)
    state = law.initial_state(np.array([rows[0][1]]))
    work = 0.0
    total_work = 0.0
    dissipated = 0.0
    for dq, s0, s1 in rows:
        step = law.step(state, dq, np.array([s0]), np.array([s1]), 1.0)
        state = step.state
        assert step.dissipated[0] >= -1e-15 and abs(law.traction(state)[0]) <= 0.4 * (
            s0 + s1
        ) / 2 * (1 + 1e-12)
        work = work + step.mean[0] * dq
        dissipated = dissipated + step.dissipated[0]
        total_work += abs(step.mean[0] * dq)
    assert work - dissipated - law.stored_energy(state)[0] == pytest.approx(
        0, abs=1e-12 * max(total_work, 1e-3)
    )


def test_exact_falling_pressure_dissipates_stored_energy():
    """Halving the pressure at rest limits the traction to 0.5 and dissipates the difference of the stored energy."""
    law = ElasticPlastic(1.0, 1.0)
    unit = np.ones(1)
    state = law.step(law.initial_state(unit), 0.8, unit, unit, 1.0).state
    for step in (law.step(state, 0.0, unit / 2, unit / 2, 1.0), law.press(state, unit, unit / 2)):
        assert law.traction(step.state)[0] == pytest.approx(0.5)
        assert step.dissipated[0] == pytest.approx(0.32 - 0.125) and law.stored_energy(step.state)[
            0
        ] == pytest.approx(0.125)
    small_drop = law.press(state, unit, 0.9 * unit)
    assert law.traction(small_drop.state)[0] == 0.8 and small_drop.dissipated[0] == 0.0


def test_exact_rising_pressure_adds_unstressed_springs():
    """A rising pressure adds unstressed springs at unchanged traction; slip after unloading breaks the excess springs."""
    law = ElasticPlastic(1.0, 1.0)
    unit = np.ones(1)
    state = law.step(law.initial_state(unit), 0.8, unit, unit, 1.0).state
    state = law.press(state, unit, 2 * unit).state
    assert law.traction(state)[0] == 0.8 and law.stored_energy(state)[0] == pytest.approx(
        0.8**2 / 4
    )
    # the added springs double the stiffness
    assert law.step(state, 0.1, 2 * unit, 2 * unit, 1.0).mean[0] == pytest.approx(0.8 + 0.1)
    state = law.press(state, 2 * unit, unit).state
    # elastic over 0.1 up to the limit, then slip over three lengths
    slip_path = law.step(state, 0.1 + 3.0, unit, unit, 1.0)
    assert law.stored_energy(slip_path.state)[0] == pytest.approx(1 / (2 * (1 + np.exp(-3.0))))
    assert slip_path.dissipated[0] == pytest.approx(
        3.0 + 0.09 + 0.8**2 / 4 - law.stored_energy(slip_path.state)[0]
    )


@pytest.mark.parametrize("law, expected", [(Coulomb(0.3), 0.3), (TanhLaw(0.3, 1.0), 0.3)])
def test_exact_traction_follows_only_falling_pressure(law, expected):
    """The traction of Coulomb and tanh laws follows a falling pressure and is unchanged by a rising pressure."""
    unit = np.ones(1)
    state = law.step(law.initial_state(unit), 50.0, unit, unit, 1.0).state
    assert law.press(state, unit, 2 * unit).mean[0] == pytest.approx(expected)
    assert law.press(state, unit, unit / 3).mean[0] == pytest.approx(expected / 3)
    assert law.traction(law.press(state, unit, 0 * unit).state)[0] == 0


@given(ROWS)
def test_always_coulomb_dissipates_all_work(rows):
    """Coulomb's law dissipates all of its work and stores no energy."""
    law = Coulomb(0.3)
    state = law.initial_state(np.array([rows[0][1]]))
    for dq, s0, s1 in rows:
        step = law.step(state, dq, np.array([s0]), np.array([s1]), 1.0)
        state = step.state
        assert step.dissipated[0] == pytest.approx(0.3 * (s0 + s1) / 2 * abs(dq), abs=1e-15)
        assert law.stored_energy(state)[0] == 0
        if dq:
            assert step.mean[0] == pytest.approx(0.3 * (s0 + s1) / 2 * np.sign(dq))
            assert law.traction(state)[0] == pytest.approx(0.3 * s1 * np.sign(dq))
