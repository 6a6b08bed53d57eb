"""Results of a sweep in columnar files: they are read as written, and cases of damaged files run again."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import run_cli
from computed_cases import ComputedCases
from limits import limit_file_size
from scene_texts import COULOMB, POINT, SHORT

from patchfem.campaigns.sweeps import sweep
from patchfem.export.sweeps import chunks
from patchfem.export.sweeps.chunks import Chunks
from patchfem.runs import CaseResults
from patchfem.runs.batch import case_results as kept

RIG = POINT + COULOMB + SHORT
OVER = ("--over", "drive.acceleration=1 g..5 g:10", "--over", "normal.load=10 N..200 N:10,-1 N")
TABLES = ("sweep.csv", "sweep.nc")


@pytest.fixture(scope="module")
def scene_file(tmp_path_factory):
    """Return the file of a rig under a base acceleration."""
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def swept_folder(scene_file):
    """Return the folder of a sweep of 110 cases, ten of which are refused, stored only in columns."""
    folder = scene_file.parent / "swept"
    assert run_cli("sweep", scene_file, *OVER, "-o", folder, "--keep", "none").code == 3
    return folder


def random_results(count: int, seed: int) -> CaseResults:
    """Return random results with failed cases, missing measures and reasons."""
    rng = np.random.default_rng(seed)
    results = CaseResults.blank(count)
    results.outcome[:] = rng.choice(np.array(["steady", "stuck"], object), count)
    for name, unit in (("loop_area", "J"), ("onset_level", "m s-2")):
        results.add_measure(name, unit)
        for part in (results.values, results.errors, results.floors):
            part[name][:] = np.where(
                rng.random(count) < 0.2, np.nan, 10 ** rng.uniform(-12, 3, count)
            )
    results.fail(count - 1, "normal.load: must be ≥ 0")
    results.reasons["onset_level"] = {0: "nothing slips", count - 1: "nothing slips"}
    results.seconds[:] = rng.random(count).astype(np.float32)
    return results


def assert_results_equal(results: CaseResults, expected: CaseResults) -> None:
    """Assert that the results of two sets of cases are equal."""
    assert (
        results.outcome.tolist() == expected.outcome.tolist()
        and results.messages == expected.messages
    )
    assert results.units == expected.units and results.reasons == expected.reasons
    for part in ("values", "errors", "floors"):
        for name in expected.units:
            np.testing.assert_array_equal(
                getattr(results, part)[name], getattr(expected, part)[name]
            )
    np.testing.assert_array_equal(results.seconds, expected.seconds)


def test_exact_cases_are_read_by_name(tmp_path):
    """Cases are read by name in any order, also if requested twice; of two files with one case the later counts."""
    names = np.arange(1, 12, dtype=np.uint64) ** 5
    first = random_results(6, 1)
    second = random_results(5, 2)
    chunks.write_chunk(tmp_path, range(6), names[:6], first)
    chunks.write_chunk(tmp_path, range(6, 11), names[[5, 7, 8, 9, 10]], second)
    stored = Chunks(tmp_path, names[[9, 2, 0, 9, 5, 6]])
    stored.find_files()
    assert (stored.file_index >= 0).tolist() == [True] * 5 + [False]
    total = CaseResults.blank(6)
    for indices, part in stored.iterate_results(np.arange(6)):
        total.insert(indices, part)
    expected = [second.values["loop_area"][k] for k in (3, 0)]
    np.testing.assert_array_equal(
        total.values["loop_area"],
        [
            expected[0],
            first.values["loop_area"][2],
            first.values["loop_area"][0],
            expected[0],
            expected[1],
            np.nan,
        ],
    )
    assert total.outcome[5] == "" and total.reasons["onset_level"] == {
        2: "nothing slips",
        4: "nothing slips",
    }


def test_exact_small_files_are_merged(tmp_path):
    """A hundred small files are merged into one; a file of another sweep stays, unless the folder is cleaned."""
    names = np.arange(300, dtype=np.uint64) * 7919
    results = random_results(300, 5)
    for first in range(0, 300, 3):
        chunks.write_chunk(
            tmp_path,
            range(first, first + 3),
            names[first : first + 3],
            results.select(np.arange(first, first + 3)),
        )
    other_file = chunks.write_chunk(tmp_path, [0], np.array([3], np.uint64), random_results(1, 3))
    stored = Chunks(tmp_path, names)
    stored.find_files()
    stored.merge_small_files(False)
    # the file of another sweep stays, because that sweep may be continued
    assert len(list(tmp_path.iterdir())) == 2 and (tmp_path / other_file).exists()
    stored.find_files()
    ((indices, part),) = stored.iterate_results(np.arange(300))
    assert indices.tolist() == list(range(300))
    assert_results_equal(part, results)
    stored.merge_small_files(True)
    assert not (tmp_path / other_file).exists()


def test_exact_columns_and_summaries_give_equal_tables(swept_folder, scene_file, tmp_path):
    """A sweep stored in columns has the same rows as one stored with summaries, in less than 600 bytes per case."""
    assert run_cli("sweep", scene_file, *OVER, "-o", tmp_path / "a").code == 3
    assert sorted(entry.name for entry in swept_folder.iterdir()) == [
        "chunks",
        "report.html",
        "sweep.csv",
        "sweep.json",
        "sweep.nc",
    ]
    rows, expected = (
        list(csv.DictReader(open(folder / "sweep.csv", encoding="utf-8", newline="")))
        for folder in (swept_folder, tmp_path / "a")
    )
    assert len(rows) == 110
    assert [entry | {"case": row["case"]} for entry, row in zip(rows, expected)] == expected
    assert sum(entry.stat().st_size for entry in (swept_folder / "chunks").iterdir()) < 600 * 110


@pytest.mark.share(2, 3)
@pytest.mark.parametrize("damage", ["empty", "half", "one byte", "another sign"])
def test_always_cases_of_damaged_file_run_again(
    swept_folder, scene_file, tmp_path, monkeypatch, damage
):
    """If all chunk files are damaged, all cases run again and the tables are the same."""
    folder = shutil.copytree(swept_folder, tmp_path / "out")
    for path in list((folder / "chunks").iterdir()):
        data = bytearray(path.read_bytes())
        data[len(data) // 2] ^= 1
        path.write_bytes(
            {
                "empty": b"",
                "half": path.read_bytes()[: len(data) // 2],
                "one byte": bytes(data),
            }.get(damage, path.read_bytes())
        )
        if damage == "another sign":
            path.rename(path.with_stem(path.stem[:-4] + "0000"))
    computed = ComputedCases(monkeypatch)
    assert run_cli("sweep", scene_file, *OVER, "-o", folder, "--resume", "--keep", "none").code == 3
    assert len(computed) == 110
    for name in TABLES:
        assert (folder / name).read_bytes() == (swept_folder / name).read_bytes()


def test_exact_sweep_with_only_summaries_is_resumed(scene_file, tmp_path, monkeypatch):
    """A sweep that is stored only in summaries, as in older versions, is resumed; a damaged summary runs again."""
    folder = tmp_path / "out"
    arguments = ("sweep", scene_file, *OVER, "-o", tmp_path / "out")
    assert run_cli(*arguments).code == 3
    before = {name: (folder / name).read_bytes() for name in TABLES}
    shutil.rmtree(folder / "chunks")
    (next((folder / "cases").iterdir()) / "summary.json").write_text("{")
    computed = ComputedCases(monkeypatch)
    assert run_cli(*arguments, "--resume").code == 3 and len(computed) == 1
    assert {name: (folder / name).read_bytes() for name in TABLES} == before


def test_always_worker_without_folder_returns_results(
    swept_folder, scene_file, tmp_path, monkeypatch
):
    """A worker that cannot write to the folder, as on a cluster without a common disk, returns its results."""
    monkeypatch.setattr("patchfem.export.sweeps.folder.Writer.__call__", lambda *given: False)
    assert run_cli("sweep", scene_file, *OVER, "-o", tmp_path / "out", "--keep", "none").code == 3
    for name in TABLES:
        assert (tmp_path / "out" / name).read_bytes() == (swept_folder / name).read_bytes()


@pytest.mark.parametrize("has_older_file", [False, True])
def test_refuses_sweep_without_disk_space(scene_file, tmp_path, has_older_file):
    """A sweep without disk space for its first case ends with code 4 and leaves the folder as it was."""
    folder = tmp_path / "out"
    if has_older_file:
        folder.mkdir()
        (folder / "sweep.csv").write_text("older", encoding="utf-8")
    with limit_file_size(200):  # the summary of a case needs a few kB
        answer = run_cli("sweep", scene_file, "--over", "drive.acceleration=1 g,2 g", "-o", folder)
    assert answer.code == 4 and "a case cannot be written" in answer.err
    assert [path.read_text() for path in tmp_path.rglob("*") if path.is_file()] == [
        "older"
    ] * has_older_file
    assert [path.name for path in tmp_path.rglob("*") if path.is_dir()] == ["out"] * has_older_file


def test_exact_columns_on_disk_give_equal_tables(swept_folder, scene_file, tmp_path, monkeypatch):
    """A sweep whose columns are kept on disk has the same tables as one with its columns in memory."""
    monkeypatch.setattr(kept, "MIN_CASES_ON_DISK", 10)
    monkeypatch.setattr(chunks, "MAX_CASES_PER_FILE", 16)
    monkeypatch.setattr(sweep, "MAX_CASES_PER_CHUNK", 16)
    folder = tmp_path / "out"
    assert run_cli("sweep", scene_file, *OVER, "-o", folder, "--keep", "none").code == 3
    for name in TABLES:
        assert (folder / name).read_bytes() == (swept_folder / name).read_bytes()
    assert 7 <= len(list((folder / "chunks").iterdir())) <= 14
    total = CaseResults.blank(11, tmp_path)
    total.add_measure("loop_area", "J")
    assert isinstance(total.values["loop_area"], kept.ArrayOnDisk)
    total.values["loop_area"][[3, 5]] = 1.5, 2.5
    assert total.values["loop_area"][3:6].tolist()[::2] == [1.5, 2.5]
    assert np.isnan(total.values["loop_area"]).sum() == 9
    assert (
        np.asarray(total.values["loop_area"].reshape((11, 1))).shape
        == (11, 1)
        == np.shape(total.values["loop_area"].reshape((11, 1)))
    )
    assert not [path for path in Path(tmp_path).iterdir() if path.name != "out"]
