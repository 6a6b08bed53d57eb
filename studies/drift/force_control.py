"""A law under a given force instead of a given slide: quasi-static, one straight increment per change of force."""

import numpy as np
from scipy.optimize import brentq


class OutOfReach(ArithmeticError):
    """Raised if no slide of up to 50 bond lengths brings the law to the force."""


def slide_to_traction(
    engine, state, target: float, sigma, dt: float = 1.0, length: float = 1.0
) -> tuple:
    """Find the slide [m] that brings the traction to a target in one straight step, and the state after this step.

    Parameters
    ----------
    engine : law
    state : state of the law
    target : float
        Traction [Pa].
    sigma : (1,) array
        Pressure [Pa].
    dt : float
        Time of the step [s].
    length : float
        Scale of the search [m].

    Raises
    ------
    OutOfReach
        If the law does not reach the target.
    """

    def after(dq):
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
    if abs(miss(dq)) > 1e-6:  # loose, since the force may change as steeply as |u|^p
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
    """Return the slide (cycles,) [m] at the end of every cycle of a periodic force and load.

    Force and load change together in each piece: half the load (`press`), the force, the other half.

    Parameters
    ----------
    engine : law
    forces, loads : sequence of float
        forces[k] [Pa] under loads[k] [Pa] in turn, from rest under 1 Pa.
    cycles : int
    pieces : int
        Straight pieces of each change.
    period : float
        Of a cycle [s].
    length : float
        Scale of the search [m].
    """
    state = engine.initial_state(np.ones(1))
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
                dq, state = slide_to_traction(engine, state, float(target), middle, dt, length)
                slide += dq
                if load != next_load:
                    state = engine.press(state, middle, after).state
                    dq, state = slide_to_traction(engine, state, float(target), after, 0.0, length)
                    slide += dq
            load = next_load
            force = next_force
        ends.append(slide)
    return np.array(ends)


def drift(engine, forces, loads, cycles: int = 12, **more) -> float:
    """Return the slide [m] over the last cycle of a periodic force.

    Parameters
    ----------
    engine : law
    forces, loads : sequence of float
        As in `slides`.
    cycles : int
    **more
        Further parameters of `slides`.
    """
    ends = slides(engine, forces, loads, cycles, **more)
    return float(ends[-1] - ends[-2])
