"""Weighted sums over the cells around places of a mesh.

A place is a node, or a node in one of its materials.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

MAX_ORDERED_CELLS = 8  # NumPy adds up to this number of terms in their order


@dataclass(frozen=True, eq=False, slots=True)
class Patches:
    """The cells around every place, with weights.

    - ``starts``: (s + 1,) position in `cells` at which each place begins
    - ``cells``, ``weights``: (k,) place by place
    """

    starts: np.ndarray
    cells: np.ndarray
    weights: np.ndarray

    @property
    def row(self) -> np.ndarray:
        """The place (k,) to which each entry of `cells` belongs."""
        return np.repeat(np.arange(self.starts.size - 1), np.diff(self.starts))

    def __matmul__(self, values) -> np.ndarray:
        """Return weighted sums (s, k) of values (t, k) at the cells."""
        return np.add.reduceat(self.weights[:, None] * values[self.cells], self.starts[:-1])

    def gather(self) -> "Gathered":
        """Return the same sums for values whose cells are on the last axis."""
        counts = np.diff(self.starts)
        groups = []
        for count in np.unique(counts[counts <= MAX_ORDERED_CELLS]):
            places = np.flatnonzero(counts == count)
            entries = self.starts[places] + np.arange(count)[:, None]
            groups.append(Group(places, self.cells[entries], self.weights[entries]))
        other_places = np.flatnonzero(counts > MAX_ORDERED_CELLS)
        others = self.select(other_places) if other_places.size else None
        return Gathered(counts.size, groups, other_places, others)

    def select(self, places) -> "Patches":
        """Return the patches of some places (p,)."""
        counts = np.diff(self.starts)[places]
        starts = np.append(0, np.cumsum(counts))
        shifts = self.starts[:-1][places] - starts[:-1]
        entries = np.arange(starts[-1]) + np.repeat(shifts, counts)
        return Patches(starts, self.cells[entries], self.weights[entries])


class Group(NamedTuple):
    """Places (p,) with the same number c of cells, and their cells and weights (c, p)."""

    places: np.ndarray
    cells: np.ndarray
    weights: np.ndarray


@dataclass(frozen=True, eq=False, slots=True)
class Gathered:
    """Patches for values with the cells on the last axis, at a fifth of the time.

    - ``size``: number of places
    - ``groups``: places with up to `MAX_ORDERED_CELLS` cells
    - ``other_places``: (p,) other places; ``others``: their Patches
    """

    size: int
    groups: list[Group]
    other_places: np.ndarray
    others: Patches | None

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
                out[:, group.places] = terms[0] + sum(terms[2:], terms[1])
            else:
                out[:, group.places] = terms[0]
        if self.others is not None:
            out[:, self.other_places] = (self.others @ values.T).T
        return out


def patches(place, cell, weight=None) -> Patches:
    """Collect pairs of a place and a cell into patches.

    Parameters
    ----------
    place, cell : (k,) array_like of int
        A pair may occur more than once. Every place has a cell.
    weight : (k,) ndarray, optional
        By default 1.

    Returns
    -------
    Patches
    """
    pairs, first = np.unique(np.asarray(place, np.int64) << 32 | cell, return_index=True)
    starts = np.append(0, np.cumsum(np.bincount(pairs >> 32)))
    weights = np.ones(pairs.size) if weight is None else weight[first]
    return Patches(starts, pairs & 0xFFFFFFFF, weights)
