"""Gaussian profile filter: transmission of sines, ends of the trace, uneven and missing samples, refusals."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import sine

from patchfem.core import PatchfemError
from patchfem.surface import Profile, mean_line, resample_evenly
from patchfem.surface.roughness.filter import filter_surface, mean_surface

UM = 1e-6
ALPHA = np.sqrt(np.log(2) / np.pi)  # ISO 16610-21


@given(st.floats(20.0, 900.0), st.integers(0, 2**32 - 1))
def test_exact_mean_line_agrees_with_definition(cutoff, seed):
    """The mean line is the weighted mean of the definition, with weights normalised within the trace."""
    z = np.random.default_rng(seed).normal(size=500)
    line = mean_surface(z, (cutoff,))
    x = np.arange(500)
    for k in (0, 1, 37, 250, 498, 499):
        weight = np.exp(-np.pi * ((x - k) / (ALPHA * cutoff)) ** 2)
        assert line[k] == pytest.approx(weight @ z / weight.sum(), abs=1e-8)


def test_exact_tilted_mean_line_is_weighted_fit():
    """The mean line that follows slopes is a weighted least-squares line at each sample."""
    z = np.random.default_rng(3).normal(size=400)
    x = np.arange(400)
    cutoff = 90.0
    line = mean_line(z, cutoff)
    for k in (0, 5, 60, 200, 399):
        weight = np.exp(-np.pi * ((x - k) / (ALPHA * cutoff)) ** 2)
        _, offset = np.polyfit(x - k, z, 1, w=np.sqrt(weight))
        assert line[k] == pytest.approx(offset, abs=1e-7)


def test_exact_half_cutoff_is_trimmed_at_ends():
    """Half a cut-off is trimmed at each end of waviness and roughness."""
    trace = sine(np.arange(10_001) * UM, 1e-6, 80 * UM)
    waviness, rough = filter_surface(trace, 800 * UM)
    assert rough.x[0] == pytest.approx(400 * UM) and rough.x[-1] == pytest.approx(9600 * UM)
    assert np.array_equal(waviness.x, rough.x)


def test_exact_uneven_trace_is_resampled_with_notes():
    """A straight flank with uneven and missing samples is resampled exactly, with a note on each."""
    x = np.array([0.0, 1, 2, 4, 5, 7, 8, 9, 10, 12]) * UM
    z = 0.1 * x
    z[4] = np.nan
    found = resample_evenly(Profile(x, z, "flank.csv"))
    assert np.ptp(np.diff(found.x)) < 1e-12 and found.x[[0, -1]] == pytest.approx([0, 12 * UM])
    assert found.z == pytest.approx(0.1 * found.x, abs=1e-18)
    assert found.notes == (
        "flank.csv: 1 of 10 heights are missing; the gaps are bridged by straight lines, of which "
        "the longest spans 3 "
        "um",
        "flank.csv: samples lie 1 um to 2 um apart; the trace is resampled at every 1 um by "
        "linear interpolation",
    )


@pytest.mark.parametrize(
    "cutoff, message",
    [
        (3 * UM, "1 sines: a cut-off of 3 um is shorter than 4 steps of 1 um"),
        (
            1000 * UM,
            "1 sines: half a cut-off of 1 mm is trimmed at each end, so that it must be shorter than the length along x, "
            "999 um",
        ),
        (np.nan, "a cut-off of"),
    ],
)
def test_refuses_cutoff_that_does_not_fit_trace(cutoff, message):
    """A cut-off that is too short for the step, too long for the trace, or nan is refused."""
    with pytest.raises(PatchfemError, match=message.replace("(", r"\(")):
        filter_surface(sine(np.arange(1000) * UM, UM, 80 * UM, 0.3), cutoff)
