"""What someone meant who wrote a key that no scene has: by its name, and by the kind of its value."""

import re

import pytest

from patchfem.scene import loads, read_template
from patchfem.scene.scene import SceneError

MEANT = [  # kind of scene, what stands there, what was written, what was meant
    ("rig", "static = 0.3", "mu = 0.3", "static"),
    ("rig", "static = 0.3", "coefficient = 0.3", "static"),
    ("rig", "moving_mass", "mass", "moving_mass"),
    ("rig", "moving_mass", "block_mass", "moving_mass"),
    ("patch", "substrate", "material", "substrate"),
    ("patch", "load", "force", "load"),
    ("patch", "load", "normal_force", "load"),
    ("rig", "acceleration =", "amplitude =", "acceleration"),
    ("rig", 'frequency = "143 Hz"             #', 'freq = "143 Hz" #', "frequency"),
    ("rig", "damping = 0.003", "zeta = 0.003", "damping"),
    ("bench", "bond_length", "eps", "bond_length"),
    ("patch", "angle", "theta", "angle"),
    ("patch", "tolerance", "tol", "tolerance"),
    ("patch", "thickness", "height", "thickness"),
    ("bench", "amplitude", "stroke", "amplitude"),
    ("joint", "amplitude", "frequenzy", "amplitude"),  # alike by name, but a length is no frequency
    ("bench", "[slide]", "[motion]", "slide"),
    ("rig", "[drive]", "[excitation]", "drive"),
    ("patch", "[contact]", "[patch]", "contact"),
    ("linear", "[[structure.mode]]", "[[mode]]", "structure.mode"),
    ("patch", "[contact.coating]", "[contact.layer]", "coating"),
    ("patch", "[contact.tilt]", '[contact.lowr]\nheight = "5 mm"\n[contact.tilt]', "lower"),
]


@pytest.mark.parametrize(
    "kind, right, wrong, meant", MEANT, ids=[f"{wrong} {kind}" for kind, _, wrong, _ in MEANT]
)
def test_exact_the_key_that_was_meant(kind, right, wrong, meant):
    text = read_template(kind)
    assert right in text
    with pytest.raises(SceneError) as refused:
        loads(text.replace(right, wrong, 1))
    said = [line for line in refused.value.mistakes if "unknown" in line]
    assert len(said) == 1 and re.search(rf"; did you mean '{meant}'\?$", said[0]), (
        refused.value.mistakes
    )


@pytest.mark.parametrize(
    "wrong, meant",
    [
        ("structure.mass=1 kg", "moving_mass"),
        ("friction.mu=0.3", "static"),
        ("drive.freq=3 Hz", "frequency"),
        ("normal.force=3 N", "load"),
    ],
)
def test_exact_a_set_means_a_key_that_the_file_has(wrong, meant):
    with pytest.raises(SceneError, match=rf"^--set: \S+: unknown key; did you mean '{meant}'\?$"):
        loads(read_template("rig"), sets=[wrong])


def test_always_of_several_lengths_none_is_meant():
    with pytest.raises(SceneError, match="unknown key; known here: length, width, height"):
        loads(read_template("patch"), sets=["contact.thicknes=1 mm"])


@pytest.mark.parametrize("wrong", ["qqq = true", 'qqq = "blue"', "qqq = {a = 1}"])
def test_always_what_nothing_tells_is_answered_by_all_that_is_known(wrong):
    with pytest.raises(SceneError) as refused:
        loads(read_template("rig").replace('kind = "base"', f'kind = "base"\n{wrong}'))
    assert [
        line
        for line in refused.value.mistakes
        if "drive.qqq: unknown" in line and "known here: " in line
    ]
