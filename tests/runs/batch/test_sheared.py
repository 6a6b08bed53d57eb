"""Patches that slip part by part, many in one compiled call, beside the same cases run one by one."""

import numpy as np
import pytest
from batch_beside import held_against
from scene_texts import COATED, MODE, PLASTIC, SHEAR

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one

DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 30\n'
SCENE = COATED + '[contact.tilt]\nangle = "0.02 mrad"\n' + SHEAR + PLASTIC + MODE + DRIVE
LAWS = {
    "elastic-plastic": SCENE,
    "coulomb": SCENE.replace(
        PLASTIC, PLASTIC.replace("elastic-plastic", "coulomb").replace('bond_length = "1 um"\n', "")
    ),
}
SKIN = (
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\ntangential_ratio = 0.8\n'
)


def models(law: str, seed: int, count: int) -> list:
    """Random tilts, loads and levels, near resonance and away, on meshes of their own, pinned or shared."""
    r = np.random.default_rng(seed)
    out = []
    for k in range(count):
        sets = {
            "contact.tilt.angle": float(10 ** r.uniform(-6, -2.3)) * float(r.choice([-1, 1])),
            "contact.load": float(10 ** r.uniform(1.2, 2.0)),
            "drive.frequency": float(r.uniform(100, 190)),
            "drive.acceleration": float(9.81 * 10 ** r.uniform(0.3, 1)),
            "accuracy.tolerance": 1e-2,
            "structure.mode.axial.damping": float(r.choice([0.003, 0.1])),
            "structure.mode.axial.slide": float(r.choice([1, -0.7])),
        }
        if k % 3 == 1:
            sets["contact.element_size"] = 3e-4
        out.append(pf.build(LAWS[law] + SKIN * (k % 4 == 3), **sets))
    return with_shared_meshes(out) if seed % 2 else out


def held(law: str, seed: int, count: int) -> int:
    """Cases held against runs of their own; how many the batch answered itself."""
    cases = models(law, seed, count)
    alone = []
    real = one_by_one.solve
    assert all(batches.choose_batch(one).name == "lumped.sheared" for one in cases)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            one_by_one,
            "solve",
            lambda models, *given, **more: alone.extend(models) or real(models, *given, **more),
        )
        found = batches.solve_models(cases)
    held_against(cases, real(cases), found)
    return count - len(alone)


@pytest.mark.parametrize("law", LAWS)
def test_exact_batch_of_patches_is_the_single_runs(law):
    assert held(law, 1, 6) >= 3
