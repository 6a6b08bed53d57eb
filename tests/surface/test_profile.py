"""Levelling and cleaning of traces: lines are removed, good traces are unchanged, added faults are all detected."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import self_affine, sine
from traces import UM, draw_uneven_trace

from patchfem.core import PatchfemError
from patchfem.formatting import format_length
from patchfem.surface import Profile, clean, level
from patchfem.surface.profile import find_spikes


def make_rough_trace(count=4000, seed=0) -> Profile:
    """Return a self-affine trace."""
    return self_affine(12.7e-3, count, 4e-6, 0.8, 2e-3, 20e-6, seed)


@given(st.floats(-0.5, 0.5), st.floats(-1e-3, 1e-3), st.integers(0, 99))
def test_exact_levelling_removes_only_the_line(slope, offset, seed):
    """Levelling removes the least-squares line and nothing else, also with missing heights."""
    x, z = (values * UM for values in draw_uneven_trace(seed=seed))
    z = np.where(np.arange(x.size) % 7 == 3, np.nan, z)
    present = ~np.isnan(z)
    levelled = level(Profile(x, z + slope * x + offset, "a"))
    fit = np.polynomial.Polynomial.fit(x[present], z[present], 1)
    assert levelled.z[present] == pytest.approx(
        z[present] - fit(x[present]), abs=1e-15 + 1e-13 * abs(offset)
    )
    assert np.array_equal(levelled.missing, ~present)
    assert level(levelled).z[present] == pytest.approx(levelled.z[present], abs=1e-18)


def test_exact_good_trace_is_unchanged():
    """Cleaning returns the same object if a trace has no faults."""
    trace = make_rough_trace()
    assert clean(trace, 100e-6) is trace


@pytest.mark.parametrize("seed", range(2))
def test_exact_added_spikes_are_all_detected(seed):
    """All added spikes and no other samples are detected, and straight lines replace them, with a note."""
    trace = make_rough_trace(seed=seed)
    rng = np.random.default_rng(seed)
    z = trace.z.copy()
    indices = np.sort(rng.choice(np.arange(10, 3900, 20), 40, replace=False))
    for k, index in enumerate(indices):
        z[index : index + 1 + k % 3] += rng.choice([-1, 1]) * 20e-6
    hit = np.flatnonzero(z != trace.z)
    spiked = replace(trace, z=z)
    assert np.array_equal(np.flatnonzero(find_spikes(spiked)), hit)
    cleaned = clean(spiked, 100e-6)
    assert np.array_equal(cleaned.x, trace.x)
    deviation = np.abs(
        trace.z[hit] - np.interp(trace.x[hit], np.delete(trace.x, hit), np.delete(trace.z, hit))
    )
    assert np.abs(cleaned.z - trace.z).max() == pytest.approx(deviation.max(), rel=1e-12)
    assert cleaned.notes == (
        f"self-affine trace (seed {seed}): {hit.size} of 4001 heights are spikes (the first at x = "
        f"{format_length(trace.x[hit[0]])}), which lie more than 8 robust standard deviations from the median of 7 samples; "
        "straight lines replace these heights",
    )


@pytest.mark.parametrize("seed", range(4))
def test_always_regular_surfaces_have_no_spikes(seed):
    """Noise, self-affine heights, waves, ramps, steps and rounded heights have no spikes."""
    rng = np.random.default_rng(seed)
    x = np.linspace(0, 1e-2, 2000)
    coarse = np.round(rng.normal(0, 0.4, x.size))
    for z in (
        rng.normal(size=x.size),
        rng.uniform(size=x.size),
        make_rough_trace(1999, seed).z,
        sine(x, 1, 3e-3).z,
        sine(x, 1, 20e-6).z,
        x * rng.normal(),
        np.heaviside(x - 3e-3, 0),
        coarse,
        0 * x,
        np.exp(-(((x - 5e-3) / 30e-6) ** 2) / 2),
        x**2,
    ):
        assert not find_spikes(Profile(x, z, "a")).any()


@given(st.floats(-1, 1), st.integers(0, 10**6))
def test_exact_missing_heights_on_line_are_restored(slope, seed):
    """Missing heights on a straight line are restored exactly, with a note."""
    rng = np.random.default_rng(seed)
    x = np.cumsum(rng.uniform(0.5, 1.5, 60)) * UM
    is_missing = rng.random(60) < 0.4
    is_missing[[0, -1]] = False
    cleaned = clean(Profile(x, np.where(is_missing, np.nan, slope * x), "a"), 1.0)
    assert np.array_equal(cleaned.x, x) and cleaned.z == pytest.approx(slope * x, abs=1e-18)
    assert len(cleaned.notes) == bool(is_missing.any())


def test_exact_missing_ends_are_trimmed():
    """Missing heights at the ends are trimmed and counted in the note."""
    x = np.arange(12.0) * UM
    z = np.array([np.nan, np.nan, 1, 2, 3, np.nan, np.nan, 6, 7, 8, 9, np.nan]) * UM
    cleaned = clean(Profile(x, z, "before.csv", ("first",)), 3 * UM)
    assert cleaned.x == pytest.approx(x[2:11]) and cleaned.z == pytest.approx((x - UM)[2:11])
    assert cleaned.notes == (
        "first",
        "before.csv: 5 of 12 heights are missing; the gaps are bridged by straight lines, "
        "of which the longest spans 3 um",
    )


def test_refuses_long_gap_and_empty_trace():
    """A gap longer than the limit and a trace without heights are refused."""
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
