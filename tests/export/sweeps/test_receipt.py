"""A whole sweep that is resumed is there at once, and only while nothing it is made of has changed."""

import csv
import os
import subprocess
import sys

import pytest
from command_line import cli
from scene_texts import COULOMB, POINT, SHORT

from patchfem.export.sweeps import manifest

OVER = ("--over", "friction.static=0.2,0.3,0.4", "--keep", "none")
COMMAND_WITHOUT_LIBRARIES = """import sys
from patchfem.__main__ import run_command
assert run_command(sys.argv[1:]) == 0
assert not {"numpy", "pydantic", "h5py", "numba"} & set(sys.modules)"""


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    scene = tmp_path_factory.mktemp("receipt") / "rig.toml"
    scene.write_text(POINT + COULOMB + SHORT, encoding="utf-8")
    return scene, scene.parent / "out", cli("sweep", scene, *OVER, "-o", scene.parent / "out")


def words(*over) -> tuple:
    return (*over, "", "draw=0,0,0", "of=", "page=True")


def test_exact_a_resumed_whole_sweep_says_the_same_and_loads_no_numpy(swept):
    scene, out, first = swept
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            COMMAND_WITHOUT_LIBRARIES,
            "sweep",
            scene,
            *OVER,
            "-o",
            out,
            "--resume",
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    assert first.code == 0 and done.stdout == first.out
    told = cli("sweep", scene, *OVER, "-o", out, "--resume", "--json")
    assert '"cases": 3' in told.out and told.code == 0


@pytest.mark.parametrize("change", ["chunk", "table", "gone", "scene", "words", "page"])
def test_always_whatever_has_changed_is_looked_at(swept, change):
    scene, out, _ = swept
    assert cli("sweep", scene, *OVER, "-o", out, "--resume").code == 0
    over = OVER[1]
    assert (
        manifest.read_manifest(out, manifest.hash_request(scene, words(over)))["cases"]["count"]
        == 3
    )
    file = next((out / "chunks").glob("*.h5")) if change == "chunk" else out / "sweep.csv"
    text = scene.read_text("utf-8")
    stamp = file.stat()
    if change in ("chunk", "table"):
        os.utime(file, ns=(stamp.st_atime_ns, stamp.st_mtime_ns + 1))
    if change == "gone":
        file.unlink()
    if change == "scene":
        scene.write_text(text + "# more\n", encoding="utf-8")
    asked = (
        (over + ",0.5", "", "draw=0,0,0", "page=True")
        if change == "words"
        else (over, "", "draw=0,0,0", "page=False")
        if change == "page"
        else words(over)
    )
    assert manifest.read_manifest(out, manifest.hash_request(scene, asked)) == {}
    scene.write_text(text, encoding="utf-8")
    # it is whole again, and has its receipt
    again = cli("sweep", scene, *OVER, "-o", out, "--resume")
    assert again.code == 0 and manifest.read_manifest(
        out, manifest.hash_request(scene, words(over))
    )


def test_exact_a_sweep_with_a_failed_case_has_no_receipt(swept, tmp_path):
    scene, *_ = swept
    assert (
        cli(
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
    "table, words",
    [
        ('[sweep]\n"slide.file" = "one.csv,two.csv"\n', ()),
        ("", ("--cases", "cases.csv")),
        ("", ("--set", "slide.file=two.csv", "--over", "friction.static=0.2,0.3")),
        ("", ("--over", "slide={kind = 'file', file = 'two.csv'}")),
    ],
    ids=["sweep", "cases", "set", "table"],
)
@pytest.mark.parametrize("whole", [True, False])
def test_always_a_file_that_a_sweep_names_anywhere_counts(
    tmp_path, monkeypatch, table, words, whole
):
    """The older answers were told after two.csv had changed."""
    monkeypatch.chdir(tmp_path)
    rows = "time [s],displacement [um]\n0,0\n1,{}\n2,0\n"
    for name, text in (
        ("rig.toml", BENCH + table),
        ("one.csv", rows.format(10)),
        ("two.csv", rows.format(10)),
        ("cases.csv", "slide.file\none.csv\ntwo.csv\n"),
    ):
        (tmp_path / name).write_text(text, encoding="utf-8")

    def last() -> float:
        done = cli("sweep", "rig.toml", *words, "--keep", "none", "-o", "out", "--resume")
        assert done.code == 0, done.err
        with open("out/sweep.csv", encoding="utf-8", newline="") as file:
            return float(list(csv.DictReader(file))[-1]["slip_amplitude"])

    first = last()
    (tmp_path / "two.csv").write_text(rows.format(20), encoding="utf-8")
    if not whole:
        (tmp_path / "out" / manifest.MANIFEST_NAME).unlink()
    if "--set" in words:  # of all cases: the folder is that of another scene
        told = cli("sweep", "rig.toml", *words, "--keep", "none", "-o", "out", "--resume")
        assert told.code == 2 and "contains a sweep of another scene" in told.err
        assert cli("sweep", "rig.toml", *words, "--keep", "none", "-o", "out").code == 0
    assert last() == pytest.approx(2 * first, rel=1e-9)


def test_always_the_content_of_a_file_that_a_word_names_counts(swept):
    scene, *_ = swept
    other = scene.parent / "push.csv"
    other.write_text("1", encoding="utf-8")
    before = manifest.hash_request(scene, words('drive.file="push.csv"'))
    other.write_text("2", encoding="utf-8")
    assert before != manifest.hash_request(scene, words('drive.file="push.csv"'))
    assert manifest.hash_request(scene.parent / "none.toml", words()) == ""
    assert manifest.read_manifest(scene.parent, "") == {}
