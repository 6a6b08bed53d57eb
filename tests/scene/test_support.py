"""Each row of the table of unsupported combinations refuses a scene that has its features."""

from __future__ import annotations

import re

import pytest
from scene_texts import BENCH, FORCED, LINEAR, PAIR, RIG

from patchfem.scene import loads
from patchfem.scene.rules import support
from patchfem.scene.scene import SceneError

POINT_RIG = BENCH[: BENCH.index("[slide]")] + LINEAR
BONDS = "{law}.law=nonlocal {law}.bond_length=1_um"
INTERLOCKING = "structure.bonded.stiffness=1e5_N/m structure.bonded.wavelength=80_um"
EXPONENTIAL = "{patch}.asperities.law=exponential {patch}.asperities.decay_length=1_um"
HERTZ = (
    "{patch}.asperities.law=hertz {patch}.asperities.radius=1_um {patch}.asperities.density=1e10_1/m^2 "
    "{patch}.asperities.height_deviation=1_um"
)
GROOVES = "{load}.grooves.wavelength=80_um {load}.grooves.amplitude=1_um"
OWN_PATCH = "{patch}.length=10_mm {patch}.width=10_mm {patch}.height=5_mm {patch}.load=60_N {patch}.substrate=steel"
WEAR = "wear.coefficient=1e-14_m^2/N wear.cycles=1000"
# Assignments that give a scene a feature, separated by blanks; _ stands for the blank in a quantity.
SETS = {
    "bonds that no force can move": f"{BONDS} {{law}}.reading=report {{law}}.order=-0.5",
    "changing load": "{change}",
    "changing load or grooves": "{change}",
    "drive other than a sine": "drive.waveform=step",
    "grooves": GROOVES,
    "pressure in motion or of an interface": "structure.mode.second.pitch=1_rad/m",
    "interface": "",
    "kinetic below static": "{law}.law=coulomb {law}.kinetic=0.2",
    "joint without a single stiffness": "{change}",
    "nonlinear asperities": EXPONENTIAL,
    "output that bounds the motion": "structure.travel=1_mm",
    "mode with heave or pitch": "structure.mode.second.pitch=1_rad/m",
    "normal.amplitude": "normal.amplitude=5_N normal.frequency=50_Hz",
    "partial slip": "{patch}.shear={{}}",
    "patch.grooves": "{patch}.grooves.wavelength=80_um {patch}.grooves.amplitude=1_um",
    "patch.area": "{patch}.area.cells=64",
    "sensor apart from the output": "structure.mode.second.gauge=0.3",
    "shape on the lower piece": (
        "{patch}.tilt.angle=0.1_mrad {patch}.tilt.on=lower"
    ),
    "shapes on different pieces": (
        "{patch}.tilt.angle=0.1_mrad {patch}.crown.radius=1_m {patch}.crown.on=lower"
    ),
    "mode that turns or lifts a joint without places": "structure.mode.second.yaw=1_rad/m",
    "structure.measured=stuck": "structure.measured=stuck",
    "wear": WEAR,
}  # fmt: skip
# Property of a joint in a message, after re.escape
PROPERTY = re.compile(r"\\\{.*?\}")
REDUCED = POINT_RIG[: POINT_RIG.index("[structure]")] + (
    '[structure.reduced]\nstiffness = "k.mtx"\nmass = "m.mtx"\nboundary = [1, 2]\nslide = [1, 0]\n'
    + LINEAR[LINEAR.index("[drive]") :]
)
MASS_FEATURES = {"interface"}


FILE = """\
[structure]
file = "a.npz"
[[structure.interface]]
between = [1, 0]
law = "coulomb"
static = 0.3
"""


def write_blanks(assignment: str) -> str:
    """Return an assignment with blanks in its value."""
    key, _, value = assignment.partition("=")
    return f"{key}={value.replace('_', ' ')}"


def choose_base(features: set[str]) -> tuple[str, dict[str, str]]:
    """Return a scene for some features, and the keys of its law, its load, its patch and a changing load."""
    words = {"law": "friction", "load": "contact", "patch": "contact"}
    words["change"] = SETS["mode with heave or pitch"]
    if features & MASS_FEATURES:
        law = "structure.interface.0"
        return PAIR + FORCED, words | {"law": law, "patch": f"{law}.contact"}
    return RIG, words


def list_refusals(names: str) -> list[str]:
    """Return the messages about combinations that no run supports, for a scene with the features of a row."""
    features = names.split(", ")
    text, words = choose_base(set(features))
    sets = " ".join(SETS.get(name, "") for name in features).format_map(words).split()
    try:
        loads(text, "a.toml", [write_blanks(assignment) for assignment in sets])
    except SceneError as refused:
        return [message for message in refused.mistakes if "not supported yet" in message]
    return []


@pytest.mark.parametrize(
    "names, instead",
    support.UNSUPPORTED_COMBINATIONS,
    ids=[row[0] for row in support.UNSUPPORTED_COMBINATIONS],
)
def test_refuses_each_row_of_support(names, instead):
    """A scene with the features of a row is refused for this row alone, with its advice.

    Properties of the scene are free in the message.
    """
    (found,) = list_refusals(names)
    pattern = PROPERTY.sub("((?! and ).)+", re.escape(support.describe_row(names, instead)))
    assert re.fullmatch(pattern, found.split(": ", 2)[2]), found
    assert " with is " not in found and not found.endswith("; ")


WITH_PATCH = FILE + FORCED, OWN_PATCH.format(patch="structure.interface.0.contact")
STUCK = "structure.measured: 'stuck' with "
CAUSES = [
    (PAIR.split("[[structure.interface]]")[0] + FORCED, "structure.measured=stuck", STUCK + "structure.masses"),
    (REDUCED, "structure.measured=stuck", STUCK + "structure.reduced"),
    (WITH_PATCH[0], f"structure.measured=stuck {WITH_PATCH[1]}", STUCK + "[structure.interface.contact]"),
    (RIG, f"structure.measured=stuck {INTERLOCKING}", STUCK + "structure.bonded.wavelength"),
    (RIG, f"structure.measured=stuck {GROOVES.format(load='contact')}", STUCK + "contact.grooves"),
    (POINT_RIG, f"structure.measured=stuck {GROOVES.format(load='normal')}", STUCK + "normal.grooves"),
    (POINT_RIG, f"structure.measured=stuck {SETS['normal.amplitude']}", STUCK + "normal.amplitude"),
    (RIG, "structure.measured=stuck structure.mode.second.yaw=1_rad/m contact.area.cells=64",
     STUCK + "structure.mode[2].yaw"),
    (RIG, "structure.mode.second.gauge=0.3 structure.stiffening.cubic=1e10_N/m^3", "with structure.stiffening; give"),
    (RIG, "structure.mode.second.gauge=0.3 drive.kind=free drive.displacement=1_mm", "with drive.kind = 'free'; give"),
    (RIG, "structure.mode.second.gauge=0.3 drive.waveform=levels drive.levels=['1_g','2_g']",
     "with drive.waveform = 'levels'; give"),
    (POINT_RIG, SETS["mode with heave or pitch"], "a joint without places is not supported yet"),
    (RIG, f"{HERTZ.format(patch='contact')} {GROOVES.format(load='contact')} contact.tilt.angle=0.1_mrad "
     "contact.tilt.on=lower", "a shape on the lower piece with [contact.grooves]"),
    (RIG, f"{WEAR} drive.kind=free drive.displacement=1_mm", "use waveform 'sine' with kind 'base' or 'force'"),
    (RIG, f"{HERTZ.format(patch='contact')} {SETS['mode with heave or pitch']}", "'hertz' with a mode's pitch"),
]  # fmt: skip


@pytest.mark.parametrize("text, changes, words", CAUSES)
def test_refuses_each_cause_of_a_feature(text, changes, words):
    """A feature of a row that several keys cause is found for each of them, and the message names the key."""
    with pytest.raises(SceneError) as refused:
        loads(text, "a.toml", [write_blanks(change) for change in changes.split()])
    assert any(words in message for message in refused.value.mistakes), refused.value.mistakes
