"""Made traces have exactly the spectra, the rms and the places that were asked for."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from synthetic import (
    SIGMA,
    report_area,
    report_density,
    report_sigma,
    report_trace,
    self_affine,
    sine,
    waves,
)

LENGTH = 12.7e-3
STEP, POINTS = 3.2e-6, 320  # a raster of 1.02 mm


@given(st.integers(0, 10**6), st.floats(0.1, 1.0), st.integers(200, 999))
def test_exact_rms_and_spectrum_of_every_realisation(seed, hurst, count):
    profile = self_affine(LENGTH, count, 3e-6, hurst, LENGTH / 8, LENGTH / 64, seed)
    z = profile.z[:-1]
    assert profile.z[-1] == z[0] and profile.x[[0, -1]] == pytest.approx(
        [-LENGTH / 2, LENGTH / 2], rel=1e-15
    )
    assert np.sqrt((z**2).mean()) == pytest.approx(3e-6, rel=1e-12) and z.mean() == pytest.approx(
        0, abs=1e-20
    )
    power = np.abs(np.fft.rfft(z) / count) ** 2
    assert power[1:9] == pytest.approx(power[1], rel=1e-9)
    assert power[8:65] / power[8] == pytest.approx(
        (np.arange(8, 65) / 8.0) ** (-1 - 2 * hurst), rel=1e-9
    )
    assert power[65:].max() < 1e-20 * power[1]


@given(st.floats(1e-6, 1e-2), st.floats(0, 6), st.floats(-5e-6, 5e-6))
def test_exact_waves_add_up(wave, phase, height):
    x = np.linspace(-LENGTH / 2, LENGTH / 2, 301)
    both = waves(x, [height, 1e-6], [wave, LENGTH], [phase, 0.2])
    assert both.z == pytest.approx(
        sine(x, height, wave, phase).z + sine(x, 1e-6, LENGTH, 0.2).z, abs=1e-20
    )
    assert sine(x, height, wave, phase).z == pytest.approx(
        height * np.sin(2 * np.pi * x / wave + phase), abs=1e-20
    )


def areas(count):
    return [report_area((POINTS, POINTS), STEP, seed)[2] for seed in range(count)]


def test_exact_sigma_and_mean_of_the_report_surface():
    for z, sigma in (
        (report_area((100, 256), 4e-6, 3, 2e-6)[2], 2e-6),
        (areas(1)[0], SIGMA),
        (report_trace(1e-3, 1001, 5).z[:-1], SIGMA),
    ):
        assert np.sqrt((z**2).mean()) == pytest.approx(sigma, rel=1e-12, abs=0)
        assert z.mean() == pytest.approx(0, abs=1e-12 * sigma)


def test_exact_spectrum_of_the_report_surface():
    x, y, z = report_area((200, 300), STEP, 0)
    assert (x.size, y.size, z.shape) == (300, 200, (200, 300)) and x[1] == y[1] == STEP
    power = np.abs(np.fft.fft2(z)) ** 2
    q = 2 * np.pi * np.hypot(np.fft.fftfreq(200, STEP)[:, None], np.fft.fftfreq(300, STEP))
    assert power / power.sum() == pytest.approx(
        report_density(q) / report_density(q).sum(), rel=1e-9, abs=1e-15
    )
    trace = report_trace(2e-3, 700, 1).z[:-1]
    cut = np.abs(np.fft.rfft(trace)) ** 2
    many = report_area((700, 700), 2e-3 / 700, 1)[2]
    rows = (np.abs(np.fft.rfft(many, axis=1)) ** 2).mean(axis=0)
    assert cut[1:] / cut[1:].sum() == pytest.approx(rows[1:] / rows[1:].sum(), rel=2e-3, abs=1e-5)
    # where an octave holds most
    assert 2e-3 / (np.arange(351) * cut).argmax() == pytest.approx(85e-6, abs=2e-6)


def test_always_80_um_dominate():
    """The strongest ring of the measured spectrum, rings being 6 % wide."""
    k = np.hypot(np.fft.fftfreq(POINTS, STEP)[:, None], np.fft.fftfreq(POINTS, STEP))
    edges = np.geomspace(1 / 200e-6, 1 / 30e-6, 33)
    ring = np.digitize(k, edges).ravel()
    found = []
    for z in areas(20):
        power = np.bincount(ring, (np.abs(np.fft.fft2(z)) ** 2).ravel()) / np.bincount(ring)
        best = 1 + power[1:-1].argmax()
        found.append(1 / k.ravel()[ring == best].mean())
    assert np.abs(np.array(found) - 80e-6).max() < 4e-6


def test_exact_the_factors_of_the_amplitude_kinds():
    """Heights from a peak to the next valley of traces less their waves below 40 um: 2.5 sigma at the quartile."""
    f = np.fft.rfftfreq(POINTS, STEP)
    swings = []
    for row in np.concatenate([z[::8] for z in areas(10)]):
        z = np.fft.irfft(np.where(f <= 1 / 40e-6, np.fft.rfft(row), 0), POINTS)
        up = np.diff(z) > 0
        swings.append(np.abs(np.diff(z[1:-1][up[1:] != up[:-1]])))
    assert np.quantile(np.concatenate(swings), 0.75) / SIGMA == pytest.approx(2.5, abs=0.05)
    for kind, share in (("peak-to-valley", 2.5), ("zero-to-peak", 1.25), ("rms", 1)):
        assert report_sigma(15e-6, kind) == pytest.approx(15e-6 / share, rel=1e-15)
