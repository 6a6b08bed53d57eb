"""Return maps of the laws along prescribed slides against the closed forms of their steady loops."""

from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.record import steady_loop
from patchfem.points import laws
from patchfem.points import return_maps_kernels as maps

AMPLITUDE = 3e-6  # [m]
KEYS = {
    "static": 0.3, "kinetic": None, "bond_length": None, "stiffness": 1e8, "exponent": 2.0, "shape": 0.7,
    "chi": -0.4, "beta": 0.8,
}  # fmt: skip


def move(law, path):
    """Move a point along slides (k,) at 1 s per step; return works (k - 1,) and the state and force at the end."""
    numbers, memory = law.numbers[:, None], law.memory[:, None].copy()
    works = []
    for dq in np.diff(path):
        step = maps.Step(float(dq), 1.0, 0.0, 0.0, 0.0)
        maps.prepare(numbers, memory, 0, step)
        works.append(maps.mean_force(numbers, memory, 0, law.load, step).force * dq)
        maps.advance(numbers, memory, 0, law.load, step)
    return np.array(works), maps.read(numbers, memory, 0, law.load)


def cycle_path(steps: int, cycles: int = 3):
    """Return the slides of cycles that start and end at the lower reversal after a first loading."""
    return AMPLITUDE * np.append(0.0, -np.cos(2 * np.pi * np.arange(cycles * steps + 1) / steps))


@pytest.mark.parametrize("name", ["iwan", "bouc-wen", "elastic-plastic"])
def test_exact_loops_close_with_the_area_of_the_closed_form(name):
    """Force at the tip and area of the loop are those of Masing's rule, of the Bouc-Wen integral and of eq. 3.12."""
    keys = SimpleNamespace(law=name, **KEYS)
    if name == "elastic-plastic":
        keys.bond_length = 1e-6
    load = 400.0
    works, state = move(laws.make_point_law(keys, load), cycle_path(400))
    limit = 0.3 * load
    if name == "elastic-plastic":
        tip, area = limit, 4 * limit * (AMPLITUDE - 1e-6)
    else:
        tip, area = steady_loop(keys, load, AMPLITUDE)
    # The Bouc-Wen law is integrated by Runge-Kutta pieces.
    tolerance = 1e-7 if name == "bouc-wen" else 1e-9
    assert works[-400:].sum() == pytest.approx(area, rel=tolerance)
    assert -state.force == pytest.approx(tip, rel=tolerance)


def test_exact_loop_of_bonds():
    """The loop of bonds with a constant length at an amplitude of one length has the area 0.953623 (nonlocal.md C4)."""
    works, _ = move(laws.make_bonds(Bonds(1.0, AMPLITUDE), 1.0), cycle_path(400, cycles=40))
    assert works[-400:].sum() == pytest.approx(0.953623 * AMPLITUDE, rel=1e-6)


@pytest.mark.parametrize("name", ["iwan", "bouc-wen", "elastic-plastic"])
def test_exact_work_is_stored_or_lost_for_any_path(name):
    """On a random path the work does not depend on how it is divided, and the stored energy never exceeds it."""
    keys = SimpleNamespace(law=name, **KEYS)
    law = laws.make_point_law(keys, 400.0)
    ends = np.append(0.0, np.random.default_rng(3).normal(0.0, AMPLITUDE, 30))
    fine = np.concatenate([np.linspace(a, b, 50)[:-1] for a, b in pairwise(ends)] + [ends[-1:]])
    rough, state = move(law, ends)
    works, fine_state = move(law, fine)
    assert rough.sum() == pytest.approx(works.sum(), rel=1e-6)
    assert state.force == pytest.approx(fine_state.force, rel=1e-5)
    assert 0 <= state.energy <= works.sum()


@pytest.mark.parametrize("law", [laws.make_cubic(1e15), laws.make_interlocking(1e7, 5e-6)])
def test_exact_springs_return_their_energy(law):
    """A spring returns all work on a closed path."""
    works, _ = move(law, np.array([0.0, 1e-6, -2e-6, 3e-6, 0.0]))
    assert abs(works.sum()) <= 1e-14 * np.abs(works).sum()


@pytest.mark.parametrize("name", ["iwan", "bouc-wen", "elastic-plastic"])
def test_tangent_is_the_derivative_of_the_mean_force(name):
    """The derivative by the increment agrees with a difference quotient."""
    law = laws.make_point_law(SimpleNamespace(law=name, **KEYS), 400.0)
    numbers, memory = law.numbers[:, None], law.memory[:, None].copy()
    first = maps.Step(4e-7, 1.0, 0.0, 0.0, 0.0)
    maps.advance(numbers, memory, 0, law.load, first)

    def mean(dq):
        return maps.mean_force(numbers, memory, 0, law.load, maps.Step(dq, 1.0, 0.0, 0.0, 0.0))

    for dq in (3e-7, -5e-7, -2e-6):
        change = 1e-11
        slope = (mean(dq + change).force - mean(dq - change).force) / (2 * change)
        assert mean(dq).by_increment == pytest.approx(slope, rel=1e-4)


def test_exact_tiny_step_has_accurate_force():
    """The mean force of a step of 1e-12 of the stretch is exact to rounding, without cancellation."""
    point = laws.make_jenkins(3.0, 1.0)
    for stretch in (0.3, -0.7, 0.1):
        # The memory is the force over mu, and the load that stretches.
        memory = np.array(point.memory)[:, None]
        memory[0] = stretch
        for dq in (1e-12, -1e-13, 1e-300, 0.0):
            step = maps.Step(dq, 1.0, 0.0, 0.0, 0.0)
            force, slope = maps.mean_force(point.numbers[:, None], memory, 0, 1.0, step)[:2]
            assert force == pytest.approx(3 * (stretch + dq / 2), rel=1e-14)
            assert slope == pytest.approx(1.5, rel=1e-6)
