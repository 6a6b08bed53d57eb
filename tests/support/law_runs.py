"""Runs of a friction law in every kind of scene: bench, rig, release, fit."""

import csv

import numpy as np
from scene_texts import DRIVE, MODE

from patchfem.campaigns.fits.request import fit_measurement
from patchfem.campaigns.free_keys import parse_ranges
from patchfem.model import build
from patchfem.runs.bench import bench
from patchfem.runs.run import run
from patchfem.scene import load, loads

LOAD = 100.0  # Normal load of every interface [N].
POINT = '[normal]\nload = "100 N"\n'
SINE = '[slide]\nkind = "sine"\namplitude = "10 um"\nfrequency = "100 Hz"\ncycles = 2\n'


def friction_table(law: str) -> str:
    """Return the table [friction] with the keys `law`."""
    return "[friction]\n" + law


def run_bench_along_path(law: str, time, slide, *sets):
    """Return the BenchRun of a law along displacements (k,) [m] at equally spaced times (k,) [s]."""
    return bench.run_bench(
        build(loads(POINT + friction_table(law) + SINE, sets=sets)),
        None,
        4,
        path=(time, slide, 0, 0.0),
    )


def run_rig(law: str, *sets, cycles: int = 60, steps: int = 0):
    """Return the Result of one mode under a base sine at its resonance."""
    accuracy = f"[accuracy]\nsteps_per_cycle = {steps}\n" if steps else ""
    mode = MODE.replace("damping = 0.003", "damping = 0.02")
    return run(
        loads(
            POINT
            + friction_table(law)
            + mode
            + DRIVE.replace("cycles = 30", f"cycles = {cycles}")
            + accuracy,
            sets=sets,
        )
    )


def run_release(law: str, *sets):
    """Return the response of one mode that is released from a displacement of 60 um."""
    start = 'start.displacement = ["60 um"]\n'
    motion = '[drive]\nkind = "free"\ncycles = 3\n'
    return run(
        loads(
            POINT
            + friction_table(law)
            + MODE.replace("[structure]\n", "[structure]\n" + start)
            + motion,
            sets=sets,
        )
    ).response


def fit_law(folder, law: str, loop: tuple, free: str):
    """Return the fit of a law to the loop (time [s], displacement [m], force [N])."""
    path = folder / "scene.toml"
    path.write_text(POINT + friction_table(law) + SINE, "utf-8")
    with open(folder / "loop.csv", "w", newline="") as file:
        out = csv.writer(file)
        out.writerow(["time [s]", "displacement [m]", "force [N]"])
        out.writerows([repr(float(value)) for value in row] for row in zip(*loop))
    return fit_measurement(load(path), folder / "loop.csv", parse_ranges([free]))


def shrinking_sine(count: int = 400):
    """Return (time, displacement) of three cycles of a decreasing sine of 100 Hz, which leaves minor loops open."""
    time = np.arange(3 * count + 1) / count / 100
    return time, 10e-6 * (1 - 0.6 * time / time[-1]) * np.sin(2 * np.pi * 100 * time)
