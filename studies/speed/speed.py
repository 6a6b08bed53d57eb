"""How long do a first run, a step and a case take, beside the arithmetic of a step and another program?

The answer is the table "The speeds" of README.md beside this file, which `--write` renews. All times are CPU seconds of
one thread.

- First run: CPU time of `patchfem run` with an empty cache, minus that of a second run. The difference is compiling, and
  in scenes of a patch also the condensation of the pieces. The median over all scenes is that of the templates and the
  scenes of the studies that need no further key.
- Step: time of the event-driven engine divided by its number of steps, for a block on a spring (m = k = 1) that is shaken
  at its natural frequency, with one law each. The bound is the arithmetic of such a step (16 stages of DOP853, error,
  coefficients of the dense output) with one friction force per stage, as straight-line compiled code. It has no
  events, measures or integrals.
- Cases: random blocks under 200 cycles with a tolerance of 1e-3. Friction is evenly distributed from .15 to 1.1 of the
  drive force: a tenth of the blocks sticks (over 1), a tenth has micro-slip (.9 to 1). The time is that of `pf.sweep`
  with all measures, errors and the sentence of the sweep, after another sweep compiled. In the fraction of
  cases given, the error of every main measure is within the tolerance, to which runs are refined; measures of a
  scene without main ones all count. Static patches include the mesh.
- DOP853: a block with Coulomb friction over 60 cycles by SciPy's DOP853 with events, at the first of its tolerances
  1e-4, 1e-5, ... whose true error is not larger than that of the event-driven engine.

Run: OMP_NUM_THREADS=1 python studies/speed/speed.py [--share 0.1] [--beside CHECKOUT] [--write]      (17 CPU minutes)
"""

import argparse
import json
import math
import os
import resource
import subprocess
import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numba
import numpy as np
from scipy.integrate import DOP853

sys.path.insert(0, str(Path(__file__).parents[1] / "integrators"))
from engine_problems import event_driven, problem
from engines import dop853
from measuring import measure_seconds, run
from rig_texts import STUDIES

import patchfem as pf
from patchfem.event_driven import cases as engine_cases
from patchfem.event_driven.runs import run_case
from patchfem.runs import choose_numerics
from patchfem.runs.refine import is_main
from patchfem.runs.rig.joints import make_joints

PAGE = Path(__file__).with_name("README.md")
N_REPEATS = 3  # measurements of which the median is taken
N_WARM = 64  # cases that compile and import before the measured ones
STEP_CYCLES = 2000  # cycles over which the steps of the engine are timed: .1 s
N_BOUND_STEPS = 200_000  # steps that are timed for the bound
# first heading and further headings of the table of each kind of measurement
HEADINGS = {
    "first": ("first run of", "compiling [CPU s]", "second run [CPU s]"),
    "scenes": ("first run of every shipped scene", "compiling [CPU s]", "second run [CPU s]"),
    "step": ("step of the engine, law", "us per step", "least us of its operations"),
    "cases": ("sweep", "cases per CPU s", "within the tolerance [%]"),
    "peer": ("one run", "time [ms]", "DOP853 with events [ms]"),
}

BLOCK = f"""[normal]
load = "1 N"
[friction]
LAW
static = 0.5
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "block"
frequency = "{1 / (2 * np.pi)!r} Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
acceleration = "1 m/s^2"
frequency = "{1 / (2 * np.pi)!r} Hz"
cycles = 200
[accuracy]
tolerance = 1e-3
"""


class Law(NamedTuple):
    """Friction law of a block.

    Contains the lines of the scene, the number of cases of its sweep, their random keys with ranges, and for the bound
    the force and the rate of the state z ("" if there is none) as terms in q{i}, v{i}, z{i}.
    """

    lines: str
    n_cases: int
    ranges: dict
    force: str
    rate: str = ""


# from 1 on the block sticks, from .9 to 1 it has micro-slip
BLOCKS = {"friction.static": "0.15..1.1", "structure.mode.block.damping": "0.003..0.1"}
LENGTHS = BLOCKS | {"friction.bond_length": "3 mm..100 mm"}
STIFF = BLOCKS | {"friction.stiffness": "3 N/m..300 N/m"}
# stiffer contacts of two laws take seconds each, since they are not integrated together
SOFT = BLOCKS | {"friction.stiffness": "3 N/m..30 N/m"}
SPEEDS = BLOCKS | {"friction.reference_speed": "0.01 m/s..1 m/s"}
SPRING = "50.0*q{i}"  # elements are one spring between two events
LAWS = {
    "coulomb": Law("", 2000, BLOCKS, "0.5"),
    "elastic-plastic": Law('bond_length = "10 mm"', 1000, LENGTHS, SPRING),
    "iwan": Law('stiffness = "10 N/m"\nchi = -0.5\nbeta = 0.5', 1000, STIFF, SPRING),
    "tanh": Law('reference_speed = "0.1 m/s"', 1000, SPEEDS, "0.5*tanh(10.0*v{i})"),
    "nonlocal": Law('bond_length = "10 mm"', 1000, LENGTHS, SPRING),
    "bouc-wen": Law(
        'stiffness = "10 N/m"', 256, SOFT, "0.5*z{i}", "20.0*(v{i}-abs(v{i}*z{i})*z{i})"
    ),
    "lugre": Law(
        'stiffness = "10 N/m"\nstribeck_speed = "0.1 m/s"',
        256,
        SOFT,
        "10.0*z{i}",
        "v{i}-10.0*abs(v{i})*z{i}/(0.4+0.1*exp(-100.0*v{i}*v{i}))",
    ),
}
PIECES = (STUDIES / "rig/pieces.toml").read_text("utf-8")
RIG = (STUDIES / "rig/rig.toml").read_text("utf-8").partition("[measured]")[0]
LOADS = {"contact.load": "10 N..1000 N"}
SHAPES = {"contact.tilt.angle": "1e-6 rad..1e-3 rad", "contact.crown.radius": "1 m..100 m"}
# scene, number of cases, and random keys with ranges
SWEEPS = {
    name: (BLOCK.replace("LAW", f'law = "{name}"\n{law.lines}'), law.n_cases, law.ranges)
    for name, law in LAWS.items()
} | {
    "static patch, load": (PIECES, 1000, LOADS),
    "static patch, load, 10 000 cases": (PIECES, 10_000, LOADS),
    "static patch, load, tilt, crown": (PIECES, 100, LOADS | SHAPES),
    "shipped rig, load": (RIG, 64, {"contact.load": "90 N..130 N"}),
}
KINDS = ("linear", "bench", "joint", "wear")
FIRST_RUNS = {kind: pf.new(kind) for kind in KINDS} | {
    "Coulomb": SWEEPS["coulomb"][0],
    "shipped rig": RIG,
    "static patch": PIECES,
}


class Row(NamedTuple):
    """Row of the table: kind of measurement, name of the case, measured value, value to compare it with."""

    kind: str
    name: str
    value: float
    other: float


# ---- first runs


def measure_two_runs(scene: Path, work: str) -> list[float]:
    """Return the CPU seconds of a first and of a second run of a scene, in processes of their own; [] if it is refused."""
    seconds = []
    command = [sys.executable, "-m", "patchfem", "run", scene, "-q", "-o", f"{work}/out"]
    for _ in range(2):
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        environment = os.environ | {"PATCHFEM_CACHE": f"{work}/cache"}
        done = subprocess.run(command, cwd=work, env=environment, stderr=subprocess.DEVNULL)
        if done.returncode:
            return []
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds.append(after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime)
    return seconds


def measure_first_run(name: str, folder: Path) -> Row:
    """Measure the first and the second run of a scene of FIRST_RUNS below a folder."""
    with TemporaryDirectory(dir=folder) as work:
        scene = Path(work, "scene.toml")
        scene.write_text(FIRST_RUNS[name], "utf-8")
        first, second = measure_two_runs(scene, work)
    return Row("first", name, first - second, second)


def measure_all_scenes(name: str, folder: Path, share: float) -> Row:
    """Measure the first and the second run of every shipped scene below a folder, and return their median.

    Parameters
    ----------
    name : str
        Name of the row.
    folder : Path
        Folder for the runs.
    share : float
        Number of scenes / that of all shipped scenes.
    """
    templates = Path(pf.__file__).with_name("scene") / "templates"
    scenes = sorted([*templates.glob("*.toml"), *STUDIES.glob("*/*.toml")])
    rows = []
    for scene in scenes[:: max(1, round(1 / share))]:
        with TemporaryDirectory(dir=folder) as work:
            if seconds := measure_two_runs(scene, work):
                rows.append((seconds[0] - seconds[1], seconds[1]))
                print(
                    f"{scene.parent.name}/{scene.name}: first run {seconds[0]:.2f} CPU s",
                    flush=True,
                )
    print(f"compiling at most {max(rows)[0]:.2f} CPU s in {len(rows)} scenes")
    return Row("scenes", name, *map(float, np.median(rows, axis=0)))


# ---- a step and its bound


def combine(weights, name: str) -> str:
    """Return the source of the sum of weights times the variables name0, name1, ..."""
    terms = [f"{float(weight)!r}*{name}{j}" for j, weight in enumerate(weights) if weight]
    return "+".join(terms) or "0.0"


def compile_steps(law: Law):
    """Return a compiled function that takes `n` steps of length `h` with the arithmetic of DOP853 and returns q.

    The block has mass, stiffness and frequency 1 and a damping ratio of .005. The sine of the drive is a product of two
    rotations, so that a stage costs no sine.
    """
    states = "qvz" if law.rate else "qv"
    lines = []
    # The stages, of which number 12 is the end of the step and those after it serve the dense output.
    for i, weights in enumerate((*DOP853.A, DOP853.B, *DOP853.A_EXTRA)):
        lines += [f"{state}{i}={state}+h*({combine(weights[:i], 'd' + state)})" for state in states]
        lines.append(f"dq{i}=v{i}; dz{i}={law.rate.format(i=i) or 0.0}")
        lines.append(f"dv{i}=s*c[{i}]+r*w[{i}]-0.01*v{i}-q{i}-({law.force.format(i=i)})")
    # Both error estimates and the dense output of each state; the sum keeps the compiler from dropping them.
    for state in states:
        for weights in (DOP853.E3, DOP853.E5):
            lines.append(f"e=h*({combine(weights, 'd' + state)}); total+=e*e")
        lines += [f"total+=abs({combine(weights, 'd' + state)})" for weights in DOP853.D]
    lines += [f"{state}={state}12" for state in states]
    lines.append("s, r = s*c[12]+r*w[12], r*c[12]-s*w[12]")
    body = "\n  ".join(lines)
    source = f"def run(n, h, c, w):\n q=v=z=s=total=0.0; r=1.0\n for _ in range(n):\n  {body}\n return q, total"
    space = dict(vars(math))
    exec(source, space)
    return numba.njit(error_model="numpy", fastmath={"reassoc", "contract", "arcp"})(space["run"])


def measure_bound(law: Law) -> float:
    """Return the time of the arithmetic of a step [us]."""
    h = 2 * np.pi / engine_cases.MIN_STEPS
    nodes = np.r_[DOP853.C[:12], 1.0, DOP853.C_EXTRA] * h
    work = partial(compile_steps(law), N_BOUND_STEPS, h, np.cos(nodes), np.sin(nodes))
    return 1e6 * measure_median(work) / N_BOUND_STEPS


def measure_median(work) -> float:
    """Return the median CPU seconds of work(), which is called once before."""
    work()
    return float(np.median([measure_seconds(work)[1] for _ in range(N_REPEATS)]))


def measure_step(name: str) -> Row:
    """Measure a step of the event-driven engine with a law, and its bound [us]."""
    model = pf.build(SWEEPS[name][0])
    joints = make_joints(model, choose_numerics(model), None).laws
    case = engine_cases.make_rig_case(model.rig, joints, engine_cases.Schedule(STEP_CYCLES, 1, ()))
    seconds = measure_median(lambda: run_case(case))
    return Row("step", name, 1e6 * seconds / run_case(case).n_steps, measure_bound(LAWS[name]))


# ---- sweeps


def measure_sweep(name: str, share: float, seed: int = 1) -> Row:
    """Measure the cases per CPU second, as the median of sweeps with different cases.

    Parameters
    ----------
    name : str
        Key of SWEEPS.
    share : float
        Number of cases / default number.
    seed : int
        Seed of the random numbers of the first sweep.
    """
    text, n_cases, ranges = SWEEPS[name]
    n_cases = max(8, int(share * n_cases))
    sweep = partial(pf.sweep, text, ranges)
    sweep(draw=min(n_cases, N_WARM), seed=seed + 1000)
    seconds = []
    fractions = []
    for number in range(N_REPEATS):
        data, took = measure_seconds(partial(sweep, draw=n_cases, seed=seed + number))
        seconds.append(took)

        # A case meets the tolerance if each of its main measures does, or each measure if none is a main one.
        misses = []
        measures = [key for key in data if f"{key}_error" in data]
        for measure in list(filter(is_main, measures)) or measures:
            allowed = data.tolerance * abs(data[measure]) + data.get(f"{measure}_floor", 0.0)
            misses.append(data[f"{measure}_error"] > allowed)
        fractions.append(100 * np.mean(~np.any(misses, 0)))
    return Row("cases", name, n_cases / float(np.median(seconds)), float(np.mean(fractions)))


# ---- SciPy


def measure_dop853() -> Row:
    """Measure a run of the event-driven engine and one of DOP853 whose error is not larger."""
    block = problem("block")
    error = block.error(event_driven(block, engine_cases.DEFAULT_RTOL))
    tolerances = (10.0**-digits for digits in range(4, 14))
    tolerance = next(rtol for rtol in tolerances if block.error(dop853(block, rtol)) <= error)
    ours = measure_median(lambda: event_driven(block, engine_cases.DEFAULT_RTOL))
    theirs = measure_median(lambda: dop853(block, tolerance))
    return Row("peer", f"block, error {error:.0e}", 1e3 * ours, 1e3 * theirs)


# ---- the table


format_number = partial(np.format_float_positional, precision=3, fractional=False, trim="-")


def format_tables(rows: list[Row], earlier: dict[str, float], share: float) -> str:
    """Return the rows as Markdown tables, with a column of the earlier values by kind and name if there are any.

    Parameters
    ----------
    rows : list of Row
        What was measured.
    earlier : dict of str to float
        Values of an earlier release by kind and name; {} without one.
    share : float
        Number of cases of the sweeps / default number. A share below 1 is stated, because a sweep of few cases computes
        fewer in a second.
    """
    part = f"; sweeps with {100 * share:.3g} % of their cases" * (share < 1)
    lines = [
        f"Measured with {pf.__version__} at a load average of {os.getloadavg()[1]:.1f} on "
        f"{os.cpu_count()} cores{part}."
    ]
    n_columns = 3 + bool(earlier)
    for kind, headings in HEADINGS.items():
        heading = " | ".join((*headings, "earlier release")[:n_columns])
        lines += ["", f"| {heading} |", "|---" * n_columns + "|"]
        for row in rows:
            if row.kind == kind:
                numbers = (row.value, row.other, earlier.get(f"{kind} {row.name}", np.nan))
                lines.append(
                    f"| {' | '.join([row.name, *map(format_number, numbers)][:n_columns])} |"
                )
    return "\n".join(lines)


def measure_beside(checkout: Path, folder: Path, share: float) -> dict[str, float]:
    """Return the values of an earlier release by kind and name, measured by this script with its package."""
    command = [sys.executable, __file__, "--out", folder, "--share", str(share)]
    subprocess.run(command, check=True, env=os.environ | {"PYTHONPATH": str(checkout)})
    rows = json.loads((folder / "speed.json").read_text("utf-8"))
    return {f"{kind} {name}": value for kind, name, value, _ in rows}


def main(
    out=Path("out/speed"), share: float = 1.0, beside=None, *, write: bool = False
) -> list[Row]:
    """Measure everything, print the tables, write them into a folder, and return the rows.

    Parameters
    ----------
    out : Path
        Folder that gets speed.md, speed.json and the runs of the scenes.
    share : float
        Number of cases of the sweeps / default number.
    beside : Path, optional
        Checkout of an earlier release, which is measured too.
    write : bool
        Whether to copy the tables into README.md beside this file.
    """
    folder = out.resolve()
    folder.mkdir(parents=True, exist_ok=True)
    works = [partial(measure_first_run, name, folder) for name in FIRST_RUNS]
    works += [partial(measure_all_scenes, "median", folder, share)]
    works += [partial(measure_step, name) for name in LAWS]
    works += [partial(measure_sweep, name, share) for name in SWEEPS]
    rows = []
    for work in (*works, measure_dop853):
        rows.append(work())
        print(f"{len(rows)} of {len(works) + 1}:", *rows[-1], flush=True)
    (folder / "speed.json").write_text(json.dumps(rows), "utf-8")

    earlier = measure_beside(beside.resolve(), folder / "earlier", share) if beside else {}
    tables = format_tables(rows, earlier, share)
    (folder / "speed.md").write_text(tables, "utf-8")
    print(tables)
    if write:
        page = PAGE.read_text("utf-8")
        start = page.partition("<!-- speeds -->")[0]
        end = page.partition("<!-- end -->")[2]
        PAGE.write_text(f"{start}<!-- speeds -->\n{tables}\n<!-- end -->{end}", "utf-8")
    return rows


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("out/speed"), help="folder for results")
    parser.add_argument("--share", type=float, default=1.0, help="fraction of the cases of sweeps")
    parser.add_argument("--beside", type=Path, help="checkout of an earlier release to compare")
    parser.add_argument("--write", action="store_true", help="renew the tables of README.md")
    options = parser.parse_args()
    raise SystemExit(run(lambda: main(**vars(options))))
