"""Two pieces whose interface nodes lie at other x: read from every format, refused only where their ends differ."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from any_mesh_cases import (
    FORMATS,
    GRID,
    find_interface_node,
    make_pair,
    shift_points,
    write_and_read_pair,
)
from hypothesis import given
from hypothesis import strategies as st

from patchfem.core import PatchfemError
from patchfem.mesh import TensorGrid, graded_grid


def unlike(lower, upper):
    """The lower piece of one drawn pair with the upper piece of another one."""
    count = len(lower.points)
    kept = [np.isin(tags, (3, 4)) for tags in (lower.triangle_tags, lower.quad_tags)] + [
        np.isin(lower.edge_tags, (12, 14))
    ]
    brought = [np.isin(tags, (1, 2)) for tags in (upper.triangle_tags, upper.quad_tags)] + [
        np.isin(upper.edge_tags, (11, 13))
    ]
    names = (("triangles", "triangle_tags"), ("quads", "quad_tags"), ("edges", "edge_tags"))
    out = SimpleNamespace(points=np.concatenate([lower.points, upper.points]))
    for (cells, tags), mine, theirs in zip(names, kept, brought):
        setattr(
            out,
            cells,
            np.concatenate([getattr(lower, cells)[mine], getattr(upper, cells)[theirs] + count]),
        )
        setattr(
            out, tags, np.concatenate([getattr(lower, tags)[mine], getattr(upper, tags)[theirs]])
        )
    return out


FINER = graded_grid(2e-3, 1.5e-3, 1e-4, 1e-4)


@pytest.mark.parametrize("form", FORMATS)
def test_exact_both_pieces_keep_their_own_nodes(form, tmp_path):
    pair = write_and_read_pair(
        unlike(make_pair("quads"), make_pair("triangles", FINER)), tmp_path, form
    )
    assert not pair.has_matching_nodes
    for piece, grid in ((pair.lower, GRID), (pair.upper, FINER)):
        assert np.abs(piece.x - grid.x).max() <= 1e-12 * grid.length
        assert piece.areas().sum() == pytest.approx(grid.length * grid.height, rel=1e-12)
        assert piece.tributary_lengths().sum() == pytest.approx(grid.length, rel=1e-12)
    assert (pair.lower.height, pair.upper.height) == pytest.approx((1e-3, 1.5e-3))
    assert abs(pair.upper.refine().x[0] - pair.lower.refine().x[0]) <= 1e-12 * GRID.length


def test_exact_alike_pieces_match_and_one_node_aside_does_not(tmp_path):
    assert write_and_read_pair(make_pair("mixed"), tmp_path).has_matching_nodes
    near = make_pair("quads")
    aside = make_pair("quads")
    shift_points(near, find_interface_node(near), (1e-13, 0))
    shift_points(aside, find_interface_node(aside), (1e-7, 0))
    assert write_and_read_pair(near, tmp_path).has_matching_nodes
    pair = write_and_read_pair(aside, tmp_path)
    assert not pair.has_matching_nodes and np.abs(
        pair.upper.x - pair.lower.x
    ).max() == pytest.approx(1e-7, rel=1e-6)


@given(cells=st.lists(st.floats(0.1, 1.0), min_size=2, max_size=20), shift=st.floats(-1.0, 1.0))
def test_always_any_nodes_between_the_same_ends_are_read(cells, shift, tmp_path_factory):
    x = np.concatenate([[0.0], np.cumsum(cells)]) / np.sum(cells)
    x = (x - 0.5) * 2e-3
    x[-1] = 1e-3
    m = unlike(make_pair("quads"), make_pair("mixed", TensorGrid(x, GRID.depth, 0)))
    m.points = np.add(m.points, [shift, 0.0])
    pair = write_and_read_pair(m, tmp_path_factory.mktemp("unlike"))
    assert np.abs(pair.upper.x - x).max() <= 1e-15 and np.abs(pair.lower.x - GRID.x).max() <= 1e-15


@pytest.mark.parametrize("factor", [1 + 1e-6, 1.05, 0.95, 1 - 1e-8])
def test_refuses_interfaces_of_other_lengths(factor, tmp_path):
    grid = TensorGrid(FINER.x * factor, FINER.depth, FINER.coating_rows)
    with pytest.raises(
        PatchfemError,
        match=r"do not match \(lengths 0\.002 and .*let both interfaces begin and end",
    ):
        write_and_read_pair(unlike(make_pair("quads"), make_pair("quads", grid)), tmp_path)
    grid = TensorGrid(FINER.x * (1 + 1e-10), FINER.depth, FINER.coating_rows)
    assert (
        write_and_read_pair(
            unlike(make_pair("quads"), make_pair("quads", grid)), tmp_path
        ).upper.x.size
        == FINER.x.size
    )
