"""Periodic motions by shooting: against long runs, closed forms, and multipliers."""

import numpy as np
import pytest
from event_driven_cases import coulomb, make_oscillator

from patchfem.event_driven import runs
from patchfem.event_driven.laws import masing
from patchfem.event_driven.periodic import Shooting, find_periodic_motion, follow_periodic_motion
from patchfem.event_driven.records import LawNumbers, Memory, Probe

AMPLITUDE = "relative_displacement_amplitude"
LAWS = {
    "coulomb": coulomb(),
    "kinetic": coulomb(1.0, 0.8),
    "elastic": masing.from_elements([16.0], [0.05]),
    "jenkins": masing.from_elements([3.0, 4.0, 5.0], [0.05, 0.1, 0.02]),
    "iwan": LawNumbers("masing", (-0.3, 0.5, 0.8, 0.2, 1, 0.0, 0.2, 0.0, 0.8)),
    "tanh": LawNumbers("tanh", (1.0, 0.05)),
    "bouc-wen": LawNumbers("bouc_wen", (1.0, 0.05, 1.5, 0.6), (0.0,), (0.01,)),
    "lugre": LawNumbers("lugre", (1.0, 0.9, 20.0, 0.1, 0.05, 0.01), (0.0,), (0.01,)),
    "bonds": LawNumbers(
        "bonds",
        (1.0, 0.1, 0.07, 0.3, 0.5, 0.01, 0.0),
        (1.0, 0.0, 0.0, 0.1),
        (1.0, 0.001, 1e-5, 0.1),
    ),
}


@pytest.mark.parametrize("name", LAWS)
def test_shooting_equals_a_long_run(name):
    """Steady motion of every law in at most 60 periods, where a run needs hundreds."""
    case = make_oscillator(LAWS[name], acceleration=0.95, zeta=0.01, cycles=600, rtol=1e-9)
    steady = find_periodic_motion(case)
    assert steady.change < steady.tolerance
    assert steady.is_stable
    assert steady.n_periods <= 60
    run = runs.run_case(case)
    assert steady.run.values[AMPLITUDE] == pytest.approx(run.values[AMPLITUDE], rel=1e-6)
    assert steady.run.values["loop_area"] == pytest.approx(run.values["loop_area"], rel=1e-5)


def test_force_of_elements_that_slide_on_both_sides_is_their_limit():
    """Where all elements slide in each half cycle, the steady force is between plus and minus the slip force 0.8,
    whatever offset a correction gives to the reversal points that it starts from."""
    case = make_oscillator(LAWS["elastic"], acceleration=2.0, zeta=0.05, cycles=1, rtol=1e-9)
    first = find_periodic_motion(case)
    start = first.run.final
    stack = start.memory[0, Memory.STACK :]
    stack[1 : 2 * int(start.memory[0, Memory.COUNT]) : 2] -= 0.3
    record = find_periodic_motion(case, start=start, n_first=1).run.record
    assert record.get_face_extremes(Probe.FORCE)[0] == pytest.approx([-0.8, 0.8], abs=1e-9)


def test_elements_slip_in_no_direction_while_all_of_them_stick():
    """The direction of slip is zero wherever the force is between its limits, also at the start in the middle of a stick, so
    that the first slip is an event."""
    period = 2 * np.pi
    options = {"acceleration": 2.0, "zeta": 0.05, "cycles": 2, "rtol": 1e-9}
    law = masing.from_elements([0.8 / 0.047], [0.047])
    case = make_oscillator(law, samples=np.linspace(0, 2 * period, 401), **options)
    run = runs.run_case(case, start=find_periodic_motion(case).run.final)
    rows = run.rows[np.isin(run.rows[:, 0], case.samples)]
    force, direction = rows[:, [1 + case.y.size, 3 + case.y.size]].T
    sticks = np.abs(force) < 0.8 * (1 - 1e-6)
    assert 10 < sticks.sum() < 390 and not direction[sticks].any()
    assert np.array_equal(direction[~sticks], np.sign(force[~sticks]))


@pytest.mark.parametrize("name", LAWS)
def test_followed_motion_equals_that_of_a_search(name):
    """From a similar motion every law reaches the motion of a search, in four periods after a small change."""

    def make(acceleration):
        return make_oscillator(
            LAWS[name], acceleration=acceleration, zeta=0.01, cycles=1, rtol=1e-11
        )

    motion = find_periodic_motion(make(0.95))
    for acceleration, max_periods in ((0.95 * (1 + 1e-5), 4), (0.97, 12), (1.2, 20)):
        case = make(acceleration)
        motion = follow_periodic_motion(case, motion.start)
        assert motion.n_periods <= max_periods
        searched = find_periodic_motion(case).run.values
        for measure in (AMPLITUDE, "loop_area"):
            assert motion.run.values[measure] == pytest.approx(searched[measure], rel=1e-9)


def test_only_the_periodic_motion_is_measured():
    """The periods of a search are not measured, which takes more time than their steps; the motion at its end is."""
    case = make_oscillator(LAWS["elastic"], acceleration=0.95, zeta=0.01, cycles=1, rtol=1e-9)
    shooting = Shooting(case)
    shooting.relax(2)
    assert not shooting.record.integrals.any() and np.isinf(shooting.record.extremes).all()
    run = find_periodic_motion(case).run
    assert run.record.integrals.any() and np.isfinite(run.record.extremes).all()


def test_multipliers_of_a_linear_rig():
    """Without friction they are those of the modes, exp((-zeta +- i sqrt(1 - zeta^2)) omega T)."""
    zeta, omega = 0.02, 0.9
    case = make_oscillator(coulomb(), load=0.0, zeta=zeta, omega=omega, cycles=10, rtol=1e-11)
    multipliers = find_periodic_motion(case).multipliers
    exact = np.exp((-zeta + 1j * np.sqrt(1 - zeta**2) * np.array([1, -1])) * 2 * np.pi / omega)
    assert np.sort_complex(multipliers) == pytest.approx(np.sort_complex(exact), abs=1e-5)
