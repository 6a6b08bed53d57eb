"""The report of a surface: windows, flat and short traces, spikes, printed results, scans, refusals, its speed."""

import re
from dataclasses import replace
from time import process_time

import numpy as np
import pytest
from ring_traces import traces
from synthetic import sine

from patchfem.core import PatchfemError
from patchfem.export.surfaces.roughness import describe_surface
from patchfem.surface import Profile, fitting_cutoff, make_report
from patchfem.surface.areal import Areal
from patchfem.surface.roughness.report import crop

UM = 1e-6


def made(count=4001, source="made.csv", **more) -> Profile:
    x = np.arange(count) * UM
    z = 2 * UM * np.sin(2 * np.pi * x / 80e-6) + np.random.default_rng(0).normal(0, 0.1 * UM, count)
    return Profile(x, z, source, **more)


@pytest.mark.parametrize(
    "first, last, low, high", [(10.2, 20.9, 10, 20), (10.0, 20.0, 10, 20), (0, 4000, 0, 4000)]
)
def test_exact_a_window_from_the_samples_at_or_before_its_cursors(first, last, low, high):
    part = crop(made(), first * UM, last * UM)
    assert part.x == pytest.approx(np.arange(low, high + 1) * UM)


def test_less_than_one_section_is_said():
    """Of 265 um a cut-off of 250 um leaves 15 um; of 500 um it leaves 250 um, one section."""
    said = make_report(made(), 250 * UM, (468 * UM, 733 * UM)).notes
    assert len(said) == 1
    assert "the 15 um that remain are shorter than one section of 250 um" in said[0]
    assert (
        make_report(made(), 250 * UM, (468 * UM, 968 * UM)).notes
        == make_report(made(), 250 * UM).notes
        == ()
    )


def test_exact_a_window_of_a_scan_and_its_spikes():
    """Heights 20 to 60 in x and 10 to 70 in y of a scan of 120 x 80; two heights far off are spikes."""
    one = scan()
    ends = tuple(np.array([20, 60, 10, 70.5]) * UM)
    part = make_report(one, window=ends)
    alone = Areal(one.x[20:61], one.y[10:71], one.z[10:71, 20:61], "scan.txt")
    assert part.sampling.shape == (61, 41)
    assert [row.value for row in part.values] == [row.value for row in make_report(alone).values]
    z = np.array(one.z)
    z[[30, 50], [40, 70]] += 40 * UM
    notes = make_report(replace(one, z=z)).notes
    assert notes == (
        "scan.txt: 2 of 9600 heights are spikes (the first at x = 40 um, y = 30 um), which count in every "
        "parameter",
    )
    assert make_report(one).notes == ()


def test_exact_a_sine_with_a_little_noise():
    report = make_report(made(), 250 * UM)
    assert report["Ra"].value == pytest.approx(
        2 * UM * 2 / np.pi * (1 - 2 ** -((250 / 80) ** 2)), rel=0.01
    )
    assert report["RSm"].value == pytest.approx(80 * UM, rel=0.01)
    assert report["band_amplitude"].value == pytest.approx(2 * UM, rel=0.01)
    assert report["dominant_wavelength"].value == pytest.approx(80 * UM, rel=0.01)
    assert [one.low <= one.value <= one.high for one in report.values if one.low is not None].count(
        False
    ) == 0
    assert len({one.name for one in report.values}) == len(report.values) == 33


def test_exact_a_flat_trace_says_so():
    report = make_report(Profile(np.arange(4000) * UM, np.full(4000, 3e-6), "flat.csv"), 250 * UM)
    assert report["Pq"].value == 0
    assert report["Rz"].value == 0
    assert report["band_amplitude"].value == 0
    for name in ("Psk", "Rku", "Pk", "RSm", "dominant_wavelength"):
        assert report[name].value is None and report[name].reason == "the trace is flat"
    assert all(one.low is None or np.isfinite([one.low, one.high]).all() for one in report.values)


def test_exact_a_trace_shorter_than_a_section_or_the_band_says_so():
    report = make_report(made(400), 250 * UM)  # 150 um are left, no section of 250
    assert report["Rz"].value is None
    assert report["Rz"].reason == "the trace is shorter than one cut-off"
    assert report["Ra"].value > 0
    short = make_report(made(200))["band_amplitude"]
    assert short.value is None
    assert (
        "can show waves of 2 um to 99.5 um, but not the whole band 60 um to 110 um"
    ) in short.reason


def test_exact_spikes_are_told_and_count():
    trace = made()
    z = trace.z.copy()
    z[1000] += 50 * UM
    report = make_report(Profile(trace.x, z, "made.csv"))
    assert report.notes[0] == (
        "made.csv: 1 of 4001 heights is a spike (at x = 1 mm), which counts in every parameter"
    )
    z[1000] += 950 * UM  # its interval was 4 nm to 68 um on a step of 1 um
    wave = make_report(Profile(trace.x, z, "made.csv"))["dominant_wavelength"]
    assert wave.value > 0 and wave.low is wave.high is None and "gives no interval" in wave.reason
    assert report["Pt"].value > 50 * UM


def test_exact_heights_that_are_not_gaussian_have_no_interval_and_say_so():
    """Cut at half a deviation, with pits, and lognormal: no interval that counts on Gaussian heights. A Gaussian trace,
    a sine and its cube keep theirs."""
    gauss = traces(1, 8e-3, UM, 6 * UM, 3)[0]
    x = np.arange(gauss.size) * UM
    pits = gauss - 30 * UM * np.maximum(1 - ((x % 800e-6 - 400e-6) / 10e-6) ** 2, 0)
    for z in (np.minimum(gauss, 3 * UM), pits, 6 * UM * np.exp(gauss / gauss.std())):
        report = make_report(Profile(x, z, "worn.csv"), 250 * UM)
        told = {one.name for one in report.values if one.low is not None}
        assert told <= {"dominant_wavelength", "band_amplitude"} and "band_amplitude" in told
        assert report["Rku"].reason.startswith("an interval from a single trace assumes Gaussian")
        assert report["Rku"].value > 0
    for z in (
        gauss,
        6 * UM * np.sin(2 * np.pi * x / 80e-6),
        6 * UM * np.sin(2 * np.pi * x / 80e-6) ** 3,
    ):
        assert make_report(Profile(x, z, "new.csv"))["Pku"].low is not None


def test_exact_a_trace_as_long_as_its_waves_has_no_interval_of_heights():
    """A self-affine trace without a longest wave: heights have none, slope and skewness have theirs."""
    frequency = np.arange(1, 16_001)
    numbers = np.random.default_rng(3).standard_normal((2, 16_000))
    z = np.fft.irfft(np.concatenate([[0], frequency**-1.3 * (numbers[0] + 1j * numbers[1])]))[:2000]
    report = make_report(Profile(np.arange(2000) * UM, z / z.std() * UM, "fractal.csv"))
    assert report["Pq"].low is None and report["Pq"].reason.startswith(
        "the trace is shorter than four wavelengths"
    )
    assert report["Pdq"].low is not None and report["Psk"].low is not None


def scan(lost=False) -> Areal:
    x = np.arange(120) * UM
    y = np.arange(80) * UM
    z = np.random.default_rng(2).normal(0, UM, (80, 120)) + 0.02 * x + 0.03 * y[:, None]
    if lost:
        z[:, 10] = np.nan
    return Areal(x, y, z, "scan.txt")


@pytest.mark.parametrize("lost", [False, True])
def test_exact_areal_parameters_of_white_noise(lost):
    report = make_report(scan(lost))
    n = 80 * (120 - lost)
    assert report["Sq"].value == pytest.approx(UM, rel=3 / np.sqrt(2 * n))
    assert (report["Sq"].high - report["Sq"].low) / report["Sq"].value == pytest.approx(
        3.29 / np.sqrt(2 * n), rel=0.15
    )
    assert report["Ssk"].value == pytest.approx(0, abs=3 * np.sqrt(6 / n))
    assert report["Sku"].value == pytest.approx(3, abs=3 * np.sqrt(24 / n))
    assert bool(report.notes) == lost and report["Sz"].low is None


@pytest.mark.parametrize(
    "surface, more, says",
    [
        (made(10), {}, "made.csv: 10 samples; the parameters need at least 16"),
        (
            made(),
            {"window": (20 * UM, 10 * UM)},
            "the window runs from 20 um to 10 um, but the trace runs from 0 um to 4 mm",
        ),
        (made(), {"window": (20 * UM, 5e-3)}, "the window runs from 20 um to 5 mm"),
        (
            made(),
            {"cutoff": 5e-3},
            "the trace is 4 mm long; half a cut-off of 5 mm is trimmed at each end",
        ),
        (scan(), {"window": (0.0, 1e-4)}, "a window of an areal scan needs four positions"),
        (scan(), {"window": (0.0, 1e-5, 2e-5, 1e-3)}, "the scan runs in y from 0 um to 79 um"),
        (made(), {"window": (0.0, 1e-5, 2e-5, 1e-3)}, "a window of a trace needs two positions"),
        (
            scan(),
            {"cutoff": 1e-4},
            "scan.txt: the shorter side is 79 um long; half a cut-off of 100 um is trimmed",
        ),
    ],
)
def test_refuses(surface, more, says):
    with pytest.raises(PatchfemError, match=says):
        make_report(surface, **more)


@pytest.mark.slow
def test_always_a_million_samples_take_two_seconds():
    trace = sine(np.arange(1_000_000) * 0.1 * UM, UM, 80 * UM)
    make_report(made(), 250 * UM)  # what scipy loads once
    begin = process_time()
    make_report(trace, 800 * UM)
    assert process_time() - begin < 2


def test_exact_a_form_and_a_short_wave_of_a_trace():
    """A parabola of 50 um and a wave of 5 um off a sine of 80 um: its amplitude is that of a Gaussian filter."""
    x = np.arange(4001) * UM
    z = (
        2 * UM * np.sin(2 * np.pi * x / 80e-6)
        + 50 * UM * (x / 2e-3 - 1) ** 2
        + UM * np.sin(2 * np.pi * x / 5e-6)
    )
    trace = Profile(x, z, "bent.csv")
    assert make_report(trace)["Pq"].value > 10 * UM
    report = make_report(trace, form=2, short=20 * UM)
    kept = 2 ** -((20 / 80) ** 2)
    assert report["Pq"].value == pytest.approx(2 * UM / np.sqrt(2) * kept, rel=2e-3)
    assert report.treatment.form == "polynomial of degree 2"
    assert report.surface.primary.x[0] == 10 * UM


@pytest.mark.parametrize(
    "length, fits",
    [
        (4e-3, 250 * UM),
        (1.5e-3, 250 * UM),
        (1.49e-3, 80 * UM),
        (60e-3, 8e-3),
        (9600 * (1.5e-3 / 9600 * (1 - 1e-16)), 250 * UM),
        (0.1e-3, None),
    ],
)
def test_exact_the_cutoff_that_fits(length, fits):
    """Standard cut-offs; the trace holds five sections and two halves."""
    assert fitting_cutoff(length, 0.5 * UM) == (None if fits is None else pytest.approx(fits))


def test_always_no_value_or_interval_is_missing_without_a_reason():
    report = make_report(made(), 250 * UM, (100 * UM, 3900 * UM))
    assert all(one.reason for one in report.values if one.value is None or one.low is None)


def test_exact_a_resampled_trace_says_how_many_heights_were_measured_and_what_resampling_changed():
    """132 heights became 176 without a word, and the mean heights changed by 0.5 %."""
    draw = np.random.default_rng(71000)
    x = np.cumsum(draw.uniform(0.8, 2.5, 132)) * UM
    z = np.sin(2 * np.pi * x / (9 * UM)) * UM
    found = make_report(Profile(x, z, "uneven.csv"))
    weight = np.gradient(x) / np.gradient(x).sum()
    off = np.interp(
        x,
        found.surface.primary.x,
        np.interp(found.surface.primary.x, x, z) - found.surface.primary.z,
    )
    own = np.sqrt(weight @ (z - off) ** 2)
    note = next(text for text in found.notes if "resampling changes" in text)
    said = float(re.search(r"Pq by ([\d.]+) %", note).group(1))
    assert said == pytest.approx(100 * abs(found["Pq"].value / own - 1), rel=0.1) and said > 1
    count = found.sampling.shape[0]
    assert describe_surface(found).startswith(f"132 heights, resampled to {count}, ")
    assert count > 140
    assert not any("resampling" in text for text in make_report(made()).notes)


def test_exact_a_trace_of_six_cutoffs_but_for_round_off_is_told_of_the_longest():
    """80 um were called the longest cut-off that fits five times into 1.5 mm: 250 um do, once both ends are trimmed."""
    one = made(1500)
    told = describe_surface(make_report(one))
    assert (
        '--cutoff "250 um" is the longest standard cut-off of which five fit into the trace once half a'
        in told
    )
    assert make_report(one, cutoff=250 * UM).surface.roughness.x.size == 1250
