"""Volumes, worn fraction and their intervals for made maps of depths."""

import numpy as np
import pytest
from made_scans import make_alignment
from patchfem.surface.scans.volumes import measure_volumes
from scipy.ndimage import gaussian_filter

STEP, COUNT, NOISE = 1e-6, 240, 20e-9
AXIS = STEP * np.arange(COUNT)
X, Y = np.meshgrid(AXIS, AXIS)
GROOVE = 0.4e-6 * np.clip(1 - ((X - 120e-6) / 30e-6) ** 2, 0.0, None)


def add_noise(depth, seed=0, sigma=0.0):
    """Return depths with noise that is correlated over `sigma` heights."""
    noise = np.random.default_rng(seed).normal(size=depth.shape)
    if sigma:
        noise = gaussian_filter(noise, sigma)
    return depth + NOISE * noise / noise.std()


@pytest.mark.parametrize("from_depth", [0.1, 0.3])
def test_always_volume_interval_covers_missing_wall(from_depth):
    """If the steep wall of a pit has no heights, the interval of the volume still covers the truth."""
    radius = np.hypot(X - 120e-6, Y - 110e-6)
    pit = 1e-6 * np.clip((60e-6 - radius) / 25e-6, 0.0, 1.0) ** 0.7
    depth = np.where((pit > from_depth * 1e-6) & (pit < 0.98e-6), np.nan, add_noise(pit))
    truth = float(pit.sum()) * STEP**2
    found = measure_volumes(make_alignment(depth, NOISE), AXIS, AXIS).values["worn_volume"]
    assert 0.5 * truth < found.low <= truth <= found.high
    assert found.high - found.value > 0.1 * truth  # noise alone would give 1 %


@pytest.mark.parametrize("count", [8, pytest.param(40, marks=pytest.mark.slow)])
@pytest.mark.parametrize("sigma", [0.0, 4.0])
def test_always_volume_interval_accounts_for_correlation(sigma, count):
    """Of 40 grooves under white or correlated noise, at least 90 % of the intervals cover the volume."""
    truth = float(GROOVE.sum()) * STEP**2
    n_covered = 0
    widths = []
    for seed in range(count):
        found = measure_volumes(
            make_alignment(add_noise(GROOVE, seed, sigma), NOISE), AXIS, AXIS
        ).values["worn_volume"]
        n_covered += found.low <= truth <= found.high
        widths.append((found.high - found.low) / truth)
    assert n_covered >= 0.9 * count
    assert (np.median(widths) < 0.01) == (sigma == 0.0)


def test_exact_worn_fraction_of_groove():
    """The worn fraction of a groove agrees with its area within 2 %.

    The groove is 60 heights wide, of which 59 are below the surface.
    """
    found = measure_volumes(make_alignment(add_noise(1e3 * GROOVE), NOISE), AXIS, AXIS).values[
        "worn_share"
    ]
    assert found.value == pytest.approx(60 / 240, rel=0.02)
    assert found.low <= 61 / 240 and found.high >= 59 / 240


def test_exact_growth_is_measured_like_wear():
    """A map with the opposite sign has the same volume as growth."""
    found = measure_volumes(make_alignment(-add_noise(GROOVE), NOISE), AXIS, AXIS).values
    reference = measure_volumes(make_alignment(add_noise(GROOVE), NOISE), AXIS, AXIS).values
    assert found["grown_volume"].value == pytest.approx(reference["worn_volume"].value, rel=1e-9)
    assert found["grown_volume"].low > 0.95 * float(GROOVE.sum()) * STEP**2


def test_always_noise_alone_gives_no_volume():
    """Noise alone gives zero worn and grown volumes."""
    found = measure_volumes(make_alignment(add_noise(0 * X, 3, 2.0), NOISE), AXIS, AXIS).values
    assert found["worn_volume"][:2] == (0.0, 0.0) and found["grown_volume"][:2] == (0.0, 0.0)
