"""The static patch of a scene: the pieces condensed to their interface, the gap between them, and what presses them."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from scipy.optimize import brentq

from ...contact.unilateral import press, press_by
from ...core import Compliance, Pressure, frozen_array
from ...model.gap import gap_of
from ...model.load import moment_of, spring_of
from ...slip.shear_modes import SHEAR_MODES
from .condensed import Pair, condensed

RIPPLE = 1e-2  # expected ripple of the pressure on pieces whose nodes do not match, from which it is said


@dataclass(frozen=True, eq=False, slots=True)
class Patch:
    """One solved patch; forces, areas and stiffnesses are of all pairs together.

    pieces: compliance of the pieces and of their skin, linearised at the operating point where the skin is smooth;
    giving: (m, m) [m/N] the tangential part that the scene names: of the skin, the pieces' with [contact.shear], the
    same on every entry of a holder's spring; gap
    (m,) [m] of the unloaded surfaces; skin: SkinState of a smooth skin, else None; strips: StripsState of a patch in
    strips, whose means over the width then stand in `pressure`, else None; tangential_ratio: k_t/k_n of the skin, None
    where it is rigid in shear; notes: sentences for the warnings.
    """

    pair: Pair
    pieces: Compliance
    giving: np.ndarray
    gap: np.ndarray
    pressure: Pressure
    skin: object
    strips: object
    tangential_ratio: float | None
    notes: tuple
    seconds: dict

    @property
    def x(self) -> np.ndarray:
        """(m,) places of the interface nodes [m]."""
        return self.pieces.interface.x

    @property
    def active(self) -> np.ndarray:
        """(m,) bool: the contact set."""
        return self.pressure.sigma_n > 0


def solve(scene, grid, upper_grid=None, fresh: bool = False) -> Patch:
    """Assemble, condense and press the pieces of a scene: bodies of `bodies_of`, the upper None where it is alike."""
    return pressed(scene, condensed(scene, grid, upper_grid, fresh))


def pressed(scene, pair: Pair, worn=None) -> Patch:
    """The pair under the shapes, the load and the holder of a scene; the pair serves any number of them. worn (m,) [m]:
    depth that wear has added to the gap."""
    contact, pieces = scene.contact, pair.compliance
    gap, notes, seconds = gap_of(scene, pieces.interface.x)
    gap = gap + pair.rise if worn is None else gap + pair.rise + worn
    angle = contact.tilt.angle if contact.tilt is not None and contact.tilt.on == "upper" else 0.0
    begin = perf_counter()
    turns = contact.load_line is not None or spring_of(contact) > 0
    how = _closed_by if contact.approach is not None and turns else _under
    pieces, pressure, skin, strips = how(contact, pieces, gap, angle)
    seconds["press"] = perf_counter() - begin
    giving = pieces.tangential
    if contact.shear is None:
        giving = frozen_array(giving - pair.compliance.tangential)
    if contact.holder is not None and contact.holder.tangential_stiffness:
        giving = frozen_array(giving + 1 / contact.holder.tangential_stiffness)
    ratio = contact.asperities.tangential_ratio if contact.asperities is not None else None
    if strips is not None:
        notes = (*notes, strips.note)
    if pair.joint is not None and pair.joint.ripple > RIPPLE:
        notes = (*notes, f"contact.mesh: {pair.joint.reason}")
    return Patch(pair, pieces, giving, frozen_array(gap), pressure, skin, strips, ratio, notes, pair.seconds | seconds)


def _under(contact, pieces: Compliance, gap, angle: float) -> tuple:
    """(Compliance with its skin, Pressure, skin, strips) under the load, or the approach with the rotation held."""
    strips = skin = None
    if contact.strips is not None:
        from .strips import in_strips

        pieces, pressure, skin, strips = in_strips(contact, pieces, gap, angle, moment_of(contact), spring_of(contact))
    elif contact.asperities is not None and contact.asperities.law != "linear":
        from .skin import behind_skin

        pieces, pressure, skin = behind_skin(contact, pieces, gap, angle, moment_of(contact), spring_of(contact))
    else:
        if contact.asperities is not None:
            pieces = with_linear_skin(contact.asperities, pieces)
        if contact.approach is not None:
            pressure = press_by(pieces, gap, contact.approach.distance, angle)
        else:
            pressure = press(pieces, gap, contact.load, moment_of(contact), angle, spring=spring_of(contact))
    return pieces, pressure, skin, strips


def _closed_by(contact, pieces: Compliance, gap, angle: float) -> tuple:
    """As `_under` for an approach of a piece that turns: the load at which it is reached, since the approach grows with
    the load. Where a load a millionth of what flat pieces would take is too much, nothing touches."""
    distance, tried = contact.approach.distance, []

    def short(log_load: float) -> float:
        loaded = contact.model_copy(update={"load": float(np.exp(log_load)), "approach": None})
        tried.append(_under(loaded, pieces, gap, angle))
        return tried[-1][1].approach - distance

    top = np.log(max(distance, np.ptp(gap), 1e-12) / pieces.normal.mean())
    least = _least_load(contact, np.ptp(pieces.interface.x))
    low = top = max(top, np.log(2 * least) if least > 0 else top)
    bottom = max(top - np.log(1e6), np.log(least * (1 + 1e-9)) if least > 0 else -np.inf)
    for _ in range(60):
        if short(top) >= 0:
            break
        low, top = top, top + 2
    while low == top or short(low) >= 0:
        if low == bottom:
            apart = contact.model_copy(update={"load": 0.0, "approach": None, "load_line": None, "holder": None})
            pieces, still, skin, strips = _under(apart, pieces, gap, angle)
            open_ = frozen_array(gap - min(distance, gap.min()))
            return pieces, replace(still, gap=open_, approach=distance), skin, strips
        low, top = max(low - 2, bottom), low
    brentq(short, low, top, xtol=1e-13, rtol=1e-14)
    return tried[-1]


def _least_load(contact, length: float) -> float:
    """Load [N] below which a free piece tips over under its moment."""
    line = contact.load_line
    return 2 * abs(line.moment) / length if line is not None and line.moment and spring_of(contact) == 0 else 0.0


def with_linear_skin(asperities, pieces: Compliance) -> Compliance:
    """The pieces with the diagonal compliance of a linear skin in series; a skin without a tangential ratio is rigid in
    shear."""
    crush = 1 / (asperities.normal_stiffness * pieces.interface.weight)
    ratio = asperities.tangential_ratio
    tangential = pieces.tangential + np.diag(crush / ratio) if ratio is not None else pieces.tangential
    return Compliance(pieces.interface, frozen_array(pieces.normal + np.diag(crush)), frozen_array(tangential))


def shear_of(patch: Patch, law, count: int | None, tolerance: float):
    """ShearModes of the pressed patch for a bond law: `count` of them, or as many as the tolerance asks for."""
    from ...slip.shear_modes import enough_modes, shear_modes

    limit = law.static * patch.pressure.sigma_n * patch.pieces.interface.weight
    weakening = 1 / law.ratio if law.ratio > 0 else np.inf
    if count is not None:
        return shear_modes(patch.giving, limit, law.length, count, weakening)
    return enough_modes(patch.giving, limit, law.length, SHEAR_MODES, 0.1 * tolerance, weakening)
