"""The asperities of a patch as a skin between the bodies: a local law P(s) in series with their compliance.

Node i with area A_i carries f_i = A_i P(s_i); the mean planes are s_i = g_i + theta x_i - delta + (C f)_i apart.
P >= 0 falls with s, so f minimises the strictly convex energy f.Cf/2 + g.f + sum A_i Psi(f_i/A_i) with Psi' = -P^-1
under the given load (and moment, and the spring of the holder): one answer for every law, gap and control.

The linear skin adds 1/(k A_i) to the diagonal of C; `unilateral` solves the contact of these softer pieces.
The smooth laws are solved by Newton on (s, delta, theta) in the symmetric form I + D^1/2 C D^1/2, D = -A P'. A node
that gains force moves along log P, one that loses force along s, and one with a negligible force may rise at once to
1 % of the mean pressure: of P's tangent each step keeps the side that cannot overshoot. Where that wanders, the law is
softened to P(s/t) and t led back to 1. Every answer is checked again by `residuals` from the definitions alone.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import NamedTuple

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from ..core import NotConverged, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import one_thread
from .skin_laws import ExponentialSkin
from .unilateral import LIMIT, solve_forces

STEPS = 60  # of Newton's method, before softer laws are tried
FLOOR = -300.0  # log pressure below which an approach does not reach the skin


@dataclass(frozen=True, eq=False, slots=True)
class SkinState:
    """A solved skin; arrays (m,).

    force [N], >= 0; pressure [Pa]; separation [m] of the mean planes by the law, below zero where the skin is crushed;
    stiffness k_n = -dP/ds [Pa/m]; delta [m] and theta [rad] of the upper holder; load [N] and moment [N m] carried;
    residuals: relative, from the independent check.
    """

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


class Control(NamedTuple):
    """The balances that are prescribed: R^T f + H q = target.

    rigid: the free rigid motions R (m, r), of size 1 at the ends, with coordinates q (r,); target: (r,) [N]; hold: H
    (r, r), the spring of the holder; scale: q = scale * (delta, -theta).
    """

    rigid: np.ndarray
    target: np.ndarray
    hold: np.ndarray
    scale: np.ndarray

    def lack(self, force, q) -> np.ndarray:
        """Load that is missing in each balance, target - R^T f - H q (r,) [N]; force (m,) [N], q (r,) [m]."""
        return self.target - self.rigid.T @ force - self.hold @ q


def _control(x, target, spring: float) -> Control:
    half, count = np.ptp(x) / 2, target.size
    scale = np.array([1.0, half])[:count]
    rigid = np.column_stack([np.ones(x.size), x / half])[:, :count]
    return Control(rigid, target / scale, np.diag([0.0, spring / half**2][:count]), scale)


def _live(force: np.ndarray) -> np.ndarray:
    """Indices of the nodes whose forces take part in a Newton step; the others carry next to nothing and follow the
    geometry."""
    return np.flatnonzero(force > 1e-18 * force.max())


def _step(c, control, lack, slope, missing) -> tuple:
    """Newton step (df, dq, ds) of f = A P(s), s = missing + s + C f - R q, R^T f + H q = target.

    slope: D = -A P' (m,); lack: (r,) of the balances; missing: (m,) [m] of the separations.
    """
    live = _live(slope)
    root = np.sqrt(slope[live])
    system = root[:, None] * c[np.ix_(live, live)] * root
    system[np.diag_indices_from(system)] += 1.0
    sides = root[:, None] * control.rigid[live]
    answer = cho_solve(cho_factor(system, lower=True, overwrite_a=True), np.column_stack([sides, root * missing[live]]))
    lack = lack + sides.T @ answer[:, -1]
    stiff = sides.T @ answer[:, :-1] + control.hold
    motion = np.linalg.lstsq(stiff, lack, rcond=1e-14)[0] if lack.size else lack
    gain = np.zeros(slope.size)
    gain[live] = root * (answer[:, :-1] @ motion - answer[:, -1])
    return gain, motion, missing - control.rigid @ motion + c[:, live] @ gain[live]


def _newton(skin, c, weight, gap, control, s, q) -> tuple | None:
    """Forces, separations, motions and steps from the start (s, q); None where STEPS of them do not settle."""
    rigid, target = control.rigid, control.target
    for count in range(1, STEPS + 1):
        log, fall = skin.log_pressure(s)
        log = log + np.log(weight)
        force = np.exp(np.minimum(log, 600.0))
        with np.errstate(over="ignore", invalid="ignore"):
            try:
                gain, motion, change = _step(c, control, control.lack(force, q), force * fall,
                                             gap - rigid @ q + c @ force - s)
            except (np.linalg.LinAlgError, ValueError):  # left the numbers
                return None
        lack = np.abs(control.lack(force, q)).max() / target[0] if target.size else 0.0
        q, folds = q + motion, -change * fall
        share = np.exp(np.minimum(0.0, np.maximum(log, log + folds) - log.max()))
        depth = np.ptp(gap) + np.abs(c @ force).max() + 2 * np.abs(q[1:]).max(initial=0.0)
        # the goal, and the last digit of a separation as a change of log P at the nodes that carry
        noise = 1e-12 + 1e-15 * depth * fall[force > 1e-6 * force.max()].max()
        if max(lack, np.max(share * np.abs(folds))) <= noise:
            follow = np.exp(np.minimum(log + folds, 600.0))  # what carries next to nothing takes its law
            return np.where(share < 1e-15, follow, np.maximum(force + gain, 0.0)), s + change, q, count
        mean = (target[0] if target.size else force.sum()) / weight.sum()
        careful = np.where(folds > 0, -np.log1p(np.maximum(folds, 0.0)) / fall, change)
        s = s + np.maximum(change, np.minimum(careful, skin.separation(np.array(0.01 * mean)) - s))
    return None


def _start(skin, c, x, weight, gap, target, spring) -> tuple:
    """First separations and motions: the law's tangent at the mean pressure, solved as a linear skin."""
    mean = target[0] / weight.sum()
    rest = skin.separation(np.array([mean]))
    fall = skin.log_pressure(rest)[1]
    edge = rest[0] + 1 / fall[0]  # where the tangent is zero
    control = _control(x, target, spring)
    try:
        force, motion, _ = solve_forces(c + np.diag(1 / (mean * fall * weight)), x, gap - edge, target, spring=spring)
    except (np.linalg.LinAlgError, NotConverged):  # a start is all that is lost
        return np.full(x.size, rest[0]), np.array([gap.mean() - rest[0], 0.0])[:target.size]
    stress = force / weight
    motion = motion * control.scale
    low = np.where(force > 0, edge - stress / (mean * fall), gap - control.rigid @ motion + c @ force)
    return np.where(stress > mean, skin.separation(np.maximum(stress, mean)), low), motion


def _softening(skin, c, x, weight, gap, target, spring: float = 0.0) -> tuple | None:
    """The answer by way of softer laws: from a law as long as the whole gap back to the law itself; None where one
    fails."""
    control = _control(x, target, spring)
    mean = target[0] / weight.sum()
    fall = skin.log_pressure(skin.separation(np.array([mean])))[1][0]
    span = np.ptp(gap) + np.abs(c).max() * target[0]
    factors = 2.0 ** np.arange(np.ceil(np.log2(max(2.0, fall * span))), -1, -1)
    s, q = _start(skin.softened(factors[0]), c, x, weight, gap, target, spring)
    total = 0
    for factor in factors:
        law = skin.softened(factor)
        answer = _newton(law, c, weight, gap, control, s, q)
        if answer is None:
            return None
        force, s, q, count = answer
        total += count
        s = np.where(force > 0.01 * mean * weight, s / 2, s)  # these keep their pressure, the others their place
    return force, answer[1], q, total


def _reach(skin, c, weight, overlap) -> np.ndarray | None:
    """First separations (m,) under an approach; None where the skin is not reached.

    No node can carry more than what flattens its overlap (m,) [m].
    """
    s, diagonal = -overlap, np.diag(c)
    if skin.log_pressure(s)[0].max() <= FLOOR:
        return None
    if (diagonal > 0).all():
        most = np.maximum(overlap, np.abs(overlap).max() * 1e-3) / (diagonal * weight)
        s = np.maximum(s, skin.separation(most))
    if skin.log_pressure(s)[0].max() > -FLOOR:
        raise PatchfemError("contact.approach: the skin would carry more than any number; lower the distance")
    return s


def _settled(skin, c, x, weight, gap, target, delta, spring) -> tuple:
    """Forces, separations, motions (delta or delta, -theta) and Newton steps."""
    control = _control(x, target, spring)
    scale = control.scale
    if not target.size:
        gap = gap - delta
        s, q = _reach(skin, c, weight, -gap), np.zeros(0)
        if s is None:
            return np.zeros(x.size), gap, np.array([delta]), 0
    else:
        s, q = _start(skin, c, x, weight, gap, target, spring)
    answer = _newton(skin, c, weight, gap, control, s, q)
    if answer is None and target.size:
        answer = _softening(skin, c, x, weight, gap, target, spring)
    if answer is None:
        raise NotConverged("contact.asperities: the skin did not settle; raise the decay length or the height "
                           "deviation, or take law = \"linear\"")
    force, s, q, count = answer
    return force, s, q / scale if target.size else np.array([delta]), count


def residuals(skin, c, x, weight, gap, force, delta: float, free: float, load=None, moment=None,
              spring: float = 0.0) -> MappingProxyType:
    """Relative residuals of a solved skin, recomputed from its definition alone; `free` rotation beyond the gap's.

    Keys: law (largest mismatch of a force, against the largest force and 1e-5 of what the law gains over the depth of
    the gap; pressures below exp(FLOOR) count as none), tension, and force_balance, moment_balance where prescribed.
    """
    opening = gap + free * x - delta + c @ force
    depth = np.ptp(gap) + np.abs(c @ force).max() + abs(free) * np.ptp(x)
    gain = 1e-5 * depth * (weight * skin.stiffness(opening)).max()
    most = max(force.max(), np.exp(FLOOR))
    miss = np.abs(force - weight * skin.pressure(opening)) - weight * np.exp(FLOOR)
    out = {"law": max(0.0, miss.max()) / (most + gain),
           "tension": max(0.0, -force.min()) / most}
    out |= {} if load is None else {"force_balance": abs(force.sum() - load) / load}
    if moment is not None:
        out["moment_balance"] = abs(force @ x - moment - spring * free) / (load * np.ptp(x) + abs(spring * free))
    return MappingProxyType({key: float(value) for key, value in out.items()})


def solve(skin, c: np.ndarray, x: np.ndarray, weight: np.ndarray, gap: np.ndarray, load: float | None = None,
          moment: float | None = None, approach: float | None = None, rotation: float = 0.0,
          spring: float = 0.0) -> SkinState:
    """Press two bodies through a rough skin of a smooth law (`skin_laws.Smooth`).

    c: closing compliance of the bodies (m, m) [m/N], symmetric, positive semidefinite, 0 for rigid bodies; x: (m,) [m];
    weight: nodal areas (m,) [m2]; gap: (m,) [m]. Controls: `load` [N] with `rotation` [rad] held (already in the gap,
    so only reported); `load` and `moment` [N m] with the rotation free, or against the `spring` [N m/rad] of the holder
    from `rotation` on; `approach` [m] with the rotation held. Zero load, or an approach that leaves the skin open,
    gives the outcome no_contact.

    PatchfemError for other controls, a load below zero, a moment that no pressure can carry, a gap that is not finite
    or an exponential law without `reference` under an approach; NotConverged above a residual of 1e-9.
    """
    _refuse(skin, x, gap, load, moment, approach, spring)
    target = np.array([value for value in (load, moment) if value is not None])
    if isinstance(skin, ExponentialSkin) and skin.reference is None and load:
        skin = replace(skin, reference=load / weight.sum())
    force, s, motion, count, checks = np.zeros(x.size), gap - gap.min(), np.array([gap.min()]), 0, {}
    with one_thread():
        if load != 0:
            force, s, motion, count = _settled(skin, c, x, weight, gap, target, approach, spring)
    free, touch = -float(motion[1]) if motion.size > 1 else 0.0, bool((force > 0).any())
    if load != 0:
        checks = residuals(skin, c, x, weight, gap, force, float(motion[0]), free, load, moment, spring)
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact.asperities: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}; make the skin "
                           "softer (decay length, height deviation), or leave it out")
    stiffness = np.where(force > 0, skin.stiffness(s), 0.0) if touch else 0.0 * x
    return SkinState(frozen_array(force), frozen_array(force / weight), frozen_array(s), frozen_array(stiffness),
                     float(motion[0]), rotation + free, float(force.sum()), float(force @ x), count,
                     Outcome.DONE if touch else Outcome.NO_CONTACT, MappingProxyType(checks))


def _refuse(skin, x, gap, load, moment, approach, spring: float = 0.0) -> None:
    """Raise PatchfemError for controls without an answer."""
    if (load is None) == (approach is None) or (moment is not None and load is None):
        raise PatchfemError("contact: give a load, a load and a moment, or an approach")
    if not (np.isfinite(gap).all() and np.isfinite(load if approach is None else approach) and (load or 0.0) >= 0):
        raise PatchfemError("contact.load: the load must be >= 0, load, approach and gap finite")
    if load and moment is not None and spring == 0 and not abs(moment) < load * np.ptp(x) / 2:
        raise PatchfemError(f"contact.load_line: the line of the load lies {moment / load:.6g} m from the middle, "
                            f"outside the half length {np.ptp(x) / 2:.6g} m: the piece tips over")
    if load is None and isinstance(skin, ExponentialSkin) and skin.reference is None:
        raise PatchfemError("contact.approach with contact.asperities.law = \"exponential\": the law has no first "
                            "touch to measure from; give contact.load, or another law")
