"""Answers of a sweep as columnar files: what is written is read, what is damaged is run again, memory does not grow."""

import csv
import shutil
from pathlib import Path

import numpy as np
import pytest
from command_line import cli
from computed_cases import ComputedCases
from limits import limited
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
def scene(tmp_path_factory):
    path = tmp_path_factory.mktemp("scene") / "rig.toml"
    path.write_text(RIG, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def swept(scene):
    """A sweep of 110 cases, ten of which are refused, with columns alone."""
    out = scene.parent / "swept"
    assert cli("sweep", scene, *OVER, "-o", out, "--keep", "none").code == 3
    return out


def some(count: int, seed: int) -> CaseResults:
    """Answers of chance, with failed cases, measures that some have not and reasons."""
    rng = np.random.default_rng(seed)
    found = CaseResults.blank(count)
    found.outcome[:] = rng.choice(np.array(["steady", "stuck"], object), count)
    for name, unit in (("loop_area", "J"), ("onset_level", "m s-2")):
        found.measure(name, unit)
        for part in (found.values, found.errors, found.floors):
            part[name][:] = np.where(
                rng.random(count) < 0.2, np.nan, 10 ** rng.uniform(-12, 3, count)
            )
    found.fail(count - 1, "normal.load: must be ≥ 0")
    found.reasons["onset_level"] = {0: "nothing slips", count - 1: "nothing slips"}
    found.seconds[:] = rng.random(count).astype(np.float32)
    return found


def same(found: CaseResults, want: CaseResults) -> None:
    assert found.outcome.tolist() == want.outcome.tolist() and found.messages == want.messages
    assert found.units == want.units and found.reasons == want.reasons
    for part in ("values", "errors", "floors"):
        for name in want.units:
            np.testing.assert_array_equal(getattr(found, part)[name], getattr(want, part)[name])
    np.testing.assert_array_equal(found.seconds, want.seconds)


@pytest.mark.parametrize("count", [1, 7, 4096])
def test_exact_a_file_gives_back_what_was_written(tmp_path, count):
    names = np.random.default_rng(count).integers(0, 2**64 - 1, count, np.uint64)
    written = chunks.write_chunk(tmp_path, range(count), names, some(count, count))
    found, read = chunks.read_chunk(tmp_path / written)
    np.testing.assert_array_equal(found, names)
    same(read, some(count, count))
    assert [one.name for one in tmp_path.iterdir()] == [written]


def test_exact_cases_are_found_by_their_names_in_any_order(tmp_path):
    """Of files with cases of other sweeps, a case that stands twice, and one that two files have: the later counts."""
    names = np.arange(1, 12, dtype=np.uint64) ** 5
    first = some(6, 1)
    second = some(5, 2)
    chunks.write_chunk(tmp_path, range(6), names[:6], first)
    chunks.write_chunk(tmp_path, range(6, 11), names[[5, 7, 8, 9, 10]], second)
    wanted = Chunks(tmp_path, names[[9, 2, 0, 9, 5, 6]])
    wanted.look()
    assert (wanted.held >= 0).tolist() == [True] * 5 + [False]
    total = CaseResults.blank(6)
    for at, part in wanted.parts(np.arange(6)):
        total.insert(at, part)
    want = [second.values["loop_area"][k] for k in (3, 0)]
    np.testing.assert_array_equal(
        total.values["loop_area"],
        [
            want[0],
            first.values["loop_area"][2],
            first.values["loop_area"][0],
            want[0],
            want[1],
            np.nan,
        ],
    )
    assert total.outcome[5] == "" and total.reasons["onset_level"] == {
        2: "nothing slips",
        4: "nothing slips",
    }


def test_exact_small_files_are_packed(tmp_path):
    names = np.arange(300, dtype=np.uint64) * 7919
    found = some(300, 5)
    for first in range(0, 300, 3):
        chunks.write_chunk(
            tmp_path,
            range(first, first + 3),
            names[first : first + 3],
            found.select(np.arange(first, first + 3)),
        )
    foreign = chunks.write_chunk(tmp_path, [0], np.array([3], np.uint64), some(1, 3))
    wanted = Chunks(tmp_path, names)
    wanted.look()
    wanted.pack(False)
    # another sweep's, gone on with
    assert len(list(tmp_path.iterdir())) == 2 and (tmp_path / foreign).exists()
    wanted.look()
    ((at, part),) = wanted.parts(np.arange(300))
    assert at.tolist() == list(range(300))
    same(part, found)
    wanted.pack(True)
    assert not (tmp_path / foreign).exists()


def test_exact_a_sweep_of_columns_has_the_rows_of_one_with_summaries(swept, scene, tmp_path):
    """And at most 600 bytes a case of them, though a file has its own size."""
    assert cli("sweep", scene, *OVER, "-o", tmp_path / "a").code == 3
    assert sorted(one.name for one in swept.iterdir()) == [
        "chunks",
        "report.html",
        "sweep.csv",
        "sweep.json",
        "sweep.nc",
    ]
    own, other = (
        list(csv.DictReader(open(place / "sweep.csv", encoding="utf-8", newline="")))
        for place in (swept, tmp_path / "a")
    )
    assert len(own) == 110
    assert [one | {"case": row["case"]} for one, row in zip(own, other)] == other
    assert sum(one.stat().st_size for one in (swept / "chunks").iterdir()) < 600 * 110


@pytest.mark.share(2, 3)
@pytest.mark.parametrize("damage", ["empty", "half", "one byte", "another sign"])
def test_always_a_damaged_file_is_run_again(swept, scene, tmp_path, monkeypatch, damage):
    out = shutil.copytree(swept, tmp_path / "out")
    for path in list((out / "chunks").iterdir()):
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
    assert cli("sweep", scene, *OVER, "-o", out, "--resume", "--keep", "none").code == 3
    assert len(computed) == 110
    for name in TABLES:
        assert (out / name).read_bytes() == (swept / name).read_bytes()


def test_exact_a_folder_of_summaries_alone_is_gone_on_with(scene, tmp_path, monkeypatch):
    """As sweeps were kept before they had columns; a summary that is damaged is run again."""
    out = tmp_path / "out"
    words = ("sweep", scene, *OVER, "-o", tmp_path / "out")
    assert cli(*words).code == 3
    before = {name: (out / name).read_bytes() for name in TABLES}
    shutil.rmtree(out / "chunks")
    (next((out / "cases").iterdir()) / "summary.json").write_text("{")
    computed = ComputedCases(monkeypatch)
    assert cli(*words, "--resume").code == 3 and len(computed) == 1
    assert {name: (out / name).read_bytes() for name in TABLES} == before


def test_always_who_does_not_see_the_folder_hands_its_answers_on(
    swept, scene, tmp_path, monkeypatch
):
    """As a worker of a cluster without a common disk; there may even be a folder of the same name."""
    monkeypatch.setattr("patchfem.export.sweeps.folder.Writer.__call__", lambda *given: False)
    assert cli("sweep", scene, *OVER, "-o", tmp_path / "out", "--keep", "none").code == 3
    for name in TABLES:
        assert (tmp_path / "out" / name).read_bytes() == (swept / name).read_bytes()


@pytest.mark.parametrize("older", [False, True])
def test_a_sweep_without_room_for_its_first_case_leaves_no_folder_but_what_was_there(
    scene, tmp_path, older
):
    out = tmp_path / "out"
    if older:
        out.mkdir()
        (out / "sweep.csv").write_text("older", encoding="utf-8")
    with limited(200):  # the summary of a case wants some kB
        found = cli("sweep", scene, "--over", "drive.acceleration=1 g,2 g", "-o", out)
    assert found.code == 4 and "a case cannot be written" in found.err
    assert [place.read_text() for place in tmp_path.rglob("*") if place.is_file()] == [
        "older"
    ] * older
    assert [place.name for place in tmp_path.rglob("*") if place.is_dir()] == ["out"] * older


def test_exact_columns_on_disk_make_the_same_tables(swept, scene, tmp_path, monkeypatch):
    monkeypatch.setattr(kept, "MIN_CASES_ON_DISK", 10)
    monkeypatch.setattr(chunks, "MAX_CASES_PER_FILE", 16)
    monkeypatch.setattr(sweep, "MAX_CASES_PER_CHUNK", 16)
    out = tmp_path / "out"
    assert cli("sweep", scene, *OVER, "-o", out, "--keep", "none").code == 3
    for name in TABLES:
        assert (out / name).read_bytes() == (swept / name).read_bytes()
    assert 7 <= len(list((out / "chunks").iterdir())) <= 14
    total = CaseResults.blank(11, tmp_path)
    total.measure("loop_area", "J")
    assert isinstance(total.values["loop_area"], kept.ArrayOnDisk)
    total.values["loop_area"][[3, 5]] = 1.5, 2.5
    assert total.values["loop_area"][3:6].tolist()[::2] == [1.5, 2.5]
    assert np.isnan(total.values["loop_area"]).sum() == 9
    assert (
        np.asarray(total.values["loop_area"].reshape((11, 1))).shape
        == (11, 1)
        == np.shape(total.values["loop_area"].reshape((11, 1)))
    )
    assert not [one for one in Path(tmp_path).iterdir() if one.name != "out"]
