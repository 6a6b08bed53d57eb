"""Width, step, floor, lost area and pile-up of a track, compared with made tracks."""

from functools import cache

import numpy as np
import pytest
from pairs import UM

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

# Base of a ridge [um], number of samples of 1 um, first seed; the rules were tuned on seeds 1000 to
# 1011.
RIDGE, COUNT, HELD_OUT = (60.0, 2401, 41000)
SHAPES = {
    "band": (lambda t: np.ones(t.size), 1.0, 1.0),
    "parabola": (lambda t: 1 - t**2, 2 / 3, 26 / 27),
}


def make_ridged_track(
    kind: str, seed: int, left: float, right: float, depth: float = 1.0, width: float = 600.0
):
    """Return traces before and after and true values [SI] by name of a track with ridges [um] beside its ends.

    The roughness is 0.3 um, and each trace has noise of 20 nm.
    """
    random = np.random.default_rng([seed, 1987])
    margin = 100
    rough = np.convolve(
        random.standard_normal(COUNT + 2 * margin + 120),
        np.exp(-0.5 * (np.arange(-60, 61) / 10) ** 2),
        "valid",
    )
    rough *= 0.3 / rough.std()
    x = np.arange(float(COUNT))
    n_shifted = int(random.integers(-60, 61))
    middle = random.uniform(0.4, 0.6) * COUNT
    position = x - n_shifted
    shape, mean_ratio, step = SHAPES[kind]
    t = (position - middle) / (width / 2)
    after = rough[margin - n_shifted : margin - n_shifted + COUNT] - np.where(
        abs(t) <= 1, depth * shape(t), 0.0
    )
    for height, side in ((left, -1), (right, 1)):
        distance = position - middle - side * (width + RIDGE) / 2
        after = after + height * np.maximum(1 - abs(distance) / (RIDGE / 2), 0.0)
    before, after = (
        value + 0.02 * random.standard_normal(COUNT)
        for value in (rough[margin : margin + COUNT], after)
    )
    ridge_areas = left * RIDGE / 2, right * RIDGE / 2
    lengths = {
        "from": middle - width / 2 + n_shifted,
        "to": middle + width / 2 + n_shifted,
        "width": width,
        "depth_mean": mean_ratio * depth,
        "depth_floor": depth,
        "step": step * depth,
    }
    areas = {
        "area_gross": mean_ratio * depth * width,
        "area_net": mean_ratio * depth * width - sum(ridge_areas),
        "pile_up": sum(ridge_areas),
        "pile_up_left": ridge_areas[0],
        "pile_up_right": ridge_areas[1],
    }
    truth = {name: value * UM for name, value in lengths.items()} | {
        name: value * UM**2 for name, value in areas.items()
    }
    return *(
        Profile(frozen_array(x * UM), frozen_array(z * UM), name)
        for z, name in ((before, "before"), (after, "after"))
    ), truth


@cache
def compare_ridged_track(kind: str, seed: int, ridges: tuple) -> tuple:
    """Return the comparison of a track with ridges and its true values; it is stored for several tests."""
    *traces, truth = make_ridged_track(kind, seed, *ridges)
    return compare_traces(*traces), truth


def score_tracks(kind: str, ridges: tuple, seeds) -> tuple:
    """Return the fraction of intervals that cover the truth, and the relative errors by name."""
    covers = []
    errors = {}
    for seed in seeds:
        comparison, truth = compare_ridged_track(kind, seed, ridges)
        found = comparison.tracks.sizes
        covers += [found[name].low <= value <= found[name].high for name, value in truth.items()]
        for name, value in truth.items():
            errors.setdefault(name, []).append(
                found[name].value / value - 1 if value else found[name].value
            )
    return np.mean(covers), errors


@pytest.mark.parametrize("kind, ridges", [("band", (0.5, 0.2)), ("parabola", (0.5, 0.2))])
def test_always_sizes_of_track_with_ridges(kind, ridges):
    """Width, depths and areas of a track between ridges agree with the truth within 1.5 to 2 %, pile-ups within 20 %."""
    coverage, errors = score_tracks(kind, ridges, (HELD_OUT, HELD_OUT + 1))
    assert coverage >= 17 / 22
    limits = {
        "pile_up_left": 0.1,
        "pile_up_right": 0.2,
        "pile_up": 0.1,
        "width": 0.02,
        "depth_mean": 0.02,
    }
    for name, values in errors.items():
        assert max(map(abs, values)) < limits.get(name, 0.015), (name, values)


@pytest.mark.slow
@pytest.mark.parametrize("kind", SHAPES)
@pytest.mark.parametrize("ridges", [(0.0, 0.0), (0.5, 0.2), (0.2, 1.0)])
def test_always_intervals_of_20_tracks_cover_truth(kind, ridges):
    """At least 90 % of the intervals of 20 tracks with and without ridges cover the truth."""
    assert score_tracks(kind, ridges, range(HELD_OUT + 10, HELD_OUT + 30))[0] >= 0.9


@pytest.mark.parametrize("missing", [(-29, 1), (-1, 29)])
def test_always_interval_covers_missing_wall(missing):
    """If 30 heights beside the wall are missing, the intervals of area and mean depth cover the truth.

    A straight line across the gap has an error of 15 um times 1 um.
    """
    before, after, truth = make_ridged_track("band", HELD_OUT + 4, 0.0, 0.0)
    position = (after.x - truth["from"]) / UM
    is_missing = (position > missing[0]) & (position < missing[1])
    z = frozen_array(np.where(is_missing, np.nan, after.z))
    worn = compare_traces(before, Profile(after.x, z, "after")).worn
    length = worn.area.value / worn.mean.value
    assert worn.area.low <= truth["area_gross"] <= worn.area.high
    assert worn.mean.low <= truth["area_gross"] / length <= worn.mean.high
    assert abs(worn.area.value - truth["area_gross"]) > 8 * UM**2
    assert worn.area.high - worn.area.low < 50 * UM**2


def test_always_slope_ratio_from_noise_is_refused():
    """The slope ratio is not given where the noise of the second trace is steeper than the surface."""
    before, after, _ = make_ridged_track("band", HELD_OUT + 3, 0.0, 0.0)
    noise = 0.06 * UM * np.random.default_rng(2).standard_normal(COUNT)
    slope = compare_traces(
        before, Profile(after.x, frozen_array(after.z + noise), "after")
    ).ratios.slope
    assert slope.value is None and "noise" in slope.reason


def test_always_area_interval_covers_removed_scratch():
    """The upper end of the worn area covers a narrow scratch that is removed as a spike."""
    before, after, truth = make_ridged_track("band", HELD_OUT + 5, 0.0, 0.0)
    # the scratch is 5 um deep and 4 um wide
    scratch = 5.0 * UM * np.maximum(1 - abs(after.x / UM - 300) / 2, 0)
    pair = before, Profile(after.x, frozen_array(after.z - scratch), "after")
    worn = compare_traces(*pair).worn
    area = truth["area_gross"] + scratch.sum() * UM
    assert worn.area.value < area - 9 * UM**2 < area <= worn.area.high
    with_spikes = compare_traces(*pair, keep_spikes=True).worn
    assert with_spikes.area.value == pytest.approx(area, rel=0.005)
    assert with_spikes.area.high - with_spikes.area.value < 9 * UM**2


def test_always_mean_interval_covers_hidden_wear_of_tops():
    """The upper end of the mean depth covers wear of tops below the noise.

    The tops lost up to 120 nm, and losses below 50 nm are hidden by noise of 20 nm per trace.
    """
    before = make_ridged_track("band", HELD_OUT + 6, 0.0, 0.0)[0]
    rough = before.z - before.z.mean()
    top = np.sort(rough)[-400]
    worn_depth = np.clip(rough - top, 0.0, 0.12 * UM)
    noise = 0.02 * UM * np.random.default_rng(6).standard_normal(worn_depth.size)
    mean = compare_traces(
        before, Profile(before.x, frozen_array(rough - worn_depth + noise), "after")
    ).worn.mean
    assert mean.value < worn_depth.mean() <= mean.high < 1.5 * worn_depth.mean()


def test_always_absent_pile_up_has_upper_bound():
    """Without ridges the pile-up is zero with an upper bound, and net and gross area are equal."""
    found = compare_ridged_track("band", HELD_OUT + 2, (0.0, 0.0))[0].tracks.sizes
    assert found["pile_up"].value == 0.0 < found["pile_up"].high < 0.02 * found["area_gross"].value
    assert found["pile_up"].high == pytest.approx(
        np.hypot(found["pile_up_left"].high, found["pile_up_right"].high), rel=1e-12, abs=0
    )
    assert found["area_net"].value == found["area_gross"].value


def test_always_worn_tops_have_depth_within_worn_range():
    """Worn tops between unworn valleys are not a track, but have a mean depth within the worn range, within 3 %.

    The mean over the whole length would be less than half of it.
    """
    before = make_ridged_track("band", HELD_OUT + 3, 0.0, 0.0)[0]
    x = before.x / UM
    z = before.z / UM
    worn = np.where((x > 700) & (x < 1700), np.maximum(z, 0.0), 0.0)
    noise = 0.02 * np.random.default_rng(5).standard_normal(x.size)
    found = compare_traces(
        before, Profile(before.x, frozen_array((z - worn + noise) * UM), "after")
    )
    worn_samples = np.flatnonzero(worn > 0.1)  # wear below five times the noise is not visible
    truth = worn[worn_samples[0] : worn_samples[-1] + 1].mean() * UM
    assert not found.tracks.sizes
    assert found.values["worn_depth_within"].value == pytest.approx(truth, rel=0.03)
    assert found.values["worn_depth_mean"].value < 0.5 * truth
    assert any("between these places" in text for text in compose_verdict([found])[1])
