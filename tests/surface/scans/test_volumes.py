"""Volumes, worn fraction and intervals of maps of depths that were made."""

import numpy as np
import pytest
from made_scans import aligned
from scipy.ndimage import gaussian_filter

from patchfem.surface.scans.volumes import measure_volumes

STEP, COUNT, NOISE = 1e-6, 240, 20e-9
AXIS = STEP * np.arange(COUNT)
X, Y = np.meshgrid(AXIS, AXIS)
GROOVE = 0.4e-6 * np.clip(1 - ((X - 120e-6) / 30e-6) ** 2, 0.0, None)


def noisy(depth, seed=0, sigma=0.0):
    """Depths with noise that is correlated over `sigma` heights."""
    noise = np.random.default_rng(seed).normal(size=depth.shape)
    if sigma:
        noise = gaussian_filter(noise, sigma)
    return depth + NOISE * noise / noise.std()


@pytest.mark.parametrize("from_depth", [0.1, 0.3])
def test_always_a_pit_whose_steep_wall_is_missing_has_its_volume_in_the_interval(from_depth):
    """The wall of a flat-bottomed pit, below a fraction of the depth of its floor, has no heights."""
    r = np.hypot(X - 120e-6, Y - 110e-6)
    pit = 1e-6 * np.clip((60e-6 - r) / 25e-6, 0.0, 1.0) ** 0.7
    depth = np.where((pit > from_depth * 1e-6) & (pit < 0.98e-6), np.nan, noisy(pit))
    truth = float(pit.sum()) * STEP**2
    found = measure_volumes(aligned(depth, NOISE), AXIS, AXIS).values["worn_volume"]
    assert 0.5 * truth < found.low <= truth <= found.high
    assert found.high - found.value > 0.1 * truth  # the noise of the depths alone gives 1 %


@pytest.mark.parametrize("count", [12, pytest.param(40, marks=pytest.mark.slow)])
@pytest.mark.parametrize("sigma", [0.0, 4.0])
def test_always_the_interval_of_a_volume_follows_the_correlation_of_the_noise(sigma, count):
    """Of 40 grooves under white noise, and noise that is alike over 10 heights, 95 % have their volume inside."""
    truth = float(GROOVE.sum()) * STEP**2
    held = 0
    widths = []
    for seed in range(count):
        found = measure_volumes(aligned(noisy(GROOVE, seed, sigma), NOISE), AXIS, AXIS).values[
            "worn_volume"
        ]
        held += found.low <= truth <= found.high
        widths.append((found.high - found.low) / truth)
    assert held >= 0.9 * count
    assert (np.median(widths) < 0.01) == (sigma == 0.0)


def test_exact_a_fraction_without_noise_is_that_of_the_area():
    """The groove is 60 heights wide, whose ends lie on heights: 59 are deep."""
    found = measure_volumes(aligned(noisy(1e3 * GROOVE), NOISE), AXIS, AXIS).values["worn_share"]
    assert found.value == pytest.approx(60 / 240, rel=0.02)
    assert found.low <= 61 / 240 and found.high >= 59 / 240


@pytest.mark.parametrize("sign, name", [(1.0, "worn_volume"), (-1.0, "grown_volume")])
def test_exact_wear_and_growth_are_measured_alike(sign, name):
    """The map with its sign changed has the same volume under the other name."""
    found = measure_volumes(aligned(sign * noisy(GROOVE), NOISE), AXIS, AXIS).values
    other = measure_volumes(aligned(noisy(GROOVE), NOISE), AXIS, AXIS).values
    assert found[name].value == pytest.approx(other["worn_volume"].value, rel=1e-9)
    assert found[name].low > 0.95 * float(GROOVE.sum()) * STEP**2


def test_always_noise_alone_has_no_volume():
    found = measure_volumes(aligned(noisy(0 * X, 3, 2.0), NOISE), AXIS, AXIS).values
    assert found["worn_volume"][:2] == (0.0, 0.0) and found["grown_volume"][:2] == (0.0, 0.0)
