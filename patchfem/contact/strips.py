"""Strips side by side over the width, one condensed slice repeated under one rigid holder that may roll; and a patch
behind smooth asperities, which is one strip.

Strip j, at y_j from the middle, has the gap g(x) + roll y_j (or one of its own) and the compliance C. Strips do not
feel each other: the shear between them is neglected. The motion q = (delta, -theta, -roll) of the holder is common, or
as much of it as is free, so the answer minimises the convex dual sum_j Phi_j(R_j q - g_j) + q.S q/2 - q.target, with
R_j = (1, x, y_j) and S the spring of the rotation.

Asperities are a skin, a local law P(s) in series with the bodies: a node of area A_i carries f_i = A_i P(s_i), with
the mean planes s_i = g_i + theta x_i - delta + (C f)_i apart. P >= 0 falls with s, so Phi gains A_i Psi(f_i/A_i), Psi'
= -P^-1, and the answer is one for every law, gap and control. The linear skin adds 1/(k A_i) to the diagonal of C.
Every answer of `strips_solve` is checked again by `residuals` from the definitions alone.
"""

from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from ..core import Compliance, NotConverged, Outcome, PatchfemError, frozen_array
from ..elasticity.lapack import one_thread
from .skin_laws import ExponentialSkin, LinearSkin
from .strips_solve import (
    FLOOR,
    Slices,
    bare_parts,
    by_strip,
    closing_alone,
    holder_motions,
    loaded,
    skin_parts,
    smooth,
    softer,
)
from .unilateral import LIMIT

NEGLECTED = (
    "the shear between neighbouring strips is neglected; fields and pictures show the mean over the strips, "
    "unless their captions name strips; result.nc contains every strip"
)


@dataclass(frozen=True, eq=False, slots=True)
class StripsState:
    """Strips pressed by one holder; s strips of m nodes, forces of all pairs together.

    force: (s, m) [N], >= 0; pressure: (s, m) [Pa]; gap: (s, m) [m] left open, with a skin the separation of its mean
    planes (below zero: crushed); stiffness: (s, m) [Pa/m] of the skin, None without one; offsets: y (s,) [m]; delta
    [m], theta and roll [rad] of the holder; load [N]; moment sum f x and roll_moment sum f y [N m]; centre_x, centre_y
    [m] of the pressure; fraction: share of the area that carries; residuals: relative, from the independent check.
    """

    force: np.ndarray
    pressure: np.ndarray
    gap: np.ndarray
    stiffness: np.ndarray | None
    offsets: np.ndarray
    delta: float
    theta: float
    roll: float
    load: float
    moment: float
    roll_moment: float
    centre_x: float
    centre_y: float
    fraction: float
    outcome: Outcome
    iterations: int
    residuals: MappingProxyType

    @property
    def note(self) -> str:
        """The sentence for users on what the answer leaves out: the shear between the strips."""
        return NEGLECTED

    def yaw_moment(self, friction: float) -> float:
        """Yaw moment mu sum f y [N m] about +z on the upper piece while all of it slides towards +x; friction is mu."""
        return friction * self.roll_moment


def strip_offsets(width: float, count: int) -> np.ndarray:
    """Centres y (count,) [m] of `count` equal strips over `width` [m] of one pair, 0 in the middle.

    PatchfemError for less than one strip or no width.
    """
    if not (count >= 1 and width > 0):
        raise PatchfemError(
            f"contact.strips.count: {count} strips over {width:.6g} m; at least one is needed"
        )
    return (np.arange(count) + 0.5) * (width / count) - width / 2


def one_strip(pieces: Compliance, count: int) -> tuple:
    """One of `count` equal strips: normal and tangential compliance (m, m) [m/N] and nodal areas (m,) [m2].

    A strip is `count` times as compliant as the whole width, as strips do not feel each other.
    """
    return pieces.normal * count, pieces.tangential * count, pieces.interface.weight / count


def residuals(
    skin,
    c: Slices,
    x,
    weight,
    gap,
    force,
    delta: float,
    free: float,
    load=None,
    moment=None,
    spring: float = 0.0,
) -> MappingProxyType:
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
        rate = (
            np.full(gap.shape, skin.k)
            if isinstance(skin, LinearSkin)
            else 1e-5 * skin.stiffness(opening)
        )
        gain = depth * (weight * rate).max(axis=1)
        miss = np.abs(force - weight * skin.pressure(opening)) - weight * np.exp(FLOOR)
        out["law"] = np.max(np.maximum(0.0, miss.max(axis=1)) / (most + gain))
    if load is not None:
        out["force_balance"] = abs(force.sum() - load) / load
    if moment is not None:
        turned = spring * free
        out["moment_balance"] = abs((force @ x).sum() - moment - turned) / (
            load * np.ptp(x) + abs(turned)
        )
    return MappingProxyType({key: float(value) for key, value in out.items()})


def press_strips(
    c: np.ndarray | Slices,
    x: np.ndarray,
    weight: np.ndarray,
    offsets: np.ndarray,
    gap: np.ndarray,
    roll: float = 0.0,
    load: float | None = None,
    moment: float | None = None,
    approach: float | None = None,
    rotation: float = 0.0,
    spring: float = 0.0,
    skin=None,
    lateral: float | None = None,
) -> StripsState:
    """Press strips by one holder.

    c: closing compliance (m, m) [m/N] of each strip (`one_strip`), or with what each adds to it, as wear does; x: (m,)
    [m]; weight: nodal areas (m,) [m2] of one strip; offsets: y (s,) [m] (`strip_offsets`); gap: (m,) or (s, m) [m];
    roll [rad] > 0 opens the gap at +y. Controls: `load` [N] of all strips with `rotation` [rad] held (already in the
    gap, only reported); `load` and `moment` sum f x [N m] with the rotation free, or held by the holder's `spring`
    [N m/rad] from `rotation` on; `approach` [m] with the rotation held; beside a load `lateral` sum f y [N m] with the
    roll free, counted from `roll` on. skin: None (bare), or a law of `skin_laws`; rigid bodies (c = 0) need a skin.
    Where nothing touches the outcome is no_contact.

    PatchfemError for other controls, a moment that no pressure carries, an exponential law without reference under an
    approach; NotConverged above a residual of 1e-9.
    """
    offsets, c = (
        np.atleast_1d(np.asarray(offsets, float)),
        c if isinstance(c, Slices) else Slices(c),
    )
    gap = np.broadcast_to(gap, (offsets.size, x.size)) + roll * offsets[:, None]
    _refuse(skin, x, gap, load, None if spring and load is not None else moment, approach)
    _refuse_roll(offsets, load, lateral)
    if isinstance(skin, ExponentialSkin) and skin.reference is None and load:
        skin = replace(skin, reference=load / (weight.sum() * offsets.size))
    if load == 0:
        rest = (gap.min(), rotation, roll)
        return _state(skin, weight, x, offsets, np.zeros(gap.shape), gap - gap.min(), rest, 0, {})
    motions = holder_motions(
        x, offsets, moment is not None and load is not None, lateral is not None, spring
    )
    with one_thread():
        if load is None:
            force, s, count = by_strip(skin, softer(skin, c, weight), x, weight, gap - approach)
            motion = np.array([approach])
        else:
            target = np.array([value for value in (load, moment, lateral) if value is not None])
            force, s, motion, count = loaded(skin, c, x, weight, gap, motions, target)
    delta, free = (
        float(motion[0]),
        -float(motion[1]) if motion.size > 1 and moment is not None else 0.0,
    )
    rolled = -float(motion[-1]) if lateral is not None else 0.0
    gap = gap + rolled * offsets[:, None]
    checks = residuals(skin, c, x, weight, gap, force, delta, free, load, moment, spring)
    if lateral is not None:
        off = abs(force.sum(axis=1) @ offsets - lateral) / (load * np.ptp(offsets))
        checks = MappingProxyType({**checks, "roll_balance": float(off)})
    _refuse_loose(
        skin,
        force,
        checks,
        free_rotation=motion.size > 1 and moment is not None and spring == 0,
        free_roll=lateral is not None,
    )
    opening = gap + free * x - delta + c.bends(force) if s is None else s
    if skin is None:
        opening = np.where(force > 0, 0.0, np.maximum(opening, 0.0))
    elif isinstance(skin, LinearSkin):
        opening = np.where(force > 0, -force / (skin.k * weight), np.maximum(opening, 0.0))
    return _state(
        skin,
        weight,
        x,
        offsets,
        force,
        opening,
        (delta, rotation + free, roll + rolled),
        count,
        checks,
    )


def _refuse(skin, x, gap, load, moment, approach) -> None:
    """Raise PatchfemError for controls without an answer."""
    if (load is None) == (approach is None) or (moment is not None and load is None):
        raise PatchfemError("contact: give a load, a load and a moment, or an approach")
    if not (
        np.isfinite(gap).all()
        and np.isfinite(load if approach is None else approach)
        and (load or 0.0) >= 0
    ):
        raise PatchfemError(
            "contact.load: the load must be >= 0, and load, approach and gap must be finite"
        )
    if load and moment is not None and not abs(moment) < load * np.ptp(x) / 2:
        raise PatchfemError(
            f"contact.load_line: the load line lies {moment / load:.6g} m from the middle, outside the "
            f"half length {np.ptp(x) / 2:.6g} m: the piece tips over"
        )
    if load is None and isinstance(skin, ExponentialSkin) and skin.reference is None:
        raise PatchfemError(
            'contact.approach with contact.asperities.law = "exponential": this law has no first touch '
            "from which an approach could be measured; give contact.load, or another law"
        )


def _refuse_roll(offsets, load, lateral) -> None:
    """PatchfemError where a free roll has no load, no second strip or no place for its moment."""
    if lateral is None:
        return
    if load is None or offsets.size < 2:
        raise PatchfemError(
            "contact.strips.roll: a holder that is free to rotate about x needs a load and at least "
            "two strips"
        )
    if load > 0 and not offsets.min() < lateral / load < offsets.max():
        raise PatchfemError(
            f"contact.strips.offset: the load line at {lateral / load:.6g} m lies beyond the middle of "
            f"the outermost strips at {offsets.max():.6g} m, where no pressure can balance it; raise "
            "contact.strips.count or lower the offset"
        )


def _refuse_loose(skin, force, checks, free_rotation: bool, free_roll: bool) -> None:
    """NotConverged where a free motion is not determined by what bears, or a residual is too large."""
    bears = force > 1e-12 * force.max()  # less is round-off
    if free_rotation and not smooth(skin) and bears.any(axis=0).sum() < 2:
        raise NotConverged(
            "contact.strips: the nodes that touch do not determine the rotation of the piece; lower "
            "contact.element_size or set contact.holder.rotational_stiffness"
        )
    if free_roll and not smooth(skin) and bears.any(axis=1).sum() < 2:
        raise NotConverged(
            "contact.strips: the nodes that touch do not determine the rotation about x; raise "
            "contact.strips.count or prescribe contact.strips.roll"
        )
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        at, cure = (
            (
                "asperities",
                "make the rough layer softer (raise the decay length or the height deviation), or "
                "leave the layer out",
            )
            if smooth(skin)
            else ("strips", "lower contact.strips.roll or raise the load")
        )
        raise NotConverged(
            f"contact.{at}: the residual {worst} = {checks[worst]:.2e} exceeds {LIMIT:.0e}; {cure}"
        )


def _state(skin, weight, x, offsets, force, opening, motion, count, checks) -> StripsState:
    load, moment, roll_moment = (
        float(force.sum()),
        float((force @ x).sum()),
        float(force.sum(axis=1) @ offsets),
    )
    touch = load > 0
    stiffness = (
        None
        if skin is None
        else frozen_array(skin.stiffness(opening) * (force > 0) if touch else force)
    )
    share = float(((force > 0) * weight).sum() / (weight.sum() * offsets.size))
    centre = (moment / load, roll_moment / load) if touch else (0.0, 0.0)
    return StripsState(
        frozen_array(force),
        frozen_array(force / weight),
        frozen_array(opening),
        stiffness,
        frozen_array(offsets),
        *map(float, motion),
        load,
        moment,
        roll_moment,
        *centre,
        share,
        Outcome.DONE if touch else Outcome.NO_CONTACT,
        count,
        MappingProxyType(dict(checks)),
    )


def strips_tangent(
    c: np.ndarray, weight: np.ndarray, state: StripsState, ratio: float = 1.0
) -> float:
    """Stiffness [N/m] of all strips for one common rigid motion, skin and pieces in series.

    c: (m, m) [m/N] and weight: (m,) [m2] of one strip. With the normal compliance it is dN/d(approach) at fixed
    rotation and roll; with the tangential one dT/d(slide) in stick without yaw. ratio: k_t/k_n of the skin, inf where
    it is rigid in shear.
    """
    if not state.load:
        return 0.0
    alone, c = closing_alone(weight.size, len(state.offsets)), Slices(c)
    with one_thread():
        if state.stiffness is None or np.isinf(ratio):
            return float(bare_parts(c, alone, state.force > 0)[1][0, 0])
        slope = ratio * weight * state.stiffness
        return float(skin_parts(c, alone, slope, slope)[1][0, 0])
