"""Patches of contact elements in lanes agree with the exact batch, which solves the cases that
lanes cannot.

The long campaign against single runs is `lanes` of tests/support/campaigns.py.
"""

import numpy as np
import pytest
from lane_cases import PATCH, compare_answers, draw_patches

import patchfem as pf
from patchfem.api import get_base_scene
from patchfem.runs.batch import batches, meshes
from patchfem.runs.batch.lumped import sheared, tabled
from patchfem.scene import format_assignments


def compare_lanes_with_exact(family: str, seed: int, count: int) -> tuple:
    """Return the results of random cases in lanes, the measures that differ by more than both
    errors, and the number of measures."""
    models = meshes.with_shared_meshes(draw_patches(family, seed, count))
    assert all(batches.choose_batch(model, 64).name == "lumped.tabled" for model in models)
    assert all(batches.choose_batch(model, 63).name == "lumped.sheared" for model in models)
    lanes = tabled.solve(models)
    exact = sheared.solve(models)
    assert list(lanes.outcome) == list(exact.outcome) and not lanes.messages
    all_rows = [row for case_rows in compare_answers(lanes, exact) for row in case_rows]
    return lanes, [row for row in all_rows if not row.holds], len(all_rows)


@pytest.mark.parametrize("family", ["tilt x friction"])
def test_always_97_of_100_measures_lie_within_both_errors(family):
    """At least 97 % of the measures of patches in lanes agree with the exact batch within the sum of both errors."""
    lanes, misses, count = compare_lanes_with_exact(family, 7, 6)
    assert sum(numerics["engine"] == "lanes" for numerics in lanes.numerics.values()) >= 4
    assert len(misses) <= 0.03 * count


def test_always_patch_larger_than_table_is_solved_exactly(monkeypatch):
    """A patch with more contact elements than the table has room for, as on a finer mesh, is
    integrated from yield event to yield event."""
    models = meshes.with_shared_meshes(draw_patches("frequency x load", 9, 3))
    monkeypatch.setattr(tabled, "load", lambda _: type("Few", (), {"N_YIELDS": 8}))
    lanes = tabled.solve(models)
    exact = sheared.solve(models)
    assert all(numerics["engine"] == "piecewise" for numerics in lanes.numerics.values())
    for name, column in exact.values.items():
        np.testing.assert_array_equal(lanes.values[name], column)


def test_always_stuck_patch_is_solved_in_lanes():
    """A stuck patch is solved in lanes although the relative change of its loop area with the steps
    is large: the loop area is a small difference, and only the amplitude decides."""
    base = get_base_scene(pf.load(PATCH))
    sets = [
        {
            "drive.acceleration": "50 m/s^2",
            "friction.static": static,
            "contact.tilt.angle": f"{tilt} rad",
        }
        for static, tilt in ((0.57, 3.7e-6), (0.54, 1.2e-6), (0.59, 4e-6))
    ]
    models = meshes.with_shared_meshes(
        [pf.build(base.override(format_assignments(assignments))) for assignments in sets]
    )
    lanes = tabled.solve(models)
    exact = sheared.solve(models)
    assert all(assignments["engine"] == "lanes" for assignments in lanes.numerics.values())
    assert list(lanes.outcome) == list(exact.outcome) == 3 * ["stuck"]
    for name in ("relative_displacement_amplitude", "friction_force_peak", "ring_frequency"):
        differences = np.abs(lanes.values[name] - exact.values[name])
        assert (differences <= lanes.errors[name] + exact.errors[name]).all()
        # The errors of the exact batch come only from the mesh.
        step_errors = lanes.errors[name] - 1.1 * exact.errors[name]
        assert (
            step_errors
            <= models[0].accuracy.tolerance * np.abs(exact.values[name]) + lanes.floors[name]
        ).all()
