"""Solvers of strips under one holder, of which a patch is one: strips and holder together by Newton, or the holder
alone along its dual.

Newton's method takes a step of all strips and of the holder's motion q together, strips eliminated one by one: an
active set for bare strips and the linear skin; for the smooth skins Newton on (s, q) in the symmetric form
I + D^1/2 C D^1/2, D = -A P'. A node that gains force moves along log P, one that loses force along s, and one with a
negligible force may rise at once to 1 % of the mean pressure: of P's tangent each step keeps the side that cannot
overshoot. Where that repeats itself or wanders, q alone is led down the dual, its slope bracketed along each direction,
with every strip solved under its own approach.
"""

from dataclasses import dataclass, field, replace

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import NotConverged, PatchfemError
from .skin_laws import LinearSkin
from .unilateral import solve_forces

STEPS = 60  # of Newton's method, before the dual is gone down
FLOOR = -300.0  # log pressure below which an approach does not reach the skin
# bytes of the factors that pressings share, about, as contact sets are of unlike size
FACTORS = 1e8


def smooth(skin) -> bool:
    """Whether a skin law carries something at every separation: False for None (bare) and for the linear skin."""
    return skin is not None and not isinstance(skin, LinearSkin)


@dataclass(eq=False, slots=True)
class Near:
    """What one pressing of strips leaves to the next, which closes nearly the same nodes of the same strips.

    closed: (s, m) bool contact set to begin with, None before the first; factors: Cholesky factors by the nodes of a
    strip and what it adds to its diagonal, the latest up to FACTORS.
    """

    closed: np.ndarray | None = None
    factors: dict = field(default_factory=dict)

    def factor(self, key: tuple, matrix) -> tuple:
        """`cho_factor` of what matrix() makes, kept by its key."""
        found = self.factors.pop(key, None)
        if found is None:
            found = cho_factor(matrix(), lower=True, overwrite_a=True)
        self.factors[key] = found  # the latest stands last
        while len(self.factors) > max(1, FACTORS // found[0].nbytes):
            del self.factors[next(iter(self.factors))]
        return found


@dataclass(frozen=True, eq=False, slots=True)
class Slices:
    """Compliance of strips: what all of them have, and what each of them adds to its diagonal.

    common: C (m, m) [m/N]; own: (s, m) [m/N], None where nothing is added; near: of pressings with the same C, None of
    a single one.
    """

    common: np.ndarray
    own: np.ndarray | None = None
    near: Near | None = None

    def among(self, strip: int, nodes) -> np.ndarray:
        """Compliance (k, k) [m/N] of some nodes (k,) of a strip."""
        block = self.common[np.ix_(nodes, nodes)]
        if self.own is not None:
            block[np.diag_indices_from(block)] += self.own[strip, nodes]
        return block

    def bends(self, force) -> np.ndarray:
        """Displacements C_j f_j (s, m) [m] of nodal forces (s, m) [N]."""
        return force @ self.common if self.own is None else force @ self.common + self.own * force

    def alike(self, strip: int) -> bytes:
        """What two strips of the same compliance have in common."""
        return b"" if self.own is None else self.own[strip].tobytes()

    def factor(self, strip: int, active) -> tuple:
        """`cho_factor` of the compliance of the active nodes (m,) bool of a strip."""

        def matrix() -> np.ndarray:
            return self.among(strip, np.flatnonzero(active))

        return (self.near or Near()).factor((active.tobytes(), self.alike(strip)), matrix)

    @property
    def largest(self) -> float:
        """Largest entry [m/N]."""
        return float(np.abs(self.common).max() + (0.0 if self.own is None else self.own.max()))

    def plus(self, diagonal) -> "Slices":
        """The strips with (m,) [m/N] more on the diagonal of each, by themselves."""
        return Slices(self.common + np.diag(diagonal), self.own)


def softer(skin, c: Slices, weight) -> Slices:
    """Compliance with the linear skin in series, C + diag(1/(k A)); itself under any other skin.

    So bare contact of it is contact through the linear skin. weight: nodal areas A (m,) [m2].
    """
    return (
        replace(c.plus(1 / (skin.k * weight)), near=c.near) if isinstance(skin, LinearSkin) else c
    )


@dataclass(frozen=True, eq=False, slots=True)
class Motions:
    """Rigid motions q (r,) of a holder as its strips feel them: strip j closes by R_j q with R_j = B T_j.

    So what the compliance of one strip answers to B serves them all. base: B (m, b); shares: T (s, b, r); spring: S
    (r, r) that resists q; scale: (r,), q over it is (delta [m], -theta [rad], -roll [rad]), of which those stand that
    are free. All motions are of size 1 at the ends.
    """

    base: np.ndarray
    shares: np.ndarray
    spring: np.ndarray
    scale: np.ndarray

    @property
    def size(self) -> int:
        """Number r of free motions."""
        return self.shares.shape[2]

    def closing(self, q) -> np.ndarray:
        """Closing R_j q (s, m) of every node."""
        return (self.shares @ q) @ self.base.T

    def resultant(self, force) -> np.ndarray:
        """Generalised force sum_j R_j^T f_j (r,) of nodal forces (s, m)."""
        return np.einsum("jbr,jb->r", self.shares, force @ self.base)

    def folded(self, strips, answer) -> np.ndarray:
        """sum_j T_j^T a T_j (r, r) over some strips with the same answer a (b, b)."""
        return np.einsum("jbr,bc,jcq->rq", self.shares[strips], answer, self.shares[strips])


def holder_motions(x, offsets, turns: bool, rolls: bool, spring: float = 0.0) -> Motions:
    """Motions of a holder over places x (m,) along the strips at `offsets` y (s,): the closing, the rotation where it
    turns against `spring` [N m/rad], the roll where it rolls."""
    half, wide, size = np.abs(x).max() or 1.0, np.abs(offsets).max() or 1.0, 1 + turns + rolls
    base, shares, scale = (
        np.ones((x.size, 1 + turns)),
        np.zeros((offsets.size, 1 + turns, size)),
        np.ones(size),
    )
    stiff, shares[:, 0, 0] = np.zeros((size, size)), 1.0
    if turns:
        base[:, 1], shares[:, 1, 1], scale[1], stiff[1, 1] = x / half, 1.0, half, spring / half**2
    if rolls:
        shares[:, 0, -1], scale[-1] = offsets / wide, wide
    return Motions(base, shares, stiff, scale)


def closing_alone(size: int, count: int, free: int = 1) -> Motions:
    """The common closing of `count` strips of `size` nodes; no motion at all with `free` 0."""
    return Motions(
        np.ones((size, free)), np.ones((count, free, free)), np.zeros((free, free)), np.ones(free)
    )


def bare_parts(c, motions, active, gap=None) -> tuple:
    """Answers of bare strips to rigid motions, one entry per group of strips with the same active set, and their
    tangent.

    Entries: (strips, nodes, C^-1 B, C^-1 g); tangent (r, r) of sum R^T f.
    """
    groups, parts, base, system = {}, [], motions.base, np.zeros((motions.size, motions.size))
    for strip, row in enumerate(active):
        if row.any():
            groups.setdefault((row.tobytes(), c.alike(strip)), []).append(strip)
    for strips in map(np.array, groups.values()):
        nodes = np.flatnonzero(active[strips[0]])
        sides = (
            base[nodes]
            if gap is None
            else np.column_stack([base[nodes], gap[np.ix_(strips, nodes)].T])
        )
        answer = cho_solve(c.factor(strips[0], active[strips[0]]), sides)
        parts.append((strips, nodes, *np.split(answer, [base.shape[1]], axis=1)))
        system += motions.folded(strips, base[nodes].T @ parts[-1][2])
    return parts, system


def skin_parts(c, motions, slope, missing) -> tuple:
    """Answers of strips with a skin to rigid motions, one entry per strip, and their tangent (r, r) of sum R^T f.

    Entries: (strip, nodes, root D, (I + root D C root D)^-1 root D (B, missing)) with D = slope. Nodes of next to no
    slope follow the geometry.
    """
    least, size = 1e-18 * slope.max(), motions.base.shape[1]
    parts, system = [], np.zeros((motions.size, motions.size))
    for strip, row in enumerate(slope):
        if not (nodes := np.flatnonzero(row > least)).size:
            continue
        root = np.sqrt(row[nodes])
        own = root[:, None] * c.among(strip, nodes) * root
        own[np.diag_indices_from(own)] += 1.0
        sides = root[:, None] * np.column_stack([motions.base[nodes], missing[strip, nodes]])
        answer = cho_solve(cho_factor(own, lower=True, overwrite_a=True), sides)
        parts.append((strip, nodes, root, answer))
        system += motions.folded([strip], sides[:, :size].T @ answer[:, :size])
    return parts, system


def _bordered(c, gap, motions, target, active) -> tuple:
    """Forces (s, m) and motion q (r,) that close the active nodes: C f_j = R_j q - g_j, sum R_j^T f_j + S q =
    target."""
    # taken out first: the closing may be far smaller
    force, nearest = (
        np.zeros(gap.shape),
        gap[active].min(),
    )
    parts, system = bare_parts(c, motions, active, gap - nearest)
    for strips, nodes, _, free in parts:
        force[np.ix_(strips, nodes)] = free.T
    system = system + motions.spring
    motion = np.linalg.solve(system, target + motions.resultant(force))
    for strips, nodes, lift, free in parts:
        force[np.ix_(strips, nodes)] = motions.shares[strips] @ motion @ lift.T - free.T
    rest = np.linalg.solve(system, target - motions.resultant(force) - motions.spring @ motion)
    for (
        strips,
        nodes,
        lift,
        _,
    ) in parts:  # round-off of a rotation that closes far less than it turns
        force[np.ix_(strips, nodes)] += motions.shares[strips] @ rest @ lift.T
    return force, motion + rest + nearest * np.eye(1, target.size)[0]


def _active_set(c, gap, motions, target, active) -> tuple | None:
    """Primal-dual active set of bare strips: forces, motion and steps; None where it does not settle."""
    seen, bend, least = set(), c.largest, target.size - bool(motions.spring.any())
    # round-off of an opening
    span = 1e-13 * np.ptp(gap, axis=1, keepdims=True) + 1e-15 * np.ptp(gap)
    for count in range(1, STEPS + 1):
        if active.sum() < least:
            active = np.ones(gap.shape, bool)
        if (key := active.tobytes()) in seen:
            return None
        seen.add(key)
        try:
            force, motion = _bordered(c, gap, motions, target, active)
        except np.linalg.LinAlgError:  # this set does not determine the motion
            return None
        opening = gap - motions.closing(motion) + c.bends(force)
        noise = span + 1e-13 * bend * np.abs(force).sum(axis=1, keepdims=True)
        following = (active & (force > 0)) | (~active & (opening < -noise))
        if np.array_equal(following, active):
            return force, motion, count
        active = following
    return None


def _tangent_step(c, motions, slope, missing, lack) -> tuple:
    """Newton step (df, dq, ds) of f = A P(s), s = missing + s + C f - R q, sum R^T f short by `lack`, slope -A P'."""
    parts, system = skin_parts(c, motions, slope, missing)
    gain, size = np.zeros(slope.shape), motions.base.shape[1]
    for strip, nodes, root, answer in parts:
        gain[strip, nodes] = root * answer[:, size]
    lack = lack + motions.resultant(gain)
    motion = np.linalg.lstsq(system + motions.spring, lack, rcond=1e-14)[0] if lack.size else lack
    for strip, nodes, root, answer in parts:
        gain[strip, nodes] = root * (
            answer[:, :size] @ (motions.shares[strip] @ motion) - answer[:, size]
        )
    return gain, motion, missing - motions.closing(motion) + c.bends(gain)


def _newton(skin, c, weight, gap, motions, target, s, q) -> tuple | None:
    """Forces, separations, motion and steps of a smooth skin from the start (s, q); None where STEPS of them do not
    settle."""
    for count in range(1, STEPS + 1):
        log, fall = skin.log_pressure(s)
        log = log + np.log(weight)
        force = np.exp(np.minimum(log, 600.0))
        lack = target - motions.resultant(force) - motions.spring @ q
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                gain, motion, change = _tangent_step(
                    c, motions, force * fall, gap - motions.closing(q) + c.bends(force) - s, lack
                )
            except (np.linalg.LinAlgError, ValueError):  # left the numbers
                return None
        q, folds = q + motion, -change * fall
        share = np.exp(np.minimum(0.0, np.maximum(log, log + folds) - log.max()))
        depth = np.ptp(gap) + np.abs(c.bends(force)).max() + 2 * np.abs(q[1:]).sum()
        # the goal, and the last digit of a separation as a change of log P at the nodes that carry
        noise = 1e-12 + 1e-15 * depth * fall[force > 1e-6 * force.max()].max()
        missing = np.abs(lack).max() / target[0] if target.size else 0.0
        if max(missing, np.max(share * np.abs(folds))) <= noise:
            # what carries next to nothing takes its law
            follow = np.exp(np.minimum(log + folds, 600.0))
            return (
                np.where(share < 1e-15, follow, np.maximum(force + gain, 0.0)),
                s + change,
                q,
                count,
            )
        careful = np.where(folds > 0, -np.log1p(np.maximum(folds, 0.0)) / fall, change)
        mean = (target[0] if target.size else force.sum()) / (weight.sum() * len(gap))
        s = s + np.maximum(change, np.minimum(careful, skin.separation(np.array(0.01 * mean)) - s))
    return None


def _reach(skin, c, weight, gap) -> np.ndarray | None:
    """First separations (m,) of one strip of compliance c (m, m) under its approach; None where the skin is not
    reached.

    No node can carry more than what flattens its overlap, -gap (m,) [m].
    """
    s, diagonal = gap, np.diag(c)
    if skin.log_pressure(s)[0].max() <= FLOOR:
        return None
    if (diagonal > 0).all():
        s = np.maximum(
            s, skin.separation(np.maximum(-gap, np.abs(gap).max() * 1e-3) / (diagonal * weight))
        )
    if skin.log_pressure(s)[0].max() > -FLOOR:
        raise PatchfemError(
            "contact.approach: the pressure of the rough layer is too large to compute; give a smaller "
            "distance"
        )
    return s


def _held(skin, c, weight, gap) -> tuple:
    """Forces (m,), separations (m,) and steps of one strip of compliance c (m, m) with a smooth skin that is held at
    the gap (m,) [m]."""
    if (s := _reach(skin, c, weight, gap)) is None:
        return np.zeros(gap.size), gap, 0
    none = np.zeros(0)
    found = _newton(
        skin, Slices(c), weight, gap[None], closing_alone(gap.size, 1, 0), none, s[None], none
    )
    if found is None:
        raise NotConverged(
            "contact.asperities: the iteration of the rough layer did not converge; raise the decay "
            'length or the height deviation, or set law = "linear"'
        )
    return found[0][0], found[1][0], found[3]


def by_strip(skin, c, x, weight, gap) -> tuple:
    """Every strip solved by itself: forces (s, m) [N], separations (s, m) [m] of a smooth skin, else None, and steps.

    gap: (s, m) [m] with all motion in it. PatchfemError and NotConverged where a smooth skin carries more than any
    number or does not settle, and as in `unilateral.solve_forces`.
    """
    every = np.arange(x.size)
    if smooth(skin):
        force, s, steps = zip(
            *(_held(skin, c.among(strip, every), weight, row) for strip, row in enumerate(gap))
        )
        return np.array(force), np.array(s), sum(steps)
    force, steps = np.zeros(gap.shape), 0
    for strip in np.flatnonzero(gap.min(axis=1) < 0):
        force[strip], _, count = solve_forces(c.among(strip, every), x, gap[strip], np.zeros(0))
        steps += count
    return force, None, steps


def _downhill(skin, c, x, weight, gap, motions, target, sink: float, span: float) -> tuple:
    """Descent of the dual: forces (s, m), motion q at its bottom, and steps, from `sink` [m] beyond the nearest node."""
    q, soft = np.zeros(target.size), 1e-9 * target[0] / span * np.eye(target.size)
    q[0] = gap.min() + sink

    def at(q) -> tuple:
        try:
            force, s, steps = by_strip(skin, c, x, weight, gap - motions.closing(q))
        except PatchfemError:  # deeper than any number
            return None, None, None, 0
        return force, s, target - motions.resultant(force) - motions.spring @ q, steps

    def tangent(force, s):
        if s is None:
            return bare_parts(c, motions, force > 0)[1]
        slope = weight * skin.stiffness(s) * (force > 0)
        return skin_parts(c, motions, slope, slope)[1]

    (force, s, lack, total), record = at(q), np.inf
    for _ in range(60):
        if force is None or (size := np.abs(lack).max()) <= 1e-12 * target[0]:
            break
        record = min(record, size)
        way = np.linalg.solve(tangent(force, s) + motions.spring + soft, lack)
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
        force, s, lack, q = best
    return np.zeros(gap.shape) if force is None else force, q, total


def _first_set(gap, motions, target) -> np.ndarray:
    """Nodes (s, m) of the rigid body resting on the gap (s, m), widened to half of its height."""
    height = gap
    for k in range(1, target.size):
        place = motions.closing(np.eye(target.size)[k])
        middle = min(max(target[k] / target[0], place.min()), place.max())
        slopes = np.linspace(-1, 1, 41) * 4 * (np.ptp(height) + 1e-300) / np.ptp(place)
        lean = slopes[
            int(np.argmax([np.min(height + slope * (place - middle)) for slope in slopes]))
        ]
        height = height + lean * place
    return height <= height.min() + 0.5 * (np.ptp(height) + 1e-300)


def _bare_loaded(c, x, gap, motions, target) -> tuple:
    """Forces, motion q, steps of bare strips under a load (and moments), by the active set or down the dual."""
    found, near = None, c.near
    if near is not None and near.closed is not None:
        found = _active_set(c, gap, motions, target, near.closed)
    found = found or _active_set(c, gap, motions, target, _first_set(gap, motions, target))
    if near is not None:
        near.closed = None if found is None else found[0] > 0
    if found is not None:
        return found
    depth = c.largest * target[0]
    force, q, steps = _downhill(
        None, c, x, None, gap, motions, target, depth / len(gap), np.ptp(gap) + depth
    )
    force, q, more = _active_set(c, gap, motions, target, force > 0) or (force, q, 0)
    return force, q, steps + more


def _linearised(skin, c, x, weight, gap, motions, target) -> tuple:
    """First separations and motion: the law's tangent at the mean pressure, solved as a linear skin."""
    mean = target[0] / (weight.sum() * len(gap))
    rest = skin.separation(np.array([mean]))
    k = mean * skin.log_pressure(rest)[1][0]
    edge = rest[0] + mean / k  # where the tangent is zero
    try:
        force, q, _ = _bare_loaded(c.plus(1 / (k * weight)), x, gap - edge, motions, target)
    except (np.linalg.LinAlgError, NotConverged):  # a start is all that is lost
        return np.full(gap.shape, rest[0]), (gap.mean() - rest[0]) * np.eye(1, target.size)[0]
    stress = force / weight
    low = np.where(force > 0, edge - stress / k, gap - motions.closing(q) + c.bends(force))
    return np.where(stress > mean, skin.separation(np.maximum(stress, mean)), low), q


def _smooth_loaded(skin, c, x, weight, gap, motions, target, first) -> tuple:
    """Forces, separations, motion q, steps of a smooth skin from `first` = (s, q), by Newton or down the dual."""
    if (found := _newton(skin, c, weight, gap, motions, target, *first)) is not None:
        return found
    rest = skin.separation(np.array([target[0] / (weight.sum() * len(gap))]))
    span = 1 / skin.log_pressure(rest)[1][0]
    force, q, steps = _downhill(skin, c, x, weight, gap, motions, target, -rest[0], span)
    s = gap - motions.closing(q) + c.bends(force)
    force, s, q, more = _newton(skin, c, weight, gap, motions, target, s, q) or (force, s, q, 0)
    return force, s, q, steps + more


def loaded(skin, c, x, weight, gap, motions, target) -> tuple:
    """Forces, separations, free motions (delta, -theta, -roll) and steps of strips under a load, and moments of the
    motions that are free.

    target: load [N] and moments [N m]. Separations are None but for a smooth skin.
    """
    scale, target = motions.scale, target / motions.scale
    if not smooth(skin):
        force, q, count = _bare_loaded(softer(skin, c, weight), x, gap, motions, target)
        return force, None, q / scale, count
    first = _linearised(skin, c, x, weight, gap, motions, target)
    force, s, q, count = _smooth_loaded(skin, c, x, weight, gap, motions, target, first)
    return force, s, q / scale, count
