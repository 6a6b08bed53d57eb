"""Extrapolation of a periodic motion by whole cycles: states, energies and extremes."""

import numpy as np
import pytest
from march_paths import OMEGA, make_one_mode
from test_smooth import MASS, make_element

from patchfem.core import SineDrive
from patchfem.dynamics.smooth.arrays import Counter
from patchfem.dynamics.smooth.run import MAX_REPEAT_CHANGE, Motion
from patchfem.friction import Bonds, TanhLaw
from patchfem.friction.laws.bouc_wen import BoucWen

LAWS = {"tanh": TanhLaw(0.3, 5e-3), "bonds": Bonds(0.3, 5e-6), "bouc-wen": BoucWen(0.3, 5e-6)}
MODES, SINE = make_one_mode(OMEGA, 0.02, MASS), SineDrive(49.0, OMEGA * 0.9)


def element_of_law(name):
    """Return the friction element of a named law."""
    return LAWS[name].element(60.0) if name != "bonds" else make_element(LAWS[name])


@pytest.mark.share(0, 1)  # Bouc-Wen would compile a loop for this test alone
@pytest.mark.parametrize("name", LAWS)
def test_exact_extrapolated_cycles_agree_with_complete_integration(name):
    """A run that skips the cycles of a periodic motion needs fewer than half of the steps and
    agrees with the complete run in state, amplitudes and energies within 1e-7."""
    extrapolated, complete = (
        Motion(MODES, SINE, element_of_law(name), 400, 1e-9) for _ in range(2)
    )
    extrapolated.run_ahead_to(400 * SINE.period)
    complete.run_to(400 * SINE.period)
    size = abs(complete.record.cycles[:2]).max()
    assert (
        0 < extrapolated.repeat_change <= MAX_REPEAT_CHANGE * 1e-9
        and extrapolated.record.counters[Counter.ACCEPTED]
        < 0.5 * complete.record.counters[Counter.ACCEPTED]
    )
    assert extrapolated.time == pytest.approx(complete.time, rel=1e-14)
    scale = [size, size * OMEGA]
    assert extrapolated.arrays.state[:2] / scale == pytest.approx(
        complete.arrays.state[:2] / scale, abs=1e-7
    )
    assert extrapolated.record.cycles[:2] / size == pytest.approx(
        complete.record.cycles[:2] / size, abs=1e-7
    )
    found = extrapolated.energy_ledger()
    expected = complete.energy_ledger()
    for key in ("work_in", "viscous", "friction"):
        assert found[key] == pytest.approx(expected[key], rel=1e-7), key
    # the sum of |work| depends on the steps
    assert found["power"] == pytest.approx(expected["power"], rel=1e-3)
    imbalance = found["work_in"] - found["stored"] - found["friction"] - found["viscous"]
    assert abs(imbalance) < 1e-8 * found["power"]
    found = np.concatenate(extrapolated.turns)
    expected = np.concatenate(complete.turns)
    assert len(found) == len(expected) and found[-1] == pytest.approx(
        expected[-1], rel=1e-5, abs=1e-6 * size
    )


def test_always_growing_motion_is_not_extrapolated():
    """A motion that has not become periodic is integrated to its end."""
    run = Motion(
        make_one_mode(OMEGA, 1e-5, MASS), SineDrive(49.0, OMEGA), element_of_law("tanh"), 300, 1e-9
    )
    run.run_ahead_to(300 * 2 * np.pi / OMEGA)
    assert run.repeat_change == 0 and run.time == 300 * 2 * np.pi / OMEGA
