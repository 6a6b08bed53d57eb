"""Mutual wear of two rough surfaces: volumes, limits in closed form, symmetries, an independent
program."""

from __future__ import annotations

import numpy as np
import pytest
from rubbing import anisotropy, rub
from synthetic import report_area

from patchfem.core import PatchfemError

STEP = 3.2e-6
UM = 1e-6


def make_surfaces(shape=(40, 60), seed=0):
    """Return two random rough surfaces of a given shape [m]."""
    return (report_area(shape, STEP, 2 * seed)[2], report_area(shape, STEP, 2 * seed + 1)[2])


@pytest.mark.parametrize("stroke", [0, 1, 30])
@pytest.mark.parametrize("upper_share", [0.3, 1.0])
def test_exact_worn_volume_is_divided_by_wear_share(stroke, upper_share):
    """Each surface loses its prescribed fraction of the worn volume, and no height rises."""
    lower, upper = make_surfaces()
    worn = rub(lower, upper, STEP, stroke * STEP, 7 * UM, upper_share=upper_share, bite=0.2 * UM)
    assert (lower - worn.lower).mean() == pytest.approx(
        (1 - upper_share) * 7 * UM, rel=1e-12, abs=1e-20
    )
    assert (upper - worn.upper).mean() == pytest.approx(upper_share * 7 * UM, rel=1e-12, abs=1e-20)
    assert (worn.lower <= lower).all() and (worn.upper <= upper).all()


def test_exact_wear_without_stroke_truncates_combined_heights():
    """Without a stroke the sum of both surfaces is truncated at the plane above which the worn
    volume was, in one step or in many."""
    lower, upper = make_surfaces()
    heights = np.sort((lower + upper).ravel())[::-1]
    volume_above = np.cumsum(heights) - heights * np.arange(
        1, heights.size + 1
    )  # volume of the heights above each height
    count = int(np.searchsorted(volume_above, 9 * UM * heights.size))
    plane = (heights[:count].sum() - 9 * UM * heights.size) / count
    for bite in (9 * UM, 0.05 * UM):
        result = rub(lower, upper, STEP, 0.0, 9 * UM, bite=bite)
        is_worn = lower + upper > plane
        assert result.lower + result.upper == pytest.approx(
            np.minimum(lower + upper, plane), abs=1e-13
        )
        assert np.array_equal(result.lower < lower, is_worn) and np.array_equal(
            result.upper < upper, is_worn
        )
        assert lower - result.lower == pytest.approx(upper - result.upper, rel=1e-12, abs=1e-18)


def test_exact_hard_surface_leaves_its_envelope():
    """A hard rough surface leaves its envelope over the stroke in the soft surface: every point of
    the soft surface touches at some position, and none penetrates."""
    hard = make_surfaces((40, 60))[0][::6]
    worn_surface = rub(
        hard, 0 * hard, STEP, 4 * STEP, 40 * UM, upper_share=1.0, bite=40 * UM / 16 / 2000
    ).upper
    # heights of the hard surface at every position of the stroke
    shifted = np.array([np.roll(hard, -u, 1) for u in range(-4, 5)])
    approach = (shifted + worn_surface).max(axis=(1, 2), keepdims=True)
    assert (approach - shifted).min(axis=0) - worn_surface == pytest.approx(
        0 * worn_surface, abs=0.05 * UM
    )


@pytest.mark.parametrize("seeds", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_always_anisotropy_agrees_with_independent_program(seeds):
    """The anisotropy of worn surfaces agrees with an independent program at strokes of 6.4 and 12.8
    um. That program gave 0.950 and 0.879 after 3 um of wear of each surface, and 0.849 +- 0.032 and
    0.684 +- 0.019 after 6 um. The values here are relative to wear without a stroke, so that the
    scatter of few surfaces cancels."""

    def mean_anisotropy(*surfaces):
        return np.mean([anisotropy(z, STEP)["band"] for z in surfaces])

    ratios = {0: [], 2: [], 4: []}
    for seed in range(seeds):
        pair = make_surfaces((320, 320), seed)
        for stroke, rows in ratios.items():
            half = rub(*pair, STEP, stroke * STEP, 6 * UM, bite=0.02 * UM)
            end = rub(half.lower, half.upper, STEP, stroke * STEP, 6 * UM, bite=0.02 * UM)
            rows.append(
                (mean_anisotropy(half.lower, half.upper), mean_anisotropy(end.lower, end.upper))
            )
    without_stroke, short, long = (np.mean(rows, axis=0) for rows in ratios.values())
    assert without_stroke == pytest.approx(1, abs=0.05)
    assert short / without_stroke == pytest.approx([0.950, 0.849], abs=0.032)
    assert long / without_stroke == pytest.approx([0.879, 0.684], abs=0.019)


@pytest.mark.parametrize("change, message", [
    ({"upper": np.zeros((40, 61))}, "both surfaces must have finite heights on the same raster"),
    ({"stroke": 5e-6}, "at most half the length of the raster; the nearest whole number of steps is 6.4e-06 m"),
    ({"stroke": 31 * STEP}, "at most half the length"),
    ({"stroke": -STEP}, "the stroke must be zero or more"),
    ({"worn": np.nan}, "`worn` (a depth) must be zero or more"),
    ({"upper_share": 1.1}, "`upper_share` must lie between 0 and 1"),
    ({"bite": 0.0}, "`bite` must be above zero"),
    ({"worn": 1e-20}, "is below the round-off of the heights"),
])  # fmt: skip
def test_refuses_invalid_surfaces_and_parameters(change, message):
    """Surfaces and parameters that are not valid are refused with a message that says why."""
    lower, upper = make_surfaces()
    arguments = {
        "lower": lower,
        "upper": upper,
        "step": STEP,
        "stroke": 2 * STEP,
        "worn": UM,
    } | change
    with pytest.raises(PatchfemError) as error:
        rub(**arguments)
    assert message in str(error.value)
