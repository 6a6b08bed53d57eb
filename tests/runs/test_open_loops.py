"""Benches whose last loop is not the steady one, against longer benches and closed forms."""

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
BOUC = 'law = "bouc-wen"\nstiffness = "1e8 N/m"\nexponent = 2.0'
CLOSED = "friction loop of the last cycle does not close"


def warned(law: str, cycles) -> tuple:
    done = pf.run(BENCH.format(law=law, cycles=cycles))
    return done, [one for one in done.warnings if CLOSED in one]


def test_exact_a_warning_names_the_cycles_until_the_loop_is_steady():
    first, told = warned(BOUC, 1)
    second, none = warned(BOUC, 2)
    third, _ = warned(BOUC, 3)
    assert len(told) == 1 and told[0].endswith("set slide.cycles = 2") and not none
    steady = third.measures["loop_area"].value
    assert second.measures["loop_area"].value == pytest.approx(steady, rel=1e-3)
    assert abs(first.measures["loop_area"].value - steady) > 0.03 * steady
    assert f"{1e6 * steady:.4g} uJ" in told[0]


@pytest.mark.parametrize("cycles", [1, 2, 1.5])
def test_exact_a_rigid_loop_is_steady_from_the_first_cycle(cycles):
    done, told = warned('law = "coulomb"', cycles)
    assert not told and done.measures["loop_area"].value == pytest.approx(
        4 * 0.3 * 115 * 2e-6, rel=1e-6
    )
