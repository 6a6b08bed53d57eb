"""Difficult cases of dry friction, in every engine that applies, agree with closed forms and other
programs."""

from math import asin, cos, pi, sin

import numpy as np
import pytest
from scene_runs import assert_covers, run_scene
from scipy.optimize import brentq

OMEGA = 2 * pi * 100  # Angular frequency [rad/s] of the mode of 1 kg.
LOAD = 100.0


def format_rig(friction, drive, damping=0.003, frequency=100.0, more=""):
    """Return a scene of one mode of 1 kg under 100 N with the given keys of [friction] and [drive]."""
    return f"""\
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "axial"
frequency = "{frequency} Hz"
damping = {damping}
slide = 1.0
{more}
[normal]
load = "{LOAD} N"
[friction]
law = "coulomb"
{friction}
[drive]
{drive}
"""


def format_base_drive(acceleration, cycles, ratio=1.0):
    """Return the keys of a base acceleration [m/s^2] at a frequency ratio."""
    return (
        f'kind = "base"\nfrequency = "{100 * ratio!r} Hz"\nacceleration = "{acceleration!r} m/s^2"\n'
        f"cycles = {cycles}"
    )


def measure_value(result, name="relative_displacement_amplitude"):
    """Return the value of a measure."""
    return result.measures[name].value


def assert_energy_balance(result, bound):
    """Assert that the energy balance of a run is at most `bound`."""
    assert measure_value(result, "energy_balance") <= bound


SECOND = '[[structure.mode]]\nname = "other"\nfrequency = "271 Hz"\ndamping = 0.01\nslide = 0.0\nbase = 0.0\n'


@pytest.mark.parametrize("second_mode", ["", SECOND], ids=["one mode", "general"])
@pytest.mark.parametrize("exponent", [4, 7, 10])
def test_exact_first_slip_near_friction_limit(exponent, second_mode):
    """For a friction limit of D times the peak drive force, with D just below 1, the first slip is
    9/2 (1 - D)^2 a/omega^2, up to terms of relative order 1 - D and the stated error, which is small for 1e-4."""
    excess = 10.0**-exponent
    result = run_scene(
        format_rig(
            "static = 0.3",
            format_base_drive(30.0 / (1 - excess), 0.5),
            0.0,
            more=second_mode,
        ),
    )
    expected = 4.5 * excess**2 * 30.0 / OMEGA**2
    slip = result.measures["slip_amplitude"]
    assert abs(2 * slip.value - expected) <= 2 * slip.error + 3 * excess * expected
    assert exponent > 4 or slip.error < 1e-3 * slip.value
    assert result.outcome != "stuck"
    assert_energy_balance(result, 1e-10)


def test_exact_free_block_on_table_agrees_with_closed_form():
    """A block on a table under F sin w t slides from the angle a to b by (cos a (b - a) - sin b +
    sin a - D (b - a)^2/2) F/(m w^2) and stops."""
    d = 0.8
    w = 2 * pi * 50
    text = format_rig(
        "static = 0.3",
        f'kind = "force"\nfrequency = "50 Hz"\nforce = "{30 / d!r} N"\ncycles = 30',
        0.0,
        0.0,
    )
    slip_start = asin(d)
    slip_end = brentq(
        lambda t: cos(slip_start) - cos(t) - d * (t - slip_start), slip_start + 0.1, slip_start + pi
    )
    slip = (
        cos(slip_start) * (slip_end - slip_start)
        - sin(slip_end)
        + sin(slip_start)
        - d * (slip_end - slip_start) ** 2 / 2
    )
    exact = run_scene(text, "accuracy.method=exact")
    assert exact.plan.model.rig.structure.frequencies.tolist() == [0]
    assert measure_value(exact) == pytest.approx(slip / 2 * (30 / d) / w**2, rel=1e-9)
    assert measure_value(exact, "stick_fraction") == pytest.approx(
        1 - (slip_end - slip_start) / pi, rel=1e-9
    )
    assert abs(measure_value(exact, "drift_per_cycle")) <= 1e-10 * measure_value(exact)
    assert_energy_balance(exact, 1e-9)
    marched = run_scene(text, "accuracy.method=march")
    assert_covers(marched.measures, {"relative_displacement_amplitude": slip / 2 * (30 / d) / w**2})
    assert_energy_balance(marched, 1e-8)


# Damping, frequency ratio, level, static, cycles, slip amplitude [m] and loop area [J] of an
# independent program (DOP853 at 1e-11 with event search).
PROGRAM_RESULTS = {
    "overdamped": (2.0, 1.0, 10.0, 0.05, 20, 2.177447050215183e-06, 4.354894097337636e-05),
    "eight stops": (0.01, 1 / 16, 10.0, 0.05, 12, 1.3238644852087504e-05, 2.6477289704175477e-4),
}


@pytest.mark.parametrize("name", PROGRAM_RESULTS)
@pytest.mark.parametrize("method", ["auto", "march", "harmonic"])
def test_exact_slip_and_loop_agree_with_independent_program(name, method):
    """Slip amplitude and loop area agree with an independent program, for an overdamped mode and
    for a motion with eight stops per cycle."""
    damping, ratio, level, static, cycles, slip, area = PROGRAM_RESULTS[name]
    result = run_scene(
        format_rig(f"static = {static}", format_base_drive(level, cycles, ratio), damping),
        f"accuracy.method={method}",
    )
    if name == "eight stops" and method == "auto":
        last_cycle = result.response.time > (cycles - 1) / (100 * ratio)
        sticks = result.response.slide_rate[last_cycle] == 0
        assert np.count_nonzero(sticks[1:] & ~sticks[:-1]) == 8
    rel_tol = {"auto": 1e-6, "march": 5e-4, "harmonic": 1e-9}[method]
    assert measure_value(result, "slip_amplitude") == pytest.approx(slip, rel=rel_tol)
    assert measure_value(result, "loop_area") == pytest.approx(area, rel=rel_tol)
    if method != "harmonic":
        assert_energy_balance(result, 1e-7)
