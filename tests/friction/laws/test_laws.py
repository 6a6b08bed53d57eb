"""Elastic-plastic points: closed loops, exact step means, and energy under a varying load."""

from types import SimpleNamespace

import numpy as np
import pytest
from friction_forms import jenkins_loop
from friction_paths import march_path, march_under_loads, triangle_path
from hypothesis import given
from hypothesis import strategies as st
from march_contacts import make_contact

from patchfem.time_steps import laws

PRESSURE = st.just(0.0) | st.floats(1e-6, 4)
ROWS = st.lists(st.tuples(st.floats(-3, 3), PRESSURE), min_size=1, max_size=40)
UNIT_LAW = SimpleNamespace(law="elastic-plastic", static=1.0, bond_length=1.0)


@pytest.mark.parametrize("amplitude, length", [(1.0, 0.2), (3.0, 1.0), (0.5, 0.2), (0.5, 2.0)])
@pytest.mark.parametrize("per_stroke", [2, 34])
def test_exact_elastic_plastic_loop_agrees_with_closed_form(amplitude, length, per_stroke):
    """The loop area 4 mu N (A - eps) and the reversal force are exact for any number of steps per stroke."""
    path = triangle_path(amplitude, 2, per_stroke)
    run = march_path(make_contact([laws.make_cells(0.3, length, 0.5)], [np.zeros(0)]), path)
    cycle = slice(-2 * per_stroke, None)
    work = run.mean[cycle] @ np.diff(path)[cycle]
    area, end = jenkins_loop(amplitude, length, 0.3)
    assert work == pytest.approx(0.5 * area, abs=1e-13)
    assert run.dissipated[cycle].sum() == pytest.approx(work, abs=1e-13)
    assert run.traction[-1] == pytest.approx(-0.5 * end, rel=1e-12)


@given(PRESSURE, ROWS, st.floats(0.01, 10))
def test_always_elastic_plastic_energy_balance_closes(start, rows, length):
    """The energy balance of an elastic-plastic point closes under a varying load, and no dissipation is negative."""
    steps, loads = np.transpose(rows)
    law = SimpleNamespace(law="elastic-plastic", static=0.4, bond_length=length)
    path = np.append(0.0, np.cumsum(steps))
    run = march_under_loads(law, path, np.append(start, loads))
    works = run.mean * np.diff(path)
    scale = max(np.abs(works).sum(), 1e-3)
    assert run.dissipated.min() >= -1e-12 * scale
    assert (np.abs(run.traction[:, 0]) <= 0.4 * loads + 1e-15 * (1 + start + loads.max())).all()
    assert (works - run.dissipated).sum() - run.stored[-1] == pytest.approx(0, abs=1e-11 * scale)


def test_exact_falling_load_dissipates_stored_energy():
    """Halving the load at rest limits the force to 0.5 and dissipates the difference of the stored energy."""
    run = march_under_loads(UNIT_LAW, [0.0, 0.8, 0.8], [1.0, 1.0, 0.5])
    assert run.traction[-1, 0] == pytest.approx(0.5)
    assert run.dissipated[-1] == pytest.approx(0.32 - 0.125)
    assert run.stored[-1] == pytest.approx(0.125)


def test_exact_rising_load_adds_unstressed_springs():
    """A rising load adds unstressed springs at an unchanged force; slip after unloading breaks the excess springs."""
    run = march_under_loads(UNIT_LAW, [0.0, 0.8, 0.8, 0.9], [1.0, 1.0, 2.0, 2.0])
    assert run.traction[1, 0] == pytest.approx(0.8, rel=1e-14)
    assert run.stored[1] == pytest.approx(0.8**2 / 4)
    # the added springs double the stiffness
    assert run.mean[-1] == pytest.approx(0.8 + 0.1)

    # elastic over 0.1 up to the limit, then slip over three lengths, in which springs break with order two in the steps
    path = [0.0, 0.8, 0.8, 0.8, *np.linspace(0.9, 3.9, 3001)]
    slip_path = march_under_loads(UNIT_LAW, path, [1.0, 1.0, 2.0, *np.ones(len(path) - 3)])
    stored = slip_path.stored[-1]
    assert stored == pytest.approx(1 / (2 * (1 + np.exp(-3.0))), rel=1e-6)
    dissipated = slip_path.dissipated[-3001:].sum()
    assert dissipated == pytest.approx(3.0 + 0.09 + 0.8**2 / 4 - stored, rel=1e-6)
