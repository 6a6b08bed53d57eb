"""Reversals of the slide: stops, grazing contacts with zero speed, and decay to rest."""

import numpy as np
import pytest
from march_paths import OMEGA, make_one_mode
from test_smooth import ONE, make_element

from patchfem.core import InitialState, Outcome, SineDrive
from patchfem.dynamics.smooth.arrays import Counter
from patchfem.dynamics.smooth.run import Motion
from patchfem.friction import Bonds, TanhLaw, points_element
from patchfem.structure import drives

SHORT_BONDS = Bonds(0.3, 1e-6)
PERIOD = 2 * np.pi / OMEGA


def run_sine(law, acceleration: float, cycles: float) -> tuple:
    """Return the motion under a sine of an acceleration [m s-2] and the times of its reversals
    [s]."""
    run = Motion(ONE, SineDrive(acceleration, OMEGA), law, 20, 1e-9)
    run.run_to(cycles * PERIOD)
    return run, np.concatenate(run.turns)[:, 0]


def test_always_motion_has_single_reversal_at_stop():
    """A motion that stops and comes to rest again within the next step has distinct reversals and
    ends without an error."""
    run, times = run_sine(
        points_element(SHORT_BONDS, [1.0], [84.82758620689656]), 33.333333333333336, 20
    )
    assert run.outcome is None and run.time == 20 * PERIOD
    assert 60 < times.size < 300 and np.diff(times).min() > 1e-6 * PERIOD


@pytest.mark.parametrize(("low", "high"), [(33.0, 34.0), (53.0, 52.0)])
def test_exact_motion_is_continuous_where_reversal_pair_appears(low, high):
    """With a growing drive two additional reversals appear where speed and acceleration vanish
    together. At this amplitude, found by bisection to the last bit, the motions with and without
    the reversals agree within 1e-8 of 1 um."""
    law = make_element(SHORT_BONDS)
    count = run_sine(law, low, 1)[1].size
    while abs(high - low) > 2e-14:
        middle = 0.5 * (low + high)
        run, times = run_sine(law, middle, 1)
        assert run.outcome is None and times.size in (count, count + 2)
        low, high = (middle, high) if times.size == count else (low, middle)
    (below, _), (above, times) = (run_sine(law, acceleration, 1) for acceleration in (low, high))
    assert times.size == count + 2 and np.diff(times).min() > 0
    size = [1e-6, 1e-6 * OMEGA]  # scales of displacement and velocity
    assert abs(below.arrays.state[:2] - above.arrays.state[:2]) / size == pytest.approx(0, abs=1e-8)


def test_always_strongly_damped_release_reaches_its_end():
    """A release with a rate law far above critical damping decays by 1e31 in 104 cycles and needs
    fewer than 2000 steps. A state within round-off of rest is not taken for a stop, which would
    reduce every step to 1e-12 of its size."""
    omega = 2 * np.pi * 162.4
    drive = drives.make_release(1 / 162.4)
    law = TanhLaw(0.671, 1.569e-3).element(15.46)
    run = Motion(
        make_one_mode(omega, 0.05, 0.7626),
        drive,
        law,
        104,
        1e-9,
        start=InitialState(np.array([4.631e-5]), np.zeros(1)),
    )
    for cycle in range(105):
        run.run_to(cycle / 162.4)
    z = abs(run.arrays.state[0])
    v = abs(run.arrays.state[1])
    n_steps = run.record.counters[Counter.ACCEPTED : Counter.REFUSED + 1].sum()
    assert run.outcome is None and n_steps < 2000
    assert z < 1e-25 * 4.631e-5 and v < 1e-25 * 4.631e-5 * omega
    # friction and damping dissipate the initial energy
    assert run.arrays.state[3] + run.arrays.state[4] == pytest.approx(
        0.5 * 0.7626 * (omega * 4.631e-5) ** 2, rel=1e-8
    )


@pytest.mark.parametrize("tolerance", [1e-9])
def test_always_round_off_of_stiff_bonds_does_not_reduce_steps(
    tolerance,
):
    """A released block that is stopped by stiff bonds far from its rest position vibrates on them
    and needs fewer than 40 000 steps (measured: 13 000). When the round-off of the bond force
    counted as an error of the step, 40 of the 108 cycles needed 839 000 steps."""
    omega = 2 * np.pi * 62.86
    load = 8.528
    length = 1.523e-7
    law = points_element(Bonds(0.588, length), [1.0], [load])
    start = InitialState(np.array([1.023e-5]), np.zeros(1))
    run = Motion(
        make_one_mode(omega, 0.05, 0.4143),
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


def test_exact_interrupted_integration_calls_do_not_change_motion():
    """The compiled loop returns at intervals, so that signals are handled, or when the array of
    reversals is full. Neither changes the motion."""
    law = make_element(Bonds(0.3, 5e-6))
    messages = []
    interrupted, long = (Motion(ONE, SineDrive(49.0, OMEGA), law, 2500, 1e-9) for _ in range(2))
    long.record = long.record._replace(turns=np.zeros((9000, 9)))
    long.progress = messages.append
    for run in (interrupted, long):
        run.run_to(2500 * PERIOD)
    assert run.outcome is not Outcome.NOT_CONVERGED and len(messages) > 1
    np.testing.assert_array_equal(long.arrays.state, interrupted.arrays.state)
    np.testing.assert_array_equal(np.concatenate(long.turns), np.concatenate(interrupted.turns))
