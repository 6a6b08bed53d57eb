"""How many friction cases does a second of one processor answer, and to what error?

Together 1913 cases, with errors; their amplitudes are wrong by 2.4e-6 in the middle and 6.2e-6 rms, and none of 2000
lies outside its error. One by one from event to event, with a step tolerance of 1e-12, 27 cases. The two cores had little
else to do.

An earlier run compares with other ways, while both cores did much else: together 970 cases and one by one 12; a loop of
thirty lines 14 300, 5930, 2890 and 1530 at 100 to 800 steps a cycle, wrong by 4.6e-5 to 6.3e-8 in the middle and 4.5e-3
to 7.8e-5 rms; DOP853 1.6.

Random blocks on a spring (m = k = 1, damping ratio .003 to .1, friction .1 to .9 of the push) under 200 cycles of a
base acceleration at their own frequency, from rest; the amplitude in the last cycle beside that of method "exact".
The marched cases and method "exact" are timed from the values of the keys to columns of some 20 measures with
error bars; the loop of thirty lines (this file of version 1.10) gives an amplitude alone, and no error; SciPy's DOP853 went
from event to event, in Python, no step longer than an eighth of a cycle, on the first three of the same cases (this file at
be63a014). CPU seconds of one thread, compiled code made before.

Run: python studies/speed/cases_per_second.py            (2000 cases)
     python studies/speed/cases_per_second.py --laws     (whole sweeps of all laws and of patches)
     python studies/speed/cases_per_second.py --full     (10 000 cases)
"""

import sys
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "common"))
from measuring import measure_seconds, run
from rig_texts import TEXTS

from patchfem.campaigns import Cases, SweepScene
from patchfem.campaigns.sweeps.executors import LocalExecutor
from patchfem.campaigns.sweeps.sweep import WorkerData, iterate_chunks
from patchfem.campaigns.sweeps.sweep_table import SweepTable
from patchfem.scene import loads, make_axis

CYCLES = 200  # cycles of a run
N_WARM = 64  # cases that compile and import before the measured ones
AMPLITUDE = "relative_displacement_amplitude"
SCENE = f"""[normal]
load = "1 N"
[friction]
law = "coulomb"
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
cycles = {CYCLES}
[accuracy]
tolerance = 1e-3
"""


def draw_blocks(count: int) -> np.ndarray:
    """Return the ratio of friction to force and the damping ratio (count, 2) of random blocks."""
    r = np.random.default_rng(1)
    return np.stack([r.uniform(0.1, 0.9, count), 10 ** r.uniform(np.log10(0.003), -1, count)], 1)


def compute(sweep_scene: SweepScene, cases: Cases) -> SweepTable:
    """Compute the cases in this process, and return their table."""
    table = SweepTable.blank(cases, None)
    work = WorkerData(sweep_scene, cases)
    for numbers, results, *_ in iterate_chunks(work, range(len(cases)), LocalExecutor(), None):
        table.insert(numbers, results)
    return table


def by_patchfem(cases: np.ndarray, text: str = SCENE):
    """Compute the results of the cases from the values of their keys in this process; many cases are marched together."""
    axes = [
        make_axis(key, map(repr, column), distinct=False)
        for key, column in zip(
            ("friction.static", "structure.mode.block.damping"), cases.T.tolist()
        )
    ]
    return compute(SweepScene(Path("block.toml"), text), Cases(tuple(axes), True))


def by_exact(cases: np.ndarray):
    """Compute the results from event to event with a step tolerance of 1e-12, case by case."""
    return by_patchfem(cases, SCENE + 'method = "exact"\n')


def row(name: str, knob: str, seconds: float, amplitudes, exact) -> dict:
    """Return cases per CPU second, and median and rms of the error of the amplitude relative to the exact one."""
    error = np.abs(np.asarray(amplitudes) / exact - 1)
    out = {
        "way": name,
        "knob": knob,
        "rate": len(error) / seconds,
        "median": float(np.median(error)),
        "rms": float(np.sqrt(np.mean(error**2))),
    }
    print(
        f"{name:28} {knob:>8}  {out['rate']:10.4g} cases/s   error {out['median']:.1e} (rms {out['rms']:.1e})",
        flush=True,
    )
    return out


def _block(law: str) -> str:
    """Return the block of a family of cases with a law."""
    return SCENE.replace('law = "coulomb"\nstatic = 0.5', f"{law}\nstatic = 0.5")


def _log(low: float, high: float):
    return lambda r, n: 10 ** r.uniform(np.log10(low), np.log10(high), n)


def _even(low: float, high: float):
    return lambda r, n: r.uniform(low, high, n)


PIECES = """[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.1 mrad"
"""
JOINT = (
    PIECES
    + "[contact.shear]\n"
    + TEXTS["Coulomb"].partition('load = "26 lbf"\n')[2].replace("600", "200")
)
RIG = Path(__file__).parents[1] / "rig/rig.toml"
BLOCK = {"friction.static": _even(0.1, 0.9), "structure.mode.block.damping": _log(0.003, 0.1)}
# stiffer contacts of LuGre's law take seconds each, since they are not integrated together
SOFT = BLOCK | {"friction.stiffness": _log(3, 30)}
STIFF = BLOCK | {"friction.stiffness": _log(3, 300)}
LENGTHS = BLOCK | {"friction.bond_length": _log(3e-3, 0.1)}
UNITS = {
    "friction.stiffness": "N/m",
    "friction.bond_length": "m",
    "friction.reference_speed": "m/s",
    "drive.acceleration": "m/s^2",
    "contact.tilt.angle": "rad",
    "contact.load": "N",
}
# {family: (scene, number of cases, distributions of the random keys in SI units)}
FAMILIES = {
    "coulomb": (_block('law = "coulomb"'), 2000, BLOCK),
    "elastic-plastic": (_block('law = "elastic-plastic"\nbond_length = "10 mm"'), 1000, LENGTHS),
    "iwan": (_block('law = "iwan"\nstiffness = "10 N/m"\nchi = -0.5\nbeta = 0.5'), 1000, STIFF),
    "tanh": (
        _block('law = "tanh"\nreference_speed = "0.1 m/s"'),
        1000,
        BLOCK | {"friction.reference_speed": _log(0.01, 1)},
    ),
    "nonlocal": (_block('law = "nonlocal"\nbond_length = "10 mm"'), 1000, LENGTHS),
    "bouc-wen": (_block('law = "bouc-wen"\nstiffness = "10 N/m"'), 256, SOFT),
    "lugre": (_block('law = "lugre"\nstiffness = "10 N/m"\nstribeck_speed = "0.1 m/s"'), 256, SOFT),
    "patch, coulomb: level x friction": (
        JOINT,
        256,
        {"drive.acceleration": _log(1, 200), "friction.static": _even(0.1, 0.6)},
    ),
    "patch, coulomb: tilt x friction": (
        JOINT,
        256,
        {"contact.tilt.angle": _log(1e-6, 5e-4), "friction.static": _even(0.1, 0.6)},
    ),
    "shipped rig: tilt x friction": (
        RIG.read_text("utf-8"),
        64,
        {"contact.tilt.angle": _log(1e-6, 5e-4), "friction.static": _even(0.1, 0.6)},
    ),
    "static: load x tilt": (
        PIECES,
        2000,
        {"contact.load": _log(10, 1000), "contact.tilt.angle": _log(1e-6, 1e-3)},
    ),
}


def _answer_family(name: str, count: int, seed: int):
    """Compute the results of random cases of a family, from the values of their keys."""
    text, _, keys = FAMILIES[name]
    r = np.random.default_rng(seed)
    axes = [
        make_axis(
            key,
            [f"{one!r} {UNITS.get(key, '')}".strip() for one in draw(r, count).tolist()],
            distinct=False,
        )
        for key, draw in keys.items()
    ]
    return compute(SweepScene(RIG, text), Cases(tuple(axes), True))


def families(seed: int = 1, names=tuple(FAMILIES), goes: int = 3, share: float = 1.0) -> list[dict]:
    """Measure the cases per CPU second of every family, as the median of several sweeps with different cases.

    A small sweep before them compiles and imports. The fraction of cases is given whose amplitude (or peak pressure) has
    an error within the tolerance of the scene.

    Parameters
    ----------
    seed : int
    names : sequence of str
    goes : int
        Number of sweeps.
    share : float
        Number of cases / default number.
    """
    rows = []
    for name in names:
        count = max(8, int(FAMILIES[name][1] * share))
        _answer_family(name, min(count, 64), seed + 1000)
        took = []
        good = []
        tolerance = loads(FAMILIES[name][0], RIG).accuracy.tolerance
        for go in range(goes):
            found, seconds = measure_seconds(partial(_answer_family, name, count, seed + go))
            measure = AMPLITUDE if AMPLITUDE in found.measures else "pressure_peak"
            column = found.measures[measure]
            allowed = tolerance * np.abs(column.values) + column.floors
            good.append(np.mean(column.errors <= allowed))
            took.append(seconds)
        rows.append(
            {
                "family": name,
                "cases": count,
                "rate": count / float(np.median(took)),
                "best": count / min(took),
                "known": float(np.mean(good)),
            }
        )
        print(
            f"{name:34} {count:6} cases  {rows[-1]['rate']:8.1f} a CPU s (best {rows[-1]['best']:8.1f})   "
            f"within the tolerance: {100 * rows[-1]['known']:.1f} %",
            flush=True,
        )
    return rows


def main(count: int = 2000) -> list[dict]:
    """Measure both ways, print them and return the rows."""
    cases = draw_blocks(count)
    for way in (by_patchfem, by_exact):
        way(cases[:N_WARM])
    found, seconds = measure_seconds(lambda: by_exact(cases))
    exact = found.measures[AMPLITUDE].values.copy()
    rows = [row("exact engine, one by one", "", seconds, exact, exact)]
    found, seconds = measure_seconds(lambda: by_patchfem(cases))
    amplitude = found.measures[AMPLITUDE]
    rows.append(row("together, with bars", "1e-3", seconds, amplitude.values, exact))
    miss = np.abs(amplitude.values - exact) > amplitude.errors + 1e-12 * exact
    rows[-1]["outside"] = int(miss.sum())
    print(f"  outside their bars: {miss.sum()} of {count}")
    return rows


if __name__ == "__main__":
    if "--laws" in sys.argv[1:]:
        raise SystemExit(run(lambda: families(*(int(one) for one in sys.argv[2:]))))
    raise SystemExit(run(lambda: main(10_000) if "--full" in sys.argv[1:] else main()))
