"""Harmonics of motion, acceleration and friction force from non-uniform samples."""

from math import pi

import numpy as np
import pytest

from patchfem.measures import spectrum

OMEGA, PERIOD = 2.0, pi


def make_nonuniform_times(count: int, steps: int):
    """Return non-uniform times of `count` cycles with both ends."""
    time = np.linspace(0, count * PERIOD, count * steps + 1)
    times = np.unique(
        np.concatenate([time, time[3::7] + 0.2 * PERIOD / steps, np.nextafter(time[5::11], 0)])
    )
    return times[times <= time[-1]]


def test_order_motion_harmonic_is_four():
    """The error of the harmonics of a motion falls with the fourth power of the step."""
    errors = []
    for steps in (40, 80, 160):
        t = make_nonuniform_times(3, steps)
        y = 0.7 + np.sin(OMEGA * t) + 0.4 * np.cos(3 * OMEGA * t)
        v = OMEGA * (np.cos(OMEGA * t) - 1.2 * np.sin(3 * OMEGA * t))
        errors.append(
            abs(spectrum.compute_motion_harmonic(t, y, v, OMEGA) + 1j)
            + abs(spectrum.compute_motion_harmonic(t, y, v, 3 * OMEGA) - 0.4)
        )
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.2)
    assert errors[-1] < 1e-7


@pytest.mark.parametrize("steps", [8, 100])
def test_exact_harmonics_of_jumping_acceleration(steps):
    """The odd harmonics of an acceleration of +-1 by half cycles are 4/(pi n)."""
    t = np.unique(np.concatenate([make_nonuniform_times(2, steps), np.arange(5) * PERIOD / 2]))
    half, part = np.divmod(t, PERIOD / 2)
    way = 1 - 2 * (half % 2)
    speed = way * (part - PERIOD / 4)
    place = way * (part**2 / 2 - PERIOD / 4 * part)
    for n in (1, 3):
        found = spectrum.compute_acceleration_harmonic(t, place, speed, n * OMEGA)
        assert found == pytest.approx(-4j / (pi * n), abs=1e-3 if steps == 8 else 1e-9)
