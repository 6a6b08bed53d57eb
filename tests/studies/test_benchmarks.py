"""Benchmarks against published measurements: the figures in the docstrings of the studies."""

import os
from pathlib import Path

import numpy as np
import pytest
from study_module import assert_contains, make_study_fixture

beam = make_study_fixture("benchmarks/brake_reuss.py")
wear = make_study_fixture("benchmarks/ti64_wear.py")
FOLDER = Path(os.environ.get("PATCHFEM_DATA") or "no folder")


def compute_rms(values):
    """Return the root mean square of the values."""
    return np.sqrt(np.mean(np.square(values)))


def test_always_beam_study_gives_its_stated_scores(beam):
    """Frequencies and damping ratios of the bolted beam differ from the measured ones as stated."""
    rows = {test: [row for row in beam.main() if row.test == test] for test in ("hammer", "shaker")}
    ratio = {t: [r.damping / r.measured_damping for r in rows[t]] for t in rows}
    difference = {t: [r.frequency - r.measured_frequency for r in rows[t]] for t in rows}
    scores = [beam.damping_score(ratio[test], 1) for test in rows]
    assert scores == pytest.approx([0.016, 0.158], abs=5e-4)
    assert [compute_rms(difference[test]) for test in rows] == pytest.approx(
        [0.019, 0.394], abs=5e-4
    )
    assert [min(ratio["shaker"]), max(ratio["shaker"])] == pytest.approx([0.85, 1.30], abs=5e-3)
    first, last = rows["hammer"][0], rows["hammer"][-1]
    assert first.frequency - last.frequency == pytest.approx(0.195, abs=5e-4)
    assert first.measured_frequency - last.measured_frequency == pytest.approx(0.199)
    assert beam.score_lines()[0] == pytest.approx(0.157, abs=5e-4)
    mean = beam.HAMMER.mean(axis=0)
    assert beam.damping_score(mean[2], beam.SHAKER[:, 3]) == pytest.approx(0.77, abs=5e-3)
    assert compute_rms(beam.SHAKER[:, 1] - mean[1]) == pytest.approx(0.19, abs=5e-3)
    assert compute_rms(beam.HAMMER[:, 1] - mean[1]) == pytest.approx(0.057, abs=5e-4)
    all_rows = [*rows["hammer"], *rows["shaker"]]
    assert max(r.frequency_error for r in all_rows) < 3e-5
    assert max(r.damping_error / r.damping for r in all_rows) < 3e-4


@pytest.mark.slow
def test_beam_fit_gives_the_values_of_its_scene(beam):
    """A fit to the damping ratios of the beam gives the values of its scene file."""
    values, half_widths = beam.fit_damping()
    force = 100 * np.exp(values[0] + half_widths[0] * np.array([0, -1, 1]))
    assert force == pytest.approx([19.4, 12.7, 29.5], abs=0.1)
    assert values[1:] == pytest.approx([-0.03, 1.41], abs=0.01)
    assert half_widths[1:] == pytest.approx([0.26, 0.095], abs=0.01)


@pytest.mark.parametrize("index", [0, 1])
def test_exact_beam_tables_agree_with_the_measured_files(beam, index):
    """The tables in the study agree with the published files of the beam."""
    file = FOLDER / beam.FILES[index]
    if not file.exists():
        pytest.skip(f"PATCHFEM_DATA names no folder with {file.name}")
    read, table = ((beam.read_hammer, beam.HAMMER), (beam.read_shaker, beam.SHAKER))[index]
    assert read(file) == pytest.approx(table, rel=1e-3, abs=1e-3 * index)


def test_always_titanium_study_gives_its_stated_depths_and_widths(wear):
    """Depths, widths and the fitted wear coefficient of the titanium tracks are those stated."""
    tracks = {track.name: track for track in wear.main()}
    deepest = tracks.pop("f_2")
    assert [1e6 * deepest.depth, 1e6 * deepest.depth_error] == pytest.approx([67.8, 0.1], abs=0.05)
    ratios = [track.half_width / track.measured for track in tracks.values()]
    assert [min(ratios), max(ratios)] == pytest.approx([1.56, 1.86], abs=5e-3)
    measured = [1e3 * track.measured for track in tracks.values()]
    assert [min(measured), max(measured)] == pytest.approx([1.85, 2.46], abs=5e-3)
    assert max(track.half_width_error / track.half_width for track in tracks.values()) < 0.025
    fit = wear.fit_depth()
    interval = [fit[name] for name in ("value", "low", "high")]
    assert interval == pytest.approx([1.00e-12, 0.95e-12, 1.05e-12], abs=5e-15)
    by_volume = wear.LOW_FREQUENCY[1].volume / wear.compute_work(wear.LOW_FREQUENCY[1])
    assert fit["value"] / by_volume == pytest.approx(3.4, abs=0.05)


def test_exact_wear_coefficients_of_titanium_from_volumes(wear):
    """Wear coefficients from volumes, and their scores for other tests, are those stated."""
    assert wear.fit_coefficient(wear.LOW_FREQUENCY) == pytest.approx(
        [4.23e-13, 3.70e-13, 4.84e-13], abs=5e-16
    )
    fast = wear.fit_coefficient((wear.FASTER_TESTS[5], *wear.EARLIER_FAST))
    assert fast == pytest.approx([1.04e-13, 0.91e-13, 1.18e-13], abs=1e-15)
    scores = wear.score_volumes()
    assert_contains(
        wear.__doc__,
        "scores {:.3f} for two repetitions".format(scores["repeated"][0]),
        "{:.3f} for two tests of an earlier series".format(scores["earlier, 0.11 Hz"][0]),
        "scores {:.3f} and {:.3f}".format(scores["repeated"][1], scores["earlier, 0.11 Hz"][1]),
        "the score is {:.2f} (constant: {:.2f})".format(*scores["1 to 5 Hz"]),
    )
    tests = (*wear.LOW_FREQUENCY, *wear.REPEATED_TESTS, *wear.FASTER_TESTS, *wear.OTHER_CONTACTS)
    ratios = [test.work / wear.compute_work(test) for test in tests]
    assert len(ratios) == 19 and [min(ratios), max(ratios)] == pytest.approx([0.65, 1.08], abs=5e-3)
    ratios_elsewhere = [fast[0] * test.work / test.volume for test in wear.OTHER_CONTACTS]
    assert [min(ratios_elsewhere), max(ratios_elsewhere)] == pytest.approx([0.36, 1.28], abs=5e-3)
    contact_depth = 1.9e-3**2 / (2 * 80e-3)
    assert [contact_depth, wear.PROFILE_DEPTH - contact_depth] == pytest.approx(
        [23e-6, 132e-6], abs=0.6e-6
    )
