"""Weighted sums over the cells that stand around places of a mesh: its nodes, or a node in one of two materials."""

from dataclasses import dataclass

import numpy as np

FEW = 8  # cells whose sum numpy takes in their order


@dataclass(frozen=True, eq=False, slots=True)
class Patches:
    """Which cells stand around every place, with weights: starts (s + 1,) into cells and weights (k,), place by place."""

    starts: np.ndarray
    cells: np.ndarray
    weights: np.ndarray

    @property
    def row(self) -> np.ndarray:
        """The place (k,) of every cell."""
        return np.repeat(np.arange(self.starts.size - 1), np.diff(self.starts))

    def __matmul__(self, values) -> np.ndarray:
        """Weighted sums (s, k) over the cells of every place of values (t, k) at the cells."""
        return np.add.reduceat(self.weights[:, None] * values[self.cells], self.starts[:-1])

    def gathered(self) -> "Gathered":
        """The same sums of values that stand in rows."""
        counts, groups = np.diff(self.starts), []
        for count in np.unique(counts[counts <= FEW]):
            places = np.flatnonzero(counts == count)
            taken = self.starts[places] + np.arange(count)[:, None]
            groups.append((places, self.cells[taken], self.weights[taken]))
        many = np.flatnonzero(counts > FEW)
        return Gathered(counts.size, groups, many, self.select(many) if many.size else None)

    def select(self, places):
        """The patches of some places (p,)."""
        counts = np.diff(self.starts)[places]
        starts = np.append(0, np.cumsum(counts))
        taken = np.arange(starts[-1]) + np.repeat(self.starts[:-1][places] - starts[:-1], counts)
        return Patches(starts, self.cells[taken], self.weights[taken])


@dataclass(frozen=True, eq=False, slots=True)
class Gathered:
    """Patches for values in rows: a fifth of the time of the sums of `Patches`, which are over rows of three numbers.

    size: of all places; groups: (places (p,), cells (c, p), weights (c, p)) of those with c cells; many: places (p,) of
    more than FEW cells, others: their Patches.
    """

    size: int
    groups: list
    many: np.ndarray
    others: Patches | None

    def __call__(self, values) -> np.ndarray:
        """Weighted sums (k, s) over the cells of every place of values (k, t) at the cells; to the last digit those of
        `Patches`: the first cell is added to the sum of the rest."""
        out = np.empty((len(values), self.size))
        for places, cells, weights in self.groups:
            parts = [weight * values.take(cell, axis=1) for cell, weight in zip(cells, weights)]
            out[:, places] = parts[0] + sum(parts[2:], parts[1]) if len(parts) > 1 else parts[0]
        if self.others is not None:
            out[:, self.many] = (self.others @ values.T).T
        return out


def patches(place, cell, weight=None) -> Patches:
    """Patches of pairs of a place (k,) and a cell (k,), which may come more than once; every place has a cell."""
    pairs, first = np.unique(np.asarray(place, np.int64) << 32 | cell, return_index=True)
    row = pairs >> 32
    starts = np.append(0, np.cumsum(np.bincount(row)))
    return Patches(
        starts, pairs & 0xFFFFFFFF, np.ones(row.size) if weight is None else weight[first]
    )
