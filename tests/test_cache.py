"""Compiled code on disk: reused by the next process, never by an edited law, and never in the way."""

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import pytest
from scene_texts import PLASTIC, POINT, STRUCTURE

import patchfem
from patchfem import compiled

SCENE = (
    POINT + PLASTIC + STRUCTURE.replace("cycles = 30", "cycles = 4")
    + "[accuracy]\nsteps_per_cycle = 100\n"
)
MARCH = """\
import json, sys
import patchfem.runs.run as simulate
from patchfem.dynamics.march.models import load_kernels
from patchfem.scene.scene import loads
said = []
result = simulate.run(simulate.plan(loads(sys.argv[1])), say=said.append, estimate=False)
numba = "numba" in sys.modules
kind = "dynamics.contacts.element_kernels", "friction.laws.elastic_plastic_kernels"
loop = load_kernels().loop_of(kind).march
print(json.dumps({"amplitude": result.measures["relative_displacement_amplitude"].value,
                  "peak": result.measures["friction_force_peak"].value, "home": simulate.__file__, "said": said,
                  "numba": numba, "missed": sum(loop.stats.cache_misses.values()),
                  "hit": sum(loop.stats.cache_hits.values())}))
"""


def copied(folder: Path) -> Path:
    """A copy of the package under `folder` without what Python compiled."""
    shutil.copytree(Path(patchfem.__file__).parent, folder / "patchfem", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


def march(home: Path, cache: Path) -> dict:
    """A small march by the package in `home`, in a process of its own with its own cache of compiled code."""
    environment = os.environ | {"PYTHONPATH": str(home), "PATCHFEM_CACHE": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run([sys.executable, "-c", MARCH, SCENE], capture_output=True, text=True, env=environment,
                          cwd=home, timeout=300)
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert Path(answer["home"]).is_relative_to(home)
    return answer


def test_exact_an_edited_law_changes_the_answer_of_a_cached_march(tmp_path):
    home, cache = copied(tmp_path / "home"), tmp_path / "cache"
    first = march(home, cache)
    assert first["missed"] > 0 and len(first["said"]) == 1 and "compiling" in first["said"][0]
    again = march(home, cache)
    assert not again["numba"] and again["missed"] == again["hit"] == 0 and again["said"] == []
    assert (again["amplitude"], again["peak"]) == (first["amplitude"], first["peak"])
    for path in cache.rglob("*.code"):  # damaged: numba's own cache serves
        path.write_bytes(path.read_bytes()[:-1])
    third = march(home, cache)
    assert third["numba"] and third["missed"] == 0 and third["hit"] > 0 and third["said"] == []
    assert (third["amplitude"], third["peak"]) == (first["amplitude"], first["peak"])

    law = home / "patchfem" / "friction" / "laws" / "elastic_plastic_kernels.py"
    text, count = re.subn(r"(def closed\(.*?stiffness, most, start = num\[e, 2\], )",
                          r"\g<1>0.8 * ", law.read_text("utf-8"), count=1, flags=re.S)
    assert count == 1
    law.write_text(text, "utf-8")
    edited = march(home, cache)
    assert edited["missed"] > 0
    assert abs(edited["amplitude"] / first["amplitude"] - 1) > 0.05
    assert len(list((cache / "patchfem").iterdir())) == 2


def test_exact_key_follows_the_kernels_only(tmp_path, monkeypatch):
    package = copied(tmp_path) / "patchfem"
    assert sorted(package.rglob("*kernels.py"))
    same = compiled.kernel_key()
    monkeypatch.setattr(compiled, "HERE", package)
    assert compiled.kernel_key() == same
    (package / "core.py").write_text("# edited", "utf-8")
    assert compiled.kernel_key() == same
    seen = {same}
    tuples = [package / "dynamics" / name for name in compiled.TUPLES]
    for path in (*sorted(package.rglob("*kernels.py")), *tuples):
        path.write_text(path.read_text("utf-8") + "# edited\n", "utf-8")
        seen.add(compiled.kernel_key())
    (package / "mesh" / "new_kernels.py").write_text("", "utf-8")
    seen.add(compiled.kernel_key())
    monkeypatch.setattr(compiled, "version", lambda name: "0.0")
    seen.add(compiled.kernel_key())
    monkeypatch.setattr(compiled, "_cpu", lambda: "another")
    seen.add(compiled.kernel_key())
    assert len(seen) == 1 + len(list(package.rglob("*kernels.py"))) + len(tuples) + 2


def test_exact_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "mine"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "theirs"))
    found = compiled.cache_folder()
    assert found == tmp_path / "mine" / "patchfem" / compiled.kernel_key()
    assert found.is_dir() and not list(found.iterdir())
    monkeypatch.delenv("PATCHFEM_CACHE")
    assert compiled.cache_folder().is_relative_to(tmp_path / "theirs")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert compiled.cache_folder().is_relative_to(tmp_path / "home" / ".cache")


@pytest.mark.parametrize("obstacle", ["a file in the way", "no right to write"])
def test_exact_cache_falls_back(tmp_path, monkeypatch, obstacle):
    base = tmp_path / "base"
    if obstacle == "a file in the way":
        base.write_text("not a folder", "utf-8")
    else:
        base.mkdir()
        touch = Path.touch

        def refuse(self, *args, **options):
            if self.is_relative_to(base):
                raise PermissionError(13, "Permission denied", str(self))
            touch(self, *args, **options)

        monkeypatch.setattr(Path, "touch", refuse)
    (tmp_path / "temporary").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "temporary"))
    monkeypatch.setenv("PATCHFEM_CACHE", str(base))
    found = compiled.cache_folder()
    assert found.is_relative_to(tmp_path / "temporary") and found.is_dir()
    if obstacle == "a file in the way":
        (tmp_path / "temporary" / "patchfem" / compiled.kernel_key()).rmdir()
        (tmp_path / "temporary" / "patchfem").rmdir()
        (tmp_path / "temporary" / "patchfem").write_text("in the way too", "utf-8")
        last = compiled.cache_folder()
        assert last.parent == tmp_path / "temporary" and last.is_dir()
