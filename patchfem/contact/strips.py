"""Strips side by side over the width: the condensed operator of a slice, repeated under one rigid holder that may roll.

Strip j, at y_j from the middle, has the gap g(x) + roll y_j (or one of its own) and the compliance C; strips do not
feel each other: the shear between them is neglected. The holder's motion q = (delta, -theta) is common, so the answer
minimises the convex dual sum_j Phi_j(R q - g_j) + q.S q/2 - q.target, R = (1, x), S the spring of the rotation. Newton
takes a step of all strips and of q at once: an active set for bare strips and the linear skin, the law's tangent for
the smooth skins, strips eliminated one by one. Where that repeats itself or wanders, q alone is led down the dual, its
slope bracketed along each direction, with every strip solved under its own approach. Every answer is checked again by
`residuals` from the definitions alone.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from threadpoolctl import threadpool_limits

from ..core import Compliance, NotConverged, Outcome, PatchfemError, frozen_array
from .skin import _refuse
from .skin import solve as solve_skin
from .skin_laws import ExponentialSkin, LinearSkin
from .unilateral import LIMIT, _hull_start, solve_forces

NEGLECTED = "the strips over the width do not feel each other: the shear between them is neglected"


@dataclass(frozen=True, eq=False, slots=True)
class StripsState:
    """Strips pressed by one holder; s strips of m nodes, forces of all pairs together.

    force (s, m) [N] >= 0; pressure (s, m) [Pa]; gap (s, m) [m] left open, with a skin the separation of its mean planes
    (< 0: crushed); stiffness (s, m) [Pa/m] of the skin, None without one; offsets y (s,) [m]. delta [m] and theta [rad]
    of the holder; load [N], moment sum f x and roll_moment sum f y [N m]; centre_x, centre_y [m] of the pressure;
    fraction: share of the area that carries. `residuals` from the independent check, relative.
    """

    force: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    stiffness: np.ndarray | None
    offsets: np.ndarray
    delta: float
    theta: float
    load: float
    moment: float
    roll_moment: float
    centre_x: float
    centre_y: float
    fraction: float
    outcome: Outcome
    iterations: int
    residuals: MappingProxyType

    def yaw_moment(self, friction: float) -> float:
        """Moment mu sum f y [N m] about +z of friction on the upper piece while all of it slides towards +x."""
        return friction * self.roll_moment


def strip_offsets(width: float, count: int) -> np.ndarray:
    """Centres y (count,) [m] of equal strips over `width` [m] of one pair, 0 in the middle."""
    if not (count >= 1 and width > 0):
        raise PatchfemError(f"contact.strips.count: {count} strips over {width:.6g} m; at least one is wanted")
    return (np.arange(count) + 0.5) * (width / count) - width / 2


def one_strip(pieces: Compliance, count: int) -> tuple:
    """(normal, tangential, weight) of one of `count` equal strips: compliances (m, m) [m/N], nodal areas (m,) [m2]."""
    return pieces.normal * count, pieces.tangential * count, pieces.interface.weight / count


def _smooth(skin) -> bool:
    return skin is not None and not isinstance(skin, LinearSkin)


def _softer(skin, c, weight) -> np.ndarray:
    """C with the linear skin in series: bare contact of these is contact through the skin."""
    return c + np.diag(1 / (skin.k * weight)) if isinstance(skin, LinearSkin) else c


def _holder(x, size: int, spring: float) -> tuple:
    """Rigid motions (m, r) of size 1 at the ends, their spring (r, r), and what turns q into (delta, -theta)."""
    half = np.abs(x).max() or 1.0
    rigid = np.column_stack([np.ones(x.size), x / half])[:, :size]
    return rigid, np.diag([0.0, spring / half**2])[:size, :size], np.array([1.0, half])[:size]


def _bare_parts(c, rigid, active, gap=None) -> tuple:
    """Per group of strips with one active set (strips, nodes, C^-1 R, C^-1 g), and the tangent (r, r) of sum R^T f."""
    groups, parts, system = {}, [], np.zeros((rigid.shape[1], rigid.shape[1]))
    for strip, row in enumerate(active):
        if row.any():
            groups.setdefault(row.tobytes(), []).append(strip)
    for strips in map(np.array, groups.values()):
        nodes = np.flatnonzero(active[strips[0]])
        sides = rigid[nodes] if gap is None else np.column_stack([rigid[nodes], gap[np.ix_(strips, nodes)].T])
        answer = cho_solve(cho_factor(c[np.ix_(nodes, nodes)], lower=True, overwrite_a=True), sides)
        parts.append((strips, nodes, *np.split(answer, [rigid.shape[1]], axis=1)))
        system += strips.size * rigid[nodes].T @ parts[-1][2]
    return parts, system


def _skin_parts(c, rigid, slope, missing) -> tuple:
    """Per strip (strip, nodes, root D, (I + root D C root D)^-1 root D (R, missing)), D = slope, and the tangent (r, r)
    of sum R^T f; nodes of next to no slope follow the geometry."""
    least, size = 1e-18 * slope.max(), rigid.shape[1]
    parts, system = [], np.zeros((size, size))
    for strip, row in enumerate(slope):
        if not (nodes := np.flatnonzero(row > least)).size:
            continue
        root = np.sqrt(row[nodes])
        own = root[:, None] * c[np.ix_(nodes, nodes)] * root
        own[np.diag_indices_from(own)] += 1.0
        sides = root[:, None] * np.column_stack([rigid[nodes], missing[strip, nodes]])
        answer = cho_solve(cho_factor(own, lower=True, overwrite_a=True), sides)
        parts.append((strip, nodes, root, answer))
        system += sides[:, :size].T @ answer[:, :size]
    return parts, system


def _bordered(c, gap, rigid, target, spring, active) -> tuple:
    """Forces (s, m) and motion q (r,) that close the active nodes: C f_j = R q - g_j, R^T sum f_j + S q = target."""
    force, nearest = np.zeros(gap.shape), gap[active].min()  # taken out first: the closing may be far smaller
    parts, system = _bare_parts(c, rigid, active, gap - nearest)
    side = target + sum(rigid[nodes].T @ free.sum(axis=1) for _, nodes, _, free in parts)
    motion = np.linalg.solve(system + spring, side)
    for strips, nodes, lift, free in parts:
        force[np.ix_(strips, nodes)] = lift @ motion - free.T
    rest = np.linalg.solve(system + spring, target - rigid.T @ force.sum(axis=0) - spring @ motion)
    for strips, nodes, lift, _ in parts:  # round-off of a rotation that closes far less than it turns
        force[np.ix_(strips, nodes)] += lift @ rest
    return force, motion + rest + nearest * np.eye(1, target.size)[0]


def _active_set(c, gap, rigid, target, spring, active, limit: int = 60) -> tuple | None:
    """Forces, motion, steps of bare strips by the primal-dual active set; None where it does not settle."""
    seen, bend, least = set(), np.abs(c).max(), 1 if spring.any() else target.size
    span = 1e-13 * np.ptp(gap, axis=1, keepdims=True) + 1e-15 * np.ptp(gap)
    for count in range(1, limit + 1):
        if active.sum() < least:
            active = np.ones(gap.shape, bool)
        if (key := active.tobytes()) in seen:
            return None
        seen.add(key)
        try:
            force, motion = _bordered(c, gap, rigid, target, spring, active)
        except np.linalg.LinAlgError:  # this set does not determine the rotation
            return None
        opening = gap - rigid @ motion + force @ c
        noise = span + 1e-13 * bend * np.abs(force).sum(axis=1, keepdims=True)
        following = (active & (force > 0)) | (~active & (opening < -noise))
        if np.array_equal(following, active):
            return force, motion, count
        active = following
    return None


def _tangent_step(c, rigid, target, spring, slope, missing, lack) -> tuple:
    """Newton step (df, dq, ds) of f = A P(s), s = missing + s + C f - R q, sum R^T f short by `lack`, slope -A P'."""
    parts, system = _skin_parts(c, rigid, slope, missing)
    gain, size = np.zeros(slope.shape), target.size
    side = lack + sum((root[:, None] * rigid[nodes]).T @ answer[:, size] for _, nodes, root, answer in parts)
    motion = np.linalg.lstsq(system + spring, side, rcond=1e-14)[0]
    for strip, nodes, root, answer in parts:
        gain[strip, nodes] = root * (answer[:, :size] @ motion - answer[:, size])
    return gain, motion, missing - rigid @ motion + gain @ c


def _newton(skin, c, weight, gap, rigid, target, spring, s, q, limit: int = 60) -> tuple | None:
    """Forces, separations, motion, steps of a smooth skin from (s, q) by the steps of `skin`; None: not settled."""
    mean = target[0] / (weight.sum() * len(gap))
    faint = skin.separation(np.array(0.01 * mean))
    for count in range(1, limit + 1):
        log, fall = skin.log_pressure(s)
        log = log + np.log(weight)
        force = np.exp(np.minimum(log, 600.0))
        lack = target - rigid.T @ force.sum(axis=0) - spring @ q
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                gain, motion, change = _tangent_step(c, rigid, target, spring, force * fall,
                                                     gap - rigid @ q + force @ c - s, lack)
            except (np.linalg.LinAlgError, ValueError):  # left the numbers
                return None
        q, folds = q + motion, -change * fall
        share = np.exp(np.minimum(0.0, np.maximum(log, log + folds) - log.max()))
        depth = np.ptp(gap) + np.abs(force @ c).max() + 2 * np.abs(q[1:]).max(initial=0.0)
        noise = 1e-12 + 1e-15 * depth * fall[force > 1e-6 * force.max()].max()
        if max(np.abs(lack).max() / target[0], np.max(share * np.abs(folds))) <= noise:
            follow = np.exp(np.minimum(log + folds, 600.0))  # what carries next to nothing takes its law
            return np.where(share < 1e-15, follow, np.maximum(force + gain, 0.0)), s + change, q, count
        careful = np.where(folds > 0, -np.log1p(np.maximum(folds, 0.0)) / fall, change)
        s = s + np.maximum(change, np.minimum(careful, faint - s))
    return None


def _by_strip(skin, c, x, weight, gap) -> tuple:
    """Forces (s, m), the slope -A P' (s, m) of a smooth skin or which nodes carry, steps; all motion is in the gap."""
    force, steps = np.zeros(gap.shape), 0
    if _smooth(skin):
        states = [solve_skin(skin, c, x, weight, row, approach=0.0) for row in gap]
        force, slope = (np.array([getattr(state, name) for state in states]) for name in ("force", "stiffness"))
        return force, slope * weight, sum(state.iterations for state in states)
    for strip in np.flatnonzero(gap.min(axis=1) < 0):
        force[strip], _, count = solve_forces(c, x, gap[strip], np.zeros(0))
        steps += count
    return force, force > 0, steps


def _downhill(skin, c, x, weight, gap, rigid, target, spring, sink: float, span: float) -> tuple:
    """Forces (s, m), motion q at the bottom of the dual, and steps, from `sink` [m] beyond the nearest node.

    Newton directions, stiffened by 1e-9 of the load over `span` [m]. Along each the slope of the dual rises, so the
    step is bracketed and taken where the slope is halved at least and not yet > 0: the dual falls each time; or at once
    where what is lacking halves its record.
    """
    q, soft = np.zeros(target.size), 1e-9 * target[0] / span * np.eye(target.size)
    q[0] = gap.min() + sink

    def at(q) -> tuple:
        try:
            force, slope, steps = _by_strip(skin, c, x, weight, gap - rigid @ q)
        except PatchfemError:  # deeper than any number
            return None, None, None, 0
        return force, slope, target - rigid.T @ force.sum(axis=0) - spring @ q, steps

    (force, slope, lack, total), record = at(q), np.inf
    for _ in range(60):
        if force is None or (size := np.abs(lack).max()) <= 1e-12 * target[0]:
            break
        record = min(record, size)
        system = (_skin_parts(c, rigid, slope, slope) if _smooth(skin) else _bare_parts(c, rigid, slope))[1]
        way = np.linalg.solve(system + spring + soft, lack)
        low, high, length, best = 0.0, np.inf, 1.0, None
        for _ in range(60):
            *trial, steps = at(q + length * way)
            total += steps
            push = -np.inf if trial[0] is None else trial[2] @ way  # > 0: further
            halved = trial[0] is not None and np.abs(trial[2]).max() <= 0.5 * record
            if push >= 0 or halved:
                best, low = (*trial, q + length * way), length
                if halved or push <= 0.5 * (lack @ way):
                    break
            else:
                high = length
            length = 2 * low if high == np.inf else (low + high) / 2
        if best is None:  # round-off
            break
        force, slope, lack, q = best
    return np.zeros(gap.shape) if force is None else force, q, total


def _bare_loaded(c, x, gap, rigid, target, spring, active=None) -> tuple:
    """Forces, motion q, steps of bare strips under a load (and moment), by the active set or down the dual."""
    if active is None:
        place = np.broadcast_to(rigid[:, -1], gap.shape)
        active = _hull_start(place.ravel(), gap.ravel(), target).reshape(gap.shape)
    if (found := _active_set(c, gap, rigid, target, spring, active)) is not None:
        return found
    depth = np.abs(c).max() * target[0]
    force, q, steps = _downhill(None, c, x, None, gap, rigid, target, spring, depth / len(gap), np.ptp(gap) + depth)
    force, q, more = _active_set(c, gap, rigid, target, spring, force > 0) or (force, q, 0)
    return force, q, steps + more


def _linearised(skin, c, x, weight, gap, rigid, target, spring) -> tuple:
    """Separations and motion of the law's tangent at the mean pressure, taken as a linear skin."""
    mean = target[0] / (weight.sum() * len(gap))
    rest = skin.separation(np.array([mean]))
    k = mean * skin.log_pressure(rest)[1][0]
    edge = rest[0] + mean / k  # where the tangent is zero
    force, q, _ = _bare_loaded(c + np.diag(1 / (k * weight)), x, gap - edge, rigid, target, spring)
    stress = force / weight
    low = np.where(force > 0, edge - stress / k, gap - rigid @ q + force @ c)
    return np.where(stress > mean, skin.separation(np.maximum(stress, mean)), low), q


def _smooth_loaded(skin, c, x, weight, gap, rigid, target, spring, first) -> tuple:
    """Forces, separations, motion q, steps of a smooth skin from `first` = (s, q), by Newton or down the dual."""
    if (found := _newton(skin, c, weight, gap, rigid, target, spring, *first)) is not None:
        return found
    rest = skin.separation(np.array([target[0] / (weight.sum() * len(gap))]))
    span = 1 / skin.log_pressure(rest)[1][0]
    force, q, steps = _downhill(skin, c, x, weight, gap, rigid, target, spring, -rest[0], span)
    s = gap - rigid @ q + force @ c
    force, s, q, more = _newton(skin, c, weight, gap, rigid, target, spring, s, q) or (force, s, q, 0)
    return force, s, q, steps + more


def _loaded(skin, c, x, weight, gap, target, spring, start, rotation) -> tuple:
    """Forces, separations (None but for a smooth skin), motion (delta or delta, -theta), steps."""
    rigid, spring, scale = _holder(x, target.size, spring)
    target = target / scale
    if not _smooth(skin):
        active = None if start is None else start.force > 0
        force, q, count = _bare_loaded(_softer(skin, c, weight), x, gap, rigid, target, spring, active)
        return force, None, q / scale, count
    first = _linearised(skin, c, x, weight, gap, rigid, target, spring) if start is None else \
        (start.gap, np.array([start.delta, rotation - start.theta])[:target.size] * scale)
    force, s, q, count = _smooth_loaded(skin, c, x, weight, gap, rigid, target, spring, first)
    return force, s, q / scale, count


def residuals(skin, c, x, weight, gap, force, delta: float, free: float, load=None, moment=None,
              spring: float = 0.0) -> MappingProxyType:
    """Relative residuals of pressed strips, recomputed from the definitions alone; `free` rotation beyond the gap's.

    The worst strip's penetration, tension and complementarity (bare) or law and tension (skin); force_balance and
    moment_balance of them all, where prescribed.
    """
    bent = force @ c
    opening = gap + free * x - delta + bent
    depth = np.ptp(gap, axis=1) + np.abs(bent).max() + abs(free) * np.ptp(x) + 1e-150
    most, total = max(force.max(), 1e-150), max(force.sum(), 1e-150)
    out = {"tension": max(0.0, -force.min()) / most}
    if skin is None:
        out["penetration"] = np.max(np.maximum(0.0, -opening.min(axis=1)) / depth)
        out["complementarity"] = np.max(np.abs(force * opening).sum(axis=1) / (total * depth))
    else:
        rate = np.full(gap.shape, skin.k) if isinstance(skin, LinearSkin) else 1e-5 * skin.stiffness(opening)
        gain = depth * (weight * rate).max(axis=1)
        out["law"] = np.max(np.abs(force - weight * skin.pressure(opening)).max(axis=1) / (most + gain))
    if load is not None:
        out["force_balance"] = abs(force.sum() - load) / load
    if moment is not None:
        turned = spring * free
        out["moment_balance"] = abs((force @ x).sum() - moment - turned) / (load * np.ptp(x) + abs(turned))
    return MappingProxyType({key: float(value) for key, value in out.items()})


def press_strips(c: np.ndarray, x: np.ndarray, weight: np.ndarray, offsets: np.ndarray, gap: np.ndarray,
                 roll: float = 0.0, load: float | None = None, moment: float | None = None,
                 approach: float | None = None, rotation: float = 0.0, spring: float = 0.0, skin=None,
                 start: StripsState | None = None) -> StripsState:
    """Strips of closing compliance c (m, m) [m/N] each (`one_strip`), pressed by one holder with a prescribed roll.

    x (m,) [m], nodal areas of one strip weight (m,) [m2], offsets y (s,) [m] (`strip_offsets`), gap (m,) or (s, m) [m],
    roll [rad] > 0 opens the gap at +y. Controls: `load` [N] of all strips with `rotation` [rad] held (already in the
    gap, only reported); `load` and `moment` sum f x [N m] with the rotation free, or held by the holder's `spring`
    [N m/rad] from `rotation` on; `approach` [m] with the rotation held. skin: None (bare), or a law of `skin`; with
    rigid bodies (c = 0) only a skin. start: a neighbouring answer. Nothing touching: outcome no_contact.
    PatchfemError for other controls, a moment that no pressure carries, an exponential law without reference under an
    approach; NotConverged above a residual of 1e-9.
    """
    offsets = np.atleast_1d(np.asarray(offsets, float))
    gap = np.broadcast_to(gap, (offsets.size, x.size)) + roll * offsets[:, None]
    _refuse(skin, x, gap, load, None if spring and load is not None else moment, approach)
    if isinstance(skin, ExponentialSkin) and skin.reference is None and load:
        skin = replace(skin, reference=load / (weight.sum() * offsets.size))
    if load == 0:
        return _state(skin, weight, x, offsets, np.zeros(gap.shape), gap - gap.min(), gap.min(), rotation, 0, {})
    with threadpool_limits(1, "blas"):
        if load is None:
            force, _, count = _by_strip(skin, _softer(skin, c, weight), x, weight, gap - approach)
            s, motion = None, np.array([approach])
        else:
            target = np.array([value for value in (load, moment) if value is not None])
            force, s, motion, count = _loaded(skin, c, x, weight, gap, target, spring, start, rotation)
    delta, free = float(motion[0]), -float(motion[1]) if motion.size > 1 else 0.0
    checks = residuals(skin, c, x, weight, gap, force, delta, free, load, moment, spring)
    bearing = (force > 1e-12 * force.max()).any(axis=0).sum()
    if motion.size > 1 and spring == 0 and not _smooth(skin) and bearing < 2:
        raise NotConverged("contact.strips: the contact set does not determine the rotation; raise the load or name "
                           "contact.holder.rotational_stiffness")
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact.strips: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}; lower contact.strips."
                           "roll or raise the load")
    opening = gap + free * x - delta + force @ c if s is None else s
    if skin is None:
        opening = np.where(force > 0, 0.0, np.maximum(opening, 0.0))
    elif isinstance(skin, LinearSkin):
        opening = np.where(force > 0, -force / (skin.k * weight), np.maximum(opening, 0.0))
    return _state(skin, weight, x, offsets, force, opening, delta, rotation + free, count, checks)


def _state(skin, weight, x, offsets, force, opening, delta, theta, count, checks) -> StripsState:
    load, moment, roll_moment = float(force.sum()), float((force @ x).sum()), float(force.sum(axis=1) @ offsets)
    touch = load > 0
    stiffness = None if skin is None else frozen_array(skin.stiffness(opening) * (force > 0) if touch else force)
    share = float(((force > 0) * weight).sum() / (weight.sum() * offsets.size))
    centre = (moment / load, roll_moment / load) if touch else (0.0, 0.0)
    return StripsState(frozen_array(force), frozen_array(force / weight), frozen_array(opening), stiffness,
                       frozen_array(offsets), float(delta), float(theta), load, moment, roll_moment, *centre, share,
                       Outcome.DONE if touch else Outcome.NO_CONTACT, count, MappingProxyType(dict(checks)))


def strips_tangent(c: np.ndarray, weight: np.ndarray, state: StripsState, ratio: float = 1.0) -> float:
    """Stiffness [N/m] of all strips for one common rigid motion, skin and pieces in series.

    c (m, m) [m/N] and weight (m,) [m2] of one strip. With the normal compliance dN/d(approach) at fixed rotation and
    roll; with the tangential one dT/d(slide) in stick without yaw, `ratio` = k_t/k_n of the skin, inf: rigid in shear.
    """
    if not state.load:
        return 0.0
    rigid = np.ones((weight.size, 1))
    with threadpool_limits(1, "blas"):
        if state.stiffness is None or np.isinf(ratio):
            return float(_bare_parts(c, rigid, state.force > 0)[1][0, 0])
        slope = ratio * weight * state.stiffness
        return float(_skin_parts(c, rigid, slope, slope)[1][0, 0])
