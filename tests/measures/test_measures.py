"""Measures of signals whose values are known in closed form."""

from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_loops import evenly

from patchfem import motion_measures
from patchfem.measures import measures


@given(st.floats(0, pi), st.floats(0, 0.22))
def test_always_slip_start_phase_is_mean_modulo_pi(middle, spread):
    """Slip starts that agree modulo pi have their mean as the phase."""
    phases = 2 * np.array([middle - spread, middle + spread, middle + pi, middle - 3 * pi])
    sums = (0.0, phases.size, np.cos(phases).sum(), np.sin(phases).sum())
    found = motion_measures.measure_stick(sums, 1.0)["slip_start_phase"]
    assert 0 <= found <= pi
    assert min(abs(found - middle % pi), pi - abs(found - middle % pi)) < 1e-9


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
    peak, error = measures.interpolate_peak(curve)
    assert peak <= 50 * (1 + 1e-12)
    assert 50 - peak <= error * (1 + 1e-9)
    assert error <= max(1.0, fall)
