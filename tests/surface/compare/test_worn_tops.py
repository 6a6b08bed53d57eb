"""Comparison of traces whose tops wear first: ends between tops, slight wear of all tops, few samples, gain and drift."""

import numpy as np
import pytest
from test_traces import NM, UM, compare_surfaces, draw_surface, has_finding, make_pair

START = 40  # sample of the surface at which the second trace starts


def cut_tops(surface, level: float, first: int, last: int) -> np.ndarray:
    """Return the loss (n,) [m] of a second trace, where tops above a level [m] were cut between two of its samples."""
    worn = np.maximum(surface[START:] - level, 0.0)
    worn[:first] = 0.0
    worn[last:] = 0.0
    return worn


@pytest.mark.parametrize("seed", range(3))
def test_always_end_lies_between_a_worn_top_and_the_next_ones(seed):
    """Intervals of both ends contain the outermost cut top and end at the second top beyond; the area is that of all."""
    surface = draw_surface(seed, 4400)
    loss = cut_tops(surface, 0.3 * UM, 1200, 2700)
    worn = loss[:4000]
    found = compare_surfaces(*make_pair(worn, seed, surface=surface))
    assert found.verdict.code == "worn" and has_finding(found, "worn_tops")
    n_tops = np.diff((surface[:4000] > 0.3 * UM).astype(int)).clip(0).sum()
    spacing = 4000 * UM / n_tops
    outermost = np.flatnonzero(worn > 20 * NM)[[0, -1]] * UM
    for name, end in zip(("worn_from_after", "worn_to_after"), outermost):
        value = found.values[name]
        assert value.low - UM <= end <= value.high + UM, name
        # The interval reaches the second top beyond the end, and tops are unevenly spaced.
        assert value.high - value.low < 4 * spacing, name
    area = found.values["worn_area"]
    assert area.low <= worn.sum() * UM <= area.high
    assert found.track.values["width"].value == pytest.approx(np.ptp(outermost), rel=0.1)


@pytest.mark.parametrize("seed", range(4, 8))
def test_always_tops_that_are_all_worn_a_little_are_found(seed):
    """Where all tops of a trace lost three deviations of the noise of a depth, the verdict is wear.

    Most depths are then within the noise, and the datum follows a part of the loss: the mean depth is 25 to 65 % too
    small, but never too large.
    """
    surface = draw_surface(seed, 4400)
    worn = np.where(surface[START:] > 0, 20 * NM, 0.0)[:4000]
    found = compare_surfaces(*make_pair(worn, seed, surface=surface))
    assert found.verdict.code == "worn"
    mean = found.values["worn_depth_mean"]
    assert 0.3 * worn.mean() < mean.value < worn.mean() and mean.low < worn.mean()


@pytest.mark.parametrize("gain", [0.98, 1.02])
def test_always_drift_and_cut_tops_do_not_pass_for_another_gain(gain):
    """The gain is that of the valleys, with a drift of four deviations of the noise and cut tops."""
    surface = draw_surface(11, 4400)
    worn = cut_tops(surface, 0.2 * UM, 500, 3000)[:4000]
    drift = np.cumsum(np.random.default_rng(2).normal(size=4000))
    drift *= 20 * NM / drift.std()
    before, after = make_pair(worn, 11, surface=surface)
    after = type(after)(after.x, gain * after.z + drift, "after")
    value = compare_surfaces(before, after).values["gain"]
    assert value.low <= gain <= value.high and value.high - value.low < 0.01


@pytest.mark.parametrize("seed", range(3))
def test_always_end_of_a_track_with_worn_valleys_does_not_reach_to_other_tops(seed):
    """Where a track lowers valleys as well as tops, its flanks alone tell the ends: the width is known within 3 %."""
    surface = draw_surface(seed, 4400)
    worn = np.zeros(4000)
    worn[1200:2700] = 0.4 * UM
    width = compare_surfaces(*make_pair(worn, seed, surface=surface)).track.values["width"]
    assert width.low <= 1500 * UM <= width.high
    assert width.high - width.low < 0.03 * width.value
