"""Scenes of the rig at 5 g with one contact each, as texts that studies and tests alter."""

from pathlib import Path

STUDIES = Path(__file__).parents[1]
BLOCK = """
[normal]
load = "26 lbf"
[friction]
law = "LAW"
static = 0.30
MORE
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 600
"""
LENGTH = 'bond_length = "1 um"'
YAW = (
    "[drive]",
    '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.095\n[drive]',
)
TEXTS = {
    "Coulomb": BLOCK.replace("LAW", "coulomb").replace("MORE", ""),
    "elastic-plastic": BLOCK.replace("LAW", "elastic-plastic").replace("MORE", LENGTH),
    "bonds": BLOCK.replace("LAW", "nonlocal").replace("MORE", LENGTH),
}
TEXTS["Coulomb, two modes"] = TEXTS["Coulomb"].replace(*YAW)
PATCH = (STUDIES / "integrators" / "patch.toml").read_text().partition("[accuracy]")[0]
PATCH = PATCH.replace("[contact]", '[contact]\nelement_size = "0.2 mm"', 1)
TEXTS["patch of 41 elements"] = PATCH
# scene of the patch without the yaw mode
ONE_MODE = PATCH[: PATCH.rindex("[[structure.mode]]")] + PATCH[PATCH.index("[drive]") :]
