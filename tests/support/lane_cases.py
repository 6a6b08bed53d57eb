"""Random cases of sweeps that are integrated together, in lanes, against single runs.

The uncertainty of a single run is its stated error, so a row holds if the two results agree within
the sum of both errors.
"""

import numpy as np
from campaigns import Row, strip_number
from scene_texts import MODE

import patchfem as pf
from patchfem.api import get_base_scene
from patchfem.response import TABLE as MOTION
from patchfem.runs import TABLE as STATIC
from patchfem.runs.batch.lumped import lane_ringing, lanes
from patchfem.scene import format_assignments

SCENE = (
    '[normal]\nload = "30 N"\n[friction]\n{law}\n'
    + MODE
    + '[drive]\nkind = "base"\nacceleration = "5 g"\nfrequency = "140 Hz"\ncycles = 60\n'
)
LAWS = {
    "coulomb": 'law = "coulomb"\nstatic = 0.3',
    "weakening": 'law = "coulomb"\nstatic = 0.3\nkinetic = 0.2',
    "elastic-plastic": 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"',
    "tanh": 'law = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"',
    "iwan": 'law = "iwan"\nstatic = 0.3\nstiffness = "1e6 N/m"\nchi = -0.5\nbeta = 0.5',
    "nonlocal": 'law = "nonlocal"\nstatic = 0.3\nbond_length = "10 um"',
    "bouc-wen": 'law = "bouc-wen"\nstatic = 0.3\nstiffness = "1e6 N/m"',
    "lugre": 'law = "lugre"\nstatic = 0.3\nstiffness = "1e6 N/m"\nstribeck_speed = "1 mm/s"',
}
FLOORS = {name: row.floor for table in (STATIC, MOTION) for name, row in table.items()}
PATCH = """[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.1 mrad"
[contact.shear]
[friction]
law = "coulomb"
static = 0.30
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
cycles = 200
[accuracy]
tolerance = 1e-3
"""
# Keys that vary in a sweep of rigs with a patch -> function that draws a value in SI units.
FAMILIES = {
    "tilt x friction": {
        "contact.tilt.angle": lambda r: 10 ** r.uniform(-6, -3.3),
        "friction.static": lambda r: r.uniform(0.1, 0.6),
    },
    "amplitude x friction": {
        "drive.acceleration": lambda r: 10 ** r.uniform(0, 2.3),
        "friction.static": lambda r: r.uniform(0.1, 0.6),
    },
    "frequency x load": {
        "drive.frequency": lambda r: r.uniform(100, 200),
        "contact.load": lambda r: 10 ** r.uniform(1.3, 2.5),
    },
}


def draw_points(law: str, seed: int, count: int) -> list:
    """Draw models of a law that lanes can integrate.

    They range from permanent sliding to sticking, near resonance and away from it.
    """
    r = np.random.default_rng(seed)
    base = get_base_scene(pf.load(SCENE.format(law=LAWS[law])))
    out = []
    while len(out) < count:
        push = 10 ** r.uniform(0.3, 2)
        sets = {
            "normal.load": push * 10 ** r.uniform(-1, 0.5),
            "drive.frequency": r.uniform(50, 400),
            "structure.mode.axial.damping": 10 ** r.uniform(-2.5, -0.5),
            "drive.acceleration": push,
            "structure.mode.axial.slide": float(r.choice([1, -0.7])),
            "structure.mode.axial.output": float(r.choice([1, -1.3])),
        }
        sets |= draw_law_keys(
            law, r, sets["normal.load"], push / (2 * np.pi * sets["drive.frequency"])
        )
        model = pf.build(base.override(format_assignments(sets)))
        if not lanes.refusal_reason(model):
            out.append(model)
    return out


def draw_patches(family: str, seed: int, count: int) -> list:
    """Draw models of a family of rigs with a patch."""
    r = np.random.default_rng(seed)
    base = get_base_scene(pf.load(PATCH))
    sets = [{key: float(draw(r)) for key, draw in FAMILIES[family].items()} for _ in range(count)]
    return [pf.build(base.override(format_assignments(values))) for values in sets]


def draw_law_keys(law: str, r, load: float, speed: float) -> dict:
    """Draw the keys of a law for a load [N] and a typical speed [m/s]."""
    if law == "iwan":
        return {
            "friction.stiffness": 0.3 * load * 10 ** r.uniform(4.3, 5.5),
            "friction.chi": r.uniform(-0.9, 0),
            "friction.beta": float(r.choice([0, 0.3, 3])),
        }
    length = 10 ** r.uniform(-5.5, -4.3)
    if law in ("elastic-plastic", "nonlocal"):
        return {"friction.bond_length": length}
    if law == "tanh":
        return {"friction.reference_speed": speed * 10 ** r.uniform(-2.3, 0)}
    if law == "bouc-wen":
        return {
            "friction.stiffness": 0.3 * load / length,
            "friction.exponent": float(r.choice([1, 1.5, 2, 4])),
            "friction.shape": r.uniform(0.5, 1),
        }
    if law == "lugre":
        stribeck = speed * 10 ** r.uniform(-1.5, 0)
        return {
            "friction.stiffness": 0.3 * load / length,
            "friction.stribeck_speed": stribeck,
            "friction.kinetic": r.uniform(0.15, 0.3),
            "friction.micro_damping": float(r.choice([0, 1])) * 0.1 * load / speed,
            "friction.viscous": float(r.choice([0, 1])) * 0.02 * load / speed,
        }
    return {}


def compare_answers(sweep_answers, singles) -> list[list]:
    """Return the rows of each case of two Answers: values and errors of the first beside those of the second.

    A value that only one of them has is NaN in the other and does not hold. A ringing measure that
    the second lacks is left out: a single run has none if the law has more cells that yield than
    the run has samples.
    """
    out = []
    for case in range(len(sweep_answers)):
        names = {name for name in sweep_answers.values if sweep_answers.has(name, case)}
        names |= {name for name in singles.values if singles.has(name, case)}
        case_rows = []
        for name in sorted(names):
            value, truth = (
                float(answers.values[name][case]) if name in answers.values else np.nan
                for answers in (sweep_answers, singles)
            )
            error, doubt = (
                float(answers.errors[name][case]) if name in answers.errors else np.nan
                for answers in (sweep_answers, singles)
            )
            if np.isnan(truth) and (np.isnan(value) or name in lane_ringing.RINGING_MEASURES):
                continue
            error, doubt = np.nan_to_num([error, doubt]).tolist()
            case_rows.append(Row(name, value, error, FLOORS[strip_number(name)], truth, doubt))
        out.append(case_rows)
    return out
