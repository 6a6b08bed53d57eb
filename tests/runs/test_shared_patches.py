"""Runs of one patch share it: the patch is solved once, and the results agree with runs that share
nothing."""

import numpy as np
import pytest
from scene_texts import COATED, MODE, PLASTIC, SHEAR

import patchfem as pf
from patchfem.runs import with_shared_meshes
from patchfem.runs.batch import one_by_one
from patchfem.runs.patch import store
from patchfem.runs.patch.store import content_key

DRIVE = '[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 20\n'
TEXT = COATED + '[contact.tilt]\nangle = "0.02 mrad"\n' + SHEAR + PLASTIC + MODE + DRIVE


def build_models(angles=(2e-5, 3e-4), levels=(3.0, 5.0, 8.0)) -> list:
    """Return models of all angles and drive levels on shared meshes."""
    return with_shared_meshes(
        [
            pf.build(TEXT, **{"contact.tilt.angle": angle, "drive.acceleration": 9.81 * level})
            for angle in angles
            for level in levels
        ]
    )


@pytest.fixture(autouse=True)
def empty_patch_cache():
    """Clear the cache of solved patches."""
    store.clear_cache()


def test_exact_runs_with_shared_patch_agree_with_separate_runs():
    """Runs that share a solved patch agree with runs from an empty cache, to the last bit."""
    cases = build_models()
    shared = one_by_one.solve(cases)
    for case, model in enumerate(cases):
        store.clear_cache()
        separate = one_by_one.solve([model])
        assert separate.outcome[0] == shared.outcome[case] and separate.notes.get(
            0
        ) == shared.notes.get(case)
        for name, values in separate.values.items():
            np.testing.assert_array_equal(shared.values[name][case], values[0], name)
            np.testing.assert_array_equal(shared.errors[name][case], separate.errors[name][0], name)


@pytest.mark.parametrize(
    "changes",
    [
        {"contact.load": 100.0},
        {"contact.tilt.angle": 3e-5},
        {"contact.step.height": 1e-6, "contact.step.at": 1e-3},
        {"contact.plane": "stress"},
        {"contact.coating.thickness": 1e-4},
        {"contact.element_size": 1e-3},
        {"contact.asperities.law": "linear", "contact.asperities.normal_stiffness": 1e14},
        {"contact.holder.rotational_stiffness": 1e3},
    ],
)
def test_always_different_patches_have_different_keys(changes):
    """Two models share a patch only if all keys of the patch agree; the drive does not matter."""
    first, second, third = (
        pf.build(TEXT, **keys).patch for keys in ({}, {"drive.acceleration": 1.0}, changes)
    )
    assert content_key(first) == content_key(second) and hash(content_key(first)) == hash(
        content_key(second)
    )
    assert content_key(first) != content_key(third)


def test_always_patch_with_file_is_not_shared(tmp_path):
    """A patch with a profile is not shared, because its file may change."""
    model = pf.build(TEXT)
    assert not store.can_share_results(model.patch) and store.can_share_results(
        with_shared_meshes([model, model])[0].patch
    )
    (tmp_path / "heights.csv").write_text(
        "x [mm],z [um]\n" + "".join(f"{0.1 * k - 7},{k % 2}\n" for k in range(140))
    )
    (tmp_path / "a.toml").write_text(
        TEXT.replace(SHEAR, SHEAR + '[contact.profile]\nfile = "heights.csv"\n')
    )
    profiled = with_shared_meshes([pf.build(tmp_path / "a.toml")] * 2)[0].patch
    assert profiled.mesh.shared is not None and not store.can_share_results(profiled)
