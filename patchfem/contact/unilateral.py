"""Unilateral contact on the condensed interface by a primal-dual active set.

Find nodal forces f >= 0 with w = g + theta x - delta + C f >= 0 and f . w = 0, under a given approach delta, or a given
load sum f = N with the rotation held (already inside g), free under a moment, sum f x = M, or against the holder's
spring, sum f x = M + K theta. Every answer is checked again by `residuals`, which shares no intermediate result with
the solver.
"""

from types import MappingProxyType

import numpy as np
from threadpoolctl import threadpool_limits

from ..core import Compliance, NotConverged, Outcome, PatchfemError, Pressure, frozen_array

LIMIT = 1e-9  # largest relative residual that still counts as solved


def _bordered(c, gap, rigid, target, active, spring=0.0):
    """Forces and rigid motions r = (delta, -theta) on the active set: [C -R; R^T S] [f; r] = [-g; target], S the spring
    of the rotation. Without rigid motions the forces alone."""
    caa = c[np.ix_(active, active)]
    r = rigid[active]
    if r.shape[1] == 0:
        return -np.linalg.solve(caa, gap[active]), np.zeros(0)
    nearest = gap[active].min()  # taken out first: the closing may be far smaller than the gaps
    both = np.linalg.solve(caa, np.column_stack([gap[active] - nearest, r]))
    free, lift = both[:, 0], both[:, 1:]
    stiff = np.diag([0.0, spring][:r.shape[1]])
    motion = np.linalg.solve(r.T @ lift + stiff, target + r.T @ free)
    force = lift @ motion - free
    motion[0] += nearest
    return force, motion


def _hull_start(x, gap, target):
    """Active set of the rigid body resting on the gap: the touching nodes, widened to enough of them."""
    middle = min(max(target[1] / target[0], x[0]), x[-1]) if target.size > 1 else None
    lean = 0.0
    if middle is not None:
        slopes = np.linspace(-1, 1, 41) * 4 * (np.ptp(gap) + 1e-300) / np.ptp(x)
        rest = [np.min(gap + s * (x - middle)) for s in slopes]
        lean = slopes[int(np.argmax(rest))]
    height = gap + lean * x
    return height <= height.min() + 0.5 * (np.ptp(height) + 1e-300)


def solve_forces(c, x, gap, target, start=None, limit: int = 200, spring: float = 0.0) -> tuple:
    """Nodal forces, rigid motions (none, delta or delta, -theta) and iterations.

    c (m, m) [m/N], x (m,), gap (m,) [m], target () with the approach inside the gap, (N,) or (N, M); spring [N m/rad]
    of the rotation. `start`: active set of a neighbouring solve.
    NotConverged when both the active set and its finite fallback miss the complementarity.
    """
    rigid = np.ones((x.size, target.size))
    if target.size > 1:
        rigid[:, 1] = x
    active = start.copy() if start is not None else _hull_start(x, gap, target) if target.size else gap < 0
    seen = set()
    for count in range(1, limit + 1):
        if active.sum() < max(target.size, 1):
            active = np.ones(x.size, bool)
        key = active.tobytes()
        if key in seen:
            break
        seen.add(key)
        index = np.flatnonzero(active)
        force = np.zeros(x.size)
        force[index], motion = _bordered(c, gap, rigid, target, index, spring)
        opening = gap - rigid @ motion + c @ force
        scale = 1e-13 * (np.abs(c).max() * np.abs(force).sum() + np.ptp(gap))
        following = (active & (force > 0)) | (~active & (opening < -scale))
        if np.array_equal(following, active):
            return force, motion, count
        active = following
    force, motion = _one_at_a_time(c, x, gap, rigid, target, spring)
    return force, motion, limit


def _one_at_a_time(c, x, gap, rigid, target, spring=0.0):
    """Primal active-set method for the strictly convex program: feasible, energy falls at each step, finite."""
    force = _feasible(x, target)
    active = force > 0
    for _ in range(20 * x.size):
        index = np.flatnonzero(active)
        step = np.zeros(x.size)
        step[index], motion = _bordered(c, gap, rigid, target, index, spring)
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
    if target.size < 2:
        return np.full(x.size, (target[0] if target.size else 1e-300) / x.size)
    middle = min(max(target[1] / target[0], x[0]), x[-1])
    left, right = x <= middle, x >= middle
    force = np.zeros(x.size)
    a, b = x[left].mean(), x[right].mean()
    share = 1.0 if b == a else (middle - a) / (b - a)
    force[right] += target[0] * share / right.sum()
    force[left] += target[0] * (1 - share) / left.sum()
    return force


def residuals(c, x, gap, force, delta: float, theta: float, load: float, moment: float | None = None,
              spring: float = 0.0) -> MappingProxyType:
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
        out["moment_balance"] = abs(force @ x - moment - spring * theta) / (load * np.ptp(x) + abs(spring * theta))
    return MappingProxyType({key: float(value) for key, value in out.items()})


def press(pieces: Compliance, gap: np.ndarray, load: float, moment: float | None = None, rotation: float = 0.0,
          start: np.ndarray | None = None, spring: float = 0.0) -> Pressure:
    """Static pressure under `load` [N] (all pairs) on the gap (m,) [m].

    With `moment` [N m] of the load about the middle the upper piece is free to rotate, or held by the `spring`
    [N m/rad] of its holder from `rotation` [rad] on; without it `rotation` is held (and already in `gap`, so it is only
    reported). Zero load gives the outcome no_contact. PatchfemError for a moment that no pressure can carry, a load
    that is negative or a gap that is not finite, NotConverged when a residual exceeds 1e-9.
    """
    x = pieces.interface.x
    if not (np.isfinite(load) and load >= 0 and np.isfinite(gap).all()):
        raise PatchfemError(f"contact.load: the load ({load:.6g} N) must be >= 0 and the gap finite")
    if load == 0:
        return _apart(gap, float(gap.min()), rotation)
    if moment is not None and spring == 0 and not abs(moment) < load * np.ptp(x) / 2:
        raise PatchfemError(f"contact.load_line: the line of the load lies {moment / load:.6g} m from the middle, "
                            f"outside the half length {np.ptp(x) / 2:.6g} m: the piece tips over")
    target = np.array([load]) if moment is None else np.array([load, moment])
    try:
        with threadpool_limits(1, "blas"):
            force, motion, count = solve_forces(pieces.normal, x, gap, target, start, spring=spring)
    except np.linalg.LinAlgError:
        raise NotConverged("contact: the rotation is not determined by the contact set; raise the load or name "
                           "contact.holder.rotational_stiffness") from None
    theta = 0.0 if moment is None else -float(motion[1])
    return _checked(pieces, gap, force, float(motion[0]), theta, rotation, load, moment, spring, count)


def press_by(pieces: Compliance, gap: np.ndarray, approach: float, rotation: float = 0.0) -> Pressure:
    """Static pressure at a given `approach` [m] of the holders, the rotation held; no_contact where nothing touches."""
    if not (np.isfinite(approach) and np.isfinite(gap).all()):
        raise PatchfemError("contact.approach: the distance and the gap must be finite")
    if approach <= gap.min():
        return _apart(gap, approach, rotation)
    with threadpool_limits(1, "blas"):
        force, _, count = solve_forces(pieces.normal, pieces.interface.x, gap - approach, np.zeros(0))
    return _checked(pieces, gap, force, approach, 0.0, rotation, float(force.sum()), None, 0.0, count)


def _apart(gap, approach: float, rotation: float) -> Pressure:
    return Pressure(frozen_array(np.zeros(gap.size)), frozen_array(gap - approach), approach, rotation, 0.0, 0.0,
                    Outcome.NO_CONTACT, 0, MappingProxyType({}))


def _checked(pieces, gap, force, delta, theta, rotation, load, moment, spring, count) -> Pressure:
    x = pieces.interface.x
    checks = residuals(pieces.normal, x, gap, force, delta, theta, load, moment, spring)
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}")
    opening = np.maximum(gap + theta * x - delta + pieces.normal @ force, 0.0)
    opening[force > 0] = 0.0
    return Pressure(frozen_array(force / pieces.interface.weight), frozen_array(opening), delta, rotation + theta,
                    float(force.sum()), float(force @ x), Outcome.DONE, count, checks)
