"""Spectrum of a trace: mean square and amplitude of a band."""

import numpy as np
import pytest
from synthetic import sine

from patchfem.surface import Profile
from patchfem.surface.spectrum import wave_spectrum

UM = 1e-6
X = np.arange(4000) * UM


@pytest.mark.parametrize("wavelength", [70, 90])
@pytest.mark.parametrize("phase", [0, 2])
def test_band_amplitude_of_sine(wavelength, phase):
    """The band amplitude of a sine agrees with its own within 0.5 %."""
    spectrum = wave_spectrum(sine(X, 7e-6, wavelength * UM, phase), is_tapered=True)
    assert spectrum.measure_band() == pytest.approx(7e-6, rel=5e-3)
    assert (
        wave_spectrum(sine(X, 7e-6, 30 * UM, phase), is_tapered=True).measure_band() < 4e-3 * 7e-6
    )


def test_density_of_white_noise():
    """The density of white noise is 2 step times its variance, and its integral the variance."""
    z = np.random.default_rng(6).normal(size=100_003)
    spectrum = wave_spectrum(Profile(np.arange(z.size) * UM, z, "noise"))
    assert spectrum.density.mean() == pytest.approx(2 * UM * z.var(), rel=0.02)
    assert spectrum.power.sum() == pytest.approx(z.var(), rel=1e-3)
