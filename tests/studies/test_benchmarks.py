"""Benchmarks against published measurements: the figures in the docstrings of the studies."""

import os
import tomllib
from pathlib import Path

import numpy as np
import pytest
from study_module import assert_contains, make_study_fixture

import patchfem

beam = make_study_fixture("benchmarks/brake_reuss.py")
wear = make_study_fixture("benchmarks/ti64_wear.py")
SCENE_FOLDER = Path(patchfem.__file__).parent / "scene"
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
    assert scores == pytest.approx([0.016, 0.159], abs=5e-4)
    assert [compute_rms(difference[test]) for test in rows] == pytest.approx(
        [0.019, 0.392], abs=5e-4
    )
    assert [min(ratio["shaker"]), max(ratio["shaker"])] == pytest.approx([0.84, 1.30], abs=5e-3)
    first, last = rows["hammer"][0], rows["hammer"][-1]
    assert first.frequency - last.frequency == pytest.approx(0.195, abs=5e-4)
    assert first.measured_frequency - last.measured_frequency == pytest.approx(0.199)
    assert beam.score_lines()[0] == pytest.approx(0.158, abs=5e-4)
    mean = beam.HAMMER.mean(axis=0)
    assert beam.damping_score(mean[2], beam.SHAKER[:, 3]) == pytest.approx(0.77, abs=5e-3)
    assert compute_rms(beam.SHAKER[:, 1] - mean[1]) == pytest.approx(0.19, abs=5e-3)
    assert compute_rms(beam.HAMMER[:, 1] - mean[1]) == pytest.approx(0.057, abs=5e-4)
    all_rows = [*rows["hammer"], *rows["shaker"]]
    assert max(r.frequency_error for r in all_rows) < 3e-5
    assert max(r.damping_error / r.damping for r in all_rows) < 3e-4


def test_beam_data_do_not_determine_the_stiffness_of_the_joint(beam):
    """In micro-slip, a stiffer joint with a larger slip force gives the same frequencies and damping.

    The energy per cycle depends on stiffness^(2 + chi) / slip force^(1 + chi) (Segalman 2005).
    """
    friction = tomllib.loads(beam.SCENE.read_text("utf-8"))["friction"]
    chi = friction["chi"]
    factor = 2 ** ((2 + chi) / (1 + chi))
    assert factor == pytest.approx(4.1, abs=0.05)
    stiffness = float(friction["stiffness"].split()[0])
    sets = {
        "friction.stiffness": f"{2 * stiffness!r} N/m",
        "friction.static": factor * friction["static"],
    }
    amplitudes = np.sort(np.r_[beam.HAMMER[:, 0], beam.SHAKER[:, 0]])[::3]
    curve = beam.compute_curve(amplitudes)
    other = beam.compute_curve(amplitudes, **sets)
    assert np.abs(other[:, 0] - curve[:, 0]).max() < 1e-5
    assert other[:, 2] == pytest.approx(curve[:, 2], rel=2e-4)


@pytest.mark.slow
def test_beam_fit_gives_the_values_of_its_scene(beam):
    """A fit to the damping ratios of the beam gives the values of its scene file and docstring."""
    values, half_widths = beam.fit_damping()
    scene = tomllib.loads(beam.SCENE.read_text("utf-8"))
    mode = scene["structure"]["mode"][0]
    load = float(scene["normal"]["load"].split()[0])
    assert np.exp(values[0]) == pytest.approx(scene["friction"]["static"], rel=5e-4)
    assert values[1] == pytest.approx(scene["friction"]["chi"], abs=2e-4)
    assert values[2] == pytest.approx(1e3 * mode["damping"], rel=5e-4)
    force = load * np.exp(values[0] + half_widths[0] * np.array([0, -1, 1]))
    assert force == pytest.approx([19.3, 12.9, 29.1], abs=0.1)
    assert values[1] == pytest.approx(-0.034, abs=5e-4)
    assert values[1] - half_widths[1] == pytest.approx(-0.29, abs=5e-3)
    assert values[1] + half_widths[1] > 0
    assert values[2] + half_widths[2] * np.array([0, -1, 1]) == pytest.approx(
        [1.41, 1.31, 1.50], abs=5e-3
    )


def find_record(name):
    """Return the path of a published file; skip the test if there is none."""
    file = FOLDER / name
    if not file.exists():
        pytest.skip(f"PATCHFEM_DATA names no folder with {name}")
    return file


def test_exact_hammer_table_agrees_with_the_measured_file(beam):
    """The table of the hammer test agrees with the published file to its printed digits."""
    rows = beam.read_hammer(find_record(beam.FILES[0]))
    assert (np.abs(rows - beam.HAMMER) <= 0.51 * np.array([1e-8, 1e-3, 1e-6])).all()


def test_exact_shaker_table_agrees_with_the_measured_file(beam):
    """The table of the shaker test agrees with the published file to its printed digits."""
    rows = beam.read_shaker(find_record(beam.FILES[1]))
    digits = np.tile([1e-7, 1e-3, 1e-3, 1e-6, 1e-6], (len(rows), 1))
    digits[:2, 0] = 1e-8
    assert (np.abs(rows - beam.SHAKER) <= 0.51 * digits).all()


def test_exact_accelerometers_agree(beam):
    """Two accelerometers of the hammer test give the frequencies and damping stated."""
    file = find_record(beam.FILES[0])
    one, three = (beam.read_hammer(file, name) for name in ("acc1", "acc3"))
    assert np.abs(one[:, 1] - three[:, 1]).max() < 0.003
    assert np.abs(one[:, 2] / three[:, 2] - 1).max() < 0.012


@pytest.mark.slow
def test_always_titanium_study_gives_its_stated_depths_and_widths(wear):
    """Depths, widths and the fitted wear coefficient of the titanium tracks are those stated."""
    tracks = {track.name: track for track in wear.main()}
    profile = tracks.pop("profile")
    assert [1e6 * profile.depth, 1e6 * profile.depth_error] == pytest.approx([74.0, 0.1], abs=0.05)
    assert [1e3 * profile.half_width, 1e3 * profile.half_width_error] == pytest.approx(
        [3.55, 0.12], abs=6e-3
    )
    assert len(tracks) == 5
    deep = wear.PROFILE.depth / profile.depth
    wide = wear.PROFILE.half_width / profile.half_width
    ratios = np.array([track.half_width / track.measured for track in tracks.values()])
    assert [min(ratios), max(ratios)] == pytest.approx([1.56, 1.86], abs=5e-3)
    for text in (wear.__doc__, (SCENE_FOLDER / "LIMITS.md").read_text("utf-8")):
        assert_contains(
            text,
            f"{deep:.1f} times as deep and {wide:.2f} times as wide",
            f"{min(1 / ratios):.2f} to {max(1 / ratios):.2f} times as wide",
        )
    measured = [1e3 * track.measured for track in tracks.values()]
    assert [min(measured), max(measured)] == pytest.approx([1.85, 2.46], abs=5e-3)
    assert max(track.half_width_error / track.half_width for track in tracks.values()) < 0.025
    by_depth = wear.fit_depth()
    assert by_depth == pytest.approx([1.00e-12, 0.95e-12, 1.05e-12], abs=5e-15)
    by_volume = wear.PROFILE.test.volume / wear.compute_work(wear.PROFILE.test)
    assert by_volume == pytest.approx(3.4e-13, abs=5e-15)
    assert by_depth[0] / by_volume == pytest.approx(3.0, abs=0.05)


def test_exact_wear_coefficients_of_titanium_from_volumes(wear):
    """Wear coefficients from volumes, and their scores for other tests, are those stated."""
    assert wear.fit_coefficient(wear.LOW_FREQUENCY) == pytest.approx(
        [4.23e-13, 3.70e-13, 4.84e-13], abs=5e-16
    )
    slow = wear.fit_coefficient(wear.LOW_FREQUENCY)[0]
    fast = wear.fit_coefficient(wear.tests_at_5_hz())
    assert fast == pytest.approx([1.04e-13, 0.91e-13, 1.18e-13], abs=1e-15)
    scores = wear.score_volumes()
    assert_contains(
        wear.__doc__,
        "scores {:.3f} for two further tests".format(scores["further"][0]),
        "{:.3f} for two tests of an earlier series".format(scores["earlier, 0.11 Hz"][0]),
        "scores {:.3f} and {:.3f}".format(scores["further"][1], scores["earlier, 0.11 Hz"][1]),
        "the score is {:.2f} (constant: {:.2f})".format(*scores["1 to 5 Hz"]),
    )
    tests = (*wear.LOW_FREQUENCY, *wear.FURTHER_TESTS, *wear.FASTER_TESTS, *wear.OTHER_CONTACTS)
    ratios = [test.work / wear.compute_work(test) for test in tests]
    assert len(ratios) == 19 and [min(ratios), max(ratios)] == pytest.approx([0.65, 1.08], abs=5e-3)
    ratios_elsewhere = [fast[0] * test.work / test.volume for test in wear.OTHER_CONTACTS]
    assert [min(ratios_elsewhere), max(ratios_elsewhere)] == pytest.approx([0.36, 1.28], abs=5e-3)
    assert [test.frequency for test in wear.tests_at_5_hz()] == [5] * 6
    ratios_at_5_hz = [slow * test.work / test.volume for test in wear.tests_at_5_hz()]
    assert [min(ratios_at_5_hz), max(ratios_at_5_hz)] == pytest.approx([3.3, 4.8], abs=0.05)
