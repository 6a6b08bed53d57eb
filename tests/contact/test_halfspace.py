"""The coated finite-element pair compared with a transform solution of coated half-planes."""

from __future__ import annotations

import contact_forms as exact
import numpy as np
import pytest
from pieces import CARBIDE, COATED, COATING, HEIGHT, LENGTH, TITANIUM, make_compliance
from pressed import press
from study_module import load_study
from support.pieces import compute_row_heights

from patchfem.contact.gaps import crown
from patchfem.mesh import TensorGrid

halfspace = load_study("common/halfspace.py")
MODULUS = exact.combined_modulus(*CARBIDE)


def coated_compliance(n_points, length):
    """Return the compliance C(k) of the coated pair with half-planes below the coatings, zero for k = 0."""
    k = 2 * np.pi * np.fft.rfftfreq(n_points, length / n_points)
    return np.append(0.0, 2 * exact.layered_compliance(k[1:], CARBIDE, TITANIUM, COATING))


def make_points(n_points, length):
    """Return uniform points about zero."""
    return (np.arange(n_points) - n_points // 2) * length / n_points


def make_crown_grid(half_width, spacing, growth):
    """Return a coated grid with uniform columns in the contact that grow outwards, and at least 8 rows of coating."""
    outer = half_width + np.cumsum(
        compute_row_heights(spacing * growth, LENGTH / 2 - half_width, growth)
    )
    right = np.concatenate([np.arange(1, round(half_width / spacing) + 1) * spacing, outer])
    rows = compute_row_heights(min(spacing, COATING / 8), COATING, growth, 8)
    substrate_rows = compute_row_heights(rows[-1] * growth, HEIGHT - COATING, growth)
    depth = np.concatenate(
        [[0.0], np.cumsum(rows)[:-1], [COATING], COATING + np.cumsum(substrate_rows)[:-1], [HEIGHT]]
    )
    return TensorGrid(np.concatenate([-right[::-1], [0.0], right]), depth, rows.size)


@pytest.mark.parametrize(
    "radius, load, min_ratio, max_ratio, tolerance",
    [
        (
            0.01,
            1e4,
            0.98,
            0.995,
            1e-3,
        ),  # contact of a fifth of the coating thickness: nearly a carbide half-plane
        (0.01, 2e5, 0.83, 0.87, 2e-3),  # contact as wide as the coating is thick
        (0.1, 1e5, 0.73, 0.76, 2e-3),
    ],
)  # contact three times as wide as the coating is thick
def test_exact_coated_elements_agree_with_half_plane_transform(
    radius, load, min_ratio, max_ratio, tolerance
):
    """Pressure and gap of the coated finite-element pair agree with the transform solution of coated half-planes.

    The peak relative to Hertz on carbide alone lies between `min_ratio` and `max_ratio`. The two
    solutions share no code.
    """
    substrate_half_width = exact.hertz_half_width(load, radius, exact.combined_modulus(*TITANIUM))
    spacing = exact.hertz_half_width(load, radius, MODULUS) / 16
    n_points = 8 * round(LENGTH / spacing / 2)
    length = n_points / 4 * spacing
    x = make_points(n_points, length)
    reference = halfspace.press_periodic(
        coated_compliance(n_points, length), crown(x, radius), load / length
    )
    peak = reference.pressure.max()
    assert min_ratio <= peak / exact.hertz_peak(load, radius, MODULUS) <= max_ratio
    grid = make_crown_grid(
        16 * spacing * np.ceil(1.5 * substrate_half_width / spacing / 16), spacing, 1.1
    )
    state = press(make_compliance(grid, COATED, 1.0), crown(grid.x, radius), load)
    half_width = np.abs(x[reference.pressure > 0]).max()
    reference_pressure = np.interp(grid.x, x, reference.pressure)
    inside = np.abs(grid.x) < 0.9 * half_width
    assert state.sigma_n.max() == pytest.approx(peak, rel=tolerance)
    assert np.abs(state.sigma_n - reference_pressure)[inside].max() <= 4e-3 * peak
    assert np.abs(grid.x[state.sigma_n > 0]).max() == pytest.approx(half_width, abs=1.01 * spacing)
    is_outside = (np.abs(grid.x) > 1.1 * half_width) & (np.abs(grid.x) < 1.4 * half_width)
    reference_gap = np.interp(grid.x[is_outside], x, reference.gap)
    assert np.abs(state.gap[is_outside] - reference_gap).max() <= 1e-2 * reference_gap.max()
