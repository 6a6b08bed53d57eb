"""Readings of an accelerometer for motions with known harmonics."""

import numpy as np
import pytest

from patchfem.core import Response, SineDrive
from patchfem.measures import read_instrument

OMEGA = 2 * np.pi * 143


def make_motion(drive):
    """Return one cycle of a motion with three harmonics, and the harmonics of its acceleration."""
    parts = {1: 3e-5 - 1e-5j, 2: 4e-6j, 3: -2e-6 + 1e-6j}
    t = np.linspace(0, 2 * np.pi / OMEGA, 2001)
    y, v, a = (
        sum((c * (1j * n * OMEGA) ** k * np.exp(1j * n * OMEGA * t)).real for n, c in parts.items())
        for k in range(3)
    )
    base = drive.values(t) if drive.moving else 0 * t
    none = np.zeros(t.size)
    total = {n: -((n * OMEGA) ** 2) * c for n, c in parts.items()}
    if drive.moving:
        total[1] -= 1j * drive.acceleration
    return Response(t, y[:, None], v[:, None], y, v, y, v, a + base, base, none, none), total


@pytest.mark.parametrize("moving", [True, False])
def test_exact_readings_of_known_harmonics(moving):
    """Peak, fundamental, rms and low-pass readings agree with those computed from the known harmonics."""
    drive = SineDrive(30.0, OMEGA, moving)
    window, total = make_motion(drive)
    peak = float(np.abs(window.acceleration).max())
    assert read_instrument(window, drive, peak) == peak
    assert read_instrument(window, drive, peak, "fundamental") == pytest.approx(
        abs(total[1]), rel=1e-9
    )
    effective = np.sqrt(sum(abs(c) ** 2 for c in total.values()) / 2)
    assert read_instrument(window, drive, peak, "rms") == pytest.approx(effective, rel=1e-9)
    fine = np.linspace(0, 2 * np.pi / OMEGA, 100001)
    for cutoff in (200.0, 600.0):
        passed = 0
        for n, c in total.items():
            s = 1j * n * 143 / cutoff
            passed = (
                passed + (c / (1 + np.sqrt(2) * s + s * s) * np.exp(1j * n * OMEGA * fine)).real
            )
        assert read_instrument(window, drive, peak, "lowpass", cutoff) == pytest.approx(
            np.abs(passed).max(), rel=2e-5
        )
