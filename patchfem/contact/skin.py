"""The asperities of a patch as a skin between the bodies: a local law P(s) in series with their compliance.

Node i with area A_i carries f_i = A_i P(s_i); the mean planes are s_i = g_i + theta x_i - delta + (C f)_i apart.
P >= 0 falls with s, so f minimises the strictly convex energy f.Cf/2 + g.f + sum A_i Psi(f_i/A_i) with Psi' = -P^-1
under the given load (and moment, and the spring of the holder): one answer for every law, gap and control.

The linear skin adds 1/(k A_i) to the diagonal of C; `unilateral` solves the contact of these softer pieces. A patch
behind a smooth law is one strip of `strips_solve`. Every answer, of a patch as of strips, is checked again by
`residuals` from the definitions alone.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ..core import NotConverged, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import one_thread
from .skin_laws import ExponentialSkin, LinearSkin
from .strips_solve import FLOOR, Slices, by_strip, holder_motions, loaded
from .unilateral import LIMIT


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


def residuals(skin, c: Slices, x, weight, gap, force, delta: float, free: float, load=None, moment=None,
              spring: float = 0.0) -> MappingProxyType:
    """Relative residuals of pressed strips, one of them a patch, recomputed from the definitions alone.

    skin: a law, None for bare strips; gap, force: (s, m); free: rotation [rad] beyond that in the gap. Keys: the worst
    strip's penetration, tension and complementarity (bare) or law and tension (skin); force_balance and moment_balance
    of all strips, where prescribed. law: largest mismatch of a force, against the largest force and what the law gains
    over the depth of the gap, of a smooth law 1e-5 of it; pressures below exp(FLOOR) count as none.
    """
    bent = c.bends(force)
    opening = gap + free * x - delta + bent
    depth = np.ptp(gap, axis=1) + np.abs(bent).max() + abs(free) * np.ptp(x) + 1e-150
    most, total = max(force.max(), np.exp(FLOOR)), max(force.sum(), 1e-150)
    out = {"tension": max(0.0, -force.min()) / most}
    if skin is None:
        out["penetration"] = np.max(np.maximum(0.0, -opening.min(axis=1)) / depth)
        out["complementarity"] = np.max(np.abs(force * opening).sum(axis=1) / (total * depth))
    else:
        rate = np.full(gap.shape, skin.k) if isinstance(skin, LinearSkin) else 1e-5 * skin.stiffness(opening)
        gain = depth * (weight * rate).max(axis=1)
        miss = np.abs(force - weight * skin.pressure(opening)) - weight * np.exp(FLOOR)
        out["law"] = np.max(np.maximum(0.0, miss.max(axis=1)) / (most + gain))
    if load is not None:
        out["force_balance"] = abs(force.sum() - load) / load
    if moment is not None:
        turned = spring * free
        out["moment_balance"] = abs((force @ x).sum() - moment - turned) / (load * np.ptp(x) + abs(turned))
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
    refuse(skin, x, gap, load, moment, approach, spring)
    target = np.array([value for value in (load, moment) if value is not None])
    if isinstance(skin, ExponentialSkin) and skin.reference is None and load:
        skin = replace(skin, reference=load / weight.sum())
    c, gap = Slices(c), gap[None]
    force, s, motion, count, checks = np.zeros(gap.shape), gap - gap.min(), np.array([gap.min()]), 0, {}
    with one_thread():
        if load is None:
            motion = np.array([approach])
            force, s, count = by_strip(skin, c, x, weight, gap - approach)
        elif load:
            motions = holder_motions(x, np.zeros(1), moment is not None, False, spring)
            force, s, motion, count = loaded(skin, c, x, weight, gap, motions, target)
    free, touch = -float(motion[1]) if motion.size > 1 else 0.0, bool((force > 0).any())
    if load != 0:
        checks = residuals(skin, c, x, weight, gap, force, float(motion[0]), free, load, moment, spring)
    force, s = force[0], s[0]
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact.asperities: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}; make the skin "
                           "softer (decay length, height deviation), or leave it out")
    stiffness = np.where(force > 0, skin.stiffness(s), 0.0) if touch else 0.0 * x
    return SkinState(frozen_array(force), frozen_array(force / weight), frozen_array(s), frozen_array(stiffness),
                     float(motion[0]), rotation + free, float(force.sum()), float(force @ x), count,
                     Outcome.DONE if touch else Outcome.NO_CONTACT, MappingProxyType(checks))


def refuse(skin, x, gap, load, moment, approach, spring: float = 0.0) -> None:
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
