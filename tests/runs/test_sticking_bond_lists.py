"""Blocks that stick under the law of the report: each step adds a group of bonds (a strip) to the list."""

from dataclasses import replace
from time import process_time

import pytest

from patchfem import load
from patchfem.core import Missing
from patchfem.model.model import build
from patchfem.runs import choose_numerics
from patchfem.runs.bench import engine
from patchfem.runs.rig import bond_lists
from patchfem.runs.run import run

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


@pytest.mark.share(0)
@pytest.mark.parametrize(
    "text", [RIG.format(reading="report", push=5.739), MASSES], ids=["mode", "masses"]
)
def test_always_stuck_block_leaves_a_strip_in_each_step(text):
    """The steps of a stuck block are not halved, because each of them leaves a strip of bonds."""
    result = run(load(text))
    steps = result.settings.steps_per_cycle * result.plan.model.rig.drive.cycles
    assert 0.6 * steps < result.motion.energies["strips"] <= 1.01 * steps
    # A warning states the missing error.
    assert any("accuracy.steps_per_cycle" in text for text in result.warnings)


def test_refuses_stuck_block_with_too_long_bond_list(monkeypatch):
    """A run whose list of bonds would take too long is stopped early, with an estimate of its time and the key to lower."""
    scene = load(RIG.format(reading="report", push=5.739).replace("cycles = 6", "cycles = 30"))
    monkeypatch.setattr(engine, "MAX_LIST_SECONDS", 0.6)
    pattern = (
        r"computing time of about (\d+) s, more than the limit of 1 s; lower the number of cycles"
    )
    with pytest.raises(Missing, match=pattern):
        run(scene, estimate=False)


def test_refuses_long_stick_before_the_run():
    """A block that the printed law holds for 600 cycles is refused before the run, because each step sums the strips of all
    steps before it. Few cycles and the other reading, which leaves few strips, are not refused."""
    scene = load(RIG.format(reading="report", push=5.739).replace("cycles = 6", "cycles = 600"))
    begin = process_time()
    with pytest.raises(Missing, match=r"about \d{4,} s, more than the limit of 60 s; lower"):
        run(scene)
    assert process_time() - begin < 10

    model = run(load(RIG.format(reading="report", push=5.739)), estimate=False).plan.model
    long = replace(choose_numerics(model), cycles=600.0)
    with pytest.raises(Missing):
        bond_lists.refuse_long_stick(model, long, 1)
    bond_lists.refuse_long_stick(model, choose_numerics(model), 1)
    stretch = build(load(RIG.format(reading="stretch", push=5.739)))
    bond_lists.refuse_long_stick(stretch, long, 1)
