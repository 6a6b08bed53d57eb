"""`check` refuses what no run can compute, at line and key, and remarks on keys without effect."""

from __future__ import annotations

from pathlib import Path

import pytest
from scene_texts import (
    BENCH,
    LINEAR,
    PATCH,
    RIG,
    find_line,
    get_only_mistake,
    list_mistakes,
)

from patchfem.scene import load, loads

SHEAR = "contact.shear={}"
PLASTIC = "friction.law=elastic-plastic"
LOWER = "contact.tilt.on=lower"
PATCH_BENCH = PATCH + BENCH[BENCH.index("[friction]") :]
REPORT = ["friction.law=nonlocal", "friction.bond_length=1 um", "friction.reading=report"]
STEADY = "accuracy.method=harmonic"

# (text, sets, key, what the message says)
PLAIN = [
    (
        RIG,
        ["accuracy.method=exact", PLASTIC, SHEAR, "structure.mode.second.pitch=1 rad/m"],
        "accuracy.method",
        "the motion cannot be computed from event to event with a mode's pitch",
    ),
    (
        LINEAR,
        ["drive.cycles=0.2"],
        "drive.cycles",
        "at least a quarter of a cycle: cycles >= 0.25 is needed, not 0.2",
    ),
    (
        LINEAR,
        [STEADY, "drive.kind=free", "drive.displacement=1 mm"],
        "accuracy.method",
        "finds only steady motion",
    ),
]


@pytest.mark.parametrize("text, sets, key, says", PLAIN)
def test_refuses_combination_without_meaning(text, sets, key, says):
    """A combination of keys that has no meaning is refused with its key and a remedy (others: test_support)."""
    message = get_only_mistake(text, *sets)
    assert message.startswith(f"--set: {key}: ") and says in message
    assert "not supported yet" not in message


def test_refuses_unsupported_keys_at_their_lines():
    """Unsupported keys in a file are refused at their lines."""
    text = RIG.replace(
        "[friction]", "[contact.grooves]\n[contact.area]\n[contact.shear]\n[friction]"
    )
    text = text.replace(
        "[contact.grooves]", '[contact.grooves]\nwavelength = "80 um"\namplitude = "0 um"'
    )
    text += '[accuracy]\nmethod = "exact"\n'
    assert list_mistakes(text) == [
        f"a.toml:{find_line(text, '[contact.grooves]')}: contact.grooves: cannot be used beside [contact.area], whose faces "
        "are flat along the slide: leave one of the two out",
        f"a.toml:{find_line(text, 'method')}: accuracy.method: the motion cannot be computed from event to event for "
        "law 'nonlocal' with [contact.shear]; use 'march' or leave `method` out",
    ]


def test_refuses_rig_without_sliding_mode():
    """A rig with friction whose modes all have slide = 0 is refused."""
    text = RIG.replace("slide = 0.8", "slide = 0.0").replace("slide = 0.1", "slide = 0.0")
    message = get_only_mistake(text)
    assert message.startswith(
        f"a.toml:{find_line(text, 'slide')}: structure.mode.axial.slide: `slide` is 0 in every mode"
    )
    assert loads(RIG, sets=["structure.mode.axial.slide=0"]).structure.mode[1].slide == 0.1
    assert loads(text[text.index("[structure]") :]).kind == "linear"


def test_refuses_a_duration_below_a_quarter_of_a_cycle():
    """A duration below a quarter of a cycle is refused with the smallest duration."""
    text = LINEAR.replace("cycles = 200", 'duration = "1 ms"')
    assert (
        f"a.toml:{find_line(text, 'duration')}: drive.duration: the run must last at least a"
        in get_only_mistake(text)
    )
    assert get_only_mistake(text).endswith("duration >= 0.00174825 s is needed, not 0.001 s")
    assert loads(text, sets=["drive.duration=1.75 ms"]).drive.duration == 1.75e-3
    assert loads(LINEAR, sets=["drive.cycles=0.25"]).drive.cycles == 0.25


ALLOWED = [
    (PATCH_BENCH, [LOWER], "bench"),
    (PATCH_BENCH, [LOWER, *REPORT, "friction.order=-0.5"], "bench"),
    (PATCH_BENCH, [LOWER, SHEAR, *REPORT], "bench"),
    (RIG, ["friction.reading=report", "structure.mode.second.pitch=1 rad/m", SHEAR], "rig"),
    (RIG, ["friction.static=0"], "rig"),
    (
        RIG,
        [SHEAR, "friction.kinetic=0.2", "friction.rest_growth=1 g", "friction.slip_growth=1 um"],
        "rig",
    ),
    (LINEAR, ["accuracy.method=exact"], "linear"),
    (RIG, ["accuracy.method=exact"], "rig"),
    (RIG, ["accuracy.method=exact", PLASTIC, "structure.stiffening.cubic=1e12 N/m^3"], "rig"),
]


@pytest.mark.parametrize("text, sets, kind", ALLOWED)
def test_exact_supported_combinations_are_accepted(text, sets, kind):
    """Supported combinations of keys are accepted."""
    assert loads(text, sets=sets).kind == kind


@pytest.mark.parametrize(
    "text, sets, remark",
    [
        (PATCH, ["accuracy.method=exact"], "accuracy.method = 'exact' has no meaning in a patch scene and is not used"),
        (BENCH, ["accuracy.method=march"], "accuracy.method = 'march' has no meaning in a bench scene and is not used"),
        (RIG, ["friction.kinetic=0.2"], "friction.kinetic has no effect while the bond length is constant; "
                                        "add rest_growth and slip_growth"),
        (PATCH, ["contact.mesh=a.msh", "contact.element_size=100 um"],
         "contact.element_size is not used, because the file of contact.mesh gives the elements"),
    ],
)  # fmt: skip
def test_exact_remarks_on_keys_without_effect(text, sets, remark):
    """A key without effect gives a remark, and the resolved scene omits the key."""
    scene = loads(text, sets=sets)
    assert scene.remarks == [remark]
    assert loads(scene.resolved()).remarks == []
    assert loads(scene.resolved()).tables() == scene.tables()


STUDIES = sorted((Path(__file__).parents[2] / "studies").rglob("*.toml"))


@pytest.mark.parametrize("path", STUDIES, ids=lambda path: path.stem)
def test_exact_study_scenes_load_without_remarks(path):
    """Every scene of the studies loads without remarks."""
    assert load(path).remarks == []
