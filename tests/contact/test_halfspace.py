"""The periodic half-plane solver against Westergaard, Hertz, a dense solve, and the finite-element pair against it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from pieces import CARBIDE, COATED, COATING, HEIGHT, LENGTH, TITANIUM, pair_of
from study_module import study

from patchfem.closed_forms import contact as exact
from patchfem.contact import press
from patchfem.contact.gaps import crown
from patchfem.contact.unilateral import solve_forces
from patchfem.mesh import TensorGrid
from patchfem.mesh.tensor import graded_rows

halfspace = study("common/halfspace.py")
press_periodic, residuals, wave_numbers = (
    halfspace.press_periodic,
    halfspace.residuals,
    halfspace.wave_numbers,
)
WAVE, HIGH = 80e-6, 1.5e-6
MODULUS = exact.combined_modulus(*CARBIDE)
FULL = exact.westergaard_full_pressure(WAVE, HIGH, MODULUS)


def half_planes(points, length, modulus=MODULUS):
    """C(k) of two bodies of one material each, nothing for k = 0."""
    k = wave_numbers(points, length)
    return np.concatenate([[0.0], 2 / (modulus * k[1:])])


def coated(points, length):
    """C(k) of the coated pair, half planes below the coatings."""
    k = wave_numbers(points, length)
    return np.concatenate([[0.0], 2 * exact.layered_compliance(k[1:], CARBIDE, TITANIUM, COATING)])


def places(points, length):
    return (np.arange(points) - points // 2) * length / points


@cache
def waves(points, share):
    x = places(points, WAVE)
    gap = 2 * HIGH * np.sin(np.pi * x / WAVE) ** 2
    return x, press_periodic(half_planes(points, WAVE), gap, WAVE, share * FULL * WAVE)


# ---- the wavy surface


@pytest.mark.parametrize("share", [0.3, 0.5, 0.7, 0.9, 0.99])
def test_exact_westergaard_at_64_points_per_half_wave(share):
    """p(0) to 1e-4, edge to a cell, mean gap closed to 1e-4 at 64 points; pressure everywhere to 1e-2 at 1024."""
    args = share * FULL, WAVE, HIGH, MODULUS
    x, state = waves(128, share)
    assert state.pressure[64] == pytest.approx(exact.westergaard_pressure(0.0, *args), rel=1e-4)
    assert np.abs(x[state.pressure > 0]).max() == pytest.approx(
        exact.westergaard_half_width(*args), abs=WAVE / 128
    )
    assert state.closing == pytest.approx(exact.westergaard_approach(*args), rel=1e-4)
    x, state = waves(2048, share)
    p = exact.westergaard_pressure(x, *args)
    assert np.abs(state.pressure - p)[np.abs(p) > 0.2 * p.max()].max() <= 1e-3 * p.max()
    assert state.closing == pytest.approx(exact.westergaard_approach(*args), rel=1e-6)
    assert state.iterations <= 250  # conjugate directions; steepest descent takes 3000


# ---- crowns


def crowned(half, fine, growth):
    """Coated piece with columns of `fine` over |x| <= half, growing outwards; at least 8 rows in the coating."""
    outer = half + np.cumsum(graded_rows(fine * growth, LENGTH / 2 - half, growth))
    right = np.concatenate([np.arange(1, round(half / fine) + 1) * fine, outer])
    rows = graded_rows(min(fine, COATING / 8), COATING, growth, 8)
    under = graded_rows(rows[-1] * growth, HEIGHT - COATING, growth)
    depth = np.concatenate(
        [[0.0], np.cumsum(rows)[:-1], [COATING], COATING + np.cumsum(under)[:-1], [HEIGHT]]
    )
    return TensorGrid(np.concatenate([-right[::-1], [0.0], right]), depth, rows.size)


@pytest.mark.parametrize(
    "radius, load, low, high, within",
    [
        (0.01, 1e4, 0.98, 0.995, 1e-3),  # contact of a fifth of the coating: nearly all carbide
        (0.01, 2e5, 0.83, 0.87, 2e-3),  # as wide as the coating is thick
        (0.1, 1e5, 0.73, 0.76, 2e-3),
    ],
)  # three times as wide
def test_exact_coated_finite_elements_agree_with_coated_half_planes(
    radius, load, low, high, within
):
    """The finite block and the transform share no line of code; `low` to `high`: peak over Hertz on carbide alone."""
    wide = exact.hertz_half_width(load, radius, exact.combined_modulus(*TITANIUM))
    fine = exact.hertz_half_width(load, radius, MODULUS) / 16
    points = 8 * round(LENGTH / fine / 2)
    x = places(points, points * fine / 4)
    truth = press_periodic(
        coated(points, points * fine / 4), crown(x, radius), points * fine / 4, load
    )
    peak = truth.pressure.max()
    assert low <= peak / exact.hertz_peak(load, radius, MODULUS) <= high
    grid = crowned(16 * fine * np.ceil(1.5 * wide / fine / 16), fine, 1.1)
    state = press(pair_of(grid, COATED, 1.0), crown(grid.x, radius), load)
    half = np.abs(x[truth.pressure > 0]).max()
    same = np.interp(grid.x, x, truth.pressure)
    inside = np.abs(grid.x) < 0.9 * half
    assert state.sigma_n.max() == pytest.approx(peak, rel=within)
    assert np.abs(state.sigma_n - same)[inside].max() <= 4e-3 * peak
    assert np.abs(grid.x[state.sigma_n > 0]).max() == pytest.approx(half, abs=1.01 * fine)
    near = (np.abs(grid.x) > 1.1 * half) & (np.abs(grid.x) < 1.4 * half)
    opened = np.interp(grid.x[near], x, truth.gap)
    assert np.abs(state.gap[near] - opened).max() <= 1e-2 * opened.max()


# ---- any gap


@example(4, 24476, 1.8125, -9.0, True)  # one point touches on the way, another still overlaps
@given(
    st.integers(4, 120),
    st.integers(0, 2**32 - 1),
    st.floats(-3, 6),
    st.floats(-9, -5),
    st.booleans(),
)
def test_always_the_dense_active_set_finds_the_same(points, seed, load, height, smooth):
    """The same circulant operator as a full matrix, solved by the primal-dual active set."""
    rng = np.random.default_rng(seed)
    gap = 10**height * rng.normal(size=points)
    gap = np.cumsum(gap) if smooth else gap
    length = 1e-3
    load = 10**load
    compliance = coated(points, length)
    compliance[0] = compliance[1]
    state = press_periodic(compliance, gap, length, load)
    column = np.fft.irfft(compliance, points) * points / length
    dense = column[(np.arange(points)[:, None] - np.arange(points)) % points]
    force, motion, _ = solve_forces(dense, places(points, length), gap, np.array([load]))
    step = length / points
    assert np.abs(state.pressure * step - force).max() <= 1e-6 * force.max()
    assert state.closing == pytest.approx(
        motion[0], abs=1e-8 * (abs(motion[0]) + compliance[0] * force.max() / step)
    )


# ---- wrong answers are seen, wrong questions refused
