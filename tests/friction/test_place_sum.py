"""Sums of exponentials over place (report, p = 0, 1, 2) against the list that keeps every bond, the NumPy sum, closed
forms and the checks C5-C8 and C20."""

import numpy as np
import pytest
from friction_paths import random_walk, triangle, upper_pressure, walk
from list_paths import follow_list
from test_friction_hub import OMEGA, one_mode

from patchfem.core import BaseSine
from patchfem.friction import place_sum_kernels as kernels
from patchfem.friction.engines import choose, impossible
from patchfem.friction.law import Bonds
from patchfem.friction.place_step_kernels import place_step
from patchfem.friction.place_sum import CELLS, node_error, nodes_for, place_sum, width_for
from patchfem.friction.quadrature import Quadrature, cutoff
from patchfem.simulate_march import list_model, march, place_model

GROWS = {"ratio": 0.5, "rest_growth": 0.3, "slip_growth": 0.05, "rest_speed": 1e-2}
for kernel in (kernels.place_mean, kernels.place_force, place_step):
    kernel.enable_caching()  # called from Python here alone: compiled once for all workers and runs
AHEAD, COUNT = 41, 7  # force after a step in the numbers; cells in use in row 0


def printed(order, growth=None):
    return Bonds(1.0, 1.0, float(order), "report", initial=0.0, **(growth or {}))


def along(law, path, times=1.0, **knobs):
    """((steps, 3): path mean, force foreseen, force after; stored energies; arrays) over the knots `path`."""
    found = place_sum(law, **knobs)
    arrays = found.cells, found.strips, found.numbers
    rows = []
    for dq, dt in zip(np.diff(path), np.broadcast_to(np.asarray(times, float), len(path) - 1)):
        v = dq / dt if dt > 0 else 0.0
        mean = kernels.place_mean(dq, *arrays, v, dt)
        ahead = kernels.place_force(dq, *arrays, v, dt)
        assert place_step(dq, *arrays, v, v, dt)
        rows.append((mean, ahead, found.numbers[AHEAD], found.numbers[AHEAD - 1]))
    rows = np.array(rows)
    return rows[:, :3], rows[:, 3], found


# ---- against the list and the NumPy sum

@pytest.mark.parametrize("growth", [{}, GROWS])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_exact_random_walks_are_those_of_the_list(order, growth):
    law, path = printed(order, growth), random_walk(4, 700, 0.15)
    got, stored, _ = along(law, path, 0.05)
    want = follow_list(law, path, 0.05)
    most = CELLS * 0.05**3 + 2e-6
    assert np.abs(got[:, 1:].T - want.after).max() <= most
    assert np.abs(got[:, 0] - want.mean).max() <= 1.5 * most
    assert np.abs(stored - want.stored).max() <= 3e-6


@pytest.mark.parametrize("growth", [{}, GROWS])
def test_exact_forces_are_those_of_the_numpy_sum(growth):
    law, path = printed(1, growth), np.interp(np.arange(321) / 8, np.arange(41), random_walk(9, 40, 0.1))
    got, stored, _ = along(law, path, 0.0125)
    run = walk(Quadrature(law, tail=0.0), path, upper_pressure([1.0]), 0.0125)
    assert np.abs(got[:, 2] - run.traction[:, 0]).max() <= (1.5e-4 if growth else 2e-5)  # steps of the sum by NumPy
    assert np.abs(stored - run.stored[:, 0]).max() <= 5e-6


@pytest.mark.parametrize("law", [printed(1), printed(0)])
def test_order_of_the_cells_is_three(law):
    path = 3 * np.sin(2 * np.pi * np.arange(801) / 400)
    want = follow_list(law, path, 0.015).after
    errors = [np.abs(along(law, path, 0.015, width=w, nodes=14, tail=1e-12)[0][:, 2] - want).max()
              for w in (0.2, 0.1, 0.05)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 2.5) and errors[-1] <= CELLS * 0.05**3


def test_order_of_the_nodes_is_geometric():
    """C20, p = 1: J = 8 within 3 x 6.5e-6, every second node gains a factor above ten until the cells' own error."""
    law = printed(1, GROWS | {"rest_growth": 0.9})
    path, dt = 3 * np.sin(2 * np.pi * np.arange(1601) / 800), 2 * np.pi / 800
    want = follow_list(law, path, dt).after
    errors = [np.abs(along(law, path, dt, width=0.025, nodes=j)[0][:, 2] - want).max() for j in (2, 4, 6, 8)]
    assert errors[0] > 10 * errors[1] > 100 * errors[2] and errors[3] <= 3 * 6.5e-6
    for j, error in zip((2, 4, 6), errors):
        assert error <= node_error(law, j) + CELLS * 0.025**3 + 2e-6
    assert nodes_for(law, 1e-5) <= nodes_for(law, 1e-6) <= 12 and nodes_for(printed(1), 1e-9) == 1
    assert CELLS * width_for(1e-6)**3 == pytest.approx(1e-6)


def test_exact_small_amplitudes():
    """Strokes of a thousandth of a bond length, which grow while they last."""
    for growth in ({}, GROWS):
        law = printed(1, growth)
        path = 1e-3 * np.linspace(0.5, 1.5, 2401) * np.sin(2 * np.pi * np.arange(2401) / 12)
        got, _, found = along(law, path, 1e-3)
        assert np.abs(got[:, 2] - follow_list(law, path, 1e-3).after).max() <= 1e-5
        assert found.cells[0, COUNT] < 1000  # of 400 turns at 400 places; 936 at most of 4000


# ---- closed forms

@pytest.mark.parametrize("amplitude, area", [(0.1, 2.659583e-2), (1.0, 2.149259), (5.0, 18.0), (10.0, 38.0)])
def test_exact_c5_triangle_loops_of_order_zero(amplitude, area):
    path = triangle(amplitude, int(np.ceil(6 / amplitude)) + 2, max(20, int(40 * amplitude)))
    mean = along(printed(0), path)[0][:, 0]
    last = 2 * max(20, int(40 * amplitude))
    assert mean[-last:] @ np.diff(path)[-last:] == pytest.approx(area, rel=3e-5)


def test_exact_c6_reversal():
    """p = 0 after a long slide: 2 exp(-2 d) - 1 a way d back."""
    path = np.concatenate([np.linspace(0, 40, 801), 40 - np.linspace(0, 3, 121)[1:]])
    got = along(printed(0), path)[0][800:, 2]
    assert got == pytest.approx(2 * np.exp(-2 * np.linspace(0, 3, 121)[1:]) - 1, abs=1e-5)


def test_exact_c7_energy_created():
    """p = 1, 20 triangle cycles of A = 0.01: W/(4 A n) = -3.9761e-4; p = 2 steady at A = 0.1: -1.7375e-4."""
    path = triangle(0.01, 20, 40)[:-20]
    assert along(printed(1), path)[0][:, 0] @ np.diff(path) / 0.8 == pytest.approx(-3.9761e-4, rel=1e-3)
    path = triangle(0.1, 75, 20)
    got = along(printed(2), path, width=0.02)[0][-40:, 0] @ np.diff(path[-41:]) / 0.4
    assert got == pytest.approx(-1.7375e-4, rel=1e-2)


@pytest.mark.parametrize("order", [0, 1])
def test_exact_c8_healing_under_load(order):
    """l_k = 1e-3, eps_k = 0.5, slid slowly grown then held: 0.5, then 0.81606 and 0.93233 after one and two e-folds."""
    law = printed(order, {"ratio": 0.5, "rest_growth": 10.0, "slip_growth": 1e-3, "rest_speed": 1.0})
    found = place_sum(law)
    arrays, force = (found.cells, found.strips, found.numbers), []
    for dq in np.diff(40 - np.geomspace(40, 1e-5, 1500)):
        place_step(dq, *arrays, dq / 1e-9, dq / 1e-9, 1e-9)
    for _ in range(3):
        force.append(found.numbers[AHEAD])
        assert place_step(0.0, *arrays, 0.0, 0.0, 0.1)
    assert force == pytest.approx([0.5, 0.81606, 0.93233], abs=1e-3 if order == 0 else 1e-4)


def test_exact_one_step_of_a_million_bond_lengths():
    for growth, want in (({}, 1.0), (GROWS, 0.5)):
        law = printed(1, growth)
        got, _, found = along(law, np.array([0.0, 0.5, 1e6, 1e6 - 0.3, 1e6 + 30]), 1e-6)
        near = follow_list(law, np.array([0.0, 40.0, 39.7]), 1e-6).after[-1]
        assert got[1, 2] == pytest.approx(want, rel=0.12 if growth else 1e-8)
        assert got[2, 2] == pytest.approx(near, abs=2e-3 if growth else 1e-5)
        assert got[:, 1] == pytest.approx(got[:, 2], abs=1e-6) and found.cells[0, COUNT] < found.cells.shape[0]


# ---- memory

def test_always_long_runs_stay_bounded_and_right():
    """1e5 random steps, then the force of the same bonds by the list that only knows the last of the path."""
    steps = np.random.default_rng(3).normal(0, 0.05, 100_000)
    steps[::1000] *= 400.0
    found = place_sum(printed(1))
    arrays = found.cells, found.strips, found.numbers
    for dq in steps:
        place_step(dq, *arrays, dq, dq, 1.0)
    assert found.cells[1, 5] < 3000 and found.cells[1, 6] == 1e-7
    tail = np.concatenate([[0.0], np.cumsum(steps[-1500:])])
    assert found.numbers[AHEAD] == pytest.approx(follow_list(printed(1), tail).after[-1], abs=2e-5)


def test_always_a_trial_leaves_no_trace():
    law = printed(1, GROWS)
    _, _, found = along(law, random_walk(3, 200, 0.3), 0.1)
    arrays = found.cells, found.strips, found.numbers
    before = [part.copy() for part in arrays]
    for dq in (1e-4, -1e-4, 0.7, -0.7, 40.0, -40.0):
        kernels.place_mean(dq, *arrays, dq, 1.0)
    assert all(np.array_equal(a[2:] if a.ndim == 2 and a.shape[1] < 60 else a, b[2:] if b.ndim == 2 and
                              b.shape[1] < 60 else b) for a, b in zip(arrays, before))


# ---- choice and rig

def test_refuses_other_laws():
    for law in (Bonds(1.0, 1.0, 1.0, "stretch"), Bonds(1.0, 1.0, 0.5, "report")):
        with pytest.raises(ValueError, match="order 0, 1 or 2 alone"):
            place_sum(law)
        assert impossible("exponential", law.reading, law.order)
    got = choose(printed(1, GROWS), 1e-3, 0.4, 1000, "exponential")
    assert got.engine == "exponential" and got.nodes > 3 and got.error <= 1e-4 and "nodes" in got.said()


@pytest.mark.parametrize("order, growth", [(0, {}), (1, {"ratio": 0.6, "rest_growth": 10.0, "slip_growth": 5e-6,
                                                         "rest_speed": 1e-4})])
def test_exact_marches_are_those_of_the_list(order, growth):
    law = Bonds(0.4, 1e-4, float(order), "report", initial=0.0, **growth)
    limit = 0.4 * 98.0665
    runs = [march(one_mode(OMEGA, 0.01, 1.0), BaseSine(5 * 9.80665, OMEGA), model, 3, 200, window=3) for model in (
        list_model(law, limit, cutoff(law.order, 1e-9), 0.0), place_model(law, limit, 1e-9, 9, 0.05, 1e-6))]
    size = np.ptp(runs[0].window.slide)
    assert runs[1].window.slide == pytest.approx(runs[0].window.slide, abs=2e-6 * size)
    assert runs[1].window.force == pytest.approx(runs[0].window.force, abs=3e-5 * limit)
    for name in ("created", "dissipated", "friction"):
        assert runs[1].ledger[name] == pytest.approx(runs[0].ledger[name], rel=1e-4, abs=1e-9)
