"""A motion that repeats is carried on by whole cycles: its last cycles, its books and its extremes are those of all."""

import numpy as np
import pytest
from march_paths import OMEGA, one_mode
from test_smooth import MASS, element

from patchfem.core import SineDrive
from patchfem.dynamics.smooth.arrays import Counter
from patchfem.dynamics.smooth.run import MAX_REPEAT_CHANGE, Motion, simulate
from patchfem.friction import Bonds, TanhLaw
from patchfem.friction.laws.bouc_wen import BoucWen

LAWS = {"tanh": TanhLaw(0.3, 5e-3), "bonds": Bonds(0.3, 5e-6), "bouc-wen": BoucWen(0.3, 5e-6)}
MODES, SINE = one_mode(OMEGA, 0.02, MASS), SineDrive(49.0, OMEGA * 0.9)


def law_of(name):
    return LAWS[name].element(60.0) if name != "bonds" else element(LAWS[name])


@pytest.mark.share(0, 1)  # Bouc and Wen: a loop to compile for this alone
@pytest.mark.parametrize("name", LAWS)
def test_exact_cycles_that_are_left_out_are_as_the_last_one(name):
    left, whole = (Motion(MODES, SINE, law_of(name), 400, 1e-9) for _ in range(2))
    left.run_ahead_to(400 * SINE.period)
    whole.run_to(400 * SINE.period)
    size = abs(whole.record.cycles[:2]).max()
    assert (
        0 < left.repeat_change <= MAX_REPEAT_CHANGE * 1e-9
        and left.record.counters[Counter.ACCEPTED] < 0.5 * whole.record.counters[Counter.ACCEPTED]
    )
    assert left.time == pytest.approx(whole.time, rel=1e-14)
    scale = [size, size * OMEGA]
    assert left.arrays.state[:2] / scale == pytest.approx(whole.arrays.state[:2] / scale, abs=1e-7)
    assert left.record.cycles[:2] / size == pytest.approx(whole.record.cycles[:2] / size, abs=1e-7)
    one = left.energy_ledger()
    other = whole.energy_ledger()
    for key in ("work_in", "viscous", "friction"):
        assert one[key] == pytest.approx(other[key], rel=1e-7), key
    # a sum of |work| over steps, which may differ
    assert one["power"] == pytest.approx(other["power"], rel=1e-3)
    miss = one["work_in"] - one["stored"] - one["friction"] - one["viscous"]
    assert abs(miss) < 1e-8 * one["power"]
    one = np.concatenate(left.turns)
    other = np.concatenate(whole.turns)
    assert len(one) == len(other) and one[-1] == pytest.approx(other[-1], rel=1e-5, abs=1e-6 * size)


def test_exact_the_last_cycles_after_a_million_others():
    few, many = (simulate(MODES, SINE, law_of("tanh"), cycles, 1e-9) for cycles in (400, 1_000_000))
    assert many.ledger["steps"] < 2 * few.ledger["steps"] and len(many.amplitudes) == 1_000_000
    for name in ("output_amplitude", "acceleration_peak"):
        assert getattr(many.integrated, name) == pytest.approx(
            getattr(few.integrated, name), rel=1e-7
        )
    for name in ("max_force", "work", "displacement_harmonic"):
        one, other = (abs(getattr(run.integrated.loops[0], name)) for run in (many, few))
        assert one == pytest.approx(other, rel=1e-7)


def test_always_a_motion_that_still_grows_is_not_carried_on():
    run = Motion(one_mode(OMEGA, 1e-5, MASS), SineDrive(49.0, OMEGA), law_of("tanh"), 300, 1e-9)
    run.run_ahead_to(300 * 2 * np.pi / OMEGA)
    assert run.repeat_change == 0 and run.time == 300 * 2 * np.pi / OMEGA
