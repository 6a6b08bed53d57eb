"""Springs beside the friction interfaces, which have no memory and no loss.

F = k_3 q^3 + k/turn sin(turn q). Numbers: k_3 [N/m3] (structure.stiffening), k [N/m] and turn = 2 pi/wavelength [1/m]
(interlocking peaks of a bonded spring).
"""

from math import sin

from ..records import Friction, LawNumbers

RIGID = False


def force_and_rates(p, memory, point, s, rates):
    """Return the force of the springs.

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
    q = point.slide
    return Friction(p[0] * q**3 + p[1] / p[2] * sin(p[2] * q), 0.0, 0.0)


def write_margins(p, memory, point, s, margins):
    """Write nothing, because a spring has a single regime.

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


def switch(p, memory, point, s, which):
    """Change nothing.

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
    return False


def make_cubic(stiffness):
    """Return the numbers of a spring whose force is k_3 q^3; `stiffness` is k_3 [N/m3]."""
    return LawNumbers("springs", (stiffness, 0.0, 1.0))


def make_interlocking(stiffness, wavelength):
    """Return the numbers of a spring whose force is stiffness/k sin(k q), with k = 2 pi/wavelength.

    Parameters
    ----------
    stiffness : float
        Stiffness at q = 0 [N/m].
    wavelength : float
        Displacement between two equal states of the spring [m].

    Returns
    -------
    LawNumbers
    """
    numbers = (0.0, stiffness, 2 * 3.141592653589793 / wavelength)
    return LawNumbers("springs", numbers, stiffness=stiffness)
