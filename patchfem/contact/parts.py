"""Equations on a part of the nodes of a dense compliance; its Cholesky factor is changed from set to set, not made
anew."""

import numpy as np
from scipy.linalg.lapack import dpotrf, dpotrs

SMALL = 100  # nodes up to which a new factor costs no more than the change of an old one


def factor(matrix: np.ndarray) -> np.ndarray:
    """Lower Cholesky factor of a symmetric C-ordered matrix, in its place; LinAlgError unless it is positive definite.
   """
    low, info = dpotrf(matrix.T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("not positive definite")
    return low


class Operator:
    """A compliance c (m, m) [m/N], symmetric positive definite, that solves equations on a part of its nodes.

    The last factor is kept. A set that differs by few nodes is solved with it: an entering node is one more row, a
    leaving node one more force that makes its own vanish.
    """

    __slots__ = ("answers", "base", "c", "index", "low")

    def __init__(self, c: np.ndarray):
        self.c, self.base, self.index, self.low, self.answers = c, None, None, None, {}

    def part(self, rows: np.ndarray) -> np.ndarray:
        """Copy (n, n) [m/N] of the block of `rows` (n,), sorted indices of nodes, C-ordered."""
        if rows[-1] - rows[0] == rows.size - 1:
            return self.c[rows[0]:rows[-1] + 1, rows[0]:rows[-1] + 1].copy()
        return self.c[rows[:, None], rows]

    def solver(self, active: np.ndarray):
        """Function (n, k) -> (n, k) that solves with the block of the n nodes that are set in `active` (m,) bool.

        The factor is kept for the next set. LinAlgError where the block is not positive definite.
        """
        index = np.flatnonzero(active)
        if self.base is not None and index.size > SMALL:
            changed = np.flatnonzero(active != self.base)
            # a changed node costs a few solves, a new factor n^3/3: the change pays while few nodes do
            if changed.size * 12 <= index.size:
                return self._changed(active, changed) if changed.size else self._same
        self.base, self.index, self.low, self.answers = active, index, factor(self.part(index)), {}
        return self._same

    def _same(self, sides: np.ndarray) -> np.ndarray:
        return dpotrs(self.low, sides, lower=1)[0]

    def _columns(self, gone, new) -> np.ndarray:
        """Answers (n, k) of the kept factor to unit forces at the nodes that leave and enter.

        They are kept as well, because the next sets differ little.
        """
        lacking = [node for node in (*gone, *new) if node not in self.answers]
        if lacking:
            unit = self.c[self.index[:, None], lacking]
            for k, node in enumerate(lacking):
                if self.base[node]:
                    unit[:, k] = self.index == node
            self.answers.update(zip(lacking, self._same(np.asfortranarray(unit)).T))
        return np.stack([self.answers[node] for node in (*gone, *new)], axis=1)

    def _changed(self, active, changed):
        base = self.index
        gone, new = changed[~active[changed]], changed[active[changed]]
        places, rows = np.searchsorted(base, gone), self.c[new[:, None], base]
        answer = self._columns(gone.tolist(), new.tolist())
        small = np.concatenate([answer[places], rows @ answer])
        small[gone.size:, gone.size:] -= self.c[new[:, None], new]
        stays, index = active[base], np.flatnonzero(active)
        old, entered = np.searchsorted(index, base[stays]), np.searchsorted(index, new)

        def solve(sides):
            whole = np.zeros((base.size, sides.shape[1]), order="F")
            whole[stays] = sides[old]
            free = self._same(whole)
            lack = np.concatenate([free[places], rows @ free - sides[entered]])
            added = np.linalg.solve(small, lack)
            out = np.empty(sides.shape)
            out[old] = (free - answer @ added)[stays]
            out[entered] = added[gone.size:]
            return out
        return solve

    def bent(self, force: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Displacement C f (m,) [m] of forces f (m,) [N] that vanish outside the sorted nodes `index`."""
        span = slice(index[0], index[-1] + 1)
        return self.c[:, span] @ force[span]
