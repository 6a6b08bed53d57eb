"""Work check of rigs: the trapezoidal rule on the samples agrees with the integrated friction work, in every engine."""

import numpy as np
import pytest
from scene_texts import (
    COULOMB,
    DRIVE,
    FORCED,
    MODE,
    NONLOCAL,
    PAIR,
    PLASTIC,
    make_friction_table,
)

from patchfem.runs.run import run
from patchfem.scene import loads

RIG = MODE.replace("0.003", "0.01") + DRIVE.replace("cycles = 30", "cycles = 12")
LOAD = '[normal]\nload = "90 N"\n'
BONDS = NONLOCAL.replace("1 um", "4 um")
LAWS = {
    "elastic-plastic": PLASTIC.replace("1 um", "4 um"),
    "tanh": make_friction_table("tanh").replace("1 mm", "10 mm"),
    "bonds": BONDS,
    "list": BONDS + "order = 0.5\n",
    "printed": BONDS + 'reading = "report"\norder = 0\ninitial_bonds = 0\n',
}


def run_with_work_check(text, *sets):
    """Return the value of the work check and the result of a scene."""
    result = run(loads(text, sets=sets), estimate=False)
    return result.measures["work_check"].value, result


@pytest.mark.share(1, 4)
@pytest.mark.parametrize("law", LAWS)
def test_order_of_work_check_of_march_is_two(law):
    """The work check converges with second order; a wrong factor in the friction work would leave a
    constant difference."""
    steps = (400, 1600) if law != "list" else (300, 900)
    coarse, fine = (
        run_with_work_check(LOAD + LAWS[law] + RIG, f"accuracy.steps_per_cycle={n}")[0]
        for n in steps
    )
    assert fine < 1e-3 and np.log(coarse / fine) / np.log(steps[1] / steps[0]) > 1.7


@pytest.mark.parametrize("method, limit", [("exact", 1e-5), ("march", 3e-4), ("harmonic", 1e-5)])
def test_exact_coulomb_work_check_closes_in_every_engine(method, limit):
    """The work check closes with Coulomb's law in every engine: the force is constant between events, which have a sample
    each."""
    value, result = run_with_work_check(LOAD + COULOMB + RIG, f"accuracy.method={method}")
    assert result.measures["loop_area"].value > 1e-3 and value < limit


def test_exact_work_check_allows_force_drop_at_slip_start():
    """The drop from the static to the kinetic friction force at the start of a slip does not affect
    the work check."""
    value, result = run_with_work_check(
        LOAD + COULOMB + "kinetic = 0.15\n" + RIG,
        "accuracy.method=march",
        "drive.frequency=40 Hz",
        "drive.acceleration=4 g",
        "accuracy.steps_per_cycle=400",
    )
    assert result.measures["stick_fraction"].value > 0.02 and value < 1e-3


def test_exact_work_check_of_two_interfaces_closes():
    """The work check of two interfaces together closes within 5e-4."""
    value, _ = run_with_work_check(PAIR + FORCED, "accuracy.steps_per_cycle=800")
    assert 0 < value < 5e-4
