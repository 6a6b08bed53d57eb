"""At which level does each rung begin to slip and run away, and when in the cycle does it slip, at every frequency?

The numbers are those of the fit to 143 Hz under one reading, which only chooses the fit. Onset: the level at which
the motion at the gauge reaches 0.01 mil, half peak to peak. Runaway: the lowest level on a grid of 0.25 g up to 12 g at
which the motion from rest exceeds 2 mil or has no bound. Slip phase: where in the cycle of the base displacement slip
starts at 5 g; 90 degrees is the maximum of the displacement.

Run: python studies/table_1/levels.py
"""

import json
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
from rungs import HERE, RUNGS

from patchfem.campaigns.rows.computed import Computed
from patchfem.core import G_N
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene.scene import loads

MIL = 25.4e-6
FREQUENCIES = (135.0, 143.0, 150.0, 155.0)
SEEN, AWAY, MOST = 0.01 * MIL, 2 * MIL, 12.0  # m, m, g
SHOWN = (("rigid Coulomb", "peak"), ("second path, patch", "peak x 1.2375"), ("spring and yaw", "fundamental x sqrt2"),
         ("grooves", "fundamental x sqrt2"), ("grooves, lift and yaw", "fundamental x gain"))


def levels_of(question, values, frequency: float) -> dict:
    """{"onset", "runaway"} [g] of a model at values of its free keys; None where there is none up to MOST."""
    def swing(level: float) -> float:
        computed = Computed(question.asked([(frequency, level * G_N)]))
        return float(computed(values, [0])[1][0])

    away = next((level for level in np.arange(4.0, MOST + 0.1, 0.25) if swing(level) > AWAY), None)
    low, high = 1.0, 8.0
    while high - low > 0.01:
        middle = 0.5 * (low + high)
        low, high = (low, middle) if swing(middle) > SEEN else (middle, high)
    return {"onset": round(high, 2), "runaway": None if away is None else float(away)}


def slip_phase(question, values, frequency: float, level: float = 5.0) -> float | None:
    """Phase [degrees] of the base displacement at which slip starts, from a run of the scene."""
    scene = question.asked([(frequency, level * G_N)]).fitted(values)
    sets = [*scene.sets, f"drive.frequency={frequency} Hz", f"drive.acceleration={level} g"]
    found = run(plan(loads(scene.text, scene.path, sets))).measures.get("slip_start_phase")
    return None if found is None or found.value is None else float(np.degrees(found.value))


def main(shown=SHOWN, frequencies=FREQUENCIES, scores: Path = HERE / "scores.json") -> list:
    """Print and return a row per rung and frequency: {"rung", "frequency", "onset", "runaway", "slip_phase"}."""
    known = {(row["rung"], row["reading"]): row for row in json.loads(scores.read_text("utf-8"))
             if row["protocol"] == "143" and not row["placebo"]}
    out = []
    for rung, reading in shown:
        question, values = RUNGS[rung].question(reading), known[rung, reading]["values"]
        for frequency in frequencies:
            row = {"rung": rung, "frequency": frequency, **levels_of(question, values, frequency),
                   "slip_phase": slip_phase(question, values, frequency)}
            out.append(row)
            phase = "-" if row["slip_phase"] is None else f"{row['slip_phase']:.0f}"
            print(f"{rung:<24}{frequency:5.0f} Hz  onset {row['onset']:.2f} g  runaway {row['runaway'] or 'none'}"
                  f"  slip from {phase} degrees", flush=True)
    return out


if __name__ == "__main__":
    main()
