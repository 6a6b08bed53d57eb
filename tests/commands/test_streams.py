"""The command line on streams that are closed, full or of few signs, and with names of any bytes."""

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
def scene(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text(SCENE, encoding="utf-8")
    return path


def patchfem(*words, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "patchfem", *map(str, words)], timeout=120, **options
    )


def test_exact_closed_streams_change_no_exit_code_and_no_file(scene, tmp_path):
    out = tmp_path / "out"
    done = patchfem(
        "run", scene, "-o", out, "--no-page", preexec_fn=lambda: (os.close(1), os.close(2))
    )
    assert done.returncode == 0
    files = {one.name: one.read_bytes() for one in out.iterdir()}
    assert set(files) == {"summary.json", "result.nc", "scene.resolved.toml"}
    assert files["result.nc"].startswith(b"\x89HDF") and not any(
        b"outcome: " in one for one in files.values()
    )


def test_exact_a_full_stderr_hides_a_mistake_but_not_its_code(tmp_path):
    path = tmp_path / "a.toml"
    path.write_text("x = 1\n")
    with open("/dev/full", "wb") as full:
        assert patchfem("check", path, stderr=full).returncode == 2


@pytest.mark.slow
def test_exact_a_stream_of_few_signs_shows_the_others_by_their_codes(scene, tmp_path):
    done = patchfem(
        "run",
        scene,
        "-o",
        tmp_path / "out",
        "--no-page",
        capture_output=True,
        env=os.environ | {"PYTHONIOENCODING": "ascii"},
    )
    assert done.returncode == 0 and done.stdout.startswith(rb"\xfc \xb1 \xb5") and not done.stderr


def test_refuses_the_root_as_a_folder_of_results(scene):
    answer = run_cli("run", scene, "-o", "/")
    assert answer.code == 2 and answer.err.count("\n") == 1 and "/: the root" in answer.err


def test_exact_a_name_is_shown_on_one_line_without_moving_the_cursor(tmp_path):
    answer = run_cli("check", str(tmp_path / "a\x1b[31m\nb.toml"))
    assert answer.code == 2 and answer.err.count("\n") == 1
    assert "a?[31m?b.toml: cannot be read" in answer.err
    assert make_printable("a\udcffü") == "a?ü"


def test_exact_results_name_no_folder_of_this_machine(tmp_path):
    """A trace that is centred and levelled is told of in the results, by its name."""
    rows = "".join(f"{13 * k},{abs(k % 400 - 200) / 400 + 1e-4 * k:.4f}\n" for k in range(1100))
    (tmp_path / "trace.csv").write_text("x [um],z [um]\n" + rows)
    (tmp_path / "a.toml").write_text(PATCH + '[contact.profile]\nfile = "trace.csv"\n')
    answer = run_cli("run", tmp_path / "a.toml", "-o", tmp_path / "out")
    out = tmp_path / "out"
    assert answer.code == 0 and "trace.csv: x runs from " in (out / "summary.json").read_text()
    assert {
        one.name for one in out.iterdir() if str(tmp_path).encode() in one.read_bytes()
    } == set()
    assert shorten_file_names(
        ["/a/b c/t.csv: x is 3 m/s", "3 m/s: as it is"], tmp_path / "a.toml"
    ) == ["t.csv: x is 3 m/s", "3 m/s: as it is"]


def test_exact_a_name_of_any_bytes_is_run_and_shown(tmp_path):
    path = tmp_path / os.fsdecode(b"b\xff\xfe.toml")
    path.write_text(SCENE, encoding="utf-8")
    assert run_cli("run", path, "-o", tmp_path / os.fsdecode(b"o\xff"), "-q").code == 0
    page = (tmp_path / os.fsdecode(b"o\xff") / "report.html").read_text("utf-8")
    assert "b??" in page and "ü ± µ" in page
