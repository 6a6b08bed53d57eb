"""Whether the smooth engine takes a rig, and what it costs."""

import numpy as np

from ....effects import has
from ....friction.bonds.engines import impossible
from ....friction.laws.stretch import points_element
from ....friction.protocol import Element
from ....friction.record import law_from
from ....model.model import Model
from ....structure.drive_sizes import fastest, largest, omega_of, sinusoidal, slowest
from ...effort import steps_per_cycle

PINNED = ("steps_per_cycle", "tail", "merge", "shear_modes")  # knobs of the march
STEP = 2e-6  # seconds
REPEATS = 30.0  # times of decay of the slowest mode, after which a motion is seen to repeat to its digits
MORE = 3.5  # times the steps of a march, of which more are not worth their digits: a step costs less than one of it
EASES = 9.0  # steps of a stiff law of the speed per cycle, over those of one that holds: .5 at r = 1.07, .1 at 1.26
STABLE = 3.0  # times the length over which a state of a law relaxes, in a step


def not_smooth(model: Model) -> str:
    """Why a rig that the smooth engine may take is marched rather than integrated at high order; empty where it is not.
    """
    rig, accuracy = model.rig, model.accuracy
    pinned = next((f"accuracy.{key}" for key in PINNED if getattr(accuracy, key) is not None), "")
    if pinned or accuracy.quadrature not in ("auto", "recursion"):
        return f"with {pinned or 'accuracy.quadrature'}"
    if len(rig.modes.interfaces) > 1:
        return "beside other forces"
    if model.side == "lower" and has(model.friction.law, "bonds"):
        return "under a pressure that stays"
    element = element_of(model)
    if element is None or element.sizes is None:
        return f"for law '{model.friction.law}'"
    return "in so many steps" if steps_of(model, element) > MORE * max(steps_per_cycle(model), 400) else ""


def element_of(model: Model) -> Element | None:
    """The law of the interface as compiled code takes it, None where its bonds have no state or it asks for the
    pressure behind each point."""
    f = model.friction
    load = model.nominal_load
    if has(f.law, "averaged"):
        return None
    if not has(f.law, "bonds"):
        return law_from(f, load).element(load)
    if impossible("recursion", f.reading, 1.0 if f.order is None else f.order):
        return None
    return points_element(model.bonds, [1.0], [load])


def steps_of(model: Model, element: Element) -> float:
    """Steps per cycle to expect: some per radian of the fastest motion, some at every reversal, and those that keep a
    state of the law which relaxes over a short path or time stable."""
    rig, modes = model.rig, model.rig.modes
    omega, period = omega_of(rig.drive), rig.drive.period
    damper = modes.damping if modes.damping is not None else np.diag(2 * modes.zeta * modes.omega)
    pace = max(float(modes.omega.max()), float(np.abs(damper).sum(axis=1).max()), omega * fastest(rig.drive))
    ease = float((modes.slide**2).sum()) / modes.mass
    rigid = 0.0 if element.length else element.limit / model.friction.reference_speed * ease * clings(model, element)
    path = 4 * model.speed / omega
    states = path / element.length if element.sizes and element.length else 0.0
    grown = model.friction.slip_growth if has(model.friction.law, "bonds") else None
    if grown:
        states = max(states, path / grown)
    return 24 + 1.2 * pace * period + (states + rigid * period) / STABLE


def clings(model: Model, element: Element) -> float:
    """Share [1] of the time that a law of the speed spends at speeds over which it turns, where it is stiff.

    One mode is held all the time by a force r of the limit up to 1, and less of the time the more is left to slide.
    """
    rig, modes = model.rig, model.rig.modes
    if modes.omega.size > 1 or not modes.slide[0]:
        return 1.0
    if not element.limit:
        return 0.0
    r = modes.mass * largest(rig.drive) * abs(modes.base[0] / modes.slide[0]) / element.limit
    return min(1.0, float(np.exp(EASES * (1 - r))))


def smooth_cost(model: Model) -> tuple:
    """Steps of all runs, and their seconds."""
    rig, cycles = model.rig, model.rig.cycles
    if sinusoidal(rig.drive) and (decay := slowest(rig.modes) * rig.drive.period) > 0:  # then it repeats
        cycles = min(cycles, 20 + REPEATS / decay)
    steps = 2 * cycles * steps_of(model, element_of(model))
    return int(steps), 0.02 + STEP * steps


