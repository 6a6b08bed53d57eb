"""The command line with closed, full or ASCII output streams, and with file names of arbitrary bytes."""

import os
import subprocess
import sys

import pytest
from command_line import run_cli
from scene_texts import COULOMB, PIECE, POINT, STRUCTURE

from patchfem.commands import make_printable
from patchfem.runs import shorten_file_names

PATCH = PIECE + 'load = "26 lbf"\nelement_size = "0.1 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
SCENE = 'title = "ü ± µ"\n' + POINT + COULOMB + STRUCTURE


@pytest.fixture
def scene_file(tmp_path):
    """Return the path of a rig scene with a title outside ASCII."""
    path = tmp_path / "a.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def run_patchfem(*words, **options) -> subprocess.CompletedProcess:
    """Run the command line in a new process."""
    return subprocess.run(
        [sys.executable, "-m", "patchfem", *map(str, words)], timeout=120, **options
    )


def test_exact_closed_streams_do_not_affect_run(scene_file, tmp_path):
    """A run with closed stdout and stderr ends with code 0 and writes its files."""
    out = tmp_path / "out"
    done = run_patchfem(
        "run", scene_file, "-o", out, "--no-page", preexec_fn=lambda: (os.close(1), os.close(2))
    )
    assert done.returncode == 0
    files = {path.name: path.read_bytes() for path in out.iterdir()}
    assert set(files) == {"summary.json", "result.nc", "scene.resolved.toml"}
    assert files["result.nc"].startswith(b"\x89HDF") and not any(
        b"outcome: " in path for path in files.values()
    )


@pytest.mark.parametrize(
    "words, code, name",
    [
        (["run"], 0, "report.html"),
        (["run", "--json"], 0, "report.html"),
        (["sweep", "--over", "normal.load=100 N,-1 N"], 3, "report.html"),
    ],
)
def test_exact_closed_pipe_changes_neither_files_nor_exit_code(
    words, code, name, scene_file, tmp_path
):
    """A command whose reader has gone writes all files and ends with the code of its work."""
    reader, writer = os.pipe()
    os.close(reader)
    done = run_patchfem(
        words[0], scene_file, *words[1:], "-o", tmp_path / "out", stdout=writer, stderr=writer
    )
    os.close(writer)
    assert done.returncode == code and (tmp_path / "out" / name).is_file()


def test_exact_full_stderr_keeps_exit_code(tmp_path):
    """A mistake in a scene gives exit code 2 although stderr is full."""
    path = tmp_path / "a.toml"
    path.write_text("x = 1\n")
    with open("/dev/full", "wb") as full:
        assert run_patchfem("check", path, stderr=full).returncode == 2


@pytest.mark.slow
def test_exact_ascii_stream_escapes_characters(scene_file, tmp_path):
    """Characters outside ASCII are escaped on an ASCII stream."""
    done = run_patchfem(
        "run",
        scene_file,
        "-o",
        tmp_path / "out",
        "--no-page",
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0 and done.stdout.startswith(rb"\xfc \xb1 \xb5") and not done.stderr


def test_refuses_root_as_output_folder(scene_file):
    """The root of the file system is refused as an output folder."""
    answer = run_cli("run", scene_file, "-o", "/")
    assert answer.code == 2 and answer.err.count("\n") == 1 and "/: the root" in answer.err


def test_exact_control_characters_in_names_are_masked(tmp_path):
    """Control characters in a file name are masked in messages."""
    answer = run_cli("check", str(tmp_path / "a\x1b[31m\nb.toml"))
    assert answer.code == 2 and answer.err.count("\n") == 1
    assert "a?[31m?b.toml: cannot be read" in answer.err
    assert make_printable("a\udcffü") == "a?ü"


def test_exact_results_contain_no_absolute_paths(tmp_path):
    """Results name a trace by its file name and contain no absolute path."""
    rows = "".join(f"{13 * k},{abs(k % 400 - 200) / 400 + 1e-4 * k:.4f}\n" for k in range(1100))
    (tmp_path / "trace.csv").write_text("x [um],z [um]\n" + rows)
    (tmp_path / "a.toml").write_text(PATCH + '[contact.profile]\nfile = "trace.csv"\n')
    answer = run_cli("run", tmp_path / "a.toml", "-o", tmp_path / "out")
    out = tmp_path / "out"
    assert answer.code == 0 and "trace.csv: x runs from " in (out / "summary.json").read_text()
    assert {
        path.name for path in out.iterdir() if str(tmp_path).encode() in path.read_bytes()
    } == set()
    assert shorten_file_names(
        ["/a/b c/t.csv: x is 3 m/s", "3 m/s: as it is"], tmp_path / "a.toml"
    ) == ["t.csv: x is 3 m/s", "3 m/s: as it is"]


def test_exact_file_names_of_any_bytes_are_accepted(tmp_path):
    """A scene and an output folder with names of arbitrary bytes are accepted."""
    path = tmp_path / os.fsdecode(b"b\xff\xfe.toml")
    path.write_text(SCENE, encoding="utf-8")
    assert run_cli("run", path, "-o", tmp_path / os.fsdecode(b"o\xff"), "-q").code == 0
    page = (tmp_path / os.fsdecode(b"o\xff") / "report.html").read_text("utf-8")
    assert "b??" in page and "ü ± µ" in page
