"""Noise of a worn depth and its drawn errors, compared with made noise that grows with the slope and has tails."""

import numpy as np
import pytest

from patchfem.surface.compare.errors import draw_errors, estimate_noise

COUNT = 4000


@pytest.mark.parametrize("worn_fraction", [0.0, 0.4])
def test_always_noise_of_steep_places_is_found(worn_fraction):
    """The noise of flat and of steep places is found to 20 %, also beside wear of 5 um.

    Earlier a common limit cut off the noise of steep places, and that of flat places came out too large by 40 %.
    """
    for seed in range(3):
        random = np.random.default_rng(seed)
        slope = np.abs(random.standard_normal(COUNT))
        truth = np.hypot(5e-9, 20e-9 * slope)
        depth = truth * random.standard_normal(COUNT)
        n_worn = int(worn_fraction * COUNT)
        depth[:n_worn] += 5e-6
        scale = 1.4826 * np.median(np.abs(depth[n_worn:]))
        unworn = np.abs(depth) <= 2.5 * scale
        noise = estimate_noise(depth, unworn, slope, np.zeros(COUNT), 1e-12)
        for part in (slope < 0.1, slope > 2):
            assert np.mean(noise[part]) == pytest.approx(np.mean(truth[part]), rel=0.2)


def test_exact_rounded_depths_have_their_noise():
    """Depths that are mostly rounded to zero have their own standard deviation."""
    random = np.random.default_rng(1)
    depth = 1e-9 * np.round(0.4 * random.standard_normal(COUNT))
    nothing = np.zeros(COUNT)
    noise = estimate_noise(depth, np.ones(COUNT, bool), nothing, nothing, 0.1e-9)
    assert np.ptp(noise) == 0
    assert depth.std() <= noise[0] <= 1.1 * depth.std()


def test_always_drawn_errors_hold_tail_of_noise():
    """Errors are drawn with the single heights that stand far above unworn neighbours."""
    random = np.random.default_rng(2)
    depth = random.standard_normal(COUNT)
    depth[::50] *= 6
    unworn = np.abs(depth) <= 2.5
    place = np.linspace(-1, 1, COUNT)
    jacobian = np.column_stack([np.ones(COUNT), place])
    drawn = draw_errors(depth, np.ones(COUNT), unworn, unworn, jacobian, 1).depth
    # Wear cannot raise a height, so only half of the outliers are known as noise.
    expected = np.mean(np.abs(depth) > 5)
    assert 0.3 * expected < np.mean(np.abs(drawn) > 5) < expected
