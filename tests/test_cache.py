"""The cache of compiled code: shared by processes, renewed for an edited law, and never a cause of failure."""

import json
import lzma
import os
import re
import shutil
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path

import portable_code
import pytest
from scene_texts import PLASTIC, POINT, TRIANGLE

import patchfem
from patchfem import kernel_cache
from patchfem.disk import user_cache
from patchfem.kernel_cache import portable

# A prescribed slide has the smallest time loop that contains a friction law; an oscillating load needs this loop.
SCENE = POINT + 'amplitude = "1 N"\nfrequency = "50 Hz"\n' + PLASTIC + TRIANGLE
BENCH = """\
import gc, json, lzma, sys
import patchfem.runs.run as simulate
from patchfem.kernel_cache import KernelFunction
from patchfem.scene.scene import loads
said = []
result = simulate.run(simulate.plan(loads(sys.argv[1])), say=said.append, estimate=False)
kernels = [one for one in gc.get_objects() if isinstance(one, KernelFunction) and one.loaded_functions]
print(json.dumps({"work": result.measures["loop_area"].value,
                  "peak": result.measures["friction_force_peak"].value, "home": simulate.__file__, "said": said,
                  "numba": "numba" in sys.modules,
                  "stored": [one.name for one in kernels if all(one.loaded_functions.values())],
                  "not stored": [one.name for one in kernels if not all(one.loaded_functions.values())]}))
if len(sys.argv) > 2:
    from patchfem import kernel_cache
    from patchfem.kernel_cache import machine
    from portable_code import pack_portable_codes
    kernels = kernel_cache.hash_kernels()
    packed = pack_portable_codes(machine.PORTABLE_CODES, kernels, "of this process")
    with open(sys.argv[2], "wb") as file:
        file.write(lzma.compress(packed))
"""


def copy_package(folder: Path) -> Path:
    """Copy the package into `folder` without bytecode and portable code, and return `folder`."""
    shutil.copytree(
        Path(patchfem.__file__).parent,
        folder / "patchfem",
        ignore=shutil.ignore_patterns("__pycache__", "portable.xz"),
    )
    return folder


def run_slide(home: Path, cache: Path, *arguments: str) -> dict:
    """Run a short prescribed slide with the package in `home` in a new process with its own cache.

    With an argument, a path, it writes the functions that it compiled as portable code.
    """
    path = f"{home}{os.pathsep}{Path(portable_code.__file__).parent}"
    environment = os.environ | {"PYTHONPATH": path, "PATCHFEM_CACHE": str(cache)}
    done = subprocess.run(
        [sys.executable, "-c", BENCH, SCENE, *arguments],
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


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return the folder of a copy of the package."""
    return copy_package(tmp_path_factory.mktemp("package"))


@pytest.fixture(scope="module")
def shared_cache(tmp_path_factory):
    """Return the cache folder of the two processes of `parallel_results`."""
    return tmp_path_factory.mktemp("empty")


@pytest.fixture(scope="module")
def parallel_results(shared_cache, package):
    """Return the results of two processes started at once on an empty cache; the one that compiled comes first.

    It writes its portable code.
    """
    paths = [str(shared_cache / f"{number}.xz") for number in range(2)]
    with ThreadPoolExecutor() as threads:
        results = list(threads.map(partial(run_slide, package, shared_cache), paths))
    return sorted(results, key=lambda one: not one["numba"])


@pytest.mark.long
def test_exact_only_first_of_two_processes_compiles(parallel_results):
    """Of two processes started at once on an empty cache, only one compiles, and both give the same loop."""
    assert [one["numba"] for one in parallel_results] == [True, False]
    assert len({(one["work"], one["peak"]) for one in parallel_results}) == 1


def test_always_runs_use_stored_machine_code(parallel_results):
    """The run that compiles and the next one call stored machine code only, not numba, which takes twice as long.

    A version of numba or llvmlite whose code cannot be stored would otherwise go unnoticed.
    """
    for one in parallel_results:
        assert one["stored"] and not one["not stored"]


@pytest.mark.slow
def test_exact_edited_law_is_compiled_again(tmp_path, shared_cache, parallel_results):
    """An edited law is compiled again, and its stiffness factor of 0.8 changes the peak force by 0.8."""
    package = copy_package(tmp_path / "home")
    cache = shutil.copytree(shared_cache, tmp_path / "cache")
    first = parallel_results[0]
    assert first["numba"] and len(first["said"]) == 1 and "compiling" in first["said"][0]
    law = package / "patchfem/time_steps/cells_kernels.py"
    text, count = re.subn(
        r"(?<=Value.END \+ j\] = )(?=friction \* cell)", "0.8 * ", law.read_text("utf-8")
    )
    assert count == 1
    law.write_text(text, "utf-8")
    edited = run_slide(package, cache)
    assert edited["numba"]
    assert edited["peak"] == pytest.approx(0.8 * first["peak"], rel=1e-12)
    assert len(list((cache / "patchfem").iterdir())) == 2


def test_exact_portable_code_needs_no_numba(tmp_path, shared_cache, parallel_results):
    """A first run with portable code gives the bits of one that numba compiled, without numba and without a message.

    With damaged portable code, and with checks of indices, numba compiles.
    """
    home = copy_package(tmp_path)
    largest = max(shared_cache.glob("*.xz"), key=lambda path: path.stat().st_size)
    kept = home / "patchfem/kernel_cache/portable.xz"
    shutil.copy(largest, kept)
    first = run_slide(home, tmp_path / "first")
    assert not first["numba"] and not first["said"]
    assert all(first[name] == parallel_results[0][name] for name in ("work", "peak"))
    code = lzma.decompress(kept.read_bytes()).decode()
    assert not re.search(r"target-cpu|target-features|target triple|_ZN|\.py", code)


@pytest.mark.parametrize(
    "harm", ["", "cut", "a bit", "empty", "gone", "no header", "other kernels", "index checks"]
)
def test_exact_unfit_portable_code_is_ignored(tmp_path, monkeypatch, harm):
    """Portable code that is damaged or made for other kernels, and any if indices are checked, is ignored."""
    kernels = "of others" if harm == "other kernels" else kernel_cache.hash_kernels()
    content = portable_code.pack_portable_codes({"b": b"second", "a": b"first"}, kernels, "any")
    data = bytearray(lzma.compress(b"[]\n" if harm == "no header" else content))
    changed = data.copy()
    changed[len(data) // 2] ^= 1
    path = tmp_path / "portable.xz"
    path.write_bytes({"cut": data[:-5], "a bit": changed, "empty": b""}.get(harm, data))
    monkeypatch.setattr(portable, "PORTABLE_PATH", path if harm != "gone" else tmp_path / "none.xz")
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", str(int(harm == "index checks")))
    portable.read_portable_codes.cache_clear()
    found = kernel_cache.list_portable_codes()
    portable.read_portable_codes.cache_clear()
    assert found == ({} if harm else {"a": b"first", "b": b"second"})


@pytest.mark.slow
def test_exact_portable_code_of_package_can_be_made_again(tmp_path):
    """The portable code of the package is what numba makes of the present kernels, byte by byte.

    Run `python tests/support/portable_code.py` at a release. Other versions make another text.
    """
    path = tmp_path / "portable.xz"
    maker = Path(__file__).parent / "support/portable_code.py"
    subprocess.run([sys.executable, maker, path], check=True)
    made, kept = (lzma.decompress(one.read_bytes()) for one in (path, portable.PORTABLE_PATH))
    versions = [json.loads(one.partition(b"\n")[0])["versions"] for one in (made, kept)]
    if versions[0] != versions[1]:
        pytest.skip(f"the portable code was made with {versions[1]}")
    assert made == kept


KEYS = """\
import json, pathlib
from patchfem import kernel_cache
package = pathlib.Path(kernel_cache.__file__).parents[1]
kernels = sorted(package.rglob("*kernels.py"))
keys = [kernel_cache.compute_kernel_key()]
with open(package / "core.py", "a", encoding="utf-8") as file:
    file.write("# edited")
keys.append(kernel_cache.compute_kernel_key())
for path in (*kernels, *(package / name for name in kernel_cache.TUPLE_MODULES)):
    path.write_text(path.read_text("utf-8") + "# edited\\n", "utf-8")
    keys.append(kernel_cache.compute_kernel_key())
(package / "mesh/new_kernels.py").write_text("", "utf-8")
keys.append(kernel_cache.compute_kernel_key())
print(json.dumps(keys))
"""


def test_exact_cache_key_depends_on_kernels(tmp_path):
    """The cache key changes with each edited or new kernel and with the version of numba.

    Other edits of the package do not change the key.
    """
    home = copy_package(tmp_path)

    def compute_keys() -> list:
        """Return the keys that the copy of the package computes in a new process."""
        done = subprocess.run(
            [sys.executable, "-c", KEYS],
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONPATH": str(home)},
            cwd=home,
            check=True,
        )
        return json.loads(done.stdout)

    own, after_core, *others = compute_keys()
    assert own == after_core == kernel_cache.compute_kernel_key()
    n_kernels = len(list((home / "patchfem").rglob("*kernels.py")))
    assert len(others) == n_kernels + len(kernel_cache.TUPLE_MODULES) > 30
    assert len({own, *others}) == 1 + len(others)
    metadata = home / "numba-0.0.dist-info/METADATA"
    metadata.parent.mkdir()
    metadata.write_text("Metadata-Version: 2.1\nName: numba\nVersion: 0.0\n", "utf-8")
    assert compute_keys()[-1] not in others


def test_exact_cache_folder_follows_environment(tmp_path, monkeypatch):
    """The cache folder lies in PATCHFEM_CACHE, else in XDG_CACHE_HOME, else in ~/.cache."""
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "mine"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "theirs"))
    folder = kernel_cache.find_cache_folder().path
    assert folder == tmp_path / "mine/patchfem" / kernel_cache.compute_kernel_key()
    assert folder.is_dir() and not list(folder.iterdir())
    monkeypatch.delenv("PATCHFEM_CACHE")
    assert kernel_cache.find_cache_folder().path.is_relative_to(tmp_path / "theirs")
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert kernel_cache.find_cache_folder().path.is_relative_to(tmp_path / "home/.cache")


@pytest.mark.parametrize(
    "obstacle", ["a file in the way", "no right to write", "others may write", "of another user"]
)
def test_exact_untrusted_cache_folder_is_avoided(tmp_path, monkeypatch, obstacle):
    """A cache folder that is not writable, or that other users can write, is replaced by a private one.

    A fixed name in the temporary folder is not used, since another user could have placed code
    there.
    """
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
    user_cache.make_process_folder.cache_clear()
    try:
        first = kernel_cache.find_cache_folder().path
        assert first.is_relative_to(temporary)
        assert first.is_dir()
        assert str(base) in kernel_cache.find_cache_folder().problem
        assert not (temporary / "patchfem").exists()
        assert os.stat(user_cache.make_process_folder()).st_mode & 0o77 == 0
        assert kernel_cache.find_cache_folder().path == first  # the same in one process
        user_cache.make_process_folder.cache_clear()
        assert kernel_cache.find_cache_folder().path != first  # another in the next
        shutil.rmtree(temporary)
        user_cache.make_process_folder.cache_clear()
        assert not kernel_cache.find_cache_folder().path.exists()  # nothing is kept, nothing fails
    finally:
        user_cache.make_process_folder.cache_clear()


def test_exact_instance_of_kernels_replaces_import():
    """A module in which another one replaces an import calls the functions of the other one, and has no file of its own."""
    text = "SHIFT = 3\n\n\ndef shift(x):\n    return SHIFT + x\n"
    part = kernel_cache.make_kernel_module("kernel_cache.shifting", text, Path("shifting.py"))
    whole = f"import {part.__name__} as part\n\n\ndef double(x):\n    return 2 * part.shift(x)\n"
    found = kernel_cache.make_kernel_module(
        "kernel_cache.doubling", whole, Path("doubling.py"), [part]
    )
    assert found.double(1) == 8 and part.SHIFT == 3
    assert found.load_module().double.__code__.co_filename == "doubling.py"
    with pytest.raises(ValueError, match="imports its part nothing 0 times"):
        kernel_cache.instantiate(
            "time_steps.march_kernels", {"nothing": "time_steps.no_lists_kernels"}
        )
    for name in (part.__name__, found.__name__):
        sys.modules.pop(name)


def test_always_instance_of_kernels_is_kept():
    """Runs with the same parts share one kernel module: a module of its own would keep 1 MB in each run of a sweep."""
    parts = {"lists": "time_steps.no_lists_kernels"}
    first = kernel_cache.instantiate("time_steps.march_kernels", parts)
    assert kernel_cache.instantiate("time_steps.march_kernels", parts) is first
    assert kernel_cache.instantiate("time_steps.march_kernels", {}) is not first
