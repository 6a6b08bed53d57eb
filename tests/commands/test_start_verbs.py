"""The commands for beginners: `new`, `demo`, `schema`, `doctor`, `cite`, help and completion."""

import re
import subprocess
import tomllib
from pathlib import Path

import pytest
from command_line import read_json, run_cli, run_successfully

import patchfem as pf
from patchfem import load
from patchfem.__main__ import app, register_verbs
from patchfem.commands import examine
from patchfem.commands.sources import bibtex, read_sources
from patchfem.effects import EFFECTS
from patchfem.scene import NEXT_VERB_BY_KIND, read_template

register_verbs([])  # all verbs


def test_exact_new_writes_template(tmp_path):
    """`patchfem new` writes the template that it prints, names the next command, and does not overwrite a file."""
    path = tmp_path / "mine.toml"
    assert run_cli("new", "joint").out == read_template("joint") == pf.new("joint")
    answer = run_successfully("new", "joint", "-o", path)
    assert path.read_text("utf-8") == read_template("joint")
    assert f"patchfem run {path}" in answer.out
    for kind, verb in NEXT_VERB_BY_KIND.items():
        assert f"patchfem {verb} " in run_cli("new", kind, "-o", tmp_path / f"{kind}.toml").out
        assert f"patchfem {verb} FILE" in " ".join(read_template(kind).replace("\n#", " ").split())
    path.write_text("mine", "utf-8")
    answer = run_cli("new", "rig", "-o", path)
    assert answer.code == 2 and "already exists" in answer.err and path.read_text("utf-8") == "mine"


def test_exact_demo_runs_shipped_rig(tmp_path):
    """`patchfem demo` runs the rig of the report: its amplitude agrees with 14.8028 um within the error."""
    answer = run_cli("demo", "-o", tmp_path / "out", "--no-page")
    summary = read_json(tmp_path / "out/summary.json")
    amplitude = summary["measures"]["relative_displacement_amplitude"]
    assert answer.code == 0 and amplitude["value"] == pytest.approx(
        14.8028e-6, abs=amplitude["error"]
    )


def examine_with(monkeypatch, *installed: str) -> dict:
    """Run the doctor where only these packages are installed, in version 1.0; return the findings by name."""
    monkeypatch.setattr(
        examine, "find_package_version", lambda name: "1.0" if name in installed else ""
    )
    return {finding["name"]: finding for finding in run_cli("doctor", "--json").content}


def test_always_doctor_checks_all_dependencies(tmp_path, monkeypatch):
    """The doctor checks every dependency and extra of pyproject.toml, and the programs that write films."""
    monkeypatch.setenv("PATH", str(tmp_path))
    text = (Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8")
    project = tomllib.loads(text)["project"]
    found = examine_with(monkeypatch)
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
    film = examine_with(monkeypatch, "imageio-ffmpeg")["films (.mp4)"]
    assert film["fine"] and film["found"] == "imageio-ffmpeg 1.0" and not film["cure"]


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
    of_effects = [source for source in read_sources() if source.effects]
    assert len(of_effects) == 11
    for text, fields, effects in of_effects:  # a key is the first author's surname and the year
        surname = re.sub(r"[^a-z ,]", "", fields["author"].lower()).replace(",", " ").split()[0]
        assert keys(text) == [surname + fields["year"]] and set(effects) <= set(EFFECTS)
        assert {"title", "journal", "volume", "pages"} <= fields.keys()


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
