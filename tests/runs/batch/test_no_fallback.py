"""Every kind of batch solves its cases together; no kind falls back to single runs."""

from functools import partial
from pathlib import Path

import pytest
from lane_cases import PATCH, draw_patches, draw_points

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one

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


def build_variants(text: str, key: str, values) -> list:
    """Return models of a scene with different values of a key, on shared meshes."""
    return with_shared_meshes([pf.build(text, **{key: value}) for value in values])


MODELS = {  # Name of the batch: function that builds its models.
    "lumped.lanes": lambda: draw_points("coulomb", 7, 64),
    "lumped.lumped": lambda: draw_points("coulomb", 7, 4),
    # The pressure is the same in all cases, so one patch is solved for all.
    "lumped.tabled": lambda: build_variants(
        PATCH, "friction.static", [0.1 + 0.008 * case for case in range(64)]
    ),
    "lumped.sheared": lambda: draw_patches("tilt x friction", 7, 4),
    "gathered": lambda: build_variants(
        (STUDIES / "rig" / "rig.toml").read_text("utf-8"),
        "friction.static",
        [0.2 + 0.005 * case for case in range(32)],
    ),
}
# Batches that solve some of their cases with the exact engine.
LANE_BATCHES = {"lumped.lanes", "lumped.tabled"}


@pytest.fixture
def replace_single_runs(monkeypatch):
    """Return a function that replaces the runs of one case; the working directory is that of the
    shipped rig."""
    monkeypatch.chdir(STUDIES / "rig")
    return partial(monkeypatch.setattr, one_by_one, "run")


@pytest.fixture
def single_runs(replace_single_runs) -> list:
    """Return the list of plans that run one by one."""
    plans = []
    run = one_by_one.run

    def record(plan, *arguments, **options):
        plans.append(plan)
        return run(plan, *arguments, **options)

    replace_single_runs(record)
    return plans


def test_exact_every_batch_has_models():
    """Every batch of the program has models in this test."""
    assert [batch.name for batch in batches.BATCHES] == list(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_always_batch_solves_its_cases_together(name, single_runs):
    """At most a quarter of the cases, which stick or vibrate freely, run one by one."""
    models = MODELS[name]()
    assert batches.choose_batch(models[0], len(models)).name == name
    messages = []
    results = batches.solve_models(models, report=messages.append)
    assert not [line for line in messages if "one by one" in line]
    assert len(single_runs) <= 0.25 * len(models)
    if name in LANE_BATCHES:
        engines = [numerics["engine"] for numerics in results.numerics.values()]
        assert engines.count("lanes") > 0.7 * len(models)
    assert not results.messages
    assert not [
        note for notes in results.notes.values() for note in notes if "internal fault" in note
    ]
