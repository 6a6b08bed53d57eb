"""patchfem sweep, as a person calls it."""

import csv
import html
import json
import math
import os
import re
import shlex
import shutil
from time import sleep

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli
from computed_cases import ComputedCases
from page_data import read_page_data
from scene_texts import COULOMB, POINT, SHORT

import patchfem as pf
from patchfem.campaigns.sweeps import sweep
from patchfem.commands.sweep import Progress
from patchfem.export import summarise_run
from patchfem.export.sweeps.folder import TABLES, Folder
from patchfem.export.sweeps.page import read_table

RIG = POINT + COULOMB + SHORT
LOADS, LEVELS = ["10 N", "26 lbf", "-1 N"], ["1 g", "5 g"]
OVER = ("--over", f"normal.load={','.join(LOADS)}", "--over", "drive.acceleration=1 g..5 g:2")


@pytest.fixture(scope="module")
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def swept(scene):
    out = scene.parent / "swept"
    return out, sweep_into(out, scene, *OVER)


def alike(found, measure, part="value") -> None:
    """Check a cell: the number of a single run to 1e-12 of it or of what it is a part of, empty where that has none."""
    single = getattr(measure, part)
    # a distortion is a fraction, a drift that of an amplitude
    size = {"1": 1.0, "m": 1e-3}.get(measure.unit, 0.0)
    assert (found in ("", None)) == (single is None)
    assert single is None or float(found) == pytest.approx(single, rel=1e-12, abs=1e-12 * size)


def sweep_into(out, scene, *words):
    """Sweep a scene into a folder on the command line."""
    return run_cli("sweep", scene, *words, "-o", out)


def names(folder) -> set:
    return {path.name for path in folder.iterdir()}


def assert_same_tables(out, other) -> None:
    for name in ("sweep.csv", "sweep.nc"):
        assert (out / name).read_bytes() == (other / name).read_bytes()


def rows(out) -> list:
    with open(out / "sweep.csv", encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_exact_every_case_is_a_single_run(swept, scene):
    out, answer = swept
    assert answer.code == 3  # two cases were refused
    found = rows(out)
    assert [(row["normal.load"], row["drive.acceleration"]) for row in found] == [
        (load, level) for load in LOADS for level in LEVELS
    ]
    for row in found[:4]:
        sets = {"normal.load": row["normal.load"], "drive.acceleration": row["drive.acceleration"]}
        single = pf.run(scene, **sets)
        assert row["outcome"] == single.outcome and row["message"] == ""
        kept = json.loads((out / "cases" / row["case"] / "summary.json").read_text())
        assert kept["case"] == sets and kept["kind"] == "rig" and kept["outcome"] == single.outcome
        assert kept["warnings"] == single.warnings and kept["notes"] == single.notes
        whole = summarise_run(single)
        # a case of a batch does not name what computed each measure
        del whole["numerics"]["measures"]
        for part in ("patchfem", "title", "not_in_scene", "numerics"):
            assert kept[part] == whole[part]
        effects, others = (
            [(entry["effect"], entry["equations"]) for entry in summary["effects"]]
            for summary in (kept, whole)
        )
        assert effects == others and 0 < kept["seconds"]["total"] < 60
        for name, measure in single.measures.items():
            entry = kept["measures"][name]
            for column, part in ((name, "value"), (f"{name}_error", "error")):
                alike(row[column], measure, part)
                alike(entry[part], measure, part)
            assert entry.get("reason", "") == measure.reason


def test_exact_a_refused_case_is_a_row_with_its_message(swept):
    out, answer = swept
    for row in rows(out)[4:]:
        assert row["outcome"] == "failed" and "normal.load: must be >= 0" in row["message"]
        assert row["loop_area"] == ""
        assert (
            json.loads((out / "cases" / row["case"] / "summary.json").read_text())["message"]
            == row["message"]
        )
    assert "6 cases:" in answer.out and "2 failed" in answer.out
    assert f"page: {out / 'report.html'}\nresults: {out / 'sweep.csv'}" in answer.out
    assert (out / "report.html").is_file()
    found = [
        float(row["relative_displacement_amplitude"])
        for row in rows(out)[:4]
        if row["outcome"] != "transient"
    ]
    assert len(found) == 2 and re.search(
        rf"ranges from 0 \(.*\) to {max(found) * 1e6:.4g} um \(", answer.out
    )
    assert "case 5 and 1 more: normal.load: must be >= 0" in answer.err


def test_exact_nothing_unfinished_is_left(swept):
    out, _ = swept
    assert sorted(names(out)) == [
        "cases",
        "chunks",
        "report.html",
        "sweep.csv",
        "sweep.json",
        "sweep.nc",
    ]
    assert sorted(names(out / "cases")) == sorted(row["case"] for row in rows(out))


def test_exact_the_table_of_a_scene_says_the_same(swept, tmp_path):
    path = tmp_path / "rig.toml"
    table = f'[sweep]\n"normal.load" = "{",".join(LOADS)}"\n"drive.acceleration" = "1 g..5 g:2"\n'
    path.write_text(RIG + table, encoding="utf-8")
    assert run_cli("check", path).code == 0
    assert sweep_into(tmp_path / "swept", path).code == 3
    assert run_cli("check", path).out.endswith("a rig scene without mistakes, 6 cases\n")
    assert json.loads(run_cli("check", path, "--json").out)["cases"] == 6
    assert (tmp_path / "swept" / "sweep.csv").read_bytes() == (swept[0] / "sweep.csv").read_bytes()
    told = run_cli("run", path, "-o", tmp_path / "one")
    assert told.code == 2 and "use `patchfem sweep`" in told.err


def test_exact_a_resumed_sweep_runs_what_is_missing(swept, scene, tmp_path, monkeypatch):
    computed = ComputedCases(monkeypatch)

    def count_runs() -> int:
        return sum(isinstance(model, pf.Model) for model in computed.models)

    out = tmp_path / "swept"
    assert sweep_into(out, scene, "--over", "normal.load=10 N,-1 N", *OVER[2:]).code == 3
    assert count_runs() == 2
    # as a full disk leaves it
    (out / "cases" / rows(out)[0]["case"] / "summary.json").write_text('{"patchf')
    answer = sweep_into(out, scene, *OVER, "--resume")
    assert answer.code == 3 and count_runs() == 5
    # of another shape: once an internal fault
    (out / "cases" / rows(out)[0]["case"] / "summary.json").write_text("[]")
    assert sweep_into(out, scene, *OVER, "--resume").code == 3 and count_runs() == 6
    assert_same_tables(out, swept[0])
    assert sweep_into(out, scene, *OVER).code == 3 and count_runs() == 10


@pytest.mark.parametrize(
    "change, why",
    [
        (
            ("--set", "friction.static=0.31"),
            "a sweep of another scene or of another version of patchfem",
        ),
        (("--over", "drive.cycles=3,4"), "a sweep of other keys (normal.load)"),
    ],
)
def test_refuses_to_resume_into_a_whole_sweep_of_another(scene, tmp_path, change, why):
    """The tables of the older sweep were once replaced without a word."""
    out = tmp_path / "out"
    over = ("--over", "normal.load=10 N,20 N")
    assert sweep_into(out, scene, *over).code == 0
    before = {one.relative_to(out): one.read_bytes() for one in out.rglob("*") if one.is_file()}
    told = sweep_into(out, scene, *(() if change[0] == "--over" else over), *change, "--resume")
    assert told.code == 2
    assert f"out: this folder contains {why}; name another folder with -o" in told.err
    assert {
        one.relative_to(out): one.read_bytes() for one in out.rglob("*") if one.is_file()
    } == before
    # of the same keys
    told = sweep_into(out, scene, "--over", "normal.load=20 N,30 N", "--resume")
    assert told.code == 0
    assert "note: 1 case of this folder is not among the values of this sweep" in told.err
    told = sweep_into(out, scene, "--over", "normal.load=10 N,20 N,30 N", "--resume")
    assert told.code == 0 and "not among" not in told.err and len(rows(out)) == 3


def test_exact_an_interrupt_keeps_what_is_done(swept, scene, tmp_path, monkeypatch):
    computed = ComputedCases(monkeypatch)
    computed.chunks_before_interrupt = 2
    # Each chunk has one case, which is computed before the sweep can be stopped within it.
    monkeypatch.setattr(sweep, "CHUNK_SECONDS", 0.0)
    out = tmp_path / "swept"
    answer = sweep_into(out, scene, *OVER)
    assert answer.code == 130 and "--resume" in answer.err
    held = len(list((out / "cases").iterdir()))
    # its tables have what there is
    assert 2 <= held < 6 and sum(row["outcome"] != "" for row in rows(out)) == held
    told = json.loads((out / "sweep.json").read_text())
    assert told["cases"]["unfinished"] == 6 - held
    assert f"({6 - held} of 6 cases ha{'s' if held == 5 else 've'} no result yet" in told["answer"]
    assert (out / "report.html").is_file()
    computed.chunks_before_interrupt = math.inf
    text = "cases already have an answer from an interrupted sweep"
    copied = tmp_path / "copied"
    shutil.copytree(out, copied)
    assert f"note: {held} of 6 {text} but are run again" in sweep_into(copied, scene, *OVER).err
    assert text not in sweep_into(copied, scene, *OVER).err  # it is whole now
    answer = sweep_into(out, scene, *OVER, "--resume")
    assert answer.code == 3 and text not in answer.err
    assert_same_tables(out, swept[0])


def test_exact_older_tables_are_none_while_cases_are_answered(scene, tmp_path, monkeypatch):
    out = tmp_path / "swept"
    computed = ComputedCases(monkeypatch)
    assert sweep_into(out, scene, "--over", "friction.static=0.1,0.2").code == 0
    computed.chunks_before_interrupt = 0
    assert sweep_into(out, scene, "--over", "friction.static=0.2,0.3", "--resume").code == 130
    assert names(out) == {"cases", "chunks", *TABLES}
    assert [(row["friction.static"], row["outcome"] != "") for row in rows(out)] == [
        ("0.2", True),
        ("0.3", False),
    ]
    # nothing to tell
    assert sweep_into(out, scene, "--over", "friction.static=0.4", "--resume").code == 130
    assert names(out) == {"cases", "chunks", *(f"{name}.partial" for name in TABLES)}
    computed.chunks_before_interrupt = math.inf
    assert sweep_into(out, scene, "--over", "friction.static=0.2,0.3", "--resume").code == 0
    assert [row["friction.static"] for row in rows(out)] == ["0.2", "0.3"]
    assert names(out) == {"cases", "chunks", *TABLES}
    # what was found before is kept, as long as it is gone on with
    assert len(list((out / "cases").iterdir())) == 3
    assert sweep_into(out, scene, "--over", "friction.static=0.2,0.3").code == 0
    assert len(list((out / "cases").iterdir())) == 2


def test_exact_one_object_on_stdout(scene, tmp_path):
    answer = sweep_into(tmp_path / "a", scene, "--over", "friction.static=0.1,0.2", "--json", "-q")
    assert answer.code == 0 and answer.err == ""
    told = json.loads(answer.out)
    assert told["cases"] == 2 and told["failed"] == 0 and sum(told["outcomes"].values()) == 2


def test_refuses_a_second_writer(scene, tmp_path, monkeypatch):
    words = ("sweep", scene, "--over", "friction.static=0.1,0.2", "-o", tmp_path / "a")
    with monkeypatch.context() as another:
        another.setattr(os, "getpid", lambda: 1)
        first = Folder(tmp_path / "a", ()).__enter__()
    answer = run_cli(*words)
    assert answer.code == 4
    assert "another sweep (process 1)" in answer.err
    assert "remove the file a/.writer" in answer.err
    first.__exit__(None, None, None)
    assert run_cli(*words).code == 0
    # beyond the largest number of a process: it died
    (tmp_path / "a" / ".writer").write_text("4194305")
    assert run_cli(*words).code == 0


def test_exact_shards_make_the_same_files(swept, scene, tmp_path, monkeypatch):
    out = tmp_path / "swept"
    computed = ComputedCases(monkeypatch)
    for part in ("2/4", "1/4", "4/4"):
        assert sweep_into(out, scene, *OVER, "--shard", part).code == 0
    early = sweep_into(out, scene, *OVER, "--collect")
    assert early.code == 4
    assert "1 of 6 cases have no answer" in early.err
    assert not (out / "sweep.csv").exists()
    count = len(computed)
    # it is done
    assert sweep_into(out, scene, *OVER, "--shard", "2/4").code == 0 and len(computed) == count
    assert sweep_into(out, scene, *OVER, "--shard", "3/4").code == 0 and len(computed) == 6
    (
        out / "cases" / "0123456789abcdef"
    ).mkdir()  # another sweep's, whose shards may still be at work
    collected, quiet, told = (
        sweep_into(out, scene, *OVER, "--collect", *words) for words in ((), ("-q",), ("--json",))
    )
    assert [one.code for one in (collected, quiet, told)] == [3] * 3
    assert collected.out.splitlines()[1].startswith("6 cases: ")
    assert f"results: {out / 'sweep.csv'}" in collected.out
    assert quiet.out == "" and json.loads(told.out)["cases"] == 6
    assert (out / "cases" / "0123456789abcdef").is_dir()
    assert_same_tables(out, swept[0])


def test_exact_tables_of_many_cases_are_written_where_they_are_asked_for(
    swept, scene, tmp_path, monkeypatch
):
    out = tmp_path / "swept"
    with monkeypatch.context() as many:
        many.setattr("patchfem.export.sweeps.run.MAX_CASES_WITH_TABLES", 5)
        said = sweep_into(out, scene, *OVER)
        assert not (out / "sweep.csv").exists() and not (out / "sweep.nc").exists()
        assert "run the same command with --collect" in said.out
        assert "with --collect" in (out / "report.html").read_text("utf-8")
        assert sweep_into(out, scene, *OVER, "--collect").code == said.code
    assert_same_tables(out, swept[0])


def test_always_two_shards_may_put_older_tables_aside_at_once(tmp_path, monkeypatch):
    (tmp_path / "sweep.csv").write_text("older")
    real = os.replace

    def second(old, new):
        real(old, new)  # by another process, between the look of this one and its own try
        real(old, new)

    with Folder(tmp_path, (), True) as folder, monkeypatch.context() as twice:
        twice.setattr(os, "replace", second)
        folder.unfinish()
    assert (tmp_path / "sweep.csv.partial").read_text() == "older" and not (
        tmp_path / "sweep.csv"
    ).exists()


@pytest.mark.slow
def test_exact_whole_results_folders_are_kept(scene, tmp_path):
    out = tmp_path / "swept"
    over = ("--over", "friction.static=-1,0.1")
    # summaries are no results folders: --resume makes those
    assert sweep_into(out, scene, *over).code == 3
    assert sweep_into(out, scene, *over, "--resume", "--keep", "results").code == 3
    bad, good = rows(out)
    assert {"result.nc", "summary.json", "scene.resolved.toml"} <= {
        one.name for one in (out / "cases" / good["case"]).iterdir()
    }
    assert [one.name for one in (out / "cases" / bad["case"]).iterdir()] == ["summary.json"]
    before = (out / "sweep.csv").read_bytes()
    assert sweep_into(out, scene, *over, "--resume", "--keep", "results").code == 3
    assert (out / "sweep.csv").read_bytes() == before


@pytest.mark.slow
def test_exact_pages_are_drawn_where_they_are_asked_for(scene, tmp_path):
    out = tmp_path / "swept"
    over = ("--over", "friction.static=0.1")
    page = "report.html"
    for words, own, each in (
        ((), True, False),
        (("--no-page",), False, False),
        (("--keep", "results"), True, False),
        (("--keep", "pages"), True, True),
        (("--keep", "results", "--no-page"), False, False),
    ):
        assert sweep_into(out, scene, *over, *words).code == 0
        assert (out / page).is_file() == own and (out / "sweep.csv").is_file()
        assert [one.is_file() for one in (out / "cases").glob(f"*/{page}")] == [True] * each
        # what a click on the case opens
        assert not own or (page in (out / page).read_text("utf-8")) == each
    answer = sweep_into(out, scene, *over, "--keep", "pages", "--no-page")
    assert answer.code == 2 and "--no-page" in answer.err
    assert sweep_into(out, scene, *over, "--collect").code == 0 and (out / page).is_file()
    assert sweep_into(out, scene, *over, "--collect", "--no-page").code == 0
    assert not (out / page).exists()


def test_exact_cases_of_a_file_and_drawn_ones_are_rows(scene, tmp_path):
    table = tmp_path / "cases.csv"
    table.write_text("normal.load [N],friction.static\n10,0.3\n20,0.4\n", encoding="utf-8")
    assert (
        sweep_into(
            tmp_path / "a", scene, "--cases", table, "--over", "drive.acceleration=1 g,5 g"
        ).code
        == 0
    )
    keys = ("normal.load", "friction.static", "drive.acceleration")
    assert [tuple(row[key] for key in keys) for row in rows(tmp_path / "a")] == [
        (*one, level) for one in (("10 N", "0.3"), ("20 N", "0.4")) for level in LEVELS
    ]
    with xr.open_dataset(tmp_path / "a" / "sweep.nc") as found:
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


@pytest.mark.parametrize("words", [("--random", "5", "--seed", "3"), ("--sobol", "8")])
def test_exact_the_printed_command_of_drawn_cases_draws_them_again(tmp_path, monkeypatch, words):
    scene, (first, again, listed) = (
        tmp_path / "bench.toml",
        (tmp_path / name for name in ("first", "again", "listed")),
    )
    scene.write_text(BENCH, encoding="utf-8")
    sweep_into(
        first, scene, "--over", "friction.static=0.3 +- 20 %", *words, "--set", "normal.load=90 N"
    )
    monkeypatch.chdir(tmp_path)

    def printed(folder):
        return shlex.split(
            html.unescape(
                re.search(
                    "its scene:</p><pre>(.*?)</pre>", (folder / "report.html").read_text("utf-8")
                )[1]
            )
        )

    command = printed(first)
    assert command[:2] == ["patchfem", "sweep"] and run_cli(*command[1:], "-o", again).code == 0
    assert read_table(first)["command"] == shlex.join(command)  # what `patchfem report` prints
    assert (
        sweep_into(listed, scene, "--set", "normal.load=90 N", "--cases", first / "sweep.csv").code
        == 0
    )
    assert run_cli(*printed(listed)[1:], "-o", tmp_path / "third").code == 0
    for other in (again, listed, tmp_path / "third"):
        assert (other / "sweep.csv").read_bytes() == (first / "sweep.csv").read_bytes()


def test_exact_the_answer_begins_with_the_measure_that_is_asked_for(tmp_path):
    """Of a slide of 1 mm with gross slip the secant stiffness is mu N/1 mm, the largest force over the slide; the load
    has 0 % of it where it hardly changes. A measure that no case has, or that cannot be ranked, is told as that."""
    scene = tmp_path / "bench.toml"
    data = tmp_path / "a/sweep.json"
    scene.write_text(BENCH, encoding="utf-8")
    drawn = (
        "--over",
        "friction.static=0.1..0.5",
        "--over",
        "normal.load=99.9 N..100.1 N",
        "--sobol",
        "64",
    )
    said = sweep_into(tmp_path / "a", scene, *drawn, "--of", "secant_stiffness")
    answer = json.loads(data.read_text("utf-8"))["answer"]
    with open(tmp_path / "a/sweep.csv", newline="", encoding="utf-8") as file:
        mu = [float(row["friction.static"]) for row in csv.DictReader(file)]
    ends = re.search(
        r"have a secant stiffness from (\S+) N/mm to (\S+) N/mm, a loop area", answer
    ).groups()
    assert [float(one) for one in ends] == pytest.approx(
        1e2 * np.quantile(mu, [0.05, 0.95]), rel=5e-3
    )
    assert answer.startswith(
        "Secant stiffness depends most on friction.static, which contributes to 100 %"
    )
    assert answer == said.out.splitlines()[0]
    page = (tmp_path / "a/report.html").read_text("utf-8")
    assert read_page_data(page)["first"] == "secant_stiffness" and "--of secant_stiffness" in page
    again = sweep_into(tmp_path / "a", scene, *drawn, "--of", "pressure_peak", "--resume")
    assert json.loads(data.read_text("utf-8"))["answer"].endswith(
        "(no case has a value of pressure peak, so this answer describes other measures)."
    )
    assert "no case has a value of pressure peak" in again.out
    assert (
        pf.sweep(scene, {"friction.static": [0.1, 0.2]}, of="secant_stiffness")
        .attrs["answer"]
        .startswith(
            "Secant stiffness ranges from 10 N/mm (friction.static 0.1) to 20 N/mm (friction.static 0.2)."
        )
    )


def test_refuses_a_sweep_of_which_no_case_could_be_run(scene, tmp_path):
    answer = sweep_into(tmp_path / "a", scene, "--over", "drive.cycles=1e15,2e15")
    assert answer.code == 2 and "no case could be run" in answer.out + answer.err


def test_exact_the_plan_of_a_sweep_counts_its_cases(scene):
    told = json.loads(run_cli("plan", scene, *OVER, "--json").out)
    one = json.loads(run_cli("plan", scene, "--json").out)
    assert told["cases"] == 6 and told["values"] == {"normal.load": 3, "drive.acceleration": 2}
    half, more = (
        json.loads(run_cli("plan", scene, "--over", f"friction.static=0.1..0.6:{n}", "--json").out)
        for n in (1000, 2000)
    )
    assert more["seconds"] - half["seconds"] == pytest.approx(
        1000 * more["seconds_per_case"], rel=0.05
    )
    assert (told["kind"], told["engine"], told["effects"]) == (
        one["kind"],
        one["engine"],
        one["effects"],
    )
    assert "6 cases of 3 normal.load, 2 drive.acceleration" in run_cli("plan", scene, *OVER).out


def test_exact_the_plan_of_a_sweep_names_the_case_whose_values_it_prints(scene):
    """Groups of the first case once stood there as if they were those of the scene."""
    swept = "--over", "friction.static=0.41,0.1"
    told = json.loads(run_cli("plan", scene, *swept, "--json").out)
    assert told["case"] == {"friction.static": "0.41"}
    assert (
        told["groups"]
        == json.loads(run_cli("plan", scene, "--set", "friction.static=0.41", "--json").out)[
            "groups"
        ]
    )
    assert run_cli("plan", scene, *swept).out.startswith(
        "case     friction.static 0.41 (the first case); "
    )
    own = scene.with_name("own.toml")
    own.write_text(RIG + '\n[sweep]\n"friction.static" = [0.1, 0.2]\n', "utf-8")
    chosen = run_cli("plan", own, "--set", "friction.static=0.3")  # a single case that is chosen
    assert chosen.code == 0 and "sweep " not in chosen.out and "kind     rig" in chosen.out


class QuickProgress(Progress):
    """A progress line that does not wait for ten seconds."""

    WAIT = 0.02


def test_always_a_sweep_says_how_long_its_first_case_takes(capsys):
    """A sweep of costly cases printed nothing for five minutes."""
    line = QuickProgress(False)
    silent = QuickProgress(True)
    for one in (line, silent):
        one(0, 11, None)
    sleep(0.4)
    line.end()
    said = capsys.readouterr().err.splitlines()
    assert 2 <= len(said) <= 5 and set(said) == {"0/11 cases, 0 s so far"} and line.over.is_set()
