"""Every kind of batch computes its cases together: none of them falls back to single runs."""

from pathlib import Path

import pytest
from lane_cases import draw_patches, draw_points
from scene_texts import BENCH, SMALL_PATCH

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import batches, gathered, one_by_one
from patchfem.runs.batch.lumped import lane_runs, lumped, sheared

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
LANES = {"lumped.lanes", "lumped.tabled"}  # these leave some cases to the exact engine


@pytest.fixture
def single_runs(monkeypatch) -> list:
    """Plans that are run by themselves, while the folder is that of the shipped rig."""
    plans = []
    run = one_by_one.run

    def record(plan, *given, **options):
        plans.append(plan)
        return run(plan, *given, **options)

    monkeypatch.setattr(one_by_one, "run", record)
    monkeypatch.chdir(STUDIES / "rig")
    return plans


def test_exact_every_batch_is_asked():
    assert [batch.name for batch in batches.BATCHES] == list(MODELS)


@pytest.mark.parametrize("name", MODELS)
def test_always_a_batch_computes_its_cases_together(name, single_runs):
    """At most a few cases that stick or ring are run singly; of benches, the patches are pressed together."""
    models = MODELS[name]()
    assert batches.choose_batch(models[0], len(models)).name == name
    said = []
    results = batches.solve_models(models, say=said.append)
    assert not [line for line in said if "one by one" in line]
    if name == "benches":
        assert all(plan.model.patch.solved is not None for plan in single_runs)
    else:
        assert len(single_runs) <= 0.25 * len(models)
    if name in LANES:
        engines = [numerics["engine"] for numerics in results.numerics.values()]
        assert engines.count("lanes") > 0.7 * len(models)
    assert not results.messages
    assert not [
        note for notes in results.notes.values() for note in notes if "internal fault" in note
    ]


@pytest.mark.parametrize(
    ("name", "module", "function"),
    [
        ("lumped.lanes", lane_runs, "collect_runs"),
        ("lumped.lumped", lumped, "assemble_results"),
        ("lumped.sheared", sheared, "YieldingElements"),
        ("gathered", gathered, "reduce_to_few_points"),
    ],
)
def test_always_a_fault_of_a_batch_stands_in_the_notes_of_its_cases(
    name, module, function, single_runs, monkeypatch
):
    """Wherever it fails, the cases are computed, and everybody who reads their notes learns why it took so long."""
    models = MODELS[name]()
    monkeypatch.setattr(module, function, lambda *given, **options: 1 / 0)
    monkeypatch.setattr(
        one_by_one, "run", lambda plan, *given, **options: pf.run(BENCH)
    )  # a result, whichever
    results = batches.solve_models(models)
    for case in range(len(models)):
        assert f"{name}: ZeroDivisionError: division by zero" in results.notes[case][-1]
