"""Coulomb friction on the flanks of matched sinusoidal grooves, which lift a mass m (`friction.grooves`).

With the slope t = A k sin(k q - phase) and phi = +-mu, the tangential force is F = V (t + phi)/(1 - phi t). The vertical
force V = N + m (t q'' + t' q'^2) carries load and lifted mass. The acceleration q'' is that without friction less F times
the compliance c, which gives V in closed form. Numbers: mu_s, mu_k, A [m], k [1/m], phase, m [kg].
"""

from math import cos, sin

from ..records import Friction, LawNumbers, Margin, Memory

RIGID = True


def force_and_rates(p, memory, point, s, rates):
    """Return the force on the flank; friction dissipates what does not lift the load.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law.
    rates : (n,) array
        Rates, which are written.
    """
    angle = p[3] * point.slide - p[4]
    slope = p[2] * p[3] * sin(angle)
    bend = p[2] * p[3] ** 2 * cos(angle)
    phi = memory[Memory.DIRECTION] * p[1]
    ratio = (slope + phi) / (1 - phi * slope)
    still = point.load + p[5] * (slope * point.free + bend * point.velocity**2)
    vertical = still / (1 + p[5] * slope * ratio * point.compliance)
    loss = (ratio - slope) * vertical * point.velocity
    return Friction(ratio * vertical, point.velocity, loss)


def write_margins(p, memory, point, s, margins):
    """Write the distance to slip up or down the flank or the velocity, and the vertical force.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law.
    margins : array
        Margins, which are written.
    """
    angle = p[3] * point.slide - p[4]
    slope = p[2] * p[3] * sin(angle)
    direction = memory[Memory.DIRECTION]
    if direction == 0:
        up = point.load * (slope + p[0]) / (1 - p[0] * slope) - point.held
        down = point.held - point.load * (slope - p[0]) / (1 + p[0] * slope)
        margins[Margin.MOTION] = min(up, down) / (p[0] * point.load_scale)
        margins[Margin.CONTACT] = 1.0
        return
    phi = direction * p[1]
    ratio = (slope + phi) / (1 - phi * slope)
    bend = p[2] * p[3] ** 2 * cos(angle)
    still = point.load + p[5] * (slope * point.free + bend * point.velocity**2)
    margins[Margin.CONTACT] = (
        still / (1 + p[5] * slope * ratio * point.compliance) / point.load_scale
    )
    margins[Margin.MOTION] = direction * point.velocity / point.speed_scale


def switch(p, memory, point, s, which):
    """Start or stop the slip; the run ends where the lifted mass takes all of the load.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    s : (j,) array
        States of the law.
    which : int
        Margin that has vanished (`records.Margin`).
    """
    if which == Margin.CONTACT:
        return True
    slope = p[2] * p[3] * sin(p[3] * point.slide - p[4])
    if memory[Memory.DIRECTION] == 0:
        memory[Memory.DIRECTION] = 1.0 if point.held > point.load * slope else -1.0
    elif point.compliance == 0:
        memory[Memory.DIRECTION] = -memory[Memory.DIRECTION]
    else:
        memory[Memory.DIRECTION] = 0.0
    return False


def make_grooves(friction, grooves):
    """Return Coulomb friction on `friction.grooves.Grooves`."""
    kinetic = friction.static if friction.kinetic is None else friction.kinetic
    shape = grooves.amplitude, grooves.wave_number, grooves.phase, grooves.lifted_mass
    return LawNumbers("grooves", (friction.static, kinetic, *shape))
