"""A block that the printed law holds: its list of bonds grows by a strip per step, which plan and run both know."""

import pytest

from patchfem.dynamics.march import march
from patchfem.runs.plan import plan
from patchfem.runs.rig.numerics import chatters
from patchfem.runs.run import run
from patchfem.scene.scene import loads

RIG = """[normal]
load = "54.08 N"
[friction]
law = "nonlocal"
static = 0.662
bond_length = "1.563 um"
reading = "{reading}"
[structure]
moving_mass = "0.5617 kg"
[[structure.mode]]
name = "m0"
frequency = "89.42 Hz"
damping = 0.05
slide = 1.0
base = 0.8
[drive]
kind = "base"
acceleration = "{push} m/s^2"
frequency = "101.4 Hz"
cycles = 6
[accuracy]
tolerance = 0.01
"""


def test_always_a_held_block_ends_within_the_steps_that_plan_counts(monkeypatch):
    scene, counted = loads(RIG.format(reading="report", push=5.739)), [0]
    foreseen, old = plan(scene), march.Run._steps

    def steps(self, count, rows):
        counted[0] += count
        assert counted[0] <= 1.5 * foreseen.steps, "the steps are halved without end"
        return old(self, count, rows)

    monkeypatch.setattr(march.Run, "_steps", steps)
    found = run(scene)
    assert found.extra["book"]["strips"] <= foreseen.unknowns["bond_list_about"] <= 1.5 * found.extra["book"]["strips"]
    assert any("accuracy.steps_per_cycle" in text for text in found.warnings)  # what is not known is said


@pytest.mark.parametrize(("reading", "push", "held"), [("report", 31.8, True), ("report", 31.9, False),
                                                       ("stretch", 5.739, False)])
def test_exact_the_printed_law_holds_fast_below_half_its_limit_over_the_mass(reading, push, held):
    model = plan(loads(RIG.format(reading=reading, push=push))).model  # 2 * 31.87 m/s^2 = 0.662 * 54.08 N / 0.5617 kg
    assert chatters(model) is held
