"""A plan estimates the number of wear steps before the run."""

import pytest

import patchfem as pf
from patchfem.runs import compute_wear
from patchfem.runs.patch.result import solve_with_coarser
from patchfem.runs.wear.plan import N_SMOOTH_JUMPS, estimate_jump_count

SCENE = """
[contact]
length = "12.7 mm"
width = "12.7 mm"
height = "6.35 mm"
load = "26 lbf"
substrate = "Ti-8Al-1Mo-1V"
[friction]
law = "coulomb"
static = 0.3
[slide]
kind = "sine"
amplitude = "10 um"
frequency = "143 Hz"
cycles = 2
[accuracy]
tolerance = 1e-2
[wear]
coefficient = "1e-14 m^2/N"
"""
TILT, CROWN = '[contact.tilt]\nangle = "{}"\n', '[contact.crown]\nradius = "{}"\n'


def build_wear_model(shape: str, keys: str):
    """Return the model of a worn bench with a shape of the gap."""
    return pf.build(SCENE.replace("[friction]", shape + "[friction]") + keys)


@pytest.mark.share(1)
@pytest.mark.parametrize(
    "shape, cycles",
    [
        (TILT.format("0.1 mrad"), 1e5),
        (TILT.format("0.1 mrad"), 1e8),
        (TILT.format("0.5 mrad"), 1e7),
        (CROWN.format("10 m"), 1e7),
    ],
)
def test_always_plan_estimates_number_of_wear_steps(shape, cycles):
    """The plan estimates the number of wear steps within a factor of 1.5."""
    model = build_wear_model(shape, f"cycles = {cycles:g}\n")
    patch = solve_with_coarser(model.patch, model.accuracy.tolerance, False)[0]
    actual = len(compute_wear(model, patch, (None, None)).moments) - 1
    assert 1 / 1.5 < estimate_jump_count(model) / actual < 1.5


def test_exact_wear_steps_if_prescribed_or_in_full_contact():
    """The plan takes the prescribed number of wear steps, and a fixed number for asperities in full
    contact."""
    assert (
        estimate_jump_count(build_wear_model(TILT.format("0.1 mrad"), "cycles = 1e8\njumps = 7\n"))
        == 7
    )
    rough = '[contact.asperities]\nlaw = "exponential"\nnormal_stiffness = "1e13 Pa/m"\ndecay_length = "2.5 um"\n'
    assert estimate_jump_count(build_wear_model(rough, "cycles = 1e8\n")) == N_SMOOTH_JUMPS
