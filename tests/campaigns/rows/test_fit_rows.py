"""Rigs identified from rows of responses: tables made by known rigs, and what a fit may not see."""

import csv
import json

import numpy as np
import pytest
from command_line import run_cli

import patchfem as pf
from patchfem import SceneError, build, run
from patchfem.campaigns import FitRequest, RowsOptions, fit_rows
from patchfem.campaigns.rows.cells import read_readings
from patchfem.campaigns.rows.computed import ModelReadings
from patchfem.campaigns.rows.condition_models import ConditionModels
from patchfem.campaigns.rows.fit import SearchSettings
from patchfem.campaigns.rows.search import make_residual
from patchfem.core import G_N, PatchfemError
from patchfem.export.fits.rows import SearchCheckpoint, rows_fit_data
from patchfem.runs import MotionObserver
from patchfem.scene import load, loads, read_ranges

MIL = 25.4e-6
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
HEAD = "frequency [Hz],input [g],acceleration [g],displacement [mil],flag\n"


def scene_of(tmp_path, text, *sets):
    path = tmp_path / "scene.toml"
    path.write_text(text, "utf-8")
    return load(path, sets)


def table(tmp_path, rows, name="rows.csv"):
    """A CSV of (frequency [Hz], input [m s-2], acceleration [m s-2], displacement [m], flag), "" where nothing is."""
    path = tmp_path / name
    lines = [
        f"{f!r},{a / G_N!r},{_cell(x, G_N)},{_cell(y, MIL)},{flag}" for f, a, x, y, flag in rows
    ]
    path.write_text(HEAD + "\n".join(lines) + "\n", "utf-8")
    return path


def _cell(value, unit):
    return value if value == "" else repr(float(value) / unit)


def linear(f, level, own=141.0, zeta=0.03):
    """(absolute acceleration, relative displacement) of a driven oscillator in closed form."""
    w = 2 * np.pi * f
    wn = 2 * np.pi * own
    z = -level / (wn**2 - w**2 + 2j * zeta * wn * w)
    return float(abs(level - w**2 * z)), float(abs(z))


def free(*texts):
    found, wrong = read_ranges(texts)
    assert not wrong
    return found


def fitted(scene, path, wanted, **beside):
    how = SearchSettings(
        beside.pop("starts", 2), beside.pop("seed", 0), beside.pop("unstable", "bound")
    )
    return fit_rows(FitRequest(scene, wanted, path), RowsOptions(search=how, **beside))


LINEAR_FREE = (
    "structure.mode.axial.frequency=120 Hz..160 Hz,structure.mode.axial.damping=0.005..0.2",
)


def linear_rows(noise=0.0, scale=1.0, seed=1, seen=1.0):
    draw = np.random.default_rng(seed)
    out = []
    for f in (120.0, 135.0, 143.0, 150.0, 160.0):
        a, y = linear(f, 20.0)
        spread = np.exp(noise * draw.standard_normal(2))
        out.append((f, 20.0, a * scale * spread[0], y * seen * spread[1], ""))
    return out


def test_exact_a_linear_rig_is_recovered_from_closed_forms(tmp_path):
    """Rows of an oscillator in closed form give back its frequency, its damping and the factors of both readings."""
    gains = "measured.acceleration_gain=0.5..2", "measured.displacement_gain=0.5..2"
    found = fitted(
        scene_of(tmp_path, LINEAR),
        table(tmp_path, linear_rows(scale=1.3, seen=0.8)),
        free(*LINEAR_FREE, *gains),
        starts=3,
    )
    assert found.keys.fit.values == pytest.approx([141.0, 0.03, 1.3, 0.8], rel=1e-6)
    assert rows_fit_data(found)["reading"] == {
        "reading": "peak",
        "reading_cutoff": None,
        "acceleration_gain": found.keys.fit.values[2],
        "displacement_gain": found.keys.fit.values[3],
    }
    assert found.score(found.logs, found.left_out_logs)["fitted"]["all"] < 1e-6


def test_intervals_of_a_linear_rig_hold_the_truth(tmp_path):
    """Of 10 noisy tables 95 % intervals of two values hold the truth in 16 of 20 cases or more: less has a chance of
    0.3 %."""
    held = 0
    for seed in range(10):
        path = table(tmp_path, linear_rows(0.05, seed=seed))
        found = fitted(scene_of(tmp_path, LINEAR), path, free(*LINEAR_FREE), starts=1)
        ends = found.keys.fit.intervals.ends
        held += sum(low <= value <= high for (low, high), value in zip(ends, (141.0, 0.03)))
    assert held >= 16


RUBS_FREE = ("friction.static=0.3..0.6,structure.bonded.stiffness=1e6 N/m..6e6 N/m",)
TRUE = {"friction.static": "0.45", "structure.bonded.stiffness": "2.4e6 N/m"}


@pytest.fixture(scope="module")
def rubbed(tmp_path_factory):
    """Rows of a rubbing rig with known values, marched to its steady motion from yield to yield."""
    out = []
    for f in (135.0, 143.0, 150.0):
        for level in (5.0, 7.0):
            sets = [f"{key}={text}" for key, text in TRUE.items()]
            one = run(
                loads(
                    RUBS, sets=[*sets, f"drive.frequency={f} Hz", f"drive.acceleration={level} g"]
                )
            )
            assert str(one.outcome) in ("steady", "stuck") and one.extra["engine"] == "piecewise"
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


def test_exact_a_rig_with_friction_is_recovered_from_its_own_rows(tmp_path, rubbed):
    found = fitted(scene_of(tmp_path, RUBS), table(tmp_path, rubbed), free(*RUBS_FREE), starts=1)
    assert found.keys.fit.values == pytest.approx([0.45, 2.4e6], rel=1e-5)
    assert any("steady motions are computed" in text for text in found.keys.warnings)


def test_always_rows_held_out_or_left_out_do_not_change_the_fit(tmp_path, rubbed):
    """Other readings in the rows held out, and in those left out, change no bit of the values, nor of any start."""
    scene = scene_of(
        tmp_path, RUBS, f"structure.bonded.stiffness={TRUE['structure.bonded.stiffness']}"
    )
    wanted = free("friction.static=0.3..0.6")
    rows = rubbed[1::2]
    other = [
        (f, level, a * 3, y / 2, flag) if f == 150 else (f, level, a, y, flag)
        for f, level, a, y, flag in rows
    ]
    first, second = (
        fitted(scene, table(tmp_path, each), wanted, hold=("frequency=150 Hz",))
        for each in (rows, other)
    )
    assert np.array_equal(first.keys.fit.values, second.keys.fit.values)
    assert np.array_equal(first.search.ends, second.search.ends) and np.array_equal(
        first.search.rms, second.search.rms
    )
    assert not np.array_equal(first.logs, second.logs)
    one, two = (
        fitted(scene, table(tmp_path, each), wanted, leave_out="frequency", starts=1)
        for each in (rows, other)
    )
    assert [fold.name for fold in one.folds] == ["135 Hz", "143 Hz", "150 Hz"]
    assert np.array_equal(one.folds[2].search.fit.values, two.folds[2].search.fit.values)
    assert not np.array_equal(one.folds[0].search.fit.values, two.folds[0].search.fit.values)
    assert (
        one.score(one.logs, one.left_out_logs)["left_out"]["all"]
        < 1e-3
        < two.score(two.logs, two.left_out_logs)["left_out"]["all"]
    )


def test_exact_a_watched_motion_is_that_of_a_run(tmp_path, rubbed):
    path = table(tmp_path, rubbed)
    cells = read_readings(path)
    asked = ConditionModels(scene_of(tmp_path, RUBS), cells.conditions, free(*RUBS_FREE), path)
    computed = ModelReadings(asked)
    cold = np.array(computed([0.45, 2.4e6], range(6)))
    assert np.abs(cells.logs(*cold)).max() < 1e-6  # marched rows: 400 cycles leave that much
    computed([0.46, 2.5e6], range(6))
    # from motions nearby
    assert np.array(computed([0.45, 2.4e6], range(6))) == pytest.approx(cold, rel=1e-9)


def test_exact_a_marched_motion_is_watched_as_it_runs():
    """Nothing is kept from before the window, and no bit of what is measured in it changes."""
    model = build(
        loads(
            RUBS, sets=["accuracy.method=march", "accuracy.steps_per_cycle=40", "drive.cycles=30"]
        )
    )
    seen = MotionObserver(model, None)(model.rig.drive.signal)
    measures = run(model).measures
    assert seen.acceleration == measures["absolute_acceleration_peak"].value
    assert seen.displacement == measures["relative_displacement_amplitude"].value


def test_rows_flagged_u_are_lower_bounds(tmp_path):
    """A computed response above a bound counts nothing, below it as any other; a row left out counts nothing."""
    path = table(tmp_path, [(*row[:4], "U" if row[0] == 143 else "") for row in linear_rows()])
    cells = read_readings(path)
    scene = scene_of(tmp_path, LINEAR)
    computed = ModelReadings(ConditionModels(scene, cells.conditions, free(*LINEAR_FREE), path))
    every = np.ones(cells.row.size, bool)
    for damping, is_above in ((0.01, True), (0.1, False)):
        logs = cells.logs(*computed([141.0, damping], range(5)))
        found = {
            what: make_residual(cells, computed, every, what)([141.0, damping])
            for what in ("bound", "out", "read")
        }
        assert np.array_equal(found["read"], logs) and np.array_equal(
            found["out"], logs[~cells.unstable]
        )
        assert np.all(logs[cells.unstable] > 0) == is_above
        assert np.array_equal(found["bound"], np.where(cells.unstable, np.minimum(logs, 0), logs))
    stable = fitted(scene, path, free(*LINEAR_FREE), starts=1)
    whole, without = (
        stable.score(stable.logs, stable.left_out_logs, stable=part)["fitted"]
        for part in (False, True)
    )
    assert without["all"] == pytest.approx(np.sqrt(np.mean(stable.logs[~cells.unstable] ** 2)))
    assert whole != without


@pytest.mark.parametrize(
    "wanted",
    [
        "measured.acceleration_gain=0.5..2",
        pytest.param("friction.static=0.1..0.3", marks=pytest.mark.slow),
    ],
)
def test_a_motion_without_a_bound_counts_as_a_thousand(tmp_path, wanted):
    """A rigid block whose friction is too weak to hold an undamped spring runs away: said, and no failure."""
    text = RUBS.replace("elastic-plastic", "coulomb").replace('bond_length = "0.5 um"\n', "")
    text = text.replace("damping = 0.003", "damping = 0.0").replace(
        text[text.index("[structure.bonded]") : text.index("[drive]")], ""
    )
    path = table(
        tmp_path, [(143.0, 8 * G_N, 9 * G_N, 2e-5, ""), (150.0, 4 * G_N, 5 * G_N, 1e-5, "")]
    )
    found = fitted(scene_of(tmp_path, text, "friction.static=0.2"), path, free(wanted), starts=1)
    assert found.keys.fit.counts.failures == 0
    assert any("no bounded motion is found at 143 Hz" in text for text in found.keys.warnings)
    assert np.abs(found.logs).max() == pytest.approx(np.log(1e3))


@pytest.mark.parametrize(
    "sets, wanted, match",
    [
        (["drive.waveform=step"], LINEAR_FREE, "under a sine of the base"),
        ([], ("drive.cycles=10..20",), "the rows of the file give the drive"),
        ([], (*LINEAR_FREE, "structure.moving_mass=1 kg..2 kg"), "too few to determine 3 values"),
    ],
)
def test_refuses_what_rows_do_not_speak_of(tmp_path, sets, wanted, match):
    path = table(
        tmp_path,
        [(143.0, 20.0, 30.0, "", ""), (150.0, 20.0, 30.0, "", ""), (155.0, 20.0, 30.0, "", "")],
    )
    with pytest.raises((PatchfemError, SceneError), match=match):
        fitted(scene_of(tmp_path, LINEAR, *sets), path, free(*wanted))


def test_the_verb_answers_as_the_contract_says(tmp_path):
    out = tmp_path / "out"
    rows = linear_rows(0.02)
    given = [
        "fit",
        str(scene_of(tmp_path, LINEAR).path),
        "--to",
        str(table(tmp_path, rows)),
        "--free",
        *LINEAR_FREE,
        "--hold",
        "frequency=160 Hz",
        "--starts",
        "2",
        "--leave-out",
        "frequency",
        "-o",
        str(out),
    ]
    code, text, said = run_cli(*given)
    assert code == 0, said
    answer = json.loads((out / "fit.json").read_text())
    one = answer["values"]["structure.mode.axial.frequency"]
    assert one["low"] < one["value"] < one["high"] and one["unit"] == "Hz"
    assert set(answer["nulls"]) == {"constant", "power_input", "power_input_frequency"}
    for scores in (answer["scores"], answer["scores_stable"], *answer["nulls"].values()):
        assert all(
            set(scores[part]) == {"acceleration", "displacement", "all"}
            for part in ("fitted", "held_out", "left_out")
        )
    assert [fold["left_out"] for fold in answer["folds"]] == [
        "120 Hz",
        "135 Hz",
        "143 Hz",
        "150 Hz",
    ]
    assert "null power_input_frequency" in text and "held out" in text
    with open(out / "fit.csv", newline="", encoding="utf-8") as file:
        written = list(csv.DictReader(file))
    damping = answer["values"]["structure.mode.axial.damping"]["value"]
    for row, (f, level, a, y, _) in zip(written, rows, strict=True):
        computed = linear(f, level, one["value"], damping)
        for name, unit, value, wanted in (
            ("acceleration [g]", G_N, a, computed[0]),
            ("displacement [mil]", MIL, y, computed[1]),
        ):
            assert float(row[name]) == pytest.approx(value / unit, rel=1e-5)
            assert float(row[f"computed {name}"]) == pytest.approx(wanted / unit, rel=1e-4)
        assert row["held"] == ("1" if f == 160 else "0")
    again = pf.run(out / "scene.fitted.toml").measures["absolute_acceleration_peak"].value
    assert again == pytest.approx(linear(143.0, G_N, one["value"], damping)[0], rel=1e-4)


def test_exact_a_fit_goes_on_from_the_starts_that_are_done(tmp_path):
    """With the ends of all starts, or of the first alone, kept on disk: the same bits with less work; those of another
    question count for nothing."""
    scene = scene_of(tmp_path, LINEAR)
    path = table(tmp_path, linear_rows(0.05))
    wanted = free(*LINEAR_FREE)
    file = tmp_path / "starts.json"

    def go(question, resume):
        how = SearchSettings(2, 0, "bound", SearchCheckpoint(file, question, resume))
        return fit_rows(FitRequest(scene, wanted, path), RowsOptions(search=how))

    first = go("one", False)
    again = go("one", True)
    kept = json.loads(file.read_text())
    kept["ends"].pop("all/1")
    file.write_text(json.dumps(kept))
    half = go("one", True)
    other = go("other", True)
    assert again.n_motions < half.n_motions < first.n_motions == other.n_motions
    for one in (again, half, other):
        assert np.array_equal(one.keys.fit.values, first.keys.fit.values)
        assert np.array_equal(one.search.rms, first.search.rms)


@pytest.mark.parametrize("text", ["[]", "3", "{", "[" * 100_000, '{"ends": {"all/0": [[1], 2]}}'])
def test_exact_starts_of_another_shape_count_for_nothing(tmp_path, text):
    """The first two once ended `fit --resume` with an internal fault."""
    (tmp_path / "starts.json").write_text(text)
    assert SearchCheckpoint(tmp_path / "starts.json", "one", True).known == {}


def test_placebos_are_complete_fits(tmp_path):
    """The rows of a rig with a damping of 0.03, fitted with it and with another."""
    scene = scene_of(tmp_path, LINEAR, "structure.mode.axial.damping=0.03")
    found = fitted(
        scene,
        table(tmp_path, linear_rows()),
        free("structure.mode.axial.frequency=120 Hz..160 Hz"),
        placebos=("structure.mode.axial.damping=0.03,0.1",),
        starts=1,
    )
    own, other = found.placebos
    assert own.text == "structure.mode.axial.damping=0.03"
    assert other.text == "structure.mode.axial.damping=0.1"
    assert own.search.fit.values == pytest.approx(found.keys.fit.values, rel=1e-12)
    rms = [float(np.sqrt(np.mean(one.logs**2))) for one in (own, other)]
    assert rms[0] < 1e-6 and rms[1] > 0.1


@pytest.mark.parametrize(
    "words, said",
    [
        (["--offset", "force"], "applies only to fits to a loop"),
        (["--starts", "0"], "at least one"),
        (["--placebo", "friction.static"], "table.key=value,value"),
        (["--leave-out", "displacement"], "no column"),
        (["--placebo", "structure.mode.axial.damping=0.01,0.2"], "already fits this key"),
        (["--placebo", "drive.frequency=140 Hz"], "the rows of the file give the drive"),
        (["--placebo", "structure.mode.axial.slide=1,x"], "a plain number is needed"),
        (["--leave-out", "input"], "leaves no rows"),
        (["--unstable", "maybe"], "unstable"),
    ],
)
def test_refuses_options_that_rows_do_not_have(tmp_path, words, said):
    given = [
        "fit",
        str(scene_of(tmp_path, LINEAR).path),
        "--to",
        str(table(tmp_path, linear_rows())),
        "--free",
        *LINEAR_FREE,
        "-o",
        str(tmp_path / "out"),
        *words,
    ]
    code, _, err = run_cli(*given)
    assert code == 2 and said in err
    assert not (tmp_path / "out").exists() and not (tmp_path / "out.partial").exists()


def test_exact_the_reading_and_the_gain_of_the_scene_are_those_of_the_instruments(tmp_path):
    """A root mean square of a sine is its peak over sqrt 2; the seed says where the starts are."""
    path = table(tmp_path, linear_rows(scale=1.3 / np.sqrt(2), seen=0.8))
    scene = scene_of(
        tmp_path,
        LINEAR,
        "measured.file=rows.csv",
        "measured.acceleration_gain=1.3",
        "measured.reading=rms",
        "measured.displacement_gain=0.8",
    )
    one, two = (fitted(scene, path, free(*LINEAR_FREE), starts=1, seed=seed) for seed in (0, 1))
    assert one.keys.fit.values == pytest.approx([141.0, 0.03], rel=1e-4)
    assert not np.array_equal(one.search.starts, two.search.starts)
