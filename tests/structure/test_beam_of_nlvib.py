"""A clamped beam with dry friction, a published example, solved by `harmonic` and an independent harmonic balance.

The independent balance is condensed to the friction coordinate and uses FFT and a general root
finder. The matrices are those of example 08 of NLvib, which are not part of the project; they are
read from PATCHFEM_DATA.
"""

import os
import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.io import loadmat
from scipy.optimize import fsolve

import patchfem as pf

FOLDER = os.environ.get("PATCHFEM_DATA")
FILE = Path(FOLDER or ".") / "nlvib-beam.mat"
SCENE = """\
[structure]
output_mass = 2
[structure.reduced]
stiffness = "nlvib-beam.mat"
mass = "nlvib-beam.mat"
damping = "nlvib-beam.mat"
boundary = [5, 15]
modes = 14
[[structure.interface]]
between = [1, 0]
law = "tanh"
static = 1.0
load = "1.5 N"
reference_speed = "{} m/s"
[drive]
kind = "force"
force = "0.2 N"
mass = 2
frequency = "{} Hz"
cycles = 5
[accuracy]
method = "harmonic"
"""


def solve_harmonic_balance(omega: float, speed: float, harmonics: int, samples: int) -> float:
    """Return half the peak-to-peak displacement [m] of the tip at omega [rad/s] under friction 1.5 N tanh(v/speed)."""
    data = {
        name: value.astype(float)
        for name, value in loadmat(FILE).items()
        if not name.startswith("_")
    }
    M, K, D = (data[name] for name in "MKD")
    friction_row, force_row, tip_row = (data[name].ravel() for name in ("W", "Fex1", "T_tip"))
    k = np.arange(harmonics + 1)
    receptance = np.linalg.inv(
        -((k * omega)[:, None, None] ** 2) * M + 1j * (k * omega)[:, None, None] * D + K
    )
    friction_receptance = receptance @ friction_row @ friction_row
    forced_response = receptance[1] @ force_row
    wave = np.exp(1j * np.outer(k, 2 * np.pi * np.arange(samples) / samples))

    def friction(slide):
        force = np.fft.fft(1.5 * np.tanh(np.real((1j * k * omega * slide) @ wave) / speed))[
            : harmonics + 1
        ]
        return force * np.where(k == 0, 1, 2) / samples

    def unpack(x):
        return np.concatenate([[x[0]], x[1 : harmonics + 1] + 1j * x[harmonics + 1 :]]) * 1e-7

    def residual(x):
        remainder = unpack(x) + friction_receptance * friction(unpack(x))
        remainder[1] -= friction_row @ forced_response
        return np.concatenate([[remainder[0].real], remainder[1:].real, remainder[1:].imag]) / 1e-7

    x, _, status, _ = fsolve(residual, np.zeros(2 * harmonics + 1), full_output=True, xtol=1e-12)
    assert status == 1
    tip_motion = -(receptance @ friction_row @ tip_row) * friction(unpack(x))
    tip_motion[1] += forced_response @ tip_row
    fine_wave = np.exp(1j * np.outer(k, np.linspace(0, 2 * np.pi, 20001)))
    return float(np.ptp(np.real(tip_motion @ fine_wave))) / 2


def run_beam(folder, omega: float, speed: float):
    """Return the amplitude measure of the beam at omega [rad/s]."""
    shutil.copy(FILE, folder)
    (folder / "beam.toml").write_text(
        SCENE.format(repr(float(speed)), repr(float(omega / (2 * np.pi))))
    )
    return pf.run(folder / "beam.toml").measures["relative_displacement_amplitude"]


@pytest.mark.long
@pytest.mark.skipif(not (FOLDER and FILE.is_file()), reason="PATCHFEM_DATA has no nlvib-beam.mat")
@pytest.mark.parametrize("omega, approximate", [(110.0, 5.20919e-7), (123.4, 1.752136e-6)])
def test_exact_beam_amplitude_agrees_with_harmonic_balance(tmp_path, omega, approximate):
    """The amplitude agrees with the independent balance within 1e-7 where friction is almost viscous.

    The friction speed is 6e-7 m times omega; 123.4 rad/s is close to the resonance.
    """
    measure = run_beam(tmp_path, omega, 6e-7 * omega)
    reference = solve_harmonic_balance(omega, 6e-7 * omega, 31, 1024)
    np.testing.assert_allclose(measure.value, reference, rtol=1e-7)
    np.testing.assert_allclose(reference, approximate, rtol=2e-6)


@pytest.mark.long
@pytest.mark.share(1)
@pytest.mark.skipif(not (FOLDER and FILE.is_file()), reason="PATCHFEM_DATA has no nlvib-beam.mat")
@pytest.mark.parametrize("omega", [193.0, 300.0])
def test_always_stated_error_covers_nearly_discontinuous_friction(tmp_path, omega):
    """The stated error covers the difference from the independent balance where friction is almost discontinuous.

    The friction speed is 6e-7 m/s, so the Fourier series converge slowly.
    """
    measure = run_beam(tmp_path, omega, 6e-7)
    reference = solve_harmonic_balance(omega, 6e-7, 61, 4096)
    assert (
        abs(measure.value - reference) <= measure.error + 1e-6 * reference
        and measure.error < 0.02 * reference
    )
