"""A whole run loads nothing that it could do without, and says the versions that the packages' own records say."""

import json
import subprocess
import sys
from importlib.metadata import version
from pathlib import Path

from command_line import FROM_SHELL, cli, loaded, loaded_again
from scene_texts import COULOMB, POINT, STRUCTURE

from patchfem.export.summary import PACKAGES, versions

RINGING = """
[normal]
load = "109.3 N"
[friction]
law = "elastic-plastic"
static = 0.755
bond_length = "0.97 um"
[structure]
moving_mass = "0.214 kg"
[[structure.mode]]
name = "first"
frequency = "136.3 Hz"
damping = 0.003
slide = 1.0
base = 0.8
[[structure.mode]]
name = "second"
frequency = "334.5 Hz"
damping = 0.05
slide = 0.3
base = 0.1
[drive]
kind = "base"
acceleration = "3.655 m/s^2"
frequency = "123.9 Hz"
cycles = 12
"""
RIG = Path(__file__).parents[1] / "studies" / "rig" / "rig.toml"


def test_exact_a_rig_with_its_page_loads_no_dice_and_no_benches(tmp_path):
    """Each takes 10 to 30 ms: numpy's generators, the writer of completions, the benches behind wear,
    the mails that importlib.metadata reads versions with."""
    words = ("run", RIG, "--set", "drive.cycles=12", "-o", tmp_path / "out", "-q")
    modules = loaded_again(FROM_SHELL, *words)
    assert "patchfem.dynamics.march.march" in modules and (tmp_path / "out" / "report.html").is_file()
    unwanted = {"numpy.random", "cyclopts.completion", "numba", "patchfem.runs.bench.bench",
                "patchfem.runs.wear", "email", "socket"}
    modules = set(modules) - {"patchfem.runs.wear"}  # the folder's own words, a docstring
    assert not {name for name in modules if any(f"{name}.".startswith(f"{one}.") for one in unwanted)}


def test_exact_a_short_rig_that_rings_compiles_nothing(tmp_path, monkeypatch):
    """Nothing is kept: the loop, and the fit of what rings while the interface sticks, run as Python."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "empty"))
    scene = tmp_path / "scene.toml"
    scene.write_text(RINGING, "utf-8")
    assert "numba" not in loaded(FROM_SHELL, "run", scene, "-o", tmp_path / "out", "-q")
    values = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert "ring_frequency" in values["measures"]


def test_exact_a_check_reads_no_metadata_and_who_wants_it_has_it(tmp_path):
    scene = tmp_path / "scene.toml"
    scene.write_text(POINT + COULOMB + STRUCTURE, "utf-8")
    assert not {name for name in loaded(FROM_SHELL, "check", scene) if name.split(".")[0] in ("email", "socket")}
    for use in ("import importlib.metadata; found = importlib.metadata.version('numpy')",
                "from importlib.metadata import entry_points as e; from importlib.metadata import version; "
                "found = version('numpy') if e(group='console_scripts') else ''"):
        code = f"import json, sys, patchfem.__main__; {use}; print(json.dumps([found]))"
        assert loaded(code) == {version("numpy")}


def test_exact_versions_are_those_of_the_installed_packages():
    found = versions()
    assert set(found) == {"python", *PACKAGES}
    assert all(found[name] == version(name) for name in PACKAGES)


def test_always_completions_are_written_where_they_are_asked_for(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", str(tmp_path))
    done = cli("--install-completion", "--shell", "bash", "-o", tmp_path / "patchfem.bash")
    assert done.code == 0, done.err
    assert "patchfem" in (tmp_path / "patchfem.bash").read_text() and "patchfem" in done.out


def test_exact_no_search_for_garbage_in_a_short_command_and_later_ones_sooner(tmp_path):
    """Two searches took 17 ms of a check and 35 ms of a run of the rig."""
    watched = ("import gc, json, sys; found = []; gc.set_threshold(10**9); "
               "from patchfem.__main__ import main\n"
               "gc.callbacks.append(lambda phase, _: found.append(gc.get_threshold()[0]))\n"
               "try:\n    main(sys.argv[1:])\nexcept SystemExit as end:\n    assert not end.code\n"
               "short = list(found)\nkept = [[] for _ in range(400_000)]\n"
               "print(json.dumps([short, found[:1], found[-1:]]))")
    done = subprocess.run([sys.executable, "-c", watched, "check", RIG], capture_output=True, text=True, check=True)
    assert json.loads(done.stdout.splitlines()[-1]) == [[], [50_000], [50_000]]
