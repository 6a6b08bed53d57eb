"""Partial slip of unlike pieces: shear opens and closes the gap, so pressure and shear are found together.

Newton's method works on the sets open, stick and slip of `sets`. Where it comes back to a set it has seen, a part of
the increment is solved first; at last the normal and the shear problem take turns. Friction makes the system
unsymmetric. Once mu times the coupling is so strong that its determinant is not positive, the answer is not the only
one and is refused.
"""

import numpy as np
from scipy.linalg import lu_factor, lu_solve
from slip_sets import MOST, ROUND, Kept, bounded_shear, press_forces, rigid_columns

from patchfem.core import NotConverged


def coupled_forces(both: Kept, x, leg, reference, friction: float, spring: float, active, sign) -> tuple:
    """Forces of unlike pieces by Newton's method on the sets open, stick and slip.

    Returns (f, t, motions, slide, signs, sets tried). both: operator (2m, 2m) of normal and shear forces; leg(share):
    (gap, target, total, slide) of the increment from 0 to 1, gap and target as in `solve_forces`, total [N] or slide
    [m] None; reference: (m,) slip made; active, sign: (m,) of the answer at 0. Where |total| is all that friction
    allows every node slips, and the slide is the least that does it. NotConverged by name where more than one answer is
    possible.
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
    """Sign of a shear load that is all that friction allows, else 0."""
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


_STRONG = "; friction times coupling of the unlike pieces is too strong: lower friction.static or take smaller steps"
_SEVERAL = "contact: more than one state of stick and slip is possible" + _STRONG
_UNSETTLED = "contact: stick and slip of the unlike pieces did not settle" + _STRONG


def _newton(both, index, gap, reference, rigid, friction, target, spring, total, slide, sign):
    """Solve one linear problem: w = 0 on the set, e = 0 where it sticks, t = sign mu f where it slips; None if
    singular."""
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
    """Normal problem under the last shear and shear problem under the last pressure, in turn.

    That is a contraction while friction times coupling is small.
    """
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
        if change <= 1e-14 * (friction * force.sum()):  # of mu N: round-off
            return force, shear, motion, float(moved_to), sign, MOST + count
    raise NotConverged(_UNSETTLED)
