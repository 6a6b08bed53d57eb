"""Instrument readings of periodic motions against an integrated period, and start values from other
systems."""

from dataclasses import replace

import numpy as np
import pytest
from test_elastic_plastic import make_basis, random_rig

from patchfem.core import NotConverged, SineDrive
from patchfem.dynamics import PeriodicMotionFinder, make_elements
from patchfem.dynamics.events.histories import simulate
from patchfem.dynamics.events.steady import solve_steady as steady

MODES = make_basis([1.0, 2.3], [0.01, 0.02], [1.0, 0.4], [1.0, 0.5], [1.0, 0.2])
GROUP = [make_elements([2.0, 1.0], [0.1, 0.3])]


def first_harmonic(window, omega):
    """Return 2/T int y exp(-i omega t) of the displacement, by Simpson's rule on cubics through the
    samples."""
    t = window.time
    y = window.output
    v = window.output_rate
    h = np.diff(t)
    middle = (y[1:] + y[:-1]) / 2 - h / 8 * np.diff(v)
    ends = y * np.exp(-1j * omega * t)
    middle_value = middle * np.exp(-1j * omega * (t[:-1] + h / 2))
    return 2 / (t[-1] - t[0]) * np.sum(h / 6 * (ends[:-1] + 4 * middle_value + ends[1:]))


@pytest.mark.parametrize("seed", range(3))
def test_exact_readings_agree_with_integrated_period(seed):
    """Acceleration and displacement of a periodic motion agree within 1e-10 with an integrated
    period, and its first harmonic within 1e-7."""
    modes, drive, k, y = random_rig(seed, 12)
    modes = replace(modes, gauge=modes.output[::-1].copy())
    group = [make_elements(k, y)]
    orbit = PeriodicMotionFinder(modes, group)(drive)
    expected = steady(modes, drive, group)
    result = simulate(modes, drive, group, 1.0, 1, start=expected.start, memory=expected.memory)
    gauge_result = simulate(
        replace(modes, output=modes.gauge),
        drive,
        group,
        1.0,
        1,
        start=expected.start,
        memory=expected.memory,
    )
    assert np.array_equal(orbit.point.motion, expected.point.motion)
    assert orbit.acceleration == pytest.approx(result.acceleration, rel=1e-10)
    assert orbit.displacement == pytest.approx(gauge_result.output_amplitude, rel=1e-10)
    harmonic = (
        -(drive.omega**2) * first_harmonic(result.window, drive.omega) - 1j * drive.acceleration
    )
    assert abs(orbit.fundamental - harmonic) < 1e-7 * abs(harmonic)  # Simpson's rule on 400 samples


def test_exact_reused_arrays_give_identical_results():
    """Systems of equal size that reuse the arrays of a finder give bit-identical results. Systems
    of other sizes are not accepted and leave the finder unchanged."""
    orbits = PeriodicMotionFinder(MODES, GROUP)
    drives = [SineDrive(1.0, 1.0), SineDrive(2.0, 1.05)]
    stiff = make_basis([1.3, 2.0], [0.05, 0.02], [0.7, 1.0], [1.0, 0.5], [0.4, 0.2])
    gauged = replace(MODES, gauge=np.array([0.3, 1.0]))
    others = (stiff, GROUP), (gauged, [make_elements([3.0, 0.4], [0.2, 0.25])]), (MODES, GROUP)
    for modes, group in others:
        assert orbits.replace_system(modes, group)
        for drive in drives:
            assert orbits(drive)[1:] == PeriodicMotionFinder(modes, group)(drive)[1:]
    for modes, group in (
        (make_basis([1.0], [0.1], [1.0], [1.0], [1.0]), GROUP),
        (MODES, [make_elements([1.0], [0.1])]),
        (MODES, 2 * GROUP),
    ):
        assert not orbits.replace_system(modes, group)
    assert orbits(drives[0])[1:] == PeriodicMotionFinder(MODES, GROUP)(drives[0])[1:]


def test_refuses_unbounded_motion():
    """An undamped mode at resonance with too little friction is refused."""
    with pytest.raises(NotConverged):
        PeriodicMotionFinder(
            make_basis([1.0], [0.0], [1.0], [1.0], [1.0]), [make_elements([1.0], [0.01])]
        )(SineDrive(1.0, 1.0))
