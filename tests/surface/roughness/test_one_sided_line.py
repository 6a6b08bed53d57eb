"""The one-sided line: the unmoved part of a trace is found beside worn and piled-up parts."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.surface.roughness.levelling import one_sided_line

UM = 1e-6
X = np.arange(1000) * UM


@given(st.floats(-0.02, 0.02), st.integers(100, 300), st.integers(400, 800), st.sampled_from(["above", "below"]))
def test_exact_without_noise(tilt, first, last, side):
    """Flanks of a tenth and more on either side of a worn groove of 5 um: the line to round-off."""
    moved = np.zeros(1000)
    moved[first:last] = 5 * UM * np.sin(np.pi * (np.arange(last - first) + 0.5) / (last - first))
    z = 2e-6 + tilt * X + (moved if side == "above" else -moved)
    line = one_sided_line(X, z, side)
    assert line.at(X) == pytest.approx(2e-6 + tilt * X, abs=1e-15)
    assert line.used[:first].all() and line.used[last:].all() and not line.used[first + 10:last - 10].any()


@pytest.mark.share(0)
@pytest.mark.parametrize("side, sign", [("above", 1), ("below", -1)])
def test_always_noise_moves_the_line_by_little(side, sign):
    """Half of the trace worn 1 to 4 um deep, 20 nm of noise: 200 traces, tilt and offset without a bias of 3 nm."""
    rng = np.random.default_rng(7)
    errors, noises = [], []
    for _ in range(200):
        worn = np.where((X > 250 * UM) & (X < 750 * UM), rng.uniform(1, 4) * UM, 0)
        tilt = rng.uniform(-0.01, 0.01)
        line = one_sided_line(X, sign * worn + tilt * X + rng.normal(0, 20e-9, 1000), side)
        errors.append(line.at(X[[0, 500, -1]]) - tilt * X[[0, 500, -1]])
        noises.append(line.noise)
    assert np.abs(np.mean(errors, axis=0)).max() < 3e-9 and np.std(errors, axis=0).max() < 4e-9
    assert np.mean(noises) == pytest.approx(20e-9, rel=0.1)


def test_always_a_trace_without_wear_gives_the_least_squares_line():
    z = 0.003 * X + np.random.default_rng(1).normal(0, 50e-9, 1000)
    best = np.polyval(np.polyfit(X, z, 1), X)
    assert one_sided_line(X, z).at(X) == pytest.approx(best, abs=8e-9)


def test_exact_levelling_by_least_squares_would_wear_it_away():
    """The trap: the least-squares line through a worn trace lies in the wear."""
    z = np.where(X > 300 * UM, 3 * UM, 0)
    assert abs(np.polyval(np.polyfit(X, z, 1), X[0])) > 0.2 * UM and abs(one_sided_line(X, z).at(X[0])) < 1e-15


@pytest.mark.parametrize("x, side, says", [(X[:1], "above", "at least two heights"),
                                           (X, "left", "use 'above' or 'below'")])
def test_refuses(x, side, says):
    with pytest.raises(PatchfemError, match=says):
        one_sided_line(x, np.zeros(x.size), side)
