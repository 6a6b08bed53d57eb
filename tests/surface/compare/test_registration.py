"""Alignment of two traces on their unworn valleys, and the worn depth from it, for made pairs of known wear.

The method was tuned on seeds 0 to 150; the seeds of these tests are others.
"""

import numpy as np
import pytest
from pairs import UM, make_surface, make_worn_pair
from patchfem.surface.compare.model import Parameter
from patchfem.surface.compare.search import search_shift

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.alignment import align
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

HELD_OUT = 80000


def score_pair(seed: int) -> tuple:
    """Return errors of shift, mean and largest depth [m], whether their intervals cover the truth, and the basis.

    The true mean is that over the common length, with the heights that were left out as a spike.
    """
    p = make_worn_pair(seed)
    found = compare_traces(p.before, p.after)
    ends = found.alignment.x[[0, -1]]
    worn = p.worn[(p.after.x >= ends[0]) & (p.after.x <= ends[1])]
    quantities = (
        (found.motion.shift, p.shift),
        (found.worn.mean, worn.mean()),
        (found.worn.largest, worn.max()),
    )
    return (
        [quantity.value - truth for quantity, truth in quantities],
        [quantity.low <= truth <= quantity.high for quantity, truth in quantities],
        found.basis,
    )


def score_pairs(count: int) -> tuple:
    """Return the rms errors and the fractions of covering intervals over a number of pairs."""
    errors, covers, bases = zip(*(score_pair(HELD_OUT + k) for k in range(count)))
    assert set(bases) == {"place"}
    return np.sqrt(np.mean(np.square(errors), axis=0)), np.mean(covers, axis=0)


def test_always_pair_is_aligned_within_targets():
    """The rms errors of two pairs are within the targets of 0.01 um for the shift and 0.06 um for the depth.

    The 95 % intervals of both cover the truth.
    """
    rms, coverage = score_pairs(2)
    assert rms[0] < 0.01 * UM and rms[1] < 0.003 * UM and rms[2] < 0.06 * UM, rms
    assert (coverage == 1).all(), coverage


@pytest.mark.slow
def test_always_intervals_of_200_pairs_cover_truth():
    """Over 200 pairs 92 to 98 % of the intervals cover the truth, and the rms error of the mean depth is below 1.5 nm."""
    rms, coverage = score_pairs(200)
    assert rms[0] < 0.005 * UM and rms[1] < 0.0015 * UM and rms[2] < 0.04 * UM, rms
    assert (abs(coverage - 0.95) <= 0.03 + 1e-9).all(), coverage


@pytest.mark.share(0, 2)
@pytest.mark.parametrize("seed", range(4))
def test_exact_alignment_without_noise(seed):
    """Without noise shift, tilt, offset and depth agree with the truth within 0.05 nm."""
    p = make_worn_pair(seed, noise=0.0)
    found = align(p.before, p.after, search_shift(p.before, p.after).shift)
    worn = np.interp(found.x, p.after.x, p.worn)
    assert abs(found.shift - p.shift) < 5e-11
    assert abs(found.depth.mean() - worn.mean()) < 2e-11
    # the interpolation between samples has an error of 0.1 nm
    error = found.error_of(Parameter.SLOPE) / found.half
    assert abs(found.slope - p.slope) <= 2 * error < 1.2e-7
    offset = found.state[Parameter.OFFSET] - found.slope * found.middle
    assert offset == pytest.approx(p.offset, abs=1e-11)


def test_exact_identical_traces_show_no_change():
    """A trace compared with itself has no shift, tilt or wear, ratios of 1, and the verdict "no change"."""
    p = make_worn_pair(1)
    found = compare_traces(p.before, p.before)
    assert found.motion.shift.value == pytest.approx(0.0, abs=1e-15)
    assert found.motion.tilt.value == pytest.approx(0.0, abs=1e-12)
    assert found.worn.mean.value is found.worn.largest.value is found.worn.area.value is None
    assert found.hidden.value < 1e-9 and found.hidden.high is None
    assert (found.ratios.amplitude.value, found.ratios.slope.value) == pytest.approx(
        (1.0, 1.0), rel=1e-14
    )
    assert compose_verdict([found])[0] == "no change shown"
    assert found.motion.shift.value == found.motion.tilt.value == 0
    assert (
        compose_verdict([found])[1][0]
        == "Worn depth: none; the heights before and after wear are the same."
    )


@pytest.mark.parametrize("count", [1, pytest.param(24, marks=pytest.mark.slow)])
def test_always_traces_of_different_places_have_no_depth(count):
    """Traces of two different places have no shift and no depth, and the reason states why."""
    for seed in range(count):
        found = compare_traces(
            make_worn_pair(seed + 40000, worn_fraction=0.0).before,
            make_worn_pair(seed + 50000, worn_fraction=0.0).after,
        )
        assert found.basis == "" and found.worn.mean.value is found.motion.shift.value is None
        assert "no common part" in found.worn.mean.reason
        assert "unworn flanks" in found.worn.mean.reason
        worn = found.worn
        assert [part.unit for part in (worn.largest, worn.mean, worn.area)] == ["m", "m", "m2"]


@pytest.fixture(scope="module")
def pair_and_mean_depth():
    """Return a pair of traces with worn tops, and its mean worn depth [m] by the comparison."""
    p = make_worn_pair(5)
    return p, compare_traces(p.before, p.after).worn.mean.value


def test_always_stretch_along_x_is_corrected(pair_and_mean_depth):
    """A stretch of x by 0.4 % is estimated within 3e-5 and corrected."""
    p, mean_depth = pair_and_mean_depth
    stretched = Profile(frozen_array(p.after.x * 1.004), p.after.z, "after")
    found = compare_traces(p.before, stretched)
    assert found.motion.stretch.value == pytest.approx(1.004, abs=3e-5)
    assert found.motion.stretch.low < 1.004 < found.motion.stretch.high
    assert found.worn.mean.value == pytest.approx(mean_depth, abs=0.005 * UM)
    assert any("this difference in length is corrected" in text for text in found.notes)


def test_always_deposits_do_not_reduce_wear(pair_and_mean_depth):
    """Deposits are reported with their area and do not reduce the mean worn depth."""
    p, mean_depth = pair_and_mean_depth
    z = np.array(p.after.z)
    indices = np.flatnonzero(p.worn == 0)[100:140]
    z[indices] += 3 * UM
    found = compare_traces(p.before, Profile(p.after.x, frozen_array(z), "after")).worn
    assert found.deposited == pytest.approx(3 * UM * indices.size * UM, rel=0.01)
    assert found.mean.value == pytest.approx(mean_depth, abs=0.005 * UM)


def test_always_traces_with_gaps_are_aligned(pair_and_mean_depth):
    """Traces with gaps are aligned with the same shift within 20 nm."""
    p = pair_and_mean_depth[0]
    before = np.array(p.before.z)
    after = np.array(p.after.z)
    before[700:720] = np.nan
    after[300:340] = np.nan
    found = compare_traces(
        Profile(p.before.x, frozen_array(before), "before"),
        Profile(p.after.x, frozen_array(after), "a"),
    )
    assert found.basis == "place" and found.motion.shift.value == pytest.approx(
        p.shift, abs=0.02 * UM
    )


def make_groove_pair(seed: int, depth: float, roughness: float) -> tuple:
    """Return a rough trace, another one with a parabolic groove of 0.6 mm, and the area of the groove."""
    x = np.arange(1001) * 2 * UM
    t = (x - 1e-3) / 0.3e-3
    sides = [make_surface(seed + offset, roughness)(0.4 * x) for offset in (0, 3000)]
    cut = np.where(abs(t) < 1, depth * (1 - t**2), 0.0)
    noise = 0.02 * UM * np.random.default_rng(seed).standard_normal((2, x.size))
    return (
        Profile(x, frozen_array(sides[0] + noise[0] + 0.003 * x), "before"),
        Profile(x, frozen_array(sides[1] - cut + noise[1] - 0.002 * x), "after"),
        depth * 4 / 3 * 0.3e-3,
    )


@pytest.mark.share(0)
@pytest.mark.parametrize("count", [1, pytest.param(10, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "depth, roughness, max_rms_error", [(10 * UM, 1 * UM, 0.1), (20 * UM, 0.5 * UM, 0.04)]
)
def test_always_area_of_groove_between_flanks(depth, roughness, max_rms_error, count):
    """For traces of two places, at least 80 % of the intervals cover the area of a groove between unworn flanks."""
    covers = []
    errors = []
    for seed in range(count):
        before, after, area = make_groove_pair(60000 + seed, depth, roughness)
        found = compare_traces(before, after)
        assert found.basis == "flanks" and found.motion.shift.value is None
        covers.append(found.worn.area.low <= area <= found.worn.area.high)
        errors.append(found.worn.area.value / area - 1)
        assert found.worn.largest.low <= depth <= found.worn.largest.high
        assert found.worn.mean.value == pytest.approx(
            found.worn.area.value / (after.length + after.step)
        )
    assert sum(covers) >= 0.8 * count and np.sqrt(np.mean(np.square(errors))) < max_rms_error


def test_always_pile_up_does_not_tilt_line_of_flanks():
    """Ridges of 2 and of 8 um beside a groove of 10 um give the same area within 2 %: they have no weight in the flanks."""
    before, after, area = make_groove_pair(60000, 10 * UM, 1 * UM)
    ridge = np.clip(1 - abs(abs(after.x - 1e-3) / 0.3e-3 - 1.15) / 0.15, 0, None)
    areas = [
        compare_traces(
            before, Profile(after.x, frozen_array(after.z + height * UM * ridge), "after")
        ).worn.area
        for height in (2, 8)
    ]
    assert areas[1].value == pytest.approx(areas[0].value, rel=0.02)
    assert all(found.low <= area <= found.high for found in areas)


@pytest.mark.slow
def test_exact_groove_in_straight_line():
    """The area and depth of a groove in a straight line agree with the closed form within 1e-5."""
    x = np.arange(4001) * 0.5 * UM
    t = (x - 0.9e-3) / 0.3e-3
    cut = np.where(abs(t) < 1, 10 * UM * (1 - t**2), 0.0)
    found = compare_traces(
        Profile(x, frozen_array(-0.002 * x + 1e-9 * np.sin(x / UM)), "before"),
        Profile(x, frozen_array(0.004 * x - cut), "after"),
    )
    assert found.basis == "flanks"
    assert found.worn.area.value == pytest.approx(4e-9, rel=1e-5)
    assert found.worn.largest.value == pytest.approx(10 * UM, rel=1e-5)
    assert found.flanks.start == pytest.approx(0.6e-3, abs=25 * UM)


@pytest.mark.filterwarnings("error")
def test_always_short_traces_have_no_flanks():
    """Traces of two places with fewer samples than a search for flanks needs have no depth and give no raw warning."""
    traces = make_worn_pair(1).before, make_worn_pair(2).after
    found = compare_traces(*(Profile(one.x[:38] * 6, one.z[:38], one.source) for one in traces))
    assert found.basis == "" and "no common part" in found.worn.mean.reason


def test_refuses_trace_with_few_samples():
    """Traces of fewer than 16 samples are refused."""
    short = Profile(np.arange(5.0), np.zeros(5), "short")
    with pytest.raises(PatchfemError, match="16 samples"):
        search_shift(short, short)
