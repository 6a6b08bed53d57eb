"""Work check of rigs: the trapezoidal rule on the samples agrees with the integrated friction work, in every engine."""

import numpy as np
import pytest

from patchfem.runs.run import run
from patchfem.scene import loads

RIG = (
    '[structure]\nmoving_mass = "0.884 kg"\n[[structure.mode]]\nname = "axial"\nfrequency = "143 Hz"\n'
    'damping = 0.01\nslide = 1.0\n[drive]\nkind = "base"\nfrequency = "143 Hz"\nacceleration = "5 g"\ncycles = 12\n'
)
POINT = '[normal]\nload = "90 N"\n[friction]\nstatic = 0.3\n'
LAWS = {
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "4 um"\n', "tanh": 'law = "tanh"\nreference_speed = '
    '"10 mm/s"\n', "bonds": 'law = "nonlocal"\nbond_length = "4 um"\n',
    "list": 'law = "nonlocal"\nbond_length = "4 um"\norder = 0.5\n',
    "printed": 'law = "nonlocal"\nbond_length = "4 um"\nreading = "report"\norder = 0\ninitial_bonds = 0\n',
}  # fmt: skip
PAIR = (
    '[structure]\nmasses = ["1 kg", "0.5 kg"]\n[[structure.spring]]\nbetween = [1, 0]\nstiffness = "5e5 N/m"\n'
    '[[structure.spring]]\nbetween = [2, 1]\nstiffness = "2e5 N/m"\n[[structure.interface]]\nbetween = [1, 0]\n'
    'law = "coulomb"\nstatic = 0.3\nkinetic = 0.2\nload = "20 N"\n[[structure.interface]]\nbetween = [2, 1]\n'
    'law = "elastic-plastic"\nbond_length = "10 um"\nstatic = 0.3\nload = "9 N"\n[drive]\nkind = "force"\n'
    'mass = 1\nforce = "15 N"\nfrequency = "60 Hz"\ncycles = 12\n'
)


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
        run_with_work_check(POINT + LAWS[law] + RIG, f"accuracy.steps_per_cycle={n}")[0]
        for n in steps
    )
    assert fine < 1e-3 and np.log(coarse / fine) / np.log(steps[1] / steps[0]) > 1.7


@pytest.mark.parametrize("method, limit", [("exact", 1e-5), ("march", 3e-4), ("harmonic", 1e-5)])
def test_exact_coulomb_work_check_closes_in_every_engine(method, limit):
    """The work check closes with Coulomb's law in every engine: the force is constant between events, which have a sample
    each."""
    value, result = run_with_work_check(
        POINT + 'law = "coulomb"\n' + RIG, f"accuracy.method={method}"
    )
    assert result.measures["loop_area"].value > 1e-3 and value < limit


def test_exact_work_check_allows_force_drop_at_slip_start():
    """The drop from the static to the kinetic friction force at the start of a slip does not affect
    the work check."""
    value, result = run_with_work_check(
        POINT + 'law = "coulomb"\nkinetic = 0.15\n' + RIG,
        "accuracy.method=march",
        "drive.frequency=40 Hz",
        "drive.acceleration=4 g",
        "accuracy.steps_per_cycle=400",
    )
    assert result.measures["stick_fraction"].value > 0.02 and value < 1e-3


def test_exact_work_check_of_two_interfaces_closes():
    """The work check of two interfaces together closes within 5e-4."""
    value, _ = run_with_work_check(PAIR, "accuracy.steps_per_cycle=800")
    assert 0 < value < 5e-4
