"""A law under a given force instead of a given slide: quasi-static, one straight increment per change of force."""

import numpy as np
from scipy.optimize import brentq

from patchfem.friction.bonds.quadrature import Quadrature


class OutOfReach(ArithmeticError):
    """No slide of up to 50 bond lengths brings the law to the force."""


def held_at(engine, state, target: float, sigma, dt: float = 1.0, length: float = 1.0) -> tuple:
    """(slide [m], state) that brings the traction to `target` [Pa] in one straight step under sigma (1,) [Pa].

    dt [s] is the time of the step, length [m] the scale of the search. OutOfReach where the law does not get there.
    """

    def after(dq):
        # the sum over the bonds once, not at every Gauss point of the increment
        if isinstance(engine, Quadrature):
            return engine.advance(state, dq, sigma, sigma, dt)
        return engine.step(state, dq, sigma, sigma, dt).state

    def miss(dq):
        return float(engine.traction(after(dq))[0]) - target

    now = float(engine.traction(state)[0])
    if abs(now - target) <= 1e-13:
        return 0.0, after(0.0)
    way = length if target > now else -length
    far = 0.05
    while miss(way * far) * way < 0:
        far *= 1.5
        if far > 50:
            raise OutOfReach(f"the law cannot reach {target:g} from {now:g}")
    dq = brentq(miss, 0.0, way * far, xtol=1e-15 * length, rtol=1e-14)
    if abs(miss(dq)) > 1e-6:  # a root of a force is as steep as |u|^p
        raise OutOfReach(f"the law jumps over {target:g} from {now:g}")
    return dq, after(dq)


def slides(
    engine,
    forces,
    loads,
    cycles: int = 12,
    pieces: int = 1,
    period: float = 2.0,
    length: float = 1.0,
):
    """Slide (cycles,) [m] at the end of every cycle of a dither that runs from one pair of force and load to the next,
    forces[k] [Pa] under loads[k] [Pa], k = 0, 1, ... in turn, from rest under 1 Pa.

    Force and load change together in `pieces` straight pieces of each change: half the load (`press`), the force, the
    other half. period [s] of a cycle.
    """
    state = engine.start(np.ones(1))
    load = 1.0
    force = 0.0
    slide = 0.0
    ends = []
    dt = period / (len(forces) * pieces)
    for _ in range(cycles):
        for next_force, next_load in zip(forces, loads):
            marks = np.linspace(load, next_load, 2 * pieces + 1)[:, None]
            for k, target in enumerate(np.linspace(force, next_force, pieces + 1)[1:]):
                before, middle, after = marks[2 * k : 2 * k + 3]
                if load != next_load:
                    state = engine.press(state, before, middle).state
                dq, state = held_at(engine, state, float(target), middle, dt, length)
                slide += dq
                if load != next_load:
                    state = engine.press(state, middle, after).state
                    dq, state = held_at(engine, state, float(target), after, 0.0, length)
                    slide += dq
            load = next_load
            force = next_force
        ends.append(slide)
    return np.array(ends)


def drift(engine, forces, loads, cycles: int = 12, **more) -> float:
    """Slide [m] over the last of the cycles; arguments of `slides`."""
    ends = slides(engine, forces, loads, cycles, **more)
    return float(ends[-1] - ends[-2])
