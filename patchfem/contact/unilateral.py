"""Unilateral contact on the condensed interface by a primal-dual active set.

Find nodal forces f >= 0 with w = g + theta x - delta + C f >= 0 and f . w = 0, under a given load sum f = N and either
a given rotation (already inside g) or a given moment sum f x = M with theta free. Every answer is checked again by
`residuals`, which shares no intermediate result with the solver.
"""

from types import MappingProxyType

import numpy as np
from threadpoolctl import threadpool_limits

from ..core import Compliance, NotConverged, Outcome, PatchfemError, Pressure, frozen_array

LIMIT = 1e-9  # largest relative residual that still counts as solved


def _bordered(c, gap, rigid, target, active):
    """Forces and rigid motions on the active set: [C -R; R^T 0] [f; r] = [-g; target]."""
    caa = c[np.ix_(active, active)]
    r = rigid[active]
    nearest = gap[active].min()  # taken out first: the closing may be far smaller than the gaps
    both = np.linalg.solve(caa, np.column_stack([gap[active] - nearest, r]))
    free, lift = both[:, 0], both[:, 1:]
    motion = np.linalg.solve(r.T @ lift, target + r.T @ free)
    force = lift @ motion - free
    motion[0] += nearest
    return force, motion


def _hull_start(x, gap, target):
    """Active set of the rigid body resting on the gap: the touching nodes, widened to enough of them."""
    middle = target[1] / target[0] if target.size > 1 else None
    lean = 0.0
    if middle is not None:
        slopes = np.linspace(-1, 1, 41) * 4 * (np.ptp(gap) + 1e-300) / np.ptp(x)
        rest = [np.min(gap + s * (x - middle)) for s in slopes]
        lean = slopes[int(np.argmax(rest))]
    height = gap + lean * x
    return height <= height.min() + 0.5 * (np.ptp(height) + 1e-300)


def solve_forces(c, x, gap, target, start=None, limit: int = 200) -> tuple:
    """Nodal forces, rigid motions (delta or delta, -theta) and iterations.

    c (m, m) [m/N], x (m,), gap (m,) [m], target (N,) or (N, N e). `start`: active set of a neighbouring solve.
    NotConverged when both the active set and its finite fallback miss the complementarity.
    """
    rigid = np.ones((x.size, target.size))
    if target.size > 1:
        rigid[:, 1] = x
    active = _hull_start(x, gap, target) if start is None else start.copy()
    seen = set()
    for count in range(1, limit + 1):
        if active.sum() < target.size:
            active = np.ones(x.size, bool)
        key = active.tobytes()
        if key in seen:
            break
        seen.add(key)
        index = np.flatnonzero(active)
        force = np.zeros(x.size)
        force[index], motion = _bordered(c, gap, rigid, target, index)
        opening = gap - rigid @ motion + c @ force
        scale = 1e-13 * (np.abs(c).max() * target[0] + np.ptp(gap))
        following = (active & (force > 0)) | (~active & (opening < -scale))
        if np.array_equal(following, active):
            return force, motion, count
        active = following
    force, motion = _one_at_a_time(c, x, gap, rigid, target)
    return force, motion, limit


def _one_at_a_time(c, x, gap, rigid, target):
    """Primal active-set method for the strictly convex program: feasible, energy falls at each step, finite."""
    force = _feasible(x, target)
    active = force > 0
    for _ in range(20 * x.size):
        index = np.flatnonzero(active)
        step = np.zeros(x.size)
        step[index], motion = _bordered(c, gap, rigid, target, index)
        move = step - force
        falling = active & (step < 0)
        if falling.any():
            ratio = np.where(falling, force / np.where(falling, force - step, 1.0), np.inf)
            worst = int(np.argmin(ratio))
            force = np.maximum(force + ratio[worst] * move, 0.0)
            force[worst] = 0.0
            active[worst] = False
            continue
        force = step
        opening = gap - rigid @ motion + c @ force
        worst = int(np.argmin(np.where(active, np.inf, opening)))
        if active.all() or opening[worst] >= -1e-12 * (np.ptp(gap) + np.abs(c @ force).max()):
            return force, motion
        active[worst] = True
    raise NotConverged("contact: the active set did not settle; refine contact.element_size or change the load")


def _feasible(x, target):
    """A positive load distribution with the wanted resultant and moment."""
    if target.size == 1:
        return np.full(x.size, target[0] / x.size)
    middle = target[1] / target[0]
    left, right = x <= middle, x >= middle
    force = np.zeros(x.size)
    a, b = x[left].mean(), x[right].mean()
    share = 1.0 if b == a else (middle - a) / (b - a)
    force[right] += target[0] * share / right.sum()
    force[left] += target[0] * (1 - share) / left.sum()
    return force


def residuals(c, x, gap, force, delta: float, theta: float, load: float, moment: float | None) -> MappingProxyType:
    """Relative residuals of a contact answer, recomputed from its definition alone.

    Keys: force_balance, moment_balance, penetration, tension, complementarity.
    """
    opening = gap + theta * x - delta + c @ force
    depth = np.abs(c @ force).max() + np.ptp(gap)
    out = {"force_balance": abs(force.sum() - load) / load,
           "penetration": max(0.0, -opening.min()) / depth,
           "tension": max(0.0, -force.min()) / load,
           "complementarity": np.abs(force * opening).sum() / (load * depth)}
    if moment is not None:
        out["moment_balance"] = abs(force @ x - moment) / (load * np.ptp(x))
    return MappingProxyType({key: float(value) for key, value in out.items()})


def press(pieces: Compliance, gap: np.ndarray, load: float, moment: float | None = None, rotation: float = 0.0,
          start: np.ndarray | None = None) -> Pressure:
    """Static pressure under `load` [N] (all pairs) on the gap (m,) [m].

    With `moment` [N m] the upper piece is free to rotate; without it `rotation` [rad] is held (and already in `gap`,
    so it is only reported). Zero load gives the outcome no_contact. PatchfemError for a moment that no pressure can
    carry, a load that is negative or a gap that is not finite, NotConverged when a residual exceeds 1e-9.
    """
    x, weight = pieces.interface.x, pieces.interface.weight
    if not (np.isfinite(load) and load >= 0 and np.isfinite(gap).all()):
        raise PatchfemError(f"contact.load: the load ({load:.6g} N) must be >= 0 and the gap finite")
    if load == 0:
        first = float(gap.min())
        return Pressure(frozen_array(np.zeros(x.size)), frozen_array(gap - first), first, rotation, 0.0, 0.0,
                        Outcome.NO_CONTACT, 0, MappingProxyType({}))
    if moment is not None and not abs(moment) < load * np.ptp(x) / 2:
        raise PatchfemError(f"contact.load_line: the line of the load lies {moment / load:.6g} m from the middle, "
                            f"outside the half length {np.ptp(x) / 2:.6g} m: the piece tips over")
    target = np.array([load]) if moment is None else np.array([load, moment])
    with threadpool_limits(1, "blas"):
        force, motion, count = solve_forces(pieces.normal, x, gap, target, start)
    theta = 0.0 if moment is None else -float(motion[1])
    checks = residuals(pieces.normal, x, gap, force, float(motion[0]), theta, load, moment)
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}")
    opening = np.maximum(gap + theta * x - float(motion[0]) + pieces.normal @ force, 0.0)
    opening[force > 0] = 0.0
    return Pressure(frozen_array(force / weight), frozen_array(opening), float(motion[0]), rotation + theta,
                    float(force.sum()), float(force @ x), Outcome.DONE, count, checks)
