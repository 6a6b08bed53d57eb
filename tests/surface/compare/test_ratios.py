"""Ratios of amplitude and slope with their intervals, and the words that they carry."""

import numpy as np
import pytest
from pairs import UM, pair
from synthetic import report_area

from patchfem.core import PatchfemError, frozen_array
from patchfem.surface import Profile, Quantity, divide_sizes, measure_size
from patchfem.surface.areal import Areal
from patchfem.surface.compare.compare import (
    compare_directions,
    compare_traces,
    compare_waves,
    fill_scan,
)
from patchfem.surface.compare.ratios import Size
from patchfem.surface.compare.sentences import compute_confidence, describe_ratio_change
from patchfem.surface.compare.verdict import compose_verdict

MANY = pytest.param(40, marks=pytest.mark.slow)


@pytest.mark.parametrize("count", [4, MANY])
def test_always_unchanged_surfaces_are_called_reduced_in_5_of_100_cases_at_most(count):
    """Of 2 count ratios at 5 %, so 2.5 % each way; of 8 ratios two or more one way have a chance of 1.6 %."""
    seeds = range(70000, 70000 + count)
    sizes = [
        [measure_size(pair(seed + part, share=0.0).before, UM) for part in (0, 5000)]
        for seed in seeds
    ]
    found = [divide_sizes("amplitude", "", *two) for one in sizes for two in (one, one[::-1])]
    words = [describe_ratio_change(one) for one in found]
    most = max(count // 10, 1)
    assert words.count("reduced") <= most and words.count("increased") <= most
    values = np.quantile([one.value for one in found], (0.05, 0.95))
    assert [a.value * b.value for a, b in zip(found[::2], found[1::2])] == pytest.approx(
        [1.0] * count, rel=1e-12
    )
    if count < 40:  # too few for the ends of the distribution
        assert 0.64 * 0.85 < values[0] < 1 < values[1] < 1.57 * 1.15
        return
    assert values == pytest.approx((0.64, 1.57), rel=0.15)  # measured on the report's surface, 1 mm


@pytest.mark.slow
def test_always_unchanged_surfaces_in_one_place_are_called_reduced_in_5_of_100_cases_at_most():
    """Five or more of 40 at 2.5 % have a chance of one in 300."""
    words = []
    widths = []
    for seed in range(30100, 30140):
        p = pair(seed, share=0.0)
        ratio = compare_traces(p.before, p.after).ratios.amplitude
        words.append(describe_ratio_change(ratio))
        widths.append(ratio.high / ratio.low)
    assert words.count("reduced") <= 4 and np.median(widths) < 1.01


def test_exact_intervals_of_fisher_and_of_pitman():
    """Both by other functions: quantiles of F by drawing chi-squares; Pitman's bounds as roots of his statistic."""
    one = Size(2.0, 0.4, (14.0, 60.0), None)
    other = Size(1.0, 0.4, (9.0, 60.0), None)
    found = divide_sizes("amplitude", "", one, other)
    random = np.random.default_rng(0)
    drawn = np.sqrt(random.chisquare(14, 400000) / 14 / (random.chisquare(9, 400000) / 9))
    low, high = 2 / np.quantile(drawn, (0.975, 0.025))
    assert (found.low, found.high) == pytest.approx((low, high), rel=0.01)
    found = divide_sizes("amplitude", "", one, other, 0.8)
    for bound in (
        found.low,
        found.high,
    ):  # at the bound, sums and differences of scaled traces just correlate
        f = (found.value / bound) ** 2
        r = (f - 1) / np.sqrt((f + 1) ** 2 - 4 * 0.8**2 * f)
        t = abs(r) * np.sqrt(8 / (1 - r**2))
        assert t == pytest.approx(2.306, abs=2e-3)  # Student, 8 degrees of freedom, 97.5 %


def test_exact_confidence_of_an_interval_that_just_reaches_one():
    assert compute_confidence(Quantity(0.5, 0.25, 1.0, "1", "")) == pytest.approx(0.95, abs=1e-6)
    assert describe_ratio_change(Quantity(0.5, 0.25, 1.0, "1", "")) == "no change shown"


def test_always_wear_of_peaks_is_called_reduced():
    p = pair(30077, share=0.5)
    headline, sentences = compose_verdict([compare_traces(p.before, p.after, "x")])
    assert headline == "worn, waves reduced" and sentences[0].startswith("Worn along x: ")
    assert sentences[1].startswith("Depths are measured from the ")
    assert "along x" in sentences[2] and "confidence" in sentences[2]


def scan(seed: int, squeeze: int = 1) -> Areal:
    """An isotropic scan, or one whose waves along y are longer by a factor."""
    x, y, z = report_area((256, 256), 4 * UM, seed)
    return Areal(
        x, y, frozen_array(np.repeat(z[: 256 // squeeze], squeeze, axis=0)), f"scan {seed}"
    )


def test_always_an_areal_scan_shows_which_direction_is_smoother():
    before = scan(3)
    after = scan(3, 4)
    # no search for a place, which they do not share
    filled = tuple(map(fill_scan, (before, after)))
    parts = [compare_waves((before, after), filled, name) for name in ("x", "y")]
    found = compare_directions(parts)
    assert [describe_ratio_change(one[1]) for one in found] == ["no change shown", "increased"]
    text = compose_verdict(parts, found)[1]
    assert text[-2].startswith("Before: no anisotropy shown") and text[-1].startswith(
        "After: anisotropic"
    )
    assert "larger along x" in text[-1] and parts[0].worn.mean.value is None


def test_always_two_pairs_are_compared_across():
    parts = [
        compare_traces(pair(seed).before, pair(seed).after, name)
        for seed, name in ((30001, "x"), (30002, "y"))
    ]
    found = compare_directions(parts)
    assert [one[0] for one in found] == ["before", "after"]
    assert found[0][1].low < 1 < found[0][1].high


def test_always_a_coarser_trace_is_compared_at_its_own_step():
    p = pair(30003)
    fine = compare_traces(p.before, p.after)
    coarse = compare_traces(
        p.before, Profile(frozen_array(p.after.x[::2]), frozen_array(p.after.z[::2]), "coarse")
    )
    assert any("at a step of 2 um" in text for text in coarse.notes)
    assert coarse.ratios.amplitude.value == pytest.approx(fine.ratios.amplitude.value, rel=0.01)
    assert coarse.worn.mean.value == pytest.approx(fine.worn.mean.value, abs=0.01 * UM)


def test_refuses_a_trace_too_short_for_the_band():
    p = pair(1)
    short = Profile(p.before.x[:150], p.before.z[:150], "short")
    with pytest.raises(PatchfemError, match="not the whole band"):
        compare_traces(short, short)
