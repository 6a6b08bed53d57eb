"""A results folder has one writer: simultaneous starts, killed owners, reused process numbers, interrupted renames."""

import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from command_line import run_cli
from scene_texts import BENCH

from patchfem.core import Missing
from patchfem.disk import FolderLock, exchange
from patchfem.disk.lock import HOST_HASH, OWN_LOCK_PATHS, is_running, read_start_ticks
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
for k in range(count):
    try:
        FolderLock(place / str(k), k, "run").acquire()
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
KILLED_CODE = """\
import os, sys
from pathlib import Path
from patchfem.disk import exchange
from patchfem.export.folder import Folder
exchange.exchange_folders = lambda *both: False  # a system that cannot
real, moved = os.rename, []
def rename(*both):
    if len(moved) == int(sys.argv[2]):
        os._exit(9)  # killed
    moved.append(real(*both))
with Folder(Path(sys.argv[1])) as folder:
    (folder.path / "summary.json").write_text("new")
    os.rename = rename
"""


def start_process(code: str, *words):
    """Start a Python process that runs code, with pipes to its input and output."""
    return subprocess.Popen(
        [*PYTHON, code, *map(str, words)], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def list_names(folder: Path) -> set:
    """Return the names in a folder."""
    return {path.name for path in folder.iterdir()}


def test_always_simultaneous_processes_have_single_owner(tmp_path):
    """Of several processes that start simultaneously exactly one owns each folder."""
    count = 100
    for k in range(0, count, 2):  # every second lock was left by a process that has ended
        (tmp_path / str(k)).write_text(f"4194305 17 {HOST_HASH}")
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
    while not (Path(f"/proc/{first.pid}/stat").read_text().split(") ")[1].startswith("Z")):
        pass
    assert not is_running(
        first.pid
    )  # a zombie process: its parent has not waited for it, but it has ended
    assert run_cli(*command).code == 0 and list_names(tmp_path) == {"scene.toml", "out"}
    first.communicate()


def test_exact_lock_owner_is_process_start_and_host(tmp_path):
    """A lock is free if its process number, start time and host show that the owner has ended."""
    path = tmp_path / "lock"
    pid = os.getppid()
    lock = FolderLock(path, "out", "run")
    for text, is_free in (
        (f"{pid} {read_start_ticks(pid)} {HOST_HASH}", False),
        (f"{pid} 17 {HOST_HASH}", True),
        (f"{pid} - {HOST_HASH}", False),
        (str(pid), False),
        ("4194305", True),
        ("", True),
        ("\udcff\0", True),
        ("x" * 300, True),
        (f"{pid} 17 01234567", False),
        (f"4194305 17 {HOST_HASH}", True),
        (f"{os.getpid()} {read_start_ticks(os.getpid())} {HOST_HASH}", True),
    ):  # its own lock, which was not released
        path.write_text(text, errors="surrogateescape")
        if is_free:
            lock.acquire()
            assert path.read_text() == lock.owner and path in OWN_LOCK_PATHS
            with pytest.raises(Missing):  # a second lock of the same process
                FolderLock(path, "out", "run").acquire()
            lock.release()
            assert not path.exists() and path not in OWN_LOCK_PATHS
        else:
            with pytest.raises(
                Missing, match="of another machine" if "01234567" in text else r"process \d+\)"
            ):
                lock.acquire()
            assert path.read_text() == text
    path.write_text("4194305")
    lock.release()  # a lock of another owner is not removed
    assert path.read_text() == "4194305"
    assert read_start_ticks(os.getpid()).isdecimal()
    assert not is_running(4194305)
    assert is_running(os.getpid())


def test_always_folder_exists_during_exchange(tmp_path):
    """A reader finds the folder at every instant of an exchange, which two renames would not ensure."""
    target = tmp_path / "out"
    replacement = tmp_path / "new"
    for folder in target, replacement:
        folder.mkdir()
    if not exchange.exchange_folders(replacement, target):
        pytest.skip("this file system cannot exchange two folders")
    failures = []
    stop = threading.Event()

    def poll_folder():
        while not stop.is_set():
            try:
                os.stat(target)
            except FileNotFoundError:
                failures.append(1)

    reader = threading.Thread(target=poll_folder)
    reader.start()
    for _ in range(300):
        replacement.mkdir(exist_ok=True)
        exchange.replace_folder(replacement, target)
    stop.set()
    reader.join()
    assert not failures


@pytest.mark.parametrize(
    "n_moved, expected_names",
    [
        (0, {"out", "out.partial", ".out.writer"}),
        (1, {".out.old", "out.partial", ".out.writer"}),
        (2, {"out", ".out.old", ".out.writer"}),
        (9, {"out"}),
    ],
    ids=["before", "between", "behind", "never"],
)
def test_exact_kill_between_renames_preserves_results(tmp_path, n_moved, expected_names):
    """After a kill between two renames the next run restores the older or the newer results."""
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("older")
    code = KILLED_CODE
    if n_moved == 2:  # killed before the older folder is removed
        code = KILLED_CODE.replace(
            "moved = os.rename, []",
            "moved = os.rename, []\n"
            "exchange.shutil.rmtree = lambda path, **_: path.exists() and os._exit(9)",
        )
    done = subprocess.run([*PYTHON, code, out, str(n_moved)])
    assert done.returncode == (0 if n_moved == 9 else 9) and list_names(tmp_path) == expected_names
    with pytest.raises(ZeroDivisionError), Folder(out) as folder:
        assert (out / "summary.json").read_text() == ("older" if n_moved < 2 else "new")
        raise ZeroDivisionError
    assert folder.target == out and list_names(tmp_path) == {"out"}


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
