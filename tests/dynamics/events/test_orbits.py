"""What instruments see of a periodic motion, against the marched period; a start of other
elements."""

from dataclasses import replace

import numpy as np
import pytest
from test_elastic_plastic import basis, random_rig

from patchfem.core import NotConverged, SineDrive
from patchfem.dynamics import PeriodicMotionFinder, make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.dynamics.events.steady import solve_steady as steady
from patchfem.dynamics.periodic import solve_linear

MODES = basis([1.0, 2.3], [0.01, 0.02], [1.0, 0.4], [1.0, 0.5], [1.0, 0.2])
GROUP = [make_elements([2.0, 1.0], [0.1, 0.3])]


def first_harmonic(window, omega):
    """2/T int y exp(-i omega t) of the displacement by Simpson's rule on its cubics, from
    samples alone."""
    t = window.time
    y = window.output
    v = window.output_rate
    h = np.diff(t)
    middle = (y[1:] + y[:-1]) / 2 - h / 8 * np.diff(v)
    ends = y * np.exp(-1j * omega * t)
    half = middle * np.exp(-1j * omega * (t[:-1] + h / 2))
    return 2 / (t[-1] - t[0]) * np.sum(h / 6 * (ends[:-1] + 4 * half + ends[1:]))


@pytest.mark.parametrize("seed", range(6))
def test_exact_readings_are_those_of_a_marched_period(seed):
    modes, drive, k, y = random_rig(seed, 12)
    modes = replace(modes, gauge=modes.output[::-1].copy())
    group = [make_elements(k, y)]
    seen = PeriodicMotionFinder(modes, group)(drive)
    one = steady(modes, drive, group)
    done = simulate(modes, drive, group, 1.0, 1, start=one.start, memory=one.memory)
    gauged = simulate(
        replace(modes, output=modes.gauge), drive, group, 1.0, 1, start=one.start, memory=one.memory
    )
    assert np.array_equal(seen.point.motion, one.point.motion)
    assert seen.acceleration == pytest.approx(done.acceleration, rel=1e-10)
    assert seen.displacement == pytest.approx(gauged.output_amplitude, rel=1e-10)
    moved = -(drive.omega**2) * first_harmonic(done.window, drive.omega) - 1j * drive.acceleration
    assert abs(seen.fundamental - moved) < 1e-7 * abs(moved)  # Simpson's rule on 400 samples


def test_exact_a_start_of_other_elements_counts_as_none():
    """A memory speaks of so many elements: one of four is no start for two, nor one of two for
    four."""
    drive = SineDrive(1.0, 1.0)
    four = [make_elements([2.0, 1.0, 0.5, 0.2], [0.1, 0.3, 0.4, 0.6])]
    for mine, other in ((GROUP, four), (four, GROUP)):
        assert (
            PeriodicMotionFinder(MODES, mine)(
                drive, PeriodicMotionFinder(MODES, other)(drive).point
            )[1:]
            == PeriodicMotionFinder(MODES, mine)(drive)[1:]
        )


def test_exact_other_modes_and_elements_take_the_same_room():
    """One after the other in the room of the first, every digit is that of fresh room; other numbers ask for their own
    and leave what is there as it was."""
    orbits = PeriodicMotionFinder(MODES, GROUP)
    drives = [SineDrive(1.0, 1.0), SineDrive(2.0, 1.05)]
    stiff = basis([1.3, 2.0], [0.05, 0.02], [0.7, 1.0], [1.0, 0.5], [0.4, 0.2])
    gauged = replace(MODES, gauge=np.array([0.3, 1.0]))
    others = (stiff, GROUP), (gauged, [make_elements([3.0, 0.4], [0.2, 0.25])]), (MODES, GROUP)
    for modes, group in others:
        assert orbits.replace_system(modes, group)
        for drive in drives:
            assert orbits(drive)[1:] == PeriodicMotionFinder(modes, group)(drive)[1:]
    for modes, group in (
        (basis([1.0], [0.1], [1.0], [1.0], [1.0]), GROUP),
        (MODES, [make_elements([1.0], [0.1])]),
        (MODES, 2 * GROUP),
    ):
        assert not orbits.replace_system(modes, group)
    assert orbits(drives[0])[1:] == PeriodicMotionFinder(MODES, GROUP)(drives[0])[1:]


def test_refuses_a_motion_that_nothing_bounds():
    with pytest.raises(NotConverged):
        PeriodicMotionFinder(
            basis([1.0], [0.0], [1.0], [1.0], [1.0]), [make_elements([1.0], [0.01])]
        )(SineDrive(1.0, 1.0))


def test_exact_a_step_that_is_not_determined_is_the_shortest():
    """x + y = 2 twice: the shortest answer is (1, 1); a matrix of full rank has its only one."""
    assert solve_linear(np.ones((2, 2)))(np.array([2.0, 2.0])) == pytest.approx([1.0, 1.0])
    left = np.array([[4.0, 1.0], [2.0, 3.0]])
    assert left @ solve_linear(left)(np.array([1.0, 2.0])) == pytest.approx([1.0, 2.0], rel=1e-14)
