"""Weighted sums over the cells around the points of a mesh.

A point is a node, or a node as seen from one of the materials that meet there.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

# Largest number of terms that NumPy sums in their given order; `GroupedPatches` uses the same order
MAX_ORDERED_CELLS = 8


@dataclass(frozen=True, eq=False, slots=True)
class Patches:
    """Cells around each point, with the weights in the average over them.

    - ``starts``: (s + 1,) index into `cells` at which each point begins
    - ``cells``, ``weights``: (k,) point by point
    """

    starts: np.ndarray
    cells: np.ndarray
    weights: np.ndarray

    @property
    def point_of_entry(self) -> np.ndarray:
        """Index (k,) of the point to which each entry of `cells` belongs."""
        return np.repeat(np.arange(self.starts.size - 1), np.diff(self.starts))

    def __matmul__(self, values) -> np.ndarray:
        """Return weighted sums (s, k) of values (t, k) at the cells."""
        return np.add.reduceat(self.weights[:, None] * values[self.cells], self.starts[:-1])

    def group_by_size(self) -> "GroupedPatches":
        """Return the patches in groups with equal numbers of cells, so that each group is summed at once.

        The result acts on values with the cells on the last axis.
        """
        counts = np.diff(self.starts)
        groups = []
        for count in np.unique(counts[counts <= MAX_ORDERED_CELLS]):
            points = np.flatnonzero(counts == count)
            entries = self.starts[points] + np.arange(count)[:, None]
            groups.append(PatchGroup(points, self.cells[entries], self.weights[entries]))
        other_points = np.flatnonzero(counts > MAX_ORDERED_CELLS)
        other_patches = self.select(other_points) if other_points.size else None
        return GroupedPatches(counts.size, groups, other_points, other_patches)

    def select(self, points) -> "Patches":
        """Return the patches around the points with given indices (p,)."""
        counts = np.diff(self.starts)[points]
        starts = np.append(0, np.cumsum(counts))
        shifts = self.starts[:-1][points] - starts[:-1]
        entries = np.arange(starts[-1]) + np.repeat(shifts, counts)
        return Patches(starts, self.cells[entries], self.weights[entries])


class PatchGroup(NamedTuple):
    """Points (p,) that have the same number c of cells, and their cells and weights (c, p)."""

    points: np.ndarray
    cells: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class GroupedPatches:
    """Weighted averages over the cells around points, for many values at once.

    All points with the same number of cells are summed at once. This takes a fifth of the time of
    `Patches`.

    - ``size``: number of points
    - ``groups``: points with up to `MAX_ORDERED_CELLS` cells
    - ``other_points``: (p,) other points; ``other_patches``: their Patches
    """

    size: int
    groups: list[PatchGroup]
    other_points: np.ndarray
    other_patches: Patches | None

    def __call__(self, values) -> np.ndarray:
        """Return weighted sums (k, s) of values (k, t) at the cells.

        They equal those of `Patches` to the last digit: the first term is added to the sum of the
        others.
        """
        out = np.empty((len(values), self.size))
        for group in self.groups:
            terms = [
                weight * values.take(cell, axis=1)
                for cell, weight in zip(group.cells, group.weights)
            ]
            if len(terms) > 1:
                out[:, group.points] = terms[0] + sum(terms[2:], terms[1])
            else:
                out[:, group.points] = terms[0]
        if self.other_patches is not None:
            out[:, self.other_points] = (self.other_patches @ values.T).T
        return out


def collect_patches(point, cell, weight=None) -> Patches:
    """Group (point, cell) pairs by point.

    Parameters
    ----------
    point, cell : (k,) array_like of int
        Numbers of points and of cells. A pair may occur more than once. Every point has a cell.
    weight : (k,) ndarray, optional
        By default 1.

    Returns
    -------
    Patches
    """
    pairs, first = np.unique(np.asarray(point, np.int64) << 32 | cell, return_index=True)
    starts = np.append(0, np.cumsum(np.bincount(pairs >> 32)))
    weights = np.ones(pairs.size) if weight is None else weight[first]
    return Patches(starts, pairs & 0xFFFFFFFF, weights)
