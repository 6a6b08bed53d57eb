"""Elastic-plastic contact whose springs come with the load (eq. 3.12 under a load that varies).

A load N has springs of density s [N] with stiffness mu s/eps. More load adds unstretched springs; springs beyond a load
that falls break as the contact slips. States: y (force over mu [N]) and s. Numbers: mu, eps [m].

`memory[FLAG]` is the side on which the contact slips (0: it sticks), `memory[COUNT]` is 1 while the density grows with the
load and -1 while it does not.
"""

from ..records import Friction, LawNumbers, Margin, Memory

RIGID = False


def force_and_rates(p, memory, point, s, rates):
    """Write the rates of both states, force over mu and density of springs, which are continuous where slip starts and ends.

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
    side = memory[Memory.FLAG]
    growth = point.load_rate if memory[Memory.COUNT] > 0 else 0.0
    v = point.velocity
    if side == 0:
        rates[0] = s[1] * v / p[1]
        rates[1] = growth
        force = p[0] * s[0]
    else:
        # The force follows the load; only a rising load stretches the springs further. The others break as they slip.
        elastic = side * max(point.load_rate, 0.0) * p[1] / s[1] if s[1] > 0 else 0.0
        rates[0] = side * point.load_rate
        breaking = max(s[1] - point.load, 0.0) * max(side * (v - elastic), 0.0) / p[1]
        rates[1] = growth - breaking
        force = side * p[0] * point.load

    # The slip is the slide less the mean stretch eps y/s, whose limit as the pieces touch is half of the slide.
    stretch = s[0] / s[1] if s[1] > 0 else 0.0
    stretch_rate = p[1] * (rates[0] - stretch * rates[1]) / s[1] if s[1] > 0 else 0.5 * v
    # What the springs do not store, E = mu eps y^2/(2 s), is lost: also where a falling load cuts their force at rest.
    storing = p[0] * p[1] * stretch * (rates[0] - 0.5 * stretch * rates[1])
    return Friction(force, v - stretch_rate, force * v - storing)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the distance to slip or its rate, the growth of the density of springs, and the load.

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
    if contact < 0:
        return
    if memory[Memory.COUNT] > 0:
        margins[Margin.LIMIT] = point.load_rate / point.load_rate_scale
    else:
        margins[Margin.LIMIT] = (s[1] - point.load) / point.load_scale
    side = memory[Memory.FLAG]
    if side == 0:
        margins[Margin.BRANCH] = (point.load - abs(s[0])) / point.load_scale
    else:
        stretch_rate = side * s[1] * point.velocity / p[1]
        margins[Margin.BRANCH] = (stretch_rate - point.load_rate) / point.load_rate_scale


def switch(p, memory, point, s, which):
    """Change the regime at an event: slip or growth starts or ends, or the surfaces part or meet, which breaks all springs.

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
        s[0] = 0.0
        s[1] = 0.0
        memory[Memory.FLAG] = 0.0
        memory[Memory.COUNT] = 1.0
    elif which == Margin.LIMIT:
        # The density is that of the load where growth starts or ends, whatever the error of its integral.
        memory[Memory.COUNT] = -memory[Memory.COUNT]
        s[1] = point.load
    elif memory[Memory.FLAG] == 0:
        memory[Memory.FLAG] = 1.0 if s[0] > 0 else -1.0
    else:
        s[0] = memory[Memory.FLAG] * point.load
        memory[Memory.FLAG] = 0.0
    return False


def from_law(law, load):
    """Return the elastic-plastic law of a load that varies around `load` [N].

    Parameters
    ----------
    law : friction.laws.elastic_plastic.ElasticPlastic
        Law per newton of load.
    load : float
        Mean load [N].
    """
    return LawNumbers("pressed_springs", (law.static, law.length), (0.0, load), (load, load))
