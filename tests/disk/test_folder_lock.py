"""A results folder has one writer: simultaneous starts, killed owners, interrupted renames."""

import errno
import fcntl
import os
import subprocess
import sys

import pytest
from command_line import list_names, run_cli
from scene_texts import BENCH

from patchfem.core import Missing
from patchfem.disk import FolderLock
from patchfem.export import Folder

PYTHON = [sys.executable, "-c"]
# each of several processes tries to own every file, all at the same instants
RACE_CODE = """\
import sys
from pathlib import Path
from patchfem.core import Missing
from patchfem.disk.lock import FolderLock
place, count = Path(sys.argv[1]), int(sys.argv[2])
print("ready", flush=True)
sys.stdin.readline()
locks = []
for k in range(count):
    try:
        locks.append(FolderLock(place / str(k), k, "run"))
        locks[-1].acquire()
        print(k)
    except Missing as error:
        assert "another run (process" in str(error), error
print("done", flush=True)
sys.stdin.readline()  # owners live on until all have tried
"""
HOLD_CODE = """\
import sys
from pathlib import Path
from patchfem.disk.lock import FolderLock
FolderLock(Path(sys.argv[1]), "out", "run").acquire()
print("taken", flush=True)
sys.stdin.readline()
"""


def start_process(code: str, *words):
    """Start a Python process that runs code, with pipes to its input and output."""
    return subprocess.Popen(
        [*PYTHON, code, *map(str, words)], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def test_always_simultaneous_processes_have_single_owner(tmp_path):
    """Of several processes that start simultaneously exactly one owns each folder."""
    count = 100
    for k in range(0, count, 2):  # every second lock was left by a process that has ended
        (tmp_path / str(k)).write_text("4194305")
    processes = [start_process(RACE_CODE, tmp_path, count) for _ in range(3)]
    for child in processes:
        assert child.stdout.readline() == "ready\n"
    for child in processes:
        child.stdin.write("\n")
        child.stdin.flush()
    owned = [int(line) for child in processes for line in iter(child.stdout.readline, "done\n")]
    for child in processes:
        child.communicate()
    assert sorted(owned) == list(range(count))
    assert all(child.returncode == 0 for child in processes)


def test_refuses_second_writer_until_first_ends(tmp_path):
    """A second run into the same folder is refused until the process of the first has ended."""
    (tmp_path / "scene.toml").write_text(BENCH, "utf-8")
    command = ("run", tmp_path / "scene.toml", "-o", tmp_path / "out", "--no-page", "-q")
    lock = tmp_path / ".out.writer"
    first = start_process(HOLD_CODE, lock)
    assert first.stdout.readline() == "taken\n"
    result = run_cli(*command)
    assert result.code == 4
    assert f"another run (process {first.pid}) is writing to this" in result.err
    assert list_names(tmp_path) == {"scene.toml", ".out.writer"}
    first.kill()
    first.communicate()
    assert run_cli(*command).code == 0 and list_names(tmp_path) == {"scene.toml", "out"}


@pytest.mark.parametrize("left", ["", "4194305", "\udcff\0", "x" * 300])
def test_exact_lock_is_that_of_open_file(tmp_path, left):
    """A file that a killed owner left is taken over; a second lock is refused, and a file of another owner stays."""
    path = tmp_path / "lock"
    path.write_text(left, errors="surrogateescape")
    lock = FolderLock(path, "out", "run")
    lock.acquire()
    assert path.read_text() == str(os.getpid())
    other = FolderLock(path, "out", "run")
    with pytest.raises(Missing, match=rf"out: another run \(process {os.getpid()}\)"):
        other.acquire()
    other.release()
    assert path.exists()
    lock.release()
    lock.release()
    assert not path.exists()

    # the user removes the file of an owner, and another process takes its place
    lock.acquire()
    path.unlink()
    other.acquire()
    lock.release()
    assert path.exists()
    other.release()
    assert not path.exists()


def test_disk_without_locks_lets_all_writers_through(tmp_path, monkeypatch):
    """Where the disk refuses every lock, a second writer is not refused, and each removes its file without an error."""

    def refuse(file, operation):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", refuse)
    path = tmp_path / "lock"
    locks = [FolderLock(path, "out", "run") for _ in range(2)]
    for lock in locks:
        lock.acquire()
        assert path.read_text() == str(os.getpid())
    for lock in locks:
        lock.release()
    assert not path.exists()


def test_refuses_to_remove_foreign_files(tmp_path):
    """Folders with files that the program did not write are not removed."""
    for name in ("out", "out.partial", ".out.old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.txt").write_text("mine")
        with pytest.raises(Exception, match=r"mine\.txt"), Folder(tmp_path / "out"):
            pass
        assert list_names(tmp_path) == {name}
        (tmp_path / name / "mine.txt").unlink()
        (tmp_path / name).rmdir()
