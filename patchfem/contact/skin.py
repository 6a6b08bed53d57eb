"""The asperities of a patch as a skin between the bodies: a local law P(s) in series with their compliance.

Node i with area A_i carries f_i = A_i P(s_i); the mean planes are s_i = g_i + theta x_i - delta + (C f)_i apart.
P >= 0 falls with s, so f minimises the strictly convex energy f.Cf/2 + g.f + sum A_i Psi(f_i/A_i) with Psi' = -P^-1
under the given load (and moment): one answer for every law, gap and control.

The linear skin adds 1/(k A_i) to the diagonal of C and is then exactly the unilateral problem of `unilateral`.
The smooth laws are solved by Newton on (s, delta, theta) in the symmetric form I + D^1/2 C D^1/2, D = -A P'. A node
that gains force moves along log P, one that loses force along s, and one with a negligible force may rise at once to
1 % of the mean pressure: of P's tangent each step keeps the side that cannot overshoot. Where that wanders, the law is
softened to P(s/t) and t led back to 1. Every answer is checked again by `residuals` from the definitions alone.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from scipy.linalg import cho_factor, cho_solve
from threadpoolctl import threadpool_limits

from ..core import NotConverged, Outcome, PatchfemError, frozen_array
from .unilateral import LIMIT, solve_forces

FLOOR = -600.0  # log pressure below which an approach does not reach the skin
_V = 0.1 * np.arange(1, 70)  # trapezoidal rule on an even analytic integrand: error below 1e-15


@dataclass(frozen=True, eq=False, slots=True)
class LinearSkin:
    """P = k max(0, -s); k [Pa/m] > 0. s < 0 is the crush of the skin, s >= 0 carries nothing."""

    k: float

    def pressure(self, s: np.ndarray) -> np.ndarray:
        """P (m,) [Pa] at the separations s (m,) [m]."""
        return self.k * np.maximum(0.0, -np.asarray(s, float))

    def stiffness(self, s: np.ndarray) -> np.ndarray:
        """-dP/ds (m,) [Pa/m]; 0 where the skin is not crushed."""
        return np.where(np.asarray(s) < 0, self.k, 0.0)


class _Smooth:
    """What the laws with P > 0 everywhere share; they give `log_pressure`, `separation`, `softened`."""

    __slots__ = ()

    def pressure(self, s: np.ndarray) -> np.ndarray:
        """P (m,) [Pa] at the separations s (m,) [m]."""
        return np.exp(np.minimum(self.log_pressure(np.asarray(s, float))[0], 700.0))

    def stiffness(self, s: np.ndarray) -> np.ndarray:
        """-dP/ds (m,) [Pa/m]."""
        return self.pressure(s) * self.log_pressure(np.asarray(s, float))[1]


@dataclass(frozen=True, eq=False, slots=True)
class ExponentialSkin(_Smooth):
    """P = reference exp(-s/u0); u0 [m] > 0, reference [Pa] the pressure at s = 0.

    Without a reference `solve` takes the mean pressure of the given load, so that flat aligned pieces have s = 0 and
    the approach is the closing of the bodies alone; the choice shifts the approach and nothing else.
    """

    u0: float
    reference: float | None = None

    def log_pressure(self, s: np.ndarray) -> tuple:
        """log P and its fall per separation -d(log P)/ds [1/m], (m,) each."""
        return np.log(self.reference) - s / self.u0, np.full(np.shape(s), 1 / self.u0)

    def separation(self, pressure: np.ndarray) -> np.ndarray:
        """s [m] that carries `pressure` [Pa] > 0."""
        return -self.u0 * np.log(pressure / self.reference)

    def softened(self, factor: float) -> "ExponentialSkin":
        """The law P(s/factor)."""
        return replace(self, u0=self.u0 * factor)


@dataclass(frozen=True, eq=False, slots=True)
class HertzSkin(_Smooth):
    """Greenwood-Williamson: P = 4/3 E* sqrt(R) eta int_s^inf (z - s)^3/2 phi(z) dz, Gaussian peaks of mean height 0.

    radius R [m] of a peak, density eta [1/m2], deviation [m] of the peak heights, modulus E* [Pa] of the pair:
    1/E* = (1 - nu_1^2)/E_1 + (1 - nu_2^2)/E_2. All > 0. Relative error of P below 1e-13 at any s.
    """

    radius: float
    density: float
    deviation: float
    modulus: float

    @property
    def _level(self) -> float:
        return np.log(4 / 3 * self.modulus * self.density * self.radius**0.5 * self.deviation**1.5)

    def log_pressure(self, s: np.ndarray) -> tuple:
        """log P and its fall per separation -d(log P)/ds [1/m], (m,) each."""
        log, fall = peak_integral(np.asarray(s, float) / self.deviation)
        return self._level + log, fall / self.deviation

    def separation(self, pressure: np.ndarray) -> np.ndarray:
        """s [m] that carries `pressure` [Pa] > 0, by Newton on the concave log P (from the steep side: monotone)."""
        wanted = np.log(np.asarray(pressure, float)) - self._level
        h = np.where(wanted < 0, np.sqrt(np.maximum(0.0, -2 * wanted)), -np.exp(np.clip(wanted, 0, 400) / 1.5))
        for _ in range(80):
            log, fall = peak_integral(h)
            h = h + (log - wanted) / fall
            if np.all(np.abs(log - wanted) <= 1e-14 * (1 + np.abs(wanted))):
                break
        return h * self.deviation

    def softened(self, factor: float) -> "HertzSkin":
        """The law P(s/factor)."""
        return replace(self, deviation=self.deviation * factor, density=self.density * factor**-1.5)


def peak_integral(h: np.ndarray) -> tuple:
    """log F and -d(log F)/dh of F(h) = int_h^inf (z - h)^3/2 phi(z) dz, phi the unit normal density; h any shape.

    F = phi(h) 2 int_0^inf v^4 exp(-h v^2 - v^4/2) dv by the trapezoidal rule, and the moment series of
    (z - h)^3/2 below h = -8, short of it by exp(-32). Error of log F 2e-14 + 1e-16 h^2, of its fall 3e-13."""
    h = np.asarray(h, float)
    flat = np.maximum(h, -8.0).reshape(-1, 1)
    scale = 1 + np.maximum(flat, 0.0)
    square = _V**2 / scale
    weight = np.exp(-flat * square - square**2 / 2) * square
    low, high = weight.sum(axis=1), (weight * square).sum(axis=1)
    log = -flat[:, 0]**2 / 2 + np.log(0.2 * high / np.sqrt(2 * np.pi * scale[:, 0]))
    log, fall = log.reshape(h.shape), (1.5 * low / high).reshape(h.shape)
    depth = np.where(h < -8, -h, 8.0)
    three, one = _moment(1.5, depth), _moment(0.5, depth)
    return np.where(h < -8, 1.5 * np.log(depth) + np.log(three), log), np.where(h < -8, 1.5 * one / three / depth, fall)


def _moment(n: float, a: np.ndarray) -> np.ndarray:
    """E (1 + z/a)^n for a unit normal z and large a: sum binom(n, 2k) (2k - 1)!! a^-2k."""
    out, term = np.zeros_like(a), np.ones_like(a)
    for k in range(0, 24, 2):
        out += term
        term = term * ((n - k) * (n - k - 1) / (k + 2)) / a**2
    return out


@dataclass(frozen=True, eq=False, slots=True)
class SkinState:
    """A solved skin; every array (m,). force [N] >= 0; pressure [Pa]; separation [m] of the mean planes by the law
    (< 0: crushed); stiffness k_n = -dP/ds [Pa/m]; delta [m] and theta [rad] of the upper holder; load [N] and moment
    [N m] carried; `residuals` from the independent check, relative."""

    force: np.ndarray
    pressure: np.ndarray
    separation: np.ndarray
    stiffness: np.ndarray
    delta: float
    theta: float
    load: float
    moment: float
    iterations: int
    outcome: Outcome
    residuals: MappingProxyType


def _rigid(x, target) -> tuple:
    """Rigid motions (m, r) that all have the size 1 at the ends, and what turns them into delta and -theta."""
    half = np.ptp(x) / 2
    return np.column_stack([np.ones(x.size), x / half])[:, :target.size], np.array([1.0, half])[:target.size]


def _live(force: np.ndarray) -> np.ndarray:
    """Indices of the nodes whose forces take part in a Newton step; the others follow the geometry."""
    return np.flatnonzero(force > 1e-18 * force.max())


def _step(c, rigid, target, force, slope, missing) -> tuple:
    """Newton step (df, dq, ds) of f = A P(s), s = missing + s + C f - R q, R^T f = target; slope D = -A P' (m,)."""
    live = _live(slope)
    root = np.sqrt(slope[live])
    system = root[:, None] * c[np.ix_(live, live)] * root
    system[np.diag_indices_from(system)] += 1.0
    sides = root[:, None] * rigid[live]
    answer = cho_solve(cho_factor(system, lower=True, overwrite_a=True), np.column_stack([sides, root * missing[live]]))
    lack = target - rigid.T @ force + sides.T @ answer[:, -1]
    motion = np.linalg.lstsq(sides.T @ answer[:, :-1], lack, rcond=1e-14)[0] if target.size else target
    gain = np.zeros(force.size)
    gain[live] = root * (answer[:, :-1] @ motion - answer[:, -1])
    return gain, motion, missing - rigid @ motion + c[:, live] @ gain[live]


def _newton(skin, c, weight, gap, rigid, target, s, q, limit: int) -> tuple | None:
    """Forces, separations, motions and steps from the start (s, q); None where `limit` steps do not settle."""
    for count in range(1, limit + 1):
        log, fall = skin.log_pressure(s)
        log = log + np.log(weight)
        force = np.exp(np.minimum(log, 600.0))
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                gain, motion, change = _step(c, rigid, target, force, force * fall, gap - rigid @ q + c @ force - s)
            except (np.linalg.LinAlgError, ValueError):  # left the numbers
                return None
        lack = np.abs(target - rigid.T @ force).max() / target[0] if target.size else 0.0
        q, folds = q + motion, -change * fall
        share = np.exp(np.minimum(0.0, np.maximum(log, log + folds) - log.max()))
        depth = np.ptp(gap) + np.abs(c @ force).max() + 2 * np.abs(q[1:]).max(initial=0.0)
        noise = 1e-12 + 1e-15 * depth * fall[force > 1e-6 * force.max()].max()
        if max(lack, np.max(share * np.abs(folds))) <= noise:
            follow = np.exp(np.minimum(log + folds, 600.0))  # what carries next to nothing takes its law
            return np.where(share < 1e-15, follow, np.maximum(force + gain, 0.0)), s + change, q, count
        mean = (target[0] if target.size else force.sum()) / weight.sum()
        careful = np.where(folds > 0, -np.log1p(np.maximum(folds, 0.0)) / fall, change)
        s = s + np.maximum(change, np.minimum(careful, skin.separation(np.array(0.01 * mean)) - s))
    return None


def _start(skin, c, x, weight, gap, target) -> tuple:
    """Separations and motions of the law's tangent at the mean pressure, taken as a linear skin."""
    mean = target[0] / weight.sum()
    rest = skin.separation(np.array([mean]))
    fall = skin.log_pressure(rest)[1]
    edge = rest[0] + 1 / fall[0]  # where the tangent is zero
    rigid, scale = _rigid(x, target)
    try:
        force, motion, _ = solve_forces(c + np.diag(1 / (mean * fall * weight)), x, gap - edge, target)
    except (np.linalg.LinAlgError, NotConverged):  # a start is all that is lost
        return np.full(x.size, rest[0]), np.array([gap.mean() - rest[0], 0.0])[:target.size]
    stress = force / weight
    low = np.where(force > 0, edge - stress / (mean * fall), gap - rigid @ (motion * scale) + c @ force)
    return np.where(stress > mean, skin.separation(np.maximum(stress, mean)), low), motion * scale


def _softening(skin, c, x, weight, gap, target, limit: int) -> tuple | None:
    """The answer reached through softened laws: from one as long as the whole gap back to the law itself."""
    rigid, scale = _rigid(x, target)
    mean = target[0] / weight.sum()
    fall = skin.log_pressure(skin.separation(np.array([mean])))[1][0]
    span = np.ptp(gap) + np.abs(c).max() * target[0]
    factors = 2.0 ** np.arange(np.ceil(np.log2(max(2.0, fall * span))), -1, -1)
    s, q = _start(skin.softened(factors[0]), c, x, weight, gap, target)
    total = 0
    for factor in factors:
        law = skin.softened(factor)
        answer = _newton(law, c, weight, gap, rigid, target / scale, s, q, limit)
        if answer is None:
            return None
        force, s, q, count = answer
        total += count
        s = np.where(force > 0.01 * mean * weight, s / 2, s)  # these keep their pressure, the others their place
    return force, answer[1], q, total


def _reach(skin, c, weight, overlap) -> np.ndarray | None:
    """First separations under an approach: no node can carry more than flattens its overlap (m,); None: no contact."""
    s, diagonal = -overlap, np.diag(c)
    if skin.log_pressure(s)[0].max() <= FLOOR:
        return None
    if (diagonal > 0).all():
        most = np.maximum(overlap, np.abs(overlap).max() * 1e-3) / (diagonal * weight)
        s = np.maximum(s, skin.separation(most))
    if skin.log_pressure(s)[0].max() > -FLOOR:
        raise PatchfemError("contact.approach: the skin would carry more than any number; lower the distance")
    return s


def _smooth(skin, c, x, weight, gap, target, delta, start, limit) -> tuple:
    """Forces, separations, motions (delta or delta, -theta) and steps of a smooth law."""
    rigid, scale = _rigid(x, target)
    if not target.size:
        gap = gap - delta
        s, q = _reach(skin, c, weight, -gap), np.zeros(0)
        if s is None:
            return np.zeros(x.size), gap, np.array([delta]), 0
    elif start is not None:
        s, q = start.separation, np.array([start.delta, -start.theta])[:target.size] * scale
    else:
        s, q = _start(skin, c, x, weight, gap, target)
    answer = _newton(skin, c, weight, gap, rigid, target / scale, s, q, limit)
    if answer is None and target.size:
        answer = _softening(skin, c, x, weight, gap, target, limit)
    if answer is None:
        raise NotConverged("contact.asperities: the skin did not settle; raise the decay length or the height "
                           "deviation, or take law = \"linear\"")
    force, s, q, count = answer
    return force, s, q / scale if target.size else np.array([delta]), count


def _crush(skin, c, weight, gap, rigid, target, s, q) -> tuple:
    """Semismooth Newton on the crush: forces, separations, motions and steps (60 of them: not settled)."""
    for count in range(1, 61):
        held = np.where(s < 0, skin.k * weight, 0.0)
        force = -held * s
        gain, motion, change = _step(c, rigid, target, force, held, gap - rigid @ q + c @ force - s)
        same = np.array_equal(s + change < 0, s < 0)
        force, s, q = force + gain, s + change, q + motion
        if same and np.abs(gain).max() <= 1e-12 * np.abs(force).max():
            return np.maximum(force, 0.0), s, q, count
    return np.maximum(force, 0.0), s, q, 60


def _linear(skin, c, x, weight, gap, target, delta, start) -> tuple:
    """Forces, separations, motions (delta or delta, -theta) and steps of the linear skin: the active set of
    `unilateral`, then steps on the crush that take out the round-off of gaps far larger than the crush."""
    rigid, scale = _rigid(x, target)
    gap = gap if target.size else gap - delta
    if not target.size and gap.min() >= 0:
        return np.zeros(x.size), gap, np.array([delta]), 0
    active = None if start is None or not (start.force > 0).any() else start.force > 0
    try:
        force, motion, count = solve_forces(c + np.diag(1 / (skin.k * weight)), x, gap, target, active)
    except (np.linalg.LinAlgError, NotConverged):  # a thin smooth skin finds the nodes that carry
        mean = (target[0] if target.size else skin.k * weight @ np.maximum(-gap, 0.0)) / weight.sum()
        thin = ExponentialSkin(mean / skin.k, mean)
        force, _, motion, count = _smooth(thin, c, x, weight, gap, target, 0.0, None, 60)
        force, motion = np.where(force > 0.05 * mean * weight, force, 0.0), motion[:target.size]
    s = np.where(force > 0, -force / (skin.k * weight), np.abs(gap - rigid @ (motion * scale) + c @ force))
    force, s, q, _ = _crush(skin, c, weight, gap, rigid, target / scale, s, motion * scale)
    return force, s, q / scale if target.size else np.array([delta]), count


def residuals(skin, c, x, weight, gap, force, delta: float, free: float, load=None, moment=None) -> MappingProxyType:
    """Relative residuals of a solved skin, recomputed from its definition alone; `free` rotation beyond the gap's.

    Keys: law (largest mismatch of a force, against the largest force and what the law gains over the depth of the
    gap, or 1e-5 of it for the smooth laws), tension, and force_balance, moment_balance where prescribed.
    """
    opening = gap + free * x - delta + c @ force
    depth = np.ptp(gap) + np.abs(c @ force).max() + abs(free) * np.ptp(x)
    gain = depth * (weight * (skin.k if isinstance(skin, LinearSkin) else 1e-5 * skin.stiffness(opening))).max()
    most = max(force.max(), np.exp(FLOOR))
    out = {"law": np.abs(force - weight * skin.pressure(opening)).max() / (most + gain),
           "tension": max(0.0, -force.min()) / most}
    out |= {} if load is None else {"force_balance": abs(force.sum() - load) / load}
    out |= {} if moment is None else {"moment_balance": abs(force @ x - moment) / (load * np.ptp(x))}
    return MappingProxyType({key: float(value) for key, value in out.items()})


def solve(skin, c: np.ndarray, x: np.ndarray, weight: np.ndarray, gap: np.ndarray, load: float | None = None,
          moment: float | None = None, approach: float | None = None, rotation: float = 0.0,
          start: SkinState | None = None, limit: int = 60) -> SkinState:
    """Skin between bodies of the closing compliance c (m, m) [m/N], symmetric, positive semidefinite (0: rigid bodies).

    x (m,) [m], nodal areas weight (m,) [m2], gap (m,) [m]. Controls: `load` [N] with `rotation` [rad] held (already in
    the gap, so only reported); `load` and `moment` [N m] with the rotation free; `approach` [m] with the rotation held.
    `start`: a neighbouring answer under the same control. Zero load, or an approach that leaves the skin open: outcome
    no_contact. PatchfemError for other controls, a load below zero, a moment that no pressure can carry, a gap that is
    not finite or an exponential law without `reference` under an approach; NotConverged above a residual of 1e-9.
    """
    _refuse(skin, x, gap, load, moment, approach)
    target = np.array([value for value in (load, moment) if value is not None])
    if isinstance(skin, ExponentialSkin) and skin.reference is None and load:
        skin = replace(skin, reference=load / weight.sum())
    if start is not None:
        start = replace(start, theta=start.theta - rotation)
    force, s, motion, count, checks = np.zeros(x.size), gap - gap.min(), np.array([gap.min()]), 0, {}
    with threadpool_limits(1, "blas"):
        if load != 0 and isinstance(skin, LinearSkin):
            force, s, motion, count = _linear(skin, c, x, weight, gap, target, approach, start)
        elif load != 0:
            force, s, motion, count = _smooth(skin, c, x, weight, gap, target, approach, start, limit)
    free, touch = -float(motion[1]) if motion.size > 1 else 0.0, bool((force > 0).any())
    if load != 0:
        checks = residuals(skin, c, x, weight, gap, force, float(motion[0]), free, load, moment)
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact.asperities: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}")
    stiffness = np.where(force > 0, skin.stiffness(s), 0.0) if touch else 0.0 * x
    return SkinState(frozen_array(force), frozen_array(force / weight), frozen_array(s), frozen_array(stiffness),
                     float(motion[0]), rotation + free, float(force.sum()), float(force @ x), count,
                     Outcome.DONE if touch else Outcome.NO_CONTACT, MappingProxyType(checks))


def _refuse(skin, x, gap, load, moment, approach) -> None:
    """PatchfemError for controls without an answer."""
    if (load is None) == (approach is None) or (moment is not None and load is None):
        raise PatchfemError("contact: give a load, a load and a moment, or an approach")
    if not (np.isfinite(gap).all() and np.isfinite(load if approach is None else approach) and (load or 0.0) >= 0):
        raise PatchfemError("contact.load: the load must be >= 0, load, approach and gap finite")
    if load and moment is not None and not abs(moment) < load * np.ptp(x) / 2:
        raise PatchfemError(f"contact.load_line: the line of the load lies {moment / load:.6g} m from the middle, "
                            f"outside the half length {np.ptp(x) / 2:.6g} m: the piece tips over")
    if load is None and isinstance(skin, ExponentialSkin) and skin.reference is None:
        raise PatchfemError("contact.approach with contact.asperities.law = \"exponential\": the law has no first "
                            "touch to measure from; give contact.load, or another law")


def tangent(c: np.ndarray, weight: np.ndarray, stiffness: np.ndarray) -> float:
    """Stiffness [N/m] of the whole patch, skin and bodies in series, for one common rigid motion.

    stiffness (m,) [Pa/m] of the skin. With the normal compliance and k_n: dN/d(delta) at fixed rotation; with the
    tangential compliance and tangential_ratio * k_n: dT/d(slide) in stick. Nodes of no stiffness carry nothing.
    """
    d = weight * stiffness
    live = _live(d)
    root = np.sqrt(d[live])
    with threadpool_limits(1, "blas"):
        system = np.eye(live.size) + root[:, None] * c[np.ix_(live, live)] * root
        return float(root @ cho_solve(cho_factor(system, lower=True), root))
