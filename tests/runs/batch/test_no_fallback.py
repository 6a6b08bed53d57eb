"""Every kind of batch solves its cases together; no kind falls back to single runs."""

import pytest
from point_cases import draw_points
from scene_texts import SMALL_PATCH

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, one_by_one

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
    "patches": lambda: build_variants(SMALL_PATCH, "contact.load", (50.0, 60.0, 70.0)),
    "lumped": lambda: draw_points("coulomb", 7, 64),
    "pressed": lambda: build_variants(SHEARED_BENCH, "slide.amplitude", (2e-6, 3e-6)),
}


@pytest.fixture
def single_runs(monkeypatch) -> list:
    """Return the list of plans that run one by one."""
    plans = []
    run = one_by_one.run

    def record(plan, *arguments, **options):
        plans.append(plan)
        return run(plan, *arguments, **options)

    monkeypatch.setattr(one_by_one, "run", record)
    return plans


def test_exact_every_batch_has_models():
    """Every batch of the program has models in this test."""
    assert [batch.name for batch in batches.BATCHES] == list(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_always_batch_solves_its_cases_together(name, single_runs):
    """At most a quarter of the cases, which stick or vibrate freely, run one by one; all patches of
    benches are pressed together."""
    models = MODELS[name]()
    assert batches.choose_batch(models[0], len(models)).name == name
    messages = []
    results = batches.solve_models(models, report=messages.append)
    assert not [line for line in messages if "one by one" in line]
    if name == "pressed":
        assert all(plan.model.patch.solved is not None for plan in single_runs)
    else:
        assert len(single_runs) <= 0.25 * len(models)
    assert not results.messages
    assert not [
        note for notes in results.notes.values() for note in notes if "internal fault" in note
    ]
