"""Active sets of partial slip: which node is open, sticks or slips, on operators whose inverse follows the set.

Slip increment of node i: e_i = q - s_i - (C_tt t)_i - (C_nt^T f)_i with s the slip it has already made. Coulomb:
|t_i| <= mu f_i, e_i = 0 where the node sticks, e_i t_i >= 0 and |t_i| = mu f_i where it slips. A set that is visited
twice hands over to a slower method that ends: the convex program of the shear alone, or the alternation of normal and
shear problem for unlike pieces.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve, lu_factor, lu_solve
from scipy.linalg.lapack import dpotrf, dpotri

from ..core import NotConverged, PatchfemError
from .unilateral import solve_forces

ROUND = 1e-14  # of the largest value: what counts as nothing
MOST = 100  # sets tried before the slower method


class Kept:
    """Block of a symmetric positive definite operator on a set of nodes, and its inverse, kept from call to call.

    A few nodes more or less cost a low-rank update, O(n^2) each; the same set costs nothing.
    """

    def __init__(self, full: np.ndarray):
        self.full, self.index, self.updates = full, np.zeros(0, np.int64), 0
        self.largest = float(np.abs(full).max())
        self.block = self.inverse = np.zeros((0, 0))

    def on(self, index: np.ndarray) -> tuple:
        """(block, inverse), each (n, n), of the operator on the sorted nodes `index` (n,)."""
        if not np.array_equal(index, self.index):
            gone = np.isin(self.index, index, invert=True)
            new = np.setdiff1d(index, self.index, assume_unique=True)
            if gone.sum() + new.size > max(2, index.size // 10) or self.updates > 30:
                self._fresh(index)
            else:
                self._updated(index, gone, new)
        return self.block, self.inverse

    def _fresh(self, index) -> None:
        self.block = self.full[np.ix_(index, index)]
        low, fault = dpotrf(self.block, lower=1)
        if fault:
            raise PatchfemError("contact: the compliance is not positive definite on the contact set")
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


def rigid_columns(x, count: int) -> np.ndarray:
    """(m, count): motions (), (approach,) or (approach, -rotation)."""
    return np.stack([np.ones(x.size), x], axis=1)[:, :count]


def press_forces(kept: Kept, x, gap, target, active, spring: float = 0.0) -> tuple:
    """Normal forces (m,), motions and sets tried as `unilateral.solve_forces`, on an inverse that follows the set."""
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
        scale = 1e-13 * (kept.largest * np.abs(force).sum() + np.ptp(gap))
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
    """Shear forces (n,), slide and signs of the slipping nodes of a contact set under known limits mu f.

    index (n,) nodes, reference (n,) s + C_nt^T f [m], limit (n,) > 0 [N], sign (n,) of a neighbouring answer in
    -1, 0, 1; either `total` [N], smaller in size than sum(limit), or `slide` [m]. Also returns the sets tried.
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
    """Forces of the sticking nodes and the slide for given signs, by the smaller of both systems, refined once."""
    slips = sign != 0
    stuck = ~slips
    fixed = sign[slips] * limit[slips]
    force = np.empty(limit.size)
    force[slips] = fixed
    if 2 * slips.sum() <= limit.size:
        half = cho_factor(inverse[np.ix_(slips, slips)], lower=True, check_finite=False) if slips.any() else None
        across = inverse[np.ix_(stuck, slips)]

        def freed(whole):  # forces of the stuck nodes once the slipping ones carry nothing more
            return whole[stuck] - across @ cho_solve(half, whole[slips], check_finite=False) if slips.any() else whole

        def carried(right):
            return freed(inverse @ np.where(slips, 0.0, right))

        rate = freed(one)
        push = across @ cho_solve(half, fixed, check_finite=False) if slips.any() else 0.0
        rest = push - freed(zero)
    else:
        half = cho_factor(block[np.ix_(stuck, stuck)], lower=True, check_finite=False) if stuck.any() else None

        def carried(right):
            return cho_solve(half, right[stuck], check_finite=False) if stuck.any() else np.zeros(0)

        rate = carried(np.ones(limit.size))
        rest = -carried(reference + block[:, slips] @ fixed)
    motion = slide if total is None else (total - fixed.sum() - rest.sum()) / rate.sum()
    force[stuck] = rest + motion * rate
    more = carried(motion - reference - block @ force)
    step = 0.0 if total is None else (total - force.sum() - more.sum()) / rate.sum()
    force[stuck] += more + step * rate
    return force, motion + step


def _one_by_one(block, reference, limit, total, slide) -> tuple:
    """The convex program min t.C t/2 + t.(s - q) in the box, one node changed at a time: the energy falls, so it ends."""
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
        over = stuck & (np.abs(wanted) > limit * (1 + 1e-13) + ROUND * limit.max())
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


# ---- normal and shear together, unlike pieces

def coupled_forces(both: Kept, x, leg, reference, friction: float, spring: float, active, sign) -> tuple:
    """(f, t, motions, slide, signs, sets tried) of unlike pieces by Newton on the sets open, stick, slip.

    both: operator (2m, 2m) of normal and shear forces; leg(share): (gap, target, total, slide) of the increment from 0
    to 1, gap and target as in `solve_forces`, total [N] or slide [m] None; reference (m,) slip made; active, sign (m,)
    of the answer at 0. Where |total| is all that friction allows every node slips and the slide is the least that does
    it. NotConverged by name where more than one answer is possible.
    """
    share, step, count = 0.0, 1.0, 0
    while step >= 1 / 64:  # sets that are visited twice: come nearer by a part of the increment
        found = _by_sets(both, x, *leg(share + step), reference, friction, spring, active, sign)
        if found is None:
            step /= 2
            continue
        count += found[-1]
        if share + step == 1:
            return (*found[:-1], count)
        active, sign = found[0] > 0, found[4]
        share += step
        step = min(2 * step, 1 - share)
    return _alternate(both, x, *leg(1.0), reference, friction, spring)


def _locked(total, target, friction: float) -> int:
    """+-1 where a shear load is all that friction allows."""
    full = total is not None and target.size > 0 and abs(total) >= friction * target[0] * (1 - 1e-12)
    return int(np.sign(total)) if full else 0


def _by_sets(both, x, gap, target, total, slide, reference, friction, spring, active, sign):
    """Newton from the sets of a neighbour; None where it does not settle, NotConverged where it is not the only one."""
    m = x.size
    rigid = rigid_columns(x, target.size)
    locked = _locked(total, target, friction)
    active, sign, seen = active.copy(), sign.astype(np.int8), set()
    for count in range(1, MOST):
        if not active.sum() >= max(1, target.size):
            active = np.ones(m, bool)
        sign = np.where(active, locked or sign, 0).astype(np.int8)
        if total is not None and not locked and not (active & (sign == 0)).any():
            sign[:] = 0
        key = active.tobytes() + sign.tobytes()
        if key in seen:
            return None
        seen.add(key)
        index = np.flatnonzero(active)
        found = _newton(both, index, gap, reference, rigid, friction, target, spring, None if locked else total,
                        0.0 if locked else slide, sign[index])
        if found is None:
            return None
        force, shear, motion, moved_to, positive = found
        answer = both.full @ np.concatenate([force, shear])
        opening = gap - rigid @ motion + answer[:m]
        moved = moved_to - reference - answer[m:]
        if locked:
            moved_to = float(locked * np.max(locked * (reference + answer[m:])[index]))
            moved = np.where(active, locked * np.abs(moved), 0.0)
        deep = 1e-13 * (np.abs(answer[:m]).max() + np.ptp(gap))
        small = ROUND * (np.abs(moved[index]).max() + np.ptp(answer[m:]) + np.ptp(reference))
        keeps = (active & (force > 0)) | (~active & (opening < -deep))
        over = np.abs(shear) > friction * force + ROUND * friction * max(force.max(), 0.0)
        turned = np.where(sign == 0, np.where(over, np.sign(shear), 0),
                          np.where(sign * moved < -small, 0, sign)).astype(np.int8)
        turned[~keeps | ~active] = 0
        if np.array_equal(keeps, active) and np.array_equal(turned, sign):
            if not positive:
                raise NotConverged(_SEVERAL)
            return force, shear, motion, moved_to, sign, count
        active, sign = keeps, turned
    return None


_SEVERAL = ("contact: friction times the coupling of unlike pieces is too strong, more than one state of stick and slip "
            "is possible; lower friction.static or take pieces that are more alike")


def _newton(both, index, gap, reference, rigid, friction, target, spring, total, slide, sign):
    """One linear problem: w = 0 on the set, e = 0 where it sticks, t = sign mu f where it slips; None if singular."""
    m, n = gap.size, index.size
    pair = np.concatenate([index, m + index])
    block, inverse = both.on(pair)
    slips = np.flatnonzero(sign)
    cone = sign[slips] * friction
    count = target.size + (total is not None)
    # columns of the right-hand side: motions, then the slide where it is unknown
    columns = np.zeros((2 * n, count))
    columns[:n, :target.size] = rigid[index]
    if total is not None:
        columns[n:, -1] = 1.0
    slack = inverse[n + slips] - cone[:, None] * inverse[slips]
    system = slack[:, n + slips]
    try:
        factor = lu_factor(system, check_finite=False) if slips.size else None
    except (np.linalg.LinAlgError, ValueError):
        return None
    turns = 0 if factor is None else int(np.sum(np.sign(np.diag(factor[0])) < 0) + np.sum(
        factor[1] != np.arange(slips.size)))

    def solve(right, cut=0.0):
        if factor is not None:
            right = right.copy()
            right[n + slips] -= lu_solve(factor, slack @ right - cut, check_finite=False)
        return inverse @ right

    rows = np.zeros((count, 2 * n))
    rows[:target.size, :n] = rigid[index].T
    stiff = np.zeros((count, count))
    wanted = np.zeros(count)
    wanted[:target.size] = target
    if target.size > 1:
        stiff[1, 1] = spring
    if total is not None:
        rows[-1, n:], wanted[-1] = 1.0, total
    lift = solve(columns) if count else columns
    base = np.concatenate([-gap[index], (0.0 if total is not None else slide) - reference[index]])
    near = gap[index].min() if target.size else 0.0
    base[:n] += near
    answer, motion = np.zeros(2 * n), np.zeros(count)
    for _ in range(2):
        miss = base + columns @ motion - block @ answer
        miss[n + slips] = 0.0
        step = solve(miss, answer[n + slips] * -1.0 + cone * answer[slips])
        if count:
            try:
                more = np.linalg.solve(rows @ lift + stiff, wanted - rows @ (answer + step) - stiff @ motion)
            except np.linalg.LinAlgError:
                return None
            step, motion = step + lift @ more, motion + more
        answer = answer + step
    if not np.isfinite(answer).all():
        return None
    force, shear = np.zeros(m), np.zeros(m)
    force[index], shear[index] = answer[:n], answer[n:]
    moved_to = float(motion[-1]) if total is not None else float(slide)
    motion = motion[:target.size].copy()
    if target.size:
        motion[0] += near
    return force, shear, motion, moved_to, turns % 2 == 0


def _alternate(both, x, gap, target, total, slide, reference, friction, spring) -> tuple:
    """Normal problem under the last shear and shear problem under the last pressure in turn: a contraction while
    friction times coupling is small."""
    m = x.size
    normal, tangential = Kept(both.full[:m, :m]), Kept(both.full[m:, m:])
    coupling, locked = both.full[:m, m:], _locked(total, target, friction)
    active = np.ones(m, bool)
    shear, moved_to, sign = np.zeros(m), slide if slide is not None else 0.0, np.zeros(m, np.int8)
    for count in range(1, 4 * MOST):
        force, motion, _ = press_forces(normal, x, gap + coupling @ shear, target, active, spring)
        active = force > 0
        index = np.flatnonzero(active)
        if index.size == 0:
            break
        limit = friction * force[index]
        there = reference[index] + coupling[:, index].T @ force
        new = np.zeros(m)
        if total is not None and (locked or abs(total) >= limit.sum()):
            way = locked or int(np.sign(total))
            new[index] = way * limit
            moved_to = way * float(np.max(way * (there + tangential.full[np.ix_(index, index)] @ new[index])))
            sign = np.where(force > 0, way, 0).astype(np.int8)
        else:
            found = bounded_shear(tangential, index, there, limit, sign[index], total, slide)
            new[index], moved_to = found[0], found[1]
            sign = np.zeros(m, np.int8)
            sign[index] = found[2]
        change, shear = np.abs(new - shear).max(), new
        if change <= 1e-14 * (friction * force.sum()):
            return force, shear, motion, float(moved_to), sign, MOST + count
    raise NotConverged(_SEVERAL)
