"""The power spectral density: mean squares, band by chi-square, dominant wavelength, height of a band."""

import numpy as np
import pytest
from synthetic import sine

from patchfem.core import PatchfemError
from patchfem.surface import BAND, Profile, level
from patchfem.surface.roughness.spectrum import band_amplitude, estimate_spectrum, refuse_band

UM = 1e-6


def trace_amplitude(trace: Profile, low: float = BAND[0], high: float = BAND[1]) -> float:
    step = trace.length / (trace.x.size - 1)
    refuse_band(trace.source, low, high, trace.length, step)
    return band_amplitude(estimate_spectrum(level(trace).z, step), low, high)


@pytest.mark.parametrize("tapers", [1, 3, 16])
def test_exact_the_tapers_by_their_definition(tapers):
    """One transform gives what each sine taper and its own transform give."""
    z = np.random.default_rng(2).normal(size=300)
    step = 0.5
    z -= z.mean()
    found = estimate_spectrum(z, step, tapers)
    n = 300
    k = np.arange(1, tapers + 1)[:, None]
    window = np.sqrt(2 / (n + 1)) * np.sin(np.pi * k * np.arange(1, n + 1) / (n + 1))
    slow = (2 * step * np.abs(np.fft.rfft(window * z, 2 * (n + 1), axis=1)) ** 2).mean(axis=0)[1:]
    assert found.density == pytest.approx(slow, rel=1e-9, abs=1e-12 * slow.max())
    assert found.frequency == pytest.approx(np.fft.rfftfreq(2 * (n + 1), step)[1:])


@pytest.mark.parametrize("wavelength", [70, 80, 90])
@pytest.mark.parametrize("phase", [0, 1, 2])
def test_exact_the_amplitude_and_wavelength_of_a_sine(wavelength, phase):
    trace = sine(np.arange(4000) * UM, 7e-6, wavelength * UM, phase)
    assert trace_amplitude(trace) == pytest.approx(7e-6, rel=5e-3)
    assert estimate_spectrum(level(trace).z, UM).dominant_wavelength == pytest.approx(
        wavelength * UM, rel=0.01
    )
    # what the tapers leak: 1e-5 of the mean square
    assert trace_amplitude(trace, 10 * UM, 40 * UM) < 4e-3 * 7e-6


def test_always_the_band_holds_the_true_density():
    """95 % of the values over 200 traces of white noise, between 93 and 97."""
    z = np.random.default_rng(8).normal(size=(200, 1024))
    low, high = np.swapaxes([estimate_spectrum(row, UM, 5).band() for row in z], 0, 1)
    inside = ((low <= 2 * UM) & (high >= 2 * UM))[:, 20:-20].mean()
    assert 0.93 < inside < 0.97


def test_exact_a_flat_trace_has_no_dominant_wave():
    assert estimate_spectrum(np.zeros(100), UM).dominant_wavelength is None


@pytest.mark.parametrize(
    "low, high, says",
    [
        (
            110e-6,
            60e-6,
            "a band from 110 um to 60 um; a band must be given from the shorter to the longer wavelength",
        ),
        (1e-6, 60e-6, "can show waves of 2 um to 150 um, but not the whole band 1 um to 60 um"),
        (60e-6, 200e-6, "can show waves of 2 um to 150 um, but not the whole band 60 um to 200 um"),
    ],
)
def test_refuses_a_band_that_the_trace_does_not_show(low, high, says):
    with pytest.raises(PatchfemError, match=says):
        trace_amplitude(sine(np.arange(301) * UM, UM, 80 * UM), low, high)


def test_always_a_long_trace_keeps_its_mean_square():
    """Beyond 65536 samples the end is left out for a fast transform; 100 003 is prime."""
    z = np.random.default_rng(6).normal(size=100_003)
    found = estimate_spectrum(z, UM)
    assert found.density.sum() * found.step == pytest.approx(z.var(), rel=0.02)
    assert found.length == pytest.approx(0.100003, rel=0.01)
