"""Fallbacks of the active set: constrained conjugate gradients on the same dense compliance, and a finite descent.

The gradients follow Polonsky and Keer (Wear 231, 1999, 206). The load, or load and moment, is restored after each step
by the nearest admissible forces. The energy is watched: where it rises, a step that cannot fail is put between.

The descent is the primal active-set method of the strictly convex program: its forces stay feasible and its energy
falls at each step.
"""

import numpy as np

from ..core import NotConverged
from .active_set import ROUND, ContactProblem, Operator, on_set, polished, supported


def _program(operator: Operator, ask: ContactProblem) -> tuple:
    """The contact problem as a convex program: (bent, gap, rigid, sums) of min f.bent(f)/2 + gap.f, f >= 0, rigid^T f =
    sums.

    All rigid motions have the size 1. A spring takes part as two more forces >= 0 that turn the piece either way; each
    has the compliance of a node.
    """
    bent, gap, own = operator.product, ask.gap, operator.own
    middle, half = ask.x.mean(), np.ptp(ask.x) / 2
    rigid = np.stack([np.ones(ask.x.size), (ask.x - middle) / half], axis=1)
    if ask.moment is None:
        some = 0 if ask.load is None else 1
        return bent, gap, rigid[:, :some], np.array([ask.load] * some, float)
    sums = np.array([ask.load, (ask.moment - ask.load * middle) / half])
    if ask.spring == 0:
        return bent, gap, rigid, sums
    arm = np.sqrt(ask.spring * own) / half
    rigid = np.concatenate([rigid, [[0.0, arm], [0.0, -arm]]])
    return (
        lambda force: np.concatenate([bent(force[:-2]), own * force[-2:]]),
        np.concatenate([gap, [0.0, 0.0]]),
        rigid,
        sums,
    )


def nearest(force: np.ndarray, rigid: np.ndarray, sums: np.ndarray, limit: int = 100) -> np.ndarray:
    """The nonnegative forces nearest to `force` (m,) [N] whose sums over the rigid motions (m, r) are `sums` (r,).

    They are max(0, force + rigid q), where q maximises a concave piecewise quadratic. Newton's method with an exact
    line search ends after finitely many pieces.
    """
    if not sums.size:
        return np.maximum(force, 0.0)
    most, raised = rigid.T @ rigid, force
    # for motions that the nodes in force do not fix
    most += 1e-3 * np.trace(most) * np.eye(sums.size)
    for _ in range(limit):
        out = np.maximum(raised, 0.0)
        lack = sums - rigid.T @ out
        if np.abs(lack).max() <= 1e-14 * sums[0]:
            break
        inside = rigid[out > 0]
        along = np.linalg.solve(inside.T @ inside + 1e-10 * most, lack)
        step = rigid @ along
        raised = raised + _top(raised, step, sums @ along) * step
    return np.maximum(raised, 0.0)


def _top(start, step, rise: float) -> float:
    """The t > 0 with step . max(0, start + t step) = rise; the left-hand side grows with t, piece by piece."""
    inside = (start > 0) | ((start == 0) & (step > 0))
    change = np.flatnonzero(start * step < 0)
    at = -start[change] / step[change]
    order = np.argsort(at)
    change, at = change[order], at[order]
    sign = np.sign(step[change])
    level = np.cumsum(
        np.concatenate([[start[inside] @ step[inside]], sign * start[change] * step[change]])
    )
    slope = np.cumsum(np.concatenate([[step[inside] @ step[inside]], sign * step[change] ** 2]))
    beyond = np.flatnonzero(level[:-1] + at * slope[:-1] >= rise)
    piece = beyond[0] if beyond.size else -1
    return (rise - level[piece]) / slope[piece] if slope[piece] > 0 else 0.0


def gradients(
    operator, ask: ContactProblem, tolerance: float = 1e-11, limit: int = 1000, start=None
) -> tuple:
    """Conjugate gradients: forces (m,) [N] near the answer, nonnegative and with the right sums, and the iterations.

    operator: an Operator, or what has its `product`, `own` and `longest`; start: (m,) forces [N] to begin with. The
    last digits are left to the active set.
    """
    bent, gap, rigid, sums = _program(operator, ask)
    longest = operator.longest
    safe = 1 / max(longest, operator.own)
    even = np.full(gap.size, ask.load / gap.size) if sums.size else np.maximum(-gap, 0.0) / longest
    if start is not None:
        even = np.concatenate([start, np.zeros(gap.size - start.size)])
    force = nearest(even, rigid, sums)
    along, last, keep = np.zeros(gap.size), 1.0, 0.0
    held, least = force, np.inf
    for count in range(1, limit + 1):
        sunk = bent(force)
        energy = force @ (gap + sunk / 2)
        # 1e-13: round-off of the sums
        if energy > least + 1e-13 * np.abs(force * gap).sum() + 1e-13 * (force @ sunk):
            force = nearest(held - safe * (gap + bent(held)), rigid, sums)  # this one always falls
            keep, least = 0.0, np.inf
            continue
        held, least = force, energy
        touch = force > 0
        slope = gap + sunk
        slope -= rigid @ _fit(rigid[touch], slope[touch])
        here = slope[touch] @ slope[touch]
        worst = max(np.abs(slope[touch]).max(initial=0.0), -slope.min())
        if worst <= tolerance * np.abs(sunk).max() + ROUND * np.abs(gap[touch]).max(initial=0.0):
            return force[: ask.x.size], count
        along = np.where(touch, slope + keep * here / last * along, 0.0)
        stiff = bent(along)
        curve = along @ stiff
        length = (slope @ along) / curve if curve > 0 else safe
        moved = np.maximum(force - length * along, 0.0)
        late = (moved == 0) & (slope < 0)
        keep, last = (0.0 if late.any() else 1.0), max(here, 1e-300)
        moved[late] -= length * slope[late]
        force = _restored(moved, rigid, sums)
    return force[: ask.x.size], limit


def _restored(force, rigid, sums) -> np.ndarray:
    """Admissible forces near to nonnegative ones; nodes at rest stay at rest unless the others cannot carry the load."""
    awake = force > 0
    out = np.zeros(force.size)
    if np.count_nonzero(awake) >= sums.size:
        out[awake] = nearest(force[awake], rigid[awake], sums)
    if sums.size and not np.abs(sums - rigid.T @ out).max() <= 1e-12 * sums[0]:
        out = nearest(force, rigid, sums)
    return out


def _fit(rigid, values) -> np.ndarray:
    return np.linalg.lstsq(rigid, values, rcond=1e-13)[0] if rigid.shape[1] else np.zeros(0)


def descend(
    operator: Operator, ask: ContactProblem, force: np.ndarray, limit: int | None = None
) -> tuple:
    """Answer by a descent that must end, from admissible forces (m,) [N]: (Found, iterations).

    NotConverged when `limit` (20 m unless given) steps do not end it.
    """
    force = force.copy()
    active = force > 0
    limit = limit or 20 * force.size
    for count in range(1, limit + 1):
        active = supported(ask, active)
        found = on_set(operator, ask, active)
        falling = active & (found.force < 0)
        if falling.any():
            fall = np.where(falling, force - found.force, 1.0)
            ratio = np.where(falling, force / fall, np.inf)
            worst = int(np.argmin(ratio))
            force = np.maximum(force + ratio[worst] * (found.force - force), 0.0)
            force[worst] = 0.0
            active[worst] = False
            continue
        force = found.force
        over = np.where(active, np.inf, found.opening / found.scale)
        worst = int(np.argmin(over))
        if over[worst] >= -ROUND:
            return polished(operator, ask, active, found), count
        active[worst] = True
    raise NotConverged(
        "contact: the active-set iteration did not converge; refine contact.element_size or change the "
        "load"
    )
