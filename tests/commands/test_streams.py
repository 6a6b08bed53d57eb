"""The command line with closed, full or ASCII output streams, and with file names of arbitrary bytes."""

import os
import subprocess
import sys

import pytest
from command_line import run_cli
from scene_texts import COULOMB, POINT, STRUCTURE

from patchfem.commands import make_printable

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


def test_exact_closed_pipe_changes_neither_files_nor_exit_code(scene_file, tmp_path):
    """A command whose reader has gone writes all files and ends with the code of its work, without a message."""
    reader, writer = os.pipe()
    os.close(reader)
    words = ("sweep", scene_file, "--over", "normal.load=100 N,-1 N", "--json", "--no-page")
    done = run_patchfem(*words, "-o", tmp_path / "out", stdout=writer, stderr=writer)
    shown = run_patchfem("run", "--help", stdout=writer, stderr=subprocess.PIPE)
    os.close(writer)
    assert (shown.returncode, shown.stderr) == (0, b"")
    assert done.returncode == 3 and (tmp_path / "out/sweep.csv").is_file()


@pytest.mark.parametrize(
    "words",
    [("check", "SCENE"), ("run", "SCENE", "--no-page"), ("run", "SCENE", "--json"), ("--help",)],
)
def test_exact_full_stdout_ends_with_message(scene_file, tmp_path, words):
    """A command that cannot print its answer ends with code 4 and one sentence."""
    words = [str(scene_file) if word == "SCENE" else word for word in words]
    with open("/dev/full", "wb") as full:
        done = run_patchfem(*words, cwd=tmp_path, stdout=full, stderr=subprocess.PIPE)
    assert done.returncode == 4
    assert done.stderr.splitlines()[-1] == b"standard output: No space left on device"
    assert b"Traceback" not in done.stderr


@pytest.mark.parametrize("columns", ["1", "2"])
def test_always_help_of_narrow_terminal_ends(columns):
    """The help of a verb ends on a terminal of one or two characters, for which it is as wide as the narrowest layout."""
    environment = os.environ | {"COLUMNS": columns, "TERM": "dumb"}
    done = run_patchfem("check", "--help", env=environment, stdout=subprocess.PIPE)
    assert done.returncode == 0
    assert 10 < max(map(len, done.stdout.decode().splitlines())) <= 20


def test_exact_full_stderr_keeps_exit_code(tmp_path):
    """A mistake in a scene gives exit code 2 although stderr is full."""
    path = tmp_path / "a.toml"
    path.write_text("x = 1\n")
    with open("/dev/full", "wb") as full:
        assert run_patchfem("check", path, stderr=full).returncode == 2


def test_exact_control_characters_in_names_are_masked(tmp_path):
    """Control characters in a file name are masked in messages."""
    answer = run_cli("check", str(tmp_path / "a\x1b[31m\nb.toml"))
    assert answer.code == 2 and answer.err.count("\n") == 1
    assert "a?[31m?b.toml: cannot be read" in answer.err
    assert make_printable("a\udcffü") == "a?ü"


def test_exact_complete_run_that_is_resumed_prints_the_same_json(scene_file, tmp_path):
    """A complete run with `--resume --json` prints the summary of the run again, with letters outside ASCII."""
    march = ("--set", "accuracy.method=march", "--set", "drive.cycles=5")
    words = ("run", scene_file, *march, "-o", tmp_path / "out", "--no-page", "-q", "--json")
    first = run_cli(*words)
    again = run_cli(*words, "--resume")
    assert again.code == 0, again.err
    assert "ü ± µ" in first.out and again.out == first.out
