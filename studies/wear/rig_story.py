"""What does wear do to the rig of the report: pressure, contact, onset of slip and friction loop, new and worn?

The shipped rig (143 Hz, 5 g, one piece tilted by 0.1 mrad, bonds of 1 um, shear of the pieces) over 135 723 cycles,
16 minutes; Archard's coefficient is assumed, 1e-15 to 1e-13 m2/N.

Wear heals the tilt. New, 22 % of the length touches under a peak of 8.3 MPa. With 1e-14 m2/N 0.31 um wear off at the
loaded end, 38 % touches and the peak is 2.7 MPa; normal and tangential stiffness rise from 535 to 845 and from 229 to
303 N/um. With 1e-13 it is 97 % of the length and 1.20 um; the peak there, 0.78 +- 0.50 MPa, is hardly known, since
jumps leave the freshly worn edge too high.

The motion hardly sees it: amplitude 14.81, 15.03 and 15.32 um, loop 1.96, 2.00 and 2.04 mJ, since the same load slides
the same way. Onset of slip (elastic-plastic patch, so that it is sharp) goes from 3.88 g to 3.90 and 4.00 g: a patch
that touches all over slips as one, at mu N/m = 4.00 g. So an onset measured between 3.8 and 4.2 g does not tell a
worn rig from a new one; the part of the faces that is rubbed does.

Run: python studies/wear/rig_story.py
"""

import sys
from pathlib import Path
from typing import NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from drawing import BLUE, GREY, ORANGE, drawing
from study_run import run_study

from patchfem.core import G_N
from patchfem.measures import make_onset_test
from patchfem.model import build
from patchfem.runs import choose_numerics
from patchfem.runs import run as runner
from patchfem.runs.patch.press import solve_patch_contact
from patchfem.runs.rig import levels, rig
from patchfem.scene import scene

FOLDER = Path(__file__).parent
SCENE = FOLDER.parent / "rig" / "rig.toml"
RIG = SCENE.read_text()
CYCLES = 135_723  # number of cycles in about 16 minutes at 143 Hz
# [m^2/N] assumed wear coefficients of sprayed carbide on itself, mild to severe
COEFFICIENTS = (1e-15, 1e-14, 1e-13)
PLASTIC = '[friction]\nlaw = "elastic-plastic"\nbond_length = "1 um"\nstatic = 0.30\n'  # this law has a sharp onset of slip
SHOWN_MEASURES = (
    "contact_fraction",
    "pressure_peak",
    "normal_stiffness",
    "tangential_stiffness",
    "relative_displacement_amplitude",
    "loop_area",
)


class Row(NamedTuple):
    """Rig after CYCLES with a wear coefficient [m2/N].

    Contains measures by name, error of the peak [Pa], onset of slip [g], largest depth [m], history
    over the cycles, positions x (m,) [m] and pressures (2, m) [Pa] new and worn.
    """

    coefficient: float
    values: dict
    error: float
    onset: float
    depth: float
    history: dict
    x: np.ndarray
    pressure: np.ndarray


def onset(worn, cycles: int, pair=None) -> float:
    """Return the level [g] at which a patch with this worn depth (m,) [m] begins to slip, in steps of .25 g from 3.5 g."""
    text = (
        RIG[: RIG.index("[friction]")]
        + PLASTIC
        + RIG[RIG.index("[structure]") : RIG.index("[drive]")]
        + (
            f'[drive]\nkind = "base"\nwaveform = "levels"\nfrequency = "143 Hz"\ncycles = {cycles}\n'
            'levels = ["3.5 g", "3.75 g", "4 g", "4.25 g"]\n[accuracy]\ntolerance = 3e-3\nsteps_per_cycle = 400\n'
        )
    )
    model = build(scene.loads(text, SCENE))
    patch = solve_patch_contact(model.patch, pair, worn)
    run = rig.solve_rig(model, choose_numerics(model), patch)
    return levels.find_onset(run.levels, 3e-3, make_onset_test("slip"))[0] / G_N


def _worn_rig(coefficient: float, cycles: int, motion: int, tolerance: str) -> Row:
    """Return the shipped rig worn with a coefficient [m2/N]; motion: cycles of each run in time."""
    text = RIG + f'[wear]\ncoefficient = "{coefficient!r} m^2/N"\ncycles = {cycles}\n'
    found = runner.run(
        scene.loads(text, SCENE, [f"accuracy.tolerance={tolerance}", f"drive.cycles={motion}"])
    )
    depth = found.fields["worn_depth"][-1]
    fields = found.fields["normal_stress"]
    values = {name: found.measures[name].value for name in SHOWN_MEASURES}
    return Row(
        coefficient,
        values,
        found.measures["pressure_peak"].error,
        onset(depth, motion, found.patch.pair),
        float(depth.max()),
        found.wear.columns,
        found.patch.x,
        fields[[0, -1]],
    )


def picture(rows: list, path: Path) -> Path:
    """Plot the pressure new and worn, the history over the cycles, and onset and loop against the coefficient."""
    middle = rows[len(rows) // 2]
    with drawing(path, (9.6, 2.9), 1, 3) as (_, (a, b, c)):
        a.plot(middle.x * 1e3, middle.pressure[0] / 1e6, color=GREY, label="new")
        for row, colour in zip(rows, (ORANGE, BLUE, "#3f7d4e")):
            label = f"{row.coefficient:.0e} m²/N"
            a.plot(row.x * 1e3, row.pressure[1] / 1e6, color=colour, label=label)
            b.plot(
                row.history["cycle"] / 1e3,
                row.history["contact_fraction"] * 100,
                color=colour,
                label=label,
            )
            first = row.history["loop_area"][0]
            c.plot(
                row.history["cycle"] / 1e3,
                100 * (row.history["loop_area"] / first - 1),
                color=colour,
                label=label,
            )
        a.set(title="pressure [MPa]", xlabel="x [mm]", ylim=(0, 8))
        b.set(title="contact [% of the length]", xlabel="thousand cycles", ylim=(0, 105))
        c.set(title="friction loop, change [%]", xlabel="thousand cycles")
        a.legend(frameon=False, fontsize=8.5)
    return path


def main(
    coefficients=COEFFICIENTS,
    cycles=CYCLES,
    motion=200,
    tolerance="1e-2",
    path=FOLDER / "rig_story.svg",
) -> list:
    """Print and return rows of the rig, new and worn with each coefficient; draw them if a path is given."""
    rows = [_worn_rig(each, cycles, motion, tolerance) for each in coefficients]
    new = {name: rows[0].history[name][0] for name in SHOWN_MEASURES}
    pair = runner.run(
        scene.loads(RIG, SCENE, [f"drive.cycles={motion}"]), estimate=False
    ).patch.pair
    still = np.zeros(pair.grid.x.size)
    rows.insert(
        0,
        Row(
            0.0, new, 0.0, onset(still, motion, pair), 0.0, {}, rows[0].x, rows[0].pressure[[0, 0]]
        ),
    )
    print(
        f"{'kappa':>8} {'depth um':>9} {'contact %':>9} {'peak MPa':>9} {'error':>6} {'K_n N/um':>9} {'K_t N/um':>9} "
        f"{'amp um':>8} {'loop mJ':>8} {'onset g':>8}"
    )
    for r in rows:
        v = [r.values[name] for name in SHOWN_MEASURES]
        print(
            f"{r.coefficient:8.0e} {r.depth * 1e6:9.3f} {100 * v[0]:9.1f} {v[1] / 1e6:9.2f} {r.error / 1e6:6.2f} "
            f"{v[2] / 1e6:9.0f} {v[3] / 1e6:9.0f} {v[4] * 1e6:8.3f} {v[5] * 1e3:8.4f} {r.onset:8.3f}"
        )
    if path is not None:
        picture(rows[1:], path)
    return rows


if __name__ == "__main__":
    run_study(main)
