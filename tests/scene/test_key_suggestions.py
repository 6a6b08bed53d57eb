"""Suggestions for an unknown key, by its name and by the kind of its value."""

import re

import pytest

from patchfem.scene import loads, read_template
from patchfem.scene.scene import SceneError

MEANT = [  # kind of scene, correct line, wrong line, suggested key
    ("rig", "static = 0.3", "mu = 0.3", "static"),
    ("rig", "moving_mass", "mass", "moving_mass"),
    ("patch", "substrate", "material", "substrate"),
    ("patch", "load", "force", "load"),
    ("bench", "bond_length", "eps", "bond_length"),
    ("patch", "thickness", "height", "thickness"),
    ("bench", "amplitude", "stroke", "amplitude"),
    ("joint", "amplitude", "frequenzy", "amplitude"),  # alike by name, but a length is no frequency
    ("linear", "[[structure.mode]]", "[[mode]]", "structure.mode"),
    ("patch", "[contact.coating]", "[contact.layer]", "coating"),
    ("patch", "[contact.tilt]", '[contact.lowr]\nheight = "5 mm"\n[contact.tilt]', "lower"),
]


@pytest.mark.parametrize(
    "kind, right, wrong, meant", MEANT, ids=[f"{wrong} {kind}" for kind, _, wrong, _ in MEANT]
)
def test_exact_unknown_key_gets_suggestion(kind, right, wrong, meant):
    """An unknown key in a file is refused with the suggestion of the intended key."""
    text = read_template(kind)
    assert right in text
    with pytest.raises(SceneError) as error:
        loads(text.replace(right, wrong, 1))
    messages = [line for line in error.value.mistakes if "unknown" in line]
    assert len(messages) == 1 and re.search(rf"; did you mean '{meant}'\?", messages[0]), (
        error.value.mistakes
    )


@pytest.mark.parametrize(
    "wrong, says",
    [
        ("friction.amplitude=2 um", "[normal] and [slide] have a key of this name"),
        (
            "normal.between=[1, 2]",
            "[[structure.spring]], [[structure.damper]] and [[structure.interface]] have a key of",
        ),
        ("drive.yaw=1 rad/m", "[[structure.mode]] has a key of this name"),
        ("structure.damping=0.01", "unknown key; [[structure.mode]], "),
        (
            "structure.frequency=9 Hz",
            "[normal], [slide], [[structure.mode]] and [drive] have a key of",
        ),
        ("structure.law=coulomb", "[friction] and [[structure.interface]] have a key of this name"),
        (
            "friction.tolerance=1e-3",
            "unknown key; [accuracy] has a key of this name; known here: law, static",
        ),
        ("structure.interface.0.load=1 N", "the scene has no [[structure.interface]]"),
    ],
)
def test_exact_key_of_another_table_names_the_table(wrong, says):
    """The message on a key in the wrong table, or of an item that the scene lacks, names the table."""
    with pytest.raises(SceneError, match=re.escape(says)):
        loads(read_template("bench"), sets=[wrong])


@pytest.mark.parametrize("wrong", ["qqq = true", 'qqq = "blue"', "qqq = {a = 1}"])
def test_always_unrecognised_key_lists_known_keys(wrong):
    """A key that resembles no other gets a list of the known keys."""
    with pytest.raises(SceneError) as refused:
        loads(read_template("rig").replace('kind = "base"', f'kind = "base"\n{wrong}'))
    assert [
        line
        for line in refused.value.mistakes
        if "drive.qqq: unknown" in line and "known here: " in line
    ]
