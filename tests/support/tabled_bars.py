"""Patches of elements in lanes, against single runs and the exact batch: do the bars hold, and how many cases a second?

    python tests/support/tabled_bars.py [SEED [CASES [SINGLES]]]

Of each family of rigs CASES random cases are answered by `run_many` with and without lanes, in turn, from models that
do not yet share their meshes, and the first SINGLES by runs of their own on the shared mesh. Printed are the cases per
CPU second of both, the shares of measures and of cases within the sum of both bars, and the misses. Of benches it is
told how far SINGLES of a batch are from runs of their own. With `times` the cases per CPU second of all families are
printed, medians of three runs; benches are a quarter as many.

    python tests/support/tabled_bars.py times [SEED [CASES]]
"""

import sys
from collections import Counter
from time import process_time

import numpy as np
from lane_bars import held, rows

import patchfem as pf
from patchfem.api import base_of
from patchfem.runs.many import many, meshes, one_by_one
from patchfem.scene.sets import assignments

PATCH = """[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[contact.tilt]
angle = "0.1 mrad"
[contact.shear]
[friction]
law = "coulomb"
static = 0.30
[structure]
moving_mass = "0.884 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.003
slide = 1.0
[drive]
kind = "base"
frequency = "143 Hz"
acceleration = "5 g"
cycles = 200
[accuracy]
tolerance = 1e-3
"""
FRICTION = {"friction.static": lambda r: r.uniform(0.1, 0.6)}
FAMILIES = {
    "amplitude x friction": {"drive.acceleration": lambda r: 10 ** r.uniform(0, 2.3)} | FRICTION,
    "tilt x friction": {"contact.tilt.angle": lambda r: 10 ** r.uniform(-6, -3.3)} | FRICTION,
    "frequency x load": {"drive.frequency": lambda r: r.uniform(100, 200),
                         "contact.load": lambda r: 10 ** r.uniform(1.3, 2.5)}}
SLID = PATCH.split("[structure]")[0].replace('"coulomb"', '"elastic-plastic"\nbond_length = "1 um"') \
    + '[slide]\nkind = "sine"\namplitude = "3 um"\nfrequency = "10 Hz"\n[accuracy]\ntolerance = 1e-3\n'
BENCHES = {"bench: amplitude x friction": {"slide.amplitude": lambda r: 10 ** r.uniform(-6.5, -5)} | FRICTION,
           "bench: tilt x friction": {"contact.tilt.angle": lambda r: 10 ** r.uniform(-6, -3.3)} | FRICTION}


def drawn(family: str, seed: int, count: int) -> list:
    """Random models of a family."""
    r, base, keys = np.random.default_rng(seed), base_of(pf.load(SLID if family in BENCHES else PATCH)), \
        (FAMILIES | BENCHES)[family]
    sets = [{key: float(one(r)) for key, one in keys.items()} for _ in range(count)]
    return [pf.build(base.changed(assignments(one))) for one in sets]


def timed(models: list, lanes: bool) -> tuple:
    """(Answers of models, CPU seconds), with lanes or as before."""
    batches = many.BATCHES
    many.BATCHES = tuple(one for one in batches if lanes or one.name != "lumped.tabled")
    try:
        begin = process_time()
        return pf.run_many(models), process_time() - begin
    finally:
        many.BATCHES = batches


def printed(family: str, seed: int, count: int, singles: int) -> None:
    """Measure a family and print it."""
    models = drawn(family, seed, count)
    for lanes in (False, True):  # compiled code, and pieces that are kept on disk
        timed(models[:64], lanes)
    _, before = timed(models, False)
    found, after = timed(models, True)
    mine = [case for case in range(singles) if found.numerics.get(case, {}).get("engine") == "lanes"]
    shared = meshes.meshed(models)
    ones = one_by_one.solve([shared[case] for case in mine])
    pairs = rows(found.some(np.array(mine)), ones)
    measures = sum(map(len, pairs))
    misses = [(mine[case], row) for case, some in enumerate(pairs) for row in some if not held(row)]
    others = sum(found.outcome[case] != one for case, one in zip(mine, ones.outcome))
    wrong, by = len({case for case, _ in misses}), sum("steps_per_cycle" in one for one in found.numerics.values())
    print(f"{family}: {count / before:.1f} cases a CPU second before, {count / after:.1f} in lanes; {by} of {count} by "
          f"lanes; beside {len(mine)} single runs {100 * (1 - len(misses) / measures):.2f} % of {measures} measures "
          f"and {100 * (1 - wrong / len(mine)):.1f} % of cases within both bars, {others} other outcomes; "
          f"{dict(Counter(row[0] for _, row in misses))}", flush=True)
    for case, row in misses[:8]:
        print("   ", case, row[0], f"{row[1]:.6g} ± {row[2]:.2g}, single {row[3]:.6g} ± {row[4]:.2g}", flush=True)


def slid(family: str, seed: int, count: int, singles: int) -> None:
    """Print how far benches of a batch are from runs of their own at most, over their value and floor."""
    models = drawn(family, seed, count)
    found, ones = pf.run_many(models), one_by_one.solve(meshes.meshed(models)[:singles])
    gaps = [abs(column[case] - one[case]) / (abs(one[case]) + ones.floors[name][case])
            for name, one in ones.values.items() for column in (found.values[name],) for case in range(singles)
            if one[case] == one[case]]
    bars = [abs(found.errors[name][case] - one[case]) / (abs(ones.values[name][case]) + ones.floors[name][case])
            for name, one in ones.errors.items() for case in range(singles) if one[case] == one[case]]
    same = list(found.outcome[:singles]) == list(ones.outcome)
    print(f"{family}: {len(gaps)} measures of {singles} benches, apart by {max(gaps):.1e}, bars by {max(bars):.1e}, "
          f"{'the same' if same else 'other'} outcomes", flush=True)


def times(seed: int, count: int) -> None:
    """Print cases per CPU second, the median of three, of every family."""
    for family in (*FAMILIES, *BENCHES):
        models = drawn(family, seed, count if family in FAMILIES else count // 4)
        timed(models, True)
        rates = sorted(len(models) / timed(models, True)[1] for _ in range(3))
        print(f"{family}: {rates[1]:.1f} cases a CPU second, {rates[0]:.1f} to {rates[2]:.1f}", flush=True)


if __name__ == "__main__":
    if sys.argv[1:2] == ["times"]:
        asked = [int(one) for one in sys.argv[2:]]
        times(*(asked + [41001, 256][len(asked):]))
        sys.exit()
    asked = [int(one) for one in sys.argv[1:]]
    for name in BENCHES:
        slid(name, *(asked + [41001, 256, 100][len(asked):]))
    for name in FAMILIES:
        printed(name, *(asked + [41001, 256, 100][len(asked):]))
