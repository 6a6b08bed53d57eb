"""Sentences and errors of plans and motions that were wrong in earlier versions."""

from types import SimpleNamespace

import numpy as np

import patchfem as pf
from patchfem import load
from patchfem.core import Outcome
from patchfem.response import LastCycles, relative_gap


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
