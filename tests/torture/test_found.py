"""What the attacks found, each as the shortest scene that showed it."""

import pytest
from command_line import cli
from scene_texts import BENCH

WORN = BENCH + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 10\n'


def refused(tmp_path, text, *words):
    """stderr of `check` of a scene, which must be refused in words."""
    path = tmp_path / "scene.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    answer = cli("check", path, *words)
    assert answer.code == 2 and "internal fault" not in answer.err, answer.err
    return answer.err


CLIMBED = (BENCH + '[normal.grooves]\nwavelength = "80 um"\namplitude = "7 um"\n').replace(
    'law = "coulomb"', 'law = "nonlocal"\nbond_length = "1 um"'
)


@pytest.mark.parametrize("scene", [WORN, CLIMBED], ids=["wear", "grooves"])
@pytest.mark.parametrize("wrong", ["accuracy = 1e308\n", 'accuracy = "exact"\n'])
def test_refuses_accuracy_that_is_no_table(tmp_path, wrong, scene):
    assert "accuracy: " in refused(tmp_path, wrong + scene)


@pytest.mark.parametrize("place", [".", "", "there", "there/."])
def test_refuses_a_folder_as_the_place_of_a_file(tmp_path, monkeypatch, place):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there").mkdir()
    answer = cli("schema", "-o", place)
    assert answer.code == 4 and "this is a folder; name a file" in answer.err


def test_always_long_words_are_cut():
    answer = cli("export", "out", "-o", "x.vtu", "--frame", "x" * 3000)
    assert answer.code == 2 and len(answer.err) < 500 and "3002 letters" in answer.err
