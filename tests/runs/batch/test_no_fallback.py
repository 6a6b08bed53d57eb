"""Every kind of batch computes its cases together: none of them falls back to single runs."""

from pathlib import Path

import pytest
from lane_cases import draw_patches, draw_points
from scene_texts import SMALL_PATCH

import patchfem as pf
from patchfem.runs.batch import batches
from patchfem.runs.batch.meshes import with_shared_meshes

STUDIES = Path(__file__).parents[3] / "studies"
SHEARED_BENCH = """[contact]
length = "12 mm"
width = "10 mm"
height = "5 mm"
load = "200 N"
substrate = "Ti-8Al-1Mo-1V"
[contact.shear]
[friction]
law = "elastic-plastic"
static = 0.3
bond_length = "1 um"
[slide]
kind = "sine"
amplitude = "3 um"
frequency = "10 Hz"
[accuracy]
tolerance = 1e-2
"""


def vary(text: str, key: str, values) -> list:
    """Return models of a scene with different values of a key, on shared meshes."""
    return with_shared_meshes([pf.build(text, **{key: value}) for value in values])


MODELS = {  # name of the batch -> function that makes its models
    "patches": lambda: vary(SMALL_PATCH, "contact.load", (50.0, 60.0, 70.0)),
    "benches": lambda: vary(SHEARED_BENCH, "slide.amplitude", (2e-6, 3e-6)),
    "lumped.lanes": lambda: draw_points("coulomb", 7, 64),
    "lumped.lumped": lambda: draw_points("coulomb", 7, 4),
    "lumped.tabled": lambda: draw_patches("tilt x friction", 7, 64),
    "lumped.sheared": lambda: draw_patches("tilt x friction", 7, 4),
    "gathered": lambda: vary(
        (STUDIES / "rig" / "rig.toml").read_text("utf-8"),
        "friction.static",
        [0.2 + 0.005 * case for case in range(32)],
    ),
}


def test_exact_every_batch_is_asked():
    assert [batch.name for batch in batches.BATCHES] == list(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_always_a_batch_computes_its_cases_together(name, monkeypatch):
    monkeypatch.chdir(STUDIES / "rig")
    models = MODELS[name]()
    batch = batches.choose_batch(models[0], len(models))
    assert batch.name == name
    counts = []

    def solve(some, say):
        counts.append(len(some))
        return batch.solve(some, say)

    monkeypatch.setattr(batches, "BATCHES", (batch._replace(solve=solve),))
    said = []
    batches.solve_models(models, say=said.append)
    assert sum(counts) == len(models)
    assert not [line for line in said if "one by one" in line]
