"""LuGre law (Canudas de Wit et al. 1995): F = N (c z + b z' + d v), z' = v - c |v| z/g(v).

g(v) = mu_k + (mu_s - mu_k) exp(-(v/v_s)^2). Numbers: mu_s, mu_k, c [1/m], v_s [m/s], b, d [s/m], per load.
"""

from math import exp

from ..records import Friction, LawNumbers, Margin, Memory
from .bonds import switch as switch

RIGID = False
MAX_RISE_SPEED = 6.0  # largest speed, relative to v_s, at which g exceeds mu_k by more than e^-36
MIN_LIMIT = 1e-9  # smallest g relative to mu_s; the rate of z divides by it


def force_and_rates(p, memory, point, s, rates):
    """Write the rate of z; the loss is the work that the bristles do not store.

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
    v = point.velocity
    limit = max(p[1] + (p[0] - p[1]) * exp(-((v / p[3]) ** 2)), MIN_LIMIT * p[0])
    slip_rate = memory[Memory.DIRECTION] * p[2] * s[0] / limit * v
    rates[0] = v - slip_rate
    force = point.load * (p[2] * s[0] + p[4] * rates[0] + p[5] * v)
    return Friction(force, slip_rate, force * v - point.load * p[2] * s[0] * rates[0])


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the velocity, and the distance of the speed from that above which g is mu_k.

    The stages of a step may all lie beside the narrow range of speeds where g is larger.

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
    speed = memory[Memory.DIRECTION] * point.velocity
    margins[Margin.MOTION] = speed / point.speed_scale
    if p[0] > p[1]:
        margins[Margin.SPEED] = memory[Memory.FLAG] * (speed / (MAX_RISE_SPEED * p[3]) - 1)


def from_law(law, load):
    """Return the law of a constant load [N], to which stiffness and damping refer.

    Parameters
    ----------
    law : friction.laws.lugre.LuGre
        Law per newton of load.
    load : float
        Mean load [N].
    """
    numbers = (law.static, law.kinetic, law.stiffness, law.speed, law.micro_damping, law.viscous)
    return LawNumbers("lugre", numbers, (0.0,), (1e-2 * law.length,))
