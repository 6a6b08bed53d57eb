"""Peaks of a surface from mean squares of its traces, in a scene, and in the table that `profile` prints."""

import numpy as np
import pytest
from scene_texts import PIECE
from scipy.integrate import quad
from scipy.ndimage import gaussian_filter1d

import patchfem as pf
from patchfem import build
from patchfem.core import PatchfemError
from patchfem.scene import loads
from patchfem.surface import (
    Moments,
    Profile,
    gaussian_peaks,
    read_profile,
    trace_moments,
)
from patchfem.surface.roughness.peaks import rms_moments

PATCH = (
    PIECE + 'load = "26 lbf"\nelement_size = "1 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
    '[contact.asperities]\nlaw = "hertz"\n'
)
RMS = 'rms_height = "0.5 um"\nrms_slope = 0.05\nrms_curvature = "0.02 1/um"\n'


def make_trace(z, step) -> Profile:
    """Return a trace of heights with a given step."""
    return Profile(np.arange(z.size) * step, z, "made")


def gaussian_surface(n: int, step: float, waves: tuple, seed: int = 0) -> np.ndarray:
    """Return heights (n, n) of a periodic isotropic Gaussian surface of waves between two lengths [m].

    Its spectral density is proportional to k^-3.
    """
    k = np.hypot(*np.meshgrid(*2 * [2 * np.pi * np.fft.fftfreq(n, step)]))
    inside = (k >= 2 * np.pi / waves[1]) & (k <= 2 * np.pi / waves[0])
    amplitude = np.where(inside, np.maximum(k, 1.0) ** -1.5, 0.0)
    noise = np.random.default_rng(seed).normal(size=(n, n))
    return np.fft.ifft2(amplitude * np.fft.fft2(noise)).real


def summit_statistics(alpha: float) -> tuple:
    """Return density, mean curvature, and variance over m_0 of summits for m_0 = alpha and m_2 = m_4 = 1.

    They follow by quadrature of the Gaussian law of curvatures. Here t = -(z_xx + z_yy) has the
    variance 8/3, half the difference and the twist have 1/3 each, and the product of both
    curvatures is t^2/4 - r^2.
    """

    def summit_weight(t):
        """Return the weight of the curvature sum t."""
        return (t**2 / 4 - 2 / 3 * (1 - np.exp(-3 * t**2 / 8))) * np.exp(-3 * t**2 / 16)

    integral, first_moment, second_moment = (
        quad(lambda t, n=n: t**n * summit_weight(t), 0, 40, epsabs=0, epsrel=1e-12)[0]
        for n in range(3)
    )
    mean = first_moment / integral
    square = second_moment / integral
    # for given t a height is Gaussian with mean 3 t/4 and variance alpha - 3/2
    return (
        integral / np.sqrt(2 * np.pi * 8 / 3) / (2 * np.pi),
        mean / 2,
        1 - 1.5 / alpha + 9 / 16 * (square - mean**2) / alpha,
    )


@pytest.mark.parametrize("alpha", [1.6, 4.0, 50.0])
def test_exact_peaks_agree_with_quadrature(alpha):
    """Density and radius of peaks agree within 1e-10 with a quadrature of the law of curvatures."""
    peaks_found, (density, curvature, variance) = (
        gaussian_peaks(Moments(np.sqrt(alpha), 1.0, 1.0)),
        summit_statistics(alpha),
    )
    assert peaks_found.density == pytest.approx(density, rel=1e-10)
    assert 1 / peaks_found.radius == pytest.approx(curvature, rel=1e-10)
    # the coefficients of the source have four digits
    assert peaks_found.deviation**2 / alpha == pytest.approx(variance, abs=1e-4 / alpha)


def test_spikes_are_left_out_of_the_moments():
    """Two spikes of 20 um change the moments of a trace of 0.1 um by at most 2 %, and are told."""
    z = 1e-6 * gaussian_surface(256, 1e-6, (8e-6, 1e-4))[0]
    z *= 1e-7 / z.std()
    clean = trace_moments(make_trace(z, 1e-6))
    z[[60, 150]] += 2e-5
    found = trace_moments(make_trace(z, 1e-6))
    assert found.fine == pytest.approx(clean.fine, rel=0.02)
    assert clean.dust == () and "are spikes, dropouts or dust and are left out" in found.dust[0]


def test_refuses_moments_of_no_gaussian_surface():
    """Traces of a single wave, of alternating heights, without roughness or with few samples are refused."""
    x = np.arange(256) * 1e-6
    with pytest.raises(PatchfemError, match=r"at least 1\.22"):
        # a single wave has alpha = 1
        gaussian_peaks(trace_moments(make_trace(np.sin(2 * np.pi * x / 2e-5), 1e-6)).fine)
    with pytest.raises(PatchfemError, match=r"at least 1\.22"):
        # every height differs from its neighbours
        gaussian_peaks(trace_moments(make_trace(1e-6 * (np.arange(64) % 2), 1e-6)).fine)
    with pytest.raises(PatchfemError, match="is flat"):
        trace_moments(make_trace(0.1 * x, 1e-6))
    with pytest.raises(PatchfemError, match="at least 16"):
        rms_moments(make_trace(np.sin(x[:10] * 1e6), 1e-6))


def write_trace(folder, seed=1) -> str:
    """Write a Gaussian trace and return its file name."""
    z = 1e-7 * (row := gaussian_surface(256, 1e-6, (8e-6, 1e-4), seed)[0]) / row.std()
    (folder / f"trace{seed}.csv").write_text(
        "x [um],z [um]\n"
        + "".join(f"{k},{height * 1e6!r}\n" for k, height in enumerate(z.tolist()))
    )
    return str(folder / f"trace{seed}.csv")


def test_exact_three_ways_to_define_peaks_agree(tmp_path, monkeypatch):
    """A trace file, its rms values, and its peaks give the same contact stiffness."""
    monkeypatch.chdir(tmp_path)
    rms = trace_moments(read_profile(write_trace(tmp_path))).fine
    peaks = gaussian_peaks(rms)
    pasted = (
        PATCH + f'rms_height = "{rms.height!r} m"\nrms_slope = {rms.slope!r}\n'
        f'rms_curvature = "{rms.curvature!r} 1/m"\n'
    )
    ways = [
        PATCH + 'from = "trace1.csv"\n',
        pasted,
        PATCH + f'radius = "{peaks.radius!r} m"\ndensity = '
        f'"{peaks.density!r} 1/m^2"\nheight_deviation = "{peaks.deviation!r} m"\n',
    ]
    (tmp_path / "scene.toml").write_text(ways[0])
    runs = [pf.run("scene.toml"), *(pf.run(text) for text in ways[1:])]
    stiffnesses = [run.measures["normal_stiffness"].value for run in runs]
    assert stiffnesses[1] == pytest.approx(stiffnesses[0], rel=1e-4) and stiffnesses[
        2
    ] == pytest.approx(stiffnesses[1], rel=1e-12)
    notes = [" ".join(note for note in run.notes if "Persson" in note) for run in runs]
    assert notes[0] and notes[1]
    assert not notes[2]
    runs[0].save(tmp_path / "out/first")
    second_run = pf.run(tmp_path / "out/first/scene.resolved.toml")
    assert second_run.measures["normal_stiffness"].value == pytest.approx(stiffnesses[0], rel=1e-12)


@pytest.mark.parametrize(
    "keys, message",
    [
        ("", "needs this key or from or rms_height, rms_slope, rms_curvature"),
        ('radius = "1 um"\n', "contact.asperities.density: missing"),
        ('rms_height = "1 um"\nrms_slope = 0.1\n', "contact.asperities.rms_curvature: missing"),
        (RMS + 'radius = "1 um"\n', "exclude each other"),
        (RMS.replace("0.05", "0.5"), "at least 1.22"),
        (RMS.replace("0.02 1/um", "0.02"), "1/um"),
        ('from = "nowhere.csv"\n', "there is no file"),
    ],
)
def test_refuses_incomplete_peak_definition(keys, message, tmp_path):
    """An incomplete, contradictory or invalid definition of peaks is refused with its key."""
    (tmp_path / "scene.toml").write_text(PATCH + keys)
    with pytest.raises(PatchfemError) as caught:
        pf.plan(tmp_path / "scene.toml")
    assert message in str(caught.value) and "asperities" in str(caught.value)


@pytest.mark.parametrize("height, is_named", [(0.0, False), (2e-6, True)])
def test_exact_wide_dust_is_named(height, is_named):
    """Dust that is too wide for a spike doubles the curvature, and a note gives its place."""
    z = gaussian_filter1d(np.random.default_rng(1).normal(size=4000), 8.0)
    z *= 0.4e-6 / z.std()
    clean = trace_moments(make_trace(z, 1e-6)).fine.curvature
    z[2000:2020] += height * np.sqrt(np.sin(np.pi * (np.arange(20) + 0.5) / 20))
    moments = trace_moments(make_trace(z, 1e-6))
    assert len(moments.dust) == is_named
    if is_named:
        assert moments.fine.curvature > 2 * clean
        assert "19 of 4000 heights, the sharpest at x = 1.999 mm, " in moments.dust[0]


CUTOFF = 0.4e-3


def waviness_fraction(wave) -> float:
    """Return the fraction of a wave [m] that the filter of ISO 16610-21 leaves in the waviness, half at the cut-off."""
    return 0.5 ** (CUTOFF / wave) ** 2


def split_trace(folder, waves) -> tuple:
    """Return nodes [m], gap [m], skin and scene of a patch that uses one trace for its profile and its asperities.

    The trace is a sum of cosines [(amplitude, wavelength) in m], split at CUTOFF.
    """
    x = np.linspace(-6.35e-3, 6.35e-3, 25401)
    z = sum(a * np.cos(2 * np.pi * x / wave + k) for k, (a, wave) in enumerate(waves))
    (folder / "trace.csv").write_text(
        "x [m],z [m]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(x.tolist(), z.tolist()))
    )
    text = (
        PATCH.replace('element_size = "1 mm"\n', 'element_size = "25.4 um"\n')
        + 'from = "trace.csv"\ncutoff = "0.4 mm"\n[contact.profile]\nfile = "trace.csv"\n'
    )
    patch = build(loads(text, folder / "scene.toml")).patch
    nodes = np.linspace(-6.35e-3, 6.35e-3, 501)
    return nodes, patch.gap.evaluate(nodes).heights, patch.interface.skin, text


def test_cutoff_splits_trace_between_gap_and_asperities(tmp_path):
    """Each wave of a trace counts once: the gap has the waviness, and the asperities have the roughness."""
    waves = [
        (1e-6, 2.54e-3),
        (0.3e-6, 0.508e-3),
        (0.2e-6, 12.7e-3 / 40),
        (0.1e-6, 63.5e-6),
        (2e-8, 25.4e-6),
    ]
    x, gap, skin, _ = split_trace(tmp_path, waves)
    is_inner = np.abs(x) < 4e-3  # near the ends the mean line deviates
    columns = [part(2 * np.pi * x / wave) for _, wave in waves[:4] for part in (np.cos, np.sin)]
    fit = np.linalg.lstsq(
        np.stack([*columns, np.ones(x.size), x], 1)[is_inner], gap[is_inner], rcond=None
    )[0]
    for (amplitude, wave), fitted in zip(waves, np.hypot(fit[0:8:2], fit[1:8:2])):
        averaging = np.sinc(
            25.4e-6 / wave
        )  # reduction by the mean over the tributary length of a node
        assert fitted == pytest.approx(
            amplitude * waviness_fraction(wave) * averaging, abs=3e-4 * amplitude
        ), wave
    roughness_waves = [
        (amplitude * (1 - waviness_fraction(wave)), 2 * np.pi / wave) for amplitude, wave in waves
    ]
    for name, order in (("height", 0), ("slope", 1), ("curvature", 2)):
        truth = np.sqrt(sum((a * k**order) ** 2 / 2 for a, k in roughness_waves))
        assert getattr(skin, f"rms_{name}") == pytest.approx(truth, rel=5e-3), name
    moments_of_all = trace_moments(
        Profile(
            np.arange(25401) * 0.5e-6,
            sum(a * np.cos(2 * np.pi * np.arange(25401) * 0.5e-6 / wave) for a, wave in waves),
            "whole",
        )
    ).fine
    # without the cut-off the long waves would count twice
    assert moments_of_all.height > 4 * skin.rms_height


@pytest.mark.parametrize("unit", [1.0, 0.25, 2.0**10])
def test_always_note_on_skewness_has_no_unit(unit):
    """Tops that were cut off are noted as such in any unit of length, and the mirrored surface has single high peaks."""
    heights = gaussian_filter1d(np.random.default_rng(20300113).normal(size=20_000), 4.0)
    worn = np.minimum(heights, 0.0) * unit
    note, scaled, mirrored = (
        trace_moments(make_trace(z, step)).not_gaussian
        for z, step in ((worn / unit, 1.0), (worn, unit), (-worn, unit))
    )
    assert "tops that were cut off by wear" in note and "skewness -" in note
    assert scaled == note
    assert "single high peaks" in mirrored
