"""Contacts that begin at an end of the interface and end once inside it: any number of them from one factor.

With C = L L^T in the order of the nodes, the leading k x k blocks of L are the factors of the first k nodes. So L^-1 of
a gap, of 1 and of x tells of every k at once what closing and rotation it takes, the force of its last node and the gap
at the next. One pass over k finds the contact set, and a back substitution with nothing behind node k its forces:

    L L^T f = closing - theta x - g on the first k nodes,    sum f = N,    sum f x = M + K theta.

A tilted flat piece presses like this under any load, and so does one whose load line is near an end. Twin:
`unilateral.solve`.
"""

from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from ..active_set import ROUND, factor
from ..edges import ASPECT, BEHIND


class Pressed(NamedTuple):
    """Contacts of q problems on m nodes.

    count: (q,) nodes that touch, from the end on; force: (q, m) [N]; opening: (q, m) [m]; closing: (q,) [m]; theta:
    (q,) [rad]; flaw: (q,) largest relative residual [1], infinite where no such contact was found.
    """

    count: np.ndarray
    force: np.ndarray
    opening: np.ndarray
    closing: np.ndarray
    theta: np.ndarray
    flaw: np.ndarray


class Anchored:
    """A compliance c (m, m) [m/N] on places x (m,) [m], its contacts beginning at the first node.

    one, arm: L^-1 of 1 and of x (m,); sums: (3, m + 1) running sums of one^2, one arm and arm^2, the stiffnesses dN/d
    closing, dN/d(-theta) and dM/d(-theta) of the first k nodes; diagonal: of L (m,).
    """

    def __init__(self, c, x):
        self.c, self.x, self.low = c, x, factor(np.array(c, order="C"))
        self.diagonal = self.low.diagonal()
        self.one, self.arm = self._forward(np.stack([np.ones(x.size), x], axis=1)).T
        parts = np.stack([self.one**2, self.one * self.arm, self.arm**2])
        self.sums = np.concatenate([np.zeros((3, 1)), np.cumsum(parts, axis=1)], axis=1)

    def _forward(self, sides):
        return solve_triangular(self.low, sides, lower=True, check_finite=False)

    def press(self, gap, load, moment=None, spring=0.0) -> Pressed:
        """Contacts on gaps (q, m) [m] under loads (q,) [N].

        moment: (q,) [N m] about x = 0 where the pieces are free to turn against the `spring` (q,) or () [N m/rad] of
        the holder; None: the rotation is held, it is in the gap. Where the contact is not of this kind `flaw` says so.
        """
        target = np.stack([load, np.zeros_like(load) if moment is None else moment])
        turns = moment is not None
        y = self._forward(gap.T).T
        count, found = self._counted(y, target, spring, turns)
        force, closing, theta = self._forces(y, target, count, spring, turns)
        inside = np.arange(self.x.size) < count[:, None]
        opening = self._opening(gap, force, closing, theta)
        lack = target - np.stack([force.sum(axis=1), force @ self.x - spring * theta])
        more, up, turn = self._forces(self._forward(np.where(inside, opening, 0.0).T).T, lack, count, spring, turns)
        force, closing, theta = force + more, closing + up, theta + turn
        opening = self._opening(gap, force, closing, theta)
        flaw = self._flaw(gap, force, opening, closing, theta, target, spring, turns)
        opening = np.where(inside, 0.0, np.maximum(opening, 0.0))
        return Pressed(count, force, opening, closing, theta, np.where(found, flaw, np.inf))

    def shares(self, pressed: Pressed) -> np.ndarray:
        """Shares (q,) of the cell behind the last node that the edges have passed, as `edges.End` has them; 0.5 for
        contact of all nodes."""
        last, after = pressed.count - 1, np.minimum(pressed.count, self.x.size - 1)
        rows = np.arange(last.size)
        # per approach the force of the last node rises by this, the gap at the next one falls by that
        leave = pressed.force[rows, last] / (self.one[last] / self.diagonal[last])
        enter = pressed.opening[rows, after] / (self.diagonal[after] * self.one[after])
        good = (self.one[last] > 0) & (self.one[after] > 0) & (leave + enter > 0) & (pressed.count < self.x.size)
        return np.divide(leave, leave + enter, out=np.full(last.size, 0.5), where=good)

    def places(self, count, shares, softness, row: float) -> np.ndarray:
        """Places (q,) [m] of the edges, as `edges.End` has them; the end of the interface for contact of all nodes.

        count, shares: (q,); softness: (m,) [m/N] of a skin alone, 0 without one; row [m]: height of the first cells.
        """
        x, m = self.x, self.x.size
        last, after = count - 1, np.minimum(count, m - 1)
        cell = np.abs(x[last] - x[np.where(last > 0, last - 1, after)])
        off = (1 - softness[last] / self.c.diagonal()[last]) * np.interp(
            row / np.where(cell > 0, cell, 1.0), ASPECT, BEHIND) * cell  # `edges.behind` of many
        return np.where(count < m, x[last] + shares * (x[after] - x[last]) - off, x[-1])

    def stiffness(self, count, shares, lever: bool = False) -> np.ndarray:
        """Stiffnesses (q,) of the first `count` (q,) nodes with their edges between nodes, as `edges.stiffness` has
        them: [N/m] of a translation, or [N m/rad] of a rotation about x = 0 where `lever`."""
        sums = self.sums[2 if lever else 0]
        more, less = sums[np.minimum(count + 1, self.x.size)] - sums[count], sums[count] - sums[count - 1]
        shift = np.where((count < self.x.size) & (count >= 3), shares - 0.5, 0.0)
        return sums[count] + shift * (more + less) / 2 + shift**2 * (more - less) / 2

    def _motion(self, y, target, spring, turns: bool) -> tuple:
        """(closing, theta) (q, m) of the first 1, 2, .. m nodes in contact, from L^-1 of the gaps y (q, m)."""
        a, b, c = self.sums[:, 1:]
        free = np.cumsum(y * self.one, axis=1) + target[0][:, None]
        if not turns:
            return free / a, np.zeros_like(free)
        pull = np.cumsum(y * self.arm, axis=1) + target[1][:, None]
        stiff = np.broadcast_to(np.asarray(spring, float), target[0].shape)[:, None]
        # closing a - theta b = N + b_g,  closing b - theta (c + K) = M + c_g
        with np.errstate(divide="ignore", invalid="ignore"):  # one node alone does not hold a free piece
            whole = a * (c + stiff) - b * b
            return (free * (c + stiff) - pull * b) / whole, (free * b - pull * a) / whole

    def _counted(self, y, target, spring, turns: bool) -> tuple:
        """(nodes in contact (q,), whether a set was found): the last node pushes, and the next one stays open."""
        closing, theta = self._motion(y, target, spring, turns)
        with np.errstate(invalid="ignore"):
            push = closing * self.one - theta * self.arm - y > 0
            ahead = closing[:, :-1] * self.one[1:] - theta[:, :-1] * self.arm[1:] - y[:, 1:] <= 0
        good = push & np.concatenate([ahead, np.ones((len(y), 1), bool)], axis=1)
        # of a few nodes a free rotation is round-off, which may look like a contact: the largest set is taken
        return self.x.size - np.argmax(good[:, ::-1], axis=1), good.any(axis=1)

    def _forces(self, y, target, count, spring, turns: bool) -> tuple:
        """(forces (q, m), closing (q,), theta (q,)) with the first `count` (q,) nodes in contact."""
        closing, theta = (part[np.arange(len(y)), count - 1] for part in self._motion(y, target, spring, turns))
        side = closing[:, None] * self.one - theta[:, None] * self.arm - y
        side[np.arange(self.x.size) >= count[:, None]] = 0.0
        return solve_triangular(self.low, side.T, lower=True, trans="T", check_finite=False).T, closing, theta

    def _opening(self, gap, force, closing, theta):
        return gap + theta[:, None] * self.x - closing[:, None] + force @ self.c

    def _flaw(self, gap, force, opening, closing, theta, target, spring, turns: bool):
        """Largest residual (q,) as `unilateral.residuals` has them; an overlap within ROUND of its terms is none."""
        load = target[0]
        tilted = theta[:, None] * self.x
        depth = np.abs(gap) + np.abs(tilted) + np.abs(closing)[:, None] + np.abs(force @ self.c)
        share = opening / np.where(depth > 0, depth, 1.0)
        touching = force != 0
        worst = [np.abs(force.sum(axis=1) - load) / load, np.maximum(-force.min(axis=1), 0.0) / load,
                 np.where(touching, 0.0, np.maximum(-share - ROUND, 0.0)).max(axis=1),
                 (np.abs(force * share)).sum(axis=1) / load]
        if turns:
            lack = np.abs(force @ self.x - target[1] - spring * theta)
            worst.append(lack / (load * np.ptp(self.x) + np.abs(spring * theta)))
        out = np.max(worst, axis=0)
        return np.where(np.isfinite(out), out, np.inf)
