"""Compiled code on disk: reused by the next process, never by an edited law, and never in the way."""

import json
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace
from zipfile import ZipFile

import numba
import pytest
from limits import limited
from scene_texts import PLASTIC, POINT, TRIANGLE
from test_inner import CALLS, KERNELS

import patchfem
from patchfem import compiled
from patchfem.compiled import cache_files, hook, prebuilt
from patchfem.disk import user_cache

# a slide that is given: the smallest loop with a law in it to compile
SCENE = POINT + PLASTIC + TRIANGLE
BENCH = """\
import json, sys
import patchfem.runs.run as simulate
from patchfem.scene.scene import loads
said = []
result = simulate.run(simulate.plan(loads(sys.argv[1])), say=said.append, estimate=False)
print(json.dumps({"work": result.measures["loop_area"].value,
                  "peak": result.measures["friction_force_peak"].value, "home": simulate.__file__, "said": said,
                  "numba": "numba" in sys.modules}))
"""


def copied(folder: Path) -> Path:
    """A copy of the package under `folder` without what Python compiled."""
    shutil.copytree(
        Path(patchfem.__file__).parent,
        folder / "patchfem",
        ignore=shutil.ignore_patterns("__pycache__"),
    )
    return folder


def slid(home: Path, cache: Path) -> dict:
    """A short slide by the package in `home`, in a process of its own with its own cache of compiled code."""
    environment = os.environ | {"PYTHONPATH": str(home), "PATCHFEM_CACHE": str(cache)}
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run(
        [sys.executable, "-c", BENCH, SCENE],
        capture_output=True,
        text=True,
        env=environment,
        cwd=home,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert Path(answer["home"]).is_relative_to(home)
    return answer


def begun(cache: Path, code: str = BENCH) -> subprocess.Popen:
    """A process that slides as `slid` does, or that runs other code."""
    return subprocess.Popen(
        [sys.executable, "-c", code, SCENE],
        stdout=subprocess.PIPE,
        text=True,
        env=os.environ | {"PATCHFEM_CACHE": str(cache)},
    )


@pytest.fixture(scope="module")
def place(tmp_path_factory):
    """The cache of `answers`."""
    return tmp_path_factory.mktemp("empty")


@pytest.fixture(scope="module")
def answers(place):
    """What two processes answer that begin at once on an empty cache, first the one that compiled."""
    both = [begun(place) for _ in range(2)]
    return sorted(
        (json.loads(one.communicate(timeout=300)[0]) for one in both),
        key=lambda one: not one["numba"],
    )


def test_exact_of_two_processes_on_an_empty_cache_one_compiles(answers):
    assert [one["numba"] for one in answers] == [True, False]
    assert len({(one["work"], one["peak"]) for one in answers}) == 1


def test_always_another_takes_over_from_a_process_that_is_killed_while_it_compiles(tmp_path):
    (tmp_path / "some_kernels.py").write_text(KERNELS, "utf-8")
    calls = CALLS.format(tmp_path / "some_kernels.py")
    mark = tmp_path / "compiles"
    stuck = begun(
        tmp_path,
        f"""
import pathlib, time
from patchfem.compiled import machine
def compile_and_store(*arguments):
    pathlib.Path({str(mark)!r}).touch()
    time.sleep(600)
machine.compile_and_store = compile_and_store
"""
        + calls,
    )
    end = time.monotonic() + 120
    while not mark.exists() and time.monotonic() < end:
        time.sleep(0.05)
    waits = tmp_path / "waits"
    other = begun(
        tmp_path,
        f"""
import pathlib, time
from patchfem import compiled
def sleep(seconds):
    pathlib.Path({str(waits)!r}).touch()
    time.sleep(seconds)
compiled.sleep = sleep
"""
        + calls,
    )
    while not waits.exists() and time.monotonic() < end:
        time.sleep(0.05)
    assert waits.exists() and other.poll() is None and not list(tmp_path.rglob("*.code"))
    stuck.kill()
    assert other.communicate(timeout=300)[0].split()[:2] == ["6.0", "True"]
    assert list(tmp_path.rglob("*.code"))
    stuck.communicate()


def test_exact_an_edited_law_changes_the_answer_of_a_cached_bench(tmp_path, place, answers):
    home = copied(tmp_path / "home")
    cache = shutil.copytree(place, tmp_path / "cache")
    first = answers[0]
    assert first["numba"] and len(first["said"]) == 1 and "compiling" in first["said"][0]
    again = slid(home, cache)
    assert not again["numba"] and again["said"] == []
    assert (again["work"], again["peak"]) == (first["work"], first["peak"])

    law = home / "patchfem" / "friction" / "laws" / "elastic_plastic_kernels.py"
    text, count = re.subn(
        r"(def update_memory\(.*?stiffness = )(?=numbers\[2 \+ j\])",
        r"\g<1>0.8 * ",
        law.read_text("utf-8"),
        count=1,
        flags=re.S,
    )
    assert count == 1
    law.write_text(text, "utf-8")
    edited = slid(home, cache)
    assert edited["numba"]
    assert edited["peak"] == pytest.approx(0.8 * first["peak"], rel=1e-12)
    assert len(list((cache / "patchfem").iterdir())) == 2


def smallest(place: Path):
    (place / "slide.toml").write_text(SCENE, "utf-8")
    yield "run", place / "slide.toml", "--no-page"


def test_exact_code_that_came_with_the_package_serves_the_first_run(tmp_path, answers):
    """Nothing is compiled, nothing is said; kernels with another text leave it alone."""
    home = copied(tmp_path / "home")
    hook.build_machine_code(home / "patchfem" / "compiled" / "generic", smallest)
    first = slid(home, tmp_path / "cache")
    native = answers[0]
    assert not first["numba"]
    assert first["said"] == []
    assert not list((tmp_path / "cache").rglob("*.code"))
    assert native["numba"] and native["said"]
    assert (first["work"], first["peak"]) == pytest.approx(
        (native["work"], native["peak"]), rel=1e-9
    )
    for law in (home / "patchfem" / "friction" / "laws").glob("*kernels.py"):
        law.write_text(law.read_text("utf-8") + "# edited\n", "utf-8")
    asked = "from patchfem import compiled; print(compiled.prebuilt.find_folder(compiled.hash_sources), compiled.__file__)"
    said = subprocess.run(
        [sys.executable, "-c", asked],
        cwd=home,
        env=os.environ | {"PYTHONPATH": str(home)},
        text=True,
        capture_output=True,
        check=True,
    ).stdout
    assert said.startswith(f"None {home}")


def test_exact_code_that_came_with_the_package_is_of_this_machine(tmp_path, monkeypatch):
    monkeypatch.setattr(prebuilt, "COMPILED_FOLDER", tmp_path)
    (tmp_path / "machine.py").touch()

    def found():
        return prebuilt.find_folder.__wrapped__(compiled.hash_sources)

    assert found() is None
    own = tmp_path / "generic" / prebuilt.compute_key(compiled.hash_sources)
    own.mkdir(parents=True)
    can = dict.fromkeys(prebuilt.COMMON_CPUS["x86_64"].instruction_sets, True)
    monkeypatch.setattr("llvmlite.binding.get_host_cpu_features", lambda: can)
    assert found() == own
    with monkeypatch.context() as more:
        more.setenv("NUMBA_BOUNDSCHECK", "1")
        assert found() is None
    for lacking, name in (({"avx2": False}, "x86_64"), ({}, "riscv64")):
        with monkeypatch.context() as more:
            more.setattr(
                "llvmlite.binding.get_host_cpu_features", lambda lacking=lacking: can | lacking
            )
            more.setattr("platform.machine", lambda name=name: name)
            (tmp_path / "generic" / prebuilt.compute_key(compiled.hash_sources)).mkdir(
                exist_ok=True
            )
            assert found() is None
    with monkeypatch.context() as more:
        more.setattr(prebuilt, "find_package_version", lambda name: "0.0")
        assert found() is None
    (tmp_path / "machine.py").write_text("# edited")
    assert found() is None


def test_exact_a_wheel_has_no_machine_code_unless_it_is_asked_for(monkeypatch):
    monkeypatch.setitem(
        sys.modules,
        "hatchling.builders.hooks.plugin.interface",
        SimpleNamespace(BuildHookInterface=object),
    )
    monkeypatch.setattr(hook, "build_machine_code", lambda place: (place / "KEY").mkdir())
    for asked, version, has in (
        ("", "standard", False),
        ("0", "standard", False),
        ("1", "editable", False),
        ("1", "standard", True),
    ):
        monkeypatch.setenv("PATCHFEM_MACHINE_CODE", asked)
        data = {"force_include": {}}
        builder = hook.get_build_hook()()
        builder.initialize(version, data)
        assert [*data["force_include"].values()] == ["patchfem/compiled/generic"] * has
        assert data.get("tag", "").startswith("py3-none-") is has


def wheel(folder: Path, **more) -> Path:
    """A wheel of this checkout, unpacked in a folder."""
    done = subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", folder],
        text=True,
        cwd=Path(patchfem.__file__).parents[1],
        env=os.environ | more,
        capture_output=True,
    )
    assert done.returncode == 0, done.stderr
    [path] = folder.glob("*.whl")
    with ZipFile(path) as file:
        file.extractall(folder)
    return path


@pytest.mark.slow
def test_exact_the_first_run_of_the_rig_from_a_wheel_compiles_nothing(tmp_path):
    bare = wheel(tmp_path / "bare")
    full = wheel(tmp_path / "full", PATCHFEM_MACHINE_CODE="1")
    assert bare.name.endswith("-py3-none-any.whl")
    assert not (bare.parent / "patchfem/compiled/generic").exists()
    assert not full.name.endswith("-any.whl")
    assert len(list((full.parent / "patchfem/compiled/generic").rglob("*.code"))) > 7
    measures = {}
    for one in (bare, full):
        words = [
            sys.executable,
            "-X",
            "importtime",
            "-m",
            "patchfem",
            "run",
            hook.ROOT / "studies/rig/rig.toml",
            "-o",
            one.parent / "out",
        ]
        done = subprocess.run(
            words,
            cwd=one.parent,
            capture_output=True,
            text=True,
            env=os.environ
            | {"PYTHONPATH": str(one.parent), "PATCHFEM_CACHE": str(one.parent / "cache")},
        )
        assert done.returncode == 0, done.stderr
        assert ("compiling" in done.stderr) is (" numba\n" in done.stderr) is (one is bare)
        found = json.loads((one.parent / "out" / "summary.json").read_text("utf-8"))["measures"]
        measures[one] = {
            name: each["value"] for name, each in found.items() if each["value"] is not None
        }
        assert measures[one].pop("energy_balance") < 1e-11  # of what cancels
    assert not list((full.parent / "cache").rglob("*.code"))
    assert measures[full] == pytest.approx(measures[bare], rel=1e-9, abs=1e-30)


KEYS = """\
import json, pathlib
from patchfem import compiled
package = pathlib.Path(compiled.__file__).parents[1]
kernels = sorted(package.rglob("*kernels.py"))
keys = [compiled.compute_kernel_key()]
with open(package / "core.py", "a", encoding="utf-8") as file:
    file.write("# edited")
keys.append(compiled.compute_kernel_key())
for path in (*kernels, *(package / name for name in compiled.TUPLE_MODULES)):
    path.write_text(path.read_text("utf-8") + "# edited\\n", "utf-8")
    keys.append(compiled.compute_kernel_key())
(package / "mesh" / "new_kernels.py").write_text("", "utf-8")
keys.append(compiled.compute_kernel_key())
print(json.dumps(keys))
"""


def test_exact_key_follows_the_kernels_only(tmp_path):
    """In a copy of the package: one key for each kernel that is edited or new, and one for another numba."""
    home = copied(tmp_path)

    def keys_of_copy() -> list:
        done = subprocess.run(
            [sys.executable, "-c", KEYS],
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONPATH": str(home)},
            cwd=home,
            check=True,
        )
        return json.loads(done.stdout)

    own, after_core, *others = keys_of_copy()
    assert own == after_core == compiled.compute_kernel_key()
    n_kernels = len(list((home / "patchfem").rglob("*kernels.py")))
    assert len(others) == n_kernels + len(compiled.TUPLE_MODULES) > 40
    assert len({own, *others}) == 1 + len(others)
    metadata = home / "numba-0.0.dist-info" / "METADATA"
    metadata.parent.mkdir()
    metadata.write_text("Metadata-Version: 2.1\nName: numba\nVersion: 0.0\n", "utf-8")
    assert keys_of_copy()[-1] not in others


def test_exact_key_follows_the_machine(monkeypatch):
    own = compiled.compute_kernel_key()
    monkeypatch.setattr(platform, "machine", lambda: "riscv64")
    assert compiled.compute_kernel_key() != own


def test_exact_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "mine"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "theirs"))
    found = compiled.cache_folder()
    assert found == tmp_path / "mine" / "patchfem" / compiled.compute_kernel_key()
    assert found.is_dir() and not list(found.iterdir())
    monkeypatch.delenv("PATCHFEM_CACHE")
    assert compiled.cache_folder().is_relative_to(tmp_path / "theirs")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert compiled.cache_folder().is_relative_to(tmp_path / "home" / ".cache")


def test_exact_a_later_process_knows_which_kinds_of_runs_came_to_their_end(tmp_path):
    def python(code: str) -> str:
        return subprocess.run(
            [sys.executable, "-c", f"from patchfem import compiled; {code}"],
            env=os.environ | {"PATCHFEM_CACHE": str(tmp_path)},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()

    question = "print(compiled.has_run('march'), compiled.has_run('other march'))"
    assert python(question) == "False False"
    python("compiled.record_run('march')")
    assert python(question) == "True False"


@pytest.mark.parametrize(
    "obstacle", ["a file in the way", "no right to write", "others may write", "of another user"]
)
def test_exact_only_a_folder_of_the_user_s_own_serves(tmp_path, monkeypatch, obstacle):
    """No folder of a common name in the temporary folder either: who was there first could have put code into it."""
    base = tmp_path / "base"
    temporary = tmp_path / "temporary"
    temporary.mkdir()
    if obstacle == "a file in the way":
        base.write_text("not a folder", "utf-8")
    elif obstacle == "no right to write":
        real = os.access
        monkeypatch.setattr(
            os, "access", lambda path, how: not Path(path).is_relative_to(base) and real(path, how)
        )
    else:
        (base / "patchfem").mkdir(parents=True)
        if obstacle == "others may write":
            (base / "patchfem").chmod(0o777)
        else:
            monkeypatch.setattr(
                user_cache,
                "_find_distrust_reason",
                lambda folder: (
                    "" if not folder.is_relative_to(base) else f"{folder} belongs to another user"
                ),
            )
    monkeypatch.setattr(tempfile, "tempdir", str(temporary))
    monkeypatch.setenv("PATCHFEM_CACHE", str(base))
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "session"))
    found = compiled.cache_folder()
    assert found == tmp_path / "session" / "patchfem" / compiled.compute_kernel_key()
    assert found.is_dir()
    assert str(base) in compiled.explain_cache_folder()
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    user_cache.make_process_folder.cache_clear()
    try:
        first = compiled.cache_folder()
        assert first.is_relative_to(temporary)
        assert first.is_dir()
        assert not (temporary / "patchfem").exists()
        assert os.stat(user_cache.make_process_folder()).st_mode & 0o77 == 0
        assert compiled.cache_folder() == first  # the same in one process
        user_cache.make_process_folder.cache_clear()
        assert compiled.cache_folder() != first  # another in the next
        shutil.rmtree(temporary)
        user_cache.make_process_folder.cache_clear()
        assert not compiled.cache_folder().exists()  # nothing is kept, nothing fails
    finally:
        user_cache.make_process_folder.cache_clear()


def test_exact_a_folder_is_made_the_user_s_own(tmp_path, monkeypatch):
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path))
    (tmp_path / "patchfem").mkdir()
    (tmp_path / "patchfem").chmod(0o775)  # as an umask of 002 makes it
    assert compiled.cache_folder().parent == tmp_path / "patchfem"
    assert os.stat(tmp_path / "patchfem").st_mode & 0o777 == 0o755
    assert os.stat(compiled.cache_folder()).st_mode & 0o777 == 0o700
    monkeypatch.delenv("PATCHFEM_CACHE")
    monkeypatch.delenv("XDG_CACHE_HOME", raising=False)
    monkeypatch.setattr(Path, "home", lambda: (_ for _ in ()).throw(RuntimeError("no home")))
    # a number without a name
    assert user_cache.find_cache_base() == user_cache.make_process_folder()


@pytest.fixture
def code_folder(tmp_path, monkeypatch):
    """The folder in which this process keeps its compiled code."""
    folder = tmp_path / "code"
    monkeypatch.setattr(compiled, "_set_cache_folder", lambda: folder)
    return folder


def toy(code_folder: Path):
    """Return a new dispatcher of one function, kept in the folder of compiled code."""
    space = {}
    source = code_folder.with_name("toy.py")
    if not source.exists():
        source.write_text("def toy(x):\n    return 2 * x + 1\n", "utf-8")
    exec(compile(source.read_text("utf-8"), str(source), "exec"), space)
    return cache_files.store_on_disk(numba.njit(space["toy"]))


def missed(found) -> tuple:
    """(Compiled, loaded) at a call."""
    assert found(20) == 41
    return sum(found.stats.cache_misses.values()), sum(found.stats.cache_hits.values())


@pytest.mark.share(0, 3, 5, 9)
@pytest.mark.parametrize("ending", ["nbi", "nbc"])
@pytest.mark.parametrize("harm", ["cut", "emptied", "a bit", "gone", "a folder"])
def test_always_a_damaged_cache_is_rebuilt_by_itself(code_folder, ending, harm):
    assert missed(toy(code_folder)) == (1, 0) and missed(toy(code_folder)) == (0, 1)
    [path] = code_folder.rglob(f"*.{ending}")
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes({"cut": data[:-5], "a bit": data}.get(harm, b""))
    if harm in ("gone", "a folder"):
        path.unlink()
    if harm == "a folder":
        path.mkdir()
    assert missed(toy(code_folder)) == (1, 0)
    if harm != "a folder":
        assert missed(toy(code_folder)) == (0, 1)


@pytest.mark.parametrize("obstacle", ["no room", "a file in the way"])
def test_always_a_cache_that_cannot_be_written_is_no_fault(code_folder, obstacle):
    if obstacle == "a file in the way":
        code_folder.write_text("mine")
    found = toy(code_folder)
    with limited(0 if obstacle == "no room" else 1 << 30):
        assert missed(found) == (1, 0)
    assert not [path for path in code_folder.rglob("*") if path.is_file()]
    if obstacle == "no room":
        assert missed(toy(code_folder)) == (1, 0) and missed(toy(code_folder)) == (0, 1)


def test_always_a_made_module_lives_without_a_file_and_a_damaged_file_is_made_again(code_folder):
    text = "WIDE = 3\nfrom . import jit as part\n\n\ndef wide(x):\n    return WIDE * x\n"
    with limited(0):
        found = compiled.write_kernel_module("compiled.without_file", text)
        assert found.WIDE == 3 and found.load_module().wide(2) == 6
        assert found.load_module().part.__name__ == "patchfem.compiled.jit"
    assert not [path for path in code_folder.rglob("*") if path.is_file()]
    source = code_folder / "instances" / "compiled.with_file.py"
    for harm in ("", text[:20], "mine = 1"):
        source.parent.mkdir(parents=True, exist_ok=True)
        source.write_text(harm)
        sys.modules.pop("patchfem.compiled.with_file", None)
        assert compiled.write_kernel_module("compiled.with_file", text).load_module().wide(2) == 6
        assert source.read_text() == text
    for name in ("with", "without"):
        sys.modules.pop(f"patchfem.compiled.{name}_file")


@pytest.mark.usefixtures("code_folder")
def test_exact_what_is_said_of_a_cache_without_room():
    said = []
    with limited(1000):
        compiled._report_once.__wrapped__(said.append)
    compiled._report_once.__wrapped__(said.append)
    if compiled.IS_JIT_DISABLED:
        assert not said
    else:
        assert "at every command" in said[0]
        assert "is the limit on the size" in said[0]
        assert "once" in said[1]
