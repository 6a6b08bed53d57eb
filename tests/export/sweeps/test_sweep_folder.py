"""The folder of a sweep: it survives damaged files, and computes only what is missing."""

import json
import shutil

import numpy as np
import pytest
import xarray as xr
from command_line import run_cli, run_successfully
from computed_cases import ComputedCases
from scene_texts import COULOMB, POINT, SHORT, SMALL_PATCH
from sweep_tables import assert_same_files, make_table, read_rows

from patchfem.export import store
from patchfem.export.folder import Folder
from patchfem.export.sweeps import folder as store_chunks
from patchfem.runs import CaseResults
from patchfem.runs.batch import batches

RIG = POINT + COULOMB + SHORT
OVER = ("--over", "drive.acceleration=1 g..5 g:10", "--over", "normal.load=10 N..200 N:10,-1 N")
TABLES = ("sweep.csv", "sweep.nc", "sweep.json", "summary.json", "report.html")
MAX_BYTES_PER_CASE = 600  # of the chunks


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory):
    """Return the file of a rig under a base acceleration."""
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def swept(scene_file):
    """Return the folder of a sweep of 110 cases, ten of which are refused, without files of its cases."""
    folder = scene_file.parent / "swept"
    assert run_cli("sweep", scene_file, *OVER, "-o", folder, "--keep", "none").code == 3
    return folder


def test_exact_chunks_are_small_netcdf_files(swept):
    """The chunks take less than 600 bytes per case, and xarray reads the numbers of sweep.csv from them."""
    files = list((swept / "chunks").iterdir())
    assert sum(path.stat().st_size for path in files) < MAX_BYTES_PER_CASE * 110
    values = []
    for path in files:
        with xr.open_dataset(path, engine="h5netcdf") as chunk:
            names = list(json.loads(chunk.attrs["measures"]))
            values += chunk["values"].values[names.index("loop_area")].tolist()
    cells = [float(row["loop_area"] or "nan") for row in read_rows(swept)]
    np.testing.assert_array_equal(np.sort(values), np.sort(cells))


@pytest.mark.parametrize("damage", ["empty", "half", "one byte", "other content"])
def test_always_cases_of_damaged_chunk_run_again(swept, scene_file, tmp_path, monkeypatch, damage):
    """The cases of damaged chunks run again, and all files are the same as before."""
    folder = shutil.copytree(swept, tmp_path / "out")
    for path in (folder / "chunks").iterdir():
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 255
        changed = {"empty": b"", "half": bytes(data[: len(data) // 2]), "one byte": bytes(data)}
        path.write_bytes(changed.get(damage, b"a text"))
    computed = ComputedCases(monkeypatch)
    words = ("sweep", scene_file, *OVER, "-o", folder, "--keep", "none", "--resume")
    assert run_cli(*words).code == 3
    assert len(computed) == 110
    assert_same_files(folder, swept, TABLES)


def test_exact_resumed_sweep_computes_what_is_missing(scene_file, tmp_path, monkeypatch):
    """A resumed sweep computes the values that are new and the cases without their files only."""
    computed = ComputedCases(monkeypatch)
    folder = tmp_path / "out"

    def run_sweep(values: str, *words) -> int:
        """Run a sweep over the friction coefficient, and return the number of computed cases."""
        before = len(computed)
        over = ("--over", f"friction.static={values}")
        run_successfully("sweep", scene_file, *over, "--no-page", "-o", folder, *words)
        return len(computed) - before

    assert run_sweep("0.2,0.3,0.4") == 3
    assert run_sweep("0.2,0.3,0.4", "--resume") == 0
    assert run_sweep("0.3,0.5", "--resume") == 1  # a value with another position is not new
    case = next(row["case"] for row in read_rows(folder) if row["friction.static"] == "0.3")
    (folder / "cases" / case / "summary.json").unlink()
    assert run_sweep("0.2,0.3,0.4,0.5", "--resume") == 1
    assert [row["friction.static"] for row in read_rows(folder)] == ["0.2", "0.3", "0.4", "0.5"]
    assert run_sweep("0.2,0.3") == 2
    assert len(list((folder / "cases").iterdir())) == 2


def test_exact_shards_give_same_files(swept, scene_file, tmp_path):
    """Shards with --collect give the files of a single sweep."""
    words = ("sweep", scene_file, *OVER, "--keep", "none")
    for shard in ("2/3", "1/3"):
        run_successfully(*words, "-o", tmp_path / "shards", "--shard", shard)
    early = run_cli(*words, "-o", tmp_path / "shards", "--collect")
    assert early.code == 4 and "37 of 110 cases have no answer" in early.err
    run_successfully(*words, "-o", tmp_path / "shards", "--shard", "3/3")
    assert run_cli(*words, "-o", tmp_path / "shards", "--collect").code == 3
    assert_same_files(tmp_path / "shards", swept, TABLES)


def test_exact_blocks_of_patches_do_not_depend_on_interruptions_and_shards(tmp_path, monkeypatch):
    """Static patches are computed in fixed blocks, so that resumed and divided sweeps end with the same files."""
    monkeypatch.setattr(batches.static, "CASES_PER_BLOCK", 3)
    scene = tmp_path / "patch.toml"
    scene.write_text(SMALL_PATCH.replace('element_size = "0.5 mm"\n', ""))
    over = (
        "--over",
        "contact.load=20 N..300 N:5",
        "--over",
        "contact.coating.thickness=0.1 mm,0.2 mm",
    )
    words = (
        "sweep",
        scene,
        *over,
        "--set",
        "accuracy.tolerance=1e-2",
        "--keep",
        "none",
        "--no-page",
    )
    run_successfully(*words, "-o", tmp_path / "whole")

    computed = ComputedCases(monkeypatch)
    computed.chunks_before_interrupt = 2
    assert run_cli(*words, "-o", tmp_path / "resumed").code == 130
    computed.chunks_before_interrupt = np.inf
    n_before = len(computed)
    run_successfully(*words, "-o", tmp_path / "resumed", "--resume")
    assert 0 < n_before < len(computed) == 10

    for shard in ("2/3", "1/3", "3/3"):
        run_successfully(*words, "-o", tmp_path / "shards", "--shard", shard)
    run_successfully(*words, "-o", tmp_path / "shards", "--collect")
    for name in ("resumed", "shards"):
        assert_same_files(
            tmp_path / name, tmp_path / "whole", ("sweep.csv", "sweep.nc", "sweep.json")
        )


def test_exact_interrupted_sweep_that_is_run_anew_is_named(scene_file, tmp_path):
    """A sweep without --resume says how many cases of an interrupted one it computes again; a whole one has no note."""
    over = ("--over", "friction.static=0.2,0.3,0.4", "--no-page")
    words = ("sweep", scene_file, *over, "-o", tmp_path / "out")
    run_successfully(*words, "--shard", "1/3")
    assert "note: 1 of 3 cases already have an answer" in run_cli(*words).err
    assert "already have an answer" not in run_cli(*words).err


def test_exact_repeated_sweep_keeps_one_result_of_each_case(scene_file, tmp_path):
    """A sweep that is run again, also with other values, leaves one result of each of its cases in a single file.

    Once each run added its results to those of the runs before.
    """
    out = tmp_path / "out"
    for values in ("0.2,0.3", "0.2,0.3", "0.3,0.4"):
        over = ("--over", f"friction.static={values}")
        run_successfully("sweep", scene_file, *over, "--no-page", "-o", out)
        (path,) = (out / "chunks").iterdir()
        names, results = store_chunks.read_chunk(path)
        assert len(names) == len(results) == np.unique(names).size == 2
        assert [row["friction.static"] for row in read_rows(out)] == values.split(",")


def test_exact_files_of_cases_follow_keep(scene_file, tmp_path):
    """`--keep` stores nothing, a summary or a results folder of each case, and a failed case has a summary."""
    over = ("--over", "friction.static=-1,0.1")
    results = {"summary.json", "scene.resolved.toml", "result.nc"}
    names = {
        "none": set(),
        "summaries": {"summary.json"},
        "results": results,
        "pages": results | {"report.html"},
    }
    for keep, expected in names.items():
        folder = tmp_path / keep
        assert run_cli("sweep", scene_file, *over, "-o", folder, "--keep", keep).code == 3
        failed, done = read_rows(folder)
        if keep == "none":
            assert "case" not in done and not (folder / "cases").exists()
            continue
        assert {path.name for path in (folder / "cases" / done["case"]).iterdir()} == expected
        summary = store.read_summary(folder / "cases" / done["case"])
        assert float(done["loop_area"]) == summary.measures["loop_area"].value
        assert summary.case == {"friction.static": "0.1"}
        message = store.read_summary(folder / "cases" / failed["case"]).message
        assert message == failed["message"] and "friction.static" in message


def test_exact_partial_files_of_killed_writers_are_removed(scene_file, tmp_path):
    """A hidden partial file that a killed writer left in the folder of a run or of a sweep is gone after the next one."""
    name = ".sweep.0123456789abcdef.partial.csv"
    folder = tmp_path / "swept"
    over = ("--over", "friction.static=0.1,0.2")
    run_cli("sweep", scene_file, *over, "-o", folder)
    (folder / name).write_text("half a table", "utf-8")
    run_cli("sweep", scene_file, *over, "-o", folder, "--resume")
    assert {path.name for path in folder.iterdir()} == {*TABLES, "cases", "chunks"}

    partial = tmp_path / "run.partial"
    (partial / "interfaces").mkdir(parents=True)
    (partial / "interfaces" / name).write_text("half a file", "utf-8")
    with Folder(tmp_path / "run", resume=True) as run:
        (run.path / "summary.json").write_text("{}", "utf-8")
    assert not list((tmp_path / "run").rglob(".*")) and (tmp_path / "run/summary.json").exists()


def test_exact_faults_of_batches_are_read_from_chunks(tmp_path):
    """The sentences on faults after which cases ran one by one are kept in the chunks, once for the whole sweep."""
    results = CaseResults.blank(2)
    results.outcome[:] = "done"
    results.faults.append("cases are run one by one, because of a fault")
    path = store_chunks.write_chunk(tmp_path, np.arange(2), results)
    table = make_table({"normal.load": [1.0, 2.0]}, {})
    for _ in range(2):
        table.insert([0, 1], store_chunks.read_chunk(path)[1])
    assert list(table.faults) == results.faults


@pytest.mark.parametrize("names, is_kept", [([1, 5], True), ([5, 6], False)])
def test_exact_faults_of_another_sweep_are_left_out(tmp_path, names, is_kept):
    """A chunk without a requested case, which an earlier sweep left in the folder, adds no fault and no result."""
    results = CaseResults.blank(2)
    results.outcome[:] = "done"
    results.faults.append("cases are run one by one, because of a fault")
    store_chunks.write_chunk(tmp_path, np.arange(2), results)
    stored = list(store_chunks.Chunks(tmp_path, np.array(names)).iterate_results())
    assert [part.faults for _, part in stored] == [results.faults] * is_kept
