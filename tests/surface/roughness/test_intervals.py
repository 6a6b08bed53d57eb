"""Intervals from a single trace: fraction of intervals that cover the mean over all traces."""

import numpy as np
import pytest
from patchfem.surface.roughness.intervals import Intervals
from patchfem.surface.roughness.rows import PRIMARY, ROUGH, TABLE, WAVES
from ring_traces import draw_traces

from patchfem.surface import Heights, Profile, level
from patchfem.surface.roughness.filter import filter_trace
from patchfem.surface.roughness.spectrum import band_amplitude, estimate_spectrum

UM = 1e-6
LENGTH, CUTOFF = 1e-3, 250e-6


def compute_parameters(z, names=None) -> list:
    """Return (record, row, value) of parameters of a trace of 1 mm, without and with a cut-off of 0.25 mm.

    All parameters are computed, or only those named.
    """
    trace = Profile(np.arange(z.size) * UM, z, "made")
    primary = Heights(level(trace).z, UM)
    rough = Heights(filter_trace(trace, CUTOFF)[1].z, UM, CUTOFF)
    spectrum = estimate_spectrum(primary.z, UM)
    entries = [
        (
            primary,
            row,
            band_amplitude(spectrum, 60e-6, 110e-6)
            if row.compute is None
            else row.compute(primary),
        )
        for row in (*PRIMARY, *WAVES)
        if names is None or row.name in names
    ]
    return entries + [
        (rough, row, row.compute(rough)) for row in ROUGH if names is None or row.name in names
    ]


def interval_coverage(count: int, seed: int, names=None, n_reference: int = 2000) -> dict:
    """Return the fraction of `count` traces whose interval covers the mean over `n_reference`, by name."""
    sums: dict = {}
    for z in draw_traces(n_reference, LENGTH, UM, 6e-6, seed + 1):
        for _, row, value in compute_parameters(z, names):
            sums.setdefault(row.name, []).append(np.nan if value is None else value)
    truth = {name: np.nanmean(values) for name, values in sums.items()}
    covers: dict = {name: [] for name in truth}
    for z in draw_traces(count, LENGTH, UM, 6e-6, seed):
        intervals_by_record: dict = {}
        for heights, row, value in compute_parameters(z, names):
            if value is None:
                continue
            intervals = intervals_by_record.setdefault(
                id(heights), Intervals(heights, 1 if heights.section is None else None)
            )
            low, high = intervals.confidence_interval(row, value)
            if low is not None:
                covers[row.name].append(low <= truth[row.name] <= high)
    # at most a tenth of the traces has no interval, because they seem not Gaussian
    assert all(len(values) >= 0.9 * count for values in covers.values() if values)
    return {name: float(np.mean(values)) for name, values in covers.items() if values}


@pytest.mark.slow
def test_always_intervals_of_all_parameters_cover_mean():
    """Of 600 traces of 1 mm, 90 % of the intervals of each parameter cover the mean, within 4 to 6 %."""
    found = interval_coverage(600, 70_000)
    assert len(found) == len(PRIMARY) + len(ROUGH) + len(WAVES)
    assert all(0.86 <= fraction <= 0.96 for fraction in found.values()), found
    assert 0.88 <= np.mean(list(found.values())) <= 0.92


def test_always_intervals_by_degrees_of_freedom_cover_mean():
    """Of 100 traces, 90 % of the intervals from degrees of freedom cover the mean, within three standard deviations.

    The reference mean over 500 other traces changes the coverage by 0.1 %.
    """
    names = {"Pq", "Rq", "Pdq", "Rdq", "band_amplitude"}
    found = interval_coverage(100, 4000, names, 500)
    assert set(found) == names and all(0.81 <= fraction <= 0.99 for fraction in found.values()), (
        found
    )


def test_exact_degrees_of_freedom_of_white_noise():
    """White noise of n heights has n degrees of freedom within 5 %, so that Rq scatters by 1/sqrt(2 n)."""
    n = 20_000
    heights = Heights(np.random.default_rng(0).normal(size=n), UM)
    found = Intervals(heights, None)
    assert found.freedom("power") == pytest.approx(n, rel=0.05)
    low, high = found.confidence_interval(TABLE["Rq"], 1.0)
    assert high - low == pytest.approx(2 * 1.645 / np.sqrt(2 * n), rel=0.05)


def test_exact_heavy_tails_reduce_degrees_of_freedom():
    """Laplace heights (kurtosis 6) have 2.5 times fewer degrees of freedom than Gaussian heights, within 10 %."""
    rng = np.random.default_rng(0)
    found = [
        Intervals(Heights(z, UM), None).freedom("power")
        for z in (rng.normal(size=50_000), rng.laplace(size=50_000))
    ]
    assert found[0] / found[1] == pytest.approx(2.5, rel=0.1)


def test_always_longer_trace_has_narrower_interval():
    """Four times the length halves the interval within 20 %, for both kinds of intervals."""
    z = draw_traces(1, 64e-3, UM, 6e-6, 5)[0]
    for name in ("Rq", "Ra", "Rsk"):
        row = TABLE[name]
        widths = []
        for size in (16_000, 64_000):
            heights = Heights(z[:size], UM)
            low, high = Intervals(heights, None).confidence_interval(row, row.compute(heights))
            widths.append(high - low)
        assert widths[0] / widths[1] == pytest.approx(2, rel=0.2), name


def test_exact_interval_of_ratio_stays_within_bounds():
    """The interval of a material ratio stays between 0 and 1."""
    z = draw_traces(1, 0.3e-3, UM, 6e-6, 2)[0]
    heights = Heights(z - z.mean(), UM)
    for name in ("PMr1", "PMr2"):
        low, high = Intervals(heights, 1).confidence_interval(
            TABLE[name], TABLE[name].compute(heights)
        )
        assert 0 <= low <= high <= 1
