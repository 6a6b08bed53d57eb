"""A clamped beam with dry friction whose matrices others publish, by `harmonic` against a balance written from the
equations alone: condensed to the coordinate that rubs, Fourier series by FFT, a general root finder.

The matrices are those of example 08 of NLvib, which are not the project's: they are read from PATCHFEM_DATA.
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


def balanced(omega: float, speed: float, harmonics: int, samples: int) -> float:
    """Half peak-to-peak [m] of the tip at omega [rad/s] under 1.5 N tanh(v/speed)."""
    data = {
        name: value.astype(float)
        for name, value in loadmat(FILE).items()
        if not name.startswith("_")
    }
    M, K, D = (data[name] for name in "MKD")
    rub, push, tip = (data[name].ravel() for name in ("W", "Fex1", "T_tip"))
    k = np.arange(harmonics + 1)
    receptance = np.linalg.inv(
        -((k * omega)[:, None, None] ** 2) * M + 1j * (k * omega)[:, None, None] * D + K
    )
    own = receptance @ rub @ rub
    pushed = receptance[1] @ push
    wave = np.exp(1j * np.outer(k, 2 * np.pi * np.arange(samples) / samples))

    def friction(slide):
        force = np.fft.fft(1.5 * np.tanh(np.real((1j * k * omega * slide) @ wave) / speed))[
            : harmonics + 1
        ]
        return force * np.where(k == 0, 1, 2) / samples

    def packed(x):
        return np.concatenate([[x[0]], x[1 : harmonics + 1] + 1j * x[harmonics + 1 :]]) * 1e-7

    def residual(x):
        rest = packed(x) + own * friction(packed(x))
        rest[1] -= rub @ pushed
        return np.concatenate([[rest[0].real], rest[1:].real, rest[1:].imag]) / 1e-7

    x, _, found, _ = fsolve(residual, np.zeros(2 * harmonics + 1), full_output=True, xtol=1e-12)
    assert found == 1
    moved = -(receptance @ rub @ tip) * friction(packed(x))
    moved[1] += pushed @ tip
    fine = np.exp(1j * np.outer(k, np.linspace(0, 2 * np.pi, 20001)))
    return float(np.ptp(np.real(moved @ fine))) / 2


def run_at(folder, omega: float, speed: float):
    shutil.copy(FILE, folder)
    (folder / "beam.toml").write_text(
        SCENE.format(repr(float(speed)), repr(float(omega / (2 * np.pi))))
    )
    return pf.run(folder / "beam.toml").measures["relative_displacement_amplitude"]


@pytest.mark.skipif(not (FOLDER and FILE.is_file()), reason="PATCHFEM_DATA has no nlvib-beam.mat")
@pytest.mark.parametrize(
    "omega, near", [(110.0, 5.20919e-7), (123.4, 1.752136e-6), (200.0, 6.51239e-8)]
)
def test_exact_beam_whose_friction_speed_goes_with_the_frequency(tmp_path, omega, near):
    """6e-7 m times omega: almost a viscous damper; 123.4 rad/s is close to the peak."""
    found = run_at(tmp_path, omega, 6e-7 * omega)
    truth = balanced(omega, 6e-7 * omega, 31, 1024)
    np.testing.assert_allclose(found.value, truth, rtol=1e-7)
    np.testing.assert_allclose(truth, near, rtol=2e-6)


@pytest.mark.share(1)
@pytest.mark.skipif(not (FOLDER and FILE.is_file()), reason="PATCHFEM_DATA has no nlvib-beam.mat")
@pytest.mark.parametrize("omega", [193.0, 300.0])
def test_always_the_bar_holds_where_friction_nearly_jumps(tmp_path, omega):
    """6e-7 m/s at all frequencies: the series are long."""
    found = run_at(tmp_path, omega, 6e-7)
    truth = balanced(omega, 6e-7, 61, 4096)
    assert abs(found.value - truth) <= found.error + 1e-6 * truth and found.error < 0.02 * truth
