"""Scars, drifts and short flanks of `scars`: how many intervals hold the truth, and what must not be told as wear."""

import numpy as np
import pytest
from scars import HELD_OUT, KINDS, UM, compared, rough, score

from patchfem.core import frozen_array
from patchfem.surface import Profile
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.place import find_place
from patchfem.surface.compare.verdict import compose_verdict
from patchfem.surface.profile import remove_spikes

COUNTS = pytest.mark.parametrize("count", [2, pytest.param(20, marks=pytest.mark.slow)])


@COUNTS
@pytest.mark.parametrize("kind", ["sine", "walk"])
def test_always_a_drift_of_the_datum_is_not_told_as_wear(kind, count):
    """11 of 20 sines and 4 of 20 walks were "worn", with intervals of which none held the truth."""
    _, held, false = score(kind, range(HELD_OUT, HELD_OUT + count))
    assert not false and not held


@COUNTS
@pytest.mark.parametrize("kind", ["standard", "shallow", "vee"])
def test_intervals_of_scars_hold_the_truth(kind, count):
    """At least 17 of 20 for each number; the ends of shallow scars were in 0 of 20, the depth of a V in 12 of 20."""
    _, held, worn = score(kind, range(HELD_OUT, HELD_OUT + count))
    assert worn == count and len(held) == 6
    assert all(good >= given - 0.15 * count for good, given, _ in held.values())


def test_always_a_standard_scar_stays_sharp():
    held = score("standard", range(HELD_OUT, HELD_OUT + 2))[1]
    assert held["worn_depth_mean"][2] < 2e-9 and held["worn_depth_max"][2] < 12e-9


@COUNTS
def test_always_a_wide_scar_has_both_readings_or_an_interval_near_the_truth(count):
    """Headlines said that material grew, or that no wear was detected. Of all intervals 85 % hold at least."""
    heads, held, _ = score("wide", range(HELD_OUT, HELD_OUT + count))
    assert all(one.startswith(("worn", "a scar or")) for one in heads)
    assert sum(good for good, *_ in held.values()) >= 0.85 * sum(
        given for _, given, _ in held.values()
    )


def test_always_a_reading_never_has_a_largest_depth_below_its_mean():
    for kind in KINDS:
        worn = compared(kind, HELD_OUT)[0].worn
        assert worn.mean.value is None or worn.largest.value >= worn.mean.value


def test_always_a_floor_of_another_roughness_has_one_track():
    """A floor that reaches the unworn height here and there ended in a division by zero."""
    x = np.arange(0, 6000, 2.0)
    inside = abs(x - 3000) <= 1000
    random = np.random.default_rng(HELD_OUT)
    first = rough(HELD_OUT)(x)
    other = rough(HELD_OUT + 1)(x) * 5 / 3
    readings = first, np.where(inside, other - 1.5, first)
    traces = [
        Profile(frozen_array(x * UM), frozen_array((z + random.normal(0, 0.01, x.size)) * UM), name)
        for z, name in zip(readings, ("before", "after"))
    ]
    found = compare_traces(*traces)
    assert found.worn.mean.value == pytest.approx(np.mean(first - readings[1]) * UM, rel=0.01)
    assert len(found.tracks.spans) == 1


def parabola(width: float) -> tuple:
    """(traces before and after, depth (n,) [um]) of a scar of so many um on 6 mm, 1.5 um deep."""
    x = np.arange(0, 6000, 2.0)
    deep = 1.5 * np.clip(1 - ((x - 3000) / (width / 2)) ** 2, 0, None)
    random = np.random.default_rng(HELD_OUT)
    first = rough(HELD_OUT)(x)
    return [
        Profile(frozen_array(x * UM), frozen_array((z + random.normal(0, 0.01, x.size)) * UM), name)
        for z, name in ((first, "before"), (first - deep, "after"))
    ], deep


def test_always_a_straight_datum_that_is_declared_takes_no_bow_out():
    """A parabola of 5.5 mm on 6 mm: a scar or a bow, unless the datum is known to be straight."""
    traces, deep = parabola(5500)
    assert compose_verdict([compare_traces(*traces)])[0].startswith("a scar or a bent datum")
    found = compare_traces(*traces, is_straight=True)
    assert found.alignment.bend == 0 and found.worn.mean.value == pytest.approx(
        deep.mean() * UM, rel=0.01
    )


def test_always_a_told_shift_does_not_make_worn_flanks_unworn():
    """A scar of 5.8 mm on 6 mm was given as one of 4.7 mm, with an interval without the truth."""
    traces, _ = parabola(5800)
    found = compare_traces(*traces, is_straight=True, shift=0.0)
    # a parabola, 1.5 um deep
    assert found.worn.mean.low <= 2 / 3 * 1.5 * UM * 5800 / 6000 <= found.worn.mean.high
    found = compare_traces(*traces, shift=0.0)
    assert found.worn.mean.value is None and "the datum" in found.worn.mean.reason


def test_always_a_told_shift_is_believed_where_nearly_all_heights_agree():
    """Noise of a tenth of the roughness over a scar within it was called no better than chance."""
    x = np.arange(0, 6000, 2.0)
    random = np.random.default_rng(HELD_OUT)
    first = rough(HELD_OUT)(x)
    deep = 0.02 * np.clip(1 - ((x - 3000) / 1000) ** 2, 0, None)
    before, after = (
        Profile(
            frozen_array(x * UM), frozen_array((z + random.normal(0, 0.022, x.size)) * UM), name
        )
        for z, name in ((first, "before"), (first - deep, "after"))
    )
    assert find_place(before, after, 0.0).alignment is not None
    other = Profile(before.x, frozen_array(rough(HELD_OUT + 5)(x) * UM), "other")
    assert find_place(before, other, 0.0).alignment is None


def test_exact_spikes_are_counted_as_places():
    x = np.arange(0, 6000, 2.0)
    z = rough(HELD_OUT)(x) + np.random.default_rng(1).normal(0, 0.01, x.size)
    z[100:2900:140] += 8
    note = remove_spikes(Profile(frozen_array(x * UM), frozen_array(z * UM), "trace")).notes[0]
    assert "dust at 20 places" in note and "60 of 3000 heights with their neighbours" in note
