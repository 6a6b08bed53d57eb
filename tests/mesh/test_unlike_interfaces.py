"""Two pieces with different interface nodes, read from every format; only different ends are refused."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from any_mesh_cases import (
    FORMATS,
    GRID,
    make_pair,
    write_and_read_pair,
)

from patchfem.core import PatchfemError
from patchfem.mesh import TensorGrid, make_graded_grid


def combine_pieces(lower, upper):
    """Return the lower piece of one mesh pair with the upper piece of another."""
    count = len(lower.points)
    lower_cells = [np.isin(tags, (3, 4)) for tags in (lower.triangle_tags, lower.quad_tags)] + [
        np.isin(lower.edge_tags, (12, 14))
    ]
    upper_cells = [np.isin(tags, (1, 2)) for tags in (upper.triangle_tags, upper.quad_tags)] + [
        np.isin(upper.edge_tags, (11, 13))
    ]
    names = (("triangles", "triangle_tags"), ("quads", "quad_tags"), ("edges", "edge_tags"))
    combined = SimpleNamespace(points=np.concatenate([lower.points, upper.points]))
    for (cells, tags), mine, theirs in zip(names, lower_cells, upper_cells):
        setattr(
            combined,
            cells,
            np.concatenate([getattr(lower, cells)[mine], getattr(upper, cells)[theirs] + count]),
        )
        setattr(
            combined,
            tags,
            np.concatenate([getattr(lower, tags)[mine], getattr(upper, tags)[theirs]]),
        )
    return combined


FINE_GRID = make_graded_grid(2e-3, 1.5e-3, 1e-4, 1e-4)


@pytest.mark.parametrize("form", FORMATS)
def test_exact_pieces_preserve_different_nodes(form, tmp_path):
    """Pieces with different interface nodes are read with their own nodes, in every format."""
    pair = write_and_read_pair(
        combine_pieces(make_pair("quads"), make_pair("triangles", FINE_GRID)), tmp_path, form
    )
    assert pair.lower.x.size != pair.upper.x.size
    for piece, grid in ((pair.lower, GRID), (pair.upper, FINE_GRID)):
        assert np.abs(piece.x - grid.x).max() <= 1e-12 * grid.length
        assert piece.areas().sum() == pytest.approx(grid.length * grid.height, rel=1e-12)
        assert piece.tributary_lengths().sum() == pytest.approx(grid.length, rel=1e-12)
    assert (pair.lower.height, pair.upper.height) == pytest.approx((1e-3, 1.5e-3))
    assert abs(pair.upper.refine().x[0] - pair.lower.refine().x[0]) <= 1e-12 * GRID.length


@pytest.mark.parametrize("factor", [1 + 1e-6, 1.05, 0.95, 1 - 1e-8])
def test_refuses_interfaces_of_different_length(factor, tmp_path):
    """Interfaces of different length are refused unless they differ only by rounding."""
    grid = TensorGrid(FINE_GRID.x * factor, FINE_GRID.depth, FINE_GRID.coating_rows)
    with pytest.raises(
        PatchfemError,
        match=r"do not match \(lengths 0\.002 and .*let both interfaces begin and end",
    ):
        write_and_read_pair(combine_pieces(make_pair("quads"), make_pair("quads", grid)), tmp_path)
    grid = TensorGrid(FINE_GRID.x * (1 + 1e-10), FINE_GRID.depth, FINE_GRID.coating_rows)
    assert (
        write_and_read_pair(
            combine_pieces(make_pair("quads"), make_pair("quads", grid)), tmp_path
        ).upper.x.size
        == FINE_GRID.x.size
    )
