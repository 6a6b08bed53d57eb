"""Random cases of every kind, many at once as a sweep has them, against runs of their own that share nothing."""

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
# of the pressure at an end of bare pieces, the mean over a cell: its digits end there
ENDS = {"pressure_peak": 1e-9, "loaded_fraction": 1e-9}


def cases(kind: str, seed: int, count: int) -> list:
    """Models of a kind, two to three loads, tilts or levels to a patch as the axes of a sweep have them."""
    r = np.random.default_rng(seed)
    out = []
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
        out.append(pf.build(TEXTS[kind], **sets))
    return with_shared_meshes(out)


def alone(model):
    """Answers of a run that finds nothing kept."""
    store.clear_cache()
    return one_by_one.solve([model])


def held_against_own_runs(kind: str, seed: int, count: int) -> int:
    """Cases whose answers, bars, floors, reasons and words in the batch were those of their own runs: all are held."""
    models = cases(kind, seed, count)
    found = batches.solve_models(models)
    for case, model in enumerate(models):
        own = alone(model)
        assert found.outcome[case] == own.outcome[0] != "failed", (case, found.messages.get(case))
        for mine, theirs in (
            (found.warnings, own.warnings),
            (found.notes, own.notes),
            (found.numerics, own.numerics),
        ):
            assert mine.get(case) == theirs.get(0), case
        assert {name for name in found.values if found.has(name, case)} == {
            name for name in own.values if own.has(name, 0)
        }
        for name, values in own.values.items():
            assert found.reasons.get(name, {}).get(case) == own.reasons.get(name, {}).get(0)
            near = ENDS.get(name, 1e-12) * (abs(values[0]) + own.floors[name][0])
            for column, wanted in (
                (found.values, values),
                (found.errors, own.errors[name]),
                (found.floors, own.floors[name]),
            ):
                assert column[name][case] == pytest.approx(
                    wanted[0], rel=0, abs=near, nan_ok=True
                ), (case, name)
    return len(models)


@pytest.mark.parametrize("kind", TEXTS)
def test_exact_many_are_runs_of_their_own(kind):
    assert held_against_own_runs(kind, 1, 2) == 2


def test_exact_benches_that_stay_as_they_are_pressed_share_that():
    taken = {kind: batches.choose_batch(cases(kind, 1, 2)[0]) for kind in ("bench", "bench wear")}
    assert taken["bench"].name == "benches" and taken["bench wear"] is None
