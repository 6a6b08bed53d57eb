"""The verbs of the first hour: a scene to start from, the shipped run, the schema, the doctor, what to cite."""

import json
import re
import shlex
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from command_line import cli

import patchfem as pf
from patchfem.__main__ import VERBS, app, known
from patchfem.commands import examine
from patchfem.commands.sources import SOURCES, bibtex
from patchfem.effects import EFFECTS
from patchfem.scene.scene import loads
from patchfem.scene.starting import KINDS, NEXT, shipped, text_of

known([])  # all verbs


def test_exact_new_writes_what_it_prints(tmp_path):
    path = tmp_path / "mine.toml"
    assert cli("new", "joint").out == text_of("joint") == pf.new("joint")
    answer = cli("new", "joint", "-o", path)
    assert (
        answer.code == 0
        and path.read_text("utf-8") == text_of("joint")
        and f"patchfem run {path}" in answer.out
    )
    for kind, verb in NEXT.items():
        assert f"patchfem {verb} " in cli("new", kind, "-o", tmp_path / f"{kind}.toml").out
        assert f"patchfem {verb} FILE" in " ".join(text_of(kind).replace("\n#", " ").split())
    path.write_text("mine", "utf-8")
    answer = cli("new", "rig", "-o", path)
    assert answer.code == 2 and "already exists" in answer.err and path.read_text("utf-8") == "mine"


def test_exact_new_names_its_kinds():
    assert [line.split()[0] for line in cli("new").out.splitlines()] == list(KINDS)
    said = f"joitn: unknown kind of scene; did you mean 'joint'? use one of {', '.join(KINDS)}\n"
    assert cli("new", "joitn")[::2] == (2, said)
    with pytest.raises(pf.PatchfemError, match="did you mean 'joint'"):
        pf.new("joitn")


def test_exact_the_demo_is_the_rig_of_the_report(tmp_path):
    answer = cli("demo", "-o", tmp_path / "out", "--no-page")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    amplitude = summary["measures"]["relative_displacement_amplitude"]
    assert answer.code == 0 and amplitude["value"] == pytest.approx(
        14.8028e-6, abs=amplitude["error"]
    )
    few = {"drive.cycles": 3}
    assert (
        pf.demo(**few).measures["loop_area"].value
        == pf.run(shipped(), **few).measures["loop_area"].value
        > 0
    )


def test_exact_the_schema_is_written_as_it_is_printed(tmp_path):
    assert cli("schema", "-o", tmp_path / "a.json").code == 0
    assert (tmp_path / "a.json").read_text("utf-8") == cli("schema").out
    assert json.loads(cli("schema").out)["$defs"]["Contact"]["properties"]["length"][
        "examples"
    ] == ["12.7 mm"]


def test_always_the_doctor_tells_what_is_missing(monkeypatch):
    monkeypatch.setattr(examine, "PICTURE", "raise OSError('no display')")
    monkeypatch.setattr(
        examine, "_version", lambda name: "" if name in ("scipy", "trame") else "1.0"
    )
    found = {one["name"]: one for one in json.loads(cli("doctor", "--json").out)}
    assert (
        not found["scipy"]["fine"]
        and found["scipy"]["cure"] == "pip install scipy"
        and found["numpy"]["fine"]
    )
    assert found["trame (fields in a browser)"]["cure"] == 'pip install "patchfem[web]"'
    assert (
        "no display" in found["the window by OpenGL"]["found"]
        and found["the window by OpenGL"]["cure"]
    )
    lines = cli("doctor").out.splitlines()
    assert len(lines) == len(found)
    clock = (
        "2026-11-24 11:39:48.555 (   2.046s) [    7FA06DECE780]    vtkX11Functions.cxx:126   WARN| "
    )
    monkeypatch.setattr(
        examine, "PICTURE", f"import sys; sys.exit('{clock}Failed to load an X11 library')"
    )
    assert examine._window().found == "Failed to load an X11 library"
    assert [line.split()[1] for line in lines if line.startswith("--")] == ["scipy", "the", "trame"]


def test_always_the_doctor_names_every_package_of_the_project_and_what_writes_films(monkeypatch):
    monkeypatch.setattr(examine, "PICTURE", "")
    monkeypatch.setattr(examine, "which", lambda name: None)
    monkeypatch.setattr(examine, "_version", lambda name: "")
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))[
        "project"
    ]
    found = {one.name: one for one in examine.examined()}
    named = {re.match(r"[\w-]+", line)[0] for line in project["dependencies"]}
    assert set(examine.NEEDED) == named and named <= set(found)
    assert {extra for extra, _ in examine.EXTRAS.values()} == set(
        project["optional-dependencies"]
    ) - {"test", "docs"}
    assert (
        not found["films (.mp4)"].fine
        and "pip install imageio-ffmpeg" in found["films (.mp4)"].cure
    )
    monkeypatch.setattr(examine, "_version", lambda name: "0.6" if name == "imageio-ffmpeg" else "")
    assert examine._film()[1:] == (True, "imageio-ffmpeg 0.6", "")


def test_always_a_fault_of_the_program_says_what_to_send(monkeypatch):
    monkeypatch.setattr(examine, "examined", lambda: 1 / 0)
    answer = cli("doctor")
    assert (
        answer.code == 1
        and "internal fault in " in answer.err
        and "(doctor): ZeroDivisionError" in answer.err
    )
    assert "what `patchfem doctor` says to the project's issue tracker" in answer.err


def test_always_the_doctor_says_where_compiled_code_cannot_be_kept(monkeypatch, tmp_path):
    (tmp_path / "file").touch()
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "file" / "below"))
    assert not examine._cache().fine and "PATCHFEM_CACHE" in examine._cache().cure


def test_exact_a_scene_cites_what_its_effects_stand_on(tmp_path):
    keys = lambda text: re.findall(r"^@\w+\{(\w+),", text, re.M)  # noqa: E731
    assert keys(cli("cite").out) == ["srinivasan1985", "patchfem"]
    path = tmp_path / "a.toml"
    path.write_text(
        text_of("rig").replace('"coulomb"', '"nonlocal"\nbond_length = "1 um"'), "utf-8"
    )
    assert keys(cli("cite", path).out) == ["srinivasan1985", "patchfem", "oden1983"]
    assert {"hueber2005", "archard1953"} <= set(keys(bibtex(loads(text_of("wear")).named())))
    assert {name for names, _ in SOURCES for name in names} <= set(EFFECTS)


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_always_every_verb_completes(shell):
    script = app.generate_completion(shell=shell)
    assert all(verb in script for verb in ("sweep", "doctor", "no-page"))
    if shell == "bash":
        asked = 'COMP_WORDS=(patchfem sw); COMP_CWORD=1; COMP_LINE="patchfem sw"; COMP_POINT=11\n'
        name = re.search(r"complete .*-F (\S+) patchfem", script)[1]
        done = subprocess.run(
            [
                "bash",
                "-c",
                f'{script}\n{asked}{name} patchfem sw patchfem; echo "${{COMPREPLY[@]}}"',
            ],
            capture_output=True,
            text=True,
            check=True,
            timeout=30,
        )
        assert "sweep" in done.stdout.split()


def test_always_help_imports_nothing_of_them():
    """`patchfem --help` names the verbs without the modules behind them; of a verb its own module is loaded alone."""
    code = (
        "import sys; from patchfem.__main__ import known; known([{}]); "
        "print([m for m in sys.modules if m.startswith('patchfem.')])"
    )
    all_, run = (
        subprocess.run(
            [sys.executable, "-c", code.format(verb)], capture_output=True, text=True, check=True
        ).stdout
        for verb in ("", "'run'")
    )
    assert "patchfem.commands.start" in all_ and "patchfem.commands.run" in run
    for name in ("examine", "sources", "starting", "schema"):
        assert name not in all_
    assert "patchfem.commands.start" not in run and "patchfem.commands.sweep" not in run


@pytest.mark.parametrize("verb", VERBS)
def test_always_help_says_what_each_option_does_by_an_example(verb):
    about = app[verb].help.partition("Example: ")
    assert about[0].strip() and all(
        one.parameter.help
        for one in app[verb].assemble_argument_collection()
        if one.parameter.name and any(name.startswith("-") for name in one.names)
    )
    for one in app[verb].assemble_argument_collection():
        named = [name for name in one.names if name.startswith("-")]
        if one.parameter.name and named and one.hint is not bool:
            assert "such as" in one.parameter.help or set(named) & set(about[2].split()), named
    words = shlex.split(" ".join(about[2].split()))
    assert words[:2] == ["patchfem", verb]
    assert (
        app.parse_args(words[1:], exit_on_error=False, print_error=False)[0].__name__.rstrip("_")
        == verb
    )
