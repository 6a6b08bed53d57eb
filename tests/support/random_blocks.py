"""Random pressed blocks with [contact.area], whose stated errors are compared with finer cells and bricks.

Each block is drawn from its own number: size, heights, material, coating, load, and one to three of a tilt, a roll, a crown
along each axis and a load line off the middle. Loads and shapes range from a contact of a few per cent of the face to the
whole face.
"""

from dataclasses import replace

import numpy as np

import patchfem as pf
from patchfem.runs.patch import area

FIRST_SEED = (
    830_000  # number of the first block; earlier numbers served to choose the estimate of errors
)
MAX_CELLS = 256  # largest number of cells along the longer side of a block whose errors are judged
MAX_REFERENCE_CELLS = 512
REFERENCE_SIDE_LEVEL = 2
TOLERANCE = 1e-2
MATERIALS = ("Ti-8Al-1Mo-1V", "steel", "aluminium")
SHAPES = ("tilt", "roll", "crown", "across", "offset", "side")


def draw_contact(seed: int) -> dict:
    """Draw the table [contact] of a block with a number."""
    rng = np.random.default_rng(seed)
    length = 10 ** rng.uniform(-2.5, -1.7)
    width = length * 2 ** rng.uniform(-1, 1)
    height = min(length, width) * rng.uniform(0.3, 1.2)
    load = 10 ** rng.uniform(4.5, 6.5) * length * width
    contact = {
        "length": f"{length:.5g} m",
        "width": f"{width:.5g} m",
        "height": f"{height:.5g} m",
        "load": f"{load:.5g} N",
        "substrate": str(rng.choice(MATERIALS)),
        "area": {},
    }
    if rng.random() < 0.5:
        thickness = height * 10 ** rng.uniform(-2, -1)
        contact["coating"] = {"material": "WC-Co", "thickness": f"{thickness:.4g} m"}

    # The gap at the sides is about the displacement of the flat pieces, from a fifth of it to twenty times
    closing = load / (length * width) * height / 1e11
    shapes = set(rng.choice(SHAPES, rng.integers(1, 4), replace=False).tolist())
    # A load line leaves a rotation free that a tilt or a roll would prescribe
    shapes -= {"tilt", "roll"} if "offset" in shapes else set()
    shapes -= {"roll"} if "side" in shapes else set()
    # A roll needs a tilt, and a crown along y one along x
    shapes |= {"tilt"} if "roll" in shapes else set()
    shapes |= {"crown"} if "across" in shapes else set()
    for shape in sorted(shapes):
        rise = closing * 10 ** rng.uniform(-0.7, 1.3)
        sign = rng.choice([-1.0, 1.0])
        if shape == "tilt":
            contact.setdefault("tilt", {})["angle"] = f"{sign * rise / length:.4g} rad"
        elif shape == "roll":
            contact.setdefault("tilt", {})["roll"] = f"{sign * rise / width:.4g} rad"
        elif shape == "crown":
            contact.setdefault("crown", {})["radius"] = f"{length**2 / (8 * rise):.4g} m"
        elif shape == "across":
            contact.setdefault("crown", {})["across"] = f"{width**2 / (8 * rise):.4g} m"
        elif shape == "offset":
            place = sign * length * rng.uniform(0.02, 0.3)
            contact.setdefault("load_line", {})["offset"] = f"{place:.4g} m"
        else:
            place = sign * width * rng.uniform(0.02, 0.3)
            contact.setdefault("load_line", {})["across"] = f"{place:.4g} m"
    return contact


def compute_errors(seed: int) -> dict[str, tuple[float, float]]:
    """Return the error and the stated error of the static measures of a block by name, in SI units.

    The reference has `MAX_REFERENCE_CELLS` along the longer side and bricks of `REFERENCE_SIDE_LEVEL`.
    """
    model = pf.build({"contact": draw_contact(seed), "accuracy": {"tolerance": TOLERANCE}}).patch
    coarse = replace(model, area=model.area._replace(max_cells=MAX_CELLS))
    patch = area.solve_face_on_grids(coarse, TOLERANCE)[0]
    cells = area.make_cells(model, MAX_REFERENCE_CELLS, REFERENCE_SIDE_LEVEL)
    reference = area.compute_face_values(area.press_face(model, cells))
    return {
        name: (abs(measure.value - reference[name]), measure.error)
        for name, measure in patch.measures.items()
        if measure.value is not None and measure.error is not None
    }
