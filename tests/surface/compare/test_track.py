"""Largest depth and place of a worn track against the track that was made: flat band, parabola, round scratch.

The rule was tuned on seeds 1000 to 1040 and on 5000 to 5080; the seeds here are others, named before their score.
"""

from dataclasses import replace

import numpy as np
import pytest
from pairs import KINDS, UM, pair, track

from patchfem.core import frozen_array
from patchfem.surface import Profile, level
from patchfem.surface.compare.compare import compare_traces
from patchfem.surface.compare.flanks import find_flanks
from patchfem.surface.compare.section import Section, find_end, find_ends
from patchfem.surface.compare.verdict import compose_verdict

HELD_OUT = 90000


def scored(kind: str, count: int) -> tuple:
    """Of each seed: the error of the largest depth [m], whether its interval holds it, and those of both ends."""
    errors = []
    held = []
    ends = []
    for seed in range(HELD_OUT, HELD_OUT + count):
        p = track(kind, seed)
        worn = compare_traces(p.before, p.after, shift=p.shift + 0.3 * UM).worn
        errors.append(worn.largest.value - p.worn.max())
        held.append(worn.largest.low <= p.worn.max() <= worn.largest.high)
        on = p.after.x[p.worn > 0]
        ends += [
            one.low <= true - move <= one.high
            for pair, move in ((worn.extent.after, 0.0), (worn.extent.before, p.shift))
            for one, true in zip(pair, (on[0], on[-1]))
        ]
    return np.array(errors), np.mean(held), np.mean(ends)


@pytest.mark.share(1)
@pytest.mark.parametrize("kind", KINDS)
def test_always_the_largest_depth_and_the_place_hold_the_truth(kind):
    """8 seeds: three misses or more have a chance of 0.6 % at 95 of 100; the noise of a depth is 28 nm."""
    errors, held, ends = scored(kind, 8)
    assert held >= 6 / 8 and ends >= 26 / 32
    assert abs(errors.mean()) < 0.012 * UM and abs(errors).max() < 0.06 * UM


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_always_200_tracks_of_a_kind_hold_the_truth_in_93_of_100_intervals(kind):
    errors, held, ends = scored(kind, 200)
    assert held >= 0.93 and ends >= 0.93, (held, ends)
    assert abs(errors.mean()) < 0.005 * UM and errors.std() < 0.015 * UM, errors


def test_exact_without_noise_the_depth_and_the_place():
    p = track("band", 7, noise=0.0)
    worn = compare_traces(p.before, p.after, shift=p.shift).worn
    on = p.after.x[p.worn > 0]
    assert worn.largest.value == pytest.approx(p.worn.max(), abs=1e-4 * UM)
    # between the last unworn sample and the first worn one
    ends = [on[0] - UM / 2, on[-1] + UM / 2]
    assert [one.value for one in worn.extent.after] == pytest.approx(ends, abs=1e-12)
    moved = [place - p.shift for place in ends]
    assert [one.value for one in worn.extent.before] == pytest.approx(moved, abs=1e-3 * UM)


@pytest.mark.parametrize("seed", [18, 37])
def test_exact_digits_of_a_tilted_trace_are_no_wear(seed):
    """Six digits of heights that rise by 4 um along the second trace: their last one is ten times coarser there."""
    r = np.random.default_rng(seed)
    x = np.arange(4000) * 0.5
    first = 0.2 * np.convolve(r.standard_normal(4040), np.ones(20) / 4, "same")[:4000]
    depth = 3 * np.clip(1 - ((x - 1000) / 200) ** 2, 0, None)
    traces = [
        Profile(
            frozen_array(x * UM),
            frozen_array(np.array([float(f"{one:.6g}") for one in z]) * UM),
            "a trace",
        )
        for z in (first, first - depth + 0.002 * x)
    ]
    worn = compare_traces(*traces, shift=0.0).worn
    for ends in (worn.extent.before, worn.extent.after):
        assert [one.value for one in ends] == pytest.approx([800 * UM, 1200 * UM], abs=1 * UM)


@pytest.mark.share(0, 2)
@pytest.mark.parametrize(
    "made", [*(track(kind, 90300) for kind in KINDS), pair(90300)], ids=[*KINDS, "peaks"]
)
def test_always_files_in_the_wrong_order_are_told_and_others_are_not(made):
    for one, other, told in ((made.before, made.after, 0), (made.after, made.before, 1)):
        headline, sentences = compose_verdict([compare_traces(one, other)])
        words = [text for text in (headline, *sentences) if "in the wrong order" in text]
        assert len(words) == 2 * told and all(
            "material grew" in text or "deposits" in text for text in words
        )


def test_always_flanks_rougher_than_the_trace_before_are_not_unworn():
    """A box of 8 um in a trace of the same spectrum is a track; in one of four times the roughness it is none."""
    before, other = (level(pair(seed).before) for seed in (90304, 90305))
    cut = 8 * UM * (np.abs(other.x - 500 * UM) < 150 * UM)
    found = find_flanks(before, replace(other, z=frozen_array(other.z - cut)))
    assert found is not None and found.largest[0] > 8 * UM
    assert find_flanks(before, replace(other, z=frozen_array(4 * (other.z - cut)))) is None


def test_always_no_place_where_nothing_is_worn():
    p = pair(90302, share=0.0)
    assert compare_traces(p.before, p.after, shift=p.shift).worn.extent is None


@pytest.mark.parametrize(("step", "rise", "scatter"), [(12, 100, 0), (15, 60, 5)])
def test_always_a_cliff_ends_half_way_between_two_samples(step, rise, scatter):
    """20 seeds: an unworn height, then one over 10 deviations deep; a smooth flank fits nearly as well."""
    ends = []
    for seed in range(20):
        random = np.random.default_rng(seed)
        flank = step + rise * (1 - np.exp(-np.arange(300) / 5)) + scatter * random.normal(size=300)
        depth = np.append(np.zeros(200), flank) + random.normal(size=500)
        found = find_end(depth, np.ones(500), 1.0, 203)
        ends.append(np.array([found.low, found.first, found.high]) - found.offset - 199.5)
    low, value, high = np.transpose(ends)
    assert np.mean((low <= 0) & (high >= 0)) >= 0.9
    assert np.median(value) == 0 and np.median(high - low) == 2


@pytest.mark.parametrize("power", [1, 2])
def test_always_the_end_of_a_flank_that_runs_out_flat_holds_a_drift_of_the_datum(power):
    """40 seeds: the level of each trace is wrong by its slow error; a straight flank hardly moves by it."""
    held = []
    lengths = []
    t = np.clip(np.arange(1600) - 799.5, 0, None)
    flank = 200 * np.minimum(t / 400, 1) ** power
    for seed in range(40):
        random = np.random.default_rng(seed)
        draws = 0.5 * random.normal(size=(200, 1)) + random.normal(size=(200, 1600))
        depth = flank + 0.5 * random.normal() + random.normal(size=1600)
        section = Section(np.arange(1600.0), depth, np.ones(1600), draws, 1.0)
        start = find_ends(section, (int(np.argmax(depth > 6)), 1590), (0, 1600)).start
        held.append(start.low <= 799.5 <= start.high)
        lengths.append(start.high - start.low)
    assert np.mean(held) >= 0.9
    assert np.median(lengths) < {1: 60, 2: 100}[power]
