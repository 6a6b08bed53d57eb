"""Where the slide stops it turns, or it only touches its rest and goes on; nothing happens twice at one instant."""

import numpy as np
import pytest
from march_paths import OMEGA, one_mode
from test_smooth import ONE, element

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics.smooth.arrays import Counter
from patchfem.dynamics.smooth.run import Motion
from patchfem.friction import Bonds, TanhLaw, points_element
from patchfem.structure import drives

RINGS = Bonds(0.3, 1e-6)
PERIOD = 2 * np.pi / OMEGA


def moved(law, push: float, cycles: float) -> tuple:
    """(Motion, times of its reversals [s]) of a motion under a sine of `push` [m s-2]."""
    run = Motion(ONE, SineDrive(push, OMEGA), law, 20, 1e-9)
    run.run_to(cycles * PERIOD)
    return run, np.concatenate(run.turns)[:, 0]


def test_always_a_motion_turns_once_where_it_stops():
    """After its stop at 8.07 cycles it goes on and is back at rest within the first step: it is not astray."""
    run, times = moved(points_element(RINGS, [1.0], [84.82758620689656]), 33.333333333333336, 20)
    assert run.outcome is None and run.time == 20 * PERIOD
    assert 60 < times.size < 300 and np.diff(times).min() > 1e-6 * PERIOD


@pytest.mark.parametrize(("few", "many"), [(33.0, 34.0), (53.0, 52.0)])
def test_exact_a_motion_that_touches_its_rest_is_that_which_turns_there_twice(few, many):
    """Two turns come with the push. Where they do, to the last bit of it, rate and acceleration vanish together; there
    the motion with them is the one without."""
    law = element(RINGS)
    count = moved(law, few, 1)[1].size
    while abs(many - few) > 2e-14:
        middle = 0.5 * (few + many)
        run, times = moved(law, middle, 1)
        assert run.outcome is None and times.size in (count, count + 2)
        few, many = (middle, many) if times.size == count else (few, middle)
    (one, _), (other, times) = (moved(law, push, 1) for push in (few, many))
    assert times.size == count + 2 and np.diff(times).min() > 0
    size = [1e-6, 1e-6 * OMEGA]  # of the motion and its rate
    assert abs(one.arrays.state[:2] - other.arrays.state[:2]) / size == pytest.approx(0, abs=1e-8)


def test_always_a_motion_that_has_crept_to_rest_comes_to_its_end():
    """104 cycles of a rate law far above critical damping: z falls by 1e31. A state within round-off of rest that
    sets off is no stop; it was taken for one at a 1e-12 of each step, for ever (hundreds of steps are enough)."""
    omega = 2 * np.pi * 162.4
    free = drives.make_release(1 / 162.4)
    law = TanhLaw(0.671, 1.569e-3).element(15.46)
    run = Motion(
        one_mode(omega, 0.05, 0.7626),
        free,
        law,
        104,
        1e-9,
        start=InitialState(np.array([4.631e-5]), np.zeros(1)),
    )
    for cycle in range(105):
        run.run_to(cycle / 162.4)
    z = abs(run.arrays.state[0])
    v = abs(run.arrays.state[1])
    done = run.record.counters[Counter.ACCEPTED : Counter.REFUSED + 1].sum()
    assert run.outcome is None and done < 2000
    assert z < 1e-25 * 4.631e-5 and v < 1e-25 * 4.631e-5 * omega
    # what friction and damping took is the energy of the start
    assert run.arrays.state[3] + run.arrays.state[4] == pytest.approx(
        0.5 * 0.7626 * (omega * 4.631e-5) ** 2, rel=1e-8
    )


@pytest.mark.parametrize("tolerance", [1e-9, 1e-11])
def test_always_a_block_that_rings_on_its_bonds_far_from_rest_is_not_refused_for_their_round_off(
    tolerance,
):
    """Of a release that bonds 500 times as stiff as its spring catch far from rest: it rings on them at 23 times its
    frequency and dies out. The round-off of their force counted as an error of the step then: 839 000 steps in the
    first 40 cycles, 13 000 in all 108 now."""
    omega = 2 * np.pi * 62.86
    load = 8.528
    length = 1.523e-7
    law = points_element(Bonds(0.588, length), [1.0], [load])
    start = InitialState(np.array([1.023e-5]), np.zeros(1))
    run = Motion(
        one_mode(omega, 0.05, 0.4143),
        drives.make_release(1 / 62.86),
        law,
        108,
        tolerance,
        start=start,
    )
    run.run_to(108 / 62.86)
    y = run.arrays.state
    force = run.read_state()[0][5]
    assert (
        run.outcome is None
        and run.record.counters[Counter.ACCEPTED : Counter.REFUSED + 1].sum() < 40_000
    )
    assert abs(y[1]) < 1e-9 * omega * abs(y[0])
    # the bonds balance the spring
    assert force == pytest.approx(-0.4143 * omega**2 * y[0], rel=1e-8)


def test_exact_a_long_call_is_left_now_and_then_and_goes_on_to_the_last_bit():
    """So a signal is heard. The room for turns ends calls elsewhere; neither changes the motion."""
    law = element(Bonds(0.3, 5e-6))
    told = []
    often, long = (Motion(ONE, SineDrive(49.0, OMEGA), law, 2500, 1e-9) for _ in range(2))
    long.record = long.record._replace(turns=np.zeros((9000, 9)))
    long.progress = told.append
    for run in (often, long):
        run.run_to(2500 * PERIOD)
    assert run.outcome is not Outcome.NOT_CONVERGED and len(told) > 1
    np.testing.assert_array_equal(long.arrays.state, often.arrays.state)
    np.testing.assert_array_equal(np.concatenate(long.turns), np.concatenate(often.turns))
