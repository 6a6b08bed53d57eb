"""`patchfem new joint --ask`: the questions select a friction law, whose scene runs and lists its limits."""

import tomllib

import numpy as np
import pytest
from command_line import run_cli

import patchfem as pf
from patchfem.scene import (
    choose_law,
    compose_scene,
    load,
)
from patchfem.scene.joint_laws import JOINT_LAWS

ROWS = {f"{row.law}-{row.scene.rpartition('/')[2]}": row for row in JOINT_LAWS}
POINT = '[normal]\nload = "100 N"\n[friction]\nstatic = 0.3\n'
PATH = (
    '[slide]\nkind = "file"\nfile = "path.csv"\n'  # path to 3 um, back to 1.5 um and again to 3 um
)
BRISTLES = 'stiffness = "3e7 N/m"\n'  # the limit of 30 N is reached at 1 um
LIMIT_AT_3 = 1 - np.exp(-3.0)  # force / friction limit after 3 bond lengths: df/ds = 1 - f
AT_TURN = (1 + LIMIT_AT_3) * np.exp(
    -1.5
) - 1  # force / friction limit after a reversal of 1.5 bond lengths: df/ds = 1 + f
OPEN_LOOP = (
    100 * (1 - (1 - AT_TURN) * np.exp(-1.5)) / LIMIT_AT_3
)  # the same after the second reversal, in percent of the first maximum
# friction force at 3 um for the second time divided by that for the first time, in percent
SMALL_LOOPS = {
    'law = "elastic-plastic"\n' + BRISTLES: 100,
    'law = "iwan"\nchi = -0.5\nbeta = 0.1\n' + BRISTLES: 100,
    'law = "nonlocal"\nbond_length = "1 um"\n': OPEN_LOOP,
    'law = "lugre"\nstribeck_speed = "1 m/s"\n' + BRISTLES: OPEN_LOOP,
    'law = "bouc-wen"\n' + BRISTLES: OPEN_LOOP,
}
REFUSED = {
    "joint --know loop,roughnes --want loss": "--know: unknown answer 'roughnes'; did you mean 'roughness'?",
    "joint --know loop --want lost": "--want: unknown answer 'lost'; did you mean 'loss'?",
    "joint --know , --want loss": "--know: no answer; use one or more of damping, loop",
    "joint --know nothing,loop --want loss": "--know: 'nothing' excludes other answers",
    "joint --ask": "no terminal to ask at; give --know, from damping, loop",
    "joint --know loop": "no terminal to ask at; give --want, from loss, force-limit",
    "joint --want loss": "no terminal to ask at; give --know",
    "rig --ask": "--ask, --know and --want are for a joint: patchfem new joint --ask",
    "--ask": "patchfem new joint --ask",
}


@pytest.mark.parametrize("name", ROWS)
def test_always_scene_of_law_runs(name):
    """The scene of each friction law runs without warnings and has the listed keys."""
    row = ROWS[name]
    choice = choose_law(",".join(row.known), ",".join(row.wanted))
    text = compose_scene(choice)
    tables = tomllib.loads(text)
    friction = tables.get("friction") or tables["structure"]["interface"][0]
    result = pf.run(text)
    assert choice.row == row
    assert result.outcome in ("done", "steady") and not result.warnings
    assert friction["law"] == row.law
    assert {*friction} - {"law", "static", "between", "load"} | {
        f"[contact.{table}]"
        for table in ("shear", "asperities")
        if table in tables.get("contact", {})
    } == {*row.keys}


@pytest.mark.parametrize("law", SMALL_LOOPS)
def test_exact_small_loop_closure_of_laws(law, tmp_path):
    """The force ratio after a small reversal loop inside a larger one agrees with the closed form of each law within 1 %."""
    path = tmp_path / "scene.toml"
    path.write_text(f"{POINT}{law}{PATH}", "utf-8")
    (tmp_path / "path.csv").write_text(
        "time [s],displacement [um]\n0,0\n1,3\n2,1.5\n3,3\n4,3\n", "utf-8"
    )
    history = pf.run(path).to_xarray()
    first, second = np.interp([1, 3], history.time, history.friction_force.values.ravel())
    assert 100 * second / first == pytest.approx(SMALL_LOOPS[law], abs=1)


@pytest.mark.parametrize("words", REFUSED)
def test_refuses_unknown_answers(words):
    """Unknown answers to the questions are refused with a suggestion."""
    answer = run_cli("new", *words.split())
    assert answer.code == 2 and REFUSED[words] in answer.err and not answer.out


def test_always_new_joint_writes_scene_and_summary(tmp_path):
    """The file has the scene; the screen shows the law, its keys and its limits."""
    path = tmp_path / "joint.toml"
    words = ("new", "joint", "--know", "loop", "--want", "loss")
    answer = run_cli(*words, "-o", path)
    assert path.read_text("utf-8") == run_cli(*words).out and load(path).friction.law == "bouc-wen"
    assert "law: bouc-wen; keys: static, stiffness, exponent, shape" in answer.out
    assert "what it cannot do: " in answer.out and f"next: patchfem run {path}" in answer.out
    assert "already exists" in run_cli(*words, "-o", path).err
