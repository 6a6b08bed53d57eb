"""Levelling and cleaning of a trace: lines vanish, good traces stay untouched, planted faults are all found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import peaks, self_affine, sine
from traces import UM, bumpy

from patchfem.core import PatchfemError
from patchfem.formatting import format_length
from patchfem.surface import Profile, clean, level
from patchfem.surface.profile import SPIKE_DEVIATIONS, find_spikes


def rough(count=4000, seed=0) -> Profile:
    return self_affine(12.7e-3, count, 4e-6, 0.8, 2e-3, 20e-6, seed)


@given(st.floats(-0.5, 0.5), st.floats(-1e-3, 1e-3), st.integers(0, 99))
def test_exact_a_line_is_taken_out_and_nothing_else(slope, offset, seed):
    x, z = (values * UM for values in bumpy(seed=seed))
    z = np.where(np.arange(x.size) % 7 == 3, np.nan, z)
    there = ~np.isnan(z)
    tilted = level(Profile(x, z + slope * x + offset, "a"))
    fit = np.polynomial.Polynomial.fit(x[there], z[there], 1)
    assert tilted.z[there] == pytest.approx(
        z[there] - fit(x[there]), abs=1e-15 + 1e-13 * abs(offset)
    )
    assert np.array_equal(tilted.missing, ~there)
    assert level(tilted).z[there] == pytest.approx(tilted.z[there], abs=1e-18)


def test_exact_a_good_trace_is_not_touched():
    trace = rough()
    assert clean(trace, 100e-6) is trace


@pytest.mark.parametrize("seed", range(6))
def test_exact_planted_spikes_are_found_all_and_only(seed):
    trace = rough(seed=seed)
    rng = np.random.default_rng(seed)
    z = trace.z.copy()
    at = np.sort(rng.choice(np.arange(10, 3900, 20), 40, replace=False))
    for k, place in enumerate(at):
        z[place : place + 1 + k % 3] += rng.choice([-1, 1]) * 20e-6
    hit = np.flatnonzero(z != trace.z)
    spiked = replace(trace, z=z)
    assert np.array_equal(np.flatnonzero(find_spikes(spiked)), hit)
    back = clean(spiked, 100e-6)
    assert np.array_equal(back.x, trace.x)
    smooth = np.abs(
        trace.z[hit] - np.interp(trace.x[hit], np.delete(trace.x, hit), np.delete(trace.z, hit))
    )
    assert np.abs(back.z - trace.z).max() == pytest.approx(smooth.max(), rel=1e-12)
    assert back.notes == (
        f"self-affine trace (seed {seed}): {hit.size} of 4001 heights are spikes (the first at x = "
        f"{format_length(trace.x[hit[0]])}), which lie more than 8 robust standard deviations from the median of 7 samples; "
        "straight lines replace these heights",
    )


@pytest.mark.parametrize("seed", range(20))
def test_always_real_surfaces_hold_no_spikes(seed):
    """Noise, self-affine heights, smooth waves, ramps, steps, coarse digits."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, 1e-2, 2000)
    coarse = np.round(rng.normal(0, 0.4, x.size))
    for z in (
        rng.normal(size=x.size),
        rng.uniform(size=x.size),
        rough(1999, seed).z,
        sine(x, 1, 3e-3).z,
        sine(x, 1, 20e-6).z,
        x * rng.normal(),
        np.heaviside(x - 3e-3, 0),
        coarse,
        0 * x,
        peaks(x, [5e-3], [1.0], [30e-6]).z,
        x**2,
    ):
        assert not find_spikes(Profile(x, z, "a")).any()


def test_exact_the_threshold_is_the_stated_one():
    x = np.arange(200.0) * 1e-6
    noise = np.random.default_rng(4).normal(size=200)
    for factor, found in ((0.999, False), (1.001, True)):
        z = noise.copy()
        high = 0.5 + factor * SPIKE_DEVIATIONS * 1.4826 * 1.5
        z[90:97] = [-2.0, -1.0, 0.5, high, -0.5, 1.0, 2.0]  # median 0.5, deviation 1.5
        assert find_spikes(Profile(x, z, "a"))[93] == found


@given(st.floats(-1, 1), st.integers(0, 10**6))
def test_exact_missing_runs_on_a_line_come_back(slope, seed):
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.5, 1.5, 60)) * UM
    lost = rng.random(60) < 0.4
    lost[[0, -1]] = False
    back = clean(Profile(x, np.where(lost, np.nan, slope * x), "a"), 1.0)
    assert np.array_equal(back.x, x) and back.z == pytest.approx(slope * x, abs=1e-18)
    assert len(back.notes) == bool(lost.any())


def test_exact_missing_ends_are_cut_off_and_counted():
    x = np.arange(12.0) * UM
    z = np.array([np.nan, np.nan, 1, 2, 3, np.nan, np.nan, 6, 7, 8, 9, np.nan]) * UM
    back = clean(Profile(x, z, "before.csv", ("first",)), 3 * UM)
    assert back.x == pytest.approx(x[2:11]) and back.z == pytest.approx((x - UM)[2:11])
    assert back.notes == (
        "first",
        "before.csv: 5 of 12 heights are missing; the gaps are bridged by straight lines, "
        "of which the longest spans 3 um",
    )


def test_refuses_a_long_hole_and_an_empty_trace():
    x = np.arange(12.0) * UM
    z = np.where((x > 2.5 * UM) & (x < 8.5 * UM), np.nan, 0.0)
    with pytest.raises(PatchfemError) as caught:
        clean(Profile(x, z, "before.csv"), 5 * UM)
    assert str(caught.value) == (
        "before.csv: no usable height between x = 2 um and 9 um, and a straight line may bridge at most 5 um; measure "
        "this part of the trace anew or use a larger contact.element_size"
    )
    with pytest.raises(
        PatchfemError, match=r"before\.csv: 0 usable heights; a trace needs at least two"
    ):
        clean(Profile(x, np.full(12, np.nan), "before.csv"), 1.0)


@pytest.mark.parametrize(
    "length, words",
    [
        (12.7e-3, "12.7 mm"),
        (200e-6, "200 um"),
        (1e-3, "1 mm"),
        (2.5, "2.5 m"),
        (-3e-9, "-3 nm"),
        (0.0, "0 um"),
        (1e-6, "1 um"),
    ],
)
def test_exact_lengths_in_messages(length, words):
    assert format_length(length) == words
