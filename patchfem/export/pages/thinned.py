"""Coarser meshes for a page, whose values are averages over the original cells."""

from dataclasses import dataclass

import numpy as np

from ..drawing.panels import quadrilateral_areas

COLUMNS_PER_ROW = 3.0  # ratio of columns to rows, if the mesh has enough lines of both


@dataclass(frozen=True, eq=False, slots=True)
class ReducedMesh:
    """Coarser mesh for display, with the coarser cell to which each cell of the finer mesh belongs.

    Attributes
    ----------
    nodes : (p,) array
        Numbers of the points that are kept.
    cells : (c, 4) array
        Corners among `nodes`; a triangle has the last one twice.
    order : (m,) array
        Cells of the finer mesh, group by group.
    starts : (g,) array
        Start of each group in `order`.
    groups : (c,) array
        Group of each cell.
    areas : (m,) array
        Areas of the cells in the order of `order` [m2].
    """

    nodes: np.ndarray
    cells: np.ndarray
    order: np.ndarray
    starts: np.ndarray
    groups: np.ndarray
    areas: np.ndarray

    def means(self, values) -> np.ndarray:
        """Average values (m, k) on the cells of the finer mesh over each coarser cell; return (c, k)."""
        sums = np.add.reduceat(values[self.order] * self.areas[:, None], self.starts)
        return (sums / np.add.reduceat(self.areas, self.starts)[:, None])[self.groups]


def reduce_mesh(
    points, cells, material, max_cells: int, fine_range: tuple | None = None
) -> ReducedMesh:
    """Merge the cells of a mesh until about a given number remains.

    In a grid, every so many lines are kept, including the outer lines and those between two
    materials, so that the outline stays the same. In any other mesh all points of a box between
    such lines become one point. A mesh with few enough cells is not changed.

    Parameters
    ----------
    points : (n, 2) array
        [m]
    cells : (m, 4) array
        Corners.
    material : (m,) array
    max_cells : int
    fine_range : tuple, optional
        Range of x [m] in which half of the columns are kept, if there are so many.

    Returns
    -------
    ReducedMesh
    """
    count = len(cells)
    size = quadrilateral_areas(points, cells)
    if count <= max_cells:
        all_cells = np.arange(count)
        return ReducedMesh(np.arange(len(points)), cells, all_cells, all_cells, all_cells, size)
    bins, heights = _line_bins(points, cells, material, max_cells, fine_range)
    key = bins[0] * heights + bins[1]
    corner_distance = np.abs(points[:, 0] - points[:, 0].min()) + np.abs(points[:, 1])
    # Each box is represented by its point nearest to the corner; in a
    # grid, it is the corner itself.
    by_key = np.lexsort((corner_distance, key))
    _, first, number = np.unique(key[by_key], return_index=True, return_inverse=True)
    new_number = np.empty(len(points), int)
    new_number[by_key] = number
    reduced_cells = new_number[cells]
    ranked = np.sort(reduced_cells, axis=1)
    kept_cells = np.flatnonzero((np.diff(ranked, axis=1) > 0).sum(axis=1) >= 2)
    kept_cells = kept_cells[np.unique(ranked[kept_cells], axis=0, return_index=True)[1]]
    box = (bins[0][cells].min(axis=1) * heights + bins[1][cells].min(axis=1)) * 2 + (material > 0)
    order = np.argsort(box, kind="stable")
    _, starts, group = np.unique(box[order], return_index=True, return_inverse=True)
    group_of_cell = np.empty(count, int)
    group_of_cell[order] = group
    return ReducedMesh(
        by_key[first],
        reduced_cells[kept_cells],
        order,
        starts,
        group_of_cell[kept_cells],
        size[order],
    )


def _line_bins(points, cells, material, max_cells: int, fine_range: tuple | None) -> tuple:
    """Return for each point the index of the last selected grid line at or before it.

    The indices count columns along x and rows in depth.
    """
    x = points[:, 0]
    depth = np.abs(points[:, 1])
    columns, rows = (np.unique(coordinate) for coordinate in (x, depth))
    # If the mesh is not a grid, a box between lines needs two triangles.
    if columns.size * rows.size > len(points):
        max_cells //= 2
    n_rows = min(
        rows.size - 1,
        max(int((max_cells / COLUMNS_PER_ROW) ** 0.5), max_cells // (columns.size - 1)),
    )
    touches_material = np.zeros((2, len(points)), bool)
    for is_coating in (0, 1):
        touches_material[is_coating][cells[(material > 0) == is_coating]] = True
    boundary_depths = np.unique(depth[touches_material.all(axis=0)])
    kept_rows = np.union1d(
        rows[select_lines(rows, n_rows)],
        boundary_depths if boundary_depths.size < n_rows / 2 else [],
    )
    kept_columns = columns[
        select_lines(
            columns, min(columns.size - 1, max(max_cells // (kept_rows.size - 1), 2)), fine_range
        )
    ]
    return [
        np.searchsorted(lines, values, "right") - 1
        for lines, values in ((kept_columns, x), (kept_rows, depth))
    ], kept_rows.size


def select_lines(lines, count: int, fine_range: tuple | None = None) -> np.ndarray:
    """Select evenly spaced grid lines, but no more than a given number.

    The first and the last line are included. fine_range: (left, right) between which half of the lines
    are taken, if there are so many.
    """
    weight = np.ones(lines.size - 1)
    if fine_range is not None:
        inside = (lines[1:] > fine_range[0]) & (lines[:-1] < fine_range[1])
        fraction = min(
            inside.sum() / count, 0.5
        )  # fraction of the kept lines that lie in fine_range
        if 0 < fraction < 1 and inside.sum() < fraction * inside.size:
            weight[inside] = fraction * (~inside).sum() / ((1 - fraction) * inside.sum())
    cumulative_weight = np.concatenate([[0.0], np.cumsum(weight)])
    return np.unique(
        np.searchsorted(
            cumulative_weight, np.linspace(0, cumulative_weight[-1], count + 1) * (1 - 1e-12)
        ).clip(0, lines.size - 1)
    )
