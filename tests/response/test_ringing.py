"""Frequency and damping of ringing during stick: known signals and closed forms of stuck rigs."""

import numpy as np
import pytest
from scene_texts import KILOGRAM

from patchfem import load
from patchfem.response.ringing import fit_ringing
from patchfem.runs.run import run

RELEASE = (
    """\
[normal]
load = "130.8 N"
[friction]
law = "{law}"
static = 0.3
bond_length = "{length} um"
"""
    + KILOGRAM
    + """\
[drive]
kind = "free"
displacement = "200 um"
cycles = {cycles}
[accuracy]
steps_per_cycle = {steps}
"""
)
TWO_MODES = """\
[normal]
load = "{load} N"
[friction]
law = "coulomb"
static = 0.3
[structure]
moving_mass = "1 kg"
[[structure.mode]]
name = "first"
frequency = "60 Hz"
damping = 0.02
slide = 1.0
[[structure.mode]]
name = "second"
frequency = "700 Hz"
damping = 0.01
slide = 0.7
base = 0.0
output = 0.5
[drive]
kind = "base"
frequency = "15 Hz"
acceleration = "5 m/s^2"
cycles = 60
"""


def make_signal(t, omega, own, zeta, size=1.0, phase=0.3):
    """Return an offset, a forced sine and a decaying sine at the times t."""
    rate = zeta * own / np.sqrt(1 - zeta**2)
    return 0.7 + 2 * np.sin(omega * t + 0.4) + size * np.exp(-rate * t) * np.cos(own * t + phase)


@pytest.mark.parametrize(
    "modes",
    [
        [(12, 0.02, 1.0), (31, 0.01, 0.3)],
        [(100, 0.01, 1.0), (70, 0.005, 0.2), (8, 0.002, 0.04)],
    ],
)
def test_exact_strongest_of_several_ringings_is_found(modes):
    """Of two or three ringings the strongest one is found, whose frequency is the first."""
    t = np.linspace(0, 1.0, 501)
    value = sum(make_signal(t, 3.0, 2 * np.pi * f, zeta, size) for f, zeta, size in modes)
    assert fit_ringing(t, value, 3.0).frequency == pytest.approx(modes[0][0], rel=1e-6)


SIGNALS_WITHOUT_RINGING = {
    "forced motion alone": lambda t: make_signal(t, 20.0, 1.0, 0.0, size=0.0),
    "noise": lambda t: (
        make_signal(t, 20.0, 50.0, 0.01) + 0.2 * np.random.default_rng(3).normal(size=t.size)
    ),
    "harmonic of the drive": lambda t: make_signal(t, 20.0, 60.0, 0.0),
    "overdamped": lambda t: make_signal(t, 20.0, 30.0, 0.7),
    "growing": lambda t: make_signal(t, 20.0, 50.0, -0.1),
    "one period": lambda t: make_signal(t, 0.0, 2 * np.pi, 0.05),
    "few samples": lambda t: make_signal(t, 20.0, 400.0, 0.01)[:15],
}


@pytest.mark.parametrize("name", SIGNALS_WITHOUT_RINGING)
def test_signal_without_ringing_has_no_fit(name):
    """Neither forced motion nor a vibration in noise, that grows, is damped too much or is too short counts as ringing."""
    t = np.linspace(0, 1.0, 301)
    value = SIGNALS_WITHOUT_RINGING[name](t)
    assert fit_ringing(t[: value.size], value, 20.0) is None


def test_exact_ringing_error_covers_noise():
    """In 1 % noise, the errors of at least 38 of 40 fits cover the true frequency; their median is below 0.02."""
    source = np.random.default_rng(7)
    t = np.linspace(0, 1.0, 301)
    held = 0
    wide = []
    for _ in range(40):
        found = fit_ringing(
            t, make_signal(t, 3.0, 2 * np.pi * 7, 0.01) + 0.01 * source.normal(size=t.size), 3.0
        )
        held += abs(found.frequency - 7) <= found.errors[0]
        wide.append(found.errors[0])
    assert held >= 38 and np.median(wide) < 0.02


@pytest.mark.share(0)
@pytest.mark.parametrize(
    ("length", "hertz"), [(2, 719.326), (5, 468.232), (10, 346.186), (100, 174.323)]
)
def test_exact_released_block_rings_on_bond_stiffness(length, hertz):
    """A released block rings with sqrt(omega^2 + mu N/(m eps)) within 1.2e-5."""
    text = RELEASE.format(law="elastic-plastic", length=length, cycles=40, steps=4000)
    found = run(load(text), estimate=False).measures
    assert found["ring_frequency"].value == pytest.approx(hertz, rel=1.2e-5)
    assert found["ring_damping"].value == pytest.approx(0.003 * 143 / hertz, rel=1e-4)


def test_exact_second_mode_rings_during_stick():
    """During stick, the ringing has the eigenvalue of the two modes joined at the interface within 1e-6."""
    scene = load(TWO_MODES.format(load=10))
    result = run(scene)
    modes = result.plan.model.rig.modes
    found = result.measures
    assert result.extra["engine"] == "hybrid" and 0.1 < found["stick_fraction"].value < 1
    across = np.array([-modes.slide[1], modes.slide[0]]) / np.hypot(*modes.slide)
    own = np.sqrt(across @ np.diag(modes.omega**2) @ across)
    zeta = across @ modes.damping_matrix @ across / (2 * own)
    assert found["ring_frequency"].value == pytest.approx(
        own * np.sqrt(1 - zeta**2) / (2 * np.pi), rel=1e-6
    )
    assert found["ring_damping"].value == pytest.approx(zeta, rel=1e-5)
    assert found["ring_frequency"].error < 1e-3 * found["ring_frequency"].value
