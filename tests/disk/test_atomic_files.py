"""Files are complete or absent: file size limits, devices and interrupts."""

import io
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest
from command_line import list_names, run_cli, run_successfully
from limits import limit_file_size
from scene_texts import BENCH, COATED

from patchfem.core import Missing
from patchfem.disk import is_partial_name, open_lossy, write_atomically, write_text
from patchfem.disk.atomic_write import COMPLETED_PATHS

SIZES = [1 << 10, 1 << 16]
N_SIGNALLED_WRITES = 40
# Writes both HDF5 files of a results folder again and again, with a signal in another write of HDF5 each time, and prints
# for each signal the file and whether the writer ended with an interrupt.
SIGNALLED_WRITES = """\
import json, os, signal, sys
from pathlib import Path
# a test run in the background of a shell ignores SIGINT
signal.signal(signal.SIGINT, signal.default_int_handler)
import patchfem.__main__
from patchfem.disk.atomic_write import LossyFile
from patchfem.export.fields.vtkhdf import read_frames, write_blocks
from patchfem.export.netcdf import read_netcdf, write_arrays

folder, target, n_signals = Path(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3])
frames = read_frames(folder / "fields.vtkhdf")
data, attributes = read_netcdf(folder / "result.nc")
attributes.pop("_NCProperties", None)
plain_write, n_left = LossyFile.write, 0

def write(self, data):
    global n_left
    n_left -= 1
    if n_left == 0:
        os.kill(os.getpid(), number)
    return plain_write(self, data)

LossyFile.write = write
for name, save in (
    ("fields.vtkhdf", lambda: write_blocks(target / "fields.vtkhdf", frames.blocks, frames.times)),
    ("result.nc", lambda: write_arrays(data, attributes, target / "result.nc")),
):
    save()
    for k in range(1, n_signals + 1):
        n_left = k
        number = (signal.SIGINT, signal.SIGTERM)[k % 2]
        try:
            save()
            print(json.dumps([name, k, "no interrupt"]), flush=True)
        except KeyboardInterrupt:
            print(json.dumps([name, k, "interrupt" if n_left <= 0 else "no write"]), flush=True)
"""


def read_datasets(path) -> dict[str, np.ndarray]:
    """Return the arrays of an HDF5 file by their paths in it."""
    arrays = {}
    with h5py.File(path) as file:
        file.visititems(
            lambda name, item: (
                arrays.update({name: item[...]}) if isinstance(item, h5py.Dataset) else None
            )
        )
    return arrays


@pytest.fixture(scope="module")
def results_folder(tmp_path_factory):
    """Scene and results folder of two pressed pieces."""
    folder = tmp_path_factory.mktemp("results")
    (folder / "scene.toml").write_text(COATED, "utf-8")
    run_successfully("run", folder / "scene.toml", "-o", folder / "out", "--no-page")
    return folder / "scene.toml", folder / "out"


@pytest.mark.parametrize("size", SIZES)
def test_always_run_without_space_preserves_older_results(results_folder, tmp_path, size):
    """A run without enough space preserves the older results and reports the path and the reason."""
    scene = tmp_path / "scene.toml"
    out = tmp_path / "out"
    scene.write_text(COATED, "utf-8")
    out.mkdir()
    (out / "summary.json").write_text("older")
    with limit_file_size(size):
        result = run_cli("run", scene, "-o", out)
    assert (
        result.code == 4 and len(result.err.splitlines()) == 1 and "out.partial/" in result.err
    ), result.err
    assert "cannot be written (File too large)" in result.err
    assert [path.name for path in out.iterdir()] == ["summary.json"] and (
        out / "summary.json"
    ).read_text() == "older"
    assert sorted(path.name for path in tmp_path.iterdir()) == ["out", "scene.toml"]


@pytest.mark.parametrize(
    "words",
    [
        ("mesh", "SCENE", "-o", "a.msh"),
        ("export", "OUT", "-o", "a.vtkhdf"),
        ("export", "OUT", "-o", "a.pvd"),
        ("export", "OUT", "-o", "a.csv"),
        ("view", "OUT", "-o", "a.svg"),
    ],
    ids=" ".join,
)
def test_always_output_file_is_unchanged_without_space(
    results_folder, tmp_path, monkeypatch, words
):
    """Every kind of output file is unchanged if there is not enough space for the new file."""
    monkeypatch.chdir(tmp_path)
    name = words[-1]
    Path(name).write_text("older")
    with limit_file_size(2048):
        result = run_cli(
            *(
                {"SCENE": results_folder[0], "OUT": results_folder[1]}.get(word, word)
                for word in words
            )
        )
    assert result.code == 4 and re.search(
        r"cannot be written \((File too large|perhaps no space is left)", result.err
    ), result.err
    assert len(result.err.splitlines()) == 1
    assert Path(name).read_text() == "older"
    assert [
        path for path in tmp_path.rglob("*") if path.is_file() and path.stat().st_size == 2048
    ] == []
    assert {path.name for path in tmp_path.iterdir()} <= {name, "a_frames"}


@pytest.mark.parametrize("size", [0, 2048, 81_000])
def test_exact_hdf5_file_closes_cleanly_without_space(tmp_path, size):
    """An HDF5 file closes cleanly with an OSError for any limit on the file size."""
    data = np.arange(10_000.0)
    with (
        limit_file_size(size),
        pytest.raises(OSError) as caught,
        open_lossy(tmp_path / "a.h5") as target,
        h5py.File(target, "w") as file,
    ):
        file["a"] = data
        file.flush()
        file["b"] = file["a"][::2] + 1
    assert caught.value.errno == 27 and not file and (tmp_path / "a.h5").stat().st_size <= size


@pytest.mark.parametrize("raised", [KeyboardInterrupt, OSError])
def test_exact_interrupted_write_preserves_older_file(tmp_path, raised):
    """An exception during writing preserves the older file and leaves no partial file."""
    path = tmp_path / "a.txt"
    path.write_text("older")
    with pytest.raises(Missing if raised is OSError else raised), write_atomically(path) as partial:
        assert is_partial_name(partial.name) and partial.suffix == ".txt"
        partial.write_text("new")
        raise raised("an end")
    assert [other_path.name for other_path in tmp_path.iterdir()] == [
        "a.txt"
    ] and path.read_text() == "older"
    write_text(path, "größer")
    assert path.read_bytes() == "größer".encode() and [
        other_path.name for other_path in tmp_path.iterdir()
    ] == ["a.txt"]
    assert COMPLETED_PATHS[-1] == path


def test_refuses_unwritable_path(tmp_path):
    """A path that is a folder, in a missing folder or too long is refused."""
    (tmp_path / "folder").mkdir()
    for path in tmp_path / "folder", tmp_path / "none/a", tmp_path / ("a" * 300):
        with pytest.raises(Missing, match="cannot be written"):
            write_text(path, "text")
    assert [entry.name for entry in tmp_path.iterdir()] == ["folder"] and not list(
        (tmp_path / "folder").iterdir()
    )


@pytest.mark.skipif(os.name != "posix", reason="signals cannot be sent to a process elsewhere")
def test_always_signal_during_hdf5_write_preserves_older_file(results_folder, tmp_path):
    """A signal at any of the first 40 writes of HDF5 ends the writer with an interrupt; the older file is complete."""
    arguments = [results_folder[1], tmp_path, N_SIGNALLED_WRITES]
    done = subprocess.run(
        [sys.executable, "-c", SIGNALLED_WRITES, *map(str, arguments)],
        capture_output=True,
        text=True,
        timeout=300,
    )
    names = "fields.vtkhdf", "result.nc"
    expected = [[name, k, "interrupt"] for name in names for k in range(1, N_SIGNALLED_WRITES + 1)]
    assert [json.loads(line) for line in done.stdout.splitlines()] == expected
    assert (done.returncode, done.stderr) == (0, "")
    assert list_names(tmp_path) == {*names}
    for name in names:
        written, original = (
            read_datasets(folder / name) for folder in (tmp_path, results_folder[1])
        )
        np.testing.assert_equal(written, original)


class InterruptedStream(io.StringIO):
    """A stdout at which the user presses Ctrl-C."""

    def write(self, text: str) -> int:
        """Interrupt the process in place of printing."""
        raise KeyboardInterrupt


def test_exact_interrupt_after_write_reports_file(tmp_path, monkeypatch):
    """An interrupt after a file is in place reports the file as complete."""
    monkeypatch.chdir(tmp_path)
    Path("a.json").write_text("older")
    answer = run_cli("schema", "-o", "a.json", stdout=InterruptedStream())
    assert answer.code == 130 and answer.err == "interrupted; already complete: a.json\n"
    assert Path("a.json").read_text() != "older"
    assert [path.name for path in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize("words", [("run",), ("sweep", "--over", "friction.static=0.2,0.3")])
def test_always_output_folder_below_file_is_refused(tmp_path, words):
    """An output folder below a file is refused with the name of the file."""
    (tmp_path / "bench.toml").write_text(BENCH)
    (tmp_path / "FILE").write_text("")
    answer = run_cli(words[0], tmp_path / "bench.toml", *words[1:], "-o", tmp_path / "FILE/x")
    assert answer.code == 4
    assert f"{tmp_path / 'FILE'} is a file; choose another folder" in answer.err
