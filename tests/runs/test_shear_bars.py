"""The bars of random joints and rigs that slip part by part, against meshes and steps that are far finer."""

import numpy as np
import pytest
from shear_bars import RIG, misses

import patchfem as pf
from patchfem.scene.scene import loads


@pytest.mark.parametrize("kind, seeds", [("joint", (3024,)), ("rig", (3000,))])
def test_always_the_bars_of_random_pieces_behind_their_shear_hold(kind, seeds):
    """By the change on a coarser mesh alone joint 3024 missed the bar of its work 22 times, rig 3000 its peak 2.3."""
    for seed in seeds:
        found = misses(kind, seed)
        assert len(found) >= 7 and max(found.values()) <= 1, (seed, found)


@pytest.mark.slow
@pytest.mark.parametrize("kind, first, count", [("joint", 3000, 40), ("rig", 3000, 40)])
def test_always_19_of_20_bars_of_random_pieces_behind_their_shear_hold(kind, first, count):
    found = np.concatenate([list(misses(kind, seed).values()) for seed in range(first, first + count)])
    assert (found <= 1).mean() >= 0.95 and (found <= 2).mean() >= 0.97


@pytest.mark.parametrize("kind", ["joint", "rig"])
def test_exact_a_motion_on_too_few_elements_has_no_bars(kind):
    """No coarser mesh tells the error of one of two elements: 0.0113 +- 1e-12 J was said of a loop of 0.0128 J."""
    text = pf.new("joint") if kind == "joint" else RIG
    coarse = pf.run(loads(text, "few.toml", ["contact.element_size=25 mm" if kind == "joint" else
                                             "contact.element_size=8 mm"]))
    assert any("no error is estimated on 2 elements" in one for one in coarse.warnings)
    assert all(coarse.measures[name].error is None for name in ("loop_area", "friction_force_peak", "pressure_peak"))
    rigid = pf.run(loads(text.replace("[contact.shear]", ""), "few.toml", ["contact.element_size=8 mm"]))
    assert rigid.measures["loop_area"].error is not None  # 4 mu N A, or a motion under mu N, whatever the mesh
