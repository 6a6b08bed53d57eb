"""At which level does each rung begin to slip and run away, and when in the cycle does it slip, at every frequency?

Slip begins at 4.3 to 4.4 g beside a spring and damper, at 4.7 to 4.9 g with spring and yaw or grooves, lift and yaw,
at 3.95 to 4.0 g with grooves alone (report: 3.8 to 4.2 g). Only grooves run away, at 8.75 g (135 and 143 Hz), 8.5 (150)
and 8.25 g (155 Hz) with lift and yaw: near the 8 g of the rig at 143 Hz, which nothing was fitted to, but in the wrong
order, for the rig went first at 135 Hz, from 6 g. At 5 g slip starts as the base displacement passes zero (grooves) or
18 to 35 degrees later.

The numbers are those of the fit to 143 Hz under one reading, which only chooses the fit. Onset: the lowest level on a
grid of 0.05 g at which the third harmonic of the acceleration exceeds 3 % of the first, as the rig's operators saw it.
Runaway: the lowest level on a grid of 0.25 g up to 12 g at which the motion from rest exceeds 2 mil or has no bound.
Slip phase: where in the cycle of the base displacement slip starts at 5 g; 90 degrees is its maximum.

Run: python studies/table_1/levels.py
"""

import json
import sys
from bisect import bisect_left
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))
sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from rungs import FOLDER, ROOT2, RUNGS, STUCK_READING
from study_run import run_study

from patchfem.campaigns.rows.model_readings import ModelReadings
from patchfem.core import G_N
from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene import loads

FREQUENCIES = (135.0, 143.0, 150.0, 155.0)
DISTORTION_LIMIT = (
    0.03  # third harmonic / first harmonic above which the acceleration counts as distorted
)
RUNAWAY_AMPLITUDE = 2 * 25.4e-6  # [m] amplitude that counts as a runaway
ONSETS = [round(2 + 0.05 * k, 2) for k in range(101)]  # g
RUNAWAYS = [4 + 0.25 * k for k in range(33)]  # g
SHOWN_MODELS = (
    ("rigid Coulomb", "peak"),
    ("second path, patch", STUCK_READING),
    ("spring and yaw", ROOT2),
    ("path of Fig. 27", STUCK_READING),
    ("grooves", ROOT2),
    ("grooves, lift and yaw", "fundamental x gain"),
)


def _compute_measure(scene, frequency: float, level: float, name: str) -> float | None:
    """Return a measure of the scene at a frequency [Hz] and a level [g]; None if it has none."""
    sets = [*scene.sets, f"drive.frequency={frequency} Hz", f"drive.acceleration={level} g"]
    found = run(plan(loads(scene.text, scene.path, sets))).measures.get(name)
    return None if found is None else found.value


def runaway(question, values, frequency: float) -> float | None:
    """Return the lowest level [g] of the grid at which a model diverges; None if it stays bounded up to 12 g."""
    computed = ModelReadings(
        question.make_condition_models([(frequency, level * G_N) for level in RUNAWAYS])
    )
    for k, level in enumerate(RUNAWAYS):
        computed.reset_motions()
        if computed(values, [k])[1][k] > RUNAWAY_AMPLITUDE:
            return level
    return None


def row(rung: str, reading: str, values, frequency: float) -> dict:
    """Return {"rung", "frequency", "onset" [g], "runaway" [g], "slip_phase" [degrees]} of a model with fitted values."""
    question = RUNGS[rung].question(reading)
    asked = question.make_condition_models([(frequency, 5 * G_N)])
    scene = asked.base.override(
        [one.format_assignment(value) for one, value in zip(asked.ranges, values)]
    )
    place = bisect_left(
        ONSETS,
        True,
        key=lambda level: (
            (_compute_measure(scene, frequency, level, "acceleration_distortion") or 0.0)
            > DISTORTION_LIMIT
        ),
    )
    phase = _compute_measure(scene, frequency, 5.0, "slip_start_phase")
    return {
        "rung": rung,
        "frequency": frequency,
        "onset": ONSETS[place] if place < len(ONSETS) else None,
        "runaway": runaway(question, values, frequency),
        "slip_phase": None if phase is None else float(np.degrees(phase)),
    }


def main(shown=SHOWN_MODELS, frequencies=FREQUENCIES) -> list:
    """Print and return a `row` for each model and frequency."""
    known = {
        (load["rung"], load["reading"]): load
        for load in json.loads((FOLDER / "scores.json").read_text("utf-8"))
        if load["protocol"] == "143" and not load["placebo"]
    }
    out = []
    for rung, reading in shown:
        for frequency in frequencies:
            out.append(row(rung, reading, known[rung, reading]["values"], frequency))
            onset, away, phase = (out[-1][name] for name in ("onset", "runaway", "slip_phase"))
            print(
                f"| {rung} | {frequency:.0f} Hz | {onset} g | {'none' if away is None else f'{away} g'} | "
                f"{'-' if phase is None else f'{phase:.0f}°'} |",
                flush=True,
            )
    return out


if __name__ == "__main__":
    run_study(main)
