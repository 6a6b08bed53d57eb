"""An accelerometer and a gauge that do not move alike: what each sees of one motion, in every engine."""

import numpy as np
import pytest

from patchfem import SceneError, run
from patchfem.response import measure_half_range, read_instrument
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
POINT = '[normal]\nload = "115 N"\n[friction]\nstatic = 0.4\n'
LAWS = {
    "elastic-plastic": 'law = "elastic-plastic"\nbond_length = "1 um"\n',
    "coulomb": 'law = "coulomb"\n',
    "tanh": 'law = "tanh"\nreference_speed = "5 mm/s"\n',
    "nonlocal": 'law = "nonlocal"\nbond_length = "5 um"\n',
}
FELT, SEEN = {"axial": 1.0, "yaw": -0.4}, {"axial": 0.9, "yaw": 0.2}
NAMES = "absolute_acceleration_peak", "relative_displacement_amplitude"


def sets(key, rows):
    return [f"structure.mode.{name}.{key}={value}" for name, value in rows.items()]


def values(text, *given):
    found = run(loads(text, sets=given))
    return found, [found.measures[name] for name in NAMES]


@pytest.mark.share(0, 2, 4, 6)
@pytest.mark.parametrize(
    "law, method",
    [
        ("elastic-plastic", "auto"),
        ("elastic-plastic", "march"),
        ("elastic-plastic", "harmonic"),
        ("coulomb", "auto"),
        ("coulomb", "harmonic"),
        ("tanh", "auto"),
        ("nonlocal", "harmonic"),
    ],
)
def test_exact_accelerometer_and_gauge_read_the_same_motion(law, method):
    """Friction knows nothing of instruments: the acceleration is that of a run whose output is the accelerometer, and
    the displacement that of one whose output is the gauge."""
    text = (
        POINT
        + LAWS[law]
        + MODES
        + (f'[accuracy]\nmethod = "{method}"\n' if method != "auto" else "")
    )
    text += "" if method != "march" else "steps_per_cycle = 400\n"
    text = text if method == "harmonic" else text.replace("cycles = 100", "cycles = 10")
    both, (acceleration, displacement) = values(
        text, *sets("accelerometer", FELT), *sets("gauge", SEEN)
    )
    _, (felt, _) = values(text, *sets("output", FELT))
    gauged, (_, seen) = values(text, *sets("output", SEEN))
    assert acceleration.value == felt.value
    assert displacement.value == pytest.approx(seen.value, rel=1e-6)
    assert both.outcome == gauged.outcome
    assert displacement.error is not None
    assert abs(displacement.value - seen.value) <= displacement.error + 1e-10
    assert np.array_equal(both.window.output, both.window.modal @ both.plan.model.rig.modes.gauge)


def test_exact_a_linear_rig_in_closed_form():
    """z = -a base/(Omega^2 - omega^2 + 2 i zeta Omega omega), and both instruments' sums of it."""
    text = MODES[: MODES.index("[structure.bonded]")] + MODES[MODES.index("[drive]") :]
    text = text.replace('"yaw"\n', '"yaw"\nbase = 0.3\n').replace(
        "slide = 1.0", "slide = 1.0\nbase = 0.9"
    )
    found, (acceleration, displacement) = values(
        text, *sets("accelerometer", FELT), *sets("gauge", SEEN), "accuracy.method=harmonic"
    )
    w = 2 * np.pi * 140
    a = 5 * 9.80665
    own = 2 * np.pi * np.array([143.0, 129.0])
    zeta = np.array([0.02, 0.03])
    base = np.array([0.9, 0.3])
    z = -a * base / (own**2 - w**2 + 2j * zeta * own * w)
    felt = abs(a - w**2 * z @ [1.0, -0.4])
    assert acceleration.value == pytest.approx(felt, rel=1e-6)
    assert displacement.value == pytest.approx(abs(z @ [0.9, 0.2]), rel=1e-8)
    drive = found.plan.model.rig.drive.signal
    assert read_instrument(found.window, drive, acceleration.value, "fundamental") == pytest.approx(
        felt, rel=1e-8
    )


@pytest.mark.parametrize(
    "more, said",
    [
        (("structure.travel=5 mm",), "with structure.travel"),
        (("structure.stiffening.cubic=1e12 N/m^3",), "with structure.stiffening"),
        (("drive.waveform=levels",), "waveform = 'levels'"),
    ],
)
def test_refuses_instruments_where_the_output_is_judged(more, said):
    with pytest.raises(SceneError, match=said):
        loads(POINT + LAWS["coulomb"] + MODES, sets=["structure.mode.yaw.gauge=0.2", *more])


def test_exact_half_a_swing_of_cubics():
    t = np.array([0.0, 1.0, 3.0])
    y = t**3 - 4 * t**2 + 2 * t
    v = 3 * t**2 - 8 * t + 2
    peak = (lambda x: x**3 - 4 * x**2 + 2 * x)((8 - np.sqrt(40)) / 6)
    valley = (lambda x: x**3 - 4 * x**2 + 2 * x)((8 + np.sqrt(40)) / 6)
    assert measure_half_range(t, y, v) == pytest.approx((peak - valley) / 2, rel=1e-14)
