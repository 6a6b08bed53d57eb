"""Patches that slip partially agree with single runs when many are solved in one compiled call."""

import numpy as np
import pytest
from batch_beside import assert_equal_to_single_runs
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


def draw_models(law: str, seed: int, count: int) -> list:
    """Return random models near and away from resonance, on their own, prescribed or shared meshes."""
    r = np.random.default_rng(seed)
    models = []
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
        models.append(pf.build(LAWS[law] + SKIN * (k % 4 == 3), **sets))
    return with_shared_meshes(models) if seed % 2 else models


def count_cases_solved_in_batch(law: str, seed: int, count: int) -> int:
    """Assert that a batch agrees with single runs; return how many cases the batch solved without a
    single run."""
    cases = draw_models(law, seed, count)
    single_cases = []
    solve_one_by_one = one_by_one.solve
    assert all(batches.choose_batch(model).name == "lumped.sheared" for model in cases)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(
            one_by_one,
            "solve",
            lambda draw_models, *given, **more: (
                single_cases.extend(draw_models) or solve_one_by_one(draw_models, *given, **more)
            ),
        )
        results = batches.solve_models(cases)
    assert_equal_to_single_runs(cases, solve_one_by_one(cases), results)
    return count - len(single_cases)


@pytest.mark.parametrize("law", LAWS)
def test_exact_batch_of_patches_agrees_with_single_runs(law):
    """A batch of six random patches agrees with single runs and solves at least three of them itself."""
    assert count_cases_solved_in_batch(law, 1, 6) >= 3
