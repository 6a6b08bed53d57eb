"""Random rigs of every law, drive and structure, against an independent program or finer settings of the package.

Campaigns `rigs` and `harmonic` of `campaigns`. `motion_reference` is the independent program. Where
it lacks the equations of a rig, the reference is the exact engine of patchfem, more cells of the
law, more harmonics, or many more steps. Only the public names of the package are used.
"""

import json
from pathlib import Path
from time import process_time
from typing import NamedTuple

import numpy as np
from campaigns import Row, measure_rows, strip_number
from motion_read import compute_measures, compute_works
from motion_reference import Motion, TooManySteps
from motion_scenes import draw_spec, write_scene
from motion_steady import find_periodic_state

import patchfem as pf

FINER = 16  # Ratio of the steps of the reference run to those of the run.
# Ratio of the uncertainty of the finer run to the change at the last halving of the steps.
HALVING_FACTOR = 5.0
MAX_STEPS = 12000  # Maximum number of steps of DOP853, which take about six seconds.
# Longest step relative to the shortest period, and relative tolerance of a step.
ROUGH = (0.04, 1e-10)
FINE = (0.025, 1e-12)  # The same for the second integration.
PATCH_MEASURES = {  # Measures of the static patch, whose reference would be the same program.
    "contact_fraction", "contact_half_width", "pressure_peak", "pressure_centre", "approach", "rotation", "moment",
    "normal_stiffness", "tangential_stiffness",
}  # fmt: skip
LEFT_OUT = PATCH_MEASURES | {
    "energy_balance", "work_check", "normal_load", "energy_created",
    "relative_displacement_amplitude_steady",
}  # fmt: skip


class ReferenceValues(NamedTuple):
    """Reference values and their uncertainties by name, and the kind of reference."""

    values: dict
    doubts: dict
    kind: str


def has_reference(s: dict) -> bool:
    """Return whether the independent program has the equations of a rig."""
    if s["law"] == "order" or "load_amplitude" in s or (s["patch"] or {}).get("shear"):
        return False
    return not ((s["law"] == "convolution" and s["patch"]) or (s["several"] and s["law"] == "iwan"))


def compute_reference(s: dict, path: Path, run: dict) -> ReferenceValues:
    """Compute the reference of a rig whose scene is a file; `run` is the result of `run_rig`."""
    if has_reference(s):
        try:
            if s.get("method") == "harmonic":
                return solve_steady_reference(s, run["period"], run["kept"])
            return integrate_reference(s, run)
        except TooManySteps:
            pass
    return run_finer_reference(s, path, run)


def integrate_reference(s: dict, run: dict) -> ReferenceValues:
    """Integrate a rig with the independent program; a second, more accurate integration gives the uncertainty."""
    runs = []
    for step, rtol in (ROUGH,) if run["engine"] == "march" else (ROUGH, FINE):
        motion = Motion(s, step)
        stretches = motion.run(run["cycles"] * run["period"], rtol, max_steps=MAX_STEPS)
        runs.append(
            compute_measures(motion, stretches, run["period"], run["cycles"], run["window"])
        )
    return ReferenceValues(runs[-1], estimate_uncertainties(*runs), "reference")


def solve_steady_reference(s: dict, period: float, kept: int) -> ReferenceValues:
    """Compute a steady motion with the independent program: its periodic state, or the end of a long run.

    `period` in seconds; `kept` is the number of cycles over which works are summed.
    """
    motion = Motion(s)
    start = find_periodic_state(motion, period)
    if start is not None:
        stretches = motion.run(kept * period, 1e-11, start)
        values = compute_measures(motion, stretches, period, kept, 1) | compute_works(
            motion, stretches, 0.0, kept * period
        )
        return ReferenceValues(values, {}, "reference")
    motion = Motion(s)
    steps_per_cycle = 25 * max(1.0, motion.plant.fastest / s["frequency"])
    cycles = next((k for k in (320, 160, 80) if k * steps_per_cycle < MAX_STEPS), 40)
    stretches = motion.run(cycles * period, 1e-10, max_steps=MAX_STEPS)
    runs = []
    for count in (cycles // 4, cycles // 2, cycles - 3, cycles - 2, cycles - 1, cycles):
        end = count * period
        runs.append(
            compute_measures(motion, stretches, period, count, 1)
            | compute_works(motion, stretches, end - kept * period, end)
        )
    last = runs[-1]
    changes = [
        estimate_remaining_transient(*runs[:2], last),
        *(absolute_differences(last, one) for one in runs[2:-1]),
    ]
    doubts = {name: max(one.get(name, 0.0) for one in changes) for name in last}
    return ReferenceValues(last, estimate_uncertainties(last) | doubts, "reference")


def estimate_remaining_transient(quarter: dict, half: dict, whole: dict) -> dict:
    """Estimate the remaining transient from the values after a quarter, half and all of a run.

    If the decay over a quarter is r, the ratio of the two changes is r (1 + r), and r^2/(1 - r^2)
    of the last change remains.
    """
    out = absolute_differences(whole, half)
    first_changes = absolute_differences(half, quarter)
    for name, last_change in out.items():
        rate = min(
            (np.sqrt(1 + 4 * last_change / max(first_changes.get(name, last_change), 1e-300)) - 1)
            / 2,
            0.99,
        )
        out[name] = last_change * max(1.0, 2 * rate**2 / (1 - rate**2))
    return out


def run_finer_reference(s: dict, path: Path, run: dict) -> ReferenceValues:
    """Compute a rig with patchfem itself: exactly if it was marched, else with many more steps, cells or harmonics."""
    tight = {"accuracy.tolerance": f"{s['tolerance'] / 10:g}"}
    if run["map"] == "yields":
        return ReferenceValues(run_values(path, tight), {}, "cells")
    if s.get("method") == "harmonic":
        found = pf.run(path, **tight, **{"accuracy.harmonics": "129"}).measures
        known = {name: measure for name, measure in found.items() if measure.value is not None}
        values = {name: measure.value for name, measure in known.items()}
        return ReferenceValues(
            values, {name: measure.error or 0.0 for name, measure in known.items()}, "harmonics"
        )
    if run["engine"] == "march":
        try:
            return ReferenceValues(
                run_values(path, tight | {"accuracy.method": "exact"}), {}, "pieces"
            )
        except pf.PatchfemError:  # No exact engine has the equations.
            pass
    steps = run["steps"] or 400
    coarse, fine = (
        run_values(
            path,
            tight | {"accuracy.method": "march", "accuracy.steps_per_cycle": f"{factor * steps}"},
        )
        for factor in (FINER // 2, FINER)
    )
    return ReferenceValues(
        fine,
        {
            name: HALVING_FACTOR * change
            for name, change in absolute_differences(fine, coarse).items()
        },
        "finer",
    )


def estimate_uncertainties(rough: dict, fine: dict | None = None) -> dict:
    """Estimate the uncertainties of the independent program from one run, or from two of different accuracy.

    A drift is a difference of means of the motion, so its uncertainty is a fraction of the
    amplitude.
    """
    out = {} if fine is None else absolute_differences(fine, rough)
    relative = 1e-9 if fine is None else 1e-14
    drift = out.get("drift_per_cycle", 0.0) + relative * rough["relative_displacement_amplitude"]
    return out | {"drift_per_cycle": drift}


def run_values(path: Path, sets: dict) -> dict:
    """Run a scene with some keys set and return the values of its measures."""
    return {
        name: measure.value
        for name, measure in pf.run(path, **sets).measures.items()
        if measure.value is not None
    }


def absolute_differences(fine: dict, coarse: dict) -> dict:
    """Return the absolute difference of each measure that both runs have."""
    return {
        name: Row(name, fine[name], 0.0, 0.0, coarse[name], 0.0).true_error
        for name in fine.keys() & coarse.keys()
    }


def run_rig(path: Path) -> dict:
    """Run a scene with the program; return figures of the run, and its measures under "measures"."""
    started = process_time()
    try:
        result = pf.run(path)
    except pf.PatchfemError as error:
        return {"refused": str(error)}
    seconds = process_time() - started
    rig = pf.build(path).rig
    summary = json.loads((result.save(path.with_suffix("")) / "summary.json").read_text("utf-8"))
    numerics = summary["numerics"]
    time = result.to_xarray().time
    return {
        "outcome": summary["outcome"],
        "engine": numerics["engine"],
        "map": numerics.get("map"),
        "steps": numerics.get("steps_per_cycle"),
        "seconds": seconds,
        "warnings": summary["warnings"],
        "period": rig.drive.signal.period,
        "cycles": rig.drive.cycles,
        "window": numerics["window_cycles"],
        "kept": round(
            float(time[-1] - time[0]) / rig.drive.signal.period
        ),  # Number of cycles in the result of a steady motion.
        "measures": result.measures,
    }


def compare_spec(s: dict, folder: Path, earlier: dict | None = None) -> dict:
    """Compare a rig with its reference; the reference of an earlier line is used if the cycles are the same."""
    path = write_scene(s, folder)
    line = {"group": f"{s['law']}, {s['drive']}", "rows": []} | run_rig(path)
    measures_found = line.pop("measures", None)
    if measures_found is None or line["outcome"] in ("grows", "not_converged"):
        return line
    if (
        earlier
        and "true" in earlier
        and all(earlier[key] == line[key] for key in ("cycles", "window", "kept"))
    ):
        truth = ReferenceValues(earlier["true"], earlier["doubt"], earlier["truth"])
    else:
        truth = compute_reference(s, path, line)
    names = {name for name in truth.values if strip_number(name) not in LEFT_OUT}
    rows = measure_rows(measures_found, truth.values, truth.doubts, names)
    return line | {"true": truth.values, "doubt": truth.doubts, "truth": truth.kind, "rows": rows}


def compare_rig(seed: int, folder: Path, earlier: dict | None = None) -> dict:
    """Compare the rig of a seed with its reference; see `campaigns`."""
    return compare_spec(draw_spec(seed), folder, earlier)


def compare_harmonic_rig(seed: int, folder: Path, earlier: dict | None = None) -> dict | None:
    """Compare the rig of a seed if its scene names harmonic balance, else return None; see `campaigns`."""
    s = draw_spec(seed)
    return compare_spec(s, folder, earlier) if s.get("method") == "harmonic" else None


def compare_marched_rig(seed: int, folder: Path, earlier: dict | None = None) -> dict | None:
    """Compare the rig of a seed in time steps, unless its scene names a method."""
    s = draw_spec(seed)
    return None if s.get("method") else compare_spec(s | {"method": "march"}, folder, earlier)
