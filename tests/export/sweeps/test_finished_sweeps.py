"""Resuming a finished sweep returns at once, unless a file or an argument of it has changed."""

import csv
import os
import subprocess
import sys

import pytest
from command_line import run_cli
from scene_texts import COULOMB, POINT, SHORT

from patchfem.export.sweeps import manifest

OVER = ("--over", "friction.static=0.2,0.3,0.4", "--keep", "none")
COMMAND_WITHOUT_LIBRARIES = """import sys
from patchfem.__main__ import run_command
assert run_command(sys.argv[1:]) == 0
assert not {"numpy", "pydantic", "h5py", "numba"} & set(sys.modules)"""


@pytest.fixture(scope="module")
def finished_sweep(tmp_path_factory):
    """Return the scene, the results folder and the answer of a finished sweep."""
    scene = tmp_path_factory.mktemp("receipt") / "rig.toml"
    scene.write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    return scene, scene.parent / "out", run_cli("sweep", scene, *OVER, "-o", scene.parent / "out")


def request_words(*over) -> tuple:
    """Return the words of a request with the given values of --over."""
    return (*over, "", "draw=0,0,0", "of=", "page=True")


def test_exact_finished_sweep_resumes_without_numpy(finished_sweep):
    """A finished sweep that is resumed prints the same answer and does not import NumPy."""
    scene, folder, answer = finished_sweep
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            COMMAND_WITHOUT_LIBRARIES,
            "sweep",
            scene,
            *OVER,
            "-o",
            folder,
            "--resume",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert answer.code == 0 and done.stdout == answer.out
    answer_json = run_cli("sweep", scene, *OVER, "-o", folder, "--resume", "--json")
    assert '"cases": 3' in answer_json.out and answer_json.code == 0


@pytest.mark.parametrize("change", ["chunk", "gone", "scene", "words"])
def test_always_change_invalidates_manifest(finished_sweep, change):
    """The manifest of a sweep is not used after a change of a chunk, a table, the scene or the arguments."""
    scene, folder, _ = finished_sweep
    assert run_cli("sweep", scene, *OVER, "-o", folder, "--resume").code == 0
    over = OVER[1]
    assert (
        manifest.read_manifest(folder, manifest.hash_request(scene, request_words(over)))["cases"][
            "count"
        ]
        == 3
    )
    file = next((folder / "chunks").glob("*.h5")) if change == "chunk" else folder / "sweep.csv"
    text = scene.read_text("utf-8")
    stamp = file.stat()
    if change in ("chunk", "table"):
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + 1))
    if change == "gone":
        file.unlink()
    if change == "scene":
        scene.write_text(text + "# more\n", encoding="utf-8")
    request = (
        (over + ",0.5", "", "draw=0,0,0", "page=True")
        if change == "words"
        else (over, "", "draw=0,0,0", "page=False")
        if change == "page"
        else request_words(over)
    )
    assert manifest.read_manifest(folder, manifest.hash_request(scene, request)) == {}
    scene.write_text(text, encoding="utf-8")
    # the sweep is complete again and has its manifest
    answer = run_cli("sweep", scene, *OVER, "-o", folder, "--resume")
    assert answer.code == 0 and manifest.read_manifest(
        folder, manifest.hash_request(scene, request_words(over))
    )


def test_exact_failed_case_prevents_manifest(finished_sweep, tmp_path):
    """A sweep with a failed case has no manifest."""
    scene, *_ = finished_sweep
    assert (
        run_cli(
            "sweep",
            scene,
            "--over",
            "friction.static=0.2,-1",
            "--keep",
            "none",
            "-o",
            tmp_path / "out",
        ).code
        == 3
    )
    assert not (tmp_path / "out" / manifest.MANIFEST_NAME).exists()


BENCH = POINT + COULOMB + '[slide]\nkind = "file"\nfile = "one.csv"\n'


@pytest.mark.share(0, 3, 5, 6)
@pytest.mark.parametrize(
    "table, arguments",
    [
        ('[sweep]\n"slide.file" = "one.csv,two.csv"\n', ()),
        ("", ("--cases", "cases.csv")),
        ("", ("--set", "slide.file=two.csv", "--over", "friction.static=0.2,0.3")),
        ("", ("--over", "slide={kind = 'file', file = 'two.csv'}")),
    ],
    ids=["sweep", "cases", "set", "table"],
)
@pytest.mark.parametrize("has_manifest", [True, False])
def test_always_change_of_referenced_file_runs_again(
    tmp_path, monkeypatch, table, arguments, has_manifest
):
    """A sweep runs again after a change of a file that its scene or its arguments name.

    Earlier the older results were returned.
    """
    monkeypatch.chdir(tmp_path)
    rows = "time [s],displacement [um]\n0,0\n1,{}\n2,0\n"
    for name, text in (
        ("rig.toml", BENCH + table),
        ("one.csv", rows.format(10)),
        ("two.csv", rows.format(10)),
        ("cases.csv", "slide.file\none.csv\ntwo.csv\n"),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")

    def run_sweep() -> float:
        """Run or resume the sweep and return the slip amplitude of its last case."""
        done = run_cli("sweep", "rig.toml", *arguments, "--keep", "none", "-o", "out", "--resume")
        assert done.code == 0, done.err
        with open("out/sweep.csv", encoding="utf-8", newline="") as file:
            return float(list(csv.DictReader(file))[-1]["slip_amplitude"])

    first_amplitude = run_sweep()
    (tmp_path / "two.csv").write_text(rows.format(20), encoding="utf-8")
    if not has_manifest:
        (tmp_path / "out" / manifest.MANIFEST_NAME).unlink()
    if "--set" in arguments:  # --set changes all cases, so the folder belongs to another scene
        refused = run_cli(
            "sweep", "rig.toml", *arguments, "--keep", "none", "-o", "out", "--resume"
        )
        assert refused.code == 2 and "contains a sweep of another scene" in refused.err
        assert run_cli("sweep", "rig.toml", *arguments, "--keep", "none", "-o", "out").code == 0
    assert run_sweep() == pytest.approx(2 * first_amplitude, rel=1e-9)
