"""Construction of friction laws from the keys of the table [friction] of a scene."""

from importlib import import_module
from math import inf

import numpy as np

from ..core import MIN_LOAD
from ..effects import LAWS, law_has_trait
from .protocol import SteadyLoop


def make_law(friction, load: float = 1.0):
    """Return the friction law defined by the keys of a [friction] table, per newton of load.

    All engines take their numbers from the attributes of this law. Laws with bonds have no such function, because their
    rest speed follows from the motion (`model.law.make_bond_parameters`).

    Parameters
    ----------
    friction : table
        Keys in SI units; floats, or arrays (c,) of the values of c contacts.
    load : float or (c,) array
        Load [N] on the whole contact, to which a stiffness in the table refers.

    Returns
    -------
    object
        A law as in `protocol`.
    """
    load = np.maximum(load, MIN_LOAD)
    return import_module(LAWS[friction.law].module).from_keys(friction, load)


def stick_stiffness(friction, load: float) -> float:
    """Return the tangential stiffness [N/m] of a friction law before slip, under a load [N].

    It is infinite for a law that sticks rigidly, and 0 for a law that creeps.
    """
    if law_has_trait(friction.law, "creeps"):
        return 0.0
    if law_has_trait(friction.law, "bonds"):
        return friction.static * load / friction.bond_length
    law = make_law(friction, load)
    return law.static * load / law.length if law.length else inf


def steady_loop(friction, load: float, amplitude: float) -> SteadyLoop | None:
    """Return the steady friction loop of a law in closed form, or None if there is no closed form.

    Parameters
    ----------
    friction : table
        Keys in SI units.
    load, amplitude : float
        Load [N], amplitude of the relative displacement [m].

    Returns
    -------
    SteadyLoop or None
    """
    if law_has_trait(friction.law, "bonds") or law_has_trait(friction.law, "averaged"):
        return None
    find_loop = getattr(make_law(friction, load), "steady_loop", None)
    return None if find_loop is None else find_loop(load, amplitude)
