"""What do models with nothing fitted make of Table 1: the report's own rigid block, and the patch of rig.toml?

They fail. The rigid Coulomb block with its onset at 4.00 g and the patch stay at 4 and 5 g within about a third of most
accelerations, and the patch gets the displacements at 4 g (0.089 mil for 0.08, 0.222 for 0.25), where the rigid block
is still stuck. From 6 g both run away to tens and hundreds of times what was measured: RMS log error of the
accelerations 1.62 (Coulomb) and 1.62 (patch), of the displacements 3.68 and 3.37. Saying "1.43 times the input" scores
0.12.

Run: python studies/table_1/unfitted.py [--cycles N]
"""

import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from rig_texts import TEXTS
from study_run import Option, run_study

from patchfem.campaigns.rows.cells import compute_rms_scores, read_response_table
from patchfem.core import G_N
from patchfem.runs import run as runner
from patchfem.scene import scene

RIG = Path(__file__).parents[1] / "rig"
MIL = 25.4e-6
NULL = 1.43  # acceleration / input acceleration in the null model
MEASURES = "absolute_acceleration_peak", "relative_displacement_amplitude"


def answer(name: str, frequency: float, level: float, cycles: float, estimate: bool = True) -> dict:
    """Return the measures of a run of "coulomb" or "patch" at a frequency [Hz] and a level [m s-2].

    With `estimate`, the measures have errors.
    """
    sets = [
        f"drive.frequency={frequency} Hz",
        f"drive.acceleration={level / G_N:.12g} g",
        f"drive.cycles={cycles}",
    ]
    made = (
        scene.loads(TEXTS["Coulomb"], sets=sets)
        if name == "coulomb"
        else scene.load(RIG / "rig.toml", sets)
    )
    found = runner.run(runner.plan(made), estimate=estimate).measures
    return {one: found[one] for one in MEASURES}


def main(cycles: float = 800, models=("coulomb", "patch")) -> dict:
    """Print cells and scores and return them by model.

    Each model has "cells" (2, c) in m/s^2 and m, "all", "acceleration" and "displacement"; "null" is the score without
    a model.
    """
    cells = read_response_table(RIG / "table1.csv")
    every = np.ones(cells.row.size, bool)
    out = {
        "null": compute_rms_scores(
            cells,
            cells.compute_logs(
                cells.select_computed(NULL * cells.conditions[:, 1], 0 * cells.conditions[:, 1])
            ),
            every,
        )["acceleration"]
    }
    for name in models:
        runs = [answer(name, *condition, cycles, estimate=False) for condition in cells.conditions]
        both = np.array([[run[measure].value for run in runs] for measure in MEASURES])
        out[name] = {
            "cells": both,
            **compute_rms_scores(cells, cells.compute_logs(cells.select_computed(*both)), every),
        }
        print(
            f"{name}: all {out[name]['all']:.2f}, accelerations {out[name]['acceleration']:.2f}, displacements "
            f"{out[name]['displacement']:.2f}"
        )
        for (frequency, level), a, d in zip(cells.conditions, *both):
            print(f"  {frequency:3.0f} Hz {level / G_N:.0f} g {a / G_N:8.2f} g {d / MIL:9.3f} mil")
    print(f"{NULL} x input: accelerations {out['null']:.3f}")
    return out


if __name__ == "__main__":
    run_study(main, cycles=Option(800.0, "cycles of a run"))
