"""Made traces have exactly the spectra, the rms and the places that were asked for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import erf

from patchfem.core import PatchfemError
from patchfem.surface.synthetic import peaks, self_affine, sine, waves

LENGTH = 12.7e-3


@given(st.integers(0, 10**6), st.floats(0.1, 1.0), st.integers(200, 999))
def test_exact_rms_and_spectrum_of_every_realisation(seed, hurst, count):
    profile = self_affine(LENGTH, count, 3e-6, hurst, LENGTH / 8, LENGTH / 64, seed)
    z = profile.z[:-1]
    assert profile.z[-1] == z[0] and profile.x[[0, -1]] == pytest.approx([-LENGTH / 2, LENGTH / 2], rel=1e-15)
    assert np.sqrt((z**2).mean()) == pytest.approx(3e-6, rel=1e-12) and z.mean() == pytest.approx(0, abs=1e-20)
    power = np.abs(np.fft.rfft(z) / count) ** 2
    assert power[1:9] == pytest.approx(power[1], rel=1e-9)
    assert power[8:65] / power[8] == pytest.approx((np.arange(8, 65) / 8.0) ** (-1 - 2 * hurst), rel=1e-9)
    assert power[65:].max() < 1e-20 * power[1]


def test_always_the_seed_decides():
    one, same, other = (self_affine(LENGTH, 500, 1e-6, 0.8, 2e-3, 1e-4, seed) for seed in (7, 7, 8))
    assert one.z.tobytes() == same.z.tobytes()
    assert np.abs(np.corrcoef(one.z, other.z)[0, 1]) < 0.9


def test_exact_many_phases_give_normal_heights():
    z = np.concatenate([self_affine(LENGTH, 4000, 1.0, 0.8, 0.2e-3, 20e-6, seed).z[:-1] for seed in range(20)])
    assert (z**3).mean() == pytest.approx(0, abs=0.1) and (z**4).mean() == pytest.approx(3, abs=0.2)


@given(st.floats(1e-6, 1e-2), st.floats(0, 6), st.floats(-5e-6, 5e-6))
def test_exact_waves_add_up(wave, phase, height):
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 301)
    both = waves(x, [height, 1e-6], [wave, LENGTH], [phase, 0.2])
    assert both.z == pytest.approx(sine(x, height, wave, phase).z + sine(x, 1e-6, LENGTH, 0.2).z, abs=1e-20)
    assert sine(x, height, wave, phase).z == pytest.approx(height * np.sin(2 * np.pi * x / wave + phase), abs=1e-20)


def test_exact_area_of_peaks():
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 20001)
    at, heights, widths = [-3e-3, 0.0, LENGTH / 2], [-4e-6, 2e-6, 1e-6], [20e-6, 300e-6, 100e-6]
    area = np.sqrt(np.pi / 2) * sum(
        h * w * (erf((LENGTH / 2 - a) / w / np.sqrt(2)) - erf((-LENGTH / 2 - a) / w / np.sqrt(2)))
        for a, h, w in zip(at, heights, widths))
    profile = peaks(x, at, heights, widths)
    assert np.trapezoid(profile.z, x) == pytest.approx(area, rel=1e-6)
    assert profile.z.min() == pytest.approx(-4e-6, rel=1e-4)


@pytest.mark.parametrize("make, message", [
    (lambda x: waves(x, [1], [1, 2]), "waves: 1 amplitudes, 2 wavelengths, 1 phases"),
    (lambda x: waves(x, [1], [0]), "waves: wavelengths are above zero"),
    (lambda x: waves(x, [np.nan], [1]), "amplitudes of a made trace are a list of finite numbers"),
    (lambda x: sine(x[::-1], 1, 1), "the places of a made trace are two or more and grow"),
    (lambda x: peaks(x, [1], [1, 2], [1]), "peaks: 1 places, 2 heights, 1 widths"),
    (lambda x: peaks(x, [1], [1], [0]), "peaks: widths are above zero"),
    (lambda x: self_affine(0, 100, 1, 0.8, 1, 1, 0), "self_affine: a length above zero"),
    (lambda x: self_affine(1, 100, 1, 1.2, 0.5, 0.1, 0), "the Hurst exponent is 1.2; it lies above 0 and at 1 at most"),
    (lambda x: self_affine(1, 100, 1, 0.8, 0.5, 0.01, 0), "two steps < shortest <= longest <= length is wanted, not"),
])  # fmt: skip
def test_refuses_what_cannot_be_made(make, message):
    with pytest.raises(PatchfemError) as caught:
        make(np.linspace(0, 1, 11))
    assert message in str(caught.value)
