"""Batches of random cases of every kind of run agree with single runs of the same cases."""

import numpy as np
import pytest
from scene_texts import COATED, MODE, PLASTIC, SHEAR, SLIDE

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one
from patchfem.runs.patch import store

PATCH = COATED + '[contact.tilt]\nangle = "0.02 mrad"\n'
SINE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n'
YAW = '[[structure.mode]]\nname = "yaw"\nfrequency = "129 Hz"\ndamping = 0.003\nslide = 0.095\n'
SKIN = (
    '[contact.asperities]\nlaw = "linear"\nnormal_stiffness = "1e14 Pa/m"\ntangential_ratio = 0.8\n'
)
WEAR = '[wear]\ncoefficient = "1e-14 m^2/N"\ncycles = 1000\n'
RIG = PATCH + SHEAR + PLASTIC + MODE + YAW + SINE
TEXTS = {
    "static": PATCH,
    "static skin": PATCH + SKIN,
    "harmonic": RIG + '[accuracy]\nmethod = "harmonic"\n',
    "patch": RIG,
    "patch coulomb": RIG.replace(
        PLASTIC, PLASTIC.replace("elastic-plastic", "coulomb").replace('bond_length = "1 um"\n', "")
    ),
    "bench": PATCH + SHEAR + PLASTIC + SLIDE,
    "bench wear": PATCH + PLASTIC + SLIDE + WEAR,
}
# Relative tolerance of measures of the pressure at an end of uncoated pieces, a mean over one cell.
END_TOLERANCES = {"pressure_peak": 1e-9, "loaded_fraction": 1e-9}


def draw_models(kind: str, seed: int, count: int) -> list:
    """Return `count` random models of a kind; as in a sweep, several models share a tilt or a load."""
    r = np.random.default_rng(seed)
    models = []
    tilts = 10 ** r.uniform(-6, -2.3, max(2, count // 5))
    loads = 10 ** r.uniform(1.5, 2.7, 3)
    for _ in range(count):
        sets = {
            "contact.tilt.angle": float(r.choice(tilts)) * float(r.choice([-1, 1])),
            "contact.load": float(r.choice(loads)),
        }
        if "drive" in TEXTS[kind]:
            sets |= {
                "drive.acceleration": float(9.81 * 10 ** r.uniform(-0.3, 1)),
                "drive.frequency": float(r.choice([120.0, 143.0, 160.0])),
            }
        if "bench" in kind:
            sets |= {"slide.amplitude": float(10 ** r.uniform(-5.3, -4.3))}
        models.append(pf.build(TEXTS[kind], **sets))
    return with_shared_meshes(models)


def solve_single(model):
    """Return the results of a single run that starts with an empty cache."""
    store.clear_cache()
    return one_by_one.solve([model])


def assert_equal_to_single_runs(kind: str, seed: int, count: int) -> int:
    """Assert that a batch agrees with single runs of its cases; return the number of cases.

    Outcomes, texts and reasons are equal; values, errors and floors agree within round-off.
    """
    models = draw_models(kind, seed, count)
    batch = batches.solve_models(models)
    for case, model in enumerate(models):
        single = solve_single(model)
        assert batch.outcome[case] == single.outcome[0] != "failed", (
            case,
            batch.messages.get(case),
        )
        for result, reference in (
            (batch.warnings, single.warnings),
            (batch.notes, single.notes),
            (batch.numerics, single.numerics),
        ):
            assert result.get(case) == reference.get(0), case
        assert {name for name in batch.values if batch.has(name, case)} == {
            name for name in single.values if single.has(name, 0)
        }
        for name, values in single.values.items():
            assert batch.reasons.get(name, {}).get(case) == single.reasons.get(name, {}).get(0)
            tolerance = END_TOLERANCES.get(name, 1e-12) * (abs(values[0]) + single.floors[name][0])
            for column, expected in (
                (batch.values, values),
                (batch.errors, single.errors[name]),
                (batch.floors, single.floors[name]),
            ):
                assert column[name][case] == pytest.approx(
                    expected[0], rel=0, abs=tolerance, nan_ok=True
                ), (case, name)
    return len(models)


@pytest.mark.parametrize("kind", TEXTS)
def test_exact_batch_agrees_with_single_runs(kind):
    """A batch of each kind of run agrees with single runs of its cases."""
    assert assert_equal_to_single_runs(kind, 1, 2) == 2
