"""Benches whose last friction loop is not steady agree with longer benches and with closed forms."""

import pytest

import patchfem as pf

BENCH = """[normal]
load = "115 N"
[friction]
static = 0.3
{law}
[slide]
kind = "sine"
amplitude = "2 um"
frequency = "1 Hz"
cycles = {cycles}
[accuracy]
tolerance = 1e-3
"""
BOUC_WEN = 'law = "bouc-wen"\nstiffness = "1e8 N/m"\nexponent = 2.0'
OPEN_LOOP_WARNING = "friction loop of the last cycle does not close"


def run_with_loop_warnings(law: str, cycles) -> tuple:
    """Return the result of a bench and its warnings about an open loop."""
    result = pf.run(BENCH.format(law=law, cycles=cycles))
    return result, [warning for warning in result.warnings if OPEN_LOOP_WARNING in warning]


def test_exact_warning_names_cycles_until_loop_is_steady():
    """The warning about an open loop states the steady loop area and the number of cycles that reach it."""
    one_cycle, warnings = run_with_loop_warnings(BOUC_WEN, 1)
    two_cycles, no_warnings = run_with_loop_warnings(BOUC_WEN, 2)
    three_cycles, _ = run_with_loop_warnings(BOUC_WEN, 3)
    assert len(warnings) == 1 and warnings[0].endswith("set slide.cycles = 2") and not no_warnings
    steady = three_cycles.measures["loop_area"].value
    assert two_cycles.measures["loop_area"].value == pytest.approx(steady, rel=1e-3)
    assert abs(one_cycle.measures["loop_area"].value - steady) > 0.03 * steady
    assert f"{1e6 * steady:.4g} uJ" in warnings[0]
