"""Peaks of a surface from the mean squares of its traces, as a scene, and as the table that `profile` prints."""

import re
import tomllib

import numpy as np
import pytest
from command_line import cli
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
    level,
    persson_stiffness,
    trace_moments,
)
from patchfem.surface.roughness.peaks import rms_moments

PATCH = (
    PIECE + 'load = "26 lbf"\nelement_size = "1 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
    '[contact.asperities]\nlaw = "hertz"\n'
)
RMS = 'rms_height = "0.5 um"\nrms_slope = 0.05\nrms_curvature = "0.02 1/um"\n'


def trace_of(z, step) -> Profile:
    return Profile(np.arange(z.size) * step, z, "made")


def gaussian(n: int, step: float, waves: tuple, seed: int = 0) -> np.ndarray:
    """Heights (n, n) of a periodic Gaussian surface alike in all directions, of waves between two lengths [m] with a
    spectral density that falls as k^-3."""
    k = np.hypot(*np.meshgrid(*2 * [2 * np.pi * np.fft.fftfreq(n, step)]))
    inside = (k >= 2 * np.pi / waves[1]) & (k <= 2 * np.pi / waves[0])
    size = np.where(inside, np.maximum(k, 1.0) ** -1.5, 0.0)
    noise = np.random.default_rng(seed).normal(size=(n, n))
    return np.fft.ifft2(size * np.fft.fft2(noise)).real


def summits(alpha: float) -> tuple:
    """(density, mean curvature, variance over m_0) of summits of m_0 = alpha, m_2 = m_4 = 1 by quadrature of the
    Gaussian law of curvatures: t = -(z_xx + z_yy) of variance 8/3, the half difference and the twist of variance
    1/3 each, so that the product of both curvatures is t^2/4 - r^2."""

    def weight(t):
        return (t**2 / 4 - 2 / 3 * (1 - np.exp(-3 * t**2 / 8))) * np.exp(-3 * t**2 / 16)

    whole, first, second = (
        quad(lambda t, n=n: t**n * weight(t), 0, 40, epsabs=0, epsrel=1e-12)[0] for n in range(3)
    )
    mean = first / whole
    square = second / whole
    # given t a height is Gaussian, of mean 3 t/4 and variance alpha - 3/2
    return (
        whole / np.sqrt(2 * np.pi * 8 / 3) / (2 * np.pi),
        mean / 2,
        1 - 1.5 / alpha + 9 / 16 * (square - mean**2) / alpha,
    )


@pytest.mark.parametrize("alpha", [1.6, 4.0, 50.0])
def test_exact_peaks_by_quadrature_of_the_law_of_curvatures(alpha):
    one, (density, curvature, variance) = (
        gaussian_peaks(Moments(np.sqrt(alpha), 1.0, 1.0)),
        summits(alpha),
    )
    assert one.density == pytest.approx(density, rel=1e-10)
    assert 1 / one.radius == pytest.approx(curvature, rel=1e-10)
    # of the four digits of the source
    assert one.deviation**2 / alpha == pytest.approx(variance, abs=1e-4 / alpha)


def test_exact_units_scale():
    """Heights in other units, lengths along in others: radius, density and deviation follow."""
    one = gaussian_peaks(Moments(2.0, 0.3, 0.2))
    other = gaussian_peaks(Moments(2.0 * 3, 0.3 * 3 / 7, 0.2 * 3 / 49))
    assert other == pytest.approx(
        (one.radius * 49 / 3, one.density / 49, one.deviation * 3), rel=1e-12
    )


def test_exact_moments_of_known_sines():
    """Whole waves of two lengths: mean squares in closed form, a difference sees a wave k as sin(k h/2)/(k h/2)."""
    n = 4096
    step = 0.5e-6
    x = step * np.arange(n + 1)
    waves = [(64, 0.3e-6, 0.4), (410, 0.05e-6, 1.1)]
    z = sum(a * np.cos(2 * np.pi * k * x / (n * step) + p) for k, a, p in waves)
    for every in (1, 2):
        found = rms_moments(level(trace_of(z, step)), every)
        h = every * step
        k = np.array([2 * np.pi * k / (n * step) for k, _, _ in waves])
        a = np.array([a for _, a, _ in waves])
        for order, value in enumerate(found):
            # both ends of the trace count, and levelling takes a share of the longest wave
            assert value == pytest.approx(
                np.sqrt(np.sum((a * (2 * np.sin(k * h / 2) / h) ** order) ** 2) / 2), rel=2e-3
            )


def test_exact_what_dust_is_left_out_of_a_table_and_what_dust_is_in_it_is_said():
    """Five grains of eight samples are left out, a sixth lower one is taken for the surface and makes its curvature."""
    step = 0.5e-6
    z = gaussian_filter1d(np.random.default_rng(7).standard_normal(12001), 16)
    z *= 0.4e-6 / z.std()
    grains = np.zeros(z.size)
    for k in range(6):
        grains[1500 * (k + 1) : 1500 * (k + 1) + 8] = 6e-6 if k else 2.6e-6
    clean = trace_moments(trace_of(z, step))
    dusty = trace_moments(trace_of(z + grains, step))
    assert clean.dust == () and "are left out" in dusty.dust[0]
    said = re.search(
        r"make up ([\d.]+) % .* rms_slope is (\S+) and rms_curvature (\S+) 1/m", dusty.dust[-1]
    )
    assert dusty.fine.curvature > 5 * clean.fine.curvature and float(said[1]) > 90
    assert float(said[2]) == pytest.approx(clean.fine.slope, rel=0.02)
    assert float(said[3]) == pytest.approx(clean.fine.curvature, rel=0.05)


def test_refuses_what_no_surface_has():
    x = np.arange(256) * 1e-6
    with pytest.raises(PatchfemError, match=r"at least 1\.22"):
        # one wave: alpha = 1
        gaussian_peaks(trace_moments(trace_of(np.sin(2 * np.pi * x / 2e-5), 1e-6)).fine)
    with pytest.raises(PatchfemError, match=r"at least 1\.22"):
        # each is off its neighbours
        gaussian_peaks(trace_moments(trace_of(1e-6 * (np.arange(64) % 2), 1e-6)).fine)
    with pytest.raises(PatchfemError, match="is flat"):
        trace_moments(trace_of(0.1 * x, 1e-6))
    with pytest.raises(PatchfemError, match="at least 16"):
        rms_moments(trace_of(np.sin(x[:20] * 1e6), 1e-6), 2)


def written(folder, seed=1) -> str:
    z = 1e-7 * (one := gaussian(256, 1e-6, (8e-6, 1e-4), seed)[0]) / one.std()
    (folder / f"trace{seed}.csv").write_text(
        "x [um],z [um]\n"
        + "".join(f"{k},{height * 1e6!r}\n" for k, height in enumerate(z.tolist()))
    )
    return str(folder / f"trace{seed}.csv")


def test_exact_the_three_ways_to_tell_peaks_are_one(tmp_path, monkeypatch):
    """A file, its root mean squares as `profile` prints them, and the peaks of these: one patch."""
    monkeypatch.chdir(tmp_path)
    one = cli("profile", written(tmp_path))
    block = one.out[one.out.index("[contact.asperities]") :].split("  At a pressure")[0]
    found = tomllib.loads("\n".join(line.strip() for line in block.splitlines()))["contact"][
        "asperities"
    ]
    rms = Moments(
        float(found["rms_height"].split()[0]) * 1e-6,
        found["rms_slope"],
        float(found["rms_curvature"].split()[0]),
    )
    peaks = gaussian_peaks(rms)
    pasted = PATCH + "".join(f"{key} = {value!r}\n" for key, value in found.items() if key != "law")
    ways = [
        PATCH + 'from = "trace1.csv"\n',
        pasted,
        PATCH + f'radius = "{peaks.radius!r} m"\ndensity = '
        f'"{peaks.density!r} 1/m^2"\nheight_deviation = "{peaks.deviation!r} m"\n',
    ]
    (tmp_path / "scene.toml").write_text(ways[0])
    runs = [pf.run("scene.toml"), *(pf.run(text) for text in ways[1:])]
    stiff = [run.measures["normal_stiffness"].value for run in runs]
    assert stiff[1] == pytest.approx(stiff[0], rel=1e-4) and stiff[2] == pytest.approx(
        stiff[1], rel=1e-12
    )
    said = [" ".join(note for note in run.extra["notes"] if "Persson" in note) for run in runs]
    assert "every second sample" in said[0]
    assert "every second" not in said[1]
    assert said[1]
    assert not said[2]
    assert any("Persson" in text for text in pf.plan(pasted).verdict)
    runs[0].save(tmp_path / "out/first")
    (tmp_path / "again.toml").write_text((tmp_path / "out/first/scene.resolved.toml").read_text())
    again = pf.run(tmp_path / "again.toml")
    assert again.measures["normal_stiffness"].value == pytest.approx(stiff[0], rel=1e-12)


def test_exact_the_other_theory_is_the_exponential_law():
    """The law that the note names has the stiffness that the note tells, in the middle of its range."""
    note = next(text for text in pf.plan(PATCH + RMS).verdict if "Persson" in text)
    decay = note.split('decay_length = "')[1].split('"')[0]
    soft, stiff = (
        float(word) for word in note.split("lengths, gives ")[1].split(" Pa/m")[0].split(" to ")
    )
    pressure = 26 * 4.4482216152605 / 12.7e-3**2
    assert (soft, stiff) == pytest.approx(persson_stiffness(pressure, 0.5e-6), rel=5e-3)
    other = PATCH.replace("hertz", "exponential") + f'decay_length = "{decay}"\n'
    made, bare = (
        pf.run(text).measures["normal_stiffness"].value
        for text in (other, PATCH.partition("[contact.asp")[0])
    )
    area = 12.7e-3**2
    assert soft < 1 / (1 / made - 1 / bare) / area < stiff


@pytest.mark.parametrize(
    "keys, said",
    [
        ("", "you can give `from`, or rms_height, rms_slope and rms_curvature"),
        ('radius = "1 um"\n', "contact.asperities.density: missing"),
        ('rms_height = "1 um"\nrms_slope = 0.1\n', "contact.asperities.rms_curvature: missing"),
        (RMS + 'radius = "1 um"\n', "keep only one"),
        (RMS.replace("0.05", "0.5"), "at least 1.22"),
        (RMS.replace("0.02 1/um", "0.02"), "1/um"),
        ('from = "nowhere.csv"\n', "there is no file"),
    ],
)
def test_refuses_peaks_that_are_not_whole(keys, said, tmp_path):
    (tmp_path / "scene.toml").write_text(PATCH + keys)
    with pytest.raises(PatchfemError) as wrong:
        pf.plan(tmp_path / "scene.toml")
    assert said in str(wrong.value) and "asperities" in str(wrong.value)


def test_a_short_trace_has_peaks_though_half_of_it_tells_none(tmp_path):
    x = np.arange(24)
    z = 2 * np.sin(0.5 * x) + 0.3 * np.random.default_rng(3).normal(size=24)
    (tmp_path / "short.csv").write_text(
        "x [um],z [um]\n" + "".join(f"{a},{b!r}\n" for a, b in zip(x, z.tolist()))
    )
    (tmp_path / "scene.toml").write_text(PATCH + 'from = "short.csv"\n')
    assert any(
        "from every second sample: no surface of such peaks" in text
        for text in pf.plan(tmp_path / "scene.toml").verdict
    )


def test_profile_tells_two_faces_together(tmp_path):
    files = [written(tmp_path, seed) for seed in (1, 2)]
    told = pf.profile(*files)["profiles"]
    both = cli("profile", *files).out.partition("two faces")[2]
    height = np.hypot(*(one["asperities"]["rms_height"] for one in told))
    assert f'rms_height = "{height * 1e6:.5g} um"' in both


CUT = 0.4e-3


def passed(wave) -> float:
    """Share of a wave [m] that the Gaussian filter of ISO 16610-21 leaves in the waviness: half of the cut-off's."""
    return 0.5 ** (CUT / wave) ** 2


def split(folder, waves) -> tuple:
    """Places [m] of nodes, the gap there [m] and the skin of a patch that takes one trace of cosines [(amplitude,
    wavelength) in m] for its profile and for its asperities, split at CUT; and the folder's scene."""
    x = np.linspace(-6.35e-3, 6.35e-3, 25401)
    z = sum(a * np.cos(2 * np.pi * x / wave + k) for k, (a, wave) in enumerate(waves))
    (folder / "trace.csv").write_text(
        "x [m],z [m]\n" + "".join(f"{a!r},{b!r}\n" for a, b in zip(x.tolist(), z.tolist()))
    )
    text = (
        PATCH.replace('element_size = "1 mm"\n', 'element_size = "25.4 um"\n')
        + 'from = "trace.csv"\ncutoff = "0.4 mm"\n[contact.profile]\nfile = "trace.csv"\n'
    )
    found = build(loads(text, folder / "scene.toml")).patch
    nodes = np.linspace(-6.35e-3, 6.35e-3, 501)
    return nodes, found.gap.evaluate(nodes).heights, found.interface.skin, text


def test_exact_one_cutoff_splits_a_trace_between_the_gap_and_its_asperities(tmp_path):
    """Each wave of a known spectrum counts once: the gap has what the filter passes, the peaks what it stops."""
    waves = [
        (1e-6, 2.54e-3),
        (0.3e-6, 0.508e-3),
        (0.2e-6, 12.7e-3 / 40),
        (0.1e-6, 63.5e-6),
        (2e-8, 25.4e-6),
    ]
    x, gap, skin, _ = split(tmp_path, waves)
    inner = np.abs(x) < 4e-3  # the mean line bends near the ends
    columns = [part(2 * np.pi * x / wave) for _, wave in waves[:4] for part in (np.cos, np.sin)]
    fit = np.linalg.lstsq(
        np.stack([*columns, np.ones(x.size), x], 1)[inner], gap[inner], rcond=None
    )[0]
    for (size, wave), found in zip(waves, np.hypot(fit[0:8:2], fit[1:8:2])):
        seen = np.sinc(25.4e-6 / wave)  # by the mean over a node's own length
        assert found == pytest.approx(size * passed(wave) * seen, abs=3e-4 * size), wave
    left = [(size * (1 - passed(wave)), 2 * np.pi / wave) for size, wave in waves]
    for name, order in (("height", 0), ("slope", 1), ("curvature", 2)):
        truth = np.sqrt(sum((a * k**order) ** 2 / 2 for a, k in left))
        assert getattr(skin, f"rms_{name}") == pytest.approx(truth, rel=5e-3), name
    whole = trace_moments(
        Profile(
            np.arange(25401) * 0.5e-6,
            sum(a * np.cos(2 * np.pi * np.arange(25401) * 0.5e-6 / wave) for a, wave in waves),
            "whole",
        )
    ).fine
    assert whole.height > 4 * skin.rms_height  # what counted twice


def test_profile_prints_the_peaks_below_its_cutoff_and_they_paste_to_the_same_patch(
    tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    rng = np.random.default_rng(11)
    waves = [(2e-8 * n**-0.8, 12.7e-3 / n) for n in (5, *rng.integers(10, 900, 60).tolist())]
    *_, skin, text = split(tmp_path, waves)
    said = cli("profile", "trace.csv", "--cutoff", "0.4 mm")
    told = pf.profile("trace.csv", cutoff="0.4 mm")["profiles"][0]
    assert told["asperities"]["rms_height"] == pytest.approx(
        told["measures"]["Rq"]["value"], rel=1e-9
    )
    assert told["asperities"]["cutoff"] == 0.4e-3
    assert "only waves below the cut-off of 400 um" in said.out
    assert told["asperities"]["rms_height"] == pytest.approx(skin.rms_height, rel=1e-9)
    bare = cli("profile", "trace.csv").out
    assert "cutoff =" not in bare and "otherwise the long waves count twice" in bare
    block = said.out[said.out.index("[contact.asperities]") :].split("  At a pressure")[0]
    pasted = text.replace(
        'from = "trace.csv"\ncutoff = "0.4 mm"\n',
        "".join(f"{line.strip()}\n" for line in block.splitlines()[2:]),
    )
    again = build(loads(pasted, tmp_path / "scene.toml")).patch.interface.skin
    for name in ("radius", "density", "height_deviation"):
        assert getattr(again, name) == pytest.approx(getattr(skin, name), rel=1e-4), name
    lacking = pf.plan(loads(pasted.replace('cutoff = "400 um"\n', ""), tmp_path / "scene.toml"))
    assert any("waves longer than 127 um" in one for one in lacking.verdict)
    assert not any(
        "longer than" in one for one in pf.plan(loads(pasted, tmp_path / "scene.toml")).verdict
    )


def test_heights_that_are_not_gaussian_are_told():
    """None of 40 Gaussian traces is doubted; tops cut off and single peaks are, each with its sign."""
    step = 1e-6
    for seed in range(40):
        row = gaussian(256, step, (8e-6, 6e-5), seed)[seed]
        assert trace_moments(trace_of(row, step)).not_gaussian == "", seed
    rows = gaussian(512, step, (8e-6, 6e-5), 3)[::128].ravel() * 1e-7
    rows /= rows.std() / 1e-7
    for z, word in ((np.minimum(rows, 0.3e-7), "stiffer"), (np.maximum(rows, -0.3e-7), "softer")):
        doubt = trace_moments(trace_of(z, step)).not_gaussian
        assert word in doubt and "(0 and 3)" in doubt


@pytest.mark.parametrize(
    "cutoff, said", [("13 mm", "no wave would remain"), ("1 um", "must be at least")]
)
def test_refuses_a_cutoff_that_does_not_split(tmp_path, cutoff, said):
    *_, text = split(tmp_path, [(1e-6, 1e-3), (1e-7, 1e-4), (1e-8, 2e-5)])
    with pytest.raises(PatchfemError, match=said) as wrong:
        pf.run(loads(text.replace("0.4 mm", cutoff), tmp_path / "scene.toml"))
    assert "contact.asperities.cutoff" in str(wrong.value)
