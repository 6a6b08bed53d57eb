"""Drives with several tones: superposition of closed forms, beats, energies with friction,
refusals."""

import numpy as np
import pytest

import patchfem as pf

MODE = {"name": "axial", "frequency": 100.0, "damping": 0.02, "slide": 1.0}
RIG = {
    "structure": {"moving_mass": 0.9, "mode": [MODE]},
    "drive": {
        "kind": "base",
        "waveform": "tones",
        "frequencies": ["96 Hz", "102 Hz"],
        "accelerations": ["1 g", "0.5 g"],
        "phases": ["0 deg", "40 deg"],
        "cycles": 160,
    },
}
PLASTIC = {
    "normal": {"load": "20 N"},
    "friction": {"law": "elastic-plastic", "static": 0.3, "bond_length": "5 um"},
}


def response_from_rest(t, tones):
    """Return the displacement of an oscillator (100 Hz, damping 0.02) from rest under base tones (f, a, phase), in closed
    form."""
    omega, zeta = 2 * np.pi * 100, 0.02
    omega_damped = omega * np.sqrt(1 - zeta**2)
    displacement = 0.0
    for f, a, phi in tones:
        w = 2 * np.pi * f
        steady = -a * np.exp(1j * phi) / (omega**2 - w * w + 2j * zeta * omega * w)
        initial = steady.imag
        initial_rate = (1j * w * steady).imag
        free = initial * np.cos(omega_damped * t) + (
            initial_rate + zeta * omega * initial
        ) / omega_damped * np.sin(omega_damped * t)
        displacement = (
            displacement + (steady * np.exp(1j * w * t)).imag - np.exp(-zeta * omega * t) * free
        )
    return displacement


def test_exact_linear_response_to_tones_is_superposition():
    """The response of a linear rig to two tones is the sum of the closed forms of each, and the window is one beat."""
    result = pf.run(RIG)
    tones = ((96, 9.80665, 0), (102, 9.80665 / 2, np.radians(40)))
    expected = response_from_rest(result.response.time, tones)
    assert np.abs(result.response.output - expected).max() < 1e-6 * np.abs(expected).max()
    # The window is one beat of 1/6 s, in cycles of 96 Hz.
    assert result.outcome == "steady" and result.settings.window_cycles == 16
    t = np.linspace(10, 10 + 1 / 6, 20001)
    steady = response_from_rest(t, tones)
    assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
        np.ptp(steady) / 2, rel=1e-5
    )


def test_exact_energies_under_two_tones_balance():
    """With friction under two tones the energies balance; the drift has no value, with a reason."""
    measures = pf.run(RIG | PLASTIC).measures
    assert measures["drift_per_cycle"].value is None
    assert "within their beat without any drift" in measures["drift_per_cycle"].reason
    assert measures["energy_balance"].value < 1e-7
    assert measures["energy_dissipated"].value > 0
    assert measures["work_check"].value < 1e-7
