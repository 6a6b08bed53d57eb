"""Benches in micro-slip: work and stiffness against an independent program, and what the tolerance buys."""

import re

import pytest

import patchfem as pf
from patchfem.scene import loads

# crowned steel pieces, slid by a fortieth of the slide at which all of them slips
CROWNED = """
[contact]
length = "39.833 mm"
width = "28.02 mm"
height = "15.225 mm"
load = "5592.8 N"
substrate = "steel"
[contact.crown]
radius = "231.16 m"
"""
SLID = (
    CROWNED
    + """
[contact.shear]
[friction]
law = "coulomb"
static = 0.359
[slide]
kind = "sine"
amplitude = "7.8188e-08 m"
frequency = "10 Hz"
cycles = 2
"""
)
LOOP = 1.84e-9  # J; an independent finite-element program, to 1 %
TOLERANCES = ("1e-2", "1e-3", "1e-4")
MEASURES = (
    "loop_area",
    "slip_amplitude",
    "friction_force_peak",
    "energy_stored",
    "friction_work",
    "energy_dissipated",
    "equivalent_stiffness",
    "secant_stiffness",
    "tangential_stiffness",
)


@pytest.fixture(scope="module")
def runs():
    return {
        tolerance: pf.run(loads(SLID, "slid.toml", [f"accuracy.tolerance={tolerance}"]))
        for tolerance in TOLERANCES
    }


def test_always_the_work_of_micro_slip_is_resolved(runs):
    """A mesh that is not graded to the slip zone gave 4.25e-9 +- 1.0e-9 J at the default tolerance."""
    for tolerance, found in runs.items():
        loop = found.measures["loop_area"]
        assert abs(loop.value - LOOP) <= loop.error + 0.01 * LOOP, tolerance
        assert loop.error <= 0.1 * LOOP, tolerance


def test_always_a_tighter_tolerance_buys_nodes_and_widens_no_error(runs):
    wide, middle, tight = (runs[tolerance] for tolerance in TOLERANCES)
    assert wide.patch.x.size < middle.patch.x.size < tight.patch.x.size
    for coarse, fine in ((wide, middle), (middle, tight)):
        for name in MEASURES:
            assert fine.measures[name].error <= coarse.measures[name].error * (1 + 1e-9), name


def test_exact_the_tangential_stiffness_is_that_of_the_patch_at_rest(runs):
    at_rest = pf.run(loads(CROWNED, "at rest.toml")).measures["tangential_stiffness"]
    slid = runs["1e-3"].measures["tangential_stiffness"]
    assert slid.value == pytest.approx(at_rest.value, rel=1e-12)
    assert slid.error == pytest.approx(at_rest.error, rel=1e-9)


def test_exact_a_joint_that_sticks_everywhere_has_a_mesh_as_before():
    """Nothing slips below the first yield of a flat joint, so that nothing is graded to a slip zone."""
    flat = re.sub(r"\[contact.crown\]\nradius.*\n", "", SLID)
    slid = pf.run(loads(flat, "flat.toml"))
    assert slid.measures["loop_area"].value == pytest.approx(0.0, abs=1e-20)
    assert slid.measures["equivalent_stiffness"].value == pytest.approx(
        slid.measures["tangential_stiffness"].value, rel=1e-3
    )
