"""Contacts of one stretch of nodes: any number of them on one compliance, pressed in one pass along its left ends.

Cases that begin at one node share its factor (`interval_kernels`) and are solved together by BLAS.
A flat, tilted or crowned piece presses like this under any load, wherever its load line is. Twin: `unilateral.solve`.
"""

from typing import NamedTuple

import numpy as np

from ... import compiled
from ...elasticity.lapack import dtrsm
from ..active_set import OPENING_NOISE
from ..edges import edge_offset, parabola_change
from ..strip_compliance import factorise
from . import arrays

kernels = compiled.load("contact.batch.interval_kernels")
NEAR = 12  # left ends that are tried where the stretch is known
COARSEST, EVERY = 40, 4  # nodes from which on every fourth of them are pressed first
TOGETHER = 256  # cases that are solved together
SOLVED = 1e-12  # largest residual, as `unilateral` has it


class Pressed(NamedTuple):
    """Contacts of q problems on m nodes.

    first, stop: (q,) the nodes that touch, from first on and before stop; force: (q, m) [N]; opening: (q, m) [m];
    closing: (q,) [m]; theta: (q,) [rad]; shares: (q, 2) of the cell beyond the left and the right end that the edge has
    passed, as `edges.ContactEdge` has them; flaw: (q,) largest relative residual [1], infinite where no such contact was
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
        target = np.stack(
            np.broadcast_arrays(load, moment if turns else 0.0, spring), axis=1
        ).astype(float)
        gap = np.ascontiguousarray(gap)
        if known is None and m > COARSEST:
            known = self._on_coarser(gap, load, moment, spring)
        first, reach = np.clip(((0,), (m,)) if known is None else known, [[0], [1]], [[m - 1], [m]])
        begin = np.broadcast_to(first, q).astype(int)
        found = arrays.Cases(
            begin,
            np.broadcast_to(reach, q).astype(int),
            gap,
            target,
            *np.zeros((2, q), int),
            np.zeros((q, m)),
            np.zeros((q, 2)),
            np.zeros((q, 2)),
            np.ones((q, 2)),
        )
        self._pass(found, int(begin.min()) - 1, 0, NEAR if begin.any() else m, turns)
        closing, theta = found.moved.T
        bent = found.force @ self.c
        opening = self._opening(gap, bent, closing, theta)
        flaw = self._flaw(gap, found.force, bent, opening, closing, theta, target, turns)
        inside = (np.arange(m) >= found.first[:, None]) & (np.arange(m) < found.stop[:, None])
        beside, rows = np.stack([found.first - 1, found.stop], axis=1), np.arange(q)[:, None]
        gaps = np.where((beside >= 0) & (beside < m), opening[rows, np.clip(beside, 0, m - 1)], 0.0)
        leave, enter = found.leave, gaps / found.fall
        good = (leave >= 0) & (enter >= 0) & (leave + enter > 0)
        shares = np.divide(leave, leave + enter, out=np.full((q, 2), 0.5), where=good)
        out = Pressed(
            found.first,
            found.stop,
            found.force,
            np.where(inside, 0.0, np.maximum(opening, 0.0)),
            closing,
            theta,
            shares,
            np.where(found.stop > 0, flaw, np.inf),
        )
        lost = np.flatnonzero(~(out.flaw <= SOLVED)) if begin.any() else ()
        if len(lost):
            again = self.press(
                gap[lost],
                load[lost],
                moment if moment is None else moment[lost],
                np.broadcast_to(spring, q)[lost],
                ((0,), (m,)),
            )
            for mine, other in zip(out, again):
                mine[lost] = other
        return out

    def _on_coarser(self, gap, load, moment, spring) -> tuple:
        """(first, stop) (q,) that hold the contacts as far as those on every EVERY-th node tell."""
        coarse = Intervals(self.c[::EVERY, ::EVERY], self.x[::EVERY]).press(
            gap[:, ::EVERY], load, moment, spring
        )
        held = coarse.stop > 0
        return np.where(held, EVERY * (coarse.first - 1), 0), np.where(
            held, EVERY * coarse.stop + 2, self.x.size
        )

    def fill(self, first) -> None:
        """Fill the table for stretches from `first` (q,) on and from the nodes beside them."""
        none, m = np.zeros(0, int), self.x.size
        cases = arrays.Cases(
            none,
            none,
            np.zeros((0, m)),
            np.zeros((0, 3)),
            none,
            none,
            np.zeros((0, m)),
            *np.zeros((3, 0, 2)),
        )
        self._pass(cases, int(first.min()) - 1, int(first.max()) + 1, 1, False)

    def _pass(self, cases, low: int, high: int, tries: int, turns: bool) -> None:
        """Press all cases and fill the rows of the table from the left end `low` to `high` and beside every stretch;
        tries: left ends that are tried of each."""
        m, a = self.x.size, max(low, 0)
        upper = np.zeros((m, m))
        upper[a:, a:] = factorise(self.c[a:, a:].copy()).T
        body = arrays.Body(self.c, self.x, upper, np.zeros((2, m)), self.table, np.zeros(m))
        kernels.walk(body, a, a, 1)
        waits = np.minimum(cases.begin, m)  # left end that is tried next, m of what is done
        while (after := int(waits.min(initial=m))) < m:
            if after > a:
                kernels.walk(body, a, after, 0)
            a, here = after, np.flatnonzero(waits == after)
            here = here[np.argsort(cases.reach[here], kind="stable")]
            for start in range(0, here.size, TOGETHER):
                some = here[start : start + TOGETHER]
                waits[some] = self._begun(body, cases, some, a, turns)
            high = max(high, a + 1) if (cases.stop[here] > 0).any() else high
            waits[waits >= cases.begin + tries] = m
        if min(high, m - 1) > a:
            kernels.walk(body, a, min(high, m - 1), 0)

    def _begun(self, body, cases, some, a: int, turns: bool) -> np.ndarray:
        """Left ends (n,) at which cases `some` (n,) that may begin at a are to be tried again, m of those that do."""
        m, reach, target = (
            self.x.size,
            np.minimum(cases.reach[some], self.x.size),
            cases.target[some],
        )
        here = slice(a, max(int(reach.max()), a + 1))
        low = np.asfortranarray(body.upper[here, here].T)
        stop, moved, y = (
            np.zeros(some.size, int),
            np.zeros((some.size, 2)),
            _solved(low, cases.gap[some, here]),
        )
        kernels.pushes(body, a, y, reach, target, stop, moved, int(turns))
        force = _solved(low, y, back=True)
        good, far = (stop > 0) & (force[:, 0] > 0), (stop == 0) & (reach < m)
        cases.reach[some[far]] = m
        out = np.where(good, m, np.where(far, a, a + 1))
        if good.any():
            self._kept(
                body, cases, some[good], (a, low, force[good], stop[good], moved[good]), turns
            )
        return out

    def _kept(self, body, cases, some, found: tuple, turns: bool) -> None:
        """Write contacts of cases `some` (n,), with what round-off left of openings inside, of load and moment taken
        out of forces and motion; found: left end, its factor, forces (n, k), stops (n,), motions (n, 2)."""
        a, low, force, stop, moved = found
        here, target = slice(a, a + force.shape[1]), cases.target[some].copy()
        x, inside, one = (
            self.x[here],
            np.arange(a, a + force.shape[1]) < stop[:, None],
            body.side[0],
        )
        target[:, 0] -= force.sum(axis=1)
        target[:, 1] += target[:, 2] * moved[:, 1] - force @ x
        y = _solved(
            low,
            inside * self._opening(cases.gap[some, here], force @ self.c[here, here], *moved.T, x),
        )
        more = np.zeros_like(moved)
        kernels.pushes(body, a, y, stop, target, stop, more, int(turns))
        force = force + _solved(low, y, back=True)
        cases.force[some, here], cases.moved[some] = force, moved + more
        cases.first[some], cases.stop[some] = a, stop
        within = np.flatnonzero(stop < self.x.size)
        last, size = stop[within], body.upper.diagonal()
        cases.leave[some[within], 1] = force[within, last - 1 - a] * size[last - 1] / one[last - 1]
        cases.fall[some[within], 1] = size[last] * one[last]
        if a > 0:
            rise = _solved(low, inside * one[here], back=True)
            cases.leave[some, 0], cases.fall[some, 0] = (
                force[:, 0] / rise[:, 0],
                1 - rise @ self.c[here, a - 1],
            )

    def places(self, found: Pressed, softness, row: float) -> np.ndarray:
        """Places (2, q) [m] of the edges, as `edges.ContactEdge` has them; an end of the interface that bears is one.

        softness: (m,) [m/N] of a skin alone, 0 without one; row [m]: height of the first cells.
        """
        x, m, out = self.x, self.x.size, []
        for node, side, share in zip((found.first, found.stop - 1), (-1, 1), found.shares.T):
            after, inner = np.clip([node + side, node - side], 0, m - 1)
            cells = [
                np.abs(x[node] - x[np.where(one == node, other, one)])
                for one, other in ((inner, after), (after, inner))
            ]
            off = (1 - softness[node] / self.c.diagonal()[node]) * edge_offset(*cells, share, row)
            out.append(
                np.where(
                    after == node, x[node], x[node] + share * (x[after] - x[node]) - side * off
                )
            )
        return np.clip(out, x[0], x[-1])

    def stiffness(self, found: Pressed, lever: bool = False) -> np.ndarray:
        """Stiffnesses (q,) of contacts with their edges between nodes, as `edges.set_stiffness` has them: [N/m] of a
        translation, or [N m/rad] of a rotation about x = 0 where `lever`."""
        sums, a, b, m = self.table[:, 2 if lever else 0], found.first, found.stop, self.x.size
        out = here = sums[a, b]
        for inside, share, more, less in (
            (
                a > 0,
                found.shares[:, 0],
                sums[np.maximum(a - 1, 0), b],
                sums[np.minimum(a + 1, m), b],
            ),
            (
                b < m,
                found.shares[:, 1],
                sums[a, np.minimum(b + 1, m)],
                sums[a, np.maximum(b - 1, 0)],
            ),
        ):
            out = out + np.where(
                inside & (found.count >= 3),
                parabola_change(share - 0.5, more - here, here - less),
                0.0,
            )
        return out

    def _opening(self, gap, bent, closing, theta, x=None) -> np.ndarray:
        """Openings (q, m) [m]; bent (q, m) [m]: C times the forces; x: places of other nodes than all."""
        return gap + theta[:, None] * (self.x if x is None else x) - closing[:, None] + bent

    def _flaw(self, gap, force, bent, opening, closing, theta, target, turns: bool) -> np.ndarray:
        """Largest residual (q,) as `unilateral.residuals` has them; an overlap within OPENING_NOISE of its terms is none."""
        load, moment, spring = target.T
        depth = (
            np.abs(gap) + np.abs(theta[:, None] * self.x) + np.abs(closing)[:, None] + np.abs(bent)
        )
        share = opening / np.where(depth > 0, depth, 1.0)
        worst = [
            np.abs(force.sum(axis=1) - load) / load,
            np.maximum(-force.min(axis=1), 0.0) / load,
            np.where(force != 0, 0.0, np.maximum(-share - OPENING_NOISE, 0.0)).max(axis=1),
            (np.abs(force * share)).sum(axis=1) / load,
        ]
        if turns:
            lack = np.abs(force @ self.x - moment - spring * theta)
            worst.append(lack / (load * np.ptp(self.x) + np.abs(spring * theta)))
        out = np.max(worst, axis=0)
        return np.where(np.isfinite(out), out, np.inf)


def _solved(low, rows, back: bool = False) -> np.ndarray:
    """Each of rows (n, k) solved with a lower factor (k, k), or with its transpose where `back`."""
    return dtrsm(
        1.0, low, np.ascontiguousarray(rows).T, lower=1, trans_a=int(back), overwrite_b=1
    ).T
