"""Volumes of a map of depths of which walls are missing, or whose plane leans into a shallow slope."""

import numpy as np
import pytest

from patchfem.surface.scans import volumes
from patchfem.surface.scans.registration import REACH, Laid

STEP, COUNT, NOISE = 1e-6, 240, 20e-9
AXIS = STEP * np.arange(COUNT)
X, Y = np.meshgrid(AXIS, AXIS)


def laid(depth, used=None):
    """A registration of known place and plane with a map of depths (m, n) [m]."""
    with np.errstate(invalid="ignore"):
        used = np.abs(depth) < REACH * NOISE if used is None else used
    return Laid(None, 0.0, np.zeros(2), depth, np.zeros((6, 6)), NOISE, used, np.ones(depth.shape, bool), 1.0)


def noisy(depth, seed=0):
    return depth + NOISE * np.random.default_rng(seed).normal(size=depth.shape)


@pytest.mark.parametrize("from_depth", [0.1, 0.3])
def test_always_a_pit_whose_steep_wall_is_missing_has_its_volume_in_the_interval(monkeypatch, from_depth):
    """Of a flat-bottomed pit the wall, deeper than a share of the floor, has no heights."""
    r = np.hypot(X - 120e-6, Y - 110e-6)
    pit = 1e-6 * np.clip((60e-6 - r) / 25e-6, 0.0, 1.0)**0.7
    depth = np.where((pit > from_depth * 1e-6) & (pit < 0.98e-6), np.nan, noisy(pit))
    truth = float(pit.sum()) * STEP**2
    found = volumes.measured(laid(depth), AXIS, AXIS).values["worn_volume"]
    assert 0.5 * truth < found.low <= truth <= found.high
    monkeypatch.setattr(volumes, "WALL", 0.0)
    assert not volumes.measured(laid(depth), AXIS, AXIS).values["worn_volume"].high > truth


def test_always_a_slope_that_begins_in_the_noise_has_its_volume_in_the_interval(monkeypatch):
    """The plane is that of the heights within the noise, which reaches into the slope."""
    wedge = 0.5e-6 * np.clip((X - 0.45 * AXIS[-1]) / AXIS[-1], 0.0, None)
    depth, flat = noisy(wedge), np.stack([np.ones(X.size), X.ravel(), Y.ravel()], axis=1) / [1, AXIS[-1], AXIS[-1]]
    on = wedge.ravel() < 1.5 * NOISE
    depth = depth - (flat @ np.linalg.lstsq(flat[on], depth.ravel()[on], rcond=None)[0]).reshape(X.shape)
    truth = float(wedge.sum()) * STEP**2
    lain = laid(depth, on.reshape(X.shape))
    found = volumes.measured(lain, AXIS, AXIS).values["worn_volume"]
    assert found.value < truth and found.low <= truth <= found.high
    monkeypatch.setattr(volumes, "ENOUGH", 1.1)  # none stands away
    assert volumes.measured(lain, AXIS, AXIS).values["worn_volume"].high < truth


def test_always_what_noise_hides_of_a_slope_raises_the_upper_end():
    """A map whose unworn heights lie above zero in the mean was drawn down by shallow wear."""
    groove = 0.4e-6 * (np.abs(X - 120e-6) < 30e-6)
    depth = noisy(groove)
    even, down = (volumes.measured(laid(one), AXIS, AXIS).values["worn_volume"] for one in (depth, depth - 0.3 * NOISE))
    assert down.high > float(groove.sum()) * STEP**2 > down.value and even.low <= float(groove.sum()) * STEP**2
