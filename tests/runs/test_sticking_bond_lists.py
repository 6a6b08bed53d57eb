"""Blocks that stick under the law of the report: each step adds a group of bonds (a strip) to the list, in plan and run."""

import numpy as np
import pytest

from patchfem import load, plan
from patchfem.core import Missing
from patchfem.runs.rig import bond_lists
from patchfem.runs.run import run

GROWTH_SENTENCE = "each reversal makes the list of bonds longer"
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


MASSES = """[structure]
masses = ["0.7043 kg", "0.9066 kg"]
[[structure.spring]]
between = [1, 0]
stiffness = "1131000 N/m"
[[structure.spring]]
between = [2, 1]
stiffness = "428400 N/m"
[[structure.spring]]
between = [2, 0]
stiffness = "115500 N/m"
[[structure.damper]]
between = [1, 0]
coefficient = "35.18 N s/m"
[[structure.damper]]
between = [2, 1]
coefficient = "10.35 N s/m"
[[structure.interface]]
between = [1, 0]
load = "44.91 N"
law = "nonlocal"
static = 0.55
bond_length = "0.5014 um"
rest_growth = "13.85 m/s^2"
slip_growth = "0.1675 um"
reading = "report"
[drive]
kind = "base"
acceleration = "7.711 m/s^2"
frequency = "176.5 Hz"
cycles = 5
[accuracy]
tolerance = 0.01
"""
RELEASED_BLOCK = """[normal]
load = "133.2 N"
[friction]
law = "nonlocal"
static = 0.53
bond_length = "0.7974 um"
kinetic = 0.2185
rest_speed = "2.446e-06 m/s"
rest_growth = "12.74 m/s^2"
slip_growth = "4.361e-08 m"
reading = "report"
[structure]
moving_mass = "0.3877 kg"
[[structure.mode]]
name = "m0"
frequency = "47.05 Hz"
damping = 0.2
slide = 1.0
[structure.bonded]
stiffness = "176000 N/m"
[drive]
kind = "free"
displacement = "11.82 um"
cycles = 2
[accuracy]
tolerance = 0.003
"""


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "text",
    [
        RIG.format(reading="report", push=5.739),
        MASSES,
        RELEASED_BLOCK,
        RELEASED_BLOCK.replace("cycles = 2", "cycles = 8"),
    ],
    ids=["mode", "masses", "released", "released for longer"],
)
def test_always_plan_estimates_strips_of_stuck_block(text):
    """The plan estimates at least the strips of bonds of a stuck block, and at most 1.5 times as many: one per step, or
    after a release those that are younger than the oldest bond that still carries."""
    scene = load(text)
    run_plan = plan(scene)
    result = run(scene)
    strips = result.extra["book"]["strips"]
    assert strips <= run_plan.unknowns["bond_list_about"] <= 1.5 * strips
    # A warning states the missing error.
    assert any("accuracy.steps_per_cycle" in text for text in result.warnings)


# Stiffness [N/m] of the springs of RELEASED_BLOCK.
SPRING = 0.3877 * (2 * np.pi * 47.05) ** 2 + 176000
# Start [um] at which the spring force is half of the friction limit.
MAX_START = 1e6 * 0.53 * 133.2 / 2 / SPRING
# Acceleration [m/s^2] of RIG, whose base factor is 0.8, at half of the friction limit.
MAX_PUSH = 0.662 * 54.08 / 0.5617 / 0.8 / 2


@pytest.mark.parametrize(
    "text, is_stuck",
    [
        (RELEASED_BLOCK.replace("11.82", repr(0.999 * MAX_START)), True),
        (RELEASED_BLOCK.replace("11.82", repr(1.001 * MAX_START)), False),
        (RELEASED_BLOCK.replace("report", "stretch"), False),
        (RIG.format(reading="report", push=0.999 * MAX_PUSH), True),
        (RIG.format(reading="report", push=1.001 * MAX_PUSH), False),
        (RIG.format(reading="stretch", push=5.739), False),
    ],
)
def test_exact_report_law_sticks_up_to_half_friction_limit(text, is_stuck):
    """Only with the law of the report, the plan predicts that a block sticks on a growing list of
    bonds, up to half of the friction limit."""
    assert any(GROWTH_SENTENCE in sentence for sentence in plan(text).verdict) is is_stuck


def test_refuses_stuck_block_with_too_long_bond_list(monkeypatch):
    """A run whose list of bonds would take too long is stopped early, with an estimate of its time and the key to lower."""
    scene = load(RIG.format(reading="report", push=5.739).replace("cycles = 6", "cycles = 200"))
    monkeypatch.setattr(bond_lists, "MAX_LIST_SECONDS", 1.0)
    pattern = r"computing time of about (\d+) s, more than the limit of 1 s; lower drive\.cycles"
    with pytest.raises(Missing, match=pattern):
        run(scene, estimate=False)
