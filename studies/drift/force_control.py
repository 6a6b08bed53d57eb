"""Contact points under a given force instead of a given slide: quasi-static, one straight increment per change of force."""

import numpy as np
from scipy.optimize import brentq

from patchfem.time_steps import follow


class OutOfReach(ArithmeticError):
    """Raised if no slide of up to 50 bond lengths brings the points to the force."""


class ForcedPoints:
    """Contact points with their path so far, each sample of which is found from a force.

    Parameters
    ----------
    make_contact : callable
        Function that returns the contact under a load that is a function of times (k,) [s].
    length : float
        Scale of the search [m].
    """

    def __init__(self, make_contact, length: float):
        self.contact = make_contact(lambda times: np.interp(times, self.times, self.loads))
        self.length = length
        self.times = [0.0]
        self.loads = [1.0]
        self.path = [0.0]

    def move_to_force(self, target: float, load: float, dt: float) -> float:
        """Append a straight step of a duration dt [s] that ends under a load [N] with a force [N]; return its end [m].

        Raises
        ------
        OutOfReach
            If the points do not reach the force.
        """
        self.times.append(self.times[-1] + dt)
        self.loads.append(load)
        start = self.path[-1]

        def miss(dq):
            return follow(self.contact, self.times, [*self.path, start + dq]).force[-1] - target

        now = miss(0.0)
        if abs(now) > 1e-13:
            way = -self.length if now > 0 else self.length
            far = 0.05
            while miss(way * far) * way < 0:
                far *= 1.5
                if far > 50:
                    raise OutOfReach(f"the points cannot reach {target:g}")
            dq = brentq(miss, 0.0, way * far, xtol=1e-15 * self.length, rtol=1e-14)
            if abs(miss(dq)) > 1e-6:  # loose, since the force may change as steeply as |u|^p
                raise OutOfReach(f"the points jump over {target:g}")
            start += dq
        self.path.append(start)
        return start


def slides(
    make_contact,
    forces,
    loads,
    cycles: int = 12,
    pieces: int = 1,
    period: float = 2.0,
    length: float = 1.0,
):
    """Return the slide (cycles,) [m] at the end of every cycle of a periodic force and load.

    Parameters
    ----------
    make_contact : callable
        Function that returns the contact under a load that is a function of time.
    forces, loads : sequence of float
        forces[k] [N] under loads[k] [N] in turn, from rest under 1 N.
    cycles : int
    pieces : int
        Straight pieces of each change, along which force and load change together.
    period : float
        Of a cycle [s].
    length : float
        Scale of the search [m].
    """
    points = ForcedPoints(make_contact, length)
    load = 1.0
    force = 0.0
    ends = []
    dt = period / (len(forces) * pieces)
    for _ in range(cycles):
        for next_force, next_load in zip(forces, loads):
            marks = zip(
                np.linspace(force, next_force, pieces + 1)[1:],
                np.linspace(load, next_load, pieces + 1)[1:],
            )
            for target, load_after in marks:
                slide = points.move_to_force(float(target), float(load_after), dt)
            load = next_load
            force = next_force
        ends.append(slide)
    return np.array(ends)


def drift(make_contact, forces, loads, cycles: int = 12, **more) -> float:
    """Return the slide [m] over the last cycle of a periodic force.

    Parameters
    ----------
    make_contact : callable
    forces, loads : sequence of float
        As in `slides`.
    cycles : int
    **more
        Further parameters of `slides`.
    """
    ends = slides(make_contact, forces, loads, cycles, **more)
    return float(ends[-1] - ends[-2])
