"""A crowned piece pressed on a flat one of the same material: Hertz's line contact."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from pieces import TITANIUM, bare, pair_of, refined_middle

from patchfem.contact import press
from patchfem.contact.gaps import crown

A = 0.1e-3  # half width wanted [m]
LOAD = 9107.0  # per metre of width [N/m]
HALF_SPACE = {"strain": TITANIUM[0] / (1 - TITANIUM[1] ** 2), "stress": TITANIUM[0]}


def radius(plane):
    """R with a^2 = 4 P R / (pi E*), E* = E'/2 as both pieces are elastic."""
    return np.pi * HALF_SPACE[plane] / 2 * A**2 / (4 * LOAD)


@cache
def pressed(per_half_width, plane="strain"):
    grid = refined_middle(1.5 * A, A / per_half_width, 12.7e-3, 6e-3)
    pair = pair_of(grid, bare(TITANIUM, plane), width=1.0)
    return grid, press(pair, crown(grid.x, radius(plane)), LOAD)


def half_width(x, p):
    """From the fit p^2 = A - B x^2 inside 0.8 a."""
    inside = np.abs(x) < 0.8 * A
    slope, top = np.polyfit(x[inside] ** 2, p[inside] ** 2, 1)
    return np.sqrt(-top / slope)


@pytest.mark.parametrize("plane", ["strain", "stress"])
def test_exact_hertz_peak_within_3e_4_and_half_width_within_5e_4(plane):
    grid, state = pressed(16, plane)
    peak = 2 * LOAD / (np.pi * A)
    assert state.sigma_n.max() == pytest.approx(peak, rel=3e-4)
    assert half_width(grid.x, state.sigma_n) == pytest.approx(A, rel=5e-4)
    inside = np.abs(grid.x) < 0.9 * A
    hertz = peak * np.sqrt(1 - (grid.x[inside] / A) ** 2)
    assert np.abs(state.sigma_n[inside] - hertz).max() <= 8e-3 * peak
    assert state.residuals["force_balance"] <= 1e-10
    assert np.abs(grid.x[state.sigma_n > 0]).max() <= A + A / 16


def test_order_hertz_pressure_in_the_mean_square_is_one():
    counts = np.array([8, 16, 32])
    errors = []
    for count in counts:
        grid, state = pressed(int(count))
        peak = 2 * LOAD / (np.pi * A)
        hertz = peak * np.sqrt(np.maximum(1 - (grid.x / A) ** 2, 0))
        errors.append(
            np.sqrt(
                grid.tributary_lengths()
                @ (state.sigma_n - hertz) ** 2
                / (grid.tributary_lengths() @ hertz**2)
            )
        )
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert order == pytest.approx(1.0, abs=0.1)
    assert errors[-1] <= 1.3e-2


def test_exact_hertz_gap_outside_the_contact():
    grid, state = pressed(32)
    peak = 2 * LOAD / (np.pi * A)
    x = grid.x[(grid.x > 1.1 * A) & (grid.x < 1.5 * A)] / A
    opened = (
        peak
        * A
        / HALF_SPACE["strain"]
        * 2
        * (x * np.sqrt(x**2 - 1) - np.log(x + np.sqrt(x**2 - 1)))
    )
    found = state.gap[(grid.x > 1.1 * A) & (grid.x < 1.5 * A)]
    assert np.abs(found / opened - 1).max() <= 1e-2
