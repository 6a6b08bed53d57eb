"""Bonds of order 1 with reading = "stretch" (eq. 2.17), summed by their moments, with growth (eq. 2.10).

With the bond length eps of new bonds, the density m, the mean stretch z and the mean square stretch w of the bonds per
load obey, along the path |v| dt,

    m' = (1 - m)|v|/eps,   z' = m v - z|v|/eps,   w' = 2 z v - w|v|/eps,   F = mu N z/eps_0,

and eps' = a_s/max(|v|, v_h) (eps_0 - eps) + |v|/l_k (eps_k - eps). Stored energy: mu N w/(2 eps_0). States: m, z, w, eps.
Numbers: mu, eps_0, eps_k [m], a_s [m/s2] (0: eps is constant), l_k [m], v_h [m/s]. `memory[FLAG]` is 1 above the
speed v_h.
"""

from ...exceptions import PatchfemError
from ..records import Friction, LawNumbers, Margin, Memory

RIGID = False
STATE_SIGNS = (1.0, -1.0, 1.0, 1.0)
MIN_DENSITY = 1e-30  # density below which no bond exists that could slip
DENSITY_SCALE = 1.0  # largest density, to which its error is relative


def force_and_rates(p, memory, point, s, rates):
    """Write the rates of the moments; slip is the displacement less the mean stretch z/m.

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
    density = s[0]
    stretch = s[1]
    square = s[2]
    bond_length = s[3]
    friction = p[0]
    first_length = p[1]
    v = point.velocity
    speed = memory[Memory.DIRECTION] * v

    # Growth: eps' = a_s/max(|v|, v_h) (eps_0 - eps) + |v|/l_k (eps_k - eps)
    growth = p[3]
    if growth > 0:
        growth_speed = speed if memory[Memory.FLAG] > 0 else p[5]
        rest_rate = growth / growth_speed * (first_length - bond_length)
        rates[3] = rest_rate + speed / p[4] * (p[2] - bond_length)

    # Rates m', z' and w' of the density and of the first and second moment of the stretch
    breaking = speed / bond_length
    rates[0] = (1 - density) * breaking
    rates[1] = density * v - stretch * breaking
    rates[2] = 2 * stretch * v - square * breaking

    stiffness = friction * point.load / first_length
    slip_rate = stretch * breaking / density**2 if density > MIN_DENSITY else 0.0
    return Friction(stiffness * stretch, slip_rate, 0.5 * stiffness * square * breaking)


def write_margins(p, memory, point, s, margins):
    """Write the margins of a regime: the velocity in the direction of motion, and the distance of the speed from v_h.

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
    if p[3] > 0:
        margins[Margin.BRANCH] = memory[Memory.FLAG] * (speed - p[5]) / p[5]


def switch(p, memory, point, s, which):
    """Change the regime at an event: the direction of motion, or the sign that `memory[FLAG]` has in the law.

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
    column = Memory.DIRECTION if which == Margin.MOTION else Memory.FLAG
    memory[column] = -memory[column]
    return False


def from_law(law, load):
    """Return the law of a constant load; only order 1 with reading = "stretch" has moments that close.

    Parameters
    ----------
    law : friction.bonds.parameters.Bonds
        Parameters of the bonds.
    load : float
        Mean load [N].
    """
    if law.reading != "stretch" or law.order != 1:
        raise PatchfemError(
            "bonds with reading = 'report' or an order other than 1 have no finite set of rates, so their motion is not "
            "computed from event to event",
            "friction.reading",
        )
    length = law.length
    growth = law.growth or (0.0, 1.0, 1.0)
    numbers = (law.static, length, law.ratio * length, *growth)
    scales = (DENSITY_SCALE, 1e-2 * length, 1e-4 * length**2, length)
    return LawNumbers("bonds", numbers, (law.initial, 0.0, 0.0, length), scales)
