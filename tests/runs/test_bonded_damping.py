"""The damper of a bonded spring acts whether the spring is linear or interlocks, in runs, sweeps and backbones."""

import numpy as np
import pytest
from scene_runs import assert_agree, assert_covers, load_scene, run_scene
from scipy.integrate import solve_ivp

import patchfem as pf

OMEGA, DAMPING, STIFFNESS, WAVELENGTH = 2 * np.pi * 50, 0.01, 2e4, 1e-3
LIMIT, SPEED, ACCELERATION, CYCLES = 3.0, 0.01, 20.0, 15
SCENE = f"""[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "a"
frequency = "50 Hz"
damping = {DAMPING}
slide = 1.0
[structure.bonded]
stiffness = "{STIFFNESS} N/m"
damping = "20 N s/m"
[normal]
load = "{LIMIT / 0.3} N"
[friction]
law = "tanh"
static = 0.3
reference_speed = "{SPEED} m/s"
[drive]
kind = "base"
frequency = "50 Hz"
acceleration = "{ACCELERATION} m/s^2"
cycles = {CYCLES}
"""
INTERLOCK = f"structure.bonded.wavelength={WAVELENGTH} m"
LONG = "structure.bonded.wavelength=1 km"  # longer than any motion, so that the spring is linear
RELEASE = '[drive]\nkind = "free"\ndisplacement = "1 um"\ncycles = 10\n'


def integrate_block(damper: float) -> tuple[float, float]:
    """Return the output amplitude [m] of the last cycle and the friction work [J] of the whole run.

    `damper` is the coefficient [N s/m] of the bonded joint. The equation of motion is integrated by DOP853.
    """

    def rates(time, state):
        slide, speed, _ = state
        friction = LIMIT * np.tanh(speed / SPEED)
        spring = STIFFNESS * WAVELENGTH / (2 * np.pi) * np.sin(2 * np.pi * slide / WAVELENGTH)
        force = friction + spring + (2 * DAMPING * OMEGA + damper) * speed + OMEGA**2 * slide
        return [speed, -force - ACCELERATION * np.sin(OMEGA * time), friction * speed]

    period = 2 * np.pi / OMEGA
    options = {"method": "DOP853", "rtol": 1e-11, "atol": 1e-14, "dense_output": True}
    solution = solve_ivp(rates, (0, CYCLES * period), [0.0, 0.0, 0.0], **options)
    last = np.linspace((CYCLES - 1) * period, CYCLES * period, 40001)
    return float(np.ptp(solution.sol(last)[0])) / 2, float(solution.y[2, -1])


@pytest.mark.parametrize("method", ["exact", "march"])
@pytest.mark.parametrize("damper", [20, 200])
def test_covers_integration_with_damper(method, damper):
    """Amplitude and friction work of a block with a damped interlock agree with an integration within their errors."""
    changes = f"{INTERLOCK}; structure.bonded.damping={damper} N s/m; accuracy.method={method}"
    measures = run_scene(SCENE, changes).measures
    amplitude, work = integrate_block(damper)
    references = {"relative_displacement_amplitude": amplitude, "energy_dissipated": work}
    assert_covers(measures, references, 1e-7)


@pytest.mark.parametrize("method", ["exact", "march", "harmonic"])
def test_long_wavelength_equals_linear_spring(method):
    """An interlock much longer than the motion gives the measures of a linear spring with the same damper."""
    names = "relative_displacement_amplitude loop_area absolute_acceleration_peak"
    linear, interlock = (
        run_scene(SCENE, f"{changes}accuracy.method={method}").measures
        for changes in ("", f"{LONG}; ")
    )
    assert_agree(linear, interlock, names)


@pytest.mark.parametrize("method", ["exact", "march"])
def test_small_free_motion_decays_with_damper(method):
    """A small free motion decays at half the rate of mode and damper, at the frequency with the spring at rest."""
    release = SCENE[: SCENE.index("[normal]")] + RELEASE
    response = run_scene(release, f"{INTERLOCK}; accuracy.method={method}").response
    rate = DAMPING * OMEGA + 10
    frequency = np.sqrt(OMEGA**2 + STIFFNESS - rate**2)
    phase = frequency * response.time
    expected = np.cos(phase) + rate / frequency * np.sin(phase)
    expected *= 1e-6 * np.exp(-rate * response.time)
    assert response.output == pytest.approx(expected, abs=1e-10)


def test_sweep_and_backbone_contain_damper():
    """The cases of a sweep over the damper, and the damping of a backbone, are those of a linear spring."""
    over = {"structure.bonded.damping": [20, 200]}
    swept = [pf.sweep(load_scene(SCENE, changes), over) for changes in ("", LONG)]
    linear, interlock = (one.relative_displacement_amplitude.values for one in swept)
    assert interlock == pytest.approx(linear, rel=1e-6)
    backbones = [
        pf.backbone(load_scene(SCENE, changes), amplitudes=1e-4, method="balance")
        for changes in ("", LONG)
    ]
    linear, interlock = (one.balance_damping.values for one in backbones)
    assert interlock == pytest.approx(linear, rel=1e-6)
