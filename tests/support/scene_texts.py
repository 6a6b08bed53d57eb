"""Small scenes that the tests of reading, refusing and planning share."""

from __future__ import annotations

import pytest

from patchfem.scene.scene import SceneError, loads

RIG = """\
title = "143 Hz, 5 g"
[contact]
length = "12.7 mm"
width  = "12.7 mm"
height = "6.35 mm"
load   = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.coating]
material = "WC-Co"
thickness = "6 mil"
[contact.tilt]
angle = "0.1 mrad"
[friction]
law = "nonlocal"
static = 0.30
bond_length = "1 um"
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 0.8
[[structure.mode]]
name = "second"
frequency = "990 Hz"
damping = 0.01
slide = 0.1
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 200
"""
POINT = '[normal]\nload = "26 lbf"\n'
COULOMB = '[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
SLIDE = '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"\n'
TRIANGLE = SLIDE + "cycles = 2\n"
BENCH = POINT + COULOMB + SLIDE
STRUCTURE = """\
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
cycles = 30
"""
SHORT = STRUCTURE.replace("cycles = 30", "cycles = 20")
GROWING = """\
[friction]
law = "nonlocal"
static = 0.6
kinetic = 0.42
bond_length = "2 um"
rest_growth = "10 m/s^2"
slip_growth = "0.2 um"
"""
SMALL_PATCH = """\
title = "a small patch"
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
element_size = "0.5 mm"
substrate = "Ti-8Al-1Mo-1V"
[contact.coating]
material = "WC-Co"
thickness = "6 mil"
[contact.tilt]
angle = "0.02 mrad"
"""
SHEAR = "[contact.shear]\n"
LINEAR = RIG[RIG.index("[structure]") :]
PATCH = RIG[RIG.index("[contact]") : RIG.index("[friction]")]


def line_of(text: str, start: str) -> int:
    return next(n for n, line in enumerate(text.splitlines(), 1) if line.startswith(start))


def mistakes(text: str, *sets: str) -> list[str]:
    with pytest.raises(SceneError) as caught:
        loads(text, "a.toml", sets)
    assert str(caught.value) == "\n".join(caught.value.mistakes)
    return caught.value.mistakes


def only(text: str, *sets: str) -> str:
    found = mistakes(text, *sets)
    assert len(found) == 1, found
    return found[0]


FULL = [
    "contact.tilt.on=upper", "contact.crown.radius=1 m", "contact.crown.on=upper", "contact.mesh=a \"b\" \\ é.msh",
    "contact.element_size=100 um", "contact.plane=stress", "contact.pairs=2", "contact.shear={}",
    "friction.rest_growth=10 m/s^2", "friction.slip_growth=0.2 um", "friction.rest_speed=10 um/s",
    "friction.initial_bonds=0.5", "friction.kinetic=0.25", "structure.travel=5 mm", "structure.mode.second.base=-0.2",
    "accuracy.tail=1e-6", "accuracy.merge=1e-5", "accuracy.shear_modes=12", "accuracy.steps_per_cycle=400",
    'contact.substrate={young = "121.3 GPa", poisson = 0.31, density = "4370 kg/m^3"}',
    'measured={file = "t.csv", acceleration_gain = 1.1}',
]  # fmt: skip
