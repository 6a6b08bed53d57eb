"""Permitted combinations, found by checking scenes: each consists of a law and the rest of a scene."""

import re
from functools import cache
from typing import NamedTuple

from patchfem.effects import LAWS
from patchfem.scene import Friction, loads
from patchfem.scene.scene import SceneError

from .keys import find_example

PATCH = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "steel"
[contact.crown]
radius = "1 m"
"""
POINT = '[normal]\nload = "26 lbf"\n'
RIG = """\
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
cycles = 20
"""
BENCH = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "143 Hz"\n'
MASSES = """\
[structure]
masses = ["1 kg", "1 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1e6 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "1e6 N/m"
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 20
"""
GROOVES = '[{}.grooves]\nwavelength = "80 um"\namplitude = "2 um"\n'
AREA = "[contact.area]\ncells = 64\n"
# Values of required keys of laws; other keys have the example of their kind, or 1
VALUES = {"chi": "-0.5", "beta": "0.5", "bond_length": '"1 um"'}
FORMS = {
    "nonlocal": {
        "nonlocal": "",
        "nonlocal, order 2": "order = 2\n",
        "nonlocal, reading 'report'": 'reading = "report"\n',
    }
}
METHODS = ("auto", "exact", "march", "harmonic")


class SceneColumn(NamedTuple):
    """Column of a table of limits: heading, text of a scene without its law, and keys set in it."""

    words: str
    text: str
    sets: tuple = ()


RIGS = (
    SceneColumn("one point", POINT + RIG),
    SceneColumn("a patch", PATCH + RIG),
    SceneColumn("`[contact.shear]`", PATCH + "[contact.shear]\n" + RIG),
    SceneColumn("`[contact.area]`", PATCH + AREA + RIG),
    SceneColumn("`[contact.area]`, `[contact.shear]`", PATCH + AREA + "[contact.shear]\n" + RIG),
    SceneColumn(
        "`[contact.area]`, a mode with yaw",
        PATCH + AREA + RIG,
        ("structure.mode.axial.yaw=2 rad/m",),
    ),
    SceneColumn("shapes on the lower piece", PATCH + RIG, ("contact.crown.on=lower",)),
    SceneColumn("changing load", POINT + RIG, ("normal.amplitude=20 N", "normal.frequency=50 Hz")),
    SceneColumn("a mode with heave or pitch", PATCH + RIG, ("structure.mode.axial.pitch=1 rad/m",)),
    SceneColumn(
        "`[contact.shear]`, a mode with pitch",
        PATCH + "[contact.shear]\n" + RIG,
        ("structure.mode.axial.pitch=1 rad/m",),
    ),
)
MORE = (
    SceneColumn("`[normal.grooves]`", POINT + GROOVES.format("normal") + RIG),
    SceneColumn(
        "`[contact.grooves]`, `[contact.shear]`",
        PATCH + GROOVES.format("contact") + "[contact.shear]\n" + RIG,
    ),
    SceneColumn("a cubic spring", POINT + RIG, ("structure.stiffening.cubic=1e10 N/m^3",)),
    SceneColumn(
        "an interlocking spring",
        POINT + RIG,
        ("structure.bonded.stiffness=1e5 N/m", "structure.bonded.wavelength=80 um"),
    ),
    SceneColumn("several interfaces", MASSES),
    SceneColumn("a patch at each interface", MASSES + "# each presses a patch\n"),
    SceneColumn(
        "a patch with shear at each interface", MASSES + "# each presses a patch that gives way\n"
    ),
    SceneColumn("`[wear]`", PATCH + RIG + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n'),
)
BENCHES = (
    SceneColumn("one point", POINT + BENCH),
    SceneColumn("a patch", PATCH + BENCH),
    SceneColumn("`[contact.shear]`", PATCH + "[contact.shear]\n" + BENCH),
    SceneColumn("`[contact.area]`", PATCH + AREA + BENCH),
    SceneColumn("shapes on the lower piece", PATCH + BENCH, ("contact.crown.on=lower",)),
    SceneColumn(
        "changing load", POINT + BENCH, ("normal.amplitude=20 N", "normal.frequency=50 Hz")
    ),
    SceneColumn("`[normal.grooves]`", POINT + GROOVES.format("normal") + BENCH),
    SceneColumn(
        "`[contact.grooves]`, `[contact.shear]`",
        PATCH + GROOVES.format("contact") + "[contact.shear]\n" + BENCH,
    ),
    SceneColumn("`[wear]`", PATCH + BENCH + '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n'),
)


def list_laws() -> dict:
    """Return {name of a form of a law: text of its table}."""
    out = {}
    for law, effect in LAWS.items():
        needs = effect.keys[0].replace("|stiffness", "").split()
        needed = "".join(
            f"{key} = {VALUES.get(key) or find_example(Friction, key)}\n" for key in needs
        )
        for name, extra in FORMS.get(law, {law: ""}).items():
            out[name] = f'law = "{law}"\nstatic = 0.3\n{needed}{extra}'
    return out


@cache
def find_refusal(keys: str, beside: SceneColumn) -> tuple:
    """Return the sentences with which a scene is refused, without their positions; () if it is valid."""
    if "masses" in beside.text:
        load = 'load = "100 N"\n'
        if "patch" in beside.text:
            load = (PATCH + "[contact.shear]\n" * ("gives" in beside.text)).replace(
                "[contact", "[structure.interface.contact"
            )
        text = beside.text + "".join(
            f"[[structure.interface]]\nbetween = [{k}, 0]\n{keys}{load}" for k in (1, 2)
        )
    else:
        text = beside.text + f"[friction]\n{keys}"
    try:
        loads(text, sets=beside.sets)
    except SceneError as error:
        return tuple(re.sub(r"^[^:]*(?::\d+)?: ", "", line) for line in error.mistakes)
    return ()
