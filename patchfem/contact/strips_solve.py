"""Solvers of strips under one holder: strips and holder together by Newton, or the holder alone along its dual.

Newton's method takes a step of all strips and of the holder's motion q together: an active set for bare strips and the
linear skin, the law's tangent for the smooth skins, strips eliminated one by one. Where that repeats itself or wanders,
q alone is led down the dual, its slope bracketed along each direction, with every strip solved under its own approach.
"""

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import PatchfemError
from .skin import solve as solve_skin
from .skin_laws import LinearSkin
from .unilateral import solve_forces


def smooth(skin) -> bool:
    """Whether a skin law carries something at every separation: False for None (bare) and for the linear skin."""
    return skin is not None and not isinstance(skin, LinearSkin)


def softer(skin, c, weight) -> np.ndarray:
    """Compliance (m, m) [m/N] with the linear skin in series, C + diag(1/(k A)); C itself under any other skin.

    So bare contact of it is contact through the linear skin. c: (m, m) [m/N]; weight: nodal areas A (m,) [m2].
    """
    return c + np.diag(1 / (skin.k * weight)) if isinstance(skin, LinearSkin) else c


def holder_motions(x, size: int, spring: float) -> tuple:
    """Rigid motions (m, r) of size 1 at the ends, their spring (r, r), and the factors that turn q into (delta,
    -theta)."""
    half = np.abs(x).max() or 1.0
    rigid = np.column_stack([np.ones(x.size), x / half])[:, :size]
    return rigid, np.diag([0.0, spring / half**2])[:size, :size], np.array([1.0, half])[:size]


def bare_parts(c, rigid, active, gap=None) -> tuple:
    """Answers of bare strips to rigid motions, one entry per group of strips with the same active set, and their
    tangent.

    Entries: (strips, nodes, C^-1 R, C^-1 g); tangent (r, r) of sum R^T f.
    """
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


def skin_parts(c, rigid, slope, missing) -> tuple:
    """Answers of strips with a skin to rigid motions, one entry per strip, and their tangent (r, r) of sum R^T f.

    Entries: (strip, nodes, root D, (I + root D C root D)^-1 root D (R, missing)) with D = slope. Nodes of next to no
    slope follow the geometry.
    """
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
    parts, system = bare_parts(c, rigid, active, gap - nearest)
    side = target + sum(rigid[nodes].T @ free.sum(axis=1) for _, nodes, _, free in parts)
    motion = np.linalg.solve(system + spring, side)
    for strips, nodes, lift, free in parts:
        force[np.ix_(strips, nodes)] = lift @ motion - free.T
    rest = np.linalg.solve(system + spring, target - rigid.T @ force.sum(axis=0) - spring @ motion)
    for strips, nodes, lift, _ in parts:  # round-off of a rotation that closes far less than it turns
        force[np.ix_(strips, nodes)] += lift @ rest
    return force, motion + rest + nearest * np.eye(1, target.size)[0]


def _active_set(c, gap, rigid, target, spring, active, limit: int = 60) -> tuple | None:
    """Primal-dual active set of bare strips: forces, motion and steps; None where it does not settle."""
    seen, bend, least = set(), np.abs(c).max(), 1 if spring.any() else target.size
    span = 1e-13 * np.ptp(gap, axis=1, keepdims=True) + 1e-15 * np.ptp(gap)  # round-off of an opening
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
    parts, system = skin_parts(c, rigid, slope, missing)
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


def by_strip(skin, c, x, weight, gap) -> tuple:
    """Every strip solved by itself: forces (s, m) [N], where they give way, and steps.

    gap: (s, m) [m] with all motion in it. Second: of a smooth skin the slope -A P' (s, m) [N/m], else which nodes carry
    (s, m) bool. PatchfemError and NotConverged as in `skin.solve` and `unilateral.solve_forces`.
    """
    force, steps = np.zeros(gap.shape), 0
    if smooth(skin):
        states = [solve_skin(skin, c, x, weight, row, approach=0.0) for row in gap]
        force, slope = (np.array([getattr(state, name) for state in states]) for name in ("force", "stiffness"))
        return force, slope * weight, sum(state.iterations for state in states)
    for strip in np.flatnonzero(gap.min(axis=1) < 0):
        force[strip], _, count = solve_forces(c, x, gap[strip], np.zeros(0))
        steps += count
    return force, force > 0, steps


def _downhill(skin, c, x, weight, gap, rigid, target, spring, sink: float, span: float) -> tuple:
    """Descent of the dual: forces (s, m), motion q at its bottom, and steps, from `sink` [m] beyond the nearest node.
   """
    q, soft = np.zeros(target.size), 1e-9 * target[0] / span * np.eye(target.size)
    q[0] = gap.min() + sink

    def at(q) -> tuple:
        try:
            force, slope, steps = by_strip(skin, c, x, weight, gap - rigid @ q)
        except PatchfemError:  # deeper than any number
            return None, None, None, 0
        return force, slope, target - rigid.T @ force.sum(axis=0) - spring @ q, steps

    (force, slope, lack, total), record = at(q), np.inf
    for _ in range(60):
        if force is None or (size := np.abs(lack).max()) <= 1e-12 * target[0]:
            break
        record = min(record, size)
        system = (skin_parts(c, rigid, slope, slope) if smooth(skin) else bare_parts(c, rigid, slope))[1]
        way = np.linalg.solve(system + spring + soft, lack)
        low, high, length, best = 0.0, np.inf, 1.0, None
        for _ in range(60):
            *trial, steps = at(q + length * way)
            total += steps
            push = -np.inf if trial[0] is None else trial[2] @ way  # > 0: further
            # a trial beyond the bottom counts as well where it halves the least lack so far
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


def _first_set(x, gap, target) -> np.ndarray:
    """Nodes (m,) of the rigid body resting on the gap (m,) at x (m,), widened to half of its height."""
    lean = 0.0
    if target.size > 1:
        middle = min(max(target[1] / target[0], x.min()), x.max())
        slopes = np.linspace(-1, 1, 41) * 4 * (np.ptp(gap) + 1e-300) / np.ptp(x)
        lean = slopes[int(np.argmax([np.min(gap + slope * (x - middle)) for slope in slopes]))]
    height = gap + lean * x
    return height <= height.min() + 0.5 * (np.ptp(height) + 1e-300)


def _bare_loaded(c, x, gap, rigid, target, spring, active=None) -> tuple:
    """Forces, motion q, steps of bare strips under a load (and moment), by the active set or down the dual."""
    if active is None:
        place = np.broadcast_to(rigid[:, -1], gap.shape)
        active = _first_set(place.ravel(), gap.ravel(), target).reshape(gap.shape)
    if (found := _active_set(c, gap, rigid, target, spring, active)) is not None:
        return found
    depth = np.abs(c).max() * target[0]
    force, q, steps = _downhill(None, c, x, None, gap, rigid, target, spring, depth / len(gap), np.ptp(gap) + depth)
    force, q, more = _active_set(c, gap, rigid, target, spring, force > 0) or (force, q, 0)
    return force, q, steps + more


def _linearised(skin, c, x, weight, gap, rigid, target, spring) -> tuple:
    """First separations and motion: the law's tangent at the mean pressure, solved as a linear skin."""
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


def loaded(skin, c, x, weight, gap, target, spring, start, rotation) -> tuple:
    """Forces, separations, motion (delta or delta, -theta) and steps of strips under a load, and a moment where one is
    given.

    Separations are None but for a smooth skin.
    """
    rigid, spring, scale = holder_motions(x, target.size, spring)
    target = target / scale
    if not smooth(skin):
        active = None if start is None else start.force > 0
        force, q, count = _bare_loaded(softer(skin, c, weight), x, gap, rigid, target, spring, active)
        return force, None, q / scale, count
    first = _linearised(skin, c, x, weight, gap, rigid, target, spring) if start is None else \
        (start.gap, np.array([start.delta, rotation - start.theta])[:target.size] * scale)
    force, s, q, count = _smooth_loaded(skin, c, x, weight, gap, rigid, target, spring, first)
    return force, s, q / scale, count
