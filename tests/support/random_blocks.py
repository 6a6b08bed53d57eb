"""Random pressed blocks with [contact.area], whose stated errors are compared with finer cells and bricks.

Each block is drawn from its own number: size, heights, material, coating, load, and one to three of a tilt, a roll, a crown
along each axis, a load line off the middle and a scan. Some have a layer of asperities or a hardness. Loads and shapes
range from a contact of a few per cent of the face to the whole face. Each block slips part by part on a bench.

    python tests/support/random_blocks.py

draws `N_BLOCKS` blocks and prints how many errors hold, for each measure.
"""

import sys
import tempfile
from collections import defaultdict
from pathlib import Path

import numpy as np

import patchfem as pf
from patchfem.runs.patch import area
from patchfem.slip.first_loading import find_reversal, slip_from_rest

# Number of the first block. Other numbers below 900 000 served to choose the estimate of errors.
FIRST_SEED = 941_000
N_BLOCKS = 60
REFERENCE_CELLS = 512  # along the longer side; a run of a bench has at most half as many
REFERENCE_SIDE_LEVEL = 3  # a run has bricks of level 2
TOLERANCE = 1e-2
FRICTION = 0.3
MATERIALS = ("Ti-8Al-1Mo-1V", "steel", "aluminium")
SHAPES = ("tilt", "roll", "crown", "across", "offset", "side", "scan")
N_SCAN_POINTS = 97
N_SCAN_WAVES = 12
LOOP_MEASURES = ("loop_area", "friction_force_peak", "stick_area_fraction")


def draw_scene(seed: int, folder: Path) -> dict:
    """Draw the scene of a block with a number; its scan is written to a folder."""
    rng = np.random.default_rng(seed)
    length = 10 ** rng.uniform(-2.5, -1.7)
    width = length * 2 ** rng.uniform(-1, 1)
    height = min(length, width) * rng.uniform(0.3, 1.2)
    mean_pressure = 10 ** rng.uniform(4.5, 6.5)
    contact = {
        "length": f"{length:.5g} m",
        "width": f"{width:.5g} m",
        "height": f"{height:.5g} m",
        "load": f"{mean_pressure * length * width:.5g} N",
        "substrate": str(rng.choice(MATERIALS)),
        "area": {},
        "shear": {},
    }
    if rng.random() < 0.5:
        thickness = height * 10 ** rng.uniform(-2, -1)
        contact["coating"] = {"material": "WC-Co", "thickness": f"{thickness:.4g} m"}
    if rng.random() < 0.2:
        stiffness = 1e11 / height * 10 ** rng.uniform(-0.5, 1.5)
        contact["asperities"] = {
            "law": "linear",
            "normal_stiffness": f"{stiffness:.4g} Pa/m",
            "tangential_ratio": 0.8,
        }
    if rng.random() < 0.15:
        hardness = mean_pressure * rng.uniform(3.0, 10.0)
        contact["area"] = {"hardness": f"{hardness:.4g} Pa"}

    # The gap at the sides is about the displacement of the flat pieces, from a fifth of it to twenty times
    closing = mean_pressure * height / 1e11
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
        elif shape == "side":
            place = sign * width * rng.uniform(0.02, 0.3)
            contact.setdefault("load_line", {})["across"] = f"{place:.4g} m"
        else:
            path = folder / f"scan_{seed}.csv"
            _write_scan(path, (length, width), rise / 4, rng)
            contact["profile"] = {"scan": str(path), "heights": "gap"}
    amplitude = 0.3 * mean_pressure * height / 4e10 * 10 ** rng.uniform(-0.7, 0.5)
    return {
        "contact": contact,
        "friction": {"law": "coulomb", "static": FRICTION},
        "slide": {
            "kind": "sine",
            "amplitude": f"{amplitude:.4g} m",
            "frequency": "1 Hz",
            "cycles": 2,
        },
        "accuracy": {"tolerance": TOLERANCE},
    }


def _write_scan(path: Path, sides: tuple[float, float], height: float, rng) -> None:
    """Write a scan of plane waves that are a sixth to twice as long as a side, with heights of a size [m]."""
    x, y = (np.linspace(0.0, side, N_SCAN_POINTS) for side in sides)
    x, y = np.meshgrid(x, y)
    z = np.zeros(x.shape)
    for _ in range(N_SCAN_WAVES):
        wavelength = max(sides) * 2 ** rng.uniform(-2.6, 1.0)
        angle, phase = rng.uniform(0, 2 * np.pi, 2)
        along = x * np.cos(angle) + y * np.sin(angle)
        z += height * wavelength / max(sides) * np.cos(2 * np.pi * along / wavelength + phase)
    rows = np.stack([1e3 * x.ravel(), 1e3 * y.ravel(), 1e6 * z.ravel()], axis=1)
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header="x [mm],y [mm],z [um]", comments="")


def compute_errors(seed: int, folder: Path) -> dict[str, tuple[float, float, float]]:
    """Return value, error and stated error of the measures of a block by name, in SI units."""
    result = pf.run(draw_scene(seed, folder))
    model = result.plan.model
    patch_model = model.patch
    cells = area.make_cells(patch_model, REFERENCE_CELLS, REFERENCE_SIDE_LEVEL)
    reference = area.press_face(patch_model, cells)
    values = area.compute_face_values(reference)

    # Slipping cells carry their limits in each stroke of a steady cycle
    limit = FRICTION * reference.pressed.pressure
    slip = (reference.slip_compliance, limit, model.slide.amplitude)
    traction = slip_from_rest(*slip).traction
    state = find_reversal(*slip)
    values["friction_force_peak"] = traction.sum() * cells.normal.cell_area
    values["loop_area"] = state.slip_per_cycle @ limit.ravel() * cells.normal.cell_area
    values["stick_area_fraction"] = state.stick_fraction
    return {
        name: (measure.value, abs(measure.value - values[name]), measure.error)
        for name, measure in result.measures.items()
        if name in values and measure.value is not None and measure.error is not None
    }


def main() -> None:
    """Draw the blocks, and print how many errors of each measure hold."""
    ratios = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(FIRST_SEED, FIRST_SEED + N_BLOCKS):
            for name, (_, error, stated) in compute_errors(seed, Path(folder)).items():
                ratios[name].append(error / stated if stated else np.inf * error)
            print(seed, file=sys.stderr, flush=True)
    for name, row in sorted(ratios.items()):
        held = sum(not ratio > 1 for ratio in row)
        print(f"{name:22} {held:3} of {len(row):3} hold; largest {np.nanmax(row):.2f}")


if __name__ == "__main__":
    main()
