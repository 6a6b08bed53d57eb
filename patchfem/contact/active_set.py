"""Primal-dual active-set method on a dense interface compliance, started from the rest position of a rigid piece.

On a guessed contact set A the forces and the rigid motion follow from

    C_AA f - closing = -g on A,    sum f = N,    sum f x = M + K theta,    closing = lift + lean (x - centre)

by one Cholesky factorisation; nodes that pull leave, nodes that overlap enter, until the set repeats itself. `centre`
makes lift and lean independent of each other (their 2 x 2 system diagonal), so a contact of two neighbouring nodes at
the far end loses no digits. The lean is -theta.
"""

from typing import NamedTuple

import numpy as np

from ..elasticity.lapack import dpotrf, dpotrs

ROUND = 1e-14  # rounding of an opening, relative to the terms it is the sum of


def factor(matrix: np.ndarray) -> np.ndarray:
    """Lower Cholesky factor of a symmetric C-ordered matrix, in its place; LinAlgError unless it is positive definite."""
    low, info = dpotrf(matrix.T, lower=1, overwrite_a=1, clean=0)
    if info:
        raise np.linalg.LinAlgError("not positive definite")
    return low


class Operator:
    """A compliance c (m, m) [m/N], symmetric positive definite, that solves equations on a part of its nodes."""

    __slots__ = ("c",)

    def __init__(self, c: np.ndarray):
        self.c = c

    @property
    def own(self) -> float:
        """Mean compliance [m/N] of a node under its own force."""
        return float(self.c.diagonal().mean())

    @property
    def longest(self) -> float:
        """Bound of the largest eigenvalue [m/N]."""
        return float(np.abs(self.c).sum(axis=1).max())

    def product(self, force: np.ndarray) -> np.ndarray:
        """Displacement C f (m,) [m] of forces f (m,) [N]."""
        return self.c @ force

    def part(self, rows: np.ndarray) -> np.ndarray:
        """Copy (n, n) [m/N] of the block of `rows` (n,), sorted indices of nodes, C-ordered."""
        if rows[-1] - rows[0] == rows.size - 1:
            return self.c[rows[0] : rows[-1] + 1, rows[0] : rows[-1] + 1].copy()
        return self.c[rows[:, None], rows]

    def solver(self, active: np.ndarray):
        """Factor the block of the active nodes and return a function that solves with it.

        Parameters
        ----------
        active : (m,) bool ndarray
            The nodes whose block of the compliance is factored; n of them are set.

        Returns
        -------
        callable
            Function (n, k) -> (n, k) that solves for k right-hand sides.

        Raises
        ------
        LinAlgError
            If the block is not positive definite.
        """
        lower_factor = factor(self.part(np.flatnonzero(active)))
        return lambda right_sides: dpotrs(lower_factor, right_sides, lower=1)[0]

    def bent(self, force: np.ndarray, index: np.ndarray) -> np.ndarray:
        """Displacement C f (m,) [m] of forces f (m,) [N] that vanish outside the sorted nodes `index`."""
        span = slice(index[0], index[-1] + 1)
        return self.c[:, span] @ force[span]


class ContactProblem(NamedTuple):
    """A contact problem: what presses two pieces of a given gap.

    x: (m,) nodes [m]; gap: (m,) [m] from first touch on, below zero where the pieces overlap under a given approach;
    load [N], None: the approach is given and already in the gap; moment [N m], None: the rotation is held and already
    in the gap; spring [N m/rad] of the holder against rotation.
    """

    x: np.ndarray
    gap: np.ndarray
    load: float | None = None
    moment: float | None = None
    spring: float = 0.0

    @property
    def least(self) -> int:
        """Fewest touching nodes that determine the rigid motion: 2 where the rotation is free and unsprung, else 1."""
        return 2 if self.moment is not None and self.spring == 0 else 1


class Found(NamedTuple):
    """The motion under a given contact set, whatever the signs of its forces.

    force: (m,) [N]; opening: (m,) [m]; scale: (m,) sum of the magnitudes of the terms of each opening [m], against
    which its round-off is measured; closing [m] at x = 0; theta: rotation [rad]; stiffness: dN/d(closing) at held
    rotation [N/m].
    """

    force: np.ndarray
    opening: np.ndarray
    scale: np.ndarray
    closing: float
    theta: float
    stiffness: float


class _Motion:
    """Equations of one contact set: from a gap, a load and a moment to forces and rigid motion.

    The moment is taken about `centre`, which makes lift and lean independent of each other.
    """

    def __init__(self, operator: Operator, ask: ContactProblem, active, index):
        x, gap = ask.x[index], ask.gap[index]
        given = (ask.load is not None) + (ask.moment is not None)
        self.solve, self.centre = operator.solver(active), 0.0
        self.rows, self.stiffness = np.zeros((0, x.size)), np.zeros(0)
        # taken out first: the closing may be far smaller than the gaps
        self.near = gap.min() if given else 0.0
        middle = (x[0] + x[-1]) / 2
        sides = self.solve(np.stack([gap - self.near, np.ones(x.size), x - middle][: 1 + given]).T)
        self.free, self.lift = sides[:, 0], sides[:, 1:]
        if given == 0:
            return
        total = self.lift[:, 0].sum()
        self.rows, self.stiffness = np.ones((1, x.size)), np.array([total])
        if given > 1:
            shift = self.lift[:, 1].sum() / total
            self.centre = middle + shift
            self.lift[:, 1] -= shift * self.lift[:, 0]
            self.rows = np.stack([np.ones(x.size), x - self.centre])
            turn = self.rows[1] @ self.lift[:, 1] + ask.spring
            self.stiffness = np.array([total, turn])
        if not (self.stiffness > 0).all():
            raise np.linalg.LinAlgError(
                "the nodes in contact do not determine the rigid-body motion"
            )

    def forces(self, target, free=None, near: float = 0.0) -> tuple:
        """Forces (n,) and (lift, lean) with C f - closing = -near - C free and the sums in `target`.

        Without `free` they are those of the gap of the problem.
        """
        free, near = (self.free, self.near) if free is None else (free, near)
        motion = (target + self.rows @ free) / self.stiffness
        force = self.lift @ motion - free
        motion[:1] += near
        return force, motion

    def correction(self, opening, lack) -> tuple:
        """Changes of forces and motion that close an opening (n,) and make up for a lack of load and moment."""
        return self.forces(lack, self.solve(opening[:, None])[:, 0])


def on_set(operator: Operator, ask: ContactProblem, active: np.ndarray, polish: int = 0) -> Found:
    """Forces and motion with the nodes `active` (m,) in contact, whatever the signs.

    polish: steps of iterative refinement. LinAlgError where the set does not determine the motion.
    """
    index = np.flatnonzero(active)
    system = _Motion(operator, ask, active, index)
    target = np.array([value for value in (ask.load, ask.moment) if value is not None])
    if target.size > 1:
        target[1] -= target[0] * system.centre
    inside, motion = system.forces(target)
    force = np.zeros(ask.x.size)
    for step in range(polish + 1):
        force[index] = inside
        lift, lean = (*motion, 0.0, 0.0)[:2]
        tilted = lean * (ask.x - system.centre)
        bent = operator.bent(force, index)
        opening = ask.gap - lift - tilted + bent
        scale = np.abs(ask.gap) + abs(lift) + np.abs(tilted) + np.abs(bent).max()
        if step == polish:
            break
        lack = target - system.rows @ inside
        lack[1:] -= ask.spring * lean
        more, turn = system.correction(opening[index], lack)
        inside, motion = inside + more, motion + turn
    stiffness = float(system.stiffness[0]) if target.size else 0.0
    return Found(force, opening, scale, float(lift - lean * system.centre), -float(lean), stiffness)


def settle(operator: Operator, ask: ContactProblem, active: np.ndarray, limit: int = 100) -> tuple:
    """Primal-dual active set from `active` (m,) on: (Found or None, last set, iterations).

    None where a set came back, where a set was singular or after `limit` iterations. Nodes that pull leave the set,
    nodes that overlap enter it (Hintermüller, Ito, Kunisch 2003).
    """
    seen = set()
    for count in range(1, limit + 1):
        active = supported(ask, active)
        key = active.tobytes()
        if key in seen:
            return None, active, count
        seen.add(key)
        try:
            found = on_set(operator, ask, active)
        except np.linalg.LinAlgError:
            return None, active, count
        following = np.where(active, found.force > 0, found.opening < -ROUND * found.scale)
        if np.array_equal(following, active):
            return polished(operator, ask, active, found), active, count
        active = following
    return None, active, limit


def supported(ask: ContactProblem, active: np.ndarray) -> np.ndarray:
    """The set, completed so that it can carry the load.

    Where it does not reach to both sides of the load line, the lowest node of each side is added.
    """
    index = np.flatnonzero(active)
    if ask.least == 1:
        return active if index.size else ask.gap <= ask.gap.min()
    line = ask.moment / ask.load
    if index.size > 1 and ask.x[index[0]] <= line <= ask.x[index[-1]]:
        return active
    out = active.copy()
    for side in (ask.x <= line, ask.x > line):
        out[np.argmin(np.where(side, ask.gap, np.inf))] = True
    return out


def flaw(found: Found) -> float:
    """Largest relative violation of contact [1]: openings and overlaps over their scale, pulls over the load."""
    share = found.opening / np.where(found.scale > 0, found.scale, 1.0)
    inside = np.abs(share[found.force != 0]).max(initial=0.0)
    pull = -found.force.min() / max(found.force.sum(), 1e-300)
    return float(max(inside, -share.min(), pull))


def polished(operator, ask, active, found: Found) -> Found:
    """The answer on the same set, refined once where its openings show round-off, if that lowers its `flaw`.

    active: (m,) contact set of `found`.
    """
    # a tenth of the bound at which a node enters the set
    off = np.abs(found.opening[active]) > ROUND / 10 * found.scale[active]
    if not off.any():
        return found
    finer = on_set(operator, ask, active, polish=2)
    return finer if flaw(finer) < flaw(found) else found


def rest(x, gap, load: float, moment: float, spring: float) -> float:
    """Rotation theta [rad] at which a rigid piece comes to rest on the gap (m,) under load and moment.

    It lies on the edge of the lower convex hull of the gap below the load line; against a spring [N m/rad] it may lie
    on one corner. load [N], moment [N m]; x (m,), gap (m,) [m].
    """
    a, b = 0, x.size - 1
    while a < b:
        theta = -(gap[b] - gap[a]) / (x[b] - x[a])
        height = gap + theta * x
        j = int(np.argmin(height))
        if a < j < b and height[j] < min(height[a], height[b]):
            lack = load * x[j] - moment - spring * theta
            if lack == 0:
                return float(theta)
            a, b = (a, j) if lack > 0 else (j, b)
            continue
        if spring > 0 and load * x[a] - moment - spring * theta > 0:
            b = a
        elif spring > 0 and load * x[b] - moment - spring * theta < 0:
            a = b
        else:
            return float(theta)
    return float((load * x[a] - moment) / spring)


def first_set(operator: Operator, ask: ContactProblem) -> np.ndarray:
    """First guess of the contact set: the nodes that the load is likely to reach from the rest position.

    The load sinks the piece by the geometric mean of what a point load and an even load would. Under a given approach
    the nodes that overlap are taken.
    """
    if ask.load is None:
        return ask.gap < 0
    deep = ask.load * np.sqrt(abs(operator.c.diagonal().mean() * operator.c.mean()))
    return ask.gap <= ask.gap.min() + deep
