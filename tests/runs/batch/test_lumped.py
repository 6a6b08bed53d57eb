"""Lumped cases in one compiled call agree with the same cases solved one by one."""

import numpy as np
from scene_texts import MODE

from patchfem.api import build, get_base_scene, load
from patchfem.runs import CaseResults
from patchfem.runs.batch.lumped import lumped
from patchfem.scene import format_assignments

DRIVE = '[drive]\nkind = "{kind}"\n{kind_size}\nfrequency = "140 Hz"\ncycles = 40\n'
SCENE = '[normal]\nload = "30 N"\n[friction]\n{law}\n' + MODE + DRIVE
LAWS = {
    "coulomb": 'law = "coulomb"\nstatic = 0.3',
    "weakening": 'law = "coulomb"\nstatic = 0.3\nkinetic = 0.2',
    "elastic-plastic": 'law = "elastic-plastic"\nstatic = 0.3\nbond_length = "10 um"',
    "iwan": 'law = "iwan"\nstatic = 0.3\nstiffness = "2e6 N/m"\nchi = -0.5\nbeta = 1.0',
}
SIZES = {"base": 'acceleration = "5 g"', "force": 'force = "5 N"'}


def draw_models(law: str, seed: int, count: int) -> list:
    """Return random models with a friction law that stick, stop or slide all the time, near and
    away from resonance."""
    r = np.random.default_rng(seed)
    models = []
    for _ in range(count):
        kind = str(r.choice(["base", "base", "force"]))
        drive_amplitude = 10 ** r.uniform(0.3, 2)
        mode = "structure.mode.axial"
        sets = {
            "normal.load": r.uniform(2, 1.5 * drive_amplitude),
            "drive.frequency": r.uniform(60, 250),
            f"{mode}.damping": float(r.choice([0, 0.003, 0.05, 0.3, 1.0, 1.4])),
            f"{mode}.slide": float(r.choice([1, -0.7])),
            f"{mode}.output": float(r.choice([1, -1.3, 0.5])),
            "drive.cycles": int(r.choice([20, 47])),
            "accuracy.tolerance": float(r.choice([1e-3, 1e-5])),
        }
        sets |= (
            {"drive.acceleration": drive_amplitude, f"{mode}.base": r.uniform(0.4, 1)}
            if kind == "base"
            else {"drive.force": drive_amplitude}
        )
        if r.random() < 0.2:
            sets["structure.start.velocity"] = [0.05]
        if law == "elastic-plastic":
            sets["friction.bond_length"] = 10 ** r.uniform(-7, -4)
        scene = load(SCENE.format(law=LAWS[law], kind=kind, kind_size=SIZES[kind]))
        models.append(build(get_base_scene(scene).override(format_assignments(sets))))
    return models


def solve_by_group(cases) -> CaseResults:
    """Return the results of the exact batch of lumped cases, group by group."""
    results = CaseResults.blank(len(cases))
    groups = {}
    for case, model in enumerate(cases):
        assert lumped.refusal_reason(model) == ""
        groups.setdefault(lumped.group_key(model), []).append(case)
    for places in groups.values():
        results.insert(places, lumped.solve([cases[case] for case in places]))
    return results
