"""Friction that depends smoothly on the speed along the flanks of matched grooves (eq. 2.4 on `friction.grooves`).

With the slope t = A k sin(k q - phase), phi = mu tanh(sqrt(1 + t^2) v/v_0) takes the place of +-mu in the law `grooves`.
Numbers: mu, v_0 [m/s], A [m], k [1/m], phase, m [kg].
"""

from math import cos, sin, sqrt, tanh

from ..records import Friction, LawNumbers, Margin

RIGID = False


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
    phi = p[0] * tanh(sqrt(1 + slope**2) * point.velocity / p[1])
    ratio = (slope + phi) / (1 - phi * slope)

    # The vertical force carries the load and the lifted mass, whose acceleration depends on the force.
    still = point.load + p[5] * (slope * point.free + bend * point.velocity**2)
    vertical = still / (1 + p[5] * slope * ratio * point.compliance)
    loss = (ratio - slope) * vertical * point.velocity
    return Friction(ratio * vertical, point.velocity, loss)


def write_margins(p, memory, point, s, margins):
    """Write the vertical force.

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
    bend = p[2] * p[3] ** 2 * cos(angle)
    phi = p[0] * tanh(sqrt(1 + slope**2) * point.velocity / p[1])
    ratio = (slope + phi) / (1 - phi * slope)
    still = point.load + p[5] * (slope * point.free + bend * point.velocity**2)
    margins[Margin.CONTACT] = (
        still / (1 + p[5] * slope * ratio * point.compliance) / point.load_scale
    )


def switch(p, memory, point, s, which):
    """End the run where the lifted mass takes all of the load.

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
    return True


def make_grooves(friction, grooves):
    """Return the law of keys of [friction] on `friction.grooves.Grooves`."""
    shape = grooves.amplitude, grooves.wave_number, grooves.phase, grooves.lifted_mass
    return LawNumbers("smooth_grooves", (friction.static, friction.reference_speed, *shape))
