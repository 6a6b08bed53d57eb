"""Which tilt costs more: the one about y, which opens the gap along the slide, or the roll about x?

Both take the same contact: of the flat pieces 23 % stay in contact with 0.1 mrad about either axis, and 15 % with both. But
shear has a direction, so that the roll costs more stiffness and more damping. Of 398 N/um in shear 226 remain with the
tilt alone, 187 with the roll alone and 172 with both; the work of a cycle of 1 um falls by 11, 16 and 23 %.

The pieces are those of the rig under 26 lbf, pressed over the whole face ([contact.area], 128 cells along each side), with
Coulomb friction of 0.3 and elastic shear. The errors are below 3 % of each number.

Run: python studies/misalignment/both_tilts.py
"""

import sys
from pathlib import Path

import numpy as np

import patchfem as pf

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import drawing
from study_run import run_study

FOLDER = Path(__file__).parent
ANGLES = (0.0, 0.025, 0.05, 0.075, 0.1)  # [mrad] both tilts
CELLS = 128  # along each side of the face
AMPLITUDE = 1e-6  # [m] of the slide, beyond gross slip
FRICTION = 0.3
SCENE = {
    "contact": {
        "length": "12.7 mm",
        "width": "12.7 mm",
        "height": "6.35 mm",
        "load": "26 lbf",
        "substrate": "Ti-8Al-1Mo-1V",
        "coating": {"material": "WC-Co", "thickness": "6 mil"},
        "shear": {},
    },
    "friction": {"law": "coulomb", "static": FRICTION},
    "slide": {"kind": "triangle", "amplitude": f"{AMPLITUDE} m", "speed": "10 um/s", "cycles": 2},
    "accuracy": {"tolerance": 1e-2},
}
TITLES = {
    "contact": "in contact [%]",
    "stiffness": "stiffness in shear [N/um]",
    "work": "work of a cycle [uJ]",
}


def run_case(angle: float, roll: float, cells: int = CELLS) -> dict:
    """Run the contact with a tilt and a roll.

    Parameters
    ----------
    angle, roll : float
        Tilt about y and roll about x [mrad].
    cells : int
        Number of cells along each side of the face.

    Returns
    -------
    dict of str to float
        Fraction of the face in "contact" [1], "stiffness" in shear [N/m] and "work" of a cycle [J].
    """
    tilt = {"angle": f"{angle} mrad", "roll": f"{roll} mrad"}
    contact = SCENE["contact"] | {"tilt": tilt, "area": {"cells": cells}}
    result = pf.run(SCENE | {"contact": contact})
    values = {name: measure.value for name, measure in result.measures.items()}
    return {
        "contact": values["contact_fraction"],
        "stiffness": values["tangential_stiffness"],
        "work": values["loop_area"],
    }


def run_map(angles=ANGLES, cells: int = CELLS) -> dict:
    """Return {name: (k, k) array} over tilt (rows) and roll (columns) [mrad]; progress goes to stderr."""
    rows = []
    for angle in angles:
        print(f"tilt {angle} mrad", file=sys.stderr)
        rows.append([run_case(angle, roll, cells) for roll in angles])
    return {name: np.array([[case[name] for case in row] for row in rows]) for name in rows[0][0]}


def draw(maps: dict, path: Path, angles=ANGLES) -> Path:
    """Draw the maps of contact, stiffness and work.

    Parameters
    ----------
    maps : dict of str to (k, k) ndarray
        Maps over tilt (rows) and roll (columns): "contact" [1], "stiffness" [N/m] and "work" [J].
    path : Path
        File of the picture.
    angles : sequence of float
        The k tilts and rolls [mrad].

    Returns
    -------
    Path
        File of the picture.
    """
    scale = {"contact": 100.0, "stiffness": 1e-6, "work": 1e6}
    with drawing(path, (9.6, 3.4), 1, 3, sharey=True) as (_, panels):
        for axis, (name, title) in zip(panels, TITLES.items(), strict=True):
            values = scale[name] * maps[name]
            axis.imshow(values, origin="lower", cmap="Blues", vmin=0, vmax=1.4 * values.max())
            for (row, column), value in np.ndenumerate(values):
                axis.text(column, row, f"{value:.3g}", ha="center", va="center", fontsize=9)
            ticks = [f"{angle:g}" for angle in angles]
            axis.set(title=title, xlabel="roll [mrad]")
            axis.set_xticks(range(len(angles)), ticks)
            axis.set_yticks(range(len(angles)), ticks)
            axis.grid(False)
        panels[0].set_ylabel("tilt [mrad]")
    return path


def main(path: Path = FOLDER / "both_tilts.svg") -> dict:
    """Print the table, draw the picture and return the maps."""
    maps = run_map()
    print(f"{'tilt':>6} {'roll':>6} {'contact':>8} {'N/um':>6} {'work uJ':>8}")
    for row, column in np.ndindex(maps["work"].shape):
        case = {name: values[row, column] for name, values in maps.items()}
        print(
            f"{ANGLES[row]:6.3f} {ANGLES[column]:6.3f} {case['contact']:8.3f} {1e-6 * case['stiffness']:6.1f} "
            f"{1e6 * case['work']:8.2f}"
        )
    draw(maps, path)
    return maps


if __name__ == "__main__":
    run_study(main)
