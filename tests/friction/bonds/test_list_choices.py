"""How finely the bonds of a rig are summed follows from the path that its block travels."""

import pytest
from scene_texts import DRIVE, KILOGRAM

from patchfem import build
from patchfem.runs import choose_numerics
from patchfem.runs.interfaces.bond_lists import choose_bond_summation, is_stuck_by_printed_law

TEXT = (
    """[normal]
load = "98.0665 N"
[friction]
law = "nonlocal"
static = 0.4
order = 1
bond_length = "1 um"
"""
    + KILOGRAM
)
RELEASE = '[drive]\nkind = "free"\ndisplacement = "10 um"\nduration = "20 ms"\n'


def choose(drive: str, **values):
    """Return how the lists of bonds of the scene with a drive are summed."""
    model = build(TEXT + drive, **values)
    return choose_bond_summation(model, choose_numerics(model))


@pytest.mark.parametrize(
    "reading, load, is_stuck",
    [
        ("report", "1 kN", True),
        ("stretch", "1 kN", False),
        ("report", "1 N", False),
    ],
)
def test_only_the_printed_law_with_enough_load_holds_a_block(reading, load, is_stuck):
    """A block is held by the printed law alone, and not by friction of .4 N under an inertia force of 49 N."""
    values = {"friction.reading": reading, "normal.load": load}
    model = build(TEXT + DRIVE, **values)
    assert is_stuck_by_printed_law(model) == is_stuck


@pytest.mark.parametrize(
    "drive",
    [
        DRIVE + 'waveform = "step"\n',
        RELEASE,
    ],
    ids=["step", "release"],
)
def test_motion_that_decays_has_longer_lists(drive):
    """Lists have room for the late strokes of a step or a release, a hundredth of the first ones and at the same speed."""
    values = {"friction.order": 2, "accuracy.quadrature": "truncated"}
    lasting = choose(DRIVE, **values)
    decaying = choose(drive, **values)
    assert decaying.strips > 10 * lasting.strips
    assert decaying.error == lasting.error
