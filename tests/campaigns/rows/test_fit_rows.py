"""Identification of rigs from measured rows: recovery of known rigs, and independence of rows held out."""

import numpy as np
import pytest
from command_line import run_cli
from measured_rows import make_linear_rows, write_rows

from patchfem import SceneError, run
from patchfem.campaigns.fits.problem import FitOptions, fit_keys
from patchfem.campaigns.fits.rows import RowsComparison
from patchfem.campaigns.rows.cells import read_response_table
from patchfem.campaigns.rows.condition_models import ConditionModels
from patchfem.campaigns.rows.model_readings import ModelReadings
from patchfem.core import G_N, PatchfemError
from patchfem.scene import BOUNDS_FORM, load, loads, read_assignments

LINEAR = """
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "140 Hz"
damping = 0.02
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "1 g"
cycles = 100
"""
RUBS = """
[normal]
load = "115 N"
[friction]
law = "elastic-plastic"
static = 0.4
bond_length = "0.5 um"
[structure]
moving_mass = "1.2 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[structure.bonded]
stiffness = "3e6 N/m"
damping = "900 N s/m"
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 400
"""


def write_and_load(tmp_path, text, *sets):
    """Write a scene into a folder and load it with settings."""
    path = tmp_path / "scene.toml"
    path.write_text(text, "utf-8")
    return load(path, sets)


def read_free_keys(*texts):
    """Return the ranges of the free keys."""
    found, wrong = read_assignments(texts, BOUNDS_FORM)
    assert not wrong
    return found


def fit_to_rows(scene, path, wanted, **beside):
    """Fit a scene to rows and return the result."""
    options = FitOptions(**{"starts": 2} | beside)
    return fit_keys(RowsComparison(scene, path, wanted), options)


def logs(found, computed):
    """Return ln(computed/measured) of the readings."""
    return found.comparison.cells.compute_logs(computed)


def score(found, group, *, only_stable=False):
    """Return the score of a group of readings, such as "fitted"."""
    return found.comparison.compute_scores(found, only_stable=only_stable)[group]["all"]


LINEAR_FREE = (
    "structure.mode.axial.frequency=120 Hz..160 Hz,structure.mode.axial.damping=0.005..0.2",
)


def test_exact_linear_rig_is_recovered_from_closed_form(tmp_path):
    """A fit to rows of an oscillator in closed form recovers frequency, damping and both gains within 1e-6."""
    gains = "measured.acceleration_gain=0.5..2", "measured.displacement_gain=0.5..2"
    found = fit_to_rows(
        write_and_load(tmp_path, LINEAR),
        write_rows(tmp_path, make_linear_rows(scale=1.3, seen=0.8)),
        read_free_keys(*LINEAR_FREE, *gains),
        starts=3,
    )
    assert found.fit.values == pytest.approx([141.0, 0.03, 1.3, 0.8], rel=1e-6)
    assert score(found, "fitted") < 1e-6


RUBS_FREE = ("friction.static=0.3..0.6,structure.bonded.stiffness=1e6 N/m..6e6 N/m",)
TRUE = {"friction.static": "0.45", "structure.bonded.stiffness": "2.4e6 N/m"}


@pytest.fixture(scope="module")
def friction_rows(tmp_path_factory):
    """Return rows of a rig with friction and known parameters, marched to its steady state."""
    out = []
    for f in (135.0, 143.0, 150.0):
        for level in (5.0, 7.0):
            sets = [f"{key}={text}" for key, text in TRUE.items()]
            one = run(
                loads(
                    RUBS, sets=[*sets, f"drive.frequency={f} Hz", f"drive.acceleration={level} g"]
                )
            )
            assert str(one.outcome) in ("steady", "stuck") and one.settings.engine == "event_driven"
            out.append(
                (
                    f,
                    level * G_N,
                    one.measures["absolute_acceleration_peak"].value,
                    one.measures["relative_displacement_amplitude"].value,
                    "",
                )
            )
    return out


@pytest.mark.slow
def test_always_held_out_rows_do_not_affect_fit(tmp_path):
    """Other values in rows held out or left out change neither the fit nor any of its starts."""
    scene = write_and_load(tmp_path, LINEAR)
    wanted = read_free_keys(*LINEAR_FREE)
    rows = make_linear_rows()
    other = [
        (f, level, a * 3, y / 2, flag) if f == 150 else (f, level, a, y, flag)
        for f, level, a, y, flag in rows
    ]
    first, second = (
        fit_to_rows(scene, write_rows(tmp_path, each), wanted, hold=("frequency=150 Hz",))
        for each in (rows, other)
    )
    assert np.array_equal(first.fit.values, second.fit.values)
    assert np.array_equal(first.fit.descent_rms, second.fit.descent_rms)
    assert not np.array_equal(
        first.computed / first.comparison.measured, second.computed / second.comparison.measured
    )
    one, two = (
        fit_to_rows(scene, write_rows(tmp_path, each), wanted, leave_out="frequency", starts=1)
        for each in (rows, other)
    )
    # the fit without 150 Hz does not see the changed readings, the other fits do
    is_changed = one.comparison.cells.conditions[one.comparison.cells.condition][:, 0] == 150
    change = logs(two, two.left_out) - logs(one, one.left_out)
    expected = np.where(one.comparison.cells.is_acceleration, -np.log(3), np.log(2))
    assert change[is_changed] == pytest.approx(expected[is_changed], abs=1e-12)
    assert np.abs(change[~is_changed]).min() > 0
    assert score(one, "left_out") < 1e-3 < score(two, "left_out")


def test_exact_fit_readings_equal_marched_rows(tmp_path, friction_rows):
    """The readings computed in a fit agree with marched rows within 1e-6, from cold and from nearby starts."""
    path = write_rows(tmp_path, friction_rows)
    cells = read_response_table(path)
    asked = ConditionModels(
        write_and_load(tmp_path, RUBS), cells.conditions, read_free_keys(*RUBS_FREE), path
    )
    assert any("steady motions are computed" in text for text in asked.notes)
    computed = ModelReadings(asked)
    cold = np.array(computed([0.45, 2.4e6], range(6)))
    assert (
        np.abs(cells.compute_logs(cells.select_computed(*cold))).max() < 1e-6
    )  # The tolerance is the remaining transient of the rows after 400 cycles.
    computed([0.46, 2.5e6], range(6))
    # These motions start from those at nearby values.
    assert np.array(computed([0.45, 2.4e6], range(6))) == pytest.approx(cold, rel=1e-9)


def test_exact_motion_that_comes_to_rest_slowly_has_readings(tmp_path):
    """An interface that slips less and less in hundreds of cycles has the readings of the motion at their end.

    The search for a periodic motion, which ends at a far smaller change per cycle, was given up, and the readings were those
    of a motion without a bound.
    """
    yaw = '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.28459483\n'
    text = RUBS.replace("[structure.bonded]", yaw + "[structure.bonded]")
    sets = (
        "normal.load=26 lbf",
        "friction.static=0.507092975",
        "friction.bond_length=0.243 um",
        "structure.moving_mass=1.19396625 kg",
        "structure.bonded.stiffness=9.55417327e6 N/m",
        "structure.bonded.damping=720.798064 N s/m",
    )
    scene = write_and_load(tmp_path, text, *sets, "drive.cycles=2000")
    marched = run(scene).measures
    names = ("absolute_acceleration_peak", "relative_displacement_amplitude")
    expected = [marched[name].value for name in names]
    path = write_rows(tmp_path, [(143.0, 5 * G_N, *expected, "")])
    wanted = read_free_keys("friction.static=0.2..0.8")
    models = ConditionModels(scene, read_response_table(path).conditions, wanted, path)
    readings = ModelReadings(models)([0.507092975], [0])
    assert readings[:, 0] == pytest.approx(expected, rel=1e-5)


def test_exact_rows_flagged_u_are_lower_bounds(tmp_path):
    """A computed response above a row flagged U has no residual; below it the residual is that of any row."""
    path = write_rows(
        tmp_path, [(*row[:4], "U" if row[0] == 143 else "") for row in make_linear_rows()]
    )
    scene = write_and_load(tmp_path, LINEAR)
    comparison = RowsComparison(scene, path, read_free_keys(*LINEAR_FREE))
    unstable = comparison.cells.unstable
    for damping, is_above in ((0.01, True), (0.1, False)):
        computed = comparison.compute([141.0, damping], np.ones(unstable.size, bool))
        ratios = comparison.cells.compute_logs(computed)
        found = comparison.compare(computed)
        assert np.all(ratios[unstable] > 0) == is_above
        assert np.array_equal(found, np.where(unstable, np.minimum(ratios, 0), ratios))
    stable = fit_to_rows(scene, path, read_free_keys(*LINEAR_FREE), starts=1)
    ratios = logs(stable, stable.computed)[~unstable]
    stable_score = score(stable, "fitted", only_stable=True)
    assert stable_score == pytest.approx(np.sqrt(np.mean(ratios**2)))
    assert stable_score != score(stable, "fitted")


def test_always_unbounded_motion_has_capped_residual(tmp_path):
    """A rig without a bounded motion gets a residual of log 1000 and a warning, and the fit does not fail."""
    text = RUBS.replace("elastic-plastic", "coulomb").replace('bond_length = "0.5 um"\n', "")
    text = text.replace("damping = 0.003", "damping = 0.0").replace(
        text[text.index("[structure.bonded]") : text.index("[drive]")], ""
    )
    path = write_rows(
        tmp_path, [(143.0, 8 * G_N, 9 * G_N, 2e-5, ""), (150.0, 4 * G_N, 5 * G_N, 1e-5, "")]
    )
    found = fit_to_rows(
        write_and_load(tmp_path, text, "friction.static=0.2"),
        path,
        read_free_keys("measured.acceleration_gain=0.5..2"),
        starts=1,
    )
    assert found.fit.counts.failures == 0
    assert any("no bounded motion is found at 143 Hz" in text for text in found.warnings)
    assert np.abs(logs(found, found.computed)).max() == pytest.approx(np.log(1e3))


@pytest.mark.parametrize(
    "sets, wanted, match",
    [
        (["drive.waveform=step"], LINEAR_FREE, "under a sine of the base"),
        ([], ("drive.cycles=10..20",), "the rows of the file give the drive"),
        ([], (*LINEAR_FREE, "structure.moving_mass=1 kg..2 kg"), "needs more than 3"),
    ],
)
def test_refuses_keys_that_rows_do_not_determine(tmp_path, sets, wanted, match):
    """Free keys that the rows cannot determine are refused."""
    path = write_rows(
        tmp_path,
        [(143.0, 20.0, 30.0, "", ""), (150.0, 20.0, 30.0, "", ""), (155.0, 20.0, 30.0, "", "")],
    )
    with pytest.raises((PatchfemError, SceneError), match=match):
        fit_to_rows(write_and_load(tmp_path, LINEAR, *sets), path, read_free_keys(*wanted))


@pytest.mark.parametrize(
    "words, message",
    [
        (["--leave-out", "displacement"], "no column"),
        (["--leave-out", "input"], "leaves no rows"),
    ],
)
def test_refuses_unsuitable_rows_options(tmp_path, words, message):
    """Options that do not apply to a fit to rows are refused before any file is written."""
    scene = write_and_load(tmp_path, LINEAR).path
    rows = write_rows(tmp_path, make_linear_rows())
    answer = run_cli(
        "fit", scene, "--to", rows, "--free", *LINEAR_FREE, "-o", tmp_path / "out", *words
    )
    assert answer.code == 2 and message in answer.err
    assert not (tmp_path / "out").exists() and not (tmp_path / "out.partial").exists()


def test_exact_fit_uses_reading_and_gains_of_scene(tmp_path):
    """A fit uses the reading (rms) and the gains of the scene."""
    path = write_rows(tmp_path, make_linear_rows(scale=1.3 / np.sqrt(2), seen=0.8))
    scene = write_and_load(
        tmp_path,
        LINEAR,
        "measured.file=rows.csv",
        "measured.acceleration_gain=1.3",
        "measured.reading=rms",
        "measured.displacement_gain=0.8",
    )
    fit = fit_to_rows(scene, path, read_free_keys(*LINEAR_FREE), starts=1)
    assert fit.fit.values == pytest.approx([141.0, 0.03], rel=1e-4)
