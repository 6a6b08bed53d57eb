"""Where the slide stops it turns, or it only touches its rest and goes on; nothing happens twice at one instant."""

import numpy as np
import pytest
from march_paths import OMEGA
from test_smooth import ONE, element

from patchfem.core import BaseSine
from patchfem.dynamics.smooth.run import Run
from patchfem.friction.bonds.parameters import Bonds
from patchfem.friction.laws.stretch import points_element

RINGS = Bonds(0.3, 1e-6)
PERIOD = 2 * np.pi / OMEGA


def moved(law, push: float, cycles: float, swift: bool) -> tuple:
    """(Run, times of its reversals [s]) of a motion under a sine of `push` [m s-2]; swift: in a lane."""
    run = Run(ONE, BaseSine(push, OMEGA), law, 20, 1e-9)
    run.swift = swift
    run.until(cycles * PERIOD)
    return run, np.concatenate(run.turns)[:, 0]


@pytest.mark.parametrize("swift", [True, False])
def test_always_a_motion_turns_once_where_it_stops(swift):
    """After its stop at 8.07 cycles it goes on and is back at rest within the first step: it is not astray."""
    run, times = moved(points_element(RINGS, [1.0], [84.82758620689656]), 33.333333333333336, 20, swift)
    assert run.outcome is None and run.time == 20 * PERIOD
    assert 60 < times.size < 300 and np.diff(times).min() > 1e-6 * PERIOD


@pytest.mark.parametrize("swift", [True, False])
@pytest.mark.parametrize(("few", "many"), [(33.0, 34.0), (53.0, 52.0)])
def test_exact_a_motion_that_touches_its_rest_is_that_which_turns_there_twice(few, many, swift):
    """Two turns come with the push. Where they do, to the last bit of it, rate and acceleration vanish together; there
    the motion with them is the one without."""
    law = element(RINGS)
    count = moved(law, few, 1, swift)[1].size
    while abs(many - few) > 2e-14:
        middle = 0.5 * (few + many)
        run, times = moved(law, middle, 1, swift)
        assert run.outcome is None and times.size in (count, count + 2)
        few, many = (middle, many) if times.size == count else (few, middle)
    (one, _), (other, times) = (moved(law, push, 1, swift) for push in (few, many))
    assert times.size == count + 2 and np.diff(times).min() > 0
    size = [1e-6, 1e-6 * OMEGA]  # of the motion and its rate
    assert abs(one.moving.y[:2] - other.moving.y[:2]) / size == pytest.approx(0, abs=1e-8)
