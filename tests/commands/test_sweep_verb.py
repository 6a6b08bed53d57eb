"""`patchfem sweep`: cases, tables, refusals, commands that repeat a sweep, and plans."""

import json

import numpy as np
import pytest
import xarray as xr
from command_line import read_json, run_cli, run_successfully
from scene_texts import COULOMB, POINT, SHORT
from sweep_tables import read_rows

import patchfem as pf
from patchfem.export import runs, store

RIG = POINT + COULOMB + SHORT
LOADS, LEVELS = ["10 N", "26 lbf", "-1 N"], ["1 g", "5 g"]
OVER = ("--over", f"normal.load={','.join(LOADS)}", "--over", "drive.acceleration=1 g..5 g:2")


@pytest.fixture(scope="module")
def rig_scene(tmp_path_factory):
    """Return the path of a rig scene."""
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def whole_sweep(rig_scene):
    """Return the folder and the answer of a sweep with two refused cases."""
    out = rig_scene.parent / "swept"
    return out, sweep_into(out, rig_scene, *OVER)


def assert_equals_single_run(found, measure, part="value", tolerance=1e-12) -> None:
    """Assert that a cell equals a single run within a tolerance, and is empty where that is unknown."""
    single = getattr(measure, part)
    # scale of the measures: 1 for a distortion, 1 mm for the drift of an amplitude
    size = {"1": 1.0, "m": 1e-3}.get(measure.unit, 0.0)
    assert (found in ("", None)) == (single is None)
    assert single is None or float(found) == pytest.approx(single, rel=tolerance, abs=1e-12 * size)


def sweep_into(out, rig_scene, *words):
    """Sweep a scene into a folder with the command line, and return the answer."""
    return run_cli("sweep", rig_scene, *words, "-o", out, "--no-page")


def test_exact_sweep_case_equals_single_run(whole_sweep, rig_scene):
    """Every case of a sweep has the measures of a single run within 1e-12, and the same warnings and effects."""
    out, answer = whole_sweep
    assert answer.code == 3  # exit code 3: two cases were refused
    found = read_rows(out)
    assert [(row["normal.load"], row["drive.acceleration"]) for row in found] == [
        (load, level) for load in LOADS for level in LEVELS
    ]
    for row in found[:4]:
        sets = {"normal.load": row["normal.load"], "drive.acceleration": row["drive.acceleration"]}
        single = pf.run(rig_scene, **sets)
        sentences = [single.outcome.sentence] if single.outcome == "transient" else []
        sentences += [finding.sentence for finding in single.findings]
        assert row["outcome"] == single.outcome and row["message"] == " ".join(sentences)
        stored = read_json(out / "cases" / row["case"] / "summary.json")
        assert (
            stored["case"] == sets
            and stored["kind"] == "rig"
            and stored["outcome"] == single.outcome
        )
        assert stored["warnings"] == single.warnings and stored["notes"] == single.notes
        expected = json.loads(json.dumps(store.make_summary(runs.make_run_answer(single))))
        # a case of a batch does not store the method of each measure
        del expected["numerics"]["measures"]
        for part in ("patchfem", "title", "not_in_scene", "numerics"):
            assert stored[part] == expected[part]
        effects, others = (
            [(entry["effect"], entry["equations"]) for entry in summary["effects"]]
            for summary in (stored, expected)
        )
        assert effects == others and 0 < stored["seconds"]["total"] < 60
        for name, measure in single.measures.items():
            entry = stored["measures"][name]
            for column, part in ((name, "value"), (f"{name}_error", "error")):
                # errors have six digits in the table
                tolerance = 1e-12 if part == "value" else 1e-5
                assert_equals_single_run(row[column], measure, part, tolerance)
                assert_equals_single_run(entry[part], measure, part)
            assert entry.get("reason", "") == measure.reason


def test_refuses_to_resume_different_sweep(rig_scene, tmp_path):
    """A folder with a finished sweep of another scene or other keys is refused by --resume and stays unchanged."""
    out = tmp_path / "out"
    over = ("--over", "normal.load=10 N,20 N")
    assert sweep_into(out, rig_scene, *over).code == 0
    before = {one.relative_to(out): one.read_bytes() for one in out.rglob("*") if one.is_file()}
    for words, why in (
        (
            (*over, "--set", "friction.static=0.31"),
            "a sweep of another scene or version",
        ),
        (
            ("--over", "drive.cycles=3,4"),
            "a sweep of another scene or version, or of other keys (it has normal.load)",
        ),
    ):
        answer = sweep_into(out, rig_scene, *words, "--resume")
        assert answer.code == 2
        assert f"out: this folder contains {why}" in answer.err
        assert {
            one.relative_to(out): one.read_bytes() for one in out.rglob("*") if one.is_file()
        } == before
    # sweeps over the same keys share a folder
    answer = sweep_into(out, rig_scene, "--over", "normal.load=10 N,20 N,30 N", "--resume")
    assert answer.code == 0 and len(read_rows(out)) == 3


def test_exact_cases_file_gives_rows(rig_scene, tmp_path):
    """The cases of a file, combined with --over, are the rows of the table."""
    table = tmp_path / "cases.csv"
    table.write_text("normal.load [N],friction.static\n10,0.3\n20,0.4\n", encoding="utf-8")
    assert (
        sweep_into(
            tmp_path / "a", rig_scene, "--cases", table, "--over", "drive.acceleration=1 g,5 g"
        ).code
        == 0
    )
    keys = ("normal.load", "friction.static", "drive.acceleration")
    assert [tuple(row[key] for key in keys) for row in read_rows(tmp_path / "a")] == [
        (*one, level) for one in (("10 N", "0.3"), ("20 N", "0.4")) for level in LEVELS
    ]
    with xr.open_dataset(tmp_path / "a/sweep.nc") as found:
        assert dict(found.sizes) == {"case": 4} and found.normal_load.dims == ("case",)
        np.testing.assert_array_equal(found.friction_static, [0.3, 0.3, 0.4, 0.4])


BENCH = """\
[normal]
load = "100 N"
[friction]
law = "elastic-plastic"
stiffness = "100 kN/m"
static = 0.3
[slide]
kind = "sine"
amplitude = "1 mm"
frequency = "10 Hz"
cycles = 2
"""


def test_exact_command_and_table_repeat_random_cases(tmp_path, monkeypatch):
    """Random cases are repeated by their command, which the answer has, and by the rows of their table."""
    scene = tmp_path / "bench.toml"
    scene.write_text(BENCH, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    over = ("--over", "friction.static=0.24..0.36", "--random", "5", "--seed", "3", "--no-page")
    given = ["sweep", "bench.toml", *over]
    run_successfully(*given, "-o", "first")
    assert store.read_answer(tmp_path / "first").origin["command"].startswith("patchfem")
    run_successfully(*given, "-o", "again")
    listed = sweep_into(tmp_path / "listed", scene, "--cases", tmp_path / "first/sweep.csv")
    assert listed.code == 0
    tables = [(tmp_path / name / "sweep.csv").read_bytes() for name in ("first", "again", "listed")]
    assert tables[1:] == tables[:1] * 2


def test_refuses_sweep_without_valid_case(rig_scene, tmp_path):
    """A sweep without a valid case ends with exit code 2."""
    answer = sweep_into(tmp_path / "a", rig_scene, "--over", "drive.cycles=1e15,2e15")
    assert answer.code == 2 and "no case could be run" in answer.out + answer.err
