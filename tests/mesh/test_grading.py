"""Graded columns, and grids split and merged cell by cell."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from patchfem.mesh import Layout, TensorGrid, divide_into_columns, divide_into_rows, graded_grid
from patchfem.mesh.tensor import graded_depth


@given(
    place=st.floats(-0.5, 0.5),
    least=st.floats(1e-5, 1e-2),
    slope=st.floats(0.05, 0.6),
    wide=st.floats(0.01, 0.9),
)
def test_always_cells_follow_the_layout(place, least, slope, wide):
    """Cells add up to the length, none is longer than wanted at its farther end, neighbours differ by the slope."""
    low = max(-0.5, place - wide)
    layout = Layout(-0.5, 0.5, ((place, place, least),), (low, place), max(least, 0.05), 0.1, slope)
    x = divide_into_columns(layout)
    cells = np.diff(x)
    assert x[0] == -0.5 and x[-1] == 0.5 and cells.min() > 0 and cells.size % 2 == 0
    ends = layout.cell_lengths(x)
    assert (cells <= 1.02 * np.maximum(ends[1:], ends[:-1]) + 1e-12).all()
    inner = cells[1:] / cells[:-1]
    assert np.abs(np.log(inner)).max() <= 1.6 * slope + 0.05
    assert cells[np.argmin(np.abs((x[1:] + x[:-1]) / 2 - place))] <= 2.5 * least * (1 + slope)


def test_exact_columns_of_a_linear_size_are_a_geometric_series():
    """At equal steps of the integral of dx/(least + slope x) the places grow by one factor."""
    layout = Layout(-0.5, 0.5, ((-0.5, -0.5, 1e-3),), (-0.5, 0.5), 1.0, 1.0, 0.25)
    x = divide_into_columns(layout) + 0.5 + 1e-3 / 0.25
    ratio = x[1:] / x[:-1]
    assert ratio == pytest.approx(np.full(ratio.size, ratio[0]), rel=2e-4)
    assert x.size == 25 and np.log(ratio[0]) == pytest.approx(np.log(251) / 24, rel=2e-4)


def test_exact_symmetric_layouts_give_symmetric_columns():
    x = divide_into_columns(
        Layout(-1.0, 1.0, ((-0.3, -0.3, 1e-4), (0.3, 0.3, 1e-4)), (-0.3, 0.3), 0.04, 0.1, 0.5)
    )
    assert np.abs(x + x[::-1]).max() <= 1e-12


def test_exact_a_band_and_places_to_go_through_are_kept():
    """Cells within a band are as long as asked; a column stands at each place, and there is an even number of cells."""
    layout = Layout(-1.0, 1.0, ((-0.2, 0.1, 0.01),), (-1.0, 1.0), 0.1, 0.1, 0.5)
    x = divide_into_columns(layout, (0.37,))
    cells = np.diff(x)
    middle = (x[1:] + x[:-1]) / 2
    inside = (middle > -0.19) & (middle < 0.09)
    assert 0.37 in x and cells.size % 2 == 0
    assert cells[inside] == pytest.approx(np.full(inside.sum(), 0.01), rel=0.06)  # whole cells


@pytest.mark.parametrize("coating", [0.0, 0.2])
def test_exact_rows_end_at_the_coating(coating):
    layout = Layout(
        0.0, 1.0, ((0.0, 0.0, 0.02), (coating, coating, 0.03)), (0.0, 1.0), 0.2, 0.2, 0.5
    )
    depth, coated = divide_into_rows(layout, coating)
    assert (
        depth[0] == 0 and depth[-1] == 1 and depth[coated] == coating and np.diff(depth).min() > 0
    )
    assert np.diff(depth)[coated] <= 0.03 * 1.6


@pytest.mark.parametrize("coating", [0.0, 152.4e-6])
def test_exact_splitting_and_merging_undo_one_another(coating):
    grid = graded_grid(12.7e-3, 6.35e-3, 0.2e-3, coating)
    twice = grid.refine().refine()
    back = twice.coarsen().coarsen()
    assert twice.coating_rows == 4 * grid.coating_rows and twice.coating_thickness == pytest.approx(
        coating, abs=1e-18
    )
    assert np.array_equal(back.x, grid.x) and np.array_equal(back.depth, grid.depth)
    assert back.coating_rows == grid.coating_rows


def test_exact_a_geometric_series_of_rows_stays_one_when_split():
    depth = np.concatenate([[0.0], np.cumsum(1.3 ** np.arange(12))])
    heights = np.diff(TensorGrid(np.linspace(-1, 1, 5), depth, 0).refine().depth)
    assert heights[1:] / heights[:-1] == pytest.approx(
        np.full(heights.size - 1, 1.3**0.5), rel=1e-12
    )


def test_exact_merging_keeps_what_is_left_over():
    grid = graded_grid(10.0, 4.0, 10 / 7, 1.0)
    half = grid.coarsen()
    assert (
        half.x.size == 5
        and half.length == pytest.approx(10.0)
        and half.height == 4.0
        and half.coating_thickness == 1.0
    )


def test_exact_depths_reach_the_coating_and_the_far_face():
    depth, rows = graded_depth(5.0, 0.01, 0.3, 1.2, 2)
    assert depth[0] == 0 and depth[rows] == 0.3 and depth[-1] == 5.0 and np.diff(depth).min() > 0
    assert (np.diff(depth)[1:] <= 1.2 * np.diff(depth)[:-1] * (1 + 1e-6)).all()


@pytest.mark.parametrize("rows", [9, 10, 33, 34])
def test_exact_merged_rows_go_on_growing_whether_even_or_odd(rows):
    depth = np.concatenate([[0.0], np.cumsum(1.1 ** np.arange(rows))])
    half = np.diff(TensorGrid(np.linspace(-1, 1, 5), depth, 0).coarsen().depth)
    assert half.size == (rows + 1) // 2 and half.sum() == pytest.approx(depth[-1])
    assert (half[1:] / half[:-1] >= 1.15).all() and (half[1:] / half[:-1] <= 1.22).all()
