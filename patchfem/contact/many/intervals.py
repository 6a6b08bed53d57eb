"""Contacts of one stretch of nodes: any number of them on one compliance, pressed in one pass (`interval_kernels`).

A flat, tilted or crowned piece presses like this under any load, wherever its load line is. Twin: `unilateral.solve`.
"""

from typing import NamedTuple

import numpy as np

from ... import compiled
from ..active_set import ROUND, factor
from ..edges import parabola, set_back
from . import arrays

kernels = compiled.load("contact.many.interval_kernels")
NEAR = 12  # left ends that are tried where the stretch is known
COARSEST, EVERY = 40, 4  # nodes from which on every fourth of them are pressed first
SOLVED = 1e-12  # largest residual, as `unilateral` has it


class Pressed(NamedTuple):
    """Contacts of q problems on m nodes.

    first, stop: (q,) the nodes that touch, from first on and before stop; force: (q, m) [N]; opening: (q, m) [m];
    closing: (q,) [m]; theta: (q,) [rad]; shares: (q, 2) of the cell beyond the left and the right end that the edge has
    passed, as `edges.End` has them; flaw: (q,) largest relative residual [1], infinite where no such contact was
    found."""

    first: np.ndarray
    stop: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    closing: np.ndarray
    theta: np.ndarray
    shares: np.ndarray
    flaw: np.ndarray

    @property
    def count(self) -> np.ndarray:
        """Nodes (q,) that touch."""
        return self.stop - self.first


class Intervals:
    """A compliance c (m, m) [m/N] on places x (m,) [m] whose contacts are stretches of nodes.

    table: (m + 1, 3, m + 1) sums of the stretches by first node and end, as `interval_kernels.Body` has it, of those
    that were asked for.
    """

    def __init__(self, c, x):
        self.c, self.x, m = np.ascontiguousarray(c), np.ascontiguousarray(x), x.size
        self.table = np.zeros((m + 1, 3, m + 1))

    def press(self, gap, load, moment=None, spring=0.0, known=None) -> Pressed:
        """Contacts on gaps (q, m) [m] under loads (q,) [N].

        moment: (q,) [N m] about x = 0 where the pieces are free to turn against the `spring` (q,) or () [N m/rad] of
        the holder; None: the rotation is held, it is in the gap. known: (first, stop) (q,) that hold the contacts as
        far as one knows. Where the contact is none of this kind `flaw` says so.
        """
        q, m, turns = load.size, self.x.size, moment is not None
        target = np.stack(np.broadcast_arrays(load, moment if turns else 0.0, spring), axis=1).astype(float)
        gap = np.ascontiguousarray(gap)
        if known is None and m > COARSEST:
            known = self._on_coarser(gap, load, moment, spring)
        first, reach = np.clip(((0,), (m,)) if known is None else known, [[0], [1]], [[m - 1], [m]])
        begin = np.broadcast_to(first, q).astype(int)
        found = arrays.Cases(begin, np.broadcast_to(reach, q).astype(int), gap, target, *np.zeros((2, q), int),
                             np.zeros((q, m)), np.zeros((q, 2)), np.zeros((q, 2, 2)), np.full(m + 1, -1),
                             np.zeros(q, int))
        self._pass(found, int(begin.min()) - 1, 0, NEAR if begin.any() else m, turns)
        closing, theta = found.moved.T
        opening = self._opening(gap, found.force, closing, theta)
        flaw = self._flaw(gap, found.force, opening, closing, theta, target, turns)
        inside = (np.arange(m) >= found.first[:, None]) & (np.arange(m) < found.stop[:, None])
        leave, enter = found.pace[:, :, 0], found.pace[:, :, 1]
        good = (leave >= 0) & (enter >= 0) & (leave + enter > 0)
        shares = np.divide(leave, leave + enter, out=np.full((q, 2), 0.5), where=good)
        out = Pressed(found.first, found.stop, found.force, np.where(inside, 0.0, np.maximum(opening, 0.0)), closing,
                      theta, shares, np.where(found.stop > 0, flaw, np.inf))
        lost = np.flatnonzero(~(out.flaw <= SOLVED)) if begin.any() else ()
        if len(lost):
            again = self.press(gap[lost], load[lost], moment if moment is None else moment[lost],
                               np.broadcast_to(spring, q)[lost], ((0,), (m,)))
            for mine, other in zip(out, again):
                mine[lost] = other
        return out

    def _on_coarser(self, gap, load, moment, spring) -> tuple:
        """(first, stop) (q,) that hold the contacts as far as those on every EVERY-th node tell."""
        coarse = Intervals(self.c[::EVERY, ::EVERY], self.x[::EVERY]).press(gap[:, ::EVERY], load, moment, spring)
        held = coarse.stop > 0
        return np.where(held, EVERY * (coarse.first - 1), 0), np.where(held, EVERY * coarse.stop + 2, self.x.size)

    def fill(self, first) -> None:
        """Fill the table for stretches from `first` (q,) on and from the nodes beside them."""
        none = np.zeros(0, int)
        m = self.x.size
        cases = arrays.Cases(none, none, np.zeros((0, m)), np.zeros((0, 3)), none, none, np.zeros((0, m)),
                              np.zeros((0, 2)), np.zeros((0, 2, 2)), np.full(m + 1, -1), none)
        self._pass(cases, int(first.min()) - 1, int(first.max()) + 1, 1, False)

    def _pass(self, cases, low: int, high: int, tries: int, turns: bool) -> None:
        """Let the kernel go along the left ends from `low` on."""
        m, low = self.x.size, max(low, 0)
        upper = np.zeros((m, m))
        upper[low:, low:] = factor(self.c[low:, low:].copy()).T
        body = arrays.Body(self.c, self.x, upper, np.zeros((2, m)), self.table, np.zeros((2, m)))
        kernels.press(body, cases, low, high, tries, int(turns))

    def places(self, found: Pressed, softness, row: float) -> np.ndarray:
        """Places (2, q) [m] of the edges, as `edges.End` has them; an end of the interface that bears is one.

        softness: (m,) [m/N] of a skin alone, 0 without one; row [m]: height of the first cells.
        """
        x, m, out = self.x, self.x.size, []
        for node, side, share in zip((found.first, found.stop - 1), (-1, 1), found.shares.T):
            after, inner = np.clip([node + side, node - side], 0, m - 1)
            cells = [np.abs(x[node] - x[np.where(one == node, other, one)]) for one, other in
                     ((inner, after), (after, inner))]
            off = (1 - softness[node] / self.c.diagonal()[node]) * set_back(*cells, share, row)
            out.append(np.where(after == node, x[node], x[node] + share * (x[after] - x[node]) - side * off))
        return np.clip(out, x[0], x[-1])

    def stiffness(self, found: Pressed, lever: bool = False) -> np.ndarray:
        """Stiffnesses (q,) of contacts with their edges between nodes, as `edges.stiffness` has them: [N/m] of a
        translation, or [N m/rad] of a rotation about x = 0 where `lever`."""
        sums, a, b, m = self.table[:, 2 if lever else 0], found.first, found.stop, self.x.size
        out = here = sums[a, b]
        for inside, share, more, less in (
                (a > 0, found.shares[:, 0], sums[np.maximum(a - 1, 0), b], sums[np.minimum(a + 1, m), b]),
                (b < m, found.shares[:, 1], sums[a, np.minimum(b + 1, m)], sums[a, np.maximum(b - 1, 0)])):
            out = out + np.where(inside & (found.count >= 3), parabola(share - 0.5, more - here, here - less), 0.0)
        return out

    def _opening(self, gap, force, closing, theta) -> np.ndarray:
        return gap + theta[:, None] * self.x - closing[:, None] + force @ self.c

    def _flaw(self, gap, force, opening, closing, theta, target, turns: bool) -> np.ndarray:
        """Largest residual (q,) as `unilateral.residuals` has them; an overlap within ROUND of its terms is none."""
        load, moment, spring = target.T
        depth = np.abs(gap) + np.abs(theta[:, None] * self.x) + np.abs(closing)[:, None] + np.abs(force @ self.c)
        share = opening / np.where(depth > 0, depth, 1.0)
        worst = [np.abs(force.sum(axis=1) - load) / load, np.maximum(-force.min(axis=1), 0.0) / load,
                 np.where(force != 0, 0.0, np.maximum(-share - ROUND, 0.0)).max(axis=1),
                 (np.abs(force * share)).sum(axis=1) / load]
        if turns:
            lack = np.abs(force @ self.x - moment - spring * theta)
            worst.append(lack / (load * np.ptp(self.x) + np.abs(spring * theta)))
        out = np.max(worst, axis=0)
        return np.where(np.isfinite(out), out, np.inf)
