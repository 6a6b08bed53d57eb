"""Construction of friction laws from the keys of the table [friction] of a scene."""

from importlib import import_module
from math import inf

from ..effects import LAWS, law_has_trait
from .protocol import SteadyLoop


def make_law(friction, load: float = 1.0):
    """Return the friction law defined by the keys of a [friction] table, all of which must be given.

    Parameters
    ----------
    friction : table
        Keys in SI units.
    load : float
        Load [N] on the whole contact, to which a stiffness in the table refers.

    Returns
    -------
    object
        A law as in `protocol`.
    """
    return import_module(LAWS[friction.law].module).from_keys(friction, load)


def stick_stiffness(friction, load: float) -> float:
    """Return the tangential stiffness [N/m] of a friction law before slip, under a load [N].

    It is infinite for a law that sticks rigidly, and 0 for a law that creeps.
    """
    if law_has_trait(friction.law, "creeps"):
        return 0.0
    if law_has_trait(friction.law, "bonds"):
        return friction.static * load / friction.bond_length
    if law_has_trait(friction.law, "averaged"):
        return inf
    element = make_law(friction, load).element(load)
    return element.limit / element.length if element.length else inf


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
    loop_from_keys = getattr(import_module(LAWS[friction.law].module), "loop_from_keys", None)
    return None if loop_from_keys is None else loop_from_keys(friction, load, amplitude)
