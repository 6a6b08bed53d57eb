"""Faults that the torture campaigns found, each with the shortest scene that showed it."""

import pytest
from command_line import run_cli
from scene_texts import BENCH
from torture.driver import run_trial

WORN = BENCH + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 10\n'


def refusal_message(tmp_path, text, *options):
    """Return stderr of `check` for a scene, which must be refused without an internal fault."""
    path = tmp_path / "scene.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    answer = run_cli("check", path, *options)
    assert answer.code == 2 and "internal fault" not in answer.err, answer.err
    return answer.err


CLIMBED = (BENCH + '[normal.grooves]\nwavelength = "80 um"\namplitude = "7 um"\n').replace(
    'law = "coulomb"', 'law = "nonlocal"\nbond_length = "1 um"'
)


@pytest.mark.parametrize("scene", [WORN, CLIMBED], ids=["wear", "grooves"])
@pytest.mark.parametrize("setting", ["accuracy = 1e308\n", 'accuracy = "exact"\n'])
def test_refuses_accuracy_that_is_not_a_table(tmp_path, setting, scene):
    """A number or a string under the key `accuracy` is refused with a message that names the
    key."""
    assert "accuracy: " in refusal_message(tmp_path, setting + scene)


@pytest.mark.parametrize("place", [".", "", "there", "there/."])
def test_refuses_folder_as_output_file(tmp_path, monkeypatch, place):
    """`schema -o` refuses the path of a folder, because it writes a file."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    answer = run_cli("schema", "-o", place)
    assert answer.code == 4 and "this is a folder; name a file" in answer.err


def test_always_long_arguments_are_shortened_in_messages():
    """A message about an argument of 3000 letters has fewer than 500 characters and states the
    length."""
    answer = run_cli("export", "out", "-o", "x.vtu", "--frame", "x" * 3000)
    assert answer.code == 2 and len(answer.err) < 500 and "3002 letters" in answer.err


@pytest.mark.parametrize("index", [335, 1001])
def test_always_repaired_trial_passes(tmp_path, index):
    """A slide of 1e-320, and the name of a mode with 3000 letters, which a remark repeats, have no raw or long line."""
    run_trial("grammar", 1, index, tmp_path)
