"""Checks of a scene that mutation tests showed to be missing."""

import re

import pytest
from scene_texts import (
    BLOCK,
    COULOMB,
    DRIVE,
    FORCED,
    MODE,
    PAIR,
    PLASTIC,
    POINT,
    TRIANGLE,
    list_mistakes,
)

from patchfem.scene import load, loads
from patchfem.scene.scene import SceneError

WORN_FRICTION = """\
[wear]
coefficient = "1e-14 1/Pa"
cycles = 1e4
[wear.friction]
depth = ["0 um", "1 um"]
coefficient_factor = [1.0, 1.2]
"""
SHAKEN = POINT + COULOMB + MODE + DRIVE


@pytest.mark.parametrize(
    ("text", "says"),
    [
        (
            POINT + PLASTIC + 'stiffness = "1e7 N/m"\n' + TRIANGLE,
            [r"a\.toml:7: friction\.stiffness: `bond_length` and `stiffness` exclude each other"],
        ),
        (
            POINT + COULOMB + TRIANGLE + WORN_FRICTION,
            [r"a\.toml:14: wear\.friction: a \[normal\] contact has no area.*use \[contact\]"],
        ),
        (
            BLOCK + COULOMB + TRIANGLE + '[contact.upper]\nend_radius = "100 nm"\n',
            [r"a\.toml:16: contact\.upper\.end_radius: 1e-07 m is less than .* leave this key out"],
        ),
        (
            SHAKEN + 'waveform = "sweep"\n',
            [
                r"a\.toml:13: drive\.from: missing; .*waveform 'sweep' needs this key",
                r"a\.toml:13: drive\.to: missing; .*waveform 'sweep' needs this key",
                r"a\.toml:13: drive\.rate: missing; .*waveform 'sweep' needs this key or log_rate",
            ],
        ),
    ],
)
def test_refuses_scene_with_line_key_and_remedy(text, says):
    """A mistake is reported with its line, its key and a remedy."""
    found = list_mistakes(text)
    assert len(found) == len(says)
    assert all(re.match(pattern, mistake) for pattern, mistake in zip(says, found))


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (SHAKEN + 'waveform = "sine"\nrate = "80 Hz/s"\n', "drive.rate"),
        (
            PAIR.replace("[structure]\n", '[structure]\nmoving_mass = "1 kg"\n') + FORCED,
            "structure.moving_mass",
        ),
    ],
)
def test_exact_key_without_effect_gives_remark(text, key):
    """A key without effect gives one remark."""
    (remark,) = loads(text).remarks
    assert remark.startswith(f"{key} has no meaning ") and remark.endswith("is not used")


def test_refuses_change_to_absent_file(tmp_path):
    """A change of a scene to an absent file is refused with its full path."""
    path = tmp_path / "a.toml"
    scene = loads(POINT + COULOMB + TRIANGLE, path)
    with pytest.raises(SceneError) as refusal:
        scene.with_(**{"measured.file": "no.csv"})
    (mistake,) = refusal.value.mistakes
    assert mistake.startswith(f"--set: measured.file: there is no file {tmp_path / 'no.csv'}")


def test_refuses_absent_file_at_its_line(tmp_path):
    """A scene with an absent file is refused at the line of the file."""
    path = tmp_path / "a.toml"
    path.write_text(POINT + COULOMB + '[slide]\nkind = "file"\nfile = "no.csv"\n')
    with pytest.raises(SceneError) as refusal:
        load(path)
    (mistake,) = refusal.value.mistakes
    assert f"a.toml:8: slide.file: there is no file {tmp_path / 'no.csv'}" in mistake


def test_exact_end_radius_above_minimum_is_accepted():
    """An end radius of 0.13 um, just above the minimum, is accepted."""
    scene = loads(BLOCK + COULOMB + TRIANGLE + '[contact.upper]\nend_radius = "0.13 um"\n')
    assert scene.contact.upper.end_radius == pytest.approx(1.3e-7, rel=1e-12)
