"""An accelerometer and a displacement gauge with different mode shapes measure the same motion, in
every engine."""

import numpy as np
import pytest

from patchfem import run
from patchfem.measures import read_instrument
from patchfem.scene import loads

MODES = """
[structure]
moving_mass = "1.2 kg"
[[structure.mode]]
name = "axial"
frequency = "143 Hz"
damping = 0.02
slide = 1.0
[[structure.mode]]
name = "yaw"
frequency = "129 Hz"
damping = 0.03
slide = 0.1
[structure.bonded]
stiffness = "3e5 N/m"
damping = "90 N s/m"
[drive]
kind = "base"
frequency = "140 Hz"
acceleration = "5 g"
cycles = 100
"""
ACCELEROMETER_ROW, GAUGE_ROW = {"axial": 1.0, "yaw": -0.4}, {"axial": 0.9, "yaw": 0.2}
NAMES = "absolute_acceleration_peak", "relative_displacement_amplitude"


def assign_mode_keys(key, rows):
    """Return the --set options of a key of both modes."""
    return [f"structure.mode.{name}.{key}={value}" for name, value in rows.items()]


def test_exact_linear_instruments_agree_with_closed_form():
    """The modal coordinates are z = -a base/(Omega^2 - omega^2 + 2 i zeta Omega omega), and both
    instruments measure their weighted sums."""
    text = MODES[: MODES.index("[structure.bonded]")] + MODES[MODES.index("[drive]") :]
    text = text.replace('"yaw"\n', '"yaw"\nbase = 0.3\n').replace(
        "slide = 1.0", "slide = 1.0\nbase = 0.9"
    )
    sets = [
        *assign_mode_keys("accelerometer", ACCELEROMETER_ROW),
        *assign_mode_keys("gauge", GAUGE_ROW),
        "accuracy.method=harmonic",
    ]
    result = run(loads(text, sets=sets))
    acceleration, displacement = (result.measures[name] for name in NAMES)
    w = 2 * np.pi * 140
    a = 5 * 9.80665
    omegas = 2 * np.pi * np.array([143.0, 129.0])
    zeta = np.array([0.02, 0.03])
    base = np.array([0.9, 0.3])
    z = -a * base / (omegas**2 - w**2 + 2j * zeta * omegas * w)
    expected = abs(a - w**2 * z @ [1.0, -0.4])
    assert acceleration.value == pytest.approx(expected, rel=1e-6)
    assert displacement.value == pytest.approx(abs(z @ [0.9, 0.2]), rel=1e-8)
    drive = result.plan.model.rig.drive.signal
    assert read_instrument(
        result.window, drive, acceleration.value, "fundamental"
    ) == pytest.approx(expected, rel=1e-8)
