"""The graded grid of one piece: exact sums, bounded growth, and rows in the coating."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.mesh import ROW_HEIGHT_GROWTH, compute_row_scale, make_graded_grid
from patchfem.mesh.grid import MIN_PIECE_ROWS


@st.composite
def piece_dimensions(draw):
    """Draw length, height, element size and coating thickness of a piece."""
    length = draw(st.floats(1e-3, 5e-2))
    height = draw(st.floats(1e-3, 2e-2))
    fraction = draw(st.one_of(st.just(0.0), st.floats(1e-3, 0.95)))
    return length, height, length / draw(st.floats(1.0, 150.0)), fraction * height


@given(piece_dimensions())
def test_always_grid_has_given_dimensions_and_coating_rows(piece):
    """The grid has the given dimensions, at least two rows in the coating, and bounded growth of rows."""
    length, height, size, coating = piece
    grid = make_graded_grid(*piece)
    assert grid.length == pytest.approx(length, rel=1e-14)
    assert grid.x[0] == pytest.approx(-grid.x[-1], rel=1e-14)
    assert grid.height == height and grid.depth[0] == 0
    assert grid.coating_thickness == coating
    assert np.diff(grid.x).max() <= min(size, length / 2) * (1 + 1e-9)
    assert np.ptp(np.diff(grid.x)) <= 1e-12 * length
    assert grid.coating_rows >= 2 if coating else grid.coating_rows == 0
    rows = np.diff(grid.depth)
    assert rows.min() > 0 and rows.max() <= height / MIN_PIECE_ROWS * (1 + 1e-5)
    columns = grid.x.size - 1
    for face_row in (rows[0], rows[-1]):
        assert face_row <= length / columns * (1 + ROW_HEIGHT_GROWTH)
    growth = 1.1 + ROW_HEIGHT_GROWTH * compute_row_scale(columns)
    for layer in (rows[: grid.coating_rows], rows[grid.coating_rows :]):
        ratio = layer[1:] / layer[:-1]
        assert np.all(ratio <= growth) and np.all(ratio >= 1 / growth)
    is_coating = grid.is_coating.reshape(grid.x.size - 1, rows.size)
    assert np.all(is_coating @ rows == pytest.approx(coating, rel=1e-12))
