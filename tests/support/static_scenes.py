"""Random static patches as texts of scenes, whose reference is `patch_of_order_four`.

The campaigns "static" and "static-fine" of `campaigns.py` compare runs with a tolerance of 1e-2 and
of 1e-3.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import measure_rows
from patch_of_order_four import solve_patch

import patchfem as pf
from patchfem.scene import format_scene as format_tables

KINDS = ("plain", "crown", "h1", "step", "ends", "skin")
MATERIALS = ((121e9, 0.32), (210e9, 0.3), (70e9, 0.34), (250e9, 0.24))
# Smallest ratio of the stated error to the uncertainty of the reference at which a row counts.
KNOWN = 3.0
JUDGED = (
    "contact_fraction",
    "contact_half_width",
    "pressure_peak",
    "approach",
    "moment",
    "pressure_centre",
    "normal_stiffness",
    "tangential_stiffness",
    "rotational_stiffness",
)


class BodySection(NamedTuple):
    """Body with lengths [m]; layers: (Young's modulus [Pa], Poisson's ratio) of coating and substrate."""

    length: float
    height: float
    thickness: float
    layers: tuple


class PatchScene(NamedTuple):
    """Patch under a load [N] at a prescribed tilt [rad].

    curvature: of a crown [1/m]; step: (height, position) [m] or None; skin: stiffness of the
    asperities [Pa/m] or None.
    """

    length: float
    width: float
    plane: str
    lower: BodySection
    upper: BodySection
    load: float
    tilt: float = 0.0
    curvature: float = 0.0
    step: tuple | None = None
    skin: float | None = None


def draw_scene(seed: int) -> PatchScene:
    """Return the scene of a seed; its kind is KINDS[seed % 6]."""
    r = np.random.default_rng([seed, 28])
    kind = KINDS[seed % len(KINDS)]

    def log_uniform(low, high):
        """Draw a number with five digits from a log-uniform distribution."""
        return float(f"{10 ** r.uniform(np.log10(low), np.log10(high)):.5g}")

    length = log_uniform(5e-3, 5e-2)
    load = log_uniform(10, 5e3)
    height = float(f"{length * r.uniform(0.3, 1.2):.5g}")
    kinds = r.choice(len(MATERIALS), 3)
    thickness = float(f"{height * r.uniform(0.01, 0.2):.5g}") if r.random() < 0.5 else 0.0
    layers = tuple(MATERIALS[k] for k in kinds[:2]) if thickness else (MATERIALS[kinds[1]],) * 2
    lower = upper = BodySection(length, height, thickness, layers)
    if r.random() < 0.3:
        upper = BodySection(length, height, 0.0, (MATERIALS[kinds[2]],) * 2)
    tilt = float(f"{10 ** r.uniform(-6.5, -3.5) * r.choice([-1, 1]):.5g}")
    curvature = step = skin = None
    if kind in ("crown", "h1") or (kind in ("step", "skin") and r.random() < 0.5):
        curvature = float(f"{10 ** r.uniform(-1.5, 1):.5g}")
    if kind == "h1":  # A narrow contact of long bodies, outside their middle.
        length = log_uniform(2e-2, 6e-2)
        lower = upper = BodySection(length, length / 2, 0.0, (MATERIALS[kinds[0]],) * 2)
        tilt = float(f"{length * curvature * r.uniform(-0.2, 0.2):.5g}")
        load = log_uniform(1, 100)
    if kind == "step" or (kind == "skin" and r.random() < 0.5):
        step = (
            log_uniform(2e-8, 2e-6) * float(r.choice([-1, 1])),
            float(f"{length * r.uniform(-0.35, 0.35):.5g}"),
        )
        tilt = float(f"{tilt / 3:.5g}")
    if kind == "skin":
        skin = log_uniform(1e12, 1e15)
    if kind == "ends":
        lower = BodySection(
            float(f"{length * r.uniform(1.2, 2):.5g}"), height, lower.thickness, lower.layers
        )
    return PatchScene(
        length,
        log_uniform(2e-3, 5e-2),
        str(r.choice(["strain", "stress"])),
        lower,
        upper,
        load,
        tilt,
        curvature or 0.0,
        step,
        skin,
    )


def make_contact(scene: PatchScene) -> dict:
    """Return the table [contact] of a scene, in SI units."""

    def make_material(young, poisson):
        """Return a material as a table of a scene."""
        return {"young": young, "poisson": poisson, "density": 5000.0}

    table = {
        "length": scene.length,
        "width": scene.width,
        "height": scene.lower.height,
        "load": scene.load,
        "plane": scene.plane,
        "substrate": make_material(*scene.lower.layers[1]),
        "tilt": {"angle": scene.tilt},
    }
    for name, body in (("lower", scene.lower), ("upper", scene.upper)):
        material, thickness = make_material(*body.layers[0]), body.thickness
        table[name] = {
            "length": body.length,
            "substrate": make_material(*body.layers[1]),
            "coating": {"material": material, "thickness": thickness} if thickness else "none",
        }
    if scene.curvature:
        table["crown"] = {"radius": 1 / scene.curvature}
    if scene.step:
        table["step"] = dict(zip(("height", "at"), scene.step))
    if scene.skin:
        table["asperities"] = {"law": "linear", "normal_stiffness": scene.skin}
    return table


def format_scene(scene: PatchScene, **tables) -> str:
    """Return the scene as text, with further tables."""
    return format_tables({"contact": make_contact(scene)} | tables)


def solve_reference(scene: PatchScene) -> tuple:
    """Return the measures of the reference, and their uncertainties, by name."""
    true, doubt = solve_patch(make_contact(scene))
    doubt = {name: float(doubt[name]) for name in JUDGED}
    # The value is zero by symmetry; its uncertainty is a fraction of the terms of its difference.
    doubt["pressure_centre"] = max(doubt["pressure_centre"], 1e-6 * true["contact_half_width"])
    return {name: float(true[name]) for name in JUDGED}, doubt


def compare_patch(
    seed: int, folder: Path, earlier: dict | None = None, *, tolerance: float
) -> dict:
    """Compare the patch of a seed with its reference; see `campaigns`."""
    scene = draw_scene(seed)
    started = process_time()
    run = pf.run(format_scene(scene), **{"accuracy.tolerance": tolerance})
    line = {
        "group": KINDS[seed % len(KINDS)],
        "engine": "patch",
        "seconds": process_time() - started,
        "warnings": list(run.warnings),
    }
    if earlier and "true" in earlier:
        line |= {key: earlier[key] for key in ("true", "doubt")}
    else:
        line["true"], line["doubt"] = solve_reference(scene)
    return line | {"rows": reliable_rows(run.measures, line["true"], line["doubt"])}


compare_fine_patch = partial(compare_patch, tolerance=1e-3)
compare_coarse_patch = partial(compare_patch, tolerance=1e-2)


def reliable_rows(measures, true: dict, doubt: dict) -> list:
    """Return the rows of measures whose reference is accurate enough to judge the error."""
    rows = measure_rows(measures, true, doubt)
    return [
        row
        for row in rows
        if KNOWN * row.doubt <= row.error or row.true_error > row.error + KNOWN * row.doubt
    ]
