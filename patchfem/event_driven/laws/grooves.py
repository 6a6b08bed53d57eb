"""Friction on the flanks of matched sinusoidal grooves, which lift a mass m (`friction.grooves`).

With the slope t = A k sin(k q - phase) and phi = +-mu, the tangential force is F = V (t + phi)/(1 - phi t). The vertical
force V = N + m (t q'' + t' q'^2) carries load and lifted mass. The acceleration q'' is that without friction less F times
the compliance c, which gives V in closed form. With a reference speed v_0 > 0, phi = mu tanh(sqrt(1 + t^2) v/v_0) (eq. 2.4)
and the law is `smooth_grooves`. Numbers: mu_s, mu_k, v_0 [m/s], A [m], k [1/m], phase, m [kg].
"""

from math import cos, sin, sqrt, tanh
from typing import NamedTuple

from ..records import Friction, LawNumbers, Margin, Memory

RIGID = True
HELPERS = ("find_flank",)


class Flank(NamedTuple):
    """Slope of a flank, and the forces on it.

    - slope: dz/dq [1]
    - ratio: tangential force / vertical force [1]
    - vertical: force that carries the load and the lifted mass [N]
    """

    slope: float
    ratio: float
    vertical: float


def find_flank(p, memory, point):
    """Return the `Flank` at the slide of an interface; without a direction of slip as if there were no friction.

    Parameters
    ----------
    p : (k,) array
        Numbers of the law, in the order that the top of the module names.
    memory : (l,) array
        Row of `records.State.memory`.
    point : Point
        Load and motion of the interface.
    """
    angle = p[4] * point.slide - p[5]
    slope = p[3] * p[4] * sin(angle)
    bend = p[3] * p[4] ** 2 * cos(angle)
    phi = memory[Memory.DIRECTION] * p[1]
    if p[2] > 0:
        phi = p[1] * tanh(sqrt(1 + slope**2) * point.velocity / p[2])
    ratio = (slope + phi) / (1 - phi * slope)

    # The vertical force carries the load and the lifted mass, whose acceleration depends on the force.
    still = point.load + p[6] * (slope * point.free + bend * point.velocity**2)
    return Flank(slope, ratio, still / (1 + p[6] * slope * ratio * point.compliance))


def force_and_rates(p, memory, point, s, rates):
    """Return the force on the flank; friction dissipates what does not lift the load.

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
    flank = find_flank(p, memory, point)
    loss = (flank.ratio - flank.slope) * flank.vertical * point.velocity
    return Friction(flank.ratio * flank.vertical, point.velocity, loss)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the distance to slip along the flank at rest, the velocity during slip, the load.

    The load is the vertical force that the flank carries.

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
    flank = find_flank(p, memory, point)
    direction = memory[Memory.DIRECTION]
    if direction == 0:
        up = point.load * (flank.slope + p[0]) / (1 - p[0] * flank.slope) - point.held
        down = point.held - point.load * (flank.slope - p[0]) / (1 + p[0] * flank.slope)
        margins[Margin.MOTION] = min(up, down) / (p[0] * point.load_scale)
        margins[Margin.CONTACT] = 1.0
        return
    margins[Margin.CONTACT] = flank.vertical / point.load_scale
    if p[2] == 0:
        margins[Margin.MOTION] = direction * point.velocity / point.speed_scale


def switch(p, memory, point, s, which):
    """Start or stop the slip; the run ends where the lifted mass takes all of the load.

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
        return True
    if memory[Memory.DIRECTION] == 0:
        slope = find_flank(p, memory, point).slope
        memory[Memory.DIRECTION] = 1.0 if point.held > point.load * slope else -1.0
    elif point.compliance == 0:
        memory[Memory.DIRECTION] = -memory[Memory.DIRECTION]
    else:
        memory[Memory.DIRECTION] = 0.0
    return False


def make_grooves(friction, grooves):
    """Return the law of keys of [friction] on `friction.grooves.Grooves`: Coulomb's, or the rate law."""
    speed = friction.reference_speed or 0.0
    kinetic = friction.static if speed or friction.kinetic is None else friction.kinetic
    shape = grooves.amplitude, grooves.wave_number, grooves.phase, grooves.lifted_mass
    law = "smooth_grooves" if speed else "grooves"
    return LawNumbers(law, (friction.static, kinetic, speed, *shape))
