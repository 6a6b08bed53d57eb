"""First root and largest magnitude of a power series, against the known roots of polynomials."""

import numpy as np
import pytest

from patchfem.compiled.no_jit import load_uncompiled

series = load_uncompiled("patchfem.dynamics.events.series_kernels")


def test_exact_first_root_of_series_is_smallest_root():
    """The first root of random series with up to five roots is found within the round-off of the
    series."""
    rng = np.random.default_rng(4)
    workspace = np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
    for case in range(150):
        roots = np.sort(rng.uniform(0.02, 1.4, int(rng.integers(1, 5))))
        if case % 4 == 0:
            roots = np.append(roots, roots[0] + 10.0 ** rng.uniform(-5, -1))  # two close roots
        poly = np.array([1.0])
        factor = rng.uniform(-2, 2)
        for root in roots:
            poly = np.convolve(poly, [1.0, -1 / root])
        # exp(factor u) adds no root; its terms above the 20th are below round-off
        poly = np.convolve(poly, np.cumprod([1.0, *(factor / k for k in range(1, 21))]))
        lowest_power = case % 2  # every second series begins with u instead of a constant
        row = np.zeros(series.MAX_POWER + 4)
        row[lowest_power : lowest_power + poly.size] = poly
        root_found = series.find_first_root(
            row, lowest_power, lowest_power + poly.size - 1, workspace
        )
        first = roots.min()
        slope = np.polyval(np.polyder(poly[::-1]), first)
        # change of a root due to round-off
        tolerance = 1e-15 * np.polyval(np.abs(poly)[::-1], first) / abs(slope) + 1e-15
        assert root_found == (
            series.NO_ROOT if first > 1 else pytest.approx(first, abs=tolerance)
        ), roots


@pytest.mark.parametrize("seed", range(2))
def test_exact_largest_magnitude_of_polynomial(seed):
    """The largest magnitude of a polynomial on [0, 1] agrees within 1e-13 with the values at its
    extremes."""
    rng = np.random.default_rng(seed)
    poly = rng.normal(size=12) / np.arange(1, 13)
    row = np.zeros(series.MAX_POWER + 2)
    row[:12] = poly
    extremes = np.roots((poly[1:] * np.arange(1, 12))[::-1])
    extremes = extremes[
        (abs(extremes.imag) < 1e-12) & (extremes.real > 0) & (extremes.real < 1)
    ].real
    expected = np.abs(np.polyval(poly[::-1], np.concatenate([extremes, [0.0, 1.0]]))).max()
    largest = series.find_largest_magnitude(
        row, 11, 0.0, np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
    )
    assert largest == pytest.approx(expected, rel=1e-13)
    assert (
        series.find_largest_magnitude(
            row, 11, 2 * expected, np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
        )
        == 2 * expected
    )
