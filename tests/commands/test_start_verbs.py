"""The commands for beginners: `new`, `demo`, `schema`, `doctor`, `cite`, help and completion."""

import json
import re
import shlex
import subprocess
import tomllib
from importlib.metadata import PackageNotFoundError
from pathlib import Path

import pytest
from command_line import run_cli

import patchfem as pf
from patchfem import load
from patchfem.__main__ import VERBS, app, register_verbs
from patchfem.commands import examine
from patchfem.commands.sources import SOURCES, bibtex
from patchfem.effects import EFFECTS
from patchfem.scene import NEXT_VERBS, TEMPLATE_DESCRIPTIONS, read_template

register_verbs([])  # all verbs


def test_exact_new_writes_template(tmp_path):
    """`patchfem new` writes the template that it prints, names the next command, and does not overwrite a file."""
    path = tmp_path / "mine.toml"
    assert run_cli("new", "joint").out == read_template("joint") == pf.new("joint")
    answer = run_cli("new", "joint", "-o", path)
    assert answer.code == 0
    assert path.read_text("utf-8") == read_template("joint")
    assert f"patchfem run {path}" in answer.out
    for kind, verb in NEXT_VERBS.items():
        assert f"patchfem {verb} " in run_cli("new", kind, "-o", tmp_path / f"{kind}.toml").out
        assert f"patchfem {verb} FILE" in " ".join(read_template(kind).replace("\n#", " ").split())
    path.write_text("mine", "utf-8")
    answer = run_cli("new", "rig", "-o", path)
    assert answer.code == 2 and "already exists" in answer.err and path.read_text("utf-8") == "mine"


def test_exact_new_lists_kinds_of_scenes():
    """`patchfem new` lists the kinds of scenes, and suggests one for a misspelt kind."""
    assert [line.split()[0] for line in run_cli("new").out.splitlines()] == list(
        TEMPLATE_DESCRIPTIONS
    )
    message = f"joitn: unknown kind of scene; did you mean 'joint'? use one of {', '.join(TEMPLATE_DESCRIPTIONS)}\n"
    assert run_cli("new", "joitn")[::2] == (2, message)
    with pytest.raises(pf.PatchfemError, match="did you mean 'joint'"):
        pf.new("joitn")


def test_exact_demo_runs_shipped_rig(tmp_path):
    """`patchfem demo` runs the rig of the report: its amplitude agrees with 14.8028 um within the error."""
    answer = run_cli("demo", "-o", tmp_path / "out", "--no-page")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text("utf-8"))
    amplitude = summary["measures"]["relative_displacement_amplitude"]
    assert answer.code == 0 and amplitude["value"] == pytest.approx(
        14.8028e-6, abs=amplitude["error"]
    )


def replace_versions(monkeypatch, version_of) -> None:
    """Let the doctor find the versions that a function returns."""
    monkeypatch.setattr(examine, "version", version_of)


def examine_with(monkeypatch, version_of) -> dict:
    """Run the doctor with these versions of packages; return the findings by name."""
    replace_versions(monkeypatch, version_of)
    return {finding["name"]: finding for finding in json.loads(run_cli("doctor", "--json").out)}


def versions_of_only(*installed: str):
    """Return a replacement of `importlib.metadata.version` for an environment with only these packages."""

    def version_of(name: str) -> str:
        """Return version 1.0 of an installed package."""
        if name not in installed:
            raise PackageNotFoundError(name)
        return "1.0"

    return version_of


@pytest.fixture
def broken_opengl(tmp_path, monkeypatch):
    """Provide a pyvista that fails like a driver that cannot draw, with a time stamp of VTK."""
    clock = (
        "2026-11-24 11:39:48.555 (   2.046s) [    7FA06DECE780]    vtkX11Functions.cxx:126   WARN| "
    )
    (tmp_path / "pyvista.py").write_text(
        f"import sys; sys.exit('{clock}Failed to load an X11 library')"
    )
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))


def test_always_doctor_checks_all_dependencies(tmp_path, monkeypatch, broken_opengl):
    """The doctor checks every dependency and extra of pyproject.toml, and the programs that write films."""
    monkeypatch.setenv("PATH", str(tmp_path))
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8")
    project = tomllib.loads(text)["project"]
    found = examine_with(monkeypatch, versions_of_only())
    dependencies = {re.match(r"[\w-]+", line)[0] for line in project["dependencies"]}
    assert {finding for finding in found if found[finding]["cure"] == f"pip install {finding}"} == (
        dependencies
    )
    extras = {re.search(r"patchfem\[(\w+)\]", finding["cure"]) for finding in found.values()} - {
        None
    }
    assert {match[1] for match in extras} == {*project["optional-dependencies"]} - {"test", "docs"}
    film = found["films (.mp4)"]
    assert not film["fine"] and "pip install imageio-ffmpeg" in film["cure"]
    film = examine_with(monkeypatch, versions_of_only("imageio-ffmpeg"))["films (.mp4)"]
    assert film["fine"] and film["found"] == "imageio-ffmpeg 1.0" and not film["cure"]


def test_always_internal_error_asks_for_report(monkeypatch):
    """An internal error ends with code 1 and asks for a report with the output of `patchfem doctor`."""
    replace_versions(monkeypatch, lambda name: 1 / 0)
    answer = run_cli("doctor")
    assert answer.code == 1
    assert "internal fault in " in answer.err and "): ZeroDivisionError" in answer.err
    assert "what `patchfem doctor` says to the project's issue tracker" in answer.err


def test_always_doctor_reports_unusable_cache(monkeypatch, tmp_path, broken_opengl):
    """The doctor reports a cache folder that cannot be created."""
    (tmp_path / "file").touch()
    monkeypatch.setenv("PATCHFEM_CACHE", str(tmp_path / "file" / "below"))
    found = {finding["name"]: finding for finding in json.loads(run_cli("doctor", "--json").out)}
    assert not found["compiled code"]["fine"] and "PATCHFEM_CACHE" in found["compiled code"]["cure"]


def test_exact_cite_lists_sources_of_effects(tmp_path):
    """`patchfem cite` lists the sources of the effects in a scene."""
    keys = lambda text: re.findall(r"^@\w+\{(\w+),", text, re.M)  # noqa: E731
    assert keys(run_cli("cite").out) == ["srinivasan1985", "patchfem"]
    path = tmp_path / "a.toml"
    path.write_text(
        read_template("rig").replace('"coulomb"', '"nonlocal"\nbond_length = "1 um"'), "utf-8"
    )
    assert keys(run_cli("cite", path).out) == ["srinivasan1985", "patchfem", "oden1983"]
    assert {"hueber2005", "archard1953"} <= set(
        keys(bibtex(load(read_template("wear")).effect_names()))
    )
    assert {name for names, _ in SOURCES for name in names} <= set(EFFECTS)
    for _, (_, key, fields) in SOURCES:  # A key is made of the first author's surname and the year.
        surname = re.sub(r"[^a-z ,]", "", fields["author"].lower()).replace(",", " ").split()[0]
        assert key == surname + fields["year"]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_always_shell_completion_covers_commands(shell):
    """The completion script of each shell contains the commands and options; bash completes `sw` to `sweep`."""
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


@pytest.mark.parametrize("verb", VERBS)
def test_always_help_describes_options_with_examples(verb):
    """The help of each command describes every option, and its example can be parsed."""
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
