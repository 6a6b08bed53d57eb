"""Tracks that are shallower than the noise of one height: detected above the stated limit, never in unworn pairs.

Seeds below 100 were used to set the rule.
"""

import re

import known_pairs
import numpy as np
import pytest
from scipy.ndimage import gaussian_filter1d

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

NOISE, COUNT, SHIFT = 5e-9, 3000, 40


def make_track_pair(seed: int, depth: float) -> tuple:
    """Return two traces of one rough surface; the middle third of the second is worn by the depth [m]."""
    draw = np.random.default_rng(seed)
    surface = gaussian_filter1d(draw.normal(size=COUNT + SHIFT + 200), 10.6)[100:-100]
    surface *= 0.5e-6 / surface.std()
    x = 1e-6 * np.arange(COUNT)
    worn = depth * ((x >= x[-1] / 3) & (x < 2 * x[-1] / 3))
    first = surface[:COUNT] + 3e-4 * x + NOISE * draw.normal(size=COUNT)
    second = surface[SHIFT:] - worn - 5e-4 * x + NOISE * draw.normal(size=COUNT)
    return tuple(
        Profile(frozen_array(x), frozen_array(z), name)
        for z, name in ((first, "before"), (second, "after"))
    )


@pytest.mark.share(0)
@pytest.mark.parametrize("seed", [2000, 2001])
def test_exact_shallow_track_is_measured(seed):
    """A track of 30 nm with noise of 5 nm is measured: depth within 1.5 nm, edges within 4 um."""
    found = compare_traces(*make_track_pair(seed, 30e-9))
    assert compose_verdict([found])[0].startswith("worn")
    sizes = found.tracks.sizes
    assert sizes["depth_mean"].low < 30e-9 < sizes["depth_mean"].high
    assert sizes["depth_mean"].value == pytest.approx(30e-9, abs=1.5e-9)
    assert sizes["from"].value == pytest.approx(1e-3, abs=4e-6) and sizes[
        "to"
    ].value == pytest.approx(2e-3, abs=4e-6)
    assert found.worn.mean.value == pytest.approx(10e-9, abs=1e-9) and found.hidden.value is None


@pytest.mark.share(0, 3, 5)
@pytest.mark.parametrize("deviations", [0.6, 1.0, 1.5, 2.2, 3.0, 4.0, 5.0, 8.0])
def test_always_track_of_few_deviations_is_worn(deviations):
    """Tracks of 0.6 to 8 standard deviations of the depth noise are worn, and their mean depth holds."""
    depth = deviations * np.sqrt(2) * NOISE
    found = compare_traces(*make_track_pair(2200, depth))
    headline, sentences = compose_verdict([found])
    assert headline.startswith("worn depth ") and "no wear detected" not in " ".join(sentences)
    assert found.worn.mean.low < depth / 3 < found.worn.mean.high


@pytest.mark.parametrize("count", [2, pytest.param(20, marks=pytest.mark.slow)])
def test_always_depth_above_detection_limit_is_detected(count):
    """A track of 1.5 times the stated detection limit is detected in at least 19 of 20 pairs.

    The limit of an unworn pair is below the noise of one height.
    """
    hits = 0
    for seed in range(2100, 2100 + count):
        found = compare_traces(*make_track_pair(seed, 0.0))
        assert found.worn.mean.value is None and 1e-9 < found.detection_limit < NOISE
        sentence = compose_verdict([found])[1][0]
        assert re.search(r"would have been found from a mean depth of [0-9.]+ nm on", sentence)
        worn = compare_traces(*make_track_pair(seed, 1.5 * found.detection_limit))
        hits += (
            worn.worn.mean.value is not None
            and worn.worn.mean.low > 0
            and worn.detection_limit is None
        )
    assert hits >= count - count // 20


@pytest.mark.slow
def test_always_pairs_without_track_show_no_wear():
    """At most 5 % of the pairs without a track show wear; uniform and wedge-shaped wear have no unworn flanks either."""
    alarms = 0
    count = 20
    for seed in range(93000, 93000 + count):
        for kind in ("unworn", "scale", "even", "wedge"):
            found = compare_traces(*known_pairs.make_profiles(known_pairs.draw_pair(kind, seed)))
            alarms += found.worn.mean.value is not None
    assert alarms <= 0.05 * 4 * count
