"""Files are whole or not there: every kind of file under limits on its size, devices, and what killed writers leave."""

import errno
import io
import os
import stat
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from command_line import run_cli
from limits import limit_file_size
from scene_texts import BENCH, COATED

from patchfem.core import Missing
from patchfem.disk import (
    is_partial_name,
    open_lossy,
    write_atomically,
    write_in_partial_folder,
    write_text,
)
from patchfem.disk.atomic_write import PLACED_PATHS, find_free_space, make_partial_path

SIZES = [1 << 10, 1 << 14, 1 << 16]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """(scene, results folder) of pressed pieces."""
    place = tmp_path_factory.mktemp("results")
    (place / "scene.toml").write_text(COATED, "utf-8")
    assert run_cli("run", place / "scene.toml", "-o", place / "out", "--no-page").code == 0
    return place / "scene.toml", place / "out"


@pytest.mark.parametrize("size", SIZES)
def test_always_a_run_without_room_names_path_need_and_room_and_keeps_the_older_results(
    results, tmp_path, size
):
    scene = tmp_path / "scene.toml"
    out = tmp_path / "out"
    scene.write_text(COATED, "utf-8")
    out.mkdir()
    (out / "summary.json").write_text("older")
    with limit_file_size(size):
        answer = run_cli("run", scene, "-o", out)
    assert (
        answer.code == 4 and len(answer.err.splitlines()) == 1 and "out.partial/" in answer.err
    ), answer.err
    assert "needed" in answer.err
    assert f"{size / 1e3:.3g} kB is the limit on the size of a file" in answer.err
    assert [one.name for one in out.iterdir()] == ["summary.json"] and (
        out / "summary.json"
    ).read_text() == "older"
    assert sorted(one.name for one in tmp_path.iterdir()) == ["out", "scene.toml"]


def test_exact_a_process_without_room_ends_with_4_and_not_by_a_signal(tmp_path):
    """HDF5 once wrote again what had not enough space when the process ended with a thread at work, and died of it."""
    (tmp_path / "scene.toml").write_text(COATED, "utf-8")
    code = (
        "import resource, threading; resource.setrlimit(resource.RLIMIT_FSIZE, (65536, 65536)); "
        "threading.Thread(target=threading.main_thread().join).start(); from patchfem.__main__ import main; main()"
    )
    done = subprocess.run(
        [sys.executable, "-B", "-c", code, "run", tmp_path / "scene.toml", "-o", tmp_path / "out"],
        text=True,
        capture_output=True,
        timeout=120,
    )
    assert (
        done.returncode == 4
        and "not enough space" in done.stderr
        and "Traceback" not in done.stderr
    ), done.stderr
    assert [one.name for one in tmp_path.iterdir()] == ["scene.toml"]


@pytest.mark.parametrize(
    "words",
    [
        ("mesh", "SCENE", "-o", "a.msh"),
        ("mesh", "SCENE", "-o", "a.vtu"),
        ("export", "OUT", "-o", "a.vtkhdf"),
        ("export", "OUT", "-o", "a.vtu"),
        ("export", "OUT", "-o", "a.pvd"),
        ("export", "OUT", "-o", "a.csv"),
        ("report", "OUT", "-o", "a.html"),
        ("schema", "-o", "a.json"),
        ("view", "OUT", "-o", "a.svg"),
    ],
    ids=" ".join,
)
def test_always_every_file_is_the_older_one_where_there_is_no_room(
    results, tmp_path, monkeypatch, words
):
    monkeypatch.chdir(tmp_path)
    name = words[-1]
    Path(name).write_text("older")
    with limit_file_size(2048):
        answer = run_cli(
            *({"SCENE": results[0], "OUT": results[1]}.get(word, word) for word in words)
        )
    assert (
        answer.code == 4
        and "not enough space" in answer.err
        and "2.05 kB is the limit" in answer.err
    ), answer.err
    assert len(answer.err.splitlines()) == 1
    assert Path(name).read_text() == "older"
    assert [
        one for one in tmp_path.rglob("*") if one.is_file() and one.stat().st_size == 2048
    ] == []
    assert {one.name for one in tmp_path.iterdir()} <= {name, "a_frames"}


@pytest.mark.skipif(
    not Path("/dev/full").exists(), reason="a device that is always full is Linux's"
)
def test_exact_a_device_is_written_and_stays_a_device(tmp_path):
    for device, code in ("/dev/full", 4), ("/dev/null", 0):
        answer = run_cli("schema", "-o", device)
        assert answer.code == code and stat.S_ISCHR(os.stat(device).st_mode)
        assert not code or "/dev/full: not enough space (No space left on device)" in answer.err


@pytest.mark.parametrize("size", [0, 100, 2048, 5000, 40_000, 81_000])
def test_exact_hdf5_closes_in_good_order_however_little_room_there_is(tmp_path, size):
    data = np.arange(10_000.0)
    with (
        limit_file_size(size),
        pytest.raises(OSError) as caught,
        open_lossy(tmp_path / "a.h5") as kept,
        h5py.File(kept, "w") as file,
    ):
        file["a"] = data
        file.flush()
        file["b"] = file["a"][::2] + 1
    assert caught.value.errno == 27 and not file and (tmp_path / "a.h5").stat().st_size <= size


@pytest.mark.parametrize("raised", [ValueError, KeyboardInterrupt, OSError])
def test_exact_what_is_not_whole_replaces_nothing(tmp_path, raised):
    path = tmp_path / "a.txt"
    path.write_text("older")
    with pytest.raises(Missing if raised is OSError else raised), write_atomically(path) as partial:
        partial.write_text("new")
        raise raised("an end")
    assert [one.name for one in tmp_path.iterdir()] == ["a.txt"] and path.read_text() == "older"
    write_text(path, "größer")
    assert path.read_bytes() == "größer".encode() and [one.name for one in tmp_path.iterdir()] == [
        "a.txt"
    ]
    assert PLACED_PATHS[-1] == path


def test_exact_what_a_killed_writer_left_goes_with_the_next_one_of_the_name(tmp_path):
    path = tmp_path / "a.vtu"
    name = make_partial_path(tmp_path / "a.vtu").name
    # beyond the largest number of a process
    dead = tmp_path / name.replace(str(os.getpid()), "4194305")
    living = tmp_path / name.replace(str(os.getpid()), str(os.getppid()))
    other = tmp_path / name.replace(str(os.getpid()), "4194305").replace(".a.", ".b.")
    for one in dead, living, other, tmp_path / ".a.mine.vtu":
        one.write_text("half")
        assert is_partial_name(one.name) == (one.name != ".a.mine.vtu")
    write_text(path, "new")
    assert {one.name for one in tmp_path.iterdir()} == {
        living.name,
        other.name,
        ".a.mine.vtu",
        "a.vtu",
    }


def test_refuses_before_it_writes_what_has_no_room(tmp_path):
    space = find_free_space(tmp_path / "not" / "yet" / "a")
    assert space.size > 0 and ("free" in space.limit or "limit" in space.limit)
    with limit_file_size(100):
        limit = "is the limit on the size of a file (ulimit -f)"
        assert find_free_space(tmp_path / "a") == (100, limit, True)
        with (
            pytest.raises(
                Missing, match=r"a: not enough space: 101 bytes needed, 100 bytes is the limit"
            ),
            write_atomically(tmp_path / "a", 101),
        ):
            raise AssertionError("written")
        write_text(tmp_path / "a", "x" * 100)
    assert (tmp_path / "a").stat().st_size == 100


def test_refuses_a_place_that_cannot_be_written(tmp_path):
    (tmp_path / "folder").mkdir()
    for place in tmp_path / "folder", tmp_path / "none" / "a", tmp_path / ("a" * 300):
        with pytest.raises(Missing, match="cannot be written"):
            write_text(place, "text")
    assert [one.name for one in tmp_path.iterdir()] == ["folder"] and not list(
        (tmp_path / "folder").iterdir()
    )


def test_exact_a_sweep_without_room_keeps_its_cases(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(BENCH, "utf-8")
    words = ("sweep", scene, "--over", "friction.static=0.1,0.2", "-o", tmp_path / "out", "-q")
    with limit_file_size(8192):  # a summary has room, the table with the page has not
        answer = run_cli(*words)
    assert answer.code == 4 and "not enough space" in answer.err and "out/" in answer.err
    assert len(list((tmp_path / "out" / "cases").iterdir())) == 2
    assert not [one for one in (tmp_path / "out").rglob("*") if one.name.startswith(".")]
    assert run_cli(*words, "--resume").code == 0


class InterruptedStream(io.StringIO):
    """A stdout at which the user presses Ctrl-C."""

    def write(self, text: str) -> int:
        """Interrupt the process in place of printing."""
        raise KeyboardInterrupt


def test_exact_an_interrupt_after_a_file_is_in_place_names_the_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.json").write_text("older")
    answer = run_cli("schema", "-o", "a.json", stdout=InterruptedStream())
    assert answer.code == 130 and answer.err == "interrupted; already complete: a.json\n"
    assert Path("a.json").read_text() != "older"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_exact_an_interrupt_before_a_file_is_replaced_says_that(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("a.json").write_text("older")

    def interrupt(*paths):
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "replace", interrupt)
    answer = run_cli("schema", "-o", "a.json")
    assert answer.code == 130 and answer.err == "interrupted; no file was replaced\n"
    assert Path("a.json").read_text() == "older"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


def test_always_a_file_inside_a_draft_without_room_names_need_and_room(tmp_path):
    with (
        limit_file_size(1000),
        pytest.raises(
            Missing, match=r"a\.json: not enough space.*: 2 kB needed, 1 kB is the limit"
        ),
    ):
        write_in_partial_folder(tmp_path / "a.json", 2000 * "x")
    write_in_partial_folder(tmp_path / "a.json", "\udce4 is no letter")
    assert (tmp_path / "a.json").read_text() == "? is no letter"


def test_exact_a_full_table_of_files_is_told_as_that(tmp_path, monkeypatch):
    """It said how many bytes were free, beside the few that were wanted."""
    place = os.statvfs(tmp_path)
    for found, said in (
        ((9, 0), "inodes"),
        ((9, 5), "needed"),
        ((0, 0), "needed"),
    ):  # the last has no such table
        full = SimpleNamespace(
            f_files=found[0], f_favail=found[1], f_bavail=place.f_bavail, f_frsize=place.f_frsize
        )
        monkeypatch.setattr(os, "statvfs", lambda path, full=full: full)
        with pytest.raises(Missing, match=said), write_atomically(tmp_path / "a"):
            raise OSError(errno.ENOSPC, "No space left on device")


@pytest.mark.parametrize("words", [("run",), ("sweep", "--over", "friction.static=0.2,0.3")])
def test_always_a_folder_under_a_file_names_the_file(tmp_path, words):
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "FILE").write_text("")
    answer = run_cli(words[0], tmp_path / "bench.toml", *words[1:], "-o", tmp_path / "FILE" / "x")
    assert answer.code == 4
    assert f"{tmp_path / 'FILE'} is a file; choose another folder" in answer.err


def test_always_a_name_that_is_too_long_wants_a_shorter_one(tmp_path):
    (tmp_path / "bench.toml").write_text(BENCH)
    answer = run_cli("run", tmp_path / "bench.toml", "-o", tmp_path / ("a" * 250))
    assert answer.code == 4 and answer.err.rstrip().endswith("use a shorter name")


def test_always_a_working_folder_that_is_gone_is_named(tmp_path, monkeypatch):
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "gone").mkdir()
    monkeypatch.chdir(tmp_path / "gone")
    (tmp_path / "gone").rmdir()
    answer = run_cli("run", tmp_path / "bench.toml")
    assert answer.code == 4
    assert "the working folder no longer exists; change to an existing one" in answer.err
