"""Maps over loads, tilts and load lines: every point equals its own cold solve, and none is lost."""

from __future__ import annotations

import numpy as np
import pytest
from pieces import LENGTH, LOAD, coated_pair, rough
from study_module import study

from patchfem.contact.gaps import crown, tilt
from patchfem.contact.stiffness import tangential_stiffness
from patchfem.contact.unilateral import SOLVED, press
from patchfem.core import Outcome

maps = study("common/maps.py")
press_map = maps.press_map

LOADS = LOAD * np.array([1.0, 0.01, 10.0, 0.3])  # in no order
ANGLES = np.array([1e-4, 0.0, -1e-3, 1e-5])
LINES = LENGTH * np.array([0.2, -0.4, 0.0])
GAPS = {"flat": lambda x: np.zeros(x.size), "crown": lambda x: crown(x, 10.0),
        "rough": lambda x: rough(np.random.default_rng(2), x, 1e-7)}
each_gap = pytest.mark.parametrize("shape", GAPS.values(), ids=GAPS.keys())


def agrees(pair, found, point, state):
    """The numbers of a point are those of a state solved alone."""
    weight, x = pair.interface.weight, pair.interface.x
    active = state.sigma_n > 0
    assert np.abs(found.sigma_n[point] - state.sigma_n).max() <= 1e-9 * state.sigma_n.max()
    assert found.fraction[point] == pytest.approx(weight[active].sum() / weight.sum(), rel=1e-12)
    assert found.peak[point] == pytest.approx(state.sigma_n.max(), rel=1e-9)
    assert found.centre[point] == pytest.approx(state.moment / state.load, abs=1e-9 * LENGTH)
    assert found.approach[point] == pytest.approx(state.approach, rel=1e-9)
    assert found.rotation[point] == pytest.approx(state.rotation, rel=1e-9, abs=1e-18)
    assert found.normal_stiffness[point] == pytest.approx(tangential_stiffness(pair.normal, active), rel=1e-9)
    assert found.shear_stiffness[point] == pytest.approx(tangential_stiffness(pair.tangential, active), rel=1e-9)
    assert found.outcome[point] is Outcome.DONE and found.residual[point] <= SOLVED and x.size == state.gap.size


@each_gap
def test_exact_every_held_point_is_its_own_cold_solve(shape):
    pair = coated_pair(200)
    gap = shape(pair.interface.x)
    found = press_map(pair, gap, LOADS, ANGLES, shear=True, keep=True)
    assert found.fraction.shape == (4, 4, 1) and found.sigma_n.shape == (4, 4, 1, 201) and not found.reasons
    for n, load in enumerate(LOADS):
        for a, angle in enumerate(ANGLES):
            agrees(pair, found, (n, a, 0), press(pair, gap + tilt(pair.interface.x, angle), load, rotation=angle))


@each_gap
@pytest.mark.parametrize("spring", [0.0, 1e4])
def test_exact_every_point_under_a_load_line_is_its_own_cold_solve(shape, spring):
    pair = coated_pair(200)
    gap = shape(pair.interface.x)
    found = press_map(pair, gap, LOADS, ANGLES[:2], LINES, spring, shear=True, keep=True)
    assert found.fraction.shape == (4, 2, 3) and not found.reasons
    for n, load in enumerate(LOADS):
        for a, angle in enumerate(ANGLES[:2]):
            for k, line in enumerate(LINES):
                tilted = gap + tilt(pair.interface.x, angle)
                agrees(pair, found, (n, a, k), press(pair, tilted, load, load * line, angle, spring=spring))
