"""Parameters of scans (ISO 25178-2) and the areal filter, compared with closed forms, also with missing heights."""

import numpy as np
import pytest

from patchfem.surface import make_report
from patchfem.surface.areal import Areal
from patchfem.surface.roughness.areal import autocorrelation, compute_areal_parameters
from patchfem.surface.roughness.filter import filter_surface, mean_surface

UM = 1e-6


def make_scan(z, step=UM, y_step=UM) -> Areal:
    """Return a scan of heights with given steps."""
    return Areal(np.arange(z.shape[1]) * step, np.arange(z.shape[0]) * y_step, z, "scan")


def make_plane_wave(m, n, wave, degrees, step=1.0) -> np.ndarray:
    """Return the heights (m, n) of a sine wave in a given direction."""
    y, x = np.meshgrid(np.arange(m) * step, np.arange(n) * step, indexing="ij")
    return np.sin(
        2 * np.pi * (x * np.cos(np.radians(degrees)) + y * np.sin(np.radians(degrees))) / wave + 0.3
    )


def gaussian_surface(m, n, across, along, degrees=0.0, seed=0) -> np.ndarray:
    """Return periodic Gaussian heights (m, n) of standard deviation 1 with two correlation lengths.

    The autocorrelation is exp(-(u/across)^2 - (v/along)^2), with u and v rotated by an angle.
    """
    fy, fx = np.meshgrid(np.fft.fftfreq(m), np.fft.fftfreq(n), indexing="ij")
    c = np.cos(np.radians(degrees))
    s = np.sin(np.radians(degrees))
    u = c * fx + s * fy
    v = -s * fx + c * fy
    power = np.exp(-((np.pi * u * across) ** 2) - (np.pi * v * along) ** 2)
    noise = np.fft.fft2(np.random.default_rng(seed).standard_normal((m, n)))
    z = np.fft.ifft2(np.sqrt(power) * noise).real
    return z / z.std()


def test_exact_gradient_and_area_of_ramp():
    """A ramp of slopes a and b has gradient sqrt(a^2 + b^2) and area ratio sqrt(1 + a^2 + b^2) - 1, also with holes."""
    y, x = np.meshgrid(np.arange(20) * 2.0, np.arange(30) * 3.0, indexing="ij")
    z = 0.4 * x - 0.7 * y
    for holes in (False, True):
        if holes:
            z[np.random.default_rng(1).random(z.shape) < 0.2] = np.nan
        found = compute_areal_parameters(z, (2.0, 3.0))
        assert found["Sdq"] == pytest.approx(np.hypot(0.4, 0.7), rel=1e-12)
        assert found["Sdr"] == pytest.approx(np.sqrt(1 + 0.4**2 + 0.7**2) - 1, rel=1e-12)


def test_parameters_of_sine_surface():
    """The height parameters of whole sine waves agree with the closed forms."""
    report = make_report(make_scan(UM * make_plane_wave(100, 4000, 40.0, 0.0)))
    assert report["Sa"].value == pytest.approx(2 / np.pi * UM, rel=1e-2)
    assert report["Sq"].value == pytest.approx(UM / np.sqrt(2), rel=1e-2)
    assert report["Sku"].value == pytest.approx(1.5, rel=3e-2)
    assert report["Ssk"].value == pytest.approx(0.0, abs=2e-2)
    assert report["Sz"].value == pytest.approx(2 * UM, rel=3e-2)


def test_exact_autocorrelation_is_mean_over_measured_pairs():
    """The autocorrelation of a scan with holes is the mean over all pairs of measured heights."""
    z = np.random.default_rng(3).normal(size=(9, 12))
    z[2, 3] = z[5, 7:9] = np.nan
    found = autocorrelation(z)
    assert found.shape == (9, 13) and found[4, 6] == pytest.approx(1)
    for down, right in ((0, 1), (3, -4), (-4, 6), (2, 5)):
        a = z[max(down, 0) : 9 + min(down, 0), max(right, 0) : 12 + min(right, 0)]
        b = z[max(-down, 0) : 9 + min(-down, 0), max(-right, 0) : 12 + min(-right, 0)]
        assert found[4 + down, 6 + right] == pytest.approx(
            np.nanmean(a * b) / np.nanmean(z * z), rel=1e-9
        )


@pytest.mark.parametrize("degrees", [0.0, 40.0])
def test_length_and_aspect_ratio_of_gaussian_surface(degrees):
    """With autocorrelation exp(-(u/a)^2 - (v/b)^2), Sal = a sqrt(ln 5) within 5 % and Str = a/b within 10 %."""
    z = gaussian_surface(600, 600, 6.0, 18.0, degrees)
    found = compute_areal_parameters(z, (1.0, 1.0))
    assert found["Sal"] == pytest.approx(6 * np.sqrt(np.log(5)), rel=0.05)
    assert found["Str"] == pytest.approx(1 / 3, rel=0.1)
    z[np.random.default_rng(5).random(z.shape) < 0.1] = np.nan
    assert compute_areal_parameters(z, (1.0, 1.0))["Sal"] == pytest.approx(found["Sal"], rel=0.01)


def test_exact_wave_transmission_of_areal_filter():
    """The areal filter transmits 2^-(cutoff/L)^2 of a wave of length L, half of it at the cut-off."""
    for wave, degrees in ((40.0, 0.0), (40.0, 30.0), (25.0, 90.0)):
        waves, rough = filter_surface(make_scan(make_plane_wave(240, 240, wave, degrees)), 40 * UM)
        assert waves.z.shape == (200, 200) and waves.x[0] == 20 * UM
        transmission = 0.5 ** ((40 / wave) ** 2)
        inside = make_plane_wave(240, 240, wave, degrees)[60:-60, 60:-60]
        assert waves.z[40:-40, 40:-40] == pytest.approx(transmission * inside, abs=1e-9)
        assert rough.z[40:-40, 40:-40] == pytest.approx((1 - transmission) * inside, abs=1e-9)


def test_exact_filter_ignores_holes():
    """At holes the weights of the filter are normalised over the measured heights.

    Holes remain holes.
    """
    z = np.random.default_rng(6).normal(size=(70, 70))
    z[20:26, 30:50] = np.nan
    found = mean_surface(z, (15.0, 15.0))
    assert np.array_equal(np.isnan(found), np.isnan(z))
    y, x = np.mgrid[:70, :70]
    for i, j in ((19, 40), (2, 2), (27, 29)):
        distance = np.hypot(y - i, x - j) / 15
        weight = np.where(np.isnan(z), 0, np.exp(-((np.pi * distance) ** 2) / np.log(2)))
        assert found[i, j] == pytest.approx(
            (weight * np.nan_to_num(z)).sum() / weight.sum(), abs=1e-9
        )
