"""Adaptive sampling of a curve: linear interpolation against a resonance in closed form."""

import numpy as np
import pytest

from patchfem.runs.rig.steady.curves import sample_adaptively


def magnification(f, zeta):
    """Return the magnification 1/|1 - r^2 + 2 i zeta r| of a mode at 143 Hz."""
    r = f / 143.0
    return 1 / np.abs(1 - r**2 + 2j * zeta * r)


def sample_curve(function, *options):
    """Return the values and the abscissas (k,) of the samples of a function."""
    return np.array(sample_adaptively(lambda x, near: (function(x), x), *options)).T


@pytest.mark.parametrize("zeta", [1e-3, 0.3])
@pytest.mark.parametrize("ends", [(60.0, 210.0), (211.0, 61.0)])
def test_always_linear_interpolation_of_peak_meets_tolerance(zeta, ends):
    """Linear interpolation between the samples agrees with a resonance curve within the tolerance
    of 1 %. The initial spacing of 1.25 Hz exceeds the half-power width of the sharpest peak, 0.29
    Hz."""
    values, frequencies = sample_curve(
        lambda f: magnification(f, zeta), np.linspace(*ends, 121), 0.01
    )
    assert (
        np.all(np.diff(frequencies) * np.sign(ends[1] - ends[0]) > 0)
        and np.isin(np.linspace(*ends, 121), frequencies).all()
    )
    assert frequencies.size < 260
    order = np.argsort(frequencies)
    fine = np.linspace(61, 210, 100001)
    lines = np.interp(fine, frequencies[order], values[order])
    assert np.abs(lines / magnification(fine, zeta) - 1).max() < 0.01
    assert values.max() == pytest.approx(1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=0.01)


def test_always_tolerance_is_met_with_few_points():
    """A tolerance of 1e-4 is met with fewer than three times the optimal number of points, int
    sqrt(|y''|/(8 tolerance y)) df."""
    tolerance = 1e-4
    values, frequencies = sample_curve(
        lambda f: magnification(f, 3e-3), np.linspace(120, 170, 6), tolerance
    )
    fine = np.linspace(120, 170, 200001)
    true = magnification(fine, 3e-3)
    assert np.abs(np.interp(fine, frequencies, values) / true - 1).max() < tolerance
    curvature = np.abs(np.gradient(np.gradient(true, fine), fine))
    assert frequencies.size < 3 * np.sum(np.sqrt(curvature / (8 * tolerance * true))) * (
        fine[1] - fine[0]
    )


def test_always_refinement_ends_at_jump_and_gap():
    """Refinement ends at a jump, which is located to 1e-6 of its position, and at a gap of NaN,
    where no bounded motion exists."""
    frequencies = sample_curve(
        lambda f: 1.0 if f < 101.3 else np.nan if f > 150 else 5.0, np.linspace(60, 210, 31)
    )[1]
    assert frequencies.size < 100 and np.diff(frequencies).min() < 1e-3
