"""Coulomb friction with mu_s >= mu_k: a constraint at rest, mu_k N against the motion otherwise (eq. 2.1).

Numbers: mu_s, mu_k. The averaged law of Oden and Pires is Coulomb friction with the average pressure.
"""

from ..records import Friction, LawNumbers, Margin, Memory

RIGID = True
# Smallest coefficient of static friction: the margin of a rest is relative to it, and its force is at round-off
MIN_STATIC = 1e-12


def force_and_rates(p, memory, point, s, rates):
    """Return the kinetic friction force; it dissipates all of its work.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    rates : (j,) array
        Rates of the states per second, which are written.
    """
    if memory[Memory.CONTACT] < 0:
        return Friction(0.0, point.velocity, 0.0)
    force = memory[Memory.DIRECTION] * p[1] * point.load
    return Friction(force, point.velocity, force * point.velocity)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: static friction minus holding force at rest, the velocity during slip, the load.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    margins : (5,) array
        Margins of the regime, in the order of `records.Margin`, which are written.
    """
    contact = memory[Memory.CONTACT]
    margins[Margin.CONTACT] = contact * point.load / point.load_scale
    direction = memory[Memory.DIRECTION]
    if direction != 0:
        margins[Margin.MOTION] = direction * point.velocity / point.speed_scale
    elif contact > 0:
        margins[Margin.MOTION] = (p[0] * point.load - abs(point.held)) / (p[0] * point.load_scale)


def switch(p, memory, point, s, which):
    """Change the regime at an event: slip starts, stops or reverses, or the surfaces part or meet.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law, in the order that the top of the module names.
    which : int
        Margin that has vanished (`records.Margin`).
    """
    if which == Margin.CONTACT:
        memory[Memory.CONTACT] = -memory[Memory.CONTACT]
        memory[Memory.DIRECTION] = 1.0 if point.velocity >= 0 else -1.0
    elif memory[Memory.DIRECTION] == 0:
        memory[Memory.DIRECTION] = 1.0 if point.held > 0 else -1.0
    elif point.compliance == 0 or memory[Memory.CONTACT] < 0:
        memory[Memory.DIRECTION] = -memory[Memory.DIRECTION]
    else:
        memory[Memory.DIRECTION] = 0.0
    return False


def from_law(law, load):
    """Return the numbers of Coulomb's law.

    Parameters
    ----------
    law : friction.laws.coulomb.Coulomb
        Law per newton of load.
    load : float
        Mean load [N].
    """
    return LawNumbers("coulomb", (max(law.static, MIN_STATIC), law.kinetic))
