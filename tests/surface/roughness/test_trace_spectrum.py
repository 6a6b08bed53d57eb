"""Power spectral density: mean squares, chi-square band, dominant wavelength and amplitude of a band."""

import numpy as np
import pytest
from synthetic import sine

from patchfem.surface import BAND, Profile, level
from patchfem.surface.roughness.spectrum import estimate_spectrum

UM = 1e-6


def band_amplitude_of_trace(trace: Profile, low: float = BAND[0], high: float = BAND[1]) -> float:
    """Return the amplitude of a band of wavelengths of a levelled trace."""
    step = trace.length / (trace.x.size - 1)
    return estimate_spectrum(level(trace).z, step).band_amplitude(low, high)


@pytest.mark.parametrize("tapers", [1, 3, 16])
def test_exact_sine_tapers_agree_with_definition(tapers):
    """The spectrum from one transform equals the mean over the sine tapers, each with its own transform."""
    z = np.random.default_rng(2).normal(size=300)
    step = 0.5
    z -= z.mean()
    found = estimate_spectrum(z, step, tapers)
    n = 300
    k = np.arange(1, tapers + 1)[:, None]
    window = np.sqrt(2 / (n + 1)) * np.sin(np.pi * k * np.arange(1, n + 1) / (n + 1))
    expected = (2 * step * np.abs(np.fft.rfft(window * z, 2 * (n + 1), axis=1)) ** 2).mean(axis=0)[
        1:
    ]
    assert found.density == pytest.approx(expected, rel=1e-9, abs=1e-12 * expected.max())
    assert found.frequency == pytest.approx(np.fft.rfftfreq(2 * (n + 1), step)[1:])


@pytest.mark.parametrize("wavelength", [70, 90])
@pytest.mark.parametrize("phase", [0, 2])
def test_exact_amplitude_and_wavelength_of_sine(wavelength, phase):
    """The band amplitude and the dominant wavelength of a sine agree with its own within 0.5 % and 1 %."""
    trace = sine(np.arange(4000) * UM, 7e-6, wavelength * UM, phase)
    assert band_amplitude_of_trace(trace) == pytest.approx(7e-6, rel=5e-3)
    assert estimate_spectrum(level(trace).z, UM).dominant_wavelength == pytest.approx(
        wavelength * UM, rel=0.01
    )
    # the tapers leak 1e-5 of the mean square
    assert band_amplitude_of_trace(trace, 10 * UM, 40 * UM) < 4e-3 * 7e-6


def test_always_long_trace_keeps_mean_square():
    """The spectrum of a trace of 100 003 samples, a prime number, keeps its mean square within 2 %."""
    z = np.random.default_rng(6).normal(size=100_003)
    found = estimate_spectrum(z, UM)
    assert found.density.sum() * found.frequency[0] == pytest.approx(z.var(), rel=0.02)
    assert found.length == pytest.approx(0.100003)
