"""Does a mesh from a file press as the mesh that patchfem makes itself?

Yes: at three tilts every measure of `meshes/test-piece.msh` lies within the error that is stated for it. The file's
bilinear cells and those of the made mesh are assembled from element matrices of scikit-fem. Departure of
the file from the made mesh | the error stated for the file, in per cent:

    tilt        approach       peak           share of contact   normal stiffness   between the pressures
    0.01 mrad   -0.13 | 0.17   -0.30 | 2.5    -0.13 | 0.21        0.07 | 0.084      0.08
    0.1 mrad     0.15 | 0.22   -0.34 | 2.5    -0.07 | 0.23        0.07 | 0.11       0.21
    1 mrad       0.00 | 0.012  -1.15 | 3.1     0.17 | 2.1         0.13 | 0.17       1.81

The errors of the file follow from a comparison with its refinement. The last column is half the integral of the
absolute difference of both pressures, over that of one.

Run: python studies/patch/from_file.py
"""

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
import numpy as np
from study_run import run_study

import patchfem as pf

MESH = Path(__file__).parents[2] / "meshes" / "test-piece.msh"
TILTS = ("0.01 mrad", "0.1 mrad", "1 mrad")
COMPARED_MEASURES = ("approach", "pressure_peak", "contact_fraction", "normal_stiffness")
SCENE = """\
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.coating]
material = "WC-Co"
thickness = "6 mil"
[contact.tilt]
angle = "{tilt}"
"""


def press_pieces(tilt: str, mesh: str = "") -> pf.Result:
    """Return the pieces of the rig pressed under a tilt, on the mesh of a file if one is given."""
    with tempfile.TemporaryDirectory() as folder:
        scene = Path(folder) / "scene.toml"
        scene.write_text(SCENE.format(tilt=tilt), "utf-8")
        return pf.run(scene, **({"contact.mesh": mesh} if mesh else {}))


def pressure_difference(one: pf.Result, other: pf.Result) -> float:
    """Return half the integral of the absolute difference of two pressures, relative to the integral of the first [1]."""
    first, second = ((run.patch.x, run.patch.pressure.sigma_n) for run in (one, other))
    x = np.union1d(first[0], second[0])
    a, b = (np.interp(x, *curve) for curve in (first, second))
    return np.trapezoid(abs(a - b), x) / 2 / np.trapezoid(a, x)


def rows():
    """Return a row for each tilt, in percent.

    A row has the tilt, (difference of the file, stated error) of each measure, and the pressure
    difference.
    """
    for tilt in TILTS:
        made = press_pieces(tilt)
        read = press_pieces(tilt, str(MESH))
        pairs = [
            (
                100 * (read.measures[name].value / made.measures[name].value - 1),
                100 * abs(read.measures[name].error / made.measures[name].value),
            )
            for name in COMPARED_MEASURES
        ]
        yield tilt, pairs, 100 * pressure_difference(made, read)


def main() -> None:
    """Print the rows."""
    for name, compared, apart in rows():
        print(f"{name:10}", *(f"{off:7.2f} | {bar:.2g}" for off, bar in compared), f"{apart:7.2f}")


if __name__ == "__main__":
    run_study(main)
