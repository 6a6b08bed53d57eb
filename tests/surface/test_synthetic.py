"""Synthetic traces have exactly the requested spectra, rms heights and positions."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import report_area, report_density, self_affine

LENGTH = 12.7e-3
STEP = 3.2e-6


@given(st.integers(0, 10**6), st.floats(0.1, 1.0), st.integers(200, 999))
def test_exact_rms_and_spectrum_of_self_affine_trace(seed, hurst, count):
    """Each realisation of a self-affine trace has the requested rms height and exponent of the spectrum."""
    profile = self_affine(LENGTH, count, 3e-6, hurst, LENGTH / 8, LENGTH / 64, seed)
    z = profile.z[:-1]
    assert profile.z[-1] == z[0] and profile.x[[0, -1]] == pytest.approx(
        [-LENGTH / 2, LENGTH / 2], rel=1e-15
    )
    assert np.sqrt((z**2).mean()) == pytest.approx(3e-6, rel=1e-12) and z.mean() == pytest.approx(
        0, abs=1e-20
    )
    power = np.abs(np.fft.rfft(z) / count) ** 2
    assert power[1:9] == pytest.approx(power[1], rel=1e-9, abs=0)
    assert power[8:65] / power[8] == pytest.approx(
        (np.arange(8, 65) / 8.0) ** (-1 - 2 * hurst), rel=1e-9
    )
    assert power[65:].max() < 1e-20 * power[1]


def test_exact_spectrum_of_report_surface():
    """The spectrum of a surface agrees with the density of the report."""
    x, y, z = report_area((200, 300), STEP, 0)
    assert (x.size, y.size, z.shape) == (300, 200, (200, 300)) and x[1] == y[1] == STEP
    power = np.abs(np.fft.fft2(z)) ** 2
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(200, STEP)[:, None], np.fft.fftfreq(300, STEP))
    assert power / power.sum() == pytest.approx(
        report_density(q) / report_density(q).sum(), rel=1e-9, abs=1e-15
    )
