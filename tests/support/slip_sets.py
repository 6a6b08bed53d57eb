"""Active sets of partial slip: which node is open, sticks or slips, on operators whose inverse follows the set.

Slip increment of node i: e_i = q - s_i - (C_tt t)_i - (C_nt^T f)_i, with s the slip it has already made. Coulomb: |t_i|
<= mu f_i, e_i = 0 where the node sticks, e_i t_i >= 0 and |t_i| = mu f_i where it slips. Here C_nt = 0, so pressure
comes first, then the shear, a convex program. A set that is visited twice hands over to a slower method that ends.
`slip_unlike` solves pressure and shear together.
"""

import numpy as np

from patchfem.contact.unilateral import INDEFINITE, solve_forces
from patchfem.core import NotConverged, PatchfemError
from patchfem.elasticity.lapack import cho_factor, cho_solve, dpotrf, dpotri

ROUND = 1e-14  # of the largest value: what counts as nothing
MOST = 100  # sets tried before the slower method


class Kept:
    """Inverse of a symmetric positive definite operator on a set of nodes, kept from call to call.

    A few nodes more or less cost a low-rank update, O(n^2) each; the same set costs nothing.
    """

    def __init__(self, full: np.ndarray):
        self.full, self.index, self.updates = full, np.zeros(0, np.int64), 0
        self.largest = float(np.abs(full).max())
        self.block = self.inverse = np.zeros((0, 0))

    def on(self, index: np.ndarray) -> tuple:
        """Block of the operator on the sorted nodes `index` (n,) and its inverse, (n, n) each.

        PatchfemError where the block is not positive definite.
        """
        if not np.array_equal(index, self.index):
            gone = np.isin(self.index, index, invert=True)
            new = np.setdiff1d(index, self.index, assume_unique=True)
            # many nodes cost as much as a new inverse, and round-off adds up from update to update
            if gone.sum() + new.size > max(2, index.size // 10) or self.updates > 30:
                self._fresh(index)
            else:
                self._updated(index, gone, new)
        return self.block, self.inverse

    def _fresh(self, index) -> None:
        self.block = self.full[np.ix_(index, index)]
        low, fault = dpotrf(self.block, lower=1)
        if fault:
            raise PatchfemError(INDEFINITE)
        low, _ = dpotri(low, lower=1)
        self.inverse = np.tril(low) + np.tril(low, -1).T
        self.index, self.updates = index.copy(), 0

    def _updated(self, index, gone, new) -> None:
        k, rest = self.inverse, self.index[~gone]
        if gone.any():
            side = k[np.ix_(~gone, gone)]
            k = k[np.ix_(~gone, ~gone)] - side @ np.linalg.solve(k[np.ix_(gone, gone)], side.T)
        if new.size:
            reach = k @ self.full[np.ix_(rest, new)]
            own = np.linalg.inv(self.full[np.ix_(new, new)] - self.full[np.ix_(new, rest)] @ reach)
            k = np.block([[k + reach @ own @ reach.T, -reach @ own], [-own @ reach.T, own]])
            place = np.argsort(np.concatenate([rest, new]))
            k = k[np.ix_(place, place)]
        self.block, self.inverse = self.full[np.ix_(index, index)], k
        self.index, self.updates = index.copy(), self.updates + 1
        probe = np.cos(np.arange(index.size)**2 % 7.0)
        # a probe of no symmetry: where its answer is off, the inverse is made anew
        if not np.abs(self.block @ (k @ probe) - probe).max() <= 1e-11:
            self._fresh(index)


def rigid_columns(x, count: int) -> np.ndarray:
    """Rigid motions (m, count) of the upper holder: approach, then minus rotation about x = 0.

    x: (m,) [m]; count: 0 (none), 1 or 2.
    """
    return np.stack([np.ones(x.size), x], axis=1)[:, :count]


def press_forces(kept: Kept, x, gap, target, active, spring: float = 0.0) -> tuple:
    """Normal forces (m,) [N], rigid motions and sets tried of a contact, on an inverse that follows the set.

    kept: inverse of the normal compliance; x, gap: (m,) [m]; target, spring and the motions as in
    `unilateral.solve_forces`, which takes over where sets come back; active: (m,) bool of a neighbouring answer.
    """
    rigid = rigid_columns(x, target.size)
    active = active.copy() if active.sum() >= max(1, target.size) else np.zeros(0, bool)
    seen = set()
    for count in range(1, MOST):
        if active.sum() < max(1, target.size) or active.tobytes() in seen:
            break
        seen.add(active.tobytes())
        index = np.flatnonzero(active)
        force = np.zeros(x.size)
        force[index], motion = _sole(kept, index, gap[index], rigid[index], target, spring)
        opening = gap - rigid @ motion + kept.full @ force
        scale = 1e-13 * (kept.largest * np.abs(force).sum() + np.ptp(gap))  # round-off of an opening
        following = (active & (force > 0)) | (~active & (opening < -scale))
        if np.array_equal(following, active):
            return force, motion, count
        active = following
    return solve_forces(kept.full, x, gap, target, active if active.any() else None, spring=spring)


def _sole(kept, index, gap, rigid, target, spring):
    """Forces and motions of a closed set, refined once on the operator itself."""
    block, inverse = kept.on(index)
    lift = inverse @ rigid
    stiff = np.diag([0.0, spring][:target.size])
    force, motion, near = np.zeros(index.size), np.zeros(target.size), 0.0
    if target.size:
        near = gap.min()
    for _ in range(2):
        free = inverse @ (gap - near - rigid @ motion + block @ force)
        step = np.linalg.solve(rigid.T @ lift + stiff, target - rigid.T @ force - stiff @ motion + rigid.T @ free) \
            if target.size else motion
        force = force + lift @ step - free
        motion = motion + step
    if target.size:
        motion[0] += near
    return force, motion


# ---- the shear alone, normal forces given

def bounded_shear(kept: Kept, index, reference, limit, sign, total=None, slide=None) -> tuple:
    """Shear forces of a contact set under known limits mu f, with the slide and the signs of the slipping nodes.

    Returns forces (n,) [N], slide [m], signs (n,), sets tried. kept: inverse of the tangential compliance; index: (n,)
    nodes; reference: (n,) s + C_nt^T f [m]; limit: (n,) > 0 [N]; sign: (n,) -1, 0, 1 of a neighbouring answer; either
    `total` [N], smaller in size than sum(limit), or `slide` [m]. NotConverged where the slower method does not end.
    """
    block, inverse = kept.on(index)
    sign, seen = sign.copy(), set()
    zero, one = inverse @ reference, inverse.sum(axis=1)
    for count in range(1, MOST):
        key = sign.tobytes()
        if key in seen or (total is not None and not (sign == 0).any()):
            break
        seen.add(key)
        force, motion = _stroke(block, inverse, zero, one, reference, limit, sign, total, slide)
        moved = motion - reference - block @ force
        small = ROUND * (np.abs(moved).max() + np.ptp(reference) + kept.largest * limit.max())
        following = np.where(sign == 0, np.where(np.abs(force) > limit + ROUND * limit.max(), np.sign(force), 0),
                             np.where(sign * moved < -small, 0, sign)).astype(np.int8)
        if np.array_equal(following, sign):
            return force, motion, sign, count
        sign = following
    return (*_one_by_one(block, reference, limit, total, slide), MOST)


def _stroke(block, inverse, zero, one, reference, limit, sign, total, slide):
    """Forces of the sticking nodes and the slide for given signs, by the smaller of the two linear systems, refined
    once."""
    slips = sign != 0
    stuck = ~slips
    fixed = sign[slips] * limit[slips]
    force = np.empty(limit.size)
    force[slips] = fixed
    if 2 * slips.sum() <= limit.size:
        half = cho_factor(inverse[np.ix_(slips, slips)]) if slips.any() else None
        across = inverse[np.ix_(stuck, slips)]

        def freed(whole):  # forces of the stuck nodes once the slipping ones carry nothing more
            return whole[stuck] - across @ cho_solve(half, whole[slips]) if slips.any() else whole

        def carried(right):
            return freed(inverse @ np.where(slips, 0.0, right))

        rate = freed(one)
        push = across @ cho_solve(half, fixed) if slips.any() else 0.0
        rest = push - freed(zero)
    else:
        half = cho_factor(block[np.ix_(stuck, stuck)]) if stuck.any() else None

        def carried(right):
            return cho_solve(half, right[stuck]) if stuck.any() else np.zeros(0)

        rate = carried(np.ones(limit.size))
        rest = -carried(reference + block[:, slips] @ fixed)
    motion = slide if total is None else (total - fixed.sum() - rest.sum()) / rate.sum()
    force[stuck] = rest + motion * rate
    more = carried(motion - reference - block @ force)
    step = 0.0 if total is None else (total - force.sum() - more.sum()) / rate.sum()
    force[stuck] += more + step * rate
    return force, motion + step


def _one_by_one(block, reference, limit, total, slide) -> tuple:
    """Slower method: the convex program min t.C t/2 + t.(s - q) in the box, one node at a time.

    The energy falls at every step, so it ends.
    """
    n = limit.size
    force = np.zeros(n) if total is None else total / limit.sum() * limit
    sign = np.zeros(n, np.int8)
    for _ in range(50 * n):
        motion = slide
        wanted = sign * limit
        stuck = sign == 0
        if stuck.any():
            both = np.linalg.solve(block[np.ix_(stuck, stuck)], np.column_stack(
                [-reference[stuck] - block[np.ix_(stuck, ~stuck)] @ wanted[~stuck], np.ones(stuck.sum())]))
            if total is not None:
                motion = (total - wanted.sum() - both[:, 0].sum()) / both[:, 1].sum()
            wanted[stuck] = both[:, 0] + motion * both[:, 1]
        over = stuck & (np.abs(wanted) > limit * (1 + 1e-13) + ROUND * limit.max())  # beyond round-off
        if over.any():
            way = np.where(over, wanted - force, 1.0)
            share = np.where(over, (np.sign(wanted) * limit - force) / np.where(way == 0, 1.0, way), np.inf)
            first = int(np.argmin(share))
            force = force + max(share[first], 0.0) * (wanted - force)
            sign[first] = np.sign(wanted[first])
            force[first] = sign[first] * limit[first]
            continue
        force = wanted
        if motion is None:  # every node slips under a total: any slide between both groups will do
            at = reference + block @ force
            low = int(np.argmax(np.where(sign > 0, at, -np.inf)))
            high = int(np.argmin(np.where(sign < 0, at, np.inf)))
            if not ((sign > 0).any() and (sign < 0).any()) or at[low] <= at[high]:
                return force, float(at[low] if (sign > 0).any() else at[high]), sign
            sign[low] = sign[high] = 0
            continue
        moved = sign * (motion - reference - block @ force)
        worst = int(np.argmin(np.where(stuck, np.inf, moved)))
        if stuck.all() or moved[worst] >= -1e-13 * (np.ptp(reference) + np.abs(block @ limit).max()):
            return force, float(motion), sign
        sign[worst] = 0
    raise NotConverged("contact: stick and slip did not settle; take smaller steps of the load")
