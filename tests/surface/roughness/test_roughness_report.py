"""Report of a surface: windows, flat and short traces, spikes, scans, refusals and computing time."""

import re
from dataclasses import replace

import numpy as np
import pytest
from ring_traces import draw_traces

from patchfem.core import PatchfemError
from patchfem.export.surfaces.roughness import describe_surface
from patchfem.surface import Profile, fitting_cutoff, make_report
from patchfem.surface.areal import Areal

UM = 1e-6


def make_sine_trace(count=4001, source="made.csv", **fields) -> Profile:
    """Return a noisy sine trace of 80 um wavelength."""
    x = np.arange(count) * UM
    z = 2 * UM * np.sin(2 * np.pi * x / 80e-6) + np.random.default_rng(0).normal(0, 0.1 * UM, count)
    return Profile(x, z, source, **fields)


def test_exact_window_and_spikes_of_scan():
    """A window of a scan gives the parameters of that part, and a note counts the spikes of a scan."""
    full_scan = make_noise_scan()
    ends = tuple(np.array([20, 60, 10, 70.5]) * UM)
    part = make_report(full_scan, window=ends)
    cropped = Areal(full_scan.x[20:61], full_scan.y[10:71], full_scan.z[10:71, 20:61], "scan.txt")
    assert part.sampling.shape == (61, 41)
    assert [row.value for row in part.values] == [row.value for row in make_report(cropped).values]
    z = np.array(full_scan.z)
    z[[30, 50], [40, 70]] += 40 * UM
    notes = make_report(replace(full_scan, z=z)).notes
    assert notes == (
        "scan.txt: 2 of 9600 heights are spikes (the first at x = 40 um, y = 30 um), which count in every "
        "parameter",
    )
    assert make_report(full_scan).notes == ()


def test_exact_report_of_noisy_sine():
    """Ra, RSm, band amplitude and dominant wavelength of a noisy sine agree with the closed forms within 1 %.

    All values lie inside their intervals.
    """
    report = make_report(make_sine_trace(), 250 * UM)
    assert report["Ra"].value == pytest.approx(
        2 * UM * 2 / np.pi * (1 - 2 ** -((250 / 80) ** 2)), rel=0.01
    )
    assert report["RSm"].value == pytest.approx(80 * UM, rel=0.01)
    assert report["band_amplitude"].value == pytest.approx(2 * UM, rel=0.01)
    assert report["dominant_wavelength"].value == pytest.approx(80 * UM, rel=0.01)
    assert [
        parameter.low <= parameter.value <= parameter.high
        for parameter in report.values
        if parameter.low is not None
    ].count(False) == 0
    assert len({parameter.name for parameter in report.values}) == len(report.values) == 33


def test_exact_flat_trace_has_zero_heights_with_reasons():
    """A flat trace has zero heights, and its other parameters have a reason instead of a value."""
    report = make_report(Profile(np.arange(4000) * UM, np.full(4000, 3e-6), "flat.csv"), 250 * UM)
    assert report["Pq"].value == 0
    assert report["Rz"].value == 0
    assert report["band_amplitude"].value == 0
    for name in ("Psk", "Rku", "Pk", "RSm", "dominant_wavelength"):
        assert report[name].value is None and report[name].reason == "the trace is flat"
    assert all(
        parameter.low is None or np.isfinite([parameter.low, parameter.high]).all()
        for parameter in report.values
    )


def test_exact_short_trace_states_missing_section_or_band():
    """A trace shorter than a section or than the band states this as the reason for missing values."""
    report = make_report(
        make_sine_trace(400), 250 * UM
    )  # 150 um remain, less than a section of 250 um
    assert report["Rz"].value is None
    assert report["Rz"].reason == "the trace is shorter than one cut-off"
    assert report["Ra"].value > 0
    short = make_report(make_sine_trace(200))["band_amplitude"]
    assert short.value is None
    assert (
        "can show waves of 2 um to 99.5 um, but not the whole band 60 um to 110 um"
    ) in short.reason


def test_exact_spikes_are_reported_and_counted():
    """A spike counts in all parameters, with a note; a very high one leaves no interval of the dominant wavelength."""
    trace = make_sine_trace()
    z = trace.z.copy()
    z[1000] += 50 * UM
    report = make_report(Profile(trace.x, z, "made.csv"))
    assert report.notes[0] == (
        "made.csv: 1 of 4001 heights is a spike (at x = 1 mm), which counts in every parameter"
    )
    z[1000] += 950 * UM  # earlier the interval was 4 nm to 68 um at a step of 1 um
    wave = make_report(Profile(trace.x, z, "made.csv"))["dominant_wavelength"]
    assert wave.value > 0 and wave.low is wave.high is None and "gives no interval" in wave.reason
    assert report["Pt"].value > 50 * UM


def test_exact_non_gaussian_heights_have_no_interval():
    """Heights that are truncated, pitted or lognormal have no intervals that assume Gaussian heights.

    A Gaussian trace, a sine and its cube have intervals.
    """
    gauss = draw_traces(1, 8e-3, UM, 6 * UM, 3)[0]
    x = np.arange(gauss.size) * UM
    pits = gauss - 30 * UM * np.maximum(1 - ((x % 800e-6 - 400e-6) / 10e-6) ** 2, 0)
    for z in (np.minimum(gauss, 3 * UM), pits, 6 * UM * np.exp(gauss / gauss.std())):
        report = make_report(Profile(x, z, "worn.csv"), 250 * UM)
        names_with_interval = {
            parameter.name for parameter in report.values if parameter.low is not None
        }
        assert (
            names_with_interval <= {"dominant_wavelength", "band_amplitude"}
            and "band_amplitude" in names_with_interval
        )
        assert report["Rku"].reason.startswith("an interval from a single trace assumes Gaussian")
        assert report["Rku"].value > 0
    for z in (
        gauss,
        6 * UM * np.sin(2 * np.pi * x / 80e-6),
        6 * UM * np.sin(2 * np.pi * x / 80e-6) ** 3,
    ):
        assert make_report(Profile(x, z, "new.csv"))["Pku"].low is not None


def test_exact_self_affine_trace_has_no_height_interval():
    """A self-affine trace without a longest wave has no interval of its heights, but of slope and skewness."""
    frequency = np.arange(1, 16_001)
    numbers = np.random.default_rng(3).standard_normal((2, 16_000))
    z = np.fft.irfft(np.concatenate([[0], frequency**-1.3 * (numbers[0] + 1j * numbers[1])]))[:2000]
    report = make_report(Profile(np.arange(2000) * UM, z / z.std() * UM, "fractal.csv"))
    assert report["Pq"].low is None and report["Pq"].reason.startswith(
        "the trace is shorter than four wavelengths"
    )
    assert report["Pdq"].low is not None and report["Psk"].low is not None


def make_noise_scan(has_hole=False) -> Areal:
    """Return a tilted scan of white noise, with or without a missing column."""
    x = np.arange(120) * UM
    y = np.arange(80) * UM
    z = np.random.default_rng(2).normal(0, UM, (80, 120)) + 0.02 * x + 0.03 * y[:, None]
    if has_hole:
        z[:, 10] = np.nan
    return Areal(x, y, z, "scan.txt")


@pytest.mark.parametrize("has_hole", [False, True])
def test_exact_areal_parameters_of_white_noise(has_hole):
    """Sq, Ssk and Sku of white noise agree with those of the normal law within three standard deviations."""
    report = make_report(make_noise_scan(has_hole))
    n = 80 * (120 - has_hole)
    assert report["Sq"].value == pytest.approx(UM, rel=3 / np.sqrt(2 * n))
    assert (report["Sq"].high - report["Sq"].low) / report["Sq"].value == pytest.approx(
        3.29 / np.sqrt(2 * n), rel=0.15
    )
    assert report["Ssk"].value == pytest.approx(0, abs=3 * np.sqrt(6 / n))
    assert report["Sku"].value == pytest.approx(3, abs=3 * np.sqrt(24 / n))
    assert bool(report.notes) == has_hole and report["Sz"].low is None


@pytest.mark.parametrize(
    "surface, options, message",
    [
        (make_sine_trace(10), {}, "made.csv: 10 samples; the parameters need at least 16"),
        (
            make_sine_trace(),
            {"window": (20 * UM, 10 * UM)},
            "the window runs from 20 um to 10 um, but the trace runs from 0 um to 4 mm",
        ),
        (make_sine_trace(), {"window": (20 * UM, 5e-3)}, "the window runs from 20 um to 5 mm"),
        (
            make_sine_trace(),
            {"cutoff": 5e-3},
            "the trace is 4 mm long; half a cut-off of 5 mm is trimmed at each end",
        ),
        (
            make_noise_scan(),
            {"window": (0.0, 1e-4)},
            "a window of an areal scan needs four positions",
        ),
        (
            make_noise_scan(),
            {"window": (0.0, 1e-5, 2e-5, 1e-3)},
            "the scan runs in y from 0 um to 79 um",
        ),
        (
            make_sine_trace(),
            {"window": (0.0, 1e-5, 2e-5, 1e-3)},
            "a window of a trace needs two positions",
        ),
        (
            make_noise_scan(),
            {"cutoff": 1e-4},
            "scan.txt: the shorter side is 79 um long; half a cut-off of 100 um is trimmed",
        ),
    ],
)
def test_refuses_invalid_window_or_cutoff(surface, options, message):
    """Windows and cut-offs that do not fit the surface, and short traces, are refused."""
    with pytest.raises(PatchfemError, match=message):
        make_report(surface, **options)


def test_exact_form_and_short_waves_are_removed():
    """A parabola and a wave of 5 um are removed from a sine of 80 um, whose Pq agrees with the Gaussian filter."""
    x = np.arange(4001) * UM
    z = (
        2 * UM * np.sin(2 * np.pi * x / 80e-6)
        + 50 * UM * (x / 2e-3 - 1) ** 2
        + UM * np.sin(2 * np.pi * x / 5e-6)
    )
    trace = Profile(x, z, "bent.csv")
    assert make_report(trace)["Pq"].value > 10 * UM
    report = make_report(trace, form=2, short=20 * UM)
    transmission = 2 ** -((20 / 80) ** 2)
    assert report["Pq"].value == pytest.approx(2 * UM / np.sqrt(2) * transmission, rel=2e-3)
    assert report.treatment.form == "polynomial of degree 2"
    assert report.surface.primary.x[0] == 10 * UM


@pytest.mark.parametrize(
    "length, expected",
    [
        (4e-3, 250 * UM),
        (1.5e-3, 250 * UM),
        (1.49e-3, 80 * UM),
        (60e-3, 8e-3),
        (9600 * (1.5e-3 / 9600 * (1 - 1e-16)), 250 * UM),
        (0.1e-3, None),
    ],
)
def test_exact_fitting_cutoff_is_longest_standard_one(length, expected):
    """The fitting cut-off is the longest standard one of which five sections and two halves fit into the trace."""
    assert fitting_cutoff(length, 0.5 * UM) == (
        None if expected is None else pytest.approx(expected)
    )


def test_exact_report_states_effect_of_resampling():
    """The report of an uneven trace states the numbers of measured and resampled heights and the change of Pq.

    Earlier 132 heights became 176 without a note.
    """
    draw = np.random.default_rng(71000)
    x = np.cumsum(draw.uniform(0.8, 2.5, 132)) * UM
    z = np.sin(2 * np.pi * x / (9 * UM)) * UM
    found = make_report(Profile(x, z, "uneven.csv"))
    weight = np.gradient(x) / np.gradient(x).sum()
    mean_line = np.interp(
        x,
        found.surface.primary.x,
        np.interp(found.surface.primary.x, x, z) - found.surface.primary.z,
    )
    measured_rms = np.sqrt(weight @ (z - mean_line) ** 2)
    note = next(text for text in found.notes if "resampling changes" in text)
    stated_change = float(re.search(r"Pq by ([\d.]+) %", note).group(1))
    assert (
        stated_change == pytest.approx(100 * abs(found["Pq"].value / measured_rms - 1), rel=0.1)
        and stated_change > 1
    )
    count = found.sampling.shape[0]
    assert describe_surface(found).startswith(f"132 heights, resampled to {count}, ")
    assert count > 140
    assert not any("resampling" in text for text in make_report(make_sine_trace()).notes)
