"""Spectrum of a trace: mean square, dominant wavelength and amplitude of a band."""

import numpy as np
import pytest
from synthetic import sine, waves

from patchfem.surface import Profile
from patchfem.surface.spectrum import wave_spectrum

UM = 1e-6
X = np.arange(4000) * UM


@pytest.mark.parametrize("wavelength", [70, 90])
@pytest.mark.parametrize("phase", [0, 2])
def test_exact_amplitude_and_wavelength_of_sine(wavelength, phase):
    """The band amplitude and the dominant wavelength of a sine agree with its own within 0.5 % and 1 %."""
    spectrum = wave_spectrum(sine(X, 7e-6, wavelength * UM, phase), is_tapered=True)
    assert spectrum.measure_band() == pytest.approx(7e-6, rel=5e-3)
    assert spectrum.find_dominant_wave() == pytest.approx(wavelength * UM, rel=0.01)
    assert (
        wave_spectrum(sine(X, 7e-6, 30 * UM, phase), is_tapered=True).measure_band() < 4e-3 * 7e-6
    )


def test_exact_dominant_octave_has_the_largest_mean_square():
    """Of waves of 1 mm, 52 and 48 um, the octave of the last two dominates if both together have more power."""
    for height, dominant in ((1.3, 50), (1.6, 1000)):
        trace = waves(X, [height * UM, UM, UM], [1000 * UM, 52 * UM, 48 * UM])
        assert wave_spectrum(trace, is_tapered=True).find_dominant_wave() == pytest.approx(
            dominant * UM, rel=0.03
        )
    assert wave_spectrum(Profile(X, 0 * X, "flat")).find_dominant_wave() is None


def test_exact_density_of_white_noise():
    """The density of white noise is 2 step times its variance, and its integral the variance."""
    z = np.random.default_rng(6).normal(size=100_003)
    spectrum = wave_spectrum(Profile(np.arange(z.size) * UM, z, "noise"))
    assert spectrum.density.mean() == pytest.approx(2 * UM * z.var(), rel=0.02)
    assert spectrum.power.sum() == pytest.approx(z.var(), rel=1e-3)
