"""Runs of one patch share it: pressed and measured once, with the answers of runs that share nothing."""

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


def models(angles=(2e-5, 3e-4), levels=(3.0, 5.0, 8.0)) -> list:
    return with_shared_meshes(
        [
            pf.build(TEXT, **{"contact.tilt.angle": angle, "drive.acceleration": 9.81 * level})
            for angle in angles
            for level in levels
        ]
    )


@pytest.fixture(autouse=True)
def no_saved_state_error():
    store.clear_cache()


def test_exact_runs_that_share_a_patch_equal_runs_that_share_nothing():
    cases = models()
    found = one_by_one.solve(cases)
    for case, model in enumerate(cases):
        store.clear_cache()
        alone = one_by_one.solve([model])
        assert alone.outcome[0] == found.outcome[case] and alone.notes.get(0) == found.notes.get(
            case
        )
        for name, values in alone.values.items():
            np.testing.assert_array_equal(found.values[name][case], values[0], name)
            np.testing.assert_array_equal(found.errors[name][case], alone.errors[name][0], name)


@pytest.mark.parametrize(
    "changed",
    [
        {"contact.load": 100.0},
        {"contact.tilt.angle": 3e-5},
        {"contact.crown.radius": 3.0},
        {"contact.step.height": 1e-6, "contact.step.at": 1e-3},
        {"contact.width": 0.01},
        {"contact.height": 0.006},
        {"contact.plane": "stress"},
        {"contact.pairs": 2},
        {"contact.substrate": "WC-Co"},
        {"contact.coating.thickness": 1e-4},
        {"contact.upper.height": 0.005},
        {"contact.element_size": 1e-3},
        {"contact.asperities.law": "linear", "contact.asperities.normal_stiffness": 1e14},
        {"contact.holder.tangential_stiffness": 1e7},
        {"contact.holder.rotational_stiffness": 1e3},
    ],
)
def test_always_other_patches_are_not_the_same(changed):
    first, second, third = (
        pf.build(TEXT, **more).patch for more in ({}, {"drive.acceleration": 1.0}, changed)
    )
    assert content_key(first) == content_key(second) and hash(content_key(first)) == hash(
        content_key(second)
    )
    assert content_key(first) != content_key(third)


def test_always_a_file_that_may_change_is_read_again(tmp_path):
    own = pf.build(TEXT)
    assert not store.may_be_shared(own.patch) and store.may_be_shared(
        with_shared_meshes([own, own])[0].patch
    )
    (tmp_path / "heights.csv").write_text(
        "x [mm],z [um]\n" + "".join(f"{0.1 * k - 7},{k % 2}\n" for k in range(140))
    )
    (tmp_path / "a.toml").write_text(
        TEXT.replace(SHEAR, SHEAR + '[contact.profile]\nfile = "heights.csv"\n')
    )
    profiled = with_shared_meshes([pf.build(tmp_path / "a.toml")] * 2)[0].patch
    assert profiled.mesh.shared is not None and not store.may_be_shared(profiled)
