"""Properties of models that mutation testing showed to be untested."""

import numpy as np
import pytest

from patchfem.model import SlidePath
from patchfem.model.slide import PointLoad


@pytest.mark.parametrize("phase", [0.0, 0.7, -2.0])
def test_exact_path_samples_contain_extremes_of_varying_load(phase):
    """The refined samples of a slide path contain every extreme of the normal load within 1e-12
    s."""
    load = PointLoad(50.0, 20.0, 90.0, phase)
    slide = SlidePath("constant", 1e-4, None, 2e-3, 0.0, None, None)
    time = np.linspace(0.0, 0.05, 12)
    samples, place = load.refine_samples(slide, time, 2e-3 * time, 16)
    np.testing.assert_allclose(place, 2e-3 * samples, rtol=1e-12)
    extremes = (np.pi * np.arange(-2, 12) - phase) / (2 * np.pi * 90.0)
    extremes = extremes[(extremes > 0) & (extremes < 0.05)]
    nearest = np.abs(samples[:, None] - extremes).min(axis=0)
    assert extremes.size >= 8
    assert nearest.max() < 1e-12
