"""Partial slip under a tangential force: Coulomb friction node by node on the condensed interface, with its history.

The state of a node is the slip s it has made (upper - lower, Mindlin's memory). Under new loads, with the slide q of
the holders, normal forces f, shear forces t (resistance to slip > 0) and the gap g (tilt included),

    0 <= f, w = g + theta x - delta + C_nn f + C_nt t >= 0, f.w = 0;
    e = q - C_tt t - C_nt^T f - s, |t| <= mu f, e.t >= 0, e = 0 where |t| < mu f; s := s + e.

An open node follows the pieces and so forgets its slip. An increment is exact while no node enters or leaves the
contact and no slip zone shrinks within it; that holds for any stroke at constant load and gap.
"""

from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np
from slip_sets import Kept, bounded_shear, press_forces
from slip_unlike import coupled_forces

from patchfem.contact.unilateral import residuals, undetermined
from patchfem.core import Compliance, NotConverged, PatchfemError, frozen_array
from patchfem.elasticity.lapack import one_thread

LIMIT = 1e-10  # largest relative residual that still counts as solved
EVEN = 1e-12  # share of mu N within which a shear load counts as all that friction allows


@dataclass(frozen=True, eq=False, slots=True)
class Operators:
    """Compliance of a pair for normal and shear forces.

    x: (m,) [m]; normal, tangential: (m, m) [m/N] as in `core.Compliance`; coupling: (m, m) [m/N], closing per shear
    force, None for alike pieces; kept: inverses on the last contact set, which no answer depends on.
    """

    x: np.ndarray
    normal: np.ndarray
    tangential: np.ndarray
    coupling: np.ndarray | None = None
    kept: dict = field(default_factory=dict, repr=False)

    def inverse(self, name: str) -> Kept:
        """The kept inverse of one operator, made on the first call.

        name: "normal" or "tangential" (m, m), or "both" (2m, 2m): normal forces before shear forces, coupled.
        """
        if name not in self.kept:
            full = getattr(self, name) if name != "both" else \
                np.block([[self.normal, self.coupling], [self.coupling.T, self.tangential]])
            self.kept[name] = Kept(full)
        return self.kept[name]


def operators_of(pieces: Compliance, coupling: np.ndarray | None = None) -> Operators:
    """Operators of a pair; a coupling (m, m) [m/N] that is zero throughout is dropped.

    PatchfemError for a shape or a value that cannot be.
    """
    if coupling is not None:
        coupling = frozen_array(coupling)
        if coupling.shape != pieces.normal.shape or not np.isfinite(coupling).all():
            raise PatchfemError(f"contact: the coupling must be {pieces.normal.shape} and finite, has {coupling.shape}")
        coupling = coupling if coupling.any() else None
    return Operators(pieces.interface.x, pieces.normal, pieces.tangential, coupling)


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """Loads and motions at the end of one increment.

    load [N], or approach [m]; moment [N m] about the middle: the upper piece is then free to rotate, against spring [N
    m/rad]; shear [N] or slide [m]; gap: (m,) [m] with its tilt, None: the last one.
    """

    load: float | None = None
    approach: float | None = None
    moment: float | None = None
    spring: float = 0.0
    shear: float | None = None
    slide: float | None = None
    gap: np.ndarray | None = None


@dataclass(frozen=True, eq=False, slots=True)
class SlipState:
    """A solved state of partial slip.

    normal_force, shear_force: (m,) [N]; slip: (m,) [m] made so far; slipping: (m,) -1, 0 or 1 in the last increment;
    gap: (m,) [m] as given; approach, slide [m] and rotation [rad] of the upper holder beyond the gap; friction [1];
    dissipated [J] since the start; iterations: sets tried; residuals: relative, each <= 1e-10.
    """

    normal_force: np.ndarray
    shear_force: np.ndarray
    slip: np.ndarray
    slipping: np.ndarray
    gap: np.ndarray
    approach: float
    rotation: float
    slide: float
    friction: float
    dissipated: float
    iterations: int
    residuals: MappingProxyType

    @property
    def load(self) -> float:
        """Resultant of the normal forces [N], compression > 0."""
        return float(self.normal_force.sum())

    @property
    def shear(self) -> float:
        """Resultant of the shear forces [N], resistance to slip > 0."""
        return float(self.shear_force.sum())

    @property
    def active(self) -> np.ndarray:
        """Contact set (m,) bool: the nodes with a normal force above zero."""
        return self.normal_force > 0


def start(operators: Operators, gap: np.ndarray, slide: float = 0.0) -> SlipState:
    """State of pieces at rest before any load and slip, touching at their nearest node without a force.

    gap: (m,) [m] with its tilt; slide [m] of the holders at the start. PatchfemError for a gap of another shape or
    values that are not finite.
    """
    gap = np.asarray(gap, float)
    if gap.shape != operators.x.shape or not (np.isfinite(gap).all() and np.isfinite(slide)):
        raise PatchfemError(f"contact: the gap must be {operators.x.shape} finite heights and the slide finite")
    zero = np.zeros(gap.size)
    return _state(zero, zero, np.full(gap.size, slide), zero, gap, float(gap.min()), 0.0, slide, 0.0, 0.0, 0, {})


def _state(normal, shear, slip, sign, gap, approach, rotation, slide, friction, dissipated, count, checks) -> SlipState:
    return SlipState(frozen_array(normal), frozen_array(shear), frozen_array(slip), frozen_array(sign, np.int8),
                     frozen_array(gap), float(approach), float(rotation), float(slide), float(friction),
                     float(dissipated), count, MappingProxyType(checks))


def advance(state: SlipState, operators: Operators, step: Step, friction: float) -> SlipState:
    """Advance the state by one increment to the loads of `step`, with the coefficient of friction mu >= 0.

    PatchfemError for a step without a meaning and, under `shear`, for gross slip, |shear| > mu N; at mu N itself the
    slide is the least with every node slipping. NotConverged where a residual exceeds 1e-10 or, for unlike pieces,
    where mu times the coupling allows several answers.
    """
    _meant(step, operators, friction)
    gap = state.gap if step.gap is None else np.asarray(step.gap, float)
    if step.load == 0 or (step.approach is not None and step.approach <= gap.min()):
        return _parted(state, gap, step, friction)
    if step.load is not None:
        _held(step.shear, friction * step.load)
    with one_thread():
        solve = _alike if operators.coupling is None or friction == 0 else _unlike
        normal, motion, shear, slide, sign, count = solve(state, operators, gap, step, friction)
    approach = float(motion[0]) if step.approach is None else step.approach
    rotation = 0.0 if step.moment is None else -float(motion[1])
    bent = slide - operators.tangential @ shear
    if operators.coupling is not None:
        bent -= operators.coupling.T @ normal
    made = state.slip + sign * np.maximum(sign * (bent - state.slip), 0.0)
    slip = np.where((normal > 0) & (friction > 0), made, bent)
    checks = slip_residuals(operators, state.slip, gap, normal, shear, approach, rotation, slide, step, friction)
    if not all(value <= LIMIT for value in checks.values()):  # NaN must not pass
        worst = max(checks, key=lambda name: (checks[name] != checks[name], checks[name]))
        raise NotConverged(f"contact: slip: {worst} {checks[worst]:.2e} exceeds {LIMIT:.0e}: take smaller steps")
    lost = float(shear @ (slip - state.slip))
    return _state(normal, shear, slip, sign, gap, approach, rotation, slide, friction, state.dissipated + lost, count,
                  checks)


def _meant(step: Step, operators: Operators, friction: float) -> None:
    named = [step.load, step.approach, step.moment, step.spring, step.shear, step.slide]
    if (step.load is None) == (step.approach is None) or (step.shear is None) == (step.slide is None):
        raise PatchfemError("contact: a step needs load or approach, and shear or slide")
    if step.moment is not None and step.load is None:
        raise PatchfemError("contact.load_line: a moment needs a load, not an approach")
    if not all(np.isfinite(v) for v in named if v is not None) or not np.isfinite(friction):
        raise PatchfemError("contact: the loads and motions of a step and friction.static must be finite")
    if friction < 0 or (step.load is not None and step.load < 0) or step.spring < 0:
        raise PatchfemError("contact: friction.static, contact.load and the spring of the holder must be >= 0")
    if step.gap is not None and (np.shape(step.gap) != operators.x.shape or not np.isfinite(step.gap).all()):
        raise PatchfemError(f"contact: the gap must be {operators.x.shape} finite heights")
    if step.moment is not None and step.spring == 0 and step.load > 0 and \
            not abs(step.moment) < step.load * np.ptp(operators.x) / 2:
        raise PatchfemError(f"contact.load_line: the load line lies {step.moment / step.load:.6g} m from the middle, "
                            "outside the patch: the piece tips over")


def _held(shear: float | None, most: float) -> None:
    if shear is not None and abs(shear) > most * (1 + EVEN):
        raise PatchfemError(f"contact: gross slip: the shear force {shear:.9g} N exceeds friction times load, "
                            f"{most:.9g} N; lower it or prescribe the slide")


def _parted(state, gap, step, friction) -> SlipState:
    """State without contact: nothing is carried and every node follows the holder."""
    _held(step.shear, 0.0)
    slide = state.slide if step.slide is None else step.slide
    approach = float(gap.min()) if step.approach is None else step.approach
    zero = np.zeros(gap.size)
    return _state(zero, zero, np.full(gap.size, slide), zero, gap, approach, 0.0, slide, friction, state.dissipated, 0,
                  {})


def _target(gap, step) -> tuple:
    if step.load is None:
        return gap - step.approach, np.zeros(0)
    return gap, np.array([step.load] if step.moment is None else [step.load, step.moment])


def _alike(state, operators, gap, step, friction) -> tuple:
    """State of alike pieces: pressure first, then the shear under its limits."""
    lowered, target = _target(gap, step)
    try:
        normal, motion, count = press_forces(operators.inverse("normal"), operators.x, lowered, target, state.active,
                                             step.spring)
    except np.linalg.LinAlgError:
        raise NotConverged(undetermined(operators.normal, step.moment is not None, step.spring)) from None
    index = np.flatnonzero(normal > 0)
    limit, shear = friction * normal[index], np.zeros(normal.size)
    sign = np.zeros(normal.size, np.int8)
    most = limit.sum()
    _held(step.shear, most)
    if step.shear is not None and abs(step.shear) >= most * (1 - EVEN):
        way = np.sign(step.shear)
        shear[index] = way * limit
        at = (state.slip + operators.tangential @ shear)[index]
        sign[index] = way
        return normal, motion, shear, float(way * np.max(way * at)) if way else state.slide, sign, count
    if most == 0:
        return normal, motion, shear, step.slide, sign, count
    found = bounded_shear(operators.inverse("tangential"), index, state.slip[index], limit, state.slipping[index],
                          step.shear, step.slide)
    shear[index], slide, sign[index] = found[:3]
    return normal, motion, shear, slide, sign, count + found[3]


def _unlike(state, operators, gap, step, friction) -> tuple:
    x, last = operators.x, _target(gap, step)
    if step.load is None:
        first = state.gap - state.approach, np.zeros(0)
    else:
        moment = state.normal_force @ x - step.spring * state.rotation
        first = state.gap, np.array([state.load, moment])[:last[1].size]

    def leg(share):
        gap, target = (b if share == 1 else a + share * (b - a) for a, b in zip(first, last, strict=True))
        if step.shear is None:
            return gap, target, None, state.slide + share * (step.slide - state.slide)
        return gap, target, state.shear + share * (step.shear - state.shear), None

    normal, shear, motion, slide, sign, count = coupled_forces(
        operators.inverse("both"), x, leg, state.slip, friction, step.spring, state.active, state.slipping)
    if step.load is None:
        _held(step.shear, friction * normal.sum())
    return normal, motion, shear, slide, sign, count


def slip_residuals(operators: Operators, slip, gap, normal, shear, approach: float, rotation: float, slide: float,
                   step: Step, friction: float) -> dict:
    """Relative residuals of an increment from the slip (m,) before it, by the definition alone.

    Keys: those of `unilateral.residuals`; shear_balance; cone (|t| over mu f); stick (motion e of nodes below the cone)
    and direction (e against t on the cone), both relative to the slide that friction can bend in.
    """
    x, touching = operators.x, normal > 0
    bent, made = operators.tangential @ shear, slip
    lifted = gap
    if operators.coupling is not None:
        made, lifted = slip + operators.coupling.T @ normal, gap + operators.coupling @ shear
    load = float(normal.sum()) if step.load is None else step.load
    out = dict(residuals(operators.normal, x, lifted, normal, approach, rotation, load, step.moment, step.spring))
    most, limit = friction * load, friction * normal
    moved = (slide - bent - made)[touching]
    depth = np.abs(operators.tangential @ limit).max() + np.ptp(made[touching]) + np.abs(moved).max()
    if step.shear is not None:
        out["shear_balance"] = abs(shear.sum() - step.shear) / (most or 1.0)
    out["cone"] = max(0.0, np.max(np.abs(shear) - limit)) / (limit.max() or 1.0)
    stuck = np.abs(shear[touching]) < limit[touching] * (1 - 1e-9)  # within 1e-9 of the cone a node may do either
    out["stick"] = np.abs(moved[stuck]).max(initial=0.0) / (depth or 1.0)
    out["direction"] = np.max(-np.sign(shear[touching]) * moved, where=~stuck, initial=0.0) / (depth or 1.0)
    return {key: float(value) for key, value in out.items()}
