"""Blocks of scenes, small scenes made of them, and the mistakes in a scene, for all tests."""

from __future__ import annotations

import pytest

from patchfem.scene import loads
from patchfem.scene.scene import SceneError

# Keys that a law requires in addition to its static friction.
KEYS = {
    "coulomb": "",
    "elastic-plastic": 'bond_length = "1 um"',
    "nonlocal": 'bond_length = "1 um"',
    "tanh": 'reference_speed = "1 mm/s"',
    "iwan": 'stiffness = "1e7 N/m"\nchi = -0.5\nbeta = 0.5',
    "bouc-wen": 'stiffness = "1e7 N/m"',
    "lugre": 'stiffness = "1e7 N/m"\nstribeck_speed = "1 mm/s"',
}


def make_friction_table(law: str) -> str:
    """Return the table of a friction law with a limit of 0.3 times the load."""
    return f'[friction]\nlaw = "{law}"\nstatic = 0.3\n' + (KEYS[law] + "\n" if KEYS[law] else "")


# Blocks of scenes; a scene is a sum of them.
POINT = '[normal]\nload = "26 lbf"\n'
PIECE = '[contact]\nlength = "12.7 mm"\nwidth = "12.7 mm"\nheight = "6.35 mm"\n'
BLOCK = PIECE.replace("6.35 mm", "6 mm") + 'load = "115 N"\nsubstrate = "Ti-8Al-1Mo-1V"\n'
COATING = '[contact.coating]\nmaterial = "WC-Co"\nthickness = "6 mil"\n'
COATED = PIECE + 'load = "26 lbf"\nelement_size = "0.5 mm"\nsubstrate = "Ti-8Al-1Mo-1V"\n' + COATING
SHEAR = "[contact.shear]\n"
GROOVES = 'grooves = {wavelength = "80 um", amplitude = "7.5 um"}\n'
COULOMB, PLASTIC, NONLOCAL = map(make_friction_table, ("coulomb", "elastic-plastic", "nonlocal"))
GROOVED = '[normal]\nload = "115 N"\n' + GROOVES + COULOMB.replace("0.3", "0.4")
GROWING = """\
[friction]
law = "nonlocal"
static = 0.6
kinetic = 0.42
bond_length = "2 um"
rest_growth = "10 m/s^2"
slip_growth = "0.2 um"
"""
SLIDE = '[slide]\nkind = "triangle"\namplitude = "10 um"\nspeed = "5 mm/s"\n'
TRIANGLE = SLIDE + "cycles = 2\n"
MODE = """\
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
"""
KILOGRAM = MODE.replace("0.884 kg", "1 kg")
DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 30\n'
# The mode with much damping under three cycles of the drive.
THREE_CYCLES = MODE.replace("0.003", "0.02") + DRIVE.replace("30", "3")

# Keys for `make_shaken_block`.
IWAN = 'law = "iwan"\nchi = -0.5\nbeta = 0.5\nstiffness = "20 kN/m"'


def make_shaken_block(law: str, acceleration: str = "1 g", cycles: int = 20) -> str:
    """Return a scene of a block of 0.5 kg and 100 Hz under 100 N, driven at its resonance.

    law: lines with the keys of its friction.
    """
    return f"""\
[normal]
load = "100 N"
[friction]
{law}
static = 0.3
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "100 Hz"
damping = 0.002
slide = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "{acceleration}"
cycles = {cycles}
"""


# Two masses, with elastic-plastic interfaces between the first and the base and between both.
PAIR = """\
[structure]
masses = ["1 kg", "0.7 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "4e5 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "2e5 N/m"
[[structure.damper]]
between = [2, 0]
coefficient = "40 N s/m"
[[structure.interface]]
between = [1, 0]
law = "elastic-plastic"
static = 0.3
bond_length = "5 um"
load = "60 N"
[[structure.interface]]
between = [2, 1]
law = "elastic-plastic"
static = 0.2
bond_length = "20 um"
load = "40 N"
"""
# A mode of 195 Hz whose elastic-plastic joint begins to slip at a slide of 60 um.
ELASTIC_JOINT = """\
[normal]
load = "40 N"
[friction]
law = "elastic-plastic"
static = 0.3
stiffness = "2e5 N/m"
[structure]
moving_mass = "1.3 kg"
[[structure.mode]]
name = "bending"
frequency = "195 Hz"
damping = "0.2 %"
slide = 1.0
"""
FORCED = '[drive]\nkind = "force"\nmass = 2\nforce = "30 N"\nfrequency = "90 Hz"\ncycles = 25\n'
SWEEP = (
    '[drive]\nkind = "base"\nwaveform = "sweep"\nacceleration = "3 g"\nfrom = "120 Hz"\nto = "150 Hz"\n'
    'rate = "80 Hz/s"\n'
)

# A bolted joint that does not slip, and the block that shakes it.
JOINT = """\
[contact]
length = "20 mm"
width = "20 mm"
height = "6 mm"
load = "2 kN"
substrate = "steel"
[contact.shear]
[friction]
law = "coulomb"
static = 0.2
kinetic = 0.2
"""
JOINT_SHAKEN = (
    JOINT
    + """\
[structure]
moving_mass = "0.5 kg"
[[structure.mode]]
name = "axial"
frequency = "200 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
frequency = "120 Hz"
acceleration = "20 g"
cycles = 20
"""
)

# A joint that slips from its edges.
CROWNED_JOINT = """\
[contact]
length = "40 mm"
width = "30 mm"
height = "15 mm"
load = "8 kN"
substrate = "steel"
[contact.crown]
radius = "5 m"
[contact.shear]
[friction]
law = "coulomb"
static = 0.2
"""

CROWNED_BENCH = (
    COATED
    + """\
[contact.crown]
radius = "80 m"
[contact.shear]
"""
    + COULOMB
    + """\
[slide]
kind = "triangle"
amplitude = "0.4 um"
speed = "0.2 mm/s"
[accuracy]
steps_per_cycle = 40
"""
)

# Complete scenes.
BENCH = POINT + COULOMB + SLIDE
SMALL_PATCH = 'title = "a small patch"\n' + COATED + '[contact.tilt]\nangle = "0.02 mrad"\n'
STRUCTURE = MODE + DRIVE
SHORT = STRUCTURE.replace("cycles = 30", "cycles = 20")
SECOND = '[[structure.mode]]\nname = "second"\nfrequency = "990 Hz"\ndamping = 0.01\nslide = 0.1\n'
RIG = "".join(
    [
        'title = "143 Hz, 5 g"\n',
        COATED.replace('element_size = "0.5 mm"\n', ""),
        '[contact.tilt]\nangle = "0.1 mrad"\n',
        NONLOCAL,
        MODE.replace("slide = 1.0", "slide = 0.8\noutput = 0.8"),
        SECOND,
        DRIVE.replace("cycles = 30", "cycles = 200"),
    ]
)
LINEAR = RIG[RIG.index("[structure]") :]
PATCH = RIG[RIG.index("[contact]") : RIG.index("[friction]")]


def find_line(text: str, start: str) -> int:
    """Return the number of the first line that begins with a text."""
    return next(n for n, line in enumerate(text.splitlines(), 1) if line.startswith(start))


def list_mistakes(text: str, *sets: str) -> list[str]:
    """Return the mistakes of a scene, which must be refused."""
    with pytest.raises(SceneError) as caught:
        loads(text, "a.toml", sets)
    assert str(caught.value) == "\n".join(caught.value.mistakes)
    return caught.value.mistakes


def get_only_mistake(text: str, *sets: str) -> str:
    """Return the only mistake of a scene."""
    messages = list_mistakes(text, *sets)
    assert len(messages) == 1, messages
    return messages[0]


FULL = [
    "contact.tilt.on=upper", "contact.crown.radius=1 m", "contact.crown.on=upper", "contact.mesh=a \"b\" \\ é.msh",
    "contact.element_size=100 um", "contact.plane=stress", "contact.pairs=2", "contact.shear={}",
    "friction.rest_growth=10 m/s^2", "friction.slip_growth=0.2 um", "friction.rest_speed=10 um/s",
    "friction.initial_bonds=0.5", "friction.kinetic=0.25", "structure.travel=5 mm", "structure.mode.second.base=-0.2",
    "accuracy.tail=1e-6", "accuracy.merge=1e-5", "accuracy.shear_modes=12", "accuracy.steps_per_cycle=400",
    'contact.substrate={young = "121.3 GPa", poisson = 0.31, density = "4370 kg/m^3"}',
    'measured={file = "t.csv", acceleration_gain = 1.1, displacement_gain = 0.9}',
]  # fmt: skip
