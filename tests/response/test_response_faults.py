"""Properties of measures that mutation tests showed to be unchecked."""

import numpy as np
import pytest

from patchfem.core import Outcome
from patchfem.response import compute_step_harmonic, settling


@pytest.mark.parametrize(
    ("change", "outcome"), [(0.04, Outcome.STEADY), (0.06, Outcome.GROWS), (0.9, Outcome.GROWS)]
)
def test_exact_uniform_growth_threshold(change, outcome):
    """A uniform growth counts as growing from a twentieth of the tolerance."""
    amplitudes = 1 + 1e-3 * change * np.arange(6)
    assert settling.classify(amplitudes, 1e-3) is outcome


def test_exact_first_harmonic_of_square_wave():
    """The first harmonic of a square wave with non-uniform samples is -12j/pi within 1e-14."""
    time = np.array([0.0, 0.1, 0.5, 0.8, 1.0])
    force = compute_step_harmonic(time, np.array([3.0, 3.0, -3.0, -3.0]), 2 * np.pi)
    assert force == pytest.approx(-12j / np.pi, rel=1e-14)
