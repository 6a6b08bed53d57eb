"""Patches of elements in lanes, beside the exact batch and where they have to leave a case to it.

The whole campaign, beside single runs, is `lanes` of tests/support/campaigns.py.
"""

import numpy as np
import pytest
from lane_cases import PATCH, draw_patches, rows

import patchfem as pf
from patchfem.api import get_base_scene
from patchfem.runs.batch import batches, meshes
from patchfem.runs.batch.lumped import sheared, tabled
from patchfem.scene import format_assignments


def missed(family: str, seed: int, count: int) -> tuple:
    """(Answers of random cases in lanes, measures beyond the sum of both bars, all that were compared)."""
    models = meshes.with_shared_meshes(draw_patches(family, seed, count))
    assert all(batches.choose_batch(one, 64).name == "lumped.tabled" for one in models)
    assert all(batches.choose_batch(one, 63).name == "lumped.sheared" for one in models)
    found = tabled.solve(models)
    ones = sheared.solve(models)
    assert list(found.outcome) == list(ones.outcome) and not found.messages
    pairs = [row for some in rows(found, ones) for row in some]
    return found, [row for row in pairs if not row.holds], len(pairs)


@pytest.mark.parametrize("family", ["tilt x friction"])
def test_always_97_of_100_measures_lie_within_both_bars(family):
    found, misses, count = missed(family, 7, 6)
    assert sum(one["engine"] == "lanes" for one in found.numerics.values()) >= 4
    assert len(misses) <= 0.03 * count


def test_always_a_set_beyond_the_table_is_exact(monkeypatch):
    """Sets of more elements than a table has room for, as of a finer mesh, march from yield to yield."""
    models = meshes.with_shared_meshes(draw_patches("frequency x load", 9, 3))
    monkeypatch.setattr(tabled, "load", lambda _: type("Few", (), {"N_YIELDS": 8}))
    found = tabled.solve(models)
    ones = sheared.solve(models)
    assert all(one["engine"] == "piecewise" for one in found.numerics.values())
    for name, column in ones.values.items():
        np.testing.assert_array_equal(found.values[name], column)


def test_always_a_patch_that_sticks_is_answered_in_lanes():
    """Its loop is a small difference, which changes by more than itself with the steps; the amplitude does not."""
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
        [pf.build(base.override(format_assignments(one))) for one in sets]
    )
    found = tabled.solve(models)
    ones = sheared.solve(models)
    assert all(one["engine"] == "lanes" for one in found.numerics.values())
    assert list(found.outcome) == list(ones.outcome) == 3 * ["stuck"]
    for name in ("relative_displacement_amplitude", "friction_force_peak", "ring_frequency"):
        apart = np.abs(found.values[name] - ones.values[name])
        assert (apart <= found.errors[name] + ones.errors[name]).all()
        # those of the exact batch are of the mesh alone
        steps = found.errors[name] - 1.1 * ones.errors[name]
        assert (
            steps <= models[0].accuracy.tolerance * np.abs(ones.values[name]) + found.floors[name]
        ).all()
