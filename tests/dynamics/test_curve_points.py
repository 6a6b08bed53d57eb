"""Adaptive sampling of a curve: linear interpolation against a resonance in closed form."""

import numpy as np
import pytest

from patchfem.dynamics import sample_adaptively


def magnification(f, zeta):
    """Return the magnification 1/|1 - r^2 + 2 i zeta r| of a mode at 143 Hz."""
    r = f / 143.0
    return 1 / np.abs(1 - r**2 + 2j * zeta * r)


@pytest.mark.parametrize("zeta", [1e-3, 0.3])
@pytest.mark.parametrize("ends", [(60.0, 210.0), (211.0, 61.0)])
def test_always_linear_interpolation_of_peak_meets_tolerance(zeta, ends):
    """Linear interpolation between the samples agrees with a resonance curve within the tolerance
    of 1 %. The initial spacing of 1.25 Hz exceeds the half-power width of the sharpest peak, 0.29
    Hz."""
    samples = sample_adaptively(
        lambda f, near: (magnification(f, zeta), f), np.linspace(*ends, 121), 0.01
    )
    frequencies = np.array([sample[1] for sample in samples])
    assert (
        np.all(np.diff(frequencies) * np.sign(ends[1] - ends[0]) > 0)
        and np.isin(np.linspace(*ends, 121), frequencies).all()
    )
    assert frequencies.size < 260
    order = np.argsort(frequencies)
    fine = np.linspace(61, 210, 100001)
    lines = np.interp(fine, frequencies[order], np.array([sample[0] for sample in samples])[order])
    assert np.abs(lines / magnification(fine, zeta) - 1).max() < 0.01
    assert max(sample[0] for sample in samples) == pytest.approx(
        1 / (2 * zeta * np.sqrt(1 - zeta**2)), rel=0.01
    )


@pytest.mark.parametrize("tolerance", [1e-4])
def test_always_smaller_tolerance_is_met_with_few_points(tolerance):
    """Smaller tolerances are met with fewer than three times the optimal number of points, int
    sqrt(|y''|/(8 tolerance y)) df."""
    samples = sample_adaptively(
        lambda f, near: (magnification(f, 3e-3), f), np.linspace(120, 170, 6), tolerance
    )
    frequencies = np.array([sample[1] for sample in samples])
    fine = np.linspace(120, 170, 200001)
    true = magnification(fine, 3e-3)
    assert (
        np.abs(np.interp(fine, frequencies, [sample[0] for sample in samples]) / true - 1).max()
        < tolerance
    )
    curvature = np.abs(np.gradient(np.gradient(true, fine), fine))
    assert frequencies.size < 3 * np.sum(np.sqrt(curvature / (8 * tolerance * true))) * (
        fine[1] - fine[0]
    )


def test_always_refinement_ends_at_jump_and_gap():
    """Refinement ends at a jump, which is located to 1e-6 of its position, and at a gap of NaN,
    where no bounded motion exists."""
    samples = sample_adaptively(
        lambda f, near: (1.0 if f < 101.3 else np.nan if f > 150 else 5.0, f),
        np.linspace(60, 210, 31),
    )
    frequencies = np.array([sample[1] for sample in samples])
    assert frequencies.size < 100 and np.diff(frequencies).min() < 1e-3
