"""Tensor grids recognised in any mesh, and the fixed fraction of a far face, compared with lengths in closed form."""

from dataclasses import replace

import numpy as np
import pytest
from any_mesh_cases import FORMATS, GRID, make_pair, mesh_of_grid

from patchfem.mesh import PieceMesh, find_holes, measure_clamped_length, read_bodies
from patchfem.mesh.files import EDGE_TAGS


def write_and_read(mesh, folder, form):
    """Write a mesh in a format and return the two pieces that are read."""
    ending, write = FORMATS[form]
    write(mesh, folder / f"pair{ending}")
    return read_bodies(folder / f"pair{ending}")


def far_edges(mesh, side="lower"):
    """Return the numbers of the far edges of one piece, by increasing x."""
    edge_numbers = np.flatnonzero(mesh.edge_tags == EDGE_TAGS[f"{side}_far"])
    return edge_numbers[np.argsort(mesh.points[mesh.edges[edge_numbers], 0].mean(axis=1))]


def remove_edges(mesh, edges):
    """Remove edges of a mesh in place and return it."""
    remaining = np.delete(np.arange(len(mesh.edges)), edges)
    mesh.edges, mesh.edge_tags = mesh.edges[remaining], mesh.edge_tags[remaining]
    return mesh


@pytest.mark.parametrize("form", FORMATS)
def test_exact_all_formats_give_same_grid(form, tmp_path):
    """Every format gives the same tensor grid, and a mesh with triangles is read as a general mesh."""
    low, high = write_and_read(make_pair("quads"), tmp_path, form)
    assert high is None and low.coating_rows == GRID.coating_rows
    assert low.x == pytest.approx(GRID.x, abs=1e-15) and low.depth == pytest.approx(
        GRID.depth, abs=1e-15
    )
    assert all(
        isinstance(body, PieceMesh) for body in write_and_read(make_pair("mixed"), tmp_path, form)
    )


@pytest.mark.parametrize("form", FORMATS)
def test_exact_partly_fixed_far_face_is_read_as_mesh(form, tmp_path):
    """A far face that is fixed in part is read as a mesh with its fixed length, in every format."""
    mesh = make_pair("quads")
    low, high = write_and_read(remove_edges(mesh, far_edges(mesh)[2:]), tmp_path, form)
    assert isinstance(low, PieceMesh) and isinstance(high, PieceMesh)
    assert measure_clamped_length(low) == pytest.approx(
        (5e-4, 2e-3), rel=1e-12
    )  # 2 edges of 0.25 mm on 2 mm
    assert measure_clamped_length(high) == pytest.approx((2e-3, 2e-3), rel=1e-12)


def test_exact_fixed_length_of_bottom_side_and_inclined_face():
    """The fixed length of a bottom, a side and an inclined far face agrees with the closed form."""
    piece = mesh_of_grid(GRID, 0.5, 3)
    assert measure_clamped_length(piece) == pytest.approx((2e-3, 2e-3), rel=1e-12)
    bottom = piece.points[:, 1] == 1e-3
    left = piece.points[:, 0] == -1e-3
    sides = replace(piece, far=np.flatnonzero(left & (piece.points[:, 1] > 0)))
    first = piece.points[left, 1]
    first = np.sort(first)[1]  # the edge at the interface has only one fixed node
    assert measure_clamped_length(sides) == pytest.approx((1e-3 - first, 1e-3 + 2e-3), rel=1e-12)
    points = piece.points.copy()
    points[:, 1] *= (
        1 + 40 * np.abs(points[:, 0]) / 2
    )  # two slopes of 0.02 without a corner between them
    slanted = replace(piece, points=points, far=np.flatnonzero(bottom & (points[:, 0] <= 0)))
    side = np.hypot(1e-3, 2e-5)
    assert measure_clamped_length(slanted) == pytest.approx((side, 2 * side), rel=1e-12)


@pytest.mark.parametrize("split", [0.0, 0.5, 1.0])
def test_exact_hole_count_and_area(split):
    """Elements removed inside a piece are counted as holes with their area; a notch at the side is not."""
    piece = mesh_of_grid(GRID, split, 3)
    assert find_holes(piece) == (0, 0.0)
    middle = np.concatenate(
        [piece.points[cells].mean(axis=1) for cells in (piece.triangles, piece.quads)]
    )
    x = GRID.x
    depth = GRID.depth
    n_triangles = len(piece.triangles)

    def inside(column, row):
        there = (middle[:, 0] > x[column]) & (middle[:, 0] < x[column + 1])
        return there & (middle[:, 1] > depth[row]) & (middle[:, 1] < depth[row + 1])

    def remove_elements(gone):
        return replace(
            piece,
            triangles=piece.triangles[~gone[:n_triangles]],
            quads=piece.quads[~gone[n_triangles:]],
            is_coating=piece.is_coating[~gone],
        )

    is_removed = inside(2, 2) | inside(5, 1)
    area = (x[3] - x[2]) * (depth[3] - depth[2]) + (x[6] - x[5]) * (depth[2] - depth[1])
    assert find_holes(remove_elements(is_removed)) == (2, pytest.approx(area, rel=1e-12))
    assert find_holes(remove_elements(is_removed | inside(0, 2))) == (
        2,
        pytest.approx(area, rel=1e-12),
    )


@pytest.mark.parametrize(("angle", "free_length"), [(28.0, 1e-3), (32.0, 0.0)])
def test_exact_far_face_ends_at_corner_of_thirty_degrees(angle, free_length):
    """A far face ends where its boundary changes direction by more than 30 degrees."""
    piece = mesh_of_grid(GRID, 0.5, 3)
    is_fixed = (piece.points[:, 1] == 1e-3) & (piece.points[:, 0] <= 0)
    slope = np.tan(np.radians(angle))
    points = piece.points.copy()
    points[:, 1] *= 1 + slope * np.maximum(-points[:, 0], 0) / 1e-3
    inclined = replace(piece, points=points, far=np.flatnonzero(is_fixed))
    fixed_length = 1e-3 * np.hypot(1, slope)
    assert measure_clamped_length(inclined) == pytest.approx(
        (fixed_length, fixed_length + free_length), rel=1e-12
    )
