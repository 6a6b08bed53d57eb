"""Random joints, rigs and chains of two masses with [contact.shear], against runs with a far smaller tolerance.

Campaigns `shear-joints`, `shear-rigs` and `shear-chains` of `campaigns`. The reference is a smaller
tolerance, because its mesh is graded towards the edges: a uniform mesh of 1600 nodes has a larger
error of the stiffness than many stated errors.
"""

import re
from pathlib import Path
from time import process_time

import numpy as np
from campaigns import measure_rows
from scene_texts import COATED, COULOMB, SHEAR, STRUCTURE

import patchfem as pf
from patchfem.response.rows import INTERFACE_MEASURES

JOINT_TOLERANCE = 1e-6  # Tolerance of the reference of a joint.
RIG_TOLERANCE = 1e-5  # Tolerance of the reference of a rig or a chain.
BENCH = (
    "loop_area",
    "friction_force_peak",
    "secant_stiffness",
    "energy_stored",
    "slip_amplitude",
    "energy_dissipated",
    "equivalent_stiffness",
)
MOTION = (
    "relative_displacement_amplitude",
    "absolute_acceleration_peak",
    *BENCH,
    "equivalent_damping",
)
RIG = (
    COATED.replace('element_size = "0.5 mm"\n', "")
    + SHEAR
    + COULOMB
    + STRUCTURE.replace("cycles = 30", "cycles = 150")
    + "[accuracy]\ntolerance = 1e-2\n"
)


def _draw_shape(draw, crowns: tuple, tilts: tuple) -> dict:
    """Draw the keys of a crown, a tilt or neither; the ranges are powers of ten of metres and of radians."""
    kind = draw.choice(["crown", "flat", "tilt"])
    if kind == "crown":
        return {"contact.crown.radius": f"{10 ** draw.uniform(*crowns):.3g} m"}
    return {"contact.tilt.angle": f"{10 ** draw.uniform(*tilts):.3g} rad"} if kind == "tilt" else {}


def draw_joint(seed: int) -> tuple:
    """Return (text, keys) of a bolted joint with an amplitude of 0.02 to 2.5 times the gross slip of a rigid joint."""
    draw = np.random.default_rng(seed)
    mu = f"{draw.uniform(0.1, 0.6):.3f}"
    sets = {
        "contact.length": f"{draw.uniform(10, 60):.2f} mm",
        "contact.load": f"{10 ** draw.uniform(1.5, 4):.3g} N",
        "friction.static": mu,
        "friction.kinetic": mu,
    } | _draw_shape(draw, (1, 3.5), (-6, -4.3))
    if draw.random() < 0.3:
        sets |= {
            "contact.coating.material": "WC-Co",
            "contact.coating.thickness": f"{draw.uniform(50, 400):.0f} um",
        }
    text = re.sub(r"\[contact.crown\]\nradius.*\n(\s+#.*\n)*", "", pf.new("joint"))
    measures = pf.run(text, **sets | {"slide.amplitude": "0.01 um"}).measures
    slip_displacement = (
        float(mu) * measures["normal_load"].value / measures["tangential_stiffness"].value
    )
    return text, sets | {
        "slide.amplitude": f"{10 ** draw.uniform(-1.7, 0.4) * slip_displacement!r} m"
    }


def draw_rig(seed: int) -> tuple:
    """Return (text, keys) of the coated bodies on one mode, below and far above its frequency, at 0.1 to 30 g."""
    draw = np.random.default_rng(seed)
    mu = f"{draw.uniform(0.1, 0.6):.3f}"
    sets = {
        "contact.load": f"{10 ** draw.uniform(1.5, 3):.3g} N",
        "friction.static": mu,
        "friction.kinetic": mu,
    }
    sets |= _draw_shape(draw, (0.5, 3), (-5.5, -3.5))
    return RIG, sets | {
        "drive.frequency": f"{draw.uniform(100, 600):.1f} Hz",
        "drive.acceleration": f"{10 ** draw.uniform(-1, 1.5):.3g} g",
    }


FACE = """
[[structure.interface]]
between = [{pair}]
law = "coulomb"
static = {static:.3f}
"""
CHAIN = """
[structure]
masses = ["0.3 kg", "0.5 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "{one:.4g} N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "{two:.4g} N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "5 N s/m"
[[structure.damper]]
between = [2, 1]
coefficient = "5 N s/m"
"""


def draw_chain(seed: int) -> tuple:
    """Return (text, keys) of two masses in a row, each on its own patch, at frequencies near their resonances."""
    draw = np.random.default_rng(seed)
    one, two = 10 ** draw.uniform(5, 7, 2)
    pieces, other_tables = RIG.split("[friction]")
    text = CHAIN.format(one=one, two=two)
    sets = {}
    for k, pair in enumerate(("1, 0", "2, 1")):
        text += FACE.format(pair=pair, static=draw.uniform(0.1, 0.6)) + pieces.replace(
            "[contact", "[structure.interface.contact"
        )
        interface_keys = {"contact.load": f"{10 ** draw.uniform(1, 3):.3g} N"} | _draw_shape(
            draw, (0.5, 3), (-5.5, -3.5)
        )
        sets |= {f"structure.interface.{k}.{key}": value for key, value in interface_keys.items()}
    frequency = 10 ** draw.uniform(1.8, 3)
    return text + "[drive]" + other_tables.partition("[drive]")[2], sets | {
        "drive.frequency": f"{frequency:.1f} Hz",
        "drive.acceleration": f"{10 ** draw.uniform(-1, 1.5):.3g} g",
    }


def compare_scene(text: str, sets: dict, tolerance: float, names) -> dict:
    """Compare a scene with the same scene at a smaller tolerance; see `campaigns`."""
    started = process_time()
    result = pf.run(text, **sets)
    line = {"seconds": process_time() - started, "warnings": list(result.warnings)}
    finer = pf.run(text, **sets | {"accuracy.tolerance": tolerance}).measures
    truths = {
        name: finer[name].value for name in names if name in finer and finer[name].value is not None
    }
    return line | {"rows": measure_rows(result.measures, truths, {})}


def compare_joint(seed: int, folder: Path) -> dict:
    """Compare the joint of a seed; see `campaigns`."""
    return compare_scene(*draw_joint(seed), JOINT_TOLERANCE, BENCH)


def compare_rig(seed: int, folder: Path) -> dict:
    """Compare the rig of a seed; see `campaigns`."""
    return compare_scene(*draw_rig(seed), RIG_TOLERANCE, MOTION)


def compare_chain(seed: int, folder: Path) -> dict:
    """Compare the chain of a seed; see `campaigns`."""
    return compare_scene(
        *draw_chain(seed), RIG_TOLERANCE, (*MOTION, *(f"{name}_2" for name in INTERFACE_MEASURES))
    )
