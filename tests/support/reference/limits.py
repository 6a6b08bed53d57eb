"""The page of limits: what stands together, how large and how many, what the model leaves out."""

import re
from importlib import import_module

from patchfem.runs.patch.result import COUPLED, SMALL
from patchfem.scene.keys.types import DIVIDED_BY, LARGEST

from .keys import FOLDER, bounds, grid
from .tried import BENCHES, METHODS, MORE, POINT, RIG, RIGS, Beside, across, laws, refused

FILE = FOLDER / "LIMITS.md"
HEAD = """\
# Limits

`python tests/support/reference` generates this page by checking one scene for each entry of the tables. A scene marked
"no" is rejected before the run, with the line, the key and an alternative. The numbers refer to the list of messages
below the tables. The last section lists what the models neglect.
"""
SIZES = {  # constant -> what it bounds and how it is written
    "scene.scene.LARGEST": "bytes of a scene", "scene.lines.DEEPEST": "parts of a dotted key",
    "scene.rules.contact.MOST_ELEMENTS": "elements along an interface with element_size",
    "scene.keys.tables.MOST_MASSES": "masses in structure.masses",
    "effects.MOST_COORDINATES": "masses or modes of a rig",
    "scene.axes.MOST": "values of one range of a sweep", "campaigns.sweeps.ask.MOST": "cases of a sweep",
    "inputs.cells.LARGEST": "bytes of a table of text", "inputs.records.LARGEST": "bytes of a laboratory file",
    "inputs.matlab.LARGEST_FILE": "bytes of a .mat file",
    "inputs.matlab5.LARGEST": "numbers of a variable of a .mat file", "mesh.files.LARGEST": "bytes of a mesh",
    "surface.files.raw.LARGEST": "bytes of a scan, compressed or not",
    "surface.samples.LONGEST": "length of a trace [m]",
    "model.slide.MOST": "steps per cycle of a prescribed slide",
    "runs.rig.costs.MOST_STEPS": "steps per cycle of a time integration, if the tolerance chooses them",
    "dynamics.march.capacity.MOST_STRIPS": "strips of a list of bonds",
    "friction.bonds.parameters.LONGEST": "estimated seconds for a list of bonds",
    "runs.rig.costs.LONGEST": "estimated seconds for a motion from event to event",
    "dynamics.comparison.comparison.MOST_NUMBERS": "numbers stored by a comparison method",
    "dynamics.resume.MOST_KEPT": "samples stored before the last cycles; longer records are thinned"}
LEFT_OUT = f"""\
**Two dimensions.** The pieces are sections in plane strain, or in plane stress with `contact.plane`. A note of every
patch gives the difference between the two. Effects at the edges of the width are neglected. `[contact.strips]` are
sections side by side without elastic coupling.

**Small strains, linear elasticity.** The pieces are isotropic, without plasticity, creep or heat. The coating is
bonded, and the far faces are fixed to rigid holders. A note appears if strains exceed {SMALL:g}. The load is assumed
not to move sideways when a tall piece bends; a note says if this matters.

**No friction in the static patch.** The pressure is computed without shear. If both pieces have the same elastic
constants, shear does not change the pressure. For different materials the coupling of shear and pressure is neglected
in runs that move; a note appears if it exceeds {100 * COUPLED:g} % of the compliance.

**Quasi-static pieces.** The pieces have no mass, so waves in them are left out. The modes of the rig carry the inertia.

**Pressure fixed to a piece.** The pressure moves with the piece that carries the shape. When the other piece slides
beyond the pressed length, its overhang is not modelled. A slide beyond the patch ends the run as `leaves_contact`.

**Grooves.** The surfaces stay in contact on the flanks. If the inertia of a lifted mass takes up the whole load, the
run ends as `leaves_grooves`. The upper piece rides up matched grooves as a whole, not ridge by ridge.

**Friction is local.** The friction of a point depends on the pressure and the slip of that point. Only law
`convolution` averages over neighbouring points (Oden-Pires). Bonds depend on the path of their point, that is, on the
length that this point has slid so far. Temperature acts only through eq. 2.13, with a surface temperature given in the
scene. Heat from friction does not change that temperature.

**Partial slip.** At constant load and tilt the elements are exact for pieces of equal elasticity. Under a changing load
the shear compliance is represented by modes, whose number follows from the tolerance. For pieces of unlike sections the
effect of shear on the pressure is neglected. A patch of `[[structure.interface]]` keeps its load and pressure and does
not wear. If friction falls as a point slides on (bonds that weaken, equation 2.17 as printed), several states can be in
equilibrium. The run then continues in the direction of its last steps, with the state of lower energy there. The energy
difference counts as dissipated.

**Modes.** The rig is linear except for its joints, `[structure.stiffening]` and an interlocking bonded spring. Damping
is viscous; hysteretic damping in a file is treated as viscous. A complex mode is replaced by its real part.

**Wear.** Every point wears by Archard's law with its own pressure and slip. Debris and heat are left out. Friction
changes only through the table `[wear.friction]`, for the patch as a whole. Between two jumps of the wear, a rig is
assumed to repeat its last cycle. Strips that yaw slide and wear along x only; a note says how far the ends of the patch
move across x.

**Errors.** Stated errors are estimates from coarser runs. The true numerical error is smaller than the stated error in
about 19 of 20 scenes. Stated errors do not include what the model neglects. A step in the gap makes the pressure peak
infinite, so that any number for it would depend on the mesh.

**Harmonic balance, Duhamel, Newmark, Euler.** These methods serve for comparison. Harmonic balance finds only periodic
motions. The other three support one force per interface and linear modes.
"""


def text() -> str:
    """The whole page of patchfem/scene/LIMITS.md: scenes are put together and checked, nothing is run."""
    notes = {}
    body = []
    for title, columns in (("Laws in a rig", RIGS), ("Laws in a rig, further", MORE), ("Laws on a bench", BENCHES)):
        body += [f"## {title}", _against(columns, notes)]
    body += ["A prescribed slide can have two directions with "
             + _listed(name for name, one in laws().items() if not across(one))
             + ", but not with " + _listed(name for name, one in laws().items() if across(one)) + ".",
             "## Methods", "In this table the scene is a single point under a sine drive, with `accuracy.method` set; "
             "`auto` chooses an available method.",
             _methods(notes), "### Messages", _said(notes),
             "## Numbers",
             f"A number with a unit is at most {LARGEST:g} in SI. A quantity that occurs as a divisor ("
             + ", ".join(sorted(DIVIDED_BY)) + f") is at least {1 / LARGEST:g}; such a quantity may be 0 only where 0 "
                                               "has a meaning. Whole numbers and shares have "
                                               "their own bounds:", _bounds(), "## Sizes", _sizes(),
             "A run is refused if its memory, as `patchfem plan` estimates it, exceeds the limit of the process. The "
             "message names the key that causes it.", "## What the models leave out",
             LEFT_OUT.strip()]
    return "\n\n".join([HEAD.strip(), *body]) + "\n"


def _against(columns: tuple, notes: dict) -> str:
    rows = [(name, *(_cell(refused(keys_of, one), notes, name) for one in columns))
            for name, keys_of in laws().items()]
    return grid(("law", *(one.words for one in columns)), rows)


def _methods(notes: dict) -> str:
    one = Beside("", POINT + RIG)
    return grid(("law", *(f"`{method}`" for method in METHODS)),
                [(name, *(_cell(refused(keys_of, one, method), notes, name) for method in METHODS))
                 for name, keys_of in laws().items()])


def _cell(sentences: tuple, notes: dict, law: str) -> str:
    """yes, or the numbers of the sentences with which it is refused."""
    if not sentences:
        return "yes"
    return "no " + " ".join(str(notes.setdefault(_plain(one, law), len(notes) + 1)) for one in sentences)


def _plain(sentence: str, law: str) -> str:
    """A sentence without the name of the law that was tried."""
    form = rf"(?:law )?'{law.partition(',')[0]}'(?: of (?:order [\d.]+|reading '\w+'))?(?=[ :;,]|$)"
    return re.sub(form, "the law (of the table row)", sentence, count=1)


def _said(notes: dict) -> str:
    return "\n".join(f"{number}. {sentence}" for sentence, number in notes.items())


def _listed(names) -> str:
    return "; ".join(f"*{name}*" for name in names) or "none"


def _bounds() -> str:
    return grid(("key", "permitted values"), [(f"`{key}`", said) for key, said in bounds()])


def _sizes() -> str:
    rows = []
    for name, words in SIZES.items():
        module, _, constant = name.rpartition(".")
        value = getattr(import_module(f"patchfem.{module}"), constant)
        shown = f"{value / 2**20:.4g} MiB" if words.startswith("bytes") else f"{value:,.0f}".replace(",", " ")
        rows.append((words.removeprefix("bytes of "), shown))
    return grid(("quantity", "largest value"), rows)
