"""Change of measures if the end of their window lies a fraction of a step elsewhere."""

import numpy as np
import pytest
from scene_texts import COULOMB, DRIVE, KILOGRAM, POINT

import patchfem as pf
from patchfem.core import Response
from patchfem.response import estimate_window_error
from patchfem.response.events import slips_and_displacements
from patchfem.response.loops import mean_drift

PERIOD, STEPS = 1.0, 4000


def make_window(end, cycles):
    """Return samples of a growing, drifting motion with a force over the last `cycles` before `end`."""
    t = np.linspace(end - cycles, end, max(round(cycles * STEPS), 4) + 1)
    y = np.exp(0.3 * t) * np.sin(5 * t)
    v = np.exp(0.3 * t) * (0.3 * np.sin(5 * t) + 5 * np.cos(5 * t))
    a = 40 * np.exp(0.2 * t)
    force = np.tanh(3 * v)
    return Response(t, y[:, None], v[:, None], y, v, y, v, a, 0 * t, force, y - 0.1 * force)


def compute_measures(w, cycles):
    """Return the measures of a window by their definitions."""
    return {
        "drift_per_cycle": mean_drift(w.time, w.slide, w.slide_rate, PERIOD),
        "loop_area": float(np.trapezoid(w.force, w.slide)) / cycles,
        "absolute_acceleration_peak": w.acceleration.max(),
        "friction_force_peak": np.abs(w.force).max(),
        "relative_displacement_amplitude": np.ptp(w.output) / 2,
        "slip_amplitude": np.ptp(slips_and_displacements(w)[0]) / 2,
        "friction_work": float(np.trapezoid(w.force * w.slide_rate, w.time)),
    }


@pytest.mark.parametrize("cycles", [3.0])
@pytest.mark.parametrize("end", [3.7, 4.05])
def test_exact_window_shift_changes_measures_to_first_order(cycles, end):
    """The estimated change of each measure agrees with that of a shifted window within 5 %."""
    offset = 0.05
    here, there = (
        compute_measures(make_window(e, cycles), cycles) for e in (end, end + offset / STEPS)
    )
    # the run begins where it began
    last = compute_measures(make_window(end + offset / STEPS, offset / STEPS), 1.0)["friction_work"]
    there["friction_work"] = here["friction_work"] + last
    found = estimate_window_error(make_window(end, cycles), PERIOD, offset)
    for name, value in here.items():
        assert abs(there[name] - value) == pytest.approx(found[name], rel=0.05, abs=3e-7), name
    assert found["stick_fraction"] == pytest.approx(offset / (cycles * STEPS))


def test_always_window_end_at_sample_has_no_error():
    """A window that ends at a sample has no error of its end."""
    assert estimate_window_error(make_window(3.7, 3.0), PERIOD, 0.0) == {}


def test_always_errors_of_an_end_between_two_steps_contain_exact_values():
    """A march of 10.31 cycles ends half a step early; its works and drift agree with those from event to event."""
    text = POINT + COULOMB + KILOGRAM + DRIVE.replace("cycles = 30", "cycles = 10.31225")
    march = pf.run(text, **{"accuracy.method": "march", "accuracy.steps_per_cycle": 40}).measures
    exact = pf.run(text, **{"accuracy.method": "exact"}).measures
    for name in ("drift_per_cycle", "loop_area", "friction_work", "energy_dissipated"):
        change = abs(march[name].value - exact[name].value)
        assert change <= march[name].error + exact[name].error + march[name].floor, name
