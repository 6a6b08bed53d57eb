"""Roughness parameters of traces, compared with closed forms; form, window, filters and refusals."""

import numpy as np
import pytest
from scipy.stats import norm

from patchfem.core import PatchfemError
from patchfem.surface import Profile, fitting_cutoff, make_report
from patchfem.surface.roughness.form import parse_form_option, subtract_form
from patchfem.surface.roughness.parameters import compute_core, compute_parameters

UM = 1e-6
MM = 1e-3


def make_trace(z, step=UM) -> Profile:
    """Return a trace of heights at an even step."""
    return Profile(np.arange(len(z)) * step, np.asarray(z, float), "trace")


def test_exact_parameters_of_sine():
    """Parameters of a sine agree with the closed forms."""
    z = UM * np.sin(2 * np.pi * (np.arange(8000) + 0.3) / 400)
    found = compute_parameters(z, UM)
    assert found["a"] == pytest.approx(2 / np.pi * UM, rel=1e-4)
    assert found["q"] == pytest.approx(UM / np.sqrt(2), rel=1e-12)
    assert found["sk"] == pytest.approx(0, abs=1e-12)
    assert found["ku"] == pytest.approx(1.5)
    assert found["t"] == pytest.approx(2 * UM, rel=1e-4)
    chord = 2 * np.sin(np.pi / 400) / UM  # slope between two samples relative to the amplitude
    assert found["dq"] == pytest.approx(UM / np.sqrt(2) * chord, rel=1e-4)
    assert found["Sm"] == pytest.approx(400 * UM, rel=1e-6)


def test_exact_mean_line_is_crossed_between_samples():
    """The mean length of the elements of a few waves does not depend on where samples lie in a wave."""
    z = UM * np.sin(2 * np.pi * (np.arange(130) + 0.3) / 37.3)
    assert compute_parameters(z, UM)["Sm"] == pytest.approx(37.3 * UM, rel=1e-4)


def test_exact_sections_of_growing_sine():
    """Rz is the mean over whole sections, Rt belongs to the whole trace, and Rz = Rp + Rv."""
    x = np.arange(999)
    z = np.where(x < 950, 1 + x // 200, 99.0) * np.sin(2 * np.pi * x / 40)
    found = compute_parameters(z, 1.0, 200.0)
    assert found["z"] == pytest.approx(2 * np.mean([1, 2, 3, 4]), rel=1e-12)
    assert found["p"] + found["v"] == pytest.approx(found["z"], rel=1e-14)
    assert found["t"] == pytest.approx(198, rel=1e-9)


def test_core_of_gaussian_heights():
    """The core parameters of Gaussian heights agree with those of the normal law within 0.1 %."""
    n = 200_001
    ratio = (np.arange(n) + 0.5) / n
    found = compute_core(norm.isf(ratio))
    middle = ratio[np.abs(ratio - 0.5) <= 0.2]
    slope = np.polyfit(middle, norm.isf(middle), 1)[0]
    top = -slope / 2
    first = norm.sf(top)
    area = norm.pdf(top) - top * first  # area of the peaks above the core
    assert found["k"] == pytest.approx(-slope, rel=1e-4)
    assert [found["Mr1"], found["Mr2"]] == pytest.approx([first, 1 - first], rel=1e-3)
    assert [found["pk"], found["vk"]] == pytest.approx([2 * area / first] * 2, rel=1e-3)


def test_report_splits_waves_at_cutoff():
    """Of a wave of 1 mm and one of 50 um, a cut-off of 250 um leaves the short one in the roughness."""
    x = np.arange(12_000) * UM
    z = 3 * UM * np.sin(2 * np.pi * x / MM) + UM * np.sin(2 * np.pi * x / (50 * UM))
    report = make_report(make_trace(z), 250 * UM)
    assert report["Rq"].value == pytest.approx(UM / np.sqrt(2), rel=0.01)
    assert report["Pq"].value == pytest.approx(np.sqrt(5) * UM, rel=0.01)
    assert report["Rq"].low < report["Rq"].value < report["Rq"].high
    assert report["Pq"].low is None and report["Pq"].reason == ""


@pytest.mark.slow
def test_always_intervals_hold_the_mean_of_a_rough_surface():
    """The 90 % interval of Rq from the sections of one trace contains its mean in at least 24 of 30 traces."""
    found = []
    for seed in range(30):
        noise = np.random.default_rng(seed).normal(size=4_000)
        found.append(
            make_report(make_trace(np.convolve(noise, np.ones(9), "same") * UM), 80 * UM)["Rq"]
        )
    mean = np.mean([quantity.value for quantity in found])
    held = sum(quantity.low <= mean <= quantity.high for quantity in found)
    assert 0.8 * 30 <= held


@pytest.mark.parametrize("sign", [1, -1])
def test_exact_circle_is_removed_from_trace(sign):
    """A circle of 5 mm radius in a trace of 4 mm is removed to 0.1 nm, and its radius is stated."""
    x = np.arange(4001) * UM
    z = sign * np.sqrt((5 * MM) ** 2 - (x - 1.6 * MM) ** 2)
    flat, name = subtract_form(make_trace(z), "circle")
    assert np.abs(flat.z).max() < 1e-10
    assert name == f"circle of radius 5 mm, a {'crest' if sign > 0 else 'trough'}"


def test_exact_window_keeps_samples_between_cursors():
    """A window runs from the last sample at or before its beginning to the last at or before its end."""
    z = np.random.default_rng(1).normal(size=200) * UM
    report = make_report(make_trace(z), window=(49.5 * UM, 120 * UM))
    assert report.sampling.shape == (72,)
    assert report["Pt"].value == pytest.approx(np.ptp(report.surface.primary.z), rel=1e-12)


def test_exact_flat_and_spiked_traces():
    """A flat trace has heights of zero and no skewness; a spike is counted in a note."""
    flat = make_report(make_trace(1e-3 * np.arange(100) * UM))
    assert flat["Pq"].value == 0.0
    assert flat["Psk"].value is None and flat["Psk"].reason == "undetermined"
    z = np.random.default_rng(2).normal(size=500) * 1e-8
    z[77] = 5e-6
    assert (
        "1 of 500 heights are spikes (the first at x = 77 um)"
        in make_report(make_trace(z)).notes[0]
    )


@pytest.mark.parametrize("length, expected", [(4.8e-3, 800e-6), (1.5e-3, 250e-6), (1e-4, None)])
def test_exact_fitting_cutoff_is_longest_standard_one(length, expected):
    """The proposed cut-off is the longest standard one that fits six times."""
    assert fitting_cutoff(length, UM) == expected


@pytest.mark.parametrize(
    "call, message",
    [
        (
            lambda: make_report(make_trace(np.zeros(10))),
            "10 samples; the parameters need at least 16",
        ),
        (
            lambda: make_report(make_trace(np.append(np.arange(10.0) ** 2, np.full(10, np.nan)))),
            "10 samples; the parameters need at least 16",
        ),
        (
            lambda: make_report(make_trace(np.zeros(99)), window=(50 * UM, 20 * UM)),
            "the window runs",
        ),
        (
            lambda: make_report(make_trace(np.zeros(99)), window=(0.0,)),
            "a window needs a first and a last position along x",
        ),
        (lambda: parse_form_option("2"), "use 1"),
        (lambda: subtract_form(make_trace([0.0, 1.0]), "circle"), "needs at least 10"),
    ],
)
def test_refuses_what_heights_do_not_determine(call, message):
    """Too few samples, a window that is none, and forms that were removed are refused."""
    with pytest.raises(PatchfemError, match=message):
        call()
