"""Measures of a rig without friction, compared with closed forms."""

import numpy as np
import pytest
from scene_texts import MODE

import patchfem as pf

LINEAR = MODE.replace("damping = 0.003", "damping = {damping}")
DRIVE = '[drive]\nkind = "base"\nfrequency = "{frequency} Hz"\nacceleration = "5 g"\ncycles = {cycles}\n'


def test_exact_measures_of_a_linear_rig_agree_with_closed_forms():
    """The amplitude from rest at resonance without damping, and the steady one with damping, are those of closed forms.

    From rest z = -a/(2 w^2) (sin wt - wt cos wt), whose extremes of the last cycle are those at wt = n pi.
    """
    omega = 2 * np.pi * 143.0
    acceleration = 5 * 9.80665
    text = LINEAR.format(damping=0) + DRIVE.format(frequency=143, cycles=10)
    result = pf.run(text)
    assert result.outcome == "grows"
    expected = acceleration / omega**2 * np.pi * (20 + 19) / 4
    assert result.measures["relative_displacement_amplitude"].value == pytest.approx(
        expected, rel=1e-9
    )

    text = LINEAR.format(damping=0.2) + DRIVE.format(frequency=100, cycles=60)
    result = pf.run(text)
    drive = 2 * np.pi * 100.0
    expected = acceleration / abs(omega**2 - drive**2 + 0.4j * omega * drive)
    measure = result.measures["relative_displacement_amplitude"]
    assert measure.value == pytest.approx(expected, rel=1e-10)
    assert measure.error < 1e-8 * expected


def test_exact_linear_rig_ends_at_its_travel():
    """A rig that grows ends where |z| = a/(2 w^2) |sin wt - wt cos wt| reaches the travel, at that time."""
    travel = '[structure]\ntravel = "0.5 mm"'
    text = LINEAR.format(damping=0).replace("[structure]", travel, 1)
    result = pf.run(text + DRIVE.format(frequency=143, cycles=100))
    assert result.outcome == "exceeds_travel"
    phase = 2 * np.pi * 143.0 * result.response.time[-1]
    size = 5 * 9.80665 / (2 * np.pi * 143.0) ** 2 / 2
    assert size * abs(np.sin(phase) - phase * np.cos(phase)) == pytest.approx(5e-4, rel=1e-9)
