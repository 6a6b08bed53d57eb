"""Cases of seven laws answered together, in lanes, against single runs of the exact engine: do the bars of both hold?

    python tests/support/lane_bars.py run FILE [--first SEED --chunks N --count CASES --singles CASES]
    python tests/support/lane_bars.py score FILE...

`run` adds a line to FILE for each law of each seed: CASES random cases by `run_many`, the first few of them by `run`
too. A line that FILE has is not made again. `score` prints by law the shares of measures and of cases within the sum of
both bars, and the worst measures beside a truth: the same case at a tolerance of 1e-6.
"""

import argparse
import json
from collections import defaultdict
from pathlib import Path
from time import process_time

import numpy as np
from scene_texts import MODE

import patchfem as pf
from patchfem.api import base_of
from patchfem.response.rows import TABLE as MOTION
from patchfem.response.rows import of_first
from patchfem.runs.many.lumped import lanes
from patchfem.runs.results.patch_rows import TABLE as STATIC
from patchfem.scene.sets import assignments

SCENE = '[normal]\nload = "30 N"\n[friction]\n{law}\n' + MODE + \
    '[drive]\nkind = "base"\nacceleration = "5 g"\nfrequency = "140 Hz"\ncycles = 60\n'
LAWS = {"coulomb": 'law = "coulomb"\nstatic = 0.3', "weakening": 'law = "coulomb"\nstatic = 0.3\nkinetic = 0.2',
        "elastic-plastic": 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"',
        "tanh": 'law = "tanh"\nstatic = 0.3\nreference_speed = "1 mm/s"',
        "iwan": 'law = "iwan"\nstatic = 0.3\nstiffness = "1e6 N/m"\nchi = -0.5\nbeta = 0.5',
        "nonlocal": 'law = "nonlocal"\nstatic = 0.3\nbond_length = "10 um"',
        "bouc-wen": 'law = "bouc-wen"\nstatic = 0.3\nstiffness = "1e6 N/m"',
        "lugre": 'law = "lugre"\nstatic = 0.3\nstiffness = "1e6 N/m"\nstribeck_speed = "1 mm/s"'}
FLOORS = {name: row.floor for table in (STATIC, MOTION) for name, row in table.items()}
WORST = 5  # misses of a law that are looked at


def drawn(law: str, seed: int, count: int) -> tuple[list, list]:
    """(models, their keys) of random cases of a law that lanes take: from sliding all the time to sticking, near
    resonance and away."""
    r, base, out, keys = np.random.default_rng(seed), base_of(pf.load(SCENE.format(law=LAWS[law]))), [], []
    while len(out) < count:
        push = 10 ** r.uniform(0.3, 2)
        sets = {"normal.load": push * 10 ** r.uniform(-1, 0.5), "drive.frequency": r.uniform(50, 400),
                "structure.mode.axial.damping": 10 ** r.uniform(-2.5, -0.5), "drive.acceleration": push,
                "structure.mode.axial.slide": float(r.choice([1, -0.7])),
                "structure.mode.axial.output": float(r.choice([1, -1.3]))}
        sets |= of_law(law, r, sets["normal.load"], push / (2 * np.pi * sets["drive.frequency"]))
        model = pf.build(base.changed(assignments(sets)))
        if not lanes.refuses(model):
            out.append(model)
            keys.append(sets)
    return out, keys


def of_law(law: str, r, load: float, speed: float) -> dict:
    """Keys of a law drawn for a load [N] and a scale of the speeds [m/s]."""
    if law == "iwan":
        return {"friction.stiffness": 0.3 * load * 10 ** r.uniform(4.3, 5.5), "friction.chi": r.uniform(-0.9, 0),
                "friction.beta": float(r.choice([0, 0.3, 3]))}
    length = 10 ** r.uniform(-5.5, -4.3)
    if law in ("elastic-plastic", "nonlocal"):
        return {"friction.bond_length": length}
    if law == "tanh":
        return {"friction.reference_speed": speed * 10 ** r.uniform(-2.3, 0)}
    if law == "bouc-wen":
        return {"friction.stiffness": 0.3 * load / length, "friction.exponent": float(r.choice([1, 1.5, 2, 4])),
                "friction.shape": r.uniform(0.5, 1)}
    if law == "lugre":
        stribeck = speed * 10 ** r.uniform(-1.5, 0)
        return {"friction.stiffness": 0.3 * load / length, "friction.stribeck_speed": stribeck,
                "friction.kinetic": r.uniform(0.15, 0.3),
                "friction.micro_damping": float(r.choice([0, 1])) * 0.1 * load / speed,
                "friction.viscous": float(r.choice([0, 1])) * 0.02 * load / speed}
    return {}


def rows(found, ones) -> list[list]:
    """[(measure, value, bar, value of the single run, its bar), ...] of each case of two Answers; NaN where one of them
    has no value of it, and left out where a ring is missing in the second alone: a run of so many cells that yields
    outnumber its samples loses its ring."""
    out = []
    for case in range(len(found)):
        names = {name for one in (found, ones) for name in one.values if one.has(name, case)}
        pairs = [[name, *(float(columns[name][case]) if name in columns else np.nan for one in (found, ones)
                          for columns in (one.values, one.errors))] for name in sorted(names)]
        out.append([pair for pair in pairs if not np.isnan([pair[1], pair[3]]).all()
                    and not (pair[0] in lanes.RING and np.isnan(pair[3]))])
    return out


def held(row) -> bool:
    """Whether two values agree within the sum of both bars, or to a thousandth of their floor."""
    return bool(gap(row) <= np.nansum([row[2], row[4], 1e-3 * FLOORS[of_first(row[0])]]))


def gap(row) -> float:
    """Size of their difference, infinite where one has none; a phase is compared modulo pi."""
    apart = abs(row[1] - row[3])
    return np.inf if np.isnan(apart) else min(apart, abs(np.pi - apart)) if row[0] == "slip_start_phase" else apart


def line_of(law: str, seed: int, count: int, singles: int) -> dict:
    """What `run` adds for a law and a seed: seconds, numbers of cases and of measures, the misses."""
    models, _ = drawn(law, seed, count)
    begin = process_time()
    found = pf.run_many(models)
    middle = process_time()
    ones, mine = found.blank(singles), [found.numerics[case]["engine"] == "lanes" for case in range(singles)]
    for case in range(singles):
        run = pf.run(models[case])
        ones.put(case, run.outcome, run.measures, 0.0)
    pairs = rows(found.some(np.arange(singles)), ones)
    outcomes = [case for case in range(singles) if found.outcome[case] != ones.outcome[case]]
    misses = [[case, *row] for case, some in enumerate(pairs) if mine[case] for row in some if not held(row)]
    return {"law": law, "seed": seed, "count": count, "lanes": sum(one["engine"] == "lanes" for one in
                                                                  found.numerics.values()),
            "failed": len(found.messages), "seconds": middle - begin, "seconds_singles": process_time() - middle,
            "singles": singles, "singles_of_lanes": sum(mine), "outcomes": [c for c in outcomes if mine[c]],
            "measures": sum(len(some) for some, ours in zip(pairs, mine) if ours), "misses": misses}


def truth(law: str, seed: int, case: int, name: str) -> float | None:
    """Value of a measure of a case at a tolerance of 1e-6; None where that run lacks it, as one that settles does."""
    sets = drawn(law, seed, case + 1)[1][case]
    found = pf.run(SCENE.format(law=LAWS[law]), **sets, **{"accuracy.tolerance": 1e-6}).measures.get(name)
    return None if found is None else found.value


def printed(lines: list) -> None:
    """Print the shares by law, and the worst misses beside their truth."""
    by = defaultdict(list)
    for one in lines:
        by[one["law"]].append(one)
    for law, some in by.items():
        def total(key, some=some):
            return sum(one[key] for one in some)

        misses = [(one["seed"], *miss) for one in some for miss in one["misses"]]
        others = {(one["seed"], case) for one in some for case in one["outcomes"]}
        cases, beside = {miss[:2] for miss in misses} | others, total("singles_of_lanes")
        print(f"{law:16s} {total('count')} cases, {total('lanes')} by lanes, {total('failed')} failed, "
              f"{total('count') / total('seconds'):.0f} a CPU second; {beside} of {total('singles')} single runs, "
              f"{total('singles') / total('seconds_singles'):.0f} a CPU second, stand beside lanes: "
              f"{100 * (1 - len(misses) / total('measures')):.2f} % of {total('measures')} measures, "
              f"{100 * (1 - len(cases) / beside):.1f} % of cases within both bars, {len(others)} other outcomes")
        for seed, case, *row in sorted(misses, key=lambda miss: -gap(miss[2:]) / np.nansum([miss[4], miss[6], 1e-300]))[
                :WORST]:
            print("   ", seed, case, row[0], f"{row[1]:.6g} ± {row[2]:.2g}, single {row[3]:.6g} ± {row[4]:.2g}, truth",
                  truth(law, seed, case, row[0]))


def _lines(names) -> list:
    return [json.loads(line) for name in names for line in Path(name).read_text("utf-8").splitlines()]


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    verbs = parser.add_subparsers(dest="verb", required=True)
    runs, reads = verbs.add_parser("run"), verbs.add_parser("score")
    runs.add_argument("file")
    for name, value in (("first", 1000), ("chunks", 10), ("count", 1430), ("singles", 300)):
        runs.add_argument(f"--{name}", type=int, default=value)
    reads.add_argument("files", nargs="+")
    asked = parser.parse_args()
    if asked.verb == "score":
        printed(_lines(asked.files))
        return
    done = {(one["law"], one["seed"]) for one in _lines([asked.file])} if Path(asked.file).exists() else set()
    for seed in range(asked.first, asked.first + asked.chunks):
        for law in LAWS:
            share = 2 if law in ("coulomb", "weakening") else 1  # the two are one law
            if (law, seed) not in done:
                line = line_of(law, seed, asked.count // share, asked.singles // share)
                with open(asked.file, "a", encoding="utf-8") as file:
                    file.write(json.dumps(line) + "\n")


if __name__ == "__main__":
    main()
