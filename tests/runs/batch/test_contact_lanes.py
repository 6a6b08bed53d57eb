"""Patches of contact elements in lanes agree with the exact batch, which solves the cases that
lanes cannot.

The long campaign against single runs is `lanes` of tests/support/campaigns.py.
"""

import numpy as np
import pytest
from lane_cases import compare_answers, draw_patches

from patchfem.runs.batch import batches, meshes
from patchfem.runs.batch.lumped import sheared, tabled


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
