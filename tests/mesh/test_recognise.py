"""Tensor grids found behind any mesh, and the held share of a far face, against shapes with lengths in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from any_mesh_cases import FORMATS, GRID, make_pair, mesh_of_grid

from patchfem.mesh import PieceMesh, find_holes, measure_fixed_length, read_bodies
from patchfem.mesh.files import EDGE_TAGS
from patchfem.mesh.recognise import recognise_grid


def bodies(m, folder, form):
    ending, write = FORMATS[form]
    write(m, folder / f"pair{ending}")
    return read_bodies(folder / f"pair{ending}")


def far_edges(m, side="lower"):
    """Numbers of the far edges of one piece, by rising x."""
    mine = np.flatnonzero(m.edge_tags == EDGE_TAGS[f"{side}_far"])
    return mine[np.argsort(m.points[m.edges[mine], 0].mean(axis=1))]


def without(m, edges):
    kept = np.delete(np.arange(len(m.edges)), edges)
    m.edges, m.edge_tags = m.edges[kept], m.edge_tags[kept]
    return m


@pytest.mark.parametrize("form", FORMATS)
def test_exact_the_same_grid_comes_from_every_format(form, tmp_path):
    low, high = bodies(make_pair("quads"), tmp_path, form)
    assert high is None and low.coating_rows == GRID.coating_rows
    assert low.x == pytest.approx(GRID.x, abs=1e-15) and low.depth == pytest.approx(
        GRID.depth, abs=1e-15
    )
    assert all(isinstance(body, PieceMesh) for body in bodies(make_pair("mixed"), tmp_path, form))


@pytest.mark.parametrize("form", FORMATS)
def test_exact_a_far_face_held_in_part_is_no_grid_in_any_format(form, tmp_path):
    m = make_pair("quads")
    low, high = bodies(without(m, far_edges(m)[2:]), tmp_path, form)
    assert isinstance(low, PieceMesh) and isinstance(high, PieceMesh)
    assert measure_fixed_length(low) == pytest.approx(
        (5e-4, 2e-3), rel=1e-12
    )  # 2 edges of 0.25 mm on 2 mm
    assert measure_fixed_length(high) == pytest.approx((2e-3, 2e-3), rel=1e-12)


def test_exact_the_fixed_length_follows_a_far_face_up_to_its_corners():
    piece = mesh_of_grid(GRID, 0.5, 3)
    assert measure_fixed_length(piece) == pytest.approx((2e-3, 2e-3), rel=1e-12)
    bottom = piece.points[:, 1] == 1e-3
    left = piece.points[:, 0] == -1e-3
    sides = replace(piece, far=np.flatnonzero(left & (piece.points[:, 1] > 0)))
    first = piece.points[left, 1]
    first = np.sort(first)[1]  # the edge that touches the interface is held at one end alone
    assert measure_fixed_length(sides) == pytest.approx((1e-3 - first, 1e-3 + 2e-3), rel=1e-12)
    points = piece.points.copy()
    points[:, 1] *= 1 + 40 * np.abs(points[:, 0]) / 2  # two slopes of 0.02, no corner between them
    slanted = replace(piece, points=points, far=np.flatnonzero(bottom & (points[:, 0] <= 0)))
    side = np.hypot(1e-3, 2e-5)
    assert measure_fixed_length(slanted) == pytest.approx((side, 2 * side), rel=1e-12)


def test_always_a_grid_is_recognised_whatever_its_numbers_are():
    assert recognise_grid(mesh_of_grid(GRID, seed=5)).depth == pytest.approx(GRID.depth, abs=1e-15)
    assert recognise_grid(mesh_of_grid(GRID, 0.2)) is None


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
def test_exact_holes_are_the_area_of_the_cells_left_out_inside_and_a_notch_is_none(split):
    """Two cells apart from one another inside the piece, then one more at its side."""
    piece = mesh_of_grid(GRID, split, 3)
    assert find_holes(piece) == (0, 0.0)
    middle = np.concatenate(
        [piece.points[cells].mean(axis=1) for cells in (piece.triangles, piece.quads)]
    )
    x = GRID.x
    depth = GRID.depth
    turn = len(piece.triangles)

    def inside(column, row):
        there = (middle[:, 0] > x[column]) & (middle[:, 0] < x[column + 1])
        return there & (middle[:, 1] > depth[row]) & (middle[:, 1] < depth[row + 1])

    def left_out(gone):
        return replace(
            piece,
            triangles=piece.triangles[~gone[:turn]],
            quads=piece.quads[~gone[turn:]],
            is_coating=piece.is_coating[~gone],
        )

    gone = inside(2, 2) | inside(5, 1)
    area = (x[3] - x[2]) * (depth[3] - depth[2]) + (x[6] - x[5]) * (depth[2] - depth[1])
    assert find_holes(left_out(gone)) == (2, pytest.approx(area, rel=1e-12))
    assert find_holes(left_out(gone | inside(0, 2))) == (2, pytest.approx(area, rel=1e-12))


@pytest.mark.parametrize(("turn", "right_half"), [(28.0, 1e-3), (32.0, 0.0)])
def test_exact_a_far_face_ends_where_its_border_turns_by_thirty_degrees(turn, right_half):
    """The left half of a far face is inclined and fixed; the right half is free, and part of it or another face."""
    piece = mesh_of_grid(GRID, 0.5, 3)
    is_fixed = (piece.points[:, 1] == 1e-3) & (piece.points[:, 0] <= 0)
    slope = np.tan(np.radians(turn))
    points = piece.points.copy()
    points[:, 1] *= 1 + slope * np.maximum(-points[:, 0], 0) / 1e-3
    inclined = replace(piece, points=points, far=np.flatnonzero(is_fixed))
    fixed = 1e-3 * np.hypot(1, slope)
    assert measure_fixed_length(inclined) == pytest.approx((fixed, fixed + right_half), rel=1e-12)
