"""Measures of signals whose values are known in closed form."""

from math import asin, cos, pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_loops import evenly

from patchfem.core import G_N, Response, SineDrive
from patchfem.response import measures

OMEGA = 2 * pi * 143
DRIVE = SineDrive(5 * G_N, OMEGA)


def make_response(time, slip=None, slide=None, force=None, acceleration=None):
    """Return a response with the given signals and zeros elsewhere."""
    zero = np.zeros(time.size)
    pick = [zero if v is None else v for v in (slip, slide, force, acceleration)]
    return Response(
        time,
        zero[:, None],
        zero[:, None],
        pick[1],
        zero,
        pick[1],
        zero,
        pick[3],
        zero,
        pick[2],
        pick[0],
    )


# energy and loop


# slip


@pytest.mark.parametrize("floor", [0.2])
def test_exact_slip_measures_with_stick_phases(floor):
    """Slip amplitude, stick fraction and phase of a slip with pauses agree with the closed form."""
    steps = 8000
    time, _ = evenly(4, steps)
    start = asin(floor)

    def stroke(phase):
        turn, part = np.divmod(phase, pi)
        inside = np.clip(part, start, pi - start)
        one = cos(start) - np.cos(inside) - floor * (inside - start)
        full = 2 * cos(start) - floor * (pi - 2 * start)
        return np.where(turn % 2 == 0, one, full - one)

    found = measures.compute_slip_measures(
        make_response(time, slip=stroke(OMEGA * time), slide=-np.cos(OMEGA * time)), DRIVE, steps
    )
    level = asin(2 * floor)
    assert found["slip_amplitude"] == pytest.approx(cos(start) - floor * (pi / 2 - start), rel=1e-6)
    assert found["stick_fraction"] == pytest.approx(2 * level / pi, abs=1 / steps)
    assert found["slip_start_phase"] == pytest.approx(level, abs=1e-6)


def test_exact_slip_measures_at_rest_and_in_sliding():
    """An interface at rest has a stick fraction of 1, and one in steady sliding of 0."""
    time, _ = evenly(2, 100)
    still = measures.compute_slip_measures(make_response(time), DRIVE, 100)
    assert still == {"slip_amplitude": 0.0, "stick_fraction": 1.0}
    steady = measures.compute_slip_measures(
        make_response(time, slip=1e-3 * time, slide=2e-3 * time), DRIVE, 100
    )
    assert steady["stick_fraction"] == 0.0 and "slip_start_phase" not in steady


@given(st.floats(0, pi), st.floats(0, 0.22))
def test_always_slip_start_phase_is_mean_modulo_pi(middle, spread):
    """Slip starts that agree modulo pi have their mean as the phase."""
    found = measures.slip_start_measure(
        np.array([middle - spread, middle + spread, middle + pi, middle - 3 * pi])
    )
    found = found["slip_start_phase"]
    assert 0 <= found <= pi
    assert min(abs(found - middle % pi), pi - abs(found - middle % pi)) < 1e-9


# peaks


@pytest.mark.parametrize("shift", [0.3, 0.5])
def test_order_acceleration_peak_is_four(shift):
    """The error of the acceleration peak between samples falls with the fourth power of the step."""
    errors = []
    steps = (50, 100, 200)
    for count in steps:
        _, phase = evenly(2, count)
        top = (7 + shift) * 2 * pi / count
        found = measures.compute_peak(-7 * np.cos(phase - top))
        errors.append(abs(found / 7 - 1))
    assert np.log2(np.array(errors[:-1]) / errors[1:]) == pytest.approx(4, abs=0.1)
    assert errors[-1] < (2 * pi / steps[-1]) ** 4 / 30


@pytest.mark.parametrize("shift", [0.05, 0.3, 0.5, 0.8, 0.95])
@pytest.mark.parametrize("fall", [0.4, 1.0, 3.0])
def test_always_error_of_peak_at_kink_contains_it(shift, fall):
    """The peak of a curve with a kink between two samples lies within the stated error of the largest sample."""
    place = np.arange(40.0) - 20 - shift
    curve = np.where(place < 0, 50 + place, 50 - fall * place)
    peaks, errors = measures.interpolate_peaks(curve[:, None])
    assert peaks[0] <= 50 * (1 + 1e-12)
    assert 50 - peaks[0] <= errors[0] * (1 + 1e-9)
    assert errors[0] <= max(1.0, fall)
