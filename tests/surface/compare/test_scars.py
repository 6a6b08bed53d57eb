"""Scars, drifts and short flanks of the module `scars`: coverage of intervals, and no wear where there is none."""

import numpy as np
import pytest
from scars import HELD_OUT, UM, rough_surface, score_comparisons

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.verdict import compose_verdict

COUNTS = pytest.mark.parametrize("count", [1, pytest.param(20, marks=pytest.mark.slow)])


@COUNTS
@pytest.mark.parametrize("kind", ["sine", "walk"])
def test_always_datum_drift_is_not_wear(kind, count):
    """A drift of the datum is not reported as wear.

    Earlier 11 of 20 sines and 4 of 20 random walks were.
    """
    _, intervals, n_worn = score_comparisons(kind, range(HELD_OUT, HELD_OUT + count))
    assert not n_worn and not intervals


@COUNTS
@pytest.mark.parametrize("kind", ["standard", "shallow", "vee"])
def test_always_intervals_of_scars_cover_truth(kind, count):
    """At least 17 of 20 intervals of each quantity of a scar cover the truth.

    Earlier no interval covered the ends of shallow scars, and 12 of 20 the depth of a V.
    """
    _, intervals, n_worn = score_comparisons(kind, range(HELD_OUT, HELD_OUT + count))
    assert n_worn == count and len(intervals) == 6
    assert all(good >= given - 0.15 * count for good, given, _ in intervals.values())


def test_always_intervals_of_standard_scar_are_narrow():
    """The half widths of the intervals of a standard scar are below 2 nm for the mean and 12 nm for the largest depth."""
    intervals = score_comparisons("standard", [HELD_OUT])[1]
    assert intervals["worn_depth_mean"][2] < 2e-9 and intervals["worn_depth_max"][2] < 12e-9


@COUNTS
def test_always_wide_scar_has_both_readings_or_covers_truth(count):
    """A wide scar has both readings, or intervals of which at least 85 % cover the truth.

    Earlier headlines stated growth or no wear.
    """
    headlines, intervals, _ = score_comparisons("wide", range(HELD_OUT, HELD_OUT + count))
    assert all(headline.startswith(("worn", "a scar or")) for headline in headlines)
    assert sum(good for good, *_ in intervals.values()) >= 0.85 * sum(
        given for _, given, _ in intervals.values()
    )


def test_always_scar_between_flanks_of_1_percent_has_both_readings():
    """A wedge between flanks of 1.3 % of the length may be growth of the ends.

    Earlier the flanks of the wedge were taken for material that grew.
    """
    headlines, intervals, _ = score_comparisons("wide", [HELD_OUT + 11])
    assert not intervals and "a scar or material that grew at the ends" in "".join(headlines)


def test_always_floor_of_other_roughness_is_one_track():
    """A floor of other roughness that reaches the unworn height at some samples is one track.

    Earlier it led to a division by zero.
    """
    x = np.arange(0, 6000, 2.0)
    inside = abs(x - 3000) <= 1000
    random = np.random.default_rng(HELD_OUT)
    unworn = rough_surface(HELD_OUT)(x)
    floor = rough_surface(HELD_OUT + 1)(x) * 5 / 3
    readings = unworn, np.where(inside, floor - 1.5, unworn)
    traces = [
        Profile(frozen_array(x * UM), frozen_array((z + random.normal(0, 0.01, x.size)) * UM), name)
        for z, name in zip(readings, ("before", "after"))
    ]
    found = compare_traces(*traces)
    assert found.worn.mean.value == pytest.approx(np.mean(unworn - readings[1]) * UM, rel=0.01)
    assert len(found.tracks.spans) == 1


def make_parabolic_scar(width: float) -> tuple:
    """Return the traces before and after and the depth (n,) [um] of a parabolic scar of 1.5 um on 6 mm.

    The width of the scar is in um.
    """
    x = np.arange(0, 6000, 2.0)
    depth = 1.5 * np.clip(1 - ((x - 3000) / (width / 2)) ** 2, 0, None)
    random = np.random.default_rng(HELD_OUT)
    unworn = rough_surface(HELD_OUT)(x)
    return [
        Profile(frozen_array(x * UM), frozen_array((z + random.normal(0, 0.01, x.size)) * UM), name)
        for z, name in ((unworn, "before"), (unworn - depth, "after"))
    ], depth


def test_always_straight_datum_is_not_corrected_for_bend():
    """A parabola of 5.5 mm on 6 mm is a scar or a bent datum; with a straight datum it is a scar, within 1 %."""
    traces, depth = make_parabolic_scar(5500)
    assert compose_verdict([compare_traces(*traces)])[0].startswith("a scar or a bent datum")
    found = compare_traces(*traces, is_straight=True)
    assert found.alignment.bend == 0 and found.worn.mean.value == pytest.approx(
        depth.mean() * UM, rel=0.01
    )


def test_always_given_shift_does_not_shorten_scar():
    """With a given shift a scar of 5.8 mm on 6 mm has an interval that covers the truth.

    Earlier it was reported with a length of 4.7 mm.
    """
    traces, _ = make_parabolic_scar(5800)
    found = compare_traces(*traces, is_straight=True, shift=0.0)
    # the mean depth of a parabola that is 1.5 um deep
    assert found.worn.mean.low <= 2 / 3 * 1.5 * UM * 5800 / 6000 <= found.worn.mean.high
    found = compare_traces(*traces, shift=0.0)
    assert found.worn.mean.value is None and "the datum" in found.worn.mean.reason
