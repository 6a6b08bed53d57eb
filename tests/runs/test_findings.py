"""Findings on measures that miss the tolerance: scenes that trigger an advice, and the same scenes without it.

`test_advice_of_warnings.py` tests that an advice has the promised effect.
"""

from pathlib import Path

import pytest
from scene_runs import find_sentences
from scene_texts import BENCH, BLOCK, COULOMB, DRIVE, MODE, POINT, SHEAR, SHORT, SLIDE

from patchfem import run
from patchfem.runs.results.result import shorten_file_names

LOOSE = "[accuracy]\ntolerance = 0.01\n"
BONDS = POINT + '[friction]\nlaw = "nonlocal"\nstatic = 0.3\nbond_length = "1 um"\norder = 2\n'
SINE = '[slide]\nkind = "sine"\namplitude = "2 um"\nfrequency = "1 Hz"\ncycles = 2\n'
BENCH_END = SLIDE + "cycles = 1\n"
RIG_END = MODE + DRIVE
MARCH = {"accuracy.method": "march", "accuracy.steps_per_cycle": 40}

# Scene, keys that cause the finding, and key and axis of its advice. Without these keys nothing misses the tolerance.
SCENES = {
    "elements": (BLOCK, {"contact.element_size": "0.5 mm"}, "contact.element_size", "mesh"),
    "steps of a bench": (
        BENCH,
        {"accuracy.steps_per_cycle": 16},
        "accuracy.steps_per_cycle",
        "steps",
    ),
    "sum over bonds": (BONDS + SINE, {"accuracy.tail": 0.1}, "accuracy.tail", "bonds"),
    "steps of a rig": (POINT + COULOMB + SHORT, MARCH, "accuracy", "steps"),
}


def misses_tolerance(result) -> bool:
    """Return whether an error of a result exceeds the allowed one."""
    tolerance = result.plan.model.accuracy.tolerance
    return any(measure.error_ratio(tolerance) > 1 for measure in result.measures.values())


@pytest.mark.parametrize("name", SCENES)
def test_advice_of_a_finding_is_a_record(name):
    """A scene with poor numbers has a finding whose advice names key and axis; its sentence is a warning."""
    scene, keys, key, axis = SCENES[name]
    result = run(scene, **keys)
    (finding,) = result.findings
    assert finding.sentence in result.warnings and misses_tolerance(result)
    assert finding.advice.key.startswith(key) and finding.advice.axis == axis
    if finding.advice.value is not None:
        assert f"{finding.advice.key} = {finding.advice.value:g}" in finding.sentence
    accurate = run(scene)
    assert not accurate.findings and not misses_tolerance(accurate)


@pytest.mark.parametrize(
    "scene, static, count",
    [
        (BENCH_END, 0.3, 1),
        (SHEAR + BENCH_END, 0.3, 0),
        (SHEAR + BENCH_END, 0, 0),
        (SHEAR + RIG_END, 0, 0),
    ],
)
def test_sentences_name_shear_only_where_a_scene_lacks_it(scene, static, count):
    """A note on pieces that are rigid in shear names [contact.shear], but not without friction, nor if it is given."""
    result = run(BLOCK + LOOSE + COULOMB + scene, **{"friction.static": static})
    sentences = [*result.warnings, *result.notes]
    assert len(find_sentences(sentences, "[contact.shear]")) == count


@pytest.mark.parametrize("folder", ["/data/my rig/", "C:\\data\\my rig\\", "D:/data/rig/"])
def test_remarks_name_files_without_folders(folder):
    """Remarks name a file without its folder, with the separators of either system."""
    text = f"{folder}loop.csv: line 3: no number"
    assert shorten_file_names([text], Path("scene.toml")) == ["loop.csv: line 3: no number"]
