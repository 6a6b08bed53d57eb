"""Unilateral contact of the condensed interface: forces, rigid motion, and an independent check of both.

Find nodal forces f >= 0 with w = g + theta x - delta + C f >= 0 and f . w = 0, under a given approach delta, or a given
load sum f = N with the rotation held (already inside g), free under a moment, sum f x = M, or against the holder's
spring, sum f x = M + K theta. The primal-dual active set of `active_set` finds them; where a set comes back, conjugate
gradients and then a finite descent (`gradients`) take over. Every answer is checked again by `residuals`, which shares
no intermediate result with the solver.
"""

from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from ..core import Compliance, NotConverged, Outcome, PatchfemError, Pressure, frozen_array, say
from ..elasticity.lapack import one_thread
from . import gradients
from .active_set import (
    ROUND,
    ContactProblem,
    Found,
    Operator,
    factor,
    first_set,
    flaw,
    rest,
    settle,
)

LIMIT = 1e-9  # largest relative residual of a skin that still counts as solved
SOLVED = 1e-12  # of a contact without a skin
INDEFINITE = (
    "contact: the compliance of the pieces is not positive definite to working precision; raise "
    "contact.element_size, bring the stiffnesses of coating and substrate closer together, or check the "
    "cells of contact.mesh"
)
LEAST = 1e-200  # N or m; below it the products of the check lose their digits


class Solved(NamedTuple):
    """Answer of a contact problem.

    force: (m,) [N]; closing [m] beyond the first touch of the gap as given; theta: rotation [rad]; stiffness:
    dN/d(delta) at held rotation [N/m], 0 under an approach; active: (m,) nodes that touch; iterations: contact sets
    tried.
    """

    force: np.ndarray
    closing: float
    theta: float
    stiffness: float
    active: np.ndarray
    iterations: int


def _fallen_back(operator: Operator, ask: ContactProblem, limit: int) -> tuple:
    """(Found, iterations) by slower methods, for problems whose contact sets came back.

    In turn: the active set from all nodes, the active set from where conjugate gradients end, a finite descent.
    """
    found, _, first = settle(operator, ask, np.ones(ask.x.size, bool), limit)
    if found is not None and flaw(found) <= SOLVED:
        return found, first
    force, second = gradients.gradients(operator, ask)
    # less is what the gradients did not yet clear
    found, _, third = settle(operator, ask, force > 1e-9 * force.max(), limit)
    if found is not None and flaw(found) <= SOLVED:
        return found, first + second + third
    found, fourth = gradients.descend(operator, ask, force)
    return found, first + second + third + fourth


def _balanced_on_one(operator: Operator, ask: ContactProblem, lean: float) -> Found | None:
    """The answer where one node under the load line carries the whole load and no other touches; None where none does.

    Of the rotations that leave the other nodes open the middle one is taken, or none where that is among them. lean
    [rad]: rotation that is already in the gap.
    """
    line = ask.moment / ask.load
    k = int(np.argmin(np.abs(ask.x - line)))
    if abs(ask.x[k] - line) > 1e-15 * np.ptp(ask.x):  # a line beside the node needs a second one
        return None
    column = operator.c[:, k] * ask.load
    height, arm = ask.gap - ask.gap[k] + column - column[k], ask.x - ask.x[k]
    noise = ROUND * (np.abs(ask.gap) + abs(column[k]))
    with np.errstate(divide="ignore", invalid="ignore"):
        bound = -(height + noise) / arm
    low, high = bound[arm > 0].max(initial=-np.inf), bound[arm < 0].min(initial=np.inf)
    if not low <= high:
        return None
    theta = -lean if low <= -lean <= high else (low + high) / 2
    force = np.where(np.arange(ask.x.size) == k, ask.load, 0.0)
    opening = height + theta * arm
    return Found(
        force,
        opening,
        np.abs(height) + abs(column[k]) + np.abs(theta * arm),
        float(ask.gap[k] + theta * ask.x[k] + column[k]),
        float(theta),
        float(1 / operator.c[k, k]),
    )


def solve(
    operator: Operator, ask: ContactProblem, start: np.ndarray | None = None, limit: int = 100
) -> Solved:
    """Forces and rigid motion of a contact problem.

    start: (m,) contact set of a neighbouring problem. limit: iterations of one active set. NotConverged when active
    set, conjugate gradients and descent all miss; LinAlgError for a compliance that is not positive definite.
    """
    lean, low = 0.0, None
    if ask.load is not None:
        gap = ask.gap - ask.gap.min()
        if ask.moment is not None:
            lean = rest(ask.x, gap, ask.load, ask.moment, ask.spring)
            gap = gap + lean * ask.x
        low = gap.min()
        moment = None if ask.moment is None else ask.moment + ask.spring * lean
        ask = ask._replace(gap=gap - low, moment=moment)
    found = _balanced_on_one(operator, ask, lean) if ask.least == 2 else None
    count = 0
    if found is None:
        if start is None or np.count_nonzero(start) < ask.least:
            start = first_set(operator, ask)
        found, _, count = settle(operator, ask, start, limit)
        if found is None or not flaw(found) <= SOLVED:
            found, more = _fallen_back(operator, ask, limit)
            count += more
    closing = 0.0 if low is None else float(found.closing + low)
    return Solved(found.force, closing, found.theta + lean, found.stiffness, found.force > 0, count)


def solve_forces(c, x, gap, target, start=None, limit: int = 100, spring: float = 0.0) -> tuple:
    """Nodal forces (m,) [N], rigid motions and iterations of a contact problem given as plain arrays.

    c: (m, m) [m/N]; x: (m,), gap: (m,) [m]; target: () with the approach inside the gap, (N,) or (N, M); spring: [N
    m/rad] of the holder; start: (m,) contact set of a neighbouring problem. The rigid motions are (), (delta,) or
    (delta, -theta). NotConverged when both the active set and its fallbacks miss the complementarity.
    """
    load, moment = (*map(float, target), None, None)[:2]
    out = solve(Operator(c), ContactProblem(x, gap, load, moment, spring), start, limit)
    motion = (gap.min() + out.closing, -out.theta) if target.size else ()
    return out.force, np.array(motion[: target.size]), out.iterations


def residuals(
    c,
    x,
    gap,
    force,
    delta: float,
    theta: float,
    load: float,
    moment: float | None = None,
    spring: float = 0.0,
) -> MappingProxyType:
    """Relative residuals of a contact answer, recomputed from its definition alone.

    Keys: force_balance, moment_balance, penetration, tension, complementarity. An opening is measured at each node in
    the size of the terms it is the sum of, so a spike of the gap elsewhere hides nothing.
    """
    opening = gap + theta * x - delta + c @ force
    span = slice(*np.flatnonzero(force)[[0, -1]] + [0, 1])
    depth = np.abs(gap) + np.abs(theta * x) + abs(delta) + np.abs(c[:, span]) @ np.abs(force[span])
    share = opening / np.where(depth > 0, depth, 1.0)
    out = {
        "force_balance": abs(force.sum() - load) / load,
        "penetration": max(0.0, -share.min()),
        "tension": max(0.0, -force.min()) / load,
        "complementarity": np.abs(force * share).sum() / load,
    }
    if moment is not None:
        out["moment_balance"] = abs(force @ x - moment - spring * theta) / (
            load * np.ptp(x) + abs(spring * theta)
        )
    return MappingProxyType({key: float(value) for key, value in out.items()})


def refuse(x, gap, load: float, moment: float | None, spring: float) -> None:
    """Raise PatchfemError, with the key of the scene, for a contact problem that has no answer.

    Refused: a load [N] below zero, too small or not finite, a gap (m,) [m] that is not finite, a moment [N m] or a
    spring [N m/rad] that is not finite, and a load line outside the patch where no spring holds it.
    """
    if not (0 <= load <= 1 / LEAST and np.isfinite(gap).all()):
        raise PatchfemError(
            f"contact.load: the load ({load:.6g} N) must be >= 0 and the gap finite"
        )
    if 0 < load < LEAST:
        raise PatchfemError(
            f"contact.load: {load:.3g} N is too small to compute with; give 0 (touching without load) "
            f"or at least {LEAST:.0e} N"
        )
    if moment is not None and not (np.isfinite(moment) and np.isfinite(spring) and spring >= 0):
        raise PatchfemError(
            f"contact.load_line: the moment ({moment:.6g} N m) must be finite and the spring of the "
            f"holder ({spring:.6g} N m/rad) >= 0"
        )
    middle, half = (x[0] + x[-1]) / 2, np.ptp(x) / 2
    if (
        load
        and moment is not None
        and spring == 0
        and not abs(moment / load - middle) < half * (1 - 1e-13)
    ):
        raise PatchfemError(
            f"contact.load_line: the load line lies {moment / load:.6g} m from the middle, outside the "
            f"half length {half:.6g} m: the piece tips over"
        )


def press(
    pieces: Compliance,
    gap: np.ndarray,
    load: float,
    moment: float | None = None,
    rotation: float = 0.0,
    start: np.ndarray | None = None,
    spring: float = 0.0,
) -> Pressure:
    """Static pressure on the gap (m,) [m] under `load` [N] of all pairs.

    With `moment` [N m] of the load about the middle the upper piece is free to rotate, or held by the `spring` [N
    m/rad] of its holder from `rotation` [rad] on. Without it `rotation` is held; it is already in `gap`, so it is only
    reported. start: (m,) contact set of a neighbouring solve. Zero load gives the outcome no_contact.

    PatchfemError for a moment that no pressure can carry, a load that is negative or below 1e-200 N, or a gap that is
    not finite; NotConverged when a residual exceeds 1e-12.
    """
    refuse(pieces.interface.x, gap, load, moment, spring)
    if load == 0:
        return _apart(gap, float(gap.min()), rotation)
    ask = ContactProblem(
        pieces.interface.x, gap, float(load), None if moment is None else float(moment), spring
    )
    return _pressed(pieces, ask, start, float(gap.min()), rotation)


def press_by(
    pieces: Compliance,
    gap: np.ndarray,
    approach: float,
    rotation: float = 0.0,
    start: np.ndarray | None = None,
) -> Pressure:
    """Static pressure on the gap (m,) [m] at a given `approach` [m] of the holders, the rotation held.

    Outcome no_contact where nothing touches. `rotation` [rad] is already in the gap; start as in `press`. PatchfemError
    for values that are not finite, or an overlap too small to compute with.
    """
    if not (np.isfinite(approach) and np.isfinite(gap).all()):
        raise PatchfemError("contact.approach: the distance and the gap must be finite")
    if approach <= gap.min():
        return _apart(gap, approach, rotation)
    if approach - gap.min() < LEAST:
        raise PatchfemError(
            f"contact.approach: an overlap of {say(approach - gap.min(), 3)} is too small to compute "
            f"with; for pieces that touch without load give {gap.min():.6g} m"
        )
    return _pressed(
        pieces, ContactProblem(pieces.interface.x, gap - approach), start, approach, rotation
    )


def _apart(gap, approach: float, rotation: float) -> Pressure:
    return Pressure(
        frozen_array(np.zeros(gap.size)),
        frozen_array(gap - approach),
        approach,
        rotation,
        0.0,
        0.0,
        Outcome.NO_CONTACT,
        0,
        MappingProxyType({}),
    )


def _pressed(
    pieces: Compliance, ask: ContactProblem, start, touch: float, rotation: float
) -> Pressure:
    """Solve and check a problem; gaps are counted from `touch` [m], so that a far offset costs no digits."""
    x, c, weight = pieces.interface.x, pieces.normal, pieces.interface.weight
    with one_thread():
        try:
            out = solve(Operator(c), ask, start)
        except np.linalg.LinAlgError:
            raise NotConverged(undetermined(c, ask.moment is not None, ask.spring)) from None
        opening, checks = checked(c, ask, out)
    return Pressure(
        frozen_array(out.force / weight),
        frozen_array(opening),
        float(touch + out.closing),
        float(rotation + out.theta),
        float(out.force.sum()),
        float(out.force @ x),
        Outcome.DONE,
        out.iterations,
        checks,
    )


def undetermined(c, turns: bool, spring: float) -> str:
    """Why the equations of a contact set have no answer, with the remedy that fits.

    c: compliance (m, m) [m/N] of the pieces; turns: the rotation is free; spring [N m/rad] of the holder. A held
    rotation is determined by any node in contact, so only the compliance itself can be at fault; no load mends it.
    """
    try:
        factor(np.array(c, order="C"))
    except np.linalg.LinAlgError:
        return INDEFINITE
    if not turns:
        return (
            "contact: numbers in the contact equations became too large to compute; check the units and magnitudes "
            "of load, gap and stiffnesses"
        )
    holder = "raise" if spring > 0 else "name"
    return (
        "contact: the nodes that touch do not determine the rotation; lower contact.load_line.offset (with "
        f"contact.load_line.moment: raise contact.load) or {holder} contact.holder.rotational_stiffness"
    )


def checked(c, ask: ContactProblem, out: Solved) -> tuple:
    """Openings (m,) [m] >= 0 and relative residuals of an answer; NotConverged where a residual exceeds 1e-12.

    c: compliance (m, m) [m/N]; the gap of a problem under a load is counted from first touch.
    """
    gap = ask.gap if ask.load is None else ask.gap - ask.gap.min()
    load = float(out.force.sum()) if ask.load is None else ask.load
    checks = residuals(
        c, ask.x, gap, out.force, out.closing, out.theta, load, ask.moment, ask.spring
    )
    if not all(value <= SOLVED for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(
            f"contact: the residual {worst} = {checks[worst]:.2e} exceeds {SOLVED:.0e}"
        )
    opening = np.maximum(gap + out.theta * ask.x - out.closing + c @ out.force, 0.0)
    opening[out.force > 0] = 0.0
    return opening, checks
