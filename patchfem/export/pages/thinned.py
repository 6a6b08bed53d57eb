"""A mesh of fewer cells for a page: some of its lines stay, every cell between them has the mean of those it covers."""

from dataclasses import dataclass

import numpy as np

from ..drawing.panels import sizes

WIDE = 3.0  # as many times more columns than rows, where neither has too few lines for it


@dataclass(frozen=True, eq=False, slots=True)
class Thinned:
    """A coarser mesh and what it has of the finer one.

    nodes: (p,) numbers of the points that stay; cells: (c, 4) their corners among `nodes`, the last one twice in a
    triangle; order: (m,) cells of the finer mesh, group by group; starts: (g,) where each group begins in `order`;
    groups: (c,) the group of each cell; areas: (m,) [m2] in the order of `order`.
    """

    nodes: np.ndarray
    cells: np.ndarray
    order: np.ndarray
    starts: np.ndarray
    groups: np.ndarray
    areas: np.ndarray

    def means(self, values) -> np.ndarray:
        """Means (c, k) over the area of each cell of values (m, k) on the cells of the finer mesh."""
        sums = np.add.reduceat(values[self.order] * self.areas[:, None], self.starts)
        return (sums / np.add.reduceat(self.areas, self.starts)[:, None])[self.groups]


def thinned(points, cells, material, most: int, near: tuple | None = None) -> Thinned:
    """The mesh of points (n, 2) [m], cells (m, 4) and material (m,) with about `most` cells at most.

    near: x (left, right) [m] where half of the columns stand, if there are as many.
    Of a grid one line in several stays, the outer ones and those between two materials among them; so stays the
    outline. In any other mesh all points of a box between such lines become one of them. Without need nothing changes.
    """
    count, size = len(cells), sizes(points, cells)
    if count <= most:
        every = np.arange(count)
        return Thinned(np.arange(len(points)), cells, every, every, every, size)
    bins, heights = _bins(points, cells, material, most, near)
    key = bins[0] * heights + bins[1]
    away = np.abs(points[:, 0] - points[:, 0].min()) + np.abs(points[:, 1])
    # the first of a box lies nearest to its corner; of a grid it is that corner
    by_key = np.lexsort((away, key))
    _, first, number = np.unique(key[by_key], return_index=True, return_inverse=True)
    stand_in = np.empty(len(points), int)
    stand_in[by_key] = number
    moved = stand_in[cells]
    ranked = np.sort(moved, axis=1)
    whole = np.flatnonzero((np.diff(ranked, axis=1) > 0).sum(axis=1) >= 2)
    whole = whole[np.unique(ranked[whole], axis=0, return_index=True)[1]]
    box = (bins[0][cells].min(axis=1) * heights + bins[1][cells].min(axis=1)) * 2 + (material > 0)
    order = np.argsort(box, kind="stable")
    _, starts, group = np.unique(box[order], return_index=True, return_inverse=True)
    of_cell = np.empty(count, int)
    of_cell[order] = group
    return Thinned(by_key[first], moved[whole], order, starts, of_cell[whole], size[order])


def _bins(points, cells, material, most: int, near: tuple | None) -> tuple:
    """Number of the kept line at or before each point, (along x, in depth), and how many lines there are in depth."""
    x, depth = points[:, 0], np.abs(points[:, 1])
    columns, rows = (np.unique(one) for one in (x, depth))
    if columns.size * rows.size > len(points):  # no grid: a box between lines takes two triangles
        most //= 2
    down = min(rows.size - 1, max(int((most / WIDE) ** 0.5), most // (columns.size - 1)))
    coat = np.zeros((2, len(points)), bool)
    for kind in (0, 1):
        coat[kind][cells[(material > 0) == kind]] = True
    border = np.unique(depth[coat.all(axis=0)])
    kept = np.union1d(rows[spread(rows, down)], border if border.size < down / 2 else [])
    across = columns[spread(columns, min(columns.size - 1, max(most // (kept.size - 1), 2)), near)]
    return [
        np.searchsorted(lines, values, "right") - 1
        for lines, values in ((across, x), (kept, depth))
    ], kept.size


def spread(lines, count: int, near: tuple | None = None) -> np.ndarray:
    """Numbers of at most `count` + 1 of the sorted lines (n,), the first and the last among them, evenly many of them.

    near: (left, right) between which half of them lie, if there are as many.
    """
    weight = np.ones(lines.size - 1)
    if near is not None:
        inside = (lines[1:] > near[0]) & (lines[:-1] < near[1])
        share = min(inside.sum() / count, 0.5)  # of all that are kept
        if 0 < share < 1 and inside.sum() < share * inside.size:
            weight[inside] = share * (~inside).sum() / ((1 - share) * inside.sum())
    place = np.concatenate([[0.0], np.cumsum(weight)])
    return np.unique(
        np.searchsorted(place, np.linspace(0, place[-1], count + 1) * (1 - 1e-12)).clip(
            0, lines.size - 1
        )
    )
