"""A crowned piece pressed on a flat piece of the same material, compared with Hertz's line contact."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pieces import TITANIUM, make_bare_layers, make_compliance, make_refined_grid
from pressed import press

from patchfem.contact.gaps import crown

HALF_WIDTH = 0.1e-3  # half-width of the contact [m]
LOAD = 9107.0  # per metre of width [N/m]
PLANE_MODULUS = {"strain": TITANIUM[0] / (1 - TITANIUM[1] ** 2), "stress": TITANIUM[0]}


@cache
def press_crown(per_half_width, plane="strain"):
    """Return the grid and the contact state of the crowned pair."""
    grid = make_refined_grid(1.5 * HALF_WIDTH, HALF_WIDTH / per_half_width, 12.7e-3, 6e-3)
    pair = make_compliance(grid, make_bare_layers(TITANIUM, plane), width=1.0)
    # a^2 = 4 P R/(pi E*), with E* = E'/2 because both pieces are elastic
    radius = np.pi * PLANE_MODULUS[plane] / 2 * HALF_WIDTH**2 / (4 * LOAD)
    return grid, press(pair, crown(grid.x, radius), LOAD)


def fit_half_width(x, p):
    """Return the contact half-width from a fit of p^2 = A - B x^2 inside 0.8 a."""
    inside = np.abs(x) < 0.8 * HALF_WIDTH
    slope, intercept = np.polyfit(x[inside] ** 2, p[inside] ** 2, 1)
    return np.sqrt(-intercept / slope)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_hertz_peak_pressure_and_half_width(plane):
    """Peak pressure and half-width agree with Hertz within 3e-4 and 5e-4 at 16 elements per half-width."""
    grid, state = press_crown(16, plane)
    peak = 2 * LOAD / (np.pi * HALF_WIDTH)
    assert state.sigma_n.max() == pytest.approx(peak, rel=3e-4)
    assert fit_half_width(grid.x, state.sigma_n) == pytest.approx(HALF_WIDTH, rel=5e-4)
    inside = np.abs(grid.x) < 0.9 * HALF_WIDTH
    hertz = peak * np.sqrt(1 - (grid.x[inside] / HALF_WIDTH) ** 2)
    assert np.abs(state.sigma_n[inside] - hertz).max() <= 8e-3 * peak
    assert state.load == pytest.approx(LOAD, rel=1e-10)
    assert np.abs(grid.x[state.sigma_n > 0]).max() <= HALF_WIDTH + HALF_WIDTH / 16
