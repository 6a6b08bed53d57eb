"""Bolted joints that hold, wholly or in part: what their bars say, and whether the advised cures cure."""

import re

import pytest
from scene_texts import JOINT, JOINT_SHAKEN

from patchfem.runs.plan import plan
from patchfem.runs.run import run
from patchfem.scene.scene import loads

BENCH = JOINT + """[slide]
kind = "sine"
amplitude = "45 nm"
frequency = "1 Hz"
cycles = 3
[accuracy]
tolerance = 1e-2
steps_per_cycle = {steps}
"""
BOWED = """[contact.crown]
radius = "100 m"
"""


def ran(text: str):
    return run(plan(loads(text)))


@pytest.mark.parametrize("steps", [400, 1600])
def test_exact_a_joint_that_holds_has_the_stiffness_of_its_pieces(steps):
    """Nothing slips, so the secant is the tangential stiffness, whatever the steps; its bar says so."""
    found = ran(BENCH.format(steps=steps))
    secant, elastic = (found.measures[name] for name in ("secant_stiffness", "tangential_stiffness"))
    assert abs(secant.value - elastic.value) <= secant.error + elastic.error
    assert secant.error <= 2e-3 * secant.value and not found.warnings


def test_always_what_the_mesh_leaves_open_is_not_laid_on_the_steps():
    """The edge slip of a bowed joint does not change with the steps; a finer mesh, as advised, tells it better."""
    first = ran(BENCH.format(steps=100) + BOWED)
    said = [text for text in first.warnings if text.startswith("loop_area")]
    assert len(said) == 1 and "steps_per_cycle" not in said[0] and "interface nodes) leaves it open" in said[0]
    advised = re.search(r"accuracy.tolerance = (\S+) refines it", said[0])[1]
    again = ran(BENCH.format(steps=100).replace("tolerance = 1e-2", f"tolerance = {advised}") + BOWED)
    for name in ("friction_ratio_end", "loop_area"):
        assert again.measures[name].error < first.measures[name].error / 2
        assert abs(again.measures[name].value - first.measures[name].value) < first.measures[name].error


def test_exact_the_ringing_of_a_start_is_no_dissipation():
    """A flat joint below its limit dissipates nothing: the bar of its work per cycle holds 0, and the cycles that a
    note names let the ring decay."""
    first = ran(JOINT_SHAKEN)
    loop = first.measures["loop_area"]
    assert first.outcome == "stuck" and abs(loop.value) > loop.floor / 100 and abs(loop.value) <= loop.error
    assert abs(first.measures["equivalent_damping"].value) <= first.measures["equivalent_damping"].error
    told = [text for text in first.extra["notes"] if text.startswith("the start still rings at 105")]
    assert len(told) == 1
    cycles = re.search(r"drive.cycles = (\d+) lets", told[0])[1]
    assert any(f"drive.cycles = {cycles} lets" in text for text in first.warnings)
    again = ran(JOINT_SHAKEN.replace("cycles = 20", f"cycles = {cycles}"))
    assert not any("rings" in text for text in again.extra["notes"])
    damping = again.measures["equivalent_damping"]
    assert abs(damping.value) <= damping.error <= damping.floor
    assert not any("equivalent_damping" in text or "drive.cycles" in text for text in again.warnings)


def test_always_a_ring_that_steps_do_not_resolve_is_followed_without_them():
    """800 steps of a cycle are few for a ring of 88 periods in it: the exact engine is advised, and cures it."""
    loose = "[accuracy]\ntolerance = 0.3\n"
    first = ran(JOINT_SHAKEN + loose)
    assert first.extra["engine"] == "march" and 'accuracy.method = "exact"' in first.warnings[0]
    again = ran(JOINT_SHAKEN + loose + 'method = "exact"\n')
    bars = [one.measures["secant_stiffness"].error for one in (first, again)]
    assert bars[1] < bars[0] / 10
