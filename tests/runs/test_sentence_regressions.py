"""Sentences and errors of plans and motions that were wrong in earlier versions."""

from types import SimpleNamespace

import numpy as np
import pytest

import patchfem as pf
from patchfem import load
from patchfem.core import Measure, Outcome
from patchfem.friction import Bonds
from patchfem.response import LastCycles, relative_gap
from patchfem.runs.results.notes import warn_of_creep

BONDS = 'law = "nonlocal"\nbond_length = "{} m"\n'
RIG = """
[normal]
load = "{load} N"
[friction]
{law}static = 0.3
[structure]
moving_mass = "0.38 kg"
[[structure.mode]]
name = "one"
frequency = "113 Hz"
damping = 0.01
slide = 1.0
[drive]
kind = "base"
frequency = "100 Hz"
acceleration = "9.08 m/s^2"
cycles = 6
[accuracy]
tolerance = 1e-2
"""
PAIR = """
[structure]
masses = ["0.45 kg"]
output_mass = 1
[[structure.spring]]
between = [1, 0]
stiffness = "2.1e6 N/m"
[[structure.interface]]
between = [1, 0]
load = "1.55 N"
law = "tanh"
static = 0.3
reference_speed = "6e-4 m/s"
[[structure.interface]]
between = [1, 0]
load = "1.28 N"
law = "bouc-wen"
static = 0.3
stiffness = "2.6e5 N/m"
exponent = 1.0
[drive]
kind = "base"
waveform = "step"
acceleration = "23 m/s^2"
cycles = 6
"""


@pytest.mark.parametrize(
    ("outcome", "breakaway", "has_warning"),
    [(Outcome.STEADY, 0.0, True), (Outcome.STEADY, 0.3, True), (Outcome.TRANSIENT, 0.0, False)],
)
def test_exact_drift_warning_does_not_advise_breakaway(outcome, breakaway, has_warning):
    """A steady motion that drifts gives a warning for any breakaway. The warning does not advise a
    breakaway, because up to 0.9 it did not change the drift of a scene, 62 nm per cycle."""
    warnings = warn_of_creep(
        Bonds(0.3, 1e-6, breakaway=breakaway),
        outcome,
        {"drift_per_cycle": Measure(1e-7, "m", 1e-9)},
    )
    assert bool(warnings) == has_warning and "breakaway" not in "".join(warnings)


@pytest.mark.parametrize(
    ("length", "sentence"),
    [
        (4e-5, "the interface is elastic: its stiffness (bonds) is 1e+05 N/m"),
        (3e-7, "friction should hold the block"),
    ],
)
def test_exact_plan_calls_interface_with_soft_bonds_elastic(length, sentence):
    """The mode has a stiffness of 1.916e5 N/m and the bonds mu N over their length, 4 N over 40 um
    or 0.3 um. The plan calls the first interface elastic and predicts sticking for the second."""
    run_plan = pf.plan(load(RIG.format(law=BONDS.format(length), load=4 / 0.3)))
    assert any(sentence in line for line in run_plan.verdict)


def test_exact_plan_lists_stiffness_of_every_interface():
    """The plan lists the contact stiffness of every interface, or the reason why there is none."""
    chain = pf.plan(load(PAIR)).chain
    assert chain["bonds"] == "none: it creeps" and chain["bonds_2"] == pytest.approx(2.6e5)


def test_exact_motion_of_round_off_has_no_slip_or_loop():
    """With bonds of order 0, traction and slip vary although the relative displacement is
    round-off; slip and loop area are then zero."""
    wave = np.sin(np.linspace(0, 4 * np.pi, 145))
    window = SimpleNamespace(
        slide=1e-22 * wave,
        slip=3e-7 * wave,
        modal=1e-22 * wave[:, None],
        time=np.arange(145.0),
        extra={},
    )
    last_cycles = LastCycles(
        window, SimpleNamespace(period=72.0), None, {}, 12.9, 2e5, True, loop=(1e-22, 3.9, 0.0)
    )
    assert last_cycles.slip_measures == {
        "slip_amplitude": 0.0,
        "stick_fraction": 1.0,
    } and last_cycles.loop_measures == {"loop_area": 0.0}
    assert relative_gap(1e-22, 2e-22, 2e-22) == 0 < relative_gap(1e-12, 2e-12, 2e-12)


COARSE_TILT = """
[contact]
length = "22 mm"
width = "13 mm"
height = "8 mm"
substrate = "Ti-8Al-1Mo-1V"
load = "180 N"
{}
[contact.tilt]
angle = "18 mrad"
on = "lower"
[accuracy]
tolerance = 0.1
"""


def test_coarse_mesh_of_the_scene_is_named_where_nothing_is_in_contact():
    """A contact fraction of 0 on a prescribed mesh is blamed on this mesh, and the printed remedy resolves the contact."""
    (warning,) = pf.run(load(COARSE_TILT.format('element_size = "0.55 mm"'))).warnings
    assert "leave out contact.element_size" in warning and "no known setting" not in warning
    result = pf.run(load(COARSE_TILT.format("")))
    assert result.outcome is Outcome.DONE and not result.warnings


def test_work_check_has_a_single_remedy():
    """A work check above its limit has one warning, although its error also exceeds the tolerance; the remedy removes it."""
    text = """
[normal]
load = "32 N"
width = "2 mm"
[friction]
law = "nonlocal"
static = 0.58
bond_length = "12 um"
order = 0.0
spread = "47 um"
[slide]
kind = "constant"
speed = "49 mm/s"
distance = "137 nm"
[accuracy]
tolerance = 0.01
"""
    (warning,) = pf.run(load(text)).warnings
    steps = int(warning.rpartition("set accuracy.steps_per_cycle = ")[2])
    result = pf.run(load(f"{text}steps_per_cycle = {steps}\n"))
    assert result.measures.work_check.value < 1e-3 and not result.warnings
