"""The resolved scene in a results folder can be run from there, also if it names files."""

import shutil
from pathlib import Path

import pytest
from command_line import read_json, run_cli, run_successfully
from recorded_scenes import collect_scenes, write_input_files
from scene_texts import COATED, COULOMB, MODE, POINT

from patchfem.scene import list_named_files, load, loads

RIG = POINT + COULOMB + MODE
# Scenes whose tables name a file of each kind; nothing reads these files.
NAMED_FILES = {
    "contact.profile.file": COATED + '[contact.profile]\nfile = "{}"\n',
    "contact.mesh": COATED.replace("[contact]\n", '[contact]\nmesh = "{}"\n'),
    "contact.asperities.from": COATED
    + '[contact.asperities]\nlaw = "hertz"\nfrom = "{}"\ntangential_ratio = 0.8\n',
    "slide.file": POINT + COULOMB + '[slide]\nkind = "file"\nfile = "{}"\n',
    "drive.file": RIG + '[drive]\nkind = "base"\nwaveform = "file"\nfile = "{}"\n',
    "structure.file": POINT
    + COULOMB
    + '[structure]\nfile = "{}"\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n',
    "measured.file": RIG
    + '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n[measured]\nfile = "{}"\n',
}
# Scenes of tests/support/recorded_scenes.py that name a file, and run for about a second.
SCENES = ("04-C", "24-NFST", "45-NFMDQ", "63-NFRDQ")


@pytest.mark.parametrize("key", NAMED_FILES)
def test_exact_names_of_files_are_relative_to_the_folder_of_the_resolved_scene(tmp_path, key):
    """The resolved scene names the same file as the scene, from any folder; an absolute name is kept."""
    (tmp_path / "in/data").mkdir(parents=True)
    file = tmp_path / "in/data/input.npz"
    file.write_text("")
    out = tmp_path / "out/cases/1"
    out.mkdir(parents=True)
    for name in ("data/input.npz", str(file)):
        scene = loads(NAMED_FILES[key].format(name), tmp_path / "in/scene.toml")
        (out / "scene.resolved.toml").write_text(scene.resolved(out))
        again = load(out / "scene.resolved.toml")
        ((own_key, written),) = list_named_files(again)
        assert own_key == key and again.resolve_path(written).samefile(file)
        assert Path(written).is_absolute() == Path(name).is_absolute()


@pytest.mark.parametrize("name", SCENES)
def test_exact_run_is_repeated_from_its_results_folder(tmp_path, monkeypatch, name):
    """The resolved scene gives the results of the scene, also after scene and results were moved together.

    If the results alone are moved, the file is missing, and the message names it.
    """
    text, sets = collect_scenes()[name]
    work = tmp_path / "work"
    (work / "in").mkdir(parents=True)
    monkeypatch.chdir(work)
    write_input_files(Path("in"))
    Path("in/scene.toml").write_text(text)
    options = [word for assignment in sets for word in ("--set", assignment)]
    run_successfully("run", "in/scene.toml", *options, "--no-page", "-o", "out/first")

    moved = tmp_path / "elsewhere"
    monkeypatch.chdir(tmp_path)
    work.rename(moved)
    run_successfully("run", moved / "out/first/scene.resolved.toml", "--no-page", "-o", "again")
    first, again = (
        read_json(folder / "summary.json") for folder in (moved / "out/first", Path("again"))
    )
    assert again["outcome"] == first["outcome"] and again["measures"] == first["measures"]

    shutil.move(moved / "out/first", "alone")
    ((key, _),) = list_named_files(loads(text, sets=sets))
    refused = run_cli("check", "alone/scene.resolved.toml")
    assert refused.code == 2 and f"{key}: there is no file" in refused.err


def test_exact_cases_of_a_sweep_over_files_are_repeated_by_their_scenes(tmp_path, monkeypatch):
    """Each case folder of a sweep over a file, whose scene lies elsewhere, repeats the row of the case."""
    monkeypatch.chdir(tmp_path)
    Path("in").mkdir()
    write_input_files(Path("in"))
    shutil.copy("in/path.csv", "in/other.csv")
    Path("in/scene.toml").write_text(NAMED_FILES["slide.file"].format("path.csv"))
    over = ("--over", "slide.file=path.csv,other.csv", "--over", "friction.static=0.2,0.3")
    run_successfully(
        "sweep", "in/scene.toml", *over, "--keep", "results", "--no-page", "-o", "deep/out"
    )
    cases = list(Path("deep/out/cases").iterdir())
    assert len(cases) == 4
    for case in cases:
        run_successfully("run", case / "scene.resolved.toml", "--no-page", "-o", "again")
        row, again = (read_json(folder / "summary.json") for folder in (case, Path("again")))
        assert again["outcome"] == row["outcome"] and again["measures"] == row["measures"]
