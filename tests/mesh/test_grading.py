"""Graded columns, and grids that are refined and coarsened."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.mesh import (
    Layout,
    RowHeights,
    divide_into_columns,
    divide_into_rows,
    make_graded_grid,
)


@given(
    position=st.floats(-0.5, 0.5),
    min_size=st.floats(1e-5, 1e-2),
    slope=st.floats(0.05, 0.6),
    span=st.floats(0.01, 0.9),
)
def test_always_column_widths_follow_layout(position, min_size, slope, span):
    """Columns add up to the length, are no wider than the layout allows, and grow by at most its slope."""
    low = max(-0.5, position - span)
    layout = Layout(
        -0.5,
        0.5,
        ((position, position, min_size), (low, position, max(min_size, 0.05))),
        0.1,
        slope,
    )
    x = divide_into_columns(layout)
    cells = np.diff(x)
    assert x[0] == -0.5 and x[-1] == 0.5 and cells.min() > 0 and cells.size % 2 == 0
    ends = layout.cell_lengths(x)
    assert (cells <= 1.02 * np.maximum(ends[1:], ends[:-1]) + 1e-12).all()
    inner = cells[1:] / cells[:-1]
    assert np.abs(np.log(inner)).max() <= 1.6 * slope + 0.05
    assert cells[np.argmin(np.abs((x[1:] + x[:-1]) / 2 - position))] <= 2.5 * min_size * (1 + slope)


@pytest.mark.parametrize("coating", [0.0, 0.2])
def test_exact_row_boundary_at_coating(coating):
    """A boundary of rows is exactly at the coating thickness."""
    rows = RowHeights(first=0.02, last=0.2, coating=0.03, largest=0.2, growth=0.5)
    depth, coated = divide_into_rows(1.0, coating, rows)
    assert (
        depth[0] == 0 and depth[-1] == 1 and depth[coated] == coating and np.diff(depth).min() > 0
    )
    assert np.diff(depth)[coated] <= 0.03 * 1.6


@pytest.mark.parametrize("coating", [0.0, 152.4e-6])
def test_exact_coarsening_reverses_refinement(coating):
    """Coarsening a refined grid twice gives the original grid exactly."""
    grid = make_graded_grid(12.7e-3, 6.35e-3, 0.2e-3, coating)
    refined = grid.refine().refine()
    coarsened = refined.coarsen().coarsen()
    assert (
        refined.coating_rows == 4 * grid.coating_rows
        and refined.coating_thickness == pytest.approx(coating, abs=1e-18)
    )
    assert np.array_equal(coarsened.x, grid.x) and np.array_equal(coarsened.depth, grid.depth)
    assert coarsened.coating_rows == grid.coating_rows
