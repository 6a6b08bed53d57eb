"""A folder has one writer: starts at one instant, killed owners, numbers given again, kills between renames."""

import os
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from command_line import run_cli
from limits import limit_file_size
from scene_texts import BENCH

from patchfem.core import Missing
from patchfem.disk import FolderLock, exchange
from patchfem.disk.lock import HOST_HASH, OWN_LOCK_PATHS, is_running, read_start_ticks
from patchfem.export import Folder
from patchfem.export.sweeps.folder import Folder as SweepFolder
from patchfem.export.sweeps.folder import Writer
from patchfem.runs import CaseResults

PYTHON = [sys.executable, "-c"]
# each of several processes tries to own every file, all at the same instants
RACE = """\
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
HOLD = """\
import sys
from pathlib import Path
from patchfem.disk.lock import FolderLock
FolderLock(Path(sys.argv[1]), "out", "run").acquire()
print("taken", flush=True)
sys.stdin.readline()
"""
KILLED = """\
import os, sys
from pathlib import Path
from patchfem.disk import exchange
from patchfem.export.results import Folder
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


def process(code: str, *words):
    return subprocess.Popen(
        [*PYTHON, code, *map(str, words)], text=True, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    )


def names(place: Path) -> set:
    return {one.name for one in place.iterdir()}


def test_always_one_of_many_that_start_at_one_instant_owns_a_folder(tmp_path):
    count = 100
    for k in range(0, count, 2):  # every second one was left by a dead process
        (tmp_path / str(k)).write_text(f"4194305 17 {HOST_HASH}")
    several = [process(RACE, tmp_path, count) for _ in range(3)]
    for one in several:
        assert one.stdout.readline() == "ready\n"
    for one in several:
        one.stdin.write("\n")
        one.stdin.flush()
    won = [int(line) for one in several for line in iter(one.stdout.readline, "done\n")]
    for one in several:
        one.communicate()
    assert sorted(won) == list(range(count))
    assert all(one.returncode == 0 for one in several)


def test_refuses_a_second_writer_until_the_first_is_gone(tmp_path):
    (tmp_path / "scene.toml").write_text(BENCH, "utf-8")
    words = ("run", tmp_path / "scene.toml", "-o", tmp_path / "out", "--no-page", "-q")
    lock = tmp_path / ".out.writer"
    first = process(HOLD, lock)
    assert first.stdout.readline() == "taken\n"
    answer = run_cli(*words)
    assert answer.code == 4
    assert f"another run (process {first.pid}) is writing to this" in answer.err
    assert names(tmp_path) == {"scene.toml", ".out.writer"}
    first.kill()
    while not (Path(f"/proc/{first.pid}/stat").read_text().split(") ")[1].startswith("Z")):
        pass
    assert not is_running(first.pid)  # nobody has waited for it, but it works no more
    assert run_cli(*words).code == 0 and names(tmp_path) == {"scene.toml", "out"}
    first.communicate()


def test_exact_an_owner_is_a_number_a_start_and_a_machine(tmp_path):
    path = tmp_path / "lock"
    pid = os.getppid()
    own = FolderLock(path, "out", "run")
    for text, free in (
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
    ):  # its own, which never ended
        path.write_text(text, errors="surrogateescape")
        if free:
            own.acquire()
            assert path.read_text() == own.owner and path in OWN_LOCK_PATHS
            with pytest.raises(Missing):  # another thread
                FolderLock(path, "out", "run").acquire()
            own.release()
            assert not path.exists() and path not in OWN_LOCK_PATHS
        else:
            with pytest.raises(
                Missing, match="of another machine" if "01234567" in text else r"process \d+\)"
            ):
                own.acquire()
            assert path.read_text() == text
    path.write_text("4194305")
    own.release()  # what another one owns stays
    assert path.read_text() == "4194305"
    assert read_start_ticks(os.getpid()).isdecimal()
    assert not is_running(4194305)
    assert is_running(os.getpid())


def test_refuses_a_claim_through_a_link_or_in_the_way(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "link").symlink_to(tmp_path / "mine.txt")
    (tmp_path / "folder").mkdir()
    for name in ("link", "folder", "none/lock"):
        with pytest.raises(Missing, match="out: cannot be written"):
            FolderLock(tmp_path / name, "out", "run").acquire()
    assert (tmp_path / "mine.txt").read_text() == "mine" and names(tmp_path) == {
        "mine.txt",
        "link",
        "folder",
    }


def test_exact_a_claim_whose_name_has_no_room_leaves_nothing(tmp_path):
    """Part of a name once stayed behind, which no process could own or remove."""
    with limit_file_size(5):
        with pytest.raises(Missing, match=r"out: cannot be written.* \((No space left|File too)"):
            FolderLock(tmp_path / "lock", "out", "run").acquire()
        with pytest.raises(Missing, match="out: cannot be written"):
            SweepFolder(tmp_path / "out", [1]).__enter__()
    assert not names(tmp_path)


def test_refuses_a_second_sweep_and_leaves_the_first_its_folder(tmp_path):
    """It once removed the folder of the answers, which was empty still, and the first one failed at its first case."""
    with SweepFolder(tmp_path / "out", [1]) as first:
        with pytest.raises(Missing, match="another sweep"), SweepFolder(tmp_path / "out", [1]):
            pass
        writer = Writer(tmp_path / "out", "out", first.chunks.names, "summaries", first.token)
        assert writer([0], CaseResults.blank(1), ["{}"])
    assert names(tmp_path / "out" / "cases" / f"{1:016x}") == {"summary.json"}
    assert len(names(tmp_path / "out" / "chunks")) == 1


def test_exact_exchange_leaves_nothing_behind(tmp_path):
    for text in ("first", "second"):
        with Folder(tmp_path / "out") as folder:
            (folder.path / "summary.json").write_text(text)
            (folder.path / "fields_frames").mkdir()
        assert names(tmp_path) == {"out"}
        assert (tmp_path / "out" / "summary.json").read_text() == text


def test_always_there_is_a_folder_at_every_instant_of_an_exchange(tmp_path):
    """A reader in a thread never misses the folder: with two renames it would."""
    place = tmp_path / "out"
    new = tmp_path / "new"
    for one in place, new:
        one.mkdir()
    if not exchange.exchange_folders(new, place):
        pytest.skip("this file system cannot exchange two folders")
    missed = []
    end = threading.Event()

    def look():
        while not end.is_set():
            try:
                os.stat(place)
            except FileNotFoundError:
                missed.append(1)

    reader = threading.Thread(target=look)
    reader.start()
    for _ in range(300):
        new.mkdir(exist_ok=True)
        exchange.replace_folder(new, place)
    end.set()
    reader.join()
    assert not missed


@pytest.mark.parametrize(
    "n_moved, left",
    [
        (0, {"out", "out.partial", ".out.writer"}),
        (1, {".out.old", "out.partial", ".out.writer"}),
        (2, {"out", ".out.old", ".out.writer"}),
        (9, {"out"}),
    ],
    ids=["before", "between", "behind", "never"],
)
def test_exact_a_kill_between_two_renames_loses_nothing(tmp_path, n_moved, left):
    out = tmp_path / "out"
    out.mkdir()
    (out / "summary.json").write_text("older")
    code = KILLED
    if n_moved == 2:  # killed before the older folder is removed
        code = KILLED.replace(
            "moved = os.rename, []",
            "moved = os.rename, []\n"
            "exchange.shutil.rmtree = lambda path, **_: path.exists() and os._exit(9)",
        )
    done = subprocess.run([*PYTHON, code, out, str(n_moved)])
    assert done.returncode == (0 if n_moved == 9 else 9) and names(tmp_path) == left
    with pytest.raises(ZeroDivisionError), Folder(out) as folder:
        assert (out / "summary.json").read_text() == ("older" if n_moved < 2 else "new")
        raise ZeroDivisionError
    assert folder.target == out and names(tmp_path) == {"out"}


def test_refuses_to_remove_what_is_not_its_own(tmp_path):
    for name in ("out", "out.partial", ".out.old"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "mine.txt").write_text("mine")
        with pytest.raises(Exception, match=r"mine\.txt"), Folder(tmp_path / "out"):
            pass
        assert names(tmp_path) == {name}
        (tmp_path / name / "mine.txt").unlink()
        (tmp_path / name).rmdir()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_exact_a_signal_in_the_exchange_waits_until_it_is_done(tmp_path, monkeypatch, number):
    before = signal.signal(number, signal.default_int_handler)
    real = exchange.exchange_folders
    monkeypatch.setattr(
        exchange, "exchange_folders", lambda *both: signal.raise_signal(number) or real(*both)
    )
    try:
        (tmp_path / "out").mkdir()
        with pytest.raises(KeyboardInterrupt), Folder(tmp_path / "out") as folder:
            (folder.path / "summary.json").write_text("new")
        assert signal.getsignal(number) is signal.default_int_handler
    finally:
        signal.signal(number, before)
    assert names(tmp_path) == {"out"} and (tmp_path / "out" / "summary.json").read_text() == "new"
