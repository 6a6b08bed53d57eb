"""The shipped rig, Jenkins patches and static patches in batches, held against runs by themselves on random cases.

A case agrees where each of its measures lies inside the sum of both bars and the floor. The seeds of the long campaign
were drawn before its score was known: of 200 cases of each kind all 6128 measures of rigs and all 2400 of static
patches lay inside, and 6126 of 6128 of Jenkins patches. The two are a ring that a run by itself fits with bars as wide
as its frequency, and the batch does not tell.
"""

from pathlib import Path

import numpy as np
import pytest

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one

RIG = (Path(__file__).parents[3] / "studies/rig/rig.toml").read_text().split("[measured]")[0]
CLOSE = "[accuracy]\ntolerance = 1e-3\n"
PIECES = RIG.split("[contact.shear]")[0]
MOVED = (
    RIG[RIG.index("[structure]") : RIG.index('[[structure.mode]]\nname = "yaw"')]
    + RIG[RIG.index("[drive]") : RIG.index("[accuracy]")]
)
SCENES = {
    "rig": RIG.replace("tolerance = 1e-2", "tolerance = 1e-3"),
    "jenkins": PIECES
    + '[contact.shear]\n[friction]\nlaw = "coulomb"\nstatic = 0.3\n'
    + MOVED
    + CLOSE,
    "static": PIECES + CLOSE,
    "crowned": PIECES + '[contact.crown]\nradius = "5 m"\n' + CLOSE,
}
BATCHES = {"rig": "gathered", "jenkins": "lumped.tabled", "static": "patches", "crowned": "patches"}


def models(kind: str, seed: int, count: int) -> list:
    """Random tilts over two decades, loads, frictions and levels, on meshes that they share."""
    r = np.random.default_rng(seed)
    out = []
    for _ in range(count):
        sets = {
            "contact.tilt.angle": float(10 ** r.uniform(-5, -3)),
            "contact.load": float(10 ** r.uniform(1.5, 2.3)),
        }
        if kind == "crowned":
            sets["contact.crown.radius"] = float(10 ** r.uniform(-0.5, 2))
        elif kind != "static":
            sets |= {
                "friction.static": float(r.uniform(0.2, 0.45)),
                "drive.acceleration": float(9.81 * 10 ** r.uniform(0.5, 0.9)),
            }
        if kind == "rig":
            sets["friction.kinetic"] = sets["friction.static"]
        out.append(pf.build(SCENES[kind], **sets))
    return with_shared_meshes(out)


def held(kind: str, seed: int, count: int) -> tuple:
    """(Measures compared, those outside of both bars); outcomes are the same."""
    cases = models(kind, seed, count)
    assert all(batches.choose_batch(one, 64).name == BATCHES[kind] for one in cases)
    found = batches.solve_models(cases, study=max(count, 64))
    ones = one_by_one.solve(cases)
    assert not found.messages and not ones.messages
    assert list(found.outcome) == list(ones.outcome)
    compared = 0
    outside = 0
    for name, column in found.values.items():
        value = ones.values[name]
        gap = np.abs(column - ones.values[name])
        gap = np.minimum(gap, np.pi - gap) if name == "slip_start_phase" else gap
        bar = (
            np.nan_to_num(found.errors[name])
            + np.nan_to_num(ones.errors[name])
            + found.floors[name]
        )
        beyond = (gap > bar) | (np.isnan(column) != np.isnan(value))
        compared += int((~np.isnan(value)).sum())
        outside += int(beyond.sum())
    return compared, outside


@pytest.mark.parametrize(("kind", "count"), [("jenkins", 2), ("static", 5), ("crowned", 5)])
def test_always_a_batch_lies_inside_the_bars_of_its_cases(kind, count):
    compared, outside = held(kind, 11, count)
    assert compared >= 10 * count and outside == 0
