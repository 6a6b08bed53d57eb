"""Windows and macOS: the verbs run without what only Linux has, and write only files that Windows accepts.

`support/other_system/sitecustomize.py` hides modules, signals, functions and folders of Linux from the verbs and their
worker processes, and logs names that Windows refuses and open files that are renamed or removed, which it refuses too.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType

import pytest
from scene_texts import BENCH, COULOMB, PLASTIC, POINT

from patchfem.core import Missing
from patchfem.disk import lock
from patchfem.scene import scene as scenes

WORN = Path(__file__).parents[2] / "studies/wear"
INTERFACE = f"""
[[structure.interface]]
between = [1, 0]
{PLASTIC.removeprefix("[friction]")}
[structure.interface.contact]
length = "10 mm"
width = "10 mm"
height = "8 mm"
load = "100 N"
substrate = "steel"
element_size = "2 mm"
"""
TWO_INTERFACES = f"""\
[structure]
masses = ["1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "2e6 N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "20 N s/m"
{INTERFACE}{INTERFACE}
[drive]
kind = "base"
frequency = "240 Hz"
acceleration = "8 g"
cycles = 10
[accuracy]
tolerance = 1e-2
"""
HIDING = Path(__file__).parents[1] / "support/other_system"
PACKAGE = Path(lock.__file__).parents[2]
WARNINGS = ("-X", "warn_default_encoding", "-W", "default::EncodingWarning")


def run_elsewhere(folder: Path, *words) -> str:
    """Run `patchfem WORDS` on a system without what only Linux has; return what it prints."""
    settings = {"PYTHONPATH": f"{HIDING}:{PACKAGE}", "PATCHFEM_REFUSALS": str(folder / "refusals")}
    process = subprocess.run(
        [sys.executable, *WARNINGS, "-m", "patchfem", *map(str, words)],
        cwd=folder,
        env=os.environ | settings,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert process.returncode == 0, process.stderr
    # Windows has another default encoding
    assert not re.search(rf"{PACKAGE}.*EncodingWarning", process.stderr), process.stderr
    return process.stdout


@pytest.mark.parametrize("keep", ["none", "pages"])
def test_sweep_elsewhere(tmp_path, keep):
    """A bench, a sweep in two processes, its continuation and `doctor` run, and write nothing that Windows refuses."""
    folder = tmp_path / "files"
    folder.mkdir()
    (folder / "a loop.toml").write_text(
        'title = "a:b*c? <d> con. \\\\ |"\n' + BENCH + "cycles = 2\n"
    )
    assert "patchfem" in run_elsewhere(folder, "doctor")
    run_elsewhere(folder, "run", "a loop.toml")
    sweep = (
        "sweep",
        "a loop.toml",
        "--over",
        "slide.amplitude=5 um,10 um",
        "-j",
        2,
        "--keep",
        keep,
    )
    table = folder / "out/a loop-sweep/sweep.csv"
    run_elsewhere(folder, *sweep)
    text = table.read_text("utf-8")
    table.unlink()
    run_elsewhere(folder, *sweep, "--resume")
    assert table.read_text("utf-8") == text
    assert (folder / "refusals").read_text() == ""


def test_names_of_all_files(tmp_path):
    """Two interfaces between the same masses, the exports of their run and a comparison of traces have names for Windows."""
    scene = tmp_path / "two.toml"
    scene.write_text(TWO_INTERFACES)
    run_elsewhere(tmp_path, "run", scene, "-o", "out/two")
    folders = sorted((tmp_path / "out/two/interfaces").iterdir())
    assert [folder.name for folder in folders] == ["1-0_1", "1-0_2"]
    run_elsewhere(tmp_path, "export", folders[1], "-o", "fields.pvd")
    run_elsewhere(tmp_path, "export", "out/two", "--histories", "-o", "histories.csv")
    run_elsewhere(tmp_path, "report", "out/two", "-o", "page.html")
    run_elsewhere(tmp_path, "compare", WORN / "before.csv", WORN / "after.csv", "--direction", "x")
    assert (tmp_path / "refusals").read_text() == ""


class FakeMsvcrt(ModuleType):
    """Module `msvcrt`, whose lock of a byte belongs to a descriptor."""

    LK_NBLCK = 2

    def __init__(self):
        super().__init__("msvcrt")
        self.owners = {}

    def locking(self, file: int, mode: int, n_bytes: int) -> None:
        """Lock bytes from the present place of the file on; PermissionError if another descriptor has locked them."""
        assert mode == self.LK_NBLCK and n_bytes == 1
        place = os.fstat(file).st_ino, os.lseek(file, 0, os.SEEK_CUR)
        assert place[1] >= lock.MAX_LOCK_BYTES
        if self.owners.setdefault(place, file) != file:
            raise PermissionError(13, "Permission denied")


def test_lock_of_windows(tmp_path, monkeypatch):
    """Without fcntl a second writer is refused, by a lock of a byte that it does not read."""
    monkeypatch.setattr(lock, "fcntl", None)
    monkeypatch.setitem(sys.modules, "msvcrt", FakeMsvcrt())
    path = tmp_path / "lock"
    owner = lock.FolderLock(path, "out", "run")
    owner.acquire()
    with pytest.raises(Missing, match=rf"another run \(process {os.getpid()}\)"):
        lock.FolderLock(path, "out", "run").acquire()
    owner.release()
    assert not path.exists()


def test_files_on_another_drive(tmp_path, monkeypatch):
    """A file on another drive keeps its absolute name in the scene; relative names have slashes."""
    scene = tmp_path / "scene.toml"
    scene.write_text(POINT + COULOMB + '[slide]\nkind = "file"\nfile = "loop.csv"\n')
    (tmp_path / "loop.csv").write_text("time [s],slide [um]\n0,0\n1,3\n2,0\n")
    resolved = scenes.load(scene).resolved(tmp_path / "out")
    assert 'file = "../loop.csv"' in resolved

    def refuse(path, start=None):
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr(os.path, "relpath", refuse)
    assert f'file = "{tmp_path.as_posix()}/loop.csv"' in scenes.load(scene).resolved(
        tmp_path / "out"
    )
