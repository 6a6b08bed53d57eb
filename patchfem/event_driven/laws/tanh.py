"""Rate law mu N tanh(v/v_0) (eq. 2.4), which never sticks. Numbers: mu, v_0 [m/s]."""

from math import tanh

from ..records import Friction, LawNumbers, Margin, Memory

RIGID = False


def force_and_rates(p, memory, point, s, rates):
    """Return the force, which is a function of the velocity and dissipates all of its work.

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
    force = p[0] * point.load * tanh(point.velocity / p[1])
    return Friction(force, point.velocity, force * point.velocity)


def write_margins(p, memory, point, s, margins):
    """Write the only margin of this law, the load, which vanishes where the surfaces part.

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
    margins[Margin.CONTACT] = memory[Memory.CONTACT] * point.load / point.load_scale


def switch(p, memory, point, s, which):
    """Change the regime at an event: the surfaces part or meet.

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
    memory[Memory.CONTACT] = -memory[Memory.CONTACT]
    return False


def from_law(law, load):
    """Return the numbers of the rate law.

    Parameters
    ----------
    law : friction.laws.tanh.TanhLaw
        Law per newton of load.
    load : float
        Mean load [N].
    """
    return LawNumbers("tanh", (law.static, law.speed))
