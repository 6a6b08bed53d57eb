"""The first root and the largest value of a power series, against its roots."""

import numpy as np
import pytest

from patchfem.compiled.no_jit import load_uncompiled

series = load_uncompiled("patchfem.dynamics.events.series_kernels")


def test_exact_first_root_of_a_long_series_is_the_first_of_several():
    random = np.random.default_rng(4)
    rooms = np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
    later = 0
    for case in range(400):
        places = np.sort(random.uniform(0.02, 1.4, int(random.integers(1, 5))))
        if case % 4 == 0:
            places = np.append(places, places[0] + 10.0 ** random.uniform(-5, -1))  # a pair
        poly = np.array([1.0])
        factor = random.uniform(-2, 2)
        for place in places:
            poly = np.convolve(poly, [1.0, -1 / place])
        # exp(factor u) has no root; its terms beyond the 20th are below round-off
        poly = np.convolve(poly, np.cumprod([1.0, *(factor / k for k in range(1, 21))]))
        low = case % 2  # a series that begins with a power of u
        row = np.zeros(series.MAX_POWER + 4)
        row[low : low + poly.size] = poly
        found = series.find_first_root(row, low, low + poly.size - 1, rooms)
        first = places.min()
        slope = np.polyval(np.polyder(poly[::-1]), first)
        # what round-off moves a root
        near = 1e-15 * np.polyval(np.abs(poly)[::-1], first) / abs(slope) + 1e-15
        assert found == (series.NO_ROOT if first > 1 else pytest.approx(first, abs=near)), places
        if first <= 1:
            look = series.find_possible_root(row, low, low + poly.size - 1, rooms[0])
            lone = series.prove_first_root(row, low, low + poly.size - 1, look, rooms)
            assert lone == series.NO_ROOT or lone == pytest.approx(first, abs=near)
            later += lone == series.NO_ROOT
    assert later < 200  # most are found the short way


@pytest.mark.parametrize("seed", range(4))
def test_exact_largest_value_of_a_polynomial(seed):
    random = np.random.default_rng(seed)
    poly = random.normal(size=12) / np.arange(1, 13)
    row = np.zeros(series.MAX_POWER + 2)
    row[:12] = poly
    turns = np.roots((poly[1:] * np.arange(1, 12))[::-1])
    turns = turns[(abs(turns.imag) < 1e-12) & (turns.real > 0) & (turns.real < 1)].real
    want = np.abs(np.polyval(poly[::-1], np.concatenate([turns, [0.0, 1.0]]))).max()
    found = series.find_largest_magnitude(
        row, 11, 0.0, np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
    )
    assert found == pytest.approx(want, rel=1e-13)
    assert (
        series.find_largest_magnitude(
            row, 11, 2 * want, np.zeros((series.MAX_HALVINGS + 2, series.N_HULL_COLUMNS))
        )
        == 2 * want
    )
