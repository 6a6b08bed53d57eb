"""Bouc-Wen law: F = mu N z, z' = v/eps (1 - |z|^n (s sgn(v z) + 1 - s)) (Wen 1976). Numbers: mu, eps [m], n, s.

`memory[FLAG]` is the sign of z.
"""

from ..records import Friction, LawNumbers, Margin, Memory
from .bonds import switch as switch

RIGID = False
FLAG_SIGN = -1.0


def force_and_rates(p, memory, point, s, rates):
    """Write the rate of z; the loss is the work that its spring does not store.

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
    side = memory[Memory.FLAG]
    size = (side * s[0]) ** p[2] if side * s[0] > 0 else 0.0
    fraction = size * (p[3] * side * memory[Memory.DIRECTION] + 1 - p[3])
    rates[0] = point.velocity / p[1] * (1 - fraction)
    # The curve through a long step of a stiff law may exceed the limit, which is 1.
    force = p[0] * point.load * min(max(s[0], -1.0), 1.0)
    slip_rate = fraction * point.velocity
    return Friction(force, slip_rate, force * slip_rate)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the velocity in the direction of motion, and z times its sign.

    The rate of z has a kink where one of them is 0.

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
    margins[Margin.MOTION] = memory[Memory.DIRECTION] * point.velocity / point.speed_scale
    margins[Margin.BRANCH] = memory[Memory.FLAG] * s[0]


def from_law(law, load):
    """Return the law of a constant load [N].

    Parameters
    ----------
    law : friction.laws.bouc_wen.BoucWen
        Law per newton of load.
    load : float
        Mean load [N].
    """
    numbers = law.static, law.length, law.exponent, law.shape
    return LawNumbers("bouc_wen", numbers, (0.0,), (1e-2,))
